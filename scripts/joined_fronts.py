"""Put the picture of joined fronts together: two pennies, two corner cracks at a hole.

python scripts/joined_fronts.py docs/figures/joined_fronts.png
"""

import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt

import xcrack as xc
from xcrack.verification.book.cases import corner_at_hole as hole
from xcrack.verification.book.scenes_3d import graded, lines
from xcrack.view.fronts_3d import front_axes


def two_pennies() -> xc.History:
    """Coplanar, of radius 1, a gap of 1 between them."""
    mesh = graded(
        [lines(-9, 9, (-3.2, 3.2), 0.3, 2.0), lines(-9, 9, (-2.6, 2.6), 0.3, 2.0),
         lines(-8, 8, (-0.3, 0.3), 0.3, 2.0)], seed=3, amplitude=0.0,
    )  # fmt: skip
    problem = xc.Problem(
        mesh,
        xc.Isotropic(1000.0, 0.3),
        [xc.penny_crack((x, -0.0315, 0.0175), (0, 0, 1), 1.0, n=64) for x in (-1.48, 1.52)],
        loads=[xc.traction("top", (0, 0, 1.0)), xc.traction("bottom", (0, 0, -1.0))],
        contact="off",
        order=1,
    )
    return grown(problem, 0.2, 14)


def two_corners() -> xc.History:
    """Quarter circles of radius 0.6 at both ends of a hole of radius 2 through a plate 2 thick."""
    problem = xc.Problem(
        hole._plate(0.2),
        xc.Isotropic(1e3, 0.3),
        [xc.elliptic_crack((hole._R, 0.0, z), (0, 1, 0), (1, 0, 0), 0.6, 0.6) for z in (2.0, 0.0)],
        loads=[xc.traction("rim", hole._pull)],
        contact="off",
        order=1,
    )
    return grown(problem, 0.15, 8)


def grown(problem: xc.Problem, da: float, steps: int) -> xc.History:
    """A run by Paris' law."""
    law, cycle = xc.paris(C=1e-3, m=3.0), xc.Cycle(0.0, 1.0)
    history = xc.collect(
        xc.grow(problem, law, xc.max_hoop_stress, cycle, da=da, max_steps=steps, progress=False)
    )
    for step in history.steps:
        print(step.index, f"{step.cycles:.5g}", *step.joins, sep="  ")
    return history


def main(file: Path) -> None:
    """Run both and draw them side by side."""
    warnings.simplefilter("ignore")
    figure, axes = plt.subplots(
        1, 2, figsize=(9.6, 3.9), width_ratios=(1.5, 1.0), layout="constrained"
    )
    for ax, make in zip(axes, (two_pennies, two_corners)):
        history = make()
        front_axes(ax, [history.steps], 0, None, history.mesh, [""])
    axes[0].set(xlim=(-4.2, 4.3), ylim=(-3.4, 3.4))
    axes[1].set(xlim=(1.7, 3.8), ylim=(-0.15, 2.15))
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
