"""The part of the stability benchmark about cycles: criteria, and K on the way there and back."""

import numpy as np

import xcrack as xc
from benchmarks.stability_parts import Results, short
from physics import test_contact_partial
from support import scenes_2d as scenes
from xcrack.base.arrays import Floats
from xcrack.fatigue.criteria import (
    kink_angle,
    max_hoop_stress,
    mean_reference,
    weighted_angle,
)

SEQUENCES: dict[str, list[tuple[float, float]]] = {
    "proportional, (0, 0) (1, .5)": [(0, 0), (1, 0.5)],
    "reversed shear, (1, .3) (1, -.3)": [(1, 0.3), (1, -0.3)],
    "fully reversed, (1, .5) (-1, -.5)": [(1, 0.5), (-1, -0.5)],
    "shear alone, reversed, (0, 1) (0, -1)": [(0, 1), (0, -1)],
    "non-proportional, (0, 0) (1, 0) (.6, .5)": [(0, 0), (1, 0), (0.6, 0.5)],
    "out of phase by 90°, 16 states": [
        (1 + np.cos(t), 0.8 * np.sin(t)) for t in 2 * np.pi * np.arange(16) / 16],
    "pure mode I, (0, 0) (1, 0)": [(0, 0), (1, 0)],
}  # fmt: skip


def printed_angle(K: Floats) -> list[float]:
    """Equation 13 of the source paper as printed: a division by K_II, and no sign chosen."""
    K_I, K_II = K
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(K_I**2 + 8 * K_II**2)
        return [float(2 * np.degrees(np.arctan((K_I + s * root) / (4 * K_II)))) for s in (1, -1)]


def cycles() -> Results:
    """Angles of the criteria, whatever the order of the states; K on the way there and back."""
    results: Results = {}
    rng = np.random.default_rng(77131)
    for name, sequence in SEQUENCES.items():
        K = np.array(sequence, dtype=float)[:, None, :]
        row: Results = {}
        for criterion in (max_hoop_stress, mean_reference, weighted_angle):
            angle, dK, R = criterion(K, 0.3)
            worst = 0.0
            for _ in range(20):
                other = criterion(K[rng.permutation(len(K))], 0.3)
                mirrored = criterion(K[rng.permutation(len(K))] * [1, -1], 0.3)
                worst = max(worst, abs(other[0][0] - angle[0]), abs(other[1][0] - dK[0]))
                worst = max(worst, abs(mirrored[1][0] - dK[0]))
            row[criterion.__name__] = {
                "degrees": np.degrees(angle[0]), "dK_eq": dK[0], "R": R[0],
                "shuffled, mirrored": worst,
            }  # fmt: skip
        component = mean_reference(K, 0.3, range="component")
        row["dK_eq by components"] = component[1][0]
        top = max(sequence, key=lambda k: float(np.hypot(*k)))
        row["of the largest state"] = np.degrees(kink_angle(top))
        row["the same as printed in the paper, + and -"] = printed_angle(np.array(top, float))
        results[name] = row
    for order in (1, 2):
        problem, there = test_contact_partial.cycle_problem(20, order)
        solutions = xc.solve(problem, states=there + there[::-1])
        K = np.array([xc.stress_intensity(s).K for s in solutions])
        wanted = np.array([scenes.bending_K(s) for s in test_contact_partial.CYCLE])
        n = len(there)
        results[f"cycle with closure, order {order}"] = {
            "K there and back differ by": np.abs(K[:n] - K[n:][::-1]).max() / wanted.max(),
            "error of K_I": np.abs(K[:n, :, 0] - wanted).max() / wanted.max(),
        }
    return short(results)
