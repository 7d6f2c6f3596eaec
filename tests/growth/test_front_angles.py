"""Kink angles along fronts: noise of K_II is taken away, what is more than noise stays."""

import numpy as np
import pytest

from xcrack import SIF
from xcrack.growth.front_filter import without_noise

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
    new = without_noise(sif, angle, np.array([closed]), np.array([LENGTH]))
    assert new.std() < 0.6 * angle.std()
    assert new.mean() == pytest.approx(angle.mean(), abs=2e-4)


@pytest.mark.parametrize("closed", [False, True])
def test_a_wave_well_above_the_noise_stays(closed):
    s = np.arange(N) * LENGTH / N
    angle = 0.01 * np.cos(2 * np.pi * s / LENGTH)
    sif = front(-50 * angle, 0.15)  # K_II of 0.5 at most: within three times its noise
    new = without_noise(sif, angle, np.array([closed]), np.array([LENGTH]))
    assert new == pytest.approx(angle, abs=0.1 * 0.01)


def test_mixed_mode_and_short_fronts_keep_their_angles():
    angle = np.random.default_rng(31).normal(size=N) * 0.3
    sif = front(-50 * angle, 0.2)
    assert np.array_equal(without_noise(sif, angle, np.array([True]), np.array([LENGTH])), angle)
    still = np.zeros(N)
    assert np.array_equal(
        without_noise(front(still, 0.2), still, np.array([False]), np.array([1.0])), still
    )
