"""Laws of growth by the materials that tips are in."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.checks import check_set_names, values_by_set
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
        pairs = values_by_set(
            self.laws, "law", "laws", "paris", "a law such as paris(...)",
            lambda law: callable(law) and not isinstance(law, LawSets),
        )  # fmt: skip
        object.__setattr__(self, "laws", pairs)
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
        check_set_names(given, names, "law", "laws", "a law")


__all__ = ["LawSets", "Names"]
