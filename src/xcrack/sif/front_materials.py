"""Materials along a front: K is that of the material at each of its points.

Fields of unit K go with the stiffness C_t at the foot of each point. Where a modulus changes along
the front, their displacements are those of one reference modulus and their stresses go like E(s):
K is then found of this reference, and its displacements do not change along the front. Where the
front passes into another material the reference changes, and K / E' is what is continuous.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.errors import GeometryError, warn
from xcrack.crack.fronts import FrontCurve
from xcrack.mesh.locate import cells_at
from xcrack.model.elasticity import Elasticity
from xcrack.model.material import Isotropic

_SAMPLES = 512  # along a front
_HALVINGS = 40
_BESIDE = 0.05  # cells: a front that has another material so near beside it runs along an interface
BESIDE = 1.0  # cells from where a front passes into another material: K of a place is read there


@dataclass(frozen=True, eq=False)
class FrontMaterials:
    """Materials along a front.

    Attributes
    ----------
    references : tuple of Isotropic
        One for each piece of the front between places at which the material changes.
    breaks : (p + 1,) array, length
        Parameters at which the pieces begin and end.
    logarithms : tuple of CubicSpline or None
        Of E over that of the reference, by the parameter; None where it is one.
    period : float, length, or None
        Of a closed front.
    """

    references: tuple[Isotropic, ...]
    breaks: Floats
    logarithms: tuple[CubicSpline | None, ...]
    period: float | None

    @property
    def is_one(self) -> bool:
        """Whether all of the front has one stiffness."""
        return len(self.references) == 1 and self.logarithms[0] is None

    @property
    def changes(self) -> Floats:
        """Parameters at which the material changes, length."""
        inner_breaks = self.breaks[1:-1]
        if self.period is None or len(self.references) < 2:
            return inner_breaks
        return np.append(inner_breaks, self.breaks[-1])

    def pieces(self, s: Floats) -> Ints:
        """Number of the piece at parameters `(q,)`."""
        if self.period is not None:
            s = np.mod(s - self.breaks[0], self.period) + self.breaks[0]
        last_piece = len(self.references) - 1
        return np.clip(np.searchsorted(self.breaks, s, side="right") - 1, 0, last_piece)

    def ratio(self, piece: int, s: Floats) -> tuple[Floats, Floats] | None:
        """E over that of the reference, and the derivative of its logarithm; None where it is 1."""
        spline = self.logarithms[piece]
        if spline is None:
            return None
        return np.exp(spline(s)), np.asarray(spline(s, 1))

    def parts(self, s: Floats) -> Iterator[tuple[Isotropic, Bools, tuple[Floats, Floats] | None]]:
        """Points by piece of the front: its reference, which points, and `ratio` at these."""
        piece = self.pieces(s)
        for k in np.unique(piece).tolist():
            rows = piece == k
            yield self.references[k], rows, self.ratio(k, s[rows])

    def moduli(self, s: Floats) -> tuple[Floats, Floats]:
        """E' and Poisson's ratio at parameters `(q,)`."""
        E_prime, nu = np.empty(len(s)), np.empty(len(s))
        for reference, rows, ratio in self.parts(s):
            E_prime[rows] = reference.E_prime * (1.0 if ratio is None else ratio[0])
            nu[rows] = reference.nu
        return E_prime, nu

    def modulus_ratio(self, s: Floats) -> Floats:
        """E over that of the reference of each piece at parameters `(q,)`."""
        result = np.ones(len(s))
        for _, rows, ratio in self.parts(s):
            if ratio is not None:
                result[rows] = ratio[0]
        return result

    def factors(self, s: Floats) -> Floats:
        """K over that of the first reference for the same displacements `(q, 3)`."""
        first, result = self.references[0], np.ones((len(s), 3))
        for reference, rows, _ in self.parts(s):
            result[rows, :2] = reference.E_prime / first.E_prime
            result[rows, 2] = reference.mu / first.mu
        return result * self.modulus_ratio(s)[:, None]

    def beside_changes(self, s: Floats, size: float) -> tuple[Floats, Bools]:
        """Parameters moved to a cell from where the material changes, and which have been."""
        read, is_moved = np.array(s), np.zeros(len(s), dtype=bool)
        for change in self.changes:
            way = s - change
            if self.period is not None:
                way = np.mod(way + 0.5 * self.period, self.period) - 0.5 * self.period
            is_near = np.abs(way) < BESIDE * size
            read[is_near] = (s - way + np.where(way < 0, -1, 1) * BESIDE * size)[is_near]
            is_moved |= is_near
        return read, is_moved


def front_materials(solution: Solution, t: int, curve: FrontCurve, size: float) -> FrontMaterials:
    """Materials along a front.

    Parameters
    ----------
    solution : Solution
    t : int
        Number of the front in `space.tips`.
    curve : FrontCurve
        In the body.
    size : float, length
        Of the cells there.

    Raises
    ------
    GeometryError
        The front runs along an interface.
    ProblemError
        A material there is not isotropic.
    """
    elasticity = solution.problem.elasticity
    period = curve.length if curve.is_closed else None
    ends = np.array([0.0, curve.length])
    if elasticity.is_uniform:
        return FrontMaterials((elasticity.materials[0].at_tip(),), ends, (None,), period)
    s = np.linspace(0.0, curve.length, _SAMPLES + 1)

    def number_at(s: Floats) -> Ints:
        cells = cells_at(elasticity.mesh, curve.at(s)[0])
        return elasticity.number[cells] if len(elasticity.number) else np.zeros_like(cells)

    number = number_at(s)
    rows = np.nonzero(np.diff(number))[0]
    changes = np.array(
        [_parameter_between(number_at, s[k], s[k + 1], int(number[k])) for k in rows]
    )
    _refuse_interface(solution, curve, s, number, changes, size)
    numbers = number[np.append(rows, len(s) - 1)]
    if period is None:
        break_arcs = np.concatenate([ends[:1], changes, ends[1:]])
    elif len(changes):
        break_arcs = np.append(changes, changes[0] + curve.length)
        numbers = numbers[1:]
    else:
        break_arcs = ends
    references, logarithms = [], []
    for k, (begin, end) in zip(numbers.tolist(), zip(break_arcs, break_arcs[1:]), strict=True):
        reference, logarithm = _reference(elasticity, curve, k, float(begin), float(end))
        references.append(reference)
        logarithms.append(logarithm)
    return FrontMaterials(tuple(references), break_arcs, tuple(logarithms), period)


def _parameter_between(
    number_at: Callable[[Floats], Ints], s_min: float, s_max: float, number: int
) -> float:
    """Parameter at which the material of `s_min` ends."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (s_min + s_max)
        if number_at(np.array([middle]))[0] == number:
            s_min = middle
        else:
            s_max = middle
    return 0.5 * (s_min + s_max)


def _reference(
    elasticity: Elasticity, curve: FrontCurve, number: int, begin: float, end: float
) -> tuple[Isotropic, CubicSpline | None]:
    """Material of a piece of a front, and the logarithm of its modulus over that of this one."""
    material = elasticity.materials[number]
    if not material.is_graded:
        return material.at_tip(), None
    unit, s = material.unit.at_tip(), np.linspace(begin, end, _SAMPLES + 1)[1:-1]
    x = curve.at(np.mod(s, curve.length) if curve.is_closed else s)[0]
    E = np.array([elasticity.isotropic_at(place).E for place in x])
    mean = float(np.exp(np.log(E).mean()))
    return Isotropic(mean, unit.nu, unit.plane), CubicSpline(s, np.log(E / mean))


def _refuse_interface(
    solution: Solution, curve: FrontCurve, s: Floats, number: Ints, changes: Floats, size: float
) -> None:
    """Raise where a front runs along an interface."""
    elasticity = solution.problem.elasticity
    if not len(elasticity.number):
        return
    x, frame, _ = curve.at(s)
    distance = np.full(len(s), np.inf)
    for change in changes:
        distance = np.minimum(distance, np.abs(s - change))
    for axis in (0, 1):
        for sign in (-1, 1):
            neighbour_cells = cells_at(elasticity.mesh, x + sign * _BESIDE * size * frame[:, axis])
            on = (elasticity.number[neighbour_cells] != number) & (distance > size)
            if on.any():
                place = x[int(np.argmax(on))]
                names = " and ".join(map(repr, sorted({
                    str(name) for name in elasticity.names_at(np.stack([
                        place - _BESIDE * size * frame[int(np.argmax(on)), axis],
                        place + _BESIDE * size * frame[int(np.argmax(on)), axis],
                    ]))})))  # fmt: skip
                raise GeometryError(
                    f"the front runs along the interface of {names} at {at(place)}: the stress "
                    "there does not go like 1/√r, so there is no K. Let it end a cell before or "
                    "behind."
                )


def warn_of_changes(materials: FrontMaterials, curve: FrontCurve, is_moved: Bools) -> None:
    """Say where a front passes into another material, and what K is there."""
    if not len(materials.changes):
        return
    s = materials.changes
    x = curve.at(np.mod(s, materials.period) if materials.period is not None else s)[0]
    places = ", ".join(str(at(place)) for place in x)
    warn(
        f"the front passes into another material at {places}: the stresses at that corner go like "
        f"another power of the distance, and K has no limit there. The {int(is_moved.sum())} "
        "places within a cell of it have K of a cell away (`at_surface`)."
    )


__all__ = ["FrontMaterials", "front_materials", "warn_of_changes"]
