"""The next mesh in 2D of several scenes that share one: states of cracks that grow."""

from collections.abc import Sequence

import numpy as np

from xcrack.adaptivity.indicators import Indicators
from xcrack.adaptivity.sizes_2d import at_coarse_tips
from xcrack.adaptivity.target_error import size_ratios
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine_to

_ORDER = 2
_SWEEPS = 5


def joint_mesh(indicators: Sequence[Indicators], target: Sequence[float], aim: float) -> Mesh:
    """A finer mesh, by the cells' contributions to the bars of all scenes.

    Parameters
    ----------
    indicators : sequence of Indicators
        On the same mesh.
    target : sequence of float, stress · √length
        Half-width that K of each is to have.
    aim : float
        Share of it that bars of the next mesh are foretold to have.
    """
    mesh = indicators[0].problem.mesh
    shares = np.concatenate(
        [current.shares / w for current, w in zip(indicators, target, strict=True)]
    )
    bar = np.concatenate(
        [current.bar.ravel() / w for current, w in zip(indicators, target, strict=True)]
    )
    ratio = size_ratios(shares, bar, aim, _ORDER, mesh.dim)
    for current in indicators:
        ratio = np.minimum(ratio, at_coarse_tips(current))
    return refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)


__all__ = ["joint_mesh"]
