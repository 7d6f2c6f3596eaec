"""What each ingredient of a scene costs, and what the error becomes without it.

    python -m benchmarks.economy                        # every scene
    python -m benchmarks.economy penny "closed edge"    # some; the others keep their numbers

Every scene has an exact solution. Its variants take turns, each round on a mesh of its own; the
first round compiles and does not count. Times are processor times from the mesh to K (to the
solution where steps or states are compared), medians of three; errors are the largest of three.
Numbers go to benchmarks/results/economy.json, the table of all of them into docs/economy.md.
"""

import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import process_time

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "XCRACK_THREADS",
):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

import xcrack as xc  # noqa: E402
from benchmarks.runs import machine  # noqa: E402
from benchmarks.scenes.exact_fields import (  # noqa: E402
    edge_fields,
    penny,
    penny_K_I,
    penny_largest_K_II,
    penny_shear_K,
)
from benchmarks.scenes.material import STEEL  # noqa: E402
from benchmarks.scenes.settings import Settings, mesh_of  # noqa: E402
from xcrack.analysis.solve import solve_states  # noqa: E402
from xcrack.verification import methods  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "economy.json"
PAGE = ROOT / "docs" / "economy.md"

Errors = dict[str, float]
MeshOf = Callable[[int], xc.Mesh]  # of a seed
Part = tuple[str, bool, "Variant"]  # ingredient, is it in the default, the other variant


@dataclass(frozen=True, eq=False)
class Variant:
    """A scene and how: "reused" and "anew", a step after another; "apart", each state by itself."""

    mesh: MeshOf
    problem: Callable[[xc.Mesh, bool], xc.Problem]  # True: the shorter crack
    judge: Callable[[xc.Solution, xc.SIF], Errors]
    how: str = ""
    states: Sequence[float] = (1.0,)


def run(variant: Variant, seed: int) -> tuple[float, Errors, dict[str, int]]:
    """Processor seconds, worst errors and operations of one run."""
    body = variant.mesh(seed)
    reuse = None
    if variant.how in ("reused", "anew"):  # both from a mesh that has been used
        first = solve_states(variant.problem(body, True), variant.states)[0]
        reuse = first.reuse if variant.how == "reused" else None
    sets = [[s] for s in variant.states] if variant.how == "apart" else [list(variant.states)]
    start = process_time()
    problem = variant.problem(body, False)
    try:
        groups = [solve_states(problem, some, reuse=reuse) for some in sets]
    except xc.ConvergenceError:
        return process_time() - start, {}, {}
    solved = process_time()
    K = [xc.stress_intensities(solutions) for solutions in groups]
    seconds = (solved if variant.how else process_time()) - start
    errors = [variant.judge(u, k) for us, ks in zip(groups, K) for u, k in zip(us, ks)]
    report = groups[-1][0].report
    done = {k: report.operations[k] for k in ("multipliers", "integration_points")}
    kinds = [f"{kind} functions" for kind in ("standard", "Heaviside", "tip")]
    done["unknowns"] = sum(report[kind].unknowns for kind in kinds)
    return seconds, {k: float(max(e[k] for e in errors)) for k in errors[0]}, done


def pressed(solution: xc.Solution, p: float) -> Errors:
    """Relative error of a uniform pressure on the crack faces, where they have multipliers."""
    if (lips := solution.contact[0]) is None:
        return {}
    wrong = (lips.pressure / solution.factor / p - 1) ** 2
    return {"pressure": np.sqrt(lips.measure @ wrong / lips.measure.sum())}


def edge(
    n: int = 31, modes: tuple[float, float] = (1.0, 0.5), p: float = 0.0, *,
    mesh: MeshOf | None = None, order: int | None = None, contact: str = "auto", how: str = "",
    states: Sequence[float] = (1.0,), **numerics: object,
) -> Variant:  # fmt: skip
    """Edge crack in [-1, 1]² with its tip at 0, under K_I and K_II, and a pressure on its faces."""
    u, sigma = edge_fields(modes, p)

    def problem(body: xc.Mesh, shorter: bool) -> xc.Problem:
        return xc.Problem(
            body, STEEL[2], [xc.line_crack([(-1.3, 0.0), (-0.04 * shorter, 0.0)])],
            supports=[xc.displacement(s, lambda x: u(x)) for s in ("right", "bottom", "top")],
            loads=[xc.traction("left", lambda x, n: np.einsum("qij,qj->qi", sigma(x), n))],
            contact=contact, order=order, numerics=xc.Numerics(**numerics),
        )  # fmt: skip

    def judge(solution: xc.Solution, sif: xc.SIF) -> Errors:
        K = np.abs(sif.K_integral[0]) / solution.factor
        if not p:
            return {"K": np.abs(K / modes - 1).max()}
        off = abs(K - (0.0, modes[1])) / (modes[1] or 1.0)
        return {"K_II": off[1], "K_I": off[0], **pressed(solution, p)}

    moved = mesh or (lambda seed: mesh_of(Settings(n), 1.0, 2, seed))
    return Variant(moved, problem, judge, how, states)


def plate(near: float, far: float) -> MeshOf:
    """Triangles that are small around the tip, or of one size."""
    tip = [(-0.1, 0.0), (0.1, 0.0)]
    where: dict = {"lower": (-1.0, -1.0), "along": tip, "band": 0.15, "transition": 0.5}
    return lambda s: xc.plate(2, 2, size=far / (1 + s / 30), size_near=near / (1 + s / 30), **where)


def thin(seed: int) -> xc.Mesh:
    """The crack passes a row of nodes at 10⁻⁹ of a cell."""
    plain = mesh_of(Settings(30), 1.0, 2, seed)
    row = np.abs(xc.box((-1, -1), (1, 1), 30).points[:, 1]) < 1e-9
    x = np.where(row[:, None] & [False, True], 1e-9 / 15, plain.points)
    return xc.Mesh(x, plain.cells, plain.facet_sets)


def body(n: int = 11) -> Variant:
    """The edge crack in a cube of tetrahedra, two faces of which do not move along the front."""
    u, sigma = edge_fields((1.0, 0.5))

    def left(x: np.ndarray, n: np.ndarray) -> np.ndarray:
        return np.insert(np.einsum("qij,qj->qi", sigma(x[:, ::2]), n[:, ::2]), 1, 0.0, axis=1)

    def problem(mesh: xc.Mesh, shorter: bool) -> xc.Problem:
        crack = xc.plane_crack([(-1.3, -2, 0), (0, -2, 0), (0, 2, 0), (-1.3, 2, 0)])
        sides, loads = ("right", "bottom", "top"), [xc.traction("left", left)]
        supports = [
            xc.displacement(s, lambda x: np.insert(u(x[:, ::2]), 1, 0, axis=1)) for s in sides
        ]
        supports += [xc.fix("front", 1), xc.fix("back", 1)]
        return xc.Problem(mesh, STEEL[3], [crack], supports=supports, loads=loads, order=1)

    def judge(solution: xc.Solution, sif: xc.SIF) -> Errors:
        return {"K": np.abs(np.median(np.abs(sif.K[:, :2]), axis=0) / (1.0, 0.5) - 1).max()}

    return Variant(lambda seed: mesh_of(Settings(n), 1.0, 3, seed), problem, judge)


def disc(
    n: int = 8, tension: float = 1.0, shear: float = 0.0, *, contact: str = "auto", how: str = "",
    states: Sequence[float] = (1.0,), **numerics: object,
) -> Variant:  # fmt: skip
    """Penny of radius 0.5 in [-1, 1]³ under tension, or under pressure and shear."""
    u = penny(0.5, tension, shear)

    def problem(mesh: xc.Mesh, shorter: bool) -> xc.Problem:
        crack = xc.penny_crack((0, 0, 0), (0, 0, 1), 0.5 - 0.02 * shorter)
        return xc.Problem(
            mesh, STEEL[3], [crack], supports=[xc.displacement("boundary", lambda x: u(x))],
            contact=contact, numerics=xc.Numerics(**numerics), order=1,
        )  # fmt: skip

    def judge(solution: xc.Solution, sif: xc.SIF) -> Errors:
        K = sif.K_integral / solution.factor
        if tension > 0:
            wrong = K[:, 0] / penny_K_I(0.5, tension) - 1
            return {"mean K_I": abs(wrong.mean()), "K_I along front": np.sqrt((wrong**2).mean())}
        size = penny_largest_K_II(0.5, shear or 1.0)
        exact = penny_shear_K(0.5, shear, sif.frame)
        wrong = np.sqrt(((K[:, 1:] - exact) ** 2).sum(axis=1).mean()) / size
        errors = {"K_II, K_III": wrong, "K_I": np.abs(K[:, 0]).max() / size}
        return errors | pressed(solution, -tension)

    return Variant(lambda seed: mesh_of(Settings(n), 1.0, 3, seed), problem, judge, how, states)


# fmt: off
shut, fine, patch = (31, (0.0, 0.5), 1.0), (61, (0.0, 0.5), 1.0), (9, (0.0, 0.0), 1.0)
closed, even, three = (8, -1.0, 0.4), (8, -1.0, 0.0), (1.0, 2.0, 3.0)
SCENES: dict[str, tuple[Variant, list[Part]]] = {
    "edge crack": (edge(), [
        ("multipliers on open lips", False, edge(contact="on")),
        ("search for overlap", True, edge(contact="off")),
        ("tip functions beyond the tip's cell", True, edge(enrichment="topological")),
        ("tip functions: four, not two", True, edge(functions=2)),
        ("tip functions beside the modes", True, edge(tip_basis=methods.modal_basis())),
        ("corrected gradients", True, edge(consistent=False)),
        ("points a direction: 4, not 2", True, edge(points=2)),
        ("points a direction: 8, not 4", False, edge(points=8)),
        ("patch basis", False, edge(patch=True)),
    ]),
    "edge crack, free triangles": (edge(mesh=plate(0.05, 0.2)), [
        ("small cells far from the tip", False, edge(mesh=plate(0.05, 0.05))),
        ("small cells near the tip", True, edge(mesh=plate(0.2, 0.2))),
        ("small cells near it, as many unknowns", True, edge(mesh=plate(0.11, 0.11))),
    ]),
    "edge crack, order 1": (edge(11, order=1), [
        ("third direction", False, body()), ("order 2", False, edge(11)),
    ]),
    "closed edge": (edge(*shut), [
        ("multipliers on closed lips", True, edge(*shut, contact="off")),
        ("multipliers: reduced, not one a node", True, edge(*shut, multipliers="naive")),
        ("corrected gradients", True, edge(*shut, consistent=False)),
    ]),
    "closed edge 10⁻⁹ of a cell from nodes": (edge(*shut, mesh=thin), [
        ("star blocks", True, edge(*shut, mesh=thin, orthonormal="none")),
        ("star blocks, not blocks of nodes", True, edge(*shut, mesh=thin, orthonormal="node")),
    ]),
    "uniform pressure": (edge(*patch), [
        ("corrected gradients", True, edge(*patch, consistent=False))]),
    "closed edge, three states": (edge(*shut, how="together", states=three), [
        ("a factor for each state", False, edge(*shut, how="apart", states=three))]),
    "closed edge, next step": (edge(*fine, how="reused"), [
        ("kept stiffness and closed set", True, edge(*fine, how="anew"))]),
    "penny": (disc(), [
        ("multipliers on open lips", False, disc(contact="on")),
        ("search for overlap", True, disc(contact="off")),
        ("tip functions beyond the front's cells", True, disc(enrichment="topological")),
        ("tip functions beside the modes", True, disc(tip_basis=methods.modal_basis())),
        ("corrected gradients", True, disc(consistent=False)),
        ("points a direction: 4, not 2", True, disc(points=2)),
        ("points a direction: 6, not 4", False, disc(points=6)),
    ]),
    "penny, solver": (disc(11), [("factorisation", False, disc(11, linear="direct"))]),
    "closed penny": (disc(*closed), [
        ("multipliers on closed lips", True, disc(*closed, contact="off"))]),
    "penny, uniform pressure": (disc(*even), [
        ("corrected gradients", True, disc(*even, consistent=False))]),
    "penny, three states": (disc(11, how="together", states=three), [
        ("levels for each state", False, disc(11, how="apart", states=three))]),
    "penny, next step": (disc(14, how="reused"), [
        ("kept stiffness and levels", True, disc(14, how="anew"))]),
}
# fmt: on


def measure(scene: str, rounds: int = 3) -> dict[str, dict[str, object]]:
    """Median seconds, worst errors and counts of the default and of each other variant."""
    default, parts = SCENES[scene]
    variants = {"default": default} | {part: other for part, _, other in parts}
    results: dict[str, list] = {name: [] for name in variants}
    for seed in range(rounds + 1):
        for name, runs in results.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", xc.XcrackWarning)
                runs.append(run(variants[name], seed))
    rows = {}
    for name, runs in results.items():
        seconds, errors, counts = zip(*runs[1:])
        worst = {k: max(e[k] for e in errors) for k in errors[0]} if all(errors) else {}
        rows[name] = {"seconds": median(seconds), "errors": worst, **counts[-1]}
    return rows


def cells(row: dict) -> list[str]:
    """Unknowns, points and errors of a variant."""
    errors = [] if row["errors"] else ["no solution"]
    for name, x in row["errors"].items():
        digits, power = f"{x:.1e}".split("e")
        raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        errors.append(f"{name} {x:.2g}" if x >= 0.01 else f"{name} {digits}·10{raised}")
    multipliers = f" + {row['multipliers']}" if row.get("multipliers") else ""
    unknowns, points = row.get("unknowns", "–"), row.get("integration_points", "–")
    return [f"{unknowns}{multipliers}", str(points), "; ".join(errors)]


def table(scenes: dict) -> str:
    """A line an ingredient, with it before without it."""
    lines = ["| scene | ingredient | default | unknowns | points | time | share | error with "
             "| error without |", "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for scene in [s for s in SCENES if s in scenes]:
        rows = scenes[scene]["rows"]
        for part, has, _ in [p for p in SCENES[scene][1] if p[0] in rows]:
            default, other = rows["default"], rows[part]
            used, out = (default, other) if has else (other, default)
            one, two = cells(used), cells(out)
            counts = [a if a == b else f"{a} / {b}" for a, b in zip(one[:2], two[:2], strict=True)]
            share = round(100 * (1 - out["seconds"] / used["seconds"]))
            costs = f"{other['seconds'] / default['seconds']:.2f}", f"{share} %".replace("-", "−")
            columns = [scene, part, "used" if has else "left out", *counts,
                       *(costs if other["errors"] else "––"), one[2], two[2]]  # fmt: skip
            lines.append(f"| {' | '.join(columns)} |")
    return "\n".join(lines)


def main(scenes: Sequence[str], results: Path = RESULTS, page: Path = PAGE) -> None:
    """Measure these scenes, or all where none is named, then write file and page."""
    record = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}
    for scene in scenes or SCENES:
        record[scene] = {"machine": machine(), "rows": measure(scene)}
        results.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        before, start, rest = page.read_text(encoding="utf-8").partition("<!-- table -->\n")
        _, end, after = rest.partition("<!-- /table -->")
        page.write_text(f"{before}{start}{table(record)}\n{end}{after}", encoding="utf-8")
        print(scene, [f"{row['seconds']:.2f}" for row in record[scene]["rows"].values()])


if __name__ == "__main__":
    main(sys.argv[1:])
