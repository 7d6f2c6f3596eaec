"""Contact by conjugate gradients among displacements that keep closed crack faces closed.

The gaps of the closed groups vanish exactly throughout: start and search directions are projected
onto the null space of their rows N_A by I - D^-1 N_A^T (N_A D^-1 N_A^T)^-1 N_A with the diagonal D
of the matrix, which is cheap and local (projected preconditioned conjugate gradients, Gould,
Hribar and Nocedal, 2001). The set is corrected on the way, long before the displacements have
converged: a wrong set is seen early, and most sets cost one or two steps.
"""

import itertools
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar, cast

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ConvergenceError
from xcrack.base.machine import map_tasks

# Iterations that run beside one another, so that one pass over a matrix serves them all.

_BESIDE = 4  # iterations at a time: as many vectors as one pass over a matrix takes

Result = TypeVar("Result")
Apply = Callable[[Floats], Floats]
ApplyAll = Callable[[Sequence[Floats]], list[Floats]]


class Request(Enum):
    """What an iteration asks for."""

    TIMES = "K v"
    CYCLE = "V r"


VectorRequest = tuple[Request, Floats]
Iteration = Generator[VectorRequest, Floats, Result]


@dataclass(frozen=True, eq=False)
class Operator:
    """A symmetric positive matrix and what is needed to solve with it.

    Attributes
    ----------
    times : callable
        v -> K v.
    cycle : callable
        r -> V r, an approximate inverse, symmetric and positive.
    diagonal : (n,) array
    null : (m, k) array
        Orthonormal vectors that K sends to zero, in the first m unknowns: the others of theirs are
        zero. k = 0 for a regular matrix.
    times_all, cycle_all : callable, optional
        The same of several vectors, with the same bits.
    """

    times: Apply
    cycle: Apply
    diagonal: Floats
    null: Floats
    times_all: ApplyAll | None = None
    cycle_all: ApplyAll | None = None

    def answers(self, ask: Request, vectors: Sequence[Floats]) -> list[Floats]:
        """What is asked for of several vectors."""
        times_one, all_times = self.times, self.times_all
        if ask is Request.CYCLE:
            times_one, all_times = self.cycle, self.cycle_all
        if len(vectors) == 1 or all_times is None:
            return [times_one(v) for v in vectors]
        return all_times(vectors)


def in_lockstep(K: Operator, iterations: Sequence[Iteration[Result]]) -> list[Result]:
    """Results of iterations; threads run what each does between its requests.

    Parameters
    ----------
    K : Operator
    iterations : sequence of generators
    """
    results: list[Any] = [None] * len(iterations)

    def advance_run(task: tuple[int, Floats | None]) -> VectorRequest | None:
        k, answer = task
        try:
            return iterations[k].send(cast(Floats, answer))
        except StopIteration as end:
            results[k] = end.value
            return None

    waiting_tasks: dict[int, VectorRequest] = {}
    tasks: list[tuple[int, Floats | None]] = []
    next_numbers = iter(range(len(iterations)))
    while True:
        free_places = _BESIDE - len(waiting_tasks) - len(tasks)
        tasks += [(k, None) for k in itertools.islice(next_numbers, free_places)]
        if not tasks and not waiting_tasks:
            return cast(list[Result], results)
        for (k, _), request in zip(tasks, map_tasks(advance_run, tasks), strict=True):
            if request is not None:
                waiting_tasks[k] = request
        tasks = []
        if not waiting_tasks:
            continue
        # Products first: those who looked at their sets meet the others at the next cycle.
        products = any(ask is Request.TIMES for ask, _ in waiting_tasks.values())
        ask = Request.TIMES if products else Request.CYCLE
        served_tasks = [
            k for k, (request_of_one, _) in waiting_tasks.items() if request_of_one is ask
        ]
        vectors = [waiting_tasks.pop(k)[1] for k in served_tasks]
        tasks = list(zip(served_tasks, K.answers(ask, vectors), strict=True))


TOLERANCE = 1e-8  # residual relative to the load: displacements and pressures to about as much
MOST_STEPS = 2000
_MOST_SETS = 400
_FIRST_CHECK = 0.1  # relative residual at which the set is looked at first, then every factor 0.1
_DENSE = 400  # closed groups up to which a dense factor is quicker
_REDUNDANT = 1e-10  # eigenvalues below which closed groups count as dependent


@dataclass(frozen=True, eq=False)
class ProjectedState:
    """Solution of one load state with contact.

    Attributes
    ----------
    y : (n,) array
        Displacements in the unknowns of the operator.
    pressure : (g,) array, stress
    gap : (g,) array
        Weak gaps, integrals of the function times the gap.
    active : (g,) array of bool
    iterations : int
        Steps of conjugate gradients.
    sets : int
        Sets tried.
    """

    y: Floats
    pressure: Floats
    gap: Floats
    active: Bools
    iterations: int
    sets: int


@dataclass(frozen=True, eq=False)
class _Plane:
    """Displacements with N y + d = 0 for some rows, which are scaled to 1 in the norm of D^-1."""

    rows: sp.csr_matrix
    offset: Floats
    scale: Floats
    scaled_rows: sp.csr_matrix
    solve: Apply

    def projection(self, y: Floats) -> Floats:
        return y - self.scaled_rows @ self.solve(self.rows @ y + self.offset)

    def project(self, z: Floats) -> Floats:
        return z - self.scaled_rows @ self.solve(self.rows @ z)

    def pressure_of(self, r: Floats) -> Floats:
        """Multipliers of the part of a residual that pressures carry."""
        return self.solve(self.scaled_rows.T @ r)


def _search_plane(N: sp.csr_matrix, d: Floats, scale: Floats, diagonal: Floats) -> _Plane:
    rows = sp.csr_matrix(sp.diags(scale) @ N)
    scaled_rows = sp.csr_matrix(sp.diags(1 / diagonal) @ rows.T)
    return _Plane(rows, scale * d, scale, scaled_rows, _solver(sp.csc_matrix(rows @ scaled_rows)))


def _solver(gram: sp.csc_matrix) -> Apply:
    """Solution of a positive system with a diagonal of ones; redundant rows share."""
    n = gram.shape[0]
    if n <= _DENSE:
        A = gram.toarray()
        try:
            factor = scipy.linalg.cho_factor(A)
            if np.diag(factor[0]).min() > np.sqrt(_REDUNDANT):
                return lambda b: np.asarray(scipy.linalg.cho_solve(factor, b))
        except scipy.linalg.LinAlgError:
            pass
        inverse = np.linalg.pinv(A, _REDUNDANT, hermitian=True)
        return lambda b: np.asarray(inverse @ b)
    ridge = sp.identity(n, format="csc") * _REDUNDANT
    lu = sla.splu(gram + ridge, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)

    def solve(b: Floats) -> Floats:
        x = np.asarray(lu.solve(b))
        # One refinement takes the ridge's trace to round-off.
        return x + np.asarray(lu.solve(b - gram @ x))

    return solve


class _Descent:
    """Conjugate gradients in a plane, resumed after each look at the set."""

    def __init__(self, K: Operator, b: Floats, plane: _Plane | None, y: Floats) -> None:
        self.K, self.b, self.plane = K, b, plane
        self.y = y.copy() if plane is None else plane.projection(y)
        self.row_forces = np.zeros(0 if plane is None else len(plane.scale))
        self.p: Floats | None = None
        self.rz, self.norm = 1.0, np.inf

    @property
    def pressure(self) -> Floats:
        """Of the closed groups: all that was taken off the residual."""
        return np.zeros(0) if self.plane is None else -self.plane.scale * self.row_forces

    def begin(self) -> Iteration[None]:
        image = (yield Request.TIMES, self.y) if self.y.any() else 0.0
        self._goes_on(self.b - image)

    def step(self) -> Iteration[None]:
        z = yield Request.CYCLE, self.r
        z = z if self.plane is None else self.plane.project(z)
        rz = _dot(self.r, z)
        if self.p is None:
            self.p = z
        else:
            self.p *= rz / self.rz
            self.p += z
        del z  # memory counts while others are answered
        q = yield Request.TIMES, self.p
        curvature = _dot(self.p, q)
        if not curvature > 0 or not np.isfinite(rz):
            raise ConvergenceError(
                "the conjugate gradients broke down: the stiffness is singular. Is the body "
                "supported, or does a crack cut off a piece that nothing supports?"
            )
        a = rz / curvature
        self.y += a * self.p
        q *= a
        self.rz = rz
        self._goes_on(np.subtract(self.r, q, out=q))

    def _goes_on(self, r: Floats) -> None:
        """Take off what pressures carry and what would move the body."""
        if self.plane is not None:
            correction = self.plane.pressure_of(r)
            r -= self.plane.rows.T @ correction
            self.row_forces += correction
        self.r = _without_motions(self.K.null, r)
        self.norm = _norm(r)


def _without_motions(null: Floats, r: Floats) -> Floats:
    """Take rigid motions off a vector, which is changed."""
    if null.shape[1]:
        r[: len(null)] -= null @ (null.T @ r[: len(null)])
    return r


def _dot(a: Floats, b: Floats) -> float:
    # Without threads: the same sum on any machine.
    return float(np.einsum("i,i", a, b))


def _norm(a: Floats) -> float:
    return float(np.sqrt(_dot(a, a)))


def conjugate_gradients_steps(
    K: Operator, b: Floats, start: Floats, tolerance: float = TOLERANCE, limit: int = MOST_STEPS
) -> Iteration[tuple[Floats, int]]:
    """Solve K y = b, and count the steps; run by `in_lockstep`.

    Parameters
    ----------
    K : Operator
    b : (n,) array
    start : (n,) array
        First guess.
    tolerance : float
        Residual relative to b at which to stop.
    limit : int
        Most steps.

    Raises
    ------
    ConvergenceError
        No solution after so many steps; the message carries the residual.
    """
    size = _norm(b)
    if size == 0:
        return np.zeros_like(b), 0
    descent = _Descent(K, b, None, start)
    yield from descent.begin()
    steps = 0
    while not descent.norm <= tolerance * size:
        if steps == limit:
            raise ConvergenceError(
                f"the conjugate gradients did not converge: after {steps} steps the residual is "
                f"{descent.norm / size:.3g} of the load, not {tolerance:.3g}. Is the body "
                "supported? A direct solver, or a mesh without flat cells, may help."
            )
        yield from descent.step()
        steps += 1
    return _without_motions(K.null, descent.y), steps


def projected_steps(
    K: Operator,
    b: Floats,
    N: sp.csr_matrix,
    d: Floats,
    measure: Floats,
    stiffness: float,
    start: Bools,
    y: Floats,
    tolerance: float = TOLERANCE,
    limit: int = MOST_STEPS,
) -> Iteration[ProjectedState]:
    """Solve K y = b + N^T lam with 0 <= lam, N y + d >= 0 and lam (N y + d) = 0.

    Parameters
    ----------
    K : Operator
    b : (n,) array
    N : sparse matrix (g, n)
        Weak gaps of the unknowns.
    d : (g,) array
        Weak gaps of imposed displacements.
    measure : (g,) array
        Integral of each multiplier function.
    stiffness : float, stress / length
        Weighs gaps against pressures in the prediction of the set.
    start : (g,) array of bool
        First guess of the closed set.
    y : (n,) array
        First guess of the displacements.
    tolerance : float
        Residual relative to the load at which to stop.
    limit : int
        Most steps.

    Raises
    ------
    ConvergenceError
        No solution within so many steps or sets; the message carries residual and set.
    """
    N = sp.csr_matrix(N)
    weight = np.asarray(N.multiply(N) @ (1 / K.diagonal)).ravel()
    is_movable = weight > 0
    scale = np.where(is_movable, 1 / np.sqrt(np.where(is_movable, weight, 1.0)), 0.0)
    loop = _Loop(K, b, N, d, measure, stiffness, is_movable, scale, tolerance, limit)
    return (yield from loop.run(np.array(start, dtype=bool) & is_movable, y))


@dataclass(eq=False)
class _Loop:
    K: Operator
    b: Floats
    N: sp.csr_matrix
    d: Floats
    measure: Floats
    stiffness: float
    is_movable: Bools
    scale: Floats
    tolerance: float
    limit: int
    steps: int = 0
    sets: int = 0

    def run(self, active: Bools, y: Floats) -> Iteration[ProjectedState]:
        if not (np.isfinite(self.b).all() and np.isfinite(self.d).all()):
            self._give_up(float("nan"), active)
        size = yield from self._size()
        if size == 0:
            y = np.zeros_like(y)
        check = _FIRST_CHECK
        visited_sets: set[bytes] = set()
        by_one = False
        while True:
            self.sets += 1
            descent = _Descent(self.K, self.b, self._plane_of(active), y)
            yield from descent.begin()
            pressure, gap, next_set = yield from self._settle(descent, active, size, check)
            if np.array_equal(next_set, active):
                y = _without_motions(self.K.null, descent.y)
                return self._result(y, pressure, gap, active)
            y = descent.y
            accuracy = max(self.tolerance, descent.norm / size)
            if by_one:
                # The least index that is wrong: such a sequence of sets is finite (Murty, 1974).
                first = int(np.argmax(next_set != active))
                next_set = active.copy()
                next_set[first] = not next_set[first]
            elif next_set.tobytes() in visited_sets:
                by_one = check <= self.tolerance
                check = max(self.tolerance, 0.01 * min(check, accuracy))
                visited_sets.clear()
            visited_sets.add(next_set.tobytes())
            if self.sets >= _MOST_SETS:
                self._give_up(descent.norm / size, next_set)
            active = next_set

    def _settle(
        self, descent: _Descent, is_active: Bools, size: float, check: float
    ) -> Iteration[tuple[Floats, Floats, Bools]]:
        """Go down until the set is seen to be wrong, or has been right to the end."""
        is_fresh = True
        while True:
            while descent.norm > max(check, self.tolerance) * size or (
                is_fresh and descent.norm > self.tolerance * size
            ):
                if self.steps == self.limit:
                    self._give_up(descent.norm / size, is_active)
                yield from descent.step()
                self.steps += 1
                is_fresh = False
            pressure, gap, next_set = self._predicted_set(descent, is_active)
            if not np.array_equal(next_set, is_active) or descent.norm <= self.tolerance * size:
                return pressure, gap, next_set
            check = max(self.tolerance, 0.1 * min(check, descent.norm / size))

    def _predicted_set(self, descent: _Descent, is_active: Bools) -> tuple[Floats, Floats, Bools]:
        pressure = np.zeros(len(is_active))
        pressure[is_active] = descent.pressure
        gap = self.N @ descent.y + self.d
        gap[is_active] = 0.0
        trial = np.where(self.is_movable, pressure - self.stiffness * gap / self.measure, 0.0)
        # What lies within the accuracy of the iteration changes nothing: faces that only touch
        # must not make the set flicker.
        doubt = self.tolerance * float(np.abs(trial).max(initial=0.0))
        return pressure, gap, np.where(np.abs(trial) > doubt, trial > 0, is_active)

    def _plane_of(self, is_active: Bools) -> _Plane | None:
        if not is_active.any():
            return None
        rows = np.nonzero(is_active)[0]
        return _search_plane(self.N[rows], self.d[rows], self.scale[rows], self.K.diagonal)

    def _size(self) -> Iteration[float]:
        """Size of the load; where only gaps are imposed, of the forces that close them."""
        size = _norm(self.b)
        plane = self._plane_of(self.is_movable)
        if size > 0 or plane is None:
            return size
        return _norm((yield Request.TIMES, plane.projection(np.zeros(len(self.b)))))

    def _result(self, y: Floats, pressure: Floats, gap: Floats, is_active: Bools) -> ProjectedState:
        length = np.abs(gap / self.measure).max(initial=0.0)
        is_overlapping = ~self.is_movable & (gap / self.measure < -1e-8 * length)
        if is_overlapping.any():
            raise ConvergenceError(
                f"contact: {int(is_overlapping.sum())} of {len(gap)} groups are pressed into each "
                f"other by the supports, with a smallest gap of {gap[is_overlapping].min():.3g}; "
                "no pressure can open them."
            )
        return ProjectedState(y, np.maximum(pressure, 0.0), gap, is_active, self.steps, self.sets)

    def _give_up(self, residual: float, is_active: Bools) -> None:
        raise ConvergenceError(
            f"contact: after {self.steps} steps of conjugate gradients and {self.sets} sets the "
            f"residual is {residual:.3g} of the load and {int(is_active.sum())} of "
            f"{len(is_active)} groups are closed. Refine the mesh along the crack, start from "
            'Numerics(initial_set="open"), or choose a direct solver.'
        )


__all__ = []
