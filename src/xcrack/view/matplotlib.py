"""Pictures by matplotlib: fields without a renderer, meshes, graphs, 3D cracks in their planes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.fem.facets import arc_position
from xcrack.output.curved_sides import boundary_lines
from xcrack.output.lip_faces_3d import LipFaces, junction_lines, lip_faces
from xcrack.output.pieces import lips_of
from xcrack.view.figures import finish_figure, new_figure
from xcrack.view.projection import Projection, best_plane, on_plane
from xcrack.view.scene_2d import CLOSED, Scene, rounded_range
from xcrack.view.scene_3d import LIP_FIELDS, is_coloured, lip_values

_LONGER = 6.4  # inch, longer side of the body
_DPI = 180


def draw(
    picture: Scene, file: Path | None, show: bool, title: str | None, edges: bool, cmap: str
) -> Any:
    """Draw a scene; returns the figure where there is no file."""
    figure, axes = _body_axes(picture.box, show, bar=1.5)
    from matplotlib.collections import LineCollection

    artist = axes.tripcolor(
        *picture.points.T,
        picture.triangles,
        picture.values,
        shading="gouraud",
        cmap=cmap,
        vmin=picture.limits[0],
        vmax=picture.limits[1],
        rasterized=True,
    )
    lines = [
        (picture.at_rest, "0.6", 0.6, 0.5),
        (picture.cell_edges if edges else picture.cell_edges[:0], "0.2", 0.25, 2),
        (picture.interfaces, "0.25", 0.7, 2.5),
        (picture.outline, "black", 0.9, 3),
        (picture.lips, "black", 0.9, 3),
        (picture.closed_lips, CLOSED, 2.2, 4),
    ]
    for curves, color, width, level in lines:
        axes.add_collection(
            LineCollection(
                list(curves), colors=color, linewidths=width, zorder=level, capstyle="round"
            )
        )
    _frame(axes, picture.box)
    if len(picture.closed_lips):
        axes.plot([], [], color=CLOSED, lw=2.2, label="crack faces touch")
        _legend_below(axes, 1)
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max"}
    figure.colorbar(
        artist,
        ax=axes,
        label=picture.label,
        extend=extend.get(picture.is_beyond, "both"),
        shrink=0.9,
        aspect=25,
    )
    return _finish(figure, axes, file, show, title)


def draw_mesh(
    solution: Solution,
    file: Path | None,
    show: bool,
    title: str | None,
    near_box: Floats | None = None,
) -> Any:
    """Mesh, cracks and enriched nodes, of the whole body or in a box `near_box` (2, 2)."""
    space = solution.space
    mesh = space.mesh
    box = mesh.points if near_box is None else near_box
    figure, axes = _body_axes(box, show, bar=0.4)
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    _fill_by_material(axes, solution)
    axes.add_collection(
        LineCollection(
            list(mesh.points[mesh.facets[mesh.facet_to_cell[:, 1] >= 0]]),
            colors="0.72",
            linewidths=0.4,
        )
    )
    rim = boundary_lines(mesh)
    axes.add_collection(LineCollection(list(rim), colors="black", linewidths=0.9))
    has_jump = [number >= 0 for number in space.heaviside]
    if has_jump:
        x = space.node_points[np.any(has_jump, axis=0)]
        axes.plot(*x.T, "s", ms=3.2, mfc="none", mec="C0", mew=0.8, label="Heaviside", zorder=3)
    has_tip = [tip.point_to_function >= 0 for tip in space.tips]
    if has_tip:
        x = mesh.points[np.any(has_tip, axis=0)]
        axes.plot(*x.T, "o", ms=4.6, mfc="none", mec="C1", mew=0.8, label="tip functions", zorder=3)
    for c, cut in enumerate(space.cuts):
        axes.add_collection(
            LineCollection(list(cut.lip_points(mesh)), colors=CLOSED, linewidths=1.8, zorder=4)
        )
        if c == 0:
            axes.plot([], [], color=CLOSED, lw=1.8, label="crack")
    for tip in space.tips:
        axes.plot(*tip.x, "x", ms=6, mew=1.6, color=CLOSED, zorder=5)
        if np.isfinite(tip.radius):
            circle = Circle(tuple(tip.x), tip.radius, fill=False, ls="--", lw=0.8, ec="C1")
            axes.add_patch(circle)
    _frame(axes, box)
    if space.cuts or solution.problem.elasticity.named[0][0]:
        _legend_below(axes, 3)
    return _finish(figure, axes, file, show, title)


def _fill_by_material(axes: Any, solution: Solution) -> None:
    """Cells in a light colour by material, where there are several."""
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection

    elasticity, mesh = solution.problem.elasticity, solution.space.mesh
    for k, (name, _) in enumerate(elasticity.named if len(elasticity.set_number) else ()):
        color = (*colormaps["Pastel1"](k % 9)[:3], 1.0)
        shapes = mesh.points[mesh.cells[elasticity.set_number == k]]
        axes.add_collection(PolyCollection(list(shapes), facecolors=[color], zorder=0.5))
        axes.plot([], [], "s", color=color, label=name)


def draw_along(
    solution: Solution,
    field: str,
    cracks: Sequence[int],
    file: Path | None,
    show: bool,
    title: str | None,
) -> Any:
    """Pressure or opening over the distance along each crack."""
    figure = new_figure((6.4, 0.6 + 3.0 * len(cracks)), show, "plot")
    panels = figure.subplots(len(cracks), 1, squeeze=False)[:, 0]
    for axes, c in zip(panels, cracks, strict=True):
        _draw_along(axes, solution, field, c)
        name = f"crack {c}: " if len(solution.lips) > 1 else ""
        axes.set_xlabel(f"{name}distance s along the crack")
    return _finish(figure, panels[0], file, show, title)


def _draw_along(axes: Any, solution: Solution, field: str, c: int) -> None:
    space, lips = solution.space, lips_of(solution, c)
    cut, crack = space.cuts[c], space.cracks[c]
    ends = arc_position(crack.points, cut.lip_points(space.mesh).reshape(-1, space.dim))
    start = float(ends.min()) if len(ends) else 0.0
    s = lips.s
    if field == "pressure":
        curves = [("contact pressure p", lips.pressure, "C0", "-")]
    else:
        tangents = np.stack([lips.normal[:, 1], -lips.normal[:, 0]], axis=1)
        slip = np.einsum("qd,qd->q", lips.jump, tangents)
        curves = [
            ("opening n·⟦u⟧", np.einsum("qd,qd->q", lips.jump, lips.normal), "C0", "-"),
            ("sliding t·⟦u⟧", slip, "C1", "--"),
        ]
    for label, values, color, style in curves:
        for i, run in enumerate(lips.runs):
            name = label if i == 0 else None
            axes.plot(s[run], values[run], style, color=color, lw=1.6, label=name)
    first = True
    for a, b in _closed_parts(lips.is_closed, s):
        axes.axvspan(
            a, b, color=CLOSED, alpha=0.12, lw=0, label="crack faces touch" if first else None
        )
        first = False
    for x in crack.points[list(crack.tips or ())]:
        at = float(arc_position(crack.points, x[None])[0]) - start
        axes.axvline(at, color="0.3", lw=0.8, ls=":")
        axes.annotate(
            "tip",
            (at, 1),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            fontsize="small",
            color="0.3",
        )
    axes.axhline(0, color="0.6", lw=0.7, zorder=0)
    if field == "pressure":
        _from_zero(axes, lips.pressure)
    if field == "pressure" and solution.contact[c] is None:
        note = (
            "no multipliers: the crack faces stay apart"
            if solution.problem.contact != "off"
            else ("contact is switched off")
        )
        axes.annotate(note, (0.02, 0.5), xycoords="axes fraction", fontsize="small", color="0.3")
    axes.set_ylabel("pressure" if field == "pressure" else "jump of the displacement")
    axes.margins(x=0.01)
    axes.legend(fontsize="small", loc="best")


def _closed_parts(is_closed: np.ndarray, s: Floats) -> list[tuple[float, float]]:
    """Stretches of s on which the crack faces touch, up to half way to the next open point."""
    change = np.diff(np.concatenate([[0], is_closed.astype(np.int64), [0]]))
    begin, end = np.nonzero(change > 0)[0], np.nonzero(change < 0)[0] - 1
    middle = np.concatenate([s[:1], (s[1:] + s[:-1]) / 2, s[-1:]])
    return [(float(middle[a]), float(middle[b + 1])) for a, b in zip(begin, end, strict=True)]


def _from_zero(axes: Any, values: Floats) -> None:
    """A range that begins at zero: noise of a constant pressure should not fill the picture."""
    top = float(np.max(values, initial=0.0))
    bottom = float(np.min(values, initial=0.0))
    reach = max(top, -bottom) or 1.0
    axes.set_ylim(bottom - 0.05 * reach if bottom < -1e-6 * reach else -0.03 * reach, 1.12 * reach)


def _body_axes(points: Floats, show: bool, bar: float) -> tuple[Any, Any]:
    x_min, x_max = points.min(axis=0), points.max(axis=0)
    size = _LONGER * (x_max - x_min) / float((x_max - x_min).max())
    size = (max(size[0], 2.0) + 0.6 + bar, max(size[1], 2.4) + 0.7)
    figure = new_figure(size, show, "plot")
    return figure, figure.add_subplot()


def _frame(axes: Any, points: Floats) -> None:
    x_min, x_max = points.min(axis=0), points.max(axis=0)
    margin = 0.02 * float((x_max - x_min).max())
    axes.set(
        xlim=(x_min[0] - margin, x_max[0] + margin),
        ylim=(x_min[1] - margin, x_max[1] + margin),
        xlabel="x",
        ylabel="y",
    )
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(False)


def _legend_below(axes: Any, columns: int) -> None:
    axes.figure.legend(loc="outside lower center", ncols=columns, fontsize="small", frameon=False)


def _finish(figure: Any, axes: Any, file: Path | None, show: bool, title: str | None) -> Any:
    if title:
        axes.set_title(title)
    return finish_figure(figure, file, show, _DPI)


# --- 3D cracks by matplotlib, where no renderer is: maps in the plane of each crack ---


_SIZE = 5.0  # inch, longer side of a map
_DPI_OF_FRONTS = 180
_FINER = 5  # parts of each side of a triangle


def draw_cracks(
    solution: Solution,
    field: str,
    cracks: list[int],
    file: Path | None,
    show: bool,
    title: str | None,
    limits: tuple[float, float] | None,
    cmap: str | None,
) -> Any:
    """Draw a field on cracks, each seen along its mean normal."""
    lips = [lip_faces(solution, c) for c in cracks]
    planes = [best_plane(lip.points, lip.normal.mean(axis=0)) for lip in lips]
    spans = [
        np.ptp(on_plane(lip.points, plane), axis=0) for lip, plane in zip(lips, planes, strict=True)
    ]
    height = sum(max(1.7, min(1.0, span[1] / span[0]) * _SIZE) + 0.9 for span in spans)
    size = (_SIZE + 1.6, height + (0.4 if title else 0.0))
    figure = new_figure(size, show, "plot")
    panels = figure.subplots(len(cracks), 1, squeeze=False)[:, 0]
    values = np.concatenate([lip_values(lip, field).ravel() for lip in lips])
    v_min, v_max = rounded_range(float(values.min()), float(values.max()), field)
    if limits is not None:
        v_min, v_max = limits
    colours = cmap or ("RdBu_r" if v_min < 0 < v_max else "viridis")
    for axes, lip, plane, c in zip(panels, lips, planes, cracks, strict=True):
        junctions = junction_lines(solution, c)
        _map(figure, axes, lip, junctions, plane, field, (v_min, v_max), colours)
        if len(solution.lips) > 1:
            axes.set_title(f"crack {c}", fontsize="medium", loc="left")
    if title:
        figure.suptitle(title)
    return finish_figure(figure, file, show, _DPI_OF_FRONTS)


def _map(
    figure: Any,
    axes: Any,
    lips: LipFaces,
    junctions: list[tuple[LipFaces, Ints]],
    plane: Projection,
    field: str,
    limits: tuple[float, float],
    cmap: str,
) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    x = on_plane(lips.points, plane)
    values = lip_values(lips, field)
    # Shading mixes colours, not values: in small triangles that is nearly the same.
    part = _parts(_FINER)
    corners = np.einsum("pwv,tvd->tpwd", part, x[lips.triangles]).reshape(-1, 2)
    artist = axes.tripcolor(
        *corners.T,
        np.arange(len(corners)).reshape(-1, 3),
        np.einsum("pwv,tv->tpw", part, values).ravel(),
        shading="gouraud",
        cmap=cmap,
        vmin=limits[0],
        vmax=limits[1],
        rasterized=True,
    )
    is_marked = ~is_coloured(lips, field)
    color, label = (
        ("#c9ccd1", "crack faces apart") if field == "pressure" else (CLOSED, "crack faces touch")
    )
    if is_marked.any():
        parts: list[Floats] = list(x[lips.triangles[is_marked]])
        axes.add_collection(
            PolyCollection(parts, facecolors=color, edgecolors=color, linewidths=0.3)
        )
        axes.plot([], [], "s", color=color, label=label)
    junction = [on_plane(lip.points, plane)[edges] for lip, edges in junctions]
    for segments, line, width, name in (
        (x[lips.mouth], "black", 1.2, "mouth"),
        (np.concatenate([np.zeros((0, 2, 2)), *junction]), "#7b3294", 1.8, "junction"),
        (x[lips.front], "#d95f02", 1.8, "front"),
    ):
        if len(segments):
            axes.add_collection(LineCollection(list(segments), colors=line, linewidths=width))
            axes.plot([], [], color=line, lw=width, label=name)
    axes.set_aspect("equal")
    axes.set(xlabel=plane.label(0), ylabel=plane.label(1))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        fontsize="small", frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4
    )
    figure.colorbar(artist, ax=axes, label=LIP_FIELDS[field], shrink=0.9, aspect=18)


def _parts(n: int) -> Floats:
    """Barycentric vertices of the n² equal parts of a triangle `(n², 3, 3)`."""
    parts = []
    for i in range(n):
        for j in range(n - i):
            parts.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < n - 1:
                parts.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    bary = np.array(parts) / n
    return np.concatenate([bary, 1 - bary.sum(axis=2, keepdims=True)], axis=2)


__all__ = ["draw_cracks"]
