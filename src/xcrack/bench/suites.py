"""Which cases make up each chart: a few for a look, all for the record."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from xcrack.bench import conforming, conforming_growth, conforming_space, scenes
from xcrack.bench.conforming import Grading
from xcrack.bench.runs import Case
from xcrack.bench.scenes import MODES, Outcome, Settings, worst
from xcrack.numerics import Numerics

# Tip of the turning growth after 15 steps: the opponent on its finest mesh (measured, see
# docs/charts.md).
TURNED = np.array([0.234958, 0.341710])

Scene = Callable[[Settings, int], Outcome]


def names(quick: bool) -> tuple[str, ...]:
    """Scenes that are run."""
    if quick:
        return ("edge", "closed")
    return ("edge", "half_closed", "closed", "growth", "penny", "penny_closed")


def cases(scene: str, quick: bool) -> list[Case]:
    """All points of the chart of a scene.

    Parameters
    ----------
    scene : str
        One of `names(False)`.
    quick : bool
        Few of them.
    """
    return {
        "edge": _edge, "half_closed": _half_closed, "closed": _closed, "growth": _growth,
        "penny": _penny, "penny_closed": _penny_closed,
    }[scene](quick)  # fmt: skip


def _series(
    run: Scene, name: str, kind: str, sizes: Sequence[int], **options: object
) -> list[Case]:
    """One curve over the mesh size."""
    made = [(n, Settings(n, **options)) for n in sizes]  # type: ignore[arg-type]
    return [Case(name, kind, f"n = {n}", partial(run, s)) for n, s in made]


def _numerics(run: Scene, name: str, sizes: Sequence[int], **choices: object) -> list[Case]:
    numerics = Numerics(**choices)  # type: ignore[arg-type]
    return _series(run, name, "setting", sizes, numerics=numerics)


def _edge(quick: bool) -> list[Case]:
    sizes = (7, 11, 17) if quick else (5, 7, 9, 13, 17, 23, 31, 41)
    some = (7, 11, 17) if quick else (7, 9, 13, 17, 23, 31)
    run = scenes.edge
    found = _series(run, "default", "default", sizes)
    found += _numerics(run, "topological", some, enrichment="topological")
    found += _numerics(run, "radius 0.25", some, radius=0.25)
    found += _numerics(run, "points 3", some, points=3)
    if not quick:
        found += _series(run, "order 1", "setting", (11, 15, 21, 31, 41, 61, 81), order=1)
        found += _numerics(run, "radius 0.55", some, radius=0.55)
        found += _numerics(run, "points 6", some, points=6)
        found += _numerics(run, "two functions", some, functions=2)
        found += _numerics(run, "vectorial functions", some, tip_basis="vectorial")
        found += _numerics(run, "domain 0.5", some, domain=0.5)
        found += _numerics(run, "domain 0.7", some, domain=0.7)
        found += _numerics(run, "patch basis", some, patch=True)
        found += _numerics(run, "not consistent", some, consistent=False)
        found += _series(run, "graded cells", "mesh", (5, 7, 9, 13, 17, 23, 31), grading=1.4)
    return found + _conforming_edge(quick)


def _conforming_edge(quick: bool) -> list[Case]:
    if conforming.missing():
        return []
    gradings = [(0.05, 0.4, 0.3), (0.01, 0.3, 0.2)]
    if not quick:
        gradings = [(0.1, 0.5, 0.4), *gradings, (1e-3, 0.3, 0.2), (1e-3, 0.2, 0.1),
                    (1e-4, 0.2, 0.1)]  # fmt: skip

    def run(near: float, growth: float, far: float, seed: int) -> Outcome:
        # Another mesh each round, as for xcrack.
        change = 1 + 0.03 * seed
        K, unknowns = conforming.edge(Grading(near, growth, far / change), MODES)
        return Outcome({"K": worst(K, MODES)}, unknowns)

    return [
        Case("conforming, remeshed", "opponent", f"near {g[0]:g}, far {g[2]:g}", partial(run, *g))
        for g in gradings
    ]


def _half_closed(quick: bool) -> list[Case]:
    sizes = (11, 17) if quick else (11, 15, 21, 29, 41, 57)
    run = scenes.half_closed
    found = _series(run, "default", "default", sizes)
    found += _series(run, "order 1", "setting", [2 * n - 1 for n in sizes], order=1)
    found += _numerics(run, "naive multipliers", sizes, multipliers="naive")
    found += _numerics(run, "start from open", sizes, initial_set="open")
    if not quick:
        found += _numerics(run, "penalty", sizes, lips="penalty")
        found += _numerics(run, "augmented Lagrangian", sizes, lips="augmented")
        found += _numerics(run, "Nitsche", sizes, lips="nitsche")
    return found + _series(run, "contact off", "off", sizes, contact="off")


def _closed(quick: bool) -> list[Case]:
    sizes = (11, 21) if quick else (11, 21, 41, 81)
    found = _series(scenes.closed, "default", "default", sizes)
    if not quick:
        found += _series(scenes.closed, "order 1", "setting", (21, 41, 81), order=1)
        found += _numerics(scenes.closed, "naive multipliers", sizes[:3], multipliers="naive")
        found += _numerics(scenes.closed, "penalty", sizes[:3], lips="penalty")
        found += _numerics(scenes.closed, "augmented Lagrangian", sizes[:3], lips="augmented")
        found += _numerics(scenes.closed, "Nitsche", sizes[:3], lips="nitsche")
    return found + _series(scenes.closed, "contact off", "off", sizes, contact="off")


def _growth(quick: bool) -> list[Case]:
    steps = 3 if quick else scenes.N_STEPS

    def ours(s: Settings, mesh: str, seed: int) -> Outcome:
        return scenes.growth(s, mesh, TURNED, steps)

    found = [
        Case("default", "default", f"n = {n}", partial(ours, Settings(n), "uniform"))
        for n in (15, 21, 31, 41)
    ]
    found += [
        Case("cells along the path", "mesh", f"n = {n}", partial(ours, Settings(n), "graded"))
        for n in (21, 31, 41)
    ]
    found += [
        Case("order 1", "setting", f"n = {n}", partial(ours, Settings(n, order=1), "uniform"))
        for n in (31, 61)
    ]
    if conforming.missing():
        return found

    def theirs(grading: Grading, seed: int) -> Outcome:
        return conforming_growth.grown(grading, TURNED, steps)

    return found + [
        Case("conforming, remeshed", "opponent", f"near {g.near:g}", partial(theirs, g))
        for g in (Grading(0.02, 0.5, 0.3), Grading(0.01, 0.3, 0.15), Grading(0.0025, 0.2, 0.1))
    ]


def _penny(quick: bool) -> list[Case]:
    sizes = (6, 8) if quick else (6, 8, 10, 13, 17)
    found = _series(scenes.penny_open, "default", "default", sizes)
    found += _series(scenes.penny_open, "order 2", "setting", (5, 6, 8), order=2)
    if not quick:
        found += _numerics(scenes.penny_open, "topological", sizes, enrichment="topological")
        found += _numerics(scenes.penny_open, "radius 0.25", sizes, radius=0.25)
        found += _numerics(scenes.penny_open, "points 3", sizes, points=3)
        found += _numerics(scenes.penny_open, "direct solver", sizes[2:4], linear="direct")
    if conforming.missing():
        return found
    gradings = [(0.2, 0.5, 0.6)] if quick else [(0.3, 0.6, 0.7), (0.2, 0.5, 0.6), (0.1, 0.4, 0.5)]
    return found + [
        Case(
            "conforming, remeshed", "opponent", f"near {g[0]:g}",
            partial(conforming_space.penny, Grading(*g)),
        )
        for g in gradings
    ]  # fmt: skip


def _penny_closed(quick: bool) -> list[Case]:
    sizes = (6, 8) if quick else (6, 8, 10, 13)
    found = _series(scenes.penny_closed, "default", "default", sizes)
    return found + _series(scenes.penny_closed, "contact off", "off", sizes, contact="off")
