"""Sums of functions times their unknowns at points, and the places of points."""

import numpy as np

from xcrack.base.kernels.jit import kernel


@kernel
def set_gradients(gradient, number, slope, functions, row, coefficients):  # type: ignore[no-untyped-def]
    """Set the gradients of displacements at some points.

    Parameters
    ----------
    gradient : (q, d, d, s) array
        Component, derivative, state; changed in place.
    number : (k,) array of int
        Points that are set.
    slope : (k, n, d) array
        Gradients of the functions there.
    functions : (m, n) array of int
        Negative where there is none.
    row : (k,) array of int
        Place of each point in `functions`.
    coefficients : (f, d, s) array
    """
    d, states = coefficients.shape[1], coefficients.shape[2]
    for p in range(len(number)):
        to = number[p]
        for i in range(d):
            for s in range(states):
                x, y, z = 0.0, 0.0, 0.0  # in 2D y and z are the same
                for a in range(slope.shape[1]):
                    f = functions[row[p], a]
                    if f >= 0:
                        c = coefficients[f, i, s]
                        x += slope[p, a, 0] * c
                        y += slope[p, a, 1] * c
                        z += slope[p, a, d - 1] * c
                gradient[to, i, 0, s] = x
                gradient[to, i, 1, s] = y
                gradient[to, i, d - 1, s] = z


@kernel
def places(cell, bary, points, cells):  # type: ignore[no-untyped-def]
    """Coordinates of points in cells `(q, d)`.

    Parameters
    ----------
    cell : (q,) array of int
    bary : (q, d + 1) array
    points, cells : (n, d) and (m, d + 1) arrays
    """
    x = np.zeros((len(cell), points.shape[1]))
    for q in range(len(cell)):
        for b in range(bary.shape[1]):
            node = cells[cell[q], b]
            for j in range(points.shape[1]):
                x[q, j] += bary[q, b] * points[node, j]
    return x
