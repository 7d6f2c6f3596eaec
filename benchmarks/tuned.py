"""The edge crack against a conforming method that is tuned to each error.

    python -m benchmarks.tuned [--rounds 3] [--quick] [--json F] [--figure F.png]

The mesh of the conforming method has three parameters: the size of cells at the tip, how fast they
grow and the largest. All combinations run, and at each error the best of them counts, chosen
afterwards: nobody who does not know the answer could choose so well. xcrack runs with its defaults
on meshes of several sizes. Rounds of both take turns; times are medians of processor time, one
thread, from the mesh to K; errors are the largest of the rounds, each on a mesh of its own.
"""

import argparse
import json
import os
import warnings
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks.baselines import conforming_2d  # noqa: E402
from benchmarks.baselines.conforming_2d import Grading  # noqa: E402
from benchmarks.runs import machine  # noqa: E402
from benchmarks.scenes import plane  # noqa: E402
from benchmarks.scenes.plane import MODES, worst  # noqa: E402
from benchmarks.scenes.settings import Settings  # noqa: E402

LEVELS = (1e-3, 2e-4, 1e-4, 1e-5)
SIZES = (5, 6, 7, 8, 9, 11, 13, 17, 23, 31, 41)
NEAR = (0.1, 0.05, 0.02, 0.01, 3e-3, 1e-3, 1e-4)
GROWTH = (0.15, 0.2, 0.3, 0.4, 0.6)
FAR = (0.1, 0.15, 0.2, 0.3, 0.4, 0.6)

Row = dict[str, Any]


def _ours(n: int, seed: int) -> tuple[float, float]:
    start = process_time()
    outcome = plane.edge(Settings(n), seed)
    return process_time() - start, outcome.errors["K"]


def _theirs(grading: tuple[float, float, float], seed: int) -> tuple[float, float]:
    near, growth, far = grading
    start = process_time()
    K, _ = conforming_2d.edge(Grading(near, growth, far / (1 + 0.03 * seed)), MODES)
    return process_time() - start, worst(K, MODES)


def run(rounds: int, quick: bool) -> tuple[list[Row], list[Row]]:
    """Rows of xcrack and of the conforming method, each with time and error."""
    sizes = SIZES[::3] if quick else SIZES
    parameters = [v[::3] if quick else v for v in (NEAR, GROWTH, FAR)]
    gradings = [(near, growth, far) for near, growth, far in product(*parameters)]
    settings: list[Any] = [*sizes, *gradings]
    scenes = [partial(_ours, n) for n in sizes] + [partial(_theirs, g) for g in gradings]
    results: list[list[tuple[float, float]]] = [[] for _ in scenes]
    _ours(5, 0), _theirs((0.1, 0.4, 0.4), 0)  # kernels and imports
    for seed in range(rounds):
        for scene, own in zip(scenes, results):
            own.append(scene(seed))
    rows = [
        {"setting": s, "time": median(t for t, _ in own), "error": max(e for _, e in own)}
        for s, own in zip(settings, results)
    ]
    return rows[: len(sizes)], rows[len(sizes) :]


def front(rows: list[Row]) -> list[Row]:
    """Rows that no other beats in both time and error, the quickest first."""
    best: list[Row] = []
    for row in sorted(rows, key=lambda r: (r["time"], r["error"])):
        if not best or row["error"] < best[-1]["error"]:
            best.append(row)
    return best


def reached(rows: list[Row], level: float, ordered: bool) -> Row | None:
    """The quickest row below an error; of an ordered series all finer ones are below it, too."""
    below = [r for r in rows if r["error"] <= level]
    if ordered:
        below = [r for k, r in enumerate(rows) if all(f["error"] <= level for f in rows[k:])]
    return min(below, key=lambda r: float(r["time"]), default=None)


def draw(ours: list[Row], theirs: list[Row], path: Path) -> None:
    """Error against time: all meshes of the conforming method, its best ones, and the defaults."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(5.6, 4.2))
    axis.loglog(
        [r["time"] for r in theirs], [r["error"] for r in theirs], ".", color="0.75",
        label="conforming, every mesh",
    )  # fmt: skip
    best = front(theirs)
    axis.loglog(
        [r["time"] for r in best], [r["error"] for r in best], "-", color="0.3",
        drawstyle="steps-post", label="conforming, best mesh for each error",
    )  # fmt: skip
    axis.loglog(
        [r["time"] for r in ours], [r["error"] for r in ours], "o-", color="tab:red",
        label="xcrack, defaults",
    )  # fmt: skip
    axis.set(xlabel="processor time, s", ylabel="relative error of K")
    axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Run, print the table, store and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    if conforming_2d.missing():
        parser.error(conforming_2d.missing())
    warnings.simplefilter("ignore")
    ours, theirs = run(options.rounds, options.quick)
    print("| error of K | xcrack, ms (cells a side) | conforming, ms (near, growth, far) | ratio |")
    print("|---|---|---|---|")
    for level in LEVELS:
        own, other = reached(ours, level, True), reached(theirs, level, False)
        if own is None or other is None:
            continue
        print(
            f"| {level:g} | {1e3 * own['time']:.1f} ({own['setting']}) | "
            f"{1e3 * other['time']:.1f} ({', '.join(f'{v:g}' for v in other['setting'])}) | "
            f"{own['time'] / other['time']:.2f} |"
        )
    if options.json:
        about = {"machine": machine(), "xcrack": ours, "conforming": theirs}
        options.json.write_text(json.dumps(about, indent=1) + "\n")
    if options.figure:
        draw(ours, theirs, options.figure)


if __name__ == "__main__":
    main()
