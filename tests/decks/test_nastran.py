"""Decks of Nastran, against meshio's reader, and by hand in all three forms of a card."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest

import xcrack as xc
from xcrack.mesh.linear import SHAPES, base_kind
from xcrack.mesh.nastran import read_nastran

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                 (0, 1, 1)], dtype=float)  # fmt: skip
CORNERS = {
    "tetra": CUBE[[0, 1, 3, 4]], "hexahedron": CUBE, "wedge": CUBE[[0, 1, 3, 4, 5, 7]],
    "pyramid": np.concatenate([CUBE[:4], [(0.5, 0.5, 1.0)]]), "triangle": CUBE[:3],
    "quad": CUBE[:4],
}  # fmt: skip


@pytest.mark.parametrize(
    "kind",
    ["tetra", "tetra10", "hexahedron", "hexahedron20", "wedge", "pyramid", "triangle",
     "triangle6", "quad", "quad8"],
)  # fmt: skip
@pytest.mark.parametrize("form", ["fixed-small", "fixed-large", "free"])
def test_elements_are_those_that_meshio_writes(kind, form, tmp_path):
    """One of each kind, by another program; the middles of edges are where VTK has them."""
    shape = SHAPES[base_kind(kind)]
    x = CORNERS[base_kind(kind)]
    if kind[-1].isdigit():
        x = np.concatenate([x, [x[list(edge)].mean(axis=0) for edge in shape.edges]])
    path = tmp_path / "part.bdf"
    mesh = meshio.Mesh(x, [(kind, np.arange(len(x))[None])], cell_data={"nastran:ref": [[7]]})
    with pytest.MonkeyPatch.context() as patch:  # it tells of what it leaves out
        patch.setattr("builtins.print", lambda *_: None)
        meshio.nastran.write(path, mesh, point_format=form, cell_format="fixed-small")
    raw, uses = read_nastran(path)
    ((kind_of_block, rows),) = raw.blocks
    assert kind_of_block == kind
    np.testing.assert_allclose(raw.points[rows[0]], x, atol=1e-7)  # of eight columns
    assert {use.keyword for use in uses if use.is_used} >= {"GRID"}
    assert [name for _, name, _ in raw.sets] == ["cells_7"]


@pytest.mark.parametrize(
    ("card", "kind", "pairs"),
    [  # ends of the edges on whose middles its further nodes lie, in the order of the card
        ("CPENTA", "wedge15", [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5),
                               (5, 3)]),
        ("CPYRAM", "pyramid13", [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)]),
    ],
)  # fmt: skip
def test_middles_of_prisms_and_pyramids(card, kind, pairs, tmp_path):
    """In the order of the MSC Nastran Quick Reference Guide: base, upright edges, top."""
    x = CORNERS[base_kind(kind)]
    x = np.concatenate([x, [x[list(pair)].mean(axis=0) for pair in pairs]])
    numbers = [5, 7, *range(1, len(x) + 1)]
    lines = [f"GRID,{n},,{a},{b},{c}" for n, (a, b, c) in enumerate(x.tolist(), 1)]
    cut = [",".join(map(str, numbers[k : k + 8])) for k in range(0, len(numbers), 8)]
    path = tmp_path / "part.bdf"
    path.write_text("\n".join([*lines, f"{card},{cut[0]}", *(f"+,{row}" for row in cut[1:])]))
    raw, _ = read_nastran(path)
    ((kind_of_block, rows),) = raw.blocks
    assert kind_of_block == kind
    corners = CORNERS[base_kind(kind)]
    ends = np.array(SHAPES[base_kind(kind)].edges)
    wanted = np.concatenate([corners, corners[ends].mean(axis=1)])  # VTK: base, top, upright edges
    assert raw.points[rows[0]].tolist() == wanted.tolist()


TEXT = """SOL 101
CEND
BEGIN BULK
$ three forms of one node each, reals without an e
GRID           1             0.0     0.0     0.0
GRID,2,,1.,,
GRID*                  3                             0.0           10.-1
*                    0.0
INCLUDE 'more.bdf'
{cell}
ENDDATA
GRID,1,,9.,9.,9.
"""
CELL = "CTETRA,5,7,1,2,3,4"


def deck(folder: Path, cell: str = CELL, text: str = TEXT, more: str = "GRID,4,0,0.,0.,+2.5-1\n"):
    (folder / "more.bdf").write_text(more)
    (folder / "part.bdf").write_text(text.format(cell=cell))
    return folder / "part.bdf"


def test_three_forms_of_a_card_and_an_included_file(tmp_path):
    mesh = xc.read_mesh(deck(tmp_path))
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.25]]
    assert mesh.volume.sum() == pytest.approx(0.25 / 6)
    assert list(mesh.cell_sets) == ["cells_7"]


def test_a_cell_may_lack_some_of_its_middles(tmp_path):
    """Nastran allows it; then its corners count."""
    raw, _ = read_nastran(deck(tmp_path, "CTETRA,5,7,1,2,3,4,1,\n+,2"))
    assert [(kind, rows.tolist()) for kind, rows in raw.blocks] == [("tetra", [[0, 1, 2, 3]])]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"cell": "CTETRA,5,7,1,2,3,9"}, "part.bdf, line 10: CTETRA: it names node 9"),
        ({"cell": "CTETRA,5,7,1,2,3"}, "line 10: CTETRA: '' is no whole number above 0"),
        ({"cell": "CTETRA"}, "line 10: CTETRA: '' is no whole number above 0: give the number of"),
        ({"more": "GRID,4,0,0.,nan,1.\n"}, "more.bdf, line 1: GRID: 'nan' is no finite number"),
        ({"more": "GRID,3,0,0.,0.,1.\n"}, "more.bdf, line 1: GRID: there is a node 3 already"),
        ({"more": "GRID,4,2,0.,0.,1.\n"}, "more.bdf, line 1: GRID: the point is given in the coor"),
        ({"more": "INCLUDE 'part.bdf'\n"}, "part.bdf includes itself"),
        ({"text": TEXT.replace("more", "none")}, "part.bdf, line 9: INCLUDE: there is no file"),
        ({"cell": ""}, "no GRID and no elements"),
    ],
)
def test_wrong_cards_are_refused_with_file_and_line(changed, words, tmp_path):
    with pytest.raises(xc.MeshError, match=re.escape(words)):
        xc.read_mesh(deck(tmp_path, **changed))
