"""The values of a growth run: the load cycle, and one state of the cracks after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.growth.steps.advance import PerCrack
from xcrack.growth.steps.arrival import Arrival
from xcrack.growth.steps.front_trail import FrontTrail
from xcrack.growth.steps.joins import Join, checked_joins
from xcrack.growth.steps.trail import Trail
from xcrack.inputs import entries, number, numbers, shown, whole
from xcrack.markup import element, joined, table
from xcrack.scene.conditions import Load
from xcrack.sif.sif import SIF
from xcrack.solvers.reuse import Reuse


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
            raise ProblemError(f"{what} has {shown(load)}, which is not a load: see traction.")
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
    reuse : Reuse
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
    reuse: Reuse
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
        ``sif[state][crack]``.
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
        whole(self.index, "Step: index", least=0)
        number(self.cycles, "Step: cycles", least=0)
        if not all(isinstance(crack, Crack) for crack in entries(self.cracks, "Step: cracks")):
            raise ProblemError(f"Step: cracks = {shown(self.cracks)}: give a tuple of Crack.")
        moved = entries(self.corrected, "Step: corrected") or entries(self.cracks, "Step: cracks")
        if not all(isinstance(crack, Crack) for crack in moved) or len(moved) != len(self.cracks):
            raise ProblemError(
                f"Step: corrected = {shown(self.corrected)}: give a Crack for each of `cracks`."
            )
        object.__setattr__(self, "corrected", moved)
        for solution in entries(self.solutions, "Step: solutions"):
            if not isinstance(solution, Solution):
                raise ProblemError(
                    f"Step: solutions: {shown(solution)} is none: give what solve returns."
                )
        numbers(self.levels, "Step: levels", (None,))
        for arrival in entries(self.arrivals, "Step: arrivals"):
            if not isinstance(arrival, Arrival):
                raise ProblemError(
                    f"Step: arrivals: {shown(arrival)} is no Arrival: leave them out, grow makes "
                    "them."
                )
        object.__setattr__(self, "joins", checked_joins(self.joins, "Step: joins"))
        if not isinstance(self.error, StepError | None):
            raise ProblemError(
                f"Step: error = {shown(self.error)}: that is made by grow: leave it out."
            )
        if self.warnings is not None:
            messages = entries(self.warnings, "Step: warnings")
            if not all(isinstance(message, str) for message in messages):
                raise ProblemError(f"Step: warnings = {shown(self.warnings)}: give texts.")
            object.__setattr__(self, "warnings", messages)
        states = [entries(state, "Step: sif") for state in entries(self.sif, "Step: sif")]
        if not all(isinstance(sif, SIF) for state in states for sif in state):
            raise ProblemError(f"Step: sif = {shown(self.sif)}: give SIF of states and cracks.")
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
                f"Step: memory = {shown(self.memory)}: that is made by grow: leave it out."
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
        return joined(title, table(head, rows, scroll=len(rows) > 12))

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


__all__ = [
    "Cycle",
    "Memory",
    "Step",
    "StepError",
    "directions",
    "memory_of",
    "moved_places",
]
