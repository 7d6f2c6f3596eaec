"""Whether lives and paths of scenes drawn by a seed are within their tolerances and bars.

``python -m benchmarks.wanted_drawn 500:512`` draws twelve scenes, an edge crack, an inner one, one
beside a hole and a pair in turn, runs each with three tolerances, prints the rows and adds them to
``benchmarks/results/wanted_drawn.json``. Truth is as of ``benchmarks.wanted_error``. Lives are
compared where the crack that leads is at last, or where a tip leaves or cracks meet. For runs
outside their tolerance a second truth, in steps a third shorter on cells two thirds as large, says
how far the first one can be trusted.
"""

import json
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import xcrack as xc
from benchmarks.wanted_error import LAW, STEEL, TOLERANCES, TRUTH, against, square, turned

RESULT = Path(__file__).parent / "results" / "wanted_drawn.json"
KINDS = ("edge", "inner", "hole", "pair")
_FARTHER = 0.3  # that the truth runs past the end of a run
_FINER = 1.5  # times the cells, and the steps, of the truth: the second one


@dataclass(frozen=True)
class Drawn:
    """A scene, and the way of the last tip of any crack at which runs stop."""

    kind: str
    problem: xc.Problem
    way: float


def scene(seed: int, finer: float = 1.0) -> Drawn:
    """The scene of a seed, on a coarse mesh or one finer."""
    rng = np.random.default_rng([9151, seed])
    kind = KINDS[seed % len(KINDS)]
    n = round(int(rng.integers(7, 12)) * finer)
    body, loads = square(n), turned(float(rng.uniform(-25, 25)))
    way = float(rng.uniform(0.5, 0.9))
    angle = np.radians(rng.uniform(-40, 40))
    along = np.array([np.cos(angle), np.sin(angle)])
    length, y = float(rng.uniform(0.35, 0.6)), float(rng.uniform(-0.25, 0.25))
    start = np.array([-1.0, y])
    lines = [[start - 0.1 * along, start + length * along]]
    if kind == "inner":
        centre = rng.uniform(-0.2, 0.2, 2)
        lines = [[centre - 0.6 * length * along, centre + 0.6 * length * along]]
    elif kind == "hole":
        radius = float(rng.uniform(0.15, 0.3))
        body = xc.plate_with_hole(width=2, height=2, radius=radius, size=2 / n)
        if rng.uniform() < 0.5:  # from the hole: less of a turn
            begin = radius * along
            lines = [[0.5 * begin, begin + 0.4 * length * along]]
            way = min(way, 0.9 - radius - 0.4 * length)
    elif kind == "pair":
        other_y = y + float(rng.choice([-1, 1]) * rng.uniform(0.2, 0.5))
        other = float(rng.uniform(0.6, 0.95)) * length
        lines.append([np.array([1.1, other_y]), np.array([1.0 - other, other_y])])
    cracks = [xc.line_crack([tuple(x) for x in line]) for line in lines]
    return Drawn(kind, xc.Problem(body, STEEL, cracks, loads=loads), way)


def run(drawn: Drawn, way: float, **options: Any) -> tuple[xc.History, float]:
    """A run, up to a way of the last tip of any crack or to a join or exit; its processor time."""
    begin, first = process_time(), drawn.problem.cracks
    n_tips = [crack.n_tips for crack in drawn.problem.placed]

    def there(step: xc.Step) -> bool:
        if step.joins or [crack.n_tips for crack in step.corrected] != n_tips:
            return True
        ways = [
            np.linalg.norm(now.points[-1] - then.points[-1])
            for now, then in zip(step.corrected, first, strict=True)
        ]
        return bool(max(ways) > way)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        steps = xc.grow(
            drawn.problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), progress=False, **options
        )
        history = xc.collect(steps, until=there, keep_solutions=False)
    return history, process_time() - begin


def until_change(history: xc.History) -> xc.History:
    """The run up to before cracks have met, or tips have left."""
    n_tips = [crack.n_tips for crack in history.steps[0].cracks]
    solved = [
        step for step in history.steps
        if not step.joins and [crack.n_tips for crack in step.corrected] == n_tips
    ]  # fmt: skip
    return xc.History(solved, history.ended)


def leading_crack(history: xc.History) -> int:
    """Number of the crack whose last tip grows farthest."""
    first, last = history.steps[0].cracks, history.steps[-1].corrected
    ways = [np.linalg.norm(b.points[-1] - a.points[-1]) for a, b in zip(first, last, strict=True)]
    return int(np.argmax(ways))


def end_of(history: xc.History) -> float | None:
    """Cycles at which the first tip leaves, or cracks meet; None where none has."""
    rest = history.steps[len(until_change(history).steps) :]
    if not rest:
        return None
    events = [*rest[0].arrivals, *rest[0].joins]
    return min((float(event.N) for event in events), default=float(rest[0].cycles))


def errors_beside(truth: xc.History, history: xc.History) -> tuple[float, float]:
    """Errors of path and of life of a run."""
    solved = until_change(truth)
    path, life = against(solved, leading_crack(solved))(until_change(history))
    ends = end_of(truth), end_of(history)
    return path, life if None in ends else abs(float(ends[1] or 0.0) / float(ends[0] or 1.0) - 1)


def measured(seed: int) -> list[dict[str, Any]]:
    """Rows of the scene of a seed."""
    drawn = scene(seed)
    rows: list[dict[str, Any]] = []
    truth, _ = run(drawn, drawn.way + _FARTHER, **TRUTH)
    for tolerance in TOLERANCES:
        history, seconds = run(drawn, drawn.way, tolerance=tolerance)
        path, life = errors_beside(truth, history)
        n_solved = len(until_change(history).steps)
        last, ending = history.steps[n_solved - 1], history.steps[: n_solved + 1][-1]
        error, end_error = last.error, ending.error
        assert error is not None
        assert end_error is not None
        rows.append({
            "seed": seed, "kind": drawn.kind, "tolerance": tolerance,
            "life": life, "bar": float(end_error.life / ending.cycles),
            "path": path, "path bar": float(error.path / error.grown),
            "steps": len(history.steps), "seconds": round(seconds, 2),
            "meshes": last.run.meshes if last.run is not None else 0,
        })  # fmt: skip
    if any(max(row["life"], row["path"]) > row["tolerance"] for row in rows):
        shorter = {**TRUTH, "da": TRUTH["da"] / _FINER}
        path, life = errors_beside(truth, run(scene(seed, _FINER), drawn.way, **shorter)[0])
        rows = [row | {"path of truth": path, "life of truth": life} for row in rows]
    return rows


def summary(rows: Sequence[dict[str, Any]]) -> str:
    """How many are within their tolerance, and how many bars hold."""
    share = [max(row["life"], row["path"]) / row["tolerance"] for row in rows]
    holds = [row["life"] <= row["bar"] and row["path"] <= row["path bar"] for row in rows]
    return (
        f"{sum(s <= 1 for s in share)} of {len(rows)} within, worst {max(share):.2f}; "
        f"{sum(holds)} with both bars"
    )


def main() -> None:
    """Print the rows of some seeds, and store them beside those of others."""
    begin, end = (int(part) for part in (sys.argv[1:] or ["500:512"])[0].split(":"))
    for seed in range(begin, end):
        new_rows = measured(seed)
        for row in new_rows:
            print(
                " | ".join(f"{v:.1e}" if isinstance(v, float) else str(v) for v in row.values()),
                flush=True,
            )
        stored = json.loads(RESULT.read_text()) if RESULT.exists() else []
        rows = [*(row for row in stored if row["seed"] != seed), *new_rows]
        rows.sort(key=lambda row: (row["seed"], -row["tolerance"]))
        RESULT.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(summary([row for row in rows if begin <= row["seed"] < end]))


if __name__ == "__main__":
    main()
