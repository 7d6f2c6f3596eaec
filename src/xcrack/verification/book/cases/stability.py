"""Inf-sup constants of the multipliers: over meshes, and over the place of the cut."""

from functools import partial

from xcrack.crack.lines import line_crack
from xcrack.crack.surfaces import plane_crack
from xcrack.mesh.box import box
from xcrack.model.material import Isotropic
from xcrack.model.problem import Problem
from xcrack.verification.book.case import Case, Value
from xcrack.verification.book.scenes_2d import perturbed, rows
from xcrack.verification.methods import inf_sup

_SOURCE = "numerical inf-sup test (Chapelle and Bathe, 1993): the constant does not fall"
_MATERIAL = Isotropic(1.0, 0.3, plane="strain")


def _one_mesh(constants: dict[str, float]) -> list[Value]:
    """The first is of order one, the others do not fall below it."""
    first, *others = constants.items()
    return [
        Value(f"constant, {first[0]}", first[1], 0.5, 0.3, 1.0),
        *(
            Value(f"share that is lost, {name}", max(1 - value / first[1], 0.0), 0.0, 0.2, 1.0)
            for name, value in others
        ),
    ]


def _meshes(level: int, order: int) -> list[Value]:
    direction, normal = rows(0.37)
    crack = line_crack([0.11 * normal - 2 * direction, 0.11 * normal + 2 * direction])
    sizes = (8, 16, 32, 64)[: 2 + level]
    return _one_mesh(
        {
            f"{n} cells a side": inf_sup(Problem(perturbed(n, 11), _MATERIAL, [crack], order=order))
            for n in sizes
        }
    )


def _cuts(level: int, order: int) -> list[Value]:
    del level
    result = {}
    for share in (0.5, 0.1, 1e-2, 1e-6, 1e-12):
        y = (2 + share) / 8
        crack = line_crack([(-1.1, y), (1.1, y)])
        problem = Problem(box((-1, -1), (1, 1), 16), _MATERIAL, [crack], order=order)
        result[f"{share:g} cells from a row"] = inf_sup(problem)
    return _one_mesh(result)


def _space(level: int) -> list[Value]:
    result = {}
    for n in (4, 6, 8)[: 2 + level]:
        crack = plane_crack([(-2, -2, 0.1), (2, -2, -0.05), (2, 2, -0.05), (-2, 2, 0.1)])
        mesh = perturbed(n, 23, lower=(-1,) * 3, upper=(1,) * 3)
        result[f"{n} cells a side"] = inf_sup(Problem(mesh, Isotropic(1.0, 0.3), [crack], order=1))
    return _one_mesh(result)


CASES = (
    *(
        Case(f"inf-sup-{order}", "stability", _SOURCE, "exact", 2, order, True,
             partial(_meshes, order=order), 3)
        for order in (1, 2)
    ),
    *(
        Case(f"inf-sup-cut-{order}", "cut", _SOURCE, "exact", 2, order, True,
             partial(_cuts, order=order))
        for order in (1, 2)
    ),
    Case("inf-sup-3D", "stability", _SOURCE, "exact", 3, 1, True, _space, 2),
)  # fmt: skip


__all__ = ["CASES"]
