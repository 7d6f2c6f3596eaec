"""K at a tip of a solution in 2D: the domain of the integrals, its points, and the SIF."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.fem.assembly import Tabulated, tabulate_functions
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import Points, cell_points
from xcrack.mesh.locate import nearest_boundary
from xcrack.sif.accuracy import Domain, check
from xcrack.sif.common import has_effect, with_closed
from xcrack.sif.interaction_2d import (
    constant_part,
    lip_terms,
    plain_terms,
    point_terms,
    ring_around,
    volume_terms,
)
from xcrack.sif.sif import SIF

# Cells and points of the domain around a tip, for K and for the estimate of its error.

# Cells up to a share of the outer radius: points a direction with tip functions, degree without.
_DEGREES = ((0.0, 0.03, 4, 4), (0.03, 0.1, 5, 6), (0.1, 0.25, 5, 8), (0.25, np.inf, 5, 10))
_CHUNK = 4000  # cells integrated at once; bounds the memory


@dataclass(frozen=True, eq=False)
class RingPart:
    """Cells of one class.

    Attributes
    ----------
    plain : (k,) array of int
        On which no enriched function acts.
    degree : int
        Of the rule for them.
    others : iterable of Tabulated
        Points of the other cells.
    """

    plain: Ints
    degree: int
    others: Iterable[Tabulated]


def ring_parts(solution: Solution, t: int, hollow: float, outer: float) -> Iterable[RingPart]:
    """Cells around tip t by class, with points and functions where functions are enriched.

    Where the solve keeps its factor for estimates, these points stay with it too: K and the
    estimate of its error share them.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the tip in `space.tips`.
    hollow, outer : float, length
        Radii between which the cells lie.
    """
    parts, factored = _ring_parts(solution.space, t, hollow, outer), solution.factored
    if factored is None:
        return parts
    key = t, hollow, outer
    stored: Iterable[RingPart] | None = factored.around_tips.get(key)
    if stored is None:
        stored = tuple(parts)
        # More than one chunk of cells is too much to be stored.
        if all(isinstance(part.others, tuple) for part in stored):
            factored.around_tips[key] = stored
    return stored


def _ring_parts(space: FunctionSpace, t: int, hollow: float, outer: float) -> Iterator[RingPart]:
    for cells, n, degree in ring_classes(space, space.tips[t].x, hollow, outer):
        plain = space.signature[cells] == 0
        others = cells[~plain]
        points = (tabulate_functions(space, p) for p in class_points(space, others, n, degree))
        few = len(others) <= _CHUNK
        yield RingPart(cells[plain], degree, tuple(points) if few else points)


def ring_classes(
    space: FunctionSpace, centre: Floats, hollow: float, radius: float
) -> Iterator[tuple[Ints, int, int]]:
    """Cells between two radii by size, points a direction with tip functions, degree without."""
    from xcrack.sif.kernels.ring import cells_between

    mesh = space.mesh
    near_cells = cells_between(mesh.points, mesh.cells, mesh.cell_size, centre, hollow, radius)
    share = mesh.cell_size[near_cells] / radius
    for low, high, n, degree in _DEGREES:
        cells = near_cells[(share > low) & (share <= high)]
        if len(cells):
            yield cells, n, degree


def class_points(space: FunctionSpace, cells: Ints, n: int, degree: int) -> Iterator[Points]:
    """Integration points of cells, of some cells at once."""
    for first in range(0, len(cells), _CHUNK):
        yield cell_points(space, cells[first : first + _CHUNK], n, degree)


_OUTER = {1: 2.5, 2: 2.5}  # outer radius, as a multiple of the enriched radius
_SECOND = 0.7  # outer radius of the second domain, as a share of the first
_DIFFER = 0.01  # difference of the two domains, as a share of K, that gives a warning
# Room in cells below which a clipped domain warns, by order, and length in cells below which a
# crack between two tips, or one with contact, does. Of random scenes with errors of K below 1 %
# 23 % warn then, of those above 5 % 99 %. Asking for three cells at both orders warned in 64 % of
# the former and in no more of the latter (benchmarks/warnings_of_K.py).
_ROOM = {1: 3.5, 2: 0.9}
_SHORT_OPEN, _SHORT_CONTACT = 2.0, 3.5


def tip_intensity(solutions: Sequence[Solution], t: int) -> list[SIF]:
    """K and T at one tip, for several load states of one solve.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    t : int
        Number of the tip in `space.tips`.
    """
    tip = solutions[0].space.tips[t]
    domain = domain_of(solutions[0], t)
    outer = domain.outer
    radii = radii_of(domain)
    E_prime = solutions[0].problem.material.at_tip().E_prime
    result = []
    for solution, values in zip(solutions, _integrals(solutions, t, radii), strict=True):
        K = 0.5 * E_prime * values[:, :2]
        T = E_prime * values[0, 2] + constant_part(solution, t)
        sif = SIF(
            x=tip.x[None],
            frame=tip.frame[None],
            K=K[:1],
            T=np.array([T]),
            spread=np.abs(K[:1] - K[1:]),
            s=np.zeros(1),
            front=np.zeros(1, dtype=np.int64),
            at_surface=np.zeros(1, dtype=bool),
            closed=np.zeros(1, dtype=bool),
            domain_cells=np.array([outer / domain.size]),
        )
        result.append(with_closed(sif, solution, tip.crack, domain.size))
    check(solutions, t, domain, result)
    return result


def radii_of(domain: Domain) -> Floats:
    """Outer radii of the two domains `(2,)`."""
    outer = domain.outer
    return np.array([outer, max(_SECOND * outer, min(outer, 1.5 * domain.size))])


def _integrals(solutions: Sequence[Solution], t: int, radii: Floats) -> Floats:
    """I of modes I, II and of the point force for each state and domain `(s, radii, 3)`."""
    space, tip = solutions[0].space, solutions[0].space.tips[t]
    ring = ring_around(solutions, t, radii)
    outer = float(radii.max())
    total = lip_terms(solutions, ring)
    # Within the inner radius grad q vanishes.
    hollow = float(ring.inner.min())
    for part in ring_parts(solutions[0], t, hollow, outer):
        total += plain_terms(solutions, ring, part.plain, part.degree)
        for values in part.others:
            total += point_terms(solutions, ring, values)
    if has_effect(solutions, "volume", "initial_stress"):
        for cells, n, degree in ring_classes(space, tip.x, 0.0, outer):
            for points in class_points(space, cells, n, degree):
                total += volume_terms(solutions, ring, points)
    return total


def domain_of(solution: Solution, t: int) -> Domain:
    """Radius of the domain at tip t, and the room for it.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the tip in `space.tips`.
    """
    space = solution.space
    tip = space.tips[t]
    cells = space.cuts[tip.crack].level_set.tip_cells[tip.number]
    size = float(space.mesh.cell_size[cells].mean())
    radius = solution.problem.numerics.domain or max(_OUTER[space.order] * tip.radius, 4.0 * size)
    free, _ = nearest_boundary(space.mesh, tip.x)
    radii_of_tip: list[float] = []
    others: list[float] = []
    for other in space.tips:
        if other is not tip:
            distance = float(np.linalg.norm(other.x - tip.x))
            (radii_of_tip if other.crack == tip.crack else others).append(distance)
    lips = [
        float(np.linalg.norm(points.x - tip.x, axis=1).min())
        for c, points in enumerate(solution.lips)
        if c != tip.crack and len(points)
    ]
    room = min([0.95 * free, *[0.8 * d for d in others], *[0.9 * d for d in lips]])
    limit = min([room, *[0.8 * d for d in radii_of_tip]])
    shortest = _SHORT_OPEN if radii_of_tip else 0.0
    if solution.contact[tip.crack] is not None:
        shortest = _SHORT_CONTACT
    return Domain(
        outer=min(radius, max(limit, 1.2 * size)),
        wanted=radius,
        room=room,
        least=_ROOM[space.order] * size,
        short=float(solution.lips[tip.crack].weight.sum()) < shortest * size,
        size=size,
        narrowest=tip.x,
        differ=_DIFFER,
        label="K at",
    )


__all__ = []
