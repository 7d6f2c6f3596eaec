"""Case files: the same scene as a script's, units, and messages with file, line and mend."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.case_texts import STRIP, STRIP_GROWTH, STRIP_PULL
from xcrack.__main__ import main
from xcrack.base.units import FORCE, LENGTH, STRESS, TOUGHNESS, Units

pytestmark = [
    pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning"),
    pytest.mark.usefixtures("blank_pictures"),
]

PLATE = """\
title = "Edge crack"                      # a comment

[units]
length = "mm"
force = "N"

[mesh]
kind = "box"
lower = [0.0, -20.0]
upper = [20.0, 20.0]
n = [10, 20]

[material]
E = "210 GPa"
nu = 0.3
plane = "strain"

[[cracks]]
kind = "line"
points = [
    [0.0, "0.1 cm"],
    [6.0, 1.0],
]

[[loads]]
kind = "traction"
where = "top"
value = [0.0, "80 MPa"]

[[loads]]
kind = "traction"
where = "bottom"
value = [0.0, -80.0]

[solve]
order = 1
"""
GROWTH = (
    PLATE
    + """
[growth]
law = { kind = "paris", C = 1e-11, m = 3 }
cycle = { min = 0.1, max = 1.0 }
da = "2 mm"
max_steps = 3
K_c = "300 MPa*sqrt(m)"
progress = false
"""
)


@pytest.fixture(autouse=True)
def _by_matplotlib(monkeypatch):
    monkeypatch.setattr("xcrack.view.pyvista.can_render", lambda: False)


def written(folder, text, name="case.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def script():
    return xc.Problem(
        xc.box((0, -20), (20, 20), (10, 20)),
        xc.Isotropic(E=210e3, nu=0.3, plane="strain"),
        [xc.line_crack([(0, 1), (6, 1)])],
        loads=[xc.traction("top", (0, 80.0)), xc.traction("bottom", (0, -80.0))],
        order=1,
    )


def test_a_file_is_the_scene_of_a_script(tmp_path):
    case = xc.read_case(written(tmp_path, PLATE))
    assert case.title == "Edge crack"
    assert case.problem.material == script().material
    assert case.growth is None
    K, wanted = (xc.stress_intensity(xc.solve(p)).K for p in (case.problem, script()))
    assert K.tobytes() == wanted.tobytes()


def test_run_solves_and_reports(tmp_path):
    text = PLATE + '\n[output]\nfolder = "out"\npictures = ["opening"]\n'
    result = xc.run(written(tmp_path, text.replace("order = 1", "order = 1\nstates = [0.5, 1.0]")))
    assert [solution.factor for solution in result] == [0.5, 1.0]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"report.html", "report.json", "opening_0.png", "opening_1.png"} <= names
    assert json.loads((tmp_path / "out" / "report.json").read_text())["title"] == "Edge crack"


def test_a_tolerance_is_read(tmp_path):
    text = GROWTH.replace('da = "2 mm"', "tolerance = 0.1")
    assert xc.read_case(written(tmp_path, text)).growth["tolerance"] == 0.1


@pytest.mark.slow
def test_a_tolerance_stands_where_da_stands(tmp_path):
    """The file is run to one step; its report has the error of the cycles by source."""
    text = GROWTH.replace('da = "2 mm"', "tolerance = 0.1").replace(
        "max_steps = 3", "max_steps = 1"
    )
    path = written(tmp_path, text)
    history = xc.run(path)
    assert history.life_bar.K == 0.0  # estimated, and nothing has grown yet
    numbers = json.loads((tmp_path / "case_results" / "report.json").read_text(encoding="utf-8"))
    assert set(numbers["growth"]["error of cycles"]) == {"steps", "K", "contact", "unknown"}


@pytest.mark.slow
@pytest.mark.mission
def test_run_grows_and_goes_on_to_the_same_result(tmp_path):
    path = written(tmp_path, GROWTH)
    whole = xc.run(path)
    steps = xc.grow(
        script(), xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0.1, 1.0), da=2.0, max_steps=3,
        K_c=300 * np.sqrt(1000), progress=False,
    )  # fmt: skip
    assert whole.table().tobytes() == xc.collect(steps).table().tobytes()
    folder = tmp_path / "case_results"
    assert (folder / "history.csv").is_file()
    with pytest.raises(xc.ProblemError, match="holds a run of 3 steps"):
        xc.run(path)
    (folder / "steps" / "step_00002.npz").unlink()
    again = xc.run(path, resumed=True)
    assert again.table().tobytes() == whole.table().tobytes()
    assert json.loads((folder / "report.json").read_text(encoding="utf-8"))["growth"]["steps"] == 3


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("nu = 0.3", "nuu = 0.3", 15, "there is no such key: did you mean 'nu'?"),
        ("nu = 0.3\n", "", 13, "the key 'nu' is missing"),
        ("[material]", "[materials]", 13, "did you mean 'material'?"),
        ("210 GPa", "210 GPx", 14, "the unit 'GPx' is not known: known are m, cm"),
        ("210 GPa", "210 mm", 14, "'210 mm' is a length, but a stress belongs here"),
        ("210 GPa", "much", 14, 'is no number with a unit, such as "80 MPa"'),
        ("nu = 0.3", 'nu = "0.3 mm"', 15, "is a length, but a plain number belongs here"),
        ("nu = 0.3", "nu = 0.7", 15, "nu"),
        ('force = "N"', 'force = "kg"', 5, "known are N, kN"),
        ('kind = "box"', 'kind = "boxx"', 8, "known are file, step, box"),
        ('kind = "line"', 'kind = "circle"', 19, "known are line, penny"),
        ('kind = "line"', "kind = 3", 19, "put it into quotes"),
        ('where = "bottom"', 'were = "bottom"', 32, "did you mean 'where'?"),
        ('where = "bottom"', 'where = "botom"', None, "botom"),
        ("order = 1", "order = 3", 36, "give 1 or 2"),
        ("order = 1", "states = 3", 36, "give a list of factors"),
        ("order = 1", "order =", 36, "this is no toml"),
        ("[solve]", "[[solve]]", 35, "begin it with"),
        ("[[cracks]]", "[cracks]", 18, "begin each with"),
        ('[units]\nlength = "mm"\nforce = "N"\n', "", 11, "give [units]"),
    ],
)
def test_what_is_wrong_is_reported_with_its_line(old, new, line, words, tmp_path):
    assert old in PLATE
    path = written(tmp_path, PLATE.replace(old, new, 1))
    with pytest.raises(xc.XcrackError) as caught:
        xc.read_case(path)
    message = str(caught.value)
    assert words in message
    assert message.startswith(str(path) if line is None else f"{path}, line {line}, ".rstrip(", "))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"paris"', '"parris"', "paris, elber, walker"),
        ("C = 1e-11", "C = -1", "paris: C"),
        ("min = 0.1", "min = 2.0", "min <= max"),
        ("max_steps", "max_step", "did you mean 'max_steps'?"),
        ('da = "2 mm"', 'da = "2 MPa"', "is a stress, but a length belongs here"),
        ("progress = false", 'criterion = "hoop"', "known are max_hoop_stress"),
    ],
)
def test_growth_that_is_wrong_is_reported(old, new, words, tmp_path):
    path = written(tmp_path, GROWTH.replace(old, new, 1))
    with pytest.raises(xc.XcrackError, match=words) as caught:
        xc.read_case(path)
    line = next(k for k, row in enumerate(path.read_text().splitlines(), 1) if new in row)
    assert f"line {line}, growth" in str(caught.value)


def test_files_begin_at_the_case_file(tmp_path):
    data = Path(__file__).parents[1] / "data"
    text = PLATE.partition("[material]")
    mesh = '[mesh]\nkind = "file"\npath = "meshes/plate.msh"\n\n'
    path = written(tmp_path, mesh + "[material]" + text[2].replace("210 GPa", "1").replace(
        '"1"', "1.0").replace('"0.1 cm"', "1.0").replace('"80 MPa"', "80.0"))  # fmt: skip
    (tmp_path / "meshes").mkdir()
    shutil.copy(data / "plate_41.msh", tmp_path / "meshes" / "plates.msh")
    with pytest.raises(xc.ProblemError, match=r"line 3, mesh.path: there is no file .*plate.msh; "
                       r"beside it are plates.msh"):  # fmt: skip
        xc.read_case(path)
    with pytest.raises(xc.ProblemError, match="cannot be read"):
        xc.read_case(tmp_path / "nothing.toml")
    with pytest.raises(xc.ProblemError, match="is not a path"):
        xc.read_case(3)
    (tmp_path / "bytes.toml").write_bytes(b"title = '\xff'\n")
    with pytest.raises(xc.ProblemError, match="line 1: this is no text in utf-8"):
        xc.read_case(tmp_path / "bytes.toml")


def test_units_are_those_of_the_tables():
    """Round-off; a psi is 6894.757293168 Pa, a lbf 4.4482216152605 N (NIST)."""
    mm = Units("mm", "N")
    for text, dimension, wanted in (
        ("210 GPa", STRESS, 210e3), ("1e1 ksi", STRESS, 68.94757293168), ("2 in", LENGTH, 50.8),
        ("1 kN", FORCE, 1e3), ("1 MPa*sqrt(m)", TOUGHNESS, np.sqrt(1000)),
        ("1 MPa √m", TOUGHNESS, np.sqrt(1000)), ("3 N/mm^2", STRESS, 3.0),
        ("1 MPa·√mm", TOUGHNESS, 1.0), ("-.5 µm", LENGTH, -5e-4),
    ):  # fmt: skip
        assert mm.number(text, dimension) == pytest.approx(wanted, rel=1e-12), text
    assert Units("m", "MN").number("1 MPa", STRESS) == pytest.approx(1.0, rel=1e-12)


def test_loads_that_follow_the_crack_are_a_table_with_units(tmp_path):
    """In the unit of the model: a K in MPa√m is 31.6 times as large in MPa√mm."""
    numbers = 'K = "20 MPa*sqrt(m)", gradient = -0.08, a0 = "5 mm"'
    falling = f'load_program = {{ kind = "K_gradient", {numbers} }}\n'
    program = xc.read_case(written(tmp_path, GROWTH + falling)).growth["load_program"]
    assert program.K == pytest.approx(20.0 * np.sqrt(1000.0))
    assert (program.gradient, program.a0) == (-0.08, 5.0)
    shed = 'load_program = { kind = "load_over_size", function = [[5.0, 1.0], [20.0, 0.5]] }\n'
    program = xc.read_case(written(tmp_path, GROWTH + shed)).growth["load_program"]
    assert program.factors(np.array([12.5]), None, None) == pytest.approx([0.75])
    with pytest.raises(xc.ProblemError, match="load_over_size"):
        xc.read_case(written(tmp_path, GROWTH + 'load_program = { kind = "shed" }\n'))


def test_zones_of_link_up_are_a_table_with_units(tmp_path):
    zone = 'link_up = { sigma_y = "0.345 GPa", beta = 2 }\n'
    case = xc.read_case(written(tmp_path, GROWTH + zone))
    assert case.growth["link_up"] == xc.plastic_zone(345.0, beta=2)
    with pytest.raises(xc.ProblemError, match="beta"):
        xc.read_case(written(tmp_path, GROWTH + zone.replace("beta = 2", "beta = -2")))


SPECTRUM = """
spectrum = { factors = [0.0, 1.0, 0.4, 0.9, 0.0, 0.6], unit = "flight", least_range = 0.2 }
retardation = { kind = "wheeler", w = 1.2, zone = { sigma_y = "0.35 GPa", beta = 2 } }
"""


def test_spectrum_and_retardation_are_tables(tmp_path):
    text = GROWTH.replace("cycle = { min = 0.1, max = 1.0 }", SPECTRUM)
    case = xc.read_case(written(tmp_path, text))
    spectrum = case.growth["cycle"]
    assert (spectrum.unit, spectrum.least_range) == ("flight", 0.2)
    assert spectrum.cycles["max"].tolist() == [1.0, 0.9, 0.6]
    assert case.growth["retardation"] == xc.wheeler(1.2, xc.plastic_zone(350.0, beta=2))
    given = {**case.growth, "max_steps": 2}
    first = [given.pop(name) for name in ("law", "criterion", "cycle", "da")]
    assert xc.collect(xc.grow(case.problem, *first, **given)).life > 0
    (tmp_path / "gusts.txt").write_text("0 1\n1 2\n0.5 3\n0.9 4\n")
    lines = """
[growth.spectrum]
kind = "file"
path = "gusts.txt"
column = 0
levels = 5
[[growth.spectrum.steady]]
kind = "traction"
where = "top"
value = [0.0, "-5 MPa"]
[growth.retardation]
kind = "willenborg"
shutoff = 2.5
dK_th = "2 MPa*sqrt(m)"
zone = { sigma_y = 350, beta = 2 }
"""
    cut = GROWTH.replace("cycle = { min = 0.1, max = 1.0 }", "") + lines
    growth = xc.read_case(written(tmp_path, cut)).growth
    assert growth["cycle"].factors.tolist() == [0.0, 1.0, 0.5, 0.9]
    assert growth["cycle"].levels == 5
    assert growth["cycle"].steady[0].where == "top"
    assert growth["retardation"].dK_th == pytest.approx(2 * np.sqrt(1000))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("w = 1.2, ", "", "line 4.*retardation: the key 'w' of 'wheeler' is missing"),
        ('kind = "wheeler"', 'kind = "walker"', "known are wheeler, willenborg"),
        (', zone = { sigma_y = "0.35 GPa", beta = 2 }', "", "the key 'zone' is missing"),
        ("factors = [0.0, 1.0, 0.4, 0.9, 0.0, 0.6]", "factors = [1.0, 1.0]", "do not vary"),
        ("least_range", "least", "no such key of 'factors': did you mean"),
        ("unit = ", "levels = 1, unit = ", "levels"),
        ("retardation", "cycle = { min = 0, max = 1 }\nretardation", "not both"),
    ],
)
def test_messages_of_spectra(tmp_path, old, new, words):
    text = GROWTH.replace("cycle = { min = 0.1, max = 1.0 }", SPECTRUM.replace(old, new))
    with pytest.raises(xc.ProblemError, match=words):
        xc.read_case(written(tmp_path, text))


def test_run_in_a_folder_begins_goes_on_and_reads(tmp_path):
    """The same call: a new run, one that lost its last step, one that has ended, one step more."""
    given = (script(), xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0.1, 1.0), 2.0)
    options = {"progress": False, "max_steps": 2}
    folder = tmp_path / "run"
    whole = xc.run(folder, *given, **options)
    direct = xc.collect(xc.grow(*given, **options))
    assert whole.table().tobytes() == direct.table().tobytes()
    before = (folder / "step_00001.npz").stat().st_mtime_ns
    assert xc.run(folder, *given, **options).table().tobytes() == whole.table().tobytes()
    assert (folder / "step_00001.npz").stat().st_mtime_ns == before
    (folder / "step_00001.npz").unlink()
    assert xc.run(folder, *given, **options).table().tobytes() == whole.table().tobytes()
    enough = xc.run(folder, *given, until=lambda step: True, **options)
    assert enough.ended == "until was true at step 1"
    with pytest.raises(xc.ProblemError, match="was made with other settings"):
        xc.run(folder, *given[:4], 1.5, **options)
    begun = xc.run(folder, *given[:4], 1.5, overwrite=True, progress=False, max_steps=1)
    assert len(begun.steps) == 1


def test_what_run_refuses(tmp_path):
    path = written(tmp_path, PLATE)
    with pytest.raises(xc.ProblemError, match="da, max_steps without a problem"):
        xc.run(path, da=1.0, max_steps=3)
    with pytest.raises(xc.ProblemError, match="keep_solutions without a problem"):
        xc.run(path, keep_solutions=False)
    with pytest.raises(xc.ProblemError, match="a case file is given alone"):
        xc.run(path, script(), xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0.1, 1.0), 2.0)
    with pytest.raises(xc.ProblemError, match="resumed belongs to a case file"):
        xc.run(tmp_path / "run", script(), resumed=True)
    with pytest.raises(xc.ProblemError, match="law = None"):
        xc.run(tmp_path / "run", script(), progress=False)


def test_keys_can_be_changed(tmp_path):
    """By their place: tables of a list and entries of an array are counted from 0."""
    file = tmp_path / "case.toml"
    file.write_text(SWEPT, encoding="utf-8")
    changes = {"cracks.0.points.1.0": 8.0, "loads.0.value.1": "100 MPa", "title": "Other"}
    case = xc.read_case(file, changes)
    assert case.problem.cracks[0].points[1].tolist() == [8.0, 1.0]
    assert np.asarray(case.problem.loads[0].value).tolist() == [0.0, 100.0]
    assert case.title == "Other"
    for changes, words in (
        ({"crack.0.points": 3}, "the file has no 'crack'; it has title"),
        ({"cracks.1.points": 3}, "a list of 1, counted from 0"),
        ({"title.x": 3}, "'Strip', which has no parts"),
        ({"material.bulk": 3}, "there is no such key"),
    ):
        with pytest.raises(xc.ProblemError, match=words):
            xc.read_case(file, changes)


@pytest.mark.drawn
def test_sweep_is_one_table_and_one_picture(tmp_path, capsys):
    """Lives of a sweep are those of runs one by one; failures are rows; it goes on where it was."""
    file = tmp_path / "case.toml"
    file.write_text(SWEPT, encoding="utf-8")
    words = ["sweep", str(file), "--set", "cracks.0.points.1.0=4,30", "--set", "growth.law.m=2.9"]
    with pytest.warns(xc.XcrackWarning, match="1 of 2 cases failed"):
        assert main(words) == 1
    out = capsys.readouterr().out
    assert "2 cases in" in out
    assert "1 failed with ProblemError: the cracks cut the body" in out
    folder = tmp_path / "case_sweep"
    rows = (folder / "sweep.csv").read_text().splitlines()
    assert rows[0].startswith("cracks.0.points.1.0,growth.law.m,life,steps,ended,folder")
    assert (folder / "sweep.png").stat().st_size > 5e3
    changes = {"cracks.0.points.1.0": 4, "growth.law.m": 2.9}
    case = xc.read_case(file, changes)
    life = xc.collect(xc.grow(case.problem, **{**case.growth, "progress": False})).life
    assert float(rows[1].split(",")[2]) == life
    assert xc.load(folder / rows[1].split(",")[5]).life == life  # as report and life take it
    stamp = {path: path.stat().st_mtime_ns for path in folder.glob("row_*")}
    with pytest.warns(xc.XcrackWarning, match="1 of 2"):
        xc.sweep(file, {key: [v] if key != "cracks.0.points.1.0" else [4, 30]
                        for key, v in changes.items()})  # fmt: skip
    assert stamp == {path: path.stat().st_mtime_ns for path in folder.glob("row_*")}
    assert main(["sweep", str(file), "--set", "radius"]) == 2
    assert "give a key of the file and its values" in capsys.readouterr().err
    with pytest.raises(xc.ProblemError, match="a list is empty"):
        xc.sweep(file, {"title": []})


def test_sweep_of_solutions(tmp_path):
    """K of each state, with units in the values."""
    file = tmp_path / "case.toml"
    text = SWEPT.partition("[growth]")[0] + "[solve]\nstates = [0.5, 1.0]\n"
    file.write_text(text, encoding="utf-8")
    rows = xc.sweep(
        file, {"loads.0.value.1": ["80 MPa", "80000 kPa"]}, folder=tmp_path / "s"
    ).table()
    assert rows["K_I in state 1"][0] == pytest.approx(2 * rows["K_I in state 0"][0])
    assert rows["K_I in state 1"][1] == pytest.approx(rows["K_I in state 1"][0], rel=1e-12)


SWEPT = STRIP + STRIP_PULL + STRIP_GROWTH
