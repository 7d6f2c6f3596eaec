"""Bodies from CAD: a STEP file meshed by gmsh, with sets of its faces."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import log10
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import Either, FileName, Function, Number, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import LARGEST, call_function, value_text, whole_numbers
from xcrack.base.errors import GeometryError, MeshError, XcrackError
from xcrack.base.paths import system_errors
from xcrack.base.units import LENGTH
from xcrack.mesh.curved_facets import lattice, rows_of, with_curves
from xcrack.mesh.gmsh_session import session
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.parts import box_of

Selector = Callable[[Floats], Any] | Sequence[Any]
_MOST_POINTS = 5_000_000
_STRAIGHT = ("Plane", "Line")  # kinds of faces and edges of a shape whose facets are their own
_ON_BOX = 1e-6  # share of the sides of a box by which a point may lie beside it
_SIZE = Number(above=0, most=LARGEST, unit=LENGTH)
_PLANE = 1e-7  # share of the size of a shape within which it lies in a plane z = constant


@check_arguments(GeometryError)
def mesh_step(
    path: FileName,
    *,
    size: Annotated[float | Callable[[Floats], Any], Either(Function(), _SIZE)],
    sets: Mapping[str, Selector] | None = None,
) -> Mesh:
    """Mesh the body in a STEP file with gmsh: tetrahedra, or triangles for a plane sheet.

    Parts that touch are joined. Faces that do not close are sewn where they meet; faces in a plane
    z = constant are a 2D body.

    Parameters
    ----------
    path : path
        The file, ``.step`` or ``.stp``.
    size : float or callable, length
        Cell size, or f(x) -> (n,) for points x (n, 3).
    sets : mapping of name to selector, optional
        A selector is f(x) -> (n,) bool for points x (n, 3): a face of the shape (in 2D: an edge)
        belongs to the set if all mesh points on it do. Or two corners of a box that holds them,
        None where it has no end; or the numbers that gmsh gives to the faces.

    Returns
    -------
    Mesh
        In the unit of the file's writer as gmsh takes it, which is mm unless told otherwise. It
        knows the curved faces of the shape (`Mesh.curves`), so that `refine` follows them: those
        of `sets`, and others as sets ``curved_1``, ``curved_2`` ....

    Raises
    ------
    XcrackError
        The file is missing, or gmsh is.
    GeometryError
        A damaged file, no closed body in it, a selector without a face or with other values than
        bools, a size that is not positive, or so small that millions of points would be needed.
    MeshError
        gmsh cannot mesh the shape.
    """
    path = Path(path)
    with system_errors("cannot read the STEP file", path):
        head = path.read_bytes()[:1000]
    if b"ISO-10303-21" not in head:
        raise GeometryError(
            f"{path.name} is no STEP file (it does not begin with ISO-10303-21): export the part "
            "as STEP AP203, AP214 or AP242."
        )
    if sets is not None and not isinstance(sets, Mapping):
        raise GeometryError(
            "mesh_step: sets must be a dict of names and selectors, such as sets={'hole': lambda "
            f"x: np.hypot(x[:, 0], x[:, 1]) < 5.01}}, not {type(sets).__name__}."
        )
    _check_reading(path)
    with session() as gmsh:
        dim = _shape(gmsh, path)
        if not callable(size):
            _check_cost(gmsh, dim, size)
        failures = _set_size(gmsh, size)
        try:
            gmsh.model.mesh.generate(dim)
        except Exception as error:  # gmsh has no other class
            if failures:
                raise failures[0] from None
            raise MeshError(
                f"gmsh cannot mesh {path.name} ({error}): take a smaller size, or remove slivers "
                "and gaps between faces in the CAD program."
            ) from error
        if failures:
            raise failures[0]
        return _mesh(gmsh, dim, path.name, sets or {})


def _check_reading(path: Path) -> None:
    """Raise where gmsh dies while it reads a file: a process of its own tries that first."""
    if not sys.executable:  # Python within another program
        return
    code = (
        "import pathlib, sys; from xcrack.mesh.step_file import _try; "
        "_try(pathlib.Path(sys.argv[1]))"
    )
    run = subprocess.run(
        [sys.executable, "-P", "-c", code, str(path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        check=False,
    )
    if run.returncode not in (0, 1):  # 1: an error in Python, which is raised again here
        raise GeometryError(
            f"gmsh dies while it reads {path.name} (exit status {run.returncode}): the file is "
            "damaged. Export the part anew as STEP AP203, AP214 or AP242."
        )


def _try(path: Path) -> None:
    with session() as gmsh:
        _shape(gmsh, path)


def _shape(gmsh: ModuleType, path: Path) -> int:
    """Load the shape, make one conforming body of it, and return its dimension."""
    try:
        return _conforming_body(gmsh, path)
    except XcrackError:
        raise
    except Exception as error:  # gmsh has no other class
        raise GeometryError(f"gmsh cannot read {path.name} ({error}): export it anew.") from error


def _conforming_body(gmsh: ModuleType, path: Path) -> int:
    occ = gmsh.model.occ
    entities = occ.importShapes(str(path))
    occ.synchronize()
    if not gmsh.model.getEntities(3):
        box = np.array(gmsh.model.getBoundingBox(-1, -1)) if entities else np.zeros(6)
        extent = box[3:] - box[:3]
        if gmsh.model.getEntities(2) and extent[2] <= _PLANE * extent.max():
            return _join_parts(gmsh, 2)
        n_faces = len(gmsh.model.getEntities(2))
        occ.healShapes(sewFaces=True, makeSolids=True)
        occ.synchronize()
        if not gmsh.model.getEntities(3):
            raise GeometryError(
                f"{path.name} has no closed body: its {n_faces} faces do not enclose a volume. "
                "Close the gaps in the CAD program and export the part as a solid."
            )
    return _join_parts(gmsh, 3)


def _check_cost(gmsh: ModuleType, dim: int, size: float) -> None:
    """Raise where a size asks for more points than any machine meshes."""
    content = sum(gmsh.model.occ.getMass(dim, tag) for _, tag in gmsh.model.getEntities(dim))
    if content > 0 and log10(content) - dim * log10(size) > log10(_MOST_POINTS):
        raise GeometryError(
            f"mesh_step: size = {size:g} asks for more than {_MOST_POINTS:.0e} points: enlarge it, "
            "or give a function that is small only where cracks run."
        )


def _join_parts(gmsh: ModuleType, dim: int) -> int:
    """Join touching parts so that their meshes share points."""
    occ = gmsh.model.occ
    occ.synchronize()
    parts = gmsh.model.getEntities(dim)
    if len(parts) > 1:
        occ.fragment(parts[:1], parts[1:])
        occ.synchronize()
    if any(occ.getMass(3, tag) <= 0 for _, tag in gmsh.model.getEntities(3)):
        raise GeometryError(
            "a solid of the STEP file has no volume: its faces do not close, or are turned inside "
            "out. Mend it in the CAD program."
        )
    return dim


def _set_size(gmsh: ModuleType, size: float | Callable[[Floats], Any]) -> list[BaseException]:
    """Tell gmsh the cell size; errors of the user's function gather in the list returned."""
    failures: list[BaseException] = []
    if not callable(size):
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        return failures

    def at(_dim: int, _tag: int, x: float, y: float, z: float, _size: float) -> float:
        # gmsh asks point by point, and an error raised here would be lost in its code.
        if not failures:
            try:
                value = call_function(size, "size", np.array([[x, y, z]]))
                if isinstance(value, np.ndarray) and value.size == 1:
                    value = value.item()
                if isinstance(value, list | tuple) and len(value) == 1:
                    value = value[0]
                return _SIZE.check(value, f"size at {[x, y, z]}", GeometryError)
            except BaseException as error:
                failures.append(error)
        return 1e22

    gmsh.model.mesh.setSizeCallback(at)
    return failures


def _mesh(gmsh: ModuleType, dim: int, source: str, sets: Mapping[str, Selector]) -> Mesh:
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags.astype(np.int64)] = np.arange(len(tags))
    points = xyz.reshape(-1, 3)

    def elements(of_dim: int, tag: int = -1) -> Any:
        kind = {1: 1, 2: 2, 3: 4}[of_dim]
        _, nodes = gmsh.model.mesh.getElementsByType(kind, tag)
        return number[nodes.astype(np.int64)].reshape(-1, of_dim + 1)

    cells = elements(dim)
    if not len(cells):
        raise MeshError(f"gmsh made no cells of {source}: take a smaller size.")
    faces = {tag: elements(dim - 1, tag) for _, tag in gmsh.model.getEntities(dim - 1)}
    point_numbers = np.unique(cells)
    new_number = np.full(len(points), -1, dtype=np.int64)
    new_number[point_numbers] = np.arange(len(point_numbers))
    facet_sets = {}
    for name, selector in sets.items():
        members = [tag for tag in faces if len(faces[tag])]
        if _is_box(selector):
            selector = _within_box(selector, f"sets[{name!r}]")
        if callable(selector):
            members = [
                tag for tag in members if _selected_facets(selector, points, faces[tag], name)
            ]
        else:
            facet_numbers = whole_numbers(selector, f"sets[{name!r}]", (None,), error=GeometryError)
            strangers = sorted(set(facet_numbers.tolist()) - set(members))
            if strangers:
                raise GeometryError(
                    f"sets[{name!r}]: {source} has no faces {strangers}: give some of {members}."
                )
            members = facet_numbers.tolist()
        if not members:
            centres = [np.round(points[f].mean(axis=(0, 1)), 4).tolist() for f in faces.values()]
            raise GeometryError(
                f"sets[{name!r}] selects none of the {len(faces)} faces of {source}, whose points "
                f"have their middles at {centres[:12]}: choose all points of a face."
            )
        facet_sets[name] = new_number[np.concatenate([faces[tag] for tag in members])]
    mesh = sound_mesh(points[point_numbers][:, :dim], new_number[cells], facet_sets)
    curved_facets = {
        tag: new_number[face]
        for tag, face in faces.items()
        if len(face) and gmsh.model.getType(dim - 1, tag) not in _STRAIGHT
    }
    lines = {
        tag: new_number[elements(1, tag)]
        for _, tag in gmsh.model.getEntities(1)
        if dim == 3 and gmsh.model.getType(1, tag) not in _STRAIGHT
    }
    return _with_shapes(gmsh, mesh, curved_facets, lines)


def _with_shapes(
    gmsh: ModuleType, mesh: Mesh, faces: dict[int, Ints], lines: dict[int, Ints]
) -> Mesh:
    """The mesh with the curves of the shape: nodes of quartic pieces, put onto its faces.

    Parameters
    ----------
    gmsh : module
        With the shape.
    mesh : Mesh
    faces : dict of int to (k, d) array of int
        Facets on each curved face of the shape (in 2D: on each edge).
    lines : dict of int to (k, 2) array of int
        In 3D: edges of facets on each curved edge of the shape.
    """
    outer_faces = {
        tag: face[mesh.facet_to_cell[mesh.facet_numbers(face), 1] < 0]
        for tag, face in faces.items()
    }
    outer_faces = {tag: face for tag, face in outer_faces.items() if len(face)}
    if not outer_faces:
        return mesh
    facets = np.concatenate(list(outer_faces.values()))
    tag = np.repeat(list(outer_faces), [len(face) for face in outer_faces.values()])
    grid = lattice(mesh.points, facets)
    # Nodes of edges of the shape belong to these, all others to the face on which they lie.
    owner, of_line = np.zeros((2, len(grid.points)), dtype=np.int64)
    for place in grid.facets[:, mesh.dim :].T:
        owner[place] = tag
    for number, pairs in lines.items():
        _, has_row = rows_of(np.sort(pairs, axis=1), grid.corner[grid.edges], mesh.n_points)
        nodes = len(grid.corner) + 3 * np.nonzero(has_row)[0][:, None] + np.arange(3)
        of_line[nodes.ravel()] = number
    points = grid.points.copy()
    for dim, numbers in ((mesh.dim - 1, np.where(of_line > 0, 0, owner)), (1, of_line)):
        for number in np.unique(numbers[numbers > 0]).tolist():
            rows = np.nonzero(numbers == number)[0]
            x = np.zeros((len(rows), 3))
            x[:, : mesh.dim] = grid.points[rows]
            feet = gmsh.model.getClosestPoint(dim, number, x.ravel())[0]
            points[rows] = np.reshape(feet, (-1, 3))[:, : mesh.dim]
    return with_curves(mesh, facets, replace(grid, points=points))


def _is_box(selector: Any) -> bool:
    """Whether it is two corners, rather than numbers of faces."""
    return isinstance(selector, Sequence) and [np.ndim(corner) for corner in selector] == [1, 1]


def _within_box(corners: Any, label: str) -> Callable[[Floats], Bools]:
    """A selector by two corners, in the plane of a sheet also of two numbers each."""
    n = 2 if len(corners[0]) == 2 else 3
    low_corner, high_corner = box_of(corners, n, label)
    reach = (
        _ON_BOX
        * np.where(np.isfinite(high_corner - low_corner), high_corner - low_corner, 0.0).max()
    )
    return lambda x: np.asarray(
        ((x[:, :n] >= low_corner - reach) & (x[:, :n] <= high_corner + reach)).all(axis=1)
    )


def _selected_facets(
    selector: Callable[[Floats], Any], points: Floats, face: Any, name: str
) -> bool:
    x = points[np.unique(face)]
    result = call_function(selector, f"sets[{name!r}]", x)
    try:
        is_inside = np.asarray(result)
    except Exception as error:  # ragged rows, or what an object's own __array__ raises
        raise GeometryError(
            f"sets[{name!r}] returned {value_text(result)}: return one bool for each point."
        ) from error
    if is_inside.shape != (len(x),) or is_inside.dtype != bool:
        raise GeometryError(
            f"sets[{name!r}] returned shape {is_inside.shape} of {is_inside.dtype} for {len(x)} "
            "points: return one bool for each."
        )
    mask: Bools = is_inside
    return bool(mask.all())
