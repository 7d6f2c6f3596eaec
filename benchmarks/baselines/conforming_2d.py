"""The conforming baseline in 2D: a mesh that follows the crack, made anew for each crack.

Quadratic triangles by scikit-fem, graded by gmsh towards the tip, whose cells have their middle
nodes at the quarter points (Henshell and Shaw; Barsoum; 1975-76); K by the interaction integral
over a ring with a smooth weight. Everything a step needs counts: mesh, assembly, solve and K.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.scenes.exact_fields import Field, edge_fields
from benchmarks.scenes.material import E_PRIME, KOLOSOV, LAMBDA, MU, energy, stress_of
from xcrack.base.arrays import Floats, Ints
from xcrack.fem.williams import unit_gradients
from xcrack.mesh.gmsh_session import session

_RING = (0.2, 0.9)  # of the radius given: where the weight falls from 1 to 0


@dataclass(frozen=True)
class Grading:
    """Cell size at a distance r of the tip: min(far, max(near, growth r))."""

    near: float
    growth: float
    far: float


def missing() -> str:
    """Why the baseline cannot run; empty where it can."""
    try:
        import skfem  # noqa: F401
    except ImportError:
        return "scikit-fem is missing: no conforming baseline (pip install scikit-fem)."
    return ""


def cracked_square(crack: Floats, grading: Grading) -> tuple[Floats, Ints, int]:
    """Triangles of a plate with the faces of a crack from its left side apart, and the tip's node.

    The plate is [x, 1] x [-1, 1], x that of the mouth.

    Parameters
    ----------
    crack : (k, 2)
        From the mouth, on the left side, to the tip.
    grading : Grading

    Returns
    -------
    points : (n, 2)
    cells : (m, 3)
    tip : int
    """
    left = float(crack[0, 0])
    corners = [(left, -1), (1, -1), (1, 1), (left, 1)]
    x, y = (float(v) for v in crack[-1])
    with session() as gmsh:
        geo = gmsh.model.geo
        corner = [geo.addPoint(*c, 0) for c in corners]
        path = [geo.addPoint(float(p[0]), float(p[1]), 0) for p in crack]
        ring = [*corner, path[0]]
        sides = [geo.addLine(a, b) for a, b in zip(ring, [*ring[1:], ring[0]])]
        faces = [geo.addLine(a, b) for a, b in zip(path, path[1:])]
        surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
        geo.synchronize()
        gmsh.model.mesh.embed(1, faces, 2, surface)
        field = gmsh.model.mesh.field
        number = field.add("MathEval")
        distance = f"Sqrt((x-({x!r}))^2+(y-({y!r}))^2)"
        text = f"Min({grading.far!r}, Max({grading.near!r}, {grading.growth!r}*{distance}))"
        field.setString(number, "F", text)
        field.setAsBackgroundMesh(number)
        gmsh.model.mesh.generate(2)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        _, _, nodes = gmsh.model.mesh.getElements(2, surface)
        on_crack = [gmsh.model.mesh.getNodes(1, line, True, False)[0] for line in faces]
    index = np.full(int(tags.max()) + 1, -1)
    index[tags] = np.arange(len(tags))
    points = flat.reshape(-1, 3)[:, :2]
    cells = index[nodes[0].astype(np.int64)].reshape(-1, 3)
    tip = int(np.argmin(np.hypot(*(points - crack[-1]).T)))
    twice = np.setdiff1d(index[np.unique(np.concatenate(on_crack)).astype(np.int64)], [tip])
    return *_split(points, cells, twice, crack), tip


def _split(points: Floats, cells: Ints, twice: Ints, crack: Floats) -> tuple[Floats, Ints]:
    """Double nodes: cells to the right of the crack get the copies."""
    copy = np.full(len(points), -1)
    copy[twice] = len(points) + np.arange(len(twice))
    near = np.nonzero((copy[cells] >= 0).any(axis=1))[0]
    centre = points[cells[near]].mean(axis=1)
    right = near[_side(centre, crack) < 0]
    cells = cells.copy()
    cells[right] = np.where(copy[cells[right]] >= 0, copy[cells[right]], cells[right])
    points = np.concatenate([points, points[twice]])
    used = np.unique(cells)
    if len(used) != len(points):
        raise AssertionError("a node of the crack has cells on one side only")
    return points, cells


def _side(x: Floats, crack: Floats) -> Floats:
    """Sign of the distance to a polyline; at its corners that of the mean normal."""
    a, t = crack[:-1], np.diff(crack, axis=0)
    share = np.einsum("qsi,si->qs", x[:, None] - a, t) / (t**2).sum(axis=1)
    share[:, :-1] = np.minimum(share[:, :-1], 1)  # the ends are continued straight
    share[:, 1:] = np.maximum(share[:, 1:], 0)
    offset = x[:, None] - a - share[..., None] * t
    best = np.argmin((offset**2).sum(axis=-1), axis=1)
    q = np.arange(len(x))
    normal = np.stack([-t[:, 1], t[:, 0]], axis=1) / np.hypot(*t.T)[:, None]
    n = normal[best]
    ahead, behind = share[q, best] >= 1, share[q, best] <= 0
    n = n + np.where(ahead[:, None], normal[np.minimum(best + 1, len(t) - 1)], 0)
    n = n + np.where(behind[:, None], normal[np.maximum(best - 1, 0)], 0)
    return np.asarray(np.einsum("qi,qi->q", offset[q, best], n))


def body(points: Floats, cells: Ints, tip: int) -> Any:
    """Basis of quadratic triangles, middle nodes next to the tip at the quarter points."""
    import skfem

    mesh = skfem.MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    curved = skfem.MeshTri2.from_mesh(mesh)
    x = curved.doflocs.copy()
    touching = np.nonzero((mesh.facets == tip).any(axis=0))[0]
    other = mesh.facets[:, touching].sum(axis=0) - tip
    middle = curved.dofs.facet_dofs[0, touching]
    x[:, middle] = 0.75 * mesh.p[:, [tip]] + 0.25 * mesh.p[:, other]
    curved = skfem.MeshTri2(x, curved.t, sort_t=False)
    return skfem.Basis(curved, skfem.ElementVector(skfem.ElementTriP2()), intorder=4)


def stiffness(basis: Any) -> Any:
    """Plane strain stiffness."""
    from skfem.models.elasticity import linear_elasticity

    return linear_elasticity(LAMBDA, MU).assemble(basis)


def solved(K: Any, f: Floats, u: Floats, known: Ints) -> Floats:
    """Displacements with some of them known, by the ordering that is fastest for such matrices."""
    from scipy.sparse.linalg import splu

    free = np.setdiff1d(np.arange(len(u)), known)
    rows = K[free]
    factor = splu(
        rows[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, panel_size=2,
        relax=1, options={"SymmetricMode": True},
    )  # fmt: skip
    u[free] = factor.solve(f[free] - rows @ np.where(np.isin(np.arange(len(u)), known), u, 0.0))
    return u


def traction_vector(basis: Any, side: Any, stress: Field) -> Floats:
    """Loads of a stress field on the facets whose middle `side` picks."""
    import skfem

    facets = basis.mesh.facets_satisfying(side, boundaries_only=True)
    on = skfem.FacetBasis(basis.mesh, basis.elem, facets=facets, intorder=5)

    @skfem.LinearForm
    def load(v: Any, w: Any) -> Any:
        x = np.asarray(w.x)
        sigma = stress(x.reshape(2, -1).T).reshape(*x.shape[1:], 2, 2)
        return np.einsum("...ij,j...,i...->...", sigma, np.asarray(w.n), np.asarray(v))

    return np.asarray(load.assemble(on))


def interaction(basis: Any, u: Floats, tip: Floats, ahead: Floats, radius: float) -> Floats:
    """K_I and K_II by the interaction integral over a ring around the tip."""
    import skfem

    inner, outer = _RING[0] * radius, _RING[1] * radius
    corner = basis.mesh.doflocs[:, basis.mesh.t]
    r = np.hypot(corner[0] - tip[0], corner[1] - tip[1])
    ring = np.nonzero((r.max(axis=0) > inner) & (r.min(axis=0) < outer))[0]
    local = skfem.Basis(basis.mesh, basis.elem, elements=ring, intorder=6)
    frame = np.array([ahead, [-ahead[1], ahead[0]]])
    x = local.default_parameters()["x"]
    y = np.einsum("ai,iq->qa", frame, np.asarray(x).reshape(2, -1) - np.asarray(tip)[:, None])
    gradient = np.asarray(local.interpolate(u).grad).reshape(2, 2, -1)
    gradient = np.einsum("ai,ijq,bj->qab", frame, gradient, frame)
    r, theta = np.hypot(y[:, 0], y[:, 1]), np.arctan2(y[:, 1], y[:, 0])
    auxiliary = unit_gradients(r, theta, KOLOSOV, MU)[:2]
    t = np.clip((r - inner) / (outer - inner), 0, 1)
    slope = -30 * t**2 * (1 - t) ** 2 / (outer - inner)  # of the quintic that falls from 1 to 0
    q = (slope / r)[:, None] * y
    sigma, other = stress_of(gradient), stress_of(auxiliary)
    energy = np.einsum("qij,mqij->mq", sigma, auxiliary)
    flux = np.einsum("qij,mqi->mqj", sigma, auxiliary[..., 0])
    flux += np.einsum("mqij,qi->mqj", other, gradient[..., 0])
    flux[..., 0] -= energy
    return 0.5 * E_PRIME * np.einsum("mqj,qj,q->m", flux, q, np.asarray(local.dx).ravel())


def energy_error(basis: Any, u: Floats, stress: Field) -> float:
    """Relative error in the energy norm against an exact stress field."""
    import skfem

    # Not at the tip: points lie inside, and quarter points take the singular field out there.
    fine = skfem.Basis(basis.mesh, basis.elem, intorder=8)
    x = np.asarray(fine.default_parameters()["x"]).reshape(2, -1).T
    gradient = np.moveaxis(np.asarray(fine.interpolate(u).grad).reshape(2, 2, -1), -1, 0)
    exact, weight = stress(x), np.asarray(fine.dx).ravel()
    wrong, total = (energy(s) @ weight for s in (exact - stress_of(gradient), exact))
    return float(np.sqrt(wrong / total))


def edge(grading: Grading, K: tuple[float, float]) -> tuple[Floats, int]:
    """K and unknowns of the edge crack under its exact field: traction left, else displacement."""
    basis, u = edge_solution(grading, K)
    return edge_K(basis, u), int(basis.N)


def edge_K(basis: Any, u: Floats) -> Floats:
    """K at the tip of the edge crack, in the origin."""
    return interaction(basis, u, np.zeros(2), np.array([1.0, 0.0]), 1.0)


def edge_solution(grading: Grading, K: tuple[float, float]) -> tuple[Any, Floats]:
    """Basis and displacements of the edge crack under its exact field."""
    displacement, stress = edge_fields(K)
    points, cells, tip = cracked_square(np.array([[-1.0, 0.0], [0.0, 0.0]]), grading)
    basis = body(points, cells, tip)
    A = stiffness(basis)
    f = traction_vector(basis, lambda x: x[0] < -1 + 1e-9, stress)
    x = basis.doflocs
    known = np.nonzero((x[0] > 1 - 1e-9) | (np.abs(x[1]) > 1 - 1e-9))[0]
    u = basis.zeros()
    u[known] = displacement(x[:, known].T)[np.arange(len(known)), known % 2]
    return basis, solved(A, f, u, known)


def pulled(crack: Floats, grading: Grading, radius: float) -> tuple[Floats, int]:
    """K and unknowns of such a plate, pulled by 1 at top and bottom."""
    points, cells, tip = cracked_square(crack, grading)
    basis = body(points, cells, tip)
    A = stiffness(basis)
    tension = np.diag([0.0, 1.0])
    f = traction_vector(
        basis, lambda x: np.abs(x[1]) > 1 - 1e-9,
        lambda x: np.broadcast_to(tension, (len(x), 2, 2)),
    )  # fmt: skip
    x = basis.doflocs
    # Three statically determinate supports: both components of a corner, x of the one above it.
    right = np.nonzero((x[0] > 1 - 1e-9) & (np.abs(x[1]) > 1 - 1e-9))[0]
    known = right[(x[1, right] < 0) | (right % 2 == 0)]
    u = solved(A, f, basis.zeros(), known)
    ahead = crack[-1] - crack[-2]
    return interaction(basis, u, crack[-1], ahead / np.hypot(*ahead), radius), int(basis.N)
