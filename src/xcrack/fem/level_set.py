"""Level sets of one crack at the points of a mesh, and what both dimensions do to them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from xcrack.base.arrays import Bools, Floats, Ints, at, lock
from xcrack.base.errors import CoarseMeshError
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.fronts import Front, front_frames
from xcrack.crack.placing_2d import ON_MESH
from xcrack.crack.stations import part_inside
from xcrack.mesh.distances import TriangleTree, closest_in, front_distance, signed_in, triangle_tree
from xcrack.mesh.locate import cells_around, contains
from xcrack.mesh.mesh import Mesh, local_facets
from xcrack.mesh.simplex import boxes_meet, simplex_rule
from xcrack.mesh.triangulation import face_normals, rim, ruled_strip, unit

SNAP = 1e-10  # share of an edge below which a cut point is moved onto its end


@dataclass(frozen=True, eq=False)
class LevelSet:
    """Level sets of one crack.

    Attributes
    ----------
    phi : (n,) array, length
        Signed distance, positive on the side of lip +, zero where snapped; in 3D shifted so that
        what is linear in cells follows a curved crack in the mean.
    psi : (f, n) array, length
        Signed distance to each tip along the crack; the crack is where all are negative.
    tip_cells : tuple of (k,) arrays of int
        Cells whose closed set meets the tip or the front, for each of them.
    tip : (f, d) array, length
        Tip points; in 3D a point of each front.
    mouth : (n,) array, length
        Positive where a point is nearest to the prolongation of a mouth: across a hole, say, the
        line of a crack runs on, but not the crack.
    is_near : (e,) array of bool
        Edges short enough to be crossed by the crack where phi changes its sign; a change far
        from the crack (behind a strong turn) is no cut.
    line : (n, 2) array, length
        In 2D: the crack itself, whose kinks the cut follows; without points where it does not.
    """

    phi: Floats
    psi: Floats
    tip_cells: tuple[Ints, ...]
    tip: Floats
    mouth: Floats
    is_near: Bools
    line: Floats = field(default_factory=lambda: lock(np.zeros((0, 2))))

    @property
    def psi_of_ends(self) -> Floats:
        """Negative along the crack: the largest psi of all its ends `(n,)`."""
        return np.asarray(np.vstack([self.psi, self.mouth[None]]).max(axis=0))


def level_set(mesh: Mesh, crack: Crack, reach: float) -> "LevelSet":
    """Level sets of a placed crack at the points of a mesh.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
    reach : float, length
        In 3D: distance from the fronts up to which phi and psi are needed.
    """
    return line_levels(mesh, crack) if mesh.dim == 2 else surface_levels(mesh, crack, reach)


def near_edges(mesh: Mesh, phi: Floats, shift: Floats | None = None) -> Bools:
    """Edges short enough to be crossed where phi changes its sign `(e,)`.

    Parameters
    ----------
    mesh : Mesh
    phi : (n,) array, length
    shift : (n,) array, length, optional
        What phi has more than a distance, which changes by no more than the length of an edge.
    """
    ends = np.abs(phi)[mesh.edges]
    limit = mesh.edge_length * (1 + 1e-6)
    if shift is not None:
        limit = limit + np.abs(np.diff(shift[mesh.edges], axis=1)[:, 0])
    return np.asarray(ends[:, 0] + ends[:, 1] <= limit)


def snap_to_vertices(mesh: Mesh, phi: Floats) -> Floats:
    """Move cut points within 1e-10 of an edge's end onto that end, until nothing changes."""
    phi = np.array(phi)
    phi[np.abs(phi) < 1e-15 * mesh.longest_edge] = 0.0
    while True:
        a, b = phi[mesh.edges].T
        is_crossed = a * b < 0
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(is_crossed, a / (a - b), 0.5)
        at_begin, at_end = is_crossed & (share < SNAP), is_crossed & (share > 1 - SNAP)
        if not (at_begin.any() or at_end.any()):
            return phi
        phi[mesh.edges[at_begin, 0]] = 0.0
        phi[mesh.edges[at_end, 1]] = 0.0


# Level sets of a polyline at the points of a mesh.


def line_levels(mesh: Mesh, crack: Crack) -> LevelSet:
    """Level sets of a placed crack in 2D at the points of a mesh."""
    from xcrack.mesh.kernels.location import polyline_distance

    reach = 10 * mesh.extent + float(np.abs(crack.points - mesh.points[0]).max())
    start, stop = _prolongation(crack.points, reach)
    vertices = np.concatenate([[start], crack.points, [stop]])
    phi, segment = polyline_distance(mesh.points, vertices)
    x, frame = tip_frames(crack)
    psi = np.empty((len(x), mesh.n_points))
    n_segments = len(vertices) - 1
    for k, tip in enumerate(crack.tips or ()):
        from_tip = mesh.points - x[k]
        psi_on_ray = from_tip @ frame[k, 0]
        r = np.linalg.norm(from_tip, axis=1)
        psi_behind = -np.sqrt(np.maximum((r - np.abs(phi)) * (r + np.abs(phi)), 0.0))
        ray, neighbour = (0, 1) if tip == 0 else (n_segments - 1, n_segments - 2)
        # Points nearest to the kink behind the last piece are as near to one piece as to the
        # other: round-off must not decide.
        neighbour_length = np.linalg.norm(vertices[neighbour + 1] - vertices[neighbour])
        is_on_ray = (segment == ray) | ((segment == neighbour) & (psi_on_ray > -neighbour_length))
        psi[k] = np.where(is_on_ray, psi_on_ray, psi_behind)
    mouth = np.full(mesh.n_points, -reach)
    for end, ray in ((0, 0), (len(crack.points) - 1, n_segments - 1)):
        if end not in (crack.tips or ()):
            is_beyond = segment == ray
            mouth[is_beyond] = np.linalg.norm(mesh.points[is_beyond] - crack.points[end], axis=1)
    levels = tied_to_tips(mesh, crack, phi, psi, mouth, near_edges(mesh, phi))
    return replace(levels, line=crack.points)


def tied_to_tips(
    mesh: Mesh, crack: Crack, phi: Floats, psi: Floats, mouth: Floats, near_edge: Bools
) -> LevelSet:
    """Level sets of a placed crack in 2D from values at the points, which are changed.

    Around a tip they become those of its frame, so that the tip stays where it is even when the
    last kink is less than a cell away.
    """
    x, frame = tip_frames(crack)
    tip_cells = tuple(cells_around(mesh, point, ON_MESH) for point in x)
    for k, cells in enumerate(tip_cells):
        nodes = np.unique(mesh.cells[cells])
        from_tip = mesh.points[nodes] - x[k]
        phi[nodes] = from_tip @ frame[k, 1]
        psi[k, nodes] = from_tip @ frame[k, 0]
        at_tip = np.zeros(mesh.n_points, dtype=bool)
        at_tip[nodes] = True
        near_edge |= at_tip[mesh.edges[:, 0]] | at_tip[mesh.edges[:, 1]]
    phi = snap_to_vertices(mesh, phi)
    return LevelSet(lock(phi), lock(psi), tip_cells, lock(x), lock(mouth), lock(near_edge))


def _prolongation(points: Floats, reach: float) -> tuple[Floats, Floats]:
    """Ends of the rays that prolong a polyline, where they meet it or each other at the latest.

    Beyond such a crossing of a crack that turns by more than half a circle the sides of the two
    pieces contradict each other.
    """
    start, end = points[0], points[-1]
    backward_direction, on = _unit(start - points[1]), _unit(end - points[-2])
    first_reach = _free_reach(start, backward_direction, points[1:], reach)
    last_reach = _free_reach(end, on, points[:-1], reach)
    segment_ahead = np.stack([end, end + last_reach * on])
    first_reach = _free_reach(start, backward_direction, segment_ahead, first_reach)
    last_reach = _free_reach(
        end, on, np.stack([start, start + first_reach * backward_direction]), last_reach
    )
    return start + first_reach * backward_direction, end + last_reach * on


def _free_reach(origin: Floats, direction: Floats, polyline: Floats, reach: float) -> float:
    """Length up to which a ray runs before it meets a polyline."""
    if len(polyline) < 2:
        return reach
    a, segment = polyline[:-1], np.diff(polyline, axis=0)
    gap = a - origin
    cross = direction[0] * segment[:, 1] - direction[1] * segment[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[:, 0] * segment[:, 1] - gap[:, 1] * segment[:, 0]) / cross
        u = (gap[:, 0] * direction[1] - gap[:, 1] * direction[0]) / cross
    hit = (t > 0) & (u >= -1e-9) & (u <= 1 + 1e-9)
    # Of pieces on the line of the ray t and u are quotients of round-off, also of those behind it.
    hit &= boxes_meet(origin, origin + reach * direction, a, polyline[1:])
    return float(min(reach, np.min(t[hit], initial=np.inf)))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v))


# Strips of triangles that prolong cracks in 3D ahead of their fronts, for their level sets.

_FAN = np.radians(30.0)  # a front that turns away by more gets rays between
_NEARER = 0.8  # of the way from its front: what of a prolongation is nearer to a face is none
_BESIDE = 0.3  # of the distance to a front, which another prolongation lies beside that of its own
_AHEAD = 0.05  # of a triangle: no more of a crack lies ahead of fronts that are nowhere hollow


@dataclass(frozen=True, eq=False)
class ExtendedSurface:
    """A 3D crack prolonged ahead of its fronts.

    Attributes
    ----------
    points : (p, 3) array, length
        First those of the crack.
    triangles : (k, 3) array of int
        First the faces of the crack.
    label : (k,) array of int
        0 for a face of the crack, f + 1 for the strip ahead of front f.
    base : (k, 3) array, length
        Of a triangle of a strip a place on the front where it comes from.
    faces : TriangleTree or None
        The faces of the crack, if a strip has been cut short before some of them.
    """

    points: Floats
    triangles: Ints
    label: Ints
    base: Floats
    faces: TriangleTree | None


def extended_surface(crack: Crack, mesh: Mesh, width: float) -> ExtendedSurface:
    """A placed crack with a strip of triangles ahead of each front, tangential to it.

    Where a front is hollow the rays of the strip cross; what would be turned over is left out,
    and parts may lie over each other. Where it is sharp, rays fan out. A strip ends where it comes
    closer to faces of the crack, or to another front that it passes beside, than to its own front.

    Parameters
    ----------
    crack : Crack
        Placed in the mesh.
    mesh : Mesh
        Its cells give the length of the triangles where the front has long sides.
    width : float, length
        How far the strip reaches.

    Returns
    -------
    ExtendedSurface
    """
    points, triangles = [crack.points], [crack.faces]
    label = [np.zeros(len(crack.faces), dtype=np.int64)]
    bases = [crack.points[crack.faces[:, 0]]]
    tree, is_short = None, False
    n_points = len(crack.points)
    edges, owner = rim(crack.faces)
    side_normal = dict(
        zip(
            map(tuple, edges.tolist()),
            face_normals(crack.points, crack.faces)[owner],
            strict=True,
        )
    )
    for f, front in enumerate(front_frames(crack)):
        base, direction, n = _rays(front, side_normal)
        side = np.linalg.norm(np.diff(front.x, axis=0), axis=1)
        cell = mesh.cell_size[mesh.cell_tree.query(front.x)[1]]
        edge = max(float(np.median(side)), 0.25 * float(cell.min()))
        layers = int(np.clip(np.ceil(width / edge), 1, 64))
        origin = crack.points[base]
        rays = width * direction
        strip_points, faces = ruled_strip(
            n_points, base, origin, rays, layers, front.is_closed, is_crossed=True
        )
        points.append(strip_points)
        all_points = np.concatenate(points)
        reference = np.zeros((n_points + len(strip_points), 3))
        reference[base] = n
        reference[n_points : n_points + len(n) * layers] = np.repeat(n, layers, axis=0)
        expected_normal = reference[faces].sum(axis=1)
        is_upright = (
            np.einsum("ij,ij->i", face_normals(all_points, faces), unit(expected_normal)) > 0.2
        )
        faces = faces[is_upright]
        start = np.full(reference.shape, np.nan)
        start[base] = origin
        start[n_points : n_points + len(n) * layers] = np.repeat(origin, layers, axis=0)
        place = np.nanmean(start[faces], axis=1)
        if _lies_ahead(crack.points, origin, direction, _AHEAD * edge):
            tree = tree or triangle_tree(crack.points, crack.faces)
            is_beyond = _is_beyond(tree, all_points[faces].mean(axis=1), place)
            is_short |= bool(is_beyond.any())
            faces, place = faces[~is_beyond], place[~is_beyond]
        triangles.append(faces)
        label.append(np.full(len(faces), f + 1))
        bases.append(place)
        n_points += len(strip_points)
    x, faces, labels, places = (lock(np.concatenate(a)) for a in (points, triangles, label, bases))
    return ExtendedSurface(x, faces, labels, places, tree if is_short else None)


def _lies_ahead(points: Floats, origin: Floats, direction: Floats, tolerance: float) -> bool:
    """Whether points of a crack lie ahead of places on its front, by the directions there."""
    height = np.einsum("ij,ij->i", origin, direction) + tolerance
    return any(bool((points @ d > h).any()) for d, h in zip(direction, height, strict=True))


def _is_beyond(tree: TriangleTree, x: Floats, place: Floats) -> Bools:
    """Which points of a strip are nearer to the crack elsewhere than where the strip comes from.

    Of other fronts only those count whose own strip would lie elsewhere: in one plane strips may
    lie over each other.
    """
    way = np.linalg.norm(x - place, axis=1)
    nearest_point = closest_in(tree, x, float(way.max(initial=0.0)))
    rows = np.nonzero((nearest_point.triangle >= 0) & (nearest_point.distance < _NEARER * way))[0]
    distance, triangle = nearest_point.distance[rows], nearest_point.triangle[rows]
    part = nearest_point.part[rows] - 1
    normal = unit(tree.feature_normals[triangle, part])
    height = np.abs(np.einsum("ij,ij->i", x[rows] - nearest_point.foot[rows], normal))
    is_inside = (part < 0) | ~tree.rim[triangle, part]
    result = np.zeros(len(x), dtype=bool)
    result[rows] = is_inside | (height > _BESIDE * distance)
    return result


def _rays(front: Front, side_normal: dict[tuple[int, int], Floats]) -> tuple[Ints, Floats, Floats]:
    """Point numbers, directions and normals of the rays of a strip, with fans at sharp places."""
    m = len(front.x)
    next_number = np.roll(front.number, -1)
    n_sides = m if front.is_closed else m - 1
    edge = np.roll(front.x, -1, axis=0) - front.x
    # The faces run against the direction of the front.
    normal = [
        side_normal.get((int(next_number[j]), int(front.number[j])), front.frame[j, 1])
        for j in range(n_sides)
    ]
    outward_direction = unit(np.cross(normal, edge[:n_sides]))
    previous_direction = np.roll(outward_direction, 1, axis=0)
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", previous_direction, outward_direction), -1, 1))
    base, direction, normals = [], [], []
    for j in range(m):
        t, n, b = front.frame[j]
        rays = [t]
        if front.is_closed or 0 < j < m - 1:
            previous_ray, next_ray, angle = (
                previous_direction[j],
                outward_direction[j],
                float(angles[j]),
            )
            if angle > _FAN and (next_ray - previous_ray) @ b > 0:
                pieces = int(np.ceil(angle / _FAN))
                share = np.arange(pieces + 1) / pieces
                rays = [
                    (np.sin((1 - c) * angle) * previous_ray + np.sin(c * angle) * next_ray)
                    / np.sin(angle)
                    for c in share
                ]
        base.extend([int(front.number[j])] * len(rays))
        direction.extend(rays)
        normals.extend([n] * len(rays))
    return np.array(base), np.array(direction), np.array(normals)


# Level sets of a crack surface at the points of a mesh.

_FLAT = 0.03  # share |psi| / r below which the root of r² - phi² loses digits
_AT = 1e-10  # share of a cell below which a psi on the crack is zero
_STRAIGHT = 1e-6  # offset as a share of a cell, below which a front or a surface is straight
_CHORDS = 12  # chords over which their offset is averaged
_NO_CUT = 0.5  # error of phi as a share of a cell, from which on that is not cut by the crack
_OFF_SURFACE = 0.4  # of an edge: bends leave up to .4 between its cut and the surface, gaps .5
_RUNS_ON = 1.0  # cells between the end of a front and another front that goes on from there
_STRAIGHT_ON = 0.7  # cosine to the direction of a front at its end, in which another one goes on
_BEYOND, _OTHER = 1, 2  # points past the ends of a front, and ahead of another front
_PASSES = 12  # towards the mean square: leaves a thirtieth of the slowest part


def surface_levels(mesh: Mesh, crack: Crack, reach: float) -> LevelSet:
    """Level sets of a placed 3D crack.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
        With its fronts decided.
    reach : float, length
        Distance from the fronts up to which phi and psi are needed.

    Returns
    -------
    LevelSet

    Raises
    ------
    CoarseMeshError
        A front lies closer than a cell before a face of its own crack.
    """
    size = _largest_cells(mesh, crack)
    band = reach + 2 * size
    surface = extended_surface(crack, mesh, band + size)
    tree = triangle_tree(surface.points, surface.triangles)

    def distance_to(x: Floats, reach: float) -> tuple[Floats, Ints, Bools]:
        return _distance_to_faces_first(surface, tree, x, reach, size)

    phi, triangle, at_end = distance_to(mesh.points, band)
    label = np.where(triangle >= 0, surface.label[triangle], 0)
    fronts_of_crack = front_frames(crack)
    fronts = _fronts_led_on(fronts_of_crack, mesh)
    far_distance = 10 * mesh.extent
    psi = np.empty((len(fronts), mesh.n_points))
    part = np.empty(psi.shape, dtype=np.int64)
    for k, front in enumerate(fronts):
        psi[k], is_past = _front_distance(
            mesh.points, phi, label == k + 1, front, band, far_distance
        )
        part[k] = np.where((label > 0) & (label != k + 1), _OTHER, is_past * _BEYOND)
    mouth = np.where(at_end & (label == 0), np.abs(phi), -far_distance)
    shift = _surface_shift(mesh, phi, at_end, tree, distance_to)
    phi = snap_to_vertices(mesh, phi + shift)
    near_edge = near_edges(mesh, phi, shift)
    if surface.faces is not None:
        near_edge &= _is_cut_on_surface(mesh, phi, near_edge, tree)
    for k, front in enumerate(fronts):
        psi[k] = _shifted_psi(mesh, phi, psi[k], part[k], near_edge, front, band)
    tip_cells = tuple(
        _front_cells(mesh, phi, *of_front, near_edge) for of_front in zip(psi, part, strict=True)
    )
    if surface.faces is not None:
        _check_front_cells(fronts, tip_cells)
    x_front = np.array([front.x[0] for front in fronts_of_crack]).reshape(-1, mesh.dim)
    return LevelSet(lock(phi), lock(psi), tip_cells, lock(x_front), lock(mouth), lock(near_edge))


def _check_front_cells(fronts: list[Front], tip_cells: tuple[Ints, ...]) -> None:
    """Raise where cells do not tell a front from a face of its own crack."""
    for front, cells in zip(fronts, tip_cells, strict=True):
        if not len(cells):
            raise CoarseMeshError(
                f"the front at {at(front.x[len(front.x) // 2])} ends before a face of its own "
                "crack, closer than a cell: refine the mesh there, or end the crack before."
            )


def with_far_sides(mesh: Mesh, crack: Crack, levels: "LevelSet", reach: float) -> "LevelSet":
    """Level sets of a placed 3D crack on which others end: phi has its sign everywhere.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
    levels : LevelSet
        As of `surface_levels`, where phi has a sign only up to some cells beyond the reach.
    reach : float, length
    """
    size = _largest_cells(mesh, crack)
    band = reach + 2 * size
    far_points = np.nonzero(np.abs(levels.phi) >= band * (1 - 1e-9))[0]
    if not len(far_points):
        return levels
    surface = extended_surface(crack, mesh, band + size)
    distance = signed_in(triangle_tree(surface.points, surface.triangles), mesh.points[far_points])[
        0
    ]
    phi = np.array(levels.phi)
    phi[far_points] = np.copysign(phi[far_points], distance)
    return replace(levels, phi=lock(phi))


def _largest_cells(mesh: Mesh, crack: Crack) -> float:
    """Largest cell that the surface runs through, length."""
    nearest_cells = mesh.cell_tree.query(crack.points[crack.faces].mean(axis=1))[1]
    return float(mesh.cell_size[nearest_cells].max())


def front_up_to_walls(front: Front, mesh: Mesh) -> Front:
    """A front up to the first vertices outside the body; its frames there are those of its sides.

    Parameters
    ----------
    front : Front
    mesh : Mesh

    Returns
    -------
    Front
    """
    if front.is_closed:
        return front
    inner_points = np.nonzero(contains(mesh, front.x))[0]
    first, stop = part_inside(front.x, inner_points, partial(contains, mesh))
    x, frame = front.x[first:stop], np.array(front.frame[first:stop])
    for end, tangent in ((0, x[1] - x[0]), (-1, x[-1] - x[-2])):
        normal = unit(frame[end, 1] - (frame[end, 1] @ tangent) * tangent / (tangent @ tangent))
        frame[end] = np.stack([np.cross(normal, unit(tangent)), normal, unit(tangent)])
    s = front.s[first:stop] - front.s[first]
    return Front(lock(x), lock(frame), False, lock(s), lock(front.number[first:stop]))


def runs_on(front: Front, next_front: Front, cell: float) -> bool:
    """Whether another front begins straight ahead of the end of a front, or within a cell of it.

    Parameters
    ----------
    front, next_front : Front
        Open, up to the walls: what is drawn between them in a hole does not matter.
    cell : float, length
    """
    way = next_front.x[0] - front.x[-1]
    gap = float(np.linalg.norm(way))
    return gap < _RUNS_ON * cell or bool(way @ front.frame[-1, 2] > _STRAIGHT_ON * gap)


def _fronts_led_on(fronts: list[Front], mesh: Mesh) -> list[Front]:
    """Fronts that at a hole, behind which another goes on, end where they come through its wall.

    What is drawn farther in the hole is no part of the body and must not matter. From the first
    vertex outside they are led straight on by a cell, but at most half the way to the other front:
    points beside the wall, past the last vertex, see the front as it comes through. Vertices that
    are led on have the number -1.
    """
    if sum(not front.is_closed for front in fronts) < 2:
        return fronts
    parts = [front_up_to_walls(front, mesh) for front in fronts]
    result = []
    for k, (front, part) in enumerate(zip(fronts, parts, strict=True)):
        open_fronts = (
            [] if front.is_closed else [f for f in parts[:k] + parts[k + 1 :] if not f.is_closed]
        )
        x, frame, number = front.x, np.array(front.frame), front.number
        for end, sign in ((0, -1.0), (-1, 1.0)):
            size = float(mesh.cell_size[mesh.cell_tree.query(part.x[end])[1]])
            pairs = [
                (part, next_front) if end else (next_front, part) for next_front in open_fronts
            ]
            gaps = [
                float(np.linalg.norm(a.x[-1] - b.x[0])) for a, b in pairs if runs_on(a, b, size)
            ]
            if not gaps:
                continue
            at_wall = int(np.nonzero(number == part.number[end])[0][0])
            rows = slice(at_wall + 1) if end else slice(at_wall, None)
            x, frame, number = x[rows], frame[rows], number[rows]
            frame[end] = part.frame[end]
            new_place = x[end] + sign * min(size, min(gaps) / 2) * frame[end, 2]
            place = len(x) if end else 0
            x, number = np.insert(x, place, new_place, axis=0), np.insert(number, place, -1)
            frame = np.insert(frame, place, frame[end], axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
        result.append(Front(lock(x), lock(frame), front.is_closed, lock(s), lock(number)))
    return result


def _front_distance(
    points: Floats,
    phi: Floats,
    is_ahead: Bools,
    front: Front,
    band: float,
    far_distance: float,
) -> tuple[Floats, Bools]:
    """Distance to a front along the surface, positive ahead; which points lie past its ends."""
    r, segment, position = front_distance(points, front.x, front.is_closed, band)
    has_segment = segment >= 0
    psi = np.where(is_ahead, far_distance, -far_distance)
    rows = np.nonzero(has_segment)[0]
    root = np.sqrt(np.maximum((r[rows] - np.abs(phi[rows])) * (r[rows] + np.abs(phi[rows])), 0.0))
    psi[rows] = np.where(is_ahead[rows], root, -root)
    flat_rows = rows[root < _FLAT * r[rows]]
    foot, direction = _foot(front, segment[flat_rows], position[flat_rows])
    psi[flat_rows] = np.einsum("qd,qd->q", points[flat_rows] - foot, direction)
    led_on = front.number < 0
    return psi, (led_on[0] & (segment == 0)) | (led_on[-1] & (segment == len(front.x) - 2))


def _shifted_psi(
    mesh: Mesh,
    phi: Floats,
    psi: Floats,
    part: Ints,
    near_edge: Bools,
    front: Front,
    band: float,
) -> Floats:
    """Shift psi so that the front that the cells see is the given one in the mean.

    In a cell the front is straight: a curved one would lose the slivers between chords and arc,
    1 % of the radius of a penny of five cells. The loss is measured at the middle of each chord.
    """
    cells = _front_cells(mesh, phi, psi, part, near_edge)
    middle, length = _chords(mesh, phi, psi, cells)
    if not len(middle):
        return psi
    _, segment, position = front_distance(middle, front.x, front.is_closed)
    foot, direction = _foot(front, segment, position)
    offset = np.einsum("qd,qd->q", middle - foot, direction)
    if np.abs(offset).max() < _STRAIGHT * mesh.cell_size[cells].mean():
        return psi
    rows = np.nonzero(np.abs(psi) < 2 * band)[0]
    distance, nearest_chords = cKDTree(middle).query(mesh.points[rows], k=min(_CHORDS, len(middle)))
    distance, nearest_chords = (a.reshape(len(rows), -1) for a in (distance, nearest_chords))
    # Chords beside a bend must not move the straight part next to it.
    excess = (distance**2 - distance[:, :1] ** 2) / mesh.cell_size[cells].mean() ** 2
    share = length[nearest_chords] * np.exp(-np.minimum(excess, 50.0))
    shifted = psi.copy()
    shifted[rows] += (share * offset[nearest_chords]).sum(axis=1) / share.sum(axis=1)
    return shifted


def _distance_to_faces_first(
    surface: ExtendedSurface, tree: TriangleTree, x: Floats, band: float, size: float
) -> tuple[Floats, Ints, Bools]:
    """Distances as of `signed_in`, where faces of the crack come before its prolongations.

    A prolongation that runs along, behind or through other faces of the same crack is none there:
    what is within a cell of these is theirs.
    """
    phi, triangle, at_end = signed_in(tree, x, band)
    if surface.faces is None:
        return phi, triangle, at_end
    rows = np.nonzero(triangle >= len(surface.faces.corners))[0]
    distance, face, at_rim = signed_in(surface.faces, x[rows], size)
    way = np.linalg.norm(x[rows] - surface.base[triangle[rows]], axis=1)
    is_first = (face >= 0) & ~at_rim & (np.abs(distance) < _NEARER * way)
    rows = rows[is_first]
    phi[rows], triangle[rows], at_end[rows] = distance[is_first], face[is_first], False
    return phi, triangle, at_end


def _is_cut_on_surface(mesh: Mesh, phi: Floats, near_edge: Bools, tree: TriangleTree) -> Bools:
    """Edges on which phi is not zero away from the surface and its prolongation `(e,)`.

    Between a front and a face of the same crack less than two cells before it, phi is the distance
    to one of them at one end of an edge, and to the other at the other: its zero is no crack.
    """
    result = np.ones(len(mesh.edges), dtype=bool)
    a, b = phi[mesh.edges].T
    rows = np.nonzero(near_edge & (a * b < 0))[0]
    t = (a[rows] / (a[rows] - b[rows]))[:, None]
    start, stop = mesh.points[mesh.edges[rows]].transpose(1, 0, 2)
    largest_offset = _OFF_SURFACE * mesh.edge_length[rows]
    distance = closest_in(tree, (1 - t) * start + t * stop, float(largest_offset.max(initial=0.0)))
    result[rows] = (distance.triangle >= 0) & (distance.distance <= largest_offset)
    return result


def _surface_shift(
    mesh: Mesh,
    phi: Floats,
    at_end: Bools,
    tree: TriangleTree,
    distance_to: Callable[[Floats, float], tuple[Floats, Ints, Bools]],
) -> Floats:
    """What to add to phi so that it is the distance in the mean square over the cut cells `(n,)`.

    In a cell the surface is flat: interpolated, all pieces of a curved one lie on its hollow side,
    by a twelfth of h² over the radius, and are turned at the front, beyond which the surface goes
    on straight. K, which is taken around the true front, was 3 % off on a cap with 2.5 cells in
    the radius of its rim. In the mean the best linear function in cells lies on the surface.

    Parameters
    ----------
    mesh : Mesh
    phi : (n,) array, length
        Distance to the surface and its prolongation.
    at_end : (n,) array of bool
        Points beyond its ends, where no cell is cut.
    tree : TriangleTree
        The surface and its prolongation.
    distance_to : callable
        Distances of points to it, up to a reach.
    """
    shift = np.zeros(mesh.n_points)
    phi_min, phi_max = _bounds(mesh, phi)
    cells = np.nonzero((phi_min < 0) & (phi_max > 0) & ~(_bounds(mesh, at_end)[1] > 0))[0]
    height = (tree.corners - tree.corners[0, 0]) @ tree.normal[0]
    if np.ptp(height) < _STRAIGHT * mesh.cell_size[cells].min(initial=np.inf):
        return shift  # a plane: phi is linear
    bary, weight = simplex_rule(3, 2)
    x = np.einsum("pv,cvd->cpd", bary, mesh.points[mesh.cells[cells]]).reshape(-1, 3)
    distances = distance_to(x, np.inf)
    distance, _, is_beyond = (a.reshape(len(cells), len(weight)) for a in distances)
    error = distance - phi[mesh.cells[cells]] @ bary.T
    size = mesh.cell_size[cells]
    of_crack = (np.abs(error).max(axis=1) < _NO_CUT * size) & ~is_beyond.any(axis=1)
    cells, error, size = cells[of_crack], error[of_crack], size[of_crack]
    if np.abs(error).max(initial=0.0) < _STRAIGHT * size.min(initial=np.inf):
        return shift
    nodes, volume = mesh.cells[cells], mesh.volume[cells]
    load = np.einsum("c,p,pi,cp->ci", volume, weight, bary, error).ravel()
    nodal_volume = np.bincount(nodes.ravel(), np.repeat(volume / 4, 4), mesh.n_points)
    nodal_volume[nodal_volume == 0] = 1.0
    # Of the mass matrix over its lumped one all eigenvalues lie between a fifth and one.
    for _ in range(_PASSES):
        product = (volume / 20)[:, None] * (shift[nodes] + shift[nodes].sum(axis=1, keepdims=True))
        shift += (
            1.25 * np.bincount(nodes.ravel(), load - product.ravel(), mesh.n_points) / nodal_volume
        )
    return shift


def _bounds(mesh: Mesh, values: Floats | Bools | Ints) -> tuple[Floats, Floats]:
    """Smallest and largest value at the corners of each cell; along rows of four is slow."""
    corners = np.ascontiguousarray(values[mesh.cells].T)
    return corners.min(axis=0), corners.max(axis=0)


def _chords(mesh: Mesh, phi: Floats, psi: Floats, cells: Ints) -> tuple[Floats, Floats]:
    """Middle and length of the line phi = psi = 0 in cells that have one."""
    ends = []
    for facet in local_facets(3):
        corner = mesh.cells[cells][:, facet]
        system = np.stack([phi[corner], psi[corner], np.ones(corner.shape)], axis=1)
        size = np.abs(system).max(axis=2, keepdims=True)
        system = system / np.maximum(size, 1e-300)
        is_regular = np.abs(np.linalg.det(system)) > 1e-12
        bary = np.full(corner.shape, np.nan)
        rhs = np.zeros((int(is_regular.sum()), 3, 1))
        rhs[:, 2] = 1.0
        bary[is_regular] = np.linalg.solve(system[is_regular], rhs)[..., 0]
        hit = bary.min(axis=1) > -_AT
        x = np.einsum("kv,kvd->kd", bary, mesh.points[corner])
        ends.append(np.where(hit[:, None], x, np.nan))
    points = np.stack(ends, axis=1)
    hits = ~np.isnan(points[:, :, 0])
    crossed_twice = np.nonzero(hits.sum(axis=1) == 2)[0]
    pair = points[crossed_twice][hits[crossed_twice]].reshape(-1, 2, 3)
    length = np.linalg.norm(pair[:, 1] - pair[:, 0], axis=1)
    return pair.mean(axis=1)[length > 0], length[length > 0]


def _foot(front: Front, segment: Ints, position: Floats) -> tuple[Floats, Floats]:
    """Points on a front and the directions ahead of it there."""
    t = position[:, None]
    next_vertex = (segment + 1) % len(front.x)
    foot = (1 - t) * front.x[segment] + t * front.x[next_vertex]
    direction = (1 - t) * front.frame[segment, 0] + t * front.frame[next_vertex, 0]
    return foot, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _front_cells(mesh: Mesh, phi: Floats, psi: Floats, part: Ints, near_edge: Bools) -> Ints:
    """Cells whose closed set meets phi = psi = 0, by the points of which the front is the nearest.

    What lies ahead of another front says nothing of this one, and cells all past an end have none.
    """
    phi_min, phi_max = _bounds(mesh, phi)
    is_beside = _bounds(mesh, part)[0] == 0
    rows = np.nonzero((phi_min <= 0) & (phi_max >= 0) & is_beside)[0]
    edge = mesh.cell_to_edge[rows]
    a, b = mesh.edges[edge, 0], mesh.edges[edge, 1]
    is_crossed = phi[a] * phi[b] < 0
    is_close = (near_edge[edge] | ~is_crossed).all(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = phi[a] / (phi[a] - phi[b])
        at_edge = np.where(is_crossed, (1 - t) * psi[a] + t * psi[b], np.nan)
    at_edge = np.where((part[a] == _OTHER) | (part[b] == _OTHER), np.nan, at_edge)
    corner = mesh.cells[rows]
    at_corner = np.where((phi[corner] == 0) & (part[corner] != _OTHER), psi[corner], np.nan)
    levels = np.concatenate([at_edge, at_corner], axis=1)
    levels = np.where(np.abs(levels) < _AT * mesh.cell_size[rows][:, None], 0.0, levels)
    psi_min = np.where(np.isnan(levels), np.inf, levels).min(axis=1)
    psi_max = np.where(np.isnan(levels), -np.inf, levels).max(axis=1)
    return rows[is_close & (psi_min <= 0) & (psi_max >= 0)]


__all__ = []
