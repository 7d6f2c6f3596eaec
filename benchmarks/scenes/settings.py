"""Mesh and method of a run of xcrack.

A seed moves the inner points of the mesh by up to 15 % of a cell: a rank among errors is not to
depend on one lucky mesh.
"""

import warnings
from dataclasses import dataclass, field

import numpy as np

import xcrack as xc
from xcrack.adaptivity.adaptation import Adaptation


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
    """A box [-half, half]^dim whose inner points are moved, then drawn to the middle.

    Parameters
    ----------
    s : Settings
    half : float
    dim : {2, 3}
    seed : int
    """
    plain = xc.box((-1.0,) * dim, (1.0,) * dim, s.n)
    x = np.array(plain.points)
    inner = (np.abs(x) < 1 - 1e-9).all(axis=1)
    move = np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), dim))
    x[inner] += 0.15 * 2 / s.n * move
    x = half * np.sign(x) * np.abs(x) ** s.grading
    return xc.Mesh(x, plain.cells, plain.facet_sets)


def adapted(problem: xc.Problem, tolerance: float) -> Adaptation:
    """The scene on the mesh that `adapt` makes, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return xc.adapt(problem, tolerance, progress=False)


def quiet(problem: xc.Problem) -> tuple[xc.Solution, xc.SIF]:
    """Solution and K without warnings: that coarse meshes clip the domain is no news here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        solution = xc.solve(problem)
        return solution, xc.stress_intensity(solution)
