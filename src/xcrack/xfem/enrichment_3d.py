"""How far the tip functions reach around fronts in 3D."""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats, Ints
from xcrack.crack.crack import Crack
from xcrack.crack.size_3d import surface_size
from xcrack.cutting.cut import Cut
from xcrack.mesh.body import Body
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.sizes import leg_size

# Of the crack's size, of the distance to a side of the body, of that to another front.
_SHARE, _ASIDE, _APART = 0.65, 0.7, 0.45
# In cells. At order 1 K_I of a penny is 2, .9 and .2 % low with 2.3, 2.8 and 3.4 cells; unknowns
# and points grow with the square of the radius, but are few. At order 2 more than two cells
# change nothing, and take a third more time.
_LEAST = 2.0
_RANGE = {1: (2.6, 3.6), 2: (2.0, 2.0)}
_EXIT = 1.5  # a front is near its exit where that is closer than this many distances to the side
_SAMPLES = 24  # points of an open front at which the distance to the boundary is taken


def front_reach(mesh: Mesh, crack: Crack, wanted: float | None) -> float:
    """Distance from the fronts of a 3D crack up to which tip functions may act, length."""
    fronts = [crack.points[front] for front in crack.fronts or ()]
    if not fronts:
        return 0.0
    near = mesh.cell_tree.query(np.concatenate(fronts))[1]
    size = float(mesh.cell_size[near].max())
    return max(wanted or 0.0, _RANGE[1][1] * size) + size


def front_radii(
    mesh: Mesh,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    order: int,
    wanted: float | None,
    meeting: Floats,
) -> list[tuple[float, ...]]:
    """Radius of the enriched tube around each front of each crack, length.

    Without a wanted radius: the smallest of 0.65 of the crack's size (area over length of its
    fronts, twice that where they are closed), 0.7 of the distance to sides that the front does not
    pierce, and 0.45 of that to other fronts; from 2.6 to 3.6 cells, and two at order 2. A wanted
    radius is used, and shrunk only where the body or another front demands; never below two cells.

    Parameters
    ----------
    mesh : Mesh
    cracks : tuple of Crack
    cuts : tuple of Cut
    order : int
    wanted : float, length, optional
    meeting : (0, 3) array
        Fronts meet no junctions.
    """
    del meeting
    least, most = _RANGE[order]
    every = [[crack.points[front] for front in crack.fronts or ()] for crack in cracks]
    if not any(every):
        return [() for _ in cracks]
    body, radii = Body.of(mesh), []
    for c, (crack, cut) in enumerate(zip(cracks, cuts, strict=True)):
        row = []
        fronts = crack.fronts or ()
        if fronts and wanted is None:
            size = surface_size(crack, mesh, body)
        for k, numbers in enumerate(fronts):
            cell = leg_size(mesh, cut.level_set.tip_cells[k])
            closed = bool(numbers[0] == numbers[-1])
            room = _ASIDE * _to_sides(body, every[c][k], closed)
            others = [
                x for d, own in enumerate(every) for j, x in enumerate(own) if (d, j) != (c, k)
            ]
            if others:
                nearest = cKDTree(np.concatenate(others)).query(every[c][k])[0]
                room = min(room, _APART * float(nearest.min()))
            if wanted is None:
                free = min(_SHARE * (2 if closed else 1) * size, room)
                row.append(max(min(free, most * cell), least * cell))
            else:
                row.append(max(min(wanted, room), _LEAST * cell))
        radii.append(tuple(row))
    return radii


def _to_sides(body: Body, x: Floats, closed: bool) -> float:
    """Distance of a front to the boundary, but where it runs into it."""
    inside = np.nonzero(body.contains(x))[0]
    if not len(inside):
        return np.inf
    rows: Ints = inside[np.unique(np.linspace(0, len(inside) - 1, _SAMPLES).astype(int))]
    distance = np.abs(body.depth(x[rows])[0])
    if closed:
        return float(distance.min())
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    exits = np.minimum(s[rows] - s[inside[0]], s[inside[-1]] - s[rows])
    along = exits > _EXIT * distance
    return float(distance[along].min(initial=np.inf))
