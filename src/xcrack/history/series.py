"""A growth run as a series of files for ParaView."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from xcrack.arrays import Ints
from xcrack.crack.crack import Crack
from xcrack.errors import ProblemError
from xcrack.growth.steps.step import Step
from xcrack.paths import write_texts

_UNWRITTEN = "the history cannot be written as a whole to"


def write_series(steps: Sequence[Step], folder: Path) -> Path:
    """Write ``history.pvd`` and the files it lists; its time is the number of the step.

    Steps with solutions: a grid with the crack faces for each load state, in 3D with the fronts and
    K along them. Steps without: the lines, or in 3D the faces and fronts, of the cracks.
    """
    from xcrack.post.vtk import write  # loads the writers of files

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


__all__ = ["polylines", "write_series"]
