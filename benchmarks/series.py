"""Curves of a chart: one method over the size of the mesh."""

from collections.abc import Callable, Sequence
from functools import partial

from benchmarks.runs import Case, Outcome
from benchmarks.scenes.settings import Settings
from xcrack.model.numerics import Numerics

Scene = Callable[[Settings, int], Outcome]


def series(
    run: Scene, name: str, kind: str, sizes: Sequence[int],
    prepare: Callable[[int], object] | None = None, **options: object,
) -> list[Case]:  # fmt: skip
    """One curve over the mesh size.

    Parameters
    ----------
    run : callable (Settings, seed) -> Outcome
    name, kind : str
        Of the curve, as in `Case`.
    sizes : sequence of int
    prepare : callable (n), optional
        What is not timed.
    **options
        Of `Settings`.
    """
    made = [(n, Settings(n, **options)) for n in sizes]  # type: ignore[arg-type]
    return [
        Case(name, kind, f"n = {n}", partial(run, s), prepare and partial(prepare, n))
        for n, s in made
    ]


def variant(
    run: Scene, name: str, sizes: Sequence[int],
    prepare: Callable[[int], object] | None = None, **choices: object,
) -> list[Case]:  # fmt: skip
    """The curve of other choices of method than the defaults."""
    numerics = Numerics(**choices)  # type: ignore[arg-type]
    return series(run, name, "setting", sizes, prepare, numerics=numerics)
