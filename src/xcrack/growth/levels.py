"""Load states of a run: those of a cycle, or levels of a factor, refined where contact bends K."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import call_function, numbers
from xcrack.base.errors import ProblemError
from xcrack.fatigue.criteria import clipped_K, equivalent_K, kink_angle
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.spectrum import Spectrum, distinct_cycles
from xcrack.growth.options import GrowthRule
from xcrack.growth.response import KnownBars, Response, checked_response, respond
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import LoadLevel, Problem
from xcrack.sif.sif import SIF

_MOST = 33
_EXPONENT = 3.0  # of growth, to tell which ranges matter
_GROWTH = 0.25  # of the tolerance: what a middle must change of the growth of a block, to matter
_POINTS = 65  # factors at which ends of cycles are counted for that

Solve = Callable[[Sequence[Any], SolverState], Response]


@dataclass(frozen=True, eq=False)
class LevelTable:
    """K of one crack over the factor.

    Attributes
    ----------
    levels : (n,) array
        Rising.
    K : (n, f, 2 or 3) array, stress √length
    is_smooth : bool
        Between the levels a monotone cubic (Fritsch and Butland 1984), else straight lines.
    """

    levels: Floats
    K: Floats
    is_smooth: bool

    def at(self, factors: Floats) -> Floats:
        """K for some factors `(k,)`: `(k, f, 2 or 3)`; at a level the solved one, to the bit."""
        n = len(self.levels)
        left_level = np.clip(np.searchsorted(self.levels, factors, side="right") - 1, 0, n - 2)
        if self.is_smooth and n > 2:
            result = np.asarray(PchipInterpolator(self.levels, self.K, axis=0)(factors))
        else:
            share = (factors - self.levels[left_level]) / (
                self.levels[left_level + 1] - self.levels[left_level]
            )
            K_left, K_right = self.K[left_level], self.K[left_level + 1]
            result = K_left + share[:, None, None] * (K_right - K_left)
        nearest_level = left_level + (factors == self.levels[left_level + 1])
        is_solved = factors == self.levels[nearest_level]
        result[is_solved] = self.K[nearest_level[is_solved]]
        return result


@dataclass(frozen=True, eq=False)
class LevelResponse:
    """Response to one factor: a row of that to several, with the closed sets that these leave."""

    response: Response
    row: int

    @property
    def sif(self) -> tuple[SIF, ...]:
        """K of each crack."""
        return self.response.sif[self.row]


def refined_response(
    spectrum: Spectrum, first: Floats, solve: Solve, reuse: SolverState
) -> Response:
    """Response at levels that are as dense as K and the growth of a block ask for.

    Parameters
    ----------
    spectrum : Spectrum
    first : (n,) array
        Levels to begin with.
    solve : callable (states, reuse) -> Response
    reuse : SolverState
        Of the step before, with the levels that were wanted there: they are solved at once.

    Notes
    -----
    Each interval is halved once; its halves are halved too where, at the middle of the interval, K
    of some place is off by more than the tolerance, and matters: the middle changes the growth of a
    block there by more than a quarter of the tolerance, of that of the fastest place.
    """
    f_min, f_max = float(first[0]), float(first[-1])
    earlier_levels = [x for x in reuse.levels if f_min <= x <= f_max]
    solved_levels: dict[float, LevelResponse] = {}
    handed_on = reuse

    def solve_at(factors: Sequence[float]) -> SolverState:
        new_levels = sorted(set(factors) - set(solved_levels))
        if not new_levels:
            return handed_on
        start = (
            handed_on
            if not solved_levels
            else _with_nearest_sets(handed_on, solved_levels, new_levels)
        )
        response = solve(states_of(spectrum, np.array(new_levels)), start)
        for row, factor in enumerate(new_levels):
            solved_levels[factor] = LevelResponse(response, row)
        return response.reuse

    handed_on = solve_at([*first.tolist(), *earlier_levels])
    levels = first.tolist()
    is_active = np.ones(len(levels) - 1, dtype=bool)
    if not any(level.response.may_bend for level in solved_levels.values()):
        is_active[:] = (
            False  # no crack has contact in any state: its gaps are lines over the factor
        )
    ends = _ends(spectrum, f_min, f_max)
    while is_active.any() and len(levels) < _MOST:
        numbers = np.nonzero(is_active)[0][: _MOST - len(levels)]
        middle = [0.5 * (levels[k] + levels[k + 1]) for k in numbers]
        handed_on = solve_at(middle)
        is_relevant = _levels_that_matter(spectrum, solved_levels, levels, numbers, middle, ends)
        levels_of_bend = {m for m, is_off in zip(middle, is_relevant) if is_off}
        levels = sorted([*levels, *middle])
        is_active = np.array(
            [a in levels_of_bend or b in levels_of_bend for a, b in zip(levels, levels[1:])]
        )
    responses = [solved_levels[factor] for factor in sorted(solved_levels)]
    return Response(
        tuple(r.response.states[r.row] for r in responses),
        tuple(r.sif for r in responses),
        tuple(r.response.solutions[r.row] for r in responses if r.response.solutions),
        replace(_with_nearest_sets(handed_on, solved_levels, levels), levels=tuple(levels)),
    )


def states_of(spectrum: Spectrum, factors: Floats) -> list[float | LoadLevel]:
    """Load states of some factors."""
    if not spectrum.steady:
        return [float(factor) for factor in factors]
    return [LoadLevel(float(factor), tuple(spectrum.steady)) for factor in factors]


def _with_nearest_sets(
    reuse: SolverState, solved_levels: dict[float, LevelResponse], factors: Sequence[float]
) -> SolverState:
    """The same with the closed sets of the factors that are nearest to some others."""
    known_levels = np.array(sorted(solved_levels))
    nearest_levels = [
        solved_levels[float(known_levels[np.abs(known_levels - factor).argmin()])]
        for factor in factors
    ]
    closed_sets: list[Bools | None] = []
    for c in range(len(reuse.centre)):
        sets = [level.response.reuse.active[c] for level in nearest_levels]
        rows = [part[level.row] for part, level in zip(sets, nearest_levels) if part is not None]
        closed_sets.append(np.stack(rows) if len(rows) == len(nearest_levels) else None)
    centre = tuple(x if a is not None else None for x, a in zip(reuse.centre, closed_sets))
    return replace(reuse, centre=centre, active=tuple(closed_sets))


def _ends(spectrum: Spectrum, f_min: float, f_max: float) -> tuple[Floats, Ints, Floats]:
    """Even factors, both ends of the kinds of cycles among them `(2, p)`, and how often."""
    values, count, _ = distinct_cycles(spectrum.cycles)
    rows = np.rint((values - f_min) / (f_max - f_min) * (_POINTS - 1)).astype(np.int64)
    pairs, number_of_pair = np.unique(rows, axis=0, return_inverse=True)
    number = np.bincount(number_of_pair.reshape(-1), weights=count, minlength=len(pairs)).astype(
        float
    )
    return np.linspace(f_min, f_max, _POINTS), pairs.T, number


def _levels_that_matter(
    spectrum: Spectrum,
    solved_levels: dict[float, LevelResponse],
    levels: Sequence[float],
    numbers: Ints,
    middle: Sequence[float],
    ends: tuple[Floats, Ints, Floats],
) -> Bools:
    """Middles `(k,)` at which K of some place is off, so that growth of a block changes."""
    factors, pairs, count = ends
    all_levels = sorted([*levels, *middle])
    solved_K = [
        np.stack([solved_levels[x].sif[c].K for x in all_levels]) for c in _cracks(solved_levels)
    ]
    relative_error = np.zeros((len(middle), 0))
    change, growth = np.zeros((len(middle), 0)), np.zeros(0)
    is_old = np.isin(all_levels, levels)
    for K in solved_K:
        if K.shape[1] == 0:
            continue
        table_before = LevelTable(np.array(levels), K[is_old], is_smooth=True)
        table_after = LevelTable(np.array(all_levels), K, is_smooth=True)
        K_scale = max(float(np.abs(K).max()), np.finfo(float).tiny)
        error = np.abs(K[~is_old] - table_before.at(np.array(middle))).max(axis=2) / K_scale
        growth_before, growth_after = (
            _growths(ladder, factors, pairs, count) for ladder in (table_before, table_after)
        )
        difference = np.abs(growth_after - growth_before)
        rows = []
        for k in numbers:
            is_inside = (factors > levels[k]) & (factors < levels[k + 1])
            rows.append(difference[is_inside[pairs].any(axis=0)].sum(axis=0))
        relative_error = np.concatenate([relative_error, error], axis=1)
        change = np.concatenate([change, np.array(rows).reshape(len(middle), -1)], axis=1)
        growth = np.concatenate([growth, growth_after.sum(axis=0)])
    least_change = _GROWTH * spectrum.tolerance * float(growth.max(initial=0.0))
    return np.asarray(((relative_error > spectrum.tolerance) & (change > least_change)).any(axis=1))


def _growths(ladder: LevelTable, factors: Floats, pairs: Ints, count: Floats) -> Floats:
    """Growth of each kind of cycle at each place `(p, f)`, but for a constant."""
    K = clipped_K(ladder.at(factors))
    dK = np.linalg.norm(K[pairs[1]] - K[pairs[0]], axis=2)
    return np.asarray(count[:, None] * dK**_EXPONENT)


def _cracks(solved_levels: dict[float, LevelResponse]) -> range:
    return range(len(next(iter(solved_levels.values())).sif))


# K over the factor of a load: solved at some levels, interpolated between them.

_FIRST = 5  # levels before the first look at what lies between them


def respond_to_levels(
    problem: Problem, spectrum: Spectrum, solve: Solve, reuse: SolverState
) -> Response:
    """Response at the levels of a spectrum, in the order of their factors.

    Parameters
    ----------
    problem : Problem
    spectrum : Spectrum
        Of factors or rows.
    solve : callable (states, reuse) -> Response
    reuse : SolverState
        Of the step before.
    """
    f_min, f_max = spectrum.extremes
    all_factors = np.unique([spectrum.cycles["min"], spectrum.cycles["max"]])
    is_exact = is_homogeneous(problem, spectrum) or problem.contact == "off"
    if spectrum.levels != "auto":
        factors = np.linspace(f_min, f_max, int(spectrum.levels))
    elif is_exact:
        factors = np.array([f_min, f_max])
    elif len(all_factors) <= _FIRST:
        factors, is_exact = all_factors, True  # all that is asked for is solved
    else:
        factors = np.linspace(f_min, f_max, _FIRST)
    if is_exact or spectrum.levels != "auto":
        return solve(states_of(spectrum, factors), reuse)
    return refined_response(spectrum, factors, solve, reuse)


def ladders(problem: Problem, spectrum: Spectrum, response: Response) -> list[LevelTable]:
    """Ladder of each crack, from K at the levels that were solved."""
    factors, sif = response.factors, response.sif
    is_linear = len(factors) == 2
    origin = is_linear and is_homogeneous(problem, spectrum) and factors[0] < 0 < factors[1]
    result = []
    for c in range(len(sif[0])):
        K = np.stack([state[c].K for state in sif])
        if origin:  # K is in proportion to the factor, on both sides with a slope of its own
            K = np.stack([K[0], np.zeros_like(K[0]), K[1]])
            result.append(LevelTable(np.array([factors[0], 0.0, factors[1]]), K, is_smooth=False))
        else:
            result.append(LevelTable(factors, K, is_smooth=not is_linear))
    return result


def is_homogeneous(problem: Problem, spectrum: Spectrum) -> bool:
    """Whether twice the factor gives twice the answer, with contact too."""
    return not spectrum.steady and not any(load.is_steady for load in problem.loads)


# Response of a scene to all load states of a run.


def respond_to_states(
    rule: GrowthRule,
    problem: Problem,
    reuse: SolverState,
    bars: bool = False,
    load_factor: float = 1.0,
    known_bars: KnownBars | None = None,
) -> Response:
    """Response of a scene to all load states of a run; to the levels of a spectrum of factors.

    With a factor on its loads its states are named as without. `known_bars` as of `respond`.
    """
    spectrum = rule.cycle if isinstance(rule.cycle, Spectrum) else None

    def solve(names: Sequence[Any], reuse: SolverState) -> Response:
        states = names
        if load_factor != 1:
            states = [
                replace(state, factor=load_factor * state.factor)
                if isinstance(state, LoadLevel)
                else load_factor * state
                for state in names
            ]
        if rule.response is None:
            response = respond(
                problem, states, reuse, bars, solver=rule.solver, known_bars=known_bars
            )
        else:
            response = _from_elsewhere(rule, problem, states, reuse, bars, known_bars)
        if load_factor != 1:
            response = replace(response, states=tuple(names), load_factor=load_factor)
        if spectrum is not None and response.solutions:
            refuse_friction(problem, response.solutions)
        return response

    if spectrum is not None and spectrum.states is None:
        return respond_to_levels(problem, spectrum, solve, reuse)
    return solve(rule.cycle.load_states, reuse)


def _from_elsewhere(
    rule: GrowthRule,
    problem: Problem,
    states: Sequence[Any],
    reuse: SolverState,
    bars: bool,
    known_bars: KnownBars | None,
) -> Response:
    """What the function of a user for K returns; it is asked for bars where none are known."""

    def response_with(bars: bool) -> Response:
        assert rule.response is not None
        result = call_function(
            rule.response, "the response of a step", problem, tuple(states), reuse, bars
        )
        return checked_response(result, problem, states)

    if bars and known_bars is not None:
        response = response_with(False)
        sif = known_bars(response.sif)
        if sif is not None:
            return replace(response, sif=sif, has_known_bars=True)
    return response_with(bars)


def respond_under_program(
    rule: GrowthRule, problem: Problem, reuse: SolverState, bars: bool, N: float
) -> Response:
    """Response of a scene under loads that change as the crack grows, after some cycles.

    Where they are to give some K, those of the scene are solved, and all that follows is scaled.
    """
    if rule.load_program is None or not rule.load_program.needs_K:
        factor = load_factor_at(rule, problem, N)
        return respond_to_states(rule, problem, reuse, bars, factor)
    response = respond_to_states(rule, problem, reuse, bars)
    nu, largest_K = problem.elasticity.poisson, 0.0
    for of_crack in zip(*response.sif, strict=True):
        K = clipped_K(np.stack([sif.K for sif in of_crack]))
        largest_K = max(largest_K, float(equivalent_K(K, kink_angle(K), nu).max(initial=0.0)))
    return response.scaled(load_factor_at(rule, problem, N, largest_K))


def load_factor_at(rule: GrowthRule, problem: Problem, N: float, K_max: float = np.nan) -> float:
    """Factor on the loads of a scene after some cycles; of one that gives K, with K under them."""
    assert rule.load_program is not None
    tips = [max(crack.n_tips, 1) if problem.mesh.dim < 3 else 1 for crack in problem.placed]
    a = max(size / n for size, n in zip(problem.sizes, tips, strict=True))
    values = rule.load_program.factors(np.array([a]), np.array([N]), np.array([K_max]))
    return float(numbers(values, "the factor of load_program", (1,))[0])


def refuse_friction(problem: Problem, solutions: Sequence[Solution]) -> None:
    """Raise where faces rub under a spectrum: K depends on the path, not on the factor alone."""
    for c, mu in enumerate(problem.frictions):
        if mu and has_slip(solutions[0], c):
            raise ProblemError(
                f"grow: a Spectrum with friction on crack {c}, whose faces press: K then depends "
                "on the loads before, and a spectrum takes its cycles one by one. Give "
                "Cycle(states=[...]), or friction=0."
            )


def has_slip(solution: Solution, c: int) -> bool:
    """Whether the faces of a crack rub."""
    contact = solution.contact[c]
    return contact is not None and contact.shear is not None


def states_and_levels(
    cycle: Cycle | Spectrum, response: Response
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Names of the load states that were solved, and their factors under a spectrum of factors.

    The states of a ``Cycle(min, max)`` are called so, and so are the lowest and the highest level
    of a spectrum, with the others numbered between them; states in a list have their number.
    """
    n = len(response.sif)
    if cycle.states is not None:
        return tuple(map(str, range(n))), ()
    levels = tuple(response.factors.tolist()) if isinstance(cycle, Spectrum) else ()
    return (("min", *map(str, range(1, n - 1)), "max") if n > 1 else ("max",)), levels


__all__ = [
    "LevelTable",
    "Solve",
    "has_slip",
    "is_homogeneous",
    "ladders",
    "load_factor_at",
    "refined_response",
    "respond_to_levels",
    "respond_to_states",
    "respond_under_program",
    "states_and_levels",
    "states_of",
]
