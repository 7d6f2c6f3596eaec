"""The load at which a tip opens, from the mechanics of contact."""

from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.growth.step import Step

_CLOSED = 1e-3  # of the largest K: below it a tip is closed


@dataclass(frozen=True, eq=False)
class OpeningLoad:
    """Geometric closure of the places of all cracks: that by contact, without any plastic wake.

    Attributes
    ----------
    level : tuple of (f,) arrays
        Factor of the spectrum at which each place opens; the smallest factor where it is always
        open, nan where it never opens.
    U : tuple of (f,) arrays
        Share of the largest range during which it is open, to hold beside those of closures such as
        `newman_closure`: these are for the wake, and this one is for contact.
    between : tuple of (f,) arrays
        Distance of the two levels between which each place opens, 0 where it is always open: the
        bound of the error of `level`.
    """

    level: tuple[Floats, ...]
    U: tuple[Floats, ...]
    between: tuple[Floats, ...]


def opening_load(step: Step) -> OpeningLoad:
    """Level of a spectrum at which each tip opens, from the contact solutions of a step.

    Parameters
    ----------
    step : Step
        Of a run under a `Spectrum` of factors.

    Returns
    -------
    OpeningLoad

    Raises
    ------
    ProblemError
        The step has no levels.

    Notes
    -----
    The level is where K_I of the two lowest open levels, drawn on in a straight line, is zero, but
    not below the highest closed one. With a factor on all loads, no steady ones, it is 0.
    """
    if not isinstance(step, Step):
        raise ProblemError(f"opening_load: step = {value_text(step)}: give a Step.")
    if not step.levels:
        raise ProblemError(
            "opening_load: the step has no levels: give one of a run under Spectrum(factors)."
        )
    levels = np.array(step.levels)
    parts = [
        _of_crack(levels, np.stack([s[c].K[:, 0] for s in step.sif]))
        for c in range(len(step.cracks))
    ]
    level, U, level_gap = zip(*parts, strict=True)
    return OpeningLoad(level, U, level_gap)


def _of_crack(levels: Floats, K: Floats) -> tuple[Floats, Floats, Floats]:
    """Level, share and distance of levels at each place, from K_I `(n, f)`."""
    n, f = K.shape
    level, level_gap = np.full(f, np.nan), np.zeros(f)
    for place in range(f):
        is_closed = K[:, place] <= _CLOSED * np.abs(K[:, place]).max(initial=0.0)
        if is_closed.all():
            continue
        last_closed = int(np.nonzero(is_closed)[0].max()) if is_closed.any() else -1
        if last_closed < 0:
            level[place] = levels[0]
        elif last_closed == n - 1:
            continue  # closes under the largest load
        else:
            level[place] = levels[last_closed]
            level_gap[place] = levels[last_closed + 1] - levels[last_closed]
            if last_closed + 2 < n:
                K_lower, K_upper = K[last_closed + 1, place], K[last_closed + 2, place]
                slope = (K_upper - K_lower) / (levels[last_closed + 2] - levels[last_closed + 1])
                if slope > 0:
                    level[place] = max(level[place], levels[last_closed + 1] - K_lower / slope)
            elif levels[last_closed] < 0 < levels[-1]:
                level[place] = 0.0  # two levels: K is in proportion to the factor
    share = (levels[-1] - level) / (levels[-1] - levels[0])
    return level, np.nan_to_num(share), level_gap


__all__ = ["OpeningLoad", "opening_load"]
