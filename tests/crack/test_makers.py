"""Whatever is put in the place of an argument of meshes and cracks ends in an error of ours."""

import errno
import os
import resource
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
PLATE = {"width": 2.0, "height": 2.0, "size": 0.5}
BAR = {
    "diameter": 2.0, "length": 14.0, "notch_depth": 0.2, "notch_angle": 1.0, "outer_span": 12.0,
    "inner_span": 4.0, "size": 2.0,
}  # fmt: skip
CALLS = {
    "Mesh": (xc.Mesh, {"points": [(0, 0), (1, 0), (0, 1)], "cells": [(0, 1, 2)],
                       "facet_sets": {"low": [(0, 1)]}, "cell_sets": {"all": [0]}}),
    "box": (xc.box, {"lower": (0, 0), "upper": (1, 1), "n": 2}),
    "refine": (xc.refine, {"mesh": xc.box((0, 0), (1, 1), 1)}),
    "plate": (xc.plate, {**PLATE, "size_near": 0.4, "lower": (0, 0), "holes": [((1, 1), 0.3)],
                         "along": [(0, 1), (0.5, 1)], "band": 0.1, "transition": 0.5}),
    "plate_with_hole": (xc.plate_with_hole, {**PLATE, "radius": 0.5, "center": (0, 0)}),
    "notched_cylinder": (xc.notched_cylinder, {**BAR, "size_near": 1.9, "patch_length": 0.3,
                                               "crack_depth": 1.0, "band": 0.1, "transition": 2.0}),
    "line_crack": (xc.line_crack, {"points": [(0, 0), (1, 0)]}),
    "Crack": (xc.Crack, {"points": SQUARE, "faces": [(0, 1, 2)], "tips": None,
                         "fronts": [(0, 1, 2)]}),
    "penny_crack": (xc.penny_crack, {"center": (0, 0, 0), "normal": (0, 0, 1), "radius": 1.0,
                                     "n": 16}),
    "elliptic_crack": (xc.elliptic_crack, {"center": (0, 0, 0), "normal": (0, 0, 1),
                                           "axis": (1, 0, 0), "a": 1.0, "b": 2.0, "n": 16}),
    "plane_crack": (xc.plane_crack, {"polygon": SQUARE}),
    "surface_crack": (xc.surface_crack, {"points": SQUARE, "triangles": [(0, 1, 2), (0, 2, 3)]}),
    "read_surface": (xc.read_surface, {"path": "none.stl"}),
    "read_mesh": (xc.read_mesh, {"path": "none.msh"}),
    "write_mesh": (xc.write_mesh, {"path": "none/none.msh", "mesh": xc.box((0, 0), (1, 1), 1)}),
}  # fmt: skip
NONSENSE = {
    "text": "a", "None": None, "nan": np.nan, "inf": np.inf, "minus": -1.0, "zero": 0,
    "complex": 1 + 2j, "True": True, "half": 2.5, "huge": 1e300, "tiny": 1e-300, "object": object(),
    "dict": {"a": 1}, "empty": [], "ragged": [[0, 1], [2]], "texts": ["a", "b"], "flat": [1, 2, 3],
    "nans": [(0, np.nan), (1, 1)], "infs": [(0, np.inf, 0)] * 3, "deep": np.zeros((2, 2, 2)),
    "far": [(1e200, 0), (0, 1e200)],
    "masked": np.ma.masked_array([(0, 1), (2, 3)], [(0, 1), (0, 0)]),
    "numbers beyond": [(0, 1, 99)], "below": [(0, 1, -1)], "class": int, "call": lambda x: x,
    "complexes": [(0, 1j), (1, 1)], "dates": np.array(["2026-01-01"], dtype="datetime64"),
    "big": 10**400, "pairs": [((0, 0), "a")], "bytes": b"ab", "nul": "a\0b", "generator": range(3),
}  # fmt: skip


def _no_session(**options):
    raise xc.MeshError("gmsh is reached.")


@pytest.mark.gmsh
@pytest.mark.parametrize("name", CALLS)
def test_nonsense_ends_in_an_error_of_ours(name, monkeypatch):
    function, arguments = CALLS[name]
    if name == "notched_cylinder":  # two seconds each: what comes as far as gmsh is enough
        monkeypatch.setattr("xcrack.mesh.cylinder.session", _no_session)
    refused = 0
    for argument in arguments:
        for kind, value in NONSENSE.items():
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                try:
                    result = function(**{**arguments, argument: value})
                except xc.XcrackError as error:
                    refused += 1
                    message = str(error)
                    assert message.endswith(".") or ":" in message, message
                    assert len(message) < 1000, message
                    continue
                except Exception as error:
                    raise AssertionError(f"{name}({argument}={kind})") from error
            points = getattr(result, "points", np.zeros(1))
            assert np.isfinite(points).all(), f"{name}({argument}={kind})"
    assert refused >= 0.6 * len(arguments) * len(NONSENSE)  # the others are valid somewhere


# --- what the system refuses ---------------------------------------------------------------------

MESH = xc.box((0, 0), (1, 1), 3)


@pytest.mark.parametrize("name", ["a.msh", "a.inp", "a.vtu"])
def test_paths_that_are_no_files(name, tmp_path):
    path = tmp_path / name
    path.mkdir()
    for call in (xc.read_mesh, xc.read_surface, lambda p: xc.write_mesh(p, MESH)):
        with pytest.raises(xc.XcrackError, match="is a folder"):
            call(path)
        with pytest.raises(xc.XcrackError, match="NUL"):
            call(f"{tmp_path}/a\0{name}")
        with pytest.raises(xc.XcrackError, match=r"too long|does not exist"):
            call(tmp_path / (400 * "a" + name))
        with pytest.raises(xc.XcrackError, match="does not exist"):
            call(tmp_path / "none" / name)


@pytest.mark.parametrize("name", ["a.msh", "a.inp", "a.vtu", "a.vtk", "a.stl", "a.mesh", "a.xdmf"])
def test_files_that_hold_something_else(name, tmp_path, capsys):
    rng = np.random.default_rng(1729)
    for content in (b"", b"\n" * 9, b"no mesh at all", rng.bytes(2000), b"\xff\xfe\x00", b"{}"):
        (tmp_path / name).write_bytes(content)
        for call in (xc.read_mesh, xc.read_surface):
            with pytest.raises(xc.XcrackError, match=r"a\.|triangles"):
                call(tmp_path / name)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "version"), [("a.msh", "4.1"), ("b.msh", "2.2"), ("c.inp", "4.1"),
                                               ("d.vtu", "4.1"), ("e.vtk", "4.1")])  # fmt: skip
def test_damaged_files(name, version, tmp_path):
    """Cut off and with changed bytes: read, or refused by an error of ours."""
    mesh = xc.Mesh(MESH.points, MESH.cells, MESH.facet_sets, {"all": np.arange(len(MESH.cells))})
    path, rng = tmp_path / name, np.random.default_rng(2718)
    xc.write_mesh(path, mesh, msh_version=version)
    whole = path.read_bytes()
    refused = 0
    for k in range(60):
        data = bytearray(whole)
        if k % 2:
            data = data[: rng.integers(len(data))]
        else:
            for i in rng.integers(len(data), size=3):
                data[i] = rng.integers(256)
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for call in (xc.read_mesh, xc.read_surface):
                try:
                    call(path)
                except xc.XcrackError:
                    refused += 1
    assert refused > 20


@pytest.mark.parametrize("name", ["a.msh", "a.inp", "a.vtu"])
def test_a_full_disk_is_reported_with_the_path(name, tmp_path):
    path = tmp_path / name
    xc.write_mesh(path, MESH)
    before = path.read_bytes()
    large = xc.box((0, 0), (1, 1), 60)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))
    try:
        with pytest.raises(xc.XcrackError, match=f"{name}.*{os.strerror(errno.EFBIG)}"):
            xc.write_mesh(path, large)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    if not name.endswith("vtu"):  # meshio writes in place
        assert path.read_bytes() == before
        assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("name", ["a.msh", "a.inp"])
def test_a_folder_where_nothing_may_be_written(name, tmp_path, monkeypatch):
    def refused(*_, **__):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "write_text", refused)  # root may write anywhere
    with pytest.raises(xc.XcrackError, match=f"{name}.*Permission denied"):
        xc.write_mesh(tmp_path / name, MESH)
    monkeypatch.undo()
    xc.write_mesh(tmp_path / name, MESH)
    monkeypatch.setattr(Path, "read_bytes", refused)
    monkeypatch.setattr(Path, "read_text", refused)
    with pytest.raises(xc.XcrackError, match=f"{name}.*Permission denied"):
        xc.read_mesh(tmp_path / name)


# --- packages that are missing ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("package", "call"),
    [
        ("gmsh", lambda: xc.plate(**PLATE)),
        ("meshio", lambda: xc.read_mesh(Path(__file__).parents[1] / "data" / "cube_41.msh")),
        ("meshio", lambda: xc.write_mesh("a.vtu", MESH)),
    ],
)  # fmt: skip
def test_a_missing_package_is_named_with_the_command(package, call, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(xc.XcrackError, match=f"needs the package {package}.*pip install {package}"):
        call()
