"""Simplices cut by a linear function: sub-simplices on both sides, and the interface between.

Fractions are products of positive cut positions (no cancellation): tiny pieces keep their
relative accuracy.
"""

import numpy as np

from xcrack.base.arrays import Floats, Ints

_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def cut_simplices(phi: Floats, x: Floats | None = None) -> tuple[Floats, Floats, Ints, Ints]:
    """Sub-simplices of simplices with vertex values of both signs.

    Parameters
    ----------
    phi : (k, d + 1) array
    x : (k, d + 1, m) array, optional
        Vertices. What several vertices have equal values in is split by distances between them,
        without them by the order of the vertices.

    Returns
    -------
    bary : (s, d + 1, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    fraction : (s,) array
        Share of the parent's volume, a product of positive cut positions.
    side : (s,) array of int
    parent : (s,) array of int
    """
    from xcrack.mesh.kernels import splitting

    bary, fraction, side, parent = splitting.cut_simplices(*_arrays(phi, x), _NOTHING)
    return bary, fraction, side, parent


def interface_simplices(phi: Floats, x: Floats | None = None) -> tuple[Floats, Ints]:
    """Segments or triangles on which a function of both signs vanishes.

    Parameters
    ----------
    phi : (k, d + 1) array
    x : (k, d + 1, m) array, optional
        As of `cut_simplices`.

    Returns
    -------
    bary : (s, d, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    parent : (s,) array of int
    """
    from xcrack.mesh.kernels import splitting

    bary, parent = splitting.interface_simplices(*_arrays(phi, x))
    return bary, parent


def _arrays(phi: Floats, x: Floats | None) -> tuple[Floats, Floats]:
    """Both as kernels take them."""
    vertices = np.zeros((0, phi.shape[1], 1)) if x is None else np.ascontiguousarray(x)
    return np.ascontiguousarray(phi), vertices
