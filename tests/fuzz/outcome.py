"""What came of an input, and whether that is as it must be."""

import os
import re
import signal
import tempfile
import traceback
import warnings
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz.entry import ARITY, OWN
from fuzz.kinds import EDGE, NONSENSE, VALID
from fuzz.values import prepare
from xcrack.growth.step import StepControl, StepError

GOOD = (
    "valid finite",
    "nonsense refused",
    "nonsense warned",
    "edge finite",
    "edge refused",
    "callable's own",
    "Python's TypeError",
)
BAD = ("foreign", "nan", "hang", "silent", "valid refused", "words", "note")
SECONDS = 60

_FEWEST_WORDS = 5
_MEND = re.compile(  # an order, or what would be right
    r"\b(ask|begin|call|check|choose|couple|cut|describe|draw|enlarge|export|gives?|install|join|"
    r"known are|leave|make|merge|mesh|move|must|needs?|numbered|put|remesh|remove|resume|return|"
    r"rows are|save|it has|see|starts|such as|takes?|try|use|wanted|write|is no toml|is no text)\b",
    re.I,
)
# What numpy and others warn of by themselves is theirs, but a nan on its way must not pass.
_FOREIGN = (RuntimeWarning, DeprecationWarning, ResourceWarning)


class Hang(BaseException):
    """An input takes too long."""


@dataclass(frozen=True)
class Outcome:
    """Class of an outcome, one of GOOD or BAD, and what was seen."""

    kind: str
    seen: str


def outcome_of(drawn):
    """Call it, under a watchdog, and see what comes of it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with _watchdog(), _folder(drawn.in_folder):
            try:
                result = drawn.call()
                finite = all(np.isfinite(part).all() for part in numbers_in(result))
            except Hang:
                return Outcome("hang", f"more than {SECONDS} s")
            except BaseException as error:
                return _of_error(drawn, error)
    theirs = [w for w in caught if issubclass(w.category, _FOREIGN)]
    if theirs:
        place = f"{Path(theirs[0].filename).name}:{theirs[0].lineno}"
        return Outcome("foreign", f"warning {theirs[0].message} at {place}")
    ours = [str(w.message) for w in caught if issubclass(w.category, xc.XcrackWarning)]
    if not finite:
        return Outcome("nonsense warned" if ours else "nan", f"{result!r:.200}")
    if drawn.verdict == VALID:
        return Outcome("valid finite", "")
    if drawn.verdict == EDGE:
        return Outcome("edge finite", "")
    if drawn.verdict == NONSENSE and ours:
        return Outcome("nonsense warned", ours[0])
    return Outcome("silent", f"returned {type(result).__name__}")


def _of_error(drawn, error):
    seen = f"{type(error).__name__}: {error}"
    frames = traceback.extract_tb(error.__traceback__)
    place = " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in frames[:-5:-1])
    if drawn.verdict == OWN:
        if type(error) is not drawn.raises:
            return Outcome("foreign", f"{seen} at {place}")
        notes = " ".join(getattr(error, "__notes__", ()))
        good = drawn.function in notes and drawn.note in notes
        if not good and error.__traceback__ and _is_of_call(error, drawn):
            good = True
        return Outcome("callable's own" if good else "note", f"{seen}; notes: {notes}; {place}")
    if drawn.verdict == ARITY:
        good = type(error) is TypeError and "argument" in str(error)
        return Outcome("Python's TypeError" if good else "foreign", f"{seen} at {place}")
    if not isinstance(error, xc.XcrackError):
        return Outcome("foreign", f"{seen} at {place}")
    if drawn.verdict == VALID:
        return Outcome("valid refused", f"{seen} at {place}")
    lack = lack_of_words(str(error), drawn.words if drawn.verdict == NONSENSE else ())
    if lack:
        return Outcome("words", f"{lack}: {seen} at {place}")
    return Outcome("edge refused" if drawn.verdict == EDGE else "nonsense refused", seen)


def _is_of_call(error, drawn):
    """Whether the call itself raised it, since the function was called once only."""
    return traceback.extract_tb(error.__traceback__)[-1].name == "call"


def lack_of_words(message, words):
    """What a message lacks: words at all, the name of an argument, how to mend it."""
    if len(message.split()) < _FEWEST_WORDS:
        return "too short"
    names = {form for word in words for form in (word, word.replace("_", " "), word.rstrip("s"))}
    if names and not any(
        re.search(rf"(?<![a-z]){re.escape(name)}", message, re.I) for name in names
    ):
        return f"none of {sorted(names)}"
    if not _MEND.search(message):
        return "no way to mend it"
    return ""


def numbers_in(result, depth=0):
    """All numbers of a result."""
    if depth > 6 or result is None or isinstance(result, str | bytes | int | Path):
        return
    if isinstance(result, np.ndarray):
        if result.dtype.names:
            for name in result.dtype.names:
                yield from numbers_in(result[name], depth + 1)
        elif result.dtype.kind in "fiu":
            yield result
    elif isinstance(result, float | np.floating):
        yield np.array(float(result))
    elif isinstance(result, Mapping):
        for value in result.values():
            yield from numbers_in(value, depth + 1)
    elif isinstance(result, list | tuple):
        for value in result:
            yield from numbers_in(value, depth + 1)
    elif isinstance(result, xc.Solution):
        yield from (result.u, np.array(result.energy))
    elif isinstance(result, xc.SIF):
        yield from (result.x, result.frame, result.K, result.spread, result.s)
    elif isinstance(result, StepError):  # its other parts are nan where no bar of K was asked for
        yield from (*result.place, np.array(result.cycles))
    elif isinstance(result, xc.Mesh):
        yield from (result.points, result.volume)
    elif isinstance(result, xc.Isotropic):
        yield np.array([result.mu, result.lam, result.kolosov, result.E_prime])
    elif isinstance(result, StepError | StepControl):  # nan: not estimated, inf: no length yet
        return
    elif is_dataclass(result) and type(result).__module__.startswith("xcrack"):
        for one in fields(result):
            yield from numbers_in(getattr(result, one.name), depth + 1)


@contextmanager
def _watchdog():
    def bark(*_):
        raise Hang

    before = signal.signal(signal.SIGALRM, bark)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _folder(wanted):
    """A folder of its own as the current one, with what `paths` names in it."""
    if not wanted:
        yield
        return
    before = os.getcwd()
    with tempfile.TemporaryDirectory(prefix="xcrack_fuzz_") as parent:
        folder = Path(parent) / "inner"  # so that .. holds nothing of others
        folder.mkdir()
        prepare(folder)
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)
