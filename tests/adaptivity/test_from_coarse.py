"""From meshes coarser than a crack: what solve refuses, adapt and grow refine first.

References: an inclined crack in an infinite body (a / W = 1 / 60: 1e-3), a short edge crack.
"""

import math

import numpy as np
import pytest

import xcrack as xc

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]


def plate(*lines, n=6):
    """A square of 50 of cells of 12."""
    cracks = [xc.line_crack(line) for line in lines]
    return xc.Problem(xc.box((0, 0), (50, 50), n), STEEL, cracks, loads=PULL)


INNER = [(20.3, 20.1), (21.0, 20.5)]


def test_a_crack_within_a_cell():
    problem = plate(INNER)
    assert problem.mesh.cell_size.min() > 10
    with pytest.raises(xc.GeometryError, match=r"length 0\.80.*less than the cell.*adapt does"):
        xc.solve(problem)
    adapted = xc.adapt(problem, 1e-3, progress=False)
    assert adapted.met
    assert len(adapted.problem.mesh.cells) < 3000
    length, angle = math.hypot(0.7, 0.4), math.atan2(0.4, 0.7)
    K = math.sqrt(math.pi * length / 2) * math.cos(angle)
    expected = K * np.array([math.cos(angle), math.sin(angle)])
    assert np.abs(np.abs(adapted.sif.best) - expected).max() <= 2.5e-3 * K  # 1e-3 of the tolerance


def test_two_tips_of_two_cracks_within_a_cell():
    """Collinear cracks of length 1 and a gap of .5: K by elliptic integrals (Tada et al.)."""
    adapted = xc.adapt(
        plate([(20.3, 20.1), (21.3, 20.1)], [(21.8, 20.1), (22.8, 20.1)]), 1e-3, progress=False
    )
    assert adapted.met
    outer, inner = 1.25, 0.25  # half distances of the tips from the middle
    k = math.sqrt(1 - (inner / outer) ** 2)
    E_over_K = exact_ratio(k)
    K_inner = (
        math.sqrt(math.pi * inner)
        * (outer**2 / inner**2 * E_over_K - 1)
        / math.sqrt(outer**2 / inner**2 - 1)
    )
    K_outer = math.sqrt(math.pi * outer) * (1 - E_over_K) / k
    best = np.concatenate([sif.best[:, 0] for sif in adapted.sifs[0]])
    expected = [K_outer, K_inner, K_inner, K_outer]
    assert np.abs(best - expected).max() <= 3e-3 * K_inner


def exact_ratio(k):
    """E / K of complete elliptic integrals by the arithmetic-geometric mean."""
    a, b, c, n, total = 1.0, math.sqrt(1 - k * k), k, 0, 0.0
    while abs(c) > 1e-15:
        total += 2 ** (n - 1) * c * c
        a, b, c, n = (a + b) / 2, math.sqrt(a * b), (a - b) / 2, n + 1
    return 1 - total


def test_an_end_half_a_cell_from_the_boundary_is_a_tip():
    """On this mesh it counts as a mouth, with an error or a warning; the crack is an edge crack."""
    adapted = xc.adapt(plate([(-1.0, 20.1), (1.0, 20.1)]), 2e-3, progress=False)
    assert adapted.met
    assert adapted.sif.best.shape == (1, 2)
    f = 1.1222 - 0.231 / 50 + 10.55 / 50**2  # edge crack in a strip (Gross and Srawley, .5 %)
    assert adapted.sif.best[0, 0] == pytest.approx(f * math.sqrt(math.pi), rel=7e-3)


def test_what_no_mesh_can_hold_is_refused():
    """Two cracks that cross do so in any mesh."""
    problem = plate([(20, 20), (21, 21)], [(20, 21), (21, 20)])
    with pytest.raises(xc.GeometryError, match="cross near"):
        xc.adapt(problem, 1e-2, progress=False)


def test_what_looks_at_a_scene_shows_it_as_given():
    text = plate(INNER)._repr_html_()
    assert "<svg" in text


def test_growth_from_a_crack_within_a_cell():
    """Paris, m = 3, of a centre crack in an infinite plate: exact life between two lengths."""
    problem = plate([(20.3, 20.1), (21.0, 20.1)])
    steps = xc.grow(
        problem, xc.paris(1e-3, 3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), tolerance=5e-2,
        progress=False,
    )  # fmt: skip
    history = xc.collect(steps, until=lambda step: step.index == 3)
    step = history.steps[-1]
    half = np.ptp(step.cracks[0].points[:, 0]) / 2
    life = 2 / (1e-3 * math.pi**1.5) * (0.35**-0.5 - half**-0.5)
    assert half > 0.5
    assert step.cycles == pytest.approx(life, rel=2e-2)
