"""Cracks in 2D: polylines."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import Bools, Floats
from xcrack.crack.crack import Crack
from xcrack.errors import GeometryError


def line_crack(points: ArrayLike) -> Crack:
    """Crack in the plane along a polyline.

    An end outside the body, or within half a cell of its boundary, becomes a mouth as soon as
    the crack is put into a mesh; an end inside is a tip. Lip + lies to the left of the order of
    the points.

    Parameters
    ----------
    points : (p, 2) array, length
        At least two points.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        Fewer than two points, nan, points that coincide, a line that crosses itself or turns
        back.

    Examples
    --------
    >>> line_crack([(0, 0), (1, 0), (2, 1)])
    Crack(3 points, 2 faces, not placed)
    """
    x = np.asarray(points, dtype=float)
    if x.ndim != 2 or x.shape[1] != 2 or len(x) < 2:
        raise GeometryError(f"a line crack needs at least two points (p, 2), not shape {x.shape}.")
    if not np.isfinite(x).all():
        raise GeometryError(
            f"crack point {x[~np.isfinite(x).all(axis=1)][0].tolist()} is not finite."
        )
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if (length <= 1e-12 * length.max(initial=0.0)).any() or length.max() == 0:
        i = int(np.argmin(length))
        raise GeometryError(
            f"the crack has a piece of zero length: points {i} and {i + 1} both lie at "
            f"{x[i].tolist()}; leave one out."
        )
    along = np.diff(x, axis=0) / length[:, None]
    turns = (along[1:] * along[:-1]).sum(axis=1)
    if (turns < -1 + 1e-12).any():
        back = x[1 + int(np.argmin(turns))]
        raise GeometryError(
            f"the crack turns back on itself at {np.round(back, 6).tolist()}: leave out what runs "
            "over it twice."
        )
    crossing = crossing_point(x, x, same=True)
    if crossing is not None:
        raise GeometryError(
            f"the crack crosses itself near {np.round(crossing, 6).tolist()}: end it there, or "
            "describe it by two cracks that do not meet."
        )
    number = np.arange(len(x))
    return Crack(x, np.stack([number[:-1], number[1:]], axis=1))


def crossing_point(a: Floats, b: Floats, same: bool) -> Floats | None:
    """A point where polylines a and b cross, or None; neighbours of one line do not count."""
    p, r = a[:-1, None], np.diff(a, axis=0)[:, None]
    q, s = b[None, :-1], np.diff(b, axis=0)[None]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    gap = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * s[..., 1] - gap[..., 1] * s[..., 0]) / cross
        u = (gap[..., 0] * r[..., 1] - gap[..., 1] * r[..., 0]) / cross
    hit: Bools = (cross != 0) & (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
    if same:
        i, j = np.indices(hit.shape)
        hit &= np.abs(i - j) > 1
    if not hit.any():
        return None
    i, j = np.argwhere(hit)[0]
    return np.asarray(a[i] + t[i, j] * (a[i + 1] - a[i]))
