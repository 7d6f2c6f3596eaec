"""Pressure, gap and state on the lips of one crack."""

from dataclasses import dataclass

from xcrack.arrays import Bools, Floats


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact on the whole lip of one crack, at its integration points.

    Attributes
    ----------
    points : (q, d) array, length
    normal : (q, d) array
        From lip - to lip +.
    measure : (q,) array, length^(d - 1)
        Weight of each point: sums are integrals along the lip.
    pressure : (q,) array, stress
        The multiplier field, 0 where open.
    gap : (q,) array, length
        Normal opening n . [[u]].
    closed : (q,) array of bool
    s : (q,) array, length
        Position along the crack from where it enters the body.
    """

    points: Floats
    normal: Floats
    measure: Floats
    pressure: Floats
    gap: Floats
    closed: Bools
    s: Floats
