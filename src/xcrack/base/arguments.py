"""Rules of arguments, each written once, where the argument is declared.

A rule is part of the annotation, ``C: Annotated[float, Number(above=0)]``. `Declared` runs those of
a dataclass, `check_arguments` those of a function or method; case files, stored values, pages and
the tests of wrong input read them by `arguments_of`. Rules look at one value: what two arguments
must be to each other stands in the code that they are given to.
"""

import inspect
import re
from collections.abc import Callable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from functools import cache, wraps
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    ParamSpec,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from xcrack.base.arrays import Floats, frozen_copy
from xcrack.base.checks import (
    LARGEST,
    entries,
    flag,
    number,
    numbers,
    one_of,
    point_coordinates,
    value_text,
    whole_number,
    whole_numbers,
)
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.paths import path_of
from xcrack.base.units import LENGTH, NUMBER, Dimension

P = ParamSpec("P")
T = TypeVar("T")
Error = type[XcrackError]
_FEW = 2  # whole numbers between bounds, beyond the first, that a refusal lists
Unit = Dimension | Callable[[Any], Dimension] | None


@dataclass(frozen=True, kw_only=True, repr=False)
class Rule:
    """What an argument may be.

    Attributes
    ----------
    unit : Dimension, callable or None
        Dimension of its numbers; a function of the owner where it depends on other fields; None
        where it holds no numbers.
    is_vector : bool
        Whether its numbers must be as many as the body has dimensions.
    takes_names : bool
        Whether a text that is no number may stand for it.
    """

    unit: Unit = None
    is_vector: ClassVar[bool] = False
    takes_names: ClassVar[bool] = False

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The value as it is kept; an error where it does not fit."""
        raise NotImplementedError

    @property
    def words(self) -> str:
        """What fits, for pages and signatures."""
        return ""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.words})"


@dataclass(frozen=True, kw_only=True, repr=False)
class Number(Rule):
    """A finite real number within bounds, kept as float."""

    unit: Unit = NUMBER
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    hint: str = ""

    def check(self, value: Any, label: str, error: Error) -> float:
        """The number as float."""
        bounds = {"above": self.above, "least": self.least, "below": self.below, "most": self.most}
        try:
            return number(value, label, **bounds, error=error)
        except error as refusal:
            if not self.hint:
                raise
            raise error(f"{str(refusal).rstrip('.')}; {self.hint}.") from None

    @property
    def words(self) -> str:
        """The bounds."""
        return _bounds(self.above, self.least, self.below, self.most)


@dataclass(frozen=True, kw_only=True, repr=False)
class Whole(Rule):
    """A whole number within bounds, kept as int."""

    least: int | None = None
    most: int | None = None

    def check(self, value: Any, label: str, error: Error) -> int:
        """The number as int."""
        n_min, n_max = self.least, self.most
        try:
            return whole_number(value, label, least=n_min, most=n_max, error=error)
        except error:
            if n_min is None or n_max is None or n_max - n_min > _FEW:
                raise
            choices = " or ".join(map(str, range(n_min, n_max + 1)))
            raise error(f"{label} = {value_text(value)}: give {choices}.") from None

    @property
    def words(self) -> str:
        """The bounds."""
        return _bounds(None, self.least, None, self.most)


@dataclass(frozen=True, repr=False)
class Choice(Rule):
    """One of some values; 1 is not True."""

    values: tuple[Any, ...]
    needs: str = ""

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The value as it is."""
        if not self.needs and all(isinstance(choice, str) for choice in self.values):
            return one_of(value, label, self.values, error=error)
        if not any(type(value) is type(choice) and value == choice for choice in self.values):
            choices = self.needs or " or ".join(repr(choice) for choice in self.values)
            raise error(f"{label} = {value_text(value)}: give {choices}.")
        return value

    @property
    def words(self) -> str:
        """The values."""
        return "{" + ", ".join(repr(choice) for choice in self.values) + "}"


@dataclass(frozen=True, repr=False)
class SomeOf(Rule):
    """One of some words, or a list of at least one; kept as tuple."""

    values: tuple[str, ...]

    def check(self, value: Any, label: str, error: Error) -> tuple[str, ...]:
        """The words as a tuple."""
        words = (value,) if isinstance(value, str) else entries(value, label, error=error)
        if not words or not all(isinstance(word, str) and word in self.values for word in words):
            choices = ", ".join(f'"{word}"' for word in self.values)
            raise error(f"{label} = {value_text(value)}: give some of {choices}.")
        return words

    @property
    def words(self) -> str:
        """The values."""
        return "some of " + ", ".join(map(repr, self.values))


@dataclass(frozen=True, repr=False)
class Flag(Rule):
    """True or False."""

    def check(self, value: Any, label: str, error: Error) -> bool:
        """The value as bool."""
        return flag(value, label, error=error)


@dataclass(frozen=True, repr=False)
class Progress(Rule):
    """Whether progress is shown: True or False, "always" where nobody watches too."""

    def check(self, value: Any, label: str, error: Error) -> bool | str:
        """The word, or a bool."""
        if isinstance(value, str) and value == "always":
            return value
        if not isinstance(value, bool | np.bool_):
            raise error(f'{label} = {value_text(value)}: give True, False or "always".')
        return bool(value)


@dataclass(frozen=True, repr=False)
class Text(Rule):
    """A text that is not empty, but where it may be; the name of a facet set is one."""

    needs: str = "a text"
    may_be_empty: bool = False

    def check(self, value: Any, label: str, error: Error) -> str:
        """The text."""
        if not isinstance(value, str) or not (value or self.may_be_empty):
            raise error(f"{label} = {value_text(value)}: give {self.needs}.")
        return value


@dataclass(frozen=True, repr=False)
class FilePath(Rule):
    """The path of a file or folder; relative paths of a case file begin beside it."""

    is_file: bool = False

    def check(self, value: Any, label: str, error: Error) -> Path:
        """The path."""
        return path_of(value, label, error=error, is_file=self.is_file)


@dataclass(frozen=True, repr=False)
class Array(Rule):
    """An array of finite numbers of a shape, None where any length will do; kept read-only.

    With `is_hashable` it is kept as nested tuples of float.
    """

    shape: tuple[int | None, ...] | None = None
    unit: Unit = field(default=NUMBER, kw_only=True)
    is_whole: bool = False
    is_hashable: bool = False

    def check(self, value: Any, label: str, error: Error) -> Any:
        """A read-only copy."""
        result = (whole_numbers if self.is_whole else numbers)(
            value, label, self.shape, error=error
        )
        return _tuples(result.tolist()) if self.is_hashable else frozen_copy(result)


@dataclass(frozen=True, repr=False)
class Points(Rule):
    """Coordinates of a shape, None where any length will do, small enough to compute with."""

    shape: tuple[int | None, ...] | None = None
    unit: Unit = field(default=LENGTH, kw_only=True)

    def check(self, value: Any, label: str, error: Error) -> Floats:
        """A read-only copy."""
        return frozen_copy(point_coordinates(value, label, self.shape, error=error))

    @property
    def words(self) -> str:
        """The shape."""
        return _shape_words(self.shape)


@dataclass(frozen=True, repr=False)
class Direction(Rule):
    """A vector of three numbers that has a direction."""

    needs: str = "a direction (x, y, z)"

    def check(self, value: Any, label: str, error: Error) -> Floats:
        """The unit vector."""
        try:
            vector = numbers(value, label, (3,), error=error)
        except error:
            raise error(f"{label} = {value_text(value)}: give {self.needs}.") from None
        length = float(np.linalg.norm(vector))
        if not 0 < length < np.inf:
            raise error(f"{label} = {value_text(value)} has no direction: give {self.needs}.")
        return np.asarray(vector / length)


@dataclass(frozen=True, repr=False)
class Interval(Rule):
    """Two numbers, the lower one first."""

    unit: Unit = field(default=NUMBER, kw_only=True)

    def check(self, value: Any, label: str, error: Error) -> tuple[float, float]:
        """Both as float."""
        x_min, x_max = numbers(value, label, (2,), error=error).tolist()
        if not x_min < x_max:
            raise error(f"{label} = ({x_min:g}, {x_max:g}): give (lowest, highest).")
        return x_min, x_max


@dataclass(frozen=True, repr=False)
class Vector(Rule):
    """Two or three finite numbers, by the dimension of the body; kept read-only."""

    unit: Unit = NUMBER
    is_vector = True

    def check(self, value: Any, label: str, error: Error) -> Any:
        """A read-only copy."""
        vector = numbers(value, label, (None,), error=error)
        if len(vector) not in (2, 3):
            raise error(f"{label} = {value_text(value)}: give 2 or 3 numbers.")
        return frozen_copy(vector)


@dataclass(frozen=True, repr=False)
class Part(Rule):
    """A value of a class."""

    kind: Any
    needs: str = ""

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The value as it is."""
        if not isinstance(value, self.kind):
            raise error(
                f"{label} = {value_text(value)}: give {self.needs or _class_words(self.kind)}."
            )
        return value


@dataclass(frozen=True, repr=False)
class Parts(Rule):
    """A list of values of a class, kept as tuple."""

    kind: Any
    needs: str = ""

    def check(self, value: Any, label: str, error: Error) -> tuple[Any, ...]:
        """The values as a tuple."""
        items = entries(value, label, error=error)
        for item in items:
            if not isinstance(item, self.kind):
                raise error(
                    f"{label}: {value_text(item)} is not one of them: give "
                    f"{self.needs or _class_words(self.kind)}."
                )
        return items


@dataclass(frozen=True, repr=False)
class OneOrMore(Rule):
    """A value of a class, or a list of them, of at least one but where it may be empty; a tuple."""

    kind: type
    needs: str = ""
    may_be_empty: bool = False

    def check(self, value: Any, label: str, error: Error) -> tuple[Any, ...]:
        """The values as a tuple."""
        items = (value,) if isinstance(value, self.kind) else entries(value, label, error=error)
        fits = all(isinstance(item, self.kind) for item in items)
        if not fits or not (items or self.may_be_empty):
            needs = self.needs or f"a {self.kind.__name__}"
            raise error(f"{label} = {value_text(value)}: give {needs}, or a list of them.")
        return items


@dataclass(frozen=True, repr=False)
class Items(Rule):
    """A list of whatever is looked at where it is used; sets, without an order, may be kept."""

    keeps_sets: bool = False

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The entries as a tuple."""
        items = entries(value, label, error=error)
        return value if self.keeps_sets and isinstance(value, AbstractSet) else items


@dataclass(frozen=True, repr=False)
class CheckedBy(Rule):
    """What a function (value, label, error) takes; kept as that returns it."""

    function: Callable[[Any, str, Error], Any]
    unit: Unit = field(default=None, kw_only=True)

    def check(self, value: Any, label: str, error: Error) -> Any:
        """What the function makes of the value."""
        return self.function(value, label, error)

    @property
    def words(self) -> str:
        """The name of the function."""
        return self.function.__name__


@dataclass(frozen=True, repr=False)
class Function(Rule):
    """Something that can be called."""

    needs: str = "a function"

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The function."""
        if not callable(value):
            raise error(f"{label} = {value_text(value)} cannot be called: give {self.needs}.")
        return value


@dataclass(frozen=True, repr=False)
class Either(Rule):
    """What fits one of two rules; the message is that of the second."""

    first_rule: Rule
    second_rule: Rule

    def __post_init__(self) -> None:
        object.__setattr__(self, "unit", self.second_rule.unit)

    def check(self, value: Any, label: str, error: Error) -> Any:
        """The value as the rule that it fits keeps it."""
        try:
            return self.first_rule.check(value, label, error)
        except error:
            return self.second_rule.check(value, label, error)

    @property
    def words(self) -> str:
        """Both rules."""
        return f"{self.first_rule}, or {self.second_rule}"


@dataclass(frozen=True)
class Argument:
    """An argument as it is declared.

    Attributes
    ----------
    name : str
    rule : Rule or None
    default : anything
        `inspect.Parameter.empty` where it must be given.
    is_optional : bool
        Whether None may stand for it.
    annotation : anything
        Without the rule.
    """

    name: str
    rule: Rule | None
    default: Any
    is_optional: bool
    annotation: Any

    def unit_of(self, owner: Any) -> Dimension | None:
        """Dimension of its numbers in an object; None where it holds none."""
        unit = None if self.rule is None else self.rule.unit
        return unit(owner) if callable(unit) else unit

    def check(self, value: Any, label: str, error: Error = ProblemError) -> Any:
        """The value as it is kept."""
        if self.rule is None or (value is None and self.is_optional):
            return value
        return self.rule.check(value, label, error)


def arguments_of(owner: Any) -> dict[str, Argument]:
    """Arguments of a dataclass or function, by name, in their order.

    Parameters
    ----------
    owner : class or function
    """
    return _arguments_of(owner)


@cache
def _arguments_of(owner: Any) -> dict[str, Argument]:
    target = owner if isinstance(owner, type) else inspect.unwrap(owner)
    hints = get_type_hints(target, include_extras=True)
    if isinstance(target, type) and is_dataclass(target):
        defaults = {
            field.name: field.default_factory() if field.default is MISSING
            and field.default_factory is not MISSING else field.default
            for field in fields(target) if field.init
        }  # fmt: skip
        defaults = {
            name: inspect.Parameter.empty if value is MISSING else value
            for name, value in defaults.items()
        }
    else:
        defaults = {
            name: parameter.default
            for name, parameter in inspect.signature(owner).parameters.items()
        }
    return {name: _argument(name, hints.get(name), value) for name, value in defaults.items()}


def _argument(name: str, hint: Any, default: Any) -> Argument:
    rule: Rule | None = None
    is_optional = default is None
    if get_origin(hint) in (Union, UnionType):  # such as Length | None
        rules = [part_hint for part_hint in get_args(hint) if get_origin(part_hint) is Annotated]
        if len(rules) == 1:
            is_optional = is_optional or NoneType in get_args(hint)
            (hint,) = rules
    if get_origin(hint) is Annotated:
        hint, *notes = get_args(hint)
        rule = next((note for note in notes if isinstance(note, Rule)), None)
    if get_origin(hint) in (Union, UnionType):
        is_optional = is_optional or NoneType in get_args(hint)
    return Argument(name, rule, default, is_optional, hint)


def check_fields(value: Any, error: Error = ProblemError) -> None:
    """Run the rules of all fields of a dataclass, when it is made.

    Parameters
    ----------
    value : dataclass
        Its fields become what their rules keep.
    error : type of XcrackError

    Raises
    ------
    error
        A field that does not fit, named with its class.
    """
    kind: Any = type(value)
    for name, argument in arguments_of(kind).items():
        content = getattr(value, name)
        result = argument.check(content, f"{kind.__name__}: {name}", error)
        if result is not content:
            object.__setattr__(value, name, result)


class Declared:
    """A dataclass whose fields are checked by their rules when it is made."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        annotations = {
            name: hint
            for base in reversed(cls.__mro__)
            for name, hint in inspect.get_annotations(base).items()
        }
        cls.__doc__ = _with_bounds(cls.__doc__, annotations)

    def __post_init__(self) -> None:
        check_fields(self)


def check_arguments(error: Error = ProblemError) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Let a function or method run the rules of its parameters before its own code.

    Its docstring gets their bounds.

    Parameters
    ----------
    error : type of XcrackError
        What is raised where an argument does not fit, named with the function.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)
        parameters = signature.parameters.values()
        takes_any = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)
        bindable = [p for p in parameters if p.kind is not inspect.Parameter.VAR_KEYWORD]
        names = [p.name for p in bindable if p.kind is not inspect.Parameter.KEYWORD_ONLY]
        every_name = {p.name for p in bindable}
        required_names = {p.name for p in bindable if p.default is inspect.Parameter.empty}

        @cache
        def rules() -> dict[str, tuple[Argument, str]]:  # hints may name what is defined later
            pairs = arguments_of(function).items()
            return {name: (a, f"{function.__qualname__}: {name}") for name, a in pairs if a.rule}

        @wraps(function)
        def run(*values: P.args, **keyword_values: P.kwargs) -> T:
            arguments = dict(zip(names, values))
            if (
                len(values) > len(names)
                or not arguments.keys().isdisjoint(keyword_values)
                or not required_names <= arguments.keys() | keyword_values.keys()
                or not (takes_any or keyword_values.keys() <= every_name)
            ):
                return function(*values, **keyword_values)  # raises in Python's own words
            arguments |= keyword_values
            for name, (argument, label) in rules().items():
                if name in arguments:
                    arguments[name] = argument.check(arguments[name], label, error)
            return cast(Callable[..., T], function)(**arguments)

        run.__doc__ = _with_bounds(function.__doc__, function.__annotations__)
        cast(Any, run).__signature__ = without_types(signature)
        return run

    return decorate


def without_types(signature: inspect.Signature) -> inspect.Signature:
    """What help shows: names and defaults, for the docstring says types in words."""
    parameters = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return signature.replace(parameters=parameters, return_annotation=signature.empty)


_PARAMETERS = re.compile(r"^( *)(\w+(?:, \w+)*) : (.+)$", re.MULTILINE)


def _with_bounds(text: str | None, annotations: Mapping[str, Any]) -> str | None:
    """A docstring whose lines "name : type" say the bounds that the annotations declare."""
    if not text:
        return text

    def line(match: re.Match[str]) -> str:
        names = match[2].split(", ")
        bounds = {_bounds_of(annotations.get(name)) for name in names}
        words = bounds.pop() if len(bounds) == 1 else ""
        return f"{match[0]}, {words}" if words else match[0]

    return _PARAMETERS.sub(line, text)


def _bounds_of(hint: Any) -> str:
    """Bounds of a number in words; empty where an annotation has none."""
    rule = _argument("", hint, inspect.Parameter.empty).rule
    return rule.words if isinstance(rule, Number | Whole) else ""


def kinds_of(base: type) -> dict[str, type]:
    """Classes that derive from one and can be made, by name: those of users among them."""
    result: dict[str, type] = {}
    kind: type
    for kind in base.__subclasses__():
        if is_dataclass(kind) and not kind.__name__.startswith("_"):
            result[kind.__name__] = kind
        result |= kinds_of(kind)
    return result


def _bounds(above: Any, least: Any, below: Any, most: Any) -> str:
    lower_bound = f"above {above:g}" if above is not None else ""
    lower_bound = f"at least {least:g}" if least is not None else lower_bound
    upper_bound = f"below {below:g}" if below is not None else ""
    upper_bound = f"at most {most:g}" if most is not None and most < LARGEST else upper_bound
    return " and ".join(part for part in (lower_bound, upper_bound) if part)


def classes_of(kind: Any) -> dict[str, type]:
    """Classes that a value may be of, by name: those derived from a base, or the class itself."""
    kinds: tuple[Any, ...] = get_args(kind) or (kind if isinstance(kind, tuple) else (kind,))
    result: dict[str, type] = {}
    for part_kind in kinds:
        result |= kinds_of(part_kind) or {part_kind.__name__: part_kind}
    return result


def _class_words(kind: Any) -> str:
    """Classes in words: those that can be made of them."""
    names = list(classes_of(kind))
    return " or ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _shape_words(shape: tuple[int | None, ...] | None) -> str:
    if shape is None:
        return "any shape"
    return ", ".join("n" if side is None else str(side) for side in shape)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list) else value


# Arguments that many functions have.

Length = Annotated[float, Number(above=0, most=LARGEST, unit=LENGTH)]
Distance = Annotated[float, Number(least=0, most=LARGEST, unit=LENGTH)]
FileName = Annotated[str | PathLike[str], FilePath()]
Switch = Annotated[bool, Flag()]
Poisson = Annotated[float, Number(above=-1, below=0.5)]

__all__ = [
    "Argument",
    "Array",
    "CheckedBy",
    "Choice",
    "Declared",
    "Direction",
    "Distance",
    "Either",
    "FileName",
    "FilePath",
    "Flag",
    "Function",
    "Interval",
    "Items",
    "Length",
    "Number",
    "OneOrMore",
    "Part",
    "Parts",
    "Points",
    "Poisson",
    "Progress",
    "Rule",
    "SomeOf",
    "Switch",
    "Text",
    "Vector",
    "Whole",
    "arguments_of",
    "check_arguments",
    "check_fields",
    "classes_of",
    "kinds_of",
    "without_types",
]
