"""The values of a growth run: cracks after cracks, and the plan between them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, coordinates
from xcrack.base.checks import entries, number, numbers, value_text, whole_number
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.base.markup import element, join_parts, table
from xcrack.crack.crack import Crack
from xcrack.crack.meetings import LEAST
from xcrack.fatigue.criteria import clipped_K, local_equivalent_K
from xcrack.fatigue.retardation import OverloadZones
from xcrack.growth.solves import SolveHistory
from xcrack.growth.stations import CellSizes, GrowthStations, Identities, PerCrack, directions
from xcrack.growth.validity import Validity
from xcrack.linalg.engine import SolverState
from xcrack.sif.sif import SIF

# What happens between two steps.


class Event:
    """Something that happened between two steps: it has a place, cycles N, and a text."""


@dataclass(frozen=True)
class Arrival(Event):
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
    end : int
        Identity of the tip or front; -1 where it is not known.
    label : str
        What that is called.
    """

    crack: int
    tip: int
    x: tuple[float, ...]
    name: str
    ligament: float
    cycles: float
    end: int = -1
    label: str = ""

    @property
    def N(self) -> float:  # noqa: N802 - the name of the field
        """Cycles, as of other events."""
        return self.cycles

    def __str__(self) -> str:
        return (
            f"{self.label or f'crack {self.crack}'} reached {self.name!r} at "
            f"{coordinates(self.x)}, "
            f"N = {self.cycles:.6g} (the last {self.ligament:.4g} at predicted rates)"
        )


@dataclass(frozen=True)
class Join(Event):
    """Two cracks that became one, or a crack that runs into another one and ends there.

    Or fronts of one crack that meet, behind a hole or around a ligament: both numbers are its own.

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
        first_crack, second_crack = (whole_number(c, "Join: cracks", least=0) for c in pair)
        object.__setattr__(self, "cracks", (first_crack, second_crack))

    def __str__(self) -> str:
        first_crack, second_crack = self.cracks
        place = coordinates(self.point)
        if first_crack == second_crack:
            return f"the ligament inside crack {first_crack} breaks at {place}, N = {self.N:.6g}"
        return f"cracks {first_crack} and {second_crack} join at {place}, N = {self.N:.6g}"


def checked_joins(value: Sequence[Join], label: str) -> tuple[Join, ...]:
    """Joins as a tuple.

    Raises
    ------
    ProblemError
        One of them is no `Join`.
    """
    join_entries = entries(value, label)
    for join in join_entries:
        if not isinstance(join, Join):
            raise ProblemError(f"{label}: {value_text(join)} is none: give a tuple of Join.")
    return join_entries


def numbers_after(n: int, joins_of_step: Sequence[Join], n_left: int) -> list[int]:
    """Number that each of n cracks has after joins that leave `n_left` cracks.

    Joins in which both cracks stay, because one ends on the other, come first.
    """
    number = list(range(n))
    for join in joins_of_step[len(joins_of_step) - (n - n_left) :]:
        first_number, second_number = sorted(number[c] for c in join.cracks)
        number = [first_number if c == second_number else c - (c > second_number) for c in number]
    return number


# The next step, and what a run carries along.


@dataclass(frozen=True, eq=False)
class Plan:
    """What comes after a step, as its last solves see it; n stations as of the step.

    Attributes
    ----------
    sigma : float, length
        Where it begins, from where the history of the solves does.
    length : float, length
        Of σ: largest advance of any end.
    cycles : float
        That it takes.
    arc : (n,) array, length
        How far each station comes.
    move : (n, d) array, length
        From where to where each comes.
    moves : (n,) array of bool
        Stations that move in the mesh; the others wait.
    cell : (n,) array, length
        Size of the cells at the stations.
    tip : int
        Row of the station that drives.
    largest : float, length
        Advance asked for there; 0 where nothing can grow.
    cracks : tuple of Crack
        As they will be: those that meet are joined.
    apart : tuple of Crack
        The same before they join; none where none do.
    part : float
        Of the advance that is made: fronts that meet end it.
    error : float
        Estimated error of the cycles, where they follow from a gap that closes.
    joins : tuple of Join
    limit : str
        Why it cannot be taken: "arrest", "short" or "geometry"; empty where it can.
    refusal : str
        The same in words.
    """

    sigma: float
    length: float
    cycles: float
    arc: Floats
    move: Floats
    moves: Bools
    cell: Floats
    tip: int
    largest: float
    cracks: tuple[Crack, ...]
    apart: tuple[Crack, ...] = ()
    part: float = 1.0
    error: float = 0.0
    joins: tuple[Join, ...] = ()
    limit: str = ""
    refusal: str = ""

    @property
    def end(self) -> float:
        """σ at its end, length."""
        return self.sigma + self.length

    @classmethod
    def at_rest(cls, step: "Step", cell: Floats) -> "Plan":
        """Nothing advances; its stations are in cells of such sizes `(n,)`."""
        (stations, solves), no_advance = solves_of(step), np.zeros(len(cell))
        move = 0 * stations.x
        return cls(
            solves.start, 0.0, 0.0, no_advance, move, no_advance > 0, cell, 0, 0.0, step.corrected
        )

    def with_cracks(self, advance: Callable[[], Sequence[Crack]]) -> "Plan":
        """With the cracks that it leads to, or with its limit where it cannot be taken."""
        if self.largest < LEAST * self.cell[self.tip]:
            return replace(self, limit="short")
        try:
            return replace(self, cracks=tuple(advance()))
        except GeometryError as error:
            return replace(self, limit="geometry", refusal=str(error))


@dataclass(frozen=True, eq=False)
class StepControl:
    """How long the next step may be.

    Attributes
    ----------
    length : float, length
        Largest advance of any tip; inf where no tolerance was asked for.
    error : float or None
        `step_error` of the last step; None where there is none, as before the first.
    least : float, length
        Shortest step that the cells at the fastest tip allow.
    """

    length: float = np.inf
    error: float | None = None
    least: float = 0.0

    @property
    def can_shorten(self) -> bool:
        """Whether the cells leave room for a shorter step."""
        return self.length > 1.001 * self.least


@dataclass(frozen=True, eq=False)
class RunState:
    """What a run carries along from step to step, beside its cracks and rates.

    Attributes
    ----------
    settings : mapping of str to str
        What the run was asked to do.
    reuse : SolverState
        What the next solve starts from, without matrices.
    radius : float, length, or None
        Enriched radius of the first step.
    cells : CellSizes, optional
        Of the mesh of a run with a tolerance; None where it is the one that the run begins with.
    meshes : int
        How often a tolerance has asked for smaller cells.
    cut : bool
        The step is shorter than planned, as the run ends at it: where it goes on after all, with
        other limits, the step is computed again.
    """

    settings: Mapping[str, str]
    reuse: SolverState
    radius: float | None = None
    cells: CellSizes | None = None
    meshes: int = 0
    cut: bool = False


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
    newest_place : tuple of (f,) arrays, length
        Part of `place` by the last step alone, which the next solve tells better; empty where it
        does not.
    newest_cycles : float
        Likewise of `cycles`.
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
    newest_place: PerCrack = ()
    newest_cycles: float = 0.0

    @property
    def life(self) -> float:
        """Error of the cycles so far by all sources."""
        return self.cycles + self.K + self.contact + self.unknown

    @property
    def path(self) -> float:
        """Error of the places by all sources, length."""
        steps = max((float(part.max(initial=0.0)) for part in self.place), default=0.0)
        return steps + self.K_place

    @property
    def path_but_newest(self) -> float:
        """Error of the places but for what the next solve tells better, length."""
        newest_places = self.newest_place or tuple(np.zeros_like(part) for part in self.place)
        parts = zip(self.place, newest_places, strict=True)
        return max((float((a - b).max(initial=0.0)) for a, b in parts), default=0.0) + self.K_place


_MADE_BY_GROW = {
    "error": StepError,
    "identities": Identities,
    "stations": GrowthStations,
    "solves": SolveHistory,
    "zones": OverloadZones,
    "earlier_zones": OverloadZones,
    "control": StepControl,
    "plan": Plan,
    "run": RunState,
    "validity": Validity,
}


@dataclass(frozen=True, eq=False)
class Corrected:
    """Where growth has come to at a solve, and what the next step goes on from.

    Attributes
    ----------
    cycles : float
        Until the corrected cracks are reached.
    cracks : tuple of Crack
        From which growth goes on.
    stations : GrowthStations
        Their ends.
    solves : SolveHistory
        At these.
    error : StepError, optional
    control : StepControl
    zones, earlier_zones : OverloadZones, optional
        What overloads have left at the stations, and at the begin of the step.
    """

    cycles: float
    cracks: tuple[Crack, ...]
    stations: GrowthStations
    solves: SolveHistory
    error: StepError | None = None
    control: StepControl = field(default_factory=StepControl)
    zones: OverloadZones | None = None
    earlier_zones: OverloadZones | None = None


@dataclass(frozen=True, eq=False, repr=False)
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
        ``sif[state][crack]``; states in the order of `states`: the minimum of a
        ``Cycle(min, max)`` first, then its maximum.
    angle, dK_eq, R, rate, da : tuple of (f,) arrays
        One array a crack: kink angle (rad), equivalent range (stress √length), ratio, growth a
        cycle (length/cycle; 0 below the threshold, inf where the law says that the toughness is
        reached), and the advance from here to the next step (length; 0 for a tip whose growth is
        still shorter than a tenth of a cell: it waits).
    solutions : tuple of Solution
        One for each load state; empty in a step that was read from disk.
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
    states : tuple of str
        Names of the load states, in the order of `sif`: those of a ``Cycle(min, max)``, and the
        lowest and highest level of a spectrum, are "min" and "max".
    law_rate : tuple of (f,) arrays, length/cycle
        Rates before the threshold is applied: the cycles of a step that ends below it are finite.
        `rate`, where it is left out.
    R_range : tuple of (f, 2) arrays
        Smallest and largest ratio of all cycles of a block; of one cycle both are R.
    sizes : tuple of float, length
        Length of each crack inside the body; in 3D its area over the length of its fronts.
    load_factor : float
        On all loads beside those of `states`, where they change as the crack grows; K has it.
    identities : Identities, optional
        Which tips, fronts and cracks of other steps these are.
    stations : GrowthStations, optional
        The ends of `corrected`, from which growth goes on.
    solves : SolveHistory, optional
        What the last solves say at these.
    zones, earlier_zones : OverloadZones, optional
        What overloads have left there, and where the last step began.
    control : StepControl
        How long the next step may be.
    plan : Plan, optional
        The next step; none where the run ends.
    run : RunState, optional
        What the run carries along.
    validity : Validity, optional
        How far linear elasticity holds, where the material has a yield stress or a toughness.

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
    levels: tuple[float, ...] = ()
    corrected: tuple[Crack, ...] = ()
    error: StepError | None = None
    warnings: tuple[str, ...] | None = None
    arrivals: tuple[Arrival, ...] = ()
    joins: tuple[Join, ...] = ()
    states: tuple[str, ...] = ()
    law_rate: PerCrack = ()
    R_range: PerCrack = ()
    sizes: tuple[float, ...] = ()
    load_factor: float = 1.0
    identities: Identities | None = None
    stations: GrowthStations | None = None
    solves: SolveHistory | None = None
    zones: OverloadZones | None = None
    earlier_zones: OverloadZones | None = None
    control: StepControl = field(default_factory=StepControl)
    plan: Plan | None = None
    run: RunState | None = None
    validity: Validity | None = None

    def __post_init__(self) -> None:
        whole_number(self.index, "Step: index", least=0)
        number(self.cycles, "Step: cycles", least=0)
        if not all(isinstance(crack, Crack) for crack in entries(self.cracks, "Step: cracks")):
            raise ProblemError(f"Step: cracks = {value_text(self.cracks)}: give a tuple of Crack.")
        moved_cracks = entries(self.corrected, "Step: corrected") or entries(
            self.cracks, "Step: cracks"
        )
        if not all(isinstance(crack, Crack) for crack in moved_cracks) or len(moved_cracks) != len(
            self.cracks
        ):
            raise ProblemError(
                f"Step: corrected = {value_text(self.corrected)}: give a Crack for each of "
                f"`cracks`."
            )
        object.__setattr__(self, "corrected", moved_cracks)
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
        if self.warnings is not None:
            messages = entries(self.warnings, "Step: warnings")
            if not all(isinstance(message, str) for message in messages):
                raise ProblemError(f"Step: warnings = {value_text(self.warnings)}: give texts.")
            object.__setattr__(self, "warnings", messages)
        states = [entries(state, "Step: sif") for state in entries(self.sif, "Step: sif")]
        if not states or not all(isinstance(sif, SIF) for state in states for sif in state):
            raise ProblemError(
                f"Step: sif = {value_text(self.sif)}: give SIF of states and cracks."
            )
        counts = [[len(sif.x) for sif in state] for state in states]
        for name in ("angle", "dK_eq", "R", "rate", "da"):
            parts = entries(getattr(self, name), f"Step: {name}")
            shapes = [
                numbers(part, f"Step: {name}", (None,), must_be_finite=False).shape
                for part in parts
            ]
            counts.append([shape[0] for shape in shapes])
        n = len(self.cracks)
        if any(count != counts[0] for count in counts) or len(counts[0]) not in (0, n):
            raise ProblemError(
                f"Step: K, angle, dK_eq, R, rate and da have {counts} values for {n} cracks: give "
                "one for each tip, or place along a front, of each crack."
            )
        self._check_parts_of_grow(counts[0])

    def _check_parts_of_grow(self, counts: Sequence[int | None]) -> None:
        """What `grow` adds to a step, and nobody else has to give."""
        names = entries(self.states, "Step: states") or tuple(map(str, range(len(self.sif))))
        if len(names) != len(self.sif) or not all(isinstance(name, str) for name in names):
            raise ProblemError(
                f"Step: states = {value_text(self.states)}: give a name for each row of sif."
            )
        object.__setattr__(self, "states", names)
        numbers(self.sizes, "Step: sizes", (None,))
        number(self.load_factor, "Step: load_factor", above=0)
        left_out = {"law_rate": self.rate, "R_range": [np.stack([R, R], axis=-1) for R in self.R]}
        for name, columns in (("law_rate", ()), ("R_range", (2,))):
            parts = entries(getattr(self, name), f"Step: {name}") or tuple(left_out[name])
            object.__setattr__(self, name, parts)
            rows = counts if len(parts) == len(counts) else [None] * len(parts)
            for part, n in zip(parts, rows, strict=True):
                numbers(part, f"Step: {name}", (n, *columns), must_be_finite=False)
        for name, kind in _MADE_BY_GROW.items():
            value = getattr(self, name)
            if not (isinstance(value, kind) or (value is None and name != "control")):
                raise ProblemError(
                    f"Step: {name} = {value_text(value)}: that is made by grow: leave it out."
                )

    def __repr__(self) -> str:
        K_I = np.array([k for part in self.sif[-1:] for sif in part for k in sif.K[:, 0]])
        values = f", K_I {K_I.min():.6g} to {K_I.max():.6g}" if len(K_I) else ""
        return f"Step({self.index}, N = {self.cycles:.6g}, {len(self.cracks)} crack(s){values})"

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

    @property
    def counts(self) -> list[int]:
        """Number of stations of each crack at which K was solved."""
        return [len(a) for a in self.angle]

    def end_name(self, crack: int, number: int) -> str:
        """Name of a tip, in 3D of a front, by its numbers in this step: "left tip of crack 2".

        Raises
        ------
        ProblemError
            There is none of these numbers.
        """
        crack = whole_number(crack, "end_name: crack", least=0, most=len(self.cracks) - 1)
        last_number = self.cracks[crack].n_tips - 1
        if last_number < 0:
            raise ProblemError(f"end_name: crack {crack} has no end left in step {self.index}.")
        number = whole_number(number, "end_name: number", least=0, most=last_number)
        if self.identities is None:
            word = "tip" if self.cracks[crack].fronts is None else "front"
            return f"{word} {number} of crack {crack}"
        return self.identities.name_of(crack, number)


def largest_K_eq(step: Step, crack: int, nu: float | Floats) -> Floats:
    """Largest K_eq of all states at the stations of a crack `(f,)`."""
    K = clipped_K(np.stack([state[crack].K for state in step.sif]))
    return local_equivalent_K(K, step.angle[crack], nu).max(axis=0, initial=0.0)


def run_state(step: Step) -> RunState:
    """What a run has carried along to a step."""
    if step.run is None:
        raise _not_made_by_grow(step)
    return step.run


def solves_of(step: Step) -> tuple[GrowthStations, SolveHistory]:
    """The stations from which growth goes on, and what the last solves say there."""
    if step.stations is None or step.solves is None:
        raise _not_made_by_grow(step)
    return step.stations, step.solves


def plan_of(step: Step) -> Plan:
    """The plan of what comes after a step."""
    if step.plan is None:
        raise _not_made_by_grow(step)
    return step.plan


def _not_made_by_grow(step: Step) -> ProblemError:
    return ProblemError(f"step {step.index} was not made by grow: nothing goes on from it.")


def growth_directions(step: Step, c: int) -> Floats:
    """Unit vectors `(f, d)` along which the stations of crack c advance."""
    return directions(step.sif[0][c].frame, step.angle[c])


def moved_places(step: Step, c: int) -> Floats:
    """Where the tips, or the stations along fronts, of crack c have come to `(f, d)`."""
    return np.asarray(step.sif[0][c].x + step.da[c][:, None] * growth_directions(step, c))


def place_name(step: Step, c: int, j: int) -> str:
    """Name of a tip, or of a place along a front, of crack c in a message."""
    words = "tip" if step.cracks[c].fronts is None else "front place"
    return f"crack {c}, {words} {j} at {coordinates(step.sif[0][c].x[j])}"


__all__ = [
    "Arrival",
    "Corrected",
    "Event",
    "Join",
    "Plan",
    "RunState",
    "Step",
    "StepControl",
    "StepError",
    "checked_joins",
    "growth_directions",
    "largest_K_eq",
    "moved_places",
    "numbers_after",
    "place_name",
    "plan_of",
    "run_state",
    "solves_of",
]
