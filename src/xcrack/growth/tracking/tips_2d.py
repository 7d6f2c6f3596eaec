"""Tips of all 2D cracks as rows of one array, and cracks that end at given places."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Bools, Floats
from xcrack.crack.advance_2d import with_tips
from xcrack.crack.crack import Crack
from xcrack.crack.tips_2d import tip_frames
from xcrack.growth.steps.advance import LEAST, PerCrack

_WHOLE = 0.5  # cells: a shorter face is not left behind, its end moves on with the tip


@dataclass(frozen=True, eq=False)
class Faces:
    """Last faces of cracks, a row for each tip.

    Attributes
    ----------
    tip, anchor : (n, 2) arrays, length
        Where they end and begin.
    length : (n,) array, length
    direction : (n,) array, rad
        From the x-axis.
    side : (n,) array
        1, or -1 where the tip's frame is left-handed.
    """

    tip: Floats
    anchor: Floats
    length: Floats
    direction: Floats
    side: Floats


def faces_of(cracks: Sequence[Crack]) -> Faces:
    """The last faces of all tips of placed cracks."""
    tip, anchor, side = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0)]
    for crack in cracks:
        x, frame = tip_frames(crack)
        before = [crack.points[1 if tip == 0 else tip - 1] for tip in crack.tips or ()]
        tip.append(x)
        anchor.append(np.array(before).reshape(-1, 2))
        side.append(np.sign(np.linalg.det(frame)) if len(x) else np.zeros(0))
    ends, begins = np.concatenate(tip), np.concatenate(anchor)
    along = ends - begins
    return Faces(
        ends,
        begins,
        np.linalg.norm(along, axis=1),
        np.arctan2(along[:, 1], along[:, 0]),
        np.concatenate(side),
    )


def moved_on(faces: Faces, grown: Bools, size: Floats) -> Bools:
    """Whether the last point of each tip moves on with it: its face was added, and is short."""
    return np.asarray(grown & (faces.length < _WHOLE * size))


def ending_at(
    cracks: Sequence[Crack], place: Floats, grown: Bools, size: Floats
) -> tuple[list[Crack], Bools]:
    """Cracks that go on to given places.

    Parameters
    ----------
    cracks : sequence of Crack
        Placed.
    place : (n, 2) array, length
        Where the tips of all of them are to be.
    grown : (n,) array of bool
        Whether the last face was added by growth.
    size : (n,) array, length
        Of the cells there.

    Returns
    -------
    cracks : list of Crack
        The last face of a tip moves on until it is half a cell long; then another one begins, once
        that is a tenth of a cell long.
    moves : (n,) array of bool
        Tips that moved; the others wait.
    """
    faces = faces_of(cracks)
    instead = moved_on(faces, grown, size)
    begin = np.where(instead[:, None], faces.anchor, faces.tip)
    moves = np.linalg.norm(place - begin, axis=1) >= LEAST * size
    result = []
    for crack, rows in zip(cracks, rows_of(cracks)):
        result.append(
            with_tips(crack, place[rows], moves[rows], instead[rows]) if crack.n_tips else crack
        )
    return result, moves


def rows_of(cracks: Sequence[Crack]) -> list[slice]:
    """Rows of the tips of each crack."""
    end = np.cumsum([0, *(crack.n_tips for crack in cracks)])
    return [slice(int(a), int(b)) for a, b in zip(end, end[1:])]


def split(values: Floats, cracks: Sequence[Crack]) -> PerCrack:
    """Rows of all tips as one array a crack."""
    return tuple(np.array(values[rows]) for rows in rows_of(cracks))


__all__ = ["Faces", "ending_at", "faces_of", "moved_on", "rows_of", "split"]
