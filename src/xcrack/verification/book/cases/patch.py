"""A uniform pressure goes over closed faces exactly, wherever they cut the cells: round-off."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.junctions_3d import arm
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import penny_crack
from xcrack.mesh.box import box
from xcrack.model.loads import displacement
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import NU, SIDES, E, on_box, perturbed, rows, turned
from xcrack.verification.book.scenes_3d import turn
from xcrack.verification.exact import fields_3d, potentials_2d

_P = 2.5
_ROUND_OFF = 1e-10
_SOURCE = "uniform stress (it is in the space: round-off)"


def _deviation(problem: Problem) -> float:
    contact = solve(problem).contact[0]
    assert contact is not None
    return float(np.abs(contact.pressure - _P).max() / _P)


def _any_angle(level: int, order: int) -> list[Value]:
    del level
    field = turned(lambda x, y: potentials_2d.uniform_stress(x, y, -_P, -_P, 0.0, E, NU), (0, 0))
    values = []
    for k, angle in enumerate((0.3, 1.1, 2.4)):
        ends = np.array([[-0.41, 0.0], [0.37, 0.0]]) @ rows(angle) + [0.02, -0.03]
        problem = on_box(
            perturbed(10, 11 + k), [line_crack(ends)], field, traction=SIDES, order=order,
            contact="on",
        )  # fmt: skip
        values.append(Value(f"deviation at {angle} rad", _deviation(problem), 0.0, _ROUND_OFF, 1.0))
    return values


def _any_cut(level: int, order: int) -> list[Value]:
    """A crack parallel to a row of nodes, ever closer to it."""
    del level
    field = turned(lambda x, y: potentials_2d.uniform_stress(x, y, -_P, -_P, 0.0, E, NU), (0, 0))
    values = []
    for share in (0.5, 1e-2, 1e-6, 1e-12, 0.0):
        y = 0.2 * (1 + share)
        problem = on_box(
            box((-1, -1), (1, 1), 10), [line_crack([(-0.43, y), (0.39, y)])], field,
            traction=("left", "top"), order=order, contact="on",
        )  # fmt: skip
        values.append(
            Value(
                f"deviation {share:g} cells from a row", _deviation(problem), 0.0, _ROUND_OFF, 1.0
            )
        )
    return values


def _space(level: int) -> list[Value]:
    del level
    S = -_P * np.eye(3)
    material = Isotropic(E, NU)
    values = []
    for k, axis in enumerate(((1.0, 0.0, 0.0), (0.3, -1.0, 0.7))):
        problem = Problem(
            perturbed(6, 5 + k, lower=(-1,) * 3, upper=(1,) * 3),
            material,
            [penny_crack((0.02, -0.03, 0.01), turn(axis, 0.4)[2], 0.5, n=64)],
            supports=[
                displacement("boundary", lambda x: fields_3d.uniform_stress_3d(x, S, E, NU)[0])
            ],
            contact="on",
            order=1,
        )
        values.append(Value(f"deviation, penny {k}", _deviation(problem), 0.0, 1e-5, 1.0))
    return values


def _crossing(level: int) -> list[Value]:
    """Two pennies that cross, given as one and two arms."""
    del level
    S, x = -_P * np.eye(3), (0.013, 0.0, 0.017)
    other = penny_crack(x, (1, 0, 0), 0.35)
    problem = Problem(
        box((-1,) * 3, (1,) * 3, 13),
        Isotropic(E, NU),
        [penny_crack(x, (0, 0, 1), 0.65), arm(other, on=0, side=1), arm(other, on=0, side=-1)],
        supports=[displacement("boundary", lambda x: fields_3d.uniform_stress_3d(x, S, E, NU)[0])],
        contact="on",
        order=1,
    )
    values = []
    for c, contact in enumerate(solve(problem).contact):
        assert contact is not None
        deviation = float(np.abs(contact.pressure - _P).max() / _P)
        values.append(Value(f"deviation, face {c}", deviation, 0.0, 1e-5, 1.0))
    return values


CASES = (
    *(
        Case(f"patch-{order}", "patch", _SOURCE, "exact", 2, order, True,
             partial(_any_angle, order=order))
        for order in (1, 2)
    ),
    *(
        Case(f"patch-cut-{order}", "cut", _SOURCE, "exact", 2, order, True,
             partial(_any_cut, order=order))
        for order in (1, 2)
    ),
    Case("patch-3D", "patch", _SOURCE + ", to the tolerance of the iteration", "exact", 3, 1, True,
         _space),
    Case("patch-crossing", "patch", _SOURCE + ", to the tolerance of the iteration", "exact", 3, 1,
         True, _crossing, quick=False),
)  # fmt: skip


__all__ = ["CASES"]
