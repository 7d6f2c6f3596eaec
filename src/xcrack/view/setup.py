"""A picture of a problem before it is solved: body, sets, loads, supports, cracks and normals."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from xcrack.base.arguments import FileName
from xcrack.base.arrays import Floats, Ints
from xcrack.base.markup import rim
from xcrack.mesh.locate import points_at
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import FacetPoints, Load
from xcrack.model.problem import Problem
from xcrack.output.curved_sides import boundary_lines
from xcrack.view.figures import finish_figure, new_figure, picture_path

_ARROW = 0.12  # share of the body of the longest arrow
_MANY = 9  # arrows, and marks of a support, on a set
_SMALL = 0.25  # share of the body up to which a set has one arrow, its resultant
_EDGE = np.cos(np.deg2rad(25.0))  # between the normals of two facets beside an edge that is drawn
_VIEW = {"elev": 24.0, "azim": -58.0}
_LOAD, _SUPPORT, _CRACK = "#1b4f9c", "#2a7d2a", "#d6006c"


def draw_setup(problem: Problem, file: FileName | None, title: str | None) -> Any:
    """Figure of a problem; saved, shown, or handed to a notebook.

    Nothing is solved. Loads that act everywhere are named in the legend.
    """
    target = picture_path(file, "Problem.plot")
    mesh = problem.mesh
    figure = new_figure(_size(mesh), target is None, "Problem.plot")
    if mesh.dim == 2:
        axes = figure.add_subplot()
    else:
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        axes.view_init(**_VIEW)
    _draw_body(axes, mesh)
    _draw_loads(axes, problem)
    _draw_supports(axes, problem)
    _draw_cracks(axes, problem)
    _name_sets(axes, problem)
    if title:
        axes.set_title(title)
    figure.legend(loc="outside lower center", ncols=2, fontsize="small", frameon=False)
    finish_figure(figure, target, target is None)
    return figure


def _size(mesh: Mesh) -> tuple[float, float]:
    if mesh.dim == 3:
        return 7.5, 6.2
    extent = np.ptp(mesh.points, axis=0)
    width, height = 6.0 * extent / extent.max()
    return max(float(width), 5.6) + 1.4, max(float(height), 2.4) + 1.6


def _draw_body(axes: Any, mesh: Mesh) -> None:
    lines = boundary_lines(mesh) if mesh.dim == 2 else _edges(mesh)
    axes.add_collection(_lines(lines, "black", 1.0, mesh.dim))
    x_min, x_max = mesh.points.min(axis=0), mesh.points.max(axis=0)
    margin = (1.5 * _ARROW if mesh.dim == 2 else 0.5 * _ARROW) * mesh.extent
    names = "xyz"[: mesh.dim]
    axes.set(**{f"{name}lim": (a - margin, b + margin) for name, a, b in zip(names, x_min, x_max)},
             **{f"{name}label": name for name in names})  # fmt: skip
    if mesh.dim == 2:
        axes.set_aspect("equal")
        axes.spines[["top", "right"]].set_visible(False)
    else:
        axes.set_box_aspect(x_max - x_min + 2 * margin)
        axes.grid(False)


def _lines(segments: Floats, colour: str, width: float, dim: int, order: int = 2) -> Any:
    if dim == 2:
        from matplotlib.collections import LineCollection

        return LineCollection(list(segments), colors=colour, linewidths=width, zorder=order)
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    return Line3DCollection(list(segments), colors=colour, linewidths=width, zorder=order)


def _edges(mesh: Mesh) -> Floats:
    """Edges of a body in space at which its sides bend `(k, 2, 3)`."""
    facets = mesh.boundary
    first_side, second_side = (
        mesh.points[facets[:, k]] - mesh.points[facets[:, 0]] for k in (1, 2)
    )
    normal = np.cross(first_side, second_side)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    pairs = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]), 1)
    order = np.lexsort(pairs.T)
    owner = np.tile(np.arange(len(facets)), 3)[order].reshape(-1, 2)  # each edge has two facets
    is_bent = np.abs((normal[owner[:, 0]] * normal[owner[:, 1]]).sum(axis=1)) < _EDGE
    return np.asarray(mesh.points[pairs[order][::2][is_bent]])


# Loads.


def _draw_loads(axes: Any, problem: Problem) -> None:
    mesh = problem.mesh
    for load in problem.loads:
        rows = list(_arrows_of(load, mesh)) if isinstance(load, Load) else []
        arrows = [(x, v) for x, v in rows if np.linalg.norm(v) > 0]
        _entry(axes, mesh.dim, load.name, _LOAD, ">" if arrows else "none")
        if not arrows:
            continue
        x, v = (np.array(part) for part in zip(*arrows, strict=True))
        size = np.linalg.norm(v, axis=1)
        v = v * (_ARROW * mesh.extent / size.max())
        is_outward = _leaves(mesh, x, v)
        start = np.where(is_outward[:, None], x, x - v)
        if mesh.dim == 2:
            axes.quiver(*start.T, *v.T, color=_LOAD, angles="xy", scale_units="xy", scale=1,
                        width=0.006, zorder=5)  # fmt: skip
        else:
            axes.quiver(*start.T, *v.T, color=_LOAD, arrow_length_ratio=0.3, lw=1.5, zorder=5)


def _leaves(mesh: Mesh, x: Floats, v: Floats) -> np.ndarray:
    """Whether an arrow points away from the middle of the body: then it begins on the side."""
    middle = (mesh.points.min(axis=0) + mesh.points.max(axis=0)) / 2
    return np.einsum("kd,kd->k", v, x - middle) >= 0


def _arrows_of(load: Load, mesh: Mesh) -> Iterator[tuple[Floats, Floats]]:
    """Places and vectors of a load; of a small set one, its resultant."""
    if "point_force" in load.acts:
        cell, bary, force = load.point_forces(mesh)
        x = points_at(mesh, cell, bary)
        yield from zip(x, force, strict=True)
    if "traction" not in load.acts:
        return
    facets = mesh.facet_sets[load.where]
    x, normal, weight = _sides(mesh, facets)
    middle = weight @ x / weight.sum()
    if load.has_one_arrow:
        yield middle, np.zeros(mesh.dim) if load.force is None else np.asarray(load.force)
        return
    t = load.traction(FacetPoints(mesh, facets, x, normal, weight))
    if np.ptp(x, axis=0).max() < _SMALL * mesh.extent and abs(weight @ t).max() > 1e-6 * (
        weight @ abs(t)
    ).max(initial=0.0):
        yield middle, weight @ t
        return
    yield from ((x[k], t[k]) for k in _spread(x, _MANY))


def _sides(mesh: Mesh, facets: Ints) -> tuple[Floats, Floats, Floats]:
    """Middles, normals out of the body, and sizes of facets of the boundary."""
    x = mesh.points[facets]
    if mesh.dim == 2:
        way = x[:, 1] - x[:, 0]
        normal = np.stack([way[:, 1], -way[:, 0]], axis=1)
    else:
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
    key = {tuple(f): i for i, f in enumerate(np.sort(mesh.facets, axis=1).tolist())}
    number = np.array([key[tuple(f)] for f in np.sort(facets, axis=1).tolist()], dtype=np.int64)
    cell_middle = mesh.points[mesh.cells[mesh.facet_to_cell[number, 0]]].mean(axis=1)
    middle = x.mean(axis=1)
    normal = normal * np.sign(np.einsum("kd,kd->k", normal, middle - cell_middle))[:, None]
    size = np.linalg.norm(normal, axis=1)
    return middle, normal / size[:, None], size


def _spread(x: Floats, n: int) -> Ints:
    """Up to n points, each far from those before it."""
    rows = [int(np.argmin(x @ np.linspace(1.0, 0.9, x.shape[1])))]
    distance = np.linalg.norm(x - x[rows[0]], axis=1)
    while len(rows) < min(n, len(x)):
        rows.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(x - x[rows[-1]], axis=1))
    return np.array(rows)


# Supports, cracks, sets.


def _draw_supports(axes: Any, problem: Problem) -> None:
    mesh = problem.mesh
    for support in problem.supports:
        if isinstance(support.place, str):
            x = _sides(mesh, mesh.facet_sets[support.place])[0]
            x = x[_spread(x, _MANY)]
        else:
            x = np.atleast_2d(np.asarray(support.place, dtype=float))
        marker = "^" if support.holds else "D"
        axes.plot(*x.T, marker, color=_SUPPORT, ms=6, zorder=6, label=support.name)


def _draw_cracks(axes: Any, problem: Problem) -> None:
    dim = problem.mesh.dim
    cracks = problem.cracks
    placed_cracks = problem.__dict__.get("placed", cracks)
    length = 0.5 * _ARROW * problem.mesh.extent
    for c, crack in enumerate(cracks):
        if dim == 3:
            from mpl_toolkits.mplot3d.art3d import Poly3DCollection

            axes.add_collection3d(
                Poly3DCollection(crack.points[crack.faces], facecolor=_CRACK, alpha=0.25, zorder=3)
            )
        axes.add_collection(_lines(rim(crack.points, crack.faces), _CRACK, 2.2, dim, 4))
        corner = crack.points[crack.faces]
        normal, middle = _middle_normal(corner)
        v = length * normal
        if dim == 2:
            axes.quiver(*middle, *v, color=_CRACK, angles="xy", scale_units="xy", scale=1,
                        width=0.004, zorder=5)  # fmt: skip
        else:
            axes.quiver(*middle, *v, color=_CRACK, arrow_length_ratio=0.3, lw=1.2, zorder=5)
        axes.text(*(middle + 1.25 * v), f"{c}", color=_CRACK, fontsize="small", zorder=7)
        tips = placed_cracks[c].tips if dim == 2 else None
        ends = [] if tips is None else placed_cracks[c].points[list(tips)]
        if len(ends):
            axes.plot(*np.transpose(ends), "x", color=_CRACK, ms=7, mew=1.8, zorder=6)
    if len(cracks):
        words = "cracks with their normal (- to + face)"
        words += "; x: tips" if dim == 2 else ""
        _entry(axes, dim, words, _CRACK, "_")


def _middle_normal(corner: Floats) -> tuple[Floats, Floats]:
    """Unit normal and place of the face in the middle of a crack."""
    middle = corner.mean(axis=1)
    k = int(np.argmin(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    if corner.shape[2] == 2:
        way = corner[k, 1] - corner[k, 0]
        normal = np.array([-way[1], way[0]])
    else:
        normal = np.cross(corner[k, 1] - corner[k, 0], corner[k, 2] - corner[k, 0])
    return normal / max(float(np.linalg.norm(normal)), 1e-300), middle[k]


def _name_sets(axes: Any, problem: Problem) -> None:
    """Names of the facet sets, beside them and off the body where it is flat."""
    mesh = problem.mesh
    loaded_places = {load.place for load in problem.loads if isinstance(load.place, str)}
    for name, facets in mesh.facet_sets.items():
        if len(facets) in (0, len(mesh.boundary)):
            continue
        x, normal, _ = _sides(mesh, facets)
        k = int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1)))
        offset = 1.15 * _ARROW if name in loaded_places and mesh.dim == 2 else 0.035
        offset = min(offset * mesh.extent, 0.35 * float(np.ptp(x, axis=0).max()) or np.inf)
        place = x[k] + offset * normal[k]
        middle = {"ha": "center", "va": "center"}
        if mesh.dim == 2:
            sideways, up = normal[k]
            middle = {"ha": "left" if sideways > 0.5 else "right" if sideways < -0.5 else "center",
                      "va": "bottom" if up > 0.5 else "top" if up < -0.5 else "center"}  # fmt: skip
        axes.text(*place, name, fontsize="small", color="0.35", zorder=7, **middle)


def _entry(axes: Any, dim: int, words: str, colour: str, marker: str) -> None:
    """An entry of the legend."""
    nothing: list[list[float]] = [[]] * dim
    axes.plot(*nothing, color=colour, marker=marker, ls="none", label=words)


__all__ = ["draw_setup"]
