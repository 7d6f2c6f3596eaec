"""Residual strength: by toughness, by collapse of the section, and by both together."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from xcrack.base.arrays import Floats
from xcrack.base.checks import call_function, number, numbers, value_text, whole_number
from xcrack.base.errors import ProblemError
from xcrack.base.paths import path_of, system_errors, written_whole
from xcrack.fatigue.criteria import clipped_K, equivalent_K
from xcrack.growth.step import Step
from xcrack.runs.history import History


@dataclass(frozen=True)
class assessment_line:  # noqa: N801 - it is used as a function
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

    E: float
    sigma_y: float
    sigma_u: float

    def __post_init__(self) -> None:
        for name in ("E", "sigma_y", "sigma_u"):
            value = number(getattr(self, name), f"assessment_line: {name}", above=0)
            object.__setattr__(self, name, value)
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

        def below(L: Floats) -> Floats:
            return np.asarray((0.3 + 0.7 * np.exp(-mu * L**6)) / np.sqrt(1 + L**2 / 2))

        beyond = 0.0
        if N > 0:
            beyond = below(np.ones(1))[0] * np.maximum(L, 1.0) ** ((N - 1) / (2 * N))
        inside = np.where(L <= 1, below(np.minimum(L, 1.0)), beyond)
        return np.asarray(np.where(L < self.L_max, inside, 0.0))[()]

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
        most = self.L_max / L
        if K == 0:
            return most

        def left(factor: float) -> float:
            return (
                float(self(np.asarray(min(factor * L, np.nextafter(self.L_max, 0))))) - factor * K
            )

        if left(most) > 0:
            return most
        return float(brentq(left, 0.0, most, xtol=1e-14 * most, rtol=1e-14))


def residual_strength(
    history: History,
    *,
    nu: float,
    K_c: float,
    collapse: Callable[[float], float] | None = None,
    line: assessment_line | None = None,
) -> NDArray[Any]:
    """Factors on the largest load of a run at which its cracks break the body, step by step.

    Parameters
    ----------
    history : History
        Whose K is in proportion to the load: no steady loads and no initial stress.
    nu : float
        Poisson's ratio, for K_eq.
    K_c : float, stress √length
        Toughness.
    collapse : callable a -> factor, optional
        Factor on the largest load at which the net section yields throughout, for the length that
        `table` calls a.
    line : assessment_line, optional
        With `collapse`: K_r = K/K_c and L_r are joined by it.

    Returns
    -------
    (n,) structured array
        A row for each step with K, the last one included: step, N, K (largest K_eq of all load
        states and tips), a of the crack that has it, by_toughness (K_c/K; inf where K is
        0), by_collapse and by_line, nan where nothing was given for them.

    Raises
    ------
    ProblemError
        No history, values out of bounds, a line without collapse, a collapse that is not positive.
    """
    if not isinstance(history, History):
        raise ProblemError(f"residual_strength: history = {value_text(history)}: give a History.")
    nu = number(nu, "residual_strength: nu", above=-1, below=0.5)
    tough = number(K_c, "residual_strength: K_c", above=0)
    if collapse is not None and not callable(collapse):
        raise ProblemError(
            f"residual_strength: collapse = {value_text(collapse)}: give a function of a."
        )
    if line is not None and (collapse is None or not isinstance(line, assessment_line)):
        raise ProblemError(
            f"residual_strength: line = {value_text(line)}: give assessment_line, and collapse "
            f"with it."
        )
    names = ("step", "N", "a", "K", "by_toughness", "by_collapse", "by_line")
    result = np.zeros(len(history.solved), dtype=[(name, float) for name in names])
    for n, step in enumerate(history.solved):
        K, c = _largest_K(step, nu)
        a = step.memory.length[c] if step.memory is not None else np.nan
        by_K = tough / K if K > 0 else np.inf
        by_section = by_line = np.nan
        if collapse is not None:
            by_section = number(
                call_function(collapse, f"the collapse of step {step.index}", a),
                "residual_strength: collapse",
                above=0,
            )
        if line is not None:
            by_line = line.reserve(1 / by_K, 1 / by_section)
        result[n] = (step.index, step.cycles, a, K, by_K, by_section, by_line)
    return result


def _largest_K(step: Step, nu: float) -> tuple[float, int]:
    """Largest K_eq of all load states at all tips of a step, and the crack that has it."""
    largest = [
        float(
            equivalent_K(clipped_K(np.stack([s[c].K for s in step.sif])), angle, nu).max(initial=0)
        )
        for c, angle in enumerate(step.angle)
    ]
    c = int(np.argmax(largest))
    return largest[c], c


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
            length = np.nan if step.memory is None else step.memory.length[c]
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
    rising = np.concatenate([[True], a[1:] > np.maximum.accumulate(a)[:-1]])
    path = path_of(file, "write_factors: file", error=ProblemError)
    head = (
        f"# K over the length of crack {c}, tip {j}, by xcrack; units of the run\n"
        f"# reference stress {stress:.12g}; beta = K / (stress sqrt(pi a))\n"
        f"# {' '.join(f'{name:>15}' for name in _COLUMNS)}\n"
    )
    lines = (" ".join(f"{value:15.8g}" for value in row) for row in table[rising].tolist())
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


__all__ = ["assessment_line", "geometry_factors", "residual_strength", "write_factors"]
