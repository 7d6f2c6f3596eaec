"""What cannot be a body of several materials, in words; and where such bodies go besides."""

import numpy as np
import pytest

import xcrack as xc
from support import materials as scenes

STEEL, GLUE = xc.Isotropic(1.0, 0.3, "strain"), xc.Isotropic(0.2, 0.3, "strain")


def box(**sets):
    mesh = xc.box((0.0, 0.0), (2.0, 1.0), (4, 2))
    return mesh.with_cell_sets(sets or {"left": range(8), "right": range(8, 16)})


@pytest.mark.parametrize(
    ("mesh", "materials", "text"),
    [
        (box(), {"left": STEEL, "rihgt": GLUE}, "no cell set 'rihgt': it has 'left', 'right'"),
        (box(left=range(9), right=range(8, 16)), {"left": STEEL, "right": GLUE},
         r"1 cells, one at \[.*\], are in 'left' and in 'right': give each cell one material"),
        (box(left=range(7), right=range(8, 16)), {"left": STEEL, "right": GLUE},
         r"1 cells, one at \[.*\], are in none of the sets 'left', 'right': give every cell"),
        (box(left=range(16), right=[]), {"left": STEEL, "right": GLUE},
         "the cell set 'right' is empty: leave it out, or give it cells"),
        (box(), {"left": STEEL, "right": xc.Isotropic(1.0, 0.3, "stress")},
         "'left' is of plane \"strain\", and 'right' of plane \"stress\""),
        (box(), {"left": STEEL, "right": xc.Isotropic(1.0, 0.3)},
         "material of 'right': a 2D body needs Isotropic"),
        (box(), {"left": STEEL, "right": 3.0}, "'right': 3.0: give the name of a cell set, and a"),
        (box(), {"left": STEEL, "right": {"a": STEEL}}, "give the name of a cell set, and a mater"),
        (box(), {"left": STEEL, "right": xc.MaterialSets({"a": STEEL})},
         "holds materials by set itself"),
        (box(), {}, "give a mapping of cell sets to materials"),
        (box(), [STEEL, GLUE],
         r"\(list\): give a material, such as Isotropic\(.*\), or a mapping of cell sets"),
    ],
)  # fmt: skip
def test_sets_that_are_no_body_are_refused(mesh, materials, text):
    with pytest.raises(xc.ProblemError, match=text):
        xc.Problem(mesh, materials)


def test_a_tip_on_an_interface_has_no_K():
    mesh = scenes.square(20)
    problem = xc.Problem(mesh, scenes.pair(3.0), [xc.line_crack([(0, 0.013), (0.5, 0.013)])],
                         loads=scenes.PULL)  # fmt: skip
    solution = xc.solve(problem)
    with pytest.raises(xc.GeometryError, match="on the interface of 'one' and 'two': the stress"):
        xc.stress_intensity(solution)


@pytest.mark.parametrize(
    ("material", "load", "text"),
    [
        (
            STEEL,
            xc.temperature(1.0),
            r"Isotropic\(E=1.0.*\) has no alpha: give Isotropic\(\.\.\., ",
        ),
        (
            {"left": STEEL, "right": GLUE},
            xc.temperature(1.0, 1e-5),
            "leave alpha out, and give each",
        ),
    ],
)
def test_temperatures_without_an_expansion_are_refused(material, load, text):
    with pytest.raises(xc.ProblemError, match=text):
        xc.Problem(box(), material, loads=[load])


def test_sets_by_functions():
    mesh = box(low=lambda x: x[:, 1] < 0.5, high=[1, 2])
    assert len(mesh.cell_sets["low"]) == 8
    assert "cell sets: low, high" in repr(mesh)
    for given, text in (
        ({"low": lambda x: x[:, 1]}, "returned float64 .* return True or False for each of the 16"),
        ({"low": lambda x: x[0, 1] < 1}, "returned bool of shape"),
        ({"low": [99]}, "cells beyond the 16"),
        ([1, 2], "give a mapping"),
    ):
        with pytest.raises(xc.MeshError, match=text):
            mesh.with_cell_sets(given)


def test_the_report_names_materials_and_where_tips_are():
    problem = scenes.edge_crack(12, 0.6, 3.0)
    report = xc.solve(problem).report
    words = report["materials"].reason
    assert "'one' (300 cells): Isotropic(E=1.0, nu=0.3" in words
    assert "bonded along 25 facets" in words
    assert report["tips of crack 0"].reason == "in 'two'"
    assert "materials" in str(xc.plan(problem))


@pytest.mark.slow
@pytest.mark.mission
def test_pictures_files_and_reports_show_materials(tmp_path):
    solution = xc.solve(scenes.edge_crack(12, 0.6, 8.0))
    for field in ("material", "syy", "mesh"):
        xc.plot(solution, field, file=tmp_path / f"{field}.png", show=False, renderer="matplotlib")
    page = xc.report(solution, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "in 'two'" in page.replace("&#x27;", "'").replace("&#39;", "'")
    import meshio

    (grid, _) = xc.write(solution, tmp_path / "fields")
    data = meshio.read(grid)
    assert set(np.unique(np.concatenate(data.cell_data["material"]))) == {0, 1}
    # stresses are those of each side, not a mean of both
    stress = data.point_data["stress"][:, 1]
    on = np.abs(data.points[:, 0] - 0.5) < 1e-9
    far = on & (np.abs(data.points[:, 1]) > 0.9)
    assert np.ptp(stress[far]) > 0.5


def test_a_saved_solution_keeps_its_materials(tmp_path):
    materials = {
        "one": xc.Graded(lambda x: 1 + x[:, 0] ** 2, 0.3, "strain", alpha=1e-5, K_c=3.0),
        "two": xc.Isotropic(2.0, 0.2, "strain", alpha=2e-5),
    }
    problem = xc.Problem(scenes.square(12), materials, [xc.line_crack([(0, 0), (0.37, 0)])],
                         loads=[*scenes.PULL, xc.temperature(3.0)])  # fmt: skip
    solution = xc.solve(problem)
    xc.save(solution, tmp_path / "solution.npz")
    back = xc.load(tmp_path / "solution.npz")
    x = [(0.3, 0.2), (0.8, -0.4)]
    assert np.array_equal(back.stress(x), solution.stress(x))
    assert np.array_equal(xc.stress_intensity(back).K, xc.stress_intensity(solution).K)
    assert list(back.problem.material) == ["one", "two"]
    assert back.problem.material["two"] == materials["two"]
    again = xc.stress_intensity(back, error=True)
    assert np.allclose(again.bar, xc.stress_intensity(solution, error=True).bar, rtol=1e-6)
    with pytest.raises(xc.ProblemError, match="was stored with its solution for the mesh of that"):
        xc.Problem(xc.refine(back.problem.mesh, size=0.05), back.problem.material)


def test_refinement_and_adaptation_keep_materials():
    problem = scenes.edge_crack(10, 0.37, 4.0)
    fine = xc.refine(
        problem.mesh, size=lambda x: 0.02 + 0.1 * np.linalg.norm(x - (0.37, 0), axis=1)
    )
    middle = fine.points[fine.cells].mean(axis=1)[:, 0]
    assert set(fine.cell_sets["two"]) == set(np.nonzero(middle > 0.5)[0])
    result = xc.adapt(problem, 2e-3)
    assert len(result.problem.elasticity.interfaces) > 0


CASE = """
[mesh]
kind = "file"
path = "mesh.msh"
[material.one]
E = 1.0
nu = 0.3
plane = "strain"
[material.two]
kind = "Isotropic"
E = 3.0
nu = 0.3
plane = "strain"
alpha = 1e-5
[[cracks]]
kind = "line"
points = [[0.0, 0.0], [0.37, 0.0]]
"""


def test_materials_by_set_in_a_case_file(tmp_path):
    xc.write_mesh(tmp_path / "mesh.msh", scenes.square(6))
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    problem = xc.read_case(path).problem
    assert problem.material["two"] == xc.Isotropic(3.0, 0.3, "strain", alpha=1e-5)
    path.write_text(CASE.replace("material.two", "material.tow"))
    with pytest.raises(xc.ProblemError, match="no cell set 'tow'"):
        xc.read_case(path)


GROWTH = """
[growth]
da = 0.05
[growth.law.one]
kind = "paris"
C = 1e-3
m = 3.0
[growth.law.two]
kind = "paris"
C = 1e-4
m = 3.0
[growth.spectrum]
factors = [0.0, 1.0, 0.0, 1.5]
[growth.retardation.one]
kind = "wheeler"
w = 1.5
zone = { sigma_y = 40.0, beta = 2 }
[growth.retardation.two]
kind = "wheeler"
w = 1.2
zone = { sigma_y = 25.0, beta = 2 }
"""


def test_laws_and_retardation_by_set_in_a_case_file(tmp_path):
    xc.write_mesh(tmp_path / "mesh.msh", scenes.square(6))
    path = tmp_path / "case.toml"
    path.write_text(CASE + GROWTH)
    growth = xc.read_case(path).growth
    assert dict(growth["law"]) == {"one": xc.paris(1e-3, 3.0), "two": xc.paris(1e-4, 3.0)}
    assert dict(growth["retardation"]) == {
        "one": xc.wheeler(1.5, xc.plastic_zone(40.0, beta=2)),
        "two": xc.wheeler(1.2, xc.plastic_zone(25.0, beta=2)),
    }


def test_growth_runs_are_resumed(tmp_path):
    problem = scenes.edge_crack(14, 0.3, 4.0)
    law, cycle = xc.paris(1e-3, 3.0), xc.Cycle(0.0, 1.0)

    choices = {"da": 0.03, "progress": False}
    scene = law, xc.max_hoop_stress, cycle
    whole = xc.collect(xc.grow(problem, *scene, max_steps=3, **choices))
    xc.collect(xc.grow(problem, *scene, max_steps=1, **choices), path=tmp_path / "run")
    resumed = xc.resume(tmp_path / "run", problem, *scene, max_steps=3, **choices)
    assert np.array_equal(resumed.cracks[0].points, whole.cracks[0].points)
    other = xc.Problem(problem.mesh, scenes.pair(4.1), problem.cracks, loads=problem.loads)
    with pytest.raises(xc.ProblemError, match="material"):
        xc.resume(tmp_path / "run", other, *scene, max_steps=4, **choices)
