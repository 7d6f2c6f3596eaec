"""Distributions of what is not known exactly, and which of them a life has."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.inputs import number, numbers, shown


@dataclass(frozen=True)
class lognormal:  # noqa: N801 - it is used as a function
    """A factor whose logarithm is normal with the median 1, or a length with another median.

    Parameters
    ----------
    sigma : float
        Standard deviation of the natural logarithm, not negative.
    median : float
        Positive.

    Raises
    ------
    ProblemError
        A value out of bounds.

    Examples
    --------
    >>> print(lognormal(0.3).quantile(0.95).round(4))
    1.638
    """

    sigma: float
    median: float = 1.0

    def __post_init__(self) -> None:
        sigma = number(self.sigma, "lognormal: sigma", least=0, most=100)
        object.__setattr__(self, "sigma", sigma)
        median = number(self.median, "lognormal: median", above=0)
        object.__setattr__(self, "median", median)

    def quantile(self, p: float | Floats) -> Floats:
        """Value that a share p of all does not exceed."""
        return np.asarray(self.median * np.exp(self.sigma * _deviate(p)))[()]


@dataclass(frozen=True)
class normal:  # noqa: N801
    """A factor that is normal with the mean 1, or a length with another mean.

    Parameters
    ----------
    sigma : float
        Standard deviation, not negative, at most a fifth of the mean: no factor is negative.
    mean : float
        Positive.

    Raises
    ------
    ProblemError
        A value out of bounds.

    Examples
    --------
    >>> print(normal(0.01).quantile(0.5))
    1.0
    """

    sigma: float
    mean: float = 1.0

    def __post_init__(self) -> None:
        mean = number(self.mean, "normal: mean", above=0)
        object.__setattr__(self, "mean", mean)
        sigma = number(self.sigma, "normal: sigma", least=0, most=0.2 * mean)
        object.__setattr__(self, "sigma", sigma)

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

    Raises
    ------
    ProblemError
        Another kind of value, or nothing that varies.
    """

    C: Distribution | None = None
    K: Distribution | None = None
    load: Distribution | None = None
    a0: Distribution | None = None

    def __post_init__(self) -> None:
        parts = {name: getattr(self, name) for name in ("C", "K", "load", "a0")}
        for name, part in parts.items():
            if part is not None and not isinstance(part, Distribution):
                raise ProblemError(f"Scatter: {name} = {shown(part)}: give lognormal or normal.")
        if all(part is None for part in parts.values()):
            raise ProblemError("Scatter: nothing varies: give C, K, load or a0.")


__all__ = ["Distribution", "Scatter", "lognormal", "normal"]
