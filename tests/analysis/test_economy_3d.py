"""Scene economy in 3D: the rules of test_economy_2d.py for tetrahedra, fronts and levels."""

import importlib.util
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support import scenes_3d as scenes_space
from support.scenes_2d import numerics_of

STEEL = xc.Isotropic(1.3, 0.27)
PULL = (xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0)))
PUSH = (xc.traction("top", (0, 0, -1.0)), xc.traction("bottom", (0, 0, 1.0)))
PENNY = xc.penny_crack((0.013, -0.021, 0.0317), (0.1, -0.2, 1.0), 0.55, n=24)
SOLVERS = ["direct", "iterative"]


def problem(*cracks, mesh=None, loads=PULL, **options):
    mesh = scenes_space.perturbed(5, 71) if mesh is None else mesh
    return xc.Problem(mesh, STEEL, list(cracks), loads=loads, **{"order": 1} | options)


def split_apart(**options):
    """A crack that cuts the cube in two halves, each of which is held."""
    return problem(
        scenes_space.sheet((0.1, -0.2, 1.0), 0.07),
        supports=[xc.fix("top"), xc.fix("bottom")], loads=[xc.body_force((0, 0, -1.0))],
        contact="off", **options,
    )  # fmt: skip


@pytest.mark.parametrize("linear", SOLVERS)
def test_choices_for_cracks_change_no_bit_without_cracks(linear):
    scene = problem(numerics=xc.Numerics(linear=linear))
    plain = xc.solve(scene)
    for choice in (
        {"functions": 2, "enrichment": "topological"},
        {"multipliers": "naive", "consistent": False, "points": 8, "radius": 0.1},
    ):
        other = xc.solve(
            replace(scene, numerics=numerics_of(linear=linear, **choice), contact="on")
        )
        assert (other.u == plain.u).all()
    for name in ("Heaviside functions", "tip functions", "enriched quadrature", "third mode"):
        assert not plain.report[name].used
    assert plain.n_dof == 3 * plain.space.n_nodes == plain.report["standard functions"].unknowns
    for name in ("multipliers", "assembled_cells", "integration_points"):
        assert plain.report.operations[name] == 0


def test_a_through_crack_has_no_tip_functions():
    scene = split_apart()
    planned = xc.plan(scene)
    assert planned["tip functions"].reason == "every crack cuts through: there is no tip"
    assert not planned["tip functions"].used
    assert not planned["third mode"].used
    solution = xc.solve(scene)
    assert solution.space.tips == ()
    n_heaviside = 3 * int((solution.space.heaviside[0] >= 0).sum())
    assert solution.n_dof == 3 * solution.space.n_nodes + n_heaviside
    assert solution.report["Heaviside functions"].unknowns == n_heaviside
    assert solution.report["tip functions"].unknowns == 0


def points_of(solution):
    return solution.report.operations["integration_points"]


def test_points_are_spent_only_where_a_function_is_no_polynomial():
    """Heaviside cells: one point a piece; plain cells none; more only where a front is near."""
    solution = xc.solve(split_apart())
    space, cut = solution.space, solution.space.cuts[0]
    beside = np.setdiff1d(space.enriched_cells, cut.cells)
    assert points_of(solution) == len(cut.sub_to_cell) + len(beside)
    assert len(space.enriched_cells) < len(space.mesh.cells)
    plain, many = (
        xc.solve(problem(PENNY, numerics=xc.Numerics(enrichment="topological", points=n)))
        for n in (4, 6)
    )
    # More points a direction change nothing in the cells without functions of a front.
    assert points_of(many) > points_of(plain)
    assert plain.space.has_tip.any()
    assert (many.space.enriched_cells == plain.space.enriched_cells).all()


@pytest.mark.parametrize("linear", SOLVERS)
def test_an_open_crack_costs_nothing_for_contact(linear):
    """No multipliers; the operations and, to the solver's tolerance, the solution of contact off.

    Conjugate gradients may look at a rough solution first: a few steps more are allowed.
    """
    numerics = xc.Numerics(linear=linear)
    auto, off = (
        xc.solve(problem(PENNY, contact=contact, numerics=numerics)) for contact in ("auto", "off")
    )
    spent, plain = auto.report.operations, off.report.operations
    for name in ("unknowns", "factorisations", "assembled_cells", "integration_points"):
        assert spent[name] == plain[name]
    assert spent["multipliers"] == spent["contact_iterations"] == 0
    assert auto.contact == (None,)
    row = auto.report["multipliers of crack 0"]
    assert not row.used
    assert row.reason == "the crack faces stay apart in every load state"
    if linear == "direct":
        assert spent["solves"] == plain["solves"]
        assert (auto.u == off.u).all()
    else:
        assert spent["iterations"] <= 1.1 * plain["iterations"]
        assert auto.u == pytest.approx(off.u, abs=1e-6 * np.abs(off.u).max())


def test_only_the_crack_that_closes_gets_multipliers():
    """The upper penny is held open by a pressure, the lower one is pushed together."""
    low = xc.penny_crack((0.0, 0.0, -0.453), (0, 0, 1), 0.5, n=24)
    high = xc.penny_crack((0.0, 0.0, 0.447), (0, 0, 1), 0.5, n=24)
    loads = [*PUSH, xc.crack_pressure(3.0, crack=1)]
    solution = xc.solve(problem(low, high, loads=loads))
    assert solution.contact[0] is not None
    assert solution.contact[1] is None
    assert solution.report["multipliers of crack 0"].unknowns > 0
    assert not solution.report["multipliers of crack 1"].used
    assert (solution.opening(1) > 0).all()


@pytest.mark.parametrize("linear", SOLVERS)
def test_three_states_share_one_factor_or_hierarchy(linear):
    scene = problem(PENNY, numerics=xc.Numerics(linear=linear))
    together = xc.solve(scene, states=[1.0, -1.0, 2.0])
    report = together[0].report
    assert report.operations["factorisations"] == (linear == "direct")
    shared = "factorisation" if linear == "direct" else "multigrid hierarchy"
    assert report["load states"].reason == f"3, share one {shared}"
    assert all(s.space is together[0].space for s in together)
    assert all(s.reuse.bulk is together[0].reuse.bulk for s in together)
    for state, solution in zip([1.0, -1.0, 2.0], together, strict=True):
        alone = xc.solve(scene, states=[state])[0]
        # Tolerance of conjugate gradients.
        assert solution.u == pytest.approx(alone.u, abs=1e-6 * np.abs(alone.u).max())


def test_stiffness_and_levels_of_the_body_are_made_once_a_mesh():
    mesh = scenes_space.perturbed(5, 71)
    numerics = xc.Numerics(linear="iterative")
    first = xc.respond(problem(PENNY, mesh=mesh, numerics=numerics), [1.0])
    assert first.reuse.hierarchy is not None
    grown = xc.penny_crack((0.013, -0.021, 0.0317), (0.1, -0.2, 1.0), 0.6, n=24)
    scene = problem(grown, mesh=mesh, numerics=numerics)
    (again,) = xc.respond(scene, [1.0], first.reuse).solutions
    assert again.reuse.bulk.matrix is first.reuse.bulk.matrix
    assert again.reuse.hierarchy is first.reuse.hierarchy
    fresh = xc.solve(scene)
    assert fresh.reuse.bulk.matrix is not first.reuse.bulk.matrix
    assert (again.u == fresh.u).all()
    # Another mesh must not take it.
    (other,) = xc.respond(problem(PENNY, numerics=numerics), [1.0], first.reuse).solutions
    assert other.reuse.bulk.matrix is not first.reuse.bulk.matrix
    assert other.reuse.hierarchy is not first.reuse.hierarchy


def test_unknowns_in_the_report_add_up():
    for cracks in ((), (PENNY,), (scenes_space.half_sheet(0.013, 0.031),)):
        solution = xc.solve(problem(*cracks))
        names = ("standard functions", "Heaviside functions", "tip functions")
        assert solution.n_dof == sum(solution.report[n].unknowns for n in names)


def economy():
    """The script of the audit, which is no module of the package."""
    path = Path(__file__).parents[2] / "benchmarks" / "economy.py"
    spec = importlib.util.spec_from_file_location("economy", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_smallest_scene_of_the_audit_runs(tmp_path, capsys):
    page, results = tmp_path / "page.md", tmp_path / "results.json"
    page.write_text("before\n<!-- table -->\n<!-- /table -->\nafter\n", encoding="utf-8")
    for _ in range(2):  # the second time the table is there already
        economy().main(["uniform pressure"], results, page)
    lines = page.read_text(encoding="utf-8").splitlines()
    assert [lines[0], lines[1], lines[-2], lines[-1]] == [
        "before", "<!-- table -->", "<!-- /table -->", "after",
    ]  # fmt: skip
    assert len(lines) == 7
    rows = json.loads(results.read_text(encoding="utf-8"))["uniform pressure"]["rows"]
    default, other = rows["default"], rows["corrected gradients"]
    assert default["errors"]["pressure"] < 1e-11 < other["errors"]["pressure"]  # round-off


def test_the_page_names_tests_that_exist_and_the_whole_audit():
    root = Path(__file__).parents[2]
    page = (root / "docs" / "economy.md").read_text(encoding="utf-8")
    tests = "".join(p.read_text(encoding="utf-8") for p in (root / "tests").rglob("test_*.py"))
    named = set(re.findall(r"`(test_\w+)`", page))
    assert len(named) > 8
    assert all(f"def {name}(" in tests for name in named)
    for scene, (_, parts) in economy().SCENES.items():
        for part, _, _ in parts:
            assert f"| {scene} | {part} |" in page
