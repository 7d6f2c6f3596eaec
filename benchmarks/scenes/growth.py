"""Scenes of whole runs: a crack that turns, and the life of an edge-cracked plate."""

import warnings
from functools import cache
from time import process_time

import numpy as np
from scipy.integrate import quad

import xcrack as xc
from benchmarks.runs import Outcome
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings
from xcrack.base.arrays import Floats
from xcrack.verification.exact.plates import PLATE_EDGE

TURNING = ((-1.0, 0.0), (-0.5, 0.2))  # crack of the growth, under tension along y
DA, N_STEPS = 0.05, 15
GROWN = DA * N_STEPS  # length that every run of the growth adds
# Tip after 15 steps: the conforming baseline on its finest mesh (measured, see docs/charts.md).
TURNED = np.array([0.234958, 0.341710])
# Tip after the same length in steps of no length: 30 and 60 steps of second order with cells of
# 1/30 and 1/40 end within 1e-4 of it (that baseline's ends, continued to steps of no length, too).
PATH_END = np.array([0.23309, 0.35077])

# Life: plate [0, 1] x [-1, 1], pulled by 1 at its ends; the crack grows from A0 to A1.
A0, A1 = 0.2, 0.5
LAW = xc.paris(C=1e-3, m=3.0)


def tip_errors(tip: Floats, da: float) -> dict[str, float]:
    """Errors of where the tip of the turning growth ends.

    Parameters
    ----------
    tip : (2,)
        After a growth of `GROWN`.
    da : float
        Of a step.

    Returns
    -------
    dict
        "path": distance to where it ends with steps of no length, over the length grown; "tip",
        where `da` is that of the reference: distance to where that ends, in advances.
    """
    same = {"tip": float(np.hypot(*(tip - TURNED))) / DA} if np.isclose(da, DA) else {}
    return {**same, "path": float(np.hypot(*(tip - PATH_END))) / GROWN}


def growth(s: Settings, mesh: str, steps: int = N_STEPS, integrator: str = "euler") -> Outcome:
    """A crack that turns under tension while it grows by `GROWN`.

    Parameters
    ----------
    s : Settings
    mesh : {"uniform", "graded"}
        Graded: by gmsh, small cells along where the crack runs, `s.n` cells a side of that size.
    steps : int
        In which it does so.
    integrator : {"euler", "pec"}
        That of the reference with steps of the same length is Euler's.
    """
    start = process_time()
    if mesh == "uniform":
        body = xc.box((-1, -1), (1, 1), s.n)
    else:
        body = xc.plate(
            2.0, 2.0, lower=(-1.0, -1.0), size=0.25, size_near=2.0 / s.n,
            along=[(-0.6, 0.2), (0.3, 0.35)], band=0.15,
        )  # fmt: skip
    tension = np.diag([0.0, 1.0])
    loads = [xc.traction(side, lambda x, n: n @ tension) for side in ("bottom", "top")]
    problem = xc.Problem(
        body, STEEL[2], [xc.line_crack([(-1.1, -0.04), TURNING[1]])], loads=loads,
        order=s.order, numerics=s.numerics,
    )  # fmt: skip
    da = GROWN / steps
    times, tip, unknowns = [start], np.array(TURNING[1]), 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        run = xc.grow(
            problem, xc.paris(C=1e-3, m=2.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da,
            max_steps=steps + 1, progress=False, integrator=integrator,
        )  # fmt: skip
        for step in run:
            times.append(process_time())
            tip = step.corrected[0].points[-1]
            unknowns = step.solutions[0].n_dof
    if len(times) != steps + 2:
        raise xc.XcrackError(f"the growth ended after {len(times) - 2} of {steps} steps")
    lasted = np.diff(times)
    parts = {"first step": float(lasted[0]), "later step": float(np.median(lasted[1:]))}
    return Outcome(tip_errors(np.asarray(tip), da), unknowns, parts)


@cache
def exact_life() -> float:
    """Cycles from A0 to A1: the law, integrated over the length with K of the table."""
    square = [(share, factor) for (height, share), factor in PLATE_EDGE.items() if height == 1.0]
    share, factor = np.array(square).T
    # K grows like (1 - a)^(-3/2) towards the far edge; without it, a quartic passes the table.
    quartic = np.polyfit(share, factor * (1 - share) ** 1.5, 4)

    def cycles(a: float) -> float:
        K = np.sqrt(np.pi * a) * np.polyval(quartic, a) / (1 - a) ** 1.5
        return float(1 / LAW(np.array([K]), np.zeros(1))[0])

    return float(quad(cycles, A0, A1, epsrel=1e-12)[0])


def life(s: Settings, steps: int, seed: int, integrator: str = "pec") -> Outcome:
    """Cycles of an edge crack from A0 to A1 by Paris's law, against the integral of its exact K.

    Parameters
    ----------
    s : Settings
        `n` cells across the plate, twice as many along it.
    steps : int
        Of one length.
    seed : int
        Moves the inner points of the mesh.
    integrator : {"pec", "euler"}
    """
    plain = xc.box((0.0, -1.0), (1.0, 1.0), (s.n, 2 * s.n))
    x = np.array(plain.points)
    inner = (x[:, 0] > 1e-9) & (x[:, 0] < 1 - 1e-9) & (np.abs(x[:, 1]) < 1 - 1e-9)
    x[inner] += 0.15 / s.n * np.random.default_rng(seed).uniform(-1, 1, (int(inner.sum()), 2))
    problem = xc.Problem(
        xc.Mesh(x, plain.cells, plain.facet_sets), STEEL[2],
        [xc.line_crack([(-0.1, 0.0), (A0, 0.0)])],
        loads=[xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))],
        order=s.order, numerics=s.numerics,
    )  # fmt: skip
    cycles, unknowns, done = 0.0, 0, -1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        cycle, da = xc.Cycle(0.0, 1.0), (A1 - A0) / steps
        for step in xc.grow(
            problem, LAW, xc.max_hoop_stress, cycle, da, max_steps=steps + 1, progress=False,
            integrator=integrator,
        ):  # fmt: skip
            cycles, unknowns, done = float(step.cycles), step.solutions[0].n_dof, step.index
    if done != steps:
        raise xc.XcrackError(f"the growth ended after {done} of {steps} steps")
    return Outcome({"life": abs(cycles / exact_life() - 1)}, unknowns)
