"""Random cracks with known K, near all that clips a domain: a seed is a scene, and makes it again.

Tips come close to sides, holes, other tips and other cracks; crack faces are open, closed, half
closed or under pressure. Where there is an exact field it is imposed on all of the boundary, that
of holes included, and holds however near that is. Else K of two much finer meshes has to agree.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import xcrack as xc
from support import exact
from support import scenes_2d as scenes

COARSE = (8, 12, 16, 24, 32, 48)  # cells a side of [-1, 1]²; holes have corners at quarters


@dataclass(frozen=True)
class Scene:
    """A problem and K at its tips.

    Attributes
    ----------
    problem : Problem
    tips : (m, 2) array, length
    K : (m, 2) array, or None
        Exact values; None: to be taken from `finer`.
    finer : callable, optional
        n -> Problem, the same scene on n by n cells.
    closed : (m,) array of bool, optional
        Tips at which the crack faces press.
    """

    problem: xc.Problem
    tips: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    K: np.ndarray | None = None
    finer: Callable[[int], xc.Problem] | None = None
    closed: np.ndarray | None = None


@dataclass(frozen=True)
class Mesh:
    """What is drawn for all kinds: cells a side, order of the functions, moved inner points."""

    n: int
    order: int
    seed: int
    amplitude: float
    numerics: xc.Numerics

    @property
    def size(self):
        return 2.0 / self.n

    def box(self, without=None):
        mesh = scenes.perturbed(self.n, self.seed, self.amplitude)
        return mesh if without is None else cut_out(mesh, without)


def cut_out(mesh, inside):
    """The mesh without the cells whose middle is in a hole or notch."""
    cells = mesh.cells[~inside(mesh.points[mesh.cells].mean(axis=1))]
    used, number = np.unique(cells, return_inverse=True)
    return xc.Mesh(mesh.points[used], number.reshape(cells.shape))


def gap(rng, size, least=0.35, most=14.0):
    """A distance from a third of a cell to many."""
    return min(size * np.exp(rng.uniform(np.log(least), np.log(most))), 0.9)


def near_a_side(rng, distance):
    """A point at a distance from one of the sides of [-1, 1]²."""
    return np.array([1.0 - distance, rng.uniform(-0.5, 0.5)]) @ scenes.rows(
        np.pi / 2 * rng.integers(4)
    )


def on_all_sides(mesh, drawn, cracks, values, **options):
    """Problem with exact displacements everywhere on the boundary."""
    return xc.Problem(
        mesh, xc.Isotropic(1.0, 0.3, "strain"), cracks, order=drawn.order, numerics=drawn.numerics,
        supports=[xc.displacement("boundary", lambda x: values(x)[0])], **options,
    )  # fmt: skip


def shear_of(rng):
    return float(rng.choice([0.0, rng.uniform(-1.0, 1.0)]))


# Exact fields -----------------------------------------------------------------------------------


def edge(rng, drawn, hole=False):
    """Williams' field of an edge crack whose tip is near a side or near a hole."""
    angle, K = rng.uniform(-np.pi, np.pi), np.array([1.0, shear_of(rng)])
    without = None
    if hole:
        tip = rng.uniform(-0.3, 0.3, 2)
        without = disc(rng, drawn, tip, angle)
    else:
        tip = near_a_side(rng, gap(rng, drawn.size))
    values = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *K), tip, angle)
    crack = scenes.edge_line(tip, angle, 4.0)
    problem = on_all_sides(drawn.box(without), drawn, [crack], values, contact="off")
    return Scene(problem, tip[None], K[None])


def edge_at_a_hole(rng, drawn):
    """Williams' field with a hole ahead of the tip, or beside it."""
    return edge(rng, drawn, hole=True)


def disc(rng, drawn, tip, angle):
    """A hole at a drawn distance from a tip, away from the crack."""
    radius = rng.uniform(1.5, 3.0) * drawn.size
    way = scenes.rows(angle + rng.uniform(-2.0, 2.0))[0]
    centre = tip + (radius + gap(rng, drawn.size, 0.7)) * way
    return lambda x: np.linalg.norm(x - centre, axis=1) < radius


def _straight(rng, drawn):
    """A crack of drawn length whose last tip is near a side: half length, angle, middle, points."""
    a, angle = rng.uniform(0.15, 0.5), rng.uniform(-np.pi, np.pi)
    tip = near_a_side(rng, gap(rng, drawn.size))
    middle = tip - a * scenes.rows(angle)[0]
    return a, angle, middle, np.array([middle - a * scenes.rows(angle)[0], tip])


def inner(rng, drawn):
    """Griffith's crack; it may start outside."""
    a, angle, middle, points = _straight(rng, drawn)
    shear = shear_of(rng)
    values = scenes.turned(
        lambda x, y: exact.griffith(x, y, a, 1.0, 0.3, 0.0, 1.0, shear), middle, angle
    )
    problem = on_all_sides(drawn.box(), drawn, [xc.line_crack(points)], values, contact="off")
    return Scene(problem, points, np.sqrt(np.pi * a) * np.array([[1.0, -shear], [1.0, shear]]))


def under_pressure(rng, drawn):
    """Griffith's crack opened by pressure on its faces."""
    a, angle, middle, points = _straight(rng, drawn)

    def values(x, y):
        u, s = exact.griffith(x, y, a, 1.0, 0.3, 0.0, 1.0, 0.0)
        v, t = exact.uniform_stress(x, y, 0.0, 1.0, 0.0, 1.0, 0.3)
        return u - v, s - t

    problem = on_all_sides(
        drawn.box(), drawn, [xc.line_crack(points)], scenes.turned(values, middle, angle),
        loads=[xc.crack_pressure(1.0)], contact="off",
    )  # fmt: skip
    return Scene(problem, points, np.sqrt(np.pi * a) * np.array([[1.0, 0.0], [1.0, 0.0]]))


def near_a_tip(rng, drawn):
    """A second crack ahead, whose lips bear the stress that was there: K = 0 at its tips."""
    a, angle = rng.uniform(0.2, 0.4), rng.uniform(-np.pi, np.pi)
    ahead = scenes.rows(angle)[0]
    middle = rng.uniform(-0.1, 0.1, 2) - 0.3 * ahead
    first = a + gap(rng, drawn.size, 0.8)
    other = middle + np.array([[first], [first + rng.uniform(0.2, 0.5)]]) * ahead
    values = scenes.turned(lambda x, y: exact.griffith(x, y, a, 1.0, 0.3, 0.0, 1.0), middle, angle)

    def carried(x):
        along = (x - middle) @ ahead
        return -along / np.sqrt(along**2 - a**2)

    points = middle + np.array([[-a], [a]]) * ahead
    cracks = [xc.line_crack(points), xc.line_crack(other)]
    problem = on_all_sides(
        drawn.box(), drawn, cracks, values, loads=[xc.crack_pressure(carried, crack=1)],
        contact="off",
    )  # fmt: skip
    K = np.zeros((4, 2))
    K[:2, 0] = np.sqrt(np.pi * a)
    return Scene(problem, np.concatenate([points, other]), K)


def arc(rng, drawn):
    """An arc of traction-free crack faces, the last tip near a side."""
    radius, half = rng.uniform(0.3, 1.5), rng.uniform(0.15, 0.4)
    stress = (1.0, 1.0, 0.0) if rng.random() < 0.5 else (1.0, 0.2, 0.0)
    field_ = exact.ArcCrack(radius, half, 1.0, 0.3, *stress)
    t = np.linspace(-half, half, 241)
    local = radius * np.stack([np.cos(t), np.sin(t)], axis=1)
    angle = rng.uniform(-np.pi, np.pi)
    origin = near_a_side(rng, gap(rng, drawn.size)) - local[-1] @ scenes.rows(angle)
    points = origin + local @ scenes.rows(angle)
    values = scenes.turned(field_.field, origin, angle)
    # Lips are not on the circle but on its chords: the field there is that of one side.
    problem = on_all_sides(drawn.box(), drawn, [xc.line_crack(points)], values, contact="off")
    low, high = np.array(field_.K_lower), np.array(field_.K_upper)
    return Scene(problem, points[[0, -1]], np.array([low * [1, -1], high]))


def _pressed(rng, drawn, values, K, closed, turn=True):
    """A crack of unit half length scaled and placed, with contact asked of the solution."""
    a, angle, middle, points = _straight(rng, drawn)
    if turn and rng.random() < 0.5:  # the other tip near the side
        angle, points = angle + np.pi, points[::-1]
    placed = scenes.turned(lambda x, y: values(x, y, a), middle, angle)
    problem = on_all_sides(drawn.box(), drawn, [xc.line_crack(points)], placed)
    return Scene(problem, points, np.asarray(K(a), dtype=float), closed=np.array(closed))


def closed(rng, drawn):
    """Pressed and sheared."""
    press, shear = rng.uniform(0.1, 2.0), float(rng.choice([-1.0, 1.0]))
    return _pressed(
        rng, drawn,
        lambda x, y, a: exact.closed_crack(x, y, a, 1.0, 0.3, syy=-press, sxy=shear),
        lambda a: np.sqrt(np.pi * a) * np.array([[0.0, -shear], [0.0, shear]]), [True, True],
    )  # fmt: skip


def half_closed(rng, drawn):
    """Tension and bending; the closed piece may be shorter than a cell."""
    mean = rng.uniform(-0.8, 0.49)
    return _pressed(
        rng, drawn,
        lambda x, y, a: exact.partial_closure(x, y, a, 1.0, 0.3, mean, 1.0),
        lambda a: [[0.0, 0.0], [exact.partial_closure_params(a, mean, 1.0)[2], 0.0]],
        [True, False],
    )  # fmt: skip


def half_closed_sheared(rng, drawn):
    """Tension and bending, and shear: without friction they do not know of each other."""
    mean, shear = rng.uniform(-0.8, 0.49), rng.uniform(-1.0, 1.0)

    def values(x, y, a):
        u, s = exact.partial_closure(x, y, a, 1.0, 0.3, mean, 1.0)
        v, t = exact.griffith(x, y, a, 1.0, 0.3, 0.0, 0.0, shear)
        return u + v, s + t

    def K(a):
        K_II = shear * np.sqrt(np.pi * a)
        return [[0.0, -K_II], [exact.partial_closure_params(a, mean, 1.0)[2], K_II]]

    return _pressed(rng, drawn, values, K, [True, False])


def closed_ends(rng, drawn):
    """Open in the middle, closed at both tips, sheared: without that there is no K at all."""
    q, shear = rng.uniform(0.05, 0.49), rng.uniform(0.3, 1.0)

    def values(x, y, a):
        u, s = exact.centre_open(x, y, a, 1.0, 0.3, 1.0, q)
        v, t = exact.griffith(x, y, a, 1.0, 0.3, 0.0, 0.0, shear)
        return u + v, s + t

    return _pressed(
        rng, drawn, values,
        lambda a: shear * np.sqrt(np.pi * a) * np.array([[0.0, -1.0], [0.0, 1.0]]), [True, True],
    )  # fmt: skip


# References ---------------------------------------------------------------------------------------


def _pulled(drawn, cracks, top=(0.0, 1.0), without=None, linear=0.0, more=()):
    """A box pulled (and bent) at its ends, and the same on other meshes."""

    def problem(mesh, order, numerics):
        loads = [
            xc.traction(
                name,
                lambda x, s=s: s * np.stack([top[0] + 0 * x[:, 0], top[1] + linear * x[:, 0]], 1),
            )
            for name, s in (("top", 1.0), ("bottom", -1.0))
        ]
        loads += [xc.traction("right", (0.0, top[0])), xc.traction("left", (0.0, -top[0]))]
        if without is not None:
            mesh = _with_sides(mesh, without)
        return xc.Problem(
            mesh, xc.Isotropic(1.0, 0.3, "strain"), cracks, loads=[*loads, *more], order=order,
            numerics=numerics,
        )  # fmt: skip

    def finer(n):
        return problem(xc.box((-1.0, -1.0), (1.0, 1.0), n), 2, xc.Numerics())

    mesh = scenes.perturbed(drawn.n, drawn.seed, 0.0 if without else drawn.amplitude)
    return Scene(problem(mesh, drawn.order, drawn.numerics), finer=finer)


def _with_sides(mesh, inside):
    """`cut_out` that keeps the names of the sides."""
    result = cut_out(mesh, inside)
    facets = result.facet_sets["boundary"]
    x = result.points[facets]
    named = {
        name: facets[(np.abs(x[:, :, axis] - at) < 1e-9).all(axis=1)]
        for name, axis, at in (
            ("left", 0, -1.0), ("right", 0, 1.0), ("bottom", 1, -1.0), ("top", 1, 1.0),
        )
    }  # fmt: skip
    return xc.Mesh(result.points, result.cells, named)


def _off_grid(rng):
    return rng.uniform(-0.03, 0.03)


def kinked(rng, drawn):
    """An edge crack with a kink; its last piece may be short, its tip near a side."""
    angle = rng.uniform(-1.0, 1.0)
    tip = np.array([1.0 - gap(rng, drawn.size), rng.uniform(-0.3, 0.3)])
    kink = tip - gap(rng, drawn.size, 1.0) * scenes.rows(angle)[0]
    points = [(-1.2, kink[1] + _off_grid(rng)), tuple(kink), tuple(tip)]
    return _pulled(drawn, [xc.line_crack(points)])


def inner_kinked(rng, drawn):
    """An inner crack with a kink."""
    angle, turn = rng.uniform(-0.5, 0.5), rng.uniform(-1.2, 1.2)
    start = np.array([rng.uniform(-0.6, -0.2), rng.uniform(-0.2, 0.2)])
    kink = start + rng.uniform(0.3, 0.6) * scenes.rows(angle)[0]
    end = kink + gap(rng, drawn.size, 0.8, 5.0) * scenes.rows(angle + turn)[0]
    return _pulled(drawn, [xc.line_crack([tuple(start), tuple(kink), tuple(end)])])


def two_edges(rng, drawn):
    """Two edge cracks that pass or meet each other."""
    height, apart = gap(rng, drawn.size, 0.6, 6.0), gap(rng, drawn.size, 0.6, 6.0)
    middle, overlap = _off_grid(rng), float(rng.choice([-1.0, 1.0]))
    cracks = [
        xc.line_crack([(-1.2, middle), (middle - overlap * apart / 2, middle)]),
        xc.line_crack([(1.2, middle + height), (middle + overlap * apart / 2, middle + height)]),
    ]
    return _pulled(drawn, cracks)


def towards_a_lip(rng, drawn):
    """A crack whose tip comes near the faces of another one."""
    wall, y = rng.uniform(0.1, 0.5), _off_grid(rng)
    tilt = rng.uniform(-0.3, 0.3)
    low, high = -rng.uniform(0.3, 0.6), rng.uniform(0.3, 0.6)
    cracks = [
        xc.line_crack([(-1.2, y), (wall + tilt * y - gap(rng, drawn.size, 0.6), y)]),
        xc.line_crack([(wall + tilt * low, low), (wall + tilt * high, high)]),
    ]
    return _pulled(drawn, cracks, top=(float(rng.choice([0.0, 0.5])), 1.0))


def towards_a_hole(rng, drawn):
    """An edge crack that runs towards a square hole, or past it."""
    low = np.array([rng.choice([0.0, 0.25]), rng.choice([-0.5, -0.25])])
    y = rng.uniform(low[1] - 0.3, low[1] + 0.8)
    beside = not low[1] <= y <= low[1] + 0.5
    end = low[0] + (rng.uniform(-0.3, 0.5) if beside else -gap(rng, drawn.size, 0.5))
    if beside and min(abs(y - low[1]), abs(y - low[1] - 0.5)) < 0.5 * drawn.size:
        end = low[0] - gap(rng, drawn.size, 0.5)
    crack = xc.line_crack([(-1.2, y + _off_grid(rng)), (end, y)])
    return _pulled(drawn, [crack], without=lambda x: ((x > low) & (x < low + 0.5)).all(axis=1))


def deep_edge(rng, drawn):
    """An edge crack with a short ligament, under tension and bending."""
    y = _off_grid(rng)
    crack = xc.line_crack([(-1.2, y), (1.0 - gap(rng, drawn.size), y + _off_grid(rng))])
    return _pulled(drawn, [crack], linear=rng.uniform(-0.8, 0.8))


def bent(rng, drawn):
    """An inner crack that bending closes at one tip, a given share of it or none."""
    y, a = _off_grid(rng), rng.uniform(0.3, 0.7)
    crack = xc.line_crack([(-a, y), (a, y + _off_grid(rng))])
    return _pulled(drawn, [crack], top=(0.0, rng.uniform(-0.3, 0.6)), linear=1.0)


def pinched(rng, drawn):
    """A crack pulled open at its ends and pressed together in the middle."""
    y, a, width = _off_grid(rng), rng.uniform(0.5, 0.8), rng.uniform(0.1, 0.5)
    push = rng.uniform(1.5, 5.0)
    crack = xc.line_crack([(-a, y), (a, y)])
    load = xc.crack_pressure(lambda x: -push * np.maximum(1 - (x[:, 0] / width) ** 2, 0.0))
    return _pulled(drawn, [crack], more=[load])


EXACT = (
    edge, inner, half_closed, edge_at_a_hole, under_pressure, closed, near_a_tip,
    half_closed_sheared, arc, closed_ends,
)  # fmt: skip
REFERENCED = (
    kinked, inner_kinked, two_edges, towards_a_lip, towards_a_hole, deep_edge, bent, pinched,
)  # fmt: skip
KINDS = (*EXACT, *REFERENCED)
PRESSED = (closed, half_closed, half_closed_sheared, closed_ends)


def drawn_scene(seed, kinds=KINDS):
    """Name of the kind and the scene of a seed; one that cannot be is refused by an error."""
    rng = np.random.default_rng(seed)
    n, order = int(rng.choice(COARSE)), int(rng.choice([1, 2]))
    seed_of_mesh, amplitude = int(rng.integers(1 << 30)), rng.uniform(0.0, 0.2)
    cells = rng.uniform(2.0, 8.0)
    numerics = xc.Numerics(radius=None if rng.random() < 0.7 else cells * 2.0 / n)
    mesh = Mesh(n, order, seed_of_mesh, amplitude, numerics)
    kind = kinds[seed % len(kinds)]
    return kind.__name__, kind(rng, mesh)
