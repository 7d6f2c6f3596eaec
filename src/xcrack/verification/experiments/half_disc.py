"""Half disc with an inclined crack that is bent over two supports (Ayatollahi 2006)."""

from math import inf
from typing import Any, cast

import numpy as np

from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.model.loads import displacement
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.model.supports import fix
from xcrack.verification.experiments.experiment import Experiment
from xcrack.verification.experiments.outcome import (
    Comparison,
    Curve,
    Outcome,
    Picture,
    distances,
    path_comparisons,
    rms,
)
from xcrack.verification.experiments.trial import Trial, grown, outline

_FINE, _COARSE = (44, 1.0), (30, 1.8)  # cells over the radius, length of a step in mm
_RMS = 2.0
_LAW = paris(1e-12, 2.0)  # of no account: each step is as long as it is told to be


def _half_disc(experiment: Experiment, n: int) -> Mesh:
    """Upper half of a disc: a rectangle whose lines become ellipses; with places of rollers."""
    radius = experiment.geometry["radius"]
    flat = box((-1.0, 0.0), (1.0, 1.0), (2 * n, n))
    u, v = flat.points.T
    x, y = radius * u * np.sqrt(1 - v**2 / 2), radius * v * np.sqrt(1 - u**2 / 2)
    points = np.stack([x, y], axis=1)
    edges = flat.boundary
    middle = points[edges].mean(axis=1)
    half = experiment.geometry["supports"]
    places = {"left": (-half, 0.0), "right": (half, 0.0), "roller": (0.0, radius)}
    reach = max(0.5 * experiment.geometry["contact"], 0.75 * radius / n)
    near = {
        name: edges[np.linalg.norm(middle - place, axis=1) <= reach]
        for name, place in places.items()
    }
    return Mesh(points, flat.cells, near)


def _scene(experiment: Experiment, n: int, slides: bool) -> Problem:
    geometry, material = experiment.geometry, experiment.material
    angle = np.radians(geometry["crack"]["angle"])
    ahead = np.array([np.sin(angle), np.cos(angle)])
    crack = line_crack([-0.5 * ahead, geometry["crack"]["length"] * ahead])
    right = fix("right", axis=1) if slides else fix("right")
    supports = [fix("left"), right, displacement("roller", cast(Any, (None, -1.0)))]
    glass = Isotropic(material["E"], material["nu"], "stress")
    return Problem(_half_disc(experiment, n), glass, [crack], supports=supports)


def _run(experiment: Experiment, quick: bool) -> Outcome:
    n, da = _COARSE if quick else _FINE
    measured, top = experiment.path, experiment.geometry["radius"]
    compared = measured[measured[:, 1] <= 0.9 * top]

    def path_of(n: int, da: float, slides: bool = True) -> Floats:
        history = grown(
            _scene(experiment, n, slides), _LAW, Cycle(0.0, 1.0), da,
            until=lambda step: bool(step.cracks[0].points[-1, 1] > 0.93 * top),
        )  # fmt: skip
        return np.asarray(history.cracks[0].points[1:])

    path = path_of(n, da)
    comparisons = path_comparisons(compared, path, within=(_RMS, inf))
    curves = [
        *outline(_half_disc(experiment, n)),
        Curve.of("measured", measured, "measured"),
        *(Curve.of(o["program"], o["path"], "other") for o in experiment.others),
    ]
    words = []
    for other in experiment.others:
        there = rms(distances(compared, np.array(other["path"])))
        words.append(f"{other['program']}: distance of the path, rms {there:.2f} mm")
    if not quick:
        bar = float(distances(path, path_of(*_COARSE)).max())
        comparisons.append(
            Comparison("bar of the predicted path: coarser cells and longer steps", bar,
                       unit="mm", measure="number")
        )  # fmt: skip
        clamped = path_of(*_COARSE, slides=False)
        comparisons += path_comparisons(compared, clamped, where=", both supports held")
        curves.append(Curve.of("predicted, both supports held", clamped, "variant"))
    curves.append(Curve.of("predicted", path, "predicted"))
    picture = Picture("Path", "x [mm]", "y [mm]", tuple(curves), is_to_scale=True)
    words.append(
        "The measured path lies between that of supports that slide and of supports that are held: "
        "friction of the rollers is of the size of the difference. Compared up to nine tenths of "
        "the height: beyond, the loading roller is near."
    )
    return Outcome(experiment.name, (experiment.name,), tuple(comparisons), (picture,), (*words,))


TRIALS = (Trial("ayatollahi_2006", _run, needs=""),)


__all__ = ["TRIALS"]
