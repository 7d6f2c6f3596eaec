"""The conforming baseline that grows a crack: mesh, solve and read K anew in every step."""

from time import process_time

import numpy as np

import xcrack as xc
from benchmarks.baselines.conforming_2d import Grading, pulled
from benchmarks.runs import Outcome
from benchmarks.scenes.growth import A0, A1, GROWN, LAW, N_STEPS, TURNING, exact_life, tip_errors
from benchmarks.scenes.material import NU
from xcrack.fatigue.criteria import kink_angle
from xcrack.fatigue.cycle import cycles_between


def grown(grading: Grading, steps: int = N_STEPS) -> Outcome:
    """The turning growth by remeshing; errors of where the tip ends.

    Parameters
    ----------
    grading : Grading
    steps : int
    """
    crack, unknowns, times = np.array(TURNING), 0, [process_time()]
    da = GROWN / steps
    for step in range(steps + 1):
        K, unknowns = pulled(crack, grading, da)
        last = crack[-1] - crack[-2]
        direction = np.arctan2(last[1], last[0]) + float(kink_angle(K))
        ahead = np.array([np.cos(direction), np.sin(direction)])
        if step < steps:
            crack = np.vstack([crack, crack[-1] + da * ahead])
        times.append(process_time())
    lasted = np.diff(times)
    parts = {"first step": float(lasted[0]), "later step": float(np.median(lasted[1:]))}
    return Outcome(tip_errors(crack[-1], da), unknowns, parts)


def life(grading: Grading, steps: int, seed: int) -> Outcome:
    """Cycles of the edge crack from A0 to A1, counted between the steps as xcrack does.

    Parameters
    ----------
    grading : Grading
    steps : int
        Of one length.
    seed : int
        Changes the coarse cells by some per cent.
    """
    grading = Grading(grading.near, grading.growth, grading.far / (1 + 0.03 * seed))
    crack, unknowns, rates = np.array([(0.0, 0.0), (A0, 0.0)]), 0, []
    da = (A1 - A0) / steps
    for _ in range(steps + 1):
        K, unknowns = pulled(crack, grading, A0)
        kink, dK, _ = xc.max_hoop_stress(np.stack([0 * K, K])[:, None], NU)
        rates.append(float(LAW(dK, np.zeros(1))[0]))
        last = crack[-1] - crack[-2]
        direction = np.arctan2(last[1], last[0]) + float(kink[0])
        ahead = np.array([np.cos(direction), np.sin(direction)])
        crack = np.vstack([crack, crack[-1] + da * ahead])
    a, rate = np.linspace(A0, A1, steps + 1), np.array(rates)
    cycles = float(cycles_between(a[:-1], a[1:], rate[:-1], rate[1:]).sum())
    return Outcome({"life": abs(cycles / exact_life() - 1)}, unknowns)
