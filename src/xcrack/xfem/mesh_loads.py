"""Load vectors that belong to the mesh: growth makes them once, and not at each step."""

from collections.abc import Iterable

import numpy as np

from xcrack.arrays import Floats, lock
from xcrack.mesh.mesh import numbers_of
from xcrack.mesh.sets import facet_set
from xcrack.scene.conditions import Load, SetLoad
from xcrack.xfem.assembly import MeshLoad
from xcrack.xfem.function_space import FunctionSpace


def mesh_loads(space: FunctionSpace, loads: Iterable[MeshLoad]) -> dict[int, Floats]:
    """Vectors `(n_dof,)` of loads of an earlier solve that act on plain cells here, by identity."""
    result = {}
    for one in loads:
        if not space.signature[one.cells].any():
            f = np.zeros(space.n_dof)
            f[: len(one.f)] = one.f
            result[id(one.load)] = f
    return result


def on_mesh(
    space: FunctionSpace, loads: Iterable[tuple[Load, Floats]], before: Iterable[MeshLoad]
) -> tuple[MeshLoad, ...]:
    """Those loads with their vectors `(n_dof,)` that act on facets of plain cells alone.

    What is known of them from an earlier solve in the mesh serves again.
    """
    known = {id(one.load): one for one in before}
    result = []
    for load, f in loads:
        if not isinstance(load, SetLoad):
            continue
        one = known.get(id(load))
        if one is None:
            facets = facet_set(space.mesh, load.where, "")
            cells = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 0]
            standard = f[: space.n_nodes * space.dim]
            one = MeshLoad(load, lock(np.array(cells)), lock(standard.copy()))
        if not space.signature[one.cells].any():
            result.append(one)
    return tuple(result)
