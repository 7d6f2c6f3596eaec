"""Sums of functions times their unknowns at points."""

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
    for p in range(len(number)):
        to = number[p]
        for i in range(d):
            for j in range(d):
                for s in range(states):
                    gradient[to, i, j, s] = 0.0
        for a in range(slope.shape[1]):
            f = functions[row[p], a]
            if f < 0:
                continue
            for i in range(d):
                for s in range(states):
                    c = coefficients[f, i, s]
                    for j in range(d):
                        gradient[to, i, j, s] += slope[p, a, j] * c
