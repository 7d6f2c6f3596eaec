"""Pictures by pyvista, on screen or off."""

import contextlib
import functools
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.optional import in_notebook, require_package
from xcrack.base.paths import written_whole
from xcrack.view.figures import picture_of
from xcrack.view.scene_2d import CLOSED, Scene

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
    low, high = picture.box
    size = high - low
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
        if title:
            plotter.add_text(
                title,
                position=(MARGIN / width, 1 - 50 / height),
                viewport=True,
                font_size=font_size(26),
                color="black",
            )
        plotter.view_xy()
        camera = plotter.camera
        camera.parallel_projection = True
        # The body fills the window but for the bar on the right and the title above.
        x = low[0] + (width / 2 - MARGIN) / scale
        y = (low[1] + high[1]) / 2 + top / 2 / scale
        far_distance = float(size.max())
        camera.focal_point, camera.position = (x, y, 0.0), (x, y, far_distance)
        camera.parallel_scale = height / 2 / scale
        camera.clipping_range = (0.5 * far_distance, 1.5 * far_distance)
        return show_or_save(plotter, file, show)


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


def _ticks(low: float, high: float) -> Floats:
    """Round numbers from low to high: steps of 1, 2 or 5 times a power of ten.

    >>> _ticks(-0.3, 1.0).round(3).tolist()
    [-0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    """
    rough = (high - low) / 7
    unit = 10.0 ** np.floor(np.log10(rough))
    step = unit * next(k for k in (1, 2, 5, 10) if k * unit >= rough * (1 - 1e-9))
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return np.asarray(step * np.arange(first, last + 1) + 0.0)  # + 0.0: no "-0"


@contextlib.contextmanager
def quiet_vtk() -> Iterator[None]:
    """Without VTK's remark that it found no display and draws without one."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)


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
