"""What a benchmark is: a requirement, a reference with its source, and numbers to compare."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from xcrack.base.errors import ProblemError

REQUIREMENTS: Mapping[str, str] = MappingProxyType({
    "K": "K_I and K_II of straight cracks, both tips, both signs",
    "K_curved": "K of curved cracks",
    "K_tables": "K in finite bodies",
    "K_hole": "K of cracks from holes",
    "K_fronts": "K_I, K_II and K_III along fronts",
    "K_surface": "K of surface and corner cracks",
    "T": "T-stress",
    "loads": "K under pressure on the crack faces, body forces and initial stress",
    "energy": "Displacements and stresses converge at the rate of the elements",
    "patch": "A uniform pressure across closed faces comes out exactly",
    "pressure": "Contact pressure of closed cracks converges without oscillation",
    "partial": "Partly closed cracks: K, and where contact ends",
    "sliding": "Closed cracks slide without friction: K_I = 0, and K_II",
    "stability": "The multipliers are stable: inf-sup constant",
    "junctions": "K of cracks that end on others",
    "cut": "Results do not depend on where a crack cuts the cells",
    "invariance": "Results do not depend on units, position and direction",
    "direction": "Angle at which a crack turns",
    "path": "Path of a growing crack",
    "fronts": "Shape of a growing front",
    "joins": "Cracks that join: cycles, and K of the crack that goes on",
    "life": "Cycles under constant amplitude",
    "ratio": "Cycles where the stress ratio or closure matters",
    "restart": "A run that was stopped goes on to the same result",
    "spectrum": "Cycles under variable amplitude and overloads",
    "scatter": "Lives with scatter, and chances that inspections miss",
    "opening": "Opening of crack mouths",
    "friction": "Faces that rub: stick, slip along a path of loads, energy of a cycle",
    "error_bars": "Error bars of K and of lives hold the truth",
    "residual_strength": "Residual strength: toughness and net section",
    "temperature": "Thermal stress",
    "resultants": "Resultants of bearing loads, forces and moments, and reactions",
    "measures": "Depth, lengths on surfaces and area of a crack in a body",
    "materials": "Several materials, graded ones, and cracks beside and on interfaces",
    "submodel": "K of a part whose cut sides move as the whole does",
})  # fmt: skip


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


__all__ = ["KINDS", "REQUIREMENTS", "Case", "Value"]
