"""Area vectors of boundary facets."""

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.mesh.mesh import Mesh


def outward_areas(mesh: Mesh, facets: Ints, what: str) -> Floats:
    """Outward normal of each facet times its length (2D) or area (3D), `(k, d)`.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
    what : str
        For messages.

    Raises
    ------
    ProblemError
        Facets inside the body.
    """
    number = mesh.facet_numbers(facets)
    cell = mesh.facet_to_cell[number, 0]
    inner = mesh.facet_to_cell[number, 1] >= 0
    if inner.any():
        raise ProblemError(
            f"{what}: {int(inner.sum())} of its facets lie inside the body; loads act on the "
            "boundary only."
        )
    place = np.argmax(mesh.cell_to_facet[cell] == number[:, None], axis=1)
    # The gradient of the corner across is the inward normal over the height above the facet.
    return np.asarray(-mesh.dim * mesh.volume[cell, None] * mesh.gradient[cell, place])
