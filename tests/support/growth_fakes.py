"""Growth with K from a formula in place of an analysis: what is tested is the growth alone."""

from types import SimpleNamespace

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.crack.crack import tip_frames
from xcrack.crack.lines import line_crack
from xcrack.crack.measures import length_inside
from xcrack.growth import run as growth
from xcrack.linalg.reuse import Reuse
from xcrack.mesh.box import box
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.sif import SIF

STRESS = 100.0


def plate(cracks=None, size=(60.0, 40.0), n=(60, 40)):
    """A plate with the edge crack y = 0.37, 0 < x < 5, where nothing else is said."""
    if cracks is None:
        cracks = [line_crack([(0.0, 0.37), (5.0, 0.37)])]
    mesh = box((0.0, -size[1] / 2), (size[0], size[1] / 2), n)
    return Problem(mesh, Isotropic(E=210e3, nu=0.3, plane="strain"), cracks=cracks)


def sif(crack, K):
    x, frame = tip_frames(crack)
    n = len(x)
    return SIF(
        x=x,
        frame=frame,
        K=np.asarray(K, dtype=float).reshape(n, 2),
        T=np.zeros(n),
        spread=np.zeros((n, 2)),
        s=np.zeros(n),
        front=np.arange(n),
        at_surface=np.zeros(n, dtype=bool),
        closed=np.zeros(n, dtype=bool),
        domain_cells=np.full(n, 4.0),
    )


def fake_solution(**values):
    """A Solution with some of its fields only, which no check of them sees."""
    solution = object.__new__(Solution)
    for name, value in values.items():
        object.__setattr__(solution, name, value)
    return solution


def patch_respond(monkeypatch, K_of, radius=1.5):
    """Let growth take K `(f, 2)` under full load from ``K_of(problem, crack number)``.

    Returns a list that the numerics and warm start of each call are appended to.
    """
    calls = []

    def respond(problem, run, reuse):
        calls.append((problem.numerics, reuse))
        n = sum(crack.n_tips for crack in problem.placed)
        solutions = tuple(
            fake_solution(
                problem=problem,
                state=load,
                space=SimpleNamespace(radius=np.full(n, radius)),
                reuse=Reuse(
                    centre=(np.full((1, 2), 1.0 if not reuse.centre else reuse.centre[0] + 1),)
                ),
            )
            for load in run.cycle.load_states
        )
        full = [K_of(problem, c) for c in range(len(problem.placed))]
        answers = tuple(
            tuple(sif(crack, load * np.asarray(K)) for crack, K in zip(problem.placed, full))
            for load in run.cycle.load_states
        )
        return solutions, answers, solutions[0].reuse

    monkeypatch.setattr(growth, "respond", respond)
    return calls


def mode_I(factor=lambda a: np.sqrt(np.pi * a), stress=STRESS):
    """K_I = stress * factor(length), K_II = 0 at every tip of a crack."""

    def K_of(problem, c):
        crack = problem.placed[c]
        a = length_inside(crack, problem.mesh) / max(crack.n_tips, 1)
        return [[stress * factor(a), 0.0]] * crack.n_tips

    return K_of
