"""Sizes of cells."""

from math import factorial

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.mesh.mesh import Mesh


def leg_size(mesh: Mesh, cells: Ints) -> float:
    """Size of the simplex with right angles that has the mean volume of the cells, length."""
    return float((factorial(mesh.dim) * mesh.volume[cells].mean()) ** (1 / mesh.dim))


def leg_sizes(mesh: Mesh, cells: Ints) -> Floats:
    """Size of the simplex with right angles that has the volume of each cell, length."""
    return np.asarray((factorial(mesh.dim) * mesh.volume[cells]) ** (1 / mesh.dim))
