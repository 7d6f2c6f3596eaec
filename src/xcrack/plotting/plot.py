"""One picture of a solution: a field on the opened crack, the mesh, or a graph along the crack."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from xcrack.analysis.solution import Solution
from xcrack.errors import ProblemError
from xcrack.plotting.scene_2d import FIELDS, SPACE_FIELDS, scene

_GRAPHS = ("pressure", "opening")
_KNOWN = (*FIELDS, "mesh", *_GRAPHS)


def plot(
    solution: Solution,
    field: str = "von_mises",
    *,
    file: str | Path | None = None,
    warp: float = 0.0,
    show: bool | None = None,
    renderer: str = "auto",
    title: str | None = None,
    edges: bool = False,
    limits: tuple[float, float] | None = None,
    cmap: str | None = None,
    crack: int | None = None,
    clip: tuple[Any, Any] | None = None,
    view: Any = None,
    loads: bool = False,
) -> Any:
    """Draw a solution.

    Parameters
    ----------
    solution : Solution
    field : str
        On the body: "von_mises", "sxx", "syy", "sxy", "displacement" (its norm), "ux", "uy".
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

    Returns
    -------
    Path, or a matplotlib figure or pyvista plotter where there is no file

    Raises
    ------
    ProblemError
        An unknown field or renderer, a crack that does not exist, a renderer that cannot draw, a
        plane that leaves nothing.
    """
    if solution.space.dim == 3:
        look = Look(warp, title, edges, limits, cmap, crack, clip, view, loads)
        return _in_space(solution, field, file, show, renderer, look)
    if clip is not None or view is not None or loads:
        raise ProblemError("plot(clip=, view=, loads=): only 3D bodies know these.")
    if field not in _KNOWN:
        known = ", ".join(f'"{name}"' for name in _KNOWN)
        raise ProblemError(f"plot(field={field!r}): there is no such field; give one of {known}.")
    _check_renderer(renderer)
    target = _target(file)
    window = (target is None and _has_display()) if show is None else show
    if field in _GRAPHS:
        from xcrack.plotting.matplotlib_2d import draw_along

        return draw_along(solution, field, _cracks(solution, field, crack), target, window, title)
    if field == "mesh":
        from xcrack.plotting.matplotlib_2d import draw_mesh

        return draw_mesh(solution, target, window, title)
    picture = scene(solution, field, warp, limits)
    colours = cmap or ("RdBu_r" if picture.signed else "viridis")
    if _by_pyvista(renderer, target):
        from xcrack.plotting import pyvista_2d as plot_pyvista

        return plot_pyvista.draw(picture, target, window, title, edges, colours)
    from xcrack.plotting import matplotlib_2d as plot_matplotlib

    return plot_matplotlib.draw(picture, target, window, title, edges, colours)


@dataclass(frozen=True, eq=False)
class Look:
    """How a picture in 3D is to look: arguments of `plot`."""

    warp: float
    title: str | None
    edges: bool
    limits: tuple[float, float] | None
    cmap: str | None
    crack: int | None
    clip: Any
    view: Any
    loads: bool


def _in_space(
    solution: Solution,
    field: str,
    file: str | Path | None,
    show: bool | None,
    renderer: str,
    look: Look,
) -> Any:
    from xcrack.plotting.scene_3d import (
        LIP_FIELDS,
        clip_plane,
        crack_scene,
        direction,
        mesh_scene,
        space_scene,
    )

    known = (*SPACE_FIELDS, "mesh", *LIP_FIELDS)
    if field not in known:
        names = ", ".join(f'"{name}"' for name in known)
        raise ProblemError(f"plot(field={field!r}): there is no such field; give one of {names}.")
    _check_renderer(renderer)
    plane, view = clip_plane(look.clip), direction(look.view)
    cracks = _cracks(solution, field, look.crack) if field in LIP_FIELDS else []
    target = _target(file)
    window = (target is None and _has_display()) if show is None else show
    if not _by_pyvista(renderer, target):
        from xcrack.plotting import matplotlib_3d as plot_matplotlib_space
        from xcrack.plotting.pyvista_2d import RASTER

        if cracks:
            return plot_matplotlib_space.draw_cracks(
                solution, field, cracks, target, window, look.title, look.limits, look.cmap
            )
        raise ProblemError(
            f'plot(field="{field}"): a 3D body is drawn by pyvista, as '
            f"{', '.join(RASTER)}; matplotlib draws {', '.join(LIP_FIELDS)} only. Without OpenGL "
            "install libEGL (apt-get install libegl1 libgl1-mesa-dri)."
        )
    if field == "mesh":
        picture = mesh_scene(solution, plane, view)
    elif cracks:
        picture = crack_scene(solution, field, cracks, look.warp, look.limits, plane, view)
    else:
        picture = space_scene(solution, field, look.warp, look.limits, plane, view)
    arrows = None
    if look.loads:
        from xcrack.plotting.loads_3d import load_arrows

        arrows = load_arrows(solution)
    from xcrack.plotting.pyvista_3d import draw_space

    colours = look.cmap or ("RdBu_r" if picture.signed else "viridis")
    edges = look.edges or field == "mesh"
    return draw_space(picture, arrows, target, window, look.title, edges, colours)


def _check_renderer(renderer: str) -> None:
    if renderer not in ("auto", "pyvista", "matplotlib"):
        raise ProblemError(f'plot(renderer={renderer!r}): give "auto", "pyvista" or "matplotlib".')


def _target(file: str | Path | None) -> Path | None:
    if file is None:
        return None
    path = Path(file)
    if not path.suffix:
        path = path.with_name(path.name + ".png")
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _has_display() -> bool:
    # Set for runs without windows: tests, batch jobs.
    if os.environ.get("PYVISTA_OFF_SCREEN", "").lower() in ("1", "true"):
        return False
    if os.name == "nt" or sys.platform == "darwin":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _cracks(solution: Solution, field: str, crack: int | None) -> list[int]:
    n = len(solution.lips)
    if n == 0:
        raise ProblemError(
            f'plot(field="{field}"): the body has no crack, so there are no crack faces.'
        )
    if crack is not None and not 0 <= crack < n:
        raise ProblemError(f"plot(crack={crack}): the problem has {n} crack(s), numbered from 0.")
    return list(range(n)) if crack is None else [crack]


def _by_pyvista(renderer: str, target: Path | None) -> bool:
    from xcrack.plotting.pyvista_2d import RASTER, renders

    if renderer == "matplotlib":
        return False
    known = target is None or target.suffix.lower() in RASTER
    if renderer == "auto":
        return known and renders()
    if not known and target is not None:
        raise ProblemError(
            f'plot(file="{target}"): pyvista writes {", ".join(RASTER)}; take '
            'renderer="matplotlib" for other kinds of files.'
        )
    if not renders():
        raise ProblemError(
            'plot(renderer="pyvista"): pyvista cannot draw here (no OpenGL); install libEGL '
            '(apt-get install libegl1 libgl1-mesa-dri) or take renderer="matplotlib".'
        )
    return True
