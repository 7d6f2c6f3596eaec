"""The smooth curve through the vertices of a front, and the feet of points on it."""

import numpy as np
import pytest

from support.front_fields import ellipse_front, flat_front
from xcrack import GeometryError
from xcrack.crack.front_curve import front_curve

TURN = 2 * np.pi


def helix(m, twist=0.0):
    """Helix of radius 1 and pitch 2 pi 0.4 with frames that turn by `twist` a radian more."""
    u = np.linspace(0, 4, m)
    x = np.stack([np.cos(u), np.sin(u), 0.4 * u], axis=1)
    b = np.stack([-np.sin(u), np.cos(u), 0.4 + 0 * u], axis=1) / np.sqrt(1.16)
    inward = np.stack([-np.cos(u), -np.sin(u), 0 * u], axis=1)
    second = np.cross(b, inward)
    n = np.cos(twist * u)[:, None] * inward + np.sin(twist * u)[:, None] * second
    return front_curve(x, np.stack([np.cross(n, b), n, b], axis=1), False)


def test_circle_through_uneven_vertices():
    # Interpolation: the error of a cubic spline falls like the fourth power of the spacing.
    error = []
    for m in (24, 48):
        curve = ellipse_front(1.0, 1.0, m, seed=7)
        x, frame, turn = curve.at(np.linspace(0, curve.length, 301))
        error.append(np.abs(np.linalg.norm(x, axis=1) - 1).max())
        assert abs(curve.length / TURN - 1) < 3 * error[-1]
        np.testing.assert_allclose(turn[:, 0], -1, atol=0.02)  # kt = -1/a
        np.testing.assert_allclose(turn[:, 1:3], 0, atol=1e-12)
        np.testing.assert_allclose(turn[:, 3], 1, atol=1e-4)  # nearly arc length
        gram = np.einsum("qai,qbi->qab", frame, frame)
        np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=1e-14)
        np.testing.assert_allclose(np.cross(frame[:, 0], frame[:, 1]), frame[:, 2], atol=1e-14)
    assert error[0] < 1e-4
    assert error[1] < error[0] / 10


def test_helix_has_its_curvature_and_torsion():
    # A frame that turns with the principal normal twists by the torsion 0.4 / 1.16 (Frenet).
    for twist in (0.0, 0.7):
        curve = helix(300, twist)
        _, _, turn = curve.at(np.linspace(0.3, curve.length - 0.3, 50))
        np.testing.assert_allclose(np.hypot(turn[:, 0], turn[:, 1]), 1 / 1.16, rtol=1e-4)
        expected = 0.4 / 1.16 + twist / np.sqrt(1.16)
        np.testing.assert_allclose(turn[:, 2], expected, rtol=1e-3)


def test_derivatives_of_the_frame():
    # t' = -kt b + w n, n' = -kn b - w t, b' = kt t + kn n, by differences of the frame itself.
    curve = helix(60, 0.5)
    s, step = np.linspace(0.5, 3.5, 20), 1e-5
    _, frame, turn = curve.at(s)
    slope = (curve.at(s + step)[1] - curve.at(s - step)[1]) / (2 * step) / turn[:, 3, None, None]
    kt, kn, w = turn[:, :3].T[..., None]
    t, n, b = np.swapaxes(frame, 0, 1)
    expected = np.stack([-kt * b + w * n, -kn * b - w * t, kt * t + kn * n], axis=1)
    np.testing.assert_allclose(slope, expected, atol=1e-8)  # error of the differences


@pytest.mark.parametrize("closed", [True, False])
def test_feet_of_drawn_points(closed):
    rng = np.random.default_rng(29)
    curve = ellipse_front(1.0, 0.6, 40, seed=3) if closed else helix(50, 0.3)
    reach = 0.8 * curve.bend(np.linspace(0, curve.length, 400), 1e-3).min()
    s = rng.uniform(0.02, 0.98, 400) * curve.length
    x, frame, _ = curve.at(s)
    local = reach * rng.uniform(-0.7, 0.7, (400, 2))
    result = curve.feet(x + np.einsum("qa,qad->qd", local, frame[:, :2]))
    np.testing.assert_allclose(result.s, s, atol=1e-11)  # round-off over the metric
    np.testing.assert_allclose(result.offset, local, atol=1e-12)
    np.testing.assert_allclose(result.frame, frame, atol=1e-10)
    assert (result.metric > 0).all()


def test_beyond_its_ends_a_front_is_straight():
    curve = helix(30)
    s = np.array([0.0, curve.length])
    x, frame, turn = curve.at(s)
    past = 0.05 * np.array([-1.0, 1.0])
    feet = curve.feet(x + 0.1 * frame[:, 0] + past[:, None] * frame[:, 2])
    np.testing.assert_allclose((feet.s - s) * turn[:, 3], past, rtol=0.02)  # frames go on turning
    on = curve.at(s + past)[0]
    np.testing.assert_allclose(on, x + (past * turn[:, 3])[:, None] * frame[:, 2], atol=1e-12)


@pytest.mark.parametrize("beyond", [0.1, 0.5, 2.0])
def test_feet_of_points_far_beyond_an_end(beyond):
    """A short front has domains that reach beyond its ends by more than its length."""
    curve = helix(30)
    end = np.array([curve.length])
    x, frame, turn = curve.at(end)
    away = beyond * curve.length
    point = x + 0.1 * curve.length * frame[:, 1] + away * frame[:, 2]
    feet = curve.feet(point)
    np.testing.assert_allclose((feet.s - end) * turn[:, 3], away, rtol=1e-9)
    ways = point - curve.at(feet.s)[0]
    np.testing.assert_allclose(ways @ frame[0, 2], 0, atol=1e-12 * curve.length)  # round-off


def test_arc_length_between_vertices():
    curve = ellipse_front(1.0, 0.5, 200, seed=5)
    s = np.sort(np.random.default_rng(61).uniform(0, curve.length, 30))
    fine = curve.at(np.linspace(0, s[-1], 200001))[0]
    length = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    np.testing.assert_allclose(curve.arc(s)[-1], length, rtol=1e-9)  # chords of the reference
    assert np.abs(curve.arc(s) - s).max() < 1e-5


def test_two_vertices_are_a_straight_front():
    frame = np.broadcast_to([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]], (2, 3, 3))
    curve = front_curve(np.array([[0.2, 1, 0], [0.2, -1, 0]]), frame, False)
    assert curve.length == 2
    assert (curve.bend(np.array([0.0, 0.7, 2.0]), 0.1) == np.inf).all()
    np.testing.assert_allclose(curve.feet(np.array([[0.7, 0.1, -0.3]])).offset, [[0.5, -0.3]])


def test_bad_fronts_are_named():
    x = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    with pytest.raises(GeometryError, match="run against"):  # anticlockwise with n = z
        front_curve(x, _frames(x), True)
    clockwise = x[::-1]
    twice = clockwise[[0, 1, 1, 2, 3]]
    with pytest.raises(GeometryError, match="coincide"):
        flat_front(twice, twice)
    with pytest.raises(GeometryError, match="more than 2"):
        flat_front(clockwise[:2], clockwise[:2])
    assert flat_front(clockwise, clockwise).is_closed


def _frames(x):
    normal = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    return np.stack([x, normal, np.cross(x, normal)], axis=1)
