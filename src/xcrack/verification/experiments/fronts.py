"""Fronts in space: seen by tomography, bowed at a surface, branched (Ferrié 2006, Crack Paths)."""

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.surfaces import elliptic_crack, plane_crack
from xcrack.fatigue.criteria import kink_angle
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.power import paris
from xcrack.growth.step import Step
from xcrack.mesh.box import box
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.refinement import refine
from xcrack.model.loads import traction
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.stress_intensity import stress_intensity
from xcrack.verification.experiments.experiment import Experiment, Trial, by_others, grown
from xcrack.verification.experiments.outcome import Comparison, Curve, Outcome, Picture

_CELL, _DA, _STEPS = 0.35, 0.4, 9  # of the bar, mm
_NEAR = 0.08  # share of the thickness over which the end of a front is taken as straight
_BEND = 5.0  # degrees by which the angle of a front may be off
_ASIDE = 0.0137  # no plane of mesh points is that of the crack
_CELLS = 9  # over the radius of a half penny
_BRANCH = 8.0  # degrees by which the angle of a branch may be off


def _bent_bar(experiment: Experiment) -> Problem:
    """A bar with a straight crack through its thickness, bent; x along it, y into its depth."""
    sizes, material = experiment.geometry, experiment.material
    length, width, thickness = (sizes[name] for name in ("length", "width", "thickness"))
    first, last = sizes["crack"], sizes["crack"] + _STEPS * _DA

    def size(x: Floats) -> Floats:
        y = np.maximum(first - 1.5 * _CELL - x[:, 1], x[:, 1] - last - 2.0 * _CELL)
        distance = np.hypot(np.maximum(y, 0.0), np.maximum(np.abs(x[:, 0]) - 2.5 * _CELL, 0.0))
        return np.asarray(1.75 * _CELL + 0.7 * distance)

    def bending_stress(x: Floats) -> Floats:
        return np.stack([1.0 - 2.0 * x[:, 1] / width, *np.zeros((2, len(x)))], axis=1)

    lower = (-length / 2 + _ASIDE, 0.0, 0.0)
    upper = (length / 2 + _ASIDE, width, thickness)
    mesh = refine(box(lower, upper, (10, 7, 4)), size=size)
    corners = [(-1.0, -1.0), (first, -1.0), (first, thickness + 1.0), (-1.0, thickness + 1.0)]
    crack = plane_crack([(0.0, y, z) for y, z in corners])
    loads = [traction("right", bending_stress), traction("left", lambda x: -bending_stress(x))]
    return Problem(mesh, Isotropic(material["E"], material["nu"]), [crack], loads=loads)


def _angle_at_ends(front: Floats, reach: float) -> float:
    """Angle in degrees between a front (n, 2) of depth over thickness and the surface's normal."""
    angles = []
    for end in (front[0, 1], front[-1, 1]):
        points_near_end = front[np.abs(front[:, 1] - end) <= reach]
        slope = np.polyfit(np.abs(points_near_end[:, 1] - end), points_near_end[:, 0], 1)[0]
        angles.append(np.degrees(np.arctan(slope)))
    return float(np.mean(angles))


def _run_bar(experiment: Experiment, quick: bool) -> Outcome:
    thickness = experiment.geometry["thickness"]
    law = paris(1e-6, experiment.material["paris_m"])
    history = grown(
        _bent_bar(experiment), law, Cycle(0.0, 1.0), _DA, until=lambda step: step.index >= _STEPS
    )
    fronts, spread = [], 0.0
    for step in history.solved:
        answer = step.sif[-1][0]
        order = np.argsort(answer.x[:, 2])
        fronts.append(answer.x[order, 1:])
        spread = float(np.ptp(answer.K_I) / answer.K_I.max())
    angles = [_angle_at_ends(front, _NEAR * thickness) for front in fronts]
    measured_angle = experiment.measured["angle"]
    end, reach = fronts[-1][0], 0.1 * thickness
    slope = np.tan(np.radians(measured_angle))
    tangent = end[::-1] + np.linspace(0.0, reach, 6)[:, None] * np.array([1.0, slope])
    comparisons = (
        Comparison("angle of the steady front at the surface", float(np.mean(angles[-3:])),
                   measured_angle, "difference", "degrees", -_BEND, _BEND),
        Comparison("K along the steady front: largest less least, over largest", spread,
                   measure="number", most=0.05),
        Comparison("bow of the steady front over the thickness",
                   float(np.ptp(fronts[-1][:, 0]) / thickness), measure="number"),
        *by_others(experiment),
    )  # fmt: skip
    advance = [front[:, 0].max() - fronts[0][:, 0].max() for front in fronts]
    growth = np.stack([advance, angles], axis=1)
    ends = [(advance[0], 0.0), (advance[-1], 0.0)]
    others = [
        Curve.of(other["program"], np.add(ends, (0.0, other["angle"])), "other")
        for other in experiment.others
    ]
    pictures = (
        Picture("Fronts", "z through the thickness [mm]", "depth [mm]", (
            *(Curve.of("" if k else "predicted", f[:, ::-1], "predicted")
              for k, f in enumerate(fronts)),
            Curve.of(f"{measured_angle:g} degrees, measured", tangent, "measured"))),
        Picture("Angle at the surface", "growth [mm]", "angle [degrees]", (
            Curve.of("predicted", growth, "predicted"),
            Curve.of("measured", [(x, measured_angle) for x in advance], "measured"), *others)),
    )  # fmt: skip
    return Outcome(experiment.name, (experiment.name,), comparisons, pictures, _BOWED)


_BOWED = (
    "A straight front grows until K is the same all along: its ends lag and bend. At the surface "
    "itself K is of another order than inside; the angle is that of the last eight hundredths of "
    "the thickness, and grows by a degree or two as cells get smaller.",
)


def _sheared_block(experiment: Experiment) -> Problem:
    """A block in shear with a half penny in z = 0 at its side y = 0; it shears along x."""
    material, radius = experiment.material, experiment.geometry["radius"]
    width, depth, height = experiment.geometry["block"]
    cell = radius / _CELLS

    def size(x: Floats) -> Floats:
        ring = np.abs(np.hypot(x[:, 0], x[:, 1]) - radius) - 3.0 * cell
        distance = np.hypot(np.maximum(ring, 0.0), np.maximum(np.abs(x[:, 2]) - 3.0 * cell, 0.0))
        return np.asarray(1.75 * cell + 0.7 * distance)

    offset = _ASIDE * radius
    lower = (-width / 2, 0.0, -height / 2 + offset)
    upper = (width / 2, depth, height / 2 + offset)
    mesh: Mesh = refine(box(lower, upper, (8, 4, 8)), size=size)
    shear = experiment.load["shear"]
    loads = [
        traction(side, force)
        for side, force in (
            ("top", (shear, 0.0, 0.0)), ("bottom", (-shear, 0.0, 0.0)),
            ("right", (0.0, 0.0, shear)), ("left", (0.0, 0.0, -shear)),
        )
    ]  # fmt: skip
    crack = elliptic_crack((0.0, 0.0, 0.0), (0, 0, 1), (1, 0, 0), radius, radius)
    # Shear alone neither opens nor closes it.
    steel = Isotropic(material["E"], material["nu"])
    return Problem(mesh, steel, [crack], loads=loads, contact="off")


def _run_block(experiment: Experiment, quick: bool) -> Outcome:
    nu, results = experiment.material["nu"], experiment.measured
    answer = stress_intensity(solve(_sheared_block(experiment)))
    K, place = answer.K, np.degrees(np.arctan2(answer.x[:, 1], answer.x[:, 0]))
    order = np.argsort(place)
    K, place = K[order], place[order]
    tilt = np.degrees(np.abs(kink_angle(K)))
    # Plane of the largest principal stress ahead of a front under modes I and III (Pook 1985).
    twist = np.degrees(0.5 * np.arctan2(2.0 * np.abs(K[:, 2]),
                                        (1.0 - 2.0 * nu) * np.maximum(K[:, 0], 0.0)))  # fmt: skip
    is_tilting = np.abs(K[:, 1]) > np.abs(K[:, 2])
    ends, deepest_point = [0, -1], int(np.argmin(np.abs(place - 90.0)))
    surface, depth = (results[name] for name in ("at_surface", "at_depth"))
    comparisons = (
        Comparison("angle of branches at the surface, mode II", float(tilt[ends].mean()),
                   float(np.mean(surface)), "difference", "degrees", -_BRANCH, _BRANCH),
        Comparison("angle of branches at the deepest point, mode III", float(twist[deepest_point]),
                   float(np.mean(depth)), "difference", "degrees", -_BRANCH, _BRANCH),
        Comparison("K_III over K_II at the surface", float(np.abs(K[ends, 2] / K[ends, 1]).mean()),
                   measure="number"),
        Comparison("K_II over K_III at the deepest point",
                   float(np.abs(K[deepest_point, 1] / K[deepest_point, 2])), measure="number"),
    )  # fmt: skip
    bands = [(0.0, surface[0]), (0.0, surface[1]), (180.0, surface[0]), (180.0, surface[1]),
             (90.0, depth[0]), (90.0, depth[1])]  # fmt: skip
    unit = np.abs(K[:, 1:]).max()
    pictures = (
        Picture("Angles of branches", "place along the front [degrees]", "angle [degrees]", (
            Curve.of("measured, least and largest", bands, "measured"),
            Curve.of("tilt by K_II", np.stack([place, tilt], 1), "predicted"),
            Curve.of("twist by K_III, where it leads", np.stack([place, twist], 1)[~is_tilting],
                     "variant"))),
        Picture("K along the front", "place along the front [degrees]", "K over the largest", (
            Curve.of("K_II", np.stack([place, K[:, 1] / unit], 1), "predicted"),
            Curve.of("K_III", np.stack([place, K[:, 2] / unit], 1), "variant"),
            Curve.of("K_I", np.stack([place, K[:, 0] / unit], 1), "variant"))),
    )  # fmt: skip
    return Outcome(experiment.name, (experiment.name,), comparisons, pictures, _SHEARED)


_SHEARED = (
    "At the surface the crack is under mode II and the branch of largest hoop stress leaves it by "
    "70.5 degrees; at the deepest point it is under mode III, and the plane of largest tension is "
    "twisted by 45 degrees. The first is that of growth here; by mode III alone a front of xcrack "
    "does not turn: the small facets of a factory roof, which then join, are not followed.",
    "Roofs flatten to 30 degrees at the centre of the bar; the page that was read gives no reason.",
)
_CELLS_OF_DEPTH, _STEP = 4.5, 0.016  # cells over the first depth; length of a step, mm
_BESIDE = 0.0137  # mm: no plane of mesh points is that of the crack
_FINE_WITHIN, _FAR_CELL = 0.21, 0.25  # up to where cells are small, and those far away, mm


def _tomography_block(experiment: Experiment) -> Mesh:
    """The block, x along the surface, y into the depth, z along the load: fine at the crack."""
    geometry = experiment.geometry
    lower, upper = np.array(geometry["box"]) + np.array([0.0, 0.0, _BESIDE])
    cell = geometry["depth"] / _CELLS_OF_DEPTH

    def size(x: Floats) -> Floats:
        distance = np.linalg.norm(x, axis=1) - _FINE_WITHIN
        excess = np.hypot(np.maximum(distance, 0.0), np.maximum(np.abs(x[:, 2]) - 2.5 * cell, 0.0))
        return np.asarray(1.75 * cell + 0.8 * excess)

    count = tuple(int(n) for n in np.rint((upper - lower) / _FAR_CELL))
    return refine(box(tuple(lower), tuple(upper), count), size=size)


def _depth(step: Step) -> float:
    """Depth of the crack below the surface that it began at."""
    return float(step.cracks[0].points[:, 1].max())


def _run_tomography(experiment: Experiment, quick: bool) -> Outcome:
    geometry, material, load = experiment.geometry, experiment.material, experiment.load
    stress, results = load["stress"], experiment.measured
    a, c = geometry["depth"], geometry["half_width"]
    pull = [traction("top", (0.0, 0.0, stress)), traction("bottom", (0.0, 0.0, -stress))]
    crack = elliptic_crack((0.0, 0.0, 0.0), (0, 0, 1), (1, 0, 0), c, a)
    alloy = Isotropic(material["E"], material["nu"])
    problem = Problem(_tomography_block(experiment), alloy, [crack], loads=pull)
    # From m and MPa√m to mm and MPa√mm.
    m = material["paris_m"]
    law = paris(material["paris_C"] * 1000.0 * 1000.0 ** (-0.5 * m), m)
    history = grown(
        problem, law, Cycle(load["R"], 1.0), _STEP,
        until=lambda step: _depth(step) > results["depth"] + _STEP and step.cycles > results["N"],
    )  # fmt: skip
    N = np.array([step.cycles for step in history.steps])
    depth = np.array([_depth(step) for step in history.steps])
    life = float(np.interp(results["depth"], depth, N))
    fronts = [step.sif[-1][0].x[:, :2] for step in history.solved]
    comparisons = (
        Comparison("cycles to the depth of .1733 mm", life, results["N"], "ratio"),
        Comparison("depth after 4000 cycles", float(np.interp(results["N"], N, depth)),
                   results["depth"], "ratio", "mm"),
        *by_others(experiment),
    )  # fmt: skip
    pictures = (
        Picture("Depth over cycles", "N", "depth [mm]", (
            Curve.of("measured", [(0.0, a), (results["N"], results["depth"])], "measured"),
            Curve.of("predicted", np.stack([N, depth], axis=1), "predicted"))),
        Picture("Fronts", "x [mm]", "depth [mm]", (
            *(Curve.of("" if k else "predicted", f, "predicted") for k, f in enumerate(fronts)),
            Curve.of("measured deepest points", [(0.0, a), (0.0, results["depth"])], "measured")),
            is_to_scale=True),
    )  # fmt: skip
    return Outcome(experiment.name, (experiment.name,), comparisons, pictures, _SMALL)


_SMALL = (
    "A crack of .1 mm under a ratio R that is recalled: grains, closure of so small a crack, and "
    "the law of long cracks are worth a factor of 1.5 in its life.",
)
TRIALS = (
    Trial("ferrie_2006", _run_tomography, quick=False, needs=""),
    Trial("bowed_front_2003", _run_bar, quick=False, needs=""),
    Trial("factory_roof_2009", _run_block, quick=False, needs=""),
)


__all__ = ["TRIALS"]
