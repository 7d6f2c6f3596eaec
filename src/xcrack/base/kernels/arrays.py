"""New arrays of kernels: what numpy's functions of these names make, in a few terms of LLVM.

numba compiles `np.empty` for each type and number of sides anew, as a function of its own, and
`np.zeros` as three of them: in a first run this took as long as some ten kernels do.

Edit with care: numba does not notice that the kernels of other files have to be compiled anew.
"""

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj


def _allocation(is_zero: bool) -> Any:
    """A function of shape and type of the entries that makes an array."""

    @intrinsic
    def allocate(typing, shape, dtype=np.float64):  # type: ignore[no-untyped-def]
        del typing
        is_tuple = isinstance(shape, types.BaseTuple)
        ndim = len(shape) if is_tuple else 1
        has_type = isinstance(dtype, types.Type)
        entry = dtype.dtype if has_type else types.float64
        dtype = dtype if has_type else types.Omitted(dtype)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array_type, shape_type = signature.return_type, signature.args[0]
            counts = cgutils.unpack_tuple(builder, arguments[0]) if is_tuple else [arguments[0]]
            kinds = shape_type.types if is_tuple else [shape_type]
            counts = [
                context.cast(builder, count, kind, types.intp)
                for count, kind in zip(counts, kinds, strict=True)
            ]
            array = context.make_array(array_type)(context, builder)
            data_type = context.get_data_type(array_type.dtype)
            item_size = context.get_constant(types.intp, context.get_abi_sizeof(data_type))
            strides: list[Any] = []
            size, is_wrong = item_size, ir.Constant(ir.IntType(1), 0)
            for count in reversed(counts):
                strides.insert(0, size)
                product = builder.smul_with_overflow(size, count)
                size, is_beyond = (builder.extract_value(product, i) for i in range(2))
                is_negative = builder.icmp_signed("<", count, ir.Constant(count.type, 0))
                is_wrong = builder.or_(is_wrong, builder.or_(is_beyond, is_negative))
            # No memory is as large as that: a MemoryError.
            size = builder.select(is_wrong, ir.Constant(size.type, 2**63 - 1), size)
            alignment = context.get_preferred_array_alignment(array_type.dtype)
            owner = context.nrt.meminfo_alloc_aligned(builder, size, alignment)
            data = context.nrt.meminfo_data(builder, owner)
            if is_zero:
                cgutils.memset(builder, data, size, 0)
            arrayobj.populate_array(
                array, builder.bitcast(data, data_type.as_pointer()), counts, strides, item_size,
                meminfo=owner,
            )  # fmt: skip
            return array._getvalue()

        return types.Array(entry, ndim, "C")(shape, dtype), generate

    return allocate


empty, zeros = (
    (np.empty, np.zeros)
    if numba.config.DISABLE_JIT
    else (_allocation(is_zero=False), _allocation(is_zero=True))
)

__all__ = ["empty", "zeros"]
