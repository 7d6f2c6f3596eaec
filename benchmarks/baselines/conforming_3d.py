"""The conforming baseline in 3D: a penny in a mesh of quadratic tetrahedra that follows its front.

As in 2D: gmsh grades towards the front, middle nodes next to it lie at the quarter points
and those on it on the circle. K_I comes from the energy that a radial extension of the penny
releases (domain integrals), over the whole front and over hats along it.
"""

from typing import Any

import numpy as np

from benchmarks.baselines.conforming_2d import Grading
from benchmarks.runs import Outcome
from benchmarks.scenes.exact_fields import penny as exact
from benchmarks.scenes.exact_fields import penny_K_I
from benchmarks.scenes.material import E_PRIME, LAMBDA, MU, stress_of
from benchmarks.scenes.penny import RADIUS
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.mesh.gmsh_session import session

_REACH = 0.35  # of the weight, from the front
_HATS = 24  # along the front: about as many as places where xcrack has K on its meshes


def penny(grading: Grading, seed: int) -> Outcome:
    """K_I of the open penny in [-1, 1]³ under tension, exact displacements on the sides.

    The errors are those of its mean and of the root of the mean square along the front.

    Parameters
    ----------
    grading : Grading
        By the distance to the front.
    seed : int
        Changes the coarse cells by some per cent.
    """
    import skfem
    from skfem.models.elasticity import linear_elasticity

    far = grading.far / (1 + 0.03 * seed)
    points, cells, front = cracked_cube(Grading(grading.near, grading.growth, far))
    mesh = curved(points, cells, front)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()), intorder=4)
    K = linear_elasticity(LAMBDA, MU).assemble(basis)
    x = basis.doflocs
    known = np.nonzero((np.abs(x) > 1 - 1e-9).any(axis=0))[0]
    u = basis.zeros()
    u[known] = exact(RADIUS, 1.0)(x[:, known].T)[np.arange(len(known)), known % 3]
    u = solved(K, u, known, x[:, ::3].T)
    mean, along = _K_at_front(basis, u)
    exact_K = penny_K_I(RADIUS, 1.0)
    rms = float(np.sqrt(np.mean((along / exact_K - 1) ** 2)))
    return Outcome({"K_I": abs(mean / exact_K - 1), "rms": rms}, int(basis.N))


def cracked_cube(grading: Grading) -> tuple[Floats, Ints, Bools]:
    """Points, tetrahedra and which points lie on the front; the faces of the penny are apart."""
    with session() as gmsh:
        box = gmsh.model.occ.addBox(-1, -1, -1, 2, 2, 2)
        disk = gmsh.model.occ.addDisk(0, 0, 0, RADIUS, RADIUS)
        _, pieces = gmsh.model.occ.fragment([(3, box)], [(2, disk)])
        gmsh.model.occ.synchronize()
        field = gmsh.model.mesh.field
        number = field.add("MathEval")
        distance = f"Sqrt((Sqrt(x^2+y^2)-{RADIUS!r})^2+z^2)"
        text = f"Min({grading.far!r}, Max({grading.near!r}, {grading.growth!r}*{distance}))"
        field.setString(number, "F", text)
        field.setAsBackgroundMesh(number)
        gmsh.model.mesh.generate(3)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        _, _, nodes = gmsh.model.mesh.getElements(3)
        faces = [gmsh.model.mesh.getNodes(2, tag, True, False)[0] for _, tag in pieces[1]]
    index = np.full(int(tags.max()) + 1, -1)
    index[tags] = np.arange(len(tags))
    points = flat.reshape(-1, 3)
    cells = index[nodes[0].astype(np.int64)].reshape(-1, 4)
    on_crack = index[np.unique(np.concatenate(faces)).astype(np.int64)]
    r = np.hypot(points[on_crack, 0], points[on_crack, 1])
    front = np.zeros(len(points), dtype=bool)
    front[on_crack[r > RADIUS * (1 - 1e-6)]] = True
    twice = on_crack[r <= RADIUS * (1 - 1e-6)]
    copy = np.full(len(points), -1)
    copy[twice] = len(points) + np.arange(len(twice))
    below = np.nonzero(points[cells].mean(axis=1)[:, 2] < 0)[0]
    cells[below] = np.where(copy[cells[below]] >= 0, copy[cells[below]], cells[below])
    return (
        np.concatenate([points, points[twice]]),
        cells,
        np.concatenate([front, np.zeros(len(twice), dtype=bool)]),
    )


def curved(points: Floats, cells: Ints, front: Bools) -> Any:
    """Quadratic tetrahedra: middle nodes at the quarter points beside the front, on it round."""
    import skfem

    mesh = skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    straight = skfem.MeshTet2.from_mesh(mesh)
    x = straight.doflocs.copy()
    edge = mesh.edges
    count = front[edge].sum(axis=0)
    middle = straight.dofs.edge_dofs[0]
    at = np.where(front[edge[0]], edge[0], edge[1])
    other = np.where(front[edge[0]], edge[1], edge[0])
    one = count == 1
    x[:, middle[one]] = 0.75 * mesh.p[:, at[one]] + 0.25 * mesh.p[:, other[one]]
    two = count == 2
    chord = mesh.p[:, edge[:, two]].mean(axis=1)
    # Only edges between neighbours on the front; a longer chord would be bent through cells.
    x[:2, middle[two]] = chord[:2] * RADIUS / np.hypot(chord[0], chord[1])
    return skfem.MeshTet2(x, straight.t, sort_t=False)


def solved(K: Any, u: Floats, known: Ints, points: Floats) -> Floats:
    """Displacements by conjugate gradients with smoothed aggregation that knows rigid motion."""
    from pyamg import smoothed_aggregation_solver

    free = np.setdiff1d(np.arange(len(u)), known)
    rows = K[free]
    A = rows[:, free].tobsr(blocksize=(3, 3))
    rigid = np.zeros((len(u), 6))
    for i in range(3):
        rigid[i::3, i] = 1
        j, k = (i + 1) % 3, (i + 2) % 3
        rigid[j::3, 3 + i], rigid[k::3, 3 + i] = -points[:, k], points[:, j]
    hierarchy = smoothed_aggregation_solver(A, B=rigid[free], strength=("symmetric", {"theta": 0}))
    u[free] = hierarchy.solve(-(rows @ u), tol=1e-8, accel="cg", maxiter=300)
    return u


def _K_at_front(basis: Any, u: Floats) -> tuple[float, Floats]:
    """K_I over the whole front and at each hat `(n,)`.

    G = int (sigma_ij u_i,k - W delta_jk) V_k,j / area with V = q w e_r, where the hats w of the
    angle add up to one, so that G over the whole front is the mean of the others.
    """
    x = np.asarray(basis.default_parameters()["x"]).reshape(3, -1)
    gradient = np.moveaxis(np.asarray(basis.interpolate(u).grad).reshape(3, 3, -1), -1, 0)
    volume = np.asarray(basis.dx).ravel()
    r = np.hypot(x[0], x[1])
    s = np.hypot(r - RADIUS, x[2])
    near = np.nonzero(s < _REACH)[0]
    x, gradient, volume, r, s = x[:, near], gradient[near], volume[near], r[near], s[near]
    strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2
    sigma = stress_of(gradient)
    energy = np.einsum("qij,qij->q", sigma, strain) / 2
    t = s / _REACH
    q = 1 - t**3 * (10 - 15 * t + 6 * t**2)
    slope = -30 * t**2 * (1 - t) ** 2 / _REACH / np.maximum(s, 1e-300)
    outward = np.stack([x[0] / r, x[1] / r, 0 * r], axis=1)
    around = np.stack([-outward[:, 1], outward[:, 0], 0 * r], axis=1)
    steps = np.stack([(r - RADIUS) * outward[:, 0], (r - RADIUS) * outward[:, 1], x[2]], axis=1)
    flux = np.einsum("qij,qik->qjk", sigma, gradient) - energy[:, None, None] * np.eye(3)
    # What grows with w, and what grows with its slope over the angle.
    even = np.einsum("qjk,qk,qj->q", flux, outward, steps) * slope * volume
    even += np.einsum("qjk,qk,qj->q", flux, around, around) * q / r * volume
    uneven = np.einsum("qjk,qk,qj->q", flux, outward, around) * q / r * volume
    width = 2 * np.pi / _HATS
    place = np.arctan2(x[1], x[0]) % (2 * np.pi) / width
    first = np.floor(place).astype(int) % _HATS
    part = place - np.floor(place)
    released = np.zeros(_HATS)
    np.add.at(released, first, even * (1 - part) - uneven / width)
    np.add.at(released, (first + 1) % _HATS, even * part + uneven / width)
    G = np.append(released / (RADIUS * width), released.sum() / (2 * np.pi * RADIUS))
    K = np.sqrt(np.maximum(G, 0.0) * E_PRIME)
    return float(K[-1]), K[:-1]
