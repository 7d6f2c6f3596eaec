"""Sums of functions times their unknowns at points, and the places of points."""

import numpy as np

from xcrack.kernels.jit import kernel


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
    total = np.empty((d, d, states))
    for p in range(len(number)):
        total[:] = 0.0
        for a in range(slope.shape[1]):
            f = functions[row[p], a]
            if f < 0:
                continue
            for j in range(d):
                steep = slope[p, a, j]
                for i in range(d):
                    for s in range(states):
                        total[i, j, s] += steep * coefficients[f, i, s]
        gradient[number[p]] = total


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
