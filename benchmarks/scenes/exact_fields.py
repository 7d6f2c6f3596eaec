"""Exact fields of `xcrack.verification.exact` as functions of points, for the charts."""

from collections.abc import Callable

import numpy as np

from benchmarks.scenes.material import NU, E
from xcrack.base.arrays import Floats
from xcrack.verification.exact import closed, fields_2d, fields_3d, plates
from xcrack.verification.exact.potentials_2d import uniform_stress

Field = Callable[[Floats], Floats]


def edge_fields(K: tuple[float, float], pressure: float = 0.0) -> tuple[Field, Field]:
    """Displacement and stress of Williams (1957) at a tip at 0, crack on x < 0, y = 0.

    Parameters
    ----------
    K : (float, float)
        K_I and K_II.
    pressure : float
        Uniform compression that is added; it closes the crack faces where K_I = 0.

    Returns
    -------
    displacement : callable (n, 2) -> (n, 2)
    stress : callable (n, 2) -> (n, 2, 2)
    """

    def both(x: Floats) -> tuple[Floats, Floats]:
        u, s = fields_2d.williams(x[:, 0], x[:, 1], E, NU, *K)
        v, t = uniform_stress(x[:, 0], x[:, 1], -pressure, -pressure, 0.0, E, NU)
        return u + v, s + t

    return (lambda x: both(x)[0]), (lambda x: _tensor(both(x)[1]))


def sliding(
    effective: float, tau: float, p: float, middle: tuple[float, float], angle: float
) -> Field:
    """Displacement around a crack of half length 1 that has slipped with friction.

    The slip is Griffith's under the effective shear; the rest of the shear is locked.

    Parameters
    ----------
    effective, tau, p : float
        Shear that moves the faces, remote shear and pressure, in the frame of the crack.
    middle : (float, float)
        Of the crack.
    angle : float, radians
        Of the crack.

    Returns
    -------
    callable (n, 2) -> (n, 2)
    """
    cos, sin = np.cos(angle), np.sin(angle)
    rows = np.array([[cos, sin], [-sin, cos]])

    def displacement(x: Floats) -> Floats:
        local = (x - middle) @ rows.T
        u = fields_2d.griffith(local[:, 0], local[:, 1], 1.0, E, NU, 0.0, 0.0, effective)[0]
        v = uniform_stress(local[:, 0], local[:, 1], 0.0, -p, tau - effective, E, NU)[0]
        return np.asarray((u + v) @ rows)

    return displacement


def partial_closure(s_m: float, s_b: float = 1.0) -> tuple[Field, float, float]:
    """Displacement, K_I at the right tip and end of contact of a crack [-1, 1] partly closed.

    Parameters
    ----------
    s_m, s_b : float
        The remote stress across the crack is s_m + s_b x; -s_b < s_m <= s_b / 2.

    Returns
    -------
    displacement : callable (n, 2) -> (n, 2)
    K_I : float
    end : float
    """
    middle, c, K_I = closed.partial_closure_params(1.0, s_m, s_b)
    along = s_m + s_b * middle  # no uniform stress beside Westergaard's function

    def displacement(x: Floats) -> Floats:
        return closed.partial_closure(x[:, 0], x[:, 1], 1.0, E, NU, s_m, s_b, along)[0]

    return displacement, K_I, middle - c


def closure_pressure(x: Floats, s_m: float, s_b: float = 1.0) -> Floats:
    """Pressure on the faces of that crack.

    Parameters
    ----------
    x : (n,)
    s_m, s_b : float

    Returns
    -------
    (n,)
    """
    return closed.partial_closure_pressure(x, 1.0, s_m, s_b)


def kirsch(angle: float) -> Field:
    """Stress around a hole of radius 1 in a plate pressed by 1 across a direction (Kirsch, 1898).

    The line that leaves the hole in that direction is under `kirsch_pressure` and free of shear.

    Parameters
    ----------
    angle : float, radians

    Returns
    -------
    callable (n, 2) -> (n, 2, 2)
    """

    def stress(x: Floats) -> Floats:
        across = angle + np.pi / 2
        return _tensor(plates.kirsch(x[:, 0], x[:, 1], 1.0, E, NU, s=-1.0, alpha=across)[1])

    return stress


def kirsch_pressure(r: Floats) -> Floats:
    """Pressure on that line.

    Parameters
    ----------
    r : (n,)
        From the middle of the hole.

    Returns
    -------
    (n,)
    """
    return -plates.kirsch_hoop(r, 1.0, -1.0, np.pi / 2)


def penny(radius: float, tension: float, shear: float = 0.0) -> Field:
    """Displacement around a penny in z = 0 under remote stresses zz and xz.

    Parameters
    ----------
    radius : float
    tension : float
        Where it is negative, the faces are closed and slide.
    shear : float

    Returns
    -------
    callable (n, 3) -> (n, 3)
    """
    S = np.array([[0, 0, shear], [0, 0, 0], [shear, 0, tension]])
    return lambda x: fields_3d.penny(x, radius, E, NU, S)


def penny_K_I(radius: float, tension: float) -> float:
    """K_I around that penny in tension.

    Parameters
    ----------
    radius, tension : float

    Returns
    -------
    float
    """
    return float(fields_3d.penny_K(0.0, radius, NU, tension)[0])


def penny_shear_K(radius: float, shear: float, frame: Floats) -> Floats:
    """K_II and K_III around that penny, in frames of its front.

    Parameters
    ----------
    radius, shear : float
    frame : (n, 3, 3)
        Rows ahead, normal (along z) and along the front.

    Returns
    -------
    (n, 2)
    """
    c, s = frame[:, 0, 0], frame[:, 0, 1]
    _, K_II, K_III = fields_3d.penny_K(np.arctan2(s, c), radius, NU, 0.0, shear)
    turn = frame[:, 2, 1] * c - frame[:, 2, 0] * s  # K_III there is along (-s, c)
    return np.stack([K_II, np.sign(turn) * K_III], axis=1)


def penny_largest_K_II(radius: float, shear: float) -> float:
    """K_II of that penny where its front runs across the shear.

    Parameters
    ----------
    radius, shear : float

    Returns
    -------
    float
    """
    return float(fields_3d.penny_K(0.0, radius, NU, 0.0, shear)[1])


def _tensor(stress: Floats) -> Floats:
    """Tensors `(n, 2, 2)` of components xx, yy, xy `(n, 3)`."""
    return stress[:, [[0, 2], [2, 1]]]
