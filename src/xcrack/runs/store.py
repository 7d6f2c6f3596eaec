"""Values to files and back to the last bit; writes are atomic."""

import contextlib
import io
import json
import os
import secrets
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors

PART = ".part"  # ending of a file that is not whole yet
Classes = Mapping[str, type]  # dataclasses that a file may hold, by the name they have in it


class UnknownValueError(ProblemError):
    """A file that another version of xcrack wrote."""


def write_whole(path: Path, data: bytes) -> None:
    """Write a file so that a kill at any moment leaves the old one or the new one.

    Until it is whole it has a name of its own, so that two processes never share one.

    Raises
    ------
    OSError
        The system refuses; nothing is left of the attempt.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}_{secrets.token_hex(4)}{PART}")
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    if os.name == "posix":  # the name itself is on disk only once the folder is
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def save(path: Path, value: Any, classes: Classes) -> None:
    """Write a value: numbers, strings, arrays, tuples, lists, dicts and known dataclasses.

    Parameters
    ----------
    path : Path
    value : anything of these
    classes : mapping of str to dataclass
        A file names a class by its key here, so that it outlives a move of the class to another
        module, and never chooses what is imported.

    Raises
    ------
    ProblemError
        Something in it is none of these.
    """
    write_whole(path, packed_content(value, classes))


def packed_content(value: Any, classes: Classes) -> bytes:
    """Content of the file that `save` writes."""
    arrays: list[NDArray[Any]] = []
    names = {kind: name for name, kind in classes.items()}
    tree = _encode(value, arrays, names)
    buffer = io.BytesIO()
    members = {f"array_{i}": array for i, array in enumerate(arrays)}
    np.savez(buffer, allow_pickle=False, tree=np.array(json.dumps(tree)), **members)
    return buffer.getvalue()


def load(path: Path, classes: Classes) -> Any:
    """Read a value that `save` wrote; None where the file is damaged, or not one of these.

    Raises
    ------
    ProblemError
        It holds a class that is not among those given, or one with other fields, or the system
        does not let it be read.
    """
    if path.is_dir():
        return None
    with system_errors("a stored value cannot be read from", path, error=ProblemError):
        data = path.read_bytes()
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as members:
            tree = json.loads(str(members["tree"]))
            arrays = {name: members[name] for name in members.files if name != "tree"}
        return _decode(tree, arrays, classes, path)
    except UnknownValueError:
        raise
    except Exception:  # whatever zipfile, zlib, numpy and json say of bytes that are not theirs
        return None


def _encode(value: Any, arrays: list[NDArray[Any]], names: Mapping[type, str]) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic | np.ndarray):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise ProblemError(f"an array of {array.dtype} cannot be stored; use numbers.")
        arrays.append(array)
        return {"array": len(arrays) - 1, "scalar": isinstance(value, np.generic)}

    def encode_item(item: Any) -> Any:
        return _encode(item, arrays, names)

    if isinstance(value, tuple | list):
        name = "tuple" if isinstance(value, tuple) else "list"
        return {name: [encode_item(item) for item in value]}
    if isinstance(value, Mapping):
        return {"dict": [[encode_item(k), encode_item(v)] for k, v in value.items()]}
    kind = type(value)
    if kind in names:
        content = {f.name: encode_item(getattr(value, f.name)) for f in fields(value) if f.init}
        return {"class": names[kind], "fields": content}
    raise ProblemError(
        f"a {kind.__module__}.{kind.__qualname__} cannot be stored; only numbers, strings, arrays, "
        f"tuples, lists, dicts and the dataclasses {', '.join(names.values()) or '(none)'} can."
    )


def _decode(tree: Any, arrays: Mapping[str, NDArray[Any]], classes: Classes, path: Path) -> Any:
    if not isinstance(tree, dict):
        return tree

    def decode_item(item: Any) -> Any:
        return _decode(item, arrays, classes, path)

    if "array" in tree:
        array = arrays[f"array_{tree['array']}"]
        if tree["scalar"]:
            return array[()]
        array.flags.writeable = False
        return array
    if "tuple" in tree:
        return tuple(decode_item(item) for item in tree["tuple"])
    if "list" in tree:
        return [decode_item(item) for item in tree["list"]]
    if "dict" in tree:
        return {decode_item(k): decode_item(v) for k, v in tree["dict"]}
    name = tree["class"]
    if name not in classes:
        raise UnknownValueError(
            f"{path} holds a {name!r}, which this xcrack does not know: read it with the version "
            "that wrote it."
        )
    values = {key: decode_item(item) for key, item in tree["fields"].items()}
    make: Any = classes[name]
    fields_of_class = {f.name: f for f in fields(make) if f.init}
    required_names = {
        n for n, f in fields_of_class.items() if f.default is f.default_factory is MISSING
    }
    odd_names = sorted((set(values) - set(fields_of_class)) | (required_names - set(values)))
    if odd_names:
        raise UnknownValueError(
            f"{path} holds a {name} that differs in {', '.join(odd_names)} from the one of this "
            "xcrack: read it with the version that wrote it."
        )
    return make(**values)


__all__ = ["PART", "Classes", "load", "packed_content", "save", "write_whole"]
