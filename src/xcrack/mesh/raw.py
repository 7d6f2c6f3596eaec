"""Mesh as a file holds it, before it is a `Mesh`: blocks of elements and sets by name."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import MeshError, warn
from xcrack.mesh.curved_facets import raised_lattice, with_curves
from xcrack.mesh.mesh import Mesh, sound_mesh

KINDS = ("vertex", "line", "triangle", "tetra")  # by their own dimension
_PLANAR = 1e-9  # spread of z over the extent of the body below which a mesh is plane


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Contents of a mesh file.

    Parameters
    ----------
    points : (n, 2) or (n, 3) array, length
        Coordinates.
    blocks : list of (kind, (m, k) array)
        Elements by kind (meshio's names), as point numbers.
    sets : list of (kind, name, (m, k) array)
        Elements of each set, as point numbers; a name may come several times.
    point_sets : list of (name, (m,) array)
        Sets of points.
    pairs, middles : (e, 2) array of int, (e, 2) or (e, 3) array, length, optional
        Ends of curved edges, and the middle of each.
    """

    points: Floats
    blocks: list[tuple[str, Ints]]
    sets: list[tuple[str, str, Ints]] = field(default_factory=list)
    point_sets: list[tuple[str, Ints]] = field(default_factory=list)
    pairs: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    middles: Floats = field(default_factory=lambda: np.zeros((0, 3)))


def mesh_from_raw(raw_mesh: RawMesh, source: str) -> Mesh:
    """Make a `Mesh` of what a file says, or say what in the file prevents it.

    The highest cells are the body, elements of one dimension less become facet sets. Doubled
    cells (msh 2.2 repeats a cell for each of its groups) are made one, points that no cell uses
    are dropped, a set of points becomes the facet set of the boundary facets it holds wholly.

    Parameters
    ----------
    raw_mesh : RawMesh
        Contents of the file.
    source : str
        Name of the file, for messages.

    Returns
    -------
    Mesh
        The mesh with its sets.

    Raises
    ------
    MeshError
        No cells, cells that are not linear simplices, a surface in 3D.
    """
    points, cells, facet_sets, cell_sets, number = mesh_parts(raw_mesh, source)
    return with_curved_edges(Mesh(points, cells, facet_sets, cell_sets), raw_mesh, number)


def mesh_parts(
    raw_mesh: RawMesh, source: str
) -> tuple[Floats, Ints, dict[str, Ints], dict[str, Ints], Ints]:
    """What a mesh is made of, as of `mesh_from_raw`.

    Returns
    -------
    points, cells, facet_sets, cell_sets
        As of `Mesh`.
    number : (n,) array of int
        Number of each point of the file among these points; -1 where no cell uses it.
    """
    _check_kinds(raw_mesh.blocks, source)
    dim = 3 if any(kind == "tetra" and len(data) for kind, data in raw_mesh.blocks) else 2
    stacked_cells = _stack((data for kind, data in raw_mesh.blocks if kind == KINDS[dim]), dim + 1)
    if not len(stacked_cells):
        content = ", ".join(f"{len(data)} {kind}" for kind, data in raw_mesh.blocks) or "nothing"
        raise MeshError(
            f"{source} has no triangles and no tetrahedra (it has {content}): mesh the surface or "
            "volume and export its elements; in gmsh, where there are physical groups, in one."
        )
    if stacked_cells.min() < 0 or stacked_cells.max() >= len(raw_mesh.points):
        raise MeshError(
            f"{source}: a cell names a point that the file lacks (it has {len(raw_mesh.points)} "
            "points): the file is damaged."
        )
    points = _in_dimensions(raw_mesh.points, stacked_cells, dim, source)
    cells = _unique_rows(stacked_cells)
    point_numbers = np.unique(cells)
    new_number = np.full(len(points), -1, dtype=np.int64)
    new_number[point_numbers] = np.arange(len(point_numbers))
    points, cells = points[point_numbers], new_number[cells]
    try:
        bare_mesh = sound_mesh(points, cells)
    except MeshError as error:
        raise MeshError(f"{source}: {error}") from error
    facet_sets = _facet_sets(raw_mesh, bare_mesh, new_number, source)
    cell_sets = {
        name: np.sort(_row_numbers(cells, new_number[members]))
        for name, members in _grouped_rows(raw_mesh.sets, KINDS[dim], dim + 1).items()
    }
    for name, members in raw_mesh.point_sets:
        if name not in facet_sets:
            is_inside = np.zeros(len(points), dtype=bool)
            is_inside[new_number[members][new_number[members] >= 0]] = True
            facets = bare_mesh.boundary
            facets = facets[is_inside[facets].all(axis=1)]
            if len(facets):
                facet_sets[name] = facets
    return (
        points,
        cells,
        _without_own_boundary(facet_sets, bare_mesh, source),
        cell_sets,
        new_number,
    )


def with_curved_edges(mesh: Mesh, raw_mesh: RawMesh, number: Ints) -> Mesh:
    """A mesh of a file with the curves that curved edges in it give.

    Parameters
    ----------
    mesh : Mesh
        Of the parts that `mesh_parts` returns.
    raw_mesh : RawMesh
    number : (n,) array of int
        As `mesh_parts` returns it.
    """
    pairs = number[raw_mesh.pairs]
    is_used = (pairs >= 0).all(axis=1)
    if not is_used.any():
        return mesh
    middles = np.asarray(raw_mesh.middles, dtype=float)[is_used, : mesh.dim]
    nodes = raised_lattice(mesh, mesh.boundary, pairs[is_used], middles)
    return with_curves(mesh, mesh.boundary, nodes)


def _without_own_boundary(
    facet_sets: dict[str, Ints], bare_mesh: Mesh, source: str
) -> dict[str, Ints]:
    """Facet sets with another name for a set "boundary" that is not the boundary of the mesh."""
    if "boundary" not in facet_sets:
        return facet_sets
    facets = facet_sets["boundary"]
    number, boundary = (np.unique(bare_mesh.facet_numbers(f)) for f in (facets, bare_mesh.boundary))
    if not np.array_equal(number, boundary):
        del facet_sets["boundary"]
        name = "boundary_of_file"
        while name in facet_sets:
            name += "_"
        facet_sets[name] = facets
        warn(
            f'{source}: the set "boundary" has {len(number)} facets, the boundary of the mesh has '
            f'{len(boundary)}: it is called {value_text(name)} here, since "boundary" means all of '
            f"them."
        )
    return facet_sets


def sets_to_write(mesh: Mesh) -> tuple[dict[str, Ints], dict[str, Ints]]:
    """Facet sets as point numbers and cell sets as cell numbers, less what is made anew anyway."""
    facet_sets = {name: facets for name, facets in mesh.facet_sets.items() if name != "boundary"}
    return facet_sets, dict(mesh.cell_sets)


def _facet_sets(
    raw_mesh: RawMesh, bare_mesh: Mesh, new_number: Ints, source: str
) -> dict[str, Ints]:
    facet_sets = {}
    for name, members in _grouped_rows(
        raw_mesh.sets, KINDS[bare_mesh.dim - 1], bare_mesh.dim
    ).items():
        is_valid = (members >= 0) & (members < len(new_number))
        facets = np.where(is_valid, new_number[np.where(is_valid, members, 0)], -1)
        is_facet = (facets >= 0).all(axis=1) & (bare_mesh.facet_numbers(facets) >= 0)
        if not is_facet.all():
            warn(
                f"{source}: {int((~is_facet).sum())} of the {len(facets)} elements in set "
                f"{value_text(name)} are no facets of any cell and are left out; mesh body and "
                f"sets together."
            )
        if is_facet.any():
            facet_sets[name] = _unique_rows(facets[is_facet])
    return facet_sets


def _check_kinds(blocks: list[tuple[str, Ints]], source: str) -> None:
    counts: dict[str, int] = {}
    for kind, data in blocks:
        if kind not in KINDS and len(data):
            counts[kind] = counts.get(kind, 0) + len(data)
    if not counts:
        return
    content = ", ".join(f"{count} {kind}" for kind, count in counts.items())
    raise MeshError(
        f"{source} has {content}: xcrack makes triangles and tetrahedra of triangles, "
        "quadrilaterals, tetrahedra, pyramids, prisms and hexahedra of any order, and reads no "
        "other cells. Mesh with those (gmsh: no Recombine of volumes; Abaqus: CPE3, CPS4, C3D10 "
        "...)."
    )


def _in_dimensions(points: Floats, cells: Ints, dim: int, source: str) -> Floats:
    points = np.asarray(points, dtype=np.float64)
    if points.shape[1] == dim:
        return points
    if points.shape[1] < dim:
        raise MeshError(f"{source} has tetrahedra, but points with two coordinates.")
    body = points[np.unique(cells)]
    spread = np.ptp(body, axis=0)
    if spread[2] > _PLANAR * spread.max():
        raise MeshError(
            f"{source} has triangles in 3D (z from {body[:, 2].min():g} to "
            f"{body[:, 2].max():g}) and no tetrahedra: for a 2D problem turn the mesh into a "
            "plane z = constant; for a body mesh its volume, not only its surface."
        )
    return points[:, :2]


def _stack(arrays: Iterable[Ints], width: int) -> Ints:
    parts = [np.asarray(a, dtype=np.int64).reshape(-1, width) for a in arrays]
    return np.concatenate(parts) if parts else np.zeros((0, width), dtype=np.int64)


def _grouped_rows(sets: list[tuple[str, str, Ints]], kind: str, width: int) -> dict[str, Ints]:
    parts: dict[str, list[Ints]] = {}
    for of_kind, name, members in sets:
        if of_kind == kind and len(members):
            parts.setdefault(name, []).append(members)
    return {name: _stack(members, width) for name, members in parts.items()}


def _unique_rows(rows: Ints) -> Ints:
    """Rows whose points come once, in the order of their first coming."""
    first = np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1]
    return rows[np.sort(first)]


def _row_numbers(rows: Ints, sought_rows: Ints) -> Ints:
    """Numbers of the rows that have the points asked for, each once."""
    all_rows = np.sort(np.concatenate([rows, sought_rows]), axis=1)
    inverse = np.unique(all_rows, axis=0, return_inverse=True)[1].ravel()
    place = np.full(int(inverse.max()) + 1, -1, dtype=np.int64)
    place[inverse[: len(rows)]] = np.arange(len(rows))
    return np.unique(place[inverse[len(rows) :]])
