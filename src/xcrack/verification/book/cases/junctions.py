"""Cracks that end on others: T, X and Y, open and pressed, against conforming elements."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.junctions_3d import arm
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import plane_crack
from xcrack.mesh.box import box
from xcrack.model.loads import fix, traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import NU, E, perturbed

OPEN = np.array([[0.8, 0.15], [0.15, 1.0]])
PRESSED = np.array([[-0.5, 0.6], [0.6, -1.0]])
_LEFT, _RIGHT = np.array([-0.5, -0.1]), np.array([0.45, 0.05])
_ON = _LEFT + 0.55 * (_RIGHT - _LEFT)
_UP, _DOWN = _ON + np.array([0.12, 0.5]), _ON - np.array([0.1, 0.4])
_FORK = np.array([0.013, 0.027])
_ARMS = [
    np.array([-0.52, -0.06]),
    _FORK + 0.45 * np.array([np.cos(0.6), -np.sin(0.6)]),
    _FORK + 0.42 * np.array([np.cos(0.7), np.sin(0.7)]),
]
LINES: dict[str, list[tuple[Floats, ...]]] = {
    "T": [(_LEFT, _RIGHT), (_ON, _UP)],
    "X": [(_LEFT, _RIGHT), (_ON, _UP), (_DOWN, _ON)],
    "Y": [(_ARMS[0], _FORK, _ARMS[1]), (_FORK, _ARMS[2])],
}
# K_I and K_II at the tips in the order of the lines, by `python -m
# benchmarks.baselines.network_2d`; 1e-5 from its coarser meshes, the pressed ones 1e-3.
K = {
    "T": [[1.52422, 0.16310], [1.43119, 0.32776], [0.70267, -0.03382]],
    "X": [[1.45963, 0.19838], [1.36237, 0.29217], [0.77859, -0.04820], [0.53847, -0.20531]],
    "Y": [[1.53050, 0.39460], [1.44002, -0.16761], [0.93288, 0.06428]],
}
K_PRESSED = [0.68230, 0.72207, 0.66095]  # |K_II|


def _K_at_tips(name: str, stress: Floats, contact: str, level: int) -> Floats:
    sides = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "top": (0.0, 1.0), "bottom": (0.0, -1.0)}
    loads = [traction(side, tuple(stress @ np.array(n))) for side, n in sides.items()]
    cracks = [line_crack(line) for line in LINES[name]]
    problem = Problem(
        perturbed(20 * 2**level), Isotropic(E, NU, "strain"), cracks, loads=loads, contact=contact
    )
    solution = solve(problem)
    return np.concatenate([stress_intensity(solution, c).K for c in range(len(cracks))])


def _open(level: int, name: str) -> list[Value]:
    difference = np.abs(np.abs(_K_at_tips(name, OPEN, "off", level)) - np.abs(K[name]))
    error = difference.max(axis=1) / np.linalg.norm(K[name], axis=1)
    return [Value(f"error of K, tip {k}", float(e), 0.0, 5e-4, 1.0) for k, e in enumerate(error)]


def _pressed_junction(level: int) -> list[Value]:
    slips = np.abs(_K_at_tips("T", PRESSED, "on", level)[:, 1])
    return [
        Value(f"K_II, tip {k}", float(slip), reference, 0.01)
        for k, (slip, reference) in enumerate(zip(slips, K_PRESSED, strict=True))
    ]


_SOURCE = "conforming quarter-point triangles (benchmarks/baselines/network_2d.py)"


def _slice(level: int) -> list[Value]:
    """The T through a slice in plane strain: an arm on another crack in space."""
    del level
    points = [
        plane_crack([(x, y, z) for (x, z), y in zip((a, a, b, b), (0.6, -0.6, -0.6, 0.6))])
        for a, b in ((_RIGHT, _LEFT), (_ON - 0.6 * (_UP - _ON), _UP))
    ]
    sides = {"left": (-1, 0), "right": (1, 0), "top": (0, 1), "bottom": (0, -1)}
    forces = {name: OPEN @ np.array(n) for name, n in sides.items()}
    problem = Problem(
        box((-1, -0.2, -1), (1, 0.2, 1), (21, 3, 21)),
        Isotropic(E, NU),
        [points[0], arm(points[1], on=0, side=-1)],
        loads=[traction(name, (t[0], 0.0, t[1])) for name, t in forces.items()],
        supports=[fix("front", axis=1), fix("back", axis=1)],
        contact="off",
    )
    solution, rows = solve(problem), []
    for c in (0, 1):
        sif = stress_intensity(solution, c)
        for f in np.unique(sif.front):
            is_of_front = sif.front == f
            rows.append(
                (sif.x[is_of_front, 0].mean(), *np.abs(sif.K[is_of_front, :2]).mean(axis=0))
            )
    K_space = np.array([row[1:] for row in sorted(rows[:2]) + rows[2:]])
    difference = np.abs(K_space - np.abs(K["T"])).max(axis=1) / np.linalg.norm(K["T"], axis=1)
    return [
        Value(f"error of K, front {k}", float(e), 0.0, 2e-3, 1.0) for k, e in enumerate(difference)
    ]


CASES = (
    *(
        Case(f"junction-{name}", "junctions", _SOURCE, "program", 2, 2, False,
             partial(_open, name=name), 2)
        for name in LINES
    ),
    Case("junction-pressed", "junctions", _SOURCE, "program", 2, 2, True, _pressed_junction, 2),
    Case("junction-space", "junctions", _SOURCE, "program", 3, 2, False, _slice, quick=False),
)  # fmt: skip


__all__ = ["CASES", "K_PRESSED", "LINES", "OPEN", "PRESSED", "K"]
