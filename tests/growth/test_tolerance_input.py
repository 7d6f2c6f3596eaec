"""What a tolerance cannot be given with, in 2D and 3D: a clear error, and no finished step lost."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc

STEEL = xc.Isotropic(210e3, 0.3)
LAW = xc.paris(C=1e-3, m=3.0)
RADIUS = 0.2

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def penny():
    """A penny of 0.3 in a block of 2."""
    pull = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    crack = xc.penny_crack((0.01, 0.013, 0.017), (0, 0, 1), 0.3)
    return xc.Problem(xc.box((-1.0,) * 3, (1.0,) * 3, 8), STEEL, [crack], loads=pull)


def steps(problem, **options):
    return xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), progress=False, **options)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -0.1, float("nan"), float("inf"), "1 %", 1e-300])
def test_tolerance_in_3d(tolerance):
    with pytest.raises(xc.ProblemError, match="grow: tolerance"):
        next(steps(penny(), tolerance=tolerance))


def test_max_unknowns_in_3d():
    """Refused before anything is solved."""
    match = r"max_unknowns = 1000, and the first mesh, .*, has \d+ at least: allow more"
    with pytest.raises(xc.ProblemError, match=match):
        next(steps(penny(), tolerance=0.1, max_unknowns=1000))


def wrong(kind, known):
    """A curve of the hole that is right for points that are there already."""
    old = {tuple(x) for x in np.round(known, 9).tolist()}

    def curve(x):
        new = np.array([tuple(p) not in old for p in np.round(x, 9).tolist()])
        right = RADIUS * x / np.linalg.norm(x, axis=1)[:, None]
        if not new.any():
            return right
        if kind == "raises":
            raise ValueError("no such curve")
        if kind == "shape":
            return right[:-1]
        return np.where(
            new[:, None], {"elsewhere": right + 1.0, "nan": np.nan * right}[kind], right
        )

    return curve


@pytest.mark.parametrize(
    ("kind", "error", "match"),
    [
        ("elsewhere", xc.MeshError, r"curves\['hole'\] takes the point .* away"),
        ("nan", xc.MeshError, r"curves\['hole'\].* = nan"),
        ("shape", xc.MeshError, r"curves\['hole'\] has the shape"),
        ("raises", ValueError, "no such curve"),
    ],
)
def test_curve_that_returns_points_elsewhere(kind, error, match):
    """Asked at once, where the first mesh is refined at the hole already."""
    body = xc.plate_with_hole(width=2, height=2, radius=RADIUS, size=0.25)
    body = replace(body, curves={"hole": wrong(kind, body.points)})
    crack = xc.line_crack([(0.15, 0.03), (0.3, 0.03)])
    pull = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    steel = xc.Isotropic(210e3, 0.3, plane="strain")
    problem = xc.Problem(body, steel, [crack], loads=pull)
    with pytest.raises(error, match=match):
        next(steps(problem, tolerance=1e-2))
