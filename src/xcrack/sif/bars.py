"""Estimated errors of K, with a reason where there is none."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, lock


@dataclass(frozen=True, eq=False)
class Bars:
    """Estimated errors of K of one crack in one state.

    Attributes
    ----------
    eta : (f, 2 or 3) array, stress · √length
        Signed estimate of exact K less K; nan where there is none.
    bar : (f, 2 or 3) array, stress · √length
        Half-width of the error of K + eta; nan where there is none.
    reasons : tuple of str
        One a place: why there is no estimate, empty where there is one.
    contact : (f, 2 or 3) array, optional, stress · √length
        Part of `bar` that contact of the faces has: its end, overlaps it is blind to, closed tips.
    """

    eta: Floats
    bar: Floats
    reasons: tuple[str, ...]
    contact: Floats | None = None


def no_bars(shape: tuple[int, ...], reason: str) -> Bars:
    """No estimate at any place, for one reason."""
    nothing = lock(np.full(shape, np.nan))
    return Bars(nothing, nothing, (reason,) * shape[0])


def bars_of(
    eta: Floats, bar: Floats, reasons: Sequence[str], contact: Floats | None = None
) -> Bars:
    """Estimates with nan where there is a reason against them."""
    against = np.array([bool(reason) for reason in reasons], dtype=bool)[:, None]
    part = None if contact is None else lock(np.where(against, np.nan, contact))
    return Bars(
        lock(np.where(against, np.nan, eta)),
        lock(np.where(against, np.nan, bar)),
        tuple(reasons),
        part,
    )
