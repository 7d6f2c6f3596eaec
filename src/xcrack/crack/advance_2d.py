"""Growth of cracks in 2D: their tips advance, each by one straight piece."""

import numpy as np
from numpy.typing import ArrayLike

from xcrack.crack.crack import Crack
from xcrack.crack.tips_2d import tip_frames


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
    """
    x, frame = tip_frames(crack)
    beta, step = np.asarray(angle, dtype=float), np.asarray(da, dtype=float)
    moved = x + step[:, None] * (
        np.cos(beta)[:, None] * frame[:, 0] + np.sin(beta)[:, None] * frame[:, 1]
    )
    points = np.array(crack.points)
    for k, tip in enumerate(crack.tips or ()):
        if step[k] != 0:
            new = moved[k : k + 1]
            points = np.concatenate([new, points] if tip == 0 else [points, new])
    tips = [0 if tip == 0 else len(points) - 1 for tip in crack.tips or ()]
    number = np.arange(len(points))
    return Crack(points, np.stack([number[:-1], number[1:]], axis=1), tuple(tips))
