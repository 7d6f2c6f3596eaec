"""Growth of places cycle by cycle, with retardation after overloads, until the fastest come far."""

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.law import largest_K
from xcrack.fatigue.spectrum import Spectrum, distinct
from xcrack.fatigue.zones import wheeler, willenborg
from xcrack.growth.options import Run
from xcrack.growth.trail import Kinds, March, Zones

POINTS = 65  # of a march, at which growth and cycles are known
_SHIFTS, _FEWEST = 257, 17  # values of the reduction of K at which the law is asked
_TABLE = 4_000_000  # rates of a march
_MOST = 3e8  # cycles of a step, times places
_LEAST = 1e-9  # of a step: a block that grows less does not grow
_TINY = 1e-3  # as of `trail`
_SMALLEST = 1e-300


def march(
    run: Run,
    kinds: Kinds,
    nodes: Floats,
    x: Floats,
    zones: Zones,
    length: float,
    *,
    exponent: float,
    blocks: float = np.inf,
) -> March:
    """Let places grow cycle by cycle, until the fastest have come a length.

    Parameters
    ----------
    run : Run
        With retardation, under a spectrum of factors.
    kinds : Kinds
    nodes : (k, n) array
        Where these were solved; rates are exponentials of polynomials through them.
    x : (g, n) array
        The same coordinate, evenly from the begin to `length`.
    zones : Zones
        At the begin.
    length : float, length
    exponent : float
        Of the law, for rates that all but vanish.
    blocks : float
        To stop after.

    Returns
    -------
    March
    """
    from xcrack.fatigue.kernels.overloads import marched

    model, spectrum = run.retardation, run.cycle
    assert isinstance(spectrum, Spectrum)
    assert model is not None
    _, _, order = distinct(spectrum.cycles)
    k, n, p = kinds.dK.shape
    shifts = np.zeros(1)
    if isinstance(model, willenborg):
        fits = _TABLE // max(k * n * p, 1)
        shifts = np.linspace(0, 1, int(np.clip(fits, _FEWEST, _SHIFTS)))
    rate = _rates(run, kinds, shifts)
    most = rate.max(axis=0)
    root = np.asarray((rate <= _TINY * most).any(axis=0))
    with np.errstate(divide="ignore"):
        values = np.where(root, rate ** (1 / exponent), np.log(np.maximum(rate, _SMALLEST)))
    least = model.dK_th if isinstance(model, willenborg) else 0.0
    share = np.divide(least, kinds.dK, out=np.ones_like(kinds.dK), where=kinds.dK > 0)
    since, size, over = np.array(zones.since), np.array(zones.size), np.array(zones.K)
    arc, cycles = np.zeros(x.shape), np.zeros(len(x))
    reached, position, part, _ = marched(
        length,
        min(blocks * len(order), _MOST / max(n, 1)),
        _LEAST * length,
        order,
        _weights(nodes, x),
        _line_weights(nodes, x),
        largest_K(kinds.dK, kinds.R),
        values,
        root,
        exponent,
        share,
        model.zone.factor,
        1 if isinstance(model, wheeler) else 2,
        model.w if isinstance(model, wheeler) else 1.0,
        model.shutoff if isinstance(model, willenborg) else 2.0,
        since,
        size,
        over,
        zones.position,
        zones.part,
        arc,
        cycles,
    )
    after = Zones(since, size, over, int(position), float(part))
    sigma = np.linspace(0.0, length, len(x))
    return March(sigma, arc, cycles / len(order), float(reached), after)


def _rates(run: Run, kinds: Kinds, shifts: Floats) -> Floats:
    """Rates `(k, n, p, s)` with a share of K_max taken from both ends of each cycle."""
    K_max = largest_K(kinds.dK, kinds.R)[..., None]
    largest = K_max * (1 - shifts)
    smallest = np.maximum(K_max - kinds.dK[..., None] - K_max * shifts, 0.0)
    dK = np.where(shifts == 0, kinds.dK[..., None], largest - smallest)
    R = np.divide(smallest, largest, out=np.zeros_like(largest), where=largest > 0)
    R = np.where(shifts == 0, kinds.R[..., None], np.minimum(R, 1.0))
    a = np.broadcast_to(kinds.a[..., None, None], dK.shape)
    flat = (np.ascontiguousarray(each).ravel() for each in (dK, R, a))
    dK_, R_, a_ = flat
    rate = evaluate_law(run.law, dK_, R_, 0, "place of a cycle", a_)
    return np.where(dK_ < run.threshold, 0.0, rate).reshape(dK.shape)


def _weights(nodes: Floats, x: Floats) -> Floats:
    """Weights of the nodes in the polynomial through them `(g, k, n)`."""
    k = len(nodes)
    result = np.ones((len(x), k, x.shape[1]))
    for j in range(k):
        for i in range(k):
            if i != j:
                result[:, j] *= (x - nodes[i]) / (nodes[j] - nodes[i])
    return result


def _line_weights(nodes: Floats, x: Floats) -> Floats:
    """The same of straight lines from node to node, the first and the last one prolonged."""
    k = len(nodes)
    result = np.zeros((len(x), k, x.shape[1]))
    if k == 1:
        return result + 1.0
    for j in range(k - 1):
        inside = np.ones(x.shape, dtype=bool)
        if j > 0:
            inside &= x >= nodes[j]
        if j < k - 2:
            inside &= x < nodes[j + 1]
        t = (x - nodes[j]) / (nodes[j + 1] - nodes[j])
        result[:, j] += np.where(inside, 1 - t, 0.0)
        result[:, j + 1] += np.where(inside, t, 0.0)
    return result


__all__ = ["POINTS", "march"]
