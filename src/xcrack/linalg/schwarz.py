"""Smoothing by small overlapping blocks where functions of neighbouring nodes nearly repeat.

At order 2 the tip functions on linear hats nearly repeat the quadratic functions of the same star,
and Heaviside functions of the midpoints those of the points. A block holds the unknowns of a point
and of the midpoints of its edges: their functions all end inside the cells around the point, as
its tip functions do. The sum of the solutions of all blocks takes the place of the inverse
diagonal (additive Schwarz, on vertex stars after Schoeberl, Melenk, Pechstein and Zaglmayr, 2008).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Floats, Ints, lock, offsets
from xcrack.fem.function_space import FunctionSpace
from xcrack.linalg.basis import stars

_LEAST = 1e-6  # of a block's largest eigenvalue: single precision resolves no more


@dataclass(frozen=True, eq=False)
class Patches:
    """Overlapping blocks of unknowns with their inverses, in single precision.

    Attributes
    ----------
    members : array of uint32
        Unknowns of the blocks, one block after the other.
    start : (b + 1,) array of uint32
        Where each block begins in `members`.
    offset : (b,) array of uint64
        Where its inverse begins.
    inverse : array
        Symmetric inverses, row by row.
    alone : (n,) array
        Inverse diagonal of unknowns outside all blocks, 0 for the others.
    """

    members: Any
    start: Any
    offset: Any
    inverse: Any
    alone: Any

    def times(self, r: Any) -> Any:
        """Sum of the solutions of all blocks, and of the unknowns outside, in single precision."""
        from xcrack.linalg.kernels.blocks import add_solved

        out = self.alone * r
        add_solved(self.members, self.start, self.offset, self.inverse, r, out)
        return out


def star_patches(
    space: FunctionSpace,
    home: Ints,
    n_standard: int,
    diagonal: Floats,
    entries: Callable[[Ints], sp.csr_matrix],
) -> Patches:
    """Blocks of the stars of all points at which an enriched function acts.

    Parameters
    ----------
    space : FunctionSpace
    home : (n,) array of int
        Node at which each unknown of the matrix is at home, -1 for decoupled ones.
    n_standard : int
        Leading unknowns that are not enriched.
    diagonal : (n,) array
        Of the matrix.
    entries : callable
        Sorted unknowns (m,) -> their entries of the matrix (m, m).
    """
    members, start = _members(space, home, n_standard)
    used, place = np.unique(members, return_inverse=True)
    inverse, offset = _inverses(entries(used), place, start)
    alone = (1 / diagonal).astype(np.float32)
    alone[used] = 0
    short = [each.astype(np.uint32) for each in (members, start)]
    return Patches(*map(lock, (*short, offset, inverse, alone)))


def _members(space: FunctionSpace, home: Ints, n_standard: int) -> tuple[Ints, Ints]:
    """Unknowns of each star, one star after the other, and where each begins."""
    n = space.mesh.n_points
    enriched = np.unique(home[n_standard:])
    ends = space.mesh.edges[enriched[enriched >= n] - n].ravel()
    points = np.unique(np.concatenate([enriched[enriched < n], ends]))
    nodes_with_home = np.nonzero(home >= 0)[0]
    at = sp.csr_matrix(
        (np.ones(len(nodes_with_home), np.int8), (home[nodes_with_home], nodes_with_home)),
        shape=(space.n_nodes, len(home)),
    )
    patches = sp.csr_matrix(stars(space.mesh, space.order)[points] @ at)
    patches.sort_indices()
    return patches.indices.astype(np.int64), patches.indptr.astype(np.int64)


def _inverses(A: sp.csr_matrix, members: Ints, start: Ints) -> tuple[Any, Any]:
    """Inverses of diagonal blocks, row by row, and where each begins."""
    from xcrack.linalg.kernels.blocks import dense_blocks

    size = np.diff(start)
    offset = offsets(size**2)
    result = np.empty(offset[-1], np.float32)
    flat = dense_blocks(A.indptr, A.indices, A.data, members, start)
    for s in np.unique(size):
        where = offset[:-1][size == s][:, None] + np.arange(s * s)
        inverse = _inverse(flat[where].reshape(-1, s, s))
        result[where] = inverse.reshape(-1, s * s)
    return result, offset[:-1].astype(np.uint64)


def _inverse(A: Floats) -> Floats:
    """Inverses of positive matrices (b, s, s); eigenvalues that hardly count are lifted."""
    root = 1 / np.sqrt(np.einsum("bii->bi", A))
    scaled = root[:, :, None] * A * root[:, None, :]
    try:
        L = np.linalg.cholesky(scaled)
        if np.einsum("bii->bi", L).min() ** 2 > _LEAST:
            inverse = np.linalg.inv(L)
            return np.asarray(
                root[:, :, None] * (inverse.transpose(0, 2, 1) @ inverse) * root[:, None, :]
            )
    except np.linalg.LinAlgError:
        pass
    w, V = np.linalg.eigh(scaled)
    V = root[:, :, None] * V
    w = np.maximum(w, _LEAST * w[:, -1:])
    return np.asarray((V / w[:, None, :]) @ V.transpose(0, 2, 1))
