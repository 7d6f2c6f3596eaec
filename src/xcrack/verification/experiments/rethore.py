"""Plate with a hole and an inclined pre-crack that is pushed together (Réthoré 2018)."""

from functools import partial
from math import inf
from typing import Any, cast

import numpy as np

from xcrack.crack.lines import line_crack
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.growth.step import Step
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.plates import plate
from xcrack.model.loads import Support, displacement, fix
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.runs.history import History
from xcrack.verification.experiments.experiment import (
    ROOT_M,
    Experiment,
    Trial,
    arc_of,
    grown,
    outline,
)
from xcrack.verification.experiments.outcome import (
    Comparison,
    Curve,
    Outcome,
    Picture,
    Role,
    path_comparisons,
)

_FINE, _COARSE = (0.7, 0.8), (1.0, 1.2)  # cell along the path and length of a step, mm
_SUPPORTS = {
    "bands": "clamped on the loaded bands",
    "sides": "whole sides clamped",
    "sliding": "whole sides, sliding",
}
_END = 13.0  # x at which the test ends
_FADES = 30.0  # with whole sides clamped K falls to zero behind it
_RMS = 0.8
_K_C = 1.28  # MPa√m: 2.0 of the source for E = 5 GPa
_LAW = paris(1e-9, 2.0)  # of no account: each step is as long as it is told to be


def _mesh(experiment: Experiment, size: float) -> Mesh:
    geometry = experiment.geometry
    (x0, y0), (x1, y1) = geometry["outline"]
    hole, tip = geometry["hole"], np.array(geometry["tip"])
    low, high = (y0 + y1) / 2 - geometry["band"], (y0 + y1) / 2 + geometry["band"]
    bands = {"left_band": ((x0, low), (x0, high)), "right_band": ((x1, low), (x1, high))}
    return plate(
        outline=[(x0, y0), (x1, y0), (x1, y1), (x0, y1)],
        holes=[(tuple(hole["center"]), hole["radius"])], size=4.0, size_near=size,
        along=[(82.0, 27.5), tip.tolist(), *experiment.path.tolist()], band=3.0, transition=15.0,
        sets={"left": [3], "right": [1], **bands},
    )  # fmt: skip


def _supports(kind: str) -> list[Support]:
    """Platens that come nearer by 1."""
    if kind == "sliding":
        corner, pull = fix((0.0, 0.0), axis=1), (-1.0, None)
        return [fix("left", axis=0), displacement("right", cast(Any, pull)), corner]
    end = "_band" if kind == "bands" else ""
    return [fix(f"left{end}"), displacement(f"right{end}", (-1.0, 0.0))]


def plate_of(experiment: Experiment, mesh: Mesh, kind: str, contact: str) -> Problem:
    """The plate between its platens.

    Parameters
    ----------
    experiment : Experiment
    mesh : Mesh
    kind : {"bands", "sides", "sliding"}
        What the platens hold.
    contact : {"auto", "off"}
    """
    geometry, material = experiment.geometry, experiment.material
    center, tip = np.array(geometry["hole"]["center"]), np.array(geometry["tip"])
    direction = (tip - center) / np.linalg.norm(tip - center)
    start = center + (geometry["hole"]["radius"] - 1.0) * direction
    steel = Isotropic(material["E"], material["nu"], "stress")
    crack = line_crack([start, tip])
    return Problem(mesh, steel, [crack], supports=_supports(kind), contact=contact)


def _run(experiment: Experiment, quick: bool) -> Outcome:
    size, da = _COARSE if quick else _FINE
    mesh, measured_path = _mesh(experiment, size), experiment.path
    comparisons: list[Comparison] = []
    curves = [*outline(mesh), Curve.of("measured", measured_path, "measured")]
    force: list[Curve] = []
    for kind in ("bands", "sliding") if quick else _SUPPORTS:
        reach = _FADES if kind == "sides" else _END
        compared = measured_path[measured_path[:, 0] >= reach]
        for contact in ("auto", "off"):
            history = grown(
                plate_of(experiment, mesh, kind, contact), _LAW, Cycle(0.0, 1.0), da,
                until=partial(_is_beyond, reach),
            )  # fmt: skip
            path = history.cracks[0].points[1:]
            words = f"{_SUPPORTS[kind]}, contact {contact.replace('auto', 'on')}"
            limits = (_RMS if (kind, contact) == ("bands", "auto") else inf, inf)
            comparisons += path_comparisons(compared, path, limits=limits, where=f": {words}")
            role: Role = "predicted" if (kind, contact) == ("bands", "auto") else "variant"
            curves.append(Curve.of(words, path, role))
            if (kind, contact) == ("bands", "auto"):
                comparisons.append(_first_angle(experiment, history))
                of_forces, force = _forces(experiment, history)
                comparisons += of_forces
    return Outcome(
        experiment.name,
        (experiment.name,),
        (*comparisons, *_gain_by_contact(comparisons)),
        (
            Picture("Path", "x [mm]", "y [mm]", tuple(curves), is_to_scale=True),
            Picture("Force over displacement", "displacement [mm]", "force [N]", tuple(force)),
        ),
        _WORDS,
    )


def _is_beyond(x: float, step: Step) -> bool:
    return bool(step.cracks[0].points[-1, 0] < x)


def _gain_by_contact(comparisons: list[Comparison]) -> list[Comparison]:
    """The distance with contact over that without, under the same supports."""
    gains = []
    for kind, words in _SUPPORTS.items():
        name = f"distance of the path, rms: {words}, contact "
        rms_of = {c.name.removeprefix(name): c.predicted for c in comparisons if name in c.name}
        if rms_of and kind != "bands":
            share = rms_of["on"] / rms_of["off"]
            gains.append(
                Comparison(f"rms with contact over rms without: {words}", share, measure="number",
                           most=1.0)
            )  # fmt: skip
    return gains


def _first_angle(experiment: Experiment, history: History) -> Comparison:
    """Direction from the tip of the pre-crack to the distance of the third measured point."""
    tip = np.array(experiment.geometry["tip"])
    path = history.cracks[0].points
    start = int(np.argmin(np.linalg.norm(path - tip, axis=1)))
    arc = arc_of(path[start:])
    chord = np.array([np.interp(2.53, arc, path[start:, k]) for k in range(2)]) - tip
    angle = float(np.degrees(np.arctan2(chord[1], chord[0])))
    range_measured = experiment.measured["direction"]
    return Comparison("first direction", angle, range_measured, "difference", "degrees", -6.0, 6.0)


def _forces(experiment: Experiment, history: History) -> tuple[list[Comparison], list[Curve]]:
    """Force and displacement at which the crack goes on at K = K_c, from a scene that is linear."""
    thickness, measurements = experiment.geometry["thickness"], experiment.measured
    table = history.load_at(_K_C * ROOT_M)
    shift, force = table["displacement"], thickness * table["force"]
    stiffness = float(force[0] / shift[0])
    low, high = measurements["stiffness"]
    comparisons = [
        Comparison("stiffness with the pre-crack", stiffness, (low + high) / 2, "ratio"),
        Comparison(
            "force at which the crack begins",
            float(force[0]),
            measurements["force_at_knee"],
            "ratio",
        ),
        Comparison(
            "force at the end, K = 1.28 MPa√m",
            float(force[-1]),
            measurements["force_at_end"],
            "ratio",
        ),
        Comparison(
            "force at the end, K as it fell in the test",
            float(force[-1]) * measurements["K_end_over_first"],
            measurements["force_at_end"],
            "ratio",
        ),
    ]
    knee = measurements["force_at_knee"] / ((low + high) / 2)
    points = measurements.get("force") or [
        [0.0, 0.0], [knee, measurements["force_at_knee"]],
        [measurements["displacement_at_end"], measurements["force_at_end"]],
    ]  # fmt: skip
    curve = np.array([[0.0, 0.0], *zip(shift, force, strict=True)])
    return comparisons, [
        Curve.of("measured", points, "measured"),
        Curve.of(f"K = {_K_C} MPa√m all along", curve, "predicted"),
    ]


_WORDS = (
    "The supports move the path more than contact does, and it is not known which of them the "
    "platens are.",
    "K by image correlation fell to .7 of its first value in the test, as that of a crack that "
    "slows down in PMMA does; one toughness all along asks for a third more force at the end.",
    "Under sliding platens T along the crack is far below zero near the end, and steps as long as "
    "these then turn to and fro: the zigzag of that path is numerical.",
    "The plate, 10 mm thick and 70 high, is taken in plane stress. Plane strain makes it "
    "stiffer by 16 per cent, 11.9 kN/mm beside 10.5 to 10.9 measured, and moves the path by "
    ".07 mm.",
    "With whole sides clamped K falls to zero from x = 30 on, which the test did not show: that "
    "pair is compared up to there.",
)
TRIALS = (Trial("rethore_2018", _run),)


__all__ = ["TRIALS", "plate_of"]
