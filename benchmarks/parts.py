"""Time and memory of a closed crack in 2D, by part.

Scene: edge crack in [-1, 1]² under uniform compression and a K_II field, order 2. Each size runs
in a process of its own, so that the peak memory is its own; kernels are warm. Prints a table.

    python -m benchmarks.parts [unknowns ...]
"""

import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import xcrack as xc
from xcrack.analysis.multipliers import gap_rows, multipliers
from xcrack.fem.assembly import bulk, enriched_stiffness, total_stiffness
from xcrack.fem.cut import cut
from xcrack.fem.facets import jump_matrix, lip_points
from xcrack.fem.function_space import function_space
from xcrack.fem.level_set import line_levels
from xcrack.fem.loads import known_unknowns, load_vector
from xcrack.fem.system import CELLS
from xcrack.linalg import direct as linear
from xcrack.linalg.engine import ContactRows
from xcrack.linalg.rigid_motion import free_motion

ROOT = Path(__file__).resolve().parent.parent
PARTS = ("mesh", "level sets", "cut and space", "bulk", "enriched cells", "loads", "factor",
         "solve", "contact", "K")  # fmt: skip


def scene(n: int) -> xc.Problem:
    """Closed edge crack in a square that is pressed on all sides and sheared."""
    mesh = xc.box((-1, -1), (1, 1), n)
    steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
    sides = ("left", "right", "bottom", "top")
    shear: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
        s: lambda x, normal: 0.3 * normal[:, ::-1] for s in sides
    }
    loads = [xc.pressure(s, 1.0) for s in sides] + [xc.traction(s, f) for s, f in shear.items()]
    crack = xc.line_crack([(-1.2, 0.0313), (0.0831, 0.0471)])
    return xc.Problem(mesh, steel, [crack], loads=loads)


def run(n: int) -> None:
    """Run one size and print its times in seconds, unknowns and peak memory in MB."""
    times: dict[str, float] = {}

    @contextmanager
    def part(name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        times[name] = times.get(name, 0.0) + time.perf_counter() - start

    xc.stress_intensity(xc.solve(scene(16)))
    with part("mesh"):
        problem = scene(n)
        mesh, body, numerics = problem.mesh, problem.elasticity, problem.numerics
        _ = mesh.edges, mesh.gradient, mesh.volume, mesh.facets, mesh.cell_tree, problem.placed
    with part("level sets"):
        levels = line_levels(mesh, problem.placed[0])
    with part("cut and space"):
        cuts = (cut(mesh, levels, CELLS[2]),)
        V = function_space(mesh, 2, problem.placed, cuts, numerics, CELLS[2])
        lips = (lip_points(V, 0),)
        _ = V.signature
    with part("bulk"):
        plain = bulk(body, 2)
    with part("enriched cells"):
        K = total_stiffness(plain, enriched_stiffness(V, body, numerics, lips)[0])
    with part("loads"):
        vectors = [load_vector(V, body, load, lips) for load in problem.loads]
        f = np.sum(vectors, axis=0)[:, None]
        fixed = known_unknowns(V, ()).is_fixed.copy()
        fixed[free_motion(V, fixed).pins] = True
    with part("factor"):
        engine = linear.system(V, K, fixed, numerics)
    with part("solve"):
        u = engine.solve(f)
    with part("contact"):
        chosen = multipliers(V, 0, lips[0], "reduced")
        N = gap_rows(chosen, lips[0], jump_matrix(V, 0, lips[0]))
        rows = ContactRows(N, chosen.measure, body.largest_modulus * n / 2, True)
        engine.contact(rows, f, np.zeros_like(f), [None], u_opened=u)
    solution = xc.solve(problem)
    with part("K"):
        xc.stress_intensity(solution)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    seconds = [f"{times[p]:.3f}" for p in PARTS]
    row = [f"{V.n_dof}", *seconds, f"{sum(times.values()):.2f}", f"{peak:.0f}"]
    print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--one":
        run(int(sys.argv[2]))
        sys.exit()
    print("| unknowns | " + " | ".join(PARTS) + " | total s | peak MB |")
    print("|" + "---|" * (len(PARTS) + 3), flush=True)
    for size in [int(a) for a in sys.argv[1:]] or [10_000, 100_000, 500_000]:
        cells = round((size / 8.7) ** 0.5)
        command = [sys.executable, "-m", "benchmarks.parts", "--one", str(cells)]
        subprocess.run(command, cwd=ROOT, check=True)
