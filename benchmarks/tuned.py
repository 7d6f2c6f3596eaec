"""A scene against a conforming method that is tuned to each error: an edge crack, a penny.

    python -m benchmarks.tuned [edge|penny] [--rounds 3] [--quick] [--json F] [--figure F.png]

The mesh of the conforming method has three parameters: the size of cells at the tip, how fast they
grow and the largest. All combinations run, and at each error the best of them counts, chosen
afterwards: nobody who does not know the answer could choose so well. xcrack runs with its defaults
on meshes of several sizes. Rounds of both take turns; times are medians of processor time, one
thread, from the mesh to K; errors are the largest of the rounds, each on a mesh of its own. The
error of the penny is the root of the mean square along its front.
"""

import argparse
import json
import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks.baselines import conforming_2d, conforming_3d  # noqa: E402
from benchmarks.baselines.conforming_2d import Grading  # noqa: E402
from benchmarks.runs import machine  # noqa: E402
from benchmarks.scenes import penny, plane  # noqa: E402
from benchmarks.scenes.plane import MODES, worst  # noqa: E402
from benchmarks.scenes.settings import Settings  # noqa: E402

Row = dict[str, Any]


@dataclass(frozen=True)
class Scene:
    """What runs for a scene.

    Attributes
    ----------
    error : str
        Name of the error in the figure.
    levels : tuple of float
        Errors of the table.
    sizes : tuple of int
        Cells a side for xcrack.
    near, growth, far : tuples of float
        Gradings of the conforming method.
    xcrack_error : callable (n, seed) -> float
        A run of xcrack.
    conforming_error : callable (Grading, seed) -> float
        A run of the conforming method.
    """

    error: str
    levels: tuple[float, ...]
    sizes: tuple[int, ...]
    near: tuple[float, ...]
    growth: tuple[float, ...]
    far: tuple[float, ...]
    xcrack_error: Callable[[int, int], float]
    conforming_error: Callable[[Grading, int], float]


def _conforming_edge(grading: Grading, seed: int) -> float:
    finer = Grading(grading.near, grading.growth, grading.far / (1 + 0.03 * seed))
    return worst(conforming_2d.edge(finer, MODES)[0], MODES)


SCENES = {
    "edge": Scene(
        "K", (1e-3, 2e-4, 1e-4, 1e-5), (5, 6, 7, 8, 9, 11, 13, 17, 23, 31, 41),
        (0.1, 0.05, 0.02, 0.01, 3e-3, 1e-3, 1e-4), (0.15, 0.2, 0.3, 0.4, 0.6),
        (0.1, 0.15, 0.2, 0.3, 0.4, 0.6),
        lambda n, seed: plane.edge(Settings(n), seed).errors["K"], _conforming_edge,
    ),
    "penny": Scene(
        "K_I along the front", (1e-2, 5e-3, 3e-3, 2e-3), (5, 6, 7, 8, 10, 13),
        (0.3, 0.2, 0.15, 0.1, 0.07), (0.4, 0.55, 0.7), (0.5, 0.7),
        lambda n, seed: penny.penny_open(Settings(n), seed).errors["rms"],
        lambda grading, seed: conforming_3d.penny(grading, seed).errors["rms"],
    ),
}  # fmt: skip


def _timed(run: Callable[[Any, int], float], setting: Any, seed: int) -> tuple[float, float]:
    start = process_time()
    error = run(setting, seed)
    return process_time() - start, error


def run(scene: Scene, rounds: int, quick: bool) -> tuple[list[Row], list[Row]]:
    """Rows of xcrack and of the conforming method, each with time and error."""
    sizes = scene.sizes[::3] if quick else scene.sizes
    parameters = [v[::3] if quick else v for v in (scene.near, scene.growth, scene.far)]
    gradings = list(product(*parameters))
    runs: list[Any] = [partial(_timed, scene.xcrack_error, n) for n in sizes]
    runs += [partial(_timed, scene.conforming_error, Grading(*g)) for g in gradings]
    runs[0](0), runs[len(sizes)](0)  # kernels and imports
    results: list[list[tuple[float, float]]] = [[] for _ in runs]
    for seed in range(rounds):
        for one, result in zip(runs, results, strict=True):
            result.append(one(seed))
    rows = [
        {"setting": s, "time": median(t for t, _ in result), "error": max(e for _, e in result)}
        for s, result in zip([*sizes, *gradings], results, strict=True)
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


def draw(scene: Scene, ours: list[Row], theirs: list[Row], path: Path) -> None:
    """Error against time: all meshes of the conforming method, its best ones, and the defaults."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullFormatter

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
    axis.set(xlabel="processor time, s", ylabel=f"relative error of {scene.error}")
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.grid(True, which="both", color="0.9", lw=0.6)
    axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Run, print the table, store and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", choices=SCENES, nargs="?", default="edge")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    if conforming_2d.missing():
        parser.error(conforming_2d.missing())
    warnings.simplefilter("ignore")
    scene = SCENES[options.scene]
    ours, theirs = run(scene, options.rounds, options.quick)
    print("| error of K | xcrack, ms (cells a side) | conforming, ms (near, growth, far) | ratio |")
    print("|---|---|---|---|")
    for level in scene.levels:
        ours_at, other = reached(ours, level, True), reached(theirs, level, False)
        if ours_at is None or other is None:
            continue
        print(
            f"| {level:g} | {1e3 * ours_at['time']:.1f} ({ours_at['setting']}) | "
            f"{1e3 * other['time']:.1f} ({', '.join(f'{v:g}' for v in other['setting'])}) | "
            f"{ours_at['time'] / other['time']:.2f} |"
        )
    if options.json:
        about = {"machine": machine(), "xcrack": ours, "conforming": theirs}
        options.json.write_text(json.dumps(about, indent=1) + "\n")
    if options.figure:
        draw(scene, ours, theirs, options.figure)


if __name__ == "__main__":
    main()
