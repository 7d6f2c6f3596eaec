"""Write gmsh's msh format: meshio's writer takes one physical group an entity, and no overlap."""

from collections.abc import Iterable

import numpy as np

from xcrack.base.arrays import Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import MeshError
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.raw import sets_to_write

REST = "xcrack:rest"  # group of the cells of no set: meshio wants a group for every cell, or none
_ELEMENT_TYPE = {1: 1, 2: 2, 3: 4}  # gmsh's numbers of line, triangle, tetrahedron

Entity = tuple[int, int, Ints, Ints]  # dimension, number, tags of its groups, its elements


def msh_text(mesh: Mesh, version: str = "4.1") -> str:
    """A mesh as msh text; every set is a physical group.

    Elements that share the same sets make one entity, which bears the groups of all of them.

    Parameters
    ----------
    mesh : Mesh
        What to write.
    version : {"4.1", "2.2"}
        Version of the format.

    Returns
    -------
    str

    Raises
    ------
    MeshError
        A name with a quotation mark or a line break in it.
    """
    facet_sets, cell_sets = sets_to_write(mesh)
    d = mesh.dim
    numbers = {name: mesh.facet_numbers(facets) for name, facets in facet_sets.items()}
    facet_names, facet_groups = _groups(numbers, len(mesh.facets), with_rest=False)
    cell_names, cell_groups = _groups(cell_sets, len(mesh.cells), with_rest=True)
    entities = [(d - 1, i, t, mesh.facets[rows]) for i, (t, rows) in enumerate(facet_groups, 1)]
    entities += [(d, i, t, mesh.cells[rows]) for i, (t, rows) in enumerate(cell_groups, 1)]
    names = [(d - 1, tag, name) for tag, name in enumerate(facet_names, 1)]
    names += [(d, tag, name) for tag, name in enumerate(cell_names, 1)]
    body = _version_4(mesh, entities) if version == "4.1" else _version_2(mesh, entities)
    lines = ["$MeshFormat", f"{version} 0 8", "$EndMeshFormat", *_names(names), *body]
    return "\n".join(lines) + "\n"


def _groups(
    sets: dict[str, Ints], count: int, with_rest: bool
) -> tuple[list[str], list[tuple[Ints, Ints]]]:
    """Names of the groups, and for each combination of groups its tags and its elements."""
    names = list(sets)
    member = np.zeros((count, len(names)), dtype=bool)
    for column, rows in enumerate(sets.values()):
        member[rows, column] = True
    is_alone = ~member.any(axis=1)
    if with_rest and is_alone.any():
        names.append(REST)
        member = np.column_stack([member, is_alone])
    rows = np.flatnonzero(member.any(axis=1))
    if not len(rows):
        return names, []
    kinds, kind = np.unique(member[rows], axis=0, return_inverse=True)
    kind = kind.ravel()
    return names, [(np.flatnonzero(k) + 1, rows[kind == i]) for i, k in enumerate(kinds)]


def _names(names: list[tuple[int, int, str]]) -> Iterable[str]:
    for _, _, name in names:
        if '"' in name or "\n" in name or "\\" in name:
            raise MeshError(
                f"set name {value_text(name)}: msh files take no quotation marks or backslashes."
            )
    yield from ["$PhysicalNames", str(len(names))]
    yield from (f'{dim} {tag} "{name}"' for dim, tag, name in names)
    yield "$EndPhysicalNames"


def _coordinates(mesh: Mesh) -> list[str]:
    # repr is the shortest text that gives the same number again.
    third_coordinate = " 0" * (3 - mesh.dim)
    return [" ".join(map(repr, x)) + third_coordinate for x in mesh.points.tolist()]


def _version_4(mesh: Mesh, entities: list[Entity]) -> Iterable[str]:
    n, d = mesh.n_points, mesh.dim
    yield "$Entities"
    yield " ".join(str(sum(e[0] == k for e in entities)) for k in range(4))
    for _, number, tags, elements in entities:
        corners = np.zeros((2, 3))
        x = mesh.points[elements.ravel()]
        corners[:, :d] = x.min(axis=0), x.max(axis=0)
        limits = " ".join(map(repr, corners.ravel().tolist()))
        yield f"{number} {limits} {len(tags)} {' '.join(map(str, tags))} 0"
    yield from ["$EndEntities", "$Nodes", f"1 {n} 1 {n}", f"{d} 1 0 {n}"]
    yield from map(str, range(1, n + 1))
    yield from _coordinates(mesh)
    total = sum(len(elements) for *_, elements in entities)
    yield from ["$EndNodes", "$Elements", f"{len(entities)} {total} 1 {total}"]
    first = 1
    for dim, number, _, elements in entities:
        yield f"{dim} {number} {_ELEMENT_TYPE[dim]} {len(elements)}"
        rows = np.column_stack([np.arange(first, first + len(elements)), elements + 1])
        yield from (" ".join(map(str, row)) for row in rows.tolist())
        first += len(elements)
    yield "$EndElements"


def _version_2(mesh: Mesh, entities: list[Entity]) -> Iterable[str]:
    yield from ["$Nodes", str(mesh.n_points)]
    yield from (f"{i} {x}" for i, x in enumerate(_coordinates(mesh), 1))
    yield from ["$EndNodes", "$Elements"]
    yield str(sum(len(tags) * len(elements) for _, _, tags, elements in entities))
    first = 1
    for dim, number, tags, elements in entities:
        for tag in tags.tolist():
            for i, row in enumerate((elements + 1).tolist(), first):
                yield f"{i} {_ELEMENT_TYPE[dim]} 2 {tag} {number} {' '.join(map(str, row))}"
            first += len(elements)
    yield "$EndElements"
