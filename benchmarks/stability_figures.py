"""Pictures of benchmarks/results/stability.json for docs/stability.md."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.base.arrays import Floats, Ints

Part = dict[str, Any]

OURS, FAILS, GREY = "#1f5fa8", "#c8442c", "#8a8a8a"
COLOURS = {"none": FAILS, "node": "#e0a030", "star": OURS, "star and patch": "#2b8f5a"}
HIGHEST = 1e18  # where a singular matrix is drawn


def _cut_axis(axis: Any, eps: Sequence[float]) -> Ints:
    """Places of cut positions on an axis: above the nodes by their size, on them, below."""
    axis.set_xticks(range(len(eps)))
    axis.set_xticklabels([f"{e:g}".replace("e-0", "e-") for e in eps], rotation=60, fontsize=7)
    axis.set_xlabel("crack to nearest nodes, in cells")
    return np.arange(len(eps))


def _drawn(values: Sequence[float | None], instead: float) -> list[float]:
    return [instead if v is None else v for v in values]


def infsup(part: Part, plt: Any) -> Any:
    """Inf-sup constants over mesh size and cut position, reduced beside naive."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True)
    kinds = (
        ("plane, order 1", "o", "plane"), ("plane, order 2", "s", "plane"),
        ("space", "^", "space"), ("space with a front", "v", "space"),
    )  # fmt: skip
    place = _cut_axis(axes[1], part["eps"])
    for name, marker, where in kinds:
        for kind, colour, style in (("reduced", OURS, "-"), ("naive", FAILS, "--")):
            entry = part[f"{name}, {kind}"]
            options = {"marker": marker, "color": colour, "ls": style, "ms": 5, "lw": 1,
                       "label": f"{kind}, {name}"}  # fmt: skip
            axes[0].semilogx(part["h"][where], entry["size"], **options)
            axes[1].plot(place, entry["cut"], **options)
    axes[0].set_xticks([4, 8, 16, 32, 64], ["4", "8", "16", "32", "64"])
    axes[0].minorticks_off()
    axes[0].set_xlabel("cells a side")
    axes[0].set_ylabel("inf-sup constant (smallest of the drawn cracks)")
    axes[0].set_title("over mesh size")
    axes[1].set_title("over cut position")
    axes[0].legend(fontsize=7, ncol=2, loc="center", bbox_to_anchor=(0.55, 0.2))
    return figure


def pressure(part: Part, plt: Any) -> Any:
    """Error of the pressure along the crack faces, and the largest of it over mesh size."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), width_ratios=(2, 1))
    axis = axes[0]
    for kind, colour, name in (("naive", FAILS, "one multiplier a node"),
                               ("reduced", OURS, "xcrack (reduced)")):  # fmt: skip
        x, p = np.array(part[f"x {kind}"]), np.array(part[f"p {kind}"])
        axis.plot(x, p - (1.2 - x), color=colour, lw=1.2, label=name)
        for scene, style in (("largest error", "o-"), ("beside a tip", "s--")):
            errors = part[f"{scene}, {kind}"]
            sizes = part["sizes"] if scene == "largest error" else (10, 20, 40)
            label = "bending" if scene == "largest error" else "sliding edge crack"
            axes[1].loglog(sizes, errors, style, color=colour, label=f"{label}, {kind}")
    axis.axhline(0, color="k", ls="--", lw=0.8)
    worst = np.array(part["p naive"]).max() - 2.2
    axis.set(
        xlabel="x / a along the crack",
        ylabel="(pressure - exact pressure) / s_b",
        ylim=(-0.25, 0.25),
        title=f"bending on compression, a/h = 10; at x = -a naive is off by {worst:.1f}",
    )
    axis.legend()
    axes[1].set_xticks((10, 20, 40, 80), ["10", "20", "40", "80"])
    axes[1].set_yticks((0.01, 0.03, 0.1, 0.3, 1), ["0.01", "0.03", "0.1", "0.3", "1"])
    axes[1].minorticks_off()
    axes[1].set(xlabel="cells a side", ylabel="largest error on the inner 80 %", ylim=(0.008, 1.5))
    axes[1].legend(fontsize=7)
    return figure


def condition(part: Part, plt: Any) -> Any:
    """Condition numbers over mesh size and cut position."""
    names = ("geometric", "two functions", "topological")
    figure, axes = plt.subplots(2, 3, figsize=(11, 7), sharey=True)
    sizes = np.array(part["sizes"])
    for column, name in enumerate(names):
        above, below = axes[:, column]
        place = _cut_axis(below, part["eps"])
        for kind, colour in COLOURS.items():
            for order, style in ((1, ":"), (2, "-")):
                values = _drawn(part["over size"][f"{name}, {kind}, order {order}"], HIGHEST)
                above.loglog(sizes, values, style, marker="o", ms=4, color=colour,
                             label=f"{kind}, order {order}")  # fmt: skip
            values = _drawn(part["over cut"][f"{name}, {kind}"], HIGHEST)
            below.semilogy(place, values, "o-", ms=4, color=colour, label=f"{kind}, order 2")
        above.loglog(sizes, 15 * sizes**2, "k--", lw=0.8, label="15 n²")
        above.set_xticks(sizes, [str(n) for n in sizes])
        above.minorticks_off()
        above.set(title=name, xlabel="cells a side", ylim=(10, 3 * HIGHEST))
    axes[0, 0].set_ylabel("condition number")
    axes[1, 0].set_ylabel("condition number, n = 20")
    axes[0, 2].legend(fontsize=7, ncol=2)
    axes[1, 2].legend(fontsize=7, loc="upper left")
    return figure


def cuts(part: Part, plt: Any) -> Any:
    """Pressure of a patch and K over cut positions."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4))
    least = 1e-16
    rows = (
        (axes[0], "pressure, order 1", OURS, "o-"), (axes[0], "pressure, order 2", OURS, "s-"),
        (axes[0], "pressure, space", "#2b8f5a", "^-"),
        (axes[0], "pressure, order 1, no correction", "#e0a030", "o--"),
        (axes[0], "pressure, order 2, no correction", "#e0a030", "s--"),
        (axes[0], "pressure, order 1, naive", FAILS, "o:"),
        (axes[1], "K, order 1, star", OURS, "o-"), (axes[1], "K, order 2, star", OURS, "s-"),
        (axes[1], "K, order 1, none", FAILS, "o:"), (axes[1], "K, order 2, none", FAILS, "s:"),
    )  # fmt: skip
    for axis, name, colour, style in rows:
        values = [None if v is None else max(v, least) for v in part[name]]
        place = [i for i, v in enumerate(values) if v is not None]
        axis.semilogy(place, [values[i] for i in place], style, color=colour, ms=4, lw=1,
                      label=name)  # fmt: skip
    for axis, title in zip(axes, ("uniform pressure: error", "Williams' field: error of K")):
        _cut_axis(axis, part["eps"])
        axis.set_title(title)
        axis.legend(fontsize=7)
    return figure


def drawn(part: Part, plt: Any) -> Any:
    """Errors of the drawn cracks over the median of their class."""
    rows = [(where, name) for where, entry in part.items() for name in entry["classes"]]
    figure, axis = plt.subplots(figsize=(9, 0.42 * len(rows) + 1.2))
    for y, (where, name) in enumerate(rows):
        median = part[where]["classes"][name]["median"]
        errors = [e for n, e, _ in part[where]["errors"].values() if n == name and e is not None]
        ratio: Floats = np.array(errors) / median
        shift = np.random.default_rng(8861).uniform(-0.3, 0.3, len(ratio))
        axis.semilogx(ratio, y + shift, ".", ms=2.5, color=OURS)
        far = ratio > 3
        axis.semilogx(ratio[far], (y + shift)[far], "o", ms=4, color=FAILS)
    axis.axvline(3, color="k", ls="--", lw=0.8)
    axis.axvline(1, color=GREY, lw=0.8)
    axis.set_yticks(range(len(rows)), [f"{where}: {name}" for where, name in rows], fontsize=8)
    axis.set_xlim(0.04, 10)
    axis.set_xticks([0.1, 0.3, 1, 3, 10], ["0.1", "0.3", "1", "3", "10"])
    axis.set_xlabel("error of K over the median of the class")
    axis.invert_yaxis()
    return figure


def locking(part: Part, plt: Any) -> Any:
    """Error of K as Poisson's ratio tends to a half."""
    figure, axis = plt.subplots(figsize=(5.5, 3.8))
    distance = 0.5 - np.array(part["nu"])
    for name, colour in (("order 1, n 40", FAILS), ("order 2, n 20", OURS)):
        axis.loglog(distance, part[name], "o-", color=colour, label=name)
    axis.invert_xaxis()
    axis.set(xlabel="0.5 - ν", ylabel="error of K")
    axis.legend()
    return figure


def turned(part: Part, plt: Any) -> Any:
    """Length and K of a crack that turns, by the update of its level sets."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8))
    for update, colour in (("nodal", FAILS), ("explicit", OURS)):
        if f"length, {update}" in part:
            axes[0].plot(part["degrees"], part[f"length, {update}"], "o-", color=colour)
            axes[1].semilogy(part["degrees"], part[f"error of K, {update}"], "o-", color=colour,
                             label=update)  # fmt: skip
    axes[0].set(ylabel="length of the crack in the mesh, over its own", ylim=(0, 1.15))
    axes[1].set(ylabel="error of K over the largest")
    for axis in axes:
        axis.set_xlabel("degrees that the crack has turned")
    axes[1].legend()
    return figure


PICTURES = {
    "infsup": (infsup, "infsup"), "pressure": (pressure, "pressure"),
    "condition": (condition, "condition"), "cuts": (cuts, "slivers"),
    "drawn": (drawn, "drawn"), "locking": (locking, "incompressible"),
    "turned": (turned, "turned"),
}  # fmt: skip


def draw_all(results: dict[str, Part], folder: Path) -> None:
    """Draw every picture whose part has been run."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    for name, (picture, part) in PICTURES.items():
        if part in results:
            figure = picture(results[part], plt)
            for axis in figure.axes:
                axis.grid(True, which="major", color="#e4e4e4", lw=0.6)
                axis.set_axisbelow(True)
            figure.tight_layout()
            figure.savefig(folder / f"stability_{name}.png", dpi=130)
            plt.close(figure)
            print(f"   {folder / f'stability_{name}.png'}")
