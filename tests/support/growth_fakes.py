"""Growth with K from a formula in place of an analysis: what is tested is the growth alone."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from xcrack import Isotropic, Problem, Response, Solution, box, line_crack
from xcrack.crack.measures import length_inside
from xcrack.linalg.engine import SolverState

STRESS = 100.0


def plate(cracks=None, size=(60.0, 40.0), n=(60, 40)):
    """A plate with the edge crack y = 0.37, 0 < x < 5, where nothing else is said."""
    if cracks is None:
        cracks = [line_crack([(0.0, 0.37), (5.0, 0.37)])]
    mesh = box((0.0, -size[1] / 2), (size[0], size[1] / 2), n)
    return Problem(mesh, Isotropic(E=210e3, nu=0.3, plane="strain"), cracks=cracks)


def formula(K_of, radius=None):
    """Response whose K `(f, 2)` under full load is ``K_of(problem, crack number)``.

    Its attribute `calls` has the numerics and the warm start of each call. With a radius it also
    has solutions that know it, and nothing else.
    """

    def response(problem, states, reuse, bars):
        response.calls.append((problem.numerics, reuse))
        full = [np.reshape(K_of(problem, c), (-1, 2)) for c in range(len(problem.placed))]
        K = np.stack([float(state) * np.concatenate(full) for state in states])
        count = 1.0 if not reuse.centre else reuse.centre[0][0, 0] + 1
        after = SolverState(centre=(np.full((1, 2), count),), active=(None,))
        answer = replace(Response.of_K(problem, states, K), reuse=after)
        if radius is None:
            return answer
        space = SimpleNamespace(radius=np.full(K.shape[1], radius))
        one = fake_solution(problem=problem, space=space, reuse=after, contact=(None,))
        return replace(answer, solutions=(one,) * len(states))

    response.calls = []
    return response


def fake_solution(**values):
    """A Solution with some of its fields only, which no check of them sees."""
    solution = object.__new__(Solution)
    for name, value in values.items():
        object.__setattr__(solution, name, value)
    return solution


def mode_I(factor=lambda a: np.sqrt(np.pi * a), stress=STRESS):
    """K_I = stress * factor(length), K_II = 0 at every tip of a crack."""

    def K_of(problem, c):
        crack = problem.placed[c]
        a = length_inside(crack, problem.mesh) / max(crack.n_tips, 1)
        return [[stress * factor(a), 0.0]] * crack.n_tips

    return K_of
