"""One thread and more: wall time by part, and a chart of how much quicker more threads are.

    python -m benchmarks.threads [--scenes penny edge] [--size 40] [--most 16] [--rounds 3]
                                 [--json F] [--figure F.png]

Rounds of all numbers of threads take turns in one process, and each part counts with its shortest
time. Solutions are compared bit by bit. Other work on the machine makes times worse, never better:
the load average is printed with them. `shared` is the share of the processor time that was spent by
other threads than the first; it hardly depends on that work, and bounds what more threads can gain.
"""

import argparse
import json
import os
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # threads of BLAS are none of ours

import numpy as np  # noqa: E402

import xcrack as xc  # noqa: E402
from xcrack.base import machine  # noqa: E402
from xcrack.fem.system import build  # noqa: E402

Times = dict[str, float]
PARTS = ("matrices", "solution", "K", "whole")


def penny(n: int) -> xc.Problem:
    """Tilted penny in a cube, three load states in one solve: multigrid."""
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    loads = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]
    body = xc.box((-1,) * 3, (1,) * 3, n)
    steel = xc.Isotropic(210e3, 0.3)
    return xc.Problem(body, steel, [crack], loads=loads, contact="on", order=1)


def edge(n: int) -> xc.Problem:
    """Edge crack in a square of four times as many cells a side, order 2: factorisation."""
    crack = xc.line_crack([(-1.2, 0.013), (-0.1, 0.041)])
    loads = [xc.traction("top", (0.0, 100.0)), xc.traction("bottom", (0.0, -100.0))]
    body = xc.box((-1, -1), (1, 1), 4 * n)
    return xc.Problem(body, xc.Isotropic(210e3, 0.3, "strain"), [crack], loads=loads, contact="on")


SCENES: dict[str, Callable[[int], xc.Problem]] = {"penny": penny, "edge": edge}


def measured(problem: xc.Problem, count: int) -> tuple[Times, bytes]:
    """Wall time and shared part by part with a number of threads, and the results as bytes."""
    problem = replace(problem, numerics=replace(problem.numerics, threads=count))
    clock = [_clocks()]
    with machine.threads(count):
        build(problem)
    clock.append(_clocks())
    solutions = xc.solve(problem, states=[1.0, -1.0])
    clock.append(_clocks())
    K = [s.K for s in xc.stress_intensities(solutions)]
    clock.append(_clocks())
    matrices, solved, of_K = np.diff(clock, axis=0)
    parts = {"matrices": matrices, "solution": solved - matrices, "K": of_K, "whole": solved + of_K}
    times = {name: float(part[0]) for name, part in parts.items()}
    times |= {f"{name}, shared": float(1 - part[2] / part[1]) for name, part in parts.items()}
    results = [s.u for s in solutions] + K
    return times, b"".join(np.ascontiguousarray(part).tobytes() for part in results)


def _clocks() -> tuple[float, float, float]:
    """Wall time, processor time of the process, and that of this thread."""
    return time.perf_counter(), time.process_time(), time.thread_time()


def numbers(most: int) -> list[int]:
    """1, 2, 4 … and the largest."""
    return sorted({*(2**k for k in range(most.bit_length())), most})


def compare(name: str, size: int, most: int, rounds: int) -> dict[str, Any]:
    """Shortest times of each part by number of threads."""
    problem = SCENES[name](size)
    best: dict[int, Times] = {}
    _, bits = measured(problem, 1)  # kernels are compiled, what the mesh knows is made
    same = True
    for _ in range(rounds):
        for count in numbers(most):
            times, own = measured(problem, count)
            same = same and own == bits
            before = best.get(count, times)
            best[count] = {part: min(before[part], times[part]) for part in times}
    return {"same_bits": same, "seconds": best}


def draw(results: dict[str, Any], path: Path) -> None:
    """Time of one thread over that of more, by part."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(results), figsize=(4.5 * len(results), 3.6), squeeze=False)
    for axis, (name, result) in zip(axes[0], results.items(), strict=True):
        seconds = result["seconds"]
        counts = sorted(seconds)
        axis.plot(counts, counts, color="0.7", lw=1, label="as many times")
        for part in PARTS:
            gain = [seconds[counts[0]][part] / seconds[n][part] for n in counts]
            axis.plot(counts, gain, "o-", label=part, lw=2 if part == "whole" else 1)
        axis.set(xlabel="threads", ylabel="times quicker than one", title=name, xticks=counts)
        axis.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--size", type=int, default=40, help="cells a side in 3D")
    parser.add_argument("--most", type=int, default=machine.available_processors())
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    results = {}
    for name in options.scenes:
        result = results[name] = compare(name, options.size, options.most, options.rounds)
        one = result["seconds"][1]
        print(f"{name}, bits {'the same' if result['same_bits'] else 'NOT THE SAME'}")
        for count, times in sorted(result["seconds"].items()):
            row = "  ".join(
                f"{part} {times[part]:.3f} s ({times[part] / one[part]:.2f}, shared "
                f"{times[f'{part}, shared']:.0%})"
                for part in PARTS
            )
            print(f"  {count:2d} threads: {row}", flush=True)
    load = os.getloadavg()[0]
    print(f"load average {load:.1f} on {os.cpu_count()} processors")
    if options.json:
        options.json.write_text(json.dumps({"load": load, **results}, indent=1) + "\n")
    if options.figure:
        draw(results, options.figure)


if __name__ == "__main__":
    main()
