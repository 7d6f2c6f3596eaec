"""K from elsewhere than a solution: handbooks in plane and space, wrapped answers, refusals."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import exact

LAW = xc.paris(C=1e-11, m=3.0)
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
CYCLE = xc.Cycle(0.0, 1.0)
STRESS = 100.0


def plate():
    crack = xc.line_crack([(0.0, 0.37), (5.0, 0.37)])
    return xc.Problem(xc.box((0, -20), (60, 20), (60, 40)), STEEL, [crack])


def handbook(problem, states, reuse, bars):
    """K_I = stress √(π a) at each tip, from where the tips are."""
    a = problem.stations.x[:, 0]
    K = np.stack([factor * STRESS * np.sqrt(np.pi * a) for factor in states])
    return xc.Response.of_K(problem, states, np.stack([K, 0 * K], axis=-1))


def penny(problem, states, reuse, bars):
    """K_I = 2 stress √(a / π) (Sneddon 1946), a the distance of each station from the centre."""
    a = np.linalg.norm(problem.stations.x, axis=1)
    K = np.zeros((len(states), len(a), 3))
    K[:, :, 0] = np.multiply.outer(states, 2 * STRESS * np.sqrt(a / np.pi))
    return xc.Response.of_K(problem, states, K)


def grown(problem, response, **options):
    given = {"da": 3.0, "max_steps": 6, "progress": False, **options}
    return xc.collect(xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, response=response, **given))


def test_a_handbook_in_the_plane_is_the_integral_of_the_law():
    history = grown(plate(), handbook)
    a = history.cracks[0].points[-1, 0]
    assert a == pytest.approx(20.0)
    assert history.life == pytest.approx(exact.paris_life(5.0, a, 1e-11, 3.0, STRESS), rel=1e-9)
    assert all(step.solutions == () for step in history.steps)


def test_a_handbook_in_space_keeps_a_circle():
    """N = ∫ da / (C K^m) by the trapezium of the steps: .2 %; radii equal to a thousandth."""
    crack = xc.penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5, n=64)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 8)
    problem = xc.Problem(mesh, xc.Isotropic(210e3, 0.3), [crack])
    history = grown(problem, penny, da=0.06, max_steps=5)
    front = history.cracks[0].points[np.array(history.cracks[0].fronts[0])]
    radius = np.linalg.norm(front - crack.points.mean(axis=0), axis=1)
    assert np.ptp(radius) < 2e-2 * radius.mean()  # K of a is from a centre beside the crack's own
    a = np.linspace(0.5, radius.mean(), 4001)
    rate = 1e-11 * (2 * STRESS * np.sqrt(a / np.pi)) ** 3
    assert history.life == pytest.approx(np.trapezoid(1 / rate, a), rel=5e-3)


def test_a_wrapped_response_adds_what_is_not_modelled():
    """The solved K and a residual K beside it: the range is that of the loads, R is not."""
    loads = [xc.traction("top", (0.0, STRESS)), xc.traction("bottom", (0.0, -STRESS))]
    problem = replace(plate(), loads=loads)

    def residual(problem, states, reuse, bars):
        response = xc.respond(problem, states, reuse, bars)
        shifted = [
            [replace(sif, K=sif.K + np.array([300.0, 0.0])) for sif in row] for row in response.sif
        ]
        return replace(response, sif=shifted)

    plain = next(xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=2.0, progress=False))
    step = next(
        xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=2.0, progress=False, response=residual)
    )
    assert step.dK_eq[0] == pytest.approx(plain.dK_eq[0], rel=1e-5)  # K_II turns it a little
    K_max = plain.sif[1][0].K[0, 0]
    assert step.R[0] == pytest.approx(300.0 / (K_max + 300.0), rel=1e-3)
    assert len(step.solutions) == 2


def test_the_levels_of_a_spectrum_are_asked_for():
    states = []

    def watched(problem, given, reuse, bars):
        states.append(given)
        return handbook(problem, given, reuse, bars)

    spectrum = xc.Spectrum([0.0, 1.0, 0.3, 0.8])
    step = next(xc.grow(plate(), LAW, xc.max_hoop_stress, spectrum, da=2.0, response=watched))
    assert step.levels == (0.0, 1.0)
    assert states == [(0.0, 1.0)]


def test_a_law_of_nominal_R_asks_for_the_scene_without_contact():
    asked = []

    def watched(problem, states, reuse, bars):
        asked.append(problem.contact)
        return handbook(problem, states, reuse, bars)

    law = xc.walker(1e-11, 3.0, 0.5, ratio="nominal")
    next(xc.grow(plate(), law, xc.max_hoop_stress, xc.Cycle(-1.0, 1.0), da=2.0, response=watched))
    assert asked == ["auto", "off"]


def test_a_run_goes_on_with_its_response(tmp_path):
    options = {"da": 3.0, "progress": False, "response": handbook}
    arguments = (plate(), LAW, xc.max_hoop_stress, CYCLE)
    whole = xc.collect(xc.grow(*arguments, max_steps=5, **options))
    xc.collect(xc.grow(*arguments, max_steps=2, **options), tmp_path)
    again = xc.resume(tmp_path, *arguments, max_steps=5, **options)
    assert again.table().tobytes() == whole.table().tobytes()
    with pytest.raises(xc.ProblemError, match="response"):
        xc.resume(tmp_path, *arguments, max_steps=6, da=3.0, progress=False)


@pytest.mark.parametrize(
    ("response", "words"),
    [
        (lambda *given: 3, "response returned 3: return a Response"),
        (lambda p, s, r, b: handbook(p, s[:1], r, b), "K of 1 states, where 2 were asked for"),
        (lambda p, s, r, b: xc.Response.of_K(p, s, [[1.0, 0.0]]), "2 states and 1 stations"),
        (lambda p, s, r, b: xc.Response.of_K(p, s, np.full((2, 1, 2), np.nan)), "must be finite"),
        (3, "response = 3 cannot be called"),
    ],
)
def test_what_is_refused(response, words):
    with pytest.raises(xc.ProblemError, match=words):
        next(xc.grow(plate(), LAW, xc.max_hoop_stress, CYCLE, da=2.0, response=response))


def test_an_error_of_the_function_says_where_it_was_called():
    def broken(problem, states, reuse, bars):
        raise ZeroDivisionError("of the user")

    with pytest.raises(ZeroDivisionError, match="of the user") as caught:
        next(xc.grow(plate(), LAW, xc.max_hoop_stress, CYCLE, da=2.0, response=broken))
    assert "the response of a step" in caught.value.__notes__[0]


def test_stations_are_the_places_of_K():
    loads = [xc.traction("top", (0.0, STRESS)), xc.traction("bottom", (0.0, -STRESS))]
    line = xc.line_crack([(10.0, 0.37), (15.0, 1.37)])
    problem = replace(plate(), cracks=[*plate().cracks, line], loads=loads)
    answer = xc.respond(problem, [1.0])
    stations = problem.stations
    for c in range(2):
        own = stations.crack == c
        assert np.array_equal(stations.x[own], answer.sif[0][c].x)
        assert np.array_equal(stations.frame[own], answer.sif[0][c].frame)
        assert np.array_equal(stations.front[own], answer.sif[0][c].front)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_stations_of_a_front_are_its_vertices_in_the_body():
    pull = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    crack = xc.elliptic_crack((0.02, -1.0, 0.04), (0.0, 0.1, 1.0), (1.0, 0.0, 0.0), 0.5, 0.6)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 7)
    problem = xc.Problem(mesh, xc.Isotropic(1e3, 0.3), [crack], loads=pull, order=1)
    sif = xc.stress_intensity(xc.solve(problem))
    assert np.allclose(problem.stations.x, sif.x, atol=1e-12)
    assert np.allclose(problem.stations.frame, sif.frame, atol=1e-9)


def torn(share):
    """Steps of a penny whose K_III is a share of K_I on one side of it."""

    def response(problem, states, reuse, bars):
        x = problem.stations.x
        K = np.stack([np.full(len(x), 100.0), 0 * x[:, 0], share * 100.0 * (x[:, 0] > 0)], axis=1)
        return xc.Response.of_K(problem, states, [float(s) * K for s in states])

    body = xc.box((-1, -1, -1), (1, 1, 1), 8)
    crack = xc.penny_crack(center=(0, 0, 0.04), normal=(0, 0, 1), radius=0.5)
    problem = xc.Problem(body, xc.Isotropic(210e3, 0.3), [crack], [xc.fix("bottom")])
    return list(xc.grow(problem, xc.paris(1e-9, 3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0),
                        da=0.1, max_steps=2, response=response, progress=False))  # fmt: skip


def test_mode_III_beyond_its_threshold_is_named_once():
    """.521 for nu = .3 (Leblond, Karma and Lazarus, 2011)."""
    with pytest.warns(xc.XcrackWarning, match=r"crack 0: \|K_III\| is 0.55 K_I at .* Above 0.52"):
        steps = torn(0.55)
    assert ["segments" in " ".join(step.warnings) for step in steps] == [True, False]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        torn(0.5)
