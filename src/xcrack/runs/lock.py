"""A lock on a folder that names its owner, and that outlives a kill without blocking anybody."""

import contextlib
import ctypes
import json
import os
import platform
import secrets
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from xcrack.base.errors import ProblemError
from xcrack.base.paths import system_errors

NAME = "run.lock"

_NAMELESS = ("", "localhost", "localhost.localdomain")  # any machine may be called so
_TRIES = 20  # others may take or leave the lock meanwhile


@contextmanager
def lock_folder(folder: Path) -> Iterator[Callable[[], None]]:
    """Keep other processes from writing to a folder within a block.

    The lock is a file that appears with its whole content. It is left behind by a kill; the next
    process finds that its owner is dead, by id, start and machine, and takes it over. Of an owner
    on another machine nobody can tell: there the user has to decide.

    Yields
    ------
    callable
        Raises a ProblemError if the lock is not ours any more.

    Raises
    ------
    ProblemError
        Another process, or this one elsewhere, writes to the folder.
    """
    path = folder / NAME
    owner = {**_this_process(), "token": secrets.token_hex(8), "taken": _time_now()}
    _take(path, owner)

    def check() -> None:
        if _read(path) != owner:
            state = "is that of another process" if path.exists() else "is gone"
            raise ProblemError(
                f"{path} {state}: the folder was taken over or removed meanwhile, and this process "
                "stops writing to it."
            )

    try:
        yield check
    finally:
        with contextlib.suppress(OSError):
            if _read(path) == owner:
                path.unlink()


def _take(path: Path, owner: dict[str, Any]) -> None:
    for _ in range(_TRIES):
        if _create_lock(path, owner):
            return
        holder = _read(path)
        if holder is None and not path.exists():
            continue  # it was given back meanwhile
        if holder is None:
            raise ProblemError(
                f"{path} is no lock that xcrack can read: delete it if no run writes to "
                f"{path.parent}."
            )
        if _may_live(holder):
            raise ProblemError(_in_use(path, holder))
        _remove(path, holder)
    raise ProblemError(f"{path}: other processes take and leave the lock all the time; try again.")


def _create_lock(path: Path, owner: dict[str, Any]) -> bool:
    """Create the lock with its content in one go; False where there is one."""
    part = path.with_name(f".{path.name}.{owner['pid']}_{owner['token']}.part")
    with system_errors("the run cannot be locked by", path, error=ProblemError):
        try:
            part.write_text(json.dumps(owner) + "\n")
            try:
                os.link(part, path)
            except FileExistsError:
                return False
            except OSError:  # a file system without links
                try:
                    with open(path, "x") as file:
                        file.write(json.dumps(owner) + "\n")
                except FileExistsError:
                    return False
        finally:
            with contextlib.suppress(OSError):
                part.unlink()
    return True


def _remove(path: Path, stale_owner: dict[str, Any]) -> None:
    """Remove the lock of a dead owner, and no other one that appeared meanwhile."""
    new_path = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part")
    try:
        os.rename(path, new_path)  # of several who try, one succeeds
    except FileNotFoundError:
        return
    if _read(new_path) != stale_owner:  # a new owner was faster: give the lock back
        with contextlib.suppress(OSError):
            os.link(new_path, path)
    with contextlib.suppress(OSError):
        new_path.unlink()


def _read(path: Path) -> dict[str, Any] | None:
    """Owner of a lock; None where there is none, or none that can be read."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and "pid" in content else None


def _in_use(path: Path, owner: dict[str, Any]) -> str:
    process = _this_process()
    if not _is_here(owner, process):
        return (
            f"{path.parent} is in use by process {owner['pid']} on {owner.get('host')} since "
            f"{owner.get('taken')}. If that process has ended, delete {path}; resume then goes on "
            "with the run."
        )
    user = "this process" if owner["pid"] == process["pid"] else f"process {owner['pid']}"
    return (
        f"{path.parent} is in use by {user} since {owner.get('taken')}: wait for its end, or give "
        "each run a folder of its own."
    )


def _may_live(owner: dict[str, Any]) -> bool:
    """Whether the owner of a lock may still write; of another machine it may."""
    process = _this_process()
    if _is_here(owner, process):
        start = _start_of_process(owner["pid"])
        return start is not None and start == owner.get("started")
    is_restarted = owner.get("host") == process["host"] and owner.get("boot") != process["boot"]
    return not is_restarted or process["host"] in _NAMELESS


def _is_here(owner: dict[str, Any], process: dict[str, Any]) -> bool:
    """Whether process ids mean the same to both."""
    compared_keys = ("host", "boot", "namespace")
    return all(owner.get(key) == process[key] for key in compared_keys)


def _this_process() -> dict[str, Any]:
    """Id and start of this process, and where ids mean the same: machine, its start, container."""
    boot = namespace = ""
    with contextlib.suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    with contextlib.suppress(OSError):
        namespace = os.readlink("/proc/self/ns/pid")
    return {
        "pid": os.getpid(),
        "started": _start_of_process(os.getpid()),
        "host": platform.node(),
        "boot": boot,
        "namespace": namespace,
    }


def _start_of_process(pid: Any) -> str | None:
    """When a process of this machine started, in whatever unit; None where there is none."""
    if not isinstance(pid, int) or pid <= 0:
        return None
    if sys.platform == "linux":
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return None
        return None if fields[0] in "ZX" else fields[19]  # a zombie writes nothing
    if sys.platform == "win32":
        handle = ctypes.windll.kernel32.OpenProcess(0x1000, False, pid)  # only to ask
        if not handle:
            return None
        times = (ctypes.c_uint64 * 4)()
        pointers = [ctypes.byref(times, 8 * k) for k in range(4)]
        ctypes.windll.kernel32.GetProcessTimes(handle, *pointers)
        ctypes.windll.kernel32.CloseHandle(handle)
        return None if times[1] else str(times[0])
    answer = subprocess.run(
        ["ps", "-o", "lstart=", "-p", str(pid)], capture_output=True, text=True, check=False
    )
    return answer.stdout.strip() or None


def _time_now() -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S")


__all__ = ["NAME", "lock_folder"]
