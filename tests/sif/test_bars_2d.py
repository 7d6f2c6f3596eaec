"""Error bars of K in 2D: against exact fields and finer meshes, and where there are none."""

import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import drawn_cracks, exact
from support import scenes_2d as scenes
from support.rows import mission
from xcrack.verification import methods

UNIT = xc.Isotropic(1.0, 0.3, "strain")
PULLED = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]


def with_error(problem, crack=0):
    return xc.stress_intensity(xc.solve(problem, error=True), crack)


def holds(sif, wanted):
    """Whether the bar of the best K holds in all components."""
    return (np.abs(np.asarray(wanted) - sif.best) <= sif.bar).all()


def on_all_sides(mesh, points, values, **options):
    supports = [xc.displacement("boundary", lambda x: values(x)[0])]
    return xc.Problem(mesh, UNIT, [xc.line_crack(points)], supports, order=2, **options)


@pytest.mark.parametrize("n", [11, 14, 20])
def test_griffith(n):
    """Best is nearer than K by more than half; the bar holds and is not ten times too long."""
    a, angle, shear = 0.45, 0.37, 0.4
    along = scenes.rows(angle)[0]
    values = scenes.turned(
        lambda x, y: exact.griffith(x, y, a, 1.0, 0.3, 0.0, 1.0, shear), np.zeros(2), angle
    )
    mesh = scenes.perturbed(n, 631, 0.15)
    sif = with_error(on_all_sides(mesh, [-a * along, a * along], values, contact="off"))
    wanted = np.sqrt(np.pi * a) * np.array([[1.0, -shear], [1.0, shear]])
    assert np.linalg.norm(wanted - sif.best) < 0.6 * np.linalg.norm(wanted - sif.K)
    assert holds(sif, wanted)
    assert sif.bar.max() < 5 * np.abs(wanted - sif.K).max()


@pytest.mark.parametrize("n", [18, 24])
def test_arc(n):
    """Most of the error of a bent crack is that the cut is straight in each cell."""
    radius, half = 0.8, 0.35
    field = exact.ArcCrack(radius, half, 1.0, 0.3, 1.0, 0.2, 0.0)
    t = np.linspace(-half, half, 2401)
    origin = np.array([-0.6, -0.35])
    points = origin + radius * np.stack([np.cos(t), np.sin(t)], axis=1) @ scenes.rows(0.4)
    values = scenes.turned(field.field, origin, 0.4)
    sif = with_error(on_all_sides(scenes.perturbed(n, 77, 0.15), points, values, contact="off"))
    wanted = np.array([np.array(field.K_lower) * [1, -1], field.K_upper])
    assert np.linalg.norm(wanted - sif.best) < 0.3 * np.linalg.norm(wanted - sif.K)
    assert holds(sif, wanted)


def test_half_closed():
    """The end of contact is in the bar; K_I of the closed tip is zero and its eta too."""
    a, mean = 0.5, 0.2
    K = exact.partial_closure_params(a, mean, 1.0)[2]
    values = scenes.turned(
        lambda x, y: exact.partial_closure(x, y, a, 1.0, 0.3, mean, 1.0), np.zeros(2), 0.0
    )
    for n in (20, 31):
        mesh = scenes.perturbed(n, 641, 0.1)
        problem = on_all_sides(mesh, [(-a, 0.0), (a, 0.0)], values)
        sif = with_error(problem)
        assert sif.closed.tolist() == [True, False]
        assert sif.best[0, 0] == sif.eta[0, 0] == 0
        assert sif.bar[0, 0] == sif.spread[0, 0] > 0
        assert holds(sif, [[0.0, 0.0], [K, 0.0]])


def test_kink_against_a_finer_mesh():
    points = [(-0.45, -0.1), (0.1, 0.05), (0.4, -0.2)]

    def problem(n):
        mesh = xc.box((-1, -1), (1, 1), n)
        return xc.Problem(mesh, UNIT, [xc.line_crack(points)], loads=PULLED, order=2)

    fine = with_error(problem(63))
    for n in (11, 17):
        sif = with_error(problem(n))
        assert holds(sif, fine.best)
        # Of a cut that rounds the kink off K is 4.5e-3 off, and eta sees two thirds of it.
        assert np.abs(sif.K - fine.best).max() < 2.2e-3
        assert np.abs(sif.best - fine.best).max() < 2.2e-3


@pytest.mark.parametrize("exponent", [0, 1], ids=["jump", "bend"])
def test_pressure_that_changes_between_points(exponent):
    """Against cells of 2e-3 at both ends of the load; K is off by 1e-2 and 5e-4."""
    half, line = 0.137, xc.line_crack([(-0.5, 0.03), (0.5, 0.03)])

    def pressure(x):
        return -(np.maximum(1 - np.abs(x[:, 0]) / half, 0.0) ** exponent) * (np.abs(x[:, 0]) < half)

    def size(x):
        away = np.linalg.norm(x[:, None] - [[-half, 0.03], [half, 0.03]], axis=2).min(axis=1)
        return 2e-3 + 0.2 * away

    mesh = xc.box((-1, -1), (1, 1), 14)
    problem = xc.Problem(mesh, UNIT, [line], loads=[*PULLED, xc.crack_pressure(pressure)])
    wanted = with_error(replace(problem, mesh=xc.refine(mesh, size=size))).best
    sif = with_error(problem)
    assert holds(sif, wanted)
    assert np.abs(sif.best - wanted).max() < 0.3 * np.abs(sif.K - wanted).max()


# Little room, a cross that rubs, tips that are near, faces that overlap, tees where some or all
# faces press, an arc that rubs: their errors were 3, 7.3, 3.4, 14, 2.4, 1.8 and 3.2 bars once.
MISSED = (2725, 860, *mission(4295, 4665, 5330, 6440, 1415))


@pytest.mark.parametrize("seed", MISSED)
def test_bars_of_drawn_scenes_that_missed(seed):
    """Against two finer meshes.

    With little room, too few points of the domain were the error; where faces of a crack that is
    open overlap between pressures, no bar knew it; at tees where faces press the estimate has no
    sign; with friction none knew where faces begin to stick, slip and open.
    """
    scene = drawn_cracks.plane(seed)
    sifs = [with_error(scene.problem, c) for c in range(len(scene.problem.cracks))]
    x, best, bar = (np.concatenate([getattr(s, n) for s in sifs]) for n in ("x", "best", "bar"))
    wanted, doubt = drawn_cracks.truth(scene, x)
    is_closed = np.concatenate([s.closed for s in sifs])
    error = np.abs(best - wanted)
    error[is_closed, 0] = 0.0
    assert (error <= bar).all(), (error / bar).max()
    assert bar.max() < 0.15 * np.abs(wanted).max()
    assert (doubt <= 0.2 * bar).mean() > 0.6


def pressed(mesh, line, stress=((-1.0, -0.5), (-0.5, -1.0))):
    loads = [xc.traction(side, lambda x, n: n @ np.array(stress)) for side in scenes.SIDES]
    return with_error(xc.Problem(mesh, UNIT, [xc.line_crack(line)], loads=loads, order=2))


@pytest.mark.parametrize("turn", [-0.5, 0.7])
def test_faces_that_press_at_a_kink(turn):
    """The cut follows the kink, and the bar holds, against a mesh that is fine there."""
    kink, coarse = np.array([0.1, 0.05]), xc.box((-1, -1), (1, 1), 24)
    line = [(-0.45, -0.1), kink, kink + 0.4 * scenes.rows(0.25 + turn)[0]]
    fine = xc.refine(
        coarse, size=lambda x: np.maximum(1e-3, 0.2 * np.linalg.norm(x - kink, axis=1))
    )
    wanted = pressed(fine, line).K
    for n in (13, 20):
        sif = pressed(xc.box((-1, -1), (1, 1), n), line)
        assert sif.closed.all()
        assert (np.abs(sif.best - wanted) <= sif.bar).all()
        assert np.abs(sif.K - wanted).max() < 0.01 * np.abs(wanted).max()
        assert np.abs(sif.best - wanted).max() < 0.01 * np.abs(wanted).max()


def test_closed_faces_that_zigzag_along_edges():
    """Turns of 7 degrees are no kinks, but faces lock there: bars were 200 times too short."""
    n, k = 24, np.arange(7)
    line = np.stack([-0.2 + 0.005 * (-1) ** k, -0.25 + k / 12], axis=1)

    def mesh(n):
        grid = xc.box((-1, -1), (1, 1), n)
        nearest = np.linalg.norm(grid.points[:, None] - line, axis=2).argmin(axis=0)
        x = np.array(grid.points)
        x[nearest] = line
        return xc.Mesh(x, grid.cells, grid.facet_sets)

    stress = ((-1.0, -0.7), (-0.7, -1.0))
    given = mesh(n)
    fine = xc.refine(given, size=lambda x: np.maximum(
        4e-3, 0.2 * np.linalg.norm(x[:, None] - line, axis=2).min(axis=1)))  # fmt: skip
    wanted, sif = pressed(fine, line, stress).K, pressed(given, line, stress)
    assert sif.closed.all()
    assert (np.abs(sif.best - wanted)[:, 1] <= sif.bar[:, 1]).all()
    off = np.abs(sif.K - wanted)[:, 1]
    assert off.max() > 0.01 * np.abs(wanted).max()  # discretisation
    assert (np.abs(sif.best - wanted)[:, 1] < 0.6 * off).all()


def test_no_bar_where_faces_press_at_a_kink_that_is_rounded():
    """One sharper than 100 degrees; a smooth closed arc has a bar."""
    kink, mesh = np.array([0.1, 0.05]), xc.box((-1, -1), (1, 1), 14)
    line = [(-0.45, -0.1), kink, kink + 0.4 * scenes.rows(0.25 + 1.9)[0]]
    sif = pressed(mesh, line, ((-1.0, -0.2), (-0.2, -1.0)))
    assert np.isnan(sif.bar).all()
    assert "press at the kink" in sif.reasons[0]
    t = np.linspace(-0.4, 0.4, 61)
    arc = np.stack([0.9 * np.sin(t), 0.9 * (np.cos(t) - 1) + 0.05], axis=1) @ scenes.rows(0.5)
    sif = pressed(mesh, arc)
    assert sif.closed.any()
    assert np.isfinite(sif.bar).all()


@pytest.mark.slow
@pytest.mark.mission
def test_hole_whose_curve_is_known():
    """A polygon of few sides: most of what it changes is in eta."""
    K = {}
    for size in (0.14, 0.03):
        mesh = xc.plate_with_hole(width=2, height=2, radius=0.25, size=size, size_near=size / 2)
        crack = xc.line_crack([(0.2, 0.01), (0.6, 0.01)])
        K[size] = with_error(xc.Problem(mesh, UNIT, [crack], loads=PULLED))
    coarse, wanted = K[0.14], K[0.03].best
    assert np.abs(coarse.best - wanted).max() < 0.2 * np.abs(coarse.K - wanted).max()
    assert holds(coarse, wanted)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.28, 0.14])
def test_hole_whose_curve_is_not_known(size):
    """Bars are those of the polygon, and what the curve changes is said: to a third of it."""
    K, messages = [], []
    crack = xc.line_crack([(0.2, 0.01), (0.6, 0.01)])
    round_mesh = xc.plate_with_hole(width=2, height=2, radius=0.25, size=size, size_near=size / 2)
    polygon = xc.Mesh(round_mesh.points, round_mesh.cells, round_mesh.facet_sets)
    for mesh in (round_mesh, polygon, xc.fit_curves(polygon)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = xc.adapt(xc.Problem(mesh, UNIT, [crack], loads=PULLED), 2e-3, progress=False)
        assert result.met, result.reason
        K.append(result.sif.best[0])
        messages.append([str(m.message) for m in caught if "chords of curves" in str(m.message)])
    assert [len(m) for m in messages] == [0, 1, 0]
    share = np.abs(K[1] - K[0]).max() / np.abs(K[0]).max()
    warned_share = float(messages[1][0].split("about ")[1].split()[0])
    print(f"\nK changes by {share:.4f}, {warned_share:.4f} is said")
    assert share > 2e-3
    assert warned_share == pytest.approx(share, rel=1 / 3)
    assert K[2] == pytest.approx(K[0], abs=2 * 2e-3 * np.abs(K[0]).max())


def test_chords_are_seen_after_they_are_bisected():
    """What their curve changes is the same on finer cells of one polygon, to a tenth."""
    mesh = xc.plate_with_hole(width=2, height=2, radius=0.25, size=0.28, size_near=0.14)
    crack = xc.line_crack([(0.2, 0.01), (0.6, 0.01)])
    shares = []
    mesh = xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets)
    for body in (mesh, xc.refine(mesh)):
        with pytest.warns(xc.XcrackWarning, match="chords of curves") as caught:
            with_error(xc.Problem(body, UNIT, [crack], loads=PULLED))
        shares += {
            float(str(m.message).split("about ")[1].split()[0])
            for m in caught
            if "chords of curves" in str(m.message)
        }
    print(f"\nK changes by {shares}")
    assert len(shares) == 2
    assert shares[1] == pytest.approx(shares[0], rel=0.1)


def edge(n=10, **options):
    mesh = xc.box((0, -1), (1, 1), (n, 2 * n))
    crack = xc.line_crack([(-0.3, 0.01), (options.pop("tip", 0.4), 0.01)])
    return xc.Problem(mesh, UNIT, [crack], loads=PULLED, **options)


def test_states_scale_and_rest():
    half, rest, one = xc.solve(edge(), states=[0.5, 0.0, 1.0], error=True)
    small, zero, large = xc.stress_intensities([half, rest, one])
    assert large.eta == pytest.approx(2 * small.eta, rel=1e-9)
    assert large.bar == pytest.approx(2 * small.bar, rel=1e-6)
    assert not zero.eta.any()
    assert not zero.bar.any()


def test_stored_solution_is_solved_again():
    solution = xc.solve(edge(), error=True)
    at_once = xc.stress_intensity(solution)
    stored = pickle.loads(pickle.dumps(solution))
    assert stored.factored is None
    assert np.isnan(xc.stress_intensity(stored).eta).all()
    later = xc.stress_intensity(stored, error=True)
    assert later.eta == pytest.approx(at_once.eta, rel=1e-9)
    assert later.K.tolist() == at_once.K.tolist()


@pytest.mark.parametrize(
    ("problem", "word"),
    [
        (edge(order=1), "order=2"),
        (edge(contact="on", numerics=xc.Numerics(contact_method=methods.penalty())), "penalty"),
    ],
)
def test_no_bar_and_why(problem, word):
    """What a second solution does not show either."""
    sif = with_error(problem)
    assert np.isnan(sif.eta).all()
    assert np.isnan(sif.bar).all()
    assert np.isnan(sif.best).all()
    assert word in sif.reasons[0]


def rubbing(n=10, **options):
    """An inner crack that is pressed and sheared, with friction."""
    S = np.array([[-0.3, 0.6], [0.6, -1.0]])
    loads = [xc.traction(side, lambda x, normal: normal @ S) for side in scenes.SIDES]
    line = xc.line_crack([(-0.41, -0.12), (0.37, 0.05)])
    return xc.Problem(
        scenes.perturbed(n, 5, 0.15), UNIT, [line], loads=loads, friction=0.3, **options
    )


@pytest.mark.parametrize(
    "problem",
    [
        edge(n=8, tip=0.2),
        edge(n=8, tip=0.93),
        rubbing(),
    ],
    ids=["short", "before a side", "friction"],
)
def test_bar_from_smaller_cells(problem):
    """Where one solution has no estimate a second one has; against a mesh that is fine there."""
    sif = with_error(problem)
    assert sif.reasons == ("",) * len(sif.K)
    tips = problem.placed[0].points[list(problem.placed[0].tips)]

    def size(x):
        away = np.linalg.norm(x[:, None] - tips, axis=2).min(axis=1)
        return np.minimum(0.005 + 0.15 * away, 0.06)

    fine = replace(problem, mesh=xc.refine(problem.mesh, size=size))
    wanted = xc.stress_intensity(xc.solve(fine)).K
    assert holds(sif, wanted)
    assert np.abs(sif.best - wanted).max() < np.abs(sif.K - wanted).max()
    assert sif.bar.max() < 0.1 * np.abs(wanted).max()


def test_no_bar_for_a_state_of_a_path_that_is_not_given():
    """With friction a state is reached by way of others: without them there is no second one."""
    states = xc.solve(rubbing(), states=[0.5, 1.0], error=True)
    assert np.isnan(xc.stress_intensity(states[1]).bar).all()
    assert np.isfinite(xc.stress_intensities(states)[1].bar).all()


def test_not_asked_for():
    sif = xc.stress_intensity(xc.solve(edge()))
    assert np.isnan(sif.bar).all()
    assert "error=True" in sif.reasons[0]
    solution = xc.solve(edge(), error=True)
    assert np.isnan(xc.stress_intensity(solution, error=False).bar).all()


@pytest.mark.parametrize("wrong", [1, "yes", None, np.array([True])])
def test_wrong_choice(wrong):
    with pytest.raises(xc.ProblemError, match="True or False"):
        xc.solve(edge(n=4), error=wrong)
    if wrong is not None:
        with pytest.raises(xc.ProblemError, match="True or False"):
            xc.stress_intensity(xc.solve(edge(n=4)), error=wrong)


@pytest.mark.slow
def test_bars_on_a_closed_arc():
    """K_II of an arc that presses and slides: within its bar, which is at most ten times as long.

    Against cells three times smaller; in the median of tips, as one of them may be right by chance.
    """
    loads = [
        xc.traction("right", (-100, 10)), xc.traction("left", (100, -10)),
        xc.traction("top", (10, -60)), xc.traction("bottom", (-10, 60)),
    ]  # fmt: skip

    def K_II(half, n):
        t = np.linspace(-half, half, 641)
        crack = xc.line_crack(np.c_[np.cos(t) + 0.017, np.sin(t) - 0.011])
        body, material = xc.box((-2, -2), (2, 2), n), xc.Isotropic(1e5, 0.3, plane="strain")
        solution = xc.solve(xc.Problem(body, material, [crack], loads=loads), error=True)
        sif = xc.stress_intensity(solution)
        row = np.argsort(sif.x[:, 1])
        return sif.best[row, 1], sif.bar[row, 1]

    ratios = []
    for half in np.radians([45.0, 70.0, 100.0]):
        best, bar = K_II(half, 41)
        error = np.abs(best - K_II(half, 121)[0])
        assert (error <= bar).all()
        ratios += (bar / error).tolist()
    assert np.median(ratios) <= 10


# A junction .9 cells from the mouth of its crack, a kink .06 cells from the boundary, a pressed T.
OFF_BY_BARS = {
    "pressed T": (
        16, 0.45, "strain", [[-0.9585, -0.1425], [-0.1425, -0.5101]],
        [[(-0.2909604624, -1.001), (-0.2600695669746747, -0.16433349455816926)],
         [(-0.28180532179043694, -0.7530369871618295), (0.17036212095, -0.63034241137)]],
    ),
    "pulled T": (
        19, 0.45, "stress", [[0.8132, 0.2247], [0.2247, 0.7297]],
        [[(0.6239679428030676, -1.001), (0.7106697465363954, -0.6959448744362646)],
         [(0.661838683096792, -0.8677540588771753), (0.2189712558, -0.5676069970853708)]],
    ),
    "kink beside a side": (
        6, 0.3, "strain", [[0.0579, -0.4048], [-0.4048, -0.8451]],
        [[(-0.215328080823, -0.108263246313), (-0.226088670769, 0.682280868278),
          (-0.668437918039, 0.98024166448817), (-1.5726046705122, 0.6278535426)]],
    ),
}  # fmt: skip


def K_and_bars(name, levels):
    n, nu, plane, S, cracks = OFF_BY_BARS[name]
    mesh = xc.box((-1, -1), (1, 1), n)
    for _ in range(levels):
        mesh = xc.refine(mesh)
    loads = [
        xc.traction(side, lambda x, normal: normal @ np.array(S))
        for side in ("left", "right", "bottom", "top")
    ]
    material = xc.Isotropic(1.0, nu, plane=plane)
    problem = xc.Problem(mesh, material, [xc.line_crack(c) for c in cracks], loads=loads)
    solution = xc.solve(problem, error=True)
    return [xc.stress_intensity(solution, c) for c in range(len(cracks))]


@pytest.mark.slow
@pytest.mark.parametrize("name", OFF_BY_BARS)
def test_no_bar_that_does_not_hold_at_junctions_and_kinks(name):
    """Cells four times smaller: within 1.5 bars, or nan with a reason; it was 3 to 39 bars."""
    for sif, fine in zip(K_and_bars(name, 0), K_and_bars(name, 2), strict=True):
        has_bar = np.isfinite(sif.bar)
        off = np.abs(sif.best - fine.best)
        assert (off <= 1e-12 + 1.5 * sif.bar)[has_bar].all()
        assert all(
            reason for reason, row in zip(sif.reasons, has_bar, strict=True) if not row.all()
        )
