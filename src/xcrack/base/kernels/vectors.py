"""Sums of four numbers side by side, in the terms of LLVM: numba does not make vectors of them.

Edit with care: numba does not notice that the kernels of other files have to be compiled anew.
"""

from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WIDTH = 4
_SIZE = ir.IntType(64)


def _rows_of(count: int) -> Any:
    """A function that writes y + scale A x for some rows that are stored side by side."""

    @intrinsic
    def rows(typing, columns, values, x, y, scale, out, start, stop, place, row):  # type: ignore[no-untyped-def]
        del typing

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            column, value, x, y, out = (
                context.make_array(signature.args[k])(context, builder, arguments[k]).data
                for k in (0, 1, 2, 3, 5)
            )
            scale, (start, stop, place, row) = arguments[4], arguments[6:]
            scalar_type = value.type.pointee
            vector = ir.VectorType(scalar_type, WIDTH)
            nothing, alignment = (
                ir.Constant(vector, ir.Undefined),
                context.get_abi_sizeof(scalar_type),
            )
            first_lane = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)

            def spread(number: Any) -> Any:
                lane = builder.insert_element(nothing, number, ir.IntType(32)(0))
                return builder.shuffle_vector(lane, nothing, first_lane)

            def load_four(pointer: Any, number: Any) -> Any:
                first = builder.gep(pointer, [builder.mul(number, _SIZE(WIDTH))])
                return builder.bitcast(first, vector.as_pointer())

            def load_vector(pointer: Any, number: Any) -> Any:
                return builder.load(load_four(pointer, number), align=alignment)

            sums = [cgutils.alloca_once(builder, vector) for _ in range(count)]
            for sum_pointer in sums:
                builder.store(ir.Constant(vector, [0.0] * WIDTH), sum_pointer)
            at = cgutils.alloca_once_value(builder, place)
            with cgutils.for_range_slice(builder, start, stop, _SIZE(1)) as (k, _):
                number = builder.zext(builder.load(builder.gep(column, [k])), _SIZE)
                xk, p = load_vector(x, number), builder.load(at)
                for i, sum_pointer in enumerate(sums):
                    row_pointer = builder.load(builder.gep(value, [builder.add(p, _SIZE(i))]))
                    term = builder.fmul(spread(row_pointer), xk)
                    builder.store(builder.fadd(builder.load(sum_pointer), term), sum_pointer)
                builder.store(builder.add(p, _SIZE(count)), at)
            for i, sum_pointer in enumerate(sums):
                number = builder.add(row, _SIZE(i))
                term = builder.fmul(spread(scale), builder.load(sum_pointer))
                total = builder.fadd(load_vector(y, number), term)
                builder.store(total, load_four(out, number), align=alignment)
            return context.get_dummy_value()

        argument_types = columns, values, x, y, scale, out
        return types.void(*argument_types, *[types.uint64] * 4), generate

    return rows


def _in_python(count: int) -> Any:
    def rows(columns, values, x, y, scale, out, start, stop, place, row):  # type: ignore[no-untyped-def]
        stretch = values[place : place + count * (stop - start)].reshape(stop - start, count)
        for i in range(count):
            total = (stretch[:, i, None] * x[columns[start:stop]]).cumsum(axis=0)[-1:].sum(axis=0)
            out[row + i] = y[row + i] + scale * total

    return rows


_rows = _in_python if numba.config.DISABLE_JIT else _rows_of
three_rows, one_row = _rows(3), _rows(1)
