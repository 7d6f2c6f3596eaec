"""Values that users put in the place of an argument."""

import decimal
import enum
import math
from datetime import date
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz import scenes


class Hostile:
    """Whatever Python asks of it, it raises."""

    def _refuse(self, *_, **__):
        raise RuntimeError("hostile")

    __repr__ = __array__ = __float__ = __iter__ = __len__ = __bool__ = __fspath__ = _refuse
    __index__ = __getitem__ = _refuse
    __hash__ = object.__hash__


class Level(enum.IntEnum):
    ONE = 1


class Text(str):
    """A string by another name."""


class BytesPath:
    def __fspath__(self):
        return b"bytes.png"


def _raise(*_, **__):
    raise AssertionError("a value was called that is no function")


# name: how to make it
SCALARS = {
    "None": lambda: None,
    "True": lambda: True,
    "numpy False": lambda: np.False_,
    "zero": lambda: 0,
    "minus zero": lambda: -0.0,
    "one": lambda: 1,
    "two": lambda: 2,
    "minus one": lambda: -1,
    "half": lambda: 0.5,
    "two and a half": lambda: 2.5,
    "minus three and a half": lambda: -3.5,
    "nan": lambda: math.nan,
    "inf": lambda: math.inf,
    "minus inf": lambda: -math.inf,
    "huge": lambda: 1e300,
    "minus huge": lambda: -1e300,
    "tiny": lambda: 1e-300,
    "beyond floats": lambda: 10**400,
    "too long to print": lambda: 10**5000,
    "float32": lambda: np.float32(0.5),
    "int64": lambda: np.int64(1),
    "longdouble": lambda: np.longdouble(0.5),
    "numpy nan": lambda: np.float64("nan"),
    "0-d array": lambda: np.array(0.5),
    "0-d nan": lambda: np.array(np.nan),
    "0-d bool": lambda: np.array(True),
    "fraction": lambda: Fraction(1, 2),
    "enum": lambda: Level.ONE,
    "complex": lambda: 1 + 2j,
    "real complex": lambda: 1 + 0j,
    "decimal": lambda: decimal.Decimal("0.5"),
    "date": lambda: date(2026, 1, 1),
    "numpy date": lambda: np.datetime64("2026-01-01"),
    "masked": lambda: np.ma.masked,
}
TEXTS = {
    "text": lambda: "a",
    "number as text": lambda: "1.0",
    "empty text": lambda: "",
    "long text": lambda: "a" * 5000,
    "lines": lambda: "a\nb",
    "text by another name": lambda: Text("x"),
    "bytes": lambda: b"ab",
    "bytearray": lambda: bytearray(b"ab"),
}
LISTS = {
    "empty list": lambda: [],
    "empty tuple": lambda: (),
    "list of one": lambda: [1.0],
    "array of one": lambda: np.array([1.0]),
    "two": lambda: [1, 2],
    "three": lambda: (1.0, 2.0, 3.0),
    "four": lambda: [1, 2, 3, 4],
    "zeros": lambda: [0.0, 0.0, 0.0],
    "two zeros": lambda: [0.0, 0.0],
    "nan among two": lambda: [np.nan, 1.0],
    "inf among three": lambda: [0.0, np.inf, 1.0],
    "None among two": lambda: [None, 1.0],
    "texts": lambda: ["a", "b"],
    "Nones": lambda: [None, None],
    "bools": lambda: [True, False],
    "complexes": lambda: [1 + 1j, 0],
    "ragged": lambda: [[0, 1], [2]],
    "pairs": lambda: [[0.0, 0.0], [1.0, 1.0]],
    "pairs with nan": lambda: [[0.0, np.nan], [1.0, 1.0]],
    "triples": lambda: np.eye(3),
    "lopsided": lambda: [[0.0, 1.0], [2.0, 0.0]],
    "no rows": lambda: np.zeros((0, 2)),
    "cube": lambda: np.zeros((2, 2, 2)),
    "huge two": lambda: [1e300, -1e300],
    "tiny two": lambda: [1e-300, 1e-300],
    "beyond the end": lambda: [[0, 1, 99]],
    "below zero": lambda: [[0, 1, -1]],
    "masked entries": lambda: np.ma.masked_array([0.0, 1.0], [True, False]),
    "masked, no mask": lambda: np.ma.masked_array([0.0, 1.0]),
    "objects": lambda: np.array([1, None], dtype=object),
    "numbers as objects": lambda: np.array([0.0, 1.0], dtype=object),
    "structured": lambda: np.zeros(2, dtype=[("x", float), ("y", float)]),
    "dates": lambda: np.array(["2026-01-01"], dtype="datetime64"),
    "strings": lambda: np.array(["a", "b"]),
    "many": lambda: list(range(10_000)),
    "holds itself": lambda: _endless(),
    "integers": lambda: np.array([0, 1], dtype=np.uint8),
    "float16": lambda: np.array([0.0, 1.0], dtype=np.float16),
}
OTHERS = {
    "dict": lambda: {"a": 1},
    "empty dict": lambda: {},
    "dict of numbers": lambda: {0: 1.0},
    "set": lambda: {1.0, 2.0},
    "generator": lambda: (k for k in (1.0, 2.0)),
    "range": lambda: range(3),
    "slice": lambda: slice(None),
    "ellipsis": lambda: ...,
    "object": lambda: object(),
    "class": lambda: float,
    "function": lambda: _raise,
    "exception": lambda: ValueError("x"),
    "module": lambda: math,
    "hostile": lambda: Hostile(),
    "path": lambda: Path("none/there"),
}
OURS = {
    "mesh": scenes.mesh,
    "mesh in space": lambda: scenes.mesh(3),
    "crack": scenes.crack,
    "crack in space": lambda: scenes.crack(3),
    "material": lambda: scenes.STEEL,
    "problem": scenes.problem,
    "problem without crack": lambda: scenes.problem(2, False),
    "solution": scenes.solution,
    "sif": scenes.sif,
    "step": lambda: scenes.history().steps[0],
    "history": scenes.history,
    "cycle": lambda: xc.Cycle(0, 1),
    "load": lambda: scenes.PULL[0],
    "support": lambda: xc.fix("left"),
    "numerics": xc.Numerics,
    "law": lambda: xc.paris(1, 2),
}
GENERAL = {
    f"{group}: {name}": make
    for group, members in (
        ("scalar", SCALARS), ("text", TEXTS), ("list", LISTS), ("other", OTHERS), ("ours", OURS),
    )
    for name, make in members.items()
}  # fmt: skip


def _endless():
    value = [1.0]
    value.append(value)
    return value


@cache
def paths(ending, folder_ending):
    """Paths that may be given, by name; folders and files of `prepare` among them."""
    return {
        "path: good": lambda: f"good{ending}",
        "path: Path": lambda: Path(f"good{ending}"),
        "path: new folders": lambda: Path("new") / "er" / f"good{ending}",
        "path: a folder": lambda: f"folder{folder_ending}",
        "path: NUL": lambda: f"a\0b{ending}",
        "path: too long": lambda: "a" * 300 + ending,
        "path: a file as folder": lambda: f"file/good{ending}",
        "path: bytes": lambda: f"good{ending}".encode(),
        "path: bytes inside": lambda: BytesPath(),
        "path: unicode": lambda: f"Riß ∂Ω{ending}",
        "path: dot": lambda: ".",
        "path: up": lambda: "..",
        "path: root": lambda: "/",
        "path: no such place": lambda: f"/proc/none/good{ending}",
        "path: full disk": lambda: f"full{ending}",
        "path: other ending": lambda: "good.xyz",
        "path: surrogate": lambda: f"\udcff{ending}",
    }


def prepare(folder):
    """Folders and files that `paths` names."""
    for ending in ("", ".png", ".vtu", ".msh", ".inp"):
        (folder / f"folder{ending}").mkdir()
        (folder / f"full{ending}").symlink_to("/dev/full")
    (folder / "file").write_text("x")
