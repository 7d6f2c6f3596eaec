"""Parts of facet sets: those in a box, or where a function says so."""

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import Part, Text, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints, at
from xcrack.base.checks import call_function, numbers, value_text
from xcrack.base.errors import MeshError, ProblemError, warn
from xcrack.mesh.mesh import Mesh, facet_set, sound_mesh

Where = Callable[[Floats], Any] | Sequence[Any]
_ENDS = 0.02  # share of a set by which its ends may be off without a word
_SAMPLES = 12  # points along an edge that tell how much of a facet is meant


@check_arguments(MeshError)
def part(
    mesh: Annotated[Mesh, Part(Mesh)],
    of: Annotated[str, Text("the name of a facet set")],
    where: Where,
    name: Annotated[str, Text("a name", may_be_empty=True)] = "",
) -> Mesh:
    """The mesh with one more facet set: a part of one that it has.

    Parameters
    ----------
    mesh : Mesh
    of : str
        Name of a facet set, ``"boundary"`` too.
    where : callable, or two corners of a box, length
        ``f(x) -> (n,) bool`` for points x (n, d); or ``(lower, upper)``, whose entries may be None
        where the box has no end. A facet belongs to the part if its middle does.
    name : str
        Of the new set; ``part of <of>`` if left out.

    Returns
    -------
    Mesh
        A warning tells where the ends of the part lie within facets, so that the set is longer or
        shorter than what was asked for: a finer mesh, or points of the mesh there, mend it. `plate`
        puts points there by itself.

    Raises
    ------
    MeshError
        No such set, a name that is taken, a part without facets, a function that returns something
        else.

    Examples
    --------
    >>> from xcrack.mesh.box import box
    >>> mesh = part(box((0, 0), (4, 1), (8, 2)), "top", ((0, None), (1, None)), "seat")
    >>> len(mesh.facet_sets["seat"])
    2
    """
    name = name or f"part of {of}"
    if name in mesh.facet_sets:
        raise MeshError(f"part: the mesh has a facet set {name!r} already: give another name.")
    try:
        facets = facet_set(mesh, of, "part")
    except ProblemError as error:
        raise MeshError(str(error)) from None
    part_facets = chosen_facets(mesh.points, facets, where, f"part {name!r}")
    facet_sets = {n: f for n, f in mesh.facet_sets.items() if n != "boundary"}
    return sound_mesh(
        mesh.points, mesh.cells, {**facet_sets, name: part_facets}, mesh.cell_sets, mesh.curves
    )


def chosen_facets(points: Floats, facets: Ints, where: Where, label: str) -> Ints:
    """Facets whose middle is in a box, or where a function says so.

    Raises
    ------
    MeshError
        There are none, or `where` is something else.
    """
    is_inside = selector(where, points.shape[1], label)
    middle = points[facets].mean(axis=1)
    is_chosen = is_inside(middle)
    if not is_chosen.any():
        raise MeshError(
            f"{label} has no facets: the middles of the {len(facets)} facets reach from "
            f"{at(middle.min(axis=0))} to {at(middle.max(axis=0))}: choose some of them."
        )
    size = _sizes(points[facets])
    shares = _shares(points.shape[1])
    samples = [np.einsum("b,kbd->kd", share, points[facets]) for share in shares]
    area = sum(float(size @ is_inside(x)) for x in samples) / len(shares)
    facet_area = float(size[is_chosen].sum())
    if abs(facet_area - area) > _ENDS * facet_area:
        warn(
            f"{label} has facets of {facet_area:.4g} in all, where {area:.4g} lie within what was "
            "asked for: its ends lie within facets. Refine the mesh there, or put points of the "
            "mesh at the ends."
        )
    return facets[is_chosen]


def selector(where: Where, dim: int, label: str) -> Callable[[Floats], Bools]:
    """A function of points by a box or a user's function, checked."""
    if callable(where):
        return lambda x: _values_at(where, x, label)
    low_corner, high_corner = box_of(where, dim, label)
    ends = np.concatenate([low_corner, high_corner])
    reach = 1e-9 * np.abs(ends[np.isfinite(ends)]).max(initial=0.0)  # a box may be flat
    low_corner, high_corner = low_corner - reach, high_corner + reach
    return lambda x: np.asarray(((x >= low_corner) & (x <= high_corner)).all(axis=1))


def box_of(where: Any, dim: int, label: str) -> tuple[Floats, Floats]:
    """Corners of a box, infinite where it has no end.

    Raises
    ------
    MeshError
        Something else than two corners, or a box that is inside out.
    """
    try:
        corners = [list(corner) for corner in where]
    except TypeError:
        corners = []
    if len(corners) != 2 or any(len(corner) != dim for corner in corners):
        raise MeshError(
            f"{label}: {value_text(where)}: give a function f(x) -> bools, or two corners of "
            f"{dim} numbers each, None where the box has no end."
        )
    padded = [[0.0 if v is None else v for v in corner] for corner in corners]
    rows = numbers(padded, f"{label}: corners of the box", (2, dim), error=MeshError)
    is_open = np.array([[v is None for v in corner] for corner in corners])
    low_corner, high_corner = np.where(is_open, [[-np.inf], [np.inf]], rows)
    if (low_corner > high_corner).any():
        raise MeshError(
            f"{label}: the box from {low_corner.tolist()} to {high_corner.tolist()} is inside out: "
            "swap them."
        )
    return low_corner, high_corner


def _values_at(function: Callable[[Floats], Any], x: Floats, label: str) -> Bools:
    result = call_function(function, f"the choice of {label}", x.copy())
    try:
        is_inside = np.asarray(result)
    except Exception as error:  # ragged rows, or what an object's own __array__ raises
        raise MeshError(
            f"{label}: the function returned {value_text(result)}: return one bool for each point."
        ) from error
    if is_inside.shape != (len(x),) or is_inside.dtype != bool:
        raise MeshError(
            f"{label}: the function returned shape {is_inside.shape} of {is_inside.dtype} for "
            f"{len(x)} points: return one bool for each."
        )
    return is_inside


def _sizes(corners: Floats) -> Floats:
    """Length or area of facets `(k, d, d)`."""
    edges = corners[:, 1:] - corners[:, :1]
    if edges.shape[1] == 1:
        return np.asarray(np.linalg.norm(edges[:, 0], axis=1))
    return np.asarray(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2)


def _shares(dim: int) -> Floats:
    """Barycentric coordinates of points that stand for equal parts of a facet."""
    s = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    if dim == 2:
        return np.stack([1 - s, s], axis=1)
    a, b = (v.ravel() for v in np.meshgrid(s, s))
    is_inside = a + b < 1
    return np.stack([1 - a - b, a, b], axis=1)[is_inside]


__all__ = ["Where", "box_of", "chosen_facets", "part"]
