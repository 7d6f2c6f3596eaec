"""Edge cracks and a crack in bending in a square, open and closed."""

from collections.abc import Sequence

import numpy as np

import xcrack as xc
from benchmarks.runs import Outcome
from benchmarks.scenes.exact_fields import Field, closure_pressure, edge_fields, partial_closure
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings, adapted, mesh_of, quiet
from xcrack.base.arrays import Floats

_SQUARE = ("left", "right", "bottom", "top")
COARSE = 5  # cells a side from which `adapt` starts
MODES = (1.0, 0.5)  # K_I and K_II of the open edge crack


def _imposed(sides: Sequence[str], u: Field) -> list[xc.displacement]:
    return [xc.displacement(side, lambda x: u(x)) for side in sides]


def edge(s: Settings, seed: int) -> Outcome:
    """Edge crack in [-1, 1]² under K_I = 1, K_II = 0.5, displacements given but for the left."""
    problem, sigma = _edge(s, seed)
    solution, sif = quiet(problem)
    return Outcome(
        {"K": worst(sif.K[0], MODES)}, solution.n_dof,
        later=lambda: {"energy": xc.energy_error(solution, sigma)},
    )  # fmt: skip


def edge_adapted(tolerance: float, seed: int) -> Outcome:
    """The edge crack by `adapt` from a coarse mesh: all rounds, and the best K."""
    problem, sigma = _edge(Settings(COARSE), seed)
    result = adapted(problem, tolerance)
    return Outcome(
        {"K": worst(result.sif.best[0], MODES)}, result.rounds[-1].unknowns,
        later=lambda: {"energy": xc.energy_error(result.solution, sigma)},
    )  # fmt: skip


def _edge(s: Settings, seed: int) -> tuple[xc.Problem, Field]:
    u, sigma = edge_fields(MODES)
    problem = xc.Problem(
        mesh_of(s, 1.0, 2, seed), STEEL[2], [xc.line_crack([(-1.3, 0.0), (0.0, 0.0)])],
        supports=_imposed(_SQUARE[1:], u),
        loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
        contact="off", order=s.order, numerics=s.numerics,
    )  # fmt: skip
    return problem, sigma


def closed(s: Settings, seed: int) -> Outcome:
    """The edge crack under pressure 1 and K_II = 0.5: closed faces that slide."""
    u, sigma = edge_fields((0.0, 0.5), 1.0)
    problem = xc.Problem(
        mesh_of(s, 1.0, 2, seed), STEEL[2], [xc.line_crack([(-1.3, 0.0), (0.0, 0.0)])],
        supports=_imposed(_SQUARE[1:], u),
        loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
        contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, sif = quiet(problem)
    errors = {"K_II": abs(sif.K_II[0] / 0.5 - 1), "K_I": abs(sif.K_integral[0, 0]) / 0.5}
    lips = solution.contact[0]
    if lips is not None:
        p = float(np.sqrt(lips.measure @ (lips.pressure - 1) ** 2 / lips.measure.sum()))
        errors["pressure"] = p
    return Outcome({k: float(v) for k, v in errors.items()}, solution.n_dof)


def half_closed(s: Settings, seed: int) -> Outcome:
    """Crack [-1, 1] in [-2, 2]² bent so that a third of it is closed."""
    problem, K, end = _half_closed(s, seed)
    solution, sif = quiet(problem)
    right = int(np.argmax(sif.x[:, 0]))
    K_I = sif.K_integral[:, 0]
    errors = {"K_I": abs(K_I[right] / K - 1), "K_I, closed tip": abs(K_I[1 - right]) / K}
    lips = solution.contact[0]
    if lips is not None and lips.closed.any():
        errors["contact end"] = abs(float(lips.points[lips.closed, 0].max()) - end)
        exact = closure_pressure(lips.points[:, 0], 0.0)
        wrong = lips.pressure - exact
        errors["pressure"] = float(np.sqrt(lips.measure @ wrong**2 / (lips.measure @ exact**2)))
    return Outcome({k: float(v) for k, v in errors.items()}, solution.n_dof)


def half_closed_adapted(tolerance: float, seed: int) -> Outcome:
    """The crack in bending by `adapt` from a coarse mesh: all rounds, and the best K."""
    problem, K, _ = _half_closed(Settings(COARSE), seed)
    result = adapted(problem, tolerance)
    right = int(np.argmax(result.sif.x[:, 0]))
    return Outcome(
        {"K_I": abs(float(result.sif.best[right, 0]) / K - 1)}, result.rounds[-1].unknowns
    )


def _half_closed(s: Settings, seed: int) -> tuple[xc.Problem, float, float]:
    u, K, end = partial_closure(0.0)
    problem = xc.Problem(
        mesh_of(s, 2.0, 2, seed), STEEL[2], [xc.line_crack([(-1.0, 0.0), (1.0, 0.0)])],
        supports=_imposed(_SQUARE, u), contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    return problem, K, end


def worst(K: Floats, exact: Sequence[float]) -> float:
    """Largest relative error of the modes."""
    return float(np.max(np.abs(np.asarray(K) / np.asarray(exact) - 1)))
