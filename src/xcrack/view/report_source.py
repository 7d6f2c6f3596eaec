"""What a report is about, gathered from a solution, a history, or the folder of a run."""

import hashlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.analysis.solution import Solution
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError, collected_warnings
from xcrack.base.markup import Markup, display_text
from xcrack.base.paths import path_of
from xcrack.base.units import BODY_FORCE, STRESS, Dimension, Units
from xcrack.crack.crack import Crack
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.validity import Validity, validity
from xcrack.mesh.mesh import Mesh
from xcrack.model.material import Isotropic, Material
from xcrack.model.problem import Problem
from xcrack.runs.collect import load
from xcrack.runs.history import History
from xcrack.runs.inspection import Inspection
from xcrack.runs.life import Life
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities

_NU = 0.3  # of a material that is not stored: K_III alone counts by it
_HALF = "not ended"  # how `load` begins the reason of a run that goes on or was killed


@dataclass(frozen=True)
class UnitNames:
    """Names of the units of a report; of nothing where none were given.

    Attributes
    ----------
    length, force, stress : str
    """

    length: str = ""
    force: str = ""
    stress: str = ""

    @classmethod
    def read(cls, text: Any) -> "UnitNames":
        """Names from a text such as ``"N, mm, MPa"``.

        Raises
        ------
        ProblemError
            No force, length and stress, unknown ones, or a stress that is not the force over the
            square of the length.
        """
        if text is None:
            return cls()
        parts = [part.strip() for part in text.split(",")] if isinstance(text, str) else []
        if len(parts) != 3:
            raise ProblemError(
                f"report: units = {value_text(text)}: give force, length and stress, such as "
                '"N, mm, MPa".'
            )
        force, length, stress = parts
        try:
            size = Units(length, force).number(f"1 {stress}", STRESS)
        except ProblemError as error:
            raise ProblemError(f"report: units = {value_text(text)}: {error}") from None
        if abs(size - 1) > 1e-6:
            raise ProblemError(
                f"report: units = {value_text(text)}: 1 {stress} is {size:.6g} {force}/{length}²: "
                "give a consistent set."
            )
        return cls(length, force, stress)

    def label(self, dimension: Dimension) -> str:
        """Name of the unit of a dimension, such as MPa√mm; empty where none is known."""
        powers, force = dimension
        if not self.length or (powers, force) == (0.0, 0.0):
            return ""
        of_force = {0.0: "", 1.0: self.force}.get(force, f"{self.force}^{force:g}")
        if force == 1 and powers <= -1.5 and (powers, force) != BODY_FORCE:
            of_force, powers = self.stress, powers + 2
        if powers == 0:
            return of_force
        size = {1.0: "", 2.0: "²", 3.0: "³", 0.5: ""}.get(abs(powers), f"^{abs(powers):g}")
        root = "√" if abs(powers) == 0.5 else ""
        of_length = f"{root}{self.length}{size}"
        if powers < 0:
            return f"{of_force or '1'}/{of_length}"
        return f"{of_force}·{of_length}" if of_force and not root else f"{of_force}{of_length}"

    def value(self, value: Any, dimension: Dimension) -> str:
        """A value with its unit."""
        text = value if isinstance(value, str) else display_text(value)
        return f"{text} {self.label(dimension)}".rstrip()

    def head(self, name: str, dimension: Dimension) -> str:
        """The head of a column with its unit."""
        label = self.label(dimension)
        return f"{name} [{label}]" if label else name


@dataclass(frozen=True, eq=False)
class Source:
    """All that the sections of a report may draw on.

    Attributes
    ----------
    title : str
    solutions : tuple of Solution
        Of the last step, one for each load state; empty where only a stored run is there.
    sif : tuple of tuple of SIF
        ``sif[state][crack]`` of the same step.
    history : History, optional
    yield_stress : float, optional
    life : Life, optional
    inspection : Inspection, optional
    strength : structured array, optional
        What `residual_strength` returned.
    units : UnitNames
    spectrum : Spectrum, optional
        Load history of the run, for its picture.
    warnings : mapping of str to int
        What was warned of, and how often.
    """

    title: str
    solutions: tuple[Solution, ...]
    sif: tuple[tuple[SIF, ...], ...]
    history: History | None = None
    yield_stress: float | None = None
    warnings: Counter[str] = field(default_factory=Counter)
    life: Life | None = None
    inspection: Inspection | None = None
    strength: NDArray[Any] | None = None
    units: "UnitNames" = field(default_factory=lambda: UnitNames())
    spectrum: Spectrum | None = None

    @property
    def nu(self) -> float:
        """Poisson's ratio, for equivalent K."""
        return _NU if self.problem is None else float(self.problem.elasticity.poisson)

    @property
    def toughness(self) -> float | None:
        """K_c of the material, or the one at which the run was to end."""
        if self.problem is not None and self.problem.elasticity.material.K_c is not None:
            return float(self.problem.elasticity.material.K_c)
        text = self.history.settings.get("K_c", "") if self.history and self.history.steps else ""
        try:
            return float(text)
        except ValueError:
            return None

    @property
    def problem(self) -> Problem | None:
        """The scene, where it is known."""
        return self.solutions[0].problem if self.solutions else None

    @cached_property
    def validity(self) -> Validity | None:
        """Plastic zones and net sections of the last step; None without a yield stress."""
        problem, mesh = self.problem, self.mesh
        material: Material
        if problem is None and self.yield_stress is None and self.history is not None:
            validity_of_run = self.history.solved[-1].validity if self.history.solved else None
            if validity_of_run is not None:
                return validity_of_run
        if problem is not None:
            material, cracks = problem.elasticity.material, problem.placed
        elif self.history is not None and self.history.solved:  # the most severe of what it may be
            plane = "stress" if self.dim == 2 else None
            material, cracks = Isotropic(1.0, _NU, plane), self.history.solved[-1].cracks
        else:
            return None
        if self.yield_stress is not None:
            material = material.with_yield_stress(self.yield_stress)
        if mesh is None or not self.sif or (material.yield_stress, material.K_c) == (None, None):
            return None
        K_c = material.K_c if self.history is None else None  # a run ends there
        return validity(material, mesh, cracks, self.sif, self.solutions, K_c)

    @property
    def mesh(self) -> Mesh | None:
        """The mesh, where it is known."""
        if self.solutions:
            return self.solutions[0].space.mesh
        return None if self.history is None else self.history.mesh

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """The cracks at the end."""
        if self.history is not None:
            return self.history.cracks
        return self.solutions[0].space.cracks

    @property
    def dim(self) -> int:
        """Dimension of the body."""
        if self.cracks:
            return int(self.cracks[0].points.shape[1])
        return 2 if self.mesh is None else self.mesh.dim

    @property
    def is_whole(self) -> bool:
        """Whether the run has ended."""
        return self.history is None or not self.history.ended.startswith(_HALF)

    def hashes(self) -> dict[str, str]:
        """Hashes of the inputs."""
        if self.history is not None and self.history.steps:
            settings = self.history.settings
            if settings:
                text = "\n".join(f"{k}={v}" for k, v in sorted(settings.items()))
                return {"settings of the run": _hash(text.encode())}
        if self.problem is None:
            return {}
        mesh = self.problem.mesh
        cracks = [np.ascontiguousarray(c.points).tobytes() for c in self.problem.cracks]
        return {
            "mesh": _hash(mesh.points.tobytes() + mesh.cells.tobytes()),
            "cracks": _hash(b"".join(cracks)),
        }


_DIGITS = re.compile(r"(?<![\w.])\d+\.\d{6,}(?:e[+-]?\d+)?(?![\w.])")
_ARRAY = re.compile(r"float64 \((\d+),.*\) (sha256:\w+)")


def setting_words(text: str) -> str:
    """A setting as it is read: six digits; of an array, stored by its hash, its numbers' count."""
    return _DIGITS.sub(lambda m: f"{float(m[0]):.6g}", _ARRAY.sub(r"\1 numbers, \2", text))


def path_or_result(value: Any, label: str, error: type[XcrackError]) -> Any:
    """The folder of a run as a path; anything else as it is."""
    return path_of(value, label, error=error) if isinstance(value, str | PathLike) else value


def source_of(
    results: Any, title: str, yield_stress: float | None, life: Life | None = None
) -> Source:
    """Gather what a report is about.

    Raises
    ------
    ProblemError
        Neither a solution, nor a history, nor the folder of a run.
    """
    messages: list[str] = []
    with collected_warnings(messages):
        if isinstance(results, Path):
            title = title or results.name
            results = load(results)
        if isinstance(results, History):
            source = _of_history(results, title, yield_stress)
        else:
            solutions = _solutions(results)
            source = Source(title or "Solution", solutions, _sif(solutions), None, yield_stress)
    source.warnings.update(messages)
    if source.history is not None:
        source.warnings.update(source.history.warnings)
    return replace(source, life=life)


def _of_history(history: History, title: str, yield_stress: float | None) -> Source:
    solutions: tuple[Solution, ...] = ()
    sif: tuple[tuple[SIF, ...], ...] = ()
    if history.steps:
        last_step = (history.solved or history.steps)[-1]
        solutions, sif = last_step.solutions, last_step.sif
        for step in history.steps:
            if step.warnings is None:  # of a script, or of an older xcrack
                _sif(step.solutions)  # what is warned of is what counts here
    return Source(title or "Growth run", solutions, sif, history, yield_stress)


def _sif(solutions: Sequence[Solution]) -> tuple[tuple[SIF, ...], ...]:
    """K of all states and cracks; where K cannot be had there is none."""
    if not solutions:
        return ()
    n = len(solutions[0].space.cuts)
    try:
        by_crack = [stress_intensities(solutions, c) for c in range(n)]
    except XcrackError:
        return ()
    return tuple(tuple(by_crack[c][k] for c in range(n)) for k in range(len(solutions)))


def _solutions(source: Any) -> tuple[Solution, ...]:
    result = [source] if isinstance(source, Solution) else source
    if isinstance(result, list | tuple) and result and all(isinstance(s, Solution) for s in result):
        return tuple(result)
    raise ProblemError(
        f"report takes a Solution or a list of them, a History, or the folder of a run, not a "
        f"{type(source).__name__}."
    )


def _hash(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()[:16]}"


# A part of a report: HTML for readers, numbers for programs.


@dataclass(frozen=True)
class Section:
    """A part of a report.

    Attributes
    ----------
    key : str
        Its name in the json file, and the anchor of the page.
    title : str
    content : Markup
    numbers : mapping
        What the json file has of it.
    """

    key: str
    title: str
    content: Markup
    numbers: Mapping[str, Any] = field(default_factory=dict)


__all__ = ["Section", "Source", "UnitNames", "setting_words", "source_of"]
