"""Notebooks: cards, pictures inline and once, progress, tables of pandas, a kernel interrupt."""

import re
import sys
import types
from xml.etree import ElementTree

import numpy as np
import pytest

import xcrack as xc

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def plate():
    loads = [xc.traction("top", (0.0, 80.0)), xc.traction("bottom", (0.0, -80.0))]
    crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
    steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
    return xc.Problem(xc.box((-1, -1), (1, 1), 12), steel, [crack], loads=loads, order=1)


def grown(**options):
    given = {"da": 0.2, "max_steps": 2, "progress": False, **options}
    return xc.collect(
        xc.grow(plate(), xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0, 1), **given)
    )


def test_cards_are_html_of_the_numbers():
    solution, history = xc.solve(plate()), grown()
    sif = xc.stress_intensity(solution)
    for value, words in (
        (plate(), "traction(&#x27;top&#x27;)"),
        (solution, f"{solution.n_dof}"),
        (sif, f"{sif.K_I[0]:.6g}"),
        (history, f"{history.life:.6g}"),
        (history.steps[0], f"{history.steps[0].dK_eq[0][0]:.6g}"),
        (solution.report, "Heaviside functions"),
    ):
        text = value._repr_html_()
        assert words in text
        ElementTree.fromstring(f"<div>{text}</div>")  # every element is closed


def test_a_sketch_shows_body_and_cracks():
    problem = plate()
    root = ElementTree.fromstring(problem.sketch())
    paths = [path.attrib["d"] for path in root]
    assert len(paths) == 2
    assert paths[0].count("M") == len(problem.mesh.boundary)
    numbers = np.array(re.findall(r"[\d.]+", paths[1]), dtype=float).reshape(-1, 2)
    assert len(numbers) == 2  # of a crack with one segment
    assert numbers.min() > 0
    solid = xc.Problem(xc.box((0, 0, 0), (1, 1, 1), 2), xc.Isotropic(1.0, 0.3))
    paths = ElementTree.fromstring(solid.sketch())
    assert paths[0].attrib["d"].count("M") == 12


@pytest.fixture
def notebook(monkeypatch):
    """What IPython looks like from a cell."""
    module = types.ModuleType("IPython")
    module.version_info = (8, 24, 0)  # matplotlib looks at it
    module.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", module)


def test_figures_are_handed_back_and_not_shown_too(notebook, monkeypatch):
    """The cell shows its last value; a figure of pyplot would be shown at its end once more."""
    from matplotlib import pyplot

    monkeypatch.setattr(pyplot, "show", lambda: pytest.fail("shown twice"))
    solution, history = xc.solve(plate()), grown()
    for figure in (
        xc.plot(solution, renderer="matplotlib"),
        xc.plot(solution, "opening"),
        history.plot("a"),
        history.plot("path"),
    ):
        assert type(figure).__name__ == "Figure"
        assert not pyplot.get_fignums()


@pytest.mark.plot
def test_a_picture_of_pyvista_is_png(notebook, tmp_path):
    picture = xc.plot(xc.solve(plate()), renderer="pyvista")
    assert picture._repr_png_().startswith(b"\x89PNG")
    assert picture.save(tmp_path / "a.png").read_bytes() == picture.data


def test_tables_of_pandas(monkeypatch):
    class Frame(dict):
        pass

    module = types.ModuleType("pandas")
    module.DataFrame = lambda values: values
    monkeypatch.setitem(sys.modules, "pandas", module)
    history, sif = grown(), xc.stress_intensity(xc.solve(plate()))
    assert history.to_pandas().tobytes() == history.table().tobytes()
    columns = sif.to_pandas()
    assert list(columns)[:6] == ["front", "s", "x", "y", "K_I", "K_II"]
    assert columns["K_II"].tolist() == sif.K_II.tolist()
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(xc.XcrackError, match=r"History.to_pandas needs the package pandas"):
        history.to_pandas()


def test_progress_is_a_bar_where_there_is_tqdm(notebook, monkeypatch, capsys):
    seen = []

    class Bar:
        def __init__(self, **options):
            seen.append(("new", options["total"]))

        def set_postfix_str(self, text):
            seen.append(("text", text))

        def update(self):
            seen.append(("update",))

        def close(self):
            seen.append(("close",))

    auto = types.ModuleType("tqdm.auto")
    auto.tqdm = Bar
    monkeypatch.setitem(sys.modules, "tqdm", types.ModuleType("tqdm"))
    monkeypatch.setitem(sys.modules, "tqdm.auto", auto)
    grown(progress=True)
    assert [entry[0] for entry in seen] == ["new", "text", "update", "text", "update", "close"]
    assert "growth ended" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    grown(progress=True)
    assert capsys.readouterr().err.startswith("step    0")


def test_steps_go_to_the_log(caplog):
    with caplog.at_level("INFO", "xcrack"):
        grown()
    assert [record.message.split()[0] for record in caplog.records] == ["step", "step", "growth"]


NOTEBOOK = """\
import xcrack as xc, warnings
warnings.simplefilter("ignore")
steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
loads = [xc.traction("top", (0.0, 80.0)), xc.traction("bottom", (0.0, -80.0))]
problem = xc.Problem(xc.box((-1, -1), (1, 1), 12), steel, [crack], loads=loads, order=1)
problem
#%%
solution = xc.solve(problem)
xc.plot(solution, renderer="matplotlib")
#%%
xc.stress_intensity(solution)
#%%
import os, signal
def grow():
    for step in xc.grow(problem, xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0, 1), da=0.1,
                        max_steps=6):
        yield step
        if step.index == 1:
            os.kill(os.getpid(), signal.SIGINT)
history = xc.collect(grow())
print(len(history.steps), history.ended)
#%%
history.plot("a")
#%%
history
"""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_notebook(tmp_path):
    """Executed by a kernel: pictures inline and once, tables, an interrupt that loses no step."""
    nbformat = pytest.importorskip("nbformat", reason="notebook not available: no nbformat")
    nbclient = pytest.importorskip("nbclient", reason="notebook not available: no nbclient")
    pytest.importorskip("ipykernel", reason="notebook not available: no ipykernel")
    cells = [nbformat.v4.new_code_cell(source) for source in NOTEBOOK.split("#%%\n")]
    book = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(book, timeout=300).execute(cwd=str(tmp_path))

    def kinds(k, mime):
        return [o for o in book.cells[k].outputs if mime in o.get("data", {})]

    assert len(kinds(0, "text/html")) == 1
    for k in (1, 4):
        assert len(kinds(k, "image/png")) == 1, book.cells[k].outputs
    for k in (2, 5):
        assert "<table>" in kinds(k, "text/html")[0]["data"]["text/html"]
    text = "".join(o.get("text", "") for o in book.cells[3].outputs if o.get("name") == "stdout")
    assert re.search(r"^[2-5] interrupted after step", text, re.MULTILINE), text
