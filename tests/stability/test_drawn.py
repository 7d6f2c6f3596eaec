"""Random cracks: every one solved, none far from its like; a seed makes a scene again.

The whole campaign (1000 in 2D, 100 in 3D) is benchmarks/stability.py; a tenth of it is a
test. Errors are of discretisation, judged against the median of their class.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from support import scenes_drawn

PUBLISHED = Path(__file__).parents[2] / "benchmarks" / "results" / "stability.json"


def campaign(seeds, where):
    """Judgement of the scenes of these seeds, printed."""
    result = {seed: scenes_drawn.drawn(seed, where) for seed in seeds}
    judged = scenes_drawn.judged(result)
    for name, row in judged["classes"].items():
        print(f"\n{where}, {name}: {row['solved']} of {row['scenes']}, median {row['median']:.1e}, "
              f"worst {row['ratio']:.2f} times that (seed {row['seed of the worst']})",
              end="")  # fmt: skip
    return judged


def test_one_of_each_class_in_the_plane():
    for seed in range(710, 714):
        name, error, messages = scenes_drawn.drawn(seed)
        assert messages == "", (seed, name)
        assert error <= (0.06 if name == "half closed" else 3e-3), (seed, name)


def test_a_seed_makes_the_same_scene_again():
    """To the last bit: nothing but the seed decides."""
    assert scenes_drawn.drawn(720) == scenes_drawn.drawn(720)
    assert scenes_drawn.drawn(720)[1] != scenes_drawn.drawn(724)[1]


def test_the_worst_of_before():
    """Few points with tip functions, or a piece of pressure at a tip of one cell or of three."""
    medians = {
        "edge crack": 6.2e-5,
        "open": 2.6e-4,
        "closed, sliding": 7.4e-4,
        "half closed": 3.2e-2,
    }
    for seed in (510270, 510296, 510379, 510396, 510509):  # 3.3 to 4.0 of the medians of then
        name, error, _ = scenes_drawn.drawn(seed)
        # Twice as large where a uniform pressure has more unknowns than it needs.
        assert error <= (2.2 if name == "closed, sliding" else 1.2) * medians[name], (seed, name)


def test_a_class_of_space():
    """A straight front askew to the mesh, six cells a side: the quickest of the three."""
    name, error, messages = scenes_drawn.drawn(722, "space", 6)
    assert (name, messages) == ("straight front", "")
    assert error <= 0.05


def test_the_judge_sees_what_fails():
    """One error far out and one scene without a solution: both are told with their seeds."""
    result = {seed: ("a", 1.0 + 0.01 * seed, "") for seed in range(8)}
    result |= {8: ("a", 3.5, ""), 9: ("a", None, "SolverError: singular")}
    judged = scenes_drawn.judged(result)
    assert judged["pass rate"] == pytest.approx(0.8)
    assert set(judged["failed"]) == {8, 9}
    assert judged["failed"][9] == "SolverError: singular"
    assert judged["classes"]["a"]["solved"] == 9
    assert judged["classes"]["a"]["beyond"] == [8]


def test_what_raises_is_a_failure_and_no_crash(monkeypatch):
    def broken(rng, n):
        raise ZeroDivisionError("a pivot")

    monkeypatch.setitem(scenes_drawn.CLASSES["plane"], "edge crack", broken)
    assert scenes_drawn.drawn(400) == ("edge crack", None, "ZeroDivisionError: a pivot")


@pytest.mark.slow
@pytest.mark.mission
def test_a_tenth_of_the_campaign():
    for where, seeds in (("plane", range(710000, 710100)), ("space", range(720000, 720012))):
        judged = campaign(seeds, where)
        assert all(row["solved"] == row["scenes"] for row in judged["classes"].values()), where
        # Of whole campaigns one or two in 1000 lie beyond 3 medians, none beyond 4.
        assert judged["pass rate"] >= 0.97, judged["failed"]
        assert max(row["ratio"] for row in judged["classes"].values()) <= 5.0


def test_published_campaign_is_whole():
    """At least 1000 and 100 scenes, all of them solved, and a pass rate that follows from them."""
    drawn = json.loads(PUBLISHED.read_text(encoding="utf-8"))["drawn"]
    count = {"plane": 0, "space": 0}
    for key, entry in drawn.items():
        where = key.partition(",")[0]
        count[where] += len(entry["errors"])
        again = scenes_drawn.judged({int(s): e for s, e in entry["errors"].items()})
        assert again["pass rate"] == pytest.approx(entry["pass rate"])
        assert all(e is not None and np.isfinite(e) for _, e, _ in entry["errors"].values())
    assert count["plane"] >= 1000
    assert count["space"] >= 100
