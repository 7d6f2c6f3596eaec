"""Pressure on curved closed faces against the exact one, and where straight faces stay dense."""

import numpy as np
import pytest
from scipy.optimize import nnls

from support import exact
from support import scenes_2d as scenes
from xcrack import (
    Isotropic,
    Numerics,
    Problem,
    box,
    displacement,
    line_crack,
    plate,
    solve,
    traction,
)
from xcrack.verification.exact.closed import partial_closure_pressure

SXX, SYY, TXY = -100.0, -60.0, 10.0
SIDES = [
    traction("right", (SXX, TXY)),
    traction("left", (-SXX, -TXY)),
    traction("top", (TXY, SYY)),
    traction("bottom", (-TXY, -SYY)),
]


def error_on_an_arc(half, cells):
    """L2 and largest error of the pressure on a closed arc of radius 1, over its mean square.

    Exact in an infinite plate without friction (Muskhelishvili's arc crack, closed); the plate of
    40 leaves 1e-3.
    """
    half = np.radians(half)
    angle = np.linspace(-half, half, 641)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    mesh = plate(
        40, 40, lower=(-20, -20), size=4.0, size_near=1 / cells,
        along=[tuple(x) for x in arc[::16]], band=0.3,
    )  # fmt: skip
    material = Isotropic(1e5, 0.3, plane="strain")
    contact = solve(Problem(mesh, material, [line_crack(arc)], loads=SIDES)).contact[0]
    t = np.arctan2(contact.points[:, 1], contact.points[:, 0])
    s = np.sin(half / 2) ** 2
    deviator = (SXX - SYY) / 2 * np.cos(2 * t) + TXY * np.sin(2 * t)
    p = -(SXX + SYY) / 2 - 1.5 * deviator + (SXX - SYY) / 4 * (1 - s) * (1 - 3 * s)
    off, w = contact.pressure - p, contact.measure
    size = np.sqrt(w @ p**2 / w.sum())
    return np.sqrt(w @ off**2 / w.sum()) / size, np.abs(off).max() / size


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("half", [45, 100])
def test_pressure_of_an_arc(half):
    """Discretisation: .004 and .02; with the dense knots of straight faces it was .06 and .2."""
    mean, largest = error_on_an_arc(half, 24)
    assert mean < 0.008
    assert largest < 0.035


@pytest.mark.slow
def test_pressure_of_an_arc_on_a_finer_mesh():
    mean, largest = error_on_an_arc(100, 48)
    assert mean < 0.004
    assert largest < 0.03


def test_pressure_at_the_end_of_contact():
    """A root ends there: the pressure is as near as any of the functions of the mesh can be.

    Discretisation: .10 of the largest pressure, of which the best function leaves .08; .03 from a
    cell away from the end on.
    """
    a, mean = 0.5, 0.2
    values = scenes.turned(
        lambda x, y: exact.partial_closure(x, y, a, 1.0, 0.3, mean, 1.0), np.zeros(2), 0.0
    )
    problem = Problem(
        scenes.perturbed(20, 641, 0.1), Isotropic(1.0, 0.3, "strain"),
        [line_crack([(-a, 0.0), (a, 0.0)])],
        [displacement("boundary", lambda x: values(x)[0])], order=2,
    )  # fmt: skip
    solution = solve(problem, error=True)
    contact, shapes = solution.contact[0], solution.factored.contact.spaces[0].values.toarray()
    x, weight = contact.points[:, 0], np.sqrt(contact.measure)
    wanted = partial_closure_pressure(x, a, mean, 1.0)
    fit = shapes @ nnls(shapes * weight[:, None], wanted * weight)[0]
    off, of_fit = (np.abs(p - wanted) / wanted.max() for p in (contact.pressure, fit))
    assert off.max() < 1.1 * of_fit.max()
    assert off.max() < 0.12
    assert off[np.abs(x - x[wanted > 0].max()) > 0.1].max() < 0.04


def count(points, kind):
    body = box((-1, -1), (1, 1), (24, 24))
    material = Isotropic(1.0, 0.3, "strain")
    pressed = [traction("top", (0, -1.0)), traction("bottom", (0, 1.0))]
    problem = Problem(
        body, material, [line_crack(points)], loads=pressed, numerics=Numerics(multipliers=kind)
    )
    return solve(problem, error=True).factored.contact.spaces[0].values.shape[1]


def test_knots_are_dense_where_faces_are_straight():
    """Half of the crack is straight, half an arc: the straight half has its 1.6 a group."""
    angle = np.linspace(-np.pi / 2, 0, 65)
    line = np.linspace((-0.72, -0.17), (-0.1, -0.17), 9)
    arc = np.stack([-0.1 + 0.6 * np.cos(angle), 0.43 + 0.6 * np.sin(angle)], axis=1)
    dense, sparse = (count(np.vstack([line, arc[1:]]), kind) for kind in ("reduced", "sparse"))
    assert 1.15 * sparse < dense < 1.45 * sparse
    straight = [count(line * (1.7, 1.0), kind) for kind in ("reduced", "sparse")]
    assert straight[0] >= 1.5 * straight[1]
    curved = [count(arc, kind) for kind in ("reduced", "sparse")]
    assert abs(curved[0] - curved[1]) <= 1
