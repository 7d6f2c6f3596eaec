"""Processor time of a growth that turns at the same error of its path, beside another checkout's.

    python -m benchmarks.equal_error /path/to/other/checkout [--meshes uniform graded] [--rounds 3]

The scene is `growth` of the charts; the other checkout takes Euler's steps, which is all that
0fd7707 has. Both have the same mesh and unknowns; rounds alternate. Printed are steps, error of the
path over the length grown, and processor seconds of the run without its mesh and first step, then
those of each of our runs over those of the other at the same error, between and beyond its runs by
powers.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
import warnings
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent.parent
RESULT = HERE / "benchmarks" / "results" / "equal_error.json"
GROWN, PATH_END = 0.75, np.array([0.23309, 0.35077])  # of benchmarks.scenes.growth
CELLS = {"uniform": 21, "graded": 34}  # about 4 thousand unknowns both
STEPS = {"pec": (3, 4, 5, 8), "euler": (8, 15, 30, 50)}


def run(kind: str, steps: int, integrator: str) -> dict[str, float]:
    """Seconds of the steps, unknowns, and error of the path of one run."""
    from inspect import signature

    import xcrack as xc

    if kind == "uniform":
        body = xc.box((-1, -1), (1, 1), CELLS[kind])
    else:
        body = xc.plate(
            2.0, 2.0, lower=(-1.0, -1.0), size=0.25, size_near=2.0 / CELLS[kind],
            along=[(-0.6, 0.2), (0.3, 0.35)], band=0.15,
        )  # fmt: skip
    tension = np.diag([0.0, 1.0])
    loads = [xc.traction(side, lambda x, n: n @ tension) for side in ("bottom", "top")]
    problem = xc.Problem(
        body, xc.Isotropic(1.0, 0.3, "strain"), [xc.line_crack([(-1.1, -0.04), (-0.5, 0.2)])],
        loads=loads,
    )  # fmt: skip
    known = {"integrator"} & set(signature(xc.grow).parameters)
    grown = xc.grow(
        problem, xc.paris(C=1e-3, m=2.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), GROWN / steps,
        max_steps=steps + 1, progress=False, **dict.fromkeys(known, integrator),
    )  # fmt: skip
    next(grown)
    start = time.process_time()
    step = list(grown)[-1]
    seconds = time.process_time() - start
    tip = getattr(step, "corrected", step.cracks)[0].points[-1]
    error = float(np.linalg.norm(tip - PATH_END)) / GROWN
    return {"seconds": seconds, "error": error, "unknowns": step.solutions[0].n_dof}


def serve() -> None:
    """Run what each line read asks for."""
    warnings.simplefilter("ignore")
    for line in sys.stdin:
        print(json.dumps(run(*json.loads(line))), flush=True)


def _process(checkout: Path) -> subprocess.Popen[str]:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS")
    environment = {**os.environ, "PYTHONPATH": str(checkout / "src"), **dict.fromkeys(names, "1")}
    return subprocess.Popen(
        [sys.executable, __file__, "--serve"], env=environment, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


def _asked(process: subprocess.Popen[str], *label: Any) -> dict[str, float]:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(json.dumps(label) + "\n")
    process.stdin.flush()
    return dict(json.loads(process.stdout.readline()))


def compare(kind: str, other: Path, rounds: int) -> dict[str, Any]:
    """Rows of (steps, error, seconds) of both codes; the first round is not counted."""
    processes = {"pec": _process(HERE), "euler": _process(other)}
    rows: dict[str, list[list[dict[str, float]]]] = {name: [] for name in processes}
    for _ in range(rounds + 1):
        for name, process in processes.items():
            rows[name].append([_asked(process, kind, n, name) for n in STEPS[name]])
    for process in processes.values():
        process.kill()
    result: dict[str, Any] = {}
    for name, all_rounds in rows.items():
        result[name] = [
            [steps, each[0]["error"], median(row["seconds"] for row in each)]
            for steps, each in zip(STEPS[name], zip(*all_rounds[1:]))
        ]
        result["unknowns"] = all_rounds[0][0]["unknowns"]
    error, seconds = (np.log([row[k] for row in result["euler"]][::-1]) for k in (1, 2))
    result["ratios"] = []
    for _, own, took in result["pec"]:
        # Beyond the other's last runs by their power.
        low, high = np.polyfit(error[:2], seconds[:2], 1), np.polyfit(error[-2:], seconds[-2:], 1)
        x = np.log(own)
        line = low if x < error[0] else high
        inside = error[0] <= x <= error[-1]
        at = np.interp(x, error, seconds) if inside else np.polyval(line, x)
        result["ratios"].append(float(took / np.exp(at)))
    return result


def main() -> None:
    """Compare, print and store."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("other", nargs="?", type=Path)
    parser.add_argument("--meshes", nargs="*", default=list(CELLS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve()
        return
    table = {
        kind: compare(kind, options.other.resolve(), options.rounds) for kind in options.meshes
    }
    for kind, row in table.items():
        print(f"{kind}, {row['unknowns']:.0f} unknowns")
        for name in ("euler", "pec"):
            for k, (steps, error, seconds) in enumerate(row[name]):
                ratio = f"  {row['ratios'][k]:.2f} of the other" if name == "pec" else ""
                print(f"  {name:6} {steps:3d} steps  {error:.1e}  {seconds:.3f} s{ratio}")
    RESULT.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
