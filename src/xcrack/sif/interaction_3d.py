"""K along a front in 3D by interaction integrals with hats along the front.

I_j = int P_kj V_k,j + [sigma_ij (u^a_i,jk - eps^a_ij,k) + sigma^a_ij,j u_i,k] V_k dV
- int_S P_kj m_j V_k dA, V = hat_j(s) q(r) t(s), S the crack faces and the sides of the body in the
domain. The auxiliary fields are those of Williams of plane strain and antiplane shear in the planes
normal to the front, u^a = U1 t + U2 n + U3 b. With
t' = -kt b + w n, n' = -kn b - w t, b' = kt t + kn n and hs = 1 - kt x1 - kn x2 the derivative
along b of what is given in (s, x1, x2) is (d/ds - w (x1 d/dx2 - x2 d/dx1)) / hs: all terms of
curvature (kt, kn) and of twist w of the frame are counted, none is left out. eps^a and sigma^a
are made of the derivatives along t and n alone, hence the second and the third term. Where the
modulus changes along the front, sigma^a goes like E(s), and sigma^a_ib dlnE/ds / hs is part of
sigma^a_ij,j: the same sums, of E(s) / E u.
K_I, K_II = E' / 2 I and K_III = mu I, each divided by the integral of the hat. Where the stiffness
is another one than C_t at the front, (C - C_t) eps(u) is an initial stress to a body of C_t, as in
2D.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.crack.fronts import FootPoints, FrontCurve
from xcrack.fem.williams import continued_polar
from xcrack.model.material import Isotropic

_FEWEST = {True: 6, False: 3}  # hats of a closed front, steps of an open one
_STEPS = 64  # samples to a step, by which an uneven spacing is measured out
_GAUSS = np.polynomial.legendre.leggauss(6)
_FLAT = 1e-9  # height of a lip point, as a share of the radius, that is round-off
_DIFFERENCE = 3  # of values at tops that follow each other: zero where they are on a parabola
_WEIGHTS = 4.0 ** np.arange(-9, 5)  # of its square: from no change to a parabola
_FEWEST_SMOOTH = 6  # tops of which a smooth curve says more than themselves


def _unit_modulus(s: Floats) -> Floats:
    return np.ones(len(s))


def front_nodes(
    curve: FrontCurve,
    spacing: Callable[[Floats], Floats],
    ends: tuple[float, float] | None = None,
    n_planes: int = 0,
) -> Floats:
    """Parameters s_j of the tops of the hats.

    Parameters
    ----------
    curve : FrontCurve
    spacing : callable
        Wanted distance of two tops f(s) -> (q,), length. There are at least six hats on a closed
        front and four on an open one.
    ends : tuple of float, length, optional
        Of an open front: where it enters and where it leaves the body; None: its ends.
    n_planes : int
        How many of its ends are at planes of symmetry: each spares a hat.

    Returns
    -------
    (p,) array, length
        On a closed front the last hat falls to zero at the first, on an open one the first and
        the last top are its ends.
    """
    s_min, s_max = ends or (0.0, curve.length)
    width = spacing(np.linspace(s_min, s_max, 2))
    count = int(np.clip(_STEPS * (s_max - s_min) / width.min(), _STEPS, 100_000))
    s = np.linspace(s_min, s_max, count + 1)
    density = 1 / spacing((s[1:] + s[:-1]) / 2)
    knot_count = np.concatenate([[0.0], np.cumsum(density * np.diff(s))])
    steps = max(_FEWEST[curve.is_closed] - n_planes, round(knot_count[-1]))
    knots = np.interp(np.arange(steps + 1) / steps * knot_count[-1], knot_count, s)
    return np.asarray(knots[:-1] if curve.is_closed else knots)


def hats(curve: FrontCurve, knots: Floats, s: Floats) -> tuple[Ints, Floats, Floats]:
    """The two hats that overlap at parameters s; each goes to the next by t² (3 - 2 t).

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    s : (q,) array, length
        Beyond the ends of an open front the hat of the end is one.

    Returns
    -------
    hat : (q, 2) array of int
    share : (q,) array
        Value of the second; the first has the rest.
    step : (q,) array, 1/length
        Derivative of the second by the parameter.
    """
    count = len(knots)
    left_knot = np.searchsorted(knots, s, side="right") - 1
    if curve.is_closed:
        width = np.diff(np.append(knots, knots[0] + curve.length))
        t = np.mod(s - knots[left_knot], curve.length) / width[left_knot]
        hat = np.stack([np.mod(left_knot, count), np.mod(left_knot + 1, count)], axis=1)
    else:
        left_knot = np.clip(left_knot, 0, count - 2)
        width = np.diff(knots)
        t = np.clip((s - knots[left_knot]) / width[left_knot], 0.0, 1.0)
        hat = np.stack([left_knot, left_knot + 1], axis=1)
    return np.ascontiguousarray(hat), t * t * (3 - 2 * t), 6 * t * (1 - t) / width[left_knot]


def reading(
    knots: Floats,
    is_valid: Bools,
    curve: FrontCurve,
    s: Floats,
    is_mirrored: tuple[bool, bool] = (False, False),
) -> Floats:
    """Matrix that makes values at parameters of those at valid tops of hats: cubic splines.

    Parameters
    ----------
    knots : (p,) array, length
    is_valid : (p,) array of bool
        v of them.
    curve : FrontCurve
    s : (m,) array, length
    is_mirrored : (bool, bool)
        Whether the values go on beyond the first and the last top as in a mirror: their slope there
        is zero.

    Returns
    -------
    (m, v) array
        Beyond the valid tops the value is that of the last of them.
    """
    grid, at = knots[is_valid], np.asarray(s, dtype=float)
    values = np.eye(len(grid))
    if len(grid) < 2:
        return np.ones((len(at), len(grid)))
    if curve.is_closed and is_valid.all():
        spline = CubicSpline(
            np.append(grid, grid[0] + curve.length),
            np.concatenate([values, values[:1]]),
            bc_type="periodic",
        )
        return np.asarray(spline(np.mod(at - grid[0], curve.length) + grid[0]))
    if curve.is_closed:
        # The invalid part is left out: s runs from the first valid top behind the widest gap.
        gap = np.diff(np.append(grid, grid[0] + curve.length))
        turn = (int(np.argmax(gap)) + 1) % len(grid)
        start = grid[turn]
        grid = np.mod(np.roll(grid, -turn) - start, curve.length)
        values = np.roll(values, -turn, axis=0)
        at = np.mod(at - start, curve.length)
        at = np.where(at > (grid[-1] + curve.length) / 2, at - curve.length, at)
    ends = tuple((1, np.zeros(len(grid))) if at_end else "not-a-knot" for at_end in is_mirrored)
    spline = CubicSpline(grid, values, bc_type=ends)
    return np.asarray(spline(np.clip(at, grid[0], grid[-1])))


def reading_of_modes(
    knots: Floats, is_valid: Bools, curve: FrontCurve, s: Floats, is_smooth: Bools | None = None
) -> Floats:
    """Matrices of `reading` for K of the three modes `(3, m, v)`.

    Where a front comes to a plane of symmetry (`is_smooth`, of the hats) K_I and K_II go on as in a
    mirror, and K_III changes its sign: without that the value at the end is extrapolated from half
    a hat.
    """
    odd_matrix = reading(knots, is_valid, curve, s)
    is_at_plane = np.zeros(len(knots), dtype=bool) if is_smooth is None else is_smooth & is_valid
    if curve.is_closed or not is_at_plane[[0, -1]].any():
        return np.stack([odd_matrix] * 3)
    is_mirrored = bool(is_at_plane[0]), bool(is_at_plane[-1])
    even_matrix = reading(knots, is_valid, curve, s, is_mirrored)
    return np.stack([even_matrix, even_matrix, odd_matrix])


def domain_integrals(
    curve: FrontCurve,
    knots: Floats,
    feet: FootPoints,
    weight: Floats,
    gradient: Floats,
    side: Ints,
    is_behind: Bools,
    tip_material: Isotropic,
    radii: Floats,
    *,
    force: Floats | None = None,
    initial_stress: Callable[[Floats], Floats] | None = None,
    stress_change: Floats | None = None,
    rise: Floats | None = None,
    is_curved: bool = True,
) -> Floats:
    """Domain integrals over points of the body; those of all chunks add up.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    feet : FootPoints
        `curve.feet(x)` of the points.
    weight : (q,) array, length³
    gradient : (q, 3, 3, n) array
        Displacement gradients of n states; rows are components, columns directions.
    side : (q,) array of int
        Side of the crack; 0 where that means nothing.
    is_behind : (q,) array of bool
        Behind the front, where the angle of a point follows the crack face of its side.
    tip_material : Isotropic
    radii : (p, k) array, length
        Of the domains of each hat.
    force : (q, 3, n) array, stress/length, optional
        Body forces.
    initial_stress : callable, optional
        f(x) -> (q, 3, 3, n), initial stress at points: its value at the foot of a point counts
        in sigma : eps^a, its change from there by the derivative of eps^a.
    stress_change : (q, 3, 3, n) array, stress, optional
        Where the stiffness is another one than that of the tip: (C - C_t) eps(u), which is an
        initial stress to a body of C_t.
    rise : (q,) array, 1/length, optional
        Derivative of ln E along the front, where `gradient` is that of u times E over that of
        `tip_material`.
    is_curved : bool
        Without, curvature and twist are left out for comparison.

    Returns
    -------
    (n, k, 3, p) array
        Of unit fields of modes I, II, III.
    """
    from xcrack.crack.kernels.front import front_terms

    states = gradient.shape[3]
    total = np.zeros((states, radii.shape[1], 3, len(knots)))
    r, theta = continued_polar(feet.offset, side, is_behind)
    hat, share, step = hats(curve, knots, feet.s)
    foot_stress, change = _initial_stress(curve, feet, initial_stress, states)
    if stress_change is not None:
        change = change + stress_change if len(change) else np.ascontiguousarray(stress_change)
        foot_stress = foot_stress if len(foot_stress) else np.zeros_like(change)
    front_terms(
        np.ascontiguousarray(weight),
        np.ascontiguousarray(gradient),
        np.zeros((0, 3, states)) if force is None else np.ascontiguousarray(force),
        foot_stress + change,
        change,
        np.stack([r, theta], axis=1),
        feet.frame,
        feet.turn,
        hat,
        share,
        step,
        np.ascontiguousarray(radii, dtype=float),
        tip_material.lam,
        tip_material.mu,
        is_curved,
        np.zeros(0) if rise is None else np.ascontiguousarray(rise),
        total,
    )
    return total


def _initial_stress(
    curve: FrontCurve,
    feet: FootPoints,
    initial_stress: Callable[[Floats], Floats] | None,
    states: int,
) -> tuple[Floats, Floats]:
    """Initial stress at the feet, and what it changes from there to the points."""
    if initial_stress is None:
        return np.zeros((0, 3, 3, states)), np.zeros((0, 3, 3, states))
    at_foot = curve.at(feet.s)[0]
    x = at_foot + np.einsum("qa,qad->qd", feet.offset, feet.frame[:, :2])
    foot_stress = np.ascontiguousarray(initial_stress(at_foot))
    return foot_stress, np.ascontiguousarray(initial_stress(x) - foot_stress)


def lip_integrals(
    curve: FrontCurve,
    knots: Floats,
    feet: FootPoints,
    normal: Floats,
    weight: Floats,
    traction: Floats,
    tip_material: Isotropic,
    radii: Floats,
    *,
    gradient: Floats | None = None,
    initial_stress: Callable[[Floats], Floats] | None = None,
) -> Floats:
    """What both crack faces add to the integrals, for true tractions on them.

    Parameters
    ----------
    curve : FrontCurve
    knots : (p,) array, length
    feet : FootPoints
        `curve.feet(x)` of the points of the crack faces.
    normal : (q, 3) array
        From lip - to lip +.
    weight : (q,) array, length²
    traction : (q, 3, n) array, stress
        On lip +, of n states; on lip - it is the opposite. A pressure p is p times the normal.
    tip_material : Isotropic
    radii : (p, k) array, length
    gradient : (2, q, 3, 3, n) array, optional
        Displacement gradients on lip - and lip +: needed where the crack faces are not the
        half-plane of the frame, since the auxiliary field has a traction of its own there.
    initial_stress : callable, optional
        Initial stress, as in `domain_integrals`; only counts with gradients.

    Returns
    -------
    (n, k, 3, p) array
    """
    # What is flat is so but for round-off, which 1 / r would magnify.
    xi = np.array(feet.offset)
    xi[np.abs(xi[:, 1]) < _FLAT * radii.max(), 1] = 0.0
    feet = FootPoints(feet.s, xi, feet.frame, feet.turn)
    is_behind = np.ones(len(weight), dtype=bool)
    lips = [
        side_integrals(
            curve, knots, feet, -sign * normal, weight, sign * traction,
            np.full(len(weight), sign), is_behind, tip_material, radii,
            gradient=None if gradient is None else gradient[s], initial_stress=initial_stress,
        )
        for s, sign in ((0, -1), (1, 1))
    ]  # fmt: skip
    return np.asarray(lips[0] + lips[1])


def side_integrals(
    curve: FrontCurve,
    knots: Floats,
    feet: FootPoints,
    outward_normal: Floats,
    weight: Floats,
    traction: Floats,
    side: Ints,
    is_behind: Bools,
    tip_material: Isotropic,
    radii: Floats,
    *,
    gradient: Floats | None = None,
    initial_stress: Callable[[Floats], Floats] | None = None,
) -> Floats:
    """What a side of the body, or one crack face, adds to the integrals.

    Parameters
    ----------
    curve, knots, feet, weight, side, is_behind, tip_material, radii
        As of `domain_integrals`; weights are areas.
    outward_normal : (q, 3) array
        Normals that point out of the body.
    traction : (q, 3, n) array, stress
        True tractions of n states.
    gradient : (q, 3, 3, n) array, optional
        Displacement gradients; without them only the tractions count.
    initial_stress : callable, optional
        Initial stress; only counts with gradients.

    Returns
    -------
    (n, k, 3, p) array
    """
    from xcrack.crack.kernels.front import surface_terms

    states = traction.shape[2]
    total = np.zeros((states, radii.shape[1], 3, len(knots)))
    if not len(weight):
        return total
    hat, share, _ = hats(curve, knots, feet.s)
    r, theta = continued_polar(feet.offset, side, is_behind)
    foot_stress, _ = _initial_stress(curve, feet, initial_stress, states)
    surface_terms(
        np.ascontiguousarray(weight),
        np.ascontiguousarray(outward_normal),
        np.ascontiguousarray(traction),
        np.zeros((0, 3, 3, states)) if gradient is None else np.ascontiguousarray(gradient),
        foot_stress,
        np.stack([r, theta], axis=1),
        feet.frame,
        hat,
        share,
        np.ascontiguousarray(radii, dtype=float),
        tip_material.lam,
        tip_material.mu,
        total,
    )
    return total


def mean_integrals(
    I: Floats,  # noqa: E741
    knots: Floats,
    curve: FrontCurve,
    tip_material: Isotropic,
    modulus: Callable[[Floats], Floats] = _unit_modulus,
) -> Floats:
    """Means of K over the hats `(n, p, 3)`, stress · √length.

    Parameters
    ----------
    I : (n, 3, p) array
        Domain and surface integrals together.
    knots : (p,) array, length
    curve : FrontCurve
    tip_material : Isotropic
    modulus : callable
        As of `solve_front`.
    """
    size = _moments(curve, knots, lambda s: modulus(s)[None, :, None])[0, :, 0]
    return np.asarray(np.moveaxis(I / size, 1, 2) * _factors(tip_material))


def solve_front(
    I: Floats,  # noqa: E741
    knots: Floats,
    curve: FrontCurve,
    tip_material: Isotropic,
    is_valid: Bools,
    zero: Bools | None = None,
    modulus: Callable[[Floats], Floats] = _unit_modulus,
) -> Floats:
    """K at the tops of the hats: a cubic spline along the front that has the integrals found.

    Parameters
    ----------
    I : (n, k, 3, p) array
        Domain and surface integrals together.
    knots : (p,) array, length
    curve : FrontCurve
    tip_material : Isotropic
    is_valid : (p,) array of bool
        Hats that have an integral.
    zero : (p,) array of bool, optional
        Hats at planes of symmetry: K_III is zero there, and K_I and K_II have no slope.
    modulus : callable
        E over that of `tip_material` at parameters (q,); K found is that for the modulus of
        `tip_material`, and a spline where K itself goes like the modulus.

    Returns
    -------
    (n, k, p, 3) array, stress · √length
        nan at hats that are not valid.
    """
    K = np.full((*I.shape[:2], len(knots), 3), np.nan)
    rows = np.nonzero(is_valid)[0]
    if not len(rows):
        return K

    def spline(s: Floats) -> Floats:
        return reading_of_modes(knots, is_valid, curve, s, zero) * modulus(s)[:, None]

    moments = _moments(curve, knots, spline)[:, rows]
    K[:, :, rows] = _K_of_integrals(
        moments, I[..., rows], tip_material, None if zero is None else zero[rows]
    )
    return K


def twice_as_wide(
    I: Floats,  # noqa: E741
    knots: Floats,
    curve: FrontCurve,
    tip_material: Isotropic,
    is_valid: Bools,
    zero: Bools | None = None,
    modulus: Callable[[Floats], Floats] = _unit_modulus,
) -> Floats:
    """K at the tops of the hats from every other hat, each with the halves of those beside it.

    Parameters
    ----------
    I, knots, curve, tip_material, is_valid, zero, modulus
        As of `solve_front`.

    Returns
    -------
    (n, k, p, 3) array, stress · √length
        nan at hats that are not valid.
    """
    result = np.full((*I.shape[:2], len(knots), 3), np.nan)
    rows = np.nonzero(is_valid)[0]
    if not len(rows):
        return result
    is_whole = bool(is_valid.all())
    pick = np.arange(0, len(rows), 2)
    if not (curve.is_closed and is_whole) and pick[-1] != len(rows) - 1:
        pick = np.append(pick, len(rows) - 1)
    share = np.zeros((len(pick), len(knots)))
    share[np.arange(len(pick)), rows[pick]] = 1.0
    for row_between in np.setdiff1d(np.arange(len(rows)), pick):
        next_pick = int(np.searchsorted(pick, row_between))
        for wide_row in (next_pick - 1, next_pick % len(pick)):
            share[wide_row, rows[row_between]] += 0.5
    tops = rows[pick]

    values = None if zero is None else zero[tops]

    def spline(s: Floats) -> Floats:
        if is_whole:
            return reading_of_modes(knots[tops], np.ones(len(tops), dtype=bool), curve, s, values)
        return reading_of_modes(knots, np.isin(np.arange(len(knots)), tops), curve, s, zero)

    moments = _moments(curve, knots, lambda s: spline(s) * modulus(s)[:, None])
    K = _K_of_integrals(share @ moments, I @ share.T, tip_material, values)
    result[:, :, rows] = np.einsum("msv,nkvm->nksm", spline(knots[rows]), K)
    return result


def smooth_values(K: Floats, is_valid: Bools, is_closed: bool) -> Floats:
    """K `(..., p, 3)` at the tops of the hats without what differs from hat to hat by chance.

    Hats as short as the cells read K with an error that alternates from one to the next. Here
    values and third differences are weighed against each other by least squares (Whittaker, 1923,
    Proc. Edinb. Math. Soc. 41, 63), with the weight of least generalised cross-validation V (Craven
    and Wahba, 1979, Numer. Math. 31, 377): K that changes over four hats or more stays. Curves of
    all weights are added by V^-p, so that their sum changes by little where K does. Few hats, and
    hats of which some have no K (`is_valid`), stay as they are.
    """
    count = K.shape[-2]
    if count < _FEWEST_SMOOTH or not is_valid.all():
        return K
    steps = np.eye(count)
    for _ in range(_DIFFERENCE):
        steps = np.roll(steps, -1, axis=0) - steps if is_closed else np.diff(steps, axis=0)
    # In the modes of the differences all weights are factors between 0 and 1.
    values, modes = np.linalg.eigh(steps.T @ steps)
    factor = 1 / (1 + _WEIGHTS[:, None] * np.maximum(values, 0.0))
    parts = np.einsum("pi,...pm->...mi", modes, K)
    V = np.square(parts) @ np.square(1 - factor).T / (count - factor.sum(axis=1)) ** 2
    V_min = V.min(axis=-1, keepdims=True)
    share = np.where(V_min > 0, (V_min / np.where(V > 0, V, 1.0)) ** count, V == 0)
    mean_factor = (share / share.sum(axis=-1, keepdims=True)) @ factor
    return np.asarray(np.einsum("pi,...mi->...pm", modes, mean_factor * parts))


def _K_of_integrals(
    moments: Floats,
    I: Floats,  # noqa: E741
    tip_material: Isotropic,
    zero: Bools | None,
) -> Floats:
    """K `(n, k, v, 3)` of integrals `(n, k, 3, v)`; K_III is zero at some tops."""
    K = np.empty((*I.shape[:2], moments.shape[1], 3))
    for mode, factor in enumerate(_factors(tip_material)):
        matrix, rhs = moments[mode].copy(), I[:, :, mode]
        if mode == 2 and zero is not None:
            matrix[zero] = np.eye(len(matrix))[zero]
            rhs = np.where(zero, 0.0, rhs)
        K[..., mode] = np.einsum("ij,nkj->nki", np.linalg.inv(matrix), rhs) * factor
    return K


def _factors(tip_material: Isotropic) -> Floats:
    """K of each mode over its integral `(3,)`."""
    return np.array([tip_material.E_prime / 2, tip_material.E_prime / 2, tip_material.mu])


def _moments(curve: FrontCurve, knots: Floats, spline: Callable[[Floats], Floats]) -> Floats:
    """Integrals of the hats over functions of the parameter, f(s) -> (3, q, v): `(3, p, v)`."""
    grid = np.append(knots, knots[0] + curve.length) if curve.is_closed else knots
    t, weight = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2
    s = (grid[:-1, None] + np.diff(grid)[:, None] * t).ravel()
    hat, share, _ = hats(curve, knots, s)
    length = curve.at(s)[2][:, 3] * np.outer(np.diff(grid), weight).ravel()
    values = np.moveaxis(spline(s) * length[:, None], 0, 1)  # (q, 3, v)
    result = np.zeros((len(knots), *values.shape[1:]))
    np.add.at(result, hat[:, 0], (1 - share)[:, None, None] * values)
    np.add.at(result, hat[:, 1], share[:, None, None] * values)
    return np.moveaxis(result, 1, 0)


__all__ = []
