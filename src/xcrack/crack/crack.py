"""Cracks as values: their faces and their ends; the mesh knows nothing of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from xcrack.arrays import Floats, Ints, Shape, frozen
from xcrack.errors import GeometryError
from xcrack.inputs import entries, whole_numbers
from xcrack.mesh.checks import coordinates


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

    Raises
    ------
    GeometryError
        Arrays of other shapes, coordinates that are not finite, point numbers out of range.
    """

    points: Floats
    faces: Ints
    tips: tuple[int, ...] | None = None
    fronts: tuple[Ints, ...] | None = None

    def __post_init__(self) -> None:
        points = coordinates(self.points, "Crack: points", (None, None), error=GeometryError)
        d = points.shape[1]
        if d not in (2, 3) or not len(points):
            raise GeometryError(f"Crack: points must be (p, 2) or (p, 3), not {points.shape}.")
        object.__setattr__(self, "points", frozen(points))
        object.__setattr__(self, "faces", self._numbers("faces", self.faces, (None, d)))
        if self.tips is not None:
            own = self._numbers("tips", self.tips, (None,))
            object.__setattr__(self, "tips", tuple(own.tolist()))
        if self.fronts is not None:
            given = entries(self.fronts, "Crack: fronts", error=GeometryError)
            fronts = [self._numbers(f"fronts[{k}]", f, (None,)) for k, f in enumerate(given)]
            object.__setattr__(self, "fronts", tuple(fronts))

    def _numbers(self, name: str, given: Any, shape: Shape) -> Ints:
        """Point numbers as a read-only array."""
        array = whole_numbers(given, f"Crack: {name}", shape, error=GeometryError)
        if array.size and (array.min() < 0 or array.max() >= len(self.points)):
            raise GeometryError(
                f"Crack: {name} name points outside 0 ... {len(self.points) - 1}, such as "
                f"{array.min() if array.min() < 0 else array.max()}: give numbers of its points."
            )
        return frozen(array, np.int64)

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

    def __repr__(self) -> str:
        ends = "not placed"
        if self.fronts is not None:
            ends = f"{len(self.fronts)} front(s)"
        elif self.tips is not None:
            ends = f"tips {list(self.tips)}"
        return f"Crack({len(self.points)} points, {len(self.faces)} faces, {ends})"


def crack_length(crack: Crack) -> float:
    """Arc length of all faces of a 2D crack, length."""
    return float(np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum())
