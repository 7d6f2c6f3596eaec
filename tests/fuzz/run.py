"""Many inputs, and the counts of what came of them.

``python -m fuzz.run 200 20419`` in the folder `tests`: so many, a seed, and numbers of single ones.
"""

import sys
import time
from collections import Counter

import numpy as np

from fuzz import (
    body_entries,
    campaign_entries,
    case_entries,
    chart_entries,
    crack_entries,
    file_entries,
    generator_entries,
    growth_entries,
    law_entries,
    life_entries,
    load_entries,
    problem_entries,
    service_entries,
    solution_entries,
    spectrum_entries,
)
from fuzz.entry import draw
from fuzz.outcome import BAD, GOOD, Outcome, outcome_of

PARTS = (
    body_entries,
    case_entries,
    chart_entries,
    generator_entries,
    campaign_entries,
    crack_entries,
    load_entries,
    problem_entries,
    service_entries,
    solution_entries,
    spectrum_entries,
    growth_entries,
    law_entries,
    life_entries,
    file_entries,
)
TABLE = [one for part in PARTS for one in (*part.ENTRIES, *part.HOOKS)]


def drawn(seed, number):
    """The input of a number."""
    return draw(np.random.default_rng([seed, number]), TABLE)


def run(seed, numbers):
    """Outcomes of inputs: counts by class, lines about what must not be, seconds by name."""
    counts, faults, times = Counter(), [], Counter()
    for number in numbers:
        one = drawn(seed, number)
        begin = time.perf_counter()
        outcome = outcome_of(one)
        times[one.name] += time.perf_counter() - begin
        counts[outcome.kind] += 1
        if outcome.kind in BAD:
            faults.append(line(seed, number, one, outcome))
    return counts, faults, times


def line(seed, number, one, outcome: Outcome):
    """One line about an input and what came of it."""
    seen = " ".join(outcome.seen.split())[:400]
    return f"{seed}/{number} {outcome.kind}: {one.name}({one.text}) [{one.verdict}]: {seen}"


def table(counts):
    """Counts by class as text."""
    return ", ".join(f"{counts[kind]} {kind}" for kind in (*GOOD, *BAD))


if __name__ == "__main__":
    count, seed, *only = map(int, sys.argv[1:])
    counts, faults, times = run(seed, only or range(count))
    print(*faults, sep="\n")
    print(table(counts))
    print({name: round(seconds, 1) for name, seconds in times.most_common(12)})
