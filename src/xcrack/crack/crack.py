"""Cracks as values: their faces and their ends; the mesh knows nothing of them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import Items, Points, check_fields
from xcrack.base.arrays import Floats, Ints, Shape, frozen_copy, lock
from xcrack.base.checks import whole_numbers
from xcrack.base.errors import GeometryError


@dataclass(frozen=True, eq=False)
class Crack:
    """A crack: simplicial faces and the points of its front.

    Parameters
    ----------
    points : (p, d) array, length
        Vertices of the faces; in 2D in the order in which the polyline runs.
    faces : (f, d) array of int
        Point numbers of each face. In 2D lip + is on the left of the order of the points; in 3D
        the normal by the right-hand rule points to it.
    tips : tuple of int, optional
        In 2D: point numbers of the tips, in the order of the points; None where no mesh
        has decided yet which ends are tips and which are mouths.
    fronts : tuple of (k,) arrays of int, optional
        In 3D: point numbers along each front, in the direction of the third row of its frames
        (ahead, normal, ahead x normal); a closed front repeats its first point at the end. None
        where no mesh has decided yet.
    ends_on : tuple of (int, {1, -1}), optional
        In 3D: cracks of the same problem on which this one ends, by their numbers, and the side of
        each from which it comes: +1 is that to which the normal points. What lies beyond does not
        count; see `arm`.

    Raises
    ------
    GeometryError
        Arrays of other shapes, coordinates that are not finite, point numbers out of range.
    """

    points: Annotated[Floats, Points((None, None))]
    faces: Ints
    tips: tuple[int, ...] | None = None
    fronts: Annotated[tuple[Ints, ...] | None, Items()] = None
    ends_on: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        check_fields(self, GeometryError)
        d = self.points.shape[1]
        if d not in (2, 3) or not len(self.points):
            raise GeometryError(f"Crack: points must be (p, 2) or (p, 3), not {self.points.shape}.")
        object.__setattr__(self, "faces", self._numbers("faces", self.faces, (None, d)))
        if self.tips is not None:
            tip_numbers = self._numbers("tips", self.tips, (None,))
            object.__setattr__(self, "tips", tuple(tip_numbers.tolist()))
        if self.fronts is not None:
            fronts = [self._numbers(f"fronts[{k}]", f, (None,)) for k, f in enumerate(self.fronts)]
            object.__setattr__(self, "fronts", tuple(fronts))
        if not isinstance(self.ends_on, tuple) or len(self.ends_on):
            object.__setattr__(self, "ends_on", _checked_ends(self.ends_on, d))

    def _numbers(self, name: str, value: Any, shape: Shape) -> Ints:
        """Point numbers as a read-only array."""
        array = whole_numbers(value, f"Crack: {name}", shape, error=GeometryError)
        if array.size and (array.min() < 0 or array.max() >= len(self.points)):
            raise GeometryError(
                f"Crack: {name} name points outside 0 ... {len(self.points) - 1}, such as "
                f"{array.min() if array.min() < 0 else array.max()}: give numbers of its points."
            )
        return frozen_copy(array, np.int64)

    @property
    def placed(self) -> bool:
        """Whether a mesh has decided what is front and what is mouth."""
        return self.tips is not None or self.fronts is not None

    @property
    def dim(self) -> int:
        """Number of dimensions, 2 or 3."""
        return int(self.points.shape[1])

    @property
    def n_tips(self) -> int:
        """Number of tips, in 3D of fronts; 0 where they are not decided yet."""
        return len(self.tips or self.fronts or ())

    @cached_property
    def _tips_and_frames(self) -> tuple[Floats, Floats]:
        """Tip points and frames in 2D; see `tip_frames`."""
        tips = self.tips or ()
        x = np.zeros((len(tips), 2))
        frame = np.zeros((len(tips), 2, 2))
        for k, tip in enumerate(tips):
            start, stop = (1, 0) if tip == 0 else (tip - 1, tip)
            piece = self.points[stop] - self.points[start]
            direction = piece / np.linalg.norm(piece)
            normal = np.array([-direction[1], direction[0]])
            x[k] = self.points[tip]
            frame[k] = direction, (-normal if tip == 0 else normal)
        return lock(x), lock(frame)

    @cached_property
    def _last_faces(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Of each tip in 2D: end, begin, length and direction of its face, hand of its frame."""
        x, frame = self._tips_and_frames
        begin = self.points[[1 if tip == 0 else tip - 1 for tip in self.tips or ()]]
        last_piece = x - begin
        (ahead_x, ahead_y), (normal_x, normal_y) = frame.transpose(1, 2, 0)
        length, direction = (
            np.linalg.norm(last_piece, axis=1),
            np.arctan2(last_piece[:, 1], last_piece[:, 0]),
        )
        hand = np.sign(ahead_x * normal_y - ahead_y * normal_x)
        return x, lock(begin), lock(length), lock(direction), lock(hand)

    def __repr__(self) -> str:
        ends = "not placed"
        if self.fronts is not None:
            ends = f"{len(self.fronts)} front(s)"
        elif self.tips is not None:
            ends = f"tips {list(self.tips)}"
        return f"Crack({len(self.points)} points, {len(self.faces)} faces, {ends})"


def _checked_ends(value: Any, d: int) -> tuple[tuple[int, int], ...]:
    """Numbers of other cracks and the sides from which one ends on them."""
    pairs = whole_numbers(value, "Crack: ends_on", (None, 2), error=GeometryError)
    if (pairs[:, 0] < 0).any() or (np.abs(pairs[:, 1]) != 1).any():
        raise GeometryError(
            f"Crack: ends_on = {pairs.tolist()}: give pairs of the number of a crack, from 0 on, "
            "and of the side 1 or -1 of it."
        )
    if d == 2 and len(pairs):
        raise GeometryError(
            "Crack: ends_on is of 3D: leave it out, and let a crack in 2D end on the other with "
            "its own end."
        )
    return tuple((int(on), int(side)) for on, side in pairs.tolist())


def crack_length(crack: Crack) -> float:
    """Arc length of all faces of a 2D crack, length."""
    return float(np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum())


# Tips of cracks in 2D and their frames.


def tip_frames(crack: Crack) -> tuple[Floats, Floats]:
    """Tip points and frames of a placed crack.

    Returns
    -------
    points : (f, d) array, length
    frame : (f, d, d) array
        Rows (ahead, normal); the normal points from lip - to lip + at every tip.
    """
    return crack._tips_and_frames


# Kinks of cracks in 2D: vertices at which a polyline turns by more than a curve's chords do.

TURN = np.radians(15.0)  # from which on a turn is a kink, and no chord of a curve


def turns(points: Floats) -> Floats:
    """Angles by which a polyline `(n, 2)` turns at its inner points `(n - 2,)`, 0 to pi."""
    directions = np.diff(points, axis=0)
    directions = directions / np.linalg.norm(directions, axis=1)[:, None]
    return np.arccos(np.clip((directions[1:] * directions[:-1]).sum(axis=1), -1, 1))


def kink_numbers(points: Floats) -> Ints:
    """Numbers of the points of a polyline `(n, 2)` at which it has a kink."""
    return np.nonzero(turns(points) > TURN)[0] + 1


__all__ = ["TURN", "kink_numbers", "turns"]
