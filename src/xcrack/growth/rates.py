"""From K of the load states to direction, range, ratio and rate at each station of the cracks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from xcrack.analysis.solution import mean_stress
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.errors import ProblemError, warn
from xcrack.crack.crack import Crack
from xcrack.crack.stations import GEOMETRY, Stations
from xcrack.fatigue.checks import evaluate_criterion, evaluate_law, law_exponent
from xcrack.fatigue.criteria import clipped_K, kink_angle, local_equivalent_K, nominal_range
from xcrack.fatigue.law import Law, LawSets, Names
from xcrack.fatigue.retardation import BlockCycles, RetardationSets
from xcrack.fatigue.spectrum import Spectrum, closed_cycles, distinct_cycles
from xcrack.growth.levels import has_slip, ladders, respond_to_states
from xcrack.growth.options import GrowthRule
from xcrack.growth.response import Answers, Response
from xcrack.growth.stations import PerCrack, directions, solved_stations, split
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import Problem
from xcrack.sif.sif import at_stations

_ROUND_OFF = 1e-5  # range over the largest K_eq below which it is the error of a stuck crack
_LEFT_OUT = 1e-3  # share of the growth of a block
_CHUNK = 20_000  # stations times cycles that are rated at once


@dataclass(frozen=True, eq=False)
class CycleRates:
    """What criterion and law say of K at the f stations of a crack.

    Attributes
    ----------
    angle : (f,) array, rad
        Of the direction of growth in the frames.
    dK_eq : (f,) array, stress √length
        Of a block that of its largest cycle.
    R : (f,) array
        Ratio of that cycle.
    rate : (f,) array, length/cycle
        Before a threshold of the run; that of a block is the sum of its cycles, those above it.
    R_range : (f, 2) array
        Smallest and largest ratio of all cycles.
    """

    angle: Floats
    dK_eq: Floats
    R: Floats
    rate: Floats
    R_range: Floats


@dataclass(frozen=True, eq=False)
class CriterionInput:
    """K of one crack as criterion and law see it, and what they say of K of this shape.

    Attributes
    ----------
    K : (s, f, 2 or 3) array, stress √length
        Of the load states, or of both ends of each kind of cycle of a spectrum.
    rates_of_K : callable
        K -> CycleRates; of a cycle several K side by side too, `(s, k f, 2 or 3)`.
    angle_of_K : callable
        K -> direction alone.
    """

    K: Floats
    rates_of_K: Callable[[Floats], CycleRates]
    angle_of_K: Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Rates:
    """Directions and rates at all n stations at which K of a problem was solved.

    Attributes
    ----------
    problem : Problem
        With the cracks as they were advanced; `cracks` are what became of them in the body.
    response : Response
        Of all load states; its K is the best that is known.
    stations : Stations
        Of the response.
    angle, dK_eq, R : (n,) arrays
        As of `CycleRates`.
    law_rate, rate : (n,) arrays, length/cycle
        Growth before and after the threshold of the run.
    R_range : (n, 2) array
        Smallest and largest ratio of the cycles of a block.
    free_response : Response, optional
        Without contact, where the law asks for it.
    """

    problem: Problem
    response: Response
    stations: Stations
    angle: Floats
    dK_eq: Floats
    R: Floats
    law_rate: Floats
    rate: Floats
    R_range: Floats
    free_response: Response | None = None

    @property
    def sif(self) -> Answers:
        """K of each state and crack."""
        return self.response.sif

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """The cracks in the body."""
        return self.problem.placed

    @cached_property
    def counts(self) -> list[int]:
        """Number of stations of each crack."""
        return [len(sif.x) for sif in self.sif[0]]

    def split(self, values: Floats) -> PerCrack:
        """Values at the stations as one array a crack."""
        return split(values, self.counts)

    @cached_property
    def K(self) -> Floats:
        """Factors in all states `(s, n, 2 or 3)`, stress √length."""
        return at_stations(self.sif, "K")

    @cached_property
    def T(self) -> Floats:
        """Stress along the faces in all states `(s, n)`."""
        return at_stations(self.sif, "T")

    @property
    def size_of_law(self) -> Floats:
        """Crack size that a law is given at each station `(n,)`, length."""
        sizes, dim = self.problem.sizes, self.problem.mesh.dim
        parts = [law_size(dim, a, n) for a, n in zip(sizes, self.counts, strict=True)]
        return np.concatenate([np.zeros(0), *parts])

    @property
    def direction(self) -> Floats:
        """Unit vectors of growth `(n, d)`."""
        return directions(self.stations.frame, self.angle)

    def exponent(self, law: Law | LawSets) -> float:
        """Slope of a law at the largest range."""
        names = self.problem.elasticity.names_at(self.stations.x)
        return law_exponent(law, self.dK_eq, self.R, names)

    @property
    def largest_rate(self) -> float:
        """Largest rate, length/cycle."""
        return float(self.rate.max(initial=0.0))


def rates_of(
    rule: GrowthRule, problem: Problem, response: Response, free_response: Response | None = None
) -> Rates:
    """Ask criterion and law of a run what K of all load states means.

    Parameters
    ----------
    rule : GrowthRule
    problem : Problem
        With the cracks that K belongs to.
    response : Response
        Of all load states; of a spectrum its factors are the levels.
    free_response : Response, optional
        As of `response_without_contact`, where it is known already.
    """
    _check_choice(rule, response.sif)
    if free_response is None:
        free_response = response_without_contact(rule, problem, response)
    inputs = criterion_inputs(rule, problem, response, free_response)
    parts = [crack_input.rates_of_K(crack_input.K) for crack_input in inputs]
    angle, dK_eq, R, law_rate, R_range = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("angle", "dK_eq", "R", "rate", "R_range")
    )
    stations = solved_stations(response.sif[0])
    if response.solutions and any(problem.frictions):
        is_at_rest = _is_locked(problem, response, dK_eq)
        dK_eq, law_rate = np.where(is_at_rest, 0.0, dK_eq), np.where(is_at_rest, 0.0, law_rate)
    is_at_rest = _at_rest(problem, response, dK_eq)
    dK_eq, law_rate = np.where(is_at_rest, 0.0, dK_eq), np.where(is_at_rest, 0.0, law_rate)
    rate = np.where(dK_eq < rule.threshold, 0.0, law_rate)
    return Rates(
        problem, response, stations, angle, dK_eq, R, law_rate, rate, R_range, free_response
    )


def rates_by_law_of(rule: GrowthRule, problem: Problem, response: Response, sets: Ints) -> Floats:
    """Rates before the threshold at stations `(n,)` by the laws of given materials.

    Parameters
    ----------
    rule : GrowthRule
        Without a law that asks for K without contact.
    problem : Problem
    response : Response
        Of all states.
    sets : (n,) array of int
        Numbers of the materials.
    """
    names_of_sets = np.array([name for name, _ in problem.elasticity.named])[sets]
    names = np.split(names_of_sets, np.cumsum([len(sif.x) for sif in response.sif[0]])[:-1])
    inputs = criterion_inputs(rule, problem, response, names=names)
    return np.concatenate([crack_input.rates_of_K(crack_input.K).rate for crack_input in inputs])


def response_without_contact(
    rule: GrowthRule, problem: Problem, response: Response
) -> Response | None:
    """Response of the scene in which faces may overlap; None where no law asks for it."""
    if getattr(rule.law, "ratio", None) != "nominal":
        return None
    if problem.contact == "off":
        return response
    factor = response.load_factor
    scene = replace(problem, contact="off")
    return respond_to_states(rule, scene, SolverState(), load_factor=factor)


def criterion_inputs(
    rule: GrowthRule,
    problem: Problem,
    response: Response,
    free_response: Response | None = None,
    names: Sequence[Names] | None = None,
) -> list[CriterionInput]:
    """What criterion and law are asked about each crack.

    Parameters
    ----------
    rule : GrowthRule
    problem : Problem
    response : Response
        Of all states.
    free_response : Response, optional
        Without contact, for a law with nominal R.
    names : sequence of (f,) arrays of str, optional
        Materials whose laws count, one array a crack: those that the stations are in.
    """
    if names is None:
        names = [problem.elasticity.names_at(sif.x) for sif in response.sif[0]]
    of_rule = _inputs_of_blocks if isinstance(rule.cycle, Spectrum) else _inputs_of_cycle
    return of_rule(rule, problem, response, free_response, names)


def _inputs_of_cycle(
    rule: GrowthRule,
    problem: Problem,
    response: Response,
    free_response: Response | None,
    materials: Sequence[Names],
) -> list[CriterionInput]:
    place = GEOMETRY[problem.mesh.dim].station

    def of_crack(c: int) -> CriterionInput:
        nu = problem.elasticity.poisson_at(response.sif[0][c].x)
        K_of_states = np.stack([state[c].K for state in response.sif])
        a = law_size(problem.mesh.dim, problem.sizes[c], K_of_states.shape[1])
        names = materials[c]

        def rates_of_K(K: Floats) -> CycleRates:
            times = K.shape[1] // max(len(a), 1)  # several K side by side at all stations
            own_nu = np.tile(nu, times) if isinstance(nu, np.ndarray) else nu
            angle, dK, R = evaluate_criterion(rule.criterion, K, own_nu, c, place)
            if free_response is not None:
                dK, R = nominal_range(
                    np.stack([state[c].K for state in free_response.sif]), angle, nu
                )
            rate = evaluate_law(rule.law, dK, R, c, place, np.tile(a, times), np.tile(names, times))
            return CycleRates(angle, dK, R, rate, np.stack([R, R], axis=1))

        def angle_of_K(K: Floats) -> Floats:
            return evaluate_criterion(rule.criterion, K, nu, c, place)[0]

        return CriterionInput(K_of_states, rates_of_K, angle_of_K)

    return [of_crack(c) for c in range(len(problem.placed))]


def _inputs_of_blocks(
    rule: GrowthRule,
    problem: Problem,
    response: Response,
    free_response: Response | None,
    materials: Sequence[Names],
) -> list[CriterionInput]:
    place = GEOMETRY[problem.mesh.dim].station
    kinds = pairs_of(rule, problem, response)
    nominal_pairs = (
        [None] * len(kinds) if free_response is None else pairs_of(rule, problem, free_response)
    )

    def of_crack(c: int, pairs: RangePairs, free_pairs: RangePairs | None) -> CriterionInput:
        shape, nu = pairs.K.shape, problem.elasticity.poisson_at(response.sif[0][c].x)
        a = law_size(problem.mesh.dim, problem.sizes[c], shape[2])
        names = materials[c]

        def rates_of_K(K: Floats) -> CycleRates:
            cycles = replace(pairs, K=K.reshape(shape))
            return block_of(
                rates_by_kind(rule, cycles, nu, c, place, a, free_pairs, names), pairs.count
            )

        def angle_of_K(K: Floats) -> Floats:  # the mean of the cycles' directions needs their rates
            return rates_of_K(K).angle

        flat_shape = (shape[0] * shape[1], *shape[2:])  # -1 means nothing where no tip is left
        return CriterionInput(pairs.K.reshape(flat_shape), rates_of_K, angle_of_K)

    return [of_crack(c, *pair) for c, pair in enumerate(zip(kinds, nominal_pairs, strict=True))]


def law_size(dim: int, size: float, n: int) -> Floats:
    """Crack size that a law is given at each of n stations of a crack `(n,)`, length.

    In 2D the length inside the body over the number of tips: half of it for a crack with two. In 3D
    the area over the length of the fronts, which for a disc is half of its radius.
    """
    tips = max(n, 1) if dim < 3 else 1
    return np.full(n, size / tips)


# Ends that have no range but that of round-off.

_FAINT = 1e-5  # of K by the mean energy of the body


def _at_rest(problem: Problem, response: Response, dK_eq: Floats) -> Bools:
    """Stations that are closed in all states, with a range that is round-off `(n,)`.

    A crack along the axis of a pressed body has K = 0: what a solve finds of it is its error, and
    a crack that grew on that would need 1e20 cycles, and turn to and fro.
    """
    is_closed = ~np.any(at_stations(response.sif, "K_I") > 0, axis=0)
    if not response.solutions or not is_closed.any():
        return np.zeros(len(dK_eq), dtype=bool)
    stress = mean_stress(response.solutions)
    dim, sizes = problem.mesh.dim, zip(problem.sizes, response.sif[0], strict=True)
    size = np.concatenate([law_size(dim, a, len(sif.x)) for a, sif in sizes])
    return np.asarray(is_closed & (dK_eq <= _FAINT * stress * np.sqrt(np.pi * size)))


# Ends that friction locks.


def _is_locked(problem: Problem, response: Response, dK_eq: Floats) -> Bools:
    """Stations beside which the faces stick in every state `(n,)`.

    K does not change there: what is left of its range is the error of quadrature, which a crack
    must not grow on.
    """
    solutions, sif = response.solutions, response.sif
    parts = [np.zeros(len(s.x), dtype=bool) for s in sif[0]]
    rubbing_cracks = [c for c in range(len(parts)) if has_slip(solutions[0], c)]
    if rubbing_cracks:
        nu = problem.elasticity.poisson_at(np.concatenate([s.x for s in sif[0]]))
        K = clipped_K(at_stations(sif, "K"))
        K_scale = float(local_equivalent_K(K, kink_angle(K), nu).max(initial=0.0))
        split_ranges = split(dK_eq, [len(part) for part in parts])
    for c in rubbing_cracks:
        lips = solutions[0].lips[c]
        nearest_points = [int(np.argmin(np.linalg.norm(lips.x - x, axis=1))) for x in sif[0][c].x]
        is_stuck_in_states = [s.contact[c].stuck[nearest_points] for s in solutions]  # type: ignore[union-attr,index]
        parts[c] = np.all(is_stuck_in_states, axis=0) | (split_ranges[c] <= _ROUND_OFF * K_scale)
    return np.concatenate(parts)


# The ratio R < 0, which may mean two things.


def check_choice(law: Law | LawSets, ratio: float | None) -> None:
    """Refuse a cycle with R < 0 under a law that must know how R is meant, and was not told."""
    if ratio is not None and ratio < 0 and _must_choose(law):
        raise ProblemError(_choice(f"the cycle has R = {ratio:.4g}", law))


def _must_choose(law: Law | LawSets) -> bool:
    """Whether R < 0 may mean two things to a law, and it does not say which."""
    return getattr(law, "ratio", "contact") is None and bool(law.knows_negative_ratios)  # type: ignore[union-attr]


def _check_choice(rule: GrowthRule, sif: Answers) -> None:
    """The same, where no factors say R: a tip that is closed in some state has R < 0."""
    if rule.cycle.ratio is None and _must_choose(rule.law):
        has_closed_front = any(crack.closed.any() for state in sif for crack in state)
        if has_closed_front:
            raise ProblemError(_choice("a load state closes a tip, so that R < 0", rule.law))


def _choice(reason: str, law: Law | LawSets) -> str:
    name = type(law).__name__
    return (
        f"{reason}, and {name} does not say which K its constants belong to: give {name}(..., "
        'ratio="contact") for K as computed with contact, where a closed tip has K = 0, or '
        'ratio="nominal" for constants that were fitted with K_min < 0. The rates differ by up to '
        "a factor of 3."
    )


# A block of cycles: each cycle is rated, and their growth added.


@dataclass(frozen=True, eq=False)
class RangePairs:
    """Kinds of cycles at the stations of one crack.

    Attributes
    ----------
    K : (2, p, f, 2 or 3) array, stress √length
        At both ends of each kind of cycle.
    count : (p, f) array
        How often a block has it.
    """

    K: Floats
    count: Floats


@dataclass(frozen=True, eq=False)
class PairRates:
    """Every kind of cycle, rated at each station `(p, f)`: rad, stress √length, length/cycle."""

    angle: Floats
    dK: Floats
    R: Floats
    rate: Floats


def pairs_of(rule: GrowthRule, problem: Problem, response: Response) -> list[RangePairs]:
    """Kinds of cycles of each crack under the spectrum of a run."""
    spectrum = rule.cycle
    if not isinstance(spectrum, Spectrum):
        return []
    if spectrum.states is not None:
        nu = [problem.elasticity.poisson_at(sif.x) for sif in response.sif[0]]
        all_K = [np.stack([sif.K for sif in crack]) for crack in zip(*response.sif)]
        return [pairs_of_states(K, spectrum, ratio) for K, ratio in zip(all_K, nu, strict=True)]
    values, count, _ = distinct_cycles(spectrum.cycles)
    result = []
    for ladder in ladders(problem, spectrum, response):
        K = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
        result.append(RangePairs(K, np.repeat(count[:, None], K.shape[2], axis=1)))
    return result


def pairs_of_states(K: Floats, spectrum: Spectrum, nu: float | Floats) -> RangePairs:
    """Cycles between named states, counted at each station by K_eq of the state's own direction."""
    opening = clipped_K(K)
    severity = local_equivalent_K(opening, kink_angle(opening), nu)
    n, f = severity.shape
    count = np.zeros((n, n, f))
    for place in range(f):
        for begin, end in closed_cycles(severity[spectrum.sequence, place]):
            i, j = sorted((int(spectrum.sequence[begin]), int(spectrum.sequence[end])))
            count[i, j, place] += 1
    first_state, second_state = np.nonzero(count.any(axis=2))
    if not len(first_state):  # no station feels a difference
        first_state, second_state = np.array([0]), np.array([1])
    return RangePairs(np.stack([K[first_state], K[second_state]]), count[first_state, second_state])


def rates_by_kind(
    rule: GrowthRule,
    pairs: RangePairs,
    nu: float | Floats,
    c: int,
    place: str,
    a: Floats,
    nominal_pairs: RangePairs | None = None,
    names: Names | None = None,
) -> PairRates:
    """Ask criterion and law about every kind of cycle; they see them as stations of one front.

    Parameters
    ----------
    rule : GrowthRule
    pairs : RangePairs
    nu : float or (f,) array
    c : int
        Number of the crack.
    place : str
        What a station is called in messages.
    a : (f,) array, length
        Crack size at each station.
    nominal_pairs : RangePairs, optional
        The same without contact, for a law with nominal R.
    names : (f,) array of str, optional
        Of the materials at the stations.
    """
    _, p, f, modes = pairs.K.shape
    parts = []
    rows = max(1, _CHUNK // max(f, 1))
    for begin in range(0, p, rows):
        K = pairs.K[:, begin : begin + rows]
        n = K.shape[1]
        of_row = np.tile(nu, n) if isinstance(nu, np.ndarray) else nu
        angle, dK, R = evaluate_criterion(
            rule.criterion, K.reshape(2, n * f, modes), of_row, c, f"{place} of a cycle"
        )
        if nominal_pairs is not None:
            K_without_contact = nominal_pairs.K[:, begin : begin + rows].reshape(2, n * f, modes)
            dK, R = nominal_range(K_without_contact, angle, of_row)
        of_rows = None if names is None else np.tile(names, n)
        rate = evaluate_law(rule.law, dK, R, c, f"{place} of a cycle", np.tile(a, n), of_rows)
        rate = np.where(dK < rule.threshold, 0.0, rate)
        parts.append(np.stack([angle, dK, R, rate]).reshape(4, n, f))
    return PairRates(*np.concatenate(parts, axis=1)) if parts else PairRates(*np.zeros((4, p, f)))


def block_of(kinds: PairRates, count: Floats) -> CycleRates:
    """Direction, range, ratio and growth of a block at each station.

    Parameters
    ----------
    kinds : PairRates
    count : (p, f) array

    Returns
    -------
    CycleRates
        Range and ratio are those of the cycle with the largest range; the direction is the mean of
        the cycles' directions, each weighted with its growth. One cycle stays as it is.
    """
    counts = count > 0
    growth = np.where(counts, count * kinds.rate, 0.0)
    dK_of_rows = np.where(counts, kinds.dK, -1.0)
    largest_row, place = dK_of_rows.argmax(axis=0), np.arange(count.shape[1])
    dK, R, angle = (x[largest_row, place] for x in (kinds.dK, kinds.R, kinds.angle))
    R_of_rows = np.where(counts, kinds.R, R)
    R_range = np.stack([R_of_rows.min(axis=0), R_of_rows.max(axis=0)], axis=1)
    rate = growth.sum(axis=0)
    mean = np.isfinite(rate) & (rate > 0) & ((growth > 0).sum(axis=0) > 1)
    with np.errstate(invalid="ignore"):
        x, y = (
            np.where(mean, (growth * f(kinds.angle)).sum(axis=0), 1.0) for f in (np.cos, np.sin)
        )
    angle = np.where(mean, np.arctan2(y, x) + 0.0, angle)
    return CycleRates(angle, dK, R, rate, R_range)


def warn_of_left_out(rule: GrowthRule, response: Response) -> None:
    """Say how much growth a spectrum leaves out with its small cycles, if it is worth a word."""
    share_left_out = left_out_share(rule, rule.problem, response)
    if share_left_out > _LEFT_OUT:
        warn(
            f"the cycles that the spectrum leaves out are {share_left_out:.2%} of the growth of a "
            "block at the place where they matter most, before the first step: lives are too long "
            "by as much. Omit less to keep them."
        )


def left_out_share(rule: GrowthRule, problem: Problem, response: Response) -> float:
    """Growth of the cycles that a spectrum leaves out, over that of those it has; the worst place.

    inf where only they would let a place grow.
    """
    spectrum = rule.cycle
    if not isinstance(spectrum, Spectrum) or spectrum.states is not None:
        return 0.0
    ranges_left_out = spectrum.left_out
    if not len(ranges_left_out) or spectrum.least_range == 0:
        return 0.0
    values, count, _ = distinct_cycles(ranges_left_out)
    largest_share = 0.0
    pairs_of_cracks = pairs_of(rule, problem, response)
    for c, ladder in enumerate(ladders(problem, spectrum, response)):
        K = np.stack([ladder.at(values[:, 0]), ladder.at(values[:, 1])])
        f = K.shape[2]
        if f == 0:
            continue
        nu = problem.elasticity.poisson_at(response.sif[0][c].x)
        names = problem.elasticity.names_at(response.sif[0][c].x)
        a = np.ones(f)
        small_pairs = RangePairs(K, np.repeat(count[:, None], f, axis=1))
        growth = [
            block_of(rates_by_kind(rule, pairs, nu, c, "tip", a, names=names), pairs.count).rate
            for pairs in (small_pairs, pairs_of_cracks[c])
        ]
        rows_that_grow = np.nonzero(growth[0])[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = growth[0][rows_that_grow] / growth[1][rows_that_grow]
        largest_share = max(largest_share, float(ratio.max(initial=0.0)))
    return largest_share


# The kinds of cycles of a block, for growth cycle by cycle.


def block_order(rule: GrowthRule) -> Ints:
    """Kinds of the cycles of a block, in time `(c,)`, of a run with retardation."""
    assert isinstance(rule.cycle, Spectrum)
    return distinct_cycles(rule.cycle.cycles)[2]


def kinds_of(rule: GrowthRule, rates: Rates) -> BlockCycles | None:
    """Range and ratio of each kind of cycle at all stations, of a single solve.

    None without retardation.
    """
    if rule.retardation is None:
        return None
    problem = rates.problem
    place, parts = GEOMETRY[problem.mesh.dim].station, []
    for c, pairs in enumerate(pairs_of(rule, problem, rates.response)):
        a = law_size(problem.mesh.dim, problem.sizes[c], pairs.K.shape[2])
        x = rates.response.sif[0][c].x
        nu, names = problem.elasticity.poisson_at(x), problem.elasticity.names_at(x)
        kinds = rates_by_kind(rule, pairs, nu, c, place, a, names=names)
        parts.append((kinds.dK.T[None], kinds.R.T[None], a[None]))
    has_sets = isinstance(rule.law, LawSets) or isinstance(rule.retardation, RetardationSets)
    sets = problem.elasticity.sets_at(rates.stations.x) if has_sets else None
    dK, R, size = (
        np.ascontiguousarray(np.concatenate(x, axis=1)) for x in zip(*parts, strict=True)
    )
    return BlockCycles(dK, R, size, sets)


__all__ = [
    "CriterionInput",
    "CycleRates",
    "PairRates",
    "RangePairs",
    "Rates",
    "block_of",
    "block_order",
    "check_choice",
    "criterion_inputs",
    "kinds_of",
    "law_size",
    "left_out_share",
    "pairs_of",
    "pairs_of_states",
    "rates_by_kind",
    "rates_by_law_of",
    "rates_of",
    "response_without_contact",
    "warn_of_left_out",
]
