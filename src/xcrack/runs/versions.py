"""All that the last bit of a result depends on beside the settings of a run."""

import ctypes
import os
import platform
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

_PACKAGES = ("xcrack", "numpy", "scipy", "numba")
# Extension modules that are linked with a BLAS, and what its functions may be called there.
_LINKED = ("numpy._core._multiarray_umath", "numpy.linalg._umath_linalg", "scipy.linalg._fblas")
_PREFIXES, _SUFFIXES = ("scipy_", ""), ("64_", "", "_64")


def versions() -> dict[str, str]:
    """Versions of python and of packages, and what the BLAS runs on.

    Sums that a BLAS shares out over other numbers of threads, or does with the instructions of
    another processor, are rounded in another order.
    """
    result = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            result[name] = version(name)
        except PackageNotFoundError:
            result[name] = "unknown"
    return {**result, "processor": _processor(), "BLAS threads": _threads()}


def _threads() -> str:
    """Number of threads of each BLAS that is loaded; what the environment asks for if none says."""
    counts = [_ask_library(module, "get_num_threads", ctypes.c_int) for module in _LINKED]
    numbers = dict.fromkeys(str(count) for count in counts if count is not None)
    if numbers:
        return ", ".join(numbers)
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        if os.environ.get(name):
            return os.environ[name]
    return str(os.cpu_count())


def _processor() -> str:
    """Kind of processor as the BLAS sees it, else as the system does."""
    names = (_ask_library(module, "get_corename", ctypes.c_char_p) for module in _LINKED)
    core_names = [name.decode(errors="replace") for name in names if isinstance(name, bytes)]
    return " ".join([platform.machine(), *dict.fromkeys(core_names)])


def _ask_library(module: str, function: str, kind: type) -> object:
    """What a function of OpenBLAS returns; None where the module knows none of that name."""
    try:
        library = ctypes.CDLL(import_module(module).__file__)
    except (ImportError, OSError, TypeError):
        return None
    for prefix in _PREFIXES:
        for suffix in _SUFFIXES:
            call = getattr(library, f"{prefix}openblas_{function}{suffix}", None)
            if call is not None:
                call.restype, call.argtypes = kind, []
                return call()
    return None


__all__ = ["versions"]
