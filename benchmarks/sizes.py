"""What a scene costs over its size, beside the bare solver: 2D and 3D, with slopes.

    python -m benchmarks.sizes [--most 500000] [--json F] [--figure F.png]

Edge crack in 2D (order 2, factorisation) and through a block in 3D (order 1, multigrid), one state,
without and with contact. Each size runs in a process of its own with warm kernels; counted are
processor times of one thread: from the mesh to K, and of that the solver (factor or levels, and
solution). Peak memory is that of the process.
"""

import argparse
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from time import process_time
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
CELLS = {2: (10, 18, 33, 60, 106, 190, 335), 3: (5, 8, 13, 19, 30, 45, 66)}
UNKNOWNS = {2: 9.0, 3: 3.5}  # about how many a cell of a side in each direction

Row = dict[str, Any]


def scene(dim: int, n: int, contact: bool) -> Any:
    """The problem, with its mesh."""
    import xcrack as xc

    body = xc.box((-1,) * dim, (1,) * dim, n)
    up = (0.0,) * (dim - 1) + (-100.0 if contact else 100.0,)
    loads = [xc.traction("top", up), xc.traction("bottom", tuple(-v for v in up))]
    if dim == 2:
        crack = xc.line_crack([(-1.2, 0.013), (-0.1, 0.041)])
        steel = xc.Isotropic(210e3, 0.3, "strain")
    else:
        crack = xc.plane_crack(
            [(-1.5, -1.5, 0.03), (-0.1, -1.5, 0.03), (-0.1, 1.5, 0.03), (-1.5, 1.5, 0.03)]
        )
        steel = xc.Isotropic(210e3, 0.3)
    return xc.Problem(
        body, steel, [crack], loads=loads, contact="on" if contact else "off", order=4 - dim
    )


def one(dim: int, n: int, contact: bool) -> Row:
    """Times of one size in this process."""
    import resource

    import xcrack as xc
    from xcrack.analysis import solve as analysis

    warnings.simplefilter("ignore")
    solver = [0.0]

    def counted(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def wrapped(*arguments: Any, **options: Any) -> Any:
            start = process_time()
            result = function(*arguments, **options)
            solver[0] += process_time() - start
            return result

        return wrapped

    for name in ("_engine", "solve_contact"):
        setattr(analysis, name, counted(getattr(analysis, name)))
    for warm in (CELLS[dim][0], CELLS[dim][2]):  # both solvers of 3D
        xc.stress_intensity(xc.solve(scene(dim, warm, contact)))
    times = []
    for _ in range(5 if n <= CELLS[dim][1] else 3 if n <= CELLS[dim][3] else 1):
        solver[0], start = 0.0, process_time()
        solution = xc.solve(scene(dim, n, contact))
        xc.stress_intensity(solution)
        times.append((process_time() - start, solver[0]))
    whole, alone = min(times)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return {
        "dim": dim, "contact": contact, "unknowns": solution.n_dof, "whole": whole,
        "solver": alone, "peak_MB": peak,
    }  # fmt: skip


def slope(rows: list[Row], part: str, least: int) -> float:
    """Exponent of the time over the unknowns, of sizes from a least one on."""
    some = [r for r in rows if r["unknowns"] >= least]
    if len(some) < 2:
        return float("nan")
    x, y = (np.log([r[key] for r in some]) for key in ("unknowns", part))
    return float(np.polyfit(x, y, 1)[0])


def draw(rows: list[Row], path: Path) -> None:
    """Time over unknowns, whole scene and solver."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True)
    for axis, dim in zip(axes, (2, 3)):
        for contact, color in ((False, "tab:red"), (True, "tab:blue")):
            own = [r for r in rows if r["dim"] == dim and r["contact"] == contact]
            for part, style in (("whole", "o-"), ("solver", "s--")):
                label = f"{part}{', closed' if contact else ''}: {slope(own, part, 10_000):.2f}"
                axis.loglog(
                    [r["unknowns"] for r in own], [r[part] for r in own], style, color=color,
                    label=label, ms=4,
                )  # fmt: skip
        axis.set(xlabel="unknowns", title=f"{dim}D (slopes above 10 000)")
        axis.legend(frameon=False, fontsize=8)
    axes[0].set(ylabel="processor time, s")
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Run sizes in processes of their own, print, store and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--most", type=int, default=500_000)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--one", nargs=3, type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one[0], options.one[1], bool(options.one[2]))))
        return
    rows: list[Row] = []
    print("| dim | contact | unknowns | scene, s | solver, s | share | peak, MB |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for dim in (2, 3):
        for n in CELLS[dim]:
            if UNKNOWNS[dim] * n**dim > 1.1 * options.most:
                continue
            for contact in (0, 1):
                command = [sys.executable, "-m", "benchmarks.sizes", "--one"]
                run = subprocess.run(
                    [*command, str(dim), str(n), str(contact)], cwd=ROOT, check=True,
                    capture_output=True, text=True,
                )  # fmt: skip
                row = json.loads(run.stdout)
                rows.append(row)
                print(
                    f"| {dim} | {'on' if contact else 'off'} | {row['unknowns']} | "
                    f"{row['whole']:.3f} | {row['solver']:.3f} | "
                    f"{row['solver'] / row['whole']:.2f} | {row['peak_MB']:.0f} |",
                    flush=True,
                )
    for dim in (2, 3):
        for contact in (False, True):
            own = [r for r in rows if r["dim"] == dim and r["contact"] == contact]
            parts = ", ".join(
                f"{part} {slope(own, part, 10_000):.2f}" for part in ("whole", "solver")
            )
            print(f"slopes above 10 000 unknowns, {dim}D, contact {contact}: {parts}")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    if options.figure:
        draw(rows, options.figure)


if __name__ == "__main__":
    main()
