"""Closed tips and fronts: where crack faces (lips) press up to there, K_I is exactly zero.

Pressed lips have no opening, and without friction nothing else makes K_I. What the integral gives
there is the error of the last pressures, weighted by 1 / √r, and belongs into `spread`.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from xcrack.analysis.solution import Solution
from xcrack.arrays import Bools, Floats
from xcrack.sif.sif import SIF

_STEEPEST = np.cos(np.pi / 4)  # of a point behind a place on a front: those beside it do not count


def with_closed(sif: SIF, solution: Solution, c: int, size: float) -> SIF:
    """K_I of closed places set to zero, and what the integral gave there put into `spread`.

    A place is closed where the lip point nearest to it, that is the one beside the front at its arc
    position, bears pressure of the multipliers; along a front also between two such places within a
    cell on either side. And it is closed where K_I came out negative, which crack faces that cannot
    overlap do not have: they press over less than the multipliers resolve.

    Parameters
    ----------
    sif : SIF
        As the integrals gave it.
    solution : Solution
    c : int
        Crack; without multipliers nothing is closed.
    size : float, length
        Of the cells at the tip or front.
    """
    if solution.contact[c] is None:
        return sif
    closed = _without_gaps(pressed(sif, solution, c), sif, size) | (sif.K_I < 0)
    K, spread = np.array(sif.K), np.array(sif.spread)
    spread[closed, 0] = np.abs(K[closed, 0])
    K[closed, 0] = 0.0
    return replace(sif, K=K, spread=spread, closed=closed)


def _without_gaps(closed: Bools, sif: SIF, size: float) -> Bools:
    """Closed places, and those of a front that have closed ones within a cell on both sides.

    On coarse meshes the multipliers of a few places fall open beside a front that is closed.
    """
    if len(sif.x) == 1 or not closed.any():
        return closed
    result = np.array(closed)
    places = sif.x[closed]
    tree = cKDTree(places)
    for row in np.nonzero(~closed)[0]:
        near = places[tree.query_ball_point(sif.x[row], size)] - sif.x[row]
        along = near @ sif.frame[row, -1]
        result[row] = bool((along > 0).any() and (along < 0).any())
    return result


def pressure_at(sif: SIF, solution: Solution, c: int) -> Floats:
    """Pressure of the lip point nearest to each place `(f,)`; 0 where it is open."""
    contact = solution.contact[c]
    if contact is None or not len(contact.points):
        return np.zeros(len(sif.x))
    if len(sif.x) == 1:  # of a 2D crack; a tree takes longer to build than to look at all
        nearest = ((contact.points - sif.x) ** 2).sum(axis=1).argmin(keepdims=True)
    else:
        nearest = cKDTree(contact.points).query(sif.x)[1]
    return np.where(contact.closed[nearest], np.maximum(contact.pressure[nearest], 0.0), 0.0)


def pressed(sif: SIF, solution: Solution, c: int) -> Bools:
    """Whether the lip point nearest to each place bears pressure `(f,)`."""
    return np.asarray(pressure_at(sif, solution, c) > 0)


def shallow(sif: SIF, solution: Solution, c: int, depth: float) -> Bools:
    """Pressed places behind which crack faces are open within a depth `(f,)`.

    Parameters
    ----------
    sif : SIF
    solution : Solution
    c : int
        Crack.
    depth : float, length
    """
    result = pressed(sif, solution, c)
    contact = solution.contact[c]
    if contact is None or not result.any():
        return result
    is_open = contact.points[~contact.closed]
    if not len(is_open):
        return np.zeros_like(result)
    tree = cKDTree(is_open)
    for row in np.nonzero(result)[0]:
        back = sif.x[row] - is_open[tree.query_ball_point(sif.x[row], depth)]
        behind = back @ sif.frame[row, 0] > _STEEPEST * np.linalg.norm(back, axis=1)
        result[row] = behind.any()
    return result
