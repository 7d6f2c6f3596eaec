"""The values of a growth run: the load cycle, and one state of the cracks after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, coordinates
from xcrack.base.checks import entries, number, numbers, value_text, whole_number
from xcrack.base.errors import ProblemError
from xcrack.base.markup import element, join_parts, table
from xcrack.crack.crack import Crack
from xcrack.growth.trail import FrontTrail, Trail
from xcrack.linalg.engine import SolverState
from xcrack.model.loads import Load
from xcrack.sif.sif import SIF

# How far each tip of all cracks goes in one step.

LEAST = 0.1  # of a cell: a shorter new face turns the tip's frame, but not the crack the mesh sees

PerCrack = tuple[Floats, ...]  # one array (f,) a crack


@dataclass(frozen=True, eq=False)
class Advance:
    """What one step is to do.

    Attributes
    ----------
    da : tuple of (f,) arrays, length
        Advance of each tip, one array a crack.
    pending : tuple of (f,) arrays, length
        Growth that is too short to be modelled yet and waits for the next steps.
    largest : float, length
        Advance asked for at the fastest tip; 0 where nothing grows, or a rate is infinite.
    size : float, length
        Cell size at that tip.
    tip : (int, int)
        That tip: crack and number.
    falls_to_zero : bool
        Whether all growth is seen to stop within a tenth of that cell.
    cycles : float
        That it is seen to take; 0 where the integrator cannot tell.
    """

    da: PerCrack
    pending: PerCrack
    largest: float
    size: float
    tip: tuple[int, int]
    falls_to_zero: bool = False
    cycles: float = 0.0


def plan_advance(
    rate: PerCrack,
    dK_eq: PerCrack,
    pending: PerCrack,
    size: PerCrack,
    *,
    da: float | None,
    cycles: float | None,
    scaling: str,
    least: float = LEAST,
) -> Advance:
    """Share one step out over the tips.

    Parameters
    ----------
    rate, dK_eq, pending, size : tuple of (f,) arrays
        Growth a cycle, equivalent range, growth left over from earlier steps, cell size.
    da : float, length, or None
        Largest advance of any tip.
    cycles : float or None
        Cycles of the step; with `da` too, the smaller advance holds.
    scaling : {"law", "linear"}
        Advance of the other tips in proportion to the rate, or to dK_eq as in the source paper
        (which contradicts its own law, and does not converge to the right path).
    least : float
        Share of a cell below which an advance waits.

    Returns
    -------
    Advance
    """
    every_rate = np.concatenate(rate)
    fastest = float(every_rate.max(initial=0.0))
    if fastest == 0 or np.isinf(fastest):
        still = tuple(np.zeros_like(r) for r in rate)
        return Advance(still, pending, 0.0, np.inf, (0, 0))
    score = (
        rate if scaling == "law" else tuple(np.where(r > 0, k, 0.0) for r, k in zip(rate, dK_eq))
    )
    best = max(float(s.max(initial=0.0)) for s in score)
    crack = next(c for c, s in enumerate(score) if s.max(initial=0.0) == best)
    number = int(np.argmax(score[crack]))
    by_cycles = np.inf if cycles is None else cycles * fastest
    largest = float(min(np.inf if da is None else da, by_cycles))
    wanted = [p + largest * (s / best) for p, s in zip(pending, score)]
    go = [w >= least * h for w, h in zip(wanted, size)]
    return Advance(
        da=tuple(np.where(g, w, 0.0) for g, w in zip(go, wanted)),
        pending=tuple(np.where(g, 0.0, w) for g, w in zip(go, wanted)),
        largest=largest,
        size=float(size[crack][number]),
        tip=(crack, number),
    )


# A tip or a front that reaches the boundary of the body.


@dataclass(frozen=True)
class Arrival:
    """Where and when a tip, or a front, came to the boundary.

    Attributes
    ----------
    crack : int
    tip : int
        Number of the tip before the step; in 3D of the place along the front that came first, or
        last where the whole front has left the body.
    x : (d,) tuple, length
        Place on the boundary.
    name : str
        Smallest facet set there; "boundary" where none has a name.
    ligament : float, length
        From the last solved step to there, along a straight line.
    cycles : float
        Cycles until then: the ligament at rates that the last solves predict.
    """

    crack: int
    tip: int
    x: tuple[float, ...]
    name: str
    ligament: float
    cycles: float

    def __str__(self) -> str:
        return (
            f"crack {self.crack} reached {self.name!r} at {coordinates(self.x)}, "
            f"N = {self.cycles:.6g} (the last {self.ligament:.4g} at predicted rates)"
        )


@dataclass(frozen=True)
class Arriving:
    """An arrival during an advance that is not solved yet.

    Attributes
    ----------
    crack, tip, x, name, ligament
        As of `Arrival`.
    share : float
        Part of the advance until then; above 1 where the boundary is a little farther.
    """

    crack: int
    tip: int
    x: tuple[float, ...]
    name: str
    ligament: float
    share: float


# Where and when cracks join during growth.


@dataclass(frozen=True)
class Join:
    """Two cracks that became one, or a crack that runs into another one and ends there.

    Attributes
    ----------
    step : int
        Index of the first step in which they are joined.
    N : float
        Cycles at which they met.
    point : tuple of float, length
        Where they met first.
    cracks : (int, int)
        Their numbers in the step before, the smaller one first. Where two become one, that one has
        the smaller number, and the cracks behind the other move up by one.

    Raises
    ------
    ProblemError
        Parts that are not of these types.
    """

    step: int
    N: float
    point: tuple[float, ...]
    cracks: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "step", whole_number(self.step, "Join: step", least=0))
        object.__setattr__(self, "N", number(self.N, "Join: N", least=0))
        point = numbers(self.point, "Join: point", (None,))
        if len(point) not in (2, 3):
            raise ProblemError(f"Join: point = {value_text(self.point)}: give 2 or 3 coordinates.")
        object.__setattr__(self, "point", tuple(point.tolist()))
        pair = entries(self.cracks, "Join: cracks")
        if len(pair) != 2:
            raise ProblemError(
                f"Join: cracks = {value_text(self.cracks)}: give the numbers of two."
            )
        first, second = (whole_number(c, "Join: cracks", least=0) for c in pair)
        object.__setattr__(self, "cracks", (first, second))

    def __str__(self) -> str:
        first, second = self.cracks
        place = coordinates(self.point)
        return f"cracks {first} and {second} join at {place}, N = {self.N:.6g}"


def checked_joins(given: Sequence[Join], what: str) -> tuple[Join, ...]:
    """Joins as a tuple.

    Raises
    ------
    ProblemError
        One of them is no `Join`.
    """
    joins = entries(given, what)
    for join in joins:
        if not isinstance(join, Join):
            raise ProblemError(f"{what}: {value_text(join)} is none: give a tuple of Join.")
    return joins


def numbers_after(n: int, joins: Sequence[Join], left: int) -> list[int]:
    """Number that each of n cracks has after joins that leave `left` cracks.

    Joins in which both cracks stay, because one ends on the other, come first.
    """
    number = list(range(n))
    for join in joins[len(joins) - (n - left) :]:
        one, other = sorted(number[c] for c in join.cracks)
        number = [one if c == other else c - (c > other) for c in number]
    return number


@dataclass(frozen=True, eq=False)
class Cycle:
    """The load states of one cycle.

    Parameters
    ----------
    min, max : float, optional
        Two factors on all loads of the problem.
    states : sequence of load states, optional
        Any number of states instead: each a factor, or a list of loads.

    Raises
    ------
    ProblemError
        Neither or both are given, a factor is no finite number, or min > max.

    Examples
    --------
    >>> Cycle(0.1, 1.0).load_states
    (0.1, 1.0)
    """

    min: float | None = None
    max: float | None = None
    states: Sequence[Any] | None = None

    def __post_init__(self) -> None:
        if self.states is None:
            if self.min is None or self.max is None:
                raise ProblemError("Cycle: give min and max, or states=[...].")
            for name in ("min", "max"):
                factor = number(getattr(self, name), f"Cycle({name}=...)")
                object.__setattr__(self, name, factor)
            if not self.min <= self.max:
                raise ProblemError(f"Cycle({self.min}, {self.max}): give finite min <= max.")
            return
        if self.min is not None or self.max is not None:
            raise ProblemError("Cycle: give min and max, or states=[...], not both.")
        states = entries(self.states, "Cycle: states")
        if not states:
            raise ProblemError("Cycle(states=...) takes a list of at least one load state.")
        checked = (_load_state(state, f"Cycle: states[{k}]") for k, state in enumerate(states))
        object.__setattr__(self, "states", tuple(checked))

    @property
    def ratio(self) -> float | None:
        """Smallest over largest factor of the cycle, as it was asked for.

        None where that is no ratio of forces: a state that is a list of loads, or no factor > 0.
        """
        factors = [float(state) for state in self.load_states if isinstance(state, Real)]
        if len(factors) < len(self.load_states) or max(factors) <= 0:
            return None
        return min(factors) / max(factors)

    @property
    def load_states(self) -> tuple[Any, ...]:
        """The states as `solve` takes them."""
        return (self.min, self.max) if self.states is None else tuple(self.states)


def _load_state(state: Any, what: str) -> Any:
    """A load state, checked: a number, or a tuple of loads."""
    if isinstance(state, Real):
        return number(state, what)
    loads = entries(state, what)
    for load in loads:
        if not isinstance(load, Load):
            raise ProblemError(f"{what} has {value_text(load)}, which is not a load: see traction.")
    return state if isinstance(state, list | tuple) else loads


@dataclass(frozen=True, eq=False)
class Memory:
    """What a step leaves to the next one, beside what it reports.

    Attributes
    ----------
    law_rate : tuple of (f,) arrays, length/cycle
        Rates before the threshold is applied: the cycles of a step that ends below it are finite.
    length : tuple of float, length
        Length of each crack inside the body; in 3D its area over the length of its fronts.
    pending : tuple of (f,) arrays, length
        Growth too short to be modelled yet.
    radius : float, length, or None
        Enriched radius of the first step.
    reuse : SolverState
        What the next solve starts from, without matrices.
    settings : mapping of str to str
        What the run was asked to do.
    mesh : str
        Fingerprint of the mesh of a run with a tolerance; empty where none was asked for.
    meshes : int
        Number of meshes that the tolerance has made; 0 on the one as given.
    trail : Trail or FrontTrail, optional
        What an integrator of second order remembers of the last solves.
    """

    law_rate: PerCrack
    length: tuple[float, ...]
    pending: PerCrack
    radius: float | None
    reuse: SolverState
    settings: Mapping[str, str]
    trail: Trail | FrontTrail | None = None
    mesh: str = ""
    meshes: int = 0


@dataclass(frozen=True, eq=False)
class StepError:
    """What may be wrong with a step, by source; nan where it was not estimated.

    Attributes
    ----------
    place : tuple of (f,) arrays, length
        Of each tip, one array a crack: how far it may be from where steps of no length lead.
    cycles : float
        Error of the cycles so far by the length of the steps.
    K, contact : float
        Error of the cycles so far by the bars of K: without the part that contact has in them, and
        that part.
    unknown : float
        Cycles so far that passed at rates of which K has no bar.
    K_place : float, length
        How far a tip may be astray by the directions that K within its bars allows.
    grown : float, length
        Way of the fastest tips so far, which an error of the path is relative to.
    rate, rate_contact : float
        Relative error of the largest rate at this step by the bars of K, and contact's part of it.
    turn : float, rad
        Error of the directions at this step.
    behind : float
        Relative error of K by the lengths of cracks whose tips do not drive: how far these are
        ahead of or behind where they should be is known to the length of the steps only.
    """

    place: PerCrack
    cycles: float
    K: float = np.nan
    contact: float = np.nan
    unknown: float = np.nan
    K_place: float = np.nan
    grown: float = np.nan
    rate: float = np.nan
    rate_contact: float = np.nan
    turn: float = np.nan
    behind: float = 0.0

    @property
    def life(self) -> float:
        """Error of the cycles so far by all sources."""
        return self.cycles + self.K + self.contact + self.unknown

    @property
    def path(self) -> float:
        """Error of the places by all sources, length."""
        steps = max((float(part.max(initial=0.0)) for part in self.place), default=0.0)
        return steps + self.K_place


@dataclass(frozen=True, eq=False)
class Step:
    """One state of the cracks during growth.

    Attributes
    ----------
    index : int
        0 for the cracks as they were given.
    cycles : float
        Cycles until the cracks look like `corrected`.
    cracks : tuple of Crack
        As they were solved: K, angle, rates and the solutions belong to these.
    sif : tuple of tuple of SIF
        ``sif[state][crack]``; states in the order of `Cycle.load_states`: the minimum of a
        ``Cycle(min, max)`` first, then its maximum.
    angle, dK_eq, R, rate, da : tuple of (f,) arrays
        One array a crack: kink angle (rad), equivalent range (stress √length), ratio, growth a
        cycle (length/cycle; 0 below the threshold, inf where the law says that the toughness is
        reached), and the advance from here to the next step (length; 0 for a tip whose growth is
        still shorter than a tenth of a cell: it waits).
    solutions : tuple of Solution
        One for each load state; empty in a step that was read from disk.
    memory : Memory, optional
        What the next step needs.
    levels : tuple of float
        Factors of the load states of a spectrum of factors, in the order of `sif`.
    corrected : tuple of Crack
        Where growth has come to, and goes on: with ``integrator="pec"`` the last points are moved
        once K at the predicted ones is known. `cracks`, where it is left out.
    error : StepError, optional
        Estimate, where the integrator has one.
    warnings : tuple of str, optional
        Messages of the warnings that its computation gave; None: not known.
    arrivals : tuple of Arrival
        Tips and fronts that came to the boundary since the step before. Where no tip is left, the
        step is the last one: it ends there, and has no K.
    joins : tuple of Join
        Cracks that became one since the step before.

    Raises
    ------
    ProblemError
        Parts that are not of these types, or do not fit each other.
    """

    index: int
    cycles: float
    cracks: tuple[Crack, ...]
    sif: tuple[tuple[SIF, ...], ...]
    angle: PerCrack
    dK_eq: PerCrack
    R: PerCrack
    rate: PerCrack
    da: PerCrack
    solutions: tuple[Solution, ...] = ()
    memory: Memory | None = None
    levels: tuple[float, ...] = ()
    corrected: tuple[Crack, ...] = ()
    error: StepError | None = None
    warnings: tuple[str, ...] | None = None
    arrivals: tuple[Arrival, ...] = ()
    joins: tuple[Join, ...] = ()

    def __post_init__(self) -> None:
        whole_number(self.index, "Step: index", least=0)
        number(self.cycles, "Step: cycles", least=0)
        if not all(isinstance(crack, Crack) for crack in entries(self.cracks, "Step: cracks")):
            raise ProblemError(f"Step: cracks = {value_text(self.cracks)}: give a tuple of Crack.")
        moved = entries(self.corrected, "Step: corrected") or entries(self.cracks, "Step: cracks")
        if not all(isinstance(crack, Crack) for crack in moved) or len(moved) != len(self.cracks):
            raise ProblemError(
                f"Step: corrected = {value_text(self.corrected)}: give a Crack for each of "
                f"`cracks`."
            )
        object.__setattr__(self, "corrected", moved)
        for solution in entries(self.solutions, "Step: solutions"):
            if not isinstance(solution, Solution):
                raise ProblemError(
                    f"Step: solutions: {value_text(solution)} is none: give what solve returns."
                )
        numbers(self.levels, "Step: levels", (None,))
        for arrival in entries(self.arrivals, "Step: arrivals"):
            if not isinstance(arrival, Arrival):
                raise ProblemError(
                    f"Step: arrivals: {value_text(arrival)} is no Arrival: leave them out, grow "
                    f"makes them."
                )
        object.__setattr__(self, "joins", checked_joins(self.joins, "Step: joins"))
        if not isinstance(self.error, StepError | None):
            raise ProblemError(
                f"Step: error = {value_text(self.error)}: that is made by grow: leave it out."
            )
        if self.warnings is not None:
            messages = entries(self.warnings, "Step: warnings")
            if not all(isinstance(message, str) for message in messages):
                raise ProblemError(f"Step: warnings = {value_text(self.warnings)}: give texts.")
            object.__setattr__(self, "warnings", messages)
        states = [entries(state, "Step: sif") for state in entries(self.sif, "Step: sif")]
        if not all(isinstance(sif, SIF) for state in states for sif in state):
            raise ProblemError(
                f"Step: sif = {value_text(self.sif)}: give SIF of states and cracks."
            )
        counts = [[len(sif.x) for sif in state] for state in states]
        for name in ("angle", "dK_eq", "R", "rate", "da"):
            parts = entries(getattr(self, name), f"Step: {name}")
            shapes = [numbers(part, f"Step: {name}", (None,), finite=False).shape for part in parts]
            counts.append([shape[0] for shape in shapes])
        n = len(self.cracks)
        if any(count != counts[0] for count in counts) or len(counts[0]) not in (0, n):
            raise ProblemError(
                f"Step: K, angle, dK_eq, R, rate and da have {counts} values for {n} cracks: give "
                "one for each tip, or place along a front, of each crack."
            )
        if not isinstance(self.memory, Memory | None):
            raise ProblemError(
                f"Step: memory = {value_text(self.memory)}: that is made by grow: leave it out."
            )

    def _repr_html_(self) -> str:
        parts = zip(self.angle, self.dK_eq, self.R, self.rate, self.da, strict=True)
        rows = [
            (c, j, *values)
            for c, arrays in enumerate(parts)
            for j, values in enumerate(zip(*(a.tolist() for a in arrays), strict=True))
        ]
        head = ("crack", "place", "angle", "ΔK_eq", "R", "da/dN", "da")
        title = element("b", f"Step {self.index}, N = {self.cycles:.6g}")
        return join_parts(title, table(head, rows, scroll=len(rows) > 12))

    @property
    def N(self) -> float:  # noqa: N802 - the name of the field
        """Cycles, as in tables and pictures."""
        return self.cycles

    @property
    def n_tips(self) -> int:
        """Number of tips of all cracks."""
        return sum(len(a) for a in self.angle)

    @property
    def has_left(self) -> bool:
        """Whether all tips have left the body: the last step of a run, which has no K."""
        return self.index > 0 and not self.n_tips


def memory_of(step: Step) -> Memory:
    """What a step left to the next one."""
    if step.memory is None:
        raise ProblemError(f"step {step.index} carries no memory: it was not made by grow.")
    return step.memory


def directions(step: Step, c: int) -> Floats:
    """Unit vectors `(f, d)` along which the places of crack c advance."""
    frame, beta = step.sif[0][c].frame, step.angle[c][:, None]
    return np.asarray(np.cos(beta) * frame[:, 0] + np.sin(beta) * frame[:, 1])


def moved_places(step: Step, c: int) -> Floats:
    """Where the tips, or the places along fronts, of crack c have come to `(f, d)`."""
    return np.asarray(step.sif[0][c].x + step.da[c][:, None] * directions(step, c))


# What cracks have become that met during an advance.


@dataclass(frozen=True, eq=False)
class Joined:
    """Cracks after an advance in which some of them have joined.

    Attributes
    ----------
    cracks : tuple of Crack
        Those that are left, not placed again.
    apart : tuple of Crack
        The same before they joined.
    joins : tuple of Join
    way : float
        Share of the whole advance that they have come.
    cycles : float
        Of the advance.
    error : float
        Estimated error of these.
    """

    cracks: tuple[Crack, ...]
    apart: tuple[Crack, ...]
    joins: tuple[Join, ...]
    way: float
    cycles: float
    error: float


# Which cracks of the steps of a run are one crack, over the joins between them.


def lineage(steps: Sequence[Step], crack: int) -> list[list[int]]:
    """Numbers in each step of a crack, and of all cracks that it joins in the end.

    Parameters
    ----------
    steps : sequence of Step
    crack : int
        Number in the first step.

    Returns
    -------
    list of list of int
    """
    number = [
        numbers_after(len(one.cracks), other.joins, len(other.cracks))
        for one, other in zip(steps, steps[1:])
    ]
    last = crack
    for after in number:
        last = after[last]
    rows = [[last]]
    for after in reversed(number):
        rows.append([c for c, now in enumerate(after) if now in rows[-1]])
    return rows[::-1]


def identities(steps: Sequence[Step]) -> list[list[int]]:
    """For each crack of each step, its number in the first step: of joined cracks the smallest."""
    result = [list(range(len(steps[0].cracks)))] if steps else []
    for one, other in zip(steps, steps[1:]):
        number = numbers_after(len(one.cracks), other.joins, len(other.cracks))
        result.append([
            min(name for name, now in zip(result[-1], number, strict=True) if now == c)
            for c in range(len(other.cracks))
        ])  # fmt: skip
    return result


def tip_identities(steps: Sequence[Step]) -> list[list[list[int]]]:
    """For each tip of each crack of each step in 2D, its number among all tips of the first step.

    A tip is the one that was to advance to where it is: numbers of tips change where cracks join
    and where a tip leaves the body.
    """
    result: list[list[list[int]]] = []
    known: list[int] = []
    places = np.zeros((0, 2))
    for step in steps:
        x = [tips.x for tips in step.sif[0]] if step.sif else []
        flat = np.concatenate([np.zeros((0, 2)), *x])
        if not result:
            names = list(range(len(flat)))
        else:
            names = [-1] * len(flat)
            distance = np.linalg.norm(flat[:, None] - places, axis=2)
            for _ in range(min(distance.shape)):
                i, k = np.unravel_index(np.argmin(distance), distance.shape)
                names[int(i)] = known[int(k)]
                distance[i], distance[:, k] = np.inf, np.inf
        known = names
        ahead = [moved_places(step, c) for c in range(len(x))]
        places = np.concatenate([np.zeros((0, 2)), *ahead])
        ends = np.cumsum([len(each) for each in x]).tolist()
        result.append([names[end - len(each) : end] for end, each in zip(ends, x, strict=True)])
    return result


__all__ = [
    "LEAST",
    "Advance",
    "Arrival",
    "Arriving",
    "Cycle",
    "Join",
    "Joined",
    "Memory",
    "PerCrack",
    "Step",
    "StepError",
    "checked_joins",
    "directions",
    "identities",
    "lineage",
    "memory_of",
    "moved_places",
    "numbers_after",
    "plan_advance",
    "tip_identities",
]
