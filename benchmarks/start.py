"""What is paid before the first number: imports, compiled kernels, stiffness of the plain body.

    python -m benchmarks.start

Cold start: a process of its own for each line, with an empty cache of numba and with a full one.
Assembly: linear cells, values and pattern of the stiffness of the uncracked body, one thread.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "XCRACK_THREADS",
):
    os.environ.setdefault(name, "1")

START = """
import time; begin = time.perf_counter()
import xcrack; imported = time.perf_counter()
from benchmarks.scenes import penny, plane
from benchmarks.scenes.settings import Settings
scene, settings = {scene}, Settings({n})
scene(settings, 0); first = time.perf_counter()
scene(settings, 0); second = time.perf_counter()
print(f"import {{imported - begin:.2f}} s, first {{first - imported:.2f}} s, "
      f"later {{second - first:.2f}} s")
"""
SCENES = {"2D": ("plane.edge", 9), "3D": ("penny.penny_closed", 8)}
ROOT = Path(__file__).resolve().parent.parent


def cold_start() -> None:
    """First and later scenes of a process."""
    for where, (scene, n) in SCENES.items():
        with tempfile.TemporaryDirectory() as cache:
            for state in ("empty", "full"):
                run = subprocess.run(
                    [sys.executable, "-W", "ignore", "-c", START.format(scene=scene, n=n)],
                    env=os.environ | {"NUMBA_CACHE_DIR": cache}, cwd=ROOT,
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
                print(f"{where}, {state} cache: {run.stdout.strip()}", flush=True)


def assembly() -> None:
    """Nanoseconds a cell."""
    import numpy as np

    import xcrack as xc
    from xcrack.fem.kernels.stiffness import add_block_stiffness, block_pattern
    from xcrack.mesh.simplex import cell_nodes, shape_derivatives, simplex_rule

    for dim, n in ((2, 400), (3, 36)):
        mesh = xc.box((0,) * dim, (1,) * dim, n)
        nodes = np.ascontiguousarray(cell_nodes(mesh, 1))
        bary, weight = simplex_rule(dim, 0)
        fixed = (mesh.gradient, mesh.volume, shape_derivatives(1, bary), bary, weight, None)
        cells = np.arange(len(mesh.cells))
        times: dict[str, list[float]] = {"pattern": [], "values": []}
        for _ in range(6):  # the first compiles
            begin = time.process_time()
            _, indices, slot = block_pattern(nodes, mesh.n_points)
            middle = time.process_time()
            data = np.zeros((len(indices), dim, dim))
            add_block_stiffness(data, 0, len(indices), cells, slot, *fixed, 1.0, 0.7, None)
            times["pattern"].append(middle - begin)
            times["values"].append(time.process_time() - middle)
        each = {k: 1e9 * median(v[1:]) / len(mesh.cells) for k, v in times.items()}
        print(
            f"{len(mesh.cells)} cells in {dim}D: pattern {each['pattern']:.0f} ns, "
            f"values {each['values']:.0f} ns a cell"
        )


if __name__ == "__main__":
    cold_start()
    assembly()
