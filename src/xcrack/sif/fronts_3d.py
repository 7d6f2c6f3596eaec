"""K along all fronts of a crack in space."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.arrays import Floats
from xcrack.errors import warn
from xcrack.mesh.locate import contains
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.sif import SIF


def along_fronts(solutions: Sequence[Solution], crack: int) -> list[SIF]:
    """K_I, K_II and K_III at the vertices of the fronts that lie in the body, for each state.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    crack : int
    """
    space = solutions[0].space
    tips = [t for t, tip in enumerate(space.tips) if tip.crack == crack]
    by_front = [front_intensity(solutions, t) for t in tips]
    inside = [contains(space.mesh, np.array(space.tips[t].x)) for t in tips]
    result = []
    for k in range(len(solutions)):
        parts: list[list[Any]] = [[] for _ in range(7)]
        for number, (found, kept) in enumerate(zip(by_front, inside, strict=True)):
            K, spread, x, frame, s, at_surface = found[k]
            if np.isnan(K).any():
                if k == 0:
                    _say_short(x)
                K, spread = np.zeros_like(K), np.zeros_like(spread)
            row = (x, frame, K, spread, s, np.full(len(x), number), at_surface)
            for part, values in zip(parts, row, strict=True):
                part.append(values[kept])
        shapes = ((0, 3), (0, 3, 3), (0, 3), (0, 3), (0,), (0,), (0,))
        joined: list[Any] = [
            np.concatenate(part) if part else np.zeros(shape)
            for part, shape in zip(parts, shapes, strict=True)
        ]
        x, frame, K, spread, s, front, at_surface = joined
        result.append(
            SIF(
                x=x,
                frame=frame,
                K=K,
                T=np.full(len(x), np.nan),
                spread=spread,
                s=s,
                front=front.astype(np.int64),
                at_surface=at_surface.astype(bool),
            )
        )
    return result


def _say_short(x: Floats) -> None:
    warn(
        f"the front from {np.round(x[0], 6).tolist()} to {np.round(x[-1], 6).tolist()} is too "
        "short inside the body for K: no domain around it is whole. K counts as 0 there, and it "
        "does not grow. Refine the mesh around it."
    )
