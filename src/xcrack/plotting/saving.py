"""Figures of matplotlib to files."""

from pathlib import Path
from typing import Any

from xcrack.errors import ProblemError
from xcrack.inputs import path_of, system_errors


def save_figure(figure: Any, file: str | Path, what: str, dpi: int = 150) -> Path:
    """Save a figure; its folder is made if it is not there.

    Parameters
    ----------
    figure : matplotlib figure
    file : path
        Its ending says the format; PNG where it has none.
    what : str
        Name of the argument, for messages.
    dpi : int

    Returns
    -------
    Path

    Raises
    ------
    ProblemError
        No path, a format that matplotlib does not know, or a file that cannot be written.
    """
    path = path_of(file, what, error=ProblemError)
    if not path.suffix:
        path = path.with_name(path.name + ".png")
    known = sorted(figure.canvas.get_supported_filetypes())
    if path.suffix[1:].lower() not in known:
        raise ProblemError(f"{what} = {str(path)!r}: give a file that ends in {', '.join(known)}.")
    with system_errors("the picture cannot be written to", path, error=ProblemError):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=dpi)
    return path


__all__ = ["save_figure"]
