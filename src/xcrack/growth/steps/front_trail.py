"""What a solve leaves to the growth of second order of fronts."""

from dataclasses import dataclass, field

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.growth.steps.controller import Control
from xcrack.growth.steps.overloads import Kinds, Zones


@dataclass(frozen=True, eq=False)
class Places:
    """Places along the corrected fronts of one crack, with rates and directions.

    Attributes
    ----------
    s : (f,) array, length
        Position along the front.
    front : (f,) array of int
    x : (f, 3) array, length
    frame : (f, 3, 3) array
        Rows (ahead, normal, along).
    closed : (k,) array of bool
        Of each front.
    length : (k,) array, length
        Of each front.
    rate, law_rate : (f,) arrays, length/cycle
        After and before the threshold; with retardation both the mean over the step ahead.
    direction : (f, 3) array
        Of growth.
    pending : (f,) array, length
        Growth too short to be modelled yet.
    size : float, length
        `surface_size` of the crack.
    kinds : Kinds, optional
        Cycles of a block at the places, of one solve; with retardation.
    zones : Zones, optional
        What overloads have left.
    """

    s: Floats
    front: Ints
    x: Floats
    frame: Floats
    closed: Bools
    length: Floats
    rate: Floats
    law_rate: Floats
    direction: Floats
    pending: Floats
    size: float
    kinds: Kinds | None = None
    zones: Zones | None = None

    @property
    def angle(self) -> Floats:
        """Kink angle in the frames `(f,)`, rad."""
        along = np.einsum("ij,ij->i", self.direction, self.frame[:, 0])
        across = np.einsum("ij,ij->i", self.direction, self.frame[:, 1])
        return np.asarray(np.arctan2(across, along))


@dataclass(frozen=True, eq=False)
class FrontTrail:
    """What the last solve leaves.

    Attributes
    ----------
    parts : tuple of Places
        One a crack.
    exponent : float
        Of the growth law.
    control : Control
        How long the next step may be.
    """

    parts: tuple[Places, ...]
    exponent: float
    control: Control = field(default_factory=Control)


__all__ = ["FrontTrail", "Places"]
