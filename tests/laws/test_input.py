"""Laws, closures, thresholds and presets with wrong input: a clear error each."""

import numpy as np
import pytest

from xcrack import (
    ProblemError,
    el_haddad,
    forman,
    hartman_schijve,
    klesnil_lukas,
    law,
    linear_closure,
    nasgro,
    nasgro3_threshold,
    nasgro4_threshold,
    nasgro_K_c,
    newman_closure,
    paris,
    piecewise,
    rate_table,
    schijve_closure,
    stepped_threshold,
    walker,
)

NEWMAN = newman_closure(2.0, 0.3)
V3 = nasgro3_threshold(dK0=2.0, C_th=1.0, a0=38.1e-6)
POINTS = ([10, 20], [1e-8, 1e-7])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: newman_closure(0.9, 0.3), "alpha = 0.9"),
        (lambda: newman_closure(2, 1.1), "S = 1.1"),
        (lambda: linear_closure(0.5, np.nan, (-0.1, 0.7)), "b = nan"),
        (lambda: linear_closure(0.5, 0.4, (0.7, -0.1)), "lowest, highest"),
        (lambda: linear_closure(0.5, 0.4, (-0.1, 0.7))(-1.0), "R = -1 is outside -0.1 to 0.7"),
        (lambda: schijve_closure(0.55, 0.33, 0.12)(-1.5), "outside -1 to 1"),
        (lambda: klesnil_lukas(0.0, 0.5), "dK0 = 0.0"),
        (lambda: stepped_threshold((0.5, 0), (1, 1, 1), 0), "in order"),
        (lambda: el_haddad(3.0, 1e-4), "klesnil_lukas or stepped"),
        (lambda: el_haddad(klesnil_lukas(6, 0.5), 1e-4)(0.0), "crack size a is needed"),
        (lambda: el_haddad(klesnil_lukas(6, 0.5), 1e-4)(0.0, a=-1.0), "a crack size is positive"),
        (
            lambda: nasgro4_threshold(dK1=1, C_th_plus=1, C_th_minus=1, a0=0, R_clip=1.0),
            "R_clip = 1",
        ),
        (lambda: paris(1e-11, 3, closure=0.5), "closure = 0.5"),
        (lambda: paris(1e-11, 3, threshold=V3), "holds Newman's opening function"),
        (lambda: paris(1e-11, 3, approach="difference"), "without a threshold"),
        (
            lambda: paris(1e-11, 3, threshold=klesnil_lukas(6, 0), approach="soft"),
            "approach = 'soft'",
        ),
        (lambda: paris(1e-11, 3, ratio="both"), "ratio = 'both'"),
        (lambda: paris(1e-11, 3, K_c=0), "K_c = 0"),
        (lambda: paris(1e-11, 3, R_range=(0, 0.5))(10.0, 0.7), "R = 0.7 is outside 0 to 0.5"),
        (lambda: walker(1e-11, 3, 0.5, -0.1), "gamma_minus = -0.1"),
        (lambda: forman(1e-8, 3, K_c=-1), "K_c = -1"),
        (lambda: hartman_schijve(1e-8, 3, 40, -1), "dK_thr = -1"),
        (lambda: nasgro(1e-9, 3, 1, 1, 40, schijve_closure(1, 0, 0), V3), "give newman_closure"),
        (lambda: nasgro(1e-9, 3, 1, 1, 40, NEWMAN, klesnil_lukas(6, 0)), "whichever the constants"),
        (lambda: nasgro(1e-9, 3, -1, 1, 40, NEWMAN, V3), "p = -1"),
        (lambda: nasgro(1e-9, 3, 1, 1, 40, NEWMAN, V3)(10.0, 0.1), "crack size a is needed"),
        (lambda: nasgro_K_c(30, 0, 1, 1, 1), "sigma_y = 0"),
        (lambda: piecewise([]), "pieces"),
        (lambda: piecewise([(1e-11, 3), (1e-10, 3)]), "do not cross"),
        (lambda: piecewise([(1e-20, 5), (1e-11, 3)], knees=[1, 2]), "knees has the shape"),
        (lambda: piecewise([(1, 4), (1, 3), (2, 2)], knees=[3, 2]), "do not rise"),
        (lambda: rate_table({}), "give a dict"),
        (lambda: rate_table(((0.1, (10, 20)),)), "give a dict"),
        (lambda: rate_table({0.1: ([1, 1], [1, 2])}), "positive and rising"),
        (lambda: rate_table({0.1: 3}), r"give \(dK, rate\)"),
        (lambda: rate_table({1.0: POINTS}), "R = 1"),
        (lambda: rate_table({0.1: POINTS, 0.5: ([1, 2], [1, 2])}), "no rates in common"),
        (lambda: rate_table({0.1: POINTS, 0.5: ([11, 21], [1e-8, 1e-7])}), "Walker's exponent"),
        (lambda: rate_table({0.1: POINTS, 0.5: ([1, 2], [1e-8, 1e-7])}), "Walker's exponent"),
        (lambda: rate_table({0.1: POINTS, 0.5: POINTS})(15.0, 0.0), "R = 0 is outside 0.1 to 0.5"),
        (lambda: rate_table({0.1: POINTS}, outside="guess"), "outside = 'guess'"),
        (lambda: law("BS 7910", units="mm, N/mm^1.5"), "no preset 'BS 7910'"),
        (lambda: law("AA7050-T7451 NASGRO", units=None), "units = None"),
        (lambda: law("AA7050-T7451 NASGRO", units="mm, MPa√m"), "root of another length"),
        (lambda: law("BS 7910 steel air mean R<0.5", units="m, MPa√m")(10.0, 0.6), "R = 0.6"),
        (lambda: paris(1e-11, 3).to("m", "mm"), "give length and K"),
        (lambda: paris(1e-11, 3).to("ft, ksi√in", "mm, MPa√mm"), "lengths are"),
        (lambda: paris(1e-11, 3).to("m, bar√m", "mm, MPa√mm"), "no unit of K"),
    ],
)
def test_errors(make, words):
    with pytest.raises(ProblemError, match=words):
        make()


def test_a_preset_needs_units():
    with pytest.raises(TypeError, match="units"):
        law("AA7050-T7451 NASGRO")


def test_a_range_of_zero_has_any_ratio():
    assert paris(1e-11, 3, R_range=(0, 0.5))(0.0, 0.9) == 0
