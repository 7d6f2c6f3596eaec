"""K of cracks that handbooks have, each with its source and where it holds.

DTDH is the Damage Tolerant Design Handbook of the US Air Force (AFRL-VA-WP-TR-2003-3002), section
11.3, read in the edition of 2002 at the pages that are named.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Number, Text, Whole, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import FORCE, LENGTH, STRESS
from xcrack.model.problem import ReferenceK
from xcrack.sif.sif import SIF
from xcrack.sif.stress_intensity import stress_intensity

Length = Annotated[float, Number(above=0, unit=LENGTH)]
Stress = Annotated[float, Number(unit=STRESS)]
_MOST = 1 - 1e-9


@dataclass(frozen=True)
class HandbookK(ReferenceK):
    """K_I of a crack as a handbook has it.

    Attributes
    ----------
    kind : str
    source : str
        Document, table or page.
    accuracy : str
        As the source says.
    holds : str
        Where the source says that it holds.
    """

    kind: ClassVar[str] = ""
    source: ClassVar[str] = ""
    accuracy: ClassVar[str] = ""
    holds: ClassVar[str] = ""
    dim: ClassVar[int] = 2

    crack: Annotated[int, Whole(least=0)] = field(default=0, kw_only=True)

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return True

    def K(self, phi: ArrayLike | None = None) -> Any:
        """K_I, stress √length; in 3D `(...)` at parametric angles phi (rad).

        Parameters
        ----------
        phi : (...), rad, optional
            In 3D: 0 where the half axis c ends, pi / 2 where a does.

        Raises
        ------
        ProblemError
            No angle in 3D.
        """
        if self.dim == 2:
            return float(self._K())
        if phi is None:
            raise ProblemError(f'handbook("{self.kind}").K: give the angle phi along the front.')
        angles = numbers(phi, "handbook: phi")
        if ((angles < 0) | (angles > pi / 2)).any():
            raise ProblemError("handbook: phi: give angles from 0 to pi / 2, in rad.")
        return self._factors_along(angles)

    def _K(self) -> Any:
        raise NotImplementedError

    def _factors_along(self, phi: Floats) -> Floats:
        raise NotImplementedError

    def _angle(self, sif: SIF) -> Floats:
        """Parametric angle of the places of a front."""
        raise NotImplementedError

    def at(self, sif: SIF) -> Floats:
        """K_I at the places of computed ones `(f,)`, nan where they are of another shape.

        Parameters
        ----------
        sif : SIF
        """
        if not isinstance(sif, SIF):
            raise ProblemError(f"handbook.at: give a SIF, not {type(sif).__name__}.")
        if sif.x.shape[1] != self.dim:
            raise ProblemError(
                f'handbook("{self.kind}") is of a body in {self.dim} dimensions, K of one in '
                f"{sif.x.shape[1]}: give one of these."
            )
        if self.dim == 2:
            return np.full(len(sif.K), self.K())
        return self._factors_along(self._angle(sif))

    def ratio(self, sif: SIF) -> Floats:
        """Computed K_I over that of the handbook at each place `(f,)`.

        Parameters
        ----------
        sif : SIF
        """
        handbook_K = self.at(sif)
        return np.asarray(sif.K_I / handbook_K)

    def comparison(self, solution: Any) -> str:
        """K of a solution beside this one, in words."""
        words = f"{self.kind}, {self.source}"
        if not self.in_range:
            words += f"; outside of where it holds ({self.holds})"
        try:
            sif = stress_intensity(solution, self.crack)
            handbook_K = self.at(sif)
        except XcrackError as error:
            return f"{words}: no comparison: {error}"
        is_inside = ~sif.at_surface
        ratio = (sif.K_I / handbook_K)[is_inside]
        if self.dim == 2:
            pairs = ", ".join(
                f"K_I {k:.6g} : {h:.6g} = {r:.4f}" for k, h, r in zip(sif.K_I, handbook_K, ratio)
            )
            return f"{pairs} ({words})"
        return (
            f"K_I {sif.K_I[is_inside].min():.6g} to {sif.K_I[is_inside].max():.6g} : "
            f"{handbook_K[is_inside].min():.6g} to {handbook_K[is_inside].max():.6g} = "
            f"{ratio.min():.4f} to {ratio.max():.4f} ({words})"
        )

    def __str__(self) -> str:
        parts = [f"{self.kind}: {self.source}", f"accuracy {self.accuracy}", f"holds {self.holds}"]
        if self.dim == 2:
            parts.insert(0, f"K_I = {self.K():.6g}")
        if not self.in_range:
            parts.append("these numbers are outside")
        return "; ".join(parts)


@dataclass(frozen=True)
class ThroughCrack(HandbookK):
    """Through crack of length 2 a in the middle of a strip of width W under tension S.

    Parameters
    ----------
    a, W : float, length
    S : float, stress
    """

    a: Length
    W: Length
    S: Stress
    kind = "through"
    source = "Tada, Paris and Irwin, The Stress Analysis of Cracks Handbook, 2.1"
    accuracy = "0.1 %"
    holds = "2 a < W, ends far"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return 2 * self.a < self.W

    def _K(self) -> Any:
        x = min(2 * self.a / self.W, _MOST)
        shape = (1 - 0.025 * x**2 + 0.06 * x**4) / np.sqrt(np.cos(pi * x / 2))
        return self.S * np.sqrt(pi * self.a) * shape


@dataclass(frozen=True)
class EdgeCrack(HandbookK):
    """Crack of length a from the edge of a strip of width W, under tension S and bending S_b.

    Parameters
    ----------
    a, W : float, length
    S : float, stress
        Far tension; the ends of the strip are free to turn.
    S_b : float, stress
        Far bending, at the edge of the crack.
    """

    a: Length
    W: Length
    S: Stress = 0.0
    S_b: Stress = 0.0
    kind = "edge"
    source = (
        "tension: Tada, Paris and Irwin, The Stress Analysis of Cracks Handbook, 2.10 (DTDH table "
        "11.3.8, p. 11.3.11); bending: Brown and Srawley, ASTM STP 410 (1966)"
    )
    accuracy = "0.5 %"
    holds = "a < W, in bending a <= 0.6 W; ends far"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return self.a < (self.W if self.S_b == 0.0 else 0.6 * self.W)

    def _K(self) -> Any:
        x = min(self.a / self.W, _MOST)
        half = pi * x / 2
        tension = np.sqrt(np.tan(half) / half) / np.cos(half)
        tension *= 0.752 + 2.02 * x + 0.37 * (1 - np.sin(half)) ** 3
        # A later fit of Tada for bending, valid to a = W, is 2 % below tables at a = 0.2 W.
        bending = 1.122 - 1.40 * x + 7.33 * x**2 - 13.08 * x**3 + 14.0 * x**4
        return (self.S * tension + self.S_b * bending) * np.sqrt(pi * self.a)


@dataclass(frozen=True)
class BendSpecimen(HandbookK):
    """Single edge bend specimen, SE(B), with a span of 4 W.

    Parameters
    ----------
    a, W : float, length
    force : float, force per thickness
        In the middle of the span.
    """

    a: Length
    W: Length
    force: Annotated[float, Number(unit=FORCE)]
    kind = "bend"
    source = "ASTM E399, annex A3; DTDH table 11.3.14, p. 11.3.22"
    # Below, the bending stress beside the load is less than that of a beam: 2.7 % of K at 0.1.
    accuracy = "0.5 %"
    holds = "0.3 <= a/W < 1, span 4 W"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return 0.3 <= self.a / self.W < 1

    def _K(self) -> Any:
        x = min(self.a / self.W, _MOST)
        shape = 1.99 - x * (1 - x) * (2.15 - 3.93 * x + 2.7 * x**2)
        shape *= 3 * np.sqrt(x) / (2 * (1 + 2 * x) * (1 - x) ** 1.5)
        return 4 * self.force / np.sqrt(self.W) * shape


@dataclass(frozen=True)
class CompactSpecimen(HandbookK):
    """Compact specimen, C(T).

    Parameters
    ----------
    a, W : float, length
        From the line of the load.
    force : float, force per thickness
    """

    a: Length
    W: Length
    force: Annotated[float, Number(unit=FORCE)]
    kind = "compact"
    source = "ASTM E399, annex A4; DTDH table 11.3.14, p. 11.3.22"
    accuracy = "0.5 %"
    holds = "0.2 <= a/W <= 1"
    factors: ClassVar[tuple[float, ...]] = (0.886, 4.64, -13.32, 14.72, -5.6)

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return 0.2 <= self.a / self.W < 1

    def _K(self) -> Any:
        x = min(self.a / self.W, _MOST)
        shape = np.polynomial.Polynomial(self.factors)(x)
        return self.force / np.sqrt(self.W) * (2 + x) / (1 - x) ** 1.5 * shape


@dataclass(frozen=True)
class DiscSpecimen(CompactSpecimen):
    """Disc-shaped compact specimen, DC(T).

    Parameters
    ----------
    a, W : float, length
        From the line of the load.
    force : float, force per thickness
    """

    kind = "disc"
    source = "ASTM E399, annex A5; DTDH table 11.3.14, p. 11.3.22"
    accuracy = "0.3 %"
    factors = (0.76, 4.8, -11.58, 11.43, -4.08)


def _f0(z: Any) -> Any:
    """Factor f0 of DTDH table 11.3.12."""
    return 0.7071 + 0.7548 * z + 0.3415 * z**2 + 0.642 * z**3 + 0.9196 * z**4


def _f1(z: Any) -> Any:
    """Factor f1 of DTDH table 11.3.12."""
    return 0.078 * z + 0.7588 * z**2 - 0.4293 * z**3 + 0.0644 * z**4 + 0.651 * z**5


@dataclass(frozen=True)
class HoleCrack(HandbookK):
    """One through crack of length a at a hole in the middle of a strip, under tension and a pin.

    Parameters
    ----------
    a, D, W : float, length
        Of the crack from the rim, diameter of the hole, width of the strip.
    S : float, stress
        Far tension on both ends.
    bearing : float, stress
        Force of the pin over diameter and thickness, which one end balances.
    """

    a: Length
    D: Length
    W: Length
    S: Stress = 0.0
    bearing: Stress = 0.0
    kind = "hole"
    source = "Shivakumar and Hsu, 1977, by DTDH table 11.3.10, p. 11.3.14"
    accuracy = "not stated; 1 % of Bowie's table in a wide strip"
    holds = "D + 2 a < W, ends far"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return self.D + 2 * self.a < self.W

    def _K(self) -> Any:
        z = 1 / (1 + 2 * self.a / self.D)
        turn = pi / 2 * min((self.D + self.a) / (self.W - self.a), _MOST)
        width = 1 / np.sqrt(np.cos(turn))
        pin = _f0(z) * self.D / (2 * self.W) + _f1(z)
        return (self.S * _f0(z) + self.bearing * pin) * width * np.sqrt(pi * self.a)


@dataclass(frozen=True)
class LugCrack(HandbookK):
    """One through crack of length a at the hole of a lug, across the pull of its pin.

    Parameters
    ----------
    a, D, W : float, length
        Of the crack from the rim, diameter of the hole, width of the lug.
    force : float, force per thickness
        Of the pin.
    """

    a: Length
    D: Length
    W: Length
    force: Annotated[float, Number(unit=FORCE)]
    kind = "lug"
    source = "Shivakumar and Hsu, 1977, and Zatz et al., 1981, by DTDH table 11.3.10, p. 11.3.15"
    accuracy = "not stated; finite elements are within 1.2 % for 0.3 <= D/W <= 0.5"
    holds = "D + 2 a < W, round or square end"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return self.D + 2 * self.a < self.W

    def _K(self) -> Any:
        z = 1 / (1 + 2 * self.a / self.D)
        r, x = self.D / self.W, 2 * self.a / (self.W - self.D)
        turn = pi / 2 * min((self.D + self.a) / (self.W - self.a), _MOST)
        width = 1 / np.sqrt(np.cos(turn) * np.cos(pi * r / 2))
        C_1 = 0.688 + 0.772 * r + 0.613 * r**2
        C_2 = 4.948 - 17.318 * r + 16.785 * r**2
        C_3 = -14.297 + 62.994 * r - 69.818 * r**2
        C_4 = 12.35 - 58.664 * r + 66.387 * r**2
        end = C_1 + C_2 * x + C_3 * x**2 + C_4 * x**3
        return self.force / self.D * (_f0(z) * r / 2 + _f1(z)) * width * end * np.sqrt(pi * self.a)


# --- fronts of quarter, half and whole ellipses


@dataclass(frozen=True)
class EllipticFront(HandbookK):
    """K along a front whose half axes are a and c."""

    a: Length
    c: Length
    dim = 3

    def _shape(self, phi: Floats) -> Floats:
        """How K varies along an ellipse in an infinite body, over √(pi a) (Irwin, 1962)."""
        r = self.a / self.c
        if r <= 1:
            Q = 1 + 1.464 * r**1.65
            return np.asarray((r**2 * np.cos(phi) ** 2 + np.sin(phi) ** 2) ** 0.25 / np.sqrt(Q))
        Q = 1 + 1.464 / r**1.65
        return np.asarray((np.cos(phi) ** 2 + np.sin(phi) ** 2 / r**2) ** 0.25 / np.sqrt(Q))

    def _angle(self, sif: SIF) -> Floats:
        """Parametric angle, from where the front ends and how far it comes in between."""
        angle = np.full(len(sif.K), np.nan)
        for number in np.unique(sif.front):
            rows = sif.front == number
            angle[rows] = self._angle_on(sif.x[rows], sif.frame[rows])
        return angle

    def _angle_on(self, x: Floats, frame: Floats) -> Floats:
        raise NotImplementedError


@dataclass(frozen=True)
class EmbeddedCrack(EllipticFront):
    """Elliptic crack far inside of a body, under tension S across it.

    Parameters
    ----------
    a, c : float, length
        Half axes.
    S : float, stress
    """

    S: Stress
    kind = "embedded"
    source = "Irwin, 1962, with the integral of Rawe's fit (Newman and Raju, 1981)"
    accuracy = "0.1 %"
    holds = "far from all sides"

    def _factors_along(self, phi: Floats) -> Floats:
        return self.S * np.sqrt(pi * self.a) * self._shape(phi)

    def _angle_on(self, x: Floats, frame: Floats) -> Floats:
        from_middle = x - (x.max(axis=0) + x.min(axis=0)) / 2
        distance = np.linalg.norm(from_middle, axis=1)
        long_axis = max(self.a, self.c)
        axis = from_middle[np.argmax(distance)] / distance.max()
        distance_along = from_middle @ axis
        distance_across = np.linalg.norm(from_middle - distance_along[:, None] * axis, axis=1)
        short_axis = min(self.a, self.c)
        angle = np.arctan2(distance_across / short_axis, np.abs(distance_along) / long_axis)
        return np.asarray(angle if self.c >= self.a else pi / 2 - angle)


@dataclass(frozen=True)
class SurfaceCrack(EllipticFront):
    """Half an ellipse on the surface of a plate under tension S and bending S_b.

    Parameters
    ----------
    a, c : float, length
        Depth, and half length on the surface.
    t, W : float, length
        Thickness and width of the plate.
    S, S_b : float, stress
        Far tension; far bending, at the surface of the crack.
    """

    t: Length
    W: Length
    S: Stress = 0.0
    S_b: Stress = 0.0
    kind = "surface"
    source = "Newman and Raju, Engng Fract. Mech. 15 (1981)"
    accuracy = "5 %"
    holds = "a/c <= 1, a < t, 4 c < W"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return self.a <= self.c and self.a < self.t and 4 * self.c < self.W

    def _factors_along(self, phi: Floats) -> Floats:
        r, q, s = self.a / self.c, self.a / self.t, np.sin(phi)
        M_2 = -0.54 + 0.89 / (0.2 + r)
        M_3 = 0.5 - 1 / (0.65 + r) + 14 * (1 - r) ** 24
        g = 1 + (0.1 + 0.35 * q**2) * (1 - s) ** 2
        width = 1 / np.sqrt(np.cos(pi * self.c / self.W * np.sqrt(q)))
        F = (1.13 - 0.09 * r + M_2 * q**2 + M_3 * q**4) * g * width
        H_1 = 1 - 0.34 * q - 0.11 * r * q
        H_2 = 1 - (1.22 + 0.12 * r) * q + (0.55 - 1.05 * r**0.75 + 0.47 * r**1.5) * q**2
        H = H_1 + (H_2 - H_1) * s ** (0.2 + r + 0.6 * q)
        return (self.S + H * self.S_b) * np.sqrt(pi * self.a) * F * self._shape(phi)

    def _angle_on(self, x: Floats, frame: Floats) -> Floats:
        middle = (x[0] + x[-1]) / 2
        return _half_angle(x - middle, x[-1] - x[0], self.a, self.c)


def _half_angle(from_middle: Floats, axis: Floats, a: float, c: float) -> Floats:
    """Parametric angle of points by their parts along a line and across it."""
    unit = axis / np.linalg.norm(axis)
    s = from_middle @ unit
    depth = np.linalg.norm(from_middle - s[:, None] * unit, axis=1)
    return np.asarray(np.arctan2(depth / a, np.abs(s) / c))


def _corner_angle(x: Floats, frame: Floats, a: float, c: float) -> Floats:
    """Parametric angle of points of a quarter ellipse whose corner is beside its ends.

    Which end is that of c is told by the distances of the ends from the corner: of a quarter circle
    it is not known, where K differs by 2 %.
    """
    least_misfit, angle = np.inf, np.full(len(x), np.nan)
    chord = x[-1] - x[0]
    normal = frame[:, 1].mean(axis=0)
    cross_axis = np.cross(normal, chord / np.linalg.norm(chord))
    cross_axis *= -np.sign(cross_axis @ (x[len(x) // 2] - x[0])) or 1.0
    length = float(np.linalg.norm(chord))
    for d_start, d_end in ((a, c), (c, a)):
        # The corner sees the ends at a right angle, at the distances d_start and d_end.
        share = (d_start**2 - d_end**2 + length**2) / (2 * length)
        height = np.sqrt(max(d_start**2 - share**2, 0.0))
        corner = x[0] + share * chord / length + height * cross_axis
        p, q = x[0] - corner, x[-1] - corner
        u, v = (x - corner) @ p / (p @ p), (x - corner) @ q / (q @ q)
        misfit = float(np.abs(u**2 + v**2 - 1).max())
        if misfit < least_misfit:
            least_misfit = misfit
            angle = np.arctan2(u, v) if d_start == a else np.arctan2(v, u)
    return angle


@dataclass(frozen=True)
class CornerCrack(EllipticFront):
    """Quarter of an ellipse at the corner of a plate under tension S.

    Parameters
    ----------
    a, c : float, length
        Along the thickness, along the width.
    t, W : float, length
        Thickness and width of the plate.
    S : float, stress
    """

    t: Length
    W: Length
    S: Stress
    kind = "corner"
    source = "Newman and Raju, NASA TM 85793 (1984), 1986"
    accuracy = "5 %"
    holds = "0.2 <= a/c <= 1, a < t, 2 c < W"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        return 0.2 <= self.a / self.c <= 1 and self.a < self.t and 2 * self.c < self.W

    def _factors_along(self, phi: Floats) -> Floats:
        r, q = self.a / self.c, self.a / self.t
        M_2 = -0.44 + 1.06 / (0.3 + r)
        M_3 = -0.5 + 0.25 * r + 14.8 * (1 - r) ** 15
        g_1 = 1 + (0.08 + 0.4 * q**2) * (1 - np.sin(phi)) ** 3
        g_2 = 1 + (0.08 + 0.15 * q**2) * (1 - np.cos(phi)) ** 3
        x = self.c / self.W * np.sqrt(q)
        width = 1 - 0.2 * x + 9.4 * x**2 - 19.4 * x**3 + 27.1 * x**4
        F = (1.08 - 0.03 * r + M_2 * q**2 + M_3 * q**4) * g_1 * g_2 * width
        return self.S * np.sqrt(pi * self.a) * F * self._shape(phi)

    def _angle_on(self, x: Floats, frame: Floats) -> Floats:
        return _corner_angle(x, frame, self.a, self.c)


@dataclass(frozen=True)
class CornerCrackAtHole(EllipticFront):
    """Quarter of an ellipse at a hole in the middle of a plate, under tension and a pin.

    Parameters
    ----------
    a, c : float, length
        Along the wall of the hole, along the surface of the plate.
    t, D, W : float, length
        Thickness of the plate, diameter of the hole, width of the plate.
    S : float, stress
        Far tension on both ends.
    bearing : float, stress
        Force of the pin over diameter and thickness, which one end balances.
    """

    t: Length
    D: Length
    W: Length
    S: Stress = 0.0
    bearing: Stress = 0.0
    kind = "corner_at_hole"
    source = "Newman and Raju, 1984, by DTDH tables 11.3.10 to 11.3.12, p. 11.3.14 to 11.3.18"
    accuracy = "5 % within 0.2 <= a/c <= 2"
    holds = "0.2 <= a/c <= 2, a < t, D + 2 c < W / 2"

    @property
    def in_range(self) -> bool:
        """Whether its numbers are within where it holds."""
        is_in_plate = self.a < self.t and self.D + 2 * self.c < self.W / 2
        return is_in_plate and 0.2 <= self.a / self.c <= 2

    def _factors_along(self, phi: Floats) -> Floats:
        r, q, D, W = self.a / self.c, self.a / self.t, self.D, self.W
        one_minus_sine, round_part = 1 - np.sin(phi), 1 + 0.1 * (1 - np.cos(phi)) ** 2
        thickness = 0.85 + 0.15 * q**0.25
        if r <= 1:
            m_1, m_2 = 1.13 - 0.09 * r, -0.54 + 0.89 / (0.2 + r)
            m_3 = 0.5 - 1 / (0.65 + r) + 14 * (1 - r) ** 24
            g_1 = 1 + (0.1 + 0.35 * q**2) * one_minus_sine**2
            g_3 = (1 + 0.04 * r) * round_part * thickness
            g_4 = 1 - 0.7 * (1 - q) * (r - 0.2) * (1 - r)
        else:
            m_1, m_2, m_3 = r**-0.5 + 0.04 * r**-1.5, 0.2 * r**-4, -0.11 * r**-4
            g_1 = 1 + (0.1 + 0.35 / r * q**2) * one_minus_sine**2
            g_3 = (1.13 - 0.09 / r) * round_part * thickness
            g_4 = 1.0
        z = 1 / (1 + 2 * self.c / D * np.cos(0.85 * phi))
        d = 1 + 0.13 * z**2
        turn = pi / 2 * np.sqrt(q) * (D + self.c) / (W - self.c)
        width = 1 / np.sqrt(np.cos(turn) * np.cos(pi * D / (2 * W)))
        G = (m_1 + m_2 * q**2 + m_3 * q**4) * g_1 * g_3 * g_4 * width * self._shape(phi)
        pin = (_f0(z) * D / (2 * W) + _f1(z) * np.sqrt((W + D) / (W - D))) / d
        K = (self.S * _f0(z) / d + self.bearing * pin) * G
        return np.asarray(K * np.sqrt(pi * self.a))

    def _angle_on(self, x: Floats, frame: Floats) -> Floats:
        return _corner_angle(x, frame, self.a, self.c)


KINDS: Mapping[str, type[HandbookK]] = {
    crack_type.kind: crack_type
    for crack_type in (
        ThroughCrack, EdgeCrack, BendSpecimen, CompactSpecimen, DiscSpecimen, HoleCrack, LugCrack,
        EmbeddedCrack, SurfaceCrack, CornerCrack, CornerCrackAtHole,
    )
}  # fmt: skip


@check_arguments()
def handbook(kind: Annotated[str, Text("one of " + ", ".join(KINDS))], **values: Any) -> HandbookK:
    """K of a crack as a handbook has it, with its source and where it holds.

    Parameters
    ----------
    kind : str
        ``"through"`` (a, W, S), ``"edge"`` (a, W, S, S_b), ``"hole"`` (a, D, W, S, bearing),
        ``"lug"`` (a, D, W, force), ``"compact"``, ``"disc"``, ``"bend"`` (a, W, force) in 2D, with
        forces per thickness; ``"embedded"`` (a, c, S), ``"surface"`` (a, c, t, W, S, S_b),
        ``"corner"`` (a, c, t, W, S), ``"corner_at_hole"`` (a, c, t, D, W, S, bearing) in 3D.
    **values
        Numbers of that kind, and `crack`, the number of the crack in a problem (0).

    Returns
    -------
    HandbookK
        ``.K()`` in 2D, ``.K(phi)`` along a front in 3D; ``.ratio(sif)``; printed, it names its
        source. `Problem(..., handbook=)` puts it beside the computed K in `solution.report`.

    Raises
    ------
    ProblemError
        No such kind, a number that is missing, unknown or out of bounds.

    Examples
    --------
    >>> print(handbook("compact", a=20.0, W=50.0, force=100.0).K().__round__(3))
    102.937
    """
    if kind not in KINDS:
        raise ProblemError(f"handbook: kind = {value_text(kind)}: give {', '.join(KINDS)}.")
    try:
        return KINDS[kind](**values)
    except TypeError as error:
        words = str(error).partition("()")[2].strip() or str(error)
        raise ProblemError(f'handbook("{kind}"): {words}: see help(xcrack.handbook).') from None


__all__ = ["KINDS", "HandbookK", "handbook"]
