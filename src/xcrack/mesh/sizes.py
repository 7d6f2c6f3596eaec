"""Sizes of cells."""

from math import factorial

from xcrack.arrays import Ints
from xcrack.mesh.mesh import Mesh


def leg_size(mesh: Mesh, cells: Ints) -> float:
    """Size of the simplex with right angles that has the mean volume of the cells, length."""
    return float((factorial(mesh.dim) * mesh.volume[cells].mean()) ** (1 / mesh.dim))
