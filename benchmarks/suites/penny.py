"""Cases of the penny, open and closed."""

from functools import partial

from benchmarks.baselines import conforming_2d, conforming_3d
from benchmarks.baselines.conforming_2d import Grading
from benchmarks.runs import Case
from benchmarks.scenes import penny as scenes
from benchmarks.series import series
from xcrack.model.numerics import Numerics


def penny(quick: bool) -> list[Case]:
    """Over the cells at both orders, with other tip functions and solvers."""
    sizes = (6, 8) if quick else (6, 8, 10, 13, 17)
    fine, quadratic = ((), (5, 6)) if quick else ((22, 29), (5, 6, 8, 10, 13, 17))
    cases = series(scenes.penny_open, "default", "default", quadratic)
    cases += series(scenes.penny_open, "order 1", "setting", (*sizes, *fine), order=1)
    if not quick:  # at order 1
        for name, some, choices in (
            ("topological", sizes, {"enrichment": "topological"}),
            ("radius 0.25", sizes, {"radius": 0.25}),
            ("points 3", sizes, {"points": 3}),
            ("direct solver", sizes[2:4], {"linear": "direct"}),
        ):
            method = Numerics(**choices)  # type: ignore[arg-type]
            cases += series(scenes.penny_open, name, "setting", some, order=1, numerics=method)
    if conforming_2d.missing():
        return cases
    gradings = [(0.2, 0.5, 0.6)] if quick else [(0.3, 0.6, 0.7), (0.2, 0.5, 0.6), (0.1, 0.4, 0.5)]
    return cases + [
        Case(
            "conforming, remeshed", "baseline", f"near {g[0]:g}",
            partial(conforming_3d.penny, Grading(*g)),
        )
        for g in gradings
    ]  # fmt: skip


def penny_closed(quick: bool) -> list[Case]:
    """Over the cells, with contact and without."""
    sizes, linear = ((6, 8), ()) if quick else ((5, 6, 8, 10), (6, 8, 10, 13))
    cases = series(scenes.penny_closed, "default", "default", sizes)
    cases += series(scenes.penny_closed, "order 1", "setting", linear, order=1)
    return cases + series(scenes.penny_closed, "contact off", "off", sizes, contact="off")
