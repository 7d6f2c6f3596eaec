"""Growth cycle by cycle along a path: overload zones of Wheeler and of Willenborg."""

import numpy as np

from xcrack.base.kernels.jit import kernel


@kernel
def advanced(  # type: ignore[no-untyped-def]
    a,
    last,
    order,
    K_max,
    rate,
    shifts,
    zone,
    model,
    w,
    shutoff,
    share,
    state,
    most,
):
    """Blocks of cycles until a crack has a length.

    Parameters
    ----------
    a, last : float, length
        Begin and end of a piece of the path.
    order : (n,) array of int
        Kinds of the cycles of a block, in time.
    K_max : (2, p) array
        Largest K of each kind, at the begin and the end of the piece; linear between.
    rate : (2, p, s) array, length/cycle
        At both ends, for each shift of K; s = 1 for Wheeler. Linear over the shift, a power of the
        length between the ends.
    shifts : (s,) array
        Reduction of K as a share of the largest K of the kind, rising from 0 to 1.
    zone : float, length / K²
        Plastic zone over K².
    model : int
        0: none, 1: Wheeler, 2: Willenborg.
    w, shutoff : float
        Exponent of Wheeler; ratio of overload to K at which Willenborg's crack stops.
    share : (2, p) array
        ΔK_th / ΔK of each kind at both ends.
    state : (4,) array
        Length at the overload, its zone, its K, and the number of the next cycle in a block;
        changed.
    most : float
        Blocks after which to stop.

    Returns
    -------
    cycles : float
        Cycles of the piece, the last one in part.
    a : float, length
        Where the crack has come to: below `last` if `most` was reached or nothing grows.
    """
    begin, length = a, last - a
    log_begin = np.log(begin)
    whole = np.log(last) - log_begin
    n, n_shifts = len(order), len(shifts)
    cycles = 0.0
    position = int(state[3])
    before = a
    while a < last and cycles < most * n:
        kind = order[position]
        t = (a - begin) / length
        x = (np.log(a) - log_begin) / whole
        K = K_max[0, kind] + t * (K_max[1, kind] - K_max[0, kind])
        own = zone * K * K
        if model > 0 and a + own >= state[0] + state[1]:
            state[0], state[1], state[2] = a, own, K
        low, between = 0, 0.0
        if model == 2 and K > 0:
            over = a - state[0]
            reduction = 0.0
            if over < state[1]:
                least = share[0, kind] + t * (share[1, kind] - share[0, kind])
                phi = max(0.0, 1.0 - least) / (shutoff - 1.0)
                reduction = phi * (state[2] * np.sqrt(1.0 - over / state[1]) - K)
            place = min(max(reduction / K, 0.0), 1.0) * (n_shifts - 1)
            low = min(int(place), n_shifts - 2)
            between = place - low
        growth = 0.0
        for side in range(2):
            s = min(low + side, n_shifts - 1)
            r0, r1 = rate[0, kind, s], rate[1, kind, s]
            if r0 > 0 and r1 > 0 and r0 < np.inf and r1 < np.inf:
                r = r0 * np.exp(x * np.log(r1 / r0))
            else:
                r = r0 + t * (r1 - r0) if r1 < np.inf else r1
            weight = between if side == 1 else 1.0 - between
            if weight > 0:
                growth += weight * r
        if model == 1 and a + own < state[0] + state[1]:
            growth *= (own / (state[0] + state[1] - a)) ** w
        if growth == np.inf:
            break
        if a + growth >= last:
            cycles += (last - a) / growth
            a = last
            break
        a += growth
        cycles += 1.0
        position += 1
        if position == n:
            position = 0
            if a == before:
                break
            before = a
    state[3] = position
    return cycles, a


__all__ = ["advanced"]
