"""K of the load states of a scene: solved, or from elsewhere.

`grow` asks a function ``response(problem, states, reuse, bars)`` in each step; `respond` is the one
that solves. Another one takes K from a handbook, a table or a test.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.analysis.solution import Solution
from xcrack.analysis.solve import solve_states
from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import (
    build_without_checks,
    copy_without_checks,
    entries,
    flag,
    number,
    numbers,
    value_text,
)
from xcrack.base.errors import ProblemError, collected_warnings, warn
from xcrack.linalg.engine import SolverState
from xcrack.model.problem import LoadLevel, Problem, check_problem
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensities

Answers = tuple[tuple[SIF, ...], ...]


def best_K(sif: Answers) -> Answers:
    """K of all states and cracks, replaced by the best one wherever that is known."""
    return tuple(tuple(_best_of_crack(crack) for crack in state) for state in sif)


def _best_of_crack(sif: SIF) -> SIF:
    has_best = sif.has_best
    return replace(sif, K=np.where(has_best[:, None], sif.best, sif.K)) if has_best.any() else sif


@dataclass(frozen=True, eq=False)
class Response:
    """K of all cracks in some load states.

    Attributes
    ----------
    states : tuple of load states
        Factors of the loads, or lists of loads.
    sif : tuple of tuple of SIF
        ``sif[state][crack]``.
    solutions : tuple of Solution
        One a state; empty where K is from elsewhere.
    reuse : SolverState
        What the next solve starts from.
    load_factor : float
        On the loads beside that of a state, where they change as the crack grows.
    has_known_bars : bool
        Whether the bars of K are those that were known beforehand, see `respond`.

    Raises
    ------
    ProblemError
        Parts of other types, or other numbers of states than of rows of K.
    """

    states: tuple[Any, ...]
    sif: Answers
    solutions: tuple[Solution, ...] = ()
    reuse: SolverState = field(default_factory=SolverState)
    load_factor: float = 1.0
    has_known_bars: bool = False

    def __post_init__(self) -> None:
        sif = tuple(entries(row, "Response: sif") for row in entries(self.sif, "Response: sif"))
        object.__setattr__(self, "sif", sif)
        for name in ("states", "solutions"):
            object.__setattr__(self, name, entries(getattr(self, name), f"Response: {name}"))
        if not all(isinstance(answer, SIF) for row in sif for answer in row):
            raise ProblemError(
                f"Response: sif = {value_text(self.sif)}: give a row of SIF a state."
            )
        if not all(isinstance(solution, Solution) for solution in self.solutions):
            raise ProblemError(
                f"Response: solutions = {value_text(self.solutions)}: give those of solve."
            )
        if not isinstance(self.reuse, SolverState):
            raise ProblemError(
                f"Response: reuse = {value_text(self.reuse)}: give that of a Response."
            )
        number(self.load_factor, "Response: load_factor", above=0)
        flag(self.has_known_bars, "Response: has_known_bars")
        counts = {len(self.states), len(self.sif), len(self.solutions or self.sif)}
        if len(counts) > 1:
            raise ProblemError(
                f"Response: {len(self.states)} states with {len(self.sif)} rows of K and "
                f"{len(self.solutions)} solutions: give as many of each, or no solutions."
            )

    @property
    def factors(self) -> Floats:
        """Factor of each state of a spectrum."""
        values = [s.factor if isinstance(s, LoadLevel) else s for s in self.states]
        return np.array(values, dtype=float)

    @property
    def may_bend(self) -> bool:
        """Whether K may be no straight line over the factor: faces press, or nobody knows."""
        if not self.solutions:
            return True
        return any(part is not None for solution in self.solutions for part in solution.contact)

    def scaled(self, factor: float) -> "Response":
        """The response to loads times a factor, of a scene in which all is in proportion."""
        return replace(
            self,
            sif=tuple(tuple(answer.scaled(factor) for answer in state) for state in self.sif),
            solutions=tuple(solution.scaled(factor) for solution in self.solutions),
            load_factor=factor * self.load_factor,
        )

    @classmethod
    def of_K(
        cls, problem: Problem, states: Sequence[Any], K: ArrayLike, T: ArrayLike | None = None
    ) -> "Response":
        """K as numbers, at the stations of a problem.

        Parameters
        ----------
        problem : Problem
            As `response` was given it: with the cracks of the step.
        states : sequence of load states
            As `response` was given them.
        K : (s, n, 2 or 3) array, stress √length
            Of s states at the n stations of `problem.stations`: columns I, II and in 3D III.
        T : (s, n) array, stress, optional
            Stress along the faces; 0 where it is left out.

        Raises
        ------
        ProblemError
            Arrays of another shape, or with numbers that are not finite.
        """
        check_problem(problem, "Response.of_K")
        states = entries(states, "Response.of_K: states")
        stations, d = problem.stations, problem.mesh.dim
        s, n = len(states), len(stations)
        try:
            values = numbers(K, "Response.of_K: K", (s, n, d))
            stress = np.zeros((s, n)) if T is None else numbers(T, "Response.of_K: T", (s, n))
        except ProblemError as error:
            raise ProblemError(
                f"{error} There are {s} states and {n} stations: see problem.stations."
            ) from None
        result = []
        for k in range(s):
            row = []
            for c in range(len(problem.placed)):
                of_crack = stations.crack == c
                m = int(of_crack.sum())
                row.append(
                    SIF(
                        x=lock(stations.x[of_crack]),
                        frame=lock(stations.frame[of_crack]),
                        K=lock(values[k, of_crack]),
                        T=lock(stress[k, of_crack]),
                        spread=lock(np.zeros((m, d))),
                        s=lock(stations.s[of_crack]),
                        front=lock(stations.front[of_crack]),
                        at_surface=lock(np.zeros(m, dtype=bool)),
                        closed=lock(np.zeros(m, dtype=bool)),
                        domain_cells=lock(np.full(m, np.inf)),
                    )
                )
            result.append(tuple(row))
        return cls(tuple(states), tuple(result))


Respond = Callable[[Problem, Sequence[Any], SolverState, bool], Response]
# K of all states and cracks with bars that are known already; None where they must be found.
KnownBars = Callable[[Answers], Answers | None]


def respond(
    problem: Problem,
    states: Sequence[Any],
    reuse: SolverState | None = None,
    bars: bool = False,
    *,
    solver: Any = None,
    known_bars: KnownBars | None = None,
) -> Response:
    """Solve a scene in some load states, and take K of all cracks.

    Parameters
    ----------
    problem : Problem
    states : sequence of load states
        As of `solve`. With friction they are one cycle, repeated until slip returns.
    reuse : SolverState, optional
        Of the response before.
    bars : bool
        Give K its error bars.
    solver : optional
        As of `solve`.
    known_bars : callable (sif) -> sif or None, optional
        With `bars`: asked first, for K of all states and cracks with bars known beforehand. Where
        it returns None they are found, by the factor of this solve.

    Returns
    -------
    Response

    Raises
    ------
    ProblemError
        As of `solve` and `stress_intensity`.
    """
    check_problem(problem, "respond")
    reuse = SolverState() if reuse is None else reuse
    if not isinstance(reuse, SolverState):
        raise ProblemError(f"respond: reuse = {value_text(reuse)}: give that of a Response.")
    states, bars = entries(states, "respond: states"), flag(bars, "respond: bars")
    if not states:
        raise ProblemError("respond: states is empty: give one load state, at least.")
    for name, function in (("solver", solver), ("known_bars", known_bars)):
        if function is not None and not callable(function):
            raise ProblemError(
                f"respond: {name} = {value_text(function)} cannot be called: give a function."
            )
    plane = problem.mesh.dim < 3  # of fronts, the bars need no factor
    new_solutions = solve_states(
        problem, states, reuse=reuse, solver=solver, is_repeated=True, error=bars and plane
    )
    handed_on = new_solutions[0].reuse
    cracks, sif = range(len(problem.cracks)), None
    messages: list[str] = []
    if bars and known_bars is not None:
        with collected_warnings(messages):
            by_crack = [stress_intensities(new_solutions, c, False) for c in cracks]
        sif = known_bars(tuple(zip(*by_crack, strict=True)))
    has_known_bars = sif is not None
    if sif is None:  # what was said of K without bars is said with them again
        by_crack = [stress_intensities(new_solutions, c, bars) for c in cracks]
        sif, messages = tuple(zip(*by_crack, strict=True)), []
    for message in messages:
        warn(message)
    light = handed_on.without_factor()
    solutions = tuple(copy_without_checks(s, reuse=light, factored=None) for s in new_solutions)
    return build_without_checks(
        Response, states=states, sif=sif, solutions=solutions, reuse=handed_on,
        has_known_bars=has_known_bars,
    )  # fmt: skip


def checked_response(response: Any, problem: Problem, states: Sequence[Any]) -> Response:
    """What a function for K returned, if it is a Response for these states and cracks.

    Raises
    ------
    ProblemError
        It is not.
    """
    if not isinstance(response, Response):
        raise ProblemError(
            f"grow: response returned {value_text(response)}: return a Response, such as "
            "Response.of_K(problem, states, K)."
        )
    n = len(problem.placed)
    if len(response.sif) != len(states) or any(len(row) != n for row in response.sif):
        raise ProblemError(
            f"grow: response returned K of {len(response.sif)} states, where {len(states)} were "
            f"asked for, of {n} cracks each: return a row a state, with a SIF a crack."
        )
    return response


__all__ = ["Answers", "KnownBars", "Respond", "Response", "best_K", "checked_response", "respond"]
