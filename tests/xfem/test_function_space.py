"""Functions: gradients against finite differences, values at nodes, and numbers of unknowns."""

import numpy as np
import pytest

import xcrack as xc
from support import scenes_2d as scenes


def spaces():
    """Problems that enter every kind of batch."""
    mesh = scenes.perturbed(10, seed=44)
    steel = xc.Isotropic(1.0, 0.3, "strain")
    for order in (1, 2):
        for cracks in (
            [[(-1.2, 0.03), (0.083, 0.047)]],
            [[(-1.2, 0.0), (0.0, 0.0)], [(0.5, 0.41), (1.2, 0.47)]],
            [[(-0.45, -0.3), (0.3, 0.4)]],
            [[(-1.2, 0.1), (1.2, 0.3)]],
        ):
            lines = [xc.line_crack(c) for c in cracks]
            supports, load = [xc.fix("top"), xc.fix("bottom")], xc.body_force((0.0, 1.0))
            yield xc.solve(xc.Problem(mesh, steel, lines, supports, [load], "off", order)).space


@pytest.mark.parametrize("number", range(8))
def test_gradients_are_those_of_the_values(number):
    space = list(spaces())[number]
    rng = np.random.default_rng(number)
    for batch, _ in space.batches(space.enriched_cells):
        row = np.repeat(np.arange(len(batch.cells)), 12)
        bary = 0.05 + 0.85 * rng.dirichlet(np.ones(3), len(row))
        nodes = space.mesh.cells[batch.cells[row]]
        phi = [np.einsum("qb,qb->q", bary, cut.level_set.phi[nodes]) for cut in space.cuts]
        side = np.where(np.stack(phi, axis=1) >= 0, 1, -1)
        values, gradient = space.tabulate(batch, row, bary, side)
        without, alone = space.tabulate(batch, row, bary, side, values=False)
        assert without.size == 0 < values.size
        assert (alone == gradient).all()
        size = space.mesh.cell_size[batch.cells][row]
        near = np.full(len(row), np.inf)
        x = np.einsum("qb,qbd->qd", bary, space.mesh.points[space.mesh.cells[batch.cells[row]]])
        for tip in space.tips:
            near = np.minimum(near, np.linalg.norm(x - tip.x, axis=1))
        step = 1e-5 * np.minimum(size, near)
        for axis in range(2):
            shift = space.mesh.gradient[batch.cells[row]][:, :, axis] * step[:, None]
            # phi keeps its sign over a step: points are far from the crack faces compared with it.
            high, _ = space.tabulate(batch, row, bary + shift, side)
            low, _ = space.tabulate(batch, row, bary - shift, side)
            slope = (high - low) / (2 * step[:, None])
            scale = np.abs(gradient).max(axis=(1, 2))[:, None]
            assert (np.abs(slope - gradient[..., axis]) / scale).max() < 1e-5  # differences


@pytest.mark.parametrize("number", range(8))
def test_shifted_functions_vanish_at_nodes(number):
    """The standard unknown of a mesh point is the displacement there.

    Tip functions ride on linear hats: between the points, at the midpoints of order 2, they act.
    """
    space = list(spaces())[number]
    x = space.node_points
    for batch, _ in space.batches(space.enriched_cells):
        nodes = space.cell_nodes[batch.cells]
        for k in range(nodes.shape[1]):
            bary = np.zeros((len(batch.cells), 3))
            inverse = x[nodes[:, k]] - space.mesh.points[space.mesh.cells[batch.cells, 0]]
            bary[:, 1:] = np.einsum("cbd,cd->cb", space.mesh.gradient[batch.cells][:, 1:], inverse)
            bary[:, 0] = 1 - bary[:, 1:].sum(axis=1)
            side = np.stack([s[nodes[:, k]] for s in space.node_side], axis=1)
            on_lip = np.zeros(len(nodes), dtype=bool)
            for cut in space.cuts:
                phi = cut.level_set.phi[space.mesh.cells[batch.cells]]
                on_lip |= np.abs(np.einsum("cb,cb->c", bary, phi)) < 1e-12
            values, _ = space.tabulate(batch, np.arange(len(nodes)), bary, side)
            first, last = (
                nodes.shape[1],
                values.shape[1] if k < 3 else nodes.shape[1] * (1 + len(batch.cracks)),
            )
            extra = values[~on_lip, first:last]
            assert np.abs(extra).max(initial=0.0) < 1e-7  # sqrt of round-off near r = 0


def test_numbers_of_unknowns_add_up():
    space = next(iter(spaces()))
    n_heaviside = sum(int((h >= 0).sum()) for h in space.heaviside)
    n_tip = sum(4 * int((t.point_to_function >= 0).sum()) for t in space.tips)
    assert space.n_dof == 2 * (space.n_nodes + n_heaviside + n_tip)
