"""Pictures of a growth run."""

from typing import Any

import numpy as np

from xcrack.base.arguments import FileName
from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.mesh.locate import parts_inside
from xcrack.output.curved_sides import boundary_lines
from xcrack.runs.history import History
from xcrack.runs.table import crack_numbers, state_names
from xcrack.view.figures import finish_figure, new_figure, picture_path


def draw(history: History, kind: str, file: FileName | None) -> Any:
    """Figure of K, of length over cycles, of the paths or the fronts; saved or shown."""
    kinds = {"K": _draw_K, "a": _draw_a, "path": _draw_path}
    if history.cracks and history.cracks[0].fronts is not None:
        kinds = {"K": _draw_K_of_fronts, "a": _draw_a, "fronts": _draw_fronts}
        kinds["path"] = _draw_fronts
    kinds["measures"] = _draw_measures
    if isinstance(kind, str) and kind == "fronts" and kind not in kinds and history.steps:
        raise ProblemError('plot kind = "fronts": only 3D cracks have them; give "path".')
    if not isinstance(kind, str) or kind not in (*kinds, "fronts"):
        raise ProblemError(
            f'plot kind = {value_text(kind)}: give "K", "a", "path" or "measures", in 3D also '
            f'"fronts".'
        )
    if not history.steps:
        raise ProblemError("there is nothing to draw: the history has no steps.")
    target = picture_path(file, "plot")
    figure = new_figure((6.4, 4.8), target is None, "History.plot")
    kinds[kind](history, figure.add_subplot())
    finish_figure(figure, target, target is None)
    return figure


def _draw_K(history: History, axes: Any) -> None:
    table = history.table()
    states = state_names(history.steps)
    for number, end in enumerate(np.unique(table["id"][table["step"] == table["step"][0]])):
        rows, label = table[table["id"] == end], _end_name(history, int(end))
        K = np.array([[rows[f"K_{m}_{s}"] for m in ("I", "II")] for s in states])
        severe_state = np.argmax(np.hypot(K[:, 0], K[:, 1]), axis=0)
        K_I, K_II = K[severe_state, :, np.arange(len(rows))].T
        axes.plot(rows["a"], K_I, "o-", ms=3, color=f"C{number}", label=f"$K_I$, {label}")
        axes.plot(rows["a"], K_II, "s--", ms=3, color=f"C{number}", label=f"$K_{{II}}$, {label}")
    axes.set(xlabel="crack length a", ylabel="K of the most severe state")
    axes.axhline(0, color="0.7", lw=0.8, zorder=0)
    axes.legend(fontsize="small")


def _draw_K_of_fronts(history: History, axes: Any) -> None:
    """Largest and smallest K along each front, of the state that is most severe there."""
    table = history.table()
    for number, end in enumerate(np.unique(table["id"])):
        rows, label = table[table["id"] == end], _end_name(history, int(end))
        for mode, style in (("I", "o-"), ("II", "s--"), ("III", "^:")):
            states = state_names(history.steps)
            K_min, K_max = (_extreme_K(rows, states, mode, extreme) for extreme in ("min", "max"))
            # The sign of modes II and III goes round with the front.
            largest_K = K_max if mode == "I" else np.maximum(np.abs(K_min), np.abs(K_max))
            name = f"$K_I$, {label}" if mode == "I" else f"$|K_{{{mode}}}|$, {label}"
            axes.plot(rows["N"], largest_K, style, ms=3, color=f"C{number}", label=name)
            if mode == "I":
                name = "all $K_I$ along it"
                axes.fill_between(
                    rows["N"], K_min, K_max, color=f"C{number}", alpha=0.15, lw=0, label=name
                )
    _mark_joins(history, axes)
    axes.set(xlabel=f"{history.unit}s N", ylabel="largest K along the front")
    axes.axhline(0, color="0.7", lw=0.8, zorder=0)
    axes.legend(fontsize="small")


def _extreme_K(rows: Any, states: list[str], mode: str, extreme: str) -> Any:
    """Smallest or largest K of a mode in the state whose K is largest in size `(k,)`."""
    ends = [
        np.array([[rows[f"K_{m}_{s}_{e}"] for e in ("min", "max")] for m in ("I", "II", "III")])
        for s in states
    ]
    severe_state = np.argmax([np.nan_to_num(np.abs(K)).max(axis=(0, 1)) for K in ends], axis=0)
    return np.array(
        [rows[f"K_{mode}_{states[s]}_{extreme}"][k] for k, s in enumerate(severe_state)]
    )


def _draw_fronts(history: History, axes: Any) -> None:
    from xcrack.view.fronts_3d import front_axes

    # One picture, one plane: further cracks are drawn by draw_fronts(crack=...).
    front_axes(axes, [history.steps], 0, None, history.mesh, [""])


def _draw_a(history: History, axes: Any) -> None:
    table = history.table()
    table["crack"] = _crack_of_rows(history, table)
    for crack in np.unique(table["crack"]):
        rows = table[table["crack"] == crack]
        _, first = np.unique(rows["step"], return_index=True)
        axes.plot(rows["N"][first], rows["a"][first], "o-", ms=3, label=f"crack {crack}")
    _mark_joins(history, axes)
    axes.set(xlabel=f"{history.unit}s N", ylabel="crack length a")
    axes.legend(fontsize="small")


def _draw_measures(history: History, axes: Any) -> None:
    """Depth, and the length on each facet set, over the cycles."""
    rows, _ = history.measures()
    rows["crack"] = _crack_of_rows(history, rows)
    lengths = [name for name in rows.dtype.names or () if name.startswith("length_")]
    for crack in np.unique(rows["crack"]):
        rows_of_crack, prefix = rows[rows["crack"] == crack], f"crack {crack}: "
        axes.plot(
            rows_of_crack["N"],
            rows_of_crack["depth"],
            "o-",
            ms=3,
            color=f"C{crack}",
            label=prefix + "depth",
        )
        for name, style in zip(lengths, "sv^Dx<>P*" * len(lengths)):
            if np.nanmax(np.append(rows_of_crack[name], 0.0)) > 0:
                label = f"{prefix}length on {name.removeprefix('length_')}"
                axes.plot(
                    rows_of_crack["N"],
                    rows_of_crack[name],
                    f"{style}--",
                    ms=4,
                    color=f"C{crack}",
                    label=label,
                )
    _mark_joins(history, axes)
    axes.set(xlabel=f"{history.unit}s N", ylabel="length")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize="small")


def _mark_joins(history: History, axes: Any) -> None:
    """Lines at the cycles at which cracks joined."""
    for join in history.joins:
        name = f"cracks {join.cracks[0]} and {join.cracks[1]} join"
        axes.axvline(join.N, color="0.5", lw=0.9, ls=(0, (4, 3)), zorder=0, label=name)


def _draw_path(history: History, axes: Any) -> None:
    if history.mesh is not None:
        from matplotlib.collections import LineCollection

        lines = boundary_lines(history.mesh)
        axes.add_collection(LineCollection(list(lines[..., :2]), colors="0.6", linewidths=1))
        axes.autoscale_view()
        x_min, x_max = history.mesh.points.min(axis=0), history.mesh.points.max(axis=0)
        margin = 0.03 * float((x_max - x_min).max())
        axes.set(
            xlim=(x_min[0] - margin, x_max[0] + margin), ylim=(x_min[1] - margin, x_max[1] + margin)
        )
    names = crack_numbers(history.steps[-1])
    table = history.table()
    crack_of_row = _crack_of_rows(history, table)
    for number, start in enumerate(history.steps[0].cracks):
        for part in _shown_parts(history, start.points):
            axes.plot(*part[:, :2].T, "-", color=f"C{number}", lw=3.5, solid_capstyle="butt")
        rows = table[crack_of_row == number]
        axes.plot(rows["x"], rows["y"], ".", ms=4, color=f"C{number}")
    for number, crack in zip(names, history.cracks, strict=True):
        label = f"crack {number}"
        for part in _shown_parts(history, crack.points):
            axes.plot(*part[:, :2].T, "-", color=f"C{number}", label=label)
            label = ""  # once in the legend
    axes.set(xlabel="x", ylabel="y", aspect="equal")
    axes.legend(fontsize="small")


def _shown_parts(history: History, line: Floats) -> list[Floats]:
    """Parts of a line inside the body: a crack begins at its side, not where it was given."""
    mesh = history.mesh
    if mesh is None or mesh.dim == 3:
        return [line]
    pieces = zip(line[:-1], line[1:], parts_inside(mesh, line), strict=True)
    return [a + np.outer(part, b - a) for a, b, parts in pieces for part in parts]


def _crack_of_rows(history: History, table: Any) -> Any:
    """Number that the crack of each row of a table had at first `(k,)`."""
    names = {step.index: crack_numbers(step) for step in history.steps}
    pairs = zip(table["step"].tolist(), table["crack"].tolist(), strict=True)
    return np.array([names[step][crack] for step, crack in pairs], dtype=np.int64)


def _end_name(history: History, end: int) -> str:
    """What a tip, or front, is called."""
    return history.names[end] if 0 <= end < len(history.names) else f"tip {end}"


__all__ = ["draw"]
