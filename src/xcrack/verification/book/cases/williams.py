"""Edge crack under the leading terms at a tip: K_I, K_II and T are given."""

from functools import partial

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.model.numerics import Numerics
from xcrack.output.opening import energy_error
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import NU, E, edge_line, on_box, perturbed, turned
from xcrack.verification.exact import fields_2d
from xcrack.verification.exact.potentials_2d import Plane

_TIP, _ANGLE = (0.083, 0.047), 0.12
_K_I, _K_II, _T = 1.0, 0.6, 0.3
_CELLS = {1: 20, 2: 20}
_RADIUS = 0.4  # the same on all meshes: the rate is that of the elements
_SOURCE = "leading fields at a tip (Williams, 1957), imposed on a square"


def _run(level: int, order: int, plane: Plane) -> list[Value]:
    n = _CELLS[order] * 2**level
    field = turned(
        lambda x, y: fields_2d.williams(x, y, E, NU, _K_I, _K_II, _T, plane=plane), _TIP, _ANGLE
    )
    problem = on_box(
        perturbed(n), [edge_line(_TIP, _ANGLE)], field, traction=("left",), order=order,
        plane=plane, numerics=Numerics(radius=_RADIUS),
    )  # fmt: skip
    solution = solve(problem)
    sif = stress_intensity(solution)
    tolerance = {1: 5e-3, 2: 2e-4}[order]
    scale = float(np.hypot(_K_I, _K_II))
    return [
        Value("K_I", sif.K_I[0], _K_I, tolerance, scale),
        Value("K_II", sif.K_II[0], _K_II, tolerance, scale),
        Value("T", sif.T[0], _T, {1: 1e-2, 2: 1e-3}[order], 1.0),
        Value(
            "error in energy", energy_error(solution, lambda x: field(x)[1]), 0.0,
            {1: 0.1, 2: 0.012}[order], 1.0, rate={1: 0.9, 2: 1.6}[order],
        ),
    ]  # fmt: skip


CASES = (
    Case("williams-1", "K", _SOURCE, "exact", 2, 1, False,
         partial(_run, order=1, plane="strain"), 3),
    Case("williams-2", "K", _SOURCE, "exact", 2, 2, False,
         partial(_run, order=2, plane="strain"), 3),
    Case("williams-plane-stress", "K", _SOURCE + ", plane stress", "exact", 2, 2, False,
         partial(_run, order=2, plane="stress"), 2),
)  # fmt: skip


__all__ = ["CASES"]
