"""Numbers of a growth run as a table: a row for each tip, in 3D for each front, of each step."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.arrays import Floats
from xcrack.crack.fronts_3d import front_weights
from xcrack.crack.tips_2d import tip_frames
from xcrack.growth.rates.uncertainty import uses_best
from xcrack.growth.steps.step import Step
from xcrack.history.life_bar import life_bar

Measures = dict[str, Callable[[Step, int], Floats]]

_MODES = ("I", "II", "III")
_ENDS = ("min", "mean", "max")
_CELLS = "domain_cells"
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
    quality = _quality(steps)
    names += [*quality, *_PARTS]
    rows = []
    for step in steps:
        for c, crack in enumerate(step.cracks):
            x, _ = tip_frames(crack)
            parts = [*(measure(step, c) for measure in quality.values()), *_parts(step, c)]
            for j in range(len(step.angle[c])):
                K = [value for state in step.sif for value in state[c].K[j]]
                K += [np.nan] * (2 * (len(states) - len(step.sif)))
                own = [values[j] for values in parts]
                rows.append((step.index, step.cycles, c, j, *x[j], _size(step, c), *K, *own))
        rows += _ended(step, len(names), with_size=True)
    return names, rows


def _table_3d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each front: smallest value along it, mean over its length, largest."""
    n_states = max((len(step.sif) for step in steps), default=0)
    values = [f"K_{m}_{s}" for s in range(n_states) for m in _MODES]
    quality = _quality(steps)
    values += [*quality, *_PARTS]
    names = ["step", "N", "crack", "front", "x", "y", "z", "a"]
    names += [f"{value}_{end}" for value in values for end in _ENDS]
    rows = [
        row
        for step in steps
        for row in (*_rows_3d(step, n_states, quality), *_ended(step, len(names), with_size=False))
    ]
    return names, rows


def _ended(step: Step, n_columns: int, *, with_size: bool) -> list[tuple[Any, ...]]:
    """Rows of a step at which no tip is left: where they came to the boundary, without K."""
    if not step.has_left:
        return []
    rows = []
    for each in step.arrivals:
        size = _size(step, each.crack) if with_size else np.nan
        number = each.tip if with_size else 0
        row = (step.index, step.cycles, each.crack, number, *each.x, size)
        rows.append((*row, *[np.nan] * (n_columns - len(row))))
    return rows


def _rows_3d(step: Step, n_states: int, quality: Measures) -> list[tuple[Any, ...]]:
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
            columns += [measure(step, c)[mine] for measure in quality.values()]
            columns += [values[mine] for values in _parts(step, c)]
            ends = [end for values in columns for end in _ends(values, weight)]
            middle, size = weight @ sif.x[mine], _size(step, c)
            rows.append((step.index, step.cycles, c, int(number), *middle, size, *ends))
    return rows


def _spread(step: Step, c: int) -> Floats:
    """Largest difference between two domains of all states and modes `(f,)`."""
    every = [state[c].spread.max(axis=1, initial=0.0) for state in step.sif]
    return np.max(every, axis=0) if every else np.full(len(step.angle[c]), np.nan)


def _bar(step: Step, c: int) -> Floats:
    """Longest error bar of all states and modes `(f,)`; nan where one is unknown."""
    return np.max([state[c].bar.max(axis=1, initial=0.0) for state in step.sif], axis=0)


def _best(step: Step, c: int) -> Floats:
    """1 where growth followed the best K in all states, else 0 `(f,)`."""
    return np.min([uses_best(state[c]) for state in step.sif], axis=0).astype(np.float64)


def _of_N(step: Step, c: int) -> Floats:  # noqa: N802
    """Error bar of the cycles so far `(f,)`."""
    return np.full(len(step.angle[c]), life_bar([step]).total)


def _domain_cells(step: Step, c: int) -> Floats:
    """Smallest radius of the domains of all states, in cells `(f,)`."""
    return np.min([getattr(state[c], _CELLS) for state in step.sif], axis=0)


def _quality(steps: Sequence[Step]) -> Measures:
    """Columns that say how far K is to be trusted, of what the steps have."""
    every = [sif for step in steps for state in step.sif for sif in state if len(sif.K)]
    known = bool(every) and all(hasattr(sif, _CELLS) for sif in every)
    measures: Measures = {"spread": _spread}
    if known:
        measures[_CELLS] = _domain_cells
    if every and all(sif.errors is not None for sif in every):
        measures |= {"bar": _bar, "best": _best, "N_bar": _of_N}
    return measures


def _parts(step: Step, c: int) -> list[Floats]:
    return [getattr(step, part)[c] for part in _PARTS]


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
