"""Warnings of a run: each kind when it comes first, and one summary of those that came again."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from xcrack.errors import XcrackWarning, collected_warnings, warn

_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", re.IGNORECASE)
_SEVERAL = re.compile(r"#(,? #)+")


@dataclass
class Kind:
    """What became of one kind of warning: messages alike but for their numbers."""

    first: int
    steps: int
    last: int
    message: str


@dataclass
class Notices:
    """Warnings of a run by their kind; the one value of a run that changes."""

    kinds: dict[str, Kind] = field(default_factory=dict)
    n_steps: int = 0

    @contextmanager
    def watch(self, step: int) -> Iterator[list[str]]:
        """Issue what is new of the warnings within a block, count the rest, and list them all."""
        messages: list[str] = []
        try:
            with collected_warnings(messages):
                yield messages
        finally:
            self.n_steps += 1
            for message in dict.fromkeys(messages):
                self._add(message, step)

    def _add(self, message: str, step: int) -> None:
        key = _SEVERAL.sub("#", _NUMBER.sub("#", message))
        kind = self.kinds.setdefault(key, Kind(step, 1, step, message))
        if kind.last != step:
            self.kinds[key] = Kind(kind.first, kind.steps + 1, step, message)
        if kind.first == step:
            warn(message)

    def summarise(self) -> None:
        """Issue one warning for all kinds that came in more than one step, and are not ignored."""
        several = (kind for kind in self.kinds.values() if kind.steps > 1)
        again = [kind for kind in several if not _is_ignored(kind.message)]
        self.kinds = {}
        if not again:
            return
        lines = [
            f"in {kind.steps} of {self.n_steps} steps, from step {kind.first} to {kind.last}, "
            f"where it was: {kind.message}"
            for kind in again
        ]
        warn(
            "during growth warnings came again; the columns spread and domain_cells of "
            "history.table() show each step.\n- " + "\n- ".join(lines)
        )


def _is_ignored(message: str) -> bool:
    """Whether the user's filters ignore a warning of this text: the summary begins with another."""
    for action, text, category, module, _ in warnings.filters:
        fits = text is None or re.match(text, message) is not None
        if fits and module is None and issubclass(XcrackWarning, category):
            return action == "ignore"
    return False


__all__ = ["Notices"]
