"""A cold-worked hole: residual stress from a file holds a crack shut, with and without contact.

An oversized mandrel drawn through a hole leaves hoop compression around it. Here another program's
result is imitated: the exact residual stress of a thick ring that yielded out to a radius C under
internal pressure and was unloaded (Tresca, no reyielding), written on a mesh of its own as a vtu
file. A crack of a/R = 0.5 ... 1.3 at the hole of a plate under tension reads it back. Without
contact K at rest is negative, and the faces pass through each other. With contact they press on
each other near the hole, and the tension beyond the plastic zone leaves a small K: the ratio of the
cycle that the tip sees is above zero, where the plain sum of both loads says that it is far below.

Units: N, mm, MPa. Pictures, ParaView files and a table go to out/cold_worked_hole.
"""

# %% The residual stress, as another program would give it
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/cold_worked_hole")
OUT.mkdir(parents=True, exist_ok=True)
R, PLASTIC, RING = 5.0, 8.0, 60.0  # hole, plastic zone, outer radius of the ring of the file
YIELD, TENSION = 350.0, 120.0
ALUMINIUM = xc.Isotropic(E=72e3, nu=0.33, plane="strain")
MESH = xc.read_mesh(Path(__file__).parent / "meshes" / "finite_plate.msh")


def residual(r):
    """Radial and hoop stress of a ring that yielded to PLASTIC and was unloaded (Hill, 1950)."""
    c2, b2 = PLASTIC**2, RING**2
    inside = r < PLASTIC
    log = np.log(PLASTIC / np.minimum(r, PLASTIC))
    plastic_r = -YIELD / 2 * (1 - c2 / b2) - YIELD * log
    elastic = YIELD * c2 / (2 * b2)
    sr = np.where(inside, plastic_r, elastic * (1 - b2 / r**2))
    st = np.where(inside, plastic_r + YIELD, elastic * (1 + b2 / r**2))
    pressure = YIELD / 2 * (1 - c2 / b2) + YIELD * np.log(PLASTIC / R)
    unload = pressure * R**2 / (b2 - R**2)
    return sr - unload * (1 - b2 / r**2), st - unload * (1 + b2 / r**2)


def tensor(x):
    """Stress of the ring at points (n, 2), as tensors (n, 2, 2)."""
    r, t = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    sr, st = residual(np.clip(r, R, RING))
    c, s = np.cos(t), np.sin(t)
    xx, yy, xy = sr * c**2 + st * s**2, sr * s**2 + st * c**2, (sr - st) * s * c
    return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)


# %% The file: rings of cells, finer towards the hole and at the edge of the plastic zone
def ring(n_around, radii):
    """Mesh of a ring around the origin."""
    angle = 2 * np.pi * np.arange(n_around) / n_around
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = (radii[:, None, None] * unit).reshape(-1, 2)
    i, k = np.arange(n_around), np.arange(len(radii) - 1)[:, None] * n_around
    j = (i + 1) % n_around
    a, b, c, d = (x.ravel() for x in (k + i, k + j, k + n_around + i, k + n_around + j))
    return points, np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])


def write_field(path):
    """Stress as six components xx yy zz xy yz xz at the points of a vtu file."""
    import meshio

    radii = np.concatenate([np.linspace(R, 10.0, 41), np.geomspace(10.5, 75.0, 40)])
    points, cells = ring(160, radii)
    sigma = tensor(points)
    six = np.zeros((len(points), 6))
    six[:, 0], six[:, 1], six[:, 3] = sigma[:, 0, 0], sigma[:, 1, 1], sigma[:, 0, 1]
    flat = np.column_stack([points, np.zeros(len(points))])
    meshio.Mesh(flat, [("triangle", cells)], point_data={"sigma": six}).write(path)


write_field(OUT / "residual.vtu")
FIELD = xc.read_field(OUT / "residual.vtu", "sigma")
print(FIELD)


# %% The plate with its crack, as it is made, and pulled; contact on and off
def plate(a, contact, stress=FIELD):
    """A crack of length a from the hole, across the tension."""
    return xc.Problem(
        MESH,
        ALUMINIUM,
        cracks=[xc.line_crack([(R, 0.0), (R + a, 0.0)])],
        loads=[
            xc.initial_stress(stress),
            xc.traction("top", (0.0, TENSION)),
            xc.traction("bottom", (0.0, -TENSION)),
        ],
        contact=contact,
    )


LENGTHS = R * np.array([0.5, 0.7, 0.9, 1.1, 1.3])
STATES = {"at rest": 0.0, "pulled": 1.0}
K = {}
for contact in ("auto", "off"):
    for a in LENGTHS:
        solutions = xc.solve(plate(a, contact), states=list(STATES.values()))
        sif = xc.stress_intensities(solutions)
        K[contact, a] = [s.K_I[0] for s in sif]
        if contact == "auto" and a == LENGTHS[0]:
            print(solutions[0].report["initial stress"])
            first = solutions
as_function = xc.stress_intensity(xc.solve(plate(LENGTHS[2], "off", tensor), states=[0.0])[0])
difference = K["off", LENGTHS[2]][0] / as_function.K_I[0] - 1
print(f"K of the file against K of the formula itself: {difference:+.2%}")

HEAD = ["a/R", *(f"{name}, {how}" for how in ("contact", "no contact") for name in STATES)]
print("".join(f"{name:>24}" for name in HEAD))
rows = [[a / R, *K["auto", a], *K["off", a]] for a in LENGTHS]
for row in rows:
    print("".join(f"{value:24.4g}" for value in row))
with open(OUT / "K.csv", "w", newline="") as file:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(HEAD)
    writer.writerows(rows)

# %% Pictures
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
r = np.linspace(R, 20, 400)
left.plot(r, residual(r)[1], label="hoop")
left.plot(r, residual(r)[0], label="radial")
left.axhline(0, color="0.6", lw=0.8)
left.set(xlabel="distance from the centre, mm", ylabel="residual stress, MPa")
left.legend(frameon=False)
for contact, mark, label in (("auto", "o-", "contact"), ("off", "s--", "no contact")):
    for k, name in enumerate(STATES):
        values = [K[contact, a][k] for a in LENGTHS]
        right.plot(LENGTHS / R, values, mark, color=f"C{k}", label=f"{name}, {label}", mfc="none")
right.axhline(0, color="0.6", lw=0.8)
right.set(xlabel="a / R", ylabel=r"$K_I$, MPa$\sqrt{\mathrm{mm}}$")
right.legend(frameon=False)
figure.savefig(OUT / "K.png", dpi=150)
xc.plot(first[1], "syy", zoom=4.0, file=OUT / "stress.png")
xc.write(first[0], OUT / "at_rest")

# %% Checks
assert abs(difference) < 0.01
for a in LENGTHS:
    (rest, pulled), (plain_rest, plain_pulled) = K["auto", a], K["off", a]
    assert rest >= 0  # contact: faces cannot pass through each other
    assert plain_rest < 0
    assert pulled >= plain_pulled - 0.01 * abs(plain_pulled)
# The compression at the hole nearly shuts the shortest crack; the tips of longer ones reach the
# tension beyond it, and are held open by faces that press on each other near the hole.
assert K["auto", LENGTHS[0]][0] < 0.01 * K["auto", LENGTHS[0]][1]
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
