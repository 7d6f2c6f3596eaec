"""The charts and their cases."""

from collections.abc import Callable

from benchmarks.runs import Case
from benchmarks.suites import bodies, friction, growth, penny, plane

_SUITES: dict[str, Callable[[bool], list[Case]]] = {
    "edge": plane.edge, "half_closed": plane.half_closed, "closed": plane.closed,
    "hole": bodies.hole, "growth": growth.growth, "life": growth.life, "penny": penny.penny,
    "penny_closed": penny.penny_closed, "cylinder": bodies.cylinder,
    "rubbing": friction.rubbing, "unloading": friction.unloading,
}  # fmt: skip
ALL = tuple(_SUITES)


def names(quick: bool) -> tuple[str, ...]:
    """Scenes that are run where none is named.

    Parameters
    ----------
    quick : bool
        Few of them.

    Returns
    -------
    tuple of str
    """
    return ("edge", "closed") if quick else ALL


def cases(scene: str, quick: bool) -> list[Case]:
    """All points of the chart of a scene.

    Parameters
    ----------
    scene : str
        One of `ALL`.
    quick : bool
        Few of them.

    Returns
    -------
    list of Case
    """
    return _SUITES[scene](quick)
