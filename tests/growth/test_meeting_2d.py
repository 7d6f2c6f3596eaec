"""Tips that meet other cracks in a run, in 2D: ends on flanks, unions of tips, pieces cut off."""

from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc

STEEL = xc.Isotropic(210e3, 0.3, "strain")
PULL = [xc.traction("top", (0, 100.0)), xc.traction("bottom", (0, -100.0))]
ARGS = (xc.paris(C=1e-11, m=3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0))
INTO = [[(0, 10.05), (8.6, 10.05)], [(11.05, 7.1), (13.05, 13.4)]]
FACING = [[(3, 10.05), (8.3, 10.05)], [(16, 10.05), (11.2, 10.15)]]

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def scene(lines, n=40, order=1):
    mesh = xc.box((0.0, 0.0), (20.0, 20.0), n)
    return xc.Problem(mesh, STEEL, [xc.line_crack(line) for line in lines], loads=PULL, order=order)


def run(lines, n=40, da=0.8, order=1, **options):
    grown = xc.grow(scene(lines, n, order), *ARGS, da=da, progress=False, **options)
    return xc.collect(grown)


@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_a_tip_ends_on_a_flank(integrator):
    """It keeps its direction; the other crack's tips go on."""
    history = run(INTO, 30, max_steps=5, integrator=integrator)
    (join,) = history.joins
    step = history.steps[join.step]
    assert join.cracks == (0, 1)
    assert [crack.n_tips for crack in step.cracks] == [0, 2]
    np.testing.assert_array_equal(step.cracks[0].points[-1], join.point)
    before, last = np.diff(step.cracks[0].points[-3:], axis=0)
    cosine = before @ last / np.linalg.norm(before) / np.linalg.norm(last)
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 5.0
    assert history.steps[join.step - 1].cycles < join.N == step.cycles
    assert history.steps[-1].rate[1].max() > 10 * history.steps[0].rate[1].max()


@pytest.mark.parametrize("integrator", ["pec", "euler"])
def test_facing_tips_become_one_crack(integrator):
    history = run(FACING, max_steps=5, integrator=integrator)
    (join,) = history.joins
    step = history.steps[join.step]
    assert join.cracks == (0, 1)
    assert len(step.cracks) == 1
    x = step.cracks[0].points
    assert (np.diff(x[:, 0]) > 0).all()  # as the first crack runs; the second was given reversed
    assert any(np.array_equal(point, join.point) for point in x[1:-1])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"loads": [*PULL, xc.crack_pressure(1.0, crack=1)]}, "names a crack by its number"),
        ({"friction": (0.0, 0.3)}, "friction differs between them"),
    ],
)
def test_what_belongs_to_a_number_ends_the_run_where_tips_meet(changes, words):
    """The crack behind the two would have the load, or the friction, of one of them."""
    steps = xc.grow(replace(scene(FACING), **changes), *ARGS, da=0.8, progress=False, max_steps=5)
    history = xc.collect(steps)
    assert history.ended.startswith("the cracks cannot go on after step")
    assert "cracks 0 and 1 meet near [" in history.ended
    assert words in history.ended
    assert len(history.steps[-1].cracks) == 2


@pytest.mark.slow
def test_cycles_of_a_join_do_not_depend_on_mesh_and_step():
    """Discretisation: within 1 % with smaller cells and steps."""
    lines = [[(0, 10.05), (7.1, 10.05)], INTO[1]]
    coarse = run(lines, 30, 0.8, 2, max_steps=6).joins[0]
    fine = run(lines, 60, 0.5, 2, max_steps=10).joins[0]
    assert coarse.N == pytest.approx(fine.N, rel=0.01)
    np.testing.assert_allclose(coarse.point, fine.point, atol=0.1)  # a fifth of a cell


def test_a_piece_cut_off_ends_the_run():
    history = run([[(0, 10.05), (8.6, 10.05)], [(20, 10.05), (11.4, 10.05)]], max_steps=9)
    assert "cracks 0 and 1 join at (10, 10.0" in history.ended
    assert "of the body, is cut off" in history.ended
    (join,) = history.joins
    assert join.N == history.life > history.steps[-2].cycles


@pytest.mark.parametrize("lines", [INTO, FACING], ids=["flank", "tips"])
def test_resumed_across_a_join_to_the_last_bit(lines, tmp_path):
    options = {"da": 0.8, "progress": False}
    whole = run(lines, max_steps=6)
    xc.collect(xc.grow(scene(lines), *ARGS, max_steps=whole.joins[0].step, **options), tmp_path)
    again = xc.resume(tmp_path, scene(lines), *ARGS, max_steps=6, **options)
    assert again.ended == whole.ended
    assert again.joins == whole.joins
    for one, other in zip(whole.steps, again.steps, strict=True):
        assert one.cycles == other.cycles
        for a, b in zip(one.sif[-1], other.sif[-1], strict=True):
            np.testing.assert_array_equal(a.K, b.K)
