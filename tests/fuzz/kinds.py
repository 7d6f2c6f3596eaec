"""What an argument may be: whether a value in its place is valid, nonsense, or on the edge.

The verdicts are rules of these files: they know nothing of how xcrack checks.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

VALID, NONSENSE = "valid", "nonsense"
EDGE = "edge"  # a number may come out, or a refusal: far from one, or a matter of taste
SKIP = "skip"  # nothing can be expected of it: drawn again


def real(value):
    """The real number that a scalar is, or None."""
    if isinstance(value, np.ma.MaskedArray):
        return None
    if isinstance(value, np.ndarray):
        if value.ndim:
            return None
        value = value[()]
    if isinstance(value, bool | np.bool_):
        return None
    if not isinstance(value, int | float | np.integer | np.floating | Fraction):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf


def array(value):
    """The array of real numbers that a value is, or None."""
    if isinstance(value, np.ma.MaskedArray):
        return None if np.ma.getmaskarray(value).any() else array(value.data)
    if isinstance(value, np.ndarray):
        return value.astype(float) if value.dtype.kind in "iuf" else None
    if isinstance(value, range):
        return np.array(value, dtype=float)
    if isinstance(value, list | tuple):
        if any(part is value for part in value):
            return None
        nested = (list, tuple, np.ndarray)
        parts = [array(part) if isinstance(part, nested) else real(part) for part in value]
        if any(part is None for part in parts) or len({np.shape(part) for part in parts}) > 1:
            return None
        return np.array(parts, dtype=float)
    number = None if isinstance(value, Fraction) else real(value)
    return None if number is None else np.array(number)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What an argument may be; `rule` looks closer at what has the right type.

    The rule answers True, False or None: valid, nonsense or an edge.
    """

    optional: bool = False
    rule: Callable | None = None
    also: tuple = ()  # other kinds that will do

    def verdict(self, value):
        if value is None and self.optional:
            return VALID
        verdicts = {kind.verdict(value) for kind in self.also} | {self._own(value)}
        return next(v for v in (VALID, SKIP, EDGE, NONSENSE) if v in verdicts)

    def _own(self, value):
        thing = self.read(value)
        if thing is None:
            return NONSENSE
        answer = True if self.rule is None else self.rule(thing)
        if isinstance(answer, str):
            return answer
        return EDGE if answer is None else VALID if answer else NONSENSE

    def read(self, value):
        raise NotImplementedError


@dataclass(frozen=True)
class Number(Kind):
    """A finite real number; far from one it is an edge."""

    above: float = -math.inf
    least: float = -math.inf
    below: float = math.inf
    most: float = math.inf
    far: float = 1e6

    def read(self, value):
        number = real(value)
        return number if number is not None and math.isfinite(number) else None

    def _own(self, value):
        number = self.read(value)
        if number is None or not (self.above < number < self.below):
            return NONSENSE
        if not self.least <= number <= self.most:
            return NONSENSE
        if number and not 1 / self.far <= abs(number) <= self.far:
            return EDGE
        return super()._own(value)


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number."""

    least: float = -math.inf
    most: float = math.inf
    far: float = 50

    def read(self, value):
        number = real(value)
        if number is None or not number.is_integer():
            return None
        return number

    def _own(self, value):
        if isinstance(value, int) and self.most == math.inf and value > 1e300:
            return EDGE
        number = self.read(value)
        if number is None or not self.least <= number <= self.most:
            return NONSENSE
        return EDGE if abs(number) > self.far else super()._own(value)


@dataclass(frozen=True)
class Numbers(Kind):
    """An array of finite real numbers of a shape, None for any length."""

    shape: tuple | None = None
    whole: bool = False
    least: float = -math.inf
    most: float = math.inf
    far: float = 1e6

    def read(self, value):
        numbers = array(value)
        if numbers is None or not np.isfinite(numbers).all():
            return None
        if self.whole and (numbers != np.round(numbers)).any():
            return None
        if self.shape is not None and (
            numbers.ndim != len(self.shape)
            or any(b not in (None, a) for a, b in zip(numbers.shape, self.shape, strict=True))
        ):
            return None
        if (numbers < self.least).any() or (numbers > self.most).any():
            return None
        return numbers

    def _own(self, value):
        numbers = self.read(value)
        if numbers is None:
            return NONSENSE
        size = np.abs(numbers[numbers != 0])
        far = size.size and not (size.min() >= 1 / self.far and size.max() <= self.far)
        verdict = super()._own(value)
        return EDGE if far and verdict == VALID else verdict


@dataclass(frozen=True)
class Word(Kind):
    """One of some strings, or any."""

    words: tuple = ()

    def read(self, value):
        if not isinstance(value, str):
            return None
        return value if not self.words or value in self.words else None


@dataclass(frozen=True)
class Choice(Kind):
    """One of some values, of the same type."""

    values: tuple = ()

    def _own(self, value):
        number = real(value)
        if any(type(value) is type(v) and value == v for v in self.values):
            return VALID
        return EDGE if number is not None and number in map(real, self.values) else NONSENSE


@dataclass(frozen=True)
class Flag(Kind):
    """True or False; those of numpy are a matter of taste."""

    def _own(self, value):
        if isinstance(value, np.bool_):
            return EDGE
        return VALID if isinstance(value, bool) else NONSENSE


@dataclass(frozen=True)
class Of(Kind):
    """An object of a type."""

    type: object = None

    def read(self, value):
        return value if isinstance(value, self.type) else None


@dataclass(frozen=True)
class ListOf(Kind):
    """What can be gone through, of a kind each."""

    item: Kind | None = None
    least: int = 0
    most: float = math.inf

    def read(self, value):
        return items_of(value)

    def _own(self, value):
        items = self.read(value)
        if items is None or not self.least <= len(items) <= self.most:
            return NONSENSE
        verdicts = set() if self.item is None else {self.item.verdict(item) for item in items}
        for verdict in (NONSENSE, SKIP, EDGE):
            if verdict in verdicts:
                return verdict
        odd = isinstance(value, dict) or (isinstance(value, np.ndarray) and value.ndim > 1)
        return EDGE if odd else super()._own(value)


def items_of(value):
    """What a value holds, if it can be gone through and is no text."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return None
    if isinstance(value, list | tuple | set | range | dict | np.ndarray) or hasattr(
        type(value), "__next__"
    ):
        return list(value)
    return None


@dataclass(frozen=True)
class Called(Kind):
    """A function; what it does is drawn elsewhere."""

    def _own(self, value):
        return SKIP if callable(value) else NONSENSE


@dataclass(frozen=True)
class Seen(Kind):
    """Decided by the rule alone, which sees whatever it is."""

    def read(self, value):
        return ... if value is None else value

    def _own(self, value):
        answer = self.rule(value)
        return (
            answer
            if isinstance(answer, str)
            else {True: VALID, False: NONSENSE, None: EDGE}[answer]
        )


@dataclass(frozen=True)
class Filename(Kind):
    """The path of a file that can be written, or (`known`) read."""

    endings: tuple = ()  # empty: any will do
    bare: bool = True  # one without ending gets one, or needs none
    known: tuple | None = None
    folder: bool = False
    makes: bool = True  # folders that are not there

    def _own(self, value):
        if not isinstance(value, str | Path):
            return NONSENSE
        text = str(value)
        path = Path(text)
        if not text or "\0" in text or (path.name in ("", "..") and not self.folder):
            return NONSENSE
        if self.known is not None:
            there = self.folder and text in ("folder", ".", "..", "/")  # without a run
            return VALID if text in self.known else EDGE if there else NONSENSE
        if any(len(part.encode("utf-8", "surrogateescape")) > 230 for part in path.parts):
            return NONSENSE
        if not self.makes and len(path.parts) > 1:
            return NONSENSE
        if "none/there" in text or "\udcff" in text or "\n" in text:
            return EDGE
        if text.startswith(("/", "full", "file/")):
            return EDGE if self.folder else NONSENSE
        if self.folder:
            return NONSENSE if text == "file" else VALID if path.name == "good" else EDGE
        if ("folder" in text and path.suffix) or text == ".":
            return NONSENSE
        if not path.suffix:
            return VALID if self.bare else NONSENSE
        return VALID if not self.endings or path.suffix in self.endings else NONSENSE
