"""Tips and fronts that come to the boundary: where, on which set, after how many cycles."""

import numpy as np
import pytest

import xcrack as xc
from support.growth_fakes import STRESS, formula, mode_I, plate

LAW = xc.paris(C=1e-12, m=3.0)
CYCLE = xc.Cycle(0.0, 1.0)


def exact(a0, a1):
    """Cycles from a0 to a1 with K = STRESS √(π a) and m = 3."""
    return 2 * (a0**-0.5 - a1**-0.5) / (1e-12 * (STRESS * np.sqrt(np.pi)) ** 3)


def grown(problem, **options):
    return xc.collect(
        xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, progress=False, **options),
        keep_solutions=False,
    )


@pytest.mark.parametrize(("integrator", "rel"), [("pec", 1e-9), ("euler", 1e-3)])
def test_the_last_step_ends_on_the_side_with_its_cycles(integrator, rel):
    """The crack is 60 long there. Rates are a power of the length, which pec follows exactly."""
    response = formula(mode_I())
    history = grown(plate(), da=4.1, integrator=integrator, response=response)
    last = history.steps[-1]
    assert last.n_tips == 0
    assert len(last.sif) == 2
    assert last.sif[0][0].K.shape == (0, 2)
    (arrival,) = history.arrivals
    assert last.arrivals == (arrival,)
    assert (arrival.crack, arrival.tip, arrival.name) == (0, 0, "right")
    assert arrival.x == pytest.approx((60.0, 0.37), rel=1e-12)
    assert arrival.ligament == pytest.approx(60.0 - history.steps[-2].sif[0][0].x[0, 0], rel=1e-9)
    assert history.life == arrival.cycles == pytest.approx(exact(5.0, 60.0), rel=rel)
    assert history.cracks[0].points[-1] == pytest.approx([60.0, 0.37], rel=1e-12)
    assert history.cracks[0].tips == ()
    assert history.solved == history.steps[:-1]
    assert all(not step.arrivals for step in history.steps[:-1])


def test_a_tip_in_a_hole_names_its_set():
    mesh = xc.plate_with_hole(width=60, height=40, radius=5, size=1.5, size_near=0.5)
    crack = xc.line_crack([(-30.0, 0.3), (-20.0, 0.3)])
    material = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
    response = formula(mode_I())
    history = grown(xc.Problem(mesh, material, [crack]), da=4.0, response=response)
    (arrival,) = history.steps[-1].arrivals
    assert arrival.name == "hole"
    rim = -np.sqrt(25 - 0.3**2)
    assert arrival.x == pytest.approx((rim, 0.3), abs=0.02)  # the hole is a polygon
    assert "reached 'hole' at (-4.98" in history.ended
    assert history.life == pytest.approx(exact(10.0, 30 + rim), rel=2e-3)


def test_one_tip_arrives_and_the_other_goes_on():
    """The left tip has 8 to go; both grow evenly until then."""
    problem = plate([xc.line_crack([(8.0, 0.37), (20.0, 0.37)])])
    response = formula(mode_I(factor=lambda a: 1.0))
    history = grown(problem, da=6.0, max_steps=4, response=response)
    with_one = [step for step in history.steps if step.arrivals]
    assert [step.index for step in with_one] == [2]
    (arrival,) = with_one[0].arrivals
    assert (arrival.name, arrival.tip, arrival.x) == ("left", 0, (0.0, pytest.approx(0.37)))
    assert arrival.cycles == pytest.approx(8.0 / (1e-12 * STRESS**3), rel=1e-9)


@pytest.mark.parametrize("da", [5.3, 1.4, 0.7])
def test_the_other_tip_goes_on_from_where_it_is_as_one_arrives(da):
    """K jumps there, from √(π a) of two tips to 1.12 √(π a) of one: both integrals are exact.

    Steps of any length end there; one of .7 would end .3 before the side, which is no tip.
    """

    def K_of(problem, c):
        n, size = problem.placed[c].n_tips, problem.sizes[c]
        K = STRESS * np.sqrt(np.pi * size / 2) if n == 2 else 1.12 * STRESS * np.sqrt(np.pi * size)
        return [[K, 0.0]] * n

    problem = plate([xc.line_crack([(8.0, 0.37), (20.0, 0.37)])])
    history = grown(problem, da=da, max_size=40.0, response=formula(K_of))
    (step,) = [step for step in history.steps if step.arrivals]
    assert step.sizes[0] == pytest.approx(28.0, rel=1e-9)
    assert step.cycles == pytest.approx(exact(6.0, 14.0), rel=1e-9)
    assert step.arrivals[0].cycles == pytest.approx(step.cycles, rel=1e-9)
    whole = exact(6.0, 14.0) + exact(28.0, 40.0) / 1.12**3
    assert history.life == pytest.approx(whole, rel=1e-9)


def test_the_last_step_is_stored_and_nothing_follows_it(tmp_path):
    response = formula(mode_I())
    options = {"da": 20.0, "progress": False}
    run = xc.collect(
        xc.grow(plate(), LAW, xc.max_hoop_stress, CYCLE, **options, response=response),
        path=tmp_path / "run",
    )
    read = xc.load(tmp_path / "run")
    again = xc.resume(
        tmp_path / "run", plate(), LAW, xc.max_hoop_stress, CYCLE, **options, response=response
    )
    for history in (read, again):
        assert history.ended == run.ended
        assert history.life == run.life
        assert history.steps[-1].arrivals == run.steps[-1].arrivals
        assert (history.cracks[0].points == run.cracks[0].points).all()


def test_until_is_not_asked_of_a_step_without_tips():
    """What users write there looks for K at the tips."""
    response = formula(mode_I())
    history = xc.collect(
        xc.grow(
            plate(), LAW, xc.max_hoop_stress, CYCLE, da=20.0, progress=False, response=response
        ),
        until=lambda step: step.sif[-1][0].K_I.max() > 1e9,
    )
    assert history.ended.startswith("tip left the body")


def test_tables_pictures_and_files_take_the_last_step(tmp_path):
    problem = plate()
    response = formula(mode_I())
    history = grown(problem, da=20.0, response=response)
    history = xc.History(history.steps, history.ended, mesh=problem.mesh)
    rows = history.table()
    assert rows["N"][-1] == history.life
    assert (rows["x"][-1], rows["a"][-1]) == pytest.approx((60.0, 60.0), rel=1e-9)
    assert np.isnan(rows["K_I_max"][-1])
    assert np.isfinite(rows["K_I_max"][:-1]).all()
    measured, ends = history.measures()
    assert measured["area"][-1] == pytest.approx(60.0, rel=1e-9)
    assert set(ends["set"][ends["step"] == history.steps[-1].index]) == {"left", "right"}
    for kind in ("K", "a", "path"):
        history.plot(kind, file=tmp_path / f"{kind}.png")
    history.write(tmp_path / "files")
    assert "right" in (tmp_path / "files" / "ends.csv").read_text()
    assert history._repr_html_()


def test_lives_go_up_to_the_side():
    response = formula(mode_I())
    history = grown(plate(), da=4.1, response=response)
    assert history.rerate(LAW).life == pytest.approx(history.life, rel=1e-12)
    assert history.rerate(xc.paris(C=2e-12, m=3.0)).life == pytest.approx(history.life / 2)
    curve = xc.growth_curve(history)
    assert curve.a[-1] == pytest.approx(60.0, rel=1e-9)
    assert curve.N[-1] == pytest.approx(history.life, rel=1e-12)
    assert len(xc.residual_strength(history, nu=0.3, K_c=4000.0)) == len(history.steps) - 1


def test_a_report_shows_the_last_K_and_the_break_through(tmp_path):
    response = formula(mode_I())
    history = grown(plate(), da=20.0, response=response)
    file = xc.report(history, tmp_path / "report.html")
    text = file.read_text()
    assert "break-through" in text
    assert history.steps[-1].arrivals[0].name in text


@pytest.mark.filterwarnings("ignore:K along the front")
def test_a_front_that_leaves_through_a_side(tmp_path):
    """A straight front one cell from the far side: 0.35 of the cube is behind it, 0.65 before."""
    mesh = xc.box((-1, -1, -1), (1, 1, 1), (6, 4, 6))
    y = [(-2.0, -2.0), (0.5, -2.0), (0.5, 2.0), (-2.0, 2.0)]
    crack = xc.plane_crack([(*p, 0.0317) for p in y])
    pull = [xc.traction("top", (0, 0, 1)), xc.traction("bottom", (0, 0, -1))]
    problem = xc.Problem(
        mesh, xc.Isotropic(E=1e3, nu=0.3), [crack], loads=pull, contact="off", order=1
    )
    run = xc.grow(
        problem, lambda dK, R: 1e-3 + 0.0 * dK, xc.max_hoop_stress, CYCLE, da=0.7, progress=False
    )
    history = xc.collect(run, keep_solutions=False)
    last = history.steps[-1]
    assert [step.n_tips > 0 for step in history.steps] == [True, False]
    (arrival,) = last.arrivals
    assert arrival.name == "right"
    assert arrival.x[0] == pytest.approx(1.0, abs=1e-9)
    # The path turns a little: K_II of a coarse mesh.
    assert last.cycles == pytest.approx(500.0, rel=0.02)
    rows = history.table()
    assert rows["N"][-1] == last.cycles
    assert np.isnan(rows["K_I_max_max"][-1])
    history.measures(mesh)
    xc.History(history.steps, history.ended, mesh=mesh).plot("fronts", file=tmp_path / "f.png")
