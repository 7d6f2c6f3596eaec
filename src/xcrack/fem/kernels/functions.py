"""Functions tabulated at points, corrections of their gradients, and the fields that they span."""

import math

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel


@kernel
def set_standard(value, slope, row, bary, gradient, edges):  # type: ignore[no-untyped-def]
    """Set the shape functions of the first columns and their gradients, where these are wanted.

    Parameters
    ----------
    value, slope : (q or 0, k) and (q or 0, k, d) arrays
        Changed in place; of length 0 where they are not wanted.
    row : (q,) array of int
        Cell of each point.
    bary : (q, d + 1) array
    gradient : (m, d + 1, d) array
        Gradients of the barycentric coordinates.
    edges : (e, 2) array of int
        Ends of the edges that carry a node; none at order 1.
    """
    corners = bary.shape[1]
    d = corners - 1
    is_quadratic = len(edges) > 0
    for q in range(len(row)):
        G = gradient[row[q]]
        for b in range(corners):
            x = bary[q, b]
            if len(value):
                value[q, b] = x * (2.0 * x - 1.0) if is_quadratic else x
            if len(slope):
                rise = 4.0 * x - 1.0 if is_quadratic else 1.0
                slope[q, b, 0] = rise * G[b, 0]
                slope[q, b, 1] = rise * G[b, 1]
                slope[q, b, d - 1] = rise * G[b, d - 1]
        for k in range(len(edges)):
            a, b = edges[k, 0], edges[k, 1]
            x, y = 4.0 * bary[q, a], 4.0 * bary[q, b]
            if len(value):
                value[q, corners + k] = x * bary[q, b]
            if len(slope):
                slope[q, corners + k, 0] = y * G[a, 0] + x * G[b, 0]
                slope[q, corners + k, 1] = y * G[a, 1] + x * G[b, 1]
                slope[q, corners + k, d - 1] = y * G[a, d - 1] + x * G[b, d - 1]


@kernel
def set_jumps(value, slope, first, row, side, nodes, node_side, number):  # type: ignore[no-untyped-def]
    """Set shifted Heaviside functions from column `first` on: shape times side less that of node.

    Parameters
    ----------
    value, slope : (q or 0, k) and (q or 0, k, d) arrays
        Changed in place; the standard functions are in the first columns.
    first : int
    row : (q,) array of int
    side : (q,) array of int
        Side of the crack.
    nodes : (m, n) array of int
    node_side : (nodes,) array of int
    number : (nodes,) array of int
        Negative for nodes that carry no Heaviside function.
    """
    n = nodes.shape[1]
    for q in range(len(row)):
        for a in range(n):
            node = nodes[row[q], a]
            jump = float(side[q] - node_side[node]) if number[node] >= 0 else 0.0
            if len(value):
                value[q, first + a] = value[q, a] * jump
            if len(slope):
                for j in range(slope.shape[2]):
                    slope[q, first + a, j] = slope[q, a, j] * jump


@kernel
def set_tips(value, slope, first, row, bary, side, nodes, gradient, phi, psi, is_active, shift):  # type: ignore[no-untyped-def]
    """Set shifted tip functions times hats from column `first` on, and their gradients.

    F = sqrt(r) {cos(t/2), sin(t/2), sin(t/2) sin(t), cos(t/2) sin(t)}, the first k of them.

    Parameters
    ----------
    value, slope : (q or 0, n) and (q or 0, n, d) arrays
        Changed in place; of length 0 where they are not wanted.
    first : int
    row : (q,) array of int
        Cell of each point.
    bary : (q, d + 1) array
    side : (q,) array of int
        Side of the crack, 0 where unknown: it decides the angle on a lip.
    nodes : (m, d + 1) array of int
    gradient : (m, d + 1, d) array
        Gradients of the barycentric coordinates.
    phi, psi : (n,) arrays
    is_active : (n,) array of bool
        Points that carry the functions.
    shift : (n, k) array
        The functions at the points.
    """
    q, corners = bary.shape
    d = corners - 1
    k = shift.shape[1]
    values, slopes = len(value) > 0, len(slope) > 0
    F, slope_ahead, normal = empty(4), empty(4), empty(4)
    frame_slope = empty((4, 3))  # in 2D the last two of three components are the same
    for p in range(q):
        e = row[p]
        x = 0.0
        y = 0.0
        for b in range(corners):
            x += bary[p, b] * psi[nodes[e, b]]
            y += bary[p, b] * phi[nodes[e, b]]
        r = math.sqrt(x * x + y * y)
        # Between the level set and a kink that the cut follows, the angle goes on beyond pi.
        is_beyond = x < 0.0 and -y * side[p] > 1e-9 * r
        if side[p] != 0 and y * side[p] <= 0.0 and not is_beyond:
            y = side[p] * 1e-300
        # Half the angle without trigonometry; the larger of its sine and cosine by the root.
        c, s, C, S = 1.0, 0.0, 1.0, 0.0
        if r > 0.0:
            C, S = x / r, y / r
            if x >= 0.0:
                c = math.sqrt(0.5 * (1.0 + C))
                s = 0.5 * S / c
            else:
                s = math.copysign(math.sqrt(0.5 * (1.0 - C)), side[p] if is_beyond else y)
                c = 0.5 * S / s
        root = math.sqrt(r)
        F[0], F[1], F[2], F[3] = c, s, s * S, c * S
        if slopes:
            slope_ahead[0], slope_ahead[1] = -s / 2, c / 2
            slope_ahead[2], slope_ahead[3] = c * S / 2 + s * C, -s * S / 2 + c * C
            psi_x, psi_y, psi_z, phi_x, phi_y, phi_z = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for b in range(corners):
                at_psi, at_phi = psi[nodes[e, b]], phi[nodes[e, b]]
                psi_x += at_psi * gradient[e, b, 0]
                psi_y += at_psi * gradient[e, b, 1]
                psi_z += at_psi * gradient[e, b, d - 1]
                phi_x += at_phi * gradient[e, b, 0]
                phi_y += at_phi * gradient[e, b, 1]
                phi_z += at_phi * gradient[e, b, d - 1]
            for f in range(4):
                turn = slope_ahead[f]
                slope_ahead[f] = (0.5 * F[f] * C - turn * S) / root
                normal[f] = (0.5 * F[f] * S + turn * C) / root
                frame_slope[f, 0] = slope_ahead[f] * psi_x + normal[f] * phi_x
                frame_slope[f, 1] = slope_ahead[f] * psi_y + normal[f] * phi_y
                frame_slope[f, 2] = slope_ahead[f] * psi_z + normal[f] * phi_z
        for b in range(corners):
            node, to, share = nodes[e, b], first + b * k, bary[p, b]
            if not is_active[node]:
                for f in range(k):
                    if values:
                        value[p, to + f] = 0.0
                    for j in range(d if slopes else 0):
                        slope[p, to + f, j] = 0.0
                continue
            x, y, z = gradient[e, b, 0], gradient[e, b, 1], gradient[e, b, d - 1]
            for f in range(k):
                increment = root * F[f] - shift[node, f]
                if values:
                    value[p, to + f] = share * increment
                if slopes:
                    slope[p, to + f, 0] = increment * x + share * frame_slope[f, 0]
                    slope[p, to + f, 1] = increment * y + share * frame_slope[f, 1]
                    slope[p, to + f, d - 1] = increment * z + share * frame_slope[f, 2]


@kernel
def add_flux(defect, piece, value, normal, moment):  # type: ignore[no-untyped-def]
    """Add the boundary integral of value x normal x moment to each piece.

    Parameters
    ----------
    defect : (p, f, d, a) array
        Changed in place.
    piece : (q,) array of int
    value : (q, f) array
    normal : (q, d) array
        Times the weight.
    moment : (q, a) array
    """
    for q in range(len(piece)):
        k = piece[q]
        if moment.shape[1] == 1 and normal.shape[1] == 3:  # written out: a quarter of the time
            x, y, z, m0 = normal[q, 0], normal[q, 1], normal[q, 2], moment[q, 0]
            for f in range(value.shape[1]):
                v = value[q, f]
                defect[k, f, 0, 0] += v * x * m0
                defect[k, f, 1, 0] += v * y * m0
                defect[k, f, 2, 0] += v * z * m0
            continue
        for f in range(value.shape[1]):
            v = value[q, f]
            if v != 0.0:
                for j in range(normal.shape[1]):
                    for a in range(moment.shape[1]):
                        defect[k, f, j, a] += v * normal[q, j] * moment[q, a]


@kernel
def moments_at(row, bary, corners, is_linear):  # type: ignore[no-untyped-def]
    """1 and, where wanted, the coordinates at points `(q, 1)` or `(q, d + 1)`.

    Parameters
    ----------
    row : (q,) array of int
        Cell of each point.
    bary : (q, d + 1) array
    corners : (m, d + 1, d) array
        Corners of the cells, from their centre and in units of their size.
    is_linear : bool
    """
    d = corners.shape[2]
    moment = empty((len(row), d + 1 if is_linear else 1))
    for q in range(len(row)):
        moment[q, 0] = 1.0
        if is_linear:
            for j in range(d):
                x = 0.0
                for b in range(d + 1):
                    x += bary[q, b] * corners[row[q], b, j]
                moment[q, 1 + j] = x
    return moment


@kernel
def take_volume(defect, gram, piece, weight, value, slope, moment, scale):  # type: ignore[no-untyped-def]
    """Subtract the volume integral of the gradient of value x moment from each piece.

    The integrals of the products of moments are added to `gram`.

    Parameters
    ----------
    defect : (p, f, d, a) array
        Changed in place.
    gram : (p, a, a) array
        Changed in place.
    piece : (q,) array of int
    weight : (q,) array
    value : (q or 0, f) array
        Of length 0 if a = 1.
    slope : (q, f, d) array
    moment : (q, a) array
        1 and, if a > 1, the coordinates in units of the size of the cell.
    scale : (q,) array, 1/length
        One over that size.
    """
    for q in range(len(piece)):
        k = piece[q]
        w = weight[q]
        for a in range(moment.shape[1]):
            for b in range(moment.shape[1]):
                gram[k, a, b] += w * moment[q, a] * moment[q, b]
        if moment.shape[1] == 1 and slope.shape[2] == 3:
            m0 = moment[q, 0]
            for f in range(value.shape[1]):
                defect[k, f, 0, 0] -= w * slope[q, f, 0] * m0
                defect[k, f, 1, 0] -= w * slope[q, f, 1] * m0
                defect[k, f, 2, 0] -= w * slope[q, f, 2] * m0
            continue
        for f in range(value.shape[1]):
            for j in range(slope.shape[2]):
                for a in range(moment.shape[1]):
                    defect[k, f, j, a] -= w * slope[q, f, j] * moment[q, a]
                if moment.shape[1] > 1:
                    defect[k, f, j, 1 + j] -= w * value[q, f] * scale[q]


@kernel
def solve_moments(defect, gram, tolerance):  # type: ignore[no-untyped-def]
    """Multiply the defects of each piece by the pseudo-inverse of its Gram matrix.

    By Jacobi rotations, which are as accurate for small eigenvalues as for large ones.

    Parameters
    ----------
    defect : (p, f, d, a) array
        Changed in place.
    gram : (p, a, a) array
    tolerance : float
        Share of the largest eigenvalue up to which others count as zero.
    """
    n = gram.shape[1]
    A, V, inverse, row = empty((n, n)), empty((n, n)), empty((n, n)), empty(n)
    for p in range(len(gram)):
        total = gram[p, 0, 0] if gram[p, 0, 0] > 1e-300 else 1e-300
        for i in range(n):
            for j in range(n):
                A[i, j] = gram[p, i, j] / total
                V[i, j] = i == j
                inverse[i, j] = 0.0
        for _ in range(60):
            off_diagonal, size = 0.0, 0.0
            for i in range(n):
                size += A[i, i] ** 2
                for j in range(i):
                    off_diagonal += A[i, j] ** 2
            if not off_diagonal > 1e-34 * size:
                break
            for i in range(n):
                for j in range(i):
                    if A[i, j] == 0.0:
                        continue
                    ratio = (A[j, j] - A[i, i]) / (2 * A[i, j])
                    t = 1 / (abs(ratio) + math.sqrt(ratio * ratio + 1))
                    t = -t if ratio < 0 else t
                    c = 1 / math.sqrt(t * t + 1)
                    s = t * c
                    for k in range(n):
                        a, b = A[k, i], A[k, j]
                        A[k, i], A[k, j] = c * a - s * b, s * a + c * b
                    for k in range(n):
                        a, b = A[i, k], A[j, k]
                        A[i, k], A[j, k] = c * a - s * b, s * a + c * b
                        a, b = V[k, i], V[k, j]
                        V[k, i], V[k, j] = c * a - s * b, s * a + c * b
        diagonal_max = 0.0
        for i in range(n):
            diagonal_max = max(diagonal_max, abs(A[i, i]))
        for k in range(n):
            if abs(A[k, k]) > tolerance * diagonal_max:
                for i in range(n):
                    for j in range(n):
                        inverse[i, j] += V[i, k] * V[j, k] / A[k, k]
        for f in range(defect.shape[1]):
            for j in range(defect.shape[2]):
                for k in range(n):
                    row[k] = 0.0
                    for i in range(n):
                        row[k] += defect[p, f, j, i] * inverse[i, k]
                for k in range(n):
                    defect[p, f, j, k] = row[k] / total


@kernel
def add_correction(slope, first, piece, row, coefficient, moment, functions):  # type: ignore[no-untyped-def]
    """Add coefficient . moment to the gradients from function `first` on, where they act.

    Parameters
    ----------
    slope : (q, n, d) array
        Changed in place.
    first : int
    piece, row : (q,) arrays of int
    coefficient : (p, f, d, a) array
    moment : (q, a) array
    functions : (m, n) array of int
        Negative where a function does not act on a cell.
    """
    for q in range(len(piece)):
        k = piece[q]
        for f in range(coefficient.shape[1]):
            if functions[row[q], first + f] < 0:
                continue
            if moment.shape[1] == 1 and slope.shape[2] == 3:
                m0 = moment[q, 0]
                slope[q, first + f, 0] += coefficient[k, f, 0, 0] * m0
                slope[q, first + f, 1] += coefficient[k, f, 1, 0] * m0
                slope[q, first + f, 2] += coefficient[k, f, 2, 0] * m0
                continue
            for j in range(slope.shape[2]):
                for a in range(moment.shape[1]):
                    slope[q, first + f, j] += coefficient[k, f, j, a] * moment[q, a]


@kernel
def add_forces(force, number, functions, row, value, weight, density):  # type: ignore[no-untyped-def]
    """Add the integral of a density times each function over some points.

    Parameters
    ----------
    force : (f, d) array
        Changed in place.
    number : (k,) array of int
        Points over which it is taken.
    functions : (m, n) array of int
        Negative where there is none.
    row : (k,) array of int
        Place of each point in `functions`.
    value : (k, n) array
        The functions at the points.
    weight : (q,) array
    density : (q, d) array
    """
    d = density.shape[1]
    for p in range(len(number)):
        q = number[p]
        for a in range(functions.shape[1]):
            f = functions[row[p], a]
            if f >= 0:
                for j in range(d):
                    force[f, j] += value[p, a] * (weight[q] * density[q, j])


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
    x = zeros((len(cell), points.shape[1]))
    for q in range(len(cell)):
        for b in range(bary.shape[1]):
            node = cells[cell[q], b]
            for j in range(points.shape[1]):
                x[q, j] += bary[q, b] * points[node, j]
    return x
