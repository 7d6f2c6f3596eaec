"""What came of a test: predicted beside measured, as numbers and curves that can be stored."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import inf, nan
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from xcrack.base.arrays import Floats

Role = Literal["body", "measured", "predicted", "bar", "variant", "other"]
Measure = Literal["ratio", "difference", "distance", "number"]


@dataclass(frozen=True)
class Comparison:
    """One predicted number beside the measured one.

    Attributes
    ----------
    name : str
    predicted, measured : float
        Of a distance between paths `measured` is 0.
    measure : {"ratio", "difference", "distance", "number"}
        What `value` is: predicted over measured, predicted minus measured, or predicted alone.
    unit : str
    least, most : float
        Bounds of `value` that the tests of xcrack hold it to; infinite: reported only.
    """

    name: str
    predicted: float
    measured: float = 0.0
    measure: Measure = "distance"
    unit: str = ""
    least: float = -inf
    most: float = inf

    @property
    def value(self) -> float:
        """What is judged."""
        if self.measure == "ratio":
            return self.predicted / self.measured
        return self.predicted - self.measured if self.measure == "difference" else self.predicted

    @property
    def is_asserted(self) -> bool:
        """Whether there is a bound."""
        return bool(self.least > -inf or self.most < inf)

    @property
    def passed(self) -> bool:
        """Whether the value lies within its bounds; nan does not."""
        return bool(self.least <= self.value <= self.most) or not self.is_asserted


@dataclass(frozen=True)
class Curve:
    """A line or points of a picture.

    Attributes
    ----------
    name : str
        For the legend; empty: none.
    points : tuple of (float, float)
    role : str
        What it is: it decides how it is drawn.
    """

    name: str
    points: tuple[tuple[float, float], ...]
    role: Role

    @classmethod
    def of(cls, name: str, points: ArrayLike, role: Role) -> "Curve":
        """From an (n, 2) array."""
        rows = np.asarray(points, dtype=float).reshape(-1, 2)
        return cls(name, tuple((round(float(x), 6), round(float(y), 6)) for x, y in rows), role)


@dataclass(frozen=True)
class Picture:
    """Curves in one frame.

    Attributes
    ----------
    words : str
        What it shows.
    x, y : str
        Names of the axes, with units.
    curves : tuple of Curve
    is_to_scale : bool
        Both axes are lengths.
    """

    words: str
    x: str
    y: str
    curves: tuple[Curve, ...]
    is_to_scale: bool = False


@dataclass(frozen=True)
class Outcome:
    """What came of a test.

    Attributes
    ----------
    name : str
        Of the trial.
    experiments : tuple of str
        Names of the tests it is compared with.
    comparisons : tuple of Comparison
    pictures : tuple of Picture
    words : tuple of str
        What the comparison says, what does not fit and why it may not.
    quick : bool
    seconds : float
        Of one processor.
    skipped, error : str
        Why it was not run, or not to its end; else empty.
    warnings : tuple of str
    """

    name: str
    experiments: tuple[str, ...]
    comparisons: tuple[Comparison, ...] = ()
    pictures: tuple[Picture, ...] = ()
    words: tuple[str, ...] = ()
    quick: bool = False
    seconds: float = nan
    skipped: str = ""
    error: str = ""
    warnings: tuple[str, ...] = field(default=())

    @property
    def status(self) -> str:
        """One word: agrees, differs, reported, skipped or failed."""
        if self.skipped or self.error:
            return "skipped" if self.skipped else "failed"
        if not all(each.passed for each in self.comparisons):
            return "differs"
        return "agrees" if any(each.is_asserted for each in self.comparisons) else "reported"

    def find(self, name: str) -> Comparison:
        """The comparison of a name."""
        return next(each for each in self.comparisons if each.name == name)

    def to_json(self) -> str:
        """All of it as text, which `from_json` reads."""
        return json.dumps(asdict(self), ensure_ascii=False, indent=1)

    @classmethod
    def from_json(cls, text: str) -> "Outcome":
        """Read what `to_json` wrote.

        Raises
        ------
        ValueError, KeyError, TypeError
            Something else.
        """
        content: dict[str, Any] = json.loads(text)
        content["comparisons"] = tuple(Comparison(**each) for each in content["comparisons"])
        content["pictures"] = tuple(_picture(each) for each in content["pictures"])
        for key in ("experiments", "words", "warnings"):
            content[key] = tuple(content[key])
        return cls(**content)


def _picture(content: Mapping[str, Any]) -> Picture:
    curves = tuple(
        Curve(each["name"], tuple((x, y) for x, y in each["points"]), each["role"])
        for each in content["curves"]
    )
    return Picture(**{**content, "curves": curves})


def distances(points: Floats, path: Floats) -> Floats:
    """Distance of points (n, 2) from a polyline (k, 2): (n,)."""
    begin, leg = path[:-1], np.diff(path, axis=0)
    offset = points[:, None] - begin
    length = np.maximum((leg**2).sum(axis=1), 1e-300)
    share = np.clip((offset * leg).sum(axis=2) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[..., None] * leg, axis=2).min(axis=1))


def rms(values: Floats) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def path_comparisons(
    measured_path: Floats,
    path: Floats,
    *,
    limits: Sequence[float] = (inf, inf),
    where: str = "",
    unit: str = "mm",
) -> list[Comparison]:
    """Distances of measured points from a predicted path: their rms and the largest.

    Parameters
    ----------
    measured_path : (n, 2) array
    path : (k, 2) array
    limits : (float, float)
        Bounds of both.
    where : str
        Said behind the names.
    unit : str
    """
    deviation = distances(measured_path, path)
    names = ("distance of the path, rms", "distance of the path, largest")
    values = (rms(deviation), float(deviation.max()))
    return [
        Comparison(f"{name}{where}", value, unit=unit, most=limit)
        for name, value, limit in zip(names, values, limits, strict=True)
    ]


__all__ = [
    "Comparison",
    "Curve",
    "Outcome",
    "Picture",
    "Role",
    "distances",
    "path_comparisons",
    "rms",
]
