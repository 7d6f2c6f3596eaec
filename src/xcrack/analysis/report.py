"""What a solve did, what it left out and why, and numbers that no part of a machine has."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.analysis.plan import Ingredient, Report, Resultant, ingredients_of
from xcrack.analysis.solution import Solution, SolveOutcome
from xcrack.base.arrays import Floats, Ints, at, coordinates
from xcrack.crack.crack import Crack
from xcrack.fem.function_space import FunctionSpace
from xcrack.mesh.curved_facets import outline_gain
from xcrack.mesh.mesh import Mesh, facet_set, supported_nodes
from xcrack.mesh.simplex import outward_areas
from xcrack.model.loads import Load, Support
from xcrack.model.material import von_mises
from xcrack.model.problem import Problem


def report(
    problem: Problem,
    space: FunctionSpace,
    outcome: SolveOutcome,
    resultants_of_state: tuple[Resultant, ...],
) -> Report:
    """The plan of a problem, completed by what its solution took."""
    d = space.dim
    rows = []
    n_heaviside = sum(int((h >= 0).sum()) for h in space.heaviside) * d
    basis = problem.numerics.tip_basis
    unknowns = [d * tip.functions if basis is None else basis.unknowns(d) for tip in space.tips]
    n_points = [int((tip.point_to_function >= 0).sum()) for tip in space.tips]
    n_tip = sum(n * k for n, k in zip(n_points, unknowns, strict=True))
    for row in ingredients_of(problem):
        if row.name == "Heaviside functions":
            row = replace(row, unknowns=n_heaviside)
        elif row.name == "tip functions" and row.used:
            radii = ", ".join(f"{r:.4g}" for r in space.radius)
            row = replace(row, unknowns=n_tip, reason=f"{row.reason}; radius {radii}")
        elif row.name.startswith("multipliers of crack"):
            row = _multiplier_row(problem, outcome, int(row.name.split()[-1]))
        elif row.name == "friction" and row.used:
            row = _friction_row(row, outcome)
        elif row.name == "supports" and outcome.n_motions:
            row = replace(
                row,
                reason=f"{outcome.n_motions} rigid motion(s) free and removed; loads balance "
                f"to {outcome.imbalance:.1e}",
            )
        rows.append(row)
    sharing = "share one" if outcome.n_states > 1 else "one"
    words = f"{outcome.n_states}, {sharing} {outcome.shared_part}"
    rows.append(Ingredient("load states", True, words))
    standard = space.n_nodes * d
    rows.append(Ingredient("standard functions", True, f"order {space.order}", unknowns=standard))
    for c, (given_crack, placed_crack) in enumerate(
        zip(problem.cracks, problem.placed, strict=True)
    ):
        n_joints = sum(junction.crack == c for junction in problem.junctions)
        is_moved = not given_crack.placed and not np.array_equal(
            given_crack.points, placed_crack.points
        )
        if is_moved and (placed_crack.fronts is not None or 2 - placed_crack.n_tips - n_joints):
            rows.append(
                Ingredient(
                    f"mouths of crack {c}", True, _mouths(given_crack, placed_crack, n_joints)
                )
            )
    if problem.junctions:
        places = [
            f"{junction.crack} on {junction.on} at {at(junction.x)}"
            for junction in problem.junctions
        ]
        rows.append(Ingredient("ends on other cracks", True, ", ".join(places)))
    if outcome.unbalanced_share is not None:
        share = f"{outcome.unbalanced_share:.2%}"
        reason = f"{share} of its energy is out of balance: it relaxes without any crack"
        rows.append(Ingredient("initial stress", True, reason))
    if outcome.solver_reason:
        rows.append(Ingredient("linear solver", True, outcome.solver_reason))
    return Report(tuple(rows), outcome.operations, resultants_of_state)


def _mouths(given_crack: Crack, placed_crack: Crack, n_joints: int) -> str:
    if placed_crack.dim == 3:
        words = "sides refined to the size of the cells, prolonged to the outside where open"
        placed_points = {tuple(x) for x in placed_crack.points.tolist()}
        n_lost = sum(tuple(x) not in placed_points for x in given_crack.points.tolist())
        return words + (f"; {n_lost} corner(s) of fronts rounded to two cells" if n_lost else "")
    return f"{2 - placed_crack.n_tips - n_joints}, prolonged to one cell outside"


def _multiplier_row(problem: Problem, outcome: SolveOutcome, c: int) -> Ingredient:
    name, unknowns = f"multipliers of crack {c}", outcome.multipliers[c]
    if unknowns is not None:
        reason = (
            "contact is switched on" if problem.contact == "on" else "the open crack faces overlap"
        )
        if problem.numerics.contact_method is not None:
            reason += f"; by {problem.numerics.contact_method.label}"
        return Ingredient(name, True, reason, unknowns=unknowns)
    if problem.contact == "off":
        return Ingredient(name, False, "contact is switched off: crack faces may overlap")
    return Ingredient(name, False, "the crack faces stay apart in every load state")


def _friction_row(row: Ingredient, outcome: SolveOutcome) -> Ingredient:
    if not outcome.shear:
        return replace(row, used=False, reason="no crack with friction has faces that press")
    return replace(row, unknowns=sum(outcome.shear))


# Magnitudes that no part of a machine has: slips of units, or loads left out.

# Limits beyond which a number is more likely a slip than a state of a part.
_OUTLINE = 0.01  # share of the area of a loaded side that its straight outline lacks
_HELD_ELSEWHERE = 2e-3  # distance of a mesh point from where its support is, over the body's size
_ROUND_OFF = 1e-6  # share of the largest force: a reaction below it is none
_MOVED = 0.02  # displacement over the size of the body
_STRAINED = 0.01  # stress over Young's modulus
_SHARE = 0.95  # of the volume: beside corners and point forces stress has no limit
_UNIT = 10.0  # Young's moduli up to here are those of scenes without units
_MPA, _PA = (1e3, 1e6), (1e9, 1e12)  # between which Young's modulus of a solid lies


@dataclass(frozen=True)
class Alarm:
    """A number beyond its limit.

    Attributes
    ----------
    quantity : str
        What the number is.
    value, limit : float
    place : str
        Where it is; empty where that is the whole scene.
    remedy : str
    """

    quantity: str
    value: float
    limit: float
    place: str
    remedy: str

    def __str__(self) -> str:
        side = (
            "below"
            if self.value < self.limit
            else "above"
            if self.value > self.limit
            else "not above"
        )
        place = f" {self.place}" if self.place else ""
        number = f"{self.value:.4g}, {side} {self.limit:.4g}"
        return f"{self.quantity} is {number}{place}: {self.remedy}"


def has_units(problem: Problem) -> bool:
    """Whether numbers of the scene have units: a yield stress is given, or a modulus of a solid."""
    elasticity = problem.elasticity
    return elasticity.knows_yield or elasticity.largest_modulus > _UNIT


def millimetre(problem: Problem) -> float | None:
    """Length of a millimetre where Young's modulus is in MPa or Pa; None where it is in neither."""
    E = problem.elasticity.largest_modulus
    return 1.0 if _MPA[0] < E < _MPA[1] else 1e-3 if _PA[0] < E < _PA[1] else None


def alarms_of_solutions(solutions: Sequence[Solution], *, stresses: bool = True) -> list[Alarm]:
    """What is beyond its limit in the load states of a problem.

    Parameters
    ----------
    solutions : sequence of Solution
        Of one problem, at least one.
    stresses : bool
        Judge stresses too, which takes as long as a picture of them.
    """
    problem = solutions[0].problem
    if not any(solution.u.any() for solution in solutions):
        words = "give loads=[...], or a displacement that is not zero: K is zero everywhere."
        return [Alarm("the largest displacement", 0.0, 0.0, "in all load states", words)]
    loads = dict.fromkeys(load for s in solutions for load in s.loads)
    geometry_alarms = _outlines(problem.mesh, loads) if problem.mesh.curves else []
    geometry_alarms += [alarm for s in problem.supports for alarm in _moved_points(solutions, s)]
    # What is imposed has no unit of a modulus.
    forces = any("support" not in load.acts for load in loads)
    if not has_units(problem) or not forces:
        return geometry_alarms
    alarms = [_displacement(solution) for solution in solutions]
    if stresses:
        alarms += [_stress(solution) for solution in solutions]
    worst_alarms: dict[str, Alarm] = {}
    for alarm in alarms:
        worst_alarm = worst_alarms.get(alarm.quantity)
        if alarm.value > alarm.limit and (worst_alarm is None or alarm.value > worst_alarm.value):
            worst_alarms[alarm.quantity] = alarm
    return geometry_alarms + list(worst_alarms.values())


def _outlines(mesh: Mesh, loads: Iterable[Load]) -> list[Alarm]:
    """Loads by area on plane sides whose outline is too coarse for the curves there."""
    alarms = []
    for load in loads:
        if "traction" not in load.acts or load.has_one_arrow:
            continue
        facets = facet_set(mesh, load.where, load.name)
        area = float(np.linalg.norm(outward_areas(mesh, facets, load.name), axis=1).sum())
        gain = outline_gain(mesh, facets)
        share = abs(gain) / (area + gain)
        if share > _OUTLINE:
            place = "that its cells leave out" if gain > 0 else "by which its cells are too large"
            words = (
                f"the outline of {load.where!r} is curved and its cells are coarse, so that the "
                f"force of {load.name}, and K with it, is {share:.1%} too "
                f"{'low' if gain > 0 else 'high'}. Make cells there smaller, or give the force: "
                f"xc.resultant({load.where!r}, (...))."
            )
            quantity = f"the share of the area of {load.where!r} {place}"
            alarms.append(Alarm(quantity, share, _OUTLINE, "", words))
    return alarms


def _moved_points(solutions: Sequence[Solution], support: Support) -> list[Alarm]:
    """A support at points that holds mesh points elsewhere, and with a force."""
    mesh = solutions[0].space.mesh
    if support.place is None or isinstance(support.place, str):
        return []
    x = np.asarray(support.place)
    all_nodes = np.concatenate([mesh.points, mesh.edge_middles])
    nodes = all_nodes[supported_nodes(mesh, x, support.kind)]
    distance = np.linalg.norm(nodes - x, axis=1) / mesh.extent
    k = int(np.argmax(distance))
    if distance[k] <= _HELD_ELSEWHERE or not any(_has_reaction(s, support) for s in solutions):
        return []
    remedy = (
        "what bends between supports changes with their distance, and K with it. Give a mesh "
        "point, refine the mesh there, or hold a facet set."
    )
    quantity = (
        f"the distance of {support.name} from the mesh point {coordinates(nodes[k])} that it "
        "holds, over the size of the body,"
    )
    return [Alarm(quantity, float(distance[k]), _HELD_ELSEWHERE, "", remedy)]


def _has_reaction(solution: Solution, support: Support) -> bool:
    """Whether the reaction of a support is more than round-off leaves."""
    rows = solution.summary.resultants
    size = {row.name: float(np.linalg.norm(row.force)) for row in rows}
    return size[f"reaction of {support.name}"] > _ROUND_OFF * max(size.values())


def _displacement(solution: Solution) -> Alarm:
    """Largest displacement over the size of the body, of nodes without other functions."""
    space = solution.space
    n = space.mesh.n_points
    is_plain_node = np.ones(n, dtype=bool)
    is_plain_node[space.mesh.cells[space.signature != 0]] = False
    u = np.linalg.norm(solution.coefficients[:n], axis=1) * (
        is_plain_node if is_plain_node.any() else 1
    )
    node = int(np.argmax(u))
    E = solution.problem.elasticity.largest_modulus
    remedy = f"is Young's modulus, {E:.4g}, in the unit of the loads, and are these as meant?"
    if E < _MPA[0]:
        remedy += " A modulus in GPa is a thousand times as large in MPa."
    return Alarm(
        "the largest displacement over the size of the body",
        float(u[node] / space.mesh.extent),
        _MOVED,
        f"at {coordinates(space.mesh.points[node])}",
        remedy,
    )


def _stress(solution: Solution) -> Alarm:
    """Stress that a twentieth of the body exceeds, away from cracks."""
    space, elasticity = solution.space, solution.problem.elasticity
    cells = np.nonzero(space.signature == 0)[0]
    cells = cells if len(cells) else np.arange(len(space.mesh.cells))
    d = space.dim
    bary = np.full((len(cells), d + 1), 1 / (d + 1))
    sides = np.ones((len(cells), len(space.cuts)), dtype=np.int64)
    sigma = solution.stress_at(cells, bary, sides)
    von_mises_stress = von_mises(_in_space(solution, sigma, cells, bary))
    limit = elasticity.moduli_of_cells[cells] * _STRAINED
    if elasticity.knows_yield:
        limit = elasticity.yield_of_cells(cells)
    order = np.argsort(von_mises_stress / limit)
    volume = np.cumsum(space.mesh.volume[cells][order])
    k = int(order[np.searchsorted(volume, _SHARE * volume[-1])])
    place = f"at {coordinates(space.mesh.points[space.mesh.cells[cells[k]]].mean(axis=0))}"
    if elasticity.knows_yield:
        return Alarm(
            "the stress (von Mises) that 5 % of the body exceeds",
            float(von_mises_stress[k]),
            float(limit[k]),
            place,
            "the body yields away from cracks too, so that linear elasticity does not hold: is the "
            "yield stress in the unit of the loads, and are these as meant?",
        )
    return Alarm(
        "the strain (von Mises stress over Young's modulus) that 5 % of the body exceeds",
        float(von_mises_stress[k] / limit[k] * _STRAINED),
        _STRAINED,
        place,
        "is Young's modulus in the unit of the loads, and are these as meant?",
    )


def _in_space(solution: Solution, sigma: Floats, cells: Ints, bary: Floats) -> Floats:
    """Stress in space `(q, 3, 3)` of that in a body `(q, d, d)`."""
    if sigma.shape[-1] == 3:
        return sigma
    stress = np.zeros((len(sigma), 3, 3))
    stress[:, :2, :2] = sigma
    stress[:, 2, 2] = solution.problem.elasticity.stress_across(sigma, cells, bary)
    return stress


__all__ = ["Alarm", "alarms_of_solutions", "has_units", "millimetre", "report"]
