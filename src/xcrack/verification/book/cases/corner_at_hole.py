"""One corner crack at a hole in a wide plate under tension, by the fit of Newman and Raju."""

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.surfaces import elliptic_crack
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact import plates

_R, _T, _A = 2.0, 2.0, 1.0
_OUTER = 16.0
_ANGLES = (10, 20, 30, 45, 60, 70, 80)
_WITHIN = 0.08
_SOURCE = "fit to finite elements, good to 5 % (Newman and Raju, 1981), one crack (Shah, 1976)"


def _plate(h: float) -> Mesh:
    """Round plate around the hole, its cells of size h where the crack is."""
    fine_radii = _R + h * np.arange(round(1.6 / h) + 1)
    step = h * 1.35 ** np.arange(1, 40)
    far_radii = fine_radii[-1] + np.cumsum(step)
    far_radii = far_radii[: int(np.argmax(far_radii >= _OUTER)) + 1]
    radii = np.concatenate(
        [
            fine_radii,
            np.interp(far_radii, [fine_radii[-1], far_radii[-1]], [fine_radii[-1], _OUTER]),
        ]
    )
    angle = [0.0]
    width = h / _R
    while angle[-1] < np.pi:
        angle.append(angle[-1] + width)
        width = width if angle[-1] < 0.35 else min(1.3 * width, 0.35)
    half = np.array(angle) * np.pi / angle[-1]
    # The crack lies at 0: no points there.
    theta = np.sort(np.concatenate([half, -half[1:-1]])) + 0.3 * h / _R
    n = len(theta)
    unit = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    plane_points = (radii[:, None, None] * unit).reshape(-1, 2)
    i, k = np.arange(n), np.arange(len(radii) - 1)[:, None] * n
    a, b, c, d = (x.ravel() for x in (k + i, k + (i + 1) % n, k + n + i, k + n + (i + 1) % n))
    triangles = np.sort(np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)]), axis=1)
    layers, m = round(_T / h), len(plane_points)
    z = np.repeat(np.linspace(0.0, _T, layers + 1), m)
    points = np.column_stack([np.tile(plane_points, (layers + 1, 1)), z])
    # Prisms divided from their smallest number: neighbours agree.
    p, q, r = np.concatenate([triangles + layer * m for layer in range(layers)]).T
    split = [[p, q, r, r + m], [p, q, q + m, r + m], [p, p + m, q + m, r + m]]
    cells = np.concatenate([np.stack(each, axis=1) for each in split])
    body = Mesh(points, cells)
    radius = np.linalg.norm(points[body.boundary][..., :2], axis=2)
    rim = body.boundary[(radius > (1 - 1e-9) * _OUTER).all(axis=1)]
    return Mesh(points, body.cells, {"rim": rim})


def _pull(x: Floats, normal: Floats) -> Floats:
    """Tractions of the infinite plate with its hole under unit tension along y (Kirsch)."""
    stress = plates.kirsch(x[:, 0], x[:, 1], _R, 1.0, 0.3, 1.0, np.pi / 2, plane="stress")[1]
    xx, yy, xy = stress.T
    result = np.zeros((len(x), 3))
    result[:, 0] = xx * normal[:, 0] + xy * normal[:, 1]
    result[:, 1] = xy * normal[:, 0] + yy * normal[:, 1]
    return result


def _run(level: int) -> list[Value]:
    problem = Problem(
        _plate(0.3 / 1.6**level),
        Isotropic(E=1e3, nu=0.3),
        [elliptic_crack((_R, 0.0, _T), (0, 1, 0), (1, 0, 0), _A, _A)],
        loads=[traction("rim", _pull)],
        contact="off",
    )
    sif = stress_intensity(solve(problem))
    phi = np.arctan2(_T - sif.x[:, 2], sif.x[:, 0] - _R)
    order = np.argsort(phi)
    values = []
    for angle in _ANGLES:
        K = float(np.interp(np.radians(angle), phi[order], sif.K_I[order]))
        fit = float(plates.newman_raju_at_hole(np.radians(angle), _A, _A, _T, _R))
        values.append(Value(f"K_I at {angle} degrees", K, fit, _WITHIN))
    return values


CASES = (
    Case("corner-crack-at-hole", "K_hole", _SOURCE, "published", 3, 2, False, _run, 2, quick=False),
)


__all__ = ["CASES"]
