"""Kinds and rules that entries about results share."""

import numpy as np

from fuzz import scenes
from fuzz.entry import arg
from fuzz.kinds import (
    Number,
    Numbers,
    Of,
    Seen,
)

LOAD = Of(type=type(scenes.PULL[0]))

NU = Number(above=-1, below=0.5)

K_OF_STATES = [[[1.0, 0.2]], [[0.1, 0.0]]]

K_IN_SPACE = np.random.default_rng(3317).uniform(0.1, 1.0, (2, 4, 3))


def of_states(x):
    """Whether an array is K of states and places."""
    return x.ndim == 3 and x.shape[-1] in (2, 3) and len(x) > 0


def fits(shape=()):
    """Rule of an array that is to go with another of a shape."""

    def rule(x):
        try:
            np.broadcast_shapes(x.shape, shape)
        except ValueError:
            return False
        return True

    return rule


K = arg(
    Numbers(None, rule=of_states),
    K_OF_STATES,
    K_IN_SPACE,
    near={
        "negative": lambda: -np.array(K_IN_SPACE),
        "no place": lambda: np.zeros((2, 0, 2)),
        "one state": lambda: [[[1.0, 0.0]]],
        "zero": lambda: np.zeros((2, 3, 2)),
    },
)

NOTHING = Seen(rule=lambda v: False)
