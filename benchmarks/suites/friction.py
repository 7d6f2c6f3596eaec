"""Cases of the inclined crack whose faces rub."""

from benchmarks.runs import Case
from benchmarks.scenes import friction as scenes
from benchmarks.series import Scene, series, variant
from xcrack.model.numerics import Numerics
from xcrack.verification import methods


def rubbing(quick: bool) -> list[Case]:
    """Over the cells, with other methods that keep crack faces apart and let them rub."""
    return _cases(scenes.rubbing, (11, 21) if quick else (11, 17, 29, 49, 81))


def unloading(quick: bool) -> list[Case]:
    """The same with the shear taken off again."""
    return _cases(scenes.unloading, (11, 21) if quick else (11, 17, 29, 49))


def _cases(run: Scene, sizes: tuple[int, ...]) -> list[Case]:
    cases = series(run, "default", "default", sizes)
    cases += series(run, "order 1", "setting", sizes, order=1)
    for stiffness, name in ((10.0, "penalty 10"), (100.0, "penalty"), (1000.0, "penalty 1000")):
        cases += variant(run, name, sizes, contact_method=methods.penalty(stiffness))
    augmented = methods.augmented_lagrangian()
    cases += variant(run, "augmented Lagrangian", sizes, contact_method=augmented)
    for name, method in (
        ("penalty, order 1", methods.penalty()),
        ("augmented, order 1", augmented),
    ):
        numerics = Numerics(contact_method=method)
        cases += series(run, name, "setting", sizes, order=1, numerics=numerics)
    return cases
