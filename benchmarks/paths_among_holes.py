"""What moves a path among holes, and by how much: the three compact specimens of Wagner (2018).

``python -m benchmarks.paths_among_holes`` prints the table of docs/validation.md and stores it in
``benchmarks/results/paths_among_holes.json``: of each cause the distance of the path from the
measured points (rms) and how far it moves the predicted path (largest), both in mm.
"""

import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import xcrack as xc
from xcrack.base.arrays import Floats
from xcrack.fatigue.criteria import Criterion, kink_angle, kinked_K
from xcrack.growth.response import Response, respond
from xcrack.sif.sif import SIF
from xcrack.verification.experiments.experiment import ROOT_M, Experiment, read_experiment
from xcrack.verification.experiments.outcome import distances, rms
from xcrack.verification.experiments.wagner import specimen

Row = dict[str, tuple[float, float]]
Path2D = Callable[[str], Floats]

RESULT = Path(__file__).parent / "results" / "paths_among_holes.json"
LETTERS = "abc"
REACH = {"a": np.inf, "b": 22.0, "c": np.inf}  # x up to where paths are compared
SIZE, DA = 0.5, 0.5  # cells along the path and length of a step, mm
OFF = 0.05  # mm by which a machined part may be off
NEAR = 0.5  # mm: distance at which the stress is asked, length over which a crack turns
STEPS_OF_OTHERS = 0.5  # mm: steps at which Euler's rule gives the paths of other programs
_DIRECTIONS = np.radians(np.linspace(-80.0, 80.0, 3201))


def experiment(letter: str) -> Experiment:
    """The test that ends in the hole of a letter."""
    return read_experiment(f"wagner_2018_{letter}")


def path_of(
    letter: str,
    *,
    test: Experiment | None = None,
    size: float = SIZE,
    da: float = DA,
    criterion: Criterion = xc.max_hoop_stress,
    contact_angle: float | None = None,
    friction: float = 0.0,
    **options: Any,
) -> Floats:
    """Predicted path (n, 2) from the tip of the slot on, to a little beyond where it is compared.

    `test` is the specimen where it is not the nominal one, `friction` the coefficient of the pins.
    """
    test = experiment(letter) if test is None else test
    problem = specimen(test, size, contact_angle)
    if friction:
        problem = replace(problem, loads=(*problem.loads, *_torques(test, friction)))
    law = xc.paris(test.material["paris_C"] * ROOT_M ** -test.material["paris_m"],
                   test.material["paris_m"])  # fmt: skip
    cycle = xc.Cycle(test.load["R"], 1.0)
    end = REACH[letter] + 0.7
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        steps = xc.grow(problem, law, criterion, cycle, da=da, progress=False, **options)
        history = xc.collect(
            steps, until=lambda step: step.cracks[0].points[-1, 0] > end, keep_solutions=False
        )
    return np.asarray(history.cracks[0].points[1:])


@cache
def nominal(letter: str) -> Floats:
    """Path of the hoop stress in the nominal specimen."""
    return path_of(letter)


def from_test(letter: str, path: Floats) -> float:
    """Distance of the measured points from a path, rms, mm."""
    points = experiment(letter).path
    return rms(distances(points[points[:, 0] <= REACH[letter]], path))


def shift(letter: str, path: Floats) -> float:
    """Largest distance of a path from the nominal one, up to where both go, mm."""
    other = nominal(letter)
    x = path[:, 0]
    is_compared = (x <= min(REACH[letter], other[-1, 0])) & (path[:, 1] != path[0, 1])
    return float(distances(path[is_compared], other).max())


# Causes


def _torques(test: Experiment, friction: float) -> list[xc.traction]:
    """Friction of the pins under 1 kN: it resists the opening of the specimen."""
    loads = []
    for k, (pin, side) in enumerate(zip(test.geometry["pin_holes"], (1.0, -1.0), strict=True)):
        shear = friction * 1000.0 / test.geometry["thickness"] / (2 * np.pi * pin["radius"])

        def along(x: Floats, normal: Floats, shear: float = side * shear) -> Floats:
            return shear * np.stack([normal[:, 1], -normal[:, 0]], axis=1)

        loads.append(xc.traction(f"hole_{k}", along))
    return loads


def by_direction(direction: Callable[[Floats, float], Floats]) -> Criterion:
    """Criterion of one loaded state in proportion: a direction, and K_eq of the hoop stress in it.

    `direction` takes K (f, 2) of the largest state and Poisson's ratio.
    """

    def criterion(K: Floats, nu: float) -> tuple[Floats, Floats, Floats]:
        K = np.asarray(K)
        angle = direction(K[np.argmax(np.abs(K).sum(axis=(1, 2)))], nu)
        K_eq = xc.equivalent_K(K, np.broadcast_to(angle, K.shape[:2]), nu)
        largest, smallest = K_eq.max(axis=0), K_eq.min(axis=0)
        return angle, largest - smallest, smallest / largest

    return criterion


def most_energy(K: Floats, nu: float) -> Floats:
    """Direction in which a kink of no length releases the most energy."""
    released = (kinked_K(K[:, None, :], _DIRECTIONS[None]) ** 2).sum(axis=2)
    return np.asarray(_DIRECTIONS[released.argmax(axis=1)])


def least_energy_density(K: Floats, nu: float) -> Floats:
    """Direction of the least strain energy density (Sih 1974), plane strain."""
    kappa, cos, sin = 3 - 4 * nu, np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)
    K_I, K_II = K[:, :1], K[:, 1:2]
    density = (
        (1 + cos) * (kappa - cos) * K_I**2
        + 2 * sin * (2 * cos - kappa + 1) * K_I * K_II
        + ((kappa + 1) * (1 - cos) + (1 + cos) * (3 * cos - 1)) * K_II**2
    )
    return np.asarray(_DIRECTIONS[density.argmin(axis=1)])


def hoop_stress_at_a_distance(problem: Any, states: Any, reuse: Any, bars: bool) -> Response:
    """K whose kink is that of the largest hoop stress of K and T at `NEAR` from the tip."""
    response = respond(problem, states, reuse, bars)
    cos, sin = np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)

    def turned(sif: SIF) -> SIF:
        K = np.array(sif.K)
        hoop = (
            np.cos(_DIRECTIONS / 2) * (K[:, :1] * (1 + cos) / 2 - 1.5 * K[:, 1:2] * sin)
            + sif.T[:, None] * np.sqrt(2 * np.pi * NEAR) * sin**2
        )
        angle = _DIRECTIONS[hoop.argmax(axis=1)]
        K[:, 1] = -K[:, 0] * np.sin(angle) / (3 * np.cos(angle) - 1)
        return replace(sif, K=K)

    return replace(response, sif=tuple(tuple(turned(s) for s in row) for row in response.sif))


def slow_turn(length: float, da: float) -> Criterion:
    """A crack that turns over a length: dθ/ds = kink angle / length, whatever the step."""
    share = 1.0 - np.exp(-da / length)
    return by_direction(lambda K, nu: share * kink_angle(K))


def turned_over(letter: str, length: float = NEAR, **changes: Any) -> Floats:
    """Path of a crack that turns over a length."""
    da = 0.25
    return path_of(letter, da=da, criterion=slow_turn(length, da), integrator="euler", **changes)


def _moved(test: Experiment, part: str, key: str, by: float) -> Experiment:
    """The specimen with a hole or the slot off."""
    geometry: dict[str, Any] = json.loads(json.dumps(test.geometry))
    if part == "slot":
        geometry["slot"]["y"] += by
    elif key == "radius":
        geometry["holes"][part]["radius"] += by
    else:
        geometry["holes"][part]["center"]["xy".index(key)] += by
    return replace(test, geometry=geometry)


# Hole b moves no path by more than .01 mm, were it .1 mm off: up to x = 22 none comes near it.
PARTS = [("slot", "y"), *((hole, key) for hole in "ac" for key in ("x", "y", "radius"))]


def off(letter: str) -> dict[str, float]:
    """Largest shift by each part that is `OFF` from its place or size, mm."""
    test = experiment(letter)
    return {f"{part} {key}": shift(letter, path_of(letter, test=_moved(test, part, key, OFF)))
            for part, key in PARTS}  # fmt: skip


CAUSES: dict[str, Path2D] = {
    "largest hoop stress, steps of second order (xcrack)": nominal,
    "cells and steps of .25 for .5 mm": lambda x: path_of(x, size=0.25, da=0.25),
    "pins over 60 for 90 degrees": lambda x: path_of(x, contact_angle=np.radians(60.0)),
    "pins that rub, coefficient .15": lambda x: path_of(x, friction=0.15),
    "pins that rub, coefficient .45": lambda x: path_of(x, friction=0.45),
    "largest energy release rate": lambda x: path_of(x, criterion=by_direction(most_energy)),
    "least strain energy density": lambda x: path_of(
        x, criterion=by_direction(least_energy_density)
    ),
    "hoop stress with T, .5 mm from the tip": lambda x: path_of(
        x, response=hoop_stress_at_a_distance
    ),
    "Euler's rule, steps of .5 mm": lambda x: path_of(x, da=STEPS_OF_OTHERS, integrator="euler"),
    "a crack that turns over .3 mm": lambda x: turned_over(x, 0.3),
    "a crack that turns over .5 mm": turned_over,
    "pins that rub (.15) and a crack that turns over .3 mm": lambda x: turned_over(
        x, 0.3, friction=0.15
    ),
}


def lines(rows: dict[str, Row]) -> Iterator[str]:
    """Lines of a markdown table."""
    yield "| what is changed | distance from the test, rms: a, b, c | moves the path by at most |"
    yield "|---|---|---|"
    for name, row in rows.items():
        far = ", ".join(f"{value[0]:.2f}" if value[0] else "–" for value in row.values())
        moved = ", ".join(f"{value[1]:.3f}" if value[1] else "–" for value in row.values())
        yield f"| {name} | {far} | {moved} |"


def main() -> None:
    """Measure all causes, print and store them."""
    rows: dict[str, Row] = {}
    for name, path in CAUSES.items():
        lines_of = {letter: path(letter) for letter in LETTERS}
        rows[name] = {
            letter: (from_test(letter, line), shift(letter, line))
            for letter, line in lines_of.items()
        }
        print("\n".join(lines({name: rows[name]})), flush=True)
    parts = {letter: off(letter) for letter in LETTERS}
    rows[f"slot, holes and radii {OFF:g} mm off: root of the sum of squares"] = {
        letter: (0.0, float(np.sqrt(sum(v**2 for v in part.values()))))
        for letter, part in parts.items()
    }
    print("\n".join(lines(rows)))
    RESULT.write_text(json.dumps({"causes": rows, "parts": parts}, indent=1) + "\n")


if __name__ == "__main__":
    main()
