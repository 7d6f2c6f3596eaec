"""Values to files and back to the last bit; a file is there as a whole or not at all."""

import importlib
import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.errors import ProblemError

_PACKAGE = "xcrack."


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that a kill at any moment leaves the old one or the new one."""
    part = path.with_name(f".{path.name}.part")
    with open(part, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
    if os.name == "posix":  # the name itself is on disk only once the folder is
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def save(path: Path, value: Any) -> None:
    """Write a value: numbers, strings, arrays, tuples, lists, dicts and dataclasses of xcrack.

    Raises
    ------
    ProblemError
        Something in it is none of these.
    """
    arrays: list[NDArray[Any]] = []
    tree = _encoded(value, arrays)
    buffer = io.BytesIO()
    members = {f"array_{i}": array for i, array in enumerate(arrays)}
    np.savez(buffer, allow_pickle=False, tree=np.array(json.dumps(tree)), **members)
    write_whole(path, buffer.getvalue())


def load(path: Path) -> Any:
    """Read a value that `save` wrote; None where the file is not whole."""
    try:
        with np.load(path, allow_pickle=False) as members:
            tree = json.loads(str(members["tree"]))
            arrays = {name: members[name] for name in members.files if name != "tree"}
        return _decoded(tree, arrays)
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
        return None


def _encoded(value: Any, arrays: list[NDArray[Any]]) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic | np.ndarray):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise ProblemError(f"an array of {array.dtype} cannot be stored; use numbers.")
        arrays.append(array)
        return {"array": len(arrays) - 1, "scalar": isinstance(value, np.generic)}
    if isinstance(value, tuple | list):
        name = "tuple" if isinstance(value, tuple) else "list"
        return {name: [_encoded(item, arrays) for item in value]}
    if isinstance(value, Mapping):
        return {"dict": [[_encoded(k, arrays), _encoded(v, arrays)] for k, v in value.items()]}
    kind = type(value)
    if is_dataclass(value) and kind.__module__.startswith(_PACKAGE):
        content = {
            f.name: _encoded(getattr(value, f.name), arrays) for f in fields(value) if f.init
        }
        return {"class": f"{kind.__module__}:{kind.__qualname__}", "fields": content}
    raise ProblemError(
        f"a {kind.__module__}.{kind.__qualname__} cannot be stored; only numbers, strings, arrays, "
        "tuples, lists, dicts and the dataclasses of xcrack can."
    )


def _decoded(tree: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        array = arrays[f"array_{tree['array']}"]
        if tree["scalar"]:
            return array[()]
        array.flags.writeable = False
        return array
    if "tuple" in tree:
        return tuple(_decoded(item, arrays) for item in tree["tuple"])
    if "list" in tree:
        return [_decoded(item, arrays) for item in tree["list"]]
    if "dict" in tree:
        return {_decoded(k, arrays): _decoded(v, arrays) for k, v in tree["dict"]}
    module, name = tree["class"].split(":")
    if not module.startswith(_PACKAGE):  # a file must not choose what is imported
        raise ValueError(module)
    found = getattr(importlib.import_module(module), name)
    if not is_dataclass(found):
        raise ValueError(name)
    make: Any = found
    return make(**{key: _decoded(item, arrays) for key, item in tree["fields"].items()})


__all__ = ["load", "save", "write_whole"]
