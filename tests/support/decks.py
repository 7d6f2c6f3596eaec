"""Decks of boxes and rings, written as another program would, and CalculiX to solve them."""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np

import xcrack as xc
from xcrack.mesh.mesh import local_edges

CCX = shutil.which("ccx")
STEEL = """*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL
{thickness}*MATERIAL, NAME=STEEL
*ELASTIC
2.1E5, 0.3
*DENSITY
7.8E-9
*EXPANSION, ZERO=20.
1.2E-5
"""
PRINT = "*NODE PRINT, NSET=NALL\nU\n*END STEP\n"
_MIDDLES = {2: [(0, 1), (1, 2), (2, 0)], 3: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]}
_TYPES = {(2, 1): "CPE3", (2, 2): "CPE6", (3, 1): "C3D4", (3, 2): "C3D10"}
_FACES = {
    2: [(0, 1), (1, 2), (2, 0)],
    3: [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    "hexahedron": [
        (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0),
    ],
}  # fmt: skip
_SIDES = {
    "LEFT": (0, 0), "RIGHT": (0, 1), "FRONT": (1, 0), "BACK": (1, 1), "LOW": (2, 0), "UP": (2, 1),
}  # fmt: skip


def rows(numbers: list[int]) -> list[str]:
    return [", ".join(map(str, numbers[k : k + 12])) for k in range(0, len(numbers), 12)]


def simplices(mesh: xc.Mesh, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and elements of a mesh: its points, at order 2 the middles of its edges too."""
    if order == 1:
        return mesh.points, mesh.cells
    local = {tuple(pair): k for k, pair in enumerate(local_edges(mesh.dim).tolist())}
    columns = [local[tuple(sorted(pair))] for pair in _MIDDLES[mesh.dim]]
    cells = np.concatenate([mesh.cells, mesh.n_points + mesh.cell_to_edge[:, columns]], axis=1)
    return np.concatenate([mesh.points, mesh.edge_middles]), cells


def bricks(lower: tuple, upper: tuple, n: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and hexahedra of twenty nodes of a box."""
    steps = [np.linspace(a, b, 2 * k + 1) for a, b, k in zip(lower, upper, n)]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    flat = [(0, 0), (2, 0), (2, 2), (0, 2)]
    corner = [(*place, z) for z in (0, 2) for place in flat]
    around = [(0, 1), (1, 2), (2, 3), (3, 0)]
    pairs = [*around, *((a + 4, b + 4) for a, b in around), *((k, k + 4) for k in range(4))]
    offset = corner + [tuple((a + b) // 2 for a, b in zip(corner[i], corner[j])) for i, j in pairs]
    cells = [
        [number[2 * i + a, 2 * j + b, 2 * k + c] for a, b, c in offset]
        for i in range(n[0]) for j in range(n[1]) for k in range(n[2])
    ]  # fmt: skip
    used, cells = np.unique(np.array(cells), return_inverse=True)
    return grid.reshape(-1, 3)[used], cells.reshape(-1, 20)


def deck_text(
    x: np.ndarray,
    cells: np.ndarray,
    element: str,
    conditions: str,
    bend: Callable[[np.ndarray], np.ndarray] = lambda x: x,
) -> str:
    """A deck of a body in a box, bent afterwards, with sets of its sides.

    Node sets LEFT, RIGHT, FRONT, BACK, LOW, UP (by x, y, z) and surfaces SLEFT ... SUP, all nodes
    NALL, all elements EALL.
    """
    flat = np.zeros((len(x), 3))
    flat[:, : x.shape[1]] = bend(x)
    lines = ["*NODE, NSET=NALL"]
    lines += [f"{n}, {a:.11e}, {b:.11e}, {c:.11e}" for n, (a, b, c) in enumerate(flat.tolist(), 1)]
    lines.append(f"*ELEMENT, TYPE={element}, ELSET=EALL")
    for n, cell in enumerate((cells + 1).tolist(), 1):
        text = ", ".join(map(str, cell[:15]))
        lines.append(f"{n}, {text}" + ("," if len(cell) > 15 else ""))
        if len(cell) > 15:
            lines.append(", ".join(map(str, cell[15:])))
    faces = _FACES["hexahedron"] if element.startswith(("C3D8", "C3D20")) else _FACES[x.shape[1]]
    for name, (axis, high) in _SIDES.items():
        if axis >= x.shape[1]:
            continue
        on = np.abs(x[:, axis] - (x[:, axis].max() if high else x[:, axis].min())) < 1e-9
        lines += [f"*NSET, NSET={name}", *rows((np.nonzero(on)[0] + 1).tolist())]
        lines.append(f"*SURFACE, NAME=S{name}")
        for k, face in enumerate(faces, 1):
            whole = on[cells[:, face]].all(axis=1)
            lines += [f"{n + 1}, S{k}" for n in np.nonzero(whole)[0].tolist()]
    return "\n".join(lines) + "\n" + conditions


def box_deck(mesh: xc.Mesh, order: int, conditions: str) -> str:
    """A deck of the simplices of a box."""
    x, cells = simplices(mesh, order)
    material = STEEL.format(thickness="1.\n" if mesh.dim == 2 else "")
    return deck_text(x, cells, _TYPES[mesh.dim, order], material + conditions + PRINT)


def calculix(path: Path) -> np.ndarray:
    """Displacements of all nodes as CalculiX prints them `(n, 3)`."""
    assert CCX is not None
    run = subprocess.run(
        [CCX, path.stem], cwd=path.parent, capture_output=True, text=True, check=False
    )
    blocks = re.split(r"\n *displacements .*\n", path.with_suffix(".dat").read_text())
    assert len(blocks) > 1, run.stdout[-2000:]
    table = np.array([line.split() for line in blocks[-1].strip().splitlines()], dtype=float)
    return table[np.argsort(table[:, 0]), 1:]


# --- the cases that are compared, and what CalculiX answers ---

STORED = Path(__file__).parents[1] / "data" / "calculix_2_20.npz"


def ring(x: np.ndarray) -> np.ndarray:
    """A quarter of a thick ring, from radius, angle and height."""
    r, angle, z = x.T
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def on_side(mesh: xc.Mesh, axis: int, value: float) -> list[str]:
    """Element and face of all faces on a plane, with a pressure on each: lines of a *DLOAD."""
    lines = []
    for k, face in enumerate(_FACES[mesh.dim], 1):
        on = np.abs(mesh.points[mesh.cells[:, face]][..., axis] - value) < 1e-9
        lines += [f"{n + 1}, P{k}, 55." for n in np.nonzero(on.all(axis=1))[0].tolist()]
    return lines


def box_cases(dim: int, order: int) -> dict[str, str]:
    """Decks of a box with supports and loads of many kinds."""
    mesh = xc.box((0,) * dim, (3.0, 1.0, 1.5)[:dim], (4, 2, 2)[:dim])
    x, _ = simplices(mesh, order)
    low = "LOW, 3\n" if dim == 3 else ""
    T = "\n".join(f"{n}, {20 + 50 * p[0] + 30 * p[1]:.11e}" for n, p in enumerate(x, 1))
    cases = {
        # whole sides held, forces at nodes: of two lines at one node the sum counts
        "cload": f"*BOUNDARY\nLEFT, 1, {dim}\n*STEP\n*STATIC\n*CLOAD\nRIGHT, 1, 3.\n"
        f"RIGHT, 2, -1.5\n{len(x)}, 1, 10.\n{len(x)}, 1, 7.\n",
        # planes of symmetry, pressure face by face and on a surface, gravity
        "dload": f"*BOUNDARY\nLEFT, 1\nFRONT, 2\n{low}*STEP\n*STATIC\n*DLOAD\n"
        + "\n".join([*on_side(mesh, 0, 3.0), "EALL, GRAV, 9810., 0., -1., 0."])
        + "\n*DSLOAD\nSBACK, P, -100.\n",
        # a temperature that is not uniform, an imposed displacement
        "thermal": f"*BOUNDARY\nLEFT, 1, {dim}\nRIGHT, 1, 1, 0.003\n"
        "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20.\n*STEP\n*STATIC\n*TEMPERATURE\n"
        + T
        + "\n",
        # single points, and a value that varies from point to point
        "points": f"*BOUNDARY\n1, 1, {dim}\n{mesh.n_points}, 2\nBACK, 1\n{low}*STEP\n*STATIC\n"
        "*DSLOAD\nSRIGHT, P, -100.\n",
        "moved": f"*BOUNDARY\nLEFT, 1, {dim}\n"
        + "".join(
            f"{n}, 1, 1, {1e-3 * (1 + p[1] ** 2):.11e}\n" for n, p in enumerate(x, 1) if p[0] == 3.0
        )
        + "*STEP\n*STATIC\n",
    }
    return {
        f"{_TYPES[dim, order]}_{name}": box_deck(mesh, order, text) for name, text in cases.items()
    }


def curved_cases(n: int) -> dict[str, str]:
    """Decks of cells that xcrack has not: hexahedra and curved ones."""
    steel = STEEL.format(thickness="")
    bent = "*BOUNDARY\nFRONT, 2\nBACK, 1\nLOW, 3\n*STEP\n*STATIC\n*DSLOAD\nSLEFT, P, 100.\n" + PRINT
    beam = "*BOUNDARY\nLEFT, 1, 3\n*STEP\n*STATIC\n*DSLOAD\nSUP, P, 10.\n" + PRINT
    round_body = simplices(xc.box((1.0, 0.0, 0.0), (2.0, np.pi / 2, 0.5), (2 * n, 3 * n, n)), 2)
    return {
        f"C3D10_ring_{n}": deck_text(*round_body, "C3D10", steel + bent, ring),
        f"C3D20_ring_{n}": deck_text(
            *bricks((1.0, 0.0, 0.0), (2.0, np.pi / 2, 0.5), (2 * n, 3 * n, n)), "C3D20",
            steel + bent, ring,
        ),
        f"C3D20_beam_{n}": deck_text(
            *bricks((0.0, 0.0, 0.0), (4.0, 1.0, 1.0), (4 * n, n, n)), "C3D20", steel + beam
        ),
    }  # fmt: skip


def all_cases() -> dict[str, str]:
    """Text of each deck by name."""
    pairs = [(dim, order) for dim in (2, 3) for order in (1, 2)]
    boxes = {name: text for pair in pairs for name, text in box_cases(*pair).items()}
    return {**boxes, **curved_cases(2), **curved_cases(4)}


def main() -> None:
    """Store what CalculiX answers: ``python -m support.decks`` in the folder `tests`."""
    import tempfile

    folder = Path(tempfile.mkdtemp())
    answers = {}
    for name, text in all_cases().items():
        (folder / f"{name}.inp").write_text(text)
        answers[name] = calculix(folder / f"{name}.inp").astype(np.float32)
    np.savez_compressed(STORED, **answers)


if __name__ == "__main__":
    main()


# An archive of Ansys, as CDWRITE makes it.
ARCHIVE = """/PREP7
ET,1,185
NBLOCK,6,SOLID,         8,         8
(3i9,6e21.13e3)
{nodes}N,R5.3,LOC,       -1,
EBLOCK,19,SOLID,         1,         1
(19i9)
        1        1        1        1        0        0        0        0        8        0        5        1        2        3        4        5        6        7        8
       -1
CMBLOCK,TOP     ,NODE,       2  ! users node component definition
(8i10)
         5        -8
CMBLOCK,WHOLE   ,ELEM,       1  ! users element component definition
(8i10)
         5
MPTEMP,R5.0, 1, 1,  0.0
ACEL,  0.0, 0.0, 0.0
F,5,FX,10.
FINISH
"""  # noqa: E501
