"""From one step to the next: the choice between 2D and 3D cracks."""

from collections.abc import Sequence
from typing import Protocol

from xcrack.base.arrays import Floats, coordinates
from xcrack.crack.crack import Crack
from xcrack.growth import follow_2d, follow_3d
from xcrack.growth.step import Arriving, PerCrack, Step
from xcrack.mesh.mesh import Mesh
from xcrack.sif.sif import SIF


class Following(Protocol):
    """What growth asks of cracks of one dimension; `follow_2d` and `follow_3d` have it."""

    PLACE: str  # what K, a rate and an advance belong to
    END: str  # what leaves the body
    WAITS_BELOW: float  # share of a cell below which an advance waits

    def crack_size(self, crack: Crack, mesh: Mesh) -> float:
        """Size of a crack in the body, length."""

    def advanced(self, crack: Crack, places: SIF, angle: Floats, da: Floats, mesh: Mesh) -> Crack:
        """A crack after the advance `da` of its places in the directions `angle`."""

    def met(self, cracks: list[Crack], da: PerCrack, mesh: Mesh) -> list[Crack]:
        """Cracks after an advance, with tips that have met others ended or joined there."""

    def gone(self, advanced: Crack, placed: Crack) -> list[int]:
        """Numbers of the places of a crack that have left the body."""

    def arriving(
        self, last: Step, advanced: Sequence[Crack], placed: Sequence[Crack], mesh: Mesh
    ) -> list[Arriving]:
        """Places that have come to the boundary in an advance, with the facet sets there."""

    def ended(self, advanced: Crack, placed: Crack, arriving: Sequence[Arriving]) -> Crack:
        """A crack that has wholly left the body, as it ends there."""

    def followed(
        self,
        last: Step,
        cracks: Sequence[Crack],
        sif: Sequence[SIF],
        law_rate: Sequence[Floats],
        length: Sequence[float],
        mesh: Mesh,
    ) -> tuple[float, PerCrack]:
        """Cycles since the last step, and the growth that waits at the places of this one.

        Parameters
        ----------
        last : Step
        cracks : sequence of Crack
            After the advance.
        sif : sequence of SIF
            Tips, or places along fronts, of each crack.
        law_rate : sequence of (f,) arrays, length/cycle
            Growth there, before any threshold.
        length : sequence of float, length
            `crack_size` of each crack after the advance.
        mesh : Mesh
        """


def following(mesh: Mesh) -> Following:
    """How the cracks in a mesh are followed."""
    return _TWINS[mesh.dim]


def place_name(mesh: Mesh, step: Step, c: int, j: int) -> str:
    """Name of a tip, or of a place along a front, of crack c in a message."""
    return f"crack {c}, {following(mesh).PLACE} {j} at {coordinates(step.sif[0][c].x[j])}"


_TWINS: dict[int, Following] = {2: follow_2d, 3: follow_3d}


__all__ = ["Following", "following"]
