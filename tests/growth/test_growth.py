"""The growth loop with K from formulas: lives, shares of the tips, stop rules, bad input."""

import numpy as np
import pytest
from scipy.integrate import quad

from support import exact
from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    ProblemError,
    elber,
    grow,
    line_crack,
    max_hoop_stress,
    measures,
    paris,
    traction,
    weighted_angle,
)

LAW = paris(C=1e-11, m=3.0)
CYCLE = Cycle(0.0, 1.0)


def tips_of(crack):
    """Places of its tips (t, 2)."""
    return crack.points[list(crack.tips)]


def run(steps):
    """All steps, and what the generator returned."""
    taken = []
    while True:
        try:
            taken.append(next(steps))
        except StopIteration as stop:
            return taken, stop.value


def two_cracks():
    return plate([line_crack([(0, 8.3), (5, 8.3)]), line_crack([(0, -8.3), (4, -8.3)])])


def centre_crack():
    return plate([line_crack([(25.0, 0.37), (35.0, 0.37)])])


# --- lives -------------------------------------------------------------------------------------


def test_life_of_ten_steps_is_exact_where_the_rate_is_a_power_of_length():
    """Round-off, and the cut of the crack with the boundary."""
    response = formula(mode_I())
    steps, _ = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, da=3.0, max_steps=11, response=response)
    )
    assert [step.index for step in steps] == list(range(11))
    for step in steps:
        N = exact.paris_life(5.0, 5.0 + 3.0 * step.index, LAW.C, LAW.m, STRESS)
        assert step.cycles == pytest.approx(N, rel=1e-10, abs=1e-12)


def test_life_with_elber_over_R():
    """Closed form N / U³ with the range (1 - R) stress, R = 0.3."""
    response = formula(mode_I(stress=STRESS / 0.7))
    law = elber(1e-11, 3.0, a=0.5, b=0.4)
    steps, _ = run(
        grow(plate(), law, weighted_angle, Cycle(0.3, 1.0), da=5.0, max_steps=3, response=response)
    )
    N = exact.paris_life(5.0, 15.0, 1e-11, 3.0, STRESS) / exact.elber_U(0.3) ** 3
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)
    assert steps[-1].R[0][0] == pytest.approx(0.3, rel=1e-14)


def test_life_of_ten_steps_within_three_per_mille():
    """K ~ √(W tan(π a/W)), a from 5 to 35, exact K: the error is that of the cycle rule alone."""

    def factor(a):
        return np.sqrt(90.0 * np.tan(np.pi * a / 90.0))

    response = formula(mode_I(factor))
    N, _ = quad(lambda a: 1 / LAW(STRESS * factor(a), 0), 5, 35, epsrel=1e-12)
    error, bar = {}, {}
    for name in ("euler", "pec"):
        for n in (5, 10, 20):
            steps, _ = run(
                grow(
                    plate(),
                    LAW,
                    max_hoop_stress,
                    CYCLE,
                    da=30 / n,
                    max_steps=n + 1,
                    integrator=name,
                    response=response,
                )
            )
            error[name, n] = steps[-1].cycles / N - 1
            bar[name, n] = steps[-1].error and steps[-1].error.cycles / N
    print({key: f"{100 * e:+.3f} %" for key, e in error.items()})
    assert abs(error["euler", 10]) <= 3e-3
    assert np.log2(error["euler", 10] / error["euler", 20]) == pytest.approx(2, abs=0.1)
    assert abs(error["pec", 5]) <= 3e-3
    assert abs(error["pec", 10]) <= 1e-4
    for n in (5, 10, 20):
        assert abs(error["pec", n]) <= bar["pec", n] <= 60 * abs(error["pec", n])


def test_both_tips_of_a_centre_crack():
    response = formula(mode_I())
    steps, _ = run(
        grow(centre_crack(), LAW, max_hoop_stress, CYCLE, da=2.0, max_steps=6, response=response)
    )
    N = exact.paris_life(5.0, 15.0, LAW.C, LAW.m, STRESS)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)
    assert steps[-1].cracks[0].points[[0, -1], 0] == pytest.approx([15.0, 45.0], abs=1e-12)


# --- one step ----------------------------------------------------------------------------------


def test_what_a_step_carries():
    response = formula(mode_I())
    steps, _ = run(
        grow(
            two_cracks(),
            LAW,
            max_hoop_stress,
            Cycle(0.2, 1.0),
            da=2.0,
            max_steps=3,
            response=response,
        )
    )
    for step in steps:
        assert len(step.sif) == 2
        assert step.solutions == ()  # K is from a formula
        assert len(step.sif[0]) == len(step.cracks) == 2
        for part in (step.angle, step.dK_eq, step.R, step.rate, step.da):
            assert isinstance(part, tuple)
            assert [a.shape for a in part] == [(1,), (1,)]
    assert steps[0].cycles == 0.0
    for before, after in zip(steps, steps[1:]):
        assert after.cycles > before.cycles
        for c in range(2):
            old, new = before.corrected[c].points, after.cracks[c].points
            n = min(len(old), len(new) - 1)  # the end of a short face is moved on
            assert np.array_equal(new[1:n], old[1:n])  # goes on to the last bit
            reached = np.linalg.norm(new[-1] - old[-1])
            assert reached == pytest.approx(before.da[c][0], rel=1e-13)


def test_kink_is_towards_the_side_that_the_signs_say():
    """Inclined load on a centre crack: K_II has opposite signs at the tips, seen along n.

    Both tips then turn across the load, one up and one down: the path is antisymmetric.
    """
    K_I, K_II = exact.inclined_remote(100.0, np.radians(60.0))[1:]

    def K_of(problem, c):
        return [[K_I, -K_II], [K_I, K_II]]

    response = formula(K_of)
    # printed table, 60°; and where the criterion turns the kink no further
    for integrator, angle, digits in (("euler", 43.2213, 5e-5), ("pec", 45.535, 1e-3)):
        steps, _ = run(
            grow(
                centre_crack(),
                LAW,
                max_hoop_stress,
                CYCLE,
                da=2.0,
                max_steps=2,
                integrator=integrator,
                response=response,
            )
        )
        x = steps[1].cracks[0].points
        assert len(x) == 4
        centre = np.array([30.0, 0.37])
        assert np.allclose(x - centre, -(x[::-1] - centre), atol=1e-12)
        turned = np.degrees(np.arctan2(*(x[-1] - x[-2])[::-1]))
        assert turned == pytest.approx(-np.sign(K_II) * angle, abs=digits)


def test_slower_tips_follow_in_proportion_to_their_rate_or_range():
    def K_of(problem, c):
        return [[10.0 if c == 0 else 8.0, 0.0]]

    response = formula(K_of)
    for scaling, integrator, share in (
        ("law", "pec", 0.8**3),
        ("law", "euler", 0.8**3),
        ("linear", "euler", 0.8),
    ):
        options = {"scaling": scaling, "integrator": integrator, "da": 2.0, "max_steps": 2}
        steps, _ = run(
            grow(two_cracks(), LAW, max_hoop_stress, CYCLE, **options, response=response)
        )
        assert steps[0].da[0][0] == 2.0
        assert steps[0].da[1][0] == pytest.approx(2.0 * share, rel=1e-13)
        assert steps[1].cycles == pytest.approx(2.0 / LAW(10.0, 0), rel=1e-12)


def test_short_growth_waits_until_the_mesh_can_see_it():
    """Rate ratio 0.03 with da = 2 is 0.06 of a cell of 1.41 a step: it goes on every third step."""

    def K_of(problem, c):
        return [[10.0 if c == 0 else 10.0 * 0.03 ** (1 / 3), 0.0]]

    response = formula(K_of)
    options = {"da": 2.0, "max_steps": 7}
    steps, _ = run(
        grow(
            two_cracks(),
            LAW,
            max_hoop_stress,
            CYCLE,
            integrator="euler",
            **options,
            response=response,
        )
    )
    da = np.array([step.da[1][0] for step in steps])
    assert da == pytest.approx([0, 0, 0.18, 0, 0, 0.18, 0], abs=1e-12)
    before, after = steps[0].cracks[1], steps[2].cracks[1]
    assert np.array_equal(before.points, after.points)  # not a bit moves while it waits
    end = tips_of(steps[6].cracks[1])[0, 0]
    assert end == pytest.approx(4.36, abs=1e-12)  # and nothing is lost

    # of second order a face that is short still is moved on, and no longer waits
    steps, _ = run(grow(two_cracks(), LAW, max_hoop_stress, CYCLE, **options, response=response))
    da = np.array([step.da[1][0] for step in steps])
    assert da == pytest.approx([0, 0, 0.18, 0.06, 0.06, 0.06, 0.06], abs=1e-12)
    assert np.array_equal(steps[0].cracks[1].points, steps[2].corrected[1].points)
    last = steps[6].corrected[1]
    assert len(last.points) == 3
    assert tips_of(last)[0, 0] == pytest.approx(4.36, abs=1e-12)


@pytest.mark.filterwarnings("ignore:the advance .* below one cell")
def test_control_by_cycles():
    response = formula(mode_I())
    options = {"cycles": 1e3, "max_steps": 6}
    steps, _ = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, integrator="euler", **options, response=response)
    )
    for before, after in zip(steps, steps[1:]):
        assert before.da[0][0] == pytest.approx(1e3 * before.rate[0][0], rel=1e-14)
        # the rate rises within the step, so the same advance takes fewer cycles
        assert 0.7 * 1e3 < after.cycles - before.cycles < 1e3
    steps, _ = run(grow(plate(), LAW, max_hoop_stress, CYCLE, **options, response=response))
    assert steps[0].da[0][0] == pytest.approx(1e3 * steps[0].rate[0][0], rel=1e-12)
    # the rate is a power of the length, which two solves tell
    assert [b.cycles - a.cycles for a, b in zip(steps[1:], steps[2:])] == pytest.approx([1e3] * 4)
    N = exact.paris_life(5.0, tips_of(steps[-1].cracks[0])[0, 0], LAW.C, LAW.m, STRESS)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)
    capped, _ = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, 1.5, cycles=1e9, max_steps=3, response=response)
    )
    assert [step.da[0][0] for step in capped] == [1.5, 1.5, 1.5]


def test_radius_of_the_first_step_stays_and_the_solver_is_warm():
    response = formula(mode_I(), radius=1.25)
    run(grow(plate(), LAW, max_hoop_stress, CYCLE, da=2.0, max_steps=3, response=response))
    assert [numerics.radius for numerics, _ in response.calls] == [None, 1.25, 1.25]
    assert [r.centre[0][0, 0] if r.centre else None for _, r in response.calls] == [None, 1, 2]


def test_states_of_a_cycle():
    assert Cycle(0.1, 1.0).load_states == (0.1, 1.0)
    pull, push = traction("top", (0.0, 1.0)), traction("top", (0.0, -1.0))
    loads = [pull, push], [push]
    assert Cycle(states=loads).load_states == loads
    for make, words in (
        (lambda: Cycle(), "Cycle"),
        (lambda: Cycle(1.0), "Cycle"),
        (lambda: Cycle(1.0, 0.0), "min <= max"),
        (lambda: Cycle(np.nan, 0.0), "finite"),
        (lambda: Cycle(0.0, 1.0, states=[1.0]), "not both"),
        (lambda: Cycle(states=[]), "at least one"),
        (lambda: Cycle(states=3.0), "states = 3.0: give a list"),
        (lambda: Cycle(states="loads"), "states = 'loads'"),
        (lambda: Cycle(states=[1.0, np.nan]), r"states\[1\] = nan"),
        (lambda: Cycle(states=[[1.0]]), r"states\[0\] has 1.0, which is not a load"),
    ):
        with pytest.raises(ProblemError, match=words):
            make()


def test_line_a_step(capsys):
    response = formula(mode_I())
    run(
        grow(
            plate(),
            LAW,
            max_hoop_stress,
            CYCLE,
            da=2.0,
            max_steps=2,
            progress="always",
            response=response,
        )
    )
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("step    0  N            0")
    assert lines[2] == "growth ended: max_steps = 2 reached"
    run(grow(plate(), LAW, max_hoop_stress, CYCLE, da=2.0, max_steps=2, response=response))
    assert capsys.readouterr().err == ""  # not a terminal


def test_time_that_is_left(monkeypatch, capsys):
    """Of 4 steps that take 90 s each: 270 s after the first, and none after the last."""
    response = formula(mode_I())
    clock = iter(90.0 * k for k in range(100))
    monkeypatch.setattr("xcrack.growth.progress.time.perf_counter", lambda: next(clock))
    run(
        grow(
            plate(),
            LAW,
            max_hoop_stress,
            CYCLE,
            da=2.0,
            max_steps=4,
            progress="always",
            response=response,
        )
    )
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition("about")[2] for line in lines] == [
        *(" 4.5 min left", " 3 min left", " 1.5 min left", "", ""),
    ]
    run(
        grow(
            plate(),
            LAW,
            max_hoop_stress,
            CYCLE,
            da=2.0,
            max_cycles=5e3,
            progress="always",
            response=response,
        )
    )
    lines = capsys.readouterr().err.splitlines()
    assert "left" not in lines[0]  # no step yet whose cycles say how many there will be
    assert lines[1].endswith(" min left")
    assert "left" not in lines[-1]


# --- why it ends -------------------------------------------------------------------------------


def test_ends_where_the_tip_leaves_the_body():
    response = formula(mode_I())
    steps, ended = run(grow(plate(), LAW, max_hoop_stress, CYCLE, da=20.0, response=response))
    assert ended == (
        "tip left the body: tip of crack 0 reached 'right' at (60, 0.37), "
        f"N = {steps[-1].cycles:.6g} (the last 15 at predicted rates)"
    )
    assert [step.n_tips for step in steps] == [1, 1, 1, 0]


def test_one_tip_leaves_and_the_other_goes_on():
    problem = plate([line_crack([(8.0, 0.37), (20.0, 0.37)])])
    response = formula(mode_I())
    steps, ended = run(
        grow(problem, LAW, max_hoop_stress, CYCLE, da=6.0, max_steps=4, response=response)
    )
    assert [step.n_tips for step in steps] == [2, 2, 1, 1]
    assert ended.startswith("max_steps")
    assert np.isfinite(steps[-1].cycles)
    # The step ends as the left tip arrives, 2 ahead: the right one is at 28 then. To round-off.
    assert measures(steps[2].cracks[0], problem.mesh).area == pytest.approx(28.0, rel=1e-10)


def test_a_body_that_falls_apart_ends_the_run():
    problem = plate([line_crack([(8.0, 0.37), (20.0, 0.37)])])
    whole = formula(mode_I())

    def response(problem, *rest):
        if problem.placed[0].n_tips < 2:
            raise ProblemError("a piece is held by nothing")
        return whole(problem, *rest)

    steps, ended = run(grow(problem, LAW, max_hoop_stress, CYCLE, da=6.0, response=response))
    assert len(steps) == 2
    assert ended.startswith(
        "tip left the body: left tip of crack 0 reached 'left' at (0, 0.37), N = "
    )
    assert "a piece is held by nothing" in ended


def test_cracks_that_meet_end_the_run():
    from xcrack import GeometryError

    whole = formula(mode_I())

    def response(problem, *rest):
        if len(problem.placed[0].points) > 4:
            raise GeometryError("cracks 0 and 1 cross")
        return whole(problem, *rest)

    steps, ended = run(grow(two_cracks(), LAW, max_hoop_stress, CYCLE, da=3.0, response=response))
    assert len(steps) == 3
    assert ended.startswith("the cracks cannot go on after step 2, N = ")
    assert ended.endswith(": cracks 0 and 1 cross")


def test_ends_where_nothing_grows():
    response = formula(mode_I(stress=0.0))
    steps, ended = run(grow(plate(), LAW, max_hoop_stress, CYCLE, da=2.0, response=response))
    assert (len(steps), ended) == (1, "rate is zero at every tip")
    assert steps[0].da[0][0] == 0


def test_threshold():
    """K falls with length: the run ends at the first step below, with a finite life."""
    response = formula(mode_I(lambda a: 1 / a))
    options = {"da": 2.0, "threshold": 10.0}
    steps, ended = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, integrator="euler", **options, response=response)
    )
    assert ended == "rate is zero: dK_eq is below the threshold 10 at every tip"
    assert steps[-1].rate[0][0] == 0 < steps[-2].rate[0][0]
    end = tips_of(steps[-1].cracks[0])[0, 0]
    assert end == 11.0
    N = (end**4 - 5.0**4) / 4 / (LAW.C * STRESS**3)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)

    # of second order it ends where the threshold is: at a = 10, within the quadrature's points
    steps, ended = run(grow(plate(), LAW, max_hoop_stress, CYCLE, **options, response=response))
    assert ended.startswith("rate is zero: dK_eq")
    end = tips_of(steps[-1].corrected[0])[0, 0]
    assert end == pytest.approx(10.0, abs=2.0 / 32)
    N = (end**4 - 5.0**4) / 4 / (LAW.C * STRESS**3)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)


def test_a_tip_below_the_threshold_waits_for_the_others():
    def K_of(problem, c):
        return [[10.0 if c == 0 else 6.0, 0.0]]

    response = formula(K_of)
    steps, _ = run(
        grow(
            two_cracks(),
            LAW,
            max_hoop_stress,
            CYCLE,
            da=2.0,
            max_steps=3,
            threshold=7.0,
            response=response,
        )
    )
    assert [step.da[1][0] for step in steps] == [0, 0, 0]
    assert np.array_equal(steps[0].cracks[1].points, steps[2].cracks[1].points)


def test_the_driving_tip_may_be_shielded():
    """The fastest tip stops and another takes over: cycles stay finite, and go on."""

    def K_of(problem, c):
        stopped = len(problem.placed[0].points) > 2
        return [[[0.0 if stopped else 10.0, 9.0][c], 0.0]]

    response = formula(K_of)
    options = {"da": 2.0, "max_steps": 3}
    steps, _ = run(
        grow(
            two_cracks(),
            LAW,
            max_hoop_stress,
            CYCLE,
            integrator="euler",
            **options,
            response=response,
        )
    )
    assert steps[1].cycles == pytest.approx(2 * 2.0 / LAW(10.0, 0))
    assert steps[2].cycles > steps[1].cycles
    assert steps[1].da[0][0] == 0
    # of second order the other takes over within the step
    steps, _ = run(grow(two_cracks(), LAW, max_hoop_stress, CYCLE, **options, response=response))
    assert 2.0 / LAW(10.0, 0) < steps[1].cycles < 2.0 / LAW(9.0, 0)
    assert steps[2].cycles - steps[1].cycles == pytest.approx(2.0 / LAW(9.0, 0))
    assert steps[1].da[0][0] == 0


def test_toughness():
    response = formula(mode_I())
    K_c = STRESS * np.sqrt(np.pi * 10.5)
    steps, ended = run(
        grow(plate(), LAW, max_hoop_stress, Cycle(0.5, 1.0), da=2.0, K_c=K_c, response=response)
    )
    a = steps[-1].cracks[0].points[-1, 0]
    assert 10.5 <= a < 10.5 * (1 + 5e-4)
    N = exact.paris_life(5.0, a, LAW.C, LAW.m, STRESS / 2)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-10)
    assert ended.startswith("K_c reached: K_eq = 574.")
    assert ended.endswith(" >= 574.341 at crack 0, tip 0 at (10.5021, 0.37)")


def test_limits_of_cycles_and_steps():
    response = formula(mode_I())
    steps, ended = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, da=2.0, max_cycles=5e3, response=response)
    )
    assert steps[-2].cycles < 5e3 <= steps[-1].cycles <= 5e3 * (1 + 2e-4)
    assert ended.startswith("max_cycles = 5000 reached")
    steps, ended = run(
        grow(plate(), LAW, max_hoop_stress, CYCLE, da=2.0, max_steps=1, response=response)
    )
    assert (len(steps), ended) == (1, "max_steps = 1 reached")
