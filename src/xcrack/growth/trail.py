"""What earlier solves leave to the growth of second order, and values between and beyond them."""

from dataclasses import dataclass, field, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.law import Law
from xcrack.fatigue.retardation import (
    BlockCycles,
    CycleIntegration,
    OverloadZones,
    Retardation,
    willenborg,
)
from xcrack.fatigue.spectrum import Spectrum

# Which settings retardation goes with.


def check_retardation(model: object, law: Law, cycle: object, integrator: str) -> None:
    """Refuse a model of retardation with what it means nothing with."""
    if model is None:
        return
    if not isinstance(model, Retardation):
        raise ProblemError(f"grow: retardation = {value_text(model)}: give wheeler or willenborg.")
    if not isinstance(cycle, Spectrum) or cycle.factors is None:
        raise ProblemError(
            "grow: retardation needs cycles in time: give Spectrum(factors). One Cycle has no "
            "overload, counted rows no order, and states are counted at each tip on its own."
        )
    if integrator != "pec":
        raise ProblemError('grow: retardation goes with integrator="pec" only.')
    if getattr(law, "ratio", None) == "nominal":
        raise ProblemError(
            'grow: the law has ratio="nominal", but plastic zones belong to K with contact: with '
            'retardation give a law with ratio="contact".'
        )
    if isinstance(model, willenborg) and getattr(law, "closure", None) is not None:
        raise ProblemError(
            "grow: the law has a closure, and willenborg lowers K as well: both stand for the same "
            "plastic wake, which would count twice. Give a law without closure, or wheeler."
        )


# How long the next step may be for a wanted error of path and life.

_LEAST = 1e-3  # a step without any correction does not ask for an endless next one
_SAFE = 0.95
_NOW, _BEFORE = 0.35, 0.15  # exponents of the last error and of the one before
_BEGIN = 2.0  # of the crack, times the root of the tolerance: the first step
_FIRST = 0.5  # exponent after the first step, whose predictor is of first order
_CHANGE, _FIRST_CHANGE = (0.4, 1.6), (0.5, 1.6)
# Cells of the shortest step: straight on, and more behind a right-angled kink, where K on a shorter
# face is that of a kink between two cells.
_STRAIGHT, _KINKED = 0.12, 1.6
_PAST = 0.05  # of the cycles so far: a step of fewer cycles may err by a share of this many
_AHEAD = 0.5  # of the way to the boundary ahead: the longest step
REJECTED = 2.0  # errors from which on a step is done again with a shorter one


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


def shortest(cell: float, turn: float) -> float:
    """Shortest step in cells of some size, behind a kink of some angle (rad)."""
    return (_STRAIGHT + _KINKED * float(np.sin(min(abs(turn), np.pi / 2))) ** 2) * cell


def step_error(
    off: float, length: float, off_cycles: float, cycles: float, before: float, tolerance: float
) -> float:
    """Error of a step in units of the tolerance, at least a thousandth.

    Parameters
    ----------
    off : float, length
        Largest estimated error of a tip.
    length : float, length
        Of the step.
    off_cycles, cycles : float
        Estimated error of the cycles of the step, and these.
    before : float
        Cycles before the step.
    tolerance : float
        Of the path, relative to the length grown, and of the life.
    """
    path = off / (length * tolerance)
    whole = max(cycles, _PAST * before)
    life = off_cycles / (whole * tolerance) if whole > 0 else 0.0
    return float(max(path, life, _LEAST))


def first_length(size: float, tolerance: float, least: float) -> float:
    """Length of the first step for a crack of some size, and no less than the least."""
    return float(max(_BEGIN * size * np.sqrt(tolerance), least))


def next_length(length: float, error: float, before: float | None, least: float) -> float:
    """Length of the next step.

    Parameters
    ----------
    length : float, length
        Of the last step.
    error : float
        `step_error` of it.
    before : float or None
        That of the step before; None after the first step, and to do a step again.
    least : float, length

    Returns
    -------
    float, length

    Notes
    -----
    Proportional and integral control (Gustafsson 1991) for a rule of second order.
    """
    if before is None:
        factor = np.clip(_SAFE * error**-_FIRST, *_FIRST_CHANGE)
    else:
        factor = np.clip(_SAFE * error**-_NOW * before**_BEFORE, *_CHANGE)
    return float(max(length * factor, least))


def within(length: float, room: float, least: float) -> float:
    """A length that leaves half of the way to the boundary ahead, but the least at least."""
    return float(max(min(length, _AHEAD * room), least))


KEPT = 3  # solves: a parabola passes through three points

_TINY = 1e-3  # of the largest rate: the logarithm of a smaller one says nothing between two solves
_LEAST_SCALE = 1e-300  # below every rate: keeps logarithms finite


@dataclass(frozen=True, eq=False)
class Overloads:
    """What a run with retardation remembers besides.

    Attributes
    ----------
    kinds : BlockCycles
        At the solves of the trail.
    zones : OverloadZones
        Where the tips are.
    earlier : OverloadZones, optional
        At the begin of the last step, of which a later solve tells more.
    ahead : CycleIntegration, optional
        The next step as the last two solves see it.
    """

    kinds: BlockCycles
    zones: OverloadZones
    earlier: OverloadZones | None = None
    ahead: CycleIntegration | None = None

    def rows(self, which: slice) -> "Overloads":
        """The same with some of the solves."""
        return replace(self, kinds=self.kinds.rows(which))


@dataclass(frozen=True, eq=False)
class Trail:
    """Directions and rates of all tips at the last solves of a run, the newest last.

    Attributes
    ----------
    sigma : (k,) array, length
        Where they were solved: integral of the largest rate over the cycles since the start.
    direction : (k, n) array, rad
        In which each tip grows, from the x-axis, without jumps by a full turn.
    rate : (k, n) array, length/cycle
        By the law, before any threshold.
    dK_eq : (k, n) array, stress √length
    scale : (n,) array, length
        Size of the crack of each tip at the start: rates are taken as functions of
        ln(scale + sigma).
    exponent : float
        Of the law: a rate close to zero is interpolated as its power 1/exponent.
    bend : (n,) array, rad/√length
        Of the paths at the start: behind a kink a direction changes by bend √σ, which no
        polynomial follows.
    place : (n, 2) array, length
        Where the tips are: of one that waits, ahead of where its crack ends.
    grown : (n,) array of bool
        Whether the last face of a tip was added by growth, so that it may be moved on.
    overloads : Overloads, optional
        With retardation.
    control : StepControl
        How long the next step may be.
    """

    sigma: Floats
    direction: Floats
    rate: Floats
    dK_eq: Floats
    scale: Floats
    exponent: float
    bend: Floats
    place: Floats
    grown: Bools
    overloads: Overloads | None = None
    control: StepControl = field(default_factory=StepControl)

    @property
    def n_solves(self) -> int:
        """Number of solves since the start that are known still."""
        return len(self.sigma)

    def last(self, count: int) -> "Trail":
        """The same with the last few solves only."""
        return self._rows(slice(max(self.n_solves - count, 0), None))

    def first(self, count: int) -> "Trail":
        """The same without the newest solves."""
        return self._rows(slice(0, count))

    def _rows(self, which: slice) -> "Trail":
        return replace(
            self,
            sigma=self.sigma[which],
            direction=self.direction[which],
            rate=self.rate[which],
            dK_eq=self.dK_eq[which],
            overloads=None if self.overloads is None else self.overloads.rows(which),
        )

    def with_solve(
        self, sigma: float, direction: Floats, rate: Floats, dK_eq: Floats, exponent: float
    ) -> "Trail":
        """The same with one more solve; a direction is turned by full turns to follow the last."""
        near = self.direction[-1]
        unwound = direction + 2 * np.pi * np.round((near - direction) / (2 * np.pi))
        more = replace(
            self,
            sigma=np.append(self.sigma, sigma),
            direction=np.vstack([self.direction, unwound]),
            rate=np.vstack([self.rate, rate]),
            dK_eq=np.vstack([self.dK_eq, dK_eq]),
            exponent=exponent,
        )
        return more.last(KEPT)

    def with_direction(self, direction: Floats) -> "Trail":
        """The same with other directions at the newest solve."""
        return replace(self, direction=np.vstack([self.direction[:-1], direction]))


def directions_at(trail: Trail, s: Floats) -> Floats:
    """Directions at `s` (q,), by bend √s and a polynomial through all solves: `(q, n)`, rad."""
    nodes = np.repeat(trail.sigma[:, None], trail.direction.shape[1], axis=1)
    x = np.repeat(s[:, None], nodes.shape[1], axis=1)
    smooth = lagrange(nodes, trail.direction - trail.bend * np.sqrt(nodes), x)
    return np.asarray(smooth + trail.bend * np.sqrt(x))


def rates_at(trail: Trail, s: Floats, threshold: float = 0.0) -> Floats:
    """Rates at `s` (q,) by the solves of a trail: `(q, n)`, length/cycle.

    Parameters
    ----------
    trail : Trail
    s : (q,) array, length
    threshold : float, stress √length
        Where the range falls below it the rate is zero.

    Returns
    -------
    (q, n) array, length/cycle
        The logarithm of a rate is the polynomial through all solves in ln(scale + s); the power
        1/exponent of one that is all but zero in any of them a line from solve to solve.
    """
    rate = _positive(trail, trail.rate, s, trail.exponent)
    if threshold > 0:
        rate = np.where(_positive(trail, trail.dK_eq, s, 1.0) < threshold, 0.0, rate)
    return rate


def _positive(trail: Trail, values: Floats, s: Floats, exponent: float) -> Floats:
    nodes = np.log(trail.scale + trail.sigma[:, None])
    x = np.log(trail.scale + s[:, None])
    with np.errstate(over="ignore", under="ignore"):
        power = np.exp(
            np.clip(lagrange(nodes, np.log(np.maximum(values, _LEAST_SCALE)), x), -690, 690)
        )
    tiny = (values <= _TINY * values.max(axis=1, keepdims=True)).any(axis=0)
    if tiny.any():
        root = _lines(nodes[:, tiny], values[:, tiny] ** (1 / exponent), x[:, tiny])
        power[:, tiny] = np.maximum(root, 0.0) ** exponent
    return power


def _lines(nodes: Floats, values: Floats, x: Floats) -> Floats:
    """Lines from node to node, the last one prolonged: `(q, n)`."""
    result = lagrange(nodes[-2:], values[-2:], x)
    for k in range(len(nodes) - 2, 0, -1):
        result = np.where(
            x < nodes[k], lagrange(nodes[k - 1 : k + 1], values[k - 1 : k + 1], x), result
        )
    return result


def lagrange(nodes: Floats, values: Floats, x: Floats) -> Floats:
    """Polynomials through values `(k, n)` at nodes `(k, n)`, at `x` (q, n): `(q, n)`."""
    result = np.zeros(x.shape)
    for j in range(len(nodes)):
        weight = np.ones(x.shape)
        for i in range(len(nodes)):
            if i != j:
                weight *= (x - nodes[i]) / (nodes[j] - nodes[i])
        result += weight * values[j]
    return result


# What a solve leaves to the growth of second order of fronts.


@dataclass(frozen=True, eq=False)
class Places:
    """Places along the corrected fronts of one crack, with rates and directions.

    Attributes
    ----------
    s : (f,) array, length
        Position along the front.
    front : (f,) array of int
    x : (f, 3) array, length
    frame : (f, 3, 3) array
        Rows (ahead, normal, along).
    closed : (k,) array of bool
        Of each front.
    length : (k,) array, length
        Of each front.
    rate, law_rate : (f,) arrays, length/cycle
        After and before the threshold; with retardation both the mean over the step ahead.
    direction : (f, 3) array
        Of growth.
    pending : (f,) array, length
        Growth too short to be modelled yet.
    size : float, length
        `surface_size` of the crack.
    kinds : BlockCycles, optional
        Cycles of a block at the places, of one solve; with retardation.
    zones : OverloadZones, optional
        What overloads have left.
    """

    s: Floats
    front: Ints
    x: Floats
    frame: Floats
    closed: Bools
    length: Floats
    rate: Floats
    law_rate: Floats
    direction: Floats
    pending: Floats
    size: float
    kinds: BlockCycles | None = None
    zones: OverloadZones | None = None

    @property
    def angle(self) -> Floats:
        """Kink angle in the frames `(f,)`, rad."""
        along = np.einsum("ij,ij->i", self.direction, self.frame[:, 0])
        across = np.einsum("ij,ij->i", self.direction, self.frame[:, 1])
        return np.asarray(np.arctan2(across, along))


@dataclass(frozen=True, eq=False)
class FrontTrail:
    """What the last solve leaves.

    Attributes
    ----------
    parts : tuple of Places
        One a crack.
    exponent : float
        Of the growth law.
    control : StepControl
        How long the next step may be.
    """

    parts: tuple[Places, ...]
    exponent: float
    control: StepControl = field(default_factory=StepControl)


__all__ = [
    "KEPT",
    "REJECTED",
    "FrontTrail",
    "Overloads",
    "Places",
    "StepControl",
    "Trail",
    "check_retardation",
    "directions_at",
    "first_length",
    "lagrange",
    "next_length",
    "rates_at",
    "shortest",
    "step_error",
    "within",
]
