"""Imposed displacements: which unknowns are known, and their values."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import shown
from xcrack.base.errors import ProblemError
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import facet_points, position
from xcrack.fem.quadrature import Points
from xcrack.mesh.mesh import facet_set, nearest_point
from xcrack.mesh.simplex import facet_nodes
from xcrack.model.conditions import Displacement, Fix, evaluate

_TRACE = 1e-13  # enriched functions below this value on a facet do not act there (round-off)
# Share of the largest singular value below which traces of enriched functions do not count. A tube
# that just reaches a side of a 3D body has traces there so small that they would buy any value with
# a coefficient of any size inside the body.
_LEAST = {2: 1e-11, 3: 1e-3}


@dataclass(frozen=True, eq=False)
class Known:
    """Unknowns that supports decide, and their values.

    Attributes
    ----------
    fixed : (n_dof,) array of bool
    value : (n_dof,) array, length
        Zero where nothing is imposed.
    owner : (n_dof,) array of int
        Number of the support that decides, -1 where none does.
    """

    fixed: Bools
    value: Floats
    owner: Ints


def known_unknowns(space: FunctionSpace, supports: tuple[Fix | Displacement, ...]) -> Known:
    """Unknowns decided by the supports.

    Raises
    ------
    ProblemError
        Unknown sets, wrong shapes or nan, or two supports that contradict each other at a point.
    """
    fixed = np.zeros((space.n_functions, space.dim), dtype=bool)
    value = np.zeros((space.n_functions, space.dim))
    fitted = np.zeros_like(fixed)
    owner = np.full(fixed.shape, -1, dtype=np.int64)
    for number, support in enumerate(supports):
        if isinstance(support, Fix):
            functions = _functions_of(space, support.where, "fix")
            axes = range(space.dim) if support.axis is None else [support.axis]
            for axis in axes:
                _impose(space, fixed, value, fitted, functions, axis, np.zeros(len(functions)), 0)
        else:
            for axis, functions, numbers, n_fitted in _imposed(space, support):
                _impose(space, fixed, value, fitted, functions, axis, numbers, n_fitted)
        owner[fixed & (owner < 0)] = number
    return Known(fixed.ravel(), value.ravel(), owner.ravel())


def _impose(
    space: FunctionSpace,
    fixed: Bools,
    value: Floats,
    fitted: Bools,
    functions: Ints,
    axis: int,
    numbers: Floats,
    n_fitted: int,
) -> None:
    """Write values; the last `n_fitted` come from a fit and may differ from a neighbour's."""
    again = fixed[functions, axis]
    from_fit = np.arange(len(functions)) >= len(functions) - n_fitted
    scale = max(float(np.abs(numbers).max(initial=0)), float(np.abs(value).max(initial=0)))
    clash = again & (np.abs(value[functions, axis] - numbers) > 1e-6 * scale)
    clash &= ~from_fit & ~fitted[functions, axis]
    if clash.any():
        i = int(np.argmax(clash))
        x = space.node_points[functions[i]]
        raise ProblemError(
            f"two supports contradict each other at {np.round(x, 6).tolist()}, axis {axis}: "
            f"{value[functions[i], axis]:.6g} and {numbers[i]:.6g}; leave one direction free."
        )
    value[functions[~again], axis] = numbers[~again]
    fixed[functions, axis] = True
    fitted[functions[~again], axis] = from_fit[~again]


def _set_nodes(space: FunctionSpace, where: object, what: str) -> Ints:
    if isinstance(where, str):
        facets = facet_set(space.mesh, where, what)
        return np.unique(facet_nodes(space.mesh, space.order, facets))
    return np.array([nearest_point(space.mesh, np.asarray(where), what)])


def _functions_of(space: FunctionSpace, where: object, what: str) -> Ints:
    """Functions that act on a set: standard ones, and enriched ones with a trace there.

    At a point only the standard function has a value, and that of a jump on the crack.
    """
    nodes = _set_nodes(space, where, what)
    parts = [nodes]
    if isinstance(where, str):
        facets = facet_set(space.mesh, where, what)
        _check_ends(space, where, facets, what)
        owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
        facets = facets[space.signature[owner] != 0]
        if len(facets):
            parts.append(_traces(space, facets)[1])
    else:
        for cut, number in zip(space.cuts, space.heaviside, strict=True):
            on_lip = nodes[cut.level_set.phi[nodes] == 0]
            parts.append(number[on_lip][number[on_lip] >= 0])
    return np.unique(np.concatenate(parts))


def _check_ends(space: FunctionSpace, where: str, facets: Ints, what: str) -> None:
    """Raise where a set ends at a point on a crack and holds its lip - there.

    The functions of such a point are those of lip + and of the jump: only their sum is known.
    """
    for c, cut in enumerate(space.cuts):
        phi = cut.level_set.phi
        touches = np.zeros((2, space.mesh.n_points), dtype=bool)
        for corner in range(facets.shape[1]):
            others = np.delete(phi[facets], corner, axis=1)
            touches[0, facets[(others < 0).any(axis=1), corner]] = True
            touches[1, facets[(others > 0).any(axis=1), corner]] = True
        ends = (phi == 0) & (space.heaviside[c][: space.mesh.n_points] >= 0)
        bad = ends & touches[0] & ~touches[1]
        if bad.any():
            x = np.round(space.mesh.points[np.argmax(bad)], 6).tolist()
            raise ProblemError(
                f"{what}({shown(where)}) ends at {x}, where crack {c} meets the boundary, and "
                "supports its lip - only: give the points of the crack in the reverse order (the "
                "supported lip is then lip +), or move its mouth by a thousandth of a cell."
            )


def _traces(space: FunctionSpace, facets: Ints) -> tuple[Points, Ints, Ints, Floats]:
    """Points on facets, and what acts there: function, number of the point, value."""
    points, _ = facet_points(space, facets)
    columns: list[Ints] = []
    rows: list[Ints] = []
    values: list[Floats] = []
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number], slopes=False)
        functions = batch.functions[row]
        acts = (functions >= 0) & (np.abs(N) > _TRACE)
        columns.append(functions[acts])
        rows.append(np.broadcast_to(number[:, None], functions.shape)[acts])
        values.append(N[acts])
    return points, np.concatenate(columns), np.concatenate(rows), np.concatenate(values)


def _imposed(space: FunctionSpace, support: Displacement) -> list[tuple[int, Ints, Floats, int]]:
    """Axis, functions, values and number of fitted values of an imposed displacement."""
    nodes = _set_nodes(space, support.where, "displacement")
    what = f"displacement({shown(support.where)})"
    value = support.value
    axes = list(range(space.dim))
    if isinstance(value, tuple):
        if len(value) != space.dim:
            raise ProblemError(f"{what}: {len(value)} entries for {space.dim} directions.")
        axes = [i for i in axes if value[i] is not None]
        value = np.array([0.0 if v is None else v for v in value])
    if not isinstance(support.where, str):
        u = evaluate(value, space.node_points[nodes], what)
        return [(axis, nodes, u[:, axis], 0) for axis in axes]
    _check_ends(space, support.where, facet_set(space.mesh, support.where, what), "displacement")
    fitted, coefficients = _fit(space, support.where, value, what)
    plain = nodes[~np.isin(nodes, fitted[fitted < space.n_nodes])]
    u = evaluate(value, space.node_points[plain], what) if len(plain) else np.zeros((0, space.dim))
    functions = np.concatenate([plain, fitted])
    values = np.concatenate([u, coefficients])
    return [(axis, functions, values[:, axis], len(fitted)) for axis in axes]


def _fit(space: FunctionSpace, where: str, value: object, what: str) -> tuple[Ints, Floats]:
    """Least-squares fit on the facets where enriched functions act, and at nodes on a crack.

    Shifted functions vanish at nodes, not between them: fixing only the standard unknowns there
    would leave the facet half free. At a node on a crack the value has two answers: the facets
    beside it tell which one is meant.
    """
    empty = np.zeros(0, dtype=np.int64), np.zeros((0, space.dim))
    facets = facet_set(space.mesh, where, what)
    owner = space.mesh.facet_to_cell[space.mesh.facet_numbers(facets), 0]
    on_lip = np.zeros(space.n_nodes, dtype=bool)
    for cut, number in zip(space.cuts, space.heaviside, strict=True):
        vertices = np.arange(space.mesh.n_points)
        on_lip[vertices] |= (cut.level_set.phi == 0) & (number[vertices] >= 0)
    facets = facets[(space.signature[owner] != 0) | on_lip[facets].any(axis=1)]
    if not len(facets):
        return empty
    points, column, row, entry = _traces(space, facets)
    special = (column >= space.n_nodes) | np.isin(column, np.nonzero(on_lip)[0])
    if not special.any():
        return empty
    keep = np.isin(row, np.unique(row[special]))
    unknowns, place = np.unique(column[keep], return_inverse=True)
    row_ids, row_place = np.unique(row[keep], return_inverse=True)
    A = np.zeros((len(row_ids), len(unknowns)))
    A[row_place, place] = entry[keep]
    x = position(space, points.cell, points.bary)[row_ids]
    target = evaluate(value, x, what)
    # Each point counts alike: weighted by length, the data of a sliver would be cut off as noise.
    # Enriched functions take what standard ones leave, or they would take part in every field
    # where their traces are nearly those of polynomials.
    standard = unknowns < space.n_nodes
    solution = np.zeros((len(unknowns), space.dim))
    solution[standard] = np.linalg.lstsq(A[:, standard], target, rcond=1e-11)[0]
    scale = _scales(space)[unknowns]
    rest = np.linalg.lstsq(A / scale, target - A @ solution, rcond=_LEAST[space.dim])[0]
    return unknowns, solution + rest / scale[:, None]


def _scales(space: FunctionSpace) -> Floats:
    """Size of each function: 1, but the root of the radius for those of a tip."""
    scale = np.ones(space.n_functions)
    for tip in space.tips:
        first = tip.point_to_function[tip.point_to_function >= 0]
        scale[first[:, None] + np.arange(tip.functions)] = np.sqrt(tip.radius)
    return scale
