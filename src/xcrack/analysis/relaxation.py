"""How much of an initial stress the body cannot bear: its part out of balance."""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from xcrack.scene.conditions import InitialStress, Load, evaluate_stress
from xcrack.scene.problem import Problem
from xcrack.scene.temperature import Temperature
from xcrack.xfem.loads import body_points, load_vector, position
from xcrack.xfem.model import Model
from xcrack.xfem.stiffness import body_forces

_RESIDUAL = 1e-3  # of the conjugate gradients: the energy is then known to far better than 1 %
_MOST = 2000


def out_of_balance(problem: Problem, model: Model, loads: Sequence[Load]) -> float | None:
    """Share of the energy of the initial stress that relaxes in the body without cracks.

    A stress in equilibrium with free sides keeps all of its energy, one that is a strain in
    disguise keeps nothing (projection theorem). A change of temperature is left out: what it does
    is meant.

    Parameters
    ----------
    problem : Problem
    model : Model
    loads : sequence of loads

    Returns
    -------
    float or None
        Between 0 and 1; None where no such stress acts.
    """
    own = tuple(
        load
        for load in loads
        if isinstance(load, InitialStress) and not isinstance(load, Temperature)
    )
    if not own:
        return None
    space = model.space
    n = space.n_nodes * space.dim
    points = body_points(space)
    x = position(space, points.cell, points.bary)
    sigma = sum((evaluate_stress(load.value, x) for load in own), np.zeros((1, 1, 1)))
    stored = np.einsum("q,qij,qij->", points.weight, sigma, problem.material.strain(sigma))
    if stored <= 0:
        return None
    free = ~model.known.fixed[:n]
    f = np.where(free, load_vector(space, own, ())[:n], 0.0)
    matrix = model.bulk.matrix
    keep = sp.diags(free.astype(float))
    scale = np.where(free, 1 / matrix.diagonal(), 0.0)
    operator = LinearOperator(
        (n, n), matvec=lambda v: keep @ body_forces(matrix, keep @ v), dtype=float
    )
    smooth = LinearOperator((n, n), matvec=lambda v: scale * v, dtype=float)
    u = cg(operator, f, rtol=_RESIDUAL, maxiter=_MOST, M=smooth)[0]
    return float(np.clip(f @ u / stored, 0.0, 1.0))
