"""Contact of the lips: a primal-dual active set on a small dense problem.

With F = N K^-1 N^T and d = N u0 the pressures obey 0 <= lam, F lam + d >= 0, lam (F lam + d) = 0.
F depends on the crack alone: every load state shares it, and the factor behind it.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from xcrack.arrays import Bools, Floats
from xcrack.errors import ConvergenceError

_MAX_SETS = 100


@dataclass(frozen=True, eq=False)
class ActiveSet:
    """Solution of one contact problem.

    Attributes
    ----------
    pressure : (g,) array, stress
    gap : (g,) array
        Weak gaps, integrals of the function times the gap.
    active : (g,) array of bool
    iterations : int
        Sets tried.
    fallback : bool
        The set cycled and was found by non-negative least squares instead.
    """

    pressure: Floats
    gap: Floats
    active: Bools
    iterations: int
    fallback: bool


def active_set(F: Floats, d: Floats, measure: Floats, stiffness: float, start: Bools) -> ActiveSet:
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
    seen: set[bytes] = set()
    active = np.array(start, dtype=bool)
    for iteration in range(1, _MAX_SETS + 1):
        pressure, gap = _of_set(F, d, active)
        # Values at round-off of zero (lips that only touch) must not make the set flicker.
        lam_scale = 1e-13 * float(np.abs(pressure).max(initial=0.0))
        trial = pressure - stiffness * gap / measure
        new = trial > lam_scale
        if (new == active).all():
            return ActiveSet(pressure, gap, active, iteration, False)
        key = new.tobytes()
        if key in seen:
            break
        seen.add(key)
        active = new
    return _safe(F, d, len(seen))


def _of_set(F: Floats, d: Floats, active: Bools) -> tuple[Floats, Floats]:
    pressure = np.zeros(len(d))
    if active.any():
        block = F[np.ix_(active, active)]
        pressure[active] = scipy.linalg.solve(block, -d[active], assume_a="sym")
    gap = F @ pressure + d
    gap[active] = 0.0
    return pressure, gap


def _safe(F: Floats, d: Floats, tried: int) -> ActiveSet:
    """Non-negative least squares on the Cholesky factor (Lawson and Hanson, 1974)."""
    lower = np.linalg.cholesky((F + F.T) / 2)
    rhs = -scipy.linalg.solve_triangular(lower, d, lower=True)
    guess, _ = scipy.optimize.nnls(lower.T, rhs)
    active = guess > 0
    pressure, gap = _of_set(F, d, active)
    scale = float(np.abs(d).max(initial=0.0))
    if (gap < -1e-8 * scale).any() or (pressure < -1e-8 * np.abs(pressure).max(initial=0)).any():
        raise ConvergenceError(
            f"contact: after {tried} sets and non-negative least squares, {int(active.sum())} of "
            f"{len(d)} groups are closed, with a smallest gap of {gap.min():.3g} and a smallest "
            f"pressure of {pressure.min():.3g}. Refine the mesh along the lips, or start from "
            'Numerics(initial_set="open").'
        )
    return ActiveSet(np.maximum(pressure, 0.0), gap, active, tried, True)
