"""Ten thousand drawn cracks: a seed is a scene at the defaults, and what became of it is a row.

Bodies, places and loads are drawn where methods are known to break: cuts through mesh points and
along edges, tips on them, junctions, faces that press, rub or open in part, kinks, holes, sides and
other tips that are near, two materials. No exact field is imposed: K of two much finer meshes of
order 2 that agree is the truth, on every fifth scene.
"""

import json
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import xcrack as xc
from support import scenes_2d as scenes
from support import scenes_3d as scenes_space

AGREE = 0.2  # largest difference of the two references, as a share of the bar
AGREE_K = 5e-3  # and of the largest K, where there is no bar
TRUTH_EVERY = 5
# Finest cells of the references, over the size of the body, and the share by which cells grow away.
FINE = {2: (1 / 60, 1 / 160), 3: (0.4, 0.27)}  # in 3D over the cell size
_GROWS = 0.2
_WIDEST = {2: (0.14, 0.09)}
_LEAST = 1e-6  # of the largest K: what nobody can tell apart


@dataclass(frozen=True)
class Scene:
    """A problem, its name, and the points that references need small cells at, beside tips.

    In the plane also the stress (2, 2) that pulls at its sides.
    """

    kind: str
    problem: xc.Problem
    special: np.ndarray
    stress: np.ndarray | None = None


def far_stress(rng, dim):
    """A stress of drawn size, pulling, pressing or shearing, as tractions that balance."""
    S = rng.uniform(-1.0, 1.0, (dim, dim))
    S = (S + S.T) / 2
    if rng.random() < 0.5:
        S += np.eye(dim) * rng.uniform(0.0, 1.0)  # half of them are open for the most part
    return S


def loads_of(S, sides):
    return [xc.traction(side, lambda x, normal: normal @ S) for side in sides]


def gap(rng, size, least=0.5, most=8.0):
    """A distance from half a cell to eight."""
    return size * np.exp(rng.uniform(np.log(least), np.log(most)))


# In the plane -----------------------------------------------------------------------------------


def mesh_of_plane(rng, n):
    """Triangles of [-1, 1]², half of them with moved inner points."""
    seed, amplitude = int(rng.integers(1 << 30)), rng.uniform(0.0, 0.2)
    return scenes.perturbed(n, seed, amplitude if rng.random() < 0.5 else 0.0)


def _direction(rng):
    return scenes.rows(rng.uniform(-np.pi, np.pi))[0]


def inner(rng, mesh, h):
    a, middle = rng.uniform(0.15, 0.5), rng.uniform(-0.35, 0.35, 2)
    return [middle + np.array([[-a], [a]]) * _direction(rng)]


def edge(rng, mesh, h):
    y, depth = rng.uniform(-0.6, 0.6), rng.uniform(0.2, 1.3)
    return [np.array([[-1.0 - 0.2 * h, y], [-1.0 + depth, y + rng.uniform(-0.6, 0.6)]])]


def deep_edge(rng, mesh, h):
    """A tip before the far side."""
    y = rng.uniform(-0.5, 0.5)
    return [np.array([[-1.2, y], [1.0 - gap(rng, h), y + rng.uniform(-0.3, 0.3)]])]


def kinked(rng, mesh, h):
    """One to three kinks; legs from two thirds of a cell on; it may come from the side."""
    turn = rng.uniform(-np.pi, np.pi)
    from_side = rng.random() < 0.5
    x = [np.array([-1.1, rng.uniform(-0.5, 0.5)]) if from_side else rng.uniform(-0.5, 0.2, 2)]
    turn = rng.uniform(-0.5, 0.5) if from_side else turn
    for k in range(int(rng.integers(2, 5))):
        leg = rng.uniform(0.25, 0.6) if k == 0 else gap(rng, h, 0.67, 6.0)
        x.append(x[-1] + leg * scenes.rows(turn)[0])
        turn += rng.uniform(-1.3, 1.3)
    return [np.array(x)]


def arc(rng, mesh, h):
    radius, half = rng.uniform(2.0 * h, 0.8), rng.uniform(0.3, 1.4)
    t = np.linspace(-half, half, 81)
    x = radius * np.stack([np.cos(t), np.sin(t)], axis=1) @ scenes.rows(rng.uniform(-np.pi, np.pi))
    return [x - x.mean(axis=0) + rng.uniform(-0.3, 0.3, 2)]


def _ways(rng, mesh):
    """Two mesh points inside, some cells apart."""
    inside = np.nonzero((np.abs(mesh.points) < 0.7).all(axis=1))[0]
    while True:
        a, b = mesh.points[rng.choice(inside, 2, replace=False)]
        if np.linalg.norm(b - a) > 0.35:
            return a, b


def through_points(rng, mesh, h):
    """Cut through two mesh points, beyond both by a drawn part."""
    a, b = _ways(rng, mesh)
    along = b - a
    return [np.array([a - rng.uniform(0.02, 0.25) * along, b + rng.uniform(0.02, 0.25) * along])]


def tips_on_points(rng, mesh, h):
    """Both tips on mesh points, or a hair beside them."""
    a, b = _ways(rng, mesh)
    away = float(rng.choice([0.0, 1e-12, 1e-9, 1e-6, 1e-3])) * h
    return [np.array([a, b + away * _direction(rng)])]


def along_edges(rng, mesh, h):
    """A walk along edges of the mesh, as a crack of another program is given."""
    start = _ways(rng, mesh)[0]
    number = int(np.linalg.norm(mesh.points - start, axis=1).argmin())
    way, path = _direction(rng), [number]
    for _ in range(int(rng.integers(3, 9))):
        ends = mesh.edges[(mesh.edges == path[-1]).any(axis=1)]
        others = ends.sum(axis=1) - path[-1]
        x = mesh.points[others] - mesh.points[path[-1]]
        score = x @ way / np.linalg.norm(x, axis=1)
        number = int(others[score.argmax()])
        if number in path or (np.abs(mesh.points[number]) > 0.9).any():
            break
        path.append(number)
    return [mesh.points[path]]


def beside_a_row(rng, mesh, h):
    """Along a row of mesh points, at a distance from a tenth of a cell to nothing."""
    rows = np.unique(np.round(mesh.points[:, 1], 12))
    y = float(rng.choice(rows[np.abs(rows) < 0.6]))
    y += h * float(rng.choice([0.0, 1e-1, 1e-3, 1e-6, 1e-9, 1e-12]) * rng.choice([-1, 1]))
    start = -1.2 if rng.random() < 0.4 else rng.uniform(-0.7, -0.2)
    return [np.array([[start, y], [rng.uniform(0.0, 0.7), y]])]


def _between(rng, line, least=0.25):
    """A place on a straight crack, away from its ends."""
    t = rng.uniform(least, 1 - least)
    return (1 - t) * line[0] + t * line[1], (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])


def tee(rng, mesh, h):
    """A crack that ends on another."""
    main = (inner if rng.random() < 0.5 else edge)(rng, mesh, h)[0]
    x, along = _between(rng, main)
    way = along @ scenes.rows(rng.uniform(0.7, np.pi - 0.7) * rng.choice([-1, 1]))
    return [main, np.array([x, x + rng.uniform(0.25, 0.6) * way])]


def cross(rng, mesh, h):
    """An X: a crack, and two that end on it at one point."""
    main = inner(rng, mesh, h)[0]
    x, along = _between(rng, main, 0.35)
    way = along @ scenes.rows(rng.uniform(0.8, np.pi - 0.8))
    arms = [np.array([x, x + s * rng.uniform(0.25, 0.5) * way]) for s in (1, -1)]
    return [main, *arms]


def two_near(rng, mesh, h):
    """Two cracks whose tips pass or face each other."""
    first = inner(rng, mesh, h)[0]
    along = (first[1] - first[0]) / np.linalg.norm(first[1] - first[0])
    across = along[::-1] * [-1, 1]
    start = first[1] + rng.uniform(-2, 4) * h * along + gap(rng, h, 0.8) * across
    turned = along @ scenes.rows(rng.uniform(-0.5, 0.5))
    return [first, np.array([start, start + rng.uniform(0.25, 0.5) * turned])]


def towards_a_lip(rng, mesh, h):
    """A tip before the faces of another crack."""
    main = inner(rng, mesh, h)[0]
    x, along = _between(rng, main)
    way = along @ scenes.rows(rng.uniform(0.9, np.pi - 0.9) * rng.choice([-1, 1]))
    tip = x + gap(rng, h) * way
    return [main, np.array([tip + rng.uniform(0.3, 0.6) * way, tip])]


def at_a_hole(rng, mesh, h):
    """From the rim of a round hole, or past it."""
    radius = np.linalg.norm(mesh.points, axis=1).min()
    turn = rng.uniform(-np.pi, np.pi)
    if rng.random() < 0.6:
        start, end = 0.5 * radius, radius + rng.uniform(2.0, 6.0) * h
        line = np.array([[start, 0.0], [end, rng.uniform(-0.05, 0.05)]])
    else:
        y = radius + gap(rng, h, 1.0)
        line = np.array([[-0.6, y], [rng.uniform(-0.2, 0.5), y]])
    return [line @ scenes.rows(turn)]


PLANE: tuple[Callable, ...] = (
    inner, edge, deep_edge, kinked, arc, through_points, tips_on_points, along_edges, beside_a_row,
    tee, cross, two_near, towards_a_lip, at_a_hole, tee, kinked, edge,
)  # fmt: skip
SIDES = ("left", "right", "bottom", "top")


def plane(seed):
    """The scene of a seed in the plane."""
    rng = np.random.default_rng([9142, seed])
    kind = PLANE[seed % len(PLANE)]
    n = int(rng.choice([14, 19, 26, 34, 44]))
    nu, state = rng.uniform(0.0, 0.45), str(rng.choice(["strain", "stress"]))
    if kind is at_a_hole:
        radius = rng.uniform(0.15, 0.35)
        mesh = xc.plate_with_hole(
            width=2.0, height=2.0, radius=radius, size=2.0 / n, size_near=min(2.0 / n, radius / 4)
        )
    else:
        mesh = mesh_of_plane(rng, n)
    lines = kind(rng, mesh, 2.0 / n)
    material, name = xc.Isotropic(1.0, nu, state), kind.__name__
    special = [line for line in lines]
    if kind is not at_a_hole and rng.random() < 0.12:
        stiff = xc.Isotropic(
            float(rng.choice([0.1, 0.3, 3.0, 10.0])), rng.uniform(0.0, 0.45), state
        )
        middle = mesh.points[mesh.cells].mean(axis=1)
        at = rng.uniform(-0.5, 0.5)
        is_upper = middle @ (np.eye(2)[int(rng.integers(2))]) > at
        sets = {"lower": np.nonzero(~is_upper)[0], "upper": np.nonzero(is_upper)[0]}
        mesh = xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets, sets)
        material, name = {"lower": material, "upper": stiff}, f"{name}, two materials"
    options = {}
    if rng.random() < 0.12:
        options["friction"] = rng.uniform(0.1, 0.8)
        name += ", friction"
    cracks, stress = [xc.line_crack(x) for x in lines], far_stress(rng, 2)
    problem = xc.Problem(mesh, material, cracks, loads=loads_of(stress, SIDES), **options)
    return Scene(name, problem, np.concatenate(special), stress)


def moved(scene, Q):
    """The problem of a scene in the plane with body, cracks and loads times a rotation Q (2, 2)."""
    given, stress = scene.problem.mesh, Q @ scene.stress @ Q.T
    curves = {
        name: lambda x, curve=curve: np.asarray(curve(x @ Q)) @ Q.T
        for name, curve in given.curves.items()
    }
    sets = dict(given.facet_sets), dict(given.cell_sets)
    mesh = xc.Mesh(given.points @ Q.T, given.cells, *sets, curves=curves)
    cracks = [xc.line_crack(crack.points @ Q.T) for crack in scene.problem.cracks]
    return replace(scene.problem, mesh=mesh, cracks=cracks, loads=loads_of(stress, SIDES))


def variants(seed):
    """A scene in the plane turned, mirrored, and with its cracks moved by 1e-9 of a cell.

    Returns
    -------
    dict
        Problem, and the sign that K_II has there, by name; "drawn" is the scene itself.
    """
    scene, rng = plane(seed), np.random.default_rng([9144, seed])
    a, b = rng.uniform(-np.pi, np.pi, 2)
    way = 1e-9 * float(scene.problem.mesh.cell_size.mean()) * scenes.rows(b)[0]
    cracks = [xc.line_crack(crack.points + way) for crack in scene.problem.cracks]
    return {
        "drawn": (scene.problem, 1),
        "turned": (moved(scene, scenes.rows(a)), 1),
        "mirrored": (moved(scene, np.diag([-1.0, 1.0])), -1),
        "shifted": (replace(scene.problem, cracks=cracks), 1),
    }


def changes(seed):
    """Largest change of K, over the largest K, of each of `variants`; nothing where it is refused.

    Infinite where only one of two is refused, or tips are others.
    """
    K = {}
    for name, (problem, sign) in variants(seed).items():
        try:
            solution = xc.solve(problem)
            tips = [xc.stress_intensity(solution, c).K for c in range(len(problem.cracks))]
            K[name] = np.concatenate(tips) * [1, sign]
        except xc.XcrackError:
            K[name] = None
    drawn = K.pop("drawn")
    if drawn is None:
        return {name: np.inf for name, other in K.items() if other is not None}
    size = max(float(np.abs(drawn).max(initial=0.0)), 1e-300)
    return {
        name: np.inf if other is None or other.shape != drawn.shape
        else float(np.abs(other - drawn).max(initial=0.0)) / size
        for name, other in K.items()
    }  # fmt: skip


# In space ---------------------------------------------------------------------------------------


def _normal(rng):
    return scenes_space.unit(rng.standard_normal(3))


def penny(rng, n):
    return [xc.penny_crack(rng.uniform(-0.2, 0.2, 3), _normal(rng), rng.uniform(0.35, 0.6))]


def ellipse(rng, n):
    normal, centre = _normal(rng), rng.uniform(-0.15, 0.15, 3)
    a, b = rng.uniform(0.45, 0.65), rng.uniform(0.3, 0.45)
    return [xc.elliptic_crack(centre, normal, scenes_space.axes(normal)[0], a, b)]


def half_penny(rng, n):
    """A penny whose middle is at or beyond a side."""
    centre = np.array([-1.0 - rng.uniform(-0.15, 0.15), *rng.uniform(-0.2, 0.2, 2)])
    return [xc.penny_crack(centre, [rng.uniform(-0.3, 0.3), 0.0, 1.0], rng.uniform(0.55, 0.9))]


def corner(rng, n):
    centre = np.array([-1.0, -1.0, rng.uniform(-0.2, 0.2)])
    return [xc.penny_crack(centre + 1e-3, [0.0, 0.0, 1.0], rng.uniform(0.6, 0.95))]


def straight(rng, n):
    """A front from side to side, slanted or along mesh planes."""
    on_grid = rng.random() < 0.4
    z = float(rng.integers(-n // 4, n // 4) * 2 / n) if on_grid else rng.uniform(-0.4, 0.4)
    return [scenes_space.half_sheet(rng.uniform(-0.4, 0.4), z, rng.uniform(-0.3, 0.3))]


def two_pennies(rng, n):
    height = rng.uniform(0.8, 3.0) * 2 / n
    where = [[rng.uniform(-0.45, -0.2), 0.03, -height / 2], [rng.uniform(0.2, 0.45), 0, height / 2]]
    return [xc.penny_crack(np.array(c), [0, 0, 1.0], rng.uniform(0.3, 0.45)) for c in where]


def tee_of_sheets(rng, n):
    """A sheet that ends on another one."""
    main = scenes_space.half_sheet(rng.uniform(0.3, 0.6), rng.uniform(-0.3, 0.1), 0.0)
    z, x = main.points[0, 2], rng.uniform(-0.5, 0.0)
    above = z + rng.uniform(0.35, 0.55)
    other = xc.plane_crack([(x, -2, z - 1.2), (x, 2, z - 1.2), (x, 2, above), (x, -2, above)])
    a, b, c = main.points[main.faces[0]]
    return [main, xc.arm(other, 0, 1 if np.cross(b - a, c - a)[2] > 0 else -1)]


SPACE: tuple[Callable, ...] = (
    penny, half_penny, straight, ellipse, corner, two_pennies, penny, straight, tee_of_sheets,
)  # fmt: skip


def space(seed):
    """The scene of a seed in space."""
    rng = np.random.default_rng([9143, seed])
    kind = SPACE[seed % len(SPACE)]
    n = int(rng.choice([5, 6, 7, 8]))
    amplitude = rng.uniform(0.0, 0.15) if rng.random() < 0.5 else 0.0
    mesh = scenes_space.perturbed(n, int(rng.integers(1 << 30)), amplitude)
    cracks = kind(rng, n)
    material, name = xc.Isotropic(1.0, rng.uniform(0.0, 0.4)), kind.__name__
    if rng.random() < 0.08 and kind in (penny, ellipse):
        is_upper = mesh.points[mesh.cells].mean(axis=1)[:, 2] > 0.6
        sets = {"lower": np.nonzero(~is_upper)[0], "upper": np.nonzero(is_upper)[0]}
        mesh = xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets, sets)
        material = {"lower": material, "upper": xc.Isotropic(float(rng.choice([0.2, 4.0])), 0.3)}
        name += ", two materials"
    options = {}
    if rng.random() < 0.12:
        options["friction"] = rng.uniform(0.1, 0.8)
        name += ", friction"
    problem = xc.Problem(
        mesh, material, cracks, loads=loads_of(far_stress(rng, 3), scenes_space.SIX), **options
    )
    return Scene(name, problem, np.zeros((0, 3)))


WHERE = {"plane": plane, "space": space}


# What became of a scene -------------------------------------------------------------------------


def K_of(problem):
    """SIF of each crack with bars, and the messages on the way."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution = xc.solve(problem, error=True)
        sifs = [xc.stress_intensity(solution, c) for c in range(len(problem.cracks))]
    theirs = [w for w in caught if not issubclass(w.category, xc.XcrackWarning)]
    if theirs:
        raise RuntimeError(f"foreign warning: {theirs[0].message} at {theirs[0].filename}")
    return sifs, [str(w.message) for w in caught]


def reference(scene, level):
    """K at the places of a mesh that is finer at tips, kinks, junctions and mouths."""
    problem = scene.problem
    mesh, dim = problem.mesh, problem.mesh.dim
    fine = FINE[dim][level]
    if dim == 2:
        ends = [problem.mesh.points[:0], *(c.points[list(c.tips or ())] for c in problem.placed)]
        few = [x if len(x) < 12 else x[:0] for x in (c.points for c in problem.cracks)]
        places = np.concatenate([*ends, *few, *(scene.special,) * (len(scene.special) < 12)])
        least, widest = fine, _WIDEST[2][level]
    else:
        places = np.concatenate([c.points[f] for c in problem.placed for f in c.fronts])
        least, widest = fine * float(np.mean(mesh.cell_size)), np.inf

    def size(x):
        away = np.min([np.linalg.norm(x - p, axis=1) for p in places], axis=0)
        wanted = least + _GROWS * away if dim == 2 else least + 0.5 * away
        return np.minimum(wanted, widest)

    finer = replace(problem, mesh=xc.refine(mesh, size=size), order=2)
    sifs = K_of(finer)[0]
    best = [np.where(np.isnan(s.best), s.K, s.best) for s in sifs]
    return np.concatenate([s.x for s in sifs]), np.concatenate(best)


def truth(scene, x):
    """K `(m, d)` at places, and by how much two references differ there; None without them."""
    try:
        (x0, K0), (x1, K1) = (reference(scene, level) for level in (0, 1))
    except xc.XcrackError:
        return None
    if scene.problem.mesh.dim == 2 and not len(x0) == len(x1) == len(x):
        return None
    if not len(x0) or not len(x1):
        return None
    first, second = _at(x, x0, K0), _at(x, x1, K1)
    return second, np.abs(second - first)


def _at(x, places, K):
    """K at the nearest places; along fronts between the two nearest."""
    away = np.linalg.norm(x[:, None] - places, axis=2)
    one, two = np.argsort(away, axis=1)[:, :2].T if len(places) > 1 else np.zeros((2, len(x)), int)
    if x.shape[1] == 2:
        return K[one]
    side = places[two] - places[one]
    square = np.einsum("ij,ij->i", side, side)
    share = np.einsum("ij,ij->i", x - places[one], side) / np.where(square > 0, square, 1.0)
    share = np.clip(share, 0.0, 1.0)[:, None]
    return (1 - share) * K[one] + share * K[two]


def row_of(scene, has_truth):
    """What became of a scene: numbers and texts of a row of the campaign."""
    begin = time.process_time()
    sifs, messages = K_of(scene.problem)
    row = {
        "kind": scene.kind,
        "messages": json.dumps(sorted({m.split(":", 1)[-1] for m in messages})),
    }
    row["solve seconds"] = time.process_time() - begin
    K, bar, best = (
        np.concatenate([getattr(s, name) for s in sifs]) for name in ("K", "bar", "best")
    )
    reasons = [reason for s in sifs for reason in s.reasons]
    shut = np.concatenate([s.closed for s in sifs])
    row |= {"places": len(K), "K is nan": int((~np.isfinite(K)).sum())}
    size = float(np.abs(K).max(initial=0.0))
    row |= {"largest K": size if np.isfinite(size) else -1.0, "bars": int(bar.size)}
    is_missing = np.isnan(bar)
    row["bars that are nan"] = int(is_missing.sum())
    silent = is_missing.any(axis=1) & np.array([not r for r in reasons], dtype=bool)
    row["nan without a reason"] = int(silent.sum())
    row["reasons"] = json.dumps(sorted({r for r in reasons if r}))
    row["closed places"] = int(shut.sum())
    if not has_truth or not len(K):
        return row
    x = np.concatenate([s.x for s in sifs])
    inner = (
        np.concatenate([~s.at_surface for s in sifs]) if x.shape[1] == 3 else np.ones(len(x), bool)
    )
    reference_K = truth(scene, x)
    row["truth"] = "none" if reference_K is None else "found"
    if reference_K is None:
        return row
    wanted, doubt = reference_K
    scale = np.abs(wanted).max()
    row["true K"] = json.dumps([[float(f"{v:.9g}") for v in r] for r in wanted])
    error = np.abs(best - wanted)
    known = inner[:, None] & ~is_missing & ~(shut[:, None] & (np.arange(K.shape[1]) == 0))
    largest = np.maximum(bar, error)
    judged = known & (doubt <= np.maximum(AGREE * largest, _LEAST * scale))
    beyond = (error / np.maximum(bar, _LEAST * scale))[judged]
    row |= {"bars judged": int(judged.sum()), "bars held": int((beyond <= 1).sum())}
    row["too wide"] = int((beyond < 0.1).sum())
    row["worst over bar"] = float(beyond.max(initial=0.0))
    off = np.abs(K - wanted)[inner]
    if len(off) and scale > 0 and doubt[inner].max() <= AGREE_K * scale:
        row["error of K"] = float(off.max() / scale)
    return row


def outcome(seed, where):
    """The row of a seed; what is refused in words, or raised by others, raises."""
    return row_of(WHERE[where](seed), seed % TRUTH_EVERY == 0)
