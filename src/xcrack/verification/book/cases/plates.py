"""Edge and centre cracks in strips and finite plates under tension, by tables."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.mesh.box import box
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact.plates import PLATE_CENTRE, STRIP_EDGE_TENSION

_SOURCE = {
    False: ("published", "edge crack in a long strip (Kaya and Erdogan, 1987), five digits"),
    True: ("exact", "centre crack in a square plate: Williams' functions, boundary collocation"),
}
_WITHIN = {1: 3e-2, 2: 5e-4}


def plate(a: float, order: int, per_crack: int, *, centre: bool, height: float = 1.0) -> Problem:
    """Plate of half width 1 with an edge or a centre crack of length a, traction on its ends."""
    h = a / per_crack
    low = -1.0 if centre else 0.0
    n_rows = round(2 * height / h)
    mesh = box((low, -height), (1.0, height), (round((1.0 - low) / h), n_rows + 1 - n_rows % 2))
    return Problem(
        mesh,
        Isotropic(1.0, 0.3, plane="strain"),
        [line_crack([(-a, 0), (a, 0)] if centre else [(-0.1, 0), (a, 0)])],
        loads=[traction("top", (0.0, 1.0)), traction("bottom", (0.0, -1.0))],
        order=order,
    )


def _run(level: int, order: int, share: float, centre: bool) -> list[Value]:
    factor = PLATE_CENTRE[1.0, share] if centre else STRIP_EDGE_TENSION[share]
    height = 1.0 if centre else 1.5
    problem = plate(share, order, 10 * 2**level, centre=centre, height=height)
    sif = stress_intensity(solve(problem))
    unit = np.sqrt(np.pi * share)
    return [
        Value(f"K_I / s √(π a) at tip {k}", K / unit, factor, _WITHIN[order])
        for k, K in enumerate(sif.K_I)
    ]


CASES = tuple(
    Case(f"{'centre' if centre else 'edge'}-plate-{share}-{order}", "K_tables",
         _SOURCE[centre][1], _SOURCE[centre][0], 2, order, False,
         partial(_run, order=order, share=share, centre=centre), 2)
    for centre, shares in ((False, (0.3, 0.5)), (True, (0.5,)))
    for share in shares
    for order in (1, 2)
)  # fmt: skip


__all__ = ["CASES", "plate"]
