"""A strip with an edge crack under tension, and its K by a formula."""

import numpy as np

import xcrack as xc

STRESS = 60.0


def strip(**choices):
    """Pulled by STRESS; the crack begins at the left side and is 6 long."""
    mesh = xc.box((0.0, -30.0), (40.0, 30.0), (20, 31))
    pull = [xc.traction("top", (0.0, STRESS)), xc.traction("bottom", (0.0, -STRESS))]
    crack = xc.line_crack([(-1.0, 0.0), (6.0, 0.0)])
    given = {"loads": pull} | choices
    return xc.Problem(mesh, xc.Isotropic(210e3, 0.3, "strain"), [crack], **given)


def by_formula(problem, states, reuse, bars):
    """K of a small crack in a large body, as a response of `grow`."""
    K = STRESS * np.sqrt(np.pi * problem.stations.x[:, 0])
    return xc.Response.of_K(problem, states, [float(s) * np.stack([K, 0 * K], 1) for s in states])
