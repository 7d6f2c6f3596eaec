"""Growth under a spectrum: exactness, levels of K, block rates, named states, resuming."""

from dataclasses import fields

import numpy as np
import pytest

from support import exact
from support.growth_fakes import formula, mode_I, plate
from xcrack import (
    Cycle,
    Isotropic,
    Problem,
    ProblemError,
    Spectrum,
    XcrackWarning,
    box,
    collect,
    fix,
    grow,
    initial_stress,
    klesnil_lukas,
    line_crack,
    max_hoop_stress,
    newman_closure,
    paris,
    penny_crack,
    respond,
    resume,
    traction,
    walker,
    weighted_angle,
)

LAW = paris(1e-11, 3.0)
COARSE = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def scene(n=14, **options):
    """A plate in tension with an edge crack that is not straight."""
    mesh = box((0.0, -10.0), (20.0, 10.0), (n, n + 1))
    options = {"loads": tension(100.0), **options}
    return Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(0.0, 0.4), (4.0, 0.4), (6.0, 1.1)])],
        supports=[fix((20.0, -10.0)), fix((20.0, 10.0), axis=0)],
        **options,
    )


def tension(stress):
    return [traction("top", (0.0, stress)), traction("bottom", (0.0, -stress))]


def bending(stress):
    """Presses the mouth shut where it is positive."""

    def pull(x):
        return np.stack([0 * x[:, 0], stress * (x[:, 0] - 10.0) / 10.0], axis=1)

    return [traction("top", pull), traction("bottom", lambda x: -pull(x))]


def history(n, low=-0.3, seed=20263):
    factors = np.random.default_rng(seed).uniform(low, 1.0, n)
    factors[[3, 8]] = low, 1.0
    return factors


def first(cycle, problem=None, law=LAW, criterion=max_hoop_stress, **options):
    options = {"da": 1.5, "max_steps": 2, "progress": False, **options}
    return next(grow(problem or scene(), law, criterion, cycle, **options))


@COARSE
@pytest.mark.parametrize(("low", "high"), [(0.1, 1.0), (-0.5, 1.0), (0.0, 0.7)])
@pytest.mark.parametrize("criterion", [max_hoop_stress, weighted_angle])
def test_one_cycle_is_the_cycle_to_the_bit(low, high, criterion):
    options = {"da": 1.5, "max_steps": 3, "progress": False}
    one = list(grow(scene(), LAW, criterion, Cycle(low, high), **options))
    history = Spectrum([low, high, low, high][:2])
    other = list(grow(scene(), LAW, criterion, history, **options))
    assert len(one) == len(other) == 3
    for a, b in zip(one, other):
        assert a.cycles == b.cycles
        for part in ("angle", "dK_eq", "R", "rate", "da"):
            assert np.array_equal(getattr(a, part)[0], getattr(b, part)[0])
        assert all(np.array_equal(x[0].K, y[0].K) for x, y in zip(a.sif, b.sif))
    assert one[0].levels == ()
    assert other[0].levels == (low, high)


@COARSE
@pytest.mark.parametrize("contact", ["auto", "off"])
def test_scaled_histories_need_two_states(contact):
    """K at any factor against a solve of its own: round-off of the solver."""
    problem = scene(contact=contact)
    spectrum = Spectrum(history(300))
    step = first(spectrum, problem)
    assert step.levels == (-0.3, 1.0)
    for factor in (-0.2, -0.01, 0.03, 0.77):
        row = int(factor > 0)  # contact alone depends on the sign
        (solved,) = respond(problem, [factor]).sif
        wanted = factor / step.levels[row] * step.sif[row][0].K
        assert np.allclose(solved[0].K, wanted, rtol=1e-8, atol=1e-7)


@COARSE
def test_no_contact_needs_two_states_with_steady_loads_too():
    problem = scene(contact="off")
    steady = bending(40.0)
    two = first(Spectrum(history(300), steady=steady), problem)
    many = first(Spectrum(history(300), steady=steady, levels=9), problem)
    assert len(two.levels) == 2
    assert two.rate[0] == pytest.approx(many.rate[0], rel=1e-9)


@COARSE
def test_levels_refine_where_contact_bends_K():
    """Against 101 levels, which differ from 801 by a few millionths."""
    spectrum = Spectrum(history(2000), steady=bending(60.0))
    fine = first(Spectrum(history(2000), steady=bending(60.0), levels=101)).rate[0]
    step = first(spectrum)
    assert 5 < len(step.levels) <= 20
    assert step.rate[0] == pytest.approx(fine, rel=1e-3)
    assert min(np.diff(step.levels)) < 0.6 * max(np.diff(step.levels))  # at the knee
    stressed = scene(loads=[*tension(100.0), initial_stress([[0.0, 0.0], [0.0, -30.0]])])
    assert len(first(Spectrum(history(50)), stressed).levels) >= 5


@COARSE
@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("stress", [30.0, 60.0, 90.0])
def test_growth_of_a_block_is_that_of_801_levels(stress):
    """Promised: 0.1 % at no more than 20 levels."""
    steady, problem = bending(stress), scene(24)
    fine = first(Spectrum(history(2000), steady=steady, levels=801), problem)
    step = first(Spectrum(history(2000), steady=steady), problem)
    assert len(step.levels) <= 20
    assert step.rate[0] == pytest.approx(fine.rate[0], rel=1e-3)


@COARSE
def test_a_step_begins_with_the_levels_of_the_one_before():
    """One solve of many levels a step, but for the first; dropped where they do not matter."""
    rounds = []

    def counted(problem, states, reuse, bars):
        rounds.append(len(states))
        return respond(problem, states, reuse, bars)

    spectrum = Spectrum(history(500), steady=bending(60.0))
    options = {"da": 0.3, "max_steps": 3, "progress": False, "response": counted}
    steps = list(grow(scene(), LAW, max_hoop_stress, spectrum, **options))
    first = rounds.index(max(rounds))
    assert rounds[0] == 5
    assert len(rounds) - first <= 4  # two steps of one round, or two
    assert max(rounds) >= 9
    assert all(len(step.levels) <= 20 for step in steps)


@COARSE
def test_few_factors_are_solved_as_they_are():
    factors = [0.0, 1.0, 0.2, 0.7]
    step = first(Spectrum(factors, steady=bending(60.0)))
    assert step.levels == (0.0, 0.2, 0.7, 1.0)


def test_scaled_loads_add_up():
    """The whole state by a list of loads of half the size, and by a factor."""
    problem = scene(contact="off", loads=[*tension(100.0), *bending(30.0)])
    half = [*tension(50.0), *bending(15.0)]
    by_list = respond(problem, [half]).sif
    by_factor = respond(problem, [0.5]).sif
    assert np.allclose(by_list[0][0].K, by_factor[0][0].K, rtol=1e-11)


# --- blocks --------------------------------------------------------------------------------------

ROWS = [(0.0, 90.0, 10.0), (0.0, 80.0, 100.0), (0.0, 60.0, 1.0)]


def test_life_of_blocks():
    """Closed form with Δσ_eq = (Σ n Δσ^m / Σ n)^(1/m) = 80.869825; and its own worked number."""
    counts, stress = np.array([10, 100, 1]), np.array([90.0, 80.0, 60.0])
    equal = (counts @ stress**3 / counts.sum()) ** (1 / 3)
    assert equal == pytest.approx(80.869825, abs=5e-7)
    assert exact.paris_life(1e-3, 20e-3, 1e-11, 3.0, equal) / 111 == pytest.approx(
        15021.193, abs=1e-3
    )
    response = formula(mode_I(stress=1.0))
    steps = list(
        grow(
            plate(),
            LAW,
            max_hoop_stress,
            Spectrum(rows=ROWS),
            da=5.0,
            max_steps=9,
            response=response,
        )
    )
    assert len(steps) == 9
    for step in steps[1:]:
        N = exact.paris_life(5.0, 5.0 + 5.0 * step.index, 1e-11, 3.0, equal) / 111
        assert step.cycles == pytest.approx(N, rel=1e-9)


def test_eight_steps_of_block_rates_against_block_by_block():
    """With a threshold rates are no power of the length; promised: 0.2 %."""
    law = paris(1e-12, 3.0, threshold=klesnil_lukas(100.0, 0.0), approach=1.0)
    response = formula(mode_I(stress=1.0))
    spectrum = Spectrum(rows=ROWS)
    steps = list(
        grow(plate(), law, max_hoop_stress, spectrum, da=2.0, max_steps=9, response=response)
    )
    a, blocks = 5.0, 0
    while a < 5.0 + 2.0 * 8:
        a += sum(n * float(law(high * np.sqrt(np.pi * a), 0.0)) for _, high, n in ROWS)
        blocks += 1
    assert steps[-1].cycles == pytest.approx(blocks, rel=2e-3)


def test_the_stricter_threshold_acts_cycle_by_cycle():
    response = formula(mode_I(stress=1.0))
    root = np.sqrt(np.pi * 5.0)
    step = first(Spectrum(rows=ROWS), plate(), threshold=85.0 * root, response=response)
    assert step.rate[0] == pytest.approx(10 * LAW(90.0 * root, 0.0), rel=1e-12)
    assert step.dK_eq[0] == pytest.approx(90.0 * root, rel=1e-12)
    step = first(
        Spectrum(rows=ROWS), plate(), law=paris(1e-11, 3.0, K_c=85.0 * root), response=response
    )
    assert np.isinf(step.rate[0])


def test_ratio_of_each_cycle_is_seen():
    """Walker, one tip, by hand."""
    law, root = walker(1e-11, 3, 0.5), np.sqrt(np.pi * 5.0)
    response = formula(mode_I(stress=1.0))
    step = first(Spectrum([10.0, 100.0, 60.0, 80.0]), plate(), law=law, response=response)
    by_hand = law(90.0 * root, 0.1) + law(20.0 * root, 0.75)
    assert step.rate[0] == pytest.approx(by_hand, rel=1e-12)
    assert step.R[0] == pytest.approx(0.1, rel=1e-12)


def test_omitted_growth_warns():
    response = formula(mode_I(stress=1.0))
    rows = Spectrum(rows=ROWS)
    with pytest.warns(XcrackWarning, match=r"leaves out are 0.37% of the growth"):
        first(rows.omit(70.0), plate(), response=response)  # 60³ / (10 90³ + 100 80³)
    first(rows.omit(50.0), plate(), response=response)


def test_named_states():
    """States that are factors give what the factors give; K_II of one state turns the crack."""
    named = Spectrum(states=[0.0, 1.0, 0.4, 0.9], sequence=[0, 1, 2, 3, 2, 3])
    plain = Spectrum([0.0, 1.0, 0.4, 0.9, 0.4, 0.9])
    problem = scene(contact="off")
    one, other = first(named, problem), first(plain, problem)
    assert one.rate[0] == pytest.approx(other.rate[0], rel=1e-9)
    assert one.angle[0] == pytest.approx(other.angle[0], abs=1e-9)
    assert one.levels == ()
    shear = [traction("top", (40.0, 30.0)), traction("bottom", (-40.0, -30.0))]
    both = Spectrum(states=[0.0, 1.0, shear], sequence=[0, 1, 0, 2])
    alone = [first(Cycle(states=[0.0, state]), problem) for state in (1.0, shear)]
    rate = np.array([float(step.rate[0][0]) for step in alone])
    angle = np.array([float(step.angle[0][0]) for step in alone])
    step = first(both, problem)
    assert step.rate[0] == pytest.approx(rate.sum(), rel=1e-9)
    assert step.angle[0] == pytest.approx(
        np.arctan2(rate @ np.sin(angle), rate @ np.cos(angle)), abs=1e-12
    )


def test_a_cycle_that_looks_like_a_history_warns():
    response = formula(mode_I(stress=1.0))
    with pytest.warns(XcrackWarning, match="Spectrum"):
        first(Cycle(states=[0.0, 1.0, 0.4, 0.9]), plate(), response=response)
    first(Cycle(states=[0.0, 0.5, 1.0, 0.5]), plate(), response=response)


def test_negative_ratios_of_a_spectrum_need_a_choice():
    response = formula(mode_I())
    law = paris(1e-11, 3, closure=newman_closure(2.0, 0.3))
    with pytest.raises(ProblemError, match=r"R = -0\.3.*ratio"):
        first(Spectrum([-0.3, 1.0, 0.4, 0.5]), plate(), law=law, response=response)
    first(Spectrum([0.0, 1.0, 0.4, 0.5]), plate(), law=law, response=response)


@COARSE
def test_nominal_ratios_of_a_spectrum():
    """Without contact K is linear: the law sees R of the factors."""
    law = walker(1e-11, 3, 0.5, 0.2, ratio="nominal")
    step = first(Spectrum([-0.5, 1.0, 0.2, 0.8]), law=law)
    assert step.R[0] == pytest.approx(-0.5, abs=1e-9)
    K = float(step.dK_eq[0][0]) / 1.5
    assert step.rate[0] == pytest.approx(law(1.5 * K, -0.5) + law(0.6 * K, 0.25), rel=1e-6)


@COARSE
def test_a_run_is_resumed_to_the_bit(tmp_path):
    arguments = (scene(), LAW, weighted_angle, Spectrum(history(200), steady=bending(60.0)))
    options = {"da": 1.0, "progress": False}
    whole = collect(grow(*arguments, **options, max_steps=4), path=tmp_path / "whole")
    collect(grow(*arguments, **options, max_steps=2), path=tmp_path / "part")
    rest = resume(tmp_path / "part", *arguments, **options, max_steps=4)
    assert len(rest.steps) == len(whole.steps) == 4
    for a, b in zip(whole.steps, rest.steps):
        assert a.levels == b.levels
        assert all(
            np.array_equal(getattr(a, f.name)[0], getattr(b, f.name)[0])
            for f in fields(a)
            if f.name in ("angle", "rate", "da")
        )
    assert whole.life == rest.life
    columns = rest.table()
    assert np.isfinite(columns["K_I_0"]).all()
    other = Spectrum(history(200, seed=20264), steady=bending(60.0))
    with pytest.raises(ProblemError, match=r"cycle\.factors"):
        resume(tmp_path / "part", *arguments[:3], other, **options)


@pytest.mark.slow
@pytest.mark.mission
@COARSE
def test_a_front_in_3D():
    """A disc: each place has the growth of its own cycles, by hand from its own K."""
    mesh = box((-4.0, -4.0, -4.0), (4.0, 4.0, 4.0), (9, 9, 9))
    problem = Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3),
        cracks=[penny_crack((0.1, 0.0, 0.05), (0, 0, 1), 2.0)],
        loads=[traction("top", (0, 0, 100.0)), traction("bottom", (0, 0, -100.0))],
        order=1,
    )
    law = walker(1e-11, 3, 0.5)
    step = first(Spectrum([0.0, 1.0, 0.4, 0.9]), problem, law=law)
    single = first(Cycle(0.0, 1.0), problem, law=law)
    share = (law(1.0, 0.0) + law(0.5, 4 / 9)) / law.C
    assert np.allclose(step.rate[0], single.rate[0] * share, rtol=1e-9)
    assert np.allclose(step.angle[0], single.angle[0], atol=1e-12)
