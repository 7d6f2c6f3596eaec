"""Files for ParaView: the body with its cracks open, and their faces.

VTK's own writers are used without pyvista: they need no renderer and no libGL.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from xcrack.analysis.solution import Solution, SolutionArgument
from xcrack.base.arguments import FileName, OneOrMore, check_arguments
from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.optional import require_package
from xcrack.base.paths import system_errors, written_whole
from xcrack.crack.measures import measures
from xcrack.model.material import von_mises
from xcrack.output.lip_faces_3d import lip_faces
from xcrack.output.pieces import Pieces, lips_of, pieces
from xcrack.sif.common import lip_shear
from xcrack.sif.sif import SIF

_UNSAVED = "the solution cannot be written to"
# VTK's numbers of simplices, and the order of their nodes, by number of nodes.
_KIND = {3: 5, 6: 22, 4: 10, 10: 24}
_ORDER = {
    3: [0, 1, 2],
    6: [0, 1, 2, 3, 5, 4],
    4: [0, 1, 2, 3],
    10: [0, 1, 2, 3, 4, 7, 5, 6, 8, 9],
}


@check_arguments()
def write(
    solution: SolutionArgument,
    path: FileName,
    *,
    sif: Annotated[SIF | Sequence[SIF] | None, OneOrMore(SIF)] = None,
) -> list[Path]:
    """Write a solution for ParaView: ``<path>.vtu`` and, for its cracks, ``<path>_lips.vtp``.

    The grid has quadratic simplices wherever the solution is not linear, and points twice where
    a crack is: warp by ``displacement`` and the crack opens. Point data: ``displacement``,
    ``stress`` (mean of the cells at the point, on its own lip; xx yy zz xy yz xz), ``von_mises``,
    ``phi_<crack>`` and ``psi_<crack>_<tip>``. Cell data: ``stress_center``, ``von_mises_center``
    (no mean), ``enriched`` (1 Heaviside, 2 tip functions, 3 both), ``cell`` of the mesh, and where
    there are several ``material``, by its place among those of the problem. Points are there twice
    where materials meet, since stresses jump.

    The lips of all cracks share one file, a line each with cell data ``crack``. Its point data
    are those of ``solution.contact``: ``pressure``, ``gap``, ``closed`` (0 or 1; pressure 0 and
    never closed where a crack has no multipliers), ``s``, ``normal``, ``weight``, and ``opening``
    (the whole jump; with friction also ``shear``, the tangential traction on lip +, and ``stuck``),
    ``displacement_minus`` and ``displacement_plus``, to warp by. Points are
    those of the undeformed body.

    In 3D the lips are triangles: ``pressure`` is taken to their vertices by the best linear
    fit, and cell data are ``crack``, ``closed`` (half of the triangle or more), ``closed_share``,
    ``pressure_mean`` and ``gap_mean``. A third file, ``<path>_fronts.vtp``, has a line for each
    front with its frames (``ahead``, ``normal``), its arc length ``s`` and, where they are given,
    ``K_I``, ``K_II``, ``K_III`` and ``at_surface``, with error bars ``bar_I`` to ``bar_III`` where
    K has them; cell data are ``crack``, ``front``, ``area`` and, where all cracks meet the
    boundary, ``depth``.

    Parameters
    ----------
    solution : Solution
    path : path
        With or without ``.vtu``; folders on the way are made.
    sif : SIF, or one for each crack, optional
        What `stress_intensity` returned, for the file of the fronts.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ProblemError
        A path that ends on the suffix of another kind of VTK file, not
        one SIF for each crack, or a file that cannot be written.
    XcrackError
        VTK is not installed.
    """
    K = _checked_sif(solution, sif)
    target = _grid_path(Path(path))
    _write_grid(pieces(solution), target)
    if not any(len(lips) for lips in solution.lips):
        return [target]
    lips = target.with_name(f"{target.stem}_lips.vtp")
    if all(crack.fronts is None for crack in solution.space.cracks):
        _write_lips(solution, lips)
        return [target, lips]
    _write_lip_faces(solution, lips)
    if not solution.space.tips:
        return [target, lips]
    fronts = target.with_name(f"{target.stem}_fronts.vtp")
    _write_fronts(solution, K, fronts)
    return [target, lips, fronts]


def _checked_sif(solution: Solution, sif: Any) -> tuple[SIF, ...]:
    if sif is None:
        return ()
    K: tuple[SIF, ...] = sif
    n = len(solution.lips)
    if len(K) != n:
        raise ProblemError(
            f"write: sif = {value_text(sif)}: give one SIF for each of the {n} crack(s)."
        )
    for tip in solution.space.tips:
        K_of_crack = K[tip.crack]
        if (
            K_of_crack.x.shape[1:] != (solution.space.dim,)
            or not (K_of_crack.front == tip.number).any()
        ):
            raise ProblemError(
                f"write: sif of crack {tip.crack} has no K for its tip or front {tip.number}: give "
                "what stress_intensity returns for this solution."
            )
    return K


def _grid_path(target: Path) -> Path:
    if target.suffix in (".vtp", ".vtk", ".pvd", ".vtm") or target.name in ("", ".."):
        raise ProblemError(
            f"write: path = {value_text(str(target))}: the grid is a .vtu file; give that ending."
        )
    if target.suffix != ".vtu":
        target = target.with_name(target.name + ".vtu")
    with system_errors(_UNSAVED, target, error=ProblemError):
        target.parent.mkdir(parents=True, exist_ok=True)
    return target


def _write_grid(body: Pieces, path: Path) -> None:
    writer = _vtk("vtkIOXML").vtkXMLUnstructuredGridWriter()
    d = body.points.shape[1]
    blocks = [b[:, _ORDER[b.shape[1]]] for b in (body.plain_nodes, body.split)]
    kind = np.concatenate([np.full(len(b), _KIND[b.shape[1]], dtype=np.uint8) for b in blocks])
    grid = _vtk("vtkCommonDataModel").vtkUnstructuredGrid()
    grid.SetPoints(_points(body.points))
    grid.SetCells(_array(kind), _cells(blocks))
    at_points = {
        "displacement": np.pad(body.displacement, ((0, 0), (0, 3 - d))),
        "stress": _six_components(body.stress),
        "von_mises": von_mises(body.stress),
    }
    at_points |= {f"phi_{c}": phi for c, phi in enumerate(body.phi)}
    at_points |= {f"psi_{c}_{k}": v for c, psi in enumerate(body.psi) for k, v in enumerate(psi)}
    at_cells = {
        "stress_center": _six_components(body.center_stress),
        "von_mises_center": von_mises(body.center_stress),
        "enriched": body.enriched,
        "cell": body.cell,
    }
    set_number = body.solution.problem.elasticity.set_number
    if len(set_number):
        at_cells["material"] = set_number[body.cell]
    _save(writer, grid, at_points, at_cells, path)


def _write_lips(solution: Solution, path: Path) -> None:
    lips = [lips_of(solution, c) for c in range(len(solution.lips))]
    start = np.cumsum([0, *(len(lip.s) for lip in lips)])
    runs = [(c, start[c] + run) for c, lip in enumerate(lips) for run in lip.runs]
    vectors: dict[str, list[np.ndarray]] = {
        "normal": [lip.normal for lip in lips],
        "opening": [lip.jump for lip in lips],
        "displacement_minus": [lip.minus for lip in lips],
        "displacement_plus": [lip.plus for lip in lips],
    }
    scalars: dict[str, list[np.ndarray]] = {
        "pressure": [lip.pressure for lip in lips],
        "gap": [lip.gap for lip in lips],
        "closed": [lip.is_closed.astype(np.int8) for lip in lips],
        "s": [lip.s for lip in lips],
        "weight": [lip.weight for lip in solution.lips],
    }
    if any(solution.problem.frictions):
        shear_of_lips = [(lip_shear(solution, c), len(lip.s)) for c, lip in enumerate(lips)]
        vectors["shear"] = [np.zeros((n, 2)) if t is None else t for t, n in shear_of_lips]
        stuck_flags = [None if c is None else c.stuck for c in solution.contact]
        scalars["stuck"] = [
            np.zeros(len(lip.s), np.int8) if stuck_points is None else stuck_points.astype(np.int8)
            for stuck_points, lip in zip(stuck_flags, lips, strict=True)
        ]
    d = solution.space.dim
    at_points = {name: np.concatenate(values) for name, values in scalars.items()}
    for name, parts in vectors.items():
        at_points[name] = np.pad(np.concatenate(parts), ((0, 0), (0, 3 - d)))
    data = _vtk("vtkCommonDataModel").vtkPolyData()
    data.SetPoints(_points(np.concatenate([lip.x for lip in lips])))
    data.SetLines(_cells([run[None] for _, run in runs]))
    _save(
        _vtk("vtkIOXML").vtkXMLPolyDataWriter(),
        data,
        at_points,
        {"crack": np.array([c for c, _ in runs])},
        path,
    )


def _write_lip_faces(solution: Solution, path: Path) -> None:
    lips = [lip_faces(solution, c) for c in range(len(solution.lips))]
    start = np.cumsum([0, *(len(lip.points) for lip in lips)])

    def joined_values(name: str) -> np.ndarray:
        return np.concatenate([getattr(lip, name) for lip in lips])

    at_points = {name: joined_values(name) for name in ("pressure", "gap", "normal")}
    at_points["opening"] = joined_values("jump")
    at_points |= {f"displacement_{name}": joined_values(name) for name in ("minus", "plus")}
    at_cells: dict[str, np.ndarray] = {
        "crack": np.repeat(np.arange(len(lips)), [len(lip.area) for lip in lips]),
        "closed": (joined_values("closed_share") >= 0.5).astype(np.int8),
        "closed_share": joined_values("closed_share"),
        "pressure_mean": joined_values("mean_pressure"),
        "gap_mean": joined_values("mean_gap"),
    }
    data = _vtk("vtkCommonDataModel").vtkPolyData()
    data.SetPoints(_points(joined_values("points")))
    faces = [lip.triangles + begin for lip, begin in zip(lips, start, strict=False)]
    data.SetPolys(_cells([np.concatenate(faces)]))
    _save(_vtk("vtkIOXML").vtkXMLPolyDataWriter(), data, at_points, at_cells, path)


def _write_fronts(solution: Solution, sif: Sequence[SIF], path: Path) -> None:
    tips = solution.space.tips
    lines: list[dict[str, np.ndarray]] = []
    for tip in tips:
        if sif:
            sif_of_crack = sif[tip.crack]
            is_on_front = sif_of_crack.front == tip.number
            line = {
                "x": sif_of_crack.x[is_on_front],
                "frame": sif_of_crack.frame[is_on_front],
                "s": sif_of_crack.s[is_on_front],
            }
            line |= {
                f"K_{name}": getattr(sif_of_crack, f"K_{name}")[is_on_front]
                for name in ("I", "II", "III")
            }
            if all(crack_sif.errors is not None for crack_sif in sif):
                names = ("I", "II", "III")
                line |= {f"bar_{m}": sif_of_crack.bar[is_on_front, k] for k, m in enumerate(names)}
            line["at_surface"] = sif_of_crack.at_surface[is_on_front].astype(np.int8)
        else:
            step = np.linalg.norm(np.diff(tip.x, axis=0), axis=1)
            line = {"x": tip.x, "frame": tip.frame, "s": np.append(0.0, np.cumsum(step))}
        lines.append(line)
    start = np.cumsum([0, *(len(line["x"]) for line in lines)])
    runs = []
    for tip, line, begin in zip(tips, lines, start, strict=False):
        run = begin + np.arange(len(line["x"]))
        front = (solution.space.cracks[tip.crack].fronts or ())[tip.number]
        # K is known inside the body: a closed front that leaves it in part is open there.
        is_complete = front[0] == front[-1] and len(run) == len(front) - 1
        runs.append(np.append(run, run[:1]) if is_complete else run)
    columns = {name: np.concatenate([line[name] for line in lines]) for name in lines[0]}
    frame = columns.pop("frame")
    x = columns.pop("x")
    at_points = {"ahead": frame[:, 0], "normal": frame[:, 1], **columns}
    at_cells = {
        "crack": np.array([tip.crack for tip in tips]),
        "front": np.array([tip.number for tip in tips]),
    }
    measures_of_cracks = [measures(crack, solution.space.mesh) for crack in solution.space.cracks]
    for name in ("area", "depth"):
        values = np.array([getattr(measures_of_cracks[tip.crack], name) for tip in tips])
        if np.isfinite(values).all():  # readers of text files stumble over nan
            at_cells[name] = values
    data = _vtk("vtkCommonDataModel").vtkPolyData()
    data.SetPoints(_points(x))
    data.SetLines(_cells([run[None] for run in runs]))
    _save(_vtk("vtkIOXML").vtkXMLPolyDataWriter(), data, at_points, at_cells, path)


def _vtk(part: str) -> Any:
    return require_package(f"vtkmodules.{part}", "write")


def _six_components(stress: Floats) -> Floats:
    """Components xx yy zz xy yz xz, the order in which ParaView names them."""
    return np.ascontiguousarray(stress[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]])


def _array(values: np.ndarray, name: str | None = None) -> Any:
    array = _vtk("util.numpy_support").numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    if name is not None:
        array.SetName(name)
    return array


def _points(x: Floats) -> Any:
    points = _vtk("vtkCommonCore").vtkPoints()
    points.SetData(_array(np.pad(x, ((0, 0), (0, 3 - x.shape[1])))))
    return points


def _cells(blocks: Sequence[Ints]) -> Any:
    """Cells from blocks `(m, k)` of point numbers, each with its own k."""
    as_numbers = _vtk("util.numpy_support").numpy_to_vtkIdTypeArray
    sizes = np.concatenate([np.full(len(b), b.shape[1], dtype=np.int64) for b in blocks])
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    numbers = np.concatenate([b.ravel() for b in blocks]).astype(np.int64)
    cells = _vtk("vtkCommonDataModel").vtkCellArray()
    cells.SetData(as_numbers(offsets, deep=True), as_numbers(numbers, deep=True))
    return cells


def _save(
    writer: Any,
    data: Any,
    at_points: Mapping[str, np.ndarray],
    at_cells: Mapping[str, np.ndarray],
    path: Path,
) -> None:
    for name, values in at_points.items():
        data.GetPointData().AddArray(_array(values, name))
    for name, values in at_cells.items():
        data.GetCellData().AddArray(_array(values, name))
    # Text in base64, so that readers other than VTK's open the file too. Python writes it: VTK's
    # own writers may end the process where the disk is full.
    writer.SetDataModeToBinary()
    writer.SetWriteToOutputString(True)
    writer.SetInputData(data)
    if writer.Write() != 1:
        raise XcrackError(f"VTK made no text for {str(path)!r}: the memory may not suffice.")
    with written_whole(path, _UNSAVED, error=ProblemError) as part:
        part.write_text(writer.GetOutputString(), encoding="utf-8", newline="")
