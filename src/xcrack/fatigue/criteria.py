"""Where a crack turns, and the one number that a growth law sees: arrays in, arrays out.

Every criterion is called ``(K, nu)`` with the stress intensity factors of all load states of one
cycle, and returns the kink angle, the equivalent range and the ratio R of each front point.
A criterion of your own is any function of that form; `xcrack.testing.check_criterion` tries it.
"""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, CheckedBy, Choice, Poisson, check_arguments
from xcrack.base.arrays import Bools, Floats
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError, XcrackError, warn
from xcrack.base.units import TOUGHNESS

Criterion = Callable[[Floats, float], tuple[Floats, Floats, Floats]]

_TIE = 1e-12  # relative: two states whose K_eq differ by round-off only are a tie
_CLOSED = 1e-3  # share of the largest K below which a negative K_I is that of a closed tip
_DIFFER = 0.2  # share by which the two kinds of range may differ before a warning


def columns_of_K(value: Any, label: str = "K", error: type[XcrackError] = ProblemError) -> Floats:
    """K as `(..., 2 or 3)` array of finite numbers."""
    K = numbers(value, label, error=error)
    if K.ndim < 1 or K.shape[-1] not in (2, 3):
        raise error(f"{label} must have 2 or 3 columns (I, II[, III]), not shape {K.shape}.")
    return K


def states_of_K(value: Any, label: str, error: type[XcrackError]) -> Floats:
    """K of load states as `(s, f, 2 or 3)` array of finite numbers."""
    K = numbers(value, label, must_be_finite=False, error=error)
    if K.ndim != 3 or K.shape[-1] not in (2, 3) or len(K) == 0:
        raise error(
            f"{label}: a criterion takes K of shape (states, front points, 2 or 3), not {K.shape}; "
            "a single state is K[None]."
        )
    if not np.isfinite(K).all():
        state, point, mode = np.argwhere(~np.isfinite(K))[0]
        raise error(
            f"{label} of state {state}, front point {point}, mode {mode + 1} is "
            f"{K[state, point, mode]}: no direction can be chosen."
        )
    return K


_States = Annotated[ArrayLike, CheckedBy(states_of_K, unit=TOUGHNESS)]
_Range = Annotated[str, Choice(("difference", "component"))]


def kink_angle(K: ArrayLike) -> Floats:
    """Angle of the largest hoop stress around a front point.

    Parameters
    ----------
    K : (..., 2) or (..., 3) array, stress √length
        Stress intensity factors, columns I, II[, III]; K_I < 0 counts as 0, III does not turn
        the crack.

    Returns
    -------
    (...) array, rad
        Positive towards the crack normal; 0 where K_I and K_II are 0.

    Notes
    -----
    θ = -2 atan(2 K_II / (K_I + √(K_I² + 8 K_II²))), the root of K_I sin θ + K_II (3 cos θ - 1) = 0
    that maximises the hoop stress (Erdogan and Sih 1963), written without a division by K_II.

    Examples
    --------
    >>> np.degrees(kink_angle([0.0, 1.0])).round(4)       # pure mode II
    np.float64(-70.5288)
    """
    K = columns_of_K(K)
    K_I, K_II = np.maximum(K[..., 0], 0.0), K[..., 1]
    angle = -2 * np.arctan2(2 * K_II, K_I + np.hypot(K_I, np.sqrt(8.0) * K_II))
    return angle + 0.0  # no -0.0: straight ahead is one number


@check_arguments()
def equivalent_K(
    K: Annotated[ArrayLike, CheckedBy(columns_of_K, unit=TOUGHNESS)],
    angle: Annotated[ArrayLike, Array()],
    nu: Poisson,
) -> Floats:
    """Equivalent stress intensity factor in a direction.

    Parameters
    ----------
    K : (..., 2) or (..., 3) array, stress √length
        Columns I, II[, III].
    angle : (...) array, rad
        Direction of the kink, positive towards the crack normal; broadcast against K.
    nu : float
        Poisson's ratio.

    Returns
    -------
    (...) array, stress √length
        Never negative: where the hoop stress is compressive only mode III remains.

    Raises
    ------
    ProblemError
        Factors and angles that do not fit each other, an angle beyond pi.

    Notes
    -----
    K_eq² = ⟨cos²(θ/2) [K_I cos(θ/2) - 3 K_II sin(θ/2)]⟩² + K_III² / (1 - ν): hoop stress of
    Erdogan and Sih (1963), mode III at equal energy release rate.

    Examples
    --------
    >>> K = [1.0, 0.5, 0.4]
    >>> equivalent_K(K, kink_angle(K), nu=0.3).round(6)
    np.float64(1.36899)
    """
    K, angle = np.asarray(K), np.asarray(angle)
    if (np.abs(angle) > np.pi).any():
        raise ProblemError(
            f"equivalent_K: angle = {angle.flat[np.argmax(np.abs(angle))]:.6g}: angles are in rad, "
            "from -pi to pi; for degrees use numpy.radians."
        )
    try:
        np.broadcast_shapes(K.shape[:-1], angle.shape)
    except ValueError as error:
        raise ProblemError(
            f"K of shape {K.shape} and angles of shape {angle.shape} do not fit: give one angle "
            "for each row of K, or one for all."
        ) from error
    return _equivalent_K(K, angle, nu)


def _equivalent_K(K: Floats, angle: Floats, nu: float | Floats) -> Floats:
    """Equivalent factor of arrays that fit."""
    half = angle / 2
    cos, sin = np.cos(half), np.sin(half)
    bracket = np.maximum(cos**2 * (K[..., 0] * cos - 3 * K[..., 1] * sin), 0.0)
    if K.shape[-1] == 2:
        return bracket
    return np.hypot(bracket, K[..., 2] / np.sqrt(1 - nu))


@check_arguments()
def max_hoop_stress(
    K: _States, nu: Poisson, *, range: _Range = "difference"
) -> tuple[Floats, Floats, Floats]:
    """Kink in the direction that the most severe load state asks for.

    The angle is that of the state with the largest K_eq in its own direction; of states that
    tie, the smaller value of the angle, so that the order of the states never matters.

    Parameters
    ----------
    K : (s, f, 2) or (s, f, 3) array, stress √length
        Factors of s load states at f front points; K_I < 0 counts as 0 and is flagged.
    nu : float
        Poisson's ratio.
    range : {"difference", "component"}
        See `mean_reference`.

    Returns
    -------
    angle : (f,) array, rad
    dK_eq : (f,) array, stress √length
    R : (f,) array

    Examples
    --------
    >>> angle, dK_eq, R = max_hoop_stress([[[0.2, 0.0]], [[1.0, 0.0]]], nu=0.3)
    >>> print(angle, dK_eq, R)
    [0.] [0.8] [0.2]
    """
    K = _flagged_K(np.asarray(K))
    angles = kink_angle(K)
    return _angle_and_range(K, _angle_of_largest(_equivalent_K(K, angles, nu), angles), nu, range)


@check_arguments()
def mean_reference(
    K: _States,
    nu: Poisson,
    *,
    reference: Annotated[str, Choice(("mean", "max", "min"))] = "mean",
    range: _Range = "difference",
) -> tuple[Floats, Floats, Floats]:
    """Kink in the direction of one reference state of the cycle.

    Parameters
    ----------
    K : (s, f, 2) or (s, f, 3) array, stress √length
        Factors of s load states at f front points; K_I < 0 counts as 0 and is flagged.
    nu : float
        Poisson's ratio.
    reference : {"mean", "max", "min"}
        The mean of all states, or the state with the largest or the smallest K_eq in its own
        direction (ties: the smaller value of the angle).
    range : {"difference", "component"}
        "difference": the largest minus the smallest K_eq of the states in the chosen direction.
        "component": the largest K_eq of the difference of any two states, which also sees a
        reversed mode II. The first is warned of where the two differ by more than 20 %.

    Returns
    -------
    angle : (f,) array, rad
        0 where all K are 0.
    dK_eq : (f,) array, stress √length
        Equivalent range.
    R : (f,) array
        Smallest over largest K_eq in the chosen direction, in [0, 1]; 0 where the largest is 0.

    Notes
    -----
    Pierard, Jin, Wyart, Dompierre, Béchet, "Simulation of contact on crack lips and its
    influence on fatigue life prediction", eq. 14, for any number of states.

    Examples
    --------
    >>> angle, _, _ = mean_reference([[[1.0, 0.3]], [[1.0, -0.3]]], nu=0.3)
    >>> print(angle)
    [0.]
    """
    K = _flagged_K(np.asarray(K))
    if reference == "mean":
        mean = _sum(K) / len(K)
        return _angle_and_range(K, kink_angle(mean), nu, range)
    angles = kink_angle(K)
    K_eq = _equivalent_K(K, angles, nu)
    return _angle_and_range(
        K, _angle_of_largest(K_eq if reference == "max" else -K_eq, angles), nu, range
    )


@check_arguments()
def weighted_angle(
    K: _States, nu: Poisson, *, range: _Range = "difference"
) -> tuple[Floats, Floats, Floats]:
    """Kink in the mean direction of all load states, each weighted with its K_eq.

    The weight of a state is its K_eq in its own direction; the range is then taken in the mean
    direction. A state that is listed twice counts twice; a state without load counts nothing.

    Parameters
    ----------
    K : (s, f, 2) or (s, f, 3) array, stress √length
        Factors of s load states at f front points; K_I < 0 counts as 0 and is flagged.
    nu : float
        Poisson's ratio.
    range : {"difference", "component"}
        See `mean_reference`.

    Returns
    -------
    angle : (f,) array, rad
    dK_eq : (f,) array, stress √length
    R : (f,) array

    Notes
    -----
    θ = atan2(Σ K_eq sin θ_i, Σ K_eq cos θ_i): eq. 15 of the paper named in `mean_reference`,
    whose print has the arctangent of a ratio.

    Examples
    --------
    >>> angle, _, _ = weighted_angle([[[0, 0]], [[1, 0]], [[0.6, 0.5]]], nu=0.3)
    >>> print(np.degrees(angle).round(4))
    [-24.6401]
    """
    K = _flagged_K(np.asarray(K))
    angles = kink_angle(K)
    weight = _equivalent_K(K, angles, nu)
    angle = np.arctan2(_sum(weight * np.sin(angles)), _sum(weight * np.cos(angles))) + 0.0
    return _angle_and_range(K, angle, nu, range)


def clipped_K(K: ArrayLike) -> Floats:
    """Copy of K `(..., 2 or 3)` with every negative K_I set to 0: a crack does not open inwards."""
    K = np.array(K, dtype=float)
    K[..., 0] = np.maximum(K[..., 0], 0.0)
    return K


def _flagged_K(K: Floats) -> Floats:
    """K with K_I >= 0; a warning where faces overlap."""
    # A closed tip has K_I = 0 up to discretisation: only a real overlap triggers a warning.
    is_negative = K[..., 0] < -_CLOSED * np.abs(K).max(initial=0.0)
    if is_negative.any():
        state, point = np.unravel_index(np.argmin(K[..., 0]), is_negative.shape)
        warn(
            f"K_I < 0 in {np.count_nonzero(is_negative)} of {is_negative.size} values counts as 0; "
            f"the smallest is {K[state, point, 0]:.4g} (state {state}, front point {point}). With "
            "contact it is discretisation error; without, the crack faces overlap there."
        )
    return clipped_K(K)


def _sum(values: Floats) -> Floats:
    """Sum over the states `(s, ...)`, the same to the last bit in whatever order they come."""
    return np.asarray(np.sort(values, axis=0).sum(axis=0))


def _angle_of_largest(score: Floats, angle: Floats) -> Floats:
    """Angle `(f,)` of the state with the largest score `(s, f)`; the smallest of those that tie."""
    largest_score = score.max(axis=0)
    is_tied = score >= largest_score - _TIE * np.abs(score).max(axis=0)
    return np.asarray(np.where(is_tied, angle, np.inf).min(axis=0))


def _angle_and_range(
    K: Floats, angle: Floats, nu: float, range: str
) -> tuple[Floats, Floats, Floats]:
    """The chosen angle with the range and the ratio R that go with it."""
    K_eq = _equivalent_K(K, angle, nu)
    largest_K, smallest_K = K_eq.max(axis=0), K_eq.min(axis=0)
    R = np.divide(smallest_K, largest_K, out=np.zeros_like(largest_K), where=largest_K > 0)
    difference = largest_K - smallest_K
    component = _component_range(K, angle, nu)
    if range == "component":
        return angle, component, R
    gap = np.abs(component - difference)
    is_apart = gap > _DIFFER * np.maximum(component, difference)
    if is_apart.any():
        point = int(np.argmax(gap))
        warn(
            f"the difference of the extreme K_eq ({difference[point]:.4g}) and the K_eq of the "
            f"difference of two states ({component[point]:.4g}) are more than 20 % apart at "
            f"{np.count_nonzero(is_apart)} of {len(is_apart)} front points (first at {point}): a "
            'mode is reversed within the cycle; range="component" takes the second.'
        )
    return angle, difference, R


def _component_range(K: Floats, angle: Floats, nu: float) -> Floats:
    """Largest K_eq of the difference of two states, in both orders."""
    K_max = np.zeros(K.shape[1])
    for state in K:
        np.maximum(K_max, equivalent_K(clipped_K(K - state), angle, nu).max(axis=0), out=K_max)
    return K_max


def local_equivalent_K(K: Floats, angle: Floats, nu: float | Floats) -> Floats:
    """`equivalent_K` at places `(s, f)`, of which each may have a Poisson's ratio of its own."""
    if isinstance(nu, np.ndarray):
        return np.asarray(_equivalent_K(K, angle, nu))
    return equivalent_K(K, angle, nu)


# Range and ratio of a crack whose faces may overlap.


def nominal_range(K: Floats, angle: Floats, nu: float | Floats) -> tuple[Floats, Floats]:
    """Range and ratio of a crack whose faces may overlap, R < 0 included.

    Parameters
    ----------
    K : (s, f, 2 or 3) array, stress √length
        Of the scene without contact.
    angle : (f,) array, rad
        Direction at each place.
    nu : float or (f,) array

    Returns
    -------
    dK_eq : (f,) array, stress √length
    R : (f,) array
        0 where no state opens the place; the range is 0 there too.

    Notes
    -----
    K_eq as of `equivalent_K`, but for its sign: where the hoop stress is compressive it is the
    bracket of Erdogan and Sih alone, and negative.
    """
    cos, sin = np.cos(angle / 2), np.sin(angle / 2)
    K_eq = cos**2 * (K[..., 0] * cos - 3 * K[..., 1] * sin)
    if K.shape[-1] == 3:
        K_eq = np.where(K_eq >= 0, np.hypot(K_eq, K[..., 2] / np.sqrt(1 - nu)), K_eq)
    largest_K, smallest_K = K_eq.max(axis=0), K_eq.min(axis=0)
    is_opening = largest_K > 0
    R = np.divide(smallest_K, largest_K, out=np.zeros_like(largest_K), where=is_opening)
    return np.where(is_opening, largest_K - smallest_K, 0.0), R


# --- K at the tip of a kink of no length, and where a criterion turns it no further ---


Turn = Callable[[Floats], Floats]  # K (s, f, 2) -> kink angle (f,), rad

START = np.radians(3.0)  # a smaller turn is its own limit to 0.02 degrees
_PASSES = 30
_ROUND_OFF = 1e-8  # rad
_CONVERGED = 1e-3  # rad
_MOST = np.radians(100.0)  # the series is good to 1e-4 up to 80 degrees


def kinked_K(K: Floats, angle: Floats) -> Floats:
    """Factors at the tip of a kink of no length.

    Parameters
    ----------
    K : (..., 2) array, stress √length
        K_I, K_II of the crack without the kink.
    angle : (...) array, rad
        Of the kink, positive towards the crack normal.

    Returns
    -------
    (..., 2) array, stress √length

    Notes
    -----
    K* = F(θ) K with the series of F in θ/π of Amestoy and Leblond (1992), *Crack paths in plane
    situations* II; faces free of traction.
    """
    m = np.asarray(angle) / np.pi
    K = np.asarray(K)
    F = [np.polynomial.polynomial.polyval(m, series) for series in _SERIES]
    return np.stack(
        [F[0] * K[..., 0] + F[1] * K[..., 1], F[2] * K[..., 0] + F[3] * K[..., 1]], axis=-1
    )


def limit_angles(turn: Turn, K: Floats) -> tuple[Floats, Bools]:
    """Angles of a first kink from which a criterion turns no further.

    Parameters
    ----------
    turn : callable
        Kink angle by the criterion.
    K : (s, f, 2) array, stress √length
        Of s load states at f tips.

    Returns
    -------
    angle : (f,) array, rad
    converged : (f,) array of bool
        Elsewhere there is no such angle within 100 degrees.
    """
    angle = np.zeros(K.shape[1])
    turn_left = np.full(K.shape[1], np.inf)
    for _ in range(_PASSES):
        turn_left = turn(kinked_K(K, angle))
        angle = np.clip(angle + turn_left, -_MOST, _MOST)
        if (np.abs(turn_left) < _ROUND_OFF).all():
            break
    return angle, (np.abs(turn_left) < _CONVERGED) & (np.abs(angle) < _MOST)


def _series() -> tuple[Floats, ...]:
    """Coefficients of F_11, F_12, F_21, F_22 over (θ/π)^0, (θ/π)^1, ..."""
    p = np.pi
    F = np.zeros((4, 21))
    F[0, ::2] = [
        1, -3 * p**2 / 8, p**2 - 5 * p**4 / 128, p**2 / 9 - 11 * p**4 / 72 + 119 * p**6 / 15360,
        5.07790, -2.88312, -0.0925, 2.996, -4.059, 1.63, 4.1,
    ]  # fmt: skip
    F[1, 1::2] = [
        -3 * p / 2, 10 * p / 3 + p**3 / 16, -2 * p - 133 * p**3 / 180 + 59 * p**5 / 1280,
        12.313906, -7.32433, 1.5793, 4.0216, -6.915, 4.21, 4.56,
    ]  # fmt: skip
    F[2, 1::2] = [
        p / 2, -4 * p / 3 - p**3 / 48, -2 * p / 3 + 13 * p**3 / 30 - 59 * p**5 / 3840,
        -6.176023, 4.44112, -1.5340, -2.0700, 4.684, -3.95, -1.32,
    ]  # fmt: skip
    F[3, ::2] = [
        1, -4 - 3 * p**2 / 8, 8 / 3 + 29 * p**2 / 18 - 5 * p**4 / 128,
        -32 / 15 - 4 * p**2 / 9 - 1159 * p**4 / 7200 + 119 * p**6 / 15360,
        10.58254, -4.78511, -1.8804, 7.280, -7.591, 0.25, 12.5,
    ]  # fmt: skip
    return tuple(F)


_SERIES = _series()


__all__ = [
    "START",
    "Criterion",
    "Turn",
    "clipped_K",
    "equivalent_K",
    "kink_angle",
    "kinked_K",
    "limit_angles",
    "local_equivalent_K",
    "max_hoop_stress",
    "mean_reference",
    "nominal_range",
    "weighted_angle",
]
