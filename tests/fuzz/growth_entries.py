"""Laws, cycles, steps, histories and runs."""

import shutil
from pathlib import Path

import numpy as np

import xcrack as xc
from fuzz import scenes
from fuzz.entry import Bad, Entry, Hook, Late, arg
from fuzz.kinds import (
    SKIP,
    Called,
    Filename,
    Flag,
    ListOf,
    Number,
    Numbers,
    Of,
    Seen,
    Whole,
    Word,
    array,
    items_of,
)
from fuzz.result_rules import LOAD, NOTHING, NU, fits
from fuzz.values import paths
from xcrack import testing
from xcrack.growth.step import Arrival, StepControl
from xcrack.linalg.engine import SolverState

ANY = Numbers()

LAW = {
    "dK_eq": arg(Numbers(None, least=0.0, rule=fits()), 1.0, [1.0, 2.0]),
    "R": arg(
        Numbers(
            None,
            most=1.0,
            rule=lambda x: True if x.shape in ((), (1,)) and (x < 0.99).all() else None,
        ),
        0.1,
    ),
}

JOIN = xc.Join(1, 1e3, (0.5, 0.5), (0, 1))

CONSTANTS = {"C": arg(Number(above=0), 1e-3), "m": arg(Number(above=0), 3)}


def _step(**changes):
    given = scenes.history().steps[0]
    every = {
        name: getattr(given, name)
        for name in ("index", "cycles", "cracks", "sif", "angle", "dK_eq", "R", "rate", "da")
    }
    return xc.Step(**every | changes)


def _per_crack(value):
    items = items_of(value)
    if items is None or len(items) != 1:
        return False
    one = array(items[0])
    return one is not None and one.shape == (1,)


def _no_rows_or_one(value):
    """Whether there is nothing, which is filled in; of other values their shapes decide."""
    items = items_of(value)
    return True if items is not None and not len(items) else None


def _grow(**changes):
    given = {
        "problem": scenes.growing(),
        "law": xc.paris(1e-3, 2.0),
        "criterion": xc.max_hoop_stress,
        "cycle": xc.Cycle(0.0, 1.0),
        "da": 0.2,
        "progress": False,
        "max_steps": 1,
    }
    return list(xc.grow(**given | changes))


def _checked(**changes):
    given = {
        "problem": scenes.growing(),
        "law": xc.paris(1e-3, 2.0),
        "cycle": xc.Cycle(0.0, 1.0),
        "da": 0.2,
        "progress": False,
    }
    return [str(alarm) for alarm in xc.check(**given | changes)]


def _collected(steps=None, **options):
    return xc.collect(iter(scenes.history().steps) if steps is None else steps, **options)


def _growing():
    return {
        "path": "run",
        "problem": scenes.growing(),
        "law": xc.paris(1e-3, 2.0),
        "criterion": xc.max_hoop_stress,
        "cycle": xc.Cycle(0.0, 1.0),
        "da": 0.2,
        "progress": False,
        "max_steps": 2,
    }


def _resumed(**changes):
    shutil.copytree(scenes.stored(), "run")
    return xc.resume(**_growing() | changes)


def _run(**changes):
    shutil.copytree(scenes.stored(), "run")
    return xc.run(**_growing() | changes)


def _loaded(path):
    shutil.copytree(scenes.stored(), "run")
    return xc.load(path)


GROW = {
    "problem": arg(
        Seen(
            rule=lambda v: (
                isinstance(v, xc.Problem) and bool(v.cracks) and (v.mesh.dim == 2 or None)
            )
        ),
        Late(scenes.growing),
        words=["crack"],
    ),
    "law": arg(Called(), xc.paris(1e-3, 2.0), xc.walker(1e-3, 2.0, 0.5)),
    "criterion": arg(Called(), xc.max_hoop_stress, xc.weighted_angle),
    "cycle": arg(Of(type=xc.Cycle), xc.Cycle(0.0, 1.0), xc.Cycle(states=[1.0])),
    "da": arg(
        Number(optional=True, above=0, rule=lambda v: True if 0.1 <= v <= 0.3 else None), 0.2
    ),
    "cycles": arg(Number(optional=True, above=0, rule=lambda v: None), None),
    "scaling": arg(
        Seen(
            rule=lambda v: isinstance(v, str) and (v == "law" or (None if v == "linear" else False))
        ),
        "law",
    ),
    "integrator": arg(Word(words=("pec", "euler")), "pec", "euler"),
    "threshold": arg(Number(least=0), 0.0, 0.1),
    "retardation": arg(Seen(rule=lambda v: v is None), None),
    "load_program": arg(
        Of(optional=True, type=xc.LoadProgram), None, xc.load_over_size([(0.0, 1.0), (9.0, 0.9)])
    ),
    "K_c": arg(Number(optional=True, above=0), None, 1e3),
    "link_up": arg(Called(optional=True), None, xc.plastic_zone(400.0, 2)),
    "stop_at_interface": arg(Flag(), False, True),
    "max_steps": arg(
        Whole(
            least=1,
            rule=lambda v: v < 3 or None,
            far=2,
            also=(Seen(rule=lambda v: None if v is None else False),),
        ),
        1,
        2,
    ),
    "max_cycles": arg(Number(optional=True, above=0), None, 1e6, 10.0),
    "max_size": arg(Number(optional=True, above=0), None, 1e6),
    "solver": arg(Called(optional=True), None),
    "response": arg(Called(optional=True), None, xc.respond),
    "progress": arg(Flag(also=(Word(words=("always",)),)), False),
}


def _rates(v):
    """Whether a value is a growth rate of one tip."""
    x = array(v)
    return x is not None and x.shape == (1,) and bool((x >= 0).all())


RESUME = {
    "path": arg(
        Filename(known=("run", "./run"), folder=True),
        "run",
        near=paths("", ""),
        words=["run"],
    ),
    "problem": arg(
        Seen(
            rule=lambda v: v is scenes.growing() or (None if isinstance(v, xc.Problem) else False)
        ),
        Late(scenes.growing),
    ),
    "law": arg(Called(), xc.paris(1e-3, 2.0), near={"other": Bad(lambda: xc.paris(2e-3, 2.0))}),
    "criterion": arg(Called(), xc.max_hoop_stress, near={"other": Bad(lambda: xc.weighted_angle)}),
    "cycles": arg(Seen(rule=lambda v: v is None), None),
    "tolerance": arg(Seen(rule=lambda v: v is None), None),
    "max_unknowns": arg(Seen(rule=lambda v: v is None), None),
    "integrator": arg(Word(words=("pec",)), "pec"),
    "solver": arg(Called(optional=True), None),
    "response": arg(Seen(rule=lambda v: v is None), None),
    "progress": arg(Flag(also=(Word(words=("always",)),)), False),
    "K_c": arg(Number(optional=True, above=0), None, 1e3),
    "retardation": arg(Seen(rule=lambda v: v is None), None),
    "load_program": arg(Seen(rule=lambda v: v is None), None),
    "link_up": arg(Called(optional=True), None, xc.plastic_zone(400.0, 2)),
    "stop_at_interface": arg(Flag(), False, True),
    "max_steps": arg(Whole(least=1, rule=lambda v: v < 3 or None, far=2), 2),
    "max_cycles": arg(Number(optional=True, above=0), None, 1e6),
    "max_size": arg(Number(optional=True, above=0), None, 1e6),
    "until": arg(Called(optional=True), None),
    "cycle": arg(
        Seen(rule=lambda v: isinstance(v, xc.Cycle) and v.load_states == (0.0, 1.0)),
        xc.Cycle(0.0, 1.0),
    ),
    "da": arg(Number(least=0.2, most=0.2), 0.2),
    "scaling": arg(Word(words=("law",)), "law"),
    "threshold": arg(Number(least=0, most=0), 0.0),
    "keep_solutions": arg(Flag(), True),
}

ENTRIES = [
    Entry("paris", xc.paris, CONSTANTS),
    Entry(
        "elber",
        xc.elber,
        CONSTANTS
        | {
            "a": arg(Number(rule=lambda v: v > 0 or None), 0.5),
            "b": arg(Number(rule=lambda v: v >= 0 or None), 0.4),
        },
    ),
    Entry("walker", xc.walker, CONSTANTS | {"gamma": arg(Number(least=0, most=1), 0.5)}),
    Entry("paris", lambda dK_eq, R: xc.paris(1e-3, 3.0)(dK_eq, R), LAW),
    Entry("elber", lambda dK_eq, R: xc.elber(1e-3, 3.0, 0.5, 0.4)(dK_eq, R), LAW),
    Entry("walker", lambda dK_eq, R: xc.walker(1e-3, 3.0, 0.5)(dK_eq, R), LAW),
    Entry("elber", lambda R: xc.elber(1e-3, 3.0, 0.5, 0.4).U(R), {"R": arg(ANY, 0.1, [0.1, 0.2])}),
    Entry(
        "cycles_between",
        xc.cycles_between,
        {
            "a0": arg(
                Numbers(None, rule=lambda a: bool((a > 0).all() and (a <= 2).all())),
                1.0,
                words=["length"],
            ),
            "a1": arg(Numbers(None, least=1.0), 2.0, [2.0, 3.0], words=["length"]),
            "rate0": arg(
                Numbers(
                    None, rule=lambda a: bool((a > 0).all()) and (True if a.ndim == 0 else None)
                ),
                1e-3,
                words=["rate"],
            ),
            "rate1": arg(
                Seen(
                    rule=lambda v: (
                        (x := array(v)) is not None
                        and bool((x >= 0).all())
                        and (True if x.ndim == 0 else None)
                    )
                ),
                2e-3,
                0.0,
                np.inf,
                words=["rate"],
            ),
        },
    ),
    Entry(
        "Cycle",
        xc.Cycle,
        {"min": arg(Number(most=1.0), 0.0, 0.5), "max": arg(Number(least=0.5), 1.0)},
    ),
    Entry(
        "Cycle",
        lambda states: xc.Cycle(states=states),
        {
            "states": arg(
                ListOf(item=Number(also=(ListOf(item=LOAD),)), least=1),
                [1.0],
                [0.0, scenes.PULL],
                words=["load", "cycle"],
            )
        },
    ),
    Entry(
        "Response",
        xc.Response,
        {
            "states": arg(ListOf(rule=lambda v: len(v) == 1), [1.0], (0.5,)),
            "sif": arg(
                ListOf(item=ListOf(item=Of(type=xc.SIF)), least=1, most=1),
                Late(lambda: [[scenes.sif()]]),
                words=["K"],
            ),
            "solutions": arg(
                ListOf(item=Of(type=xc.Solution), rule=lambda v: len(v) < 2),
                (),
                Late(lambda: [scenes.solution()]),
            ),
            "reuse": arg(Of(type=SolverState), SolverState()),
            "load_factor": arg(Number(above=0), 1.0, 2.0),
            "has_known_bars": arg(Flag(), False, True),
        },
    ),
    Entry(
        "Response",
        lambda problem, states, K, T: xc.Response.of_K(problem, states, K, T).sif[0][0].K,
        {
            "problem": arg(Of(type=xc.Problem), Late(scenes.problem)),
            "states": arg(ListOf(rule=lambda v: len(v) == 1), [1.0]),
            "K": arg(Numbers((1, 1, 2)), np.ones((1, 1, 2))),
            "T": arg(Numbers((1, 1), optional=True), None, [[3.0]]),
        },
    ),
    Entry(
        "respond",
        lambda **given: xc.respond(**given).sif[0][0].K,
        {
            "problem": arg(Of(type=xc.Problem), Late(scenes.problem)),
            "states": arg(ListOf(item=Number(also=(ListOf(item=LOAD),)), least=1), [1.0]),
            "reuse": arg(Of(type=SolverState, optional=True), None, SolverState()),
            "bars": arg(Flag(), False, True),
            "solver": arg(Called(optional=True), None),
            "known_bars": arg(Called(optional=True), None),
        },
        cost=0.08,
    ),
    Entry(
        "Step",
        _step,
        {
            "index": arg(Whole(least=0), 0, 5),
            "cycles": arg(Number(least=0), 0.0, 1e3),
            "cracks": arg(
                ListOf(item=Of(type=xc.Crack), least=1, most=1), Late(lambda: [scenes.crack()])
            ),
            "sif": arg(
                ListOf(item=ListOf(item=Of(type=xc.SIF), least=1, most=1), least=1),
                Late(lambda: [[scenes.sif()]]),
                words=["K"],
            ),
            **{
                name: arg(Seen(rule=_per_crack), [[0.1]])
                for name in ("angle", "dK_eq", "R", "rate", "da")
            },
            "solutions": arg(
                ListOf(item=Of(type=xc.Solution)), (), Late(lambda: [scenes.solution()])
            ),
            "corrected": arg(
                ListOf(item=Of(type=xc.Crack), rule=lambda v: len(v) < 2),
                (),
                Late(lambda: [scenes.crack()]),
            ),
            "levels": arg(Numbers((None,)), (), [0.0, 1.0]),
            "states": arg(ListOf(item=Word(), rule=lambda v: len(v) in (0, 1)), (), ["max"]),
            "law_rate": arg(Seen(rule=_no_rows_or_one), (), [[0.1]]),
            "R_range": arg(Seen(rule=_no_rows_or_one), (), [[[0.0, 0.5]]]),
            "sizes": arg(Numbers((None,)), (), [1.0]),
            "load_factor": arg(Number(above=0), 1.0, 0.5),
            "control": arg(Of(type=StepControl), StepControl()),
            **{
                name: arg(Seen(rule=lambda v: v is None), None)
                for name in (
                    *("error", "identities", "stations", "solves", "zones", "earlier_zones"),
                    *("plan", "run", "validity"),
                )
            },
            "warnings": arg(ListOf(item=Word(), optional=True), None, ["a domain is clipped"]),
            "arrivals": arg(
                ListOf(item=Of(type=Arrival)), (), (Arrival(0, 0, (1.0, 0.5), "right", 0.1, 9.0),)
            ),
            "joins": arg(ListOf(item=Of(type=xc.Join)), (), [JOIN]),
        },
    ),
    Entry(
        "Step.end_name",
        lambda crack, number: scenes.history().steps[0].end_name(crack, number),
        {
            "crack": arg(Whole(least=0, most=0), 0),
            "number": arg(Whole(least=0, most=1, rule=lambda v: v == 0 or None), 0),
        },
    ),
    Entry(
        "Join",
        xc.Join,
        {
            "step": arg(Whole(least=0), 0, 5),
            "N": arg(Number(least=0), 0.0, 1e3),
            "point": arg(Numbers((None,), rule=lambda x: len(x) in (2, 3)), (0.5, 1.0)),
            "cracks": arg(ListOf(item=Whole(least=0), least=2, most=2), (0, 1)),
        },
    ),
    Entry(
        "History",
        xc.History,
        {
            "steps": arg(ListOf(item=Of(type=xc.Step)), Late(lambda: scenes.history().steps), ()),
            "ended": arg(Word(), "max_steps"),
            "path": arg(
                Seen(
                    rule=lambda v: (
                        v is None or (isinstance(v, str | Path) and "\0" not in str(v) and v != "")
                    )
                ),
                None,
                "a",
            ),
            "mesh": arg(Of(optional=True, type=xc.Mesh), None, Late(scenes.mesh)),
        },
    ),
    Entry(
        "History",
        lambda measures: scenes.history().table(measures)["N"],
        {"measures": arg(Flag(), False, True)},
    ),
    Entry("grow", _grow, GROW, cost=0.12),
    Entry("check", _checked, GROW, cost=0.1),
    Entry(
        "check",
        lambda **named: _checked(da=None, **named),
        {
            "tolerance": arg(Number(above=0, below=1), 0.2, 0.5),
            "max_unknowns": arg(Whole(least=1, most=10**9, far=1e9, optional=True), None, 20_000),
        },
        cost=0.1,
        arity=False,
    ),
    Entry(
        "grow",
        lambda retardation: _grow(
            cycle=xc.Spectrum([0.0, 0.5, 0.0, 1.0]), retardation=retardation, max_steps=1
        ),
        {
            "retardation": arg(
                Of(optional=True, type=xc.wheeler | xc.willenborg),
                None,
                xc.wheeler(1.0, xc.plastic_zone(400.0, beta=2)),
            )
        },
        arity=False,
        cost=0.1,
    ),
    Entry(
        "grow",
        lambda **named: _grow(da=None, **named)[-1].cycles,
        {
            "tolerance": arg(Number(above=0, below=1, rule=lambda v: v >= 0.05 or SKIP), 0.2, 0.5),
            "max_unknowns": arg(
                Whole(
                    least=1, most=10**7, far=1e9, optional=True, rule=lambda v: v >= 5000 or None
                ),
                None,
                20_000,
            ),
        },
        cost=0.6,
        arity=False,
    ),
    Entry(
        "collect",
        _collected,
        {
            "steps": arg(
                ListOf(item=Of(type=xc.Step)),
                Late(lambda: iter(scenes.history().steps)),
                words=["Step"],
            ),
            "path": arg(
                Filename(optional=True, folder=True),
                None,
                "good",
                near=paths("", ""),
                words=["folder"],
            ),
            "until": arg(Called(optional=True), None),
            "overwrite": arg(Flag(), False, True),
            "keep_solutions": arg(Flag(), True, False),
        },
        in_folder=True,
        cost=0.02,
    ),
    Entry(
        "resume",
        _resumed,
        RESUME,
        in_folder=True,
        cost=0.03,
    ),
    Entry(
        "run",
        _run,
        {name: kind for name, kind in RESUME.items() if name != "path"},
        in_folder=True,
        cost=0.03,
    ),
    Entry(
        "load",
        _loaded,
        {"path": arg(Filename(known=("run", "./run")), "run", near=paths("", ""), words=["run"])},
        in_folder=True,
        cost=0.02,
    ),
    Entry(
        "testing.check_law",
        testing.check_law,
        {"law": arg(Called(), xc.paris(1e-3, 3)), "dK_max": arg(Number(above=0), 10.0)},
    ),
    Entry(
        "testing.check_criterion",
        testing.check_criterion,
        {"criterion": arg(Called(), xc.max_hoop_stress), "nu": arg(NU, 0.3)},
    ),
]
HOOKS = [
    Hook(
        "grow",
        lambda f: _grow(law=f, max_steps=2),
        lambda dK, R: 1e-3 * dK,
        Seen(rule=_rates),
        "growth rates",
        cost=0.1,
    ),
    Hook(
        "grow",
        lambda f: _grow(criterion=f, max_steps=2),
        lambda K, nu: (K[0, :, 0] * 0, K[1, :, 0], K[1, :, 0] * 0),
        NOTHING,
        "directions",
        cost=0.1,
    ),
    Hook(
        "grow",
        lambda f: _grow(response=f, max_steps=2),
        xc.respond,
        Of(type=xc.Response),
        "response",
        cost=0.1,
    ),
    Hook("collect", lambda f: _collected(until=f), lambda step: False, Flag(), "until"),
]
