"""What K at the tips of 2D and along the fronts of 3D share."""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.scene.conditions import CrackPressure, Load, evaluate_scalar


def weight(r: Floats, xi: Floats, inner: Floats, outer: Floats) -> tuple[Floats, Floats]:
    """Weight q of a domain integral, one inside and zero outside by a quintic, and its gradient.

    Parameters
    ----------
    r : (q,) array, length
        Distance to the tip.
    xi : (q, d) array, length
        Places from the tip.
    inner, outer : (k,) arrays, length
        Radii of each domain between which q falls.

    Returns
    -------
    q : (k, q) array
    gradient : (k, q, d) array, 1/length
    """
    inner = inner[:, None]
    width = outer[:, None] - inner
    z = np.clip((r - inner) / width, 0.0, 1.0)
    q = 1 - z**3 * (10 - 15 * z + 6 * z**2)
    slope = -30 * z**2 * (1 - z) ** 2 / width
    return q, slope[..., None] * (xi / np.maximum(r, 1e-300)[:, None])[None]


def weight_integral(inner: Floats, outer: Floats) -> Floats:
    """Integral of the weight q over a section of the tube around a front `(k,)`, length²."""
    width = outer - inner
    return np.asarray(2 * np.pi * (inner**2 / 2 + width * (inner / 2 + width / 7)))


def mean_rotation(solution: Solution, distance: Floats, radius: float) -> Floats:
    """Mean rotation of the mesh points around a tip or front `(d, d)`.

    A rigid rotation adds nothing to the integrals but the quadrature error of terms that would
    vanish.

    Parameters
    ----------
    solution : Solution
    distance : (n,) array, length
        Of the mesh points to the tip or front.
    radius : float, length
    """
    points = solution.space.mesh.points
    d = points.shape[1]
    near = np.nonzero(distance < radius)[0]
    if len(near) <= d:
        return np.zeros((d, d))
    y, u = np.zeros((2, len(near), 3))  # 2D turns about the third axis
    x = points[near]
    y[:, :d], u[:, :d] = x - x.mean(axis=0), solution.coefficients[near]
    square, product = y.T @ y, y.T @ u
    inertia = square.trace() * np.eye(3) - square
    turning = product - product.T
    moment = np.array([turning[1, 2], turning[2, 0], turning[0, 1]])
    w = np.linalg.solve(inertia, moment)
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])[:d, :d]


def lip_pressure(solution: Solution, c: int) -> Floats:
    """Pressure on the faces of crack c at their points: multipliers and given pressure `(q,)`.

    Parameters
    ----------
    solution : Solution
    c : int
    """
    lips, contact = solution.lips[c], solution.contact[c]
    total = np.zeros(len(lips)) if contact is None else np.array(contact.pressure)
    for load in solution.loads:
        if isinstance(load, CrackPressure) and load.crack in (None, c):
            given = evaluate_scalar(load.value, lips.x, "crack_pressure")
            total = total + solution.factor * given
    return total


def lip_shear(solution: Solution, c: int) -> Floats | None:
    """Tangential traction on lip + of crack c at its points `(q, d)`; None without friction.

    Parameters
    ----------
    solution : Solution
    c : int
    """
    contact = solution.contact[c]
    if contact is None or contact.shear is None or contact.tangent is None:
        return None
    if contact.shear.ndim == 1:
        return np.asarray(contact.shear[:, None] * contact.tangent)
    return np.einsum("qm,qmd->qd", contact.shear, contact.tangent)


def acts(solutions: Sequence[Solution], *kinds: type[Load]) -> bool:
    """Whether loads of one of these kinds act in any of the states."""
    return any(isinstance(load, kinds) for s in solutions for load in s.loads)
