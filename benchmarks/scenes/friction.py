"""An inclined crack whose closed faces rub: loaded, and loaded and unloaded."""

import warnings
from collections.abc import Sequence

import numpy as np

import xcrack as xc
from benchmarks.runs import Outcome
from benchmarks.scenes.exact_fields import sliding
from benchmarks.scenes.material import STEEL
from benchmarks.scenes.settings import Settings, mesh_of

_SIDES = ("left", "right", "bottom", "top")
_MIDDLE, _ANGLE = (0.05, -0.07), 0.31
PRESSURE, COEFFICIENT = 1.0, 0.3
LOADED = (0.9, 0.6)  # remote shear, and what of it moves the faces
UNLOADED = (0.0, 0.3)  # they slip back where the shear has fallen by twice their strength


def rubbing(s: Settings, seed: int) -> Outcome:
    """Crack [-1, 1], turned, in [-2, 2]² under pressure 1 and shear 0.9, friction 0.3."""
    return _path(s, seed, (LOADED,))


def unloading(s: Settings, seed: int) -> Outcome:
    """The same crack, then without shear: K_II that friction locks."""
    return _path(s, seed, (LOADED, UNLOADED))


def _path(s: Settings, seed: int, path: Sequence[tuple[float, float]]) -> Outcome:
    turn = np.array([np.cos(_ANGLE), np.sin(_ANGLE)])
    states = [_imposed(effective, tau) for tau, effective in path]
    problem = xc.Problem(
        mesh_of(s, 2.0, 2, seed), STEEL[2], [xc.line_crack([_MIDDLE - turn, _MIDDLE + turn])],
        supports=_imposed(0.0, 0.0), contact=s.contact, friction=COEFFICIENT, order=s.order,
        numerics=s.numerics,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        solutions = xc.solve(problem, states)
        K = np.array([sif.K_II for sif in xc.stress_intensities(solutions)])
    moved = np.array([effective for _, effective in path])
    exact = np.sqrt(np.pi) * moved[:, None]
    errors = {"K_II": float(np.abs(np.abs(K) - exact).max() / (np.sqrt(np.pi) * LOADED[1]))}
    faces = solutions[-1].contact[0]
    if faces is not None:
        # The shear of faces that slip is as wrong as the pressure.
        mean = faces.measure @ (faces.pressure - PRESSURE) ** 2 / faces.measure.sum()
        errors["pressure"] = float(np.sqrt(mean)) / PRESSURE
    return Outcome(errors, solutions[-1].n_dof)


def _imposed(effective: float, tau: float) -> list[xc.displacement]:
    u = sliding(effective, tau, PRESSURE, _MIDDLE, _ANGLE)
    return [xc.displacement(side, lambda x: u(x)) for side in _SIDES]
