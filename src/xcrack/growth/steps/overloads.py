"""What growth cycle by cycle remembers of overloads, and which settings it goes with."""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.errors import ProblemError
from xcrack.inputs import shown
from xcrack.laws.law import Law
from xcrack.laws.zones import wheeler, willenborg
from xcrack.spectra.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class Zones:
    """What overloads left at places, and where in a block of cycles the run is.

    Attributes
    ----------
    since : (n,) array, length
        Growth since the overload.
    size : (n,) array, length
        Its plastic zone; 0 before the first.
    K : (n,) array, stress √length
        K_max of the overload.
    position : int
        Number of the next cycle of the block.
    part : float
        Of that cycle that is over.
    """

    since: Floats
    size: Floats
    K: Floats
    position: int = 0
    part: float = 0.0

    def at(self, places: Bools | Ints) -> "Zones":
        """The same for some places."""
        return replace(self, since=self.since[places], size=self.size[places], K=self.K[places])


@dataclass(frozen=True, eq=False)
class Kinds:
    """The kinds of cycles of a block at places, at the last solves.

    Attributes
    ----------
    dK, R : (k, n, p) arrays
        Equivalent range (stress √length) and ratio.
    a : (k, n) array, length
        Crack size that a law is given.
    """

    dK: Floats
    R: Floats
    a: Floats

    def rows(self, which: slice) -> "Kinds":
        """Some of the solves."""
        return Kinds(self.dK[which], self.R[which], self.a[which])

    def at(self, places: Bools | Ints) -> "Kinds":
        """Some of the places."""
        return Kinds(self.dK[:, places], self.R[:, places], self.a[:, places])

    def followed_by(self, later: "Kinds", most: int) -> "Kinds":
        """With later solves, of all at most the last few."""
        parts = zip((self.dK, self.R, self.a), (later.dK, later.R, later.a))
        return Kinds(*(np.concatenate(pair)[-most:] for pair in parts))


@dataclass(frozen=True, eq=False)
class March:
    """Growth of places, cycle by cycle.

    Attributes
    ----------
    sigma : (g,) array, length
        Sum of the largest growth of any place in each cycle.
    arc : (g, n) array, length
        How far each place has come.
    cycles : (g,) array
        Blocks until there.
    reached : float, length
        Up to which it came: less than the last of `sigma` where nothing grows, or the blocks are
        over.
    zones : Zones
        Then.
    """

    sigma: Floats
    arc: Floats
    cycles: Floats
    reached: float
    zones: Zones

    def until(self, sigma: float) -> tuple[Floats, float]:
        """How far each place has come `(n,)`, and blocks, at some sigma."""
        arc = [np.interp(sigma, self.sigma, column) for column in self.arc.T]
        return np.array(arc), float(np.interp(sigma, self.sigma, self.cycles))


def no_zones(n: int) -> Zones:
    """Places without an overload."""
    return Zones(np.zeros(n), np.zeros(n), np.zeros(n))


def check_retardation(model: object, law: Law, cycle: object, integrator: str) -> None:
    """Refuse a model of retardation with what it means nothing with."""
    if model is None:
        return
    if not isinstance(model, wheeler | willenborg):
        raise ProblemError(f"grow: retardation = {shown(model)}: give wheeler or willenborg.")
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


__all__ = ["Kinds", "March", "Zones", "check_retardation", "no_zones"]
