"""Multifrontal Cholesky factorisation on the tree of the mesh, and only of what has changed.

Cells are halved across a long side, where few points lie on the cut, until eight are left; an
unknown belongs to the lowest part of that tree that holds its whole support (nested dissection,
George 1973, by geometry).
Unknowns couple where they share a cell, so every coupling lies on one path to the root, whatever
basis the enriched unknowns are in, and the tree serves every crack in the mesh. A part whose own
entries and whose children are the same bits as before has the same panel: it is taken over.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.machine import map_tasks, one_blas_thread
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cell_nodes

_LEAF = 8  # cells of a part that is not halved any more
_UNIT = 4  # levels of a subtree that is factored as a whole or not at all: 128 cells
_SHARED = 4  # levels above the subtrees that threads take
_LEAST = 100_000  # entries of a matrix below which handing subtrees over costs more than it saves
_FEW = 3  # right-hand sides up to which each is quicker alone
_SPREAD = 2.2  # times the numbers in use that arrays of earlier factorisations may hold
_MOST = 1 << 27  # entries of update matrices, 1 GB, above which larger subtrees are the unit


@dataclass(frozen=True, eq=False)
class Tree:
    """Halves of a mesh, and the part that each node belongs to.

    Attributes
    ----------
    mesh : Mesh
    order : int
        Of the shape functions.
    node_to_part : (n_nodes,) array of int
        Heap numbers: 1 is the whole mesh, 2 p and 2 p + 1 are the halves of p.
    postorder, rank, height : arrays of int
        Parts, children first; the place of each part; the levels below the part at each place.
    """

    mesh: Mesh
    order: int
    node_to_part: Ints
    postorder: Ints
    rank: Ints
    height: Ints


def tree(mesh: Mesh, order: int) -> Tree:
    """Halve a mesh; the same mesh gives the same tree on every machine.

    Parameters
    ----------
    mesh : Mesh
    order : int
    """
    from xcrack.linalg.kernels.multifrontal import bisect_cells, node_parts, postorder

    centre = mesh.cell_middles
    depth = max(0, int(np.ceil(np.log2(len(mesh.cells) / _LEAF))))
    ranking = np.stack([np.argsort(x, kind="stable") for x in centre.T])
    leaf = bisect_cells(ranking, centre, mesh.cells, mesh.n_points, depth)
    nodes = np.ascontiguousarray(cell_nodes(mesh, order))
    part = node_parts(nodes, leaf, depth, int(nodes.max()) + 1)
    return Tree(mesh, order, lock(part), *map(lock, postorder(depth)))


@dataclass(frozen=True, eq=False)
class Factor:
    """A factored symmetric positive matrix.

    Attributes
    ----------
    tree : Tree
    perm : (n,) array of int
        Unknown at each permuted place.
    first_unknown : (parts + 1,) array of int
        First permuted unknown of each part.
    begin, boundary, in_parent : arrays of int
        Rows below each part, and their places in its parent's front.
    start, row, value : arrays
        Entries of the matrix by their place in a front.
    panel, update : (parts,) arrays of uint64
        Addresses of the columns of each part, and of its update matrix where that is kept for the
        next factorisation.
    memory : tuple of arrays
        What the addresses lie in: numbers of this factorisation, and of earlier ones.
    n_numbers : int
        Numbers in them that belong to this factor.
    subtree_levels : int
        Levels of the subtrees that are factored as a whole; -1 where nothing is kept for the next.
    """

    tree: Tree
    perm: Ints
    first_unknown: Ints
    begin: Ints
    boundary: Ints
    in_parent: Ints
    start: Ints
    row: Ints
    value: Floats
    panel: Ints
    update: Ints
    memory: tuple[Floats, ...]
    n_numbers: int
    subtree_levels: int

    @property
    def fronts(self) -> tuple[Any, ...]:
        """What the kernels need to assemble fronts."""
        tree = self.tree
        return (
            self.first_unknown, self.begin, self.in_parent, self.start, self.row, self.value,
            tree.postorder, tree.rank,
        )  # fmt: skip

    def solve(self, b: Floats) -> Floats:
        """Solution for right-hand sides `(n,)` or `(n, r)`."""
        return self._unpermute(self._halves(self._permute(b), True, True), b.shape)

    def solve_lower(self, b: Floats) -> Floats:
        """L^-1 P b for right-hand sides `(n, r)`, in permuted order."""
        return self._halves(self._permute(b), True, False)

    def forward_sparse(self, B: sp.csr_matrix) -> tuple[Floats, Ints]:
        """L^-1 P B^T for sparse rows B `(r, n)`: the rows that are not zero, and their places."""
        inverse = np.empty(len(self.perm), dtype=np.int64)
        inverse[self.perm] = np.arange(len(self.perm))
        place = inverse[B.indices]
        X = np.zeros((len(self.perm), B.shape[0]))
        X[place, np.arange(B.shape[0]).repeat(np.diff(B.indptr))] = B.data
        part = np.repeat(np.arange(len(self.first_unknown) - 1), np.diff(self.first_unknown))
        is_touched = np.zeros(len(self.first_unknown) - 1, dtype=bool)
        is_touched[part[place]] = True
        self._halves(X, True, False, is_touched)
        rows = np.nonzero(is_touched[part])[0]
        return X[rows], rows

    def solve_upper(self, y: Floats) -> Floats:
        """Solution from its forward half `(n, r)`."""
        return self._unpermute(self._halves(np.array(y), False, True), y.shape)

    def _permute(self, b: Floats) -> Floats:
        return np.ascontiguousarray(b.reshape(len(b), -1)[self.perm])

    def _unpermute(self, X: Floats, shape: tuple[int, ...]) -> Floats:
        x = np.empty_like(X)
        x[self.perm] = X
        return x.reshape(shape)

    def _halves(
        self, X: Floats, is_forward: bool, is_backward: bool, is_touched: Bools | None = None
    ) -> Floats:
        from xcrack.linalg.kernels.multifrontal import substitute, substituted_one

        if X.shape[1] <= _FEW and is_touched is None:
            columns = np.ascontiguousarray(X.T)
            with one_blas_thread():
                for x in columns:
                    substituted_one(
                        self.first_unknown,
                        self.begin,
                        self.boundary,
                        self.panel,
                        x,
                        is_forward,
                        is_backward,
                    )
            return np.ascontiguousarray(columns.T)
        if is_touched is None:
            is_touched = np.ones(len(self.first_unknown) - 1, dtype=bool)
        tree = self.tree
        with one_blas_thread():
            substitute(
                self.first_unknown, self.begin, self.boundary, tree.postorder, tree.rank,
                self.panel, X, is_touched, is_forward, is_backward,
            )  # fmt: skip
        return X


def factorise(
    A: sp.csc_matrix,
    columns: tuple[Ints, Ints, int, Ints, int],
    tree: Tree,
    previous_factor: Factor | None = None,
    keep: bool = False,
) -> Factor | None:
    """Factor a symmetric matrix; None where it is not positive definite.

    Parameters
    ----------
    A : sparse matrix (n, n)
        CSC, both triangles.
    columns : indptr, indices, n, owner, d
        Rows of the basis that A belongs to, CSR, and its number of columns; the node of each
        function, and the number of components.
    tree : Tree
    previous_factor : Factor, optional
        Of an earlier crack on the same tree, made to be kept.
    keep : bool
        Keep what the next factorisation may take over.
    """
    from xcrack.linalg.kernels.multifrontal import (
        arrange_parts,
        order_columns,
        places_of_squares,
        sizes,
        unchanged_parts,
    )

    order, rank, height = tree.postorder, tree.rank, tree.height
    perm, place, first = order_columns(*columns, tree.node_to_part, rank)
    begin, boundary, in_parent, start, row, value = arrange_parts(
        A.indptr, A.indices, A.data, first, order, rank, perm, place
    )
    fronts = first, begin, in_parent, start, row, value, order, rank
    panel_size, update_size = sizes(first, begin)
    depth = int(height[-1])
    # Update matrices of parts with that many levels below are kept for the next factorisation.
    lowest_height = min(_UNIT, depth)
    while lowest_height <= depth and update_size[height >= lowest_height].sum() > _MOST:
        lowest_height += 1
    level = min(max(depth - _SHARED, lowest_height), depth)
    is_packed = (height >= lowest_height) | (height == level) if keep else height == level
    place, *stacks = places_of_squares(order, rank, begin, height, is_packed, level)
    own_size = np.where(is_packed, update_size, 0)
    memory_in_use = int(panel_size.sum() + (own_size.sum() if keep else 0))
    chosen_parts = np.ones(len(order), dtype=bool)
    previous_memory: tuple[Floats, ...] = ()
    if (
        keep
        and previous_factor is not None
        and previous_factor.tree is tree
        and previous_factor.subtree_levels == lowest_height <= depth
    ):
        chosen_parts = _parts_to_factor(
            ~unchanged_parts(fronts, previous_factor.fronts), order, rank, height, lowest_height
        )
        previous_memory = previous_factor.memory
    panels, panel = _room(np.where(chosen_parts, panel_size, 0))
    updates, update = _room(np.where(chosen_parts, own_size, 0))
    if previous_memory and previous_factor is not None:
        panel = np.where(chosen_parts, panel, previous_factor.panel)
        update = np.where(chosen_parts, update, previous_factor.update)
    if _factor_subtrees(
        fronts, panel, update, (place, is_packed, height, chosen_parts), stacks, level
    ):
        return None
    memory = (*previous_memory, lock(panels), lock(updates)) if keep else (lock(panels),)
    if sum(len(part) for part in memory) > _SPREAD * memory_in_use:
        panels, panel = _gather_numbers(panel, panel_size)
        updates, update = _gather_numbers(update, own_size)
        memory = (lock(panels), lock(updates))
    return Factor(
        tree, lock(perm), lock(first), lock(begin), lock(boundary), lock(in_parent), lock(start),
        lock(row), lock(value), lock(panel), lock(update), memory, memory_in_use,
        lowest_height if keep else -1,
    )  # fmt: skip


def _factor_subtrees(
    fronts: tuple[Any, ...],
    panel: Ints,
    update: Ints,
    parts: tuple[Ints, Bools, Ints, Bools],
    stacks: list[int],
    level: int,
) -> bool:
    """Factor subtrees side by side, then what is above them; whether a pivot was not positive.

    `parts` are the places of update matrices in stacks, whether they are kept, heights, and which
    parts to factor.
    """
    from xcrack.linalg.kernels.multifrontal import factor_parts

    place, is_packed, height, chosen_parts = parts
    square = np.zeros(len(place), dtype=np.uint64)
    free_rooms: list[Floats] = []

    def factor(part_mask: Bools, begin: int, end: int, room: Floats) -> int:
        square[begin:end] = np.where(
            part_mask[begin:end], room.ctypes.data + 8 * place[begin:end], square[begin:end]
        )
        return int(factor_parts(fronts, panel, update, square, is_packed, part_mask, begin, end))

    def subtree(root: int) -> int:
        begin, end = root + 2 - (2 << level), root + 1
        if not chosen_parts[begin:end].any():
            return 0
        room = free_rooms.pop() if free_rooms else np.empty(stacks[0])
        has_failed = factor(chosen_parts, begin, end, room)
        free_rooms.append(room)
        return has_failed

    with one_blas_thread():
        roots = np.nonzero(height == level)[0].tolist()
        has_few_parts = len(fronts[5]) < _LEAST
        if any(map(subtree, roots) if has_few_parts else map_tasks(subtree, roots)):
            return True
        is_above = chosen_parts & (height > level)
        return bool(is_above.any() and factor(is_above, 0, len(height), np.empty(stacks[1])))


def _room(size: Ints) -> tuple[Floats, Any]:
    """An array of zeros for numbers of parts, and the address of those of each."""
    numbers = np.zeros(int(size.sum()))
    begin = np.concatenate([[0], np.cumsum(size)[:-1]]).astype(np.uint64)
    return numbers, np.uint64(numbers.ctypes.data) + np.uint64(8) * begin


def _gather_numbers(old_memory: Ints, size: Ints) -> tuple[Floats, Any]:
    """The numbers of all parts copied into one array, and their addresses."""
    from xcrack.linalg.kernels.multifrontal import copy_stretches

    numbers, new_memory = _room(size)
    copy_stretches(old_memory, new_memory, size)
    return numbers, new_memory


def _parts_to_factor(
    is_changed: Bools, order: Ints, rank: Ints, height: Ints, lowest_height: int
) -> Bools:
    """Parts to factor again: those that changed, their ancestors, and whole units of them."""
    chosen_parts = np.array(is_changed)
    p = order[np.nonzero(chosen_parts)[0]]
    while len(p):
        chosen_parts[rank[p]] = True
        p = np.unique(p[p > 1] >> 1)
    # A unit's root stands for all of it.
    ancestors = order.copy()
    is_low = height < lowest_height
    steps = np.where(is_low, lowest_height - height, 0)
    return np.asarray(chosen_parts[rank[ancestors >> steps]])
