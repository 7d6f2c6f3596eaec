"""Products of sparse matrices with vectors: those of scipy to the bit, and quicker ones.

The multigrid cycle multiplies matrices in blocks of rows that share a pattern, with an enriched
border.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Floats, Ints, lock, offsets
from xcrack.base.machine import map_tasks, number_of_threads
from xcrack.fem.assembly import Stiffness

_LEAST_ENTRIES = 100_000  # of a factor that a thread is worth
_LEAST = 300_000  # values of a part of a product: less takes no longer than to hand it over
_TOGETHER = 3  # rows that the kernel of products takes at once
_FOUR = 4  # vectors that the kernel of several takes: what a processor multiplies at once


def times(A: sp.csr_matrix | Stiffness, x: Floats) -> Floats:
    """A x for columns `(m,)` or `(m, k)`."""
    if isinstance(A, Stiffness):
        return A @ x
    from xcrack.linalg.kernels import sparse

    x = np.ascontiguousarray(x)
    result = sparse.times(A.indptr, A.indices, A.data, x.reshape(len(x), -1))
    return np.asarray(result.reshape(len(result), *x.shape[1:]))


def times_transposed(A: sp.csr_matrix, x: Floats) -> Floats:
    """A^T x for columns `(n,)` or `(n, k)`."""
    from xcrack.linalg.kernels import sparse

    x, n = np.ascontiguousarray(x), A.shape[1]
    result = sparse.times_transposed(A.indptr, A.indices, A.data, n, x.reshape(len(x), -1))
    return np.asarray(result.reshape(n, *x.shape[1:]))


def product(A: sp.csr_matrix, B: sp.csr_matrix) -> sp.csr_matrix:
    """A B of sparse matrices, stretches of rows by threads: the same bits for any number."""
    count = min(number_of_threads(), A.nnz // _LEAST_ENTRIES)
    if count < 2:
        return sp.csr_matrix(A @ B)
    cut_rows = np.searchsorted(A.indptr, np.linspace(0, A.nnz, count + 1)[1:-1])
    ends = [0, *cut_rows.tolist(), A.shape[0]]

    def rows(span: tuple[int, int]) -> sp.csr_matrix:
        indptr = A.indptr[span[0] : span[1] + 1]
        entries_of_rows = slice(indptr[0], indptr[-1])
        shape = span[1] - span[0], A.shape[1]
        return (
            sp.csr_matrix(
                (A.data[entries_of_rows], A.indices[entries_of_rows], indptr - indptr[0]),
                shape=shape,
            )
            @ B
        )

    spans = list(itertools.pairwise(ends))
    parts = map_tasks(rows, spans)
    begin = offsets(np.array([part.nnz for part in parts]))
    kind = np.int32 if begin[-1] < np.iinfo(np.int32).max else np.int64
    data, indices = np.empty(begin[-1], parts[0].dtype), np.empty(begin[-1], kind)
    indptr = np.zeros(A.shape[0] + 1, kind)

    def place(k: int) -> None:
        data[begin[k] : begin[k + 1]] = parts[k].data
        indices[begin[k] : begin[k + 1]] = parts[k].indices
        indptr[spans[k][0] + 1 : spans[k][1] + 1] = parts[k].indptr[1:] + begin[k]

    map_tasks(place, range(len(parts)))
    return sp.csr_matrix((data, indices, indptr), shape=(A.shape[0], B.shape[1]))


# Matrices in blocks of rows.


def in_fours(function: Callable[[Any], Any], vectors: Sequence[Any]) -> list[Any]:
    """Results for vectors of a function of a vector, or of four that stand side by side `(n, 4)`.

    One that is left goes alone; where two or three are left the others are zero.
    """
    results: list[Any] = []
    for first in range(0, len(vectors), _FOUR):
        group = vectors[first : first + _FOUR]
        if len(group) == 1:
            results.append(function(group[0]))
            continue
        columns = np.zeros((len(group[0]), _FOUR), group[0].dtype)
        for k, vector in enumerate(group):
            columns[:, k] = vector
        columns = function(columns)
        results += [np.ascontiguousarray(columns[:, k]) for k in range(len(group))]
    return results


@dataclass(frozen=True, eq=False)
class RowBlocks:
    """Sparse matrix in blocks of rows that share one pattern.

    Attributes
    ----------
    shape : (rows, columns)
    first_row, start, offset : (b + 1,) arrays of uint32
        First row, column list and values of each block.
    columns : array of uint32
    values : array, float32 or float64
    idle_rows : (k,) array of int, optional
        Rows that count as zero whatever the values.
    """

    shape: tuple[int, int]
    first_row: Any
    start: Any
    offset: Any
    columns: Any
    values: Any
    idle_rows: Ints | None = None

    @property
    def dtype(self) -> Any:
        """Type of the values."""
        return self.values.dtype

    def times(self, x: Any) -> Any:
        """A x, in the type of the values; see `added`."""
        return self.add_product(np.zeros((self.shape[0], *x.shape[1:]), self.dtype), 1, x)

    def add_product(self, y: Any, scale: float, x: Any) -> Any:
        """Write y + scale A x over y, and return it, for a vector or four `(n, 4)`."""
        if x.ndim == 1:
            from xcrack.linalg.kernels.cycle import product as multiply
        else:
            from xcrack.linalg.kernels.cycle import product_of_four as multiply
        idle_values = None if self.idle_rows is None else y[self.idle_rows]
        blocks, factors = (self.first_row, self.start, self.offset), (self.columns, self.values, x)
        number = self.values.dtype.type(scale)
        entries = len(self.values) * (1 if x.ndim == 1 else 2)
        count = min(number_of_threads(), entries // _LEAST)
        if count < 2:
            multiply(*blocks, *factors, y, number, y)
        else:

            def multiply_rows(stretch: slice) -> None:
                multiply(*(array[stretch] for array in blocks), *factors, y, number, y)

            map_tasks(multiply_rows, self._stretches(count))
        if idle_values is not None:
            y[self.idle_rows] = idle_values
        return y

    def _stretches(self, count: int) -> list[slice]:
        """Blocks of rows in stretches with about as many values each."""
        targets = np.arange(1, count) * (len(self.values) / count)
        ends = [0, *np.searchsorted(self.offset, targets), len(self.first_row) - 1]
        return [slice(a, b + 1) for a, b in itertools.pairwise(ends)]

    def in_single_precision(self) -> "RowBlocks":
        """The same matrix in single precision; it shares the pattern."""
        return replace(self, values=lock(self.values.astype(np.float32)))


def row_blocks(parts: Sequence[sp.csr_matrix], first: Ints, dtype: Any = np.float64) -> RowBlocks:
    """Store CSR matrices side by side in blocks of rows.

    Parameters
    ----------
    parts : sequence of sparse matrices (n, m)
        From the left to the right; they need not be joined before.
    first : (b + 1,) array of int
        First row of each block, and n at the end.
    dtype : numpy type of the values
    """
    from xcrack.linalg.kernels.cycle import fill_blocks, pattern_sizes

    first = np.asarray(first, dtype=np.int64)
    entries = sum(A.nnz for A in parts)
    count = max(1, min(number_of_threads(), entries // _LEAST))
    ends = np.linspace(0, len(first) - 1, count + 1).astype(int).tolist()
    spans = list(itertools.pairwise(ends))

    def sizes_of(A: sp.csr_matrix) -> Ints:
        def sizes_of_part(span: tuple[int, int]) -> Ints:
            return np.asarray(
                pattern_sizes(A.indptr, A.indices, first[span[0] : span[1] + 1], A.shape[1])
            )

        return np.concatenate(map_tasks(sizes_of_part, spans))

    sizes = [sizes_of(A) for A in parts]
    total_sizes = np.asarray(np.sum(sizes, axis=0, dtype=np.int64))
    start, offset = offsets(total_sizes), offsets(total_sizes * np.diff(first))
    columns, values = np.empty(start[-1], np.uint32), np.zeros(offset[-1], dtype)
    filled_sizes, shift = np.zeros_like(total_sizes), 0
    for A, sizes_of_part in zip(parts, sizes):
        begin, size = start[:-1] + filled_sizes, np.stack([filled_sizes, total_sizes], axis=1)

        def fill(
            span: tuple[int, int],
            A: sp.csr_matrix = A,
            begin: Ints = begin,
            size: Ints = size,
            shift: int = shift,
        ) -> None:
            part = slice(*span)
            fill_blocks(
                A.indptr, A.indices, A.data, first[span[0] : span[1] + 1], begin[part],
                size[part], offset[part], A.shape[1], shift, columns, values,
            )  # fmt: skip

        map_tasks(fill, spans)
        filled_sizes, shift = filled_sizes + sizes_of_part, shift + A.shape[1]
    short_arrays = [array.astype(np.uint32) for array in (first, start, offset)]
    return RowBlocks((int(first[-1]), shift), *map(lock, (*short_arrays, columns, values)))


def store_blocks(A: sp.bsr_matrix, dtype: Any = np.float32) -> RowBlocks:
    """Store a matrix of blocks: a block of its rows is one of ours.

    Blocks of three rows, or multiples of it, are taken as they are, without a matrix in between;
    those of three share its memory where they are stored column by column in the type asked for.

    Parameters
    ----------
    A : sparse matrix (n, m)
        BSR.
    dtype : numpy type of the values
    """
    rows, columns = A.blocksize
    if rows % _TOGETHER:
        return row_blocks([A.tocsr()], np.arange(0, A.shape[0] + 1, rows), dtype)
    blocks, indices = A.data.transpose(0, 2, 1), A.indices
    row = np.repeat(np.arange(len(A.indptr) - 1), np.diff(A.indptr))
    if not A.has_sorted_indices:  # scipy's own sorting spoils blocks that are a transposed view
        order = np.lexsort((indices, row))
        blocks, indices = blocks[order], indices[order]
    chunks = rows // _TOGETHER
    entry_columns = np.empty((len(indices), columns), np.uint32)
    is_shared = chunks == 1 and blocks.dtype == dtype and blocks.flags.c_contiguous
    values = blocks.ravel() if is_shared else np.empty(blocks.size, dtype)

    def store(span: tuple[int, int]) -> None:
        part, row_of_part = slice(*span), row[slice(*span)]
        entry_columns[part] = indices[part, None] * np.int64(columns) + np.arange(columns)
        if is_shared:
            return
        if chunks == 1:
            values.reshape(blocks.shape)[part] = blocks[part]
            return
        stretch, counts = values.reshape(-1, columns, _TOGETHER), np.diff(A.indptr)[row_of_part]
        place = np.arange(*span) + (chunks - 1) * A.indptr[row_of_part].astype(np.int64)
        for k in range(chunks):  # of a block's rows, which are stored one after the other
            stretch[place] = blocks[part, :, k * _TOGETHER : (k + 1) * _TOGETHER]
            place += counts

    count = max(1, min(number_of_threads(), blocks.size // _LEAST))
    ends = np.linspace(0, len(indices), count + 1).astype(int).tolist()
    map_tasks(store, list(itertools.pairwise(ends)))
    first = np.arange(0, A.shape[0] + 1, rows, dtype=np.uint32)
    start = (A.indptr * np.int64(columns)).astype(np.uint32)
    offset = (A.indptr * np.int64(rows * columns)).astype(np.uint32)
    return RowBlocks(A.shape, *map(lock, (first, start, offset, entry_columns.ravel(), values)))


@dataclass(frozen=True, eq=False)
class BorderedFactor:
    """Matrix of standard and enriched unknowns; the standard block is that of every crack.

    Attributes
    ----------
    body_block : RowBlocks (n, n)
    coupling : RowBlocks (n, e)
    border_rows : RowBlocks (e, n + e)
    """

    body_block: RowBlocks
    coupling: RowBlocks
    border_rows: RowBlocks

    @property
    def idle_rows(self) -> Ints | None:
        """Rows that count as zero."""
        return self.body_block.idle_rows

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        n = self.border_rows.shape[1]
        return n, n

    @property
    def dtype(self) -> Any:
        """Type of the values."""
        return self.body_block.dtype

    def times(self, x: Any) -> Any:
        """A x, in the type of the values; see `RowBlocks.added`."""
        return self.add_product(np.zeros_like(x, self.dtype), 1, x)

    def times_all(self, vectors: Sequence[Any]) -> list[Any]:
        """A x of several vectors, four at a time."""
        return in_fours(self.times, vectors)

    def add_product(self, y: Any, scale: float, x: Any) -> Any:
        """Write y + scale A x over y, and return it; see `RowBlocks.added`."""
        n = self.body_block.shape[0]
        self.body_block.add_product(y[:n], scale, x[:n])
        self.coupling.add_product(y[:n], scale, x[n:])
        self.border_rows.add_product(y[n:], scale, x)
        return y
