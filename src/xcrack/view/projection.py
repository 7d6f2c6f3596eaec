"""Planes onto which fronts and 3D cracks are projected, and sections of a body with them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import interface_simplices
from xcrack.output.curved_sides import CurvedSides

_SHARED = 1e-9  # share of the body within which two ends of lines are one
_AXIS = 0.999  # cosine from which a direction is called an axis


@dataclass(frozen=True, eq=False)
class Projection:
    """A plane to look at.

    Attributes
    ----------
    origin : (3,) array, length
    axes : (2, 3) array
        Unit vectors to the right and up, perpendicular to each other.
    """

    origin: Floats
    axes: Floats

    @property
    def normal(self) -> Floats:
        """Unit vector towards the viewer."""
        return np.asarray(np.cross(self.axes[0], self.axes[1]))

    def label(self, k: int) -> str:
        """Name of an axis of the picture: x, y or z where it is one."""
        axis = int(np.argmax(np.abs(self.axes[k])))
        value = float(self.axes[k, axis])
        if abs(value) < _AXIS or np.any(self.origin[axis] != 0):
            return "along (" + ", ".join(f"{v:.3g}" for v in self.axes[k].round(3) + 0.0) + ")"
        return ("" if value > 0 else "-") + "xyz"[axis]


def given_plane(
    value: Any, label: str = "plane", error: type[XcrackError] = ProblemError
) -> Projection:
    """A plane by a point and two directions, checked.

    The point is drawn at (0, 0); the second direction is made perpendicular to the first.
    """
    try:
        origin, axes = value
        x, directions = numbers(origin, "origin", (3,)), numbers(axes, "directions", (2, 3))
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        right_axis, up_direction = directions / np.where(
            (lengths > 0) & np.isfinite(lengths), lengths, np.inf
        )
        up = up_direction - (up_direction @ right_axis) * right_axis
        length = float(np.linalg.norm(up))
        if length > 1e-6 and right_axis.any():
            return Projection(lock(np.array(x)), lock(np.stack([right_axis, up / length])))
        reason = "the two directions are parallel, or one is zero"
    except (TypeError, ValueError):
        reason = "that is no pair"
    except ProblemError as cause:
        reason = str(cause)[:-1]
    raise error(
        f"{label} = {value_text(value)}: give a point and two directions, ((x, y, z), (right, up))"
        f"; {reason}."
    )


def best_plane(x: Floats, normal: ArrayLike | None = None) -> Projection:
    """Plane that points `(n, 3)` lie nearest to; a main plane keeps its coordinates.

    Parameters
    ----------
    x : (n, 3) array, length
    normal : (3,) array, optional
        Seen from this side; left out: from the side of the larger coordinates.

    Returns
    -------
    Projection
    """
    middle = x.mean(axis=0)
    n = np.linalg.svd(x - middle, full_matrices=False)[2][-1]
    viewer = np.asarray([1.0, -1.1, 1.2] if normal is None else normal)
    n = n if n @ viewer >= 0 else -n
    axis = int(np.argmax(np.abs(n)))
    if abs(n[axis]) > _AXIS:
        # Seen along an axis: x to the right or y, and the usual letters up.
        right_axis, up = np.eye(3)[[(1, 0, 0)[axis], (2, 2, 1)[axis]]]
        right_axis = right_axis if np.cross(right_axis, up) @ n > 0 else -right_axis
        origin = np.where(np.arange(3) == axis, middle, 0.0)
        return Projection(lock(origin), lock(np.stack([right_axis, up])))
    up_axis = np.eye(3)[1 if abs(n[2]) > 0.9 else 2]
    right_axis = np.cross(up_axis, n)
    right_axis /= np.linalg.norm(right_axis)
    plane_axes = np.stack([right_axis, np.cross(n, right_axis)])
    # A direction along an axis shows the coordinate itself.
    is_in_plane = np.abs(plane_axes).max(axis=1) > _AXIS
    return Projection(
        lock(middle - (is_in_plane * (plane_axes @ middle)) @ plane_axes), lock(plane_axes)
    )


def on_plane(x: Floats, plane: Projection) -> Floats:
    """Coordinates `(..., 2)` of points `(..., 3)` in a plane."""
    return np.asarray((x - plane.origin) @ plane.axes.T)


def section_outline(mesh: Mesh, plane: Projection) -> Floats:
    """Segments in which a plane meets the boundary of a body, in the plane `(k, 2, 2)`."""
    facets = mesh.boundary
    level = (mesh.points - plane.origin) @ plane.normal
    level = np.where(np.abs(level) < 1e-9 * np.abs(level).max(), 0.0, level)[facets]
    rows = np.nonzero((level.min(axis=1) < 0) & (level.max(axis=1) >= 0))[0]
    bary, parent = interface_simplices(level[rows])
    rows = rows[parent]
    lines = np.einsum("kwv,kvd->kwd", bary, mesh.points[facets[rows]])
    if (curved_sides := CurvedSides.of(mesh)) is None:
        return on_plane(lines, plane)
    facet = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0][rows]
    on_curve = curved_sides.facet_to_curve[facet] >= 0
    end = lines[on_curve].reshape(-1, 3)
    if len(end):  # plane sides end where the curved ones beside them do
        places = curved_sides.project(end, np.repeat(facet[on_curve], 2))
        distance, row = cKDTree(end).query(lines[~on_curve].reshape(-1, 3))
        is_shared = (distance < _SHARED * mesh.extent).reshape(-1, 2)
        flat_lines = lines[~on_curve]
        flat_lines[is_shared] = places[row.reshape(-1, 2)[is_shared]]
        lines[~on_curve] = flat_lines
    return on_plane(curved_sides.on_curves(lines, facet), plane)


__all__ = ["Projection", "best_plane", "given_plane", "on_plane", "section_outline"]
