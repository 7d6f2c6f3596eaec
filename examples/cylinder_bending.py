"""A notched bar in four-point bending, turned by 90° while a crack grows in it.

A round bar is bent so that its notch opens. A crack with a straight front starts at the root of the
notch and grows until notch and crack take half of the section. Then the bar is turned under its
four forces, from back to front: along one half of the front the crack still opens, along the other
its faces are pressed together. Growth continues, once with contact and once as if the faces could
pass through each other.

The source paper (Pierard et al., see docs/theory.md) gives no dimensions. Here the bar is 20 mm in
diameter and 140 mm long, the notch is 2 mm deep with 60°, the forces are 120 and 40 mm apart,
E = 210 GPa, nu = 0.3; a force of 1963.5 N at each of the four stations gives a nominal bending
stress of 100 MPa.

    python cylinder_bending.py             order 2, more than 10^5 unknowns, some six minutes
    python cylinder_bending.py --quick     the same on a coarse mesh in longer steps, one minute
    python cylinder_bending.py --skew      a crack inclined by 10° takes half of the section from
                                           the start: mixed modes, and the criteria compared

When restarted after a kill, it resumes from the last step on disk. Units: N, mm, MPa; K in MPa √mm.
Pictures, ParaView files and tables go to out/cylinder_bending.
"""

# %% The bar; gmsh meshes it once
import csv
import sys
import time
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.tri import Triangulation

import xcrack as xc

QUICK, SKEW = "--quick" in sys.argv, "--skew" in sys.argv
OUT = Path("out/cylinder_bending")
OUT.mkdir(parents=True, exist_ok=True)
VARIANT = ("quick" if QUICK else "full") + ("_skew" if SKEW else "")
D, NOTCH = 20.0, 2.0
# Depths are measured from the lowest line of the bar. A coarse mesh needs a longer initial crack.
START = 10.3 if SKEW else 5.0 if QUICK else 4.0
OUTER, INNER = 120.0, 40.0
NOMINAL = 100.0
SIZE = 1.0 if QUICK else 0.6
DA = 2.0 if QUICK else 0.8
TURN = 6  # faces of 15°
TILT = np.radians(10.0) if SKEW else 0.0
AFTER = 3 if QUICK else 8  # steps after the turn, the first included
STEEL = xc.Isotropic(E=210e3, nu=0.3)
LAW = xc.elber(C=2.4e-12, m=3.0, a=0.5, b=0.4)
R = D / 2
MOMENT = NOMINAL * np.pi * D**3 / 32
FORCE = 2 * MOMENT / (OUTER - INNER)
clock = time.perf_counter()
spent = {}


def lap(part):
    """Add the time since the last call to a part."""
    global clock
    now = time.perf_counter()
    spent[part] = spent.get(part, 0.0) + now - clock
    clock = now


mesh_file = OUT / f"bar_{SIZE:g}.msh"
if not mesh_file.exists():
    xc.write_mesh(
        mesh_file,
        xc.notched_cylinder(
            diameter=D, length=140.0, notch_depth=NOTCH, notch_angle=np.radians(60.0),
            outer_span=OUTER, inner_span=INNER, size=5.0, size_near=SIZE, crack_depth=14.0,
            transition=10.0,
        ),
    )  # fmt: skip
BAR = xc.read_mesh(mesh_file)
lap("mesh")


def turned(k):
    """The four forces, turned by k faces of 15°: reactions below, loads above for k = 0."""
    down = np.array([0.0, np.sin(np.radians(15.0 * k)), -np.cos(np.radians(15.0 * k))])
    stations = []
    for side in ("left", "right"):
        for station, face, sign in (("inner", (12 + k) % 24, 1.0), ("outer", k, -1.0)):
            where = f"{station}_{side}_{face:02d}"
            corner = BAR.points[BAR.facet_sets[where]]
            edges = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            area = np.linalg.norm(edges, axis=1).sum() / 2
            stations.append(xc.traction(where, tuple(sign * FORCE / area * down)))
    return stations


def bar(cracks, k, contact="auto"):
    """The bar with its cracks under the four forces, which balance: it needs no supports."""
    return xc.Problem(BAR, STEEL, cracks=cracks, loads=turned(k), contact=contact)


# %% The crack: straight along y, two millimetres ahead of the root in the full run
# Its mouth lies in the notch, below the root; the exact place does not matter.
ROOT = NOTCH - R
REACH = 1.2 * R
ahead = np.array([np.sin(TILT), 0.0, np.cos(TILT)])
mouth, tip = (
    np.array([0.0, 0.0, ROOT]) + s * ahead for s in (-0.35 * NOTCH, (START - NOTCH) / np.cos(TILT))
)
across = np.array([0.0, REACH, 0.0])
CRACK = xc.plane_crack([mouth - across, mouth + across, tip + across, tip - across])
SECTION = np.pi * R**2
HALF = np.arccos((R - NOTCH) / R)
NOTCHED = R**2 * (HALF - np.sin(HALF) * np.cos(HALF))  # part of the section that the notch takes

CYCLE = xc.Cycle(0.0, 1.0)  # unloaded and loaded: zero load ratio
CRITERIA = {
    "max_hoop_stress": xc.max_hoop_stress,
    "mean_reference": xc.mean_reference,
    "weighted_angle": xc.weighted_angle,
}


def lips_file(name, step):
    return OUT / "run" / VARIANT / f"{name}_lips" / f"{step:04d}.npz"


def lips_of(solution):
    """State of the faces of a loaded crack, at their integration points."""
    lips, contact = solution.lips[0], solution.contact[0]
    nothing = np.zeros(len(lips.weight))
    return {
        "x": np.asarray(lips.x),
        "area": np.asarray(lips.weight),
        "gap": solution.opening(0),
        "pressure": nothing if contact is None else contact.pressure,
        "closed": nothing > 0 if contact is None else contact.closed,
        "unknowns": np.array(solution.n_dof),
    }


def grown(name, problem, until, max_steps):
    """Steps of a run and its crack faces in each; steps on disk are not computed again."""
    folder = OUT / "run" / VARIANT / name

    def seen(step):
        if step.solutions:
            file = lips_file(name, step.index)
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savez_compressed(file, **lips_of(step.solutions[-1]))
        file = lips_file(name, step.index)
        return until(np.load(file)["area"].sum()) if file.exists() else False

    inputs = (LAW, xc.max_hoop_stress, CYCLE, DA)
    with warnings.catch_warnings():
        # A criterion warns where it counts K_I < 0 as 0: expected without contact, and with contact
        # a discretisation error that is shown below.
        warnings.filterwarnings("ignore", "K_I < 0", xc.XcrackWarning)
        # Where the front bends, near the surface of the bar, the domain of K is narrow.
        warnings.filterwarnings("ignore", "K along the front", xc.XcrackWarning)
        if (folder / "run.json").exists():
            history = xc.resume(
                folder, problem, *inputs, until=seen, max_steps=max_steps, keep_solutions=False
            )
        else:
            steps = xc.grow(problem, *inputs, max_steps=max_steps)
            history = xc.collect(steps, path=folder, until=seen, keep_solutions=False)
    lap(name)
    for step in history.steps:
        if not lips_file(name, step.index).exists():  # killed between the two files
            again = xc.Problem(
                BAR,
                STEEL,
                step.cracks,
                loads=problem.loads,
                contact=problem.contact,
                order=problem.order,
            )
            np.savez_compressed(lips_file(name, step.index), **lips_of(xc.solve(again)))
    return history, [dict(np.load(lips_file(name, s.index))) for s in history.steps]


# %% Before the turn: growth until notch and crack take half of the section
runs = {}
runs["before"] = grown("before", bar([CRACK], 0), lambda area: NOTCHED + area >= 0.5 * SECTION, 30)
last = runs["before"][0].steps[-1]
N_TURN = last.cycles
print(runs["before"][0])

# %% At the turn: one crack, the forces before and after, with and without contact
# Both directions are two states of one problem, which share their stiffness and its hierarchy.
STATES = [turned(0), turned(TURN)]
before, closed = xc.solve(bar(last.cracks, 0), STATES)
before_off, overlapping = xc.solve(bar(last.cracks, 0, contact="off"), STATES)
with warnings.catch_warnings():
    warnings.filterwarnings("ignore", "K along the front", xc.XcrackWarning)
    K_before, K_closed = xc.stress_intensities([before, closed])
    K_before_off, K_overlap = xc.stress_intensities([before_off, overlapping])
lap("at the turn")
print(closed.report)

# %% After the turn: growth continues, with and without contact
for name, contact in (("with contact", "auto"), ("without", "off")):
    runs[name] = grown(name, bar(last.cracks, TURN, contact), lambda area: False, AFTER)
    print(name, runs[name][0])


# %% Every step in one table
def directions(step):
    """Kink angle along the front by each criterion, degrees."""
    K = np.stack([state[0].K for state in step.sif])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return {name: np.degrees(c(K, STEEL.nu)[0]) for name, c in CRITERIA.items()}


HEAD = ("run", "step", "N", "unknowns", "share of section", "K_I min", "K_I mean", "K_I max",
        "|K_II| max", "|K_III| max", "closed", "largest opening, um", "smallest opening, um",
        *(f"{name}, deg" for name in CRITERIA))  # fmt: skip
rows, places = [], []
for name, (history, lips) in runs.items():
    for step, lip in zip(history.steps, lips, strict=True):
        sif, angle = step.sif[-1][0], directions(step)
        inside = ~sif.at_surface
        K_I, sheared = sif.K_I, np.abs(sif.K[inside, 1:]).max(axis=0)
        # Where the front hardly moves, the direction comes from two numbers near zero.
        moves = inside & (step.dK_eq[0] > 0.5 * step.dK_eq[0].max())
        rows.append(
            (
                name, step.index, step.cycles + (N_TURN if name != "before" else 0.0),
                int(lip["unknowns"]), (NOTCHED + lip["area"].sum()) / SECTION,
                K_I.min(), K_I.mean(), K_I.max(), *sheared,
                lip["area"][lip["closed"]].sum() / lip["area"].sum(),
                1e3 * lip["gap"].max(), 1e3 * lip["gap"].min(),
                *(a[moves][np.argmax(np.abs(a[moves]))] for a in angle.values()),
            )
        )  # fmt: skip
        places += [
            (name, step.index, *sif.x[j], *sif.K[j], sif.at_surface[j], step.dK_eq[0][j],
             step.rate[0][j], step.da[0][j], *(a[j] for a in angle.values()))
            for j in range(len(sif.x))
        ]  # fmt: skip
for file, head, lines in (
    ("steps.csv", HEAD, rows),
    ("fronts.csv", ("run", "step", "x", "y", "z", "K_I", "K_II", "K_III", "at surface", "dK_eq",
                    "rate", "da", *(f"{name}, deg" for name in CRITERIA)), places),
):  # fmt: skip
    with (OUT / file).open("w", newline="") as handle:
        writer = csv.writer(handle)
        writer.writerow(head)
        writer.writerows(lines)
print("run           step        N unknowns  share  K_I min   mean    max  |K_II| |K_III| closed"
      "  opening, um    kink, deg:  hoop   mean  weighted")  # fmt: skip
for r in rows:
    print("{:13} {:4d} {:8.0f} {:8d} {:6.3f} {:8.1f} {:6.1f} {:6.1f} {:7.2f} {:7.2f} {:6.3f}"
          " {:6.2f} {:6.2f}        {:8.2f} {:6.2f} {:9.2f}".format(*r))  # fmt: skip

# %% What the section carries after the turn: pressure on the crack faces and stress in the ligament
# Each half of the bar is in equilibrium under its two forces and the resultants of the section: no
# force, the bending moment about the turned axis, no moment about the other. The ligament is summed
# over a plane through the front, with a grid that is dense where the stress is large.


def levers(x):
    """Distance towards the tension side of the turned bar, and across it."""
    phi = np.radians(15.0 * TURN)
    return x @ [0, np.sin(phi), -np.cos(phi)], x @ [0, np.cos(phi), np.sin(phi)]


def resultants(force, x):
    """Force along the bar, its moment about the axis of the turned bending, about the other."""
    phi = np.radians(15.0 * TURN)
    moment = np.cross(x, force).sum(axis=0)
    bending = moment @ [0, -np.cos(phi), -np.sin(phi)]
    return np.array([force[:, 0].sum(), bending, moment @ [0, np.sin(phi), -np.cos(phi)]])


def front_of(solution):
    """Front of the crack, from one side of the bar to the other."""
    crack = solution.space.cracks[0]
    x = crack.points[crack.fronts[0]]
    return x[np.argsort(x[:, 1])]


def from_lips(solution):
    """Resultants of the contact pressure, from the half bar at the + face on the other one."""
    lips, normal = lips_of(solution), np.asarray(solution.lips[0].normal)
    outward = normal * np.sign(normal[:, :1])
    return resultants(-(lips["pressure"] * lips["area"])[:, None] * outward, lips["x"])


def from_ligament(solution, n=300):
    """Resultants of the stress ahead of the front."""
    front = front_of(solution)
    y = R * (2 * (np.arange(n) + 0.5) / n - 1)
    x0, z0 = (np.interp(y, front[:, 1], front[:, i]) for i in (0, 2))
    depth = np.sqrt(np.maximum(np.sqrt(R**2 - y**2) - z0, 0.0))[:, None]
    t = (np.arange(n) + 0.5) / n * depth  # z = z0 + t²: the stress grows as 1/t towards the front
    area = (2 * R / n) * 2 * t * depth / n
    points = np.stack(np.broadcast_arrays(x0[:, None], y[:, None], z0[:, None] + t**2), axis=-1)
    in_body = solution.inside(points.reshape(-1, 3)) & (area.ravel() > 0)
    points, area = points.reshape(-1, 3)[in_body], area.ravel()[in_body]
    return resultants(solution.stress(points)[:, :, 0] * area[:, None], points)


carried = {"crack faces": from_lips(closed), "ligament": from_ligament(closed)}
pushed = -carried["crack faces"][0]
print("after the turn the section carries      force, N   moment, N mm   about the other axis")
for name, value in carried.items():
    print(f"  {name:35} {value[0]:10.1f} {value[1]:14.1f} {value[2]:12.1f}")
total = sum(carried.values())
print(f"  {'together':35} {total[0]:10.1f} {total[1]:14.1f} {total[2]:12.1f}")
print(f"  {'required by the forces':35} {0.0:10.1f} {MOMENT:14.1f} {0.0:12.1f}")

# %% No interpenetration: contact pressure acts only where the mean gap is zero
# Pointwise the faces may overlap by as much as a cell can bend; the pressure does no work on that.
lip_area = closed.lips[0].weight
press = closed.contact[0].pressure * lip_area
pressed_gap = (press @ closed.opening(0)) / press.sum()
overlap = np.minimum(overlapping.opening(0), 0.0)
closed_share = lip_area[closed.contact[0].closed].sum() / lip_area.sum()
print(f"mean gap under the pressure {pressed_gap:.1e} mm, largest {closed.opening(0).max():.1e} mm")
print(f"without contact the faces overlap by up to {-1e3 * overlap.min():.2f} um")

# %% Pictures: the bar with its loads
for solution, name in ((before, "before"), (closed, "after")):
    xc.plot(
        solution, "sxx", warp=100.0, loads=True, view=(0.45, -1.0, -0.55),
        limits=(-NOMINAL, NOMINAL), file=OUT / f"bar_{name}_the_turn.png",
    )  # fmt: skip
    xc.write(solution, OUT / f"{name}_the_turn")
lap("pictures")


# %% The crack surface, by pressure and by opening
def outline(axis):
    """Section of the bar with its notch, seen along x."""
    angle = np.linspace(-np.pi / 2 + HALF, 3 * np.pi / 2 - HALF, 200)
    axis.plot(R * np.cos(angle), R * np.sin(angle), "k-", lw=1)
    axis.plot(R * np.array([-1, 1]) * np.sin(HALF), [ROOT, ROOT], "k--", lw=0.8)
    axis.set(aspect="equal", xlabel="y, mm (front side left, back right)", ylabel="z, mm")
    axis.set(xlim=(-10.6, 10.6), ylim=(-10.6, 10.6))


def on_lips(axis, solution, values, **look):
    """Values at points of the crack faces as a coloured map, without triangles across gaps."""
    x = solution.lips[0].x
    map_ = Triangulation(x[:, 1], x[:, 2])
    corner = np.stack([x[map_.triangles, 1], x[map_.triangles, 2]], axis=-1)
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=-1).max(axis=1)
    map_.set_mask(longest > 3 * SIZE)
    drawn = axis.tripcolor(map_, values, shading="gouraud", rasterized=True, **look)
    front = front_of(solution)
    axis.plot(front[:, 1], front[:, 2], "-", color="k", lw=1.4)
    outline(axis)
    return drawn


def openings(*solutions):
    """Colours for openings, with zero in the middle."""
    largest = 1e3 * max(np.abs(solution.opening(0)).max() for solution in solutions)
    return {"cmap": "RdBu", "vmin": -largest, "vmax": largest}


figure, axes = plt.subplots(2, 2, figsize=(11.6, 9.4), layout="constrained")
for axis, solution, look, title in (
    (axes[0, 0], before, openings(before), "before the turn: opening"),
    (axes[1, 0], closed, openings(closed, overlapping), "after it: opening"),
    (axes[1, 1], overlapping, openings(closed, overlapping), "after it, without contact: opening"),
):
    shown = on_lips(axis, solution, 1e3 * solution.opening(0), **look)
    axis.set_title(title)
    figure.colorbar(shown, ax=axis, label="opening, µm (red: overlap)", shrink=0.8)
shown = on_lips(axes[0, 1], closed, closed.contact[0].pressure, cmap="magma_r", vmin=0)
axes[0, 1].set_title("after it: contact pressure")
figure.colorbar(shown, ax=axes[0, 1], label="pressure, MPa", shrink=0.8)
figure.savefig(OUT / "lips.png", dpi=150)

# %% Fronts over the section
LOOK = {"before": ("0.55", "-"), "with contact": ("C0", "-"), "without": ("C3", "--")}
LABEL = {"before": "before the turn", "with contact": "after it, with contact",
         "without": "after it, without contact"}  # fmt: skip
figure, axis = plt.subplots(figsize=(6.8, 7.0), layout="constrained")
outline(axis)
for name, (history, _) in runs.items():
    color, style = LOOK[name]
    for step in history.steps:
        x = step.sif[-1][0].x
        label = LABEL[name] if step.index == 0 else None
        axis.plot(x[:, 1], x[:, 2], style, color=color, lw=1.3, label=label)
axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, fontsize="small",
            frameon=False)  # fmt: skip
figure.savefig(OUT / "fronts.png", dpi=150)

# %% K along the front at the turn
figure, axes = plt.subplots(3, 1, figsize=(7.4, 8.4), sharex=True, layout="constrained",
                            height_ratios=(2.4, 1, 1))  # fmt: skip
worst = max(np.abs(k.K[:, 1:]).max() for k in (K_before, K_closed, K_overlap))
for axis, mode in zip(axes, range(3), strict=True):
    axis.axhline(0, color="0.7", lw=0.8)
    for sif, name, style in (
        (K_before, "before the turn", "0.55"),
        (K_closed, "after it, with contact", "C0"),
        (K_overlap, "after it, without contact", "C3"),
    ):
        y, free = sif.x[:, 1], sif.at_surface
        axis.plot(y, sif.K[:, mode], "-", color=style, lw=1.5, label=name)
        axis.plot(y[free], sif.K[free, mode], "o", color=style, mfc="white", ms=4)
    axis.set_ylabel(rf"$K_{{{'I' * (mode + 1)}}}$, MPa$\sqrt{{\mathrm{{mm}}}}$")
    if mode:
        axis.set_ylim(-1.3 * max(worst, 20.0), 1.3 * max(worst, 20.0))
low, high = axes[0].get_ylim()
axes[0].axhspan(low, 0, color="C3", alpha=0.07, lw=0)
axes[0].set_ylim(low, high)
axes[0].text(0.45, 0.03, "$K_I$ < 0: the faces overlap", color="C3", transform=axes[0].transAxes)
axes[0].legend(fontsize="small", frameon=False)
axes[2].set_xlabel("y along the front, mm (hollow: K of a depth below the free surface)")
figure.savefig(OUT / "K_at_the_turn.png", dpi=150)

# %% Size of the crack over the cycles
figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
for name, (history, _) in runs.items():
    color, style = LOOK[name]
    n0 = 0.0 if name == "before" else N_TURN
    N = np.array([s.cycles for s in history.steps]) + n0
    a = np.array([s.sizes[0] for s in history.steps])
    furthest = np.array([s.sif[-1][0].x[:, 2].max() for s in history.steps])
    axes[0].plot(N / 1e3, a, style, color=color, marker="o", ms=3, label=LABEL[name])
    if name != "before":
        axes[1].plot((N - n0) / 1e3, furthest, style, color=color, marker="o", ms=3,
                     label=LABEL[name])  # fmt: skip
axes[0].set(xlabel="thousand cycles", ylabel="a: area of the crack / length of its front, mm")
axes[1].set(xlabel="thousand cycles since the turn", ylabel="highest point of the front: z, mm")
for axis in axes:
    axis.legend(fontsize="small", frameon=False)
figure.savefig(OUT / "life.png", dpi=150)
lap("pictures")

# %% --skew: the criteria compared, and the paths
# In a cycle from zero there is only one loaded state, and all criteria give the same angle. So let
# the forces swing within a cycle: unloaded, before the turn, after it.
if SKEW:
    swinging = {
        "with contact": np.stack([0 * K_before.K, K_before.K, K_closed.K]),
        "without": np.stack([0 * K_before.K, K_before_off.K, K_overlap.K]),
    }
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.8), layout="constrained", sharey=True)
    shown = ~K_closed.at_surface
    kinks = {}
    for axis, (how, K) in zip(axes, swinging.items(), strict=True):
        for color, (name, criterion) in enumerate(CRITERIA.items()):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", xc.XcrackWarning)
                kinks[name, how] = np.degrees(criterion(K, STEEL.nu)[0])
            axis.plot(K_closed.x[shown, 1], kinks[name, how][shown], f"C{color}", label=name)
        axis.axhline(0, color="0.7", lw=0.8)
        axis.set(xlabel="y along the front, mm", title=LABEL[how].removeprefix("after it, "))
    axes[0].set_ylabel("kink, degrees")
    axes[0].legend(frameon=False, fontsize="small")
    figure.savefig(OUT / "criteria.png", dpi=150)

    figure, axes = plt.subplots(
        1, 3, figsize=(9, 6.4), layout="constrained", sharex=True, sharey=True
    )
    for axis, y0 in zip(axes, (2.0, 5.0, 8.0), strict=True):
        for name, (history, _) in runs.items():
            color, style = LOOK[name]
            x, z = [], []
            for step in history.steps:
                front = step.sif[-1][0].x
                x.append(np.interp(y0, front[:, 1], front[:, 0]))
                z.append(np.interp(y0, front[:, 1], front[:, 2]))
            axis.plot(x, z, style, color=color, marker="o", ms=4, label=LABEL[name])
        height = np.linspace(START - R, max(z), 2)
        axis.plot(np.tan(TILT) * (height - ROOT), height, ":", color="0.6", label="straight on")
        axis.set(xlabel="x, mm", title=f"path of the front at y = {y0:g} mm", aspect="equal")
        axis.margins(x=0.3)
    axes[0].set_ylabel("z, mm")
    axes[0].legend(frameon=False, fontsize="small")
    figure.savefig(OUT / "paths.png", dpi=150)
    print(
        "  y, mm   kink, deg, with contact: hoop   mean  weighted  without: hoop   mean  weighted"
    )
    for j in np.nonzero(shown)[0][:: max(1, int(shown.sum()) // 8)]:
        values = [kinks[name, how][j] for how in swinging for name in CRITERIA]
        print("{:7.2f} {:30.2f} {:6.2f} {:9.2f} {:14.2f} {:6.2f} {:9.2f}".format(
            K_closed.x[j, 1], *values))  # fmt: skip

# %% Checks
first = runs["before"][1]
with_contact, without = (runs[name][0] for name in ("with contact", "without"))
share_before = max(float(lip["area"][lip["closed"]].sum() / lip["area"].sum()) for lip in first)
assert share_before < 0.01  # open throughout before the turn
assert 0.02 < closed_share < 0.6
pressed = closed.lips[0].x[closed.contact[0].closed]
assert levers(pressed)[0].max() < 0  # on the pressed side only
assert abs(pressed_gap) < 1e-6 * np.abs(closed.opening(0)).max()  # tolerance of the solver
# Balance: the stress of the ligament is as good as the mesh.
tolerance = 0.02
bent = MOMENT / R  # a force of the size that each half of the section carries
print(f"out of balance: force {total[0] / bent:.2%}, moment {total[1] / MOMENT - 1:.2%}, "
      f"other moment {total[2] / MOMENT:.2%}")  # fmt: skip
assert abs(total[0]) < tolerance * bent
assert abs(total[1] / MOMENT - 1) < tolerance
assert abs(total[2]) < tolerance * MOMENT
assert pushed > 0.1 * bent  # so that contact is part of the balance
assert K_overlap.K_I.min() < -0.2 * K_overlap.K_I.max()  # without contact the faces overlap
assert overlap.min() < 0
inside = ~K_closed.at_surface
assert K_closed.K_I[inside].min() > -0.05 * K_closed.K_I.max()
last_with, last_without = with_contact.steps[-1], without.steps[-1]
assert abs(last_with.cycles / last_without.cycles - 1) > 0.02  # a different life,
area_with, area_without = (runs[name][1][-1]["area"].sum() for name in ("with contact", "without"))
assert abs(area_with - area_without) > 0.002 * SECTION  # and a different front
if not SKEW:
    # Mirror symmetry: mode I only, within the error of the unsymmetric mesh and the grown front.
    shear = [max(row[8], row[9]) / row[7] for row in rows if row[0] == "before"]
    print(f"largest |K_II| or |K_III| over the largest K_I before the turn: {max(shear):.2%}")
    assert max(shear) < 0.03
    steps_grown = len(runs["before"][0].steps) - 1 + len(with_contact.steps) - 1
    assert QUICK or steps_grown >= 12
else:
    sheared = np.abs(K_before.K_II).max() / K_before.K_I.max()
    print(f"inclined crack before the turn: largest |K_II| over the largest K_I {sheared:.1%}")
    assert sheared > 0.05
    hoop, mean = (kinks[name, "with contact"] for name in ("max_hoop_stress", "mean_reference"))
    assert np.abs(hoop - mean)[shown].max() > 1  # criteria differ in a swinging cycle,
    without_contact = kinks["mean_reference", "without"]
    assert np.abs(mean - without_contact)[shown].max() > 0.3  # and contact affects them
print(", ".join(f"{part} {seconds:.0f} s" for part, seconds in spent.items()))
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
