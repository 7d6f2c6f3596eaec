from pathlib import Path

import numpy as np
import pytest

from support.gmsh_models import gmsh_model
from xcrack import Mesh, MeshError, XcrackError, XcrackWarning, box, read_mesh, write_mesh

# Files that gmsh, meshio and pyvista wrote: data/make.py.
DATA = Path(__file__).parents[1] / "data"
PLATES = ["plate_41.msh", "plate_41_binary.msh", "plate_22.msh", "plate_22_binary.msh", "plate.inp"]
FORMATS = [("a.msh", "4.1"), ("b.msh", "2.2"), ("c.inp", "4.1"), ("d.vtu", "4.1"), ("e.vtk", "4.1")]
pytestmark = pytest.mark.filterwarnings("ignore:the mesh has . cell sets")
ROUND_OFF = 1e-12  # coordinates of 14 to 16 digits


def facets_of(mesh: Mesh, name: str) -> set[tuple[int, ...]]:
    return {tuple(f) for f in np.sort(mesh.facet_sets[name], axis=1).tolist()}


def length(mesh: Mesh, name: str) -> float:
    x = mesh.points[mesh.facet_sets[name]]
    return float(np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum())


@pytest.mark.parametrize("name", PLATES)
def test_physical_groups_become_sets(name):
    mesh = read_mesh(DATA / name)
    # Abaqus labels have no spaces, and gmsh names the nameless there.
    two, nine = (
        ("two_sides", "PhysicalLine9") if name.endswith("inp") else ("two sides", "facets_9")
    )
    assert mesh.dim == 2  # stored at z = 0.5
    assert mesh.volume.sum() == pytest.approx(2.0, rel=ROUND_OFF)
    x = mesh.points
    assert (x[mesh.facet_sets["left"]][..., 0] == 0).all()
    assert (x[mesh.facet_sets["right"]][..., 0] == 2).all()
    assert (x[mesh.facet_sets[nine]][..., 1] == 1).all()
    lengths = {"left": 1.0, "right": 1.0, two: 3.0, nine: 2.0, "body": 5**0.5, "boundary": 6.0}
    for group, expected in lengths.items():
        assert length(mesh, group) == pytest.approx(expected, rel=ROUND_OFF)
    assert {*lengths} <= set(mesh.facet_sets)
    assert len(mesh.cell_sets["body"]) == len(mesh.cells)
    lower = mesh.cell_sets["lower"]
    assert mesh.volume[lower].sum() == pytest.approx(1.0, rel=ROUND_OFF)
    center = x[mesh.cells[lower]].mean(axis=1)
    assert (center[:, 1] < center[:, 0] / 2).all()


@pytest.mark.parametrize("name", ["cube_41.msh", "cube_22.msh", "cube.inp"])
def test_tetrahedra_with_a_triangle_group(name):
    mesh = read_mesh(DATA / name)
    assert mesh.dim == 3
    assert mesh.volume.sum() == pytest.approx(1.0, rel=ROUND_OFF)
    assert (mesh.points[mesh.facet_sets["bottom"]][..., 2] == 0).all()
    assert len(mesh.cell_sets["body"]) == len(mesh.cells)


@pytest.mark.parametrize("name", ["no_groups_41.msh", "no_groups_22.msh"])
def test_without_groups_the_numbers_of_the_curves_name_the_sets(name):
    mesh = read_mesh(DATA / name)
    assert set(mesh.facet_sets) == {*(f"facets_{i}" for i in range(1, 6)), "boundary"}
    assert set(mesh.cell_sets) == {"cells_1", "cells_2"}
    assert (mesh.points[mesh.facet_sets["facets_2"]][..., 0] == 2).all()


def test_vtu_of_pyvista_and_meshio():
    mesh = read_mesh(DATA / "pyvista.vtu")
    assert mesh.volume.sum() == pytest.approx(2.0, rel=ROUND_OFF)
    center = mesh.points[mesh.cells].mean(axis=1)[:, 0]
    np.testing.assert_array_equal(mesh.cell_sets["core"], np.flatnonzero(center < 1))
    plain = read_mesh(DATA / "meshio.vtu")
    assert plain.dim == 2
    assert len(plain.facet_sets["boundary"]) == 4


WRONG = {
    "surface_in_space.msh": (MeshError, "triangles in 3D"),
    "plate_save_all.msh": (MeshError, r"Mesh\.SaveAll = 0"),
    "nothing_here.msh": (XcrackError, r"nothing_here\.msh.*does not exist"),
    "make.py": (XcrackError, r"make\.py.*'\.py'.*\.msh"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_read_says_why(name):
    error, says = WRONG[name]
    with pytest.raises(error, match=says):
        read_mesh(DATA / name)


@pytest.mark.parametrize("extension", [".msh", ".vtu", ".inp", ".vtk", ".mesh"])
def test_garbage_is_refused_by_name(extension, tmp_path, capsys):
    path = tmp_path / f"garbage{extension}"
    path.write_text("*NODE\nthis, is, no mesh\n$MeshFormat\n")
    with pytest.raises(MeshError, match="garbage"):
        read_mesh(path)
    assert capsys.readouterr() == ("", "")


def scene(d: int) -> Mesh:
    """Box with overlapping sets, one name in both dimensions, cells and facets in no set."""
    rng = np.random.default_rng(662607)
    plain = box((0.0,) * d, (1.0, 2.0, 3.0)[:d], (3, 2, 2)[:d])
    points = plain.points + rng.uniform(-0.05, 0.05, plain.points.shape)
    middle = plain.facets[plain.facet_to_cell[:, 1] >= 0][::3]
    facet_sets = {
        "left": plain.facet_sets["left"],
        "two sides": np.concatenate([plain.facet_sets["left"], plain.facet_sets["top"]]),
        "inside": middle,
        "core": plain.facet_sets["right"][:1],
    }
    cell_sets = {"core": np.arange(4), "odd": np.arange(1, len(plain.cells) - 2, 2)}
    return Mesh(points, plain.cells, facet_sets, cell_sets)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(("name", "version"), FORMATS)
def test_round_trip_keeps_every_bit_and_set(d, name, version, tmp_path):
    mesh = scene(d)
    write_mesh(tmp_path / name, mesh, msh_version=version)
    back = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(back.points, mesh.points)
    key = np.sort(mesh.cells, axis=1)
    order, back_key = np.lexsort(key.T), np.sort(back.cells, axis=1)
    back_order = np.lexsort(back_key.T)
    np.testing.assert_array_equal(back_key[back_order], key[order])
    assert set(back.facet_sets) == set(mesh.facet_sets)
    for group in mesh.facet_sets:
        assert facets_of(back, group) == facets_of(mesh, group)
    assert set(back.cell_sets) == set(mesh.cell_sets)
    for group, cells in mesh.cell_sets.items():
        assert {tuple(c) for c in back_key[back.cell_sets[group]]} == {tuple(c) for c in key[cells]}


@pytest.mark.parametrize(("name", "version"), FORMATS)
def test_a_set_called_boundary_gets_another_name_unless_it_is_the_boundary(name, version, tmp_path):
    """A partial one hid the mouth of an edge crack: K of 6.53 became 0.21 and 2.96."""
    plain = box((0, 0), (1, 1), 2)
    path = tmp_path / name
    for own in ("left", "boundary"):
        mesh = Mesh(plain.points, plain.cells, {"bndry123": plain.facet_sets[own]})
        write_mesh(path, mesh, msh_version=version)
        path.write_bytes(path.read_bytes().replace(b"bndry123", b"boundary"))
        if own == "left":
            with pytest.warns(XcrackWarning, match="2 facets, the boundary of the mesh has 8"):
                back = read_mesh(path)
            assert facets_of(back, "boundary_of_file") == facets_of(plain, "left")
        else:
            back = read_mesh(path)
            assert set(back.facet_sets) == {"boundary"}
        assert facets_of(back, "boundary") == facets_of(plain, "boundary")


def test_a_format_without_sets_says_so(tmp_path):
    mesh = box((0, 0), (1, 1), 2)
    with pytest.warns(XcrackWarning, match="carry no sets.*left"):
        write_mesh(tmp_path / "a.mesh", mesh)
    back = read_mesh(tmp_path / "a.mesh")
    np.testing.assert_allclose(back.points, mesh.points, atol=ROUND_OFF)


@pytest.mark.parametrize(
    ("name", "error", "says"),
    [
        ("a.docx", XcrackError, r"'\.docx'"),
        ("no/folder/a.msh", XcrackError, "folder"),
        ("a.inp", MeshError, "commas"),
        ("a.msh", MeshError, "quotation"),
    ],
)
def test_what_cannot_be_written_says_why(name, error, says, tmp_path):
    plain = box((0, 0), (1, 1), 1)
    mesh = Mesh(plain.points, plain.cells, {'a "b", c': plain.facet_sets["left"]})
    with pytest.raises(error, match=says):
        write_mesh(tmp_path / name, mesh)


def test_unknown_msh_version(tmp_path):
    with pytest.raises(XcrackError, match=r"4\.1"):
        write_mesh(tmp_path / "a.msh", box((0, 0), (1, 1), 1), msh_version="3")


# Written by hand after the Abaqus manual: part and assembly, plane strain elements, generated and
# nested sets, a surface of element faces, an orphan node, a set of nodes along a side.
CAE = """*Heading
** a square of four triangles
*Part, name=Plate
*Node
      1,  0., 0.
      2,  1., 0.
      3,  1., 1.
      4,  0., 1.
     10,  0.5, 0.5
     99,  7., 7.
*Element, type=CPE3
 1, 1, 2, 10
 2, 2, 3, 10
 3, 3, 4, 10
 4, 4, 1, 10
*Nset, nset=LeftNodes
 1, 4, 10
*Elset, elset=Some, generate
 1, 3, 2
*Elset, elset=Nested
 some, 4
*Elset, elset=_Top_S1, internal
 3
*Surface, type=ELEMENT, name=Top
_Top_S1, S1
2, S1
*End Part
*Assembly, name=Assembly
*Instance, name=Plate-1, part=Plate
*End Instance
*End Assembly
"""


def test_abaqus_sets_surfaces_and_plane_strain(tmp_path):
    (tmp_path / "cae.inp").write_text(CAE)
    mesh = read_mesh(tmp_path / "cae.inp")
    assert mesh.n_points == 5
    assert mesh.volume.sum() == 1.0
    assert list(mesh.cell_sets["Some"]) == [0, 2]
    assert list(mesh.cell_sets["Nested"]) == [0, 2, 3]
    assert facets_of(mesh, "Top") == {(2, 3), (1, 2)}
    assert facets_of(mesh, "LeftNodes") == {(0, 3)}


def test_abaqus_includes_and_its_errors(tmp_path):
    head, nodes = CAE.split("*Element")[0].split("Plate\n")
    (tmp_path / "nodes.inp").write_text(nodes)
    body = "*Element" + CAE.split("*Element")[1]
    (tmp_path / "all.inp").write_text(head + "Plate\n*Include, input=nodes.inp\n" + body)
    assert read_mesh(tmp_path / "all.inp").n_points == 5
    (tmp_path / "lost.inp").write_text(head + "Plate\n*Include, input=lost_nodes.inp\n" + body)
    with pytest.raises(MeshError, match="lost_nodes"):
        read_mesh(tmp_path / "lost.inp")
    (tmp_path / "two.inp").write_text(CAE + "*Part, name=Second\n*End Part\n")
    with pytest.warns(XcrackWarning, match=r"\*PART without instance"):
        read_mesh(tmp_path / "two.inp")
    (tmp_path / "hole.inp").write_text(CAE.replace("     10,", "     11,"))
    with pytest.raises(MeshError, match="node 10"):
        read_mesh(tmp_path / "hole.inp")
    (tmp_path / "quad.inp").write_text(CAE.replace("CPE3", "CPE6"))
    with pytest.raises(MeshError, match="ELEMENT"):
        read_mesh(tmp_path / "quad.inp")
    for k in range(300):
        (tmp_path / f"i{k}.inp").write_text(f"*INCLUDE, INPUT=i{k + 1}.inp\n")
    (tmp_path / "i300.inp").write_text(CAE)
    with pytest.raises(MeshError, match="one in the other"):
        read_mesh(tmp_path / "i0.inp")
    assert read_mesh(tmp_path / "i250.inp").n_points == 5
    many = "*NSET,NSET=a,GENERATE\n1,999999999999,1\n"
    (tmp_path / "many.inp").write_text(CAE + many)
    with pytest.raises(MeshError, match="too many members"):
        read_mesh(tmp_path / "many.inp")


def test_sets_off_the_body_are_left_out_with_a_warning(tmp_path):
    free = CAE.replace("*End Part", "*Element, type=T2D2, elset=Free\n 20, 1, 3\n*End Part")
    (tmp_path / "free.inp").write_text(free)
    with pytest.warns(XcrackWarning, match=r"free\.inp.*'Free'"):
        mesh = read_mesh(tmp_path / "free.inp")
    assert "Free" not in mesh.facet_sets


@pytest.mark.gmsh
@pytest.mark.parametrize("version", ["4.1", "2.2"])
@pytest.mark.parametrize("d", [2, 3])
def test_gmsh_reads_what_we_write(d, version, tmp_path):
    mesh = scene(d)
    write_mesh(tmp_path / "ours.msh", mesh, msh_version=version)
    with gmsh_model() as gmsh:
        gmsh.merge(str(tmp_path / "ours.msh"))
        groups = {
            (dim, gmsh.model.getPhysicalName(dim, tag)): tag
            for dim, tag in gmsh.model.getPhysicalGroups()
        }
        assert (d, "core") in groups
        assert (d - 1, "core") in groups
        nodes, xyz = gmsh.model.mesh.getNodesForPhysicalGroup(d - 1, groups[d - 1, "left"])
        np.testing.assert_array_equal(np.sort(nodes) - 1, np.unique(mesh.facet_sets["left"]))
        place = xyz.reshape(-1, 3)[np.argsort(nodes), :d]
        np.testing.assert_array_equal(place, mesh.points[np.unique(mesh.facet_sets["left"])])


@pytest.mark.skipif(not Path("/dev/zero").is_char_device(), reason="device not available")
def test_a_device_is_not_read_without_end(tmp_path):
    (tmp_path / "zeros.msh").symlink_to("/dev/zero")
    with pytest.raises(XcrackError, match="it is a device: give the path of a file"):
        read_mesh(tmp_path / "zeros.msh")
