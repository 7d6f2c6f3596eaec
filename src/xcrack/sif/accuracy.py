"""Doubts and warnings about the accuracy of K; their thresholds come from measured errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.analysis.plan import errors_by_order
from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, at
from xcrack.base.errors import ProblemError, warn
from xcrack.crack.measures import DEEP, cells_deep
from xcrack.sif.common import is_shallow, pressure_at
from xcrack.sif.sif import SIF

_LOAD = 0.1  # share of K of the mean stress of the body that counts where K is next to nothing
_SHARP = 1.9  # cells: two, but for the scatter of their sizes along a front
BESIDE = 1.0  # cells to another material: K is .2 % off from there on, 10 % at .06 (measured)
# What hats twice as wide make of K, over the largest: 10 % at most on 50 scenes within 5 %, 17 to
# 31 % (K 6 to 17 % off, at either order) under the bottom of a hole that is within half a cell.
_WIDE = 0.12
# Share of the largest K that integrals may give as K_I where faces press, which is zero: of 35
# drawn scenes in space .15 at most but for fronts with a bend, of which another warning tells, and
# for one pressure function between front and junction, .29 (K off by .5 %) and .35 (6.6 %).
_PRESSED = 0.3
_ZONE = 2.0  # cells; in shorter contact zones the pressure is hardly more than one number
# Share of the largest K of a crack that its estimated error and bar may have without a warning: of
# drawn scenes that are off by more than 5 % nearly all are beyond it, of the others one in twelve.
_OFF = 0.03
_NOTHING = 0.005  # share of K of the mean stress of the body below which K of a crack is nothing


@dataclass(frozen=True, eq=False)
class Domain:
    """Size of the domain around a tip or front, and what is expected of it.

    Attributes
    ----------
    outer_radius : float, length
        Outer radius of the first domain.
    free_radius : float, length
        What it would be without neighbours.
    room : float, length
        What boundary, other cracks, and bends of a front leave.
    least_room : float, length
        Room below which large errors are common.
    is_short : bool
        Whether the crack is so short that they are common too.
    size : float, length
        Of the cells there.
    narrow_place : (d,) array, length
        Where the room is least.
    differ : float
        Share of K by which two domains may differ.
    label : str
        How warnings name the place.
    bend : float, length
        Smallest radius of curvature of a front; inf where it is straight, and of a tip.
    bend_at : (d,) array, length, optional
        Where that is.
    interface : float, length
        Distance to another material; inf where there is none.
    """

    outer_radius: float
    free_radius: float
    room: float
    least_room: float
    is_short: bool
    size: float
    narrow_place: Floats
    differ: float
    label: str
    bend: float = np.inf
    bend_at: Floats | None = None
    interface: float = np.inf

    def at(self, x: Floats) -> str:
        """Name of a place in a warning."""
        return f"{self.label} {np.round(x, 6).tolist()}"


def check(
    solutions: Sequence[Solution],
    t: int,
    domain: Domain,
    parts: Sequence[SIF],
    disagree: Callable[[], bool] = lambda: True,
    depart: Callable[[], bool] = lambda: True,
) -> list[str]:
    """Doubts: clipped domains, bends, domains that differ, K that changes steeply, short contacts.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem.
    t : int
        Tip or front in `space.tips`.
    domain : Domain
    parts : sequence of SIF
        One for each state, with at least one row.
    disagree : callable () -> bool
        Whether K by other means is another one: a doubt about the domain, or a short contact zone,
        is none where it is not.
    depart : callable () -> bool
        Whether it is quite another one: so for another material beside the tip.

    Returns
    -------
    list of str
        Messages, each with its place.

    Raises
    ------
    ProblemError
        K that is no number.
    """
    for part in parts:
        is_missing = ~np.isfinite(part.K).all(axis=1)
        if is_missing.any():
            row = int(np.argmax(is_missing))
            raise ProblemError(
                f"{domain.at(part.x[row])}: K = {part.K[row].tolist()} is no number. Move the "
                f"crack by a thousandth of a cell ({1e-3 * domain.size:.3g}), or refine the mesh "
                "there."
            )
    tip = solutions[0].space.tips[t]
    scales = [scale_of(s, part, tip.radius) for s, part in zip(solutions, parts, strict=True)]
    difference, place = _difference(domain, parts, scales)
    doubts = [difference, _overlap_warning(solutions, domain, parts, scales)]
    is_narrow = domain.room < domain.least_room or domain.is_short
    is_clipped = domain.outer_radius < domain.free_radius * (1 - 1e-12)
    if is_clipped and (is_narrow or any(doubts)) and disagree():
        place = domain.narrow_place
        doubts.insert(0, _clipped_K(domain))
    else:
        doubts = [difference]
    bend = _sharp_bend(domain)
    if bend and domain.bend_at is not None:
        doubts, place = [bend, *doubts], domain.bend_at
    messages = []
    if domain.interface < BESIDE * domain.size and depart():
        messages.append(
            f"{domain.at(tip.x if tip.x.ndim == 1 else place)}: another material begins "
            f"{domain.interface / domain.size:.2g} cells away. Errors of K of some per cent are "
            "common there, and two domains do not show them. Refine the mesh there, or move the "
            "crack."
        )
    if any(doubts):
        text = "; ".join(filter(None, doubts))
        messages.append(f"{domain.at(place)}: {text}. Refine the mesh there.")
    if words := _steep_K(domain, parts, scales):
        messages.append(words)
    if words := _coarse_pressure(solutions, tip.crack, domain, parts, scales):
        messages.append(words)
    for solution, part, scale in zip(solutions, parts, scales, strict=True):
        words = _short_zone(solution, tip.crack, domain, part, scale)
        if words and disagree():
            messages.append(words)
            break
    return messages


def warn_of(
    messages: Sequence[str], solutions: Sequence[Solution], parts: Sequence[SIF], radius: float
) -> None:
    """Warn of doubts about K of a crack; where it has bars at all of its tips these decide.

    Parameters
    ----------
    messages : sequence of str
        Of `check`, for all tips.
    solutions : sequence of Solution
        States of one problem.
    parts : sequence of SIF
        K of the crack in each, with bars or without.
    radius : float, length
        Enriched radius.
    """
    if any(np.isnan(part.bar).any() for part in parts):
        for message in messages:
            warn(message)
        return
    largest_error, text = _OFF, ""
    for solution, part in zip(solutions, parts, strict=True):
        error_of_K = np.abs(part.eta) + part.bar
        error_of_K[part.closed, 0] = 0.0  # K_I is exact there
        largest_K = float(np.abs(part.K).max(initial=0.0))
        scale = max(largest_K, _NOTHING * _K_of_mean_stress(solution, part, radius))
        if not error_of_K.size or error_of_K.max() <= largest_error * scale:
            continue
        largest_error = float(error_of_K.max()) / scale
        row, mode = np.unravel_index(error_of_K.argmax(), error_of_K.shape)
        text = (
            f"K at {at(part.x[row])}: {('K_I', 'K_II')[mode]} = {part.K[row, mode]:.4g} is off by "
            f"{part.eta[row, mode]:.2g} ± {part.bar[row, mode]:.2g} by its estimate, up to "
            f"{100 * largest_error:.2g} % of the largest K of the crack. Refine the mesh there"
        )
    if text:
        warn(". ".join([text, *(message.rstrip(".") for message in messages)]) + ".")


def warn_of_order(solution: Solution, crack: int) -> None:
    """Warn of tetrahedra of order 1 that are too stiff around a crack, which two domains miss."""
    space = solution.space
    fronts = [np.array(tip.x) for tip in space.tips if tip.crack == crack]
    x = np.array(solution.lips[crack].x)
    if space.dim < 3 or space.order > 1 or not fronts or not len(x):
        return
    depth = cells_deep(x, np.concatenate(fronts), space.mesh)
    if depth < DEEP:
        error, rest = errors_by_order(bool(space.cracks[crack].ends_on))
        warn(
            f"order 1: crack {crack} is {depth:.2g} cells deep, and K is {error} below "
            f"{DEEP:g}, which two domains do not show. Give order=2 (within {rest}), or cells that "
            f"are {DEEP / max(depth, 1e-3):.2g} times smaller as far as the crack is deep."
        )


def scale_of(solution: Solution, part: SIF, radius: float) -> float:
    """What differences of K are compared with: the largest K, or what the load would make of it.

    K of a closed or shielded tip may be zero: what counts there is K of the body's mean stress at a
    crack as long as the enriched radius.
    """
    return max(float(np.abs(part.K).max()), _LOAD * _K_of_mean_stress(solution, part, radius))


def _K_of_mean_stress(solution: Solution, part: SIF, radius: float) -> float:
    """K of the root mean square of the body's stress at a crack of some length."""
    volume = float(solution.space.mesh.volume.sum())
    E_prime = 1.0 if part.E_prime is None else float(part.E_prime.max(initial=0.0))
    mean_stress = np.sqrt(2 * max(solution.energy, 0.0) * E_prime / volume)
    return float(mean_stress * np.sqrt(np.pi * radius))


def _clipped_K(domain: Domain) -> str:
    text = (
        f"the domain is clipped to {domain.outer_radius:.4g} "
        f"({domain.outer_radius / domain.size:.1f} cells) by the boundary, "
        "another tip or crack, or a bend of the front"
    )
    if domain.room < domain.least_room:
        return f"{text}, and errors are small from {domain.least_room / domain.size:.3g} cells on"
    return f"{text}, and the crack is only a few cells long" if domain.is_short else text


def _sharp_bend(domain: Domain) -> str:
    """A front that bends within two cells: chords and linear level sets do not follow it."""
    if domain.bend >= _SHARP * domain.size:
        return ""
    cells = domain.bend / domain.size
    return (
        f"the front bends with a radius of {domain.bend:.4g} there, {cells:.2g} cells, and K is "
        "good from two cells on (xc.adapt makes them as small)"
    )


def _overlap_warning(
    solutions: Sequence[Solution], domain: Domain, parts: Sequence[SIF], scales: Sequence[float]
) -> str:
    """K_I below zero in a problem with contact: the mesh does not resolve the contact there."""
    for solution, part, scale in zip(solutions, parts, scales, strict=True):
        smallest_K = float(part.K_I.min())
        if solution.problem.contact != "off" and smallest_K < -domain.differ * scale:
            return (
                f"K_I = {smallest_K:.3g} means crack faces that overlap where the contact cannot "
                "see it"
            )
    return ""


def _difference(
    domain: Domain, parts: Sequence[SIF], scales: Sequence[float]
) -> tuple[str, Floats]:
    """By how much two domains differ where that is too much, and the place."""
    largest_difference, text, place = domain.differ, "", domain.narrow_place
    for part, scale in zip(parts, scales, strict=True):
        spread = np.array(part.spread)
        spread[part.closed, 0] = 0.0  # K_I is exact there
        is_inside = ~part.at_surface if not part.at_surface.all() else part.at_surface
        difference = float(spread[is_inside].mean(axis=0).max())
        if scale > 0 and difference / scale > largest_difference:
            largest_difference = difference / scale
            place = part.x[is_inside][np.argmax(spread[is_inside].max(axis=1))]
            text = (
                f"domains of radius {domain.outer_radius:.4g} and less differ by {difference:.3g}, "
                f"{100 * largest_difference:.2g} % of the largest K"
            )
    return text, place


def _steep_K(domain: Domain, parts: Sequence[SIF], scales: Sequence[float]) -> str:
    """What to say of a front whose K changes from hat to hat; empty if it does not."""
    largest_change, text = _WIDE, ""
    for part, scale in zip(parts, scales, strict=True):
        if part.widened is None or part.at_surface.all() or scale <= 0:
            continue
        change = np.array(part.widened) / scale
        change[part.closed, 0] = change[part.at_surface] = 0.0
        if change.max() > largest_change:
            largest_change = float(change.max())
            text = (
                f"{domain.at(part.x[change.max(axis=1).argmax()])}: K changes from cell to cell, "
                f"and hats twice as wide make {100 * largest_change:.2g} % of the largest K of it. "
                "Refine the mesh there."
            )
    return text


def _coarse_pressure(
    solutions: Sequence[Solution], c: int, domain: Domain, parts: Sequence[SIF],
    scales: Sequence[float],
) -> str:  # fmt: skip
    """What to say of a front that is closed by pressures against its integrals; empty if none is.

    A pressure function that spans a crack from its front to a junction is closed as a whole, and
    K_I counts as zero however far the faces are pulled apart at the front.
    """
    largest_share, text = _PRESSED, ""
    for solution, part, scale in zip(solutions, parts, scales, strict=True):
        if not part.closed.any() or scale <= 0:
            continue
        K_I = np.where(pressure_at(part, solution, c) > 0, part.K_integral[:, 0], 0.0)
        K_I[~part.closed] = 0.0
        K_I[part.at_surface & ~part.at_surface.all()] = 0.0
        if K_I.max() > largest_share * scale:
            largest_share = float(K_I.max()) / scale
            text = (
                f"{domain.at(part.x[K_I.argmax()])}: faces press there, so that K_I is zero, but "
                f"integrals give {K_I.max():.3g}, {100 * largest_share:.2g} % of the largest K: "
                "the pressures do not resolve where contact ends. Refine the mesh there."
            )
    return text


def _short_zone(solution: Solution, c: int, domain: Domain, part: SIF, scale: float) -> str:
    """What to say of a contact zone that is short wherever it touches a front; empty if it is not.

    A zone whose pressures cannot change K by what two domains may differ is left alone: under pure
    shear the errors of a mesh press a few lip points together. An even pressure p within a depth d
    of a front has K = 2 p √(2 d / π), the integral of a line load's 2 P / √(2 π b) (Tada, Paris and
    Irwin, 2000, part 3).
    """
    pressure = pressure_at(part, solution, c)
    is_touching = pressure > 0
    is_shallow_place = is_shallow(part, solution, c, _ZONE * domain.size)
    if not is_touching.any() or (is_touching & ~is_shallow_place).any():
        return ""
    K_per_pressure = 2 * np.sqrt(2 * _ZONE * domain.size / np.pi)
    if K_per_pressure * pressure.max() <= domain.differ * scale:
        return ""
    return (
        f"{domain.at(part.x[np.argmax(is_touching)])}: the contact zone there is shorter than two "
        f"cells ({_ZONE * domain.size:.4g}): its pressure and its end are not resolved. Refine the "
        "mesh there."
    )
