"""Named sets of facets, and the mesh point nearest to a place."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.inputs import shown
from xcrack.mesh.mesh import Mesh


def facet_set(mesh: Mesh, name: str, what: str) -> Ints:
    """Facets of a set by name; an error lists the known names."""
    if name not in mesh.facet_sets:
        known = ", ".join(repr(n) for n in mesh.facet_sets)
        raise ProblemError(f"{what}: the mesh has no facet set {shown(name)}; it has {known}.")
    return mesh.facet_sets[name]


def nearest_point(mesh: Mesh, x: Floats, what: str) -> int:
    """Number of the mesh point nearest to x; an error where x is not in or at the body."""
    if len(x) != mesh.dim:
        raise ProblemError(f"{what}: the point {x.tolist()} needs {mesh.dim} coordinates.")
    distance = np.linalg.norm(mesh.points - x, axis=1)
    best = int(np.argmin(distance))
    if distance[best] > mesh.cell_size.max():
        raise ProblemError(
            f"{what}: {x.tolist()} is {distance[best]:.4g} away from the nearest mesh point "
            f"{mesh.points[best].tolist()}: give a point of the body."
        )
    return best
