"""Structured meshes."""

from itertools import permutations
from math import factorial
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, Points, check_arguments
from xcrack.base.arrays import Bools, Ints
from xcrack.base.errors import MeshError
from xcrack.mesh.mesh import Mesh, sound_mesh

_MOST_CELLS = 1e8  # more do not fit into the memory of any machine that solves them
_SIDES = [("left", "right"), ("front", "back"), ("bottom", "top")]  # of the first, inner, last axis


@check_arguments(MeshError)
def box(
    lower: Annotated[ArrayLike, Points((None,))],
    upper: Annotated[ArrayLike, Points((None,))],
    n: Annotated[int | tuple[int, ...], Array(is_whole=True)],
) -> Mesh:
    """Structured simplices in a box, diagonals alternating from cell to cell.

    Parameters
    ----------
    lower, upper : (d,) array, length
        Opposite corners, d = 2 or 3.
    n : int or tuple of int
        Cells a direction.

    Returns
    -------
    Mesh
        Facet sets ``left/right`` (x), ``bottom/top`` (last axis), in 3D ``front/back`` (y).

    Raises
    ------
    MeshError
        Corners that do not span a box, or no cells, or too many.

    Examples
    --------
    >>> box((0, 0), (2, 1), (4, 2))
    Mesh(15 points, 16 triangles, facet sets: left, right, bottom, top, boundary)
    """
    x_min, x_max, count = np.asarray(lower), np.asarray(upper), np.asarray(n)
    d = len(x_min)
    if d not in (2, 3):
        raise MeshError(f"box: lower {x_min.tolist()} needs two or three coordinates.")
    if len(x_max) != d or not (x_max > x_min).all():
        raise MeshError(f"box: upper {x_max.tolist()} must exceed lower {x_min.tolist()}.")
    if count.shape not in ((), (d,)):
        raise MeshError(
            f"box: n has the shape {count.shape}: give a whole number, or one for each of the "
            f"{d} directions."
        )
    count = np.broadcast_to(count, (d,))
    if (count < 1).any():
        raise MeshError(f"box: n must be at least 1 in every direction, not {count.tolist()}.")
    if float(np.prod(count.astype(float))) * factorial(d) > _MOST_CELLS:
        raise MeshError(
            f"box: n = {count.tolist()} asks for more than {_MOST_CELLS:.0e} cells: take fewer."
        )
    axes = [np.linspace(a, b, k + 1) for a, b, k in zip(x_min, x_max, count, strict=True)]
    index = np.indices(tuple(count + 1)).reshape(d, -1)
    points = np.stack([axis[i] for axis, i in zip(axes, index)], axis=1)
    stride = np.append(np.cumprod((count + 1)[:0:-1])[::-1], 1)
    place = np.indices(tuple(count)).reshape(d, -1).T
    first, is_odd = place @ stride, place % 2 == 1
    simplices = np.empty((len(place), factorial(d), d + 1), dtype=np.int64)
    for p, path in enumerate(permutations(range(d))):
        corner = np.zeros(d, dtype=np.int64)
        for v in range(d + 1):
            # Mirroring every second block keeps the mesh conforming, with alternating diagonals.
            simplices[:, p, v] = first + np.where(is_odd, 1 - corner, corner) @ stride
            if v < d:
                corner[path[v]] = 1
    cells = simplices.reshape(-1, d + 1)
    x = points[cells]
    with np.errstate(all="ignore"):  # sides too short for a number are refused by the mesh
        turn = np.linalg.det(x[:, 1:] - x[:, :1]) < 0
    cells[turn] = cells[turn][:, [1, 0, *range(2, d + 1)]]
    sets = {}
    for axis, side_names in enumerate((_SIDES[0], *_SIDES[1 : d - 1], _SIDES[-1])):
        for name, end in zip(side_names, (0, count[axis]), strict=True):
            sets[name] = _facets_on(cells, index[axis] == end)
    return sound_mesh(points, cells, sets)


def _facets_on(cells: Ints, on_side: Bools) -> Ints:
    """Facets all of whose points lie on a side, sorted as those of a mesh are."""
    cells_on_side = cells[on_side[cells].sum(axis=1) == cells.shape[1] - 1]
    facets = np.sort(cells_on_side[on_side[cells_on_side]].reshape(len(cells_on_side), -1), axis=1)
    return facets[np.lexsort(facets.T[::-1])]
