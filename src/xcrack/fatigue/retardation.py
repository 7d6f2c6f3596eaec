"""Retardation after overloads: plastic zones, its models, and growth cycle by cycle with them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Number, Part
from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.base.checks import check_set_names, numbers, values_by_set
from xcrack.base.errors import ProblemError
from xcrack.base.units import STRESS, TOUGHNESS
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.law import Constants, Law, LawSets, Names, largest_K

_LARGEST = 1e120  # K whose square is a number

# Of growth cycle by cycle.
POINTS = 65  # of a march, at which growth and cycles are known
_SHIFTS, _FEWEST = 257, 17  # values of the reduction of K at which the law is asked
_TABLE = 4_000_000  # rates of a march
_MOST = 3e8  # cycles of a step, times places
_LEAST = 1e-9  # of a step: a block that grows less does not grow
_TINY = 1e-3  # of the largest rate of a cycle: below it a power of the rate is a line
_SMALLEST = 1e-300


@dataclass(frozen=True)
class plastic_zone(Constants):  # noqa: N801 - it is used as a function
    """Size of the plastic zone, (K / sigma_y)² / (beta π).

    Parameters
    ----------
    sigma_y : float, stress
        Yield stress.
    beta : float
        1: width in plane stress (Irwin), 2: radius in plane stress, 3: width and 6:
        radius in plane strain; 8/π² is the strip of Dugdale. Which one belongs to a model's
        constants.

    Examples
    --------
    >>> print((1000 * plastic_zone(400.0, beta=2)(30.0)).round(6))      # MPa √m to mm
    0.895247
    """

    sigma_y: Annotated[float, Number(above=0, unit=STRESS)]
    beta: Annotated[float, Number(above=0)]

    def __call__(self, K: ArrayLike) -> Floats:
        """Size for K, length."""
        values = numbers(K, "plastic_zone: K")
        if np.abs(values).max(initial=0.0) > _LARGEST:
            raise ProblemError(
                f"plastic_zone: K = {np.abs(values).max():.3g} has no square: take another unit."
            )
        return np.asarray(self.factor * values**2)[()]

    @property
    def factor(self) -> float:
        """Size over K²."""
        return 1.0 / (self.sigma_y**2 * self.beta * np.pi)


@dataclass(frozen=True)
class wheeler(Constants):  # noqa: N801
    """Growth slowed while the plastic zone lies inside that of an overload.

    Parameters
    ----------
    w : float
        Exponent: fitted to a material and a kind of spectrum.
    zone : plastic_zone

    Notes
    -----
    da/dN times [r / (a_OL + r_OL - a)]^w while a + r < a_OL + r_OL (Wheeler 1972, J. Basic Eng. 94,
    181). A cycle whose zone reaches beyond that of the overload is the new overload.

    Examples
    --------
    >>> model = wheeler(1.5, plastic_zone(400.0, beta=2))
    >>> print(model.factor(15.0, 30.0, 0.3e-3).round(6))
    0.230557
    """

    w: Annotated[float, Number(above=0)]
    zone: Annotated[plastic_zone, Part(plastic_zone, needs="plastic_zone(sigma_y, beta)")]

    def factor(self, K: ArrayLike, K_overload: ArrayLike, da: ArrayLike) -> Floats:
        """Factor on the rate for K, after growth by da since an overload."""
        zone_size = self.zone(K)
        distance_left = self.zone(K_overload) - numbers(da, "wheeler: da")
        is_inside = distance_left > zone_size
        share = np.divide(
            zone_size, distance_left, out=np.ones_like(distance_left + zone_size), where=is_inside
        )
        return np.asarray(share**self.w)[()]


@dataclass(frozen=True)
class willenborg(Constants):  # noqa: N801
    """Growth by a K that the residual stress of an overload reduces.

    Parameters
    ----------
    shutoff : float
        Overload over K at which the crack stops; 2.3 to 3 for aluminium (from memory).
    dK_th : float, stress √length
        Threshold.
    zone : plastic_zone

    Notes
    -----
    K_R = φ [K_OL √(1 - da/r_OL) - K_max] >= 0, φ = (1 - ΔK_th/ΔK) / (S - 1) >= 0 (generalised
    Willenborg model: Gallagher 1974; Gallagher and Hughes, AFFDL-TR-74-27; the same formula is in
    the program easigrow). Both ends of the cycle are shifted by -K_R and cut at 0: K with contact.

    Examples
    --------
    >>> model = willenborg(2.5, 2.0, plastic_zone(400.0, beta=2))
    >>> print(model.reduction(1.5, 15.0, 30.0, 0.0).round(6))
    8.518519
    """

    shutoff: Annotated[float, Number(above=1)]
    dK_th: Annotated[float, Number(least=0, unit=TOUGHNESS)]
    zone: Annotated[plastic_zone, Part(plastic_zone, needs="plastic_zone(sigma_y, beta)")]

    def reduction(
        self, K_min: ArrayLike, K_max: ArrayLike, K_overload: ArrayLike, da: ArrayLike
    ) -> Floats:
        """Reduction of K, after growth by da since an overload, stress √length."""
        K_low, K_top, K_of_overload, growth = (
            numbers(value, f"willenborg: {name}")
            for name, value in zip(
                ("K_min", "K_max", "K_overload", "da"), (K_min, K_max, K_overload, da)
            )
        )
        dK = K_top - K_low
        share = np.divide(self.dK_th, dK, out=np.ones_like(dK), where=dK > 0)
        phi = np.maximum(1 - share, 0.0) / (self.shutoff - 1)
        share_left = np.maximum(1 - growth / self.zone(K_of_overload), 0.0)
        return np.asarray(np.maximum(phi * (K_of_overload * np.sqrt(share_left) - K_top), 0.0))[()]


Retardation = wheeler | willenborg


@dataclass(frozen=True)
class RetardationSets:
    """Models of retardation by the names of the cell sets that materials have.

    ``grow(..., retardation={"plate": wheeler(...), "weld": wheeler(...)})`` is short for it: a tip
    has the zones of the material that it is in.

    Parameters
    ----------
    models : mapping of str to wheeler, or of str to willenborg

    Raises
    ------
    ProblemError
        No mapping of names to models of one kind.
    """

    models: Any

    def __post_init__(self) -> None:
        pairs = values_by_set(
            self.models, "retardation", "models", "wheeler", "wheeler or willenborg",
            lambda model: isinstance(model, Retardation),
        )  # fmt: skip
        object.__setattr__(self, "models", pairs)
        if len({type(model) for _, model in self.models}) > 1:
            raise ProblemError(
                "retardation: one material has wheeler, and one willenborg: an overload in front "
                "of an interface would be forgotten behind it. Give all the same kind."
            )

    def at(self, names: Sequence[str]) -> list[Retardation]:
        """The model of each of some materials."""
        models = dict(self.models)
        return [models[name] for name in names]

    def check(self, names: Sequence[str]) -> None:
        """Raise where the materials of a problem are others.

        Raises
        ------
        ProblemError
            A material without a model, or a model without a material.
        """
        set_names = [name for name, _ in self.models]
        check_set_names(set_names, names, "retardation", "models", "one")


# What growth cycle by cycle goes from, and what it gives.


@dataclass(frozen=True, eq=False)
class OverloadZones:
    """What overloads left at places, and where in a block of cycles the run is.

    Attributes
    ----------
    since : (n,) array, length
        Growth since the overload.
    size : (n,) array, length
        Its plastic zone; 0 before the first.
    K : (n,) array, stress √length
        K_max of the overload.
    position : int
        Number of the next cycle of the block.
    part : float
        Of that cycle that is over.
    """

    since: Floats
    size: Floats
    K: Floats
    position: int = 0
    part: float = 0.0

    def at(self, places: Bools | Ints) -> "OverloadZones":
        """The same for some places."""
        return replace(self, since=self.since[places], size=self.size[places], K=self.K[places])


@dataclass(frozen=True, eq=False)
class BlockCycles:
    """The kinds of cycles of a block at places, at the last solves.

    Attributes
    ----------
    dK, R : (k, n, p) arrays
        Equivalent range (stress √length) and ratio.
    a : (k, n) array, length
        Crack size that a law is given.
    sets : (n,) array of int, optional
        Number of the material that each place goes on in; one material, where it is left out.
    """

    dK: Floats
    R: Floats
    a: Floats
    sets: Ints | None = None

    @property
    def arrays(self) -> tuple[Floats, Floats, Floats]:
        """Range, ratio and size."""
        return self.dK, self.R, self.a

    def rows(self, rows: slice | Bools) -> "BlockCycles":
        """Some of the solves."""
        return BlockCycles(self.dK[rows], self.R[rows], self.a[rows], self.sets)

    def at(self, places: Bools | Ints) -> "BlockCycles":
        """Some of the places."""
        sets = None if self.sets is None else self.sets[places]
        return BlockCycles(self.dK[:, places], self.R[:, places], self.a[:, places], sets)

    def followed_by(self, block: "BlockCycles", most_cycles: int) -> "BlockCycles":
        """With later solves, of all at most the last few, in the materials of the later ones."""
        parts = zip(self.arrays, block.arrays)
        dK, R, a = (np.concatenate(pair)[-most_cycles:] for pair in parts)
        return BlockCycles(dK, R, a, block.sets)


@dataclass(frozen=True, eq=False)
class CycleIntegration:
    """Growth of places, cycle by cycle.

    Attributes
    ----------
    sigma : (g,) array, length
        Sum of the largest growth of any place in each cycle.
    arc : (g, n) array, length
        How far each place has come.
    cycles : (g,) array
        Blocks until there.
    grown_length : float, length
        Up to which it came: less than the last of `sigma` where nothing grows, or the blocks are
        over.
    zones : OverloadZones
        Then.
    """

    sigma: Floats
    arc: Floats
    cycles: Floats
    grown_length: float
    zones: OverloadZones

    def growth_up_to(self, sigma: float) -> tuple[Floats, float]:
        """How far each place has come `(n,)`, and blocks, at some sigma."""
        arc = [np.interp(sigma, self.sigma, column) for column in self.arc.T]
        return np.array(arc), float(np.interp(sigma, self.sigma, self.cycles))


def no_zones(n: int) -> OverloadZones:
    """Places without an overload."""
    return OverloadZones(np.zeros(n), np.zeros(n), np.zeros(n))


def march(
    law: Law | LawSets,
    model: Retardation | RetardationSets | None,
    order: Ints,
    cycles: BlockCycles,
    nodes: Floats,
    x: Floats,
    zones: OverloadZones,
    length: float,
    *,
    exponent: float,
    threshold: float = 0.0,
    blocks: float = np.inf,
    names: Sequence[str] = ("",),
) -> CycleIntegration:
    """Let places grow cycle by cycle, until the fastest have come a length.

    Parameters
    ----------
    law : callable, or LawSets
    model : wheeler or willenborg, or RetardationSets, or None
    order : (c,) array of int
        Kinds of the cycles of a block, in time.
    cycles : BlockCycles
    nodes : (k, n) array
        Where these were solved; rates are exponentials of polynomials through them.
    x : (g, n) array
        The same coordinate, evenly from the begin to `length`.
    zones : OverloadZones
        At the begin.
    length : float, length
    exponent : float
        Of the law, for rates that all but vanish.
    threshold : float, stress √length
        Cycles below it let nothing grow.
    blocks : float
        To stop after.
    names : sequence of str
        Of the materials that `cycles.sets` counts.

    Returns
    -------
    CycleIntegration
    """
    from xcrack.fatigue.kernels.march import march_places

    k, n, p = cycles.dK.shape
    shifts = np.zeros(1)
    material = None if cycles.sets is None else np.array(names)[cycles.sets]
    models: list[Any] = [model] * n
    if isinstance(model, RetardationSets):
        models = model.at([names[0]] * n if material is None else material.tolist())
    first = models[0] if models else None
    if isinstance(first, willenborg):
        shifts_that_fit = _TABLE // max(k * n * p, 1)
        shifts = np.linspace(0, 1, int(np.clip(shifts_that_fit, _FEWEST, _SHIFTS)))
    rate = cycle_rates(law, cycles, shifts, threshold, material)
    largest_rate = rate.max(axis=0)
    root = np.asarray((rate <= _TINY * largest_rate).any(axis=0))
    with np.errstate(divide="ignore"):
        values = np.where(root, rate ** (1 / exponent), np.log(np.maximum(rate, _SMALLEST)))
    threshold_range = np.array([getattr(m, "dK_th", 0.0) for m in models])[None, :, None]
    share = np.divide(threshold_range, cycles.dK, out=np.ones_like(cycles.dK), where=cycles.dK > 0)
    growth_since, size, zone_K = np.array(zones.since), np.array(zones.size), np.array(zones.K)
    arc, cycles_elapsed = np.zeros(x.shape), np.zeros(len(x))
    length_reached, position, part, _ = march_places(
        length,
        min(blocks * len(order), _MOST / max(n, 1)),
        _LEAST * length,
        order,
        _weights(nodes, x),
        _line_weights(nodes, x),
        largest_K(cycles.dK, cycles.R),
        values,
        root,
        exponent,
        share,
        np.array([0.0 if m is None else m.zone.factor for m in models]),
        0 if first is None else 1 if isinstance(first, wheeler) else 2,
        np.array([getattr(m, "w", 1.0) for m in models]),
        np.array([getattr(m, "shutoff", 2.0) for m in models]),
        growth_since,
        size,
        zone_K,
        zones.position,
        zones.part,
        arc,
        cycles_elapsed,
    )
    zones_after = OverloadZones(growth_since, size, zone_K, int(position), float(part))
    sigma = np.linspace(0.0, length, len(x))
    return CycleIntegration(
        sigma, arc, cycles_elapsed / len(order), float(length_reached), zones_after
    )


def cycle_rates(
    law: Law | LawSets,
    cycles: BlockCycles,
    shifts: Floats,
    threshold: float,
    material: Names | None = None,
) -> Floats:
    """Rates `(k, n, p, s)` with a share of K_max taken from both ends of each cycle."""
    K_max = largest_K(cycles.dK, cycles.R)[..., None]
    reduced_K_max = K_max * (1 - shifts)
    K_min = np.maximum(K_max - cycles.dK[..., None] - K_max * shifts, 0.0)
    dK = np.where(shifts == 0, cycles.dK[..., None], reduced_K_max - K_min)
    R = np.divide(K_min, reduced_K_max, out=np.zeros_like(reduced_K_max), where=reduced_K_max > 0)
    R = np.where(shifts == 0, cycles.R[..., None], np.minimum(R, 1.0))
    a = np.broadcast_to(cycles.a[..., None, None], dK.shape)
    columns = (np.ascontiguousarray(column).ravel() for column in (dK, R, a))
    dK_, R_, a_ = columns
    names = None
    if material is not None and isinstance(law, LawSets):
        names = np.broadcast_to(material[None, :, None, None], dK.shape).ravel()
    rate = evaluate_law(law, dK_, R_, 0, "place of a cycle", a_, names)
    return np.where(dK_ < threshold, 0.0, rate).reshape(dK.shape)


def _weights(nodes: Floats, x: Floats) -> Floats:
    """Weights of the nodes in the polynomial through them `(g, k, n)`."""
    k = len(nodes)
    result = np.ones((len(x), k, x.shape[1]))
    for j in range(k):
        for i in range(k):
            if i != j:
                result[:, j] *= (x - nodes[i]) / (nodes[j] - nodes[i])
    return result


def _line_weights(nodes: Floats, x: Floats) -> Floats:
    """The same of straight lines from node to node, the first and the last one prolonged."""
    k = len(nodes)
    result = np.zeros((len(x), k, x.shape[1]))
    if k == 1:
        return result + 1.0
    for j in range(k - 1):
        is_inside = np.ones(x.shape, dtype=bool)
        if j > 0:
            is_inside &= x >= nodes[j]
        if j < k - 2:
            is_inside &= x < nodes[j + 1]
        t = (x - nodes[j]) / (nodes[j + 1] - nodes[j])
        result[:, j] += np.where(is_inside, 1 - t, 0.0)
        result[:, j + 1] += np.where(is_inside, t, 0.0)
    return result


__all__ = [
    "POINTS",
    "BlockCycles",
    "CycleIntegration",
    "OverloadZones",
    "Retardation",
    "RetardationSets",
    "cycle_rates",
    "march",
    "no_zones",
    "plastic_zone",
    "wheeler",
    "willenborg",
]
