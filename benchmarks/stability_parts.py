"""The parts of the stability campaign: each runs scenes of tests/ and returns its numbers.

A method that fails stands beside the one in use: multipliers of every node, condition numbers
without a basis, gradients without correction, order 1 near incompressibility.
"""

import numpy as np

import exact
import scenes
import scenes_space
import xcrack as xc
from physics import (
    test_conditioning,
    test_contact_closed,
    test_contact_partial,
    test_contact_patch,
    test_degenerate,
    test_infsup,
    test_space_degenerate,
    test_space_infsup,
    test_space_patch,
)
from scenes_stability import (
    BASES,
    ENRICHMENTS,
    arc_error,
    arc_length,
    beside_an_edge,
    cut_condition,
)
from xcrack.growth.criteria import kink_angle, max_hoop_stress, mean_reference, weighted_angle
from xcrack.scene.numerics import with_choices

EPS = (0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 0.0, -1e-12, -1e-6, -1e-2)
ROUND = 5  # digits that are kept


def short(value):
    """Numbers with a few digits, ready for JSON."""
    if isinstance(value, dict):
        return {str(k): short(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [short(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.{ROUND}g}") if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def tried(function, *args, **options):
    """The result, or None where an error of any kind says that there is none."""
    try:
        return function(*args, **options)
    except Exception:  # methods that are shown to fail may fail in any way
        return None


# Multipliers -----------------------------------------------------------------------------------


def infsup():
    """Inf-sup constants over mesh sizes and cut positions, smallest over the drawn cracks."""
    plane, space = (8, 16, 32, 64), (4, 6, 8, 10)
    found = {"h": {"plane": plane, "space": space}, "eps": EPS}
    for kind in ("reduced", "naive"):
        for order in (1, 2):
            found[f"plane, order {order}, {kind}"] = {
                "size": [
                    min(
                        xc.inf_sup(test_infsup.through(n, *line, order, kind, seed))
                        for seed, line in enumerate(test_infsup.LINES[:4], 11)
                    )
                    for n in plane
                ],
                "cut": [xc.inf_sup(test_infsup.beside_a_row(e, order, kind)) for e in EPS],
            }
        s = test_space_infsup
        found[f"space, {kind}"] = {
            "size": [min(xc.inf_sup(s.through(n, k, multipliers=kind)) for k in range(3))
                     for n in space],
            "cut": [xc.inf_sup(s.beside_a_layer(e, multipliers=kind)) for e in EPS],
        }  # fmt: skip
        found[f"space with a front, {kind}"] = {
            "size": [min(xc.inf_sup(s.penny(n, k, multipliers=kind)) for k in range(3))
                     for n in space],
            "cut": [xc.inf_sup(s.beside_a_layer(e, 0.07, multipliers=kind)) for e in EPS],
        }  # fmt: skip
    return short(found)


def pressure():
    """Pressure along lips that bending presses together, exact pressure 1.2 - x; order 1."""
    angle, origin = 0.21, (0.05, -0.07)
    found = {"sizes": (20, 40, 80)}
    for kind in ("naive", "reduced"):
        worst = []
        for n in found["sizes"]:
            problem, _ = scenes.centre_crack(
                lambda x, y: scenes.bending_cycle(x, y, -1.2), n, order=1, angle=angle,
                origin=origin, contact="on", numerics=xc.Numerics(multipliers=kind),
            )  # fmt: skip
            contact, x = test_contact_partial.lips(xc.solve(problem), angle, origin)
            inner = scenes.inner_part(contact.s)
            worst.append(np.abs(contact.pressure - (1.2 - x))[inner].max())
            if n == 40:
                order = np.argsort(x)
                found[f"x {kind}"], found[f"p {kind}"] = x[order], contact.pressure[order]
        found[f"largest error, {kind}"] = worst
    closed = test_contact_closed.mean_of_tips
    found["beside a tip, naive"] = [closed(n, 1, "naive")[3] for n in (10, 20, 40)]
    found["beside a tip, reduced"] = [closed(n, 1)[3] for n in (10, 20, 40)]
    return short(found)


# Condition -------------------------------------------------------------------------------------


def condition():
    """Condition numbers over mesh size (orders 1 and 2) and cut position (order 2)."""
    sizes, eps = (10, 20, 40), (0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0)
    found = {"sizes": sizes, "eps": eps, "over size": {}, "over cut": {}, "space over cut": {}}
    tip, angle = scenes.TIPS[0]
    for name, enrichment in ENRICHMENTS.items():
        for kind, basis in BASES.items():
            for order in (1, 2):
                found["over size"][f"{name}, {kind}, order {order}"] = [
                    tried(
                        scenes.condition,
                        scenes.williams_edge(
                            n,
                            tip,
                            angle,
                            order=order,
                            numerics=with_choices(xc.Numerics(), {**enrichment, **basis}),
                        )[0],
                    )
                    for n in sizes
                ]
            found["over cut"][f"{name}, {kind}"] = [
                tried(cut_condition, e, enrichment, basis) for e in eps
            ]
    for kind in ("none", "node", "star"):
        found["space over cut"][kind] = [
            tried(scenes.condition, test_space_degenerate.front_problem(e, orthonormal=kind))
            for e in eps
        ]
    return short(found)


# Cuts and places -------------------------------------------------------------------------------


def slivers():
    """Patch test and K for cuts down to 1e-14 of a cell, in the plane and in space."""
    row = test_contact_patch
    found = {"eps": EPS}

    def patch(eps, order, **options):
        mesh = xc.box((-1, -1), (1, 1), 10)
        crack = xc.line_crack([(-1.5, eps * row.CELL), (0.37, eps * row.CELL)])
        problem = scenes.on_box(
            mesh, [crack], row.uniform, traction=("left", "top"), order=order, contact="on",
            numerics=with_choices(xc.Numerics(), options),
        )  # fmt: skip
        solution = tried(xc.solve, problem)
        if solution is None:
            return None
        return float(np.abs(solution.contact[0].pressure / row.P0 - 1).max())

    wanted = np.array([1.0, 0.6])

    def K(eps, order, kind):
        found = tried(scenes.K_of, test_conditioning.beside_a_row(eps, order, kind))
        return None if found is None else float(np.abs(found[0] / wanted - 1).max())

    for order in (1, 2):
        found[f"pressure, order {order}"] = [patch(e, order) for e in EPS]
        found[f"pressure, order {order}, no correction"] = [
            patch(e, order, consistent=False) for e in EPS
        ]
        found[f"pressure, order {order}, naive"] = [
            patch(e, order, multipliers="naive") for e in EPS
        ]
        for kind in ("star", "none"):
            found[f"K, order {order}, {kind}"] = [K(e, order, kind) for e in EPS]
    s = test_space_patch
    penny = [xc.penny_crack((0, 0, e * s.CELL), (0, 0, 1), 0.55) for e in EPS]
    found["pressure, space"] = [tried(s.patch, s.structured(), [c]) for c in penny]
    opened = np.array([test_space_degenerate.opened(e)[1] for e in EPS])
    found["opening of a penny, space, over the median"] = opened / np.median(opened)
    return short(found)


def places():
    """Tips on nodes, edges and faces, cracks along mesh lines: error and spread of K."""
    d, found = test_degenerate, {"plane": {}, "space": {}}
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
                found["plane"][f"{direction}, order {order}, {kind}"] = {
                    "scenes": len(K), "error": np.abs(np.array(K) - 1).max(),
                    "spread": np.ptp(K, axis=0).max(),
                }  # fmt: skip
    s = test_space_degenerate
    for name, (x, z) in s.PLACES.items():
        problem = s.through_crack(8, x, z, scenes_space.SIX)
        found["space"][name] = s.opening_error(problem, x)
    return short(found)


# Shapes ----------------------------------------------------------------------------------------


def shapes():
    """Kinks, tight arcs, arcs that turn back, tips beside a free edge."""
    d, found = test_degenerate, {"kinks": {}, "arcs": {}, "free edge": {}}
    for degrees in (90, 120, -120):
        fine = np.array([scenes.K_of(d.kinked(degrees, 2, 60, r))[0] for r in (0.15, 0.3, 0.6)])
        size = np.linalg.norm(fine[0])
        for order in (1, 2):
            for n in (20, 30):
                coarse = scenes.K_of(d.kinked(degrees, order, n))[0]
                name = f"{degrees}°, order {order}, n {n}"
                found["kinks"][name] = np.abs(coarse - fine[0]).max() / size
        found["kinks"][f"{degrees}°, spread over domains at n 60"] = (
            np.ptp(fine, axis=0).max() / size
        )
    h = 2.4 / 30
    for cells in (1.5, 2.0, 3.0, 5.0):
        for degrees in (90, 180):
            for order in (1, 2):
                name = f"radius {cells:g} h, {degrees}°, order {order}"
                found["arcs"][name] = arc_error(cells * h, degrees, 30, order=order)
    for cells in (3.0, 1.6, 1.0, 0.6):
        coarse, fine = (beside_an_edge(cells, n, 2 / 30) for n in (30, 150))
        found["free edge"][f"{cells:g} h"] = {"K_I": coarse, "K_I at h / 5": fine,
                                              "error": coarse / fine - 1}  # fmt: skip
    return short(found)


def turned():
    """A crack that has turned by up to 300°: the polyline's level sets and purely nodal ones.

    Share of the crack's length that the mesh sees, and the error of K, on an exact arc.
    """
    found = {"degrees": (60, 90, 120, 150, 180, 200, 240, 300)}
    for update in ("explicit", "nodal"):
        if "update" in xc.Numerics.__dataclass_fields__:
            numerics = xc.Numerics(
                radius=0.15, domain=0.25, comparison=xc.Comparison(update=update)
            )
        elif update == "explicit":
            numerics = xc.Numerics(radius=0.15, domain=0.25)
        else:
            continue
        for key, measure in (("length", arc_length), ("error of K", arc_error)):
            found[f"{key}, {update}"] = [
                tried(measure, 0.6, degrees, 40, pieces=48, numerics=numerics)
                for degrees in found["degrees"]
            ]
    return short(found)


def incompressible():
    """Error of K as nu tends to 0.5: order 1 locks, order 2 does not."""
    found = {"nu": (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999)}
    tip, angle = scenes.TIPS[0]
    for order, n in ((1, 40), (2, 20)):
        row = []
        for nu in found["nu"]:
            field = scenes.turned(
                lambda x, y, nu=nu: exact.williams(x, y, 1.0, nu, 1.0, 0.6), tip, angle
            )
            problem = scenes.on_box(
                scenes.perturbed(n, 3), [scenes.edge_line(tip, angle)], field, traction=("left",),
                order=order, contact="off", nu=nu,
            )  # fmt: skip
            row.append(np.abs(scenes.K_of(problem)[0] / [1.0, 0.6] - 1).max())
        found[f"order {order}, n {n}"] = row
    return short(found)


# Contact that is hard to decide ----------------------------------------------------------------


def contact():
    """Lips that only touch, closure points on nodes, both first sets, loads of round-off."""
    cases = {
        "neither pressed nor open": lambda x, y: exact.closed_crack(
            x, y, 1.0, 1.0, 0.3, syy=0.0, sxy=1.0),
        "touching at a tip": lambda x, y: exact.partial_closure(x, y, 1.0, 1.0, 0.3, 0.5, 1.0),
        "closure point on a node": lambda x, y: exact.partial_closure(
            x, y, 1.0, 1.0, 0.3, 0.0, 1.0),
        "closed at both tips": lambda x, y: exact.centre_open(x, y, 1.0, 1.0, 0.3, 1.0, 0.3),
        "pressure of 1e-14": lambda x, y: exact.uniform_stress(
            x, y, -1e-14, -1e-14, 0.0, 1.0, 0.3),
        "tension of 1e-14": lambda x, y: exact.uniform_stress(x, y, 1e-14, 1e-14, 0.0, 1.0, 0.3),
    }  # fmt: skip
    K_of_case = {
        "neither pressed nor open": [[0, -1.0], [0, 1.0]],
        "touching at a tip": [[0, 0], [1.0, 0]],
        "closure point on a node": [
            [0, 0], [exact.partial_closure_params(1.0, 0.0, 1.0)[2] / np.sqrt(np.pi), 0]],
        "closed at both tips": [[0, 0], [0, 0]],
    }  # fmt: skip
    found = {}
    for name, field in cases.items():
        on_nodes = "node" in name
        where = {"amplitude": 0} if on_nodes else {"angle": 0.3, "origin": (0.02, 0.01)}
        for order in (1, 2):
            p, rounds, K = [], [], None
            for first in ("closed", "open"):
                problem, _ = scenes.centre_crack(
                    field, 48 if on_nodes else 30, order=order, contact="on",
                    numerics=xc.Numerics(initial_set=first), **where,
                )  # fmt: skip
                solution = xc.solve(problem)
                p.append(solution.contact[0].pressure)
                rounds.append(int(solution.report.operations["contact_iterations"]))
                K = np.array(xc.stress_intensity(solution).K) / np.sqrt(np.pi)
            size = max(float(np.abs(p).max()), 1e-14 if "1e-14" in name else 1e-3)
            found[f"{name}, order {order}"] = {
                "rounds from closed, open": rounds,
                "pressures differ by": np.abs(p[0] - p[1]).max() / size,
                "largest pressure": float(np.abs(p[0]).max()),
            } | ({"error of K": np.abs(K - K_of_case[name]).max()} if name in K_of_case else {})
    return short(found)


# Cycles ----------------------------------------------------------------------------------------

SEQUENCES = {
    "proportional, (0, 0) (1, .5)": [(0, 0), (1, 0.5)],
    "reversed shear, (1, .3) (1, -.3)": [(1, 0.3), (1, -0.3)],
    "fully reversed, (1, .5) (-1, -.5)": [(1, 0.5), (-1, -0.5)],
    "shear alone, reversed, (0, 1) (0, -1)": [(0, 1), (0, -1)],
    "non-proportional, (0, 0) (1, 0) (.6, .5)": [(0, 0), (1, 0), (0.6, 0.5)],
    "out of phase by 90°, 16 states": [
        (1 + np.cos(t), 0.8 * np.sin(t)) for t in 2 * np.pi * np.arange(16) / 16],
    "pure mode I, (0, 0) (1, 0)": [(0, 0), (1, 0)],
}  # fmt: skip


def printed_angle(K):
    """Equation 13 of the source paper as printed: a division by K_II, and no sign chosen."""
    K_I, K_II = K
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(K_I**2 + 8 * K_II**2)
        return [float(2 * np.degrees(np.arctan((K_I + s * root) / (4 * K_II)))) for s in (1, -1)]


def cycles():
    """Angles of the criteria, whatever the order of the states; K on the way there and back."""
    found = {}
    rng = np.random.default_rng(77131)
    for name, sequence in SEQUENCES.items():
        K = np.array(sequence, dtype=float)[:, None, :]
        row = {}
        for criterion in (max_hoop_stress, mean_reference, weighted_angle):
            angle, dK, R = criterion(K, 0.3)
            worst = 0.0
            for _ in range(20):
                other = criterion(K[rng.permutation(len(K))], 0.3)
                mirrored = criterion(K[rng.permutation(len(K))] * [1, -1], 0.3)
                worst = max(worst, abs(other[0][0] - angle[0]), abs(other[1][0] - dK[0]))
                worst = max(worst, abs(mirrored[1][0] - dK[0]))
            row[criterion.__name__] = {
                "degrees": np.degrees(angle[0]), "dK_eq": dK[0], "R": R[0],
                "shuffled, mirrored": worst,
            }  # fmt: skip
        component = mean_reference(K, 0.3, range="component")
        row["dK_eq by components"] = component[1][0]
        top = max(sequence, key=lambda k: np.hypot(*k))
        row["of the largest state"] = np.degrees(kink_angle(top))
        row["the same as printed in the paper, + and -"] = printed_angle(np.array(top, float))
        found[name] = row
    for order in (1, 2):
        problem, there = test_contact_partial.cycle_problem(20, order)
        solutions = xc.solve(problem, states=there + there[::-1])
        K = np.array([xc.stress_intensity(s).K for s in solutions])
        wanted = np.array([scenes.bending_K(s) for s in test_contact_partial.CYCLE])
        n = len(there)
        found[f"cycle with closure, order {order}"] = {
            "K there and back differ by": np.abs(K[:n] - K[n:][::-1]).max() / wanted.max(),
            "error of K_I": np.abs(K[:n, :, 0] - wanted).max() / wanted.max(),
        }
    return short(found)


def anything():
    """Cracks drawn without care: polylines that cross, leave and close in on each other."""
    solved, refused, failed = 0, 0, {}
    for seed in range(57000, 57200):
        mesh, cracks, loads, order = test_degenerate.random_scene(seed)
        try:
            problem = xc.Problem(
                mesh, test_degenerate.STEEL, [xc.line_crack(c) for c in cracks], loads=loads,
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


PARTS = {
    part.__name__: part
    for part in (infsup, pressure, condition, slivers, places, shapes, turned, incompressible,
                 contact, cycles, anything)
}  # fmt: skip
