"""A crack as an engineer measures it: area, depth, lengths on surfaces, and where its ends lie."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.crack.crack import Crack
from xcrack.crack.measures_2d import measures_of_line
from xcrack.crack.measures_3d import measures_of_surface
from xcrack.crack.placing import placed
from xcrack.errors import GeometryError
from xcrack.mesh.mesh import Mesh


@dataclass(frozen=True)
class Trace:
    """A crack on one facet set of the boundary.

    Attributes
    ----------
    name : str
        Of the smallest facet set that has the facets; "boundary" where none has a name.
    length : float, length
        Of the line in which the crack meets the set; 0 in 2D.
    depth : float, length
        Largest distance of the front, in 2D of a tip, from that line.
    """

    name: str
    length: float
    depth: float


@dataclass(frozen=True)
class End:
    """A place where a front, in 2D the crack, meets the boundary.

    Attributes
    ----------
    x : (d,) tuple, length
    name : str
        Facet set there, as in `Trace`.
    front : int
        Number of the front; -1 in 2D.
    """

    x: tuple[float, ...]
    name: str
    front: int


@dataclass(frozen=True)
class Measures:
    """What an engineer reads off a crack.

    Attributes
    ----------
    area : float, length²
        Inside the body; in 2D the length of the crack inside the body.
    front_length : float, length
        Of all fronts inside the body; 0 in 2D.
    depth : float, length
        Largest depth below any of the surfaces that the crack meets; nan where it meets none.
    traces : tuple of Trace
        One for each facet set that the crack meets, in the order of their names.
    ends : tuple of End
        Where its fronts meet the boundary; in 2D its mouths.
    """

    area: float
    front_length: float
    depth: float
    traces: tuple[Trace, ...]
    ends: tuple[End, ...]

    def __str__(self) -> str:
        lines = [f"area {self.area:.6g}, front {self.front_length:.6g}, depth {self.depth:.6g}"]
        lines += [
            f"on {t.name!r}: length {t.length:.6g}, depth below it {t.depth:.6g}"
            for t in self.traces
        ]
        lines += [
            f"end at ({', '.join(f'{v:.6g}' for v in end.x)}) on {end.name!r}" for end in self.ends
        ]
        return "\n".join(lines)


_ROUND_OFF = 1e-12  # of the body: a place as near to zero is zero
_Raw = tuple[float, float, dict[int, tuple[float, float]], list[tuple[Floats, int, int]]]
_BY_DIMENSION: dict[int, Callable[[Crack, Mesh, Ints], _Raw]] = {
    2: measures_of_line,
    3: measures_of_surface,
}


def measures(crack: Crack, mesh: Mesh) -> Measures:
    """Area, depth, surface lengths of a crack, and where its fronts meet which facet sets.

    Traces and ends are intersections of the crack with the facets of the boundary: a semi-ellipse
    has its length 2c on the surface and its depth a below it, a corner crack one pair for each of
    the two surfaces.

    Parameters
    ----------
    crack : Crack
        As it was made or grown.
    mesh : Mesh
        The body, with facet sets by name.

    Returns
    -------
    Measures

    Raises
    ------
    GeometryError
        A crack of another dimension, or one that does not lie in the body.

    Examples
    --------
    >>> import xcrack as xc
    >>> print(measures(xc.line_crack([(-0.1, 0.5), (0.3, 0.5)]), xc.box((0, 0), (1, 1), 9)))
    area 0.3, front 0, depth 0.3
    on 'left': length 0, depth below it 0.3
    end at (0, 0.5) on 'left'
    """
    if not isinstance(crack, Crack) or not isinstance(mesh, Mesh):
        raise GeometryError(
            f"measures: give a Crack and a Mesh, not {type(crack).__name__} and "
            f"{type(mesh).__name__}."
        )
    if crack.dim != mesh.dim:
        raise GeometryError(
            f"measures: a crack of {crack.dim}D needs a body of {crack.dim}D, not {mesh.dim}D."
        )
    own = crack if crack.placed else placed(crack, mesh)
    names, group = facet_names(mesh)
    area, front_length, traces, ends = _BY_DIMENSION[mesh.dim](own, mesh, group)
    rows = [Trace(names[k], *traces[k]) for k in sorted(traces, key=lambda k: names[k])]
    depth = max((row.depth for row in rows), default=float("nan"))
    points = []
    for x, facet, front in ends:
        place = np.where(np.abs(x) < _ROUND_OFF * mesh.extent, 0.0, x)
        points.append(End(tuple(place.tolist()), names[group[facet]], front))
    return Measures(area, front_length, depth, tuple(rows), tuple(points))


def facet_names(mesh: Mesh) -> tuple[list[str], Ints]:
    """Names of sets, and for each facet of the mesh the number of its smallest set.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    names : list of str
    group : (f,) array of int
        0, which is "boundary", for facets in no other set.
    """
    sets = sorted(mesh.facet_sets.items(), key=lambda item: -len(item[1]))
    # "boundary" has all: any other set of as many facets is more telling.
    sets = sorted(sets, key=lambda item: item[0] != "boundary")
    group = np.zeros(len(mesh.facets), dtype=np.int64)
    for k, (_, facets) in enumerate(sets):
        if len(facets):
            group[mesh.facet_numbers(facets)] = k
    return [name for name, _ in sets], group
