"""Published constants by name: `presets.toml` holds them, with source, units and range."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Annotated, Any

from xcrack.base.arguments import Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.fracture import forman, hartman_schijve, nasgro
from xcrack.fatigue.law import Bounds, Law, Ratio
from xcrack.fatigue.power import paris, piecewise, walker
from xcrack.fatigue.thresholds import nasgro3_threshold, nasgro4_threshold
from xcrack.fatigue.units import Units

_UNITS = 'those of length and K, such as "mm, MPa√mm"'
_LAWS: dict[str, Any] = {
    kind.__name__: kind for kind in (paris, piecewise, walker, forman, hartman_schijve, nasgro)
}


@dataclass(frozen=True)
class Preset:
    """A published set of constants.

    Attributes
    ----------
    name : str
    law : callable
        In the units of its source.
    units : str
        Length and K.
    material, environment, source : str
    checked : str
        What the constants were compared with before they were put here.
    R_range : (float, float), optional
        Ratios of the tests; other ratios are an error of the law.
    """

    name: str
    law: Law
    units: str
    material: str
    environment: str
    source: str
    checked: str
    R_range: Bounds | None = None


def presets() -> dict[str, Preset]:
    """Published constants that `law` knows, by name.

    Returns
    -------
    dict of str to Preset

    Examples
    --------
    >>> print(presets()["BS 7910 steel air mean R<0.5"].units)
    mm, N/mm^1.5
    """
    return dict(_presets())


@check_arguments()
def law(
    name: Annotated[str, Text("the name of a preset")],
    *,
    units: Annotated[str, Text(_UNITS)],
    ratio: Ratio | None = None,
) -> Any:
    """A growth law with published constants, in the units of your model.

    Parameters
    ----------
    name : str
        One of `presets`.
    units : str
        Length and K of the model, such as ``"mm, MPa√mm"``: a problem has no units, so they are
        never assumed.
    ratio : {"contact", "nominal"}, optional
        Which ΔK and R it is to get where R < 0, as of `paris`.

    Returns
    -------
    callable (dK_eq, R) -> da/dN

    Raises
    ------
    ProblemError
        No such preset, units that are not known, or whose K has the root of another length.

    Examples
    --------
    >>> rate = law("BS 7910 steel air mean R<0.5", units="m, MPa√m")
    >>> print(f"{rate(500 / 1000**0.5, 0.1) * 1000:.4g} mm")
    2.36e-05 mm
    """
    published = _presets()
    if name not in published:
        raise ProblemError(
            f"law: no preset {value_text(name)}: give one of {', '.join(map(repr, published))}."
        )
    units_of_model = Units.read(units)
    if not units_of_model.consistent:
        raise ProblemError(
            f"law: units = {value_text(units)}: K has the root of another length, which no model "
            f"has: give one length, such as m, MPa√m."
        )
    preset = published[name]
    return _in_ratio(preset.law, ratio).to(preset.units, units)


def _in_ratio(value: Any, ratio: Ratio | None) -> Any:
    return value if ratio is None else replace(value, ratio=ratio)


@cache
def _presets() -> Mapping[str, Preset]:
    text = files("xcrack.fatigue").joinpath("presets.toml").read_text(encoding="utf-8")
    return {name: _law_of_entry(name, entry) for name, entry in tomllib.loads(text).items()}


def law_of_constants(kind: str, entry: Mapping[str, Any], R_range: Bounds | None = None) -> Any:
    """A law of the constants, closure and threshold of an entry."""
    constants = dict(entry["constants"])
    if "closure" in entry:
        constants["closure"] = newman_closure(**entry["closure"])
    if "threshold3" in entry:
        constants["threshold"] = nasgro3_threshold(**entry["threshold3"])
    if "threshold4" in entry:
        constants["threshold"] = nasgro4_threshold(**entry["threshold4"])
    return _LAWS[kind](**constants, R_range=R_range)


def _law_of_entry(name: str, entry: Mapping[str, Any]) -> Preset:
    bounds = tuple(entry["R_range"]) if "R_range" in entry else None
    texts = {key: entry[key] for key in ("units", "material", "environment", "source", "checked")}
    made = law_of_constants(entry["law"], entry, bounds)
    return Preset(name, made, R_range=bounds, **texts)


__all__ = ["Preset", "law", "law_of_constants", "presets"]
