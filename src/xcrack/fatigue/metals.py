"""Metals and laws by name: two tables hold published values, each with its document."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from importlib.resources import files
from math import sqrt
from typing import Annotated, Any

from xcrack.base.arguments import Number, Text, check_arguments
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.units import LENGTH
from xcrack.fatigue.closures import newman_closure
from xcrack.fatigue.fracture import forman, hartman_schijve, nasgro
from xcrack.fatigue.law import Bounds, Law, Ratio
from xcrack.fatigue.power import paris, piecewise, walker
from xcrack.fatigue.thresholds import nasgro3_threshold, nasgro4_threshold
from xcrack.fatigue.units import Units, factors
from xcrack.model.material import Isotropic

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
    presets = _presets()
    if name not in presets:
        raise ProblemError(
            f"law: no preset {value_text(name)}: give one of {', '.join(map(repr, presets))}."
        )
    units_of_model = Units.read(units)
    if not units_of_model.is_consistent:
        raise ProblemError(
            f"law: units = {value_text(units)}: K has the root of another length, which no model "
            f"has: give one length, such as m, MPa√m."
        )
    preset = presets[name]
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
    law_with_bounds = law_of_constants(entry["law"], entry, bounds)
    return Preset(name, law_with_bounds, R_range=bounds, **texts)


_MODEL = "give length and K of the model, such as mm, MPa√mm or in, ksi√in"


@dataclass(frozen=True)
class Metal:
    """Published values of one metal, in the units of a model.

    Attributes
    ----------
    name, units : str
    E : float, stress, or None
        Young's modulus; None, as each value, where no source was read.
    nu : float or None
    yield_stress, ultimate_stress : float, stress, or None
    K_Ic : float, stress √length, or None
        Toughness in plane strain.
    toughness : tuple of (thickness, K_c)
        Of tests of plates, thinnest first.
    laws : mapping of str to growth law
        By the name of the law, or of a preset.
    sources : mapping of str to str
        Document of each value and of each law.
    """

    name: str
    units: str
    E: float | None = None
    nu: float | None = None
    yield_stress: float | None = None
    ultimate_stress: float | None = None
    K_Ic: float | None = None
    toughness: tuple[tuple[float, float], ...] = ()
    laws: Mapping[str, Any] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)

    def isotropic(
        self,
        plane: str | None = None,
        *,
        thickness: float | None = None,
        E: float | None = None,
        nu: float | None = None,
    ) -> Isotropic:
        """The elastic material of a problem.

        Parameters
        ----------
        plane : {"strain", "stress"}, optional
            State of a 2D body; None in 3D.
        thickness : float, length, optional
            Thickness of the plate: the material then has the toughness `K_c` of it.
        E, nu : float, optional
            In place of the published value, or of one that is missing.

        Raises
        ------
        ProblemError
            No source has E or nu, and it is not given either; no toughness, as of `K_c`.
        """
        constants = {"E": self.E if E is None else E, "nu": self.nu if nu is None else nu}
        missing_names = [name for name, value in constants.items() if value is None]
        if missing_names:
            raise ProblemError(
                f"material {self.name!r}: no source with {' and '.join(missing_names)} was read: "
                f"give {', '.join(f'isotropic({name}=...)' for name in missing_names)}."
            )
        K_c = None if thickness is None else self.K_c(thickness)
        return Isotropic(**constants, plane=plane, yield_stress=self.yield_stress, K_c=K_c)  # type: ignore[arg-type]

    @check_arguments()
    def K_c(self, thickness: Annotated[float, Number(above=0, unit=LENGTH)]) -> float:
        """Toughness of a plate, stress √length.

        That of the next thicker plate tested, and K_Ic beyond them all: toughness falls with the
        thickness, so that this is on the safe side (but for sheet much thinner than any tested).

        Raises
        ------
        ProblemError
            A thickness that is not positive, or no source has such a toughness.
        """
        for tested_thickness, K_c in self.toughness:
            if thickness <= tested_thickness * (1 + 1e-9):
                return K_c
        if self.K_Ic is None:
            raise ProblemError(
                f"material {self.name!r}: no source with the toughness of a plate of "
                f"{thickness:g} was read: leave out the thickness, and give K_c where you need one."
            )
        return self.K_Ic

    def law(self, name: str | None = None, *, thickness: float | None = None) -> Any:
        """A growth law of the metal, by default the first that `laws` has.

        Parameters
        ----------
        name : str, optional
            A name in `laws`.
        thickness : float, length, optional
            Growth without bound at `K_c` of this thickness; else at that of the tests that the
            constants were fitted to. A law of Forman has its own.

        Returns
        -------
        callable (dK_eq, R) -> da/dN

        Raises
        ------
        ProblemError
            No such law, or no toughness, as of `K_c`.
        """
        if not self.laws:
            raise ProblemError(
                f"material {self.name!r}: no source with a growth law was read: give one of your "
                "own, such as xc.paris(C, m)."
            )
        law_name = next(iter(self.laws)) if name is None else name
        if not isinstance(law_name, str) or law_name not in self.laws:
            raise ProblemError(
                f"material {self.name!r}: no law {value_text(law_name)}: give one of "
                f"{', '.join(map(repr, self.laws))}."
            )
        law = self.laws[law_name]
        if thickness is None or law_name == "forman":
            return law
        return replace(law, K_c=self.K_c(thickness))

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> list[str]:
        length, K = (part.strip() for part in self.units.split(","))
        stress = K.split("√")[0].rstrip("*· ") if "√" in K else "N/mm²"
        rows = [
            (f.name, f"{getattr(self, f.name):.6g} {_unit(f.name, stress, K)}".strip(), f.name)
            for f in fields(self)
            if isinstance(getattr(self, f.name), float)
        ]
        rows += [
            (f"K_c of {t:.4g} {length}", f"{K_c:.6g} {K}", "toughness") for t, K_c in self.toughness
        ]
        rows += [(f"law {name}", _constants(law), name) for name, law in self.laws.items()]
        width = max(len(title) for title, _, _ in rows)
        documents = list(dict.fromkeys(self.sources[source] for _, _, source in rows))
        lines = [f"{self.name}, in {self.units}"]
        for title, value, source in rows:
            n = documents.index(self.sources[source]) + 1
            lines.append(f"  {title:<{width}}  {value} [{n}]")
        return lines + [f"  [{n}] {text}" for n, text in enumerate(documents, 1)]


def materials() -> list[str]:
    """Names of the metals that `material` knows.

    Returns
    -------
    list of str

    Examples
    --------
    >>> "2024-T3 sheet, L-T" in materials()
    True
    """
    return list(_data()["metals"])


@check_arguments()
def material(
    name: Annotated[str, Text("the name of a metal, see xc.materials()")],
    *,
    units: Annotated[str, Text('the units of length and K, such as "mm, MPa√mm"')],
) -> Metal:
    """Published values of a metal: stiffness, strength, toughness and growth laws, with sources.

    Parameters
    ----------
    name : str
        One of `materials`.
    units : str
        Length and K of the model, such as ``"mm, MPa√mm"``: a problem has no units, so they are
        never assumed.

    Returns
    -------
    Metal
        ``print`` shows every value with its document. None stands for what was read in no source.

    Raises
    ------
    ProblemError
        No such metal (the message names those most alike), units that are not known, or whose K
        has the root of another length.

    Notes
    -----
    These are values of documents, not of your part: a certified design needs those of its own
    batch. Growth rates of one alloy differ by a factor of two and more between documents.

    Examples
    --------
    >>> metal = material("2024-T3 sheet, L-T", units="mm, MPa√mm")
    >>> round(metal.E), round(metal.K_c(2.5))
    (72395, 2582)
    >>> steel = metal.isotropic(plane="stress", thickness=2.5)
    >>> law = metal.law("walker")
    """
    names = _data()["metals"]
    if name not in names:
        similar_names = difflib.get_close_matches(name, names, n=5, cutoff=0.4) or list(names)
        raise ProblemError(
            f"material: name = {value_text(name)} is not among those with sources: give one of "
            f"{', '.join(map(repr, similar_names))} (xc.materials() has all), or "
            f"xc.Isotropic and a law with values of your own."
        )
    target = Units.read(units)
    if not target.is_consistent:
        raise ProblemError(
            f"material: units = {value_text(units)}: K has the root of another length: {_MODEL}."
        )
    return _metal(name, names[name], units)


def _metal(name: str, entry: Mapping[str, Any], units: str) -> Metal:
    by_K, by_length = factors(entry["units"], units)
    scale = {
        "E": by_K / sqrt(by_length), "nu": 1.0, "yield_stress": by_K / sqrt(by_length),
        "ultimate_stress": by_K / sqrt(by_length), "K_Ic": by_K,
    }  # fmt: skip
    values = {key: entry[key][0] * scale[key] for key in scale if key in entry}
    sources = {key: _source(entry[key][1]) for key in scale if key in entry}
    plates = [(t * by_length, K * by_K) for t, K, _ in entry.get("K_c", ())]
    if plates:
        sources["toughness"] = _source(entry["K_c"][0][2])
    laws: dict[str, Any] = {}
    for kind, part in entry.get("laws", {}).items():
        laws[kind] = law_of_constants(kind, part).to(part["units"], units)
        sources[kind] = _source(part["source"])
    for preset in entry.get("presets", ()):
        laws[preset] = law(preset, units=units)
        sources[preset] = presets()[preset].source
    return Metal(name, units, **values, toughness=tuple(plates), laws=laws, sources=sources)


def _source(text: str) -> str:
    """The document of a short name, with the place that follows it."""
    key, _, place = text.partition(", ")
    document = _data()["sources"][key]
    if not place:
        return str(document)
    title, _, quotation = document.partition("; ")
    return f"{title}, {place}; {quotation}"


def _unit(name: str, stress: str, K: str) -> str:
    return {"nu": "", "K_Ic": K}.get(name, stress)


def _constants(law: Any) -> str:
    """The numbers of a law, in short."""
    parts = []
    for f in fields(law):
        value = getattr(law, f.name)
        if isinstance(value, float):
            parts.append(f"{f.name} {value:.4g}")
        elif f.name == "pieces":
            parts += [f"C {C:.4g} m {m:.4g}" for C, m in value]
    return ", ".join(parts)


@cache
def _data() -> Mapping[str, Any]:
    text = files("xcrack.fatigue").joinpath("metals.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


__all__ = ["Metal", "Preset", "law", "law_of_constants", "material", "materials", "presets"]
