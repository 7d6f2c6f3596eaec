"""The meshes of a run with a tolerance: as given, and fine where a scout has been."""

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
from xcrack.growth.rates.uncertainty import TOGETHER
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.step import Step, memory_of
from xcrack.growth.tolerance import sizes_2d, sizes_3d
from xcrack.growth.tolerance.corridor import corridor, ways_of
from xcrack.growth.tolerance.scout import Stage, samples, scouted
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

    def given_mesh(self, problem: Problem) -> Mesh:
        """The mesh of a scene to begin with."""

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


def prepared(
    run: Run, steps_of: Steps, done: Sequence[Step] = (), stored: Sequence[Mesh] = ()
) -> Run:
    """A run on the mesh that it begins with, or goes on with.

    Parameters
    ----------
    run : Run
        On the mesh as it was given.
    steps_of : callable
        What makes the steps of a run.
    done : sequence of Step, optional
        Those that a run goes on from.
    stored : sequence of Mesh, optional
        Meshes that it has had; where the last one is not among them, it is made again.

    Returns
    -------
    Run
    """
    first = _first_mesh(run)
    if not done:
        _check_unknowns(run, first)
        return on(run, first)
    known = memory_of(done[-1]).mesh
    run = replace(run, meshes=memory_of(done[-1]).meshes)
    for mesh in (first, *stored):
        if fingerprint(mesh) == known:
            return on(run, replace(mesh, curves=run.problem.mesh.curves))
    earlier = [step for step in done if memory_of(step).mesh != known]
    mesh, _ = finer(run, steps_of, earlier[-1] if earlier else None)
    if fingerprint(mesh) != known:
        warn(
            "the mesh that the run had is not stored, and the one that was made again differs "
            "from it in the last bits: so may the steps that follow."
        )
    return on(run, mesh)


def on(run: Run, mesh: Mesh) -> Run:
    """A run on another mesh."""
    return replace(run, problem=replace(run.problem, mesh=mesh, order=2))


def _first_mesh(run: Run) -> Mesh:
    """The mesh as given, where error bars can be had on it: else finer at the tips, or fronts."""
    return _TWINS[run.problem.mesh.dim].given_mesh(run.problem)


def _check_unknowns(run: Run, mesh: Mesh) -> None:
    """Refuse a first mesh that has too many unknowns before anything is solved on it."""
    least = mesh.dim * (mesh.n_points + len(mesh.edges))
    if run.max_unknowns is not None and least > run.max_unknowns:
        raise ProblemError(
            f"grow: max_unknowns = {run.max_unknowns}, and the first mesh, on which cracks are a "
            f"few cells long, has {least} at least: allow more, or give a coarser mesh."
        )


def fingerprint(mesh: Mesh) -> str:
    """Text that two meshes share if they are the same to the last bit."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes())
    digest.update(np.ascontiguousarray(mesh.cells).tobytes())
    return digest.hexdigest()[:16]


def finer(run: Run, steps_of: Steps, last: Step | None) -> tuple[Mesh, bool]:
    """A mesh on which bars of K are as wanted along all of the way that a scout finds.

    Parameters
    ----------
    run : Run
        On the mesh as it was given.
    steps_of : callable
        What makes the steps of a run.
    last : Step, optional
        From which on the cracks are to grow; from their start, where it is left out.

    Returns
    -------
    Mesh
    bool
        Whether it would have more unknowns than it may.
    """
    twin, start = _TWINS[run.problem.mesh.dim], perf_counter()
    before = _first_mesh(run)
    if last is not None:
        run = replace(run, problem=replace(run.problem, cracks=last.corrected))
    most = run.max_unknowns or twin.MOST_UNKNOWNS
    mesh = twin.scout_mesh(run.problem)
    _tell(run, f"scout: on {len(mesh.cells)} cells", start)
    scene = replace(run.problem, mesh=mesh, order=twin.SCOUT_ORDER)
    seen = scouted(run, scene, steps_of, 0 if last is None else last.index)
    if not seen.stages:
        return mesh, False
    _tell(run, f"scout: {len(seen.stages)} steps, N = {seen.stages[-1].cycles:.4g}", start)
    ways = ways_of(seen)
    # Of one that has begun long ago, most of the life is over.
    chosen = samples(seen, twin.STAGES, 1.0 if last is not None and last.index else twin.LIFE)
    stages = [seen.stages[k] for k in chosen]
    sizes = [twin.first_sizes(scene, stage) for stage in stages]
    sizes[0] = np.minimum(sizes[0], seen.step)
    mesh = refine(mesh, size=corridor(seen, ways, chosen, sizes))
    wanted = SHARE / TOGETHER * float(run.tolerance or 0.0) / max(seen.exponent, _LEAST_EXPONENT)
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
        if number == 0 and unknowns > most:
            instead = f"{unknowns} are the fewest for the way ahead; growth keeps the mesh it has"
            _warn_of_most(run, most, instead)
            return before, True
        if error <= wanted:
            break
        goals = [wanted * float(np.abs(now.best).max(initial=0.0)) for now in good]
        places = [stages[k].places for k in there]
        smaller, own = twin.finer(good, goals, places, [sizes[k] for k in there])
        for k, size in zip(there, own, strict=True):
            sizes[k] = size
        smaller = refine(smaller, size=corridor(seen, ways, chosen, sizes))
        if unknowns * len(smaller.cells) > most * len(mesh.cells):
            _warn_of_most(
                run, most, f"growth goes on with {unknowns}, on which K is known to {error:.1e} of "
                f"its largest value, where {wanted:.1e} was wanted",
            )  # fmt: skip
            return mesh, True
        same, mesh = len(smaller.cells) == len(mesh.cells), smaller
        if error <= _FORETOLD * wanted or same:
            break
    _tell(run, f"mesh: {len(mesh.cells)} cells", start)
    return mesh, False


def _warn_of_most(run: Run, most: int, instead: str) -> None:
    warn(
        f"grow: the mesh that tolerance = {run.tolerance:g} asks for would have more than {most} "
        f"unknowns: {instead}. Allow more with max_unknowns; life_bar says what it costs."
    )


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

__all__ = ["SHARE", "finer", "fingerprint", "on", "prepared"]
