"""The body that a 3D mesh fills: how deep points lie in it, and how large its cells are."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.geometry.distances import TriangleTree, signed_in, triangle_tree
from xcrack.mesh.mesh import Mesh

ON = 1e-9  # share of a cell within which a point lies on the boundary


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh and the search tree of its boundary."""

    mesh: Mesh
    boundary: TriangleTree
    facet_size: Floats

    @staticmethod
    def of(mesh: Mesh) -> "Body":
        """The body that a mesh fills."""
        place = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
        cell = mesh.facet_to_cell[place, 0]
        facets = mesh.facets[place]
        corner = mesh.points[facets]
        # Barycentric coordinates decrease towards the facet opposite to their corner.
        local = np.argmax(mesh.cell_to_facet[cell] == place[:, None], axis=1)
        inward = mesh.gradient[cell, local]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        turned = np.einsum("ij,ij->i", normal, inward) > 0
        facets = np.where(turned[:, None], facets[:, ::-1], facets)
        size = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
        return Body(mesh, triangle_tree(mesh.points, facets), size)

    def depth(self, x: Floats) -> tuple[Floats, Floats]:
        """Distance to the boundary, negative inside, and the size of the facet there."""
        distance, facet, _ = signed_in(self.boundary, x)
        return distance, self.facet_size[facet]

    def contains(self, x: Floats) -> Bools:
        """Which points lie in the body, its boundary included."""
        distance, size = self.depth(x)
        return np.asarray(distance <= ON * size)

    def cell_size(self, x: Floats) -> Floats:
        """Size of the cell with the nearest centroid, outside the body as well."""
        return np.asarray(self.mesh.cell_size[self.mesh.cell_tree.query(x)[1]])
