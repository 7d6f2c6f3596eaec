"""Options of `grow`: they stand here once, their defaults on `GrowthRule` alone."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Annotated, Any, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import (
    Choice,
    Either,
    Function,
    Number,
    Part,
    Whole,
    arguments_of,
    without_types,
)
from xcrack.base.arrays import Floats
from xcrack.base.description import default_keys, describe
from xcrack.base.errors import ProblemError, warn
from xcrack.base.units import LENGTH, TOUGHNESS
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import LawSets
from xcrack.fatigue.load_program import LoadProgram
from xcrack.fatigue.retardation import Retardation, RetardationSets, willenborg
from xcrack.fatigue.spectrum import Spectrum, turning_points
from xcrack.growth.response import Respond
from xcrack.growth.stations import CellSizes
from xcrack.model.problem import LoadLevel, Problem

_LEAST = 1e-6  # relative error of a life that cells and steps can be held to
_STOPS = {"changes_results": False}  # when a run stops, not how its cracks grow
_POSITIVE = Number(above=0)
_PROGRESS = 'True, False or "always"'
_LINK_UP = "plastic_zone(sigma_y, beta), or a function of K"
_LOAD_PROGRAM = "K_gradient(K), load_over_size(lambda a: ...) or another LoadProgram"
_RESPONSE = "a function (problem, states, reuse, bars) -> Response, or None"

AnyFunction = TypeVar("AnyFunction", bound=Callable[..., Any])


class GrowthOptions(TypedDict, total=False):
    """Options of `grow` and `resume` by name; `grow` describes them."""

    tolerance: float | None
    max_unknowns: int | None
    cycles: float | None
    scaling: str
    integrator: str
    threshold: float
    retardation: Retardation | Mapping[str, Retardation] | None
    K_c: float | None
    link_up: Callable[[Floats], ArrayLike] | None
    load_program: LoadProgram | None
    stop_at_interface: bool
    max_steps: int | None
    max_cycles: float | None
    max_size: float | None
    solver: Any
    response: Respond | None
    progress: bool | str


@dataclass(frozen=True, eq=False)
class GrowthRule:
    """All that `grow` was asked for, checked.

    Parameters
    ----------
    problem, law, criterion, cycle, da, cycles, tolerance, max_unknowns, scaling, integrator, \
    threshold, retardation, solver, response, load_program, K_c, link_up, stop_at_interface, \
    max_steps, max_cycles, max_size, progress
        As of `grow`.
    cells : CellSizes, optional
        Of the mesh, where a tolerance has asked for smaller ones than it began with.
    meshes : int
        How often it has done so.

    Raises
    ------
    ProblemError
        One of them does not fit.
    """

    problem: Annotated[Problem, Part(Problem, needs="a Problem")]
    law: Annotated[
        Any,
        Either(Part(LawSets, "laws by material"), Function("a function of two arguments")),
    ]
    criterion: Annotated[Criterion, Function("a function of two arguments")]
    cycle: Annotated[Cycle | Spectrum, Part((Cycle, Spectrum), "Cycle(min, max), or a Spectrum")]
    da: Annotated[float | None, Number(above=0, unit=LENGTH)] = None
    cycles: Annotated[float | None, _POSITIVE] = None
    tolerance: Annotated[float | None, Number(above=0, below=1)] = None
    max_unknowns: Annotated[int | None, Whole(least=1, most=10**9)] = None
    scaling: Annotated[str, Choice(("law", "linear"))] = "law"
    integrator: Annotated[str, Choice(("pec", "euler"))] = "pec"
    threshold: Annotated[float, Number(least=0, unit=TOUGHNESS)] = 0.0
    retardation: Annotated[
        Any,
        Part(Retardation | RetardationSets, "wheeler or willenborg, or a mapping to one of them"),
    ] = None
    solver: Annotated[Any, Function("a function, or None")] = None
    response: Annotated[Respond | None, Function(_RESPONSE)] = None
    load_program: Annotated[LoadProgram | None, Part(LoadProgram, needs=_LOAD_PROGRAM)] = None
    K_c: Annotated[float | None, Number(above=0, unit=TOUGHNESS)] = field(
        default=None, metadata=_STOPS
    )
    link_up: Annotated[Callable[[Floats], ArrayLike] | None, Function(_LINK_UP)] = field(
        default=None, metadata=_STOPS
    )
    stop_at_interface: Annotated[bool, Choice((True, False))] = field(
        default=False, metadata=_STOPS
    )
    max_steps: Annotated[int | None, Whole(least=1)] = field(default=None, metadata=_STOPS)
    max_cycles: Annotated[float | None, _POSITIVE] = field(default=None, metadata=_STOPS)
    max_size: Annotated[float | None, Number(above=0, unit=LENGTH)] = field(
        default=None, metadata=_STOPS
    )
    progress: Annotated[bool | str, Choice((True, False, "always"), _PROGRESS)] = field(
        default=True, metadata=_STOPS
    )
    cells: CellSizes | None = field(default=None, metadata=_STOPS)
    meshes: int = field(default=0, metadata=_STOPS)

    def __post_init__(self) -> None:
        if isinstance(self.law, Mapping):
            object.__setattr__(self, "law", LawSets(self.law))
        if isinstance(self.retardation, Mapping):
            object.__setattr__(self, "retardation", RetardationSets(self.retardation))
        for name, argument in arguments_of(GrowthRule).items():
            value = argument.check(getattr(self, name), f"grow: {name}")
            object.__setattr__(self, name, value)
        if isinstance(self.law, LawSets):
            self.law.check([name for name, _ in self.problem.elasticity.named])
        if isinstance(self.retardation, RetardationSets):
            self.retardation.check([name for name, _ in self.problem.elasticity.named])
        for state in self.cycle.load_states:
            self.problem.state(state)
        if isinstance(self.cycle, Cycle) and looks_like_history(self.cycle):
            warn(
                f"Cycle(states=...) with {len(self.cycle.load_states)} factors turns more than "
                "twice, but counts as one cycle from the smallest to the largest: a load history "
                "is a Spectrum(factors)."
            )
        if not self.problem.cracks:
            raise ProblemError(
                "grow: the problem has no crack, and growth does not start one: give one."
            )
        if self.da is None and self.cycles is None and self.tolerance is None:
            raise ProblemError(
                "grow needs da (largest advance a step) or cycles (cycles a step), or a tolerance, "
                "which chooses the steps and the mesh."
            )
        if self.scaling == "linear" and self.integrator != "euler":
            raise ProblemError(
                'grow: scaling = "linear" contradicts the law, and leads to no path as steps get '
                'shorter: only integrator="euler" has it, for comparison.'
            )
        if self.link_up is not None and self.problem.mesh.dim == 3:
            raise ProblemError(
                "grow: link_up compares plastic zones with the ligaments between tips in a sheet: "
                "a 3D body has no such ligaments. Leave it out, or model the sheet in 2D."
            )
        self._check_retardation()
        self._check_tolerance()
        self._check_temperatures()
        self._check_load_program()

    def _check_retardation(self) -> None:
        """Refuse a model of retardation with what it means nothing with."""
        if self.retardation is None:
            return
        if not isinstance(self.cycle, Spectrum) or self.cycle.factors is None:
            raise ProblemError(
                "grow: retardation needs cycles in time: give Spectrum(factors). One Cycle has no "
                "overload, counted rows no order, and states are counted at each tip on its own."
            )
        if self.integrator != "pec":
            raise ProblemError('grow: retardation goes with integrator="pec" only.')
        if getattr(self.law, "ratio", None) == "nominal":
            raise ProblemError(
                'grow: the law has ratio="nominal", but plastic zones belong to K with contact: '
                'with retardation give a law with ratio="contact".'
            )
        laws = [law for _, law in self.law.laws] if isinstance(self.law, LawSets) else [self.law]
        model: Any = self.retardation
        if isinstance(model, RetardationSets):
            model = model.models[0][1]  # they are of one kind
        if isinstance(model, willenborg) and any(
            getattr(law, "closure", None) is not None for law in laws
        ):
            raise ProblemError(
                "grow: the law has a closure, and willenborg lowers K as well: both stand for the "
                "same plastic wake, which would count twice. Give a law without closure, or "
                "wheeler."
            )

    def _check_load_program(self) -> None:
        """Refuse loads that follow the crack where a factor on all of them says nothing."""
        if self.load_program is None:
            return
        if not all(isinstance(state, Real | LoadLevel) for state in self.cycle.load_states):
            raise ProblemError(
                "grow: load_program is a factor on the loads: give Cycle(min, max) or a Spectrum "
                "of factors, no lists of loads."
            )
        names = self._loads_out_of_proportion()
        if names and self.load_program.needs_K:
            raise ProblemError(
                f"grow: {names[0]} does not scale with the loads, so K is not in proportion to "
                "them, and load_program cannot tell which loads give it: give their factor, by "
                "load_over_size or load_over_cycles."
            )

    def _loads_out_of_proportion(self) -> list[str]:
        """Names of what acts and is not multiplied by a factor on the loads."""
        names = [load.name for load in self.problem.loads if load.is_steady]
        names += [load.name for load in getattr(self.cycle, "steady", ())]
        return [*names, "friction"] if any(self.problem.frictions) else names

    @property
    def follows_cycles(self) -> bool:
        """Whether loads change with the cycles, and K in proportion to them."""
        program = self.load_program
        return program is not None and program.needs_N and not self._loads_out_of_proportion()

    def _check_temperatures(self) -> None:
        steady_loads = [load for load in self.problem.loads if load.adds_up]
        for k, state in enumerate(self.cycle.load_states):
            loads = [] if isinstance(state, Real) else [load for load in state if load.adds_up]
            if steady_loads and any(load not in steady_loads for load in loads):
                warn(
                    f"state {k} of the cycle has a {loads[0].kind} of its own, and the problem has "
                    "one that acts in all states: the two add up. If the states are to replace it, "
                    "leave it out of Problem(loads=...)."
                )
                return

    @property
    def has_interfaces(self) -> bool:
        """Whether the body has several materials."""
        return len(self.problem.elasticity.named) > 1

    @property
    def estimates(self) -> bool:
        """Whether K has error bars, which its growth is held against."""
        return self.tolerance is not None

    @property
    def toughness(self) -> float | None:
        """Toughness at which the run ends: its own, or that of the material."""
        if self.K_c is not None:
            return self.K_c
        return self.problem.elasticity.material.K_c

    def toughness_at(self, x: Floats) -> Floats:
        """Toughness at which the run ends, of the material at each point `(n,)`; inf without."""
        if self.K_c is not None:
            return np.full(len(x), self.K_c)
        return self.problem.elasticity.toughness_at(x)

    def _check_tolerance(self) -> None:
        if self.tolerance is None:
            if self.max_unknowns is not None:
                raise ProblemError(
                    "grow: max_unknowns limits the mesh that a tolerance asks for: give tolerance "
                    "too, or leave it out."
                )
            return
        if self.tolerance < _LEAST:
            raise ProblemError(
                f"grow: tolerance = {self.tolerance:g}: no mesh has K to less than {_LEAST:g}: "
                "give as much, at least."
            )
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
        lines = describe("", self)
        if self.tolerance is not None:  # curves shape the mesh that is refined
            curves = self.problem.mesh.curves
            lines |= describe("problem.mesh.curves", curves) if curves else {}
        return lines

    @property
    def default_settings(self) -> set[str]:
        """Keys of the settings that a run from before they were options may lack."""
        return default_keys("", self)


def looks_like_history(cycle: Cycle) -> bool:
    """Whether the states of a cycle are factors that go up and down more than once."""
    states = cycle.load_states
    if not all(isinstance(state, Real) for state in states):
        return False
    return len(turning_points(np.array(states, dtype=float))) > 2


def run_of(
    caller: str,
    problem: Problem,
    law: Any,
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
    refuse_unknown_options(caller, options)
    return GrowthRule(problem, law, criterion, cycle, da, **options)


def refuse_unknown_options(caller: str, options: Iterable[str]) -> None:
    """Raise a TypeError in the words of Python for a name that is no option of `grow`."""
    for name in options:
        if name not in GrowthOptions.__annotations__:
            raise TypeError(f"{caller}() got an unexpected keyword argument {name!r}")


def lists_options(function: AnyFunction) -> AnyFunction:
    """Let help and completion list the `GrowthOptions` that a function takes by name."""
    signature = inspect.signature(function)
    default = {option.name: option.default for option in fields(GrowthRule)}
    parameters = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    options = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default[name])
        for name in GrowthOptions.__annotations__
    ]
    shown_signature = signature.replace(parameters=[*parameters, *options])
    cast(Any, function).__signature__ = without_types(shown_signature)
    return function


__all__ = ["GrowthOptions", "GrowthRule", "lists_options", "refuse_unknown_options", "run_of"]
