"""Checks for functions that users write: what is wrong with a law or a criterion, in words."""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import Function, Length, Number, Poisson, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import TOUGHNESS
from xcrack.fatigue.checks import law_needs
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import Law

_ROUND_OFF = 1e-9  # relative; a few operations on numbers of order one
_RATIOS = [0.0, 0.1, 0.5, 0.8, 0.95]


@check_arguments()
def check_law(
    law: Annotated[Law, Function("a function (dK_eq, R) -> da/dN")],
    dK_max: Annotated[float, Number(above=0, unit=TOUGHNESS)] = 100.0,
    a: Length = 1.0,
) -> None:
    """Try a growth law and say all that is wrong with it.

    Parameters
    ----------
    law : callable (dK_eq, R) -> da/dN
        Called with arrays `(f,)`; must return an array `(f,)` that is never negative or nan,
        does not fall when dK_eq grows, and takes each point for itself. inf says that the
        toughness is reached. What it names in ``needs`` is passed by name; with
        ``ratio = "nominal"`` it is called with R from -2 too.
    dK_max : float, stress √length
        Largest range to try; take one at which your law is still valid.
    a : float, length
        Crack size to try it with, where the law asks for it.

    Raises
    ------
    ProblemError
        With one line for each fault.

    Examples
    --------
    >>> from xcrack.fatigue.power import paris
    >>> check_law(paris(C=1e-11, m=3))
    """
    faults: list[str] = []
    ratios = [-2.0, -1.0, -0.3, -1e-9] if getattr(law, "ratio", None) == "nominal" else []
    ratios = [R for R in [*ratios, *_RATIOS] if _is_within(R, getattr(law, "R_range", None))]
    if not ratios:
        raise ProblemError(f"the law has no R of {_RATIOS} in its R_range: nothing can be tried.")
    dK = np.repeat(np.linspace(0.0, dK_max, 9), len(ratios))
    R = np.tile(ratios, 9)
    size = np.full(len(dK), a)

    def law_of_user(dK: Floats, R: Floats) -> Floats:
        return law(dK, R, **law_needs(law, dK, R, size[: len(dK)]))

    rate = _call_law(law_of_user, (dK, R), faults, "da/dN")
    if rate is not None:
        if rate.shape != dK.shape:
            faults.append(f"for {len(dK)} points it returns shape {rate.shape}, not {dK.shape}")
        else:
            _check_rates(law_of_user, dK, R, rate, faults)
    _judge("law", law, faults)


def _is_within(R: float, bounds: tuple[float, float] | None) -> bool:
    return bounds is None or bounds[0] <= R <= bounds[1]


def _check_rates(law: Law, dK: Floats, R: Floats, rate: Floats, faults: list[str]) -> None:
    is_missing = np.isnan(rate)
    if is_missing.any():
        i = int(np.argmax(is_missing))
        faults.append(f"da/dN = {rate[i]} for dK_eq = {dK[i]}, R = {R[i]}: it must be a number")
        return
    if (rate < 0).any():
        i = int(np.argmin(rate))
        faults.append(
            f"da/dN = {rate[i]} < 0 for dK_eq = {dK[i]}, R = {R[i]}: no crack shrinks; return inf "
            "where the toughness is reached"
        )
    if (rate[dK == 0] != 0).any():
        faults.append("da/dN is not 0 for dK_eq = 0: a crack without load would grow")
    scale = np.abs(rate[np.isfinite(rate)]).max(initial=0.0)
    table = rate.reshape(9, -1)
    n = table.shape[1]
    # inf to inf is no fall, inf to a number is one
    falls = table[1:] < np.where(np.isinf(table[:-1]), np.inf, table[:-1] - _ROUND_OFF * scale)
    if falls.any():
        i, j = np.argwhere(falls)[0]
        faults.append(
            f"da/dN falls when dK_eq grows from {dK[n * i]} to {dK[n * i + n]} at R = {R[j]}"
        )
    single_rates = [
        _call_law(law, (dK[i : i + 1], R[i : i + 1]), faults, "da/dN") for i in range(len(dK))
    ]
    if any(point_rate is None or point_rate.size != 1 for point_rate in single_rates):
        faults.append("for one point it does not return one rate")
        return
    point_rates = np.array([point_rate.reshape(-1)[0] for point_rate in single_rates])
    if not np.allclose(point_rates, rate, rtol=_ROUND_OFF, atol=0):
        faults.append(
            "a point alone gets another rate than among others: each must stand for itself"
        )


@check_arguments()
def check_criterion(
    criterion: Annotated[Criterion, Function("a function (K, nu) -> (angle, dK_eq, R)")],
    nu: Poisson = 0.3,
) -> None:
    """Try a direction criterion and say all that is wrong with it.

    Parameters
    ----------
    criterion : callable (K, nu) -> (angle, dK_eq, R)
        Called with K `(s, f, 2)` and `(s, f, 3)`; must return three arrays `(f,)`: finite, the
        range not negative, R in [0, 1]. Four times the load gives the same angle and four times
        the range; the opposite K_II (and K_III) gives the opposite angle; the order of the states
        does not matter; no load gives 0; K_I < 0 counts as 0.
    nu : float
        Poisson's ratio to try it with.

    Raises
    ------
    ProblemError
        With one line for each fault.

    Examples
    --------
    >>> from xcrack.fatigue.criteria import weighted_angle
    >>> check_criterion(weighted_angle)
    """
    faults: list[str] = []
    for modes in (2, 3):
        _check_modes(criterion, nu, modes, faults)
        if faults:
            break
    _judge("criterion", criterion, faults)


def _check_modes(criterion: Criterion, nu: float, modes: int, faults: list[str]) -> None:
    generator = np.random.default_rng(68712)
    K = generator.uniform(-0.4, 0.4, (3, 7, modes))
    K[..., 0] = generator.uniform(0.5, 1.5, (3, 7))
    first = _answer_of(criterion, K, nu, faults)
    if first is None:
        return
    angle, dK, R = first
    if (dK < 0).any():
        faults.append(f"dK_eq = {dK.min()} is negative")
    if (R < 0).any() or (R > 1).any():
        faults.append(f"R = {R} is not in [0, 1]")
    if (np.abs(angle) >= np.pi).any():
        faults.append(f"angle = {angle} is beyond ±π: it is in rad, positive towards the normal")
    mirror = np.array([1.0, -1.0, -1.0])[:modes]
    no_K = np.zeros_like(K)
    K_of_closed, negative_K = K.copy(), K.copy()
    K_of_closed[0, :, 0], negative_K[0, :, 0] = 0.0, -0.5
    at_closed = _answer_of(criterion, K_of_closed, nu, faults)
    same_modes = {
        "states in another order": (K[::-1], (angle, dK, R)),
        "four times the load": (4 * K, (angle, 4 * dK, R)),
        "K_II and K_III reversed": (K * mirror, (-angle, dK, R)),
        "front points in another order": (K[:, ::-1], (angle[::-1], dK[::-1], R[::-1])),
        "no load": (no_K, (0 * angle, 0 * dK, 0 * R)),
    }
    if at_closed is not None:
        same_modes["a state with K_I < 0 instead of 0"] = (negative_K, at_closed)
    for label, (changed_K, expected_answer) in same_modes.items():
        answer = _answer_of(criterion, changed_K, nu, faults)
        if answer is None:
            return
        for name, value, expected_value in zip(("angle", "dK_eq", "R"), answer, expected_answer):
            if not np.allclose(value, expected_value, rtol=_ROUND_OFF, atol=_ROUND_OFF):
                i = int(np.argmax(np.abs(value - expected_value)))
                faults.append(
                    f"{label}: {name} is {value[i]:.6g}, it should be {expected_value[i]:.6g}"
                )


def _answer_of(
    criterion: Criterion, K: Floats, nu: float, faults: list[str]
) -> tuple[Floats, Floats, Floats] | None:
    answer: Any = _call_law(lambda values: criterion(values, nu), (K,), faults, None)
    if answer is None:
        return None
    if not isinstance(answer, tuple) or len(answer) != 3:
        faults.append(f"it must return a tuple (angle, dK_eq, R), not {type(answer).__name__}")
        return None
    parts = []
    for name, part in zip(("angle", "dK_eq", "R"), answer):
        try:
            values = numbers(part, name, must_be_finite=False)
        except ProblemError as error:
            faults.append(str(error))
            return None
        if values.shape != (K.shape[1],) or not np.isfinite(values).all():
            faults.append(
                f"{name} for K of shape {K.shape} must be finite, of shape ({K.shape[1]},): "
                f"it is {values}, of shape {values.shape}"
            )
            return None
        parts.append(values)
    return parts[0], parts[1], parts[2]


def _call_law(
    function: Callable[..., Any], arguments: tuple[Floats, ...], faults: list[str], name: str | None
) -> Any:
    """Answer of a function that must neither fail nor change its arguments."""
    import warnings

    argument_copies = [np.array(a) for a in arguments]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            answer = function(*argument_copies)
        except Exception as error:
            shapes = ", ".join(str(a.shape) for a in arguments)
            faults.append(f"called with arrays of shape {shapes} it raises {value_text(error)}")
            return None
    if not all(np.array_equal(a, b) for a, b in zip(argument_copies, arguments)):
        faults.append("it changes the arrays it is given: work on a copy")
    if name is None:
        return answer
    try:
        return numbers(answer, name, must_be_finite=False)
    except ProblemError as error:
        faults.append(str(error))
        return None


def _judge(kind: str, function: object, faults: list[str]) -> None:
    if faults:
        name = getattr(function, "__name__", None) or value_text(function)
        raise ProblemError(
            f"the {kind} {name} cannot be used:\n- " + "\n- ".join(dict.fromkeys(faults))
        )


__all__ = ["check_criterion", "check_law"]
