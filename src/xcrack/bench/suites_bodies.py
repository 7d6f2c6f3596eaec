"""Which cases make up the charts of whole runs and of the bodies that gmsh meshes."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from xcrack.bench import conforming, conforming_growth, scenes_bodies, scenes_growth
from xcrack.bench.conforming import Grading
from xcrack.bench.runs import Case
from xcrack.bench.scenes import Outcome, Settings
from xcrack.bench.series import series, variant
from xcrack.scene.numerics import Numerics


def growth(quick: bool) -> list[Case]:
    """Over the cells with 15 steps, and over the steps with cells of one size."""

    def ours(s: Settings, mesh: str, steps: int, seed: int) -> Outcome:
        return scenes_growth.growth(s, mesh, steps)

    def theirs(grading: Grading, steps: int, seed: int) -> Outcome:
        return conforming_growth.grown(grading, steps)

    def over(
        name: str, kind: str, sizes: tuple[int, ...], mesh: str = "uniform",
        order: int | None = None,
    ) -> list[Case]:  # fmt: skip
        steps = scenes_growth.N_STEPS
        return [
            Case(name, kind, f"n = {n}", partial(ours, Settings(n, order=order), mesh, steps))
            for n in sizes
        ]

    found = over("default", "default", (15, 21) if quick else (15, 21, 31, 41))
    fixed = Settings(31)
    some = (10,) if quick else (5, 10, 15, 30)
    found += [
        Case(
            "other steps, n = 31", "steps", f"{k} steps",
            partial(_path, partial(ours, fixed, "uniform", k)),
        )
        for k in some
    ]  # fmt: skip
    if not quick:
        found += over("cells along the path", "mesh", (21, 31, 41), "graded")
        found += over("order 1", "setting", (31, 61), order=1)
    if conforming.missing():
        return found
    gradings = [Grading(0.02, 0.5, 0.3)]
    if not quick:
        gradings += [Grading(0.01, 0.3, 0.15), Grading(0.0025, 0.2, 0.1)]
    found += [
        Case(
            "conforming, remeshed", "opponent", f"near {g.near:g}",
            partial(theirs, g, scenes_growth.N_STEPS),
        )
        for g in gradings
    ]  # fmt: skip
    return found + [
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
    found = [
        Case(name, kind, f"{k} steps", partial(scenes_growth.life, Settings(n, order=order), k))
        for name, kind, n, order in curves
        for k in steps
    ]
    if conforming.missing():
        return found
    gradings = {"conforming, remeshed": Grading(0.02, 0.3, 0.2)}
    if not quick:
        gradings["conforming, remeshed, finer"] = Grading(0.005, 0.3, 0.1)
    return found + [
        Case(name, "opponent", f"{k} steps", partial(conforming_growth.life, grading, k))
        for name, grading in gradings.items()
        for k in steps
    ]


def hole(quick: bool) -> list[Case]:
    """Over the cells, with what else keeps lips apart."""
    sizes = (5, 8) if quick else (5, 8, 12, 18, 27)
    prepare, run = scenes_bodies.plate, scenes_bodies.hole
    found = series(run, "default", "default", sizes, prepare)
    found += series(run, "order 1", "setting", sizes, prepare, order=1)
    found += variant(run, "naive multipliers", sizes, prepare, multipliers="naive")
    if not quick:
        found += variant(run, "start from open", sizes, prepare, initial_set="open")
        found += variant(run, "penalty", sizes, prepare, lips="penalty")
        found += variant(run, "augmented Lagrangian", sizes, prepare, lips="augmented")
        found += variant(run, "Nitsche", sizes, prepare, lips="nitsche")
    return found + series(run, "contact off", "off", sizes, prepare, contact="off")


def cylinder(quick: bool) -> list[Case]:
    """Over the cells, with other tip functions and solvers."""
    sizes = (1.2, 0.9) if quick else (1.2, 0.9, 0.7, 0.55)

    def prepare(size: float) -> None:
        scenes_bodies.bar(size)
        scenes_bodies.finest()

    def over(name: str, kind: str, s: Settings, some: tuple[float, ...] = sizes) -> list[Case]:
        def run(size: float, seed: int) -> Outcome:
            return scenes_bodies.cylinder(size, s)

        return [
            Case(name, kind, f"size {size:g}", partial(run, size), partial(prepare, size))
            for size in some
        ]

    found = over("default", "default", Settings(0))
    if not quick:
        topological = Settings(0, numerics=Numerics(enrichment="topological"))
        found += over("topological", "setting", topological)
        direct = Settings(0, numerics=Numerics(linear="direct"))
        found += over("direct solver", "setting", direct, sizes[:2])
    return found + over("contact off", "off", Settings(0, contact="off"))
