"""Loads that follow the crack during a run: constant K, K-gradients, shedding, over cycles."""

import numpy as np
import pytest

import xcrack as xc
from support.rows import mission
from support.strips import STRESS, by_formula, strip

C, M, R = 1e-12, 3.0, 0.1
LAW, CYCLE = xc.paris(C, M), xc.Cycle(R, 1.0)
ROUND_OFF = 1e-8  # K_II that a mesh has turns the path a little


def run(program, problem=None, law=LAW, cycle=CYCLE, path=None, **options):
    options = {"da": 1.0, "max_size": 14.0, "progress": False} | options
    steps = xc.grow(
        problem or strip(), law, xc.max_hoop_stress, cycle, load_program=program, **options
    )
    return xc.collect(steps, path)


def lengths(history):
    return np.array([step.cracks[0].points[-1, 0] for step in history.solved])


def cycles(history):
    return np.array([step.cycles for step in history.solved])


@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_constant_K_is_a_straight_line(integrator):
    """With K solved, on a mesh: to round-off, whatever the mesh says K is."""
    history = run(xc.K_gradient(300.0), integrator=integrator)
    a = lengths(history)
    exact = (a - a[0]) / (C * ((1 - R) * 300.0) ** M)
    np.testing.assert_allclose(cycles(history), exact, rtol=ROUND_OFF)
    for step in history.solved:
        assert step.dK_eq[0][0] == pytest.approx((1 - R) * 300.0, rel=1e-6)  # K_II of the mesh
        assert step.solutions[-1].factor == pytest.approx(step.load_factor, rel=1e-15)
        again = xc.stress_intensity(step.solutions[-1]).K
        np.testing.assert_allclose(again, step.sif[-1][0].K, rtol=1e-9, atol=1e-9 * 300.0)
    factor = [step.load_factor for step in history.solved]
    assert (np.diff(factor) < 0).all()
    assert history.table()["load_factor"] == pytest.approx(factor)


def test_a_K_gradient_converges_to_its_closed_form():
    """ASTM E647: K = K0 exp(g (a - a0)), here as a threshold is approached; discretisation."""
    g, errors = -0.08, []
    for da in (2.0, 1.0, 0.5):
        history = run(xc.K_gradient(300.0, g, a0=6.0), da=da, response=by_formula)
        exact = (1 - np.exp(-M * g * 8.0)) / (M * g * C * ((1 - R) * 300.0) ** M)
        errors.append(abs(history.life / exact - 1))
        K = [step.sif[-1][0].K_I[0] for step in history.solved]
        np.testing.assert_allclose(K, 300.0 * np.exp(g * (lengths(history) - 6.0)), rtol=ROUND_OFF)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] < 2e-3
    assert (rates > 1.8).all(), errors


def test_loads_that_fall_as_the_root_of_the_length_are_constant_K():
    history = run(xc.load_over_size(lambda a: np.sqrt(6.0 / a)), response=by_formula)
    K = STRESS * np.sqrt(np.pi * 6.0)
    exact = (lengths(history) - 6.0) / (C * ((1 - R) * K) ** M)
    np.testing.assert_allclose(cycles(history), exact, rtol=ROUND_OFF)
    same = run(xc.K_over_size([(0.0, K), (1e3, K)]), response=by_formula)
    np.testing.assert_allclose(cycles(same), exact, rtol=ROUND_OFF)


@pytest.mark.slow
@pytest.mark.mission
def test_loads_over_cycles_converge_to_the_exact_length():
    """K = S (1 + N/N0) √(π a), so that 2 (a0^-½ - a^-½) is an integral over N; discretisation."""
    N0, errors = 2e5, []
    for da in (1.0, 0.5):
        history = run(xc.load_over_cycles(lambda N: 1 + N / N0), da=da, response=by_formula)
        growth = 2 * (6.0**-0.5 - 14.0**-0.5) / (C * ((1 - R) * STRESS * np.sqrt(np.pi)) ** M)
        exact = N0 * ((1 + 4 * growth / N0) ** 0.25 - 1)
        errors.append(abs(history.life / exact - 1))
    assert errors[0] < 2e-3
    assert errors[1] < 5e-4


def test_a_spectrum_follows_the_crack_too():
    spectrum = xc.Spectrum([0.0, 1.0, 0.3, 0.8], unit="flight")
    history = run(xc.K_gradient(400.0), cycle=spectrum, response=by_formula)
    block = C * 400.0**M * (1.0 + 0.5**M)
    assert history.life == pytest.approx(8.0 / block, rel=ROUND_OFF)


@pytest.mark.parametrize(
    "program",
    [xc.K_gradient(300.0, -0.02, 6.0), *mission(xc.load_over_cycles([(0.0, 1.0), (3e5, 2.0)]))],
)
def test_a_run_that_is_resumed_is_the_whole_one(program, tmp_path):
    """To the last bit; and with other loads it is refused."""
    whole = run(program, path=tmp_path / "whole")
    run(program, path=tmp_path / "part", max_steps=4)
    args = (strip(), LAW, xc.max_hoop_stress, CYCLE)
    options = {"da": 1.0, "max_size": 14.0, "progress": False}
    again = xc.resume(tmp_path / "part", *args, load_program=program, **options)
    assert [s.cycles for s in again.steps] == [s.cycles for s in whole.steps]
    assert [s.load_factor for s in again.steps] == [s.load_factor for s in whole.steps]
    with pytest.raises(xc.ProblemError, match="load_program"):
        xc.resume(tmp_path / "part", *args, load_program=xc.K_gradient(200.0), **options)


def test_steady_loads_take_factors_but_no_K():
    """K of a scene with residual stress is no multiple of the loads: a factor is solved."""
    rolled = xc.initial_stress([[0.0, 0.0], [0.0, 20.0]])
    problem = strip(loads=[*strip().loads, rolled])
    with pytest.raises(xc.ProblemError, match="does not scale with the loads"):
        run(xc.K_gradient(300.0), problem)
    with pytest.raises(xc.ProblemError, match="friction does not scale"):
        run(xc.K_gradient(300.0), strip(friction=0.3))
    with pytest.raises(xc.ProblemError, match="give Cycle"):
        run(xc.K_gradient(300.0), cycle=xc.Cycle(states=[strip().loads]))
    half = run(xc.load_over_size(lambda a: 0.5 + 0 * a), problem, max_steps=1)
    scaled = run(None, problem, cycle=xc.Cycle(R / 2, 0.5), max_steps=1)
    np.testing.assert_array_equal(half.solved[0].sif[1][0].K, scaled.solved[0].sif[1][0].K)


@pytest.mark.parametrize(
    ("program", "says"),
    [
        (xc.load_over_size(lambda a: -a), "not positive at a = 6"),
        (xc.load_over_cycles(lambda N: N), "not positive at N = 0"),
        (xc.K_over_size(lambda a: np.ones(3)), "one value for each"),
    ],
)
def test_programs_that_do_not_fit_are_refused_in_words(program, says):
    with pytest.raises(xc.ProblemError, match=says):
        run(program, response=by_formula)
    with pytest.raises(xc.ProblemError, match="load_program"):
        run(3.0)


def test_lives_by_another_law_follow_loads_over_sizes_not_cycles():
    shed = run(xc.K_gradient(300.0), response=by_formula)
    other = shed.rerate(xc.paris(2 * C, M))
    assert other.life == pytest.approx(shed.life / 2, rel=ROUND_OFF)
    again = run(None, response=by_formula).rerate(LAW, K_max=xc.K_gradient(300.0))
    assert again.life == pytest.approx(shed.life, rel=ROUND_OFF)
    timed = run(xc.load_over_cycles(lambda N: 1 + N / 1e6), response=by_formula)
    with pytest.raises(xc.ProblemError, match="change with the cycles"):
        timed.rerate(xc.paris(2 * C, M))


@pytest.mark.slow
def test_fronts_grow_at_constant_K():
    """The largest K along the front is the one that was asked for, and so is the largest rate."""
    mesh = xc.box((0, -4, 0), (4, 4, 1), (13, 26, 4))
    loads = [xc.traction("back", (0, 140.0, 0)), xc.traction("front", (0, -140.0, 0))]
    front = [(-0.1, 0.11, -0.1), (1, 0.11, -0.1), (1, 0.11, 1.1), (-0.1, 0.11, 1.1)]
    problem = xc.Problem(mesh, xc.Isotropic(210e3, 0.3), [xc.plane_crack(front)], loads=loads)
    history = run(xc.K_gradient(300.0), problem, da=0.4, max_size=2.0)
    for step in history.solved:
        assert np.linalg.norm(step.sif[1][0].K, axis=1).max() == pytest.approx(300.0, rel=0.01)
    rate = C * ((1 - R) * 300.0) ** M
    per_cycle = [step.rate[0].max() for step in history.solved]
    np.testing.assert_allclose(per_cycle, rate, rtol=0.02)  # K_eq by the criterion's direction
