"""Linear systems: supports eliminated, a well-conditioned basis, one factor for all states."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from xcrack.arrays import Bools, Floats
from xcrack.basis import node_blocks, orthonormal, patch_orthogonal, restricted
from xcrack.errors import ConvergenceError, ProblemError
from xcrack.material import Isotropic
from xcrack.numerics import Numerics
from xcrack.space import Space
from xcrack.vectorial import mode_columns

Solve = Callable[[Floats], Floats]
Solver = Callable[[sp.csc_matrix], Solve]


def superlu(A: sp.csc_matrix) -> Solve:
    """Factor a symmetric positive matrix with SuperLU, minimum degree, symmetric mode.

    Off-diagonal pivoting is switched off: on a scaled symmetric matrix it buys no digit and costs
    up to sixty times.
    """
    factor = sla.splu(
        A,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return lambda b: np.asarray(factor.solve(b))


def pardiso(A: sp.csc_matrix) -> Solve:
    """Factor a symmetric positive matrix with MKL PARDISO (the extra ``pardiso``)."""
    if find_spec("pypardiso") is None:
        raise ProblemError("solver=pardiso needs pypardiso: pip install 'xcrack[pardiso]'.")
    import pypardiso

    solver = pypardiso.PyPardisoSolver(mtype=2)
    upper = sp.triu(A, format="csr")
    solver.factorize(upper)
    return lambda b: np.asarray(solver.solve(upper, np.ascontiguousarray(b)))


@dataclass
class Count:
    """Operations of a run, counted for its report."""

    factorisations: int = 0
    solves: int = 0


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
    """

    matrix: sp.csr_matrix
    free: Bools
    basis: sp.csr_matrix
    reduced: sp.csc_matrix
    apply_inverse: Solve
    count: Count = field(default_factory=Count)

    def solve(self, f: Floats, known: Floats | None = None) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape."""
        residual = f if known is None else f - self.matrix @ known
        self.count.solves += 1 if f.ndim == 1 else f.shape[1]
        u = self.basis @ self.apply_inverse(self.basis.T @ residual)
        u = u if known is None else known + u
        if not np.isfinite(u).all():
            raise ConvergenceError(
                "the linear solve returned nan: the stiffness is singular. Is the body held, or "
                "does a crack cut off a piece that nothing holds?"
            )
        return np.asarray(u)


def system(
    space: Space,
    K: sp.csr_matrix,
    fixed: Bools,
    numerics: Numerics,
    solver: Solver | None = None,
    material: Isotropic | None = None,
) -> System:
    """Eliminate known unknowns, change the basis, scale by the diagonal and factor."""
    basis, reduced = _scaled(_columns(space, K, fixed, numerics, material), K)
    apply_inverse = (solver or superlu)(reduced)
    return System(K, ~fixed, basis, reduced, apply_inverse, Count(factorisations=1))


def scaled_basis(
    space: Space,
    K: sp.csr_matrix,
    fixed: Bools,
    numerics: Numerics,
    material: Isotropic | None = None,
) -> sp.csr_matrix:
    """Columns of the solver's basis in the basis of the space `(n_dof, k)`.

    The material counts for the vectorial tip basis alone.
    """
    return _scaled(_columns(space, K, fixed, numerics, material), K)[0]


def _scaled(basis: sp.csr_matrix, K: sp.csr_matrix) -> tuple[sp.csr_matrix, sp.csc_matrix]:
    """Columns scaled to energy one, those without energy left out, and K in them."""
    reduced = sp.csc_matrix(basis.T @ (K @ basis))
    diagonal = reduced.diagonal()
    if not (diagonal > 0).all():
        alive = np.nonzero(diagonal > 0)[0]
        basis, reduced, diagonal = basis[:, alive], reduced[alive][:, alive], diagonal[alive]
    scale = sp.diags(1 / np.sqrt(diagonal))
    return sp.csr_matrix(basis @ scale), sp.csc_matrix(scale @ reduced @ scale)


def _columns(
    space: Space, K: sp.csr_matrix, fixed: Bools, numerics: Numerics, material: Isotropic | None
) -> sp.csr_matrix:
    """The solver's basis before it is scaled."""
    free = ~fixed
    n = space.n_dof
    first = space.n_nodes * space.dim
    changed = None
    if numerics.tip_basis == "vectorial" and space.tips:
        changed, free = mode_columns(space, material, free)
        K = sp.csr_matrix(changed.T @ K @ changed)
    if numerics.patch and space.tips:
        patch = patch_orthogonal(space, K, free)
        changed = sp.csr_matrix(patch if changed is None else changed @ patch)
        K = sp.csr_matrix(patch.T @ K @ patch)
    if numerics.orthonormal != "none" and n > first:
        blocks = restricted(node_blocks(space, numerics.orthonormal), free)
        Z = orthonormal(K, blocks, np.arange(first, n))
        # Columns of known standard unknowns go; known enriched ones are in no block.
        keep = np.ones(Z.shape[1], dtype=bool)
        keep[:first] = free[:first]
        Z = Z[:, np.nonzero(keep)[0]]
    else:
        Z = sp.identity(n, format="csr")[:, np.nonzero(free)[0]]
    return sp.csr_matrix(Z if changed is None else changed @ Z)
