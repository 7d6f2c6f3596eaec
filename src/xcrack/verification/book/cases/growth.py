"""Paths and shapes of growing cracks, and a run that is stopped and goes on."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import penny_crack
from xcrack.fatigue.criteria import max_hoop_stress, weighted_angle
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.growth.run import grow
from xcrack.mesh.box import box
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.collect import collect, resume
from xcrack.verification.book.case import Case, Value

_LAW = paris(C=1e-3, m=3.0)
_RADIUS, _CENTRE = 0.4, np.array([0.013, -0.021, 0.0317])


def _inclined(n: int) -> Problem:
    return Problem(
        box((-1.0, -1.0), (1.0, 1.0), n),
        Isotropic(210e3, 0.3, "strain"),
        [line_crack([(-0.31, -0.11), (0.29, 0.12)])],
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
        order=1,
    )


def _path(level: int) -> list[Value]:
    """An inclined crack turns across the load, at both tips alike."""
    steps = grow(
        _inclined(16 * 2**level), _LAW, max_hoop_stress, Cycle(0, 1), da=0.12, max_steps=4,
        progress=False,
    )  # fmt: skip
    x = collect(steps).cracks[0].points
    last = np.degrees(np.arctan2(*(x[-1] - x[-2])[::-1]))
    deviation = np.abs((x + x[::-1]) / 2 - [-0.01, 0.005]).max()
    return [
        Value("direction of the last step, degrees", float(last), 0.0, 6.0, 1.0),
        Value("deviation from antisymmetry", float(deviation), 0.0, 0.02, 1.0),
    ]


def _straight_path(level: int) -> list[Value]:
    """An edge crack across the load stays straight on a mesh that is its own mirror image."""
    problem = Problem(
        box((0.0, -1.0), (1.0, 1.0), (20 * 2**level, 40 * 2**level)),
        Isotropic(210e3, 0.3, "strain"),
        [line_crack([(-0.1, 0.0), (0.31, 0.0)])],
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
    )
    steps = grow(problem, _LAW, max_hoop_stress, Cycle(0, 1), da=0.1, max_steps=4, progress=False)
    x = collect(steps).cracks[0].points[-1]
    return [
        Value("x of the tip", float(x[0]), 0.61, 1e-6),
        Value("y of the tip", float(x[1]), 0.0, 1e-5, 1.0),
    ]


def _round(level: int) -> list[Value]:
    """A penny across the load stays round: one advance."""
    problem = Problem(
        box((-1.0,) * 3, (1.0,) * 3, 8 * 2**level),
        Isotropic(210e3, 0.3),
        [penny_crack(_CENTRE, (0, 0, 1), _RADIUS, n=64)],
        loads=[traction("top", (0, 0, 100.0)), traction("bottom", (0, 0, -100.0))],
        order=1,
    )
    steps = grow(
        problem, paris(C=1e-11, m=0.5), max_hoop_stress, Cycle(0.0, 1.0), da=0.12, max_steps=2,
        progress=False,
    )  # fmt: skip
    first, second = list(steps)
    crack = second.cracks[0]
    assert crack.fronts is not None
    x = crack.points[crack.fronts[0]] - _CENTRE
    radius = np.hypot(x[:, 0], x[:, 1])
    da = float(first.da[0].mean())
    return [
        Value("mean radius", float(radius.mean()), _RADIUS + da, 0.03 * 0.12, 1.0),
        Value("scatter of the radius", float(radius.std()), 0.0, 0.03 * 0.12, 1.0),
        Value("height over the plane", float(np.abs(x[:, 2]).max()), 0.0, 0.1 * 0.12, 1.0),
    ]


def _restart(level: int) -> list[Value]:
    """Stopped after the first step and resumed, with contact: the same table to the last bit."""
    del level
    run: dict[str, Any] = {
        "problem": _inclined(12), "law": _LAW, "criterion": weighted_angle,
        "cycle": Cycle(-1.0, 1.0), "da": 0.15, "max_steps": 3, "progress": False,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole_run = collect(grow(**run), folder / "whole").table()
        collect(grow(**run), folder / "stopped", until=lambda step: step.index == 0)
        resumed_run = resume(folder / "stopped", **run).table()
    differ = float(np.frombuffer(whole_run.tobytes(), np.uint8).size != len(resumed_run.tobytes()))
    if not differ:
        differ = float(np.count_nonzero(whole_run.view(np.uint8) != resumed_run.view(np.uint8)))
    return [Value("bytes that differ", differ, 0.0, 0.0, 1.0)]


CASES = (
    Case("inclined-path", "path", "a crack turns across the load, antisymmetry", "exact", 2, 1,
         False, _path, 2),
    Case("straight-path", "path", "symmetry", "exact", 2, 2, False, _straight_path),
    Case("round-front", "fronts", "a penny under tension stays a circle", "exact", 3, 1, False,
         _round, 2),
    Case("stopped-run", "restart", "the same run without a stop", "exact", 2, 1, True, _restart),
)  # fmt: skip


__all__ = ["CASES"]
