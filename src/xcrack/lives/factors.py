"""Tables of K over the length of a crack, as files that other life codes can take."""

from pathlib import Path

import numpy as np

from xcrack.errors import ProblemError
from xcrack.history.history import History
from xcrack.inputs import number, shown, whole
from xcrack.lives.assessment import geometry_factors
from xcrack.paths import path_of, system_errors, written_whole

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
        raise ProblemError(f"write_factors: history = {shown(history)}: give a History.")
    stress = number(stress, "write_factors: stress", above=0)
    c = whole(crack, "write_factors: crack", least=0)
    j = whole(tip, "write_factors: tip", least=0)
    rows = geometry_factors(history, stress=stress)
    mine = rows[(rows["crack"] == c) & (rows["tip"] == j)]
    if not len(mine):
        raise ProblemError(
            f"write_factors: the history has no crack {c} with a tip {j}: give "
            "those of history.table()."
        )
    a, half = mine["a"].copy(), np.full(len(mine), np.nan)
    if history.steps[0].cracks[0].fronts is not None:
        a, half = _on_surface(history, mine["step"], c)
    beta = mine["K_I"] / (stress * np.sqrt(np.pi * a))
    table = np.stack([a, half, mine["K_I"], beta], axis=1)
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
    mine = measures[measures["crack"] == crack]
    mine = mine[np.isin(mine["step"], steps)]
    sets = [name.removeprefix("depth_") for name in mine.dtype.names if name.startswith("depth_")]
    depth = np.array([mine[f"depth_{name}"] for name in sets]).reshape(len(sets), len(mine))
    length = np.array([mine[f"length_{name}"] for name in sets]).reshape(len(sets), len(mine))
    half = np.full(len(mine), np.nan)
    for n in range(len(mine)):
        if np.isfinite(depth[:, n]).any():
            half[n] = 0.5 * length[int(np.nanargmax(depth[:, n])), n]
    return np.asarray(mine["depth"]), half


__all__ = ["write_factors"]
