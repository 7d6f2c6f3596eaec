"""Points around a curved crack front: feet on it, and the interaction integrand there."""

import math

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel

# Of the length along b for a unit of arc: it is zero at the centre of curvature of a front, where a
# single point of integration made K a hundred times too large.
_LEAST_METRIC = 0.1


@kernel
def _piece_of(s, break_arcs, guess):  # type: ignore[no-untyped-def]
    """Piece of a spline in which a parameter lies, first or last beyond its ends."""
    begin, end = 0, len(break_arcs) - 2
    if break_arcs[guess] <= s < break_arcs[guess + 1]:
        return guess
    while begin < end:
        middle = (begin + end + 1) // 2
        if break_arcs[middle] <= s:
            begin = middle
        else:
            end = middle - 1
    return begin


@kernel
def _curve_at(s, piece, break_arcs, place, value, slope, bend):  # type: ignore[no-untyped-def]
    """Value and two derivatives of a cubic spline; coefficients as of scipy, highest first.

    Straight beyond its ends.
    """
    clamped_s = min(max(s, break_arcs[0]), break_arcs[-1])
    t, excess = clamped_s - break_arcs[piece], s - clamped_s
    for i in range(3):
        c3, c2 = place[0, piece, i], place[1, piece, i]
        c1, c0 = place[2, piece, i], place[3, piece, i]
        value[i] = ((c3 * t + c2) * t + c1) * t + c0
        slope[i] = (3 * c3 * t + 2 * c2) * t + c1
        bend[i] = 6 * c3 * t + 2 * c2
        if excess != 0.0:
            value[i] += excess * slope[i]
            bend[i] = 0.0


@kernel
def frames_at(s, break_arcs, place, normal):  # type: ignore[no-untyped-def]
    """Points of a front and how its frame turns there.

    Parameters
    ----------
    s, break_arcs : (q,) array, (m + 1,) array
        Parameters; beyond the breaks the front is straight.
    place, normal : (4, m, 3) arrays
        Spline coefficients of the points and of the normals.

    Returns
    -------
    x : (q, 3) array
    frame : (q, 3, 3) array
        Rows (t, n, b).
    turn : (q, 4) array
        Curvatures b'.t and b'.n, twist t'.n (by arc length), and the speed ds/dparameter.
    """
    count = len(s)
    x = empty((count, 3))
    frame = empty((count, 3, 3))
    turn = empty((count, 4))
    dx, ddx = empty(3), empty(3)
    N, dN, ddN = empty(3), empty(3), empty(3)
    piece = 0
    for q in range(count):
        piece = _piece_of(s[q], break_arcs, piece)
        _curve_at(s[q], piece, break_arcs, place, x[q], dx, ddx)
        _curve_at(s[q], piece, break_arcs, normal, N, dN, ddN)
        _frame(dx, ddx, N, dN, frame[q], turn[q])
    return x, frame, turn


@kernel
def _frame(dx, ddx, N, dN, frame, turn):  # type: ignore[no-untyped-def]
    speed = math.sqrt(dx[0] * dx[0] + dx[1] * dx[1] + dx[2] * dx[2])
    projection = 0.0
    for i in range(3):
        frame[2, i] = dx[i] / speed
        projection += N[i] * frame[2, i]
    size = 0.0
    for i in range(3):
        frame[1, i] = N[i] - projection * frame[2, i]
        size += frame[1, i] ** 2
    size = math.sqrt(size)
    for i in range(3):
        frame[1, i] /= size
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[0, i] = frame[1, j] * frame[2, k] - frame[1, k] * frame[2, j]
    kt, kn, drift = 0.0, 0.0, 0.0
    for i in range(3):
        kt += ddx[i] * frame[0, i]
        kn += ddx[i] * frame[1, i]
        drift += dN[i] * frame[0, i]
    turn[0] = kt / speed**2
    turn[1] = kn / speed**2
    turn[2] = -(drift / speed - projection * turn[0]) / size
    turn[3] = speed


@kernel
def feet(x, start, reach, break_arcs, place, normal, is_closed):  # type: ignore[no-untyped-def]
    """Project points onto a front: (x - X(s)) . X'(s) = 0 by Newton's method.

    Parameters
    ----------
    x : (q, 3) array
    start : (q,) array
        First guesses of the parameter.
    reach : float
        Longest step of an iteration along the front, in the parameter.
    break_arcs : (m + 1,) array
    place, normal : (4, m, 3) arrays
        Spline coefficients of the points and of the normals.
    is_closed : bool

    Returns
    -------
    s : (q,) array
        Parameter of the foot.
    offset : (q, 2) array
        Coordinates along t and n.
    frame : (q, 3, 3) array
    turn : (q, 4) array
        As of `frames_at`.
    """
    count = len(x)
    s, offset = empty(count), empty((count, 2))
    frame, turn = empty((count, 3, 3)), empty((count, 4))
    X, dX, ddX = empty(3), empty(3), empty(3)
    N, dN, ddN = empty(3), empty(3), empty(3)
    first, end = break_arcs[0], break_arcs[-1]
    period = end - first
    piece = 0
    for q in range(count):
        u = start[q]
        for _ in range(30):
            piece = _piece_of(u, break_arcs, piece)
            _curve_at(u, piece, break_arcs, place, X, dX, ddX)
            f, df, square = 0.0, 0.0, 0.0
            for i in range(3):
                gap = x[q, i] - X[i]
                f += gap * dX[i]
                square += dX[i] * dX[i]
                df += gap * ddX[i]
            df = square - df
            is_newton = df > 0.1 * square
            step = f / (df if is_newton else square)
            if is_closed or first <= u <= end:  # straight beyond its ends: any step is right
                step = min(max(step, -reach), reach)
            previous_u = u
            u += step
            if is_closed:
                if u < first:
                    u += period
                elif u > end:
                    u -= period
            # A step of Newton's leaves about its square.
            if abs(step) <= (1e-9 if is_newton else 1e-14) * period or u == previous_u:
                break
        piece = _piece_of(u, break_arcs, piece)
        _curve_at(u, piece, break_arcs, place, X, dX, ddX)
        _curve_at(u, piece, break_arcs, normal, N, dN, ddN)
        _frame(dX, ddX, N, dN, frame[q], turn[q])
        s[q] = u
        x1, x2 = 0.0, 0.0
        for i in range(3):
            gap = x[q, i] - X[i]
            x1 += gap * frame[q, 0, i]
            x2 += gap * frame[q, 1, i]
        offset[q, 0], offset[q, 1] = x1, x2
    return s, offset, frame, turn


@kernel
def _set_unit_field(mode, r, ch, sh, kolosov, scale, U, U_turn, G, slope, spin, bend):  # type: ignore[no-untyped-def]
    """Set the field of Williams of one mode, and more, from the cosine and sine of half the angle.

    U (t, n, b), its gradient G along t, n; d/dtheta: turned, spin; d/dx1: slope (of turned), bend,
    where there is room for it. Components that a mode does not have are left as they are.
    """
    c, s = ch * ch - sh * sh, 2.0 * sh * ch
    c3, s3 = ch * c - sh * s, sh * c + ch * s
    root = math.sqrt(r)
    to_slope, to_bend = 1.0 / root, -1.0 / (root * r)
    for i in range(2 if mode == 2 else 0, 3 if mode == 2 else 2):
        a = b = e = d = 0.0  # of cos, sin of theta / 2, then of 3 theta / 2
        if mode == 0 and i == 0:
            a, e = kolosov - 0.5, -0.5
        elif mode == 0 and i == 1:
            b, d = kolosov + 0.5, -0.5
        elif mode == 1 and i == 0:
            b, d = kolosov + 1.5, 0.5
        elif mode == 1 and i == 1:
            a, e = 1.5 - kolosov, -0.5
        elif mode == 2 and i == 2:
            b = 4.0
        g = scale * (a * ch + b * sh + e * c3 + d * s3)
        g1 = scale * (0.5 * (b * ch - a * sh) + 1.5 * (d * c3 - e * s3))
        g2 = -scale * (0.25 * (a * ch + b * sh) + 2.25 * (e * c3 + d * s3))
        U[mode, i] = root * g
        U_turn[mode, i] = root * g1
        p0, p1 = 0.5 * g * c - g1 * s, 0.5 * g * s + g1 * c
        d0 = -0.5 * (g1 * c + g * s) - g2 * s
        d1 = 0.5 * (g * c - g1 * s) + g2 * c
        G[mode, i, 0], G[mode, i, 1] = p0 * to_slope, p1 * to_slope
        slope[mode, i] = (0.5 * g1 * c - g2 * s) * to_slope
        spin[mode, i, 0], spin[mode, i, 1] = d0 * to_slope, d1 * to_slope
        if len(bend) > 0:
            bend[mode, i, 0] = (0.5 * p0 * c + d0 * s) * to_bend
            bend[mode, i, 1] = (0.5 * p1 * c + d1 * s) * to_bend


@kernel
def _set_unit_stress(mode, G, lam, mu, S):  # type: ignore[no-untyped-def]
    """Set the stress of the gradient of a mode, which has no part along b."""
    trace = G[mode, 0, 0] + G[mode, 1, 1]
    S[mode, 0, 0] = lam * trace + 2 * mu * G[mode, 0, 0]
    S[mode, 1, 1] = lam * trace + 2 * mu * G[mode, 1, 1]
    S[mode, 2, 2] = lam * trace
    S[mode, 0, 1] = S[mode, 1, 0] = mu * (G[mode, 0, 1] + G[mode, 1, 0])
    S[mode, 0, 2] = S[mode, 2, 0] = mu * G[mode, 2, 0]
    S[mode, 1, 2] = S[mode, 2, 1] = mu * G[mode, 2, 1]


@kernel
def _weight(r, radius):  # type: ignore[no-untyped-def]
    """One at the front, zero outside, a quintic between; and its slope."""
    z = min(r / radius, 1.0)
    return 1.0 - z**3 * (10.0 - 15.0 * z + 6.0 * z * z), -30.0 * (z * (1.0 - z)) ** 2 / radius


@kernel
def _largest_radius(radii, hat):  # type: ignore[no-untyped-def]
    """Largest radius of two hats."""
    radius = 0.0
    for side in range(2):
        for k in range(radii.shape[1]):
            radius = max(radius, radii[hat[side], k])
    return radius


@kernel
def _into_frame(frame, tensor, result):  # type: ignore[no-untyped-def]
    """Components of a tensor along the rows of a frame."""
    for a in range(3):
        x, y, z = frame[a, 0], frame[a, 1], frame[a, 2]
        c0 = x * tensor[0, 0] + y * tensor[1, 0] + z * tensor[2, 0]
        c1 = x * tensor[0, 1] + y * tensor[1, 1] + z * tensor[2, 1]
        c2 = x * tensor[0, 2] + y * tensor[1, 2] + z * tensor[2, 2]
        for b in range(3):
            result[a, b] = c0 * frame[b, 0] + c1 * frame[b, 1] + c2 * frame[b, 2]


@kernel
def front_terms(  # type: ignore[no-untyped-def]
    weight, gradient, force, initial_stress, change, polar_place, frame, turn, hat, share, step,
    radii, lam, mu, is_curved, slopes, result,
):  # fmt: skip
    """Add the domain integrals of points to those of the hats.

    Parameters
    ----------
    weight : (q,) array
        Volume of each point.
    gradient : (q, 3, 3, n) array
        Displacement gradients of n states; rows are components.
    force : (q or 0, 3, n) array
        Body force, if any.
    initial_stress, change : (q or 0, 3, 3, n) arrays
        Initial stress, if any, and how it differs from that at the foot.
    polar_place, frame, turn : (q, 2), (q, 3, 3) and (q, 4) arrays
        Radius and angle; frame and its curvatures at the foot.
    hat : (q, 2) array of int
        The two hats that overlap there.
    share : (q,) array
        Value of the second hat; the first has the rest.
    step : (q,) array
        Derivative of the second hat by the parameter.
    radii : (hats, k) array
        Of the domains of each hat.
    lam, mu : float
        Lamé constants.
    is_curved : bool
        Count the curvatures and the twist; without, for comparison, they are taken as zero.
    slopes : (q or 0,) array, 1/length
        Derivative of the logarithm of the modulus along the front, if it changes.
    result : (n, k, 3, hats) array
        Added to.
    """
    states = gradient.shape[3]
    kolosov = (lam + 3 * mu) / (lam + mu)
    scale = 1.0 / (2.0 * mu * math.sqrt(2.0 * math.pi))
    U, U_turn, slope = zeros((3, 3)), zeros((3, 3)), zeros((3, 3))
    G, spin = zeros((3, 3, 2)), zeros((3, 3, 2))
    bend = zeros((3 if len(initial_stress) > 0 else 0, 3, 2))
    S, dS = empty((3, 3, 3)), empty((3, 3, 3))
    X, X1, D = empty((3, 3)), empty((3, 3)), empty((3, 3))
    g, sigma = empty((3, 3)), empty((3, 3))
    S0, S1 = zeros((3, 3)), zeros((3, 3))
    domains = radii.shape[1]
    value, slope_r, change_s = (
        empty((2, domains)),
        empty((2, domains)),
        empty((2, domains)),
    )
    for q in range(len(weight)):
        r, theta = polar_place[q, 0], polar_place[q, 1]
        if r >= _largest_radius(radii, hat[q]) or r <= 0.0:
            continue
        ch, sh = math.cos(0.5 * theta), math.sin(0.5 * theta)
        c, s = ch * ch - sh * sh, 2.0 * sh * ch
        kt, kn, w = turn[q, 0], turn[q, 1], turn[q, 2]
        if not is_curved:
            kt = kn = w = 0.0
        per_hs = 1.0 / max(1.0 - r * (kt * c + kn * s), _LEAST_METRIC)
        for side in range(2):
            part = share[q] if side == 1 else 1.0 - share[q]
            rise = step[q] if side == 1 else -step[q]
            for k in range(domains):
                Q, dQ = _weight(r, radii[hat[q, side], k])
                value[side, k] = weight[q] * part * Q
                slope_r[side, k] = weight[q] * part * dQ
                change_s[side, k] = weight[q] * rise * Q
        for m in range(3):
            _set_unit_field(m, r, ch, sh, kolosov, scale, U, U_turn, G, slope, spin, bend)
            _set_unit_stress(m, G, lam, mu, S)
            _set_unit_stress(m, spin, lam, mu, dS)
            X[m, 0] = (kt * U[m, 2] - w * (U[m, 1] + U_turn[m, 0])) * per_hs
            X[m, 1] = (kn * U[m, 2] + w * (U[m, 0] - U_turn[m, 1])) * per_hs
            X[m, 2] = -(kt * U[m, 0] + kn * U[m, 1] + w * U_turn[m, 2]) * per_hs
            X1[m, 0] = (kt * G[m, 2, 0] - w * (G[m, 1, 0] + slope[m, 0])) * per_hs
            X1[m, 1] = (kn * G[m, 2, 0] + w * (G[m, 0, 0] - slope[m, 1])) * per_hs
            X1[m, 2] = -(kt * G[m, 0, 0] + kn * G[m, 1, 0] + w * slope[m, 2]) * per_hs
            for i in range(3):
                X1[m, i] += X[m, i] * kt * per_hs
                D[m, i] = -w * dS[m, i, 2] - kt * S[m, i, 0] - kn * S[m, i, 1]
            D[m, 0] += kt * S[m, 2, 2] - w * S[m, 1, 2]
            D[m, 1] += kn * S[m, 2, 2] + w * S[m, 0, 2]
            D[m, 2] -= kt * S[m, 0, 2] + kn * S[m, 1, 2]
            if len(slopes) > 0:
                for i in range(3):
                    D[m, i] += slopes[q] * S[m, i, 2]
            for i in range(3):
                D[m, i] *= per_hs
        for n in range(states):
            _into_frame(frame[q], gradient[q, :, :, n], g)
            trace = lam * (g[0, 0] + g[1, 1] + g[2, 2])
            for a in range(3):
                for b in range(3):
                    sigma[a, b] = mu * (g[a, b] + g[b, a])
                sigma[a, a] += trace
            if len(initial_stress) > 0:
                _into_frame(frame[q], initial_stress[q, :, :, n], S0)
                _into_frame(frame[q], change[q, :, :, n], S1)
                sigma += S0
            for m in range(3):
                W, p0, p1, p2, p12, p22, volume = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(3):
                    G0, G1, X2 = G[m, i, 0], G[m, i, 1], X[m, i]
                    W += (sigma[i, 0] - S1[i, 0]) * G0 + (sigma[i, 1] - S1[i, 1]) * G1
                    p0 += sigma[i, 0] * G0 + S[m, i, 0] * g[i, 0]
                    p1 += sigma[i, 1] * G0 + S[m, i, 1] * g[i, 0]
                    p2 += sigma[i, 2] * G0 + S[m, i, 2] * g[i, 0]
                    p12 += sigma[i, 2] * G1 + S[m, i, 2] * g[i, 1]
                    p22 += sigma[i, 2] * X2 + S[m, i, 2] * g[i, 2]
                    volume += sigma[i, 2] * X1[m, i] + D[m, i] * g[i, 0]
                    if len(bend) > 0:
                        volume += S1[i, 0] * bend[m, i, 0] + S1[i, 1] * bend[m, i, 1]
                p0 -= W
                p22 -= W
                volume += (w * p12 - kt * p22) * per_hs
                if len(force) > 0:
                    for a in range(3):
                        f = 0.0
                        for i in range(3):
                            f += frame[q, a, i] * force[q, i, n]
                        volume -= f * G[m, a, 0]
                along_radius = p0 * c + p1 * s
                along_front = p2 * per_hs / turn[q, 3]
                for side in range(2):
                    for k in range(domains):
                        result[n, k, m, hat[q, side]] += (
                            value[side, k] * volume
                            + slope_r[side, k] * along_radius
                            + change_s[side, k] * along_front
                        )


@kernel
def surface_terms(  # type: ignore[no-untyped-def]
    weight, outward_normal, traction, gradient, initial_stress, polar_place, frame, hat, share,
    radii, lam, mu, result,
):  # fmt: skip
    """Subtract the integrals of P_kj m_j V_k over a lip or a side from those of the hats.

    Parameters
    ----------
    weight : (q,) array
        Area of each point.
    outward_normal : (q, 3) array
        Normal m that points out of the body.
    traction : (q, 3, n) array
        True traction there, of n states.
    gradient : (q or 0, 3, 3, n) array
        Displacement gradients; without them the surface counts as free of auxiliary traction.
    initial_stress : (q or 0, 3, 3, n) array
        Initial stress at the foot, if any.
    polar, frame, hat, share, radii, lam, mu
        As of `front_terms`.
    result : (n, k, 3, hats) array
        Added to.
    """
    states = traction.shape[2]
    kolosov = (lam + 3 * mu) / (lam + mu)
    scale = 1.0 / (2.0 * mu * math.sqrt(2.0 * math.pi))
    U, U_turn, slope = zeros((3, 3)), zeros((3, 3)), zeros((3, 3))
    G, spin, bend = zeros((3, 3, 2)), zeros((3, 3, 2)), zeros((0, 3, 2))
    S = empty((3, 3, 3))
    g, sigma, m_out, t = empty((3, 3)), empty((3, 3)), empty(3), empty(3)
    domains = radii.shape[1]
    value = empty((2, domains))
    for q in range(len(weight)):
        r = polar_place[q, 0]
        if r >= _largest_radius(radii, hat[q]) or r <= 0.0:
            continue
        for a in range(3):
            m_out[a] = 0.0
            for i in range(3):
                m_out[a] += frame[q, a, i] * outward_normal[q, i]
        for side in range(2):
            part = share[q] if side == 1 else 1.0 - share[q]
            for k in range(domains):
                Q, _ = _weight(r, radii[hat[q, side], k])
                value[side, k] = weight[q] * part * Q
        ch, sh = math.cos(0.5 * polar_place[q, 1]), math.sin(0.5 * polar_place[q, 1])
        for mode in range(3):
            _set_unit_field(mode, r, ch, sh, kolosov, scale, U, U_turn, G, slope, spin, bend)
            _set_unit_stress(mode, G, lam, mu, S)
            for n in range(states):
                density = 0.0
                for a in range(3):
                    t[a] = 0.0
                    for i in range(3):
                        t[a] += frame[q, a, i] * traction[q, i, n]
                    density += t[a] * G[mode, a, 0]
                if len(gradient) > 0:
                    _into_frame(frame[q], gradient[q, :, :, n], g)
                    for a in range(3):
                        for b in range(3):
                            sigma[a, b] = 0.0
                    if len(initial_stress) > 0:
                        _into_frame(frame[q], initial_stress[q, :, :, n], sigma)
                    trace = lam * (g[0, 0] + g[1, 1] + g[2, 2])
                    W = 0.0
                    for a in range(3):
                        for b in range(3):
                            sigma[a, b] += mu * (g[a, b] + g[b, a])
                            density += S[mode, a, b] * m_out[b] * g[a, 0]
                        sigma[a, a] += trace
                        W += sigma[a, 0] * G[mode, a, 0] + sigma[a, 1] * G[mode, a, 1]
                    density -= W * m_out[0]
                for side in range(2):
                    for k in range(domains):
                        result[n, k, mode, hat[q, side]] -= value[side, k] * density
