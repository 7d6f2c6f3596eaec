"""A patch bonded over a cracked plate: what a model in the plane says of it, and what it cannot.

A patch takes load from the plate under it, and it bridges the crack. A plane model has one
displacement through plate and patch, whose stiffnesses add: a plate of modulus E + E_patch t_patch
/ t. That gives the stress that is left in the plate, and with it the load that the stiffer place
attracts. But a crack in such a model cuts the patch as well, and K is that of a cracked patch: an
upper bound. A patch that is whole holds the faces together through its
adhesive; then K is bounded however long the crack is (Rose, 1981). This example has both, and the
range between is what needs a 3D model of plate, adhesive and patch.

Units: N, mm, MPa; K in MPa √mm. Pictures, ParaView files and a table go to out/bonded_patch.
"""

# %% A sheet of aluminium, 3 mm thick, under a patch of boron-epoxy, taken as isotropic
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import xcrack as xc

OUT = Path("out/bonded_patch")
OUT.mkdir(parents=True, exist_ok=True)
SIDE = 240.0
PATCH = (80.0, 25 * SIDE / 97)  # width and height, along rows of cells
T, T_PATCH, T_GLUE = 3.0, 1.0, 0.2  # thicknesses
E, NU, E_PATCH, SHEAR_GLUE = 70e3, 0.33, 200e3, 700.0
STRESS = 100.0
S = E_PATCH * T_PATCH / (E * T)  # stiffness of the patch over that of the plate under it


def is_under(x):
    return (np.abs(x) < np.array(PATCH) / 2).all(axis=1)


MESH = xc.box((-SIDE / 2, -SIDE / 2), (SIDE / 2, SIDE / 2), (96, 97))
MESH = MESH.with_cell_sets({"bare": lambda x: ~is_under(x), "patched": is_under})


def scene(cracks, patched=True):
    bare = xc.Isotropic(E, NU, plane="stress")
    both = xc.Isotropic(E * (1 + S), NU, plane="stress")  # force through both, over the plate
    pull = [xc.traction("top", (0.0, STRESS)), xc.traction("bottom", (0.0, -STRESS))]
    return xc.Problem(
        MESH, {"bare": bare, "patched": both if patched else bare}, cracks, loads=pull
    )


# %% Without a crack: the stress that is left in the plate under the patch
uncracked = xc.solve(scene([]))
total = float(uncracked.stress([(0.3, 0.1)])[0, 1, 1])  # of both, over the thickness of the plate
left = total / (1 + S)  # the share of the plate
print(f"the place under the patch carries {total / STRESS:.2f} times the stress from afar,")
print(f"of it the plate {left / STRESS:.2f}; without attraction it would be {1 / (1 + S):.2f}")
assert 1 / (1 + S) < left / STRESS < 1.0

# %% With a crack: no patch, a patch that is cracked too, and Rose's limit of a whole patch
beta = np.sqrt(SHEAR_GLUE / T_GLUE * (1 / (E * T) + 1 / (E_PATCH * T_PATCH)))  # 1 / way of the load
spring = beta * S / (1 + S)  # of the bridged faces, 1/mm: stress is E spring u


def rose(a):
    """K of a crack whose faces springs hold, under the stress that is left (Rose, 1981)."""
    return left * np.sqrt(np.pi * a / (1 + np.pi * spring * a))


rows = []
for a in (5.0, 10.0, 15.0, 20.0, 25.0):
    crack = [xc.line_crack([(-a, 0.0), (a, 0.0)])]
    alone = xc.stress_intensity(xc.solve(scene(crack, patched=False))).K_I[0]
    patched = xc.solve(scene(crack))
    with_patch = xc.stress_intensity(patched).K_I[0]
    rows.append((a, alone, with_patch / (1 + S), rose(a)))
    words = "a = {:4.1f}: K alone {:6.0f}, patch cracked too {:6.0f}, whole {:6.0f}"
    print(words.format(*rows[-1]))
    assert rows[-1][3] < rows[-1][2] < rows[-1][1]

# %% A table and pictures
with (OUT / "bonded_patch.csv").open("w", newline="", encoding="utf-8") as file:
    csv.writer(file).writerows([["a", "K_alone", "K_patch_cracked", "K_patch_whole"], *rows])
a, alone, cracked, whole = np.array(rows).T
figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
axes.plot(a, alone, "o-", label="no patch")
axes.plot(a, cracked, "s-", label="plane model: the patch is cracked too")
axes.plot(a, whole, "--", color="0.3", label="whole patch (Rose), stress of the plane model")
axes.fill_between(a, whole, cracked, color="0.9")
axes.set(xlabel="half length of the crack in mm", ylabel="K_I in MPa √mm", ylim=(0, None))
axes.legend(frameon=False)
figure.savefig(OUT / "K.png", dpi=110)
plt.close(figure)
xc.write(patched, OUT / "patched")
xc.plot(uncracked, "syy", file=OUT / "uncracked.png")
print(f"pictures, ParaView files and a table are in {OUT.resolve()}")
