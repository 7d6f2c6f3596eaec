"""Tips of cracks in 2D and their frames."""

import numpy as np

from xcrack.arrays import Floats
from xcrack.crack.crack import Crack


def tip_frames(crack: Crack) -> tuple[Floats, Floats]:
    """Tip points and frames of a placed crack.

    Returns
    -------
    points : (f, d) array, length
    frame : (f, d, d) array
        Rows (ahead, normal); the normal points from lip - to lip + at every tip.
    """
    tips = crack.tips or ()
    x = np.zeros((len(tips), 2))
    frame = np.zeros((len(tips), 2, 2))
    for k, tip in enumerate(tips):
        first, second = (1, 0) if tip == 0 else (tip - 1, tip)
        along = crack.points[second] - crack.points[first]
        ahead = along / np.linalg.norm(along)
        left = np.array([-ahead[1], ahead[0]])
        x[k] = crack.points[tip]
        frame[k] = ahead, (-left if tip == 0 else left)
    return x, frame
