"""Two hundred random flaws in a plate with three holes: lives, and what inspections find in time.

Drilling leaves flaws at the rims of holes: at any angle, of lognormal depth. Each of them is a case
of a campaign: a crack that grows until its K reaches the toughness, or not at all. The lives of all
flaws are the life of the plate with a flaw, and the looks of an inspection plan that all miss a
crack make its probability of failure. After a kill the same command goes on with the study.

``python flaw_campaign.py --quick`` runs 12 flaws; ``--workers 2`` two at a time.
Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and a table go to out/flaw_campaign.
"""

import argparse
import csv
from functools import cache
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy as np

import xcrack as xc

OUT = Path("out/flaw_campaign")
MESH = Path(__file__).resolve().parent / "meshes" / "three_holes.msh"
HOLES = (((14.0, 22.0), 4.0), ((34.0, 14.0), 5.0), ((48.0, 27.0), 3.0))
STRESS, K_C = 100.0, 750.0
LAW = xc.paris(C=3e-13, m=3.0, threshold=xc.klesnil_lukas(dK0=150.0, gamma=0.0))
POD = xc.logistic_pod(a50=2.5, s=0.25)  # depth that a look finds in half of all cases
INTERVALS = (15e3, 30e3, 60e3)
SERVICE = 120e3  # cycles that the plate shall live


# %% A case: one flaw, as a function of numbers
@cache
def mesh():
    return xc.read_mesh(MESH)


def flawed(hole, angle, depth):
    """The plate with a radial flaw at the rim of a hole, which begins inside of the hole."""
    (x, y), r = HOLES[hole]
    out = np.array([np.cos(angle), np.sin(angle)])
    ends = np.array([x, y]) + np.array([[r - 0.3], [r + depth]]) * out
    return xc.Problem(
        mesh(),
        xc.Isotropic(E=210e3, nu=0.3, plane="stress"),
        cracks=[xc.line_crack(ends)],
        supports=[xc.fix((0.0, 0.0)), xc.fix((60.0, 0.0), axis=1)],
        loads=[xc.traction("top", (0.0, STRESS)), xc.traction("bottom", (0.0, -STRESS))],
    )


def grown(hole, angle, depth):
    """History of a flaw under pulsating tension."""
    steps = xc.grow(
        flawed(hole, angle, depth),
        LAW,
        xc.max_hoop_stress,
        xc.Cycle(0.0, 1.0),
        da=1.5,
        K_c=K_C,
        max_steps=15,
        progress=False,
    )
    return xc.collect(steps)


def case(hole, angle, depth):
    """Numbers of a flaw: K at first, life, and the chance that all looks miss it."""
    history = grown(hole, angle, depth)
    first = float(history.steps[0].sif[-1][0].K[0, 0])
    row = {"K": first, "ended": history.ended, "steps": len(history.steps)}
    if len(history.steps) < 2:  # below the threshold, or shut by compression
        return {**row, "life": np.inf, "length": depth} | dict.fromkeys(map(missed, INTERVALS), 1.0)
    row |= {"life": history.life, "length": float(history.table()["a"][-1])}
    for interval in INTERVALS:
        look = xc.inspection(history, interval=interval, pod=POD)
        row[missed(interval)] = look.missed
    return row


def missed(interval):
    """Column of the chance that all looks of a plan miss."""
    return f"missed_{interval:.0f}"


def flaws(n, seed=20270):
    """Holes, angles and depths, drawn."""
    draw = np.random.default_rng(seed)
    return [
        {
            "hole": int(draw.integers(len(HOLES))),
            "angle": float(draw.uniform(0, 2 * np.pi)),
            "depth": float(1.5 * np.exp(0.25 * draw.standard_normal())),
        }
        for _ in range(n)
    ]


def main():
    """Run the study, draw it, and check it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="12 flaws")
    parser.add_argument("--workers", type=int, default=1)
    options, _ = parser.parse_known_args()
    OUT.mkdir(parents=True, exist_ok=True)
    cases = flaws(12 if options.quick else 200)

    # %% The study: each finished case is a file; the same call goes on after a kill
    study = xc.campaign(case, cases, path=OUT / "study", workers=options.workers)
    table = study.table()
    assert not study.failed, study.failed[0]
    life = table["life"]
    grows = np.isfinite(life)
    print(f"{len(life)} flaws: {grows.sum()} grow, {(life < SERVICE).sum()} break in service")
    with (OUT / "lives.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table.dtype.names)
        writer.writerows(table.tolist())

    # %% Probability of failure in service, with no looks and by the interval between looks
    fails = life < SERVICE
    none = fails.mean()
    print(f"probability of failure in {SERVICE:.0f} cycles without a look: {none:.3f}")
    chance = {}
    for interval in INTERVALS:
        chance[interval] = float((fails * table[missed(interval)]).mean())
        print(f"  a look every {interval:6.0f} cycles: {chance[interval]:.4f}")

    # %% The plate: where flaws are dangerous
    figure, axis = plt.subplots(figsize=(10, 6.4), layout="constrained")
    axis.add_patch(plt.Rectangle((0, 0), 60, 40, fc="0.96", ec="k", lw=1.2))
    for centre, radius in HOLES:
        axis.add_patch(plt.Circle(centre, radius, fc="white", ec="k", lw=1.2))
    centre = np.array([HOLES[h][0] for h in table["hole"].astype(int)])
    radius = np.array([HOLES[h][1] for h in table["hole"].astype(int)])
    out = np.stack([np.cos(table["angle"]), np.sin(table["angle"])], axis=1)
    rim, tip = (centre + (radius + d)[:, None] * out for d in (0.0, table["depth"]))
    for a, b in zip(rim[~grows], tip[~grows]):
        axis.plot(*np.stack([a, b]).T, color="0.6", lw=1.5)
    colours = plt.get_cmap("plasma")
    low, high = np.log10([life[grows].min(), life[grows].max() * 1.001])
    scale = plt.Normalize(low, high)
    for a, b, N in zip(rim[grows], tip[grows], np.log10(life[grows])):
        axis.plot(*np.stack([a, b]).T, color=colours(scale(N)), lw=2)
    bar = figure.colorbar(plt.cm.ScalarMappable(scale, colours), ax=axis, shrink=0.8)
    bar.set_label("log10 of the life in cycles")
    title = "flaws by their lives; grey ones do not grow (tension from top to bottom)"
    axis.set(xlabel="x, mm", ylabel="y, mm", aspect="equal", title=title)
    figure.savefig(OUT / "flaws.png", dpi=140)

    # %% Lives of all flaws
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.3), layout="constrained")
    N = np.sort(life)
    share = np.arange(1, len(N) + 1) / len(N)
    axes[0].step(N[np.isfinite(N)], share[np.isfinite(N)], where="post")
    axes[0].axvline(SERVICE, color="0.5", ls="--", lw=0.8)
    axes[0].text(SERVICE, 0.02, " service", color="0.4", fontsize="small")
    axes[0].set(xlabel="life in cycles", ylabel="share of the flaws that broke", xscale="log")
    axes[0].set(ylim=(0, 1))
    axes[0].xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    plans = ["no look", *(f"every {interval / 1e3:.0f} k" for interval in INTERVALS[::-1])]
    values = [none, *(chance[interval] for interval in INTERVALS[::-1])]
    axes[1].bar(plans, np.maximum(values, 1e-6), color="C1")
    axes[1].set(yscale="log", ylabel=f"probability of failure in {SERVICE / 1e3:.0f} k cycles")
    axes[1].set(title="inspection plans")
    figure.savefig(OUT / "lives.png", dpi=140)

    # %% The worst flaw once more, with its fields
    worst = cases[int(np.argmin(life))]
    history = grown(**worst)
    history.write(OUT)
    xc.plot(history.solved[-1].solutions[-1], "von_mises", warp=40.0, file=OUT / "worst.png")

    # %% Checks
    assert history.life == life.min()  # a case is the same run, wherever it is run
    across = np.abs(np.cos(table["angle"])) > 0.97  # flaws square to the tension are the worst
    along = np.abs(np.sin(table["angle"])) > 0.97
    assert grows[across].all()
    # every crack has come to its end: the toughness, another hole or a side, or rest
    assert not [row["ended"] for row in table if row["ended"].startswith("max_steps")]
    assert not grows[along].any()  # in compression: shut
    assert 0 <= chance[INTERVALS[0]] <= chance[INTERVALS[-1]] <= none
    again = xc.campaign(case, cases, path=OUT / "study")
    assert [row["seconds"] for row in again.rows] == [row["seconds"] for row in study.rows]
    print(f"pictures, ParaView files and tables are in {OUT.resolve()}")


if __name__ == "__main__":
    main()
