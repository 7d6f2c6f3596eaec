"""Processor time of this code beside that of another checkout, scene by scene, in turns.

    python -m benchmarks.beside /path/to/other/checkout [--scenes "edge 53 k" ...] [--rounds 7]
    python -m benchmarks.beside /path/to/other/checkout --sizes [--most 120000] [--rounds 1]
    python -m benchmarks.beside /path/to/other/checkout --bars

One process for each of the two stays alive; rounds alternate, so that transient load on
the machine affects both. Scenes use public names that both have. Printed are medians of processor
seconds, the ratio of each pair of rounds (median, smallest, largest), and how far K and pressures
are apart, relative to the largest. One thread. With `--sizes` scenes have 10 thousand to a
million unknowns, and seconds are told by part: mesh, problem, solution, K. With `--bars` the error
bars of K are made besides, by the code that has them, and printed is what they take of the time of
solution and K of this code and of the other.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent.parent
Numbers = dict[str, Any]


def _pull(dim: int, size: float = 100.0) -> list[Any]:
    import xcrack as xc

    up = (0.0,) * (dim - 1) + (size,)
    return [xc.traction("top", up), xc.traction("bottom", tuple(-v for v in up))]


def _numbers(solutions: list[Any]) -> Numbers:
    import xcrack as xc

    K = np.concatenate([s.K.ravel() for s in xc.stress_intensities(solutions)])
    pressures = [c.pressure for s in solutions for c in s.contact if c is not None]
    closed = [int(c.closed.sum()) for s in solutions for c in s.contact if c is not None]
    return {
        "K": K.tolist(),
        "pressure": np.concatenate(pressures).tolist() if pressures else [],
        "closed": closed,
        "unknowns": solutions[0].n_dof,
    }


class _Parts:
    """Processor seconds of the parts of a round."""

    def __init__(self) -> None:
        self.last = time.process_time()
        self.seconds: dict[str, float] = {}

    def end(self, name: str) -> None:
        now = time.process_time()
        self.seconds[name], self.last = now - self.last, now

    def numbers(self, solutions: list[Any]) -> Numbers:
        numbers = _numbers(solutions)
        self.end("K")
        return numbers | {"parts": self.seconds}


def edge(n: int, contact: str = "off", states: tuple[float, ...] = (1.0,)) -> Iterator[Numbers]:
    """Edge crack in 2D, order 2, from mesh to K."""
    import xcrack as xc

    while True:
        parts = _Parts()
        mesh = xc.box((-1, -1), (1, 1), n)
        parts.end("mesh")
        problem = xc.Problem(
            mesh, xc.Isotropic(210e3, 0.3, "strain"),
            [xc.line_crack([(-1.2, 0.013), (-0.1, 0.041)])], loads=_pull(2), contact=contact,
        )  # fmt: skip
        parts.end("problem")
        solutions = xc.solve(problem, states=list(states))
        parts.end("solution")
        yield parts.numbers(solutions)


def bars(n: int, start: float = -1.2, stop: float = -0.1) -> Iterator[Numbers]:
    """Crack with one tip or two in 2D, order 2: solution and K, and the error bars of K."""
    from inspect import signature

    import xcrack as xc

    line = [(start, 0.013), (stop, 0.041)]
    known = {"error"} & set(signature(xc.solve).parameters)
    while True:
        mesh = xc.box((-1, -1), (1, 1), n)
        problem = xc.Problem(
            mesh, xc.Isotropic(210e3, 0.3, "strain"), [xc.line_crack(line)], loads=_pull(2),
            contact="off",
        )  # fmt: skip
        parts = _Parts()
        solutions = xc.solve(problem, states=[1.0], **dict.fromkeys(known, True))
        parts.end("solution")
        sifs = xc.stress_intensities(solutions, **dict.fromkeys(known, False))
        parts.end("K")
        if known:
            from xcrack.sif.error import with_bars

            with_bars(solutions, sifs, 0)
            parts.end("bars")
        K = np.concatenate([s.K.ravel() for s in sifs]).tolist()
        yield {
            "K": K, "pressure": [], "closed": [], "unknowns": solutions[0].n_dof,
            "parts": parts.seconds,
        }  # fmt: skip


def growth(n: int, contact: str, first: bool = False) -> Iterator[Numbers]:
    """A later step of growth with two states, in a mesh of uniform cells; a round is one step.

    By Euler's rule, which is what the other has where it knows no other.
    """
    from inspect import signature

    import xcrack as xc

    known = {"integrator"} & set(signature(xc.grow).parameters)

    def run() -> Any:
        problem = xc.Problem(
            xc.box((-1, -1), (1, 1), n), xc.Isotropic(210e3, 0.3, "strain"),
            [xc.line_crack([(-1.1, -0.04), (-0.61, -0.02)])], loads=_pull(2), contact=contact,
        )  # fmt: skip
        return xc.grow(
            problem, xc.paris(C=1e-3, m=2.0), xc.max_hoop_stress, xc.Cycle(-0.5, 1.0), 0.05,
            max_steps=16, progress=False, **dict.fromkeys(known, "euler"),
        )  # fmt: skip

    steps, count = run(), 0
    if not first:
        next(steps)
    while True:
        step = next(steps, None)
        if step is None or first:
            steps = run()
            step = next(steps)
            if not first:
                step = next(steps)
        count += 1
        yield {
            "K": step.sif[1][0].K.ravel().tolist(), "pressure": [], "closed": [],
            "unknowns": step.solutions[0].n_dof,
        }  # fmt: skip


def penny(n: int, order: int = 1) -> Iterator[Numbers]:
    """Penny in 3D, from mesh to K."""
    import xcrack as xc

    while True:
        crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
        mesh = xc.box((-1,) * 3, (1,) * 3, n)
        problem = xc.Problem(
            mesh, xc.Isotropic(210e3, 0.3), [crack], loads=_pull(3), order=order, contact="off"
        )
        yield _numbers([xc.solve(problem)])


def bending(n: int) -> Iterator[Numbers]:
    """Edge crack through a block in 3D, three states, closed in one, half closed in another."""
    import xcrack as xc

    def bend(sign: float) -> list[Any]:
        return [
            xc.traction(side, lambda x, s=s: np.stack(
                [0 * x[:, 0], 0 * x[:, 0], sign * s * (20 + 100 * x[:, 0])], axis=1))
            for side, s in (("top", 1.0), ("bottom", -1.0))
        ]  # fmt: skip

    while True:
        parts = _Parts()
        mesh = xc.box((-1,) * 3, (1,) * 3, n)
        parts.end("mesh")
        crack = xc.plane_crack(
            [(-1.5, -1.5, 0.03), (-0.1, -1.5, 0.03), (-0.1, 1.5, 0.03), (-1.5, 1.5, 0.03)]
        )
        problem = xc.Problem(mesh, xc.Isotropic(210e3, 0.3), [crack], loads=_pull(3), order=1)
        parts.end("problem")
        solutions = xc.solve(problem, states=[1.0, bend(1.0), bend(-1.0)])
        parts.end("solution")
        numbers = parts.numbers(solutions)
        del mesh, problem, solutions  # the next round has its own peak of memory
        yield numbers


CLOSED = (-1.0,)
SCENES: dict[str, Callable[[], Iterator[Numbers]]] = {
    "edge 0.6 k": lambda: edge(6),
    "edge 4.7 k": lambda: edge(22),
    "edge 53 k": lambda: edge(76),
    "edge 474 k": lambda: edge(231),
    "closed 4.7 k": lambda: edge(22, "on", CLOSED),
    "closed 53 k": lambda: edge(76, "on", CLOSED),
    "three states 4.7 k": lambda: edge(22, "auto", (1.0, -1.0, 0.5)),
    "growth step 4 k": lambda: growth(21, "off"),
    "growth step 20 k": lambda: growth(49, "off"),
    "growth step 47 k": lambda: growth(75, "off"),
    "growth step 47 k, contact": lambda: growth(75, "on"),
    "growth step 101 k": lambda: growth(110, "off"),
    "growth step 101 k, contact": lambda: growth(110, "on"),
    "first step 47 k": lambda: growth(75, "off", True),
    "penny 5.8 k": lambda: penny(10),
    "penny 30 k": lambda: penny(20),
    "penny, order 2, 22 k": lambda: penny(8, 2),
    "bending 30 k": lambda: bending(20),
    "bending 104 k": lambda: bending(31),
    "bending 310 k": lambda: bending(45),
}

SIZES: dict[str, int] = {  # scenes with parts, and about how many unknowns
    "2D 10 k": 10_000, "2D 100 k": 100_000, "2D 500 k": 500_000,
    "3D 30 k": 30_000, "3D 100 k": 100_000, "3D 300 k": 300_000, "3D 1 M": 1_000_000,
}  # fmt: skip
SCENES |= {
    "2D 10 k": lambda: edge(33),
    "2D 100 k": lambda: edge(105),
    "2D 500 k": lambda: edge(237),
    "3D 30 k": lambda: bending(20),
    "3D 100 k": lambda: bending(31),
    "3D 300 k": lambda: bending(45),
    "3D 1 M": lambda: bending(67),
}


BARS: dict[str, Callable[[], Iterator[Numbers]]] = {  # with error bars of K
    f"bars {size} k{name}": lambda n=n, ends=ends: bars(n, *ends)  # type: ignore[misc]
    for name, ends in (
        ("", (-1.2, -0.1)), (", two tips", (-0.52, 0.43)), (", short, two tips", (-0.52, -0.1)),
    )
    for size, n in ((5, 22), (10, 33), (20, 48), (39, 67))
}  # fmt: skip
SCENES |= BARS


def serve(name: str) -> None:
    """Run a round for each line read; print its processor time, memory and numbers."""
    import resource

    warnings.simplefilter("ignore")
    rounds = SCENES[name]()
    for _ in sys.stdin:
        start, wall = time.process_time(), time.perf_counter()
        numbers = next(rounds)
        numbers |= {"seconds": time.process_time() - start, "wall": time.perf_counter() - wall}
        numbers["peak"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        print(json.dumps(numbers), flush=True)


def _process(checkout: Path, name: str) -> subprocess.Popen[str]:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS")
    one = dict.fromkeys(names, "1")
    environment = {**os.environ, "PYTHONPATH": str(checkout / "src"), **one}
    return subprocess.Popen(
        [sys.executable, __file__, "--serve", name], env=environment, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


def _round(process: subprocess.Popen[str]) -> Numbers:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write("\n")
    process.stdin.flush()
    return dict(json.loads(process.stdout.readline()))


def _apart(one: list[float], other: list[float]) -> float:
    if len(one) != len(other) or not one:
        return float("nan")
    return float(np.abs(np.subtract(one, other)).max() / max(np.abs(other).max(), 1e-300))


def compare(name: str, other: Path, rounds: int) -> Numbers:
    """Rounds of a scene in turns; the first of each is not counted."""
    processes = [_process(HERE, name), _process(other, name)]
    results: list[list[Numbers]] = [[], []]
    for k in range(rounds + 1):
        for process, own in zip(processes, results):
            numbers = _round(process)
            if k:
                own.append(numbers)
    for process in processes:
        process.kill()
    new, old = results
    ratios = [a["seconds"] / b["seconds"] for a, b in zip(new, old)]
    last = new[-1], old[-1]
    return {
        "unknowns": new[-1]["unknowns"],
        "seconds": median(r["seconds"] for r in new),
        "seconds_other": median(r["seconds"] for r in old),
        "ratio": median(ratios),
        "ratios": [min(ratios), max(ratios)],
        "peak_MB": [last[0]["peak"], last[1]["peak"]],
        "K_apart": _apart(last[0]["K"], last[1]["K"]),
        "pressure_apart": _apart(last[0]["pressure"], last[1]["pressure"]),
        "bars": _share(results) if name in BARS else [],
        "same_sets": last[0]["closed"] == last[1]["closed"],
        "parts": {
            part: [median(r["parts"].get(part, 0.0) for r in runs) for runs in results]
            for part in new[0].get("parts", {})
        },
    }


def _share(runs: list[list[Numbers]]) -> list[float]:
    """What bars take of the time of solution and K of this code, and of the other's."""
    shares = []
    for other in runs:
        pairs = [(a["parts"], b["parts"]) for a, b in zip(runs[0], other)]
        shares.append(median(a["bars"] / (b["solution"] + b["K"]) for a, b in pairs))
    return shares


def main() -> None:
    """Compare scenes and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("other", nargs="?", type=Path)
    parser.add_argument(
        "--scenes", nargs="*", default=[s for s in SCENES if s not in {**SIZES, **BARS}]
    )
    parser.add_argument("--sizes", action="store_true", help="scenes by size, with parts")
    parser.add_argument("--most", type=int, default=120_000, help="unknowns of --sizes")
    parser.add_argument("--bars", action="store_true", help="what error bars of K take")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
        return
    if options.sizes:
        options.scenes = [name for name, size in SIZES.items() if size <= options.most]
    if options.bars:
        options.scenes = list(BARS)
    table: dict[str, Numbers] = {}
    print(f"{'scene':28} unknowns   seconds  other   ratio (range)      peak MB      K     p  sets")
    for name in options.scenes:
        row = table[name] = compare(name, options.other.resolve(), options.rounds)
        low, high = row["ratios"]
        print(
            f"{name:28} {row['unknowns']:8d} {row['seconds']:9.4f} {row['seconds_other']:7.4f} "
            f"{row['ratio']:6.2f} ({low:.2f} … {high:.2f})  {row['peak_MB'][0]:5.0f} "
            f"{row['peak_MB'][1]:5.0f}  {row['K_apart']:.0e} {row['pressure_apart']:.0e} "
            f"{'same' if row['same_sets'] else 'other'}",
            flush=True,
        )
        if row["bars"]:
            print("    bars: {:.1%} of solution and K, {:.1%} of the other's".format(*row["bars"]))
        if options.sizes:
            parts = [f"{part} {a:.3f} ({b:.3f})" for part, (a, b) in row["parts"].items()]
            print("    " + ", ".join(parts), flush=True)
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
