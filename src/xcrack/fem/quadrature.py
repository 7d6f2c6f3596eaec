"""Integration points: no more than a function needs, and polynomials exactly.

Plain cells need none (their stiffness is tabulated), Heaviside sub-cells the few of a polynomial
rule; what sub-cells with tip functions need depends on the dimension.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock, offsets, ranges
from xcrack.base.errors import GeometryError
from xcrack.fem.function_space import FunctionSpace
from xcrack.mesh.mesh import local_edges
from xcrack.mesh.simplex import SYMMETRIC, cut_simplices, gauss, simplex_rule

# Integration points around the tips of cracks in 2D.

_LEVELS = 5  # bisections towards a tip before the fan takes over
_EDGE_POINTS = 6  # Gauss points of a boundary piece


@dataclass(frozen=True, eq=False)
class Circles:
    """Where an integrand around a tip in 2D begins, ends and is not smooth.

    Attributes
    ----------
    centre : (2,) array, length
        The tip.
    radii : (k,) array, length
        Increasing: it is zero within the first and beyond the last.
    """

    centre: Floats
    radii: Floats


def _plane_points(
    space: FunctionSpace,
    subs: "SubCells",
    with_tip: Bools,
    n: int,
    degree: int,
    circles: Circles | None,
) -> tuple[Ints, Floats, Floats]:
    """Number, place and share of the points of sub-cells, in their order."""
    from xcrack.mesh.kernels.splitting import triangle_points

    mesh = space.mesh
    # A copy is never read-only, for which the kernel would be compiled once more.
    centre, radii = np.zeros(2), np.zeros(0)
    if circles:
        centre, radii = np.array(circles.centre), np.array(circles.radii)
    tips = np.array([tip.x for tip in space.tips]).reshape(-1, 2)
    # Bisected, they are no larger than their distance to a tip: a lower degree than in the fans is
    # enough (K is the same to its error with half of the points, measured), and one whose rule does
    # not depend on how nodes are numbered.
    degree_of_simplex = min(max(2 * n - 3, 3), SYMMETRIC)
    corners = subs.bary @ mesh.points[mesh.cells[subs.cell]]
    number, place, share = triangle_points(
        subs.bary, corners, subs.fraction, with_tip, subs.fan, tips, _LEVELS,
        *simplex_rule(2, degree), *simplex_rule(2, degree_of_simplex), *gauss(n + 1), *gauss(n + 4),
        centre, radii,
    )  # fmt: skip
    return number, place, share


def segment_points(
    space: FunctionSpace, begin: Floats, end: Floats, n: int = _EDGE_POINTS
) -> tuple[Ints, Floats, Floats]:
    """Gauss points on segments `(k, 2)`, graded towards a tip that is closer than their length.

    The segment is split at the foot of the nearest tip, with r = u² from there. The rule depends
    only on the segment, so that the cells on both sides of an edge share it; plain Gauss points
    near a tip spoil order 2.

    Returns
    -------
    segment : (q,) array of int
    place : (q, 2) array
        Barycentric coordinates in the segment.
    weight : (q,) array, length
    """
    from xcrack.mesh.kernels.splitting import graded_points

    tips = np.array([tip.x for tip in space.tips]).reshape(-1, space.dim)
    number, place, weight = graded_points(begin, end, tips, *gauss(n))
    return number, place, weight


# Integration points around the fronts of cracks in 3D.

_AT = 1e-9  # share of a sub-cell's size below which a vertex lies on the front
_FAR = 0.7  # distance to the front, in sizes of the sub-cell, beyond which a rule of degree 2 does
_TINY = 0.01  # sub-cells below this share of their cell get fewer points
_NEAR = 0.5  # triangles closer to the front, in their sizes, are cut
# For K: sub-cells closer to the front, in their sizes times the fourth root of their share of the
# cell, are cut, and those of a smaller share have a rule of degree 2. As exact as the half of the
# size for all, down to an eighth of a hundredth of the cell, with .7 of its points (measured).
_NEAR_OF_WHOLE, _LEAST_SHARE = 0.7, 0.002
_BISECTIONS = 6  # of a sub-cell towards a front at most
_SAME = 1e-6  # relative difference below which lengths and volumes are equal


def radius_at(space: FunctionSpace, nodes: Ints, bary: Floats) -> Floats:
    """Distance to the nearest front `(k, v)`, from the level sets as they are interpolated.

    Parameters
    ----------
    space : FunctionSpace
    nodes : (k, m) array of int
        Mesh points of simplices.
    bary : (k, v, m) array
        Places in them.
    """
    return _radius(_levels_at(space, nodes, bary))


def _levels_at(space: FunctionSpace, nodes: Ints, bary: Floats) -> Floats:
    """Level sets of each front, linear in simplices, at places in them `(k, tips, v, 2)`."""
    result = np.empty((len(nodes), len(space.tips), bary.shape[1], 2))
    for t, tip in enumerate(space.tips):
        levels = space.cuts[tip.crack].level_set
        for i, values in enumerate((levels.phi, levels.psi[tip.number])):
            result[:, t, :, i] = np.einsum("kvm,km->kv", bary, values[nodes])
    return result


def _radius(levels: Floats) -> Floats:
    """Distance to the nearest front `(k, v)` of level sets `(k, tips, v, 2)`."""
    return np.asarray(np.hypot(levels[..., 0], levels[..., 1]).min(axis=1, initial=np.inf))


def front_points(
    space: FunctionSpace, cell: Ints, bary: Floats, share: Floats, n: int
) -> tuple[Ints, Floats, Floats]:
    """Points in sub-cells on which tip functions act.

    Parameters
    ----------
    space : FunctionSpace
    cell : (s,) array of int
    bary : (s, 4, 4) array
        Vertices of the sub-cells in their cells.
    share : (s,) array
        Of the cell's volume.
    n : int
        Gauss points along the angle at a front; at order 2 one more.

    Returns
    -------
    number : (q,) array of int
        Sub-cell of each point.
    place : (q, 4) array
        In barycentric coordinates of the cell.
    weight : (q,) array
        As a share of the cell's volume.
    """
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[space.mesh.cells[cell]])
    r, size = radius_at(space, space.mesh.cells[cell], bary), _longest_edges(x)
    touching_parts, is_far = _on_front(bary, r, size)
    is_tiny = share < (1 - _SAME) * _TINY
    is_coarse = (
        is_far & (is_tiny | (r.min(axis=1) > (1 + _SAME) * _FAR * size)) & (space.order == 1)
    )
    swept_parts = _swept_points(touching_parts, share, n if space.order == 1 else n + 1)
    plain_parts = [
        _rule_points(rows, bary[rows], share[rows], simplex_rule(3, degree))
        for rows, degree in (
            (np.nonzero(is_far & ~is_coarse)[0], 2 * n - 3),
            (np.nonzero(is_coarse)[0], max(n - 2, 1)),
        )
    ]
    return _all_parts([*swept_parts, *plain_parts])


def graded_points(
    space: FunctionSpace, cell: Ints, bary: Floats, share: Floats, n: int, degree: int
) -> tuple[Ints, Floats, Floats]:
    """Points in sub-cells on which tip functions act, for K.

    Those that do not touch a front are bisected towards it, until none is nearer to it than its
    size allows, large parts sooner than small ones, which add less to the error: the noise of a
    domain integral is that of its quadrature.

    Parameters
    ----------
    space, cell, bary, share, n
        As of `front_points`.
    degree : int
        Degree of polynomials integrated exactly away from the front.

    Returns
    -------
    number, place, weight
        As of `front_points`.
    """
    from xcrack.mesh.kernels.splitting import bisected_towards_fronts

    nodes = space.mesh.cells[cell]
    x = np.einsum("svb,sbd->svd", bary, space.mesh.points[nodes])
    levels = _levels_at(space, nodes, bary)
    touching_parts, is_far = _on_front(bary, _radius(levels), _longest_edges(x))
    swept_parts = _swept_points(touching_parts, share, n)
    rows = np.nonzero(is_far)[0]
    number, bary, share = bisected_towards_fronts(
        bary[rows], x[rows], levels[rows], share[rows], (1 - _SAME) * _NEAR_OF_WHOLE,
        _BISECTIONS, _SAME,
    )  # fmt: skip
    number = rows[number]
    is_small = share < (1 - _SAME) * _LEAST_SHARE
    plain_parts = [
        _rule_points(number[rows], bary[rows], share[rows], simplex_rule(3, degree_of_part))
        for rows, degree_of_part in ((~is_small, degree), (is_small, 2))
    ]
    return _all_parts([*swept_parts, *plain_parts])


_Parts = tuple[Ints, Floats, Floats]  # sub-cell, vertices or places, share


def _longest_edges(x: Floats) -> Floats:
    """Longest edge of each tetrahedron `(s,)`."""
    i, j = local_edges(3).T
    return np.asarray(np.linalg.norm(x[:, i] - x[:, j], axis=2).max(axis=1))


def _on_front(bary: Floats, r: Floats, size: Floats) -> tuple[list[tuple[Ints, Floats]], Bools]:
    """Sub-cells with an edge on the front and with a vertex there, those first; and all others."""
    at = r < _AT * size[:, None]
    corner = np.take_along_axis(bary, np.argsort(~at, axis=1, kind="stable")[:, :, None], axis=1)
    n_touching = at.sum(axis=1)
    edge, is_far = n_touching == 2, n_touching == 0
    rows = (np.nonzero(edge)[0], np.nonzero(~edge & ~is_far)[0])
    return [(touching_rows, corner[touching_rows]) for touching_rows in rows], is_far


def _swept_points(touching_parts: list[tuple[Ints, Floats]], share: Floats, n: int) -> list[_Parts]:
    """Points in sub-cells with an edge and with a vertex on the front."""
    result = []
    for (rows, corner), rule in zip(touching_parts, (_edge_rule, _vertex_rule), strict=True):
        is_tiny = share[rows] < (1 - _SAME) * _TINY
        for mask, k in ((~is_tiny, n), (is_tiny, max(n - 1, 2))):
            result.append(_rule_points(rows[mask], corner[mask], share[rows[mask]], rule(k)))
    return result


def _rule_points(
    number: Ints, corner: Floats, share: Floats, rule: tuple[Floats, Floats]
) -> _Parts:
    """Points of a rule in simplices."""
    count, width = len(rule[1]), corner.shape[2]
    place = rule[0] @ corner.transpose(1, 0, 2).reshape(corner.shape[1], -1)
    place = place.reshape(count, len(corner), width).transpose(1, 0, 2).reshape(-1, width)
    return np.repeat(number, count), place, (share[:, None] * rule[1]).ravel()


def _all_parts(parts: list[_Parts]) -> _Parts:
    a, b, c = (np.concatenate(p) for p in zip(*parts, strict=True))
    return a, b, c


@lru_cache(maxsize=8)
def _edge_rule(n: int) -> tuple[Floats, Floats]:
    """Rule on a tetrahedron whose first two vertices lie on the front.

    x = (1 - u) [(1 - v) T0 + v T1] + u [(1 - w) T2 + w T3], u = s², dV = 6 V u (1 - u) du dv dw.
    """
    (s, ws), (v, wv), (w, ww) = gauss(n - 1), gauss(max(n - 2, 2)), gauss(n)
    s, v, w = (a.ravel() for a in np.meshgrid(s, v, w, indexing="ij"))
    u = s * s
    weight = np.einsum("i,j,k->ijk", ws, wv, ww).ravel() * 12 * s * u * (1 - u)
    bary = np.stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - w), u * w], axis=1)
    return lock(bary), lock(weight / weight.sum())


@lru_cache(maxsize=8)
def _vertex_rule(n: int) -> tuple[Floats, Floats]:
    """Rule on a tetrahedron whose first vertex lies on the front, u = s² from there."""
    s, ws = gauss(n - 1)
    far_coordinate, share = simplex_rule(2, 4)
    u = np.repeat(s * s, len(share))
    weight = np.outer(ws * s**5, share).ravel()
    bary = np.concatenate(
        [(1 - u)[:, None], u[:, None] * np.tile(far_coordinate, (len(s), 1))], axis=1
    )
    return lock(bary), lock(weight / weight.sum())


def triangle_points(r: Floats, size: Floats, degree: int = 4) -> tuple[Ints, Floats, Floats]:
    """Points on triangles on which tip functions may act, denser towards the front.

    Parameters
    ----------
    r : (k, 3) array, length
        Distance to the front at the corners; inf where there is none.
    size : (k,) array, length
        Longest side.
    degree : int
        Degree of polynomials integrated exactly away from the front.

    Returns
    -------
    number : (q,) array of int
    bary : (q, 3) array
    weight : (q,) array
        Share of the area.
    """
    number = np.arange(len(r))
    corner = np.broadcast_to(np.eye(3), (len(r), 3, 3))
    share = np.ones(len(r))
    parts = []
    for level in (0, 1):
        at = r < _AT * size[:, None]
        n_touching = at.sum(axis=1)
        first = np.argsort(~at, axis=1, kind="stable")
        corner = np.take_along_axis(corner, first[:, :, None], axis=1)
        r = np.take_along_axis(r, first, axis=1)
        is_near = (n_touching == 0) & (r.min(axis=1) < _NEAR * size) & (level == 0)
        for mask, rule in (
            (n_touching == 2, _side_rule()),
            ((n_touching == 1) | (n_touching == 3), _corner_rule()),
            ((n_touching == 0) & ~is_near, simplex_rule(2, degree)),
        ):
            rows = np.nonzero(mask)[0]
            place = np.einsum("pv,svb->spb", rule[0], corner[rows])
            weight = share[rows, None] * rule[1]
            parts.append(
                (np.repeat(number[rows], len(rule[1])), place.reshape(-1, 3), weight.ravel())
            )
        rows = np.nonzero(is_near)[0]
        number, share = np.repeat(number[rows], 4), np.repeat(share[rows] / 4, 4)
        size = np.repeat(size[rows] / 2, 4)
        corner = np.einsum("cvw,swb->scvb", quarters(), corner[rows]).reshape(-1, 3, 3)
        r = np.einsum("cvw,sw->scv", quarters(), r[rows]).reshape(-1, 3)
    a, b, c = (np.concatenate(p) for p in zip(*parts, strict=True))
    return a, b, c


@lru_cache(maxsize=1)
def _side_rule() -> tuple[Floats, Floats]:
    """Rule on a triangle whose first two corners lie on the front."""
    (s, ws), (v, wv) = gauss(4), gauss(3)
    s, v = (a.ravel() for a in np.meshgrid(s, v, indexing="ij"))
    u = s * s
    weight = np.outer(ws, wv).ravel() * s * (1 - u)
    return lock(np.stack([(1 - u) * (1 - v), (1 - u) * v, u], axis=1)), lock(weight / weight.sum())


@lru_cache(maxsize=1)
def _corner_rule() -> tuple[Floats, Floats]:
    """Rule on a triangle whose first corner lies on the front."""
    (s, ws), (v, wv) = gauss(4), gauss(4)
    s, v = (a.ravel() for a in np.meshgrid(s, v, indexing="ij"))
    u = s * s
    weight = np.outer(ws, wv).ravel() * s**3
    return lock(np.stack([1 - u, u * (1 - v), u * v], axis=1)), lock(weight / weight.sum())


@lru_cache(maxsize=1)
def quarters() -> Floats:
    """Barycentric corners of the four equal parts of a triangle `(4, 3, 3)`."""
    a, b, c = np.eye(3)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return lock(np.array([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]))


# Sides of the cracks on which points lie: of cells, of crack faces, and at junctions.


def cell_side(space: FunctionSpace, cells: Ints) -> Ints:
    """Side of each crack on which cells lie `(k, cracks)`, 0 where a crack crosses them."""
    side = np.empty((len(cells), len(space.cuts)), dtype=np.int64)
    for c, cut in enumerate(space.cuts):
        side[:, c] = cut.side[cells]
    return side


def lip_side(space: FunctionSpace, c: int, cell: Ints, bary: Floats, side: int) -> Ints:
    """Side of each crack `(k, cracks)` for points on lip + or lip - of crack c.

    Parameters
    ----------
    space : FunctionSpace
    c : int
    cell : (k,) array of int
        On that side of the crack.
    bary : (k, d + 1) array
        Of the points in the cells.
    side : {1, -1}
    """
    sides = cell_side(space, cell)
    sides[:, c] = side
    for joint in space.joints:
        if joint.crack == c:
            sides[joint.is_near[cell], joint.on] = joint.side
    return at_joints(space, cell, bary, sides, c)


def at_joints(
    space: FunctionSpace, cell: Ints, bary: Floats, sides: Ints, c: int | None = None
) -> Ints:
    """Sides `(k, cracks)` of points at junctions, changed in place: of cracks that end there.

    Parameters
    ----------
    space : FunctionSpace
    cell : (k,) array of int
    bary : (k, d + 1) array
        Inside what is on one side of each crack, or on a face of a crack.
    sides : (k, cracks) array of int
        Right for cracks that run through.
    c : int, optional
        A crack whose sides stay.
    """
    for joint in space.joints:
        if joint.crack == c:
            continue
        near_points = np.nonzero(joint.is_near[cell])[0]
        side_of_through_crack = sides[near_points, joint.on]
        phi = space.cuts[joint.crack].level_set.phi[space.mesh.cells[cell[near_points]]]
        side_of_point = np.where(np.einsum("kb,kb->k", bary[near_points], phi) >= 0, 1, -1)
        is_uncut = ~space.cuts[joint.on].is_cut[cell[near_points]]
        new_side = np.where(side_of_through_crack == -joint.side, 0, side_of_point)
        keep = (side_of_through_crack == 0) | (
            (side_of_through_crack == joint.side) & is_uncut & (c != joint.on)
        )
        sides[near_points, joint.crack] = np.where(keep, sides[near_points, joint.crack], new_side)
    return sides


def part_numbers(space: FunctionSpace, cell: Ints, sides: Ints) -> Ints:
    """Which part of its cell a point lies in `(k,)`, from 0 to `n_parts` - 1, by its sides."""
    is_above = np.zeros(len(cell), dtype=bool)
    is_beside = np.zeros(len(cell), dtype=bool)
    for c, cut in enumerate(space.cuts):
        is_above_crack = cut.is_cut[cell] & (sides[:, c] > 0)
        for joint in space.joints:
            if joint.crack == c:
                is_beside |= is_above_crack & joint.is_in_both[cell]
                is_above_crack = is_above_crack & ~joint.is_in_both[cell]
        is_above |= is_above_crack
    return is_above + 2 * is_beside.astype(np.int64)


def n_parts(space: FunctionSpace) -> int:
    """Into how many parts cracks cut a cell at most: two, or four at a junction."""
    return 4 if space.joints else 2


_ROUND_OFF = 1e-13  # share of a sub-cell's largest level set below which a value is zero


@dataclass(frozen=True, eq=False)
class Points:
    """Integration points in cells, sorted by cell and piece.

    Attributes
    ----------
    cell : (q,) array of int
    bary : (q, d + 1) array
    weight : (q,) array, length^d
    side : (q, cracks) array of int
        Side of each crack; 0 where that means nothing.
    """

    cell: Ints
    bary: Floats
    weight: Floats
    side: Ints

    def subset(self, selection: Bools | Ints) -> "Points":
        """Some of the points, by a mask or by their numbers."""
        return Points(
            self.cell[selection], self.bary[selection], self.weight[selection], self.side[selection]
        )

    def of_cells(self, cells: Ints) -> tuple[Ints, Ints, Ints]:
        """Points of the given cells: their numbers, row of their cell, offsets by cell."""
        first = self.cell.searchsorted(cells)
        counts = self.cell.searchsorted(cells, side="right") - first
        row, place = ranges(counts)
        return first[row] + place, row, offsets(counts)


@dataclass(frozen=True, eq=False)
class SubCells:
    """Simplices into which cells are split, each wholly on one side of each crack.

    Attributes
    ----------
    cell : (s,) array of int
    bary : (s, d + 1, d + 1) array
        Vertices in barycentric coordinates of the cell.
    fraction : (s,) array
        Share of the cell's volume.
    side : (s, cracks) array of int
    fan : (s,) array of bool
        Vertex 0 is a tip.
    """

    cell: Ints
    bary: Floats
    fraction: Floats
    side: Ints
    fan: np.ndarray


def sub_cells(space: FunctionSpace, cells: Ints) -> SubCells:
    """Sub-cells of the given cells, in their order."""
    mesh = space.mesh
    base = cell_side(space, cells)
    is_whole = np.ones(len(cells), dtype=bool)
    parts = []
    for c, cut in enumerate(space.cuts):
        # Cells split by this crack hand over their sub-cells.
        place = np.full(len(mesh.cells), -1, dtype=np.int64)
        place[cells] = np.arange(len(cells))
        rows = place[cut.sub_to_cell]
        is_cut_cell = rows >= 0
        owner = rows[is_cut_cell]
        if not is_whole[owner].all():
            failed_cells = cells[owner[~is_whole[owner]][0]]
            raise GeometryError(
                f"two cracks run through the cell at "
                f"{np.round(mesh.points[mesh.cells[failed_cells]].mean(axis=0), 6).tolist()}: "
                f"refine the mesh between them until at least one cell lies in between, or draw "
                f"one on to the other to end there."
            )
        side = base[owner].copy()
        side[:, c] = cut.sub_side[is_cut_cell]
        tip = cut.is_tip[cut.sub_to_cell[is_cut_cell]]
        parts.append((owner, cut.sub_bary[is_cut_cell], cut.sub_fraction[is_cut_cell], side, tip))
        is_whole[owner] = False
    whole_cells = is_whole.nonzero()[0]
    if len(whole_cells) or not parts:
        corner = np.zeros((len(whole_cells), mesh.dim + 1, mesh.dim + 1))
        corner[:, range(mesh.dim + 1), range(mesh.dim + 1)] = 1.0
        share, fan = np.ones(len(whole_cells)), np.zeros(len(whole_cells), dtype=bool)
        parts.append((whole_cells, corner, share, base[whole_cells], fan))
    owner, bary, fraction, side, fan = map(np.concatenate, zip(*parts, strict=True))
    order = owner.argsort(kind="stable")
    subs = SubCells(cells[owner[order]], bary[order], fraction[order], side[order], fan[order])
    return _sub_cells_at_joints(space, subs) if space.joints else subs


def _sub_cells_at_joints(space: FunctionSpace, subs: SubCells) -> SubCells:
    """Sub-cells with the sides of cracks that end on others, split where both cut a cell."""
    for joint in space.joints:
        phi = space.cuts[joint.crack].level_set.phi
        is_crossed = joint.is_in_both[subs.cell] & (subs.side[:, joint.on] == joint.side)
        subs = _split_along(space, subs, phi, is_crossed, _ROUND_OFF)
    if space.dim == 3:
        subs = _sub_cells_at_ends_of_fronts(space, subs)
    centre = subs.bary.mean(axis=1)
    return replace(subs, side=at_joints(space, subs.cell, centre, subs.side))


def _sub_cells_at_ends_of_fronts(space: FunctionSpace, subs: SubCells) -> SubCells:
    """Sub-cells split along the fronts of arms, in the cells that the other crack cuts too."""
    for joint in space.joints:
        cut = space.cuts[joint.crack]
        for psi in cut.level_set.psi:
            is_crossed = (joint.is_in_both & cut.is_tip)[subs.cell] & (
                subs.side[:, joint.on] == joint.side
            )
            subs = _split_along(space, subs, psi, is_crossed, _AT)
    return subs


def _split_along(
    space: FunctionSpace, subs: SubCells, values: Floats, is_chosen: Bools, tolerance: float
) -> SubCells:
    """Chosen sub-cells split along the zero of a linear function, in their order."""
    nodes = space.mesh.cells[subs.cell]
    value = np.einsum("svb,sb->sv", subs.bary, values[nodes])
    is_small = np.abs(value) < tolerance * np.abs(value).max(axis=1, keepdims=True)
    value[is_small] = 0.0
    split = is_chosen & (value.min(axis=1) < 0) & (value.max(axis=1) > 0)
    whole_parts, rows = np.nonzero(~split)[0], np.nonzero(split)[0]
    x = np.einsum("svb,sbd->svd", subs.bary[rows], space.mesh.points[nodes[rows]])
    bary_in_sub, share, _, parent = cut_simplices(value[rows], x)
    source = np.concatenate([whole_parts, rows[parent]])
    order = np.argsort(source, kind="stable")
    bary_of_parts = np.einsum("svw,swb->svb", bary_in_sub, subs.bary[rows[parent]])
    source = source[order]
    return SubCells(
        subs.cell[source],
        np.concatenate([subs.bary[whole_parts], bary_of_parts])[order],
        subs.fraction[source] * np.concatenate([np.ones(len(whole_parts)), share])[order],
        subs.side[source],
        subs.fan[source],
    )


def cell_points(
    space: FunctionSpace,
    cells: Ints,
    n: int,
    degree: int,
    is_graded: bool = False,
    circles: Circles | None = None,
) -> Points:
    """Integration points of cells, sorted by cell.

    Parameters
    ----------
    space : FunctionSpace
    cells : (k,) array of int, increasing
    n : int
        Points a direction where tip functions act.
    degree : int
        Degree of polynomials integrated exactly elsewhere.
    is_graded : bool
        In 3D: sub-cells on which tip functions act, and which do not touch a front, are bisected
        towards it and have a rule of that degree too.
    circles : Circles, optional
        In 2D: fans around their centre begin and end there.
    """
    subs = sub_cells(space, cells)
    with_tip = space.has_tip[subs.cell]
    if space.dim == 2:
        number, point_bary, share = _plane_points(space, subs, with_tip, n, degree, circles)
        cell = subs.cell[number]
        return Points(cell, point_bary, share * space.mesh.volume[cell], subs.side[number])
    plain_rows = (~with_tip).nonzero()[0]
    bary, weight = simplex_rule(space.dim, degree)
    number = np.repeat(plain_rows, len(weight))
    point_bary = np.einsum("pv,svb->spb", bary, subs.bary[plain_rows]).reshape(-1, space.dim + 1)
    share = np.outer(subs.fraction[plain_rows], weight).ravel()
    rows = with_tip.nonzero()[0]
    if not len(rows):
        return _sorted_points(space, subs, number, point_bary, share)
    is_near = space, subs.cell[rows], subs.bary[rows], subs.fraction[rows], n
    sub, place, part = graded_points(*is_near, degree) if is_graded else front_points(*is_near)
    return _sorted_points(
        space,
        subs,
        np.concatenate([number, rows[sub]]),
        np.concatenate([point_bary, place]),
        np.concatenate([share, part]),
    )


def _sorted_points(
    space: FunctionSpace, subs: SubCells, numbers: Ints, bary: Floats, part: Floats
) -> Points:
    """Points of sub-cells, sorted by sub-cell, and so by cell."""
    order = np.argsort(numbers, kind="stable")
    numbers = numbers[order]
    cell = subs.cell[numbers]
    return Points(cell, bary[order], part[order] * space.mesh.volume[cell], subs.side[numbers])


__all__ = []
