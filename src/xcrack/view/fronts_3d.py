"""Drawings of fronts in 3D: over the section of the body, and K along them.

By matplotlib, without a renderer; for one run or one state, or for several side by side.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import (
    CheckedBy,
    FileName,
    OneOrMore,
    Part,
    SomeOf,
    Switch,
    Whole,
    check_arguments,
)
from xcrack.base.arrays import Bools, Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH
from xcrack.crack.fronts import closed_fronts, is_closed
from xcrack.crack.measures import front_ends
from xcrack.growth.step import Step, numbers_after
from xcrack.mesh.locate import Body
from xcrack.mesh.mesh import Mesh
from xcrack.runs.history import History
from xcrack.sif.sif import SIF
from xcrack.view.figures import (
    Title,
    finish_figure,
    new_figure,
    picture_path,
)
from xcrack.view.projection import Projection, best_plane, given_plane, on_plane, section_outline

_MODES = ("I", "II", "III")
_Labels = Annotated[Sequence[str] | None, OneOrMore(str, "a text")]
_NOISE = 0.1  # share of the largest K that a panel reaches at least: noise should not fill it


@dataclass(frozen=True, eq=False)
class FrontLine:
    """One front as it is drawn.

    Attributes
    ----------
    x : (m, 3) array, length
        A closed front repeats its first point at the end.
    is_closed : bool
    number : int
        Which front of the crack.
    """

    x: Floats
    is_closed: bool
    number: int


@check_arguments()
def draw_fronts(
    history: Annotated[History | Sequence[History], OneOrMore(History)],
    *,
    crack: Annotated[int, Whole(least=0)] = 0,
    plane: Annotated[
        tuple[ArrayLike, Sequence[ArrayLike]] | None, CheckedBy(given_plane, unit=LENGTH)
    ] = None,
    labels: _Labels = None,
    every: Annotated[int, Whole(least=1)] = 1,
    mesh: Annotated[Mesh | None, Part(Mesh)] = None,
    file: FileName | None = None,
    show: Switch | None = None,
    title: Title = None,
) -> Any:
    """Draw the fronts of growth runs over the section of the body.

    One run is coloured by its steps, several have a colour each, paler for older fronts.

    Parameters
    ----------
    history : History or sequence of History
    crack : int
        Number in the first step; cracks that it joins are drawn with it.
    plane : (origin, (right, up)), optional
        Point and two directions of the plane to draw on; left out: the plane that the first
        surface of the crack lies nearest to.
    labels : sequence of str, optional
        A name for each run.
    every : int
        Draw each n-th step, and the last.
    mesh : Mesh, optional
        For the outline of the body; left out: that of the history.
    file : path, optional
        Where to save the picture.
    show : bool, optional
        Open a window; left out: only without a file.
    title : str, optional

    Returns
    -------
    Path, or a matplotlib figure where there is no file

    Raises
    ------
    ProblemError
        No steps, no such crack, a 2D crack, labels of another number, a
        file that cannot be written.
    """
    runs = cast(tuple[History, ...], history)
    names = _names(labels, len(runs), "draw_fronts")
    for run in runs:
        _check(run.steps, crack)
    target = picture_path(file, "draw_fronts")
    window = target is None if show is None else show
    figure = new_figure((6.4, 5.6), window, "draw_fronts")
    axes = figure.add_subplot()
    body = mesh if mesh is not None else next((r.mesh for r in runs if r.mesh is not None), None)
    front_axes(
        axes, [run.steps for run in runs], crack, cast(Projection | None, plane), body, names, every
    )
    return _finish(figure, axes, target, window, title)


@check_arguments()
def draw_K(
    sif: Annotated[SIF | Sequence[SIF], OneOrMore(SIF)],
    *,
    front: Annotated[int, Whole(least=0)] = 0,
    labels: _Labels = None,
    modes: Annotated[Sequence[str], SomeOf(_MODES)] = _MODES,
    file: FileName | None = None,
    show: Switch | None = None,
    title: Title = None,
) -> Any:
    """Draw K_I, K_II and K_III along a front over its arc length, from 0 to 1.

    Points at a free surface, where K has no meaning, are hollow. Error bars, where K has them, are
    a band around the best K.

    Parameters
    ----------
    sif : SIF or sequence of SIF
        Of one front, or of the same front in several states, runs or meshes.
    front : int
        Which front of the crack.
    labels : sequence of str, optional
        A name for each SIF.
    modes : sequence of {"I", "II", "III"}
        A panel each.
    file : path, optional
        Where to save the picture.
    show : bool, optional
        Open a window; left out: only without a file.
    title : str, optional

    Returns
    -------
    Path, or a matplotlib figure where there is no file

    Raises
    ------
    ProblemError
        No such front, K of a 2D crack, labels of another number, a file that cannot be written.
    """
    sifs = cast(tuple[SIF, ...], sif)
    names = _names(labels, len(sifs), "draw_K")
    for part in sifs:
        if part.K.shape[1] < 3 or not (part.front == front).any():
            front_numbers = sorted({int(f) for f in part.front}) if part.K.shape[1] > 2 else []
            raise ProblemError(
                f"draw_K(front={front}): there is no such 3D front, only {front_numbers}; in 2D "
                f"read sif.K."
            )
    target = picture_path(file, "draw_K")
    window = target is None if show is None else show
    figure = new_figure((6.4, 0.8 + 2.0 * len(modes)), window, "draw_K")
    panels = figure.subplots(len(modes), 1, squeeze=False, sharex=True)[:, 0]
    largest_K = max(float(np.abs(part.K[part.front == front]).max()) for part in sifs)
    for axes, mode in zip(panels, modes, strict=True):
        reach = 0.0
        for k, (part, name) in enumerate(zip(sifs, names, strict=True)):
            share, K, surface = _K_along(part, front, _MODES.index(mode))
            color, style = f"C{k}", ("-", "--", "-.", ":")[k % 4]
            axes.plot(share, K, style, color=color, lw=1.6, label=name or None)
            axes.plot(share[surface], K[surface], "o", mfc="white", mec=color, ms=5)
            if part.errors is not None:
                K_min, K_max = (
                    _K_along(part, front, _MODES.index(mode), sign)[1] for sign in (-1, 1)
                )
                axes.fill_between(share, K_min, K_max, color=color, alpha=0.2, lw=0)
            reach = max(reach, float(np.abs(K).max()))
        axes.axhline(0, color="0.7", lw=0.8, zorder=0)
        axes.set_ylabel(f"$K_{{{mode}}}$")
        axes.margins(x=0.02)
        if reach <= _NOISE * largest_K:
            axes.set_ylim(-_NOISE * (largest_K or 1), _NOISE * (largest_K or 1))
    panels[-1].set_xlabel("s / length of the front")
    if any(names):
        figure.legend(
            *panels[0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=min(len(sifs), 3),
            fontsize="small",
            frameon=False,
        )
    return _finish(figure, panels[0], target, window, title)


def front_axes(
    axes: Any,
    runs: Sequence[Sequence[Step]],
    crack: int,
    plane: Projection | None,
    mesh: Mesh | None,
    labels: Sequence[str],
    every: int = 1,
) -> None:
    """Draw the fronts of runs into axes of matplotlib, with the section of the body.

    Parameters
    ----------
    axes : axes of matplotlib
    runs : sequence of sequences of Step
    crack : int
    plane : Projection, optional
        Left out: the best one through the first surface.
    mesh : Mesh, optional
    labels : sequence of str
        A name for each run; may be empty.
    every : int
        Draw each n-th step, and the last.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize
    from matplotlib.ticker import MaxNLocator

    runs = [[step for step in steps if not step.has_left] for steps in runs]
    view = best_plane(_surface(runs[0][0], crack)) if plane is None else plane
    if mesh is not None:
        rim = section_outline(mesh, view)
        axes.add_collection(LineCollection(list(rim), colors="0.45", linewidths=1.0))
    first = runs[0][0].cracks[crack]
    edges = on_plane(first.points[_rim(first.faces)], view)
    if mesh is None:
        axes.add_collection(LineCollection(list(edges), colors="0.7", linewidths=0.8))
    body = None if mesh is None else Body.of(mesh)
    is_single = len(runs) == 1
    last_index = max(steps[-1].index for steps in runs)
    colours, scale = colormaps["viridis"], Normalize(runs[0][0].index, max(last_index, 1))
    for k, (steps, name) in enumerate(zip(runs, labels, strict=True)):
        every_step = list(zip(steps, _numbers_of(steps, crack)))
        for step, numbers in [*every_step[:-1:every], every_step[-1]]:
            is_last = step is steps[-1]
            age = (last_index - step.index) / max(last_index, 1)
            color = colours(scale(step.index)) if is_single else f"C{k}"
            for x in (x for c in numbers for x in _drawn_lines(step, c, body)):
                axes.plot(
                    *on_plane(x, view).T,
                    ("-", "--", "-.", ":")[k % 4],
                    color=color,
                    lw=2.0 if is_last else 1.1,
                    alpha=1.0 if is_single else 1.0 - 0.65 * age,
                )
        if name:
            axes.plot([], [], ("-", "--", "-.", ":")[k % 4], color=f"C{k}", label=name)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel=view.label(0), ylabel=view.label(1))
    axes.spines[["top", "right"]].set_visible(False)
    if is_single and len(runs[0]) > 1:
        bar = ScalarMappable(scale, colours)
        integer_ticks = MaxNLocator(integer=True)
        axes.figure.colorbar(bar, ax=axes, label="step", shrink=0.8, aspect=25, ticks=integer_ticks)
    elif any(labels):
        axes.legend(
            fontsize="small",
            frameon=False,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.13),
            ncols=min(len(runs), 3),
        )


def _numbers_of(steps: Sequence[Step], crack: int) -> list[list[int]]:
    """Numbers in each step of a crack of the first, and of all cracks that it joins in the end."""
    number = [
        numbers_after(len(step.cracks), next_step.joins, len(next_step.cracks))
        for step, next_step in zip(steps, steps[1:])
    ]
    last_number = crack
    for next_numbers in number:
        last_number = next_numbers[last_number]
    rows = [[last_number]]
    for next_numbers in reversed(number):
        rows.append([c for c, next_number in enumerate(next_numbers) if next_number in rows[-1]])
    return rows[::-1]


def step_fronts(step: Step, crack: int) -> list[FrontLine]:
    """Fronts of a crack in a step: where K was found, or else as the crack has them.

    Parameters
    ----------
    step : Step
    crack : int

    Returns
    -------
    list of FrontLine
    """
    body = step.cracks[crack]
    is_closed_front = closed_fronts(body)
    lines = []
    sif = step.sif[0][crack] if step.sif else None
    if sif is not None and len(sif.x):
        for number in np.unique(sif.front):
            x = sif.x[sif.front == number]
            # A closed front that leaves the body in part has K on the rest of it.
            is_loop = (number >= len(is_closed_front) or is_closed_front[number]) and is_closed(x)
            lines.append(
                FrontLine(np.concatenate([x, x[:1]]) if is_loop else x, is_loop, int(number))
            )
        return lines
    return [
        FrontLine(body.points[front], is_loop, k)
        for k, (front, is_loop) in enumerate(zip(body.fronts or (), is_closed_front, strict=True))
    ]


def _drawn_lines(step: Step, crack: int, body: Body | None) -> list[Floats]:
    """Lines of the fronts of a step, with the places where they meet the boundary."""
    lines = step_fronts(step, crack)
    if body is None or not step.sif:
        return [line.x for line in lines]
    places = [x for _, x in front_ends(step.cracks[crack], body)]
    is_whole_line = [line.is_closed or len(line.x) < 2 for line in lines]
    return [
        a.x if b else to_the_surface(a.x, places) for a, b in zip(lines, is_whole_line, strict=True)
    ]


def _K_along(sif: SIF, front: int, mode: int, edge: int = 0) -> tuple[Floats, Floats, Bools]:
    """Share of the arc length, K of a mode, and which points lie at a free surface.

    With an edge of -1 or 1, in the place of K that end of the bar of the best K.
    """
    points_of_front = np.nonzero(sif.front == front)[0]
    points_of_front = points_of_front[np.argsort(sif.s[points_of_front], kind="stable")]
    K = (
        sif.best[points_of_front, mode] + edge * sif.bar[points_of_front, mode]
        if edge
        else sif.K[points_of_front, mode]
    )
    x, surface = sif.x[points_of_front], sif.at_surface[points_of_front]
    s = sif.s[points_of_front] - sif.s[points_of_front[0]]
    if is_closed(x) and not surface.any():
        s = np.append(s, s[-1] + np.linalg.norm(x[0] - x[-1]))
        K, surface = np.append(K, K[0]), np.append(surface, surface[0])
    total = float(s[-1])
    return s / total if total else s, K, surface


def _surface(step: Step, crack: int) -> Floats:
    body = step.cracks[crack]
    x = [line.x for line in step_fronts(step, crack)]
    return np.concatenate([body.points[np.unique(body.faces)], *x])


def _rim(faces: Any) -> Any:
    from xcrack.mesh.triangulation import rim

    return rim(faces)[0]


def _check(steps: Sequence[Step], crack: int) -> None:
    if not steps:
        raise ProblemError("there is nothing to draw: the history has no steps.")
    n = len(steps[0].cracks)
    if not 0 <= crack < n:
        raise ProblemError(f"draw_fronts(crack={crack}): there are {n} crack(s), numbered from 0.")
    if steps[0].cracks[crack].fronts is None:
        raise ProblemError('draw_fronts: only 3D cracks have fronts; in 2D plot "path".')


def _names(labels: Any, n: int, caller: str) -> list[str]:
    if labels is None:
        return [""] * n if n == 1 else [str(k) for k in range(n)]
    names: tuple[str, ...] = labels
    if len(names) != n:
        raise ProblemError(
            f"{caller}: labels = {value_text(labels)} for {n} curve(s): give a text for each."
        )
    return list(names)


def _finish(figure: Any, axes: Any, file: Path | None, window: bool, title: str | None) -> Any:
    if title:
        axes.set_title(title)
    return finish_figure(figure, file, window)


def to_the_surface(x: Floats, places: list[Floats]) -> Floats:
    """Points of an open front with the places at its ends, where some are near.

    Parameters
    ----------
    x : (n, 3) array, length
        Places of K: they end a share of their distance inside the body.
    places : list of (3,) array, length
        Where fronts of the crack meet the boundary.

    Returns
    -------
    (m, 3) array
    """
    reach = 3 * float(np.linalg.norm(np.diff(x, axis=0), axis=1).max())
    start_place, end_place = (_nearest_place(places, end, reach) for end in (x[0], x[-1]))
    return np.concatenate([start_place, x, end_place])


def _nearest_place(places: list[Floats], x: Floats, reach: float) -> Floats:
    """The nearest place within reach `(1, 3)`, or none `(0, 3)`."""
    near_places = [place for place in places if np.linalg.norm(place - x) < reach]
    near_places.sort(key=lambda place: float(np.linalg.norm(place - x)))
    return np.reshape(near_places[:1], (-1, 3))


__all__ = ["FrontLine", "draw_K", "draw_fronts", "front_axes", "step_fronts", "to_the_surface"]
