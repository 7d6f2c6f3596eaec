"""The scenes as xcrack solves them; each function gives the errors of one run.

A seed moves the inner points of the mesh by up to 15 % of a cell: a rank among errors is not to
hang on one lucky mesh.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

import xcrack as xc
from xcrack.arrays import Floats
from xcrack.bench.fields import (
    NU,
    E,
    Field,
    closure_pressure,
    edge_fields,
    partial_closure,
    penny,
    penny_K_I,
)

_SQUARE = ("left", "right", "bottom", "top")
STEEL = {2: xc.Isotropic(E, NU, "strain"), 3: xc.Isotropic(E, NU)}
MODES = (1.0, 0.5)  # K_I and K_II of the edge crack
PENNY = 0.5  # radius


@dataclass(frozen=True)
class Outcome:
    """What one run of a case gave.

    Attributes
    ----------
    errors : dict
        Relative errors by name; the first one is charted.
    unknowns : int
    parts : dict
        Seconds of parts that the scene times itself.
    later : callable () -> dict, optional
        Further errors, whose evaluation is no part of the work: called when the clock has stopped.
    took : (float, float), optional
        Wall and processor time of a run that took place in another process.
    """

    errors: dict[str, float]
    unknowns: int
    parts: dict[str, float] = field(default_factory=dict)
    later: Callable[[], dict[str, float]] | None = None
    took: tuple[float, float] | None = None


@dataclass(frozen=True)
class Settings:
    """Mesh and method of a run of xcrack.

    Attributes
    ----------
    n : int
        Cells a side.
    order : int, optional
    numerics : Numerics
    grading : float
        Coordinates are raised to this power: 1 for cells of one size, 1.5 for small cells at the
        middle.
    contact : str
    """

    n: int
    order: int | None = None
    numerics: xc.Numerics = field(default_factory=xc.Numerics)
    grading: float = 1.0
    contact: str = "auto"


def mesh_of(s: Settings, half: float, dim: int, seed: int) -> xc.Mesh:
    """A box [-half, half]^dim whose inner points are moved, then drawn to the middle."""
    plain = xc.box((-1.0,) * dim, (1.0,) * dim, s.n)
    x = np.array(plain.points)
    inner = (np.abs(x) < 1 - 1e-9).all(axis=1)
    move = np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), dim))
    x[inner] += 0.15 * 2 / s.n * move
    x = half * np.sign(x) * np.abs(x) ** s.grading
    return xc.Mesh(x, plain.cells, plain.facet_sets)


def quiet(problem: xc.Problem) -> tuple[xc.Solution, xc.SIF]:
    """Solution and K; coarse meshes clip the domain and say so, which is not news here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        solution = xc.solve(problem)
        return solution, xc.stress_intensity(solution)


def _imposed(sides: Sequence[str], u: Field) -> list[xc.scene.conditions.Displacement]:
    return [xc.displacement(side, lambda x: u(x)) for side in sides]


def edge(s: Settings, seed: int) -> Outcome:
    """Edge crack in [-1, 1]² under K_I = 1, K_II = 0.5, displacements given but for the left."""
    u, sigma = edge_fields(MODES)
    problem = xc.Problem(
        mesh_of(s, 1.0, 2, seed), STEEL[2], [xc.line_crack([(-1.3, 0.0), (0.0, 0.0)])],
        supports=_imposed(_SQUARE[1:], u),
        loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
        contact="off", order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, sif = quiet(problem)
    return Outcome(
        {"K": worst(sif.K[0], MODES)}, solution.n_dof,
        later=lambda: {"energy": xc.energy_error(solution, sigma)},
    )  # fmt: skip


def closed(s: Settings, seed: int) -> Outcome:
    """The edge crack under pressure 1 and K_II = 0.5: closed lips that slide."""
    u, sigma = edge_fields((0.0, 0.5), 1.0)
    problem = xc.Problem(
        mesh_of(s, 1.0, 2, seed), STEEL[2], [xc.line_crack([(-1.3, 0.0), (0.0, 0.0)])],
        supports=_imposed(_SQUARE[1:], u),
        loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
        contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, sif = quiet(problem)
    errors = {"K_II": abs(sif.K_II[0] / 0.5 - 1), "K_I": abs(sif.K_I[0]) / 0.5}
    lips = solution.contact[0]
    if lips is not None:
        p = float(np.sqrt(lips.measure @ (lips.pressure - 1) ** 2 / lips.measure.sum()))
        errors["pressure"] = p
    return Outcome({k: float(v) for k, v in errors.items()}, solution.n_dof)


def half_closed(s: Settings, seed: int) -> Outcome:
    """Crack [-1, 1] in [-2, 2]² bent so that a third of it is closed."""
    u, K, end = partial_closure(0.0)
    problem = xc.Problem(
        mesh_of(s, 2.0, 2, seed), STEEL[2], [xc.line_crack([(-1.0, 0.0), (1.0, 0.0)])],
        supports=_imposed(_SQUARE, u), contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, sif = quiet(problem)
    right = int(np.argmax(sif.x[:, 0]))
    errors = {"K_I": abs(sif.K_I[right] / K - 1), "K_I, closed tip": abs(sif.K_I[1 - right]) / K}
    lips = solution.contact[0]
    if lips is not None and lips.closed.any():
        errors["contact end"] = abs(float(lips.points[lips.closed, 0].max()) - end)
        exact = closure_pressure(lips.points[:, 0], 0.0)
        wrong = lips.pressure - exact
        errors["pressure"] = float(np.sqrt(lips.measure @ wrong**2 / (lips.measure @ exact**2)))
    return Outcome({k: float(v) for k, v in errors.items()}, solution.n_dof)


def worst(K: Floats, exact: Sequence[float]) -> float:
    """Largest relative error of the modes."""
    return float(np.max(np.abs(np.asarray(K) / np.asarray(exact) - 1)))


def penny_open(s: Settings, seed: int) -> Outcome:
    """Penny of radius 0.5 in [-1, 1]³ under tension 1, exact displacements on the sides."""
    return _penny(s, seed, (1.0, 0.0))


def penny_closed(s: Settings, seed: int) -> Outcome:
    """The penny under pressure 1 and shear 0.4: closed lips that slide."""
    return _penny(s, seed, (-1.0, 0.4))


def _penny(s: Settings, seed: int, stress: tuple[float, float]) -> Outcome:
    a, u = PENNY, penny(PENNY, *stress)
    problem = xc.Problem(
        mesh_of(s, 1.0, 3, seed), STEEL[3], [xc.penny_crack((0, 0, 0), (0, 0, 1), a)],
        supports=[xc.displacement("boundary", lambda x: u(x))],
        contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, sif = quiet(problem)
    root = np.sqrt(a / np.pi)
    if stress[0] > 0:
        exact = penny_K_I(a, stress[0])
        errors = {
            "K_I": float(abs(sif.K_I.mean() / exact - 1)),
            "scatter": float(np.std(sif.K_I) / exact),
            "rms": float(np.sqrt(np.mean((sif.K_I / exact - 1) ** 2))),
        }
        return Outcome(errors, solution.n_dof)
    largest = 4 / (2 - NU) * stress[1] * root
    along = 4 * (1 - NU) / (2 - NU) * stress[1] * root
    K_II = largest * sif.frame[:, 0, 0]
    K_III = along * sif.frame[:, 2, 0]
    shear = np.hypot(sif.K_II - K_II, sif.K_III - K_III)
    errors = {
        "K_II, K_III": float(np.sqrt((shear**2).mean())) / largest,
        "K_I": float(np.abs(sif.K_I).max()) / largest,
    }
    return Outcome(errors, solution.n_dof)
