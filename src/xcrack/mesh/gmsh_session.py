"""One gmsh session with every option set, that leaves nothing behind."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

from xcrack.errors import XcrackError
from xcrack.optional import required

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
        return required("gmsh", "a mesh generator", _WITHOUT)
    except XcrackError as error:
        library = re.search(r"[\w+-]+\.so[.\d]*", str(error.__cause__))
        if library is None:
            raise
        raise XcrackError(
            f"gmsh cannot load the system library {library.group(0)}. On a Debian-like system, as "
            f"root:\n    {SYSTEM_LIBRARIES}\n{_WITHOUT}"
        ) from error.__cause__


@contextmanager
def session(**options: float) -> Iterator[ModuleType]:
    """Open a gmsh model of its own, with known options, and remove it at the end.

    A session that the caller has open is used as it is: its models stay, its options come back.
    gmsh holds one state a process, so sessions must not run in two threads at once.

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
    asked = {**_OPTIONS, **{name.replace("__", "."): value for name, value in options.items()}}
    guest = bool(gmsh.isInitialized())
    if not guest:
        # interruptible=True would take over SIGINT for the rest of the process.
        gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
    before = {name: gmsh.option.getNumber(name) for name in asked} if guest else {}
    host_model = gmsh.model.getCurrent() if guest else ""
    try:
        for name, value in asked.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("xcrack")
        try:
            yield gmsh
        finally:
            gmsh.model.mesh.removeSizeCallback()
            gmsh.model.remove()
    finally:
        if guest:
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
            gmsh.model.setCurrent(host_model)
        else:
            gmsh.finalize()
