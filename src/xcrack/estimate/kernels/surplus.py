"""Residuals and blocks of the surplus functions: cubics on edges, a bubble in each triangle."""

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel


@kernel
def _slopes(bary, gradient, sign, slopes):  # type: ignore[no-untyped-def]
    """Gradients of the four functions of a cell at a point, into `slopes` (4, 2)."""
    x, y, z = bary[0], bary[1], bary[2]
    for j in range(2):
        gx, gy, gz = gradient[0, j], gradient[1, j], gradient[2, j]
        slopes[0, j] = sign[0] * ((2 * x * y - y * y) * gx + (x * x - 2 * x * y) * gy)
        slopes[1, j] = sign[1] * ((2 * x * z - z * z) * gx + (x * x - 2 * x * z) * gz)
        slopes[2, j] = sign[2] * ((2 * y * z - z * z) * gy + (y * y - 2 * y * z) * gz)
        slopes[3, j] = y * z * gx + x * z * gy + x * y * gz


@kernel
def _is_same_side(cell, side, q):  # type: ignore[no-untyped-def]
    """Whether the next point lies in the same cell, on the same sides."""
    if q + 1 == len(cell) or cell[q + 1] != cell[q]:
        return False
    for c in range(side.shape[1]):
        if side[q + 1, c] != side[q, c]:
            return False
    return True


@kernel
def _hand_over(part, residual, functions, copy, crack, side):  # type: ignore[no-untyped-def]
    """Add the part (2, m, 4) of a cell to its functions and their copies, and clear it."""
    for a in range(4):
        f = functions[a]
        h = copy[f]
        jump = float(side[crack[f]])
        for i in range(2):
            for m in range(part.shape[1]):
                residual[f, i, m] += part[i, m, a]
                if h >= 0:
                    residual[h, i, m] += jump * part[i, m, a]
    part[:] = 0.0


@kernel
def add_functional(residual, cell, bary, side, factor, functions, sign, copy, crack, gradient):  # type: ignore[no-untyped-def]
    """Add factor : grad w at points to the last columns of the residuals.

    Parameters
    ----------
    residual : (n, 2, m) array
        Changed in place.
    cell : (q,) array of int
    bary : (q, 3) array
    side : (q, cracks) array of int
    factor : (q, 2, 2, m) array
        Component, derivative, column.
    functions : (cells, 4) array of int
    sign : (cells, 3) array
    copy, crack : (n - copies,) arrays of int
        Number of each function's copy, negative where there is none, and whose side it takes.
    gradient : (cells, 3, 2) array
    """
    slope, part = empty((4, 2)), zeros((2, factor.shape[3], 4))
    for q in range(len(cell)):
        e, is_used = cell[q], factor[q, 0, 0, 0] != 0.0
        if not is_used:
            for i in range(2):
                for j in range(2):
                    for m in range(factor.shape[3]):
                        is_used = is_used or factor[q, i, j, m] != 0.0
        if is_used:
            _slopes(bary[q], gradient[e], sign[e], slope)
            for i in range(2):
                for m in range(factor.shape[3]):
                    factor_x, factor_y = factor[q, i, 0, m], factor[q, i, 1, m]
                    for a in range(4):
                        part[i, m, a] += factor_x * slope[a, 0] + factor_y * slope[a, 1]
        if not _is_same_side(cell, side, q):
            _hand_over(part, residual, functions[e], copy, crack, side[q])


@kernel
def take_stress(  # type: ignore[no-untyped-def]
    residual,
    blocks,
    cell,
    bary,
    weight,
    side,
    strain,
    functions,
    sign,
    copy,
    crack,
    gradient,
    lam,
    mu,
):
    """Subtract a(u, w) of each column at points, and add a(w, w) to the blocks.

    Parameters
    ----------
    residual : (n, 2, m) array
        Changed in place.
    blocks : (n - copies, 4, 4) array
        Two components of each function, and two of its copy; changed in place.
    cell, bary, side, functions, sign, copy, crack, gradient : arrays
        As in `add_functional`.
    weight : (q,) array
    strain : (q, 2, 2, m) array
        Gradients of the displacements of each column.
    lam, mu : float
    """
    slope, part = empty((4, 2)), zeros((2, strain.shape[3], 4))
    P_modulus, direct_part = lam + 2.0 * mu, zeros((4, 3))
    for q in range(len(cell)):
        e, w = cell[q], weight[q]
        _slopes(bary[q], gradient[e], sign[e], slope)
        for m in range(strain.shape[3]):
            g00, g01 = strain[q, 0, 0, m], strain[q, 0, 1, m]
            g10, g11 = strain[q, 1, 0, m], strain[q, 1, 1, m]
            trace = lam * (g00 + g11)
            s00, s11 = w * (trace + 2.0 * mu * g00), w * (trace + 2.0 * mu * g11)
            s01 = w * mu * (g01 + g10)
            for a in range(4):
                part[0, m, a] -= s00 * slope[a, 0] + s01 * slope[a, 1]
                part[1, m, a] -= s01 * slope[a, 0] + s11 * slope[a, 1]
        for a in range(4):
            x, y = slope[a, 0], slope[a, 1]
            direct_part[a, 0] += w * (P_modulus * x * x + mu * y * y)
            direct_part[a, 1] += w * (P_modulus * y * y + mu * x * x)
            direct_part[a, 2] += w * (lam + mu) * x * y
        if _is_same_side(cell, side, q):
            continue
        _hand_over(part, residual, functions[e], copy, crack, side[q])
        for a in range(4):
            f = functions[e, a]
            k00, k11, k01 = direct_part[a, 0], direct_part[a, 1], direct_part[a, 2]
            block = blocks[f]
            block[0, 0] += k00
            block[1, 1] += k11
            block[0, 1] += k01
            block[1, 0] += k01
            if copy[f] >= 0:
                jump = float(side[q, crack[f]])
                block[2, 2] += k00
                block[3, 3] += k11
                block[2, 3] += k01
                block[3, 2] += k01
                block[0, 2] += jump * k00
                block[2, 0] += jump * k00
                block[1, 3] += jump * k11
                block[3, 1] += jump * k11
                block[0, 3] += jump * k01
                block[3, 0] += jump * k01
                block[1, 2] += jump * k01
                block[2, 1] += jump * k01
        direct_part[:] = 0.0


@kernel
def take_plain_stress(  # type: ignore[no-untyped-def]
    residual,
    blocks,
    cells,
    nodes,
    coefficients,
    gradient,
    volume,
    functions,
    sign,
    moments,
    square,
    lam,
    mu,
):
    """The same on cells with standard functions alone, by integrals of the reference triangle.

    Parameters
    ----------
    residual, blocks, functions, sign, gradient, lam, mu : as in `take_stress`
    cells : (k,) array of int
    nodes : (cells, 6) array of int
    coefficients : (n, 2, m) array
    volume : (cells,) array
    moments : (4, 3, 3) array
        Mean of each function's derivative (second axis) times a barycentric coordinate (third).
    square : (4, 3, 3) array
        Mean of the products of its derivatives.
    """
    columns = coefficients.shape[2]
    P_modulus = lam + 2.0 * mu
    stress = empty((columns, 3, 3))  # corner; xx, yy, xy
    d, displaced = empty((6, 2)), empty((4, 3, 2))
    for k in range(len(cells)):
        e = cells[k]
        G, V = gradient[e], volume[e]
        for b in range(3):
            # Derivatives of the six shape functions at corner b.
            for j in range(2):
                for c in range(3):
                    d[c, j] = (3.0 if c == b else -1.0) * G[c, j]
                d[3, j] = 4.0 * (G[1, j] if b == 0 else (G[0, j] if b == 1 else 0.0))
                d[4, j] = 4.0 * (G[2, j] if b == 0 else (G[0, j] if b == 2 else 0.0))
                d[5, j] = 4.0 * (G[2, j] if b == 1 else (G[1, j] if b == 2 else 0.0))
            for m in range(columns):
                g00, g01, g10, g11 = 0.0, 0.0, 0.0, 0.0
                for a in range(6):
                    n = nodes[e, a]
                    u, v = coefficients[n, 0, m], coefficients[n, 1, m]
                    g00 += d[a, 0] * u
                    g01 += d[a, 1] * u
                    g10 += d[a, 0] * v
                    g11 += d[a, 1] * v
                trace = lam * (g00 + g11)
                stress[m, b, 0] = V * (trace + 2.0 * mu * g00)
                stress[m, b, 1] = V * (trace + 2.0 * mu * g11)
                stress[m, b, 2] = V * mu * (g01 + g10)
        for a in range(4):
            s = sign[e, a] if a < 3 else 1.0
            for c in range(3):
                for j in range(2):
                    rise = 0.0
                    for b in range(3):
                        rise += moments[a, b, c] * G[b, j]
                    displaced[a, c, j] = s * rise
        for a in range(4):
            f = functions[e, a]
            for m in range(columns):
                residual_x, residual_y = 0.0, 0.0
                for c in range(3):
                    x, y = displaced[a, c, 0], displaced[a, c, 1]
                    residual_x += stress[m, c, 0] * x + stress[m, c, 2] * y
                    residual_y += stress[m, c, 2] * x + stress[m, c, 1] * y
                residual[f, 0, m] -= residual_x
                residual[f, 1, m] -= residual_y
            x2, y2, xy = 0.0, 0.0, 0.0
            for b in range(3):
                for c in range(3):
                    t = square[a, b, c] * V
                    x2 += t * G[b, 0] * G[c, 0]
                    y2 += t * G[b, 1] * G[c, 1]
                    xy += t * G[b, 0] * G[c, 1]
            block = blocks[f]
            block[0, 0] += P_modulus * x2 + mu * y2
            block[1, 1] += P_modulus * y2 + mu * x2
            block[0, 1] += (lam + mu) * xy
            block[1, 0] += (lam + mu) * xy
