"""A test that somebody made: what was measured, on what, and where that was read."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors

_DATA = "data"


@dataclass(frozen=True)
class Experiment:
    """A test as a value.

    Attributes
    ----------
    name, title, kind, units : str
    dim : int
        2 or 3.
    license : str
        Under which its numbers were read, or that none was.
    recalled : tuple of str
        What was taken from memory.
    remarks : tuple of str
        What a reader has to know of it.
    source : mapping
        ``work``: who measured; ``place``, ``commit``, ``files``: where it was read.
    geometry, material, load, measured : mapping
        In `units`; points are (n, 2) arrays.
    others : tuple of mapping
        Predictions of other programs of the same test: ``program``, and ``path`` or single numbers.
    """

    name: str
    title: str
    kind: str
    units: str
    dim: int
    license: str
    recalled: tuple[str, ...]
    remarks: tuple[str, ...]
    source: Mapping[str, Any]
    geometry: Mapping[str, Any] = field(default_factory=dict)
    material: Mapping[str, Any] = field(default_factory=dict)
    load: Mapping[str, Any] = field(default_factory=dict)
    measured: Mapping[str, Any] = field(default_factory=dict)
    others: tuple[Mapping[str, Any], ...] = ()

    @property
    def path(self) -> Floats:
        """Measured points of the crack (n, 2)."""
        return np.asarray(self.measured["path"], dtype=float)


def read_experiment(name: str, folder: Path | None = None) -> Experiment:
    """A test of the book, with the whole of its measured numbers where a folder has them.

    Parameters
    ----------
    name : str
    folder : Path, optional
        A file of this name and the ending ``.toml`` in it replaces and completes the measured
        numbers that the package holds.

    Raises
    ------
    ProblemError
        A file that cannot be read, or is no toml.
    """
    text = files(__package__).joinpath(_DATA, f"{name}.toml").read_text(encoding="utf-8")
    content = tomllib.loads(text)
    measured = content.pop("measured")
    for key in ("recalled", "remarks"):
        content[key] = tuple(content[key])
    others = tuple(content.pop("other", ()))
    return Experiment(**content, measured={**measured, **_given(name, folder)}, others=others)


def experiment_names() -> tuple[str, ...]:
    """Names of all tests of the book."""
    entries = files(__package__).joinpath(_DATA).iterdir()
    return tuple(sorted(e.name[: -len(".toml")] for e in entries if e.name.endswith(".toml")))


def _given(name: str, folder: Path | None) -> dict[str, Any]:
    """Measured numbers of a file of the user's; empty where there is none."""
    path = None if folder is None else folder / f"{name}.toml"
    if path is None or not path.is_file():
        return {}
    with system_errors("the measured numbers cannot be read from", path, error=ProblemError):
        text = path.read_text(encoding="utf-8")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProblemError(f"validate: {path} is no toml: {error}.") from error
    measured = content.get("measured", {})
    if not isinstance(measured, dict):
        raise ProblemError(f"validate: measured in {path} is no table: write [measured].")
    return dict(measured)


__all__ = ["Experiment", "experiment_names", "read_experiment"]
