"""Paths and lives of some twenty growth runs, to prove what a change of the code did to them.

    python scripts/growth_scenes.py --save before.npz          # on the code before
    python scripts/growth_scenes.py --compare before.npz --tolerance 1e-10
    python scripts/growth_scenes.py --compare before.npz --only penny

Scenes use public names only, so that the same script runs on both. Differences are relative to the
largest value of the kind in the scene. One thread: sums in another order have other last bits.
`tests/growth/test_scenes.py` compares with `tests/data/growth_scenes.npz`.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[_name] = "1"

import numpy as np

import xcrack as xc

Results = dict[str, np.ndarray]
Run = tuple[xc.Problem, Any, dict[str, Any]]
SCENES: dict[str, Callable[[], Run]] = {}
MESHES = Path(__file__).resolve().parent.parent / "examples" / "meshes"
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
SOLID = xc.Isotropic(E=210e3, nu=0.3)
LAW = xc.elber(C=1.4e-11, m=2.9, a=0.5, b=0.4)
PARIS = xc.paris(C=1.4e-11, m=2.9)


def scene(function: Callable[[], Run]) -> Callable[[], Run]:
    """Register a function that returns a problem, a cycle and the options of a run."""
    SCENES[function.__name__] = function
    return function


def perturbed(lower: Any, upper: Any, n: Any, seed: int) -> xc.Mesh:
    """Box whose inner points are moved at random, so that no tie decides anything."""
    mesh = xc.box(lower, upper, n)
    lower, upper = np.asarray(lower), np.asarray(upper)
    h = ((upper - lower) / np.asarray(n)).min()
    moved = np.random.default_rng(seed).uniform(-0.15 * h, 0.15 * h, mesh.points.shape)
    inner = ((mesh.points - lower > 1e-9) & (upper - mesh.points > 1e-9)).all(axis=1)
    sets = {name: facets for name, facets in mesh.facet_sets.items() if name != "boundary"}
    return xc.Mesh(mesh.points + moved * inner[:, None], mesh.cells, sets)


def square(n: int, seed: int) -> xc.Mesh:
    return perturbed((-1.0, -1.0), (1.0, 1.0), (n, n), seed)


def cube(n: int, seed: int) -> xc.Mesh:
    return perturbed((-1.0,) * 3, (1.0,) * 3, (n,) * 3, seed)


def pull(dim: int, size: float = 100.0, shear: float = 0.0) -> list[Any]:
    up = (shear,) + (0.0,) * (dim - 2) + (size,)
    loads = [xc.traction("top", up), xc.traction("bottom", tuple(-v for v in up))]
    if shear:  # in 2D
        loads += [xc.traction("right", (0.0, shear)), xc.traction("left", (0.0, -shear))]
    return loads


def body(mesh: xc.Mesh, lines: Any, loads: Any, **options: Any) -> xc.Problem:
    cracks = [xc.line_crack(line) for line in lines]
    return xc.Problem(mesh, STEEL, cracks, loads=loads, **options)


def extruded(mesh: xc.Mesh, layers: Any) -> xc.Mesh:
    """Body over a plane mesh: each prism is divided by the numbers of its points."""
    m, z = mesh.n_points, np.asarray(layers, dtype=float)
    points = np.column_stack([np.tile(mesh.points, (len(z), 1)), np.repeat(z, m)])
    a, b, c = np.concatenate([np.sort(mesh.cells, axis=1) + k * m for k in range(len(z) - 1)]).T
    cells = [[a, b, c, c + m], [a, b, b + m, c + m], [a, a + m, b + m, c + m]]
    bare = xc.Mesh(points, np.concatenate([np.stack(x, 1) for x in cells]))
    facets = bare.boundary
    sets = {"front": facets[(points[facets][..., 2] == z[0]).all(axis=1)],
            "back": facets[(points[facets][..., 2] == z[-1]).all(axis=1)]}  # fmt: skip
    for name, edges in mesh.facet_sets.items():
        known = set(np.unique(edges).tolist())
        side = np.array([[v % m in known for v in facet] for facet in facets.tolist()])
        flat = np.ptp(points[facets][..., 2], axis=1) == 0
        if name != "boundary":
            sets[name] = facets[side.all(axis=1) & ~flat]
    return xc.Mesh(points, bare.cells, sets)


@scene
def edge_crack() -> Run:
    problem = body(square(22, 61), [[(-1.2, 0.013), (-0.1, 0.041)]], pull(2, shear=30.0))
    return problem, xc.Cycle(0.1, 1.0), {"da": 0.12, "max_steps": 5}


@scene
def edge_crack_euler() -> Run:
    problem, cycle, options = edge_crack()
    return problem, cycle, options | {"integrator": "euler", "max_steps": 3}


@scene
def two_cracks() -> Run:
    lines = [[(-1.2, 0.31), (-0.52, 0.29)], [(1.2, -0.27), (0.61, -0.31)]]
    return body(square(27, 65), lines, pull(2)), xc.Cycle(0.1, 1.0), {"da": 0.11, "max_steps": 5}


@scene
def steps_by_cycles() -> Run:
    problem, cycle, _ = two_cracks()
    return problem, cycle, {"cycles": 2e4, "da": 0.15, "max_steps": 4, "threshold": 80.0}


@scene
def turning_load_in_contact() -> Run:
    turned = [
        xc.traction("top", (60.0, -80.0)), xc.traction("bottom", (-60.0, 80.0)),
        xc.traction("right", (0.0, 60.0)), xc.traction("left", (0.0, -60.0)),
    ]  # fmt: skip
    problem = body(square(27, 66), [[(-0.3, 0.01), (0.31, 0.02)]], pull(2))
    options = {"da": 0.1, "max_steps": 4, "criterion": xc.weighted_angle}
    return problem, xc.Cycle(states=[pull(2), turned]), options


@scene
def link_up() -> Run:
    lines = [[(-0.71, 0.03), (-0.22, 0.04)], [(0.2, 0.05), (0.73, 0.02)]]
    return body(square(31, 71), lines, pull(2)), xc.Cycle(0.0, 1.0), {"da": 0.12, "max_steps": 6}


@scene
def tip_meets_flank() -> Run:
    lines = [[(-0.6, 0.03), (-0.12, 0.04)], [(0.11, -0.6), (0.13, 0.6)]]
    options = {"da": 0.12, "max_steps": 4}
    return body(square(31, 72), lines, pull(2)), xc.Cycle(0.0, 1.0), options


@scene
def one_tip_leaves() -> Run:
    lines = [[(0.35, 0.02), (0.71, 0.03)]]
    return body(square(25, 73), lines, pull(2)), xc.Cycle(0.0, 1.0), {"da": 0.14, "max_steps": 6}


@scene
def hole_with_kink() -> Run:
    mesh = xc.read_mesh(MESHES / "plate_with_hole_10.msh")  # radius 1, sides 8
    problem = body(mesh, [[(0.9, 0.02), (1.5, 0.02), (1.8, 0.17)]], pull(2))
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.15, "max_steps": 4}


@scene
def friction_repeated() -> Run:
    shear = [xc.traction("top", (60.0, -40.0)), xc.traction("bottom", (-60.0, 40.0)),
             xc.traction("right", (0.0, 60.0)), xc.traction("left", (0.0, -60.0))]  # fmt: skip
    problem = body(square(21, 74), [[(-0.4, 0.02), (0.41, 0.03)]], shear, friction=0.4)
    return problem, xc.Cycle(-1.0, 1.0), {"da": 0.12, "max_steps": 3}


@scene
def spectrum_with_contact() -> Run:
    problem = body(square(21, 75), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2, shear=20.0))
    sides = [xc.traction("right", (5.0, 0.0)), xc.traction("left", (-5.0, 0.0))]
    spectrum = xc.Spectrum([-0.6, 1.0, -0.2, 0.7, -0.6], steady=sides)
    return problem, spectrum, {"da": 0.12, "max_steps": 3, "law": PARIS}


@scene
def overloads_wheeler() -> Run:
    problem = body(square(21, 76), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2))
    spectrum = xc.Spectrum([*[0.0, 0.7] * 40, 0.0, 1.0], unit="block")
    model = xc.wheeler(1.4, xc.plastic_zone(600.0, beta=2))
    return problem, spectrum, {"da": 0.1, "max_steps": 4, "law": PARIS, "retardation": model}


@scene
def overloads_willenborg_two_tips() -> Run:
    problem = body(square(21, 77), [[(-0.31, 0.013), (0.3, 0.041)]], pull(2, shear=30.0))
    spectrum = xc.Spectrum([*[0.1, 0.7] * 30, 0.0, 1.0], unit="block")
    model = xc.willenborg(shutoff=2.7, dK_th=60.0, zone=xc.plastic_zone(600.0, beta=2))
    return problem, spectrum, {"da": 0.1, "max_steps": 3, "law": PARIS, "retardation": model}


@scene
def nominal_ratio() -> Run:
    problem = body(square(21, 78), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2))
    law = xc.walker(C=1.4e-11, m=2.9, gamma=0.6, ratio="nominal")
    return problem, xc.Cycle(-0.5, 1.0), {"da": 0.12, "max_steps": 3, "law": law}


@scene
def temperature() -> Run:
    loads = [*pull(2), xc.temperature(lambda x: 20.0 * x[:, 0] ** 2, alpha=1.2e-5)]
    problem = body(square(21, 79), [[(-1.2, 0.013), (-0.3, 0.041)]], loads)
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.12, "max_steps": 3}


@scene
def resultant_and_reactions() -> Run:
    loads = [xc.resultant("top", (20.0, 200.0), 15.0)]
    problem = body(square(21, 80), [[(-1.2, -0.213), (-0.3, -0.241)]], loads,
                   supports=[xc.fix("bottom")])  # fmt: skip
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.12, "max_steps": 3}


@scene
def pin_in_hole() -> Run:
    mesh = xc.read_mesh(MESHES / "plate_with_hole_10.msh")
    line = [(0.9, 0.02), (1.5, 0.02)]
    problem = body(mesh, [line], [xc.bearing("hole", (0.0, 4e3))], supports=[xc.fix("bottom")])
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.15, "max_steps": 3}


@scene
def imposed_displacements() -> Run:
    supports = [xc.fix("bottom"), xc.displacement("top", (0.0, 0.0))]
    states = [[xc.displacement("top", (0.0, 1e-4))], [xc.displacement("top", (2e-4, 1e-3))]]
    problem = body(square(21, 81), [[(-1.2, 0.013), (-0.3, 0.041)]], [], supports=supports)
    return problem, xc.Cycle(states=states), {"da": 0.12, "max_steps": 3}


@scene
def tolerance_2d() -> Run:
    problem = body(square(12, 82), [[(-1.2, 0.013), (-0.5, 0.041)]], pull(2, shear=30.0))
    return problem, xc.Cycle(0.0, 1.0), {"tolerance": 0.03, "max_steps": 5}


@scene
def slow_tip_waits() -> Run:
    lines = [[(-1.2, 0.33), (-0.32, 0.29)], [(1.2, -0.29), (0.78, -0.31)]]
    return body(square(23, 84), lines, pull(2)), xc.Cycle(0.0, 1.0), {"da": 0.08, "max_steps": 6}


@scene
def spectrum_of_states() -> Run:
    turned = pull(2, size=40.0, shear=30.0)
    spectrum = xc.Spectrum(states=[0.0, pull(2, size=90.0), turned], sequence=[0, 1, 2, 1, 0])
    problem = body(square(21, 85), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2))
    return problem, spectrum, {"da": 0.12, "max_steps": 3, "law": PARIS}


@scene
def overloads_one_tip_leaves() -> Run:
    problem = body(square(25, 86), [[(0.31, 0.02), (0.71, 0.03)]], pull(2))
    spectrum = xc.Spectrum([*[0.1, 0.7] * 30, 0.0, 1.0], unit="block")
    model = xc.wheeler(1.4, xc.plastic_zone(600.0, beta=2))
    return problem, spectrum, {"da": 0.14, "max_steps": 6, "law": PARIS, "retardation": model}


@scene
def toughness_of_the_law() -> Run:
    problem = body(square(21, 87), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2))
    return problem, xc.Cycle(0.1, 1.0), {"da": 0.1, "law": xc.forman(C=1e-9, m=2.5, K_c=420.0)}


@scene
def toughness_of_the_material() -> Run:
    problem = body(square(21, 88), [[(-1.2, 0.013), (-0.3, 0.041)]], pull(2))
    return problem, xc.Cycle(0.1, 1.0), {"da": 0.1, "K_c": 430.0}


@scene
def falls_below_the_threshold() -> Run:
    supports = [xc.fix("bottom"), xc.displacement("top", (0.0, 0.0))]
    states = [[xc.displacement("top", (0.0, 0.0))], [xc.displacement("top", (0.0, 1e-3))]]
    problem = body(square(21, 89), [[(-1.2, 0.013), (-0.3, 0.041)]], [], supports=supports)
    options = {"da": 0.25, "max_steps": 9, "threshold": 108.0}
    return problem, xc.Cycle(states=states), options


@scene
def plastic_zones_meet() -> Run:
    problem, cycle, options = link_up()
    return problem, cycle, options | {"link_up": xc.plastic_zone(190.0, beta=2)}


@scene
def given_cycles() -> Run:
    problem = body(square(21, 90), [[(-1.2, 0.013), (-0.4, 0.041)]], pull(2, shear=20.0))
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.2, "cycles": 900.0, "max_cycles": 3100.0}


@scene
def tolerance_as_a_tip_leaves() -> Run:
    problem = body(square(14, 91), [[(0.15, 0.02), (0.72, 0.03)]], pull(2))
    return problem, xc.Cycle(0.0, 1.0), {"tolerance": 0.1, "max_steps": 7}


@scene
def K_from_a_formula() -> Run:
    def response(problem: xc.Problem, states: Any, reuse: Any, bars: bool) -> xc.Response:
        del reuse, bars
        x = problem.stations.x
        K = np.stack([300.0 + 60.0 * x[:, 0], 20.0 - 70.0 * x[:, 1]], axis=1)
        return xc.Response.of_K(problem, states, np.stack([float(f) * K for f in states]))

    problem = body(square(21, 92), [[(-0.4, 0.02), (0.41, 0.03)]], [])
    return problem, xc.Cycle(0.1, 1.0), {"da": 0.14, "max_steps": 5, "response": response}


@scene
def penny() -> Run:
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    problem = xc.Problem(cube(9, 67), SOLID, [crack], loads=pull(3), order=1)
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.25, "max_steps": 3}


@scene
def penny_order_2() -> Run:
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.4)
    problem = xc.Problem(cube(7, 67), SOLID, [crack], loads=pull(3), order=2)
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.12, "max_steps": 3}


@scene
def surface_crack_leaves() -> Run:
    crack = xc.elliptic_crack((0.02, -1.0, 0.04), (0.0, 0.1, 1.0), (1.0, 0.0, 0.0), 0.6, 0.7)
    problem = xc.Problem(cube(9, 69), SOLID, [crack], loads=pull(3), order=1)
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.4, "max_steps": 4}


@scene
def corner_crack_at_hole() -> Run:
    mesh = extruded(xc.read_mesh(MESHES / "plate_with_hole_05.msh"), np.linspace(0.0, 1.0, 7))
    crack = xc.elliptic_crack((1.0, 0.021, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), 0.5, 0.5)
    loads = [xc.traction("top", (0.0, 100.0, 0.0)), xc.traction("bottom", (0.0, -100.0, 0.0))]
    problem = xc.Problem(mesh, SOLID, [crack], loads=loads, order=1)
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.17, "max_steps": 3}


@scene
def pennies_join() -> Run:
    mesh = perturbed((-2.0, -1.0, -0.8), (2.0, 1.0, 0.8), (24, 12, 10), 83)
    cracks = [xc.penny_crack((x, 0.013, 0.0117), (0, 0, 1), 0.5, n=48) for x in (-0.66, 0.66)]
    problem = xc.Problem(mesh, SOLID, cracks, loads=pull(3), order=1, contact="off")
    return problem, xc.Cycle(0.0, 1.0), {"da": 0.17, "max_steps": 4}


@scene
def overloads_along_front() -> Run:
    problem, _, _ = penny()
    spectrum = xc.Spectrum([*[0.0, 0.7] * 30, 0.0, 1.0], unit="block")
    model = xc.wheeler(1.4, xc.plastic_zone(600.0, beta=2))
    return problem, spectrum, {"da": 0.25, "max_steps": 3, "law": PARIS, "retardation": model}


@scene
def surface_crack_in_contact() -> Run:
    crack = xc.elliptic_crack((0.02, -1.0, 0.04), (0.0, 0.1, 1.0), (1.0, 0.0, 0.0), 0.5, 0.6)
    bend = [
        xc.traction(side, lambda x, s=s: s * np.stack(
            [0 * x[:, 0], 0 * x[:, 0], 20 + 100 * x[:, 0]], axis=1))
        for side, s in (("top", 1.0), ("bottom", -1.0))
    ]  # fmt: skip
    problem = xc.Problem(cube(9, 70), SOLID, [crack], loads=bend, order=1)
    return problem, xc.Cycle(-1.0, 1.0), {"da": 0.25, "max_steps": 3}


@scene
def penny_euler() -> Run:
    problem, cycle, options = penny()
    return problem, cycle, options | {"integrator": "euler"}


@scene
def penny_by_cycles() -> Run:
    problem, cycle, _ = penny()
    return problem, cycle, {"da": 0.3, "cycles": 1.1e5, "max_steps": 3}


def results_of(steps: Any) -> Results:
    """Numbers of all steps: N, K, directions, rates, advances, cracks and joins."""
    result: Results = {}
    history = xc.collect(steps)
    for step in history.steps:
        key = f"{step.index:02d}"
        result[f"N/{key}"] = np.array(step.cycles)
        for c, crack in enumerate(step.corrected):
            result[f"x/{key}/points/{c}"] = crack.points
            for s, state in enumerate(step.sif):
                result[f"K/{key}/{c}/{s}"] = state[c].K
        for name in ("angle", "dK_eq", "R", "rate", "da"):
            for c, values in enumerate(getattr(step, name)):
                result[f"{name}/{key}/{c}"] = values
    for k, join in enumerate(history.joins):
        result[f"N/join/{k}"] = np.array(join.N)
        result[f"x/join/{k}"] = np.array(join.point)
    result["ended"] = np.array(history.ended.split(":")[0])
    return result


def run_of(name: str) -> Results:
    """Grow one scene."""
    problem, cycle, options = SCENES[name]()
    law = options.pop("law", LAW)
    criterion = options.pop("criterion", xc.max_hoop_stress)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return results_of(xc.grow(problem, law, criterion, cycle, progress=False, **options))


def differences(before: Results, after: Results) -> dict[str, float]:
    """Largest difference of each kind of number over its largest value; inf for other shapes."""
    kinds = sorted({key.partition("/")[0] for key in before})
    result = {}
    for kind in kinds:
        keys = {key for key in before if key.partition("/")[0] == kind}
        if kind == "ended":
            result[kind] = 0.0 if str(before[kind]) == str(after[kind]) else np.inf
            continue
        if keys != {key for key in after if key.partition("/")[0] == kind}:
            result[kind] = np.inf
            continue
        finite = [np.abs(v[np.isfinite(v)]).max(initial=0.0) for v in (before[k] for k in keys)]
        scale = 1.0 if kind in ("angle", "R") else max(finite, default=0.0) or 1.0
        result[kind] = max(_apart(before[key], after[key]) for key in keys) / scale
    return result


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    if one.shape != other.shape:
        return np.inf
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    return float(np.abs(np.where(same, 0.0, one - other)).max(initial=0.0))


def main() -> int:
    """Grow all scenes, and save or compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--compare", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.0)
    parser.add_argument("--only", default="", help="part of the name of a scene")
    options = parser.parse_args()
    stored = dict(np.load(options.compare)) if options.compare else {}
    results: Results = {}
    worst = 0.0
    for name in SCENES:
        if options.only not in name:
            continue
        start = time.perf_counter()
        result = run_of(name)
        results |= {f"{name}/{key}": value for key, value in result.items()}
        line = f"{name:32} {len(result):4d} arrays {time.perf_counter() - start:6.1f} s"
        if options.compare:
            before = {k[len(name) + 1 :]: v for k, v in stored.items() if k.startswith(f"{name}/")}
            apart = differences(before, result)
            worst = max(worst, *apart.values())
            line += "   " + " ".join(f"{kind} {v:.1e}" for kind, v in apart.items() if v)
        print(f"{line}   N = {[float(v) for k, v in result.items() if k.startswith('N/')][-1]:.6g}"
              f" {result['ended']}", flush=True)  # fmt: skip
    if options.save:
        np.savez_compressed(options.save, **results)  # type: ignore[arg-type]
    if options.compare:
        print(f"largest difference {worst:.2g}, allowed {options.tolerance:.2g}")
    return int(worst > options.tolerance)


if __name__ == "__main__":
    sys.exit(main())
