"""Meshes and surfaces from files, meshes to files, in any format that meshio reads or writes."""

import base64
import contextlib
import io
import json
import re
import shlex
import warnings
import zlib
from os import PathLike
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote, unquote

import numpy as np

from xcrack.base.arguments import Choice, FileName, Part, Switch, check_arguments
from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.errors import GeometryError, MeshError, XcrackError, warn
from xcrack.base.optional import require_package
from xcrack.base.paths import system_errors, written_whole
from xcrack.mesh.abaqus import abaqus_text, read_abaqus
from xcrack.mesh.ansys import read_ansys
from xcrack.mesh.curved_facets import CurvedFacets
from xcrack.mesh.curves import Curve, check_on_curves
from xcrack.mesh.fitted_curves import Fit, with_fitted_curves
from xcrack.mesh.keywords import KeywordUse, missed_words
from xcrack.mesh.linear import SHAPES, base_kind, linear_mesh
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.msh import REST, msh_text
from xcrack.mesh.nastran import read_nastran
from xcrack.mesh.polygon import Arc
from xcrack.mesh.raw import KINDS, RawMesh, mesh_from_raw, sets_to_write

_SET = "set:"  # prefix of the 0/1 cell data that carry a set in formats without sets
_WITH_CELL_DATA = {".vtu", ".vtk", ".xdmf", ".xmf"}
_TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "su2:tag")
_ENTITY_TAGS = "gmsh:geometrical"
_WITH_GMSH = "Let gmsh convert it, which keeps its groups: gmsh {0} -save -o {1}.msh."
_NASTRAN = (".bdf", ".nas", ".fem")
_SHAPE = 'It is a shape without a mesh: xcrack.mesh_step("{0}", size=...) meshes it.'
_CONVERT = {  # formats that meshio does not read, or not always
    ".unv": _WITH_GMSH,
    **dict.fromkeys((".step", ".stp"), _SHAPE),
    ".odb": "It is an output database, which Abaqus alone opens: give the input file (.inp) of the "
    "same job, which has mesh, sets and loads.",
    ".rst": "It holds results: give the archive that CDWRITE makes (.cdb) for the mesh; for fields "
    "convert it in Python with the package ansys-mapdl-reader: "
    'ansys.mapdl.reader.read_binary("{0}").save_as_vtk("{1}.vtu"), which read_field reads.',
    ".op2": "It holds results: give the deck (.bdf) for the mesh; for fields convert it in Python "
    "with the package pyNastran (pyNastran.op2.op2.read_op2) to vtu, which read_field reads.",
}
_MISSED_SETS = 12  # that a message names


@check_arguments(MeshError)
def read_mesh(path: FileName, *, strict: Switch = False, fit_curves: Fit = False) -> Mesh:
    """Read a mesh with its sets, and make triangles (2D) or tetrahedra (3D) of its cells.

    Of cells of second or higher order the corners are used, and of their midside nodes the shape
    of the boundary: arcs through them are the `Mesh.curves` onto which `refine` puts new points. A
    set that is one smooth curved side gets its curve, other sides come into sets ``curved_1``,
    ``curved_2`` ..., those that meet at an edge into different ones. Quadrilaterals, pyramids,
    prisms and hexahedra are divided so that neighbours agree: a face of four corners from its
    smallest point number (Dompierre et al. 1999). A warning counts them.

    Parameters
    ----------
    path : path
        File in a format of meshio, chosen by its extension: ``.msh`` (gmsh 2.2, 4.1, text or
        binary), ``.inp`` (Abaqus), ``.vtu``, ``.vtk``, ``.mesh``, ``.xdmf`` ...
    strict : bool
        Refuse cells that would be changed: only linear triangles and tetrahedra are taken.
    fit_curves : bool, str or sequence of str
        Give straight cells the curves through their points, of the whole boundary or of some sets,
        as `fit_curves` does.

    Returns
    -------
    Mesh
        Facet sets and cell sets by name:

        * gmsh: physical groups; a group without a name is ``facets_<tag>`` or ``cells_<tag>``.
          Where a file has no groups at all, the numbers of the curves, surfaces and volumes are
          the tags.
        * Abaqus: ``*ELSET`` (of elements one dimension lower: a facet set), ``*SURFACE`` of
          element faces or nodes, and ``*NSET``: the boundary facets that have all their nodes in
          it. Parts stand where their instances do; sets of one of several instances are called
          ``instance.set``. A warning names what the deck has beside mesh and sets: `read_deck`
          reads loads, supports and materials.
        * Ansys (``.cdb``, written by CDWRITE): components. Nastran (``.bdf``): the property of each
          element. The warning names their other commands too.
        * vtu, vtk, xdmf: cell data named ``set:<name>``, not zero on members, lower-dimensional
          cells included (so `write_mesh` stores them).

        Triangles with z = constant give a 2D mesh. Points that no cell uses are dropped.

    Raises
    ------
    XcrackError
        The file is missing, may not be read, or has an unknown extension.
    MeshError
        The contents are unreadable, or no mesh that triangles or tetrahedra can be made of;
        cells that are turned inside out, midside nodes outside of their edge; other cells than
        linear simplices where `strict`.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from xcrack.mesh.box import box
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "plate.msh"
    >>> write_mesh(path, box((0, 0), (1, 1), 2))
    >>> read_mesh(path)
    Mesh(9 points, 8 triangles, facet sets: left, right, bottom, top, boundary)
    """
    path = existing_file(path, "mesh")
    with system_errors("cannot read the mesh file", path):
        raw_mesh, uses = raw_mesh_of(path)
    mesh = mesh_from_raw(linear_mesh(raw_mesh, path.name, strict), path.name)
    parts = []
    if ignored_words := missed_words(uses):
        parts.append(f"the mesh and its sets are taken, not {', '.join(ignored_words)}")
        if path.suffix.lower() == ".inp":
            parts[-1] += " (read_deck reads loads, supports and materials)"
    if message := sets_without_facets(raw_mesh, mesh):
        parts.append(message)
    if parts:
        warn(f"{path.name}: {'; '.join(parts)}.")
    return with_fitted_curves(with_stored_curves(mesh, path), fit_curves, path.name)


def raw_mesh_of(path: Path) -> tuple[RawMesh, list[KeywordUse]]:
    """Contents of a mesh file, and of a deck what became of its keywords."""
    suffix = path.suffix.lower()
    if suffix == ".inp":
        return read_abaqus(path)
    if suffix == ".cdb":
        return read_ansys(path)
    if suffix in _NASTRAN:
        return read_nastran(path)
    return _raw_from_meshio(meshio_read(path, "mesh"), _gmsh_names(path)), []


def sets_without_facets(raw_mesh: RawMesh, mesh: Mesh) -> str:
    """Sets of nodes that hold no facet of the mesh, in words; empty where there are none."""
    names = [
        f"{name} ({len(members)} node" + ("s)" if len(members) > 1 else ")")
        for name, members in raw_mesh.point_sets
        if len(members) and name not in mesh.facet_sets and not name.startswith("_")
    ]
    if not names:
        return ""
    remainder = f" and {len(names) - _MISSED_SETS} more" if len(names) > _MISSED_SETS else ""
    return (
        f"the node sets {', '.join(names[:_MISSED_SETS])}{remainder} hold no facet of the boundary "
        "and are left out: fix(...) takes points too"
    )


def read_triangles(path: str | PathLike[str]) -> tuple[Floats, Ints]:
    """Read the points and triangles of a surface.

    Parameters
    ----------
    path : path
        File in a format of meshio, chosen by its extension.

    Returns
    -------
    points : (p, 2) or (p, 3) array, length
    triangles : (f, 3) array of int

    Raises
    ------
    XcrackError
        The file is missing, cannot be read, or has an unknown extension.
    GeometryError
        It contains no linear triangles.
    """
    path = existing_file(path, "surface")
    with system_errors("cannot read the surface file", path):
        surface = meshio_read(path, "surface")
    blocks = [block.data for block in surface.cells if block.type == "triangle"]
    if not blocks:
        kinds = sorted({block.type for block in surface.cells})
        raise GeometryError(
            f"surface file {str(path)!r} has no triangles, but {kinds or 'nothing'}: export the "
            "surface as linear triangles."
        )
    points, triangles = np.asarray(surface.points, dtype=float), np.concatenate(blocks)
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise GeometryError(
            f"surface file {str(path)!r}: a triangle names a point that the file lacks (it has "
            f"{len(points)} points): the file is damaged."
        )
    return points, triangles.astype(np.int64)


@check_arguments(XcrackError)
def write_mesh(
    path: FileName,
    mesh: Annotated[Mesh, Part(Mesh)],
    *,
    msh_version: Annotated[str, Choice(("4.1", "2.2"))] = "4.1",
) -> None:
    """Write a mesh with its sets; `read_mesh` gives the same points, to the last bit, and sets.

    The set ``"boundary"`` is left out where it is the one every mesh has. Curves go into msh, inp
    and vtu, in a section or comments that other programs pass over; functions of yours do not.

    * ``.msh`` (text, 4.1 or 2.2): all sets as physical groups. In 2.2 a cell of several sets is
      written once for each, as gmsh does.
    * ``.inp``: all sets as ``*ELSET``, facets as T3D2 or S3 elements. Names have no comma.
    * ``.vtu``, ``.vtk``, ``.xdmf``: facets as lower-dimensional cells, sets as 0/1 cell data
      ``set:<name>``. A set without members survives in vtu-like formats only, and there alone
      facets keep their order, so that results are the same to the last bit.
    * Others: points and cells only; sets are lost, with a warning.

    Parameters
    ----------
    path : path
        Where to; the extension chooses the format.
    mesh : Mesh
        What to write.
    msh_version : {"4.1", "2.2"}
        Version of the msh format.

    Raises
    ------
    XcrackError
        Unknown extension or version, a folder that does not exist, or what the system refuses (no
        space, no permission).
    MeshError
        A name of a set that the format cannot hold.
    """
    path = Path(path)
    with system_errors("cannot write", path):
        if not path.parent.is_dir():
            raise XcrackError(f"folder {str(path.parent)!r} does not exist: make it first.")
        if path.is_dir():
            raise XcrackError(f"{str(path)!r} is a folder: give the path of a file in it.")
    extension = path.suffix.lower()
    curves = _text_of_curves(mesh, path)
    if extension == ".msh":
        _write_text(path, msh_text(mesh, msh_version) + curves)
    elif extension == ".inp":
        _write_text(path, abaqus_text(mesh) + curves)
    else:
        _meshio_write(path, mesh)
        if curves:
            with system_errors("the curves of the mesh are not written to", path):
                with open(path, "a", encoding="utf-8") as file:
                    file.write(curves)


def _write_text(path: Path, text: str) -> None:
    label = "the mesh is not written (an older file is left as it was) to"
    with written_whole(path, label) as part:
        part.write_text(text, encoding="utf-8")


def existing_file(value: str | PathLike[str], label: str) -> Path:
    """Path of a file that is there."""
    path = Path(value)
    with system_errors(f"cannot read the {label} file", path):
        if path.is_dir():
            raise XcrackError(
                f"{label} file {str(path)!r} is a folder: give the path of a file in it."
            )
        if not path.exists():
            raise XcrackError(
                f"{label} file {str(path)!r} does not exist (looked in {Path.cwd()}): check the "
                "path."
            )
    return path


def meshio_read(path: Path, label: str) -> Any:
    """Content of a file as meshio reads it; errors name the file and what to do."""
    meshio = require_package("meshio", f"reading a {path.suffix} file")
    _check_extension(path, "read", meshio.extension_to_filetypes)
    output = io.StringIO()
    try:
        # meshio prints what went wrong and leaves python where no reader fits.
        with (
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")  # of numpy, about damaged files
            return meshio.read(path)
    except OSError:
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error, ModuleNotFoundError) and error.name:
            require_package(error.name, f"reading a {path.suffix} file")
        if "gmsh:physical" in str(error):
            reason = (
                "some of its elements are in physical groups and some are not (gmsh saved all): "
                "set Mesh.SaveAll = 0, or put every point, curve and surface into a group"
            )
        else:
            reason = " ".join(f"{output.getvalue()} {error}".split()) or type(error).__name__
        raise MeshError(
            f"cannot read the {label} file {str(path)!r}: {reason.rstrip('.')}. Check that it is a "
            f"whole {path.suffix} file. {_conversion(path)}".rstrip()
        ) from error


def _conversion(path: Path) -> str:
    """What to do with a file of a format that meshio does not read, or not always."""
    return _CONVERT.get(path.suffix.lower(), "").format(path.name, path.stem)


def _meshio_write(path: Path, mesh: Mesh) -> None:
    meshio = require_package("meshio", f"writing a {path.suffix} file")
    _check_extension(path, "write", meshio.extension_to_filetypes)
    points = np.zeros((mesh.n_points, 3))
    points[:, : mesh.dim] = mesh.points
    facet_sets, cell_sets = sets_to_write(mesh)
    blocks, data = [(KINDS[mesh.dim], mesh.cells)], {}
    if path.suffix.lower() in _WITH_CELL_DATA:
        if not np.array_equal(mesh.facet_sets["boundary"], mesh.boundary):
            facet_sets["boundary"] = mesh.facet_sets["boundary"]  # in an order of its own
        sizes = [len(facets) for facets in facet_sets.values()]
        owner = np.repeat(np.arange(len(sizes)), sizes)  # a facet of two sets comes twice: each set
        if len(owner):  # keeps its order, and with it the last bit of what is summed over it
            facets = np.concatenate(list(facet_sets.values()))
            blocks.insert(0, (KINDS[mesh.dim - 1], facets))
        place = {name: k for k, name in enumerate(facet_sets)}
        for name in dict.fromkeys([*facet_sets, *cell_sets]):
            on_facets = (owner == place.get(name, -1)).astype(np.int32)
            on_cells = np.zeros(len(mesh.cells), dtype=np.int32)
            on_cells[cell_sets.get(name, [])] = 1
            data[_SET + quote(name)] = [on_facets, on_cells] if len(owner) else [on_cells]
    elif facet_sets or cell_sets:
        warn(
            f"{path.name}: {path.suffix} files carry no sets, so "
            f"{sorted({*facet_sets, *cell_sets})} are lost; write .msh, .inp or .vtu to keep them."
        )
    output = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(output),
            system_errors("the mesh is not, or not wholly, written to", path),
        ):
            meshio.Mesh(points, blocks, cell_data=data).write(path)
    except XcrackError:
        raise
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{output.getvalue()} {error}".split())
        raise MeshError(f"cannot write {str(path)!r}: {reason}.") from error


def _check_extension(path: Path, verb: str, formats: dict[str, list[str]]) -> None:
    if path.suffix.lower() not in formats:
        remedy = _conversion(path) if verb == "read" else ""
        raise XcrackError(
            f"cannot {verb} {path.name!r}: {path.suffix!r} is no extension of a mesh format that "
            f"is known here. {remedy or 'Known are ' + ', '.join(sorted(formats)) + '.'}"
        )


# Curves in files that other programs read as before: in a section of its own of msh, in comments.

_FRAMES = {  # before, at each line, and behind
    ".msh": ("$XcrackCurves", "", "$EndXcrackCurves"),
    ".inp": ("** xcrack curves", "** ", "** end"),
    ".vtu": ("<!-- xcrack curves", "", "-->"), ".xdmf": ("<!-- xcrack curves", "", "-->"),
}  # fmt: skip
_WIDTH = 76


def _text_of_curves(mesh: Mesh, path: Path) -> str:
    """Curves of a mesh as text at the end of a file; those that it cannot hold are warned of."""
    frame = _FRAMES.get(path.suffix.lower())
    content, lost_names = {}, []
    for name, curve in mesh.curves.items():
        if frame is not None and isinstance(curve, Arc):
            content[name] = {"arc": [list(curve.center), curve.radius, curve.axis]}
        elif frame is not None and isinstance(curve, CurvedFacets):
            content[name] = {"facets": [curve.points.tolist(), curve.facets.tolist()]}
        else:
            lost_names.append(name)
    if lost_names:
        reason = (
            "functions of yours"
            if frame
            else f"{path.suffix} files carry none; write .msh, .inp or .vtu to keep them"
        )
        warn(f"{path.name}: the curves of the sets {lost_names} are not stored ({reason}).")
    if not content or frame is None:
        return ""
    compressed_text = zlib.compress(json.dumps(content).encode())
    text = base64.b64encode(compressed_text).decode()
    begin, at_line, end = frame
    lines = [at_line + text[i : i + _WIDTH] for i in range(0, len(text), _WIDTH)]
    return "\n".join([begin, *lines, end]) + "\n"


def _stored_curves(path: Path) -> dict[str, Curve]:
    """Curves that `write_mesh` put at the end of a file; none where there are none."""
    frame = _FRAMES.get(path.suffix.lower())
    if frame is None:
        return {}
    begin, at_line, end = frame
    _, mark, rest = path.read_bytes().rpartition(b"\n" + begin.encode() + b"\n")
    if not mark:
        return {}
    lines = rest.partition(b"\n" + end.encode())[0].decode("ascii", "replace").splitlines()
    text = "".join(line.removeprefix(at_line) for line in lines)
    curves: dict[str, Curve] = {}
    try:
        content = json.loads(zlib.decompress(base64.b64decode(text)))
        for name, entry in content.items():
            if "arc" in entry:
                center, radius, axis = entry["arc"]
                curves[name] = Arc(tuple(center), radius, None if axis is None else tuple(axis))
            else:
                points, facets = entry["facets"]
                curves[name] = CurvedFacets(lock(np.array(points)), lock(np.array(facets)))
    except Exception:  # whatever base64, zlib and json say of text that is not theirs
        warn(f"{path.name}: the curves of its boundary cannot be read: the file is damaged.")
    return curves


def with_stored_curves(mesh: Mesh, path: Path) -> Mesh:
    """A mesh with those of the curves that `write_mesh` put into its file which still fit it."""
    with system_errors("cannot read the mesh file", path):
        curves = _stored_curves(path)
    if not curves:
        return mesh
    fitting, lost_names = {}, []
    for name, curve in curves.items():
        try:
            check_on_curves(mesh.points, mesh.facet_sets, {name: curve})
            fitting[name] = curve
        except (KeyError, MeshError):
            lost_names.append(name)
    if lost_names:
        warn(
            f"{path.name}: the curves of the sets {lost_names} do not fit the points there any "
            "more, and are left out: the file was changed since it was written."
        )
    facet_sets = {name: facets for name, facets in mesh.facet_sets.items() if name != "boundary"}
    all_curves = {**mesh.curves, **fitting}
    return sound_mesh(mesh.points, mesh.cells, facet_sets, mesh.cell_sets, all_curves)


def _gmsh_names(path: Path) -> dict[tuple[int, int], str]:
    """Names of the physical groups by dimension and tag: meshio keeps one dimension a name."""
    if path.suffix.lower() != ".msh":
        return {}
    section = re.search(rb"\$PhysicalNames\s(.*?)\$EndPhysicalNames", path.read_bytes(), re.DOTALL)
    names = {}
    try:
        for line in section.group(1).decode().splitlines()[1:] if section else []:
            fields = shlex.split(line)
            if len(fields) == 3:
                names[int(fields[0]), int(fields[1])] = fields[2]
    except ValueError as error:  # a quotation mark left open, no number, no text
        raise MeshError(
            f"cannot read the names of the physical groups in {str(path)!r} ({error})."
        ) from error
    return names


def _raw_from_meshio(mesh: Any, names: dict[tuple[int, int], str]) -> RawMesh:
    blocks = [(block.type, np.asarray(block.data)) for block in mesh.cells]
    sets: list[tuple[str, str, Ints]] = []
    tag_names_in_use = {
        name for name, values in mesh.cell_data.items() if any(np.any(v) for v in values)
    }
    tag_names = [name for name in _TAGS if name in tag_names_in_use]
    if not tag_names and not names and _ENTITY_TAGS in tag_names_in_use:
        tag_names = [_ENTITY_TAGS]
    base = [base_kind(kind) for kind, _ in blocks]
    top = max((SHAPES[shape].dim for shape in base if shape), default=0)
    for number, (kind, data) in enumerate(blocks):
        if (shape := base[number]) is None:
            continue
        dim = SHAPES[shape].dim
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
