"""K that a problem is compared with: what its report asks."""

from typing import Annotated, Any

from xcrack.base.arguments import Declared, Whole
from xcrack.base.errors import ProblemError


class ReferenceK(Declared):
    """K of a crack that is known from elsewhere; among them the handbook of `xcrack.sif.handbook`.

    Attributes
    ----------
    crack : int
        Number of the crack in the problem.
    """

    crack: Annotated[int, Whole(least=0)]

    def check(self, problem: Any) -> None:
        """Raise where the problem has no such crack.

        Raises
        ------
        ProblemError
        """
        if self.crack >= len(problem.cracks):
            raise ProblemError(
                f"handbook: crack = {self.crack}: the problem has {len(problem.cracks)} crack(s), "
                "numbered from 0: give the number of one of them."
            )

    def comparison(self, solution: Any) -> str:
        """K of a solution beside this one, in words."""
        raise NotImplementedError


__all__ = ["ReferenceK"]
