"""Lives of samples: the steps of a run integrated again with the rates of each."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError, XcrackError
from xcrack.history.driving import Driving, cycles_of
from xcrack.laws.law import Law

_CHUNK = 2_000_000  # samples times places times cycles at once
_NODES = 257  # factors on K at which the rate of a block of many cycles is asked for

Samples = Mapping[str, Floats]


def lives(lead: Driving, law: Law | None, drawn: Samples, n: int) -> Floats:
    """Cycles of each sample `(n,)`, from the begin of the run.

    Parameters
    ----------
    lead : Driving
        The driving places alone.
    law : callable or None
        Of the run; None where only C and a0 vary.
    drawn : dict of (n,) arrays
        Factors C, K and load, lengths a0, factors on constants of the law.
    n : int
    """
    constants = {name: v for name, v in drawn.items() if name not in ("C", "K", "load", "a0")}
    stretch, size = stretch_of(drawn), drawn.get("a0")
    rates: _Stored | _Varied | _Tabulated | _Stretched
    if law is None or (len(stretch) == 1 and not constants and stretch[0] == 1):
        rates = _Stored(lead)
    elif constants:
        rates = _Varied(lead, law, constants, stretch)
    elif lead.dK.shape[-1] > 1:
        rates = _Tabulated(lead, law, stretch)
    else:
        rates = _Stretched(lead, law, stretch)
    alike = isinstance(rates, _Stored) and size is None
    count = 1 if alike else n
    N, rows = np.empty(count), max(1, _CHUNK // rates.work)
    for begin in range(0, count, rows):
        part = slice(begin, min(begin + rows, count))
        rate = rates.of(part)
        N[part] = _integrated(lead, rate, None if size is None else size[part])
    return np.broadcast_to(N / drawn.get("C", np.ones(1)), (n,)).copy()


def stretch_of(drawn: Samples) -> Floats:
    """Factor on all K of each sample, or one for all."""
    return np.asarray(drawn.get("K", np.ones(1)) * drawn.get("load", np.ones(1)))


def varied(law: Law, factors: Mapping[str, float]) -> Law:
    """A law with some of its constants times factors.

    Raises
    ------
    ProblemError
        It has no such constant, or cannot have the value.
    """
    result: Any = law
    for name, factor in factors.items():
        result = _with(result, name.split("."), float(factor), name, law)
    return result  # type: ignore[no-any-return]


def _with(part: Any, names: list[str], factor: float, whole_name: str, law: Law) -> Any:
    has = is_dataclass(part) and names[0] in {field.name for field in fields(part)}
    value = getattr(part, names[0]) if has else None
    if has and len(names) > 1:
        inner = _with(value, names[1:], factor, whole_name, law)
        return replace(part, **{names[0]: inner})
    if not has or isinstance(value, bool) or not isinstance(value, int | float):
        known: list[str] = []
        if is_dataclass(law):
            known = [f.name for f in fields(law) if isinstance(getattr(law, f.name), float)]
        raise ProblemError(
            f"life: {type(law).__name__} has no constant {whole_name!r} that can vary: give one of "
            f"{', '.join(known) or 'a law of xcrack'}."
        )
    try:
        return replace(part, **{names[0]: value * factor})
    except XcrackError as error:
        raise ProblemError(
            f"life: a sample of {whole_name} is {value * factor:.6g}, which the law refuses: "
            f"{error} Give less scatter."
        ) from error


class _Stored:
    """Rates of the run."""

    def __init__(self, lead: Driving) -> None:
        self.lead, self.work = lead, len(lead.step)

    def of(self, part: slice) -> Floats:
        return self.lead.rate[None]


class _Stretched:
    """Rates of the law with K times a factor."""

    def __init__(self, lead: Driving, law: Law, stretch: Floats) -> None:
        self.lead, self.law, self.stretch = lead, law, stretch
        self.work = lead.dK.size

    def of(self, part: slice) -> Floats:
        factor = self.stretch[part] if len(self.stretch) > 1 else self.stretch
        return self.lead.rates(self.law, factor[:, None, None])


class _Varied:
    """Rates of a law of its own for each sample."""

    def __init__(self, lead: Driving, law: Law, constants: Samples, stretch: Floats) -> None:
        self.lead, self.law, self.constants, self.stretch = lead, law, constants, stretch
        self.work = lead.dK.size

    def of(self, part: slice) -> Floats:
        names = list(self.constants)
        rows = zip(*(self.constants[name][part].tolist() for name in names))
        n = len(self.constants[names[0]][part])
        factor = np.broadcast_to(self.stretch[part] if len(self.stretch) > 1 else self.stretch, n)
        return np.stack(
            [
                self.lead.rates(varied(self.law, dict(zip(names, row))), f)
                for row, f in zip(rows, factor.tolist())
            ]
        )


class _Tabulated:
    """Rates of a block of many cycles, between factors at which the law was asked.

    A straight line in logarithms, so that a power of K is exact.
    """

    def __init__(self, lead: Driving, law: Law, stretch: Floats) -> None:
        self.log = np.log(stretch)
        self.work = lead.size.size
        low, high = float(self.log.min()), float(self.log.max())
        self.nodes = np.linspace(low, high, _NODES) if low < high else np.array([low])
        self.table = np.stack([lead.rates(law, float(np.exp(node))) for node in self.nodes])

    def of(self, part: slice) -> Floats:
        if len(self.nodes) == 1:
            return self.table
        at = (self.log[part] if len(self.log) > 1 else self.log) - self.nodes[0]
        at = at / (self.nodes[1] - self.nodes[0])
        left = np.clip(at.astype(np.int64), 0, len(self.nodes) - 2)
        share = (at - left)[:, None, None]
        low, high = self.table[left], self.table[left + 1]
        both = (low > 0) & np.isfinite(high) & (high > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            power = low * (high / low) ** share
            line = np.where(np.isinf(high), np.where(share > 0, np.inf, low), low + share * high)
        return np.asarray(np.where(both, power, line))


def _integrated(lead: Driving, rate: Floats, size: Floats | None) -> Floats:
    """Cycles over all steps by some rates, in proportion to those that the run counted."""
    a = np.broadcast_to(lead.a, rate.shape)
    counted = lead.cycles / cycles_of(lead.a, lead.rate)
    if size is not None:
        a, rate = _from(a, rate, size)
    since = cycles_of(a, rate) * counted
    broken = np.isinf(rate[..., 0]) | np.isinf(rate[..., 1])
    later = np.cumsum(broken, axis=-1) - broken > 0  # steps after the toughness was reached
    return np.asarray(np.where(later, 0.0, since).sum(axis=-1))


def _from(a: Floats, rate: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Steps cut where a crack of some size begins, at the rate that the power law has there."""
    first = np.clip(size[:, None], a[..., 0], a[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(rate[..., 1] / rate[..., 0]) / np.log(a[..., 1] / a[..., 0])
        begin = rate[..., 0] * (first / a[..., 0]) ** power
    begin = np.where(np.isfinite(begin), begin, rate[..., 0])
    begin, end, last = np.broadcast_arrays(begin, rate[..., 1], a[..., 1])
    return np.stack([first, last], axis=-1), np.stack([begin, end], axis=-1)


__all__ = ["lives", "stretch_of", "varied"]
