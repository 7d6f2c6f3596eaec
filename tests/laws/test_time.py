"""Growth in time beside growth by cycles: closed forms, units, a run, wrong input."""

import numpy as np
import pytest
from scipy.integrate import quad

from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    ProblemError,
    el_haddad,
    grow,
    klesnil_lukas,
    max_hoop_stress,
    newman_closure,
    paris,
    time_rate,
    walker,
    with_time,
)
from xcrack.testing import check_law

BASE = paris(1e-8, 3.0)


def test_dwell_at_the_maximum():
    """C ΔK^m + t C' K_max^n."""
    law = with_time(BASE, time_rate(1e-9, 2.0), period=50.0)
    wanted = 1e-8 * 20.0**3 + 50.0 * 1e-9 * (20.0 / 0.6) ** 2
    assert law(20.0, 0.4) == pytest.approx(wanted, rel=1e-14)
    assert law(0.0, 0.0) == 0
    check_law(law)


def test_along_a_triangle():
    """(K_max^(n+1) - K_min^(n+1)) / ((n+1) ΔK): round-off of 128 points of a polynomial."""
    law = with_time(BASE, time_rate(1e-9, 4.0), period=50.0, wave="triangle")
    high, low = 20.0 / 0.7, 6.0 / 0.7
    wanted = 50e-9 * (high**5 - low**5) / (5 * 20.0)
    assert law(20.0, 0.3) - BASE(20.0, 0.3) == pytest.approx(wanted, rel=1e-12)


def test_along_a_sine():
    """sin² of the half period: K_max^n times the mean of sin^2n, (2n - 1)!! / (2n)!!."""
    law = with_time(BASE, time_rate(1e-9, 3.0), period=50.0, wave="sine")
    wanted = 50e-9 * 20.0**3 * (1 * 3 * 5) / (2 * 4 * 6)
    assert law(20.0, 0.0) - BASE(20.0, 0.0) == pytest.approx(wanted, rel=1e-12)


def test_threshold_and_plateau():
    """Kinks within the wave, against scipy; they lie anywhere between points of a panel."""
    rate = time_rate(1e-9, 3.0, K_th=8.0, plateau=4e-6)
    assert rate(8.0) == rate(-30.0) == 0
    assert rate(8.0 + 1e-9) == pytest.approx(512e-9)
    assert rate(300.0) == 4e-6
    for wave, rise in (("triangle", lambda x: x), ("sine", lambda x: np.sin(np.pi * x / 2) ** 2)):
        mean = quad(lambda x, rise=rise: float(rate(20.0 * rise(x))), 0, 1, limit=400)[0]
        law = with_time(BASE, rate, period=1.0, wave=wave)
        assert law(20.0, 0.0) - BASE(20.0, 0.0) == pytest.approx(mean, rel=2e-3)


def test_units():
    """A held cycle in m and MPa√m is the same in mm and N/mm^1.5."""
    law = with_time(walker(2e-11, 3.0, 0.6), time_rate(3e-13, 2.5, 5.0, 1e-8), period=60.0)
    other = law.to("m, MPa√m", "mm, N/mm^1.5")
    dK = np.array([10.0, 20.0, 40.0])
    assert np.allclose(other(dK * np.sqrt(1000), 0.2), 1000 * law(dK, 0.2), rtol=1e-12)


def test_what_a_law_asks_for_is_handed_on():
    small = paris(1e-8, 3.0, threshold=el_haddad(klesnil_lukas(5.0, 0.0), 0.1))
    law = with_time(small, time_rate(1e-9, 2.0), period=1.0)
    assert law.needs == ("a",)
    assert law(6.0, 0.0, a=0.01) == pytest.approx(small(6.0, 0.0, a=0.01) + 36e-9)
    closed = with_time(paris(1, 2, closure=newman_closure(2.0, 0.3)), time_rate(1, 1), 1.0)
    assert closed.closure is not None
    assert closed.knows_negative_ratios
    assert closed.ratio is None
    plain = with_time(lambda dK, R: 1e-9 * dK**2, time_rate(1, 1), 1.0)
    assert (plain.needs, plain.ratio, plain.knows_negative_ratios) == ((), None, False)


def test_a_run():
    """Cycles against quadrature of both rates over the length: second order in the steps."""
    response = formula(mode_I())
    law = with_time(paris(1e-12, 3.0), time_rate(1e-9, 2.0), period=2.0)
    steps = list(
        grow(
            plate(),
            law,
            max_hoop_stress,
            Cycle(0.1, 1.0),
            da=1.0,
            max_steps=6,
            progress=False,
            response=response,
        )
    )

    def K(a):
        return STRESS * np.sqrt(np.pi * a)

    wanted = quad(lambda a: 1 / (1e-12 * (0.9 * K(a)) ** 3 + 2e-9 * K(a) ** 2), 5, 10)[0]
    assert steps[-1].cycles == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: time_rate(0, 1), "time_rate: C"),
        (lambda: time_rate(1, -1), "time_rate: n"),
        (lambda: time_rate(1, 1, -1), "K_th"),
        (lambda: time_rate(1, 1, plateau=0), "plateau"),
        (lambda: with_time(3, time_rate(1, 1), 1), "law = 3"),
        (lambda: with_time(BASE, BASE, 1), "give time_rate"),
        (lambda: with_time(BASE, time_rate(1, 1), 0), "period"),
        (lambda: with_time(BASE, time_rate(1, 1), 1, "saw"), "wave"),
        (lambda: with_time(BASE, time_rate(1, 1), 1)(1.0, 1.1), "at most 1"),
        (lambda: with_time(lambda dK, R: dK, time_rate(1, 1), 1).to("m, MPa√m", "mm, MPa√m"),
         "by hand"),
    ],
)  # fmt: skip
def test_bad_input(make, words):
    with pytest.raises(ProblemError, match=words):
        make()
