"""The opponent that grows a crack: mesh, solve and read K anew in every step."""

from time import process_time

import numpy as np

from xcrack.arrays import Floats
from xcrack.bench.conforming import Grading, pulled
from xcrack.bench.scenes import DA, N_STEPS, TURNING, Outcome
from xcrack.criteria import kink_angle


def grown(grading: Grading, reference: Floats, steps: int = N_STEPS) -> Outcome:
    """Steps of the turning growth; error of where the tip ends, in advances.

    Parameters
    ----------
    grading : Grading
    reference : (2,)
        Tip after the steps.
    steps : int
    """
    crack, unknowns, times = np.array(TURNING), 0, [process_time()]
    for step in range(steps + 1):
        K, unknowns = pulled(crack, grading, DA)
        last = crack[-1] - crack[-2]
        direction = np.arctan2(last[1], last[0]) + float(kink_angle(K))
        ahead = np.array([np.cos(direction), np.sin(direction)])
        if step < steps:
            crack = np.vstack([crack, crack[-1] + DA * ahead])
        times.append(process_time())
    lasted = np.diff(times)
    parts = {"first step": float(lasted[0]), "later step": float(np.median(lasted[1:]))}
    error = float(np.hypot(*(crack[-1] - reference))) / DA
    return Outcome({"tip": error}, unknowns, parts)
