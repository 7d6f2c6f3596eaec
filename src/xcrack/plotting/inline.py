"""Pictures of pyvista as values of a cell of a notebook."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

from xcrack.errors import ProblemError
from xcrack.optional import required
from xcrack.paths import path_of, written_whole


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

    def save(self, file: str | Path) -> Path:
        """Write the picture to a PNG file."""
        path = path_of(file, "save: file", error=ProblemError)
        with written_whole(path, "the picture cannot be written to", error=ProblemError) as part:
            part.write_bytes(self.data)
        return path


def picture_of(plotter: Any) -> Picture:
    """What a plotter of pyvista shows."""
    pixels = plotter.screenshot(None, return_img=True)
    content = BytesIO()
    required("PIL.Image", "plot").fromarray(pixels).save(content, "PNG")
    return Picture(content.getvalue(), plotter)


__all__ = ["Picture", "picture_of"]
