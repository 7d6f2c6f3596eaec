"""The life of an edge-cracked plate, compared with the life integrated from a table of K.

A plate 50 mm wide and 100 mm high is pulled at its ends. A crack grows from its left edge, from 10
to 25 mm, in ten steps. K at five lengths is known to five digits, and integrating the growth law
over the length gives the life.

Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and tables go to
out/edge_crack_growth.
"""

# %% Reference: K over the length, and from it the life
import csv
import shutil
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

import xcrack as xc

OUT = Path("out/edge_crack_growth")
OUT.mkdir(parents=True, exist_ok=True)
MESHES = Path(__file__).parent / "meshes"
W, SIGMA = 50.0, 60.0
A0, A1, DA = 10.0, 25.0, 1.5
MINIMUM, MAXIMUM = 0.1, 1.0
LAW = xc.elber(C=1.4e-11, m=2.9, a=0.5, b=0.4)

# F = K / (sigma sqrt(pi a)) of a plate of height 2 W under uniform traction, over a / W. From a
# least-squares solution of the boundary value problem, good to 1e-5 (`PLATE_EDGE` of
# xcrack.verification.exact.plates); it lies within 0.1 % of Kaya and Erdogan's (1987) values for
# the long strip.
TABLE = {0.2: 1.36822, 0.3: 1.66114, 0.4: 2.11277, 0.5: 2.82547, 0.6: 4.03334}
share = np.array(list(TABLE))
# F grows like (1 - a/W)^(-3/2) towards the far edge; a quartic interpolates the rest.
quartic = np.polyfit(share, np.array(list(TABLE.values())) * (1 - share) ** 1.5, 4)


def exact_K(a):
    """K at the largest load."""
    return SIGMA * np.sqrt(np.pi * a) * np.polyval(quartic, a / W) / (1 - a / W) ** 1.5


def exact_rate(a):
    """Growth a cycle, mm."""
    return LAW((MAXIMUM - MINIMUM) * exact_K(a), MINIMUM / MAXIMUM)


def exact_life(a):
    """Cycles from A0 to a."""
    return quad(lambda x: 1 / exact_rate(x), A0, a, epsrel=1e-12)[0]


# %% Cycles between two steps: a power law through both rates, or the initial rate (Euler)
rules = []
for steps in (5, 10, 20, 40):
    a = np.linspace(A0, A1, steps + 1)
    rate = exact_rate(a)
    power_law = xc.cycles_between(a[:-1], a[1:], rate[:-1], rate[1:]).sum()
    euler = (np.diff(a) / rate[:-1]).sum()
    rules.append(
        {
            "steps": steps,
            "power law": power_law / exact_life(A1) - 1,
            "Euler": euler / exact_life(A1) - 1,
        }
    )
print("error of the life with exact K")
print("steps   power law       Euler")
for row in rules:
    print(f"{row['steps']:5d}  {row['power law']:10.2e}  {row['Euler']:10.2e}")


def order(name):
    """Order of a rule, from the last two rows."""
    return np.log2(abs(rules[-2][name] / rules[-1][name]))


# %% The run: the path is computed, not prescribed to be straight
plate = xc.Problem(
    xc.read_mesh(MESHES / "edge_crack.msh"),
    xc.Isotropic(E=210e3, nu=0.3, plane="strain"),
    cracks=[xc.line_crack([(0.0, 0.0), (A0, 0.0)])],
    loads=[xc.traction("top", (0.0, SIGMA)), xc.traction("bottom", (0.0, -SIGMA))],
)
options = {
    "law": LAW,
    "criterion": xc.max_hoop_stress,
    "cycle": xc.Cycle(MINIMUM, MAXIMUM),
    "da": DA,
    "max_steps": round((A1 - A0) / DA) + 1,
}
history = xc.collect(xc.grow(plate, **options))
table = history.table()
K, a, y = table["K_I_max"], table["a"], table["y"]
print(history.solved[-1].solutions[-1].report)

# %% The same run, stopped and resumed from disk
shutil.rmtree(OUT / "run", ignore_errors=True)  # collect does not replace a run
stopped = xc.collect(
    xc.grow(plate, **options), path=OUT / "run", until=lambda step: step.index == 4
)
print(f"stopped: {stopped.ended}; on disk: {len(xc.load(OUT / 'run').steps)} steps")
resumed = xc.resume(OUT / "run", plate, **options)
print(f"resumed: {resumed}")

# %% K over the length, the life, and the errors of both
K_error = K / exact_K(a) - 1
known_life = np.array([exact_life(length) for length in a])
life_error = table["N"][1:] / known_life[1:] - 1
with (OUT / "table.csv").open("w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(["a", "K", "K / table - 1", "N", "N / integrated - 1", "y of the tip"])
    writer.writerows(zip(a, K, K_error, table["N"], [0.0, *life_error], y, strict=True))
print("     a        K     error           N     error    y of the tip")
for row in zip(a, K, K_error, table["N"], [0.0, *life_error], y, strict=True):
    print("{:6.1f} {:8.2f} {:9.1e} {:11.1f} {:9.1e}    {:12.1e}".format(*row))

fine = np.linspace(A0, A1, 200)
figure, axes = plt.subplots(
    2, 2, figsize=(11, 6), layout="constrained", sharex="col", height_ratios=(3, 1.2)
)
(upper, life_axis), (lower, gap) = axes
upper.plot(fine, exact_K(fine), "k-", lw=1.2, label="through the table")
knots = W * share[:4]  # the fifth is beyond the last step
upper.plot(knots, exact_K(knots), "ks", ms=7, mfc="none", label="table, plate with H/W = 1")
upper.plot(a, K, "C0o", ms=4, label="xcrack")
upper.set(ylabel=r"$K_I$ at the largest load, MPa$\sqrt{\mathrm{mm}}$")
upper.legend()
lower.axhline(0, color="0.6", lw=0.8)
lower.plot(a, 100 * K_error, "C0o-", ms=4)
lower.set(xlabel="crack length a, mm", ylabel="error of K, %", ylim=(-0.05, 0.05))
life_axis.plot([exact_life(v) / 1000 for v in fine], fine, "k-", lw=1.2, label="table, integrated")
life_axis.plot(table["N"] / 1000, a, "C0o", ms=4, label="xcrack, local power law")
euler = np.concatenate([[0.0], np.cumsum(np.diff(a) / table["rate"][:-1])])
life_axis.plot(euler / 1000, a, "C3x", ms=5, label="same rates, Euler")
life_axis.set(ylabel="crack length a, mm")
life_axis.legend()
gap.axhline(0, color="0.6", lw=0.8)
gap.plot(table["N"][1:] / 1000, 100 * life_error, "C0o-", ms=4)
gap.set(xlabel="thousand cycles", ylabel="error of N, %", ylim=(-0.5, 0.5))
figure.savefig(OUT / "life.png", dpi=150)

# %% The last step, and a series for ParaView
last = history.solved[-1].solutions[-1]
xc.plot(last, "von_mises", warp=50.0, file=OUT / "von_mises.png")
history.write(OUT)

# %% Checks
assert np.abs(K_error).max() < 0.005
assert abs(life_error[-1]) < LAW.m * np.abs(K_error).max() + 0.003
assert np.abs(np.diff(y)).max() < 0.02 * DA  # straight, on a mesh that is not symmetric
assert abs(rules[1]["power law"]) < 0.003  # ten steps
assert abs(rules[1]["Euler"]) > 0.15
assert order("power law") > 1.8
assert order("Euler") < 1.2
assert np.array_equal(resumed.table(), table)  # to the last bit
assert resumed.ended == history.ended
print(f"largest error of K {np.abs(K_error).max():.1e}, of the life {life_error[-1]:.1e}")
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
