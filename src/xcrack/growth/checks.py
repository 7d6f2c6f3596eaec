"""Evaluate criteria and laws, and validate what they return."""

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.growth.criteria import Criterion
from xcrack.growth.laws import Law


def directed(
    criterion: Criterion, K: Floats, nu: float, crack: int
) -> tuple[Floats, Floats, Floats]:
    """Angle, range and ratio of one crack by a criterion, checked."""
    n = K.shape[1]
    if n == 0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    answer = criterion(K, nu)
    try:
        angle, dK_eq, R = (np.asarray(part, dtype=float) for part in answer)
    except (TypeError, ValueError) as error:
        raise ProblemError(
            f"the criterion must return three arrays (angle, dK_eq, R), not {answer!r}."
        ) from error
    for name, values in (("angle", angle), ("dK_eq", dK_eq), ("R", R)):
        if values.shape != (n,) or not np.isfinite(values).all():
            raise ProblemError(
                f"the criterion returned {name} = {values} at the {n} tips (or places along "
                f"fronts) of crack {crack}; it must be finite, one number each. "
                "xcrack.testing.check_criterion tries it."
            )
    if (dK_eq < 0).any():
        raise ProblemError(f"the criterion returned a negative range {dK_eq} at crack {crack}.")
    return angle, dK_eq, R


def law_rate(law: Law, dK_eq: Floats, R: Floats, crack: int) -> Floats:
    """Growth rates of one crack by a law, checked."""
    if len(dK_eq) == 0:
        return np.zeros(0)
    rate = np.asarray(law(dK_eq, R), dtype=float)
    if rate.shape != dK_eq.shape:
        raise ProblemError(
            f"the law returned shape {rate.shape} for {len(dK_eq)} tips or places along "
            "fronts; it must return one rate for each. xcrack.testing.check_law tells what is "
            "wrong."
        )
    bad = ~(np.isfinite(rate) & (rate >= 0))
    if bad.any():
        tip = int(np.argmax(bad))
        raise ProblemError(
            f"the law returned da/dN = {rate[tip]} for dK_eq = {dK_eq[tip]:.6g}, R = {R[tip]:.6g} "
            f"(crack {crack}, tip {tip}); a crack does not shrink: return a number >= 0."
        )
    return rate
