"""Compact tension: pins in the holes of a standard specimen."""

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.crack.lines import line_crack
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.plates import plate
from xcrack.model.loads import bearing
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.output.opening import crack_opening
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.book.case import Case, Value

_SOURCE = "polynomial of ASTM E399 and E647 within 0.5 % (Srawley, 1976)"
_SHARES = {0.3: 0.015, 0.45: 0.01, 0.5: 0.01, 0.55: 0.01, 0.7: 0.015}  # a/W and what is allowed
_W = 50.0


def _standard(x: float) -> float:
    """K B sqrt(W) / P of the standards for a/W = x."""
    series = 0.886 + 4.64 * x - 13.32 * x**2 + 14.72 * x**3 - 5.6 * x**4
    return float((2 + x) * series / (1 - x) ** 1.5)


def _gauge(x: float, first: float, *others: float) -> float:
    """E' B V / P of Saxena and Hudak for a/W = x."""
    series = sum(c * x**k for k, c in enumerate((first, *others)))
    return ((1 + x) / (1 - x)) ** 2 * series


def _mesh(level: int) -> Mesh:
    h = 1.5 / 2**level
    return plate(
        1.25 * _W,
        1.2 * _W,
        lower=(-0.25 * _W, -0.6 * _W),
        holes=[((0.0, side * 0.275 * _W), 0.125 * _W) for side in (1, -1)],
        size=3 * h,
        size_near=h,
        along=[(0.2 * _W, 0.0), (0.85 * _W, 0.0)],
        band=1.0,
        transition=15.0,
    )


def _run(level: int) -> list[Value]:
    mesh, values = _mesh(level), []
    for share, tolerance in _SHARES.items():
        problem = Problem(
            mesh,
            Isotropic(72e3, 0.33, "strain"),
            [line_crack([(-0.26 * _W, 0.0), (share * _W, 0.0)])],
            loads=[bearing(f"hole_{k}", (0.0, side)) for k, side in enumerate((1.0, -1.0))],
        )
        K = stress_intensity(solve(problem)).K_I[0] * np.sqrt(_W)
        values.append(Value(f"K at a/W = {share:g}", float(K), _standard(share), tolerance))
    return values


def _openings(level: int) -> list[Value]:
    """Clip gauges on the load line and at the front face; pins that roll on flattened holes."""
    mesh, steel, values = _mesh(level), Isotropic(210e3, 0.3, "strain"), []
    for x in (0.45, 0.6):
        loads = [
            bearing(f"hole_{k}", (0.0, side), contact_angle=np.pi / 3)
            for k, side in enumerate((1.0, -1.0))
        ]
        crack = line_crack([(-0.26 * _W, 0.0), (x * _W, 0.0)])
        solution = solve(Problem(mesh, steel, [crack], loads=loads))
        line = float(crack_opening(solution, (0.0, 0.0))) * steel.E_prime
        face = float(crack_opening(solution)[0]) * steel.E_prime
        reference = _gauge(x, 2.1630, 12.219, -20.065, -0.9925, 20.609, -9.9314)
        values.append(Value(f"load line, a/W = {x:g}", line, reference, 0.01))
        reference = _gauge(x, 1.6137, 12.678, -14.231, -16.610, 35.050, -14.494) * (1 + 0.25 / x)
        values.append(Value(f"front face, a/W = {x:g}", face, reference, 0.01))
    return values


_GAUGES = "clip gauges of a compact specimen (Saxena and Hudak, 1978; ASTM E647), from memory"

CASES = (
    Case(
        "compact-opening", "opening", _GAUGES, "published", 2, 2, False, _openings, 2, needs="gmsh"
    ),
    Case("compact-tension", "K_tables", _SOURCE, "published", 2, 2, False, _run, 2, needs="gmsh"),
)


__all__ = ["CASES"]
