"""Scenes of several materials, with K from exact energies and from another program."""

import numpy as np

import xcrack as xc

PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]

# K by scikit-fem 12: conforming quadratic triangles with a seam, graded to 2e-5 at tips and where
# interfaces meet sides, and the classical interaction integral within the material of the tip. Two
# radii of it differ by less than 1e-5, a coarser mesh by the digits given here.
EDGE_CRACKS = [  # tip, E behind x = .5 over that before, K_I
    (0.4, 0.1, 3.57443), (0.4, 10.0, 0.814851), (0.6, 0.1, 5.6836), (0.6, 10.0, 5.3241),
]  # fmt: skip
MIXED_MODES = [  # ratio, nu behind, K_I and K_II of the upper tip
    (0.1, 0.3, (1.09520, 0.95593)), (10.0, 0.3, (0.213036, 0.134914)),
    (10.0, 0.0, (0.219199, 0.142955)), (3.0, 0.45, (0.281050, 0.225481)),
]  # fmt: skip
THERMAL = [(5.0, 5.54772e-3), (0.2, -8.45631e-4)]  # ratio, K_I
GRADED = [  # E at x = 1 over that at 0, tip, K_I
    (0.1, 0.2, 1.02410), (0.1, 0.4, 2.8534), (0.1, 0.6, 6.8164), (0.2, 0.2, 1.10339),
    (0.2, 0.4, 2.7256), (0.2, 0.6, 6.4143), (5.0, 0.2, 0.89829), (5.0, 0.4, 1.96146),
    (5.0, 0.6, 4.7358), (10.0, 0.2, 0.79538), (10.0, 0.4, 1.78189), (10.0, 0.6, 4.4121),
]  # fmt: skip


def with_halves(mesh, axis=0, where=0.5):
    """The mesh with the sets "one" below a plane and "two" above it."""
    middle = mesh.points[mesh.cells].mean(axis=1)[:, axis]
    sets = {"one": np.nonzero(middle < where)[0], "two": np.nonzero(middle > where)[0]}
    facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
    return xc.Mesh(mesh.points, mesh.cells, facets, sets)


def perturbed(n, axis, seed=1201):
    """A unit box in two halves, whose inner points are moved, on the interface along it."""
    dim = len(n)
    mesh = with_halves(xc.box((0.0,) * dim, (1.0,) * dim, n), axis)
    x = np.array(mesh.points)
    inner = ((x > 1e-9) & (x < 1 - 1e-9)).all(axis=1)
    moved = np.random.default_rng(seed).uniform(-0.2, 0.2, x.shape) / np.array(n) * inner[:, None]
    moved[np.abs(x[:, axis] - 0.5) < 1e-9, axis] = 0.0
    facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
    return xc.Mesh(x + moved, mesh.cells, facets, mesh.cell_sets)


def drawn_points(seed):
    """Points of a unit square away from both its middle lines."""
    x = np.random.default_rng(seed).uniform(0.01, 0.99, (1500, 2))
    return x[(np.abs(x - 0.5) > 1e-3).all(axis=1)]


def without_motion(x, u):
    """Displacements less the rigid motion that fits them best."""
    one, zero = np.ones(len(x)), np.zeros(len(x))
    modes = np.stack([np.r_[one, zero], np.r_[zero, one], np.r_[-x[:, 1], x[:, 0]]], axis=1)
    flat = u.T.ravel()
    return flat - modes @ np.linalg.lstsq(modes, flat, rcond=None)[0]


def drawn_inf_sup(rng, order):
    """Inf-sup constant of a crack through an interface."""
    n = 2 * int(rng.integers(4, 13)), int(rng.integers(8, 26))
    x = xc.box((0.0, 0.0), (1.0, 1.0), n)
    mesh = perturbed(n, 0, int(rng.integers(1 << 30)))
    assert len(mesh.cells) == len(x.cells)
    angle, y = rng.uniform(-1.2, 1.2), rng.uniform(0.3, 0.7)
    along, (back, ahead) = np.array([np.cos(angle), np.sin(angle)]), rng.uniform(0.12, 0.28, 2)
    centre = np.array([0.5, y])
    crack = xc.line_crack([centre - back * along, centre + ahead * along])
    one, two = xc.Isotropic(1.0, 0.3, "strain"), xc.Isotropic(1.000001, 0.3, "strain")
    return xc.inf_sup(xc.Problem(mesh, {"one": one, "two": two}, [crack], order=order))


def square(n):
    """Width 1 and height 2 in two halves, n cells across; a crack at y = 0 is in a row of cells."""
    return with_halves(xc.box((0.0, -1.0), (1.0, 1.0), (n, 2 * n + 1)))


def pair(ratio, nu=0.3, alphas=(None, None)):
    return {"one": xc.Isotropic(1.0, 0.3, "strain", alpha=alphas[0]),
            "two": xc.Isotropic(ratio, nu, "strain", alpha=alphas[1])}  # fmt: skip


def edge_crack(n, a, ratio):
    return xc.Problem(square(n), pair(ratio), [xc.line_crack([(0, 0), (a, 0)])], loads=PULL)


def slanted_crack(n, ratio, nu, domain=None):
    numerics = xc.Numerics() if domain is None else xc.Numerics(domain=domain)
    crack = xc.line_crack([(0.2, -0.1), (0.43, 0.13)])
    return xc.Problem(square(n), pair(ratio, nu), [crack], loads=PULL, numerics=numerics)


def heated(n, ratio, *alphas):
    crack = xc.line_crack([(0, 0), (0.4, 0)])
    return xc.Problem(square(n), pair(ratio, alphas=alphas), [crack], loads=[xc.temperature(1.0)],
                      contact="off")  # fmt: skip


def stretch(E, nu):
    """Stiffness of a layer that is stretched across and cannot contract along itself."""
    return E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def strip(n, material, sets=None, **choices):
    """Half height 1, n cells to it, its sides moved apart by 1; cracked to x = .0123."""
    mesh = xc.box((-9.0, -1.0), (9.0, 1.0), (18 * n, 2 * n + 1))  # what ends do falls by 4 in 1
    if sets is not None:
        facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
        mesh = xc.Mesh(mesh.points, mesh.cells, facets, sets(mesh.points[mesh.cells].mean(axis=1)))
    apart = [xc.displacement("top", (0.0, 0.5)), xc.displacement("bottom", (0.0, -0.5))]
    crack = xc.line_crack([(-11.0, 0.0), (0.0123, 0.0)])
    return xc.Problem(mesh, material, [crack], apart, **choices)


def layered_strip(n, ratio):
    """K of a strip with a core of E = 1 and a skin of another material, and its exact K_I."""
    height = 1 / (n + 0.5)
    core = (round(0.3 * n) + 0.5) * height

    def sets(x):
        inside = np.abs(x[:, 1]) < core
        return {"core": np.nonzero(inside)[0], "skin": np.nonzero(~inside)[0]}

    materials = {
        "core": xc.Isotropic(1.0, 0.3, "strain"),
        "skin": xc.Isotropic(ratio, 0.2, "strain"),
    }
    flexibility = 2 * (core / stretch(1.0, 0.3) + (1 - core) / stretch(ratio, 0.2))
    sif = xc.stress_intensity(xc.solve(strip(n, materials, sets)))
    return sif, np.sqrt(0.5 / flexibility / (1 - 0.3**2))


def graded_plate(n, ratio, a):
    """E from 1 to `ratio` over the width by an exponential; height 8, cells far away are long."""
    step = 1 / n
    y = [step / 2 + step * k for k in range(n // 2 + 1)]
    while y[-1] < 4.0:
        step *= 1.25
        y.append(y[-1] + step)
    y = np.array(y) * (4.0 / y[-1])
    grid = xc.box((0.0, 0.0), (1.0, 1.0), (n, 2 * len(y) - 1))
    x = np.array(grid.points)
    rows = np.round(x[:, 1] * (2 * len(y) - 1)).astype(int)
    x[:, 1] = np.r_[-y[::-1], y][rows]
    facets = {name: f for name, f in grid.facet_sets.items() if name != "boundary"}
    material = xc.Graded(lambda x: ratio ** x[:, 0], 0.3, "strain")
    return xc.Problem(xc.Mesh(x, grid.cells, facets), material, [xc.line_crack([(0, 0), (a, 0)])],
                      loads=PULL)  # fmt: skip
