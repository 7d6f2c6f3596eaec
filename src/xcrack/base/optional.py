"""Packages that are imported only where they are used: gmsh, meshio, pyvista, matplotlib ..."""

import sys
from importlib import import_module
from types import ModuleType

from xcrack.base.errors import XcrackError

_PIP_NAME = {"vtkmodules": "vtk", "PIL": "pillow"}  # where that is not the name of the module


def require_package(name: str, purpose: str, remedy: str = "") -> ModuleType:
    """Import a package that only some functions need; an error says how to install it.

    Parameters
    ----------
    name : str
        Of the module, such as ``"matplotlib.pyplot"``.
    purpose : str
        What it is for, such as ``"plot(renderer='pyvista')"``; the message begins with it.
    remedy : str
        What can be done without it: a sentence for the end of the message.

    Returns
    -------
    module

    Raises
    ------
    XcrackError
        The package is not installed, or cannot be imported.

    Examples
    --------
    >>> require_package("math", "an example").__name__
    'math'
    """
    package = _pip_name(name)
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        lacking = _pip_name(error.name or name)
        needs = "" if lacking == package else f" of the package {package}"
        problem = (
            f"{purpose} needs the package {lacking}{needs}, which is not installed in this Python: "
            f"python -m pip install {lacking}."
        )
        cause: Exception = error
    except (ImportError, OSError) as error:
        problem = (
            f"{purpose} needs the package {package}, which is installed but cannot be imported "
            f"({error}): python -m pip install --force-reinstall {package}, or install the system "
            "library that the message names."
        )
        cause = error
    raise XcrackError(f"{problem} {remedy}".rstrip()) from cause


def _pip_name(module: str) -> str:
    top = module.partition(".")[0]
    return _PIP_NAME.get(top, top)


def in_notebook() -> bool:
    """Whether this is a cell of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


__all__ = ["in_notebook", "require_package"]
