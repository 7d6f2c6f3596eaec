"""Everything that is method, not scene, in one place."""

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from xcrack.base.arguments import Choice, Declared, Flag, Number, Part, Whole
from xcrack.base.arrays import Bools, Floats
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH

_METHODS = "one of xcrack.verification.methods, or leave it out"


class ContactMethod:
    """Another way than multipliers to keep crack faces apart, as a value that `Numerics` takes.

    `analysis.contact` asks it for the space of its pressures and for the solutions of all load
    states; `xcrack.verification.methods` has a penalty, an augmented Lagrangian and Nitsche's
    method. All need a factorisation, and have no estimate of the error.

    Attributes
    ----------
    label : str
        What reports and messages call it.
    has_unknowns : bool
        Whether its pressures are unknowns.
    friction_dims : tuple of int
        Dimensions in which it carries friction.
    updates : bool
        With friction: whether springs are made rigid by updates, as in an augmented Lagrangian.
    """

    label: ClassVar[str]
    has_unknowns: ClassVar[bool] = False
    friction_dims: ClassVar[tuple[int, ...]] = ()
    updates: ClassVar[bool] = False

    def pressure_space(self, problem: Any, model: Any, c: int) -> Any:
        """Where the pressures of crack c live: `Multipliers`."""
        raise NotImplementedError

    def solve_states(self, problem: Any, model: Any, engine: Any, spaces: Any, f: Floats, u_imposed:
                     Floats, start: Any, is_closed: bool, acting: Any) -> Any:  # fmt: skip
        """Contact of all load states, a list of `StateContact`."""
        raise NotImplementedError

    def compliance(self, problem: Any, model: Any, space: Any) -> Floats:
        """Weak gap over traction of each spring `(g,)`, for friction."""
        raise NotImplementedError


class TipBasis:
    """Combinations of the tip functions that replace them in the solver's basis."""

    def label(self, dim: int) -> str:
        """What reports call it."""
        raise NotImplementedError

    def unknowns(self, dim: int) -> int:
        """Unknowns of a point."""
        raise NotImplementedError

    def columns(self, space: Any, material: Any, free: Bools) -> tuple[Any, Bools]:
        """Matrix `(n_dof, n_dof)` of the combinations, and which of its columns are in use."""
        raise NotImplementedError


class LevelSets:
    """Level sets of a crack from elsewhere than its polyline or surface."""

    def of(self, mesh: Any, crack: Any) -> Any:
        """`LevelSet` of a placed crack."""
        raise NotImplementedError


@dataclass(frozen=True)
class Numerics(Declared):
    """Choices of method, with the reason of each default (numbers in docs/measured.md).

    Parameters
    ----------
    enrichment : {"geometric", "topological"}
        Tip functions on all nodes within a fixed radius, or on the nodes of the tip's cell only.
        Geometric: energy rate 1 (order 1) or 2 (order 2) instead of about 0.5.
    radius : float, length, optional
        Radius of the enriched disc. None: 0.3 (order 1) or 0.4 (order 2) of the smallest of crack
        length, distance to the boundary and to another tip, from 2 to 20 cells (40 at order 1).
        In 3D 0.65 of the size of the crack, 0.7 of the distance to a side and 0.45 of that to
        another front, from 2.6 to 3.6 cells; two cells at order 2.
    functions : {4, 2}
        Tip functions; two (those of the modes' leading angular terms) cost accuracy.
    multipliers : {"reduced", "sparse", "naive"}
        Space of the contact multipliers. Reduced: inf-sup stable for any cut. Sparse: in 2D at
        order 2 only one pressure for each group of nodes instead of 1.6, otherwise the same.
        Naive: one unknown for each node, for comparison only; it oscillates.
    consistent : bool
        Correct the gradients of the tip functions so that linear stress fields pass the patch
        test to round-off whatever the quadrature (variationally consistent integration). In 3D
        constant ones.
    orthonormal : {"star", "node", "none"}
        Change of basis before the solver. Star: the unknowns of a node, and the Heaviside
        unknowns of the cut edges whose far end it is, are made orthonormal in energy, so that the
        condition number does not depend on the cut. Node: without those of the edges. None: only
        scaled by the diagonal.
    patch : bool
        Make tip functions orthogonal to the standard and Heaviside functions around them: a
        condition number that grows like h^-2 for iterative solvers. A direct solver needs it not.
    points : int
        Gauss points a direction where tip functions act: those of the sectors round a tip. Plane
        sub-cells that do not touch it are no larger than their distance to it, and have a rule of
        degree 2 points - 3, at least 3.
    domain : float, length, optional
        Outer radius of the first domain of the interaction integral. None: in 2D 2.5 times
        the enriched radius or 4 cells, in 3D 1.05 times it or 2.6 cells, whichever is more, as
        far as body, other tips and the bend of a front allow.
    depth : float, length, optional
        In 3D: distance along a front from a free surface at which K is read that has no limit
        there. None: 2 % of the front's length.
    linear : {"auto", "direct", "iterative"}
        Linear solver. Auto: a factorisation in 2D and below 4 000 unknowns (8 000 at order 2, at
        either order 50 000 with friction, which takes a solve for each row of pressure and shear),
        above that in 3D conjugate gradients with a multigrid hierarchy: a factor of a 3D body
        fills, and its time grows with the square of the unknowns. Iterative does without
        `orthonormal` and `patch`: it has its own basis, orthonormal node by node, at order 2 star
        by star.
    initial_set : {"closed", "open"}
        State of the crack faces that the contact iteration starts from where nothing is known.
    substeps : int
        With friction: parts in which each load state is reached from the one before. A part in
        which open faces close is halved, down to a hundredth of the state.
    threads : int, optional
        Threads that share a solve. None: as many processors as the process may use, by affinity
        and quota, at most 16, or the environment variable XCRACK_THREADS. Results have the same
        bits for any number.
    contact_method : ContactMethod, optional
        Instead of multipliers, to compare with: see `xcrack.verification.methods`.
    tip_basis : TipBasis, optional
        Instead of the tip functions one by one, to compare with.
    level_sets : LevelSets, optional
        Instead of those of the polyline in 2D, to compare with.

    Raises
    ------
    ProblemError
        A word or number that is not one of these.
    """

    enrichment: Annotated[str, Choice(("geometric", "topological"))] = "geometric"
    radius: Annotated[float | None, Number(above=0, unit=LENGTH)] = None
    functions: Annotated[int, Choice((4, 2))] = 4
    multipliers: Annotated[str, Choice(("reduced", "sparse", "naive"))] = "reduced"
    consistent: Annotated[bool, Flag()] = True
    orthonormal: Annotated[str, Choice(("star", "node", "none"))] = "star"
    patch: Annotated[bool, Flag()] = False
    points: Annotated[int, Whole(least=2, most=32)] = 4
    domain: Annotated[float | None, Number(above=0, unit=LENGTH)] = None
    depth: Annotated[float | None, Number(above=0, unit=LENGTH)] = None
    linear: Annotated[str, Choice(("auto", "direct", "iterative"))] = "auto"
    initial_set: Annotated[str, Choice(("closed", "open"))] = "closed"
    substeps: Annotated[int, Whole(least=1, most=10_000)] = 10
    threads: Annotated[int | None, Whole(least=1)] = field(
        default=None, metadata={"changes_results": False}
    )
    contact_method: Annotated[ContactMethod | None, Part(ContactMethod, needs=_METHODS)] = None
    tip_basis: Annotated[TipBasis | None, Part(TipBasis, needs=_METHODS)] = None
    level_sets: Annotated[LevelSets | None, Part(LevelSets, needs=_METHODS)] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tip_basis is not None and self.functions != 4:
            raise ProblemError(
                f"Numerics: a tip_basis combines all four tip functions: leave functions = "
                f"{self.functions} out."
            )
        if self.contact_method is not None and self.linear == "iterative":
            raise ProblemError(
                f'Numerics: {self.contact_method.label} with linear="iterative": conjugate '
                'gradients know multipliers only; give linear="direct", or leave contact_method '
                "out."
            )


__all__ = ["ContactMethod", "LevelSets", "Numerics", "TipBasis"]
