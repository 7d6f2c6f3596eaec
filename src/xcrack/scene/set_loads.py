"""Loads given by their resultant on a set: a pin in a hole, a force and moment on an end."""

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import Floats, frozen
from xcrack.errors import ProblemError
from xcrack.inputs import number, numbers, shown


@dataclass(frozen=True, eq=False)
class Bearing:
    """Pressure of a pin on a round hole, by its resultant; a factor multiplies the tractions."""

    where: str
    force: Floats
    contact_angle: float
    factor: float = 1.0


@dataclass(frozen=True, eq=False)
class Resultant:
    """Tractions on a set with a given force and moment; a factor multiplies the tractions."""

    where: str
    force: Floats | None
    moment: Floats | None
    about: Floats | None
    factor: float = 1.0


def bearing(where: str, force: ArrayLike, *, contact_angle: float = pi) -> Bearing:
    """Force of a pin on a round hole: a pressure that follows a cosine over the contact angle.

    The traction acts along the radius, away from the axis; it is largest where the force points
    to and zero at the ends of the contact. Its resultant is the force to round-off, on whatever
    polygon the mesh makes of the hole. It does not follow the deformation of pin or hole.

    Parameters
    ----------
    where : str
        Facet set of the hole: a circle in 2D, a cylinder in 3D.
    force : (d,) array, force (per thickness in 2D)
        On the body; in 3D perpendicular to the axis of the hole.
    contact_angle : float, rad
        Angle over which the pin touches, up to pi (a pin without clearance).

    Returns
    -------
    Bearing

    Raises
    ------
    ProblemError
        A force of zero or with other than 2 or 3 numbers, an angle outside (0, pi]. `Problem`
        raises one for a set that is no round hole, and for a force along its axis.

    Examples
    --------
    >>> bearing("hole", (0.0, 1200.0)).force
    array([   0., 1200.])
    """
    name = _set_name(where, "bearing")
    vector = _vector(force, f"bearing({shown(name)}): force")
    if not vector.any():
        raise ProblemError(f"bearing({shown(name)}): the force is zero: leave the load out.")
    angle = number(contact_angle, f"bearing({shown(name)}): contact_angle", above=0, most=pi)
    return Bearing(name, vector, angle)


def resultant(
    where: str,
    force: ArrayLike | None = None,
    moment: ArrayLike | float | None = None,
    *,
    about: ArrayLike | None = None,
) -> Resultant:
    """Tractions on a set with a given force and moment: a + b x (x - centre), linear in x.

    On a plane section that is the stress of a bar: constant for a force, linear for a bending
    moment, turning for a torque.

    Parameters
    ----------
    where : str
        Name of a facet set on the boundary.
    force : (d,) array, optional, force (per thickness in 2D)
    moment : float in 2D, (3,) array in 3D, optional, force times length (per thickness in 2D)
        Positive counter-clockwise in 2D.
    about : (d,) array, optional, length
        Point to which the moment refers; the centre of the set if omitted.

    Returns
    -------
    Resultant

    Raises
    ------
    ProblemError
        Neither force nor moment, or numbers of another dimension.

    Examples
    --------
    >>> resultant("end", moment=3.0).moment
    array([3.])
    """
    name = _set_name(where, "resultant")
    what = f"resultant({shown(name)})"
    if force is None and moment is None:
        raise ProblemError(f"{what}: give a force, a moment or both.")
    f = None if force is None else _vector(force, f"{what}: force")
    m = None
    if moment is not None:
        m = frozen(np.atleast_1d(numbers(moment, f"{what}: moment")))
        if m.shape not in ((1,), (3,)):
            raise ProblemError(f"{what}: moment must be a number in 2D, three numbers in 3D.")
    point = None if about is None else _vector(about, f"{what}: about")
    dims = {len(v) for v in (f, point) if v is not None}
    dims |= set() if m is None else {2 if len(m) == 1 else 3}
    if len(dims) > 1:
        raise ProblemError(f"{what}: force, moment and about must all be of 2D or all of 3D.")
    return Resultant(name, f, m, point)


def check_dimension(load: Bearing | Resultant, dim: int) -> None:
    """Raise where a load has numbers of another dimension than the body."""
    for name in ("force", "about", "moment"):
        value = getattr(load, name, None)
        wanted = dim if name != "moment" else (1, 3)[dim - 2]
        if value is not None and len(value) != wanted:
            raise ProblemError(
                f"{type(load).__name__.lower()}({shown(load.where)}): {name} has {len(value)} "
                f"number(s); this body of {dim} dimensions needs {wanted}."
            )


def _vector(value: ArrayLike, what: str) -> Floats:
    vector = numbers(value, what, (None,))
    if len(vector) not in (2, 3):
        raise ProblemError(f"{what} {vector.tolist()} must have 2 or 3 numbers.")
    return frozen(vector)


def _set_name(where: Any, what: str) -> str:
    if not isinstance(where, str):
        raise ProblemError(f"{what}: where = {shown(where)}: give the name of a facet set.")
    return where
