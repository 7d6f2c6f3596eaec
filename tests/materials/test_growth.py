"""Growth through several materials: laws, toughness and ends by the material that a tip is in."""

import numpy as np
import pytest

import xcrack as xc
from support import materials as scenes

FAST, SLOW = xc.paris(1e-3, 3.0), xc.paris(1e-4, 3.0)
CYCLE = xc.Cycle(0.0, 1.0)


def run(law, a=0.33, materials=None, **options):
    """From before the interface at x = .5 into what is behind it, which is as stiff."""
    problem = scenes.edge_crack(20, a, 1.0)
    if materials is not None:
        problem = xc.Problem(problem.mesh, materials, problem.cracks, loads=problem.loads)
    choices = {"da": 0.05, "progress": False, "max_steps": 6, **options}
    return xc.collect(xc.grow(problem, law, xc.max_hoop_stress, CYCLE, **choices))


def test_each_material_has_its_law():
    both = run({"one": FAST, "two": SLOW})
    fast, slow = run(FAST), run(SLOW)
    x = [step.sif[0][0].x[0, 0] for step in both.steps]
    assert x[0] < 0.5 < x[-1]
    for step, one, two in zip(both.steps, fast.steps, slow.steps, strict=True):
        expected = one if step.sif[0][0].x[0, 0] < 0.5 else two
        assert step.rate[0] == pytest.approx(expected.rate[0], rel=1e-6)
    assert fast.life < both.life < slow.life
    same = run({"one": FAST, "two": FAST})
    assert same.life == pytest.approx(fast.life, rel=1e-12)


def test_each_material_has_its_toughness():
    def materials(K_c):
        return {"one": xc.Isotropic(1.0, 0.3, "strain", K_c=1e3),
                "two": xc.Isotropic(1.0, 0.3, "strain", K_c=K_c)}  # fmt: skip

    tough, brittle = run(FAST, materials=materials(1e3)), run(FAST, materials=materials(1.0))
    assert "max_steps" in tough.ended
    assert "K_c reached" in brittle.ended
    assert brittle.steps[-1].sif[0][0].x[0, 0] > 0.5
    assert brittle.steps[-2].sif[0][0].x[0, 0] < 0.5


def test_a_run_stops_behind_an_interface():
    history = run(FAST, stop_at_interface=True)
    assert "interface passed: " in history.ended
    assert "has come from 'one' into 'two'" in history.ended
    assert 0.5 < history.steps[-1].sif[0][0].x[0, 0] < 0.55
    assert "max_steps" in run(FAST, a=0.55, max_steps=2, stop_at_interface=True).ended


@pytest.mark.parametrize(
    ("law", "text"),
    [
        ({"one": FAST}, "there are laws for 'one', and the materials .* are 'one', 'two': give"),
        ({"one": FAST, "two": FAST, "three": FAST}, "laws for 'one', 'two', 'three', and"),
        ({"one": FAST, "two": 3.0}, "'two': 3.0: give the name of a cell set, and a law"),
        ({}, "give a mapping of cell sets to laws"),
        ({"one": xc.walker(1e-3, 3.0, 0.5, ratio="nominal"), "two": FAST}, "in several ways"),
        ({"one": FAST, "two": lambda dK, R: dK[:0]}, "the law returned shape"),
    ],
)
def test_laws_that_fit_no_materials_are_refused(law, text):
    with pytest.raises(xc.ProblemError, match=text):
        run(law, a=0.46)


def test_one_material_takes_no_mapping():
    mesh = xc.box((0.0, -1.0), (1.0, 1.0), (8, 17))
    crack, steel = xc.line_crack([(0, 0), (0.3, 0)]), xc.Isotropic(1.0, 0.3, "strain")
    problem = xc.Problem(mesh, steel, [crack], loads=scenes.PULL)
    with pytest.raises(xc.ProblemError, match="are one, without a name"):
        next(xc.grow(problem, {"one": FAST}, xc.max_hoop_stress, CYCLE, da=0.1))


def test_runs_with_laws_by_material_are_resumed(tmp_path):
    law = {"one": FAST, "two": SLOW}
    whole = run(law)
    problem = scenes.edge_crack(20, 0.33, 1.0)
    scene = law, xc.max_hoop_stress, CYCLE
    choices = {"da": 0.05, "progress": False}
    xc.collect(xc.grow(problem, *scene, max_steps=2, **choices), path=tmp_path / "run")
    resumed = xc.resume(tmp_path / "run", problem, *scene, max_steps=6, **choices)
    assert np.array_equal(resumed.cracks[0].points, whole.cracks[0].points)
    other = {"one": FAST, "two": xc.paris(2e-4, 3.0)}
    with pytest.raises(xc.ProblemError, match="law"):
        xc.resume(tmp_path / "run", problem, other, *scene[1:], max_steps=7, **choices)
