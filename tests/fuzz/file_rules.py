"""Kinds and rules that entries share."""

from fuzz.entry import arg
from fuzz.kinds import (
    SKIP,
    Filename,
    Flag,
)
from fuzz.values import paths

PICTURE = arg(
    Filename(optional=True, endings=(".png", ".pdf", ".svg", ".jpg")),
    "good.png",
    near=paths(".png", ".png"),
    words=["picture"],
)


class Shown(Flag):
    """A flag that must not open a window here."""

    def _own(self, value):
        return SKIP if value is True or value is None else super()._own(value)

    def verdict(self, value):
        return self._own(value)


WINDOW = arg(Shown(), False)
