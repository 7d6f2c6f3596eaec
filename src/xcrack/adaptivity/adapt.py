"""The mesh of a scene from the wanted error of K."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from xcrack.adaptivity.adapted import Adapted, Round
from xcrack.adaptivity.measured import Measured, measured, trusted
from xcrack.adaptivity.start_2d import first_mesh, kinks
from xcrack.adaptivity.wanted import smaller
from xcrack.analysis.plan import LIPS
from xcrack.arrays import Floats
from xcrack.errors import GeometryError, ProblemError, collected_warnings, warn
from xcrack.geometry.simplices import closest_on_segment
from xcrack.inputs import entries, flag, number, whole
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine_to
from xcrack.scene.problem import Problem, check_problem

_ORDER = 2
_MOST_ROUNDS = 14
_MOST_UNKNOWNS = 1_000_000  # what a factor of a scene in 2D may take
_AIM = 0.5  # of the tolerance: bars of the next mesh are foretold to a factor of two
_SWEEPS = 5
_GENTLER = 2  # times that the aim is doubled where the next mesh would be too large
_LEAST = 1.05  # cells of the next mesh over those of this one
_STALLED = 0.9  # a bar that falls to no less than this share has another cause than the cells


def adapt(
    problem: Problem,
    tolerance: float,
    states: Sequence[Any] | None = None,
    max_unknowns: int | None = None,
    progress: bool | str = True,
) -> Adapted:
    """Refine the mesh of a scene in 2D until K is as accurate as wanted.

    A first mesh resolves tips and kinks. Then rounds of: solve, K with its error bars, cells that
    contribute much to them bisected, until every bar is within the tolerance. K is that of order 2.

    Parameters
    ----------
    problem : Problem
        On a mesh that may be coarse; it is refined only. Boundaries whose curve the mesh knows
        (`Mesh.curves`) become smooth.
    tolerance : float
        Wanted error of K_I and K_II at every tip in every state, over the largest K of all.
    states : sequence, optional
        Load states, as for `solve`.
    max_unknowns : int, optional
        Most unknowns of a mesh; a million if omitted.
    progress : bool or "always"
        Tell each round on a terminal, or always.

    Returns
    -------
    Adapted
        With `met`, or the reason in words why the tolerance is not met.

    Raises
    ------
    ProblemError
        A scene in 3D or without tips, a tolerance that is not between 0 and 1, fewer unknowns than
        the first mesh has, contact by a method that has no estimate.
    ConvergenceError, GeometryError
        The first mesh cannot be solved.

    Warns
    -----
    XcrackWarning
        What `solve` and `stress_intensity` say of the last mesh.

    Notes
    -----
    A bar knows nothing of a wrong load, and of a body that is not linear elastic. The rule by which
    cells are refined is that of equal shares (Becker and Rannacher, 2001, Acta Numerica 10, 1).
    """
    check_problem(problem, "adapt")
    tolerance = number(tolerance, "adapt: tolerance", above=0, below=1)
    most = _MOST_UNKNOWNS
    if max_unknowns is not None:
        most = whole(max_unknowns, "adapt: max_unknowns", least=1)
    if not (isinstance(progress, str) and progress == "always"):
        flag(progress, 'adapt: progress, if it is not "always",')
    _check_scene(problem)
    wanted = [None] if states is None else entries(states, "states")
    scene = replace(problem, mesh=first_mesh(problem), order=_ORDER)
    return _rounds(scene, wanted, tolerance, most, progress)


def _rounds(
    scene: Problem,
    states: Sequence[Any],
    tolerance: float,
    most: int,
    progress: bool | str,
) -> Adapted:
    rounds: list[Round] = []
    now, messages = _measured(scene, states, None, rounds)
    if rounds[0].unknowns > most:
        raise ProblemError(
            f"adapt: max_unknowns = {most}, and the first mesh, in which every crack is a few "
            f"cells long, has {rounds[0].unknowns}: allow more."
        )
    aim, reason = _AIM, ""
    while True:
        _tell(progress, len(rounds) - 1, rounds[-1])
        if now.error <= tolerance and (len(rounds) > 1 or not now.pressed):
            break  # estimates are blind to parts of contact: there, two meshes have to agree
        if len(rounds) == _MOST_ROUNDS:
            reason = f"{_MOST_ROUNDS} rounds have not been enough"
            break
        mesh = _next_mesh(now, tolerance, aim, most)
        if mesh is None:
            reason = (
                f"the next mesh would have more than {most} unknowns: allow more with max_unknowns"
            )
            break
        try:
            new, messages = _measured(replace(scene, mesh=mesh), states, now, rounds)
        except GeometryError as error:
            reason = f"the crack does not fit into a finer mesh ({error})"
            break
        if new.error > _STALLED * now.error:
            aim /= 2
        now = new
    for message in messages:
        warn(message)
    met = bool(now.error <= tolerance)
    reason = "" if met else "; ".join([reason, *now.reasons])
    if not met and not np.abs(now.best).max(initial=0.0) > 0:
        reason += "; K is zero at every tip"
    return Adapted(now.problem, now.solutions, now.sifs, tolerance, met, reason, tuple(rounds))


def _measured(
    scene: Problem, states: Sequence[Any], old: Measured | None, rounds: list[Round]
) -> tuple[Measured, list[str]]:
    """A round, added to the list of them, and what it warned of."""
    messages: list[str] = []
    start = perf_counter()
    with collected_warnings(messages):
        new = trusted(measured(scene, states), old)
    unknowns, seconds = new.solutions[0].space.n_dof, perf_counter() - start
    rounds.append(Round(len(scene.mesh.cells), unknowns, new.best, new.bar, seconds))
    return new, messages


def _next_mesh(now: Measured, tolerance: float, aim: float, most: int) -> Mesh | None:
    """A finer mesh, or None where it would have too many unknowns."""
    mesh, scale = now.problem.mesh, float(np.abs(now.best).max(initial=0.0))
    each = now.solutions[0].space.n_dof / len(mesh.cells)
    for share in aim * 2.0 ** np.arange(1 + _GENTLER):
        wanted = tolerance * scale * share
        ratio = smaller(now.shares, now.bar.ravel(), wanted, _ORDER, mesh.dim)
        ratio = np.minimum(ratio, np.minimum(_at_coarse_tips(now), _along_bent_cracks(now)))
        fine = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        while len(fine.cells) < _LEAST * len(mesh.cells):  # the bar does not follow the shares
            largest = np.argsort(now.shares.max(axis=0, initial=0.0))[
                -(len(mesh.cells) // 10) - 1 :
            ]
            ratio[largest] /= 2
            fine = refine_to(mesh, ratio * mesh.cell_size, _SWEEPS)
        if each * len(fine.cells) <= most:
            return fine
    return None


def _at_coarse_tips(now: Measured) -> Floats:
    """Half of the size around tips that have no bar."""
    mesh = now.problem.mesh
    ratio = np.ones(len(mesh.cells))
    centre = mesh.points[mesh.cells].mean(axis=1)
    for sif in (sif for state in now.sifs for sif in state):
        for x, reason in zip(sif.x, sif.reasons, strict=True):
            distance = np.linalg.norm(centre - x, axis=1)
            near = distance <= 2 * mesh.cell_size[np.argmin(distance)]
            ratio[near & bool(reason)] = 0.5
    return ratio


def _along_bent_cracks(now: Measured) -> Floats:
    """Half of the size along cracks that press at kinks, a quarter at the kinks."""
    mesh = now.problem.mesh
    ratio = np.ones(len(mesh.cells))
    centre = mesh.points[mesh.cells].mean(axis=1)
    for c in now.bent:
        x = now.problem.placed[c].points
        for a, b in zip(x[:-1], x[1:], strict=True):
            distance = np.linalg.norm(centre - closest_on_segment(centre, a, b), axis=1)
            ratio[distance <= mesh.cell_size] = 0.5
        for kink in kinks(x):
            ratio[np.linalg.norm(centre - kink, axis=1) <= 2 * mesh.cell_size] = 0.25
    return ratio


def _tell(progress: bool | str, number: int, row: Round) -> None:
    if progress == "always" or (progress and sys.stderr.isatty()):
        print(
            f"round {number}: {row.unknowns} unknowns, error of K {row.error:.1e}, "
            f"{row.seconds:.2g} s",
            file=sys.stderr,
        )


def _check_scene(problem: Problem) -> None:
    """Raise where no error of K can be estimated, whatever the mesh."""
    lips = problem.numerics.comparison.lips
    if problem.mesh.dim == 3:
        raise ProblemError(
            "adapt works in 2D: in 3D grade the mesh towards the front with xc.refine(mesh, "
            "size=...), and compare K by xc.chart."
        )
    if not any(crack.n_tips for crack in problem.placed):
        raise ProblemError(
            "adapt: no crack has a tip in the body, so that there is no K to adapt to."
        )
    if lips in LIPS:
        raise ProblemError(
            f"adapt: contact by {LIPS[lips]} has no estimate: leave Comparison(lips={lips!r}) out."
        )


__all__ = ["adapt"]
