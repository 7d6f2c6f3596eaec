"""The discrete inf-sup constant of the multiplier space: a number for its stability."""

from typing import Annotated

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from xcrack.analysis.contact import material_numbers
from xcrack.analysis.friction import has_friction, tangential_rows
from xcrack.analysis.multipliers import Multipliers, gap_rows, multipliers
from xcrack.base.arguments import Choice, check_arguments
from xcrack.base.arrays import Floats
from xcrack.fem.facets import jump_values
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import cell_points
from xcrack.fem.system import System, build
from xcrack.linalg.direct import scaled_basis
from xcrack.mesh.simplex import leg_sizes
from xcrack.model.problem import CrackNumber, ProblemArgument, crack_number


@check_arguments()
def inf_sup(
    problem: ProblemArgument,
    crack: CrackNumber = 0,
    *,
    norm: Annotated[str, Choice(("h1", "energy"))] = "h1",
) -> float:
    """Discrete inf-sup constant of the multipliers in use.

    The square root of the smallest eigenvalue of B A^-1 B^T against the weighted mass int h mu²,
    h the size of each cell, for the scalar broken problem on the body scaled to unit size; A is the
    full H1 norm (Chapelle and Bathe, 1993; weights after Béchet, Moës and Wohlmuth, 2009).

    Parameters
    ----------
    problem : Problem
    crack : int
    norm : {"h1", "energy"}
        energy: gaps of the elastic problem in its energy norm (unit modulus) instead; with friction
        normal and tangential ones together.

    Returns
    -------
    float
        Near 0.5 in 2D at order 1, and 0.3 or more at order 2 and in 3D for the reduced space,
        whatever the mesh and the cut; tends to 0 for the naive one.

    Raises
    ------
    ProblemError
        No such crack.
    """
    crack = crack_number(problem, crack, "inf_sup")
    model = build(problem)
    space = model.space
    lips = model.lips[crack]
    chosen = multipliers(
        space, crack, lips, problem.numerics.multipliers, material=material_numbers(problem)
    )
    if norm == "h1":
        A, B = _h1(space), _scalar_rows(space, model, crack, chosen)
        basis = sp.identity(space.n_functions, format="csr")
    else:
        is_fixed = np.zeros(space.n_dof, dtype=bool)
        A = model.stiffness / problem.elasticity.largest_modulus
        # A small mass makes the rigid motions regular without a support.
        A = A + 1e-8 * sp.diags(A.diagonal())
        B = gap_rows(chosen, lips, model.jumps[crack])
        if has_friction(problem, crack):
            B = sp.csr_matrix(sp.vstack([B, *tangential_rows(space, chosen, lips)]))
        basis = scaled_basis(
            space, sp.csr_matrix(A), is_fixed, problem.numerics, problem.elasticity.material
        )
    L, d = space.mesh.extent, space.dim
    h = leg_sizes(space.mesh, lips.cell).mean(axis=1) / L
    gram = (chosen.values.T @ sp.diags(h * lips.weight) @ chosen.values).toarray() / L ** (d - 1)
    gram = np.kron(np.eye(B.shape[0] // len(gram)), gram)
    # A grows like length^(d - 2), B and the mass like the area of the crack faces.
    schur = _schur(A, B / L ** (d - 1), basis, L ** (d - 2))
    return float(np.sqrt(max(_smallest(schur, gram), 0.0)))


def _schur(A: sp.csr_matrix, B: sp.csr_matrix, basis: sp.csr_matrix, scale: float) -> Floats:
    reduced_matrix = sp.csc_matrix(basis.T @ (A / scale) @ basis)
    diagonal = reduced_matrix.diagonal()
    has_energy = np.nonzero(diagonal > 0)[0]
    D = sp.diags(1 / np.sqrt(diagonal[has_energy]))
    scaled_matrix = sp.csc_matrix(D @ reduced_matrix[has_energy][:, has_energy] @ D)
    rows = sp.csr_matrix((B @ basis)[:, has_energy] @ D)
    factor = sla.splu(
        scaled_matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.asarray(rows @ factor.solve(rows.T.toarray()))


def _smallest(schur: Floats, gram: Floats) -> float:
    """Smallest generalised eigenvalue; multipliers without a trace of their own give 0."""
    w, V = np.linalg.eigh(gram)
    is_positive = w > 1e-13 * w.max()
    if not is_positive.all():
        return 0.0
    T = V / np.sqrt(w)
    return float(scipy.linalg.eigvalsh(T.T @ ((schur + schur.T) / 2) @ T)[0])


def _h1(space: FunctionSpace) -> sp.csr_matrix:
    """Matrix of int grad u . grad v + u v / L² of all scalar functions."""
    cells = np.arange(len(space.mesh.cells))
    points = cell_points(space, cells, 4, 2 * space.order)
    rows, columns, values = [], [], []
    for batch, _ in space.batches(cells):
        number, row, first = points.of_cells(batch.cells)
        N, G = space.tabulate(batch, row, points.bary[number], points.side[number])
        w = points.weight[number]
        extent = space.mesh.extent
        integrand = (
            np.einsum("q,qad,qbd->qab", w, G, G) + np.einsum("q,qa,qb->qab", w, N, N) / extent**2
        )
        block = np.add.reduceat(integrand, first[:-1], axis=0)
        n = batch.functions.shape[1]
        r = np.repeat(batch.functions, n, axis=1).ravel()
        c = np.tile(batch.functions, (1, n)).ravel()
        ok = (r >= 0) & (c >= 0)
        rows.append(r[ok])
        columns.append(c[ok])
        values.append(block.ravel()[ok])
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_matrix(triplets, shape=(space.n_functions, space.n_functions))


def _scalar_rows(space: FunctionSpace, model: System, c: int, chosen: Multipliers) -> sp.csr_matrix:
    lips = model.lips[c]
    rows, columns, values = [], [], []
    for functions, number, N in jump_values(space, c, lips):
        is_active = functions >= 0
        rows.append(np.broadcast_to(number[:, None], functions.shape)[is_active])
        columns.append(functions[is_active])
        values.append(N[is_active])
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    jump = sp.csr_matrix(triplets, shape=(len(lips), space.n_functions))
    return sp.csr_matrix(chosen.values.T @ sp.diags(lips.weight) @ jump)
