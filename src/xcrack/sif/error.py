"""Error bars of K: from the factor that a solve has kept, or from another one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.base.arrays import Bools, Floats, at
from xcrack.base.errors import GeometryError, ProblemError, warn
from xcrack.base.machine import threads
from xcrack.crack.crack import kink_numbers
from xcrack.estimate.estimate import Estimate, estimate
from xcrack.estimate.shape import crack_shape, gap_changes, load_changes, rim_shape
from xcrack.estimate.surplus import shares
from xcrack.mesh.distances import distance_to_simplices
from xcrack.mesh.locate import cell_sizes, contains
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import points_between, refine
from xcrack.model.material import isotropic_part
from xcrack.model.problem import Problem
from xcrack.sif.accuracy import BESIDE, Domain
from xcrack.sif.domain_2d import domain_of
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.finer_tips import Places, along_faces, bars_by_finer_cells, has_help
from xcrack.sif.goal_2d import on_faces, tip_goal
from xcrack.sif.sif import SIF, KErrors, bars_of, joined_sif, no_bars

# Estimated errors of K at tips of solutions of order 2 in 2D.

_NEAR = 1.5  # cells: the middles of those at a kink
_REENTRANT = 0.8  # rad beyond a straight side: corners where stresses are singular


@dataclass(frozen=True, eq=False)
class TipErrors:
    """Estimated errors of K_I and K_II at the tips of one crack, and where they come from.

    Attributes
    ----------
    eta : (states, tips, 2) array, stress · √length
        Signed estimate of exact K less K as the integrals gave it.
    shares : (states, tips, 2, cells) array, stress · √length
        Absolute contributions of the cells to it.
    kinks, interfaces : (states, tips, 2) arrays, stress · √length
        Those of the cells at kinks, and where interfaces meet sides and the crack, with functions
        and their copies taken together.
    at_junctions, junctions : (states, tips, 2) arrays, stress · √length
        Signed and absolute contributions of the cells at junctions where faces press.
    corners : (states, tips, 2) array, stress · √length
        Signed contributions of the cells at re-entrant corners of the body.
    end : (states, tips, 2) array, stress · √length
        What moving the ends of contact by a group does; see `dual.end_changes`.
    bend, rim : (states, tips, 2) arrays, stress · √length
        Signed change of K with the crack as given, not rounded by the cut, and with boundaries on
        the curves that the mesh knows.
    bend_bar : (states, tips, 2) array, stress · √length
        Half-width of the error of `bend`.
    chords : (states, tips, 2) array, stress · √length
        As `rim`, of boundaries that look like chords of curves that it does not know.
    gap, gap_bar : (states, tips, 2) arrays, stress · √length
        Signed change of K where closed faces turn, and half-width of what the gaps of closed faces
        leave; see `shape.gap_changes`.
    gap_shares : (states, tips, 2, cells) array, stress · √length
        Absolute contributions of the cells to the latter.
    load : (states, tips, 2) array, stress · √length
        Signed change of K with given pressures at more points of the faces.
    """

    eta: Floats
    shares: Floats
    kinks: Floats
    interfaces: Floats
    at_junctions: Floats
    junctions: Floats
    corners: Floats
    end: Floats
    bend: Floats
    bend_bar: Floats
    rim: Floats
    chords: Floats
    gap: Floats
    gap_bar: Floats
    gap_shares: Floats
    load: Floats


def tip_errors(solutions: Sequence[Solution], crack: int) -> TipErrors:
    """Estimates for the tips of one crack, in the order of `stress_intensities`.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one solve that kept its factor, of order 2 in 2D.
    crack : int
        With at least one tip.

    Raises
    ------
    ProblemError
        The factor is gone.
    """
    factored = solutions[0].factored
    if factored is None:
        raise ProblemError("no factor was kept: solve(..., error=True) keeps it.")
    space = solutions[0].space
    tips = space.tips_of(crack)
    with threads(solutions[0].problem.numerics.threads):
        result = estimate(factored, solutions, [tip_goal(solutions[0], t) for t in tips])

        @cache
        def singular_fields() -> tuple[Floats, Floats]:
            return on_faces(solutions[0], tips, solutions[0].lips[crack])

        bend, bend_bar = crack_shape(solutions, result, crack, singular_fields)
        gaps = gap_changes(solutions, result, crack, singular_fields)
        load = load_changes(
            solutions, result.z, crack, lambda faces: on_faces(solutions[0], tips, faces)
        )
        rim, chords = rim_shape(solutions, result.z)
    shape = (len(solutions), len(tips), 2)
    corners = _inner_corners(solutions[0].problem.mesh)
    at_junctions, of_junctions = _at_pressed_junctions(solutions, result)
    return TipErrors(
        result.eta.reshape(shape),
        result.shares.reshape(*shape, -1),
        _contributions_near(solutions[0], result, kinks_inside(solutions[0], crack)).reshape(shape),
        _contributions_near(solutions[0], result, _interface_ends(solutions[0], crack)).reshape(
            shape
        ),
        at_junctions.reshape(shape),
        of_junctions.reshape(shape),
        _signed_near(solutions[0], result, corners).reshape(shape),
        result.end.reshape(shape),
        bend.reshape(shape),
        bend_bar.reshape(shape),
        rim.reshape(shape),
        chords.reshape(shape),
        gaps.change.reshape(shape),
        gaps.bar.reshape(shape),
        gaps.by_cell.reshape(*shape, -1),
        load.reshape(shape),
    )


def kinks_inside(solution: Solution, crack: int) -> Floats:
    """Kinks of a crack in the body `(k, 2)`."""
    points = solution.space.cracks[crack].points
    kinks = points[kink_numbers(points)]
    return np.asarray(kinks[contains(solution.problem.mesh, kinks)] if len(kinks) else kinks)


def _interface_ends(solution: Solution, crack: int) -> Floats:
    """Where interfaces meet the boundary and the crack `(k, 2)`."""
    elasticity = solution.problem.elasticity
    if not len(elasticity.interfaces):
        return np.zeros((0, 2))
    mesh, lips = solution.problem.mesh, solution.lips[crack]
    nodes = np.intersect1d(mesh.facets[elasticity.interfaces], mesh.boundary)
    order = np.argsort(lips.s, kind="stable")
    is_crossing = (np.diff(elasticity.number[lips.cell[order]], axis=0) != 0).any(axis=1)
    return np.concatenate([mesh.points[nodes], lips.x[order[1:][is_crossing]]])


def _contributions_near(solution: Solution, result: Estimate, x: Floats) -> Floats:
    """Absolute contributions of the cells at some points `(states, m)`."""
    if not len(x):
        return np.zeros_like(result.eta)
    is_near = _cells_near(solution, x)
    cell_shares = [shares(result.surplus, parts, is_total=True)[is_near] for parts in result.parts]
    return np.asarray(np.sum(cell_shares, axis=1))


def _signed_near(solution: Solution, result: Estimate, x: Floats) -> Floats:
    """Signed contributions of the surplus functions of the cells at some points `(states, m)`."""
    if not len(x):
        return np.zeros_like(result.eta)
    w = result.surplus
    functions = np.unique(w.functions[_cells_near(solution, x)])
    copies = w.copy[functions]
    all_functions = np.concatenate([functions, copies[copies >= 0]])
    return np.asarray(result.parts[:, all_functions].sum(axis=1))


def _at_pressed_junctions(solutions: Sequence[Solution], result: Estimate) -> tuple[Floats, Floats]:
    """Signed and absolute contributions of the cells at junctions where faces press."""
    signed_parts, absolute_parts = np.zeros((2, *result.eta.shape))
    for k, solution in enumerate(solutions):
        places = [
            j.x for j in solution.problem.junctions
            if any(_faces_press(solution, c, j.x) for c in (j.crack, j.on))
        ]  # fmt: skip
        x = np.array(places).reshape(-1, 2)
        signed_parts[k] = _signed_near(solution, result, x)[k]
        absolute_parts[k] = _contributions_near(solution, result, x)[k]
    return signed_parts, absolute_parts


def _inner_corners(mesh: Mesh) -> Floats:
    """Re-entrant corners of a body in 2D `(k, 2)`, without the corners of polygons for curves."""
    total = np.zeros(mesh.n_points)
    for i in range(3):
        a, b, c = (mesh.points[mesh.cells[:, (i + k) % 3]] for k in range(3))
        side, other_side = b - a, c - a
        cross = side[:, 0] * other_side[:, 1] - side[:, 1] * other_side[:, 0]
        angle = np.abs(np.arctan2(cross, np.einsum("ij,ij->i", side, other_side)))
        np.add.at(total, mesh.cells[:, i], angle)
    is_corner = np.zeros(mesh.n_points, dtype=bool)
    is_corner[mesh.boundary] = True
    is_corner &= total > np.pi + _REENTRANT
    for name in mesh.curves:
        is_corner[mesh.facet_sets[name]] = False
    return np.asarray(mesh.points[is_corner])


def _cells_near(solution: Solution, x: Floats) -> Bools:
    """Whether each cell contains one of some points `(cells,)`."""
    mesh = solution.problem.mesh
    if not len(x):
        return np.zeros(len(mesh.cells), dtype=bool)
    middle = mesh.cell_middles
    distance = np.linalg.norm(middle[:, None] - x, axis=2)
    return np.asarray((distance < _NEAR * cell_sizes(mesh, x)).any(axis=1))


# Bars of K at tips in 2D: how estimates become half-widths, and where there are none.

# Exact error over what the blocks of the surplus space give of it, in the median; so much more is
# missed at re-entrant corners, where stresses are singular.
_CAUGHT, _CAUGHT_AT_CORNERS = 1.3, 2.5
# Half-width over the estimate, the sum of the shares, and the spread of tips with little room: the
# root of the sum of squares, as each is small by chance in some scenes. The spread counts by the
# square of two cells over the room: where domains are not clipped they differ by far more
# than K is off, but at tips on points or edges of the mesh, where no function of the surplus space
# ends. (Of errors that are distributed normally, where .95 hold, .16 are more than ten times too
# wide.)
_ETA, _SHARES, _SPREAD, _SPREAD_ON_POINTS = 0.32, 0.12, 0.6, 0.4
_SPREAD_ROOM = 2.0
# Least half-width, of T √(π r): what integrals over domains of radius r make of a uniform stress
# along a crack, whose K is zero (1e-6 at worst on three adapted meshes).
_QUADRATURE = 3e-6
_AT_CORNERS = 0.2  # of what the cells at re-entrant corners contribute
_RIM, _END = 0.03, 0.55  # of changes of shape, and of the contact's end
_POLYGON = 1e-3  # share of K below which nothing is said of chords
_BEND = 1.5  # of the bar of a change of shape
_LOAD = 0.25  # of what given pressures miss between points: left by four times as many at a jump
# Cells, by their longest edges: the shortest crack between two tips and from a mouth to a tip, and
# the room between a tip and the next boundary or crack. Of drawn cracks between two tips the bar
# holds in 93 % from 2.8 cells on, in 60 % from 2.5 to 2.8, in 15 % below.
_SHORTEST = {1: 2.0, 2: 2.8}
_ROOM = 1.5
_OVERLAP = 0.02  # share of an overlap at one tip, as its negative K_I, that counts at all tips
# Of the shares of cells at kinks, whose functions catch a part only of what is singular, and of
# what moving the crack onto its kinks changes where faces press: that has no sign there.
_AT_KINKS, _MOVED = 4.6, 6.0
# Of the shares of cells at junctions where faces press. Stress is singular there, and what the
# blocks catch has no sign that could be trusted: what they give is from -2 to 7 times the error.
_AT_JUNCTIONS = 2.0
# In cells, the least distance from a junction to the next tip, boundary or junction, and from a
# kink to the boundary.
_BRANCH, _KINK_ROOM = 1.5, 1.0
_LEG = 1.0  # cells; a shorter piece between kinks, or to a tip, is rounded off
# Of the shares of cells where an interface meets a side or the crack, which are singular too.
_AT_INTERFACES = 0.8
_BESIDE = 2.2  # by how much bars grow a cell away from another material, less farther away


def tip_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[KErrors]:
    """Bars of the tips of one crack in some states of a solve that kept its factor.

    Parameters
    ----------
    solutions : sequence of Solution
    sifs : sequence of SIF
        One for each.
    crack : int
    """
    bars = bars_and_shares(solutions, sifs, crack)[0]
    common_reason = _refusal_of_short_parts(solutions[0], crack)
    reasons = [common_reason or _refusal_at_kinks(s, crack) for s in solutions]
    pairs = zip(bars, reasons, strict=True)
    return [_without_estimate(bar, reason) if reason else bar for bar, reason in pairs]


def bars_and_shares(
    solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int
) -> tuple[list[KErrors], Floats]:
    """Bars of the tips, and the absolute contributions of the cells to the estimates.

    Bars of cracks whose faces press at kinks that the cut rounds off, or with parts shorter than a
    cell at junctions and kinks, are too short: `tip_bars` has none there.

    Parameters
    ----------
    solutions, sifs, crack
        As of `tip_bars`.

    Returns
    -------
    bars : list of KErrors
    shares : (states, tips, 2, cells) array, stress · √length
        Zero where there are no estimates.
    """
    shape = sifs[0].K.shape
    general_reason = _refusal_of_solution(solutions[0], crack)
    if general_reason or not shape[0]:
        cells = len(solutions[0].problem.mesh.cells)
        return [no_bars(shape, general_reason)] * len(sifs), np.zeros((len(sifs), *shape, cells))
    errors = tip_errors(solutions, crack)
    tips = solutions[0].space.tips_of(crack)
    domains = [domain_of(solutions[0], t) for t in tips]
    bars = [
        _bars(sif, errors, k, domains, s, crack)
        for k, (sif, s) in enumerate(zip(sifs, solutions, strict=True))
    ]
    _warn_of_polygon(errors.chords, bars, sifs, crack)
    return bars, errors.shares + errors.gap_shares


def _refusal_of_solution(solution: Solution, crack: int) -> str:
    """Why a solution has no estimates at all, or nothing."""
    problem = solution.problem
    if solution.space.order == 1:
        return "order 1 has no estimate in 2D: give order=2"
    method = problem.numerics.contact_method
    if solution.contact[crack] is not None and method is not None:
        return f"contact by {method.label} has no estimate"
    if solution.has_friction:
        return "friction has no estimate"
    materials = problem.elasticity.materials
    if len(materials) > 1:
        for material in materials:
            if isotropic_part(material.unit.tensor(2))[2] is not None:
                return f"{material.kind} is not isotropic, and has no estimate"
    return ""


def _least_at_tip(solution: Solution, crack: int, domain: Domain) -> tuple[float, float, str]:
    """Largest cell at a tip for which bars hold, the cell there, and why it is too large."""
    least_cells = _SHORTEST[len(solution.space.tips_of(crack))]
    length, size = float(solution.lips[crack].weight.sum()), domain.size
    label = {
        length / least_cells: f"the crack is {length / size:.1f} cells long, and bars hold from "
        f"{least_cells:g} on: refine the mesh there",
        domain.interface / BESIDE: f"another material begins {domain.interface / size:.2g} cells "
        f"away, and bars hold from {BESIDE:g} on: refine the mesh there",
        domain.room / _ROOM: f"the next boundary, crack or tip is {domain.room / size:.1f} cells "
        f"away, and bars hold from {_ROOM:g} on: refine the mesh there",
    }
    return (
        min(label),
        size,
        next((text for length_needed, text in label.items() if length_needed < size), ""),
    )


def _bars(
    sif: SIF, errors: TipErrors, k: int, domains: Sequence[Domain], solution: Solution, crack: int
) -> KErrors:
    """Bars of one state."""
    places = [_least_at_tip(solution, crack, domain)[2] for domain in domains]
    estimate = _CAUGHT * (errors.eta[k] - errors.at_junctions[k])
    estimate = estimate + (_CAUGHT_AT_CORNERS - _CAUGHT) * errors.corners[k]
    eta = estimate + errors.bend[k] + errors.rim[k] + errors.gap[k] + errors.load[k]
    clipping = _clipping(domains)[:, None] ** 2
    on_points = _SPREAD_ON_POINTS * _are_on_points(solution, crack)[:, None]
    contact = np.hypot(_END * errors.end[k], errors.gap_bar[k])
    parts = [
        _ETA * estimate, _AT_CORNERS * errors.corners[k],
        _SHARES * errors.shares[k].sum(axis=-1), _SPREAD * clipping * sif.spread,
        on_points * sif.spread, _AT_KINKS * errors.kinks[k], _AT_INTERFACES * errors.interfaces[k],
        contact, _BEND * errors.bend_bar[k], _RIM * errors.rim[k],
        _LOAD * errors.load[k], _AT_JUNCTIONS * errors.junctions[k],
    ]  # fmt: skip
    if any(_faces_press(solution, crack, x) for x in kinks_inside(solution, crack)):
        eta = eta - errors.bend[k]
        parts.append(_MOVED * errors.bend[k])
    bar = np.sqrt(np.sum(np.square(parts), axis=0))
    bar *= _factors_of_interfaces(domains)[:, None]
    radius = np.array([domain.outer_radius for domain in domains])
    least_bar = _QUADRATURE * np.abs(np.nan_to_num(sif.T)) * np.sqrt(np.pi * radius)
    bar = np.maximum(bar, least_bar[:, None])
    if solution.problem.contact != "off":  # negative K_I: faces overlap where contact is blind
        overlap = np.maximum(np.maximum(-sif.K_I, -sif.K_I - eta[:, 0]), 0.0)
        bar += _OVERLAP * overlap.max()
        contact = contact + _OVERLAP * overlap.max()
        contact[:, 0] += np.maximum(overlap - bar[:, 0], 0.0)
        bar[:, 0] = np.maximum(bar[:, 0], overlap)
    # K_I of closed tips is zero; its bar is what the integral gave.
    eta[sif.closed, 0] = 0.0
    bar[sif.closed, 0] = contact[sif.closed, 0] = np.abs(sif.K_integral[sif.closed, 0])
    return bars_of(eta, bar, places, contact)


def _are_on_points(solution: Solution, crack: int) -> Bools:
    """Tips that lie on points or edges of the mesh, and so in several cells `(f,)`."""
    cells = solution.space.cuts[crack].level_set.tip_cells
    tips = [solution.space.tips[t] for t in solution.space.tips_of(crack)]
    return np.array([len(cells[tip.number]) > 1 for tip in tips], dtype=bool)


def _clipping(domains: Sequence[Domain]) -> Floats:
    """Cells of room that tips should have over those they have, at most one `(f,)`."""
    cells = np.array([domain.room / domain.size for domain in domains])
    return np.asarray(np.minimum(1.0, _SPREAD_ROOM / cells))


def _factors_of_interfaces(domains: Sequence[Domain]) -> Floats:
    """How much wider bars are at tips with another material beside them `(f,)`."""
    return np.array([1 + _BESIDE * domain.size / domain.interface for domain in domains])


def _without_estimate(bars: KErrors, reason: str) -> KErrors:
    reasons = [common_reason or reason for common_reason in bars.reasons]
    return bars_of(bars.eta, bars.bar, reasons, bars.contact)


def _faces_press(solution: Solution, crack: int, x: Floats) -> bool:
    """Whether the faces press at a point of a crack."""
    contact = solution.contact[crack]
    if contact is None:
        return False
    is_near = np.linalg.norm(contact.points - x, axis=1) <= cell_sizes(
        solution.problem.mesh, x[None]
    )
    return bool((contact.closed & (contact.pressure > 0))[is_near].any())


def _round_kinks(solution: Solution, crack: int) -> list[Floats]:
    """Kinks that the cut rounds off, at which the faces press."""
    if solution.contact[crack] is None:
        return []
    kinks, of_cut = kinks_inside(solution, crack), solution.space.cuts[crack].kinks.points
    if not len(kinks):
        return []
    # A kink of the cut is that kink of the crack which is nearest to it.
    nearest_kink = np.linalg.norm(of_cut[:, None] - kinks, axis=2).argmin(axis=1)
    sizes = cell_sizes(solution.problem.mesh, kinks)
    distances = [
        np.linalg.norm(of_cut[nearest_kink == k] - x, axis=1).min(initial=np.inf)
        for k, x in enumerate(kinks)
    ]
    kink_rows = zip(kinks, distances, sizes, strict=True)
    return [x for x, d, size in kink_rows if d > size and _faces_press(solution, crack, x)]


def _refusal_at_kinks(solution: Solution, crack: int) -> str:
    """Why faces that press at a kink leave no estimate, or nothing.

    A sharp kink locks where one that the cut rounds off slides: no first-order estimate sees that.
    """
    round_kinks = _round_kinks(solution, crack)
    if not round_kinks:
        return ""
    return (
        f"the faces press at the kink at {at(round_kinks[0])}, which the cut rounds off because it "
        "is sharper than 100° or less than a cell from a tip or another kink: compare with a mesh "
        "that is finer there"
    )


def _room_of_round_kinks(solution: Solution, crack: int) -> list[tuple[Floats, float, float]]:
    """Kinks that the cut rounds off as too close to a kink or tip: place, distance, cell size."""
    points = solution.space.cracks[crack].points
    result = []
    for x in _round_kinks(solution, crack):
        distances = np.linalg.norm(points - x, axis=1)
        size = float(cell_sizes(solution.problem.mesh, x[None])[0])
        result.append((x, float(distances[distances > _SAME * size].min()), size))
    return result


def doubts_at_kinks(solutions: Sequence[Solution], crack: int) -> list[str]:
    """What to warn of where faces press at a kink that the cut rounds off.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one solve in 2D.
    crack : int
    """
    refusals = (_refusal_at_kinks(solution, crack) for solution in solutions)
    first = next((text for text in refusals if text), "")
    return [f"K of crack {crack}: {first}."] if first else []


def _refusal_of_short_parts(solution: Solution, crack: int) -> str:
    """Why a part of a crack at a junction or a kink is too short for an estimate, or nothing."""
    for x, room, least_cells, size in _short_parts(solution, crack):
        if room >= least_cells * size:
            continue
        if least_cells == _BRANCH:
            return (
                f"the next tip, junction or boundary is {room / size:.1f} cells from the junction "
                f"at {at(x)}, and bars hold from {least_cells:g} on: refine the mesh there"
            )
        return (
            f"the boundary is {room / size:.1f} cells from the kink at {at(x)}, and bars hold "
            f"from {least_cells:g} on: refine the mesh there"
        )
    return ""


def _short_parts(solution: Solution, crack: int) -> list[tuple[Floats, float, float, float]]:
    """Junctions and kinks of a crack: place, room, cells that bars hold from, size of the cell."""
    problem = solution.problem
    mesh, junctions = problem.mesh, problem.junctions
    parts = []
    for j in junctions:
        if crack not in (j.crack, j.on):
            continue
        lines = [problem.placed[c] for c in (j.crack, j.on)]
        ends = [line.points[i] for line in lines for i in line.tips or ()]
        other_places = [k.x for k in junctions if {k.crack, k.on} & {j.crack, j.on}]
        distance = np.linalg.norm(np.array([*ends, *other_places]) - j.x, axis=1)
        size = float(cell_sizes(mesh, j.x[None])[0])
        room = min([_room(mesh, j.x), *distance[distance > _SAME * size]])
        parts.append((j.x, float(room), _BRANCH, size))
    kinks = kinks_inside(solution, crack)
    sizes: Floats = cell_sizes(mesh, kinks) if len(kinks) else np.zeros(0)
    parts.extend(
        (x, _room(mesh, x), _KINK_ROOM, float(size)) for x, size in zip(kinks, sizes, strict=True)
    )
    return parts


_SAME = 1e-6  # cells: nearer points are one


def _room(mesh: Mesh, x: Floats) -> float:
    """Distance of a point to the boundary."""
    return float(distance_to_simplices(x, mesh.points[mesh.boundary]).min())


def _warn_of_polygon(change: Floats, bars: Sequence[KErrors], sifs: Sequence[SIF], c: int) -> None:
    """Say what K changes if a polygon stands for a curve, where that is more than its bars."""
    ratios = [
        float(np.abs(changes).max() / np.abs(sif.K).max())
        for changes, errors, sif in zip(change, bars, sifs, strict=True)
        if (np.abs(changes) > errors.bar).any() and sif.K.any()
    ]
    if ratios and max(ratios) > _POLYGON:
        warn(
            f"K of crack {c} is that of the polygon that the mesh is. Parts of its boundary look "
            f"like chords of curves; if they are, K changes by about {max(ratios):.1g} of the "
            "largest, which bars leave out. xc.fit_curves(mesh) gives the mesh the curves through "
            "its points, as cells of second order do."
        )


# Bars of K along fronts in 3D: order 2 beside order 1, two domains and wider hats at order 2.

# Half-width over the change of a place with hats twice as wide, and over root mean squares along
# the front of that and of the spread of smooth K: the root of the sum of squares. What domains
# differ by at one place tells no more of its error, which is smooth, than at others. Of 22 000
# values of 112 scenes the bar holds in .970 (the scenes' mean).
_WIDENED = 0.26
_SPREAD_ALONG, _WIDENED_ALONG = 5.5, 0.7
# Along a front that ends on the face of another crack K falls to a third within a hat or two: what
# wider hats change is the error. With it .99 of 1098 values on six fronts hold, .90 without; of 366
# on two more 1.0 and .975.
_WIDENED_OF_ARM = 1.75
_LEAST_OF_MODES = 0.75  # with friction: of the largest change of a mode, the least of each


def front_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[KErrors]:
    """Bars along the fronts of one crack in some states of a solve.

    Parameters
    ----------
    solutions : sequence of Solution
        At order 1 their states are solved again at order 2 on the same mesh.
    sifs : sequence of SIF
        One for each.
    crack : int
    """
    reason_missing = without_estimate(solutions, sifs)
    if reason_missing is not None:
        return reason_missing
    if solutions[0].space.order == 2:
        widening = _WIDENED_OF_ARM if solutions[0].space.cracks[crack].ends_on else _WIDENED
        return [_of_spread(sif, widening) for sif in sifs]
    finer_solutions = solve_states(
        replace(solutions[0].problem, order=2), [s.state for s in solutions]
    )
    reason = "order 2 has other fronts than order 1: refine the mesh along them"
    return bars_beside(
        sifs, _sifs_of_fronts(finer_solutions, crack), reason, solutions[0].has_friction
    )


def _sifs_of_fronts(solutions: Sequence[Solution], crack: int) -> list[SIF]:
    """K along all fronts of a crack in each state."""
    by_front = [front_intensity(solutions, t) for t in solutions[0].space.tips_of(crack)]
    return [joined_sif([states[k] for states in by_front], 3) for k in range(len(solutions))]


def without_estimate(solutions: Sequence[Solution], sifs: Sequence[SIF]) -> list[KErrors] | None:
    """Empty bars where nothing can be estimated, else None."""
    if not len(sifs[0].K):
        return [no_bars(sifs[0].K.shape, "")] * len(sifs)
    if not _is_whole_path(solutions):
        reason = "friction has no estimate without the states on the way: give all of the solve"
        return [no_bars(sifs[0].K.shape, reason)] * len(sifs)
    return None


def _is_whole_path(solutions: Sequence[Solution]) -> bool:
    """Whether these states can be solved again: with friction all that a solve began with."""
    return not solutions[0].has_friction or all(s.number == k for k, s in enumerate(solutions))


def bars_beside(
    sifs: Sequence[SIF], better_sifs: Sequence[SIF], reason: str, has_friction: bool
) -> list[KErrors]:
    """Bars of K that are the difference to a better one, which is best.

    Parameters
    ----------
    sifs, better_sifs : sequences of SIF
        One a state, along the fronts of one crack.
    reason : str
        Why there is none, where the better one has other fronts.
    has_friction : bool
        Whether faces rub: slip binds the modes together, and none is better known than the others;
        both orders slip on the same groups of contact, and what domains of the better one differ by
        counts too.
    """
    if any(
        len(np.unique(a.front)) != len(np.unique(b.front))
        for a, b in zip(sifs, better_sifs, strict=True)
    ):
        return [no_bars(sif.K.shape, reason) for sif in sifs]
    return [
        _of_difference(sif, better_sif, has_friction)
        for sif, better_sif in zip(sifs, better_sifs, strict=True)
    ]


def _of_spread(sif: SIF, share: float) -> KErrors:
    """At order 2 bars are by two domains, hats twice as wide, and what smooth K leaves out."""
    eta = _smooth_domains(sif)[:, 0] - sif.K
    eta[sif.closed, 0] = 0.0
    return _complete_errors(sif, eta, np.hypot(_half_of_spread(sif, share), _mean(sif, eta)))


def _smooth_domains(sif: SIF) -> Floats:
    """K of both domains `(f, 2, d)`, on curves along the front where they are known."""
    if sif.smooth_K is not None:
        return sif.smooth_K
    return np.stack([sif.K, sif.K + sif.spread], axis=1)


def _half_of_spread(sif: SIF, share: float = _WIDENED) -> Floats:
    """Half-width by two domains and by hats twice as wide, as root mean square along the front."""
    widening = np.zeros_like(sif.K) if sif.widened is None else np.array(sif.widened)
    spread = np.abs(np.diff(_smooth_domains(sif), axis=1)[:, 0])
    spread[sif.closed, 0] = widening[sif.closed, 0] = 0.0
    parts = [
        share * widening,
        _SPREAD_ALONG * _mean(sif, spread), _WIDENED_ALONG * _mean(sif, widening),
    ]  # fmt: skip
    return np.asarray(np.sqrt(np.sum(np.square(parts), axis=0)))


def _of_difference(sif: SIF, finer_sif: SIF, has_friction: bool) -> KErrors:
    """K of the other solution is best, and the difference its bar; more where faces rub."""
    finer_K, domain_error = np.empty((2, *sif.K.shape))
    half = _half_of_spread(finer_sif) if has_friction else np.zeros_like(finer_sif.K)
    for front in np.unique(sif.front):
        is_on_front, rows = sif.front == front, finer_sif.front == front
        for to, values in ((finer_K, _smooth_domains(finer_sif)[:, 0]), (domain_error, half)):
            to[is_on_front] = _at(sif.x[is_on_front], finer_sif.x[rows], values[rows])
    eta = finer_K - sif.K
    eta[sif.closed, 0] = 0.0
    mean = _mean(sif, eta)
    if has_friction:
        mean = np.maximum(mean, _LEAST_OF_MODES * mean.max(axis=1, keepdims=True, initial=0.0))
    return _complete_errors(sif, eta, np.hypot(np.maximum(np.abs(eta), mean), domain_error))


def _at(x: Floats, vertices: Floats, values: Floats) -> Floats:
    """Values between the vertices of a front, at the places nearest to points."""
    vertex = np.linalg.norm(x[:, None] - vertices, axis=2).argmin(axis=1)
    result, distance = values[vertex], np.linalg.norm(x - vertices[vertex], axis=1)
    for step in (-1, 1):
        next_to = (vertex + step) % len(vertices)  # beyond the ends the nearest stays nearer
        side = vertices[next_to] - vertices[vertex]
        square = np.einsum("ij,ij->i", side, side)
        share = np.einsum("ij,ij->i", x - vertices[vertex], side)
        share = np.clip(share / np.where(square > 0, square, 1.0), 0.0, 1.0)[:, None]
        distance_to_front = np.linalg.norm(x - vertices[vertex] - share * side, axis=1)
        is_nearer = distance_to_front < distance
        interpolated = (1 - share) * values[vertex] + share * values[next_to]
        result = np.where(is_nearer[:, None], interpolated, result)
        distance = np.minimum(distance, distance_to_front)
    return np.asarray(result)


def _mean(sif: SIF, values: Floats) -> Floats:
    """Root mean square of values along the front of each place."""
    result = np.array(values)
    counts = ~sif.at_surface if not sif.at_surface.all() else sif.at_surface
    for front in np.unique(sif.front):
        is_on_front = sif.front == front
        rows = values[is_on_front & counts] if (is_on_front & counts).any() else values[is_on_front]
        result[is_on_front] = np.sqrt((rows**2).mean(axis=0))
    return result


def _complete_errors(sif: SIF, eta: Floats, bar: Floats) -> KErrors:
    """Errors without K_I of closed places, which is exact, and nan beside a free surface."""
    contact = np.zeros_like(bar)
    bar[sif.closed, 0] = contact[sif.closed, 0] = np.abs(sif.K_integral[sif.closed, 0])
    reason = (
        "K has no meaning so close to a free surface, nor is it known beside a side that is held: "
        "it is that of the nearest place where it is"
    )
    return bars_of(eta, bar, [reason if at else "" for at in sif.at_surface], contact)


# Bars of K along fronts in 3D from another solution: with smaller cells along the fronts.

FINER = 1.5  # times
_NEAR_FRONT = 2.0  # cells around the fronts that become smaller


def finer_bars(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[KErrors]:
    """Bars along the fronts of one crack: its states are solved again, with finer cells there.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one solve, in 3D. Whatever their order, the others are of order 2.
    sifs : sequence of SIF
        One for each.
    crack : int

    Returns
    -------
    list of KErrors
        `best` is K of the finer solution.
    """
    reason_missing = without_estimate(solutions, sifs)
    if reason_missing is not None:
        return reason_missing
    problem = solutions[0].problem
    try:
        scene = replace(problem, mesh=finer_along(problem, crack), order=2)
        finer_solutions = solve_states(scene, [s.state for s in solutions])
    except GeometryError as error:
        return [no_bars(sif.K.shape, f"no finer mesh to compare with: {error}") for sif in sifs]
    reason = "the finer mesh has other fronts: refine the mesh along them"
    return bars_beside(sifs, _sifs_of_fronts(finer_solutions, crack), reason, False)


def finer_along(problem: Problem, crack: int) -> Mesh:
    """The mesh with cells along the fronts of one crack that are smaller by 1.5."""
    mesh, placed_crack = problem.mesh, problem.placed[crack]
    front = cKDTree(
        points_between([placed_crack.points[front] for front in placed_crack.fronts or ()])
    )
    centre = mesh.cell_middles
    is_near = front.query(centre)[0] <= _NEAR_FRONT * mesh.cell_size
    sizes = np.where(is_near, mesh.cell_size / FINER, np.inf)

    def size_at(x: Floats) -> Floats:
        return np.asarray(sizes[mesh.cell_tree.query(x)[1]])

    return refine(mesh, size=size_at)


_Estimate = Callable[[Sequence[Solution], Sequence[SIF], int], list[KErrors]]


def with_bars(
    solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int, by: str = ""
) -> list[SIF]:
    """K of one crack in some states with its error bars; zero in states at rest.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one solve. Where it kept no factor, these states are solved again in 2D.
    sifs : sequence of SIF
        One for each.
    crack : int
    by : {"", "front"}
        "front": from a solution with smaller cells along the fronts, in 3D.

    Raises
    ------
    ProblemError
        "front" in 2D.
    """
    numbers_under_load = [k for k, s in enumerate(solutions) if not s.at_rest]
    zero = np.zeros_like(sifs[0].K)
    result = [replace(sif, errors=KErrors(zero, zero, ("",) * len(zero))) for sif in sifs]
    if not numbers_under_load:
        return result
    loaded_solutions = [solutions[k] for k in numbers_under_load]
    of_dim = _BARS[by].get(loaded_solutions[0].space.dim)
    if of_dim is None:
        raise ProblemError(
            'stress_intensity: error="front" is for fronts in 3D: give True, from one solve.'
        )
    for k, bars in zip(
        numbers_under_load,
        of_dim(loaded_solutions, [sifs[k] for k in numbers_under_load], crack),
        strict=True,
    ):
        result[k] = replace(sifs[k], errors=bars)
    return result


def _of_tips(solutions: Sequence[Solution], sifs: Sequence[SIF], crack: int) -> list[KErrors]:
    """Bars of tips in 2D, from the factor that the solve has kept."""
    if solutions[0].factored is None:
        problem, states = solutions[0].problem, [s.state for s in solutions]
        solutions = solve_states(problem, states, error=True)
    places = _places_of_finer_cells(solutions)
    if places is not None:
        bars = bars_by_finer_cells(solutions, sifs, crack, places, tip_bars)
        if bars is not None:
            return bars
    return tip_bars(solutions, sifs, crack)


_MARGIN = 2.0  # cells become smaller by more than what is asked for
_FINEST = 24.0  # times, at most


def _places_of_finer_cells(solutions: Sequence[Solution]) -> Places | None:
    """Where cells are too large for bars of any crack; all faces where nothing is estimated.

    None where they are small enough, or a second solution is no help: at order 1, for a contact
    method, and with friction where states are missing on the way to these.
    """
    solution = solutions[0]
    space = solution.space
    if space.order == 1:
        return None
    cracks = range(len(space.cracks))
    general_reasons = [reason for c in cracks if (reason := _refusal_of_solution(solution, c))]
    if general_reasons and not all(has_help(reason) for reason in general_reasons):
        return None
    if general_reasons:
        return along_faces(solution) if _is_whole_path(solutions) else None
    pairs = []
    for t, tip in enumerate(space.tips):
        target, size, _ = _least_at_tip(solution, tip.crack, domain_of(solution, t))
        pairs.append((tip.x, target, size))
    for c in cracks:
        pairs += [
            (x, room / least_cells, size)
            for x, room, least_cells, size in _short_parts(solution, c)
        ]
        for s in solutions:
            pairs += [(x, room / _LEG, size) for x, room, size in _room_of_round_kinks(s, c)]
    places_to_refine = [
        (x, max(target / _MARGIN, size / _FINEST)) for x, target, size in pairs if target < size
    ]
    if not places_to_refine:
        return None
    return Places(
        np.array([x for x, _ in places_to_refine]), np.array([size for _, size in places_to_refine])
    )


_BARS: dict[str, dict[int, _Estimate]] = {
    "": {2: _of_tips, 3: front_bars},
    "front": {3: finer_bars},
}


__all__ = ["FINER", "finer_along", "finer_bars"]
