"""Numbers of a growth run as a table: a row for each tip, in 3D for each front, of each step."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.paths import write_texts
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.stations import front_weights
from xcrack.growth.step import Step
from xcrack.growth.uncertainty import uses_best
from xcrack.runs.life_bar import life_bar

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
    quality = _quality_columns(steps)
    names += [*quality, *_PARTS]
    rows = []
    for step in steps:
        for c, crack in enumerate(step.cracks):
            x, _ = tip_frames(crack)
            parts = [*(measure(step, c) for measure in quality.values()), *_parts(step, c)]
            for j in range(len(step.angle[c])):
                K = [value for state in step.sif for value in state[c].K[j]]
                K += [np.nan] * (2 * (len(states) - len(step.sif)))
                values_of_tip = [values[j] for values in parts]
                rows.append(
                    (step.index, step.cycles, c, j, *x[j], _size(step, c), *K, *values_of_tip)
                )
        rows += _rows_at_end(step, len(names), with_size=True)
    return names, rows


def _table_3d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each front: smallest value along it, mean over its length, largest."""
    n_states = max((len(step.sif) for step in steps), default=0)
    values = [f"K_{m}_{s}" for s in range(n_states) for m in _MODES]
    quality = _quality_columns(steps)
    values += [*quality, *_PARTS]
    names = ["step", "N", "crack", "front", "x", "y", "z", "a"]
    names += [f"{value}_{end}" for value in values for end in _ENDS]
    rows = [
        row
        for step in steps
        for row in (
            *_rows_3d(step, n_states, quality),
            *_rows_at_end(step, len(names), with_size=False),
        )
    ]
    return names, rows


def _rows_at_end(step: Step, n_columns: int, *, with_size: bool) -> list[tuple[Any, ...]]:
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
            points_of_front = np.nonzero(sif.front == number)[0]
            weight = front_weights(sif.x[points_of_front])
            columns = [
                state[c].K[points_of_front, m]
                if m < state[c].K.shape[1]
                else np.zeros(len(points_of_front))
                for state in step.sif
                for m in range(3)
            ]
            columns += [np.full(len(points_of_front), np.nan)] * (3 * n_states - len(columns))
            columns += [measure(step, c)[points_of_front] for measure in quality.values()]
            columns += [values[points_of_front] for values in _parts(step, c)]
            ends = [end for values in columns for end in _extremes_and_mean(values, weight)]
            middle, size = weight @ sif.x[points_of_front], _size(step, c)
            rows.append((step.index, step.cycles, c, int(number), *middle, size, *ends))
    return rows


def _domain_spread(step: Step, c: int) -> Floats:
    """Largest difference between two domains of all states and modes `(f,)`."""
    every = [state[c].spread.max(axis=1, initial=0.0) for state in step.sif]
    return np.max(every, axis=0) if every else np.full(len(step.angle[c]), np.nan)


def _longest_bar(step: Step, c: int) -> Floats:
    """Longest error bar of all states and modes `(f,)`; nan where one is unknown."""
    return np.max([state[c].bar.max(axis=1, initial=0.0) for state in step.sif], axis=0)


def _uses_best_K(step: Step, c: int) -> Floats:
    """1 where growth followed the best K in all states, else 0 `(f,)`."""
    return np.min([uses_best(state[c]) for state in step.sif], axis=0).astype(np.float64)


def _of_N(step: Step, c: int) -> Floats:  # noqa: N802
    """Error bar of the cycles so far `(f,)`."""
    return np.full(len(step.angle[c]), life_bar([step]).total)


def _domain_cells(step: Step, c: int) -> Floats:
    """Smallest radius of the domains of all states, in cells `(f,)`."""
    return np.min([getattr(state[c], _CELLS) for state in step.sif], axis=0)


def _quality_columns(steps: Sequence[Step]) -> Measures:
    """Columns that say how far K is to be trusted, of what the steps have."""
    every = [sif for step in steps for state in step.sif for sif in state if len(sif.K)]
    has_cells = bool(every) and all(hasattr(sif, _CELLS) for sif in every)
    measures: Measures = {"spread": _domain_spread}
    if has_cells:
        measures[_CELLS] = _domain_cells
    if every and all(sif.errors is not None for sif in every):
        measures |= {"bar": _longest_bar, "best": _uses_best_K, "N_bar": _of_N}
    return measures


def _parts(step: Step, c: int) -> list[Floats]:
    return [getattr(step, part)[c] for part in _PARTS]


def _size(step: Step, c: int) -> float:
    return np.nan if step.memory is None else step.memory.length[c]


def _extremes_and_mean(values: Floats, weight: Floats) -> tuple[float, float, float]:
    """Smallest value, mean and largest; points without a value do not count."""
    good = np.isfinite(values)
    if not good.any():
        return np.nan, np.nan, np.nan
    good_values, share = values[good], weight[good]
    total = float(share.sum())
    mean = float(share @ good_values) / total if total else float(good_values.mean())
    return float(good_values.min()), mean, float(good_values.max())


# A growth run as a series of files for ParaView.

_UNWRITTEN = "the history cannot be written as a whole to"


def write_series(steps: Sequence[Step], folder: Path) -> Path:
    """Write ``history.pvd`` and the files it lists; its time is the number of the step.

    Steps with solutions: a grid with the crack faces for each load state, in 3D with the fronts and
    K along them. Steps without: the lines, or in 3D the faces and fronts, of the cracks.
    """
    from xcrack.output.vtk import write  # loads the writers of files

    entries = []
    parts = folder / "steps"
    parts.mkdir(exist_ok=True)
    for step in steps:
        names = []
        for state, solution in enumerate(step.solutions):
            stem = parts / f"step_{step.index:05d}_state_{state}"
            K = {"sif": step.sif[state]} if step.sif and step.cracks[0].fronts is not None else {}
            names += [file.name for file in write(solution, stem, **K)]
        if not names:
            name = f"step_{step.index:05d}_cracks.vtp"
            write_texts({parts / name: polylines(step.cracks)}, _UNWRITTEN, error=ProblemError)
            names.append(name)
        entries += [
            f'    <DataSet timestep="{step.index}" part="{part}" file="steps/{name}"/>'
            for part, name in enumerate(names)
        ]
    target = folder / "history.pvd"
    text = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        + "\n".join(entries)
        + "\n  </Collection>\n</VTKFile>\n"
    )
    write_texts({target: text}, _UNWRITTEN, error=ProblemError)
    return target


def polylines(cracks: Sequence[Crack]) -> str:
    """Text of a ``.vtp`` file with the faces of all cracks, in 3D with their fronts as lines."""
    dim = cracks[0].points.shape[1] if cracks else 2
    start = np.cumsum([0, *(len(crack.points) for crack in cracks)])
    points = [np.pad(crack.points, ((0, 0), (0, 3 - dim))) for crack in cracks]
    faces = [
        (c, face + begin)
        for c, (crack, begin) in enumerate(zip(cracks, start, strict=False))
        for face in crack.faces
    ]
    fronts = [
        (c, front + begin)
        for c, (crack, begin) in enumerate(zip(cracks, start, strict=False))
        for front in crack.fronts or ()
    ]
    lines, polys = (faces, []) if dim == 2 else (fronts, faces)
    blocks = "".join(_cells(name, part) for name, part in (("Lines", lines), ("Polys", polys)))
    coordinates = "\n".join(" ".join(repr(float(v)) for v in x) for each in points for x in each)
    crack_of = " ".join(str(c) for c, _ in [*lines, *polys])
    counts = f'NumberOfLines="{len(lines)}" NumberOfPolys="{len(polys)}"'
    return f"""<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
  <PolyData>
    <Piece NumberOfPoints="{start[-1]}" {counts}>
      <CellData>
        <DataArray type="Int32" Name="crack" format="ascii">{crack_of}</DataArray>
      </CellData>
      <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
{coordinates}
      </DataArray></Points>
{blocks}    </Piece>
  </PolyData>
</VTKFile>
"""


def _cells(name: str, cells: Sequence[tuple[int, Ints]]) -> str:
    """Text of the lines or polygons of a file; nothing where there are none."""
    if not cells:
        return ""
    connectivity = " ".join(str(i) for _, cell in cells for i in cell)
    offsets = " ".join(str(i) for i in np.cumsum([len(cell) for _, cell in cells]))
    return f"""      <{name}>
        <DataArray type="Int64" Name="connectivity" format="ascii">{connectivity}</DataArray>
        <DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray>
      </{name}>
"""


__all__ = ["polylines", "table", "write_series"]
