"""Cycles of a run by another law, on the path of the first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats, Ints
from xcrack.errors import ProblemError
from xcrack.growth.step import Step
from xcrack.history.driving import cycles_of, driving
from xcrack.inputs import shown
from xcrack.laws.law import Law

_MOST = 0.05


@dataclass(frozen=True, eq=False)
class Rerated:
    """Cycles of the steps of a run by another law.

    Attributes
    ----------
    cycles : (n,) array
        At each step that the law reaches.
    bound : float
        Share by which other tips would have moved another way against the driving one, the mean
        over the cycles; 0 for a single tip. The life is uncertain by no more where K of a tip
        depends on the others no more than on itself.
    ended : str
        Empty, or why the new law ends before the last step.
    """

    cycles: Floats
    bound: float
    ended: str = ""

    @property
    def life(self) -> float:
        """Cycles at the last step."""
        return float(self.cycles[-1])


def rerated(steps: Sequence[Step], law: Law, old: Law | None = None) -> Rerated:
    """Cycles of the same steps by another law.

    Parameters
    ----------
    steps : sequence of Step
    law : callable
    old : callable, optional
        Law of the run, to be sure that ranges and ratios of the steps are what it was given.

    Raises
    ------
    ProblemError
        Several tips would have shared the advance another way, by more than 5 %; a spectrum; the
        new law lets nothing grow.
    """
    if any(step.levels for step in steps):
        raise ProblemError(
            "rerate: the steps of a spectrum have the largest cycle only: run the spectrum again "
            "with the other law."
        )
    for name, value in (("law", law), ("old", old)):
        if not (callable(value) or (name == "old" and value is None)):
            raise ProblemError(f"rerate: {name} = {shown(value)} cannot be called: give a law.")
    rows = driving(steps)
    if old is not None and not np.allclose(rows.rates(old), rows.rate, rtol=1e-6, atol=0):
        raise ProblemError("rerate: the steps have other rates than the law they are said to have.")
    rate = rows.rates(law)
    first = rows.drives
    if not (rate[first][:, 0] > 0).all():
        stopped = int(np.argmin(rate[first][:, 0] > 0))
        raise ProblemError(
            f"rerate: by this law the driving tip does not grow at step {stopped}: the path ends "
            "there. Run it with the law to see where."
        )
    with np.errstate(invalid="ignore"):
        share = cycles_of(rows.a[first], rate[first]) / cycles_of(rows.a[first], rows.rate[first])
    since = rows.cycles[rows.step[first]] * share
    broken = np.isinf(rate[first]).any(axis=1)
    ended = ""
    if broken.any():
        last = int(np.argmax(broken))
        since = since[: last + 1]
        ended = f"the law returns inf in step {last}: its toughness is reached"
    bound = _bound(rows.step, rows.drives, rows.da, rows.rate[:, 0], rate[:, 0], since)
    if bound > _MOST:
        raise ProblemError(
            f"rerate: by this law the tips would have shared the advance another way, by "
            f"{bound:.1%} in the mean (more than {_MOST:.0%}): the path would differ. Run it with "
            "the law."
        )
    return Rerated(np.concatenate([[0.0], np.cumsum(since)]) + steps[0].cycles, bound, ended)


def _bound(step: Ints, drives: Ints, da: Floats, old: Floats, new: Floats, since: Floats) -> float:
    """Mean over the cycles of the largest change of an advance over that of the driving place."""
    worst = np.zeros(len(since))
    for n in range(len(since)):
        mine = step == n
        lead = mine & drives
        if not lead.any():
            continue
        with np.errstate(invalid="ignore"):
            change = np.abs((new[mine] / old[mine]) / (new[lead] / old[lead]) - 1)
        worst[n] = np.nan_to_num(change * da[mine] / da[lead], nan=0.0, posinf=1.0).max()
    total = since.sum()
    return float(worst @ since / total) if total else 0.0


__all__ = ["Rerated", "rerated"]
