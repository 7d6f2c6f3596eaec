"""Wheeler and Willenborg: worked numbers, the delay in closed form, shut-off, and runs."""

import numpy as np
import pytest
from scipy.integrate import quad

from support import exact
from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    History,
    ProblemError,
    Scatter,
    Spectrum,
    grow,
    klesnil_lukas,
    life,
    lognormal,
    max_hoop_stress,
    normal,
    paris,
    plastic_zone,
    retarded,
    walker,
    wheeler,
    willenborg,
)
from xcrack.fatigue.retardation import POINTS, BlockCycles, OverloadZones, march

ZONE = plastic_zone(400.0, beta=2)  # MPa, MPa √m, m
RATE = 1e-11 * 15.0**3


def test_zones():
    assert ZONE(30.0) * 1000 == pytest.approx(0.8952466, abs=5e-8)
    assert ZONE(15.0) * 1000 == pytest.approx(0.2238116, abs=1e-7)
    dugdale = plastic_zone(400.0, beta=8 / np.pi**2)
    assert dugdale(30.0) == pytest.approx(np.pi / 8 * (30 / 400) ** 2, rel=1e-14)


def test_worked_factors_of_wheeler():
    da = np.array([0, 0.1, 0.3, 0.6, 0.671435]) * 1e-3
    expected = [0.125, 0.149304, 0.230557, 0.660004, 1.0]
    assert np.allclose(wheeler(1.5, ZONE).factor(15.0, 30.0, da), expected, atol=2e-6)


def cycles_through(length, K, law, model, overload):
    """Cycles of one kind (K_min, K_max), both constant, behind an overload, over a length."""
    low, high = K
    cycles = BlockCycles(
        np.full((1, 1, 1), high - low), np.full((1, 1, 1), low / high), np.ones((1, 1))
    )
    zones = OverloadZones(np.zeros(1), np.array([model.zone(overload)]), np.array([overload]))
    nodes, x = np.zeros((1, 1)), np.linspace(0, length, POINTS)[:, None]
    order = np.zeros(1, dtype=np.int64)
    grown = march(law, model, order, cycles, nodes, x, zones, length, exponent=3.0)
    assert grown.grown_length == length
    return grown.cycles[-1]


def test_delay_of_wheeler_in_closed_form():
    """Cycles to leave the zone: 82230.054 as an integral, 82232 cycle by cycle, 4.133 times."""
    model = wheeler(1.5, ZONE)
    z, z_over = float(ZONE(15.0)), float(ZONE(30.0))
    closed = (z_over**2.5 - z**2.5) / (2.5 * z**1.5 * RATE)
    by_quad = quad(lambda x: 1 / (RATE * model.factor(15.0, 30.0, x)), 0, z_over - z, epsrel=1e-12)
    assert closed == pytest.approx(82230.054, abs=1e-3)
    assert by_quad[0] == pytest.approx(closed, rel=1e-10)
    cycles = cycles_through(z_over - z, (0.0, 15.0), paris(1e-11, 3.0), model, 30.0)
    assert cycles == pytest.approx(82232, abs=1.5)
    assert cycles / ((z_over - z) / RATE) == pytest.approx(4.133, abs=5e-4)


WILLENBORG = {
    0.0: (8.518519, 6.481481, -7.018519, -1.082857),
    0.2: (6.495335, 8.504665, -4.995335, -0.587364),
    0.5: (2.801751, 12.198249, -1.301751, -0.106716),
    0.8: (0.0, 15.0, 1.5, 0.1),
}


@pytest.mark.parametrize("da", WILLENBORG)
def test_worked_reductions_of_willenborg(da):
    model = willenborg(2.5, 2.0, ZONE)
    K_R, high, low, R = WILLENBORG[da]
    reduction = float(model.reduction(1.5, 15.0, 30.0, da * 1e-3))
    assert reduction == pytest.approx(K_R, abs=6e-7)
    assert 15.0 - reduction == pytest.approx(high, abs=6e-7)
    assert (1.5 - reduction) / (15.0 - reduction) == pytest.approx(R, abs=6e-7)
    assert 1.5 - reduction == pytest.approx(low, abs=6e-7)


def test_willenborg_at_shut_off():
    """K_OL / K_max = S: K_max,eff = ΔK_th / (1 - R), 2.2222222 for 12, 1.2 and 30."""
    model = willenborg(2.5, 2.0, ZONE)
    assert 12.0 - float(model.reduction(1.2, 12.0, 30.0, 0.0)) == pytest.approx(
        2.0 / 0.9, rel=1e-14
    )


def test_willenborg_cycle_by_cycle():
    """Paris, K constant: the integral of 1 / rate(K - K_R) over the zone; table and cycles."""
    model = willenborg(2.5, 2.0, ZONE)
    law = paris(1e-11, 3.0)

    def rate(da):
        reduction = float(model.reduction(1.5, 15.0, 30.0, da))
        return float(law(15.0 - reduction - max(1.5 - reduction, 0.0), 0.0))

    z = float(ZONE(30.0))
    expected = quad(lambda x: 1 / rate(x), 0, z, epsrel=1e-10, limit=200)[0]
    cycles = cycles_through(z, (1.5, 15.0), law, model, 30.0)
    assert cycles == pytest.approx(expected, rel=1e-4)
    assert cycles > 2 * z / float(law(13.5, 0.1))


def summed(factors, K_of, law, model, a, last):
    """Cycles until a length, one after the other in plain Python: max, then growth of each."""
    over_a, over_size, over_K, count = -np.inf, 0.0, 0.0, 0
    low, high = factors[0::2], factors[1::2]
    while True:
        for least, most in zip(low, high):
            unit = K_of(a)
            K, dK = most * unit, (most - least) * unit
            own = model.zone.factor * K**2
            if a + own >= over_a + over_size:
                over_a, over_size, over_K = a, own, K
            if isinstance(model, wheeler):
                left = over_a + over_size - a
                growth = law.C * dK**law.m * (own / left if own < left else 1.0) ** model.w
            else:
                phi = max(1 - model.dK_th / dK, 0.0) / (model.shutoff - 1)
                left = np.sqrt(max(1 - (a - over_a) / over_size, 0.0))
                K_R = max(phi * (over_K * left - K), 0.0)
                growth = law.C * (max(K - K_R, 0.0) - max(K - dK - K_R, 0.0)) ** law.m
            if a + growth >= last:
                return count + (last - a) / growth
            a, count = a + growth, count + 1


MODELS = [
    wheeler(1.2, plastic_zone(300.0, beta=2)),
    willenborg(2.5, 10.0, plastic_zone(300.0, beta=2)),
]


@pytest.mark.parametrize("model", MODELS)
def test_in_a_run_and_along_its_path_it_is_a_plain_sum_over_cycles(model):
    """Where K is a formula of a: discretisation of K over steps leaves 1.3e-6 of 300 blocks."""
    law, da = paris(5e-12, 3.0), 0.25
    spectrum = Spectrum([*([0.05, 0.5] * 50), 0.05, 1.0])
    options = {"da": da, "max_steps": 9, "progress": False, "response": formula(mode_I())}
    plain, run = (
        list(grow(plate(), law, max_hoop_stress, spectrum, retardation=each, **options))
        for each in (None, model)
    )
    along = retarded(History(tuple(plain), ""), law, spectrum, model, nu=0.3).life
    a = [run[n].cracks[0].points[-1, 0] for n in (0, -1)]
    factors = np.array(spectrum.factors)
    blocks = summed(factors, lambda a: STRESS * np.sqrt(np.pi * a), law, model, *a) / 51
    assert run[-1].cycles == pytest.approx(blocks, rel=3e-6)
    assert along == pytest.approx(blocks, rel=3e-6)


# --- along the path of a run ---------------------------------------------------------------------


def history_of(spectrum, law, n=6, da=1.0):
    options = {"da": da, "max_steps": n, "progress": False, "response": formula(mode_I())}
    return History(tuple(grow(plate(), law, max_hoop_stress, spectrum, **options)), "")


@pytest.fixture
def overload():
    """200 small cycles and one that is twice as large; mm and MPa √mm."""
    factors = [*([0.05, 0.5] * 200), 0.05, 1.0]
    return Spectrum(factors)


LAW = paris(5e-13, 3.0)
ZONES = plastic_zone(300.0, beta=2)


def test_without_a_model_it_is_the_run(overload):
    """Block rates against cycle by cycle: the growth of a block is small against the length."""
    history = history_of(overload, LAW)
    result = retarded(history, LAW, overload, None, nu=0.3)
    assert result.life == pytest.approx(history.life, rel=1e-3)
    assert np.allclose(result.a, 5.0 + np.arange(6), rtol=1e-12)
    assert result.ended == ""
    closed = exact.paris_life(5, 10, 5e-13, 3, STRESS) / (200 * 0.45**3 + 0.95**3)
    assert result.life == pytest.approx(closed, rel=1e-3)


def test_wheeler_and_willenborg_retard(overload):
    """Wheeler against an own loop; both slower than without, a larger w slower still."""
    law = paris(5e-12, 3.0)
    history = history_of(overload, law)
    plain = retarded(history, law, overload, None, nu=0.3).life
    lives = {}
    for w in (0.5, 1.0, 1.5):
        lives[w] = retarded(history, law, overload, wheeler(w, ZONES), nu=0.3).life
    assert plain < lives[0.5] < lives[1.0] < lives[1.5]
    slow = retarded(history, law, overload, willenborg(2.5, 10.0, ZONES), nu=0.3).life
    assert slow > 1.2 * plain
    assert lives[1.0] == pytest.approx(own_loop(law, 1.0), rel=2e-3)


def own_loop(law, w):
    """Wheeler with K = stress √(π a) and nothing of the kernel: blocks from 5 to 10."""
    a, zone_end, cycles, n = 5.0, 0.0, 0, 201
    order = [0.5] * 200 + [1.0]
    while a < 10.0:
        top = order[cycles % n]
        K = top * STRESS * np.sqrt(np.pi * a)
        own = ZONES.factor * K**2
        grows = law.C * ((top - 0.05) * STRESS * np.sqrt(np.pi * a)) ** law.m
        if a + own >= zone_end:
            zone_end = a + own
        else:
            grows *= (own / (zone_end - a)) ** w
        a += grows
        cycles += 1
    return cycles / n


def test_a_large_overload_stops_the_crack(overload):
    """Shut-off below the ratio of the overload: small cycles do nothing, the overloads all."""
    law = paris(5e-12, 3.0)
    history = history_of(overload, law, n=3)
    stopped = retarded(history, law, overload, willenborg(1.5, 0.0, ZONES), nu=0.3)
    assert stopped.ended == ""
    alone = retarded(history, law, overload.omit(0.9), None, nu=0.3).life
    assert stopped.life == pytest.approx(alone, rel=0.02)


def test_samples_go_cycle_by_cycle(overload):
    """A factor on the rate is no factor on the life: each sample is a life of its own law."""
    law = paris(5e-11, 3.0)
    history, model = history_of(overload, law, n=4), wheeler(1.5, ZONES)
    given = {"spectrum": overload, "criterion": max_hoop_stress, "nu": 0.3, "retardation": model}
    scatter = Scatter(C=lognormal(0.3))
    result = life(history, law, scatter=scatter, samples=100, seed=98, **given)
    plain = retarded(history, law, overload, model, nu=0.3).life
    assert result.life == plain
    for k in (4, 50, 95):  # samples of C are one in each hundredth
        C = scatter.draw(100, 98)["C"]
        factor = np.sort(C)[::-1][k]
        own = retarded(history, paris(5e-11 * factor, 3.0), overload, model, nu=0.3).life
        assert result.N[k] == pytest.approx(own, rel=1e-12)
    assert abs(np.log(result.N[95] / result.N[4]) / np.log(C.max() / C.min()) - 1) > 0.02
    assert np.isnan(result.bounds["steps"])
    assert "error of steps: not known" in str(result)
    varies = Scatter(K=normal(0.02), constants={"m": normal(0.01)})
    both = life(history, law, scatter=varies, samples=100, seed=99, **given)
    assert both.percentile(5) < plain < both.percentile(95)
    never = life(history, law, scatter=scatter, samples=100, seed=98, max_blocks=0.5, **given)
    assert np.isinf(never.N).all()


def test_samples_with_retardation_that_are_refused(overload):
    law, model = paris(5e-11, 3.0), wheeler(1.0, ZONES)
    history = history_of(overload, law, n=2)
    given = {"spectrum": overload, "criterion": max_hoop_stress, "nu": 0.3, "retardation": model}
    with pytest.raises(ProblemError, match="goes cycle by cycle: give law, spectrum"):
        life(history, law, scatter=Scatter(C=lognormal(0.3)), seed=1, retardation=model)
    with pytest.raises(ProblemError, match="a run of its own"):
        life(history, law, scatter=Scatter(a0=lognormal(0.3, 9.0)), seed=1, **given)
    with pytest.raises(ProblemError, match="retardation = 3"):
        life(history, law, scatter=Scatter(C=lognormal(0.3)), seed=1, **{**given, "retardation": 3})
    with pytest.raises(ProblemError, match="max_blocks"):
        life(history, law, scatter=Scatter(C=lognormal(0.3)), seed=1, max_blocks=0, **given)


def test_why_it_ends(overload):
    history = history_of(overload, LAW)
    least = paris(5e-13, 3.0, threshold=klesnil_lukas(1e4, 0.0))
    assert (
        retarded(history, least, overload, None, nu=0.3).ended == "a whole block lets nothing grow"
    )
    short = retarded(history, LAW, overload, None, nu=0.3, max_blocks=3)
    assert short.ended == "max_blocks = 3 reached"
    assert short.life == pytest.approx(3)
    brittle = paris(5e-13, 3.0, K_c=STRESS * np.sqrt(np.pi * 7.0))
    result = retarded(history, brittle, overload, None, nu=0.3)
    assert "toughness" in result.ended
    assert 6.0 <= result.a[-1] <= 7.1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"history": 3}, "history = 3"),
        ({"law": 3}, "law = 3"),
        ({"law": walker(1e-11, 3, 0.5, ratio="nominal")}, "nominal"),
        ({"spectrum": Spectrum(rows=[(0, 1, 1)])}, "no order in time"),
        ({"model": 1.5}, r"model = 1\.5"),
        ({"nu": 0.5}, "nu"),
        ({"max_blocks": 0}, "max_blocks"),
    ],
)
def test_bad_input(overload, change, words):
    given = {
        "history": history_of(overload, LAW, n=2),
        "law": LAW,
        "spectrum": overload,
        "model": None,
        "nu": 0.3,
        **change,
    }
    with pytest.raises(ProblemError, match=words):
        retarded(**given)


def test_other_bad_input(overload):
    history = history_of(Cycle(0.0, 1.0), LAW, n=2)
    with pytest.raises(ProblemError, match="not made with a Spectrum"):
        retarded(history, LAW, overload, None, nu=0.3)
    for make, words in (
        (lambda: wheeler(0, ZONE), "w = 0"),
        (lambda: wheeler(1, 3), "zone = 3"),
        (lambda: willenborg(1.0, 1.0, ZONE), "shutoff"),
        (lambda: plastic_zone(0, 1), "sigma_y"),
    ):
        with pytest.raises(ProblemError, match=words):
            make()
