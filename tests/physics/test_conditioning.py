"""The condition number of the solver's basis: that of plain elements, whatever the cut.

`order2.md` of the plan has the measurements these limits come from. Limits of growth and
flatness belong to the method; equal K with and without a basis is round-off times condition.
"""

from functools import cache

import numpy as np
import pytest

import xcrack as xc
from support import exact
from support import scenes_2d as scenes
from support.matrices import matrix_of

EPS = (0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0)


@cache
def by_size(n, order, kind, patch, radius=0.3, n_tips=4):
    """Largest condition number over the tips."""
    worst = 0.0
    for seed, (tip, angle) in enumerate(scenes.TIPS[:n_tips], start=3):
        problem, _ = scenes.williams_edge(
            n, tip, angle, seed=seed, order=order,
            numerics=xc.Numerics(radius=radius, orthonormal=kind, patch=patch),
        )  # fmt: skip
        worst = max(worst, scenes.condition(problem))
    print(f"\ncondition order {order} n {n} {kind} patch {patch}: {worst:.3g}")
    return worst


def beside_a_row(eps, order, kind="star", patch=False, radius=0.15, n=20):
    """Williams' field on a crack eps cells above a row of nodes of a regular mesh."""
    y = eps * 2 / n
    field = scenes.turned(lambda x, y: exact.williams(x, y, 1.0, 0.3, 1.0, 0.6), (0.037, y))
    return scenes.on_box(
        xc.box((-1, -1), (1, 1), n),
        [xc.line_crack([(-1.2, y), (0.037, y)])],
        field,
        traction=("left",),
        order=order,
        contact="off",
        numerics=xc.Numerics(radius=radius, orthonormal=kind, patch=patch),
    )


def condition_beside_a_row(*args, **options):
    return [scenes.condition(beside_a_row(eps, *args, **options)) for eps in EPS]


def flatness(values):
    return max(values) / min(values) - 1


def test_order_1_node_blocks_grow_like_plain_elements():
    sizes = (10, 20, 40)
    result = [by_size(n, 1, "node", False) for n in sizes]
    assert scenes.rate(result, sizes) <= 2.1
    assert max(c / n**2 for c, n in zip(result, sizes, strict=True)) <= 2.5
    # Scaling by the diagonal alone is a thousand times worse already.
    assert by_size(40, 1, "none", False, n_tips=1) > 1e3 * result[2]


MISSION = (pytest.mark.slow, pytest.mark.mission)


@pytest.mark.parametrize(
    "n", [20, pytest.param(40, marks=MISSION), pytest.param(80, marks=MISSION)]
)
def test_order_2_star_and_patch_stay_below_15_n_squared(n):
    assert by_size(n, 2, "star", True) <= 15 * n**2


def test_order_2_star_and_patch_grow_like_plain_elements():
    sizes = (10, 20, 40)
    result = [by_size(n, 2, "star", True, n_tips=1) for n in sizes]
    # One tip each: its place in its cell makes the slope a little uneven (2.12 measured).
    assert scenes.rate(result, sizes) <= 2.3
    # Without the patch it is the size of the enriched disc that tells: a direct solver bears it.
    assert by_size(40, 2, "star", False, n_tips=1) > 1e3 * result[2]


@pytest.mark.slow
@pytest.mark.mission
def test_order_2_is_flat_over_cut_positions():
    """From a tenth of a cell to the row of nodes itself, and on it."""
    patch = condition_beside_a_row(2, "star", True)
    wide = condition_beside_a_row(2, "star", False, radius=0.3)
    narrow = condition_beside_a_row(2, "star", False)
    print(f"\nflat over cuts: star + patch {min(patch):.4g} ... {max(patch):.4g}, "
          f"star, disc 0.3 {min(wide):.4g} ... {max(wide):.4g}, "
          f"star, disc of two cells {min(narrow):.4g} ... {max(narrow):.4g}")  # fmt: skip
    assert flatness(patch) <= 0.05
    assert flatness(wide) <= 0.05
    # A disc of two cells feels the mesh under it: from .1 to .01 of a cell it changes by 7 %,
    # and below that by less than 2 %.
    assert flatness(narrow[1:]) <= 0.05
    assert flatness(narrow) <= 0.1


def test_order_1_is_flat_over_cut_positions():
    assert flatness(condition_beside_a_row(1, "node")) <= 0.05


@pytest.mark.parametrize("kind", ["none", "node"])
def test_without_the_star_slivers_ruin_order_2(kind):
    """The condition number grows like eps^-2, and the matrix is singular in the end."""
    result = [scenes.condition(beside_a_row(eps, 2, kind)) for eps in (1e-2, 1e-3, 1e-4, 1e-8)]
    print(f"\n{kind}: {result}")
    assert result[2] / result[1] == pytest.approx(100, rel=0.1)
    assert result[2] > 1e9
    assert result[3] > 1e15


@pytest.mark.parametrize("eps", [0.1, 1e-2, 1e-3, 1e-4])
def test_the_basis_changes_no_digit_of_K(eps):
    """Round-off times the condition number of the worst of them (1e10 at 1e-4)."""
    K = [
        scenes.K_of(beside_a_row(eps, 2, kind, patch))
        for kind, patch in (("none", False), ("node", False), ("star", False), ("star", True))
    ]
    spread = np.ptp(K, axis=0).max()
    print(f"\neps {eps}: K {K[2][0]}, spread over bases {spread:.1e}")
    assert spread <= 1e-6


@pytest.mark.parametrize("order", [1, 2])
def test_K_is_smooth_in_the_cut_position(order):
    """The crack moves by a tenth of a cell in all: what changes is discretisation, no jump."""
    K = np.array([scenes.K_of(beside_a_row(eps, order))[0] for eps in EPS])
    print(f"\norder {order}: K {K.min(axis=0)} ... {K.max(axis=0)}")
    below = K[np.array(EPS) <= 1e-4]
    assert np.ptp(below, axis=0).max() <= {1: 5e-5, 2: 1e-5}[order]
    assert np.ptp(K, axis=0).max() <= {1: 2e-3, 2: 1e-4}[order]


def test_cracks_just_above_and_below_a_row_agree():
    """A mesh that is symmetric about the row would give the same K; this one nearly does."""
    for eps in (1e-4, 1e-9, 1e-13):
        above, below = (scenes.K_of(beside_a_row(sign * eps, 2))[0] for sign in (1, -1))
        # Discretisation: the functions of the row's nodes change sides.
        assert above == pytest.approx(below, abs=2e-5)


def test_star_drops_what_is_dependent_and_nothing_else():
    """On the row and far from it the basis has as many columns as there are free unknowns."""

    def columns(eps):
        return [matrix_of(beside_a_row(eps, 2, kind)).shape[0] for kind in ("star", "none")]

    for eps in (0.3, 1e-2, 1e-4):
        retained, free = columns(eps)
        assert retained == free
    retained, free = columns(1e-8)
    assert 0 < free - retained <= 2 * 20
