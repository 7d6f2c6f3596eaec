"""What a solve keeps where errors are asked for: its factor, and the contact of all states."""

from dataclasses import dataclass, field
from typing import Any

from xcrack.contact.result import ContactSolution
from xcrack.solvers.engine import Engine
from xcrack.solvers.rigid_motion import Motion
from xcrack.xfem.model import Model


@dataclass(frozen=True, eq=False)
class Factored:
    """A system that is still factored; all states of a solve share one.

    Attributes
    ----------
    model : Model
    engine : Engine
    motion : Motion
        Rigid motions that were removed.
    contact : ContactSolution
        Of all states.
    around_tips : dict
        Points around tips with the functions there, once K has asked for them.
    """

    model: Model
    engine: Engine
    motion: Motion
    contact: ContactSolution
    around_tips: dict[Any, Any] = field(default_factory=dict)

    def __reduce__(self) -> tuple[Any, ...]:
        # A factor holds addresses: a solution in another process has none.
        return type(None), ()
