"""Decks of Abaqus and CalculiX as problems, beside what CalculiX 2.20 answers to the same text."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import xcrack as xc
from support.decks import CCX, STORED, all_cases, box_cases, calculix, curved_cases

ANSWERS = np.load(STORED)
PRINTED = 1e-6  # relative, of numbers with seven digits
SAME = 1e-5  # of the largest displacement: the aim; measured 2e-7
STRAIGHT = {k: v for d in (2, 3) for order in (1, 2) for k, v in box_cases(d, order).items()}


def answer(path: Path, order: int) -> tuple[xc.Deck, np.ndarray, np.ndarray]:
    """The deck, displacements of its nodes in the mesh, and which nodes these are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        deck = xc.read_deck(path)
        solution = xc.solve(deck.problem(order=order))
    rows = [line.split(",") for line in path.read_text().split("*ELEMENT")[0].splitlines()[1:]]
    x = np.array(rows, dtype=float)[:, 1 : 1 + deck.mesh.dim]
    distance, node = cKDTree(solution.space.node_points).query(x)
    is_node = distance < 1e-9
    return deck, solution.u.reshape(-1, deck.mesh.dim)[node[is_node]], is_node


def difference(path: Path, order: int, stored: str) -> float:
    _, u, is_node = answer(path, order)
    expected = ANSWERS[stored][is_node, : u.shape[1]]
    return float(np.abs(u - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("name", STRAIGHT)
def test_straight_simplices_are_those_of_calculix(name, tmp_path):
    """The same discretisation: what differs is round-off and the seven digits of the print."""
    path = tmp_path / f"{name}.inp"
    path.write_text(STRAIGHT[name])
    assert difference(path, 1 if name.startswith(("C3D4", "CPE3")) else 2, name) < SAME


# Straight sides halve their error twice between the meshes; a beam has a singular clamped end.
@pytest.mark.parametrize(
    ("name", "share"), [("C3D10_ring", 0.27), ("C3D20_ring", 0.27), ("C3D20_beam", 0.5)]
)
def test_other_cells_converge_to_those_of_calculix(name, share, tmp_path):
    """Hexahedra are divided, curved sides are straight here: what differs is discretisation."""
    differences = []
    for n in (2, 4):
        path = tmp_path / f"{name}_{n}.inp"
        path.write_text(curved_cases(n)[path.stem])
        differences.append(difference(path, 2, path.stem))
    assert differences[0] < 0.02
    assert differences[1] < share * differences[0]


@pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not installed: numbers stored by it are")
def test_stored_numbers_are_those_of_calculix(tmp_path):
    for name, text in all_cases().items():
        (tmp_path / f"{name}.inp").write_text(text)
        u = calculix(tmp_path / f"{name}.inp")
        np.testing.assert_allclose(u, ANSWERS[name], atol=PRINTED * np.abs(u).max(), rtol=PRINTED)
