"""Advance and angles of fronts: their response to their own shape, noise, what stays."""

import numpy as np
import pytest

from xcrack import SIF
from xcrack.growth.front_filter import (
    corrected_advance,
    predicted_advance,
    response,
    turning_of,
    without_noise,
)

M = 3.0


def places(closed, n=48, length=12.0):
    s = np.arange(n) * length / n if closed else (np.arange(n) + 0.5) * length / n
    return s, length


def waves(closed, s, length, number):
    """A wave along the front, and its wave number."""
    k = (2 if closed else 1) * np.pi * number / length
    return np.cos(k * s), k


def grown(closed, number, steps, total=2.0):
    """Height of a wave after a growth by `total`, of first 0.01, and the exact one.

    The advance is `total`/`steps` (1 - m |k| u / 2), the linear response of K to the front.
    """
    s, length = places(closed)
    wave, k = waves(closed, s, length, number)
    da, height = total / steps, 0.01
    turning = 0.0
    for _ in range(steps):
        advance = da * (1 - 0.5 * M * k * height * wave)
        front = response(s, advance, M, turning, closed, length)
        after = height * wave + predicted_advance(front, s, advance) - da
        later = da * (1 - 0.5 * M * k * (after @ wave) / (wave @ wave) * wave)
        end = height * wave + corrected_advance(front, s, advance, later) - da
        height = (end @ wave) / (wave @ wave)
    return height, 0.01 * np.exp(-0.5 * M * k * total)


@pytest.mark.parametrize("closed", [False, True])
def test_a_wave_falls_as_it_should_in_steps_of_any_length(closed):
    """Exact but for the monotone cubics between places: 2 % of a wave of six places."""
    for number, steps in ((2, 1), (2, 4), (8, 1), (8, 4)):
        height, exact = grown(closed, number, steps)
        assert height == pytest.approx(exact, abs=0.02 * 0.01)
    for number in (8, 12):  # to four places a wave: hardly turned over
        height, _ = grown(closed, number, 1, total=6.0)
        assert abs(height) <= 0.3 * 0.01


def test_euler_would_turn_the_same_waves_over():
    """1 - m k da / 2 at the wave of six places, da of two places: what the filter is for."""
    s, length = places(False)
    _, k = waves(False, s, length, 16)
    assert 1 - 0.5 * M * k * 2.0 < -5


@pytest.mark.parametrize("closed", [False, True])
def test_what_a_filter_leaves_alone(closed):
    """An even advance; one that is zero somewhere does not become negative."""
    s, length = places(closed)
    even = np.full(len(s), 0.3)
    front = response(s, even, M, 2 * np.pi * closed, closed, length)
    assert predicted_advance(front, s, even) == pytest.approx(even, abs=1e-12)
    assert corrected_advance(front, s, even, even) == pytest.approx(even, abs=1e-12)
    partly = np.where(s < 5, 0.3, 0.0)
    front = response(s, partly, M, 0.0, closed, length)
    way = predicted_advance(front, s, partly)
    assert (way >= 0).all()
    assert way[(s > 7) & (s < 11)] == pytest.approx(0, abs=1e-12)


def test_a_circle_and_its_shift_stay():
    """Growth by 1 + cos(phi)/10 shifts a circle: its wave number is the turning over the length."""
    s, length = places(True)
    shift = 0.3 * (1 + 0.1 * np.cos(2 * np.pi * s / length))
    front = response(s, shift, M, 2 * np.pi, True, length)
    assert predicted_advance(front, s, shift) == pytest.approx(shift, abs=1e-5)


def test_later_rates_enter_by_half_where_nothing_responds():
    s, length = places(False)
    one, two = np.full(len(s), 0.1), np.full(len(s), 0.2)
    front = response(s, one, M, 0.0, False, length)
    assert corrected_advance(front, s, one, two) == pytest.approx(np.full(len(s), 0.15), abs=1e-12)
    assert response(s[:3], one[:3], M, 0.0, False, length) is None
    assert corrected_advance(None, s, one, two) == pytest.approx(np.full(len(s), 0.15))


def test_turning_of_an_arc():
    angle = np.linspace(0, 1.2, 25)
    arc = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert turning_of(arc, False) == pytest.approx(1.2, abs=0.25)
    assert turning_of(arc, True) == 2 * np.pi
    line = np.stack([angle, 0.01 * (-1.0) ** np.arange(25), 0 * angle], axis=1)
    assert turning_of(line, False) < 0.2


# Noise of kink angles: it is taken away, what is more than noise stays

N, LENGTH = 60, 30.0


def front(K_II, spread):
    s = np.arange(N) * LENGTH / N
    K = np.stack([np.full(N, 100.0), K_II, np.zeros(N)], axis=1)
    zero = np.zeros(N)
    return SIF(
        x=np.stack([s, zero, zero], axis=1),
        frame=np.broadcast_to(np.eye(3), (N, 3, 3)),
        K=K,
        T=zero,
        spread=np.stack([zero, np.full(N, spread), zero], axis=1),
        s=s,
        front=np.zeros(N, dtype=int),
        at_surface=np.zeros(N, dtype=bool),
        closed=np.zeros(N, dtype=bool),
        domain_cells=np.full(N, 3.0),
    )


@pytest.mark.parametrize("closed", [False, True])
def test_noise_goes_and_the_mean_stays(closed):
    """Waves of 2.3 places and more, of the size of the difference of two domains."""
    rng = np.random.default_rng(2718)
    coarse = np.interp(np.arange(N) / 2.3, np.arange(40), rng.normal(size=40))
    angle = 0.004 * coarse + 0.01
    sif = front(-50 * angle, 0.2)
    new = without_noise(sif, angle, np.full(len(angle), closed), np.full(len(angle), LENGTH))
    assert new.std() < 0.6 * angle.std()
    assert new.mean() == pytest.approx(angle.mean(), abs=2e-4)


@pytest.mark.parametrize("closed", [False, True])
def test_a_wave_well_above_the_noise_stays(closed):
    s = np.arange(N) * LENGTH / N
    angle = 0.01 * np.cos(2 * np.pi * s / LENGTH)
    sif = front(-50 * angle, 0.15)  # K_II of 0.5 at most: within three times its noise
    new = without_noise(sif, angle, np.full(len(angle), closed), np.full(len(angle), LENGTH))
    assert new == pytest.approx(angle, abs=0.1 * 0.01)


def test_mixed_mode_and_short_fronts_keep_their_angles():
    angle = np.random.default_rng(31).normal(size=N) * 0.3
    sif = front(-50 * angle, 0.2)
    assert np.array_equal(
        without_noise(sif, angle, np.full(len(angle), True), np.full(len(angle), LENGTH)), angle
    )
    still = np.zeros(N)
    assert np.array_equal(without_noise(front(still, 0.2), still, still > 0, 1.0 + still), still)
