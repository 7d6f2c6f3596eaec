"""Numbers of another program: a slanted edge crack beside a hole, open and closed."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.mesh.plates import plate
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import energy_release_rate, stress_intensity
from xcrack.verification.book.case import Case, Value

# N, mm, MPa
HALF = (20.0, 40.0)  # of the plate, about the origin
HOLE, RADIUS = (6.0, 9.0), 6.0
ANGLE, LENGTH = np.radians(25.0), 16.0
CRACK = (
    (-20.0, -6.0),
    (-20.0 + LENGTH * float(np.cos(ANGLE)), -6.0 + LENGTH * float(np.sin(ANGLE))),
)
MATERIAL = (210e3, 0.3)  # E, nu; plane strain
STRESS = 100.0  # at both ends
# CalculiX 2.20, by benchmarks/baselines/calculix.py: G in N/mm, and how far the faces at the mouth
# are apart (open), or have slid (closed), in mm: of its finest mesh, 3e-4 in G from the one
# before.
_G = {1.0: 9.7616, -1.0: 0.8584}
_MOUTH = {1.0: 0.09019, -1.0: 0.01851}


def _run(level: int, factor: float) -> list[Value]:
    size = 0.8 / 2**level
    E, nu = MATERIAL
    mesh = plate(2 * HALF[0], 2 * HALF[1], lower=(-HALF[0], -HALF[1]), size=5 * size,
                 size_near=size, holes=[(HOLE, RADIUS)], along=[CRACK])  # fmt: skip
    direction, mouth, tip = np.array([np.cos(ANGLE), np.sin(ANGLE)]), *np.array(CRACK)
    frame = {1.0: np.array([-direction[1], direction[0]]), -1.0: -direction}[factor]
    ends = [traction("top", (0.0, STRESS)), traction("bottom", (0.0, -STRESS))]
    problem = Problem(mesh, Isotropic(E, nu, "strain"), [line_crack([mouth - direction, tip])],
                      loads=ends)  # fmt: skip
    solution = solve(problem, [factor])[0]
    G = energy_release_rate(stress_intensity(solution), problem.elasticity.material)
    at = mouth[None] + 1e-6 * direction
    jump = solution.displacement(at, 1) - solution.displacement(at, -1)
    name = "opening at the mouth" if factor > 0 else "slip at the mouth"
    return [
        Value("G", float(G[0]), _G[factor], 2e-3 if factor > 0 else 5e-3),
        Value(name, float(frame @ jump[0]), _MOUTH[factor], 2e-3 if factor > 0 else 5e-3),
    ]


_SOURCE = "CalculiX 2.20 on a mesh that follows the crack (benchmarks/baselines/calculix.py)"

CASES = (
    Case("program-open", "K", _SOURCE, "program", 2, 2, False, partial(_run, factor=1.0), 2,
         needs="gmsh"),
    Case("program-closed", "sliding", _SOURCE, "program", 2, 2, True, partial(_run, factor=-1.0), 2,
         needs="gmsh"),
)  # fmt: skip


__all__ = ["ANGLE", "CASES", "CRACK", "HALF", "HOLE", "LENGTH", "MATERIAL", "RADIUS", "STRESS"]
