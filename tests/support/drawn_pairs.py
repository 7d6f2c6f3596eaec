"""Drawn pairs of pennies and ellipses in space: solved, or refused in words; a seed is a scene.

Pairs stand at any offset and angle in a cube that is pulled alike from all sides. The line in
which their planes meet tells what they are: apart; one cut through by the other, which are given
as one and two arms; or interlocked, each front through the face of the other, which is refused: of
such a pair one is let reach beyond the other, as the message says. No solution is
foreign: the cracks release at least what the largest penny in one of them would in an infinite
body, to a tenth, and at most what a hollow ball around both does; where none fits into the
body they release what they do on cells two thirds as large, to 15 %. No K is infinite or not
a number. Where the mesh is too
coarse it is refined around the place that the message names, as that asks for. Pairs that grow
begin apart.
"""

import json
import re
import time
import warnings

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

import xcrack as xc
from support.meeting_energy import unbalanced
from xcrack import GeometryError
from xcrack.base.errors import CoarseMeshError
from xcrack.mesh.locate import Body

E, NU, PULL = 1e5, 0.3, 100.0
CELLS, FINER_CELLS = 10, 15  # across the cube of side 2
ALIKE = 0.15  # of what the cracks release, by which both meshes may differ
FINEST = 0.06  # longest edge of cells to which meshes are refined where a message asks for it
BEYOND = 0.3  # by which one of an interlocked pair is let reach beyond the other
GROWING_CELLS, FINER_GROWING_CELLS = 13, 20  # across the cube of side 2.5
BALANCED = 0.02  # of the energy, up to which the release over the new area need not explain it
DA, MOST_STEPS = 0.12, 12
SIDES = (("left", "right"), ("front", "back"), ("bottom", "top"))
LOADS = [
    xc.traction(name, sign * PULL * np.eye(3)[axis])
    for axis, names in enumerate(SIDES)
    for name, sign in zip(names, (-1, 1), strict=True)
]


class ForeignEnergyError(Exception):
    """The cracks release less or more than they can: a fault, not a refusal."""


def drawn_crack(rng, centre, least, most):
    """A penny or an ellipse, with the radius of the largest penny in it."""
    normal = rng.normal(size=3)
    radius = rng.uniform(least, most)
    if rng.uniform() < 0.5:
        return xc.penny_crack(centre, normal, radius), radius
    along, share = np.cross(normal, rng.normal(size=3)), rng.uniform(0.6, 1.0)
    return xc.elliptic_crack(centre, normal, along, radius, radius * share), radius * share


def pair(seed):
    """Two cracks, and the radius of the largest penny in either."""
    rng = np.random.default_rng(seed)
    centre, way = rng.uniform(-0.1, 0.1, 3), rng.normal(size=3)
    way *= rng.uniform(0.0, 0.6) / np.linalg.norm(way)
    one, r = drawn_crack(rng, centre - way / 2, 0.45, 0.7)
    other, s = drawn_crack(rng, centre + way / 2, 0.3, 0.4)
    return [one, other], max(r, s)


def pair_to_grow(seed):
    """Two cracks with one to three quarters of an advance between them."""
    rng = np.random.default_rng([77, seed])
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    one, _ = drawn_crack(rng, np.zeros(3), 0.3, 0.42)
    other, _ = drawn_crack(rng, np.zeros(3), 0.25, 0.38)
    wanted = rng.uniform(1.8, 2.6) * 2.5 / GROWING_CELLS
    low, high = 0.0, 1.2
    for _ in range(30):
        away = (low + high) / 2
        gap = cKDTree(one.points).query(other.points + away * way)[0].min()
        low, high = (away, high) if gap < wanted else (low, away)
    shift = np.array([-0.5, 0.5])[:, None] * high * way
    surfaces = [xc.surface_crack(c.points + d, c.faces) for c, d in zip((one, other), shift)]
    return surfaces


def normal_of(crack):
    a, b, c = crack.points[crack.faces[0]]
    return np.cross(b - a, c - a)


def reach(crack, other, along):
    """From where to where a plane crack crosses the plane of another one; None: it does not."""
    height = (crack.points - other.points[0]) @ normal_of(other)
    pairs = np.concatenate([crack.faces[:, [0, 1]], crack.faces[:, [1, 2]], crack.faces[:, [2, 0]]])
    a, b = height[pairs].T
    crossed = (a * b <= 0) & (a != b)
    if not crossed.any():
        return None
    t = a[crossed] / (a - b)[crossed]
    start, stop = crack.points[pairs[crossed]].transpose(1, 0, 2)
    s = (start + t[:, None] * (stop - start)) @ along
    return float(s.min()), float(s.max())


def kind_of(one, other):
    """ "apart", "cut through" (the second by the first), "cuts through" or "interlocked"."""
    along = np.cross(normal_of(one), normal_of(other))
    a, b = reach(one, other, along), reach(other, one, along)
    if a is None or b is None or a[1] < b[0] or b[1] < a[0]:
        return "apart"
    if a[0] < b[0] and b[1] < a[1]:
        return "cut through"
    return "cuts through" if b[0] < a[0] and a[1] < b[1] else "interlocked"


def given_as(kind, one, other):
    """The cracks as a user gives them: of two that cross one runs through."""
    if kind == "apart":
        return [one, other]
    through, ending = (other, one) if kind == "cuts through" else (one, other)
    return [through, xc.arm(ending, 0, 1), xc.arm(ending, 0, -1)]


def reaching_beyond(one, other):
    """A plane crack made larger in its plane, from its far side on, until it passes the other."""
    along = np.cross(normal_of(one), normal_of(other))
    along /= np.linalg.norm(along)
    own, needed = reach(one, other, along), reach(other, one, along)
    points = one.points
    for far, near, wanted in (
        (own[0], own[1], needed[1] + BEYOND),
        (-own[1], -own[0], BEYOND - needed[0]),
    ):
        if wanted < near:
            continue
        sign = 1.0 if far == own[0] else -1.0
        fixed = points[int(np.argmin(sign * points @ along))]
        factor = (wanted - far) / (near - far)
        points = fixed + factor * (points - fixed)
    return xc.surface_crack(points, one.faces)


def solved(cracks, mesh):
    """Solution and K of a pair."""
    problem = xc.Problem(mesh, xc.Isotropic(E, NU), cracks, loads=LOADS, order=1, contact="off")
    solution = xc.solve(problem)
    return solution, [xc.stress_intensity(solution, c).K for c in range(len(cracks))]


def refined_there(mesh, message):
    """A mesh with cells half as large around the first place of a message; None: small enough."""
    place = np.array(json.loads(re.search(r"\[[^]]*\]", message)[0]))
    size = float(Body.of(mesh).cell_size(place[None])[0])
    if size / 2 < FINEST / 2:
        return None
    near = 2.0 * size
    return xc.refine(
        mesh,
        size=lambda x: np.where(np.linalg.norm(x - place, axis=1) < near, size / 2, np.inf),
    )


def solution_after_remedies(cracks, cells=CELLS):
    """Solution and K, or a refusal, after the remedies of messages; and which those were."""
    mesh, done = xc.box((-1,) * 3, (1,) * 3, cells), []
    while True:
        try:
            return (*solved(cracks, mesh), done)
        except (CoarseMeshError, GeometryError) as error:
            words = str(error)
            if "refine" not in words:
                raise
            if "Leave this arm out" in words and len(cracks) == 3:
                cracks = [crack for c, crack in enumerate(cracks) if c != int(words.split()[1])]
                done.append("without an arm that is no cell high")
                continue
            if "runs past its front" in words and kind_of(*cracks[:2]) == "interlocked":
                through, ending = (xc.surface_crack(c.points, c.faces) for c in cracks[:2])
                cracks = given_as("cut through", reaching_beyond(through, ending), ending)
                done.append("one let reach beyond the other")
                continue
            finer = refined_there(mesh, words)
            if finer is None:
                raise
            mesh, done = finer, [each for each in done if each != "refined"] + ["refined"]


def penny_energy(radius):
    """What a penny releases in an infinite body: the least that a crack around it does."""
    return 8 * (1 - NU**2) * PULL**2 * radius**3 / (3 * E)


def hollow_ball_energy(radius, around):
    """What a hollow in the middle of a ball releases in the cube around the ball: an upper bound.

    Its stress, with the even one outside the ball, is in balance, and leaves alone all cracks that
    lie in the hollow: no field in balance has less energy than that of the cracks.
    """
    return 3 * np.pi * (1 - NU) * PULL**2 * radius**3 / (E * (1 - (radius / around) ** 3))


def most_energy(points):
    """Least energy of a hollow ball around some points; None where no ball fits into the cube."""

    def radii(centre):
        return np.linalg.norm(points - centre, axis=1).max(), 1 - np.abs(centre).max()

    def share(centre):
        radius, around = radii(centre)
        return radius / around if around > 0 else np.inf

    def energy(centre):
        radius, around = radii(centre)
        return hollow_ball_energy(radius, around) if radius < around else np.inf

    options = {"method": "Nelder-Mead", "options": {"maxiter": 2000}}
    centre = minimize(share, points.mean(axis=0) / 2, **options).x
    if share(centre) >= 1:
        return None
    return float(minimize(energy, centre, **options).fun)


def added_energy(solution):
    """What the cracks of a pair release."""
    return solution.energy - 0.5 * PULL**2 * 3 * (1 - 2 * NU) / E * 8


def pair_row(seed):
    """The row of a pair; what is refused in words, or raised by others, raises."""
    begin = time.process_time()
    (one, other), radius = pair(seed)
    kind = kind_of(one, other)
    cracks = given_as(kind, one, other)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution, K, done = solution_after_remedies(cracks)
    messages = sorted({str(w.message).split(":", 1)[-1] for w in caught})
    seconds, least = time.process_time() - begin, penny_energy(radius)
    added = added_energy(solution) / least
    if not added > 0.9:
        raise ForeignEnergyError(f"{kind}: the cracks release {added:.3g} of a penny inside them")
    points = np.concatenate([crack.points for crack in solution.problem.cracks])
    most, judged_by = most_energy(points), {}
    if most is not None:
        judged_by["added at most"] = most / least
        if not added < most / least:
            raise ForeignEnergyError(
                f"{kind}: the cracks release {added:.3g} pennies, a hollow ball {most / least:.3g}"
            )
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            finer = added_energy(solution_after_remedies(cracks, FINER_CELLS)[0]) / least
        judged_by["added on finer cells"] = finer
        if not abs(added / finer - 1) < ALIKE:
            raise ForeignEnergyError(f"{kind}: {added:.3g} pennies, {finer:.3g} on finer cells")
    return {
        "kind": ", ".join([kind, *sorted(done)]),
        "messages": json.dumps(messages),
        "places": sum(map(len, K)),
        "K is nan": int(sum((~np.isfinite(k)).sum() for k in K)),
        "added": added,
        **judged_by,
        "solve seconds": seconds,
    }


def has_left(cracks):
    """Whether a front, closed at first, has come out of the body."""
    return any(front[0] != front[-1] for crack in cracks for front in crack.fronts or ())


def growing_problem(seed, cells=GROWING_CELLS):
    """A pair in a cube, alike pulled from all sides."""
    return cube_with(pair_to_grow(seed), cells)


def cube_with(cracks, cells):
    """Cracks in a cube of side 2.5, alike pulled from all sides."""
    mesh, steel = xc.box((-1.25,) * 3, (1.25,) * 3, cells), xc.Isotropic(E, NU)
    return xc.Problem(mesh, steel, cracks, loads=LOADS, order=1, contact="off")


def unlike_on_finer_cells(before, after):
    """What a step releases less what its two shapes do on cells two thirds as large, over all."""

    def given(crack):
        surface = xc.surface_crack(crack.points, crack.faces)
        for on, side in crack.ends_on:
            surface = xc.arm(surface, on, side)
        return surface

    energies = np.array([step.solutions[-1].energy for step in (before, after)])
    finer = np.array(
        [
            xc.solve(cube_with([given(c) for c in step.cracks], FINER_GROWING_CELLS)).energy
            for step in (before, after)
        ]
    )
    return float((np.diff(energies) - np.diff(finer))[0] / energies[1])


def growth_of(problem, most_steps):
    """Steps of a run, one by one."""
    return xc.grow(
        problem, xc.paris(C=1e-12, m=3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=DA,
        max_steps=most_steps, progress=False,
    )  # fmt: skip


def grown_steps(seed, cells, after_join):
    """Steps up to some after the first join."""
    steps = []
    for step in growth_of(growing_problem(seed, cells), MOST_STEPS):
        steps.append(step)
        if any(each.joins for each in steps[: len(steps) - after_join + 1]):
            break
    return steps


def growing_row(seed):
    """The row of a pair that grows until it has met and one step more, or comes out of the body."""
    begin = time.process_time()
    steps, met, ended = [], None, ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = growth_of(growing_problem(seed), MOST_STEPS)
        left = False
        while not left and (met is None or len(steps) == met):
            try:
                steps.append(next(run))
            except StopIteration as stop:
                ended = str(stop.value or "")
                break
            if met is None and steps[-1].joins:
                met = len(steps)
            left = met is None and has_left(steps[-1].cracks)
    is_whole = ended.startswith("max_steps")
    if ended and met is None and not is_whole:
        raise GeometryError(ended.split(", N = ")[-1].partition(": ")[2] or ended)
    words = "met and gone on" if met is not None else f"not met in {MOST_STEPS} steps"
    if left:
        words = "passed each other by a cell or more, and came out of the body"
    if ended and not is_whole:
        words = f"met, then ended: {ended}"
    off, judged_by = np.abs(unbalanced(steps, E, NU)), {}
    worst = int(np.argmax(off)) if len(off) else 0
    if len(off) and off[worst] > BALANCED:  # the mean of G at both ends may not be that between
        unlike = unlike_on_finer_cells(*steps[worst : worst + 2])
        judged_by["unlike on finer cells"] = unlike
        if not abs(unlike) < BALANCED:
            raise ForeignEnergyError(f"step {worst + 1} releases {unlike:+.1%} than on finer cells")
    K = np.concatenate([sif.K.ravel() for step in steps for own in step.sif for sif in own])
    return {
        "kind": words,
        "messages": json.dumps(sorted({str(w.message).split(":", 1)[-1] for w in caught})),
        "places": len(K) // 3,
        "K is nan": int((~np.isfinite(K)).sum()),
        "came to": "an arm" if any(c.ends_on for c in steps[-1].cracks) else "one crack",
        "unbalanced": float(off.max(initial=0.0)),
        **judged_by,
        "solve seconds": time.process_time() - begin,
    }


ROW = {"pairs": pair_row, "growing": growing_row}


def outcome(seed, where):
    """The row of a seed."""
    return ROW[where](seed)
