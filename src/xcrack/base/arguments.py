"""Rules of arguments, each written once, where the argument is declared.

A rule is part of the annotation, ``C: Annotated[float, Number(above=0)]``. `Declared` runs those of
a dataclass, `check_arguments` those of a function; case files, stored values, pages and drawn
inputs of tests read them by `arguments_of`.
"""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache, wraps
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    ParamSpec,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from xcrack.base.arrays import frozen_copy
from xcrack.base.checks import (
    entries,
    flag,
    number,
    numbers,
    one_of,
    value_text,
    whole_number,
    whole_numbers,
)
from xcrack.base.errors import ProblemError, XcrackError
from xcrack.base.units import NUMBER, Dimension

P = ParamSpec("P")
T = TypeVar("T")
Error = type[XcrackError]
Unit = Dimension | Callable[[Any], Dimension] | None


@dataclass(frozen=True, kw_only=True)
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

    def check(self, value: Any, what: str, error: Error) -> Any:
        """The value as it is kept; an error where it does not fit."""
        raise NotImplementedError

    @property
    def words(self) -> str:
        """What fits, for pages."""
        return ""


@dataclass(frozen=True, kw_only=True)
class Number(Rule):
    """A finite real number within bounds, kept as float."""

    unit: Unit = NUMBER
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    hint: str = ""

    def check(self, value: Any, what: str, error: Error) -> float:
        """The number as float."""
        bounds = {"above": self.above, "least": self.least, "below": self.below, "most": self.most}
        try:
            return number(value, what, **bounds, error=error)
        except error as refusal:
            if not self.hint:
                raise
            raise error(f"{str(refusal).rstrip('.')}; {self.hint}.") from None

    @property
    def words(self) -> str:
        """The bounds."""
        return _bounds(self.above, self.least, self.below, self.most)


@dataclass(frozen=True, kw_only=True)
class Whole(Rule):
    """A whole number within bounds, kept as int."""

    least: int | None = None
    most: int | None = None

    def check(self, value: Any, what: str, error: Error) -> int:
        """The number as int."""
        return whole_number(value, what, least=self.least, most=self.most, error=error)

    @property
    def words(self) -> str:
        """The bounds."""
        return _bounds(None, self.least, None, self.most)


@dataclass(frozen=True)
class Choice(Rule):
    """One of some values; 1 is not True."""

    values: tuple[Any, ...]
    needs: str = ""

    def check(self, value: Any, what: str, error: Error) -> Any:
        """The value as it is."""
        if not self.needs and all(isinstance(each, str) for each in self.values):
            return one_of(value, what, self.values, error=error)
        if not any(type(value) is type(each) and value == each for each in self.values):
            choices = self.needs or " or ".join(repr(each) for each in self.values)
            raise error(f"{what} = {value_text(value)}: give {choices}.")
        return value

    @property
    def words(self) -> str:
        """The values."""
        return "{" + ", ".join(repr(each) for each in self.values) + "}"


@dataclass(frozen=True)
class Flag(Rule):
    """True or False."""

    def check(self, value: Any, what: str, error: Error) -> bool:
        """The value as bool."""
        return flag(value, what, error=error)


@dataclass(frozen=True)
class Text(Rule):
    """A text that is not empty; the name of a facet set is one."""

    needs: str = "a text"

    def check(self, value: Any, what: str, error: Error) -> str:
        """The text."""
        if not isinstance(value, str) or not value:
            raise error(f"{what} = {value_text(value)}: give {self.needs}.")
        return value


@dataclass(frozen=True)
class Array(Rule):
    """An array of finite numbers of a shape, None where any length will do; kept read-only.

    With `hashable` it is kept as nested tuples of float.
    """

    shape: tuple[int | None, ...] | None = None
    unit: Unit = NUMBER
    is_whole: bool = False
    hashable: bool = False

    def check(self, value: Any, what: str, error: Error) -> Any:
        """A read-only copy."""
        made = (whole_numbers if self.is_whole else numbers)(value, what, self.shape, error=error)
        return _tuples(made.tolist()) if self.hashable else frozen_copy(made)


@dataclass(frozen=True)
class Vector(Rule):
    """Two or three finite numbers, by the dimension of the body; kept read-only."""

    unit: Unit = NUMBER
    is_vector = True

    def check(self, value: Any, what: str, error: Error) -> Any:
        """A read-only copy."""
        vector = numbers(value, what, (None,), error=error)
        if len(vector) not in (2, 3):
            raise error(f"{what} = {value_text(value)}: give 2 or 3 numbers.")
        return frozen_copy(vector)


@dataclass(frozen=True)
class Part(Rule):
    """A value of a class."""

    kind: Any
    needs: str = ""

    def check(self, value: Any, what: str, error: Error) -> Any:
        """The value as it is."""
        if not isinstance(value, self.kind):
            raise error(
                f"{what} = {value_text(value)}: give {self.needs or _class_words(self.kind)}."
            )
        return value


@dataclass(frozen=True)
class Parts(Rule):
    """A list of values of a class, kept as tuple."""

    kind: Any
    needs: str = ""

    def check(self, value: Any, what: str, error: Error) -> tuple[Any, ...]:
        """The values as a tuple."""
        items = entries(value, what, error=error)
        for item in items:
            if not isinstance(item, self.kind):
                raise error(
                    f"{what}: {value_text(item)} is not one of them: give "
                    f"{self.needs or _class_words(self.kind)}."
                )
        return items


@dataclass(frozen=True)
class Function(Rule):
    """Something that can be called."""

    needs: str = "a function"

    def check(self, value: Any, what: str, error: Error) -> Any:
        """The function."""
        if not callable(value):
            raise error(f"{what} = {value_text(value)} cannot be called: give {self.needs}.")
        return value


@dataclass(frozen=True)
class Either(Rule):
    """What fits one of two rules; the message is that of the second."""

    first: Rule
    second: Rule

    def check(self, value: Any, what: str, error: Error) -> Any:
        """The value as the rule that it fits keeps it."""
        try:
            return self.first.check(value, what, error)
        except error:
            return self.second.check(value, what, error)


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

    @property
    def is_required(self) -> bool:
        """Whether it must be given."""
        return self.default is inspect.Parameter.empty

    def unit_of(self, owner: Any) -> Dimension | None:
        """Dimension of its numbers in an object; None where it holds none."""
        unit = None if self.rule is None else self.rule.unit
        return unit(owner) if callable(unit) else unit

    def check(self, value: Any, what: str, error: Error = ProblemError) -> Any:
        """The value as it is kept."""
        if self.rule is None or (value is None and self.is_optional):
            return value
        return self.rule.check(value, what, error)


def arguments_of(owner: Any) -> dict[str, Argument]:
    """Arguments of a dataclass or function, by name, in their order.

    Parameters
    ----------
    owner : class or function
    """
    return _arguments_of(owner)


@cache
def _arguments_of(owner: Any) -> dict[str, Argument]:
    given = owner if isinstance(owner, type) else inspect.unwrap(owner)
    hints = get_type_hints(given, include_extras=True)
    if isinstance(given, type) and is_dataclass(given):
        defaults = {
            field.name: field.default_factory() if field.default is MISSING
            and field.default_factory is not MISSING else field.default
            for field in fields(given) if field.init
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
    if get_origin(hint) is Annotated:
        hint, *notes = get_args(hint)
        rule = next((note for note in notes if isinstance(note, Rule)), None)
    is_optional = default is None
    if get_origin(hint) in (Union, UnionType):
        is_optional = is_optional or NoneType in get_args(hint)
    return Argument(name, rule, default, is_optional, hint)


def check_fields(value: Any, error: Error = ProblemError) -> None:
    """Run the rules of all fields of a dataclass, at the end of its making.

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
        given = getattr(value, name)
        result = argument.check(given, f"{kind.__name__}: {name}", error)
        if result is not given:
            object.__setattr__(value, name, result)


class Declared:
    """A dataclass whose fields are checked by their rules when it is made."""

    def __post_init__(self) -> None:
        check_fields(self)


def check_arguments(error: Error = ProblemError) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Let a function run the rules of its parameters before its own code.

    Parameters
    ----------
    error : type of XcrackError
        What is raised where an argument does not fit, named with the function.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)

        @wraps(function)
        def run(*values: P.args, **named: P.kwargs) -> T:
            given = signature.bind(*values, **named)
            for name, argument in arguments_of(function).items():
                if name in given.arguments:
                    what = f"{function.__name__}: {name}"
                    given.arguments[name] = argument.check(given.arguments[name], what, error)
            return function(*given.args, **given.kwargs)

        return run

    return decorate


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
    low = f"above {above:g}" if above is not None else ""
    low = f"at least {least:g}" if least is not None else low
    high = f"below {below:g}" if below is not None else ""
    high = f"at most {most:g}" if most is not None else high
    return " and ".join(part for part in (low, high) if part)


def classes_of(kind: Any) -> dict[str, type]:
    """Classes that a value may be of, by name: those derived from a base, or the class itself."""
    kinds: tuple[Any, ...] = get_args(kind) or (kind if isinstance(kind, tuple) else (kind,))
    result: dict[str, type] = {}
    for one in kinds:
        result |= kinds_of(one) or {one.__name__: one}
    return result


def _class_words(kind: Any) -> str:
    """Classes in words: those that can be made of them."""
    names = list(classes_of(kind))
    return " or ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value


__all__ = [
    "Argument",
    "Array",
    "Choice",
    "Declared",
    "Either",
    "Flag",
    "Function",
    "Number",
    "Part",
    "Parts",
    "Rule",
    "Text",
    "Vector",
    "Whole",
    "arguments_of",
    "check_arguments",
    "check_fields",
    "classes_of",
    "kinds_of",
]
