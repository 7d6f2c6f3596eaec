"""Options of `grow`: they stand here once, their defaults on `GrowthRule` alone."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats
from xcrack.base.checks import number, value_text, whole_number
from xcrack.base.errors import ProblemError, warn
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import Law
from xcrack.fatigue.rainflow import turning_points
from xcrack.fatigue.retardation import Retardation
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.description import DEFAULTS, describe, with_defaults_of
from xcrack.growth.response import Respond
from xcrack.growth.step import Cycle
from xcrack.growth.trail import check_retardation
from xcrack.model.problem import Problem

_LEAST = 1e-6  # relative error of a life that cells and steps can be held to
_STOPS = {"changes_results": False}  # when a run stops, not how its cracks grow

Function = TypeVar("Function", bound=Callable[..., Any])


class GrowthOptions(TypedDict, total=False):
    """Options of `grow` and `resume` by name; `grow` describes them."""

    tolerance: float | None
    max_unknowns: int | None
    cycles: float | None
    scaling: str
    integrator: str
    threshold: float
    retardation: Retardation | None
    K_c: float | None
    link_up: Callable[[Floats], ArrayLike] | None
    max_steps: int | None
    max_cycles: float | None
    solver: Any
    response: Respond | None
    progress: bool | str


@dataclass(frozen=True, eq=False)
class GrowthRule:
    """All that `grow` was asked for, checked.

    Parameters
    ----------
    problem, law, criterion, cycle, da, cycles, tolerance, max_unknowns, scaling, integrator, \
    threshold, retardation, solver, response, K_c, link_up, max_steps, max_cycles, progress
        As of `grow`.
    scouts : bool
        It is the scout of a run with a tolerance: nothing is estimated.
    meshes : int
        Number of meshes that a tolerance has made so far.
    defaults : int
        Number of the set of defaults.

    Raises
    ------
    ProblemError
        One of them does not fit.
    """

    problem: Problem
    law: Law
    criterion: Criterion
    cycle: Cycle | Spectrum
    da: float | None = None
    cycles: float | None = None
    tolerance: float | None = None
    max_unknowns: int | None = None
    scaling: str = "law"
    integrator: str = "pec"
    threshold: float = 0.0
    retardation: Retardation | None = None
    solver: Any = None
    response: Respond | None = None
    K_c: float | None = field(default=None, metadata=_STOPS)
    link_up: Callable[[Floats], ArrayLike] | None = field(default=None, metadata=_STOPS)
    max_steps: int | None = field(default=None, metadata=_STOPS)
    max_cycles: float | None = field(default=None, metadata=_STOPS)
    progress: bool | str = field(default=True, metadata=_STOPS)
    defaults: int = field(default=DEFAULTS, metadata=_STOPS)
    scouts: bool = field(default=False, metadata=_STOPS)
    meshes: int = field(default=0, metadata=_STOPS)

    def __post_init__(self) -> None:
        if not isinstance(self.problem, Problem):
            raise ProblemError(f"grow: problem = {value_text(self.problem)}: give a Problem.")
        for name in ("law", "criterion"):
            if not callable(getattr(self, name)):
                raise ProblemError(
                    f"grow: {name} = {value_text(getattr(self, name))} cannot be called: give a "
                    "function of two arguments."
                )
        if not isinstance(self.cycle, Cycle | Spectrum):
            raise ProblemError(
                f"grow: cycle = {value_text(self.cycle)}: give Cycle(min, max), or a Spectrum."
            )
        for state in self.cycle.load_states:
            self.problem.state(state)
        if isinstance(self.cycle, Cycle) and looks_like_history(self.cycle):
            warn(
                f"Cycle(states=...) with {len(self.cycle.load_states)} factors turns more than "
                "twice, but counts as one cycle from the smallest to the largest: a load history "
                "is a Spectrum(factors)."
            )
        if not self.problem.cracks:
            raise ProblemError("grow: the problem has no crack; growth does not start one.")
        if self.da is None and self.cycles is None and self.tolerance is None:
            raise ProblemError(
                "grow needs da (largest advance a step) or cycles (cycles a step), or a tolerance, "
                "which chooses the steps and the mesh."
            )
        for name in ("da", "cycles", "K_c", "max_cycles"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, f"grow: {name}", above=0))
        if self.max_steps is not None:
            steps = whole_number(self.max_steps, "grow: max_steps", least=1)
            object.__setattr__(self, "max_steps", steps)
        object.__setattr__(self, "threshold", number(self.threshold, "grow: threshold", least=0))
        if not isinstance(self.scaling, str) or self.scaling not in ("law", "linear"):
            raise ProblemError(
                f'grow: scaling = {value_text(self.scaling)}: give "law" or "linear".'
            )
        if not isinstance(self.integrator, str) or self.integrator not in ("pec", "euler"):
            raise ProblemError(
                f'grow: integrator = {value_text(self.integrator)}: give "pec" or "euler".'
            )
        if self.scaling == "linear" and self.integrator != "euler":
            raise ProblemError(
                'grow: scaling = "linear" contradicts the law, and leads to no path as steps get '
                'shorter: only integrator="euler" has it, for comparison.'
            )
        check_retardation(self.retardation, self.law, self.cycle, self.integrator)
        self._check_tolerance()
        if self.solver is not None and not callable(self.solver):
            raise ProblemError(
                f"grow: solver = {value_text(self.solver)} cannot be called: give a function, or "
                f"None."
            )
        if self.response is not None and not callable(self.response):
            raise ProblemError(
                f"grow: response = {value_text(self.response)} cannot be called: give a function "
                "(problem, states, reuse, bars) -> Response, or None."
            )
        self._check_link_up()
        self._check_temperatures()
        always = isinstance(self.progress, str) and self.progress == "always"
        if not (isinstance(self.progress, bool) or always):
            raise ProblemError(
                f'grow: progress = {value_text(self.progress)}: give True, False or "always".'
            )

    def _check_link_up(self) -> None:
        if self.link_up is None:
            return
        if not callable(self.link_up):
            raise ProblemError(
                f"grow: link_up = {value_text(self.link_up)}: give plastic_zone(sigma_y, beta), or "
                f"a function of K."
            )
        if self.problem.mesh.dim == 3:
            raise ProblemError(
                "grow: link_up compares plastic zones with the ligaments between tips in a sheet: "
                "a 3D body has no such ligaments. Leave it out, or model the sheet in 2D."
            )

    def _check_temperatures(self) -> None:
        steady = [load for load in self.problem.loads if load.adds_up]
        for k, state in enumerate(self.cycle.load_states):
            loads = [] if isinstance(state, Real) else [load for load in state if load.adds_up]
            if steady and any(load not in steady for load in loads):
                warn(
                    f"state {k} of the cycle has a {loads[0].kind} of its own, and the problem has "
                    "one that acts in all states: the two add up. If the states are to replace it, "
                    "leave it out of Problem(loads=...)."
                )
                return

    @property
    def estimates(self) -> bool:
        """Whether K has error bars, which its growth is held against."""
        return self.tolerance is not None and not self.scouts

    @property
    def toughness(self) -> float | None:
        """Toughness at which the run ends: its own, or that of the material; a scout has none."""
        if self.scouts or self.K_c is not None:
            return self.K_c
        return self.problem.elasticity.material.K_c

    def _check_tolerance(self) -> None:
        if self.tolerance is None:
            if self.max_unknowns is not None:
                raise ProblemError(
                    "grow: max_unknowns limits the mesh that a tolerance asks for: give tolerance "
                    "too, or leave it out."
                )
            return
        tolerance = number(self.tolerance, "grow: tolerance", above=0, below=1)
        if tolerance < _LEAST:
            raise ProblemError(
                f"grow: tolerance = {tolerance:g}: no mesh has K to less than {_LEAST:g}: give as "
                "much, at least."
            )
        object.__setattr__(self, "tolerance", tolerance)
        if self.max_unknowns is not None:
            most = whole_number(self.max_unknowns, "grow: max_unknowns", least=1, most=10**9)
            object.__setattr__(self, "max_unknowns", most)
        if self.integrator != "pec":
            raise ProblemError(
                f'grow: tolerance needs the errors that integrator="pec" estimates, and '
                f"{self.integrator!r} has none: leave integrator out, or give da."
            )
        method = self.problem.numerics.contact_method
        if method is not None:
            raise ProblemError(
                f"grow: contact by {method.label} has no estimate that a tolerance could be held "
                "against: leave contact_method out, or give da."
            )

    @property
    def settings(self) -> dict[str, str]:
        """Text of all that decides how the cracks grow; rules that stop a run are not in it."""
        lines = {"defaults": str(self.defaults), **describe("", self, self.defaults)}
        if self.tolerance is not None:  # curves shape the mesh that is refined
            curves = self.problem.mesh.curves
            lines |= describe("problem.mesh.curves", curves, self.defaults) if curves else {}
        return lines

    def as_begun(self, stored: Mapping[str, str]) -> "GrowthRule":
        """The run with the defaults of a stored one, where it leaves a choice to them."""
        defaults = int(stored["defaults"])
        return replace(with_defaults_of(self, defaults, stored), defaults=defaults)


def looks_like_history(cycle: Cycle) -> bool:
    """Whether the states of a cycle are factors that go up and down more than once."""
    states = cycle.load_states
    if not all(isinstance(state, Real) for state in states):
        return False
    return len(turning_points(np.array(states, dtype=float))) > 2


def run_of(
    caller: str,
    problem: Problem,
    law: Law,
    criterion: Criterion,
    cycle: Cycle | Spectrum,
    da: float | None,
    options: GrowthOptions,
) -> GrowthRule:
    """The run that a function with the options of `grow` was called for.

    Raises
    ------
    TypeError
        An option that there is not, in the words of Python.
    ProblemError
        One that does not fit.
    """
    for name in options:
        if name not in GrowthOptions.__annotations__:
            raise TypeError(f"{caller}() got an unexpected keyword argument {name!r}")
    return GrowthRule(problem, law, criterion, cycle, da, **options)


def lists_options(function: Function) -> Function:
    """Let help and completion list the `GrowthOptions` that a function takes by name."""
    signature = inspect.signature(function)
    default = {each.name: each.default for each in fields(GrowthRule)}
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    options = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=default[name], annotation=annotation
        )
        for name, annotation in GrowthOptions.__annotations__.items()
    ]
    cast(Any, function).__signature__ = signature.replace(parameters=[*own, *options])
    return function


__all__ = ["GrowthOptions", "GrowthRule", "lists_options", "run_of"]
