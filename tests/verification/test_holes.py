"""The fit for a corner crack at a hole in its limits."""

import numpy as np
import pytest

from xcrack.verification.exact import plates


def test_a_small_crack_at_a_large_hole_feels_its_stress_concentration():
    """Three times the tension of the same crack at a hole too small to matter, within 1 %."""
    phi = np.radians([10.0, 45.0, 80.0])
    at_large = plates.newman_raju_at_hole(phi, 1.0, 1.0, 2.0, 1e9)
    at_small = plates.newman_raju_at_hole(phi, 1.0, 1.0, 2.0, 1e-9)
    # Shah: of two cracks at a hole that vanishes, half the area is left with one.
    np.testing.assert_allclose(at_large / at_small / np.sqrt(2), 3.0, rtol=0.01)


def test_K_grows_with_the_root_of_the_size():
    one = plates.newman_raju_at_hole(0.5, 1.0, 1.0, 2.0, 2.0)
    two = plates.newman_raju_at_hole(0.5, 4.0, 4.0, 8.0, 8.0)
    assert two == pytest.approx(2 * one, rel=1e-12)
