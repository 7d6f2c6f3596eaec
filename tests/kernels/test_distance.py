"""The nearest vertex of a polyline, against a search tree."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from xcrack.mesh.kernels.location import nearest_vertices


def _curve(kind, count):
    t = np.linspace(0, 1, count)[:, None]
    turn = 2 * np.pi * t
    if kind == "closed":  # the last vertex repeats the first
        return np.hstack([np.cos(turn), np.sin(turn), 0 * t])
    if kind == "helix":  # turns that nearly touch
        return np.hstack([np.cos(7 * turn), np.sin(7 * turn), 0.2 * t])
    if kind == "hairpin":
        return np.hstack([np.abs(t - 0.5), 0.01 * t, 0 * t])
    if kind == "crowded":  # sides of very different lengths, one of length zero
        return np.vstack([t**6, t[-1:] ** 6]) * np.ones(3)
    return np.hstack([t, 0 * t, 0 * t])


@pytest.mark.parametrize("kind", ["straight", "closed", "helix", "hairpin", "crowded"])
@pytest.mark.parametrize("count", [2, 3, 41, 401])
def test_nearest(kind, count):
    """Distances are those of the tree to the last bit but round-off; in any order of points."""
    rng = np.random.default_rng(3109)
    vertices = _curve(kind, count)
    x = rng.normal(scale=1.2, size=(800, 3))
    x[:50] = vertices[rng.integers(0, len(vertices), 50)]  # on the curve
    x[50:90] = 0.0  # in the middle of the circle, where all vertices are as far
    wanted, nearest = cKDTree(vertices).query(x)
    for bound in (np.inf, 0.7):
        number, distance = nearest_vertices(x, vertices, bound)
        within = wanted < bound
        assert (number >= 0).tolist() == within.tolist()
        assert np.isinf(distance[~within]).all()
        assert distance[within] == pytest.approx(wanted[within], rel=1e-14, abs=1e-15)
        apart = np.linalg.norm(x[within] - vertices[number[within]], axis=1)
        assert apart == pytest.approx(distance[within], rel=1e-14, abs=1e-15)
    clear = np.linalg.norm(x[:, None] - vertices, axis=2)
    clear = np.diff(np.sort(clear, axis=1)[:, :2], axis=1)[:, 0] > 1e-9
    assert (nearest_vertices(x, vertices, np.inf)[0][clear] == nearest[clear]).all()


def test_nearest_of_nothing():
    """No points give nothing; a point that is no number has no vertex."""
    vertices = _curve("closed", 9)
    number, distance = nearest_vertices(np.empty((0, 3)), vertices, np.inf)
    assert len(number) == len(distance) == 0
    number, distance = nearest_vertices(np.full((1, 3), np.nan), vertices, np.inf)
    assert number[0] == -1
    assert distance[0] == np.inf
