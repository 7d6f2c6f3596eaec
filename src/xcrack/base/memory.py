"""How much memory this system has to give."""

from pathlib import Path

_STATE = Path("/proc/meminfo")
_KEY = "MemAvailable:"


def free_memory() -> float | None:
    """Bytes that a process may still take before the system swaps; None where it does not say so.

    Linux says it. Others have no number that counts what caches would give back.
    """
    try:
        lines = _STATE.read_text(encoding="ascii", errors="replace").splitlines()
        row = next(line.split() for line in lines if line.startswith(_KEY))
        return 1024.0 * int(row[1])
    except (OSError, StopIteration, ValueError, IndexError):
        return None


__all__ = ["free_memory"]
