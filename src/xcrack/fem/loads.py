"""Load vectors: every load is tested with every function, enriched ones included."""

from collections.abc import Iterable

import numpy as np

from xcrack.base.arrays import Floats, Ints, lock
from xcrack.base.errors import ProblemError
from xcrack.fem.assembly import MeshLoad
from xcrack.fem.facets import LipPoints, jump_values, part_points, split_facets
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.quadrature import Points, at_joints, cell_points, cell_side
from xcrack.mesh.mesh import facet_set, numbers_of
from xcrack.model.loads import FacetPoints, Load
from xcrack.model.material import Material


def load_vector(
    space: FunctionSpace, material: Material, load: Load, lips: tuple[LipPoints, ...]
) -> Floats:
    """A load, tested with every function `(n_dof,)`; displacements give nothing.

    Raises
    ------
    ProblemError
        A set with facets inside the body, or what the load says.
    """
    f = np.zeros((space.n_functions, space.dim))
    acts = load.acts
    if "traction" in acts:
        points, on_facets = outer_points(space, load)
        _add(f, space, points, load.traction(on_facets))
    if "point_force" in acts:
        number, force = load.point_forces(space.mesh)
        np.add.at(f, number, force)
    if "volume" in acts:
        points = body_points(space)
        _add(f, space, points, load.volume(position(space, points.cell, points.bary)))
    if "initial_stress" in acts:
        points = body_points(space)
        x = position(space, points.cell, points.bary)
        _subtract_stress(f, space, points, load.initial_stress(x, material))
    if "face_pressure" in acts:
        for c, on_lip in enumerate(lips):
            p = load.face_pressure(on_lip.x, c)
            if p is not None:
                f += lip_force(space, c, on_lip, p[:, None] * on_lip.normal)
    return f.ravel()


def outer_points(space: FunctionSpace, load: Load, halvings: int = 0) -> tuple[Points, FacetPoints]:
    """Points of integration on the facet set of a load, and what it is asked at them.

    Raises
    ------
    ProblemError
        A set with facets inside the body.
    """
    facets = facet_set(space.mesh, load.where, load.name)
    inner = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 1] >= 0
    if inner.any():
        raise ProblemError(
            f"{load.name}: {int(inner.sum())} of its facets lie inside the body; loads act on the "
            "boundary only."
        )
    points, normal = facet_points(space, facets, halvings=halvings)
    x = position(space, points.cell, points.bary)
    return points, FacetPoints(space.mesh, facets, x, normal, points.weight)


def position(space: FunctionSpace, cell: Ints, bary: Floats) -> Floats:
    """Coordinates of points given by cell and barycentric coordinates."""
    from xcrack.fem.kernels.functions import places

    mesh = space.mesh
    return np.asarray(places(cell, np.ascontiguousarray(bary), mesh.points, mesh.cells))


def _add(f: Floats, space: FunctionSpace, points: Points, density: Floats) -> None:
    """Add the integral of density . v over the points."""
    cells = np.unique(points.cell)
    for batch, _ in space.batches(cells):
        number, row, _ = points.of_cells(batch.cells)
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number], slopes=False)
        force = N[:, :, None] * (points.weight[number, None] * density[number])[:, None]
        _scatter(f, batch.functions[row], force)


def _scatter(f: Floats, functions: Ints, force: Floats) -> None:
    active = functions >= 0
    np.add.at(f, functions[active], force[active])


def body_points(space: FunctionSpace) -> Points:
    """Points of integration of loads in the whole body."""
    cells = np.arange(len(space.mesh.cells))
    # Loads are not corrected as the stiffness is: they need a degree more near tips.
    return cell_points(space, cells, 5, space.order + 2)


def facet_points(
    space: FunctionSpace, facets: Ints, n: int = 6, halvings: int = 0
) -> tuple[Points, Floats]:
    """Points on boundary facets with their outward normals; weights are lengths or areas.

    `n` and `halvings` are those of `part_points`.
    """
    mesh = space.mesh
    number = numbers_of(mesh, facets)
    cell = mesh.facet_to_cell[number, 0]
    parts = split_facets(space, facets)
    k, place, weight = part_points(space, facets[parts.number], parts.bary, n, halvings)
    owner = parts.number[k]
    c = cell[owner]
    # Place of each point of the facet among those of its cell.
    is_vertex = mesh.cells[c][:, :, None] == facets[owner][:, None, :]
    on_facet = np.einsum("qv,qvb->qb", place, parts.bary[k])
    bary = np.einsum("qvf,qf->qv", is_vertex.astype(float), on_facet)
    opposite = (~is_vertex.any(axis=2)).argmax(axis=1)
    inward = mesh.gradient[c, opposite]
    normal = -inward / np.linalg.norm(inward, axis=1, keepdims=True)
    side = cell_side(space, c)
    for i, cut in enumerate(space.cuts):
        crossed = cut.is_cut[c] | (cut.is_tip[c] & (side[:, i] == 0))
        side[crossed, i] = parts.side[k, i][crossed]
    side = at_joints(space, c, bary, side)
    order = np.argsort(c, kind="stable")
    return Points(c[order], bary[order], weight[order], side[order]), normal[order]


def _subtract_stress(f: Floats, space: FunctionSpace, points: Points, sigma: Floats) -> None:
    """Subtract the integral of sigma0 : grad v."""
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        _, G = space.tabulate(batch, row, points.bary[number], points.side[number])
        force = -np.einsum("q,qij,qnj->qni", points.weight[number], sigma[number], G)
        _scatter(f, batch.functions[row], force)


def lip_force(space: FunctionSpace, c: int, lips: LipPoints, force: Floats) -> Floats:
    """Integral of force . [[v]] over the faces of crack c `(n_functions, d)`.

    Parameters
    ----------
    force : (q, d) array, stress
        On lip +; the opposite acts on lip -.
    """
    f = np.zeros((space.n_functions, space.dim))
    for functions, number, N in jump_values(space, c, lips):
        _scatter(f, functions, N[:, :, None] * (lips.weight[number, None] * force[number])[:, None])
    return f


# Load vectors that belong to the mesh: growth makes them once, and not at each step.


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
    loads_before = {id(one.load): one for one in before}
    result = []
    for load, f in loads:
        if load.acts != {"traction"}:
            continue
        one = loads_before.get(id(load))
        if one is None:
            facets = facet_set(space.mesh, load.where, "")
            cells = space.mesh.facet_to_cell[numbers_of(space.mesh, facets), 0]
            standard = f[: space.n_nodes * space.dim]
            one = MeshLoad(load, lock(np.array(cells)), lock(standard.copy()))
        if not space.signature[one.cells].any():
            result.append(one)
    return tuple(result)


__all__ = []
