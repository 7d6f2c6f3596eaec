"""Finer meshes: each simplex into parts of half its size, or some of them bisected."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.base.arguments import Array, Either, Function, Number, Part, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints, at, ranges
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import MeshError
from xcrack.base.units import LENGTH
from xcrack.mesh.curves import longest_edge, on_curves, warn_of_flat_points
from xcrack.mesh.gmsh_session import FINEST
from xcrack.mesh.mesh import Mesh, local_edges, local_facets, sound_mesh
from xcrack.mesh.simplex import cell_nodes, facet_nodes, node_points

# Longest-edge bisection of triangles and tetrahedra on arrays.

_ALIKE = 1e7  # steps a factor of two in which lengths are compared
_PLACE = 1e6  # steps a length in which directions and places of middles are
_BASE = np.int64(2**31)  # above every number of a point


@dataclass(frozen=True, eq=False)
class Simplices:
    """Simplices between bisections; edges that were split stay in the list.

    Attributes
    ----------
    points : (n, d) array, length
    cells : (m, d + 1) array of int
    edges : (e, 2) array of int
    edge_middles : (e, d) array, length
    rank : (e, 2 d + 1) array of int
        Order of the edges: length, the longest lowest, direction, place of the middle.
    cell_to_edge : (m, d (d + 1) / 2) array of int
    longest_edge : (m,) array of int
        Local number of each cell's longest edge.
    facet : (m, d + 1) array of int
        Facet of the mesh at the beginning in which each cell's facet lies; -1 inside, and for
        the second cell of a facet.
    parent : (m,) array of int
        Cell of that mesh in which each lies.
    """

    points: Floats
    cells: Ints
    edges: Ints
    edge_middles: Floats
    rank: Ints
    cell_to_edge: Ints
    longest_edge: Ints
    facet: Ints
    parent: Ints

    @property
    def size(self) -> Floats:
        """Longest edge of each cell `(m,)`, length."""
        ends = self.points[self.edges[_row(self.cell_to_edge, self.longest_edge)]]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @property
    def centre(self) -> Floats:
        """Centres of the cells `(m, d)`, length."""
        return np.asarray(self.points[self.cells].mean(axis=1))


def simplices(mesh: Mesh) -> Simplices:
    """A mesh as it enters bisection."""
    middle, rank = _ranked_edges(mesh.points, mesh.edges)
    is_first_cell = mesh.facet_to_cell[mesh.cell_to_facet, 0] == np.arange(len(mesh.cells))[:, None]
    return Simplices(
        mesh.points, mesh.cells, mesh.edges, middle, rank, mesh.cell_to_edge,
        _longest_edges(middle, rank, mesh.cell_to_edge), np.where(is_first_cell, mesh.cell_to_facet,
        -1), np.arange(len(mesh.cells)),
    )  # fmt: skip


def moved_simplices(simplex_set: Simplices, points: Floats) -> Simplices:
    """The same simplices with their points at other places."""
    middle, rank = _ranked_edges(points, simplex_set.edges)
    longest_edge = _longest_edges(middle, rank, simplex_set.cell_to_edge)
    return replace(
        simplex_set, points=points, edge_middles=middle, rank=rank, longest_edge=longest_edge
    )


def bisect_simplices(simplex_set: Simplices, is_marked: Bools) -> tuple[Simplices, Bools]:
    """Split the longest edge of each marked cell, and what it takes to conform.

    Parameters
    ----------
    simplex_set : Simplices
    is_marked : (m,) array of bool

    Returns
    -------
    simplex_set : Simplices
        Untouched cells first, in their order; the old points have their numbers.
    is_untouched : (m,) array of bool
        Which of the cells are still there.
    """
    is_untouched = np.ones(len(simplex_set.cells), dtype=bool)
    split = np.zeros(len(simplex_set.edges), dtype=bool)
    split[_row(simplex_set.cell_to_edge, simplex_set.longest_edge)[is_marked]] = True
    # Of each split edge its middle, and the first of its two halves.
    point, half = np.full((2, len(split)), -1, dtype=np.int64)
    middle_edges, number = np.zeros(
        (2, 0), dtype=np.int64
    )  # edges between a middle and another point
    while True:
        top = _row(simplex_set.cell_to_edge, simplex_set.longest_edge)
        has_hanging_node = np.asarray(split[simplex_set.cell_to_edge].any(axis=1))
        while (is_ahead := has_hanging_node & ~split[top]).any():
            split[top[is_ahead]] = True
            has_hanging_node = np.asarray(split[simplex_set.cell_to_edge].any(axis=1))
        if not has_hanging_node.any():
            return simplex_set, is_untouched
        untouched_cells = np.nonzero(is_untouched)[0]
        is_untouched[untouched_cells[has_hanging_node[: len(untouched_cells)]]] = False
        new_edges = np.unique(top[has_hanging_node])
        new_edges = new_edges[point[new_edges] < 0]
        point[new_edges] = len(simplex_set.points) + np.arange(len(new_edges))
        half[new_edges] = len(simplex_set.edges) + 2 * np.arange(len(new_edges))
        ends, middle = simplex_set.edges[new_edges], point[new_edges]
        halves = np.stack([ends[:, 0], middle, ends[:, 1], middle], axis=1).reshape(-1, 2)
        simplex_set = replace(
            simplex_set,
            points=np.concatenate([simplex_set.points, simplex_set.edge_middles[new_edges]]),
        )
        simplex_set = _with_edges(simplex_set, halves)
        edges_across = _edges_across(simplex_set, has_hanging_node, point)
        key = edges_across[..., 0] * _BASE + edges_across[..., 1]
        new_keys = np.setdiff1d(key, middle_edges)
        first = len(simplex_set.edges)
        simplex_set = _with_edges(
            simplex_set, np.stack([new_keys // _BASE, new_keys % _BASE], axis=1)
        )
        middle_edges = np.concatenate([middle_edges, new_keys])
        number = np.concatenate([number, first + np.arange(len(new_keys))])
        order = np.argsort(middle_edges)
        middle_edges, number = middle_edges[order], number[order]
        simplex_set = _halved_cells(
            simplex_set, has_hanging_node, point, half, number[np.searchsorted(middle_edges, key)]
        )
        edges_added = len(simplex_set.edges) - len(split)
        split = np.concatenate([split, np.zeros(edges_added, dtype=bool)])
        point, half = (np.concatenate([a, np.full(edges_added, -1)]) for a in (point, half))


def _row(table: Ints, column: Ints) -> Ints:
    """One entry of each row."""
    return np.asarray(table[np.arange(len(table)), column])


def _ranked_edges(points: Floats, edges: Ints) -> tuple[Floats, Ints]:
    """Middles of edges, and what orders them: the same bits however points are numbered."""
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    middle = 0.5 * (start + end)
    step = np.round(np.log2(np.linalg.norm(start - end, axis=1)) * _ALIKE)
    length = np.exp2(step / _ALIKE)[:, None]
    direction = np.round((start - end) / length * _PLACE)
    leading_component = direction[np.arange(len(edges)), np.argmax(direction != 0, axis=1)]
    direction *= np.sign(leading_component)[:, None]
    place = np.round(middle / length * _PLACE)
    return middle, np.concatenate([-step[:, None], direction, place], axis=1).astype(np.int64)


def _longest_edges(middle: Floats, rank: Ints, cell_to_edge: Ints) -> Ints:
    """Local number of the first edge of each cell in the order of the edges."""
    first = np.ones(cell_to_edge.shape, dtype=bool)
    rows = np.arange(len(first))
    for column in (*rank.T, *middle.T):  # middles for slivers, where all else is the same
        candidate = np.where(first[rows], column[cell_to_edge[rows]], column.max(initial=0) + 1)
        first[rows] = candidate == candidate.min(axis=1, keepdims=True)
        rows = rows[first[rows].sum(axis=1) > 1]
        if not len(rows):
            break
    return np.asarray(np.argmax(first, axis=1))


def _with_edges(simplex_set: Simplices, edges: Ints) -> Simplices:
    middle, rank = _ranked_edges(simplex_set.points, edges)
    return replace(
        simplex_set,
        edges=np.concatenate([simplex_set.edges, edges]),
        edge_middles=np.concatenate([simplex_set.edge_middles, middle]),
        rank=np.concatenate([simplex_set.rank, rank]),
    )


def _edges_across(simplex_set: Simplices, rows: Bools, point: Ints) -> Ints:
    """Edges from the middle of each cell's longest edge to its other points `(k, d - 1, 2)`."""
    dim = simplex_set.cells.shape[1] - 1
    other_corners = np.array(
        [[k for k in range(dim + 1) if k not in pair] for pair in local_edges(dim)]
    )
    longest_edge, cells = simplex_set.longest_edge[rows], simplex_set.cells[rows]
    middle = point[_row(simplex_set.cell_to_edge[rows], longest_edge)]
    corners = np.take_along_axis(cells, other_corners[longest_edge], axis=1)
    return np.stack([corners, np.broadcast_to(middle[:, None], corners.shape)], axis=-1)


def _halved_cells(
    simplex_set: Simplices, rows: Bools, point: Ints, half: Ints, edges_across: Ints
) -> Simplices:
    """Cells split at the middle of their longest edge; the other ones come first."""
    dim = simplex_set.cells.shape[1] - 1
    pairs = local_edges(dim)
    pair_of = np.zeros((dim + 1, dim + 1), dtype=np.int64)
    pair_of[pairs[:, 0], pairs[:, 1]] = pair_of[pairs[:, 1], pairs[:, 0]] = np.arange(len(pairs))
    other_corners = np.array([[k for k in range(dim + 1) if k not in pair] for pair in pairs])
    cells, longest_edge, facet = (
        simplex_set.cells[rows],
        simplex_set.longest_edge[rows],
        simplex_set.facet[rows],
    )
    edges = simplex_set.cell_to_edge[rows]
    n = np.arange(len(cells))
    top = edges[n, longest_edge]
    children = []
    for side in (0, 1):
        corner_retained, corner_moved = pairs[longest_edge, side], pairs[longest_edge, 1 - side]
        corners, sides, outer_facets = cells.copy(), edges.copy(), facet.copy()
        corners[n, corner_moved] = point[top]
        sides[n, longest_edge] = half[top] + (
            simplex_set.edges[top, 0] != cells[n, corner_retained]
        )
        for k, edge in zip(other_corners[longest_edge].T, edges_across.T, strict=True):
            sides[n, pair_of[corner_moved, k]] = edge
        outer_facets[n, corner_retained] = -1
        children.append((corners, sides, outer_facets))
    corners, sides, outer_facets = (np.concatenate(parts) for parts in zip(*children, strict=True))
    is_unsplit = ~rows
    longest_edge = _longest_edges(simplex_set.edge_middles, simplex_set.rank, sides)
    return replace(
        simplex_set,
        cells=np.concatenate([simplex_set.cells[is_unsplit], corners]),
        cell_to_edge=np.concatenate([simplex_set.cell_to_edge[is_unsplit], sides]),
        longest_edge=np.concatenate([simplex_set.longest_edge[is_unsplit], longest_edge]),
        facet=np.concatenate([simplex_set.facet[is_unsplit], outer_facets]),
        parent=np.concatenate(
            [simplex_set.parent[is_unsplit], np.tile(simplex_set.parent[rows], 2)]
        ),
    )


# Children of a simplex by its nodes: vertices first, then midpoints in the order of local_edges.
_TRIANGLE = np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2), (3, 5, 4)])
_CORNERS = np.array([(0, 4, 5, 6), (4, 1, 7, 8), (5, 7, 2, 9), (6, 8, 9, 3)])
# The octahedron between the four corners: its diagonals, and the other midpoints around each.
_DIAGONALS = np.array([(4, 9), (5, 8), (6, 7)])
_AROUND = np.array([(5, 7, 8, 6), (4, 7, 9, 6), (4, 5, 9, 8)])
_TIE = 1e-6  # share by which a diagonal must be shorter to be taken instead of one before it


_MOST_CELLS = 10_000_000  # more do not fit into the memory of machines that solve them

Size = float | Callable[[Floats], ArrayLike]
_SizeRule = Either(Function(), Number(above=0, unit=LENGTH, hint="or a function f(x) of centres"))


@check_arguments(MeshError)
def refine(
    mesh: Annotated[Mesh, Part(Mesh)],
    cells: Annotated[ArrayLike | None, Array((None,), is_whole=True, unit=None)] = None,
    *,
    size: Annotated[Size | None, _SizeRule] = None,
) -> Mesh:
    """Make a mesh finer: everywhere, at some cells, or to a wanted size.

    Given neither `cells` nor `size`, every edge is split in two: triangles into four, tetrahedra
    into eight, whose inner octahedron is cut along its shortest diagonal, which keeps shapes from
    degrading when it is repeated (Zhang, 1995, Houston J. Math. 21, Successive subdivisions of
    tetrahedra). Else cells are bisected at their longest edge, and neighbours as far as it takes to
    conform (Rivara, 1984, Int. J. Numer. Meth. Eng. 20, 745): angles of triangles stay above half
    of the smallest one of the mesh. How points are numbered plays no part.

    New points of facet sets with a curve (`Mesh.curves`) are put onto it; of other sets they stay
    on the polygon. Where that would fold or flatten a cell, inner points around it move along; a
    point for which that does not help stays, and a warning counts them.

    Parameters
    ----------
    mesh : Mesh
    cells : (k,) array of int, optional
        Cells to bisect once: two bisections halve a triangle's edges, three a tetrahedron's.
    size : float or callable, length, optional
        Longest edge wanted: a number, or f(x) -> (n,), called with centres of cells (n, d); inf
        where any will do. Every cell of the result has edges no longer than the size at its
        centre, and none was bisected that had not longer ones, or a neighbour that had.

    Returns
    -------
    Mesh
        Conforming, the old points first, with the same facet and cell sets and curves.

    Raises
    ------
    MeshError
        Both `cells` and `size`, numbers of no cell, a size that is nan, not positive, or so small
        that there would be more than ten million cells, a curve that returns points elsewhere.

    Examples
    --------
    >>> from xcrack.mesh.box import box
    >>> coarse = box((0, 0), (1, 1), 1)
    >>> refine(coarse)
    Mesh(9 points, 8 triangles, facet sets: left, right, bottom, top, boundary)
    >>> refine(coarse, size=lambda x: 0.1 + np.linalg.norm(x, axis=1))
    Mesh(13 points, 14 triangles, facet sets: left, right, bottom, top, boundary)
    """
    if cells is not None and size is not None:
        raise MeshError("refine: give cells or size, not both.")
    if size is not None:
        return _to_size(mesh, _checked_size(mesh, size), None)
    return _split_all_edges(mesh) if cells is None else _cells_given(mesh, np.asarray(cells))


_DISTANCES = 2_000_000  # at once, between points and places


def growing_sizes(place: Floats, size: Floats, slope: float) -> Callable[[Floats], Floats]:
    """Sizes of cells at points that grow with the distance from places `(k, d)` by a slope."""

    def size_at(x: Floats) -> Floats:
        step = max(_DISTANCES // max(len(place), 1), 1)
        parts = [x[k : k + step] for k in range(0, len(x), step)]
        return np.concatenate([
            (size + slope * np.linalg.norm(part[:, None] - place, axis=2)).min(axis=1)
            for part in parts
        ])  # fmt: skip

    return size_at


# Sizes of cells around lines: room between lines, and sizes that grow with the distance.

_PLATEAU = 1.0  # cells around a front that are as small as those at it
_SLOPE = 0.7
_ROOM = 2.0  # cells between two fronts
_CLOSEST = 1 / 16  # of the size of a crack: less room is none
_LEVEL = 2.0**0.25  # sizes closer than this are taken for the smaller one


def points_between(lines: Sequence[Floats]) -> Floats:
    """Points of polylines `(n, 3)`, closer than their edges."""
    share = np.linspace(0, 1, 4)[:, None, None]
    parts = [(x[:-1] + share * (x[1:] - x[:-1])).reshape(-1, 3) for x in lines]
    return np.concatenate([np.zeros((0, 3)), *parts])


def radii(lines: Sequence[Floats], length_of_mean: float) -> Floats:
    """Radius of curvature at the points of `points_between`, from the turn over a length."""
    result = [np.zeros(0)]
    for x in lines:
        side = np.diff(x, axis=0)
        length = np.linalg.norm(side, axis=1)
        arc = np.concatenate([[0.0], np.cumsum(length)])
        middle, tangents = (arc[1:] + arc[:-1]) / 2, side / np.maximum(length, 1e-300)[:, None]
        if (x[0] == x[-1]).all():
            middle = np.concatenate([middle - arc[-1], middle, middle + arc[-1]])
            tangents = np.concatenate([tangents, tangents, tangents])
        s = (arc[:-1] + np.linspace(0, 1, 4)[:, None] * length).ravel()
        previous_tangent, next_tangent = (
            np.stack([np.interp(s + way, middle, part) for part in tangents.T], axis=1)
            for way in (-length_of_mean / 2, length_of_mean / 2)
        )
        cosine = np.einsum("ij,ij->i", previous_tangent, next_tangent)
        cosine /= (
            np.linalg.norm(previous_tangent, axis=1) * np.linalg.norm(next_tangent, axis=1) + 1e-300
        )
        result.append(length_of_mean / np.maximum(np.arccos(np.clip(cosine, -1, 1)), 1e-12))
    return np.concatenate(result)


def with_room(places: Sequence[Floats], sizes: Sequence[Floats]) -> list[Floats]:
    """Sizes at the places of each crack, less where those of another one are close."""
    result = []
    for c, (x, size) in enumerate(zip(places, sizes, strict=True)):
        other_places = np.concatenate([np.zeros((0, 3)), *places[:c], *places[c + 1 :]])
        distance = (
            cKDTree(other_places).query(x)[0]
            if len(other_places) and len(x)
            else np.full(len(x), np.inf)
        )
        result.append(np.minimum(size, np.maximum(distance / _ROOM, _CLOSEST * size)))
    return result


def graded_sizes(places: Sequence[Floats], sizes: Sequence[Floats]) -> Callable[[Floats], Floats]:
    """Longest edges wanted at points, from those at places `(n, 3)` of each crack."""
    trees = []
    for x, size in zip(places, sizes, strict=True):
        if not len(x):
            continue
        level = np.floor(np.log(size.max() / size) / np.log(_LEVEL) + 1e-9)
        for step in np.unique(level):
            is_of_step = level == step
            trees.append((cKDTree(x[is_of_step]), float(size[is_of_step].min())))

    def wanted_size(x: Floats) -> Floats:
        local_h = [h + _SLOPE * np.maximum(tree.query(x)[0] - _PLATEAU * h, 0) for tree, h in trees]
        return np.asarray(np.min(local_h, axis=0)) if local_h else np.full(len(x), np.inf)

    return wanted_size


def refine_to(mesh: Mesh, size_at: Floats, sweeps: int) -> Mesh:
    """Bisect cells until their edges are no longer than wanted of the cell in which they lie.

    Parameters
    ----------
    mesh : Mesh
    size_at : (m,) array, length
        Longest edge wanted in each cell of the mesh.
    sweeps : int
        Most bisections of a cell, but for those of its neighbours.

    Returns
    -------
    Mesh
        As of `refine`.
    """
    return _to_size(mesh, lambda centre, parent: size_at[parent], sweeps)


def _cells_given(mesh: Mesh, cells: Ints) -> Mesh:
    if cells.size and (cells.min() < 0 or cells.max() >= len(mesh.cells)):
        raise MeshError(
            f"refine: cells names {int(cells.min() if cells.min() < 0 else cells.max())}; the mesh "
            f"has {len(mesh.cells)} cells, numbered from 0."
        )
    if not cells.size:
        return mesh
    is_marked = np.zeros(len(mesh.cells), dtype=bool)
    is_marked[cells] = True
    flat_points = np.zeros(0, dtype=np.int64)
    simplex_set, _, _, flat_points = _sweep(mesh, simplices(mesh), is_marked, flat_points)
    warn_of_flat_points(simplex_set.points, flat_points)
    return _finished_mesh(mesh, simplex_set)


def _to_size(mesh: Mesh, size_at: Callable[[Floats, Ints], Floats], sweeps: int | None) -> Mesh:
    """Bisect until every cell is as small as wanted of its centre and its parent."""
    simplex_set = simplices(mesh)
    limit = np.asarray(size_at(simplex_set.centre, simplex_set.parent))
    sweeps_done, flat_points = 0, np.zeros(0, dtype=np.int64)
    while sweeps is None or sweeps_done < sweeps:
        is_marked = simplex_set.size > limit
        if not is_marked.any():
            break
        simplex_set, is_old, is_unsplit_cell, flat_points = _sweep(
            mesh, simplex_set, is_marked, flat_points
        )
        # A size is asked for once, of cells that are new or whose points have moved.
        limit = np.concatenate(
            [limit[is_old], np.zeros(len(simplex_set.cells) - len(limit[is_old]))]
        )
        is_new = ~is_unsplit_cell
        limit[is_new] = size_at(simplex_set.centre[is_new], simplex_set.parent[is_new])
        sweeps_done += 1
    warn_of_flat_points(simplex_set.points, flat_points)
    return _finished_mesh(mesh, simplex_set) if sweeps_done else mesh


def _checked_size(mesh: Mesh, size: Size) -> Callable[[Floats, Ints], Floats]:
    """Wanted size of cells, checked as it is asked for."""
    label, least_size = "the size of refine", FINEST * mesh.extent
    function = size if callable(size) else None

    def size_at(centre: Floats, parent: Ints) -> Floats:
        sizes = size if function is None else call_function(function, label, centre.copy())
        value = numbers(sizes, label, must_be_finite=False, error=MeshError)
        if value.shape not in ((), (len(centre),)):
            raise MeshError(
                f"{label} has the shape {value.shape} at {len(centre)} centres: return one number "
                "for each."
            )
        value = np.broadcast_to(value, len(centre))
        is_invalid = ~(value >= least_size)
        if is_invalid.any():
            i = int(np.argmax(is_invalid))
            raise MeshError(
                f"{label} is {value[i]:g} at {at(centre[i])} ({int(is_invalid.sum())} such cells): "
                f"it must be a length, no less than a millionth of the body ({least_size:.3g})."
            )
        return value

    return size_at


def _sweep(
    mesh: Mesh, simplex_set: Simplices, is_marked: Bools, flat_points: Ints
) -> tuple[Simplices, Bools, Bools, Ints]:
    """One sweep of bisections, its new points on their curves.

    Parameters
    ----------
    mesh : Mesh
    simplex_set : Simplices
    is_marked : (m,) array of bool
    flat_points : (k,) array of int
        Points that earlier sweeps left off their curves: smaller cells may let them go.

    Returns
    -------
    simplex_set : Simplices
    is_old : (m,) array of bool
        Which of the cells before are still there; they come first.
    is_unsplit_cell : (m',) array of bool
        Which of the cells now are those, with their points where they were.
    flat_points : (k,) array of int
    """
    first = len(simplex_set.points)
    fine_set, is_old = bisect_simplices(simplex_set, is_marked)
    if len(fine_set.cells) > _MOST_CELLS:
        raise MeshError(
            f"refine: the size asks for more than {_MOST_CELLS:.0e} cells "
            f"({len(fine_set.cells)} and more to come): enlarge it."
        )
    is_unsplit_cell = np.arange(len(fine_set.cells)) < int(is_old.sum())
    if mesh.curves:
        sets = {
            name: _parts(fine_set, mesh.facet_numbers(mesh.facet_sets[name]))
            for name in mesh.curves
        }
        boundary = _parts(fine_set, np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0])
        is_new = np.arange(len(fine_set.points)) >= first
        is_new[flat_points] = True
        size = longest_edge(mesh.points, (mesh.facet_sets[name] for name in mesh.curves))
        points, is_changed, flat_points = on_curves(
            fine_set.points, fine_set.cells, is_new, sets, boundary, mesh.curves, size
        )
        if is_changed.any():
            fine_set = moved_simplices(fine_set, points)
            is_unsplit_cell &= ~is_changed[fine_set.cells].any(axis=1)
    return fine_set, is_old, is_unsplit_cell, flat_points


def _parts(simplex_set: Simplices, facets: Ints) -> Ints:
    """Facets of the simplices in which facets of the mesh were split `(k, d)`."""
    is_in_set = np.zeros(
        max(int(simplex_set.facet.max()), int(facets.max(initial=0))) + 2, dtype=bool
    )
    is_in_set[facets] = True  # the last entry is that of no facet
    cell, corner = np.nonzero(is_in_set[simplex_set.facet])
    return np.take_along_axis(
        simplex_set.cells[cell], local_facets(simplex_set.points.shape[1])[corner], axis=1
    )


def _finished_mesh(mesh: Mesh, simplex_set: Simplices) -> Mesh:
    """The simplices as a mesh with the sets and curves of the one they were made from."""
    order = np.argsort(simplex_set.parent, kind="stable")
    begin = np.searchsorted(simplex_set.parent[order], np.arange(len(mesh.cells) + 1))

    def members_inside(members: Ints) -> Ints:
        row, place = ranges(begin[members + 1] - begin[members])
        return order[begin[members][row] + place]

    facets = {
        name: _parts(simplex_set, mesh.facet_numbers(facets))
        for name, facets in mesh.facet_sets.items()
    }
    cells = {name: members_inside(members) for name, members in mesh.cell_sets.items()}
    return sound_mesh(simplex_set.points, simplex_set.cells, facets, cells, mesh.curves)


def _split_all_edges(mesh: Mesh) -> Mesh:
    """Every edge split in two."""
    points = node_points(mesh, 2)
    nodes = cell_nodes(mesh, 2)
    cells, parent = (_triangles, _tetrahedra)[mesh.dim - 2](points, nodes)
    inverse = np.argsort(parent, kind="stable").reshape(len(mesh.cells), -1)
    facets = {name: _facet_parts(mesh, facets) for name, facets in mesh.facet_sets.items()}
    curved_facets = {name: facets[name] for name in mesh.curves}
    if curved_facets:
        boundary = facets["boundary"]
        is_new = np.arange(len(points)) >= mesh.n_points
        size = longest_edge(mesh.points, (mesh.facet_sets[name] for name in curved_facets))
        points, _, flat_points = on_curves(
            points, cells, is_new, curved_facets, boundary, mesh.curves, size
        )
        warn_of_flat_points(points, flat_points)
    members = {name: inverse[members].ravel() for name, members in mesh.cell_sets.items()}
    return sound_mesh(points, cells, facets, members, mesh.curves)


def _triangles(points: Floats, nodes: Ints) -> tuple[Ints, Ints]:
    """Children `(4 m, 3)` and the cell that each lies in."""
    return nodes[:, _TRIANGLE].reshape(-1, 3), np.repeat(np.arange(len(nodes)), 4)


def _tetrahedra(points: Floats, nodes: Ints) -> tuple[Ints, Ints]:
    """Children `(8 m, 4)` and the cell that each lies in."""
    ends = points[nodes[:, _DIAGONALS]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
    # Of diagonals that are equal but for round-off the first is taken, wherever the body lies.
    kind = np.argmax(length <= length.min(axis=1, keepdims=True) * (1 + _TIE), axis=1)
    ring = _AROUND[kind]
    inner_cells = [
        np.stack([*_DIAGONALS[kind].T, ring[:, i], ring[:, (i + 1) % 4]], axis=1) for i in range(4)
    ]
    local_corners = np.concatenate(
        [np.broadcast_to(_CORNERS, (len(nodes), 4, 4)), np.stack(inner_cells, axis=1)], axis=1
    )
    children = np.take_along_axis(nodes[:, None], local_corners, axis=2)
    return children.reshape(-1, 4), np.repeat(np.arange(len(nodes)), 8)


def _facet_parts(mesh: Mesh, facets: Ints) -> Ints:
    """Parts of facets: two of an edge, four of a triangle."""
    if not len(facets):
        return facets
    nodes = facet_nodes(mesh, 2, facets)
    parts = (np.array([(0, 2), (2, 1)]), _TRIANGLE)[mesh.dim - 2]
    return np.asarray(nodes[:, parts].reshape(-1, mesh.dim))


__all__ = [
    "Simplices",
    "bisect_simplices",
    "graded_sizes",
    "growing_sizes",
    "moved_simplices",
    "points_between",
    "refine",
    "refine_to",
    "simplices",
    "with_room",
]
