"""Meshes of other cells than linear simplices: what becomes of cells, sets and bad ones."""

import itertools
import time
from pathlib import Path

import meshio
import numpy as np
import pytest

import xcrack as xc
from xcrack import MeshError, XcrackError, XcrackWarning
from xcrack.mesh.linear import SHAPES, linear_mesh
from xcrack.mesh.raw import RawMesh, mesh_from_raw

DATA = Path(__file__).parents[1] / "data"
ROUND_OFF = 1e-12
SEED = 299792
pytestmark = pytest.mark.filterwarnings("ignore:the mesh has . cell sets")


def grid(n: tuple[int, int, int], shuffle: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Unit cube of hexahedra whose points are numbered at random."""
    axes = [np.linspace(0, 1, k + 1) for k in n]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    i = np.arange(len(points)).reshape([k + 1 for k in n])
    a, b = i[:-1, :-1], i[1:, :-1]
    c, d = i[1:, 1:], i[:-1, 1:]
    rows = np.stack(
        [x[..., s] for s in (slice(None, -1), slice(1, None)) for x in (a, b, c, d)], -1
    )
    rows = rows.reshape(-1, 8)
    if not shuffle:
        return points, rows
    new = np.random.default_rng(SEED).permutation(len(points))
    moved = np.empty_like(points)
    moved[new] = points
    return moved, new[rows]


def mixed(points: np.ndarray, hexahedra: np.ndarray) -> tuple[np.ndarray, list]:
    """A third hexahedra, a third prisms, a third pyramids around a new point."""
    third = len(hexahedra) // 3
    prisms = hexahedra[third : 2 * third]
    prisms = np.concatenate([prisms[:, [0, 1, 2, 4, 5, 6]], prisms[:, [0, 2, 3, 4, 6, 7]]])
    rest = hexahedra[2 * third :]
    centre = len(points) + np.arange(len(rest))
    faces = SHAPES["hexahedron"].faces
    pyramids = np.concatenate([np.column_stack([rest[:, f[::-1]], centre]) for f in faces])
    points = np.concatenate([points, points[rest].mean(axis=1)])
    blocks = [("hexahedron", hexahedra[:third]), ("wedge", prisms), ("pyramid", pyramids)]
    return points, blocks


def test_a_cube_of_all_kinds_conforms_whatever_the_numbers() -> None:
    """Prisms side by side share their own quadrilaterals; every other face is shared as well."""
    points, blocks = mixed(*grid((3, 3, 3)))
    sides = [
        ("quad", "top", f)
        for f in np.concatenate(
            [b[1][:, list(face)] for b in blocks[:1] for face in SHAPES["hexahedron"].faces]
        )
    ]
    top = np.array([f for _, _, f in sides if (points[f][:, 0] == 0).all()])
    raw = RawMesh(points, blocks, [("quad", "side", top), ("wedge", "prisms", blocks[1][1][:4])])
    with pytest.warns(XcrackWarning, match="9 hexahedra, 18 prisms, 54 pyramids are divided: 216"):
        mesh = mesh_from_raw(linear_mesh(raw, "cube", strict=False), "cube")
    assert len(mesh.cells) == 9 * 6 + 18 * 3 + 54 * 2
    assert mesh.volume.sum() == pytest.approx(1, rel=ROUND_OFF)
    assert len(mesh.boundary) == 6 * 9 * 2  # no face inside is open
    x = mesh.points[mesh.facet_sets["side"]]
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(len(top) / 9, rel=ROUND_OFF)
    assert mesh.volume[mesh.cell_sets["prisms"]].sum() == pytest.approx(4 / 54, rel=ROUND_OFF)
    with pytest.raises(MeshError, match=r"9 hexahedron, 18 wedge, 54 pyramid.*strict=True"):
        linear_mesh(raw, "cube", strict=True)


@pytest.mark.parametrize("kind", ["wedge", "hexahedron", "pyramid"])
def test_every_numbering_of_a_cell_fills_it(kind: str) -> None:
    corners = {
        "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
        "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
        "hexahedron": [*itertools.product((0, 1), (0, 1), (0, 1))],
    }[kind]
    x = np.array(corners, dtype=float)
    if kind == "hexahedron":
        x = x[[0, 4, 6, 2, 1, 5, 7, 3]]
    volume = {"wedge": 0.5, "pyramid": 1 / 3, "hexahedron": 1.0}[kind]
    rng = np.random.default_rng(SEED)
    for _ in range(40):
        new = rng.permutation(len(x))
        points = np.empty_like(x)
        points[new] = x
        raw = linearised_quietly(RawMesh(points, [(kind, new[None])]))
        ((name, cells),) = raw.blocks
        edges = points[cells][:, 1:] - points[cells][:, :1]
        assert name == "tetra"
        assert np.abs(np.linalg.det(edges)).sum() / 6 == pytest.approx(volume, rel=ROUND_OFF)


def linearised_quietly(raw: RawMesh) -> RawMesh:
    with pytest.warns(XcrackWarning, match="divided"):
        return linear_mesh(raw, "cell", strict=False)


def test_a_collapsed_hexahedron_is_the_prism_it_looks_like() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
    raw = RawMesh(points, [("hexahedron", np.array([[0, 1, 2, 2, 3, 4, 5, 5]]))])
    mesh = mesh_from_raw(linearised_quietly(raw), "cell")
    assert len(mesh.cells) == 3
    assert mesh.volume.sum() == pytest.approx(0.5, rel=ROUND_OFF)


def test_a_warped_hexahedron_is_divided_from_its_middle() -> None:
    """A corner pushed in by .4 of all sides: no division from corner 0 is left, one from inside."""
    cell = np.arange(8)[None]
    x = np.array([*itertools.product((0, 1), (0, 1), (0, 1))], float)[[0, 4, 6, 2, 1, 5, 7, 3]]
    x[3] = 0.4, 0.6, 0.4
    with pytest.warns(XcrackWarning, match="1 of them from a point in their middle"):
        split = linear_mesh(
            RawMesh(x, [("hexahedron", cell)], [("hexahedron", "all", cell)]), "warped", False
        )
    mesh = mesh_from_raw(split, "warped")
    assert len(mesh.cells) == len(mesh.cell_sets["all"]) == 12
    x[3] = 1.2, -0.2, 1.2
    with pytest.raises(MeshError, match=r"hexahedron .* at .*turned inside out"):
        linear_mesh(RawMesh(x, [("hexahedron", cell)]), "bad", strict=False)


def test_prisms_turned_inside_out_are_errors() -> None:
    points, rows = grid((1, 1, 2), shuffle=False)
    prisms = np.concatenate([rows[:, [0, 1, 2, 4, 5, 6]], rows[:, [0, 2, 3, 4, 6, 7]]])
    raw = RawMesh(points, [("wedge", prisms)])
    assert mesh_from_raw(linearised_quietly(raw), "good").volume.sum() == pytest.approx(1)
    twisted = prisms.copy()
    twisted[1] = twisted[1][[0, 1, 2, 4, 5, 3]]
    with pytest.raises(MeshError, match=r"wedge .*inside out or twisted \(1 such"):
        linear_mesh(RawMesh(points, [("wedge", twisted)]), "bad", strict=False)
    pushed = points.copy()
    pushed[pushed[:, 2] == 0.5] += (0, 0, 0.8)  # the middle layer beyond the upper end
    split = linearised_quietly(RawMesh(pushed, [("wedge", prisms)]))
    with pytest.raises(MeshError, match="folds over its neighbour"):
        mesh_from_raw(split, "bad")
    mirrored = prisms[:, [3, 4, 5, 0, 1, 2]]  # numbered left-handed, as some programs do
    split = linearised_quietly(RawMesh(points, [("wedge", mirrored)]))
    assert mesh_from_raw(split, "left").volume.sum() == pytest.approx(1)


def test_quadrilaterals_take_the_better_diagonal() -> None:
    points = np.array([(0, 0), (2, 0), (0.4, 0.4), (0, 2), (3, 3)], float)
    quads = np.array([[0, 1, 2, 3], [2, 1, 4, 3]])  # the first has a corner that looks inwards
    split = linearised_quietly(RawMesh(points, [("quad", quads)]))
    mesh = mesh_from_raw(split, "quads")
    assert len(mesh.cells) == 4
    assert mesh.volume.min() > 0.3
    crossed = RawMesh(points, [("quad", quads[:, [0, 2, 1, 3]])])
    with pytest.raises(MeshError, match="crosses itself"):
        linear_mesh(crossed, "crossed", strict=False)


def test_gmsh_of_order_2_and_of_quadrilaterals() -> None:
    with pytest.warns(XcrackWarning, match="18 cells of second or higher order.*straight"):
        mesh = xc.read_mesh(DATA / "order_2.msh")
    assert mesh.volume.sum() == pytest.approx(2, rel=ROUND_OFF)
    assert {"left", "right", "two sides", "facets_9", "body"} <= set(mesh.facet_sets)
    with pytest.warns(XcrackWarning, match="7 quadrilaterals are divided"):
        mesh = xc.read_mesh(DATA / "quads.msh")
    assert mesh.volume.sum() == pytest.approx(2, rel=ROUND_OFF)
    for name in ("order_2.msh", "quads.msh"):
        with pytest.raises(MeshError, match=r"line3|quad.*strict=True.*Mesh\.ElementOrder = 1"):
            xc.read_mesh(DATA / name, strict=True)


# After the Abaqus manual: two quadrilaterals of second order, the outer side curved.
CPS8 = """*Node
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, .5, 0.
6, 1.1, .5
7, .5, 1.
8, 0., .5
*Element, type=CPS8R, elset=Plate
1, 1, 2, 3, 4, 5, 6, 7, 8
*Surface, type=ELEMENT, name=Outside
Plate, S2
*Nset, nset=Bottom
1, 2, 5
"""


def test_abaqus_of_second_order(tmp_path: Path) -> None:
    (tmp_path / "cps8.inp").write_text(CPS8)
    with pytest.warns(XcrackWarning, match=r"moves them by up to 0\.1, 10\.0% of an edge"):
        mesh = xc.read_mesh(tmp_path / "cps8.inp")
    assert mesh.n_points == 4
    assert (mesh.points[mesh.facet_sets["Outside"]][..., 0] == 1).all()
    assert (mesh.points[mesh.facet_sets["Bottom"]][..., 1] == 0).all()
    with pytest.raises(MeshError, match=r"1 quad8.*strict"):
        xc.read_mesh(tmp_path / "cps8.inp", strict=True)


@pytest.mark.parametrize(("kind", "face", "z"), [("C3D8", "S2", 1), ("C3D8I", "S1", 0)])
def test_abaqus_faces_of_hexahedra(tmp_path: Path, kind: str, face: str, z: int) -> None:
    points, rows = grid((1, 1, 1))
    lines = ["*Node", *(f"{i}, {x}, {y}, {w}" for i, (x, y, w) in enumerate(points, 1))]
    lines += [f"*Element, type={kind}, elset=All", "1, " + ", ".join(map(str, rows[0] + 1))]
    lines += ["*Surface, name=Side", f"All, {face}"]
    (tmp_path / "hex.inp").write_text("\n".join(lines))
    with pytest.warns(XcrackWarning, match="1 hexahedra"):
        mesh = xc.read_mesh(tmp_path / "hex.inp")
    assert len(mesh.facet_sets["Side"]) == 2
    assert (mesh.points[mesh.facet_sets["Side"]][..., 2] == z).all()


def test_all_faces_of_abaqus_elements_are_those_of_the_shape() -> None:
    from xcrack.mesh.abaqus import _FACES

    for kind in ("pyramid", "wedge", "hexahedron"):
        ours = {frozenset(face) for face in SHAPES[kind].faces}
        assert {frozenset(face) for face in _FACES[kind]} == ours


def test_formats_that_need_another_program_name_it(tmp_path: Path) -> None:
    for name, says in [
        ("a.unv", r"gmsh a\.unv -save -o a\.msh"),
        ("a.bdf", "no GRID and no elements"),
        ("a.odb", "the input file"),
        ("a.step", r"mesh_step\(\"a\.step\""),
    ]:
        (tmp_path / name).write_text("nothing")
        with pytest.raises(XcrackError, match=says):
            xc.read_mesh(tmp_path / name)


def test_med_says_that_h5py_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    (tmp_path / "a.med").write_text("nothing")
    with pytest.raises(XcrackError, match=r"\.med file needs the package h5py"):
        xc.read_mesh(tmp_path / "a.med")


def edge_crack_K(mesh: xc.Mesh) -> float:
    polygon = [(-0.1, -0.2, 0.53), (0.42, -0.2, 0.53), (0.42, 1.2, 0.53), (-0.1, 1.2, 0.53)]
    surface = xc.plane_crack(polygon)
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E=1e3, nu=0.3),
        cracks=[surface],
        loads=[xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))],
        order=1,
    )
    sif = xc.stress_intensity(xc.solve(problem))
    inside = np.abs(sif.x[:, 1] - 0.5) < 0.25
    return float(sif.K_I[inside].mean())


def on_sides(points: np.ndarray, facets: np.ndarray) -> dict[str, np.ndarray]:
    z = points[facets][..., 2]
    return {"bottom": facets[(z == 0).all(axis=1)], "top": facets[(z == 1).all(axis=1)]}


@pytest.mark.slow
def test_K_of_hexahedra_and_of_second_order_tetrahedra(tmp_path: Path) -> None:
    """One body from three files of meshio's: the same K within the discretisation, 1 %."""
    points, rows = grid((8, 8, 9))
    faces = np.concatenate([rows[:, list(f)] for f in SHAPES["hexahedron"].faces])
    sides = on_sides(points, faces)
    blocks = [("hexahedron", rows), ("quad", np.concatenate(list(sides.values())))]
    data = {
        f"set:{name}": [np.zeros(len(rows)), np.repeat([name == s for s in sides], 64) * 1]
        for name in sides
    }
    meshio.Mesh(points, blocks, cell_data=data).write(tmp_path / "hex.vtu")
    with pytest.warns(XcrackWarning, match="576 hexahedra are divided: 3456 tetrahedra"):
        from_hexahedra = xc.read_mesh(tmp_path / "hex.vtu")
    assert len(from_hexahedra.facet_sets["top"]) == 128
    plain = xc.box((0, 0, 0), (1, 1, 1), (8, 8, 9))
    middle = plain.n_points + plain.cell_to_edge
    # Order of VTK: edges 01, 12, 20, 03, 13, 23; ours: 01, 02, 03, 12, 13, 23.
    tetra10 = np.concatenate([plain.cells, middle[:, [0, 3, 1, 2, 4, 5]]], axis=1)
    nodes = np.concatenate([plain.points, plain.points[plain.edges].mean(axis=1)])
    tops = {name: plain.facet_sets[name] for name in ("bottom", "top")}
    data = {
        f"set:{name}": [
            np.zeros(len(tetra10)),
            np.repeat([name == s for s in tops], 128).astype(int),
        ]
        for name in tops
    }
    blocks = [("tetra10", tetra10), ("triangle", np.concatenate(list(tops.values())))]
    meshio.Mesh(nodes, blocks, cell_data=data).write(tmp_path / "tetra10.vtu")
    with pytest.warns(XcrackWarning, match="3456 cells of second or higher order.*straight"):
        from_tetra10 = xc.read_mesh(tmp_path / "tetra10.vtu")
    K = [edge_crack_K(m) for m in (plain, from_hexahedra, from_tetra10)]
    assert K[2] == pytest.approx(K[0], rel=1e-9)  # the same mesh: round-off of the solver
    assert K[1] == pytest.approx(K[0], rel=0.01)  # other diagonals: discretisation


@pytest.mark.slow
def test_a_hundred_thousand_cells_are_divided_in_seconds() -> None:
    points, rows = grid((47, 47, 47))
    raw = RawMesh(points, [("hexahedron", rows)])
    begin = time.process_time()
    split = linearised_quietly(raw)
    assert time.process_time() - begin < 10
    assert sum(len(d) for _, d in split.blocks) == 6 * 47**3
