"""The next mesh in 2D of several scenes that share one: states of cracks that grow."""

from collections.abc import Sequence

import numpy as np

from xcrack.adaptivity.measured import Measured
from xcrack.adaptivity.next_2d import at_coarse_tips
from xcrack.adaptivity.wanted import smaller
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine_to

_ORDER = 2
_SWEEPS = 5


def joint_mesh(each: Sequence[Measured], wanted: Sequence[float], aim: float) -> Mesh:
    """A finer mesh, by the cells' contributions to the bars of all scenes.

    Parameters
    ----------
    each : sequence of Measured
        On the same mesh.
    wanted : sequence of float, stress · √length
        Half-width that K of each is to have.
    aim : float
        Share of it that bars of the next mesh are foretold to have.
    """
    mesh = each[0].problem.mesh
    shares = np.concatenate([now.shares / w for now, w in zip(each, wanted, strict=True)])
    bar = np.concatenate([now.bar.ravel() / w for now, w in zip(each, wanted, strict=True)])
    ratio = smaller(shares, bar, aim, _ORDER, mesh.dim)
    for now in each:
        ratio = np.minimum(ratio, at_coarse_tips(now))
    return refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)


__all__ = ["joint_mesh"]
