"""Growth to a wanted error: lives and paths against exact ones, bars, resuming, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import xcrack as xc
from benchmarks.wanted_drawn import errors_beside
from benchmarks.wanted_drawn import run as run_drawn
from benchmarks.wanted_drawn import scene as drawn_scene
from benchmarks.wanted_error import SCENES, against, run, scene
from xcrack import respond
from xcrack.analysis.solve import solve_states
from xcrack.growth import cells as mesh_cells
from xcrack.growth import response
from xcrack.growth.options import run_of as rule_of
from xcrack.growth.step_length import first_length, next_length, step_error
from xcrack.mesh.locate import cell_sizes
from xcrack.runs import run_folder
from xcrack.verification.exact.plates import PLATE_EDGE

STEEL = xc.Isotropic(210e3, 0.3, plane="strain")
LAW = xc.paris(C=1e-3, m=3.0)
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")

A0 = 0.2
_SQUARE = np.array([(a, F) for (h, a), F in PLATE_EDGE.items() if h == 1.0]).T
# K grows like (1 - a)^(-3/2) towards the far edge; without it, a quartic passes the table.
_QUARTIC = np.polyfit(_SQUARE[0], _SQUARE[1] * (1 - _SQUARE[0]) ** 1.5, 4)
_TABLE = 3e-4  # of K: between the points of the table


def strip(n=6, y=0.003, **options):
    """Edge crack of 0.2 in the strip [0, 1] x [-1, 1] under tension, on a coarse mesh."""
    mesh = xc.box((0.0, -1.0), (1.0, 1.0), (n, 2 * n))
    crack = xc.line_crack([(-0.1, y), (A0, y)])
    return xc.Problem(mesh, STEEL, [crack], loads=PULL, **options)


def exact_life(a):
    """Cycles from 0.2 to a by the table of K."""

    def cycles(a):
        K = np.sqrt(np.pi * a) * np.polyval(_QUARTIC, a) / (1 - a) ** 1.5
        return float(1 / LAW(np.array([K]), np.zeros(1))[0])

    return float(quad(cycles, A0, a, epsrel=1e-12)[0])


def run_of(problem=None, **options):
    given = {
        "problem": problem or strip(),
        "law": LAW,
        "criterion": xc.max_hoop_stress,
        "cycle": xc.Cycle(0.0, 1.0),
        "progress": False,
    }
    return given | options


def longer_than(a):
    return lambda step: step.corrected[0].points[-1, 0] > a


# Known lives -----------------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [1e-2, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_life_of_an_edge_crack(tolerance):
    """Paris's law integrated over K of the table; that is good to 3e-4, thrice in the life."""
    history = xc.collect(
        xc.grow(**run_of(tolerance=tolerance)), until=longer_than(0.5), keep_solutions=False
    )
    bar = history.life_bar
    error = abs(history.life / exact_life(history.cracks[0].points[-1, 0]) - 1)
    print(f"true {error:.1e}: {bar}")
    assert error <= tolerance
    assert error <= bar.relative + LAW.m * _TABLE
    assert bar.relative <= tolerance
    assert bar.best == bar.places == len(history.steps)
    assert bar.contact == bar.unknown == 0.0
    assert bar.path <= tolerance * 0.3


def test_steps_are_chosen_by_the_tolerance():
    """A tolerance ten times smaller: more and shorter steps; da and cycles stay upper bounds."""
    few = xc.collect(xc.grow(**run_of(tolerance=0.05)), until=longer_than(0.4))
    many = xc.collect(xc.grow(**run_of(tolerance=0.05, da=0.03)), until=longer_than(0.4))
    assert len(many.steps) > len(few.steps)
    ways = np.diff([step.corrected[0].points[-1, 0] for step in many.steps])
    assert ways.max() <= 0.03 * (1 + 1e-9)
    # The first mesh is fine enough for that, on which the crack is four cells long.
    assert all(step.run.cells is None for step in [*few.steps, *many.steps])
    # The table of the run says which K was used, and how far N is known.
    table = few.table()
    assert (table["best"] == 1).all()
    assert table["N_bar"][-1] == few.life_bar.total
    assert "±" in repr(few)
    assert "best K at" in str(few.life_bar)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [3e-2, 1e-2])
@pytest.mark.parametrize("name", SCENES[:3])
def test_path_and_life_of_scenes_without_exact_solution(name, tolerance):
    """Against a run with a tolerance of 1e-3 in steps of 0.03; that is good to 2e-3 itself."""
    problem, end = scene(name)
    truth, _ = run(problem, end + 0.3, tolerance=1e-3, da=0.03)
    history, _ = run(problem, end, tolerance=tolerance)
    path, life = against(truth)(history)
    error = history.steps[-1].error
    known = next(s.error for s in truth.steps if s.corrected[0].points[-1, 0] > end)
    print(f"{name}: life {life:.1e} of {history.life_bar.relative:.1e}, path {path:.1e}")
    assert max(path, life) <= tolerance
    assert life <= history.life_bar.relative
    assert path <= error.path / error.grown + known.path / known.grown


@pytest.mark.slow
def test_life_of_a_penny():
    """K of an infinite body: the block is 3 to 6 times as wide, and K up to 4 % larger in it."""
    centre = np.array([0.01, 0.013, 0.017])
    penny = xc.penny_crack(tuple(centre), (0, 0, 1), 0.25)
    pull = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    steel = xc.Isotropic(210e3, 0.3)
    problem = xc.Problem(xc.box((-1.5,) * 3, (1.5,) * 3, 11), steel, [penny], loads=pull)

    def radius(step):
        return np.linalg.norm(step.corrected[0].points - centre, axis=1).max()

    steps = xc.grow(**run_of(problem, tolerance=0.1))
    history = xc.collect(steps, until=lambda step: radius(step) > 0.4, keep_solutions=False)

    def cycles(a):
        return float(1 / LAW(np.array([2 * np.sqrt(a / np.pi)]), np.zeros(1))[0])

    exact = quad(cycles, 0.25, radius(history.steps[-1]))[0]
    print(f"{history.life / exact - 1:+.1e}: {history.life_bar}")
    assert abs(history.life / exact - 1) <= 0.1
    assert history.life_bar.relative <= 0.1


def two_sheets():
    """Cracks through a slab of three cells whose fronts head for each other."""
    cracks = [
        xc.plane_crack([(a, -0.6, 0.013), (b, -0.6, 0.013), (b, 0.6, 0.013), (a, 0.6, 0.013)])
        for a, b in ((-0.5, -0.2), (0.2, 0.5))
    ]
    pull = [xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))]
    mesh = xc.box((-1.5, -0.25, -1.0), (1.5, 0.25, 1.0), (18, 3, 12))
    return xc.Problem(mesh, xc.Isotropic(210e3, 0.3), cracks, loads=pull, contact="off")


@pytest.mark.slow
def test_a_tolerance_over_a_meeting_in_space():
    """Cells along the fronts are smaller before and after it.

    The life until then is that of a finer mesh in finer steps (1.4 % were measured).
    """
    history = xc.collect(
        xc.grow(**run_of(two_sheets(), tolerance=0.04)),
        until=lambda step: len(step.cracks) == 1 and not step.joins,
    )
    assert [len(step.cracks) for step in history.steps] == [2, 2, 1, 1]
    assert [step.run.meshes for step in history.steps] == [0, 1, 1, 1]
    assert all(np.isfinite(sif.K).all() for step in history.steps for sif in step.sif[-1])
    met = history.steps[2]
    assert met.joins
    assert met.error.life >= history.steps[1].error.life
    finer = replace(two_sheets(), mesh=xc.box((-1.5, -0.25, -1.0), (1.5, 0.25, 1.0), (30, 4, 20)))
    fixed = xc.collect(
        xc.grow(**run_of(finer, da=0.04, max_steps=12)), until=lambda step: bool(step.joins)
    )
    assert abs(met.cycles / fixed.life - 1) <= 0.04


# Meshes ----------------------------------------------------------------------------------------


def resumed(folder, given, whole, stops):
    """A run that is killed behind some steps, and taken up again each time."""
    xc.collect(xc.grow(**given, max_steps=stops[0]), folder)
    for stop in stops[1:]:
        xc.resume(folder, **given, max_steps=stop)
    other = xc.resume(folder, **given, max_steps=len(whole.steps))
    assert other.table().tobytes() == whole.table().tobytes()
    return other


def test_mesh_is_refined_at_the_first_step_that_needs_it(tmp_path, monkeypatch):
    """The first step is good enough on the mesh as given, the second is not; resumed on each.

    With a stricter rule: so close to the begin all errors together never are above the tolerance.
    """
    monkeypatch.setattr(mesh_cells, "_WHOLE", 0.3)
    given = run_of(strip(5), tolerance=4e-4)
    whole = xc.collect(xc.grow(**given, max_steps=3), tmp_path / "whole")
    assert [step.run.meshes for step in whole.steps] == [0, 1, 1]
    cells = [len(step.solutions[0].problem.mesh.cells) for step in whole.steps]
    assert cells[0] < min(cells[1:])
    # What K may take of the tolerance, for bars that hold for almost all single K.
    assert whole.steps[1].error.rate < 0.4 / 0.5 * 4e-4 < whole.steps[0].error.rate
    other = resumed(tmp_path / "part", given, whole, (1, 2))
    assert content(tmp_path / "part") == content(tmp_path / "whole")
    assert len(other.mesh.cells) == len(xc.load(tmp_path / "whole").mesh.cells) == cells[-1]


@pytest.mark.slow
@pytest.mark.mission
def test_fine_cells_follow_the_tip(tmp_path, monkeypatch):
    """They are refined at once; each mesh is that of the begin in cells whose sizes are stored."""
    monkeypatch.setattr(mesh_cells, "_BEGIN", 0.1)
    given = run_of(tolerance=5e-4)
    whole = xc.collect(xc.grow(**given, max_steps=8), tmp_path / "whole")
    assert {step.run.meshes for step in whole.steps} == {1}
    names = ("problem", "law", "criterion", "cycle")
    options = {name: given[name] for name in given if name not in names}
    rule = rule_of("grow", *[given[name] for name in names], None, options)
    meshes = [step.solutions[0].problem.mesh for step in whole.steps]
    assert len({len(mesh.cells) for mesh in meshes}) > 1
    first = mesh_cells.begin(rule).problem.mesh
    for step, mesh in zip(whole.steps, meshes, strict=True):
        cells, tip = step.run.cells, step.cracks[0].points[-1:]
        again = mesh_cells.bisect_mesh(first, cells)
        assert again.points.tobytes() == mesh.points.tobytes()
        assert again.cells.tobytes() == mesh.cells.tobytes()
        assert cell_sizes(mesh, tip)[0] <= 1.25 * cells.size_at(tip)[0]
    assert whole.life_bar.relative <= 5e-4
    assert abs(whole.life / exact_life(whole.cracks[0].points[-1, 0]) - 1) <= 5e-4 + 3 * _TABLE
    resumed(tmp_path / "part", given, whole, (1, 2, 5))
    assert content(tmp_path / "part") == content(tmp_path / "whole")


def test_nothing_is_lost_where_a_later_mesh_cannot_be_made(tmp_path, monkeypatch):
    """The mesh as given serves the first step; then it is refined, and that fails."""

    def fails(*args):
        raise xc.MeshError("curves['hole'] takes the point elsewhere")

    monkeypatch.setattr(mesh_cells, "refine_cells", fails)
    monkeypatch.setattr(mesh_cells, "_WHOLE", 0.3)
    given = xc.grow(**run_of(strip(5), tolerance=4e-4))
    with pytest.raises(xc.MeshError, match=r"curves\['hole'\] takes the point") as caught:
        xc.collect(given, tmp_path)
    assert len(caught.value.history.steps) == len(xc.load(tmp_path).steps) == 1
    assert "1 finished steps are in" in caught.value.__notes__[-1]


# What is stored --------------------------------------------------------------------------------


def content(folder):
    files = sorted(p for p in folder.iterdir() if p.is_file() and p.name != run_folder.MESH)
    return {path.name: path.read_bytes() for path in files}


@pytest.mark.parametrize("lost", ["", pytest.param(run_folder.MESH, marks=pytest.mark.slow)])
def test_resumed_to_the_last_bit(tmp_path, lost):
    """A run that is killed, also one that has lost its mesh, which only pictures are drawn on."""
    given = run_of(tolerance=0.05 if not lost else 1e-3)
    whole = xc.collect(xc.grow(**given, max_steps=4), tmp_path / "whole")
    xc.collect(xc.grow(**given, max_steps=2), tmp_path / "part")
    if lost:
        (tmp_path / "part" / lost).unlink()
    resumed = xc.resume(tmp_path / "part", **given, max_steps=4)
    assert resumed.table().tobytes() == whole.table().tobytes()
    assert content(tmp_path / "part") == content(tmp_path / "whole")
    stored = xc.load(tmp_path / "whole")
    assert stored.life_bar.total == whole.life_bar.total
    assert len(stored.mesh.cells) == len(whole.steps[-1].solutions[0].problem.mesh.cells)


@pytest.mark.slow
@pytest.mark.mission
def test_bars_between_solves_are_foretold(tmp_path):
    """Best K is that of own bars within the bars; a run that was at its end goes on alike."""
    asked = []

    def answer(problem, states, reuse, bars):
        asked.append(bars)
        return respond(problem, states, reuse, bars)

    given = run_of(strip(12), tolerance=0.05, da=0.03)
    steps = list(xc.grow(**given, max_steps=10, response=answer))
    # The first, the fourth, the eighth and the last one have their own.
    assert asked == [True, False, False, False, True, False, False, False, True, True]
    for step in [*steps[1:4], *steps[5:8]]:
        foretold, own = step.sif[-1][0], xc.stress_intensity(step.solutions[-1], error=True)
        assert (np.abs(foretold.best - own.best) <= foretold.bar).all()
        # 1.3 a solve and a quarter of eta, which is five bars here, and what bars change in three.
        assert foretold.bar[0, 0] < 10 * own.bar[0, 0]
    whole = xc.collect(xc.grow(**given, max_steps=8), tmp_path / "whole")
    xc.collect(xc.grow(**given, max_steps=6), tmp_path / "part")
    again = xc.resume(tmp_path / "part", **given, max_steps=8)
    assert again.table().tobytes() == whole.table().tobytes()


def test_a_solve_whose_bars_cannot_be_foretold_is_not_done_again(monkeypatch):
    """K of this crack doubles in a step towards the side: its bars come from the factor at hand."""
    counts = []

    def counted(*args, **options):
        counts.append(options["error"])
        return solve_states(*args, **options)

    monkeypatch.setattr(response, "solve_states", counted)
    problem, end = scene(SCENES[0])
    history, _ = run(problem, end, tolerance=3e-2)
    assert len(counts) == len(history.steps)  # no step of it turns out too long


@pytest.mark.slow
@pytest.mark.mission
def test_life_of_a_pair_whose_first_step_no_later_one_may_mend_alone():
    """Against steps of .03. A second step of an eighth of the first had mended that by 10 %."""
    drawn = drawn_scene(3)
    truth, _ = run_drawn(drawn, drawn.way + 0.2, tolerance=5e-4, da=0.03)
    history, _ = run_drawn(drawn, drawn.way, tolerance=3e-2)
    path, life = errors_beside(truth, history)
    print(f"path {path:.1e}, life {life:.1e}")
    assert path <= 3e-2
    assert life <= 3e-2


def test_another_tolerance_is_another_run(tmp_path):
    xc.collect(xc.grow(**run_of(tolerance=0.05), max_steps=1), tmp_path)
    with pytest.raises(xc.ProblemError, match=r"other settings: tolerance: stored 0\.05, given 0"):
        xc.resume(tmp_path, **run_of(tolerance=0.04), max_steps=2)


# What cannot be --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": 1.0}, "tolerance"),
        ({"tolerance": -0.1}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
        ({"tolerance": "fine"}, "tolerance"),
        ({"tolerance": 0.01, "integrator": "euler"}, "integrator"),
        ({"da": 0.1, "max_unknowns": 1000}, "give tolerance too"),
        ({"tolerance": 0.01, "max_unknowns": 0}, "max_unknowns"),
        ({"tolerance": 0.01, "max_unknowns": 100}, "the first mesh"),
        ({}, "or a tolerance"),
    ],
)
def test_refused(options, match):
    with pytest.raises(xc.ProblemError, match=match):
        next(xc.grow(**run_of(**options)))


@pytest.mark.filterwarnings("default::xcrack.XcrackWarning")
def test_too_few_unknowns():
    steps = xc.grow(**run_of(tolerance=1e-4, max_unknowns=2500))
    with pytest.warns(xc.XcrackWarning) as caught:
        xc.collect(steps, until=longer_than(0.25))
    messages = [str(w.message) for w in caught]
    assert any("would have more than 2500 unknowns" in m for m in messages)
    assert any("tolerance = 0.0001 is not met at step" in m for m in messages)


# Lengths of steps -----------------------------------------------------------------------------


def test_steps_for_a_tolerance():
    """A rule of second order whose error is c h²: the steps settle where it is the tolerance."""
    c, tolerance = 2.0, 1e-2
    h, before = first_length(1.0, tolerance, least_length=1e-3), None
    for _ in range(12):
        error = step_error(c * h**3, h, 0.0, 1.0, 0.0, tolerance)
        h, before = next_length(h, error, before, least_length=1e-3), error
    assert step_error(c * h**3, h, 0.0, 1.0, 0.0, tolerance) == pytest.approx(0.95**2.5, abs=0.03)
    assert first_length(1.0, 1e-4, least_length=0.2) == 0.2
    assert next_length(1.0, 1e6, 1.0, least_length=0.6) == 0.6
    assert step_error(0.0, 1.0, 0.0, 1.0, 0.0, 1e-2) == 1e-3
    assert step_error(0.0, 1.0, 0.02, 1.0, 0.0, 1e-2) == 2.0  # 2 % of the life of the step
    assert step_error(0.0, 1.0, 0.02, 1.0, 100.0, 1e-2) == pytest.approx(2 / 15)  # of a long life


def test_a_response_of_ones_own_is_asked_for_bars_where_none_are_known():
    """It solves as `respond` does: the same run, and bars of fewer solves than there are."""
    calls = []

    def solved(problem, states, reuse, bars):
        calls.append(bars)
        return respond(problem, states, reuse, bars)

    options = run_of(tolerance=0.03, max_steps=4)
    own, same = (xc.collect(xc.grow(**options, **named)) for named in ({"response": solved}, {}))
    assert [step.cycles for step in own.steps] == [step.cycles for step in same.steps]
    assert any(calls)
    assert not all(calls)
