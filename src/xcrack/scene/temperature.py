"""Temperature as an initial stress: what the body would bear if it could not expand."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.inputs import number
from xcrack.scene.conditions import InitialStress, evaluate_scalar
from xcrack.scene.material import Isotropic


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
