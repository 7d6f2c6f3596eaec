"""Paths that users give, files written whole, and what the system refuses as an error of ours."""

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from xcrack.base.checks import value_text
from xcrack.base.errors import XcrackError

_NO_ROOM = "make room, or give a folder on another disk"
_NO_RIGHT = "give a path where you may read and write"
_MEND = {
    errno.EISDIR: "it is a folder, so give the path of a file",
    errno.ENOTDIR: "a part of the path is a file, so give another folder",
    errno.EEXIST: "a file stands where a folder is needed, so give another path",
    errno.ENOENT: "check the path",
    errno.ENAMETOOLONG: "give a shorter name",
    errno.ENOSPC: _NO_ROOM,
    errno.EDQUOT: _NO_ROOM,
    errno.EFBIG: _NO_ROOM,
    errno.EACCES: _NO_RIGHT,
    errno.EPERM: _NO_RIGHT,
    errno.EROFS: _NO_RIGHT,
}


def path_of(
    value: Any, label: str, *, error: type[XcrackError] = XcrackError, is_file: bool = False
) -> Path:
    """Check that a value can be the path of a file, and return it.

    Parameters
    ----------
    value : anything
    label : str
        Its name in the message, such as ``"write_mesh: path"``.
    error : type of XcrackError
    is_file : bool
        Refuse what can be a folder only.

    Returns
    -------
    Path

    Raises
    ------
    error
        Neither a string nor a path, empty, with a NUL character, or a folder.

    Examples
    --------
    >>> path_of("plate.msh", "read_mesh: path").suffix
    '.msh'
    """
    try:
        text = os.fspath(value)
    except Exception:  # whatever an object's own __fspath__ raises
        text = None
    if not isinstance(text, str):
        raise error(
            f"{label} = {value_text(value)} is not a path: give a string or a pathlib.Path."
        )
    if not text or "\0" in text:
        reason = "holds a NUL character" if text else "is empty"
        raise error(f"{label} = {value_text(value)} {reason}: give the path of a file.")
    path = Path(text)
    if is_file and path.name in ("", ".."):
        raise error(f"{label} = {value_text(str(path))} is a folder: give a file in it.")
    return path


@contextmanager
def system_errors(
    label: str, path: Path, *, error: type[XcrackError] = XcrackError
) -> Iterator[None]:
    """Turn what the system refuses (no space, no permission, a folder) into an error of ours.

    Parameters
    ----------
    label : str
        What failed, such as ``"the mesh cannot be written to"``; the path follows.
    path : Path
    error : type of XcrackError

    Raises
    ------
    error
        For an OSError; it names the path, what the system said, and what to do.
    """
    try:
        kind = _endless_kind(path) if "read" in label else ""
        if kind:
            raise error(f"{label} {_shown_path(path)}: it is a {kind}: give the path of a file.")
        yield
    except OSError as cause:
        reason = cause.strerror or str(cause) or type(cause).__name__
        mend = _MEND.get(cause.errno or 0, "check the path")
        raise error(f"{label} {_shown_path(path)}: {reason}: {mend}.") from cause


def _endless_kind(path: Path) -> str:
    """What a path is that may give bytes without end, or none for ever; empty for others."""
    if path.is_char_device():
        return "device"
    if path.is_fifo():
        return "pipe"
    return "socket" if path.is_socket() else ""


def _shown_path(path: Path) -> str:
    text = repr(str(path))
    return text if len(text) <= 300 else f"{text[:100]} … {text[-150:]}"


@contextmanager
def written_whole(
    path: Path, label: str, *, error: type[XcrackError] = XcrackError
) -> Iterator[Path]:
    """Write a file wholly or not at all: an older one stays as it was where that fails.

    Yields the path to write to: beside the file, with the same ending. It becomes the file at the
    end.

    Parameters
    ----------
    path : Path
    label : str
        As of `system_errors`.
    error : type of XcrackError

    Raises
    ------
    error
        For an OSError; nothing is left of the attempt.
    """
    with system_errors(label, path, error=error):
        target = path.resolve()
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if target.exists() and not target.is_file():  # a device, which must stay what it is
            yield target
            return
        part = target.with_name(f".{target.stem[:200]}.{os.getpid()}.part{target.suffix}")
        try:
            yield part
            os.replace(part, target)
        finally:
            with suppress(OSError):
                part.unlink()


def write_texts(
    texts: Mapping[Path, str], label: str, *, error: type[XcrackError] = XcrackError
) -> None:
    """Write files of text in UTF-8; none takes the place of an older one before all are whole.

    Parameters
    ----------
    texts : mapping of Path to str
        Their folders are made if they are not there.
    label : str
        As of `system_errors`.
    error : type of XcrackError

    Raises
    ------
    error
        For an OSError; older files stay as they were.
    """
    with ExitStack() as parts:
        for path, text in texts.items():
            with system_errors(label, path, error=error):
                path.parent.mkdir(parents=True, exist_ok=True)
            part = parts.enter_context(written_whole(path, label, error=error))
            part.write_text(text, encoding="utf-8", newline="")


__all__ = ["path_of", "system_errors", "write_texts", "written_whole"]
