"""The mesh of a run with a tolerance: coarse for a scout, then fine where that has been."""

import hashlib
import sys
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Protocol

import numpy as np

from xcrack.adaptivity.measured import Measured, measured
from xcrack.arrays import Floats
from xcrack.errors import ProblemError, XcrackError, collected_warnings, warn
from xcrack.growth import sizes_2d, sizes_3d
from xcrack.growth.corridor import corridor, ways_of
from xcrack.growth.options import Run
from xcrack.growth.scout import Stage, samples, scouted
from xcrack.growth.step import Step, memory_of
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.scene.problem import Problem

SHARE = 0.4  # of the tolerance: what K may take
_LEAST_EXPONENT = 2.0  # of the law, in the error of life; directions err by twice that of K_II
_FORETOLD = 4.0  # times the wanted bar: from there the next mesh need not be looked at again

Steps = Callable[[Run], Generator[Step, None, str]]


class Sizes(Protocol):
    """What decides the sizes of cells in one dimension; `sizes_2d` and `sizes_3d` have it."""

    MOST_UNKNOWNS: int
    STAGES: int  # that stand for the path
    ROUNDS: int
    LIFE: float  # share of it at the last of these
    SCOUT_ORDER: int

    def scout_mesh(self, problem: Problem) -> Mesh:
        """The mesh of a scene for a scout."""

    def first_sizes(self, problem: Problem, stage: Stage) -> Floats:
        """Sizes of cells at the places of a stage, before any bar is known."""

    def error(self, now: Measured) -> float:
        """Half-width of K over the largest K."""

    def finer(
        self,
        each: Sequence[Measured],
        wanted: Sequence[float],
        places: Sequence[Floats],
        sizes: list[Floats],
    ) -> tuple[Mesh, list[Floats]]:
        """The next mesh but for the corridor, and the sizes along that."""


def prepared(run: Run, steps_of: Steps, last: Step | None = None, mesh: Mesh | None = None) -> Run:
    """A run on the mesh that its tolerance asks for.

    Parameters
    ----------
    run : Run
    steps_of : callable
        What makes the steps of a run.
    last : Step, optional
        The one that a run goes on from.
    mesh : Mesh, optional
        The mesh that it may have had; where it is another one, it is made again.

    Returns
    -------
    Run
        The same for the same scene and tolerance, whatever stops it.
    """
    known = "" if last is None else memory_of(last).mesh
    if mesh is None or fingerprint(mesh) != known:
        mesh = _chosen(run, steps_of)
        if known and fingerprint(mesh) != known:
            warn(
                "the mesh that the run had is not stored, and the one that was made again differs "
                "from it in the last bits: so may the steps that follow."
            )
    else:
        mesh = replace(mesh, curves=run.problem.mesh.curves)
    return replace(run, problem=replace(run.problem, mesh=mesh, order=2))


def fingerprint(mesh: Mesh) -> str:
    """Text that two meshes share if they are the same to the last bit."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes())
    digest.update(np.ascontiguousarray(mesh.cells).tobytes())
    return digest.hexdigest()[:16]


def _chosen(run: Run, steps_of: Steps) -> Mesh:
    """A mesh on which bars of K are as wanted along all of the way of a scout."""
    twin, start = _TWINS[run.problem.mesh.dim], perf_counter()
    most = run.max_unknowns or twin.MOST_UNKNOWNS
    mesh = twin.scout_mesh(run.problem)
    _tell(run, f"scout: on {len(mesh.cells)} cells", start)
    scene = replace(run.problem, mesh=mesh, order=twin.SCOUT_ORDER)
    seen = scouted(run, scene, steps_of)
    _tell(run, f"scout: {len(seen.stages)} steps, N = {seen.stages[-1].cycles:.4g}", start)
    ways, chosen = ways_of(seen), samples(seen, twin.STAGES, twin.LIFE)
    stages = [seen.stages[k] for k in chosen]
    sizes = [twin.first_sizes(scene, stage) for stage in stages]
    sizes[0] = np.minimum(sizes[0], seen.step)
    mesh = refine(mesh, size=corridor(seen, ways, chosen, sizes))
    wanted = SHARE * float(run.tolerance or 0.0) / max(seen.exponent, _LEAST_EXPONENT)
    for number in range(twin.ROUNDS):
        each = [_measured(run, mesh, stage) for stage in stages]
        there = [k for k, now in enumerate(each) if now is not None]
        good = [now for now in each if now is not None]
        if not good:
            break
        error = max(map(twin.error, good))
        unknowns = max(now.solutions[0].space.n_dof for now in good)
        text = f"{unknowns} unknowns, K within {error:.1e}, wanted {wanted:.1e}"
        _tell(run, f"mesh {number}: {text}", start)
        if number == 0 and run.max_unknowns is not None and unknowns > most:
            raise ProblemError(
                f"grow: max_unknowns = {most}, and the first mesh, on which cracks are a few cells "
                f"long all along their way, has {unknowns}: allow more."
            )
        if error <= wanted:
            break
        goals = [wanted * float(np.abs(now.best).max(initial=0.0)) for now in good]
        places = [stages[k].places for k in there]
        finer, smaller = twin.finer(good, goals, places, [sizes[k] for k in there])
        for k, size in zip(there, smaller, strict=True):
            sizes[k] = size
        finer = refine(finer, size=corridor(seen, ways, chosen, sizes))
        if unknowns * len(finer.cells) > most * len(mesh.cells):
            warn(
                f"grow: the mesh that tolerance = {run.tolerance:g} asks for would have more than "
                f"{most} unknowns: growth goes on with {unknowns}, on which K is known to "
                f"{error:.1e} of its largest value, where {wanted:.1e} was wanted. Allow more with "
                "max_unknowns; life_bar says what it costs."
            )
            break
        same, mesh = len(finer.cells) == len(mesh.cells), finer
        if error <= _FORETOLD * wanted or same:
            break
    _tell(run, f"mesh: {len(mesh.cells)} cells", start)
    return mesh


def _measured(run: Run, mesh: Mesh, stage: Stage) -> Measured | None:
    """K of a stage with its bars; None where that mesh has none."""
    with collected_warnings([]):  # they come again in the run
        try:
            scene = replace(run.problem, mesh=mesh, cracks=stage.cracks, order=2)
            return measured(scene, run.cycle.load_states)
        except XcrackError:
            return None


def _tell(run: Run, line: str, start: float) -> None:
    if run.progress == "always" or (run.progress and sys.stderr.isatty()):
        print(f"{line}, {perf_counter() - start:.2g} s", file=sys.stderr)


_TWINS: dict[int, Sizes] = {2: sizes_2d, 3: sizes_3d}

__all__ = ["fingerprint", "prepared"]
