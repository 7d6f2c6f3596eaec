"""What a run was asked to do, as text that can be stored and compared."""

import hashlib
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Any

import numpy as np

_LONG = 200  # a text longer than this is stored by its hash


def describe(name: str, value: Any) -> dict[str, str]:
    """Flat description of a value: the same text for the same settings, in any process.

    Arrays are described by a hash, functions by their code, their constants and what they close
    over, dataclasses field by field.

    Parameters
    ----------
    name : str
        Prefix of the keys.
    value : anything

    Returns
    -------
    dict of str to str

    Examples
    --------
    >>> describe("da", 0.5)
    {'da': '0.5'}
    """
    lines: dict[str, str] = {}
    _describe(name, value, lines, ())
    return lines


def differences(stored: Mapping[str, str], given: Mapping[str, str]) -> list[str]:
    """One line for each key in which two descriptions differ."""
    absent = "nothing"
    return [
        f"{key}: stored {stored.get(key, absent)}, given {given.get(key, absent)}"
        for key in sorted({*stored, *given})
        if stored.get(key, absent) != given.get(key, absent)
    ]


def _describe(name: str, value: Any, lines: dict[str, str], seen: tuple[int, ...]) -> None:
    if id(value) in seen:
        lines[name] = "itself"
        return
    inner = (*seen, id(value))
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str | bytes):
        text = repr(value)
        lines[name] = text if len(text) <= _LONG else f"{text[:40]}… {_hash(text.encode())}"
    elif isinstance(value, np.ndarray):
        content = np.ascontiguousarray(value)
        lines[name] = f"{value.dtype} {value.shape} {_hash(content.tobytes())}"
    elif isinstance(value, types.FunctionType):
        _function(name, value, lines, inner)
    elif isinstance(value, types.MethodType):
        _describe(name, value.__func__, lines, inner)
        _describe(f"{name}.self", value.__self__, lines, inner)
    elif isinstance(value, partial):
        _describe(name, value.func, lines, inner)
        _describe(f"{name}.args", value.args, lines, inner)
        _describe(f"{name}.keywords", value.keywords, lines, inner)
    elif isinstance(value, Mapping):
        lines[name] = f"{len(value)} entries"
        for key in value:
            _describe(f"{name}[{key!r}]", value[key], lines, inner)
    elif isinstance(value, tuple | list):
        lines[name] = f"{len(value)} entries"
        for i, item in enumerate(value):
            _describe(f"{name}[{i}]", item, lines, inner)
    elif isinstance(value, type | types.BuiltinFunctionType | types.ModuleType | np.ufunc):
        lines[name] = str(getattr(value, "__qualname__", getattr(value, "__name__", value)))
    elif is_dataclass(value):
        lines[name] = type(value).__qualname__
        for item in fields(value):
            _describe(f"{name}.{item.name}", getattr(value, item.name), lines, inner)
    else:
        lines[name] = type(value).__qualname__
        for key, item in sorted(getattr(value, "__dict__", {}).items()):
            _describe(f"{name}.{key}", item, lines, inner)


def _function(
    name: str, function: types.FunctionType, lines: dict[str, str], seen: tuple[int, ...]
) -> None:
    code = function.__code__
    lines[name] = f"{function.__qualname__} {_hash(_code(code))}"
    for key, cell in zip(code.co_freevars, function.__closure__ or ()):
        _describe(f"{name}.{key}", cell.cell_contents, lines, seen)
    if function.__defaults__:
        _describe(f"{name}.defaults", function.__defaults__, lines, seen)
    if function.__kwdefaults__:
        _describe(f"{name}.defaults by name", function.__kwdefaults__, lines, seen)
    for key in code.co_names:  # constants of the user's script, such as a stress
        used = function.__globals__.get(key)
        if isinstance(used, bool | int | float | str | np.ndarray | np.generic | tuple):
            _describe(f"{name}.{key}", used, lines, seen)


def _code(code: types.CodeType) -> bytes:
    """Bytes that change with what a function does, but not with where it stands."""
    parts = [code.co_code, repr(code.co_names).encode()]
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            parts.append(_code(constant))
        elif isinstance(constant, frozenset):  # its order is another one in each process
            parts.append(repr(sorted(map(repr, constant))).encode())
        else:
            parts.append(repr(constant).encode())
    return b"\0".join(parts)


def _hash(data: bytes) -> str:
    return "sha256:" + hashlib.sha256(data).hexdigest()[:16]


__all__ = ["describe", "differences"]
