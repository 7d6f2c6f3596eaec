"""Scenes on meshes of gmsh that all cases share: a plate with a hole, and a notched bar.

The mesh is that of the uncracked body, which growth keeps: it is made once a size and not timed,
for none of the cases. What is derived from it (edges, neighbours) is timed anew in each run.
"""

from functools import cache
from math import pi, sin

import numpy as np

import xcrack as xc
from benchmarks.runs import Outcome
from benchmarks.scenes.exact_fields import kirsch, kirsch_pressure
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings, quiet
from xcrack.base.arrays import Floats

_D, _NOTCH, _OUTER, _INNER = 20.0, 2.0, 120.0, 40.0  # of the bar
_TURN = 6  # faces of 15° by which the bar is turned under its loads
FINEST = 0.3  # cell size that the others are compared with


def fresh(mesh: xc.Mesh) -> xc.Mesh:
    """The same mesh without what earlier runs derived from it."""
    return xc.Mesh(mesh.points, mesh.cells, mesh.facet_sets)


@cache
def plate(parts: int) -> xc.Mesh:
    """[-4, 4]² with a hole of radius 1, cells of 1 / parts at the hole and along the crack."""
    h = 1.0 / parts
    return xc.plate_with_hole(
        width=8.0, height=8.0, radius=1.0, size=3 * h, size_near=h,
        along=[(1.0, 0.0), (3.0, 0.0)], band=0.1, transition=1.25,
    )  # fmt: skip


def hole(s: Settings, seed: int) -> Outcome:
    """A closed crack from r = 1 to 2.6 at a hole in a pressed plate: exact multipliers.

    Parameters
    ----------
    s : Settings
        `n` cells a radius of the hole.
    seed : int
        Turns crack and load by some hundredths: the mesh stays.
    """
    angle = 0.06 + 0.013 * seed
    stress, ahead = kirsch(angle), np.array([np.cos(angle), np.sin(angle)])
    # The rim of the mesh is a polygon, whose sides carry the exact traction too.
    problem = xc.Problem(
        fresh(plate(s.n)), STEEL[2], [xc.line_crack([0.9 * ahead, 2.6 * ahead])],
        loads=[
            xc.traction(side, lambda x, n: np.einsum("qij,qj->qi", stress(x), n))
            for side in ("left", "right", "bottom", "top", "hole")
        ],
        contact=s.contact, order=s.order, numerics=s.numerics,
    )  # fmt: skip
    solution, _ = quiet(problem)
    lips = solution.contact[0]
    errors = {}
    if lips is not None:
        exact = kirsch_pressure(np.hypot(*lips.points.T))
        wrong = lips.pressure - exact
        inner = (lips.s > 0.1 * lips.s.max()) & (lips.s < 0.9 * lips.s.max())
        errors["pressure"] = float(np.sqrt(lips.measure @ wrong**2 / (lips.measure @ exact**2)))
        errors["pressure, inner 80 %"] = float(np.abs(wrong / exact)[inner].max())
    return Outcome(
        errors, solution.n_dof, later=lambda: {"energy": xc.energy_error(solution, stress)}
    )


@cache
def bar(size: float) -> xc.Mesh:
    """The notched bar, cells of that size at the notch and the crack."""
    return xc.notched_cylinder(
        diameter=_D, length=140.0, notch_depth=_NOTCH, notch_angle=pi / 3, outer_span=_OUTER,
        inner_span=_INNER, size=5.0, size_near=size, crack_depth=14.0, transition=10.0,
    )  # fmt: skip


def cylinder(size: float, s: Settings) -> Outcome:
    """A bar with a straight crack through half of it, bent across: half of the front is closed.

    Four-point bending that opens the notch is turned by 90°. Errors against `FINEST`.

    Parameters
    ----------
    size : float
        Of the cells at the notch and the crack.
    s : Settings
        But for `n`.
    """
    solution, sif = _bent(size, s)
    y, K, closed = finest()
    inside = ~sif.at_surface
    wrong = (sif.K_I - np.interp(sif.x[:, 1], y, K))[inside]
    errors = {"K_I": float(np.sqrt(np.mean(wrong**2)) / K.max())}
    if solution.contact[0] is not None:
        errors["closed share"] = abs(_closed_share(solution) / closed - 1)
    return Outcome(errors, solution.n_dof)


@cache
def finest() -> tuple[Floats, Floats, float]:
    """Places along the front, K_I there and the closed share of the crack, on the finest mesh."""
    solution, sif = _bent(FINEST, Settings(0, order=1))
    order = np.argsort(sif.x[:, 1])
    return sif.x[order, 1], sif.K_I[order], _closed_share(solution)


def _bent(size: float, s: Settings) -> tuple[xc.Solution, xc.SIF]:
    phi = np.radians(15.0 * _TURN)
    down = np.array([0.0, np.sin(phi), -np.cos(phi)])
    area = (_D * sin(pi / 24)) ** 2  # of a patch: square faces
    force = pi * _D**3 / 16 / (_OUTER - _INNER)  # a nominal bending stress of 1
    loads = []
    for side in ("left", "right"):
        push, hold = f"inner_{side}_{12 + _TURN:02d}", f"outer_{side}_{_TURN:02d}"
        loads.append(xc.traction(push, tuple(force / area * down)))
        loads.append(xc.traction(hold, tuple(-force / area * down)))
    far, mouth = 1.2 * _D / 2, 1.3 * _NOTCH / 2 - _D / 2
    crack = xc.plane_crack([(0, -far, mouth), (0, far, mouth), (0, far, 0), (0, -far, 0)])
    problem = xc.Problem(
        fresh(bar(size)), STEEL[3], [crack], loads=loads, contact=s.contact, order=s.order,
        numerics=s.numerics,
    )  # fmt: skip
    return quiet(problem)


def _closed_share(solution: xc.Solution) -> float:
    lips = solution.contact[0]
    if lips is None:
        return 0.0
    return float(lips.measure[lips.closed].sum() / lips.measure.sum())
