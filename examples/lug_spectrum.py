"""A cold-worked lug under flights: what contact, retardation, and both do to its life.

A pin pulls on a lug whose hole was expanded: it is left with hoop compression (Hill's ring, 1950),
so that the faces of a short crack press on each other until the pin pulls hard enough. A block is
twenty flights of gusts about a mean, back to the ground after each, and one hard landing whose load
is far above all others. Six lives: K with contact and without, each without retardation, with
Wheeler's and with Willenborg's. Where one tip grows its path does not depend on its rate: lives
along the stored path of the run without retardation must be those of growth with it.

Units: N, mm, MPa. Pictures, ParaView files and a table go to out/lug_spectrum.

    python lug_spectrum.py --quick     blocks of five flights, a short crack
"""

# %% The lug, its residual stress, and the pin
import csv
import sys
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/lug_spectrum")
OUT.mkdir(parents=True, exist_ok=True)
QUICK = "--quick" in sys.argv
MESH = xc.read_mesh(Path(__file__).parent / "meshes" / "lug_spectrum.msh")
R, PLASTIC, RING = 10.0, 13.0, 20.0  # hole, plastic zone, outer radius of Hill's ring
YIELD, EXPANDED = 350.0, 1.0  # MPa, share of the ring's stress that is left
ALUMINIUM = xc.Isotropic(E=72e3, nu=0.33, plane="stress")
PIN = (0.0, 3000.0)  # N per mm of thickness, at factor 1
FIRST, LAST, DA = 1.5, (3.0 if QUICK else 7.0), 0.5


def hoop_and_radial(r):
    """Stress of a ring that yielded to PLASTIC under pressure, and was unloaded (Tresca)."""
    c2, b2 = PLASTIC**2, RING**2
    log = np.log(PLASTIC / np.minimum(r, PLASTIC))
    inside = r < PLASTIC
    elastic = YIELD * c2 / (2 * b2)
    radial = -YIELD / 2 * (1 - c2 / b2) - YIELD * log
    radial = np.where(inside, radial, elastic * (1 - b2 / r**2))
    hoop = np.where(inside, radial + YIELD, elastic * (1 + b2 / r**2))
    pressure = YIELD / 2 * (1 - c2 / b2) + YIELD * np.log(PLASTIC / R)
    unload = pressure * R**2 / (b2 - R**2)
    return hoop - unload * (1 + b2 / r**2), radial - unload * (1 - b2 / r**2)


def residual(x):
    """The same as tensors (n, 2, 2), within the ring; balanced beyond it by what the lug does."""
    r, t = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    hoop, radial = (EXPANDED * s for s in hoop_and_radial(np.clip(r, R, RING)))
    c, s = np.cos(t), np.sin(t)
    xx, yy, xy = radial * c**2 + hoop * s**2, radial * s**2 + hoop * c**2, (radial - hoop) * s * c
    return np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)


def lug(contact):
    """The lug with a crack at its hole, across the pull of the pin."""
    return xc.Problem(
        MESH,
        ALUMINIUM,
        cracks=[xc.line_crack([(R, 0.0), (R + FIRST, 0.0)])],
        loads=[xc.bearing("hole_0", PIN), xc.initial_stress(residual)],
        supports=[xc.fix("bottom")],
        contact=contact,
    )


# %% Twenty flights, and a hard landing after the last
FLIGHTS, GUSTS = (5 if QUICK else 20), 40
draw = np.random.default_rng(2718)
gusts = np.clip(0.35 + 0.12 * draw.standard_normal((FLIGHTS, GUSTS)), 0.1, 0.65)
factors = np.column_stack([np.zeros(FLIGHTS), np.round(gusts, 2)]).ravel()
SPECTRUM = xc.Spectrum([*factors, 0.0, 1.0], unit="block")
LAW = xc.walker(C=2e-11, m=3.0, gamma=0.6).to("m, MPa√m", "mm, MPa√mm")
ZONE = xc.plastic_zone(sigma_y=YIELD, beta=2)
MODELS = {
    "no retardation": None,
    "Wheeler": xc.wheeler(w=1.3, zone=ZONE),
    "Willenborg": xc.willenborg(shutoff=2.7, dK_th=60.0, zone=ZONE),
}


def grown(contact, model):
    """Growth until the crack is long."""
    steps = int(round((LAST - FIRST) / DA)) + 1
    return xc.collect(
        xc.grow(
            lug(contact), LAW, xc.max_hoop_stress, SPECTRUM, da=DA, max_steps=steps,
            retardation=model, progress=False,
        )
    )  # fmt: skip


histories = {}
for contact in ("auto", "off"):
    for name, model in MODELS.items():
        with warnings.catch_warnings():
            if contact == "off":  # faces pass through each other, and a run says so
                warnings.simplefilter("ignore", xc.XcrackWarning)
            histories[contact, name] = grown(contact, model)


def length(history):
    """Length of the crack at each step."""
    tips = [step.corrected[0].points[-1] for step in history.steps]
    return np.array([np.hypot(*tip) - R for tip in tips])


# %% The table
HEAD = ["K", "retardation", "life, flights", "over none", "along the stored path", "levels"]
rows = []
for (contact, name), history in histories.items():
    plain = histories[contact, "no retardation"]
    along = xc.retarded(plain, LAW, SPECTRUM, MODELS[name], nu=ALUMINIUM.nu)
    rows.append([
        "with contact" if contact == "auto" else "without",
        name,
        history.life * FLIGHTS,
        history.life / plain.life,
        along.life * FLIGHTS,
        len(history.steps[-1].levels),
    ])  # fmt: skip
print("".join(f"{name:>24}" for name in HEAD))
for row in rows:
    print("".join(f"{v:>24}" if isinstance(v, str) else f"{v:24.5g}" for v in row))
with open(OUT / "lives.csv", "w", newline="", encoding="utf-8") as file:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(HEAD)
    writer.writerows(rows)

# %% Pictures
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
for (contact, name), history in histories.items():
    flights = np.array([step.cycles for step in history.steps]) * FLIGHTS
    style = "-" if contact == "auto" else "--"
    color = f"C{list(MODELS).index(name)}"
    label = f"{name}, {'contact' if contact == 'auto' else 'no contact'}"
    left.plot(flights, length(history), f"o{style}", color=color, label=label, mfc="none", ms=4)
left.set(xlabel="flights", ylabel="crack length, mm", xlim=(0, None))
left.legend(frameon=False, fontsize=8)
for contact, style in (("auto", "o-"), ("off", "s--")):
    for k, color in ((0, "C3"), (-1, "C4")):
        step = histories[contact, "no retardation"].steps[k]
        K = [state[0].K_I[0] for state in step.sif]
        name = "contact" if contact == "auto" else "no contact"
        a = length(histories[contact, "no retardation"])[k]
        label = f"a = {a:.1f} mm, {name}"
        right.plot(step.levels, K, style, color=color, label=label, mfc="none", ms=4)
right.axhline(0, color="0.6", lw=0.8)
right.set(xlabel="factor on the pin", ylabel=r"$K_I$, MPa$\sqrt{\mathrm{mm}}$")
right.legend(frameon=False, fontsize=8)
figure.savefig(OUT / "lives.png", dpi=150)
last = histories["auto", "Wheeler"].steps[-1]
xc.plot(last.solutions[-1], "syy", zoom=3.0, file=OUT / "stress.png")
xc.write(last.solutions[-1], OUT / "pulled")

# %% Checks
for row in rows:
    assert abs(row[2] / row[4] - 1) < 0.01  # K is a line along the stored path, no parabola
for contact in ("auto", "off"):
    none, *retarded = (histories[contact, name].life for name in MODELS)
    assert all(life > 1.1 * none for life in retarded)
for state in histories["auto", "no retardation"].steps[0].sif:
    assert state[0].K_I[0] >= 0  # faces cannot pass through each other
assert histories["off", "no retardation"].steps[0].sif[0][0].K_I[0] < 0
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
