"""The conforming baseline for cracks that meet in 2D: any network of straight cracks in a square.

Quadratic triangles with quarter points at the tips; nodes on cracks are split into as many as the
cracks part the triangles round them into. Closed cracks get hats of normal pressure along each
piece and the exact solution of the small contact problem. References of the
book's junctions.

    python -m benchmarks.baselines.network_2d
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from benchmarks.baselines.conforming_2d import Grading, interaction, stiffness, traction_vector
from benchmarks.scenes.material import E_PRIME, KOLOSOV, MU
from xcrack.base.arrays import Floats, Ints
from xcrack.fem.williams import unit_gradients
from xcrack.mesh.gmsh_session import session
from xcrack.verification.book.cases.junctions import LINES, OPEN, PRESSED

_FINE = Grading(0.0015, 0.12, 0.04)


@dataclass(frozen=True, eq=False)
class Network:
    """Straight pieces that meet only at their ends, in the square [-1, 1]².

    Attributes
    ----------
    pieces : (k, 2, 2) array
    tips, ahead : (t, 2) arrays
    stress : (2, 2) array
        Whose tractions pull the sides.
    """

    pieces: Floats
    tips: Floats
    ahead: Floats
    stress: Floats


def network_K(
    net: Network, radius: float, closed: bool = False, grading: Grading = _FINE
) -> Floats:
    """K_I and K_II at the tips `(t, 2)`; with contact without friction where asked for."""
    points, cells = _mesh(net, grading)
    basis = _basis(points, cells, net.tips)
    f = traction_vector(basis, lambda x: np.abs(x).max(axis=0) > 1 - 1e-9, lambda x: _all(net, x))
    x = basis.doflocs
    low = x[1] < -1 + 1e-9
    left, right = (np.nonzero(low & (sign * x[0] > 1 - 1e-9))[0] for sign in (-1, 1))
    known = np.concatenate([left, right[right % 2 == 1]])
    free = np.setdiff1d(np.arange(basis.N), known)
    factor = splu(stiffness(basis)[free][:, free].tocsc())
    u = basis.zeros()
    u[free] = factor.solve(f[free])
    pressed: list[tuple[Floats, Floats]] = []
    if closed:
        rows = [_gaps(basis, piece) for piece in net.pieces]
        N = sp.csr_matrix(sp.vstack([r for r, _ in rows]))[:, free]
        X = factor.solve(np.ascontiguousarray(N.T.toarray()))
        force = _pressures(N @ X, N @ u[free])
        u[free] += X @ force
        ends = np.cumsum([0, *(len(knots) for _, knots in rows)])
        pressed = [(k, force[a:b]) for (_, k), a, b in zip(rows, ends, ends[1:], strict=False)]
    K = []
    for tip, ahead in zip(net.tips, net.ahead, strict=True):
        unit = ahead / np.linalg.norm(ahead)
        own = interaction(basis, u, tip, unit, radius)
        for piece, (knots, force) in zip(net.pieces, pressed, strict=False):
            own += _face_terms(piece, knots, force, tip, unit, radius)
        K.append(own)
    return np.array(K)


def _all(net: Network, x: Floats) -> Floats:
    return np.broadcast_to(net.stress, (len(x), 2, 2))


def _mesh(net: Network, grading: Grading) -> tuple[Floats, Ints]:
    with session() as gmsh:
        geo, numbers = gmsh.model.geo, {}

        def number(p: Any) -> int:
            key = tuple(np.round(np.asarray(p, dtype=float), 12).tolist())
            if key not in numbers:
                numbers[key] = geo.addPoint(*key, 0)
            return int(numbers[key])

        corners = [number(c) for c in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
        sides = [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
        lines = [geo.addLine(number(a), number(b)) for a, b in net.pieces]
        plate = geo.addPlaneSurface([geo.addCurveLoop(sides)])
        geo.synchronize()
        gmsh.model.mesh.embed(1, lines, 2, plate)
        size = f"{grading.far!r}"
        for x, y in net.tips.tolist():
            distance = f"Sqrt((x-({x!r}))^2+(y-({y!r}))^2)"
            size = f"Min({size}, Max({grading.near!r}, {grading.growth!r}*{distance}))"
        field = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(field, "F", size)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.model.mesh.generate(2)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        triangles = gmsh.model.mesh.getElements(2, plate)[2][0]
        edges = [gmsh.model.mesh.getElements(1, line)[2][0] for line in lines]
    index = np.full(int(tags.max()) + 1, -1)
    index[tags] = np.arange(len(tags))
    cells = index[triangles.astype(int)].reshape(-1, 3)
    cracked = index[np.concatenate(edges).astype(int)].reshape(-1, 2)
    used, inverse = np.unique(cells, return_inverse=True)
    place = np.full(len(tags), -1)
    place[used] = np.arange(len(used))
    return _parted(flat.reshape(-1, 3)[used, :2], inverse.reshape(-1, 3), place[cracked])


def _parted(points: Floats, cells: Ints, cracked: Ints) -> tuple[Floats, Ints]:
    """One node for each group of triangles round a node that no crack parts."""
    cut = {tuple(sorted(edge)) for edge in cracked.tolist()}
    on_crack = set(np.unique(cracked).tolist())
    fans: dict[int, list[int]] = {}
    for k, triangle in enumerate(cells.tolist()):
        for node in on_crack.intersection(triangle):
            fans.setdefault(node, []).append(k)
    result = cells.copy()
    new: list[Floats] = []
    for node, fan in fans.items():
        groups, left = [], set(fan)
        while left:
            group = [left.pop()]
            for k in group:
                for other in list(left):
                    shared = set(cells[k].tolist()) & set(cells[other].tolist())
                    if len(shared) == 2 and tuple(sorted(shared)) not in cut:
                        left.remove(other)
                        group.append(other)
            groups.append(group)
        for group in groups[1:]:
            for k in group:
                result[k][cells[k] == node] = len(points) + len(new)
            new.append(points[node])
    return np.concatenate([points, np.array(new).reshape(-1, 2)]), result


def _basis(points: Floats, cells: Ints, tips: Floats) -> Any:
    import skfem

    mesh = skfem.MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    curved = skfem.MeshTri2.from_mesh(mesh)
    x = curved.doflocs.copy()
    for tip in tips:
        node = int(np.argmin(np.linalg.norm(points - tip, axis=1)))
        touching = np.nonzero((mesh.facets == node).any(axis=0))[0]
        other = mesh.facets[:, touching].sum(axis=0) - node
        middle = curved.dofs.facet_dofs[0, touching]
        x[:, middle] = 0.75 * mesh.p[:, [node]] + 0.25 * mesh.p[:, other]
    curved = skfem.MeshTri2(x, curved.t, sort_t=False)
    return skfem.Basis(curved, skfem.ElementVector(skfem.ElementTriP2()), intorder=4)


def _gaps(basis: Any, piece: Floats) -> tuple[Any, Floats]:
    """Rows of the integrals of hats times the opening along a piece, and the hats' knots."""
    import skfem

    mesh, (a, b) = basis.mesh, piece
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    normal = np.array([-along[1], along[0]])
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]] - a[:, None, None]
    away, s = np.tensordot(normal, ends, 1), np.tensordot(along, ends, 1)
    on = (
        (np.abs(away).max(axis=0) < 1e-9)
        & (s.min(axis=0) > -1e-9)
        & (s.max(axis=0) < length + 1e-9)
    )
    facets, knots = facets[on], np.unique(np.round(s[:, on], 10))
    centre = mesh.p[:, mesh.t[:3, mesh.f2t[0, facets]]].mean(axis=1) - a[:, None]
    total = sp.csr_matrix((len(knots), basis.N))
    for side in (1, -1):
        mine = facets[np.sign(normal @ centre) == side]
        face = skfem.FacetBasis(mesh, basis.elem, facets=mine, intorder=6)
        x = np.asarray(face.default_parameters()["x"])
        at = np.einsum("i,ikq->kq", along, x - a[:, None, None])
        place = np.clip(np.searchsorted(knots, at) - 1, 0, len(knots) - 2)
        t = (at - knots[place]) / (knots[place + 1] - knots[place])
        for j in range(face.Nbfun):
            value = np.einsum("i,ikq->kq", normal, np.asarray(face.basis[j][0].value))
            column = np.broadcast_to(face.element_dofs[j][:, None], at.shape).ravel()
            for hat, row in ((1 - t, place), (t, place + 1)):
                entry = (side * value * hat * np.asarray(face.dx)).ravel()
                total += sp.csr_matrix((entry, (row.ravel(), column)), shape=total.shape)
    return total, np.asarray(knots, dtype=float)


def _pressures(F: Floats, gap: Floats) -> Floats:
    """Pressures p >= 0 with gap + F p >= 0 and one of both zero."""
    closed = np.ones(len(gap), dtype=bool)
    for _ in range(100):
        p = np.zeros(len(gap))
        p[closed] = np.linalg.solve(F[np.ix_(closed, closed)], -gap[closed])
        after = np.where(closed, p > 0, gap + F @ p < 0)
        if (after == closed).all():
            return p
        closed = after
    raise RuntimeError("the contact of the conforming baseline does not settle.")


def _face_terms(
    piece: Floats, knots: Floats, force: Floats, tip: Floats, ahead: Floats, radius: float
) -> Floats:
    """What the pressures on a piece that ends at a tip add to the interaction integral."""
    a, b = piece
    if min(np.linalg.norm(a - tip), np.linalg.norm(b - tip)) > 1e-9:
        return np.zeros(2)
    length = float(np.linalg.norm(b - a))
    normal = np.array([-(b - a)[1], (b - a)[0]]) / length
    g, w = np.polynomial.legendre.leggauss(400)
    z, reach = (g + 1) / 2, min(radius, length)
    r, weight = z**2 * reach, w * z * reach
    s = r if np.linalg.norm(a - tip) < 1e-9 else length - r
    t = np.clip((r - 0.2 * radius) / (0.7 * radius), 0, 1)
    q = 1 - t**3 * (10 - 15 * t + 6 * t * t)
    R = np.array([ahead, [-ahead[1], ahead[0]]])
    pressure = np.interp(s, knots, force)[:, None] * (R @ normal)
    total = np.zeros(2)
    for side in (1, -1):
        upper = side * np.sign(R[1] @ normal)
        slope = unit_gradients(r, np.full(len(r), np.pi * upper), KOLOSOV, MU)[:2, ..., 0]
        total -= np.einsum("q,mqi,qi->m", weight * q, slope, side * pressure)
    return 0.5 * E_PRIME * total


def star(centre: Floats, tips: list[Floats], stress: Floats) -> Network:
    """Straight arms from one point."""
    ends = np.array(tips)
    pieces = np.array([(centre, end) for end in tips])
    return Network(pieces, ends, ends - centre, stress)


(A, B), (X, UP) = LINES["T"]
DOWN = LINES["X"][2][0]
(LEFT, FORK, RIGHT), (_, ABOVE) = LINES["Y"]
SCENES = {
    "T": (star(X, [A, B, UP], OPEN), False),
    "X": (star(X, [A, B, UP, DOWN], OPEN), False),
    "Y": (star(FORK, [LEFT, RIGHT, ABOVE], OPEN), False),
    "pressed T": (star(X, [A, B, UP], PRESSED), True),
}

if __name__ == "__main__":
    for name, (scene, closed) in SCENES.items():
        print(name, np.round(network_K(scene, 0.2, closed), 5).tolist())
