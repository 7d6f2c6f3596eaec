"""Values as text: the same lines for the same settings, in any process."""

import hashlib
import inspect
import json
import re
import sys
import sysconfig
import types
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import partial
from numbers import Number
from pathlib import Path, PurePath
from typing import Any

import numpy as np

# What functions and classes of a user do: their code, and what they read.

# Never followed: python's own, and packages whose versions stand beside the settings of a run.
_VERSIONED = {"xcrack", "numpy", "scipy", "numba"}
_INSTALLED = tuple({str(Path(sysconfig.get_path(key)).resolve()) for key in ("purelib", "platlib")})
_MADE_BY_DATACLASS = {
    *("__init__", "__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__", "__replace__"),
    *("__lt__", "__le__", "__gt__", "__ge__", "__getstate__", "__setstate__"),
}


def package_of(module: str | None) -> str:
    """Top package of a module."""
    return (module or "").partition(".")[0]


def is_public_library(module: str | None) -> bool:
    """Whether a module is python's own, or of a package whose version is recorded."""
    top = package_of(module)
    return (top in sys.stdlib_module_names and top != "__main__") or top in _VERSIONED


def is_installed(module: str | None) -> bool:
    """Whether a module belongs to an installed package, and not to the user's own files.

    What a script defines is the user's, whichever installed program runs it (a profiler).
    """
    if module == "__main__":
        return False
    file = getattr(sys.modules.get(module or ""), "__file__", None)
    return file is not None and str(Path(file).resolve()).startswith(_INSTALLED)


def name_of(value: Any) -> str:
    """Name of a function or class of a library, with the version of its package if it has one."""
    name = getattr(value, "__qualname__", None) or getattr(value, "__name__", None) or str(value)
    module = getattr(value, "__module__", None)
    if not module or module == "builtins":
        return str(name)
    version = getattr(sys.modules.get(package_of(module)), "__version__", "")
    is_recorded = is_public_library(module)
    return f"{module}.{name}" + (f" {version}" if version and not is_recorded else "")


def code_of(function: types.FunctionType) -> str:
    """Text that changes with what a function does, but not with where it stands."""
    data = _bytes(function.__code__, without_docstring=function.__doc__ is not None)
    return "sha256:" + hashlib.sha256(data).hexdigest()[:16]


def _bytes(code: types.CodeType, without_docstring: bool = False) -> bytes:
    table = getattr(code, "co_exceptiontable", b"")
    parts = [code.co_code, table, repr(code.co_names).encode()]
    for constant in code.co_consts[1:] if without_docstring else code.co_consts:
        if isinstance(constant, types.CodeType):
            parts.append(_bytes(constant))
        elif isinstance(constant, frozenset):  # its order is another one in each process
            parts.append(repr(sorted(map(repr, constant))).encode())
        else:
            parts.append(repr(constant).encode())
    return b"\0".join(parts)


def names_read(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """Names and values of all that a function reads: closure, defaults, globals, in that order.

    Globals include those of functions defined inside it; of a module of the user's the attributes
    that are named in the code, as ``module.attribute``.
    """
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or ()):
        try:
            yield name, cell.cell_contents
        except ValueError:  # a cell that is not filled yet
            continue
    if function.__defaults__:
        yield "defaults", function.__defaults__
    if function.__kwdefaults__:
        yield "defaults by name", function.__kwdefaults__
    names = sorted(_names(function.__code__))
    for name in names:
        if name not in function.__globals__:
            continue
        value = function.__globals__[name]
        if not isinstance(value, types.ModuleType):
            yield name, value
        elif not is_public_library(value.__name__) and not is_installed(value.__name__):
            yield from ((f"{name}.{a}", vars(value)[a]) for a in names if a in vars(value))


def _names(code: types.CodeType) -> set[str]:
    inner_codes = (c for c in code.co_consts if isinstance(c, types.CodeType))
    return set(code.co_names).union(*map(_names, inner_codes))


def methods(kind: type) -> Iterator[tuple[str, types.FunctionType]]:
    """Functions of a class and of those it inherits from, but for classes of libraries."""
    for owner in kind.__mro__:
        if is_public_library(owner.__module__) or is_installed(owner.__module__):
            continue
        for name, member in vars(owner).items():
            function = _function_in(member)
            if function is None:
                continue
            is_generated = (
                function.__code__.co_filename == "<string>" and name in _MADE_BY_DATACLASS
            )
            if not (is_generated and is_dataclass(owner)):
                yield f"{owner.__name__}.{name}", function


def _function_in(member: Any) -> types.FunctionType | None:
    for attribute in ("__func__", "fget", "func"):  # class and static methods, properties
        member = getattr(member, attribute, member)
    return member if isinstance(member, types.FunctionType) else None


def wrapped_by(value: Any) -> Callable[..., Any] | None:
    """Function that numba compiled, or that a cache or another object wraps; else None."""
    if isinstance(value, types.FunctionType | type):
        return None
    for attribute in ("py_func", "__wrapped__"):
        function = getattr(value, attribute, None)
        if isinstance(function, types.FunctionType):
            return function
    return None


_LONG = 200  # a text longer than this is stored by its hash
_MANY = 50  # and a container of more entries
_FEW = 16  # numbers of an array that are shown
_OWN = "xcrack."
_NAMED = type | types.BuiltinFunctionType | types.ModuleType | np.ufunc


class Description:
    """Lines of a description, filled value by value.

    Attributes
    ----------
    lines : dict of str to str
    at_default : set of str
        Keys of fields of xcrack's own classes that have their default, and of what is in them.
    """

    def __init__(self) -> None:
        self.lines: dict[str, str] = {}
        self.at_default: set[str] = set()
        self._described: dict[int, Any] = {}  # functions and objects; alive, so that ids are theirs
        self._packages: set[str] = set()  # installed ones whose functions were given by the user

    def add(
        self, name: str, value: Any, owners: tuple[int, ...] = (), is_used: bool = False
    ) -> None:
        """Describe a value.

        Parameters
        ----------
        name : str
            Key of its line, and prefix of those of its parts.
        value : anything
        owners : tuple of int
            Ids of the values that contain it.
        is_used : bool
            It is read by a function, not given.
        """
        if id(value) in owners:
            self.lines[name] = "itself"
            return
        inner_owners = (*owners, id(value))
        if isinstance(value, np.generic):
            value = value.item()
        inner_function = wrapped_by(value)
        if inner_function is not None:
            value = inner_function
        if value is None or isinstance(value, Number | str | bytes | PurePath | Enum):
            self.lines[name] = _short_text(repr(value))
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            text = repr(value.tolist()) if value.size <= _FEW else ""
            content = np.ascontiguousarray(value)
            digest = f"{value.dtype} {value.shape} {_hash(content.tobytes())}"
            self.lines[name] = text if text and len(text) <= _LONG else digest
        elif isinstance(value, types.FunctionType):
            self._add_function(name, value, inner_owners, is_used)
        elif isinstance(value, types.MethodType):
            self.add(name, value.__func__, inner_owners, is_used)
            self.add(f"{name}.self", value.__self__, inner_owners, is_used)
        elif isinstance(value, partial):
            self.add(name, value.func, inner_owners, is_used)
            self.add(f"{name}.args", value.args, inner_owners, is_used)
            self.add(f"{name}.keywords", value.keywords, inner_owners, is_used)
        elif isinstance(value, Mapping | tuple | list | set | frozenset):
            self._add_container(name, value, inner_owners, is_used)
        elif isinstance(value, _NAMED):
            self._add_named(name, value, inner_owners)
        elif is_dataclass(value):
            self._add_dataclass(name, value, inner_owners, is_used)
        else:
            self._add_object(name, value, inner_owners, is_used)

    def _add_container(self, name: str, value: Any, owners: tuple[int, ...], is_used: bool) -> None:
        self.lines[name] = f"{len(value)} entries"
        if isinstance(value, Mapping):
            entries = [(f"[{key!r}]", value[key]) for key in value]
        elif isinstance(value, set | frozenset):  # their order is another one in each process
            entries = [(f"[{i}]", item) for i, item in enumerate(sorted(value, key=repr))]
        else:
            entries = [(f"[{i}]", item) for i, item in enumerate(value)]
        target = self
        if len(entries) > _MANY:
            target = Description()
            target._described, target._packages = self._described, self._packages
        for key, item in entries:
            target.add(name + key, item, owners, is_used)
        if target is not self:
            content = json.dumps(target.lines, sort_keys=True)
            self.lines[name] += f" {_hash(content.encode())}"

    def _add_function(
        self, name: str, function: types.FunctionType, owners: tuple[int, ...], is_used: bool
    ) -> None:
        module = function.__module__
        if (module or "").startswith(_OWN):
            function = inspect.unwrap(function)  # what checks its arguments is no setting
            self.lines[name] = f"xcrack.{function.__qualname__}"
            for key, cell in zip(function.__code__.co_freevars, function.__closure__ or ()):
                self.add(f"{name}.{key}", cell.cell_contents, owners, is_used)
            return
        is_of_package = is_installed(module)
        if is_of_package and not is_used:
            self._packages.add(package_of(module))
        if is_public_library(module) or (
            is_of_package and package_of(module) not in self._packages
        ):
            self.lines[name] = name_of(function)
            return
        self.lines[name] = f"{function.__qualname__} {code_of(function)}"
        if self._is_new(function):
            for key, value in names_read(function):
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
                for read, value in names_read(function):
                    self.add(f"{name}.{key}.{read}", value, owners, True)

    def _add_dataclass(self, name: str, value: Any, owners: tuple[int, ...], is_used: bool) -> None:
        is_of_xcrack = type(value).__module__.startswith(_OWN)
        if name:
            self.lines[name] = type(value).__qualname__
        for field in fields(value):
            if is_of_xcrack and not field.metadata.get("changes_results", True):
                continue
            key, item = f"{name}.{field.name}".lstrip("."), getattr(value, field.name)
            earlier_names = set(self.lines)
            self.add(key, item, owners, is_used)
            if is_of_xcrack and is_equal(item, default_of(value, field)):
                self.at_default |= set(self.lines) - earlier_names
        if not is_of_xcrack:
            self._add_methods(name, type(value), owners)

    def _add_object(self, name: str, value: Any, owners: tuple[int, ...], is_used: bool) -> None:
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
                self.add(f"{name}.made of", argument, owners, is_used)
        for part in state if isinstance(state, tuple) else (state,):
            if isinstance(part, Mapping):
                for key in sorted(part, key=str):
                    self.add(f"{name}.{key}", part[key], owners, is_used)
            elif part is not None:
                self.add(f"{name}.state", part, owners, is_used)
        for entries in items:
            if entries is not None:
                self.add(f"{name}.items", list(entries), owners, is_used)

    def _is_new(self, value: Any) -> bool:
        is_new = id(value) not in self._described
        self._described[id(value)] = value
        return is_new


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


def _short_text(text: str) -> str:
    return text if len(text) <= _LONG else f"{text[:40]}… {_hash(text.encode())}"


def _hash(data: bytes) -> str:
    return "sha256:" + hashlib.sha256(data).hexdigest()[:16]


# What a run was asked to do, as text that can be stored and compared.

_FUNCTION = re.compile(r"([\w.<>]+ )?sha256:[0-9a-f]{16}")


def describe(name: str, value: Any) -> dict[str, str]:
    """Flat description of a value: the same text for the same settings, in any process.

    Long arrays and containers are described by a hash; functions of xcrack and of other packages by
    their name; functions of the user by their code and by all that they read: helpers, constants,
    lists, dicts and objects of the script, what they close over. Dataclasses are described field by
    field, other objects by what a copy would be made from, and by the code of their class if it is
    the user's. Fields whose metadata say ``changes_results=False`` are never described.

    Parameters
    ----------
    name : str
        Prefix of the keys; empty for a dataclass whose fields need none.
    value : anything

    Returns
    -------
    dict of str to str

    Examples
    --------
    >>> describe("da", 0.5)
    {'da': '0.5'}
    """
    description = Description()
    description.add(name, value)
    return description.lines


def default_keys(name: str, value: Any) -> set[str]:
    """Keys of a description that say no more than a default: an older one may lack them."""
    description = Description()
    description.add(name, value)
    return description.at_default


def differences(
    old_lines: Mapping[str, str], new_lines: Mapping[str, str], new_defaults: Set[str] = frozenset()
) -> list[str]:
    """One line for each key in which two descriptions differ.

    Parameters
    ----------
    old_lines, new_lines : mapping of str to str
        The stored one and the one to compare with it.
    new_defaults : set of str
        Keys that the stored description may lack: fields it did not know, at their default.
    """
    return [
        f"{key}: stored {old_lines.get(key, 'nothing')}, given {new_lines.get(key, 'nothing')}"
        for key in sorted({*old_lines, *new_lines})
        if old_lines.get(key) != new_lines.get(key)
        and not (key not in old_lines and key in new_defaults)
    ]


def only_compiled_differently(
    old_lines: Mapping[str, str], new_lines: Mapping[str, str]
) -> list[str]:
    """Keys of functions whose code differs and whose name does not, as by another python."""
    names = {
        key: [_FUNCTION.fullmatch(text) for text in (old_lines[key], new_lines[key])]
        for key in sorted({*old_lines} & {*new_lines})
        if old_lines[key] != new_lines[key]
    }
    return [key for key, (m, n) in names.items() if m and n and m[1] == n[1]]


__all__ = [
    "Description",
    "code_of",
    "default_keys",
    "describe",
    "differences",
    "is_installed",
    "is_public_library",
    "methods",
    "name_of",
    "names_read",
    "only_compiled_differently",
    "package_of",
    "wrapped_by",
]
