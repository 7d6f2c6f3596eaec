"""Numbers of a growth run in space: a row for each front of each step."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.arrays import Floats
from xcrack.growth.step import Step
from xcrack.plotting.fronts_3d import front_weights

_MODES = ("I", "II", "III")
_ENDS = ("min", "mean", "max")
_PARTS = ("angle", "dK_eq", "R", "rate", "da")


def space_table(steps: Sequence[Step]) -> NDArray[Any]:
    """Smallest value, mean over the length and largest value along each front of each step.

    Parameters
    ----------
    steps : sequence of Step

    Returns
    -------
    structured array
        Columns as `History.table` names them.
    """
    n_states = max((len(step.sif) for step in steps), default=0)
    values = [f"K_{m}_{s}" for s in range(n_states) for m in _MODES] + list(_PARTS)
    names = ["step", "N", "crack", "front", "x", "y", "z", "a"]
    names += [f"{value}_{end}" for value in values for end in _ENDS]
    whole = ("step", "crack", "front")
    rows = [row for step in steps for row in _rows(step, n_states)]
    return np.array(rows, dtype=[(n, np.int64 if n in whole else np.float64) for n in names])


def _rows(step: Step, n_states: int) -> list[tuple[Any, ...]]:
    rows = []
    for c in range(len(step.cracks)):
        if not step.sif:
            continue
        sif = step.sif[0][c]
        a = np.nan if step.memory is None else step.memory.length[c]
        for front in np.unique(sif.front):
            mine = np.nonzero(sif.front == front)[0]
            weight = front_weights(sif.x[mine])
            columns = [
                state[c].K[mine, m] if m < state[c].K.shape[1] else np.zeros(len(mine))
                for state in step.sif
                for m in range(3)
            ]
            columns += [np.full(len(mine), np.nan)] * (3 * n_states - len(columns))
            columns += [getattr(step, part)[c][mine] for part in _PARTS]
            ends = [end for values in columns for end in _ends(values, weight)]
            middle = weight @ sif.x[mine]
            rows.append((step.index, step.cycles, c, int(front), *middle, a, *ends))
    return rows


def _ends(values: Floats, weight: Floats) -> tuple[float, float, float]:
    """Smallest value, mean and largest; points without a value do not count."""
    good = np.isfinite(values)
    if not good.any():
        return np.nan, np.nan, np.nan
    kept, share = values[good], weight[good]
    total = float(share.sum())
    mean = float(share @ kept) / total if total else float(kept.mean())
    return float(kept.min()), mean, float(kept.max())


__all__ = ["space_table"]
