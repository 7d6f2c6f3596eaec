"""What a run was asked to do, as text that can be stored and compared.

Fields of xcrack's own dataclasses are left out where they have their default, so that a field added
later leaves the description of an older run as it was. The number of the set of defaults stands for
all that was left out.
"""

import hashlib
import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

_LONG = 200  # a text longer than this is stored by its hash
_OWN = "xcrack."

# Number of the set of defaults: raised whenever a changed default changes results.
DEFAULTS = 1
# For each set from 2 on, the defaults that it replaced: {2: {"problem.numerics.points": 4}}.
REPLACED: dict[int, dict[str, Any]] = {}

Settings = TypeVar("Settings")


def describe(name: str, value: Any, number: int | None = None) -> dict[str, str]:
    """Flat description of a value: the same text for the same settings, in any process.

    Arrays are described by a hash, functions of xcrack by their name, those of the user by their
    code, their constants and what they close over, dataclasses field by field. Fields whose
    metadata say ``changes_results=False`` are never described.

    Parameters
    ----------
    name : str
        Prefix of the keys; empty for a dataclass whose fields need none.
    value : anything
    number : int, optional
        Set of defaults whose values are left out; today's if omitted.

    Returns
    -------
    dict of str to str

    Examples
    --------
    >>> describe("da", 0.5)
    {'da': '0.5'}
    """
    lines: dict[str, str] = {}
    _Description(lines, defaults_of(DEFAULTS if number is None else number)).add(name, value, ())
    return lines


def defaults_of(number: int) -> dict[str, Any]:
    """Defaults of a set that are others today, by the key of their field."""
    values: dict[str, Any] = {}
    for later in range(DEFAULTS, number, -1):
        values |= REPLACED.get(later, {})
    return values


def with_defaults_of(settings: Settings, number: int, stored: Mapping[str, str]) -> Settings:
    """Settings in which fields left at today's default have that of an earlier set.

    Parameters
    ----------
    settings : dataclass
    number : int
        The earlier set.
    stored : mapping of str to str
        Description of the run that was begun with that set: a field it names was not left out.
    """
    for key, value in defaults_of(number).items():
        if key not in stored:
            path = key.split(".")
            settings = _with_field(settings, path, value)
    return settings


def _with_field(owner: Any, path: list[str], value: Any) -> Any:
    name, inner = path[0], path[1:]
    old = getattr(owner, name)
    if inner:
        return replace(owner, **{name: _with_field(old, inner, value)})
    field = next(f for f in fields(owner) if f.name == name)
    if not _equal(old, _default(owner, field)):
        return owner  # given, not left out
    return replace(owner, **{name: value(owner) if callable(value) else value})


def _default(owner: Any, field: Field[Any]) -> Any:
    """Default of a field; that of one whose default depends on others is in its metadata."""
    if "resolved" in field.metadata:
        return field.metadata["resolved"](owner)
    return field.default if field.default_factory is MISSING else field.default_factory()


def _equal(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return value is default or bool(value == default)


def differences(stored: Mapping[str, str], given: Mapping[str, str]) -> list[str]:
    """One line for each key in which two descriptions differ."""
    return [
        f"{key}: stored {_text(stored, key)}, given {_text(given, key)}"
        for key in sorted({*stored, *given})
        if stored.get(key) != given.get(key)
    ]


def _text(settings: Mapping[str, str], key: str) -> str:
    owner = key.rpartition(".")[0]
    return settings.get(key, "the default" if not owner or owner in settings else "nothing")


class _Description:
    """Lines of a description, filled value by value."""

    def __init__(self, lines: dict[str, str], defaults: Mapping[str, Any]) -> None:
        self.lines = lines
        self.defaults = defaults

    def add(self, name: str, value: Any, seen: tuple[int, ...]) -> None:
        """Describe a value; `seen` are the values that hold it."""
        lines = self.lines
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
            self._add_function(name, value, inner)
        elif isinstance(value, types.MethodType):
            self.add(name, value.__func__, inner)
            self.add(f"{name}.self", value.__self__, inner)
        elif isinstance(value, partial):
            self.add(name, value.func, inner)
            self.add(f"{name}.args", value.args, inner)
            self.add(f"{name}.keywords", value.keywords, inner)
        elif isinstance(value, Mapping):
            lines[name] = f"{len(value)} entries"
            for key in value:
                self.add(f"{name}[{key!r}]", value[key], inner)
        elif isinstance(value, tuple | list):
            lines[name] = f"{len(value)} entries"
            for i, item in enumerate(value):
                self.add(f"{name}[{i}]", item, inner)
        elif isinstance(value, type | types.BuiltinFunctionType | types.ModuleType | np.ufunc):
            lines[name] = str(getattr(value, "__qualname__", getattr(value, "__name__", value)))
        elif is_dataclass(value):
            self._add_dataclass(name, value, inner)
        else:
            lines[name] = type(value).__qualname__
            for key, item in sorted(getattr(value, "__dict__", {}).items()):
                self.add(f"{name}.{key}", item, inner)

    def _add_dataclass(self, name: str, value: Any, seen: tuple[int, ...]) -> None:
        own = type(value).__module__.startswith(_OWN)
        if name:
            self.lines[name] = type(value).__qualname__
        for field in fields(value):
            key, item = f"{name}.{field.name}".lstrip("."), getattr(value, field.name)
            if own and self._is_left_out(key, value, field, item):
                continue
            self.add(key, item, seen)
            if own and is_dataclass(item) and type(_default(value, field)) is type(item):
                del self.lines[key]  # it is the kind that a reader expects; its fields say the rest

    def _is_left_out(self, key: str, owner: Any, field: Field[Any], value: Any) -> bool:
        if not field.metadata.get("changes_results", True):
            return True
        if key in self.defaults:
            earlier = self.defaults[key]
            return _equal(value, earlier(owner) if callable(earlier) else earlier)
        return _equal(value, _default(owner, field))

    def _add_function(self, name: str, function: types.FunctionType, seen: tuple[int, ...]) -> None:
        code = function.__code__
        own = (function.__module__ or "").startswith(_OWN)
        what = f"xcrack.{function.__qualname__}" if own else function.__qualname__
        self.lines[name] = what if own else f"{what} {_hash(_code(code))}"
        for key, cell in zip(code.co_freevars, function.__closure__ or ()):
            self.add(f"{name}.{key}", cell.cell_contents, seen)
        if own:
            return
        if function.__defaults__:
            self.add(f"{name}.defaults", function.__defaults__, seen)
        if function.__kwdefaults__:
            self.add(f"{name}.defaults by name", function.__kwdefaults__, seen)
        for key in code.co_names:  # constants of the user's script, such as a stress
            used = function.__globals__.get(key)
            if isinstance(used, bool | int | float | str | np.ndarray | np.generic | tuple):
                self.add(f"{name}.{key}", used, seen)


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


__all__ = ["DEFAULTS", "REPLACED", "defaults_of", "describe", "differences", "with_defaults_of"]
