"""Ends of a crack, tips in 2D and fronts in 3D: their points and frames."""

from collections.abc import Callable, Sequence

from xcrack.base.arrays import Floats
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.fronts_3d import front_frames

CutEnds = tuple[Sequence[Floats], Sequence[Floats]]


def _tips(crack: Crack) -> CutEnds:
    x, frame = tip_frames(crack)
    return list(x), list(frame)


def _fronts(crack: Crack) -> CutEnds:
    fronts = front_frames(crack)
    return [front.x for front in fronts], [front.frame for front in fronts]


_ENDS: dict[int, Callable[[Crack], CutEnds]] = {2: _tips, 3: _fronts}


def end_frames(crack: Crack) -> CutEnds:
    """Points and frames of each tip, in 3D of each front, of a placed crack.

    Parameters
    ----------
    crack : Crack

    Returns
    -------
    points : sequence of (2,) or (m, 3) arrays, length
    frames : sequence of (2, 2) or (m, 3, 3) arrays
        Rows (ahead, normal), in 3D (ahead, normal, along).
    """
    return _ENDS[crack.dim](crack)


__all__ = ["end_frames"]
