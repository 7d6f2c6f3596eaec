"""Stiffness of all unknowns: that of the body and that of enriched functions, apart or joined."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.arrays import Bools, Floats, Ints
from xcrack.xfem.function_space import FunctionSpace


@dataclass(frozen=True, eq=False)
class Enriched:
    """Entries with an enriched function, in blocks of function pairs.

    Attributes
    ----------
    indptr : (n_functions + 1,) array of int
    indices : (k,) array of int32
        Sorted in each row.
    data : (k, d, d) array
    """

    indptr: Ints
    indices: Any
    data: Floats


@dataclass(frozen=True, eq=False)
class Stiffness:
    """The two parts of a stiffness; large bodies have no memory for their sum.

    Attributes
    ----------
    body : sparse matrix (n, n)
        Node blocks of the uncracked body, BSR.
    enriched : Enriched
    """

    body: sp.bsr_matrix
    enriched: Enriched

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        n = (len(self.enriched.indptr) - 1) * self.enriched.data.shape[1]
        return n, n

    def __matmul__(self, x: Floats) -> Floats:
        """Forces `(n_dof,)` or `(n_dof, k)` of displacements of the same shape."""
        return _product((self.body, self.enriched), x)

    def joined(self, rows: Bools | None = None) -> sp.csr_matrix:
        """The sum, of all rows or of some functions `(n_functions,)`; others are empty."""
        from xcrack.kernels.bulk import joined

        body, over = self.body, self.enriched
        wanted = np.ones(len(over.indptr) - 1, dtype=bool) if rows is None else rows
        entries = body.data.size + over.data.size
        kind = np.int32 if entries < np.iinfo(np.int32).max else np.int64
        indptr, indices, data = joined(
            body.indptr.astype(kind, copy=False), body.indices, body.data, over.indptr,
            over.indices, over.data, wanted,
        )  # fmt: skip
        return sp.csr_matrix((data, indices, indptr), shape=self.shape)


def body_forces(body: sp.bsr_matrix, x: Floats) -> Floats:
    """Forces `(n,)` or `(n, k)` of displacements of the uncracked body of the same shape."""
    return _product((body,), x)


def _product(parts: tuple[sp.bsr_matrix | Enriched, ...], x: Floats) -> Floats:
    from xcrack.kernels.bulk import add_block_product

    columns = np.ascontiguousarray(x).reshape(len(x), -1)
    result = np.zeros_like(columns)
    for part in parts:
        add_block_product(part.indptr, part.indices, part.data, columns, result)
    return result.reshape(x.shape)


def next_to_enriched(space: FunctionSpace) -> Bools:
    """Functions that couple with those around a node with enriched functions `(n_functions,)`.

    The enriched columns of a solver's basis hold standard functions of such nodes too.
    """
    carries = np.zeros(space.n_nodes, dtype=bool)
    for number in space.heaviside:
        carries |= number >= 0
    for tip in space.tips:
        carries[: space.mesh.n_points] |= tip.point_to_function >= 0
    wanted = np.zeros(space.n_functions, dtype=bool)
    wanted[space.cell_nodes[carries[space.cell_nodes].any(axis=1)]] = True
    wanted[space.n_nodes :] = True
    return wanted
