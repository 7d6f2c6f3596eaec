"""Fields from files: values on another mesh, interpolated wherever they are asked for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import FileName, Text, check_arguments
from xcrack.base.arrays import Floats, Ints, at, frozen_copy
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import MeshError, ProblemError, warn
from xcrack.base.optional import require_package
from xcrack.base.paths import system_errors
from xcrack.mesh.files import existing_file, meshio_read
from xcrack.mesh.linear import SHAPES, base_kind, linear_mesh
from xcrack.mesh.locate import barycentric, locate
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.raw import RawMesh

_BESIDE = 0.5  # of a cell: a point this near to the mesh has the value at its boundary
_NEAR = 8  # cells looked at for a point outside
_SIX = [0, 3, 5, 3, 1, 4, 5, 4, 2]  # of xx yy zz xy yz xz
# Nodes of second order with the first two corners changed, in VTK's order of edges.
_TURNED = {6: [1, 0, 2, 3, 5, 4], 10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]}
_EDGES = {6: [(0, 1), (1, 2), (2, 0)], 10: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]}


@dataclass(frozen=True, eq=False)
class Field:
    """Values on a mesh; called with points, it interpolates.

    Attributes
    ----------
    mesh : Mesh
        Of the file.
    nodes : (m, k) array of int
        Nodes of each cell: its corners, and the middles of edges at second order.
    values : (n, ...) array
        Scalars, vectors (n, d) or stresses (n, d, d) at the nodes.
    name : str
        File and name of the data.
    """

    mesh: Mesh
    nodes: Ints
    values: Floats
    name: str

    def __call__(self, x: Floats) -> Floats:
        """Values at points `(q, ...)`; `x` (q, d), length.

        Raises
        ------
        ProblemError
            Points farther from the mesh of the field than half a cell.
        """
        x = numbers(x, f"field {self.name}: x", (None, None))
        if x.shape[1] != self.mesh.dim:
            raise ProblemError(
                f"field {self.name} has {self.mesh.dim} dimensions, the points {x.shape[1]}: give "
                f"points (n, {self.mesh.dim})."
            )
        cell, bary = locate(self.mesh, x)
        rows_outside = np.nonzero(cell < 0)[0]
        if len(rows_outside):
            cell[rows_outside], bary[rows_outside] = self._nearest_cells(x[rows_outside])
        values = self.values[self.nodes[cell]]
        return np.asarray(np.einsum("qk,qk...->q...", self._shapes(bary), values))

    def __repr__(self) -> str:
        kind = {1: "scalar", 2: "vector", 3: "stress"}[self.values.ndim]
        return f"Field({self.name}: {kind} on {len(self.nodes)} cells)"

    def _shapes(self, bary: Floats) -> Floats:
        k = self.nodes.shape[1]
        if k == bary.shape[1]:
            return bary
        i, j = np.array(_EDGES[k]).T
        return np.concatenate([bary * (2 * bary - 1), 4 * bary[:, i] * bary[:, j]], axis=1)

    def _nearest_cells(self, x: Floats) -> tuple[Ints, Floats]:
        """Nearest cells of points outside, and the places in them: curved sides are polygons."""
        mesh = self.mesh
        nearest_cells = np.atleast_2d(mesh.cell_tree.query(x, k=min(_NEAR, len(mesh.cells)))[1])
        nearest_cells = nearest_cells.reshape(len(x), -1)
        count = nearest_cells.shape[1]
        trial = barycentric(mesh, nearest_cells.ravel(), np.repeat(x, count, axis=0))
        trial = np.maximum(trial, 0.0)
        trial /= trial.sum(axis=1, keepdims=True)
        place = np.einsum("kb,kbd->kd", trial, mesh.points[mesh.cells[nearest_cells.ravel()]])
        distance = np.linalg.norm(place - np.repeat(x, count, axis=0), axis=1).reshape(-1, count)
        column = np.argmin(distance, axis=1)
        row = np.arange(len(x))
        cell = nearest_cells[row, column]
        is_far = distance[row, column] > _BESIDE * mesh.cell_size[cell]
        if is_far.any():
            i = int(np.argmax(np.where(is_far, distance[row, column], 0)))
            raise ProblemError(
                f"field {self.name} does not cover the body: {int(is_far.sum())} of the points "
                f"asked for lie beside its mesh, the farthest at {at(x[i])}, "
                f"{distance[i, column[i]]:.4g} away (its mesh reaches from "
                f"{at(mesh.points.min(axis=0))} to {at(mesh.points.max(axis=0))}). Check units and "
                f"position, or give a field of the whole body."
            )
        return cell, trial.reshape(len(x), count, -1)[row, column]


@dataclass(frozen=True, eq=False)
class CellField:
    """Values that are constant in each cell of a mesh; called with points, it finds their cells.

    Attributes
    ----------
    mesh : Mesh
    values : (m, ...) array
        Scalars, vectors (m, d) or stresses (m, d, d).
    name : str
    """

    mesh: Mesh
    values: Floats
    name: str

    def __call__(self, x: Floats) -> Floats:
        """Values at points `(q, ...)`; `x` (q, d), length; beside the mesh those of a near cell."""
        x = numbers(x, f"{self.name}: x", (None, self.mesh.dim))
        cell, _ = locate(self.mesh, x)
        rows_outside = np.nonzero(cell < 0)[0]
        if len(rows_outside):
            cell[rows_outside] = self.mesh.cell_tree.query(x[rows_outside])[1]
        return np.asarray(self.values[cell])

    def __repr__(self) -> str:
        return f"CellField({self.name}: {len(self.values)} cells)"


@check_arguments(MeshError)
def read_field(
    path: FileName, name: Annotated[str | None, Text("the name of a field")] = None
) -> Field:
    """Read a field from a file with a mesh of its own, to use wherever a function f(x) is taken.

    Parameters
    ----------
    path : path
        File in a format of meshio with data: ``.vtu``, ``.vtk``, ``.xdmf``, ``.msh``, ``.med`` ...
    name : str, optional
        Of the data; may be left out where the file has one array only.

    Returns
    -------
    Field
        ``field(x)`` -> (n,) for a scalar, (n, d) for a vector, (n, d, d) for a stress: of six
        components xx yy zz xy yz xz, of nine, or of four in 2D. Data at points are interpolated
        linearly, on triangles and tetrahedra of second order with straight sides to second order.
        Data of cells are first averaged at the points, by volume. Points within half a cell of the
        mesh have the value at its boundary.

    Raises
    ------
    XcrackError
        The file is missing or cannot be read.
    MeshError
        No such data, data of another shape or not finite, no cells to interpolate in.

    Examples
    --------
    >>> import tempfile, pathlib, meshio
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "T.vtu"
    >>> data = {"T": [1.0, 2.0, 3.0]}
    >>> points, cells = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("triangle", [(0, 1, 2)])]
    >>> meshio.Mesh(points, cells, point_data=data).write(path)
    >>> read_field(path)(np.array([(0.5, 0.5)]))
    array([2.5])
    """
    path = existing_file(path, "field")
    with system_errors("cannot read the field file", path):
        content = meshio_read(path, "field")
    points = np.asarray(content.points, dtype=float)
    blocks = [
        (block.type, np.asarray(block.data, dtype=np.int64))
        for block in content.cells
        if base_kind(block.type) is not None
    ]
    top = max((SHAPES[base_kind(kind) or "vertex"].dim for kind, _ in blocks), default=0)
    blocks = [(k, data) for k, data in blocks if SHAPES[base_kind(k) or "vertex"].dim == top]
    if top < 2:
        raise MeshError(f"{path.name} has no cells of 2D or 3D to interpolate in.")
    source, values = _data(content, name, path.name)
    if source == "cell":
        values = _at_points(points, content.cells, values, top, path.name)
    values = _values_of_shape(values, len(points), top, path.name)
    return _field(points, blocks, values, top, f"{name or 'of'} {path.name}".strip())


def write_field(path: Path, field: Field, name: str) -> None:
    """Write a field to a vtu file, from which `read_field` reads the same one.

    Points that no cell uses are put to the origin.

    Parameters
    ----------
    path : Path
    field : Field
    name : str
        Of the data.
    """
    meshio = require_package("meshio", "writing a field")
    d = field.mesh.dim
    points = np.zeros((len(field.values), 3))
    corners = field.mesh.points[field.mesh.cells]
    points[field.nodes[:, : d + 1].ravel(), :d] = corners.reshape(-1, d)
    kind = {3: "triangle", 6: "triangle6", 4: "tetra", 10: "tetra10"}[field.nodes.shape[1]]
    values = field.values.reshape(len(points), -1)
    with system_errors("the field cannot be written to", path):
        meshio.Mesh(points, [(kind, field.nodes)], point_data={name: values}).write(path)


def _data(content: Any, name: str | None, source: str) -> tuple[str, Any]:
    """The wanted data: where they belong to, and their values."""
    array_kinds = {
        **{k: "cell" for k in content.cell_data},
        **{k: "point" for k in content.point_data},
    }
    if name is None:
        if len(array_kinds) != 1:
            raise MeshError(
                f"{source} has {len(array_kinds)} fields "
                f"({', '.join(map(repr, sorted(array_kinds)))}): give read_field(path, name) the "
                f"one you mean."
            )
        name = next(iter(array_kinds))
    if name not in array_kinds:
        names = ", ".join(map(repr, sorted(array_kinds))) or "none"
        raise MeshError(f"{source} has no field {value_text(name)}: give one of {names}.")
    data = content.point_data if array_kinds[name] == "point" else content.cell_data
    return array_kinds[name], data[name]


def _at_points(points: Floats, blocks: Any, values: Any, top: int, source: str) -> Floats:
    """Values of cells averaged at the points, by the sizes of the cells."""
    total: Any = None
    weight = np.zeros(len(points))
    for block, values_of_block in zip(blocks, values, strict=True):
        base = base_kind(block.type)
        if base is None or SHAPES[base].dim != top:
            continue
        rows = np.asarray(block.data, dtype=np.int64)
        corner = points[rows[:, : SHAPES[base].corners]]
        # The spread of the corners stands for the volume: weights need no more.
        size = np.linalg.norm(corner - corner.mean(axis=1, keepdims=True), axis=2).max(axis=1)
        size = size**top
        data = np.asarray(values_of_block, dtype=float)
        if total is None:
            total = np.zeros((len(points), *data.shape[1:]))
        for column in rows.T:
            np.add.at(total, column, size.reshape(-1, *[1] * (data.ndim - 1)) * data)
            np.add.at(weight, column, size)
    if total is None:
        raise MeshError(f"{source} has no data on its cells of {top} dimensions.")
    return np.asarray(total / np.maximum(weight, 1e-300).reshape(-1, *[1] * (total.ndim - 1)))


def _values_of_shape(values: Any, n: int, top: int, source: str) -> Floats:
    """Values as scalars, vectors or stresses of the dimension of the cells."""
    data = np.asarray(values, dtype=float).reshape(n, -1)
    width = data.shape[1]
    if width == 1:
        return data[:, 0]
    if width in (2, 3) and width >= top:
        return data[:, :top]
    readers = {6: lambda: data[:, _SIX].reshape(n, 3, 3), 9: lambda: data.reshape(n, 3, 3)}
    if width in readers:
        return np.asarray(readers[width]()[:, :top, :top])
    if width == 4 and top < 3:
        return data.reshape(n, 2, 2)
    raise MeshError(
        f"{source}: data of {width} components are no scalar, vector or stress of a {top}D body "
        "(give 1, 2, 3, 4, 6 or 9)."
    )


def _field(
    points: Floats, blocks: list[tuple[str, Ints]], values: Floats, top: int, name: str
) -> Field:
    kinds = {kind for kind, data in blocks if len(data)}
    nodes, n_given = None, len(points)
    if len(kinds) == 1 and kinds <= {"triangle6", "tetra10"}:
        nodes = np.concatenate([data for _, data in blocks])
    else:
        raw_mesh = _cells_as_simplices(RawMesh(points, blocks), name)
        points = raw_mesh.points
        kind = "tetra" if top > 2 else "triangle"
        nodes = np.concatenate([data for k, data in raw_mesh.blocks if k == kind])
        if len(points) > n_given:
            values = _with_middles(values, nodes, n_given, len(points))
    if top < 3:
        spread = np.ptp(points, axis=0)
        if len(spread) > 2 and spread[2] > 1e-9 * spread.max():
            raise MeshError(f"{name}: the cells are a surface in 3D, not a body.")
        points = points[:, :2]
    x = points[nodes[:, : top + 1]]
    is_turned = np.linalg.det(x[:, 1:] - x[:, :1]) < 0
    order = _TURNED.get(nodes.shape[1], [1, 0, *range(2, nodes.shape[1])])
    nodes = np.where(is_turned[:, None], nodes[:, order], nodes)
    node_numbers = np.unique(nodes)
    is_infinite = ~np.isfinite(values[node_numbers].reshape(len(node_numbers), -1)).all(axis=1)
    if is_infinite.any():
        raise MeshError(
            f"{name}: the value at {at(points[node_numbers[np.argmax(is_infinite)]])} is not "
            f"finite ({int(is_infinite.sum())} such points)."
        )
    corners, cells = np.unique(nodes[:, : top + 1], return_inverse=True)
    mesh = sound_mesh(points[corners], cells.reshape(-1, top + 1))
    return Field(mesh, frozen_copy(nodes), frozen_copy(values), name)


def _cells_as_simplices(raw_mesh: RawMesh, name: str) -> RawMesh:
    """Cells as simplices; how they are divided matters to nobody who interpolates."""
    from xcrack.base.errors import collected_warnings

    messages: list[str] = []
    with collected_warnings(messages):
        result = linear_mesh(raw_mesh, name, strict=False)
    for message in messages:
        if "the sides are straight now" in message:
            warn(message)
    return result


def _with_middles(values: Floats, nodes: Ints, n_given: int, n: int) -> Floats:
    """Values with those of the points added in the middle of cells: means of their corners."""
    middle_values = np.zeros((n - n_given, *values.shape[1:]))
    count = np.zeros(n - n_given)
    for column in range(nodes.shape[1]):
        for corner in range(nodes.shape[1]):
            rows = (nodes[:, column] >= n_given) & (nodes[:, corner] < n_given)
            np.add.at(middle_values, nodes[rows, column] - n_given, values[nodes[rows, corner]])
            np.add.at(count, nodes[rows, column] - n_given, 1)
    middle_values /= np.maximum(count, 1).reshape(-1, *[1] * (values.ndim - 1))
    return np.concatenate([values, middle_values])
