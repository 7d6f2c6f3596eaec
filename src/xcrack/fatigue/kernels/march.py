"""Growth of several places cycle by cycle, with what overloads leave behind at each."""

import numpy as np

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
    most,
    least,
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
    since,
    size,
    over,
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
    most : float
        Cycles to stop at.
    least : float, length
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
    since, size, over : (n,) arrays
        Growth since the overload, its zone and K; changed.
    position : int
        Number in the block of the cycle to begin with.
    part : float
        Of that cycle that is over.
    arc : (g, n) array, length
        Growth of the places at the g points; written.
    cycles : (g,) array
        Cycles until there; written.

    Returns
    -------
    reached : float, length
        `length`, or less where `most` was reached or nothing grows; the rows of `arc` and
        `cycles` behind it hold the last values.
    position, part
        Where the block is then.
    elapsed : float
        Cycles.
    """
    n, n_cycles, n_points, n_shifts = len(since), len(order), len(arc), values.shape[3]
    spacing = length / (n_points - 1)
    growth, sum_of = np.zeros(n), np.zeros(n)
    reached, elapsed, block, counted, filled = 0.0, 0.0, 0.0, 0, 1
    arc[0, :] = 0.0
    cycles[0] = 0.0
    while reached < length and elapsed < most:
        kind = order[position]
        u = reached / spacing
        row = min(int(u), n_points - 2)
        x = u - row
        largest = 0.0
        for i in range(n):
            K = 0.0
            for k in range(K_max.shape[0]):
                at = weight[row, k, i] + x * (weight[row + 1, k, i] - weight[row, k, i])
                K += at * K_max[k, i, kind]
            K = max(K, 0.0)
            zone_size = zone[i] * K * K
            if model > 0 and since[i] + zone_size >= size[i]:
                since[i], size[i], over[i] = 0.0, zone_size, K
            low, between = 0, 0.0
            if model == 2 and K > 0 and since[i] < size[i]:
                threshold = 0.0
                for k in range(K_max.shape[0]):
                    at = weight[row, k, i] + x * (weight[row + 1, k, i] - weight[row, k, i])
                    threshold += at * share[k, i, kind]
                phi = max(0.0, 1.0 - threshold) / (shutoff[i] - 1.0)
                reduction = phi * (over[i] * np.sqrt(1.0 - since[i] / size[i]) - K)
                place = min(max(reduction / K, 0.0), 1.0) * (n_shifts - 1)
                low = min(int(place), n_shifts - 2)
                between = place - low
            rate = _interpolated_rate(weight, line, x, row, values, is_root, exponent, i, kind, low)
            if between > 0:
                other = _interpolated_rate(
                    weight, line, x, row, values, is_root, exponent, i, kind, low + 1
                )
                rate += between * (other - rate)
            if model == 1 and since[i] + zone_size < size[i]:
                rate *= (zone_size / (size[i] - since[i])) ** w[i]
            growth[i] = rate
            largest = max(largest, rate)
        remaining = min(1.0 - part, most - elapsed)
        done = remaining
        if reached + remaining * largest >= length:
            done = min(remaining, (length - reached) / largest)
            after = length
        else:
            after = reached + remaining * largest
        while filled < n_points and (filled * spacing <= after or after >= length):
            if filled == n_points - 1 and after < length:
                break
            t = (
                1.0
                if after == reached
                else min((filled * spacing - reached) / (after - reached), 1.0)
            )
            for i in range(n):
                arc[filled, i] = sum_of[i] + t * done * growth[i]
            cycles[filled] = elapsed + t * done
            filled += 1
        for i in range(n):
            sum_of[i] += done * growth[i]
            since[i] += done * growth[i]
        elapsed += done
        block += after - reached
        reached = after
        part += done
        if part >= 1.0 - 1e-12:
            part = 0.0
            position += 1
            counted += 1
            if position == n_cycles:
                position = 0
            if counted == n_cycles:
                if block <= least:
                    break
                block, counted = 0.0, 0
    for g in range(filled, n_points):
        for i in range(n):
            arc[g, i] = sum_of[i]
        cycles[g] = elapsed
    return reached, position, part, elapsed


__all__ = ["march_places"]
