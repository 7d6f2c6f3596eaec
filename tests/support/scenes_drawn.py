"""Random cracks in random meshes with exact data: a seed is a scene, the seed alone makes it again.

Classes hold scenes of one kind, so that errors within one can be compared with their median.
"""

import warnings
from collections.abc import Callable

import numpy as np

import xcrack as xc
from support import exact, scenes_fronts
from support import scenes_2d as scenes
from support import scenes_3d as scenes_space

# Meshes in 2D: [-HALF, HALF]², order 2, tip functions within RADIUS. Where the side of the
# body, or a smaller mesh, decided the radius, the error would follow that and not the cut.
HALF, RADIUS = 1.2, 0.4
CELLS = {"plane": 12, "space": 8}
MOST = 3.0  # no error may be larger than this many medians of its class


def drawn_mesh(rng, n):
    """Triangles of a square, inner points moved by up to a fifth of a cell."""
    seed, amplitude = int(rng.integers(1 << 30)), rng.uniform(0, 0.2)
    return scenes.perturbed(n, seed, amplitude, (-HALF, -HALF), (HALF, HALF))


def imposed_everywhere(mesh, crack, field, **options):
    """Problem with exact displacements on all sides."""
    return scenes.on_box(
        mesh, [crack], field, order=2, numerics=xc.Numerics(radius=RADIUS), **options
    )


def tip_error(problem, wanted, size):
    """Largest error of K over all tips, as a share of the size; a note of what came out."""
    return float(np.abs(scenes.K_of(problem) - wanted).max() / size)


def edge(rng, n):
    """Williams' field around the tip of an edge crack of any direction, modes drawn."""
    tip, angle = rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)
    K = np.array([1.0, rng.choice([-0.6, 0.6])])
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *K), tip, angle)
    problem = imposed_everywhere(
        drawn_mesh(rng, n), scenes.edge_line(tip, angle, 3.0), field, contact="off"
    )  # fmt: skip
    return tip_error(problem, K, 1.0)


def _inner(rng):
    """Place of an inner crack: half length, angle, centre, points."""
    a, angle, centre = 0.5, rng.uniform(-np.pi, np.pi), rng.uniform(-0.1, 0.1, 2)
    return a, angle, centre, np.array([[-a, 0.0], [a, 0.0]]) @ scenes.rows(angle) + centre


def opened(rng, n):
    """Griffith's crack under tension and shear, both tips inside, contact asked of the solution."""
    a, angle, centre, points = _inner(rng)
    shear = rng.choice([-0.6, 0.6])
    field = scenes.turned(
        lambda x, y: exact.griffith(x, y, a, 1.0, 0.3, 0.0, 1.0, shear), centre, angle
    )
    problem = imposed_everywhere(drawn_mesh(rng, n), xc.line_crack(points), field)
    # The frame of the first tip is left-handed.
    wanted = np.sqrt(np.pi * a) * np.array([[1.0, -shear], [1.0, shear]])
    return tip_error(problem, wanted, np.sqrt(np.pi * a) * np.hypot(1, shear))


def closed(rng, n):
    """Pressed and sheared: K_I = 0 at both tips, K_II is not."""
    a, angle, centre, points = _inner(rng)
    shear = rng.choice([-1.0, 1.0])
    press = 0.5
    field = scenes.turned(
        lambda x, y: exact.closed_crack(x, y, a, 1.0, 0.3, syy=-press, sxy=shear), centre, angle
    )
    problem = imposed_everywhere(drawn_mesh(rng, n), xc.line_crack(points), field)
    wanted = np.sqrt(np.pi * a) * np.array([[0.0, -shear], [0.0, shear]])
    return tip_error(problem, wanted, np.sqrt(np.pi * a))


def half_closed(rng, n):
    """Tension and bending that close a part of the crack: K at the open and at the closed tip."""
    a, angle, centre, points = _inner(rng)
    mean = 0.0
    field = scenes.turned(
        lambda x, y: exact.partial_closure(x, y, a, 1.0, 0.3, mean, 1.0), centre, angle
    )
    problem = imposed_everywhere(drawn_mesh(rng, n), xc.line_crack(points), field)
    K = exact.partial_closure_params(a, mean, 1.0)[2]
    return tip_error(problem, np.array([[0.0, 0.0], [K, 0.0]]), np.sqrt(np.pi * a))


def penny(rng, n):
    """Penny of any direction under drawn tension and shear: K along its front."""
    a = rng.uniform(0.5, 0.6)
    Q = scenes_fronts.turn(rng.standard_normal(3), rng.uniform(0, np.pi))
    centre = rng.uniform(-0.1, 0.1, 3)
    shear = rng.uniform(0, 0.6) * scenes.rows(rng.uniform(0, 2 * np.pi))[0]
    return _penny_error(rng, n, a, Q, centre, (1.0, *shear))


def pressed_penny(rng, n):
    """Penny pressed and sheared: closed, K_I = 0."""
    a = rng.uniform(0.5, 0.6)
    Q = scenes_fronts.turn(rng.standard_normal(3), rng.uniform(0, np.pi))
    shear = scenes.rows(rng.uniform(0, 2 * np.pi))[0]
    return _penny_error(rng, n, a, Q, rng.uniform(-0.1, 0.1, 3), (-rng.uniform(0.2, 1), *shear))


def _penny_error(rng, n, a, Q, centre, stress):
    S = np.zeros((3, 3))
    S[2] = S[:, 2] = (stress[1], stress[2], stress[0])
    mesh = scenes_space.perturbed(n, int(rng.integers(1 << 30)), rng.uniform(0, 0.15))
    problem = xc.Problem(
        mesh, scenes_space.STEEL, [xc.penny_crack(centre, Q[2], a)],
        supports=[
            xc.displacement("boundary", lambda x: exact.penny((x - centre) @ Q.T, a, 1, 0.3, S) @ Q)
        ],
        order=1,
    )  # fmt: skip
    sif = scenes_fronts.K_along(problem)
    wanted = scenes_fronts.exact_K(sif.x, (centre, Q), a, None, stress)
    return _mean_square(sif.K_integral - wanted) / _mean_square(wanted)


def straight(rng, n):
    """Straight front from side to side under Williams' field of plane strain, askew to the mesh."""
    x, z, slope = rng.uniform(-0.2, 0.2), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
    mode = rng.uniform(-1.0, 1.0)
    K = np.array([np.cos(mode), np.sin(mode), 0.0])
    ahead = np.array([1.0, -slope, 0.0]) / np.hypot(1.0, slope)

    def moved(points):
        along = (points - [x, 0, z]) @ ahead
        u, _ = exact.williams(along, points[:, 2] - z, 1.0, 0.3, K[0], K[1])
        return u[:, :1] * ahead + u[:, 1:] * np.array([0.0, 0.0, 1.0])

    mesh = scenes_space.perturbed(n, int(rng.integers(1 << 30)), rng.uniform(0, 0.15))
    problem = xc.Problem(
        mesh, scenes_space.STEEL, [scenes_space.half_sheet(x, z, slope)],
        supports=[xc.displacement("boundary", moved)], contact="off", order=1,
    )  # fmt: skip
    sif = scenes_fronts.K_along(problem)
    return _mean_square((sif.K - K)[~sif.at_surface])


def _mean_square(K):
    return float(np.sqrt((K**2).sum(axis=1).mean()))


Draw = Callable[[np.random.Generator, int], float]
CLASSES: dict[str, dict[str, Draw]] = {
    "plane": {
        "edge crack": edge, "open": opened, "closed, sliding": closed, "half closed": half_closed,
    },
    "space": {"penny, open": penny, "penny, closed": pressed_penny, "straight front": straight},
}  # fmt: skip


def drawn(seed, where="plane", n=None):
    """Class of a seed and the error of its scene, or the words in which it was not solved.

    Returns
    -------
    name : str
    error : float, or None where it was not solved
    message : str
    """
    classes = CLASSES[where]
    name = list(classes)[seed % len(classes)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        try:
            error = classes[name](np.random.default_rng(seed), n or CELLS[where])
        except Exception as problem:  # whatever it is, it is a failure to be told
            return name, None, f"{type(problem).__name__}: {problem}"
    return name, error if np.isfinite(error) else None, ""


def judged(result):
    """Pass rate of `{seed: (name, error, message)}`: medians, worst ratios and failed seeds."""
    table, failed = {}, {}
    for name in dict.fromkeys(entry[0] for entry in result.values()):
        errors = {s: e for s, (kind, e, _) in result.items() if kind == name and e is not None}
        if not errors:
            continue
        median = float(np.median(list(errors.values())))
        worst = max(errors, key=lambda s: errors[s])
        table[name] = {
            "scenes": sum(entry[0] == name for entry in result.values()),
            "solved": len(errors), "median": median, "worst": errors[worst],
            "ratio": errors[worst] / median, "seed of the worst": worst,
            "beyond": sorted(s for s, e in errors.items() if e > MOST * median),
        }  # fmt: skip
        failed |= {s: f"{e / median:.2f} medians" for s, e in errors.items() if e > MOST * median}
    failed |= {s: messages or "not finite" for s, (_, e, messages) in result.items() if e is None}
    return {"classes": table, "failed": failed, "pass rate": 1 - len(failed) / len(result)}
