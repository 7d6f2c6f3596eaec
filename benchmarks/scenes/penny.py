"""Penny-shaped cracks in a cube, open and closed."""

import numpy as np

import xcrack as xc
from benchmarks.runs import Outcome
from benchmarks.scenes.exact_fields import (
    penny,
    penny_K_I,
    penny_largest_K_II,
    penny_shear_K,
)
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings, mesh_of, quiet

RADIUS = 0.5
_SHEAR = 0.4


def penny_open(s: Settings, seed: int) -> Outcome:
    """Penny of radius 0.5 in [-1, 1]³ under tension 1, exact displacements on the sides."""
    solution, sif = _solved(s, seed, 1.0, 0.0)
    exact = penny_K_I(RADIUS, 1.0)
    errors = {
        "K_I": float(abs(sif.K_I.mean() / exact - 1)),
        "scatter": float(np.std(sif.K_I) / exact),
        "rms": float(np.sqrt(np.mean((sif.K_I / exact - 1) ** 2))),
    }
    return Outcome(errors, solution.n_dof)


def penny_closed(s: Settings, seed: int) -> Outcome:
    """The penny under pressure 1 and shear 0.4: closed faces that slide."""
    solution, sif = _solved(s, seed, -1.0, _SHEAR)
    exact = penny_shear_K(RADIUS, _SHEAR, sif.frame)
    largest = penny_largest_K_II(RADIUS, _SHEAR)
    wrong = np.linalg.norm(sif.K[:, 1:] - exact, axis=1)
    errors = {
        "K_II, K_III": float(np.sqrt((wrong**2).mean())) / largest,
        "K_I": float(np.abs(sif.K_integral[:, 0]).max()) / largest,
    }
    return Outcome(errors, solution.n_dof)


def _solved(
    s: Settings, seed: int, tension: float, shear: float
) -> tuple[xc.Solution, xc.SIF]:  # fmt: skip
    u = penny(RADIUS, tension, shear)
    problem = xc.Problem(
        mesh_of(s, 1.0, 3, seed), STEEL[3], [xc.penny_crack((0, 0, 0), (0, 0, 1), RADIUS)],
        supports=[xc.displacement("boundary", lambda x: u(x))],
        contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    return quiet(problem)
