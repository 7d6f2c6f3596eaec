"""Scenes in 2D whose exact solution is imposed on the sides of a box."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.lines import line_crack
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import displacement, traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem

SIDES = ("left", "right", "bottom", "top")
E, NU = 1.0, 0.3

Pair = tuple[float, float]
Plane = Callable[[Floats, Floats], tuple[Floats, Floats]]  # x, y -> u, (sxx, syy, sxy)
Field = Callable[[Floats], tuple[Floats, Floats]]  # points -> u, stress tensors


def perturbed(
    n: int,
    seed: int = 3,
    amplitude: float = 0.15,
    lower: Sequence[float] = (-1.0, -1.0),
    upper: Sequence[float] = (1.0, 1.0),
) -> Mesh:
    """A box of n cells a side, whose inner points are moved by a share of a cell."""
    mesh = box(lower, upper, n)
    rng = np.random.default_rng(seed)
    x = np.array(mesh.points)
    low, high = np.array(lower), np.array(upper)
    h = (high - low) / n
    inner = ((x > low + 1e-9) & (x < high - 1e-9)).all(axis=1)
    x[inner] += amplitude * h * rng.uniform(-1, 1, (int(inner.sum()), x.shape[1]))
    return Mesh(x, mesh.cells, mesh.facet_sets)


def rows(angle: float) -> Floats:
    """Frame (ahead, left) of a direction."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def turned(function: Plane, origin: ArrayLike, angle: float = 0.0) -> Field:
    """Displacement and stress `(n, d, d)` of an exact field placed at an origin and turned."""
    Q, centre = rows(angle), np.asarray(origin, dtype=float)

    def field(x: Floats) -> tuple[Floats, Floats]:
        y = (x - centre) @ Q.T
        u, s = function(y[:, 0], y[:, 1])
        sigma = np.empty((len(x), 2, 2))
        sigma[:, 0, 0], sigma[:, 1, 1] = s[:, 0], s[:, 1]
        sigma[:, 0, 1] = sigma[:, 1, 0] = s[:, 2]
        return u @ Q, np.einsum("ai,qab,bj->qij", Q, sigma, Q)

    return field


def tractions(field: Field, names: Sequence[str]) -> list[traction]:
    """Exact tractions on the given sets."""
    return [
        traction(name, lambda x, normal: np.einsum("qij,qj->qi", field(x)[1], normal))
        for name in names
    ]


def imposed(field: Field, names: Sequence[str]) -> list[displacement]:
    """Exact displacements on the given sets."""
    return [displacement(name, lambda x: field(x)[0]) for name in names]


def on_box(
    mesh: Mesh,
    cracks: Sequence[Crack],
    field: Field,
    *,
    traction: Sequence[str] = (),
    order: int = 2,
    plane: str = "strain",
    E: float = E,
    nu: float = NU,
    **options: Any,
) -> Problem:
    """Problem whose exact solution is the field: tractions on some sides, else displacements."""
    sides = [s for s in SIDES if s not in traction]
    return Problem(
        mesh,
        Isotropic(E, nu, plane),
        cracks,
        supports=imposed(field, sides),
        loads=tractions(field, traction),
        order=order,
        **options,
    )


def edge_line(tip: Sequence[float], angle: float, length: float = 1.3) -> Crack:
    """Straight crack that ends at the tip, running in the direction of the angle."""
    end = np.asarray(tip, dtype=float)
    return line_crack([end - length * rows(angle)[0], end])


def centre_crack(
    function: Plane,
    n: int,
    *,
    half: float = 2.0,
    angle: float = 0.0,
    origin: Pair = (0.0, 0.0),
    seed: int = 3,
    **options: Any,
) -> tuple[Problem, Field]:
    """Crack [-1, 1], turned, in a square of that half side with the exact field imposed."""
    field = turned(function, origin, angle)
    mesh = perturbed(n, seed, 0.15, (-half, -half), (half, half))
    crack = line_crack(np.array([[-1.0, 0.0], [1.0, 0.0]]) @ rows(angle) + np.asarray(origin))
    return on_box(mesh, [crack], field, **options), field


def annulus(
    inner: float, outer: float, n: int, n_around: int, *, seed: int = 7, amplitude: float = 0.15
) -> Mesh:
    """Ring of n by `n_around` quadrilaterals, halved; cells grow with the radius, all are moved.

    Its cut through x > 0 lies nowhere on a line of the mesh.
    """
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n_around), indexing="ij")
    radial_shift = amplitude * rng.uniform(-1, 1, i.shape)
    radial_shift[[0, -1]] = 0
    theta = 2 * np.pi * (j + 0.37 + amplitude * rng.uniform(-1, 1, i.shape)) / n_around
    r = inner * (outer / inner) ** ((i + radial_shift) / n)
    points = np.stack([r * np.cos(theta), r * np.sin(theta)], axis=-1).reshape(-1, 2)

    def number(i: Any, j: Any) -> Any:
        return i * n_around + j % n_around

    p, q = i[:-1].ravel(), j[:-1].ravel()
    a, b, c, d = number(p, q), number(p + 1, q), number(p + 1, q + 1), number(p, q + 1)
    cells = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    k = np.arange(n_around)
    sets = {
        "inner": np.stack([number(0, k), number(0, k + 1)], 1),
        "outer": np.stack([number(n, k), number(n, k + 1)], 1),
    }
    return Mesh(points, cells, sets)


def l2(values: Floats, reference: Floats, measure: Floats) -> float:
    """Relative L2 error along crack faces."""
    square_error = np.sum(measure * (values - reference) ** 2)
    return float(np.sqrt(square_error / np.sum(measure * reference**2)))


def inner_part(s: Floats, share: float = 0.8) -> Any:
    """Which points of crack faces lie on their inner part."""
    low, high = s.min(), s.max()
    edge = (1 - share) / 2 * (high - low)
    return (s > low + edge) & (s < high - edge)


def along(solution: Solution, angle: float = 0.0, origin: Pair = (0.0, 0.0)) -> Floats:
    """Position of the contact points of the first crack along its line."""
    contact = solution.contact[0]
    assert contact is not None
    return np.asarray((contact.points - np.asarray(origin)) @ rows(angle)[0])


__all__ = [
    *("NU", "SIDES", "E", "Field", "Pair", "along", "annulus", "centre_crack", "edge_line"),
    *(
        "imposed",
        "inner_part",
        "l2",
        "on_box",
        "perturbed",
        "rows",
        "tractions",
        "turned",
    ),
]
