"""What the error bars of K mean for growth: best K where it is known, errors of rate and place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.errors import collected_warnings
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.options import GrowthRule
from xcrack.growth.rates import Rates, criterion_inputs, rates_of
from xcrack.growth.response import Answers
from xcrack.growth.step import Corrected, Step
from xcrack.sif.sif import SIF, bars_of

# Of the sum of all steps with one sign: each bar holds for almost all single K, and what they err
# by cancels in part. On fifteen uniform meshes (five scenes) lives erred by a quarter of the sum.
TOGETHER = 0.5
_ASTRAY = 2.0  # times the turn of a step, where no integrator says how such errors go on
_FAST = 0.5  # of the largest rate: places that count for the error of life
_REMEDY = {
    "steps": "The first step is known better once a second one is done; later ones are as short as "
    "cells allow: refine the mesh along the way (xc.refine).",
    "K": "Give a smaller tolerance or a larger max_unknowns: the cells were chosen for a few steps "
    "of the way only.",
    "contact": "Refine the mesh along the faces that touch (xc.refine).",
    "no bar": "The steps at which K has no error bar count in full.",
}
_WHOLE = 1.0  # relative error of a rate that may as well be zero, or infinite


@dataclass(frozen=True, eq=False)
class RateError:
    """Errors of growth at one solve by the bars of K.

    Attributes
    ----------
    rate, contact : float
        Of the largest rate, relative; nan where K has no bar there. Contact's part of it.
    turn : float, rad
        Of the direction there.
    """

    rate: float
    contact: float
    turn: float


def rate_error(rule: GrowthRule, rates: Rates, sif: Answers) -> RateError:
    """How much rates and directions change as K moves within its bars.

    Each mode in turn is moved by its bar, up and down, in all states at once, and the changes are
    added. The place with the largest error counts, among those that grow at least half as fast as
    the fastest one.

    Parameters
    ----------
    rule : GrowthRule
    rates : Rates
        By the best K.
    sif : sequence of sequence of SIF
        With bars.
    """
    bar = [_stacked_K(sif, c, lambda s: s.bar) for c in range(len(rates.cracks))]
    parts = [_stacked_K(sif, c, _contact_part) for c in range(len(rates.cracks))]
    is_known = np.concatenate([np.isfinite(b).all(axis=(0, 2)) for b in bar])
    surface = np.concatenate([crack.at_surface for crack in sif[0]])
    rate, angle = rates.law_rate, rates.angle
    n = len(rate)
    total, contact, turn = np.zeros(n), np.zeros(n), np.zeros(n)
    moved_rates = _rates_of_moved_K(rule, rates, bar)
    for mode, rates_of_mode in enumerate(moved_rates):
        change, angle_change = np.zeros(n), np.zeros(n)
        for other_angle, other_rate in rates_of_mode:
            change = np.maximum(change, _log_ratio(rate, other_rate))
            angle_change = np.maximum(angle_change, np.abs(other_angle - angle))
        share = np.concatenate([_share(o[..., mode], b[..., mode]) for o, b in zip(parts, bar)])
        total, contact, turn = total + change, contact + share * change, turn + angle_change
    fastest_rate = float(rate[np.isfinite(rate)].max(initial=0.0))
    counts = (rate >= _FAST * fastest_rate) & (rate > 0) & ~surface
    if not counts.any():
        return RateError(np.nan, 0.0, np.nan)
    if not is_known[counts].all() or np.isinf(rate[counts]).any():
        return RateError(np.nan, 0.0, np.nan)
    worst_place = int(np.argmax(np.where(counts, total, -1.0)))
    return RateError(
        float(total[worst_place]), float(contact[worst_place]), float(turn[counts].max())
    )


# Bars that are foretold from those of the solve before. On a mesh that stays eta keeps its share of
# K to a half or so from step to step where there is room around the tips; bars become shorter
# behind a kink, after that first solve there, at which they may be several times as wide.

_WIDER, _WIDER_BEHIND_KINK = 1.3, 8.0  # a solve later
_OF_ETA = 0.25  # of it, that bars become wider by beside
_STEADY = 2.0  # ratio of K of two solves, at most
_ROOM = 1.5  # cells: least radius of the domain of K around a tip


def foretold_bars(
    answers_before: Answers, answers_now: Answers, widths: tuple[float, float], is_behind_kink: bool
) -> Answers | None:
    """K of all states and cracks with errors in proportion to it; None where they may be others.

    Parameters
    ----------
    answers_before : sequence of sequence of SIF
        Of the last solve, with bars.
    answers_now : sequence of sequence of SIF
        Without.
    widths : (float, float)
        Largest half-widths of K_I and of K_II, over the largest K: where one would be wider, it is
        to be known better.
    is_behind_kink : bool
        Whether the last solve was the first one, before cracks have kinked.
    """
    if [len(state) for state in answers_before] != [len(state) for state in answers_now]:
        return None
    rows = []
    for old_state, new_state in zip(answers_before, answers_now, strict=True):
        cracks = [
            _with_foretold_bars(a, b, is_behind_kink)
            for a, b in zip(old_state, new_state, strict=True)
        ]
        if any(crack is None for crack in cracks):
            return None
        rows.append(tuple(crack for crack in cracks if crack is not None))
    all_sifs = [crack for row in rows for crack in row]
    K, bar = (np.abs(np.concatenate(part)) for part in zip(*((sif.K, sif.bar) for sif in all_sifs)))
    is_narrow = bar.max(axis=0, initial=0.0) <= np.array(widths) * K.max(initial=0.0)
    return tuple(rows) if is_narrow.all() else None


def _with_foretold_bars(old_sif: SIF, new_sif: SIF, is_behind_kink: bool) -> SIF | None:
    errors = old_sif.errors
    if errors is None or any(errors.reasons) or not np.array_equal(old_sif.closed, new_sif.closed):
        return None
    size = [np.linalg.norm(sif.K, axis=1) for sif in (old_sif, new_sif)]
    if not np.array_equal(size[0] > 0, size[1] > 0) or (new_sif.domain_cells < _ROOM).any():
        return None
    ratio = np.divide(size[1], size[0], out=np.ones_like(size[0]), where=size[0] > 0)[:, None]
    if ((ratio > _STEADY) | (ratio < 1 / _STEADY)).any():
        return None
    old_bar, factor = errors.bar, _WIDER
    if is_behind_kink:  # modes mix
        old_bar = np.broadcast_to(old_bar.max(axis=1, keepdims=True), old_bar.shape)
        factor = _WIDER_BEHIND_KINK
    contact = None if errors.contact is None else factor * ratio * errors.contact
    bar = ratio * (factor * old_bar + _OF_ETA * np.abs(errors.eta))
    return replace(new_sif, errors=bars_of(ratio * errors.eta, bar, errors.reasons, contact))


def add_K_error(
    rule: GrowthRule,
    step: Step | None,
    corrected_step: Corrected,
    rates: Rates,
    sif: Answers,
) -> Corrected:
    """A settled step whose error also has what the bars of K have cost so far."""
    if corrected_step.error is None:
        return corrected_step
    rate_error_now = rate_error(rule, rates, sif)
    if step is None or step.error is None:
        error = replace(
            corrected_step.error, K=0.0, contact=0.0, unknown=0.0, K_place=0.0, grown=0.0
        )
    else:
        error_before, cycles = step.error, corrected_step.cycles - step.cycles
        errors_of_K, parts = (
            [error_before.rate, rate_error_now.rate],
            [error_before.rate_contact, rate_error_now.contact],
        )
        turns = [turn for turn in (error_before.turn, rate_error_now.turn) if np.isfinite(turn)]
        way = max((float(da.max(initial=0.0)) for da in step.da), default=0.0)
        # Of 2D tips it is known how errors of before have grown.
        drift = corrected_step.error.K_place
        K_place, share = (error_before.K_place, _ASTRAY) if np.isnan(drift) else (drift, 1.0)
        of_K = [rate - part for rate, part in zip(errors_of_K, parts) if np.isfinite(rate)]
        of_contact = [part for rate, part in zip(errors_of_K, parts) if np.isfinite(rate)]
        error = replace(
            corrected_step.error,
            K=error_before.K + TOGETHER * 0.5 * cycles * sum(of_K),
            contact=error_before.contact + 0.5 * cycles * sum(of_contact),
            unknown=error_before.unknown + 0.5 * cycles * (2 - len(of_K)),
            K_place=K_place + share * way * float(np.mean(turns) if turns else 0.0),
            grown=error_before.grown + way,
        )
    return replace(
        corrected_step,
        error=replace(
            error,
            rate=rate_error_now.rate,
            rate_contact=rate_error_now.contact,
            turn=rate_error_now.turn,
        ),
    )


def shortfall(rule: GrowthRule, step: Step) -> str:
    """Why a tolerance is not met at a step, and what to do; empty where it is met."""
    error = step.error
    if error is None or rule.tolerance is None or not error.grown > 0:
        return ""
    life = error.life / step.cycles if step.cycles > 0 else 0.0
    path = error.path / error.grown
    if max(life, path) <= rule.tolerance:
        return ""
    steps = error.path - error.K_place
    shares = {
        "steps": max(error.cycles / max(step.cycles, 1e-300), steps / error.grown),
        "K": max(error.K / max(step.cycles, 1e-300), error.K_place / error.grown),
        "contact": error.contact / max(step.cycles, 1e-300),
        "no bar": error.unknown / max(step.cycles, 1e-300),
    }
    worst_name = max(shares, key=lambda name: shares[name])
    parts = ", ".join(f"{name} {share:.1e}" for name, share in shares.items() if share > 0)
    reasons = dict.fromkeys(r for state in step.sif for sif in state for r in sif.reasons if r)
    reasons_in_words = f" ({'; '.join(reasons)})" if reasons and worst_name == "no bar" else ""
    return (
        f"tolerance = {rule.tolerance:g} is not met at step {step.index}: the life is known to "
        f"{life:.1e}, the path to {path:.1e} of the length grown, by {parts}. "
        f"{_REMEDY[worst_name]}{reasons_in_words}"
    )


_SIGNS = (1.0, -1.0)


def _rates_of_moved_K(
    rule: GrowthRule, rates: Rates, bar: Sequence[Floats]
) -> list[list[tuple[Floats, Floats]]]:
    """Directions and rates with each mode of K moved by its bars, up and down."""
    n_modes = rates.sif[0][0].K.shape[1] if rates.sif and rates.sif[0] else 0
    if isinstance(rule.cycle, Spectrum) or rates.free_response is not None:
        return [
            [_moved_rates(rule, rates, bar, mode, sign) for sign in _SIGNS]
            for mode in range(n_modes)
        ]
    # Of a cycle, K of its states is all that changes: all K are asked for at once, side by side.
    inputs = criterion_inputs(rule, rates.problem, rates.response)
    angles, other_angles = [], []
    with collected_warnings([]):  # they are of cracks that nobody has
        for c, crack_input in enumerate(inputs):
            all_K = [
                _moved_K(crack_input.K, bar[c], mode, sign)
                for mode in range(n_modes)
                for sign in _SIGNS
            ]
            cycle_rates = crack_input.rates_of_K(np.concatenate(all_K, axis=1))
            shape = (n_modes, len(_SIGNS), crack_input.K.shape[1])
            angles.append(cycle_rates.angle.reshape(shape))
            other_angles.append(cycle_rates.rate.reshape(shape))
    angle, rate = np.concatenate(angles, axis=2), np.concatenate(other_angles, axis=2)
    return [
        list(zip(*angles_and_rates, strict=True))
        for angles_and_rates in zip(angle, rate, strict=True)
    ]


def _moved_rates(
    rule: GrowthRule, rates: Rates, bar: Sequence[Floats], mode: int, sign: float
) -> tuple[Floats, Floats]:
    """Directions and rates with one mode of K moved by its bars."""

    def moved_by_bars(answers: Answers) -> Answers:
        return tuple(
            tuple(
                _with_K(crack, bar[c][min(k, len(bar[c]) - 1)], mode, sign)
                for c, crack in enumerate(state)
            )
            for k, state in enumerate(answers)
        )

    free_response = None
    if rates.free_response is not None:
        free_response = replace(rates.free_response, sif=moved_by_bars(rates.free_response.sif))
    with collected_warnings([]):  # they are of cracks that nobody has
        response = replace(rates.response, sif=moved_by_bars(rates.sif))
        new_rates = rates_of(rule, rates.problem, response, free_response)
    return new_rates.angle, new_rates.law_rate


def _with_K(sif: SIF, bar: Floats, mode: int, sign: float) -> SIF:
    return replace(sif, K=_moved_K(sif.K, bar, mode, sign))


def _moved_K(K_of_solution: Floats, bar: Floats, mode: int, sign: float) -> Floats:
    K = np.array(K_of_solution)
    K_of_mode = K[..., mode]
    changed_K = K_of_mode + np.where(K_of_mode < 0, -sign, sign) * np.nan_to_num(bar[..., mode])
    if mode == 0:  # what is open does not overlap
        changed_K = np.where(K_of_mode >= 0, np.maximum(changed_K, 0.0), changed_K)
    K[..., mode] = changed_K
    return K


def _log_ratio(rate: Floats, other_rate: Floats) -> Floats:
    """|ln| of the ratio of two rates; at most a whole where one of them is zero or infinite."""
    is_valid = (rate > 0) & np.isfinite(rate) & (other_rate > 0) & np.isfinite(other_rate)
    ratio = np.where(is_valid, other_rate, 1.0) / np.where(is_valid, rate, 1.0)
    return np.asarray(
        np.where(is_valid, np.abs(np.log(ratio)), np.where(rate == other_rate, 0.0, _WHOLE))
    )


def _stacked_K(sif: Answers, c: int, part: Callable[[SIF], Floats]) -> Floats:
    return np.stack([part(state[c]) for state in sif])


def _contact_part(sif: SIF) -> Floats:
    part = None if sif.errors is None else sif.errors.contact
    return np.zeros_like(sif.K) if part is None else part


def _share(part: Floats, bar: Floats) -> Floats:
    """Largest share of contact in the bars of all states `(f,)`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(np.where(bar > 0, part / bar, 0.0))
    return np.asarray(np.clip(share.max(axis=0), 0.0, 1.0))


__all__ = [
    "TOGETHER",
    "RateError",
    "add_K_error",
    "foretold_bars",
    "rate_error",
    "shortfall",
]
