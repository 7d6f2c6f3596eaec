"""The picture of the README, put together from those of examples/cylinder_bending.py.

python scripts/front_page.py out/cylinder_bending docs/figures/front_page.png
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.image import imread

_PARTS = ("bar_after_the_turn.png", "fronts.png", "lips.png")


def main(folder: Path, file: Path) -> None:
    """Compose the picture: the bar above, fronts and crack faces below."""
    bar, fronts, faces = (imread(folder / name) for name in _PARTS)
    figure = Figure(figsize=(9.33, 6.33), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[0.46, 0.54])
    _shown(above.subplots(), bar)
    left, right = below.subfigures(1, 2, width_ratios=[0.42, 0.58])
    _shown(left.subplots(), fronts)
    _shown(right.subplots(), faces)
    figure.savefig(file, dpi=150)


def _shown(axes, image) -> None:  # type: ignore[no-untyped-def]
    axes.imshow(image)
    axes.axis("off")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
