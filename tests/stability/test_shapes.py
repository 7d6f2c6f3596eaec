"""Shapes at which methods break: arcs hardly wider than a cell, cracks that turn round, free edges.

Exact solutions of arcs (Muskhelishvili), else a finer mesh; all tolerances are of discretisation.
`tests/physics/test_degenerate_2d.py` has kinks, mesh lines, corners and what is refused.
"""

import pytest

import xcrack as xc
from support import scenes_stability as scenes
from support.scenes_2d import numerics_of
from xcrack.verification import methods

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
CELL = 2.4 / 30
MISSION = (pytest.mark.slow, pytest.mark.mission)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(
    ("cells", "degrees"),
    [(2.0, 90), *(pytest.param(c, d, marks=MISSION) for c in (1.5, 3.0, 5.0) for d in (90, 180))],
)
def test_arc_of_a_few_cells(cells, degrees, order):
    """The whole crack is three cells long: a few per cent of K, whatever the arc."""
    error = scenes.arc_error(cells * CELL, degrees, 30, order=order)
    print(f"\narc of radius {cells} h, {degrees}°, order {order}: K {error:.1e}")
    assert error <= 0.08


@pytest.mark.parametrize("degrees", [200, pytest.param(300, marks=MISSION)])
def test_a_crack_that_has_turned_back(degrees):
    """Every face of it is there, and K is that of the arc."""
    numerics = xc.Numerics(radius=0.15, domain=0.25)
    length = scenes.arc_length(0.6, degrees, 40, pieces=48, numerics=numerics)
    error = scenes.arc_error(0.6, degrees, 40, pieces=48, numerics=numerics)
    print(f"\nturned by {degrees}°: length {length:.4f}, K {error:.1e}")
    assert length == pytest.approx(1.0, abs=3e-3)
    assert error <= 2e-2


def test_nodal_level_sets_lose_it():
    """The alternative: as good up to 150°, without the beginning of the crack from 180° on."""
    numerics = numerics_of(radius=0.15, domain=0.25, level_sets=methods.nodal_level_sets())
    assert scenes.arc_error(0.6, 90, 40, pieces=48, numerics=numerics) <= 2e-3
    assert scenes.arc_length(0.6, 240, 40, pieces=48, numerics=numerics) <= 0.9


@pytest.mark.parametrize(
    ("cells", "wanted"), [(1.6, 5e-3), pytest.param(3.0, 5e-3, marks=MISSION), (1.0, 0.1)]
)
def test_tip_beside_a_free_edge(cells, wanted):
    """Against a mesh twice as fine; within one cell of the edge there is no room for K."""
    h = 2 / 30
    coarse, fine = (scenes.beside_an_edge(cells, n, h) for n in (30, 60))
    print(f"\n{cells} h from a free edge: {coarse:.4f}, fine {fine:.4f}")
    assert coarse == pytest.approx(fine, rel=wanted)
