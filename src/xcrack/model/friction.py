"""Checks of friction where it is given: coefficients, and load states whose order counts."""

from collections.abc import Mapping, Sequence
from collections.abc import Set as AnySet
from numbers import Real
from typing import Any

import numpy as np

from xcrack.base.checks import entries, number, value_text
from xcrack.base.errors import ProblemError
from xcrack.model.numerics import Numerics

_MOST = 1e3  # beyond, faces that press never slip


def checked_friction(
    value: Any, n_cracks: int, dim: int, numerics: Numerics
) -> float | tuple[float, ...]:
    """Coefficients of friction: one for all cracks, or one for each.

    Parameters
    ----------
    value : anything
    n_cracks : int
    dim : int
    numerics : Numerics

    Raises
    ------
    ProblemError
        Not numbers from 0 to 1000, another count than cracks, or a method without friction.
    """
    if isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0):
        result: float | tuple[float, ...] = number(value, "friction", least=0, most=_MOST)
        acts = bool(result)
    else:
        wrong = f"friction = {value_text(value)}: give a number, or a list of one a crack."
        if isinstance(value, AnySet):
            raise ProblemError(wrong)
        try:
            given = entries(value, "friction")
        except ProblemError:
            raise ProblemError(wrong) from None
        if len(given) != n_cracks:
            raise ProblemError(
                f"friction = {value_text(value)}: the problem has {n_cracks} crack(s); give a "
                f"number for all of them, or a list of one a crack."
            )
        result = tuple(
            number(mu, f"friction[{c}]", least=0, most=_MOST) for c, mu in enumerate(given)
        )
        acts = any(mu > 0 for mu in result)
        if len(set(result)) == 1:  # cracks that join in growth then need no numbers of their own
            result = result[0]
    if acts:
        _check_method(dim, numerics)
    return result


def _check_method(dim: int, numerics: Numerics) -> None:
    method = numerics.contact_method
    if method is not None and dim not in method.friction_dims:
        raise ProblemError(
            f"friction in {dim}D with {method.label}: multipliers carry it; leave contact_method "
            "out, or give friction=0."
        )


def check_order(frictions: Sequence[float], states: Any) -> None:
    """Raise where states without an order are given to a problem with friction.

    Parameters
    ----------
    frictions : sequence of float
        Of each crack.
    states : anything
    """
    if any(frictions) and isinstance(states, AnySet | Mapping):
        raise ProblemError(
            f"states = {value_text(states)} with friction: each state is reached from the one "
            f"before it, and a set or dict has no order: give a list."
        )


__all__ = ["check_order", "checked_friction"]
