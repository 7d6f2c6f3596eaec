"""Bodies of STEP files: closed, open, plane and of several parts, with sets by selectors."""

import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import xcrack as xc
from support.gmsh_models import gmsh_model
from xcrack import GeometryError, XcrackError

pytestmark = pytest.mark.gmsh
R = 2.0


def hole(x: np.ndarray) -> np.ndarray:
    return np.hypot(x[:, 0] - 5, x[:, 1] - 5) < R + 1e-6


def plate(occ: Any) -> None:
    body = occ.addBox(0, 0, 0, 10, 10, 2)
    occ.cut([(3, body)], [(3, occ.addCylinder(5, 5, -1, 0, 0, 4, R))])


def two_parts(occ: Any) -> None:
    occ.addBox(0, 0, 0, 1, 1, 1)
    occ.addBox(1, 0, 0, 1, 1, 1)


def sheet(occ: Any) -> None:
    occ.cut([(2, occ.addRectangle(0, 0, 0, 10, 10))], [(2, occ.addDisk(5, 5, 0, R, R))])


def without_a_face(occ: Any) -> None:
    body = occ.addBox(0, 0, 0, 1, 1, 1)
    occ.synchronize()
    occ.remove([(3, body)])
    occ.remove([(2, 1)])


def faces_only(occ: Any) -> None:
    body = occ.addBox(0, 0, 0, 1, 1, 1)
    occ.synchronize()
    occ.remove([(3, body)])


def step(folder: Path, make: Callable[[Any], None]) -> Path:
    with gmsh_model() as gmsh:
        make(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "part.step"))
    return folder / "part.step"


def test_a_plate_with_its_hole_as_a_set(tmp_path: Path) -> None:
    path = step(tmp_path, plate)
    mesh = xc.mesh_step(path, size=1.0, sets={"hole": hole, "left": lambda x: x[:, 0] < 1e-6})
    assert mesh.volume.sum() == pytest.approx(200 - 2 * np.pi * R**2, rel=0.01)  # chords
    x = mesh.points[mesh.facet_sets["hole"]]
    np.testing.assert_allclose(np.hypot(x[..., 0] - 5, x[..., 1] - 5), R, rtol=1e-6)
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(4 * np.pi * R, rel=0.02)
    assert (mesh.points[mesh.facet_sets["left"]][..., 0] == 0).all()
    assert len(xc.mesh_step(path, size=2.0, sets={"one": [1]}).facet_sets["one"])


@pytest.mark.slow
@pytest.mark.mission
def test_parts_are_joined_and_faces_sewn(tmp_path: Path) -> None:
    mesh = xc.mesh_step(step(tmp_path, two_parts), size=0.5)
    assert mesh.volume.sum() == pytest.approx(2, rel=1e-9)
    assert (mesh.points[mesh.boundary][..., 0] != 1).any(axis=1).all()  # joined at x = 1
    sewn = xc.mesh_step(step(tmp_path, faces_only), size=0.5)
    assert sewn.volume.sum() == pytest.approx(1, rel=1e-9)


def test_a_sheet_is_a_2d_body_and_sizes_follow_a_function(tmp_path: Path) -> None:
    path = step(tmp_path, sheet)
    mesh = xc.mesh_step(path, size=lambda x: 0.3 + 0.1 * x[:, 0], sets={"hole": hole})
    assert mesh.dim == 2
    assert mesh.volume.sum() == pytest.approx(100 - np.pi * R**2, rel=0.01)
    middle = mesh.points[mesh.cells].mean(axis=1)[:, 0]
    assert mesh.cell_size[middle < 2].mean() < 0.6 * mesh.cell_size[middle > 8].mean()


@pytest.mark.slow
@pytest.mark.mission
def test_what_is_no_body_says_so(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="no closed body: its 5 faces"):
        xc.mesh_step(step(tmp_path, without_a_face), size=0.5)
    path = step(tmp_path, plate)
    cut_off = tmp_path / "cut.step"
    cut_off.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(GeometryError, match=r"cannot read cut\.step"):
        xc.mesh_step(cut_off, size=1.0)
    (tmp_path / "text.step").write_text("nothing")
    with pytest.raises(GeometryError, match="no STEP file"):
        xc.mesh_step(tmp_path / "text.step", size=1.0)
    with pytest.raises(XcrackError, match="cannot read the STEP file"):
        xc.mesh_step(tmp_path / "none.step", size=1.0)
    for sets, says in [
        ({"far": lambda x: x[:, 0] > 99}, r"sets\['far'\] selects none of the 7 faces"),
        ({"far": [99]}, r"no faces \[99\]: give some of \[1, 2"),
        ({"far": lambda _x: True}, "one bool for each"),
        ([1], "dict of names and selectors"),
    ]:
        with pytest.raises(GeometryError, match=says):
            xc.mesh_step(path, size=3.0, sets=sets)


@pytest.mark.parametrize(
    ("size", "error", "says"),
    [
        (0.0, GeometryError, "size = 0"),
        (lambda x: -x[:, 0] - 1, GeometryError, "size at .* = -"),
        (lambda _x: 1 / 0, ZeroDivisionError, "division"),
    ],
)
def test_wrong_sizes_are_errors(tmp_path: Path, size: Any, error: type, says: str) -> None:
    with pytest.raises(error, match=says):
        xc.mesh_step(step(tmp_path, plate), size=size)


@pytest.mark.parametrize(
    ("make", "side", "area"),
    [
        (lambda occ: occ.addCylinder(5, 5, 0, 0, 0, 2, R), "low", np.pi * R**2),
        (plate, "high", 100 - np.pi * R**2),
    ],
    ids=["round bar", "plate with a hole"],
)
def test_a_load_on_a_coarse_end_of_a_round_side_is_named(
    tmp_path: Path, make: Callable[[Any], None], side: str, area: float
) -> None:
    """The force is that of the straight outline, which no sum of forces shows."""
    ends = {"top": lambda x: x[:, 2] > 2 - 1e-6, "base": lambda x: x[:, 2] < 1e-6}
    mesh = xc.mesh_step(step(tmp_path, make), size=2.5, sets=ends)
    corner = mesh.points[mesh.facet_sets["top"]]
    straight = np.abs(np.cross(*np.diff(corner[..., :2], axis=1).transpose(1, 0, 2))).sum() / 2
    pull = [xc.traction("top", (0, 0, 1)), xc.traction("base", (0, 0, -1))]
    problem = xc.Problem(mesh, xc.Isotropic(E=1e3, nu=0.3), loads=pull, order=1)
    with pytest.warns(xc.XcrackWarning, match=f"too {side}. Make cells there smaller") as caught:
        xc.solve(problem)
    share = float(re.search(r" is ([\d.]+), above", str(caught[0].message))[1])
    # Discretisation: eight chords stand for an arc.
    assert share == pytest.approx(abs(area - straight) / area, rel=0.04)
    force = [xc.resultant("top", (0, 0, area)), xc.resultant("base", (0, 0, -area))]
    fine = xc.mesh_step(step(tmp_path, make), size=0.4, sets=ends)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        xc.solve(replace(problem, loads=force))
        xc.solve(replace(problem, mesh=fine))


def test_a_file_that_gmsh_dies_of_is_refused(tmp_path: Path) -> None:
    path = step(tmp_path, two_parts)
    damaged = path.read_bytes().replace(b"MANIFOLD_SOLID_BREP", b"SHELL_BASED_SURFACE_MODEL")
    (tmp_path / "bad.step").write_bytes(damaged)
    with pytest.raises(GeometryError, match=r"reads bad\.step .*damaged\. Export the part anew"):
        xc.mesh_step(tmp_path / "bad.step", size=0.4)
