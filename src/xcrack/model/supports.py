"""What holds a body, or moves a part of it by a given way."""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arguments import Declared, Whole, arguments_of
from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH
from xcrack.mesh.mesh import Mesh, facet_set
from xcrack.model.values import Place


class Condition(Declared):
    """What supports and loads share: a name, a place, and the dimension of their vectors."""

    where: Any  # facet set or point, of those that have one

    @property
    def place(self) -> Any:
        """Facet set or point; None for what acts everywhere."""
        return vars(self).get("where")

    @property
    def kind(self) -> str:
        """The function that it is made by."""
        return type(self).__name__

    @cached_property
    def name(self) -> str:
        """What messages and reports call it: its function and place."""
        where = self.place
        if where is None:
            return self.kind
        if isinstance(where, str):
            return f"{self.kind}({value_text(where)})"
        if np.ndim(where) == 2 and len(where) > 1:
            return f"{self.kind}({len(where)} points)"
        return f"{self.kind}({np.round(where, 6).tolist()})"

    def check_in(self, mesh: Mesh) -> None:
        """Raise where a vector has another dimension than the body, or a set is not there."""
        kind: Any = type(self)
        for name in _vectors_of(kind):
            value = getattr(self, name)
            if isinstance(value, np.ndarray | tuple):
                if np.shape(value)[-1:] != (mesh.dim,):
                    raise ProblemError(
                        f"{self.kind}: {name} = {value_text(value)} does not suit a body in "
                        f"{mesh.dim} dimensions: give {mesh.dim} numbers a row."
                    )
        if isinstance(self.place, str):
            facet_set(mesh, self.place, self.kind)


@cache
def _vectors_of(kind: Any) -> tuple[str, ...]:
    """Arguments of a condition that are vectors."""
    arguments = arguments_of(kind).items()
    return tuple(name for name, a in arguments if a.rule is not None and a.rule.is_vector)


class Support(Condition):
    """Displacements that are known on a set or at a point.

    Attributes
    ----------
    holds : bool
        Whether they are zero: then all functions that act there are, enriched ones too.
    """

    holds: ClassVar[bool] = False

    @property
    def is_uniform(self) -> bool:
        """Whether they are the same at all points."""
        return False

    def displacement_at(self, x: Floats) -> Floats:
        """Displacement at points `(n, d)`: `(n, d)`, nan in directions that stay free."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class fix(Support):  # noqa: N801 - it is used as a function
    """Hold a facet set, a point or several points, in one direction or in all.

    Parameters
    ----------
    where : str, (d,) or (k, d) array
        Name of a facet set, a point (the nearest mesh point is supported), or several points, each
        of which may also be the middle of an edge: at order 1 both ends are supported then.
    axis : int, optional
        Direction 0, 1 (, 2); all where it is left out.

    Raises
    ------
    ProblemError
        Something else than these.
    """

    where: Annotated[str | ArrayLike, Place(unit=LENGTH)]
    axis: Annotated[int | None, Whole(least=0, most=2)] = None
    holds = True
    is_uniform = True

    @cached_property
    def name(self) -> str:
        """What messages and reports call it."""
        base_name = super().name
        return base_name if self.axis is None else f"{base_name[:-1]}, axis={self.axis})"

    def check_in(self, mesh: Mesh) -> None:
        """Raise where an axis, a point or a set is not one of the body."""
        super().check_in(mesh)
        if self.axis is not None and self.axis >= mesh.dim:
            axes = " or ".join(map(str, range(mesh.dim)))
            raise ProblemError(
                f"fix: axis = {self.axis}: in {mesh.dim} dimensions axis is {axes}: give one of "
                "them."
            )

    def displacement_at(self, x: Floats) -> Floats:
        """Zero along the axis, or in all directions."""
        value = np.zeros(x.shape)
        if self.axis is not None:
            value[:, np.arange(x.shape[1]) != self.axis] = np.nan
        return value


__all__ = ["Condition", "Support", "fix"]
