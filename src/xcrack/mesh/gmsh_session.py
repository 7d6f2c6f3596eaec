"""One gmsh session with every option set, that leaves nothing behind."""

import re
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import hypot
from types import ModuleType
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import CheckedBy
from xcrack.base.arrays import Floats
from xcrack.base.checks import point_coordinates, value_text
from xcrack.base.errors import XcrackError
from xcrack.base.optional import require_package
from xcrack.base.units import LENGTH

SYSTEM_LIBRARIES = (
    "apt-get install -y --no-install-recommends libglu1-mesa libgl1 libegl1 libgl1-mesa-dri "
    "libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1 libxinerama1 libgomp1"
)

_WITHOUT = "Meshes from a file (read_mesh) and box need no gmsh."

# Options outlive models and even gmsh.clear(), so each one that shapes a mesh is set here.
# Two threads give the same number of nodes at different places from run to run.
_OPTIONS: Mapping[str, float] = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Geometry.Tolerance": 1e-8,
    "Mesh.MaxNumThreads1D": 0,
    "Mesh.MaxNumThreads2D": 0,
    "Mesh.MaxNumThreads3D": 0,
    "Mesh.Algorithm": 6,  # frontal Delaunay: the most regular triangles
    "Mesh.Algorithm3D": 1,
    "Mesh.AlgorithmSwitchOnFailure": 1,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromParametricPoints": 0,
    "Mesh.Optimize": 1,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomFactor3D": 1e-12,
    "Mesh.RandomSeed": 1,
    "Mesh.RecombineAll": 0,
    "Mesh.RecombinationAlgorithm": 1,
    "Mesh.Renumber": 1,
    "Mesh.Smoothing": 1,
    "Mesh.SubdivisionAlgorithm": 0,
    "Mesh.SaveAll": 0,
    "Mesh.SaveParametric": 0,
    "Mesh.Binary": 0,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.ScalingFactor": 1,
}


def import_gmsh() -> ModuleType:
    """Import gmsh, or say which library of the system it lacks and how to get it.

    Returns
    -------
    module
        The gmsh module.

    Raises
    ------
    XcrackError
        gmsh is not installed, or cannot load a library of the system.
    """
    try:
        return require_package("gmsh", "a mesh generator", _WITHOUT)
    except XcrackError as error:
        library = re.search(r"[\w+-]+\.so[.\d]*", str(error.__cause__))
        if library is None:
            raise
        raise XcrackError(
            f"gmsh cannot load the system library {library.group(0)}. On a Debian-like system, as "
            f"root:\n    {SYSTEM_LIBRARIES}\n{_WITHOUT}"
        ) from error.__cause__


_ONE_AT_A_TIME = threading.RLock()  # two threads in gmsh end the process


@contextmanager
def session(**options: float) -> Iterator[ModuleType]:
    """Open a gmsh model of its own, with known options, and remove it at the end.

    A session that the caller has open is used as it is: its models stay, its options come back.
    gmsh holds one state a process: sessions of several threads run one after the other.

    Parameters
    ----------
    **options : float
        gmsh options that differ from those of xcrack, with ``__`` for the dot
        (``Mesh__Algorithm=5``).

    Yields
    ------
    module
        gmsh, initialised, with an empty current model.

    Raises
    ------
    XcrackError
        gmsh cannot be imported.
    """
    gmsh = import_gmsh()
    settings = {**_OPTIONS, **{name.replace("__", "."): value for name, value in options.items()}}
    with _ONE_AT_A_TIME:
        yield from _open_session(gmsh, settings)


def _open_session(gmsh: ModuleType, settings: Mapping[str, float]) -> Iterator[ModuleType]:
    guest = bool(gmsh.isInitialized())
    if not guest:
        # interruptible=True would take over SIGINT for the rest of the process.
        gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
    earlier_values = {name: gmsh.option.getNumber(name) for name in settings} if guest else {}
    host_model = gmsh.model.getCurrent() if guest else ""
    try:
        for name, value in settings.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("xcrack")
        try:
            yield gmsh
        finally:
            gmsh.model.mesh.removeSizeCallback()
            gmsh.model.remove()
    finally:
        if guest:
            for name, value in earlier_values.items():
                gmsh.option.setNumber(name, value)
            gmsh.model.setCurrent(host_model)
        else:
            gmsh.finalize()


# Cell sizes that follow holes and the paths of cracks.

FINEST = 1e-6  # share of a body's length below which no cell size is taken


def graded_size(
    holes: Sequence[tuple[float, float, float]],
    paths: Sequence[Floats],
    far_size: float,
    near_size: float,
    band: float,
    transition: float,
) -> Callable[[float, float], float]:
    """Cell size by the place: `near_size` up to `band`, `far_size` from a transition on.

    Parameters
    ----------
    holes : sequence of (x, y, radius), length
        Round holes.
    paths : sequence of (k, 2) arrays, length
        Polylines.
    far_size, near_size : float, length
        Sizes far from all holes and paths, and near them.
    band, transition : float, length
        Where `near_size` holds, and over what distance the size then grows to `far_size`.

    Returns
    -------
    callable
        Maps x, y to a size; plain floats, since gmsh asks point by point.
    """
    segments = []
    for path in paths:
        if len(path) == 1:
            path = np.repeat(path, 2, axis=0)
        for (ax, ay), (bx, by) in zip(path[:-1].tolist(), path[1:].tolist(), strict=True):
            square = (bx - ax) ** 2 + (by - ay) ** 2
            segments.append((ax, ay, bx - ax, by - ay, square or 1.0))
    if not holes and not segments:
        return lambda x, y: far_size
    ramp = max(transition, 1e-9 * far_size)

    def length(x: float, y: float) -> float:
        distance = min((hypot(x - cx, y - cy) - r for cx, cy, r in holes), default=1e300)
        for ax, ay, tx, ty, square in segments:
            s = min(1.0, max(0.0, ((x - ax) * tx + (y - ay) * ty) / square))
            distance = min(distance, hypot(x - ax - s * tx, y - ay - s * ty))
        return near_size + (far_size - near_size) * min(1.0, max(0.0, (distance - band) / ramp))

    return length


def polylines(value: Any, label: str, error: type[XcrackError]) -> list[Floats]:
    """One polyline or several in one form, checked.

    Examples
    --------
    >>> [path.tolist() for path in polylines([(0, 0), (1, 0)], "plate: along", XcrackError)]
    [[[0.0, 0.0], [1.0, 0.0]]]
    """
    try:
        has_many = bool(np.ndim(value[0][0]))
        return [
            point_coordinates(path, label, (None, 2), error=error)
            for path in (value if has_many else [value])
        ]
    except Exception as cause:  # whatever an object's own methods raise
        raise error(
            f"{label} = {value_text(value)} must be points of a polyline, [(x0, y0), (x1, y1), "
            "...], or a list of such polylines, with finite coordinates."
        ) from cause


Path = Sequence[Sequence[float]]
Along = Annotated[Path | Sequence[Path] | None, CheckedBy(polylines, unit=LENGTH)]


__all__ = []
