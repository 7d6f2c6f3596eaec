"""Distributions of what is not known exactly, and which of them a life has."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import Declared, Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import number, numbers, value_text, whole_number
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.fatigue.law import Law
from xcrack.runs.rerating import DrivingForce, cycles_of

_ROUND_OFF = 1e-12


@dataclass(frozen=True)
class lognormal(Declared):  # noqa: N801 - it is used as a function
    """A factor whose logarithm is normal with the median 1, or a length with another median.

    Parameters
    ----------
    sigma : float
        Standard deviation of the natural logarithm.
    median : float

    Raises
    ------
    ProblemError
        A value out of bounds.

    Examples
    --------
    >>> print(lognormal(0.3).quantile(0.95).round(4))
    1.638
    """

    sigma: Annotated[float, Number(least=0, most=100)]
    median: Annotated[float, Number(above=0)] = 1.0

    def quantile(self, p: float | Floats) -> Floats:
        """Value that a share p of all does not exceed."""
        return np.asarray(self.median * np.exp(self.sigma * _deviate(p)))[()]


@dataclass(frozen=True)
class normal(Declared):  # noqa: N801
    """A factor that is normal with the mean 1, or a length with another mean.

    Parameters
    ----------
    sigma : float
        Standard deviation, at most a fifth of the mean: no factor is negative.
    mean : float

    Raises
    ------
    ProblemError
        A value out of bounds.

    Examples
    --------
    >>> print(normal(0.01).quantile(0.5))
    1.0
    """

    sigma: Annotated[float, Number(least=0)]
    mean: Annotated[float, Number(above=0)] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        number(self.sigma, "normal: sigma", most=0.2 * self.mean)

    def quantile(self, p: float | Floats) -> Floats:
        """Value that a share p of all does not exceed; nothing below a thousandth of the mean."""
        return np.maximum(self.mean + self.sigma * _deviate(p), 1e-3 * self.mean)[()]


def _deviate(p: float | Floats) -> Floats:
    """Standard normal deviate of shares in (0, 1)."""
    from scipy.special import ndtri

    share = numbers(p, "quantile: p")
    if not ((share > 0) & (share < 1)).all():
        raise ProblemError(
            f"quantile: p from {share.min():g} to {share.max():g}: give it in (0, 1)."
        )
    return np.asarray(ndtri(share))


Distribution = lognormal | normal


_OWN = ("C", "K", "load", "a0")


@dataclass(frozen=True)
class Scatter:
    """What varies from one specimen, aircraft or flight to the next.

    Parameters
    ----------
    C : lognormal or normal, optional
        Factor on the growth rate.
    K : lognormal or normal, optional
        Factor on all K: their error of modelling.
    load : lognormal or normal, optional
        Factor on all loads. Its effect is that of K where K is in proportion to the load.
    a0 : lognormal or normal, optional
        Length of the crack at the begin, not below that of the run; for one tip.
    constants : dict of str to lognormal or normal, optional
        Factors on constants of the law, by their names: ``{"m": normal(0.02)}``; of a part of it as
        ``"threshold.dK0"``.
    correlation : dict of (str, str) to float, optional
        Between two of these, by their names, in [-1, 1]: of the normal scores, which for lognormal
        and normal factors are the logarithms and the factors themselves.

    Raises
    ------
    ProblemError
        Another kind of value, nothing that varies, or correlations that no sample can have.

    Notes
    -----
    A regression of measured rates gives ln C and m with a covariance, and a correlation that is
    close to -1 unless C belongs to a range K_p in the middle of the data. Both say the same:
    with ln C_p and m independent, ln C = ln C_p - m ln K_p has the variance
    s(ln C_p)² + (ln K_p s(m))² and the correlation -ln K_p s(m) / s(ln C) with m. Independent
    scatter of C and m overstates that of the life.

    Examples
    --------
    >>> joint = Scatter(C=lognormal(1.2), constants={"m": normal(0.03)},
    ...                 correlation={("C", "m"): -0.98})
    >>> sorted(joint.parts)
    ['C', 'm']
    """

    C: Distribution | None = None
    K: Distribution | None = None
    load: Distribution | None = None
    a0: Distribution | None = None
    constants: Mapping[str, Distribution] = field(default_factory=dict)
    correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.constants, Mapping):
            raise ProblemError(
                f"Scatter: constants = {value_text(self.constants)}: give a dict, "
                f'{{"m": normal(0.02)}}.'
            )
        for name in self.constants:
            if not isinstance(name, str) or name in _OWN:
                raise ProblemError(
                    f"Scatter: constants has {value_text(name)}: give the name of a constant of "
                    f"the law; C, K, load and a0 are arguments of their own."
                )
        object.__setattr__(self, "constants", dict(self.constants))
        parts_by_name = {name: getattr(self, name) for name in _OWN} | dict(self.constants)
        for name, part in parts_by_name.items():
            is_needed = name in self.constants or part is not None
            if is_needed and not isinstance(part, Distribution):
                raise ProblemError(
                    f"Scatter: {name} = {value_text(part)}: give lognormal or normal."
                )
        if not self.parts:
            raise ProblemError("Scatter: nothing varies: give C, K, load, a0 or constants.")
        self._check_correlation()

    def _check_correlation(self) -> None:
        if not isinstance(self.correlation, Mapping):
            raise ProblemError(
                f"Scatter: correlation = {value_text(self.correlation)}: give a dict, "
                '{("C", "m"): -0.98}.'
            )
        correlations = {}
        for pair, value in self.correlation.items():
            names = pair if isinstance(pair, tuple) else ()
            if len(names) != 2 or not all(n in self.parts for n in names) or names[0] == names[1]:
                raise ProblemError(
                    f"Scatter: correlation has {value_text(pair)}: give pairs of what varies, "
                    f"{', '.join(self.parts)}."
                )
            rho = number(value, f"Scatter: correlation of {names[0]} and {names[1]}")
            if not -1 <= rho <= 1:
                raise ProblemError(
                    f"Scatter: correlation of {names[0]} and {names[1]} = {rho:g}: give it in "
                    "[-1, 1]."
                )
            correlations[pair] = rho
        object.__setattr__(self, "correlation", correlations)
        least_eigenvalue = np.linalg.eigvalsh(self.matrix).min()
        if least_eigenvalue < -_ROUND_OFF:
            raise ProblemError(
                "Scatter: no sample has these correlations together, their matrix has the "
                f"eigenvalue {least_eigenvalue:.3g}: give those of one covariance."
            )

    @property
    def parts(self) -> dict[str, Distribution]:
        """What varies, by its name."""
        own_parts = {name: getattr(self, name) for name in _OWN if getattr(self, name) is not None}
        return own_parts | dict(self.constants)

    @property
    def matrix(self) -> Floats:
        """Correlations of all parts `(n, n)`, in their order."""
        names = list(self.parts)
        result = np.eye(len(names))
        for (p, q), rho in self.correlation.items():
            i, j = names.index(p), names.index(q)
            result[i, j] = result[j, i] = rho
        return result

    def draw(self, n: int, seed: int) -> dict[str, Floats]:
        """Samples of all parts.

        Parameters
        ----------
        n : int
            At least 1.
        seed : int

        Returns
        -------
        dict of str to (n,) array

        Notes
        -----
        Shares are spread evenly, one in each of n parts (Latin hypercube, McKay, Beckman and
        Conover 1979), and put in the order of correlated scores (Iman and Conover 1982): each
        part alone has the quantiles of its distribution to the number of samples.
        """
        count = whole_number(n, "Scatter.draw: n", least=1, most=10_000_000)
        draw = np.random.default_rng(whole_number(seed, "Scatter.draw: seed", least=0))
        shares = [_ranks(draw, count) for _ in self.parts]
        if self.correlation:
            shares = _ordered_shares(shares, self.matrix)
        return {
            name: np.asarray(part.quantile(share))
            for (name, part), share in zip(self.parts.items(), shares)
        }


def _ranks(draw: np.random.Generator, n: int) -> Floats:
    """Evenly spread shares in (0, 1), one in each of n parts, in random order."""
    return np.asarray((draw.permutation(n) + draw.uniform(1e-9, 1, n)) / n)


def _ordered_shares(shares: list[Floats], matrix: Floats) -> list[Floats]:
    """The same shares in the order of scores that have a correlation."""
    value, vector = np.linalg.eigh(matrix)
    root = vector * np.sqrt(np.maximum(value, 0.0)) @ vector.T
    scores = root @ np.stack([_deviate(share) for share in shares])
    return [
        np.sort(share)[np.argsort(np.argsort(score, kind="stable"), kind="stable")]
        for share, score in zip(shares, scores)
    ]


# Lives of samples: the steps of a run integrated again with the rates of each.

_CHUNK = 2_000_000  # samples times places times cycles at once
_NODES = 257  # factors on K at which the rate of a block of many cycles is asked for

Samples = Mapping[str, Floats]


def lives(lead: DrivingForce, law: Law | None, samples: Samples, n: int) -> Floats:
    """Cycles of each sample `(n,)`, from the begin of the run.

    Parameters
    ----------
    lead : DrivingForce
        The driving places alone.
    law : callable or None
        Of the run; None where only C and a0 vary.
    samples : dict of (n,) arrays
        Factors C, K and load, lengths a0, factors on constants of the law.
    n : int
    """
    constants = {name: v for name, v in samples.items() if name not in ("C", "K", "load", "a0")}
    stretch, size = stretch_of(samples), samples.get("a0")
    rates: _Stored | _Varied | _Tabulated | _Stretched
    if law is None or (len(stretch) == 1 and not constants and stretch[0] == 1):
        rates = _Stored(lead)
    elif constants:
        rates = _Varied(lead, law, constants, stretch)
    elif lead.dK.shape[-1] > 1:
        rates = _Tabulated(lead, law, stretch)
    else:
        rates = _Stretched(lead, law, stretch)
    is_one_sample = isinstance(rates, _Stored) and size is None
    count = 1 if is_one_sample else n
    N, rows = np.empty(count), max(1, _CHUNK // rates.work)
    for begin in range(0, count, rows):
        part = slice(begin, min(begin + rows, count))
        rate = rates.of(part)
        N[part] = _cycles_by_rates(lead, rate, None if size is None else size[part])
    return np.broadcast_to(N / samples.get("C", np.ones(1)), (n,)).copy()


def stretch_of(samples: Samples) -> Floats:
    """Factor on all K of each sample, or one for all."""
    return np.asarray(samples.get("K", np.ones(1)) * samples.get("load", np.ones(1)))


def varied_law(law: Law, factors: Mapping[str, float]) -> Law:
    """A law with some of its constants times factors.

    Raises
    ------
    ProblemError
        It has no such constant, or cannot have the value.
    """
    result: Any = law
    for name, factor in factors.items():
        result = _law_with_factor(result, name.split("."), float(factor), name, law)
    return result  # type: ignore[no-any-return]


def _law_with_factor(part: Any, names: list[str], factor: float, whole_name: str, law: Law) -> Any:
    has_constant = is_dataclass(part) and names[0] in {field.name for field in fields(part)}
    value = getattr(part, names[0]) if has_constant else None
    if has_constant and len(names) > 1:
        changed_part = _law_with_factor(value, names[1:], factor, whole_name, law)
        return replace(part, **{names[0]: changed_part})
    if not has_constant or isinstance(value, bool) or not isinstance(value, int | float):
        constant_names: list[str] = []
        if is_dataclass(law):
            constant_names = [
                f.name for f in fields(law) if isinstance(getattr(law, f.name), float)
            ]
        raise ProblemError(
            f"life: {type(law).__name__} has no constant {whole_name!r} that can vary: give one of "
            f"{', '.join(constant_names) or 'a law of xcrack'}."
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

    def __init__(self, lead: DrivingForce) -> None:
        self.lead, self.work = lead, len(lead.step)

    def of(self, part: slice) -> Floats:
        return self.lead.rate[None]


class _Stretched:
    """Rates of the law with K times a factor."""

    def __init__(self, lead: DrivingForce, law: Law, stretch: Floats) -> None:
        self.lead, self.law, self.stretch = lead, law, stretch
        self.work = lead.dK.size

    def of(self, part: slice) -> Floats:
        factor = self.stretch[part] if len(self.stretch) > 1 else self.stretch
        return self.lead.rates(self.law, factor[:, None, None])


class _Varied:
    """Rates of a law of its own for each sample."""

    def __init__(self, lead: DrivingForce, law: Law, constants: Samples, stretch: Floats) -> None:
        self.lead, self.law, self.constants, self.stretch = lead, law, constants, stretch
        self.work = lead.dK.size

    def of(self, part: slice) -> Floats:
        names = list(self.constants)
        rows = zip(*(self.constants[name][part].tolist() for name in names))
        n = len(self.constants[names[0]][part])
        factor = np.broadcast_to(self.stretch[part] if len(self.stretch) > 1 else self.stretch, n)
        return np.stack(
            [
                self.lead.rates(varied_law(self.law, dict(zip(names, row))), f)
                for row, f in zip(rows, factor.tolist())
            ]
        )


class _Tabulated:
    """Rates of a block of many cycles, between factors at which the law was asked.

    A straight line in logarithms, so that a power of K is exact.
    """

    def __init__(self, lead: DrivingForce, law: Law, stretch: Floats) -> None:
        self.log = np.log(stretch)
        self.work = lead.size.size
        x_min, x_max = float(self.log.min()), float(self.log.max())
        self.nodes = np.linspace(x_min, x_max, _NODES) if x_min < x_max else np.array([x_min])
        self.table = np.stack([lead.rates(law, float(np.exp(node))) for node in self.nodes])

    def of(self, part: slice) -> Floats:
        if len(self.nodes) == 1:
            return self.table
        at = (self.log[part] if len(self.log) > 1 else self.log) - self.nodes[0]
        at = at / (self.nodes[1] - self.nodes[0])
        node = np.clip(at.astype(np.int64), 0, len(self.nodes) - 2)
        share = (at - node)[:, None, None]
        r0, r1 = self.table[node], self.table[node + 1]
        has_rates = (r0 > 0) & np.isfinite(r1) & (r1 > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            power = r0 * (r1 / r0) ** share
            line = np.where(np.isinf(r1), np.where(share > 0, np.inf, r0), r0 + share * r1)
        return np.asarray(np.where(has_rates, power, line))


def _cycles_by_rates(lead: DrivingForce, rate: Floats, size: Floats | None) -> Floats:
    """Cycles over all steps by some rates, in proportion to those that the run counted."""
    a = np.broadcast_to(lead.a, rate.shape)
    blocks = lead.cycles / cycles_of(lead.a, lead.rate)
    if size is not None:
        a, rate = _steps_from_size(a, rate, size)
    cycles = cycles_of(a, rate) * blocks
    is_broken = np.isinf(rate[..., 0]) | np.isinf(rate[..., 1])
    is_after_break = (
        np.cumsum(is_broken, axis=-1) - is_broken > 0
    )  # steps after the toughness was reached
    return np.asarray(np.where(is_after_break, 0.0, cycles).sum(axis=-1))


def _steps_from_size(a: Floats, rate: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Steps cut where a crack of some size begins, at the rate that the power law has there."""
    first = np.clip(size[:, None], a[..., 0], a[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(rate[..., 1] / rate[..., 0]) / np.log(a[..., 1] / a[..., 0])
        begin = rate[..., 0] * (first / a[..., 0]) ** power
    begin = np.where(np.isfinite(begin), begin, rate[..., 0])
    begin, end, a_end = np.broadcast_arrays(begin, rate[..., 1], a[..., 1])
    return np.stack([first, a_end], axis=-1), np.stack([begin, end], axis=-1)


__all__ = ["Distribution", "Scatter", "lives", "lognormal", "normal", "stretch_of", "varied_law"]
