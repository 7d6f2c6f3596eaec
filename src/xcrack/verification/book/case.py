"""What a benchmark is: a requirement, a reference with its source, and numbers to compare."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from xcrack.base.errors import ProblemError
from xcrack.verification.book.requirements import REQUIREMENTS

KINDS = ("exact", "published", "program")


@dataclass(frozen=True)
class Value:
    """One number beside its reference.

    Attributes
    ----------
    name : str
    value : float
    reference : float
    tolerance : float
        Largest error that is allowed on the coarsest mesh, and so on every finer one.
    scale : float, optional
        Errors are shares of it; None: of the reference.
    rate : float, optional
        Least power of the cell size with which the error falls from the coarsest mesh to the
        finest; None: not looked at.
    """

    name: str
    value: float
    reference: float
    tolerance: float
    scale: float | None = None
    rate: float | None = None

    @property
    def error(self) -> float:
        """Share of the scale by which the value is off."""
        scale = abs(self.reference) if self.scale is None else self.scale
        return abs(self.value - self.reference) / scale


@dataclass(frozen=True)
class Case:
    """A benchmark with one modelling.

    Attributes
    ----------
    id : str
        Short and unique.
    requirement : str
        Key of `REQUIREMENTS`.
    reference : str
        What the numbers are compared with, and its source.
    kind : {"exact", "published", "program"}
        Exact solution, published table or fit, or numbers of another program.
    dim : int
        2 or 3; 0 where no body is solved.
    order : int
        Of the elements; 0 where no body is solved.
    contact : bool
        Whether crack faces touch.
    run : callable level -> sequence of Value
        Level 0 is the coarsest mesh; each further one halves the cells.
    levels : int
        How many there are; those above 0 are slow.
    quick : bool
        Whether level 0 is quick.
    needs : str
        What the case needs beside xcrack: "gmsh", or nothing.

    Raises
    ------
    ProblemError
        No such requirement or kind.
    """

    id: str
    requirement: str
    reference: str
    kind: str
    dim: int
    order: int
    contact: bool
    run: Callable[[int], Sequence[Value]]
    levels: int = 1
    quick: bool = True
    needs: str = ""

    def __post_init__(self) -> None:
        if self.requirement not in REQUIREMENTS:
            raise ProblemError(f"case {self.id}: no requirement is called {self.requirement!r}.")
        if self.kind not in KINDS:
            raise ProblemError(f"case {self.id}: kind = {self.kind!r}: give one of {KINDS}.")

    @property
    def modelling(self) -> str:
        """Dimension, order and contact in a few words: a column of the matrix."""
        if not self.dim:
            return "rule alone"
        return f"{self.dim}D, order {self.order}" + (", contact" if self.contact else "")


__all__ = ["KINDS", "Case", "Value"]
