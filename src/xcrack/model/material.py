"""What a body is made of: linear elastic materials."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Choice, Declared, Function, Number
from xcrack.base.arrays import Floats, Ints, at
from xcrack.base.checks import numbers, value_text, values_by_set
from xcrack.base.errors import ProblemError
from xcrack.base.units import PER_TEMPERATURE, STRESS, TOUGHNESS
from xcrack.model.values import ScalarField, scalar_at

_VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  # rows of stiffness by component
_ROUND_OFF = 1e-12  # of the largest entry of a stiffness
_THICK = 2.5  # (K / yield stress)² from which a thickness is plane strain
_PLANES = ("strain", "stress")
_JUDGES = {"changes_results": False}  # what results are judged by, not what they are


class Material(Declared):
    """What a body, or a part of it, is made of: linear elastic, and the same everywhere.

    One of your own is a frozen dataclass that derives from it, with the method `stiffness` and, for
    2D bodies, the field `plane`; the rest follows from these two. Where it is isotropic (in 2D: in
    the plane) K and all that needs K are those of the isotropic material with the same stiffness;
    else `at_tip` refuses. Two of them are compared by their fields: numbers, words and tuples.

    Attributes
    ----------
    plane : {"strain", "stress"} or None
        State of a 2D body; None in 3D.
    yield_stress : float, stress, or None
        What plastic zones and stresses are judged by; where it is None they are not.
    K_c : float, stress √length, or None
        Toughness at which growth ends.
    alpha : float, 1 / temperature, or None
        Coefficient of thermal expansion, alike in all directions.
    is_graded : bool
        Whether its stiffness changes from point to point: that of `unit` times `moduli`.
    """

    plane: str | None = None
    yield_stress: float | None = None
    K_c: float | None = None
    alpha: Any = None
    is_graded: ClassVar[bool] = False

    @property
    def kind(self) -> str:
        """What messages call it."""
        return type(self).__name__

    @property
    def unit(self) -> "Material":
        """The material itself; of a graded one that with the modulus one."""
        return self

    @property
    def modulus_field(self) -> Any:
        """Of a graded one the function that its modulus is; else None."""
        return None

    @property
    def named(self) -> "tuple[tuple[str, Material], ...]":
        """Materials by the names of their cell sets; one for the whole body has no name."""
        return (("", self),)

    def stored(self, moduli: Floats) -> "Material":
        """The material for a file: of a graded one its moduli at the nodes of the mesh `(n,)`."""
        return self

    def with_yield_stress(self, yield_stress: float) -> "Material":
        """The material, judged by another yield stress."""
        return replace(self.at_tip(), yield_stress=yield_stress, K_c=self.K_c)

    def expansion(self, x: Floats) -> Any:
        """Coefficient of thermal expansion at points `(q, d)`: a number, or `(q,)`.

        Raises
        ------
        ProblemError
            It has none.
        """
        if self.alpha is None:
            raise ProblemError(
                f"temperature: {self!r} has no alpha: give {self.kind}(..., alpha=...), the "
                "coefficient of thermal expansion."
            )
        return self.alpha

    def stiffness(self) -> Floats:
        """Stress xx, yy, zz, yz, xz, xy of strains xx, yy, zz and shear angles yz, xz, xy `(6, 6)`.

        Of the body in space, whatever `plane` says.
        """
        raise ProblemError(
            f"{self.kind} has no stiffness: give it a method stiffness() that returns (6, 6) "
            "numbers, stress."
        )

    def check(self, dim: int) -> None:
        """Raise where it does not suit a body in `dim` dimensions, or its stiffness is none.

        Raises
        ------
        ProblemError
            A plane state that is missing, unknown or too many; fields that cannot be compared; a
            stiffness of another shape, not symmetric, not positive, or one that shears a plane
            body out of its plane.
        """
        self._check_plane(dim)
        self._check_fields()
        C = numbers(self.stiffness(), f"{self.kind}: stiffness()", (6, 6))
        C_max = np.abs(C).max()
        if (np.abs(C - C.T) > _ROUND_OFF * C_max).any():
            raise ProblemError(
                f"{self.kind}: stiffness() is not symmetric: an elastic material has an energy."
            )
        lowest_eigenvalue = float(np.linalg.eigvalsh(C)[0])
        if not lowest_eigenvalue > 0:
            raise ProblemError(
                f"{self.kind}: stiffness() has the eigenvalue {lowest_eigenvalue:.4g}: all must be "
                "above 0."
            )
        if dim == 2 and (np.abs(C[[0, 1, 2, 5]][:, [3, 4]]) > _ROUND_OFF * C_max).any():
            raise ProblemError(
                f"{self.kind}: its stiffness shears a plane body out of its plane: turn the axes "
                "of the material until z is one of symmetry, or model the body in 3D."
            )

    def _check_plane(self, dim: int) -> None:
        if self.plane is None and dim == 2:
            raise ProblemError(
                f'a 2D body needs {self.kind}(..., plane="strain") or plane="stress": the two '
                "differ by up to 1/(1 - nu²) in stiffness, so there is no default."
            )
        if self.plane is not None and dim == 3:
            raise ProblemError(
                f'{self.kind}(plane="{self.plane}") is for 2D bodies: leave plane out for a mesh '
                "of tetrahedra (read_mesh drops a constant z)."
            )

    def _check_fields(self) -> None:
        if self.plane not in (None, *_PLANES):
            raise ProblemError(
                f'{self.kind}: plane = {value_text(self.plane)}: give "strain" or "stress".'
            )
        try:
            hash(self)
        except TypeError:
            raise ProblemError(
                f"{self.kind}: its fields cannot be compared, and what was computed for one "
                "material is used again for an equal one: let it be a frozen dataclass of numbers, "
                "words and tuples, without arrays or lists."
            ) from None

    @property
    def largest_modulus(self) -> float:
        """Largest Young's modulus along the axes, stress: a scale of the stiffness."""
        return float(1 / np.diag(np.linalg.inv(self.stiffness()))[:3].min())

    def _plane_stiffness(self) -> Floats:
        """Stiffness `(6, 6)` where nothing acts across the plane of plane stress."""
        C = np.asarray(self.stiffness(), dtype=float)
        return C - np.outer(C[:, 2], C[2]) / C[2, 2] if self.plane == "stress" else C

    def tensor(self, dim: int) -> Floats:
        """Stiffness in the body `(dim, dim, dim, dim)`, stress; in 2D that of the plane state."""
        rows = _VOIGT[:dim, :dim]
        return self._plane_stiffness()[rows[:, :, None, None], rows]

    def stress(self, gradient: Floats) -> Floats:
        """Stress `(..., d, d)` of a displacement gradient `(..., d, d)` (row: component)."""
        gradient = _tensors(gradient, f"{self.kind}.stress: gradient")
        return np.einsum("ijkl,...kl->...ij", self.tensor(gradient.shape[-1]), gradient)

    def strain(self, stress: Floats) -> Floats:
        """Strain `(..., d, d)` of an in-plane (or 3D) stress `(..., d, d)`."""
        stress = _tensors(stress, f"{self.kind}.strain: stress")
        d = stress.shape[-1]
        compliance_tensor = np.linalg.pinv(self.tensor(d).reshape(d * d, d * d)).reshape((d,) * 4)
        return np.einsum("ijkl,...kl->...ij", compliance_tensor, stress)

    def stress_across(self, stress: Floats) -> Floats:
        """Stress across the plane `(...)` of a plane body, from that in it `(..., 2, 2)`."""
        C_zz_row = self._plane_stiffness()[2, _VOIGT[:2, :2]]
        return np.asarray(np.einsum("kl,...kl->...", C_zz_row, self.strain(stress)))

    def thermal_stress(self, change: Floats, alpha: Any, dim: int) -> Floats:
        """Stress `(n, dim, dim)` of a change of temperature `(n,)` that cannot expand.

        Alpha is a number, or one at each point `(n,)`.
        """
        stiffness = -self._plane_stiffness()[:, :3].sum(axis=1)[_VOIGT[:dim, :dim]]
        return np.asarray(_by_point(alpha) * change[:, None, None] * stiffness)

    def constraint(self, thickness: float, square: float) -> str:
        """Whether a plastic zone is that of plane "strain" or of plane "stress".

        Parameters
        ----------
        thickness : float, length
            Of a body in space.
        square : float, length
            (K / yield stress)²: plane strain needs 2.5 times as much thickness (ASTM E399).
        """
        if self.plane is not None:
            return self.plane
        return "strain" if thickness >= _THICK * square else "stress"

    def at_tip(self) -> "Isotropic":
        """The isotropic material whose fields surround a tip: constants of K, G and criteria.

        Raises
        ------
        ProblemError
            The fields at a tip are others: the stiffness (in 2D that in the plane) depends on the
            direction.
        """
        lam, mu, remainder = isotropic_part(self.tensor(2 if self.plane else 3))
        if remainder is not None:
            raise ProblemError(
                f"{self.kind} is not isotropic: K, its error bars and directions of growth are "
                "those of isotropic tips. Displacements, stresses, openings and compliance hold; "
                "for K give an isotropic material."
            )
        plane, in_plane = self.plane, lam / (lam + 2 * mu)
        if plane and abs(in_plane) >= 0.5:  # beyond what isotropy in space allows to this state:
            plane = "strain" if in_plane > 0 else "stress"  # the other has the same stiffness
        nu = in_plane if plane == "stress" else lam / (2 * (lam + mu))
        return Isotropic(2 * mu * (1 + nu), nu, plane)


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress `(...)` of full stress tensors `(..., 3, 3)`.

    >>> float(von_mises(np.diag([2.0, 0.0, 0.0])))
    2.0
    """
    deviator = stress - np.trace(stress, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("...ij,...ij->...", deviator, deviator)))


def isotropic_tensor(lam: float, mu: float, dim: int) -> Floats:
    """Stiffness `(dim, dim, dim, dim)` of Lamé's constants."""
    C = np.zeros((dim,) * 4)
    for i in range(dim):
        for j in range(dim):
            C[i, i, j, j] += lam
            C[i, j, i, j] += mu
            C[i, j, j, i] += mu
    return C


def isotropic_part(tensor: Floats) -> tuple[float, float, Floats | None]:
    """Lamé's constants of a stiffness `(d, d, d, d)`, and what remains of it beside them.

    None remains where it is round-off.
    """
    lam, mu = float(tensor[0, 0, 1, 1]), float(tensor[0, 1, 0, 1])
    remainder = tensor - isotropic_tensor(lam, mu, len(tensor))
    if (np.abs(remainder) > _ROUND_OFF * np.abs(tensor).max()).any():
        return lam, mu, remainder
    return lam, mu, None


_NU = Number(above=-1, below=0.5, hint="a nearly incompressible material has such as 0.4999")
_PLANE = Choice(_PLANES, needs='"strain" or "stress" in 2D, nothing in 3D')


@dataclass(frozen=True)
class Isotropic(Material):
    """Isotropic linear elastic material; nothing has a default but the plane of a 3D body.

    Parameters
    ----------
    E : float, stress
        Young's modulus.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress"}, optional
        State of a 2D body; None in 3D.
    yield_stress : float, stress, optional
        Lets plastic zones be compared with crack and ligament, and stresses with it: see `check`.
    K_c : float, stress √length, optional
        Toughness: growth ends where K reaches it, unless `grow` is given another one.
    alpha : float, 1 / temperature, optional
        Coefficient of thermal expansion, for loads such as `temperature(dT)`.

    Raises
    ------
    ProblemError
        E <= 0, nu outside (-1, 0.5), another word for `plane`, a yield stress or toughness that
        is not above 0, or an alpha that is no number.

    Examples
    --------
    >>> round(Isotropic(E=210e3, nu=0.3, plane="strain").E_prime)
    230769
    """

    E: Annotated[float, Number(above=0, unit=STRESS)]
    nu: Annotated[float, _NU]
    plane: Annotated[str | None, _PLANE] = None
    yield_stress: Annotated[float | None, Number(above=0, unit=STRESS)] = field(
        default=None, metadata=_JUDGES
    )
    K_c: Annotated[float | None, Number(above=0, unit=TOUGHNESS)] = field(
        default=None, metadata=_JUDGES
    )
    alpha: Annotated[float | None, Number(unit=PER_TEMPERATURE)] = None

    def __repr__(self) -> str:
        return _text(self)

    def stiffness(self) -> Floats:
        """Stiffness in space `(6, 6)`, stress."""
        C = np.diag(np.repeat([2 * self.mu, self.mu], 3))
        C[:3, :3] += self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        return C

    def check(self, dim: int) -> None:
        """Raise where the plane state does not suit a body in `dim` dimensions."""
        self._check_plane(dim)

    @property
    def largest_modulus(self) -> float:
        """Young's modulus, stress."""
        return self.E

    def tensor(self, dim: int) -> Floats:
        """Stiffness `(dim, dim, dim, dim)` of the constants in use, stress."""
        return isotropic_tensor(self.lam, self.mu, dim)

    def at_tip(self) -> "Isotropic":
        """The material itself."""
        return self

    @property
    def mu(self) -> float:
        """Shear modulus, stress."""
        return self.E / (2 * (1 + self.nu))

    @property
    def lam(self) -> float:
        """First Lamé constant in use, stress; in plane stress 2 lam mu / (lam + 2 mu)."""
        lam = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        return 2 * lam * self.mu / (lam + 2 * self.mu) if self.plane == "stress" else lam

    @property
    def kolosov(self) -> float:
        """Kolosov's constant: 3 - 4 nu (plane strain and 3D) or (3 - nu) / (1 + nu)."""
        return (3 - self.nu) / (1 + self.nu) if self.plane == "stress" else 3 - 4 * self.nu

    @property
    def E_prime(self) -> float:
        """E in plane stress, else E / (1 - nu²), stress."""
        return self.E if self.plane == "stress" else self.E / (1 - self.nu**2)

    def stress_across(self, stress: Floats) -> Floats:
        """Stress across the plane `(...)` of a plane body, from that in it `(..., 2, 2)`."""
        nu = self.nu if self.plane == "strain" else 0.0
        return np.asarray(nu * np.trace(stress, axis1=-2, axis2=-1))

    def thermal_stress(self, change: Floats, alpha: Any, dim: int) -> Floats:
        """Stress `(n, dim, dim)` of a change of temperature `(n,)` that cannot expand."""
        stiffness = -self.E / (1 - self.nu if self.plane == "stress" else 1 - 2 * self.nu)
        return np.asarray(_by_point(alpha) * stiffness * change[:, None, None] * np.eye(dim))

    def stress(self, gradient: Floats) -> Floats:
        """Stress `(..., d, d)` of a displacement gradient `(..., d, d)` (row: component)."""
        gradient = _tensors(gradient, "Isotropic.stress: gradient")
        strain = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
        trace = np.trace(strain, axis1=-2, axis2=-1)
        return 2 * self.mu * strain + self.lam * trace[..., None, None] * np.eye(strain.shape[-1])

    def strain(self, stress: Floats) -> Floats:
        """Strain `(..., d, d)` of an in-plane (or 3D) stress `(..., d, d)`."""
        stress = _tensors(stress, "Isotropic.strain: stress")
        d = stress.shape[-1]
        trace = np.trace(stress, axis1=-2, axis2=-1)[..., None, None]
        return (stress - self.lam / (d * self.lam + 2 * self.mu) * trace * np.eye(d)) / (
            2 * self.mu
        )


def _tensors(value: object, label: str) -> Floats:
    tensors = numbers(value, label)
    if tensors.shape[-2:] not in ((2, 2), (3, 3)):
        raise ProblemError(
            f"{label} has the shape {tensors.shape}: give (..., 2, 2) or (..., 3, 3)."
        )
    return tensors


def _by_point(value: Any) -> Any:
    """A number, or one at each point as it multiplies tensors `(q, 1, 1)`."""
    return value if np.ndim(value) == 0 else np.asarray(value)[:, None, None]


def _words(value: Any) -> str:
    """A value, or the name of a function."""
    if not callable(value):
        return repr(value)
    return str(getattr(value, "__name__", getattr(value, "name", type(value).__name__)))


def _text(material: Any) -> str:
    """What was given to make it."""
    values = {f.name: getattr(material, f.name) for f in fields(material)}
    parts = [f"{name}={_words(value)}" for name, value in values.items() if value is not None]
    return f"{material.kind}({', '.join(parts)})"


@dataclass(frozen=True, eq=False)
class StoredFunction:
    """A function of a graded material in a file: its values at the nodes of the mesh.

    Attributes
    ----------
    name : str
        Of the function that it was.
    values : (n,) array
        At the points of the mesh, then at the middles of its edges; nan where they are not known.
    """

    name: str
    values: Floats

    def __call__(self, x: Floats) -> Floats:
        """Refuse points that are no nodes."""
        raise ProblemError(
            f"the function {self.name} of a graded material was stored with its solution for the "
            "mesh of that alone: make the problem again by the script that made it."
        )


def at_nodes(modulus: Any, nodes: Ints) -> Any:
    """A modulus as a function of nodes, in their order: a stored one knows no other points."""
    values_at_points = isinstance(modulus, StoredFunction) and nodes.max(initial=0) < len(
        modulus.values
    )
    values = modulus.values[nodes] if values_at_points else None
    if values is None or not np.isfinite(values).all():
        return modulus
    return lambda x: values


@dataclass(frozen=True)
class Graded(Material):
    """Isotropic material whose Young's modulus changes from point to point.

    As in a graded coating, or in a hot part with E(T(x)). E is taken as linear in each cell
    between its values at the corners.

    Parameters
    ----------
    E : callable, stress
        Young's modulus f(x) -> (n,) at points (n, d), above 0.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress"}, optional
        State of a 2D body; None in 3D.
    yield_stress, K_c
        As of `Isotropic`.
    alpha : float or callable, 1 / temperature, optional
        Coefficient of thermal expansion, a number or f(x) -> (n,).

    Raises
    ------
    ProblemError
        E is not a function; else as of `Isotropic`. A problem refuses values of E that are not
        above 0, not finite, or of another shape.

    Examples
    --------
    >>> coated = Graded(E=lambda x: 210e3 - 1e3 * x[:, 1], nu=0.3, plane="strain")
    >>> coated.moduli(np.array([(0.0, 10.0)]))
    array([200000.])
    """

    E: Annotated[
        Callable[[Floats], ArrayLike],
        Function("a function f(x) of points; one number is that of Isotropic"),
    ]
    nu: Annotated[float, _NU]
    plane: Annotated[str | None, _PLANE] = None
    yield_stress: Annotated[float | None, Number(above=0, unit=STRESS)] = field(
        default=None, metadata=_JUDGES
    )
    K_c: Annotated[float | None, Number(above=0, unit=TOUGHNESS)] = field(
        default=None, metadata=_JUDGES
    )
    alpha: Annotated[
        float | Callable[[Floats], ArrayLike] | None, ScalarField(unit=PER_TEMPERATURE)
    ] = None
    is_graded = True

    def __repr__(self) -> str:
        return _text(self)

    @property
    def unit(self) -> Isotropic:
        """The material whose Young's modulus is one."""
        return Isotropic(1.0, self.nu, self.plane)

    @property
    def modulus_field(self) -> Any:
        """The function that Young's modulus is."""
        return self.E

    def stored(self, moduli: Floats) -> "Graded":
        """The material for a file, with its moduli at the nodes of the mesh `(n,)`."""
        alpha: Any = self.alpha
        if callable(alpha):
            alpha = StoredFunction(_words(alpha), np.zeros(0))
        return replace(self, E=StoredFunction(_words(self.E), moduli), alpha=alpha)

    def check(self, dim: int) -> None:
        """Raise where the plane state does not suit a body in `dim` dimensions."""
        self._check_plane(dim)
        self._check_fields()

    def with_yield_stress(self, yield_stress: float) -> "Graded":
        """The material, judged by another yield stress."""
        return replace(self, yield_stress=yield_stress)

    def stiffness(self) -> Floats:
        """Refused: it has one at each place."""
        raise ProblemError(
            f"{self!r} has another stiffness at each place: ask problem.elasticity at points."
        )

    def at_tip(self) -> Isotropic:
        """Refused: it is another one at each tip."""
        raise ProblemError(
            f"{self!r} is another material at each tip: a SIF has the constants at its own."
        )

    def moduli(self, x: Floats, nodes: Ints | None = None) -> Floats:
        """Young's modulus at points `(n, d)`, checked `(n,)`.

        Parameters
        ----------
        x : (n, d) array, length
        nodes : (n,) array of int, optional
            Their numbers among the nodes of order 2 of the mesh: of a stored material, no function
            but its values there are left.

        Raises
        ------
        ProblemError
            Another shape, values that are not finite or not above 0.
        """
        E = scalar_at(self.E if nodes is None else at_nodes(self.E, nodes), x, "Graded: E")
        if len(E) and not E.min() > 0:
            raise ProblemError(
                f"Graded: E = {E.min():.6g} at {at(x[np.argmin(E)])} ({int((E <= 0).sum())} such "
                "points): give values above 0 in all of the body."
            )
        return E

    def expansion(self, x: Floats) -> Any:
        """Coefficient of thermal expansion at points `(q, d)`."""
        alpha = super().expansion(x)
        return scalar_at(alpha, x, "Graded: alpha") if callable(alpha) else alpha


class ScaledMaterial(Material):
    """A graded material at some points: the stiffness of its unit times a factor at each.

    Parameters
    ----------
    graded : Material
    factor : (q,) array
    """

    def __init__(self, graded_material: Material, factor: Floats) -> None:
        self.graded_material, self.unit_material, self.factor = (
            graded_material,
            graded_material.unit,
            factor,
        )
        self.plane = graded_material.plane

    def expansion(self, x: Floats) -> Any:
        """Coefficient of thermal expansion at the points."""
        return self.graded_material.expansion(x)

    def tensor(self, dim: int) -> Floats:
        """Stiffness at the points `(q, dim, dim, dim, dim)`, stress."""
        return np.multiply.outer(self.factor, self.unit_material.tensor(dim))

    def stress(self, gradient: Floats) -> Floats:
        """Stress `(q, d, d)` of displacement gradients at the points."""
        return self.factor[:, None, None] * self.unit_material.stress(gradient)

    def strain(self, stress: Floats) -> Floats:
        """Strain `(q, d, d)` of stresses at the points."""
        return self.unit_material.strain(stress) / self.factor[:, None, None]

    def stress_across(self, stress: Floats) -> Floats:
        """Stress across the plane `(q,)` of a plane body."""
        return self.unit_material.stress_across(stress)

    def thermal_stress(self, change: Floats, alpha: Any, dim: int) -> Floats:
        """Stress `(q, dim, dim)` of a change of temperature that cannot expand."""
        unit_stress = self.unit_material.thermal_stress(change, alpha, dim)
        return self.factor[:, None, None] * unit_stress


@dataclass(frozen=True)
class MaterialSets(Material):
    """Materials by the names of cell sets of the mesh; bonded where they meet.

    ``Problem(mesh, {"plate": ..., "weld": ...})`` is short for it. Each cell of the mesh must be in
    just one of the sets.

    Parameters
    ----------
    materials : mapping of str to Material

    Raises
    ------
    ProblemError
        No mapping of names to materials. A problem refuses sets that the mesh does not have, that
        are empty, that overlap or leave cells out, and materials of different `plane`.

    Examples
    --------
    >>> steel, weld = Isotropic(210e3, 0.3, "strain"), Isotropic(190e3, 0.3, "strain")
    >>> MaterialSets({"plate": steel, "weld": weld})["weld"].E
    190000.0
    """

    materials: Any

    def __post_init__(self) -> None:
        pairs = values_by_set(
            self.materials, "material", "materials", "Isotropic",
            "a material such as Isotropic(...)", lambda material: isinstance(material, Material),
        )  # fmt: skip
        for name, material in pairs:
            if isinstance(material, MaterialSets):
                raise ProblemError(
                    f"material: {value_text(name)} holds materials by set itself: give one mapping."
                )
        object.__setattr__(self, "materials", tuple((str(n), m) for n, m in pairs))

    def __getitem__(self, name: str) -> Material:
        return dict(self.materials)[name]

    def __iter__(self) -> Iterator[str]:
        return (name for name, _ in self.materials)

    def __repr__(self) -> str:
        return "{" + ", ".join(f"{name!r}: {material!r}" for name, material in self.materials) + "}"

    @property
    def plane(self) -> str | None:  # type: ignore[override]
        """State of a 2D body, of all its materials."""
        return self.materials[0][1].plane

    @property
    def named(self) -> tuple[tuple[str, Material], ...]:
        """Materials by the names of their cell sets."""
        return tuple(self.materials)

    @property
    def K_c(self) -> float | None:  # type: ignore[override]
        """Toughness of the least tough of those whose toughness is known."""
        return min((m.K_c for _, m in self.materials if m.K_c is not None), default=None)

    @property
    def yield_stress(self) -> float | None:  # type: ignore[override]
        """Yield stress of the weakest of those whose yield stress is known."""
        limits = (m.yield_stress for _, m in self.materials if m.yield_stress is not None)
        return min(limits, default=None)

    def with_yield_stress(self, yield_stress: float) -> "MaterialSets":
        """All of them, judged by one yield stress."""
        return MaterialSets({
            name: material.with_yield_stress(yield_stress) for name, material in self.materials
        })  # fmt: skip

    def check(self, dim: int) -> None:
        """Raise where one of them does not suit a body in `dim` dimensions.

        Raises
        ------
        ProblemError
            What its material says, with its name; different plane states.
        """
        for name, material in self.materials:
            try:
                material.check(dim)
            except ProblemError as error:
                raise ProblemError(f"material of {name!r}: {error}") from None
        key = next((n for n, m in self.materials if m.plane != self.plane), None)
        if key is not None:
            raise ProblemError(
                f'material: {self.materials[0][0]!r} is of plane "{self.plane}", and {key!r} of '
                f'plane "{self[key].plane}": give all the same.'
            )

    def stiffness(self) -> Floats:
        """Refused: each set has its own."""
        raise ProblemError(
            "materials by set have a stiffness each: ask problem.material[name], or "
            "problem.elasticity at points."
        )

    def at_tip(self) -> Isotropic:
        """Refused: each tip has its own."""
        raise ProblemError(
            "materials by set: a tip has that of its own set, and a SIF its constants."
        )
