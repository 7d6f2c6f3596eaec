"""Ends of runs: the last step ends where it should, and joins are in time."""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad

import xcrack as xc

LAW, CYCLE = xc.paris(1e-13, 3.0), xc.Cycle(0.1, 1.0)
WITHIN = 2e-4 * 1.001  # of K_c and of cycles: what the docstring of grow says


def strip(n=20, stress=140.0):
    """A strip with an edge crack of 4 in a width of 20."""
    loads = [xc.traction("top", (0, stress)), xc.traction("bottom", (0, -stress))]
    mesh = xc.box((0, -20), (20, 20), (n, 2 * n))
    crack = xc.line_crack([(0, 0.3), (4, 0.3)])
    return xc.Problem(mesh, xc.Isotropic(210e3, 0.3, plane="strain"), [crack], loads=loads)


def block():
    """A thick strip with a straight front."""
    mesh = xc.box((0, -4, 0), (4, 4, 1), (13, 26, 4))
    loads = [xc.traction("back", (0, 140.0, 0)), xc.traction("front", (0, -140.0, 0))]
    crack = xc.plane_crack([(-0.1, 0.11, -0.1), (1, 0.11, -0.1), (1, 0.11, 1.1), (-0.1, 0.11, 1.1)])
    return xc.Problem(mesh, xc.Isotropic(210e3, 0.3), [crack], loads=loads)


def run(problem, law=LAW, **options):
    steps = xc.grow(problem, law, xc.max_hoop_stress, CYCLE, progress=False, **options)
    return xc.collect(steps)


def largest_K(step):
    return max(float(np.linalg.norm(sif.K, axis=1).max()) for sif in step.sif[-1])


@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_a_run_ends_at_toughness(integrator):
    """And has not lost what the overshoot of a step was: 13 in place of 11.4, at K = 4459."""
    for da in (3.0, 1.5):
        history = run(strip(), da=da, K_c=3000.0, integrator=integrator)
        assert history.ended.startswith("K_c reached")
        assert 3000 <= largest_K(history.solved[-1]) <= 3000 * (1 + WITHIN)


@pytest.mark.slow
def test_life_to_toughness_hardly_depends_on_the_last_step():
    """Discretisation: 1 % between steps of 1.5 and .3, of which the first would end 1 % beyond."""
    coarse, fine = (run(strip(40), da=da, K_c=3000.0) for da in (1.5, 0.3))
    assert coarse.life == pytest.approx(fine.life, rel=0.01)


def test_a_run_ends_where_its_law_breaks():
    history = run(strip(), xc.forman(1e-10, 3.0, K_c=3000.0), da=3.0)
    step = history.solved[-1]
    assert np.isinf(step.rate[0][0])
    assert step.dK_eq[0][0] == pytest.approx(0.9 * 3000.0, rel=WITHIN)


def test_a_run_ends_where_a_law_that_needs_more_breaks():
    """Size for its threshold, or K_max: the end is found as it is for other laws."""

    def by_largest_K(dK, R, K_max):
        return np.where(K_max >= 3000.0, np.inf, 1e-10 * dK**3)

    by_largest_K.needs = ("K_max",)
    short = xc.el_haddad(xc.klesnil_lukas(100.0, 0.0), a0=0.1)
    for law in (xc.forman(1e-10, 3.0, K_c=3000.0, threshold=short), by_largest_K):
        step = run(strip(), law, da=3.0).solved[-1]
        assert np.isinf(step.rate[0][0])
        assert step.dK_eq[0][0] == pytest.approx(0.9 * 3000.0, rel=WITHIN)


def test_a_run_ends_where_a_ligament_yields():
    history = run(strip(), da=3.0, link_up=xc.plastic_zone(400.0, 2))
    assert history.ended.startswith("ligament yield")
    K, left = largest_K(history.solved[-1]), 20 - history.solved[-1].sif[0][0].x[0, 0]
    assert xc.plastic_zone(400.0, 2)(K) == pytest.approx(left, rel=1e-3)


@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_a_run_ends_after_its_cycles(integrator):
    history = run(strip(), da=3.0, max_cycles=3e4, integrator=integrator)
    assert 3e4 <= history.life <= 3e4 * (1 + WITHIN)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_fronts_end_as_tips_do(integrator):
    whole = run(block(), da=0.6, max_steps=3, integrator=integrator)
    N = 0.6 * whole.steps[1].cycles + 0.4 * whole.steps[2].cycles
    history = run(block(), da=0.6, max_cycles=N, integrator=integrator)
    assert N <= history.life <= N * (1 + WITHIN)
    K_c = [float(step.dK_eq[0].max()) / 0.9 for step in whole.steps]
    middle = 0.5 * (K_c[1] + K_c[2])
    history = run(block(), da=0.6, K_c=middle, integrator=integrator)
    last = history.solved[-1]
    assert middle <= float(last.dK_eq[0].max()) / 0.9 <= middle * (1 + WITHIN)


@pytest.mark.slow
@pytest.mark.mission
def test_beyond_its_end_a_run_goes_on_as_if_there_had_been_none(tmp_path):
    """To the last bit: the short last step is computed again."""
    whole = run(strip(), da=1.5, max_steps=5)
    options = {"da": 1.5, "progress": False}
    args = (strip(), LAW, xc.max_hoop_stress, CYCLE)
    for limit in ({"max_cycles": 5e4}, {"K_c": 1500.0}):
        folder = tmp_path / next(iter(limit))
        short = xc.collect(xc.grow(*args, **options, **limit), folder)
        assert len(short.steps) < 5
        assert xc.resume(folder, *args, **options, **limit).life == short.life
        longer = xc.resume(folder, *args, **options, max_steps=5)
        assert [step.cycles for step in longer.steps] == [step.cycles for step in whole.steps]


# --- a length that is asked for, and K by formulas, whose integrals are exact --------------------

WIDTH, HALF = 20.0, 20.0


def single_edge(a):
    """K of an edge crack in a strip, for a stress of 140 (Tada, Paris, Irwin 1973: within .5 %)."""
    t = np.pi * a / (2 * WIDTH)
    shape = (0.752 + 2.02 * a / WIDTH + 0.37 * (1 - np.sin(t)) ** 3) / np.cos(t)
    return 140.0 * np.sqrt(np.pi * a) * np.sqrt(np.tan(t) / t) * shape


def centre(a):
    """K of a centre crack of length 2 a in a strip, for a stress of 140 (Feddersen 1966)."""
    return 140.0 * np.sqrt(np.pi * a / np.cos(np.pi * a / (2 * HALF)))


def known(K_of):
    """Response with K as a function of the length in the body over the number of tips."""

    def response(problem, states, reuse, bars):
        count = [crack.n_tips for crack in problem.placed]
        a = np.repeat([size / max(n, 1) for size, n in zip(problem.sizes, count)], count)
        K = np.where(a < 0.999 * WIDTH, K_of(np.minimum(a, 0.999 * WIDTH)), 0.0)
        return xc.Response.of_K(
            problem, states, [float(s) * np.stack([K, 0 * K], 1) for s in states]
        )

    return response


def exact(K_of, a0, a1):
    return quad(lambda a: 1 / (1e-13 * (0.9 * K_of(a)) ** 3), a0, a1, epsrel=1e-12)[0]


def centre_crack():
    loads = [xc.traction("top", (0, 140.0)), xc.traction("bottom", (0, -140.0))]
    mesh = xc.box((-HALF, -HALF), (HALF, HALF), (20, 20))
    crack = xc.line_crack([(-3, 0.3), (3, 0.3)])
    return xc.Problem(mesh, xc.Isotropic(210e3, 0.3, plane="strain"), [crack], loads=loads)


@pytest.mark.parametrize("integrator", ["pec", "euler"])
@pytest.mark.parametrize(
    ("scene", "K_of", "begin", "size"),
    [(strip, single_edge, 4.0, 9.37), (centre_crack, centre, 3.0, 2 * 8.11)],
)
def test_a_run_ends_at_a_length(scene, K_of, begin, size, integrator):
    """To round-off; its cycles are those of the integral, but for discretisation: steps of .4."""
    options = {"da": 0.4, "response": known(K_of), "integrator": integrator}
    history = run(scene(), max_size=size, **options)
    (crack,) = history.solved[-1].cracks
    n = crack.n_tips
    assert history.solved[-1].sizes[0] == pytest.approx(size, rel=1e-9)
    assert history.ended.startswith(f"max_size = {size:g} reached: crack 0")
    rel = 2e-4 if integrator == "pec" else 2e-3
    assert history.life == pytest.approx(exact(K_of, begin, size / n), rel=rel)


def test_no_length_is_left_that_is_too_short_for_the_mesh():
    """The end is .02 beyond a step, a fiftieth of a cell: the one before leaves a tenth, .14."""
    history = run(strip(), da=1.5, max_size=7.02, response=known(single_edge))
    assert history.solved[-1].sizes[0] == pytest.approx(7.02, rel=1e-9)
    assert [round(step.sizes[0], 3) for step in history.solved] == [4.0, 5.5, 6.879, 7.02]


@pytest.mark.parametrize("da", [3.0, 1.5, 0.75])
def test_life_of_a_strip_by_long_steps(da):
    """Discretisation: steps as long as the crack err by .3 %, and by the third power of that."""
    history = run(strip(), da=da, max_size=11.37, response=known(single_edge))
    off = 3e-3 * (da / 3.0) ** 3 + 3e-5
    assert history.life == pytest.approx(exact(single_edge, 4.0, 11.37), rel=off)


@pytest.mark.parametrize("da", [2.0, 0.5])
def test_cycles_until_a_side_converge(da):
    """Discretisation: K has no bound there, and the last step costs nothing."""
    history = run(strip(), da=da, response=known(single_edge))
    (arrival,) = history.arrivals
    assert arrival.x == pytest.approx((20.0, 0.3), rel=1e-9)
    off = 2e-4 if da == 0.5 else 5e-3
    assert history.life == pytest.approx(exact(single_edge, 4.0, 0.999 * WIDTH), rel=off)


@pytest.mark.slow
def test_fronts_end_at_a_size():
    for integrator in ("pec", "euler"):
        history = run(block(), da=0.6, max_size=2.0, integrator=integrator)
        assert history.solved[-1].sizes[0] == pytest.approx(2.0, rel=1e-9)
        assert history.ended.startswith("max_size = 2 reached")


@pytest.mark.slow
def test_beyond_its_size_a_run_goes_on_as_if_there_had_been_none(tmp_path):
    """To the last bit, also behind a step that was shorter for the one after it."""
    options = {"da": 1.5, "response": known(single_edge), "progress": False}
    args = (strip(), LAW, xc.max_hoop_stress, CYCLE)
    whole = xc.collect(xc.grow(*args, **options, max_steps=5))
    for size in (6.3, 7.02):
        folder = tmp_path / str(size)
        short = xc.collect(xc.grow(*args, **options, max_size=size), folder)
        assert xc.resume(folder, *args, **options, max_size=size).life == short.life
        (folder / f"step_{len(short.steps) - 1:05d}.npz").unlink()
        assert xc.resume(folder, *args, **options, max_size=size).life == short.life
        longer = xc.resume(folder, *args, **options, max_steps=5)
        assert [step.cycles for step in longer.steps] == [step.cycles for step in whole.steps]


# --- two collinear cracks, of which K is known ---------------------------------------------------

C, STRESS, M = 1e-10, 100.0, 3.0
N_JOIN, B_JOIN = 458.82402, 1.391494  # of the ODE over the exact K of two collinear cracks


def two_cracks():
    line = [(-2.0, 0.0), (2.0, 0.0)]
    mesh = xc.plate(
        240, 240, lower=(-120, -120), size=30.0, size_near=0.05, along=line, band=0.35,
        transition=75.0,
    )  # fmt: skip
    loads = [xc.traction("top", (0, STRESS)), xc.traction("bottom", (0, -STRESS))]
    cracks = [xc.line_crack([(a, 0.003), (a + 1, 0.003)]) for a in (-1.25, 0.25)]
    return xc.Problem(mesh, xc.Isotropic(1e5, 0.3, plane="strain"), cracks, loads=loads)


def joined(**options):
    steps = xc.grow(
        two_cracks(), xc.paris(C, M), xc.max_hoop_stress, xc.Cycle(0, 1), progress=False, **options
    )
    return xc.collect(steps, until=lambda step: len(step.cracks) == 1)


@pytest.mark.slow
@pytest.mark.parametrize("da", [0.1, 0.05])
def test_cracks_join_in_time(da):
    """Discretisation: within .5 % of the exact N; late by 2.4 and 1.7 % without the gap's K."""
    assert joined(da=da).joins[0].N == pytest.approx(N_JOIN, rel=5e-3)


@pytest.mark.slow
def test_bar_of_a_life_through_a_join():
    history = joined(tolerance=1e-2)
    b = np.asarray(history.cracks[0].points)[-1, 0]
    rest = (B_JOIN ** (1 - M / 2) - b ** (1 - M / 2)) / (
        (M / 2 - 1) * C * STRESS**M * np.pi ** (M / 2)
    )
    off = abs(history.life / (N_JOIN + rest) - 1)
    # The last of three steps ends in the join: no later solve tells its error, .05 of the bar.
    assert off <= 0.01
    assert off <= history.life_bar.relative < 0.06


# --- nothing that grows --------------------------------------------------------------------------


@pytest.mark.slow
def test_a_pressed_crack_ends_its_run():
    """K is zero: what a solve finds of it is round-off, and no mesh is fine enough for that."""
    loads = [xc.traction("top", (0.0, -1.0)), xc.traction("bottom", (0.0, 1.0))]
    crack = xc.line_crack([(-1.2, 0.1), (0.1, 0.1)])
    body = xc.box((-1.0, -1.0), (1.0, 1.0), 8)
    problem = xc.Problem(body, xc.Isotropic(1.0, 0.3, plane="strain"), [crack], loads=loads)
    for options in ({"tolerance": 0.3}, {"da": 0.3}):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            steps = xc.grow(
                problem, xc.paris(1e-9, 3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0),
                progress=False, **options,
            )  # fmt: skip
            history = xc.collect(steps)
        assert (len(history.steps), history.ended) == (1, "rate is zero at every tip")
