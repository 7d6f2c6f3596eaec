"""Kinds and rules that entries about scenes share."""

from fuzz.kinds import (
    Number,
)

POSITIVE = Number(above=0)

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
