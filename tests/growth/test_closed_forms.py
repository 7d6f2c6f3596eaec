"""K at kinks of no length, where a criterion turns no further, stresses at an interface."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.fatigue.criteria import kink_angle, kinked_K, limit_angles
from xcrack.growth.interfaces import singularity_at_interface


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


def wedges(order, own, other):
    """Conditions on stresses r^-order around a tip on an interface, opened symmetrically.

    Airy functions r^(s + 1) F(θ) of the material of the crack and of that ahead (Williams 1952):
    free faces, and stresses and displacements alike where the materials meet.
    """
    s = 1 - order

    def columns(material, angle):
        up, down = (s + 1) * angle, (s - 1) * angle
        parts = []
        for sine, cosine in ((np.sin, np.cos), (np.cos, lambda x: -np.sin(x))):
            F = np.array([sine(up), sine(down)])
            slope = np.array([(s + 1) * cosine(up), (s - 1) * cosine(down)])
            u_r = np.array([-(s + 1) * sine(up), (material.kolosov - s) * sine(down)])
            u_t = np.array([-(s + 1) * cosine(up), -(material.kolosov + s) * cosine(down)])
            parts.append([(s + 1) * F, -slope, u_r / material.mu, u_t / material.mu])
        return np.concatenate(parts, axis=1)

    face, beside = columns(own, np.pi)[:2], columns(own, np.pi / 2)
    ahead = columns(other, np.pi / 2)[:, 2:]  # the even half
    return np.block([[face, np.zeros((2, 2))], [beside, -ahead]])


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("ratio", [0.045, 0.2, 3.0, 22.0])
def test_the_order_of_stresses_at_an_interface(ratio, plane):
    """The formula of Zak and Williams against the fields of two wedges, to round-off."""
    own, other = xc.Isotropic(1.0, 0.35, plane), xc.Isotropic(ratio, 0.3, plane)
    order = singularity_at_interface(own, other)
    assert (order < 0.5) == (ratio > 1)
    values = [np.linalg.svd(wedges(x, own, other))[1] for x in (order, order + 1e-3)]
    assert values[0][-1] <= 1e-12 * values[0][0]
    assert values[1][-1] >= 1e-5 * values[1][0]
