"""Residual strength: by toughness, by collapse of the section, and by both together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from xcrack.base.arguments import Declared, Function, Number, Part, Poisson, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, number, numbers, value_text, whole_number
from xcrack.base.errors import ProblemError
from xcrack.base.paths import path_of, system_errors, written_whole
from xcrack.base.units import STRESS, TOUGHNESS
from xcrack.growth.step import (
    Step,
    largest_K_eq,
)
from xcrack.growth.validity import validity
from xcrack.runs.history import History
from xcrack.runs.table import crack_numbers, end_id


@dataclass(frozen=True)
class assessment_line(Declared):  # noqa: N801 - it is used as a function
    """Failure assessment line of option 1: the largest K_r for L_r.

    Parameters
    ----------
    E, sigma_y, sigma_u : float, stress
        Young's modulus, yield stress and tensile strength, sigma_u >= sigma_y; for steels without
        a yield plateau.

    Raises
    ------
    ProblemError
        A value that is not positive, or sigma_u < sigma_y.

    Notes
    -----
    BS 7910, 7.3.3: f = (1 + L_r²/2)^(-1/2) [0.3 + 0.7 exp(-µ L_r⁶)] up to
    L_r = 1, µ = min(0.001 E/σ_y, 0.6); f(1) L_r^((N-1)/(2N)) beyond, N = 0.3 (1 - σ_y/σ_u); 0 from
    L_r = (σ_y + σ_u)/(2 σ_y) on. From memory; the document was not at hand, but a public program
    that quotes equations 7.25 to 7.28 of its edition of 2019 has the same, term by term.

    Examples
    --------
    >>> line = assessment_line(E=210e3, sigma_y=355.0, sigma_u=510.0)
    >>> print(line([0.0, 0.5, 1.0]).round(4), round(line.L_max, 4))
    [1.     0.9367 0.5613] 1.2183
    """

    E: Annotated[float, Number(above=0, unit=STRESS)]
    sigma_y: Annotated[float, Number(above=0, unit=STRESS)]
    sigma_u: Annotated[float, Number(above=0, unit=STRESS)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sigma_u < self.sigma_y:
            raise ProblemError(
                f"assessment_line: sigma_u = {self.sigma_u:g} is below sigma_y = {self.sigma_y:g}: "
                "give the tensile strength."
            )

    @property
    def L_max(self) -> float:  # noqa: N802 - a symbol of the standard
        """Load over that of yielding, from which the section collapses."""
        return (self.sigma_y + self.sigma_u) / (2 * self.sigma_y)

    def __call__(self, L_r: ArrayLike) -> Floats:
        """Largest K_r for L_r."""
        L = numbers(L_r, "assessment_line: L_r")
        if (L < 0).any():
            raise ProblemError(f"assessment_line: L_r = {L.min():g}: give values of at least 0.")
        mu = min(0.001 * self.E / self.sigma_y, 0.6)
        N = 0.3 * (1 - self.sigma_y / self.sigma_u)

        def is_below(L: Floats) -> Floats:
            return np.asarray((0.3 + 0.7 * np.exp(-mu * L**6)) / np.sqrt(1 + L**2 / 2))

        above_1 = 0.0
        if N > 0:
            above_1 = is_below(np.ones(1))[0] * np.maximum(L, 1.0) ** ((N - 1) / (2 * N))
        allowed_K = np.where(L <= 1, is_below(np.minimum(L, 1.0)), above_1)
        return np.asarray(np.where(L < self.L_max, allowed_K, 0.0))[()]

    def reserve(self, K_r: float, L_r: float) -> float:
        """Factor on the load at which the point (K_r, L_r) comes to the line.

        Parameters
        ----------
        K_r, L_r : float
            At the present load, in proportion to it; not negative, not both 0.
        """
        K = number(K_r, "assessment_line.reserve: K_r", least=0)
        L = number(L_r, "assessment_line.reserve: L_r", least=0)
        if K == L == 0:
            raise ProblemError("assessment_line.reserve: K_r and L_r are 0: give a load.")
        if L == 0:
            return 1.0 / K
        largest_factor = self.L_max / L
        if K == 0:
            return largest_factor

        def cycles_left(factor: float) -> float:
            return (
                float(self(np.asarray(min(factor * L, np.nextafter(self.L_max, 0))))) - factor * K
            )

        if cycles_left(largest_factor) > 0:
            return largest_factor
        return float(
            brentq(cycles_left, 0.0, largest_factor, xtol=1e-14 * largest_factor, rtol=1e-14)
        )


@check_arguments()
def residual_strength(
    history: History,
    *,
    nu: Poisson,
    K_c: Annotated[float, Number(above=0, unit=TOUGHNESS)],
    resistance: Annotated[Callable[[float], float] | None, Function("a function of da")] = None,
    yield_stress: Annotated[float | None, Number(above=0, unit=STRESS)] = None,
    collapse: Annotated[Callable[[float], float] | None, Function("a function of a")] = None,
    line: Annotated[assessment_line | None, Part(assessment_line)] = None,
) -> NDArray[Any]:
    """Factors on the largest load of a run at which its cracks break the body, step by step.

    Each row is of the lead crack: the one with the largest K. With several cracks the rows are one
    curve through all joins, as multiple-site damage is judged.

    Parameters
    ----------
    history : History
        Whose K is in proportion to the load: no steady loads and no initial stress.
    nu : float
        Poisson's ratio, for K_eq.
    K_c : float, stress √length
        Toughness; of plates that of their thickness.
    resistance : callable da -> K_R, optional
        R-curve: resistance over the stable extension of a tip. The lead crack then extends stably
        along the path of the run.
    yield_stress : float, stress, optional
        Or a flow stress: for the net section and the link-up of two cracks, in 2D.
    collapse : callable a -> factor, optional
        Factor on the largest load at which the net section yields throughout, for the length that
        `table` calls a.
    line : assessment_line, optional
        With `collapse`: K_r = K/K_c and L_r are joined by it.

    Returns
    -------
    (n,) structured array
        A row for each step with K, the last one included: step, N, crack (the lead crack, by its
        number in the first step), a (its length), K (largest K_eq of all load states and tips);
        by_toughness (K_c/K; inf where K is 0), by_resistance, by_section (the weakest ligament
        yields; of steps that have their solutions), by_link_up (plastic zones of two tips that face
        each other touch; inf where none do), by_collapse and by_line, nan where nothing was given
        for them; and factor, the smallest of them. Where there is an R-curve, by_toughness does
        not count in it: stable extension may begin there. Last, id: of the tip, in 3D the front,
        with that K (`History.names`).

    Raises
    ------
    ProblemError
        No history, values out of bounds, a line without collapse, a collapse or a resistance that
        is not positive.

    Notes
    -----
    R-curve: the load at which K of the extending crack touches the curve, that is the largest
    K_R(da)/K(a + da) over the extensions which the run went through up to its end or the next join
    (ASTM E561); where it is there the true factor is at least that. Link-up: Swift's criterion,
    Irwin's zones (K/yield)²/2π of plane stress fill the ligament between two tips (T. Swift, on
    damage tolerance of riveted panels, 1993 on; from memory). Net section: force and moment on the
    ligament ahead of each tip, as of `check`.

    Examples
    --------
    ::

        rows = xc.residual_strength(history, nu=0.33, K_c=3000.0, yield_stress=350.0)
        xc.plot_strength(rows, unit="flight", file="strength.png")
    """
    if not isinstance(history, History):
        raise ProblemError(f"residual_strength: history = {value_text(history)}: give a History.")
    if line is not None and collapse is None:
        raise ProblemError(
            f"residual_strength: line = {value_text(line)}: give assessment_line, and collapse "
            f"with it."
        )
    steps = history.solved
    result = np.zeros(len(steps), dtype=_STRENGTH)
    for name in CRITERIA:
        result[name] = np.nan
    names = [crack_numbers(step) for step in steps]
    for n, step in enumerate(steps):
        K = K_of_cracks(step, nu)
        c = int(np.argmax(K))
        a = step.sizes[c] if step.sizes else np.nan
        row = result[n]
        row["step"], row["N"], row["crack"], row["a"], row["K"] = (
            step.index, step.cycles, names[n][c], a, K[c]
        )  # fmt: skip
        K_eq = largest_K_eq(step, c, nu)
        row["id"] = end_id(step, c, step.sif[0][c].front[np.argmax(K_eq)]) if len(K_eq) else -1
        by_K = K_c / K[c] if K[c] > 0 else np.inf
        row["by_toughness"] = by_K
        if resistance is not None:
            row["by_resistance"] = _by_resistance(steps[n:], names[n:], c, nu, resistance)
        if yield_stress is not None:
            row["by_section"] = _by_section(step, yield_stress)
            row["by_link_up"] = _by_link_up(step, nu, yield_stress)
        if collapse is not None:
            row["by_collapse"] = number(
                call_function(collapse, f"the collapse of step {step.index}", a),
                "residual_strength: collapse",
                above=0,
            )
        if line is not None:
            row["by_line"] = line.reserve(1 / by_K, 1 / row["by_collapse"])
        criteria = [name for name in CRITERIA if resistance is None or name != "by_toughness"]
        row["factor"] = np.nanmin([row[name] for name in criteria])
    return result


CRITERIA = (
    "by_toughness", "by_resistance", "by_section", "by_link_up", "by_collapse", "by_line",
)  # fmt: skip
"""Columns of `residual_strength` that are factors by one criterion each."""

_STRENGTH = [
    (name, int if name in ("crack", "id") else float)
    for name in ("step", "N", "crack", "a", "K", *CRITERIA, "factor", "id")
]


def K_of_cracks(step: Step, nu: float) -> list[float]:
    """Largest K_eq of all load states at all tips of each crack of a step."""
    return [float(largest_K_eq(step, c, nu).max(initial=0)) for c in range(len(step.angle))]


def _by_resistance(
    steps: Sequence[Step],
    names: Sequence[Sequence[int]],
    crack: int,
    nu: float,
    resistance: Callable[[float], float],
) -> float:
    """Factor at which a crack becomes unstable, along the steps that are left of the run."""
    a: list[float] = []
    K: list[float] = []
    c = crack
    for step, name in zip(steps, names, strict=True):
        has_met = a and any(c in join.cracks for join in step.joins)
        if has_met or names[0][crack] not in name or not step.sizes:
            break
        c = name.index(names[0][crack])
        tips = max(len(step.angle[c]), 1) if step.cracks[c].dim == 2 else 1
        a.append(step.sizes[c] / tips)
        K.append(K_of_cracks(step, nu)[c])
    if not a or not all(np.isfinite(a)):
        return np.nan
    is_rising = np.concatenate([[True], a[1:] > np.maximum.accumulate(a)[:-1]])
    length, size = np.array(a)[is_rising], np.array(K)[is_rising]
    # Between two steps K is straight in a; the curve has its own shape.
    places = np.unique(
        np.concatenate(
            [np.linspace(*pair, _PLACES) for pair in zip(length, length[1:])] or [length]
        )
    )
    label = f"the resistance of step {steps[0].index}"
    largest_factor = 0.0
    for x in places:
        K_R = call_function(resistance, label, float(x - length[0]))
        K_R = number(K_R, "residual_strength: resistance", least=0)
        K_x = float(np.interp(x, length, size))
        largest_factor = max(largest_factor, K_R / K_x if K_x > 0 else np.inf)
    if largest_factor == 0:
        raise ProblemError(
            "residual_strength: resistance is 0 over the whole run: give K_R over the extension."
        )
    return largest_factor


_PLACES = 20  # between two steps at which an R-curve is looked at
_FACING = 0.5  # cosine of the angle up to which two tips face each other: 60 degrees


def _by_section(step: Step, yield_stress: float) -> float:
    """Factor at which the weakest ligament of a plane body yields; nan without solutions."""
    if not step.solutions or step.solutions[0].space.dim != 2:
        return np.nan
    problem = step.solutions[0].problem
    material = problem.elasticity.material.with_yield_stress(yield_stress)
    check = validity(material, problem.mesh, step.cracks, step.sif, step.solutions)
    return np.nan if check is None or not check.of_section > 0 else 1 / check.of_section


def _by_link_up(step: Step, nu: float, yield_stress: float) -> float:
    """Factor at which plastic zones of two tips that face each other touch in 2D."""
    tips = [
        (c, sif.x[j], sif.frame[j, 0], K)
        for c, sif in enumerate(step.sif[0])
        for j, K in enumerate(largest_K_eq(step, c, nu).tolist())
    ]
    if not tips or len(tips[0][1]) != 2:
        return np.nan
    factor = np.inf
    for (c, x, direction, K), (d, y, second_direction, L) in combinations(tips, 2):
        way = y - x
        ligament = float(np.linalg.norm(way))
        faces = min(way @ direction, -(way @ second_direction)) > _FACING * ligament
        if c != d and faces and K**2 + L**2 > 0:
            zones = (K**2 + L**2) / (2 * np.pi * yield_stress**2)
            factor = min(factor, float(np.sqrt(ligament / zones)))
    return factor


def geometry_factors(history: History, *, stress: float) -> NDArray[Any]:
    """Table of K over the length, as life codes read it.

    Parameters
    ----------
    history : History
    stress : float, stress
        Reference stress of the last load state.

    Returns
    -------
    structured array
        Columns step, crack, tip, a (the length that `table` has, over the number of tips), K_I of
        the last state, and beta = K_I / (stress √(π a)); in 3D K_I is the largest along the front.

    Raises
    ------
    ProblemError
        No history, or a stress that is not positive.
    """
    if not isinstance(history, History):
        raise ProblemError(f"geometry_factors: history = {value_text(history)}: give a History.")
    stress = number(stress, "geometry_factors: stress", above=0)
    rows = []
    for step in history.steps:
        for c, crack in enumerate(step.cracks):
            sif, tips = step.sif[-1][c], 1 if crack.fronts is not None else len(step.angle[c])
            length = step.sizes[c] if step.sizes else np.nan
            for place in np.unique(sif.front):
                K = float(sif.K[sif.front == place, 0].max())
                a = length / max(tips, 1)
                rows.append((step.index, c, int(place), a, K, K / (stress * np.sqrt(np.pi * a))))
    kinds = [(name, int) for name in ("step", "crack", "tip")]
    return np.array(rows, dtype=[*kinds, *((name, float) for name in ("a", "K_I", "beta"))])


# Tables of K over the length of a crack, as files that other life codes can take.

_COLUMNS = ("a", "c", "K", "beta")


def write_factors(
    history: History, file: str | Path, *, stress: float, crack: int = 0, tip: int = 0
) -> Path:
    """Write a, c, K and beta of one tip, or front, over its growth: plain columns with a head.

    Parameters
    ----------
    history : History
        In 3D with its mesh, for the depth and the surface length.
    file : path
    stress : float, stress
        Reference stress of the last load state.
    crack, tip : int
        Which one; in 3D the number of the front.

    Returns
    -------
    Path

    Raises
    ------
    ProblemError
        No history, a stress that is not positive, a crack or tip that there is not, a file that
        cannot be written.

    Notes
    -----
    Lines that begin with # say what the columns are: a (in 2D the length inside the body over the
    number of tips, in 3D the depth below the surface), c (in 3D half of the length on the surface
    where the crack meets the set that it lies deepest under, else nan), K (K_I of the last load
    state; in 3D the largest along the front) and beta = K / (stress √(π a)). Columns are separated
    by blanks, with one row for each step whose a is longer than that of the row before: tables of
    life codes rise strictly. Units are those of the run.
    """
    if not isinstance(history, History):
        raise ProblemError(f"write_factors: history = {value_text(history)}: give a History.")
    stress = number(stress, "write_factors: stress", above=0)
    c = whole_number(crack, "write_factors: crack", least=0)
    j = whole_number(tip, "write_factors: tip", least=0)
    rows = geometry_factors(history, stress=stress)
    rows_of_tip = rows[(rows["crack"] == c) & (rows["tip"] == j)]
    if not len(rows_of_tip):
        raise ProblemError(
            f"write_factors: the history has no crack {c} with a tip {j}: give "
            "those of history.table()."
        )
    a, half = rows_of_tip["a"].copy(), np.full(len(rows_of_tip), np.nan)
    if history.steps[0].cracks[0].fronts is not None:
        a, half = _on_surface(history, rows_of_tip["step"], c)
    beta = rows_of_tip["K_I"] / (stress * np.sqrt(np.pi * a))
    table = np.stack([a, half, rows_of_tip["K_I"], beta], axis=1)
    is_rising = np.concatenate([[True], a[1:] > np.maximum.accumulate(a)[:-1]])
    path = path_of(file, "write_factors: file", error=ProblemError)
    head = (
        f"# K over the length of crack {c}, tip {j}, by xcrack; units of the run\n"
        f"# reference stress {stress:.12g}; beta = K / (stress sqrt(pi a))\n"
        f"# {' '.join(f'{name:>15}' for name in _COLUMNS)}\n"
    )
    lines = (" ".join(f"{value:15.8g}" for value in row) for row in table[is_rising].tolist())
    with system_errors("a folder cannot be made for", path, error=ProblemError):
        path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path, "the table cannot be written to", error=ProblemError) as part:
        part.write_text(head + "\n".join(f"  {line}" for line in lines) + "\n", encoding="utf-8")
    return path


def _on_surface(history: History, steps: np.ndarray, crack: int) -> tuple[np.ndarray, np.ndarray]:
    """Depth, and half of the length on the surface that the crack lies deepest under."""
    measures, _ = history.measures()
    rows_of_crack = measures[measures["crack"] == crack]
    rows_of_crack = rows_of_crack[np.isin(rows_of_crack["step"], steps)]
    sets = [
        name.removeprefix("depth_")
        for name in rows_of_crack.dtype.names
        if name.startswith("depth_")
    ]
    depth = np.array([rows_of_crack[f"depth_{name}"] for name in sets]).reshape(
        len(sets), len(rows_of_crack)
    )
    length = np.array([rows_of_crack[f"length_{name}"] for name in sets]).reshape(
        len(sets), len(rows_of_crack)
    )
    half = np.full(len(rows_of_crack), np.nan)
    for n in range(len(rows_of_crack)):
        if np.isfinite(depth[:, n]).any():
            half[n] = 0.5 * length[int(np.nanargmax(depth[:, n])), n]
    return np.asarray(rows_of_crack["depth"]), half


__all__ = [
    "CRITERIA",
    "K_of_cracks",
    "assessment_line",
    "geometry_factors",
    "residual_strength",
    "write_factors",
]
