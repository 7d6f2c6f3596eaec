"""Time and memory of a penny crack in a cube, part by part, three load states with contact.

    python -m benchmarks.solid                 # 3e4, 1e5, 3e5 and 1e6 unknowns at order 1
    python -m benchmarks.solid 20 29           # cells a side of the cube
    python -m benchmarks.solid --order 2       # 4e4, 1.2e5 and 3.2e5 unknowns at order 2

Each size runs in a process of its own, so that its peak memory is its own. Everything that numba
compiles is compiled before the clock starts, which counts processor time (one thread).
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "XCRACK_THREADS",
):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

import xcrack as xc  # noqa: E402
from xcrack.analysis.multipliers import gap_rows, multipliers  # noqa: E402
from xcrack.analysis.solve import solve_states  # noqa: E402
from xcrack.fem.assembly import Stiffness, bulk, enriched_stiffness, next_to_enriched  # noqa: E402  # noqa: E402
from xcrack.fem.cut import cut  # noqa: E402
from xcrack.fem.facets import lip_points  # noqa: E402
from xcrack.fem.function_space import function_space  # noqa: E402
from xcrack.fem.loads import known_unknowns, load_vector  # noqa: E402
from xcrack.fem.system import CELLS, System, levels  # noqa: E402
from xcrack.linalg.engine import ContactRows  # noqa: E402
from xcrack.linalg.iterative import iterative_system  # noqa: E402
from xcrack.linalg.rigid_motion import balanced_loads, free_motion  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
SIZES = {1: (18, 29, 44, 67), 2: (10, 16, 23)}
STATES = {
    "tension": [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))],
    "compression and shear": [
        xc.traction("top", (0.4, 0, -1.0)),
        xc.traction("bottom", (-0.4, 0, 1.0)),
        xc.traction("right", (0, 0, 0.4)),
        xc.traction("left", (0, 0, -0.4)),
    ],
    "bending": [
        xc.traction("top", lambda x: np.outer(x[:, 0], (0, 0, 1.0))),
        xc.traction("bottom", lambda x: np.outer(x[:, 0], (0, 0, -1.0))),
    ],
}


def scene(n: int, order: int = 1) -> xc.Problem:
    """A tilted penny of radius 0.5 in a cube of side 2."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), n)
    crack = xc.penny_crack((0.013, -0.021, 0.0317), (0.2, -0.3, 1.0), 0.5)
    return xc.Problem(mesh, xc.Isotropic(E=1.0, nu=0.3), [crack], order=order)


def measure(n: int, order: int = 1) -> dict[str, object]:
    """Seconds of each part, steps of the solver, peak memory."""
    seconds: dict[str, float] = {}

    def timed(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
        start = time.process_time()
        result = function(*arguments)
        seconds[name] = seconds.get(name, 0.0) + time.process_time() - start
        return result

    problem = timed("mesh", scene, n, order)
    mesh, numerics, geometry = problem.mesh, problem.numerics, CELLS[problem.mesh.dim]
    timed("mesh", lambda: (mesh.gradient, mesh.edges, mesh.facets, mesh.cell_size, mesh.cell_tree))
    cracks = timed("crack", lambda: problem.placed)
    phi = timed("level sets", levels, mesh, cracks[0], numerics)
    cuts = (timed("cutting", cut, mesh, phi, geometry),)
    where = timed("cutting", function_space, mesh, order, cracks, cuts, numerics, geometry)
    lips = (timed("cutting", lip_points, where, 0),)
    plain = timed("bulk", bulk, problem.elasticity, order)
    enriched, n_points, _ = timed(
        "enriched cells", enriched_stiffness, where, problem.elasticity, numerics, lips
    )
    K = Stiffness(plain.matrix, enriched)
    beside = next_to_enriched(where)
    known = known_unknowns(where, ())
    model = System(where, lips, plain, enriched, known, n_points)
    motion = timed("set-up", free_motion, where, known.is_fixed)
    engine = timed(
        "set-up",
        iterative_system,
        where,
        K,
        plain,
        known.is_fixed,
        None,
        motion.modes,
        None,
        beside,
    )
    vectors = [
        sum(load_vector(where, problem.elasticity, x, lips) for x in s) for s in STATES.values()
    ]
    loads = np.stack(vectors, axis=1)
    f = balanced_loads(where, motion, loads)[0]
    u = timed("open solves", engine.solve, f)
    open_steps = engine.count.iterations
    chosen = timed("contact", multipliers, where, 0, lips[0], "reduced")
    N = timed("contact", lambda: gap_rows(chosen, lips[0], model.jumps[0]))
    h = mesh.cell_size.mean()
    rows = ContactRows(N, chosen.measure, problem.elasticity.largest_modulus / h, True)
    timed("contact", engine.contact, rows, f, np.zeros_like(f), [None] * 3, u)
    contact_steps = engine.count.iterations - open_steps
    # The same through the front door, for K and for the step after the first.
    start = time.process_time()
    first = solve_states(problem, list(STATES.values()))
    whole = time.process_time() - start
    timed("K", xc.stress_intensity, first[1])
    start = time.process_time()
    next_problem = replace(
        problem, cracks=[xc.penny_crack((0.013, -0.021, 0.0317), (0.2, -0.3, 1.0), 0.52)]
    )
    solve_states(next_problem, list(STATES.values()), reuse=first[0].reuse)
    later = time.process_time() - start
    start = time.process_time()
    solve_states(replace(problem, contact="off"), list(STATES.values()))
    without = time.process_time() - start
    start = time.process_time()
    solve_states(problem, [STATES["compression and shear"]])
    single = time.process_time() - start
    return {
        "n": n,
        "unknowns": where.n_dof,
        "enriched": where.n_dof - 3 * where.n_nodes,
        "groups": len(chosen.measure),
        "points": n_points,
        "seconds": {k: round(v, 3) for k, v in seconds.items()},
        "first step": round(whole, 3),
        "next step": round(later, 3),
        "contact off": round(without, 3),
        "one state": round(single, 3),
        "steps": [open_steps, contact_steps],
        "peak MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


def main() -> None:
    """Run all sizes and print a table."""
    if len(sys.argv) == 4 and sys.argv[1] == "--one":
        order, n = int(sys.argv[2]), int(sys.argv[3])
        measure(6, order)
        print(json.dumps(measure(n, order)))
        return
    order = 1
    if sys.argv[1:2] == ["--order"]:
        order = int(sys.argv[2])
        del sys.argv[1:3]
    for n in [int(a) for a in sys.argv[1:]] or SIZES[order]:
        command = [sys.executable, "-m", "benchmarks.solid", "--one", str(order), str(n)]
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if run.returncode:
            print(run.stderr[-2000:])
            continue
        row = json.loads(run.stdout.splitlines()[-1])
        parts = "  ".join(f"{k} {v}" for k, v in row["seconds"].items())
        print(
            f"n {row['n']}: {row['unknowns']} unknowns, {row['enriched']} enriched, "
            f"{row['groups']} groups, {row['points']} points, peak {row['peak MB']} MB\n"
            f"    {parts}\n    steps {row['steps']}, with everything but K: "
            f"first step {row['first step']} s, "
            f"next {row['next step']} s, contact off {row['contact off']} s, "
            f"one closed state {row['one state']} s"
        )


if __name__ == "__main__":
    main()
