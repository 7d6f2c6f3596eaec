"""Growth of several places cycle by cycle, with what overloads leave behind at each."""

import numpy as np

from xcrack.base.kernels.arrays import zeros
from xcrack.base.kernels.jit import kernel


@kernel
def _interpolated_rate(weight, line, x, row, values, is_root, exponent, place, kind, shift):  # type: ignore[no-untyped-def]
    """A rate between the solves: its logarithm is smooth, or a power of it is a line."""
    n = values.shape[0]
    result = 0.0
    if is_root[place, kind, shift]:
        for k in range(n):
            w = line[row, k, place] + x * (line[row + 1, k, place] - line[row, k, place])
            result += w * values[k, place, kind, shift]
        return max(result, 0.0) ** exponent
    for k in range(n):
        w = weight[row, k, place] + x * (weight[row + 1, k, place] - weight[row, k, place])
        result += w * values[k, place, kind, shift]
    return np.exp(min(max(result, -690.0), 690.0))


@kernel
def march_places(  # type: ignore[no-untyped-def]
    length,
    most_cycles,
    least_block,
    order,
    weight,
    line,
    K_max,
    values,
    is_root,
    exponent,
    share,
    zone,
    model,
    w,
    shutoff,
    growth_since,
    size,
    zone_K,
    position,
    part,
    arc,
    cycles,
):
    """Let all places grow until the largest growths of all cycles add up to a length.

    Parameters
    ----------
    length : float, length
        Sum of the largest growth of any place in each cycle, to go to.
    most_cycles : float
        Cycles to stop at.
    least_block : float, length
        A block whose growths add up to no more ends it: nothing grows.
    order : (c,) array of int
        Kinds of the cycles of a block, in time.
    weight, line : (g, k, n) arrays
        Weights of the k solves at g points, evenly from 0 to `length`: of a polynomial, and of
        straight lines.
    K_max : (k, n, p) array
        Largest K of each kind at each solve.
    values : (k, n, p, s) array
        Logarithm of the rate, or its root, for s reductions of K_max from 0 to all of it.
    is_root : (n, p, s) array of bool
    exponent : float
        Of that root.
    share : (k, n, p) array
        ΔK_th / ΔK.
    zone : (n,) array, length / K²
    model : int
        0: none, 1: Wheeler, 2: Willenborg.
    w, shutoff : (n,) arrays
    since, size, zone_K : (n,) arrays
        Growth since the overload, its zone and K; changed.
    position : int
        Number in the block of the cycle to begin with.
    part : float
        Of that cycle that has passed.
    arc : (g, n) array, length
        Growth of the places at the g points; written.
    cycles : (g,) array
        Cycles until there; written.

    Returns
    -------
    length_reached : float, length
        `length`, or less where `most_cycles` was reached or nothing grows; the rows of `arc` and
        `cycles` behind it hold the last values.
    position, part
        Where the block is then.
    cycles_elapsed : float
        Cycles.
    """
    n, n_cycles, n_points, n_shifts = len(growth_since), len(order), len(arc), values.shape[3]
    spacing = length / (n_points - 1)
    growth, sum_of = zeros(n), zeros(n)
    length_reached, cycles_elapsed, block, cycles_in_block, rows_filled = 0.0, 0.0, 0.0, 0, 1
    arc[0, :] = 0.0
    cycles[0] = 0.0
    while length_reached < length and cycles_elapsed < most_cycles:
        kind = order[position]
        u = length_reached / spacing
        row = min(int(u), n_points - 2)
        x = u - row
        largest_rate = 0.0
        for i in range(n):
            K = 0.0
            for k in range(K_max.shape[0]):
                at = weight[row, k, i] + x * (weight[row + 1, k, i] - weight[row, k, i])
                K += at * K_max[k, i, kind]
            K = max(K, 0.0)
            zone_size = zone[i] * K * K
            if model > 0 and growth_since[i] + zone_size >= size[i]:
                growth_since[i], size[i], zone_K[i] = 0.0, zone_size, K
            s, fraction = 0, 0.0
            if model == 2 and K > 0 and growth_since[i] < size[i]:
                threshold = 0.0
                for k in range(K_max.shape[0]):
                    at = weight[row, k, i] + x * (weight[row + 1, k, i] - weight[row, k, i])
                    threshold += at * share[k, i, kind]
                phi = max(0.0, 1.0 - threshold) / (shutoff[i] - 1.0)
                reduction = phi * (zone_K[i] * np.sqrt(1.0 - growth_since[i] / size[i]) - K)
                place = min(max(reduction / K, 0.0), 1.0) * (n_shifts - 1)
                s = min(int(place), n_shifts - 2)
                fraction = place - s
            rate = _interpolated_rate(weight, line, x, row, values, is_root, exponent, i, kind, s)
            if fraction > 0:
                next_rate = _interpolated_rate(
                    weight, line, x, row, values, is_root, exponent, i, kind, s + 1
                )
                rate += fraction * (next_rate - rate)
            if model == 1 and growth_since[i] + zone_size < size[i]:
                rate *= (zone_size / (size[i] - growth_since[i])) ** w[i]
            growth[i] = rate
            largest_rate = max(largest_rate, rate)
        cycles_left = min(1.0 - part, most_cycles - cycles_elapsed)
        cycles_done = cycles_left
        if length_reached + cycles_left * largest_rate >= length:
            cycles_done = min(cycles_left, (length - length_reached) / largest_rate)
            length_after = length
        else:
            length_after = length_reached + cycles_left * largest_rate
        while rows_filled < n_points and (
            rows_filled * spacing <= length_after or length_after >= length
        ):
            if rows_filled == n_points - 1 and length_after < length:
                break
            t = (
                1.0
                if length_after == length_reached
                else min(
                    (rows_filled * spacing - length_reached) / (length_after - length_reached), 1.0
                )
            )
            for i in range(n):
                arc[rows_filled, i] = sum_of[i] + t * cycles_done * growth[i]
            cycles[rows_filled] = cycles_elapsed + t * cycles_done
            rows_filled += 1
        for i in range(n):
            sum_of[i] += cycles_done * growth[i]
            growth_since[i] += cycles_done * growth[i]
        cycles_elapsed += cycles_done
        block += length_after - length_reached
        length_reached = length_after
        part += cycles_done
        if part >= 1.0 - 1e-12:
            part = 0.0
            position += 1
            cycles_in_block += 1
            if position == n_cycles:
                position = 0
            if cycles_in_block == n_cycles:
                if block <= least_block:
                    break
                block, cycles_in_block = 0.0, 0
    for g in range(rows_filled, n_points):
        for i in range(n):
            arc[g, i] = sum_of[i]
        cycles[g] = cycles_elapsed
    return length_reached, position, part, cycles_elapsed


__all__ = ["march_places"]
