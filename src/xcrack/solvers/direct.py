"""Linear systems: supports eliminated, a well-conditioned basis, one factor for all states."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, Ints
from xcrack.errors import ConvergenceError, ProblemError, warn
from xcrack.inputs import called, numbers
from xcrack.scene.material import Isotropic
from xcrack.scene.numerics import Numerics
from xcrack.solvers.active_set import active_set
from xcrack.solvers.basis import (
    function_nodes,
    node_blocks,
    orthonormal,
    patch_orthogonal,
    restricted,
)
from xcrack.solvers.engine import ContactRows, Count, StateContact
from xcrack.solvers.factor import Elimination, Solve, eliminated
from xcrack.solvers.modal_basis import mode_columns
from xcrack.solvers.reuse import Reuse
from xcrack.xfem.function_space import FunctionSpace

_WRONG = 1e-3  # residual of a user's solver, relative, that is not a solution
_COARSE = 1e-8  # and one that limits what follows
_BLOCK = 16  # right-hand sides solved at once for the dual matrix; bounds the memory

Solver = Callable[[sp.csc_matrix], Solve]


def pardiso(A: sp.csc_matrix) -> Solve:
    """Factor a symmetric positive matrix with MKL PARDISO, as ``solve(problem, solver=pardiso)``.

    Parameters
    ----------
    A : sparse matrix (n, n)

    Returns
    -------
    callable
        Solves for right-hand sides `(n,)` or `(n, k)`.

    Raises
    ------
    ProblemError
        pypardiso is not installed: the extra ``pardiso``, for x86-64.
    """
    if find_spec("pypardiso") is None:
        raise ProblemError("solver=pardiso needs pypardiso: pip install 'xcrack[pardiso]'.")
    import pypardiso

    solver = pypardiso.PyPardisoSolver(mtype=2)
    upper = sp.triu(A, format="csr")
    solver.factorize(upper)
    return lambda b: np.asarray(solver.solve(upper, np.ascontiguousarray(b)))


@dataclass(frozen=True, eq=False)
class System:
    """A factored system.

    Attributes
    ----------
    matrix : sparse matrix (n_dof, n_dof)
        Stiffness in the basis of the space.
    free : (n_dof,) array of bool
    basis : sparse matrix (n_dof, k)
        Columns of the solver's basis, scaled; zero in the rows of known unknowns.
    count : Count
    elimination : Elimination, optional
        Order of the nodes, for the next crack in the mesh.
    """

    matrix: sp.csr_matrix
    free: Bools
    basis: sp.csr_matrix
    reduced: sp.csc_matrix
    apply_inverse: Solve
    count: Count = field(default_factory=Count)
    elimination: Elimination | None = None
    shared: str = "factorisation"
    reason: str = ""

    def solve(self, f: Floats, known: Floats | None = None, start: Floats | None = None) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape."""
        del start
        residual = f if known is None else f - self.matrix @ known
        self.count.solves += 1 if f.ndim == 1 else f.shape[1]
        u = self.basis @ self.apply_inverse(self.basis.T @ residual)
        u = u if known is None else known + u
        if not np.isfinite(u).all():
            raise ConvergenceError(
                "the linear solve returned nan: the stiffness is singular. Is the body "
                "supported, or does a crack cut off a piece that nothing supports?"
            )
        return np.asarray(u)

    def first_look(
        self, f: Floats, known: Floats, closed_before: bool
    ) -> tuple[Floats | None, bool]:
        """The solution with open faces, which contact needs in any case."""
        del closed_before
        return self.solve(f, known), True

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

        F = N K^-1 N^T is made once for all states.
        """
        del latest
        F = self.dual(rows.N)
        d = rows.N @ (self.solve(f, known) if opened is None else opened)
        unknown = np.full(len(rows.measure), rows.closed)
        states = [
            active_set(
                F, d[:, k], rows.measure, rows.stiffness, unknown if first is None else first
            )
            for k, first in enumerate(start)
        ]
        pressure = np.stack([state.pressure for state in states], axis=1)
        u = self.solve(f + rows.N.T @ pressure, known)
        return [replace(state, u=u[:, k]) for k, state in enumerate(states)]

    def dual(self, N: sp.csr_matrix) -> Floats:
        """F = N K^-1 N^T `(g, g)`, in blocks of right-hand sides."""
        F = np.empty((N.shape[0], N.shape[0]))
        for first in range(0, N.shape[0], _BLOCK):
            rhs = N[first : first + _BLOCK].T.toarray()
            F[:, first : first + _BLOCK] = N @ self.solve(rhs)
        return (F + F.T) / 2

    def handed_on(self, reuse: Reuse) -> Reuse:
        """With the order of elimination."""
        return replace(reuse, elimination=self.elimination)


def system(
    space: FunctionSpace,
    K: sp.csr_matrix,
    fixed: Bools,
    numerics: Numerics,
    solver: Solver | None = None,
    material: Isotropic | None = None,
    elimination: Elimination | None = None,
) -> System:
    """Eliminate known unknowns, change the basis, scale by the diagonal and factor."""
    basis, reduced, last = _reduced(space, K, fixed, numerics, material)
    count = Count(factorisations=1)
    if solver is not None:
        return System(K, ~fixed, basis, reduced, _verified(solver, reduced), count)
    node = function_nodes(space)[last // space.dim]
    solve, order = eliminated(reduced, node, space.n_nodes, elimination)
    return System(K, ~fixed, basis, reduced, solve, count, order)


def _verified(solver: Solver, A: sp.csc_matrix) -> Solve:
    """A user's solver, with a look at what it returns: a residual costs one product."""
    solve = called(solver, "solver=", A)
    if not callable(solve):
        raise ProblemError(
            f"solver returned {solve!r:.80}: it must return a function of right-hand sides."
        )

    def verified(b: Floats) -> Floats:
        x = numbers(called(solve, "solver=", b), "what the solver returned", b.shape, finite=False)
        if not np.isfinite(x).all():
            return x  # a singular stiffness, which has its own error
        size = np.sqrt((b * b).sum(axis=0))
        residual = np.sqrt(((b - A @ x) ** 2).sum(axis=0))
        share = float(np.max(residual / np.where(size > 0, size, 1.0), initial=0.0))
        if share > _WRONG:
            raise ConvergenceError(
                f"the given solver leaves a residual of {share:.3g} of the right-hand side: what "
                "it returned is not the solution. Try it on a small matrix, or leave solver out."
            )
        if share > _COARSE:
            warn(
                f"the given solver leaves a residual of {share:.3g} of the right-hand side; K and "
                "contact are no better. Give it a smaller tolerance."
            )
        return x

    return verified


def scaled_basis(
    space: FunctionSpace,
    K: sp.csr_matrix,
    fixed: Bools,
    numerics: Numerics,
    material: Isotropic | None = None,
) -> sp.csr_matrix:
    """Columns of the solver's basis in the basis of the space `(n_dof, k)`.

    The material counts for the vectorial tip basis alone.
    """
    return _reduced(space, K, fixed, numerics, material)[0]


def _reduced(
    space: FunctionSpace,
    K: sp.csr_matrix,
    fixed: Bools,
    numerics: Numerics,
    material: Isotropic | None,
) -> tuple[sp.csr_matrix, sp.csc_matrix, Ints]:
    """Columns scaled to energy one, K in them, and the last unknown in each of them.

    Standard columns are those of the identity: only the border of enriched ones is multiplied
    out. Columns without energy are left out.
    """
    from xcrack.kernels.bordered import bordered

    first = space.n_nodes * space.dim
    enriched = _enriched_columns(space, K, ~fixed, numerics, material)
    across = sp.csr_matrix(K @ enriched)
    down = sp.csc_matrix(across)
    own = sp.csc_matrix(enriched.T @ down)
    plain, border = K.diagonal()[:first], own.diagonal()
    alive = np.nonzero(border > 0)[0]
    if len(alive) < len(border):
        enriched, across, down = enriched[:, alive], across[:, alive], down[:, alive]
        own, border = own[alive][:, alive], border[alive]
    standard = np.nonzero(~fixed[:first] & (plain > 0))[0]
    number = np.full(first, -1, dtype=np.int64)
    number[standard] = np.arange(len(standard))
    scale = 1 / np.sqrt(np.concatenate([plain[standard], border]))
    for part in (across, down, own):
        part.sort_indices()
    indptr, rows, values = bordered(
        K.indptr, K.indices, K.data, number, scale, _arrays(across), _arrays(down), _arrays(own)
    )
    reduced = sp.csc_matrix((values, rows, indptr), shape=(len(scale), len(scale)))
    columns = sp.csc_matrix(enriched)
    last = np.concatenate([standard, np.maximum.reduceat(columns.indices, columns.indptr[:-1])])
    return _beside_identity(standard, enriched, scale), reduced, last


def _beside_identity(standard: Ints, enriched: sp.csr_matrix, scale: Floats) -> sp.csr_matrix:
    """Columns of the identity, then enriched ones `(n, k)`, all of them scaled."""
    n = enriched.shape[0]
    row = np.zeros(n, dtype=np.int64)
    row[standard] = 1
    ends = np.concatenate([[0], np.cumsum(row + np.diff(enriched.indptr))])
    other = np.ones(ends[-1], dtype=bool)
    other[ends[standard]] = False
    column, value = np.empty(ends[-1], dtype=np.int64), np.ones(ends[-1])
    column[~other], column[other] = np.arange(len(standard)), len(standard) + enriched.indices
    value[other] = enriched.data
    return sp.csr_matrix((value * scale[column], column, ends), shape=(n, len(scale)))


def _arrays(A: sp.csr_matrix | sp.csc_matrix) -> tuple[Ints, Ints, Floats]:
    return A.indptr, A.indices, A.data


def _enriched_columns(
    space: FunctionSpace,
    K: sp.csr_matrix,
    free: Bools,
    numerics: Numerics,
    material: Isotropic | None,
) -> sp.csr_matrix:
    """The columns of the solver's basis for enriched unknowns `(n_dof, k)`, not yet scaled."""
    n = space.n_dof
    first = space.n_nodes * space.dim
    changed = None
    if numerics.comparison.tip_basis == "vectorial" and space.tips:
        changed, free = mode_columns(space, material, free)
        K = sp.csr_matrix(changed.T @ K @ changed)
    if numerics.patch and space.tips:
        patch = patch_orthogonal(space, K, free)
        changed = sp.csr_matrix(patch if changed is None else changed @ patch)
        K = sp.csr_matrix(patch.T @ K @ patch)
    if numerics.orthonormal != "none" and n > first:
        Z = orthonormal(K, restricted(node_blocks(space, numerics.orthonormal), free))
    else:
        chosen = first + np.nonzero(free[first:])[0]
        ones = (np.ones(len(chosen)), (chosen, np.arange(len(chosen))))
        Z = sp.csr_matrix(ones, shape=(n, len(chosen)))
    return Z if changed is None else sp.csr_matrix(changed @ Z)
