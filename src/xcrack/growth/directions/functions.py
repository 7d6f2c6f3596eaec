"""What functions and classes of a user do: their code, and what they read."""

import hashlib
import sys
import sysconfig
import types
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

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
    recorded = is_public_library(module)
    return f"{module}.{name}" + (f" {version}" if version and not recorded else "")


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


def reads(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
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
    inner = (c for c in code.co_consts if isinstance(c, types.CodeType))
    return set(code.co_names).union(*map(_names, inner))


def methods(kind: type) -> Iterator[tuple[str, types.FunctionType]]:
    """Functions of a class and of those it inherits from, but for classes of libraries."""
    for owner in kind.__mro__:
        if is_public_library(owner.__module__) or is_installed(owner.__module__):
            continue
        for name, member in vars(owner).items():
            function = _function_in(member)
            if function is None:
                continue
            made = function.__code__.co_filename == "<string>" and name in _MADE_BY_DATACLASS
            if not (made and is_dataclass(owner)):
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


__all__ = [
    "code_of",
    "is_installed",
    "is_public_library",
    "methods",
    "name_of",
    "package_of",
    "reads",
    "wrapped_by",
]
