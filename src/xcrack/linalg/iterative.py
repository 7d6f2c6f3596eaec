"""The iterative engine for large bodies in 3D: conjugate gradients with a multigrid cycle.

Its basis are the standard unknowns of the uncracked body, whose matrix gets a border of orthonormal
enriched columns. It needs no factor: memory and time grow with the number of unknowns, and the
levels below the finest one serve every crack in a mesh.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, lock, ranges
from xcrack.fem.assembly import Bulk, Stiffness
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.basis import (
    Blocks,
    node_blocks,
    orthonormal_functions,
    patch_orthogonal,
)
from xcrack.linalg.engine import (
    CondensedSystem,
    ContactRows,
    SolveCount,
    SolverState,
    StateContact,
    proportional_columns,
)
from xcrack.linalg.multigrid import Hierarchy, extended_cycle, hierarchy, star_patches
from xcrack.linalg.products import BorderedFactor, product, row_blocks
from xcrack.linalg.projected_cg import (
    TOLERANCE,
    Iteration,
    Operator,
    ProjectedState,
    Request,
    conjugate_gradients_steps,
    in_lockstep,
    projected_steps,
)

_NEARLY = 1e-5  # share of a load beside the combinations of others, up to which those come first


# The basis, and the stiffness in it: the body's with a border.


def enriched_basis(
    space: FunctionSpace,
    K: sp.csr_matrix,
    blocks: Blocks,
    levels: Hierarchy,
    modes: sp.csr_matrix | None,
) -> tuple[sp.csc_matrix, Ints, Ints]:
    """Orthonormal enriched columns, node by node, the first column of each node, and their blocks.

    Their diagonal entries are made the mean one of the standard unknowns: the norm of a residual
    then weighs both alike.
    """
    if modes is not None:
        K = nearby_unknowns(K, modes, blocks)
    Z = sp.csc_matrix(orthonormal_functions(K, blocks))
    owner = np.repeat(np.arange(len(blocks.n_standard)), np.diff(blocks.offsets))
    block_of = np.full(space.n_dof, -1, dtype=np.int64)
    block_of[blocks.members] = owner
    node = block_of[Z.indices[Z.indptr[:-1]]]
    order = np.argsort(node, kind="stable")
    size = np.sqrt(levels.diagonal.mean())
    Z = sp.csc_matrix(Z[:, order] * size)
    Z = Z if modes is None else sp.csc_matrix(modes @ Z)
    node = node[order]
    starts = np.nonzero(np.concatenate([[True], node[1:] != node[:-1]]))[0] if len(node) else node
    return Z, starts, node


@dataclass(frozen=True, eq=False)
class Parts:
    """Stiffness in the solver's basis: that of the uncracked body with a border.

    Attributes
    ----------
    levels : Hierarchy
    K : sparse matrix (n_dof, n_dof)
    body_unknowns : (n,) array of int
        Unknowns of the hierarchy.
    coupling : sparse matrix (n, e)
        Between them and the enriched columns, CSR.
    enriched_block : sparse matrix (e, e)
    """

    levels: Hierarchy
    K: sp.csr_matrix
    body_unknowns: Ints
    coupling: sp.csr_matrix
    enriched_block: sp.csr_matrix

    @property
    def diagonal(self) -> Floats:
        """Of the whole matrix."""
        return np.concatenate([self.levels.diagonal, self.enriched_block.diagonal()])

    def border_factor(self, starts: Ints) -> BorderedFactor:
        """The whole matrix; `starts` are the first columns of the enriched nodes."""
        first = np.concatenate([starts, [self.enriched_block.shape[0]]])
        return BorderedFactor(
            self.levels.matrix,
            row_blocks([self.coupling], self.levels.matrix.first_row),
            row_blocks([self.coupling.T.tocsr(), self.enriched_block], first),
        )

    def entries(self, unknowns: Ints) -> sp.csr_matrix:
        """Entries between free unknowns, given sorted."""
        n = len(self.body_unknowns)
        standard, enriched_numbers = unknowns[unknowns < n], unknowns[unknowns >= n] - n
        standard_entries = self.body_unknowns[standard]
        coupling = self.coupling[standard][:, enriched_numbers]
        parts = [
            [self.K[standard_entries][:, standard_entries], coupling],
            [coupling.T, self.enriched_block[enriched_numbers][:, enriched_numbers]],
        ]
        return sp.csr_matrix(sp.bmat(parts))


def parts_of(levels: Hierarchy, K: sp.csr_matrix, standard: Ints, basis: sp.csc_matrix) -> Parts:
    """Stiffness between the unknowns of a hierarchy and enriched columns."""
    image = product(K, sp.csr_matrix(basis))
    enriched_block = product(sp.csr_matrix(basis.T), image)
    coupling = image[standard]
    if not levels.is_free.all():
        coupling = sp.csr_matrix(sp.diags(levels.is_free.astype(float)) @ coupling)
    return Parts(levels, K, standard, coupling, enriched_block)


def nearby_unknowns(K: sp.csr_matrix, change: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """Stiffness in a changed basis: entries between the unknowns of blocks."""
    members = np.unique(blocks.members)
    columns = sp.csc_matrix(change[:, members])
    neighbours = np.unique(columns.indices)
    columns = columns[neighbours]
    entries = sp.coo_matrix(columns.T @ (K[neighbours][:, neighbours] @ columns))
    return sp.csr_matrix(
        (entries.data, (members[entries.row], members[entries.col])), shape=K.shape
    )


def within_blocks(K: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """Entries of a matrix between the unknowns of one block."""
    from xcrack.linalg.kernels.sparse import dense_blocks

    values = dense_blocks(K.indptr, K.indices, K.data, blocks.members, blocks.offsets)
    size = np.diff(blocks.offsets)
    block, place = ranges(size**2)
    row, column = np.divmod(place, size[block])
    first = blocks.offsets[block]
    triplets = (values, (blocks.members[first + row], blocks.members[first + column]))
    return sp.csr_matrix(triplets, shape=K.shape)


# The system.

_ROUGH = 0.02  # residual of a first solution that only shows which faces overlap
_LEAST_SHARE = 1e-4  # of the load, to which forces are resolved; round-off forbids much less
_MULTIPLE = 1e-13  # share of the largest entry up to which a load is another one, scaled
_COLUMNS = 64  # of the dual matrix that are solved for at a time


@dataclass(frozen=True, eq=False)
class IterativeSystem:
    """A system that is solved by conjugate gradients.

    Attributes
    ----------
    matrix : Stiffness or sparse matrix (n_dof, n_dof)
        In the basis of the space.
    node_entries : sparse matrix (n_dof, n_dof), optional
        Its entries between the unknowns of one node; made of the matrix where they are not given.
    is_free : (n_dof,) array of bool
    basis : sparse matrix (n_dof, k)
        Columns of the solver's basis; zero in the rows of known unknowns.
    hierarchy : Hierarchy
        Serves the next crack in the same mesh too.
    operator : Operator
    blocks : Blocks
        Unknowns of each enriched node.
    block_basis, back : sparse matrices (n_dof, n_dof), optional
        Basis to which the blocks belong where it is not that of the space, and its inverse.
    count : SolveCount
    """

    matrix: sp.csr_matrix | Stiffness
    node_entries: sp.csr_matrix | None
    is_free: Bools
    basis: sp.csr_matrix
    hierarchy: Hierarchy
    operator: Operator
    blocks: Blocks
    block_basis: sp.csr_matrix | None = None
    inverse_basis: sp.csr_matrix | None = None
    count: SolveCount = field(default_factory=SolveCount)
    shared_part: str = "multigrid hierarchy"
    reason: str = "conjugate gradients: a large body in 3D"

    def solve(
        self,
        f: Floats,
        u_imposed: Floats | None = None,
        start: Floats | None = None,
        tolerance: float = TOLERANCE,
    ) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape.

        Parameters
        ----------
        f, u_imposed : arrays
        start : array of the same shape, optional
            First guess of the displacements.
        tolerance : float
            Residual relative to the load at which to stop.
        """
        columns = f.reshape(len(f), -1)
        u_columns = (
            np.zeros_like(columns) if u_imposed is None else u_imposed.reshape(columns.shape)
        )
        b, known_of = _vectors(self._loads_on_unknowns(columns, u_columns)), _vectors(u_columns)
        y: list[Floats] = [np.zeros_like(load) for load in b]
        if start is not None:
            y = _vectors(self.coordinates(start.reshape(columns.shape) - u_columns))
        first = independent_columns(b)
        other_columns = [k for k in range(len(b)) if k not in first]
        self._solve_apart(first, b, known_of, y, tolerance)
        guesses = best_guesses(self.operator, [y[k] for k in first], [b[k] for k in other_columns])
        for k, guess in zip(other_columns, guesses, strict=True):
            y[k] = guess
        self._solve_apart(other_columns, b, known_of, y, tolerance)
        return np.asarray(u_columns + self.basis @ np.stack(y, axis=1)).reshape(f.shape)

    def first_look(
        self, f: Floats, u_imposed: Floats, closed_before: bool
    ) -> tuple[Floats | None, bool]:
        """Rough displacements, as few steps as show which faces overlap; none after closed sets."""
        if closed_before:
            return None, False
        return self.solve(f, u_imposed, tolerance=_ROUGH), False

    def contact(
        self,
        rows: ContactRows,
        f: Floats,
        u_imposed: Floats,
        start: Sequence[Bools | None],
        last_solution: Floats | None = None,
        u_opened: Floats | None = None,
    ) -> list[StateContact]:
        """Solve load states with crack faces that may touch; see `Engine`.

        Without a first set, that of the groups that overlap in the latest displacements is the
        best guess. Without displacements each state starts from those before it.
        """
        del u_opened
        rows_in_basis = sp.csr_matrix(rows.N @ self.basis)
        b = _vectors(self._loads_on_unknowns(f, u_imposed))
        gaps = _vectors(rows.N @ u_imposed)
        y = [np.zeros_like(load) for load in b]
        if last_solution is not None:
            y = _vectors(self.coordinates(last_solution - u_imposed))
        # What a pressure closes, a multiple of the load closes too, and nothing else.
        right_hand_sides = np.concatenate([np.stack(b, axis=1), u_imposed])
        row_alike, scale = proportional_columns(right_hand_sides, _MULTIPLE)
        states: dict[int, ProjectedState] = {}
        for state_numbers in _in_turn(row_alike, scale):
            runs = []
            for k in state_numbers:
                model = states.get(int(row_alike[k]))
                first = start[k]
                if model is not None:
                    y[k], first = scale[k] * model.y, model.active
                is_active = rows_in_basis @ y[k] + gaps[k] < 0 if first is None else first
                conditions = rows_in_basis, gaps[k], rows.measure, rows.stiffness
                runs.append(
                    self._solve_with_rows(b[k], u_imposed[:, k], conditions, is_active, y[k])
                )
            for k, state in zip(state_numbers, in_lockstep(self.operator, runs), strict=True):
                states[k] = state
                self._count_steps(state.iterations)
        return [
            StateContact(s.pressure, s.gap, s.active, s.sets, u_imposed[:, k] + self.basis @ s.y)
            for k, s in sorted(states.items())
        ]

    def condense(self, N: sp.csr_matrix, f: Floats, u_imposed: Floats) -> CondensedSystem:
        """The system as rows see it; see `Engine`. A solve for each row."""
        without_contact = self.solve(f, u_imposed)
        F = np.empty((N.shape[0], N.shape[0]))
        for k in range(0, len(F), _COLUMNS):
            loads = N[k : k + _COLUMNS].toarray().T
            F[:, k : k + _COLUMNS] = N @ self.solve(loads, start=np.zeros_like(loads))
        return CondensedSystem(
            (F + F.T) / 2,
            N @ without_contact,
            lambda lam: self.solve(f + N.T @ lam, u_imposed, without_contact),
        )

    def handed_on(self, reuse: SolverState) -> SolverState:
        """With the levels of the mesh."""
        return replace(reuse, hierarchy=self.hierarchy)

    def _loads_on_unknowns(self, f: Floats, u_imposed: Floats) -> Floats:
        """Loads `(n_dof, k)` on the unknowns of the solver."""
        return np.asarray(self.basis.T @ (f - self.matrix @ u_imposed if u_imposed.any() else f))

    def _solve_apart(
        self,
        state_numbers: Sequence[int],
        b: Sequence[Floats],
        u_imposed: Sequence[Floats],
        y: list[Floats],
        tolerance: float,
    ) -> None:
        """Put solutions of some states in the place of their guesses."""
        runs = [self._solve_by_column(b[k], u_imposed[k], y[k], tolerance) for k in state_numbers]
        for k, (column, steps) in zip(state_numbers, in_lockstep(self.operator, runs), strict=True):
            y[k] = column
            self._count_steps(steps)

    def _count_steps(self, steps: int) -> None:
        self.count.solves += 1
        self.count.iterations += steps

    def _solve_by_column(
        self, b: Floats, u_imposed: Floats, start: Floats, tolerance: float
    ) -> Iteration[tuple[Floats, int]]:
        y, steps = yield from conjugate_gradients_steps(self.operator, b, start, tolerance)
        share = self._share(y, b, u_imposed)
        if share < 1:
            y, further_steps = yield from conjugate_gradients_steps(
                self.operator, b, y, share * tolerance
            )
            steps += further_steps
        return y, steps

    def _solve_with_rows(
        self,
        b: Floats,
        u_imposed: Floats,
        rows: tuple[sp.csr_matrix, Floats, Floats, float],
        is_active: Bools,
        y: Floats,
    ) -> Iteration[ProjectedState]:
        state = yield from projected_steps(self.operator, b, *rows, is_active, y, TOLERANCE)
        share = self._share(state.y, b, u_imposed)
        if share == 1:
            return state
        further = yield from projected_steps(
            self.operator, b, *rows, state.active, state.y, share * TOLERANCE
        )
        sets, steps = state.sets + further.sets - 1, state.iterations + further.iterations
        return replace(further, sets=sets, iterations=steps)

    def _share(self, y: Floats, b: Floats, u_imposed: Floats) -> float:
        """Size of the forces in the body relative to b.

        Imposed displacements act through b on the cells next to the support alone, as if the rest
        did not give way: b is then far larger than the forces that are looked for.
        """
        if not u_imposed.any():
            return 1.0
        forces = (self.matrix @ (u_imposed + self.basis @ y))[: len(self.hierarchy.is_fixed)]
        size = float(np.sqrt(np.einsum("i,i", b, b)))
        share = float(np.sqrt(np.einsum("i,i", forces, forces))) / size if size > 0 else 1.0
        return min(1.0, max(share, _LEAST_SHARE))

    def coordinates(self, u: Floats) -> Floats:
        """Coefficients in the solver's basis of displacements `(n_dof,)` or `(n_dof, k)`.

        Known unknowns count as zero.
        """
        n = len(self.hierarchy.is_free)
        enriched_columns = self.basis[:, n:]
        y = ((enriched_columns.T @ (self._node_entries @ u)).T / self.operator.diagonal[n:]).T
        return np.concatenate([self.basis[:, :n].T @ (u - enriched_columns @ y), y])

    @cached_property
    def _node_entries(self) -> sp.csr_matrix:
        """Entries of the stiffness between unknowns of one node."""
        if self.node_entries is not None:
            return self.node_entries
        assert self.block_basis is not None
        assert self.inverse_basis is not None
        K = nearby_unknowns(_joined_rows(self.matrix), self.block_basis, self.blocks)
        return sp.csr_matrix(
            self.inverse_basis.T @ within_blocks(K, self.blocks) @ self.inverse_basis
        )


def _joined_rows(K: sp.csr_matrix | Stiffness, rows: Bools | None = None) -> sp.csr_matrix:
    return K.sum_of_rows(rows) if isinstance(K, Stiffness) else K


def iterative_system(
    space: FunctionSpace,
    K: sp.csr_matrix | Stiffness,
    bulk: Bulk,
    is_fixed: Bools,
    levels: Hierarchy | None = None,
    modes: Floats | None = None,
    tip_columns: Callable[[Bools], tuple[Any, Bools]] | None = None,
    rows: Bools | None = None,
) -> IterativeSystem:
    """Change the basis and put the enriched matrix on top of the levels of the uncracked body.

    Parameters
    ----------
    space : FunctionSpace
    K : Stiffness or sparse matrix (n_dof, n_dof)
        Of all unknowns.
    bulk : Bulk
        Stiffness of the uncracked body, of which K's standard block is a copy.
    is_fixed : (n_dof,) array of bool
        Unknowns that supports decide; no pins.
    levels : Hierarchy, optional
        Of an earlier crack in the same mesh; made anew where it does not fit.
    modes : (n_dof, k) array, optional
        Rigid motions that nothing prevents; loads have to be in balance with them.
    tip_columns : callable, optional
        Combinations of the tip functions for free unknowns, of `Numerics.tip_basis`.
    rows : (n_functions,) array of bool, optional
        Functions next to enriched ones, whose rows of a `Stiffness` are enough at order 1.
    """
    if levels is None or not levels.fits(bulk, is_fixed):
        levels = hierarchy(bulk, is_fixed)
    near_entries = _joined_rows(K, rows)  # after the levels, whose making needs the most memory
    is_free = ~is_fixed
    d = space.dim
    standard = np.arange(len(levels.is_free))
    stars = space.order == 2 and space.n_functions > space.n_nodes
    tip_modes, in_use, inverse = None, is_free, None
    if tip_columns is not None and space.tips:
        tip_modes, in_use = tip_columns(is_free)
    if stars and space.tips:
        tip_modes, inverse = _star_orthogonal_basis(space, near_entries, tip_modes, in_use)
    blocks = node_blocks(space, "star" if stars else "node", in_use)
    enriched_columns, starts, block = enriched_basis(space, near_entries, blocks, levels, tip_modes)
    parts = parts_of(levels, near_entries, standard, enriched_columns)
    border, diagonal = parts.border_factor(starts), parts.diagonal
    patches = None
    if stars and len(block):
        home = np.where(levels.is_free, standard // d, -1)
        home = np.concatenate([home, blocks.nodes[block]])
        patches = star_patches(space, home, len(standard), diagonal, parts.entries)
    block_entries = within_blocks(near_entries, blocks) if tip_modes is None else None
    del parts, near_entries  # before the cycle makes copies in single precision
    identity = sp.csr_matrix(
        (levels.is_free.astype(float), (standard, np.arange(len(standard)))),
        shape=(space.n_dof, len(standard)),
    )
    basis = sp.csr_matrix(sp.hstack([identity, enriched_columns]))
    null = np.zeros((0, 0)) if modes is None else modes[: len(standard)]
    if null.shape[1] and not levels.is_free.all():
        null = np.linalg.qr(null * levels.is_free[:, None])[0]
    cycle = extended_cycle(levels, border, diagonal, patches)
    operator = Operator(border.times, cycle, diagonal, null, border.times_all, cycle.of_all)
    return IterativeSystem(
        K, block_entries, lock(is_free), basis, levels, operator, blocks, tip_modes, inverse
    )


def _vectors(columns: Floats) -> list[Floats]:
    return list(np.ascontiguousarray(columns.T))


def _in_turn(row_alike: Ints, scale: Floats) -> Iterator[list[int]]:
    """States that are solved first, and positive multiples of theirs."""
    multiple = (row_alike != np.arange(len(row_alike))) & (scale > 0)
    multiple &= ~multiple[row_alike]
    yield [int(k) for k in np.nonzero(~multiple)[0]]
    yield [int(k) for k in np.nonzero(multiple)[0]]


def _star_orthogonal_basis(
    space: FunctionSpace, K: sp.csr_matrix, modes: sp.csr_matrix | None, is_free: Bools
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Basis in which tip functions are orthogonal to the functions of their star; its inverse."""
    if modes is None:
        projector = patch_orthogonal(space, K, is_free, "star")
        # What is taken off belongs to unknowns from which nothing is taken.
        return projector, sp.csr_matrix(2 * sp.identity(space.n_dof) - projector)
    projector = patch_orthogonal(space, sp.csr_matrix(modes.T @ K @ modes), is_free, "star")
    # The modes of a point are orthogonal to each other: no two share a function of a component.
    size = np.asarray(modes.multiply(modes).sum(axis=0)).ravel()
    scaled_modes = sp.diags(1 / np.where(size > 0, size, 1.0)) @ modes.T
    inverse = (2 * sp.identity(space.n_dof) - projector) @ scaled_modes
    return sp.csr_matrix(modes @ projector), sp.csr_matrix(inverse)


# Load states that are nearly combinations of others.


def independent_columns(vectors: Sequence[Floats]) -> list[int]:
    """Those that are no combination of others before them, nearly."""
    columns, directions = [], list[Floats]()
    for k, vector in enumerate(vectors):
        residual, size = vector.copy(), _norm(vector)
        for q in directions * 2:  # twice: what is left of nearly parallel vectors is small
            residual -= np.einsum("i,i", q, residual) * q
        if not _norm(residual) <= _NEARLY * size:
            columns.append(k)
            directions.append(residual / _norm(residual))
    return columns


def _norm(vector: Floats) -> float:
    return float(np.sqrt(np.einsum("i,i", vector, vector)))


def best_guesses(K: Operator, solutions: Sequence[Floats], b: Sequence[Floats]) -> list[Floats]:
    """Combinations of solutions with the least energy: exact for combinations of their loads."""
    if not solutions:
        return [np.zeros_like(right_hand_side) for right_hand_side in b]
    y = np.stack(solutions, axis=1)
    image = np.stack(K.answers(Request.TIMES, solutions), axis=1)
    inverse = np.linalg.pinv(y.T @ image, 1e-12, True)
    return [y @ (inverse @ (y.T @ right_hand_side)) for right_hand_side in b]
