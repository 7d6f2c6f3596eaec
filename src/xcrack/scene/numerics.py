"""Everything that is method, not scene, in one place."""

from dataclasses import dataclass

from xcrack.errors import ProblemError


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
        In space 0.65 of the size of the crack, 0.7 of the distance to a side and 0.45 of that to
        another front, from 2.6 to 3.6 cells; two cells at order 2.
    functions : {4, 2}
        Tip functions; two (those of the modes' leading angular terms) cost accuracy.
    tip_basis : {"scalar", "vectorial"}
        Unknowns of a point with tip functions. Scalar: one for each function and component.
        Vectorial: one a mode, two in the plane and three in space, the leading fields of K_I to
        K_III; fewer unknowns, but nothing beside the modes. For comparison.
    update : {"explicit", "nodal"}
        Where the level sets of a crack in the plane come from. Explicit: distances to its
        polyline. Nodal: kept at the nodes and changed by the frame of each advance (after Duflot,
        2007); for comparison only, it loses cracks that turn by more than about 120 degrees.
    multipliers : {"reduced", "naive"}
        Space of the contact multipliers. Reduced: inf-sup stable for any cut. Naive: one unknown
        for each node, for comparison only; it oscillates.
    lips : {"multipliers", "penalty", "augmented", "nitsche"}
        What keeps the lips apart. The others are opponents of the multipliers, for comparison, and
        need a factorisation. Penalty: a spring at each lip point that overlaps. Augmented: an
        augmented Lagrangian, whose multipliers live in the space that `multipliers` names and are
        updated until they stay. Nitsche: the stress of the lips in the place of multipliers, with
        a penalty that keeps it stable (symmetric).
    penalty : float, optional
        Stiffness of the springs per area of lip, as a factor of E over the size of a cell. None:
        100 (penalty), 10 (augmented), 40 (nitsche). The overlap of a penalty falls with it, and
        the pressure starts to oscillate; an augmented Lagrangian takes fewer updates; Nitsche is
        unstable below a bound that depends on order and cells.
    consistent : bool
        Correct the gradients of the tip functions so that linear stress fields pass the patch
        test to round-off whatever the quadrature (variationally consistent integration). In space
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
        Outer radius of the first domain of the interaction integral. None: in the plane 2.5 times
        the enriched radius or 4 cells, in space 1.05 times it or 2.6 cells, whichever is more, as
        far as body, other tips and the bend of a front allow.
    linear : {"auto", "direct", "iterative"}
        Linear solver. Auto: a factorisation in the plane and below 4 000 unknowns (8 000 at order
        2), above that in space conjugate gradients with a multigrid hierarchy: a factor of a body
        in space fills, and its time grows with the square of the unknowns. Iterative does without
        `orthonormal` and `patch`: it has its own basis, orthonormal node by node, at order 2 star
        by star.
    initial_set : {"closed", "open"}
        State of the lips that the contact iteration starts from where nothing is known.

    Raises
    ------
    ProblemError
        A word or number that is not one of these.
    """

    enrichment: str = "geometric"
    radius: float | None = None
    functions: int = 4
    tip_basis: str = "scalar"
    update: str = "explicit"
    multipliers: str = "reduced"
    lips: str = "multipliers"
    penalty: float | None = None
    consistent: bool = True
    orthonormal: str = "star"
    patch: bool = False
    points: int = 4
    domain: float | None = None
    linear: str = "auto"
    initial_set: str = "closed"

    def __post_init__(self) -> None:
        choices: dict[str, tuple[object, ...]] = {
            "enrichment": ("geometric", "topological"),
            "functions": (4, 2),
            "tip_basis": ("scalar", "vectorial"),
            "update": ("explicit", "nodal"),
            "multipliers": ("reduced", "naive"),
            "lips": ("multipliers", "penalty", "augmented", "nitsche"),
            "orthonormal": ("star", "node", "none"),
            "linear": ("auto", "direct", "iterative"),
            "initial_set": ("closed", "open"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                words = " or ".join(repr(a) for a in allowed)
                raise ProblemError(f"Numerics({name}={getattr(self, name)!r}): give {words}.")
        if self.tip_basis == "vectorial" and self.functions != 4:
            raise ProblemError(
                'Numerics(tip_basis="vectorial") combines all four tip functions: leave '
                f"functions = {self.functions} out."
            )
        for name in ("radius", "domain"):
            value = getattr(self, name)
            if value is not None and not (value > 0 and value < float("inf")):
                raise ProblemError(f"Numerics({name}={value}): a length must be positive.")
        if self.penalty is not None and not 0 < self.penalty < float("inf"):
            raise ProblemError(f"Numerics(penalty={self.penalty}): a stiffness must be positive.")
        if self.lips != "multipliers" and self.linear == "iterative":
            raise ProblemError(
                f'Numerics(lips="{self.lips}", linear="iterative"): conjugate gradients know '
                'multipliers only; give linear="direct", or leave lips out.'
            )
        if not 2 <= self.points <= 32:
            raise ProblemError(f"Numerics(points={self.points}): give 2 to 32 points a direction.")
