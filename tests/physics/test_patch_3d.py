"""Contact patch tests in 3D: a uniform pressure comes out exactly, wherever the crack runs.

The exact displacements are in the space, so every tolerance here is one of round-off: it is free
of mesh size, cut position and place of the front.
"""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import scenes_3d as scenes
from support.rows import slow
from support.scenes_2d import numerics_of
from support.scenes_3d import SIX

P0 = 2.5
EXACT = 1e-10  # round-off; measured 1e-15 to 1e-12
CELL = 1 / 3  # rows of nodes at z = 0, ±1/3, ... in [-1, 1]³ with 6 cells a side
CUTS = (0.5, 0.1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-14, 0.0)
CUTS_BELOW = (-1e-14, -1e-12, -1e-10, -1e-8, -1e-4, -0.1)
TURNED = [(1, 1, 0), (1, 1, 1), (1, 2, 3)]
TURNED_TOO = [((1, 0, 0),), ((0, 1, 0),), ((0, 1, -1),), ((1, -2, 0),)]


def structured(n=6):
    return xc.box((-1, -1, -1), (1, 1, 1), n)


def patch(mesh, cracks, supported=(), *, E=1.0, nu=0.3, gap=1e-9, **options):
    """Largest error of the pressure; held sides get the exact displacements, others the load."""
    stretch = -P0 * (1 - 2 * nu) / E
    # Conjugate gradients would stop at 1e-8 of the load: what is tested here is round-off.
    numerics = replace(options.pop("numerics", xc.Numerics()), linear="direct")
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E, nu),
        cracks,
        supports=[xc.displacement(name, lambda x: stretch * x) for name in supported],
        loads=[xc.pressure(name, P0) for name in SIX if name not in supported],
        contact="on",
        numerics=numerics,
        **{"order": 1} | options,
    )
    solution = xc.solve(problem)
    assert len(solution.contact) == len(cracks)
    worst = 0.0
    for contact in solution.contact:
        assert len(contact.pressure)
        assert contact.closed.all()
        assert np.abs(contact.gap).max() <= gap * P0 / E
        worst = max(worst, float(np.abs(contact.pressure / P0 - 1).max()))
    return worst


def drawn_penny(seed):
    rng = np.random.default_rng(seed)
    return xc.penny_crack(
        rng.uniform(-0.15, 0.15, 3), rng.standard_normal(3), rng.uniform(0.35, 0.6)
    )


@pytest.mark.parametrize(
    "supported", [(), *slow((("bottom", "left"),)), SIX], ids=["free", "two sides", "all"]
)
def test_pennies_anywhere(supported):
    for seed in range(710, 713):
        result = patch(scenes.perturbed(5 + seed % 3, seed), [drawn_penny(seed)], supported)
        assert result <= EXACT, seed


@pytest.mark.slow
@pytest.mark.mission
def test_many_pennies_anywhere():
    worst = 0.0
    for seed in range(3100, 3160):
        mesh = scenes.perturbed(5 + seed % 5, seed, amplitude=0.2 * (seed % 2))
        result = patch(mesh, [drawn_penny(seed)])
        worst = max(worst, result)
        assert result <= EXACT, seed
    print(f"\n60 pennies anywhere: pressure to {worst:.1e}")


@pytest.mark.slow
@pytest.mark.mission
def test_any_cut_position():
    """From half a cell above the layer of nodes down to 1e-14, on it, and below."""
    for k, eps in enumerate(CUTS[::2] + CUTS[-1:] + CUTS_BELOW[::2]):
        # The circle meets the mesh anywhere, passes through nodes, ends a hair beside them.
        radius = (0.55, 2 / 3, 2 / 3 + 1e-9)[k % 3]
        crack = xc.penny_crack((0, 0, eps * CELL), (0, 0, 1), radius)
        assert patch(structured(), [crack]) <= EXACT, eps


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("radius", [0.47, 0.55, 2 / 3, 2 / 3 + 1e-9, 0.4714045207910317])
def test_any_cut_position_and_any_radius(radius):
    for eps in CUTS + CUTS_BELOW:
        crack = xc.penny_crack((0, 0, eps * CELL), (0, 0, 1), radius)
        assert patch(structured(), [crack]) <= EXACT, eps


@pytest.mark.parametrize("normal", [*TURNED, *slow(*TURNED_TOO)], ids=str)
def test_along_faces_of_the_mesh_and_through_its_nodes(normal):
    """Planes that hold faces of tetrahedra, or cut them through their corners; next to those."""
    across = scenes.unit(normal) * CELL
    for eps, radius in ((0.0, 0.55), (1e-12, 0.7), (-1e-6, 0.6)):
        crack = xc.penny_crack(eps * across, normal, radius)
        assert patch(structured(), [crack]) <= EXACT, eps


# Straight fronts on lines of nodes, on the lines between, and 1e-12 of a cell beside.
FRONTS = (0.0, CELL, CELL / 2, 0.07, 1e-12, CELL - 1e-10)


@pytest.mark.parametrize("z", [*slow(0.0), 0.1, *slow(1e-9 * CELL)], ids=str)
def test_front_from_side_to_side(z):
    """The front ends at the surface of the body, the crack runs out through three sides."""
    for x in FRONTS:
        assert patch(structured(), [scenes.half_sheet(x, z)], ("bottom", "top")) <= EXACT, x


def test_slanting_front_from_side_to_side():
    for seed, slope in enumerate((0.13, 0.5), 41):
        crack = scenes.half_sheet(0.04, 0.11, slope)
        assert patch(scenes.perturbed(6, seed), [crack]) <= EXACT, slope
        crack = scenes.half_sheet(0.0, 0.0, slope)
        assert patch(structured(), [crack]) <= EXACT, slope


@pytest.mark.parametrize("half", [*slow(0.5), 2 * CELL, *slow(0.61)], ids=str)
def test_squares_along_lines_of_the_mesh(half):
    for z in (0.0, 0.1, 1e-10):
        assert patch(structured(), [scenes.square_crack(half, z)]) <= EXACT, z


def test_crack_through_the_whole_body():
    """No front, no tip functions: the two halves are held by what is imposed on them."""
    cuts = [((0, 0, 1), z) for z in (0.0, 1e-12, 1e-6 * CELL, 0.1, CELL / 2)]
    cuts += [((0.3, -0.2, 1), 0.05), ((-0.1, 0.45, 1), -0.2), ((0, 1, 2), 0.0)]
    for normal, offset in cuts:
        crack = scenes.sheet(normal, offset)
        for mesh in (structured(), scenes.perturbed(5, 61)):
            assert patch(mesh, [crack], ("bottom", "top")) <= EXACT, (normal, offset)


@pytest.mark.slow
@pytest.mark.mission
def test_several_cracks():
    """Two pennies and a sheet with a front; then two parallel pennies in a structured mesh."""
    pennies = [
        xc.penny_crack((0.05, 0.02, 0.45), (0.1, 0.2, 1), 0.5),
        xc.penny_crack((0.02, -0.05, -0.5), (-0.1, 0.2, 1), 0.45),
    ]
    for seed, n in ((81, 6), (82, 8)):
        assert patch(scenes.perturbed(n, seed), pennies) <= EXACT, n
    pair = [xc.penny_crack((0, 0, z), (0, 0, 1), 0.55) for z in (-CELL, 2 * CELL)]
    assert patch(structured(), pair) <= EXACT
    mixed = [scenes.half_sheet(0.1, -0.5), pennies[0]]
    assert patch(structured(), mixed) <= EXACT


@pytest.mark.parametrize(
    "numerics",
    [
        {"enrichment": "topological"},
        {"functions": 2},
        {"radius": 0.7},
        {"orthonormal": "node"},
        *slow({"patch": True}),
        {"points": 2},
        {"points": 6},
        {"initial_set": "open"},
    ],
    ids=str,
)
def test_no_option_of_method_spoils_it(numerics):
    mesh, crack = scenes.perturbed(6, 77), drawn_penny(711)
    assert patch(mesh, [crack], numerics=numerics_of(**numerics)) <= EXACT


@pytest.mark.slow
def test_material_and_units_have_no_part_in_it():
    mesh, crack = scenes.perturbed(6, 78), drawn_penny(713)
    for E, nu in ((1e9, 0.0), (210e3, 0.3), (1.0, 0.49)):
        assert patch(mesh, [crack], ("bottom",), E=E, nu=nu) <= EXACT
    big = xc.Mesh(1e3 * mesh.points, mesh.cells, mesh.facet_sets)
    crack = xc.penny_crack((11.0, 24.0, -35.0), (1, 2, 3), 550.0)
    assert patch(big, [crack], E=210e3) <= EXACT


def test_without_the_consistent_correction_it_fails():
    """Ordinary quadrature leaves an error that any number of points only slowly removes."""
    plain = xc.Numerics(consistent=False)
    result = patch(scenes.perturbed(6, 77), [drawn_penny(711)], gap=0.1, numerics=plain)
    print(f"\nwithout correction: {result:.1e}")
    assert 1e-6 < result < 0.5
