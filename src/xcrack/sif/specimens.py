"""Standard specimens: bodies with their sets named, loads that balance, and K of the standard."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt
from typing import Annotated, Any

from xcrack.base.arguments import Number, check_arguments
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.base.units import FORCE, LENGTH, STRESS
from xcrack.crack.crack import Crack
from xcrack.crack.lines import line_crack
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.plates import plate
from xcrack.model.loads import Load, Support, bearing, point_force, traction
from xcrack.model.problem import Problem
from xcrack.sif.handbook import HandbookK, handbook

Length = Annotated[float, Number(above=0, unit=LENGTH)]
Size = Annotated[float | None, Number(above=0, unit=LENGTH)]
Force = Annotated[float, Number(unit=FORCE)]
Angle = Annotated[float, Number(above=0, most=pi)]

_COARSE, _FINE = 16, 80  # cells across a specimen far from the crack, and where it runs
_PIN = pi / 3  # of a pin that rolls on the flattened holes of E399


@dataclass(frozen=True, eq=False)
class Specimen:
    """A specimen, cracked and loaded.

    Attributes
    ----------
    mesh : Mesh
    cracks : tuple of Crack
    loads : tuple of loads
        They balance: no supports are needed.
    handbook : HandbookK
        K of the standard.
    supports : tuple of supports
    """

    mesh: Mesh
    cracks: tuple[Crack, ...]
    loads: tuple[Load, ...]
    handbook: HandbookK
    supports: tuple[Support, ...] = ()

    def problem(self, material: Any, **choices: Any) -> Problem:
        """The problem of the specimen.

        Parameters
        ----------
        material : Material
        **choices
            Other arguments of `Problem`.

        Raises
        ------
        ProblemError
            As of `Problem`.
        """
        arguments: dict[str, Any] = {
            "cracks": self.cracks,
            "loads": self.loads,
            "supports": self.supports,
            "handbook": self.handbook,
            **choices,
        }
        return Problem(self.mesh, material, **arguments)

    def __repr__(self) -> str:
        return f"Specimen({self.handbook}; {self.mesh!r})"


def _sizes(width: float, size: float | None, size_near: float | None) -> dict[str, Any]:
    far_size = width / _COARSE if size is None else size
    return {
        "size": far_size,
        "size_near": min(width / _FINE, far_size) if size_near is None else size_near,
    }


def _check_crack(a: float, limit: float, label: str) -> None:
    if not a < limit:
        raise GeometryError(
            f"{label}: a = {a:g}: the crack leaves no ligament: give less than {limit:g}."
        )


@check_arguments(ProblemError)
def compact_tension(
    W: Length,
    a: Length,
    *,
    force: Force = 1.0,
    size: Size = None,
    size_near: Size = None,
    contact_angle: Angle = _PIN,
) -> Specimen:
    """Compact specimen, C(T), after ASTM E399 and E647; the line of the load is x = 0.

    Its notch is a part of the crack, which begins at the front face.

    Parameters
    ----------
    W : float, length
        From the line of the load to the back face.
    a : float, length
        Of the crack, from the line of the load.
    force : float, force per thickness
        Of each pin.
    size, size_near : float, length, optional
        Of cells far away, and along the line of the crack; W / 16 and W / 80 if left out.
    contact_angle : float, rad
        Over which the pins touch; the default is that of pins which roll on flattened holes.

    Returns
    -------
    Specimen
        Facet sets ``hole_0`` (upper), ``hole_1``, ``front``, ``back``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    _check_crack(a, W, "compact_tension")
    x, y = 0.25 * W, 0.6 * W
    mesh = plate(
        outline=[(-x, -y), (W, -y), (W, y), (-x, y)],
        holes=[((0.0, 0.275 * W), 0.125 * W), ((0.0, -0.275 * W), 0.125 * W)],
        along=[(0.0, 0.0), (0.95 * W, 0.0)], band=W / 20, transition=W / 2,
        sets={"front": [3], "back": [1]}, **_sizes(W, size, size_near),
    )  # fmt: skip
    return _pin_loaded_specimen(
        mesh, [(-1.001 * x, 0.0), (a, 0.0)], force, contact_angle, "compact", a, W
    )


@check_arguments(ProblemError)
def disc_compact(
    W: Length,
    a: Length,
    *,
    force: Force = 1.0,
    size: Size = None,
    size_near: Size = None,
    contact_angle: Angle = _PIN,
) -> Specimen:
    """Disc-shaped compact specimen, DC(T), after ASTM E399; the line of the load is x = 0.

    Parameters
    ----------
    W, a, force, size, size_near, contact_angle
        As of `compact_tension`.

    Returns
    -------
    Specimen
        Facet sets ``hole_0`` (upper), ``hole_1``, ``front``, ``rim``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    _check_crack(a, W, "disc_compact")
    radius, x = 0.675 * W, 0.25 * W
    middle = W - radius
    y = sqrt(radius**2 - (middle + x) ** 2)
    mesh = plate(
        outline=[(-x, -y), ((W, 0.0), (-x, y))],
        holes=[((0.0, 0.275 * W), 0.125 * W), ((0.0, -0.275 * W), 0.125 * W)],
        along=[(0.0, 0.0), (0.95 * W, 0.0)], band=W / 20, transition=W / 2,
        sets={"front": [1], "rim": [0]}, **_sizes(W, size, size_near),
    )  # fmt: skip
    return _pin_loaded_specimen(
        mesh, [(-1.001 * x, 0.0), (a, 0.0)], force, contact_angle, "disc", a, W
    )


def _pin_loaded_specimen(
    mesh: Mesh, points: Sequence[tuple[float, float]], force: float, contact_angle: float,
    kind: str, a: float, W: float,
) -> Specimen:  # fmt: skip
    """A specimen pulled by two pins."""
    pins = tuple(
        bearing(name, (0.0, sign * force), contact_angle)
        for name, sign in (("hole_0", 1.0), ("hole_1", -1.0))
    )
    return Specimen(mesh, (line_crack(points),), pins, handbook(kind, a=a, W=W, force=force))


@check_arguments(ProblemError)
def middle_tension(
    W: Length,
    a: Length,
    *,
    stress: Annotated[float, Number(unit=STRESS)] = 1.0,
    height: Size = None,
    size: Size = None,
    size_near: Size = None,
) -> Specimen:
    """Middle-cracked tension specimen, M(T), after ASTM E647; the crack lies about the origin.

    Parameters
    ----------
    W : float, length
        Width.
    a : float, length
        Half of the length of the crack.
    stress : float, stress
        On both ends.
    height : float, length, optional
        Between the ends; 4 W if left out.
    size, size_near : float, length, optional
        Of cells far away, and along the line of the crack; W / 16 and W / 80 if left out.

    Returns
    -------
    Specimen
        Facet sets ``left``, ``right``, ``bottom``, ``top``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    _check_crack(a, W / 2, "middle_tension")
    return _strip(W, (-a, a), -W / 2, height, stress, _sizes(W, size, size_near),
                  handbook("through", a=a, W=W, S=stress))  # fmt: skip


@check_arguments(ProblemError)
def single_edge_tension(
    W: Length,
    a: Length,
    *,
    stress: Annotated[float, Number(unit=STRESS)] = 1.0,
    height: Size = None,
    size: Size = None,
    size_near: Size = None,
) -> Specimen:
    """Single edge cracked specimen in tension, SE(T), its ends free to turn; the edge is x = 0.

    Parameters
    ----------
    W : float, length
        Width.
    a : float, length
        Of the crack.
    stress, height, size, size_near
        As of `middle_tension`.

    Returns
    -------
    Specimen
        Facet sets ``left``, ``right``, ``bottom``, ``top``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    _check_crack(a, W, "single_edge_tension")
    return _strip(W, (-0.001 * W, a), 0.0, height, stress, _sizes(W, size, size_near),
                  handbook("edge", a=a, W=W, S=stress))  # fmt: skip


def _strip(
    W: float, ends: tuple[float, float], left_side: float, height: float | None, stress: float,
    sizes: dict[str, Any], handbook_K: HandbookK,
) -> Specimen:  # fmt: skip
    height = 4 * W if height is None else height
    # The crack lies beside the points of the mesh.
    mesh = plate(
        W, height, lower=(left_side, -height / 2), along=[(left_side, 0.0), (left_side + W, 0.0)],
        band=W / 20,
        transition=W / 2, **sizes,
    )  # fmt: skip
    loads = traction("top", (0.0, stress)), traction("bottom", (0.0, -stress))
    crack = line_crack([(x, 0.0) for x in ends])
    return Specimen(mesh, (crack,), loads, handbook_K)


@check_arguments(ProblemError)
def single_edge_bend(
    W: Length,
    a: Length,
    *,
    force: Force = 1.0,
    size: Size = None,
    size_near: Size = None,
) -> Specimen:
    """Single edge cracked specimen in bending on three points, SE(B), after ASTM E399; span 4 W.

    The crack grows upwards from the origin.

    Parameters
    ----------
    W : float, length
        Height of the beam.
    a : float, length
        Of the crack.
    force : float, force per thickness
        In the middle.
    size, size_near : float, length, optional
        Of cells far away, and along the line of the crack; W / 16 and W / 80 if left out.

    Returns
    -------
    Specimen
        Facet sets ``left``, ``right``, ``bottom``, ``top``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    _check_crack(a, W, "single_edge_bend")
    half = 2.25 * W
    mesh = plate(
        outline=[(-half, 0.0), (-2 * W, 0.0), (0.0, 0.0), (2 * W, 0.0), (half, 0.0), (half, W),
                 (0.0, W), (-half, W)],
        along=[(0.0, 0.0), (0.0, 0.95 * W)], band=W / 20, transition=W / 2,
        sets={"bottom": [0, 1, 2, 3], "right": [4], "top": [5, 6], "left": [7]},
        **_sizes(W, size, size_near),
    )  # fmt: skip
    loads = (
        point_force([(0.0, W), (-2 * W, 0.0), (2 * W, 0.0)],
                    [(0.0, -force), (0.0, force / 2), (0.0, force / 2)]),
    )  # fmt: skip
    crack = line_crack([(0.0, -0.001 * W), (0.0, a)])
    return Specimen(mesh, (crack,), loads, handbook("bend", a=a, W=W, force=force))


@check_arguments(ProblemError)
def lug(
    W: Length,
    D: Length,
    a: Length,
    *,
    force: Force = 1.0,
    length: Size = None,
    size: Size = None,
    size_near: Size = None,
    contact_angle: Angle = pi,
) -> Specimen:
    """Lug with a round end and one crack at its hole, across the pull; the hole is at the origin.

    Parameters
    ----------
    W : float, length
        Width.
    D : float, length
        Diameter of the hole.
    a : float, length
        Of the crack, from the rim of the hole to the right.
    force : float, force per thickness
        Of the pin, upwards; the lower end balances it.
    length : float, length, optional
        From the middle of the hole to the lower end; 2 W if left out.
    size, size_near : float, length, optional
        Of cells far away, and at the hole and along the line of the crack; W / 16 and W / 80 if
        left out.
    contact_angle : float, rad
        Over which the pin touches.

    Returns
    -------
    Specimen
        Facet sets ``hole_0``, ``bottom``, ``head``, ``left``, ``right``.

    Raises
    ------
    ProblemError, GeometryError
        A number out of bounds, a crack through the ligament.
    """
    if not D < W:
        raise GeometryError(f"lug: D = {D:g}: it does not fit into W = {W:g}: make it smaller.")
    _check_crack(a, (W - D) / 2, "lug")
    half, half_length = W / 2, 2 * W if length is None else length
    mesh = plate(
        outline=[(-half, -half_length), (half, -half_length), (half, 0.0), ((0.0, half), (-half,
        0.0))],
        holes=[((0.0, 0.0), D / 2)], along=[(D / 2, 0.0), (half, 0.0)], band=W / 20,
        transition=W / 2, sets={"bottom": [0], "right": [1], "head": [2], "left": [3]},
        **_sizes(W, size, size_near),
    )  # fmt: skip
    loads = (
        bearing("hole_0", (0.0, force), contact_angle),
        traction("bottom", (0.0, -force / W)),
    )
    crack = line_crack([(0.999 * D / 2, 0.0), (D / 2 + a, 0.0)])
    return Specimen(mesh, (crack,), loads, handbook("lug", a=a, D=D, W=W, force=force))


__all__ = [
    "Specimen",
    "compact_tension",
    "disc_compact",
    "lug",
    "middle_tension",
    "single_edge_bend",
    "single_edge_tension",
]
