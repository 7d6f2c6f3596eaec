"""Cases of the inclined crack whose faces rub."""

from benchmarks.runs import Case
from benchmarks.scenes import friction as scenes
from benchmarks.series import Scene, series, variant
from xcrack.model.numerics import Numerics, with_choices


def rubbing(quick: bool) -> list[Case]:
    """Over the cells, with other methods that keep crack faces apart and let them rub."""
    return _cases(scenes.rubbing, (11, 21) if quick else (11, 17, 29, 49, 81))


def unloading(quick: bool) -> list[Case]:
    """The same with the shear taken off again."""
    return _cases(scenes.unloading, (11, 21) if quick else (11, 17, 29, 49))


def _cases(run: Scene, sizes: tuple[int, ...]) -> list[Case]:
    cases = series(run, "default", "default", sizes)
    cases += series(run, "order 1", "setting", sizes, order=1)
    for stiffness, name in ((10.0, "penalty 10"), (None, "penalty"), (1000.0, "penalty 1000")):
        cases += variant(run, name, sizes, lips="penalty", penalty=stiffness)
    cases += variant(run, "augmented Lagrangian", sizes, lips="augmented")
    for name, lips in (("penalty, order 1", "penalty"), ("augmented, order 1", "augmented")):
        numerics = with_choices(Numerics(), {"lips": lips})
        cases += series(run, name, "setting", sizes, order=1, numerics=numerics)
    return cases
