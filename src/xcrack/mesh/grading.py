"""Cell sizes that follow holes and the paths of cracks."""

from collections.abc import Callable, Sequence
from math import hypot
from typing import Any

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import GeometryError
from xcrack.inputs import number, shown
from xcrack.mesh.checks import LARGEST, coordinates

FINEST = 1e-6  # share of a body's length below which no cell size is taken


def graded_size(
    holes: Sequence[tuple[float, float, float]],
    paths: Sequence[Floats],
    far: float,
    near: float,
    band: float,
    transition: float,
) -> Callable[[float, float], float]:
    """Cell size as a function of the place: `near` up to `band`, `far` from a transition on.

    Parameters
    ----------
    holes : sequence of (x, y, radius), length
        Round holes.
    paths : sequence of (k, 2) arrays, length
        Polylines.
    far, near : float, length
        Sizes far from all holes and paths, and near them.
    band, transition : float, length
        Where `near` holds, and over what distance the size then grows to `far`.

    Returns
    -------
    callable
        Maps x, y to a size; plain floats, since gmsh asks point by point.
    """
    segments = []
    for path in paths:
        if len(path) == 1:
            path = np.repeat(path, 2, axis=0)
        for (ax, ay), (bx, by) in zip(path[:-1].tolist(), path[1:].tolist(), strict=True):
            square = (bx - ax) ** 2 + (by - ay) ** 2
            segments.append((ax, ay, bx - ax, by - ay, square or 1.0))
    if not holes and not segments:
        return lambda x, y: far
    ramp = max(transition, 1e-9 * far)

    def length(x: float, y: float) -> float:
        distance = min((hypot(x - cx, y - cy) - r for cx, cy, r in holes), default=1e300)
        for ax, ay, tx, ty, square in segments:
            s = min(1.0, max(0.0, ((x - ax) * tx + (y - ay) * ty) / square))
            distance = min(distance, hypot(x - ax - s * tx, y - ay - s * ty))
        return near + (far - near) * min(1.0, max(0.0, (distance - band) / ramp))

    return length


def polylines(along: Any) -> list[Floats]:
    """Bring one polyline, several or none into one form.

    Parameters
    ----------
    along : (k, 2) points, a sequence of such, or None, length
        What the user gave.

    Returns
    -------
    list of (k, 2) array, length
        The polylines.

    Raises
    ------
    GeometryError
        Anything else, or coordinates that are not finite.

    Examples
    --------
    >>> [path.tolist() for path in polylines([(0, 0), (1, 0)])]
    [[[0.0, 0.0], [1.0, 0.0]]]
    """
    if along is None:
        return []
    try:
        many = bool(np.ndim(along[0][0]))
        return [
            coordinates(path, "along", (None, 2), error=GeometryError)
            for path in (along if many else [along])
        ]
    except Exception as error:  # whatever an object's own methods raise
        raise GeometryError(
            f"along = {shown(along)} must be points of a polyline, [(x0, y0), (x1, y1), ...], or "
            "a list of such polylines, with finite coordinates."
        ) from error


def length_of(value: Any, what: str) -> float:
    """Check that a value is a positive length that gmsh can compute with, and return it."""
    return number(value, what, above=0, most=LARGEST, error=GeometryError)
