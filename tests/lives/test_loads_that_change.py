"""Loads that change as the crack grows, and growth at K = K_c: exact integrals and energy."""

import numpy as np
import pytest

import xcrack as xc
from support.strips import STRESS, by_formula, strip

ROUND_OFF = 1e-10
C, M, R = 1e-12, 3.0, 0.1
LAW = xc.paris(C, M)


def grown(da, count, **choices):
    steps = xc.grow(strip(), LAW, xc.max_hoop_stress, xc.Cycle(R, 1.0), da=da, max_steps=count + 1,
                    progress=False, **choices)  # fmt: skip
    return xc.collect(steps)


@pytest.fixture(scope="module")
def formula():
    return grown(1.0, 8, response=by_formula)


def lengths(history):
    return np.array([step.cracks[0].points[-1, 0] for step in history.steps])


def test_constant_K_grows_by_the_same_length_in_the_same_cycles(formula):
    a = lengths(formula)
    shed = formula.rerate(LAW, K_max=lambda size: 0.0 * size + 300.0)
    exact = (a - a[0]) / (C * ((1 - R) * 300.0) ** M)
    np.testing.assert_allclose(shed.cycles, exact, rtol=ROUND_OFF)
    np.testing.assert_allclose(shed.factor, 300.0 / (STRESS * np.sqrt(np.pi * a)), rtol=ROUND_OFF)


def test_a_force_that_falls_as_the_root_of_the_length_is_constant_K(formula):
    """Sizes that a function gets are lengths in the body: those of the crack, from the side on."""
    a = lengths(formula)
    shed = formula.rerate(LAW, load=lambda size: np.sqrt(6.0 / size))
    K = STRESS * np.sqrt(np.pi * 6.0)
    np.testing.assert_allclose(shed.cycles, (a - a[0]) / (C * ((1 - R) * K) ** M), rtol=1e-9)


def test_a_K_gradient_converges_to_its_exact_life_with_the_square_of_the_step():
    """ASTM E647: K = K0 exp(theta (a - a0)); the integral of its power law is closed."""
    K0, theta, errors = 250.0, 0.08, []
    for da in (2.0, 1.0, 0.5):
        history = grown(da, round(8.0 / da), response=by_formula)
        a = lengths(history)
        risen = history.rerate(LAW, K_max=lambda size: K0 * np.exp(theta * (size - 6.0)))
        exact = (1 - np.exp(-M * theta * (a[-1] - a[0]))) / (M * theta * C * ((1 - R) * K0) ** M)
        errors.append(abs(risen.life / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 2e-3  # discretisation
    assert ((rates > 1.8) & (rates < 2.2)).all(), rates


def test_twice_the_load_is_the_law_at_twice_the_range(formula):
    double = formula.rerate(LAW, load=lambda size: 0.0 * size + 2.0)
    other = formula.rerate(xc.paris(C * 2.0**M, M))
    np.testing.assert_allclose(double.cycles, other.cycles, rtol=ROUND_OFF)
    assert np.ptp(double.factor) == 0
    assert (other.factor == 1).all()


def test_a_spectrum_follows_the_crack_too():
    spectrum = xc.Spectrum([0.0, 1.0, 0.3, 0.8], unit="flight")
    steps = xc.grow(strip(), LAW, xc.max_hoop_stress, spectrum, da=1.0, max_steps=5, progress=False)
    history = xc.collect(steps)
    given = {"spectrum": spectrum, "criterion": xc.max_hoop_stress, "nu": 0.3}
    shed = history.rerate(LAW, K_max=lambda size: 0.0 * size + 400.0, **given)
    block = 2 * C * 400.0**M * (1.0 + 0.5**M) / 2
    assert shed.life == pytest.approx((lengths(history)[-1] - 6.0) / block, rel=0.02)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_loads_that_K_does_not_follow_are_refused_in_words():
    rolled = xc.initial_stress([[0.0, 0.0], [0.0, 20.0]])
    problem = strip(loads=[*strip().loads, rolled])
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=2.0, max_steps=3,
                    progress=False)  # fmt: skip
    history = xc.collect(steps)
    with pytest.raises(xc.ProblemError, match="does not scale with the loads"):
        history.rerate(LAW, K_max=lambda size: 0.0 * size + 300.0)
    with pytest.raises(xc.ProblemError, match="does not scale with the loads"):
        history.load_at(1000.0)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"load": lambda a: 1.0 + 0 * a, "K_max": lambda a: 1.0 + 0 * a}, "not both"),
        ({"load": 3.0}, "cannot be called"),
        ({"load": lambda a: -a}, "not positive"),
        ({"load": lambda a: a[:2]}, "one value for each"),
        ({"K_max": lambda a: np.nan * a}, "must be finite"),
    ],
)
def test_programs_that_do_not_fit_are_refused_in_words(formula, given, says):
    with pytest.raises(xc.ProblemError, match=says):
        formula.rerate(LAW, **given)


def test_force_and_displacement_at_K_c_release_the_energy_that_K_c_says():
    """F² dC/da / 2 = K_c² / E' between the steps (Irwin and Kies, 1954)."""
    top = xc.displacement("top", (0.0, 0.01))
    mesh = xc.box((0.0, -30.0), (40.0, 30.0), (20, 31))
    steel = xc.Isotropic(210e3, 0.3, "strain")
    problem = xc.Problem(mesh, steel, [xc.line_crack([(-1.0, 0.0), (8.0, 0.0)])],
                         supports=[xc.fix("bottom"), top])  # fmt: skip
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=1.0, max_steps=6,
                    progress=False)  # fmt: skip
    history = xc.collect(steps)
    table = history.load_at(1000.0)
    compliance = table["displacement"] / table["force"]
    middle = 0.5 * (table["force"][1:] + table["force"][:-1])
    released = 0.5 * middle**2 * np.diff(compliance) / np.diff(table["a"])
    np.testing.assert_allclose(released, 1000.0**2 / steel.E_prime, rtol=0.01)  # discretisation
    np.testing.assert_allclose(table["displacement"], 0.01 * table["factor"], rtol=1e-6)
    assert (np.diff(table["a"]) > 0.9).all()
    np.testing.assert_allclose(history.load_at(500.0)["force"], table["force"] / 2, rtol=ROUND_OFF)


def test_a_stored_run_has_no_forces_and_says_so(formula, tmp_path):
    with pytest.raises(xc.ProblemError, match="have no solutions"):
        formula.load_at(1000.0)
    with pytest.raises(xc.ProblemError, match="K_c"):
        formula.load_at(-1.0)
