"""What a picture of a 3D body shows, as arrays: triangles, lines, colours and arrows."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.mesh.locate import points_at
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import FacetPoints
from xcrack.output.curved_sides import CurvedSides
from xcrack.output.lip_faces_3d import LipFaces, junction_lines, lip_faces
from xcrack.output.pieces import pieces
from xcrack.view.scene_2d import (
    STRESSES,
    clipped_range,
    field_values,
    label_of,
    rounded_range,
)
from xcrack.view.section_3d import (
    Faces,
    Plane,
    TriangleSoup,
    areas,
    boundary_edges,
    crossing,
    edges_of,
    faces,
    levels,
    on_facets,
    section,
    segments_behind,
)

LIP_FIELDS = {
    "pressure": "contact pressure",
    "opening": "normal opening",
    "gap": "normal opening",
    "sliding": "sliding of the crack faces",
}
_CLOSE = 0.3  # share of the body below which a crack is looked at from close by
_AROUND = 0.25  # share of its size that is seen around it
_TOUCH = 0.5  # share of a triangle on which the lips touch that counts as closed


@dataclass(frozen=True, eq=False)
class SpaceScene:
    """A field on a 3D body, or on its cracks, ready to draw.

    Attributes
    ----------
    triangles : (t, 3, 3) array, length
        Coloured ones: surface of the body, its section and its faces; or the cracks.
    values : (t, 3) array
    label : str
        What the colour bar says; empty where nothing is coloured by a field.
    limits : (float, float)
        Ends of the colours.
    has_sign : bool
        The field has a sign: its colours part at zero.
    closed_faces, open_faces : (k, 3, 3) arrays, length
        Triangles of a crack that are not coloured: its faces touch there, or do not.
    skin : (s, 3, 3) array, length
        Surface of a body that is seen through.
    outline, cell_edges, faint_lines, rims, fronts, junctions : (k, 2, 3) arrays, length
        Lines: sharp edges of the body and its section, edges of cells, what is only hinted at
        (the body that has not moved, the edges of cells behind the rest), edges of the crack faces,
        fronts, and where cracks end on others.
    view_direction : (3,) array
        Unit vector from the body to the viewer.
    heaviside, tip : (k, 3) arrays, length
        Points that carry these functions.
    focus_points : (k, 3) array, length, optional
        Points that have to be in the picture instead of the whole body.
    """

    triangles: Floats
    values: Floats
    label: str
    limits: tuple[float, float]
    has_sign: bool
    closed_faces: Floats
    open_faces: Floats
    skin: Floats
    outline: Floats
    cell_edges: Floats
    faint_lines: Floats
    rims: Floats
    fronts: Floats
    junctions: Floats
    view_direction: Floats
    heaviside: Floats
    tip: Floats
    focus_points: Floats | None = None

    @property
    def box(self) -> Floats:
        """Points that have to be in the picture `(k, 3)`, length: a small crack fills it."""
        if self.focus_points is not None:
            return self.focus_points
        body = self.body
        if not len(self.skin) or len(self.heaviside):
            return body
        parts = (self.triangles, self.closed_faces, self.open_faces)
        x = np.concatenate([part.reshape(-1, 3) for part in parts])
        x_min, x_max = x.min(axis=0), x.max(axis=0)
        size = float((x_max - x_min).max())
        if size > _CLOSE * float(np.ptp(body, axis=0).max()):
            return body
        ends = np.stack([x_min - _AROUND * size, x_max + _AROUND * size])
        return np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)

    @property
    def body(self) -> Floats:
        """Points of all that is drawn `(k, 3)`, length."""
        parts = (self.triangles, self.closed_faces, self.skin, self.outline, self.faint_lines)
        return np.concatenate([part.reshape(-1, 3) for part in parts])


def clip_plane(value: Any, label: str = "clip", error: type[XcrackError] = ProblemError) -> Plane:
    """Point and unit normal of a plane, checked."""
    try:
        point, normal = value
        x, n = numbers(point, "point", (3,)), numbers(normal, "normal", (3,))
        length = float(np.linalg.norm(n))
        if 0 < length < np.inf:
            return x, n / length
        reason = "the normal has no direction"
    except (TypeError, ValueError):
        reason = "that is no pair"
    except ProblemError as cause:
        reason = str(cause)[:-1]
    raise error(
        f"{label} = {value_text(value)}: give a point and a normal, ((x, y, z), (nx, ny, nz)); "
        f"what lies on the side of the normal is left out. Here {reason}."
    )


def space_scene(
    solution: Solution,
    field: str,
    warp: float,
    limits: tuple[float, float] | None,
    plane: Plane | None,
    view: Floats | None,
) -> SpaceScene:
    """Field on the moved body: its surface, and with a plane its section, crack faces behind."""
    body = pieces(solution)
    shown_values = field_values(body, field)
    curved_sides = CurvedSides.of(solution.space.mesh)
    on = faces(body, curved_sides)
    at_rest = body.points
    if (
        curved_sides is not None
    ):  # nodes between corners, so that a section ends where the shell does
        at_rest = at_rest.copy()
        number, first = np.unique(on.shell, return_index=True)
        facet = _on_curve(curved_sides, on)
        at_rest[number] = curved_sides.project(at_rest[number], facet[first])
    level = levels(at_rest, plane)
    parts = [TriangleSoup.of(on.shell, None, on.of_shell).part_behind(level)]
    parts.append(TriangleSoup.of(on.lip).part_behind(level))
    lines = [
        segments_behind(on.outline, level, on.of_outline),
        segments_behind(on.rims, level),
        segments_behind(on.cell_edges, level, on.of_cell_edges),
    ]
    if plane is not None:
        parts.append(section(body, level))
        lines[0] += crossing(on.shell, level, on.of_shell)
        lines[1] += crossing(on.lip, level)
        lines[2] += crossing(on_facets(body, level), level)
    point_data = np.concatenate([body.displacement, shown_values[:, None]], axis=1)

    def place_part(part: TriangleSoup) -> tuple[Floats, Floats, Floats]:
        """Corners at rest, moved ones, and values there."""
        x, data = part.at(at_rest), part.at(point_data)
        if curved_sides is not None:
            x, data = _curved_parts(curved_sides, on, part, x, data)
        return x, x + warp * data[..., :3], data[..., 3]

    _, corners, values = (np.concatenate(arrays) for arrays in zip(*map(place_part, parts)))
    if not len(corners):
        raise ProblemError("plot(clip=...): the plane leaves nothing of the body; turn its normal.")
    share = 100.0
    v_min, v_max = float(values.min()), float(values.max())
    if field in STRESSES and solution.space.tips:
        v_min, v_max, share = clipped_range(values, areas(corners))
    v_min, v_max = rounded_range(v_min, v_max, field) if limits is None else limits
    clip = limits is None and share < 100
    nothing = np.zeros((0, 3, 3))
    curves = [
        np.concatenate([place_part(part)[1] for part in group] or [np.zeros((0, 2, 3))])
        for group in lines
    ]
    outline_rest = np.concatenate([place_part(part)[0] for part in lines[0]])
    return SpaceScene(
        triangles=corners,
        values=values,
        label=label_of(body, field) + (f", clipped at {int(10 * share) / 10:g} %" if clip else ""),
        limits=(v_min, v_max),
        has_sign=v_min < 0 < v_max,
        closed_faces=nothing,
        open_faces=nothing,
        skin=nothing,
        outline=curves[0],
        cell_edges=curves[2],
        faint_lines=outline_rest if warp else np.zeros((0, 2, 3)),
        rims=curves[1],
        fronts=_front_lines(solution, warp, plane)[: None if plane is not None else 0],
        junctions=_junction_lines(solution, warp, plane)[: None if plane is not None else 0],
        view_direction=_viewing_direction(plane, view, None),
        heaviside=np.zeros((0, 3)),
        tip=np.zeros((0, 3)),
    )


def _curved_parts(
    curved_sides: CurvedSides, on: Faces, part: TriangleSoup, x: Floats, data: Floats
) -> tuple[Floats, Floats]:
    """Segments and triangles of a part that follow the curves on which they lie, or end."""
    if x.shape[1] == 2 or part.number.shape[1] > 3:
        return curved_sides.bend(x, part.facet, data)[:2]
    is_flat = (part.facet < 0) | (curved_sides.facet_to_curve[part.facet] < 0)
    is_whole = is_flat & (part.share == np.eye(3)).all(axis=(1, 2))  # not cut by the plane
    edges = curved_sides.facets_of_edges(part.number[is_whole], on.cell_edges, on.of_cell_edges)
    edge_values = curved_sides.bend_edges(x[is_whole], edges, data[is_whole])
    rest = curved_sides.bend(x[~is_whole], part.facet[~is_whole], data[~is_whole])
    return np.concatenate([edge_values[0], rest[0]]), np.concatenate([edge_values[1], rest[1]])


def _on_curve(curved_sides: CurvedSides, on: Faces) -> Ints:
    """For each point of the shell, in the order of its triangles, a facet that has it.

    A curved one where there is one.
    """
    facet = np.repeat(on.of_shell, 3)
    number = on.shell.ravel()
    order = np.argsort(curved_sides.facet_to_curve[facet] < 0, kind="stable")
    point_facet = np.full(int(number.max(initial=-1)) + 1, -1)
    point_facet[number[order[::-1]]] = facet[order[::-1]]
    return np.asarray(point_facet[number])


def crack_scene(
    solution: Solution,
    field: str,
    cracks: list[int],
    warp: float,
    limits: tuple[float, float] | None,
    plane: Plane | None,
    view: Floats | None,
) -> SpaceScene:
    """Field on cracks, in a body that is seen through."""
    lips = [lip_faces(solution, c) for c in cracks]
    corners = np.concatenate([_middle_of_lips(lip, warp)[lip.triangles] for lip in lips])
    values = np.concatenate([lip_values(lip, field) for lip in lips])
    is_in_colour = np.concatenate([is_coloured(lip, field) for lip in lips])
    nothing = np.zeros((0, 3, 3))
    v_min, v_max = (0.0, 1.0)
    if is_in_colour.any():
        v_min, v_max = float(values[is_in_colour].min()), float(values[is_in_colour].max())
    # Gaps are closed in the mean of a cell only: near contact some points lie a bit too deep.
    if field != "pressure" and v_min > -0.3 * v_max:
        v_min = 0.0
    if field == "pressure":
        v_min = min(v_min, 0.0)
    v_min, v_max = rounded_range(v_min, v_max, field) if limits is None else limits
    return replace(
        _seen_through(solution, warp, plane),
        triangles=corners[is_in_colour],
        values=values[is_in_colour],
        label=LIP_FIELDS[field],
        limits=(v_min, v_max),
        has_sign=v_min < 0 < v_max,
        closed_faces=nothing if field == "pressure" else corners[~is_in_colour],
        open_faces=corners[~is_in_colour] if field == "pressure" else nothing,
        rims=np.concatenate([_middle_of_lips(lip, warp)[lip.mouth] for lip in lips]),
        cell_edges=edges_of(corners),
        view_direction=_viewing_direction(plane, view, lips),
    )


def mesh_scene(solution: Solution, plane: Plane | None, view: Floats | None) -> SpaceScene:
    """Mesh, cracks and enriched points."""
    space = solution.space
    lips = [lip_faces(solution, c) for c in range(len(space.cuts))]
    corners = [lip.points[lip.triangles] for lip in lips]
    lines_through = _seen_through(solution, 0.0, plane, with_cells=True)
    has_jump = np.zeros(space.n_nodes, dtype=bool)
    for number in space.heaviside:
        has_jump |= number >= 0
    has_tip = np.zeros(space.mesh.n_points, dtype=bool)
    for tip in space.tips:
        has_tip |= tip.point_to_function >= 0
    lip_corners = np.concatenate([np.zeros((0, 3, 3)), *corners])
    return replace(
        lines_through,
        closed_faces=lip_corners,
        cell_edges=edges_of(lip_corners),
        view_direction=_viewing_direction(plane, view, lips),
        heaviside=space.node_points[has_jump],
        tip=space.mesh.points[has_tip],
    )


def _seen_through(
    solution: Solution, warp: float, plane: Plane | None, *, with_cells: bool = False
) -> SpaceScene:
    """The body and its fronts without colours, and the edges of its cells where asked for."""
    mesh = solution.space.mesh
    displacement = solution.coefficients[: mesh.n_points]
    curved_sides = CurvedSides.of(mesh)
    level = levels(mesh.points, plane)
    facets, outer_facets = mesh.boundary, np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    edges, facet, is_sharp = boundary_edges(mesh, curved_sides)
    sharp_lines = segments_behind(edges[is_sharp], level, facet[is_sharp])
    if plane is not None:
        sharp_lines += crossing(facets, level, outer_facets)

    def place_part(part: TriangleSoup) -> Floats:
        x, data = part.at(mesh.points), part.at(displacement)
        if curved_sides is not None:
            x, data, _ = curved_sides.bend(x, part.facet, data)
        return x + warp * data

    skin = place_part(TriangleSoup.of(facets, None, outer_facets).part_behind(level))
    faint_lines = [place_part(part) for part in segments_behind(edges, level, facet)]
    no_lines = np.zeros((0, 2, 3))
    outline = np.concatenate([place_part(part) for part in sharp_lines] or [no_lines])
    return SpaceScene(
        triangles=np.zeros((0, 3, 3)),
        values=np.zeros((0, 3)),
        label="",
        limits=(0.0, 1.0),
        has_sign=False,
        closed_faces=np.zeros((0, 3, 3)),
        open_faces=np.zeros((0, 3, 3)),
        skin=skin,
        outline=outline,
        cell_edges=no_lines,
        faint_lines=np.concatenate(faint_lines) if with_cells else no_lines,
        rims=no_lines,
        fronts=_front_lines(solution, warp, None),
        junctions=_junction_lines(solution, warp, None),
        view_direction=np.array([0.0, -1.0, 0.0]),
        heaviside=np.zeros((0, 3)),
        tip=np.zeros((0, 3)),
    )


def lip_values(lips: LipFaces, field: str) -> Floats:
    """Values at the vertices of the triangles of a crack `(t, 3)`."""
    values = lips.gap if field in ("opening", "gap") else getattr(lips, field)
    return np.asarray(values[lips.triangles])


def is_coloured(lips: LipFaces, field: str) -> Bools:
    """Triangles of a crack that show a field `(t,)`; the others touch, or bear no pressure.

    Crack faces that touch slide without friction: sliding is shown everywhere.
    """
    if field == "pressure":
        is_pressed = lips.mean_pressure > 1e-6 * float(lips.mean_pressure.max(initial=0.0))
        return np.asarray(is_pressed | (lips.closed_share >= _TOUCH))
    return np.asarray(lips.closed_share < _TOUCH) | (field == "sliding")


def _middle_of_lips(lips: LipFaces, warp: float) -> Floats:
    return np.asarray(lips.points + warp * (lips.minus + lips.plus) / 2)


def _front_lines(solution: Solution, warp: float, plane: Plane | None) -> Floats:
    all_lips = [lip_faces(solution, c) for c in range(len(solution.lips))]
    return _lines_behind([(lips, lips.front) for lips in all_lips], warp, plane)


def _junction_lines(solution: Solution, warp: float, plane: Plane | None) -> Floats:
    return _lines_behind(junction_lines(solution), warp, plane)


def _lines_behind(edges: list[tuple[LipFaces, Ints]], warp: float, plane: Plane | None) -> Floats:
    """Edges of crack faces as segments `(k, 2, 3)`, as far as they lie behind a plane."""
    parts = [np.zeros((0, 2, 3))]
    for lips, pairs in edges:
        parts_behind = segments_behind(pairs, levels(lips.points, plane))
        parts += [part.at(_middle_of_lips(lips, warp)) for part in parts_behind]
    return np.concatenate(parts)


def _viewing_direction(
    plane: Plane | None, view: Floats | None, lips: list[LipFaces] | None
) -> Floats:
    """From the body to the viewer: what was cut open, or the faces of the crack, is seen."""
    if view is not None:
        return view
    usual_direction = np.array([0.45, -0.75, 0.48])
    if plane is not None:
        direction = plane[1]
    elif lips:
        direction = np.sum(
            [(lip.area[:, None] * _face_normals(lip)).sum(axis=0) for lip in lips], 0
        )
        length = float(np.linalg.norm(direction))
        direction = direction / length if length else usual_direction
        direction = direction if direction @ usual_direction >= 0 else -direction
    else:
        return np.asarray(usual_direction / np.linalg.norm(usual_direction))
    side = usual_direction - 0.999 * (usual_direction @ direction) * direction
    viewing_direction = direction + 0.75 * side / np.linalg.norm(side)
    return np.asarray(viewing_direction / np.linalg.norm(viewing_direction))


def _face_normals(lips: LipFaces) -> Floats:
    normal = lips.normal[lips.triangles].sum(axis=1)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


# Arrows that show the loads of a solution in 3D.

_SMALL = 0.25  # share of the body up to which a loaded set has one arrow, its resultant
_LENGTH = 0.16  # share of the body of the longest arrow
_MANY = 13  # arrows on a large set


def load_arrows(solution: Solution) -> tuple[Floats, Floats]:
    """Arrows of tractions, pressures and point forces: where they begin, and their vectors.

    A small set has one arrow, the resultant; a large one has several, its tractions. The longest
    of each kind have the same length. Those that press on the body end on it.

    Returns
    -------
    start, vector : (k, 3) arrays, length
    """
    mesh = solution.space.mesh
    forces, tractions = [np.zeros((0, 3, 3))], [np.zeros((0, 3, 3))]
    for load, factor in solution.acting:
        sign = np.sign(factor)
        if "point_force" in load.acts:
            cell, bary, force = load.point_forces(mesh)
            x = points_at(mesh, cell, bary)
            rows = [x, sign * force, np.zeros_like(force)]
            forces.append(np.stack(rows, axis=1))
        if "traction" not in load.acts:
            continue
        facets = mesh.facet_sets[load.where]
        x = mesh.points[facets].mean(axis=1)
        area_vectors = _area_vectors(mesh, facets)
        area = np.linalg.norm(area_vectors, axis=1)
        middle = area @ x / area.sum()
        if load.has_one_arrow:
            force = np.zeros(3) if load.force is None else load.force
            forces.append(np.stack([middle, sign * force, np.zeros(3)])[None])
            continue
        outward_normal = area_vectors / area[:, None]
        t = sign * load.traction(FacetPoints(mesh, facets, x, outward_normal, area))
        if np.ptp(x, axis=0).max() < _SMALL * mesh.extent:
            forces.append(np.stack([middle, area @ t, area @ outward_normal])[None])
        else:
            arrow_points = _distant_points(x, _MANY)
            tractions.append(np.stack([x, t, outward_normal], axis=1)[arrow_points])
    start, vector = [], []
    for group in (np.concatenate(forces), np.concatenate(tractions)):
        size = np.linalg.norm(group[:, 1], axis=1)
        is_shown = size > 1e-3 * size.max(initial=0.0)
        x, v, outward_normal = np.swapaxes(group[is_shown], 0, 1)
        v = v * (_LENGTH * mesh.extent / size.max(initial=1e-300))
        is_pressing = np.einsum("kd,kd->k", v, outward_normal) < -1e-6 * np.linalg.norm(v, axis=1)
        start.append(np.where(is_pressing[:, None], x - v, x))
        vector.append(v)
    return np.concatenate(start), np.concatenate(vector)


def _area_vectors(mesh: Mesh, facets: Ints) -> Floats:
    """Area vectors of boundary facets, out of the body `(k, 3)`."""
    x = mesh.points[facets]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
    key = {tuple(f): i for i, f in enumerate(np.sort(mesh.facets, axis=1).tolist())}
    number = np.array([key[tuple(f)] for f in np.sort(facets, axis=1).tolist()], dtype=np.int64)
    cell_middle = mesh.points[mesh.cells[mesh.facet_to_cell[number, 0]]].mean(axis=1)
    sign = np.sign(np.einsum("kd,kd->k", normal, x.mean(axis=1) - cell_middle))
    return np.asarray(sign[:, None] * normal)


def _distant_points(x: Floats, n: int) -> Ints:
    """Up to n points far from each other, by their numbers."""
    rows = [int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1)))]
    distance = np.linalg.norm(x - x[rows[0]], axis=1)
    while len(rows) < min(n, len(x)):
        rows.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(x - x[rows[-1]], axis=1))
    return np.array(rows)


__all__ = [
    "LIP_FIELDS",
    "Plane",
    "SpaceScene",
    "clip_plane",
    "crack_scene",
    "is_coloured",
    "lip_values",
    "load_arrows",
    "mesh_scene",
    "space_scene",
]
