"""Pictures of a report: as PNG bytes, each with the words under it."""

import base64
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.errors import XcrackError
from xcrack.base.markup import Markup, element
from xcrack.runs.history import History
from xcrack.sif.sif import SIF
from xcrack.view.figures import finish_figure
from xcrack.view.fronts_3d import draw_K
from xcrack.view.plot import plot

Picture = tuple[str, bytes]  # words, PNG
Draw = Callable[[Path], Any]


def solution_pictures(
    solutions: Sequence[Solution], sif: Sequence[Sequence[SIF]]
) -> tuple[list[Picture], list[str]]:
    """Pictures of the states of one solve, and why some could not be drawn."""
    if not solutions:
        return [], []
    severe_solution = solutions[_most_severe(solutions, sif)]
    drawers: list[tuple[str, Draw]] = [
        ("Mesh, cracks and enriched points", lambda f: plot(severe_solution, "mesh", file=f)),
        ("Equivalent stress, displacements enlarged", _field(severe_solution, "von_mises")),
    ]
    for k, solution in enumerate(solutions):
        if any(contact is not None and contact.closed.any() for contact in solution.contact):
            drawers.append((f"Contact pressure, state {k}", _field(solution, "pressure", 0.0)))
    if severe_solution.lips:
        drawers.append(("Opening of the crack faces", _field(severe_solution, "opening", 0.0)))
    drawers += list(_along_fronts(sif))
    return _drawn_picture(drawers)


def figure_markup(picture: Picture) -> Markup:
    """A picture with the words under it, as part of a page."""
    words, data = picture
    encoded_data = base64.b64encode(data).decode()
    text = element("figcaption", words)
    return Markup(
        f'<figure><img alt="{words}" src="data:image/png;base64,{encoded_data}">{text}</figure>'
    )


def drawn_figure(words: str, draw: Draw) -> Markup:
    """A picture as part of a page; words where it cannot be drawn here."""
    images, messages = _drawn_picture([(words, draw)])
    return figure_markup(images[0]) if images else element("p", messages[0], cls="soft")


def first_picture(
    history: History | None, solutions: Sequence[Solution], sif: Sequence[Sequence[SIF]]
) -> Markup | None:
    """The picture of a first page: length over life of a run, stress of a solution."""
    if history is not None and history.steps:
        return drawn_figure("Length of the cracks over the life", lambda f: history.plot("a", f))
    if not solutions:
        return None
    severe_solution = solutions[_most_severe(solutions, sif)]
    return drawn_figure(
        "Equivalent stress, displacements enlarged", _field(severe_solution, "von_mises")
    )


def history_pictures(history: History) -> tuple[list[Picture], list[str]]:
    """Pictures of a run, and why some could not be drawn."""
    if not history.steps:
        return [], []
    drawers: list[tuple[str, Draw]] = [
        ("Length of the cracks over cycles", lambda f: history.plot("a", f)),
        ("K over length, or along the fronts over cycles", lambda f: history.plot("K", f)),
        ("Path of the cracks", lambda f: history.plot("path", f)),
        ("Rate of growth over the range", lambda f: _rates(history, f)),
    ]
    if history.mesh is not None:
        title_of_measures = "Depth and surface lengths over cycles"
        drawers.insert(3, (title_of_measures, lambda f: history.plot("measures", f)))
    return _drawn_picture(drawers)


def _field(solution: Solution, field: str, warp: float | None = None) -> Draw:
    scale = _warp(solution) if warp is None else warp
    return lambda file: plot(solution, field, file=file, warp=scale)


def _warp(solution: Solution) -> float:
    """A factor that makes displacements a twentieth of the body, in round numbers."""
    mesh = solution.space.mesh
    displacement = float(np.abs(solution.coefficients[: mesh.n_points]).max(initial=0.0))
    if displacement <= 0:
        return 0.0
    factor = 0.05 * mesh.extent / displacement
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(m for m in (1, 2, 5) if m * power <= factor))


def _most_severe(solutions: Sequence[Solution], sif: Sequence[Sequence[SIF]]) -> int:
    """The state with the largest K; the one with most energy where there is none."""
    severities = [
        max((float(np.abs(s.K).max(initial=0.0)) for s in state), default=0.0) for state in sif
    ]
    if not any(severities):
        severities = [solution.energy for solution in solutions]
    return int(np.argmax(severities))


def _along_fronts(sif: Sequence[Sequence[SIF]]) -> Iterator[tuple[str, Draw]]:
    if not sif:
        return
    for c in range(len(sif[0])):
        states = [state[c] for state in sif]
        if states[0].K.shape[1] < 3:
            continue
        for front in np.unique(states[0].front):
            names = [f"state {k}" for k in range(len(states))] if len(states) > 1 else None
            draw = partial(_K_along, states, int(front), names)
            yield f"K along front {front} of crack {c}", draw


def _K_along(states: Sequence[SIF], front: int, names: Sequence[str] | None, file: Path) -> None:
    draw_K(states, front=front, labels=names, file=file)


def _rates(history: History, file: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    axes = figure.add_subplot()
    for c in range(len(history.cracks)):
        pairs = [(step.dK_eq[c], step.rate[c]) for step in history.steps if c < len(step.rate)]
        x, y = (np.concatenate([pair[k] for pair in pairs]) for k in (0, 1))
        is_good = (x > 0) & (y > 0) & np.isfinite(y)
        if is_good.any():
            axes.loglog(x[is_good], y[is_good], ".", ms=5, color=f"C{c}", label=f"crack {c}")
    axes.set(xlabel="equivalent range ΔK", ylabel="da/dN")
    axes.grid(True, which="both", alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize="small")
    finish_figure(figure, Path(file), window=False)


def _drawn_picture(drawers: Sequence[tuple[str, Draw]]) -> tuple[list[Picture], list[str]]:
    pictures, messages = [], []
    with tempfile.TemporaryDirectory() as folder:
        for k, (words, draw) in enumerate(drawers):
            file = Path(folder) / f"{k}.png"
            try:
                draw(file)
                pictures.append((words, file.read_bytes()))
            except (XcrackError, OSError) as error:
                messages.append(f"{words}: {str(error).splitlines()[0]}")
    return pictures, messages


__all__ = [
    "Picture",
    "drawn_figure",
    "figure_markup",
    "first_picture",
    "history_pictures",
    "solution_pictures",
]
