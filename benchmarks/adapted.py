"""`python -m benchmarks.adapted`: curves of `adapt` beside those of uniform meshes, K over time.

Three scenes: an edge crack and a crack closed by a third, exact fields, the same as those of the
charts; and an edge crack that stops before a hole, against a run that is 30 times as accurate. In
the first two the crack is as long as the body; at the hole something else decides the error. One
process, one thread, processor time, medians of three rounds (other meshes each).
"""

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from statistics import median
from time import process_time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402 - threads are set before

import xcrack as xc  # noqa: E402
from benchmarks.scenes import plane  # noqa: E402
from benchmarks.scenes.settings import Settings  # noqa: E402

TOLERANCES = (1e-2, 1e-3, 3e-4, 1e-4, 3e-5)
ROUNDS = 3
SIZES = (0.2, 0.14, 0.1, 0.07, 0.05, 0.035, 0.025)

Result = tuple[float, int]  # error, unknowns
Runs = Iterator[tuple[str, Callable[[int], Result]]]


def of_charts(uniform: Callable[..., object], adapted: Callable[..., object]) -> Runs:
    """Runs of a scene of the charts."""

    def first(run: Callable[..., object], choice: object, seed: int) -> Result:
        outcome = run(choice, seed)
        return next(iter(outcome.errors.values())), outcome.unknowns  # type: ignore[attr-defined]

    for n in (7, 11, 17, 23, 31, 41):
        yield f"n = {n}", partial(first, uniform, Settings(n))
    for tolerance in TOLERANCES:
        yield f"adapt to {tolerance:g}", partial(first, adapted, tolerance)


def beside_a_hole() -> Runs:
    """An edge crack that ends at the distance of its radius from a hole of a plate."""
    coarse = xc.plate(
        1.0, 2.0, lower=(0.0, -1.0), holes=[((0.62, 0.14), 0.1)], size=0.3, size_near=0.1
    )
    pull = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    crack = xc.line_crack([(-0.3, 0.01), (0.4, 0.01)])
    material = xc.Isotropic(1.0, 0.3, plane="strain")

    def scene(mesh: xc.Mesh) -> xc.Problem:
        return xc.Problem(mesh, material, [crack], loads=pull, contact="off")

    exact = xc.adapt(scene(coarse), TOLERANCES[-1] / 10, progress=False).sif.best

    def wrong(K: np.ndarray) -> float:
        return float(np.abs(K - exact).max() / np.abs(exact).max())

    def uniform(mesh: xc.Mesh, seed: int) -> Result:
        del seed
        fresh = xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets, curves=mesh.curves)
        solution = xc.solve(scene(fresh))
        return wrong(xc.stress_intensity(solution).K), solution.n_dof

    def adapted(tolerance: float, seed: int) -> Result:
        del seed
        result = xc.adapt(scene(coarse), tolerance, progress=False)
        return wrong(result.sif.best), result.rounds[-1].unknowns

    for size in SIZES:
        yield f"h = {size:g}", partial(uniform, xc.refine(coarse, size=size))
    for tolerance in TOLERANCES:
        yield f"adapt to {tolerance:g}", partial(adapted, tolerance)


def main() -> int:
    """Print a table of all runs."""
    warnings.simplefilter("ignore", xc.XcrackWarning)
    scenes = {
        "edge": of_charts(plane.edge, plane.edge_adapted),
        "half_closed": of_charts(plane.half_closed, plane.half_closed_adapted),
        "hole": beside_a_hole(),
    }
    for name, runs in scenes.items():
        for label, run in runs:
            rows = []
            for seed in range(ROUNDS + 1):  # the first compiles kernels
                start = process_time()
                error, unknowns = run(seed)
                rows.append((process_time() - start, error, unknowns))
            seconds, worst = median(r[0] for r in rows[1:]), max(r[1] for r in rows[1:])
            print(f"| {name} | {label} | {rows[-1][2]} | {seconds:.3f} | {worst:.1e} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
