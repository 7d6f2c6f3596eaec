"""The figures: error against time and against unknowns, the front, the default settings marked."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

from benchmarks.pareto import front, points_of
from benchmarks.quoted import to_draw

_TITLES = {
    "edge": "Edge crack, K_I = 1 and K_II = 0.5",
    "half_closed": "Crack in bending, a third of it closed",
    "closed": "Closed edge crack that slides",
    "hole": "Closed crack at a hole, exact pressure (mesh not timed)",
    "growth": "A crack that turns while it grows, in 15 steps where not named",
    "life": "Life of an edge crack, over the number of steps",
    "penny": "Penny under tension",
    "penny_closed": "Penny, closed and sheared",
    "cylinder": "Notched bar bent across its crack (mesh not timed)",
    "rubbing": "Closed inclined crack that slips, friction 0.3",
    "unloading": "The crack with friction after its shear is taken off",
}
_ERRORS = {
    "tip": "end of the tip, in advances",
    "K": "K, worst mode",
    "pressure": "pressure (L2)",
    "rms": "K_I, root of the mean square along the front",
    "K_I": "K_I",
    "energy": "energy norm",
    "path": "end of the tip, against steps of no length",
    "life": "cycles",
    "closed share": "closed share of the crack faces",
}
_DEFAULT, _BASELINE, _QUOTED = "#c0392b", "#1f4e79", "#7f7f7f"
_OTHERS = ("#2e8b57", "#d68910", "#7d3c98", "#138d90", "#6e5a3b", "#b03a75", "#5d8a1f", "#3f6fd1")
_MOST = 6  # series of settings that a first figure bears
# Those that it shows where there are more.
_MAIN = (
    "order 1", "order 2", "topological", "radius 0.55", "naive multipliers", "penalty",
    "augmented Lagrangian", "Nitsche", "iterative solver",
)  # fmt: skip
_MARKS = "sD^vPX<>ph*d"


def draw(record: dict[str, Any], folder: Path) -> list[Path]:
    """Figures of a scene's record.

    Parameters
    ----------
    record : dict
        As written to `results/*.json`.
    folder : Path
        Where the PNG files go.

    Returns
    -------
    list of Path
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = [r for r in record["rows"] if r["kind"] != "off"]
    scene = record["scene"]
    settings = [r for r in rows if r["kind"] in ("default", "setting")]
    crowded = len({r["series"] for r in settings}) > _MOST
    error = next(iter(rows[0]["errors"]))
    paths = [_chart(record, error, folder / f"{scene}.png", partial(_shown, error, crowded))]
    if crowded:
        path = folder / f"{scene}_settings.png"
        paths.append(_chart(record, error, path, lambda r: r in settings, quoted=False))
    for name in ("pressure", "rms", "energy", "path", "closed share"):
        if name != error and len({r["series"] for r in rows if name in r["errors"]}) > 1:
            path = folder / f"{scene}_{name.replace(' ', '_')}.png"
            few = crowded and name == "energy"
            paths.append(_chart(record, name, path, partial(_shown, name, few), quoted=False))
    if any(r["kind"] == "off" for r in record["rows"]):
        paths.append(_ratios(record, folder / f"{scene}_cost.png"))
    return paths


def _shown(name: str, few: bool, row: dict[str, Any]) -> bool:
    """Whether a row has an error of this name, and is one of the main ones where few are shown."""
    return name in row["errors"] and (not few or _main(row))


def _main(row: dict[str, Any]) -> bool:
    """Whether a row belongs into the first figure of a scene with many settings."""
    return row["kind"] != "setting" or row["series"] in _MAIN


def _chart(
    record: dict[str, Any], error: str, path: Path, shown: Callable[[dict[str, Any]], bool],
    *, quoted: bool = True,
) -> Path:  # fmt: skip
    """Error against time, unknowns and memory of the rows that are shown, and their front."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    clock, scene = record["clock"], record["scene"]
    rows = [r for r in record["rows"] if r["kind"] != "off" and shown(r)]
    measures = [clock, "unknowns", *(["MB"] if all(r.get("MB") for r in rows) else [])]
    figure, axes = plt.subplots(
        1, len(measures), figsize=(3 + 4.2 * len(measures), 5.2), sharey=True, layout="constrained"
    )
    styles = _styles(rows)
    for series, style in styles.items():
        chosen = [r for r in rows if r["series"] == series and r["errors"].get(error, 0) > 0]
        for axis, x in zip(axes, measures):
            axis.plot([r[x] for r in chosen], [r["errors"][error] for r in chosen], **style)
    before = to_draw(scene, (r["series"] for r in record["rows"])) if quoted else {}
    for (name, points), mark in zip(before.items(), cycle("osD^v")):
        for axis, k in zip(axes, (2, 0)):  # not the memory: it was not measured
            axis.plot(
                [p[k] for p in points], [p[1] for p in points], ls=":", lw=0.8, marker=mark,
                mfc="none", color=_QUOTED, label=f"{name} (quoted)",
            )  # fmt: skip
    for axis, x in zip(axes, measures):
        best = front(points_of(rows, error, x))
        axis.step(
            [p[0] for p in best], [p[1] for p in best], where="post", color="0.55", lw=6,
            alpha=0.3, zorder=0, label="front of what ran here",
        )  # fmt: skip
        axis.set(xscale="log", yscale="log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter(FuncFormatter(_plain))
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.tick_params(axis="x", labelsize=8.5)
        axis.grid(True, which="major", color="0.85", lw=0.6)
    axes[0].set(xlabel=_time_label(clock), ylabel=f"relative error: {_ERRORS.get(error, error)}")
    axes[1].set(xlabel="unknowns")
    for axis in axes[2:]:
        axis.set(xlabel="memory that a run adds, MB")
    figure.suptitle(_TITLES.get(scene, scene), fontsize=13)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8.5, frameon=False)
    return _saved(figure, path)


def _styles(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Line and mark of each series: defaults and baselines stand out."""
    styles: dict[str, dict[str, Any]] = {}
    others = baselines = 0
    for row in rows:
        series, kind = row["series"], row["kind"]
        if series in styles:
            continue
        if kind == "default":
            style = {"color": _DEFAULT, "marker": "o", "lw": 2.4, "ms": 7, "zorder": 5}
            label = "xcrack, default settings"
        elif kind == "baseline":
            style = {
                "color": _BASELINE, "marker": "sD^v"[baselines % 4], "lw": 2.0, "ms": 6,
                "zorder": 4, "ls": "--" if baselines else "-",
            }  # fmt: skip
            label, baselines = series, baselines + 1
        else:
            style = {
                "color": _OTHERS[others % len(_OTHERS)], "marker": _MARKS[others % len(_MARKS)],
                "lw": 1.0, "ms": 4.5, "zorder": 3,
                "ls": "-" if others < len(_OTHERS) else "--",
            }  # fmt: skip
            label, others = series, others + 1
        styles[series] = {**style, "label": label}
    return styles


def _ratios(record: dict[str, Any], path: Path) -> Path:
    """Time with contact over that of the same mesh without."""
    import matplotlib.pyplot as plt

    clock = record["clock"]
    off = {r["size"]: r for r in record["rows"] if r["kind"] == "off"}
    on = [r for r in record["rows"] if r["kind"] == "default" and r["size"] in off]
    figure, axis = plt.subplots(figsize=(6.2, 4.2), layout="constrained")
    ratio = [r[clock] / off[r["size"]][clock] for r in on]
    unknowns = [r["unknowns"] for r in on]
    axis.plot(unknowns, ratio, color=_DEFAULT, marker="o", lw=2, label="measured")
    aim = 2.0 if record["scene"].startswith(("penny", "cylinder")) else 1.25  # 3D, 2D
    axis.axhline(aim, color="0.4", ls="--", lw=1, label=f"aim: {aim:g}")
    axis.axhline(1.0, color="0.8", lw=1)
    axis.set(
        xscale="log", xlabel="unknowns", ylabel="time with contact / without",
        title=_TITLES.get(record["scene"], record["scene"]), ylim=(0, max(*ratio, aim) * 1.15),
    )  # fmt: skip
    axis.grid(True, color="0.9", lw=0.6)
    axis.legend(frameon=False, loc="lower right")
    return _saved(figure, path)


def _plain(x: float, _: int) -> str:
    """A number of an axis as one writes it: 0.05, 200, 20k."""
    return f"{x:g}" if x < 1000 else f"{x / 1000:g}k"


def _time_label(clock: str) -> str:
    return "seconds, wall" if clock == "wall" else "seconds of one core (the machine was loaded)"


def _saved(figure: Any, path: Path) -> Path:
    import matplotlib.pyplot as plt

    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path
