"""Meshes of a chart: those given, those made by a function, and how fine they are."""

from collections.abc import Callable, Iterable
from math import factorial
from typing import Any

from xcrack.base.checks import call_function
from xcrack.base.errors import ProblemError
from xcrack.mesh.mesh import Mesh
from xcrack.model.problem import Problem


def made(maker: Callable[[float], Mesh], size: float) -> Mesh:
    """A mesh of a size from a user's function."""
    mesh = call_function(maker, "the meshes of chart", size)
    if not isinstance(mesh, Mesh):
        raise ProblemError(
            f"meshes({size:.6g}) returned {type(mesh).__name__}: the function must return a Mesh "
            "whose smallest cells have this size."
        )
    return mesh


def checked_meshes(problem: Problem, given: Any) -> list[Mesh]:
    """The meshes that were given, if they go from coarse to fine."""
    every = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else []
    if len(every) < 2 or not all(isinstance(mesh, Mesh) for mesh in every):
        raise ProblemError(
            "meshes: give two or more meshes from coarse to fine, or a function of the size: the "
            "error of the reference is read from the last two."
        )
    if any(mesh.dim != problem.mesh.dim for mesh in every):
        raise ProblemError(f"meshes: all must have {problem.mesh.dim} dimensions, as the problem.")
    size = [mean_size(mesh) for mesh in every]
    for k, (a, b) in enumerate(zip(size[:-1], size[1:], strict=True)):
        if b > a / 1.05:
            raise ProblemError(
                f"meshes: number {k + 1} has cells of {b:.4g} in the mean, the one before it of "
                f"{a:.4g}; give them from coarse to fine, each at least 5 % finer."
            )
    return every


def smallest(mesh: Mesh) -> float:
    """Edge of the simplex with right angles that is as large as the smallest cell.

    Unlike the longest edge it is halved by a refinement, whatever shapes the parts have.
    """
    return float((factorial(mesh.dim) * mesh.volume.min()) ** (1 / mesh.dim))


def mean_size(mesh: Mesh) -> float:
    """Edge of a cube as large as the mean cell."""
    return float(mesh.volume.mean() ** (1 / mesh.dim))


__all__ = ["checked_meshes", "made", "mean_size", "smallest"]
