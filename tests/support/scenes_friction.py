"""Cracks whose faces rub, with exact fields, and drawn ones."""

import numpy as np

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.scenes_2d import SIDES

TURN, ORIGIN = 0.31, (0.05, -0.07)


def sliding(effective, tau, p):
    """Crack [-1, 1] pressed by p under shear tau, of which tau - effective is locked by friction.

    The slip is that of Griffith's crack under the effective shear; K_II = effective sqrt(pi).
    """

    def plane(x, y):
        u_crack, s_crack = exact.griffith(x, y, 1.0, 1.0, 0.3, 0.0, 0.0, effective)
        u_body, s_body = exact.uniform_stress(x, y, 0.0, -p, tau - effective, 1.0, 0.3)
        return u_crack + u_body, s_crack + s_body

    return plane


def effective_shear(taus, pressures, mu):
    """Effective shear along a path of loads: what friction cannot carry moves the faces."""
    value, result = 0.0, []
    for tau, p in zip(taus, pressures, strict=True):
        carried = tau - value
        if abs(carried) > mu * p:
            value = tau - np.sign(carried) * mu * p
        result.append(value)
    return np.array(result)


def path(n, taus, pressures, mu, order, **options):
    """The crack under a path of loads: problem, states and exact effective shears."""
    effective = effective_shear(taus, pressures, mu)
    every = zip(effective, taus, pressures, strict=True)
    fields = [scenes.turned(sliding(*each), ORIGIN, TURN) for each in every]
    states = [scenes.imposed(field, SIDES) for field in fields]
    problem, _ = scenes.centre_crack(
        sliding(0.0, 0.0, 1.0), n, angle=TURN, origin=ORIGIN, order=order, contact="on",
        friction=mu, **options,
    )  # fmt: skip
    return problem, states, effective


def smooth(p0, p1, mu):
    """Field without a jump: pressure p0 + p1 x on y = 0, and shear mu times as large."""

    def plane(x, y):
        z = np.asarray(x, float) + 1j * np.asarray(y, float)
        a, b = -p0 + 1j * mu * p0, (-p1 + 1j * mu * p1) / 2
        rest = np.zeros_like(z)
        return exact.km_field(
            z, rest, rest, rest, a * z + b * z**2, a + 2 * b * z, 1.0, 0.3, "strain"
        )

    return plane


def partly_slipping(p0, p1, mu, tau):
    """Closed crack [-1, 1] under pressure p0 + p1 x, p1 < 0, and shear tau: sticks on the left.

    The mode II copy of the crack in bending that is closed on its left.
    """
    middle, c, _ = exact.partial_closure_params(1.0, tau - mu * p0, -mu * p1)
    slope = -mu * p1
    mean = tau - mu * p0 + slope * middle
    remote = smooth(p0, p1, mu)

    def root(z):
        return exact.csqrt2(z, -c, c)

    def top(z):
        return mean * z + slope * (z * z - c * c / 2)

    def plane(x, y):
        z = exact._z(np.asarray(x, float) - middle, y, 1)
        u, s = exact.westergaard_field(
            z, None, None, None,
            lambda t: top(t) / root(t),
            lambda t: root(t) * (mean + slope * t / 2),
            lambda t: (mean + 2 * slope * t) / root(t) - t * top(t) / root(t) ** 3,
            0.0, 1.0, 0.3, "strain",
        )  # fmt: skip
        u_body, s_body = remote(x, y)
        return u + u_body, s + s_body

    return plane, middle - c


def drawn_crack(rng):
    """A straight crack with two tips or one, or a kinked one, in [-1, 1]²."""
    kind, turn = rng.integers(3), rng.uniform(0, 2 * np.pi)
    ahead = scenes.rows(turn)[0]
    if kind == 0:
        middle, half = rng.uniform(-0.2, 0.2, 2), rng.uniform(0.3, 0.55)
        return xc.line_crack([middle - half * ahead, middle + half * ahead])
    if kind == 1:
        tip = rng.uniform(-0.2, 0.2, 2)
        return xc.line_crack([tip - 2.5 * ahead, tip])
    turns = np.cumsum(rng.uniform(-0.7, 0.7, 4)) + turn
    steps = rng.uniform(0.15, 0.3, 4)[:, None] * np.array([scenes.rows(t)[0] for t in turns])
    points = np.cumsum(np.concatenate([rng.uniform(-0.3, 0.3, (1, 2)), steps]), axis=0)
    return xc.line_crack(points - points.mean(axis=0))


def drawn_state(rng, share):
    """Tractions of a drawn polynomial field; `share` of hydrostatic pressure."""
    c = 0.35 * rng.normal(size=6)

    def plane(x, y):
        z = np.asarray(x, float) + 1j * np.asarray(y, float)
        a, b, e = 0.3 * (c[0] + 1j * c[1]), 0.2 * (c[2] + 1j * c[3]), c[4] + 1j * c[5]
        phi = -share / 2 * z + a * z**2 + b * z**3
        first, second = -share / 2 + 2 * a * z + 3 * b * z**2, 2 * a + 6 * b * z
        return exact.km_field(z, phi, first, second, e * z, e + 0 * z, 1.0, 0.3, "strain")

    return scenes.tractions(scenes.turned(plane, (0.0, 0.0)), SIDES)


def drawn(seed, largest=26, states=8, **options):
    """A drawn body with a crack, its friction and its load states."""
    rng = np.random.default_rng(seed)
    mesh = scenes.perturbed(int(rng.integers(9, largest)), seed)
    crack, mu = drawn_crack(rng), float(rng.choice([0.1, 0.3, 0.6, 1.0, 2.0]))
    loads = [drawn_state(rng, rng.choice([0.0, 0.3, 0.6, 1.0])) for _ in range(states)]
    problem = xc.Problem(
        mesh, xc.Isotropic(1.0, 0.3, "strain"), [crack], order=1 + seed % 2, contact="on",
        friction=mu, **options,
    )  # fmt: skip
    return problem, loads
