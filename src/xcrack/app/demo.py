"""A closed crack at a hole, from data of the package: no mesh generator needed."""

import sys
import warnings
from importlib.resources import as_file, files
from pathlib import Path
from time import perf_counter
from typing import Annotated

from xcrack.analysis.solve import solve
from xcrack.base.arguments import FileName, Progress, check_arguments
from xcrack.base.errors import XcrackWarning
from xcrack.base.optional import in_notebook
from xcrack.crack.lines import line_crack
from xcrack.mesh.files import read_mesh
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import pressure
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.view.report import report

_RADIUS, _TIP, _PRESSURE = 5.0, 12.0, 80.0  # mm, mm, MPa


@check_arguments()
def demo(
    folder: FileName = "xcrack_demo", *, progress: Annotated[bool | str, Progress()] = True
) -> Path:
    """Solve a plate with a hole whose crack is pressed together, and report on it.

    Parameters
    ----------
    folder : path
        Where the report goes.
    progress : bool or "always"
        Whether a line tells what is being done, where somebody watches: on a terminal or in a
        notebook; "always" everywhere.

    Returns
    -------
    Path
        Of the report.

    Raises
    ------
    ProblemError
        The folder cannot be written.
    """
    path = Path(folder)
    problem = Problem(
        demo_mesh(),
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(_RADIUS, 0.0), (_TIP, 0.0)])],
        loads=[pressure("top", _PRESSURE), pressure("bottom", _PRESSURE)],
    )
    begin = perf_counter()
    is_watched = progress == "always" or (
        progress is True and (in_notebook() or sys.stderr.isatty())
    )

    def tell(words: str) -> None:
        if is_watched:
            print(f"{perf_counter() - begin:5.1f} s  {words}", file=sys.stderr, flush=True)

    tell("solving; the first time on a machine compiles the kernels, a minute or two ...")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", XcrackWarning)  # the report lists them
        solution = solve(problem)
    tell("K, pictures and the report ...")
    title = "A closed crack at a hole  [N, mm, MPa]"
    return report(solution, path / "report.html", title=title)


def demo_mesh() -> Mesh:
    """The plate of the demonstration."""
    with as_file(files("xcrack") / "data" / "plate_with_hole.msh") as file:
        return read_mesh(file)


__all__ = ["demo", "demo_mesh"]
