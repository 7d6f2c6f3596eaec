"""Bodies of several materials: scenes with exact K, or with K of another program."""

from typing import Any

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats, Ints
from xcrack.crack.lines import line_crack
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import crack_pressure, displacement, temperature, traction
from xcrack.model.material import Graded, Isotropic
from xcrack.model.numerics import Numerics
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.exact import interface_crack

PULL = [traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))]

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


def with_halves(mesh: Mesh, axis: int = 0, where: float = 0.5) -> Mesh:
    """The mesh with the sets "one" below a plane and "two" above it."""
    middle = mesh.cell_middles[:, axis]
    sets = {"one": np.nonzero(middle < where)[0], "two": np.nonzero(middle > where)[0]}
    facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
    return Mesh(mesh.points, mesh.cells, facets, sets)


def perturbed(n: tuple[int, ...], axis: int, seed: int = 1201) -> Mesh:
    """A unit box in two halves, whose inner points are moved, on the interface along it."""
    dim = len(n)
    mesh = with_halves(box((0.0,) * dim, (1.0,) * dim, n), axis)
    x = np.array(mesh.points)
    inner = np.asarray(((x > 1e-9) & (x < 1 - 1e-9)).all(axis=1))
    shift = np.random.default_rng(seed).uniform(-0.2, 0.2, x.shape) / np.array(n) * inner[:, None]
    shift[np.abs(x[:, axis] - 0.5) < 1e-9, axis] = 0.0
    facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
    return Mesh(x + shift, mesh.cells, facets, mesh.cell_sets)


def square(n: int) -> Mesh:
    """Width 1 and height 2 in two halves, n cells across; a crack at y = 0 is in a row of cells."""
    return with_halves(box((0.0, -1.0), (1.0, 1.0), (n, 2 * n + 1)))


def pair(
    ratio: float, nu: float = 0.3, alphas: tuple[float | None, float | None] = (None, None)
) -> dict[str, Isotropic]:
    """E of one before the interface and of a ratio behind it."""
    return {"one": Isotropic(1.0, 0.3, "strain", alpha=alphas[0]),
            "two": Isotropic(ratio, nu, "strain", alpha=alphas[1])}  # fmt: skip


def edge_crack(n: int, a: float, ratio: float) -> Problem:
    """Pulled plate with a crack of length a; the interface is at x = .5."""
    return Problem(square(n), pair(ratio), [line_crack([(0, 0), (a, 0)])], loads=PULL)


def slanted_crack(n: int, ratio: float, nu: float, domain: float | None = None) -> Problem:
    """Pulled plate with a slanted crack before the interface."""
    numerics = Numerics() if domain is None else Numerics(domain=domain)
    crack = line_crack([(0.2, -0.1), (0.43, 0.13)])
    return Problem(square(n), pair(ratio, nu), [crack], loads=PULL, numerics=numerics)


def heated(n: int, ratio: float, alpha_before: float, alpha_behind: float) -> Problem:
    """Free plate with an edge crack, whose halves expand unlike."""
    crack = line_crack([(0, 0), (0.4, 0)])
    materials = pair(ratio, alphas=(alpha_before, alpha_behind))
    warm = [temperature(1.0)]
    return Problem(square(n), materials, [crack], loads=warm, contact="off")


def stretch(E: Any, nu: float) -> Any:
    """Stiffness of a layer that is stretched across and cannot contract along itself."""
    return E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def strip(n: int, material: Any, sets: Any = None, **choices: Any) -> Problem:
    """Half height 1, n cells to it, its sides moved apart by 1; cracked to x = .0123."""
    mesh = box((-9.0, -1.0), (9.0, 1.0), (18 * n, 2 * n + 1))  # what ends do falls by 4 in 1
    if sets is not None:
        facets = {name: f for name, f in mesh.facet_sets.items() if name != "boundary"}
        mesh = Mesh(mesh.points, mesh.cells, facets, sets(mesh.cell_middles))
    pulls = [displacement("top", (0.0, 0.5)), displacement("bottom", (0.0, -0.5))]
    crack = line_crack([(-11.0, 0.0), (0.0123, 0.0)])
    return Problem(mesh, material, [crack], pulls, **choices)


def layered_strip(n: int, ratio: float) -> tuple[SIF, float]:
    """K of a strip with a core of E = 1 and a skin of another material, and its exact K_I."""
    height = 1 / (n + 0.5)
    core = (round(0.3 * n) + 0.5) * height

    def sets(x: Floats) -> dict[str, Ints]:
        is_core = np.abs(x[:, 1]) < core
        return {"core": np.nonzero(is_core)[0], "skin": np.nonzero(~is_core)[0]}

    materials = {
        "core": Isotropic(1.0, 0.3, "strain"),
        "skin": Isotropic(ratio, 0.2, "strain"),
    }
    flexibility = 2 * (core / stretch(1.0, 0.3) + (1 - core) / stretch(ratio, 0.2))
    sif = stress_intensity(solve(strip(n, materials, sets)))
    return sif, np.sqrt(0.5 / flexibility / (1 - 0.3**2))


def graded_plate(n: int, ratio: float, a: float) -> Problem:
    """E from 1 to `ratio` over the width by an exponential; height 8, cells far away are long."""
    step = 1 / n
    heights = [step / 2 + step * k for k in range(n // 2 + 1)]
    while heights[-1] < 4.0:
        step *= 1.25
        heights.append(heights[-1] + step)
    y = np.array(heights) * (4.0 / heights[-1])
    grid = box((0.0, 0.0), (1.0, 1.0), (n, 2 * len(y) - 1))
    x = np.array(grid.points)
    rows = np.round(x[:, 1] * (2 * len(y) - 1)).astype(int)
    x[:, 1] = np.r_[-y[::-1], y][rows]
    facets = {name: f for name, f in grid.facet_sets.items() if name != "boundary"}
    material = Graded(lambda x: ratio ** x[:, 0], 0.3, "strain")
    return Problem(Mesh(x, grid.cells, facets), material, [line_crack([(0, 0), (a, 0)])],
                      loads=PULL)  # fmt: skip


def crack_in_planes(
    n: int, upper: tuple[float, float], lower: tuple[float, float], plane: str = "strain"
) -> Problem:
    """Half length 1, pressed open, in a square of n cells that moves as two half-planes do."""
    half = 2.3
    mesh = box((-half, -half), (half, half), (n, 2 * (n // 2)))
    mesh = mesh.with_cell_sets({"above": lambda x: x[:, 1] > 0, "below": lambda x: x[:, 1] < 0})
    materials = {"above": Isotropic(*upper, plane), "below": Isotropic(*lower, plane)}

    def imposed_displacement(x: Floats) -> Floats:
        return interface_crack.displacement(x, 1.0, 1.0, upper, lower, plane)  # type: ignore[arg-type]

    supports = [
        displacement(side, imposed_displacement) for side in ("left", "right", "top", "bottom")
    ]
    crack = line_crack([(-1.0, 0.0), (1.0, 0.0)])
    return Problem(mesh, materials, [crack], supports, [crack_pressure(1.0)], contact="off")


__all__ = [
    *("EDGE_CRACKS", "GRADED", "MIXED_MODES", "PULL", "THERMAL", "crack_in_planes", "edge_crack"),
    *("graded_plate", "heated", "layered_strip", "pair", "perturbed", "slanted_crack", "square"),
    *("stretch", "strip", "with_halves"),
]
