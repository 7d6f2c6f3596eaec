"""The scene: body, cracks, supports and loads, checked before anything is built."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np

from xcrack.base.checks import entries, number, shown, whole
from xcrack.base.errors import CoarseMeshError, ProblemError
from xcrack.base.markup import Markup, element, joined, table
from xcrack.base.svg import rim, sketch
from xcrack.crack.crack import Crack
from xcrack.crack.junctions import Junction
from xcrack.crack.placing import check_cracks, junctions, on_others, placed
from xcrack.crack.stations import Stations, stations_of
from xcrack.mesh.holes import round_hole
from xcrack.mesh.mesh import Mesh, facet_set
from xcrack.model.conditions import (
    Bearing,
    CrackPressure,
    Displacement,
    Fix,
    InitialStress,
    Load,
    Resultant,
    Support,
    check_dimension,
    check_vectors,
    with_material,
)
from xcrack.model.friction import checked_friction
from xcrack.model.material import Isotropic
from xcrack.model.numerics import Numerics

_ORDER = {2: 2, 3: 1}  # of the standard functions, by dimension (measured)
_PLANE = {2: True, 3: False}  # whether the material must name a plane state
_WRONG_PLANE = {
    2: 'a 2D body needs Isotropic(..., plane="strain") or plane="stress": the two differ by up to '
    "1/(1 - nu²) in stiffness, so there is no default.",
    3: 'Isotropic(plane="{}") is for 2D bodies: leave plane out for a mesh of tetrahedra '
    "(read_mesh drops a constant z).",
}


@dataclass(frozen=True, eq=False)
class Problem:
    """A body with cracks, supports and loads.

    Parameters
    ----------
    mesh : Mesh
    material : Isotropic
    cracks : sequence of Crack
    supports : sequence of fix(...) and displacement(...)
        None are needed for loads in equilibrium: rigid motion is removed.
    loads : sequence of loads
    contact : {"auto", "on", "off"}
        auto: a crack whose lips would overlap gets multipliers, others get none.
    order : {1, 2}, optional
        Degree of the standard and Heaviside functions. Where it is left out: 2 in 2D, 1 in
        3D.
    numerics : Numerics
    friction : float, or a sequence of one a crack
        Coulomb's coefficient of the crack faces: where they press, they stick until the shear is
        that share of the pressure. The order of load states counts then.

    Raises
    ------
    ProblemError, GeometryError
        A scene that is not well posed; the message names object, value and remedy. A mesh that is
        too coarse for a crack is refused by what solves on it: `adapt` makes it finer first.
    """

    mesh: Mesh
    material: Isotropic
    cracks: Sequence[Crack] = ()
    supports: Sequence[Support] = ()
    loads: Sequence[Load] = ()
    contact: str = "auto"
    order: int | None = field(default=None, metadata={"resolved": lambda own: _ORDER[own.mesh.dim]})
    numerics: Numerics = field(default_factory=Numerics)
    friction: float | Sequence[float] = 0.0

    def __post_init__(self) -> None:
        for name, kind in (("mesh", Mesh), ("material", Isotropic), ("numerics", Numerics)):
            if not isinstance(getattr(self, name), kind):
                raise ProblemError(
                    f"Problem({name}=...) must be of type {kind.__name__}, "
                    f"not {type(getattr(self, name)).__name__}."
                )
        for name in ("cracks", "supports", "loads"):
            given = getattr(self, name)
            object.__setattr__(self, name, entries(given, f"Problem: {name}"))
        if (self.material.plane is None) is _PLANE[self.mesh.dim]:
            raise ProblemError(_WRONG_PLANE[self.mesh.dim].format(self.material.plane))
        if self.order is None:
            object.__setattr__(self, "order", _ORDER[self.mesh.dim])
        if type(self.order) is bool or not isinstance(self.order, Real) or self.order not in (1, 2):
            raise ProblemError(f"order = {shown(self.order)}: give 1 or 2.")
        if not isinstance(self.contact, str) or self.contact not in ("auto", "on", "off"):
            raise ProblemError(f'contact = {shown(self.contact)}: give "auto", "on" or "off".')
        self._check_members()
        own = checked_friction(self.friction, len(self.cracks), self.mesh.dim, self.numerics)
        object.__setattr__(self, "friction", own)
        with suppress(CoarseMeshError):  # `adapt` refines such a mesh; all else asks for `placed`
            _ = self.placed

    @cached_property
    def placed(self) -> tuple[Crack, ...]:
        """The cracks with tips and mouths decided in this mesh.

        Raises
        ------
        CoarseMeshError
            The mesh is too coarse for them.
        """
        cracks = tuple(placed(crack, self.mesh) for crack in self.cracks)
        cracks = on_others(self.cracks, cracks, self.mesh)
        check_cracks(cracks, self.mesh)
        return cracks

    @cached_property
    def stations(self) -> Stations:
        """Tips, in 3D vertices of the fronts, of the placed cracks inside the body."""
        return stations_of(self.placed, self.mesh)

    @cached_property
    def junctions(self) -> tuple[Junction, ...]:
        """In 2D: where cracks end on others."""
        return junctions(self.placed, self.mesh)

    @property
    def frictions(self) -> tuple[float, ...]:
        """Coefficient of friction of each crack."""
        if isinstance(self.friction, Sequence):
            return tuple(self.friction)
        return (float(self.friction),) * len(self.cracks)

    def state(self, state: Any) -> tuple[tuple[Load, ...], float]:
        """Loads and factor of a load state: a number, or a list of loads."""
        if state is None:
            return self._acting, 1.0
        if isinstance(state, Real | np.ndarray) or np.isscalar(state):
            try:
                return self._acting, number(state, "load state")
            except ProblemError as error:
                raise ProblemError(f"{str(error)[:-1]}, or a list of loads.") from None
        try:
            loads = entries(state, "load state")
        except ProblemError as error:
            raise ProblemError(f"{str(error)[:-1]} of loads, or a number.") from None
        for load in loads:
            self._check_load(load)
        body = tuple(load for load in self.loads if isinstance(load, InitialStress))
        loads += tuple(b for b in body if b not in loads)
        own = dict(zip(map(id, self.loads), self._acting, strict=True))
        return tuple(own.get(id(x), with_material(x, self.material)) for x in loads), 1.0

    @cached_property
    def _acting(self) -> tuple[Load, ...]:
        """The loads with all that depends on the material."""
        return tuple(with_material(load, self.material) for load in self.loads)

    def _repr_html_(self) -> str:
        loads = ", ".join(_named(load) for load in self.loads) or "none"
        supports = ", ".join(_named(support) for support in self.supports) or "none"
        sizes = f"{self.mesh.n_points} points, {len(self.mesh.cells)} cells"
        rows = [
            ("body", f"{self.mesh.dim}D, {sizes}"),
            ("material", repr(self.material)),
            ("cracks", len(self.cracks)),
            ("supports", supports),
            ("loads", loads),
            ("contact, order", f"{self.contact}, {self.order}"),
        ]
        return joined(element("b", "Problem"), self.sketch(), table((), rows))

    def sketch(self) -> Markup:
        """Outline of the body and its cracks, as SVG."""
        with suppress(CoarseMeshError):  # then as they were given
            _ = self.placed
        shown = self.__dict__.get("placed", self.cracks)
        cracks = [rim(crack.points, crack.faces) for crack in shown]
        return sketch(self.mesh.points, self.mesh.boundary, cracks)

    def _check_members(self) -> None:
        for crack in self.cracks:
            if not isinstance(crack, Crack):
                raise ProblemError(
                    f"cracks: {shown(crack)} is not a Crack; make one by line_crack(...)."
                )
        for support in self.supports:
            if not isinstance(support, Fix | Displacement):
                raise ProblemError(
                    f"supports: {type(support).__name__} is not a support; give fix(...) or "
                    "displacement(...), and put forces into loads."
                )
            check_vectors(support, self.mesh.dim)
            if isinstance(support.where, str):
                facet_set(self.mesh, support.where, type(support).__name__.lower())
        for load in self.loads:
            self._check_load(load)

    def _check_load(self, load: Any) -> None:
        if not isinstance(load, Load):
            raise ProblemError(
                f"loads: {shown(load)} is not a load; see traction(...), pressure(...)."
            )
        where = getattr(load, "where", None)
        if isinstance(where, str):
            facet_set(self.mesh, where, type(load).__name__.lower())
        if isinstance(load, Bearing | Resultant):
            check_dimension(load, self.mesh.dim)
        else:
            check_vectors(load, self.mesh.dim)
        if isinstance(load, Bearing):
            what = f"bearing({load.where!r})"
            round_hole(self.mesh, facet_set(self.mesh, load.where, what), what)
        if isinstance(load, Displacement):
            supported = [s.where for s in self.supports]
            if not any(_same(where, h) for h in supported):
                raise ProblemError(
                    f"displacement({shown(where)}) among the loads gives a new value to a support, "
                    "but nothing is supported there: put it into supports first."
                )
        if isinstance(load, CrackPressure) and load.crack is not None:
            if not 0 <= load.crack < len(self.cracks):
                raise ProblemError(
                    f"crack_pressure(crack={shown(load.crack)}): the problem has "
                    f"{len(self.cracks)} crack(s), numbered from 0."
                )


def _named(condition: Any) -> str:
    """A support or load in a few words."""
    where = getattr(condition, "where", None)
    name = type(condition).__name__.lower()
    return f"{name} on {where}" if isinstance(where, str) else name


def check_problem(problem: Any, what: str) -> None:
    """Raise where a function that needs a problem was given something else."""
    if not isinstance(problem, Problem):
        raise ProblemError(
            f"{what}: give a Problem(mesh, material, ...), not {type(problem).__name__}."
        )


def crack_number(problem: Problem, crack: Any, what: str) -> int:
    """A crack of the problem by number, checked."""
    n = len(problem.cracks)
    if not n:
        raise ProblemError(
            f"{what}: crack {shown(crack)}: the problem has no crack: give one with."
        )
    index = whole(crack, f"{what}: crack", least=0)
    if index >= n:
        raise ProblemError(
            f"{what}: crack {shown(index)}: the problem has {n} crack(s), numbered from 0."
        )
    return index


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return bool(isinstance(a, str) and isinstance(b, str) and a == b)
    return bool(len(a) == len(b) and (a == b).all())
