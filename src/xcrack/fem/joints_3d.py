"""Cuts of cracks that end on the face of others in 3D.

The arm is cut as if it ran on, and what lies beyond the other crack is taken away again: its faces
are clipped by the level set of the other one, whose faces are split by that of the arm.
"""

from dataclasses import replace

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, at, lock
from xcrack.base.errors import CoarseMeshError, GeometryError
from xcrack.crack.junctions import Junction
from xcrack.fem.cut import Cut
from xcrack.fem.joints_2d import Joint
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import cut_simplices

_ROUND_OFF = 1e-13  # share of a cell below which a distance is zero
_SINE = np.sin(np.radians(2.0))  # of the smallest angle between two cracks that meet
_SHARP = np.sin(np.radians(10.0))  # below which one may be close to the other's front
_CLEAR = 0.7  # of a cell, between that front and the arm: at less K of it is foreign


def joined_cuts(
    mesh: Mesh, cuts: tuple[Cut, ...], junctions: tuple[Junction, ...]
) -> tuple[tuple[Cut, ...], tuple[Joint, ...]]:
    """Cuts without what lies beyond arms, and the junctions in the mesh.

    Raises
    ------
    GeometryError
        An arm that does not reach the other crack, or lies along it.
    CoarseMeshError
        An arm that meets the other crack where that has its front, or runs past it.
    """
    result, joints = list(cuts), []
    for junction in junctions:
        through_cut, ending = result[junction.on], result[junction.crack]
        is_gone = cuts[junction.on].side == -junction.side
        is_gone |= _all_beyond(mesh, through_cut, ending, junction.side)
        is_active = (ending.is_cut | ending.is_tip | _beside_faces(mesh, ending)) & ~is_gone
        is_in_both = is_active & through_cut.is_cut
        is_joined = is_in_both | (is_active & _beside_faces(mesh, through_cut))
        _check(mesh, through_cut, ending, junction, is_active, is_joined)
        result[junction.on] = _split_cut(mesh, through_cut, ending, is_joined)
        result[junction.crack] = _clipped_cut(
            mesh, through_cut, ending, junction.side, is_gone, is_in_both
        )
        all_cells = np.ones(len(mesh.cells), dtype=bool)
        joints.append(
            Joint(
                junction.crack, junction.on, junction.side, lock(np.array(junction.x)),
                lock(np.array(junction.x)), np.inf, lock(all_cells), lock(is_in_both),
            )
        )  # fmt: skip
    return tuple(result), tuple(joints)


def _check(
    mesh: Mesh,
    through_cut: Cut,
    ending: Cut,
    junction: Junction,
    is_active: Bools,
    is_joined: Bools,
) -> None:
    """Raise where two cracks do not meet on a line between the fronts of the other one."""
    c, on = junction.crack, junction.on
    if not is_joined.any():
        if (_on_faces(mesh, ending) & _on_faces(mesh, through_cut)).any():
            return  # both lie on facets of the mesh, and meet on edges of it
        raise GeometryError(
            f"crack {c} does not reach crack {on}, on which it is to end: draw it on to that "
            "crack or through it, or take the other side of it."
        )
    is_past = is_active & (through_cut.side == 0) & ~through_cut.is_cut
    if is_past.any():
        cell = int(np.nonzero(is_past)[0][0])
        raise CoarseMeshError(
            f"crack {c} ends on crack {on}, but runs past its front, or to within a cell of it, at "
            f"{at(mesh.points[mesh.cells[cell]].mean(axis=0))}: let crack {on} reach two cells or "
            f"more beyond crack {c}, refine the mesh there, or let crack {c} run through and crack "
            f"{on} end on it, an arm for each side on which it lies. Where each runs past the "
            "front of the other only the first helps, or to end one of them a few cells before."
        )
    cells = np.nonzero(is_joined)[0]
    through_slope, ending_slope = (_slopes(mesh, cut, cells) for cut in (through_cut, ending))
    sine = np.linalg.norm(np.cross(through_slope, ending_slope), axis=1)
    if sine.min() < _SINE:
        cell = int(cells[int(np.argmin(sine))])
        raise GeometryError(
            f"crack {c} meets crack {on} at {np.degrees(np.arcsin(sine.min())):.2g} degrees at "
            f"{at(mesh.points[mesh.cells[cell]].mean(axis=0))}, or lies along it: below 2 degrees "
            "they are not told apart. Leave out what lies along the other crack, or give both as "
            "one surface."
        )
    if sine.min() < _SHARP:
        _check_clearance(mesh, through_cut, ending, junction)


def _check_clearance(mesh: Mesh, through_cut: Cut, ending: Cut, junction: Junction) -> None:
    """Raise where an arm at a small angle passes the front of the other crack too closely."""
    cells = np.nonzero(through_cut.is_tip)[0]
    distance = np.abs(ending.level_set.phi[mesh.cells[cells]].mean(axis=1))
    level_inside = ending.level_set.psi_of_ends[mesh.cells[cells]].mean(axis=1)
    close = (distance < _CLEAR * mesh.cell_size[cells]) & (level_inside < 0)
    if close.any():
        k = int(np.nonzero(close)[0][np.argmin(distance[close])])
        middle = mesh.points[mesh.cells[cells[k]]].mean(axis=0)
        raise CoarseMeshError(
            f"crack {junction.crack} ends on crack {junction.on} at a small angle, and passes its "
            f"front at a distance of {distance[k]:.2g} at {at(middle)}, less than {_CLEAR:g} of a "
            f"cell ({mesh.cell_size[cells[k]]:.2g}): refine the mesh there, or "
            f"end crack {junction.on} before."
        )


def _beside_faces(mesh: Mesh, cut: Cut) -> Bools:
    """Cells beside facets of the mesh on which a crack lies `(m,)`."""
    is_beside = np.zeros(len(mesh.cells), dtype=bool)
    is_beside[cut.lip_cell[cut.lip_cell[:, 0] != cut.lip_cell[:, 1]]] = True
    return is_beside


def _on_faces(mesh: Mesh, cut: Cut) -> Bools:
    """Points of facets of the mesh on which a crack lies `(n,)`."""
    pairs = cut.lip_cell[cut.lip_cell[:, 0] != cut.lip_cell[:, 1]]
    corner, corner_beyond = mesh.cells[pairs].transpose(1, 0, 2)
    is_shared = (corner[:, :, None] == corner_beyond[:, None]).any(axis=2)
    on_faces = np.zeros(mesh.n_points, dtype=bool)
    on_faces[corner[is_shared]] = True
    return on_faces


def _slopes(mesh: Mesh, cut: Cut, cells: Ints) -> Floats:
    """Unit normals of a crack in cells `(k, 3)`."""
    slope = np.einsum("kb,kbd->kd", cut.level_set.phi[mesh.cells[cells]], mesh.gradient[cells])
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    return np.asarray(slope / np.maximum(length, 1e-300))


def _all_beyond(mesh: Mesh, through_cut: Cut, ending: Cut, side: int) -> Bools:
    """Cells of both cracks in which all faces of the arm lie beyond the other one `(m,)`."""
    cell = ending.lip_cell[:, 0]
    value = _at(mesh, through_cut.level_set.phi, cell, ending.lip_bary[:, 0]) * side
    has_faces = np.zeros(len(mesh.cells), dtype=bool)
    has_faces[cell[(value > 0).any(axis=1)]] = True
    return through_cut.is_cut & (ending.is_cut | ending.is_tip) & ~has_faces


def _at(mesh: Mesh, values: Floats, cell: Ints, bary: Floats) -> Floats:
    """A linear function at points of cells `(k, v)`, round-off as zero."""
    result = np.einsum("kvb,kb->kv", bary, values[mesh.cells[cell]])
    result[np.abs(result) < _ROUND_OFF * mesh.cell_size[cell, None]] = 0.0
    return np.asarray(result)


def _parts(value: Floats, bary: Floats, x: Floats) -> tuple[Floats, Ints, Ints]:
    """Triangles with values of both signs split: corners `(s, 2, 3, 4)`, sides and parents."""
    bary_in_triangle, _, side, parent = cut_simplices(value, x)
    return np.einsum("svw,stwb->stvb", bary_in_triangle, bary[parent]), side, parent


def _clipped_cut(
    mesh: Mesh, through_cut: Cut, ending: Cut, side: int, is_gone: Bools, is_in_both: Bools
) -> Cut:
    """The cut of the arm, without what lies beyond the other crack."""
    phi = through_cut.level_set.phi
    cell = ending.lip_cell[:, 0]
    value = _at(mesh, phi, cell, ending.lip_bary[:, 0]) * side
    value_min, value_max = value.min(axis=1), value.max(axis=1)
    clips = is_in_both[cell]
    keep = ~is_gone[cell] & (~clips | ((value_min >= 0) & (value_max > 0)))
    rows = np.nonzero(clips & (value_min < 0) & (value_max > 0))[0]
    x = ending.lip_points(mesh)[rows]
    bary, part_side, parent = _parts(value[rows], ending.lip_bary[rows], x)
    is_before = part_side > 0
    source = np.concatenate([np.nonzero(keep)[0], rows[parent[is_before]]])
    subs = ~(is_gone | is_in_both)[ending.sub_to_cell]
    begin, end = mesh.edges.T
    t = ending.cut_edge
    at_cut = ((1 - t) * phi[begin] + t * phi[end]) * side
    with np.errstate(invalid="ignore"):
        cut_edge = np.where(at_cut < 0, np.nan, t)
    return replace(
        ending,
        cells=lock(ending.cells[~is_gone[ending.cells]]),
        sub_to_cell=lock(ending.sub_to_cell[subs]),
        sub_bary=lock(ending.sub_bary[subs]),
        sub_fraction=lock(ending.sub_fraction[subs]),
        sub_side=lock(ending.sub_side[subs]),
        lip_cell=lock(ending.lip_cell[source]),
        lip_bary=lock(np.concatenate([ending.lip_bary[keep], bary[is_before]])),
        lip_normal=lock(ending.lip_normal[source]),
        cut_edge=lock(cut_edge),
        side=lock(np.where(through_cut.side == -side, 0, ending.side)),
    )


def _split_cut(mesh: Mesh, through_cut: Cut, ending: Cut, is_joined: Bools) -> Cut:
    """The cut of the crack that runs through, its faces split where the arm meets them."""
    cell = through_cut.lip_cell[:, 0]
    value = _at(mesh, ending.level_set.phi, cell, through_cut.lip_bary[:, 0])
    split = (
        is_joined[through_cut.lip_cell].any(axis=1)
        & (value.min(axis=1) < 0)
        & (value.max(axis=1) > 0)
    )
    rows = np.nonzero(split)[0]
    bary, _, parent = _parts(
        value[rows], through_cut.lip_bary[rows], through_cut.lip_points(mesh)[rows]
    )
    source = np.concatenate([np.nonzero(~split)[0], rows[parent]])
    return replace(
        through_cut,
        lip_cell=lock(through_cut.lip_cell[source]),
        lip_bary=lock(np.concatenate([through_cut.lip_bary[~split], bary])),
        lip_normal=lock(through_cut.lip_normal[source]),
    )


__all__ = ["joined_cuts"]
