"""The scene: body, cracks, supports and loads, checked before anything is built."""

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AnySet
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import (
    CheckedBy,
    Choice,
    Declared,
    FileName,
    Items,
    Number,
    OneOrMore,
    Part,
    Parts,
    Text,
    Whole,
    check_arguments,
)
from xcrack.base.checks import copy_without_checks, entries, number, value_text
from xcrack.base.errors import CoarseMeshError, ProblemError, XcrackError
from xcrack.base.markup import Markup, element, join_parts, rim, sketch, table
from xcrack.crack.crack import Crack
from xcrack.crack.junctions import Junction
from xcrack.crack.measures import crack_size
from xcrack.crack.placing_3d import ShortFront
from xcrack.crack.stations import GEOMETRY, Stations, placement_of, stations_of
from xcrack.mesh.mesh import Mesh, warn_of_sets
from xcrack.model.elasticity import Elasticity, elasticity
from xcrack.model.loads import Load, Support
from xcrack.model.material import Material, MaterialSets
from xcrack.model.numerics import Numerics


class ReferenceK(Declared):
    """K of a crack that is known from elsewhere; among them the handbook of `xcrack.sif.handbook`.

    Attributes
    ----------
    crack : int
        Number of the crack in the problem.
    """

    crack: Annotated[int, Whole(least=0)]

    def check(self, problem: Any) -> None:
        """Raise where the problem has no such crack.

        Raises
        ------
        ProblemError
        """
        if self.crack >= len(problem.cracks):
            raise ProblemError(
                f"handbook: crack = {self.crack}: the problem has {len(problem.cracks)} crack(s), "
                "numbered from 0: give the number of one of them."
            )

    def comparison(self, solution: Any) -> str:
        """K of a solution beside this one, in words."""
        raise NotImplementedError


# --- checks of friction where it is given: coefficients, and load states whose order counts ---


_MOST = 1e3  # beyond, faces that press never slip


def friction_coefficients(
    value: Any, label: str, error: type[XcrackError]
) -> float | tuple[float, ...]:
    """Coefficients of friction, checked: one for all cracks, or one for each."""
    if isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return number(value, label, least=0, most=_MOST, error=error)
    message = f"{label} = {value_text(value)}: give a number, or a list of one a crack."
    if isinstance(value, AnySet):
        raise error(message)
    try:
        given_values = entries(value, label, error=error)
    except error:
        raise error(message) from None
    return tuple(
        number(mu, f"{label}[{c}]", least=0, most=_MOST, error=error)
        for c, mu in enumerate(given_values)
    )


def fitted_friction(
    friction: float | Sequence[float], n_cracks: int, dim: int, numerics: Numerics
) -> float | tuple[float, ...]:
    """Coefficients of the cracks of a problem.

    Parameters
    ----------
    friction : float, or sequence of one a crack
    n_cracks : int
    dim : int
    numerics : Numerics

    Raises
    ------
    ProblemError
        Another count than cracks, or a method without friction.
    """
    if isinstance(friction, Sequence):
        if len(friction) != n_cracks:
            raise ProblemError(
                f"Problem: friction = {value_text(list(friction))}: the problem has {n_cracks} "
                f"crack(s); give a number for all of them, or a list of one a crack."
            )
        if len(set(friction)) == 1:  # cracks that join in growth then need no numbers of their own
            friction = friction[0]
    if friction if isinstance(friction, float) else any(friction):
        _check_method(dim, numerics)
    return friction if isinstance(friction, float) else tuple(friction)


def _check_method(dim: int, numerics: Numerics) -> None:
    method = numerics.contact_method
    if method is not None and dim not in method.friction_dims:
        raise ProblemError(
            f"friction in {dim}D with {method.label}: multipliers carry it; leave contact_method "
            "out, or give friction=0."
        )


def check_order(frictions: Sequence[float], states: Any) -> None:
    """Raise where states without an order are given to a problem with friction.

    Parameters
    ----------
    frictions : sequence of float
        Of each crack.
    states : anything
    """
    if any(frictions) and isinstance(states, AnySet | Mapping):
        raise ProblemError(
            f"states = {value_text(states)} with friction: each state is reached from the one "
            f"before it, and a set or dict has no order: give a list."
        )


_FACTOR = Number(hint="a list of loads will do too")


@dataclass(frozen=True, eq=False)
class LoadLevel:
    """A state in which the loads of a problem are scaled, beside steady ones.

    What supports impose is steady too.

    Attributes
    ----------
    factor : float
    steady : tuple of Load
    """

    factor: float
    steady: tuple[Load, ...] = ()


@dataclass(frozen=True, eq=False)
class LoadState:
    """Loads of a state, with the factor of each.

    Attributes
    ----------
    loads : tuple of Load
    factors : tuple of float
        1 for a steady load.
    factor : float
        Of the displacements that supports impose.
    """

    loads: tuple[Load, ...]
    factors: tuple[float, ...]
    factor: float

    def __iter__(self) -> Iterator[tuple[Load, float]]:
        return zip(self.loads, self.factors, strict=True)


def scaled_state(loads: tuple[Load, ...], factor: float) -> LoadState:
    """The loads times a factor, steady ones as they are."""
    return LoadState(loads, tuple(1.0 if load.is_steady else factor for load in loads), factor)


_MATERIAL = "a material, such as Isotropic(...), or a mapping of cell sets to materials"
_HANDBOOK = 'handbook("edge", a=..., ...)'
_SUPPORTS = "fix(...) or displacement(...), and put forces into loads"
_ORDER = 2  # of the standard functions
# In 3D: order 2 takes up to 3.5 times as long there, and beyond 50 000 unknowns twenty times.
_ORDER_OF_RUBBING = 1


def order_left_out(problem: "Problem") -> int:
    """Order of a problem that does not say one."""
    has_friction = problem.mesh.dim == 3 and problem.contact != "off" and any(problem.frictions)
    return _ORDER_OF_RUBBING if has_friction else _ORDER


@dataclass(frozen=True, eq=False)
class Problem(Declared):
    """A body with cracks, supports and loads.

    Parameters
    ----------
    mesh : Mesh
    material : Material, or mapping of str to Material
        Isotropic, Graded, or one of your own; a mapping gives each cell set its own.
    cracks : sequence of Crack
    supports : sequence of fix(...) and displacement(...)
        None are needed for loads in equilibrium: rigid motion is removed.
    loads : sequence of loads
    contact : {"auto", "on", "off"}
        auto: a crack whose lips would overlap gets multipliers, others get none.
    order : {1, 2}, optional
        Degree of the standard and Heaviside functions. Where it is left out: 2, but 1 in 3D with
        friction, where order 2 takes twenty times as long beyond 50 000 unknowns; below, up to 3.5
        times, with K 1.1 to 4 times nearer: give 2 there.
    numerics : Numerics
    friction : float, or a sequence of one a crack
        Coulomb's coefficient of the crack faces: where they press, they stick until the shear is
        that share of the pressure. The order of load states counts then.
    handbook : HandbookK, or a sequence of them
        K as of `handbook`, which `solution.report` puts beside the computed one.

    Raises
    ------
    ProblemError, GeometryError
        A scene that is not well posed; the message names object, value and remedy. A mesh that is
        too coarse for a crack is refused by what solves on it: `adapt` makes it finer first.
    """

    mesh: Annotated[Mesh, Part(Mesh, "a mesh, such as box(...) or read_mesh(...)")]
    material: Annotated[Material | Mapping[str, Material], Part(Material, _MATERIAL)]
    cracks: Annotated[Sequence[Crack], Parts(Crack, "cracks, such as line_crack(...)")] = ()
    supports: Annotated[Sequence[Support], Parts(Support, _SUPPORTS)] = ()
    loads: Annotated[Sequence[Load], Parts(Load, "loads, such as traction(...)")] = ()
    contact: Annotated[str, Choice(("auto", "on", "off"))] = "auto"
    order: Annotated[int | None, Whole(least=1, most=2)] = field(
        default=None, metadata={"resolved": order_left_out}
    )
    numerics: Annotated[Numerics, Part(Numerics)] = field(default_factory=Numerics)
    friction: Annotated[float | Sequence[float], CheckedBy(friction_coefficients)] = 0.0
    # What K is compared with changes nothing that is computed.
    handbook: Annotated[Sequence[ReferenceK], OneOrMore(ReferenceK, _HANDBOOK, True)] = field(
        default=(), metadata={"changes_results": False}
    )

    def __post_init__(self) -> None:
        if isinstance(self.material, Mapping):
            object.__setattr__(self, "material", MaterialSets(self.material))
        super().__post_init__()
        material: Any = self.material
        material.check(self.mesh.dim)
        if not len(self.elasticity.set_number):
            warn_of_sets(self.mesh)
        self._check_members()
        friction_values = fitted_friction(
            self.friction, len(self.cracks), self.mesh.dim, self.numerics
        )
        object.__setattr__(self, "friction", friction_values)
        if self.order is None:  # it is known now which faces rub
            object.__setattr__(self, "order", order_left_out(self))
        with suppress(CoarseMeshError):  # `adapt` refines such a mesh; all else asks for `placed`
            _ = self.placed

    @cached_property
    def elasticity(self) -> Elasticity:
        """What each cell is made of."""
        material: Any = self.material  # a mapping has become MaterialSets
        return elasticity(self.mesh, material)

    @cached_property
    def placements(self) -> tuple[tuple[Crack, Sequence[ShortFront]], ...]:
        """Each crack placed by itself, and the fronts that the mesh is too coarse for.

        Raises
        ------
        CoarseMeshError
            The mesh is too coarse for them.
        """
        return tuple(placement_of(crack, self.mesh) for crack in self.cracks)

    @cached_property
    def placed(self) -> tuple[Crack, ...]:
        """The cracks with tips and mouths decided in this mesh.

        Raises
        ------
        CoarseMeshError
            The mesh is too coarse for them.
        """
        cracks = tuple(crack for crack, _ in self.placements)
        geometry = GEOMETRY[self.mesh.dim]
        cracks = geometry.on_others(self.cracks, cracks, self.mesh)
        geometry.check(cracks, self.mesh)
        return cracks

    @cached_property
    def stations(self) -> Stations:
        """Tips of placed cracks in the body, in 3D vertices of fronts and where these leave it."""
        return stations_of(self.placed, self.mesh)

    @cached_property
    def sizes(self) -> tuple[float, ...]:
        """Size of each crack: its length in the body, in 3D its area over that of its fronts."""
        return tuple(crack_size(self.placed, c, self.mesh) for c in range(len(self.placed)))

    @cached_property
    def junctions(self) -> tuple[Junction, ...]:
        """In 2D: where cracks end on others."""
        return GEOMETRY[self.mesh.dim].junctions(self.placed, self.mesh)

    @property
    def frictions(self) -> tuple[float, ...]:
        """Coefficient of friction of each crack."""
        if isinstance(self.friction, Sequence):
            return tuple(self.friction)
        return (float(self.friction),) * len(self.cracks)

    def state(self, state: Any) -> LoadState:
        """Loads of a load state: a number, a `LoadLevel`, or a list of loads.

        Raises
        ------
        ProblemError
            Something else than these.
        """
        if state is None:
            return scaled_state(self.loads, 1.0)  # type: ignore[arg-type]
        if isinstance(state, LoadLevel):
            for load in state.steady:
                self._check_load(load)
            scaled_loads = scaled_state(self.loads, state.factor)  # type: ignore[arg-type]
            steady_loads = state.steady
            return LoadState(
                scaled_loads.loads + steady_loads,
                scaled_loads.factors + (1.0,) * len(steady_loads),
                1.0,
            )
        if isinstance(state, Real | np.ndarray) or np.isscalar(state):
            factor = _FACTOR.check(state, "load state", ProblemError)
            return scaled_state(self.loads, factor)  # type: ignore[arg-type]
        try:
            loads = Items().check(state, "load state", ProblemError)
        except ProblemError as error:
            raise ProblemError(f"{str(error)[:-1]} of loads, or a number.") from None
        for load in loads:
            self._check_load(load)
        body = tuple(load for load in self.loads if load.is_steady)
        return scaled_state(loads + tuple(b for b in body if b not in loads), 1.0)

    def _repr_html_(self) -> str:
        loads = ", ".join(load.name for load in self.loads) or "none"
        supports = ", ".join(support.name for support in self.supports) or "none"
        sizes = f"{self.mesh.n_points} points, {len(self.mesh.cells)} cells"
        rows = [
            ("body", f"{self.mesh.dim}D, {sizes}"),
            ("material", repr(self.material)),
            ("cracks", len(self.cracks)),
            ("supports", supports),
            ("loads", loads),
            ("contact, order", f"{self.contact}, {self.order}"),
        ]
        return join_parts(element("b", "Problem"), self.sketch(), table((), rows))

    @check_arguments()
    def plot(
        self,
        file: FileName | None = None,
        *,
        title: Annotated[str | None, Text("a text, or leave it out", may_be_empty=True)] = None,
    ) -> Any:
        """Draw the set-up before a solve: body, sets, loads, supports, cracks and their normals.

        Parameters
        ----------
        file : path, optional
            Picture to write; without it a window opens, or the notebook shows it.
        title : str, optional

        Returns
        -------
        matplotlib figure

        Raises
        ------
        ProblemError
            No text as title, or a file that cannot be written.
        """
        from xcrack.view.setup import draw_setup

        return draw_setup(self, file, title)

    def sketch(self) -> Markup:
        """Outline of the body and its cracks, as SVG."""
        with suppress(CoarseMeshError):  # then as they were given
            _ = self.placed
        drawn_cracks = self.__dict__.get("placed", self.cracks)
        cracks = [rim(crack.points, crack.faces) for crack in drawn_cracks]
        return sketch(self.mesh.points, self.mesh.boundary, cracks)

    def _check_members(self) -> None:
        for support in self.supports:
            support.check_in(self.mesh)
        for load in self.loads:
            load.check(self)
        for reference in self.handbook:
            reference.check(self)

    def _check_load(self, load: Any) -> None:
        if not isinstance(load, Load):
            raise ProblemError(
                f"load state: {value_text(load)} is not a load: give loads such as traction(...), "
                "or a number that scales those of the problem."
            )
        load.check(self)


ProblemArgument = Annotated[Problem, Part(Problem, "a Problem(mesh, material, ...)")]


def problem_with_cracks(
    problem: Problem, cracks: Sequence[Crack], radius: float | None = None
) -> Problem:
    """The same scene with cracks that have grown; while these are as many, no more is checked.

    Parameters
    ----------
    problem : Problem
    cracks : sequence of Crack
    radius : float, length, optional
        Of the tip functions, in place of that of `numerics`.
    """
    numerics = problem.numerics
    if radius is not None and radius != numerics.radius:
        numerics = copy_without_checks(numerics, radius=radius)
    if len(cracks) != len(problem.cracks):
        return replace(problem, cracks=tuple(cracks), numerics=numerics)
    result = copy_without_checks(problem, cracks=tuple(cracks), numerics=numerics)
    vars(result)["elasticity"] = problem.elasticity
    return result


def check_problem(problem: Any, label: str) -> None:
    """Raise where a function that needs a problem was given something else."""
    if not isinstance(problem, Problem):
        raise ProblemError(
            f"{label}: give a Problem(mesh, material, ...), not {type(problem).__name__}."
        )


CrackNumber = Annotated[int, Whole(least=0)]


def crack_number(problem: Problem, crack: int, label: str) -> int:
    """A crack by its number, if the problem has it."""
    n = len(problem.cracks)
    if not n:
        raise ProblemError(
            f"{label}: crack {value_text(crack)}: the problem has no crack: give one with."
        )
    if crack >= n:
        raise ProblemError(
            f"{label}: crack {value_text(crack)}: the problem has {n} crack(s), numbered from 0."
        )
    return crack


__all__ = [
    "LoadLevel",
    "LoadState",
    "ReferenceK",
    "check_order",
    "fitted_friction",
    "friction_coefficients",
    "problem_with_cracks",
    "scaled_state",
]
