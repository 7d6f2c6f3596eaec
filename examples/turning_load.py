"""A load that turns: tension, then shear, then compression that closes the crack.

A plate with a central crack is under a stress across the crack and a shear out of phase with it.
K_I and K_II reach their extremes at different instants, and for a good part of the cycle the crack
faces are closed and slide. Where does the crack turn, and how fast does it grow? The example
compares the direction criteria, with contact of the crack faces and without.

Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and tables go to out/turning_load.
"""

# %% The cycle: 24 instants, solved in one call with one factorisation
import csv
import warnings
from functools import partial
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/turning_load")
OUT.mkdir(parents=True, exist_ok=True)
MESHES = Path(__file__).parent / "meshes"
PLATE = xc.read_mesh(MESHES / "turning_load.msh")  # [-20, 20] x [-20, 20]
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
A = 4.0
CRACK = xc.line_crack([(-A, 0.0), (A, 0.0)])
N = 24
TIP = 1  # the right one; the left one is its half turn


def stress(phase):
    """Stress across the crack and shear, at a phase of the cycle in [0, 1)."""
    across = 10.0 + 90.0 * np.cos(2 * np.pi * phase)
    shear = 28.0 + 39.0 * np.cos(2 * np.pi * phase - np.radians(140.0))
    return across, shear


def state(phase):
    """Loads of one instant: the tractions of a uniform stress, which are in equilibrium."""
    across, shear = stress(phase)
    sigma = np.array([[0.0, shear], [shear, across]])
    return [
        xc.traction(side, lambda x, n: n @ sigma) for side in ("left", "right", "bottom", "top")
    ]


def body(cracks, contact):
    return xc.Problem(PLATE, STEEL, cracks=cracks, contact=contact)


def cycle_of(cracks, contact):
    """Solutions and K `(instants, tips, 2)` over the cycle."""
    solutions = xc.solve(body(cracks, contact), [state(k / N) for k in range(N)])
    return solutions, np.stack([xc.stress_intensity(s).K for s in solutions])


def closed_at_tip(solution):
    """Whether the crack faces touch over the last half millimetre before the tip."""
    contact = solution.contact[0]
    near = np.linalg.norm(contact.points - xc.stress_intensity(solution).x[TIP], axis=1) < 0.5
    return bool(contact.closed[near].all())


phase = np.arange(N) / N
across, shear = stress(phase)
CONTACT = {"with contact": "auto", "without": "off"}
straight = {name: cycle_of([CRACK], contact) for name, contact in CONTACT.items()}
print(straight["with contact"][0][0].report)

# %% The criteria: each takes K at all instants and returns angle, range and ratio R
CRITERIA = {
    "max_hoop_stress": xc.max_hoop_stress,
    "mean_reference, max": partial(xc.mean_reference, reference="max"),
    "mean_reference, min": partial(xc.mean_reference, reference="min"),
    "mean_reference, mean": xc.mean_reference,
    "weighted_angle": xc.weighted_angle,
}
rows = []


def angles(scene, K_of):
    """Angle of each criterion with and without contact; rows for the table."""
    angle = {}
    for name, criterion in CRITERIA.items():
        for how, (_, K) in K_of.items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", xc.XcrackWarning)  # that K_I < 0 counts as 0
                theta, dK_eq, R = (v[TIP] for v in criterion(K, STEEL.nu))
            angle[name, how] = theta
            rows.append(
                {
                    "crack": scene,
                    "criterion": name,
                    "contact": how,
                    "angle, deg": np.degrees(theta),
                    "dK_eq": dK_eq,
                    "R": R,
                    "smallest K_I": K[:, TIP, 0].min(),
                }
            )
    return angle


straight_angle = angles("straight", straight)

# %% Growth: each criterion gives its own path
# Eight of the instants are enough. A criterion warns of each K_I < 0 that it counts as 0, and of
# a mode that reverses within the cycle; both are intended here.
cycle = xc.Cycle(states=[state(k / 8) for k in range(8)])
RUNS = (
    ("max_hoop_stress", "with contact"),
    ("mean_reference, min", "with contact"),
    ("mean_reference, mean", "with contact"),
    ("weighted_angle", "with contact"),
    ("mean_reference, mean", "without"),
    ("weighted_angle", "without"),
)
grown, end = {}, {}
for name, how in RUNS:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        grown[name, how] = xc.collect(
            xc.grow(
                body([CRACK], CONTACT[how]),
                xc.paris(C=3e-13, m=3.0),
                CRITERIA[name],
                cycle,
                da=1.25,
                max_steps=3,
                integrator="euler",  # of the source paper
            )
        )
    last = grown[name, how].steps[-1]
    ahead, normal = last.sif[0][0].frame[TIP]
    angle, da = last.angle[0][TIP], last.da[0][TIP]
    tip = last.sif[0][0].x[TIP] + da * (np.cos(angle) * ahead + np.sin(angle) * normal)
    end[name, how] = np.vstack([last.cracks[0].points, tip])  # where step 3 would be
    x, y = tip
    print(f"{name:22} {how:13} two steps in {last.cycles:7.0f} cycles, next tip ({x:.3f}, {y:.3f})")

# %% The same cycle on the crack once it has turned
# On a straight crack, counting K_I < 0 as 0 compensates for missing contact. Once the crack has
# turned it does not: closed faces behind the kink slide and wedge the new piece open; without
# contact they interpenetrate instead.
turned_crack = grown["weighted_angle", "with contact"].steps[2].cracks
turned = {name: cycle_of(turned_crack, contact) for name, contact in CONTACT.items()}
turned_angle = angles("turned", turned)
for row in rows:
    print(
        f"{row['crack']:9} {row['criterion']:22} {row['contact']:13} "
        f"{row['angle, deg']:7.2f}°  dK_eq {row['dK_eq']:6.1f}  R {row['R']:.3f}  "
        f"smallest K_I {row['smallest K_I']:8.2f}"
    )
with (OUT / "table.csv").open("w", newline="") as file:
    writer = csv.DictWriter(file, rows[0])
    writer.writeheader()
    writer.writerows(rows)

# %% The path of (K_I, K_II) over the cycle
# A ray contains all (K_I, K_II) that kink at one angle, K_I sin t + K_II (3 cos t - 1) = 0. The
# rays of max, min and mean pass through the state they refer to.
RAYS = {
    "mean_reference, max": ("max", "C1", "^"),
    "mean_reference, min": ("min", "C4", "v"),
    "mean_reference, mean": ("mean", "C2", "s"),
    "weighted_angle": ("weighted", "C0", None),
}


def reference(K, which):
    """The state that determines an angle."""
    K = np.maximum(K, [0.0, -np.inf])
    own = xc.max_hoop_stress
    K_eq = np.array([own(np.stack([0 * k, k])[:, None], STEEL.nu)[1][0] for k in K])
    return {"max": K[K_eq.argmax()], "min": K[K_eq.argmin()], "mean": K.mean(axis=0)}[which]


scenes = (
    ("straight crack", straight, straight_angle),
    ("after two steps of weighted_angle", turned, turned_angle),
)
ranges = []
for _, K_of, _ in scenes:
    every = np.concatenate([K[:, TIP] for _, K in K_of.values()])
    ranges.append((min(-60.0, 1.1 * every[:, 0].min()), 1.1 * every[:, 0].max()))
figure, axes = plt.subplots(
    1, 2, figsize=(12, 8.4), layout="compressed", sharey=True, width_ratios=np.diff(ranges).ravel()
)
for axis, (title, K_of, angle), (low, high) in zip(axes, scenes, ranges, strict=True):
    axis.axhline(0, color="0.7", lw=0.8)
    axis.axvline(0, color="0.7", lw=0.8)
    axis.axvspan(low, 0, color="C3", alpha=0.07, lw=0)
    for how, style, color, level in (("with contact", "-", "k", 4), ("without", "--", "C3", 3)):
        K = K_of[how][1][:, TIP]
        label = "with contact" if how == "with contact" else "without contact"
        closed_path = np.vstack([K, K[:1]])
        axis.plot(*closed_path.T, style, color=color, marker="o", ms=3, label=label, zorder=level)
        for name, (short, ray_color, mark) in RAYS.items():
            t = angle[name, how]
            moved = abs(t - angle[name, "with contact"]) > np.radians(0.1)
            if how == "without" and not moved:
                continue
            ray = np.array([3 * np.cos(t) - 1, -np.sin(t)])
            ray *= min(high / ray[0], 345.0 / abs(ray[1]))
            label = f"{short}: {np.degrees(t):.1f}°".replace("-", "−")
            label += " without contact" if moved else ""
            axis.plot([0, ray[0]], [0, ray[1]], style, color=ray_color, lw=1.6, label=label)
            if mark and how == "with contact":
                axis.plot(*reference(K, short), mark, color=ray_color, ms=9, mec="k", zorder=5)
    axis.set(
        title=title, xlim=(low, high), ylim=(-345, 345), xlabel=r"$K_I$, MPa$\sqrt{\mathrm{mm}}$"
    )
    axis.set_aspect("equal")
    axis.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=2, frameon=False, columnspacing=1
    )
axes[0].set_ylabel(r"$K_{II}$, MPa$\sqrt{\mathrm{mm}}$")
axes[0].text(-325, -335, "$K_I$ < 0: the faces overlap", color="C3", va="bottom")
figure.savefig(OUT / "K_path.png", dpi=150)

# %% The cycle, and the paths
figure, axes = plt.subplots(1, 2, figsize=(12, 4.6), layout="constrained", width_ratios=(1, 1.6))
fine = np.linspace(0, 1, 200)
axes[0].plot(fine, stress(fine)[0], "k-", label="across the crack")
axes[0].plot(fine, stress(fine)[1], "k--", label="shear")
axes[0].axhline(0, color="0.7", lw=0.8)
lips_closed = stress(fine)[0] < 0
axes[0].fill_between(
    fine, 0, 1, where=lips_closed, transform=axes[0].get_xaxis_transform(),
    color="#d6006c", alpha=0.1, lw=0, label="straight crack closed",
)  # fmt: skip
axes[0].set(xlabel="phase of the cycle", ylabel="stress, MPa", xlim=(0, 1))
axes[0].legend()
COLORS = {"max_hoop_stress": "C1", **{name: color for name, (_, color, _) in RAYS.items()}}
for name, how in RUNS:
    style = "-" if how == "with contact" else "--"
    x = end[name, how]
    axes[1].plot(*x.T, style, color=COLORS[name], lw=1.6, marker="o", ms=3, label=f"{name}, {how}")
axes[1].plot([-A, A], [0, 0], "k-", lw=3, label="crack at first")
axes[1].set(xlabel="x, mm", ylabel="y, mm", aspect="equal", xlim=(-8.5, 8.5), ylim=(-3.4, 3.4))
axes[1].legend(fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=2)
figure.savefig(OUT / "paths.png", dpi=150)

# %% The faces of the turned crack at the instant of the largest compression
# Each face is drawn half of the jump away from the crack, because the magnified rotation of the
# body would look like a gap. At the kinks the pressure is unbounded (the corner of one face presses
# into the other), and two or three cells beside them cannot resolve it. The opening jumps there
# because it is measured along the normal of the crack, which turns.
WARP = 150.0
press = int(np.argmin(across))
figure, axes = plt.subplots(2, 2, figsize=(12, 6), layout="constrained", sharex=True)
for column, how in zip(axes.T, CONTACT, strict=True):
    solution = turned[how][0][press]
    lips = solution.lips[0]
    order = np.argsort(lips.s)
    x, s, half = lips.x[order], lips.s[order], 0.5 * WARP * solution.jump(0)[order]
    gap = solution.opening(0)[order]
    upper, lower = (x + half).T, (x - half).T
    column[0].plot(*x.T, "-", color="0.7", lw=1, label="crack at rest")
    column[0].plot(*upper, "C0-", lw=1.8, label="+ face")
    column[0].plot(*lower, "C1-", lw=1.8, label="− face")
    title = "with contact" if how == "with contact" else "without contact: the faces overlap"
    column[0].set(title=f"{title} (displacements × {WARP:.0f})", ylabel="y, mm", aspect="equal")
    column[0].set(xlim=(-6.5, 6.5), ylim=(-2.6, 2.6))
    column[0].legend(fontsize="small", loc="upper right")
    column[1].axhline(0, color="0.7", lw=0.8)
    column[1].plot(x[:, 0], 1000 * gap, "k-", label="opening, µm")
    if solution.contact[0] is not None:
        pressure = solution.contact[0].pressure[order]
        column[1].plot(x[:, 0], pressure / 20, "-", color="#d6006c", label="pressure, 20 MPa")
    column[1].fill_between(x[:, 0], 1000 * gap, 0, where=gap < 0, color="C3", alpha=0.25, lw=0)
    column[1].set(xlabel="x along the crack, mm", ylabel="opening and pressure")
    column[1].legend(fontsize="small")
figure.savefig(OUT / "lips.png", dpi=150)
shown = turned["with contact"][0][press]
xc.plot(shown, "von_mises", warp=100.0, file=OUT / "von_mises.png")
xc.write(shown, OUT / "largest_compression")

# %% Checks
# K of the straight crack: sigma sqrt(pi a) 1.05538 for 2 a / W = 0.2 in a square plate (table
# `PLATE_CENTRE` of xcrack.verification.exact.plates); the faces carry all of the compression, so
# that K_I is 0 instead of negative.
F = 1.05538
K_contact, K_overlap = (straight[how][1][:, TIP] for how in CONTACT)
scale = 100.0 * np.sqrt(np.pi * A)
assert np.allclose(K_overlap[:, 0], F * across * np.sqrt(np.pi * A), atol=0.002 * scale)
assert np.allclose(K_contact[:, 0], np.maximum(K_overlap[:, 0], 0), atol=0.002 * scale)
assert np.allclose(K_contact[:, 1], K_overlap[:, 1], atol=0.002 * scale)  # the faces slide freely
is_closed = np.array([closed_at_tip(s) for s in straight["with contact"][0]])
assert np.array_equal(is_closed, across < 0)
assert np.abs(K_contact[is_closed, 0]).max() < 1e-3 * scale
assert (K_overlap[is_closed, 0] < -0.05 * scale).all()

for K_of, angle in ((straight, straight_angle), (turned, turned_angle)):
    K = K_of["with contact"][1]
    assert K[..., 0].min() > -1e-3 * scale
    # the weighted angle lies between the instants' own angles
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        own = [xc.max_hoop_stress(k[None], STEEL.nu)[0][TIP] for k in K]
        assert min(own) < angle["weighted_angle", "with contact"] < max(own)
        # and no criterion depends on the order of the instants
        shuffled = np.random.default_rng(20240613).permutation(K)
        for criterion in CRITERIA.values():
            for given, other in zip(criterion(K, 0.3), criterion(shuffled, 0.3), strict=True):
                assert np.array_equal(given, other)

# both tips behave alike: a half turn maps the scene onto itself
K = turned["with contact"][1]
assert np.abs(K[:, 0] - K[:, 1] * [1, -1]).max() < 0.01 * scale
difference = {name: np.degrees(turned_angle[name, "without"] - turned_angle[name, "with contact"])
              for name in CRITERIA}  # fmt: skip
assert abs(difference["mean_reference, mean"]) > 5  # why contact is needed
assert abs(difference["max_hoop_stress"]) < 0.1  # the instant of the largest K_eq is open
overlap = -turned["without"][0][press].opening(0).min()
print(f"without contact the faces of the turned crack overlap by up to {1000 * overlap:.1f} µm")
print(f"pictures, ParaView files and table.csv are in {OUT.resolve()}")
