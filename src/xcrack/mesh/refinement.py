"""Uniform refinement: each simplex into parts of half its size."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.errors import MeshError
from xcrack.mesh.mesh import Mesh, sound_mesh
from xcrack.mesh.simplex import cell_nodes, facet_nodes, node_points

# Children of a simplex by its nodes: vertices first, then midpoints in the order of local_edges.
_TRIANGLE = np.array([(0, 3, 4), (3, 1, 5), (4, 5, 2), (3, 5, 4)])
_CORNERS = np.array([(0, 4, 5, 6), (4, 1, 7, 8), (5, 7, 2, 9), (6, 8, 9, 3)])
# The octahedron between the four corners: its diagonals, and the other midpoints around each.
_DIAGONALS = np.array([(4, 9), (5, 8), (6, 7)])
_AROUND = np.array([(5, 7, 8, 6), (4, 7, 9, 6), (4, 5, 9, 8)])
_TIE = 1e-6  # share by which a diagonal must be shorter to be taken instead of one before it


def refine(mesh: Mesh) -> Mesh:
    """Split every edge in two: triangles into four, tetrahedra into eight.

    The octahedron inside a tetrahedron is cut along its shortest diagonal, which keeps shapes
    from degrading when it is repeated (Zhang, 1995, Houston J. Math. 21, Successive subdivisions
    of tetrahedra). A polygon that stands for a curved boundary stays that polygon.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    Mesh
        Conforming, the old points first, with the same facet and cell sets.

    Raises
    ------
    MeshError
        Not a mesh.

    Examples
    --------
    >>> from xcrack.mesh.box import box
    >>> refine(box((0, 0), (1, 1), 1))
    Mesh(9 points, 8 triangles, facet sets: left, right, bottom, top, boundary)
    """
    if not isinstance(mesh, Mesh):
        raise MeshError(f"refine: give a Mesh, not {type(mesh).__name__}.")
    points = node_points(mesh, 2)
    nodes = cell_nodes(mesh, 2)
    cells, parent = (_triangles, _tetrahedra)[mesh.dim - 2](points, nodes)
    inverse = np.argsort(parent, kind="stable").reshape(len(mesh.cells), -1)
    return sound_mesh(
        points,
        cells,
        {name: _halved(mesh, facets) for name, facets in mesh.facet_sets.items()},
        {name: inverse[members].ravel() for name, members in mesh.cell_sets.items()},
    )


def _triangles(points: Floats, nodes: Ints) -> tuple[Ints, Ints]:
    """Children `(4 m, 3)` and the cell that each lies in."""
    return nodes[:, _TRIANGLE].reshape(-1, 3), np.repeat(np.arange(len(nodes)), 4)


def _tetrahedra(points: Floats, nodes: Ints) -> tuple[Ints, Ints]:
    """Children `(8 m, 4)` and the cell that each lies in."""
    ends = points[nodes[:, _DIAGONALS]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
    # Of diagonals that are equal but for round-off the first is taken, wherever the body lies.
    kind = np.argmax(length <= length.min(axis=1, keepdims=True) * (1 + _TIE), axis=1)
    ring = _AROUND[kind]
    inner = [
        np.stack([*_DIAGONALS[kind].T, ring[:, i], ring[:, (i + 1) % 4]], axis=1) for i in range(4)
    ]
    local = np.concatenate(
        [np.broadcast_to(_CORNERS, (len(nodes), 4, 4)), np.stack(inner, axis=1)], axis=1
    )
    children = np.take_along_axis(nodes[:, None], local, axis=2)
    return children.reshape(-1, 4), np.repeat(np.arange(len(nodes)), 8)


def _halved(mesh: Mesh, facets: Ints) -> Ints:
    """Parts of facets: two of an edge, four of a triangle."""
    if not len(facets):
        return facets
    nodes = facet_nodes(mesh, 2, facets)
    parts = (np.array([(0, 2), (2, 1)]), _TRIANGLE)[mesh.dim - 2]
    return np.asarray(nodes[:, parts].reshape(-1, mesh.dim))


__all__ = ["refine"]
