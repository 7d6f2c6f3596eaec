"""A crack meets an inclusion: a soft one draws it in, a stiff one turns it away.

A plate with a disc of another modulus is pulled, and a crack grows from the edge towards a point
below the disc. In a plate of one material it runs straight on. The disc is a cell set of the mesh;
nothing else differs between the three runs but its Young's modulus.

Units: N, mm, MPa. Pictures, ParaView files and a table go to out/inclusion.
"""

# %% One mesh, three inclusions
import csv
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/inclusion")
OUT.mkdir(parents=True, exist_ok=True)
PLATE = xc.read_mesh(Path(__file__).parent / "meshes" / "inclusion.msh")  # sets plate, inclusion
CENTRE, RADIUS = np.array([30.0, 9.0]), 7.0
E, NU = 70e3, 0.33
RATIOS = {"soft": 1 / 8, "none": 1.0, "stiff": 8.0}  # E of the inclusion over that of the plate


def scene(ratio):
    materials = {
        "plate": xc.Isotropic(E, NU, plane="strain"),
        "inclusion": xc.Isotropic(ratio * E, NU, plane="strain"),
    }
    pull = [xc.traction("top", (0.0, 30.0)), xc.traction("bottom", (0.0, -30.0))]
    return xc.Problem(PLATE, materials, [xc.line_crack([(-1.0, 0.0), (12.0, 0.0)])], loads=pull)


def run(ratio):
    """Growth by steps of 1.5 mm, and one from a cell before an interface to a cell behind it.

    Beside the interface, at a shallow angle, K is a percent or so off; both are warned of.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "(?s).*(another material begins|passes from)")
        growth = xc.grow(
            scene(ratio), xc.paris(C=1e-12, m=3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=1.5,
            max_steps=18, progress=False,
        )  # fmt: skip
        return xc.collect(growth)


runs = {name: run(ratio) for name, ratio in RATIOS.items()}

# %% Where do the cracks pass the inclusion?
below = {}
for name, history in runs.items():
    points = history.cracks[0].points
    below[name] = float(np.interp(CENTRE[0], *points.T))
    depth = RADIUS - np.linalg.norm(points - CENTRE, axis=1).min()
    words = f"{depth:.2f} mm inside" if depth > 0 else f"{-depth:.2f} mm outside"
    print(f"{name:5}: y = {below[name]:+.3f} below the centre, {words} of the inclusion")
assert below["soft"] > 1.0
assert abs(below["none"]) < 0.02
assert below["stiff"] < -0.5

# %% A table and pictures
with (OUT / "paths.csv").open("w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["inclusion", "x", "y"])
    for name, history in runs.items():
        table.writerows([name, *np.round(point, 6)] for point in history.cracks[0].points)
figure, axes = plt.subplots(figsize=(6.5, 4.5), layout="constrained")
axes.add_patch(plt.Circle(tuple(CENTRE), RADIUS, facecolor="0.88", edgecolor="0.4"))
for (name, history), colour in zip(runs.items(), ("tab:blue", "0.3", "tab:red"), strict=True):
    label = f"{name}: E ratio {RATIOS[name]:g}"
    axes.plot(*history.cracks[0].points.T, ".-", color=colour, label=label)
axes.set(xlim=(0, 45), ylim=(-8, 18), aspect="equal", xlabel="x in mm", ylabel="y in mm")
axes.legend(frameon=False, loc="upper left")
figure.savefig(OUT / "paths.png", dpi=110)
plt.close(figure)
last = runs["stiff"].steps[-1].solutions[-1]
xc.plot(last, "syy", file=OUT / "stiff.png", warp=40.0)
runs["soft"].write(OUT)
print(f"pictures, ParaView files and a table are in {OUT.resolve()}")
