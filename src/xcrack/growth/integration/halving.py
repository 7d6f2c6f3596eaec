"""Where along a way something begins, between two lengths that are halved."""

from collections.abc import Callable


def halved(holds: Callable[[float], bool], most: float, times: int = 40) -> tuple[float, float]:
    """Lengths between which a condition ceases to hold, in [0, most].

    Parameters
    ----------
    holds : callable length -> bool
        True at 0, false at `most`.
    most : float
    times : int
        The two lengths are most / 2^times apart.

    Returns
    -------
    low, high : float
        It holds at `low`, or low is 0; not at `high`, or high is `most`.
    """
    low, high = 0.0, most
    for _ in range(times):
        middle = 0.5 * (low + high)
        if holds(middle):
            low = middle
        else:
            high = middle
    return low, high


__all__ = ["halved"]
