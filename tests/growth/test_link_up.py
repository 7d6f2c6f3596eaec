"""Plastic zones that fill the ligament between tips, or up to a side, a hole or a crack."""

import numpy as np
import pytest

import xcrack as xc
from support.growth_fakes import STRESS, formula, mode_I, plate

LAW = xc.paris(C=1e-12, m=3.0)
CYCLE = xc.Cycle(0.0, 1.0)
SIGMA_Y = 200.0


def run(problem, **options):
    settings = {"da": 0.5, "progress": False, "link_up": xc.plastic_zone(SIGMA_Y, beta=2)}
    return xc.collect(
        xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, **settings | options),
        keep_solutions=False,
    )


def two(gap=8.0):
    """An edge crack of length 5 and a crack of length 6 beyond a ligament."""
    lines = [[(0.0, 0.37), (5.0, 0.37)], [(5.0 + gap, 0.37), (11.0 + gap, 0.37)]]
    return plate([xc.line_crack(line) for line in lines])


def test_two_tips_link_up_by_the_formula_of_swift():
    """σ_link = σ_y √(2 L / (a β_a² + b β_b²)): Swift's criterion solved for the stress.

    Here K = σ √(π a) for the whole length a of each crack: β = 1.
    """
    response = formula(mode_I())
    history = run(two(), response=response)
    assert history.ended.startswith("ligament yield: the plastic zones of crack 1, tip 0 at (")
    assert "of crack 0, tip 0 at (" in history.ended
    assert "between them" in history.ended
    strength = []
    for step in history.steps:
        x = [sif.x for sif in step.sif[1]]
        a, b = x[0][0, 0], x[1][1, 0] - x[1][0, 0]
        L = x[1][0, 0] - x[0][0, 0]
        strength.append(SIGMA_Y * np.sqrt(2 * L / (a + b)))
    assert min(strength[:-1]) > STRESS >= strength[-1]


@pytest.mark.slow
@pytest.mark.mission
def test_without_zones_the_same_run_goes_on():
    response = formula(mode_I())
    with_zone, without = run(two(), response=response), run(two(), link_up=None, response=response)
    assert with_zone.ended.startswith("ligament yield")
    assert len(without.steps) >= len(with_zone.steps)
    assert not without.ended.startswith("ligament yield")


def test_one_tip_and_the_side():
    """The zone (K/σ_y)²/2π = a (σ/σ_y)²/2 reaches the side where a (1 + 1/8) = 60."""
    response = formula(mode_I())
    history = run(plate(), da=4.0, response=response)
    a = [step.sif[1][0].x[0, 0] for step in history.steps]
    assert a[-2] < 60 / (1 + 1 / 8) <= a[-1]
    zone = a[-1] / 8
    assert history.ended.startswith("ligament yield: the plastic zone of crack 0, tip 0 at (")
    assert history.ended.endswith(f", {zone:.4g}, fills the {60 - a[-1]:.4g} to 'right'")


def test_one_tip_and_the_flank_of_another_crack():
    across = xc.line_crack([(25.3, -8.0), (25.3, 9.0)])
    response = formula(mode_I(stress=10.0))
    first = xc.line_crack([(0.0, 0.37), (20.0, 0.37)])
    history = run(plate([first, across]), link_up=lambda K: 0.01 * K, response=response)
    assert " to crack 1" in history.ended or " to crack 0" in history.ended


def test_tips_that_have_passed_each_other_do_not_link_up():
    lines = [[(0.0, 3.37), (30.0, 3.37)], [(20.0, -3.37), (60.0, -3.37)]]
    response = formula(mode_I(stress=10.0))
    cracks = [xc.line_crack(line) for line in lines]
    history = run(plate(cracks), link_up=lambda K: 0.0 * K + 12.5, max_steps=1, response=response)
    assert history.ended.startswith("max_steps")


@pytest.mark.filterwarnings("ignore:K at")
def test_on_real_K_two_collinear_cracks_end_before_they_meet():
    mesh = xc.box((0, 0), (12, 6), (36, 18))
    lines = [[(-0.1, 3.03), (3.0, 3.03)], [(9.0, 3.03), (12.1, 3.03)]]
    pull = [xc.traction("top", (0, 100.0)), xc.traction("bottom", (0, -100.0))]
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E=70e3, nu=0.3, plane="stress"),
        [xc.line_crack(line) for line in lines],
        loads=pull,
        order=1,
    )
    history = run(problem, da=0.8, link_up=xc.plastic_zone(345.0, beta=2))
    last = history.steps[-1].sif[-1]
    # By K_eq, which differs from K_I by the little K_II that the mesh makes.
    zones = sum((K_eq[0] / 345.0) ** 2 / (2 * np.pi) for K_eq in history.steps[-1].dK_eq)
    left = float(np.linalg.norm(last[1].x[0] - last[0].x[0]))
    assert left <= zones <= left * (1 + 3e-4)
    assert history.ended.startswith("ligament yield")


@pytest.mark.parametrize("wrong", [345.0, "swift"])
def test_what_is_no_function_is_refused(wrong):
    with pytest.raises(xc.ProblemError, match=r"link_up = .*: give plastic_zone"):
        run(two(), link_up=wrong)


def test_wrong_zones_are_named():
    response = formula(mode_I())
    with pytest.raises(xc.ProblemError, match="what link_up returned"):
        run(two(), link_up=lambda K: np.append(K, np.nan), response=response)


def test_a_3D_body_is_refused():
    mesh = xc.box((0, 0, 0), (1, 1, 1), 4)
    crack = xc.penny_crack((0.5, 0.5, 0.47), (0, 0, 1), 0.3)
    problem = xc.Problem(mesh, xc.Isotropic(E=1e3, nu=0.3), [crack])
    with pytest.raises(xc.ProblemError, match="in a sheet"):
        run(problem)
