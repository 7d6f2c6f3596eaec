"""Linear systems: supports eliminated, a well-conditioned basis, one factor for all states."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from xcrack.base.arrays import Bools, Floats
from xcrack.base.checks import call_function, numbers, value_text
from xcrack.base.errors import ConvergenceError, ProblemError, warn
from xcrack.base.machine import one_blas_thread
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.active_set import active_set
from xcrack.linalg.basis import (
    function_nodes,
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
from xcrack.linalg.multifrontal import Factor, Tree, factorise, tree
from xcrack.linalg.products import times, times_transposed
from xcrack.model.material import Material
from xcrack.model.numerics import Numerics

# SuperLU, for matrices that are not positive definite and for methods that change the matrix.

Solve = Callable[[Floats], Floats]


def superlu(A: sp.csc_matrix) -> Solve:
    """Factor a symmetric matrix with SuperLU, minimum degree, symmetric mode.

    Off-diagonal pivoting is switched off: on a scaled symmetric matrix it buys no digit and costs
    up to sixty times. Narrow panels and no artificial supernodes: an eighth of the time in 2D.
    """
    factor = sla.splu(
        A,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        panel_size=2,
        relax=1,
        options={"SymmetricMode": True},
    )
    return lambda b: np.asarray(factor.solve(b))


_WRONG = 1e-3  # residual of a user's solver, relative, that is not a solution
_COARSE = 1e-8  # and one that limits what follows
_LOST = 1e-3  # residual of our own factor that asks for another
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
        Not a square sparse matrix, or pypardiso is not installed: the extra ``pardiso``, for
        x86-64.
    """
    if not sp.issparse(A) or A.ndim != 2 or A.shape[0] != A.shape[1]:
        raise ProblemError(f"pardiso: A = {value_text(A)}: give a sparse symmetric matrix (n, n).")
    if find_spec("pypardiso") is None:
        raise ProblemError("solver=pardiso needs pypardiso: pip install 'xcrack[pardiso]'.")
    import pypardiso

    solver = pypardiso.PyPardisoSolver(mtype=2)
    upper_triangle = sp.triu(A, format="csr")
    solver.factorize(upper_triangle)
    return lambda b: np.asarray(solver.solve(upper_triangle, np.ascontiguousarray(b)))


@dataclass(frozen=True, eq=False)
class DirectSystem:
    """A factored system.

    Attributes
    ----------
    matrix : sparse matrix (n_dof, n_dof)
        Stiffness in the basis of the space.
    is_free : (n_dof,) array of bool
    basis : sparse matrix (n_dof, k)
        Columns of the solver's basis, scaled; zero in the rows of known unknowns.
    basis_matrix : sparse matrix (k, k)
        Stiffness in that basis.
    apply_inverse : callable
    factor : Factor, optional
        Whose halves serve contact; None for SuperLU and a user's solver.
    tree : Tree, optional
    hand_on : bool
        Whether the next solve in the same mesh is to use the factor.
    count : SolveCount
    """

    matrix: sp.csr_matrix
    is_free: Bools
    basis: sp.csr_matrix
    basis_matrix: sp.csc_matrix
    apply_inverse: Solve
    factor: Factor | None = None
    tree: Tree | None = None
    hand_on: bool = False
    count: SolveCount = field(default_factory=SolveCount)
    shared_part: str = "factorisation"
    reason: str = ""

    def solve(
        self, f: Floats, u_imposed: Floats | None = None, start: Floats | None = None
    ) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape."""
        del start
        self.count.solves += 1 if f.ndim == 1 else f.shape[1]
        b = self._loads(f, u_imposed)
        if f.ndim == 1:
            return self._displacements_of(self.apply_inverse(b), u_imposed)
        first, scale = proportional_columns(b)
        is_distinct = first == np.arange(len(first))
        if is_distinct.all():
            return self._displacements_of(self.apply_inverse(b), u_imposed)
        y = self.apply_inverse(b[:, is_distinct])
        return self._displacements_of(y[:, is_distinct.cumsum()[first] - 1] * scale, u_imposed)

    def first_look(
        self, f: Floats, u_imposed: Floats, closed_before: bool
    ) -> tuple[Floats | None, bool]:
        """The solution with open faces; none after closed sets where the factor has halves."""
        if closed_before and self.factor is not None:
            return None, False
        return self.solve(f, u_imposed), True

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

        F = N K^-1 N^T is made once for all states: of Y = L^-1 N^T, the forward half of the rows
        alone, F = Y^T Y and the gaps of the open faces are Y^T (L^-1 f). One backward half then
        gives the displacements with contact.
        """
        del last_solution
        if self.factor is None:
            return self._contact_by_solves(rows, f, u_imposed, start, u_opened)
        condensed = self.condense(rows.N, f, u_imposed)
        states = self._sets(condensed.dual, condensed.gap, rows, start)
        u = condensed.displacements(np.stack([state.pressure for state in states], axis=1))
        return [replace(state, u=u[:, k], dual=condensed.dual) for k, state in enumerate(states)]

    def condense(self, N: sp.csr_matrix, f: Floats, u_imposed: Floats) -> CondensedSystem:
        """The system as rows see it; see `Engine`."""
        if self.factor is None:
            gap = N @ self.solve(f, u_imposed)
            return CondensedSystem(
                self.dual(N), gap, lambda lam: self.solve(f + N.T @ lam, u_imposed)
            )
        factor = self.factor
        b = self._loads(f, u_imposed)
        Y, places = factor.forward_sparse(N @ self.basis)
        y = factor.solve_lower(b)
        with one_blas_thread():
            F = Y.T @ Y
            d = N @ u_imposed + Y.T @ y[places]

        def displacements(lam: Floats) -> Floats:
            total = y.copy()
            with one_blas_thread():
                total[places] += Y @ lam
            self.count.solves += b.shape[1]
            return self._displacements_of(factor.solve_upper(total), u_imposed)

        return CondensedSystem(F, d, displacements)

    def dual(self, N: sp.csr_matrix) -> Floats:
        """F = N K^-1 N^T `(g, g)`, in blocks of right-hand sides."""
        F = np.empty((N.shape[0], N.shape[0]))
        for first in range(0, N.shape[0], _BLOCK):
            rhs = N[first : first + _BLOCK].T.toarray()
            F[:, first : first + _BLOCK] = N @ self.solve(rhs)
        return (F + F.T) / 2

    def handed_on(self, reuse: SolverState) -> SolverState:
        """With the tree of the mesh, and the factor where it may serve again."""
        return replace(reuse, tree=self.tree, factor=self.factor if self.hand_on else None)

    def _contact_by_solves(
        self,
        rows: ContactRows,
        f: Floats,
        u_imposed: Floats,
        start: Sequence[Bools | None],
        u_opened: Floats | None,
    ) -> list[StateContact]:
        d = rows.N @ (self.solve(f, u_imposed) if u_opened is None else u_opened)
        F = self.dual(rows.N)
        states = self._sets(F, d, rows, start)
        pressure = np.stack([state.pressure for state in states], axis=1)
        u = self.solve(f + rows.N.T @ pressure, u_imposed)
        return [replace(state, u=u[:, k], dual=F) for k, state in enumerate(states)]

    def _sets(
        self, F: Floats, d: Floats, rows: ContactRows, start: Sequence[Bools | None]
    ) -> list[StateContact]:
        set_without_start = np.full(len(rows.measure), rows.is_closed)
        return [
            active_set(
                F,
                d[:, k],
                rows.measure,
                rows.stiffness,
                set_without_start if first is None else first,
            )
            for k, first in enumerate(start)
        ]

    def _loads(self, f: Floats, u_imposed: Floats | None) -> Floats:
        """Loads and what imposed displacements add to them, in the solver's basis."""
        if u_imposed is not None and u_imposed.any():
            f = f - times(self.matrix, u_imposed)
        return times_transposed(self.basis, f)

    def _displacements_of(self, y: Floats, u_imposed: Floats | None) -> Floats:
        """Displacements of coefficients in the solver's basis."""
        u = times(self.basis, y)
        u = u if u_imposed is None else u_imposed + u
        if not np.isfinite(u).all():
            raise ConvergenceError(
                "the linear solve returned nan: the stiffness is singular. Is the body supported, "
                "or does a crack cut off a piece that nothing supports?"
            )
        return np.asarray(u)


def system(
    space: FunctionSpace,
    K: sp.csr_matrix,
    is_fixed: Bools,
    numerics: Numerics,
    solver: Solver | None = None,
    material: Material | None = None,
    reuse: SolverState | None = None,
) -> DirectSystem:
    """Eliminate known unknowns, change the basis, scale by the diagonal and factor.

    Parameters
    ----------
    space : Space
    K : sparse matrix (n_dof, n_dof)
    is_fixed : (n_dof,) array of bool
        Unknowns that supports decide, and pins.
    numerics : Numerics
    solver : callable, optional
        In the place of the factorisation.
    material : Material, optional
        For a tip basis that depends on it.
    reuse : SolverState, optional
        Of an earlier solve. Where it is given, the next one may use this factor.
    """
    basis, reduced_matrix = _reduced_columns(space, K, is_fixed, numerics, material)
    count = SolveCount(factorisations=1)
    if solver is not None:
        return DirectSystem(
            K,
            ~is_fixed,
            basis,
            reduced_matrix,
            _verified_solver(solver, reduced_matrix),
            count=count,
        )
    halves = None if reuse is None else reuse.tree
    if halves is None or halves.mesh is not space.mesh or halves.order != space.order:
        halves = tree(space.mesh, space.order)
    support = basis.indptr, basis.indices, basis.shape[1], function_nodes(space), space.dim
    previous_factor = None if reuse is None else reuse.factor
    factor = factorise(reduced_matrix, support, halves, previous_factor, keep=reuse is not None)
    if factor is None:  # a pivot that is not positive: SuperLU needs none
        return DirectSystem(
            K, ~is_fixed, basis, reduced_matrix, superlu(reduced_matrix), tree=halves, count=count
        )
    inverse = _checked_solution(factor, reduced_matrix, count)
    return DirectSystem(
        K, ~is_fixed, basis, reduced_matrix, inverse, factor, halves, reuse is not None, count
    )


def _checked_solution(factor: Factor, A: sp.csc_matrix, count: SolveCount) -> Solve:
    """Solve by a factor; by SuperLU where the residual says that it has lost its digits.

    The first right-hand sides are all looked at; of later ones one is enough.
    """
    fallback: list[Solve] = []
    checks: list[bool] = []

    def solve(b: Floats) -> Floats:
        if not fallback:
            x = factor.solve(b)
            columns = slice(1) if checks and b.ndim > 1 else slice(None)
            if _relative_residual(A, x[..., columns], b[..., columns]) <= _LOST:
                checks.append(True)
                return x
            count.factorisations += 1
            fallback.append(superlu(A))
        return fallback[0](b)

    return solve


def _relative_residual(A: sp.csc_matrix, x: Floats, b: Floats) -> float:
    """Largest residual of right-hand sides, relative to their size; A is symmetric."""
    from xcrack.linalg.kernels.sparse import residual

    x, b = (np.ascontiguousarray(v).reshape(len(v), -1) for v in (x, b))
    return float(residual(A.indptr, A.indices, A.data, x, b))


def _verified_solver(solver: Solver, A: sp.csc_matrix) -> Solve:
    """A user's solver, with a look at what it returns: a residual costs one product."""
    solve = call_function(solver, "solver=", A)
    if not callable(solve):
        raise ProblemError(
            f"solver returned {value_text(solve)}: it must return a function of right-hand sides."
        )

    def solve_and_check(b: Floats) -> Floats:
        x = numbers(
            call_function(solve, "solver=", b),
            "what the solver returned",
            b.shape,
            must_be_finite=False,
        )
        if not np.isfinite(x).all():
            return x  # a singular stiffness, which has its own error
        share = _relative_residual(A, x, b)
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

    return solve_and_check


def scaled_basis(
    space: FunctionSpace,
    K: sp.csr_matrix,
    is_fixed: Bools,
    numerics: Numerics,
    material: Material | None = None,
) -> sp.csr_matrix:
    """Columns of the solver's basis in the basis of the space `(n_dof, k)`.

    The material counts for a tip basis that depends on it.
    """
    return _reduced_columns(space, K, is_fixed, numerics, material)[0]


def _reduced_columns(
    space: FunctionSpace,
    K: sp.csr_matrix,
    is_fixed: Bools,
    numerics: Numerics,
    material: Material | None,
) -> tuple[sp.csr_matrix, sp.csc_matrix]:
    """Columns scaled to energy one, and K in them.

    Standard columns are those of the identity: only the border of enriched ones is multiplied
    out. Columns without energy are left out.
    """
    from xcrack.linalg.kernels.sparse import bordered_matrix

    first = space.n_nodes * space.dim
    tip_columns = _enriched_columns(space, K, ~is_fixed, numerics, material)
    while True:
        matrix, columns, energy = bordered_matrix(
            K.indptr, K.indices, K.data, tip_columns.indptr, tip_columns.indices, tip_columns.data,
            tip_columns.shape[1], is_fixed, first,
        )  # fmt: skip
        has_energy = energy > 0
        if has_energy.all():
            break
        tip_columns = sp.csr_matrix(tip_columns[:, has_energy])
    size = len(matrix[0]) - 1
    basis = sp.csr_matrix((columns[2], columns[1], columns[0]), shape=(K.shape[0], size))
    return basis, sp.csc_matrix((matrix[2], matrix[1], matrix[0]), shape=(size, size))


def _enriched_columns(
    space: FunctionSpace,
    K: sp.csr_matrix,
    is_free: Bools,
    numerics: Numerics,
    material: Material | None,
) -> sp.csr_matrix:
    """The columns of the solver's basis for enriched unknowns `(n_dof, k)`, not yet scaled."""
    n = space.n_dof
    first = space.n_nodes * space.dim
    change = None
    if numerics.tip_basis is not None and space.tips:
        change, is_free = numerics.tip_basis.columns(space, material, is_free)
        K = sp.csr_matrix(change.T @ K @ change)
    if numerics.patch and space.tips:
        patch = patch_orthogonal(space, K, is_free)
        change = sp.csr_matrix(patch if change is None else change @ patch)
        K = sp.csr_matrix(patch.T @ K @ patch)
    if numerics.orthonormal != "none" and n > first:
        Z = orthonormal_functions(K, node_blocks(space, numerics.orthonormal, is_free))
    else:
        free_unknowns = first + np.nonzero(is_free[first:])[0]
        unit_entries = (np.ones(len(free_unknowns)), (free_unknowns, np.arange(len(free_unknowns))))
        Z = sp.csr_matrix(unit_entries, shape=(n, len(free_unknowns)))
    return Z if change is None else sp.csr_matrix(change @ Z)


__all__ = []
