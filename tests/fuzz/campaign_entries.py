"""Campaigns."""

import xcrack as xc
from fuzz.entry import Entry, arg
from fuzz.kinds import Filename, Flag, Seen, Whole


def half(a):
    """A case that takes no time."""
    return {"half": a / 2}


def _run(cases, path, workers, retry):
    return xc.campaign(half, cases, path=path, workers=workers, retry=retry).table()["half"]


CASES = [{"a": 1}, {"a": 2.5}]

ENTRIES = [
    Entry("grid", lambda a: len(xc.grid(a=a)), {"a": arg(Seen(rule=lambda v: None), [1, 2])}),
    Entry(
        "campaign",
        _run,
        {
            "cases": arg(Seen(rule=lambda v: True if v is CASES else None), CASES),
            "path": arg(Filename(folder=True, rule=None), "study"),
            "workers": arg(Whole(least=1, most=1, rule=lambda v: v == 1), 1),
            "retry": arg(Flag(), False),
        },
        in_folder=True,
    ),
]
HOOKS = []
