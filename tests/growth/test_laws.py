"""Growth laws: lives in closed form, limits, bad constants, and the public checker."""

import numpy as np
import pytest
from scipy.integrate import quad

from support import exact
from xcrack import ProblemError, elber, paris, walker
from xcrack.testing import check_criterion, check_law

A0, A1, STRESS, C = 1e-3, 1e-2, 100.0, 1e-11


def life(law, R=0.0, factor=1.0):
    """Cycles from A0 to A1 of a crack with K = stress √(π a), by quadrature."""

    def inverse(a):
        return float(1 / law(factor * STRESS * np.sqrt(np.pi * a), R))

    return quad(inverse, A0, A1, epsabs=0, epsrel=1e-12)[0]


@pytest.mark.parametrize(("m", "N"), [(2, 7329355.99), (3, 776634.4445), (4, 91189.0653)])
def test_life_by_paris(m, N):
    """Printed digits of the closed form, and the closed form itself to the quadrature."""
    assert life(paris(C, m)) == pytest.approx(N, rel=1e-9)
    assert life(paris(C, m)) == pytest.approx(exact.paris_life(A0, A1, C, m, STRESS), rel=1e-11)


def test_life_of_a_penny():
    assert life(paris(C, 3), factor=2 / np.pi) == pytest.approx(3010067.81, rel=1e-9)


@pytest.mark.parametrize(
    ("R", "N"), [(0, 6213075.56), (0.1, 4932139.69), (0.3, 3258678.98), (0.5, 2264240.36)]
)
def test_life_by_elber(R, N):
    assert life(elber(C, 3, a=0.5, b=0.4), R) == pytest.approx(N, rel=2e-9)


def test_elber_is_cut_to_one():
    law = elber(1.0, 1.0, a=0.5, b=0.8)
    assert np.array_equal(law.U([0.0, 0.5, 1.0]), [0.5, 0.9, 1.0])
    assert elber(1.0, 2.0, a=-0.2, b=1.0)(3.0, 0.1) == 0


def test_walker_between_paris_and_maximum():
    dK, R = np.array([5.0, 10.0]), np.array([0.2, 0.7])
    assert np.array_equal(walker(C, 3, 1.0)(dK, R), paris(C, 3)(dK, R))
    # gamma = 0: the law sees K_max = dK / (1 - R)
    assert np.allclose(walker(C, 3, 0.0)(dK, R), paris(C, 3)(dK / (1 - R), 0), rtol=1e-14)
    assert walker(C, 3, 0.5)(0.0, 1.0) == 0  # a load that does not vary


@pytest.mark.parametrize("law", [paris(C, 3), elber(C, 3, 0.5, 0.4), walker(C, 3, 0.6)])
def test_laws_pass_their_own_check(law):
    check_law(law)
    assert law.m == 3
    assert repr(law).startswith(type(law).__name__ + "(C=1e-11, m=3")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: paris(0.0, 3), "paris: C = 0.0"),
        (lambda: paris(C, -1), "paris: m = -1"),
        (lambda: paris(np.nan, 3), "C = nan"),
        (lambda: elber(C, np.inf, 0.5, 0.4), "m = inf"),
        (lambda: elber(C, 3, -1.0, 0.4), "not positive for any R"),
        (lambda: elber(C, 3, np.nan, 0.4), "finite"),
        (lambda: walker(C, 3, 1.5), "gamma = 1.5"),
    ],
)
def test_bad_constants(make, words):
    with pytest.raises(ProblemError, match=words):
        make()


def named(name, function):
    function.__name__ = name
    return function


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda dK, R: -dK, "no crack shrinks"),
        (lambda dK, R: dK + 1, "not 0 for dK_eq = 0"),
        (lambda dK, R: dK / R, "da/dN = nan .* must be a number"),
        (
            lambda dK, R: np.where((dK > 40) & (dK < 70), np.inf, dK),
            "falls when dK_eq grows from 62.5",
        ),
        (lambda dK, R: dK.sum(), "returns shape"),
        (lambda dK, R: dK * (100 - dK), "falls when dK_eq grows from 50.0"),
        (lambda dK, R: dK * dK.max(), "each must stand for itself"),
        (lambda dK, R: np.multiply(dK, 2, out=dK), "changes the arrays"),
        (lambda dK: dK, "raises TypeError"),
        (lambda dK, R: "fast", "array of real numbers"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_check_law_names_the_fault(law, words):
    with pytest.raises(ProblemError, match=words):
        check_law(law)


def test_a_law_may_return_inf_where_the_toughness_is_reached():
    check_law(lambda dK, R: np.where(dK < 80, dK, np.inf))


@pytest.mark.parametrize("law", [paris(C, 3), elber(C, 3, 0.5, 0.4), walker(C, 3, 0.6)])
@pytest.mark.parametrize(
    ("dK", "R", "words"),
    [
        ("large", 0.0, "dK_eq = 'large' holds str"),
        (None, 0.0, "dK_eq = None"),
        ([1.0, [2.0]], 0.0, "dK_eq"),
        (1.0 + 1.0j, 0.0, "complex"),
        (np.nan, 0.0, "finite"),
        (-1.0, 0.0, "a range is not negative"),
        (1.0, 1.5, "at most 1"),
        (1.0, "low", "R = 'low'"),
        ([1.0, 2.0], [0.0, 0.1, 0.2], r"shapes \(2,\) and \(3,\)"),
    ],
)
def test_bad_calls_of_laws(law, dK, R, words):
    with pytest.raises(ProblemError, match=words):
        law(dK, R)


def test_a_constant_given_as_a_whole_number_is_the_same_setting():
    assert paris(1e-11, 3) == paris(1e-11, 3.0)
    assert type(paris(1e-11, 3).m) is float


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: paris("1e-11", 3), "paris: C = '1e-11' is not a number"),
        (lambda: paris(C, [3]), "paris: m"),
        (lambda: elber(C, 3, None, 0.4), "elber: a = None"),
        (lambda: walker(C, 3, True), "walker: gamma = True"),
    ],
)
def test_constants_of_a_wrong_type(make, words):
    with pytest.raises(ProblemError, match=words):
        make()


def constant(K, nu):
    n = K.shape[1]
    return np.zeros(n), np.zeros(n), np.zeros(n)


def straight(K, nu):
    K_I = np.maximum(K[..., 0], 0)
    return 0 * K_I[0], K_I.max(0) - K_I.min(0), np.zeros(K.shape[1])


@pytest.mark.parametrize("criterion", [constant, straight])
def test_check_criterion_passes(criterion):
    check_criterion(criterion)


def changed(**parts):
    def criterion(K, nu):
        angle, dK, R = straight(K, nu)
        answer = {"angle": angle, "dK": dK, "R": R}
        answer |= {k: f(K, answer[k]) for k, f in parts.items()}
        return tuple(answer.values())

    return criterion


@pytest.mark.parametrize(
    ("criterion", "words"),
    [
        (lambda K, nu: 0, "tuple"),
        (changed(angle=lambda K, a: a + np.nan), "angle for K of shape .* finite"),
        (changed(angle=lambda K, a: a + 0.1), "K_II and K_III reversed: angle"),
        (changed(angle=lambda K, a: K[0, :, 1] * 1e-3), "another order: angle"),
        (changed(dK=lambda K, d: -d), "negative"),
        (changed(dK=lambda K, d: d**2), "four times the load: dK_eq"),
        (changed(dK=lambda K, d: d + 1), "no load: dK_eq"),
        (changed(dK=lambda K, d: K[..., 0].max(0) - K[..., 0].min(0)), "K_I < 0 instead of 0"),
        (changed(R=lambda K, R: R + 2), "not in"),
        (changed(R=lambda K, R: R[:1]), "of shape"),
    ],
)
def test_check_criterion_names_the_fault(criterion, words):
    with pytest.raises(ProblemError, match=words):
        check_criterion(criterion)


def test_criteria_pass_their_own_check():
    from xcrack import max_hoop_stress, mean_reference, weighted_angle

    for criterion in (max_hoop_stress, mean_reference, weighted_angle):
        check_criterion(criterion, nu=0.25)
