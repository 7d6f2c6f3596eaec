"""Cracks in 3D that end on the face of others: slices against the plane, and what is refused."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

import xcrack as xc
from xcrack.output.lip_faces_3d import junction_lines, lip_faces
from xcrack.view.matplotlib import draw_cracks
from xcrack.view.report_viewer import solution_layers

DATA = Path(__file__).parents[1] / "data"
STEEL = xc.Isotropic(1e5, 0.3)
Z, X, LENGTH, THICK = 0.013, 0.07, 0.4, 0.4
THROUGH = [(-0.51, Z), (0.52, Z)]


def pulled(scale, sideways):
    """Tractions in x and z that balance, by the set on which they act."""
    pairs = {"top": (30.0, 100.0), "right": (sideways, 30.0)}
    pairs |= {"bottom": (-30.0, -100.0), "left": (-sideways, -30.0)}
    return {name: scale * np.array(t) for name, t in pairs.items()}


def strip(line):
    """A plane crack through the thickness over a line in x and z."""
    (xa, za), (xb, zb) = line
    return xc.plane_crack([(xa, -0.6, za), (xb, -0.6, zb), (xb, 0.6, zb), (xa, 0.6, za)])


def side_above(crack):
    """Side of a crack that looks up."""
    a, b, c = crack.points[crack.faces[0]]
    return 1 if np.cross(b - a, c - a)[2] > 0 else -1


def slice_of_T(n, angle, order, scale=1.0, sideways=60.0, **options):
    """A T in plane strain: a slice in space, and the same in the plane."""
    turned = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    ends = [np.array([X, Z]) + t * turned for t in (-0.35, 0.0, LENGTH)]
    t = pulled(scale, sideways)
    through = strip(THROUGH)
    space = xc.Problem(
        xc.box((-1, -THICK / 2, -1), (1, THICK / 2, 1), (n, 3, n)),
        STEEL,
        [through, xc.arm(strip((ends[0], ends[2])), 0, side_above(through))],
        supports=[xc.fix("front", axis=1), xc.fix("back", axis=1)],
        loads=[xc.traction(name, (v[0], 0.0, v[1])) for name, v in t.items()],
        order=order,
        **options,
    )
    plane = xc.Problem(
        xc.box((-1, -1), (1, 1), 81),
        xc.Isotropic(1e5, 0.3, plane="strain"),
        [xc.line_crack(THROUGH), xc.line_crack([ends[1], ends[2]])],
        loads=[xc.traction(name, tuple(v)) for name, v in t.items()],
        **options,
    )
    return xc.solve(space), xc.solve(plane)


def K_of(solution):
    """Means over each front in space, K of each tip in the plane; K_I and K_II."""
    rows = []
    for c in range(len(solution.problem.cracks)):
        sif = xc.stress_intensity(solution, c)
        rows += [sif.K[sif.front == f, :2].mean(axis=0) for f in np.unique(sif.front)]
    return np.array(rows)


def plane_K(solution):
    return np.concatenate([xc.stress_intensity(solution, c).K for c in (0, 1)])


@pytest.mark.slow
def test_slice_of_a_T_on_a_coarse_mesh():
    """Order 1: discretisation."""
    space, plane = slice_of_T(21, 90.0, 1, contact="off")
    assert space.energy / THICK == pytest.approx(plane.energy, rel=0.01)
    K, wanted = K_of(space), plane_K(plane)
    assert np.abs(K - wanted).max() < 0.06 * np.abs(wanted).max()
    assert len(space.problem.junctions) == 1


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("angle", [90.0, 50.0])
def test_slice_of_a_T(angle):
    """Energy to 5e-4 and K to half a percent of that in the plane, at 43 k unknowns."""
    space, plane = slice_of_T(21, angle, 2, contact="off")
    energy = space.energy / THICK / plane.energy - 1
    error = np.abs(K_of(space) - plane_K(plane)).max() / np.abs(plane_K(plane)).max()
    print(f"\n{angle:.0f} degrees: energy {energy:.1e}, K {error:.1e}")
    assert abs(energy) < 5e-4
    assert error < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize(("height", "place"), [(0.0, 0.07), (0.013, 0.0), (0.0, 0.0)])
def test_slice_of_a_T_on_planes_of_the_mesh(monkeypatch, height, place):
    """Either crack, or both, on facets of the mesh: as between them (discretisation)."""
    here = sys.modules[__name__]
    monkeypatch.setattr(here, "Z", height)
    monkeypatch.setattr(here, "X", place)
    monkeypatch.setattr(here, "THROUGH", [(-0.51, height), (0.52, height)])
    space, plane = slice_of_T(20, 90.0, 1, contact="off")
    assert space.energy / THICK == pytest.approx(plane.energy, rel=0.01)
    K, wanted = K_of(space), plane_K(plane)
    assert np.abs(K - wanted).max() < 0.02 * np.abs(wanted).max()


@pytest.mark.slow
def test_closed_slice_of_a_T():
    """Forces to .3 %, K_II to 2 % and pressures away from the ends to 15 %."""
    space, plane = slice_of_T(31, 90.0, 1, -1.0, 80.0, contact="on")
    K, wanted = K_of(space), plane_K(plane)
    force = [
        [float((c.measure * c.pressure).sum()) / thick for c in s.contact]
        for s, thick in ((space, THICK), (plane, 1.0))
    ]
    print(f"\nforces {force}, K_II {K[:, 1]} for {wanted[:, 1]}")
    assert np.allclose(force[0], force[1], rtol=3e-3)
    assert np.abs(K[:, 1] - wanted[:, 1]).max() < 0.02 * np.abs(wanted[:, 1]).max()


# Joins at less than ten degrees: an arm that lies along the other crack over many cells.
BESIDE = [(-0.85, Z), (0.4, Z)]
# K_I, K_II of both tips of that and of the arm, in the plane: quadratic triangles with quarter
# points whose nodes are split (`network_K` of benchmarks.baselines.network_2d), to .01.
CONFORMING = {
    3.0: [(339.76, -86.79), (-3.05, -3.59), (294.75, 88.63)],
    5.0: [(337.22, -81.72), (2.24, 1.44), (289.48, 91.14)],
    8.0: [(333.00, -75.45), (15.84, 11.35), (281.55, 93.16)],
}
PRESSED = {5.0: [96.22, -20.83, -85.77]}  # K_II, and no friction


def slice_at_a_small_angle(angle, n, scale=1.0, sideways=60.0, **options):
    """An arm that leaves a crack flatly and passes its front; and the thickness of the slice."""
    turned = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    root = np.array([-0.55, Z])
    before, end = root - 0.02 * turned, root + 1.3 * turned
    thick, through = 8 / n, strip(BESIDE)
    problem = xc.Problem(
        xc.box((-1, -thick / 2, -1), (1, thick / 2, 1), (n, 4, n)),
        STEEL,
        [through, xc.arm(strip((before, end)), 0, side_above(through))],
        supports=[xc.fix("front", axis=1), xc.fix("back", axis=1)],
        loads=[xc.traction(name, (v[0], 0.0, v[1])) for name, v in pulled(scale, sideways).items()],
        order=1,
        **options,
    )
    return xc.solve(problem), thick


@pytest.mark.slow
@pytest.mark.parametrize("angle", CONFORMING)
def test_a_join_below_ten_degrees(angle):
    """Energy on two meshes to half a percent, K as in the plane to 3 % (discretisation)."""
    (coarse, thick), (fine, less) = (
        slice_at_a_small_angle(angle, n, contact="off") for n in (53, 65)
    )
    energy, wanted = np.array([coarse.energy / thick, fine.energy / less]), CONFORMING[angle]
    error = np.abs(K_of(fine) - wanted).max() / np.abs(wanted).max()
    print(f"\n{angle:.0f} degrees: energy {energy}, K {error:.1e}")
    assert energy[0] == pytest.approx(energy[1], rel=5e-3)
    assert error < 0.03


@pytest.mark.slow
def test_a_closed_join_below_ten_degrees():
    """K_II of pressed faces at five degrees to 2 % of the largest (discretisation)."""
    solution, _ = slice_at_a_small_angle(5.0, 53, -1.0, 80.0, contact="on")
    K, wanted = K_of(solution), np.array(PRESSED[5.0])
    print(f"\nK {K.tolist()}")
    assert (K[:, 0] == 0).all()
    assert np.abs(K[:, 1] - wanted).max() < 0.02 * np.abs(wanted).max()


@pytest.mark.slow
def test_an_arm_too_close_to_the_front_that_it_passes_is_refused():
    """At half a cell K of that front would be foreign, and the energy 8 % off."""
    with pytest.raises(xc.XcrackError, match=r"passes its front at .* refine the mesh"):
        slice_at_a_small_angle(3.0, 33, contact="off")


@pytest.mark.slow
def test_pressures_end_at_the_junction():
    """No group of the crack that runs through reaches to both sides of the arm."""
    from xcrack.analysis.multipliers import multipliers

    space, _ = slice_of_T(21, 90.0, 1, contact="off")
    lips = space.lips[0]
    values = multipliers(space.space, 0, lips, "reduced").values
    above = lips.x[:, 0] > X
    near = np.abs(lips.x[:, 0] - X) < 0.3
    mass = np.stack(
        [np.asarray(values.T @ (lips.weight * near * part)).ravel() for part in (above, ~above)]
    )
    shared = mass.min(axis=0) / mass.sum(axis=0).clip(1e-300)
    assert (shared < 0.02).all()
    assert values.sum(axis=1) == pytest.approx(1.0)


PULL = [
    xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0)),
    xc.traction("right", (100.0, 0, 0)), xc.traction("left", (-100.0, 0, 0)),
]  # fmt: skip
ONE = xc.penny_crack((0.013, 0.0, 0.017), (0, 0, 1), 0.65)
OTHER = xc.penny_crack((0.013, 0.0, 0.017), (1, 0, 0), 0.35)


def scene(cracks, n=13, **options):
    mesh = xc.box((-1,) * 3, (1,) * 3, n)
    options = {"order": 1, "loads": PULL, **options}
    return xc.Problem(mesh, STEEL, cracks, **options)


def crossing():
    return [ONE, xc.arm(OTHER, 0, 1), xc.arm(OTHER, 0, -1)]


@pytest.mark.slow
def test_crossing_pennies_are_symmetric():
    """Both arms bear the same but for the mesh, and less than the penny alone near the other."""
    solution = xc.solve(scene(crossing()))
    alone = xc.stress_intensity(xc.solve(scene([OTHER])), 0).K[:, 0].mean()
    K = [xc.stress_intensity(solution, c).K[:, 0] for c in (1, 2)]
    assert K[0].mean() == pytest.approx(K[1].mean(), rel=0.05)
    for arm in K:
        assert 0 < arm[[0, -1]].max() < 0.5 * arm.max() < arm.max() < alone
    opened = xc.solve(scene([ONE])).energy
    assert solution.energy > opened


@pytest.mark.slow
def test_crossing_pennies():
    """A conforming quadratic mesh has 1.10e-3 for the energy that the second penny adds."""
    solution, one = (
        xc.solve(scene(cracks, 21, order=2, contact="off")) for cracks in (crossing(), [ONE])
    )
    K = [xc.stress_intensity(solution, c).K[:, 0] for c in (1, 2)]
    print(f"\nadded {solution.energy - one.energy:.3e}, arms {K[0].mean():.2f}, {K[1].mean():.2f}")
    assert K[0].mean() == pytest.approx(K[1].mean(), rel=0.01)


@pytest.mark.slow
@pytest.mark.mission
def test_K_of_crossing_pennies():
    """Against a conforming mesh of 134 k unknowns, at 48 k of order 1 (discretisation).

    Nothing is extrapolated: K of the arms is compared from a fixed depth at the junction on.
    """
    wanted = json.loads((DATA / "crossing_pennies.json").read_text())["fine"]
    centre = np.array((0.013, 0.0, 0.017))
    large, small = (xc.penny_crack(centre, *each) for each in (((0, 0, 1), 0.6), ((1, 0, 0), 0.3)))
    crossed, alone = (
        xc.solve(scene(cracks, 21, contact="off"))
        for cracks in ([large, xc.arm(small, 0, 1), xc.arm(small, 0, -1)], [large])
    )
    added = (crossed.energy - alone.energy) / (100.0**2 / 1e5)
    off = added / wanted["energy added by the small one"] - 1
    print(f"\nenergy {off:+.3f}", end="")
    assert abs(off) < 0.05
    for c, (name, radius, first, across) in enumerate(
        (("large", 0.6, 0, 1), ("small", 0.3, 1, 2), ("small", 0.3, 1, 2))
    ):
        sif = xc.stress_intensity(crossed, c)
        x = np.abs(sif.x - centre)
        angle = np.degrees(np.arctan2(x[:, across], x[:, first]))
        own = PchipInterpolator([float(a) for a in wanted[name]], list(wanted[name].values()))
        unit = 2 * 100.0 * np.sqrt(radius / np.pi)
        error = (sif.K[:, 0] / unit - own(angle))[~sif.at_surface]  # the others have K of a depth
        angle = angle[~sif.at_surface]
        largest = max(wanted[name].values())
        print(f"; {name}: {np.abs(error).max() / largest:.3f}", end="")
        if name == "large":
            assert np.abs(error).max() < 0.02 * largest
            continue
        assert np.sqrt((error**2).mean()) < 0.03 * largest
        near, far = angle <= 15.0, angle >= 45.0
        assert np.abs(error / own(angle))[near].max() < 0.10
        assert np.abs(error / own(angle))[far].max() < 0.04
        for end in sif.ends:
            depth = np.degrees(end.depth / radius)
            assert depth == pytest.approx(3.6, rel=0.01)  # 2 % of the arm's front
            assert end.K[0] / unit == pytest.approx(float(own(depth)), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "order", "bounds"), [(21, 1, (0.08, 0.06, 0.04)), (13, 2, (0.08, 0.04, 0.025))]
)
def test_K_of_arms_by_the_distance_to_the_junction(n, order, bounds):
    """Within 15 degrees, from there to 45, and beyond; three and two cells a radius.

    What is off by 4 to 5 % from 15 degrees on at order 1 is so by 3.3 % at order 2.
    """
    wanted = json.loads((DATA / "crossing_pennies.json").read_text())["fine"]["small"]
    own = PchipInterpolator([float(a) for a in wanted], list(wanted.values()))
    centre = np.array((0.013, 0.0, 0.017))
    large, small = (xc.penny_crack(centre, *each) for each in (((0, 0, 1), 0.6), ((1, 0, 0), 0.3)))
    cracks = [large, xc.arm(small, 0, 1), xc.arm(small, 0, -1)]
    crossed = xc.solve(scene(cracks, n, order=order, contact="off"))
    sifs = [xc.stress_intensity(crossed, c) for c in (1, 2)]
    # Places on the junction have K of a fixed depth.
    x = np.abs(np.concatenate([sif.x[~sif.at_surface] for sif in sifs]) - centre)
    K = np.concatenate([sif.K_I[~sif.at_surface] for sif in sifs])
    K /= 2 * 100.0 * np.sqrt(0.3 / np.pi)
    angle = np.degrees(np.arctan2(x[:, 2], x[:, 1]))
    error = np.abs(K / own(angle) - 1)
    parts = np.digitize(angle, (15.0, 45.0))
    largest = [float(error[parts == part].max()) for part in range(3)]
    print(f"\n{np.round(largest, 3)}")
    assert (np.array(largest) < bounds).all()


@pytest.mark.slow
@pytest.mark.parametrize("n", [10, 12])
def test_bars_of_arms_hold(n):
    """K_I of arms at order 2 against the conforming mesh, which the term was chosen on."""
    wanted = json.loads((DATA / "crossing_pennies.json").read_text())["fine"]["small"]
    own = PchipInterpolator([float(a) for a in wanted], list(wanted.values()))
    centre = np.array((0.013, 0.0, 0.017))
    large, small = (xc.penny_crack(centre, *each) for each in (((0, 0, 1), 0.6), ((1, 0, 0), 0.3)))
    cracks = [large, xc.arm(small, 0, 1), xc.arm(small, 0, -1)]
    crossed = xc.solve(scene(cracks, n, order=2, contact="off"))
    hits = []
    for c in (1, 2):
        sif = xc.stress_intensity(crossed, c, error=True)
        x = np.abs(sif.x - centre)
        K = own(np.degrees(np.arctan2(x[:, 2], x[:, 1]))) * 2 * 100.0 * np.sqrt(0.3 / np.pi)
        hits.append((np.abs(sif.best[:, 0] - K) <= sif.bar[:, 0])[~sif.at_surface])
    print(f"\nheld {np.concatenate(hits).mean():.3f}")
    assert np.concatenate(hits).mean() >= 0.93


@pytest.mark.slow
def test_an_arm_may_be_drawn_to_the_face_or_far_beyond():
    """The same arm but for the sides of its outline (discretisation)."""
    angle = np.linspace(0.0, np.pi, 25)
    arc = np.stack([0 * angle + 0.013, 0.3 * np.cos(angle), 0.22 + 0.3 * np.sin(angle)], axis=1)

    def drawn_to(low):
        return xc.plane_crack([*arc.tolist(), (0.013, -0.3, low), (0.013, 0.3, low)])

    energy = np.array([
        xc.solve(scene(cracks, 11, contact="off")).energy
        for cracks in (
            [ONE], *([ONE, xc.arm(drawn_to(low), 0, side_above(ONE))] for low in (-0.4, 0.0, 0.017))
        )
    ])  # fmt: skip
    far, beyond, on_it = energy[1:] - energy[0]
    print(f"\n{far:.5f} {beyond:.5f} {on_it:.5f}")
    assert beyond == pytest.approx(far, rel=0.01)
    assert on_it == pytest.approx(far, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_closed_crossing(friction):
    """Pressed from all sides the faces bear the pressure of the whole body: nothing slips."""
    loads = [xc.pressure("boundary", 100.0)]
    solution = xc.solve(scene(crossing(), contact="on", friction=friction, loads=loads))
    for contact in solution.contact:
        mean = (contact.measure * contact.pressure).sum() / contact.measure.sum()
        assert mean == pytest.approx(100.0, rel=1e-6)
    plain = xc.solve(scene([], loads=loads)).energy
    assert solution.energy == pytest.approx(plain, rel=1e-8)


@pytest.mark.slow
def test_a_junction_is_seen_as_a_line(tmp_path):
    """As long as the arm is wide, in pictures and in the viewer of reports; no mouth beside it."""
    solution = xc.solve(scene(crossing(), contact="off"))
    arms = [lip_faces(solution, c) for c in (1, 2)]
    for lips in arms:
        ends = lips.points[lips.junction]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
        assert length == pytest.approx(0.7, rel=0.02)  # the front is a polygon
        assert ends[..., 2] == pytest.approx(0.017, abs=1e-9)
    assert not any(len(lip_faces(solution, c).mouth) for c in range(3))
    assert len(junction_lines(solution, 0)) == 2
    layers = {layer["name"]: layer["n"] for layer in solution_layers(solution)}
    assert layers["junctions"] == sum(len(lips.junction) for lips in arms)
    draw_cracks(solution, "opening", [0, 1], tmp_path / "map.png", False, None, None, None)
    xc.plot(solution, "opening", file=tmp_path / "opening.png")


@pytest.mark.slow
def test_arm_leaves_the_body():
    """An arm on a crack that leaves the body with it has a front with two ends."""
    through = xc.plane_crack(
        [(-1.5, -0.7, 0.017), (1.5, -0.7, 0.017), (1.5, 1.5, 0.017), (-1.5, 1.5, 0.017)]
    )
    edge = xc.plane_crack(
        [(0.013, -0.2, -0.5), (0.013, 1.5, -0.5), (0.013, 1.5, 0.6), (0.013, -0.2, 0.6)]
    )
    problem = scene([through, xc.arm(edge, 0, side_above(through))], 9, contact="off",
                    supports=[xc.fix("bottom")], loads=PULL[:1])  # fmt: skip
    sif = xc.stress_intensity(xc.solve(problem), 1)
    assert np.isfinite(sif.K).all()
    assert (sif.x[:, 2] > 0.017).all()


@pytest.mark.slow
def test_arm_on_an_arm():
    """Three surfaces: the second ends on the first, the third on the second."""
    plates = [
        strip(THROUGH),
        xc.arm(strip([(X, -0.4), (X, 0.6)]), 0, side_above(strip(THROUGH))),
    ]
    normal = np.cross(*(np.diff(plates[1].points[plates[1].faces[0]], axis=0)))
    third = xc.arm(strip([(-0.4, 0.33), (0.5, 0.33)]), 1, 1 if normal[0] > 0 else -1)
    mesh = xc.box((-1, -0.2, -1), (1, 0.2, 1), (21, 3, 21))
    problem = xc.Problem(mesh, STEEL, [*plates, third], order=1, contact="off",
        supports=[xc.fix("front", axis=1), xc.fix("back", axis=1)], loads=PULL)  # fmt: skip
    solution = xc.solve(problem)
    sif = xc.stress_intensity(solution, 2)
    assert np.isfinite(sif.K).all()
    assert (sif.x[:, 0] > X).all()


@pytest.mark.slow
def test_saved_solution_knows_its_arms(tmp_path):
    solution = xc.solve(scene(crossing()))
    xc.save(solution, tmp_path / "crossing.npz")
    again = xc.load(tmp_path / "crossing.npz")
    assert [crack.ends_on for crack in again.problem.cracks] == [(), ((0, 1),), ((0, -1),)]
    assert np.array_equal(xc.stress_intensity(again, 1).K, xc.stress_intensity(solution, 1).K)


def upright(low):
    """A plane crack that stands on a height."""
    return xc.plane_crack(
        [(0.013, y, z) for y, z in ((-0.3, low), (0.3, low), (0.3, 0.5), (-0.3, 0.5))]
    )


BAD = {
    "crosses": ([ONE, OTHER], "let one of them end on the other"),
    "no such crack": ([ONE, xc.arm(OTHER, 2, 1)], "there are 2"),
    "on itself": ([ONE, xc.arm(OTHER, 1, 1)], "ends on itself"),
    "in a circle": ([xc.arm(ONE, 1, 1), xc.arm(OTHER, 0, 1)], "let one run through"),
    "twice": ([ONE, xc.arm(xc.arm(OTHER, 0, 1), 0, -1)], "an arm for each side"),
    "a third of a cell before": (
        [ONE, xc.arm(xc.penny_crack((0.013, 0.0, 0.43), (1, 0, 0), 0.35), 0, 1)],
        "does not reach crack 0",
    ),
    "a third of a cell beyond": (
        [ONE, xc.arm(xc.penny_crack((0.013, 0.0, 0.33), (1, 0, 0), 0.35), 0, -1)],
        "Leave this arm out",
    ),
    "wrong side": (
        [ONE, xc.arm(xc.penny_crack((0.013, 0.0, 0.5), (1, 0, 0), 0.35), 0, -1)],
        "does not reach|wholly beyond",
    ),
    "along it": ([ONE, xc.arm(xc.penny_crack((0, 0, 0.03), (0.05, 0, 1), 0.4), 0, 1)],
        "2 degrees|Leave this arm out"),
    "touches along an edge": ([ONE, upright(0.017)], "touch near .* one of them end on the other"),
    "touches along an edge from the other side": (
        [ONE, xc.arm(upright(0.017), 0, -side_above(ONE))],
        "wholly beyond crack 0",
    ),
    "an arm that lies in it over an area": (
        [ONE, xc.arm(xc.penny_crack((0.5, 0.0, 0.017), (0, 0, 1), 0.35), 0, 1)],
        "crack 1 lies on crack 0.* leave out of crack 1 what lies in crack 0",
    ),
    "two sheets that share an edge": (
        [
            xc.plane_crack([(-0.6, -0.3, 0.017), (0.013, -0.3, 0.017), (0.013, 0.3, 0.017),
                            (-0.6, 0.3, 0.017)]),
            upright(0.017),
        ],
        "cross or touch near .* as one surface",
    ),
    "ends a third of a cell before a face": (
        [ONE, upright(0.067)], "two cracks run through the cell.* draw one on to the other"
    ),
    "lies in it over an area": (
        [ONE, xc.penny_crack((0.013, 0.0, 0.017), (0, 0, 1), 0.35)],
        "lie on each other near .* give both as one surface",
    ),
    "past its front": (
        [ONE, xc.arm(xc.penny_crack((0.5, 0.0, 0.017), (0, 1, 0), 0.35), 0, 1)],
        "front|closer than a cell",
    ),
    "interlocked": (
        [ONE, xc.arm(xc.penny_crack((0.013, 0.45, 0.017), (1, 0, 0), 0.4), 0, 1)],
        "front|closer than a cell",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_arms_are_refused_with_the_remedy(name):
    cracks, words = BAD[name]
    with pytest.raises(xc.XcrackError, match=words):
        xc.solve(scene(cracks))


@pytest.mark.slow
def test_remedies_for_an_edge_on_a_face_or_close_to_it():
    """As an arm where it touches; with finer cells where it ends a third of a cell before.

    The closer the edge the more energy: least half a cell away, most as an arm.
    """
    edge = upright(0.067)
    with pytest.raises(xc.GeometryError, match="refine the mesh between them"):
        xc.solve(scene([ONE, edge], contact="off"))
    coarse = scene([ONE]).mesh
    finest = float(coarse.cell_size.max()) / 4

    def size(x):
        is_between = (np.abs(x - (0.013, 0.0, 0.04)) < (0.1, 0.4, 0.1)).all(axis=1)
        return np.where(is_between, finest, np.inf)

    close = xc.Problem(
        xc.refine(coarse, size=size), STEEL, [ONE, edge], loads=PULL, order=1, contact="off"
    )
    touching = [ONE, xc.arm(upright(0.017), 0, side_above(ONE))]
    energy = [
        xc.solve(problem).energy
        for problem in (
            scene([ONE], contact="off"),
            scene([ONE, upright(0.12)], contact="off"),
            close,
            scene(touching, contact="off"),
        )
    ]
    print(f"\n{energy}")
    assert (np.diff(energy) > 0).all()


@pytest.mark.slow
def test_the_remedy_for_surfaces_that_lie_on_each_other():
    """Two discs of one plane as one surface open more than the larger one."""
    centre, angle = np.array((0.25, 0.0)), np.linspace(0, 2 * np.pi, 241)[:-1]
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    large, small = ((0.013, 0.0), 0.65), ((0.5, 0.0), 0.35)
    reach = []
    for middle, radius in (large, small):
        d = np.array(middle) - centre
        reach.append(way @ d + np.sqrt((way @ d) ** 2 - d @ d + radius**2))
    outline = centre + np.max(reach, axis=0)[:, None] * way
    both = [xc.penny_crack((*middle, 0.017), (0, 0, 1), r) for middle, r in (large, small)]
    with pytest.raises(xc.GeometryError, match="give both as one surface"):
        xc.solve(scene(both, contact="off"))
    joined = xc.plane_crack(np.column_stack([outline, np.full(len(outline), 0.017)]))
    alone, united = (xc.solve(scene([c], contact="off")).energy for c in (both[0], joined))
    assert united > alone
