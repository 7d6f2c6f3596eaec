"""Growth with the real analysis: lives, straight paths, contact, and resuming to the last bit."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import xcrack as xc
from support import exact
from xcrack import load

# small meshes: domains of K are clipped by the boundary, which the tolerances allow for
pytestmark = pytest.mark.filterwarnings("ignore:K at .* domain:xcrack.XcrackWarning")

STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
TENSION = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
LAW = xc.paris(C=1e-3, m=3.0)


def edge_crack(y, n=(20, 40), order=2, a=0.21):
    """Strip of width 1 and height 2 under tension, edge crack of length a."""
    mesh = xc.box((0.0, -1.0), (1.0, 1.0), n)
    return xc.Problem(mesh, STEEL, [xc.line_crack([(0.0, y), (a, y)])], loads=TENSION, order=order)


def test_straight_growth_stays_straight_on_a_mirrored_mesh():
    """The mesh is its own mirror image about y = 0: 2e-6 of the length is quadrature of K_II."""
    problem = edge_crack(0.0, a=0.31)
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0, 1), da=0.1, max_steps=4)
    table = xc.collect(steps).table()
    assert table["a"] == pytest.approx([0.31, 0.41, 0.51, 0.61], abs=1e-9)
    assert (np.abs(table["y"]) <= 2e-6 * table["a"]).all()


@pytest.mark.filterwarnings("ignore:the advance .* below one cell")
def test_life_of_an_edge_crack():
    """Tabulated K of the finite plate, a from 0.207 to 0.414: m times the error in K, and 0.3 %."""
    problem = edge_crack(0.0053, n=(20, 40), a=0.2071)
    steps = xc.grow(problem, LAW, xc.weighted_angle, xc.Cycle(0, 1), da=0.0207, max_steps=11)
    table = xc.collect(steps).table()
    ratio = np.array(sorted(a for h, a in exact.SENT_LS if h == 1.0))
    F = CubicSpline(ratio, np.log([exact.SENT_LS[(1.0, float(r))] for r in ratio]))

    def K(a):
        return np.exp(F(a)) * np.sqrt(np.pi * a)

    N, _ = quad(lambda a: 1 / LAW(K(a), 0), *table["a"][[0, -1]], epsrel=1e-10)
    error = np.abs(table["K_I_max"] / K(table["a"]) - 1).max()
    print(f"K {100 * error:.3f} %, life {100 * (table['N'][-1] / N - 1):+.3f} %")
    assert error < 1e-3  # discretisation, and the spline through five values of the table
    assert abs(table["N"][-1] / N - 1) <= LAW.m * error + 3e-3
    # 0.02 da a step: the path on a mesh that is not symmetric
    assert np.abs(np.diff(table["y"])).max() <= 0.02 * 0.0207


def centre_crack_under_both_loads():
    """Inclined centre crack pulled and pressed: closed and sliding in one of the two states."""
    mesh = xc.box((-1.0, -1.0), (1.0, 1.0), 16)
    crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
    return xc.Problem(mesh, STEEL, [crack], loads=TENSION, order=1)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_resumed_run_with_contact_is_the_same_to_the_last_bit(tmp_path):
    """Closed sets of the step before start the next: they must come back from disk as they were."""
    run = {
        "problem": centre_crack_under_both_loads(),
        "law": LAW,
        "criterion": xc.weighted_angle,
        "cycle": xc.Cycle(-1.0, 1.0),
        "da": 0.1,
        "max_steps": 4,
    }
    whole = xc.collect(xc.grow(**run), tmp_path / "whole")
    assert len(whole.steps) == 4
    assert whole.steps[-1].solutions[0].contact[0] is not None
    for stop in (0, 2):
        folder = tmp_path / f"stopped_{stop}"
        xc.collect(xc.grow(**run), folder, until=lambda step, stop=stop: step.index == stop)
        again = xc.resume(folder, **run)
        assert again.table().tobytes() == whole.table().tobytes()
        for name in ("step_00003.npz", "run.json"):
            assert (folder / name).read_bytes() == (whole.path / name).read_bytes()
    assert load(whole.path).steps[2].run.reuse.active[0].dtype == bool


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_path_of_an_inclined_crack_is_antisymmetric_and_turns_across_the_load():
    """It turns across the load within a few degrees, at both tips alike: discretisation."""
    run = xc.grow(
        centre_crack_under_both_loads(),
        LAW,
        xc.max_hoop_stress,
        xc.Cycle(0, 1),
        da=0.12,
        max_steps=4,
    )
    points = xc.collect(run).cracks[0].points
    middle = np.array([-0.01, 0.005])
    ahead, behind = points[-1] - points[-2], points[0] - points[1]
    assert abs(np.degrees(np.arctan2(ahead[1], ahead[0]))) < 6
    assert abs(np.degrees(np.arctan2(-behind[1], -behind[0]))) < 6
    assert np.abs((points + points[::-1]) / 2 - middle).max() < 0.02


def test_a_crack_along_compression_does_not_zigzag():
    """T < 0 straightens a path (Cotterell and Rice, 1980); long steps must not swing about it.

    T = -2 times the tension across the crack, steps of half of its half length. Faces swing by ten
    degrees where the correction of directions for the turned last face is left out.
    """
    along = [xc.traction("right", (-1.0, 0.0)), xc.traction("left", (1.0, 0.0))]
    crack = xc.line_crack([(-1.0, -0.06), (1.0, 0.06)])
    mesh = xc.box((-6.0, -6.0), (6.0, 6.0), 40)
    problem = xc.Problem(mesh, STEEL, [crack], loads=[*TENSION, *along], contact="off")
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0, 1), da=0.5, max_steps=8)
    path = xc.collect(steps).cracks[0].points
    faces = np.diff(path[path[:, 0] > 0.99], axis=0)
    turns = np.diff(np.degrees(np.arctan2(faces[:, 1], faces[:, 0])))
    assert (np.abs(turns[-3:]) <= 1.0).all()  # discretisation: half a degree on this mesh


def test_radius_of_the_first_step_stays():
    steps = list(
        xc.grow(edge_crack(0.0), LAW, xc.max_hoop_stress, xc.Cycle(0, 1), da=0.1, max_steps=3)
    )
    radius = [step.solutions[0].space.radius[0] for step in steps]
    assert radius == pytest.approx([radius[0]] * 3, rel=1e-12)


def test_ends_where_the_crack_has_gone_through():
    problem = edge_crack(0.0, a=0.712)
    history = xc.collect(xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0, 1), da=0.2))
    assert history.ended.startswith("tip left the body: tip of crack 0 reached 'right' at (1, ")
    assert [step.n_tips for step in history.steps] == [1, 1, 0]
