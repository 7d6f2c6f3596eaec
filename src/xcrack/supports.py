"""Imposed displacements: which unknowns are known, and their values."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats, Ints
from xcrack.conditions import Displacement, Fix, evaluate
from xcrack.errors import ProblemError
from xcrack.loads import facet_points, facet_set, nearest_point, position
from xcrack.simplex import facet_nodes
from xcrack.space import Space

_TRACE = 1e-13  # enriched functions below this value on a facet do not act there (round-off)


@dataclass(frozen=True, eq=False)
class Known:
    """Unknowns that supports decide, and their values.

    Attributes
    ----------
    fixed : (n_dof,) array of bool
    value : (n_dof,) array, length
        Zero where nothing is imposed.
    """

    fixed: Bools
    value: Floats


def known_unknowns(space: Space, supports: tuple[Fix | Displacement, ...]) -> Known:
    """Unknowns decided by the supports.

    Raises
    ------
    ProblemError
        Unknown sets, wrong shapes or nan, or two supports that contradict each other at a point.
    """
    fixed = np.zeros((space.n_functions, space.dim), dtype=bool)
    value = np.zeros((space.n_functions, space.dim))
    for support in supports:
        if isinstance(support, Fix):
            functions = _functions_of(space, support.where, "fix")
            axes = range(space.dim) if support.axis is None else [support.axis]
            if support.axis is not None and support.axis >= space.dim:
                raise ProblemError(f"fix(axis={support.axis}): the body is plane, axis is 0 or 1.")
            for axis in axes:
                _impose(space, fixed, value, functions, axis, np.zeros(len(functions)), 0)
        else:
            for axis, functions, numbers, n_fitted in _imposed(space, support):
                _impose(space, fixed, value, functions, axis, numbers, n_fitted)
    return Known(fixed.ravel(), value.ravel())


def _impose(
    space: Space,
    fixed: Bools,
    value: Floats,
    functions: Ints,
    axis: int,
    numbers: Floats,
    n_fitted: int,
) -> None:
    """Write values; the last `n_fitted` come from a fit and may differ from a neighbour's."""
    again = fixed[functions, axis]
    scale = max(float(np.abs(numbers).max(initial=0)), float(np.abs(value).max(initial=0)))
    clash = again & (np.abs(value[functions, axis] - numbers) > 1e-6 * scale)
    clash &= np.arange(len(functions)) < len(functions) - n_fitted
    if clash.any():
        i = int(np.argmax(clash))
        x = space.node_points[functions[i]]
        raise ProblemError(
            f"two supports contradict each other at {np.round(x, 6).tolist()}, axis {axis}: "
            f"{value[functions[i], axis]:.6g} and {numbers[i]:.6g}; leave one direction free."
        )
    value[functions[~again], axis] = numbers[~again]
    fixed[functions, axis] = True


def _set_nodes(space: Space, where: object, what: str) -> Ints:
    if isinstance(where, str):
        facets = facet_set(space.mesh, where, what)
        return np.unique(facet_nodes(space.mesh, space.order, facets))
    return np.array([nearest_point(space.mesh, np.asarray(where), what)])


def _functions_of(space: Space, where: object, what: str) -> Ints:
    """Standard and enriched functions of all nodes of a set."""
    nodes = _set_nodes(space, where, what)
    parts = [nodes]
    for c, number in enumerate(space.heaviside):
        # Where the set ends on lip + its nodes there leave lip - free.
        both = nodes[~np.isin(nodes, _at_plus_lip(space, where, c, what))]
        parts.append(number[both][number[both] >= 0])
    vertices = nodes[nodes < space.mesh.n_points]
    for tip in space.tips:
        first = tip.point_to_function[vertices]
        first = first[first >= 0]
        parts.append((first[:, None] + np.arange(tip.functions)).ravel())
    return np.unique(np.concatenate(parts))


def _at_plus_lip(space: Space, where: object, c: int, what: str) -> Ints:
    """Points on crack c at which a set ends on lip +.

    Raises
    ------
    ProblemError
        The set ends on lip -: the functions of such a point are those of lip + and of the jump,
        and only their sum is known.
    """
    if not isinstance(where, str):
        return np.zeros(0, dtype=np.int64)
    phi = space.cuts[c].level_set.phi
    facets = facet_set(space.mesh, where, what)
    touches = np.zeros((2, space.mesh.n_points), dtype=bool)
    for corner in range(facets.shape[1]):
        others = np.delete(phi[facets], corner, axis=1)
        touches[0, facets[(others < 0).any(axis=1), corner]] = True
        touches[1, facets[(others > 0).any(axis=1), corner]] = True
    ends = (phi == 0) & (space.heaviside[c][: space.mesh.n_points] >= 0)
    bad = ends & touches[0] & ~touches[1]
    if bad.any():
        raise ProblemError(
            f"{what}({where!r}) ends at {np.round(space.mesh.points[np.argmax(bad)], 6).tolist()}, "
            f"where crack {c} meets the boundary, and holds its lip - only: give the points of the "
            "crack in the reverse order (the held lip is then lip +), or move its mouth by a "
            "thousandth of a cell."
        )
    return np.nonzero(ends & touches[1] & ~touches[0])[0]


def _imposed(space: Space, support: Displacement) -> list[tuple[int, Ints, Floats, int]]:
    """Axis, functions, values and number of fitted values of an imposed displacement."""
    nodes = _set_nodes(space, support.where, "displacement")
    what = f"displacement({support.where!r})"
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
    for c in range(len(space.cuts)):
        _at_plus_lip(space, support.where, c, "displacement")
    fitted, coefficients = _fit(space, support.where, value, what)
    plain = nodes[~np.isin(nodes, fitted[fitted < space.n_nodes])]
    u = evaluate(value, space.node_points[plain], what) if len(plain) else np.zeros((0, space.dim))
    functions = np.concatenate([plain, fitted])
    values = np.concatenate([u, coefficients])
    return [(axis, functions, values[:, axis], len(fitted)) for axis in axes]


def _fit(space: Space, where: str, value: object, what: str) -> tuple[Ints, Floats]:
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
    points, _ = facet_points(space, facets)
    columns: list[Ints] = []
    rows: list[Ints] = []
    values: list[Floats] = []
    for batch, _ in space.batches(np.unique(points.cell)):
        number, row, _ = points.of_cells(batch.cells)
        N, _ = space.tabulate(batch, row, points.bary[number], points.side[number])
        functions = batch.functions[row]
        acts = (functions >= 0) & (np.abs(N) > _TRACE)
        columns.append(functions[acts])
        rows.append(np.broadcast_to(number[:, None], functions.shape)[acts])
        values.append(N[acts])
    column, row, entry = np.concatenate(columns), np.concatenate(rows), np.concatenate(values)
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
    weight = np.sqrt(points.weight[row_ids])[:, None]
    solution = np.linalg.lstsq(weight * A, weight * target, rcond=1e-10)[0]
    return unknowns, np.asarray(solution, dtype=np.float64)
