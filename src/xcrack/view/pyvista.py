"""Pictures by pyvista, on screen or off."""

import contextlib
import functools
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.optional import in_notebook, require_package
from xcrack.base.paths import written_whole
from xcrack.output.curved_sides import shading_normals
from xcrack.view.figures import picture_of
from xcrack.view.scene_2d import CLOSED, Scene
from xcrack.view.scene_3d import SpaceScene
from xcrack.view.section_3d import TriangleSoup, segments_behind

RASTER = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
_PROBE = (
    "import pyvista as pv; p = pv.Plotter(off_screen=True, window_size=(64, 64));"
    "p.add_mesh(pv.Sphere()); image = p.screenshot(None, return_img=True);"
    "raise SystemExit(0 if image.std() > 0 else 1)"
)
LONGER = 1100  # pixels of the longer side of the body
SHORTEST = 480  # pixels that a colour bar needs
BAR = 300  # pixels beside the body for the colour bar
MARGIN = 50


@functools.cache
def can_render() -> bool:
    """Whether pyvista can draw here; asked once, of another process.

    A missing driver may end a process without an exception.
    """
    try:
        run = subprocess.run(
            [sys.executable, "-c", _PROBE], capture_output=True, timeout=60, check=False
        )
    except (subprocess.TimeoutExpired, OSError):
        return False
    return run.returncode == 0


def draw(
    picture: Scene, file: Path | None, show: bool, title: str | None, edges: bool, cmap: str
) -> Any:
    """Draw a scene; returns the plotter where there is no file."""
    pv = require_package("pyvista", 'plot(renderer="pyvista")')
    x_min, x_max = picture.box
    size = x_max - x_min
    scale = LONGER / float(size.max())
    top = 70 if title else 0
    width = int(size[0] * scale) + 2 * MARGIN + BAR
    height = max(int(size[1] * scale) + 2 * MARGIN, SHORTEST) + top
    with quiet_vtk():
        plotter = pv.Plotter(off_screen=not show, window_size=[width, height])
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        _add_body(pv, plotter, picture, cmap, (width, height))
        _add_lines(pv, plotter, picture, edges, 1e-4 * float(size.max()))
        _add_title(plotter, title, (width, height))
        plotter.view_xy()
        camera = plotter.camera
        camera.parallel_projection = True
        # The body fills the window but for the bar on the right and the title above.
        x = x_min[0] + (width / 2 - MARGIN) / scale
        y = (x_min[1] + x_max[1]) / 2 + top / 2 / scale
        far_distance = float(size.max())
        camera.focal_point, camera.position = (x, y, 0.0), (x, y, far_distance)
        camera.parallel_scale = height / 2 / scale
        camera.clipping_range = (0.5 * far_distance, 1.5 * far_distance)
        return show_or_save(plotter, file, show)


def _add_title(plotter: Any, title: str | None, window: tuple[int, int]) -> None:
    """A title, if there is one, at the top left of a window of a width and height."""
    if title:
        width, height = window
        plotter.add_text(
            title,
            position=(MARGIN / width, 1 - 50 / height),
            viewport=True,
            font_size=font_size(26),
            color="black",
        )


def _add_body(pv: Any, plotter: Any, picture: Scene, cmap: str, window: tuple[int, int]) -> None:
    body = pv.PolyData.from_regular_faces(_raised_lines(picture.points, 0.0), picture.triangles)
    body.point_data["values"] = picture.values
    actor = plotter.add_mesh(
        body,
        scalars="values",
        cmap=cmap,
        clim=picture.limits,
        lighting=False,
        interpolate_before_map=True,
        show_scalar_bar=False,
    )
    width, height = window
    add_bar(plotter, actor, picture.label, picture.limits, window)
    if len(picture.closed_lips):
        plotter.add_text(
            "crack faces touch",
            position=(1 - BAR / width, 30 / height),
            viewport=True,
            font_size=font_size(24),
            color=CLOSED,
        )


def show_or_save(plotter: Any, file: Path | None, show: bool) -> Any:
    """Open the window, save the picture, or both: the file, or the plotter without one."""
    if file is None and in_notebook():
        return picture_of(plotter)
    if file is None:
        if show:
            plotter.show(auto_close=False)
        return plotter
    if show:
        plotter.show(screenshot=str(file))
        return file
    try:
        pixels = plotter.screenshot(None, return_img=True)
    finally:
        plotter.close()
    image = require_package("PIL.Image", "plot")
    content = BytesIO()  # writers of pictures may keep to themselves that the disk is full
    image.fromarray(pixels).save(content, image.registered_extensions()[file.suffix.lower()])
    with written_whole(file, "the picture cannot be written to", error=ProblemError) as part:
        part.write_bytes(content.getvalue())
    return file


def add_bar(
    plotter: Any,
    actor: Any,
    label: str,
    limits: tuple[float, float],
    window: tuple[int, int],
    bottom: float = 0.1,
    top: int = 0,
) -> None:
    """Colour bar on the right of the window, from a share of its height on, less pixels above."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    width, height = window
    title = label.replace(", ", "\n")
    bar = plotter.add_scalar_bar(
        title=title,
        mapper=actor.mapper,
        vertical=True,
        width=(BAR - 60) / width,
        height=min(0.8, 1 - top / height) - bottom,
        position_x=1 - (BAR - 20) / width,
        position_y=bottom,
        color="black",
        title_font_size=26,
        label_font_size=24,
        unconstrained_font_size=True,
        fmt="%.4g",
    )
    bar.SetBarRatio(0.17)
    bar.SetVerticalTitleSeparation(18)
    bar.SetUseCustomLabels(True)
    bar.SetCustomLabels(numpy_to_vtk(_ticks(*limits), deep=True))


def _add_lines(pv: Any, plotter: Any, picture: Scene, edges: bool, step: float) -> None:
    lines = [
        (picture.at_rest, "#9a9a9a", 1.5, -1),
        (picture.cell_edges if edges else picture.cell_edges[:0], "#303030", 1.0, 1),
        (picture.interfaces, "#404040", 1.8, 1.5),
        (picture.outline, "black", 2.5, 2),
        (picture.lips, "black", 2.5, 2),
        (picture.closed_lips, CLOSED, 5.0, 3),
    ]
    for curves, color, width, level in lines:
        if len(curves):
            line = _polylines(pv, curves, level * step)
            plotter.add_mesh(line, color=color, line_width=width, lighting=False)


def _ticks(x_min: float, x_max: float) -> Floats:
    """Round numbers from x_min to x_max: steps of 1, 2 or 5 times a power of ten.

    >>> _ticks(-0.3, 1.0).round(3).tolist()
    [-0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    """
    raw_step = (x_max - x_min) / 7
    unit = 10.0 ** np.floor(np.log10(raw_step))
    step = unit * next(k for k in (1, 2, 5, 10) if k * unit >= raw_step * (1 - 1e-9))
    first_tick, last_tick = np.ceil(x_min / step - 1e-9), np.floor(x_max / step + 1e-9)
    return np.asarray(step * np.arange(first_tick, last_tick + 1) + 0.0)  # + 0.0: no "-0"


@contextlib.contextmanager
def quiet_vtk() -> Iterator[None]:
    """Without VTK's remark that it found no display and draws without one."""
    from vtkmodules.vtkCommonCore import vtkLogger

    earlier_cutoff = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(earlier_cutoff)


def font_size(pixels: int) -> int:
    """Font size of `add_text` for a height in pixels."""
    return max(pixels // 2, 6)


def _raised_lines(x: Floats, z: float) -> Floats:
    return np.concatenate([x, np.full((len(x), 1), z)], axis=1)


def _polylines(pv: Any, curves: Floats, z: float) -> Any:
    k = curves.shape[1]
    number = np.arange(len(curves) * k).reshape(-1, k)
    lines: Ints = np.concatenate([np.full((len(curves), 1), k), number], axis=1)
    return pv.PolyData(_raised_lines(curves.reshape(-1, 2), z), lines=lines.ravel())


# --- pictures of 3D bodies by pyvista, on screen or off ---


_APART = "#c9ccd1"  # lips that do not touch, where the pressure is drawn
_TRIAD = 130  # pixels of the axes
_LEGEND = 28  # pixels of a line of the legend
_LOADS = "#1b4f9c"
_FRONT, _JUNCTION = "#d95f02", "#7b3294"


def draw_space(
    picture: SpaceScene,
    arrows: tuple[Floats, Floats] | None,
    file: Path | None,
    show: bool,
    title: str | None,
    edges: bool,
    cmap: str,
) -> Any:
    """Draw a scene; returns the plotter where there is no file."""
    pv = require_package("pyvista", 'plot(renderer="pyvista")')
    right_axis, up, viewer = _axes(picture.view_direction)
    box = picture.box if arrows is None else picture.body
    if arrows is not None:
        box = np.concatenate([box, arrows[0], arrows[0] + arrows[1]])
    corners_in_view = box @ np.stack([right_axis, up, viewer], axis=1)
    x_min, x_max = corners_in_view.min(axis=0), corners_in_view.max(axis=0)
    size = x_max - x_min
    extent = float(size[:2].max())
    scale = LONGER / extent
    if float((picture.body @ right_axis).max()) > x_max[0]:
        # What lies beyond the box would be drawn under the bar of the colours.
        picture = _left_of(picture, right_axis, float(x_max[0]) + MARGIN / scale)
    top = 70 if title else 0
    bar = BAR if picture.label or _legend(picture) else _TRIAD
    width = max(int(size[0] * scale) + 2 * MARGIN, SHORTEST) + bar
    height = max(int(size[1] * scale) + 2 * MARGIN, SHORTEST) + top
    with quiet_vtk():
        plotter = pv.Plotter(off_screen=not show, window_size=[width, height])
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        if len(picture.skin):
            # See-through surfaces have to be sorted by depth, or they hide each other.
            plotter.enable_depth_peeling(10)
        _add_faces(pv, plotter, picture, cmap, (width, height), top + _TRIAD)
        _add_space_lines(pv, plotter, picture, edges, viewer * 2e-3 * extent)
        _add_points(plotter, picture, viewer * 3e-3 * extent)
        if arrows is not None:
            _add_arrows(pv, plotter, arrows)
        _add_legend(plotter, picture, (width, height))
        _add_title(plotter, title, (width, height))
        camera = plotter.camera
        camera.parallel_projection = True
        # The body fills the window but for the bar on the right and the title above.
        x = (x_min[0] + x_max[0]) / 2 + bar / 2 / scale
        y = (x_min[1] + x_max[1]) / 2 + top / 2 / scale
        # From close by, too, the whole body lies before the camera.
        depth = picture.body @ viewer
        far_distance = extent + float(depth.max() - depth.min())
        middle = x * right_axis + y * up + (depth.min() + depth.max()) / 2 * viewer
        camera.focal_point, camera.position = tuple(middle), tuple(middle + far_distance * viewer)
        camera.up = tuple(up)
        camera.parallel_scale = height / 2 / scale
        camera.clipping_range = (0.01 * far_distance, 2.5 * far_distance)
        corner = (1 - _TRIAD / width, 1 - (top + _TRIAD) / height, 1.0, 1 - top / height)
        plotter.add_axes(viewport=corner, line_width=3)  # beside the body, above the bar
        return show_or_save(plotter, file, show)


def _axes(viewer: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors right, up (along z if that can be seen) and towards the viewer."""
    world_up = np.array([0.0, 0.0, 1.0] if abs(viewer[2]) < 0.98 else [0.0, 1.0, 0.0])
    right_axis = np.cross(world_up, viewer)
    right_axis /= np.linalg.norm(right_axis)
    return right_axis, np.cross(viewer, right_axis), viewer


def _left_of(picture: SpaceScene, right_axis: Floats, limit: float) -> SpaceScene:
    """A picture without what lies beyond a limit on the right."""

    def cut(corners: Floats, values: Floats | None = None) -> tuple[Floats, Floats]:
        k, v = corners.shape[:2]
        number = np.arange(k * v).reshape(k, v)
        x = corners.reshape(-1, 3)
        level = x @ right_axis - limit
        parts = (
            [TriangleSoup.of(number, None).part_behind(level)]
            if v > 2
            else segments_behind(number, level)
        )
        data = np.zeros(k * v) if values is None else values.ravel()
        return (
            np.concatenate([part.at(x) for part in parts]),
            np.concatenate([part.at(data[:, None])[..., 0] for part in parts]),
        )

    names = (
        "closed_faces",
        "open_faces",
        "skin",
        "outline",
        "cell_edges",
        "faint_lines",
        "rims",
        "fronts",
        "junctions",
    )
    other_parts: dict[str, Any] = {name: cut(getattr(picture, name))[0] for name in names}
    triangles, values = cut(picture.triangles, picture.values)
    return replace(picture, triangles=triangles, values=values, **other_parts)


def _add_faces(
    pv: Any, plotter: Any, picture: SpaceScene, cmap: str, window: tuple[int, int], top: int
) -> None:
    if picture.label:
        body = _surface(pv, picture.triangles)
        if len(picture.triangles):
            body.point_data.active_normals = shading_normals(picture.triangles).reshape(-1, 3)
            body.point_data["values"] = picture.values.ravel()
        else:  # all lips are apart, or all touch: the bar still says which field it is
            body = pv.PolyData(np.zeros((1, 3)))
            body.point_data["values"] = [picture.limits[0]]
        actor = plotter.add_mesh(
            body,
            scalars="values",
            cmap=cmap,
            clim=picture.limits,
            interpolate_before_map=True,
            show_scalar_bar=False,
            point_size=0.001,
            **_LIGHT,
        )
        actor.prop.interpolation = "phong"
        bottom = max(0.1, (_LEGEND * (len(_legend(picture)) + 1.2)) / window[1])
        add_bar(plotter, actor, picture.label, picture.limits, window, bottom, top)
    for corners, color in ((picture.closed_faces, CLOSED), (picture.open_faces, _APART)):
        if len(corners):
            plotter.add_mesh(_surface(pv, corners), color=color, **_LIGHT)
    if len(picture.skin):
        plotter.add_mesh(_surface(pv, picture.skin), color="#8fa3b8", opacity=0.13, lighting=False)


# Enough shade to tell the faces, not so much that colours leave the bar.
_LIGHT = {"ambient": 0.55, "diffuse": 0.5, "specular": 0.0}


def _add_space_lines(pv: Any, plotter: Any, picture: SpaceScene, edges: bool, step: Floats) -> None:
    nothing = picture.cell_edges[:0]
    lines = [
        (picture.faint_lines, "#a5a9ae", 1.5, 0),
        (picture.cell_edges if edges else nothing, "#303030", 1.0, 1),
        (picture.outline, "#404040" if len(picture.skin) else "black", 2.0, 1.5),
        (picture.rims, "black", 2.5, 2),
        (picture.junctions, _JUNCTION, 6.0, 3),
        (picture.fronts, _FRONT, 6.0, 3),
    ]
    for segments, color, width, level in lines:
        if len(segments):
            number = np.arange(2 * len(segments)).reshape(-1, 2)
            cells = np.concatenate([np.full((len(segments), 1), 2), number], axis=1)
            line = pv.PolyData(segments.reshape(-1, 3) + level * step, lines=cells.ravel())
            plotter.add_mesh(line, color=color, line_width=width, lighting=False)


def _add_points(plotter: Any, picture: SpaceScene, step: Floats) -> None:
    for x, color, size in ((picture.heaviside, "#1f77b4", 18), (picture.tip, "#ff7f0e", 11)):
        if len(x):
            plotter.add_points(x + step, color=color, point_size=size, lighting=False)


def _add_arrows(pv: Any, plotter: Any, arrows: tuple[Floats, Floats]) -> None:
    start, vector = arrows
    longest_arrow = float(np.linalg.norm(vector, axis=1).max(initial=0.0))
    parts = []
    for x, v in zip(start, vector, strict=True):
        length = float(np.linalg.norm(v))
        # Arrows of all lengths are as thick as each other.
        parts.append(
            pv.Arrow(
                start=x,
                direction=v,
                scale=length,
                tip_length=min(0.35 * longest_arrow / length, 0.8),
                tip_radius=0.11 * longest_arrow / length,
                shaft_radius=0.04 * longest_arrow / length,
            )
        )
    if parts:
        plotter.add_mesh(pv.merge(parts), color=_LOADS, **_LIGHT)


def _legend(picture: SpaceScene) -> list[tuple[str, str]]:
    """Words of the legend and their colours."""
    crack = "crack" if len(picture.heaviside) else "crack faces touch"
    entries = [
        (len(picture.closed_faces), crack, CLOSED),
        (len(picture.open_faces), "crack faces apart", "#8d9299"),
        (len(picture.fronts), "front", _FRONT),
        (len(picture.junctions), "junction", _JUNCTION),
        (len(picture.heaviside), "Heaviside", "#1f77b4"),
        (len(picture.tip), "tip functions", "#ff7f0e"),
    ]
    return [(text, color) for count, text, color in entries if count]


def _add_legend(plotter: Any, picture: SpaceScene, window: tuple[int, int]) -> None:
    width, height = window
    for k, (text, color) in enumerate(reversed(_legend(picture))):
        plotter.add_text(
            text,
            position=(1 - BAR / width, (14 + k * _LEGEND) / height),
            viewport=True,
            font_size=font_size(24),
            color=color,
        )


def _surface(pv: Any, corners: Floats) -> Any:
    number = np.arange(3 * len(corners)).reshape(-1, 3)
    return pv.PolyData.from_regular_faces(corners.reshape(-1, 3), number)


__all__ = ["draw_space"]
