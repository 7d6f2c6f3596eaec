"""A closed crack that rubs: a plate with an inclined crack under cyclic compression.

The faces press and slide back and forth against Coulomb's friction. The shear that the crack feels
is what friction cannot carry; on unloading the faces stick at first, so that K_II over the load is
a loop, and each cycle takes energy. The body is in a uniform stress but for the slip: the loops are
known exactly, up to one factor of the finite plate, and the example checks K_II and the energy
against them. Without friction K_II follows the load, and nothing is dissipated.

Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and tables go to out/compressed_crack.
"""

# %% The plate, and a cycle of compression in forty parts
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/compressed_crack")
OUT.mkdir(parents=True, exist_ok=True)
PLATE = xc.box((-20, -20), (20, 20), 40)
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
A, TURN = 6.0, np.radians(45.3)
AHEAD = np.array([np.cos(TURN), np.sin(TURN)])
CRACK = xc.line_crack([-A * AHEAD, A * AHEAD])
TIP = 1
HIGH, LOW = 100.0, 10.0  # compression, MPa
MU = (0.0, 0.3, 0.6)
N = 20  # instants up, and as many down
first = np.linspace(0, HIGH, N + 1)[1:]
down = np.linspace(HIGH, LOW, N + 1)[1:]
cycle = np.concatenate([down, down[::-1][1:], [HIGH]])
pressed = np.concatenate([first, cycle])  # the first load, then a whole cycle
last = slice(N - 1, None)


def plate(mu):
    loads = [xc.pressure("top", 1.0), xc.pressure("bottom", 1.0)]
    return xc.Problem(PLATE, STEEL, [CRACK], loads=loads, friction=mu)


# %% Each load is reached from the one before: the order counts
solved = {mu: xc.solve(plate(mu), pressed) for mu in MU}
print(solved[0.3][0].report)
K_II = {
    mu: np.array([sif.K_II[TIP] for sif in xc.stress_intensities(s)]) for mu, s in solved.items()
}
normal, shear = np.cos(TURN) ** 2, np.sin(TURN) * np.cos(TURN)  # of one MPa, on the crack


def exact(mu):
    """Shear that the crack feels, march along the loads: friction holds it until it must slip."""
    felt, result = 0.0, []
    for p in pressed:
        carried = shear * p - felt
        if abs(carried) > mu * normal * p:
            felt = shear * p - np.sign(carried) * mu * normal * p
        result.append(felt)
    return np.array(result)


felt = {mu: exact(mu) for mu in MU}
factor = K_II[0.0][N - 1] / (felt[0.0][N - 1] * np.sqrt(np.pi * A))
print(f"K_II of the plate over that of the infinite one: {abs(factor):.4f}")

# %% K_II over the load, and the shear that friction carries over the slip
rows = []
for mu in MU:
    wrong = np.abs(K_II[mu] - factor * felt[mu] * np.sqrt(np.pi * A)).max()
    share = wrong / np.abs(K_II[0.0]).max()
    taken = sum(s.dissipated for s in solved[mu][N:])
    largest, least = np.abs(K_II[mu][last]).max(), np.abs(K_II[mu][last]).min()
    rows.append(
        {
            "mu": mu,
            "largest K_II": largest,
            "K_II range of the cycle": largest - least,
            "dissipated in the cycle": taken,
            "deviation from exact": share,
        }
    )
    print(
        f"mu {mu}: |K_II| {least:6.1f} to {largest:6.1f}, {taken:.5f} N mm/mm in a cycle, "
        f"largest deviation from the exact path {share:.1e} of K_II without friction"
    )
    assert share < 2e-3
    assert (taken > 0) == (mu > 0)
with (OUT / "table.csv").open("w", newline="") as file:
    writer = csv.DictWriter(file, rows[0])
    writer.writeheader()
    writer.writerows(rows)

# %% Energy of a cycle against that of the loop
# The shear that friction carries over the slip is a loop too; its area is what a cycle dissipates.
middle = {mu: [s.contact[0] for s in solved[mu]] for mu in MU}


def mean_slip(contact):
    return contact.measure @ contact.slip / contact.measure.sum()


figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
for k, mu in enumerate(MU):
    axes[0].plot(pressed[last], np.abs(K_II[mu])[last], "o", color=f"C{k}", ms=4)
    axes[0].plot(
        pressed,
        np.abs(factor * felt[mu]) * np.sqrt(np.pi * A),
        color=f"C{k}",
        label=f"$\\mu$ = {mu}",
    )
    if mu:
        slip = np.array([mean_slip(c) for c in middle[mu]]) * 1e3
        carried = np.array([c.measure @ c.shear / c.measure.sum() for c in middle[mu]])
        axes[1].plot(slip, carried, "o-", color=f"C{k}", ms=4, label=f"$\\mu$ = {mu}")
        # Work of the mean traction over the loop: what was dissipated is its area.
        s, t = slip[last] / 1e3, carried[last]
        area = -np.sum(0.5 * (t[1:] + t[:-1]) * np.diff(s)) * 2 * A
        taken = rows[k]["dissipated in the cycle"]
        print(f"mu {mu}: area of the loop {area:.5f}, dissipated {taken:.5f} N mm/mm")
        assert abs(area / taken - 1) < 0.05
axes[0].set(
    xlabel="compression, MPa", ylabel=r"$|K_{II}|$, MPa$\sqrt{\mathrm{mm}}$", xlim=(0, 1.03 * HIGH),
    ylim=(0, None), title="dots: xcrack; lines: exact",
)  # fmt: skip
axes[0].legend()
axes[1].set(
    xlabel="mean slip of the faces, µm", ylabel="mean shear that friction carries, MPa",
    title="first load and one cycle",
)  # fmt: skip
axes[1].legend()
figure.savefig(OUT / "loops.png", dpi=150)

# %% The faces half way down, at mu = 0.3: pressed, sheared, and stuck where they slid before
# Pressure and shear at the largest load reach Coulomb's bound everywhere; unloaded to seven tenths
# the shear is inside the bound, and the slip is what the largest load left.
figure, axes = plt.subplots(2, 2, figsize=(12, 6), layout="constrained", sharex=True, sharey="row")
half = N + int(np.argmin(np.abs(down - 0.7 * HIGH)))
for column, k in zip(axes.T, (N - 1, half), strict=True):
    contact = solved[0.3][k].contact[0]
    order = np.argsort(contact.s)
    s = contact.s[order] - A
    column[0].plot(s, 0.3 * contact.pressure[order], "k--", lw=1, label=r"$\pm\mu p$")
    column[0].plot(s, -0.3 * contact.pressure[order], "k--", lw=1)
    column[0].plot(s, contact.shear[order], "C1", label="shear on lip +")
    column[1].plot(s, 1e3 * contact.slip[order], "C0", label="slip")
    share = contact.measure[contact.stuck].sum() / contact.measure.sum()
    column[0].set(title=f"{pressed[k]:.0f} MPa, {100 * share:.0f} % of the faces stick")
    column[1].set(xlabel="position along the crack, mm")
    assert contact.stuck.all() == (k == half)
axes[0, 0].set(ylabel="traction, MPa")
axes[1, 0].set(ylabel="slip, µm")
axes[0, 0].legend(loc="center")
figure.savefig(OUT / "faces.png", dpi=150)

# %% The body for ParaView
for k, name in ((N - 1, "largest"), (half, "unloading")):
    xc.write(solved[0.3][k], OUT / name)
print(f"pictures, tables and ParaView files: {OUT.resolve()}")
