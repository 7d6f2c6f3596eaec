"""Which cases make up each chart: a few for a look, all for the record."""

from functools import partial

from xcrack.bench import conforming, conforming_space, getfem_runs, scenes, suites_bodies
from xcrack.bench.conforming import Grading
from xcrack.bench.fields import edge_fields
from xcrack.bench.runs import Case
from xcrack.bench.scenes import MODES, Outcome, worst
from xcrack.bench.series import series, variant

ALL = (
    "edge", "half_closed", "closed", "hole", "growth", "life", "penny", "penny_closed", "cylinder",
)  # fmt: skip


def names(quick: bool) -> tuple[str, ...]:
    """Scenes that are run."""
    if quick:
        return ("edge", "closed")
    return ALL


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
        "edge": _edge, "half_closed": _half_closed, "closed": _closed,
        "hole": suites_bodies.hole, "growth": suites_bodies.growth, "life": suites_bodies.life,
        "penny": _penny, "penny_closed": _penny_closed, "cylinder": suites_bodies.cylinder,
    }[scene](quick)  # fmt: skip


def _edge(quick: bool) -> list[Case]:
    sizes = (7, 11, 17) if quick else (5, 7, 9, 13, 17, 23, 31, 41)
    some = (7, 11, 17) if quick else (7, 9, 13, 17, 23, 31)
    run = scenes.edge
    found = series(run, "default", "default", sizes)
    found += variant(run, "topological", some, enrichment="topological")
    found += variant(run, "radius 0.25", some, radius=0.25)
    found += variant(run, "points 3", some, points=3)
    if not quick:
        found += series(run, "order 1", "setting", (11, 15, 21, 31, 41, 61, 81), order=1)
        found += variant(run, "radius 0.55", some, radius=0.55)
        found += variant(run, "points 6", some, points=6)
        found += variant(run, "two functions", some, functions=2)
        found += variant(run, "vectorial functions", some, tip_basis="vectorial")
        found += variant(run, "domain 0.5", some, domain=0.5)
        found += variant(run, "domain 0.7", some, domain=0.7)
        found += variant(run, "patch basis", some, patch=True)
        found += variant(run, "not consistent", some, consistent=False)
        found += series(run, "graded cells", "mesh", (5, 7, 9, 13, 17, 23, 31), grading=1.4)
    return found + _conforming_edge(quick) + _getfem("edge", quick)


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
        basis, u = conforming.edge_solution(Grading(near, growth, far / change), MODES)
        K, stress = conforming.edge_K(basis, u), edge_fields(MODES)[1]
        return Outcome(
            {"K": worst(K, MODES)}, int(basis.N),
            later=lambda: {"energy": conforming.energy_error(basis, u, stress)},
        )  # fmt: skip

    return [
        Case("conforming, remeshed", "opponent", f"near {g[0]:g}, far {g[2]:g}", partial(run, *g))
        for g in gradings
    ]


def _getfem(scene: str, quick: bool) -> list[Case]:
    # Order 2 ends before 60 k unknowns, whose factorisation alone took 13 s.
    few, all_of_them = {1: (21,), 2: (11, 21)}, {1: (11, 21, 41, 81), 2: (11, 15, 21, 29, 41)}
    return getfem_runs.cases(scene, few if quick else all_of_them)


def _half_closed(quick: bool) -> list[Case]:
    sizes = (11, 17) if quick else (11, 15, 21, 29, 41, 57)
    run = scenes.half_closed
    found = series(run, "default", "default", sizes)
    found += series(run, "order 1", "setting", [2 * n - 1 for n in sizes], order=1)
    found += variant(run, "naive multipliers", sizes, multipliers="naive")
    found += variant(run, "start from open", sizes, initial_set="open")
    if not quick:
        found += variant(run, "penalty", sizes, lips="penalty")
        found += variant(run, "augmented Lagrangian", sizes, lips="augmented")
        found += variant(run, "Nitsche", sizes, lips="nitsche")
    found += _getfem("half_closed", quick)
    return found + series(run, "contact off", "off", sizes, contact="off")


def _closed(quick: bool) -> list[Case]:
    sizes = (11, 21) if quick else (11, 21, 41, 81)
    found = series(scenes.closed, "default", "default", sizes)
    if not quick:
        found += series(scenes.closed, "order 1", "setting", (21, 41, 81), order=1)
        found += variant(scenes.closed, "naive multipliers", sizes[:3], multipliers="naive")
        found += variant(scenes.closed, "penalty", sizes[:3], lips="penalty")
        found += variant(scenes.closed, "augmented Lagrangian", sizes[:3], lips="augmented")
        found += variant(scenes.closed, "Nitsche", sizes[:3], lips="nitsche")
    found += _getfem("closed", quick)
    return found + series(scenes.closed, "contact off", "off", sizes, contact="off")


def _penny(quick: bool) -> list[Case]:
    sizes = (6, 8) if quick else (6, 8, 10, 13, 17)
    fine, quadratic = ((), (5, 6, 8)) if quick else ((22, 29), (5, 6, 8, 10, 13, 17))
    found = series(scenes.penny_open, "default", "default", (*sizes, *fine))
    found += series(scenes.penny_open, "order 2", "setting", quadratic, order=2)
    if not quick:
        found += variant(scenes.penny_open, "topological", sizes, enrichment="topological")
        found += variant(scenes.penny_open, "radius 0.25", sizes, radius=0.25)
        found += variant(scenes.penny_open, "points 3", sizes, points=3)
        found += variant(scenes.penny_open, "direct solver", sizes[2:4], linear="direct")
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
    found = series(scenes.penny_closed, "default", "default", sizes)
    return found + series(scenes.penny_closed, "contact off", "off", sizes, contact="off")
