"""A small surface crack that was seen by tomography while it grew (Ferrié 2006)."""

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.crack.surfaces import elliptic_crack
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.growth.step import Step
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.verification.experiments.experiment import Experiment
from xcrack.verification.experiments.outcome import Comparison, Curve, Outcome, Picture
from xcrack.verification.experiments.trial import Trial, grown

_CELLS, _DA = 4.5, 0.016  # cells over the first depth; length of a step, mm
_ASIDE = 0.0137  # mm: no plane of mesh points is that of the crack
_REACH, _COARSE = 0.21, 0.25  # up to where cells are small, and those far away, mm


def _block(experiment: Experiment) -> Mesh:
    """The block, x along the surface, y into the depth, z along the load: fine at the crack."""
    geometry = experiment.geometry
    lower, upper = np.array(geometry["box"]) + np.array([0.0, 0.0, _ASIDE])
    near = geometry["depth"] / _CELLS

    def size(x: Floats) -> Floats:
        away = np.linalg.norm(x, axis=1) - _REACH
        beyond = np.hypot(np.maximum(away, 0.0), np.maximum(np.abs(x[:, 2]) - 2.5 * near, 0.0))
        return np.asarray(1.75 * near + 0.8 * beyond)

    count = tuple(int(n) for n in np.rint((upper - lower) / _COARSE))
    return refine(box(tuple(lower), tuple(upper), count), size=size)


def _depth(step: Step) -> float:
    """Depth of the crack below the surface that it began at."""
    return float(step.cracks[0].points[:, 1].max())


def _run(experiment: Experiment, quick: bool) -> Outcome:
    geometry, material, load = experiment.geometry, experiment.material, experiment.load
    stress, measured = load["stress"], experiment.measured
    a, c = geometry["depth"], geometry["half_width"]
    pull = [traction("top", (0.0, 0.0, stress)), traction("bottom", (0.0, 0.0, -stress))]
    crack = elliptic_crack((0.0, 0.0, 0.0), (0, 0, 1), (1, 0, 0), c, a)
    alloy = Isotropic(material["E"], material["nu"])
    problem = Problem(_block(experiment), alloy, [crack], loads=pull)
    # From m and MPa√m to mm and MPa√mm.
    m = material["paris_m"]
    law = paris(material["paris_C"] * 1000.0 * 1000.0 ** (-0.5 * m), m)
    history = grown(
        problem, law, Cycle(load["R"], 1.0), _DA,
        until=lambda step: _depth(step) > measured["depth"] + _DA and step.cycles > measured["N"],
    )  # fmt: skip
    N = np.array([step.cycles for step in history.steps])
    depth = np.array([_depth(step) for step in history.steps])
    predicted = float(np.interp(measured["depth"], depth, N))
    fronts = [step.sif[-1][0].x[:, :2] for step in history.solved]
    comparisons = (
        Comparison("cycles to the depth of .1733 mm", predicted, measured["N"], "ratio"),
        Comparison("depth after 4000 cycles", float(np.interp(measured["N"], N, depth)),
                   measured["depth"], "ratio", "mm"),
    )  # fmt: skip
    pictures = (
        Picture("Depth over cycles", "N", "depth [mm]", (
            Curve.of("measured", [(0.0, a), (measured["N"], measured["depth"])], "measured"),
            Curve.of("predicted", np.stack([N, depth], axis=1), "predicted"))),
        Picture("Fronts", "x [mm]", "depth [mm]", (
            *(Curve.of("" if k else "predicted", f, "predicted") for k, f in enumerate(fronts)),
            Curve.of("measured deepest points", [(0.0, a), (0.0, measured["depth"])], "measured")),
            is_to_scale=True),
    )  # fmt: skip
    return Outcome(experiment.name, (experiment.name,), comparisons, pictures, _WORDS)


_WORDS = (
    "A crack of .1 mm under a ratio R that is recalled: grains, closure of so small a crack, and "
    "the law of long cracks are worth a factor of 1.5 in its life.",
)
TRIALS = (Trial("ferrie_2006", _run, quick=False, needs=""),)


__all__ = ["TRIALS"]
