"""Evaluate criteria and laws, and validate what they return."""

from functools import partial
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import NEEDS, Law, LawSets, Names, largest_K

_NEAR = 1e-3  # change of ln(range) over which the slope of a law is taken
_USUAL, _EXPONENTS = 3.0, (1.0, 20.0)
_RATIOS = (0.0, 0.5)  # a law that gives the same rate for both does not depend on R


def evaluate_criterion(
    criterion: Criterion, K: Floats, nu: float | Floats, crack: int, place: str = "tip"
) -> tuple[Floats, Floats, Floats]:
    """Angle, range and ratio at each place of one crack.

    Parameters
    ----------
    criterion : callable
    K : (s, f, 2 or 3) array, stress √length
    nu : float or (f,) array
        An array asks the criterion once for each of its values.
    crack : int
        Its number, for messages.
    place : str
        What a point of a front is called in messages.

    Returns
    -------
    angle, dK_eq, R : (f,) arrays

    Raises
    ------
    ProblemError
        The criterion does not return three arrays of finite numbers, one for each place; an angle
        is no kink, a range is negative.
    """
    n = K.shape[1]
    if n == 0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    if isinstance(nu, np.ndarray):
        values = np.empty((3, n))
        for value in np.unique(nu).tolist():
            rows = nu == value
            values[:, rows] = evaluate_criterion(criterion, K[:, rows], value, crack, place)
        return values[0], values[1], values[2]
    result = call_function(criterion, f"the directions of crack {crack}", K.copy(), nu)
    try:
        parts = tuple(result)
    except Exception:  # whatever an object's own __iter__ raises
        parts = ()
    if len(parts) != 3 or isinstance(result, str):
        raise ProblemError(
            f"the criterion must return three arrays (angle, dK_eq, R), not {value_text(result)}."
        )
    angle, dK_eq, R = (
        _one_a_place(part, name, n, f"{place}s of crack {crack}")
        for name, part in zip(("angle", "dK_eq", "R"), parts)
    )
    if (np.abs(angle) >= np.pi).any():
        j = int(np.argmax(np.abs(angle)))
        raise ProblemError(
            f"the criterion returned the angle {angle[j]:.6g} (crack {crack}, {place} {j}): angles "
            "are in rad, between -pi and pi, from straight ahead towards the crack normal; for "
            "degrees use numpy.radians."
        )
    if (dK_eq < 0).any():
        raise ProblemError(f"the criterion returned a negative range {dK_eq} at crack {crack}.")
    return angle, dK_eq, R


def _one_a_place(part: Any, name: str, n: int, places: str) -> Floats:
    try:
        return np.array(numbers(part, name, (n,)))
    except ProblemError as error:
        raise ProblemError(
            f"the criterion must return three arrays (angle, dK_eq, R), each with one finite "
            f"number for each of the {n} {places}: {error} "
            "xcrack.testing.check_criterion tries it."
        ) from error


def evaluate_law(
    law: Law | LawSets,
    dK_eq: Floats,
    R: Floats,
    crack: int,
    place: str = "tip",
    a: Floats | None = None,
    material: Names | None = None,
) -> Floats:
    """Growth a cycle at each place of one crack.

    Parameters
    ----------
    law : callable, or LawSets
    dK_eq, R : (f,) arrays
    crack : int
        Its number, for messages.
    place : str
        What a point of a front is called in messages.
    a : (f,) array, optional, length
        Crack size at each place, for a law that asks for it.
    material : (f,) array of str, optional
        Names of the materials there, for laws by material; without it the fastest counts.

    Returns
    -------
    (f,) array, length/cycle
        inf where the law says that the toughness is reached.

    Raises
    ------
    ProblemError
        The law does not return one number >= 0 for each place.
    """
    if len(dK_eq) == 0:
        return np.zeros(0)
    if isinstance(law, LawSets):
        rate = np.zeros(len(dK_eq))
        for name, part in law.laws:
            rows = np.arange(len(dK_eq)) if material is None else np.nonzero(material == name)[0]
            size = None if a is None else a[rows]
            of_part = evaluate_law(part, dK_eq[rows], R[rows], crack, place, size)
            rate[rows] = np.maximum(rate[rows], of_part)
        return rate
    arguments = law_needs(law, dK_eq, R, a)
    result = call_function(
        partial(law, **arguments), f"the growth rates of crack {crack}", dK_eq.copy(), R.copy()
    )
    rate = np.array(numbers(result, "the growth rate that the law returned", must_be_finite=False))
    if rate.shape != dK_eq.shape:
        raise ProblemError(
            f"the law returned shape {rate.shape} for {len(dK_eq)} {place}s; it must return one "
            "rate for each. xcrack.testing.check_law shows what is wrong."
        )
    is_invalid = ~(rate >= 0)
    if is_invalid.any():
        j = int(np.argmax(is_invalid))
        raise ProblemError(
            f"the law returned da/dN = {rate[j]} for dK_eq = {dK_eq[j]:.6g}, R = {R[j]:.6g} "
            f"(crack {crack}, {place} {j}); a crack does not shrink: return a number >= 0, and inf "
            "where the toughness is reached, which ends the run."
        )
    return rate


def law_needs(law: Law, dK_eq: Floats, R: Floats, a: Floats | None) -> dict[str, Floats]:
    """What a law asks for by name beside the range and R: ``needs`` says it.

    Raises
    ------
    ProblemError
        It asks for something that there is not.
    """
    needs = getattr(law, "needs", ())
    unknown_names = [name for name in needs if name not in NEEDS]
    if unknown_names:
        raise ProblemError(f"the law needs {unknown_names}: it can be given {', '.join(NEEDS)}.")
    values: dict[str, Floats] = {}
    if "a" in needs:
        values["a"] = np.ones(len(dK_eq)) if a is None else a.copy()
    if "K_max" in needs:
        values["K_max"] = largest_K(dK_eq, R)
    return values


def depends_on_ratio(law: Law | LawSets, dK_eq: Floats) -> bool:
    """Whether a law gives other rates for other ratios R at these ranges `(f,)`."""
    rate_0, rate_1 = (evaluate_law(law, dK_eq, np.full(len(dK_eq), ratio), 0) for ratio in _RATIOS)
    return not np.array_equal(rate_0, rate_1)


def law_exponent(
    law: Law | LawSets, dK_eq: Floats, R: Floats, material: Names | None = None
) -> float:
    """Slope of ln(rate) over ln(range) of a law at its largest range, in [1, 20]; 3 if unknown.

    Parameters
    ----------
    law : callable, or LawSets
    dK_eq, R : (f,) arrays
    material : (f,) array of str, optional
        As of `evaluate_law`.
    """
    if not len(dK_eq) or dK_eq.max() <= 0:
        return _USUAL
    j = int(np.argmax(dK_eq))
    ranges = dK_eq[j] * np.exp(np.array([-_NEAR, _NEAR]))
    names = None if material is None else material[[j, j]]
    rate = evaluate_law(law, ranges, np.full(2, R[j]), 0, material=names)
    if not (np.isfinite(rate).all() and (rate > 0).all()):
        return _USUAL
    return float(np.clip(np.log(rate[1] / rate[0]) / (2 * _NEAR), *_EXPONENTS))


__all__ = ["depends_on_ratio", "evaluate_criterion", "evaluate_law", "law_exponent", "law_needs"]
