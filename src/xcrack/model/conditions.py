"""Supports and loads as values; they know neither mesh nor crack."""

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats, frozen
from xcrack.base.checks import called, number, numbers, shown, whole
from xcrack.base.errors import ProblemError
from xcrack.model.material import Isotropic

# Loads given by their resultant on a set: a pin in a hole, a force and moment on an end.


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


Value = Any  # vector, f(x) or f(x, normal)
Where = Any  # name of a facet set, or a point


@dataclass(frozen=True, eq=False)
class Fix:
    """Zero displacement of a set or point, in one direction or in all."""

    where: Where
    axis: int | None


@dataclass(frozen=True, eq=False)
class Displacement:
    """Imposed displacement of a set or point."""

    where: Where
    value: Value


@dataclass(frozen=True, eq=False)
class Traction:
    """Force per area on a facet set."""

    where: str
    value: Value


@dataclass(frozen=True, eq=False)
class Pressure:
    """Pressure on a facet set, positive towards the body."""

    where: str
    value: Any


@dataclass(frozen=True, eq=False)
class PointForce:
    """Force at a mesh point."""

    x: Floats
    force: Floats


@dataclass(frozen=True, eq=False)
class BodyForce:
    """Force per volume."""

    value: Value


@dataclass(frozen=True, eq=False)
class CrackPressure:
    """Pressure on the faces of a crack, positive where it opens it."""

    value: Any
    crack: int | None


@dataclass(frozen=True, eq=False)
class InitialStress:
    """Stress of the undeformed body; it is not scaled by a load state."""

    value: Any


SetLoad = Traction | Pressure | Bearing | Resultant
Load = Displacement | SetLoad | PointForce | BodyForce | CrackPressure | InitialStress
Support = Fix | Displacement


def fix(where: Where, axis: int | None = None) -> Fix:
    """Hold a facet set or a point, in one direction or in all.

    Parameters
    ----------
    where : str or (d,) array
        Name of a facet set, or a point (the nearest mesh point is supported).
    axis : int, optional
        Direction 0, 1 (, 2); all where it is left out.

    Returns
    -------
    Fix
    """
    place = _where(where, "fix")
    if axis is None:
        return Fix(place, None)
    return Fix(place, whole(axis, f"fix({shown(where)}): axis", least=0, most=2))


def displacement(where: Where, value: Value) -> Displacement:
    """Impose a displacement on a facet set or a point.

    Parameters
    ----------
    where : str or (d,) array
        Name of a facet set, or a point (the nearest mesh point).
    value : (d,) array or callable, length
        Vector, whose entries may be None where a direction stays free, or f(x) -> (n, d), called
        with arrays (n, d). It is never called on a lip.

    Returns
    -------
    Displacement
    """
    return Displacement(_where(where, "displacement"), _value(value, "displacement", none=True))


def traction(where: str, value: Value) -> Traction:
    """Force per area on a facet set.

    Parameters
    ----------
    where : str
        Name of a facet set.
    value : (d,) array or callable, stress
        Vector, f(x) -> (n, d) or f(x, normal) -> (n, d), called with arrays (n, d).

    Returns
    -------
    Traction
    """
    return Traction(_set_name(where, "traction"), _value(value, "traction"))


def pressure(where: str, p: float | Callable[..., ArrayLike]) -> Pressure:
    """Pressure on a facet set, positive towards the body.

    Parameters
    ----------
    where : str
        Name of a facet set.
    p : float or callable, stress
        Number, or f(x) -> (n,).

    Returns
    -------
    Pressure
    """
    return Pressure(_set_name(where, "pressure"), _scalar(p, "pressure"))


def point_force(x: ArrayLike, f: ArrayLike) -> PointForce:
    """Force at a point (the nearest mesh point takes it).

    Parameters
    ----------
    x : (d,) array, length
    f : (d,) array, force (per thickness in 2D)

    Returns
    -------
    PointForce
    """
    place, force = numbers(x, "point_force: x", (None,)), numbers(f, "point_force: f", (None,))
    if len(place) not in (2, 3) or len(place) != len(force):
        raise ProblemError(
            f"point_force: x {place.tolist()} and f {force.tolist()} must both have 2 or both 3 "
            "numbers."
        )
    return PointForce(frozen(place), frozen(force))


def body_force(b: Value) -> BodyForce:
    """Force per volume on the whole body.

    Parameters
    ----------
    b : (d,) array or callable, stress / length
        Vector or f(x) -> (n, d).

    Returns
    -------
    BodyForce
    """
    return BodyForce(_value(b, "body_force"))


def crack_pressure(p: float | Callable[..., ArrayLike], crack: int | None = None) -> CrackPressure:
    """Pressure on both crack faces, positive where it opens the crack.

    Parameters
    ----------
    p : float or callable, stress
        Number, or f(x) -> (n,).
    crack : int, optional
        One crack; all where it is left out.

    Returns
    -------
    CrackPressure
    """
    if crack is not None:
        crack = whole(crack, "crack_pressure: crack", least=0)
    return CrackPressure(_scalar(p, "crack_pressure"), crack)


def initial_stress(f: Any) -> InitialStress:
    """Stress of the undeformed body; a load state does not scale it.

    Parameters
    ----------
    f : (d, d) array or callable, stress
        Symmetric stress, or f(x) -> (n, d, d).

    Returns
    -------
    InitialStress
    """
    if callable(f):
        return InitialStress(f)
    sigma = numbers(f, "initial_stress", (None, None))
    if sigma.shape not in ((2, 2), (3, 3)):
        raise ProblemError(f"initial_stress has the shape {sigma.shape}: give (2, 2) or (3, 3).")
    if not np.allclose(sigma, sigma.T):
        raise ProblemError(f"initial_stress: {sigma.tolist()} is not symmetric: give a stress.")
    return InitialStress(frozen(sigma))


def evaluate(value: Value, x: Floats, what: str, normal: Floats | None = None) -> Floats:
    """Value of a vector, f(x) or f(x, normal) at points `(n, d)`, checked."""
    n, d = x.shape
    if callable(value):
        two = normal is not None and _n_positional(value) >= 2
        arguments = (x, normal) if two else (x,)
        result = _values(called(value, f"the value of {what}", *arguments), what)
    else:
        result = numbers(value, what)
    if result.shape == (d,):
        result = np.broadcast_to(result, (n, d))
    if result.shape != (n, d):
        raise ProblemError(
            f"{what}: the value has shape {result.shape}, wanted {(n, d)} for {n} points in "
            f"{d} dimensions; give a vector of length {d} or a function that returns (n, {d})."
        )
    _check_finite(result, x, what)
    return result


def evaluate_scalar(value: Any, x: Floats, what: str) -> Floats:
    """Value of a number or f(x) at points `(n, d)`, checked `(n,)`."""
    if callable(value):
        given = _values(called(value, f"the value of {what}", x), what)
    else:
        given = numbers(value, what)
    if given.shape not in ((), (len(x),)):
        raise ProblemError(
            f"{what}: the value has shape {given.shape}, wanted {(len(x),)}; give a number or a "
            "function that returns (n,)."
        )
    result = np.broadcast_to(given, (len(x),))
    _check_finite(result, x, what)
    return result


def evaluate_stress(value: Any, x: Floats) -> Floats:
    """Initial stress at points, checked `(n, d, d)`.

    Raises
    ------
    ProblemError
        Another shape, values that are not finite or not symmetric.
    """
    d, what = x.shape[1], "initial_stress"
    if callable(value):
        result = _values(called(value, f"the value of {what}", x), what)
    else:
        result = numbers(value, what)
    if result.shape not in ((d, d), (len(x), d, d)):
        raise ProblemError(
            f"{what}: the value has shape {result.shape}, wanted {(len(x), d, d)} for {len(x)} "
            f"points in {d} dimensions."
        )
    result = np.broadcast_to(result, (len(x), d, d))
    _check_finite(result, x, what)
    lopsided = np.abs(result - np.swapaxes(result, 1, 2)).max(axis=(1, 2), initial=0)
    if (lopsided > 1e-8 * np.abs(result).max(initial=0.0)).any():
        where = int(np.argmax(lopsided))
        raise ProblemError(
            f"{what}: the value at {np.round(x[where], 9).tolist()} is "
            f"{result[where].tolist()}: a stress must be symmetric."
        )
    return result


def check_vectors(given: Load | Support, dim: int) -> None:
    """Raise where a point, vector or direction of a support or load does not suit the body.

    Parameters
    ----------
    given : Load or Support
    dim : int
        Of the body.
    """
    kind = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(given).__name__).lower()  # as the function
    for name in ("where", "value", "x", "force"):
        value = getattr(given, name, None)
        if isinstance(value, np.ndarray | tuple) and np.shape(value)[-1:] != (dim,):
            raise ProblemError(
                f"{kind}: {name} = {shown(value)} does not suit a body in {dim} dimensions: give "
                f"{dim} numbers a row."
            )
    if isinstance(given, Fix) and given.axis is not None and given.axis >= dim:
        axes = " or ".join(map(str, range(dim)))
        raise ProblemError(
            f"fix: axis = {given.axis}: in {dim} dimensions axis is {axes}: give one of them."
        )


def _values(result: Any, what: str) -> Floats:
    """What a function returned: an array of real numbers; others are looked for later."""
    return numbers(result, f"{what}: the returned value", finite=False)


def _check_finite(result: Floats, x: Floats, what: str) -> None:
    bad = ~np.isfinite(result).reshape(len(x), int(np.prod(result.shape[1:]))).all(axis=1)
    if bad.any():
        where = x[np.argmax(bad)]
        raise ProblemError(
            f"{what}: the value at {np.round(where, 9).tolist()} is "
            f"{result[np.argmax(bad)].tolist()}: every value must be finite."
        )


def _n_positional(function: Callable[..., Any]) -> int:
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return 1
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if any(p.kind == inspect.Parameter.VAR_POSITIONAL for p in parameters):
        return 2
    return sum(p.kind in kinds and p.default is inspect.Parameter.empty for p in parameters)


def _where(where: Where, what: str) -> Where:
    if isinstance(where, str):
        return where
    try:
        return frozen(numbers(where, f"{what}: where", (None,)))
    except ProblemError as error:
        raise ProblemError(f"{error} Or give the name of a facet set.") from None


def _value(value: Value, what: str, none: bool = False) -> Value:
    if callable(value):
        return value
    given = none and isinstance(value, list | tuple) and any(v is None for v in value)
    if given and len(value) in (2, 3):
        return tuple(
            None if v is None else number(v, f"{what}: value[{i}]") for i, v in enumerate(value)
        )
    vector = numbers(value, f"{what}: the value", (None,))
    if len(vector) not in (2, 3):
        raise ProblemError(
            f"{what}: value = {shown(value)}: give a vector of 2 or 3 numbers, or a function."
        )
    return frozen(vector)


def _scalar(value: Any, what: str) -> Any:
    return value if callable(value) else number(value, f"{what}: the value")


# Temperature as an initial stress: what the body would bear if it could not expand.


@dataclass(frozen=True, eq=False)
class Temperature(InitialStress):
    """Change of temperature; its stress is known once the material is."""

    field: Any
    alpha: float


def temperature(field: float | Callable[..., ArrayLike], alpha: float) -> Temperature:
    """Change of temperature from the state without stress.

    It is an initial stress, ``-E / (1 - 2 nu) alpha dT`` in all directions (plane stress: ``-E / (1
    - nu) alpha dT`` in the plane), with its terms in the load vector and in K. As an initial
    stress, it is not scaled by a load state that is a number: give states as lists of loads for a
    temperature that changes in a cycle.

    Parameters
    ----------
    field : float or callable, temperature
        Change dT as a number or f(x) -> (n,), such as `read_field` returns.
    alpha : float, 1 / temperature
        Coefficient of thermal expansion.

    Returns
    -------
    Temperature

    Raises
    ------
    ProblemError
        Numbers that are not finite.

    Examples
    --------
    >>> temperature(lambda x: 10.0 * x[:, 0], alpha=1.2e-5).alpha
    1.2e-05
    """
    if not callable(field):
        field = number(field, "temperature: the value")
    return Temperature(None, field, number(alpha, "temperature: alpha"))


def with_material(load: Any, material: Isotropic) -> Any:
    """The load itself; a temperature with the stress that it means in this material."""
    if not isinstance(load, Temperature) or load.value is not None:
        return load
    stress = (
        -material.E / (1 - material.nu)
        if material.plane == "stress"
        else -material.E / (1 - 2 * material.nu)
    )
    return replace(load, value=partial(thermal_stress, load.field, load.alpha * stress))


def thermal_stress(field: Any, factor: float, x: Floats) -> Floats:
    """Stress `(n, d, d)`: a factor times the temperature, in all directions.

    Parameters
    ----------
    field : float or callable, temperature
    factor : float, stress / temperature
    x : (n, d) array, length

    Raises
    ------
    ProblemError
        Values of another shape than (n,), or not finite.
    """
    if x.ndim != 2:
        raise ProblemError(f"temperature: points must be (n, d), not {x.shape}.")
    value = evaluate_scalar(field, x, "temperature")
    return np.asarray(factor * value[:, None, None] * np.eye(x.shape[1]))


__all__ = []
