"""One picture of a solution: a field on the opened crack, the mesh, or a graph along the crack."""

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np

from xcrack.analysis.plan import Report
from xcrack.analysis.solution import Solution
from xcrack.base.arguments import (
    CheckedBy,
    Choice,
    Direction,
    FileName,
    Interval,
    Number,
    Part,
    Switch,
    Text,
    check_arguments,
)
from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.optional import in_notebook, require_package
from xcrack.base.units import LENGTH
from xcrack.fem.system import discretise
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import CrackNumber, Problem, crack_number, scaled_state
from xcrack.view.figures import Title, picture_path
from xcrack.view.pyvista import RASTER
from xcrack.view.scene_2d import FIELDS, SPACE_FIELDS, scene
from xcrack.view.scene_3d import LIP_FIELDS, clip_plane
from xcrack.view.section_3d import Plane

_GRAPHS = ("pressure", "opening")
_ON_LIPS = {*_GRAPHS, *LIP_FIELDS}
_DRAWABLE = 'a Solution, or a Problem with field="mesh"'
_NO_OPENGL = "it cannot draw here (no OpenGL): apt-get install libegl1 libgl1-mesa-dri"


def colour_map(value: Any, label: str, error: type[XcrackError]) -> Any:
    """A colour map of matplotlib, or its name, checked."""
    matplotlib = require_package("matplotlib", "plot: cmap")
    if isinstance(value, str) and value in matplotlib.colormaps:
        return value
    if isinstance(value, require_package("matplotlib.colors", "plot: cmap").Colormap):
        return value
    raise error(
        f"{label} = {value_text(value)}: give the name of a colour map of matplotlib, such as "
        '"RdBu".'
    )


@check_arguments()
def plot(
    solution: Annotated[Solution | Problem, Part((Solution, Problem), _DRAWABLE)],
    field: Annotated[str, Text("the name of a field")] = "von_mises",
    *,
    file: FileName | None = None,
    warp: Annotated[float, Number()] = 0.0,
    show: Switch | None = None,
    renderer: Annotated[str, Choice(("auto", "pyvista", "matplotlib"))] = "auto",
    title: Title = None,
    edges: Switch = False,
    limits: Annotated[tuple[float, float] | None, Interval()] = None,
    cmap: Annotated[Any, CheckedBy(colour_map)] = None,
    crack: CrackNumber | None = None,
    clip: Annotated[tuple[Any, Any] | None, CheckedBy(clip_plane, unit=LENGTH)] = None,
    view: Annotated[Any, Direction("the direction from the body to the viewer, (x, y, z)")] = None,
    loads: Switch = False,
    zoom: Annotated[float | None, Number(above=0)] = None,
) -> Any:
    """Draw a solution, or the mesh and the cracks of a problem.

    Parameters
    ----------
    solution : Solution, or Problem
        A problem has one picture only: the field "mesh".
    field : str
        On the body: "von_mises", "sxx", "syy", "sxy", "displacement" (its norm), "ux", "uy", and
        "material" (which of several). Stresses jump where materials meet.
        Along the crack faces: "pressure" (of contact), "opening" (with the sliding); where the
        crack faces touch the graph is shaded. "mesh": the mesh with its cracks and enriched nodes.
        In 3D also "szz", "syz", "sxz" and "uz"; "pressure", "opening" (or "gap") and "sliding"
        colour the cracks, with their fronts, in a body that is seen through.
    file : path, optional
        Where to save the picture; ``.png`` is added to a path without suffix.
    warp : float
        Displacements are drawn this many times as large as they are; 0: the body at rest.
    show : bool, optional
        Open a window; left out: only without a file, and where there is a display.
    renderer : {"auto", "pyvista", "matplotlib"}
        Of a field on the body. auto: pyvista where it can draw (off screen without a display)
        and knows the kind of file, else matplotlib, which alone draws meshes and graphs.
    title : str, optional
    edges : bool
        Draw the edges of the mesh.
    limits : (float, float), optional
        Ends of the colours. Left out: all values; of a stress, which is unbounded at a tip, those
        of at least 99 % of the area and of all cells without tip functions, and the colour bar
        says what share.
    cmap : str, optional
        Colour map of matplotlib; left out: one that parts at zero for a field of both signs.
    crack : int, optional
        Draw the graphs, or in 3D the colours, of this crack only.
    clip : (point, normal), optional
        In 3D: leave out what lies on the side of the normal of this plane, to see inside.
    view : (3,) array, optional
        In 3D: direction from the body to the viewer; left out: one from which the cut or the
        crack is seen.
    loads : bool
        In 3D: draw arrows of tractions, pressures and point forces.
    zoom : float, optional
        Show a box around the cracks, or around `crack` alone, that is this many times as large as
        they are. In 2D matplotlib then draws, which cuts the body off at the box.

    Returns
    -------
    Path, or a matplotlib figure or pyvista plotter where there is no file

    Raises
    ------
    ProblemError
        A field of another dimension, a crack that does not exist, a renderer that cannot draw, a
        plane that leaves nothing, a file that cannot be written.
    XcrackError
        The renderer that was asked for is not installed.
    """
    solution = _solution_to_draw(solution, field)
    dimension = _PICTURES[solution.space.dim]
    Choice(dimension.fields).check(field, "plot: field", ProblemError)
    look = PlotStyle(
        warp=warp,
        title=title,
        edges=edges,
        limits=limits,
        cmap=cmap,
        crack=None if crack is None else crack_number(solution.problem, crack, "plot"),
        plane=cast(Plane | None, clip),
        view=view,
        loads=loads,
        near_box=None,
    )
    if zoom is not None:
        look = replace(look, near_box=crack_box(solution, look.cracks(solution), zoom, look.warp))
    if field in _ON_LIPS and not solution.lips:
        raise ProblemError(f'plot(field="{field}"): the body has no crack; draw another field.')
    target = picture_path(file, "plot")
    window = (target is None and _has_display()) if show is None else show
    return dimension.draw(solution, field, target, window, renderer, look)


@dataclass(frozen=True, eq=False)
class PlotStyle:
    """How a picture is to look: arguments of `plot`, checked."""

    warp: float
    title: str | None
    edges: bool
    limits: tuple[float, float] | None
    cmap: Any
    crack: int | None
    plane: Plane | None
    view: Floats | None
    loads: bool
    near_box: Floats | None

    def colours(self, is_signed: bool) -> Any:
        """The colour map, or one that suits the values."""
        return self.cmap or ("RdBu_r" if is_signed else "viridis")

    def cracks(self, solution: Solution) -> list[int]:
        """The cracks to draw."""
        return list(range(len(solution.lips))) if self.crack is None else [self.crack]


def _draw_2d(
    solution: Solution,
    field: str,
    target: Path | None,
    window: bool,
    renderer: str,
    look: PlotStyle,
) -> Any:
    if look.plane is not None or look.view is not None or look.loads:
        raise ProblemError("plot(clip=, view=, loads=): only 3D bodies know these; leave them out.")
    if field in _GRAPHS:
        from xcrack.view.matplotlib import draw_along

        return draw_along(solution, field, look.cracks(solution), target, window, look.title)
    if field == "mesh":
        from xcrack.view.matplotlib import draw_mesh

        return draw_mesh(solution, target, window, look.title, look.near_box)
    if look.near_box is not None and renderer == "pyvista":
        raise ProblemError("plot(zoom=): in 2D matplotlib alone can cut off: leave renderer out.")
    if look.near_box is not None:
        renderer = "matplotlib"
    fault = "" if renderer == "matplotlib" else _fault_of_pyvista(target)
    if renderer == "pyvista" and fault:
        raise ProblemError(
            f'plot(renderer="pyvista"): {fault}; or leave renderer out, and matplotlib draws it.'
        )
    picture = replace(scene(solution, field, look.warp, look.limits), focus_box=look.near_box)
    if renderer == "matplotlib" or fault:
        from xcrack.view import matplotlib as plot_matplotlib

        return plot_matplotlib.draw(
            picture, target, window, look.title, look.edges, look.colours(picture.has_sign)
        )
    from xcrack.view import pyvista as plot_pyvista

    return plot_pyvista.draw(
        picture, target, window, look.title, look.edges, look.colours(picture.has_sign)
    )


def _draw_3d(
    solution: Solution,
    field: str,
    target: Path | None,
    window: bool,
    renderer: str,
    look: PlotStyle,
) -> Any:
    from xcrack.view.scene_3d import crack_scene, mesh_scene, space_scene

    cracks = look.cracks(solution) if field in LIP_FIELDS else []
    fault = "" if renderer == "matplotlib" else _fault_of_pyvista(target)
    if cracks and (renderer == "matplotlib" or (renderer == "auto" and fault)):
        from xcrack.view import matplotlib as plot_matplotlib

        return plot_matplotlib.draw_cracks(
            solution, field, cracks, target, window, look.title, look.limits, look.cmap
        )
    if renderer == "matplotlib" or fault:
        reason = fault or 'give renderer="auto"'
        raise ProblemError(
            f'plot(field="{field}"): a body in 3D is drawn by pyvista: {reason}. matplotlib draws '
            f"{', '.join(LIP_FIELDS)} only."
        )
    if field == "mesh":
        picture = mesh_scene(solution, look.plane, look.view)
    elif cracks:
        picture = crack_scene(
            solution, field, cracks, look.warp, look.limits, look.plane, look.view
        )
    else:
        picture = space_scene(solution, field, look.warp, look.limits, look.plane, look.view)
    if look.near_box is not None:
        corners = np.stack(np.meshgrid(*look.near_box.T), axis=-1).reshape(-1, 3)
        picture = replace(picture, focus_points=corners)
    arrows = None
    if look.loads:
        from xcrack.view.scene_3d import load_arrows

        arrows = load_arrows(solution)
    from xcrack.view.pyvista import draw_space

    edges = look.edges or field == "mesh"
    colours = look.colours(picture.has_sign)
    return draw_space(picture, arrows, target, window, look.title, edges, colours)


@dataclass(frozen=True)
class _Pictures:
    """Fields that there are pictures of, and what draws them."""

    fields: tuple[str, ...]
    draw: Callable[..., Any]


_PICTURES = {
    2: _Pictures((*FIELDS, "mesh", *_GRAPHS), _draw_2d),
    3: _Pictures((*SPACE_FIELDS, "mesh", *LIP_FIELDS), _draw_3d),
}


def crack_box(solution: Solution, cracks: list[int], zoom: float, warp: float = 0.0) -> Floats:
    """Box around cracks where a warp takes them, `zoom` times as large as they are `(2, d)`.

    Parameters
    ----------
    solution : Solution
    cracks : list of int
    zoom, warp : float

    Raises
    ------
    ProblemError
        No crack.
    """
    if not cracks:
        raise ProblemError("plot(zoom=): the body has no crack to zoom to; leave zoom out.")
    x = np.concatenate([solution.lips[c].x for c in cracks])
    if warp:
        x = x + 0.5 * warp * (solution.displacement(x, 1) + solution.displacement(x, -1))
    x_min, x_max = x.min(axis=0), x.max(axis=0)
    half = zoom * max(float((x_max - x_min).max()), 1e-300) / 2
    middle = (x_min + x_max) / 2
    return np.stack([middle - half, middle + half])


def _solution_to_draw(source: Solution | Problem, field: str) -> Solution:
    """The solution, or that of a problem in which nothing acts, to draw its mesh and cracks."""
    if isinstance(source, Solution):
        return source
    if field != "mesh":
        raise ProblemError(
            f"plot: a Problem has no field {value_text(field)}: give what solve returns, or "
            'field="mesh".'
        )
    space, lips = discretise(source)
    return Solution(
        problem=source,
        state=None,
        acting=scaled_state((), 0.0),
        space=space,
        u=lock(np.zeros(space.n_dof)),
        lips=lips,
        contact=(None,) * len(lips),
        energy=0.0,
        make_summary=partial(Report, (), {}),
        reuse=SolverState(),
    )


def _has_display() -> bool:
    # Set for runs without windows: tests, batch jobs.
    if os.environ.get("PYVISTA_OFF_SCREEN", "").lower() in ("1", "true"):
        return False
    if in_notebook():
        return False
    if os.name == "nt" or sys.platform == "darwin":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _fault_of_pyvista(target: Path | None) -> str:
    """Why pyvista cannot draw this file here, and what to do; empty if it can."""
    from xcrack.view.pyvista import can_render

    if target is not None and target.suffix.lower() not in RASTER:
        return f"it writes {', '.join(RASTER)}, not {value_text(target.suffix)}"
    if can_render():
        try:
            require_package("pyvista", "it")
            return ""
        except XcrackError as error:
            return str(error).rstrip(".")
    try:
        require_package("pyvista", "it")
    except XcrackError as error:
        return str(error).rstrip(".")
    return _NO_OPENGL
