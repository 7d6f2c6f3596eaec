"""Contact of crack faces: a primal-dual active set on a small dense problem.

With F = N K^-1 N^T and d = N u0 the pressures obey 0 <= lam, F lam + d >= 0, lam (F lam + d) = 0.
F depends on the crack alone: every load state shares it, and the factor behind it.
"""

import numpy as np
import scipy.linalg
import scipy.optimize

from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ConvergenceError
from xcrack.linalg.engine import StateContact

_MAX_SETS = 100
_REDUNDANT = 1e-7  # root of the eigenvalue, relative, below which groups count as dependent


def active_set(
    F: Floats, d: Floats, measure: Floats, stiffness: float, start: Bools
) -> StateContact:
    """Solve 0 <= lam, F lam + d >= 0 by a primal-dual active set.

    Parameters
    ----------
    F : (g, g) array
        Symmetric positive.
    d : (g,) array
        Weak gaps without pressure.
    measure : (g,) array
        Integral of each multiplier function.
    stiffness : float, stress / length
        Weighs gaps against pressures in the prediction; any size works, E / h is natural.
    start : (g,) array of bool
        First guess of the closed set.

    Raises
    ------
    ConvergenceError
        The fallback does not satisfy the conditions either.
    """
    visited_sets: set[bytes] = set()
    is_active = np.array(start, dtype=bool)
    for iteration in range(1, _MAX_SETS + 1):
        pressure, gap = of_set(F, d, is_active)
        # Values at round-off of zero (faces that only touch) must not make the set flicker.
        lam_scale = 1e-13 * float(np.abs(pressure).max(initial=0.0))
        trial = pressure - stiffness * gap / measure
        next_set = trial > lam_scale
        if (next_set == is_active).all():
            return StateContact(pressure, gap, is_active, iteration)
        key = next_set.tobytes()
        if key in visited_sets:
            break
        visited_sets.add(key)
        is_active = next_set
    return _least_squares_set(F, d, len(visited_sets))


def of_set(F: Floats, d: Floats, is_active: Bools) -> tuple[Floats, Floats]:
    """Pressures that close the groups of a set, and the gaps they leave."""
    pressure = np.zeros(len(d))
    if is_active.any():
        # Groups differ in size by many orders of magnitude: scaled, the matrix is well conditioned.
        scale = _scale(F)[is_active]
        block = F[np.ix_(is_active, is_active)] * scale[:, None] * scale
        pressure[is_active] = scale * _smallest_solution(block, -d[is_active] * scale)
    gap = F @ pressure + d
    gap[is_active] = 0.0
    return pressure, gap


def _scale(F: Floats) -> Floats:
    """Inverse roots of the diagonal, 0 for a group that no free unknown can move."""
    diagonal = np.diag(F)
    is_movable = diagonal > 0
    return np.where(is_movable, 1 / np.sqrt(np.where(is_movable, diagonal, 1.0)), 0.0)


def _smallest_solution(A: Floats, b: Floats) -> Floats:
    """Solution of a positive system; the smallest one where groups are redundant."""
    try:
        factor = scipy.linalg.cho_factor(A)
        if np.diag(factor[0]).min() > _REDUNDANT:
            return np.asarray(scipy.linalg.cho_solve(factor, b))
    except scipy.linalg.LinAlgError:
        pass
    return np.asarray(scipy.linalg.lstsq(A, b, cond=_REDUNDANT**2)[0])


def _least_squares_set(F: Floats, d: Floats, n_tried: int) -> StateContact:
    """Non-negative least squares on a root of F (Lawson and Hanson, 1974)."""
    scale = _scale(F)
    w, V = np.linalg.eigh((F + F.T) / 2 * scale[:, None] * scale)
    is_resolved = w > _REDUNDANT**2 * w[-1]
    root = np.sqrt(w[is_resolved])
    rhs = -(V[:, is_resolved].T @ (scale * d)) / root
    guess, _ = scipy.optimize.nnls(root[:, None] * V[:, is_resolved].T, rhs)
    is_active = guess > 0
    pressure, gap = of_set(F, d, is_active)
    size = float(np.abs(d).max(initial=0.0))
    if (gap < -1e-8 * size).any() or (pressure < -1e-8 * np.abs(pressure).max(initial=0)).any():
        raise ConvergenceError(
            f"contact: after {n_tried} sets and non-negative least squares, {int(is_active.sum())} "
            f"of {len(d)} groups are closed, with a smallest gap of {gap.min():.3g} and a smallest "
            f"pressure of {pressure.min():.3g}. Refine the mesh along the crack, or start from "
            'Numerics(initial_set="open").'
        )
    return StateContact(np.maximum(pressure, 0.0), gap, is_active, n_tried, fallback=True)
