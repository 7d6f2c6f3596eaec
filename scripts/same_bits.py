"""Results of ten scenes, to prove that a change of the code changed none of them.

    python scripts/same_bits.py --save before.npz          # on the code before
    python scripts/same_bits.py --compare before.npz       # on the code after: bit for bit
    python scripts/same_bits.py --compare before.npz --tolerance 1e-12

Scenes use public names only, so that the same script runs on both. Differences are relative to the
largest value of the kind in the scene. One thread: sums in another order have other last bits.
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

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402

import xcrack as xc  # noqa: E402

Results = dict[str, Any]
SCENES: dict[str, Callable[[], Results]] = {}
LAW = xc.elber(C=1.4e-11, m=2.9, a=0.5, b=0.4)


def scene(function: Callable[[], Results]) -> Callable[[], Results]:
    SCENES[function.__name__] = function
    return function


def pull(dim: int, size: float = 100.0) -> list[Any]:
    up = (0.0,) * (dim - 1) + (size,)
    return [xc.traction("top", up), xc.traction("bottom", tuple(-v for v in up))]


def perturbed(dim: int, n: int, seed: int) -> xc.Mesh:
    """Box whose inner points are moved at random, so that no tie decides anything."""
    mesh = xc.box((-1.0,) * dim, (1.0,) * dim, n)
    moved = np.random.default_rng(seed).uniform(-0.15 / n, 0.15 / n, mesh.points.shape)
    inner = (np.abs(np.abs(mesh.points) - 1.0) > 1e-12).all(axis=1)
    sets = {name: facets for name, facets in mesh.facet_sets.items() if name != "boundary"}
    return xc.Mesh(mesh.points + moved * inner[:, None], mesh.cells, sets)


def steel(dim: int) -> xc.Isotropic:
    return xc.Isotropic(E=210e3, nu=0.3, plane="strain" if dim == 2 else None)


def of(solutions: list[Any], crack: int = 0) -> Results:
    """Displacements, energy, K and pressures of load states."""
    results: Results = {}
    for k, solution in enumerate(solutions):
        sif = xc.stress_intensity(solution, crack)
        results[f"u_{k}"], results[f"K_{k}"] = np.array(solution.u), np.array(sif.K)
        results[f"spread_{k}"], results[f"T_{k}"] = np.array(sif.spread), np.array(sif.T)
        results[f"energy_{k}"] = np.array(solution.energy)
        contact = solution.contact[crack]
        if contact is not None:
            results[f"pressure_{k}"] = np.array(contact.pressure)
            results[f"closed_{k}"] = np.array(contact.closed)
    return results


def of_run(history: xc.History) -> Results:
    table = history.table()
    names = table.dtype.names or ()
    results = {name: np.array(table[name]) for name in names}
    results |= {f"points_{c}": np.array(crack.points) for c, crack in enumerate(history.cracks)}
    results["life"] = np.array(history.life)
    return results


@scene
def edge_crack_open() -> Results:
    crack = xc.line_crack([(-1.2, 0.013), (-0.1, 0.041)])
    return of([xc.solve(xc.Problem(perturbed(2, 22, 61), steel(2), [crack], loads=pull(2)))])


@scene
def inner_crack_order_1() -> Results:
    crack = xc.line_crack([(-0.43, -0.11), (0.02, 0.03), (0.37, 0.28)])
    problem = xc.Problem(perturbed(2, 31, 62), steel(2), [crack], loads=pull(2), order=1)
    return of([xc.solve(problem)])


@scene
def kinked_crack_closed() -> Results:
    crack = xc.line_crack([(-0.5, 0.05), (0.1, 0.02), (0.4, -0.2)])
    push = [xc.traction("top", (30.0, -100.0)), xc.traction("bottom", (-30.0, 100.0))]
    sides = [xc.traction("right", (0.0, 30.0)), xc.traction("left", (0.0, -30.0))]
    problem = xc.Problem(perturbed(2, 24, 63), steel(2), [crack], loads=push + sides)
    return of(xc.solve(problem, states=[1.0, -1.0, 0.5]))


@scene
def half_closed_crack() -> Results:
    crack = xc.line_crack([(-0.6, 0.011), (0.6, 0.011)])
    bend = [
        xc.traction(side, lambda x, s=s: np.stack([0 * x[:, 0], s * (10 + 100 * x[:, 0])], axis=1))
        for side, s in (("top", 1.0), ("bottom", -1.0))
    ]
    problem = xc.Problem(perturbed(2, 31, 64), steel(2), [crack], loads=bend)
    return of([xc.solve(problem)])


@scene
def two_cracks_grow() -> Results:
    cracks = [
        xc.line_crack([(-1.2, 0.31), (-0.52, 0.29)]),
        xc.line_crack([(1.2, -0.27), (0.61, -0.31)]),
    ]
    problem = xc.Problem(perturbed(2, 27, 65), steel(2), cracks, loads=pull(2))
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.1, 1.0), 0.11, max_steps=4)
    return of_run(xc.collect(steps))


@scene
def turning_load_grows_in_contact() -> Results:
    crack = xc.line_crack([(-0.3, 0.01), (0.31, 0.02)])
    turned = [
        xc.traction("top", (60.0, -80.0)), xc.traction("bottom", (-60.0, 80.0)),
        xc.traction("right", (0.0, 60.0)), xc.traction("left", (0.0, -60.0)),
    ]  # fmt: skip
    problem = xc.Problem(perturbed(2, 27, 66), steel(2), [crack], loads=pull(2))
    cycle = xc.Cycle(states=[pull(2), turned])
    steps = xc.grow(problem, LAW, xc.weighted_angle, cycle, 0.1, max_steps=3)
    return of_run(xc.collect(steps))


@scene
def penny_open() -> Results:
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    problem = xc.Problem(perturbed(3, 8, 67), steel(3), [crack], loads=pull(3), order=1)
    return of([xc.solve(problem)])


@scene
def penny_order_2() -> Results:
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5)
    problem = xc.Problem(perturbed(3, 6, 68), steel(3), [crack], loads=pull(3), order=2)
    return of([xc.solve(problem)])


@scene
def surface_crack_closed_by_iterations() -> Results:
    crack = xc.elliptic_crack((0.02, -1.0, 0.04), (0.0, 0.1, 1.0), (1.0, 0.0, 0.0), 0.5, 0.6)
    bend = [
        xc.traction(side, lambda x, s=s: s * np.stack(
            [0 * x[:, 0], 0 * x[:, 0], 20 + 100 * x[:, 0]], axis=1))
        for side, s in (("top", 1.0), ("bottom", -1.0))
    ]  # fmt: skip
    problem = xc.Problem(perturbed(3, 12, 69), steel(3), [crack], loads=bend, order=1)
    return of(xc.solve(problem, states=[1.0, -1.0]))


@scene
def edge_front_grows() -> Results:
    crack = xc.plane_crack([(-1.5, -1.5, 0.03), (-0.2, -1.5, 0.03), (-0.2, 1.5, 0.03),
                            (-1.5, 1.5, 0.03)])  # fmt: skip
    problem = xc.Problem(perturbed(3, 9, 70), steel(3), [crack], loads=pull(3), order=1)
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.1, 1.0), 0.25, max_steps=3)
    return of_run(xc.collect(steps))


def difference(before: np.ndarray, after: np.ndarray, scale: float) -> float:
    """Largest difference over a scale; 0 for equal bits, inf for another shape."""
    if before.shape != after.shape or before.dtype != after.dtype:
        return np.inf
    if before.tobytes() == after.tobytes():
        return 0.0
    one, other = before.astype(float), after.astype(float)
    if not np.array_equal(np.isnan(one), np.isnan(other)):
        return np.inf
    return float(np.nanmax(np.abs(one - other), initial=0.0) / scale)


def scale_of(key: str, values: Results) -> float:
    """Largest value of the kind: K and spread share it over all modes and states of a scene."""
    scene_name, _, name = key.partition("/")
    kind = name.partition("_")[0]
    if kind in ("angle", "R"):
        return 1.0
    kinds = ("K", "spread", "dK") if kind in ("K", "spread", "dK") else (kind,)
    like = [
        np.abs(v.astype(float)) for k, v in values.items()
        if k.startswith(f"{scene_name}/") and k.partition("/")[2].partition("_")[0] in kinds
    ]  # fmt: skip
    return float(max(np.nanmax(v, initial=0.0) for v in like)) or 1.0


def main() -> int:
    """Compute, and save or compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--compare", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.0)
    parser.add_argument("--only", default="", help="part of the name of a scene")
    options = parser.parse_args()
    stored = dict(np.load(options.compare)) if options.compare else {}
    results: Results = {}
    worst = 0.0
    for name, run in SCENES.items():
        if options.only not in name:
            continue
        start = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            result = {f"{name}/{key}": np.asarray(value) for key, value in run().items()}
        results |= result
        line = f"{name:36} {len(result):4d} arrays {time.perf_counter() - start:6.1f} s"
        if stored:
            expected = {key for key in stored if key.startswith(f"{name}/")}
            apart = {
                k: difference(stored[k], result[k], scale_of(k, stored))
                for k in expected & set(result)
            }
            apart |= {k: np.inf for k in expected - set(result)}
            largest = max(apart, key=lambda k: apart[k])
            worst = max(worst, apart[largest])
            line += (
                f"   {'same bits' if apart[largest] == 0 else f'{apart[largest]:.1e} {largest}'}"
            )
            new = set(result) - expected  # columns that there were not before
            line += f"   ({len(new)} new arrays)" if new else ""
        print(line, flush=True)
    if options.save:
        np.savez(options.save, **results)
    if stored:
        print(f"largest difference {worst:.2g}, allowed {options.tolerance:.2g}")
    return int(worst > options.tolerance)


if __name__ == "__main__":
    sys.exit(main())
