"""Level sets stored at the nodes and changed by each advance: an alternative to the polyline.

Purely nodal codes have no polyline: an advance changes phi and psi where psi shows that a point
lies ahead of the tip, and freezes phi behind it (the geometric form of the update of Duflot,
2007). Only the signs of both show where the crack is. A crack that turns round loses its
beginning, which comes to lie ahead of the new frame; updates near the tip alone keep it, but where
they end phi jumps, and where psi is negative there the jump is taken for a crack. Such level sets
are had here by replaying a polyline, piece by piece, for comparison only.
"""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, lock
from xcrack.base.errors import ProblemError
from xcrack.crack.advance_2d import advance
from xcrack.crack.crack import Crack, tip_frames
from xcrack.fem.level_set import LevelSet, line_levels, tied_to_tips
from xcrack.mesh.mesh import Mesh
from xcrack.model.numerics import LevelSets


@dataclass(frozen=True)
class nodal_level_sets(LevelSets):  # noqa: N801 - it is used as a function
    """Level sets that nodal updates would have given a crack in 2D; see `nodal_level_set`."""

    def of(self, mesh: Mesh, crack: Crack) -> LevelSet:
        """Level sets of a placed crack."""
        if mesh.dim != 2:
            raise ProblemError(
                "nodal_level_sets are for 2D only: leave level_sets out for a crack in 3D."
            )
        return nodal_level_set(mesh, crack)


@dataclass(frozen=True, eq=False)
class Nodal:
    """Level sets as a purely nodal code carries them from step to step.

    Attributes
    ----------
    phi : (n,) array, length
    psi : (f, n) array, length
    """

    phi: Floats
    psi: Floats


def nodal_update(
    x: Floats,
    levels: Nodal,
    k: int,
    tip: Floats,
    frame: Floats,
    angle: float,
    da: float,
    reach: float = np.inf,
) -> Nodal:
    """Level sets after one advance of one tip.

    psi becomes the distance along the new frame; phi that across it, where psi was positive.

    Parameters
    ----------
    x : (n, 2) array, length
        Points of the mesh.
    levels : Nodal
    k : int
        Which tip.
    tip, frame : (2,) and (2, 2) arrays
        Its place and the rows (ahead, normal) of its frame before the advance.
    angle : float, rad
        Kink angle, positive towards the normal.
    da : float, length
    reach : float, length
        Points farther than that from the new tip keep their values.

    Returns
    -------
    Nodal
    """
    c, s = np.cos(angle), np.sin(angle)
    direction, normal = c * frame[0] + s * frame[1], c * frame[1] - s * frame[0]
    local = x - (tip + da * direction)
    is_within = np.einsum("nd,nd->n", local, local) <= reach**2
    psi = np.array(levels.psi)
    is_free = is_within & (psi[k] > 0)
    phi = np.where(is_free, local @ normal, levels.phi)
    psi[k] = np.where(is_within, local @ direction, psi[k])
    return Nodal(lock(phi), lock(psi))


def nodal_level_set(
    mesh: Mesh, crack: Crack, first: int | None = None, reach: float = np.inf
) -> LevelSet:
    """Level sets that nodal updates would have given a crack that has grown to this polyline.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
        Placed; 2D.
    first : int, optional
        Number of the face that was there at first. None: the one at the mouth, or of a crack
        with two tips the longest.
    reach : float, length
        Of each update.

    Returns
    -------
    LevelSet
    """
    tips, last = crack.tips or (), len(crack.points) - 1
    if not tips:
        return line_levels(mesh, crack)
    if first is None:
        length = np.linalg.norm(np.diff(crack.points, axis=0), axis=1)
        first = int(np.argmax(length)) if len(tips) == 2 else (last - 1 if tips[0] == 0 else 0)
    low, high = (first if 0 in tips else 0), (first + 1 if last in tips else last)
    ends = tuple(0 if tip == 0 else high - low for tip in tips)
    start = Crack(crack.points[low : high + 1], crack.faces[: high - low], ends)
    first_levels = line_levels(mesh, start)
    levels, grown_crack = Nodal(first_levels.phi, first_levels.psi), start
    for k, tip in enumerate(tips):
        pieces = crack.points[low::-1] if tip == 0 else crack.points[high:]
        for new_point in pieces[1:]:
            x, frame = tip_frames(grown_crack)
            along_tip, across_tip = frame[k] @ (new_point - x[k])
            angle, da = np.zeros(len(tips)), np.zeros(len(tips))
            angle[k], da[k] = np.arctan2(across_tip, along_tip), np.hypot(along_tip, across_tip)
            levels = nodal_update(mesh.points, levels, k, x[k], frame[k], angle[k], da[k], reach)
            grown_crack = advance(grown_crack, angle, da)
    phi, psi = np.array(levels.phi), np.array(levels.psi)
    # Away from the tip phi is no distance: its sign, and that of psi, are all there is.
    is_near = np.ones(len(mesh.edges), dtype=bool)
    return tied_to_tips(mesh, crack, phi, psi, np.array(first_levels.mouth), is_near)
