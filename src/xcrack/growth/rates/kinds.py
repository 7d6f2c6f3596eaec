"""The kinds of cycles of a block at the places of the cracks that were solved."""

import numpy as np

from xcrack.growth.rates.block import pairs_of, rated
from xcrack.growth.rates.evaluation import Evaluation
from xcrack.growth.rates.rating import size_at_places
from xcrack.growth.steps.options import Run
from xcrack.growth.steps.overloads import Kinds
from xcrack.growth.tracking.follow import following


def kinds_of(run: Run, seen: Evaluation) -> list[Kinds]:
    """Range and ratio of each kind of cycle, one `Kinds` of a single solve a crack."""
    problem = seen.problem
    place, nu = following(problem.mesh).PLACE, problem.material.nu
    result = []
    for c, pairs in enumerate(pairs_of(run, problem, seen.solutions, seen.sif)):
        a = size_at_places(problem, c, pairs.K.shape[2])
        every = rated(run, pairs, nu, c, place, a)
        dK, R = (np.ascontiguousarray(each.T)[None] for each in (every.dK, every.R))
        result.append(Kinds(dK, R, a[None]))
    return result


__all__ = ["kinds_of"]
