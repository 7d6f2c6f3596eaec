"""The picture of the README, drawn from what examples/cylinder_bending.py leaves.

python scripts/front_page.py out/cylinder_bending docs/figures/front_page.png
"""

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.tri import Triangulation

from xcrack.base.arrays import Floats
from xcrack.view.pyvista import BAR

_NOMINAL = 100.0  # MPa, ends of the colours of the bar
_RADIUS, _DEPTH = 10.0, 2.0  # of the bar and its notch, mm
_CELL = 0.6  # mm: triangles with longer sides than three lie across a gap
_SIZE = 16  # points, so that half the size is read
_LOOKS = (
    ("before", "0.55", "-", "before the turn"),
    ("with contact", "C0", "-", "after it, with contact"),
    ("without", "C3", "--", "after it, without contact"),
)


def main(folder: Path, file: Path) -> None:
    """Draw the bar above, fronts and crack faces below."""
    figure = Figure(figsize=(14.0, 13.0), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[0.33, 0.67])
    _bar(above, imread(folder / "bar_after_the_turn.png"))
    left, right = below.subfigures(1, 2, width_ratios=[0.47, 0.53])
    _fronts(left, folder / "fronts.csv")
    faces = right.subplots(3, 1)
    run = folder / "run" / "full"
    last = sorted((run / "before_lips").glob("*.npz"))[-1]
    first = [run / f"{name}_lips" / "0000.npz" for name in ("with contact", "without")]
    before, closed, overlapping = (np.load(each) for each in (last, *first))
    opening = {"cmap": "RdBu", "label": "opening, µm"}
    for axis, lips, values, title, look in (
        (faces[0], before, 1e3 * before["gap"], "before the turn", opening),
        (faces[1], closed, closed["pressure"], "after it, with contact",
         {"cmap": "magma_r", "label": "pressure, MPa"}),
        (faces[2], overlapping, 1e3 * overlapping["gap"],
         "after it, without contact (red: overlap)", opening),
    ):  # fmt: skip
        _face(right, axis, lips["x"], values, title, **look)
    figure.savefig(file, dpi=100)


def _bar(figure: Any, image: Floats) -> None:
    """The bar of the example, with a colour bar in the font of the rest."""
    axis = figure.subplots()
    image = image[:, : image.shape[1] - BAR]
    inked = np.any(image[..., :3] < 0.99, axis=2)
    rows, columns = np.nonzero(inked.any(axis=1))[0], np.nonzero(inked.any(axis=0))[0]
    axis.imshow(image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    axis.axis("off")
    colours = ScalarMappable(Normalize(-_NOMINAL, _NOMINAL), "RdBu_r")
    bar = figure.colorbar(colours, ax=axis, shrink=0.9, ticks=[-100, -50, 0, 50, 100])
    bar.set_label("stress along the bar, MPa", fontsize=_SIZE)
    bar.ax.tick_params(labelsize=_SIZE)


def _section(axis: Any) -> None:
    """Outline of the section, without axes, cut above where nothing is shown."""
    half = np.arccos((_RADIUS - _DEPTH) / _RADIUS)
    angle = np.linspace(-np.pi / 2 + half, 3 * np.pi / 2 - half, 200)
    axis.plot(_RADIUS * np.cos(angle), _RADIUS * np.sin(angle), "k-", lw=1.5)
    side, root = _RADIUS * np.sin(half), _DEPTH - _RADIUS
    axis.plot([-side, side], [root, root], "k--", lw=1.2)
    axis.set_aspect("equal")
    axis.axis("off")


def _fronts(figure: Any, file: Path) -> None:
    axis = figure.subplots()
    _section(axis)
    with file.open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    for name, color, style, label in _LOOKS:
        steps = sorted({int(row["step"]) for row in rows if row["run"] == name})
        for step in steps:
            line = np.array([(float(row["y"]), float(row["z"])) for row in rows
                             if row["run"] == name and int(row["step"]) == step])  # fmt: skip
            axis.plot(*line.T, style, color=color, lw=2, label="" if step else label)
    axis.set_title("fronts of the crack, seen along the bar", fontsize=_SIZE)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0.02), fontsize=_SIZE, frameon=False)


def _face(
    figure: Any, axis: Any, x: Floats, values: Floats, title: str, *, cmap: str, label: str
) -> None:
    """Values on the faces of the crack."""
    mesh = Triangulation(x[:, 1], x[:, 2])
    corner = np.stack([x[mesh.triangles, 1], x[mesh.triangles, 2]], axis=-1)
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=-1).max(axis=1)
    mesh.set_mask(longest > 3 * _CELL)
    most = float(np.abs(values).max())
    least = -most if cmap == "RdBu" else 0.0
    shown = axis.tripcolor(mesh, values, shading="gouraud", cmap=cmap, vmin=least, vmax=most)
    _section(axis)
    axis.set_ylim(-8.3, 2.0)
    axis.set_title(title, fontsize=_SIZE)
    bar = figure.colorbar(shown, ax=axis, shrink=0.9)
    bar.set_label(label, fontsize=_SIZE)
    bar.ax.tick_params(labelsize=_SIZE)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
