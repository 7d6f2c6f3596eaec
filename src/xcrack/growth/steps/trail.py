"""What earlier solves leave to the growth of second order, and values between and beyond them."""

from dataclasses import dataclass, field, replace

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.growth.steps.controller import Control
from xcrack.growth.steps.overloads import Kinds, March, Zones

KEPT = 3  # solves: a parabola passes through three points

_TINY = 1e-3  # of the largest rate: the logarithm of a smaller one says nothing between two solves
_LEAST = 1e-300  # below every rate: keeps logarithms finite


@dataclass(frozen=True, eq=False)
class Overloads:
    """What a run with retardation remembers besides.

    Attributes
    ----------
    kinds : Kinds
        At the solves of the trail.
    zones : Zones
        Where the tips are.
    earlier : Zones, optional
        At the begin of the last step, of which a later solve tells more.
    ahead : March, optional
        The next step as the last two solves see it.
    """

    kinds: Kinds
    zones: Zones
    earlier: Zones | None = None
    ahead: March | None = None

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
    control : Control
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
    control: Control = field(default_factory=Control)

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
        power = np.exp(np.clip(lagrange(nodes, np.log(np.maximum(values, _LEAST)), x), -690, 690))
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


__all__ = ["KEPT", "Overloads", "Trail", "directions_at", "lagrange", "rates_at"]
