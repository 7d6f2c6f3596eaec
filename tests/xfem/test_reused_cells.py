"""Cut cells are integrated once, as long as their cut stays."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from support import scenes_3d as scenes_space
from xcrack.fem.assembly import reused_cells, with_one_jump
from xcrack.fem.system import build

STEEL = xc.Isotropic(1.0, 0.3, "strain")
BODY = xc.Problem(xc.box((0, 0), (1, 1), 1), STEEL).elasticity  # the same everywhere
ROOT = [(-1.2, 0.013), (-0.5, 0.03)]


def plane(tip, order, more=()):
    cracks = [xc.line_crack([*ROOT, tip]), *more]
    return xc.Problem(scenes.perturbed(20, 31), STEEL, cracks, order=order)


def space(front, _):
    mesh = scenes_space.perturbed(8, 32)
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3), [scenes_space.half_sheet(front, 0.03)], order=1)


@pytest.mark.parametrize(
    ("scene", "first", "second", "order"),
    [
        (plane, (0.1, 0.05), (0.25, 0.12), 1),
        (plane, (0.1, 0.05), (0.25, 0.12), 2),
        (space, 0.2, 0.45, 1),
    ],
    ids=["plane, order 1", "plane, order 2", "space"],
)
def test_only_what_changed_is_integrated(scene, first, second, order):
    """The stiffness is the same to the last bit, with fewer points."""
    before = scene(first, order)
    after = replace(scene(second, order), mesh=before.mesh)
    retained = build(after, build(before).bulk)
    fresh = build(after)
    assert (retained.stiffness != fresh.stiffness).nnz == 0
    assert retained.n_points < fresh.n_points
    simple = fresh.space.enriched_cells[with_one_jump(fresh.space, fresh.space.enriched_cells)]
    _, again = reused_cells(fresh.space, BODY, simple, retained.bulk.cells)
    assert again == 0
    _, changed = reused_cells(fresh.space, BODY, simple, build(before).bulk.cells)
    _, every = reused_cells(fresh.space, BODY, simple, None)
    assert 0 < changed < every
    assert fresh.n_points - retained.n_points == every - changed


@pytest.mark.parametrize("order", [1, 2])
def test_a_node_that_lost_its_function(order):
    """Cells around it are integrated anew, all others taken over."""
    space_ = build(plane((0.1, 0.05), order)).space
    cells = space_.enriched_cells[with_one_jump(space_, space_.enriched_cells)]
    known, _ = reused_cells(space_, BODY, cells, None)
    nodes = space_.cell_nodes[cells]
    lost = np.array(space_.heaviside[0])
    lost[nodes[lost[nodes] >= 0][0]] = -1
    changed = replace(space_, heaviside=(lost,))
    cells = changed.enriched_cells[with_one_jump(changed, changed.enriched_cells)]
    result, used = reused_cells(changed, BODY, cells, known)
    fresh, every = reused_cells(changed, BODY, cells, None)
    np.testing.assert_array_equal(result.products, fresh.products)
    assert 0 < used < every


def test_functions_jump_in_a_crossed_cell_only_where_it_is_cut():
    """What the key of a cell leaves out."""
    for problem in (plane((0.1, 0.05), 2), plane((0.31, -0.22), 1), space(0.2, 1)):
        space_ = build(problem).space
        cells = space_.enriched_cells[with_one_jump(space_, space_.enriched_cells)]
        cut = space_.cuts[0]
        np.testing.assert_array_equal(cut.is_cut[cells], cut.side[cells] == 0)


def test_another_crack_in_the_same_cells_is_integrated_anew():
    """Shifted by a millionth of a cell, mirrored, or numbered as another crack."""
    known = build(plane((0.1, 0.05), 2)).bulk.cells
    assert len(known.cells)
    shifted = xc.line_crack([(x, y + 1e-7) for x, y in (*ROOT, (0.1, 0.05))])
    turned = xc.line_crack([*ROOT, (0.1, 0.05)][::-1])
    other = xc.line_crack([(-1.2, -0.6), (-0.4, -0.61)])
    scene = plane((0.1, 0.05), 2)
    for cracks in ([shifted], [turned], [other, xc.line_crack([*ROOT, (0.1, 0.05)])]):
        changed = build(replace(scene, cracks=cracks))
        cells = changed.space.enriched_cells[
            with_one_jump(changed.space, changed.space.enriched_cells)
        ]
        _, used = reused_cells(changed.space, BODY, cells, known)
        _, every = reused_cells(changed.space, BODY, cells, None)
        assert used == every


def test_a_crack_that_stands_still_beside_one_that_grows():
    """All of its simple cells are taken over."""
    other = xc.line_crack([(1.2, -0.55), (0.2, -0.52)])
    before = build(plane((0.1, 0.05), 2, [other]))
    after = build(replace(plane((0.3, 0.1), 2, [other]), mesh=before.space.mesh), before.bulk)
    same = np.isin(after.bulk.cells.cells, before.bulk.cells.cells)
    second = after.bulk.cells.key[:, 0] == 1
    assert second.any()
    assert same[second].all()


def test_cells_with_tip_functions_or_two_cracks_are_not_reused():
    other = xc.line_crack([(1.2, -0.15), (0.0, -0.12)])
    problem = plane((0.1, 0.05), 2, [other])
    space_ = build(problem).space
    simple = with_one_jump(space_, space_.enriched_cells)
    assert not space_.has_tip[space_.enriched_cells[simple]].any()
    one = np.isin(space_.signature[space_.enriched_cells], [1, 2])
    np.testing.assert_array_equal(simple, one)
