"""Arrows that show the loads of a solution in 3D."""

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats, Ints
from xcrack.mesh.mesh import Mesh
from xcrack.scene.conditions import PointForce, Pressure, Traction, evaluate, evaluate_scalar
from xcrack.scene.set_loads import Bearing, Resultant

_SMALL = 0.25  # share of the body up to which a loaded set has one arrow, its resultant
_LENGTH = 0.16  # share of the body of the longest arrow
_MANY = 13  # arrows on a large set


def load_arrows(solution: Solution) -> tuple[Floats, Floats]:
    """Arrows of tractions, pressures and point forces: where they begin, and their vectors.

    A small set has one arrow, the resultant; a large one has several, its tractions. The longest
    of each kind have the same length. Those that press on the body end on it.

    Returns
    -------
    start, vector : (k, 3) arrays, length
    """
    mesh = solution.space.mesh
    forces, tractions = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))]
    for load in solution.loads:
        if isinstance(load, PointForce):
            forces.append(np.stack([load.x, load.force, np.zeros(3)])[None])
        elif isinstance(load, Bearing | Resultant):
            facets = mesh.facet_sets[load.where]
            area = np.linalg.norm(_outward(mesh, facets), axis=1)
            middle = area @ mesh.points[facets].mean(axis=1) / area.sum()
            force = np.zeros(3) if load.force is None else load.force
            forces.append(np.stack([middle, force, np.zeros(3)])[None])
        elif isinstance(load, Traction | Pressure):
            facets = mesh.facet_sets[load.where]
            x = mesh.points[facets].mean(axis=1)
            turned = _outward(mesh, facets)
            area = np.linalg.norm(turned, axis=1)
            out = turned / area[:, None]
            if isinstance(load, Traction):
                t = evaluate(load.value, x, "traction", out)
            else:
                t = -evaluate_scalar(load.value, x, "pressure")[:, None] * out
            if np.ptp(x, axis=0).max() < _SMALL * mesh.extent:
                force = area @ t
                middle = area @ x / area.sum()
                forces.append(np.stack([middle, force, area @ out])[None])
            else:
                chosen = _spread(x, _MANY)
                tractions.append(np.stack([x, t, out], axis=1)[chosen])
    start, vector = [], []
    for group in (np.concatenate(forces), np.concatenate(tractions)):
        size = np.linalg.norm(group[:, 1], axis=1)
        shown = size > 1e-3 * size.max(initial=0.0)
        x, v, out = np.swapaxes(group[shown], 0, 1)
        v = np.sign(solution.factor) * v * (_LENGTH * mesh.extent / size.max(initial=1e-300))
        pressing = np.einsum("kd,kd->k", v, out) < -1e-6 * np.linalg.norm(v, axis=1)
        start.append(np.where(pressing[:, None], x - v, x))
        vector.append(v)
    return np.concatenate(start), np.concatenate(vector)


def _outward(mesh: Mesh, facets: Ints) -> Floats:
    """Area vectors of boundary facets, out of the body `(k, 3)`."""
    x = mesh.points[facets]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
    key = {tuple(f): i for i, f in enumerate(np.sort(mesh.facets, axis=1).tolist())}
    number = np.array([key[tuple(f)] for f in np.sort(facets, axis=1).tolist()], dtype=np.int64)
    inner = mesh.points[mesh.cells[mesh.facet_to_cell[number, 0]]].mean(axis=1)
    sign = np.sign(np.einsum("kd,kd->k", normal, x.mean(axis=1) - inner))
    return np.asarray(sign[:, None] * normal)


def _spread(x: Floats, n: int) -> Ints:
    """Up to n points far from each other, by their numbers."""
    chosen = [int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(x - x[chosen[0]], axis=1)
    while len(chosen) < min(n, len(x)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(x - x[chosen[-1]], axis=1))
    return np.array(chosen)


__all__ = ["load_arrows"]
