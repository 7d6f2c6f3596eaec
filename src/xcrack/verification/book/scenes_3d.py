"""Scenes in 3D: graded boxes, flat cracks with their exact displacements imposed."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.crack.surfaces import elliptic_crack, penny_crack
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import displacement
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF
from xcrack.verification.exact import fields_3d

E, NU = 1.0, 0.3
CENTRE = np.array([0.013, -0.021, 0.0117])
Stress = tuple[float, float, float]  # szz, sxz, syz in the axes of the crack


def turn(axis: Sequence[float], angle: float) -> Floats:
    """Rotation about an axis (Rodrigues); its rows are the turned axes' components."""
    k = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def lines(
    low: float, high: float, fine_range: tuple[float, float], h: float, ratio: float = 1.5
) -> Any:
    """Coordinates from low to high: spacing h between both ends of `fine_range`, growing beyond."""
    start, stop = fine_range
    inner = np.linspace(start, stop, max(1, round((stop - start) / h)) + 1)

    def distances_away(length: float) -> Floats:
        if length <= 1e-9 * h:
            return np.zeros(0)
        steps = [h * ratio]
        while sum(steps) < length:
            steps.append(steps[-1] * ratio)
        return np.asarray(length * np.cumsum(steps) / sum(steps))

    return np.concatenate(
        [start - distances_away(start - low)[::-1], inner, stop + distances_away(high - stop)]
    )


def graded(lines_of_axis: Sequence[Floats], *, seed: int, amplitude: float = 0.15) -> Mesh:
    """Box along given lines, whose inner points move by a share of their cell."""
    n = [len(line) - 1 for line in lines_of_axis]
    mesh = box((0.0, 0.0, 0.0), tuple(map(float, n)), tuple(n))
    place = np.round(mesh.points).astype(int)
    x = np.stack([line[place[:, k]] for k, line in enumerate(lines_of_axis)], axis=1)
    rng = np.random.default_rng(seed)
    for k, line in enumerate(lines_of_axis):
        gap = np.minimum(np.diff(line, prepend=np.nan), np.diff(line, append=np.nan))
        shift = amplitude * gap[place[:, k]] * rng.uniform(-1, 1, len(x))
        x[:, k] += np.where(np.isnan(shift), 0.0, shift)
    return Mesh(x, mesh.cells, mesh.facet_sets)


def flat_crack(
    h: float,
    stress: Stress,
    *,
    a: float = 0.5,
    b: float | None = None,
    half: float = 1.1,
    margin: float = 0.2,
    depth: float = 0.3,
    seed: int = 7203,
    **options: Any,
) -> tuple[Problem, Floats]:
    """Penny, or ellipse where b is given, under its exact displacements on all sides of a box.

    Parameters
    ----------
    h : float
        Cell legs around the crack.
    stress : (szz, sxz, syz)
        Remote stress in the axes of the crack.
    margin, depth : float
        How far the fine cells reach beyond the front, and to both sides of the crack.

    Returns
    -------
    problem, axes : Problem, (3, 3) array
        Rows of axes: half-axis a, half-axis b, normal.
    """
    Q = turn((1.0, 2.0, 0.5), 0.07)
    reach = (a + margin, (a if b is None else b) + margin, depth)
    mesh = graded([lines(-half, half, (-w, w), h) for w in reach], seed=seed)
    szz, sxz, syz = stress
    S = np.array([[0.0, 0.0, sxz], [0.0, 0.0, syz], [sxz, syz, szz]])
    if b is None:
        crack = penny_crack(CENTRE, Q[2], a)
    else:
        crack = elliptic_crack(CENTRE, Q[2], Q[0], a, b)

    def u(x: Floats) -> Floats:
        local = (x - CENTRE) @ Q.T
        if b is None:
            return np.asarray(fields_3d.penny(local, a, E, NU, S) @ Q)
        return np.asarray(fields_3d.ellipse_displacement(local, a, b, E, NU, S) @ Q)

    support = displacement("boundary", u)
    return Problem(mesh, Isotropic(E, NU), [crack], supports=[support], **options), Q


def exact_K(sif: SIF, Q: Floats, stress: Stress, *, a: float = 0.5, b: float | None = None) -> Any:
    """Exact K `(f, 3)` of `flat_crack` at the places of a SIF, in its frames."""
    local = (sif.x - CENTRE) @ Q.T
    szz, sxz, syz = stress
    if b is None:
        angle = np.arctan2(local[:, 1], local[:, 0]) - np.arctan2(syz, sxz)
        K = fields_3d.penny_K(angle, a, NU, szz, float(np.hypot(sxz, syz)))
    else:
        angle = np.arctan2(local[:, 1] / b, local[:, 0] / a)
        K = fields_3d.ellipse_K(angle, a, b, NU, szz, sxz, syz)
    # The third row of the frames runs clockwise seen from the normal.
    return np.stack([K[0], K[1], -K[2]], axis=1)


__all__ = ["CENTRE", "NU", "E", "Stress", "exact_K", "flat_crack", "graded", "lines", "turn"]
