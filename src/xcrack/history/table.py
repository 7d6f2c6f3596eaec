"""Numbers of a growth run as a table: a row for each tip, in 3D for each front, of each step."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.arrays import Floats
from xcrack.crack.crack import front
from xcrack.crack.fronts_3d import front_weights
from xcrack.growth.step import Step

_MODES = ("I", "II", "III")
_ENDS = ("min", "mean", "max")
_PARTS = ("angle", "dK_eq", "R", "rate", "da")
_WHOLE = ("step", "crack", "tip", "front")


def table(steps: Sequence[Step]) -> NDArray[Any]:
    """Table of steps; its columns are those that `History.table` names."""
    fronts = bool(steps and steps[-1].cracks and steps[-1].cracks[0].fronts is not None)
    names, rows = (_table_3d if fronts else _table_2d)(steps)
    return np.array(rows, dtype=[(n, np.int64 if n in _WHOLE else np.float64) for n in names])


def _table_2d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each tip."""
    states = range(max((len(step.sif) for step in steps), default=0))
    names = ["step", "N", "crack", "tip", "x", "y", "a"]
    names += [f"K_{m}_{s}" for s in states for m in _MODES[:2]]
    names += ["spread", "domain_cells", *_PARTS]
    rows = []
    for step in steps:
        for c, crack in enumerate(step.cracks):
            x, _ = front(crack)
            quality = _spread(step, c), _domain_cells(step, c)
            for j in range(len(step.angle[c])):
                K = [value for state in step.sif for value in state[c].K[j]]
                own = [values[j] for values in (*quality, *(getattr(step, p)[c] for p in _PARTS))]
                rows.append((step.index, step.cycles, c, j, *x[j], _size(step, c), *K, *own))
    return names, rows


def _table_3d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each front: smallest value along it, mean over its length, largest."""
    n_states = max((len(step.sif) for step in steps), default=0)
    values = [f"K_{m}_{s}" for s in range(n_states) for m in _MODES]
    values += ["spread", "domain_cells", *_PARTS]
    names = ["step", "N", "crack", "front", "x", "y", "z", "a"]
    names += [f"{value}_{end}" for value in values for end in _ENDS]
    return names, [row for step in steps for row in _rows_3d(step, n_states)]


def _rows_3d(step: Step, n_states: int) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []
    for c in range(len(step.cracks)):
        if not step.sif:
            continue
        sif = step.sif[0][c]
        for number in np.unique(sif.front):
            mine = np.nonzero(sif.front == number)[0]
            weight = front_weights(sif.x[mine])
            columns = [
                state[c].K[mine, m] if m < state[c].K.shape[1] else np.zeros(len(mine))
                for state in step.sif
                for m in range(3)
            ]
            columns += [np.full(len(mine), np.nan)] * (3 * n_states - len(columns))
            columns += [_spread(step, c)[mine], _domain_cells(step, c)[mine]]
            columns += [getattr(step, part)[c][mine] for part in _PARTS]
            ends = [end for values in columns for end in _ends(values, weight)]
            middle, size = weight @ sif.x[mine], _size(step, c)
            rows.append((step.index, step.cycles, c, int(number), *middle, size, *ends))
    return rows


def _spread(step: Step, c: int) -> Floats:
    """Largest difference between two domains of all states and modes `(f,)`."""
    every = [state[c].spread.max(axis=1, initial=0.0) for state in step.sif]
    return np.max(every, axis=0) if every else np.full(len(step.angle[c]), np.nan)


def _domain_cells(step: Step, c: int) -> Floats:
    """Smallest radius of the domains of all states, in cells `(f,)`; nan where it is not known."""
    unknown = np.full(len(step.angle[c]), np.nan)
    every = [getattr(state[c], "domain_cells", None) for state in step.sif]
    return np.fmin.reduce([unknown, *(cells for cells in every if cells is not None)])


def _size(step: Step, c: int) -> float:
    return np.nan if step.memory is None else step.memory.length[c]


def _ends(values: Floats, weight: Floats) -> tuple[float, float, float]:
    """Smallest value, mean and largest; points without a value do not count."""
    good = np.isfinite(values)
    if not good.any():
        return np.nan, np.nan, np.nan
    there, share = values[good], weight[good]
    total = float(share.sum())
    mean = float(share @ there) / total if total else float(there.mean())
    return float(there.min()), mean, float(there.max())


__all__ = ["table"]
