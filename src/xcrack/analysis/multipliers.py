"""Contact multipliers: the nodes of the cells along the crack faces, tied into stable groups.

Groups are the stars of a minimal cover of the cut edges ("vital edges", Béchet, Moës and
Wohlmuth, 2009); a node without a cut edge of its own joins the group with which its trace
overlaps most, so that no small group is left at a tip. A group's function is the sum of its
hats' traces: positive, and all of them sum to one. Order 2 in 2D uses hats along the crack
instead, with knots that follow the groups' centres: one order more in pressure. The cells'
quadratic functions carry more knots than there are groups.
"""

import heapq
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from xcrack.base.arrays import Bools, Floats, Ints, offsets, ranges
from xcrack.fem.facets import LipPoints, arc_position
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.joints_2d import Joint

# Share of the median below which a group cut off at a junction joins another, and of groups below
# which faces between kinks join others. Meshes of squares give halves: round-off must not decide.
_SMALL, _SHORT = 0.55, 0.45
_SAME = 1e-6  # relative difference of sizes that differ by round-off
# Knots of a part besides those by groups. The inf-sup constant of 120 drawn cracks of each kind is
# .33 or more at a junction, at a kink and with a short leg, .25 with two kinks.
_BESIDES = 1.5
_PASSES = 5  # in which knots are moved; each looks one knot to either side
# At order 2 in 2D: knots over groups, and share of the last piece in the last two. The inf-sup
# constant of 560 drawn cracks is .29 or more with 1.6; it is .23 at 1.75, .18 at 2, and tends to
# zero beyond.
_HATS = {"reduced": (1.6, 0.65), "sparse": (1.0, 0.6)}
# Where faces turn by more than this (rad) between the neighbours of a group, they are chords of a
# curve: their pressure errs by that angle, and denser knots follow the error. Of closed arcs of
# 24 and 48 cells a radius it is off by .061 and .032 (L2) with dense knots, by .007 and .003 with
# one a group; straight faces gain a third to a half by dense ones.
_CURVED = 2e-3


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multiplier space on the faces of one crack.

    Attributes
    ----------
    crack : int
    values : sparse matrix (q, g)
        Each function at the lip points.
    measure : (g,) array, length^(d - 1)
        Integral of each function.
    centre : (g, d) array, length
        Where each function sits; carries states from step to step.
    """

    crack: int
    values: sp.csr_matrix
    measure: Floats
    centre: Floats


def multipliers(
    space: FunctionSpace,
    c: int,
    lips: LipPoints,
    kind: str,
    is_fixed: Bools | None = None,
    has_friction: bool = False,
    material: Ints | None = None,
) -> Multipliers:
    """Multiplier space of crack c: "reduced", "sparse" or "naive".

    Where supports decide the jump, as at a mouth in a side whose displacement is imposed, a group
    of its own would be redundant: with `is_fixed` (n_dof,) it joins its neighbour. Where the faces
    rub the tangential jump counts as the normal one does. Where the crack crosses from one
    `material` (the number of that of each cell) into another, pressures jump.
    """
    nodes, traces = _traces(space, lips)
    hats = _HATS[kind] if kind != "naive" and space.order == 2 and space.dim == 2 else None
    parts = _parts(space, c, lips, material) if kind != "naive" else []
    values = traces
    if kind != "naive":
        is_supported = _supported_nodes(space, c, nodes, traces, lips, is_fixed, has_friction)
        group = _groups(space, c, nodes, traces, lips.weight, is_supported)
        shape = (len(lips), int(group.max(initial=-1)) + 1)
        column = group.astype(np.int32)[traces.indices]
        values = sp.csr_matrix((traces.data, column, traces.indptr), shape=shape)
    if space.dim == 3 and material is not None and kind != "naive":
        values = _split_groups(values, lips.weight, material[lips.cell])
    if space.dim == 3 and kind != "naive":
        for joint in space.joints:
            if joint.on == c:
                values = _split_groups(values, lips.weight, *_sides_of_arm(space, joint, lips))
    if space.dim == 3:
        values.sum_duplicates()
    elif len(parts) > 1:
        is_kinked, has_interface = len(space.cuts[c].kinks.points) > 0, material is not None
        values = _broken_functions(values, lips, parts, hats, is_kinked, has_interface)
    elif hats is not None and values.shape[1] > 1:
        mass = _sums(values, lips.weight)
        centre = _sums(values, lips.weight * lips.s) / np.maximum(mass, 1e-300)
        knots = np.unique(centre[mass > 1e-14 * mass.max()])
        is_curved = _curved_points(
            lips, np.arange(len(lips)), np.interp(lips.s, knots, np.arange(len(knots)))
        )
        values = _hats(_knots_by_groups(knots, lips.s, is_curved, hats), lips.s)
    elif kind != "naive":
        values.sum_duplicates()
    measure = _sums(values, lips.weight)
    keep = measure > 1e-14 * measure.max(initial=0.0)
    if not keep.all():
        values, measure = sp.csr_matrix(values[:, np.nonzero(keep)[0]]), measure[keep]
    centres = [_sums(values, lips.weight * x) / measure for x in lips.x.T]
    return Multipliers(c, values, measure, np.stack(centres, axis=1))


def _sums(values: sp.csr_matrix, x: Floats) -> Floats:
    """Sum of each function times what is given at the points `(q,)`."""
    at_entries = values.data * x.repeat(np.diff(values.indptr))
    return np.asarray(np.bincount(values.indices, at_entries, values.shape[1]), dtype=float)


def _parts(space: FunctionSpace, c: int, lips: LipPoints, material: Ints | None) -> list[Ints]:
    """Lip points in 2D between kinks of crack c, ends of other cracks on it, and interfaces."""
    if space.dim == 3:
        return []
    line = space.cracks[c].points
    kinks = space.cuts[c].kinks.points
    ends = np.array([*(joint.x for joint in space.joints if joint.on == c), *kinks])
    part = np.zeros(len(lips), dtype=np.int64)
    if len(ends):
        begin = arc_position(line, lips.x[:1])[0] - lips.s[0]
        part = np.searchsorted(np.sort(arc_position(line, ends)) - begin, lips.s)
    if material is not None and len(lips):
        order = np.argsort(lips.s, kind="stable")
        is_crossing = (np.diff(material[lips.cell[order]], axis=0) != 0).any(axis=1)
        is_crossing |= np.diff(part[order]) != 0
        part[order] = np.concatenate([[0], np.cumsum(is_crossing)])
    parts = [np.nonzero(part == k)[0] for k in np.unique(part)]
    return parts if len(parts) > 1 else []


def _broken_functions(
    values: sp.csr_matrix,
    lips: LipPoints,
    parts: list[Ints],
    hats: tuple[float, float] | None,
    is_kinked: bool,
    has_interface: bool,
) -> sp.csr_matrix:
    """Functions that end where pressures jump: junctions, kinks, interfaces.

    Short parts are joined to their neighbours, but for those between junctions alone.
    """
    mass = _sums(values, lips.weight)
    # Share of groups at each point: their sum over a part grows steadily with the part.
    groups = lips.weight * (values @ (1 / np.maximum(mass, 1e-14 * mass.max())))
    columns = []
    for rows in _long_enough(parts, groups) if is_kinked or has_interface else parts:
        if hats is None:
            is_lesser = np.zeros(len(mass), dtype=bool)
            if (
                has_interface
            ):  # of a group that an interface cuts one piece stands: both share its nodes
                is_lesser = _sums(values[rows], lips.weight[rows]) <= (0.5 + _SAME) * mass
            part = _without_small(
                values[rows], lips.weight[rows], lips.s[rows], np.median(mass), is_lesser
            )
        else:
            # Faces between kinks and junctions are whole cracks to pressures.
            part = _hats(_even_knots(lips, rows, groups[rows], hats), lips.s[rows])
        place = (np.ones(len(rows)), (rows, np.arange(len(rows))))
        columns.append(sp.csr_matrix(place, shape=(len(lips), len(rows))) @ part)
    return sp.csr_matrix(sp.hstack(columns))


def _sides_of_arm(space: FunctionSpace, joint: Joint, lips: LipPoints) -> tuple[Ints, Bools]:
    """Side of a crack that ends there on which lip points lie `(q, 1)`, and those beside it."""
    k = (1 + joint.side) // 2
    cell, bary = lips.cell[:, k], lips.bary[:, k]
    corner = space.mesh.cells[cell]
    level = np.einsum("qb,qb->q", bary, space.cuts[joint.crack].level_set.phi[corner])
    return np.where(level >= 0, 1, -1)[:, None], joint.is_in_both[cell]


def _split_groups(
    values: sp.csr_matrix, weight: Floats, material: Ints, is_beside: Bools | None = None
) -> sp.csr_matrix:
    """Groups on a surface that end at interfaces or junctions, where pressures jump.

    Of a group that an interface cuts the largest piece stands, since all of them share its nodes;
    each other piece joins the group on its side of which the function overlaps most. Where there is
    none, a side of the size of a group gets one of its own, and less than that is not cut off.

    Parameters
    ----------
    values : sparse matrix (q, g)
    weight : (q,) array
    material : (q, k) array of int
        Of the cells on both sides of each point, or the side of a crack that ends there.
    is_beside : (q,) array of bool, optional
        Points in cells with an interface: only groups that reach these end there.
    """
    pairs, part = np.unique(material, axis=0, return_inverse=True)
    if len(pairs) == 1:
        return values
    part = part.ravel()
    columns: list[sp.csr_matrix] = []
    total = _sums(values, weight)
    typical_total = float(np.median(total))
    group_of = np.full((len(pairs), len(total)), -1)  # of pieces that stand
    pieces = [
        sp.csr_matrix(sp.diags((part == p).astype(float)) @ values) for p in range(len(pairs))
    ]
    mass = np.stack([_sums(piece, weight) for piece in pieces])
    if is_beside is not None:  # the others stay whole, with the part in which they have most
        whole_groups = np.nonzero(_sums(values, weight * is_beside) <= 1e-14 * typical_total)[0]
        largest_part = mass.argmax(axis=0)
        is_retained = np.zeros(len(total), dtype=bool)
        is_retained[whole_groups] = True
        pieces = [
            sp.csr_matrix(
                piece @ sp.diags((~is_retained).astype(float))
                + values @ sp.diags((is_retained & (largest_part == p)).astype(float))
            )
            for p, piece in enumerate(pieces)
        ]
        mass = np.stack([_sums(piece, weight) for piece in pieces])
    is_standing = mass > (0.5 + _SAME) * total
    count = 0
    for p, piece in enumerate(pieces):
        is_present = mass[p] > 1e-14 * typical_total
        if (
            is_present.any()
            and not is_standing[p].any()
            and mass[p].sum() >= _SHORT * typical_total
        ):
            is_standing[p, int(np.argmax(mass[p]))] = True
        group_of[p, is_standing[p]] = count + np.arange(int(is_standing[p].sum()))
        count += int(is_standing[p].sum())
        overlap = np.abs(piece.T @ sp.diags(weight) @ piece).toarray()
        waiting_functions = np.nonzero(is_present & ~is_standing[p])[0]
        while len(waiting_functions):
            has_group = group_of[p] >= 0
            shared_overlap = overlap[waiting_functions] * has_group
            host = (
                shared_overlap.argmax(axis=1)
                if has_group.any()
                else np.zeros(len(waiting_functions), dtype=np.int64)
            )
            is_joining = shared_overlap[np.arange(len(waiting_functions)), host] > 0
            if not is_joining.any():
                break
            group_of[p, waiting_functions[is_joining]] = group_of[p, host[is_joining]]
            waiting_functions = waiting_functions[~is_joining]
    # What found none stays with the piece of its group that stands elsewhere, or with the first.
    for p, g in zip(*np.nonzero((group_of < 0) & (mass > 1e-14 * typical_total))):
        other_groups = group_of[:, g][group_of[:, g] >= 0]
        if len(other_groups):
            group_of[p, g] = other_groups[0]
        else:
            group_of[p, g], count = count, count + 1
    for p, piece in enumerate(pieces):
        rows = np.nonzero(group_of[p] >= 0)[0]
        place = (np.ones(len(rows)), (rows, group_of[p, rows]))
        columns.append(piece @ sp.csr_matrix(place, shape=(len(total), count)))
    return sp.csr_matrix(sum(columns[1:], columns[0]))


def _without_small(
    values: sp.csr_matrix, weight: Floats, s: Floats, typical_total: float, is_lesser: Bools
) -> sp.csr_matrix:
    """Functions on a part of the crack faces; what is small, or lesser, joins a neighbour."""
    mass = _sums(values, weight)
    present_columns = np.nonzero(mass > 1e-14 * typical_total)[0]
    large_values, is_lesser = values[:, present_columns].toarray(), is_lesser[present_columns]
    while True:
        mass = large_values.T @ weight
        order = np.argsort((large_values.T @ (weight * s)) / mass)
        large_values, mass, is_lesser = large_values[:, order], mass[order], is_lesser[order]
        k = int(np.argmax(is_lesser)) if is_lesser.any() else _smallest_number(mass)
        if len(mass) == 1 or (mass[k] >= _SMALL * typical_total and not is_lesser[k]):
            return sp.csr_matrix(large_values)
        neighbours = [j for j in (k - 1, k + 1) if 0 <= j < len(mass)]
        large_values[:, neighbours[_smallest_number(mass[neighbours])]] += large_values[:, k]
        large_values, is_lesser = np.delete(large_values, k, axis=1), np.delete(is_lesser, k)


def _smallest_number(sizes: Floats) -> int:
    """Number of the smallest one, of those equal but for round-off the first."""
    return int(np.argmax(sizes <= (1 + _SAME) * sizes.min()))


def _long_enough(parts: list[Ints], groups: Floats) -> list[Ints]:
    """Parts of the crack faces, joined to the shorter neighbour if they hold no group."""
    parts = list(parts)
    while len(parts) > 1:
        length = np.array([groups[rows].sum() for rows in parts])
        k = _smallest_number(length)
        if length[k] >= _SHORT:
            break
        neighbours = [j for j in (k - 1, k + 1) if 0 <= j < len(parts)]
        first = min(k, neighbours[_smallest_number(length[neighbours])])
        parts[first : first + 2] = [np.concatenate(parts[first : first + 2])]
    return parts


def _traces(space: FunctionSpace, lips: LipPoints) -> tuple[Ints, sp.csr_matrix]:
    """Mesh points whose hats reach the crack faces, and the hats at the lip points `(q, k)`."""
    cell = lips.cell[:, 1]
    corners = space.mesh.cells[cell]
    nodes, place = np.unique(corners.ravel(), return_inverse=True)
    place = place.reshape(corners.shape)
    order = place.argsort(axis=1)
    place = np.take_along_axis(place, order, axis=1)
    entry = np.take_along_axis(lips.bary[:, 1], order, axis=1)
    is_active = np.abs(entry) > 1e-13
    is_reached = np.bincount(place[is_active], minlength=len(nodes)) > 0
    column = (is_reached.cumsum() - 1).astype(np.int32)[place[is_active]]
    start = offsets(is_active.sum(axis=1)).astype(np.int32)
    shape = (len(cell), int(is_reached.sum()))
    return nodes[is_reached], sp.csr_matrix((entry[is_active], column, start), shape=shape)


def _supported_nodes(
    space: FunctionSpace,
    c: int,
    nodes: Ints,
    traces: sp.csr_matrix,
    lips: LipPoints,
    is_fixed: Bools | None,
    has_friction: bool,
) -> Bools:
    """Which of the nodes have a jump, of those that count, that supports decide."""
    number = space.heaviside[c][nodes]
    if is_fixed is None:
        return np.zeros(len(nodes), dtype=bool)
    normal = np.stack([_sums(traces, lips.weight * n) for n in lips.normal.T], axis=1)
    is_imposed = is_fixed.reshape(-1, space.dim)[number]
    squares = (normal**2).sum(axis=1)
    is_decided = (normal**2 * is_imposed).sum(axis=1) > 0.5 * squares
    if has_friction:
        is_decided |= ((squares[:, None] - normal**2) * is_imposed).sum(axis=1) > 0.5 * squares
    return np.asarray((number >= 0) & is_decided)


def _groups(
    space: FunctionSpace,
    c: int,
    nodes: Ints,
    traces: sp.csr_matrix,
    weight: Floats,
    is_supported: Bools,
) -> Ints:
    """Group number of each node."""
    mesh, cut = space.mesh, space.cuts[c]
    edges = np.nonzero(~np.isnan(cut.cut_edge))[0]
    pairs = mesh.edges[edges]
    is_vital = vital_edges(
        pairs,
        np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1),
        _places_along(space, c, edges),
    )
    place = {int(n): i for i, n in enumerate(nodes)}
    parent = np.arange(len(nodes))
    is_covered = np.zeros(len(nodes), dtype=bool)

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = int(parent[i])
        return i

    for a, b in pairs[is_vital]:
        # An end of a cut edge at a sliver may have no trace that is seen; its star keeps the rest.
        i, j = place.get(int(a)), place.get(int(b))
        for end in (i, j):
            if end is not None:
                is_covered[end] = True
        if i is not None and j is not None:
            parent[root(i)] = root(j)
    on_crack = cut.level_set.phi[nodes] == 0
    is_inside = cut.level_set.psi_of_ends[nodes] < 0
    # Nodes on the crack carry a group of their own, unless the tip lies on them, or they lie
    # beyond a junction.
    is_free_node = on_crack & is_inside & ~is_covered & (space.node_side[c][nodes] != 0)
    is_covered |= is_free_node
    if is_supported.any():
        roots = np.array([root(i) for i in range(len(nodes))])
        mass = _sums(traces, weight)
        total = np.bincount(roots, mass, len(nodes))
        is_covered &= (
            np.bincount(roots, mass * is_supported, len(nodes))[roots] < 0.5 * total[roots]
        )
        parent[~is_covered] = np.nonzero(~is_covered)[0]
    if is_covered.any() and not is_covered.all():
        for k, to in _nearest_nodes(traces, weight, is_covered):
            parent[k] = root(to)
    roots = np.array([root(i) for i in range(len(nodes))])
    return np.unique(roots, return_inverse=True)[1]


def _nearest_nodes(
    traces: sp.csr_matrix, weight: Floats, is_covered: Bools
) -> list[tuple[int, int]]:
    """Nodes that are not covered, each with the covered node of which the trace overlaps most.

    The first of equal ones counts; a node that overlaps none is left out.
    """
    counts = np.diff(traces.indptr)
    point = np.arange(len(counts)).repeat(counts)
    uncovered_entries = np.nonzero(~is_covered[traces.indices])[0]
    row, place = ranges(counts[point[uncovered_entries]])
    uncovered_entries, partner = (
        uncovered_entries[row],
        traces.indptr[point[uncovered_entries]][row] + place,
    )
    is_shared = is_covered[traces.indices[partner]]
    uncovered_entries, partner = uncovered_entries[is_shared], partner[is_shared]
    pair, number = np.unique(
        traces.indices[uncovered_entries] * np.int64(len(is_covered)) + traces.indices[partner],
        return_inverse=True,
    )
    products = (
        traces.data[uncovered_entries] * weight[point[uncovered_entries]] * traces.data[partner]
    )
    overlap = np.bincount(number, products, len(pair))
    node, to = np.divmod(pair, len(is_covered))
    # Of overlaps that are equal but for round-off the first node counts.
    most_overlap = np.zeros(len(is_covered))
    np.maximum.at(most_overlap, node, overlap)
    share = np.rint(overlap / (_SAME * np.where(most_overlap > 0, most_overlap, 1.0))[node])
    order = np.lexsort((to, -share, node))
    first = np.unique(node[order], return_index=True)[1]
    return list(zip(node[order][first].tolist(), to[order][first].tolist()))


def _places_along(space: FunctionSpace, c: int, edges: Ints) -> Floats:
    """Where crack c cuts some edges, along it `(e,)`; zero in 3D, where there is no such order."""
    mesh, t = space.mesh, space.cuts[c].cut_edge[edges, None]
    if space.dim == 3 or not len(edges):
        return np.zeros(len(edges))
    begin, end = mesh.points[mesh.edges[edges]].transpose(1, 0, 2)
    return arc_position(space.cracks[c].points, (1 - t) * begin + t * end)


def vital_edges(pairs: Ints, length: Floats, place: Floats) -> Ints:
    """Minimal cover of the ends of edges by edges: what remains are stars.

    Edges are removed as long as both their ends keep another one, those with the best-connected
    weaker end first, longer ones first among equals, and of these the first along the crack: not
    round-off and not the numbers of nodes decide, so that the cover turns with the body.

    Parameters
    ----------
    pairs : (e, 2) array of int
    length : (e,) array
    place : (e,) array
        Along the crack, where there is such an order.

    Returns
    -------
    (k,) array of int
        Rows of `pairs` that are kept.
    """
    degree: dict[int, int] = {}
    ends = pairs.tolist()
    lengths, places = _in_steps(length), _in_steps(place)
    for a, b in ends:
        degree[a] = degree.get(a, 0) + 1
        degree[b] = degree.get(b, 0) + 1

    def entry(e: int) -> tuple[int, int, int, int, int, int]:
        a, b = ends[e]
        lower_degree = min(degree[a], degree[b])
        return (-lower_degree, -lengths[e], places[e], min(a, b), max(a, b), e)

    heap = [entry(e) for e in range(len(pairs))]
    heapq.heapify(heap)
    is_vital = np.ones(len(pairs), dtype=bool)
    while heap:
        top = heapq.heappop(heap)
        e = top[-1]
        current_entry = entry(e)
        if current_entry[0] != top[0]:
            heapq.heappush(heap, current_entry)
            continue
        if current_entry[0] >= -1:
            break
        is_vital[e] = False
        for end in ends[e]:
            degree[end] -= 1
    return np.nonzero(is_vital)[0]


def _in_steps(sizes: Floats) -> list[int]:
    """Sizes as whole numbers of steps of 1e-6 of the largest: equal ones but for round-off tie."""
    scale = float(np.abs(sizes).max(initial=0.0))
    return np.rint(sizes / ((_SAME * scale) or 1.0)).astype(np.int64).tolist()


def _knots(centre: Floats, ends: tuple[float, float], share: float) -> Floats:
    """Knots of hats, the first and the last one at the ends of the crack.

    A group's size is an accident of the mesh. What counts is the piece between the last two knots
    at a tip: a short one leaves the pressure there to chance, a long one cannot follow it. It is
    given a fixed share of the last two, and the others are evened out among near neighbours.
    """
    knots = np.array(centre)
    knots[0], knots[-1] = ends
    if len(knots) == 3:
        knots[1] = (knots[0] + knots[2]) / 2
    if len(knots) <= 3:
        return knots
    for _ in range(_PASSES):
        old_knots = knots.copy()
        knots[2:-2] = (old_knots[1:-3] + 2 * old_knots[2:-2] + old_knots[3:-1]) / 4
        # Half of the way only: with four knots both ends would pass each other.
        knots[1] = (old_knots[1] + old_knots[0] + share * (old_knots[2] - old_knots[0])) / 2
        knots[-2] = (old_knots[-2] + old_knots[-1] - share * (old_knots[-1] - old_knots[-3])) / 2
    return knots


def _curved_points(lips: LipPoints, rows: Ints, place: Floats) -> Bools:
    """Which of some lip points lie where the faces turn, by their places in numbers of groups."""
    nx, ny = lips.normal[rows].T
    turn = np.unwrap(np.arctan2(ny, nx))
    if not len(turn) or np.ptp(turn) <= _CURVED:  # straight faces need no look at each point
        return np.zeros(len(turn), dtype=bool)
    start, stop = np.searchsorted(place, place - 1), np.searchsorted(place, place + 1, "right")
    return np.array([np.ptp(turn[a:b]) > _CURVED for a, b in zip(start, stop)], dtype=bool)


def _knots_by_groups(
    knots: Floats, s: Floats, is_curved: Bools, hats: tuple[float, float]
) -> Floats:
    """Knots spread like the groups' centres, that reach the ends of the crack."""
    density_ratio, end_share = hats
    ends = float(s.min()), float(s.max())
    if density_ratio == 1 or len(knots) < 2:
        return _knots(knots, ends, end_share)
    # Knots between two centres, by the share of the faces between them that is straight.
    piece = np.clip(np.searchsorted(knots, s) - 1, 0, len(knots) - 2)
    total = np.bincount(piece, minlength=len(knots) - 1)
    share = np.bincount(piece, is_curved, len(knots) - 1) / np.maximum(total, 1)
    rise = np.append(0.0, np.cumsum(density_ratio - (density_ratio - 1) * share))
    place = np.linspace(0, rise[-1], max(int(rise[-1] + 1e-9), 1) + 1)
    return _knots(np.interp(place, rise, knots), ends, end_share)


def _even_knots(lips: LipPoints, rows: Ints, groups: Floats, hats: tuple[float, float]) -> Floats:
    """Knots on a part of a crack, in proportion to the groups between each two.

    They are spread between the centres of the first and the last group, as those of a whole crack:
    the first piece at a kink, where pressures are singular, is as long as a tip's.
    """
    density_ratio, end_share = hats
    s, places = lips.s[rows], np.cumsum(groups) - groups / 2
    density = np.where(_curved_points(lips, rows, places), 1.0, density_ratio)
    mean = float(groups @ density / groups.sum())
    count = max(int(mean * (groups.sum() - 1) + _BESIDES + 1e-9), 2)
    weight = groups * density
    centres = np.linspace(mean / 2, weight.sum() - mean / 2, count)
    knots = np.interp(centres, np.cumsum(weight) - weight / 2, s)
    return _knots(knots, (float(s.min()), float(s.max())), end_share)


def _hats(knots: Floats, s: Floats) -> sp.csr_matrix:
    """Piecewise linear hats along the crack: linear pressures are exact."""
    place = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    t = (s - knots[place]) / (knots[place + 1] - knots[place])
    hat_values = np.stack([1 - t, t], axis=1).ravel()
    columns = np.stack([place, place + 1], axis=1).ravel().astype(np.int32)
    start = np.arange(0, 2 * len(s) + 1, 2, dtype=np.int32)
    return sp.csr_matrix((hat_values, columns, start), shape=(len(s), len(knots)))


def gap_rows(space_of: Multipliers, lips: LipPoints, jump: sp.csr_matrix) -> sp.csr_matrix:
    """Rows N of the weak gaps `(g, n_dof)`: N u is the integral of mu n . [[u]].

    Parameters
    ----------
    space_of : Multipliers
    lips : LipPoints
    jump : sparse matrix (q, n_dof)
        Normal jump at the lip points, from `jump_matrix`.
    """
    values = space_of.values
    counts = np.diff(values.indptr)
    order = np.argsort(values.indices, kind="stable")
    point = np.arange(len(counts), dtype=np.int32).repeat(counts)
    start = offsets(np.bincount(values.indices, minlength=values.shape[1])).astype(np.int32)
    entries = (values.data * lips.weight[point])[order]
    transpose = sp.csr_matrix((entries, point[order], start), shape=values.shape[::-1])
    rows = transpose @ jump
    rows.sort_indices()
    return rows
