"""A growth run as a series of files for ParaView."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from xcrack.crack import Crack
from xcrack.step import Step


def write_series(steps: Sequence[Step], folder: Path) -> Path:
    """Write ``history.pvd`` and the files it lists; its time is the number of the step.

    Steps with solutions: a grid with the lips for each load state. Steps without: the lines of
    the cracks.
    """
    from xcrack.export import write  # loads the writers of files

    entries = []
    parts = folder / "steps"
    parts.mkdir(exist_ok=True)
    for step in steps:
        names = []
        for state, solution in enumerate(step.solutions):
            stem = parts / f"step_{step.index:05d}_state_{state}"
            names += [file.name for file in write(solution, stem)]
        if not names:
            name = f"step_{step.index:05d}_cracks.vtp"
            (parts / name).write_text(polylines(step.cracks))
            names.append(name)
        entries += [
            f'    <DataSet timestep="{step.index}" part="{part}" file="steps/{name}"/>'
            for part, name in enumerate(names)
        ]
    target = folder / "history.pvd"
    target.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        + "\n".join(entries)
        + "\n  </Collection>\n</VTKFile>\n"
    )
    return target


def polylines(cracks: Sequence[Crack]) -> str:
    """Text of a ``.vtp`` file with the faces of all cracks."""
    dim = cracks[0].points.shape[1] if cracks else 2
    kind = "Lines" if dim == 2 else "Polys"
    start = np.cumsum([0, *(len(crack.points) for crack in cracks)])
    points = [np.pad(crack.points, ((0, 0), (0, 3 - dim))) for crack in cracks]
    faces = [crack.faces + begin for crack, begin in zip(cracks, start)]
    owner = [np.full(len(crack.faces), i) for i, crack in enumerate(cracks)]
    n_faces = sum(len(each) for each in faces)
    connectivity = " ".join(str(i) for each in faces for i in each.ravel())
    coordinates = "\n".join(" ".join(repr(float(v)) for v in x) for each in points for x in each)
    offsets = " ".join(str(dim * (i + 1)) for i in range(n_faces))
    crack_of = " ".join(str(i) for each in owner for i in each)
    return f"""<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
  <PolyData>
    <Piece NumberOfPoints="{start[-1]}" NumberOf{kind}="{n_faces}">
      <CellData>
        <DataArray type="Int32" Name="crack" format="ascii">{crack_of}</DataArray>
      </CellData>
      <Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
{coordinates}
      </DataArray></Points>
      <{kind}>
        <DataArray type="Int64" Name="connectivity" format="ascii">{connectivity}</DataArray>
        <DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray>
      </{kind}>
    </Piece>
  </PolyData>
</VTKFile>
"""


__all__ = ["polylines", "write_series"]
