"""Waves of a front that grows through a notched bar: growth of second order and Euler's rule.

``python -m benchmarks.front_waves`` prints the wave inside the bar for each step and stores both
runs in ``benchmarks/results/front_waves.json``. The wave is what a polynomial of degree 8 leaves of
the front, in cells.
"""

import json
import tempfile
import warnings
from pathlib import Path

import numpy as np

import xcrack as xc
from xcrack.base.arrays import Floats

RESULT = Path(__file__).parent / "results" / "front_waves.json"
DIAMETER, NOTCH, DEPTH = 20.0, 2.0, 3.0
SIZE, DA, N_STEPS = 0.3, 0.6, 13
MOMENT_STRESS, LEVER = 100.0, 80.0


def bar() -> xc.Problem:
    """A notched bar in four-point bending with a straight front below the root of the notch."""
    mesh = xc.notched_cylinder(
        diameter=DIAMETER, length=140.0, notch_depth=NOTCH, notch_angle=np.radians(60.0),
        outer_span=120.0, inner_span=40.0, size=5.0, size_near=SIZE, crack_depth=14.0,
        transition=10.0,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:  # as read, so that a run may be repeated
        file = Path(folder) / "bar.msh"
        xc.write_mesh(file, mesh)
        mesh = xc.read_mesh(file)
    force = 2 * MOMENT_STRESS * np.pi * DIAMETER**3 / 32 / LEVER
    loads = []
    for side in ("left", "right"):
        for station, face, sign in (("inner", 12, 1.0), ("outer", 0, -1.0)):
            name = f"{station}_{side}_{face:02d}"
            corner = mesh.points[mesh.facet_sets[name]]
            normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            area = np.linalg.norm(normal, axis=1).sum() / 2
            loads.append(xc.traction(name, (0.0, 0.0, -sign * force / area)))
    root = NOTCH - DIAMETER / 2
    low, high = root - 0.35 * NOTCH, root + DEPTH - NOTCH
    corners = [(0.0, -12.0, low), (0.0, 12.0, low), (0.0, 12.0, high), (0.0, -12.0, high)]
    return xc.Problem(
        mesh, xc.Isotropic(E=210e3, nu=0.3), cracks=[xc.plane_crack(corners)], loads=loads,
        contact="off", order=1,
    )  # fmt: skip


def wave(step: xc.Step) -> Floats:
    """Wave of a front: rms and largest six cells inside, largest three cells inside."""
    crack = step.corrected[0]
    assert crack.fronts is not None
    x = crack.points[crack.fronts[0]]
    x = x[np.argsort(x[:, 1])]
    y, z = x[np.hypot(x[:, 1], x[:, 2]) < DIAMETER / 2, 1:].T
    even = np.linspace(-0.985, 0.985, 321) * np.abs(y).max()
    height = np.interp(even, y, z)
    smooth = np.polynomial.chebyshev.Chebyshev.fit(even, height, 8)
    rest = (height - smooth(even)) / SIZE
    inside = [np.abs(even) < np.abs(y).max() - cells * SIZE for cells in (6, 3)]
    far, near = rest[inside[0]], rest[inside[1]]
    return np.array([far.std(), np.abs(far).max(), np.abs(near).max()])


def main() -> None:
    """Run both, print and store them."""
    problem, law = bar(), xc.elber(C=2.4e-12, m=3.0, a=0.5, b=0.4)
    rows: dict[str, list[list[float]]] = {}
    for integrator in ("euler", "pec"):
        rows[integrator] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            for step in xc.grow(
                problem, law, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=DA, max_steps=N_STEPS,
                progress=False, integrator=integrator,
            ):  # fmt: skip
                sif = step.sif[-1][0]
                shear = np.abs(sif.K[~sif.at_surface][:, 1:]).max(axis=0) / sif.K_I.mean()
                rows[integrator].append([*wave(step).tolist(), *shear.tolist()])
                print(integrator, step.index, np.round(rows[integrator][-1], 3).tolist())
    RESULT.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
