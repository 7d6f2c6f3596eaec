"""The iterative engine for large bodies in 3D: conjugate gradients with a multigrid cycle.

It needs no factor: memory and time grow with the number of
unknowns, and the levels below the finest one serve every crack in a mesh.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, Ints, lock, ranges
from xcrack.scene.material import Isotropic
from xcrack.solvers.basis import Blocks, node_blocks, orthonormal, patch_orthogonal, restricted
from xcrack.solvers.engine import Condensed, ContactRows, Count, StateContact
from xcrack.solvers.modal_basis import mode_columns
from xcrack.solvers.multigrid import Hierarchy, extended, hierarchy
from xcrack.solvers.products import best_guess
from xcrack.solvers.projected_cg import (
    TOLERANCE,
    Operator,
    ProjectedState,
    conjugate_gradients,
    projected,
)
from xcrack.solvers.reuse import Reuse
from xcrack.solvers.row_blocks import Bordered, row_blocks
from xcrack.solvers.schwarz import star_patches
from xcrack.xfem.assembly import Bulk
from xcrack.xfem.function_space import FunctionSpace
from xcrack.xfem.stiffness import Stiffness

_ROUGH = 0.02  # residual of a first solution that only shows which faces overlap
_LEAST_SHARE = 1e-4  # of the load, to which forces are resolved; round-off forbids much less


@dataclass(frozen=True, eq=False)
class IterativeSystem:
    """A system that is solved by conjugate gradients.

    Attributes
    ----------
    matrix : Stiffness or sparse matrix (n_dof, n_dof)
        In the basis of the space.
    near : sparse matrix (n_dof, n_dof)
        Its rows next to enriched functions, and maybe others.
    free : (n_dof,) array of bool
    basis : sparse matrix (n_dof, k)
        Columns of the solver's basis; zero in the rows of known unknowns.
    hierarchy : Hierarchy
        Serves the next crack in the same mesh too.
    operator : Operator
    blocks : Blocks
        Unknowns of each enriched node.
    combined, back : sparse matrices (n_dof, n_dof), optional
        Basis to which the blocks belong where it is not that of the space, and its inverse.
    count : Count
    """

    matrix: sp.csr_matrix | Stiffness
    near: sp.csr_matrix
    free: Bools
    basis: sp.csr_matrix
    hierarchy: Hierarchy
    operator: Operator
    blocks: Blocks
    combined: sp.csr_matrix | None = None
    back: sp.csr_matrix | None = None
    count: Count = field(default_factory=Count)
    shared: str = "multigrid hierarchy"
    reason: str = "conjugate gradients: a large body in 3D"

    def solve(
        self,
        f: Floats,
        known: Floats | None = None,
        start: Floats | None = None,
        tolerance: float = TOLERANCE,
    ) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape.

        Parameters
        ----------
        f, known : arrays
        start : array of the same shape, optional
            First guess of the displacements.
        tolerance : float
            Residual relative to the load at which to stop.
        """
        columns = f.reshape(len(f), -1)
        given = np.zeros_like(columns) if known is None else known.reshape(columns.shape)
        b = self.basis.T @ (columns - self.matrix @ given)
        y = np.zeros_like(b)
        if start is not None:
            y = self.coordinates(start.reshape(columns.shape) - given)
        for k in range(b.shape[1]):
            guess = best_guess(self.operator, y[:, :k], b[:, k]) if start is None else y[:, k]
            y[:, k] = self._apart(b[:, k], given[:, k], guess, tolerance)
        return np.asarray(given + self.basis @ y).reshape(f.shape)

    def first_look(
        self, f: Floats, known: Floats, closed_before: bool
    ) -> tuple[Floats | None, bool]:
        """Rough displacements, as few steps as show which faces overlap; none after closed sets."""
        if closed_before:
            return None, False
        return self.solve(f, known, tolerance=_ROUGH), False

    def contact(
        self,
        rows: ContactRows,
        f: Floats,
        known: Floats,
        start: Sequence[Bools | None],
        latest: Floats | None = None,
        opened: Floats | None = None,
    ) -> list[StateContact]:
        """Solve load states with crack faces that may touch; see `Engine`.

        Without a first set, that of the groups that overlap in the latest displacements is the
        best guess. Without displacements each state starts from those before it.
        """
        del opened
        own = sp.csr_matrix(rows.N @ self.basis)
        b = self.basis.T @ (f - self.matrix @ known)
        guess = np.zeros_like(b) if latest is None else self.coordinates(latest - known)
        states = []
        for k in range(b.shape[1]):
            gap = rows.N @ known[:, k]
            if latest is None:
                guess[:, k] = best_guess(self.operator, guess[:, :k], b[:, k])
            first = start[k]
            active = own @ guess[:, k] + gap < 0 if first is None else first
            run = partial(projected, self.operator, b[:, k], own, gap, rows.measure, rows.stiffness)
            state = self._together(run, b[:, k], known[:, k], active, guess[:, k])
            guess[:, k] = state.y
            u = known[:, k] + self.basis @ state.y
            states.append(StateContact(state.pressure, state.gap, state.active, state.sets, u))
        return states

    def condensed(self, N: sp.csr_matrix, f: Floats, known: Floats) -> Condensed:
        """The system as rows see it; see `Engine`. A solve for each row."""
        opened = self.solve(f, known)
        F = np.empty((N.shape[0], N.shape[0]))
        for k in range(N.shape[0]):
            row = N[[k]].toarray()[0]
            F[:, k] = N @ self.solve(row, start=np.zeros_like(row))
        return Condensed(
            (F + F.T) / 2,
            N @ opened,
            lambda lam: self.solve(f + N.T @ lam, known, opened),
        )

    def handed_on(self, reuse: Reuse) -> Reuse:
        """With the levels of the mesh."""
        return replace(reuse, hierarchy=self.hierarchy)

    def _apart(self, b: Floats, known: Floats, start: Floats, tolerance: float) -> Floats:
        y, steps = conjugate_gradients(self.operator, b, start, tolerance)
        share = self._share(y, b, known)
        if share < 1:
            y, more = conjugate_gradients(self.operator, b, y, share * tolerance)
            steps += more
        self.count.solves += 1
        self.count.iterations += steps
        return y

    def _together(
        self, run: Callable[..., ProjectedState], b: Floats, known: Floats, active: Bools, y: Floats
    ) -> ProjectedState:
        state = run(active, y)
        sets, steps = state.sets, state.iterations
        share = self._share(state.y, b, known)
        if share < 1:
            state = run(state.active, state.y, share * TOLERANCE)
            sets, steps = sets + state.sets - 1, steps + state.iterations
        self.count.solves += 1
        self.count.iterations += steps
        return replace(state, sets=sets, iterations=steps)

    def _share(self, y: Floats, b: Floats, known: Floats) -> float:
        """Size of the forces in the body relative to b.

        Imposed displacements act through b on the cells next to the support alone, as if the rest
        did not give way: b is then far larger than the forces that are looked for.
        """
        if not known.any():
            return 1.0
        forces = (self.matrix @ (known + self.basis @ y))[: len(self.hierarchy.fixed)]
        size = float(np.sqrt(np.einsum("i,i", b, b)))
        share = float(np.sqrt(np.einsum("i,i", forces, forces))) / size if size > 0 else 1.0
        return min(1.0, max(share, _LEAST_SHARE))

    def coordinates(self, u: Floats) -> Floats:
        """Coefficients in the solver's basis of displacements `(n_dof,)` or `(n_dof, k)`.

        Known unknowns count as zero.
        """
        n = len(self.hierarchy.free)
        enriched = self.basis[:, n:]
        y = ((enriched.T @ (self._within @ u)).T / self.operator.diagonal[n:]).T
        return np.concatenate([self.basis[:, :n].T @ (u - enriched @ y), y])

    @cached_property
    def _within(self) -> sp.csr_matrix:
        """Entries of the stiffness between unknowns of one node."""
        if self.combined is None or self.back is None:
            return _within_blocks(self.near, self.blocks)
        K = _nearby(self.near, self.combined, self.blocks)
        return sp.csr_matrix(self.back.T @ _within_blocks(K, self.blocks) @ self.back)


def iterative_system(
    space: FunctionSpace,
    K: sp.csr_matrix | Stiffness,
    bulk: Bulk,
    fixed: Bools,
    levels: Hierarchy | None = None,
    modes: Floats | None = None,
    vectorial: Isotropic | None = None,
    near: sp.csr_matrix | None = None,
) -> IterativeSystem:
    """Change the basis and put the enriched matrix on top of the levels of the uncracked body.

    Parameters
    ----------
    space : FunctionSpace
    K : Stiffness or sparse matrix (n_dof, n_dof)
        Of all unknowns.
    bulk : Bulk
        Stiffness of the uncracked body, of which K's standard block is a copy.
    fixed : (n_dof,) array of bool
        Unknowns that supports decide; no pins.
    levels : Hierarchy, optional
        Of an earlier crack in the same mesh; made anew where it does not fit.
    modes : (n_dof, k) array, optional
        Rigid motions that nothing prevents; loads have to be in balance with them.
    vectorial : Isotropic, optional
        The material where the tip basis is vectorial.
    near : sparse matrix (n_dof, n_dof), optional
        Rows of K next to enriched functions, enough at order 1; K itself where it is omitted.
    """
    if near is None:
        near = K.joined() if isinstance(K, Stiffness) else K
    if levels is None or not levels.fits(bulk, fixed):
        levels = hierarchy(bulk, fixed)
    free = ~fixed
    d = space.dim
    plain = (levels.nodes[:, None] * d + np.arange(d)).ravel()
    stars = space.order == 2 and space.n_functions > space.n_nodes
    combined, in_use, back = None, free, None
    if vectorial is not None and space.tips:
        combined, in_use = mode_columns(space, vectorial, free)
    if stars and space.tips:
        combined, back = _apart(space, near, combined, in_use)
    whole = node_blocks(space, "star" if stars else "node")
    blocks = restricted(whole, in_use)
    enriched, starts, block = _enriched_basis(space, near, blocks, levels, combined)
    parts = _parts(levels, near, plain, enriched)
    stored, diagonal = parts.stored(starts), parts.diagonal
    patches = None
    if stars and len(block):
        home = np.where(levels.free, plain // d, -1)
        home = np.concatenate([home, whole.members[whole.offsets[block]] // d])
        patches = star_patches(space, home, len(plain), diagonal, parts.entries)
    del parts  # before the cycle makes copies in single precision
    identity = sp.csr_matrix(
        (levels.free.astype(float), (plain, np.arange(len(plain)))),
        shape=(space.n_dof, len(plain)),
    )
    basis = sp.csr_matrix(sp.hstack([identity, enriched]))
    null = np.zeros((len(diagonal), 0 if modes is None else modes.shape[1]))
    if modes is not None and modes.shape[1]:
        null[: len(plain)] = np.linalg.qr(modes[plain] * levels.free[:, None])[0]
    operator = Operator(stored.times, extended(levels, stored, diagonal, patches), diagonal, null)
    return IterativeSystem(K, near, lock(free), basis, levels, operator, blocks, combined, back)


def _apart(
    space: FunctionSpace, K: sp.csr_matrix, modes: sp.csr_matrix | None, free: Bools
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Basis in which tip functions are orthogonal to the functions of their star; its inverse."""
    if modes is None:
        apart = patch_orthogonal(space, K, free, "star")
        # What is taken off belongs to unknowns from which nothing is taken.
        return apart, sp.csr_matrix(2 * sp.identity(space.n_dof) - apart)
    apart = patch_orthogonal(space, sp.csr_matrix(modes.T @ K @ modes), free, "star")
    # The modes of a point are orthogonal to each other: no two share a function of a component.
    size = np.asarray(modes.multiply(modes).sum(axis=0)).ravel()
    own = sp.diags(1 / np.where(size > 0, size, 1.0)) @ modes.T
    back = (2 * sp.identity(space.n_dof) - apart) @ own
    return sp.csr_matrix(modes @ apart), sp.csr_matrix(back)


def _enriched_basis(
    space: FunctionSpace,
    K: sp.csr_matrix,
    blocks: Blocks,
    levels: Hierarchy,
    combined: sp.csr_matrix | None,
) -> tuple[sp.csc_matrix, Ints, Ints]:
    """Orthonormal enriched columns, node by node, the first column of each node, and their blocks.

    Their diagonal entries are made the mean one of the standard unknowns: the norm of a residual
    then weighs both alike.
    """
    if combined is not None:
        K = _nearby(K, combined, blocks)
    Z = sp.csc_matrix(orthonormal(K, blocks))
    owner = np.repeat(np.arange(len(blocks.n_standard)), np.diff(blocks.offsets))
    block_of = np.full(space.n_dof, -1, dtype=np.int64)
    block_of[blocks.members] = owner
    node = block_of[Z.indices[Z.indptr[:-1]]]
    order = np.argsort(node, kind="stable")
    size = np.sqrt(levels.diagonal.mean())
    Z = sp.csc_matrix(Z[:, order] * size)
    Z = Z if combined is None else sp.csc_matrix(combined @ Z)
    node = node[order]
    starts = np.nonzero(np.concatenate([[True], node[1:] != node[:-1]]))[0] if len(node) else node
    return Z, starts, node


@dataclass(frozen=True, eq=False)
class _Parts:
    """Stiffness in the solver's basis: that of the uncracked body with a border.

    Attributes
    ----------
    levels : Hierarchy
    K : sparse matrix (n_dof, n_dof)
    plain : (n,) array of int
        Unknowns of the hierarchy.
    across : sparse matrix (n, e)
        Between them and the enriched columns, CSR.
    own : sparse matrix (e, e)
    """

    levels: Hierarchy
    K: sp.csr_matrix
    plain: Ints
    across: sp.csr_matrix
    own: sp.csr_matrix

    @property
    def diagonal(self) -> Floats:
        return np.concatenate([self.levels.diagonal, self.own.diagonal()])

    def stored(self, starts: Ints) -> Bordered:
        """The whole matrix; `starts` are the first columns of the enriched nodes."""
        first = np.concatenate([starts, [self.own.shape[0]]])
        return Bordered(
            self.levels.matrix,
            row_blocks([self.across], self.levels.matrix.first),
            row_blocks([self.across.T.tocsr(), self.own], first),
        )

    def entries(self, chosen: Ints) -> sp.csr_matrix:
        """Entries between free unknowns, given sorted."""
        n = len(self.plain)
        standard, rest = chosen[chosen < n], chosen[chosen >= n] - n
        known = self.plain[standard]
        across = self.across[standard][:, rest]
        parts = [[self.K[known][:, known], across], [across.T, self.own[rest][:, rest]]]
        return sp.csr_matrix(sp.bmat(parts))


def _parts(levels: Hierarchy, K: sp.csr_matrix, plain: Ints, enriched: sp.csc_matrix) -> _Parts:
    image = sp.csr_matrix(K @ enriched)
    own = sp.csr_matrix(enriched.T @ image)
    across = image[plain]
    if not levels.free.all():
        across = sp.csr_matrix(sp.diags(levels.free.astype(float)) @ across)
    return _Parts(levels, K, plain, across, own)


def _nearby(K: sp.csr_matrix, changed: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """Stiffness in a changed basis: entries between the unknowns of blocks."""
    own = np.unique(blocks.members)
    columns = sp.csc_matrix(changed[:, own])
    near = np.unique(columns.indices)
    columns = columns[near]
    small = sp.coo_matrix(columns.T @ (K[near][:, near] @ columns))
    return sp.csr_matrix((small.data, (own[small.row], own[small.col])), shape=K.shape)


def _within_blocks(K: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    from xcrack.kernels.blocks import dense_blocks

    values = dense_blocks(K.indptr, K.indices, K.data, blocks.members, blocks.offsets)
    size = np.diff(blocks.offsets)
    block, place = ranges(size**2)
    row, column = np.divmod(place, size[block])
    first = blocks.offsets[block]
    triplets = (values, (blocks.members[first + row], blocks.members[first + column]))
    return sp.csr_matrix(triplets, shape=K.shape)
