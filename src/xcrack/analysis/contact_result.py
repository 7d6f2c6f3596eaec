"""Contact of crack faces (lips): on one crack in one state, and of all cracks in all states."""

from dataclasses import dataclass

import scipy.sparse as sp

from xcrack.analysis.multipliers import Multipliers
from xcrack.base.arrays import Bools, Floats
from xcrack.linalg.reuse import SolverState


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact on all faces of one crack in one load state, at their integration points.

    Attributes
    ----------
    points : (q, d) array, length
    normal : (q, d) array
        From lip - to lip +.
    measure : (q,) array, length^(d - 1)
        Weight of each point: sums are integrals along the crack face.
    pressure : (q,) array, stress
        The multiplier field, 0 where open.
    gap : (q,) array, length
        Normal opening n . [[u]].
    closed : (q,) array of bool
    s : (q,) array, length
        Position along the crack from where it enters the body.
    tangent : (q, 2) array, in 3D (q, 2, 3), optional
        With friction: direction of shear and slip, along the order of the crack's points; in 3D two
        directions. None without, as the three that follow.
    shear : (q,) array, in 3D (q, 2), stress, optional
        Tangential traction on lip + along the tangents; lip - bears the opposite one.
    slip : (q,) array, in 3D (q, 2), length, optional
        Tangential jump, that of lip + less that of lip -.
    stuck : (q,) array of bool, optional
        Closed, and without slip since the substep before.
    """

    points: Floats
    normal: Floats
    measure: Floats
    pressure: Floats
    gap: Floats
    closed: Bools
    s: Floats
    tangent: Floats | None = None
    shear: Floats | None = None
    slip: Floats | None = None
    stuck: Bools | None = None


@dataclass(frozen=True, eq=False)
class FrictionWork:
    """Friction on the faces of one crack in all load states.

    Attributes
    ----------
    crack : int
    tangents : (q, m, d) array
        One in 2D, two in 3D.
    jumps : list of m sparse matrices (q, n_dof)
        Tangential jumps at the lip points.
    shear : (m, g, states) array, stress
        Tangential tractions of each multiplier function.
    stuck : (states, g) array of bool
    """

    crack: int
    tangents: Floats
    jumps: list[sp.csr_matrix]
    shear: Floats
    stuck: Bools


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Displacements and contact pressures of all load states.

    Attributes
    ----------
    u : (n_dof, states) array, length
    spaces : tuple of Multipliers or None
        One entry a crack; None for a crack without multipliers.
    pressure : tuple of (g, states) arrays or None
    active : tuple of (states, g) arrays of bool or None
    sets : int
        Closed sets tried in the worst state.
    dual : (g, g) array or None
        F = N K^-1 N^T over the multipliers of all cracks in their order; None where no
        factorisation made it.
    rubbing : tuple of FrictionWork
        Of the cracks whose faces rub.
    dissipated : tuple of float
        Energy that friction took in each state since the one before; empty without.
    """

    u: Floats
    spaces: tuple[Multipliers | None, ...]
    pressure: tuple[Floats | None, ...]
    active: tuple[Bools | None, ...]
    sets: int
    dual: Floats | None = None
    rubbing: tuple[FrictionWork, ...] = ()
    dissipated: tuple[float, ...] = ()

    def closed_sets(self) -> SolverState:
        """Closed sets by place, for the next solve."""
        centre = tuple(None if m is None else m.centre for m in self.spaces)
        return SolverState(centre, self.active)
