"""K at kinks of no length, and where a criterion turns no further."""

import numpy as np
import pytest

from xcrack.fatigue.criteria import kink_angle, kinked_K, limit_angles


def test_pure_mode_II_turns_by_the_angle_of_local_symmetry():
    """Amestoy and Leblond (1992): 77.3 degrees; the criterion's own answer is 70.5."""
    K = np.array([[[0.0, 1.0], [0.0, -2.0], [1.0, 0.0]]])
    angle, converged = limit_angles(lambda K: kink_angle(K[0]), K)
    assert np.degrees(angle) == pytest.approx([-77.33, 77.33, 0.0], abs=5e-3)
    assert converged.all()
    K_II = kinked_K(K, angle)[0, :, 1]
    assert K_II == pytest.approx(0, abs=1e-7)  # round-off of the last pass


def test_small_kinks_are_those_of_cotterell_and_rice():
    """Exact to first order in the angle; the rest is their error, of second order."""
    for angle in (0.02, -0.02, 0.1):
        c1, c3 = np.cos(angle / 2), np.cos(3 * angle / 2)
        s1, s3 = np.sin(angle / 2), np.sin(3 * angle / 2)
        C = np.array([[3 * c1 + c3, -3 * (s1 + s3)], [s1 + s3, c1 + 3 * c3]]) / 4
        F = np.stack([kinked_K([1.0, 0.0], angle), kinked_K([0.0, 1.0], angle)], axis=1)
        assert np.abs(F - C).max() <= 0.5 * angle**2


def test_a_mirrored_kink_has_mirrored_factors():
    K = np.array([0.7, -0.4])
    up, down = kinked_K(K, 0.9), kinked_K(K * [1, -1], -0.9)
    assert up == pytest.approx(down * [1, -1], abs=1e-15)


def test_energy_at_the_best_kink_is_larger_than_straight_on():
    """Of pure mode II: G grows by 1.59 on a kink by about 76 degrees (Amestoy and Leblond)."""
    angle = np.radians(np.linspace(-90, 0, 901))
    K = kinked_K(np.broadcast_to([0.0, 1.0], (901, 2)), angle)
    G = (K**2).sum(axis=1)
    assert np.degrees(angle[np.argmax(G)]) == pytest.approx(-75.6, abs=1.0)


def test_a_criterion_without_a_limit_is_noticed():
    K = np.ones((1, 2, 2))
    angle, converged = limit_angles(lambda K: np.array([0.3, 0.0]), K)
    assert converged.tolist() == [False, True]
    assert np.abs(angle).max() <= np.pi
