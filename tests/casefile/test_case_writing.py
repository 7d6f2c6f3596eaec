"""Scenes of Python as case files: the same problem to the last bit, or the reason why not.

The page of the verification book lists every case and example with what it is: data or not.
"""

import re
import runpy
import sys
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.case_texts import STRIP, STRIP_GROWTH, STRIP_PULL
from support.equality import same
from xcrack import grow, inf_sup, solve, stress_intensity  # kept where a scene finds others
from xcrack.verification.book.run import find_cases

TOP = Path(__file__).resolve().parents[2]
EXAMPLES = {path.stem: path for path in (TOP / "examples").glob("*.py")}
BOOK = {case.id: case for case in find_cases()}
HEADING = {"book": "Cases of the book", "examples": "Examples"}
LARGE = 80_000  # unknowns: more take over six seconds in 3D
ARGUMENTS = {
    "solve": ("problem", "states"),
    "adapt": ("problem", "tolerance"),
    "inf_sup": ("problem",),
    "grow": ("problem", "law", "criterion", "cycle", "da"),
}  # of the calls, in their order
FUNCTION, UNSOLVED, BODILESS = "a function of the place", "nothing is solved", "no body"


def listed(label: str) -> dict[str, str]:
    """Kind of each scene on the page, by its name: rows of a table."""
    page = (TOP / "docs" / "verification.md").read_text(encoding="utf-8")
    part = page.split(f"### {HEADING[label]}")[1].split("\n#")[0]
    rows = [row.strip("|").split("|") for row in part.splitlines() if row.startswith("|")][2:]
    return {
        name: kind.strip() for kind, names in rows for name in re.findall(r"`([\w.-]+)`", names)
    }


class Asked(BaseException):
    """What a scene asks first: to solve, to grow or to adapt."""


def asks(name, *arguments, **named):
    raise Asked(name, arguments, named)


def numbers_of(name: str, problem: xc.Problem, given: dict) -> list[np.ndarray]:
    """Displacements and K, K of two steps where cracks grow, or the constant of stability."""
    if name == "inf_sup":
        return [np.array(inf_sup(problem))]
    if name == "grow":
        steps = islice(grow(problem, **given, progress=False), 2)
        return [sif.K for step in steps for state in step.sif for sif in state]
    solutions = solve(problem, given.get("states"))
    states = solutions if isinstance(solutions, list) else [solutions]
    cracks = range(len(problem.cracks))
    K = [stress_intensity(solution, crack).K for solution in states for crack in cracks]
    return [solution.u for solution in states] + K


def unknowns(problem: xc.Problem) -> int:
    """About as many as the solve has: a point and its edges."""
    dim = problem.mesh.dim
    return len(problem.mesh.points) * dim * (1 if problem.order == 1 else {2: 4, 3: 8}[dim])


def without_curves(problem):
    """The scene but for the curves of its mesh: no file has functions, and a warning says so."""
    return replace(problem, mesh=replace(problem.mesh, curves={}))


def kind_of(call, folder: Path) -> str:
    """Whether the scene that a call asks for is data: its case file says and solves the same."""
    try:
        call()
    except Asked as asked:
        name, given, named = asked.args
        named = dict(zip(ARGUMENTS[name], given, strict=False)) | named
        named = {key: each for key, each in named.items() if key not in ("progress", "workers")}
        problem = named.pop("problem")
        try:
            xc.write_case(folder / "case.toml", problem, **named)  # it reads and compares it
        except xc.ProblemError as error:
            return FUNCTION if "is a function" in str(error) else str(error)
        case = xc.read_case(folder / "case.toml")
        assert same(without_curves(case.problem), without_curves(problem))
        if name != "adapt" and unknowns(problem) < LARGE:
            own = numbers_of(name, problem, named)
            other = numbers_of(name, case.problem, case.growth or {"states": case.states})
            assert [each.tobytes() for each in own] == [each.tobytes() for each in other]
        return "data"
    return UNSOLVED


def test_the_page_names_every_case_and_example():
    assert set(listed("book")) == set(BOOK)
    assert set(listed("examples")) == set(EXAMPLES)
    assert set(listed("book").values()) == {"data", FUNCTION, UNSOLVED, BODILESS}


@pytest.mark.slow
@pytest.mark.gmsh
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("name", BOOK)
def test_a_case_of_the_book_is_what_the_page_says(name, tmp_path, monkeypatch):
    case = BOOK[name]
    if case.needs:
        pytest.importorskip(case.needs)
    for module in [m for n, m in sys.modules.items() if n.startswith("xcrack.verification.book")]:
        for each in ("solve", "grow", "inf_sup"):
            if hasattr(module, each):
                monkeypatch.setattr(module, each, partial(asks, each))
    kind = BODILESS if not case.dim else kind_of(partial(case.run, 0), tmp_path)
    assert kind == listed("book")[name]


@pytest.mark.slow
@pytest.mark.gmsh
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_what_the_page_says(name, tmp_path, monkeypatch):
    pytest.importorskip("gmsh")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(EXAMPLES[name]), "--quick"])
    for each in ("solve", "grow", "adapt"):
        monkeypatch.setattr(xc, each, partial(asks, each), raising=False)
    monkeypatch.setattr(  # of a study the first case, in this process
        xc, "campaign", lambda case, cases, **_: case(**next(iter(cases))), raising=False
    )
    call = partial(runpy.run_path, str(EXAMPLES[name]), run_name="__main__")
    assert kind_of(call, tmp_path) == listed("examples")[name]


PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
CRACK = xc.line_crack([(0.0, 0.05), (0.4, 0.05)])
BODY = xc.box((0.0, -1.0), (1.0, 1.0), (10, 20))
IS_BEHIND = BODY.points[BODY.cells].mean(axis=1)[:, 0] > 0.5
BODY = xc.Mesh(
    BODY.points, BODY.cells, {k: f for k, f in BODY.facet_sets.items() if k != "boundary"},
    {"one": np.nonzero(~IS_BEHIND)[0], "two": np.nonzero(IS_BEHIND)[0]},
)  # fmt: skip


def plate(**given):
    scene = {"material": xc.Isotropic(1e5, 0.3, "strain"), "cracks": [CRACK], "loads": PULL}
    return xc.Problem(BODY, **scene | given)


@pytest.mark.parametrize(
    "growth",
    [
        {"law": xc.paris(1e-9, 3.0), "cycle": xc.Cycle(0.1, 1.0), "da": 0.05},
        {"law": xc.rate_table({0.0: ([1, 9], [1e-9, 1e-6]), 0.5: ([0.9, 8], [1e-9, 1e-6])}),
         "cycle": xc.Cycle(states=[0.0, [PULL[0], PULL[1]]]), "da": 0.05, "max_size": 0.8},
        {"law": xc.with_time(xc.walker(1e-9, 3.0, 0.5), xc.time_rate(1e-8, 2.0), 2.0),
         "cycle": xc.Cycle(0.0, 1.0), "tolerance": 0.05, "solver": xc.pardiso},
        {"law": xc.law("Al 7075-T6") if "Al 7075-T6" in xc.presets() else xc.paris(1e-9, 3),
         "cycle": xc.Spectrum([0.0, 1.0, 0.2, 0.8], unit="flight", steady=[PULL[0]], levels=3),
         "da": 0.05, "criterion": partial(xc.mean_reference, reference="max")},
        {"law": xc.paris(1e-9, 3.0), "cycle": xc.Spectrum(rows=[(0, 1, 2), (0.5, 1, 9)]),
         "da": 0.05, "load_program": xc.load_over_size([(0.3, 1.0), (0.6, 0.8)]),
         "link_up": xc.plastic_zone(400.0, 2)},
        {"law": xc.paris(1e-9, 3.0), "cycle": xc.Spectrum([0.0, 1.0, *[0.0, 0.5] * 9]), "da": 0.05,
         "retardation": xc.willenborg(2.5, 0.1, xc.plastic_zone(400.0, beta=2)), "K_c": 90.0},
    ],
    ids=["paris", "table", "time", "steady", "rows", "retardation"],
)  # fmt: skip
def test_growth_is_written_as_it_was_asked_for(growth, tmp_path):
    given = {"criterion": xc.max_hoop_stress, **growth}
    xc.write_case(tmp_path / "case.toml", plate(), **given)  # it compares both itself
    case = xc.read_case(tmp_path / "case.toml")
    assert set(case.growth) == set(given)
    assert same(case.growth["law"], given["law"])
    assert same(case.growth["cycle"], given["cycle"])


@pytest.mark.parametrize(
    "problem",
    [
        lambda: plate(supports=[xc.fix((1.0, -1.0)), xc.displacement("right", (None, 0.1))],
                      friction=(0.3,), contact="on", order=1),
        lambda: plate(loads=[xc.initial_stress([[1.0, 0.2], [0.2, 3.0]]), xc.crack_pressure(2.0, 0),
                             xc.temperature(50.0, 1e-5), xc.body_force((0.0, -1e-3))]),
        lambda: plate(numerics=xc.Numerics(radius=0.1, points=6),
                      handbook=[xc.handbook("edge", a=0.4, W=1.0, S=1.0)]),
        lambda: plate(material={"one": xc.Isotropic(1.0, 0.3, "strain"),
                                "two": xc.Isotropic(0.1, 0.3, "strain")}),
    ],
    ids=["supports", "loads", "numerics", "materials"],
)  # fmt: skip
def test_scenes_are_written_as_they_are(problem, tmp_path):
    given = problem()
    xc.write_case(tmp_path / "case.toml", given, title='A "plate"', states=[1.0, [PULL[0]]])
    case = xc.read_case(tmp_path / "case.toml")
    assert same(case.problem, given)
    assert [type(each) for each in case.problem.handbook] == [type(h) for h in given.handbook]
    assert case.title == 'A "plate"'
    assert case.states[0] == 1.0
    assert same(case.states[1], [PULL[0]])


def test_arms_and_fields_are_written(tmp_path, monkeypatch):
    import meshio

    monkeypatch.chdir(tmp_path)
    body = xc.box((-1, -1, -1), (1, 1, 1), 4)
    values = {"p": 1.0 + body.points[:, 0] ** 2}
    meshio.Mesh(body.points, [("tetra", body.cells)], point_data=values).write("field.vtu")
    one = xc.penny_crack((0, 0, 0.03), (0, 0, 1), 0.6, n=16)
    other = xc.penny_crack((0.02, 0, 0.03), (1, 0, 0), 0.4, n=16)
    problem = xc.Problem(
        body, xc.Isotropic(1.0, 0.3), [one, xc.arm(other, 0, 1)],
        loads=[xc.pressure("top", xc.read_field("field.vtu", "p"))],
    )  # fmt: skip
    xc.write_case("case.toml", problem)
    assert same(xc.read_case("case.toml").problem, problem)
    (tmp_path / "other").mkdir()
    xc.write_case("other/case.toml", problem)  # the field goes with it
    assert same(xc.read_case("other/case.toml").problem, problem)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (lambda: {"problem": plate(loads=[xc.traction("top", lambda x: 0 * x)])},
         "loads[0], traction('top'): value is a function"),
        (lambda: {"law": lambda dK, R: 1e-3 * dK}, "law is a function"),
        (lambda: {"criterion": lambda K, nu: None}, "criterion is a function"),
        (lambda: {"link_up": lambda K: 0 * K}, "link_up is a function"),
        (lambda: {"until": lambda step: True}, "until"),
        (lambda: {"states": [1.0]}, "leave states out"),
        (lambda: {"cycle": None}, "give all three"),
    ],
)  # fmt: skip
def test_what_is_no_data_is_refused_by_its_name(given, words, tmp_path):
    growth = {"problem": plate(), "law": xc.paris(1e-9, 3.0), "criterion": xc.max_hoop_stress,
              "cycle": xc.Cycle(0.0, 1.0), "da": 0.05}  # fmt: skip
    with pytest.raises(xc.ProblemError, match=re.escape(words)):
        xc.write_case(tmp_path / "case.toml", **growth | given())
    assert not (tmp_path / "case.toml").exists()


def strip_case(folder: Path, more: str) -> Path:
    file = folder / "case.toml"
    file.write_text(STRIP + STRIP_PULL + STRIP_GROWTH + more, encoding="utf-8")
    return file


def test_growth_ends_where_cracks_are_on_named_sets(tmp_path):
    """The edge crack is on the left side from the first step on, and never on the right one."""
    file = strip_case(tmp_path, 'until = "left"\n')
    case = xc.read_case(file)
    history = xc.run(file)
    assert len(history.steps) == 1
    assert history.ended == "cracks are on left at step 0"
    steps = xc.grow(case.problem, **case.growth)
    assert len(xc.collect(steps, until=["left", "right"]).steps) == 2
    with pytest.raises(xc.ProblemError, match=r"line \d+, growth.until: .*'lfet'"):
        xc.read_case(strip_case(tmp_path, 'until = "lfet"\n'))
    with pytest.raises(xc.ProblemError, match=r"line \d+, growth.until: until = 3: give"):
        xc.read_case(strip_case(tmp_path, "until = 3\n"))


RETARDED = """
[growth.spectrum]
factors = [0.0, 1.0, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5]
[[retarded]]
kind = "wheeler"
w = 1.3
zone = { sigma_y = "400 MPa", beta = 2 }
[[retarded]]
kind = "willenborg"
shutoff = 2.7
dK_th = 10.0
zone = { sigma_y = "400 MPa", beta = 2 }
max_blocks = 1e5
"""


@pytest.mark.slow
def test_lives_with_retardation_along_the_path(tmp_path):
    file = strip_case(tmp_path, "")
    text = file.read_text(encoding="utf-8").replace("cycle = { min = 0.1, max = 1.0 }\n", "")
    file.write_text(text + RETARDED, encoding="utf-8")
    history = xc.run(file)
    case = xc.read_case(file)
    rows = (tmp_path / "case_results" / "retarded.csv").read_text().splitlines()
    for given in case.retarded:
        wanted = xc.retarded(history, case.growth["law"], case.growth["cycle"], given["model"],
                             nu=0.3)  # fmt: skip
        own = [row.split(",") for row in rows if row.startswith(type(given["model"]).__name__)]
        assert np.array_equal([float(row[2]) for row in own], wanted.blocks)
        assert own[-1][3] == "the last step"
        assert wanted.life > 1.05 * history.life
    more = RETARDED.partition("[[retarded]]")[2].partition("[[retarded]]")[0]
    file = strip_case(tmp_path, "[[retarded]]" + more)
    with pytest.raises(xc.ProblemError, match=r"line \d+, retarded 1: overloads are of a spectr"):
        xc.read_case(file)
