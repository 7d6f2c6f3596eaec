"""The basis of the iterative engine, and the stiffness in it: the body's with a border."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Floats, Ints, ranges
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.basis import Blocks, orthonormal_functions
from xcrack.linalg.multigrid import Hierarchy
from xcrack.linalg.products import product
from xcrack.linalg.row_blocks import BorderedFactor, row_blocks


def enriched_basis(
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
        K = nearby_unknowns(K, combined, blocks)
    Z = sp.csc_matrix(orthonormal_functions(K, blocks))
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
class Parts:
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
        """Of the whole matrix."""
        return np.concatenate([self.levels.diagonal, self.own.diagonal()])

    def stored(self, starts: Ints) -> BorderedFactor:
        """The whole matrix; `starts` are the first columns of the enriched nodes."""
        first = np.concatenate([starts, [self.own.shape[0]]])
        return BorderedFactor(
            self.levels.matrix,
            row_blocks([self.across], self.levels.matrix.first),
            row_blocks([self.across.T.tocsr(), self.own], first),
        )

    def entries(self, chosen: Ints) -> sp.csr_matrix:
        """Entries between free unknowns, given sorted."""
        n = len(self.plain)
        standard, enriched_numbers = chosen[chosen < n], chosen[chosen >= n] - n
        standard_entries = self.plain[standard]
        across = self.across[standard][:, enriched_numbers]
        parts = [
            [self.K[standard_entries][:, standard_entries], across],
            [across.T, self.own[enriched_numbers][:, enriched_numbers]],
        ]
        return sp.csr_matrix(sp.bmat(parts))


def parts_of(levels: Hierarchy, K: sp.csr_matrix, plain: Ints, enriched: sp.csc_matrix) -> Parts:
    """Stiffness between the unknowns of a hierarchy and enriched columns."""
    image = product(K, sp.csr_matrix(enriched))
    enriched_block = product(sp.csr_matrix(enriched.T), image)
    across = image[plain]
    if not levels.free.all():
        across = sp.csr_matrix(sp.diags(levels.free.astype(float)) @ across)
    return Parts(levels, K, plain, across, enriched_block)


def nearby_unknowns(K: sp.csr_matrix, changed: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """Stiffness in a changed basis: entries between the unknowns of blocks."""
    members = np.unique(blocks.members)
    columns = sp.csc_matrix(changed[:, members])
    neighbours = np.unique(columns.indices)
    columns = columns[neighbours]
    small = sp.coo_matrix(columns.T @ (K[neighbours][:, neighbours] @ columns))
    return sp.csr_matrix((small.data, (members[small.row], members[small.col])), shape=K.shape)


def within_blocks(K: sp.csr_matrix, blocks: Blocks) -> sp.csr_matrix:
    """Entries of a matrix between the unknowns of one block."""
    from xcrack.linalg.kernels.blocks import dense_blocks

    values = dense_blocks(K.indptr, K.indices, K.data, blocks.members, blocks.offsets)
    size = np.diff(blocks.offsets)
    block, place = ranges(size**2)
    row, column = np.divmod(place, size[block])
    first = blocks.offsets[block]
    triplets = (values, (blocks.members[first + row], blocks.members[first + column]))
    return sp.csr_matrix(triplets, shape=K.shape)
