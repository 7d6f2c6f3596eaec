"""Half disc with an inclined crack that is bent over two supports (Ayatollahi 2006)."""

from math import inf
from typing import Any, cast

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.plates import plate
from xcrack.model.loads import displacement, fix
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.verification.experiments.experiment import Experiment, Trial, by_others, grown, outline
from xcrack.verification.experiments.outcome import (
    Comparison,
    Curve,
    Outcome,
    Picture,
    distances,
    path_comparisons,
)

_FINE, _COARSE = (0.6, 1.0), (1.0, 1.8)  # cell along the path and length of a step, mm
_RMS = 2.0
_LAW = paris(1e-12, 2.0)  # of no account: each step is as long as it is told to be


def _half_disc(experiment: Experiment, size: float) -> Mesh:
    """Upper half of a disc with the seats of its rollers, fine along the way of the crack."""
    geometry = experiment.geometry
    radius, at, half = geometry["radius"], geometry["supports"], geometry["contact"] / 2
    top = 0.9 * radius
    seats = {
        "left": ((-at - half, 0.0), (-at + half, 0.0)),
        "right": ((at - half, 0.0), (at + half, 0.0)),
        "roller": ((-half, top), (half, None)),
    }
    return plate(
        outline=[(-radius, 0.0), (radius, 0.0), ((0.0, radius), (-radius, 0.0))], size=3.0,
        size_near=size, along=[(0.0, 0.0), *experiment.path.tolist()], band=3.0, transition=20.0,
        sets=seats,
    )  # fmt: skip


def _scene(experiment: Experiment, size: float, is_sliding: bool) -> Problem:
    geometry, material = experiment.geometry, experiment.material
    angle = np.radians(geometry["crack"]["angle"])
    direction = np.array([np.sin(angle), np.cos(angle)])
    crack = line_crack([-0.5 * direction, geometry["crack"]["length"] * direction])
    right_support = fix("right", axis=1) if is_sliding else fix("right")
    supports = [fix("left"), right_support, displacement("roller", cast(Any, (None, -1.0)))]
    glass = Isotropic(material["E"], material["nu"], "stress")
    return Problem(_half_disc(experiment, size), glass, [crack], supports=supports)


def _run(experiment: Experiment, quick: bool) -> Outcome:
    size, da = _COARSE if quick else _FINE
    measured_path, top = experiment.path, experiment.geometry["radius"]
    compared = measured_path[measured_path[:, 1] <= 0.9 * top]

    def path_of(size: float, da: float, is_sliding: bool = True) -> Floats:
        history = grown(
            _scene(experiment, size, is_sliding), _LAW, Cycle(0.0, 1.0), da,
            until=lambda step: bool(step.cracks[0].points[-1, 1] > 0.93 * top),
        )  # fmt: skip
        return np.asarray(history.cracks[0].points[1:])

    path = path_of(size, da)
    comparisons = path_comparisons(compared, path, limits=(_RMS, inf))
    curves = [
        *outline(_half_disc(experiment, size)),
        Curve.of("measured", measured_path, "measured"),
        *(Curve.of(o["program"], o["path"], "other") for o in experiment.others),
    ]
    comparisons += by_others(experiment, compared)
    if not quick:
        bar = float(distances(path, path_of(*_COARSE)).max())
        comparisons.append(
            Comparison("bar of the predicted path: coarser cells and longer steps", bar,
                       unit="mm", measure="number")
        )  # fmt: skip
        clamped = path_of(*_COARSE, is_sliding=False)
        comparisons += path_comparisons(compared, clamped, where=", both supports held")
        curves.append(Curve.of("predicted, both supports held", clamped, "variant"))
    curves.append(Curve.of("predicted", path, "predicted"))
    picture = Picture("Path", "x [mm]", "y [mm]", tuple(curves), is_to_scale=True)
    return Outcome(experiment.name, (experiment.name,), tuple(comparisons), (picture,), _WORDS)


_WORDS = (
    "The measured path lies between that of supports that slide and of supports that are held: "
    "friction of the rollers is of the size of the difference. Compared up to nine tenths of the "
    "height: beyond, the loading roller is near.",
)
TRIALS = (Trial("ayatollahi_2006", _run),)


__all__ = ["TRIALS"]
