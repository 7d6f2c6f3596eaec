"""Nine tasks of an engineer who knows the pages alone: scripts as they would write them.

Each test is one task; what was in the way once is asserted to be gone.
"""

import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.case_texts import STRIP, STRIP_GROWTH
from support.decks import box_cases
from xcrack.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
UNITS = "N, mm, MPa"


def strip(**changes):
    """An edge crack in a strip: N, mm, MPa."""
    given = {
        "mesh": xc.box((0.0, -20.0), (20.0, 20.0), (20, 40)),
        "material": xc.Isotropic(E=210e3, nu=0.3, plane="strain"),
        "cracks": [xc.line_crack([(0.0, 0.3), (4.0, 0.3)])],
        "loads": [xc.traction("top", (0.0, 80.0)), xc.traction("bottom", (0.0, -80.0))],
        **changes,
    }
    return xc.Problem(**given)


@pytest.mark.slow
@pytest.mark.gmsh
def test_a_part_from_step_with_a_pin_and_a_life_by_nasgro_under_a_spectrum(tmp_path):
    """STEP to inspection interval: every number of the first page is there."""
    import gmsh

    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        body = gmsh.model.occ.addBox(-30.0, -20.0, 0.0, 60.0, 40.0, 6.0)
        hole = gmsh.model.occ.addCylinder(0.0, 0.0, -1.0, 0.0, 0.0, 8.0, 8.0)
        gmsh.model.occ.cut([(3, body)], [(3, hole)])
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "bracket.step"))
    finally:
        gmsh.finalize()
    # what the engineer writes
    mesh = xc.mesh_step(
        tmp_path / "bracket.step",
        size=lambda x: np.minimum(0.35 + 0.3 * np.linalg.norm(x - (0.0, 8.0, 6.0), axis=1), 2.5),
        sets={"hole": lambda x: np.hypot(x[:, 0], x[:, 1]) < 8.1, "end": lambda x: x[:, 0] < -29.9},
    )
    metal = xc.material("7075-T651 plate, L-T", units="mm, MPa√mm")
    problem = xc.Problem(
        mesh, metal.isotropic(plane=None, thickness=6.0),
        cracks=[xc.elliptic_crack((0.0, 8.0, 6.0), (1, 0, 0), (0, 1, 0), 1.5, 1.5)],
        supports=[xc.fix("end")], loads=[xc.bearing("hole", (6000.0, 0.0, 0.0))], order=1,
    )  # fmt: skip
    flight = xc.Spectrum([0.0, 1.0, 0.3, 0.7, 0.2, 0.6], unit="flight")
    run = xc.collect(
        xc.grow(problem, metal.law("nasgro", thickness=6.0), xc.max_hoop_stress, flight, da=0.5,
                max_steps=4, progress=False),
        tmp_path / "run",
    )  # fmt: skip
    plan = xc.inspection(xc.growth_curve(run), interval=0.3 * run.life)
    xc.report(run, tmp_path / "bracket.html", units=UNITS, spectrum=flight, inspection=plan)
    # what is on the first page
    page = (tmp_path / "bracket.html").read_text(encoding="utf-8")
    assert "flights" in page
    for words in ("growth law", "why it ended", "largest K at the end", "inspection", "MPa√mm"):
        assert words in page
    assert run.life > 0


@pytest.mark.slow
@pytest.mark.mission
def test_multiple_site_damage_with_link_up_and_residual_strength(tmp_path):
    """Two cracks of a row grow together; strength is one curve through the link-up."""
    problem = xc.Problem(
        xc.box((0.0, -20.0), (40.0, 20.0), (40, 40)),
        xc.Isotropic(E=73e3, nu=0.33, plane="stress", yield_stress=350.0),
        cracks=[xc.line_crack([(10, 0.3), (18, 0.3)]), xc.line_crack([(21, 0.3), (27, 0.3)])],
        loads=[xc.traction("top", (0.0, 60.0)), xc.traction("bottom", (0.0, -60.0))],
    )
    run = xc.collect(xc.grow(problem, xc.paris(1e-12, 3.0), xc.max_hoop_stress, xc.Cycle(0, 1),
                             da=0.8, max_steps=5, progress=False))  # fmt: skip
    rows = xc.residual_strength(run, nu=0.33, K_c=3000.0, yield_stress=350.0)
    xc.plot_strength(rows, file=tmp_path / "strength.png")
    xc.report(run, tmp_path / "msd.html", units=UNITS, strength=rows)
    looks = xc.inspection(run, a_detect=9.0, factor=3)
    assert len(run.joins) == 1
    assert (np.diff(rows["factor"]) < 0).all()
    assert looks.measure == "length"
    assert 0 < 3 * looks.interval < run.life


def test_weld_toe_with_residual_stress_under_full_reversal():
    """Tension left by the weld keeps the crack open at R = -1, compression closes it."""

    def left(x):
        stress = np.zeros((len(x), 2, 2))
        s = x[:, 0] / 20.0
        stress[:, 1, 1] = 60.0 * (1 - 6 * s + 6 * s**2)  # no force and no moment in the width
        return stress

    lives = {}
    for name, loads in {"none": [], "weld": [xc.initial_stress(left)]}.items():
        scene = strip(loads=[*strip().loads, *loads])
        run = xc.grow(scene, xc.walker(1e-13, 3.0, 0.5, R_range=(-9, 0.9), ratio="contact"),
                      xc.max_hoop_stress, xc.Cycle(-1.0, 1.0), da=1.0, max_steps=2,
                      progress=False)  # fmt: skip
        lives[name] = xc.collect(run).life
    assert lives["weld"] < lives["none"]


@pytest.mark.slow
@pytest.mark.gmsh
def test_a_lug_with_a_field_of_residual_stress(tmp_path):
    """A field of another program, in a script and in a case file: the same K, below that without.

    The field is that of a hole which was expanded: compression at its edge, in balance over the
    width but for what the solution spreads.
    """
    pytest.importorskip("gmsh")
    meshio = pytest.importorskip("meshio")
    grid = xc.box((-40.0, -100.0), (40.0, 40.0), (60, 105))
    r = np.maximum(np.linalg.norm(grid.points, axis=1), 8.0)
    stress = np.zeros((grid.n_points, 9))
    stress[:, 4] = -90.0 * np.exp(-(r - 8.0) / 3.0) + 20.0 * np.exp(-(((r - 15.0) / 3.0) ** 2))
    points = np.column_stack([grid.points, np.zeros(len(r))])
    meshio.Mesh(points, [("triangle", grid.cells)], {"S": stress}).write(tmp_path / "S.vtu")
    # what the engineer writes
    lug = xc.lug(W=40.0, D=16.0, a=3.0, force=800.0, size=4.0, size_near=0.8)
    left = xc.initial_stress(xc.read_field(tmp_path / "S.vtu"))
    metal = xc.material("7075-T651 plate, L-T", units="mm, MPa√mm").isotropic("stress")
    K = [xc.stress_intensity(xc.solve(lug.problem(metal, loads=loads))).K_I[0]
         for loads in (lug.loads, [*lug.loads, left])]  # fmt: skip
    assert K[1] < 0.9 * K[0]
    # or without Python
    (tmp_path / "lug.toml").write_text(LUG, encoding="utf-8")
    again = xc.solve(xc.read_case(tmp_path / "lug.toml").problem)
    assert xc.stress_intensity(again).K_I[0] == K[1]


LUG = """
[units]
length = "mm"
force = "N"
[specimen]
kind = "lug"
W = 40.0
D = 16.0
a = 3.0
force = 800.0
size = 4.0
size_near = 0.8
[material]
kind = "metal"
name = "7075-T651 plate, L-T"
plane = "stress"
[[loads]]
kind = "initial_stress"
f = { path = "S.vtu" }
"""


def test_a_deck_of_another_program_to_K(tmp_path):
    """Loads, supports and material of the deck: K in four lines, every keyword accounted for."""
    text = box_cases(2, 2)["CPE6_cload"].replace("*NODE PRINT", "*RESTART, WRITE\n*NODE PRINT")
    (tmp_path / "part.inp").write_text(text)
    # what the engineer writes
    deck = xc.read_deck(tmp_path / "part.inp")
    problem = deck.problem(cracks=[xc.line_crack([(1.5, 1.0), (1.5, 0.7)])])
    solution = xc.adapt(problem, tolerance=3e-2).solution
    K = xc.stress_intensity(solution).K_I
    # what has to be there
    assert K[0] > 0
    ignored = {row.keyword: row.reason for row in deck.keywords if not row.is_used}
    assert set(ignored) == {"*RESTART", "*NODE PRINT"}
    assert all(ignored.values())


@pytest.mark.parametrize("place", [4.0, 16.0])
def test_two_materials(place):
    """A crack in the stiff and in the soft half: bonded, and the stiff half has the larger K."""
    mesh = xc.box((0.0, -20.0), (20.0, 20.0), (20, 41)).with_cell_sets(
        {"steel": lambda x: x[:, 0] < 10.0, "aluminium": lambda x: x[:, 0] > 10.0}
    )
    materials = {
        "steel": xc.Isotropic(210e3, 0.3, "strain"),
        "aluminium": xc.Isotropic(70e3, 0.33, "strain"),
    }
    crack = xc.line_crack([(place - 2.0, 0.2), (place + 2.0, 0.2)])
    solution = xc.solve(strip(mesh=mesh, material=materials, cracks=[crack]))
    K = xc.stress_intensity(solution).K_I
    assert (K > 0).all()


@pytest.mark.slow
def test_thirty_cases_from_the_command_line(tmp_path, capsys):
    """Three keys, thirty runs, one table and one picture; what fails is said."""
    file = tmp_path / "case.toml"
    file.write_text(CASE, encoding="utf-8")
    words = ["sweep", str(file), "--set", "cracks.0.points.1.0=3,4,5,6,7", "--set",
             "loads.0.value.1=60 MPa,80 MPa,100 MPa", "--set", "growth.law.m=2.8,3"]  # fmt: skip
    assert main(words) == 0
    assert "30 cases in" in capsys.readouterr().out
    assert (tmp_path / "case_sweep" / "sweep.png").is_file()
    assert len((tmp_path / "case_sweep" / "sweep.csv").read_text().splitlines()) == 31


def test_a_notebook_shows_what_there_is():
    """Problem, solution and history have a view of their own."""
    problem = strip()
    solution = xc.solve(problem)
    run = xc.collect(xc.grow(problem, xc.paris(1e-13, 3.0), xc.max_hoop_stress, xc.Cycle(0, 1),
                             da=1.0, max_steps=1, progress=False))  # fmt: skip
    for shown in (problem, solution, xc.stress_intensity(solution), run):
        assert "<table" in shown._repr_html_()


SLIPS = {
    "E in GPa": lambda: xc.solve(strip(material=xc.Isotropic(210.0, 0.3, "strain"))),
    "Paris C too large": lambda: _grown(law=xc.paris(1e-8, 3.0)),
    "spectrum in MPa": lambda: _grown(cycle=xc.Spectrum([10, 80, 20, 60.0, 5, 80])),
    "K_c in MPa√m": lambda: _grown(K_c=33.0),
    "preset in m": lambda: _grown(law=xc.law("AA7050-T7451 NASGRO", units="m, MPa√m")),
    "no loads": lambda: xc.solve(strip(loads=[])),
}
REFUSED = {
    "no facet set 'topp'": lambda: strip(loads=[xc.traction("topp", (0.0, 80.0))]),
    "outside": lambda: strip(cracks=[xc.line_crack([(50.0, 50.0), (60.0, 50.0)])]),
}


def _grown(law=None, cycle=None, **options):
    law, cycle = law or xc.paris(1e-13, 3.0), cycle or xc.Cycle(0.1, 1.0)
    return xc.collect(xc.grow(strip(), law, xc.max_hoop_stress, cycle, da=1.0, max_steps=2,
                              progress=False, **options))  # fmt: skip


@pytest.mark.parametrize("name", SLIPS)
def test_slips_of_units_warn(name):
    """A warning each, with the number."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        SLIPS[name]()
    words = [str(each.message) for each in caught]
    assert any(any(c.isdigit() for c in each) or "no load" in each for each in words), words


@pytest.mark.parametrize("words", REFUSED)
def test_wrong_places_are_refused(words):
    with pytest.raises(xc.XcrackError, match=words):
        REFUSED[words]()


@pytest.mark.slow
@pytest.mark.mission
def test_a_case_goes_on_after_a_kill(tmp_path):
    """Half of the steps are there: the same command ends with the same numbers."""
    file = tmp_path / "case.toml"
    file.write_text(CASE, encoding="utf-8")
    whole = xc.run(file)
    steps = file.parent / "case_results" / "steps"
    stored = sorted(steps.glob("step_*.npz"))
    copy = tmp_path / "copy"
    shutil.copytree(steps, copy)
    stored[-1].unlink()  # as a kill leaves it
    assert main(["run", str(file), "--resume"]) == 0
    again = xc.load(steps)
    assert again.life == whole.life
    assert again.table().tobytes() == xc.load(copy).table().tobytes()


CASE = f"""{STRIP}[[supports]]
kind = "fix"
where = "bottom"
[[loads]]
kind = "traction"
where = "top"
value = [0.0, "80 MPa"]
{STRIP_GROWTH.replace("max_steps = 2", "max_steps = 3")}"""
