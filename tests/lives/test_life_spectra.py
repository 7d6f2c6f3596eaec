"""Lives and rerating under spectra, constants of the law that vary, correlation."""

import pickle
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
    Scatter,
    Spectrum,
    box,
    fix,
    grow,
    klesnil_lukas,
    life,
    line_crack,
    lognormal,
    max_hoop_stress,
    normal,
    paris,
    solve,
    stress_intensity,
    traction,
    walker,
)

LAW = paris(1e-11, 3.0)
FLIGHT = Spectrum([0.0, 1.0, 0.4, 0.6, 0.1, 0.9, 0.3], unit="flight")
GIVEN = {"criterion": max_hoop_stress, "nu": 0.3}

FORMULA = formula(mode_I())
ENDS = [("top", 1.0), ("bottom", -1.0)]


def run(law=LAW, cycle=FLIGHT, n=12, da=3.0, problem=None, **options):
    options = {"da": da, "max_steps": n, "progress": False, "response": FORMULA, **options}
    return History(tuple(grow(problem or plate(), law, max_hoop_stress, cycle, **options)), "")


def equivalent(m, spectrum=FLIGHT):
    """Sum of the cycles' ranges to the power m."""
    cycles = spectrum.cycles
    return float((cycles["count"] * (cycles["max"] - cycles["min"]) ** m).sum())


def closed_form(m=3.0, C=1e-11, factor=1.0):
    return exact.paris_life(5.0, 38.0, C, m, factor * STRESS) / equivalent(m)


# --- under a spectrum ----------------------------------------------------------------------------


def test_rerate_is_a_new_run_of_the_spectrum():
    """Closed form of Paris; and a law with R and a threshold that cuts some cycles, by a run."""
    history = run()
    assert history.life == pytest.approx(closed_form(), rel=1e-9)
    steeper = paris(2e-12, 3.5)
    again = history.rerate(steeper, LAW, spectrum=FLIGHT, **GIVEN)
    assert again.life == pytest.approx(closed_form(3.5, 2e-12), rel=1e-9)
    other = walker(1e-11, 2.8, 0.6, threshold=klesnil_lukas(0.3 * STRESS * np.sqrt(np.pi * 9), 0.0))
    new = run(law=other)
    again = history.rerate(other, LAW, spectrum=FLIGHT, **GIVEN)
    assert again.life == pytest.approx(new.life, rel=1e-3)  # of second order in the advance
    assert again.bound == 0


def test_a_threshold_of_the_run_is_that_of_the_rerating():
    least = 0.5 * STRESS * np.sqrt(np.pi * 5)
    history = run(threshold=least)
    given = {"spectrum": FLIGHT, **GIVEN}
    assert history.rerate(LAW, LAW, threshold=least, **given).life == pytest.approx(
        history.life, rel=1e-12
    )
    with pytest.raises(ProblemError, match="other rates"):
        history.rerate(LAW, LAW, **given)


def test_several_tips_under_a_spectrum():
    """Two cracks: within the printed bound of a new run, refused where the path would differ."""
    cracks = [line_crack([(0.0, y), (a, y)]) for y, a in ((-9.63, 5.0), (9.63, 4.9))]
    history = run(problem=plate(cracks, n=(24, 16)), n=3, da=0.8)
    given = {"spectrum": FLIGHT, **GIVEN}
    other = paris(1e-11, 3.1)
    again, new = (
        history.rerate(other, LAW, **given),
        run(law=other, problem=plate(cracks, n=(24, 16)), n=3, da=0.8),
    )
    assert 0 < again.bound < 0.02
    assert abs(again.life / new.life - 1) <= again.bound
    with pytest.raises(ProblemError, match="the path would differ"):
        history.rerate(paris(1e-11, 12.0), LAW, **given)
    scatter = Scatter(constants={"m": normal(0.01)})
    assert (
        0 < life(history, LAW, scatter=scatter, samples=200, seed=3, **given).bounds["tips"] < 0.02
    )
    with pytest.raises(ProblemError, match="cases of a campaign"):
        life(history, LAW, scatter=Scatter(constants={"m": lognormal(0.7)}), seed=3, **given)


def test_K_and_load_of_a_spectrum_by_the_closed_form():
    """A power of K is exact between the factors at which the law is asked."""
    history = run()
    for name in ("K", "load"):
        scatter = Scatter(**{name: lognormal(0.1)})
        result = life(
            history, LAW, scatter=scatter, samples=20_000, seed=91, spectrum=FLIGHT, **GIVEN
        )
        for p in (5, 50, 95):
            factor = float(scatter.parts[name].quantile(1 - p / 100))
            assert result.percentile(p) == pytest.approx(closed_form(factor=factor), rel=1e-3)
    assert result.bounds["levels"] == 0
    assert result.bounds["steps"] < 1e-9
    assert result.unit == "flight"


def test_samples_of_a_spectrum_are_runs_with_other_loads():
    """Thresholds and R: the sample of a factor is the life of the scaled spectrum."""
    law = walker(1e-11, 2.8, 0.6, threshold=klesnil_lukas(0.3 * STRESS * np.sqrt(np.pi * 9), 0.4))
    history = run(law=law)
    scatter = Scatter(load=lognormal(0.1))
    result = life(history, law, scatter=scatter, samples=2000, seed=92, spectrum=FLIGHT, **GIVEN)
    for p in (10, 50, 90):
        new = run(law=law, cycle=FLIGHT.scaled(float(scatter.load.quantile(1 - p / 100))))
        assert result.percentile(p) == pytest.approx(new.life, rel=2e-3)


def test_named_states_are_counted_again():
    """States and a sequence: the same block as its factors."""
    states = Spectrum(states=[0.0, 0.4, 0.6, 1.0], sequence=[0, 3, 1, 2, 1, 3])
    history = run(cycle=states)
    again = history.rerate(paris(1e-11, 3.3), LAW, spectrum=states, **GIVEN)
    new = run(law=paris(1e-11, 3.3), cycle=states)
    assert again.life == pytest.approx(new.life, rel=1e-9)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_levels_are_a_source_of_their_own():
    """Steady bending shuts the crack: K bends over the factor. By elements, two short steps."""
    bend = lambda s: lambda x: np.stack([0 * x[:, 0], s * 6 * (x[:, 0] - 10)], axis=1)  # noqa: E731
    factors = np.random.default_rng(20267).uniform(0.0, 1.0, 60)
    steady = [traction("top", bend(1)), traction("bottom", bend(-1))]
    spectrum = Spectrum(factors, steady=steady, tolerance=0.05)
    problem = Problem(
        box((0.0, -10.0), (20.0, 10.0), (12, 13)),
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(0.0, 0.4), (6.0, 0.4)])],
        supports=[fix((20.0, -10.0)), fix((20.0, 10.0), axis=0)],
        loads=[traction("top", (0.0, 100.0)), traction("bottom", (0.0, -100.0))],
    )
    steps = list(grow(problem, LAW, max_hoop_stress, spectrum, da=1.5, max_steps=2, progress=False))
    history = History(tuple(steps), "")
    assert len(history.steps[0].levels) > 4
    given = {"spectrum": spectrum, **GIVEN}
    assert history.rerate(LAW, LAW, **given).life == pytest.approx(history.life, rel=1e-9)
    result = life(history, LAW, scatter=Scatter(K=normal(0.02)), samples=500, seed=93, **given)
    assert 1e-5 < result.bounds["levels"] < 0.05
    with pytest.raises(ProblemError, match="not in proportion"):
        life(history, LAW, scatter=Scatter(load=normal(0.02)), seed=93, **given)


def test_best_K_of_a_spectrum_is_rated_again():
    """Where K has bars growth follows the best K, and so does rerating."""
    lines = [line_crack([(0.0, 0.37), (5.0, 0.37)])]
    pulled = replace(plate(lines, n=(24, 16)), loads=[traction(s, (0, q)) for s, q in ENDS])
    known = stress_intensity(solve(pulled, error=True)).errors

    def with_bars(*given):
        response = FORMULA(*given)
        bars = [
            [
                replace(
                    sif,
                    errors=replace(known, eta=0.1 * sif.K, bar=0.01 * np.abs(sif.K), contact=None),
                )
                for sif in state
            ]
            for state in response.sif
        ]
        return replace(response, sif=bars)

    history = run(n=5, response=with_bars)
    assert history.life == pytest.approx(
        exact.paris_life(5.0, 17.0, 1e-11, 3.0, 1.1 * STRESS) / equivalent(3.0), rel=1e-9
    )
    again = history.rerate(LAW, LAW, spectrum=FLIGHT, **GIVEN)
    assert again.life == pytest.approx(history.life, rel=1e-12)


def test_steps_and_K_are_those_of_the_run_where_it_estimated_them():
    history = run(cycle=Cycle(0.0, 1.0), n=5)
    last = history.steps[-1]
    error = replace(last.error, cycles=0.01 * last.cycles, K=30.0, contact=2.0, unknown=1.0)
    known = History((*history.steps[:-1], replace(last, error=error)), "")
    bounds = life(known, LAW, scatter=Scatter(C=normal(0.1)), samples=100, seed=1).bounds
    assert bounds["steps"] == pytest.approx(0.01, rel=1e-12)
    assert bounds["K"] == pytest.approx(33.0 / last.cycles, rel=1e-12)


# --- constants of the law ------------------------------------------------------------------------


def test_a_constant_of_the_law_by_the_closed_form():
    history = run(cycle=Cycle(0.0, 1.0))
    scatter = Scatter(constants={"m": normal(0.02)})
    result = life(history, LAW, scatter=scatter, samples=4000, seed=94)
    for p in (5, 50, 95):
        m = 3.0 * float(scatter.constants["m"].quantile(1 - p / 100))
        assert result.percentile(p) == pytest.approx(
            exact.paris_life(5.0, 38.0, 1e-11, m, STRESS), rel=2e-3
        )
    assert result.scatter["m"] == (result.percentile(5), result.percentile(95))


def test_C_and_m_of_one_regression():
    """ln C_p and m independent at a range K_p: the same lives from (ln C, m) with correlation."""
    history = run(cycle=Cycle(0.0, 1.0))
    K_p, s_p, s_m = 800.0, 0.2, 0.1
    s_C = np.hypot(s_p, np.log(K_p) * s_m)
    rho = -np.log(K_p) * s_m / s_C
    scatter = Scatter(
        C=lognormal(s_C), constants={"m": normal(s_m / 3.0)}, correlation={("C", "m"): rho}
    )
    result = life(history, LAW, scatter=scatter, samples=4_000, seed=95)
    draw = np.random.default_rng(95)
    m = 3.0 + s_m * draw.standard_normal(400_000)
    C = 1e-11 * K_p**3.0 / K_p**m * np.exp(s_p * draw.standard_normal(len(m)))
    rate = C * STRESS**m * np.pi ** (m / 2)
    N = (5.0 ** (1 - m / 2) - 38.0 ** (1 - m / 2)) / ((m / 2 - 1) * rate)
    for p in (5, 50, 95):  # statistical
        assert result.percentile(p) == pytest.approx(float(np.quantile(N, p / 100)), rel=0.01)
    loose = Scatter(C=lognormal(s_C), constants={"m": normal(s_m / 3.0)})
    wide = life(history, LAW, scatter=loose, samples=1_000, seed=95)
    assert np.log(wide.N).std() > 4 * np.log(result.N).std()


def test_draws_have_their_margins_and_their_correlation():
    scatter = Scatter(
        C=lognormal(0.3),
        K=normal(0.02),
        constants={"m": normal(0.05)},
        correlation={("C", "m"): -0.9, ("K", "m"): 0.3},
    )
    drawn = scatter.draw(20_000, 96)
    assert np.std(np.log(drawn["C"])) == pytest.approx(0.3, rel=1e-3)
    assert np.std(drawn["m"]) == pytest.approx(0.05, rel=1e-3)
    logs = np.stack([np.log(drawn["C"]), drawn["K"], drawn["m"]])
    assert np.allclose(np.corrcoef(logs), [[1, 0, -0.9], [0, 1, 0.3], [-0.9, 0.3, 1]], atol=0.02)
    again = pickle.loads(pickle.dumps(scatter)).draw(20_000, 96)
    assert all(np.array_equal(again[name], drawn[name]) for name in drawn)


def test_constants_of_parts_and_of_spectra():
    law = paris(1e-11, 3.0, threshold=klesnil_lukas(0.3 * STRESS * np.sqrt(np.pi * 5), 0.0))
    history = run(law=law)
    scatter = Scatter(constants={"threshold.dK0": lognormal(0.3)}, load=lognormal(0.05))
    begin = time.perf_counter()
    result = life(history, law, scatter=scatter, samples=2000, seed=97, spectrum=FLIGHT, **GIVEN)
    assert time.perf_counter() - begin < 5
    low, high = result.scatter["threshold.dK0"]
    assert low < history.life < high


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Scatter(constants=3), "constants = 3"),
        (lambda: Scatter(constants={"C": normal(0.1)}), "arguments of their own"),
        (lambda: Scatter(constants={"m": 0.1}), r"m = 0\.1"),
        (lambda: Scatter(C=normal(0.1), correlation={("C", "m"): 0.5}), "pairs of what varies"),
        (lambda: Scatter(C=normal(0.1), correlation=[1]), "correlation ="),
        (
            lambda: Scatter(C=normal(0.1), K=normal(0.1), correlation={("C", "K"): 1.5}),
            r"1\.5: give it in",
        ),
        (
            lambda: Scatter(
                C=normal(0.1),
                K=normal(0.1),
                load=normal(0.1),
                correlation={("C", "K"): 0.9, ("C", "load"): 0.9, ("K", "load"): -0.9},
            ),
            "no sample has these correlations",
        ),
    ],
)
def test_scatter_that_makes_no_sense(make, words):
    with pytest.raises(ProblemError, match=words):
        make()


def test_what_life_and_rerate_refuse():
    history, given = run(n=4), {"spectrum": FLIGHT, **GIVEN}
    varies = Scatter(K=normal(0.01))
    with pytest.raises(ProblemError, match="has no constant 'n' that can vary: give one of C, m"):
        life(history, LAW, scatter=Scatter(constants={"n": normal(0.01)}), seed=1, **given)
    with pytest.raises(ProblemError, match="has no constant 'm'"):
        life(
            run(law=lambda dK, R: 1e-11 * dK**3, cycle=Cycle(0.0, 1.0), n=4),
            lambda dK, R: 1e-11 * dK**3,
            scatter=Scatter(constants={"m": normal(0.01)}),
            seed=1,
        )
    with pytest.raises(ProblemError, match="another one than that of step 0"):
        life(history, LAW, scatter=varies, seed=1, **{**given, "spectrum": Spectrum([0.0, 2.0])})
    with pytest.raises(ProblemError, match="spectrum = None"):
        life(history, LAW, scatter=varies, seed=1, **GIVEN)
    with pytest.raises(ProblemError, match="criterion = None"):
        history.rerate(LAW, spectrum=FLIGHT, nu=0.3)
    with pytest.raises(ProblemError, match="threshold belongs to a spectrum"):
        history.rerate(LAW, threshold=3.0)
    nominal = walker(1e-11, 3.0, 0.5, ratio="nominal")
    with pytest.raises(ProblemError, match="K with contact alone"):
        history.rerate(nominal, spectrum=FLIGHT, **GIVEN)
    with pytest.raises(ProblemError, match="m varies: give the law"):
        life(history, scatter=Scatter(constants={"m": normal(0.01)}), seed=1)
