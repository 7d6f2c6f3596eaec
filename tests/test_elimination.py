"""The order of elimination that cracks in one mesh share."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

import scenes
import xcrack as xc
from xcrack.analysis.solve import solve_states
from xcrack.history.run_folder import CLASSES, read_header, read_steps, step_path
from xcrack.history.store import load, save
from xcrack.solvers.direct import scaled_basis, system
from xcrack.solvers.factor import Elimination, eliminated
from xcrack.xfem.model import build

TENSION = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
EDGE = [(-1.2, 0.013), (-0.2, 0.013)]


def problem(tip, mesh):
    crack = xc.line_crack([*EDGE, tip])
    return xc.Problem(mesh, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=TENSION)


def laplacian(n, seed):
    """A symmetric positive matrix on a path of points with random links."""
    rng = np.random.default_rng(seed)
    i, j = rng.integers(n, size=(2, 3 * n))
    link = sp.coo_matrix((rng.random(3 * n), (i, j)), shape=(n, n))
    link = link + link.T
    return sp.csc_matrix(sp.diags(np.asarray(link.sum(axis=0)).ravel() + 1) - link)


def test_a_known_order_gives_the_same_solution():
    A, b = laplacian(60, 4401), np.random.default_rng(4402).random((60, 2))
    node = np.arange(60)
    first, order = eliminated(A, node, 60, None)
    assert order.age == 0
    again, kept = eliminated(A, node, 60, order)
    np.testing.assert_allclose(first(b), again(b), rtol=1e-12)  # round-off
    np.testing.assert_allclose(A @ again(b[:, 0]), b[:, 0], rtol=1e-11)
    assert kept.age == 1
    assert kept.place is order.place


def test_an_order_that_fills_is_given_up():
    A = laplacian(60, 4403)
    _, order = eliminated(A, np.arange(60), 60, None)
    solve, kept = eliminated(A, np.arange(60), 60, replace(order, fill=order.fill // 2))
    assert kept is None
    np.testing.assert_allclose(A @ solve(np.ones(60)), 1.0, rtol=1e-11)


def test_an_order_of_another_mesh_is_passed_over():
    A = laplacian(40, 4404)
    _, order = eliminated(A, np.arange(40), 40, Elimination(np.arange(7), 10))
    assert len(order.place) == 40
    assert order.age == 0


@pytest.mark.parametrize("order", [1, 2])
def test_the_next_crack_takes_the_order_of_the_last(order):
    """Displacements differ by round-off, and the factor is hardly larger than a new one."""
    mesh = scenes.perturbed(16, 77)
    first = xc.solve(replace(problem((0.0, 0.05), mesh), order=order))
    longer = replace(problem((0.15, 0.12), mesh), order=order)
    kept = solve_states(longer, [None], reuse=first.reuse)[0]
    fresh = xc.solve(longer)
    assert kept.reuse.elimination.age == 1
    scale = np.abs(fresh.u).max()
    np.testing.assert_allclose(kept.u, fresh.u, atol=1e-10 * scale)


def test_a_function_without_energy_is_left_out():
    """As is that of a sliver below round-off; the others stay as they were."""
    numerics = xc.Numerics(orthonormal="none")
    model = build(replace(problem((0.0, 0.05), scenes.perturbed(12, 78)), numerics=numerics))
    lost = model.space.n_nodes * 2 + 3
    keep = sp.diags((np.arange(model.space.n_dof) != lost).astype(float))
    K, fixed = sp.csr_matrix(keep @ model.stiffness @ keep), model.known.fixed.copy()
    fixed[:4] = True
    basis = scaled_basis(model.space, K, fixed, numerics)
    whole = scaled_basis(model.space, model.stiffness, fixed, numerics)
    assert basis.shape[1] == whole.shape[1] - 1
    assert basis[lost].nnz == 0
    engine = system(model.space, K, fixed, numerics)
    assert np.abs(engine.reduced.diagonal() - 1).max() <= 1e-12  # round-off


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_a_step_whose_order_is_lost_is_not_taken_for_whole(tmp_path):
    """The step that found the order holds it for those that follow."""
    run = xc.grow(
        problem((0.0, 0.05), scenes.perturbed(12, 79)), xc.paris(C=1e-3, m=2.0),
        xc.max_hoop_stress, xc.Cycle(0.0, 1.0), 0.15, max_steps=3,
    )  # fmt: skip
    xc.collect(run, tmp_path)
    header, _ = read_header(tmp_path)
    whole = read_steps(tmp_path, header)
    assert [step.memory.reuse.elimination.age for step in whole.steps] == [0, 1, 2]
    assert whole.fault == ""
    second = load(step_path(tmp_path, 1), CLASSES)["step"]
    assert second.memory.reuse.elimination.place.size == 0
    stored = load(step_path(tmp_path, 0), CLASSES)
    memory = stored["step"].memory
    memory = replace(memory, reuse=replace(memory.reuse, elimination=None))
    stored["step"] = replace(stored["step"], memory=memory)
    save(step_path(tmp_path, 0), stored, CLASSES)
    broken = read_steps(tmp_path, header)
    assert len(broken.steps) == 1
    assert broken.fault == "step_00001.npz is not whole"
    assert broken.rest == (step_path(tmp_path, 2), step_path(tmp_path, 1))
