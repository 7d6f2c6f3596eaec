"""A test that somebody made: what was measured, on what, and where that was read."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors
from xcrack.fatigue.criteria import max_hoop_stress
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import Law
from xcrack.growth.run import grow
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem
from xcrack.runs.collect import collect
from xcrack.runs.history import History
from xcrack.verification.experiments.outcome import Comparison, Curve, Outcome, distances, rms

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
    measurements = content.pop("measured")
    for key in ("recalled", "remarks"):
        content[key] = tuple(content[key])
    others = tuple(content.pop("other", ()))
    return Experiment(
        **content, measured={**measurements, **_measured_by_user(name, folder)}, others=others
    )


def experiment_names() -> tuple[str, ...]:
    """Names of all tests of the book."""
    entries = files(__package__).joinpath(_DATA).iterdir()
    return tuple(sorted(e.name[: -len(".toml")] for e in entries if e.name.endswith(".toml")))


def _measured_by_user(name: str, folder: Path | None) -> dict[str, Any]:
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
    measurements = content.get("measured", {})
    if not isinstance(measurements, dict):
        raise ProblemError(f"validate: measured in {path} is no table: write [measured].")
    return dict(measurements)


# --- how a test is predicted: what the trials share ---


ROOT_M = np.sqrt(1000.0)  # N/mm^1.5 in a MPa√m


@dataclass(frozen=True)
class Trial:
    """A test and the function that predicts it.

    Attributes
    ----------
    name : str
        That of its `Experiment`.
    run : callable (experiment, quick) -> Outcome
    quick : bool
        Whether the quick page has it.
    needs : str
        What it needs beside xcrack: "gmsh", or nothing.
    """

    name: str
    run: Callable[[Experiment, bool], Outcome]
    quick: bool = True
    needs: str = "gmsh"


def grown(
    problem: Problem, law: Law, cycle: Cycle, da: float, until: Callable[[Step], bool] | None = None
) -> History:
    """A run to its end, or until a step is told to be the last."""
    steps = grow(problem, law, max_hoop_stress, cycle, da=da, progress=False)
    return collect(steps, until=until)


def outline(mesh: Mesh) -> list[Curve]:
    """Boundary of a body in the plane, as chains of edges."""
    edges = mesh.boundary
    next_point = {int(a): int(b) for a, b in _oriented(mesh, edges)}
    curves = []
    while next_point:
        first = next(iter(next_point))
        chain = [first]
        while chain[-1] in next_point:
            chain.append(next_point.pop(chain[-1]))
        curves.append(Curve.of("", mesh.points[chain], "body"))
    return curves


def _oriented(mesh: Mesh, edges: Ints) -> Ints:
    """Boundary edges with the body on their left."""
    cell = mesh.facet_to_cell[mesh.facet_numbers(edges), 0]
    towards_cell = mesh.points[mesh.cells[cell]].mean(axis=1) - mesh.points[edges[:, 0]]
    edge = mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]
    is_left = edge[:, 0] * towards_cell[:, 1] - edge[:, 1] * towards_cell[:, 0] > 0
    return np.where(is_left[:, None], edges, edges[:, ::-1])


def arc_of(path: Floats) -> Floats:
    """Length along a polyline (k, 2) at its points (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def driving(history: History, crack: int = 0) -> tuple[Floats, Floats]:
    """Tips (n, 2) of a crack with one tip at the solved steps of a run, and its range of K_eq."""
    rows = history.table()
    rows = rows[(rows["crack"] == crack) & np.isfinite(rows["dK_eq"])]
    return np.stack([rows["x"], rows["y"]], axis=1), np.asarray(rows["dK_eq"])


_OF_OTHERS = (
    ("life_ratio", "life over that of the test", ""),
    ("depth", "depth at the cycles of the test", "mm"),
    ("angle", "angle at the surface", "degrees"),
)


def by_others(
    experiment: Experiment, points: Floats | None = None, where: str = ""
) -> list[Comparison]:
    """What other programs, or their authors, published of the same test.

    Parameters
    ----------
    experiment : Experiment
    points : (n, 2) array, optional
        Measured ones, from which the distance of their paths is taken here.
    where : str
        Said behind the name of that distance.
    """
    rows = []
    for other in experiment.others:
        start = f"by {other['program']}: "
        if points is not None and "path" in other:
            deviation = distances(points, np.array(other["path"]))
            name = f"{start}distance of the path, rms{where}"
            rows.append(Comparison(name, rms(deviation), unit="mm"))
        for key, words, unit in _OF_OTHERS if not where else ():
            values = np.atleast_1d(other.get(key, []))
            rows += [Comparison(start + words, float(v), measure="number", unit=unit)
                     for v in values]  # fmt: skip
    return rows


__all__ = [
    "ROOT_M",
    "Experiment",
    "Trial",
    "arc_of",
    "by_others",
    "driving",
    "experiment_names",
    "grown",
    "outline",
    "read_experiment",
]
