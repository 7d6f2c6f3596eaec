"""Cycles and growth of cracks whose faces rub: shakedown, locked tips, memory of slip, resume."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support import scenes_friction as rubbing
from support.scenes_2d import SIDES

TURN = 0.31


def state(tau, p=1.0):
    field = lambda x, y: exact.uniform_stress(x, y, 0.0, -p, tau, 1.0, 0.3)  # noqa: E731
    return scenes.tractions(scenes.turned(field, (0.0, 0.0), TURN), SIDES)


def cracked(mu, n=16, points=((-0.4, 0.0), (0.4, 0.0)), **options):
    crack = xc.line_crack(np.array(points) @ scenes.rows(TURN))
    return xc.Problem(
        scenes.perturbed(n, 3), xc.Isotropic(1.0, 0.3, "strain"), [crack], contact="on",
        friction=mu, **options,
    )  # fmt: skip


def grown(problem, taus=(-0.6, 0.6), steps=3, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        run = xc.grow(
            problem, xc.paris(1e-3, 2.0), xc.max_hoop_stress,
            xc.Cycle(states=[state(t) for t in taus]), 0.15, progress=False, max_steps=steps,
            **options,
        )  # fmt: skip
        return list(run)


def test_a_cycle_is_repeated_until_slip_returns():
    """From rest the first load slips half as far as those of a cycle: K of the last pass counts."""
    mu, tau = 0.3, 0.9
    problem, states, effective = rubbing.path(21, [0.0, tau, 0.0, tau], np.ones(4), mu, 2)
    assert effective.tolist() == pytest.approx([0.0, tau - mu, mu, tau - mu])
    cycle = states[2:]
    once = xc.solve(problem, cycle)
    repeated = xc.respond(problem, cycle)
    again = repeated.solutions
    K = np.stack([row[0].K for row in repeated.sif])[:, 1, 1]
    assert K == pytest.approx(effective[2:] * np.sqrt(np.pi), abs=1e-3)
    assert once[0].dissipated == 0
    assert again[1].dissipated == pytest.approx(again[0].dissipated, rel=1e-2)


def test_a_cycle_that_slips_back_from_its_memory_is_the_same():
    """The same crack again, from what the cycle left behind: nothing changes."""
    problem, cycle = cracked(0.3), xc.Cycle(states=[state(-0.6), state(0.6)])
    first = xc.respond(problem, cycle.load_states)
    second = xc.respond(problem, cycle.load_states, first.reuse)
    largest = max(np.abs(answer[0].K).max() for answer in first.sif)
    for one, two in zip(first.sif, second.sif, strict=True):
        assert np.abs(one[0].K - two[0].K).max() <= 1e-5 * largest


def test_a_stuck_crack_does_not_grow():
    steps = grown(cracked(0.7))
    assert len(steps) == 1
    assert not steps[0].dK_eq[0].any()
    assert not steps[0].rate[0].any()


def test_friction_slows_growth():
    """A slipping crack sees a range of 2 (tau - mu p), not of 2 tau."""
    slow, fast = (grown(cracked(mu), steps=1)[0] for mu in (0.3, 0.0))
    ratio = slow.dK_eq[0] / fast.dK_eq[0]
    assert ratio == pytest.approx(0.5, abs=2e-3)


def test_resume_to_the_last_bit(tmp_path):
    problem, cycle = cracked(0.3, n=12), xc.Cycle(states=[state(-0.6), state(0.6)])

    asked = (problem, xc.paris(1e-3, 2.0), xc.max_hoop_stress, cycle, 0.15)

    def begun(path, last):
        run = xc.grow(*asked, progress=False, max_steps=4)
        return xc.collect(run, path=path, until=lambda step: step.index == last)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        whole = begun(tmp_path / "whole", 3)
        begun(tmp_path / "broken", 1)
        resumed = xc.resume(tmp_path / "broken", *asked, progress=False, max_steps=4)
    assert [s.cycles for s in resumed.steps] == [s.cycles for s in whole.steps]
    for one, two in zip(whole.steps, resumed.steps, strict=True):
        for a, b in zip(one.sif, two.sif, strict=True):
            assert np.array_equal(a[0].K, b[0].K)


def test_other_friction_is_another_run(tmp_path):
    cycle = xc.Cycle(states=[state(-0.6), state(0.6)])
    rest = (xc.paris(1e-3, 2.0), xc.max_hoop_stress, cycle, 0.15)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        run = xc.grow(cracked(0.3, n=12), *rest, progress=False, max_steps=1)
        xc.collect(run, path=tmp_path / "run")
    for problem in (
        cracked(0.35, n=12), cracked(0.3, n=12, numerics=xc.Numerics(substeps=20))
    ):  # fmt: skip
        with pytest.raises(xc.XcrackError, match=r"problem\.(friction|numerics)"):
            xc.resume(tmp_path / "run", problem, *rest, progress=False, max_steps=2)


def test_a_spectrum_is_refused_where_faces_press_and_rub():
    pressed = cracked(0.3)
    loaded = replace(pressed, loads=state(0.6))
    spectrum = xc.Spectrum([0.2, 1.0, 0.2, 0.8, 0.2])
    with pytest.raises(xc.ProblemError, match=r"Cycle\(states"):
        next(xc.grow(loaded, xc.paris(1e-3, 2.0), xc.max_hoop_stress, spectrum, 0.15,
                     progress=False))  # fmt: skip
    opened = replace(loaded, loads=state(0.2, p=-1.0), contact="auto")
    step = next(xc.grow(opened, xc.paris(1e-3, 2.0), xc.max_hoop_stress, spectrum, 0.15,
                        progress=False))  # fmt: skip
    assert step.dK_eq[0].min() > 0


def test_the_body_of_a_run_is_stored_with_one_coefficient_a_crack(tmp_path):
    problem = replace(cracked(0.3, n=12), friction=[0.3])
    cycle = xc.Cycle(states=[state(-0.6), state(0.6)])
    run = xc.grow(problem, xc.paris(1e-3, 2.0), xc.max_hoop_stress, cycle, 0.15,
                  progress=False, max_steps=1)  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        xc.collect(run, path=tmp_path / "run")
    assert (tmp_path / "run" / "mesh.npz").exists()
