"""Which settings and meshes a chart tries: those of the user, or a handful that matter."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from math import factorial
from typing import Any

from xcrack.base.checks import call_function, entries, value_text
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.mesh.mesh import Mesh
from xcrack.model.numerics import Numerics
from xcrack.model.problem import Problem

IN_PROBLEM = ("order", "contact")  # what a setting may change in Problem; all else is the scene
_METHOD = tuple(item.name for item in fields(Numerics))
_AS_GIVEN = "as given"


@dataclass(frozen=True)
class _Share:
    """A length as a multiple of the smallest enriched radius on the same mesh."""

    factor: float


# The default domain is 2.5 radii in 2D, about one in 3D.
_DEFAULT: dict[int, dict[str, dict[str, Any]]] = {
    2: {
        "other order": {},
        "radius × 0.7": {"radius": _Share(0.7)},
        "radius × 1.4": {"radius": _Share(1.4)},
        "topological": {"enrichment": "topological"},
        "geometric": {"enrichment": "geometric"},
        "domain 1.5 radii": {"domain": _Share(1.5)},
        "2 functions": {"functions": 2},
    },
    3: {
        "other order": {},
        "radius × 0.7": {"radius": _Share(0.7)},
        "radius × 1.4": {"radius": _Share(1.4)},
        "topological": {"enrichment": "topological"},
        "geometric": {"enrichment": "geometric"},
        "domain 1.4 radii": {"domain": _Share(1.4)},
        "2 functions": {"functions": 2},
    },
}


Named = dict[str, dict[str, Any]]


def named_settings(
    settings: Any, label: str = "settings", error: type[XcrackError] = ProblemError
) -> Named:
    """Settings by name, checked; those of the problem are always among them.

    Parameters
    ----------
    settings : sequence of mappings, or mapping of name to mapping
    label : str
        Its name in a message.
    error : type of XcrackError

    Raises
    ------
    error
        Fields that are no choice of method, names that stand there twice.
    """
    if isinstance(settings, Mapping) and all(isinstance(v, Mapping) for v in settings.values()):
        pairs = [(str(name), changes) for name, changes in settings.items()]
    else:
        try:
            entries_of_list = entries(settings, label, error=error)
        except error as cause:
            example = '[{"order": 1}, {"radius": 0.2}]'
            raise error(f"{str(cause)[:-1]} of dicts, such as {example}.") from None
        pairs = [(_name(changes, label, error), changes) for changes in entries_of_list]
    if not pairs:
        raise error(f"{label} is empty: give at least one dict of fields, or leave it out.")
    settings_by_name: Named = {}
    if not any(not changes for _, changes in pairs):
        settings_by_name[_AS_GIVEN] = {}
    for name, changes in pairs:
        for field in changes:
            if not isinstance(field, str) or field not in (*IN_PROBLEM, *_METHOD):
                known_fields = ", ".join((*IN_PROBLEM, *_METHOD))
                raise error(
                    f"{label}: {value_text(field)} is no choice of method; give one of "
                    f"{known_fields}. Meshes go into meshes=, loads into states=."
                )
        if name in settings_by_name:
            raise error(f"{label}: {value_text(name)} stands there twice; leave one out.")
        settings_by_name[name] = dict(changes)
    return settings_by_name


def _name(changes: Any, label: str, error: type[XcrackError]) -> str:
    if not isinstance(changes, Mapping):
        raise error(
            f"{label}: {value_text(changes)} is no dict of fields: give some such as "
            '{"order": 1}.'
        )
    return ", ".join(f"{field} {value}" for field, value in changes.items()) or _AS_GIVEN


def default_settings(problem: Problem) -> Named:
    """Variations that may matter for a scene; without tips only the order does.

    Parameters
    ----------
    problem : Problem
    """
    settings_by_name: dict[str, dict[str, Any]] = {_AS_GIVEN: {}}
    for name, changes in _DEFAULT[problem.mesh.dim].items():
        if name == "other order":
            other = 3 - (problem.order or 1)
            settings_by_name[f"order {other}"] = {"order": other}
        elif any(crack.n_tips for crack in problem.placed) and not _is_same(problem, changes):
            settings_by_name[name] = changes
    return settings_by_name


def _is_same(problem: Problem, changes: dict[str, Any]) -> bool:
    """Whether the problem has these settings already, or no radius that they could vary."""
    method = problem.numerics
    if method.enrichment == "topological" and "enrichment" not in changes:
        return any(isinstance(value, _Share) for value in changes.values())
    return all(getattr(method, name) == value for name, value in changes.items())


def with_lengths(changes: dict[str, Any], radius: float | None) -> tuple[dict[str, Any], str]:
    """Settings with shares of the radius as lengths, and why that cannot be done.

    Parameters
    ----------
    changes : dict
    radius : float, length, or None
        Smallest enriched radius of the scene as it is, on the same mesh.
    """
    if radius is None and any(isinstance(value, _Share) for value in changes.values()):
        return {}, "there are no tip functions whose radius could be varied"
    return {
        name: value.factor * (radius or 0.0) if isinstance(value, _Share) else value
        for name, value in changes.items()
    }, ""


# --- meshes of a chart: those given, those made by a function, and how fine they are ---


def make_mesh(maker: Callable[[float], Mesh], size: float) -> Mesh:
    """A mesh of a size from a user's function."""
    mesh = call_function(maker, "the meshes of chart", size)
    if not isinstance(mesh, Mesh):
        raise ProblemError(
            f"meshes({size:.6g}) returned {type(mesh).__name__}: the function must return a Mesh "
            "whose smallest cells have this size."
        )
    return mesh


def checked_meshes(problem: Problem, meshes: Any) -> list[Mesh]:
    """The meshes that were given, if they go from coarse to fine."""
    every = list(meshes) if isinstance(meshes, Iterable) and not isinstance(meshes, str) else []
    if len(every) < 2 or not all(isinstance(mesh, Mesh) for mesh in every):
        raise ProblemError(
            "meshes: give two or more meshes from coarse to fine, or a function of the size: the "
            "error of the reference is read from the last two."
        )
    if any(mesh.dim != problem.mesh.dim for mesh in every):
        raise ProblemError(f"meshes: all must have {problem.mesh.dim} dimensions, as the problem.")
    size = [mean_size(mesh) for mesh in every]
    for k, (a, b) in enumerate(zip(size[:-1], size[1:], strict=True)):
        if b > a / 1.05:
            raise ProblemError(
                f"meshes: number {k + 1} has cells of {b:.4g} in the mean, the one before it of "
                f"{a:.4g}; give them from coarse to fine, each at least 5 % finer."
            )
    return every


def smallest(mesh: Mesh) -> float:
    """Edge of the simplex with right angles that is as large as the smallest cell.

    Unlike the longest edge it is halved by a refinement, whatever shapes the parts have.
    """
    return float((factorial(mesh.dim) * mesh.volume.min()) ** (1 / mesh.dim))


def mean_size(mesh: Mesh) -> float:
    """Edge of a cube as large as the mean cell."""
    return float(mesh.volume.mean() ** (1 / mesh.dim))


__all__ = [
    "IN_PROBLEM",
    "Named",
    "checked_meshes",
    "default_settings",
    "make_mesh",
    "mean_size",
    "named_settings",
    "smallest",
    "with_lengths",
]
