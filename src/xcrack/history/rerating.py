"""Cycles of a run by another law, on the path of the first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.arrays import Floats
from xcrack.errors import ProblemError
from xcrack.growth.steps.step import Step
from xcrack.history.block_rates import Block
from xcrack.history.driving import Driving, cycles_of, driving
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


def rerated(
    steps: Sequence[Step], law: Law, old: Law | None = None, block: Block | None = None
) -> Rerated:
    """Cycles of the same steps by another law.

    Parameters
    ----------
    steps : sequence of Step
    law : callable
    old : callable, optional
        Law of the run, to be sure that ranges and ratios of the steps are what it was given.
    block : Block, optional
        Of a run under a spectrum.

    Raises
    ------
    ProblemError
        Several tips would have shared the advance another way, by more than 5 %; a spectrum that is
        not given, or another one; a law with nominal R under it; the new law lets nothing grow.
    """
    for name, value in (("law", law), ("old", old)):
        if not (callable(value) or (name == "old" and value is None)):
            raise ProblemError(f"rerate: {name} = {shown(value)} cannot be called: give a law.")
    check_block(steps, block, law, "rerate")
    rows = driving(steps, block)
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
    bound = bound_of_shares(rows, rate[:, 0], since)
    if bound > _MOST:
        raise ProblemError(
            f"rerate: by this law the tips would have shared the advance another way, by "
            f"{bound:.1%} in the mean (more than {_MOST:.0%}): the path would differ. Run it with "
            "the law."
        )
    return Rerated(np.concatenate([[0.0], np.cumsum(since)]) + steps[0].cycles, bound, ended)


def check_block(steps: Sequence[Step], block: Block | None, law: Law | None, what: str) -> None:
    """Refuse steps of a spectrum without it, with another one, or with a law that it cannot serve.

    Raises
    ------
    ProblemError
    """
    if block is None:
        if any(step.levels for step in steps):
            raise ProblemError(
                f"{what}: the run has a spectrum, of whose cycles the steps have the largest only: "
                "give spectrum=..., criterion=... and nu=... as the run had them."
            )
        return
    for step in steps:
        block.check(step, what)
    if getattr(law, "ratio", None) == "nominal":
        raise ProblemError(
            f'{what}: the law has ratio="nominal", but the steps of a spectrum have K with contact '
            "alone: run the spectrum with the law."
        )


def bound_of_shares(rows: Driving, new: Floats, since: Floats) -> float:
    """Mean over the cycles of the largest change of an advance over that of the driving place.

    Parameters
    ----------
    rows : Driving
    new : (k,) array
        Other rates before the steps.
    since : (n,) array
        Cycles by them of the steps that are reached.
    """
    old, first = rows.rate[:, 0], np.unique(rows.step)
    worst = np.zeros(len(since))
    for n, number in enumerate(first[: len(since)].tolist()):
        mine = rows.step == number
        lead = mine & rows.drives
        with np.errstate(invalid="ignore"):
            change = np.abs((new[mine] / old[mine]) / (new[lead] / old[lead]) - 1)
        worst[n] = np.nan_to_num(change * rows.da[mine] / rows.da[lead], nan=0.0, posinf=1.0).max()
    total = since.sum()
    return float(worst @ since / total) if total else 0.0


__all__ = ["Rerated", "bound_of_shares", "check_block", "rerated"]
