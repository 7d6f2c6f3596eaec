"""Lives of panels under equal cycles (Virkler, 1979), and after overloads."""

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.fatigue.retardation import plastic_zone
from xcrack.growth.step import Step
from xcrack.mesh.plates import plate
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.history import History
from xcrack.runs.life import life
from xcrack.runs.scatter import Scatter, lognormal
from xcrack.sif.specimens import compact_tension
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.experiments.experiment import Experiment, Trial, driving, grown
from xcrack.verification.experiments.outcome import Comparison, Curve, Outcome, Picture

_STEPS, _FEW = 30, 12
_MEAN = 0.03  # of the mean cycles of the other half, from a = 15 mm on
_FROM = 15.0
_HELD, _BAND = 30, (2.5, 97.5)  # of 34 lives in the band of 95 %
_SAMPLES, _SEED = 20_000, 1979


def _panel(experiment: Experiment, half: float) -> Problem:
    geometry, material, load = experiment.geometry, experiment.material, experiment.load
    width, length = geometry["width"], geometry["length"]
    mesh = plate(
        width, length, lower=(-width / 2, -length / 2), size=12.0, size_near=2.0,
        along=[(-62.0, 0.0), (62.0, 0.0)], band=3.0, transition=40.0,
    )  # fmt: skip
    stress = load["stress_range"] / (1.0 - load["R"])
    pull = [traction("top", (0.0, stress)), traction("bottom", (0.0, -stress))]
    alloy = Isotropic(material["E"], material["nu"], "stress")
    return Problem(mesh, alloy, [line_crack([(-half, 0.0), (half, 0.0)])], loads=pull)


def _cycles(a: Floats, dK_at: tuple[Floats, Floats], constants: Floats) -> Floats:
    """Cycles from a[0] on at half lengths a, for ln C and m of a Paris law."""
    fine_a = np.linspace(a[0], a[-1], 2001)
    dK = np.exp(np.interp(fine_a, dK_at[0], np.log(dK_at[1])))
    slowness = np.exp(-constants[0]) * dK ** -constants[1]
    N = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(fine_a))])
    return np.asarray(np.interp(a, fine_a, N))


def _fit(a: Floats, mean: Floats, dK_at: tuple[Floats, Floats]) -> Floats:
    """Ln C and m of the law whose cycles are nearest to a mean curve, as shares of it."""

    def misfit(constants: Floats) -> Floats:
        return np.asarray((_cycles(a, dK_at, constants) - mean) / mean[-1])

    start = np.log(np.gradient(a, mean).mean()) - 3.0 * np.log(dK_at[1].mean())
    return np.asarray(least_squares(misfit, [start, 3.0], x_scale=[1.0, 0.1]).x)


def _run(experiment: Experiment, quick: bool) -> Outcome:
    a = np.array(experiment.measured["a"], dtype=float)
    N = np.array(experiment.measured["N"], dtype=float)  # lengths, tests
    fitted_half, rest = N[:, 1::2], N[:, 0::2]
    history, law, dK_at = _history(experiment, a, fitted_half.mean(axis=1), quick)
    ratio = _cycles(a, dK_at, np.array([np.log(law.C), law.m])) / np.maximum(rest.mean(axis=1), 1.0)
    end = _half(history.steps[-1])  # the last solve, within half a step of the last length
    range_of_a = (a >= _FROM) & (a <= end)
    lives_fitted, lives_other = (
        np.array([np.interp(end, a, test) for test in half.T]) for half in (fitted_half, rest)
    )
    sigma = float(np.std(np.log(lives_fitted), ddof=1))
    scatter = Scatter(C=lognormal(sigma))
    lives = life(history, scatter=scatter, samples=_SAMPLES, seed=_SEED)
    low, high = (lives.percentile(p) for p in _BAND)
    n_covered = int(np.sum((lives_other >= low) & (lives_other <= high)))
    worst = float(np.abs(ratio[range_of_a] - 1.0).max())
    comparisons = (
        Comparison("largest error of the mean cycles of the other half, a ≥ 15 mm", worst,
                   measure="number", most=_MEAN),
        Comparison("mean life of the other half", float(lives.life), float(lives_other.mean()),
                   "ratio", "cycles", 1 - _MEAN, 1 + _MEAN),
        Comparison("lives of the other half within the band of 95 %, of 34", n_covered,
                   measure="number", least=_HELD),
        Comparison("deviation of ln N, fitted half and other half", sigma,
                   float(np.std(np.log(lives_other), ddof=1)), "ratio"),
    )  # fmt: skip
    words = (
        f"Law fitted to the mean of 34 tests: m = {law.m:.2f}; deviation of ln C {sigma:.4f}: "
        f"95 % of the lives between {low:.0f} and {high:.0f} cycles.",
        "What the law fits is its own half: the shape of K over a, and the scatter, are tried.",
    )
    return Outcome(
        experiment.name, (experiment.name,), comparisons,
        (_of_lengths(a, N, dK_at, law), _of_lives(lives_other, lives.N)), words,
    )  # fmt: skip


def _history(
    experiment: Experiment, a: Floats, mean: Floats, quick: bool
) -> tuple[History, paris, tuple[Floats, Floats]]:
    """A run from the first to the last length under the law fitted to a mean curve, and its K."""
    da = (a[-1] - a[0]) / (_FEW if quick else _STEPS)
    cycle = Cycle(experiment.load["R"], 1.0)

    def run(law: paris, end: float) -> History:
        panel = _panel(experiment, a[0])
        return grown(panel, law, cycle, da, lambda step: _half(step) >= end)

    trial = run(paris(1e-12, 3.0), a[-1])
    tips, dK = driving(trial)
    is_right = tips[:, 0] > 0
    dK_at = tips[is_right, 0], dK[is_right]
    constants = _fit(a, mean, dK_at)
    law = paris(float(np.exp(constants[0])), float(constants[1]))
    return run(law, a[-1] - 0.6 * da), law, dK_at


def _half(step: Step) -> float:
    return float(step.cracks[0].points[:, 0].max())


def _of_lengths(a: Floats, N: Floats, dK_at: tuple[Floats, Floats], law: paris) -> Picture:
    prediction = np.stack([_cycles(a, dK_at, np.array([np.log(law.C), law.m])), a], axis=1)
    tests = [Curve.of("" if k else "34 tests of the other half", np.stack([N[:, j], a], axis=1),
                      "other") for k, j in enumerate(range(0, N.shape[1], 2))]  # fmt: skip
    mean = Curve.of("their mean", np.stack([N[:, 0::2].mean(axis=1), a], axis=1), "measured")
    curves = (*tests, mean, Curve.of("predicted", prediction, "predicted"))
    return Picture("Half length over cycles", "N", "a [mm]", curves)


def _of_lives(lives_: Floats, drawn_lives: Floats) -> Picture:
    share = (np.arange(len(lives_)) + 0.5) / len(lives_)
    levels = np.linspace(0.002, 0.998, 250)
    return Picture(
        "Share of the tests that have ended", "N", "share",
        (Curve.of("measured, other half", np.stack([np.sort(lives_), share], axis=1), "measured"),
         Curve.of("predicted", np.stack([np.quantile(drawn_lives, levels), levels], axis=1),
                  "predicted")),
    )  # fmt: skip


_CONSTANT_CYCLES = (Trial("virkler_1979", _run),)


# --- one overload in compact specimens: how long the zone of retarded growth is (Lu 2018) ---


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
    fine_a = np.linspace(start, a[-1], 4001)
    is_beyond = fine_a + zone(test["P_max"] * np.interp(fine_a, a, K)) >= border
    return float(fine_a[np.argmax(is_beyond)] - start) if is_beyond.any() else float("nan")


def _run_overload(experiment: Experiment, quick: bool) -> Outcome:
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
_OVERLOADS = (Trial("overload_2018", _run_overload),)


TRIALS = (*_CONSTANT_CYCLES, *_OVERLOADS)


__all__ = ["TRIALS"]
