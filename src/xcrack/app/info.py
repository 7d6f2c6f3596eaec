"""What this installation is made of and what is missing; meshes from one file to another."""

import os
import platform
import time
import warnings
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

import xcrack
from xcrack.analysis.solve import solve
from xcrack.base.arguments import FileName, Switch, check_arguments
from xcrack.base.errors import MeshError, XcrackError, XcrackWarning
from xcrack.base.machine import number_of_threads, versions
from xcrack.base.optional import require_package
from xcrack.crack.crack import Crack
from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import penny_crack
from xcrack.mesh.box import box
from xcrack.mesh.files import read_mesh, write_mesh
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import displacement
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.view.pyvista import can_render

_NEEDED = ("numpy", "scipy", "numba", "meshio", "gmsh", "pyvista", "matplotlib", "pyamg",
           "threadpoolctl")  # fmt: skip
_EXTRA = {"pypardiso": "pardiso", "tqdm": "notebook", "pandas": "notebook"}


@dataclass(frozen=True)
class Info:
    """State of an installation; printed, it is a list.

    Attributes
    ----------
    packages : mapping of name to version
        Empty where a package is not installed.
    missing : tuple of str
        What cannot be used, and why.
    renderer : str
        What draws fields and bodies.
    solvers : tuple of str
    threads : int
        Processors that a solve may use.
    cache : str
        Folder of the compiled kernels.
    warm_seconds : float, optional
        Time that the kernels took to compile or load.
    """

    packages: dict[str, str]
    missing: tuple[str, ...]
    renderer: str
    solvers: tuple[str, ...]
    threads: int
    cache: str
    warm_seconds: float | None = None

    def __str__(self) -> str:
        rows = [
            ("python", f"{platform.python_version()} on {platform.platform()}"),
            *((name, text or "not installed") for name, text in self.packages.items()),
            ("processor", versions()["processor"]),
            ("threads", str(self.threads)),
            ("solvers", ", ".join(self.solvers)),
            ("renderer", self.renderer),
            ("kernels in", self.cache),
        ]
        if self.warm_seconds is not None:
            rows.append(("kernels ready in", f"{self.warm_seconds:.1f} s"))
        rows += [("missing", text) for text in self.missing]
        return "\n".join(f"{name:<18}{text}" for name, text in rows)


@check_arguments()
def info(*, warm: Switch = False) -> Info:
    """Versions, solvers, renderers, missing libraries, and the folder of the compiled kernels.

    Parameters
    ----------
    warm : bool
        Compile the kernels now, so that the first solve does not have to.

    Returns
    -------
    Info
        Printed, it is a list.
    """
    missing_packages = []
    for name in _NEEDED:
        try:
            require_package(name, "xcrack")
        except XcrackError as error:
            missing_packages.append(str(error))
    renderer = "pyvista in missing"
    if not any("pyvista" in text for text in missing_packages):
        renderer = (
            "pyvista" if can_render() else "matplotlib only: pyvista finds no OpenGL (libegl1)"
        )
    packages = {"xcrack": xcrack.__version__}
    packages |= {name: _version(name) for name in (*_NEEDED, *_EXTRA)}
    solvers = ["multifrontal", "conjugate gradients with multigrid"]
    solvers += ["pardiso"] if packages["pypardiso"] else []
    seconds = _warm_kernels() if warm else None
    return Info(
        packages,
        tuple(missing_packages),
        renderer,
        tuple(solvers),
        number_of_threads(),
        _cache(),
        seconds,
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _cache() -> str:
    """Where numba keeps machine code."""
    folder_of_user = os.environ.get("NUMBA_CACHE_DIR")
    if folder_of_user:
        return folder_of_user
    cache_folder = Path(xcrack.__file__).parent / "kernels"
    if os.access(cache_folder, os.W_OK):
        return str(cache_folder / "__pycache__")
    return "the user's cache folder of numba"


def _warm_kernels() -> float:
    """Solve small scenes that use all kernels."""
    begin = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", XcrackWarning)
        for mesh, crack, plane in (
            (box((-1, -1), (1, 1), 8), line_crack([(-0.4, 0.03), (0.4, 0.03)]), "strain"),
            (box((-1, -1, -1), (1, 1, 1), 5), penny_crack((0, 0, 0.04), (0, 0, 1), 0.6), None),
        ):
            for order in (1, 2):
                for sign in (1.0, -1.0):
                    stress_intensity(solve(_scene(mesh, crack, plane, order, sign)))
    return time.perf_counter() - begin


def _scene(mesh: Mesh, crack: Crack, plane: str | None, order: int, sign: float) -> Problem:
    supports = [
        displacement(side, lambda x: sign * 1e-3 * x * _last_entry(x)) for side in ("top", "bottom")
    ]
    return Problem(mesh, Isotropic(1.0, 0.3, plane), [crack], supports=supports, order=order)


def _last_entry(x: np.ndarray) -> np.ndarray:
    return np.eye(x.shape[1])[-1]


# --- meshes from one file to another ---


@check_arguments(MeshError)
def convert_mesh(source: FileName, target: FileName) -> Mesh:
    """Read a mesh from a file and write it to another one, of another kind if need be.

    Parameters
    ----------
    source, target : path
        Files that `read_mesh` reads and `write_mesh` writes; their endings say the kind.

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        A file that cannot be read or written, or a mesh that is not sound.
    """
    mesh = read_mesh(source)
    write_mesh(target, mesh)
    return mesh


__all__ = ["Info", "convert_mesh", "info"]
