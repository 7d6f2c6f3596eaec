"""Lives with scatter against closed forms; rerating; inspections and what they miss."""

import time
from dataclasses import replace

import numpy as np
import pytest

from support import exact
from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    History,
    Isotropic,
    Problem,
    ProblemError,
    Response,
    Scatter,
    Spectrum,
    box,
    fix,
    grow,
    growth_curve,
    inspection,
    klesnil_lukas,
    life,
    line_crack,
    logistic_pod,
    lognormal,
    max_hoop_stress,
    normal,
    paris,
    penny_crack,
    traction,
    walker,
    weighted_angle,
)

LAW = paris(1e-11, 3.0)
CYCLE = Cycle(0.0, 1.0)


def run(problem=None, law=LAW, cycle=CYCLE, n=12, da=3.0, **options):
    options = {"da": da, "max_steps": n, "progress": False, **options}
    steps = list(grow(problem or plate(), law, max_hoop_stress, cycle, **options))
    return History(tuple(steps), "max_steps")


@pytest.fixture(scope="module")
def history():
    response = formula(mode_I())
    return run(response=response)


def closed_form(a0=5.0, a1=38.0, m=3.0):
    return exact.paris_life(a0, a1, 1e-11, m, STRESS)


def test_scatter_of_C_is_lognormal(history):
    """ln C normal with 0.3: the same width of ln N; factors of 5 and 95 %: 0.6105, 1.638."""
    begin = time.perf_counter()
    result = life(history, scatter=Scatter(C=lognormal(0.3)), samples=100_000, seed=71)
    assert time.perf_counter() - begin < 2
    N = closed_form()
    assert result.life == pytest.approx(N, rel=1e-9)
    for p, factor in ((5, 538371 / 881834), (50, 1.0), (95, 1444416 / 881834)):
        assert result.percentile(p) == pytest.approx(N * factor, rel=1e-3)
    assert result.N.std() > 0
    assert np.log(result.N).std() == pytest.approx(0.3, rel=1e-3)
    assert result.probability(N) == pytest.approx(0.5, abs=1e-3)
    assert result.scatter["C"][0] == result.percentile(5)
    assert "90 % of 100000 samples" in str(result)
    assert (np.diff(result.table()["N"]) > 0).all()


def test_K_and_load_count_to_the_power_m(history):
    """d ln N / d ln K = -m, exactly for Paris."""
    for name in ("K", "load"):
        scatter = Scatter(**{name: lognormal(0.1)})
        result = life(history, LAW, scatter=scatter, samples=20_000, seed=72)
        expected = closed_form() * np.exp(-3 * 0.1 * 1.6448536)
        assert result.percentile(5) == pytest.approx(expected, rel=2e-3)
    both = Scatter(C=lognormal(0.3), K=lognormal(0.1))
    result = life(history, LAW, scatter=both, samples=100_000, seed=73)
    assert np.log(result.N).std() == pytest.approx(np.hypot(0.3, 0.3), rel=5e-3)  # statistical
    assert set(result.scatter) == {"C", "K"}


def test_first_length_by_the_closed_form(history):
    """N(a0) at the quantiles of a0: rates are a power of the length, so round-off."""
    scatter = Scatter(a0=lognormal(0.1, median=8.0))
    result = life(history, scatter=scatter, samples=10_000, seed=74)
    for p in (10, 50, 90):
        a0 = float(scatter.a0.quantile(1 - p / 100))
        assert result.percentile(p) == pytest.approx(closed_form(a0), rel=5e-4)
    slope = (np.log(closed_form(8.0 * 1.001)) - np.log(closed_form(8.0))) / np.log(1.001)
    step = life(history, scatter=Scatter(a0=lognormal(0.001, median=8.0)), samples=1000, seed=75)
    assert np.log(step.N).std() == pytest.approx(-slope * 0.001, rel=5e-3)


def test_worked_sensitivity_to_the_first_length():
    """-(m/2 - 1) a0^(1-m/2) / (a0^(1-m/2) - af^(1-m/2)) = -0.644004, from 1 to 20 mm."""
    N = [exact.paris_life(a, 20e-3, 1e-11, 3.0, 100.0) for a in (0.9999e-3, 1e-3, 1.0001e-3)]
    assert N[1] == pytest.approx(881834.145, abs=1e-3)
    assert (np.log(N[2]) - np.log(N[0])) / 2e-4 == pytest.approx(-0.644004, abs=1e-5)


def test_samples_below_a_threshold_do_not_end():
    """With a hard threshold at K of the first crack half of the samples never grow."""
    response = formula(mode_I())
    first = STRESS * np.sqrt(np.pi * 5.0)
    law = paris(1e-11, 3.0, threshold=klesnil_lukas(0.999999 * first, 0.0))
    result = life(
        run(law=law, response=response), law, scatter=Scatter(K=normal(0.01)), samples=1000, seed=76
    )
    assert np.isinf(result.N).mean() == pytest.approx(0.5, abs=0.01)
    assert result.percentile(90) == np.inf


def test_samples_that_reach_the_toughness_end_early():
    response = formula(mode_I())
    law = paris(1e-11, 3.0, K_c=STRESS * np.sqrt(np.pi * 60.0))
    result = life(
        run(law=law, response=response),
        law,
        scatter=Scatter(K=lognormal(0.3)),
        samples=2000,
        seed=77,
    )
    plain = life(
        run(response=response), LAW, scatter=Scatter(K=lognormal(0.3)), samples=2000, seed=77
    )
    assert result.percentile(5) < plain.percentile(5)
    assert result.percentile(90) == pytest.approx(plain.percentile(90), rel=1e-9)


def test_bounds_of_steps_and_of_K(history):
    """Paris on a power of the length: no error of steps; a spread of 1 % is 3 % of life."""
    result = life(history, LAW, scatter=Scatter(C=lognormal(0.1)), samples=100, seed=78)
    assert result.bounds["steps"] < 1e-9
    assert result.bounds["K"] < 1e-15  # none: round-off of powers, which differs between processors

    def widened(state):
        return tuple(replace(sif, spread=0.01 * np.abs(sif.K)) for sif in state)

    wide = History(
        tuple(replace(step, sif=tuple(map(widened, step.sif))) for step in history.steps), ""
    )
    result = life(wide, LAW, scatter=Scatter(C=lognormal(0.1)), samples=100, seed=78)
    assert result.bounds["K"] == pytest.approx(0.99**-3 - 1, rel=1e-6)


def test_of_a_spectrum_the_rate_can_vary():
    response = formula(mode_I())
    history = run(cycle=Spectrum([0.0, 1.0, 0.4, 0.6]), response=response)
    result = life(history, scatter=Scatter(C=lognormal(0.3)), samples=1000, seed=79, unit="flight")
    assert result.percentile(50) == pytest.approx(history.life, rel=1e-3)
    assert "flights" in str(result)
    with pytest.raises(ProblemError, match="the steps have the largest only"):
        life(history, LAW, scatter=Scatter(K=normal(0.01)), seed=79)
    with pytest.raises(ProblemError, match="the steps have the largest only"):
        history.rerate(LAW)


# --- another law ---------------------------------------------------------------------------------


def test_rerate_is_a_new_run_for_one_tip():
    response = formula(mode_I())
    cycle = Cycle(0.2, 1.0)
    old, new = run(cycle=cycle, response=response), walker(3e-11, 2.7, 0.4)
    again = run(law=new, cycle=cycle, response=response)
    result = old.rerate(new, LAW)
    assert result.bound == 0
    assert result.life == pytest.approx(again.life, rel=1e-12)
    assert np.allclose(result.cycles, [step.cycles for step in again.steps], rtol=1e-12)
    assert old.rerate(LAW).life == old.life  # to the bit
    with pytest.raises(ProblemError, match="other rates than the law"):
        old.rerate(new, new)


def test_rerate_of_several_tips_has_a_bound():
    """A factor changes no share; another exponent does, and too much of it is refused."""
    response = formula(mode_I())
    cracks = [line_crack([(0, 8.3), (5, 8.3)]), line_crack([(0, -8.3), (4.6, -8.3)])]
    history = run(plate(cracks), n=5, response=response)
    double = history.rerate(paris(2e-11, 3.0))
    assert double.bound < 1e-12
    assert double.life == pytest.approx(history.life / 2, rel=1e-12)
    steeper = paris(1e-11, 3.3)
    result = history.rerate(steeper)
    again = run(plate(cracks), law=steeper, n=5, response=response)
    assert 0 < result.bound < 0.05
    assert abs(result.life / again.life - 1) <= result.bound
    with pytest.raises(ProblemError, match="the path would differ"):
        history.rerate(paris(1e-11, 6.0))


def test_rerate_that_stops_or_breaks(history):
    with pytest.raises(ProblemError, match="does not grow at step 0"):
        history.rerate(paris(1e-11, 3.0, threshold=klesnil_lukas(1e4, 0.0)))
    broken = history.rerate(paris(1e-11, 3.0, K_c=STRESS * np.sqrt(np.pi * 12.0)))
    assert "toughness is reached" in broken.ended
    assert len(broken.cycles) < len(history.steps)


# --- inspections ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def curve():
    """1 to 20 mm in m and MPa √m, the worked example: 881 834 cycles."""
    response = formula(mode_I(factor=lambda a: np.sqrt(np.pi * a * 0.001)))
    problem = plate([line_crack([(0.0, 0.37), (1.0, 0.37)])], size=(60.0, 40.0), n=(120, 80))
    law = paris(1e-8, 3.0)  # mm, MPa √m
    steps = grow(
        problem, law, weighted_angle, CYCLE, da=1.0, max_steps=20, progress=False, response=response
    )
    return growth_curve(History(tuple(steps), ""))


def test_worked_inspections(curve):
    assert curve.N[-1] == pytest.approx(881834.145, rel=1e-9)
    three = inspection(curve, a_detect=3.0, factor=3)
    assert 3 * three.interval == pytest.approx(401784.9, rel=1e-6)
    assert three.interval == pytest.approx(133928, abs=0.5)
    assert inspection(curve, a_detect=3.0).interval == pytest.approx(200892, abs=0.5)
    assert three.first == pytest.approx(881834.145 / 2, rel=1e-9)
    assert three.missed is None


@pytest.mark.parametrize(
    ("interval", "sizes", "missed"),
    [
        (200e3, [1.473, 2.383, 4.494, 11.44], 3.94e-4),
        (300e3, [1.847, 4.494], 0.064165),
        (100e3, None, 2e-6),
    ],
)
def test_worked_chances_to_miss(curve, interval, sizes, missed):
    result = inspection(curve, interval=interval, pod=logistic_pod(2.0, 0.4))
    if sizes is not None:
        assert np.allclose(result.a, sizes, rtol=5e-4)
    assert result.missed == pytest.approx(missed, rel=0.01 if missed > 1e-5 else 0.3)


def test_probability_of_detection():
    pod = logistic_pod(2.0, 0.4)
    assert pod(2.0) == 0.5
    assert float(pod(2.0 * np.exp(0.4 * np.log(9)))) == pytest.approx(0.9, rel=1e-12)
    assert pod(0.0) == 0


def test_curve_there_and_back(curve):
    for a in (1.0, 1.37, 7.77, 20.0):
        N = exact.paris_life(1e-3, a * 1e-3, 1e-11, 3.0, 100.0)
        assert curve.cycles_at(a) == pytest.approx(N, rel=1e-9, abs=1e-3)
        assert curve.length_at(N) == pytest.approx(a, rel=1e-8)


def test_a_curve_by_a_measure_of_the_crack(history):
    """An edge crack in mode I: its length and its depth are what cycles are counted with."""
    history = History(history.steps, "", mesh=plate().mesh)
    lead = growth_curve(history)
    for measure in ("length", "depth"):
        curve = growth_curve(history, measure=measure)
        for N in np.linspace(0.0, history.life, 7):
            assert curve.length_at(N) == pytest.approx(lead.length_at(N), rel=1e-9)
    plan = inspection(history, a_detect=10.0, measure="depth")
    assert plan.measure == "depth"
    assert plan.interval == pytest.approx(inspection(lead, a_detect=10.0).interval, rel=1e-9)


def test_a_curve_of_a_penny():
    """K = 2 S √(r/π) all around: the driving place moves; by its area it grows as in closed form.

    Discretisation: chords of the advanced front, as long as a cell of 0.35, take 0.9 % of the root.
    """

    def respond(problem, states, reuse, bars):
        r = np.linalg.norm(problem.stations.x[:, :2], axis=1)
        K = 2 * STRESS * np.sqrt(r / np.pi)[:, None] * np.eye(3)[0]
        return Response.of_K(problem, states, np.stack([float(s) * K for s in states]))

    mesh = box((-1, -1, -1), (1, 1, 1), (10, 10, 10))
    pull = [traction("top", (0, 0, 1.0)), traction("bottom", (0, 0, -1.0))]
    crack = penny_crack((0, 0, 0.013), (0, 0, 1), 0.5)
    problem = Problem(mesh, Isotropic(1e3, 0.3), [crack], loads=pull, order=1)
    grown = run(problem, response=respond, da=0.05, n=2)
    curve = growth_curve(History(grown.steps, "", mesh=mesh))
    assert curve.measure == "root_area"
    part = 1e-11 * (2 * STRESS / np.sqrt(np.pi)) ** 3 / 2
    for N in np.linspace(0.0, grown.life, 5):
        radius = (0.5**-0.5 - part * N) ** -2
        assert curve.length_at(N) / np.sqrt(np.pi) == pytest.approx(radius, rel=0.015)


def test_multiple_sites_are_one_curve():
    """Before the join that of the longer crack, then of both; it jumps where they meet."""
    cracks = [line_crack([(10, 0.3), (18, 0.3)]), line_crack([(21, 0.3), (27, 0.3)])]
    response = formula(mode_I())
    grown = run(plate(cracks), response=response, da=0.8, n=4)
    assert len(grown.joins) == 1
    curve, other = growth_curve(grown), growth_curve(grown, crack=1)
    assert curve.measure == other.measure == "length"
    n = int(np.argmin(np.diff(curve.N)))
    assert curve.N[n + 1] == curve.N[n]
    own, whole = curve.a[[n, n + 1]]
    assert (curve.a[0], other.a[0]) == (8.0, 6.0)
    assert whole == pytest.approx(own + other.a[n])
    assert curve.length_at(0.999 * curve.N[n]) < own
    assert curve.cycles_at((own + whole) / 2) == curve.N[n]
    assert inspection(grown, interval=0.4 * grown.life).measure == "length"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda h: growth_curve(h, crack=7), "the run begins with: 0"),
        (lambda h: growth_curve(h, measure="length", crack=True), "crack = True"),
        (lambda h: growth_curve(h, measure="advance", crack=0), "a crack is named"),
        (lambda h: growth_curve(h, measure=3), "measure = 3: give measure="),
        (lambda h: growth_curve(h, measure="depth"), "without its mesh"),
        (lambda h: inspection(growth_curve(h), interval=1e4, measure="depth"), "has its own"),
        (lambda h: lognormal(-0.1), "sigma"),
        (lambda h: normal(0.3), "sigma = 0.3"),
        (lambda h: Scatter(), "nothing varies"),
        (lambda h: Scatter(C=0.3), "C = 0.3"),
        (lambda h: life(h, scatter=0.3, seed=1), "scatter = 0.3"),
        (lambda h: life(3, scatter=Scatter(C=lognormal(0.1)), seed=1), "history = 3"),
        (lambda h: life(h, scatter=Scatter(K=normal(0.1)), seed=1), "give the law"),
        (lambda h: life(h, paris(1e-11, 3.1), scatter=Scatter(K=normal(0.1)), seed=1), "rates"),
        (lambda h: life(h, scatter=Scatter(a0=lognormal(0.1, 5.0)), seed=1), "smaller crack"),
        (lambda h: life(h, scatter=Scatter(C=lognormal(0.1)), samples=10, seed=1), "samples = 10"),
        (lambda h: life(History(h.steps[:1], ""), scatter=Scatter(C=normal(0.1)), seed=1), "two"),
        (lambda h: inspection(h), "a_detect or interval"),
        (lambda h: inspection(h, a_detect=50.0), "no length of the run"),
        (lambda h: inspection(h, interval=1e4, a_critical=50.0), "beyond the last"),
        (lambda h: inspection(h, interval=-1.0), "interval"),
        (lambda h: inspection(h, interval=1e-9), "longer interval"),
        (lambda h: inspection(3, interval=1.0), "curve = 3"),
        (lambda h: growth_curve(3), "history = 3"),
        (lambda h: logistic_pod(0, 1), "a50 = 0"),
        (lambda h: logistic_pod(1, 1)(-1.0), "at least 0"),
    ],
)
def test_bad_input(history, make, words):
    with pytest.raises(ProblemError, match=words):
        make(history)


@pytest.mark.plot
def test_pictures(history, tmp_path):
    pytest.importorskip("matplotlib")
    result = life(history, scatter=Scatter(C=lognormal(0.3)), samples=1000, seed=80)
    for kind in ("cdf", "density"):
        result.plot(kind, tmp_path / f"{kind}.png")
        assert (tmp_path / f"{kind}.png").stat().st_size > 5000
    with pytest.raises(ProblemError, match="cdf"):
        result.plot("pie", tmp_path / "pie.png")


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_rerate_of_a_turning_crack_is_a_new_run():
    """By elements, in mixed mode: promised 0.1 % for one tip, whose path knows no law.

    Both runs count cycles by three solves, rerating by two: the difference is of second order in
    the advance (0.27, 0.10, 0.05, 0.02 % at 1.5, 1, 0.75, 0.5), of the size of the runs' own
    estimates.
    """
    mesh = box((0.0, -10.0), (20.0, 10.0), (16, 17))
    pull = [traction("top", (40.0, 100.0)), traction("bottom", (-40.0, -100.0))]
    problem = Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(0.0, 0.4), (5.0, 0.4)])],
        supports=[fix((20.0, -10.0)), fix((20.0, 10.0), axis=0)],
        loads=pull,
    )
    cycle, new = Cycle(0.1, 1.0), walker(3e-13, 2.6, 0.5)
    old = run(problem, cycle=cycle, n=9, da=0.75)
    again = run(problem, law=new, cycle=cycle, n=9, da=0.75)
    result = old.rerate(new, LAW)
    assert result.bound == 0
    assert result.life == pytest.approx(again.life, rel=1e-3)
    assert abs(result.life / again.life - 1) < 3 * old.steps[-1].error.cycles / old.life
