"""Checks of friction where it is given: coefficients, and load states whose order counts."""

from collections.abc import Mapping, Sequence
from collections.abc import Set as AnySet
from numbers import Real
from typing import Any

import numpy as np

from xcrack.base.checks import entries, number, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.model.numerics import Numerics

_MOST = 1e3  # beyond, faces that press never slip


def friction_coefficients(
    value: Any, what: str, error: type[XcrackError]
) -> float | tuple[float, ...]:
    """Coefficients of friction, checked: one for all cracks, or one for each."""
    if isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return number(value, what, least=0, most=_MOST, error=error)
    wrong = f"{what} = {value_text(value)}: give a number, or a list of one a crack."
    if isinstance(value, AnySet):
        raise error(wrong)
    try:
        given = entries(value, what, error=error)
    except error:
        raise error(wrong) from None
    return tuple(
        number(mu, f"{what}[{c}]", least=0, most=_MOST, error=error) for c, mu in enumerate(given)
    )


def fitted_friction(
    friction: float | Sequence[float], n_cracks: int, dim: int, numerics: Numerics
) -> float | tuple[float, ...]:
    """Coefficients of the cracks of a problem.

    Parameters
    ----------
    friction : float, or sequence of one a crack
    n_cracks : int
    dim : int
    numerics : Numerics

    Raises
    ------
    ProblemError
        Another count than cracks, or a method without friction.
    """
    if isinstance(friction, Sequence):
        if len(friction) != n_cracks:
            raise ProblemError(
                f"Problem: friction = {value_text(list(friction))}: the problem has {n_cracks} "
                f"crack(s); give a number for all of them, or a list of one a crack."
            )
        if len(set(friction)) == 1:  # cracks that join in growth then need no numbers of their own
            friction = friction[0]
    if friction if isinstance(friction, float) else any(friction):
        _check_method(dim, numerics)
    return friction if isinstance(friction, float) else tuple(friction)


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


__all__ = ["check_order", "fitted_friction", "friction_coefficients"]
