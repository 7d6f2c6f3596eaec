"""3D cracks by matplotlib, where no renderer is: maps in the plane of each crack."""

from pathlib import Path
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.output.lip_faces_3d import LipFaces, junction_lines, lip_faces
from xcrack.view.figures import finish_figure, new_figure
from xcrack.view.projection import Projection, best_plane, on_plane
from xcrack.view.scene_2d import CLOSED, rounded_range
from xcrack.view.scene_3d import LIP_FIELDS, is_coloured, lip_values

_SIZE = 5.0  # inch, longer side of a map
_DPI = 180
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
    planes = [best_plane(each.points, each.normal.mean(axis=0)) for each in lips]
    spans = [
        np.ptp(on_plane(each.points, plane), axis=0)
        for each, plane in zip(lips, planes, strict=True)
    ]
    height = sum(max(1.7, min(1.0, span[1] / span[0]) * _SIZE) + 0.9 for span in spans)
    size = (_SIZE + 1.6, height + (0.4 if title else 0.0))
    figure = new_figure(size, show, "plot")
    every = figure.subplots(len(cracks), 1, squeeze=False)[:, 0]
    values = np.concatenate([lip_values(each, field).ravel() for each in lips])
    low, high = rounded_range(float(values.min()), float(values.max()), field)
    if limits is not None:
        low, high = limits
    colours = cmap or ("RdBu_r" if low < 0 < high else "viridis")
    for axes, each, plane, c in zip(every, lips, planes, cracks, strict=True):
        meets = junction_lines(solution, c)
        _map(figure, axes, each, meets, plane, field, (low, high), colours)
        if len(solution.lips) > 1:
            axes.set_title(f"crack {c}", fontsize="medium", loc="left")
    if title:
        figure.suptitle(title)
    return finish_figure(figure, file, show, _DPI)


def _map(
    figure: Any,
    axes: Any,
    lips: LipFaces,
    meets: list[tuple[LipFaces, Ints]],
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
    mapped = axes.tripcolor(
        *corners.T,
        np.arange(len(corners)).reshape(-1, 3),
        np.einsum("pwv,tv->tpw", part, values).ravel(),
        shading="gouraud",
        cmap=cmap,
        vmin=limits[0],
        vmax=limits[1],
        rasterized=True,
    )
    marked = ~is_coloured(lips, field)
    color, label = (
        ("#c9ccd1", "crack faces apart") if field == "pressure" else (CLOSED, "crack faces touch")
    )
    if marked.any():
        parts: list[Floats] = list(x[lips.triangles[marked]])
        axes.add_collection(
            PolyCollection(parts, facecolors=color, edgecolors=color, linewidths=0.3)
        )
        axes.plot([], [], "s", color=color, label=label)
    junction = [on_plane(other.points, plane)[edges] for other, edges in meets]
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
    figure.colorbar(mapped, ax=axes, label=LIP_FIELDS[field], shrink=0.9, aspect=18)


def _parts(n: int) -> Floats:
    """Barycentric vertices of the n² equal parts of a triangle `(n², 3, 3)`."""
    parts = []
    for i in range(n):
        for j in range(n - i):
            parts.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < n - 1:
                parts.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    two = np.array(parts) / n
    return np.concatenate([two, 1 - two.sum(axis=2, keepdims=True)], axis=2)


__all__ = ["draw_cracks"]
