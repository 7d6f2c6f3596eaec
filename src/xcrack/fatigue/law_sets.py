"""Laws of growth by the materials that tips are in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError

Names = NDArray[np.str_]


@dataclass(frozen=True)
class LawSets:
    """Laws by the names of the cell sets that materials have; each tip grows by that of its own.

    ``grow(problem, {"plate": ..., "weld": ...}, ...)`` is short for it.

    Parameters
    ----------
    laws : mapping of str to callable

    Raises
    ------
    ProblemError
        No mapping of names to laws, or laws whose R is not meant alike.
    """

    laws: Any

    def __post_init__(self) -> None:
        given = self.laws
        pairs = given.items() if isinstance(given, Mapping) else given
        if not isinstance(given, Mapping | tuple) or not pairs:
            raise ProblemError(
                f"law: {value_text(given)}: give a mapping of cell sets to laws, such as "
                '{"plate": paris(...), "weld": paris(...)}.'
            )
        for name, law in pairs:
            if not isinstance(name, str) or not callable(law) or isinstance(law, LawSets):
                raise ProblemError(
                    f"law: {value_text(name)}: {value_text(law)}: give the name of a cell set, and "
                    "a law such as paris(...)."
                )
        object.__setattr__(self, "laws", tuple(pairs))
        ratios = {getattr(law, "ratio", None) for _, law in self.laws}
        if len(ratios) > 1:
            raise ProblemError(
                f"law: R is meant in several ways, ratio = {', '.join(sorted(map(str, ratios)))}: "
                "give all laws of a run the same."
            )

    @property
    def ratio(self) -> str | None:
        """Which R the constants belong to: the same for all."""
        return getattr(self.laws[0][1], "ratio", None)

    @property
    def knows_negative_ratios(self) -> bool:
        """Whether the answer of one of them for R < 0 depends on how R is meant."""
        return any(getattr(law, "knows_negative_ratios", False) for _, law in self.laws)

    def check(self, names: Sequence[str]) -> None:
        """Raise where the materials of a problem are others.

        Raises
        ------
        ProblemError
            A material without a law, or a law without a material.
        """
        given = [name for name, _ in self.laws]
        if sorted(given) != sorted(names):
            known = ", ".join(map(repr, names)) if names[0] else "one, without a name"
            raise ProblemError(
                f"law: there are laws for {', '.join(map(repr, given))}, and the materials of the "
                f"problem are {known}: give each of them a law."
            )


__all__ = ["LawSets", "Names"]
