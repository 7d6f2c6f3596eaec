"""Direction criteria against printed tables, a search over all angles, and their symmetries."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import minimize_scalar

from support import exact
from xcrack import (
    ProblemError,
    XcrackWarning,
    equivalent_K,
    max_hoop_stress,
    mean_reference,
    weighted_angle,
)

SEED = 90317
CRITERIA = [
    max_hoop_stress,
    mean_reference,
    weighted_angle,
    lambda K, nu: mean_reference(K, nu, reference="min"),
    lambda K, nu: mean_reference(K, nu, reference="max"),
    lambda K, nu: weighted_angle(K, nu, range="component"),
]
reverses = pytest.mark.filterwarnings("ignore:the difference of the extreme")
clips = pytest.mark.filterwarnings("ignore:K_I < 0")


def states(*rows):
    """K (s, 1, modes) of one front point."""
    return np.array(rows, dtype=float)[:, None, :]


def turn_of(K):
    """Angle of the largest hoop stress where the load rises from nothing to K `(..., modes)`."""
    K = np.asarray(K, dtype=float)
    rows = np.stack([0 * K, K]).reshape(2, -1, K.shape[-1])
    return max_hoop_stress(rows, 0.3)[0].reshape(K.shape[:-1])


# --- one state ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("K_II", "degrees"),  # K_I = 1; hoop stress column, four printed decimals
    [(0.1, -11.2029), (0.3, -29.1026), (0.5, -40.2078), (1, -53.1301), (2, -61.3418)],
)
def test_angle_over_ratio(K_II, degrees):
    assert np.degrees(turn_of([1.0, K_II])) == pytest.approx(degrees, abs=5e-5)
    assert np.degrees(turn_of([1.0, -K_II])) == pytest.approx(-degrees, abs=5e-5)


@pytest.mark.parametrize(
    ("beta", "degrees", "K_eq"),  # crack at beta to the load axis, printed digits
    [
        (10, -67.1999, 0.21439),
        (15, -65.5052, 0.32684),
        (20, -63.7587, 0.43881),
        (30, -60.0, 0.64952),
        (45, -53.1301, 0.89443),
        (60, -43.2213, 1.01624),
        (75, -26.7396, 1.02334),
        (80, -18.9111, 1.01286),
        (90, 0, 1),
    ],
)
def test_inclined_crack(beta, degrees, K_eq):
    sin, cos = np.sin(np.radians(beta)), np.cos(np.radians(beta))
    K = [sin**2, sin * cos]
    angle = turn_of(K)
    assert np.degrees(angle) == pytest.approx(degrees, abs=5e-5)
    assert equivalent_K(K, angle, 0.3) == pytest.approx(K_eq, abs=5e-6)


def test_limits_in_closed_form():
    """Pure modes, and the zero vector: round-off only."""
    assert turn_of([0.0, 1.0]) == pytest.approx(-np.arccos(1 / 3), abs=1e-15)
    assert equivalent_K([0, 1], turn_of([0, 1]), 0.3) == pytest.approx(2 / np.sqrt(3), rel=1e-14)
    straight = turn_of([[2.0, 0.0], [2.0, -0.0], [0.0, 0.0]])
    assert np.array_equal(straight, [0, 0, 0])
    assert not np.signbit(straight).any()
    assert equivalent_K([2.0, 0.0], 0.0, 0.3) == 2.0
    assert equivalent_K([0, 0, 1], 0.0, 0.19) == pytest.approx(1 / 0.9, rel=1e-15)


def test_third_mode_at_equal_energy():
    K = [1.0, 0.5, 0.4]
    # printed 1.368991; recomputed with the same formula 1.3689899: 1e-6 is its last digit
    assert equivalent_K(K, turn_of(K), 0.3) == pytest.approx(1.368991, rel=1e-6)
    assert equivalent_K(K[:2], turn_of(K), 0.3) == pytest.approx(1.28279, abs=5e-6)


def test_against_the_exact_module():
    generator = np.random.default_rng(SEED)
    K = generator.normal(size=(200, 3))
    K[:, 0] = np.abs(K[:, 0])
    angle = turn_of(K)
    assert np.allclose(angle, exact.hoop_angle(K[:, 0], K[:, 1]), rtol=0, atol=1e-14)
    expected = exact.k_eq(*K.T, c3=1 / 0.75)
    assert np.allclose(equivalent_K(K, angle, 0.25), expected, rtol=1e-13)


def test_angle_maximises_the_hoop_stress():
    """Naive twin: search the hoop stress of the near field over all angles.

    1e-6 rad: an optimiser without derivatives sees a flat maximum to the root of round-off.
    """
    generator = np.random.default_rng(SEED)
    for K_I, K_II in np.abs(generator.normal(size=(20, 2))):

        def hoop(theta, K_I=K_I, K_II=K_II):
            # Williams: from the stress components of the two modes, not from the formula in use
            c, s, c3, s3 = (f(theta * k) for k in (0.5, 1.5) for f in (np.cos, np.sin))
            return -(K_I * (0.75 * c + 0.25 * c3) - K_II * (0.75 * s + 0.75 * s3))

        grid = np.linspace(-np.pi, np.pi, 721)
        start = grid[np.argmin(hoop(grid))]
        best = minimize_scalar(
            hoop, bounds=(start - 0.01, start + 0.01), method="bounded", options={"xatol": 1e-12}
        )
        assert turn_of([K_I, K_II]) == pytest.approx(best.x, abs=1e-6)
        K_eq = equivalent_K([K_I, K_II], turn_of([K_I, K_II]), 0.3)
        assert K_eq == pytest.approx(-best.fun, rel=1e-12)


# --- sequences of states -----------------------------------------------------------------------

SEQUENCES = {
    "P": states((0, 0), (1, 0.5)),
    "NP1": states((0, 0), (1, 0), (0.6, 0.5)),
    "NP2": states((1, 0.3), (1, -0.3)),
    "NP5": states((-0.5, 0.4), (1, 0.2)),
}


@reverses
@clips
@pytest.mark.parametrize(
    ("name", "degrees"), [("P", -40.2078), ("NP1", -24.6401), ("NP2", 0), ("NP5", -35.5907)]
)
def test_weighted_angle_of_sequences(name, degrees):
    angle, _, _ = weighted_angle(SEQUENCES[name], 0.3)
    assert np.degrees(angle[0]) == pytest.approx(degrees, abs=5e-5)


@reverses
@clips
@pytest.mark.parametrize(
    ("name", "degrees"), [("P", -40.2078), ("NP1", 0), ("NP2", -29.1026), ("NP5", -21.0888)]
)
def test_angle_of_the_most_severe_state(name, degrees):
    for angle in (
        max_hoop_stress(SEQUENCES[name], 0.3)[0],
        mean_reference(SEQUENCES[name], 0.3, reference="max")[0],
    ):
        assert np.degrees(angle[0]) == pytest.approx(degrees, abs=5e-5)


def test_proportional_range():
    _, dK_eq, R = max_hoop_stress(SEQUENCES["P"], 0.3)
    assert dK_eq[0] == pytest.approx(1.28279, abs=5e-6)
    assert R[0] == 0


@reverses
def test_a_tie_takes_the_smaller_angle_in_any_order():
    one, two = SEQUENCES["NP2"], SEQUENCES["NP2"][::-1]
    for criterion in CRITERIA:
        for a, b in zip(criterion(one, 0.3), criterion(two, 0.3)):
            assert np.array_equal(a, b)
    assert max_hoop_stress(one, 0.3)[0][0] < 0


@reverses
def test_mean_and_min_reference():
    K = states((0.2, -0.3), (1.0, 0.1), (0.6, 0.5))
    assert mean_reference(K, 0.3)[0][0] == pytest.approx(turn_of([0.6, 0.1]), abs=1e-14)
    smallest = mean_reference(K, 0.3, reference="min")[0][0]
    assert smallest == turn_of([0.2, -0.3])
    unloaded = np.concatenate([K, np.zeros_like(K[:1])])
    assert mean_reference(unloaded, 0.3, reference="min")[0][0] == 0


def test_range_and_ratio_in_the_chosen_direction():
    K = states((0.3, 0.06), (1.0, 0.2))
    angle, dK_eq, R = weighted_angle(K, 0.3)
    K_eq = equivalent_K(K[:, 0], angle, 0.3)
    assert dK_eq[0] == pytest.approx(K_eq[1] - K_eq[0], rel=1e-14)
    assert R[0] == pytest.approx(0.3, rel=1e-13)  # proportional: the ratio of the loads
    component = weighted_angle(K, 0.3, range="component")
    assert component[1][0] == pytest.approx(dK_eq[0], rel=1e-13)  # K_eq is linear here


def test_reversed_second_mode_is_seen_by_the_component_range_only():
    K = states((0.0, 10.0), (0.0, -10.0))
    with pytest.warns(XcrackWarning, match="more than 20 % apart") as caught:
        _, difference, _ = max_hoop_stress(K, 0.3)
    assert len(caught) == 1
    _, component, _ = max_hoop_stress(K, 0.3, range="component")
    assert difference[0] == pytest.approx(10 * 2 / np.sqrt(3))
    assert component[0] == pytest.approx(20 * 2 / np.sqrt(3))


def test_negative_K_I_counts_as_zero_and_is_flagged_once():
    K = np.array([[[-1.0, 1.0], [-0.5, 0.0]], [[-0.1, 0.0], [-2.0, 0.0]]])
    with pytest.warns(
        XcrackWarning, match=r"K_I < 0 in 4 of 4.*-2 \(state 1, front point 1\)"
    ) as w:
        angle, dK_eq, R = max_hoop_stress(K, 0.3)
    assert len(w) == 1
    assert np.degrees(angle) == pytest.approx([-70.5288, 0], abs=5e-5)
    assert dK_eq == pytest.approx([2 / np.sqrt(3), 0], rel=1e-14)
    assert np.array_equal(R, [0, 0])


@pytest.mark.parametrize("criterion", CRITERIA)
def test_nothing_comes_of_nothing(criterion):
    for part in criterion(np.zeros((3, 4, 3)), 0.3):
        assert np.array_equal(part, np.zeros(4))
    for part in criterion(np.zeros((2, 0, 2)), 0.3):
        assert part.shape == (0,)


factors = st.floats(-10, 10).map(lambda v: round(v, 6))
several = st.integers(1, 4).flatmap(lambda s: arrays(float, (s, 2, 3), elements=factors))


@reverses
@clips
@pytest.mark.parametrize("criterion", CRITERIA)
@given(K=several, scale=st.sampled_from([0.25, 4.0, 1024.0]), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_symmetries(criterion, K, scale, seed):
    angle, dK_eq, R = criterion(K, 0.3)
    assert (np.abs(angle) <= np.arccos(1 / 3) + 1e-12).all()
    assert (dK_eq >= 0).all()
    assert ((R >= 0) & (R <= 1)).all()
    # powers of two scale without round-off: the answer scales to the last bit
    scaled = criterion(scale * K, 0.3)
    assert np.array_equal(scaled[0], angle)
    assert np.allclose(scaled[1], scale * dK_eq, rtol=1e-15, atol=0)
    assert np.allclose(scaled[2], R, rtol=1e-15, atol=0)
    order = np.random.default_rng(seed).permutation(len(K))
    for a, b in zip(criterion(K[order], 0.3), (angle, dK_eq, R)):
        assert np.array_equal(a, b)


@reverses
@given(K=several)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_mirror(K):
    """K_II and K_III reversed turn the crack the other way, except where states tie."""
    K = np.array(K)
    K[..., 0] = np.abs(K[..., 0])
    mirror = K * [1, -1, -1]
    for criterion in (mean_reference, weighted_angle):
        a, b = criterion(K, 0.3), criterion(mirror, 0.3)
        assert np.allclose(a[0], -b[0], atol=1e-14)
        assert np.allclose(a[1], b[1], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    ("K", "words"),
    [
        (np.zeros((2, 2)), "shape"),
        (np.zeros((2, 1, 4)), "shape"),
        (np.zeros((0, 1, 2)), "shape"),
        (states((1, np.nan)), "state 0, front point 0, mode 2 is nan"),
    ],
)
def test_bad_K(K, words):
    for criterion in CRITERIA:
        with pytest.raises(ProblemError, match=words):
            criterion(K, 0.3)


def test_bad_options():
    K = SEQUENCES["P"]
    with pytest.raises(ProblemError, match="reference"):
        mean_reference(K, 0.3, reference="median")
    with pytest.raises(ProblemError, match="range"):
        weighted_angle(K, 0.3, range="sum")
    with pytest.raises(ProblemError, match=r"nu = 0\.5"):
        max_hoop_stress(K, 0.5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("K", 0.0, 0.3), "K = 'K'"),
        (([1.0, np.nan], 0.0, 0.3), "finite"),
        (([1.0, 0.1], 70.5, 0.3), "angle = 70.5: angles are in rad"),
        (([1.0, 0.1], [0.0, "a"], 0.3), "angle"),
        (([[1.0, 0.1]] * 3, [0.0, 0.1], 0.3), r"shapes? \(3, 2\).*\(2,\)|\(3, 2\) .* \(2,\)"),
        (([1.0, 0.1], 0.0, "0.3"), "nu = '0.3' is not a number"),
        (([1.0, 0.1], 0.0, 0.5), "below 0.5"),
    ],
)
def test_bad_arguments_of_the_equivalent_factor(arguments, words):
    with pytest.raises(ProblemError, match=words):
        equivalent_K(*arguments)
