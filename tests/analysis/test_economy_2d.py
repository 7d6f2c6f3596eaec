"""Scene economy: no scene costs more than it needs, and the report says what it cost."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes
from support.scenes_2d import numerics_of

STEEL = xc.Isotropic(1.3, 0.27, plane="strain")
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))
PUSH = (xc.traction("top", (0.0, -1.0)), xc.traction("bottom", (0.0, 1.0)))
EDGE = [(-1.1, 0.031), (0.07, 0.012)]
INNER = [(-0.41, -0.47), (0.33, -0.52)]
THROUGH = [(-1.1, 0.031), (1.1, 0.112)]


def problem(*cracks, mesh=None, loads=PULL, **options):
    lines = [xc.line_crack(c) for c in cracks]
    mesh = scenes.perturbed(14, 5) if mesh is None else mesh
    return xc.Problem(mesh, STEEL, lines, loads=loads, **options)


@pytest.mark.parametrize("order", [1, 2])
def test_choices_for_cracks_change_no_bit_without_cracks(order):
    scene = problem(order=order)
    plain = xc.solve(scene)
    for numerics in (
        xc.Numerics(orthonormal="none"),
        xc.Numerics(orthonormal="node", patch=True, functions=2, enrichment="topological"),
        xc.Numerics(multipliers="naive", consistent=False, points=8, radius=0.1),
    ):
        other = xc.solve(replace(scene, numerics=numerics, contact="on"))
        assert (other.u == plain.u).all()
    report = plain.report
    for name in ("Heaviside functions", "tip functions", "enriched quadrature", "third mode"):
        assert not report[name].used
    assert plain.n_dof == 2 * plain.space.n_nodes == report["standard functions"].unknowns
    assert report.operations["multipliers"] == 0
    assert report.operations["assembled_cells"] == 0
    assert report.operations["integration_points"] == 0


def test_a_report_is_written_when_it_is_asked_for():
    """A solve keeps what it needs for that, of its own operations, also where it is pickled."""
    first = xc.respond(problem(EDGE), [1.0, -0.5])
    solution = first.solutions[1]
    xc.respond(problem([*EDGE, (0.11, 0.02)]), [1.0], reuse=first.reuse)
    again = pickle.loads(pickle.dumps(solution))
    assert "summary" not in vars(solution)
    assert str(again.report) == str(solution.report)
    assert solution.report["load states"].reason.startswith("2, share one ")
    assert solution.report.operations["factorisations"] == 1


def test_the_uncracked_stiffness_is_made_once_a_mesh():
    mesh = scenes.perturbed(14, 5)
    first = xc.respond(problem(EDGE, mesh=mesh), [1.0])
    longer = [EDGE[0], EDGE[1], (0.3, 0.1)]
    (again,) = xc.respond(problem(longer, mesh=mesh), [1.0], first.reuse).solutions
    assert again.reuse.bulk.matrix is first.reuse.bulk.matrix
    fresh = xc.solve(problem(longer, mesh=mesh))
    assert (again.u == fresh.u).all()
    # Another mesh or order must not take it.
    (other,) = xc.respond(problem(EDGE, mesh=mesh, order=1), [1.0], first.reuse).solutions
    assert other.reuse.bulk is not first.reuse.bulk


@pytest.mark.parametrize("order", [1, 2])
def test_a_through_crack_has_no_tip_functions(order):
    scene = problem(
        THROUGH, order=order, supports=[xc.fix("top"), xc.fix("bottom")],
        loads=[xc.body_force((0.0, -1.0))], contact="off",
    )  # fmt: skip
    planned = xc.plan(scene)["tip functions"]
    assert not planned.used
    assert planned.reason == "every crack cuts through: there is no tip"
    solution = xc.solve(scene)
    space = solution.space
    assert space.tips == ()
    n_heaviside = 2 * int((space.heaviside[0] >= 0).sum())
    assert solution.n_dof == 2 * space.n_nodes + n_heaviside
    assert solution.report["Heaviside functions"].unknowns == n_heaviside
    assert solution.report["tip functions"].unknowns == 0


def space_and_points(scene):
    """Functions of a solved scene, and how many points its cells were integrated at."""
    solution = xc.solve(scene)
    return solution.space, solution.report.operations["integration_points"]


@pytest.mark.parametrize("order", [1, 2])
def test_points_are_spent_only_where_a_function_is_no_polynomial(order):
    """Heaviside cells: one point a piece at order 1, three at order 2; plain cells none."""
    scene = problem(
        THROUGH, order=order, supports=[xc.fix("top"), xc.fix("bottom")], loads=(), contact="off"
    )
    space, n_points = space_and_points(scene)
    cut = space.cuts[0]
    beside = np.setdiff1d(space.enriched_cells, cut.cells)
    pieces = len(cut.sub_to_cell) + len(beside)
    assert n_points == pieces * {1: 1, 2: 3}[order]
    assert len(space.enriched_cells) < len(scene.mesh.cells) / 3
    # With a tip: more points in its disc alone.
    space, n_points = space_and_points(problem(EDGE, order=order))
    per_cell = n_points / len(space.enriched_cells)
    disc = space.has_tip.sum()
    assert n_points <= 110 * disc + 3 * 3 * len(space.enriched_cells)
    assert per_cell > 3


@pytest.mark.parametrize("order", [1, 2])
def test_an_open_crack_costs_nothing_for_contact(order):
    """No multipliers, and the same operations as with contact switched off (2 % are allowed)."""
    result = {
        contact: xc.solve(problem(EDGE, INNER, order=order, contact=contact))
        for contact in ("auto", "off")
    }
    auto, off = (result[c].report.operations for c in ("auto", "off"))
    for name in ("factorisations", "solves", "assembled_cells", "integration_points"):
        assert auto[name] <= 1.02 * off[name]
    assert auto["multipliers"] == auto["contact_iterations"] == 0
    assert result["auto"].contact == (None, None)
    assert (result["auto"].u == result["off"].u).all()
    row = result["auto"].report["multipliers of crack 0"]
    assert not row.used
    assert row.reason == "the crack faces stay apart in every load state"


@pytest.mark.parametrize("order", [1, 2])
def test_a_closed_crack_costs_one_factorisation_and_a_small_dense_problem(order):
    solution = xc.solve(problem(EDGE, order=order, loads=PUSH))
    operations = solution.report.operations
    assert operations["factorisations"] == 1
    multipliers = operations["multipliers"]
    # About one for each pair of cells along the crack face.
    assert 0 < multipliers <= len(solution.space.cuts[0].lip_cell)
    assert operations["solves"] == 2
    assert solution.contact[0] is not None
    assert solution.contact[0].closed.all()
    assert solution.report["multipliers of crack 0"].unknowns == multipliers


@pytest.mark.parametrize("order", [1, 2])
def test_only_the_crack_that_closes_gets_multipliers(order):
    """The inner crack is held open by a pressure, the edge crack is pushed together."""
    loads = [*PUSH, xc.crack_pressure(3.0, crack=1)]
    solution = xc.solve(problem(EDGE, INNER, order=order, loads=loads))
    assert solution.contact[0] is not None
    assert solution.contact[1] is None
    assert solution.report["multipliers of crack 0"].used
    assert not solution.report["multipliers of crack 1"].used
    assert (solution.opening(1) > 0).all()


@pytest.mark.parametrize("order", [1, 2])
def test_three_states_share_one_factorisation(order):
    """Pulled, pushed, pulled more: one matrix serves all; each equals its own solution."""
    scene = problem(EDGE, order=order)
    states = [
        1.0,
        -1.0,
        [*PULL, xc.traction("right", (0.5, 0)), xc.traction("left", (-0.5, 0))],
    ]
    solutions = xc.solve(scene, states=states)
    operations = solutions[0].report.operations
    assert operations["factorisations"] == 1
    assert operations["solves"] == 2 * 3
    assert "3, share one factorisation" in str(solutions[0].report)
    assert all(s.space is solutions[0].space for s in solutions)
    for state, together in zip(states, solutions, strict=True):
        alone = xc.solve(scene, states=[state])[0]
        # Round-off: multipliers of an open state are zero, not absent.
        assert together.u == pytest.approx(alone.u, abs=1e-9 * np.abs(alone.u).max())


@pytest.mark.filterwarnings("ignore:K at .* domains of radius:xcrack.XcrackWarning")
@pytest.mark.parametrize("order", [1, 2])
def test_a_closed_tip_keeps_its_functions(order):
    """The multipliers hold it: the same unknowns and the same matrix as for the open crack."""
    opened, closed = xc.solve(problem(EDGE, order=order), states=[1.0, -1.0])
    alone = xc.solve(problem(EDGE, order=order, loads=PUSH))
    assert opened.n_dof == closed.n_dof == alone.n_dof
    assert len(alone.space.tips) == 1
    assert opened.report["tip functions"].unknowns == alone.report["tip functions"].unknowns > 0
    sif = xc.stress_intensity(closed)
    # Discretisation: K_I of a closed tip, as a share of what it is when pulled.
    assert sif.K_I[0] == 0.0
    assert sif.K_integral[0, 0] <= 2e-2 * xc.stress_intensity(opened).K_I[0]


@pytest.mark.parametrize("order", [1, 2])
def test_unknowns_in_the_report_add_up(order):
    for scene in (
        problem(order=order),
        problem(EDGE, order=order),
        problem(EDGE, INNER, order=order),
    ):
        solution = xc.solve(scene)
        names = ("standard functions", "Heaviside functions", "tip functions")
        assert solution.n_dof == sum(solution.report[n].unknowns for n in names)


def test_cheaper_choices_cost_less():
    def unknowns(**choice):
        solution = xc.solve(problem(EDGE, numerics=numerics_of(radius=0.4, **choice)))
        return solution.report["tip functions"].unknowns

    full = unknowns()
    assert unknowns(functions=2) == full // 2
    assert unknowns(enrichment="topological") < full / 4


def test_the_report_says_what_was_done_to_a_mouth():
    solution = xc.solve(problem([(-0.99, 0.03), (0.1, 0.03)]))
    row = solution.report["mouths of crack 0"]
    assert row.used
    assert row.reason.startswith("1, prolonged to one cell outside")
