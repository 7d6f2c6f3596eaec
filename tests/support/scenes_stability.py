"""Scenes where crack methods fail, shared by the stability tests and benchmarks/stability.py."""

import numpy as np

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.scenes_2d import numerics_of
from xcrack.analysis.solve import build

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))

ENRICHMENTS = {
    "geometric": {"radius": 0.3},
    "topological": {"enrichment": "topological"},
    "two functions": {"radius": 0.3, "functions": 2},
}
BASES = {
    "none": {"orthonormal": "none"},
    "node": {"orthonormal": "node"},
    "star": {"orthonormal": "star"},
    "star and patch": {"orthonormal": "star", "patch": True},
}


def cut_condition(eps, enrichment, basis, n=20):
    """Condition number for a crack eps cells above a row of nodes, order 2."""
    y = eps * 2 / n
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, 1.0, 0.6), (0.037, y))
    problem = scenes.on_box(
        xc.box((-1, -1), (1, 1), n), [xc.line_crack([(-1.2, y), (0.037, y)])], field,
        traction=("left",), contact="off", numerics=numerics_of(**enrichment, **basis),
    )  # fmt: skip
    return scenes.condition(problem)


def _arc(R, degrees, n, pieces=300, **options):
    """Arc of radius R and the given whole angle in [-1.2, 1.2]², biaxial pull; its exact field."""
    alpha = np.radians(degrees) / 2
    arc = exact.ArcCrack(R, alpha, 1.0, 0.3, 1.0, 1.0, 0.0)
    theta = alpha * np.sin(np.pi / 2 * np.linspace(-1, 1, pieces + 1))
    crack = xc.line_crack(R * np.stack([np.cos(theta), np.sin(theta)], axis=1))
    problem = xc.Problem(
        scenes.perturbed(n, 19, 0.15, (-1.2, -1.2), (1.2, 1.2)), STEEL, [crack],
        supports=scenes.imposed(scenes.turned(arc.field, (0.0, 0.0)), scenes.SIDES),
        contact="off", **options,
    )  # fmt: skip
    return problem, arc


def arc_error(*args, **options):
    """Error of K at both tips of an arc over the largest."""
    problem, arc = _arc(*args, **options)
    wanted = np.array([arc.K_lower, arc.K_upper]) * [[1, -1], [1, 1]]
    return float(np.abs(scenes.K_of(problem) - wanted).max() / np.abs(wanted).max())


def arc_length(R, degrees, n, **options):
    """Length of an arc that the mesh is cut along, over its own."""
    problem, _ = _arc(R, degrees, n, **options)
    return float(build(problem).lips[0].weight.sum() / (R * np.radians(degrees)))


def beside_an_edge(cells, n, h):
    """K_I at the tip that is `cells` of length h away from a free edge."""
    crack = xc.line_crack([(-0.3, 0.0213), (1 - cells * h, 0.0213)])
    mesh = scenes.perturbed(n, 9)
    problem = xc.Problem(mesh, STEEL, [crack], loads=PULL)
    return float(scenes.K_of(problem)[1, 0])
