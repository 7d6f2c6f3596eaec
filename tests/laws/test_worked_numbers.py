"""Laws, closures and thresholds against published tables and numbers worked out beside the code.

Numbers without a source were computed twice in decimal arithmetic, in two systems of units.
"""

import numpy as np
import pytest

from xcrack import (
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
    presets,
    rate_table,
    schijve_closure,
    stepped_threshold,
    walker,
)

NEWMAN = newman_closure(alpha=2.0, S=0.3)
V4 = nasgro4_threshold(dK1=0.80, C_th_plus=2.20, C_th_minus=0.1, a0=38.1e-6, R_clip=0.7)
NASGRO = nasgro(6.35e-10, 2.5, 1, 1, K_c=35.16, closure=NEWMAN, threshold=V4)
A = 0.01

OPENING = {
    -3: (0.161856340, 0.209535915), -2: (0.161856340, 0.279381220),
    -1: (0.243756340, 0.378121830), -0.5: (0.284706340, 0.476862440),
    0: (0.325656340, 0.674343660), 0.1: (0.342171862, 0.730920153),
    0.3: (0.420353870, 0.828065900), 0.5: (0.548065670, 0.903868660),
    0.7: (0.712501469, 0.958328435), 0.9: (0.900855478, 0.991445225),
}  # fmt: skip


@pytest.mark.parametrize("R", OPENING)
def test_opening_of_newman(R):
    """To the ten digits of the table: round-off."""
    f, U = OPENING[R]
    assert float(NEWMAN.f(R)) == pytest.approx(f, abs=6e-10)
    assert float(NEWMAN(R)) == pytest.approx(U, abs=6e-10)


@pytest.mark.parametrize(("alpha", "S"), [(1.0, 0.3), (2.0, 0.3), (3.0, 0.8), (1.7, 0.05)])
def test_newman_is_continuous_and_ends_in_one(alpha, S):
    closure = newman_closure(alpha, S)
    assert sum(closure.A) == pytest.approx(1, abs=1e-15)
    e = 1e-9
    for R in (0.0, -2.0):
        assert abs(closure.f(R + e) - closure.f(R - e)) < 10 * e
    assert closure(1.0) == 1
    assert closure(1 - 1e-7) == pytest.approx(1, abs=1e-6)  # f' = 1 at R = 1


def test_newman_without_closure():
    closure = newman_closure(alpha=0.415 / 0.071, S=1.0)
    R = np.array([0.3, 0.7])
    assert np.allclose(closure.f(R), R, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("closure", "U"),
    [
        (linear_closure(0.5, 0.4, R_range=(-0.1, 0.7)), {0: 0.5, 0.1: 0.54, 0.5: 0.7, 0.7: 0.78}),
        (
            schijve_closure(0.55, 0.33, 0.12),
            {-1: 0.34, -0.5: 0.415, 0: 0.55, 0.1: 0.5842, 0.5: 0.745, 0.7: 0.8398},
        ),
        (
            newman_closure(1, 0.3),
            {
                -1: 0.313256,
                -0.5: 0.383274,
                0: 0.523312,
                0.1: 0.565888,
                0.5: 0.747512,
                0.7: 0.845112,
            },
        ),
        (
            newman_closure(3, 0.3),
            {-1: 0.407612, -0.5: 0.523282, 0: 0.754623, 0.1: 0.819539, 0.5: 0.989473, 0.7: 1.0},
        ),
    ],
)
def test_shares_of_closures(closure, U):
    for R, share in U.items():
        assert float(closure(R)) == pytest.approx(share, abs=6e-7)


def test_schijve_is_his_opening_polynomial():
    """Two formulas of one paper: U (1 - R) = 1 - (0.45 + 0.22 R + 0.21 R² + 0.12 R³)."""
    R = np.linspace(-1, 1, 41)
    opening = 0.45 + R * (0.22 + R * (0.21 + R * 0.12))
    assert np.allclose(schijve_closure(0.55, 0.33, 0.12)(R) * (1 - R), 1 - opening, atol=1e-15)


WORKED = [
    (10, 0, 2.817372, 7.526595e-8), (10, 0.1, 2.553630, 9.984976e-8),
    (10, 0.5, 1.522908, 3.066434e-7), (5, 0.7, 1.153868, 4.667373e-8),
    (10, -1, 4.742078, 1.082143e-8), (3, 0.1, 2.553630, 7.431614e-10),
    (20, 0.1, 2.553630, 1.229951e-6), (30, 0.1, 2.553630, 2.517705e-5),
]  # fmt: skip


@pytest.mark.parametrize(("dK", "R", "least", "rate"), WORKED)
def test_nasgro(dK, R, least, rate):
    assert float(V4.of(NEWMAN, R, A)) == pytest.approx(least, abs=6e-7)
    assert float(NASGRO(dK, R, a=A)) == pytest.approx(rate, rel=5e-7)


@pytest.mark.parametrize(("dK", "R"), [row[:2] for row in WORKED])
def test_nasgro_in_other_units(dK, R):
    """A way round that shares nothing with the first: mm and MPa√mm."""
    other = NASGRO.to("m, MPa√m", "mm, MPa√mm")
    assert other.C == pytest.approx(1.129207e-10, rel=1e-6)
    assert other.threshold.a0 == pytest.approx(0.0381)
    rate = other(dK * np.sqrt(1000), R, a=A * 1000)
    assert float(rate) == pytest.approx(1000 * float(NASGRO(dK, R, a=A)), rel=1e-12)


def test_both_generations_of_thresholds():
    """R towards 1 gives dK1 in one, R = 0 gives dK0 in the other; they are not the same number."""
    size = np.sqrt(A / (A + 38.1e-6))
    free = nasgro4_threshold(dK1=0.8, C_th_plus=2.2, C_th_minus=0.1, a0=38.1e-6)
    assert float(free.of(NEWMAN, 1 - 1e-7, A)) == pytest.approx(0.8 * size, rel=1e-5)
    assert float(free.of(NEWMAN, -1e-12, A)) == pytest.approx(
        float(free.of(NEWMAN, 0, A)), rel=1e-10
    )
    assert float(free.of(NEWMAN, 0.8, A)) == pytest.approx(1.011037, abs=6e-7)
    assert float(V4.of(NEWMAN, 0.8, A)) == pytest.approx(1.153868, abs=6e-7)
    old = nasgro3_threshold(dK0=0.8, C_th=2.2, a0=38.1e-6)
    assert float(old.of(NEWMAN, 0, A)) == pytest.approx(0.798, abs=5e-4)
    assert float(V4.of(NEWMAN, 0, A)) / float(old.of(NEWMAN, 0, A)) == pytest.approx(3.53, abs=0.01)


def test_nasgro_ends():
    assert NASGRO(2.5, 0.1, a=A) == 0
    assert np.isinf(NASGRO(0.9 * 35.16, 0.1, a=A))
    assert NASGRO(0.0, 1.0, a=A) == 0
    assert nasgro_K_c(30, 450, 0.005, 1, 1) == pytest.approx(54.5006, abs=5e-5)
    assert nasgro_K_c(30, 450, 0.005, 1, 0) == 30


def test_forman_is_an_exact_fraction():
    rate = forman(1e-8, 3, K_c=80.0)
    assert float(rate(20.0, 0.1)) == pytest.approx(1 / 650000, rel=1e-14)
    assert np.isinf(rate([72.0, 100.0], 0.1)).all()
    assert rate(0.0, 1.0) == 0


def test_hartman_schijve():
    rate = hartman_schijve(7e-10, 2, A=47.0, dK_thr=0.1)
    assert float(rate(10.0, 0.1)) == pytest.approx(8.98476e-8, rel=1e-6)
    assert rate(0.1, 0.1) == 0
    assert np.isinf(rate(43.0, 0.1))


BS = {
    "BS 7910 steel air mean R<0.5": (363, 363.13, 2.5280e-10, 2.3600e-5, 0.2),
    "BS 7910 steel air mean+2SD R<0.5": (315, 314.87, 9.1302e-10, 4.0144e-5, 0.2),
    "BS 7910 steel air mean R>=0.5": (196, 195.56, 7.6075e-8, 3.4748e-5, 0.6),
    "BS 7910 steel air mean+2SD R>=0.5": (144, 143.52, 3.3283e-7, 7.6493e-5, 0.6),
}


@pytest.mark.parametrize("name", BS)
def test_steels_of_BS_7910(name):
    """The knees of the standard's table, which follow from its constants."""
    printed, knee, low, high, R = BS[name]
    rate = law(name, units="mm, N/mm^1.5")
    assert rate.knees[0] == pytest.approx(knee, abs=0.005)
    assert round(rate.knees[0]) == printed
    assert float(rate(100.0, R)) == pytest.approx(low, rel=3e-5)
    assert float(rate(500.0, R)) == pytest.approx(high, rel=3e-5)


def test_published_constants_agree_with_each_other():
    """Two methods, one alloy, 10 MPa√m and R = 0.1: a wrong power of ten would show."""
    one = law("AA7050-T7451 Hartman-Schijve", units="m, MPa√m")(10.0, 0.1)
    other = law("AA7050-T7451 NASGRO", units="m, MPa√m")(10.0, 0.1, a=A)
    assert float(one / other) == pytest.approx(1, abs=0.11)
    assert all(p.source and p.checked and p.units for p in presets().values())


def test_walker_with_both_exponents():
    assert float(walker(1e-11, 3, 0.5)(20.0, 0.5)) == pytest.approx(2.26274e-7, rel=2e-6)
    by_maximum = walker(1e-11, 3, 0.5, gamma_minus=0.0)
    assert float(by_maximum(20.0, -1.0)) == pytest.approx(1e-11 * 10.0**3, rel=1e-14)
    assert by_maximum(20.0, 0.5) == walker(1e-11, 3, 0.5)(20.0, 0.5)


def test_table_between_two_ratios():
    """Harter's T-method: m = 0.510567, and 17.685246 at R = 0.3 from either curve."""
    rate = rate_table({0.1: ([10, 20], [1e-8, 1e-7]), 0.5: ([7.5, 15], [1e-8, 1e-7])})
    m = 1 + np.log(20 / 15) / np.log(0.5 / 0.9)
    assert m == pytest.approx(0.510567, abs=5e-7)
    between = 20 * (0.9 / 0.7) ** (m - 1)
    assert between == pytest.approx(17.685246, abs=5e-7)
    assert float(rate(between * (1 - 1e-9), 0.3)) == pytest.approx(1e-7, rel=1e-7)
    assert float(rate(np.sqrt(200.0), 0.1)) == pytest.approx(np.sqrt(1e-15), rel=1e-12)
    assert rate(9.9, 0.1) == 0
    assert np.isinf(rate(20.1, 0.1))
    one = rate_table({0.1: ([10, 20], [1e-8, 1e-7])})
    assert one(14.0, 0.7) == rate(14.0, 0.1)


def test_a_table_of_walker_is_walker():
    """Points of the law of Walker at four ratios, in any order of the points asked for."""
    exact = walker(1e-11, 3, 0.6)
    dK = np.geomspace(1, 100, 13)
    table = rate_table(
        {R: (dK * (1 - R) ** 0.4, exact(dK * (1 - R) ** 0.4, R)) for R in (0, 0.2, 0.5, 0.8)}
    )
    rng = np.random.default_rng(20261)
    R = rng.uniform(0, 0.8, 200)
    x = rng.uniform(1, 100, 200) * (1 - R) ** 0.4
    assert np.allclose(table(x, R), exact(x, R), rtol=1e-11)


def test_thresholds():
    assert float(klesnil_lukas(6, 0.7)(0.5)) == pytest.approx(3.693433, abs=5e-7)
    steel = stepped_threshold(R=(0, 0.5), dK=(170, 170, 63), slope=214)
    assert np.allclose(steel([-1, 0, 0.2, 0.5, 0.9]), [170, 170, 127.2, 63, 63], rtol=1e-14)
    metres = steel.to("mm, N/mm^1.5", "m, MPa√m")
    assert float(metres(0.2)) == pytest.approx(4.022417, abs=5e-7)
    a0 = (6.0 / 300.0) ** 2 / np.pi
    assert a0 * 1000 == pytest.approx(0.127324, abs=5e-7)
    short = el_haddad(klesnil_lukas(6, 0.0), a0=a0)
    assert float(short(0.0, a=a0)) == pytest.approx(4.242641, abs=5e-7)


def test_paris_with_parts():
    plain, least = paris(1e-11, 3), klesnil_lukas(6, 0.7)
    assert plain(20.0, 0.5) == pytest.approx(8e-8)
    cut = paris(1e-11, 3, threshold=least)
    assert np.array_equal(cut([3.0, 20.0], 0.5), [0.0, plain(20.0, 0.5)])
    difference = paris(1e-11, 3, threshold=least, approach="difference")
    assert float(difference(20.0, 0.5)) == pytest.approx(1e-11 * (20**3 - float(least(0.5)) ** 3))
    smooth = paris(1e-11, 3, threshold=least, approach=0.5)
    assert float(smooth(20.0, 0.0)) == pytest.approx(8e-8 * np.sqrt(1 - 6 / 20))
    with_closure = paris(1e-11, 3, closure=NEWMAN)
    assert float(with_closure(20.0, 0.1)) == pytest.approx(8e-8 * 0.730920153**3, rel=1e-8)
    assert np.array_equal(
        paris(1e-11, 3, K_c=30.0)([20.0, 20.0], [0.1, 0.4]), [plain(20, 0), np.inf]
    )


@pytest.mark.parametrize("R", [-2.0, -1.0, -0.5])
def test_what_contact_ratios_do_to_nasgro(R):
    """R = 0 with K_max against nominal R: the table that a choice between the two rests on."""
    published = {(4, -0.5): 0.734, (8, -1.0): 0.691, (15, -2.0): 0.540, (4, -2.0): 0.327}
    for K_max in (4, 8, 15):
        share = float(NASGRO(K_max, 0.0, a=A) / NASGRO((1 - R) * K_max, R, a=A))
        assert share < 1
        if (K_max, R) in published:
            assert share == pytest.approx(published[K_max, R], abs=6e-4)


LAWS = [
    paris(1e-11, 3, closure=NEWMAN, threshold=klesnil_lukas(6, 0.7), K_c=60.0),
    walker(1e-11, 3, 0.5, 0.1),
    forman(1e-8, 3, K_c=80.0, threshold=el_haddad(klesnil_lukas(2, 0.5), 1e-4)),
    hartman_schijve(7e-10, 2, A=47.0, dK_thr=0.1),
    NASGRO,
    piecewise([(1e-13, 5), (1e-11, 3)], threshold=klesnil_lukas(6, 0.7)),
    rate_table({0.1: ([1, 20], [1e-8, 1e-7]), 0.5: ([0.75, 15], [1e-8, 1e-7])}),
]


@pytest.mark.parametrize("rate", LAWS, ids=lambda rate: type(rate).__name__)
@pytest.mark.parametrize(
    ("new", "K", "length"),
    [
        ("mm, MPa√mm", np.sqrt(1000), 1000),
        ("in, ksi√in", 1 / 1.0988434, 1 / 0.0254),
        ("mm, MPa√m", 1, 1000),
    ],
)
def test_units(rate, new, K, length):
    """A rate in other units is the same growth: 1 ksi√in = 1.0988434 MPa√m (NASA conversion)."""
    other = rate.to("m, MPa√m", new)
    needs = {"a": A} if "a" in getattr(rate, "needs", ()) else {}
    dK, R = np.array([3.0, 8.0, 14.0]), np.array([0.1, 0.3, 0.5])
    there = other(dK * K, R, **{name: value * length for name, value in needs.items()})
    assert np.allclose(there, rate(dK, R, **needs) * length, rtol=3e-7)
    back = other.to(new, "m, MPa√m")(dK, R, **needs)
    assert np.allclose(back, rate(dK, R, **needs), rtol=1e-12)


def test_units_of_a_paris_constant():
    """C 1e-9 in inches and ksi√in, m = 3, is 1.914371e-11 in m and MPa√m."""
    assert paris(1e-9, 3).to("in, ksi√in", "m, MPa√m").C == pytest.approx(1.914371e-11, rel=1e-6)
