"""Simplices cut by a linear function: sub-simplices on both sides, and the interface between.

Fractions are products of positive cut positions (no cancellation): tiny pieces keep their
relative accuracy.
"""

import numpy as np

from xcrack.base.arrays import Floats, Ints

_NOTHING = 1e-30  # sub-cells below this share of their cell are left out


def cut_simplices(phi: Floats) -> tuple[Floats, Floats, Ints, Ints]:
    """Sub-simplices of simplices with vertex values phi `(k, d + 1)` of both signs.

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

    bary, fraction, side, parent = splitting.cut_simplices(np.ascontiguousarray(phi), _NOTHING)
    return bary, fraction, side, parent


def interface_simplices(phi: Floats) -> tuple[Floats, Ints]:
    """Segments or triangles on which phi `(k, d + 1)` of both signs vanishes.

    Returns
    -------
    bary : (s, d, d + 1) array
        Vertices in the barycentric coordinates of the parent.
    parent : (s,) array of int
    """
    from xcrack.mesh.kernels import splitting

    bary, parent = splitting.interface_simplices(np.ascontiguousarray(phi))
    return bary, parent
