"""Tables of what an engineer reads off the cracks of a run, and of where their ends lie."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.crack.measures import Measures, measures
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh


def measures_tables(steps: Sequence[Step], mesh: Mesh) -> tuple[NDArray[Any], NDArray[Any]]:
    """Measures of each crack of each step, and the ends of their fronts.

    Parameters
    ----------
    steps : sequence of Step
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
    every = [
        (step, c, measures(crack, mesh)) for step in steps for c, crack in enumerate(step.cracks)
    ]
    names = sorted({trace.name for _, _, m in every for trace in m.traces})
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


def _by_set(m: Measures, names: Sequence[str]) -> list[float]:
    known = {trace.name: (trace.length, trace.depth) for trace in m.traces}
    return [value for name in names for value in known.get(name, (np.nan, np.nan))]
