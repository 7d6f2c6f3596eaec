"""Cracks put into a mesh: what of them is tip or front, what is mouth, and whether they meet."""

from collections.abc import Callable, Sequence

from xcrack.base.errors import GeometryError
from xcrack.crack import junctions as junctions_2d
from xcrack.crack.crack import Crack
from xcrack.crack.junctions import Junction
from xcrack.crack.placing_2d import check_lines, place_line, tips_on_mesh
from xcrack.crack.placing_3d import ShortFront, check_surfaces, place_surface
from xcrack.crack.placing_3d import short_fronts as surface_short_fronts
from xcrack.mesh.mesh import Mesh

_PLACE: dict[int, Callable[[Crack, Mesh], Crack]] = {2: place_line, 3: place_surface}
_CHECK: dict[int, Callable[[tuple[Crack, ...], Mesh], None]] = {2: check_lines, 3: check_surfaces}

_ON_OTHERS: dict[int, Callable[..., tuple[Crack, ...]]] = {
    2: junctions_2d.on_others,
    3: lambda given, cracks, mesh: cracks,
}
_JUNCTIONS: dict[int, Callable[..., tuple[Junction, ...]]] = {
    2: junctions_2d.junctions,
    3: lambda cracks, mesh: (),
}
_ON_MESH: dict[int, Callable[[Crack, Mesh], Crack]] = {
    2: tips_on_mesh,
    3: lambda crack, mesh: crack,
}
_SHORT: dict[int, Callable[[Crack, Mesh], list[ShortFront]]] = {
    2: lambda crack, mesh: [],
    3: surface_short_fronts,
}


def place_crack(crack: Crack, mesh: Mesh) -> Crack:
    """Decide what of a crack is tip or front in this mesh, and lead its mouths out of the body.

    Parameters
    ----------
    crack : Crack
        If its tips or fronts are known already, only these are looked at again.
    mesh : Mesh

    Returns
    -------
    Crack
        With `tips` or `fronts`; see `place_line` and `place_surface`.

    Raises
    ------
    GeometryError
        A crack of another dimension, outside the body, or too small for the mesh.
    """
    if crack.dim != mesh.dim:
        raise GeometryError(f"a {crack.dim}D crack cannot be put into a {mesh.dim}D mesh.")
    return _PLACE[mesh.dim](crack, mesh)


def short_fronts(crack: Crack, mesh: Mesh) -> list[ShortFront]:
    """Fronts of a crack, not placed yet, that this mesh is too coarse for; none in 2D.

    Parameters
    ----------
    crack : Crack
    mesh : Mesh

    Returns
    -------
    list of ShortFront
    """
    return _SHORT[mesh.dim](crack, mesh)


def check_cracks(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise where placed cracks cross or touch, or their ends are closer than a cell.

    Parameters
    ----------
    cracks : tuple of Crack
        Placed in the mesh.
    mesh : Mesh

    Raises
    ------
    GeometryError
        The message names the cracks and the place.
    """
    _CHECK[mesh.dim](cracks, mesh)


def on_others(given: Sequence[Crack], cracks: tuple[Crack, ...], mesh: Mesh) -> tuple[Crack, ...]:
    """Placed cracks whose ends on other cracks are no tips; see `junctions_2d.on_others`."""
    return _ON_OTHERS[mesh.dim](given, cracks, mesh)


def on_mesh(crack: Crack, mesh: Mesh) -> Crack:
    """A placed crack as the mesh is cut by it; see `placing_2d.tips_on_mesh`."""
    return _ON_MESH[mesh.dim](crack, mesh)


def junctions(cracks: tuple[Crack, ...], mesh: Mesh) -> tuple[Junction, ...]:
    """Where placed cracks end on others; see `junctions_2d.junctions`."""
    return _JUNCTIONS[mesh.dim](cracks, mesh)


__all__ = ["check_cracks", "junctions", "on_mesh", "on_others", "place_crack", "short_fronts"]
