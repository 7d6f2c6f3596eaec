"""Area of a 3D crack and length of its fronts in the body."""

import numpy as np

from xcrack.arrays import Floats, ranges
from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.mesh.body import Body
from xcrack.mesh.mesh import Mesh

_FINE = 0.25  # of a cell: sides of the pieces that the boundary of the body clips
_MOST = 1000  # parts of a side of a front


def area_inside(crack: Crack, mesh: Mesh) -> float:
    """Area of the part of a 3D crack that lies in the body.

    Faces near the boundary are halved until their sides are a quarter of a cell, and what the
    boundary then still crosses is clipped as if it were plane there.

    Parameters
    ----------
    crack : Crack
        3D.
    mesh : Mesh

    Returns
    -------
    float
        length².

    Raises
    ------
    ProblemError
        No part of the crack lies in the body.
    """
    return _area_inside(crack, Body.of(mesh))


def _area_inside(crack: Crack, body: Body) -> float:
    piece = crack.points[crack.faces]
    total = 0.0
    while len(piece):
        area = np.linalg.norm(
            np.cross(piece[:, 1] - piece[:, 0], piece[:, 2] - piece[:, 0]), axis=1
        )
        area /= 2
        centre = piece.mean(axis=1)
        radius = np.linalg.norm(piece - centre[:, None], axis=2).max(axis=1)
        depth = body.depth(centre)[0]
        near = np.abs(depth) < radius
        total += float(area[~near & (depth < 0)].sum())
        side = np.linalg.norm(np.roll(piece, -1, axis=1) - piece, axis=2)
        cell = body.cell_size(centre)
        small = near & (side.max(axis=1) <= _FINE * cell)
        corners = piece[small].reshape(-1, 3)
        share = _share_below_zero(body.depth(corners)[0].reshape(-1, 3))
        total += float((area[small] * share).sum())
        piece = halved(piece[near & ~small], side[near & ~small])
    if total <= 0:
        raise ProblemError(f"no part of the crack at {crack.points[0].tolist()} is in the body.")
    return total


def front_length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of all fronts of a 3D crack within the body.

    Parameters
    ----------
    crack : Crack
        3D, placed.
    mesh : Mesh

    Returns
    -------
    float
        length; 0 where no front is left.
    """
    return _front_length_inside(crack, Body.of(mesh))


def _front_length_inside(crack: Crack, body: Body) -> float:
    finest = _FINE * float(body.mesh.cell_size.min())
    total = 0.0
    for front in crack.fronts or ():
        x = crack.points[front]
        side = np.diff(x, axis=0)
        length = np.linalg.norm(side, axis=1)
        parts = np.clip(np.ceil(length / finest), 1, _MOST).astype(np.int64)
        row, part = ranges(parts)
        one, other = (
            body.depth(x[row] + ((part + end) / parts[row])[:, None] * side[row])[0]
            for end in (0, 1)
        )
        low, high = np.minimum(one, other), np.maximum(one, other)
        width = np.where(high > low, high - low, 1.0)
        share = np.where(high <= 0, 1.0, np.where(low >= 0, 0.0, -low / width))
        total += float(share @ (length / parts)[row])
    return total


def surface_size(crack: Crack, mesh: Mesh, body: Body | None = None) -> float:
    """Area of a 3D crack over the length of its fronts, within the body.

    Parameters
    ----------
    crack : Crack
        3D, placed.
    mesh : Mesh
    body : Body, optional
        Of the mesh, where it is known.

    Returns
    -------
    float
        length: that of a crack with a straight front, half the radius of a penny; the root of the
        area where all fronts have left the body.
    """
    body = body or Body.of(mesh)
    area, length = _area_inside(crack, body), _front_length_inside(crack, body)
    return area / length if length > 0 else float(np.sqrt(area))


def halved(piece: Floats, side: Floats) -> Floats:
    """Triangles `(k, 3, 3)` cut through the middle of their longest sides."""
    turn = (np.argmax(side, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(piece, turn[..., None], axis=1).transpose(1, 0, 2)
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _share_below_zero(values: Floats) -> Floats:
    """Share of each triangle in which the linear function with these corner values is < 0."""
    below = (values < 0).sum(axis=1)
    ordered = np.sort(values, axis=1)
    low, middle, high = ordered.T
    spread = np.where(high > low, high - low, 1.0)
    one = low**2 / (np.where(middle > low, middle - low, 1.0) * spread)
    two = 1 - high**2 / (spread * np.where(high > middle, high - middle, 1.0))
    return np.asarray(np.choose(below, [np.zeros_like(low), one, two, np.ones_like(low)]))


__all__ = [
    "area_inside",
    "front_length_inside",
    "halved",
    "surface_size",
]
