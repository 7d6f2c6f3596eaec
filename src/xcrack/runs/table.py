"""A growth run as tables: its ends, what an engineer measures, loads at fracture."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.analysis.solution import Solution
from xcrack.base.arrays import Floats, Ints
from xcrack.base.errors import ProblemError
from xcrack.base.markup import text_table
from xcrack.base.paths import write_texts
from xcrack.crack.crack import Crack, tip_frames
from xcrack.crack.fronts import front_weights
from xcrack.crack.measures import Measures, measures
from xcrack.growth.step import (
    Step,
)
from xcrack.mesh.mesh import Mesh
from xcrack.runs.life_bar import life_bar
from xcrack.runs.rerating import check_in_proportion, driving_forces

Columns = dict[str, Callable[[Step, int], Floats]]  # of a step and a crack, at its stations

_MODES = ("I", "II", "III")
_ENDS = ("min", "mean", "max")
_NUMBERED = re.compile(r"(K_I{1,3})_(\d+)(_min|_mean|_max|)")
_CELLS = "domain_cells"
_WHOLE = ("step", "crack", "tip", "front", "id")


class Table(np.ndarray[Any, Any]):
    """A structured array that names its columns where another one is asked for."""

    def __getitem__(self, key: Any) -> Any:
        names = self.dtype.names
        keys = [key] if isinstance(key, str) else key if isinstance(key, list) else []
        if names is None or not all(isinstance(name, str) for name in keys):
            keys = []
        columns = [self._by_number(name) for name in keys]
        for name in columns:
            if name not in (names or ()):
                name_list = ", ".join(names or ())
                raise ProblemError(f"the table has no column {name!r}: it has {name_list}.")
        if columns:
            key = columns[0] if isinstance(key, str) else columns
        result = super().__getitem__(key)
        return np.asarray(result) if isinstance(key, str) else result

    def __str__(self) -> str:
        names = self.dtype.names
        return super().__str__() if names is None else text_table(names, self.ravel().tolist())

    def _by_number(self, name: str) -> str:
        """Column of K of a load state by its number, as "K_I_1"; the name where it is none."""
        match = _NUMBERED.fullmatch(name)
        if match is None or self.dtype.names is None or name in self.dtype.names:
            return name
        stem, number, end = match.groups()
        first = f"{stem}_"
        columns = [n for n in self.dtype.names if n.startswith(first) and n.endswith(end)]
        return columns[int(number)] if int(number) < len(columns) else name


def table(steps: Sequence[Step]) -> Table:
    """Table of steps; its columns are those that `History.table` names."""
    fronts = bool(steps and steps[-1].cracks and steps[-1].cracks[0].fronts is not None)
    names, rows = (_table_3d if fronts else _table_2d)(steps)
    kinds = [(n, np.int64 if n in _WHOLE else np.float64) for n in names]
    return np.array(rows, dtype=kinds).view(Table)


def state_names(steps: Sequence[Step]) -> list[str]:
    """Names of all load states of some steps, in the order of their loads."""
    all_names = {name for step in steps for name in step.states}
    numbers = sorted((name for name in all_names if name.isdigit()), key=int)
    words = [name for step in steps for name in step.states if not name.isdigit()]
    other_names = [name for name in dict.fromkeys(words) if name not in ("min", "max")]
    ends = [[name] if name in all_names else [] for name in ("min", "max")]
    return [*ends[0], *numbers, *other_names, *ends[1]]


def _K_of_states(step: Step, states: Sequence[str], c: int, modes: int) -> list[Floats]:
    """K of the modes of each state at the stations of a crack; nan where a step has no such one."""
    n = len(step.angle[c])
    result = []
    for name in states:
        row = step.states.index(name) if name in step.states else -1
        for m in range(modes):
            K = step.sif[row][c].K if row >= 0 else np.full((n, modes), np.nan)
            result.append(K[:, m] if m < K.shape[1] else np.zeros(n))
    return result


def crack_numbers(step: Step) -> tuple[int, ...]:
    """Number that each crack of a step had at first."""
    identities = step.identities
    return tuple(range(len(step.cracks))) if identities is None else identities.cracks


def end_id(step: Step, crack: int, number: int) -> int:
    """Identity of a tip or front; its number where nothing is known."""
    return number if step.identities is None else step.identities.ends[crack][number]


def _table_2d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each tip."""
    states, parts = state_names(steps), _parts(steps)
    names = ["step", "N", "crack", "tip", "id", "x", "y", "a"]
    names += [f"K_{m}_{s}" for s in states for m in _MODES[:2]]
    quality = _quality_columns(steps)
    names += [*quality, *parts]
    rows = []
    for step in steps:
        for c, crack in enumerate(step.cracks):
            x, _ = tip_frames(crack)
            values = [
                *(of(step, c) for of in quality.values()),
                *(of(step, c) for of in parts.values()),
            ]
            K = _K_of_states(step, states, c, 2)
            for j in range(len(step.angle[c])):
                numbers = [column[j] for column in (*K, *values)]
                end = end_id(step, c, j)
                rows.append((step.index, step.cycles, c, j, end, *x[j], _size(step, c), *numbers))
        rows += _rows_at_end(step, len(names), with_size=True)
    return names, rows


def _table_3d(steps: Sequence[Step]) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Columns, and a row for each front: smallest value along it, mean over its length, largest."""
    states, parts = state_names(steps), _parts(steps)
    values = [f"K_{m}_{s}" for s in states for m in _MODES]
    quality = _quality_columns(steps)
    values += [*quality, *parts]
    names = ["step", "N", "crack", "front", "id", "x", "y", "z", "a"]
    names += [f"{value}_{end}" for value in values for end in _ENDS]
    rows = [
        row
        for step in steps
        for row in (
            *_rows_3d(step, states, {**quality, **parts}),
            *_rows_at_end(step, len(names), with_size=False),
        )
    ]
    return names, rows


def _rows_at_end(step: Step, n_columns: int, *, with_size: bool) -> list[tuple[Any, ...]]:
    """Rows of a step at which no tip is left: where they came to the boundary, without K."""
    if not step.has_left:
        return []
    rows = []
    for arrival in step.arrivals:
        size = _size(step, arrival.crack) if with_size else np.nan
        number = arrival.tip if with_size else 0
        row = (step.index, step.cycles, arrival.crack, number, arrival.end, *arrival.x, size)
        rows.append((*row, *[np.nan] * (n_columns - len(row))))
    return rows


def _rows_3d(step: Step, states: Sequence[str], columns: Columns) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []
    for c in range(len(step.cracks)):
        if not step.sif:
            continue
        sif = step.sif[0][c]
        parts = [*_K_of_states(step, states, c, 3), *(of(step, c) for of in columns.values())]
        for number in np.unique(sif.front).tolist():
            places = np.nonzero(sif.front == number)[0]
            weight = front_weights(sif.x[places])
            ends = [end for values in parts for end in _extremes_and_mean(values[places], weight)]
            middle, size, end = weight @ sif.x[places], _size(step, c), end_id(step, c, number)
            rows.append((step.index, step.cycles, c, number, end, *middle, size, *ends))
    return rows


def _domain_spread(step: Step, c: int) -> Floats:
    """Largest difference between two domains of all states and modes `(f,)`."""
    spreads = [state[c].spread.max(axis=1, initial=0.0) for state in step.sif]
    return np.max(spreads, axis=0) if spreads else np.full(len(step.angle[c]), np.nan)


def _longest_bar(step: Step, c: int) -> Floats:
    """Longest error bar of all states and modes `(f,)`; nan where one is unknown."""
    return np.max([state[c].bar.max(axis=1, initial=0.0) for state in step.sif], axis=0)


def _uses_best_K(step: Step, c: int) -> Floats:
    """1 where growth followed the best K in all states, else 0 `(f,)`."""
    return np.min([state[c].has_best for state in step.sif], axis=0).astype(np.float64)


def _of_N(step: Step, c: int) -> Floats:  # noqa: N802
    """Error bar of the cycles so far `(f,)`."""
    return np.full(len(step.angle[c]), life_bar([step]).total)


def _domain_cells(step: Step, c: int) -> Floats:
    """Smallest radius of the domains of all states, in cells `(f,)`."""
    return np.min([getattr(state[c], _CELLS) for state in step.sif], axis=0)


def _quality_columns(steps: Sequence[Step]) -> Columns:
    """Columns that say how far K is to be trusted, of what the steps have."""
    sifs = [sif for step in steps for state in step.sif for sif in state if len(sif.K)]
    has_cells = bool(sifs) and all(hasattr(sif, _CELLS) for sif in sifs)
    measures: Columns = {"spread": _domain_spread}
    if has_cells:
        measures[_CELLS] = _domain_cells
    if sifs and all(sif.errors is not None for sif in sifs):
        measures |= {"bar": _longest_bar, "best": _uses_best_K, "N_bar": _of_N}
    return measures


def _parts(steps: Sequence[Step]) -> Columns:
    """Columns of what growth has at a station; the ratios of all cycles where there are several."""

    def column(
        name: str, of: Callable[[Any], Floats] = np.asarray
    ) -> Callable[[Step, int], Floats]:
        return lambda step, c: of(getattr(step, name)[c])

    result: Columns = {name: column(name) for name in ("angle", "dK_eq", "R")}
    pairs = [(r, R) for step in steps for r, R in zip(step.R_range, step.R)]
    if any(not np.array_equal(r, np.stack([R, R], axis=1)) for r, R in pairs):
        result["R_low"] = lambda step, c: step.R_range[c][:, 0]
        result["R_high"] = lambda step, c: step.R_range[c][:, 1]
    for name in _VALIDITY:
        values = [getattr(step.validity, name, np.nan) for step in steps]
        if np.isfinite(values).any():
            result[_VALIDITY[name]] = _of_validity(name)
    if any(step.load_factor != 1 for step in steps):
        result["load_factor"] = lambda step, c: np.full(len(step.R[c]), step.load_factor)
    return result | {name: column(name) for name in ("rate", "da")}


_VALIDITY = {
    "of_crack": "zone_of_crack",
    "of_ligament": "zone_of_ligament",
    "of_section": "section",
    "of_toughness": "K_of_K_c",
}


def _of_validity(name: str) -> Callable[[Step, int], Floats]:
    """A column of what elasticity is judged by: the same at all stations of a step."""
    return lambda step, c: np.full(len(step.R[c]), getattr(step.validity, name, np.nan))


def _size(step: Step, c: int) -> float:
    return step.sizes[c] if step.sizes else np.nan


def _extremes_and_mean(values: Floats, weight: Floats) -> tuple[float, float, float]:
    """Smallest value, mean and largest; points without a value do not count."""
    is_finite = np.isfinite(values)
    if not is_finite.any():
        return np.nan, np.nan, np.nan
    good_values, share = values[is_finite], weight[is_finite]
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
    coordinates = "\n".join(" ".join(repr(float(v)) for v in x) for part in points for x in part)
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


# --- tables of what an engineer reads off the cracks of a run, and of where their ends lie ---


Indicators = list[tuple[Step, int, Measures]]  # of each crack of each step


def measures_of_steps(steps: Sequence[Step], mesh: Mesh) -> Indicators:
    """Measures of each crack of each step."""
    return [
        (step, c, measures(crack, mesh)) for step in steps for c, crack in enumerate(step.cracks)
    ]


def measures_tables(indicators: Indicators, mesh: Mesh) -> tuple[NDArray[Any], NDArray[Any]]:
    """Measures of each crack of each step, and the ends of their fronts.

    Parameters
    ----------
    indicators : list of (Step, crack number, Measures)
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
    names = _set_names(indicators)
    columns = [("step", np.int64), ("N", float), ("crack", np.int64)]
    columns += [(name, float) for name in ("area", "front_length", "depth")]
    columns += [(f"{label}_{name}", float) for name in names for label in ("length", "depth")]
    rows = [
        (step.index, step.cycles, c, m.area, m.front_length, m.depth, *_by_set(m, names))
        for step, c, m in indicators
    ]
    width = max((len(name) for name in mesh.facet_sets), default=1)
    places = [(axis, float) for axis in "xyz"[: mesh.dim]]
    kinds = [*columns[:3], ("front", np.int64), *places, ("set", f"U{width}")]
    ends = [
        (step.index, step.cycles, c, end.front, *end.x, end.name)
        for step, c, m in indicators
        for end in m.ends
    ]
    return np.array(rows, dtype=columns), np.array(ends, dtype=kinds)


def with_measures(rows: NDArray[Any], indicators: Indicators, mesh: Mesh) -> NDArray[Any]:
    """The table of steps with the measures of the crack of each row behind its columns.

    Parameters
    ----------
    rows : structured array
        What `history.table.table` gives.
    indicators : list of (Step, crack number, Measures)
    mesh : Mesh

    Returns
    -------
    structured array
        With columns area, depth, ``length_<set>`` and ``depth_<set>``, and for both ends of the
        front of the row, in 2D the mouths of its crack, ``end_0_x`` and so on, and ``end_0_set``.
    """
    names, axes = _set_names(indicators), "xyz"[: mesh.dim]
    width = max((len(name) for name in mesh.facet_sets), default=1)
    columns: list[tuple[str, Any]] = [("area", float), ("depth", float)]
    columns += [(f"{label}_{name}", float) for name in names for label in ("length", "depth")]
    for k in range(2):
        columns += [(f"end_{k}_{axis}", float) for axis in axes]
        columns.append((f"end_{k}_set", f"U{width}"))
    measures_of_step = {(step.index, c): m for step, c, m in indicators}
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


def _set_names(indicators: Indicators) -> list[str]:
    return sorted({trace.name for _, _, m in indicators for trace in m.traces})


def _by_set(m: Measures, names: Sequence[str]) -> list[float]:
    traces = {trace.name: (trace.length, trace.depth) for trace in m.traces}
    return [value for name in names for value in traces.get(name, (np.nan, np.nan))]


# --- loads at which a crack goes on without cycles: K = K_c at each step of a run ---


COLUMNS = ("step", "a", "factor", "force", "displacement")


def fracture_loads(steps: Sequence[Step], K_c: float) -> NDArray[Any]:
    """As `History.load_at`.

    Raises
    ------
    ProblemError
    """
    solved_steps = [step for step in steps if not step.has_left]
    if not solved_steps or not all(step.solutions for step in solved_steps):
        raise ProblemError(
            "load_at: the steps have no solutions, as those of a run read from its folder: call it "
            "on what collect returned."
        )
    check_in_proportion(solved_steps, driving_forces(steps), "load_at")
    rows = []
    for step in solved_steps:
        pairs = zip(step.dK_eq, step.R, strict=True)
        K = [float((dK / (1.0 - R)).max()) for dK, R in pairs if len(dK)]
        factor = K_c / max(K)
        solution = max(step.solutions, key=lambda s: s.energy)
        force = _largest_resultant(solution)
        size = _largest_size(step)
        rows.append((step.index, size, factor, factor * force,
                     factor * 2.0 * solution.energy / force))  # fmt: skip
    kinds = [(name, int if name == "step" else float) for name in COLUMNS]
    return np.array(rows, dtype=kinds)


def _largest_resultant(solution: Solution) -> float:
    """Norm of the largest force of a load or of a support."""
    return max(float(np.linalg.norm(row.force)) for row in solution.report.resultants)


def _largest_size(step: Step) -> float:
    """Length of all cracks in the body, in 3D their area."""
    mesh = step.solutions[0].problem.mesh
    return sum(measures(crack, mesh).area for crack in step.cracks)


__all__ = [
    "COLUMNS",
    "Table",
    "crack_numbers",
    "end_id",
    "fracture_loads",
    "polylines",
    "state_names",
    "table",
    "write_series",
]
