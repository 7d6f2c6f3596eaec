"""Cuts of cracks that end on others in 2D.

The crack that ends is cut a little beyond the other one, as if it ran on, and that part is taken
away again: then both end on the same linear level set, and nothing depends on where in a cell
they meet. Beyond the other crack its side is 0: the junction function of Daux et al. (2000).
"""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.crack.junctions import REACH, Junction
from xcrack.fem.cut import Cut
from xcrack.mesh.locate import cells_around
from xcrack.mesh.mesh import Mesh

_ROOM, _LEAST = 0.7, 0.1  # cells by which nodes of both cracks are within the reach, or must be
_HALVES = 50  # of a segment, until the place where it is crossed is exact
_FROM_TIP = 0.5  # cells between the reach and the next tip


@dataclass(frozen=True, eq=False)
class Joint:
    """Where one crack of a mesh ends on another one.

    Attributes
    ----------
    crack, on : int
        The crack that ends, and the one that it ends on.
    side : int
        Side of the latter, +1 or -1, from which the former comes.
    x : (2,) array, length
        Where their cuts meet.
    centre : (2,) array, length
        Where the cracks meet.
    reach : float, length
        Around the centre; infinite in 3D.
    is_near : (m,) array of bool
        Cells in which sides are those of the junction.
    is_in_both : (m,) array of bool
        Cells cut by both cracks.
    """

    crack: int
    on: int
    side: int
    x: Floats
    centre: Floats
    reach: float
    is_near: Bools
    is_in_both: Bools


def joined_cuts(
    mesh: Mesh, cuts: tuple[Cut, ...], junctions: tuple[Junction, ...]
) -> tuple[tuple[Cut, ...], tuple[Joint, ...]]:
    """Cuts without what lies beyond junctions, and the junctions in the mesh."""
    result, joints = list(cuts), []
    for junction in junctions:
        through_cut, ending, joint = _joined_pair(
            mesh, result[junction.on], result[junction.crack], junction
        )
        result[junction.on], result[junction.crack] = through_cut, ending
        joints.append(joint)
    return tuple(result), tuple(joints)


def _joined_pair(
    mesh: Mesh, through_cut: Cut, ending: Cut, junction: Junction
) -> tuple[Cut, Cut, Joint]:
    """Cuts of the crack that runs through and of the one that ends on it."""
    centre = mesh.cell_middles
    junction = replace(junction, reach=_joint_radius(mesh, through_cut, ending, junction))
    is_near = np.linalg.norm(centre - junction.x, axis=1) < junction.reach
    split = _split_cut(mesh, through_cut, ending, junction, is_near)
    lips = split.lip_points(mesh)
    values = np.abs(_at(mesh, ending.level_set.phi, split.lip_cell[:, 1], split.lip_bary[:, 1]))
    distance = np.linalg.norm(lips - junction.x, axis=2) + values
    x = lips.reshape(-1, 2)[int(np.argmin(distance))]
    clipped_cut, is_in_both = _clipped_cut(mesh, through_cut, ending, junction, is_near)
    joint = Joint(
        junction.crack,
        junction.on,
        junction.side,
        lock(x),
        junction.x,
        junction.reach,
        lock(is_near),
        lock(is_in_both),
    )
    return split, clipped_cut, joint


def _joint_radius(mesh: Mesh, through_cut: Cut, ending: Cut, junction: Junction) -> float:
    """Radius that holds all points whose cells both cracks cut, and no tip.

    Cells that both cracks cut lie farther from a shallow junction than their mean size tells.
    """
    h = float(mesh.cell_size[cells_around(mesh, junction.x, 1e-9)].mean())
    flags = np.zeros((2, mesh.n_points), dtype=bool)
    for flag, cut in zip(flags, (through_cut, ending), strict=True):
        flag[mesh.cells[cut.cells]] = True
    distance = np.linalg.norm(mesh.points[flags.all(axis=0)] - junction.x, axis=1)
    overlap = float(distance[distance < 2 * junction.reach].max(initial=0.0))
    tips = [*through_cut.level_set.tip, *ending.level_set.tip]
    tip = min((float(np.linalg.norm(x - junction.x)) for x in tips), default=np.inf)
    radius = min(max(junction.reach, overlap + _ROOM * h), tip - _FROM_TIP * h)
    return max(radius, min(max(overlap + _LEAST * h, REACH * h), junction.reach))


def _at(mesh: Mesh, values: Floats, cell: Ints, bary: Floats) -> Floats:
    """A linear function at points of cells `(k, v)`."""
    return np.asarray(np.einsum("kvb,kb->kv", bary, values[mesh.cells[cell]]))


def _level(mesh: Mesh, cut: Cut, cell: Ints, bary: Floats) -> Floats:
    """A function that is zero where a crack is cut, along its kinks too, at points `(k, v)`."""
    v = bary.shape[1]
    return cut.level(mesh, cell.repeat(v), bary.reshape(-1, bary.shape[2])).reshape(-1, v)


def _crossing_shares(
    mesh: Mesh, cut: Cut, cell: Ints, bary: Floats, share: Floats, begin: Floats
) -> Floats:
    """Shares of segments `(k, 2, 3)` at which a cut crosses them: halved where it has a kink.

    `share` is right elsewhere; of `begin`, the level set at the first ends, the sign counts.
    """
    at_kinks = np.nonzero(np.isin(cell, cut.kinks.cells))[0]
    result = np.array(share)
    t0, t1 = np.zeros(len(at_kinks)), np.ones(len(at_kinks))
    for _ in range(_HALVES if len(at_kinks) else 0):
        middle = (t0 + t1) / 2
        at = _points_between(bary[at_kinks][:, None], middle)
        is_before = begin[at_kinks] * _level(mesh, cut, cell[at_kinks], at)[:, 0] > 0
        t0, t1 = np.where(is_before, middle, t0), np.where(is_before, t1, middle)
    result[at_kinks] = (t0 + t1) / 2
    return result


def _points_between(bary: Floats, share: Floats) -> Floats:
    """Points on segments `(k, 2, 2, 3)` at a share of their way `(k, 2, 3)`."""
    t = share[:, None, None]
    return np.asarray((1 - t) * bary[:, :, 0] + t * bary[:, :, 1])


def _clipped_cut(
    mesh: Mesh, through_cut: Cut, ending: Cut, junction: Junction, is_near: Bools
) -> tuple[Cut, Bools]:
    """The cut of the crack that ends, without what lies beyond the other, and the cells of both."""
    phi, side = through_cut.level_set.phi, junction.side
    cell = ending.lip_cell[:, 0]
    value = _level(mesh, through_cut, cell, ending.lip_bary[:, 0]) * side
    value[np.abs(value) < 1e-13 * mesh.cell_size[cell, None]] = 0.0
    keep = ~is_near[cell] | (value > 0).any(axis=1)
    shorten = is_near[cell] & keep & (value < 0).any(axis=1)
    bary = np.array(ending.lip_bary)
    rows = np.nonzero(shorten)[0]
    a, b = value[rows].T
    share = _crossing_shares(mesh, through_cut, cell[rows], bary[rows, 0], a / (a - b), a * side)
    bary[rows, :, (b < 0).astype(np.int64)] = _points_between(bary[rows], share)
    is_discarded = np.zeros(len(mesh.cells), dtype=bool)
    is_discarded[cell[~keep & (cell == ending.lip_cell[:, 1])]] = True
    cells = ending.cells[~is_discarded[ending.cells]]
    is_in_both = np.zeros(len(mesh.cells), dtype=bool)
    is_in_both[cells] = through_cut.is_cut[cells] & is_near[cells]
    subs = ~(is_discarded | is_in_both)[ending.sub_to_cell]
    begin, end = mesh.edges.T
    t = ending.cut_edge
    # At a kink the other crack cuts an edge elsewhere than where phi is zero.
    through_edge = through_cut.cut_edge
    with np.errstate(invalid="ignore"):
        at_cut = np.where(t < through_edge, phi[begin], phi[end])
    at_cut = np.where(np.isnan(through_edge), (1 - t) * phi[begin] + t * phi[end], at_cut) * side
    is_close = (
        np.linalg.norm(mesh.points[mesh.edges].mean(axis=1) - junction.x, axis=1) < junction.reach
    )
    with np.errstate(invalid="ignore"):
        cut_edge = np.where(is_close & (at_cut < 0), np.nan, t)
    sides = np.where(is_near & (through_cut.side == -side), 0, ending.side)
    return replace(
        ending,
        cells=lock(cells),
        sub_to_cell=lock(ending.sub_to_cell[subs]),
        sub_bary=lock(ending.sub_bary[subs]),
        sub_fraction=lock(ending.sub_fraction[subs]),
        sub_side=lock(ending.sub_side[subs]),
        lip_cell=lock(ending.lip_cell[keep]),
        lip_bary=lock(bary[keep]),
        lip_normal=lock(ending.lip_normal[keep]),
        cut_edge=lock(cut_edge),
        side=lock(sides),
    ), is_in_both


def _split_cut(
    mesh: Mesh, through_cut: Cut, ending: Cut, junction: Junction, is_near: Bools
) -> Cut:
    """The cut of the crack that runs through, its faces split where the other one meets them."""
    cell = through_cut.lip_cell[:, (junction.side + 1) // 2]
    bary = through_cut.lip_bary[np.arange(len(cell)), (junction.side + 1) // 2]
    value = _at(mesh, ending.level_set.phi, cell, bary)
    value[np.abs(value) < 1e-13 * mesh.cell_size[cell, None]] = 0.0
    rows = np.nonzero(
        is_near[cell] & ending.is_cut[cell] & (value.min(axis=1) < 0) & (value.max(axis=1) > 0)
    )[0]
    a, b = value[rows].T
    middle = _points_between(through_cut.lip_bary[rows], a / (a - b))
    lip_bary, split_bary = np.array(through_cut.lip_bary), np.array(through_cut.lip_bary[rows])
    lip_bary[rows, :, 1] = middle
    split_bary[:, :, 0] = middle
    return replace(
        through_cut,
        lip_cell=lock(np.concatenate([through_cut.lip_cell, through_cut.lip_cell[rows]])),
        lip_bary=lock(np.concatenate([lip_bary, split_bary])),
        lip_normal=lock(np.concatenate([through_cut.lip_normal, through_cut.lip_normal[rows]])),
    )
