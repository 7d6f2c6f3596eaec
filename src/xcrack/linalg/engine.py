"""What load states and contact ask of a linear system, and what a solve hands on to the next."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.fem.assembly import Bulk, Stiffness
from xcrack.linalg.multifrontal import Factor, Tree
from xcrack.linalg.multigrid import Hierarchy
from xcrack.model.problem import Problem

# Unknowns of a 3D body above which a factorisation costs more, by order (measured).
_DIRECT = {1: 4_000, 2: 8_000}
# And at order 2 where no step of a run comes before or behind, which would share its levels.
_DIRECT_ALONE = 15_000
# With friction conjugate gradients solve once for each row of pressure and shear: at 4 800 unknowns
# of order 1 a factor takes a seventh of their time, at 17 000 of order 2 a seventeenth, and beyond
# these unknowns more than 1.4 GB.
_DIRECT_WITH_FRICTION = 50_000
# Order 1 above these looks at open faces first: at 30 000 that saves 57 % of a solve where they
# stay open, and costs 16 % where they touch (12 000: 22 and 27 %; order 2, 40 000: 40 and 43 %).
_OPEN_FIRST = 20_000
_SAME = 1e-15  # share of the largest entry up to which vectors are multiples of each other


@dataclass(frozen=True, eq=False)
class SlipField:
    """Slip of the faces of one crack, by place along it.

    Attributes
    ----------
    points : (n, d) array, length
        Of the crack; in 3D the points of its faces.
    place : (q,) array
        Rising: number of the face, plus share of its length. In 3D the width of each point's piece
        of face, length.
    slip : (q,) array, in 3D (q, 3), length
    """

    points: Floats
    place: Floats
    slip: Floats


@dataclass(frozen=True, eq=False)
class SolverState:
    """Work of an earlier solve in the same mesh; an empty one is ``SolverState()``.

    Attributes
    ----------
    centre : tuple of (g, d) arrays or None
        Where the multipliers of each crack sit; None for a crack without.
    active : tuple of (states, g) arrays of bool or None
        Closed sets of all load states.
    tree : Tree, optional
        Halves of the mesh, in whose order a factorisation takes the unknowns.
    factor : Factor, optional
        Of the last crack, whose panels serve the next one where nothing changed.
    bulk : Bulk, optional
        Stiffness of the uncracked body, and cut cells that may serve the next crack.
    hierarchy : Hierarchy, optional
        Coarse levels of the iterative solver.
    levels : tuple of float
        Factors of a spectrum that the closed sets belong to, where levels were refined.
    slip : tuple of SlipField or None
        Of the last load state, with friction: where a repeated cycle of the grown crack begins.
    """

    centre: tuple[Floats | None, ...] = ()
    active: tuple[Bools | None, ...] = ()
    tree: Tree | None = None
    factor: Factor | None = None
    bulk: Bulk | None = None
    hierarchy: Hierarchy | None = None
    levels: tuple[float, ...] = ()
    slip: tuple[SlipField | None, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # A factor holds addresses: in another process they mean nothing.
        return SolverState, (
            self.centre, self.active, None, None, self.bulk, self.hierarchy, self.levels, self.slip,
        )  # fmt: skip

    def without_matrices(self) -> "SolverState":
        """The part that fits into a file, and that decides the last bit of the next solve."""
        return SolverState(self.centre, self.active, levels=self.levels, slip=self.slip)

    def without_factor(self) -> "SolverState":
        """The part that is small enough to be kept with each solution."""
        return replace(self, factor=None)

    def was_closed(self, c: int) -> bool:
        """Whether any group of crack c was closed in any state."""
        closed_sets = self.active[c] if c < len(self.active) else None
        return closed_sets is not None and bool(closed_sets.any())

    def start(self, c: int, centre: Floats, state: int) -> Bools | None:
        """Closed set of the nearest multipliers `(g,)`, or None where nothing is known.

        Parameters
        ----------
        c : int
            Crack.
        centre : (g, d) array, length
            Where its multipliers sit now.
        state : int
        """
        if c >= len(self.centre):
            return None
        centres, closed_sets = self.centre[c], self.active[c]
        if centres is None or closed_sets is None or state >= len(closed_sets) or not len(centres):
            return None
        nearest_rows = cKDTree(centres).query(centre)[1]
        return np.asarray(closed_sets[state][nearest_rows])


@dataclass
class SolveCount:
    """Operations of a solve, counted for its report."""

    factorisations: int = 0
    solves: int = 0
    iterations: int = 0


@dataclass(frozen=True, eq=False)
class StateContact:
    """Contact of one load state.

    Attributes
    ----------
    pressure : (g,) array, stress
        Of each multiplier function.
    gap : (g,) array
        Weak gaps, integrals of the function times the gap.
    active : (g,) array of bool
        The closed ones.
    sets : int
        Closed sets tried.
    u : (n_dof,) array, length, or None
        Displacements; None where only the pressures were solved for.
    fallback : bool
        The set cycled and was found by non-negative least squares instead.
    dual : (g, g) array, optional
        F = N K^-1 N^T, which all states share; None where it was never made.
    """

    pressure: Floats
    gap: Floats
    active: Bools
    sets: int
    u: Floats | None = None
    fallback: bool = False
    dual: Floats | None = None


@dataclass(frozen=True, eq=False)
class ContactRows:
    """Unilateral conditions N u >= 0 of one system.

    Attributes
    ----------
    N : sparse matrix (g, n_dof)
        Rows of the weak gaps.
    measure : (g,) array
        Integral of each multiplier function.
    stiffness : float, stress / length
        Weighs gaps against pressures in the prediction of the set; any size works, E / h is
        natural.
    is_closed : bool
        State that groups start from where nothing is known.
    """

    N: sp.csr_matrix
    measure: Floats
    stiffness: float
    is_closed: bool


@dataclass(frozen=True, eq=False)
class CondensedSystem:
    """A system as rows of gaps see it.

    Attributes
    ----------
    dual : (g, g) array
        F = N K^-1 N^T.
    gap : (g, states) array
        Weak gaps of the load states without tractions.
    displacements : callable
        Displacements `(n_dof, states)` of the load states with tractions `(g, states)`.
    """

    dual: Floats
    gap: Floats
    displacements: Callable[[Floats], Floats]


class Engine(Protocol):
    """A linear system in a basis of its own, which all load states share.

    Attributes
    ----------
    matrix : sparse matrix (n_dof, n_dof)
        Stiffness in the basis of the space.
    basis : sparse matrix (n_dof, k)
        Columns of the solver's basis; zero in the rows of known unknowns.
    count : SolveCount
    shared : str
        What load states share, in words.
    reason : str
        Why this engine was taken; empty for the usual one.
    """

    @property
    def matrix(self) -> sp.csr_matrix | Stiffness: ...  # noqa: D102

    @property
    def basis(self) -> sp.csr_matrix: ...  # noqa: D102

    @property
    def count(self) -> SolveCount: ...  # noqa: D102

    @property
    def shared_part(self) -> str: ...  # noqa: D102

    @property
    def reason(self) -> str: ...  # noqa: D102

    def solve(
        self, f: Floats, u_imposed: Floats | None = None, start: Floats | None = None
    ) -> Floats:
        """Displacements for loads `(n_dof,)` or `(n_dof, k)` and known values of the same shape.

        `start` is a first guess of the displacements; a factorisation needs none.
        """
        ...

    def first_look(
        self, f: Floats, u_imposed: Floats, closed_before: bool
    ) -> tuple[Floats | None, bool]:
        """Displacements with open faces that show which faces overlap, and whether they are exact.

        None where closed sets of an earlier step make a look unnecessary.
        """
        ...

    def contact(
        self,
        rows: ContactRows,
        f: Floats,
        u_imposed: Floats,
        start: Sequence[Bools | None],
        last_solution: Floats | None = None,
        u_opened: Floats | None = None,
    ) -> list[StateContact]:
        """Solve load states with crack faces that may touch.

        Parameters
        ----------
        rows : ContactRows
        f, u_imposed : (n_dof, states) arrays
        start : sequence of (g,) arrays of bool or None
            First guess of each state's closed set.
        last_solution, u_opened : (n_dof, states) arrays, optional
            The last displacements, and those with open faces.
        """
        ...

    def condense(self, N: sp.csr_matrix, f: Floats, u_imposed: Floats) -> CondensedSystem:
        """The system as rows `(g, n_dof)` see it, for load states `(n_dof, states)`."""
        ...

    def handed_on(self, reuse: SolverState) -> SolverState:
        """What the next solve may use, with what this system adds to it."""
        ...


def proportional_columns(b: Floats, tolerance: float = _SAME) -> tuple[Ints, Floats]:
    """First column that each of `(n, k)` is a multiple of, to round-off, and the factor `(k,)`.

    Load states are often one load, scaled. `tolerance` is the share of the largest entry by which
    they may differ.
    """
    first, scale = np.arange(b.shape[1]), np.ones(b.shape[1])
    for k in range(1, len(first)):
        for i in range(k):
            at = int(np.abs(b[:, i]).argmax())
            if first[i] != i or b[at, i] == 0:
                continue
            factor = b[at, k] / b[at, i]
            difference = np.abs(b[:, k] - factor * b[:, i]).max()
            if difference <= tolerance * np.abs(b[at, k]):
                first[k], scale[k] = i, factor
                break
    return first, scale


def is_open_first(problem: Problem, n: int) -> bool:
    """Whether conjugate gradients look at open faces before a factor is made for friction."""
    if n <= _OPEN_FIRST or problem.order == 2 or problem.contact == "on":
        return False
    return takes_iterations(problem, n, has_contact=False) and not takes_iterations(problem, n)


def takes_iterations(
    problem: Problem, n: int, has_contact: bool = True, is_alone: bool = True
) -> bool:
    """Whether a system of n unknowns is solved by conjugate gradients.

    Parameters
    ----------
    problem : Problem
    n : int
    has_contact : bool
        Whether faces that have friction touch.
    is_alone : bool
        Whether the scene is solved for itself, and not as a step of a run.
    """
    linear_solver = problem.numerics.linear
    if linear_solver != "auto":
        return linear_solver == "iterative"
    is_rubbing = has_contact and may_rub(problem)
    n_direct = _DIRECT_WITH_FRICTION if is_rubbing else _DIRECT[problem.order or 1]
    if is_alone and problem.order == 2:
        n_direct = max(n_direct, _DIRECT_ALONE)
    is_large = problem.mesh.dim == 3 and n > n_direct
    if problem.order == 2 and any(crack.ends_on for crack in problem.cracks):
        return False  # quadratic functions of both cracks nearly vanish together beside a junction
    return is_large and problem.numerics.contact_method is None  # others change the matrix


def may_rub(problem: Problem) -> bool:
    """Whether crack faces have friction."""
    return problem.contact != "off" and any(problem.frictions)


__all__ = [
    "CondensedSystem",
    "ContactRows",
    "Engine",
    "SolveCount",
    "StateContact",
    "is_open_first",
    "may_rub",
    "takes_iterations",
]
