"""Examples whose scene is data, as case files: the same problem to the last bit, the same run."""

import ast
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.equality import same

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCENES = {  # what makes the problem of an example, from its names
    "compact_tension": lambda given: given["specimen"](15.0, np.pi / 3),
    "edge_crack_growth": lambda given: given["plate"],
    "two_holes": lambda given: given["stretched"](xc.read_mesh(given["MESHES"] / "two_holes.msh")),
    "link_up": lambda given: given["sheet"](1.0),
    "compressed_crack": lambda given: given["plate"](0.3),
    "inclusion": lambda given: given["scene"](1 / 8),
    "bimetal": lambda given: given["strip"](6),
    "bonded_patch": lambda given: given["scene"]([xc.line_crack([(-10.0, 0.0), (10.0, 0.0)])]),
    "flaw_campaign": lambda given: given["flawed"](0, 0.0, 1.0),
}
LAST = {"compact_tension": "specimen", "edge_crack_growth": "plate", "two_holes": "stretched",
        "link_up": "problem", "compressed_crack": "plate", "inclusion": "scene",
        "bimetal": "strip", "bonded_patch": "scene", "flaw_campaign": "flawed"}  # fmt: skip


def names_of(example: str) -> dict:
    """Constants and functions of an example up to what makes its problem: nothing is computed."""
    file = EXAMPLES / f"{example}.py"
    given = {"__file__": str(file), "__name__": example}
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import | ast.ImportFrom | ast.Assign | ast.FunctionDef):
            exec(compile(ast.Module([node], []), str(file), "exec"), given)
        if LAST[example] in given:
            return given
    raise AssertionError(example)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.gmsh] * (n == "link_up")) for n in SCENES]
)
def test_a_case_file_is_the_problem_of_the_example(name):
    if name == "link_up":
        pytest.importorskip("gmsh")
    wanted = SCENES[name](names_of(name))
    case = xc.read_case(EXAMPLES / "cases" / f"{name}.toml")
    assert same(case.problem, wanted)
    assert case.problem.mesh.points.tobytes() == wanted.mesh.points.tobytes()


PLATE = """
[mesh]
kind = "box"
lower = [{low}, -{height}]
upper = [1.0, {height}]
n = [{columns}, {rows}]
[material]
E = 1.0
nu = 0.3
plane = "strain"
[[cracks]]
kind = "line"
points = [[{left}, 0], [{a}, 0]]
[[loads]]
kind = "traction"
where = "top"
value = [0.0, 1.0]
[[loads]]
kind = "traction"
where = "bottom"
value = [0.0, -1.0]
[solve]
order = {order}
"""


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("a", "centre"), [(0.3, False), (0.5, False), (0.5, True)])
def test_the_plates_of_the_book(a, centre, order, tmp_path):
    """The tables of K of the verification book, as case files."""
    height, low = (1.0, -1.0) if centre else (1.5, 0.0)
    rows = round(2 * height / (a / 10))
    text = PLATE.format(low=low, height=height, columns=round((1 - low) / (a / 10)), order=order,
                        rows=rows + 1 - rows % 2, left=-a if centre else -0.1, a=a)  # fmt: skip
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    wanted = xc.Problem(
        xc.box((low, -height), (1.0, height),
               (round((1 - low) / (a / 10)), rows + 1 - rows % 2)),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        [xc.line_crack([(-a if centre else -0.1, 0), (a, 0)])],
        loads=[xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))], order=order,
    )  # fmt: skip
    assert same(xc.read_case(tmp_path / "case.toml").problem, wanted)


def test_each_case_has_its_example():
    assert {path.stem for path in (EXAMPLES / "cases").glob("*.toml")} == set(SCENES)


@pytest.mark.slow
@pytest.mark.mission
def test_growth_of_an_example_from_its_case_file(tmp_path):
    """Two steps of the edge crack, by Python and by the file: every number of the table."""
    given = names_of("edge_crack_growth")
    case = xc.read_case(EXAMPLES / "cases" / "edge_crack_growth.toml", {"growth.max_steps": 2})
    runs = [
        xc.collect(xc.grow(problem, **growth, progress=False))
        for problem, growth in (
            (case.problem, dict(case.growth)),
            (given["plate"], {"law": given["LAW"], "criterion": xc.max_hoop_stress,
                              "cycle": xc.Cycle(0.1, 1.0), "da": 1.5, "max_steps": 2}),
        )
    ]  # fmt: skip
    assert runs[0].table().tobytes() == runs[1].table().tobytes()
    assert runs[0].settings == runs[1].settings
