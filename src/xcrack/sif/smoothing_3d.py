"""Values along a front: smoothed, and read between and beyond the tops of the hats."""

import numpy as np
from scipy.interpolate import CubicSpline

from xcrack.base.arrays import Bools, Floats
from xcrack.crack.front_curve import FrontCurve

_RISE = 0.1  # of the largest value, by which a prolonged one may differ from the last
_STIFF = 0.05  # weight of the squares of third differences beside those of the changes
_GAP = 1.5  # of the usual distance of two places: a larger one is a gap
_TREND = 4  # values whose trend prolongs K: fewer would prolong their scatter


def smoothed(K: Floats, s: Floats, period: float | None) -> Floats:
    """Values at the tops of hats without their scatter (Whittaker 1923, third differences).

    Parameters
    ----------
    K : (..., p, 3) array
    s : (p,) array, length
        Positions, increasing, even but for gaps, across which nothing is smoothed.
    period : float, length, optional
        Of a closed front.

    Returns
    -------
    (..., p, 3) array
        Quadratics along the front stay as they are. A wave of n places is multiplied by
        1 / (1 + 0.05 (2 sin(π/n))^6), which is positive for every n: least-squares quadratics
        through five places turn waves of less than 2.7 places over, and a front that grows by such
        values feeds these waves.
    """
    count = K.shape[-2]
    if period is None:
        step = np.diff(s)
        even = np.convolve(step > _GAP * np.median(step), np.ones(3), "valid") == 0
        difference = np.diff(np.eye(count), 3, axis=0)[even]
    else:
        difference = np.eye(count)
        for _ in range(3):
            difference = np.roll(difference, -1, axis=0) - difference
    matrix = np.linalg.inv(np.eye(count) + _STIFF * difference.T @ difference)
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
