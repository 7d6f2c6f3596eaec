"""Routines of scipy's BLAS and LAPACK for kernels; all arguments are addresses."""

import ctypes
from typing import Any

import llvmlite.binding
import numba
from numba import types
from numba.extending import get_cython_function_address, intrinsic


def _blas_function(module: str, name: str, count: int) -> Any:
    symbol = f"xcrack_{name}"
    address = get_cython_function_address(f"scipy.linalg.cython_{module}", name)
    if numba.config.DISABLE_JIT:  # kernels run as Python then, to be debugged and measured
        return ctypes.CFUNCTYPE(None, *([ctypes.c_size_t] * count))(address)
    llvmlite.binding.add_symbol(symbol, address)
    return types.ExternalFunction(symbol, types.void(*([types.uintp] * count)))


dpotrf = _blas_function("lapack", "dpotrf", 5)
dgesv = _blas_function("lapack", "dgesv", 8)
dsyev = _blas_function("lapack", "dsyev", 9)
dtrsm = _blas_function("blas", "dtrsm", 11)
dsyrk = _blas_function("blas", "dsyrk", 10)
dgemm = _blas_function("blas", "dgemm", 13)
dtrsv = _blas_function("blas", "dtrsv", 8)
dgemv = _blas_function("blas", "dgemv", 11)


@intrinsic
def doubles_at(context, address):  # type: ignore[no-untyped-def]
    """Pointer to float64 numbers at an address; `numba.carray` makes an array of it."""
    del context, address

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        kind = context.get_value_type(signature.return_type)
        return builder.inttoptr(arguments[0], kind)

    return types.CPointer(types.float64)(types.uint64), generate


def _doubles_in_python(address: int) -> Any:
    return ctypes.cast(int(address), ctypes.POINTER(ctypes.c_double))


if numba.config.DISABLE_JIT:
    doubles_at = _doubles_in_python
