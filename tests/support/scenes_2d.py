"""Scenes with exact solutions, imposed on any box; shared by the physics tests."""

from collections.abc import Callable

import numpy as np

import xcrack as xc
from support import exact
from xcrack.verification.book.scenes_2d import (
    SIDES,
    annulus,
    edge_line,
    imposed,
    inner_part,
    l2,
    on_box,
    perturbed,
    rows,
    tractions,
    turned,
)

UNIT = {"E": 1.0, "nu": 0.3}
Field = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def numerics_of(**choices):
    """Choices of method by name."""
    return xc.Numerics(**choices)


def williams_edge(
    n, tip, angle, *, seed=3, order=2, K=(1.0, 0.6), T=0.0, plane="strain", **options
):
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
    from xcrack.analysis.solve import build

    model = build(problem)
    return int((~model.imposed_values.is_fixed).sum())


def K_of(problem, crack=0):
    """K of the tips of a crack `(f, 2)` as the integrals give it, without warnings."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return xc.stress_intensity(xc.solve(problem), crack).K_integral


def griffith_box(n, *, a=1.0, half=2.0, stress=(0.0, 1.0, 0.0), angle=0.0, origin=(0.0, 0.0),
                 order=2, seed=3, amplitude=0.15, E=1.0, nu=0.3, plane="strain", points=None,
                 contact="auto", **options):  # fmt: skip
    """Crack [-a, a] in an infinite plane, exact displacements imposed on a square around it.

    `stress` is (sxx, syy, sxy) in the frame of the crack, which is turned by `angle`; `points`
    replaces the two ends of the crack.
    """
    field = turned(lambda x, y: exact.griffith(x, y, a, E, nu, *stress, plane=plane), origin, angle)
    mesh = perturbed(n, seed, amplitude, (-half, -half), (half, half))
    if points is None:
        points = np.array([[-a, 0.0], [a, 0.0]]) @ rows(angle) + np.asarray(origin)
    sides = ("left", "right", "bottom", "top")
    problem = xc.Problem(
        mesh, xc.Isotropic(E, nu, plane), [xc.line_crack(points)], supports=imposed(field, sides),
        order=order, contact=contact, numerics=numerics_of(**options),
    )  # fmt: skip
    return problem, field


def condition(problem):
    """Condition number of the matrix that the solver factors; infinite where it is singular."""
    import scipy.sparse as sp
    import scipy.sparse.linalg as sla

    from xcrack.analysis.solve import build
    from xcrack.linalg.direct import scaled_basis

    model = build(problem)
    basis = scaled_basis(
        model.space,
        model.stiffness,
        model.imposed_values.is_fixed,
        problem.numerics,
        problem.material,
    )
    A = sp.csc_matrix(basis.T @ model.stiffness @ basis)
    A = (A + A.T) / 2
    start = np.random.default_rng(70331).standard_normal(A.shape[0])
    options = {"k": 1, "return_eigenvectors": False, "tol": 1e-5, "v0": start}
    largest = float(sla.eigsh(A, which="LA", **options)[0])
    try:
        factor = sla.splu(
            A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        inverse = sla.LinearOperator(A.shape, matvec=factor.solve)
        smallest = 1 / float(sla.eigsh(inverse, which="LM", **options)[0])
    except (RuntimeError, sla.ArpackError):
        return np.inf
    return largest / smallest if smallest > 0 else np.inf


# Contact -----------------------------------------------------------------------------------------


def polynomial_pressure(x, y, terms, E=1.0, nu=0.3, plane="strain"):
    """Smooth field without shear on y = 0, and of any degree: for patch tests of the crack faces.

    `terms` are (k, a, b): phi = a z^(k+1) and psi = (b - i k Im a) z^(k+1), which give
    sigma_xy(x, 0) = 0 and sigma_yy(x, 0) = (k + 1) ((k + 2) Re a + b) x^k.
    """
    z = np.asarray(x, float) + 1j * np.asarray(y, float)
    phi, Phi, dPhi, psi, Psi = (0 * z for _ in range(5))
    for k, a, b in terms:
        c = b - 1j * k * a.imag
        phi, psi = phi + a * z ** (k + 1), psi + c * z ** (k + 1)
        Phi, Psi = Phi + (k + 1) * a * z**k, Psi + (k + 1) * c * z**k
        if k:
            dPhi = dPhi + k * (k + 1) * a * z ** (k - 1)
    return exact.km_field(z, phi, Phi, dPhi, psi, Psi, E, nu, plane)


def pressure_of(terms):
    """Pressure along y = 0 of `polynomial_pressure`."""
    return lambda x: -sum((k + 1) * ((k + 2) * a.real + b) * x**k for k, a, b in terms)


def added(*functions):
    """Sum of exact fields."""

    def total(x, y):
        parts = [f(x, y) for f in functions]
        return sum(u for u, _ in parts), sum(s for _, s in parts)

    return total


def bending_cycle(x, y, s_m, s_b=1.0, a=1.0, E=1.0, nu=0.3, plane="strain"):
    """Crack [-a, a] under sigma_y = s_m + s_b x / a at any s_m: open, half open or closed.

    The remote stress along the crack, s_b x / a, does not depend on s_m.
    """
    B = s_b / a
    if s_m >= 0.5 * s_b:
        c, x0 = a, 0.0
    elif s_m > -s_b:
        x0, c, _ = exact.partial_closure_params(a, s_m, s_b)
    else:
        c, x0 = 0.0, a
    A = s_m + B * x0
    z = exact._z(np.asarray(x, float) - x0, y)
    if c == 0:
        return exact.westergaard_field(
            z, lambda t: A + B * t, lambda t: A * t + B * t * t / 2, lambda t: B + 0 * t,
            None, None, None, -s_m, E, nu, plane,
        )  # fmt: skip

    def q(t):
        return exact.csqrt2(t, -c, c)

    def Z(t):
        return (A * t + B * (t * t - c * c / 2)) / q(t)

    return exact.westergaard_field(
        z, Z, lambda t: q(t) * (A + B * t / 2),
        lambda t: (A + 2 * B * t) / q(t) - t * (A * t + B * (t * t - c * c / 2)) / q(t) ** 3,
        None, None, None, -s_m, E, nu, plane,
    )  # fmt: skip


def bending_K(s_m, s_b=1.0, a=1.0):
    """K_I at -a and at a in `bending_cycle`."""
    if s_m >= 0.5 * s_b:
        return np.sqrt(np.pi * a) * np.array([s_m - s_b / 2, s_m + s_b / 2])
    if s_m <= -s_b:
        return np.zeros(2)
    return np.array([0.0, exact.partial_closure_params(a, s_m, s_b)[2]])


def centre_crack(function, n, *, a=1.0, half=2.0, angle=0.0, origin=(0.0, 0.0), seed=3, E=1.0,
                 amplitude=0.15, **options):  # fmt: skip
    """Crack [-a, a] in a square of the given half side, the exact field turned and imposed."""
    field = turned(function, origin, angle)
    mesh = perturbed(n, seed, amplitude, (-half, -half), (half, half))
    crack = xc.line_crack(np.array([[-a, 0.0], [a, 0.0]]) @ rows(angle) + np.asarray(origin))
    return on_box(mesh, [crack], field, E=E, **options), field
