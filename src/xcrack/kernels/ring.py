"""The interaction integral in 2D, point by point."""

import math

import numpy as np

from xcrack.kernels.jit import kernel


@kernel
def add_ring(  # type: ignore[no-untyped-def]
    total, gradient, xi, theta, weight, radii, inner, frame, modes, kolosov, lam, mu
):
    """Add the domain integrals of modes I, II and of the point force.

    With the unit field u^a, its stress and q: (C : (u^a_,1 x grad q) + (stress grad q) x e_1 -
    q_,1 stress) : grad u, in the frame (ahead, normal). A left-handed frame changes no formula.

    Parameters
    ----------
    total : (s, k, 3) array
        By state, domain and field; changed in place.
    gradient : (q, 2, 2, s) array
        Of the displacements (component, derivative), global axes.
    xi : (q, 2) array, length
        Places from the tip, in its frame.
    theta : (q,) array
        Angle, continued along the crack faces.
    weight : (q,) array
    radii, inner : (k,) arrays, length
        q falls from one to zero by a quintic between inner and radii.
    frame : (2, 2) array
    modes : (2, 2, 4) array
        Displacements of modes I and II by tip function.
    kolosov, lam, mu : float
    """
    states, domains = total.shape[0], total.shape[1]
    ahead, normal = np.empty(4), np.empty(4)
    g, sigma = np.empty((3, 2, 2)), np.empty((3, 2, 2))
    factor, turned = np.empty((2, 2)), np.empty((2, 2))
    largest, smallest = radii[0], inner[0]
    for k in range(domains):
        largest, smallest = max(largest, radii[k]), min(smallest, inner[k])
    for p in range(len(weight)):
        x, y = xi[p, 0], xi[p, 1]
        r = math.sqrt(x * x + y * y)
        if r >= largest or r <= smallest:
            continue
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
                g[m, i, 0] = 0.0
                g[m, i, 1] = 0.0
                for f in range(4):
                    g[m, i, 0] += modes[m, i, f] * ahead[f]
                    g[m, i, 1] += modes[m, i, f] * normal[f]
        radial = -C / (math.pi * r)
        mean = (3.0 - kolosov) / 4.0 * radial
        turn = (kolosov + 1.0) / (8.0 * mu * math.pi) * S / r
        g[2, 0, 0] = (radial * C * C - mean) / (2.0 * mu)
        g[2, 0, 1] = radial * C * S / (2.0 * mu) - turn
        g[2, 1, 0] = radial * C * S / (2.0 * mu) + turn
        g[2, 1, 1] = (radial * S * S - mean) / (2.0 * mu)
        for m in range(3):
            trace = lam * (g[m, 0, 0] + g[m, 1, 1])
            sigma[m, 0, 0] = trace + 2.0 * mu * g[m, 0, 0]
            sigma[m, 1, 1] = trace + 2.0 * mu * g[m, 1, 1]
            sigma[m, 0, 1] = mu * (g[m, 0, 1] + g[m, 1, 0])
            sigma[m, 1, 0] = sigma[m, 0, 1]
        for k in range(domains):
            width = radii[k] - inner[k]
            z = (r - inner[k]) / width
            if z <= 0.0 or z >= 1.0:
                continue
            fall = -30.0 * z * z * (1.0 - z) * (1.0 - z) / (width * r) * weight[p]
            dx, dy = fall * x, fall * y
            for m in range(3):
                a, b = g[m, 0, 0], g[m, 1, 0]
                trace = lam * (a * dx + b * dy)
                factor[0, 0] = trace + 2.0 * mu * a * dx
                factor[1, 1] = trace + 2.0 * mu * b * dy
                factor[0, 1] = mu * (a * dy + b * dx)
                factor[1, 0] = factor[0, 1]
                for i in range(2):
                    factor[i, 0] += sigma[m, i, 0] * dx + sigma[m, i, 1] * dy
                    for j in range(2):
                        factor[i, j] -= dx * sigma[m, i, j]
                for i in range(2):
                    for j in range(2):
                        turned[i, j] = 0.0
                        for e in range(2):
                            for h in range(2):
                                turned[i, j] += frame[e, i] * factor[e, h] * frame[h, j]
                for state in range(states):
                    for i in range(2):
                        for j in range(2):
                            total[state, k, m] += turned[i, j] * gradient[p, i, j, state]
