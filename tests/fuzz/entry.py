"""Entries of the table, and inputs drawn from them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fuzz.kinds import EDGE, NONSENSE, SKIP, VALID, Kind
from fuzz.values import GENERAL

ARITY, OWN = "arity", "own"


@dataclass(frozen=True)
class Late:
    """A value that is made when it is needed, and anew each time."""

    make: Callable


@dataclass(frozen=True)
class Bad:
    """A near miss that is nonsense whatever its kind says: it does not fit the scene."""

    make: Callable

    def __call__(self):
        return self.make()


@dataclass(frozen=True)
class Argument:
    """An argument: its kind, valid values that suit those of the other arguments, near misses.

    `words` are names under which a message may speak of it, beside its own.
    """

    kind: Kind
    valid: tuple = ()
    near: Mapping[str, Callable] = field(default_factory=dict)
    words: tuple = ()


@dataclass(frozen=True)
class Entry:
    """A way to call a public name.

    `call` takes the arguments by name. `cost` is about the time in seconds of a valid call; dear
    ones are drawn less often.
    """

    name: str
    call: Callable
    arguments: Mapping[str, Argument]
    cost: float = 0.01
    in_folder: bool = False
    arity: bool = True
    share: float | None = None  # of valid inputs, where it is not to follow from the cost

    @property
    def weight(self):
        """How often it is drawn."""
        return np.sqrt((1 + len(self.arguments)) / (0.1 + self.cost))


@dataclass(frozen=True)
class Hook:
    """A place where xcrack calls a function of the user's.

    `call` takes the function; `good` is one that fits, `result` says what it may return, `words`
    what the note about an exception must name.
    """

    name: str
    call: Callable
    good: Callable
    result: Kind
    words: str
    cost: float = 0.05
    in_folder: bool = False
    near: Mapping[str, Callable] = field(default_factory=dict)

    @property
    def weight(self):
        """How often it is drawn."""
        return np.sqrt(4 / (0.1 + self.cost))


@dataclass(frozen=True)
class Input:
    """One input: what is called, how, and what must come of it."""

    name: str
    verdict: str
    call: Callable
    text: str
    words: tuple = ()  # of the argument, of which a message must hold one
    note: str = ""
    function: str = ""
    raises: type | None = None
    in_folder: bool = False


def draw(rng, table):
    """An input of one of the entries and hooks of a table."""
    weight = np.array([one.weight for one in table])
    one = table[rng.choice(len(table), p=weight / weight.sum())]
    return _hooked(rng, one) if isinstance(one, Hook) else _entered(rng, one)


def pick(rng, options):
    """One of a sequence, which may hold anything."""
    return options[int(rng.integers(len(options)))]


def made(value):
    return value.make() if isinstance(value, Late) else value


# --- arguments ---------------------------------------------------------------------------------


def _entered(rng, entry):
    if entry.arity and rng.random() < 0.05:
        return _with_wrong_arity(rng, entry)
    makers = {
        name: (f"valid {k}", lambda value=argument.valid[k]: made(value))
        for name, argument in entry.arguments.items()
        if argument.valid
        for k in [int(rng.integers(len(argument.valid)))]
    }
    verdicts = dict.fromkeys(makers, VALID)
    names = list(entry.arguments)
    share = min(0.2, 0.02 / entry.cost) if entry.share is None else entry.share
    if rng.random() > share and names:
        how_many = 1 if rng.random() < 0.85 else min(2, len(names))
        for name in rng.choice(names, how_many, replace=False).tolist():
            label, make, verdict = _value(rng, entry.arguments[name])
            makers[name], verdicts[name] = (label, make), verdict
    bad = [name for name, verdict in verdicts.items() if verdict == NONSENSE]
    changed = [name for name, (label, _) in makers.items() if not label.startswith("valid ")]
    blamed = bad if len(changed) < 2 else names  # one change may make another argument wrong
    verdict = NONSENSE if bad else VALID
    if not bad and (EDGE in verdicts.values() or len(changed) > 1):
        verdict = EDGE
    return Input(
        name=entry.name,
        verdict=verdict,
        call=lambda: entry.call(**{name: make() for name, (_, make) in makers.items()}),
        text=", ".join(f"{name} = <{label}>" for name, (label, _) in makers.items()),
        words=tuple(word for name in blamed for word in (name, *entry.arguments[name].words)),
        in_folder=entry.in_folder,
    )


def _value(rng, argument):
    """A value for an argument: its label, how to make it, its verdict."""
    while True:
        options = GENERAL if not argument.near or rng.random() < 0.6 else argument.near
        label = pick(rng, list(options))
        make = options[label]
        verdict = NONSENSE if isinstance(make, Bad) else argument.kind.verdict(make())
        if verdict != SKIP:
            return label, make, verdict


def _with_wrong_arity(rng, entry):
    good = {name: a.valid[0] for name, a in entry.arguments.items() if a.valid}
    if rng.random() < 0.5:
        return Input(
            name=entry.name,
            verdict=ARITY,
            call=lambda: entry.call(**{n: made(v) for n, v in good.items()}, no_such_argument=1),
            text="an argument that there is not",
            in_folder=entry.in_folder,
        )
    return Input(
        name=entry.name,
        verdict=ARITY,
        call=lambda: entry.call(*range(40)),
        text="forty arguments",
        in_folder=entry.in_folder,
    )


# --- functions of the user's --------------------------------------------------------------------


class OwnError(Exception):
    """An exception that only the user knows."""


_RAISED = (OwnError, ValueError, TypeError, KeyError, ZeroDivisionError, RuntimeError, OSError,
           AssertionError, RecursionError, np.linalg.LinAlgError, UnicodeError)  # fmt: skip


class _Object:
    """A function that is an object."""

    def __init__(self, function):
        self.function = function

    def __call__(self, *arguments):
        return self.function(*arguments)

    def __repr__(self):
        return "<the_users_object>"


def _hooked(rng, hook):
    draw_ = rng.random()
    if draw_ < 0.1:
        verdict, text, function = VALID, "a good one", hook.good
    elif draw_ < 0.35:
        return _raising(rng, hook)
    elif draw_ < 0.45:
        return _with_other_arguments(rng, hook)
    else:
        argument = Argument(hook.result, near=hook.near)
        label, make, verdict = _value(rng, argument)
        text = f"returns <{label}>"

        def function(*_):
            return make()

    return Input(
        name=hook.name,
        verdict=verdict,
        call=lambda: hook.call(function),
        text=text,
        in_folder=hook.in_folder,
    )


def _raising(rng, hook):
    kind = pick(rng, _RAISED)
    after = int(rng.integers(0, 2))
    calls = []

    def the_users_function(*arguments):
        calls.append(arguments)
        if len(calls) > after:
            raise kind("the user's own")
        return hook.good(*arguments)

    wrapped = pick(rng, (lambda f: f, _Object))(the_users_function)

    def call():
        result = hook.call(wrapped)
        if 0 < len(calls) <= after:  # it was called once only
            raise kind("the user's own")
        return result

    return Input(
        name=hook.name,
        verdict=OWN,
        call=call,
        text=f"raises {kind.__name__} at call {after + 1}",
        note=hook.words,
        function="the_users_",
        raises=kind,
        in_folder=hook.in_folder,
    )


def _with_other_arguments(rng, hook):
    def none():
        return 1.0

    def many(a, b, c, d, e, f):
        return 1.0

    def named(*, name):
        return 1.0

    wrong = pick(rng, (none, many, named))
    return Input(
        name=hook.name,
        verdict=OWN,
        call=lambda: hook.call(wrong),
        text=f"takes other arguments: {wrong.__name__}",
        note=hook.words,
        function=wrong.__name__,
        raises=TypeError,
        in_folder=hook.in_folder,
    )


def arg(kind, *valid, near=None, words=()):
    """An argument of the table."""
    return Argument(kind, valid, near or {}, tuple(words))
