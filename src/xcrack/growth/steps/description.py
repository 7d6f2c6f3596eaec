"""Values as text: the same lines for the same settings, in any process."""

import hashlib
import json
import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import partial
from numbers import Number
from pathlib import PurePath
from typing import Any

import numpy as np

from xcrack.growth.directions.functions import (
    code_of,
    is_installed,
    is_public_library,
    methods,
    name_of,
    package_of,
    reads,
    wrapped_by,
)

_LONG = 200  # a text longer than this is stored by its hash
_MANY = 50  # and a container of more entries
_OWN = "xcrack."
_NAMED = type | types.BuiltinFunctionType | types.ModuleType | np.ufunc


class Description:
    """Lines of a description, filled value by value.

    Parameters
    ----------
    defaults : mapping of str to anything
        Defaults that are others than those of the classes, by the key of their field.
    """

    def __init__(self, defaults: Mapping[str, Any]) -> None:
        self.lines: dict[str, str] = {}
        self._defaults = defaults
        self._described: dict[int, Any] = {}  # functions and objects; alive, so that ids are theirs
        self._packages: set[str] = set()  # installed ones whose functions were given by the user

    def add(self, name: str, value: Any, owners: tuple[int, ...] = (), used: bool = False) -> None:
        """Describe a value.

        Parameters
        ----------
        name : str
            Key of its line, and prefix of those of its parts.
        value : anything
        owners : tuple of int
            Ids of the values that contain it.
        used : bool
            It is read by a function, not given.
        """
        if id(value) in owners:
            self.lines[name] = "itself"
            return
        inner = (*owners, id(value))
        if isinstance(value, np.generic):
            value = value.item()
        wrapped = wrapped_by(value)
        if wrapped is not None:
            value = wrapped
        if value is None or isinstance(value, Number | str | bytes | PurePath | Enum):
            self.lines[name] = _shortened(repr(value))
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            content = np.ascontiguousarray(value)
            self.lines[name] = f"{value.dtype} {value.shape} {_hash(content.tobytes())}"
        elif isinstance(value, types.FunctionType):
            self._add_function(name, value, inner, used)
        elif isinstance(value, types.MethodType):
            self.add(name, value.__func__, inner, used)
            self.add(f"{name}.self", value.__self__, inner, used)
        elif isinstance(value, partial):
            self.add(name, value.func, inner, used)
            self.add(f"{name}.args", value.args, inner, used)
            self.add(f"{name}.keywords", value.keywords, inner, used)
        elif isinstance(value, Mapping | tuple | list | set | frozenset):
            self._add_container(name, value, inner, used)
        elif isinstance(value, _NAMED):
            self._add_named(name, value, inner)
        elif is_dataclass(value):
            self._add_dataclass(name, value, inner, used)
        else:
            self._add_object(name, value, inner, used)

    def _add_container(self, name: str, value: Any, owners: tuple[int, ...], used: bool) -> None:
        self.lines[name] = f"{len(value)} entries"
        if isinstance(value, Mapping):
            entries = [(f"[{key!r}]", value[key]) for key in value]
        elif isinstance(value, set | frozenset):  # their order is another one in each process
            entries = [(f"[{i}]", item) for i, item in enumerate(sorted(value, key=repr))]
        else:
            entries = [(f"[{i}]", item) for i, item in enumerate(value)]
        target = self
        if len(entries) > _MANY:
            target = Description(self._defaults)
            target._described, target._packages = self._described, self._packages
        for key, item in entries:
            target.add(name + key, item, owners, used)
        if target is not self:
            content = json.dumps(target.lines, sort_keys=True)
            self.lines[name] += f" {_hash(content.encode())}"

    def _add_function(
        self, name: str, function: types.FunctionType, owners: tuple[int, ...], used: bool
    ) -> None:
        module = function.__module__
        if (module or "").startswith(_OWN):
            self.lines[name] = f"xcrack.{function.__qualname__}"
            for key, cell in zip(function.__code__.co_freevars, function.__closure__ or ()):
                self.add(f"{name}.{key}", cell.cell_contents, owners, used)
            return
        installed = is_installed(module)
        if installed and not used:
            self._packages.add(package_of(module))
        if is_public_library(module) or (installed and package_of(module) not in self._packages):
            self.lines[name] = name_of(function)
            return
        self.lines[name] = f"{function.__qualname__} {code_of(function)}"
        if self._is_new(function):
            for key, value in reads(function):
                self.add(f"{name}.{key}", value, owners, True)

    def _add_named(self, name: str, value: Any, owners: tuple[int, ...]) -> None:
        """A class, whose functions count if it is the user's, or what a library has."""
        self.lines[name] = name_of(value)
        if isinstance(value, type) and self._is_new(value):
            self._add_methods(name, value, owners)

    def _add_methods(self, name: str, kind: type, owners: tuple[int, ...]) -> None:
        for key, function in methods(kind):
            if self._is_new(function):
                self.lines[f"{name}.{key}"] = code_of(function)
                for read, value in reads(function):
                    self.add(f"{name}.{key}.{read}", value, owners, True)

    def _add_dataclass(self, name: str, value: Any, owners: tuple[int, ...], used: bool) -> None:
        own = type(value).__module__.startswith(_OWN)
        if name:
            self.lines[name] = type(value).__qualname__
        for field in fields(value):
            key, item = f"{name}.{field.name}".lstrip("."), getattr(value, field.name)
            if own and self._is_left_out(key, value, field, item):
                continue
            self.add(key, item, owners, used)
            if own and is_dataclass(item) and type(default_of(value, field)) is type(item):
                del self.lines[key]  # it is the kind that a reader expects; its fields say the rest
        if not own:
            self._add_methods(name, type(value), owners)

    def _is_left_out(self, key: str, owner: Any, field: Field[Any], value: Any) -> bool:
        if not field.metadata.get("changes_results", True):
            return True
        if key in self._defaults:
            earlier = self._defaults[key]
            return is_equal(value, earlier(owner) if callable(earlier) else earlier)
        return is_equal(value, default_of(owner, field))

    def _add_object(self, name: str, value: Any, owners: tuple[int, ...], used: bool) -> None:
        """Any other object, by what a copy of it would be made from."""
        kind = type(value)
        self.lines[name] = kind.__qualname__
        if not self._is_new(value):
            return
        self._add_methods(name, kind, owners)
        try:
            parts = value.__reduce_ex__(4)
        except Exception:  # a lock, a file: nothing that can be copied
            parts = ()
        if isinstance(parts, str):
            self.lines[name] += f" {parts}"
            return
        arguments, state, *items = (*parts[1:], *(None,) * 4)[:4]
        for argument in arguments or ():
            if argument is not kind:
                self.add(f"{name}.made of", argument, owners, used)
        for part in state if isinstance(state, tuple) else (state,):
            if isinstance(part, Mapping):
                for key in sorted(part, key=str):
                    self.add(f"{name}.{key}", part[key], owners, used)
            elif part is not None:
                self.add(f"{name}.state", part, owners, used)
        for entries in items:
            if entries is not None:
                self.add(f"{name}.items", list(entries), owners, used)

    def _is_new(self, value: Any) -> bool:
        new = id(value) not in self._described
        self._described[id(value)] = value
        return new


def default_of(owner: Any, field: Field[Any]) -> Any:
    """Default of a field; that of one whose default depends on others is in its metadata."""
    if "resolved" in field.metadata:
        return field.metadata["resolved"](owner)
    return field.default if field.default_factory is MISSING else field.default_factory()


def is_equal(value: Any, default: Any) -> bool:
    """Whether a field has its default."""
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return value is default or bool(value == default)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONG else f"{text[:40]}… {_hash(text.encode())}"


def _hash(data: bytes) -> str:
    return "sha256:" + hashlib.sha256(data).hexdigest()[:16]


__all__ = ["Description", "default_of", "is_equal"]
