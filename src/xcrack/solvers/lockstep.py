"""Iterations that run beside one another, so that one pass over a matrix serves them all.

An iteration is a generator: it yields what it asks of the operator, and is sent the answer. Each
has its own steps, sets and end. What several ask for at a time is done at once, and an answer has
the same bits whatever is asked beside it: so have the results.
"""

import itertools
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar, cast

from xcrack.arrays import Floats
from xcrack.threads import each

_BESIDE = 4  # iterations at a time: as many vectors as one pass over a matrix takes

Result = TypeVar("Result")
Apply = Callable[[Floats], Floats]
ApplyAll = Callable[[Sequence[Floats]], list[Floats]]


class Ask(Enum):
    """What an iteration asks for."""

    TIMES = "K v"
    CYCLE = "V r"


Request = tuple[Ask, Floats]
Iteration = Generator[Request, Floats, Result]


@dataclass(frozen=True, eq=False)
class Operator:
    """A symmetric positive matrix and what is needed to solve with it.

    Attributes
    ----------
    times : callable
        v -> K v.
    cycle : callable
        r -> V r, an approximate inverse, symmetric and positive.
    diagonal : (n,) array
    null : (m, k) array
        Orthonormal vectors that K sends to zero, in the first m unknowns: the others of theirs are
        zero. k = 0 for a regular matrix.
    times_all, cycle_all : callable, optional
        The same of several vectors, with the same bits.
    """

    times: Apply
    cycle: Apply
    diagonal: Floats
    null: Floats
    times_all: ApplyAll | None = None
    cycle_all: ApplyAll | None = None

    def answers(self, ask: Ask, vectors: Sequence[Floats]) -> list[Floats]:
        """What is asked for of several vectors."""
        one, several = self.times, self.times_all
        if ask is Ask.CYCLE:
            one, several = self.cycle, self.cycle_all
        if len(vectors) == 1 or several is None:
            return [one(v) for v in vectors]
        return several(vectors)


def in_lockstep(K: Operator, iterations: Sequence[Iteration[Result]]) -> list[Result]:
    """Results of iterations; threads run what each does between its requests.

    Parameters
    ----------
    K : Operator
    iterations : sequence of generators
    """
    results: list[Any] = [None] * len(iterations)

    def advanced(task: tuple[int, Floats | None]) -> Request | None:
        k, answer = task
        try:
            return iterations[k].send(cast(Floats, answer))
        except StopIteration as end:
            results[k] = end.value
            return None

    waiting: dict[int, Request] = {}
    tasks: list[tuple[int, Floats | None]] = []
    following = iter(range(len(iterations)))
    while True:
        beside = _BESIDE - len(waiting) - len(tasks)
        tasks += [(k, None) for k in itertools.islice(following, beside)]
        if not tasks and not waiting:
            return cast(list[Result], results)
        for (k, _), request in zip(tasks, each(advanced, tasks), strict=True):
            if request is not None:
                waiting[k] = request
        tasks = []
        if not waiting:
            continue
        # Products first: those who looked at their sets meet the others at the next cycle.
        products = any(ask is Ask.TIMES for ask, _ in waiting.values())
        ask = Ask.TIMES if products else Ask.CYCLE
        served = [k for k, (own, _) in waiting.items() if own is ask]
        vectors = [waiting.pop(k)[1] for k in served]
        tasks = list(zip(served, K.answers(ask, vectors), strict=True))
