"""What the last solves say of growth over a piece of σ: by rates, or cycle by cycle with overloads.

σ is the integral of the largest rate over the cycles: the arc of the ends that drive, one after the
other, so that a change of the one that drives is no event.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.fatigue.retardation import POINTS, BlockCycles, CycleIntegration, OverloadZones, march
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import block_order

KEPT = 3  # solves: a parabola passes through three points

_TINY = 1e-3  # of the largest rate: the logarithm of a smaller one says nothing between two solves
_LEAST_SCALE = 1e-300  # below every rate: keeps logarithms finite

_PIECES = 4  # a step's: rates may start, stop or overtake each other inside it
_X, _W = np.polynomial.legendre.leggauss(8)
_POINTS = np.concatenate([(k + 0.5 * (_X + 1)) / _PIECES for k in range(_PIECES)])
_WEIGHTS = np.tile(0.5 * _W / _PIECES, _PIECES)
_PASSES = 60  # of a bisection: to the last bit


@dataclass(frozen=True, eq=False)
class SolveHistory:
    """Directions and rates at the n stations of now in the last k solves, the newest last.

    Attributes
    ----------
    sigma : (k,) array, length
        Where they were solved, from where the history begins.
    rate : (k, n) array, length/cycle
        By the law, before any threshold.
    dK_eq : (k, n) array, stress √length
        Equivalent range.
    direction : (k, n, d) array
        Unit vectors of growth.
    scale : (n,) array, length
        Size of the crack where the history begins: rates are taken as functions of
        ln(scale + sigma).
    bend : (n,) array, rad/√length
        Of the paths where the history begins: behind a kink a direction changes by bend √σ, which
        no polynomial follows.
    exponent : float
        Of the law: a rate close to zero is interpolated as its power 1/exponent.
    kinds : BlockCycles, optional
        Cycles of a block, with retardation.
    rate_bend : (n,) array, 1/√length, optional
        Of ln(rate) where the history begins, as `bend` of the direction.
    """

    sigma: Floats
    rate: Floats
    dK_eq: Floats
    direction: Floats
    scale: Floats
    bend: Floats
    exponent: float
    kinds: BlockCycles | None = None
    rate_bend: Floats | None = None

    @property
    def n_solves(self) -> int:
        """Number of solves since the history begins that are known still."""
        return len(self.sigma)

    @property
    def start(self) -> float:
        """σ of the newest solve, length."""
        return float(self.sigma[-1])

    def last_solves(self, count: int) -> "SolveHistory":
        """The same with the last few solves only."""
        return self._of_solves(slice(max(self.n_solves - count, 0), None))

    def first_solves(self, count: int) -> "SolveHistory":
        """The same without the newest solves."""
        return self._of_solves(slice(0, count))

    def _of_solves(self, rows: slice) -> "SolveHistory":
        names = ("sigma", "rate", "dK_eq", "direction")
        kinds = None if self.kinds is None else self.kinds.rows(rows)
        return replace(self, **{name: getattr(self, name)[rows] for name in names}, kinds=kinds)

    def with_solve(
        self,
        sigma: float,
        rate: Floats,
        dK_eq: Floats,
        direction: Floats,
        exponent: float,
        kinds: BlockCycles | None = None,
    ) -> "SolveHistory":
        """The same with one more solve at the stations."""
        if self.kinds is not None and kinds is not None:
            kinds = self.kinds.followed_by(kinds, KEPT)
        with_new = replace(
            self,
            sigma=np.append(self.sigma, sigma),
            rate=np.vstack([self.rate, rate]),
            dK_eq=np.vstack([self.dK_eq, dK_eq]),
            direction=np.concatenate([self.direction, direction[None]]),
            exponent=exponent,
            kinds=None,
        )
        return replace(with_new.last_solves(KEPT), kinds=kinds)

    def with_direction(self, direction: Floats) -> "SolveHistory":
        """The same with other directions `(n, d)` at the newest solve."""
        return replace(self, direction=np.concatenate([self.direction[:-1], direction[None]]))

    def angles(self, frame: Floats) -> Floats:
        """Angles of the directions in frames `(k, n)`, without jumps by a full turn, rad."""
        components = np.einsum("nij,knj->kin", frame[:, :2], self.direction)
        angle = np.arctan2(components[:, 1], components[:, 0])
        if np.abs(angle[1:] - angle[:-1]).max(initial=0.0) > np.pi:
            for k in range(len(angle) - 2, -1, -1):
                angle[k] += 2 * np.pi * np.round((angle[k + 1] - angle[k]) / (2 * np.pi))
        return np.asarray(angle)


def rates_at(solves: SolveHistory, s: Floats, threshold: float = 0.0) -> Floats:
    """Rates at `s` (q,) by all solves: `(q, n)`, length/cycle.

    Parameters
    ----------
    solves : SolveHistory
    s : (q,) array, length
    threshold : float, stress √length
        Where the range falls below it the rate is zero.

    Returns
    -------
    (q, n) array, length/cycle
        The logarithm of a rate is a line in ln(scale + s) through two solves, and through three one
        with (scale + s)² beside it; the power 1/exponent of one that is all but zero in any of them
        a line from solve to solve.

    Notes
    -----
    So powers of the length are exact, and the width of a body enters as it does first in K of
    cracks of length a: as a power series in a² (Isida 1973, in Sih, Mechanics of Fracture 1).
    """
    if solves.rate_bend is None:
        rate = _positive_power(solves, solves.rate, s, solves.exponent)
    else:
        smooth_rate = solves.rate * np.exp(-solves.rate_bend * np.sqrt(solves.sigma[:, None]))
        rate = _positive_power(solves, smooth_rate, s, solves.exponent)
        rate = rate * np.exp(solves.rate_bend * np.sqrt(s[:, None]))
    if threshold > 0:
        rate = np.where(_positive_power(solves, solves.dK_eq, s, 1.0) < threshold, 0.0, rate)
    return rate


def _positive_power(solves: SolveHistory, values: Floats, s: Floats, exponent: float) -> Floats:
    nodes = np.log(solves.scale + solves.sigma[:, None])
    x = np.log(solves.scale + s[:, None])
    with np.errstate(over="ignore", under="ignore"):
        logarithm = _curve(nodes, np.log(np.maximum(values, _LEAST_SCALE)), x)
        power = np.exp(np.clip(logarithm, -690, 690))
    has_tiny_value = (values <= _TINY * values.max(axis=1, keepdims=True)).any(axis=0)
    if has_tiny_value.any():
        root = _lines(
            nodes[:, has_tiny_value],
            values[:, has_tiny_value] ** (1 / exponent),
            x[:, has_tiny_value],
        )
        power[:, has_tiny_value] = np.maximum(root, 0.0) ** exponent
    return power


def _curve(nodes: Floats, values: Floats, x: Floats) -> Floats:
    """Through values `(k, n)` at logarithms of lengths, at those of others (q, n): `(q, n)`."""
    if len(nodes) < 2:
        return lagrange(nodes, values, x)
    line = _line_shares(nodes, x)
    result = line[0] * values[0] + line[1] * values[1]
    if len(nodes) < 3:
        return result
    new_nodes = nodes[2:]
    shares_there = _line_shares(nodes, new_nodes)
    first_bend, last_bend = np.exp(2 * (nodes[:2] - new_nodes))
    bends = np.exp(2 * (x - new_nodes)) - (line[0] * first_bend + line[1] * last_bend)
    weight_of_bend = 1.0 - (shares_there[0] * first_bend + shares_there[1] * last_bend)
    return (
        result
        + (values[2:] - (shares_there[0] * values[0] + shares_there[1] * values[1]))
        * bends
        / weight_of_bend
    )


def _line_shares(nodes: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Shares of the values at the first two nodes in the line through them, at `x` (q, n)."""
    step = nodes[1] - nodes[0]
    return (x - nodes[1]) / -step, (x - nodes[0]) / step


def _lines(nodes: Floats, values: Floats, x: Floats) -> Floats:
    """Lines from node to node, the last one prolonged: `(q, n)`."""
    result = lagrange(nodes[-2:], values[-2:], x)
    for k in range(len(nodes) - 2, 0, -1):
        value_before = lagrange(nodes[k - 1 : k + 1], values[k - 1 : k + 1], x)
        result = np.where(x < nodes[k], value_before, result)
    return result


def lagrange(nodes: Floats, values: Floats, x: Floats) -> Floats:
    """Polynomials through values `(k, n)` at nodes `(k, n)`, at `x` (q, n): `(q, n)`."""
    return _sum(lagrange_shares(nodes, x), values)


def lagrange_shares(nodes: Floats, x: Floats) -> list[Floats]:
    """Shares of the values at k nodes in the polynomials through them, at `x`, one array a node."""
    shares = []
    for j in range(len(nodes)):
        share = np.ones(x.shape)
        for i in range(len(nodes)):
            if i != j:
                share = share * ((x - nodes[i]) / (nodes[j] - nodes[i]))
        shares.append(share)
    return shares


def _sum(shares: Sequence[Floats], values: Floats) -> Floats:
    total = shares[0] * values[0]
    for share, value in zip(shares[1:], values[1:], strict=True):
        total = total + share * value
    return total


def bisected_length(
    is_true: Callable[[float], bool], max_length: float, times: int = 40
) -> tuple[float, float]:
    """Lengths between which a condition ceases to hold, in [0, max_length].

    Parameters
    ----------
    is_true : callable length -> bool
        True at 0, false at `max_length`.
    max_length : float
    times : int
        The two lengths are max_length / 2^times apart.

    Returns
    -------
    lower_length, upper_length : float
        It holds at `lower_length`, or that is 0; not at `upper_length`, or that is `max_length`.
    """
    lower_length, upper_length = 0.0, max_length
    for _ in range(times):
        middle = 0.5 * (lower_length + upper_length)
        if is_true(middle):
            lower_length = middle
        else:
            upper_length = middle
    return lower_length, upper_length


@dataclass(frozen=True, eq=False)
class Growth:
    """What happens over a piece of σ.

    Attributes
    ----------
    move : (n, d) array, length
        How far each end comes.
    arc : (n,) array, length
        Length of its path.
    cycles : float
    """

    move: Floats
    arc: Floats
    cycles: float


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Points `s` (q,) in a piece of σ, and what is counted there.

    Their weights `(q,)`, and dx/dσ of each path `(q, n)`: with these the arcs `(n,)` and the cycles
    of the whole piece. The solves are at `nodes` (k,).
    """

    nodes: Floats
    s: Floats
    weight: Floats
    share: Floats
    arc: Floats
    cycles: float

    @cached_property
    def turns(self) -> list[Floats]:
        """Shares of the directions of the solves in that at the points, an array (q, 1) a solve."""
        return lagrange_shares(self.nodes, self.s[:, None])


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of σ over which ends grow as some solves have it.

    Attributes
    ----------
    solves : SolveHistory
    start, length : float, length
        Of σ.
    threshold : float, stress √length
        As of `rates_at`.
    marched : CycleIntegration, optional
        Growth cycle by cycle, with retardation; it may go farther than `length`.
    """

    solves: SolveHistory
    start: float
    length: float
    threshold: float = 0.0
    integration: CycleIntegration | None = None

    @property
    def zones(self) -> OverloadZones | None:
        """What overloads have left at its end."""
        return None if self.integration is None else self.integration.zones

    def arcs(self, length: float | None = None) -> tuple[Floats, float]:
        """Lengths of the paths `(n,)`, and cycles, over all of it or a first part."""
        pieces = self._all_pieces if length is None else self._up_to(length)
        return pieces.arc, pieces.cycles

    @cached_property
    def _all_pieces(self) -> "_Pieces":
        return self._up_to(self.length)

    def _up_to(self, length: float) -> "_Pieces":
        if self.integration is not None:
            is_within = self.integration.sigma < length
            arc, cycles = self.integration.growth_up_to(length)
            sigma = np.append(self.integration.sigma[is_within], length)
            share = np.diff(np.vstack([self.integration.arc[is_within], arc]), axis=0)
            s = self.start + 0.5 * (sigma[1:] + sigma[:-1])
            return _Pieces(self.solves.sigma, s, np.ones(len(share)), share, arc, cycles)
        s, weight = self.start + length * _POINTS, length * _WEIGHTS
        rate = rates_at(self.solves, s, self.threshold)
        fastest_rate = rate.max(axis=1, initial=0.0)
        is_growing = fastest_rate > 0
        safe_rate = np.where(is_growing, fastest_rate, 1.0)
        share = np.where(is_growing[:, None], rate / safe_rate[:, None], 0.0)
        cycles = float(weight @ np.where(is_growing, 1 / safe_rate, 0.0))
        return _Pieces(self.solves.sigma, s, weight, share, weight @ share, cycles)

    def growth(self, frame: Floats, angle: Floats, length: float | None = None) -> Growth:
        """Growth in the directions of the solves, over all of it or a first part.

        Parameters
        ----------
        frame : (n, d, d) array
        angle : (k, n) array, rad
            Of the directions of the solves in these frames.
        length : float, optional

        Notes
        -----
        dx_i/dσ = r_i / max_j r_j (cos θ_i t + sin θ_i n), dN/dσ = 1 / max_j r_j. θ is bend √σ and a
        polynomial through the angles of all solves.
        """
        pieces, bend = self._all_pieces if length is None else self._up_to(length), self.solves.bend
        if bend.any():
            smooth_angle = angle - bend * np.sqrt(pieces.nodes[:, None])
            theta = _sum(pieces.turns, smooth_angle) + bend * np.sqrt(pieces.s[:, None])
        else:
            theta = _sum(pieces.turns, angle)
        growth_along, growth_across = (
            pieces.weight @ (pieces.share * f(theta)) for f in (np.cos, np.sin)
        )
        move = growth_along[:, None] * frame[:, 0] + growth_across[:, None] * frame[:, 1]
        return Growth(move, pieces.arc, pieces.cycles)

    def length_of_cycles(self, cycles: float) -> float:
        """First part that takes a number of cycles, at most all of it, length."""
        if self.arcs()[1] <= cycles:
            return self.length
        return bisected_length(lambda part: self.arcs(part)[1] < cycles, self.length, _PASSES)[1]

    def growing_length(self) -> float:
        """Part up to which anything grows, length."""

        def is_growing_at(part: float) -> bool:
            rate = rates_at(self.solves, np.array([self.start + part]), self.threshold)
            return bool((rate > 0).any())

        if is_growing_at(self.length):
            return self.length
        return bisected_length(is_growing_at, self.length, _PASSES)[0]


def stretch_of(
    rule: GrowthRule,
    solves: SolveHistory,
    start: float,
    length: float,
    zones: OverloadZones | None,
    blocks: float = np.inf,
) -> Stretch:
    """A piece of σ from some start, with the overloads left there.

    With retardation it ends after some blocks of cycles, if it does not sooner.
    """
    integration = None
    if zones is not None:
        grid = np.linspace(0.0, length, POINTS)
        assert solves.kinds is not None
        nodes = np.log(solves.scale + solves.sigma[:, None])
        x = np.log(solves.scale + start + grid[:, None])
        integration = cycle_by_cycle(
            rule, solves.kinds, nodes, x, zones, length, solves.exponent, blocks
        )
    return Stretch(solves, start, length, rule.threshold, integration)


def cycle_by_cycle(
    rule: GrowthRule,
    kinds: BlockCycles,
    nodes: Floats,
    x: Floats,
    zones: OverloadZones,
    length: float,
    exponent: float,
    blocks: float,
) -> CycleIntegration:
    """Growth after overloads by law and retardation of a run, as of `march`."""
    return march(
        rule.law,
        rule.retardation,
        block_order(rule),
        kinds,
        nodes,
        x,
        zones,
        length,
        exponent=exponent,
        threshold=rule.threshold,
        blocks=blocks,
        names=[name for name, _ in rule.problem.elasticity.named],
    )


__all__ = [
    "KEPT",
    "Growth",
    "SolveHistory",
    "Stretch",
    "bisected_length",
    "cycle_by_cycle",
    "lagrange",
    "rates_at",
    "stretch_of",
]
