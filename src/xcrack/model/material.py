"""What a body is made of: linear elastic materials."""

from dataclasses import dataclass, field, fields
from typing import Annotated

import numpy as np

from xcrack.base.arguments import Choice, Declared, Number
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import STRESS, TOUGHNESS

_VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  # rows of stiffness by component
_ROUND_OFF = 1e-12  # of the largest entry of a stiffness
_WRONG_PLANE = {
    2: 'a 2D body needs {}(..., plane="strain") or plane="stress": the two differ by up to '
    "1/(1 - nu²) in stiffness, so there is no default.",
    3: '{}(plane="{}") is for 2D bodies: leave plane out for a mesh of tetrahedra '
    "(read_mesh drops a constant z).",
}
_THICK = 2.5  # (K / yield stress)² from which a thickness is plane strain
_PLANES = ("strain", "stress")
_JUDGES = {"changes_results": False}  # what results are judged by, not what they are


class Material(Declared):
    """What a body is made of: linear elastic, and the same everywhere.

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
    """

    plane: str | None = None
    yield_stress: float | None = None
    K_c: float | None = None

    @property
    def kind(self) -> str:
        """What messages call it."""
        return type(self).__name__

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
        if (self.plane is None) is (dim == 2):
            raise ProblemError(_WRONG_PLANE[dim].format(self.kind, self.plane))

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

    def thermal_stress(self, change: Floats, alpha: float, dim: int) -> Floats:
        """Stress `(n, dim, dim)` of a change of temperature `(n,)` that cannot expand."""
        stiff = -self._plane_stiffness()[:, :3].sum(axis=1)[_VOIGT[:dim, :dim]]
        return np.asarray(alpha * change[:, None, None] * stiff)

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

    Raises
    ------
    ProblemError
        E <= 0, nu outside (-1, 0.5), another word for `plane`, or a yield stress or toughness that
        is not above 0.

    Examples
    --------
    >>> round(Isotropic(E=210e3, nu=0.3, plane="strain").E_prime)
    230769
    """

    E: Annotated[float, Number(above=0, unit=STRESS)]
    nu: Annotated[
        float,
        Number(above=-1, below=0.5, hint="a nearly incompressible material has such as 0.4999"),
    ]
    plane: Annotated[
        str | None, Choice(_PLANES, needs='"strain" or "stress" in 2D, nothing in 3D')
    ] = None
    yield_stress: Annotated[float | None, Number(above=0, unit=STRESS)] = field(
        default=None, metadata=_JUDGES
    )
    K_c: Annotated[float | None, Number(above=0, unit=TOUGHNESS)] = field(
        default=None, metadata=_JUDGES
    )

    def __repr__(self) -> str:
        given = {f.name: getattr(self, f.name) for f in fields(self)}
        parts = [f"{name}={value!r}" for name, value in given.items() if value is not None]
        return f"Isotropic({', '.join(parts)})"

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

    def thermal_stress(self, change: Floats, alpha: float, dim: int) -> Floats:
        """Stress `(n, dim, dim)` of a change of temperature `(n,)` that cannot expand."""
        stiff = -self.E / (1 - self.nu if self.plane == "stress" else 1 - 2 * self.nu)
        return np.asarray(alpha * stiff * change[:, None, None] * np.eye(dim))

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


def _tensors(value: object, what: str) -> Floats:
    tensors = numbers(value, what)
    if tensors.shape[-2:] not in ((2, 2), (3, 3)):
        raise ProblemError(
            f"{what} has the shape {tensors.shape}: give (..., 2, 2) or (..., 3, 3)."
        )
    return tensors
