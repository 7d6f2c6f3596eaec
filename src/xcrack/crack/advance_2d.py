"""Growth of cracks in 2D: their tips advance, each by one straight piece."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import at
from xcrack.crack.crack import Crack
from xcrack.crack.lines import crossing_points, polyline_crack
from xcrack.crack.tips_2d import tip_frames
from xcrack.errors import GeometryError
from xcrack.inputs import numbers

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
    back = (np.abs(beta) > np.pi - _BACK) & (step > 0)
    if back.any():
        k = int(np.argmax(back))
        raise GeometryError(
            f"the tip at {at(x[k])} turns back on its own crack (by {beta[k]:.6g} rad): angles "
            "of growth lie between -pi and pi."
        )
    moved = x + step[:, None] * (
        np.cos(beta)[:, None] * frame[:, 0] + np.sin(beta)[:, None] * frame[:, 1]
    )
    points = np.array(crack.points)
    for k, tip in enumerate(crack.tips):
        if step[k] != 0:
            new = moved[k : k + 1]
            points = np.concatenate([new, points] if tip == 0 else [points, new])
    tips = [0 if tip == 0 else len(points) - 1 for tip in crack.tips]
    for tip, da_ in zip(tips, step):
        if da_ != 0:
            new, rest = (points[:2], points[2:]) if tip == 0 else (points[-2:], points[:-2])
            crossing = crossing_points(new, rest)
            if len(crossing):
                raise GeometryError(
                    f"the crack grows across itself near {at(crossing[0])}: what lies between is "
                    "cut out, which is not modelled. End growth before."
                )
    return polyline_crack(points, tuple(tips))
