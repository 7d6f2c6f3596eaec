"""Growth of cracks in 2D: their tips advance, each by one straight piece."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Bools, Floats, at
from xcrack.base.checks import numbers
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.lines import crossing_points, polyline_crack

_BACK = 1e-6  # rad from a half turn: a crack that turns back runs over itself


def advance(crack: Crack, angle: ArrayLike, da: ArrayLike) -> Crack:
    """Let the tips of a placed crack advance; a tip with da = 0 stays to the last bit.

    Parameters
    ----------
    crack : Crack
    angle : (f,) array, rad
        Kink angle of each tip, positive towards the normal of lip +.
    da : (f,) array, length

    Returns
    -------
    Crack
        With one more point at each tip that moved; old points are unchanged.

    Raises
    ------
    GeometryError
        Numbers that do not fit or are not finite, a crack that shrinks, turns back, or grows
        across itself.
    """
    if crack.tips is None:
        raise GeometryError("the crack is not placed in a mesh: it has no tips to advance.")
    x, frame = tip_frames(crack)
    beta = numbers(angle, "advance: angle", (len(x),), error=GeometryError)
    step = numbers(da, "advance: da", (len(x),), error=GeometryError)
    if (step < 0).any():
        raise GeometryError(f"da = {step.min()} at tip {step.argmin()}: a crack does not shrink.")
    is_backward = (np.abs(beta) > np.pi - _BACK) & (step > 0)
    if is_backward.any():
        k = int(np.argmax(is_backward))
        raise GeometryError(
            f"the tip at {at(x[k])} turns back on its own crack (by {beta[k]:.6g} rad): angles "
            "of growth lie between -pi and pi."
        )
    moved_x = x + step[:, None] * (
        np.cos(beta)[:, None] * frame[:, 0] + np.sin(beta)[:, None] * frame[:, 1]
    )
    return with_tips(crack, moved_x, step != 0, np.zeros(len(x), dtype=bool))


def with_tips(crack: Crack, x: Floats, moves: Bools, is_replaced: Bools) -> Crack:
    """A placed crack with its tips at other points.

    Parameters
    ----------
    crack : Crack
    x : (f, 2) array, length
    moves : (f,) array of bool
        The other tips stay to the last bit.
    is_replaced : (f,) array of bool
        Whether the last point of a tip that moves is replaced; else a face is added to it.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        It grows across itself, or turns back on itself.
    """
    points = np.array(crack.points)
    for k, tip in enumerate(crack.tips or ()):
        if moves[k]:
            new_point = x[k : k + 1]
            old_points = points[1:] if tip == 0 and is_replaced[k] else points
            old_points = old_points[:-1] if tip != 0 and is_replaced[k] else old_points
            points = np.concatenate(
                [new_point, old_points] if tip == 0 else [old_points, new_point]
            )
    tips = [0 if tip == 0 else len(points) - 1 for tip in crack.tips or ()]
    for tip in (tip for tip, has_moved in zip(tips, moves) if has_moved):
        line = points if tip == 0 else points[::-1]
        if len(line) > 2 and _turns_back(line[0] - line[1], line[1] - line[2]):
            raise GeometryError(f"the crack turns back on itself at {at(line[1])}.")
        crossing = crossing_points(line[:2], line[2:])
        if len(crossing):
            raise GeometryError(
                f"the crack grows across itself near {at(crossing[0])}: what lies between is "
                "cut out, which is not modelled. End growth before."
            )
    return polyline_crack(points, tuple(tips))


def _turns_back(direction: Floats, previous_direction: Floats) -> bool:
    """Whether a face lies on the one before it."""
    turn = np.arctan2(
        direction[1] * previous_direction[0] - direction[0] * previous_direction[1],
        direction @ previous_direction,
    )
    return bool(abs(turn) > np.pi - _BACK)


__all__ = ["advance", "with_tips"]
