"""Cracks in a body: placed in its mesh, frames at their ends, stations where K is known."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.errors import GeometryError
from xcrack.crack import junctions as junctions_2d
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.fronts import FrontCurve, front_curve, front_frames
from xcrack.crack.junctions import Junction
from xcrack.crack.junctions_3d import is_before
from xcrack.crack.placing_2d import check_lines, place_line, vertices_on_mesh
from xcrack.crack.placing_3d import (
    ShortFront,
    arms_placed,
    check_surfaces,
    surface_junctions,
    surface_placement,
)
from xcrack.mesh.locate import contains
from xcrack.mesh.mesh import Mesh

# Cracks put into a mesh: what of them is tip or front, what is mouth, and whether they meet.

CutEnds = tuple[Sequence[Floats] | Floats, Sequence[Floats] | Floats]


@dataclass(frozen=True)
class Geometry:
    """What lines in a plane body and surfaces in space do in ways of their own.

    Attributes
    ----------
    placement : callable
        As `placement_of`, which looks at the dimensions first.
    check : callable
        Raises where placed cracks cross or touch, or their ends are closer than a cell.
    on_others : callable (cracks as given, placed cracks, mesh)
        Placed cracks, of which some end on others.
    junctions : callable
        Where placed cracks do.
    on_mesh : callable
        A placed crack as the mesh is cut by it.
    end_frames : callable
        Of a placed crack: points of each tip `(2,)` or front `(m, 3)`, and frames there with rows
        (ahead, normal), in 3D (ahead, normal, along).
    end, station, size : str
        What messages and reports call an end, a place of it where K is known, and the measure of a
        crack.
    """

    placement: Callable[[Crack, Mesh], tuple[Crack, Sequence[ShortFront]]]
    check: Callable[[tuple[Crack, ...], Mesh], None]
    on_others: Callable[..., tuple[Crack, ...]]
    junctions: Callable[..., tuple[Junction, ...]]
    on_mesh: Callable[[Crack, Mesh], Crack]
    end_frames: Callable[[Crack], CutEnds]
    end: str
    station: str
    size: str


def _fronts(crack: Crack) -> CutEnds:
    fronts = front_frames(crack)
    return [front.x for front in fronts], [front.frame for front in fronts]


GEOMETRY = {
    2: Geometry(
        lambda crack, mesh: (place_line(crack, mesh), ()),
        check_lines,
        junctions_2d.on_others,
        junctions_2d.junctions,
        on_mesh=vertices_on_mesh,
        end_frames=tip_frames,
        end="tip",
        station="tip",
        size="length",
    ),
    3: Geometry(
        surface_placement,
        check_surfaces,
        arms_placed,
        surface_junctions,
        on_mesh=lambda crack, mesh: crack,
        end_frames=_fronts,
        end="front",
        station="front place",
        size="area",
    ),
}


def place_crack(crack: Crack, mesh: Mesh) -> Crack:
    """Decide what of a crack is tip or front in this mesh, and lead its mouths out of the body.

    Parameters
    ----------
    crack : Crack
        If its tips or fronts are known already, only these are looked at again.
    mesh : Mesh

    Returns
    -------
    Crack
        With `tips` or `fronts`; see `place_line` and `surface_placement`.

    Raises
    ------
    GeometryError
        A crack of another dimension, outside the body, or too small for the mesh.
    """
    return placement_of(crack, mesh)[0]


def placement_of(crack: Crack, mesh: Mesh) -> tuple[Crack, Sequence[ShortFront]]:
    """A crack placed as by `place_crack`, and the fronts that the mesh is too coarse for.

    Parameters
    ----------
    crack : Crack
    mesh : Mesh

    Returns
    -------
    crack : Crack
    short_fronts : sequence of ShortFront
        None in 2D, and of a crack whose fronts are known already.
    """
    if crack.dim != mesh.dim:
        raise GeometryError(f"a {crack.dim}D crack cannot be put into a {mesh.dim}D mesh.")
    return GEOMETRY[mesh.dim].placement(crack, mesh)


_ON = 1e-6  # of a side of a front, by which its end may miss the boundary
_SAMPLES = 400  # points of an open front among which its way into the body is looked for


@dataclass(frozen=True, eq=False)
class Stations:
    """Ends of all cracks of a problem, as arrays over their n stations.

    Attributes
    ----------
    crack : (n,) array of int
        Number of the crack.
    front : (n,) array of int
        Number of the tip or front within its crack.
    s : (n,) array, length
        Position along the front; 0 in 2D.
    x : (n, d) array, length
    frame : (n, d, d) array
        Rows (ahead, normal), in 3D (ahead, normal, ahead x normal).
    """

    crack: Ints
    front: Ints
    s: Floats
    x: Floats
    frame: Floats

    def __len__(self) -> int:
        return len(self.crack)


def inside_body(cracks: Sequence[Crack], c: int, mesh: Mesh, x: Floats) -> Bools:
    """Which points of crack c count: in the body, and not beyond a crack on which it ends."""
    is_inside_ = contains(mesh, x)
    if cracks[c].ends_on:
        is_inside_ = is_inside_ & is_before(cracks, c, x)
    return np.asarray(is_inside_)


@dataclass(frozen=True, eq=False)
class FrontInBody:
    """A front as far as it lies in the body: its vertices there, and where it leaves.

    Attributes
    ----------
    curve : FrontCurve
        Through the vertices in the body and one beyond each end: from there a front is led out in a
        direction of its own.
    ends : (float, float) or None, length
        Parameters at which an open front enters and leaves the body, all of a closed one; None if
        it never does.
    at : (f,) array, length
        Parameters of the vertices in the body, and of the ends that are none.
    number : (f,) array
        Vertices as numbers within the front; a place between two of them is no whole number.
    x : (f, 3) array, length
    frame : (f, 3, 3) array
        Rows (ahead, normal, along).
    s : (f,) array, length
        Arc length from the first vertex of the front.
    """

    curve: FrontCurve
    ends: tuple[float, float] | None
    at: Floats
    number: Floats
    x: Floats
    frame: Floats
    s: Floats

    def with_frames(self, frame: Floats) -> Floats:
        """Frames `(f, 3, 3)` of which those of the vertices are given ones `(m, 3, 3)`."""
        is_vertex = self.number % 1 == 0
        result = np.array(self.frame)
        result[is_vertex] = frame[self.number[is_vertex].astype(np.int64)]
        return result


def front_in_body(
    x: Floats, frame: Floats, is_closed: bool, is_inside: Callable[[Floats], Bools]
) -> FrontInBody:
    """Clip a front to the body.

    Parameters
    ----------
    x : (m, 3) array, length
        Vertices of the front.
    frame : (m, 3, 3) array
    is_closed : bool
    is_inside : callable
        Which points (q, 3) lie in the body, as `inside_body`.

    Returns
    -------
    FrontInBody
        Whose first and last place lie where the front comes through the surface: the last vertex
        inside may be as far from there as its sides are long, and K, rate and angle differ over
        that way.
    """
    rows_inside = np.nonzero(is_inside(np.array(x)))[0]
    whole_curve = front_curve(x, frame, is_closed)
    curve, first, stop = whole_curve, 0, len(x)
    if not is_closed:
        first, stop = part_inside(x, rows_inside, is_inside)
        if stop - first < len(x):
            curve = front_curve(x[first:stop], frame[first:stop], is_closed)
    at = curve.breaks[rows_inside - first]
    ends = _way_inside(curve, is_inside) if len(rows_inside) else None
    number = rows_inside.astype(float)
    if not is_closed and ends is not None:
        grid = np.arange(first, stop, dtype=float)
        of_ends = np.interp(ends, curve.breaks, grid)
        is_new = np.array([number[0] - of_ends[0], of_ends[1] - number[-1]]) > _ON
        order = np.argsort(np.append(number, of_ends[is_new]), kind="stable")
        number = np.append(number, of_ends[is_new])[order]
        at = np.append(at, np.array(ends)[is_new])[order]
    places, frames, _ = curve.at(at)
    is_vertex = number % 1 == 0
    places[is_vertex] = np.asarray(x)[number[is_vertex].astype(np.int64)]
    breaks = np.interp(number, np.arange(len(whole_curve.breaks)), whole_curve.breaks)
    return FrontInBody(curve, ends, at, number, places, frames, whole_curve.arc(breaks))


def part_inside(
    x: Floats, rows_inside: Ints, is_inside: Callable[[Floats], Bools]
) -> tuple[int, int]:
    """First vertex of an open front to count, and the one behind the last.

    One beyond each end of the part in the body, where that does not end at a vertex.

    Parameters
    ----------
    x : (m, 3) array, length
        Vertices of the front.
    rows_inside : (k,) array of int
        Those in the body.
    is_inside : callable
        Which points (q, 3) lie in the body.
    """
    if not len(rows_inside):
        return 0, len(x)
    first, last_row = int(rows_inside[0]), int(rows_inside[-1])
    next_rows = [min(max(k, 0), len(x) - 1) for k in (first - 1, last_row + 1)]
    on = x[[first, last_row]] + _ON * (x[next_rows] - x[[first, last_row]])
    goes_on = is_inside(on)
    first, last_row = (
        k if is_beyond else end for k, end, is_beyond in zip(next_rows, (first, last_row), goes_on)
    )
    return (first, last_row + 1) if last_row > first else (0, len(x))


def _way_inside(
    curve: FrontCurve, is_inside: Callable[[Floats], Bools]
) -> tuple[float, float] | None:
    """Parameters at which an open front enters and leaves the body; None if it never does."""
    if curve.is_closed:
        return 0.0, curve.length
    s = np.linspace(0.0, curve.length, _SAMPLES + 1)
    rows_inside = np.nonzero(is_inside(curve.at(s)[0]))[0]
    if not len(rows_inside):
        return None
    ends = []
    for row, step in ((int(rows_inside[0]), -1), (int(rows_inside[-1]), 1)):
        s_inside = s[row]
        s_outside = s[min(max(row + step, 0), _SAMPLES)]
        for _ in range(30 if s_outside != s_inside else 0):
            middle = (s_inside + s_outside) / 2
            if is_inside(curve.at(np.array([middle]))[0])[0]:
                s_inside = middle
            else:
                s_outside = middle
        ends.append(float(s_inside))
    return ends[0], ends[1]


def stations_of(cracks: Sequence[Crack], mesh: Mesh) -> Stations:
    """Stations of placed cracks in the body, in the order of `SIF` of each.

    Parameters
    ----------
    cracks : sequence of Crack
        Placed in the mesh.
    mesh : Mesh
    """
    d = mesh.dim
    rows: list[tuple[int, int, Floats, Floats, Floats]] = []
    for c, crack in enumerate(cracks):
        if d == 2:
            for k, (x, frame) in enumerate(zip(*tip_frames(crack), strict=True)):
                rows.append((c, k, np.zeros(1), x[None], frame[None]))
        else:
            for k, front in enumerate(front_frames(crack)):
                is_inside = partial(inside_body, cracks, c, mesh)
                part = front_in_body(front.x, front.frame, front.is_closed, is_inside)
                rows.append((c, k, part.s, part.x, part.frame))
    count = [len(row[2]) for row in rows]
    return Stations(
        lock(np.repeat([row[0] for row in rows], count).astype(np.int64)),
        lock(np.repeat([row[1] for row in rows], count).astype(np.int64)),
        lock(np.concatenate([np.zeros(0), *(row[2] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d)), *(row[3] for row in rows)])),
        lock(np.concatenate([np.zeros((0, d, d)), *(row[4] for row in rows)])),
    )


__all__ = [
    "GEOMETRY",
    "FrontInBody",
    "Geometry",
    "Stations",
    "front_in_body",
    "inside_body",
    "place_crack",
    "placement_of",
    "stations_of",
]
