"""What acts on a body and what holds it. Each says what it does; nobody asks which one it is.

A load of your own derives from `Load`, names what it has in `acts`, and answers those questions
alone (docs/add_a_load.md).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import combinations
from math import pi
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Array, Declared, Number, Vector, Whole, arguments_of
from xcrack.base.arrays import Floats, Ints, frozen_copy
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import (
    BODY_FORCE,
    FORCE,
    LENGTH,
    LINE_FORCE,
    MOMENT,
    PER_TEMPERATURE,
    STRESS,
    TEMPERATURE,
)
from xcrack.mesh.holes import RoundHole, round_hole
from xcrack.mesh.locate import cells_of_points, places_in_body
from xcrack.mesh.mesh import Mesh, facet_set
from xcrack.model.material import Material
from xcrack.model.values import (
    Place,
    PointRows,
    ScalarField,
    SetName,
    StressField,
    VectorField,
    scalar_at,
    stress_at,
    vector_at,
)

# Supports, and what they share with loads.


class Condition(Declared):
    """What supports and loads share: a name, a place, and the dimension of their vectors."""

    where: Any  # facet set or point, of those that have one

    @property
    def place(self) -> Any:
        """Facet set or point; None for what acts everywhere."""
        return vars(self).get("where")

    @property
    def kind(self) -> str:
        """The function that it is made by."""
        return type(self).__name__

    @cached_property
    def name(self) -> str:
        """What messages and reports call it: its function and place."""
        where = self.place
        if where is None:
            return self.kind
        if isinstance(where, str):
            return f"{self.kind}({value_text(where)})"
        if np.ndim(where) == 2 and len(where) > 1:
            return f"{self.kind}({len(where)} points)"
        return f"{self.kind}({np.round(where, 6).tolist()})"

    def check_in(self, mesh: Mesh) -> None:
        """Raise where a vector has another dimension than the body, or a set is not there."""
        kind: Any = type(self)
        for name in _vectors_of(kind):
            value = getattr(self, name)
            if isinstance(value, np.ndarray | tuple):
                if np.shape(value)[-1:] != (mesh.dim,):
                    raise ProblemError(
                        f"{self.kind}: {name} = {value_text(value)} does not suit a body in "
                        f"{mesh.dim} dimensions: give {mesh.dim} numbers a row."
                    )
        if isinstance(self.place, str):
            facet_set(mesh, self.place, self.kind)


@cache
def _vectors_of(kind: Any) -> tuple[str, ...]:
    """Arguments of a condition that are vectors."""
    arguments = arguments_of(kind).items()
    return tuple(name for name, a in arguments if a.rule is not None and a.rule.is_vector)


class Support(Condition):
    """Displacements that are known on a set or at a point.

    Attributes
    ----------
    holds : bool
        Whether they are zero: then all functions that act there are, enriched ones too.
    """

    holds: ClassVar[bool] = False

    @property
    def is_uniform(self) -> bool:
        """Whether they are the same at all points."""
        return False

    def displacement_at(self, x: Floats) -> Floats:
        """Displacement at points `(n, d)`: `(n, d)`, nan in directions that stay free."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class fix(Support):  # noqa: N801 - it is used as a function
    """Hold a facet set, a point or several points, in one direction or in all.

    Parameters
    ----------
    where : str, (d,) or (k, d) array
        Name of a facet set, a point (the nearest mesh point is supported), or several points, each
        of which may also be the middle of an edge: at order 1 both ends are supported then.
    axis : int, optional
        Direction 0, 1 (, 2); all where it is left out.

    Raises
    ------
    ProblemError
        Something else than these.
    """

    where: Annotated[str | ArrayLike, Place(unit=LENGTH)]
    axis: Annotated[int | None, Whole(least=0, most=2)] = None
    holds = True
    is_uniform = True

    @cached_property
    def name(self) -> str:
        """What messages and reports call it."""
        base_name = super().name
        return base_name if self.axis is None else f"{base_name[:-1]}, axis={self.axis})"

    def check_in(self, mesh: Mesh) -> None:
        """Raise where an axis, a point or a set is not one of the body."""
        super().check_in(mesh)
        if self.axis is not None and self.axis >= mesh.dim:
            axes = " or ".join(map(str, range(mesh.dim)))
            raise ProblemError(
                f"fix: axis = {self.axis}: in {mesh.dim} dimensions axis is {axes}: give one of "
                "them."
            )

    def displacement_at(self, x: Floats) -> Floats:
        """Zero along the axis, or in all directions."""
        value = np.zeros(x.shape)
        if self.axis is not None:
            value[:, np.arange(x.shape[1]) != self.axis] = np.nan
        return value


_AXIAL = 1e-3  # share of a force along the axis that may stem from the fit of the axis
_PIN_ANGLE = pi / 2  # of a pin with clearance: 60 to 120 degrees
_COVERED = 0.9  # share of the contact of a pin that must lie on the set


@dataclass(frozen=True, eq=False)
class FacetPoints:
    """Points of integration on a facet set of the boundary.

    Attributes
    ----------
    mesh : Mesh
    facets : (k, d) array of int
    x, normal : (q, d) arrays
        Places (length), and unit normals out of the body.
    weight : (q,) array
        Their sum is the length or area of the set.
    """

    mesh: Mesh
    facets: Ints
    x: Floats
    normal: Floats
    weight: Floats


class Load(Condition):
    """What acts on a body.

    Attributes
    ----------
    acts : frozenset of str
        What it has, of "traction" (on the facet set `where`), "volume", "initial_stress",
        "face_pressure", "point_force", "support" (it moves one): only these are asked for.
    is_steady : bool
        A load state that is a number does not scale it.
    relaxes : bool
        It is a stress that should balance in the body without cracks: how much does not is said.
    adds_up : bool
        One of the problem and another one of a state are one too many more often than not.
    is_listed : bool
        It is one of the resultants of a report; others act through supports or balance themselves.
    has_one_arrow : bool
        Pictures show `force`, its resultant, and not its tractions.
    """

    acts: ClassVar[frozenset[str]] = frozenset()
    is_steady: ClassVar[bool] = False
    relaxes: ClassVar[bool] = False
    adds_up: ClassVar[bool] = False
    is_listed: ClassVar[bool] = True
    has_one_arrow: ClassVar[bool] = False
    force: Any  # of those that have one arrow

    @property
    def is_of_one_crack(self) -> bool:
        """Whether it names a crack by its number."""
        return vars(self).get("crack") is not None

    @property
    def is_uniform(self) -> bool:
        """Whether its tractions are the same at all points with the same normal."""
        return False

    def check(self, problem: Any) -> None:
        """Raise where it does not suit a problem: a set, a dimension, a crack that is not there."""
        self.check_in(problem.mesh)

    def traction(self, points: FacetPoints) -> Floats:
        """Force per area at points on `where` `(q, d)`, stress."""
        raise NotImplementedError

    def volume(self, x: Floats) -> Floats:
        """Force per volume at points `(q, d)`, stress / length."""
        raise NotImplementedError

    def initial_stress(self, x: Floats, material: Material) -> Floats:
        """Stress of the undeformed body at points `(q, d, d)`."""
        raise NotImplementedError

    def face_pressure(self, x: Floats, crack: int) -> Floats | None:
        """Pressure on the faces of a crack at points `(q,)`, None where it has none there."""
        raise NotImplementedError

    def point_forces(self, mesh: Mesh) -> tuple[Ints, Floats, Floats]:
        """Cells `(m,)`, barycentric coordinates in them `(m, d + 1)`, and the forces `(m, d)`."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class displacement(Load, Support):  # noqa: N801 - it is used as a function
    """Impose a displacement on a facet set or a point; among the loads it moves a support.

    Parameters
    ----------
    where : str, (d,) or (k, d) array
        Name of a facet set, a point (the nearest mesh point), or several points, as of `fix`.
    value : (d,) array or callable, length
        Vector, or f(x) -> (n, d), called with arrays (n, d). An entry of a vector may be None,
        where a direction stays free, or f(x) -> (n,). It is never called on a lip.

    Raises
    ------
    ProblemError
        Something else than these; among the loads, where nothing is supported.
    """

    where: Annotated[str | ArrayLike, Place(unit=LENGTH)]
    value: Annotated[
        ArrayLike | Callable[..., ArrayLike], VectorField(unit=LENGTH, may_be_free=True)
    ]
    acts = frozenset({"support"})
    is_listed = False

    @property
    def is_uniform(self) -> bool:
        """Whether it is the same everywhere."""
        entries = self.value if isinstance(self.value, tuple) else (self.value,)
        return not any(map(callable, entries))

    def check(self, problem: Any) -> None:
        """Raise where it moves nothing that is supported."""
        super().check(problem)
        if not any(_is_same_place(self.where, s.where) for s in problem.supports):
            raise ProblemError(
                f"{self.name} among the loads gives a new value to a support, but nothing is "
                "supported there: put it into supports first."
            )

    def displacement_at(self, x: Floats) -> Floats:
        """Value at points, nan where it leaves a direction free."""
        return vector_at(self.value, x, self.name)


@dataclass(frozen=True, eq=False)
class traction(Load):  # noqa: N801
    """Force per area on a facet set.

    Parameters
    ----------
    where : str
        Name of a facet set.
    value : (d,) array or callable, stress
        Vector, f(x) -> (n, d) or f(x, normal) -> (n, d), called with arrays (n, d).

    Raises
    ------
    ProblemError
        Something else than these.
    """

    where: Annotated[str, SetName()]
    value: Annotated[ArrayLike | Callable[..., ArrayLike], VectorField(unit=STRESS)]
    acts = frozenset({"traction"})

    @property
    def is_uniform(self) -> bool:
        """Whether it is a vector."""
        return not callable(self.value)

    def traction(self, points: FacetPoints) -> Floats:
        """Its value."""
        return vector_at(self.value, points.x, self.name, points.normal)


@dataclass(frozen=True, eq=False)
class pressure(Load):  # noqa: N801
    """Pressure on a facet set, positive towards the body.

    Parameters
    ----------
    where : str
        Name of a facet set.
    p : float or callable, stress
        Number, or f(x) -> (n,).

    Raises
    ------
    ProblemError
        Something else than these.
    """

    where: Annotated[str, SetName()]
    p: Annotated[float | Callable[..., ArrayLike], ScalarField(unit=STRESS)]
    acts = frozenset({"traction"})

    @property
    def is_uniform(self) -> bool:
        """Whether it is a number."""
        return not callable(self.p)

    def traction(self, points: FacetPoints) -> Floats:
        """Against the normal."""
        p = scalar_at(self.p, points.x, self.name)
        return np.asarray(-p[:, None] * points.normal)


@dataclass(frozen=True, eq=False)
class bearing(Load):  # noqa: N801
    """Force of a pin on a round hole: a pressure that follows a cosine over the contact angle.

    The traction acts along the radius, away from the axis; it is largest where the force points
    to and zero at the ends of the contact. Its resultant is the force to round-off, on whatever
    polygon the mesh makes of the hole. It does not follow the deformation of pin or hole.

    Parameters
    ----------
    where : str
        Facet set of the hole: a circle in 2D, a cylinder in 3D.
    force : (d,) array, force (per thickness in 2D)
        On the body; in 3D perpendicular to the axis of the hole.
    contact_angle : float, rad
        Angle over which the pin touches: 60 to 120 degrees for a pin with the clearance of a
        fixture or a bolt; pi is a pin without clearance. It moves K and the path of a crack.

    Raises
    ------
    ProblemError
        A force of zero or with other than 2 or 3 numbers, an angle out of bounds. `Problem` raises
        one for a set that is no round hole, and for a force along its axis.

    Examples
    --------
    >>> bearing("hole", (0.0, 1200.0)).force
    array([   0., 1200.])
    """

    where: Annotated[str, SetName()]
    force: Annotated[ArrayLike, Vector(unit=FORCE)]
    contact_angle: Annotated[float, Number(above=0, most=pi)] = _PIN_ANGLE
    acts = frozenset({"traction"})
    has_one_arrow = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.any(self.force):
            raise ProblemError(f"{self.name}: the force is zero: leave the load out.")

    def check(self, problem: Any) -> None:
        """Raise where the set is no round hole."""
        super().check(problem)
        self._hole(problem.mesh, facet_set(problem.mesh, self.where, self.kind))

    def _hole(self, mesh: Mesh, facets: Ints) -> RoundHole:
        return round_hole(mesh, facets, self.name)

    def traction(self, points: FacetPoints) -> Floats:
        """A cosine whose sum is the force.

        Raises
        ------
        ProblemError
            A force along the axis, or a set that lacks a part of the contact.
        """
        hole = self._hole(points.mesh, points.facets)
        force_in_space, x, weight = np.asarray(self.force), points.x, points.weight
        force = hole.section @ force_in_space
        size = float(np.linalg.norm(force_in_space))
        remainder = force_in_space - force @ hole.section
        axial_force = float(np.linalg.norm(remainder))
        if axial_force > _AXIAL * size:
            raise ProblemError(
                f"{self.name}: {axial_force:.4g} of the force {size:.4g} acts along the axis of "
                "the hole, where a pin does not press: give that part by traction or resultant."
            )
        in_section = hole.section_places(x)
        direction = in_section / np.linalg.norm(in_section, axis=1)[:, None]
        load_direction = force / np.linalg.norm(force)
        cross_direction = np.array([-load_direction[1], load_direction[0]])
        cosine, sine = direction @ load_direction, direction @ cross_direction
        angle = np.arctan2(sine, cosine)
        half = self.contact_angle / 2
        p = np.where(np.abs(angle) < half, np.cos(np.pi * angle / self.contact_angle), 0.0)
        height = np.ptp(x @ np.cross(*hole.section)) if len(force_in_space) > 2 else 1.0
        loaded_area = float(weight[np.abs(angle) < half].sum())
        # Points of integration do not reach the ends of the hole: its height is a little larger.
        bearing_area = self.contact_angle * hole.radius * height
        if loaded_area < _COVERED * bearing_area:
            raise ProblemError(
                f"{self.name}: the set covers {100 * loaded_area / bearing_area:.3g} % of where "
                f"the pin presses, {np.degrees(self.contact_angle):.4g} degrees around the force: "
                f"give the whole hole, or a smaller contact_angle."
            )
        # On a polygon the cosine alone would pull a little to one side.
        shapes = np.stack([p, p * sine])[:, :, None] * direction
        sums = np.einsum("q,kqs->sk", weight, shapes)
        scale = np.linalg.solve(sums, force)
        across_axis = np.einsum("k,kqs->qs", scale, shapes) @ hole.section
        # The rest is that of an axis that points know to a few digits only.
        return np.asarray(across_axis + remainder / weight.sum())


@dataclass(frozen=True, eq=False)
class resultant(Load):  # noqa: N801
    """Tractions on a set with a given force and moment: a + b x (x - centre), linear in x.

    On a plane section that is the stress of a bar: constant for a force, linear for a bending
    moment, turning for a torque.

    Parameters
    ----------
    where : str
        Name of a facet set on the boundary.
    force : (d,) array, optional, force (per thickness in 2D)
    moment : float in 2D, (3,) array in 3D, optional, force times length (per thickness in 2D)
        Positive counter-clockwise in 2D.
    about : (d,) array, optional, length
        Point to which the moment refers; the centre of the set if omitted.

    Raises
    ------
    ProblemError
        Neither force nor moment, or numbers of another dimension.

    Examples
    --------
    >>> resultant("end", moment=3.0).moment
    array([3.])
    """

    where: Annotated[str, SetName()]
    force: Annotated[ArrayLike | None, Vector(unit=FORCE)] = None
    moment: Annotated[ArrayLike | float | None, Array(unit=MOMENT)] = None
    about: Annotated[ArrayLike | None, Vector(unit=LENGTH)] = field(default=None, kw_only=True)
    acts = frozenset({"traction"})
    has_one_arrow = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.force is None and self.moment is None:
            raise ProblemError(f"{self.name}: give a force, a moment or both.")
        if self.moment is not None:
            moment = frozen_copy(np.atleast_1d(self.moment))
            object.__setattr__(self, "moment", moment)
            if moment.shape not in ((1,), (3,)):
                raise ProblemError(
                    f"{self.name}: moment must be a number in 2D, three numbers in 3D."
                )
        if len(self._dims()) > 1:
            raise ProblemError(
                f"{self.name}: force, moment and about must all be of 2D or all of 3D."
            )

    def _dims(self) -> set[int]:
        """Dimensions that its numbers belong to."""
        dims = {np.size(v) for v in (self.force, self.about) if v is not None}
        return dims if self.moment is None else dims | {2 if np.size(self.moment) == 1 else 3}

    def check(self, problem: Any) -> None:
        """Raise where its numbers are of another dimension than the body."""
        super().check(problem)
        if self._dims() != {problem.mesh.dim}:
            raise ProblemError(
                f"{self.name}: its numbers are of a body in {min(self._dims())} dimensions, and "
                f"this one has {problem.mesh.dim}: give force and about with as many numbers, and "
                "a moment of one in 2D, of three in 3D."
            )

    def traction(self, points: FacetPoints) -> Floats:
        """Tractions with this force and moment.

        Raises
        ------
        ProblemError
            A set that is too small for a moment.
        """
        x, weight = points.x, points.weight
        d = x.shape[1]
        force, moment, moment_point = np.zeros(3), np.zeros(3), np.zeros(3)
        area = weight.sum()
        centre = weight @ x / area
        r = np.zeros((len(x), 3))
        r[:, :d] = x - centre
        if self.force is not None:
            force[:d] = self.force
        if self.moment is not None:
            moment[3 - np.size(self.moment) :] = self.moment
        if self.about is not None:
            moment_point[:d] = self.about - centre
            # Moment about the centre of the set, where the force acts otherwise.
            moment = moment + np.cross(moment_point, force)
        inertia = np.einsum("q,q,ij->ij", weight, (r * r).sum(axis=1), np.eye(3))
        inertia -= np.einsum("q,qi,qj->ij", weight, r, r)
        turn = np.zeros(3)
        axes = slice(0 if d > 2 else 2, 3)  # a 2D body turns about the third axis
        if moment.any():
            values = np.linalg.eigvalsh(inertia[axes, axes])
            if values[0] <= 1e-12 * values[-1] or not values[-1]:
                raise ProblemError(
                    f"{self.name}: the set is too small or too slender for a moment."
                )
            turn[axes] = np.linalg.solve(inertia[axes, axes], moment[axes])
        return np.asarray((force / area + np.cross(turn, r))[:, :d])


@dataclass(frozen=True, eq=False)
class point_force(Load):  # noqa: N801
    """Force at a point of the body, or forces at several.

    Points beside the body, as where cells cut a curved side, are taken to its nearest place.

    Parameters
    ----------
    x : (d,) or (k, d) array, length
        A point, or several.
    f : (d,) or (k, d) array, force (per thickness in 2D)
        One force for all points, or one for each.

    Raises
    ------
    ProblemError
        Other than 2 or 3 numbers each, or another number in one than in the other.
    """

    x: Annotated[ArrayLike, PointRows(unit=LENGTH)]
    f: Annotated[ArrayLike, PointRows(unit=FORCE)]
    acts = frozenset({"point_force"})

    def __post_init__(self) -> None:
        super().__post_init__()
        x, f = np.shape(self.x), np.shape(self.f)
        if x[-1] != f[-1]:
            raise ProblemError(
                f"point_force: x {value_text(self.x)} and f {value_text(self.f)} must both have 2 "
                "or both 3 numbers."
            )
        if len(f) == 2 and f != x:
            raise ProblemError(
                f"point_force: f has {f[0]} rows, x is {x[0] if len(x) == 2 else 1} point(s): give "
                "one force for all points, or one for each."
            )

    @cached_property
    def name(self) -> str:
        """What messages and reports call it."""
        if np.ndim(self.x) == 2 and len(self.x) > 1:  # type: ignore[arg-type]
            return f"point_force({len(self.x)} points)"  # type: ignore[arg-type]
        return f"point_force({np.round(np.asarray(self.x), 6).tolist()})"

    def point_forces(self, mesh: Mesh) -> tuple[Ints, Floats, Floats]:
        """The places, and the forces."""
        x = np.atleast_2d(self.x)
        return *places_in_body(mesh, x, self.kind), np.broadcast_to(np.asarray(self.f), x.shape)


@dataclass(frozen=True, eq=False)
class line_force(Load):  # noqa: N801
    """Force along the edge in which two facet sets meet; in 2D at the point in which they meet.

    It is spread to the mesh points of the edge, as linear functions along it ask for. Where a crack
    crosses the edge, half of what acts on the edge of that cell goes to each side.

    Parameters
    ----------
    where, beside : str
        Names of the two facet sets.
    f : (d,) array or callable, force / length (in 2D force per thickness)
        Vector, or f(x) -> (n, d).

    Raises
    ------
    ProblemError
        Something else than these, or sets without a common edge.
    """

    where: Annotated[str, SetName()]
    beside: Annotated[str, SetName()]
    f: Annotated[ArrayLike | Callable[..., ArrayLike], VectorField(unit=LINE_FORCE)]
    acts = frozenset({"point_force"})

    @cached_property
    def name(self) -> str:
        """What messages and reports call it."""
        return f"line_force({self.where!r}, {self.beside!r})"

    def check(self, problem: Any) -> None:
        """Raise where it has another dimension than the body, or there is no such edge."""
        super().check(problem)
        self._edges(problem.mesh)

    def _edges(self, mesh: Mesh) -> Ints:
        """Segments of the edge `(k, 2)`; points `(k, 1)` in 2D."""
        sides = []
        for name in (self.where, self.beside):
            facets = np.sort(facet_set(mesh, name, self.kind), axis=1)
            corners = combinations(range(mesh.dim), mesh.dim - 1)
            sides.append(np.unique(np.concatenate([facets[:, c] for c in corners]), axis=0))
        edges_of_sides, count = np.unique(np.concatenate(sides), axis=0, return_counts=True)
        edges = edges_of_sides[count == 2]
        if not len(edges):
            raise ProblemError(
                f"{self.name}: the sets {self.where!r} and {self.beside!r} have no edge in common: "
                "name two sets of the boundary that meet."
            )
        return edges

    def point_forces(self, mesh: Mesh) -> tuple[Ints, Floats, Floats]:
        """Forces at the points of the edge; the rule is exact up to cubic f N."""
        number, force = self._nodal_forces(mesh)
        return *cells_of_points(mesh, number), force

    def _nodal_forces(self, mesh: Mesh) -> tuple[Ints, Floats]:
        """Mesh points, and the forces at them."""
        edges = self._edges(mesh)
        if mesh.dim == 2:
            number = edges[:, 0]
            return number, vector_at(self.f, mesh.points[number], self.kind)
        number, start, end = edges.ravel(), *mesh.points[edges].transpose(1, 0, 2)
        half = np.linalg.norm(end - start, axis=1)[:, None] / 2
        force = np.zeros((*edges.shape, mesh.dim))
        for s in (0.5 - 12**-0.5, 0.5 + 12**-0.5):  # two points of Gauss
            value = half * vector_at(self.f, (1 - s) * start + s * end, self.kind)
            force += np.stack([(1 - s) * value, s * value], axis=1)
        return number, force.reshape(-1, mesh.dim)


@dataclass(frozen=True, eq=False)
class body_force(Load):  # noqa: N801
    """Force per volume on the whole body.

    Parameters
    ----------
    b : (d,) array or callable, stress / length
        Vector, or f(x) -> (n, d).

    Raises
    ------
    ProblemError
        Something else than these.
    """

    b: Annotated[ArrayLike | Callable[..., ArrayLike], VectorField(unit=BODY_FORCE)]
    acts = frozenset({"volume"})

    def volume(self, x: Floats) -> Floats:
        """Its value."""
        return vector_at(self.b, x, self.kind)


@dataclass(frozen=True, eq=False)
class crack_pressure(Load):  # noqa: N801
    """Pressure on the faces of a crack, positive where it opens it.

    Parameters
    ----------
    p : float or callable, stress
        Number, or f(x) -> (n,).
    crack : int, optional
        One crack; all where it is left out.

    Raises
    ------
    ProblemError
        Something else than these; a crack that the problem does not have.
    """

    p: Annotated[float | Callable[..., ArrayLike], ScalarField(unit=STRESS)]
    crack: Annotated[int | None, Whole(least=0)] = None
    acts = frozenset({"face_pressure"})
    is_listed = False

    def check(self, problem: Any) -> None:
        """Raise where its crack is none of the problem."""
        super().check(problem)
        n = len(problem.cracks)
        if self.crack is not None and self.crack >= n:
            raise ProblemError(
                f"crack_pressure(crack={self.crack}): the problem has {n} crack(s), numbered "
                "from 0."
            )

    def face_pressure(self, x: Floats, crack: int) -> Floats | None:
        """Its value on its crack."""
        if self.crack not in (None, crack):
            return None
        return scalar_at(self.p, x, self.kind)


@dataclass(frozen=True, eq=False)
class initial_stress(Load):  # noqa: N801
    """Stress of the undeformed body; a load state does not scale it.

    Parameters
    ----------
    f : (d, d) array or callable, stress
        Symmetric stress, or f(x) -> (n, d, d).

    Raises
    ------
    ProblemError
        Something else than these.
    """

    f: Annotated[ArrayLike | Callable[..., ArrayLike], StressField(unit=STRESS)]
    acts = frozenset({"initial_stress"})
    is_steady = True
    relaxes = True
    is_listed = False

    def initial_stress(self, x: Floats, material: Material) -> Floats:
        """Its value."""
        return stress_at(self.f, x, self.kind)


@dataclass(frozen=True, eq=False)
class temperature(Load):  # noqa: N801
    """Change of temperature from the state without stress.

    It is an initial stress, ``-E / (1 - 2 nu) alpha dT`` in all directions (plane stress: ``-E / (1
    - nu) alpha dT`` in the plane), with its terms in the load vector and in K. As an initial
    stress, it is not scaled by a load state that is a number: give states as lists of loads for a
    temperature that changes in a cycle.

    Parameters
    ----------
    field : float or callable, temperature
        Change dT as a number or f(x) -> (n,), such as `read_field` returns.
    alpha : float, 1 / temperature, optional
        Coefficient of thermal expansion; that of the material where it is left out.

    Raises
    ------
    ProblemError
        Numbers that are not finite; a material without alpha; an alpha beside materials by set,
        which have one each.

    Examples
    --------
    >>> temperature(lambda x: 10.0 * x[:, 0], alpha=1.2e-5).alpha
    1.2e-05
    """

    field: Annotated[float | Callable[..., ArrayLike], ScalarField(unit=TEMPERATURE)]
    alpha: Annotated[float | None, Number(unit=PER_TEMPERATURE)] = None
    acts = frozenset({"initial_stress"})
    is_steady = True
    adds_up = True
    is_listed = False

    def check(self, problem: Any) -> None:
        """Raise where a material has no alpha, or where there are several beside one alpha."""
        super().check(problem)
        material_by_set = problem.elasticity.named
        if self.alpha is None:
            for _, material in material_by_set:
                material.expansion(problem.mesh.points[:1])
        elif len(material_by_set) > 1:
            raise ProblemError(
                f"temperature(alpha={self.alpha:g}): the body has several materials: leave alpha "
                "out, and give each its own, Isotropic(..., alpha=...)."
            )

    def initial_stress(self, x: Floats, material: Material) -> Floats:
        """What the body would bear if it could not expand."""
        alpha = material.expansion(x) if self.alpha is None else self.alpha
        return material.thermal_stress(scalar_at(self.field, x, self.kind), alpha, x.shape[1])


def _is_same_place(a: Any, b: Any) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return bool(isinstance(a, str) and isinstance(b, str) and a == b)
    return bool(len(a) == len(b) and (a == b).all())


__all__ = [
    "Condition",
    "FacetPoints",
    "Load",
    "Support",
    "bearing",
    "body_force",
    "crack_pressure",
    "displacement",
    "fix",
    "initial_stress",
    "point_force",
    "pressure",
    "resultant",
    "temperature",
    "traction",
]
