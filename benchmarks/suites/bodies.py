"""Cases of the bodies that gmsh meshes: a plate with a hole, and a notched bar."""

from functools import partial

from benchmarks.runs import Case, Outcome
from benchmarks.scenes import bodies
from benchmarks.scenes.settings import Settings
from benchmarks.series import series, variant
from xcrack.model.numerics import Numerics
from xcrack.verification import methods


def hole(quick: bool) -> list[Case]:
    """Over the cells, with other methods that keep crack faces apart."""
    sizes = (5, 8) if quick else (5, 8, 12, 18, 27)
    prepare, run = bodies.plate, bodies.hole
    cases = series(run, "default", "default", sizes, prepare)
    cases += series(run, "order 1", "setting", sizes, prepare, order=1)
    cases += variant(run, "naive multipliers", sizes, prepare, multipliers="naive")
    if not quick:
        cases += variant(run, "start from open", sizes, prepare, initial_set="open")
        cases += variant(run, "penalty", sizes, prepare, contact_method=methods.penalty())
        cases += variant(
            run,
            "augmented Lagrangian",
            sizes,
            prepare,
            contact_method=methods.augmented_lagrangian(),
        )
        cases += variant(run, "Nitsche", sizes, prepare, contact_method=methods.nitsche())
    return cases + series(run, "contact off", "off", sizes, prepare, contact="off")


def cylinder(quick: bool) -> list[Case]:
    """Over the cells, with other tip functions and solvers; all of it at order 1."""
    sizes = (1.2, 0.9) if quick else (1.2, 0.9, 0.7, 0.55)

    def prepare(size: float) -> None:
        bodies.bar(size)
        bodies.finest()

    def over(name: str, kind: str, s: Settings, some: tuple[float, ...] = sizes) -> list[Case]:
        def run(size: float, seed: int) -> Outcome:
            return bodies.cylinder(size, s)

        return [
            Case(name, kind, f"size {size:g}", partial(run, size), partial(prepare, size))
            for size in some
        ]

    cases = over("default", "default", Settings(0, order=1))
    if not quick:
        topological = Settings(0, order=1, numerics=Numerics(enrichment="topological"))
        cases += over("topological", "setting", topological)
        direct = Settings(0, order=1, numerics=Numerics(linear="direct"))
        cases += over("direct solver", "setting", direct, sizes[:2])
    return cases + over("contact off", "off", Settings(0, order=1, contact="off"))
