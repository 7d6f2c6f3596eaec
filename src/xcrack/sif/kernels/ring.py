"""The interaction integral in 2D: cells that it needs, and its sum over their points."""

import math

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel


@kernel
def cells_between(points, cells, size, centre, inner_radius, radius):  # type: ignore[no-untyped-def]
    """Cells that may have points between two radii, increasing `(k,)`.

    Parameters
    ----------
    points : (n, d) array, length
    cells : (m, d + 1) array of int
    size : (m,) array, length
        Longest edge of each cell.
    centre : (d,) array
    inner_radius, radius : float, length
        A cell is left out where all its corners are within `inner_radius`, or its centroid is
        farther than its size outside `radius`.
    """
    corners, d = cells.shape[1], points.shape[1]
    ring_cells = empty(len(cells), np.int64)
    count = 0
    for e in range(len(cells)):
        farthest_square, square_of_point = 0.0, 0.0
        for j in range(d):
            mean = 0.0
            for b in range(corners):
                mean += points[cells[e, b], j]
            square_of_point += (mean / corners - centre[j]) ** 2
        if math.sqrt(square_of_point) > radius + size[e]:
            continue
        for b in range(corners):
            square = 0.0
            for j in range(d):
                square += (points[cells[e, b], j] - centre[j]) ** 2
            farthest_square = max(farthest_square, square)
        if math.sqrt(farthest_square) <= inner_radius:
            continue
        ring_cells[count] = e
        count += 1
    return ring_cells[:count]


@kernel
def _unit_fields(r, c, s, modes, kolosov, lam, mu, g, sigma):  # type: ignore[no-untyped-def]
    """Gradients and stresses of modes I and II and of the point force, at half the angle (c, s)."""
    root, C, S = 1.0 / math.sqrt(r), c * c - s * s, 2.0 * s * c
    value = (c, s, s * S, c * S)
    slope = (-s / 2, c / 2, c * S / 2 + s * C, -s * S / 2 + c * C)
    for m in range(2):
        for i in range(2):
            g[m, i, 0] = 0.0
            g[m, i, 1] = 0.0
            for f in range(4):
                g[m, i, 0] += modes[m, i, f] * root * (0.5 * value[f] * C - slope[f] * S)
                g[m, i, 1] += modes[m, i, f] * root * (0.5 * value[f] * S + slope[f] * C)
    radial_stress = -C / (math.pi * r)
    mean = (3.0 - kolosov) / 4.0 * radial_stress
    turn = (kolosov + 1.0) / (8.0 * mu * math.pi) * S / r
    g[2, 0, 0] = (radial_stress * C * C - mean) / (2.0 * mu)
    g[2, 0, 1] = radial_stress * C * S / (2.0 * mu) - turn
    g[2, 1, 0] = radial_stress * C * S / (2.0 * mu) + turn
    g[2, 1, 1] = (radial_stress * S * S - mean) / (2.0 * mu)
    for m in range(3):
        trace = lam * (g[m, 0, 0] + g[m, 1, 1])
        sigma[m, 0, 0] = trace + 2.0 * mu * g[m, 0, 0]
        sigma[m, 1, 1] = trace + 2.0 * mu * g[m, 1, 1]
        sigma[m, 0, 1] = mu * (g[m, 0, 1] + g[m, 1, 0])
        sigma[m, 1, 0] = sigma[m, 0, 1]


@kernel
def _unit_bends(r, x, y, c, s, modes, kolosov, mu, bend):  # type: ignore[no-untyped-def]
    """Derivatives ahead of the gradients of the unit fields, at half the angle (c, s)."""
    root, C, S = math.sqrt(r), c * c - s * s, 2.0 * s * c
    c3, s3 = c * C - s * S, s * C + c * S
    for m in range(2):
        for i in range(2):
            # The tip functions by cosine and sine of half the angle, and of three times that.
            a, e = modes[m, i, 0] + 0.5 * modes[m, i, 2], -0.5 * modes[m, i, 2]
            b, d = modes[m, i, 1] + 0.5 * modes[m, i, 3], 0.5 * modes[m, i, 3]
            v = a * c + b * s + e * c3 + d * s3
            v1 = 0.5 * (b * c - a * s) + 1.5 * (d * c3 - e * s3)
            v2 = -0.25 * (a * c + b * s) - 2.25 * (e * c3 + d * s3)
            derivative_along = 0.5 * v * C - v1 * S
            derivative_across = 0.5 * v * S + v1 * C
            slope_along = -0.5 * (v1 * C + v * S) - v2 * S
            slope_across = 0.5 * (v * C - v1 * S) + v2 * C
            bend[m, i, 0] = -(0.5 * derivative_along * C + slope_along * S) / (root * r)
            bend[m, i, 1] = -(0.5 * derivative_across * C + slope_across * S) / (root * r)
    square = r * r
    scale = 1.0 / (math.pi * square)
    stress_00 = scale * (-3.0 * x * x + 4.0 * x**4 / square) / square
    stress_01 = scale * (-2.0 * x * y + 4.0 * x**3 * y / square) / square
    stress_11 = scale * (-y * y + 4.0 * x * x * y * y / square) / square
    mean = (3.0 - kolosov) / 4.0 * scale * (2.0 * x * x / square - 1.0)
    turn = -(kolosov + 1.0) / (8.0 * mu * math.pi) * 2.0 * x * y / (square * square)
    bend[2, 0, 0] = (stress_00 - mean) / (2.0 * mu)
    bend[2, 0, 1] = stress_01 / (2.0 * mu) - turn
    bend[2, 1, 0] = stress_01 / (2.0 * mu) + turn
    bend[2, 1, 1] = (stress_11 - mean) / (2.0 * mu)


@kernel
def _into_frame(frame, tensor, turn, local_tensor):  # type: ignore[no-untyped-def]
    """Components along the rows of a frame of a tensor less another one; (2, 2, s)."""
    for state in range(tensor.shape[2]):
        a, b = tensor[0, 0, state] - turn[0, 0, state], tensor[0, 1, state] - turn[0, 1, state]
        c, d = tensor[1, 0, state] - turn[1, 0, state], tensor[1, 1, state] - turn[1, 1, state]
        for i in range(2):
            row_0 = frame[i, 0] * a + frame[i, 1] * c
            row_1 = frame[i, 0] * b + frame[i, 1] * d
            for j in range(2):
                local_tensor[i, j, state] = row_0 * frame[j, 0] + row_1 * frame[j, 1]


@kernel
def _place(frame, dx, dy, side, is_behind):  # type: ignore[no-untyped-def]
    """Distance, coordinates, and cosine and sine of half the angle, without trigonometry."""
    r = math.sqrt(dx * dx + dy * dy)
    x = frame[0, 0] * dx + frame[0, 1] * dy
    y = frame[1, 0] * dx + frame[1, 1] * dy
    # The larger of both by the root.
    if x >= 0.0:
        c = math.sqrt(0.5 * (1.0 + x / r))
        s = 0.5 * y / (r * c)
    else:
        s = math.copysign(math.sqrt(0.5 * (1.0 - x / r)), y)
        c = 0.5 * y / (r * s)
    if is_behind and side * s < 0.0:  # a lip that bends: the angle is continued by a turn
        c, s = -c, -s
    return r, x, y, c, s


@kernel
def _add_point(  # type: ignore[no-untyped-def]
    total, du, dx, dy, side, is_behind, weight, radii, r_inner, frame, modes, kolosov, lam, mu, g,
    sigma, fall,
):  # fmt: skip
    """Add what one point contributes; du: gradients of u in the frame, dx and dy from the tip."""
    r, x, y, c, s = _place(frame, dx, dy, side, is_behind)
    _unit_fields(r, c, s, modes, kolosov, lam, mu, g, sigma)
    for k in range(len(radii)):
        width = radii[k] - r_inner[k]
        z = min(max((r - r_inner[k]) / width, 0.0), 1.0)
        fall[k] = -30.0 * weight * (z * (1.0 - z)) ** 2 / (width * r)
    for state in range(du.shape[2]):
        a, b = du[0, 0, state], du[1, 0, state]
        stress_across = lam * a + (lam + 2.0 * mu) * du[1, 1, state]
        shear = mu * (du[0, 1, state] + b)
        for m in range(3):
            # P_11 and P_12 of P_kj t_k, t along the first axis.
            flux = x * (
                sigma[m, 0, 0] * a
                + sigma[m, 1, 0] * b
                - shear * g[m, 0, 1]
                - stress_across * g[m, 1, 1]
            )
            flux += y * (
                sigma[m, 0, 1] * a
                + sigma[m, 1, 1] * b
                + shear * g[m, 0, 0]
                + stress_across * g[m, 1, 0]
            )
            for k in range(len(radii)):
                total[state, k, m] += fall[k] * flux


@kernel
def _add_change(  # type: ignore[no-untyped-def]
    total, du, dx, dy, side, is_behind, weight, radii, r_inner, frame, modes, kolosov, mu, g, fall,
    change, bend,
):  # fmt: skip
    """Add what the change of the stiffness from that of the tip (3, 3) contributes at a point.

    After `_add_point`, whose unit gradients and slopes of the weight count.
    """
    r, x, y, c, s = _place(frame, dx, dy, side, is_behind)
    _unit_bends(r, x, y, c, s, modes, kolosov, mu, bend)
    for state in range(du.shape[2]):
        e0, e1 = du[0, 0, state], du[1, 1, state]
        e2 = du[0, 1, state] + du[1, 0, state]
        s00 = change[0, 0] * e0 + change[0, 1] * e1 + change[0, 2] * e2
        s11 = change[1, 0] * e0 + change[1, 1] * e1 + change[1, 2] * e2
        s01 = change[2, 0] * e0 + change[2, 1] * e1 + change[2, 2] * e2
        for m in range(3):
            flux = x * (s00 * g[m, 0, 0] + s01 * g[m, 1, 0])
            flux += y * (s01 * g[m, 0, 0] + s11 * g[m, 1, 0])
            stress_term = s00 * bend[m, 0, 0] + s11 * bend[m, 1, 1]
            stress_term += s01 * (bend[m, 0, 1] + bend[m, 1, 0])
            for k in range(len(radii)):
                z = min(max((r - r_inner[k]) / (radii[k] - r_inner[k]), 0.0), 1.0)
                q = 1.0 - z * z * z * (10.0 - 15.0 * z + 6.0 * z * z)
                total[state, k, m] += fall[k] * flux + weight * q * stress_term


@kernel
def add_points(  # type: ignore[no-untyped-def]
    total, gradient, cell, bary, side, weight, points, cells, psi, tip, turn, radii, r_inner, frame,
    modes, kolosov, lam, mu, change,
):  # fmt: skip
    """Add the domain integrals of modes I, II and of the point force over points.

    P_kj t_k q_,j in the frame (ahead, normal), without trigonometry. A left-handed frame changes
    no formula.

    Parameters
    ----------
    total : (s, k, 3) array
        By state, domain and field; changed in place.
    gradient : (q, 2, 2, s) array
        Of the displacements (component, derivative), global axes.
    cell, bary : (q,) array of int and (q, 3) array
    side : (q,) array of int
        Side of the crack, 0 where unknown: it counts in cells behind the tip, where psi < 0.
    weight : (q,) array
    points, cells : (n, 2) and (m, 3) arrays
    psi : (n,) array
    tip : (2,) array, length
    turn : (2, 2, s) array
        Mean rotation, subtracted from the gradients.
    radii, r_inner : (k,) arrays, length
        q falls from one to zero by a quintic between r_inner and radii.
    frame : (2, 2) array
    modes : (2, 2, 4) array
        Displacements of modes I and II by tip function.
    kolosov, lam, mu : float
    change : (q, 3, 3) array or None
        Stiffness less that of the tip, in the frame, by strains and shear angle. With it points
        within the inner radius count too. None is compiled for itself.
    """
    g, sigma, fall = empty((3, 2, 2)), empty((3, 2, 2)), empty(len(radii))
    du, bend = empty((2, 2, total.shape[0])), empty((3, 2, 2))
    largest_radius, least_radius = radii[0], r_inner[0]
    for k in range(1, len(radii)):
        largest_radius, least_radius = max(largest_radius, radii[k]), min(least_radius, r_inner[k])
    if change is not None:
        least_radius = 0.0
    for p in range(len(weight)):
        dx, dy, psi_sum = -tip[0], -tip[1], 0.0
        for b in range(3):
            node = cells[cell[p], b]
            dx += bary[p, b] * points[node, 0]
            dy += bary[p, b] * points[node, 1]
            psi_sum += psi[node]
        if least_radius * least_radius < dx * dx + dy * dy < largest_radius * largest_radius:
            _into_frame(frame, gradient[p], turn, du)
            _add_point(
                total, du, dx, dy, side[p], psi_sum < 0.0, weight[p], radii, r_inner, frame, modes,
                kolosov, lam, mu, g, sigma, fall,
            )  # fmt: skip
            if change is not None:
                _add_change(
                    total, du, dx, dy, side[p], psi_sum < 0.0, weight[p], radii, r_inner, frame,
                    modes, kolosov, mu, g, fall, change[p], bend,
                )  # fmt: skip


@kernel
def add_plain_cells(  # type: ignore[no-untyped-def]
    total, ring_cells, points, cells, slopes, volume, nodes, edges, coefficients, side, psi, bary,
    share, tip, turn, radii, r_inner, frame, modes, kolosov, lam, mu, change,
):  # fmt: skip
    """Add the domain integrals over plain cells: places, gradients and terms in one pass.

    Gradients are those at the corners, between which they are linear at both orders.

    Parameters
    ----------
    total, tip, turn, radii, r_inner, frame, modes, kolosov, lam, mu
        As of `add_points`.
    change : (k, q or 1, 3, 3) array or None
        As of `add_points`, of the cells of the ring: at their points, or the same at all of them.
    ring_cells : (k,) array of int
        Cells on which no enriched function acts.
    points, cells : (n, 2) and (m, 3) arrays
    slopes : (m, 3, 2) array
        Gradients of the barycentric coordinates.
    volume : (m,) array
    nodes : (m, n) array of int
    edges : (e, 2) array of int
        Ends of the edges that carry a node; none at order 1.
    coefficients : (f, 2, s) array
    side : (m,) array of int
        Side of the crack on which a cell lies.
    psi : (n,) array
    bary, share : (q, 3) and (q,) arrays
        Points of a cell and their share of its volume.
    """
    states = total.shape[0]
    g, sigma, fall = empty((3, 2, 2)), empty((3, 2, 2)), empty(len(radii))
    gradient, corner = empty((2, 2, states)), empty((3, 2, 2, states))
    du, bend = empty((2, 2, states)), empty((3, 2, 2))
    largest_radius, least_radius = radii[0], r_inner[0]
    for k in range(1, len(radii)):
        largest_radius, least_radius = max(largest_radius, radii[k]), min(least_radius, r_inner[k])
    if change is not None:
        least_radius = 0.0
    for place in range(len(ring_cells)):
        e = ring_cells[place]
        is_behind = psi[cells[e, 0]] + psi[cells[e, 1]] + psi[cells[e, 2]] < 0.0
        for b in range(3):
            for i in range(2):
                for s in range(states):
                    gradient[i, 0, s] = gradient[i, 1, s] = 0.0
                    for a in range(3):
                        rise = 1.0 if len(edges) == 0 else 3.0 if a == b else -1.0
                        u = rise * coefficients[nodes[e, a], i, s]
                        gradient[i, 0, s] += slopes[e, a, 0] * u
                        gradient[i, 1, s] += slopes[e, a, 1] * u
                    for k in range(len(edges)):
                        other_corner = edges[k, 0] + edges[k, 1] - b
                        if edges[k, 0] == b or edges[k, 1] == b:
                            u = 4.0 * coefficients[nodes[e, 3 + k], i, s]
                            gradient[i, 0, s] += slopes[e, other_corner, 0] * u
                            gradient[i, 1, s] += slopes[e, other_corner, 1] * u
            _into_frame(frame, gradient, turn, corner[b])
        for p in range(len(share)):
            dx, dy = -tip[0], -tip[1]
            for b in range(3):
                dx += bary[p, b] * points[cells[e, b], 0]
                dy += bary[p, b] * points[cells[e, b], 1]
            if (
                not least_radius * least_radius
                < dx * dx + dy * dy
                < largest_radius * largest_radius
            ):
                continue
            for i in range(2):
                for j in range(2):
                    for s in range(states):
                        du[i, j, s] = (
                            bary[p, 0] * corner[0, i, j, s]
                            + bary[p, 1] * corner[1, i, j, s]
                            + bary[p, 2] * corner[2, i, j, s]
                        )
            _add_point(
                total, du, dx, dy, side[e], is_behind, share[p] * volume[e], radii, r_inner, frame,
                modes, kolosov, lam, mu, g, sigma, fall,
            )  # fmt: skip
            if change is not None:
                _add_change(
                    total, du, dx, dy, side[e], is_behind, share[p] * volume[e], radii, r_inner,
                    frame, modes, kolosov, mu, g, fall,
                    change[place, min(p, change.shape[1] - 1)], bend,
                )  # fmt: skip


@kernel
def add_lips(  # type: ignore[no-untyped-def]
    total, xi, outward_normal, side, weight, pressure, shear, gradient, steady, turn, radii,
    r_inner, frame, modes, kolosov, lam, mu,
):  # fmt: skip
    """Add the full lip term of each state, domain and field.

    Parameters
    ----------
    total, turn, radii, r_inner, frame, modes, kolosov, lam, mu
        As of `add_points`.
    xi : (n, 2) array, length
        Places from the tip, in its frame.
    outward_normal : (n, 2) array
        Normals of lip - in the frame, out of the body.
    side : (2, n) array of int
        Side of the crack of the points on both lips, - first.
    weight : (n,) array, length
    pressure : (s, n) array
        On both lips.
    shear : (s or 0, n, 2) array
        Traction on lip + in global axes.
    gradient : (2 n or 0, 2, 2, s) array
        Of the displacements at the points of both lips, global axes; of length 0 where the crack is
        straight, so that the unit fields leave it free of traction.
    steady : (s, 2, 2) array
        Initial stress at the tip in its frame.
    """
    g, sigma, no_turn = empty((3, 2, 2)), empty((3, 2, 2)), zeros((2, 2))
    no_turn[0, 0] = no_turn[1, 1] = 1.0
    states, n = total.shape[0], len(xi)
    du = empty((2, 2, states))
    for p in range(n):
        for face in range(2):
            sign = 1.0 - 2.0 * face
            n0, n1 = sign * outward_normal[p, 0], sign * outward_normal[p, 1]
            r, _, _, c, s = _place(no_turn, xi[p, 0], xi[p, 1], side[face, p], True)
            _unit_fields(r, c, s, modes, kolosov, lam, mu, g, sigma)
            if len(gradient) > 0:
                _into_frame(frame, gradient[face * n + p], turn, du)
            for state in range(states):
                t0, t1 = -pressure[state, p] * n0, -pressure[state, p] * n1
                if len(shear) > 0:
                    x, y = shear[state, p, 0], shear[state, p, 1]
                    t0 -= sign * (frame[0, 0] * x + frame[0, 1] * y)
                    t1 -= sign * (frame[1, 0] * x + frame[1, 1] * y)
                for m in range(3):
                    density = t0 * g[m, 0, 0] + t1 * g[m, 1, 0]
                    if len(gradient) > 0:
                        a, b = du[0, 0, state], du[1, 0, state]
                        e, f = du[0, 1, state], du[1, 1, state]
                        density += (sigma[m, 0, 0] * n0 + sigma[m, 0, 1] * n1) * a
                        density += (sigma[m, 1, 0] * n0 + sigma[m, 1, 1] * n1) * b
                        trace, slide = lam * (a + f), mu * (e + b)
                        power = (trace + 2.0 * mu * a + steady[state, 0, 0]) * g[m, 0, 0]
                        power += (slide + steady[state, 0, 1]) * g[m, 0, 1]
                        power += (slide + steady[state, 1, 0]) * g[m, 1, 0]
                        power += (trace + 2.0 * mu * f + steady[state, 1, 1]) * g[m, 1, 1]
                        density -= power * n0
                    for k in range(len(radii)):
                        z = min(max((r - r_inner[k]) / (radii[k] - r_inner[k]), 0.0), 1.0)
                        q = 1.0 - z * z * z * (10.0 - 15.0 * z + 6.0 * z * z)
                        total[state, k, m] -= q * weight[p] * density
