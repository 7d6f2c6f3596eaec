"""Pins, forces and moments on sets, temperature, fields of files, and what the report says."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import xcrack as xc
from xcrack import ProblemError

ROUND_OFF = 1e-9
SEED = 8314
STEEL = xc.Isotropic(E=2e5, nu=0.3, plane="strain")
SOLID = xc.Isotropic(E=2e5, nu=0.3)


def ring(n: int, inner: float = 2.0, outer: float = 6.0, seed: int | None = None) -> xc.Mesh:
    """Ring whose polygons have n corners, at uneven angles where a seed is given."""
    angle = 2 * np.pi * np.arange(n) / n
    if seed is not None:
        angle = angle + np.random.default_rng(seed).uniform(-0.3, 0.3, n) * 2 * np.pi / n
    radii = np.geomspace(inner, outer, 5)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = (radii[:, None, None] * unit).reshape(-1, 2) + np.array([3.0, -1.0])
    i = np.arange(n)
    j = (i + 1) % n
    cells = []
    for r in range(4):
        a, b, c, d = r * n + i, r * n + j, (r + 1) * n + i, (r + 1) * n + j
        cells += [np.stack([a, c, b], 1), np.stack([b, c, d], 1)]
    own = {"hole": np.stack([i, j], 1), "rim": 4 * n + np.stack([i, j], 1)}
    return xc.Mesh(points, np.concatenate(cells), own)


def tube(n: int, seed: int) -> xc.Mesh:
    """The ring as a body along a slanted axis, its points moved along the axis at random."""
    flat = ring(n, seed=seed)
    layers = 4
    rng = np.random.default_rng(seed)
    m = flat.n_points
    z = np.repeat(np.arange(layers + 1.0), m)
    inside = (z > 0) & (z < layers)
    z = z + np.where(inside, rng.uniform(-0.3, 0.3, len(z)), 0)
    points = np.column_stack([np.tile(flat.points, (layers + 1, 1)), z])
    low = np.concatenate([flat.cells + k * m for k in range(layers)])
    low = np.sort(low, axis=1)  # prisms divided by numbers: neighbours agree
    a, b, c = low.T
    cells = [[a, b, c, c + m], [a, b, b + m, c + m], [a, a + m, b + m, c + m]]
    cells = np.concatenate([np.stack(x, 1) for x in cells])
    bare = xc.Mesh(points, cells)
    facets = bare.boundary
    radius = np.linalg.norm(points[facets][..., :2] - [3.0, -1.0], axis=2)
    sets = {"hole": facets[(radius < 2.001).all(axis=1)], "rim": facets[(radius > 5.99).all(1)]}
    sets["end"] = facets[(points[facets][..., 2] == 4).all(axis=1)]
    axis = np.array([0.36, 0.48, 0.8])
    side = np.array([0.8, -0.6, 0.0])
    turn = np.stack([side, np.cross(axis, side), axis])
    return xc.Mesh(points @ turn, cells, sets)


def acting(problem: xc.Problem) -> dict[str, tuple]:
    rows = xc.solve(problem).report.resultants
    return {row.name: (np.array(row.force), np.array(row.moment)) for row in rows}


@pytest.mark.parametrize("angle", [np.pi, 2.0])
def test_a_pin_in_2d_has_its_resultant_on_an_uneven_polygon(angle: float) -> None:
    mesh = ring(41, seed=SEED)
    force = np.array([300.0, -720.0])
    load = xc.bearing("hole", force, contact_angle=angle)
    rows = acting(xc.Problem(mesh, STEEL, supports=[xc.fix("rim")], loads=[load]))
    f, moment = rows["bearing('hole')"]
    np.testing.assert_allclose(f, force, rtol=ROUND_OFF)
    # The lines of action pass through the centre: (3, -1) x force.
    assert moment == pytest.approx(3 * force[1] + force[0], rel=1e-3)  # fit of the centre
    np.testing.assert_allclose(rows["reaction of fix('rim')"][0], -force, rtol=ROUND_OFF)


def test_a_pin_in_3d_has_its_resultant_whatever_the_axis() -> None:
    mesh = tube(33, SEED)
    axis = np.array([0.36, 0.48, 0.8])
    force = 500 * np.cross(axis, [1.0, 0.2, 0.0])
    rows = acting(
        xc.Problem(mesh, SOLID, supports=[xc.fix("rim")], loads=[xc.bearing("hole", force)])
    )
    np.testing.assert_allclose(rows["bearing('hole')"][0], force, rtol=1e-6, atol=1e-6)
    # Conjugate gradients or not: the reaction balances it.
    np.testing.assert_allclose(rows["reaction of fix('rim')"][0], -force, rtol=1e-5, atol=1e-3)
    with pytest.raises(ProblemError, match="along the axis"):
        acting(xc.Problem(mesh, SOLID, supports=[xc.fix("rim")], loads=[xc.bearing("hole", axis)]))


def test_the_pressure_is_a_cosine() -> None:
    """A full cosine on a circle has the peak 2 F / (pi R); here as force on each side of 5°."""
    mesh = ring(72)
    centre = np.array([3.0, -1.0])
    angle = np.linspace(-np.pi, np.pi, 20_001)[:-1]
    x = centre + 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    weight = np.full(20_000, 4e-4 * np.pi / 2)
    points = SimpleNamespace(  # as docs/add_a_load.md has them
        mesh=mesh, facets=mesh.facet_sets["hole"], x=x, normal=x - centre, weight=weight
    )
    t = xc.bearing("hole", (10.0, 0.0), contact_angle=np.pi).traction(points)
    peak = 2 * 10 / (np.pi * 2.0)
    exact = np.where(np.abs(angle) < np.pi / 2, peak * np.cos(angle), 0)
    np.testing.assert_allclose(np.linalg.norm(t, axis=1), exact, atol=1e-6 * peak)


def test_a_pin_on_what_is_no_hole_says_so() -> None:
    mesh = ring(40)
    box = xc.box((0, 0), (1, 1), 3)
    half = mesh.facet_sets["hole"][mesh.points[mesh.facet_sets["hole"]][:, 0, 0] > 3.5]
    cut = xc.Mesh(mesh.points, mesh.cells, {"part": half, "hole": mesh.facet_sets["hole"]})
    ellipse = xc.Mesh(
        mesh.points * [1.3, 1], mesh.cells, dict(mesh.facet_sets) | {"boundary": mesh.boundary}
    )
    for body, name, says in [
        (box, "left", "straight"),
        (box, "boundary", "not a round hole"),
        (mesh, "rim", "no hole: the body lies inside"),
        (ellipse, "hole", "off the best circle"),
        (mesh, "none", "has no facet set 'none'"),
    ]:
        with pytest.raises(ProblemError, match=says):
            xc.Problem(body, STEEL, loads=[xc.bearing(name, (1.0, 0.0))])
    with pytest.raises(ProblemError, match=r"covers .* of where the pin presses"):
        xc.solve(
            xc.Problem(cut, STEEL, supports=[xc.fix("hole")], loads=[xc.bearing("part", (0, 1.0))])
        )
    with pytest.raises(ProblemError, match="does not suit a body in 2 dimensions: give 2 numbers"):
        xc.Problem(mesh, STEEL, loads=[xc.bearing("hole", (1.0, 0, 0))])
    for call, says in [
        (lambda: xc.bearing("hole", (0.0, 0.0)), "zero"),
        (lambda: xc.bearing("hole", (1.0, 0.0), contact_angle=180.0), "contact_angle"),
        (lambda: xc.bearing(3, (1.0, 0.0)), "name of a facet set"),
        (lambda: xc.resultant("end"), "a force, a moment or both"),
        (lambda: xc.resultant("end", (1.0, 0.0), (0.0, 0.0, 1.0)), "must all be of 2D"),
    ]:
        with pytest.raises(ProblemError, match=says):
            call()
    with pytest.raises(ProblemError, match="plane"):
        xc.Problem(tube(20, 5), SOLID, loads=[xc.bearing("end", (1.0, 0, 0))])


@pytest.mark.parametrize("d", [2, 3])
def test_force_and_moment_are_those_asked_for(d: int) -> None:
    rng = np.random.default_rng(SEED)
    mesh = xc.box((0,) * d, (3, 1, 2)[:d], (6, 2, 3)[:d])
    force, about = rng.normal(size=d), rng.normal(size=d)
    moment = rng.normal(size=1 if d < 3 else 3)
    material = STEEL if d < 3 else SOLID
    for point in (None, about):
        load = xc.resultant("right", force, moment, about=point)
        rows = acting(xc.Problem(mesh, material, supports=[xc.fix("left")], loads=[load]))
        f, m = rows["resultant('right')"]
        centre = np.array([3, 0.5, 1.0])[:d] if point is None else point
        np.testing.assert_allclose(f, force, rtol=ROUND_OFF)
        wanted = (
            moment
            + np.atleast_1d(np.cross(np.r_[centre, [0] * (3 - d)], np.r_[force, [0] * (3 - d)]))[
                -len(moment) :
            ]
        )
        np.testing.assert_allclose(np.atleast_1d(m), wanted, rtol=1e-8)
        reaction = rows["reaction of fix('left')"]
        np.testing.assert_allclose(reaction[0], -f, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(reaction[1], -m, rtol=1e-6, atol=1e-6)


def test_a_moment_on_an_end_bends_a_bar_exactly() -> None:
    mesh = xc.box((0, -0.5), (4, 0.5), (8, 2))
    stress = xc.Isotropic(E=100.0, nu=0.3, plane="stress")
    loads = [xc.resultant("right", moment=2.0), xc.resultant("left", moment=-2.0)]
    solution = xc.solve(xc.Problem(mesh, stress, loads=loads, order=2))
    x = np.random.default_rng(SEED).uniform((0, -0.5), (4, 0.5), (50, 2))
    sigma = solution.stress(x)
    np.testing.assert_allclose(sigma[:, 0, 0], -2.0 * x[:, 1] * 12, atol=1e-8)  # order 2 is exact
    np.testing.assert_allclose(sigma[:, 1], 0, atol=1e-8)


def test_reactions_of_corners_belong_to_one_support_and_states_scale_loads() -> None:
    mesh = xc.box((0, 0), (1, 1), 4)
    supports = [xc.fix("bottom", axis=1), xc.fix("left", axis=0)]
    problem = xc.Problem(mesh, STEEL, supports=supports, loads=[xc.traction("top", (0.5, 2.0))])
    for factor, solution in zip((1.0, -3.0), xc.solve(problem, states=[1.0, -3.0]), strict=True):
        rows = {row.name: row.force for row in solution.report.resultants}
        np.testing.assert_allclose(rows["traction('top')"], (0.5 * factor, 2.0 * factor))
        np.testing.assert_allclose(
            rows["reaction of fix('bottom', axis=1)"], (0, -2 * factor), atol=1e-9
        )
        np.testing.assert_allclose(
            rows["reaction of fix('left', axis=0)"], (-0.5 * factor, 0), atol=1e-9
        )
        assert "reaction of fix('left', axis=0)" in str(solution.report)


@pytest.mark.parametrize("plane", ["strain", "stress", None])
def test_a_free_body_expands_without_stress(plane: str | None) -> None:
    d = 3 if plane is None else 2
    mesh = xc.box((0,) * d, (1,) * d, 2)
    body = xc.Isotropic(E=2e5, nu=0.3, plane=plane)
    solution = xc.solve(xc.Problem(mesh, body, loads=[xc.temperature(50.0, 1.2e-5)]))
    x = np.full((1, d), 0.9)
    y = np.full((1, d), 0.1)
    strain = (solution.displacement(x) - solution.displacement(y)) / 0.8
    factor = 1.3 if plane == "strain" else 1.0
    np.testing.assert_allclose(strain, factor * 50 * 1.2e-5, rtol=1e-8)
    np.testing.assert_allclose(solution.stress(x), 0, atol=1e-6)


def test_K_of_a_supported_strip_with_a_linear_gradient() -> None:
    """Superposition: the stress -E alpha dT of the strip without a crack, as pressure on it."""
    body = xc.Isotropic(E=2e5, nu=0.3, plane="stress")
    mesh = xc.box((0, 0), (1, 3), (20, 60))
    alpha = 1.2e-5

    def warm(x: np.ndarray) -> np.ndarray:
        return -40.0 + 60.0 * x[:, 0]

    supported = [xc.fix("bottom", axis=1), xc.fix("top", axis=1), xc.fix((0.0, 0.0), axis=0)]
    crack = xc.line_crack([(-0.1, 1.513), (0.4, 1.513)])
    K = []
    for load in (
        xc.temperature(warm, alpha),
        xc.crack_pressure(lambda x: -body.E * alpha * warm(x)),
    ):
        problem = xc.Problem(mesh, body, cracks=[crack], supports=supported, loads=[load])
        sif = xc.stress_intensity(xc.solve(problem))
        K.append((sif.K_I[0], sif.K_II[0], sif.T[0]))
    # Another load vector and other terms of the integral: discretisation of both.
    assert K[0][0] == pytest.approx(K[1][0], rel=2e-3)
    assert abs(K[0][1] - K[1][1]) < 2e-3 * K[0][0]
    assert K[0][0] > 50


def test_temperature_and_stress_of_a_state() -> None:
    mesh = xc.box((0, 0), (1, 1), 4)
    warm = xc.temperature(lambda x: x[:, 0] * 0 + 10.0, 1e-5)
    supported = [xc.fix("boundary")]
    problem = xc.Problem(mesh, STEEL, supports=supported, loads=[warm])
    exact = -2e5 / 0.4 * 1e-4 * np.eye(2)
    for state in (None, 0.5, [warm], [xc.temperature(10.0, 0.0)], []):
        solution = xc.solve(problem, states=[state])[0]
        np.testing.assert_allclose(solution.stress(np.array([[0.3, 0.4]]))[0], exact, atol=1e-9)
    with pytest.raises(ProblemError, match="temperature"):
        xc.solve(
            xc.Problem(mesh, STEEL, supports=supported, loads=[xc.temperature(lambda x: x, 1.0)])
        )


def test_the_part_of_a_stress_out_of_balance() -> None:
    """None of a stress of Airy's with free sides; all of a uniform one."""
    mesh = xc.box((0, 0), (1, 1), 12)

    def airy(x: np.ndarray) -> np.ndarray:
        def g(t: np.ndarray) -> tuple[np.ndarray, ...]:
            s = t * (1 - t)
            return s**2, 2 * s * (1 - 2 * t), 2 * (1 - 2 * t) ** 2 - 4 * s

        (a, a1, a2), (b, b1, b2) = g(x[:, 0]), g(x[:, 1])
        return np.moveaxis(np.array([[a * b2, -a1 * b1], [-a1 * b1, a2 * b]]), -1, 0)

    reasons = [
        xc.solve(xc.Problem(mesh, STEEL, loads=[xc.initial_stress(s)]))
        .report["initial stress"]
        .reason
        for s in (airy, np.diag([1.0, 2.0]))
    ]
    share = [float(r.split("%")[0]) for r in reasons]
    assert share[0] < 0.01  # discretisation
    assert share[1] == pytest.approx(100, abs=0.1)


def strip(loads, mesh=None, crack=((-0.1, 0.013), (0.3, 0.013))) -> xc.Problem:
    mesh = xc.box((0, -1), (1, 2), (8, 24)) if mesh is None else mesh
    support = [xc.fix("bottom")] if "bottom" in mesh.facet_sets else [xc.fix("rim")]
    return xc.Problem(mesh, STEEL, [xc.line_crack(crack)], supports=support, loads=loads)


def same_bars(first: xc.Problem, second: xc.Problem, rtol: float) -> None:
    a, b = (xc.stress_intensity(xc.solve(each, error=True), 0) for each in (first, second))
    np.testing.assert_allclose(a.K[:, :2], b.K[:, :2], rtol=rtol)
    np.testing.assert_allclose(a.eta, b.eta, rtol=rtol, atol=rtol * np.abs(a.K).max())
    np.testing.assert_allclose(a.bar, b.bar, rtol=rtol, atol=rtol * np.abs(a.K).max())


def test_bars_of_K_know_resultants() -> None:
    """Force and moment on a side are a linear traction there: K and bars are those of it."""
    inertia = 1 / 12

    def traction(x: np.ndarray) -> np.ndarray:
        stress = 3.0 - 0.4 / inertia * (x[:, 0] - 0.5)
        return np.column_stack([np.full(len(x), 0.7), stress])

    given = xc.resultant("top", force=(0.7, 3.0), moment=-0.4)
    same_bars(strip([given]), strip([xc.traction("top", traction)]), rtol=1e-8)  # round-off


def test_bars_of_K_know_bearings() -> None:
    """A pin is a cosine pressure: its discrete scale is that of the polygon, 2e-3 away."""
    mesh = xc.refine(ring(48))
    crack = ((4.9, -0.97), (6.4, -0.97))
    force = np.array([0.0, 60.0])

    def traction(x: np.ndarray) -> np.ndarray:
        radial = x - [3.0, -1.0]
        radial /= np.linalg.norm(radial, axis=1)[:, None]
        return np.maximum(radial[:, 1:], 0) * radial * (60.0 / (np.pi * 2.0 / 2))

    pin = strip([xc.bearing("hole", force, contact_angle=np.pi)], mesh, crack)
    same_bars(pin, strip([xc.traction("hole", traction)], mesh, crack), rtol=5e-3)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("kind", ["resultant", "bearing"])
@pytest.mark.parametrize("factors", [(0.0, 1.0, 0.4, 0.9), (-0.5, 1.0)])
def test_a_spectrum_scales_resultants_and_pins_beside_steady_loads(kind, factors) -> None:
    """Each level is the factor times K of the load and K of the steady one (no contact)."""
    mesh, crack = (ring(48), ((4.9, -0.97), (6.4, -0.97)))
    if kind == "bearing":
        load, steady = xc.bearing("hole", (0.0, 60.0)), xc.traction("hole", (3.0, 9.0))
    else:
        mesh, crack = None, ((-0.1, 0.013), (0.3, 0.013))
        load, steady = xc.resultant("top", (0.5, 3.0), 0.2), xc.body_force((0.1, 0.4))
    for one, other in ((load, steady), (steady, load)):
        problem = replace(strip([one], mesh, crack), contact="off")
        spectrum = xc.Spectrum(factors, steady=[other], levels=3)
        options = {"da": 0.1, "progress": False}
        step = next(xc.grow(problem, xc.paris(1e-9, 3.0), xc.max_hoop_stress, spectrum, **options))
        K_one = xc.stress_intensity(xc.solve(problem), 0).K
        K_other = xc.stress_intensity(xc.solve(replace(problem, loads=[other])), 0).K
        for factor, state in zip(step.levels, step.sif, strict=True):
            scale = np.abs(K_one).max() + np.abs(K_other).max()
            np.testing.assert_allclose(state[0].K, factor * K_one + K_other, atol=1e-9 * scale)
