"""The parts of the stability campaign: each runs scenes of tests/ and returns its numbers.

A method that fails stands beside the one in use: multipliers of every node, condition numbers
without a basis, gradients without correction, order 1 near incompressibility.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

import xcrack as xc
from physics import (
    test_conditioning,
    test_contact_closed,
    test_contact_partial,
    test_contact_patch,
    test_degenerate_2d,
    test_degenerate_3d,
    test_inf_sup_2d,
    test_inf_sup_3d,
    test_patch_3d,
)
from support import scenes_2d as scenes
from support import scenes_3d as scenes_space
from support.scenes_stability import (
    BASES,
    ENRICHMENTS,
    arc_error,
    arc_length,
    beside_an_edge,
    cut_condition,
)
from xcrack.verification import methods
from xcrack.verification.exact import closed, fields_2d
from xcrack.verification.exact.potentials_2d import uniform_stress

Results = dict[str, Any]
EPS = (0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 0.0, -1e-12, -1e-6, -1e-2)
ROUND = 5  # digits that are stored


def short(value: Any) -> Any:
    """Numbers with a few digits, ready for JSON."""
    if isinstance(value, dict):
        return {str(k): short(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [short(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.{ROUND}g}") if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def tried(function: Callable[..., Any], *args: Any, **options: Any) -> Any:
    """The result, or None where an error of any kind says that there is none."""
    try:
        return function(*args, **options)
    except Exception:  # methods that are shown to fail may fail in any way
        return None


# Multipliers -----------------------------------------------------------------------------------


def infsup() -> Results:
    """Inf-sup constants over mesh sizes and cut positions, smallest over the drawn cracks."""
    plane, space = (8, 16, 32, 64), (4, 6, 8, 10)
    results: Results = {"h": {"plane": plane, "space": space}, "eps": EPS}
    for kind in ("reduced", "naive"):
        for order in (1, 2):
            results[f"plane, order {order}, {kind}"] = {
                "size": [
                    min(
                        xc.inf_sup(test_inf_sup_2d.through(n, *line, order, kind, seed))
                        for seed, line in enumerate(test_inf_sup_2d.LINES[:4], 11)
                    )
                    for n in plane
                ],
                "cut": [xc.inf_sup(test_inf_sup_2d.beside_a_row(e, order, kind)) for e in EPS],
            }
        s = test_inf_sup_3d
        results[f"space, {kind}"] = {
            "size": [min(xc.inf_sup(s.through(n, k, multipliers=kind)) for k in range(3))
                     for n in space],
            "cut": [xc.inf_sup(s.beside_a_layer(e, multipliers=kind)) for e in EPS],
        }  # fmt: skip
        results[f"space with a front, {kind}"] = {
            "size": [min(xc.inf_sup(s.penny(n, k, multipliers=kind)) for k in range(3))
                     for n in space],
            "cut": [xc.inf_sup(s.beside_a_layer(e, 0.07, multipliers=kind)) for e in EPS],
        }  # fmt: skip
    return short(results)


def pressure() -> Results:
    """Pressure along crack faces that bending presses together, exact pressure 1.2 - x; order 1."""
    angle, origin = 0.21, (0.05, -0.07)
    results: Results = {"sizes": (20, 40, 80)}
    for kind in ("naive", "reduced"):
        worst = []
        for n in results["sizes"]:
            problem, _ = scenes.centre_crack(
                lambda x, y: scenes.bending_cycle(x, y, -1.2), n, order=1, angle=angle,
                origin=origin, contact="on", numerics=xc.Numerics(multipliers=kind),
            )  # fmt: skip
            contact, x = test_contact_partial.lips(xc.solve(problem), angle, origin)
            inner = scenes.inner_part(contact.s)
            worst.append(np.abs(contact.pressure - (1.2 - x))[inner].max())
            if n == 40:
                order = np.argsort(x)
                results[f"x {kind}"], results[f"p {kind}"] = x[order], contact.pressure[order]
        results[f"largest error, {kind}"] = worst
    mean = test_contact_closed.mean_of_tips
    results["beside a tip, naive"] = [mean(n, 1, "naive")[3] for n in (10, 20, 40)]
    results["beside a tip, reduced"] = [mean(n, 1)[3] for n in (10, 20, 40)]
    return short(results)


# Condition -------------------------------------------------------------------------------------


def condition() -> Results:
    """Condition numbers over mesh size (orders 1 and 2) and cut position (order 2)."""
    sizes, eps = (10, 20, 40), (0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0)
    results: Results = {
        "sizes": sizes,
        "eps": eps,
        "over size": {},
        "over cut": {},
        "space over cut": {},
    }
    tip, angle = scenes.TIPS[0]
    for name, enrichment in ENRICHMENTS.items():
        for kind, basis in BASES.items():
            for order in (1, 2):
                results["over size"][f"{name}, {kind}, order {order}"] = [
                    tried(
                        scenes.condition,
                        scenes.williams_edge(
                            n,
                            tip,
                            angle,
                            order=order,
                            numerics=xc.Numerics(**enrichment, **basis),
                        )[0],
                    )
                    for n in sizes
                ]
            results["over cut"][f"{name}, {kind}"] = [
                tried(cut_condition, e, enrichment, basis) for e in eps
            ]
    for kind in ("none", "node", "star"):
        results["space over cut"][kind] = [
            tried(scenes.condition, test_degenerate_3d.front_problem(e, orthonormal=kind))
            for e in eps
        ]
    return short(results)


# Cuts and places -------------------------------------------------------------------------------


def slivers() -> Results:
    """Patch test and K for cuts down to 1e-14 of a cell, in 2D and 3D."""
    row = test_contact_patch
    results: Results = {"eps": EPS}

    def patch(eps: float, order: int, **options: object) -> float | None:
        mesh = xc.box((-1, -1), (1, 1), 10)
        crack = xc.line_crack([(-1.5, eps * row.CELL), (0.37, eps * row.CELL)])
        problem = scenes.on_box(
            mesh, [crack], row.uniform, traction=("left", "top"), order=order, contact="on",
            numerics=xc.Numerics(**options),
        )  # fmt: skip
        solution = tried(xc.solve, problem)
        if solution is None:
            return None
        return float(np.abs(solution.contact[0].pressure / row.P0 - 1).max())

    wanted = np.array([1.0, 0.6])

    def K(eps: float, order: int, kind: str) -> float | None:
        solved = tried(scenes.K_of, test_conditioning.beside_a_row(eps, order, kind))
        return None if solved is None else float(np.abs(solved[0] / wanted - 1).max())

    for order in (1, 2):
        results[f"pressure, order {order}"] = [patch(e, order) for e in EPS]
        results[f"pressure, order {order}, no correction"] = [
            patch(e, order, consistent=False) for e in EPS
        ]
        results[f"pressure, order {order}, naive"] = [
            patch(e, order, multipliers="naive") for e in EPS
        ]
        for kind in ("star", "none"):
            results[f"K, order {order}, {kind}"] = [K(e, order, kind) for e in EPS]
    s = test_patch_3d
    penny = [xc.penny_crack((0, 0, e * s.CELL), (0, 0, 1), 0.55) for e in EPS]
    results["pressure, space"] = [tried(s.patch, s.structured(), [c]) for c in penny]
    opened = np.array([test_degenerate_3d.opened(e)[1] for e in EPS])
    results["opening of a penny, space, over the median"] = opened / np.median(opened)
    return short(results)


def places() -> Results:
    """Tips on nodes, edges and faces, cracks along mesh lines: error and spread of K."""
    d = test_degenerate_2d
    results: Results = {"plane": {}, "space": {}}
    n, h = 20, 0.1
    options = {"geometric": {}, "topological": {"enrichment": "topological"}}
    for direction, angle in d.ANGLES.items():
        for order in (1, 2):
            for kind, numerics in options.items():
                K = []
                for base in d.BASES.values():
                    for eps in (0.0, 1e-12, -1e-9):
                        shift = h * (np.array(base) + np.array([eps, -eps]))
                        if direction == "along diagonals" and base[0] == base[1]:
                            shift = shift + np.array([h, 0.0])
                        problem = d.williams_on_shifted_mesh(n, shift, angle, order, **numerics)
                        K.append(scenes.K_of(problem)[0] / d.WANTED)
                results["plane"][f"{direction}, order {order}, {kind}"] = {
                    "scenes": len(K), "error": np.abs(np.array(K) - 1).max(),
                    "spread": np.ptp(K, axis=0).max(),
                }  # fmt: skip
    s = test_degenerate_3d
    for name, (x, z) in s.PLACES.items():
        problem = s.through_crack(8, x, z, scenes_space.SIX)
        results["space"][name] = s.opening_error(problem, x)
    return short(results)


# Shapes ----------------------------------------------------------------------------------------


def shapes() -> Results:
    """Kinks, tight arcs, arcs that turn back, tips beside a free edge."""
    d = test_degenerate_2d
    results: Results = {"kinks": {}, "arcs": {}, "free edge": {}}
    for degrees in (90, 120, -120):
        fine = np.array([scenes.K_of(d.kinked(degrees, 2, 60, r))[0] for r in (0.15, 0.3, 0.6)])
        size = np.linalg.norm(fine[0])
        for order in (1, 2):
            for n in (20, 30):
                coarse = scenes.K_of(d.kinked(degrees, order, n))[0]
                name = f"{degrees}°, order {order}, n {n}"
                results["kinks"][name] = np.abs(coarse - fine[0]).max() / size
        results["kinks"][f"{degrees}°, spread over domains at n 60"] = (
            np.ptp(fine, axis=0).max() / size
        )
    h = 2.4 / 30
    for cells in (1.5, 2.0, 3.0, 5.0):
        for degrees in (90, 180):
            for order in (1, 2):
                name = f"radius {cells:g} h, {degrees}°, order {order}"
                results["arcs"][name] = arc_error(cells * h, degrees, 30, order=order)
    for cells in (3.0, 1.6, 1.0, 0.6):
        coarse, fine = (beside_an_edge(cells, n, 2 / 30) for n in (30, 150))
        results["free edge"][f"{cells:g} h"] = {"K_I": coarse, "K_I at h / 5": fine,
                                              "error": coarse / fine - 1}  # fmt: skip
    return short(results)


def turned() -> Results:
    """A crack that has turned by up to 300°: the polyline's level sets and purely nodal ones.

    Share of the crack's length that the mesh sees, and the error of K, on an exact arc.
    """
    results: Results = {"degrees": (60, 90, 120, 150, 180, 200, 240, 300)}
    for update, level_sets in (("explicit", None), ("nodal", methods.nodal_level_sets())):
        numerics = xc.Numerics(radius=0.15, domain=0.25, level_sets=level_sets)
        for key, measure in (("length", arc_length), ("error of K", arc_error)):
            results[f"{key}, {update}"] = [
                tried(measure, 0.6, degrees, 40, pieces=48, numerics=numerics)
                for degrees in results["degrees"]
            ]
    return short(results)


def incompressible() -> Results:
    """Error of K as nu tends to 0.5: order 1 locks, order 2 does not."""
    results: Results = {"nu": (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999)}
    tip, angle = scenes.TIPS[0]
    for order, n in ((1, 40), (2, 20)):
        row = []
        for nu in results["nu"]:
            field = scenes.turned(
                lambda x, y, nu=nu: fields_2d.williams(x, y, 1.0, nu, 1.0, 0.6), tip, angle
            )
            problem = scenes.on_box(
                scenes.perturbed(n, 3), [scenes.edge_line(tip, angle)], field, traction=("left",),
                order=order, contact="off", nu=nu,
            )  # fmt: skip
            row.append(np.abs(scenes.K_of(problem)[0] / [1.0, 0.6] - 1).max())
        results[f"order {order}, n {n}"] = row
    return short(results)


# Contact that is hard to decide ----------------------------------------------------------------


def contact() -> Results:
    """Faces that only touch, closure points on nodes, both first sets, loads of round-off."""
    cases = {
        "neither pressed nor open": lambda x, y: closed.closed_crack(
            x, y, 1.0, 1.0, 0.3, syy=0.0, sxy=1.0),
        "touching at a tip": lambda x, y: closed.partial_closure(x, y, 1.0, 1.0, 0.3, 0.5, 1.0),
        "closure point on a node": lambda x, y: closed.partial_closure(
            x, y, 1.0, 1.0, 0.3, 0.0, 1.0),
        "closed at both tips": lambda x, y: closed.centre_open(x, y, 1.0, 1.0, 0.3, 1.0, 0.3),
        "pressure of 1e-14": lambda x, y: uniform_stress(
            x, y, -1e-14, -1e-14, 0.0, 1.0, 0.3),
        "tension of 1e-14": lambda x, y: uniform_stress(x, y, 1e-14, 1e-14, 0.0, 1.0, 0.3),
    }  # fmt: skip
    K_of_case: dict[str, list[list[float]]] = {
        "neither pressed nor open": [[0, -1.0], [0, 1.0]],
        "touching at a tip": [[0, 0], [1.0, 0]],
        "closure point on a node": [
            [0, 0], [closed.partial_closure_params(1.0, 0.0, 1.0)[2] / np.sqrt(np.pi), 0]],
        "closed at both tips": [[0, 0], [0, 0]],
    }  # fmt: skip
    results: Results = {}
    for name, field in cases.items():
        on_nodes = "node" in name
        where = {"amplitude": 0} if on_nodes else {"angle": 0.3, "origin": (0.02, 0.01)}
        for order in (1, 2):
            p, rounds, K = [], [], np.zeros((2, 2))
            for first in ("closed", "open"):
                problem, _ = scenes.centre_crack(
                    field, 48 if on_nodes else 30, order=order, contact="on",
                    numerics=xc.Numerics(initial_set=first), **where,
                )  # fmt: skip
                solution = xc.solve(problem)
                p.append(solution.contact[0].pressure)
                rounds.append(int(solution.report.operations["contact_iterations"]))
                K = xc.stress_intensity(solution).K_integral / np.sqrt(np.pi)
            size = max(float(np.abs(p).max()), 1e-14 if "1e-14" in name else 1e-3)
            results[f"{name}, order {order}"] = {
                "rounds from closed, open": rounds,
                "pressures differ by": np.abs(p[0] - p[1]).max() / size,
                "largest pressure": float(np.abs(p[0]).max()),
            } | ({"error of K": np.abs(K - K_of_case[name]).max()} if name in K_of_case else {})
    return short(results)


def anything() -> Results:
    """Cracks drawn without care: polylines that cross, leave and close in on each other."""
    solved, refused, failed = 0, 0, {}
    for seed in range(57000, 57200):
        mesh, cracks, loads, order = test_degenerate_2d.random_scene(seed)
        try:
            problem = xc.Problem(
                mesh, test_degenerate_2d.STEEL, [xc.line_crack(c) for c in cracks], loads=loads,
                order=order,
            )  # fmt: skip
            solution = xc.solve(problem)
            finite = all(
                np.isfinite(xc.stress_intensity(solution, c).K).all() for c in range(len(cracks))
            )
            if finite and np.abs(solution.u[: 2 * mesh.n_points]).max() < 1e3:
                solved += 1
            else:
                failed[seed] = "not finite, or out of proportion"
        except (xc.GeometryError, xc.ProblemError):
            refused += 1
        except Exception as error:  # nothing else should come out
            failed[seed] = f"{type(error).__name__}: {error}"
    return {"solved": solved, "refused with words": refused, "failed": failed}


PARTS = (
    infsup, pressure, condition, slivers, places, shapes, turned, incompressible, contact, anything,
)  # fmt: skip
