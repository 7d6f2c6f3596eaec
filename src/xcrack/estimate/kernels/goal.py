"""K as a functional of the displacements: its weights at points, tested with functions."""

import math

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel


@kernel
def _half_angle(x, y, r, is_behind, side):  # type: ignore[no-untyped-def]
    """Cosine and sine of half the angle, continued along a lip that bends.

    Without trigonometry; the larger of the two by the root.
    """
    if x >= 0.0:
        c = math.sqrt(0.5 * (1.0 + x / r))
        s = 0.5 * y / (r * c)
    else:
        s = math.copysign(math.sqrt(0.5 * (1.0 - x / r)), y)
        c = 0.5 * y / (r * s)
    if is_behind and side * s < 0.0:
        return -c, -s
    return c, s


@kernel
def _bend(M, r, c, s):  # type: ignore[no-untyped-def]
    """Derivatives ahead of the gradient of a component, given by tip functions (4,)."""
    C, S, size = c * c - s * s, 2.0 * s * c, r * math.sqrt(r)
    c3, s3 = c * C - s * S, s * C + c * S
    # The tip functions by cosine and sine of half the angle, and of three times that.
    a, b, e, d = M[0] + 0.5 * M[2], M[1] + 0.5 * M[3], -0.5 * M[2], 0.5 * M[3]
    v = a * c + b * s + e * c3 + d * s3
    v1 = 0.5 * (b * c - a * s) + 1.5 * (d * c3 - e * s3)
    v2 = -0.25 * (a * c + b * s) - 2.25 * (e * c3 + d * s3)
    derivative_along, derivative_across = 0.5 * v * C - v1 * S, 0.5 * v * S + v1 * C
    slope_along = -0.5 * (v1 * C + v * S) - v2 * S
    slope_across = 0.5 * (v * C - v1 * S) + v2 * C
    return -(0.5 * derivative_along * C + slope_along * S) / size, -(
        0.5 * derivative_across * C + slope_across * S
    ) / size


@kernel
def _factor(  # type: ignore[no-untyped-def]
    x, y, is_behind, side, weight, r_outer, r_inner, frame, modes, lam, mu, change, result
):  # fmt: skip
    """Set the factors (2, 2, 2) of one point; False where there are none.

    The change of the stiffness from that of the tip (3, 3) counts unless it is None.
    """
    r = math.sqrt(x * x + y * y)
    if r >= r_outer or (r <= r_inner and change is None) or r == 0.0:
        return False
    c, s = _half_angle(x, y, r, is_behind, side)
    width = r_outer - r_inner
    z = (r - r_inner) / width
    if change is not None:
        z = max(z, 0.0)
    fall = -30.0 * z * z * (1.0 - z) * (1.0 - z) / (width * r) * weight
    dx, dy = fall * x, fall * y
    C, S = c * c - s * s, 2.0 * s * c
    root = 1.0 / math.sqrt(r)
    half_c, half_s = 0.5 * c, 0.5 * s
    # Derivatives of the four tip functions along (ahead, normal).
    x0, y0 = root * (half_c * C + half_s * S), root * (half_c * S - half_s * C)
    x1, y1 = root * (half_s * C - half_c * S), root * (half_s * S + half_c * C)
    slope = half_c * S + s * C
    x2, y2 = root * (half_s * S * C - slope * S), root * (half_s * S * S + slope * C)
    slope = c * C - half_s * S
    x3, y3 = root * (half_c * S * C - slope * S), root * (half_c * S * S + slope * C)
    for m in range(2):
        M = modes[m]
        a = M[0, 0] * x0 + M[0, 1] * x1 + M[0, 2] * x2 + M[0, 3] * x3
        b = M[1, 0] * x0 + M[1, 1] * x1 + M[1, 2] * x2 + M[1, 3] * x3
        g01 = M[0, 0] * y0 + M[0, 1] * y1 + M[0, 2] * y2 + M[0, 3] * y3
        g11 = M[1, 0] * y0 + M[1, 1] * y1 + M[1, 2] * y2 + M[1, 3] * y3
        s22 = lam * (a + g11) + 2.0 * mu * g11
        s12 = mu * (g01 + b)
        trace = lam * (a * dx + b * dy)
        f00 = trace + 2.0 * mu * a * dx + s12 * dy
        f11 = trace + 2.0 * mu * b * dy - dx * s22
        f01 = mu * (a * dy + b * dx) - dx * s12
        f10 = mu * (a * dy + b * dx) + s22 * dy
        if change is not None:
            q = weight * (1.0 - z * z * z * (10.0 - 15.0 * z + 6.0 * z * z))
            h00, h01 = _bend(M[0], r, c, s)
            h10, h11 = _bend(M[1], r, c, s)
            t0 = a * dx + q * h00
            t1 = b * dy + q * h11
            t2 = a * dy + b * dx + q * (h01 + h10)
            shear = change[2, 0] * t0 + change[2, 1] * t1 + change[2, 2] * t2
            f00 += change[0, 0] * t0 + change[0, 1] * t1 + change[0, 2] * t2
            f11 += change[1, 0] * t0 + change[1, 1] * t1 + change[1, 2] * t2
            f01 += shear
            f10 += shear
        for i in range(2):
            f_along = frame[0, i] * f00 + frame[1, i] * f10
            f_across = frame[0, i] * f01 + frame[1, i] * f11
            for j in range(2):
                result[i, j, m] = f_along * frame[0, j] + f_across * frame[1, j]
    return True


@kernel
def ring_factors(  # type: ignore[no-untyped-def]
    cell, bary, side, weight, points, cells, psi, tip, r_outer, r_inner, frame, modes, lam, mu,
    change,
):  # fmt: skip
    """Factors B of the displacement gradient in the domain integrals of modes I and II.

    With the unit field u^a, its stress and the weight q: B = C : (u^a_,1 x grad q) +
    (stress grad q) x e_1 - q_,1 stress in the frame (ahead, normal), turned into global axes.

    Parameters
    ----------
    cell, bary : (q,) array of int and (q, 3) array
    side : (q,) array of int
        Side of the crack, 0 where unknown; it counts in cells behind the tip, where psi < 0.
    weight : (q,) array
    points, cells : (n, 2) and (m, 3) arrays
    psi : (n,) array
    tip : (2,) array, length
    r_outer, r_inner : float, length
        The weight q falls from one to zero by a quintic between `r_inner` and `r_outer`.
    frame : (2, 2) array
    modes : (2, 2, 4) array
        Displacements of modes I and II by tip function.
    lam, mu : float
    change : (q, 3, 3) array or None
        Stiffness less that of the tip, in the frame, by strains and shear angle. None is compiled
        for itself.

    Returns
    -------
    (q, 2, 2, 2) array
        Component, derivative, mode; zero where grad q is and nothing changes.
    """
    result = zeros((len(weight), 2, 2, 2))
    for p in range(len(weight)):
        dx, dy, psi_sum = -tip[0], -tip[1], 0.0
        for b in range(3):
            node = cells[cell[p], b]
            dx += bary[p, b] * points[node, 0]
            dy += bary[p, b] * points[node, 1]
            psi_sum += psi[node]
        x, y = frame[0, 0] * dx + frame[0, 1] * dy, frame[1, 0] * dx + frame[1, 1] * dy
        _factor(
            x, y, psi_sum < 0.0, side[p], weight[p], r_outer, r_inner, frame, modes, lam, mu,
            None if change is None else change[p], result[p],
        )  # fmt: skip
    return result


@kernel
def plain_ring(  # type: ignore[no-untyped-def]
    plain_cells, points, cells, slopes, volume, side, psi, bary, share, tip, r_outer, r_inner,
    frame, modes, lam, mu, change,
):  # fmt: skip
    """The same integrals over plain cells, with each shape and surplus function of order 2.

    Parameters
    ----------
    plain_cells : (k,) array of int
    points, cells, slopes, volume : arrays
        Of the mesh; slopes are those of the barycentric coordinates.
    side : (m,) array of int
        Side of the crack on which a cell lies; it counts behind the tip, where psi < 0.
    psi : (n,) array
    bary, share : (q, 3) and (q,) arrays
        Points of a cell and their share of its volume.
    tip : (2,) array, length
    r_outer, r_inner, frame, modes, lam, mu : as in `ring_factors`
    change : (k, q or 1, 3, 3) array or None
        As in `ring_factors`, of the plain cells: at their points, or the same at all of them.

    Returns
    -------
    on_nodes : (k, 6, 2, 2) array
        Component, mode.
    on_surplus : (k, 4, 2, 2) array
        Cubics on edges in their local directions, and the bubble.
    turn : (2,) array
        Integral of B_12 - B_21 of each mode.
    """
    of_nodes, of_tips = zeros((len(plain_cells), 6, 2, 2)), zeros((len(plain_cells), 4, 2, 2))
    turn, B, d = zeros(2), empty((2, 2, 2)), empty((10, 2))
    for k in range(len(plain_cells)):
        e = plain_cells[k]
        G = slopes[e]
        is_behind = psi[cells[e, 0]] + psi[cells[e, 1]] + psi[cells[e, 2]] < 0.0
        for p in range(len(share)):
            dx, dy = -tip[0], -tip[1]
            for b in range(3):
                dx += bary[p, b] * points[cells[e, b], 0]
                dy += bary[p, b] * points[cells[e, b], 1]
            square = dx * dx + dy * dy
            if square >= r_outer * r_outer or (change is None and square <= r_inner * r_inner):
                continue
            x, y = frame[0, 0] * dx + frame[0, 1] * dy, frame[1, 0] * dx + frame[1, 1] * dy
            if not _factor(
                x,
                y,
                is_behind,
                side[e],
                share[p] * volume[e],
                r_outer,
                r_inner,
                frame,
                modes,
                lam,
                mu,
                None if change is None else change[k, min(p, change.shape[1] - 1)],
                B,
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
                        of_nodes[k, a, i, m] += B[i, 0, m] * d[a, 0] + B[i, 1, m] * d[a, 1]
                    for a in range(4):
                        of_tips[k, a, i, m] += B[i, 0, m] * d[6 + a, 0] + B[i, 1, m] * d[6 + a, 1]
    return of_nodes, of_tips, turn


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
    d, functionals, width = factor.shape[1], factor.shape[3], slope.shape[1]
    part = zeros((d, functionals, width))  # of a cell: its points mostly follow one another
    for q in range(len(row)):
        for i in range(d):
            for m in range(functionals):
                for j in range(d):
                    B = factor[number[q], i, j, m]
                    if B != 0.0:
                        for a in range(width):
                            part[i, m, a] += B * slope[q, a, j]
        if q + 1 < len(row) and row[q + 1] == row[q]:
            continue
        for a in range(width):
            f = functions[row[q], a]
            for i in range(d if f >= 0 else 0):
                for m in range(functionals):
                    total[f, i, m] += part[i, m, a]
        part[:] = 0.0
