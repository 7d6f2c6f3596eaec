"""K as a functional of the displacements: its weights at points, tested with functions."""

import math

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def ring_factors(xi, theta, weight, outer, inner, frame, modes, lam, mu, scale):  # type: ignore[no-untyped-def]
    """Factors B of the displacement gradient in the domain integrals of modes I and II.

    With the unit field u^a, its stress and the weight q: B = C : (u^a_,1 x grad q) +
    (stress grad q) x e_1 - q_,1 stress in the frame (ahead, normal), turned into global axes.

    Parameters
    ----------
    xi : (q, 2) array, length
        Places from the tip, in its frame.
    theta : (q,) array
        Angle, continued along the lips.
    weight : (q,) array
    outer, inner : float, length
        The weight q falls from one to zero by a quintic between inner and outer.
    frame : (2, 2) array
    modes : (2, 2, 4) array
        Displacements of modes I and II by tip function.
    lam, mu : float
    scale : float

    Returns
    -------
    (q, 2, 2, 2) array
        Component, derivative, mode; zero where grad q is.
    """
    result = np.zeros((len(weight), 2, 2, 2))
    ahead, normal, g = np.empty(4), np.empty(4), np.empty((2, 2))
    width = outer - inner
    for p in range(len(weight)):
        x, y = xi[p, 0], xi[p, 1]
        r = math.sqrt(x * x + y * y)
        if r >= outer or r <= inner:
            continue
        z = (r - inner) / width
        fall = -30.0 * z * z * (1.0 - z) * (1.0 - z) / (width * r) * weight[p] * scale
        dx, dy = fall * x, fall * y
        c, s = math.cos(0.5 * theta[p]), math.sin(0.5 * theta[p])
        C, S = c * c - s * s, 2.0 * s * c
        root = 1.0 / math.sqrt(r)
        value = (c, s, s * S, c * S)
        slope = (-s / 2, c / 2, c * S / 2 + s * C, -s * S / 2 + c * C)
        for f in range(4):
            ahead[f] = root * (0.5 * value[f] * C - slope[f] * S)
            normal[f] = root * (0.5 * value[f] * S + slope[f] * C)
        for m in range(2):
            for i in range(2):
                g[i, 0] = 0.0
                g[i, 1] = 0.0
                for f in range(4):
                    g[i, 0] += modes[m, i, f] * ahead[f]
                    g[i, 1] += modes[m, i, f] * normal[f]
            trace = lam * (g[0, 0] + g[1, 1])
            s22 = trace + 2.0 * mu * g[1, 1]
            s12 = mu * (g[0, 1] + g[1, 0])
            a, b = g[0, 0], g[1, 0]
            trace = lam * (a * dx + b * dy)
            f00 = trace + 2.0 * mu * a * dx + s12 * dy
            f11 = trace + 2.0 * mu * b * dy - dx * s22
            f01 = mu * (a * dy + b * dx) - dx * s12
            f10 = mu * (a * dy + b * dx) + s22 * dy
            for i in range(2):
                for j in range(2):
                    result[p, i, j, m] = frame[0, i] * (
                        f00 * frame[0, j] + f01 * frame[1, j]
                    ) + frame[1, i] * (f10 * frame[0, j] + f11 * frame[1, j])
    return result


@kernel
def add_to_functions(total, functions, row, number, slope, factor):  # type: ignore[no-untyped-def]
    """Add factor : grad v of each function and component.

    Parameters
    ----------
    total : (n, d, m) array
        Changed in place.
    functions : (b, k) array of int
        Negative for an empty place.
    row : (q,) array of int
        Place of each point in `functions`.
    number : (q,) array of int
        Its place in `factor`.
    slope : (q, k, d) array
        Gradients of the functions.
    factor : (p, d, d, m) array
        Component, derivative, functional.
    """
    d, functionals = factor.shape[1], factor.shape[3]
    for q in range(len(row)):
        p = number[q]
        for a in range(slope.shape[1]):
            f = functions[row[q], a]
            if f < 0:
                continue
            for i in range(d):
                for m in range(functionals):
                    value = 0.0
                    for j in range(d):
                        value += factor[p, i, j, m] * slope[q, a, j]
                    total[f, i, m] += value
