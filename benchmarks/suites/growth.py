"""Cases of whole runs: a crack that turns, and the life of an edge-cracked plate."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from benchmarks.baselines import conforming_2d, conforming_growth
from benchmarks.baselines.conforming_2d import Grading
from benchmarks.runs import Case, Outcome
from benchmarks.scenes import growth as scenes
from benchmarks.scenes.settings import Settings


def growth(quick: bool) -> list[Case]:
    """Over the cells with 15 steps, and over the steps with cells of one size."""

    def ours(s: Settings, mesh: str, steps: int, seed: int, integrator: str = "euler") -> Outcome:
        return scenes.growth(s, mesh, steps, integrator)

    def theirs(grading: Grading, steps: int, seed: int) -> Outcome:
        return conforming_growth.grown(grading, steps)

    def over(
        name: str, kind: str, sizes: tuple[int, ...], mesh: str = "uniform",
        order: int | None = None,
    ) -> list[Case]:  # fmt: skip
        steps = scenes.N_STEPS
        return [
            Case(name, kind, f"n = {n}", partial(ours, Settings(n, order=order), mesh, steps))
            for n in sizes
        ]

    cases = over("default", "default", (15, 21) if quick else (15, 21, 31, 41))
    fixed = Settings(31)
    some = (10,) if quick else (5, 10, 15, 30)
    cases += [
        Case(
            "other steps, n = 31", "steps", f"{k} steps",
            partial(_path, partial(ours, fixed, "uniform", k)),
        )
        for k in some
    ]  # fmt: skip
    cases += [
        Case(
            "second order, n = 31", "steps", f"{k} steps",
            partial(_path, partial(ours, fixed, "uniform", k, integrator="pec")),
        )
        for k in some
    ]  # fmt: skip
    if not quick:
        cases += over("cells along the path", "mesh", (21, 31, 41), "graded")
        cases += over("order 1", "setting", (31, 61), order=1)
    if conforming_2d.missing():
        return cases
    gradings = [Grading(0.02, 0.5, 0.3)]
    if not quick:
        gradings += [Grading(0.01, 0.3, 0.15), Grading(0.0025, 0.2, 0.1)]
    cases += [
        Case(
            "conforming, remeshed", "baseline", f"near {g.near:g}",
            partial(theirs, g, scenes.N_STEPS),
        )
        for g in gradings
    ]  # fmt: skip
    return cases + [
        Case(
            "conforming, other steps", "steps", f"{k} steps",
            partial(_path, partial(theirs, Grading(0.15 / k, 0.3, 0.15), k)),
        )
        for k in some
    ]  # fmt: skip


def _path(run: Callable[[int], Outcome], seed: int) -> Outcome:
    """Without the error that only runs of one step length share."""
    outcome = run(seed)
    return replace(outcome, errors={"path": outcome.errors["path"]})


def life(quick: bool) -> list[Case]:
    """Over the steps, with cells of two sizes at both orders."""
    steps = (3, 7) if quick else (3, 5, 7, 10, 14, 20)
    # name, kind, cells across the plate, order
    curves = [("default", "default", 13, None), ("order 1", "setting", 31, 1)]
    if not quick:
        curves += [
            ("finer cells, n = 25", "mesh", 25, None),
            ("order 1, finer cells, n = 61", "setting", 61, 1),
        ]
    cases = [
        Case(name, kind, f"{k} steps", partial(scenes.life, Settings(n, order=order), k))
        for name, kind, n, order in curves
        for k in steps
    ]
    if conforming_2d.missing():
        return cases
    gradings = {"conforming, remeshed": Grading(0.02, 0.3, 0.2)}
    if not quick:
        gradings["conforming, remeshed, finer"] = Grading(0.005, 0.3, 0.1)
    return cases + [
        Case(name, "baseline", f"{k} steps", partial(conforming_growth.life, grading, k))
        for name, grading in gradings.items()
        for k in steps
    ]
