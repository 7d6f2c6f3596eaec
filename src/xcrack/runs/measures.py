"""Tables of what an engineer reads off the cracks of a run, and of where their ends lie."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.crack.measures import Measures, measures
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh

Indicators = list[tuple[Step, int, Measures]]  # of each crack of each step


def measures_of_steps(steps: Sequence[Step], mesh: Mesh) -> Indicators:
    """Measures of each crack of each step."""
    return [
        (step, c, measures(crack, mesh)) for step in steps for c, crack in enumerate(step.cracks)
    ]


def measures_tables(every: Indicators, mesh: Mesh) -> tuple[NDArray[Any], NDArray[Any]]:
    """Measures of each crack of each step, and the ends of their fronts.

    Parameters
    ----------
    every : list of (Step, crack number, Measures)
    mesh : Mesh
        The body.

    Returns
    -------
    measures : structured array
        Columns step, N, crack, area, front_length, depth, and for each facet set that a crack ever
        meets ``length_<set>`` and ``depth_<set>`` (nan in steps where it does not).
    ends : structured array
        Columns step, N, crack, front, x, y (, z), set.
    """
    names = _set_names(every)
    columns = [("step", np.int64), ("N", float), ("crack", np.int64)]
    columns += [(name, float) for name in ("area", "front_length", "depth")]
    columns += [(f"{what}_{name}", float) for name in names for what in ("length", "depth")]
    rows = [
        (step.index, step.cycles, c, m.area, m.front_length, m.depth, *_by_set(m, names))
        for step, c, m in every
    ]
    width = max((len(name) for name in mesh.facet_sets), default=1)
    places = [(axis, float) for axis in "xyz"[: mesh.dim]]
    kinds = [*columns[:3], ("front", np.int64), *places, ("set", f"U{width}")]
    ends = [
        (step.index, step.cycles, c, end.front, *end.x, end.name)
        for step, c, m in every
        for end in m.ends
    ]
    return np.array(rows, dtype=columns), np.array(ends, dtype=kinds)


def with_measures(rows: NDArray[Any], every: Indicators, mesh: Mesh) -> NDArray[Any]:
    """The table of steps with the measures of the crack of each row behind its columns.

    Parameters
    ----------
    rows : structured array
        What `history.table.table` gives.
    every : list of (Step, crack number, Measures)
    mesh : Mesh

    Returns
    -------
    structured array
        With columns area, depth, ``length_<set>`` and ``depth_<set>``, and for both ends of the
        front of the row, in 2D the mouths of its crack, ``end_0_x`` and so on, and ``end_0_set``.
    """
    names, axes = _set_names(every), "xyz"[: mesh.dim]
    width = max((len(name) for name in mesh.facet_sets), default=1)
    columns: list[tuple[str, Any]] = [("area", float), ("depth", float)]
    columns += [(f"{what}_{name}", float) for name in names for what in ("length", "depth")]
    for k in range(2):
        columns += [(f"end_{k}_{axis}", float) for axis in axes]
        columns.append((f"end_{k}_set", f"U{width}"))
    measures_of_step = {(step.index, c): m for step, c, m in every}
    numbers = rows["front"] if "front" in (rows.dtype.names or ()) else np.full(len(rows), -1)
    result = []
    for row, front in zip(rows, numbers.tolist(), strict=True):
        m = measures_of_step[int(row["step"]), int(row["crack"])]
        values: list[Any] = [m.area, m.depth, *_by_set(m, names)]
        ends_of_front = [end for end in m.ends if end.front == front][:2]
        for k in range(2):
            values += (
                [*ends_of_front[k].x, ends_of_front[k].name]
                if k < len(ends_of_front)
                else [*[np.nan] * len(axes), ""]
            )
        result.append((*row.tolist(), *values))
    return np.array(result, dtype=[*rows.dtype.descr, *columns])


def _set_names(every: Indicators) -> list[str]:
    return sorted({trace.name for _, _, m in every for trace in m.traces})


def _by_set(m: Measures, names: Sequence[str]) -> list[float]:
    traces = {trace.name: (trace.length, trace.depth) for trace in m.traces}
    return [value for name in names for value in traces.get(name, (np.nan, np.nan))]
