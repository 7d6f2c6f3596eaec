"""Tractions of loads that are given by their resultant."""

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.mesh.holes import Hole
from xcrack.scene.set_loads import Bearing, Resultant

_AXIAL = 1e-3  # share of a force along the axis that may stem from the fit of the axis
_COVERED = 0.9  # share of the contact of a pin that must lie on the set


def bearing_traction(load: Bearing, hole: Hole, x: Floats, weight: Floats) -> Floats:
    """Tractions of a pin at integration points, whose sum is the force `(q, d)`.

    Parameters
    ----------
    load : Bearing
    hole : Hole
    x : (q, d) array, length
    weight : (q,) array, length or area

    Raises
    ------
    ProblemError
        A force along the axis, or a set that lacks a part of the contact.
    """
    what = f"bearing({load.where!r})"
    force = hole.section @ load.force
    size = float(np.linalg.norm(load.force))
    rest = load.force - force @ hole.section
    along = float(np.linalg.norm(rest))
    if along > _AXIAL * size:
        raise ProblemError(
            f"{what}: {along:.4g} of the force {size:.4g} acts along the axis of the hole, where a "
            "pin does not press: give that part by traction or resultant."
        )
    local = hole.local(x)
    radial = local / np.linalg.norm(local, axis=1)[:, None]
    ahead = force / np.linalg.norm(force)
    across = np.array([-ahead[1], ahead[0]])
    cosine, sine = radial @ ahead, radial @ across
    angle = np.arctan2(sine, cosine)
    half = load.contact_angle / 2
    p = np.where(np.abs(angle) < half, np.cos(np.pi * angle / load.contact_angle), 0.0)
    height = np.ptp(_axial(hole, x)) if len(load.force) > 2 else 1.0
    pressed = float(weight[np.abs(angle) < half].sum())
    # Points of integration do not reach the ends of the hole: its height is a little larger.
    whole = load.contact_angle * hole.radius * height
    if pressed < _COVERED * whole:
        raise ProblemError(
            f"{what}: the set covers {100 * pressed / whole:.3g} % of where the pin presses, "
            f"{np.degrees(load.contact_angle):.4g} degrees around the force: give the whole hole, "
            "or a smaller contact_angle."
        )
    # On a polygon the cosine alone would pull a little to one side.
    shapes = np.stack([p, p * sine])[:, :, None] * radial
    sums = np.einsum("q,kqs->sk", weight, shapes)
    scale = np.linalg.solve(sums, force)
    across_axis = np.einsum("k,kqs->qs", scale, shapes) @ hole.section
    # The rest is that of an axis that points know to a few digits only.
    return np.asarray(across_axis + rest / weight.sum())


def _axial(hole: Hole, x: Floats) -> Floats:
    return np.asarray(x @ np.cross(*hole.section))


def resultant_traction(load: Resultant, x: Floats, weight: Floats) -> Floats:
    """Tractions a + b x (x - centre) with the wanted force and moment `(q, d)`.

    Parameters
    ----------
    load : Resultant
    x : (q, d) array, length
    weight : (q,) array, length or area

    Raises
    ------
    ProblemError
        A set that is too small for a moment.
    """
    d = x.shape[1]
    force, moment, about = np.zeros(3), np.zeros(3), np.zeros(3)
    area = weight.sum()
    centre = weight @ x / area
    r = np.zeros((len(x), 3))
    r[:, :d] = x - centre
    if load.force is not None:
        force[:d] = load.force
    if load.moment is not None:
        moment[3 - len(load.moment) :] = load.moment
    if load.about is not None:
        about[:d] = load.about - centre
    # Moment about the centre of the set: the force acts there otherwise.
    moment = moment + np.cross(about, force) if load.about is not None else moment
    inertia = np.einsum("q,q,ij->ij", weight, (r * r).sum(axis=1), np.eye(3))
    inertia -= np.einsum("q,qi,qj->ij", weight, r, r)
    turn = np.zeros(3)
    axes = slice(0 if d > 2 else 2, 3)  # a 2D body turns about the third axis
    if moment.any():
        values = np.linalg.eigvalsh(inertia[axes, axes])
        if values[0] <= 1e-12 * values[-1] or not values[-1]:
            raise ProblemError(
                f"resultant({load.where!r}): the set is too small or too slender for a moment."
            )
        turn[axes] = np.linalg.solve(inertia[axes, axes], moment[axes])
    return np.asarray((force / area + np.cross(turn, r))[:, :d])
