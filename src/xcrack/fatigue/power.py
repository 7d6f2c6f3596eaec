"""Laws that are powers of a range: Paris, Elber, Walker, and Paris in pieces."""

from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, Number, Part
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.base.units import TOUGHNESS
from xcrack.fatigue.law import (
    Approach,
    Closure,
    GrowthLaw,
    Ratio,
    RRange,
    Threshold,
    per_range,
    power_of,
)

LawClosure = Annotated[Closure | None, Part(Closure)]
LawThreshold = Annotated[Threshold | None, Part(Threshold)]
Toughness = Annotated[float | None, Number(above=0, unit=TOUGHNESS)]


@dataclass(frozen=True)
class paris(GrowthLaw):  # noqa: N801 - it is used as a function: paris(C, m)(dK_eq, R)
    """Growth as a power of the range.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
    m : float
        Exponent.
    closure : linear_closure, schijve_closure or newman_closure, optional
        U ΔK stands for ΔK then.
    threshold : klesnil_lukas, stepped_threshold or el_haddad, optional
        Range below which nothing grows.
    approach : {"cut", "difference"} or float
        How growth begins above the threshold: at once, as C (ΔK^m - ΔK_th^m), or times
        (1 - ΔK_th / ΔK)^p with the given p.
    K_c : float, stress √length, optional
        Toughness: inf where K_max reaches it, which ends a run.
    ratio : {"contact", "nominal"}, optional
        Which ΔK and R the constants belong to; to be given where R < 0 is asked for and the law
        depends on R.
    R_range : (float, float), optional
        Lowest and highest R for which the constants were fitted: others are an error.

    Raises
    ------
    ProblemError
        A part that does not fit.

    Notes
    -----
    da/dN = C ΔK^m (Paris and Erdogan 1963); the difference of two powers is that of Klesnil and
    Lukáš (1972).

    Examples
    --------
    >>> law = paris(C=1e-11, m=3)
    >>> print(f"{law(10.0, 0.0):.3g}")
    1e-08
    """

    C: Annotated[float, Number(above=0, unit=per_range)]
    m: Annotated[float, Number(above=0)]
    closure: LawClosure = None
    threshold: LawThreshold = None
    approach: Approach = "cut"
    K_c: Toughness = None
    ratio: Ratio = None
    R_range: RRange = None

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C ΔK^m."""
        return power_of("paris", self.C, dK, self.m)


@dataclass(frozen=True)
class elber(GrowthLaw):  # noqa: N801 - it is used as a function
    """Growth by the part of the range in which the plastic wake lets the crack open.

    Where contact of the lips is computed, the smallest K is that of the closed crack already;
    U then stands for the closure by plasticity only.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
    m : float
        Exponent.
    a, b : float
        U = a + b R, cut to [0, 1].

    Raises
    ------
    ProblemError
        U = 0 for all R in [0, 1].

    Notes
    -----
    da/dN = C (U ΔK)^m (Elber 1971). His own a = 0.5, b = 0.4 were fitted on the alloy 2024-T3 for
    -0.1 < R < 0.7.

    Examples
    --------
    >>> law = elber(C=1e-11, m=3, a=0.5, b=0.4)
    >>> print(f"{law(10.0, 0.0):.4g}")
    1.25e-09
    """

    C: Annotated[float, Number(above=0, unit=per_range)]
    m: Annotated[float, Number(above=0)]
    a: Annotated[float, Number()]
    b: Annotated[float, Number()]
    knows_negative_ratios = False  # R < 0 is warned of and not refused, as its U is cut to [0, 1]

    def __post_init__(self) -> None:
        super().__post_init__()
        if max(self.a, self.a + self.b) <= 0:
            raise ProblemError(
                f"elber: U = {self.a} + {self.b} R is not positive for any R in [0, 1], so that "
                "nothing would ever grow: give a or a + b above 0."
            )

    @property
    def closure(self) -> Closure:  # type: ignore[override]
        """U for any R."""
        return _OpenShare(self.a, self.b)

    def U(self, R: ArrayLike) -> Floats:  # noqa: N802 - Elber's own name
        """Share of the range that opens the crack, in [0, 1]."""
        return self.closure(R)

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C (U ΔK)^m."""
        return power_of("elber", self.C, dK, self.m)


@dataclass(frozen=True)
class _OpenShare(Closure):
    """U = a + b R, cut to [0, 1]."""

    a: float
    b: float

    def __call__(self, R: ArrayLike) -> Floats:
        """U in [0, 1] for R."""
        return np.asarray(np.clip(self.a + self.b * numbers(R, "elber: R"), 0.0, 1.0))[()]


@dataclass(frozen=True)
class walker(GrowthLaw):  # noqa: N801 - it is used as a function
    """Growth by a range that the mean load raises.

    Parameters
    ----------
    C : float, length/cycle / (stress √length)^m
        Valid for R = 0.
    m : float
        Exponent.
    gamma : float
        1 makes it the law of Paris.
    gamma_minus : float, optional
        Exponent for R < 0: 0 is growth by K_max alone. `gamma`, where it is left out.
    threshold, approach, K_c, ratio, R_range
        As of `paris`.

    Raises
    ------
    ProblemError
        A part that does not fit.

    Notes
    -----
    da/dN = C (ΔK / (1 - R)^(1 - γ))^m (Walker 1970).

    Examples
    --------
    >>> law = walker(C=1e-11, m=2, gamma=0.5)
    >>> print(f"{law(10.0, 0.75):.3g}")
    4e-09
    """

    C: Annotated[float, Number(above=0, unit=per_range)]
    m: Annotated[float, Number(above=0)]
    gamma: Annotated[float, Number(least=0, most=1)]
    gamma_minus: Annotated[float | None, Number(least=0, most=1)] = None
    threshold: LawThreshold = None
    approach: Approach = "cut"
    K_c: Toughness = None
    ratio: Ratio = None
    R_range: RRange = None

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether its answer for R < 0 depends on how R is meant."""
        return self.gamma_minus is not None or super().knows_negative_ratios

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C (ΔK / (1 - R)^(1 - γ))^m."""
        # R = 1 is a load that does not vary: ΔK = 0, and 0/0 must not become nan
        share = np.maximum(1.0 - R, np.finfo(float).tiny)
        gamma: float | Floats = self.gamma
        if self.gamma_minus is not None:
            gamma = np.where(R < 0, self.gamma_minus, self.gamma)
        with np.errstate(over="ignore"):
            effective_range = np.where(dK > 0, dK / share ** (1.0 - gamma), 0.0)
        return power_of("walker", self.C, effective_range, self.m)


@dataclass(frozen=True)
class piecewise(GrowthLaw):  # noqa: N801 - it is used as a function
    """Paris in pieces: each has its own constants, and they change at knees.

    Parameters
    ----------
    pieces : sequence of (C, m)
        From small ranges to large ones.
    knees : sequence of float, stress √length, optional
        Ranges at which one piece takes over from the one before; where the lines cross, if
        omitted, which makes the law continuous.
    threshold, approach, K_c, ratio, R_range
        As of `paris`.

    Raises
    ------
    ProblemError
        Lines that do not cross in this order.

    Notes
    -----
    The two-stage laws of BS 7910 have this form; its table rounds the knees.

    Examples
    --------
    >>> law = piecewise([(1.21e-26, 8.16), (3.98e-13, 2.88)])        # N/mm^1.5, mm
    >>> print(f"{law.knees[0]:.2f}", f"{law(500.0, 0.1):.5g}")
    363.13 2.36e-05
    """

    pieces: Annotated[tuple[tuple[float, float], ...], Array(shape=(None, 2), is_hashable=True)]
    knees: Annotated[
        tuple[float, ...] | None, Array(shape=(None,), unit=TOUGHNESS, is_hashable=True)
    ] = None
    threshold: LawThreshold = None
    approach: Approach = "cut"
    K_c: Toughness = None
    ratio: Ratio = None
    R_range: RRange = None

    def __post_init__(self) -> None:
        super().__post_init__()
        constants = np.array(self.pieces)
        if not len(constants) or (constants <= 0).any():
            raise ProblemError("piecewise: pieces: give positive pairs (C, m).")
        C, m = constants.T
        if self.knees is None:
            if (np.diff(m) == 0).any():
                raise ProblemError(
                    "piecewise: two pieces with the same m do not cross: give knees."
                )
            knees = np.exp(np.diff(np.log(C)) / -np.diff(m))
        else:
            knees = np.array(numbers(self.knees, "piecewise: knees", (len(C) - 1,)))
        if (knees <= 0).any() or (np.diff(knees) <= 0).any():
            raise ProblemError(
                f"piecewise: the knees {knees} do not rise: order the pieces from small ranges to "
                "large ones."
            )
        object.__setattr__(self, "knees", tuple(knees.tolist()))

    def to(self, units: str, new: str) -> Self:
        """The same law in other units; see `paris.to`."""
        pieces = tuple((paris(C, m).to(units, new).C, m) for C, m in self.pieces)
        return replace(super().to(units, new), pieces=pieces)

    def rate(self, dK: Floats, R: Floats) -> Floats:
        """C ΔK^m of the piece."""
        C, m = np.array(self.pieces).T
        piece = np.searchsorted(np.array(self.knees), dK, side="right")
        return power_of("piecewise", C[piece], dK, m[piece])


__all__ = ["LawClosure", "LawThreshold", "Toughness", "elber", "paris", "piecewise", "walker"]
