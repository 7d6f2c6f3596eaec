"""Resultants of loads and reactions of supports."""

from collections.abc import Sequence

import numpy as np

from xcrack.analysis.plan import Resultant
from xcrack.arrays import Floats
from xcrack.scene.conditions import CrackPressure, Displacement, InitialStress, Load, Support
from xcrack.scene.problem import Problem
from xcrack.xfem.model import Model


def resultants(
    problem: Problem,
    model: Model,
    loads: Sequence[Load],
    vectors: Sequence[Floats],
    residual: Floats,
) -> tuple[Resultant, ...]:
    """Force and moment of each load of a state and of the reaction of each support.

    Parameters
    ----------
    problem : Problem
    model : Model
    loads : sequence of loads
    vectors : sequence of (n_dof,) arrays, force
        Of each load, scaled as in the state.
    residual : (n_dof,) array, force
        Stiffness times displacements less all loads; contact acts on jumps only.
    """
    rows = [
        _resultant(model, _name(load), vector)
        for load, vector in zip(loads, vectors, strict=True)
        # Displacements act through supports, the others are in equilibrium by themselves.
        if not isinstance(load, Displacement | InitialStress | CrackPressure)
    ]
    for number, support in enumerate(problem.supports):
        own = model.known.owner == number
        rows.append(
            _resultant(model, f"reaction of {_name(support)}", np.where(own, residual, 0.0))
        )
    return tuple(rows)


def _resultant(model: Model, name: str, f: Floats) -> Resultant:
    """Sums over the standard functions, which together are one everywhere."""
    x = model.space.node_points
    forces = f.reshape(-1, x.shape[1])[: len(x)]
    force = tuple(np.ascontiguousarray(forces.T).sum(axis=1).tolist())
    product = x.T @ forces
    turning = product - product.T
    if len(force) < 3:
        return Resultant(name, force, float(turning[0, 1]))
    return Resultant(
        name, force, (float(turning[1, 2]), float(turning[2, 0]), float(turning[0, 1]))
    )


def _name(load: Load | Support) -> str:
    kind = type(load).__name__
    words = "".join(f"_{c.lower()}" if c.isupper() else c for c in kind).lstrip("_")
    where = getattr(load, "where", getattr(load, "x", None))
    if where is None:
        return words
    axis = getattr(load, "axis", None)
    place = repr(where) if isinstance(where, str) else str(np.round(where, 6).tolist())
    return f"{words}({place}{'' if axis is None else f', axis={axis}'})"
