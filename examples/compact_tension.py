"""Compact tension after ASTM E399 and E647: pins in holes, K over the crack length, and the life.

A standard specimen of width W = 50 mm is pulled at two pins. The standards give K as
K = P / (B sqrt(W)) f(a/W), a polynomial within 0.5 % for 0.2 <= a/W <= 1. The pins press on the
holes with a cosine: over 180° as a pin without clearance does, and over 60° as one that rolls on
the flattened holes of E399 does. Then the crack grows from a/W = 0.3 to 0.7 under a constant force,
and its life is compared with the integral of the polynomial.

Units: N, mm, MPa; forces for a thickness of 1 mm. Pictures, ParaView files and tables go to
out/compact_tension.
"""

# %% The specimen; the slot of the machined notch is a part of the crack
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

import xcrack as xc

OUT = Path("out/compact_tension")
OUT.mkdir(parents=True, exist_ok=True)
W, FORCE = 50.0, 100.0
ALUMINIUM = xc.Isotropic(E=72e3, nu=0.33, plane="strain")
LAW = xc.paris(C=5e-13, m=3.0)
MESH = xc.read_mesh(Path(__file__).parent / "meshes" / "compact_tension.msh")


def standard(a):
    """K of ASTM E399 and E647, compact specimen, for the length a from the load line."""
    x = a / W
    f = (2 + x) * (0.886 + 4.64 * x - 13.32 * x**2 + 14.72 * x**3 - 5.6 * x**4) / (1 - x) ** 1.5
    return FORCE / np.sqrt(W) * f


def specimen(a, contact_angle):
    """Two pins pull; their forces balance, and no support is needed."""
    return xc.Problem(
        MESH,
        ALUMINIUM,
        cracks=[xc.line_crack([(-0.26 * W, 0.0), (a, 0.0)])],
        loads=[
            xc.bearing("hole_0", (0.0, FORCE), contact_angle=contact_angle),
            xc.bearing("hole_1", (0.0, -FORCE), contact_angle=contact_angle),
        ],
    )


# %% K over the crack length for both pins
SHARES = np.array([0.3, 0.4, 0.45, 0.5, 0.55, 0.6, 0.7])
ANGLES = {"180°": np.pi, "60°": np.pi / 3}
error = {}
for name, angle in ANGLES.items():
    K = [xc.stress_intensity(xc.solve(specimen(s * W, angle))).K_I[0] for s in SHARES]
    error[name] = np.array(K) / standard(SHARES * W) - 1
print("a/W     " + "".join(f"pin {name:<8}" for name in ANGLES))
for i, s in enumerate(SHARES):
    print(f"{s:<8.2f}" + "".join(f"{error[name][i]:<+12.2%}" for name in ANGLES))
with open(OUT / "K.csv", "w", newline="", encoding="utf-8") as file:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["a/W", "K of the standard", *(f"error, pin {name}" for name in ANGLES)])
    writer.writerows(zip(SHARES, standard(SHARES * W), *error.values(), strict=True))

# %% Growth; what the pins carry is in the report
first = specimen(0.3 * W, ANGLES["60°"])
solution = xc.solve(first)
for row in solution.report.resultants:
    print(row)
print(xc.measures(first.cracks[0], MESH))
history = xc.collect(
    xc.grow(first, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=1.0, progress=False),
    until=lambda step: step.sif[0][0].x[0, 0] >= 0.7 * W - 1e-6,
)
table = history.table()
a, N = table["x"], table["N"]


def life(to):
    """Cycles from the first length to another by the polynomial."""
    return quad(lambda length: 1 / (LAW.C * standard(length) ** LAW.m), a[0], to, epsrel=1e-9)[0]


exact = np.array([life(length) for length in a])
life_error = N[1:] / exact[1:] - 1
print(f"{N[-1]:.0f} cycles to a/W = {a[-1] / W:.2f}; the polynomial says {exact[-1]:.0f}")

# %% Pictures
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
for (name, values), mark in zip(error.items(), "os", strict=True):
    left.plot(SHARES, 100 * values, f"-{mark}", ms=5, label=f"pin over {name}")
left.axhspan(-0.5, 0.5, color="0.9", label="accuracy of the polynomial")
left.set(xlabel="a/W", ylabel="K against the standard, %")
left.legend(frameon=False)
right.plot(exact / 1000, a, "k-", lw=1.2, label="polynomial, integrated")
right.plot(N / 1000, a, "C0o", ms=4, label="xcrack")
right.set(xlabel="thousand cycles", ylabel="crack length a, mm")
right.legend(frameon=False)
figure.savefig(OUT / "K_and_life.png", dpi=150)
last = history.solved[-1].solutions[-1]
xc.plot(last, "von_mises", warp=100.0, file=OUT / "von_mises.png", renderer="matplotlib")
xc.plot(last, "syy", zoom=1.1, file=OUT / "tip.png")
history.write(OUT)

# %% Checks
inner = (SHARES >= 0.45) & (SHARES <= 0.55)
for values in error.values():
    assert np.abs(values[inner]).max() < 0.01
    assert np.abs(values).max() < 0.015
assert abs(life_error[-1]) < 0.01
assert np.abs(table["y"]).max() < 0.02  # straight
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
