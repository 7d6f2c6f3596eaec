"""Lines of fronts drawn up to the places where they meet the boundary of the body."""

import numpy as np

from xcrack.base.arrays import Floats


def to_the_surface(x: Floats, places: list[Floats]) -> Floats:
    """Points of an open front with the places at its ends, where some are near.

    Parameters
    ----------
    x : (n, 3) array, length
        Places of K: they end a share of their distance inside the body.
    places : list of (3,) array, length
        Where fronts of the crack meet the boundary.

    Returns
    -------
    (m, 3) array
    """
    reach = 3 * float(np.linalg.norm(np.diff(x, axis=0), axis=1).max())
    first, last = (_nearest_place(places, end, reach) for end in (x[0], x[-1]))
    return np.concatenate([first, x, last])


def _nearest_place(places: list[Floats], x: Floats, reach: float) -> Floats:
    """The nearest place within reach `(1, 3)`, or none `(0, 3)`."""
    near_places = [place for place in places if np.linalg.norm(place - x) < reach]
    near_places.sort(key=lambda place: float(np.linalg.norm(place - x)))
    return np.reshape(near_places[:1], (-1, 3))


__all__ = ["to_the_surface"]
