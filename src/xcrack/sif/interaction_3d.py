"""K along a front in 3D by interaction integrals with hats along the front.

I_j = int P_kj V_k,j + [sigma_ij (u^a_i,jk - eps^a_ij,k) + sigma^a_ij,j u_i,k] V_k dV
- int_lips P_kj m_j V_k dA, V = hat_j(s) q(r) t(s). The auxiliary fields are those of Williams of
plane strain and antiplane shear in the planes normal to the front, u^a = U1 t + U2 n + U3 b. With
t' = -kt b + w n, n' = -kn b - w t, b' = kt t + kn n and hs = 1 - kt x1 - kn x2 the derivative
along b of what is given in (s, x1, x2) is (d/ds - w (x1 d/dx2 - x2 d/dx1)) / hs: all terms of
curvature (kt, kn) and of twist w of the frame are counted, none is left out. eps^a and sigma^a
are made of the derivatives along t and n alone, hence the second and the third term.
K_I, K_II = E' / 2 I and K_III = mu I, each divided by the integral of the hat.
"""

from collections.abc import Callable

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.front_curve import Feet, FrontCurve
from xcrack.fem.williams import continued_polar
from xcrack.model.material import Isotropic
from xcrack.sif.common import weight_integral

RING = 0.4  # share of a radius at which the weight starts to fall; 1 inside
_FEWEST = 6  # hats a front
_INSIDE = 0.98  # share of the domain of a hat that has to lie in the body
_GAUSS = np.polynomial.legendre.leggauss(6)
_FLAT = 1e-9  # height of a lip point, as a share of the radius, that is round-off


def front_nodes(
    curve: FrontCurve, spacing: float, ends: tuple[float, float] | None = None
) -> Floats:
    """Parameters s_j of the tops of the hats, evenly spaced.

    Parameters
    ----------
    curve : FrontCurve
    spacing : float, length
        About how far apart; at least six on a front (seven on an open one).
    ends : tuple of float, length, optional
        Of an open front: where it enters and where it leaves the body; None: its ends.

    Returns
    -------
    (p,) array, length
        On a closed front the last hat falls to zero at the first.
    """
    if curve.closed:
        count = max(_FEWEST, round(curve.length / spacing))
        return np.asarray(np.arange(count) * (curve.length / count), dtype=float)
    first, last = ends or (0.0, curve.length)
    return np.linspace(first, last, max(_FEWEST, round((last - first) / spacing)) + 1)


def hats(curve: FrontCurve, knots: Floats, s: Floats) -> tuple[Ints, Floats, Floats]:
    """The two hats that overlap at parameters s.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    s : (q,) array, length

    Returns
    -------
    hat : (q, 2) array of int
        -1 where there is none.
    share : (q,) array
        Value of the second; the first has the rest.
    step : (q,) array, 1/length
        Derivative of the second by the parameter.
    """
    count = len(knots)
    left = np.searchsorted(knots, s, side="right") - 1
    if curve.closed:
        width = np.diff(np.append(knots, knots[0] + curve.length))
        away = np.mod(s - knots[left], curve.length)
        hat = np.stack([np.mod(left, count), np.mod(left + 1, count)], axis=1)
        left = hat[:, 0]
    else:
        left = np.clip(left, 0, count - 2)
        width, away = np.diff(knots), s - knots[left]
        hat = np.stack([left, left + 1], axis=1)
        hat[(s < knots[0]) | (s > knots[-1])] = -1
    return np.ascontiguousarray(hat), away / width[left], 1 / width[left]


def integrals(
    curve: FrontCurve,
    knots: Floats,
    feet: Feet,
    weight: Floats,
    gradient: Floats,
    side: Ints,
    behind: Bools,
    material: Isotropic,
    radii: Floats,
    *,
    force: Floats | None = None,
    initial: Callable[[Floats], Floats] | None = None,
    curved: bool = True,
) -> tuple[Floats, Floats]:
    """Domain integrals over points of the body; those of all chunks add up.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    feet : Feet
        `curve.feet(x)` of the points.
    weight : (q,) array, length³
    gradient : (q, 3, 3, n) array
        Displacement gradients of n states; rows are components, columns directions.
    side : (q,) array of int
        Side of the crack; 0 where that means nothing.
    behind : (q,) array of bool
        Behind the front, where the angle of a point follows the crack face of its side.
    material : Isotropic
    radii : (k,) array, length
    force : (q, 3, n) array, stress/length, optional
        Body forces.
    initial : callable, optional
        f(x) -> (q, 3, 3, n), initial stress at points: its value at the foot of a point counts
        in sigma : eps^a, its change from there by the derivative of eps^a.
    curved : bool
        Without, curvature and twist are left out for comparison.

    Returns
    -------
    I : (n, k, 3, p) array
        Of unit fields of modes I, II, III.
    measure : (k, p) array, length³
        Integral of hat q over these points; over the whole domain see `full_measure`.
    """
    from xcrack.crack.kernels.front import front_terms

    radii = np.ascontiguousarray(radii, dtype=float)
    states = gradient.shape[3]
    total = np.zeros((states, len(radii), 3, len(knots)))
    measure = np.zeros((len(radii), len(knots)))
    r, theta = continued_polar(feet.local, side, behind)
    hat, share, step = hats(curve, knots, feet.s)
    hat[feet.beyond] = -1
    steady, change = _initial_stress(curve, feet, initial, states)
    front_terms(
        np.ascontiguousarray(weight),
        np.ascontiguousarray(gradient),
        np.zeros((0, 3, states)) if force is None else np.ascontiguousarray(force),
        steady + change,
        change,
        np.stack([r, theta], axis=1),
        feet.frame,
        feet.turn,
        hat,
        share,
        step,
        radii,
        RING,
        material.lam,
        material.mu,
        curved,
        total,
        measure,
    )
    return total, measure


def _initial_stress(
    curve: FrontCurve,
    feet: Feet,
    initial: Callable[[Floats], Floats] | None,
    states: int,
) -> tuple[Floats, Floats]:
    """Initial stress at the feet, and what it changes from there to the points."""
    if initial is None:
        return np.zeros((0, 3, 3, states)), np.zeros((0, 3, 3, states))
    at_foot = curve.at(feet.s)[0]
    x = at_foot + np.einsum("qa,qad->qd", feet.local, feet.frame[:, :2])
    steady = np.ascontiguousarray(initial(at_foot))
    return steady, np.ascontiguousarray(initial(x) - steady)


def lip_integrals(
    curve: FrontCurve,
    knots: Floats,
    feet: Feet,
    normal: Floats,
    weight: Floats,
    traction: Floats,
    material: Isotropic,
    radii: Floats,
    *,
    gradient: Floats | None = None,
    initial: Callable[[Floats], Floats] | None = None,
) -> Floats:
    """What both crack faces add to the integrals, for true tractions on them.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    feet : Feet
        `curve.feet(x)` of the points of the crack faces.
    normal : (q, 3) array
        From lip - to lip +.
    weight : (q,) array, length²
    traction : (q, 3, n) array, stress
        On lip +, of n states; on lip - it is the opposite. A pressure p is p times the normal.
    material : Isotropic
    radii : (k,) array, length
    gradient : (2, q, 3, 3, n) array, optional
        Displacement gradients on lip - and lip +: needed where the crack faces are not the
        half-plane of the frame, since the auxiliary field has a traction of its own there.
    initial : callable, optional
        Initial stress, as in `integrals`; only counts with gradients.

    Returns
    -------
    (n, k, 3, p) array
    """
    from xcrack.crack.kernels.front import lip_terms

    radii = np.ascontiguousarray(radii, dtype=float)
    states = traction.shape[2]
    total = np.zeros((states, len(radii), 3, len(knots)))
    if not len(weight):
        return total
    hat, share, _ = hats(curve, knots, feet.s)
    hat[feet.beyond] = -1
    local = np.array(feet.local)
    # What is flat is so but for round-off, which 1 / r would magnify.
    local[np.abs(local[:, 1]) < _FLAT * radii.max(), 1] = 0.0
    steady, _ = _initial_stress(curve, feet, initial, states)
    every = np.ones(len(weight), dtype=bool)
    for s, sign in ((0, -1), (1, 1)):
        r, theta = continued_polar(local, np.full(len(weight), sign), every)
        lip_terms(
            np.ascontiguousarray(weight),
            np.ascontiguousarray(-sign * normal),
            np.ascontiguousarray(sign * traction),
            np.zeros((0, 3, 3, states)) if gradient is None else np.ascontiguousarray(gradient[s]),
            steady,
            np.stack([r, theta], axis=1),
            feet.frame,
            hat,
            share,
            radii,
            RING,
            material.lam,
            material.mu,
            total,
        )
    return total


def full_measure(curve: FrontCurve, knots: Floats, radii: Floats) -> Floats:
    """Integral of hat q over the whole tube around the front `(k, p)`, length³.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    radii : (k,) array, length
    """
    radii = np.asarray(radii, dtype=float)
    section = weight_integral(RING * radii, radii)
    return np.asarray(section[:, None] * _mass(curve, knots).sum(axis=1))


def _mass(curve: FrontCurve, knots: Floats) -> Floats:
    """Integrals of products of two hats along the front `(p, p)`, length."""
    count = len(knots)
    grid = np.append(knots, knots[0] + curve.length) if curve.closed else knots
    width = np.diff(grid)
    t = (_GAUSS[0] + 1) / 2
    speed = curve.at((grid[:-1, None] + width[:, None] * t).ravel())[2][:, 3].reshape(-1, len(t))
    weight = width[:, None] * _GAUSS[1] / 2 * speed
    first = np.arange(len(width))
    second = (first + 1) % count
    mass = np.zeros((count, count))
    np.add.at(mass, (first, first), weight @ (1 - t) ** 2)
    np.add.at(mass, (second, second), weight @ t**2)
    mixed = weight @ (t * (1 - t))
    np.add.at(mass, (first, second), mixed)
    np.add.at(mass, (second, first), mixed)
    return mass


def solve_front(
    I: Floats,  # noqa: E741
    knots: Floats,
    curve: FrontCurve,
    material: Isotropic,
    valid: Bools,
    lumped: float = 0.5,
) -> Floats:
    """K at the tops of the hats.

    The mean of the lumped and the consistent mass is used: a moment of a hat is
    K_j + h² K_j'' / 12, so that (K_j-1 + 10 K_j + K_j+1) / 12 is of order four, where lumped and
    consistent mass err by h² K'' / 12 to either side; and it magnifies scatter by 1.5 at most,
    the consistent mass by 3.

    Parameters
    ----------
    I : (n, k, 3, p) array
        Domain and lip integrals together.
    knots : (p,) array, length
    curve : FrontCurve
    material : Isotropic
    valid : (p,) array of bool
        Hats whose domain lies in the body; K of the others is prolonged.
    lumped : float
        Share of the lumped mass.

    Returns
    -------
    (n, k, p, 3) array, stress · √length
        nan everywhere if no hat is valid.
    """
    count = len(knots)
    mass = _mass(curve, knots)
    diagonal = mass.sum(axis=1)
    mixed = (1 - lumped) * mass + lumped * np.diag(diagonal)
    whole = valid & np.roll(valid, 1) & np.roll(valid, -1)
    if not curve.closed:
        whole[[0, -1]] = False
    mixed[~whole] = np.diag(diagonal)[~whole]
    factor = np.array([material.E_prime / 2, material.E_prime / 2, material.mu])
    K = np.full((*I.shape[:2], count, 3), np.nan)
    rows = np.nonzero(valid)[0]
    if not len(rows):
        return K
    right = np.moveaxis(I, 3, 0)[rows].reshape(len(rows), -1)
    solved = np.linalg.solve(mixed[np.ix_(rows, rows)], right)
    K[:, :, rows] = np.moveaxis(solved.reshape(len(rows), *I.shape[:3]), 0, 2) * factor
    return K


def inside_body(measure: Floats, full: Floats) -> Bools:
    """Hats whose domains lie wholly in the body `(p,)`, by their volume.

    Parameters
    ----------
    measure : (k, p) array, length³
        Integrals of hat q over the points of the body.
    full : (k, p) array, length³
        The same over the whole tubes.
    """
    return np.asarray((measure > _INSIDE * full).all(axis=0))
