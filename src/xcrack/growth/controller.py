"""How long the next step may be for a wanted error of path and life."""

import numpy as np

_SHARE = 0.15  # of a correction: what is left of it as an error, as a rule
_LEAST = 1e-3  # a step without any correction does not ask for an endless next one
_SAFE = 0.9
_NOW, _BEFORE = 0.35, 0.15  # exponents of the last error and of the one before
_FIRST = 0.5  # exponent after the first step, whose predictor is of first order
_CHANGE, _FIRST_CHANGE = (0.4, 1.6), (0.5, 1.6)
_CELLS = 2.0  # shortest step: K on a shorter face is that of a kink between two cells
REJECTED = 2.0  # errors from which on a step is done again with a shorter one


def step_error(
    turned: float, length: float, cycles: float, lower: float, tolerance: float
) -> float:
    """Error of a step in units of the tolerance, at least a thousandth.

    Parameters
    ----------
    turned : float, length
        Largest correction of a tip.
    length : float, length
        Of the step.
    cycles, lower : float
        Cycles of the step by three solves and by two.
    tolerance : float
        Of the path, relative to the length grown, and of the life.
    """
    path = _SHARE * turned / (length * tolerance)
    life = _SHARE * abs(cycles / lower - 1) / tolerance if lower > 0 else 0.0
    return float(max(path, life, _LEAST))


def first_length(size: float, tolerance: float, cell: float) -> float:
    """Length of the first step for a crack of some size in cells of some size."""
    return float(max(0.8 * size * np.sqrt(tolerance), _CELLS * cell))


def next_length(length: float, error: float, before: float | None, cell: float) -> float:
    """Length of the next step.

    Parameters
    ----------
    length : float, length
        Of the last step.
    error : float
        `step_error` of it.
    before : float or None
        That of the step before; None after the first step, and to do a step again.
    cell : float, length

    Returns
    -------
    float, length

    Notes
    -----
    Proportional and integral control (Gustafsson 1991) for a rule of second order.
    """
    if before is None:
        factor = np.clip(_SAFE * error**-_FIRST, *_FIRST_CHANGE)
    else:
        factor = np.clip(_SAFE * error**-_NOW * before**_BEFORE, *_CHANGE)
    return float(max(length * factor, _CELLS * cell))


__all__ = ["REJECTED", "first_length", "next_length", "step_error"]
