"""Faces of a 3D crack as triangles that share their vertices, with the fields on them."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.fem.quadrature import lip_side
from xcrack.mesh.locate import Body
from xcrack.mesh.triangulation import rim

_AT_SIDE = 1e-6  # share of a cell within which the middle of an edge lies on the boundary
_SAME = 1e-9  # share of a cell within which vertices are one, or lie on a front


@dataclass(frozen=True, eq=False)
class LipFaces:
    """Faces of one crack in 3D.

    Attributes
    ----------
    points : (n, 3) array, length
        Vertices, each once.
    triangles : (t, 3) array of int
        Turning by the right hand around the normal from lip - to lip +.
    normal : (n, 3) array
    pressure : (n,) array, stress
        Of contact, 0 without; at each vertex the mean of the triangles there, weighted by area.
    minus, plus : (n, 3) arrays, length
        Displacement of each lip.
    area : (t,) array, length²
    mean_pressure, mean_gap : (t,) arrays
        Means over each triangle.
    closed_share : (t,) array
        Share of each triangle on which the crack faces touch.
    front : (k, 2) array of int
        Edges on the fronts.
    junction : (j, 2) array of int
        Edges on other cracks, on which the crack ends.
    mouth : (m, 2) array of int
        The other edges with one triangle: where the crack leaves the body.
    """

    points: Floats
    triangles: Ints
    normal: Floats
    pressure: Floats
    minus: Floats
    plus: Floats
    area: Floats
    mean_pressure: Floats
    mean_gap: Floats
    closed_share: Floats
    front: Ints
    junction: Ints
    mouth: Ints

    @property
    def jump(self) -> Floats:
        """Displacement of lip + minus that of lip - `(n, 3)`, length."""
        return self.plus - self.minus

    @property
    def gap(self) -> Floats:
        """Normal opening `(n,)`, length."""
        return np.einsum("nd,nd->n", self.jump, self.normal)

    @property
    def sliding(self) -> Floats:
        """Length of the tangential jump `(n,)`, length."""
        tangential_jump = self.jump - self.gap[:, None] * self.normal
        return np.asarray(np.linalg.norm(tangential_jump, axis=1))


def lip_faces(solution: Solution, crack: int) -> LipFaces:
    """Triangles of the faces of a 3D crack, and the fields on them.

    Parameters
    ----------
    solution : Solution
    crack : int

    Returns
    -------
    LipFaces
    """
    space, lips = solution.space, solution.lips[crack]
    cut, mesh = space.cuts[crack], space.mesh
    corners = cut.lip_points(mesh)
    area_vector = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(area_vector, axis=1) / 2
    is_reversed = np.einsum("td,td->t", area_vector, cut.lip_normal) < 0
    number = _merged_numbers(corners.reshape(-1, 3), _SAME * float(mesh.cell_size.min()))
    n = int(number.max(initial=-1)) + 1
    corner = np.zeros(n, dtype=np.int64)
    corner[number] = np.arange(len(number))
    triangles = number.reshape(-1, 3)
    triangles = np.where(is_reversed[:, None], triangles[:, [0, 2, 1]], triangles)
    owner, vertex = corner // 3, corner % 3
    moved_points = []
    for k in (0, 1):
        cell, bary = cut.lip_cell[owner, k], cut.lip_bary[owner, k, vertex]
        with np.errstate(divide="ignore", invalid="ignore"):  # gradients at a front, not looked at
            side = lip_side(space, crack, cell, bary, 2 * k - 1)
            moved_points.append(solution.at(cell, bary, side)[0])

    weight = np.maximum(np.bincount(lips.segment, lips.weight, len(area)), 1e-300)

    def mean(values: Floats) -> Floats:
        return lock(np.bincount(lips.segment, lips.weight * values, len(area)) / weight)

    contact = solution.contact[crack]
    nothing = np.zeros(len(lips))
    pressure = nothing if contact is None else contact.pressure
    share = np.repeat(area, 3)
    area_around = np.maximum(np.bincount(number, share, n), 1e-300)
    normal = np.stack(
        [np.bincount(number, share * np.repeat(v, 3), n) for v in cut.lip_normal.T], axis=1
    )
    at_corner = _at_corners(solution, crack, pressure)
    edges, row = rim(triangles)
    on_front = _on_front(solution, crack, corner)
    is_front_edge = on_front[edges].all(axis=1) & (area[row] > 0)
    ends = _on_other(solution, crack, corner)[edges].all(axis=1) & ~is_front_edge
    leaves = ~is_front_edge & ~ends
    if any(crack in (joint.crack, joint.on) for joint in space.joints):
        # Faces that an arm splits lie beside whole ones: such edges are no mouth.
        middle = corners.reshape(-1, 3)[corner][edges].mean(axis=1)
        depth, size = Body.of(mesh).depth(middle)
        leaves &= np.abs(depth) < _AT_SIDE * size
    return LipFaces(
        points=lock(corners.reshape(-1, 3)[corner]),
        triangles=lock(triangles),
        normal=lock(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)),
        pressure=lock(np.bincount(number, share * at_corner.ravel(), n) / area_around),
        minus=lock(moved_points[0]),
        plus=lock(moved_points[1]),
        area=lock(area),
        mean_pressure=mean(pressure),
        mean_gap=mean(solution.opening(crack) if contact is None else contact.gap),
        closed_share=mean(nothing if contact is None else contact.closed.astype(float)),
        front=lock(edges[is_front_edge]),
        junction=lock(edges[ends]),
        mouth=lock(edges[leaves]),
    )


def junction_lines(solution: Solution, crack: int | None = None) -> list[tuple[LipFaces, Ints]]:
    """Faces of cracks that end on others, and their edges there: of all, or those at one."""
    arms = {
        joint.crack
        for joint in solution.space.joints
        if crack is None or crack in (joint.crack, joint.on)
    }
    return [(lips, lips.junction) for lips in (lip_faces(solution, arm) for arm in sorted(arms))]


def _on_other(solution: Solution, crack: int, corner: Ints) -> Bools:
    """Which vertices of the triangles of a crack lie on one on which it ends `(n,)`."""
    space, cut = solution.space, solution.space.cuts[crack]
    cells, bary = cut.lip_cell[corner // 3, 0], cut.lip_bary[corner // 3, 0, corner % 3]
    corners, result = space.mesh.cells[cells], np.zeros(len(corner), dtype=bool)
    for joint in space.joints:
        if joint.crack == crack:
            phi = space.cuts[joint.on].level_set.phi[corners]
            result |= np.abs((bary * phi).sum(axis=1)) < _SAME * space.mesh.cell_size[cells]
    return result


def _merged_numbers(x: Floats, distance: float) -> Ints:
    """Number of the place of each point: those closer than a distance share it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = cKDTree(x).query_pairs(distance, output_type="ndarray")
    n = len(x)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(links, directed=False)
    return np.asarray(group, dtype=np.int64)


def _at_corners(solution: Solution, crack: int, values: Floats) -> Floats:
    """Values at the vertices of the triangles `(t, 3)`: the best linear fit in each of them.

    Pressures are linear in a cell, so that the fit is exact where a triangle is not tiny.
    """
    cut, lips = solution.space.cuts[crack], solution.lips[crack]
    corners = cut.lip_points(solution.space.mesh)
    place = _in_triangles(corners[lips.segment], lips.x)
    t = len(corners)
    mass, rhs = np.zeros((t, 3, 3)), np.zeros((t, 3))
    weight = lips.weight / np.maximum(
        np.bincount(lips.segment, lips.weight, t)[lips.segment], 1e-300
    )
    np.add.at(mass, lips.segment, weight[:, None, None] * place[:, :, None] * place[:, None])
    np.add.at(rhs, lips.segment, (weight * values)[:, None] * place)
    # A rule with few points, or a triangle that is nearly a line, would leave the fit open.
    mean = rhs.sum(axis=1) / np.maximum(mass.sum(axis=(1, 2)), 1e-300)
    regularisation = 1e-9 * np.eye(3)
    fit = np.linalg.solve(mass + regularisation, (rhs + 1e-9 * mean[:, None])[..., None])[..., 0]
    min_value = np.full(t, np.inf)
    max_value = np.full(t, -np.inf)
    np.minimum.at(min_value, lips.segment, values)
    np.maximum.at(max_value, lips.segment, values)
    reach = (max_value - min_value)[:, None]
    bounded = np.clip(fit, min_value[:, None] - reach, max_value[:, None] + reach)
    return np.where(np.isfinite(bounded), bounded, mean[:, None])


def _in_triangles(corners: Floats, x: Floats) -> Floats:
    """Barycentric coordinates `(q, 3)` of points in the planes of triangles `(q, 3, 3)`."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    square = np.maximum(np.einsum("qd,qd->q", normal, normal), 1e-300)
    y = x - corners[:, 0]
    second_weight = np.einsum("qd,qd->q", np.cross(y, b), normal) / square
    third_weight = np.einsum("qd,qd->q", np.cross(a, y), normal) / square
    return np.stack([1 - second_weight - third_weight, second_weight, third_weight], axis=1)


def _on_front(solution: Solution, crack: int, corner: Ints) -> Bools:
    """Which vertices lie on a front; `corner` are their places in the list of all corners."""
    cut, mesh = solution.space.cuts[crack], solution.space.mesh
    cell = cut.lip_cell[corner // 3, 1]
    bary = cut.lip_bary[corner // 3, 1, corner % 3]
    flag = np.zeros(len(corner), dtype=bool)
    for psi in cut.level_set.psi:
        at = np.einsum("qb,qb->q", bary, psi[mesh.cells[cell]])
        flag |= np.abs(at) < 1e-8 * mesh.cell_size[cell]
    return flag


__all__ = ["LipFaces", "junction_lines", "lip_faces"]
