"""One overload in compact specimens: how long the zone of retarded growth is (Lu 2018)."""

from typing import Any

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.fatigue.retardation import plastic_zone
from xcrack.model.material import Isotropic
from xcrack.sif.specimens import compact_tension
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.experiments.experiment import Experiment
from xcrack.verification.experiments.outcome import Comparison, Curve, Outcome, Picture
from xcrack.verification.experiments.trial import Trial

_ZONES = {1.0: "width in plane stress", 2.0: "radius in plane stress", 3.0: "width in plane strain"}


def _K_over_length(test: dict[str, Any], a: Floats) -> Floats:
    """K per unit force of a compact specimen at lengths a from the load line."""
    steel = Isotropic(1e3 * test["E"], 0.3, "stress")
    tests = [compact_tension(test["W"], float(x), force=1.0 / test["B"]) for x in a]
    problems = [each.problem(steel) for each in tests]
    return np.array([stress_intensity(solve(problem)).K_I[0] for problem in problems])


def _zone(test: dict[str, Any], a: Floats, K: Floats, beta: float) -> float:
    """Growth until the zone of a cycle reaches the border of that of the overload."""
    zone = plastic_zone(1e3 * test["yield_stress"], beta)
    start = test["a_overload"]
    border = start + float(zone(test["P_overload"] * np.interp(start, a, K)))
    fine = np.linspace(start, a[-1], 4001)
    beyond = fine + zone(test["P_max"] * np.interp(fine, a, K)) >= border
    return float(fine[np.argmax(beyond)] - start) if beyond.any() else float("nan")


def _run(experiment: Experiment, quick: bool) -> Outcome:
    comparisons, curves = [], []
    for test in experiment.measured["tests"]:
        length = test["a_end"] - test["a_overload"]
        a = np.linspace(test["a_overload"], test["a_end"], 3 if quick else 5)
        K = _K_over_length(test, a)
        zones = {beta: _zone(test, a, K, beta) for beta in _ZONES}
        comparisons += [
            Comparison(f"retarded length of {test['alloy']}, {words}", zones[beta], length,
                       "ratio", "mm")
            for beta, words in _ZONES.items()
        ]  # fmt: skip
        curves.append(Curve.of(f"{test['alloy']}, measured", [(0.0, length)], "measured"))
        curves.append(Curve.of(f"{test['alloy']}, zones", list(zones.items()), "predicted"))
    picture = Picture("Retarded length", "beta of the zone (0: measured)", "length [mm]",
                      tuple(curves))  # fmt: skip
    return Outcome(experiment.name, (experiment.name,), tuple(comparisons), (picture,), _WORDS)


_WORDS = (
    "Wheeler and Willenborg end the retardation where the plastic zone of a cycle reaches the "
    "border of that of the overload: its length is that of the zone.",
    "DP780, 1.4 mm thick, is in plane stress: its width (Irwin) comes near. In 6082-T6 the rate is "
    "low over 8.5 mm, more than four times the largest zone: what closes the crack there is not "
    "the zone alone.",
)
TRIALS = (Trial("overload_2018", _run),)


__all__ = ["TRIALS"]
