"""Scenes with exact solutions, imposed on any box; shared by the physics tests."""

from collections.abc import Callable

import exact
import numpy as np

import xcrack as xc

UNIT = {"E": 1.0, "nu": 0.3}
Field = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def perturbed(n, seed=3, amplitude=0.15, lower=(-1.0, -1.0), upper=(1.0, 1.0)):
    """A structured box whose inner points are moved by a share of a cell."""
    mesh = xc.box(lower, upper, n)
    rng = np.random.default_rng(seed)
    x = np.array(mesh.points)
    low, high = np.array(lower), np.array(upper)
    h = (high - low) / n
    inner = ((x > low + 1e-9) & (x < high - 1e-9)).all(axis=1)
    x[inner] += amplitude * h * rng.uniform(-1, 1, (int(inner.sum()), 2))
    return xc.Mesh(x, mesh.cells, mesh.facet_sets)


def rows(angle):
    """Frame (ahead, left) of a direction."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def turned(function, origin, angle=0.0):
    """Displacement and stress `(n, d, d)` of an exact field placed at an origin and turned."""
    Q, origin = rows(angle), np.asarray(origin, dtype=float)

    def field(x):
        y = (x - origin) @ Q.T
        u, s = function(y[:, 0], y[:, 1])
        sigma = np.empty((len(x), 2, 2))
        sigma[:, 0, 0], sigma[:, 1, 1] = s[:, 0], s[:, 1]
        sigma[:, 0, 1] = sigma[:, 1, 0] = s[:, 2]
        return u @ Q, np.einsum("ai,qab,bj->qij", Q, sigma, Q)

    return field


def tractions(field, names):
    """Exact tractions on the given sets."""
    return [
        xc.traction(name, lambda x, normal: np.einsum("qij,qj->qi", field(x)[1], normal))
        for name in names
    ]


def imposed(field, names):
    """Exact displacements on the given sets."""
    return [xc.displacement(name, lambda x: field(x)[0]) for name in names]


def on_box(mesh, cracks, field, *, traction=(), order=2, plane="strain", E=1.0, nu=0.3, **options):
    """Problem whose exact solution is the field: tractions on some sides, displacements elsewhere."""
    sides = [s for s in ("left", "right", "bottom", "top") if s not in traction]
    return xc.Problem(
        mesh,
        xc.Isotropic(E, nu, plane),
        cracks,
        supports=imposed(field, sides),
        loads=tractions(field, traction),
        order=order,
        **options,
    )


def edge_line(tip, angle, length=1.3):
    """Straight crack that ends at the tip, running in the direction of the angle."""
    tip = np.asarray(tip, dtype=float)
    return xc.line_crack([tip - length * rows(angle)[0], tip])


def williams_edge(n, tip, angle, *, seed=3, order=2, K=(1.0, 0.6), T=0.0, plane="strain", **options):
    """Edge crack in [-1, 1]² under a Williams field, traction on the cracked side."""
    field = turned(
        lambda x, y: exact.williams(x, y, 1.0, 0.3, K[0], K[1], T, plane=plane), tip, angle
    )
    problem = on_box(
        perturbed(n, seed),
        [edge_line(tip, angle)],
        field,
        traction=("left",),
        order=order,
        plane=plane,
        **options,
    )
    return problem, field


def l2(values, reference, measure):
    """Relative L2 error along a lip."""
    return float(
        np.sqrt(np.sum(measure * (values - reference) ** 2) / np.sum(measure * reference**2))
    )


def rate(errors, sizes):
    """Slope of log(error) over log(size), fitted over all sizes."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


# K, stability and invariance -------------------------------------------------------------------

# Four tips and angles in [-1, 1]² (drawn once); the crack runs out through the left side.
TIPS = (
    ((0.083, 0.047), 0.12),
    ((-0.061, 0.078), -0.254),
    ((0.057, -0.082), 0.231),
    ((-0.021, -0.036), -0.118),
)


def n_free(problem):
    """Unknowns that are solved for: those that supports decide are left out."""
    from xcrack.solving import build

    model = build(problem)
    return int((~model.known.fixed).sum())


def K_of(problem, crack=0):
    """K of the tips of a crack `(f, 2)`, without a word about clipped domains."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return np.array(xc.stress_intensity(xc.solve(problem), crack).K)


def wedge(theta):
    """Rotation by an angle, to be applied to rows of points."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [-s, c]])


def griffith_box(n, *, a=1.0, half=2.0, stress=(0.0, 1.0, 0.0), angle=0.0, origin=(0.0, 0.0),
                 order=2, seed=3, amplitude=0.15, E=1.0, nu=0.3, plane="strain", points=None,
                 contact="auto", **options):  # fmt: skip
    """Crack [-a, a] in an infinite plane, exact displacements imposed on a square around it.

    `stress` is (sxx, syy, sxy) in the frame of the crack, which is turned by `angle`; `points`
    replaces the two ends of the crack.
    """
    field = turned(
        lambda x, y: exact.griffith(x, y, a, E, nu, *stress, plane=plane), origin, angle
    )
    mesh = perturbed(n, seed, amplitude, (-half, -half), (half, half))
    if points is None:
        points = np.array([[-a, 0.0], [a, 0.0]]) @ rows(angle) + np.asarray(origin)
    sides = ("left", "right", "bottom", "top")
    problem = xc.Problem(
        mesh, xc.Isotropic(E, nu, plane), [xc.line_crack(points)], supports=imposed(field, sides),
        order=order, contact=contact, numerics=xc.Numerics(**options),
    )  # fmt: skip
    return problem, field
