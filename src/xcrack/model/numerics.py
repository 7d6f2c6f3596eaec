"""Everything that is method, not scene, in one place."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import wraps
from typing import Any

from xcrack.base.checks import number, shown, whole
from xcrack.base.errors import ProblemError


def _check_choices(given: object, **choices: tuple[object, ...]) -> None:
    """Raise where a field has none of its values; 1 is not True."""
    for name, allowed in choices.items():
        value = getattr(given, name)
        if not any(type(value) is type(a) and value == a for a in allowed):
            words = " or ".join(repr(a) for a in allowed)
            raise ProblemError(f"{type(given).__name__}({name}={shown(value)}): give {words}.")


@dataclass(frozen=True)
class Comparison:
    """Methods that xcrack does not use, to compare it with; reachable only through `Numerics`.

    Parameters
    ----------
    tip_basis : {"scalar", "vectorial"}
        Unknowns of a point with tip functions. Scalar: one for each function and component.
        Vectorial: one a mode, two in 2D and three in 3D, the leading fields of K_I to K_III; fewer
        unknowns, but nothing beside the modes.
    update : {"explicit", "nodal"}
        Where the level sets of a crack in 2D come from. Explicit: distances to its polyline.
        Nodal: stored at the nodes and changed by the frame of each advance (after Duflot, 2007);
        it loses cracks that turn by more than about 120 degrees.
    lips : {"multipliers", "penalty", "augmented", "nitsche"}
        What prevents crack faces from overlapping. The alternatives to multipliers need a
        factorisation. Penalty: a spring at each point of the faces that overlaps. Augmented: an
        augmented Lagrangian, whose multipliers live in the space that `Numerics.multipliers` names
        and are updated until they stay. Nitsche: the stress of the faces instead of multipliers,
        with a penalty that makes it stable (symmetric).
    penalty : float, optional
        Stiffness of the springs per area of crack face, as a factor of E over the size of a cell.
        None: 100 (penalty), 10 (augmented), 40 (nitsche). The overlap of a penalty falls with it,
        and the pressure starts to oscillate; an augmented Lagrangian takes fewer updates; Nitsche
        is unstable below a bound that depends on order and cells.

    Raises
    ------
    ProblemError
        A word or number that is not one of these.
    """

    tip_basis: str = "scalar"
    update: str = "explicit"
    lips: str = "multipliers"
    penalty: float | None = None

    def __post_init__(self) -> None:
        _check_choices(
            self,
            tip_basis=("scalar", "vectorial"),
            update=("explicit", "nodal"),
            lips=("multipliers", "penalty", "augmented", "nitsche"),
        )
        if self.penalty is not None:
            number(self.penalty, "Comparison: penalty", above=0)


@dataclass(frozen=True)
class Numerics:
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
    linear : {"auto", "direct", "iterative"}
        Linear solver. Auto: a factorisation in 2D and below 4 000 unknowns (8 000 at order
        2), above that in 3D conjugate gradients with a multigrid hierarchy: a factor of a 3D body
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
    comparison : Comparison
        Methods to compare with.

    Raises
    ------
    ProblemError
        A word or number that is not one of these.
    """

    enrichment: str = "geometric"
    radius: float | None = None
    functions: int = 4
    multipliers: str = "reduced"
    consistent: bool = True
    orthonormal: str = "star"
    patch: bool = False
    points: int = 4
    domain: float | None = None
    linear: str = "auto"
    initial_set: str = "closed"
    substeps: int = 10
    threads: int | None = field(default=None, metadata={"changes_results": False})
    comparison: Comparison = Comparison()

    def __post_init__(self) -> None:
        _check_choices(
            self,
            enrichment=("geometric", "topological"),
            functions=(4, 2),
            multipliers=("reduced", "sparse", "naive"),
            orthonormal=("star", "node", "none"),
            linear=("auto", "direct", "iterative"),
            initial_set=("closed", "open"),
            consistent=(True, False),
            patch=(True, False),
        )
        for name in ("radius", "domain"):
            if getattr(self, name) is not None:
                number(getattr(self, name), f"Numerics: {name}", above=0)
        whole(self.points, "Numerics: points", least=2, most=32)
        whole(self.substeps, "Numerics: substeps", least=1, most=10_000)
        if self.threads is not None:
            whole(self.threads, "Numerics: threads", least=1)
        if not isinstance(self.comparison, Comparison):
            raise ProblemError(
                f"Numerics: comparison = {shown(self.comparison)}: give Comparison(lips=...)."
            )
        if self.comparison.tip_basis == "vectorial" and self.functions != 4:
            raise ProblemError(
                'Comparison(tip_basis="vectorial") combines all four tip functions: leave '
                f"functions = {self.functions} out."
            )
        if self.comparison.lips != "multipliers" and self.linear == "iterative":
            raise ProblemError(
                f'Comparison(lips="{self.comparison.lips}") with linear="iterative": conjugate '
                'gradients know multipliers only; give linear="direct", or leave lips out.'
            )


def _name_moved(cls: type) -> None:
    """Let keywords that have moved to `Comparison` say so instead of being unknown."""
    make = cls.__init__  # type: ignore[misc]
    moved = [field.name for field in fields(Comparison)]

    @wraps(make)
    def checked(self: object, *values: object, **named: object) -> None:
        for name in moved:
            if name in named:
                raise ProblemError(
                    f"Numerics({name}=...) is for comparison with other methods: give "
                    f"Numerics(comparison=Comparison({name}={shown(named[name])}))."
                )
        make(self, *values, **named)

    cls.__init__ = checked  # type: ignore[misc]


_name_moved(Numerics)


def with_choices(numerics: Numerics, choices: Mapping[str, Any]) -> Numerics:
    """Other choices of method by name, those of `Comparison` among them.

    Parameters
    ----------
    numerics : Numerics
    choices : mapping of name to value
    """
    inner = {field.name for field in fields(Comparison)} & set(choices)
    outer = {name: value for name, value in choices.items() if name not in inner}
    if inner:
        own = {name: choices[name] for name in inner}
        outer["comparison"] = replace(numerics.comparison, **own)
    return replace(numerics, **outer)


__all__ = ["Comparison", "Numerics", "with_choices"]
