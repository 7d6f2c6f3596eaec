"""Loads at which a crack goes on without cycles: K = K_c at each step of a run."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.analysis.solution import Solution
from xcrack.base.checks import number
from xcrack.base.errors import ProblemError
from xcrack.crack.measures import measures
from xcrack.growth.step import Step
from xcrack.runs.rerating import check_in_proportion, driving_forces

COLUMNS = ("step", "a", "factor", "force", "displacement")


def fracture_loads(steps: Sequence[Step], K_c: float) -> NDArray[Any]:
    """As `History.load_at`.

    Raises
    ------
    ProblemError
    """
    toughness = number(K_c, "load_at: K_c", above=0)
    solved = [step for step in steps if not step.has_left]
    if not solved or not all(step.solutions for step in solved):
        raise ProblemError(
            "load_at: the steps have no solutions, as those of a run read from its folder: call it "
            "on what collect returned."
        )
    check_in_proportion(solved, driving_forces(steps), "load_at")
    rows = []
    for step in solved:
        pairs = zip(step.dK_eq, step.R, strict=True)
        K = [float((dK / (1.0 - R)).max()) for dK, R in pairs if len(dK)]
        factor = toughness / max(K)
        solution = max(step.solutions, key=lambda each: each.energy)
        force = _largest_resultant(solution)
        size = _size(step)
        rows.append((step.index, size, factor, factor * force,
                     factor * 2.0 * solution.energy / force))  # fmt: skip
    kinds = [(name, int if name == "step" else float) for name in COLUMNS]
    return np.array(rows, dtype=kinds)


def _largest_resultant(solution: Solution) -> float:
    """Norm of the largest force of a load or of a support."""
    return max(float(np.linalg.norm(row.force)) for row in solution.report.resultants)


def _size(step: Step) -> float:
    """Length of all cracks in the body, in 3D their area."""
    mesh = step.solutions[0].problem.mesh
    return sum(measures(crack, mesh).area for crack in step.cracks)


__all__ = ["COLUMNS", "fracture_loads"]
