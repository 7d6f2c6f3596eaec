"""Cases of the edge crack, open and closed, and of the crack in bending."""

from collections.abc import Callable
from functools import partial

from benchmarks.baselines import conforming_2d, getfem_runs
from benchmarks.baselines.conforming_2d import Grading
from benchmarks.runs import Case, Outcome
from benchmarks.scenes import plane as scenes
from benchmarks.scenes.exact_fields import edge_fields
from benchmarks.scenes.plane import MODES, worst
from benchmarks.series import series, variant
from xcrack.verification import methods


def edge(quick: bool) -> list[Case]:
    """Over the cells, with other tip functions, domains, orders and grading, and the baselines."""
    sizes = (7, 11, 17) if quick else (5, 7, 9, 13, 17, 23, 31, 41)
    some = (7, 11, 17) if quick else (7, 9, 13, 17, 23, 31)
    run = scenes.edge
    cases = series(run, "default", "default", sizes)
    cases += variant(run, "topological", some, enrichment="topological")
    cases += variant(run, "radius 0.25", some, radius=0.25)
    cases += variant(run, "points 3", some, points=3)
    if not quick:
        cases += series(run, "order 1", "setting", (11, 15, 21, 31, 41, 61, 81), order=1)
        cases += variant(run, "radius 0.55", some, radius=0.55)
        cases += variant(run, "points 6", some, points=6)
        cases += variant(run, "two functions", some, functions=2)
        cases += variant(run, "vectorial functions", some, tip_basis=methods.modal_basis())
        cases += variant(run, "domain 0.5", some, domain=0.5)
        cases += variant(run, "domain 0.7", some, domain=0.7)
        cases += variant(run, "patch basis", some, patch=True)
        cases += variant(run, "not consistent", some, consistent=False)
        cases += series(run, "graded cells", "mesh", (5, 7, 9, 13, 17, 23, 31), grading=1.4)
    cases += _adapted(scenes.edge_adapted, quick)
    return cases + _conforming_edge(quick) + _getfem("edge", quick)


def _adapted(run: Callable[[float, int], Outcome], quick: bool) -> list[Case]:
    """A point a tolerance, its mesh being its own."""
    tolerances = (1e-2, 1e-3) if quick else (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
    return [Case("adapt", "mesh", f"to {t:g}", partial(run, t)) for t in tolerances]


def _conforming_edge(quick: bool) -> list[Case]:
    if conforming_2d.missing():
        return []
    gradings = [(0.05, 0.4, 0.3), (0.01, 0.3, 0.2)]
    if not quick:
        gradings = [(0.1, 0.5, 0.4), *gradings, (1e-3, 0.3, 0.2), (1e-3, 0.2, 0.1),
                    (1e-4, 0.2, 0.1)]  # fmt: skip

    def run(near: float, growth: float, far: float, seed: int) -> Outcome:
        # Another mesh each round, as for xcrack.
        change = 1 + 0.03 * seed
        basis, u = conforming_2d.edge_solution(Grading(near, growth, far / change), MODES)
        K, stress = conforming_2d.edge_K(basis, u), edge_fields(MODES)[1]
        return Outcome(
            {"K": worst(K, MODES)}, int(basis.N),
            later=lambda: {"energy": conforming_2d.energy_error(basis, u, stress)},
        )  # fmt: skip

    return [
        Case("conforming, remeshed", "baseline", f"near {g[0]:g}, far {g[2]:g}", partial(run, *g))
        for g in gradings
    ]


def _getfem(scene: str, quick: bool) -> list[Case]:
    # Order 2 ends before 60 k unknowns, whose factorisation alone took 13 s.
    few, all_of_them = {1: (21,), 2: (11, 21)}, {1: (11, 21, 41, 81), 2: (11, 15, 21, 29, 41)}
    return getfem_runs.cases(scene, few if quick else all_of_them)


def half_closed(quick: bool) -> list[Case]:
    """Over the cells, with other methods that keep crack faces apart."""
    sizes = (11, 17) if quick else (11, 15, 21, 29, 41, 57)
    run = scenes.half_closed
    cases = series(run, "default", "default", sizes)
    cases += series(run, "order 1", "setting", [2 * n - 1 for n in sizes], order=1)
    cases += variant(run, "naive multipliers", sizes, multipliers="naive")
    cases += variant(run, "start from open", sizes, initial_set="open")
    if not quick:
        cases += variant(run, "penalty", sizes, contact_method=methods.penalty())
        cases += variant(
            run, "augmented Lagrangian", sizes, contact_method=methods.augmented_lagrangian()
        )
        cases += variant(run, "Nitsche", sizes, contact_method=methods.nitsche())
    cases += _adapted(scenes.half_closed_adapted, quick)
    cases += _getfem("half_closed", quick)
    return cases + series(run, "contact off", "off", sizes, contact="off")


def closed(quick: bool) -> list[Case]:
    """Over the cells, with other methods that keep crack faces apart."""
    sizes = (11, 21) if quick else (11, 21, 41, 81)
    cases = series(scenes.closed, "default", "default", sizes)
    if not quick:
        cases += series(scenes.closed, "order 1", "setting", (21, 41, 81), order=1)
        cases += variant(scenes.closed, "naive multipliers", sizes[:3], multipliers="naive")
        cases += variant(scenes.closed, "penalty", sizes[:3], contact_method=methods.penalty())
        cases += variant(
            scenes.closed,
            "augmented Lagrangian",
            sizes[:3],
            contact_method=methods.augmented_lagrangian(),
        )
        cases += variant(scenes.closed, "Nitsche", sizes[:3], contact_method=methods.nitsche())
    cases += _getfem("closed", quick)
    return cases + series(scenes.closed, "contact off", "off", sizes, contact="off")
