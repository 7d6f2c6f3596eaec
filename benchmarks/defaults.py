"""What the defaults of order, radius and mesh cost and give, on scenes with exact K.

    python -m benchmarks.defaults                 # adapt, radius and order, in some minutes
    python -m benchmarks.defaults order           # one part; the others keep their numbers

The tables are those of docs/charts.md ("What follows for defaults"), the numbers go to
``benchmarks/results/defaults.json``. Times are processor seconds from the mesh to K on one thread;
in 2D errors are the largest and times the medians of three meshes whose inner points are moved.
"""

import json
import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

import xcrack as xc  # noqa: E402
from benchmarks.runs import machine  # noqa: E402
from benchmarks.scenes.exact_fields import edge_fields, penny, penny_K_I  # noqa: E402
from benchmarks.scenes.material import NU, STEEL, E  # noqa: E402
from benchmarks.scenes.settings import Settings, mesh_of  # noqa: E402
from xcrack.base.arrays import Floats  # noqa: E402
from xcrack.verification.exact import fields_2d  # noqa: E402

RESULT = Path(__file__).parent / "results" / "defaults.json"
FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "defaults.png"
Row = dict[str, Any]
Scene2d = Callable[[xc.Mesh], tuple[xc.Problem, Floats]]
SEEDS = (0, 1, 2)
TOLERANCES = (1e-2, 1e-3, 1e-4)
SIDES = (4, 6, 8, 11, 15, 21, 29, 41, 57, 81, 115, 161)  # cells of uniform meshes in 2D
RADII = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8)  # over the crack or what is free around its tip
DOMAINS = (0.45, 0.6, 0.75, 0.9)


def edge(mesh: xc.Mesh) -> tuple[xc.Problem, Floats]:
    """The edge crack of the charts, K_I = 1 and K_II = 0.5; a length of 1 is free at its tip."""
    modes = (1.0, 0.5)
    u, sigma = edge_fields(modes)
    problem = xc.Problem(
        mesh, STEEL[2], [xc.line_crack([(-1.3, 0.0), (0.0, 0.0)])],
        supports=[xc.displacement(s, lambda x: u(x)) for s in ("right", "bottom", "top")],
        loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
        contact="off",
    )  # fmt: skip
    return problem, np.abs(modes)


def inclined(a: float) -> Scene2d:
    """A crack of length 2 a at 30° in [-1, 1]², displacements of an infinite plate on all sides."""
    t = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    middle, Q = np.array([0.013, -0.007]), np.array([t, [-t[1], t[0]]])
    along, across, shear = t[1] ** 2, t[0] ** 2, t[0] * t[1]

    def u(x: Floats) -> Floats:
        y = (x - middle) @ Q.T
        return fields_2d.griffith(y[:, 0], y[:, 1], a, E, NU, along, across, shear)[0] @ Q

    def scene(mesh: xc.Mesh) -> tuple[xc.Problem, Floats]:
        crack = xc.line_crack([middle - a * t, middle + a * t])
        sides = ("left", "right", "bottom", "top")
        problem = xc.Problem(
            mesh, STEEL[2], [crack], contact="off",
            supports=[xc.displacement(s, lambda x: u(x)) for s in sides],
        )  # fmt: skip
        return problem, np.array([across, shear]) * np.sqrt(np.pi * a)

    return scene


def wrong(K: Floats, exact: Floats) -> float:
    """Largest error of a mode at a tip, over the largest K."""
    return float(np.abs(np.abs(K) - exact).max() / exact.max())


def uniform(scene: Scene2d, n: int, order: int, **method: Any) -> Row:
    """One setting on three meshes."""
    errors, seconds, unknowns = [], [], 0
    for seed in SEEDS:
        start = process_time()
        mesh = mesh_of(Settings(n), 1.0, 2, seed)
        problem, exact = scene(mesh)
        solution = xc.solve(replace(problem, order=order, numerics=xc.Numerics(**method)))
        sif = xc.stress_intensity(solution)
        seconds.append(process_time() - start)
        errors.append(wrong(sif.K, exact))
        unknowns = solution.n_dof
    return {"n": n, "unknowns": unknowns, "error": max(errors), "seconds": median(seconds)}


def adapted(scene: Scene2d, tolerance: float) -> Row:
    """All rounds of `adapt` from a coarse mesh; the error of the best K."""
    seconds, row = [], {}
    for _ in SEEDS:
        start = process_time()
        mesh = xc.box((-1.0, -1.0), (1.0, 1.0), 4)
        if scene is not edge:  # as the table was measured; a coarse one would do
            mesh = xc.refine(mesh, size=lambda x: 0.06 + 0.5 * np.linalg.norm(x, axis=1))
        problem, exact = scene(mesh)
        result = xc.adapt(problem, tolerance, progress=False)
        seconds.append(process_time() - start)
        row = {
            "tolerance": tolerance, "error": wrong(result.sif.best, exact),
            "error of K": wrong(result.sif.K, exact), "bar": result.rounds[-1].error,
            "met": result.met, "rounds": len(result.rounds),
            "unknowns": result.rounds[-1].unknowns,
        }  # fmt: skip
    return {**row, "seconds": median(seconds)}


def beside_uniform() -> list[Row]:
    """`adapt` beside the first uniform mesh from which on K is within the tolerance."""
    rows = []
    for name, scene in (("edge", edge), ("inclined, a = 0.05", inclined(0.05))):
        runs: list[Row] = []
        for n in SIDES:
            if n < 41 and scene is not edge:
                continue  # the crack would be shorter than a cell
            runs.append(uniform(scene, n, 2))
            if max(run["error"] for run in runs[-2:]) < TOLERANCES[-1] and len(runs) > 1:
                break
        for tolerance in TOLERANCES:
            late = [k for k, run in enumerate(runs) if run["error"] > tolerance]
            first = late[-1] + 1 if late else 0
            even = runs[first] if first < len(runs) else None
            row = {"scene": name, **adapted(scene, tolerance), "uniform": even}
            rows.append(row)
            other = "–" if even is None else f"{even['unknowns']} | {even['seconds']:.3f}"
            print(
                f"| {name} | {tolerance:g} | {row['error']:.1e} ({row['bar']:.1e}) | "
                f"{row['error of K']:.1e} | {row['rounds']} | {row['unknowns']} | "
                f"{row['seconds']:.3f} | {other} |",
                flush=True,
            )
    return rows


def radii() -> list[Row]:
    """Disc of tip functions and domain of K at two sizes of cells, order 2."""
    rows = []
    for name, scene, free, sides in (
        ("edge", edge, 1.0, (15, 41)),
        ("inclined, a = 0.2", inclined(0.2), 0.2, (31, 81)),
    ):
        settings: list[tuple[str, float | None]] = [("default", None)]
        settings += [("radius", r) for r in RADII] + [("domain", r) for r in DOMAINS]
        for kind, r in settings:
            method = {} if r is None else {kind: r * free}
            for n in sides:
                run = uniform(scene, n, 2, **method)
                rows.append({"scene": name, "setting": kind, "share": r, **run})
            last, fine = rows[-2:]
            print(
                f"| {name} | {kind} {r or ''} | {last['error']:.1e} ({last['unknowns']}, "
                f"{last['seconds']:.3f}) | {fine['error']:.1e} ({fine['unknowns']}, "
                f"{fine['seconds']:.3f}) |",
                flush=True,
            )
    return rows


def block(radius: float, normal: Floats, mesh: xc.Mesh) -> xc.Problem:
    """A penny under tension across it, displacements of infinite space on the sides of a cube."""
    across = np.cross(normal, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    Q = np.array([across, np.cross(normal, across), normal])
    u = penny(radius, 1.0)
    return xc.Problem(
        mesh, STEEL[3], [xc.penny_crack((0.0, 0.0, 0.0), normal, radius)], contact="off",
        supports=[xc.displacement("boundary", lambda x: u(x @ Q.T) @ Q)],
    )  # fmt: skip


def graded(radius: float, normal: Floats, cells: float, slope: float) -> xc.Mesh:
    """A cube with `cells` cells over the radius at the front, larger ones with the distance."""
    h = radius / cells

    def size(x: Floats) -> Floats:
        height = x @ normal
        flat = np.linalg.norm(x - height[:, None] * normal, axis=1)
        away = np.hypot(flat - radius, height)
        return np.sqrt(2) * (h + slope * np.maximum(away - 3 * h, 0.0))

    return xc.refine(xc.box((-1.0,) * 3, (1.0,) * 3, 4), size=size)


def orders() -> list[Row]:
    """Order 1 and 2 of pennies, on uniform and on graded meshes."""
    straight, tilted = np.array([0.0, 0.0, 1.0]), np.array([0.36, -0.48, 0.8])
    plans: list[tuple[str, float, Floats, str, int, tuple[float, ...]]] = [
        ("penny, R = 0.5", 0.5, straight, "uniform", 1, (8, 12, 16, 20, 26)),
        ("penny, R = 0.5", 0.5, straight, "uniform", 2, (6, 8, 10, 12)),
    ]
    for name, R, normal in (
        ("penny, R = 0.5", 0.5, straight), ("tilted penny, R = 0.1", 0.1, tilted),
    ):  # fmt: skip
        fine = (2.0, 3.0, 4.5, 6.5, 9.5)
        plans += [(name, R, normal, f"graded {slope}", 1, fine) for slope in (0.5, 0.25)]
        plans.append((name, R, normal, "graded 0.5", 2, (1.4, 2.0, 3.0)))
    for order in (1, 2):  # kernels are compiled
        small = replace(block(0.5, straight, graded(0.5, straight, 2.0, 0.5)), order=order)
        xc.stress_intensity(xc.solve(small))
    rows: list[Row] = []
    for name, R, normal, kind, order, finenesses in plans:
        for fineness in finenesses:
            start = process_time()
            if kind == "uniform":
                mesh = mesh_of(Settings(int(fineness)), 1.0, 3, 0)
            else:
                mesh = graded(R, normal, fineness, float(kind.split()[1]))
            meshed = process_time() - start
            if mesh.n_points * (1 if order == 1 else 7.5) > 35_000:
                continue  # above about a hundred thousand unknowns
            solution = xc.solve(replace(block(R, normal, mesh), order=order))
            sif = xc.stress_intensity(solution)
            seconds = process_time() - start
            away = sif.K_I / penny_K_I(R, 1.0) - 1
            row = {
                "scene": name, "mesh": kind, "order": order, "fineness": fineness,
                "unknowns": solution.n_dof, "mean": float(away.mean()),
                "rms": float(np.sqrt((away**2).mean())), "seconds": seconds, "mesh seconds": meshed,
            }  # fmt: skip
            rows.append(row)
            print(
                f"| {name} | {kind} | {order} | {fineness} | {row['unknowns']} | "
                f"{100 * row['mean']:+.2f} % | {100 * row['rms']:.2f} % | {seconds:.2f} |",
                flush=True,
            )
    return rows


def draw(rows: list[Row]) -> None:
    """Error along the front over processor time, a panel for each penny."""
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(row["scene"] for row in rows))
    figure, panels = plt.subplots(1, len(names), figsize=(9, 3.6), sharey=True)
    style = {"uniform": "C7", "graded 0.5": "C0", "graded 0.25": "C2"}
    for panel, name in zip(panels, names, strict=True):
        lines: dict[tuple[str, int], list[tuple[float, float]]] = {}
        for row in rows:
            if row["scene"] == name:
                points = lines.setdefault((row["mesh"], row["order"]), [])
                points.append((row["seconds"], row["rms"]))
        for (mesh, order), points in lines.items():
            solid = {1: "o--", 2: "s-"}[order]
            panel.loglog(*zip(*points), solid, c=style[mesh], label=f"order {order}, {mesh}")
        panel.set(title=name, xlabel="processor time, s")
        panel.set_xticks([0.3, 0.5, 1, 2, 3, 5], labels=["0.3", "0.5", "1", "2", "3", "5"])
        panel.minorticks_off()
        panel.grid(which="both", alpha=0.3)
    panels[0].set_yticks([1e-3, 2e-3, 5e-3, 1e-2, 2e-2], labels=["0.1", "0.2", "0.5", "1", "2"])
    panels[0].set_ylabel("error of K_I, root of the mean square, %")
    panels[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(FIGURE, dpi=120)
    plt.close(figure)


PARTS = {"adapt": beside_uniform, "radius": radii, "order": orders}


def main() -> None:
    """Print the tables, and store them part by part."""
    stored = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        uniform(edge, 6, 2)  # kernels are compiled
        for part in sys.argv[1:] or PARTS:
            stored[part] = PARTS[part]()
            stored["machine"] = machine()
            text = json.dumps(stored, indent=1, ensure_ascii=False)
            RESULT.write_text(text + "\n", encoding="utf-8")
            if part == "order":
                draw(stored[part])


if __name__ == "__main__":
    main()
