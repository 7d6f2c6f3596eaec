"""Random scenes with known K for error bars: a seed is a scene of order 2, and makes it again.

The kinds of `scenes_of_K`, a fifth as close to all that clips a domain, and cracks at and beside
round holes, and kinked ones that are closed. Where there is no exact field, the best K of two
meshes that are graded towards tips, kinks and corners has to agree.
"""

from dataclasses import replace

import numpy as np

import xcrack as xc
from support import exact, scenes_of_K
from support import scenes_2d as scenes
from support.scenes_of_K import Scene

CELLS = (16, 24, 32, 40)  # a side of [-1, 1]²
AGREE = 0.1  # largest difference of two references, as a share of the largest error or bar
_LEAST = 1e-6  # and of K: what nobody can tell apart
_FINE = (24.0, 60.0)  # one over the cell size at tips and kinks of the references


class Drawn(scenes_of_K.Mesh):
    """Distances are those of a mesh five times as coarse."""

    @property
    def size(self):
        return 5.0 * 2.0 / self.n


def arc(rng, drawn):
    """An arc of so many chords that none is seen, shortest at the tips.

    A tip looks along its last chord, half of whose turn K_II is off: 6e-4 of K with the 240 chords
    of `scenes_of_K`, 6e-5 with 2400, 1e-7 with these.
    """
    radius, half = rng.uniform(0.3, 1.5), rng.uniform(0.15, 0.4)
    stress = (1.0, 1.0, 0.0) if rng.random() < 0.5 else (1.0, 0.2, 0.0)
    field = exact.ArcCrack(radius, half, 1.0, 0.3, *stress)
    t = half * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 2401))
    local = radius * np.stack([np.cos(t), np.sin(t)], axis=1)
    angle = rng.uniform(-np.pi, np.pi)
    tip = scenes_of_K.near_a_side(rng, scenes_of_K.gap(rng, drawn.size))
    origin = tip - local[-1] @ scenes.rows(angle)
    points = origin + local @ scenes.rows(angle)
    values = scenes.turned(field.field, origin, angle)
    crack = xc.line_crack(points)
    problem = scenes_of_K.on_all_sides(drawn.box(), drawn, [crack], values, contact="off")
    low, high = np.array(field.K_lower), np.array(field.K_upper)
    return Scene(problem, points[[0, -1]], np.array([low * [1, -1], high]))


def kinked_closed(rng, drawn):
    """An inner crack with a kink, pressed and sheared."""
    angle, turn = rng.uniform(-0.5, 0.5), rng.uniform(-0.6, 0.6)
    start = np.array([rng.uniform(-0.6, -0.2), rng.uniform(-0.2, 0.2)])
    kink = start + rng.uniform(0.3, 0.6) * scenes.rows(angle)[0]
    end = kink + rng.uniform(0.2, 0.4) * scenes.rows(angle + turn)[0]
    crack = xc.line_crack([tuple(start), tuple(kink), tuple(end)])
    loads = [xc.traction("top", (0.7, -1.0)), xc.traction("bottom", (-0.7, 1.0))]
    loads += [xc.traction("right", (0.0, 0.7)), xc.traction("left", (0.0, -0.7))]

    def finer(n):
        return xc.Problem(
            xc.box((-1.0, -1.0), (1.0, 1.0), n), xc.Isotropic(1.0, 0.3, "strain"), [crack],
            loads=loads, order=2,
        )  # fmt: skip

    return Scene(replace(finer(8), mesh=drawn.box()), finer=finer)


def _holed(rng, drawn, points, radius):
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]

    def finer(n):
        mesh = xc.plate_with_hole(
            width=2.0, height=2.0, radius=radius, size=2.0 / n, size_near=min(2.0 / n, radius / 4)
        )
        return xc.Problem(
            mesh, xc.Isotropic(1.0, 0.3, "strain"), [xc.line_crack(points)], loads=loads,
            contact="off", order=2,
        )  # fmt: skip

    return Scene(finer(drawn.n), finer=finer)


def at_a_hole(rng, drawn):
    """A crack from the rim of a round hole."""
    radius, y = rng.uniform(0.15, 0.35), rng.uniform(-0.05, 0.05)
    tip = radius + rng.uniform(3.0, 6.0) * 2.0 / drawn.n
    return _holed(rng, drawn, [(0.5 * radius, y), (tip, y + rng.uniform(-0.05, 0.05))], radius)


def beside_a_hole(rng, drawn):
    """An edge crack that passes a round hole."""
    radius = rng.uniform(0.15, 0.35)
    y = radius + rng.uniform(2.0, 5.0) * 2.0 / drawn.n
    return _holed(rng, drawn, [(-1.2, y), (rng.uniform(-0.5, 0.1), y)], radius)


EXACT = tuple(arc if kind is scenes_of_K.arc else kind for kind in scenes_of_K.EXACT)
REFERENCED = (*scenes_of_K.REFERENCED, kinked_closed, at_a_hole, beside_a_hole)
KINDS = (*EXACT, *REFERENCED)


def drawn_scene(seed, kinds=KINDS):
    """Name of the kind and the scene of a seed; one that cannot be is refused by an error."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice(CELLS))
    drawn = Drawn(n, 2, int(rng.integers(1 << 30)), rng.uniform(0.0, 0.2), xc.Numerics())
    kind = kinds[seed % len(kinds)]
    return kind.__name__, kind(rng, drawn)


def bars_of(problem):
    """K of all cracks with their error bars: places `(f, 2)`, and one SIF a crack."""
    solution = xc.solve(problem, error=True)
    sif = [xc.stress_intensity(solution, c) for c in range(len(problem.cracks))]
    return np.concatenate([s.x for s in sif]), sif


def known_K(scene):
    """K `(m, 2)` at the tips, and by how much two references differ; None where there is none."""
    if scene.finer is None:
        return scene.tips, scene.K, 0.0
    first, second = (_reference(scene, fine) for fine in _FINE)
    if first[1].shape != second[1].shape or not first[1].size:
        return None
    return second[0], second[1], float(np.abs(first[1] - second[1]).max())


def _reference(scene, fine):
    """Places and best K on a mesh that is fine at tips, kinks and corners."""
    problem = scene.finer(16)
    points = problem.mesh.points
    rim = points[np.unique(problem.mesh.boundary)]
    inner = rim[(np.abs(rim) < 1 - 1e-9).all(axis=1)]
    special = [p for crack in problem.cracks for p in crack.points if (np.abs(p) <= 1).all()]
    square = len(inner) and not problem.mesh.curves
    corners = [[x, y] for x in (inner[:, 0].min(), inner[:, 0].max()) for y in (
        inner[:, 1].min(), inner[:, 1].max())] if square else []  # fmt: skip
    least = np.repeat([0.6 / fine, 0.3 / fine], [len(special), len(corners)])
    places = np.array([*special, *corners])

    def size(x):
        away = np.linalg.norm(x[:, None] - places, axis=2)
        wanted = np.maximum(least, 0.25 * away).min(axis=1)
        if problem.mesh.curves:
            middle = np.linalg.norm(x, axis=1) - np.linalg.norm(inner, axis=1).max()
            wanted = np.minimum(wanted, np.maximum(0.6 / fine, 0.25 * middle))
        return np.minimum(wanted, 0.15 if fine == _FINE[0] else 0.08)

    x, sif = bars_of(replace(problem, mesh=xc.refine(problem.mesh, size=size)))
    best = [np.where(np.isnan(s.best), s.K, s.best) for s in sif]
    return x, np.concatenate(best)


def outcome(seed, known=None, kinds=KINDS):
    """What a scene gives: errors of the best K and their bars, as shares of the largest K.

    Returns
    -------
    dict
        ``kind``, and ``refused`` (a word) or ``known`` (tips, K, difference of two references),
        ``error`` and ``bar`` (two components a tip, nan without a bar), ``K`` (error of K itself),
        ``reasons``. K_I of closed tips is exact and left out: nan.
    """
    name = kinds[seed % len(kinds)].__name__
    try:
        _, scene = drawn_scene(seed, kinds)
        known = known_K(scene) if known is None else known
        if known is None:
            return {"kind": name, "refused": "other tips"}
        x, sif = bars_of(scene.problem)
    except xc.XcrackError as error:
        return {"kind": name, "refused": type(error).__name__}
    tips, wanted = (np.asarray(values, dtype=float) for values in known[:2])
    outside = np.abs(tips).max(axis=1)
    if ((outside > 1) & (outside < 1 + 3.0 / CELLS[0])).any() or len(x) != (outside <= 1).sum():
        return {"kind": name, "refused": "other tips"}  # an end near a side is a mouth there
    row = np.linalg.norm(tips - x[:, None], axis=2).argmin(axis=1)
    size = np.abs(wanted).max()
    joined = {
        k: np.concatenate([getattr(s, k) for s in sif]) for k in ("K", "best", "bar", "closed")
    }
    error = np.nan_to_num(np.abs(joined["best"] - wanted[row])) / size
    bar = joined["bar"] / size
    doubt = known[2] / size
    largest = max(error.max(initial=0.0), np.nan_to_num(bar).max(initial=0.0), _LEAST)
    if doubt > AGREE * largest:
        return {"kind": name, "refused": "no reference"}
    error[np.isnan(bar)] = np.nan
    error[joined["closed"], 0] = np.nan
    return {
        "kind": name,
        "known": [tips.tolist(), wanted.tolist(), known[2]],
        "error": error.tolist(),
        "bar": bar.tolist(),
        "K": (np.abs(joined["K"] - wanted[row]) / size).tolist(),
        "reasons": [reason for s in sif for reason in s.reasons],
    }
