"""What the runs of a chart are compared by, and how far the finest of them can be trusted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities

# Rates that are believed between two meshes. What falls faster than by the second power is taken
# for luck, what falls slower than by the square root for scatter.
_SLOWEST, _FASTEST = 0.5, 2.0
_UNKNOWN = 1.0  # rate where two meshes do not tell it
_LARGEST = 1e120
_PEER = 5.0  # a setting that claims more than this multiple of the least error is no witness


@dataclass(frozen=True, eq=False)
class Sampled:
    """Values of one run, and the places of those that belong to tips or fronts.

    Attributes
    ----------
    values : (n, k) array
    points : (n, d) array, length, or None
        None: values that need no place.
    group : (n, 2) array of int
        Crack and front of each place.
    at_surface : (n,) array of bool
        Places that are not compared.
    """

    values: Floats
    points: Floats | None = None
    group: Ints | None = None
    at_surface: Any = None


def K_of_all(solutions: Sequence[Solution]) -> Sampled:
    """K of all modes, states and cracks at the tips or along the fronts.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one solve.
    """
    every = [stress_intensities(solutions, c) for c in range(len(solutions[0].space.cuts))]
    return sampled(list(zip(*every, strict=True)))


def sampled(sifs: Sequence[Sequence[SIF]], best: bool = False) -> Sampled:
    """The same of K that is there, of each state and crack.

    Parameters
    ----------
    sifs : sequence of sequence of SIF
    best : bool
        K with its estimated error, where there is an estimate.
    """
    values, points, group, surface = [], [], [], []
    for c, states in enumerate(zip(*sifs, strict=True)):
        K = [np.where(best & np.isfinite(sif.best), sif.best, sif.K) for sif in states]
        values.append(np.concatenate(K, axis=1))
        points.append(states[0].x)
        group.append(np.stack([np.full(len(states[0].x), c), states[0].front], axis=1))
        surface.append(states[0].at_surface)
    return Sampled(*(np.concatenate(part) for part in (values, points, group, surface)))


def sampled_numbers(values: Any) -> Sampled:
    """Values of a quantity of the user's own.

    Raises
    ------
    ProblemError
        No numbers.
    """
    column = numbers(values, "chart: what the quantity returned", must_be_finite=False).reshape(
        -1, 1
    )
    if not len(column):
        raise ProblemError("the quantity returned an empty array: return at least one number.")
    if np.abs(column[np.isfinite(column)]).max(initial=0.0) > _LARGEST:
        raise ProblemError(
            f"the quantity returned values of up to {np.abs(column).max():.3g}, whose squares are "
            "no numbers: return it in another unit."
        )
    return Sampled(column)


def at_places(sample: Sampled, places: Sampled) -> Floats:
    """Values of a sample at the places of another one, flat.

    Between the vertices of a front they are interpolated.

    Raises
    ------
    ProblemError
        Samples that cannot be compared.
    """
    if sample.points is None or places.points is None or sample.group is None:
        if sample.values.shape != places.values.shape:
            raise ProblemError(
                f"the quantity has {sample.values.size} value(s) here and {places.values.size} in "
                "the reference: return as many whatever mesh and setting are."
            )
        return sample.values.ravel()
    group_of_places = places.group if places.group is not None else sample.group
    groups, place_groups = (np.unique(group, axis=0) for group in (sample.group, group_of_places))
    if not np.array_equal(groups, place_groups):
        raise ProblemError(
            f"{len(groups)} tip(s) or front(s) here, {len(place_groups)} in the reference: "
            "another crack. An end within half a cell of the boundary is a mouth; take finer "
            "meshes."
        )
    inner = ~np.asarray(places.at_surface)
    inner = inner if inner.any() else np.ones_like(inner)
    result = np.zeros((int(inner.sum()), sample.values.shape[1]))
    # By crack, not by front: fronts of one crack may be numbered otherwise in another mesh.
    for c in np.unique(group_of_places[:, 0]):
        is_of_crack = group_of_places[inner, 0] == c
        result[is_of_crack] = _nearest(sample, int(c), places.points[inner][is_of_crack])
    return result.ravel()


def _nearest(sample: Sampled, crack: int, x: Floats) -> Floats:
    """Values at the places on the tips or fronts of a crack that are nearest to points."""
    assert sample.points is not None
    assert sample.group is not None
    ends = _segments(sample.points, sample.group, crack)
    a, b = sample.points[ends].transpose(1, 0, 2)
    segment = b - a
    square = np.einsum("sd,sd->s", segment, segment)
    share = np.einsum("xsd,sd->xs", x[:, None] - a, segment) / np.where(square > 0, square, 1.0)
    share = np.clip(share, 0.0, 1.0)
    distance = np.linalg.norm(a + share[..., None] * segment - x[:, None], axis=-1)
    best = np.argmin(distance, axis=1)
    t = share[np.arange(len(x)), best][:, None]
    first, last = sample.values[ends[best]].transpose(1, 0, 2)
    return np.asarray((1 - t) * first + t * last)


def _segments(points: Floats, group: Ints, crack: int) -> Ints:
    """Pairs of rows between which values are interpolated; a tip is a pair of itself."""
    pairs = []
    for front in np.unique(group[group[:, 0] == crack, 1]):
        rows = np.nonzero((group == (crack, front)).all(axis=1))[0]
        pairs.append(np.stack([rows, np.append(rows[1:], rows[-1])], axis=1))
        length = np.linalg.norm(np.diff(points[rows], axis=0), axis=1)
        gap = float(np.linalg.norm(points[rows[0]] - points[rows[-1]]))
        if len(rows) > 2 and gap <= 2 * float(length.max()):  # a closed front
            pairs.append(np.array([[rows[-1], rows[0]]]))
    return np.concatenate(pairs)


def remaining(values: Sequence[Floats], sizes: Sequence[float]) -> float:
    """What is left of the error on the last of some meshes, by Richardson's extrapolation.

    With d_k the change from mesh k - 1 to k, r the ratio of their sizes and p the rate, d / (r^p -
    1) (Richardson, 1911, Phil. Trans. R. Soc. A 210). p is read from the last two changes and kept
    between 1/2 and 2; it is 1 where there are two meshes. A last change that is small by chance
    does not count for less than the one before it, less what the largest p takes off.

    Parameters
    ----------
    values : sequence of (n,) arrays
        From coarse to fine, two or more.
    sizes : sequence of float, length

    Returns
    -------
    float
        Norm of the error.
    """
    change = [float(np.linalg.norm(b - a)) for a, b in zip(values[:-1], values[1:], strict=True)]
    ratio = [a / b for a, b in zip(sizes[:-1], sizes[1:], strict=True)]
    last = ratio[-1]
    if len(change) == 1:
        return change[-1] / (last**_UNKNOWN - 1)
    previous_change, last_change = change[-2:]
    rate = _FASTEST
    if last_change > 0:
        rate = float(
            np.clip(
                np.log(max(previous_change, 1e-300) / last_change) / np.log(last),
                _SLOWEST,
                _FASTEST,
            )
        )
    lucky = previous_change / (ratio[-2] ** _FASTEST - 1) / last**_FASTEST
    return max(last_change / (last**rate - 1), lucky)


def most_trusted(
    values: Mapping[tuple[int, int], Floats], sizes: Sequence[float], left_out: Sequence[int] = ()
) -> tuple[tuple[int, int], float]:
    """The run that the others are compared with, and the error that is left in it.

    On the finest mesh it is the setting with the least error by `remaining`. Where the second best
    is about as good, but lies farther away than both claim, the distance decides.

    Parameters
    ----------
    values : mapping of (mesh, setting) to (n,) array
        Of runs that succeeded.
    sizes : sequence of float, length
        One a mesh, from coarse to fine.
    left_out : sequence of int
        Settings that are no candidates.

    Raises
    ------
    ProblemError
        No setting that ran on the finest mesh and on another one.
    """
    finest_mesh = max((mesh for mesh, s in values if s not in left_out), default=-1)
    candidates = []
    for mesh, setting in values:
        meshes = sorted(m for m, s in values if s == setting)
        if mesh == finest_mesh and len(meshes) > 1 and setting not in left_out:
            remainder = remaining([values[m, setting] for m in meshes], [sizes[m] for m in meshes])
            candidates.append((remainder, setting))
    if not candidates:
        raise ProblemError(
            "no setting ran on two meshes, so that no error can be estimated: give finer meshes "
            "or settings that suit the scene."
        )
    candidates.sort()
    error, best = candidates[0]
    if len(candidates) > 1 and candidates[1][0] <= _PEER * error:
        remainder, second = candidates[1]
        difference = float(np.linalg.norm(values[finest_mesh, second] - values[finest_mesh, best]))
        error = max(error, difference - remainder)
    return (finest_mesh, best), error


__all__ = [
    "K_of_all",
    "Sampled",
    "at_places",
    "most_trusted",
    "remaining",
    "sampled",
    "sampled_numbers",
]
