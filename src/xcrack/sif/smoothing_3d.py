"""Values along a front: smoothed, and read between and beyond the tops of the hats."""

import numpy as np
from scipy.interpolate import CubicSpline

from xcrack.arrays import Bools, Floats
from xcrack.crack.front_curve import FrontCurve

_RISE = 0.1  # of the largest value, by which a prolonged one may differ from the last
_TREND = 4  # values whose trend prolongs K: fewer would prolong their scatter


def smoothed(K: Floats, s: Floats, period: float | None, window: int = 5) -> Floats:
    """Least-squares quadratics through the values around each one (Savitzky and Golay, 1964).

    Parameters
    ----------
    K : (..., p, 3) array
    s : (p,) array, length
        Positions, increasing.
    period : float, length, optional
        Of a closed front.
    window : int
        Values each quadratic runs through; linear and quadratic variation stays as it is.

    Returns
    -------
    (..., p, 3) array
    """
    count = len(s)
    if count < window:
        return np.array(K)
    matrix = np.zeros((count, count))
    for j in range(count):
        if period is None:
            first = min(max(j - window // 2, 0), count - window)
            pick = np.arange(first, first + window)
            away = s[pick] - s[j]
        else:
            pick = (j + np.arange(window) - window // 2) % count
            away = np.mod(s[pick] - s[j] + period / 2, period) - period / 2
        size = np.abs(away).max()
        matrix[j, pick] = np.linalg.pinv(np.vander(away / size, 3, increasing=True))[0]
    return np.einsum("jp,...pm->...jm", matrix, K)


def along(K: Floats, knots: Floats, valid: Bools, curve: FrontCurve, s: Floats) -> Floats:
    """K at parameters s, from its values at valid tops of hats.

    Parameters
    ----------
    K : (..., p, 3) array
    knots : (p,) array, length
    valid : (p,) array of bool
    curve : FrontCurve
    s : (m,) array, length

    Returns
    -------
    (..., m, 3) array
        Prolonged by the trend of the last four values to the next top of a hat beyond the valid
        ones, by at most a tenth of the largest value, constant from there.
    """
    rows = np.nonzero(valid)[0]
    if len(rows) < 2:
        value = K[..., rows, :] if len(rows) else np.full((*K.shape[:-2], 1, 3), np.nan)
        return np.repeat(value, len(s), axis=-2)
    values = np.moveaxis(K[..., rows, :], -2, 0)
    if curve.closed and valid.all():
        grid = np.append(knots, knots[0] + curve.length)
        spline = CubicSpline(grid, np.concatenate([values, values[:1]]), bc_type="periodic")
        return np.moveaxis(spline(np.mod(s - knots[0], curve.length) + knots[0]), 0, -2)
    at = np.asarray(s, dtype=float)
    if curve.closed:
        # The invalid part is left out: s runs from the first valid top behind the widest gap.
        gap = np.diff(np.append(knots[rows], knots[rows[0]] + curve.length))
        turn = (int(np.argmax(gap)) + 1) % len(rows)
        start = knots[rows[turn]]
        grid = np.mod(np.roll(knots[rows], -turn) - start, curve.length)
        values = np.roll(values, -turn, axis=0)
        at = np.mod(at - start, curve.length)
        at = np.where(at > (grid[-1] + curve.length) / 2, at - curve.length, at)
    else:
        grid = knots[rows]
    step = curve.length / len(knots) if curve.closed else float(knots[1] - knots[0])
    bounded = np.clip(at, grid[0] - step, grid[-1] + step)
    inner = np.clip(bounded, grid[0], grid[-1])
    spline = CubicSpline(grid, values, bc_type="not-a-knot")
    slope = [_slope(grid[:_TREND], values[:_TREND]), _slope(grid[-_TREND:], values[-_TREND:])]
    over = bounded - inner
    shape = (-1,) + (1,) * (values.ndim - 1)
    rise = np.where((over < 0).reshape(shape), slope[0], slope[1]) * over.reshape(shape)
    # A trend of scattered values would let the ends of a growing front run ahead or stay behind.
    most = _RISE * np.abs(values).max(axis=0)
    rise = np.clip(rise, -most, most)
    return np.moveaxis(spline(inner) + rise, 0, -2)


def _slope(s: Floats, values: Floats) -> Floats:
    """Slope of the line of least squares through values `(k, ...)`."""
    away = s - s.mean()
    return np.tensordot(away, values, axes=1) / (away @ away)
