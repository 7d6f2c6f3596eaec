"""What moves a path among holes: docs/validation.md against tests and other programs."""

import numpy as np
import pytest

pytest.importorskip("gmsh")

from benchmarks.paths_among_holes import (
    CAUSES,
    REACH,
    experiment,
    from_test,
    nominal,
    path_of,
    shift,
    turned_over,
)

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("letter", ["a", "b"])
def test_one_length_of_turning_brings_both_paths_to_the_tests(letter):
    """Bounds of discretisation: .16 and .11 mm measured, where the hoop stress is .6 and .34."""
    assert from_test(letter, turned_over(letter)) < 0.2 < from_test(letter, nominal(letter))


def rms_distance(points, path):
    """Root mean square of the distances of points to a polyline."""
    begin, along = path[:-1], np.diff(path, axis=0)
    share = ((points[:, None] - begin) * along).sum(axis=2) / (along**2).sum(axis=1)
    nearest = begin + np.clip(share, 0, 1)[..., None] * along
    return np.sqrt((np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1) ** 2).mean())


def test_steps_of_euler_are_the_paths_of_other_programs():
    path = path_of("b", da=0.5, integrator="euler")
    for other in (each for each in experiment("b").others if "path" in each):
        points = np.array(other["path"])
        points = points[(points[:, 0] > 9) & (points[:, 0] < REACH["b"])]
        away = rms_distance(points, path)
        print(f"{other['program']}: {away:.3f} mm")
        assert away < 0.05 < 0.1 < rms_distance(points, nominal("b"))


@pytest.mark.parametrize(
    ("cause", "least", "most"),
    [
        ("largest energy release rate", 0.0, 0.01),
        ("least strain energy density", 0.0, 0.01),
        ("pins that rub, coefficient .15", 0.15, 0.3),
    ],
)
def test_criteria_move_no_path_and_pins_that_rub_do(cause, least, most):
    assert least <= shift("a", CAUSES[cause]("a")) <= most
