"""Error of path, shares and life over the number of solves: growth of second order, Euler's rule.

``python -m benchmarks.growth_order`` prints the table of docs/measured.md and stores it in
``benchmarks/results/growth_order.json``.
"""

import json
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import xcrack as xc
from benchmarks.scenes.growth import GROWN, PATH_END, TURNING, life
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings
from xcrack.base.arrays import Floats

Row = dict[str, list[float]]

RESULT = Path(__file__).parent / "results" / "growth_order.json"
LAW = xc.paris(C=1e-3, m=2.0)
N_SHIFTS, N_CELLS = 10, 50


def grown(problem: xc.Problem, length: float, steps: int, integrator: str) -> xc.History:
    """A run of steps of one length, without its solutions."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        run = xc.grow(
            problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), length / steps,
            max_steps=steps + 1, progress=False, integrator=integrator,
        )  # fmt: skip
        return xc.collect(run, keep_solutions=False)


def pulled(body: xc.Mesh, line: list[tuple[float, float]], turn: float = 0.0) -> xc.Problem:
    """A plate under tension that is turned from the y-axis."""
    along = np.array([-np.sin(turn), np.cos(turn)])
    stress = np.outer(along, along)
    loads = [
        xc.traction(side, lambda x, n: n @ stress) for side in ("left", "right", "bottom", "top")
    ]
    return xc.Problem(body, STEEL[2], [xc.line_crack(line)], loads=loads)


def shifted_plate(seed: int) -> xc.Mesh:
    """The plate [-1, 1]² whose inner points are moved by up to 15 % of a cell."""
    plain = xc.box((-1, -1), (1, 1), N_CELLS)
    x = np.array(plain.points)
    inner = (np.abs(x) < 1 - 1e-9).all(axis=1)
    shift = np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), 2))
    x[inner] += 0.15 * 2 / N_CELLS * shift
    return xc.Mesh(x, plain.cells, plain.facet_sets)


def turning(integrator: str) -> Row:
    """Median over ten meshes of the path of the turning crack of the charts."""
    row: Row = {}
    line = [(-1.1, -0.04), TURNING[1]]
    for steps in (5, 8, 15):
        errors = []
        for seed in range(101, 101 + N_SHIFTS):
            history = grown(pulled(shifted_plate(seed), line), GROWN, steps, integrator)
            errors.append(float(np.linalg.norm(history.cracks[0].points[-1] - PATH_END)) / GROWN)
        row[str(steps)] = [float(np.median(errors)), float(max(errors))]
    return row


def load_turned(integrator: str) -> Row:
    """A load that is turned by 25 degrees half way; against 32 steps of second order."""
    body, length = xc.box((-1, -1), (1, 1), 80), 0.8

    def end(steps: int, integrator: str) -> Floats:
        line = [(-1.1, 0.013), (-0.5, 0.013)]
        for turn in (0.0, np.radians(25.0)):
            problem = pulled(body, line, turn)
            history = grown(problem, length / 2, steps // 2, integrator)
            line = [tuple(x) for x in history.cracks[0].points]
        return np.array(line[-1])

    exact = end(32, "pec")
    return {
        f"{steps + 2}": [float(np.linalg.norm(end(steps, integrator) - exact)) / length]
        for steps in (6, 16)
    }


def first_kink(integrator: str) -> Row:
    """An inner crack at 45 degrees: it turns by 52 at once, in the limit by 56."""
    ahead = 0.35 * np.array([1.0, 1.0]) / np.sqrt(2)
    tips = [(sign * ahead[0], sign * ahead[1] + 0.007) for sign in (-1, 1)]
    way = [tuple(np.array(tips[1]) + shift) for shift in ([0, 0], [0.1, -0.015], [0.3, -0.03])]
    body = xc.plate(
        2.0, 2.0, lower=(-1.0, -1.0), size=0.12, size_near=0.009, along=way, band=0.05,
        transition=0.5,
    )  # fmt: skip
    length = 0.3

    def end(steps: int, integrator: str) -> Floats:
        return np.array(grown(pulled(body, tips), length, steps, integrator).cracks[0].points[-1])

    exact = end(18, "pec")
    return {
        f"{steps}": [float(np.linalg.norm(end(steps, integrator) - exact)) / length]
        for steps in (4, 6, 9)
    }


def lives(integrator: str) -> Row:
    """Life of the edge-cracked plate of the charts, one mesh."""
    row = {}
    for steps in (3, 5, 8):
        outcome = life(Settings(37), steps, 7, integrator)
        row[f"{steps}"] = [outcome.errors["life"]]
    return row


SCENES: dict[str, Callable[[str], Row]] = {
    "turning crack, path: median and largest of ten meshes": turning,
    "load turned by 25 degrees half way, path": load_turned,
    "first kink of 52 degrees, path": first_kink,
    "edge-cracked plate, life": lives,
}


def lines(rows: dict[str, dict[str, Row]]) -> Iterator[str]:
    """Lines of a markdown table."""
    yield "| scene | solves | Euler | second order |"
    yield "|---|---|---|---|"
    for name, both in rows.items():
        texts = [
            " / ".join(" (".join(f"{v:.1e}" for v in values) + ")" * (len(values) - 1)
                       for values in both[key].values())
            for key in ("euler", "pec")
        ]  # fmt: skip
        yield f"| {name} | {' / '.join(both['pec'])} | {texts[0]} | {texts[1]} |"


def main() -> None:
    """Measure all scenes, print and store them."""
    rows = {}
    for name, scene in SCENES.items():
        rows[name] = {integrator: scene(integrator) for integrator in ("euler", "pec")}
        print("\n".join(lines({name: rows[name]})), flush=True)
    RESULT.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
