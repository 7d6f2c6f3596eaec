"""K at a tip of a solution in 2D: the domain of the integrals, its points, and the SIF."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import build_without_checks
from xcrack.fem.assembly import Tabulated, tabulate_functions
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import Circles, Points, cell_points
from xcrack.mesh.locate import nearest_boundary
from xcrack.sif.accuracy import Domain, check, scale_of
from xcrack.sif.common import has_effect, material_at_tip, with_closed
from xcrack.sif.interaction_2d import (
    constant_part,
    inner_radii,
    lip_terms,
    plain_terms,
    point_terms,
    ring_around,
    volume_terms,
)
from xcrack.sif.sif import SIF

# Cells and points of the domain around a tip, for K and for the estimate of its error.

# Cells up to a share of the outer radius: points a direction with tip functions, degree without.
# In those of more than a quarter the weight falls steeply: with 16 points in a triangle for 25 K of
# tips with room for two cells was 1e-4 to 5e-4 wrong, more than its bar.
_DEGREES = ((0.0, 0.03, 4, 4), (0.03, 0.1, 5, 6), (0.1, 0.25, 5, 8), (0.25, np.inf, 6, 10))
_CHUNK = 4000  # cells integrated at once; bounds the memory


@dataclass(frozen=True, eq=False)
class RingPart:
    """Cells of one class.

    Attributes
    ----------
    plain_cells : (k,) array of int
        On which no enriched function acts.
    degree : int
        Of the rule for them.
    other_points : iterable of Tabulated
        Points of the other cells.
    differs : bool
        Whether their stiffness may be another one than that at the tip: they count wherever the
        weight q is not zero, others only where its gradient is not.
    """

    plain_cells: Ints
    degree: int
    other_points: Iterable[Tabulated]
    has_other_material: bool


def ring_parts(solution: Solution, t: int, radii: Floats) -> Iterable[RingPart]:
    """Cells around tip t by class, with points and functions where functions are enriched.

    Where the solve keeps its factor for estimates, these points stay with it too: K and the
    estimate of its error share them.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the tip in `space.tips`.
    radii : (k,) array, length
        Outer radii of the domains.
    """
    parts, factored = _ring_parts(solution, t, radii), solution.factored
    if factored is None:
        return parts
    key = t, *radii.tolist()
    parts_in_store: Iterable[RingPart] | None = factored.around_tips.get(key)
    if parts_in_store is None:
        parts_in_store = tuple(parts)
        # More than one chunk of cells is too much to be stored.
        if all(isinstance(part.other_points, tuple) for part in parts_in_store):
            factored.around_tips[key] = parts_in_store
    return parts_in_store


def _ring_parts(solution: Solution, t: int, radii: Floats) -> Iterator[RingPart]:
    space, elasticity = solution.space, solution.problem.elasticity
    x = space.tips[t].x
    # Within the first radius the gradient of q vanishes, and from one to the next it is smooth.
    circles = Circles(x, np.array(sorted({*inner_radii(space.order, radii), *radii})))
    r_inner, r_outer = circles.radii[[0, -1]]
    for cells, n, degree in ring_classes(space, x, r_inner, r_outer):
        if not elasticity.is_uniform:
            cells = np.setdiff1d(
                cells, elasticity.cells_unlike(material_at_tip(solution, t), cells)
            )
        yield _ring_part(space, cells, n, degree, circles)
    if elasticity.is_uniform:
        return
    for cells, n, degree in ring_classes(space, x, 0.0, r_outer):
        cells = elasticity.cells_unlike(material_at_tip(solution, t), cells)
        yield _ring_part(space, cells, n, degree, None)


def _ring_part(
    space: FunctionSpace, cells: Ints, n: int, degree: int, circles: Circles | None
) -> RingPart:
    """Cells of the material at the tip, for which q is not smooth at circles, or of another one."""
    is_plain = space.signature[cells] == 0
    other_cells = cells[~is_plain]
    points = (
        tabulate_functions(space, p) for p in class_points(space, other_cells, n, degree, circles)
    )
    is_one_chunk = len(other_cells) <= _CHUNK
    return RingPart(
        cells[is_plain], degree, tuple(points) if is_one_chunk else points, circles is None
    )


def ring_classes(
    space: FunctionSpace, centre: Floats, inner_radius: float, radius: float
) -> Iterator[tuple[Ints, int, int]]:
    """Cells between two radii by size, points a direction with tip functions, degree without."""
    from xcrack.sif.kernels.ring import cells_between

    mesh = space.mesh
    near_cells = cells_between(
        mesh.points, mesh.cells, mesh.cell_size, centre, inner_radius, radius
    )
    # A quarter of the radius is a common size: which class it is in is not left to round-off.
    share = mesh.cell_size[near_cells] / radius * (1 - 1e-9)
    for share_min, share_max, n, degree in _DEGREES:
        cells = near_cells[(share > share_min) & (share <= share_max)]
        if len(cells):
            yield cells, n, degree


def class_points(
    space: FunctionSpace, cells: Ints, n: int, degree: int, circles: Circles | None = None
) -> Iterator[Points]:
    """Integration points of cells, of some cells at once; see `quadrature.Circles`."""
    for first in range(0, len(cells), _CHUNK):
        yield cell_points(space, cells[first : first + _CHUNK], n, degree, circles=circles)


_OUTER = {1: 2.5, 2: 2.5}  # outer radius, as a multiple of the enriched radius
_SECOND = 0.7  # outer radius of the second domain, as a share of the first
_DIFFER = {1: 0.05, 2: 0.01}  # difference of the two domains, as a share of K, that warns
# Room in cells below which a clipped domain is in doubt, by order, and length in cells below which
# a crack between two tips, or one with contact, is: a doubt warns where K of the lips is another
# one, which at order 1 it always is (benchmarks/warnings_of_K.py).
_ROOM = {1: 2.5, 2: 0.8}
_SHORT_OPEN, _SHORT_CONTACT = 2.0, 2.5
_AGREE = {1: 0.0, 2: 0.006}  # of the largest K of a crack: K of domain and lips are the same
_AGREE_BESIDE = {1: 0.0, 2: 0.02}  # the same beside another material, where K of lips errs too
_LIPS = 1.0  # cells from a tip in which lips are asked


def tip_intensities(
    solutions: Sequence[Solution], ends: Sequence[int]
) -> tuple[list[list[SIF]], list[str]]:
    """K and T at the tips of one crack, for several load states of one solve.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    ends : sequence of int
        Numbers of the tips in `space.tips`.

    Returns
    -------
    tips : list of list of SIF
        One list a tip, with one for each state.
    doubts : list of str
        What to warn of.
    """
    result = [intensity_at_tip(solutions, t) for t in ends]

    @cache
    def difference() -> float:
        return _largest_difference(solutions, ends, result)

    order = solutions[0].space.order
    agreement, agreement_beside = _AGREE[order], _AGREE_BESIDE[order]
    doubts = []
    for t, (parts, domain) in zip(ends, result, strict=True):
        doubts += check(
            solutions, t, domain, parts, lambda: agreement == 0 or difference() > agreement,
            lambda: agreement_beside == 0 or difference() > agreement_beside,
        )  # fmt: skip
    return [parts for parts, _ in result], doubts


def _largest_difference(
    solutions: Sequence[Solution], ends: Sequence[int], tips: Sequence[tuple[list[SIF], Domain]]
) -> float:
    """Largest difference of K of the domains and of the lips, over the largest K of the crack."""
    largest_share = 0.0
    for n, solution in enumerate(solutions):
        jump = solution.jump(solution.space.tips[ends[0]].crack)
        scale, difference = 0.0, 0.0
        for t, (parts, domain) in zip(ends, tips, strict=True):
            part = parts[n]
            K = np.abs(part.K[0])
            scale = max(scale, scale_of(solution, part, solution.space.tips[t].radius))
            at_lips = np.abs(_K_of_lips(solution, t, jump, domain.size))
            deviation = np.abs(at_lips - K)
            deviation[0] = 0.0 if part.closed[0] else deviation[0]  # K_I is exact there
            difference = max(difference, float(deviation.max()))
        largest_share = max(largest_share, difference / scale if scale > 0 else 0.0)
    return largest_share


def _K_of_lips(solution: Solution, t: int, jump: Floats, size: float) -> Floats:
    """K_I and K_II but for their signs by the jump beside a tip; inf where too few points are near.

    The jump is 8 K / E' √(r / 2π) (1 + c r): K and c fit it best.
    """
    tip = solution.space.tips[t]
    lips = solution.lips[tip.crack]
    r = np.linalg.norm(lips.x - tip.x, axis=1)
    is_near = (r > 0) & (r < _LIPS * size)
    if is_near.sum() < 3:
        return np.full(2, np.inf)
    r, weight = r[is_near], np.sqrt(lips.weight[is_near])[:, None]
    E_prime = material_at_tip(solution, t).E_prime
    values = 0.125 * E_prime * np.sqrt(2 * np.pi) * jump[is_near] @ tip.frame[[1, 0]].T
    columns = np.stack([np.sqrt(r), r**1.5 / size], axis=1)
    return np.asarray(np.linalg.lstsq(columns * weight, values * weight, rcond=None)[0][0])


def intensity_at_tip(solutions: Sequence[Solution], t: int) -> tuple[list[SIF], Domain]:
    """K and T at one tip of each state, and the domain they are from; nothing is warned of.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one solve.
    t : int
        Number of the tip in `space.tips`.
    """
    tip = solutions[0].space.tips[t]
    domain = domain_of(solutions[0], t)
    r_outer = domain.outer_radius
    radii = radii_of(domain)
    tip_material = material_at_tip(solutions[0], t)
    E_prime = tip_material.E_prime
    result = []
    for solution, values in zip(solutions, _integrals(solutions, t, radii), strict=True):
        K = 0.5 * E_prime * values[:, :2]
        T = E_prime * values[0, 2] + constant_part(solution, t)
        sif = build_without_checks(
            SIF,
            x=tip.x[None],
            frame=tip.frame[None],
            K=K[:1],
            T=np.array([T]),
            spread=np.abs(K[:1] - K[1:]),
            s=np.zeros(1),
            front=np.zeros(1, dtype=np.int64),
            at_surface=np.zeros(1, dtype=bool),
            closed=np.zeros(1, dtype=bool),
            domain_cells=np.array([r_outer / domain.size]),
            E_prime=np.array([E_prime]),
            nu=np.array([tip_material.nu]),
        )
        result.append(with_closed(sif, solution, tip.crack, domain.size))
    return result, domain


def radii_of(domain: Domain) -> Floats:
    """Outer radii of the two domains `(2,)`."""
    r_outer = domain.outer_radius
    return np.array([r_outer, max(_SECOND * r_outer, min(r_outer, 1.5 * domain.size))])


def _integrals(solutions: Sequence[Solution], t: int, radii: Floats) -> Floats:
    """I of modes I, II and of the point force for each state and domain `(s, radii, 3)`."""
    space, tip = solutions[0].space, solutions[0].space.tips[t]
    ring = ring_around(solutions, t, radii)
    r_outer = float(radii.max())
    total = lip_terms(solutions, ring)
    for part in ring_parts(solutions[0], t, radii):
        total += plain_terms(solutions, ring, part)
        for values in part.other_points:
            total += point_terms(solutions, ring, values, part.has_other_material)
    if has_effect(solutions, "volume", "initial_stress"):
        for cells, n, degree in ring_classes(space, tip.x, 0.0, r_outer):
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
    free_distance, _ = nearest_boundary(space.mesh, tip.x)
    radii_of_tip: list[float] = []
    other_reaches: list[float] = []
    for other_tip in space.tips:
        if other_tip is not tip:
            distance = float(np.linalg.norm(other_tip.x - tip.x))
            (radii_of_tip if other_tip.crack == tip.crack else other_reaches).append(distance)
    lips = [
        float(np.linalg.norm(points.x - tip.x, axis=1).min())
        for c, points in enumerate(solution.lips)
        if c != tip.crack and len(points)
    ]
    room = min([0.95 * free_distance, *[0.8 * d for d in other_reaches], *[0.9 * d for d in lips]])
    limit = min([room, *[0.8 * d for d in radii_of_tip]])
    least_length = _SHORT_OPEN if radii_of_tip else 0.0
    if solution.contact[tip.crack] is not None:
        least_length = _SHORT_CONTACT
    return Domain(
        outer_radius=min(radius, max(limit, 1.2 * size)),
        free_radius=radius,
        room=room,
        least_room=_ROOM[space.order] * size,
        is_short=float(solution.lips[tip.crack].weight.sum()) < least_length * size,
        size=size,
        narrow_place=tip.x,
        differ=_DIFFER[space.order],
        label="K at",
        interface=_distance_to_interface(solution, tip.x),
    )


def _distance_to_interface(solution: Solution, x: Floats) -> float:
    """Distance of a tip to another material, length; inf where there is none."""
    from xcrack.mesh.kernels.location import nearest_segment

    mesh, interfaces = solution.space.mesh, solution.problem.elasticity.interfaces
    if not len(interfaces):
        return np.inf
    return float(nearest_segment(mesh.points, mesh.facets[interfaces], np.ascontiguousarray(x))[0])


__all__ = []
