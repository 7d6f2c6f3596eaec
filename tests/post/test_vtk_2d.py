"""Files for ParaView: every jump is in them, nothing is lost, nothing is nan."""

import meshio
import numpy as np
import pytest

import xcrack as xc

CRACKS = {
    "edge": [(-1.2, 0.03), (0.083, 0.047)],
    "inside, kinked": [(-0.43, -0.31), (0.1, 0.02), (0.52, 0.44)],
    "on mesh lines": [(-0.5, 0.0), (0.3, 0.0)],
    "tip on an edge": [(-1.2, -0.05), (0.1, 0.1)],
}


def scene(crack="edge", order=2, sign=1.0, n=10, **options):
    """A square pulled (or pressed) at top and bottom."""
    return xc.Problem(
        xc.box((-1, -1), (1, 1), n),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[xc.line_crack(CRACKS[crack])] if crack else [],
        loads=[
            xc.traction("top", (0.1, sign)),
            xc.traction("bottom", (-0.1, -sign)),
            xc.traction("right", (0.0, 0.1)),
            xc.traction("left", (0.0, -0.1)),
        ],
        order=order,
        **options,
    )


@pytest.fixture(scope="module")
def pulled():
    return xc.solve(scene())


@pytest.fixture(scope="module")
def pressed():
    return xc.solve(scene("inside, kinked", sign=-1.0))


def twins(points):
    """Pairs of points at the same place, to round-off of a box of size 2."""
    _, place, count = np.unique(
        np.round(points, 10), axis=0, return_inverse=True, return_counts=True
    )
    assert count.max() <= 2
    order = np.argsort(place.ravel(), kind="stable")
    return order[np.isin(place.ravel()[order], np.nonzero(count == 2)[0])].reshape(-1, 2)


def read(path):
    grid = meshio.read(path)
    for values in grid.point_data.values():
        assert np.isfinite(values).all()
    for blocks in grid.cell_data.values():
        assert all(np.isfinite(values).all() for values in blocks)
    return grid


def read_lips(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    at_points = data.GetPointData()
    arrays = {
        at_points.GetArrayName(i): vtk_to_numpy(at_points.GetArray(i))
        for i in range(at_points.GetNumberOfArrays())
    }
    assert all(np.isfinite(values).all() for values in arrays.values())
    return vtk_to_numpy(data.GetPoints().GetData()), arrays, data


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("crack", CRACKS)
def test_the_jump_is_in_the_grid(tmp_path, crack, order):
    """Round-off: the file's displacements are evaluated where `displacement` evaluates them."""
    solution = xc.solve(scene(crack, order))
    grid = read(xc.write(solution, tmp_path / "body")[0])
    pairs = twins(grid.points)
    x = grid.points[pairs[:, 0], :2]
    jump = np.diff(grid.point_data["displacement"][pairs], axis=1)[:, 0, :2]
    plus, minus = solution.displacement(x, side=1), solution.displacement(x, side=-1)
    scale = np.abs(plus).max()
    up = np.sign((jump * (plus - minus)).sum(axis=1))[:, None]
    np.testing.assert_allclose(up * jump, plus - minus, rtol=0, atol=1e-11 * scale)
    # The crack faces are all there: from end to end, both ends of each of their segments.
    corners = solution.space.cuts[0].lip_points(solution.space.mesh).reshape(-1, 2)
    tips = np.array([tip.x for tip in solution.space.tips])
    at_tip = (np.linalg.norm(corners[:, None] - tips, axis=2) < 1e-9).any(axis=1)
    distance = np.linalg.norm(corners[~at_tip][:, None] - x, axis=2).min(axis=1)
    assert distance.max() < 1e-9


def test_the_jump_is_that_of_the_lips(tmp_path, pulled):
    """Quadratic interpolation between points of the grid; tolerance: their distance."""
    grid, x = read(xc.write(pulled, tmp_path / "body")[0]), pulled.lips[0].x
    pairs = twins(grid.points)
    s = grid.points[pairs[:, 0], 0]
    order = np.argsort(s)
    opening = np.abs(np.diff(grid.point_data["displacement"][pairs], axis=1)[:, 0])
    for i in (0, 1):
        between = np.interp(x[:, 0], s[order], opening[order, i])
        inside = (x[:, 0] > s.min()) & (x[:, 0] < s.max())
        expected = np.abs(pulled.jump(0)[:, i])
        np.testing.assert_allclose(
            between[inside], expected[inside], atol=0.01 * np.abs(pulled.jump(0)).max()
        )


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("crack", [*CRACKS, None])
def test_pieces_fill_the_body(tmp_path, crack, order):
    """Round-off: sums of some thousand areas."""
    solution = xc.solve(scene(crack, order))
    grid = read(xc.write(solution, tmp_path / "body.vtu")[0])
    x = grid.points[np.concatenate([block.data[:, :3] for block in grid.cells])][:, :, :2]
    turn = np.linalg.det(x[:, 1:] - x[:, :1]) / 2
    assert turn.min() >= -1e-18
    assert turn.sum() == pytest.approx(4.0, rel=1e-13)


@pytest.mark.parametrize("crack", CRACKS)
def test_pieces_fit_each_other(tmp_path, crack):
    """An edge belongs to two pieces, but on the boundary and on the crack faces."""
    body = read(xc.write(xc.solve(scene(crack)), tmp_path / "body")[0])
    corners = np.concatenate([block.data[:, :3] for block in body.cells])
    ends = np.sort(corners[:, [(0, 1), (0, 2), (1, 2)]].reshape(-1, 2), axis=1)
    edge, count = np.unique(ends, axis=0, return_counts=True)
    assert count.max() == 2
    lone = body.points[edge[count == 1]][..., :2]
    on_boundary = (np.abs(np.abs(lone) - 1) < 1e-12).all(axis=1).any(axis=1)
    paired = np.isin(edge[count == 1], twins(body.points)).any(axis=1)
    assert (on_boundary | paired).all()


def test_midpoints_lie_in_the_middle_in_the_order_of_vtk(tmp_path, pulled):
    grid = read(xc.write(pulled, tmp_path / "body")[0])
    cells = grid.cells_dict["triangle6"]
    x = grid.points[cells]
    for node, (i, j) in zip((3, 4, 5), ((0, 1), (1, 2), (2, 0)), strict=True):
        np.testing.assert_allclose(x[:, node], (x[:, i] + x[:, j]) / 2, atol=1e-15)


def test_a_body_without_cracks_is_its_mesh(tmp_path):
    solution = xc.solve(scene(None, order=1))
    files = xc.write(solution, tmp_path / "plain")
    assert [file.name for file in files] == ["plain.vtu"]
    grid = read(files[0])
    mesh = solution.problem.mesh
    np.testing.assert_array_equal(grid.points[:, :2], mesh.points)
    np.testing.assert_array_equal(grid.cells_dict["triangle"], mesh.cells)
    assert set(grid.point_data) == {"displacement", "stress", "von_mises"}


def test_constant_stress_is_written_exactly(tmp_path):
    """Plane strain: zz = nu (xx + yy); von Mises of (0, 1, 0.3): by hand. Round-off."""
    problem = xc.Problem(
        xc.box((0, 0), (1, 1), 3),
        xc.Isotropic(2.0, 0.3, plane="strain"),
        loads=[xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))],
    )
    grid = read(xc.write(xc.solve(problem), tmp_path / "constant")[0])
    expected = np.broadcast_to([0, 1, 0.3, 0, 0, 0], (len(grid.points), 6))
    np.testing.assert_allclose(grid.point_data["stress"], expected, atol=1e-12)
    assert grid.point_data["von_mises"] == pytest.approx(np.sqrt(0.79), rel=1e-12)
    assert grid.cell_data["von_mises_center"][0] == pytest.approx(np.sqrt(0.79), rel=1e-12)


def test_level_sets_and_flags(tmp_path, pulled):
    grid = read(xc.write(pulled, tmp_path / "body")[0])
    a, b = np.array(CRACKS["edge"])
    ahead = (b - a) / np.linalg.norm(b - a)
    x = grid.points[:, :2] - b
    # Straight crack: distances to its line and to its tip along it; round-off.
    np.testing.assert_allclose(grid.point_data["psi_0_0"], x @ ahead, atol=1e-12)
    phi = x @ [-ahead[1], ahead[0]]
    np.testing.assert_allclose(grid.point_data["phi_0"], phi, atol=1e-12)
    enriched = np.concatenate(grid.cell_data["enriched"])
    assert set(np.unique(enriched)) == {0, 1, 2, 3}
    of_cell = enriched[np.argsort(np.concatenate(grid.cell_data["cell"]), kind="stable")]
    assert (of_cell > 0).sum() > len(pulled.space.enriched_cells)


def test_lips_are_those_of_contact(tmp_path, pressed):
    files = xc.write(pressed, tmp_path / "deep" / "er" / "pressed.vtu")
    assert [file.name for file in files] == ["pressed.vtu", "pressed_lips.vtp"]
    read(files[0])
    x, arrays, data = read_lips(files[1])
    contact = pressed.contact[0]
    assert contact.closed.any()
    np.testing.assert_array_equal(x[:, :2], contact.points)
    np.testing.assert_array_equal(arrays["pressure"], contact.pressure)
    np.testing.assert_array_equal(arrays["gap"], contact.gap)
    np.testing.assert_array_equal(arrays["closed"], contact.closed)
    np.testing.assert_array_equal(arrays["s"], contact.s)
    np.testing.assert_array_equal(arrays["weight"], contact.measure)
    np.testing.assert_array_equal(arrays["normal"][:, :2], contact.normal)
    np.testing.assert_array_equal(arrays["opening"][:, :2], pressed.jump(0))
    assert data.GetNumberOfLines() == 1


def test_lips_without_multipliers(tmp_path, pulled):
    _, arrays, _ = read_lips(xc.write(pulled, tmp_path / "open")[1])
    assert pulled.contact == (None,)
    assert not arrays["pressure"].any()
    assert not arrays["closed"].any()
    np.testing.assert_array_equal(arrays["gap"], pulled.opening(0))


def test_a_crack_through_a_hole_has_two_lines(tmp_path):
    """A frame: the crack runs through its left and its right leg."""
    full = xc.box((-1, -1), (1, 1), 10)
    middle = np.abs(full.points[full.cells].mean(axis=1)).max(axis=1) > 0.4
    used, cells = np.unique(full.cells[middle], return_inverse=True)
    mesh = xc.Mesh(full.points[used], cells.reshape(-1, 3))
    x = mesh.points[:, 0].copy()
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1.0, 0.3, plane="stress"),
        cracks=[xc.line_crack([(-1.3, 0.03), (0.71, 0.07)])],
        supports=[xc.fix((-1.0, -1.0)), xc.fix((1.0, -1.0), axis=1)],
        loads=[xc.point_force((-1.0, 1.0), (0.0, 0.1))],
    )
    assert x.min() == -1
    solution = xc.solve(problem)
    points, _, data = read_lips(xc.write(solution, tmp_path / "frame")[1])
    assert data.GetNumberOfLines() == 2
    assert not ((points[:, 0] > -0.4) & (points[:, 0] < 0.4)).any()


def test_two_cracks_share_the_file_of_the_lips(tmp_path):
    problem = xc.Problem(
        xc.box((0, 0), (3, 2), (18, 12)),
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[
            xc.line_crack([(-0.2, 0.83), (0.913, 0.87)]),
            xc.line_crack([(3.2, 1.21), (2.1, 1.13)]),
        ],
        loads=[xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))],
    )
    solution = xc.solve(problem)
    files = xc.write(solution, tmp_path / "two")
    x, arrays, data = read_lips(files[1])
    assert data.GetNumberOfLines() == 2
    assert len(x) == len(solution.lips[0]) + len(solution.lips[1])
    assert {"phi_0", "phi_1", "psi_0_0", "psi_1_0"} <= set(read(files[0]).point_data)
    np.testing.assert_array_equal(
        arrays["gap"], np.concatenate([solution.opening(0), solution.opening(1)])
    )


def test_tiny_pieces_do_no_harm(tmp_path):
    """A crack 1e-12 of a cell above a mesh line."""
    mesh = xc.box((-1, -1), (1, 1), 10)
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1.0, 0.3, plane="strain"),
        cracks=[xc.line_crack([(-1.3, 2e-13), (0.13, 2e-13)])],
        loads=[xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))],
    )
    grid = read(xc.write(xc.solve(problem), tmp_path / "tiny")[0])
    # The stress ahead of the tip is the largest; slivers must not invent a larger one.
    worst = grid.points[grid.point_data["von_mises"].argmax()]
    assert np.linalg.norm(worst[:2] - [0.13, 0.0]) < 0.05


def test_the_same_solution_gives_the_same_bytes(tmp_path, pulled):
    first, second = (xc.write(pulled, tmp_path / name) for name in ("a", "b"))
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_another_suffix_is_refused(tmp_path, pulled):
    with pytest.raises(xc.ProblemError, match=r"\.vtu"):
        xc.write(pulled, tmp_path / "body.vtp")
    files = xc.write(pulled, tmp_path / "load_0.5")  # no suffix, but a number
    assert [file.name for file in files] == ["load_0.5.vtu", "load_0.5_lips.vtp"]
