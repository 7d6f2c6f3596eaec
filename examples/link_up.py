"""Multi-site damage: cracks from both sides of three holes in a row link up.

A sheet with three holes is pulled; a crack starts at each side of each hole. Between the holes tips
head for each other, meet and become one crack; then the outer tips run on, faster than before. The
cycles of each link-up hardly depend on the mesh, and the outer tips have the K of one straight
crack that runs through all holes.

Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and a table go to out/link_up.
"""

# %% The sheet: pitches and lengths differ a little, as they do in practice
import csv
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/link_up")
OUT.mkdir(parents=True, exist_ok=True)
SHEET = xc.Isotropic(E=72e3, nu=0.33, plane="stress")
RADIUS, HOLES, ROW = 2.5, (-21.0, 0.0, 23.0), 0.03
LENGTHS = ((2.4, 3.0), (2.2, 2.6), (2.8, 2.3))  # of the cracks left and right of each hole
LAW = xc.paris(C=2.4e-12, m=3.2)
CYCLE = xc.Cycle(0.0, 1.0)


def sheet(size):
    """The sheet, meshed by gmsh with cells of a size along the row of holes."""
    mesh = xc.plate(
        110.0, 80.0, size=8.0, size_near=size, lower=(-55.0, -40.0),
        holes=[((x, 0.0), RADIUS) for x in HOLES], along=[(-45.0, 0.0), (45.0, 0.0)],
    )  # fmt: skip
    cracks = []
    for x, (left, right) in zip(HOLES, LENGTHS, strict=True):
        cracks.append([(x - RADIUS, ROW), (x - RADIUS - left, ROW)])
        cracks.append([(x + RADIUS, ROW), (x + RADIUS + right, ROW)])
    return problem(mesh, cracks)


def problem(mesh, lines):
    """Cracks along lines in a sheet that is pulled by 70 MPa."""
    loads = [xc.traction("top", (0.0, 70.0)), xc.traction("bottom", (0.0, -70.0))]
    return xc.Problem(mesh, SHEET, [xc.line_crack(line) for line in lines], loads=loads)


def run(size):
    """Growth to the edges; the last steps before a link-up warn of K beside another tip."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        grown = xc.grow(sheet(size), LAW, xc.max_hoop_stress, CYCLE, da=1.0, progress=False)
        return xc.collect(grown)


# %% Growth on two meshes: when and where do the cracks link up?
coarse, fine = run(0.7), run(0.5)
for history in (coarse, fine):
    assert len(history.joins) == 2, history.joins
    print(f"{len(history.steps)} steps, {history.ended}")
rows = []
for one, other in zip(coarse.joins, fine.joins, strict=True):
    print(f"{other}; on the coarse mesh N = {one.N:.0f}")
    assert abs(one.N / other.N - 1) < 0.02
    rows.append((other.step, *other.point, one.N, other.N))
print(f"life to the edges {fine.life:.0f}, on the coarse mesh {coarse.life:.0f}")
assert abs(coarse.life / fine.life - 1) < 0.02

# %% After the last link-up: K of the outer tips against one straight crack of the same ends
after = fine.steps[fine.joins[-1].step + 1]
mesh = fine.mesh if fine.mesh is not None else sheet(0.5).mesh
outer = np.array([sif.x[0] for sif in after.sif[-1] if len(sif.x)])
K = np.array([sif.K_I[0] for sif in after.sif[-1] if len(sif.x)])
left, right = outer[np.argsort(outer[:, 0])]
straight = xc.stress_intensity(xc.solve(problem(mesh, [[left, right]])))
alone = straight.K_I[np.argsort(straight.x[:, 0])]
print(
    "K_I of the outer tips", np.round(K[np.argsort(outer[:, 0])], 1), "straight", np.round(alone, 1)
)
assert np.abs(K[np.argsort(outer[:, 0])] / alone - 1).max() < 0.01

# %% A table and a picture
with (OUT / "link_up.csv").open("w", newline="", encoding="utf-8") as file:
    table = csv.writer(file)
    table.writerow(["step", "x", "y", "N_coarse", "N_fine"])
    table.writerows(rows)
figure, (above, below) = plt.subplots(
    2, 1, figsize=(7.5, 5.0), height_ratios=(1, 2.5), layout="constrained"
)
for x in HOLES:
    above.add_patch(plt.Circle((x, 0.0), RADIUS, facecolor="0.85", edgecolor="0.4"))
for crack in fine.cracks:
    above.plot(*crack.points.T, color="tab:blue", linewidth=1.5)
for join in fine.joins:
    above.plot(*join.point, "o", color="tab:red", markersize=5)
    above.annotate(
        f"N = {join.N:.0f}", join.point, (0, 12), textcoords="offset points", ha="center"
    )
above.set(xlim=(-55, 55), ylim=(-9, 9), aspect="equal", xlabel="x in mm", ylabel="y in mm")
for history, style in ((coarse, ":"), (fine, "-")):
    for side, colour, name in ((-1, "tab:blue", "left"), (1, "tab:orange", "right")):
        outermost = [
            (step.cycles, max(side * sif.x[0, 0] for sif in step.sif[-1] if len(sif.x)))
            for step in history.steps
            if any(len(sif.x) for sif in step.sif[-1])
        ]
        N, way = np.array([row for row in outermost if row[1] > HOLES[-1]]).T
        label = f"{name} outer tip" if style == "-" else None
        below.plot(N, way, style, color=colour, label=label)
for join in fine.joins:
    below.axvline(join.N, color="tab:red", linewidth=0.8)
below.set(xlabel="cycles N", ylabel="x of the outer tips in mm, left one mirrored")
below.legend(frameon=False)
figure.savefig(OUT / "link_up.png", dpi=110)
plt.close(figure)
xc.plot(after.solutions[-1], "syy", file=OUT / "after.png", warp=20.0, zoom=2.0)
fine.write(OUT)
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
