"""Cracks as values: their faces and their tips; the mesh knows nothing of them."""

from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints, frozen


@dataclass(frozen=True, eq=False)
class Crack:
    """A crack: simplicial faces and the points of its front.

    Parameters
    ----------
    points : (p, d) array, length
        Vertices of the faces; in the plane in the order in which the polyline runs.
    faces : (f, d) array of int
        Point numbers of each face. In the plane lip + is on the left of the order of the points;
        in space the normal by the right-hand rule points to it.
    tips : tuple of int, optional
        In the plane: point numbers of the tips, in the order of the points; None where no mesh
        has decided yet which ends are tips and which are mouths.
    fronts : tuple of (k,) arrays of int, optional
        In space: point numbers along each front, in the direction of the third row of its frames
        (ahead, normal, ahead x normal); a closed front repeats its first point at the end. None
        where no mesh has decided yet.
    """

    points: Floats
    faces: Ints
    tips: tuple[int, ...] | None = None
    fronts: tuple[Ints, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.float64))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64))
        if self.fronts is not None:
            object.__setattr__(self, "fronts", tuple(frozen(f, np.int64) for f in self.fronts))

    @property
    def placed(self) -> bool:
        """Whether a mesh has decided what is front and what is mouth."""
        return self.tips is not None or self.fronts is not None

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def n_tips(self) -> int:
        """Number of tips, in space of fronts; 0 where they are not decided yet."""
        return len(self.tips or self.fronts or ())

    def __repr__(self) -> str:
        ends = "not placed"
        if self.fronts is not None:
            ends = f"{len(self.fronts)} front(s)"
        elif self.tips is not None:
            ends = f"tips {list(self.tips)}"
        return f"Crack({len(self.points)} points, {len(self.faces)} faces, {ends})"


def crack_length(crack: Crack) -> float:
    """Arc length of all faces of a crack in the plane, length."""
    return float(np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum())
