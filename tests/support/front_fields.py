"""Exact fields around crack fronts in 3D, and points that fill a tube around a front."""

import numpy as np
from scipy.special import elliprd

from support import exact
from xcrack.crack.fronts import front_curve

GAUSS = np.polynomial.legendre.leggauss


def flat_front(points, ahead, closed=True):
    """Front in the plane z = 0, lip + above."""
    normal = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    frame = np.stack([ahead, normal, np.cross(ahead, normal)], axis=1)
    return front_curve(points, frame, closed)


def ellipse_front(a, b, m, seed=None):
    """Clockwise seen from +z; with a seed at uneven places."""
    omega = -np.linspace(0, 2 * np.pi, m + 1)
    if seed is not None:
        drawn = np.random.default_rng(seed).uniform(-0.2, 0.2, m - 1)
        omega[1:-1] += drawn * 2 * np.pi / m
    c, s = np.cos(omega), np.sin(omega)
    ahead = np.stack([b * c, a * s, 0 * c], axis=1)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return flat_front(np.stack([a * c, b * s, 0 * c], axis=1), ahead)


def angle_on_ellipse(x, a, b):
    return np.arctan2(x[:, 1] / b, x[:, 0] / a)


def along_front(curve, knots, n=4):
    """Gauss points between tops of hats: parameters and weights."""
    grid = np.append(knots, knots[0] + curve.length) if curve.is_closed else knots
    t, w = GAUSS(n)
    width = np.diff(grid)[:, None]
    return (grid[:-1, None] + width * (t + 1) / 2).ravel(), (width * w / 2).ravel()


def radial(radius, ring=0.4, n=8):
    """Gauss points along r: with r = t² inside the ring, and in it."""
    t, w = GAUSS(n)
    t, w = (t + 1) / 2, w / 2
    inner = ring * radius
    r = np.concatenate([inner * t**2, inner + (radius - inner) * t])
    return r, np.concatenate([2 * inner * t * w, (radius - inner) * w])


def tube(curve, knots, radius, n=4, angles=24):
    """Points in a tube around a front: x, weight, r, theta in its frames."""
    s, ws = along_front(curve, knots, n)
    r, wr = radial(radius)
    t, wt = GAUSS(angles)
    x, frame, turn = curve.at(s)
    i, j, k = (v.ravel() for v in np.indices((len(s), len(r), angles)))
    theta, weight = np.pi * t[k], ws[i] * wr[j] * np.pi * wt[k]
    x1, x2 = r[j] * np.cos(theta), r[j] * np.sin(theta)
    place = x[i] + x1[:, None] * frame[i, 0] + x2[:, None] * frame[i, 1]
    metric = 1 - turn[i, 0] * x1 - turn[i, 1] * x2
    return place, weight * r[j] * metric * turn[i, 3], r[j], theta


def ruled_lips(curve, knots, radius, n=8):
    """Points on the surface x = X - rho t behind a front: x, normal to lip +, weight."""
    s, ws = along_front(curve, knots, n)
    rho, wr = radial(radius, n=10)
    x, frame, turn = curve.at(s)
    i, j = (v.ravel() for v in np.indices((len(s), len(rho))))
    metric, twist = 1 + turn[i, 0] * rho[j], -turn[i, 2] * rho[j]
    area = metric[:, None] * frame[i, 1] - twist[:, None] * frame[i, 2]
    size = np.linalg.norm(area, axis=1)
    weight = size * turn[i, 3] * ws[i] * wr[j]
    return x[i] - rho[j][:, None] * frame[i, 0], area / size[:, None], weight


def gradient_of(displacement, x, step):
    """Displacement gradient by differences of order four; the step never crosses the crack."""
    result = np.empty((len(x), 3, 3))
    for j in range(3):
        d = step[:, None] * np.eye(3)[j]
        near = displacement(x + d) - displacement(x - d)
        far = displacement(x + 2 * d) - displacement(x - 2 * d)
        result[:, :, j] = (8 * near - far) / (12 * step[:, None])
    return result


def penny(x, a, E, nu, S):
    return exact.penny(x, a, E, nu, S)


def ellipse(x, a, b, E, nu, S):
    """Displacement around an open elliptical crack, to round-off also near its front.

    h = -V / (2 pi) with the potential V = pi a b / 2 int_lambda^inf (1 - x²/(a²+s) - y²/(b²+s)
    - z²/s) ds / sqrt((a²+s)(b²+s) s) of the density sqrt(1 - x²/a² - y²/b²); amplitudes as in
    `exact.ellipse_disp`, which takes h from a quadrature.
    """
    X, Y, Z = x[:, 0], x[:, 1], np.abs(x[:, 2])
    squares, poles = np.stack([X, Y, Z]) ** 2, np.array([a * a, b * b, 0.0])
    # f = sum x_i² / (a_i² + lambda) - 1 is convex: Newton from the left goes up to its root.
    lam = np.maximum((squares - poles[:, None]).max(axis=0), 1e-30)
    for _ in range(80):
        f = (squares / (poles[:, None] + lam)).sum(axis=0) - 1
        df = -(squares / (poles[:, None] + lam) ** 2).sum(axis=0)
        lam = lam + np.maximum(-f / df, 0.0)
    A, B, C = poles[:, None] + lam
    root = np.sqrt(A * B * C)
    integral = [2 / 3 * elliprd(B, C, A), 2 / 3 * elliprd(A, C, B), 2 / 3 * elliprd(A, B, C)]
    total = (squares / np.stack([A, B, C]) ** 2).sum(axis=0)
    c = a * b / 2  # of -1 / (2 pi) times -pi a b

    def second_derivative(i, j):
        xi, xj = (X, Y, Z)[i], (X, Y, Z)[j]
        value = -2 * xi * xj / ((A, B, C)[i] * (A, B, C)[j] * root * total)
        return c * (value + (integral[i] if i == j else 0))

    names = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    h = {name: second_derivative(*ij) for name, ij in names.items()}
    h.update(g=c * Z * integral[2], x=c * X * integral[0], y=c * Y * integral[1])
    wz, wx, wy = exact.ellipse_coeffs(a, b, E, nu, S[2, 2], S[0, 2], S[1, 2])
    u, _ = exact.uniform_stress3(x, S, E, nu)
    u = u + wz * exact.crack_disp3(x, h, "n", nu) + wx * exact.crack_disp3(x, h, "x", nu)
    turned = {"g": h["g"], "x": h["y"], "y": -h["x"], "xx": h["yy"], "yy": h["xx"]}
    turned.update(xy=-h["xy"], zz=h["zz"], xz=h["yz"], yz=-h["xz"])
    v = wy * exact.crack_disp3(x, turned, "x", nu)
    return u + np.stack([-v[:, 1], v[:, 0], v[:, 2]], axis=1)
