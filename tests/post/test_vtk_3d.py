"""Files of 3D bodies: nothing is lost, every jump is in them, the crack faces are triangles."""

import meshio
import numpy as np
import pytest

import xcrack as xc
from xcrack import History, Step
from xcrack.output.lip_faces_3d import lip_faces
from xcrack.output.pieces import piece_cells, pieces
from xcrack.runs.table import polylines

N = 6


def problem(crack, loads, n=N, **options):
    return xc.Problem(
        xc.box((-1, -1, -1), (1, 1, 1), n),
        xc.Isotropic(E=1.0, nu=0.3),
        [crack] if crack is not None else [],
        loads=loads,
        **{"order": 1} | options,
    )


def edge_crack():
    """Straight front, through the body along y; it cuts no mesh point."""
    corners = [(-1.3, -1.4, 0.031), (0.083, -1.4, 0.047), (0.083, 1.4, 0.047), (-1.3, 1.4, 0.031)]
    return xc.plane_crack(corners)


def pull(sign=1.0):
    up, along = np.array([0.1, 0.0, sign]), np.array([0.0, 0.0, 0.1])
    return [
        xc.traction("top", up),
        xc.traction("bottom", -up),
        xc.traction("right", along),
        xc.traction("left", -along),
    ]


@pytest.fixture(scope="module")
def pulled():
    return xc.solve(problem(edge_crack(), pull()))


@pytest.fixture(scope="module")
def penny():
    crack = xc.penny_crack((0.013, 0.024, 0.031), (1, 2, 3), 0.5)
    return xc.solve(problem(crack, [xc.pressure("boundary", 1.0)], contact="on"))


def read(path):
    grid = meshio.read(path)
    for values in grid.point_data.values():
        assert np.isfinite(values).all()
    return grid


def read_poly(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    arrays = []
    for part in (data.GetPointData(), data.GetCellData()):
        names = [part.GetArrayName(i) for i in range(part.GetNumberOfArrays())]
        arrays.append({name: vtk_to_numpy(part.GetArray(name)) for name in names})
        assert all(np.isfinite(values).all() for values in arrays[-1].values())
    return vtk_to_numpy(data.GetPoints().GetData()), *arrays, data


def volume(x):
    return np.linalg.det(x[:, 1:] - x[:, :1]) / 6


def test_pieces_fill_the_body(tmp_path, pulled):
    """Round-off: sums of some thousand volumes; no piece is turned inside out."""
    assert pieces(pulled).volume.sum() == pytest.approx(8.0, rel=1e-13)
    grid = read(xc.write(pulled, tmp_path / "body")[0])
    turned = np.concatenate([volume(grid.points[block.data[:, :4]]) for block in grid.cells])
    assert turned.min() >= -1e-18
    assert turned.sum() == pytest.approx(8.0, rel=1e-13)


def test_midpoints_lie_in_the_middle_in_the_order_of_vtk(tmp_path, pulled):
    grid = read(xc.write(pulled, tmp_path / "body")[0])
    x = grid.points[grid.cells_dict["tetra10"]]
    pairs = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
    for node, (i, j) in enumerate(pairs, start=4):
        np.testing.assert_allclose(x[:, node], (x[:, i] + x[:, j]) / 2, atol=1e-14)


def test_points_on_the_lips_exist_twice_and_carry_the_jump(pulled):
    """Round-off: pieces and `displacement` evaluate the same functions at the same points."""
    body = pieces(pulled)
    place = np.round(body.points, 10)
    _, number, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    assert count.max() == 2
    order = np.argsort(number.ravel(), kind="stable")
    pairs = order[np.isin(number.ravel()[order], np.nonzero(count == 2)[0])].reshape(-1, 2)
    x = body.points[pairs[:, 0]]
    jump = np.diff(body.displacement[pairs], axis=1)[:, 0]
    plus, minus = pulled.displacement(x, side=1), pulled.displacement(x, side=-1)
    up = np.sign(((plus - minus) * jump).sum(axis=1))[:, None]
    np.testing.assert_allclose(up * jump, plus - minus, atol=1e-11 * np.abs(plus).max())
    # Every vertex of the crack faces is there, but those on the front, which both crack faces
    # share.
    corners = pulled.space.cuts[0].lip_points(pulled.problem.mesh).reshape(-1, 3)
    inner = corners[corners[:, 0] < 0.083 - 1e-6]
    assert np.linalg.norm(inner[:, None] - x, axis=2).min(axis=1).max() < 1e-9


def test_sub_cells_lie_on_one_side(pulled):
    """A piece off the crack has phi of one sign: linear level sets, cut exactly."""
    cells = piece_cells(pulled.space)
    cut = pulled.space.cuts[0]
    phi = np.einsum(
        "svb,sb->sv", cells.bary, cut.level_set.phi[pulled.problem.mesh.cells[cells.cell]]
    )
    split = (cut.is_cut | cut.is_tip)[cells.cell]
    assert (cells.side[split, 0, None] * phi[split] > -1e-13).all()


def test_a_body_without_cracks_is_its_mesh(tmp_path):
    solution = xc.solve(problem(None, pull(), n=3))
    files = xc.write(solution, tmp_path / "plain")
    assert [file.name for file in files] == ["plain.vtu"]
    grid = read(files[0])
    np.testing.assert_array_equal(grid.points, solution.problem.mesh.points)
    np.testing.assert_array_equal(grid.cells_dict["tetra"], solution.problem.mesh.cells)


def test_hydrostatic_pressure_is_written_exactly(tmp_path, penny):
    """Stress -p on the diagonal, von Mises 0, pressure p on the crack faces: a patch test.

    Round-off, magnified by the condition of the enriched functions.
    """
    files = xc.write(penny, tmp_path / "penny")
    assert [f.name for f in files] == ["penny.vtu", "penny_lips.vtp", "penny_fronts.vtp"]
    grid = read(files[0])
    expected = np.broadcast_to([-1.0, -1, -1, 0, 0, 0], (len(grid.points), 6))
    np.testing.assert_allclose(grid.point_data["stress"], expected, atol=1e-8)
    np.testing.assert_allclose(grid.point_data["von_mises"], 0, atol=1e-8)
    _, at_points, at_cells, data = read_poly(files[1])
    np.testing.assert_allclose(at_points["pressure"], 1, rtol=1e-8)
    np.testing.assert_allclose(at_cells["pressure_mean"], 1, rtol=1e-8)
    assert (at_cells["closed"] == 1).all()
    assert data.GetNumberOfPolys() == len(penny.space.cuts[0].lip_bary)


def test_lips_are_the_crack(penny, pulled):
    """Area and normal against geometry.

    The plane crack is exact; the penny's front is made of straight pieces in cells a third of
    its radius wide: discretisation.
    """
    flat = lip_faces(pulled, 0)
    along = np.array([1.383, 0, 0.016])
    length = 1.083 * np.linalg.norm(along) / along[0]
    assert flat.area.sum() == pytest.approx(2 * length, rel=1e-10)
    normal = np.array([-along[2], 0, along[0]]) / np.linalg.norm(along)
    upward = np.sign(flat.normal[0] @ normal)
    np.testing.assert_allclose(upward * flat.normal, np.broadcast_to(normal, flat.normal.shape),
                               atol=1e-9)  # fmt: skip
    x = flat.points[flat.front]
    assert np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum() == pytest.approx(2, rel=1e-10)
    np.testing.assert_allclose(x[..., 0], 0.083, atol=1e-9)
    disc = lip_faces(penny, 0)
    assert disc.area.sum() == pytest.approx(np.pi / 4, rel=0.05)
    assert len(disc.mouth) == 0
    turned = disc.points[disc.triangles]
    turned = np.cross(turned[:, 1] - turned[:, 0], turned[:, 2] - turned[:, 0]).sum(axis=0)
    assert turned @ [1, 2, 3] == pytest.approx(2 * disc.area.sum() * np.sqrt(14), rel=1e-3)


def test_lips_move_with_the_body(pulled):
    """Jump and gap at the vertices are those of the solution, zero on the front; round-off."""
    lips = lip_faces(pulled, 0)
    scale = np.abs(lips.plus).max()
    np.testing.assert_allclose(lips.jump[np.unique(lips.front)], 0, atol=1e-6 * scale)
    inner = lips.points[:, 0] < 0.05
    x = lips.points[inner]
    expected = pulled.displacement(x, side=1) - pulled.displacement(x, side=-1)
    np.testing.assert_allclose(lips.jump[inner], expected, atol=1e-9 * scale)
    assert (lips.gap[inner] > 0).all()
    # The mean gap of a triangle lies between the smallest and the largest at its vertices,
    # but near the front, where the root of the distance is no straight line.
    at = lips.gap[lips.triangles]
    far = lips.points[lips.triangles][..., 0].max(axis=1) < -0.5
    assert (lips.mean_gap > at.min(axis=1) - 1e-6 * scale)[far].all()
    assert (lips.mean_gap < at.max(axis=1) + 1e-2 * scale)[far].all()


def test_fronts_have_their_frames_and_K(tmp_path, penny):
    tip = penny.space.tips[0]
    x, at_points, at_cells, data = read_poly(xc.write(penny, tmp_path / "a")[2])
    np.testing.assert_array_equal(x, tip.x)
    np.testing.assert_array_equal(at_points["ahead"], tip.frame[:, 0])
    assert at_cells["front"].tolist() == [0]
    assert data.GetNumberOfLines() == 1
    assert data.GetCell(0).GetNumberOfPoints() == len(tip.x) + 1  # closed
    rng = np.random.default_rng(20934)
    m = len(tip.x)
    K = rng.normal(size=(m, 3))
    sif = made_up(tip, K)
    _, at_points, _, _ = read_poly(xc.write(penny, tmp_path / "b", sif=sif)[2])
    for k, name in enumerate(("K_I", "K_II", "K_III")):
        np.testing.assert_array_equal(at_points[name], K[:, k])
    with pytest.raises(xc.ProblemError, match="one SIF for each of the 1"):
        xc.write(penny, tmp_path / "c", sif=[sif, sif])


def made_up(tip, K):
    m = len(tip.x)
    zero = np.zeros(m)
    s = np.append(0, np.cumsum(np.linalg.norm(np.diff(tip.x, axis=0), axis=1)))
    return xc.SIF(
        tip.x,
        tip.frame,
        K,
        zero,
        0 * K,
        s,
        np.zeros(m, int),
        np.zeros(m, bool),
        np.zeros(m, bool),
        zero,
    )


def test_the_same_solution_gives_the_same_bytes(tmp_path, penny):
    first, second = (xc.write(penny, tmp_path / name) for name in ("a", "b"))
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_a_series_has_bodies_lips_and_fronts(tmp_path, penny):
    """A step with its solution, and one that was read from disk."""
    tip = penny.space.tips[0]
    sif = made_up(tip, np.ones((len(tip.x), 3)))
    part = (np.zeros(len(tip.x)),)
    steps = [
        Step(k, float(k), penny.space.cracks, ((sif,),), part, part, part, part, part, solutions)
        for k, solutions in enumerate([(penny,), ()])
    ]
    History(tuple(steps), "enough").write(tmp_path)
    names = sorted(file.name for file in (tmp_path / "steps").iterdir())
    assert names == [
        "step_00000_state_0.vtu", "step_00000_state_0_fronts.vtp", "step_00000_state_0_lips.vtp",
        "step_00001_cracks.vtp",
    ]  # fmt: skip
    text = (tmp_path / "history.pvd").read_text()
    assert all(name in text for name in names)
    _, at_points, _, _ = read_poly(tmp_path / "steps" / names[1])
    assert (at_points["K_I"] == 1).all()
    x, _, at_cells, data = read_poly(tmp_path / "steps" / names[3])
    crack = penny.space.cracks[0]
    np.testing.assert_array_equal(x, crack.points)
    assert data.GetNumberOfPolys() == len(crack.faces)
    assert data.GetNumberOfLines() == 1
    assert len(at_cells["crack"]) == len(crack.faces) + 1
    assert polylines(penny.space.cracks) == (tmp_path / "steps" / names[3]).read_text()
