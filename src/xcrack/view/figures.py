"""Figures of matplotlib: made, saved and shown in one way."""

from dataclasses import dataclass
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from xcrack.base.arguments import FileName, Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.optional import in_notebook, require_package
from xcrack.base.paths import system_errors, written_whole

_UNSAVED = "the picture cannot be written to"

Title = Annotated[str | None, Text("a text, or leave it out", may_be_empty=True)]


def new_figure(size: tuple[float, float], window: bool, caller: str) -> Any:
    """A figure; only one for a window is registered with pyplot, none in a notebook.

    Parameters
    ----------
    size : (float, float)
        Inches.
    window : bool
        Whether `finish_figure` will show it.
    caller : str
        What needs matplotlib, for messages.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    XcrackError
        Without matplotlib.
    """
    if window and not in_notebook():
        pyplot = require_package("matplotlib.pyplot", caller)
        return pyplot.figure(figsize=size, layout="constrained")
    figure = require_package("matplotlib.figure", caller).Figure(figsize=size, layout="constrained")
    if in_notebook():  # figures of pyplot would be shown at the end of the cell, too
        figure._repr_png_ = lambda: _png(figure)
    return figure


def finish_figure(figure: Any, file: Path | None, window: bool, dpi: int = 150) -> Any:
    """Save a figure, show it, or both.

    Parameters
    ----------
    figure : matplotlib figure
    file : Path or None
        As of `picture_path`.
    window : bool
    dpi : int

    Returns
    -------
    Path, or the figure where there is no file

    Raises
    ------
    ProblemError
        A format that matplotlib does not know or cannot draw here, or a file that cannot be
        written.
    """
    if file is not None:
        file_types = sorted(figure.canvas.get_supported_filetypes())
        if file.suffix[1:].lower() not in file_types:
            raise ProblemError(
                f"file = {value_text(str(file))}: give one that ends in {', '.join(file_types)}."
            )
        picture = BytesIO()  # writers of pictures may keep to themselves that the disk is full
        try:
            figure.savefig(picture, dpi=dpi, format=file.suffix[1:].lower())
        except Exception as error:  # such as TeX for .pgf, or a font that is missing
            raise ProblemError(
                f"{_UNSAVED} {value_text(str(file))}: matplotlib says {value_text(str(error))}; "
                f"another ending, such as .png, may do."
            ) from error
        with written_whole(file, _UNSAVED, error=ProblemError) as part:
            part.write_bytes(picture.getvalue())
    if window and not in_notebook():
        require_package("matplotlib.pyplot", "a window").show()
    return figure if file is None else file


def picture_path(file: str | PathLike[str] | None, caller: str) -> Path | None:
    """Where a picture goes, if anywhere; its folder is made if it is not there.

    Parameters
    ----------
    file : path or None
        A path without ending gets ``.png``.
    caller : str
        Name of the function, for messages.

    Returns
    -------
    Path or None

    Raises
    ------
    ProblemError
        A folder in place of a file, or one that cannot be made.
    """
    if file is None:
        return None
    path = Path(file)
    if not path.suffix:
        if path.name in ("", ".."):
            raise ProblemError(
                f"{caller}: file = {value_text(str(path))} is a folder: give a file in it."
            )
        path = path.with_name(path.name + ".png")
    with system_errors(_UNSAVED, path, error=ProblemError):
        path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _png(figure: Any) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()


# Pictures of pyvista as values of a cell of a notebook.


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture that a notebook shows; `save` writes it to a file.

    Attributes
    ----------
    data : bytes
        PNG.
    plotter : object
        What drew it, for those who want to go on with it.
    """

    data: bytes
    plotter: Any = None

    def _repr_png_(self) -> bytes:
        return self.data

    @check_arguments()
    def save(self, file: FileName) -> Path:
        """Write the picture to a PNG file."""
        path = Path(file)
        with written_whole(path, "the picture cannot be written to", error=ProblemError) as part:
            part.write_bytes(self.data)
        return path


def picture_of(plotter: Any) -> Picture:
    """What a plotter of pyvista shows."""
    pixels = plotter.screenshot(None, return_img=True)
    content = BytesIO()
    require_package("PIL.Image", "plot").fromarray(pixels).save(content, "PNG")
    return Picture(content.getvalue(), plotter)


__all__ = [
    "Picture",
    "Title",
    "finish_figure",
    "new_figure",
    "picture_of",
    "picture_path",
]
