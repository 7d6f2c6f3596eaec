"""Level sets of a crack of either dimension."""

from collections.abc import Callable

from xcrack.base.errors import ProblemError
from xcrack.crack.crack import Crack
from xcrack.fem.level_set import LevelSet, line_levels, surface_levels
from xcrack.fem.level_set_nodal import nodal_level_set
from xcrack.mesh.mesh import Mesh


def _in_2d(mesh: Mesh, crack: Crack, reach: float, nodal: bool) -> LevelSet:
    return nodal_level_set(mesh, crack) if nodal else line_levels(mesh, crack)


def _in_3d(mesh: Mesh, crack: Crack, reach: float, nodal: bool) -> LevelSet:
    if nodal:
        raise ProblemError(
            'Comparison(update="nodal") is for 2D only: leave it out for a crack in 3D.'
        )
    return surface_levels(mesh, crack, reach)


_LEVELS: dict[int, Callable[[Mesh, Crack, float, bool], LevelSet]] = {2: _in_2d, 3: _in_3d}


def level_sets(mesh: Mesh, crack: Crack, reach: float, nodal: bool = False) -> LevelSet:
    """Level sets of a placed crack at the points of a mesh.

    Parameters
    ----------
    mesh : Mesh
    crack : Crack
        Placed in the mesh.
    reach : float, length
        In 3D: distance from the fronts up to which phi and psi are needed.
    nodal : bool
        Whether to replay updates at the nodes instead, for comparison (2D only).

    Returns
    -------
    LevelSet

    Raises
    ------
    ProblemError
        Nodal updates in 3D.
    """
    return _LEVELS[mesh.dim](mesh, crack, reach, nodal)


__all__ = ["level_sets"]
