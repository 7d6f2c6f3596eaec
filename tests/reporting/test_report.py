"""Reports: what they hold, that they need no network, and how they look in a browser."""

import base64
import json
import re
import shutil
import signal
import subprocess
import warnings
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser

import matplotlib.image
import numpy as np
import pytest

import xcrack as xc
from xcrack.view import report as reporting
from xcrack.view.report_viewer import packed_layers

STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
pytestmark = [
    pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning"),
    pytest.mark.usefixtures("blank_pictures"),
]


@pytest.fixture(autouse=True)
def _by_matplotlib(monkeypatch, request):
    """No renderer where a test does not ask for one: quick, and the same everywhere."""
    if not request.node.get_closest_marker("plot"):
        monkeypatch.setattr("xcrack.view.pyvista.can_render", lambda: False)


def plate():
    loads = [xc.traction("top", (0.0, 80.0)), xc.traction("bottom", (0.0, -80.0))]
    crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
    return xc.Problem(xc.box((-1, -1), (1, 1), 12), STEEL, [crack], loads=loads, order=1)


def block():
    loads = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]
    crack = xc.penny_crack((0.0, 0.0, 0.04), (0.3, 0, 1), 0.5, n=32)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 6)
    return xc.Problem(mesh, xc.Isotropic(E=210e3, nu=0.3), [crack], loads=loads, order=1)


def growth(problem, path=None, **options):
    given = {"da": 0.2, "max_steps": 3, "progress": False, **options}
    law = xc.elber(C=1e-11, m=3, a=0.5, b=0.4)
    return xc.collect(xc.grow(problem, law, xc.max_hoop_stress, xc.Cycle(-1, 1), **given), path)


@cache
def penny():
    return xc.solve(block())


class Reader(HTMLParser):
    """Links, anchors, pictures and the nesting of a page."""

    EMPTY = frozenset({"meta", "link", "img", "input", "br", "!doctype"})

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.links, self.pictures = [], [], [], []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [given[k] for k in ("href", "src") if k in given]
        self.pictures += [given["src"]] if tag == "img" else []
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def read(path):
    """A page, checked: well formed, anchors there, nothing from elsewhere, pictures whole."""
    text = path.read_text(encoding="utf-8")
    reader = Reader()
    reader.feed(text)
    assert not reader.open
    assert len(reader.ids) == len(set(reader.ids))
    for link in reader.links:
        if link.startswith("#"):
            assert link[1:] in reader.ids
        else:
            assert link.startswith("data:"), link
    for picture in reader.pictures:
        data = base64.b64decode(picture.partition(",")[2])
        assert data.startswith(b"\x89PNG")
    assert len(text) < 15e6
    numbers = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    return text, reader, numbers


@pytest.mark.drawn
def test_report_of_a_solution(tmp_path):
    solutions = xc.solve(plate(), [1.0, -1.0])
    path = xc.report(solutions, tmp_path / "new" / "plate", title="A <plate>", yield_stress=300.0)
    assert path == tmp_path / "new" / "plate.html"
    text, reader, numbers = read(path)
    assert "A &lt;plate&gt;" in text
    assert len(reader.pictures) - 1 == len(numbers["pictures"]["drawn"]) >= 4  # one stands first
    sif = xc.stress_intensity(solutions[0])
    rows = numbers["K"]["rows"]
    assert [row["K_I"] for row in rows[:2]] == sif.K_I.tolist()
    assert [row["closed"] for row in rows] == [False, False, True, True]
    closed = [row["closed share"] for row in numbers["contact"]["rows"]]
    assert closed[0] == 0.0
    assert closed[1] > 0.9
    assert "(0, 160)" in text  # resultant of 80 over the width of 2, in the last state reversed
    zone = next(note for note in numbers["assumptions"]["validity"] if "Plastic zone" in note)
    largest = float(re.search(r"for the largest K ([\d.]+):", zone)[1])
    K_eq = xc.max_hoop_stress(np.stack([0 * sif.K, sif.K]), 0.3)[1]
    assert largest == pytest.approx(K_eq.max(), rel=1e-5)  # digits in the text
    assert f"of {(largest / 300) ** 2 / (6 * np.pi):.3g}" in zone  # plane strain
    ingredients = numbers["assumptions"]["ingredients"]
    assert set(ingredients) == {row.name for row in solutions[0].report.ingredients}
    assert numbers["again"]["hashes"].keys() == {"mesh", "cracks"}


def test_report_of_a_run_and_of_its_folder(tmp_path):
    history = growth(plate(), tmp_path / "run")
    text, _, numbers = read(xc.report(history, tmp_path / "run.html"))
    sources = numbers["growth"].pop("error of cycles")
    assert sources["steps"] == history.life_bar.steps
    assert sources["K"] == "nan"  # no tolerance was asked for
    assert numbers["growth"] == {"steps": 3, "cycles": history.life, "ended": history.ended,
                                 "whole": True}  # fmt: skip
    table = history.table()
    assert numbers["table"]["columns"] == list(table.dtype.names)
    coded = re.search(r"data:text/csv;base64,([^\"]+)", text)[1]
    lines = base64.b64decode(coded).decode().splitlines()
    assert len(lines) == 1 + len(table)
    assert float(lines[1].split(",")[lines[0].split(",").index("a")]) == table["a"][0]
    # Pressed together in one state, and a law that has a share of the range: said.
    assert any("counted twice" in note for note in numbers["assumptions"]["validity"])
    assert numbers["again"]["settings"]["law"] == "elber"
    again = read(xc.report(tmp_path / "run", tmp_path / "again.html"))[2]
    assert again["table"] == numbers["table"]
    assert again["K"] == numbers["K"]
    assert again["growth"]["whole"] is True


def test_report_of_a_life_and_of_bars(tmp_path):
    """The numbers are those of `xc.life` and of `SIF.bar`."""
    law = xc.elber(C=1e-11, m=3, a=0.5, b=0.4)
    history = growth(plate())
    scatter = xc.Scatter(C=xc.lognormal(0.3), load=xc.lognormal(0.05))
    life = xc.life(history, law, scatter=scatter, samples=2000, seed=811)
    unknown = replace(life, bounds={**life.bounds, "steps": np.nan})
    text, _, numbers = read(xc.report(history, tmp_path / "life.html", life=unknown))
    assert "not known" in text
    assert numbers["life"]["quantiles"]["50"] == life.percentile(50)
    assert numbers["life"]["scatter"].keys() == life.scatter.keys()
    solution = xc.solve(plate())
    sif = xc.stress_intensity(solution)
    text, _, numbers = read(xc.report(solution, tmp_path / "bars.html"))
    for k, row in enumerate(numbers["K"]["rows"]):
        if np.isfinite(sif.bar[k, 0]):
            assert row["± K_I"] == sif.bar[k, 0]
            assert row["best K_I"] == sif.best[k, 0]
        else:
            assert row["± K_I"] == "nan"
            assert sif.reasons[k] in text
    with pytest.raises(xc.ProblemError, match=r"give what xc.life returns"):
        xc.report(solution, tmp_path / "bars.html", life=3)


def edge(**options):
    loads = [xc.traction("top", (0.0, 80.0)), xc.traction("bottom", (0.0, -80.0))]
    crack = xc.line_crack([(-1, 0.07), (-0.4, 0.07)])
    problem = xc.Problem(xc.box((-1, -1), (1, 1), 8), STEEL, [crack], loads=loads, order=1)
    steps = xc.grow(problem, xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0, 1), da=0.2,
                    max_steps=3, progress=False)  # fmt: skip
    return xc.collect(steps, **options)


def test_report_of_looks_and_of_strength(tmp_path):
    """The numbers are those of `xc.inspection` and of `xc.residual_strength`."""
    history = edge()
    pod = xc.logistic_pod(0.7, 0.3)
    look = xc.inspection(history, interval=0.3 * history.life, pod=pod)
    rows = xc.residual_strength(history, nu=0.3, K_c=200.0)
    file = tmp_path / "safe.html"
    text, _, numbers = read(xc.report(history, file, inspection=look, strength=rows))
    assert numbers["inspection"]["a"] == look.a.tolist()
    assert numbers["inspection"]["missed"] == look.missed
    assert numbers["strength"]["by_toughness"] == rows["by_toughness"].tolist()
    assert "by_collapse" not in numbers["strength"]
    assert "The largest load breaks the body from step" in text or "the body bears" in text
    with pytest.raises(xc.ProblemError, match=r"give what xc.inspection returns"):
        xc.report(history, file, inspection=3)
    with pytest.raises(xc.ProblemError, match=r"give what xc.residual_strength returns"):
        xc.report(history, file, strength=np.zeros(3))


def test_a_half_written_run_is_reported(tmp_path):
    growth(plate(), tmp_path / "run")
    header = tmp_path / "run" / "run.json"
    header.write_text(json.dumps({**json.loads(header.read_text()), "ended": ""}))
    (tmp_path / "run" / "step_00001.npz").write_bytes(b"half")
    text, _, numbers = read(xc.report(tmp_path / "run", tmp_path / "half.html"))
    assert not numbers["whole"]
    assert numbers["growth"]["steps"] == 1
    assert "This run is not finished" in text
    assert "xc.resume" in text
    assert any("step_00001.npz is not whole" in m for m in numbers["warnings"]["messages"])


@pytest.mark.slow
def test_report_of_a_run_in_space(tmp_path):
    history = growth(block(), da=0.3, max_steps=2)
    text, _, numbers = read(xc.report(history, tmp_path / "growth.html"))
    assert numbers["view"]["layers"] == 6  # body and its edges; surface and front of each step
    data = json.loads(re.search(r'id="view-data">(.*?)</script>', text, re.DOTALL)[1])
    assert [layer["step"] for layer in data["layers"]] == [-1, -1, 0, 0, 1, 1]
    corners = np.frombuffer(base64.b64decode(data["layers"][0]["places"]), "<u2").reshape(-1, 3)
    mesh = block().mesh
    x = mesh.points[mesh.boundary].reshape(-1, 3)
    assert len(corners) == len(x)
    assert corners / 65535 * data["extent"] - 1 == pytest.approx(x, abs=2e-5)  # of 16 bits


def test_too_much_is_left_out_and_named(monkeypatch, tmp_path):
    monkeypatch.setattr("xcrack.view.report_viewer.MOST", 10)
    text, _, numbers = read(xc.report(penny(), tmp_path / "large.html"))
    assert numbers["view"] == {"layers": 0}
    assert "too much for a page" in text
    assert packed_layers([]) is None
    # What cannot be drawn without a renderer is named.
    assert any("Mesh" in words for words in numbers["pictures"]["missing"])


def test_a_section_of_ones_own(monkeypatch, tmp_path):
    """How later features add theirs."""
    from xcrack.base.markup import element
    from xcrack.view.report_source import Section

    def own(source):
        return Section("own", "Own", element("p", f"{len(source.cracks)} crack"), {"n": 1})

    monkeypatch.setattr(reporting, "SECTIONS", (*reporting.SECTIONS, own))
    text, _, numbers = read(xc.report(xc.solve(plate()), tmp_path / "own.html"))
    assert "<p>1 crack</p>" in text
    assert numbers["own"] == {"n": 1}


def test_body_without_crack(tmp_path):
    problem = xc.Problem(xc.box((-1, -1), (1, 1), 4), STEEL, loads=plate().loads)
    _, _, numbers = read(xc.report(xc.solve(problem), tmp_path / "plain.html"))
    assert "K" not in numbers
    assert "contact" not in numbers


def test_misuse_says_what_to_give(tmp_path):
    solution = penny()
    for call, words in (
        (lambda: xc.report(3, tmp_path / "a.html"), "takes a Solution or a list of them"),
        (lambda: xc.report([], tmp_path / "a.html"), "takes a Solution or a list of them"),
        (lambda: xc.report(tmp_path, tmp_path / "a.html"), "holds no run"),
        (lambda: xc.report(solution, 3), "is not a path"),
        (lambda: xc.report(solution, tmp_path / "a.html", yield_stress=-1), "yield_stress"),
        (lambda: xc.report(solution, tmp_path / "a.html", title=3), "give a text"),
    ):
        with pytest.raises(xc.ProblemError, match=words):
            call()
    (tmp_path / "folder.html").mkdir()
    with pytest.raises(xc.ProblemError, match="cannot be written"):
        xc.report(xc.solve(plate()), tmp_path / "folder.html")


CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)


@pytest.mark.drawn
@pytest.mark.slow
@pytest.mark.plot
@pytest.mark.skipif(not CHROMIUM, reason="browser not available: no chromium")
@pytest.mark.parametrize("kind", ["solution", "growth", "plane"])
def test_report_in_a_browser(kind, tmp_path):
    """No error on the console of the page, every picture shown, the view drawn."""
    makers = {"solution": penny, "growth": lambda: growth(block(), da=0.3, max_steps=2),
              "plane": lambda: xc.solve(plate(), [1.0, -1.0])}  # fmt: skip
    page = xc.report(makers[kind](), tmp_path / "report.html")
    _, reader, _ = read(page)
    # Says in the title how many pictures were decoded and layers drawn, for the dump below.
    probe = (
        "<script>window.addEventListener('load', () => { const c = document.getElementById("
        "'view-canvas'); document.title = 'pictures ' + [...document.images].filter(i => "
        "i.naturalWidth > 0).length + ' drawn ' + (c ? c.dataset.drawn : 'none'); });</script>"
    )
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", probe + "</body>"), "utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--enable-unsafe-swiftshader",
               "--enable-logging=stderr", "--virtual-time-budget=8000", "--hide-scrollbars",
               f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1200,1100"]  # fmt: skip
    run = subprocess.run([*command, "--dump-dom", page.as_uri()], capture_output=True, text=True,
                         timeout=120, check=True)  # fmt: skip
    console = [line for line in run.stderr.splitlines() if ":CONSOLE:" in line]
    assert not [line for line in console if "GL Driver Message" not in line], console
    title = re.search(r"<title>(.*?)</title>", run.stdout)[1]
    drawn = {"solution": r"[3-9]", "growth": r"4", "plane": "none"}[kind]
    assert re.fullmatch(rf"pictures {len(reader.pictures)} drawn {drawn}", title), title
    shot = tmp_path / "shot.png"
    subprocess.run([*command, f"--screenshot={shot}", page.as_uri()], capture_output=True,
                   timeout=120, check=True)  # fmt: skip
    image = matplotlib.image.imread(shot)[..., :3]
    if kind != "plane":  # colours are those of the view alone, above the pictures
        coloured = np.ptp(image[400:], axis=2) > 0.15
        assert coloured.mean() > 0.002


def test_a_stored_run_keeps_its_warnings(tmp_path):
    """A report of the folder lists what the run warned of, step by step; an old one says so."""
    crack = xc.line_crack([(-1.1, 0.02), (-0.7, 0.02)])  # two cells long: K warns
    problem = xc.Problem(plate().mesh, STEEL, [crack], loads=plate().loads, order=1)
    history = growth(problem, tmp_path / "run")
    read_again = xc.load(tmp_path / "run")
    assert history.warnings
    assert all(step.warnings is not None for step in history.steps)
    assert read_again.warnings == history.warnings
    assert [step.warnings for step in read_again.steps] == [s.warnings for s in history.steps]
    page = xc.report(tmp_path / "run", tmp_path / "r.html").read_text(encoding="utf-8")
    assert f"Warnings ({sum(history.warnings.values())})" in page
    steps = tuple(replace(step, warnings=None, solutions=()) for step in history.steps)
    old = replace(history, steps=steps)
    assert "hold no warnings of K" in xc.report(old, tmp_path / "o.html").read_text("utf-8")


def test_cracks_are_measured(tmp_path):
    """A mouth with its set, in the page and in the numbers; a crack inside has no depth."""
    crack = xc.line_crack([(-1.1, 0.02), (-0.4, 0.02)])
    inside = xc.line_crack([(0.2, -0.5), (0.6, -0.45)])
    problem = xc.Problem(plate().mesh, STEEL, [crack, inside], loads=plate().loads, order=1)
    page = xc.report(xc.solve(problem), tmp_path / "r.html").read_text(encoding="utf-8")
    assert "left: length 0, depth 0.6" in page
    text = (tmp_path / "r.json").read_text(encoding="utf-8")
    numbers = json.loads(text, parse_constant=lambda name: pytest.fail(name))
    (own,) = (v for v in _all(numbers, "measures"))
    assert own[0]["depth"] == pytest.approx(0.6)
    assert own[0]["ends"][0]["name"] == "left"
    assert own[1]["depth"] is None


def _all(value, key):
    if isinstance(value, dict):
        if key in value:
            yield value[key]
        for each in value.values():
            yield from _all(each, key)
    elif isinstance(value, list):
        for each in value:
            yield from _all(each, key)


def test_the_length_of_a_crack_is_that_in_the_body(tmp_path):
    crack = xc.line_crack([(-0.3, 0.3), (4, 0.3)])
    loads = [xc.traction("top", (0, 80.0)), xc.traction("bottom", (0, -80.0))]
    problem = xc.Problem(xc.box((0, -20), (20, 20), (20, 40)), STEEL, [crack], loads=loads)
    text, _, _ = read(xc.report(xc.solve(problem), tmp_path / "r.html"))
    assert re.findall(r"length ([\d.]+)", text)[0] == "4"


def test_spectrum_and_retardation_have_a_section(tmp_path):
    """Unit, levels, model and its zones."""
    spectrum = xc.Spectrum([0.0, 1.0, *[0.0, 0.5] * 20], unit="flight")
    model = xc.wheeler(1.5, xc.plastic_zone(400.0, beta=2))
    law = xc.paris(C=1e-9, m=3.0)
    options = {"da": 0.2, "max_steps": 2, "progress": False, "retardation": model}
    path = tmp_path / "run"
    xc.collect(xc.grow(plate(), law, xc.max_hoop_stress, spectrum, **options), path)
    page = xc.report(path, tmp_path / "report.html").read_text(encoding="utf-8")
    section = json.loads((tmp_path / "report.json").read_text())["spectrum"]
    assert section["unit"] == "flight"
    text = " ".join(re.sub(r"<[^>]+>", " ", (tmp_path / "report.html").read_text()).split())
    assert "flights N at the last step" in text
    assert "R of the cycles of each flight is 0 to 0" in text
    assert "factors 42 numbers" in text
    assert "largest range 1" in text
    assert xc.load(path).unit == "flight"
    labels = [axes.get_xlabel() for axes in xc.load(path).plot("a", tmp_path / "a.png").axes]
    assert labels == ["flights N"]
    assert section["levels"] == [0.0, 1.0]
    assert section["retardation"] == "wheeler"
    (zone,) = section["zones"]
    assert zone["places"] == 2
    for words in ("Load history", "repetitions at the last step", "What overloads have left"):
        assert words in page


def test_an_older_page_outlives_a_full_disk(tmp_path):
    """A limit on the size of files stands for a full disk."""
    resource = pytest.importorskip("resource")
    solution = xc.solve(plate())
    page = xc.report(solution, tmp_path / "r.html")
    older = page.read_bytes(), page.with_suffix(".json").read_bytes()
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(older[0]) - 20_000, limits[1]))
    try:
        with pytest.raises(xc.ProblemError, match=r"cannot be written to .*r\.html.*make room"):
            xc.report(solution, page)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert (page.read_bytes(), page.with_suffix(".json").read_bytes()) == older
    assert sorted(file.name for file in tmp_path.iterdir()) == ["r.html", "r.json"]


def test_a_plastic_zone_as_large_as_the_crack_is_a_warning(tmp_path):
    """(K/yield)²/6π of a far stress above yield, against the crack inside the body."""
    loads = [xc.traction("top", (0, 400.0)), xc.traction("bottom", (0, -400.0))]
    crack = xc.line_crack([(-3, 0.3), (4, 0.3)])
    problem = xc.Problem(xc.box((0, -20), (20, 20), (20, 40)), STEEL, [crack], loads=loads)
    solution = xc.solve(problem)
    words = r"over the length of its crack is .* does not hold"
    with pytest.warns(xc.XcrackWarning, match=words) as record:
        _, _, numbers = read(xc.report(solution, tmp_path / "r.html", yield_stress=345.0))
    K = np.abs(xc.stress_intensity(solution).K[:, :2]).max()
    share = re.search(r"its crack is ([\d.]+),", " ".join(str(each.message) for each in record))
    zone = (K / 345) ** 2 / (6 * np.pi)  # plane strain: a third of that of plane stress
    assert float(share[1]) == pytest.approx(zone / 4.0, rel=5e-3)  # K_II is next to nothing
    assert any("does not hold" in text for text in numbers["warnings"]["messages"])
    with warnings.catch_warnings():
        warnings.simplefilter("error", xc.XcrackWarning)
        xc.report(solution, tmp_path / "r.html", yield_stress=3450.0)


def test_first_page(tmp_path):
    """What is to be signed stands first, with units; margins that are lost and warnings are red."""
    problem = replace(plate(), material=replace(STEEL, yield_stress=90.0, K_c=150.0))
    history = growth(problem)
    strength = xc.residual_strength(history, nu=0.3, K_c=150.0, yield_stress=90.0)
    path = xc.report(history, tmp_path / "a.html", units="N, mm, MPa", strength=strength)
    text, reader, numbers = read(path)
    assert reader.ids[0] == "summary"
    page = numbers["summary"]
    assert page["life"].startswith(f"{history.life:.6g} cycles")
    assert page["material"] == (
        "E = 210000 MPa, nu = 0.3, plane = strain, yield_stress = 90 MPa, K_c = 150 MPa√mm"
    )
    assert page["growth law"] == "elber(C = 1e-11, m = 3, a = 0.5, b = 0.4)"
    assert page["crack 0 at first"] == "length 0.64257 mm"
    largest = max(abs(row["K_I"]) for row in numbers["K"]["rows"])
    assert float(page["largest K at the end"].split()[0]) == pytest.approx(largest, rel=0.05)
    summary = text[text.index('id="summary"') : text.index('id="scene"')]
    assert 'class="bad">plastic zone' in summary or "plastic zone" not in summary
    assert f'class="bad"><a href="#warnings">{numbers["summary"]["warnings"]} warning' in summary
    assert "K_I [MPa√mm]" in text
    assert "value = [0.0, 80.0] MPa" in text
    assert "None" not in summary
    assert not re.search(r"\d\.\d{10}", summary)
    assert "sha256" not in summary


def test_units_of_a_report(tmp_path):
    for units, words in (
        ("mm", "give force, length and stress"),
        ("N, mm, psi", "consistent"),
        ("N, ell, MPa", "known are"),
        (3, "give force, length and stress"),
    ):
        with pytest.raises(xc.ProblemError, match=words):
            xc.report(xc.solve(plate()), tmp_path / "a.html", units=units)


def test_load_history_is_drawn(tmp_path):
    """Factors and counts of a spectrum as a picture, its name on the axes, no hash in the table."""
    spectrum = xc.Spectrum([0.0, 1.0, 0.4, 0.6] * 5, unit="flight")
    law = xc.paris(1e-11, 3)
    run = xc.collect(xc.grow(plate(), law, xc.max_hoop_stress, spectrum, da=0.1, max_steps=2,
                             progress=False))  # fmt: skip
    text, reader, numbers = read(xc.report(run, tmp_path / "a.html", spectrum=spectrum))
    assert len(reader.pictures) == len(numbers["pictures"]["drawn"]) + 2
    part = text[text.index('id="spectrum"') : text.index('id="K"')]
    assert "20 numbers" in part
    assert "sha256" not in part
    assert "R of the cycles of each flight is 0 to 0.667" in text  # of 0 to 1 and of .4 to .6
    assert "flights" in numbers["summary"]["life"]
    figure = xc.plot_spectrum(spectrum, file=tmp_path / "spectrum.png")
    assert "flight" in figure.axes[0].get_xlabel()
    with pytest.raises(xc.ProblemError, match="depend on K"):
        xc.plot_spectrum(xc.Spectrum(states=[0.0, 1.0], sequence=[0, 1]), file=tmp_path / "b.png")


@pytest.mark.drawn
@pytest.mark.parametrize("make", [plate, block])
def test_set_up_before_a_solve(make, tmp_path):
    """Loads, supports, cracks and their normals by name; nothing is solved."""
    problem = replace(make(), supports=[xc.fix("left", axis=0)])
    figure = problem.plot(tmp_path / "setup.png", title="before")
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words[:2] == ["traction('top')", "traction('bottom')"]
    assert "fix('left', axis=0)" in words
    assert any("normal" in word for word in words)
    names = {text.get_text() for text in figure.axes[0].texts}
    assert {"top", "bottom", "left", "right", "0"} <= names
    assert "boundary" not in names
    assert matplotlib.image.imread(tmp_path / "setup.png").std() > 0.01
