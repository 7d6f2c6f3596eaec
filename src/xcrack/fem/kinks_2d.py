"""Cuts that follow the kinks of a crack in 2D.

A linear level set cuts cells straight: inside a cell it rounds a kink off, and beside it, where
distances are those to the kink, it misses the crack. Faces under pressure lock at a kink and
slide around what is round, however small. Therefore mesh edges near kinks are cut where the
polyline crosses them, and the cell of a kink is split along both pieces of the crack.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.crack.crack import kink_numbers, turns
from xcrack.fem.level_set import SNAP, LevelSet
from xcrack.mesh.distances import closest_on_segment
from xcrack.mesh.locate import barycentric, cells_around, cells_within
from xcrack.mesh.mesh import Mesh

_REACH = 2.0  # cells at a kink: beyond, the level set is linear in the cells that a piece crosses
# From this turn on the wedge between the pieces is too thin for the functions of a cell: it stays
# rounded off.
_THIN = np.radians(100.0)
_ROUND_OFF = 1e-13  # shares of an edge or of a cell that are zero
_AT = 1e-9  # cells: cuts this close to a kink have it


@dataclass(frozen=True, eq=False)
class Kinks:
    """Where a cut is not that of the linear level set.

    Attributes
    ----------
    points : (k, 2) array, length
        Kinks of the cut, in the order of the crack.
    cells : (s,) array of int, increasing
        Cells that are cut otherwise.
    values : (s, 3) array, length
        At their corners, of the signs of the level set: zero where the crack crosses their edges.
    vertex : (s, 3) array
        Barycentric coordinates of the kink in its cell; nan in cells that are cut straight.
    """

    points: Floats
    cells: Ints
    values: Floats
    vertex: Floats

    def level(self, row: Ints, bary: Floats) -> Floats:
        """A function like the level set, zero on the crack, at points `(q, 3)` of cells by row."""
        result = np.einsum("qb,qb->q", bary, self.values[row])
        for q in np.nonzero(~np.isnan(self.vertex[row, 0]))[0]:
            lines, sense = _two_lines(self.values[row[q]], self.vertex[row[q]])
            result[q] = sense * (sense * (lines @ bary[q])).min()
        return np.asarray(result)

    def split(self) -> tuple[Ints, tuple[Ints, Floats, Floats, Ints]]:
        """Sub-cells of the cells with a vertex.

        Returns
        -------
        rows : (r,) array of int
            Of these cells.
        (cell, bary, fraction, side)
            Of the sub-cells, as in `Cut`.
        """
        rows = np.nonzero(~np.isnan(self.vertex[:, 0]))[0]
        cell, bary, side = [], [], []
        for row in rows:
            loop = _loop(self.values[row])
            for p, q in zip(loop, loop[1:] + loop[:1], strict=True):
                cell.append(self.cells[row])
                bary.append([self.vertex[row], p, q])
                side.append(1 if self.values[row] @ (p + q) >= 0 else -1)
        corners = np.array(bary).reshape(-1, 3, 3)
        share = np.abs(np.linalg.det(corners))
        keep = share > _ROUND_OFF
        cells, sides = np.array(cell, dtype=np.int64), np.array(side, dtype=np.int64)
        return rows, (cells[keep], corners[keep], share[keep], sides[keep])

    def faces(self, rows: Ints) -> Floats:
        """Both pieces of the crack in cells with a vertex, by row: their ends `(r, 2, 2, 3)`."""
        ends = np.array([_crossing_ends(self.values[row]) for row in rows]).reshape(-1, 2, 3)
        vertex = self.vertex[rows]
        return np.stack(
            [np.stack([ends[:, 0], vertex], axis=1), np.stack([vertex, ends[:, 1]], axis=1)], axis=1
        )


_NOTHING = lock(np.zeros((0, 3)))
_CORNERS = lock(np.eye(3))
NO_KINKS = Kinks(lock(np.zeros((0, 2))), lock(np.zeros(0, np.int64)), _NOTHING, _NOTHING)


def sharpened_cut(
    mesh: Mesh, level_set: LevelSet, cells: Ints, positions: Floats
) -> tuple[Kinks, Floats]:
    """Kinks in the cells that a crack cuts, and its positions on the edges `(e,)`.

    Parameters
    ----------
    mesh : Mesh
    level_set : LevelSet
    cells : (k,) array of int
        Cut from side to side.
    positions : (e,) array
        Where the linear level set is zero on the edges of the mesh, nan elsewhere.
    """
    line = level_set.line
    numbers = kink_numbers(line)
    numbers = numbers[turns(line)[numbers - 1] < _THIN]
    cells_at_kinks = [cells_around(mesh, line[k], 1e-12) for k in numbers]
    reach = [
        cells_within(mesh, line[k], _REACH * mesh.cell_size[c].max())
        for k, c in zip(numbers, cells_at_kinks, strict=True)
        if len(c)
    ]
    cells_near = np.intersect1d(np.concatenate([*reach, np.zeros(0, np.int64)]), cells)
    on_points = [
        k for k, c in zip(numbers, cells_at_kinks, strict=True) if _is_point(mesh, c, line[k])
    ]
    if not len(cells_near):
        return replace(NO_KINKS, points=lock(line[on_points].reshape(-1, 2))), positions
    edges = np.unique(mesh.cell_to_edge[cells_near])
    edges = edges[~np.isnan(positions[edges])]
    new_positions = _crossings(mesh, level_set, edges, positions)
    is_changed = ~np.isnan(positions) & (new_positions != positions)
    kinks, points = _vertices(mesh, level_set, cells_near, new_positions, numbers, on_points)
    is_cut_anew = is_changed[mesh.cell_to_edge[cells]].any(axis=1) | np.isin(cells, list(kinks))
    rows = np.sort(cells[is_cut_anew])
    values = _values(mesh, level_set.phi, rows, new_positions)
    vertex = np.full((len(rows), 3), np.nan)
    for cell, at in kinks.items():
        vertex[np.searchsorted(rows, cell)] = at
    return Kinks(lock(points), lock(rows), lock(values), lock(vertex)), new_positions


def _is_point(mesh: Mesh, cells: Ints, x: Floats) -> bool:
    """Whether a kink in some cells is a point of the mesh: pieces along edges cut no cell there."""
    distance = np.linalg.norm(mesh.points[mesh.cells[cells]] - x, axis=2)
    return bool((distance <= _AT * mesh.cell_size[cells, None]).any())


def _crossings(mesh: Mesh, level_set: LevelSet, edges: Ints, positions: Floats) -> Floats:
    """Positions, on some edges where the polyline crosses them if it does so once.

    Edges of cells at tips keep theirs: there the level set is that of the tip.
    """
    line, no_cell = level_set.line, np.zeros(0, np.int64)
    at_tip = np.unique(mesh.cell_to_edge[np.concatenate([*level_set.tip_cells, no_cell])])
    edges = np.setdiff1d(edges, at_tip)
    p, q = mesh.points[mesh.edges[edges]].transpose(1, 0, 2)[:, :, None]
    a, b = line[None, :-1], line[None, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = _cross(a - p, b - a) / _cross(q - p, b - a)
        s = _cross(a - p, q - p) / _cross(q - p, b - a)
    hit = (s >= -_AT) & (s <= 1 + _AT) & (t >= 0) & (t <= 1)
    at = np.where(hit, t, 0.0).max(axis=1, initial=0.0)
    is_single = np.where(hit, np.abs(t - at[:, None]), 0.0).max(axis=1, initial=0.0) <= 1e-8
    at = np.clip(at, SNAP, 1 - SNAP)
    moves = hit.any(axis=1) & is_single & (np.abs(at - positions[edges]) > _ROUND_OFF)
    result = np.array(positions)
    result[edges[moves]] = at[moves]
    return result


def _vertices(
    mesh: Mesh,
    level_set: LevelSet,
    cells: Ints,
    positions: Floats,
    numbers: Ints,
    on_points: Sequence[int],
) -> tuple[dict[int, Floats], Floats]:
    """Cells that have a kink inside, with its place, and all kinks of the cut `(k, 2)`.

    The cell of a kink is the one that the crack enters by the piece before it and leaves by the
    piece behind it. A kink that sticks out of it is moved to its side. One on a point of the mesh
    is in no cell.
    """
    line = level_set.line
    ends = np.stack([_crossing_ends(v) for v in _values(mesh, level_set.phi, cells, positions)])
    x = np.einsum("ceb,cbd->ced", ends, mesh.points[mesh.cells[cells]])
    piece = _pieces(line, x.reshape(-1, 2)).reshape(-1, 2)
    start, end = piece.min(axis=1), piece.max(axis=1)
    is_tip = np.zeros(len(mesh.cells), dtype=bool)
    is_tip[np.concatenate([*level_set.tip_cells, np.zeros(0, np.int64)])] = True
    cell_to_kink, points = {}, []
    for k in numbers:
        touch = np.linalg.norm(x - line[k], axis=2).min(axis=1) <= _AT * mesh.cell_size[cells]
        if touch.any() or k in on_points:
            points.append(line[k])
            continue
        has_kink = (start < numbers[:, None]) & (numbers[:, None] <= end)
        cells_of_kink = np.nonzero((start < k) & (k <= end) & (has_kink.sum(axis=0) == 1))[0]
        if len(cells_of_kink) != 1 or is_tip[cells[cells_of_kink[0]]]:
            continue
        cell = cells[cells_of_kink[0]]
        at = np.maximum(barycentric(mesh, np.array([cell]), line[k][None])[0], 0.0)
        at = np.where(at > _ROUND_OFF, at, 0.0) / at.sum()
        if (
            abs(np.linalg.det([ends[cells_of_kink[0], 0], at, ends[cells_of_kink[0], 1]]))
            > _ROUND_OFF
        ):
            cell_to_kink[int(cell)] = at
            points.append(at @ mesh.points[mesh.cells[cell]])
    return cell_to_kink, np.array(points).reshape(-1, 2)


def _pieces(line: Floats, x: Floats) -> Ints:
    """Number of the piece of a polyline that is nearest to each point `(k,)`."""
    pairs = zip(line[:-1], line[1:], strict=True)
    distances = [np.linalg.norm(x - closest_on_segment(x, a, b), axis=1) for a, b in pairs]
    return np.argmin(distances, axis=0)


def _values(mesh: Mesh, phi: Floats, cells: Ints, positions: Floats) -> Floats:
    """Values at the corners of cut cells with zeros at the positions on their edges."""
    values, row = np.array(phi[mesh.cells[cells]]), np.arange(len(cells))
    side = np.sign(values)
    # The corner alone on its side keeps its value; of two beside one on the crack, the first.
    lone_side = np.where((side == 0).any(axis=1), 0.0, side.sum(axis=1))[:, None]
    lone_corner = np.argmax(np.where(lone_side == 0, side != 0, side * lone_side < 0), axis=1)
    for k in (1, 2):
        other_corner = (lone_corner + k) % 3
        edge = mesh.cell_to_edge[cells, lone_corner + other_corner - 1]  # edges 01, 02, 12
        t = positions[edge]
        t = np.where(mesh.edges[edge, 0] == mesh.cells[cells, lone_corner], t, 1 - t)
        is_crossed = side[row, lone_corner] * side[row, other_corner] < 0
        with np.errstate(invalid="ignore"):
            new_value = -values[row, lone_corner] * (1 - t) / t
        values[row, other_corner] = np.where(is_crossed, new_value, values[row, other_corner])
    return values


def _loop(values: Floats) -> list[Floats]:
    """Corners of a triangle and the points between at which a linear function changes sign."""
    loop: list[Floats] = []
    for v in range(3):
        loop.append(_CORNERS[v])
        a, b = values[v], values[(v + 1) % 3]
        if a * b < 0:
            point = np.zeros(3)
            point[v], point[(v + 1) % 3] = b / (b - a), a / (a - b)
            loop.append(point)
    return loop


def _crossing_ends(values: Floats) -> Floats:
    """The two points of the boundary of a triangle where a linear function is zero `(2, 3)`."""
    loop = _loop(values)
    return np.array([p for p in loop if abs(values @ p) <= 1e-12 * np.abs(values).max()])[:2]


def _two_lines(values: Floats, vertex: Floats) -> tuple[Floats, float]:
    """Two linear functions `(2, 3)` that are zero on the pieces of a crack that meet in a cell.

    With the sign such that the sign times the smaller of both times the sign is like the level set.
    """
    start, end = _crossing_ends(values)
    lines = np.stack([np.cross(start, vertex), np.cross(vertex, end)])
    lines /= np.abs(lines).max(axis=1, keepdims=True)
    sense = 1.0 if np.linalg.det([start, vertex, end]) > 0 else -1.0
    corner = int(np.argmax(np.abs(values)))
    level = sense * (sense * lines[:, corner]).min()
    sign = 1.0 if level * values[corner] > 0 else -1.0
    return sign * np.abs(values).max() * lines, sign * sense


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
