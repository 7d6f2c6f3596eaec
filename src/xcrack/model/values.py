"""Values over a body: numbers, or functions of the place."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType
from typing import Any

import numpy as np

from xcrack.base.arguments import Error, Rule, Unit
from xcrack.base.arrays import Floats, frozen_copy
from xcrack.base.checks import call_function, number, numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import NUMBER


@dataclass(frozen=True)
class VectorField(Rule):
    """A vector, or a function f(x) or f(x, normal) of points.

    Where it `may_be_free` an entry may be None, or a function f(x) of its own.
    """

    unit: Unit = NUMBER
    may_be_free: bool = False
    is_vector = True

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The function, a read-only vector, or a tuple with None."""
        if callable(value):
            return value
        is_sequence = self.may_be_free and isinstance(value, list | tuple)
        if is_sequence and len(value) in (2, 3) and all(v is None for v in value):
            raise error(f"{label} = {value_text(value)}: give a number in one direction or more.")
        if is_sequence and any(v is None or callable(v) for v in value) and len(value) in (2, 3):
            return tuple(
                v if v is None or callable(v) else number(v, f"{label}[{i}]", error=error)
                for i, v in enumerate(value)
            )
        vector = numbers(value, label, (None,), error=error)
        if len(vector) not in (2, 3):
            raise error(
                f"{label} = {value_text(value)}: give a vector of 2 or 3 numbers, or a function."
            )
        return frozen_copy(vector)


@dataclass(frozen=True)
class ScalarField(Rule):
    """A number, or a function f(x) of points."""

    unit: Unit = NUMBER

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The function, or the number as float."""
        return value if callable(value) else number(value, label, error=error)


@dataclass(frozen=True)
class StressField(Rule):
    """A symmetric stress, or a function f(x) of points."""

    unit: Unit = NUMBER
    is_vector = True

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The function, or a read-only matrix."""
        if callable(value):
            return value
        sigma = numbers(value, label, (None, None), error=error)
        if sigma.shape not in ((2, 2), (3, 3)):
            raise error(f"{label} has the shape {sigma.shape}: give (2, 2) or (3, 3).")
        if not np.allclose(sigma, sigma.T):
            raise error(f"{label}: {sigma.tolist()} is not symmetric: give a stress.")
        return frozen_copy(sigma)


@dataclass(frozen=True)
class Place(Rule):
    """The name of a facet set, a point, or several points."""

    unit: Unit = NUMBER
    is_vector = True
    takes_names = True

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The name, or read-only points."""
        if isinstance(value, str):
            return value
        shape = (None, None) if np.ndim(_as_array(value)) == 2 else (None,)
        try:
            return frozen_copy(numbers(value, label, shape, error=error))
        except error as cause:
            raise error(f"{cause} Or give the name of a facet set.") from None


@dataclass(frozen=True)
class PointRows(Rule):
    """A point or vector of two or three numbers, or rows of them; kept read-only."""

    unit: Unit = NUMBER
    is_vector = True

    def check(self, value: Any, label: str, error: Error) -> Any:
        """A read-only copy."""
        shape = (None, None) if np.ndim(_as_array(value)) == 2 else (None,)
        rows = numbers(value, label, shape, error=error)
        if rows.shape[-1] not in (2, 3) or not len(rows):
            raise error(f"{label} = {value_text(value)}: give 2 or 3 numbers, or rows of them.")
        return frozen_copy(rows)


def _as_array(value: Any) -> Any:
    """A value as an array, where it is one: ragged lists and the like are looked at later."""
    try:
        return np.asarray(value)
    except Exception:  # whatever an object's own __array__ raises
        return None


@dataclass(frozen=True)
class SetName(Rule):
    """The name of a facet set."""

    def check(self, value: Any, label: str, error: Error) -> str:
        """The name."""
        if not isinstance(value, str):
            raise error(f"{label} = {value_text(value)}: give the name of a facet set.")
        return value


def vector_at(value: Any, x: Floats, label: str, normal: Floats | None = None) -> Floats:
    """A vector, f(x) or f(x, normal) at points `(n, d)`, checked; nan where an entry is None.

    Raises
    ------
    ProblemError
        Another shape, or values that are not finite.
    """
    n, d = x.shape
    if isinstance(value, tuple):
        columns = [
            np.full(n, np.nan) if entry is None else scalar_at(entry, x, label) for entry in value
        ]
        return np.stack(columns, axis=1)
    if callable(value):
        takes_normal = normal is not None and _n_positional(value) >= 2
        arguments = (x, normal) if takes_normal else (x,)
        result = _real_values(call_function(value, f"the value of {label}", *arguments), label)
    else:
        result = numbers(value, label)
    if result.shape == (d,):
        result = np.broadcast_to(result, (n, d))
    if result.shape != (n, d):
        raise ProblemError(
            f"{label}: the value has shape {result.shape}, wanted {(n, d)} for {n} points in "
            f"{d} dimensions; give a vector of length {d} or a function that returns (n, {d})."
        )
    _check_finite(result, x, label)
    return result


def scalar_at(value: Any, x: Floats, label: str) -> Floats:
    """A number or f(x) at points `(n, d)`, checked `(n,)`.

    Raises
    ------
    ProblemError
        Another shape, or values that are not finite.
    """
    if callable(value):
        values = _real_values(call_function(value, f"the value of {label}", x), label)
    else:
        values = numbers(value, label)
    if values.shape not in ((), (len(x),)):
        raise ProblemError(
            f"{label}: the value has shape {values.shape}, wanted {(len(x),)}; give a number or a "
            "function that returns (n,)."
        )
    result = np.broadcast_to(values, (len(x),))
    _check_finite(result, x, label)
    return result


def stress_at(value: Any, x: Floats, label: str) -> Floats:
    """A stress or f(x) at points `(n, d)`, checked `(n, d, d)`.

    Raises
    ------
    ProblemError
        Another shape, values that are not finite or not symmetric.
    """
    d = x.shape[1]
    if callable(value):
        result = _real_values(call_function(value, f"the value of {label}", x), label)
    else:
        result = numbers(value, label)
    if result.shape not in ((d, d), (len(x), d, d)):
        raise ProblemError(
            f"{label}: the value has shape {result.shape}, wanted {(len(x), d, d)} for {len(x)} "
            f"points in {d} dimensions."
        )
    result = np.broadcast_to(result, (len(x), d, d))
    _check_finite(result, x, label)
    asymmetry = np.abs(result - np.swapaxes(result, 1, 2)).max(axis=(1, 2), initial=0)
    if (asymmetry > 1e-8 * np.abs(result).max(initial=0.0)).any():
        row = int(np.argmax(asymmetry))
        raise ProblemError(
            f"{label}: the value at {np.round(x[row], 9).tolist()} is "
            f"{result[row].tolist()}: a stress must be symmetric."
        )
    return result


def _real_values(result: Any, label: str) -> Floats:
    """What a function returned: an array of real numbers; others are looked for later."""
    return numbers(result, f"{label}: the returned value", must_be_finite=False)


def _check_finite(result: Floats, x: Floats, label: str) -> None:
    is_infinite = ~np.isfinite(result).reshape(len(x), int(np.prod(result.shape[1:]))).all(axis=1)
    if is_infinite.any():
        point = x[np.argmax(is_infinite)]
        raise ProblemError(
            f"{label}: the value at {np.round(point, 9).tolist()} is "
            f"{result[np.argmax(is_infinite)].tolist()}: every value must be finite."
        )


def _n_positional(function: Callable[..., Any]) -> int:
    if isinstance(function, FunctionType) and not hasattr(function, "__wrapped__"):
        code = function.__code__  # what inspect finds out at a hundred times the cost
        if code.co_flags & inspect.CO_VARARGS:
            return 2
        return code.co_argcount - len(function.__defaults__ or ())
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return 1
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if any(p.kind == inspect.Parameter.VAR_POSITIONAL for p in parameters):
        return 2
    return sum(p.kind in kinds and p.default is inspect.Parameter.empty for p in parameters)


__all__ = [
    "Place",
    "PointRows",
    "ScalarField",
    "SetName",
    "StressField",
    "VectorField",
    "scalar_at",
    "stress_at",
    "vector_at",
]
