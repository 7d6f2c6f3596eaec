"""A corner crack at the hole of a lug, from another program's mesh, grown to break-through.

A lug of 8 mm with a hole of 20 mm is pulled by a pin. Its mesh is that of another program:
tetrahedra of second order in the form of Abaqus, with the hole as a set of elements. Midside nodes
are left out, and the mesh is refined where the crack will run; new points of the hole go onto its
cylinder. A quarter circle starts at the edge of the hole, where the ring of the lug is stretched
most, and grows until its front reaches the other side of the plate. Depth, lengths on the surfaces,
and where the front meets which surface come with each step.

    python corner_crack_at_hole.py             a few minutes
    python corner_crack_at_hole.py --quick     coarse cells and two steps, under a minute

Units: N, mm, MPa. Pictures, ParaView files and tables go to out/corner_crack_at_hole.
"""

# %% The mesh of another program
import csv
import sys
import warnings
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np

import xcrack as xc

warnings.filterwarnings("ignore", "order 1", xc.XcrackWarning)  # K to a few per cent is enough

QUICK = "--quick" in sys.argv
OUT = Path("out/corner_crack_at_hole")
OUT.mkdir(parents=True, exist_ok=True)
RADIUS, OUTER, THICKNESS = 10.0, 20.0, 8.0
CRACK = 2.5
SIZE = 1.3 if QUICK else 0.9
DA = 1.6 if QUICK else 1.0
with warnings.catch_warnings():
    # It says that curved sides are straight now: the hole is put back onto its cylinder below.
    warnings.simplefilter("ignore", xc.XcrackWarning)
    given = xc.read_mesh(Path(__file__).parent / "meshes" / "lug.inp")
print(given)


# %% Finer where the crack will run
def cylinder(x):
    """Nearest points on the wall of the hole."""
    r = np.hypot(x[:, 0], x[:, 1])[:, None]
    return np.concatenate([RADIUS * x[:, :2] / r, x[:, 2:]], axis=1)


def wanted(x):
    """Longest edges around the ligament above the hole, where x = 0 and y > 0."""
    beside = np.maximum(RADIUS - x[:, 1], x[:, 1] - (16.0 if QUICK else OUTER))
    away = np.hypot(x[:, 0], np.maximum(beside, 0.0))
    return SIZE + 0.6 * np.maximum(away - 1.5 * SIZE, 0.0)


names = ("hole", "end", "front", "back")
sets = {name: given.facet_sets[name] for name in names}
mesh = xc.refine(xc.Mesh(given.points, given.cells, sets, curves={"hole": cylinder}), size=wanted)
print(mesh)

# %% A pin pulls along -x ... +x: the shank is held, the crack starts beside the hole
FORCE = np.array([20e3, 0.0, 0.0])
problem = xc.Problem(
    mesh,
    xc.Isotropic(E=72e3, nu=0.33),
    cracks=[xc.elliptic_crack((0.03, RADIUS, THICKNESS), (1, 0, 0), (0, 1, 0), CRACK, CRACK)],
    supports=[xc.fix("end")],
    loads=[xc.bearing("hole", FORCE)],
    contact="off",  # the pin only pulls
    order=1,  # many steps: K to a few per cent
)
first = xc.measures(problem.cracks[0], mesh)
print(first)

# %% Growth until the front reaches the other side
LAW = xc.paris(C=5e-13, m=3.0)


def through(step):
    """Whether the crack is on both sides of the plate."""
    on = {trace.name for trace in xc.measures(step.cracks[0], mesh).traces}
    return {"front", "back"} <= on


with warnings.catch_warnings():
    # Just before it is through, the ligament is too thin for the domains of K: said, and harmless.
    warnings.filterwarnings("ignore", "K along the front", xc.XcrackWarning)
    history = xc.collect(
        xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=DA,
                max_steps=2 if QUICK else 14, progress=False),
        until=through,
    )  # fmt: skip
print(history)
for arrival in history.arrivals:
    print(arrival)
pull = {row.name: row.force for row in history.steps[0].solutions[-1].report.resultants}
for name, force in pull.items():
    print(f"{name:<24} force {np.round(force, 3)}")

# %% What an engineer reads off: lengths on the plate and on the wall of the hole, and K there
rows, ends = history.measures(mesh)
table = history.table()
HEAD = ("step", "N", "length on the front", "length on the wall", "area", "K_I min", "K_I max")
print(" ".join(f"{name:>20}" for name in HEAD))
lines = []
for row in rows:
    own = table[table["step"] == row["step"]]
    K = (own["K_I_max_min"].min(), own["K_I_max_max"].max()) if len(own) else (np.nan, np.nan)
    lines.append((row["step"], row["N"], row["length_front"], row["length_hole"], row["area"], *K))
    print(" ".join(f"{value:20.6g}" for value in lines[-1]))
with open(OUT / "table.csv", "w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(HEAD)
    writer.writerows(lines)
for end in ends[ends["step"] == ends["step"].max()]:
    print(
        f"the front ends at ({end['x']:.3f}, {end['y']:.3f}, {end['z']:.3f}) on {str(end['set'])!r}"
    )

# %% Pictures and files
history.write(OUT)
xc.draw_fronts(history, mesh=mesh, file=OUT / "fronts.png")
last = history.solved[-1].solutions[-1]
xc.plot(
    last, "opening", zoom=2.0, file=OUT / "opening.png",
    renderer="matplotlib",
)  # fmt: skip

# %% Checks
assert np.allclose(pull["bearing('hole')"], FORCE, atol=1e-6 * FORCE[0])
assert np.allclose(pull["reaction of fix('end')"], -FORCE, atol=1e-4 * FORCE[0])
cell = float(np.median(mesh.cell_size[mesh.cell_size < 1.01 * SIZE]))
lengths = {trace.name: trace.length for trace in first.traces}
assert abs(lengths["front"] - CRACK) < 0.1 * cell
assert abs(lengths["hole"] - CRACK) < 0.1 * cell
assert {end.name for end in first.ends} == {"front", "hole"}
assert (np.diff(rows["area"]) > 0).all()
if not QUICK:
    assert through(history.steps[-1])
    assert rows["length_hole"][-1] > 0.9 * THICKNESS
print(f"pictures, ParaView files and tables are in {OUT.resolve()}")
