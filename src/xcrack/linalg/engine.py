"""What load states and contact ask of a linear system, whether it is factored or iterated."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats
from xcrack.fem.assembly import Stiffness
from xcrack.linalg.reuse import SolverState


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
    closed : bool
        State that groups start from where nothing is known.
    """

    N: sp.csr_matrix
    measure: Floats
    stiffness: float
    closed: bool


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
    def shared(self) -> str: ...  # noqa: D102

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
        latest: Floats | None = None,
        opened: Floats | None = None,
    ) -> list[StateContact]:
        """Solve load states with crack faces that may touch.

        Parameters
        ----------
        rows : ContactRows
        f, u_imposed : (n_dof, states) arrays
        start : sequence of (g,) arrays of bool or None
            First guess of each state's closed set.
        latest, opened : (n_dof, states) arrays, optional
            The last displacements, and those with open faces.
        """
        ...

    def condensed(self, N: sp.csr_matrix, f: Floats, u_imposed: Floats) -> CondensedSystem:
        """The system as rows `(g, n_dof)` see it, for load states `(n_dof, states)`."""
        ...

    def handed_on(self, reuse: SolverState) -> SolverState:
        """What the next solve may use, with what this system adds to it."""
        ...


__all__ = ["CondensedSystem", "ContactRows", "Engine", "SolveCount", "StateContact"]
