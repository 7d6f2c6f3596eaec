"""Round holes among the facet sets of a mesh: axis, centre and radius."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import outward_areas

_ROUND = 0.02  # of the radius: points of a hole are no farther from its circle
_STEPS = 8
_ALONG = 0.01  # share of the squared normals along the axis of a cylinder


@dataclass(frozen=True, eq=False)
class RoundHole:
    """A round hole.

    Attributes
    ----------
    centre : (2,) array, length
        In the section across the axis.
    section : (2, d) array
        Two directions across the axis; the unit directions in 2D.
    radius : float, length
    """

    centre: Floats
    section: Floats
    radius: float

    def section_places(self, x: Floats) -> Floats:
        """Places from the axis in the section `(n, 2)`."""
        return np.asarray(x @ self.section.T - self.centre)


def round_hole(mesh: Mesh, facets: Ints, label: str) -> RoundHole:
    """Fit a circle (2D) or a cylinder (3D) to facets of the boundary.

    Parameters
    ----------
    mesh : Mesh
    facets : (k, d) array of int
        On the boundary.
    label : str
        The load, for messages.

    Raises
    ------
    ProblemError
        The facets are not the wall of a round hole, or lie inside the body.
    """
    if not len(facets):
        raise ProblemError(f"{label}: the set has no facets.")
    area = outward_areas(mesh, facets, label)
    section = _straightened_axes(mesh.points[np.unique(facets)], _section(area, label))
    x = mesh.points[np.unique(facets)] @ section.T
    A = np.column_stack([2 * x, np.ones(len(x))])
    solution, _, rank, _ = np.linalg.lstsq(A, (x**2).sum(axis=1), rcond=1e-10)
    if rank < 3:
        raise ProblemError(f"{label}: the set is straight, not the wall of a round hole.")
    centre = solution[:2]
    distance = np.linalg.norm(x - centre, axis=1)
    radius = float(distance.mean())
    deviation = np.abs(distance - radius).max() / radius
    hole = RoundHole(centre, section, radius)
    if deviation > _ROUND:
        raise ProblemError(
            f"{label}: the set is not a round hole: its points lie up to {100 * deviation:.3g} % "
            f"of the radius {radius:.4g} off the best circle. Give the facets of one hole."
        )
    middle = hole.section_places(mesh.points[facets].mean(axis=1))
    if (np.einsum("ks,ks->k", middle, area @ section.T) > 0).any():
        raise ProblemError(
            f"{label}: the set is round, but no hole: the body lies inside of it, at least in "
            "places. A pin presses on the wall of a hole."
        )
    return hole


def _straightened_axes(x: Floats, section: Floats) -> Floats:
    """Directions across the axis of the cylinder that fits points best (Gauss and Newton)."""
    if x.shape[1] < 3:
        return section
    for _ in range(_STEPS):
        axis = np.cross(*section)
        u = (x - x.mean(axis=0)) @ section.T
        w = (x - x.mean(axis=0)) @ axis
        centre = np.linalg.lstsq(
            np.column_stack([2 * u, np.ones(len(u))]), (u**2).sum(axis=1), rcond=None
        )[0][:2]
        direction = u - centre
        distance = np.maximum(np.linalg.norm(direction, axis=1), 1e-300)
        direction = direction / distance[:, None]
        # Unknowns: shift of the centre, tilt of the axis, radius.
        slope = np.column_stack([direction, w[:, None] * direction, np.ones(len(u))])
        tilt = np.linalg.lstsq(slope, distance, rcond=1e-10)[0][2:4]
        axis = axis + tilt @ section
        axis = axis / np.linalg.norm(axis)
        first = section[0] - (section[0] @ axis) * axis
        first = first / np.linalg.norm(first)
        section = np.stack([first, np.cross(axis, first)])
    return section


def _section(area: Floats, label: str) -> Floats:
    """Directions across the axis: in 2D all, in 3D those in which the normals of the wall lie."""
    if area.shape[1] < 3:
        return np.eye(2)
    size = np.linalg.norm(area, axis=1)
    spread = (area / size[:, None]).T @ area / size.sum()
    share, direction = np.linalg.eigh(spread)
    if share[0] > _ALONG or share[1] < _ALONG:
        kind = "plane" if share[1] < _ALONG else "not a cylinder"
        raise ProblemError(
            f"{label}: the set is {kind}: give the facets of the wall of one round hole only."
        )
    return np.asarray(direction[:, 1:].T)
