"""What a growth run keeps of cracks in space: their size in the body, values along, and cycles."""

from collections.abc import Sequence

import numpy as np
from scipy.special import exprel

from xcrack.arrays import Floats, Ints, ranges
from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.geometry.distances import front_distance
from xcrack.mesh.body import Body
from xcrack.mesh.mesh import Mesh

_FINE = 0.25  # of a cell: sides of the pieces that the boundary of the body clips
_MOST = 1000  # parts of a side of a front
_DRIVING = 0.5  # share of the largest rate from which on a point counts as driving


def area_inside(crack: Crack, mesh: Mesh) -> float:
    """Area of the part of a crack in space that lies in the body.

    Faces near the boundary are halved until their sides are a quarter of a cell, and what the
    boundary then still crosses is clipped as if it were plane there.

    Parameters
    ----------
    crack : Crack
        In space.
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
        piece = _halved(piece[near & ~small], side[near & ~small])
    if total <= 0:
        raise ProblemError(f"no part of the crack at {crack.points[0].tolist()} is in the body.")
    return total


def front_length_inside(crack: Crack, mesh: Mesh) -> float:
    """Length of all fronts of a crack in space within the body.

    Parameters
    ----------
    crack : Crack
        In space, placed.
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
    """Area of a crack in space over the length of its fronts, within the body.

    Parameters
    ----------
    crack : Crack
        In space, placed.
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


def carried(
    x: Floats,
    front: Ints,
    closed: Sequence[bool],
    values: Floats,
    target: Floats,
    reach: float,
) -> Floats:
    """Values along fronts, taken over to points nearby, as those of the fronts after a step.

    Parameters
    ----------
    x : (f, 3) array, length
        Places with values, in order along each front.
    front : (f,) array of int
        Which front.
    closed : sequence of bool
        Whether each front is closed.
    values : (f,) array
    target : (g, 3) array, length
        Where values are sought.
    reach : float, length
        A point farther from all places than this gets none.

    Returns
    -------
    (g,) array
        Linear between the places, nan beyond reach.
    """
    result = np.full(len(target), np.nan)
    best = np.full(len(target), float(reach))
    for number in np.unique(front):
        own = front == number
        line, along = x[own], values[own]
        if len(line) == 1:
            line, along = np.concatenate([line, line]), np.concatenate([along, along])
        shut = bool(closed[number]) and len(line) > 2
        r, segment, place = front_distance(target, line, shut)
        following = (segment + 1) % len(line)
        place = np.nan_to_num(place)
        value = (1 - place) * along[segment] + place * along[following]
        nearer = r <= best
        result[nearer], best[nearer] = value[nearer], r[nearer]
    return result


def elapsed_in_space(
    size0: Sequence[float],
    size1: Sequence[float],
    da: Sequence[Floats],
    rate0: Sequence[Floats],
    rate1: Sequence[Floats],
) -> float:
    """Cycles of one step of cracks in space, by the power law of the point that drives it.

    Parameters
    ----------
    size0, size1 : sequence of float, length
        `surface_size` of each crack before and after the step.
    da, rate0 : sequence of (f,) arrays
        Advance of the places along the fronts of each crack, and growth a cycle before the step.
    rate1 : sequence of (f,) arrays, length/cycle
        Growth a cycle after the step where these places have come to (see `carried`), nan where
        they have left the body.

    Returns
    -------
    float

    Raises
    ------
    ProblemError
        No place with a rate has advanced.

    Notes
    -----
    The driving point is the one with the largest rate of those that moved and are still there;
    if none is, the rate before the step stands for the whole of it. Its rate is taken as a power
    of the size, which is proportional to the advance within the step: with x = ln(size1/size0),
    y = ln(rate1/rate0) and E(q) = (e^q - 1)/q the step takes da/rate0 E(x - y)/E(x) cycles. For
    a straight front, and for any front that keeps its shape, this is `cycles_between`. y is that
    of all points of the crack which grow at least half as fast, so that the scatter of K from
    point to point averages out.

    Examples
    --------
    >>> import numpy as np
    >>> one, two = np.full(4, 1e-3), np.full(4, 2e-3)      # a penny, rate ~ radius
    >>> print(round(elapsed_in_space([0.5], [1.0], [np.full(4, 1.0)], [one], [two]), 6))
    693.147181
    """
    moved = [(d > 0) & (r > 0) for d, r in zip(da, rate0)]
    if not any(m.any() for m in moved):
        raise ProblemError("no point of a front with a growth rate has advanced.")
    stay = [m & np.isfinite(r) for m, r in zip(moved, rate1)]
    there = any(m.any() for m in stay)
    largest = [float(r[m].max(initial=-1.0)) for r, m in zip(rate0, stay if there else moved)]
    c = int(np.argmax(largest))
    driving = (stay if there else moved)[c] & (rate0[c] >= largest[c])
    j = int(np.argmax(driving))
    by_first_rate = float(da[c][j] / rate0[c][j])
    if not there:
        return by_first_rate
    fast = stay[c] & (rate0[c] >= _DRIVING * largest[c])
    ratio = float(rate1[c][fast].sum() / rate0[c][fast].sum())
    if ratio == 0:
        return 2 * by_first_rate
    x, y = np.log(size1[c] / size0[c]), np.log(ratio)
    return by_first_rate * float(exprel(x - y) / exprel(x))


def _halved(piece: Floats, side: Floats) -> Floats:
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
    "carried",
    "elapsed_in_space",
    "front_length_inside",
    "surface_size",
]
