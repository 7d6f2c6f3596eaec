"""What a run was asked to do, as text that can be stored and compared.

Fields of xcrack's own dataclasses are left out where they have their default, so that a field added
later leaves the description of an older run as it was. The number of the set of defaults stands for
all that was left out.
"""

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

from xcrack.growth.steps.description import Description, default_of, is_equal

_FUNCTION = re.compile(r"([\w.<>]+ )?sha256:[0-9a-f]{16}")

# Number of the set of defaults: raised whenever a changed default changes results.
DEFAULTS = 3
# For each set from 2 on, the defaults that it replaced: {2: {"problem.numerics.points": 4}}.
REPLACED: dict[int, dict[str, Any]] = {
    2: {"integrator": "euler"},
    3: {"problem.numerics.multipliers": "sparse"},
}

Settings = TypeVar("Settings")


def describe(name: str, value: Any, number: int | None = None) -> dict[str, str]:
    """Flat description of a value: the same text for the same settings, in any process.

    Arrays and long containers are described by a hash; functions of xcrack and of other packages
    by their name; functions of the user by their code and by all that they read: helpers,
    constants, lists, dicts and objects of the script, what they close over. Dataclasses are
    described field by field, other objects by what a copy would be made from, and by the code of
    their class if it is the user's. Fields whose metadata say ``changes_results=False`` are never
    described.

    Parameters
    ----------
    name : str
        Prefix of the keys; empty for a dataclass whose fields need none.
    value : anything
    number : int, optional
        Set of defaults whose values are left out; today's if omitted.

    Returns
    -------
    dict of str to str

    Examples
    --------
    >>> describe("da", 0.5)
    {'da': '0.5'}
    """
    description = Description(defaults_of(DEFAULTS if number is None else number))
    description.add(name, value)
    return description.lines


def defaults_of(number: int) -> dict[str, Any]:
    """Defaults of a set that are others today, by the key of their field."""
    values: dict[str, Any] = {}
    for later in range(DEFAULTS, number, -1):
        values |= REPLACED.get(later, {})
    return values


def with_defaults_of(settings: Settings, number: int, stored: Mapping[str, str]) -> Settings:
    """Settings in which fields left at today's default have that of an earlier set.

    Parameters
    ----------
    settings : dataclass
    number : int
        The earlier set.
    stored : mapping of str to str
        Description of the run that was begun with that set: a field it names was not left out.
    """
    for key, value in defaults_of(number).items():
        if key not in stored:
            path = key.split(".")
            settings = _with_field(settings, path, value)
    return settings


def _with_field(owner: Any, path: list[str], value: Any) -> Any:
    name, inner = path[0], path[1:]
    old = getattr(owner, name)
    if inner:
        return replace(owner, **{name: _with_field(old, inner, value)})
    field = next(f for f in fields(owner) if f.name == name)
    if not is_equal(old, default_of(owner, field)):
        return owner  # given, not left out
    return replace(owner, **{name: value(owner) if callable(value) else value})


def differences(stored: Mapping[str, str], given: Mapping[str, str]) -> list[str]:
    """One line for each key in which two descriptions differ."""
    return [
        f"{key}: stored {_text(stored, key)}, given {_text(given, key)}"
        for key in sorted({*stored, *given})
        if stored.get(key) != given.get(key)
    ]


def only_compiled_differently(stored: Mapping[str, str], given: Mapping[str, str]) -> list[str]:
    """Keys of functions whose code differs and whose name does not, as by another python."""
    names = {
        key: [_FUNCTION.fullmatch(text) for text in (stored[key], given[key])]
        for key in sorted({*stored} & {*given})
        if stored[key] != given[key]
    }
    return [key for key, (one, other) in names.items() if one and other and one[1] == other[1]]


def _text(settings: Mapping[str, str], key: str) -> str:
    owner = key.rpartition(".")[0]
    return settings.get(key, "the default" if not owner or owner in settings else "nothing")


__all__ = [
    "DEFAULTS",
    "REPLACED",
    "defaults_of",
    "describe",
    "differences",
    "only_compiled_differently",
    "with_defaults_of",
]
