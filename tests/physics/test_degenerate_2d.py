"""Cracks where a method may break: on mesh lines, at nodes, at corners, beside edges and holes.

Tolerances are of discretisation unless they say otherwise. `pytest -s` prints the numbers.
"""

import warnings

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.scenes_2d import numerics_of

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))
SIDES = ("left", "right", "bottom", "top")
WANTED = np.array([1.0, 0.6])
# Half of the 0.5 % in which all places of a crack must agree; order 2 does far better.
PLACES = {1: 2.5e-3, 2: 5e-5}


def williams_on_shifted_mesh(n, shift, angle, order, **options):
    """The same crack, tip at the origin, under the same field; the regular mesh is shifted."""
    shift = np.asarray(shift)
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *WANTED), (0, 0), angle)
    return scenes.on_box(
        scenes.perturbed(n, 3, 0.0, tuple(-1 + shift), tuple(1 + shift)),
        [scenes.edge_line((0.0, 0.0), angle, 2.2)],
        field,
        traction=("left",),
        order=order,
        contact="off",
        numerics=numerics_of(**options),
    )


# In cells: tip at a node, at a node of the other kind of diagonal, on edges, in a cell.
BASES = {
    "node": (0.0, 0.0),
    "odd node": (1.0, 0.0),
    "middle of an edge": (0.5, 0.0),
    "somewhere on an edge": (0.3, 0.0),
    "on a vertical edge": (0.0, 0.5),
    "middle of a diagonal": (0.5, 0.5),
    "inside": (0.31, 0.23),
}
QUICK = {name: BASES[name] for name in ("node", "somewhere on an edge", "inside")}
ANGLES = {"along edges": 0.0, "along diagonals": np.pi / 4, "through nodes": np.arctan(0.5)}


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("direction", ANGLES)
def test_mesh_lines(direction, order):
    """On nodes, edges and diagonals, and 1e-12 of a cell beside them: one K."""
    check_places(direction, order, QUICK, (0.0, 1e-12))


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("direction", ANGLES)
def test_all_places_on_mesh_lines(direction, order):
    check_places(direction, order, BASES, (0.0, 1e-12, -1e-12, 1e-9, -1e-9))


def check_places(direction, order, bases, distances):
    n = 40
    h = 2 / n
    result = []
    for base in bases.values():
        for eps in distances:
            # Off both mesh lines, but along a diagonal: shift across it.
            away = (eps, -eps) if direction == "along diagonals" else (eps, eps)
            shift = h * (np.array(base) + away)
            if direction == "along diagonals" and base[0] == base[1]:
                shift = shift + np.array([h, 0.0])  # else it leaves through the corner: next test
            result.append(
                scenes.K_of(williams_on_shifted_mesh(n, shift, ANGLES[direction], order))[0]
            )
    error = np.abs(np.array(result) / WANTED - 1).max()
    spread = np.ptp(np.array(result) / WANTED, axis=0).max()
    print(f"\n{direction}, order {order}: K {error:.1e}, spread {spread:.1e} over {len(result)}")
    assert error <= PLACES[order]
    assert spread <= PLACES[order]


@pytest.mark.parametrize("order", [1, 2])
def test_dirichlet_at_a_mouth_on_a_node(order):
    """A side with imposed displacements is cut at a node: each facet tells its lip's value."""
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *WANTED), (0.03, 0.0))
    problem = scenes.on_box(
        xc.box((-1, -1), (1, 1), 40), [scenes.edge_line((0.03, 0.0), 0.0)], field, order=order,
        contact="off",
    )  # fmt: skip
    assert np.abs(scenes.K_of(problem)[0] / WANTED - 1).max() <= PLACES[order]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("reverse", "loaded"), [(True, "left"), (False, "bottom")])
def test_mouth_at_a_corner(order, reverse, loaded):
    """The crack runs along the diagonal into the corner; one side there is held, one loaded."""
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *WANTED), (0, 0), np.pi / 4)
    points = scenes.edge_line((0.0, 0.0), np.pi / 4, 2.2).points
    problem = scenes.on_box(
        xc.box((-1, -1), (1, 1), 40),
        [xc.line_crack(points[::-1] if reverse else points)],
        field,
        traction=(loaded,),
        order=order,
        contact="off",
    )
    K = scenes.K_of(problem)[0] * [1, -1 if reverse else 1]
    print(f"\ncorner, order {order}, reversed {reverse}: {np.abs(K / WANTED - 1).max():.1e}")
    assert np.abs(K / WANTED - 1).max() <= 4 * PLACES[order]


def test_a_corner_where_only_lip_minus_is_supported_is_refused():
    with pytest.raises(xc.ProblemError, match=r"displacement\('bottom'\) ends at \[-1.0, -1.0\].*"
                       "crack 0.*lip - only.*reverse order"):  # fmt: skip
        xc.solve(williams_on_shifted_mesh(8, (0.0, 0.0), np.pi / 4, 1))


@pytest.mark.parametrize("order", [1, 2])
def test_clamped_side_that_ends_at_the_mouth(order):
    """fix() at a corner where the crack leaves: lip + is held, lip - stays free."""
    mesh = xc.box((-1, -1), (1, 1), 16)
    crack = [xc.line_crack([(-1.3, -1.3), (0.0, 0.0)])]
    pull = [xc.traction("bottom", (0.2, -1.0))]
    supported = xc.Problem(mesh, STEEL, crack, supports=[xc.fix("left")], loads=pull, order=order)
    # It leaves through the bottom: all of the left side belongs to lip +.
    shifted = [xc.line_crack([(-1.3, -1.3 - 1e-3), (0.0, -1e-3)])]
    beside = xc.Problem(mesh, STEEL, shifted, supports=[xc.fix("left")], loads=pull, order=order)
    # A tip that has moved by a thousandth, and another trace of the mesh along the crack.
    K = [scenes.K_of(problem)[0] for problem in (supported, beside)]
    print(f"\nclamped to the mouth, order {order}: {K}")
    assert K[0] == pytest.approx(K[1], rel=3e-2)


# Nearly incompressible -------------------------------------------------------------------------


@pytest.mark.parametrize("nu", [0.499, 0.4999])
@pytest.mark.parametrize(
    ("order", "n", "factor"),
    # Linear triangles lock: 0.5 % at .499, 2 % at .4999, where .3 has 0.1 %. Order 2 does not.
    [(1, 41, {0.499: 1e-2, 0.4999: 3e-2}), (2, 20, {0.499: 3e-4, 0.4999: 1e-3})],
)
def test_nearly_incompressible(order, n, factor, nu):
    worst = 0.0
    for seed, (tip, angle) in enumerate(scenes.TIPS[:2], 3):
        field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, nu, *WANTED), tip, angle)
        problem = scenes.on_box(
            scenes.perturbed(n, seed), [scenes.edge_line(tip, angle)], field, traction=("left",),
            order=order, contact="off", nu=nu,
        )  # fmt: skip
        worst = max(worst, np.abs(scenes.K_of(problem)[0] / WANTED - 1).max())
    print(f"\nnu {nu} order {order}: K {worst:.1e}")
    assert worst <= factor[nu]


@pytest.mark.parametrize("nu", [0.499, 0.4999])
def test_nearly_incompressible_griffith_at_order_2(nu):
    problem, _ = scenes.griffith_box(40, half=1.5, stress=(0.0, 1.0, 0.5), angle=0.21, nu=nu)
    K = scenes.K_of(problem) / np.sqrt(np.pi)
    error = np.abs(K - [[1.0, -0.5], [1.0, 0.5]]).max()
    print(f"\nGriffith nu {nu} order 2: {error:.1e}")
    assert error <= 5e-3


# Random cracks ---------------------------------------------------------------------------------


def random_edge_crack(seed, order, n):
    """A tip and a direction anywhere, on a mesh perturbed by up to a quarter of a cell."""
    rng = np.random.default_rng(seed)
    tip, angle = rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi)
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, *WANTED), tip, angle)
    return scenes.on_box(
        scenes.perturbed(n, seed, rng.uniform(0, 0.25)),
        [scenes.edge_line(tip, angle, 3.0)],
        field,
        order=order,
        contact="off",
        numerics=xc.Numerics(radius=0.3),
    )


def campaign(seeds, order, n):
    error = {}
    for seed in seeds:
        try:
            K = scenes.K_of(random_edge_crack(seed, order, n))[0]
        except xc.XcrackError as problem:
            pytest.fail(f"seed {seed}, order {order}: {problem}")
        error[seed] = float(np.abs(K / WANTED - 1).max())
    median = float(np.median(list(error.values())))
    worst = max(error, key=lambda seed: error[seed])
    print(f"\n{len(error)} random cracks, order {order}: median {median:.1e}, worst "
          f"{error[worst] / median:.2f} times that (seed {worst})")  # fmt: skip
    return error, median, worst


@pytest.mark.parametrize(("order", "n", "median"), [(1, 24, 5e-3), (2, 16, 2e-4)])
def test_random_cracks(order, n, median):
    """20 of each order, every one solved, none far from the others."""
    error, result, worst = campaign(range(73000, 73020), order, n)
    assert result <= median
    assert error[worst] <= 3 * result, f"seed {worst}"


@pytest.mark.slow
@pytest.mark.parametrize(("order", "n", "median"), [(1, 30, 4e-3), (2, 20, 6e-5)])
def test_many_random_cracks(order, n, median):
    error, result, worst = campaign(range(91000, 91200), order, n)
    assert result <= median
    assert error[worst] <= 3 * result, f"seed {worst}"


def random_scene(seed):
    """One or two cracks of up to four points anywhere, both orders, some load."""
    rng = np.random.default_rng(seed)
    cracks = []
    for _ in range(rng.integers(1, 3)):
        start, angle = rng.uniform(-1.1, 1.1, 2), rng.uniform(-np.pi, np.pi)
        points = [start]
        for _ in range(rng.integers(1, 4)):
            angle += rng.uniform(-1.2, 1.2)
            points.append(points[-1] + rng.uniform(0.2, 0.6) * scenes.rows(angle)[0])
        cracks.append(points)
    a, b, c = rng.uniform(-1, 1, 3)
    stress = np.array([[a, c], [c, b]])
    mesh = scenes.perturbed(int(rng.integers(10, 22)), seed, rng.uniform(0, 0.25))
    loads = [xc.traction(s, lambda x, normal: normal @ stress) for s in SIDES]
    return mesh, cracks, loads, int(rng.integers(1, 3))


def solved_or_refused(seed):
    """True where a random scene is solved, False where an error of ours says why not."""
    mesh, cracks, loads, order = random_scene(seed)
    try:
        problem = xc.Problem(
            mesh, STEEL, [xc.line_crack(c) for c in cracks], loads=loads, order=order
        )
        solution = xc.solve(problem)
        for c in range(len(cracks)):
            sif = xc.stress_intensity(solution, c)
            assert np.isfinite(sif.K).all(), f"seed {seed}"
            assert np.isfinite(sif.T).all(), f"seed {seed}"
    except (xc.GeometryError, xc.ProblemError) as refused:
        return len(str(refused)) < 40  # words, not a number alone
    except Exception as error:
        error.add_note(f"seed {seed}")
        raise
    # No displacement is out of proportion: a body of size 2 under stresses of 1, E = 1.
    assert np.abs(solution.u[: 2 * mesh.n_points]).max() < 1e3, f"seed {seed}"
    return True


def test_random_scenes_are_solved_or_refused_with_words():
    """Whatever is drawn: polylines that leave the body, cross, close in on each other."""
    solved = sum(solved_or_refused(seed) for seed in range(40100, 40120))
    print(f"\n{solved} of 20 random scenes solved, the others refused")
    assert solved >= 10


@pytest.mark.slow
def test_many_random_scenes_are_solved_or_refused_with_words():
    solved = sum(solved_or_refused(seed) for seed in range(52000, 52400))
    print(f"\n{solved} of 400 random scenes solved, the others refused")
    assert solved >= 200


# Shapes ----------------------------------------------------------------------------------------


def kinked(degrees, order, n, domain=None):
    """Edge crack with a last leg of 0.25, kinked."""
    ahead = scenes.rows(np.radians(degrees))[0]
    crack = xc.line_crack([(-1.1, -0.013), (0.02, -0.013), (0.02, -0.013) + 0.25 * ahead])
    numerics = xc.Numerics(domain=domain)
    mesh = scenes.perturbed(n, 9)
    return xc.Problem(
        mesh, STEEL, [crack], loads=PULL, order=order, contact="off", numerics=numerics
    )


@pytest.mark.parametrize(
    "degrees",
    [
        90,
        120,
        pytest.param(-120, marks=pytest.mark.slow),
        pytest.param(135, marks=pytest.mark.slow),
    ],
)
def test_sharp_kinks(degrees):
    """Order 2 on two meshes and four domains, two of which contain the kink."""
    coarse = scenes.K_of(kinked(degrees, 2, 30))[0]
    fine = np.array([scenes.K_of(kinked(degrees, 2, 60, d))[0] for d in (0.15, 0.22, 0.4, 0.6)])
    size = np.linalg.norm(fine[0])
    spread = np.ptp(fine, axis=0).max() / size
    print(f"\nkink {degrees}°: K {fine[0]}, domains {spread:.1e}, "
          f"coarse {np.abs(coarse - fine[0]).max() / size:.1e}")  # fmt: skip
    assert spread <= 2e-3
    # The kink's own weak singularity is not enriched, and the leg is four cells long.
    assert np.abs(coarse - fine[0]).max() <= 2e-2 * size


@pytest.mark.parametrize("degrees", [90, 120])
def test_sharp_kinks_at_order_1(degrees):
    wanted = scenes.K_of(kinked(degrees, 2, 60))[0]
    result = scenes.K_of(kinked(degrees, 1, 80))[0]
    assert result == pytest.approx(wanted, abs=1e-2 * np.linalg.norm(wanted))


def test_kink_of_90_degrees_inside_a_cell():
    """The last leg is half a cell: K tends to that of the long kink, nothing breaks."""
    n = 30
    result = []
    for leg in (0.03, 0.015, 0.0075):
        crack = xc.line_crack([(-1.1, -0.013), (0.02, -0.013), (0.02, -0.013 + leg)])
        problem = xc.Problem(scenes.perturbed(n, 9), STEEL, [crack], loads=PULL)
        result.append(scenes.K_of(problem)[0])
    assert np.isfinite(result).all()
    assert np.ptp(result, axis=0).max() <= 0.3 * np.linalg.norm(result[0])


@pytest.mark.parametrize("degrees", [120, 150])
def test_arcs_of_240_and_300_degrees(degrees):
    """The prolongations of the tips meet or leave: K of all domains agrees with the exact one."""
    alpha = np.radians(degrees)
    arc = exact.ArcCrack(1.0, alpha, 1.0, 0.3, 1.0, 1.0, 0.0)
    theta = alpha * np.sin(np.pi / 2 * np.linspace(-1, 1, 301))
    crack = xc.line_crack(np.stack([np.cos(theta), np.sin(theta)], axis=1))
    field = scenes.turned(arc.field, (0.0, 0.0))
    mesh = scenes.perturbed(50, lower=(-1.6, -1.5), upper=(1.9, 1.5))
    wanted = np.array([arc.K_lower, arc.K_upper]) * [[1, -1], [1, 1]]
    for domain in (0.3, 0.6):
        problem = xc.Problem(
            mesh, STEEL, [crack], supports=scenes.imposed(field, SIDES), contact="off",
            numerics=xc.Numerics(radius=0.2, domain=domain),
        )  # fmt: skip
        error = np.abs(scenes.K_of(problem) - wanted).max() / np.abs(wanted).max()
        print(f"\narc of {2 * degrees}°, domain {domain}: K {error:.1e}")
        assert error <= 1e-2


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("cells", [2.0, 1.5])
def test_half_circle_of_two_cells(order, cells):
    """An arc whose radius is hardly more than a cell: solved, symmetric to the mesh's accuracy."""
    n = 30
    theta = np.linspace(np.pi, 0, 21)
    points = cells * 2 / n * np.stack([np.cos(theta), np.sin(theta)], axis=1) + [0.013, 0.027]
    problem = xc.Problem(
        scenes.perturbed(n, 9), STEEL, [xc.line_crack(points)], loads=PULL, order=order
    )
    K = scenes.K_of(problem)
    assert K[0] == pytest.approx(K[1], abs=0.1 * np.abs(K).max())


@pytest.mark.parametrize("order", [1, 2])
def test_tip_close_to_a_free_edge(order):
    """K grows as the ligament closes; within half a cell of the edge the crack is through."""
    n, K = 30, []
    h = 2 / n
    mesh = scenes.perturbed(n, 9)
    for cells in (3.0, 1.6, 1.0, 0.6):
        crack = xc.line_crack([(-0.3, 0.0213), (1 - cells * h, 0.0213)])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            problem = xc.Problem(mesh, STEEL, [crack], loads=PULL, order=order)
            K.append(xc.stress_intensity(xc.solve(problem)).K_I)
    far, near = np.array(K).T
    print(f"\nclosing ligament, order {order}: {near}")
    assert (np.diff(far) > 0).all()
    assert near[0] < near[1] < near[2]
    crack = xc.line_crack([(-0.3, 0.0213), (1 - 0.4 * h, 0.0213)])
    problem = xc.Problem(mesh, STEEL, [crack], loads=PULL, order=order)
    assert problem.placed[0].n_tips == 1
    assert scenes.K_of(problem).shape == (1, 2)


def test_a_domain_without_room_says_so():
    n = 30
    crack = xc.line_crack([(-0.3, 0.0213), (1 - 0.9 * 2 / n, 0.0213)])
    solution = xc.solve(xc.Problem(scenes.perturbed(n, 9), STEEL, [crack], loads=PULL))
    with pytest.warns(xc.XcrackWarning, match=r"K at \[0.94, 0.0213\]: the domain is clipped to"):
        xc.stress_intensity(solution)


@pytest.mark.parametrize("order", [1, 2])
def test_two_cracks_three_cells_apart(order):
    """Parallel and tip to tip: the two feel each other alike (the scene is symmetric)."""
    n = {1: 60, 2: 30}[order]
    h = 2 / n
    mesh = scenes.perturbed(n, 9)
    d = 3 * h
    pairs = [
        ([(-1.1, -d / 2), (0.1, -d / 2)], [(-0.1, d / 2), (1.1, d / 2)]),
        ([(-1.1, 0.0), (-d / 2, 0.0)], [(d / 2, 0.0), (1.1, 0.0)]),
    ]
    for pair in pairs:
        problem = xc.Problem(mesh, STEEL, [xc.line_crack(p) for p in pair], loads=PULL, order=order)
        solution = xc.solve(problem)
        K = np.array([xc.stress_intensity(solution, c).K[0] for c in (0, 1)])
        print(f"\ntwo cracks, order {order}: {K.tolist()}")
        assert K[0, 0] == pytest.approx(K[1, 0], rel=5e-2)


def test_tip_that_nearly_meets_another_crack():
    """From five cells to two from the crack face of another crack: K rises; below one, an error."""
    n = 30
    h = 2 / n
    mesh = scenes.perturbed(n, 9)
    K = []
    for cells in (5.0, 3.0, 2.0):
        cracks = [
            xc.line_crack([(-1.1, 0.01), (-cells * h, 0.01)]),
            xc.line_crack([(0.0, -0.5), (0.003, 0.5)]),
        ]
        K.append(scenes.K_of(xc.Problem(mesh, STEEL, cracks, loads=PULL))[0, 0])
    assert K[0] < K[1] < K[2]
    cracks[0] = xc.line_crack([(-1.1, 0.01), (-0.3 * h, 0.01)])
    with pytest.raises(
        xc.GeometryError, match=r"a tip of crack 0 .* does not end on it: .*give a point"
    ):
        xc.solve(xc.Problem(mesh, STEEL, cracks, loads=PULL))


@pytest.mark.gmsh
@pytest.mark.parametrize("order", [1, 2])
def test_crack_that_ends_on_a_hole(order):
    """From a hole at the left to one at the right: through both rims, no tip, no K."""
    mesh = xc.plate(
        4.0, 2.0, size=0.2, size_near=0.08, lower=(-2.0, -1.0),
        holes=[((-1.0, 0.0), 0.3), ((1.0, 0.0), 0.3)], along=[(-0.7, 0.0), (0.7, 0.0)],
    )  # fmt: skip
    crack = xc.line_crack([(-0.7, 0.0), (0.7, 0.0)])
    problem = xc.Problem(mesh, STEEL, [crack], loads=PULL, order=order)
    assert problem.placed[0].n_tips == 0
    solution = xc.solve(problem)
    assert xc.stress_intensity(solution).K.shape == (0, 2)
    assert (solution.opening() > 0).all()
    assert not solution.report["tip functions"].used
    # One end stops half way: its K is that of the crack from one hole.
    half = xc.line_crack([(-0.7, 0.0), (0.1, 0.013)])
    K = scenes.K_of(xc.Problem(mesh, STEEL, [half], loads=PULL, order=order))
    assert K.shape == (1, 2)
    assert K[0, 0] > 1.0


@pytest.mark.parametrize("order", [1, 2])
def test_crack_through_an_outer_corner(order):
    """Into a corner between mesh lines, on them, and 1e-10 beside: solved alike."""
    mesh = scenes.perturbed(24, 9)
    K = [
        scenes.K_of(
            xc.Problem(
                mesh,
                STEEL,
                [xc.line_crack([(-1.0, -1.0 + eps), (0.0, -0.2)])],
                loads=PULL,
                order=order,
            )
        )[0]
        for eps in (0.0, 1e-10, -1e-10, 1e-4)
    ]
    # Round-off for 1e-10, and a crack that has moved by 1e-4 at one end.
    assert np.ptp(K[:3], axis=0).max() <= 1e-6
    assert np.ptp(K, axis=0).max() <= 5e-3


def test_shapes_that_are_refused_or_harmless():
    mesh = scenes.perturbed(24, 9)
    h = 2 / 24

    def solve(*cracks, **options):
        lines = [xc.line_crack(c) for c in cracks]
        return xc.solve(xc.Problem(mesh, STEEL, lines, loads=PULL, **options))

    along = r"runs along the boundary: it ends at \[-0.5, .*half model.*model both halves"
    with pytest.raises(xc.GeometryError, match=along):
        solve([(-0.5, -1.0), (0.5, -1.0)])
    with pytest.raises(xc.GeometryError, match=along):
        solve([(-0.5, -1 + 0.3 * h), (0.5, -1 + 0.3 * h)])  # a sliver along the bottom
    with pytest.raises(xc.GeometryError, match=r"crack 0 from .* cuts no cell.*along the boundary"):
        solve([(-1.5, -1.0), (1.5, -1.0)])
    with pytest.raises(xc.ProblemError, match=r"cut the body into 2 pieces.*give it a support"):
        solve([(-1.5, -1 + 0.3 * h), (1.5, -1 + 0.3 * h)])
    with pytest.raises(xc.GeometryError, match=r"ends at .* inside the boundary.*half a cell"):
        solve([(-0.5, -1.3), (-0.45, -1 + 0.3 * h)])  # a nick
    with pytest.raises(xc.GeometryError, match=r"has length .* less than.*the cell there"):
        solve([(0.0, 0.1), (0.8 * h, 0.1)])
    # A zigzag and a spike finer than a cell: the mesh sees a straight crack, K is that of one.
    straight = solve([(-1.1, 0.01), (0.5, 0.01)])
    zigzag = solve([(-1.1, 0.01), (0.0, 0.01), (0.2 * h, 0.15 * h), (0.4 * h, 0.01), (0.5, 0.01)])
    K = [xc.stress_intensity(s).K[0] for s in (straight, zigzag)]
    assert K[1] == pytest.approx(K[0], abs=2e-2 * K[0][0])
    # Out of the body and in again: two tips, both found.
    bent = solve([(-0.8, 0.1), (1.5, 0.12), (1.5, 0.5), (-0.8, 0.5)])
    assert xc.stress_intensity(bent).K.shape == (2, 2)
