"""Checks of numbers, arrays and words where users give them, and calls of users' functions."""

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING
from functools import cache
from math import isfinite
from numbers import Real
from typing import Any, TypeVar

import numpy as np

from xcrack.base.arrays import Floats, Ints, Shape, has_shape
from xcrack.base.errors import MeshError, ProblemError, XcrackError

T = TypeVar("T")

LARGEST = 1e90  # coordinate whose third power is still a number


def number(
    value: Any,
    label: str,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    error: type[XcrackError] = ProblemError,
) -> float:
    """Check that a value is one finite real number, and return it.

    Parameters
    ----------
    value : anything
    label : str
        Its name in the message, such as ``"paris: C"``.
    above, least, below, most : float, optional
        Bounds: exclusive from below, inclusive, exclusive from above, inclusive.
    error : type of XcrackError

    Returns
    -------
    float

    Raises
    ------
    error
        It is a bool, a string, complex, an array, nan, infinite or out of bounds.

    Examples
    --------
    >>> number(3, "paris: m", above=0)
    3.0
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        expectation = "a finite number" + _bounds(above, least, below, most)
        raise error(f"{label} = {value_text(value)} is not a number: give {expectation}.")
    try:
        result = float(value)
    except OverflowError:
        result = np.inf
    if not (
        isfinite(result)
        and (above is None or result > above)
        and (least is None or result >= least)
        and (below is None or result < below)
        and (most is None or result <= most)
    ):
        expectation = "a finite number" + _bounds(above, least, below, most)
        raise error(f"{label} = {value_text(value)} is not possible: give {expectation}.")
    return result


def whole_number(
    value: Any,
    label: str,
    *,
    least: int | None = None,
    most: int | None = None,
    error: type[XcrackError] = ProblemError,
) -> int:
    """Check that a value is a whole number, and return it; 3.0 counts, 2.5 and True do not.

    Parameters
    ----------
    value, label, error
        As of `number`.
    least, most : int, optional
        Inclusive bounds.

    Returns
    -------
    int

    Raises
    ------
    error
        It is not a whole number, or out of bounds.

    Examples
    --------
    >>> whole_number(4, "box: n", least=1)
    4
    """
    if type(value) is int and abs(value) < 2**63:
        if (least is None or value >= least) and (most is None or value <= most):
            return value
    expectation = "a whole number" + _bounds(None, least, None, most)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise error(f"{label} = {value_text(value)} is not a number: give {expectation}.")
    try:
        result = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        as_float = float(value)
        if not as_float.is_integer():  # nan and inf are not either
            raise error(
                f"{label} = {value_text(value)} is not possible: give {expectation}."
            ) from None
        result = int(as_float)
    if (least is not None and result < least) or (most is not None and result > most):
        raise error(f"{label} = {value_text(value)} is not possible: give {expectation}.")
    if abs(result) >= 2**63:
        raise error(
            f"{label} = {value_text(value)} is too large to count with: give {expectation}."
        )
    return result


def numbers(
    value: Any,
    label: str,
    shape: Shape | None = None,
    *,
    must_be_finite: bool = True,
    error: type[XcrackError] = ProblemError,
) -> Floats:
    """Check that a value is an array of real numbers of a shape, and return it.

    Parameters
    ----------
    value : anything
    label : str
        Its name in the message.
    shape : tuple of int or None, optional
        Wanted shape, None where any length will do; any shape if omitted.
    must_be_finite : bool
        Refuse nan and infinite entries.
    error : type of XcrackError

    Returns
    -------
    array of float
        Of the given shape; it may share memory with `value`.

    Raises
    ------
    error
        Ragged rows, strings, objects, None, complex or masked entries, another shape, or entries
        that are not finite; the message names the first of these.

    Examples
    --------
    >>> numbers([(0, 1), (2, 3)], "points", (None, 2))
    array([[0., 1.],
           [2., 3.]])
    """
    if (
        type(value) is not np.ndarray
        or value.dtype != np.float64
        or not has_shape(value.shape, shape)
    ):
        expectation = "an array of real numbers" + _of_shape(shape)
        value = _real_array(value, label, expectation, error).astype(np.float64, copy=False)
        _check_shape(value, label, shape, expectation, error)
    result: Floats = value
    if must_be_finite and not np.isfinite(result).all():
        index = np.unravel_index(int(np.argmin(np.isfinite(result))), result.shape)
        place = "" if result.ndim == 0 else f"[{', '.join(str(int(i)) for i in index)}]"
        raise error(f"{label}{place} = {result[index]}: every number must be finite.")
    return result


def point_coordinates(
    value: Any, label: str, shape: Shape | None = None, *, error: type[XcrackError] = MeshError
) -> Floats:
    """Check that a value is an array of finite coordinates, small enough to compute with.

    Parameters
    ----------
    value, what, shape, error
        As of `numbers`.

    Returns
    -------
    array of float
    """
    x = numbers(value, label, shape, error=error)
    if x.size and np.abs(x).max() > LARGEST:
        raise error(
            f"{label}: coordinates of up to {np.abs(x).max():.3g} are too large to compute with "
            "their powers; take another unit of length."
        )
    return x


def whole_numbers(
    value: Any,
    label: str,
    shape: Shape | None = None,
    *,
    error: type[XcrackError] = ProblemError,
) -> Ints:
    """Check that a value is an array of whole numbers of a shape, and return it.

    Parameters
    ----------
    value, what, shape, error
        As of `numbers`.

    Returns
    -------
    array of int64

    Raises
    ------
    error
        As of `numbers`, or an entry that is not whole.

    Examples
    --------
    >>> whole_numbers([(0, 1, 2)], "cells", (None, 3))
    array([[0, 1, 2]])
    """
    if type(value) is np.ndarray and value.dtype == np.int64 and has_shape(value.shape, shape):
        return value
    expectation = "an array of whole numbers" + _of_shape(shape)
    result = _real_array(value, label, expectation, error)
    _check_shape(result, label, shape, expectation, error)
    if result.dtype.kind == "f":
        result = result.astype(np.float64, copy=False)  # a half float ends at 65504
        is_no_integer = ~(
            np.isfinite(result) & (result == np.round(result)) & (np.abs(result) < 2**53)
        )
        if is_no_integer.any():
            raise error(f"{label} holds {result[is_no_integer].flat[0]}: give {expectation}.")
    return result.astype(np.int64, copy=False)


def one_of(
    value: Any, label: str, words: Sequence[str], *, error: type[XcrackError] = ProblemError
) -> str:
    """Check that a value is one of some words, and return it.

    Parameters
    ----------
    value, label, error
        As of `number`.
    words : sequence of str

    Returns
    -------
    str

    Raises
    ------
    error
        It is another word, or no text.

    Examples
    --------
    >>> one_of("on", "contact", ("auto", "on", "off"))
    'on'
    """
    if not isinstance(value, str) or value not in words:
        choices = " or ".join([", ".join(f'"{word}"' for word in words[:-1]), f'"{words[-1]}"'])
        raise error(f"{label} = {value_text(value)} is not known: give {choices}.")
    return value


def flag(value: Any, label: str, *, error: type[XcrackError] = ProblemError) -> bool:
    """Check that a value is True or False, and return it; 1 and "no" are neither.

    Parameters
    ----------
    value, label, error
        As of `number`.

    Returns
    -------
    bool

    Raises
    ------
    error
        It is neither.

    Examples
    --------
    >>> flag(False, "plot: edges")
    False
    """
    if not isinstance(value, bool | np.bool_):
        raise error(f"{label} = {value_text(value)}: give True or False.")
    return bool(value)


def entries(value: Any, label: str, *, error: type[XcrackError] = ProblemError) -> tuple[Any, ...]:
    """Entries of a list, tuple or whatever else can be gone through, but for text and mappings.

    Parameters
    ----------
    value, label, error
        As of `number`.

    Returns
    -------
    tuple

    Raises
    ------
    error
        It cannot be gone through.
    """
    try:
        items = None if isinstance(value, str | bytes | bytearray | Mapping) else iter(value)
    except Exception:  # whatever an object's own __iter__ raises
        items = None
    if items is None:
        raise error(f"{label} = {value_text(value)}: give a list.")
    return tuple(items)


def build_without_checks(kind: type[T], **fields: Any) -> T:
    """A frozen dataclass of fields that are sound by their making: none is checked.

    Parameters
    ----------
    kind : dataclass
    **fields
        In the form in which it keeps them; others have their defaults.
    """
    result: T = object.__new__(kind)
    values = vars(result)
    for name, part in kind.__dataclass_fields__.items():  # type: ignore[attr-defined]
        if name in fields:
            values[name] = fields[name]
        else:
            values[name] = part.default if part.default is not MISSING else part.default_factory()
    return result


def copy_without_checks(value: T, **fields: Any) -> T:
    """A frozen dataclass with other fields, that are sound by their making: none is checked again.

    Parameters
    ----------
    value : dataclass
    **fields
        Of its fields, in the form in which it keeps them.
    """
    result: T = object.__new__(type(value))
    values = vars(value)
    vars(result).update({name: values[name] for name in type(value).__dataclass_fields__} | fields)  # type: ignore[attr-defined]
    return result


def value_text(value: Any) -> str:
    """A value in a message: one short line, whatever it is.

    Parameters
    ----------
    value : anything

    Returns
    -------
    str

    Examples
    --------
    >>> value_text([1.5, None])
    '[1.5, None]'
    """
    if type(value) is str and len(value) < 60 and value.isidentifier():
        return repr(value)
    try:
        text = re.sub(r"\barray\((.*?)(, dtype=\w+)?\)", r"\1", " ".join(repr(value).split()))
    except Exception:
        text = object.__repr__(value)
    return text if len(text) <= 80 else f"{text[:60]} … ({type(value).__name__})"


def call_function(function: Callable[..., Any], label: str, *arguments: Any) -> Any:
    """Call a user's function; an exception in it keeps its type and says where it was called.

    Parameters
    ----------
    function : callable
    label : str
        What xcrack needed it for, such as ``"the value of traction('top')"``.
    *arguments
        Passed on.
    """
    try:
        return function(*arguments)
    except Exception as error:
        name = getattr(function, "__qualname__", None) or repr(function)
        error.add_note(f"raised in {name}, which xcrack called for {label}.")
        raise


def _real_array(value: Any, label: str, expectation: str, error: type[XcrackError]) -> Any:
    if isinstance(value, np.ma.MaskedArray):
        if np.ma.getmaskarray(value).any():
            raise error(f"{label} has masked entries: give {expectation}, without a mask.")
        value = value.data
    if isinstance(value, bytes | bytearray):  # numpy takes the second for numbers
        raise error(f"{label} = {value_text(value)} is text: give {expectation}.")
    try:
        result = np.asarray(value)
    except Exception as cause:  # ragged rows, or whatever an object's own __array__ raises
        raise error(f"{label} = {value_text(value)}: give {expectation} ({cause}).") from cause
    if result.size == 0 and result.dtype.kind in "Of":
        return result.astype(float)
    if result.dtype.kind not in "iuf":
        kind = {"c": "complex", "b": "bool", "U": "str", "S": "bytes"}.get(
            result.dtype.kind, str(result.dtype)
        )
        raise error(f"{label} = {value_text(value)} holds {kind} entries: give {expectation}.")
    return result


def _check_shape(
    result: Any, label: str, shape: Shape | None, expectation: str, error: type[XcrackError]
) -> None:
    if not has_shape(result.shape, shape):
        raise error(f"{label} has the shape {result.shape}: give {expectation}.")


@cache
def _of_shape(shape: Shape | None) -> str:
    if shape is None:
        return ""
    sides = ", ".join("n" if side is None else str(side) for side in shape)
    return f" of shape ({sides}{',' if len(shape) == 1 else ''})"


def _bounds(
    above: float | None, least: float | None, below: float | None, most: float | None
) -> str:
    lower_bound = f"above {above:g}" if above is not None else ""
    lower_bound = f"of at least {least:g}" if least is not None else lower_bound
    upper_bound = f"below {below:g}" if below is not None else ""
    upper_bound = f"of at most {most:g}" if most is not None else upper_bound
    text = " and ".join(part for part in (lower_bound, upper_bound) if part)
    return f" {text}" if text else ""


def values_by_set(
    entry: Any, label: str, values: str, maker: str, value: str, is_value: Callable[[Any], bool]
) -> tuple[tuple[str, Any], ...]:
    """Check a mapping from names of cell sets to values, and return its pairs.

    Parameters
    ----------
    entry : mapping, or tuple of pairs
    label : str
        What the values are of, in messages.
    values, value : str
        What they are, and how one is given.
    maker : str
        A function that makes one.
    is_value : callable

    Raises
    ------
    ProblemError
        No mapping of names to values.
    """
    pairs = entry.items() if isinstance(entry, Mapping) else entry
    if not isinstance(entry, Mapping | tuple) or not pairs:
        raise ProblemError(
            f"{label}: {value_text(entry)}: give a mapping of cell sets to {values}, such as "
            f'{{"plate": {maker}(...), "weld": {maker}(...)}}.'
        )
    for name, v in pairs:
        if not isinstance(name, str) or not is_value(v):
            raise ProblemError(
                f"{label}: {value_text(name)}: {value_text(v)}: give the name of a cell set, and "
                f"{value}."
            )
    return tuple(pairs)


def check_set_names(
    set_names: Sequence[str], names: Sequence[str], label: str, values: str, value: str
) -> None:
    """Raise where values are for other cell sets than the materials of a problem have.

    Parameters
    ----------
    set_names, names : sequence of str
        Sets that have a value, and those of the materials.
    what, values, value : str
        As of `values_by_set`.

    Raises
    ------
    ProblemError
        A material without a value, or a value without a material.
    """
    if sorted(set_names) != sorted(names):
        listing = ", ".join(map(repr, names)) if names[0] else "one, without a name"
        raise ProblemError(
            f"{label}: there are {values} for {', '.join(map(repr, set_names))}, and the materials "
            f"of the problem are {listing}: give each of them {value}."
        )


__all__ = [
    "call_function",
    "check_set_names",
    "entries",
    "flag",
    "number",
    "numbers",
    "one_of",
    "value_text",
    "values_by_set",
    "whole_number",
    "whole_numbers",
]
