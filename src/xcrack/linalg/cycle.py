"""A V-cycle on given levels: an approximate inverse in single precision."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, lock
from xcrack.linalg.row_blocks import BorderedFactor, RowBlocks, in_fours
from xcrack.linalg.schwarz import Patches

_LANCZOS = 12  # steps for the largest eigenvalue
SAFETY = 1.1  # by which it is enlarged: Lanczos gives a lower bound
_SHARE = 0.1  # of the spectrum's upper end from which Chebyshev smooths
_START = 613_077  # seed of the vector that Lanczos starts from


@dataclass(frozen=True, eq=False)
class GridLevel:
    """One level of a cycle, in single precision.

    Attributes
    ----------
    matrix : RowBlocks or BorderedFactor
    inverse : (n,) array
        Inverse diagonal, 0 where the diagonal is.
    largest : float
        Upper bound of the spectrum of D^-1 A.
    prolong, restrict : RowBlocks
        From and to the next level; their rows and columns are the leading unknowns of this one.
    patches : Patches, optional
        Smooth in the place of the inverse diagonal, which is then one.
    """

    matrix: RowBlocks | BorderedFactor
    inverse: Any
    largest: float
    prolong: RowBlocks
    restrict: RowBlocks
    patches: Patches | None = None

    def solved(self, r: Any) -> Any:
        """What the smoother multiplies by the inverse diagonal."""
        return r if self.patches is None else _by_column(self.patches.times, r)

    @cached_property
    def inverse_of_four(self) -> Any:
        """The inverse diagonal for four vectors that stand side by side."""
        return lock(np.repeat(self.inverse, 4))


@dataclass(frozen=True, eq=False)
class VCycle:
    """A V-cycle with Chebyshev smoothing of degree 2: an approximate inverse, symmetric.

    Attributes
    ----------
    levels : tuple of GridLevel
        The finest first.
    coarsest : (c, c) array
        Pseudo-inverse of the last matrix.
    """

    levels: tuple[GridLevel, ...]
    coarsest: Any

    def __call__(self, r: Floats) -> Floats:
        """Approximate A^-1 r."""
        return self.of_all([r])[0]

    def of_all(self, residuals: Sequence[Floats]) -> list[Floats]:
        """Approximate A^-1 r of several vectors, four at a time."""
        sizes = [float(np.abs(r).max(initial=0.0)) for r in residuals]
        sizes = [size if np.isfinite(size) else 0.0 for size in sizes]
        scaled = [
            (r / size if size > 0 else np.zeros_like(r)).astype(np.float32)
            for r, size in zip(residuals, sizes, strict=True)
        ]
        results = in_fours(partial(self._down, 0), scaled)
        return [z.astype(np.float64) * size for z, size in zip(results, sizes, strict=True)]

    def _down(self, number: int, b: Any) -> Any:
        if number == len(self.levels):
            return _by_column(self.coarsest.__matmul__, b)
        level = self.levels[number]
        x, r = np.zeros_like(b), b  # nobody needs b any more
        d = _smooth(level, r, x)
        level.matrix.added(r, -1, d)
        n = level.prolong.shape[0]
        coarse = self._down(number + 1, level.restrict.times(r[:n]))
        correction = np.zeros_like(x)
        level.prolong.added(correction[:n], 1, coarse)
        x += correction
        level.matrix.added(r, -1, correction)
        _smooth(level, r, x)
        return x


def _by_column(function: Callable[[Any], Any], b: Any) -> Any:
    """A function of a vector, or of each column alone: the same bits."""
    if b.ndim == 1:
        return function(b)
    return np.stack([function(np.ascontiguousarray(column)) for column in b.T], axis=1)


def _smooth(level: GridLevel, r: Any, x: Any) -> Any:
    """Two Chebyshev steps; r is left one step behind x, by A times the result."""
    from xcrack.linalg.kernels.cycle import first_step, next_step

    high, low = level.largest, _SHARE * level.largest
    middle, half = (high + low) / 2, (high - low) / 2
    sigma = middle / half
    rho = 1 / (2 * sigma - 1 / sigma)
    single = np.float32
    d = np.empty_like(x)
    inverse = level.inverse if r.ndim == 1 else level.inverse_of_four
    first_step(inverse, level.solved(r).ravel(), single(1 / middle), d.ravel(), x.ravel())
    level.matrix.added(r, -1, d)
    scale = single(2 * rho / half)
    after = level.solved(r).ravel()
    next_step(inverse, after, single(rho / sigma), scale, d.ravel(), x.ravel())
    return d


def largest_eigenvalue(
    A: RowBlocks | BorderedFactor, diagonal: Floats, solved: Callable[[Any], Any] | None = None
) -> float:
    """Upper bound of the spectrum of B A, from a few steps of Lanczos.

    They run in the inner product of the inverse of B, in which B A is symmetric.

    Parameters
    ----------
    A : RowBlocks or BorderedFactor
    diagonal : (n,) array
    solved : callable, optional
        B r of a residual r in single precision; without it B is the inverse diagonal.
    """
    inverse = reciprocal(diagonal)

    def image(w: Floats) -> Floats:
        z = inverse * w if solved is None else solved(w.astype(np.float32))
        return np.asarray(z, dtype=float)

    w = np.sqrt(np.maximum(diagonal, 0.0)) * np.random.default_rng(_START).standard_normal(
        len(diagonal)
    )
    if A.idle is not None:
        w[A.idle] = 0.0
    z, before = image(w), np.zeros_like(w)
    beta = float(np.sqrt(np.einsum("i,i", w, z)))
    alphas: list[float] = []
    betas: list[float] = []
    for _ in range(_LANCZOS):
        q, p = w / beta, z / beta
        w = A.times(p.astype(A.dtype)) - beta * before
        alphas.append(float(np.einsum("i,i", w, p)))
        w -= alphas[-1] * q
        z, before = image(w), q
        beta = float(np.sqrt(max(np.einsum("i,i", w, z), 0.0)))
        if beta <= 1e-6 * abs(alphas[-1]):
            break
        betas.append(beta)
    n = len(alphas)
    T = np.diag(alphas) + np.diag(betas[: n - 1], 1) + np.diag(betas[: n - 1], -1)
    return SAFETY * float(np.linalg.eigvalsh(T)[-1])


def reciprocal(diagonal: Floats) -> Floats:
    """1 / diagonal, 0 where an aggregate was too small for all motions."""
    alive = diagonal > 1e-12 * diagonal.max(initial=0.0)
    return np.where(alive, 1 / np.where(alive, diagonal, 1.0), 0.0)
