"""The mesh of a scene from the wanted error of K."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Annotated, Any

import numpy as np

from xcrack.adaptivity import sizes_2d, sizes_3d
from xcrack.adaptivity.adaptation import Adaptation, AdaptationPass
from xcrack.adaptivity.indicators import Indicators, indicators_of
from xcrack.adaptivity.resolved import resolved_fronts, resolved_tips
from xcrack.base.arguments import Items, Number, Progress, Whole, check_arguments
from xcrack.base.errors import GeometryError, ProblemError, SizeError, collected_warnings, warn
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem, ProblemArgument


@dataclass(frozen=True)
class _Refinement:
    """How a mesh becomes finer around tips, or along fronts.

    `most_unknowns` are what a solution takes minutes for.
    """

    resolve_cracks: Callable[[Problem], Problem]
    first_mesh: Callable[[Problem, float], Mesh]
    next_mesh: Callable[[Indicators, float, float, int], Mesh | None]
    trusted_errors: Callable[[Indicators, Indicators | None], Indicators]
    most_rounds: int
    most_unknowns: int


_REFINEMENT = {
    2: _Refinement(
        resolved_tips, sizes_2d.first_mesh, sizes_2d.next_mesh, sizes_2d.trusted_errors,
        most_rounds=14, most_unknowns=1_000_000,
    ),
    3: _Refinement(
        resolved_fronts, sizes_3d.coarse_mesh, sizes_3d.next_mesh, sizes_3d.trusted_errors,
        most_rounds=6, most_unknowns=500_000,
    ),
}  # fmt: skip
_ORDER = 2
_AIM = 0.5  # of the tolerance: bars of the next mesh are foretold to a factor of two
_STALLED = 0.9  # a bar that falls to no less than this share has another cause than the cells


@check_arguments()
def adapt(
    problem: ProblemArgument,
    tolerance: Annotated[float, Number(above=0, below=1)],
    states: Annotated[Sequence[Any] | None, Items()] = None,
    max_unknowns: Annotated[int | None, Whole(least=1, most=10**9)] = None,
    progress: Annotated[bool | str, Progress()] = True,
) -> Adaptation:
    """Refine the mesh of a scene until K is as accurate as wanted.

    A first mesh resolves tips, kinks and fronts, these with cells as large as the tolerance lets
    them be. Then rounds of: solve at order 2, K with its error
    bars, a finer mesh, until every bar is within the tolerance. In 2D cells are bisected that
    contribute much to the bars. In 3D there is no such share of a cell: those along the fronts
    become smaller by 1.5 each round, larger ones with the distance.

    Parameters
    ----------
    problem : Problem
        On a mesh that may be coarse; it is refined only. Boundaries whose curve the mesh knows
        (`Mesh.curves`) become smooth.
    tolerance : float
        Wanted error of K at every tip, or along all fronts away from free surfaces, in every state,
        over the largest K of all, but for cracks that symmetry keeps shut: K = 0 need not be known
        better than to this share of a ten-thousandth of K by the mean energy of the body.
    states : sequence, optional
        Load states, as for `solve`.
    max_unknowns : int, optional
        Most unknowns of a mesh; a million in 2D and half of that in 3D if omitted.
    progress : bool or "always"
        Tell each round on a terminal, or always.

    Returns
    -------
    Adaptation
        With `met`, or the reason in words why the tolerance is not met.

    Raises
    ------
    ProblemError
        A scene without tips or fronts, fewer unknowns than the first mesh has, contact by a method
        that has no estimate, faces that press and rub.
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
    refinement = _REFINEMENT[problem.mesh.dim]
    most_unknowns = refinement.most_unknowns if max_unknowns is None else max_unknowns
    problem = refinement.resolve_cracks(problem)
    _check_scene(problem)
    load_states = [None] if states is None else states
    scene = replace(problem, mesh=refinement.first_mesh(problem, tolerance), order=_ORDER)
    return _adaptation_passes(scene, load_states, tolerance, most_unknowns, progress)


def _adaptation_passes(
    scene: Problem,
    states: Sequence[Any],
    tolerance: float,
    most_unknowns: int,
    progress: bool | str,
) -> Adaptation:
    refinement = _REFINEMENT[scene.mesh.dim]
    rounds: list[AdaptationPass] = []
    measured_pass, messages = _measure_pass(scene, states, None, rounds)
    if rounds[0].unknowns > most_unknowns:
        raise ProblemError(
            f"adapt: max_unknowns = {most_unknowns}, and the first mesh, in which every crack is a "
            f"few cells long, has {rounds[0].unknowns}: allow more."
        )
    aim, reason = _AIM, ""
    while True:
        _tell_progress(progress, len(rounds) - 1, rounds[-1])
        # Estimates are blind to parts of contact: there, two meshes have to agree.
        has_met = measured_pass.error <= tolerance and (
            len(rounds) > 1 or not measured_pass.pressed_cracks
        )
        if has_met:
            break
        if len(rounds) == refinement.most_rounds:
            reason = f"{len(rounds)} rounds have not been enough"
            break
        if not measured_pass.K.any():
            break  # at rest, or shut everywhere: no cell brings K, nor a scale for its error
        mesh = refinement.next_mesh(measured_pass, tolerance, aim, most_unknowns)
        if mesh is None:
            reason = (
                f"the next mesh would have more than {most_unknowns} unknowns: allow more with "
                "max_unknowns"
            )
            break
        try:
            next_pass, messages = _measure_pass(
                replace(scene, mesh=mesh), states, measured_pass, rounds
            )
        except GeometryError as error:
            reason = f"the crack does not fit into a finer mesh ({error})"
            break
        except SizeError as error:
            reason = f"a finer mesh needs more memory than is free ({error})"
            break
        if next_pass.error > _STALLED * measured_pass.error:
            aim /= 2
        measured_pass = next_pass
    for message in messages:
        warn(message)
    zero = "" if np.abs(measured_pass.K).max(initial=0.0) > 0 else "K is zero at every tip"
    parts = [
        part for part in (reason, measured_pass.worst_place, *measured_pass.reasons, zero) if part
    ]
    reason = "" if has_met else "; ".join(parts)
    return Adaptation(
        measured_pass.problem,
        measured_pass.solutions,
        measured_pass.sifs,
        tolerance,
        has_met,
        reason,
        tuple(rounds),
    )


def _measure_pass(
    scene: Problem,
    states: Sequence[Any],
    last_indicators: Indicators | None,
    rounds: list[AdaptationPass],
) -> tuple[Indicators, list[str]]:
    """A round, added to the list of them, and what it warned of."""
    messages: list[str] = []
    start = perf_counter()
    with collected_warnings(messages):
        indicators = indicators_of(scene, states)
        indicators = _REFINEMENT[scene.mesh.dim].trusted_errors(indicators, last_indicators)
    unknowns, seconds = indicators.solutions[0].space.n_dof, perf_counter() - start
    rounds.append(
        AdaptationPass(
            len(scene.mesh.cells), unknowns, indicators.K, indicators.bar, indicators.scale, seconds
        )
    )
    return indicators, messages


def _tell_progress(progress: bool | str, number: int, row: AdaptationPass) -> None:
    if progress == "always" or (progress and sys.stderr.isatty()):
        print(
            f"round {number}: {row.unknowns} unknowns, error of K {row.error:.1e}, "
            f"{row.seconds:.2g} s",
            file=sys.stderr,
        )


def _check_scene(problem: Problem) -> None:
    """Raise where no error of K can be estimated, whatever the mesh."""
    method = problem.numerics.contact_method
    if not any(crack.n_tips for crack in problem.placed):
        raise ProblemError(
            "adapt: no crack has a tip in the body, so that there is no K to adapt to: give a "
            "crack that ends inside, or refine the mesh by hand (xc.refine)."
        )
    if method is not None:
        raise ProblemError(
            f"adapt: contact by {method.label} has no estimate: leave contact_method out."
        )


__all__ = ["adapt"]
