"""Error bars of K along fronts in 3D, against the exact field of a penny-shaped crack."""

import numpy as np
import pytest

import xcrack as xc
from xcrack.verification.exact.fields_3d import penny, penny_K

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
    assert 0.5 < rms(sif.eta[:, 0]) / rms(wanted - sif.K[:, 0]) < 2
    assert rms(wanted - sif.best[:, 0]) < rms(wanted - sif.K[:, 0])


@pytest.mark.parametrize(("radius", "n"), [(0.5, 7), pytest.param(0.4, 12, marks=pytest.mark.slow)])
def test_best_K_is_smooth_along_the_front(radius, n):
    """Exact K in tension and shear: what K has from hat to hat is an error, and is left out."""
    S = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.0], [0.5, 0.0, 1.0]])
    low, high = np.array([-1.03, -0.96, -1.02]), np.array([0.97, 1.04, 0.98])
    problem = xc.Problem(
        xc.box(low, high, n), MATERIAL, [xc.penny_crack((0, 0, 0), (0, 0, 1), radius)],
        [xc.displacement("boundary", lambda x: penny(x, radius, 1.0, 0.3, S))], contact="off",
        order=2,
    )  # fmt: skip
    sif = xc.stress_intensity(xc.solve(problem), error=True)
    angle = np.arctan2(sif.x[:, 1], sif.x[:, 0])
    exact = np.transpose(penny_K(angle, radius, 0.3, szz=1.0, tau=0.5))
    side = np.sign(np.sum(sif.K[:, 1:] * exact[:, 1:], axis=0))  # of the frame
    exact[:, 1:] *= side
    assert np.abs(sif.best - exact)[:, 0].max() < 0.3 * np.abs(sif.K - exact)[:, 0].max()
    assert (np.abs(sif.best - exact).max(axis=0) < 1.03 * np.abs(sif.K - exact).max(axis=0)).all()
    assert (np.abs(sif.best - exact) < sif.bar).mean() > 0.95


def test_places_at_a_free_surface_have_none():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 8)
    loads = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    crack = xc.plane_crack(
        [(-1.5, -1.0, 0.03), (0.1, -1.0, 0.03), (0.1, 1.0, 0.03), (-1.5, 1.0, 0.03)]
    )
    solution = xc.solve(xc.Problem(mesh, MATERIAL, [crack], loads=loads, contact="off", order=2))
    sif = xc.stress_intensity(solution, error=True)
    assert sif.at_surface.any()
    assert np.isnan(sif.bar[sif.at_surface]).all()
    assert np.isfinite(sif.bar[~sif.at_surface]).all()
    assert all(("surface" in r) == at for r, at in zip(sif.reasons, sif.at_surface, strict=True))


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize(
    ("n", "tilt"), [(6, 0.3), pytest.param(9, 0.3, marks=pytest.mark.slow),
                    pytest.param(9, 0.0, marks=pytest.mark.slow)]
)  # fmt: skip
def test_finer_cells_at_the_front(n, tilt):
    """In all three modes: the difference is the error, and its K is nearer to the exact one."""
    solution = xc.solve(imposed(2, n, tilt))
    own, finer = xc.stress_intensity(solution), xc.stress_intensity(solution, error="front")
    assert np.array_equal(own.K, finer.K)
    exact = np.array([float(np.max(penny_K(0.0, RADIUS, 0.3, szz=1.0)[0])), 0.0, 0.0])
    for mode in range(3):
        error, rest = exact[mode] - own.K[:, mode], exact[mode] - finer.best[:, mode]
        assert 0.5 < rms(finer.eta[:, mode]) / rms(error) < 2
        assert rms(rest) < rms(finer.bar[:, mode])
    assert rms(exact - finer.best) < 0.5 * rms(exact - own.K)


@pytest.mark.slow
@pytest.mark.mission
def test_finer_cells_at_the_front_of_a_surface_crack_and_of_states():
    """Order 1 takes order 2 along; places at a free surface and states at rest have none."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 5)
    loads = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    crack = xc.plane_crack(
        [(-1.5, -1.0, 0.03), (0.1, -1.0, 0.03), (0.1, 1.0, 0.03), (-1.5, 1.0, 0.03)]
    )
    problem = xc.Problem(mesh, MATERIAL, [crack], loads=loads, contact="off", order=1)
    rest, whole, half = xc.stress_intensities(xc.solve(problem, [0.0, 1.0, 0.5]), error="front")
    inside = ~whole.at_surface
    assert np.isnan(whole.bar[~inside]).all()
    assert np.isfinite(whole.bar[inside]).all()
    assert not rest.bar.any()
    assert np.allclose(2 * half.eta[inside], whole.eta[inside], rtol=1e-6, atol=1e-9)


def test_finer_cells_at_tips_are_refused():
    crack = xc.line_crack([(-0.4, 0.01), (0.3, 0.01)])
    pull = [xc.traction("top", (0, 1.0)), xc.traction("bottom", (0, -1.0))]
    plane = xc.Isotropic(1.0, 0.3, "strain")
    solution = xc.solve(xc.Problem(xc.box((-1, -1), (1, 1), 8), plane, [crack], loads=pull))
    with pytest.raises(xc.ProblemError, match=r'error="front" is for fronts in 3D: give True'):
        xc.stress_intensity(solution, error="front")
    with pytest.raises(xc.ProblemError, match="error = 'tips': give True or False or 'front'"):
        xc.stress_intensity(solution, error="tips")
