"""The conforming baseline of two pennies that cross at right angles: an eighth, by symmetry.

    python -m benchmarks.baselines.conforming_crossing     # writes tests/data/crossing_pennies.json

In the cube [-1, 1]³ under the same tension in x and z a penny of R = .6 lies in z = 0 and one of
R = .3 in x = 0, both about the origin. Both are planes of symmetry, in which the crack faces are
free and the rest does not move across, so that a mesh of quadratic tetrahedra with quarter points
needs no faces that part, and all fronts are in mode I. K_I is the root of a mean of the energy
that a bump of the front releases (a domain integral); a bump at the junction runs along the face
of the other penny, so that nothing is extrapolated.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.baselines.conforming_2d import Grading
from benchmarks.scenes.material import E_PRIME, LAMBDA, MU, stress_of
from xcrack.base.arrays import Floats, Ints
from xcrack.mesh.gmsh_session import session

PATH = Path(__file__).resolve().parents[2] / "tests" / "data" / "crossing_pennies.json"
LARGE, SMALL = 0.6, 0.3
ANGLES = {"large": (0, 15, 30, 45, 60, 75, 90), "small": (0, 3.6, 7.5, 15, 30, 45, 60, 75, 90)}
WIDTH = 5.0  # degrees from the top of a bump to its ends
_REACH = 0.12  # of the weight, from the front


@dataclass(frozen=True)
class Circle:
    """A front about the origin: its radius, and the axes of its plane and across it."""

    radius: float
    axes: tuple[int, int, int]

    def polar(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance to the centre `(q,)`, angle from the first axis, height."""
        one, two, across = (x[axis] for axis in self.axes)
        return np.hypot(one, two), np.arctan2(two, one), across

    def distance(self, x: Floats) -> Floats:
        """Of points `(3, q)`."""
        r, _, height = self.polar(x)
        return np.asarray(np.hypot(r - self.radius, height))


FRONTS = {"large": Circle(LARGE, (0, 1, 2)), "small": Circle(SMALL, (1, 2, 0))}


def eighth(grading: Grading, has_small: bool) -> tuple[Floats, Ints]:
    """Points and tetrahedra of [0, 1]³ with both quarter discs in its sides."""
    with session() as gmsh:
        occ = gmsh.model.occ
        box = occ.addBox(0, 0, 0, 1, 1, 1)
        discs = [(2, occ.addDisk(0, 0, 0, LARGE, LARGE))]
        if has_small:
            disc = occ.addDisk(0, 0, 0, SMALL, SMALL, zAxis=[1, 0, 0], xAxis=[0, 1, 0])
            discs.append((2, disc))
        corner = occ.addBox(0, 0, 0, 2, 2, 2)
        occ.synchronize()
        quarters, _ = occ.intersect(discs, [(3, corner)])
        occ.fragment([(3, box)], quarters)
        occ.synchronize()
        fronts = [FRONTS["large"], *([FRONTS["small"]] if has_small else [])]

        def size(_d: int, _t: int, x: float, y: float, z: float, _size: float) -> float:
            place = np.array([[x], [y], [z]])
            sizes = [
                max(
                    grading.growth * float(front.distance(place)[0]),
                    grading.near * front.radius / LARGE,
                )
                for front in fronts
            ]
            return min(grading.far, *sizes)

        gmsh.model.mesh.setSizeCallback(size)
        for name in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
            gmsh.option.setNumber(f"Mesh.{name}", 0)
        gmsh.model.mesh.generate(3)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        _, _, nodes = gmsh.model.mesh.getElements(3)
    index = np.full(int(tags.max()) + 1, -1)
    index[tags] = np.arange(len(tags))
    cells = index[nodes[0].astype(np.int64)].reshape(-1, 4)
    used, cells = np.unique(cells, return_inverse=True)
    return flat.reshape(-1, 3)[used], cells.reshape(-1, 4)


def curved(points: Floats, cells: Ints, fronts: list[Circle]) -> Any:
    """Quadratic tetrahedra: middle nodes at the quarter points beside fronts, on them round."""
    import skfem

    mesh = skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    straight = skfem.MeshTet2.from_mesh(mesh)
    x = straight.doflocs.copy()
    edge, middle = mesh.edges, straight.dofs.edge_dofs[0]
    for front in fronts:
        on = front.distance(mesh.p) < 1e-9
        count = on[edge].sum(axis=0)
        at, other = np.where(on[edge[0]], edge, edge[::-1])
        one, two = count == 1, count == 2
        x[:, middle[one]] = 0.75 * mesh.p[:, at[one]] + 0.25 * mesh.p[:, other[one]]
        chord = mesh.p[:, edge[:, two]].mean(axis=1)
        chord[list(front.axes[:2])] *= front.radius / front.polar(chord)[0]
        x[:, middle[two]] = chord
    return skfem.MeshTet2(x, straight.t, sort_t=False)


def solution(grading: Grading, has_small: bool = True) -> tuple[Any, Floats, float]:
    """Basis, displacements and the energy of the whole body under unit tractions in x and z."""
    import skfem
    from skfem.models.elasticity import linear_elasticity

    fronts = [FRONTS["large"], *([FRONTS["small"]] if has_small else [])]
    mesh = curved(*eighth(grading, has_small), fronts)
    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, element, intorder=6)
    K = linear_elasticity(LAMBDA, MU).assemble(basis)
    load = basis.zeros()
    for axis in (0, 2):

        @skfem.LinearForm
        def pull(v: Any, _w: Any, axis: int = axis) -> Any:
            return v[axis]

        outer = mesh.facets_satisfying(lambda x, axis=axis: np.abs(x[axis] - 1) < 1e-9)
        load += pull.assemble(skfem.FacetBasis(mesh, element, facets=outer))
    x = basis.doflocs[:, ::3]
    free_large = (x[2] < 1e-9) & (np.hypot(x[0], x[1]) < LARGE * (1 - 1e-9))
    free_small = (x[0] < 1e-9) & (np.hypot(x[1], x[2]) < SMALL * (1 - 1e-9)) & has_small
    at_rest = [(x[0] < 1e-9) & ~free_small, x[1] < 1e-9, (x[2] < 1e-9) & ~free_large]
    known = np.concatenate([3 * np.nonzero(part)[0] + axis for axis, part in enumerate(at_rest)])
    u = solved(K, load, known, x.T)
    return basis, u, 8 * 0.5 * float(load @ u)


def solved(K: Any, load: Floats, known: Ints, points: Floats) -> Floats:
    """Displacements, some of them zero, by conjugate gradients with smoothed aggregation."""
    import scipy.sparse as sp
    from pyamg import smoothed_aggregation_solver

    free = np.ones(len(load))
    free[known] = 0.0
    # Rows of what is held stay, so that all blocks have three.
    part = sp.diags(free)
    A = (part @ K @ part + sp.diags((1 - free) * K.diagonal())).tobsr(blocksize=(3, 3))
    rigid = np.zeros((len(load), 6))
    for i in range(3):
        rigid[i::3, i] = 1
        j, k = (i + 1) % 3, (i + 2) % 3
        rigid[j::3, 3 + i], rigid[k::3, 3 + i] = -points[:, k], points[:, j]
    rigid *= free[:, None]
    hierarchy = smoothed_aggregation_solver(A, B=rigid, strength=("symmetric", {"theta": 0}))
    return np.asarray(hierarchy.solve(free * load, tol=1e-8, accel="cg", maxiter=300))


def local_K(basis: Any, u: Floats, front: Circle, angles: Floats) -> Floats:
    """K_I of unit tractions at angles from the first axis of a front, in degrees."""
    x = np.asarray(basis.default_parameters()["x"]).reshape(3, -1)
    near = np.nonzero(front.distance(x) < _REACH)[0]
    gradient = np.moveaxis(np.asarray(basis.interpolate(u).grad).reshape(3, 3, -1), -1, 0)[near]
    weight, x = np.asarray(basis.dx).ravel()[near], x[:, near]
    r, angle, height = front.polar(x)
    s = front.distance(x)
    strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2
    sigma = stress_of(gradient)
    energy = np.einsum("qij,qij->q", sigma, strain) / 2
    flux = np.einsum("qij,qik->qjk", sigma, gradient) - energy[:, None, None] * np.eye(3)
    t = s / _REACH
    q = 1 - t**3 * (10 - 15 * t + 6 * t**2)
    slope = -30 * t**2 * (1 - t) ** 2 / _REACH / np.maximum(s, 1e-300)
    one, two, across = front.axes
    outward, around, steps = np.zeros((3, len(r), 3))
    outward[:, one], outward[:, two] = np.cos(angle), np.sin(angle)
    around[:, one], around[:, two] = -np.sin(angle), np.cos(angle)
    steps = (r - front.radius)[:, None] * outward
    steps[:, across] = height
    result = []
    for top in np.radians(angles):
        away = (angle - top) / np.radians(WIDTH)
        bump = np.where(np.abs(away) < 1, np.cos(np.pi / 2 * away) ** 2, 0.0)
        rise = np.where(np.abs(away) < 1, -np.pi / 2 * np.sin(np.pi * away), 0.0)
        rise = rise / np.radians(WIDTH)
        V = np.einsum("qk,qj->qkj", outward, (bump * slope)[:, None] * steps)
        V += (q * bump / r)[:, None, None] * around[:, :, None] * around[:, None, :]
        V += (q * rise / r)[:, None, None] * outward[:, :, None] * around[:, None, :]
        released = 2 * float(np.einsum("qjk,qkj,q->", flux, V, weight))
        fine = np.clip(top + np.radians(WIDTH) * np.linspace(-1, 1, 2001), 0, np.pi / 2)
        over = np.cos(np.pi / 2 * (fine - top) / np.radians(WIDTH)) ** 2
        length = front.radius * float(np.trapezoid(over, fine))
        result.append(np.sqrt(max(released, 0.0) / length * E_PRIME))
    return np.array(result)


def numbers(grading: Grading) -> dict[str, Any]:
    """Energy that each penny adds, by E over the square of the traction, and K_I over K of it."""
    basis, u, energy = solution(grading)
    alone = solution(grading, False)[2]
    return {
        "unknowns": int(basis.N),
        "energy added by the small one": energy - alone,
    } | {
        name: {
            str(angle): float(K / (2 * np.sqrt(front.radius / np.pi)))
            for angle, K in zip(
                ANGLES[name], local_K(basis, u, front, np.array(ANGLES[name])), strict=True
            )
        }
        for name, front in FRONTS.items()
    }


def main() -> None:
    """Two meshes, so that a reader sees how far the numbers are settled."""
    meshes = [Grading(0.03, 0.35, 0.3), Grading(0.018, 0.28, 0.3)]
    rows = [numbers(grading) for grading in meshes]
    PATH.write_text(json.dumps(dict(zip(("coarse", "fine"), rows, strict=True)), indent=1) + "\n")
    print(PATH.read_text())


if __name__ == "__main__":
    main()
