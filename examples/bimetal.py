"""A bimetal: it bends when it is cooled, and where its layers part the interface has a K.

Two strips of unlike expansion are bonded and cooled. How far they bend is known (Timoshenko, 1925),
and so is what a long split between them releases: the energy that the bonded strips hold, since
split ones bend freely. A crack along the interface has a complex K, whose phase says how much of it
opens and how much shears.

Units: N, mm, MPa; G in N/mm. Pictures, ParaView files and a table go to out/bimetal.
"""

# %% Two strips, plane stress, cooled by 100 degrees
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/bimetal")
OUT.mkdir(parents=True, exist_ok=True)
LENGTH, HEIGHT, CHANGE = 60.0, 2.0, -100.0  # of the strip, of each layer, degrees
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="stress", alpha=1.2e-5)
BRASS = xc.Isotropic(E=100e3, nu=0.3, plane="stress", alpha=1.9e-5)


def strip(cells, cracks=()):
    """Steel above brass, with a number of cells over the height of each layer."""
    n = round(LENGTH / HEIGHT * cells)
    mesh = xc.box((0.0, -HEIGHT), (LENGTH, HEIGHT), (n, 2 * cells))
    mesh = mesh.with_cell_sets({"steel": lambda x: x[:, 1] > 0, "brass": lambda x: x[:, 1] < 0})
    materials = {"steel": STEEL, "brass": BRASS}
    cold = [xc.temperature(CHANGE)]
    return xc.Problem(mesh, materials, cracks, loads=cold)


# %% Beam theory: strain e + k y across the layers, with the least energy
y, weight = np.polynomial.legendre.leggauss(4)
layers = [(STEEL, HEIGHT / 2), (BRASS, -HEIGHT / 2)]
matrix, right, free = np.zeros((2, 2)), np.zeros(2), 0.0
for material, middle in layers:
    place = np.stack([np.ones(4), middle + y * HEIGHT / 2])
    stiff = material.E * weight * HEIGHT / 2
    unlike = material.alpha * CHANGE
    matrix += (place * stiff) @ place.T
    right += place @ stiff * unlike
    free += stiff.sum() * unlike**2
strain, curvature = np.linalg.solve(matrix, right)
G_long = 0.5 * (free - right @ (strain, curvature))  # energy by length: all of it is released
print(f"beam theory: radius {1 / abs(curvature):.1f} mm, G of a long split {G_long:.5f} N/mm")

# %% The strip bends as the beam does, away from its ends
whole = xc.solve(strip(6))
x = np.linspace(LENGTH / 4, 3 * LENGTH / 4, 41)
u = whole.displacement(np.stack([x, np.full(41, 0.01)], axis=1))
bent = 2 * np.polyfit(x, u[:, 1], 2)[0]
print(f"curvature {bent:.6e} per mm, of the beam {-curvature:.6e}")
assert abs(abs(bent / curvature) - 1) < 2e-3

# %% Splits of several lengths: G comes to that of the beam, the phase stays
rows = []
for a in (1.0, 2.0, 4.0, 8.0, 16.0):
    split = xc.solve(strip(8, [xc.line_crack([(-1.0, 0.0), (a, 0.0)])]))
    sif = xc.interface_intensity(split, length=HEIGHT)
    rows.append((a, sif.G[0], sif.K_1[0], sif.K_2[0], sif.phase[0]))
    words = "a = {:4.1f} mm: G = {:.5f} N/mm, K_1 {:7.2f}, K_2 {:7.2f}, phase {:6.1f}"
    print(words.format(*rows[-1]))
assert abs(rows[-1][1] / G_long - 1) < 5e-3
assert abs(rows[-1][4] - rows[-2][4]) < 0.5

# %% A table and pictures
with (OUT / "bimetal.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([["a", "G", "K_1", "K_2", "phase"], *rows])
xc.write(split, OUT / "split")
xc.plot(split, "sxx", file=OUT / "split.png", warp=15.0)
figure, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
a, G = np.array(rows)[:, :2].T
axes.plot(a / HEIGHT, G, "o-", label="crack along the interface")
axes.axhline(G_long, color="0.4", linestyle="--", label="beam theory, a long split")
axes.set(xlabel="length of the split over the height of a layer", ylabel="G in N/mm")
axes.set_ylim(0, None)
axes.legend(frameon=False)
figure.savefig(OUT / "G.png", dpi=110)
plt.close(figure)
print(f"pictures, ParaView files and a table are in {OUT.resolve()}")
