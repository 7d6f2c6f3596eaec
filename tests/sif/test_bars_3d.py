"""Error bars of K along fronts in 3D, against the exact field of a penny-shaped crack."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.verification.fields_3d import penny, penny_K

MATERIAL = xc.Isotropic(1.0, 0.3)
RADIUS = 0.5


def imposed(order, n=9, tilt=0.3):
    """A penny in a cube under tension, turned against the cells."""
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    centre = np.array([0.013, -0.021, 0.017])
    S = np.diag([0.0, 0.0, 1.0])

    def u(x):
        return penny((x - centre) @ turn, RADIUS, 1.0, 0.3, S) @ turn.T

    crack = xc.penny_crack(centre, turn[:, 2], RADIUS)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), n)
    supports = [xc.displacement("boundary", u)]
    return xc.Problem(mesh, MATERIAL, [crack], supports, contact="off", order=order)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("order", [1, 2])
def test_penny(order):
    """Of K_I, rms along the front; bars of the best are conservative at order 1."""
    sif = xc.stress_intensity(xc.solve(imposed(order), error=True))
    wanted = float(np.max(penny_K(0.0, RADIUS, 0.3, szz=1.0)[0]))
    assert not any(sif.reasons)
    assert rms(wanted - sif.best[:, 0]) < rms(sif.bar[:, 0])
    estimate = sif.eta if order == 1 else sif.bar / 2
    assert 0.5 < rms(estimate[:, 0]) / rms(wanted - sif.K[:, 0]) < 2
    if order == 1:
        assert rms(wanted - sif.best[:, 0]) < rms(wanted - sif.K[:, 0])
    else:
        assert not sif.eta.any()


def test_places_at_a_free_surface_have_none():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 8)
    loads = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    crack = xc.plane_crack(
        [(-1.5, -1.5, 0.03), (0.1, -1.5, 0.03), (0.1, 1.5, 0.03), (-1.5, 1.5, 0.03)]
    )
    solution = xc.solve(xc.Problem(mesh, MATERIAL, [crack], loads=loads, contact="off", order=2))
    sif = xc.stress_intensity(solution, error=True)
    assert sif.at_surface.any()
    assert np.isnan(sif.bar[sif.at_surface]).all()
    assert np.isfinite(sif.bar[~sif.at_surface]).all()
    assert all(("surface" in r) == at for r, at in zip(sif.reasons, sif.at_surface, strict=True))
