"""Meshes from files and to files, in any format meshio knows."""

import contextlib
import io
import re
import shlex
from os import PathLike
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from xcrack.arrays import Ints
from xcrack.errors import MeshError, XcrackError, warn
from xcrack.mesh.abaqus import read_abaqus, write_abaqus
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.msh import REST, write_msh
from xcrack.mesh.raw import (
    CELL_KIND,
    FACET_KIND,
    TOPOLOGICAL_DIM,
    RawMesh,
    mesh_from_raw,
    sets_to_write,
)

_SET = "set:"  # prefix of the 0/1 cell data that carry a set in formats without sets
_WITH_CELL_DATA = {".vtu", ".vtk", ".xdmf", ".xmf"}
_TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "nastran:ref", "su2:tag")
_ENTITY_TAGS = "gmsh:geometrical"


def read_mesh(path: str | PathLike[str]) -> Mesh:
    """Read a mesh of triangles (plane) or tetrahedra (space) with its sets.

    Parameters
    ----------
    path : path
        File in a format of meshio, told by its extension: ``.msh`` (gmsh 2.2, 4.1, text or
        binary), ``.inp`` (Abaqus), ``.vtu``, ``.vtk``, ``.mesh``, ``.xdmf`` ...

    Returns
    -------
    Mesh
        Facet sets and cell sets by name:

        * gmsh: physical groups; a group without a name is ``facets_<tag>`` or ``cells_<tag>``.
          Where a file has no groups at all, the numbers of the curves, surfaces and volumes are
          the tags.
        * Abaqus: ``*ELSET`` (of elements one dimension lower: a facet set), ``*SURFACE`` of
          element faces, and ``*NSET``: the boundary facets that have all their nodes in it.
        * vtu, vtk, xdmf: cell data named ``set:<name>``, not zero on members, lower-dimensional
          cells included (so `write_mesh` stores them).

        Triangles with z = constant give a plane mesh. Points that no cell uses are dropped.

    Raises
    ------
    XcrackError
        The file is missing, or of a kind nobody can read.
    MeshError
        The contents are unreadable, or no mesh of linear triangles or tetrahedra.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from xcrack.mesh.box import box
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "plate.msh"
    >>> write_mesh(path, box((0, 0), (1, 1), 2))
    >>> read_mesh(path)
    Mesh(9 points, 8 triangles, facet sets: left, right, bottom, top, boundary)
    """
    path = Path(path)
    if not path.is_file():
        raise XcrackError(
            f"mesh file {str(path)!r} does not exist (looked in {Path.cwd()}): check the path."
        )
    if path.suffix.lower() == ".inp":
        raw = read_abaqus(path)
    else:
        raw = _raw_from_meshio(_meshio_read(path), _gmsh_names(path))
    return mesh_from_raw(raw, path.name)


def write_mesh(path: str | PathLike[str], mesh: Mesh, *, msh_version: str = "4.1") -> None:
    """Write a mesh with its sets; `read_mesh` gives the same points, to the last bit, and sets.

    The set ``"boundary"`` is left out where it is the one every mesh has.

    * ``.msh`` (text, 4.1 or 2.2): all sets as physical groups. In 2.2 a cell of several sets is
      written once for each, as gmsh does.
    * ``.inp``: all sets as ``*ELSET``, facets as T3D2 or S3 elements. Names have no comma.
    * ``.vtu``, ``.vtk``, ``.xdmf``: facets as lower-dimensional cells, sets as 0/1 cell data
      ``set:<name>``. A set without members is kept by vtu-like formats only.
    * Others: points and cells only; sets are lost, which a warning says.

    Parameters
    ----------
    path : path
        Where to; the extension tells the format.
    mesh : Mesh
        What to write.
    msh_version : {"4.1", "2.2"}
        Version of the msh format.

    Raises
    ------
    XcrackError
        Unknown extension, or a folder that does not exist.
    MeshError
        A name of a set that the format cannot hold.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise XcrackError(f"folder {str(path.parent)!r} does not exist: make it first.")
    extension = path.suffix.lower()
    if extension == ".msh":
        write_msh(path, mesh, msh_version)
    elif extension == ".inp":
        write_abaqus(path, mesh)
    else:
        _meshio_write(path, mesh)


def _meshio_read(path: Path) -> Any:
    import meshio

    _check_extension(path, "read", meshio.extension_to_filetypes)
    said = io.StringIO()
    try:
        # meshio prints what went wrong and leaves python where no reader fits.
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        if "gmsh:physical" in str(error):
            reason = (
                "some of its elements are in physical groups and some are not (gmsh saved all): "
                "set Mesh.SaveAll = 0, or put every point, curve and surface into a group"
            )
        else:
            reason = " ".join(f"{said.getvalue()} {error}".split())
        raise MeshError(f"cannot read {str(path)!r}: {reason}.") from error


def _meshio_write(path: Path, mesh: Mesh) -> None:
    import meshio

    _check_extension(path, "write", meshio.extension_to_filetypes)
    points = np.zeros((mesh.n_points, 3))
    points[:, : mesh.dim] = mesh.points
    facet_sets, cell_sets = sets_to_write(mesh)
    blocks, data = [(CELL_KIND[mesh.dim], mesh.cells)], {}
    if path.suffix.lower() in _WITH_CELL_DATA:
        numbers = {name: mesh.facet_numbers(facets) for name, facets in facet_sets.items()}
        rows = np.unique(np.concatenate([np.zeros(0, np.int64), *numbers.values()]))
        if len(rows):
            blocks.insert(0, (FACET_KIND[mesh.dim], mesh.facets[rows]))
        for name in dict.fromkeys([*facet_sets, *cell_sets]):
            on_facets = np.isin(rows, numbers.get(name, [])).astype(np.int32)
            on_cells = np.zeros(len(mesh.cells), dtype=np.int32)
            on_cells[cell_sets.get(name, [])] = 1
            data[_SET + quote(name)] = [on_facets, on_cells] if len(rows) else [on_cells]
    elif facet_sets or cell_sets:
        warn(
            f"{path.name}: {path.suffix} files carry no sets, so "
            f"{sorted({*facet_sets, *cell_sets})} are lost; write .msh, .inp or .vtu to keep them."
        )
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            meshio.Mesh(points, blocks, cell_data=data).write(path)
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{said.getvalue()} {error}".split())
        raise MeshError(f"cannot write {str(path)!r}: {reason}.") from error


def _check_extension(path: Path, verb: str, known: dict[str, list[str]]) -> None:
    if path.suffix.lower() not in known:
        raise XcrackError(
            f"cannot {verb} {path.name!r}: no mesh format has the extension {path.suffix!r}; "
            f"known are {', '.join(sorted(known))}."
        )


def _gmsh_names(path: Path) -> dict[tuple[int, int], str]:
    """Names of the physical groups by dimension and tag: meshio keeps one dimension a name."""
    if path.suffix.lower() != ".msh":
        return {}
    found = re.search(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", path.read_bytes(), re.DOTALL)
    names = {}
    for line in found.group(1).decode().splitlines()[1:] if found else []:
        fields = shlex.split(line)
        if len(fields) == 3:
            names[int(fields[0]), int(fields[1])] = fields[2]
    return names


def _raw_from_meshio(mesh: Any, names: dict[tuple[int, int], str]) -> RawMesh:
    blocks = [(block.type, np.asarray(block.data)) for block in mesh.cells]
    sets: list[tuple[str, str, Ints]] = []
    tagged = {name for name, values in mesh.cell_data.items() if any(np.any(v) for v in values)}
    tag_names = [name for name in _TAGS if name in tagged]
    if not tag_names and not names and _ENTITY_TAGS in tagged:
        tag_names = [_ENTITY_TAGS]
    top = max((TOPOLOGICAL_DIM.get(kind, 0) for kind, _ in blocks), default=0)
    for number, (kind, data) in enumerate(blocks):
        if kind not in TOPOLOGICAL_DIM:
            continue
        dim = TOPOLOGICAL_DIM[kind]
        noun = "cells" if dim == top else "facets"
        for tag_name in tag_names:
            tags = np.abs(np.asarray(mesh.cell_data[tag_name][number], dtype=np.int64))
            for tag in np.unique(tags[tags != 0]).tolist():
                name = names.get((dim, tag), f"{noun}_{tag}")
                sets.append((kind, name, data[tags == tag]))
        for name, members in mesh.cell_sets.items():
            # The reader of msh 4.1 gives rows by name, of any dimension, and its own extras.
            if not name.startswith("gmsh:") and members[number] is not None:
                rows = np.asarray(members[number], dtype=np.int64)
                if not names or name in _names_of_dim(names, dim):
                    sets.append((kind, name, data[rows]))
        for name, values in mesh.cell_data.items():
            if name.startswith(_SET):
                member = np.asarray(values[number]) != 0
                sets.append((kind, unquote(name.removeprefix(_SET)), data[member]))
    rank = {name: i for i, name in enumerate(names.values())}
    sets = sorted(
        (entry for entry in sets if entry[1] != REST),
        key=lambda entry: rank.get(entry[1], len(rank)),
    )
    point_sets = [(name, np.asarray(rows, np.int64)) for name, rows in mesh.point_sets.items()]
    return RawMesh(np.asarray(mesh.points), blocks, sets, point_sets)


def _names_of_dim(names: dict[tuple[int, int], str], dim: int) -> set[str]:
    return {name for (of_dim, _), name in names.items() if of_dim == dim}
