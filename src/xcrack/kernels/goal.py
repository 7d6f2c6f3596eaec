"""K as a functional of the displacements: its weights at points, tested with functions."""

import math

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def _factor(  # type: ignore[no-untyped-def]
    x, y, c, s, weight, outer, inner, frame, modes, lam, mu, g, result
):
    """Set the factors (2, 2, 2) of one point at half the angle (c, s); False where grad q is 0."""
    r = math.sqrt(x * x + y * y)
    if r >= outer or r <= inner:
        return False
    width = outer - inner
    z = (r - inner) / width
    fall = -30.0 * z * z * (1.0 - z) * (1.0 - z) / (width * r) * weight
    dx, dy = fall * x, fall * y
    C, S = c * c - s * s, 2.0 * s * c
    root = 1.0 / math.sqrt(r)
    value = (c, s, s * S, c * S)
    slope = (-s / 2, c / 2, c * S / 2 + s * C, -s * S / 2 + c * C)
    for m in range(2):
        for i in range(2):
            g[i, 0] = 0.0
            g[i, 1] = 0.0
            for f in range(4):
                g[i, 0] += modes[m, i, f] * root * (0.5 * value[f] * C - slope[f] * S)
                g[i, 1] += modes[m, i, f] * root * (0.5 * value[f] * S + slope[f] * C)
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
                result[i, j, m] = frame[0, i] * (f00 * frame[0, j] + f01 * frame[1, j]) + frame[
                    1, i
                ] * (f10 * frame[0, j] + f11 * frame[1, j])
    return True


@kernel
def ring_factors(xi, theta, weight, outer, inner, frame, modes, lam, mu):  # type: ignore[no-untyped-def]
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

    Returns
    -------
    (q, 2, 2, 2) array
        Component, derivative, mode; zero where grad q is.
    """
    result, g = np.zeros((len(weight), 2, 2, 2)), np.empty((2, 2))
    for p in range(len(weight)):
        c, s = math.cos(0.5 * theta[p]), math.sin(0.5 * theta[p])
        _factor(
            xi[p, 0], xi[p, 1], c, s, weight[p], outer, inner, frame, modes, lam, mu, g, result[p]
        )
    return result


@kernel
def plain_ring(  # type: ignore[no-untyped-def]
    chosen, points, cells, slopes, volume, side, psi, bary, share, tip, outer, inner, frame, modes,
    lam, mu,
):  # fmt: skip
    """The same integrals over plain cells, with each shape and surplus function of order 2.

    Parameters
    ----------
    chosen : (k,) array of int
    points, cells, slopes, volume : arrays
        Of the mesh; slopes are those of the barycentric coordinates.
    side : (m,) array of int
        Side of the crack on which a cell lies; it counts behind the tip, where psi < 0.
    psi : (n,) array
    bary, share : (q, 3) and (q,) arrays
        Points of a cell and their share of its volume.
    tip : (2,) array, length
    outer, inner, frame, modes, lam, mu : as in `ring_factors`

    Returns
    -------
    on_nodes : (k, 6, 2, 2) array
        Component, mode.
    on_surplus : (k, 4, 2, 2) array
        Cubics on edges in their local directions, and the bubble.
    turn : (2,) array
        Integral of B_12 - B_21 of each mode.
    """
    nodal, extra = np.zeros((len(chosen), 6, 2, 2)), np.zeros((len(chosen), 4, 2, 2))
    turn, g, B, d = np.zeros(2), np.empty((2, 2)), np.empty((2, 2, 2)), np.empty((10, 2))
    for k in range(len(chosen)):
        e = chosen[k]
        G = slopes[e]
        behind = psi[cells[e, 0]] + psi[cells[e, 1]] + psi[cells[e, 2]] < 0.0
        for p in range(len(share)):
            dx, dy = -tip[0], -tip[1]
            for b in range(3):
                dx += bary[p, b] * points[cells[e, b], 0]
                dy += bary[p, b] * points[cells[e, b], 1]
            if not inner * inner < dx * dx + dy * dy < outer * outer:
                continue
            x, y = frame[0, 0] * dx + frame[0, 1] * dy, frame[1, 0] * dx + frame[1, 1] * dy
            angle = math.atan2(y, x)
            if behind and side[e] > 0 and angle < 0.0:
                angle += 2.0 * math.pi
            elif behind and side[e] < 0 and angle > 0.0:
                angle -= 2.0 * math.pi
            c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
            if not _factor(
                x, y, c, s, share[p] * volume[e], outer, inner, frame, modes, lam, mu, g, B
            ):
                continue
            u, v, w = bary[p, 0], bary[p, 1], bary[p, 2]
            for j in range(2):
                gu, gv, gw = G[0, j], G[1, j], G[2, j]
                d[0, j] = (4.0 * u - 1.0) * gu
                d[1, j] = (4.0 * v - 1.0) * gv
                d[2, j] = (4.0 * w - 1.0) * gw
                d[3, j] = 4.0 * (u * gv + v * gu)
                d[4, j] = 4.0 * (u * gw + w * gu)
                d[5, j] = 4.0 * (v * gw + w * gv)
                d[6, j] = (2.0 * u * v - v * v) * gu + (u * u - 2.0 * u * v) * gv
                d[7, j] = (2.0 * u * w - w * w) * gu + (u * u - 2.0 * u * w) * gw
                d[8, j] = (2.0 * v * w - w * w) * gv + (v * v - 2.0 * v * w) * gw
                d[9, j] = v * w * gu + u * w * gv + u * v * gw
            for m in range(2):
                turn[m] += B[0, 1, m] - B[1, 0, m]
                for i in range(2):
                    for a in range(6):
                        nodal[k, a, i, m] += B[i, 0, m] * d[a, 0] + B[i, 1, m] * d[a, 1]
                    for a in range(4):
                        extra[k, a, i, m] += B[i, 0, m] * d[6 + a, 0] + B[i, 1, m] * d[6 + a, 1]
    return nodal, extra, turn


@kernel
def add_cells(total, functions, factor, values):  # type: ignore[no-untyped-def]
    """Add factor x values of the functions of cells.

    Parameters
    ----------
    total : (n, d, m) array
        Changed in place.
    functions : (k, f) array of int
        Negative for an empty place.
    factor : (k, f) array
    values : (k, f, d, m) array
    """
    for k in range(values.shape[0]):
        for a in range(values.shape[1]):
            f = functions[k, a]
            if f >= 0:
                for i in range(values.shape[2]):
                    for m in range(values.shape[3]):
                        total[f, i, m] += factor[k, a] * values[k, a, i, m]


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
