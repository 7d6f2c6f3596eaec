"""Settings of a run as text, and runs that are taken up again with others."""

import functools
import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from support.growth_fakes import plate
from support.growth_runs import *  # noqa: F403 - fixtures come by name
from support.growth_runs import content, run_of, scene
from xcrack import (
    Cycle,
    Isotropic,
    Problem,
    ProblemError,
    Response,
    XcrackWarning,
    body_force,
    box,
    collect,
    grow,
    load,
    max_hoop_stress,
    paris,
    penny_crack,
    resume,
    save,
    solve,
)
from xcrack.base import description
from xcrack.base.description import describe, differences
from xcrack.base.machine import versions
from xcrack.growth.options import GrowthRule
from xcrack.runs import collect as collecting


def push(size):
    return lambda x: np.full_like(x, size)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"law": paris(1e-11, 3.1)}, r"law\.m: stored 3\.0, given 3\.1"),
        ({"criterion": max_hoop_stress}, r"criterion: stored xcrack\.weighted_angle, given .*hoop"),
        ({"cycle": Cycle(0.1, 1.0)}, r"cycle\.min: stored 0\.0, given 0\.1"),
        ({"da": 1.8}, r"da: stored 1\.7, given 1\.8"),
        ({"threshold": 1.0}, r"threshold: stored 0\.0, given 1\.0"),
        ({"scaling": "linear"}, "scaling"),
        ({"cycles": 1e5}, "cycles: stored None, given 100000"),
    ],
)
def test_resume_names_what_is_different(whole, changes, words):
    before = content(whole.path)
    with pytest.raises(ProblemError, match=words):
        resume(whole.path, **run_of(**changes))
    assert content(whole.path) == before


def test_resume_names_what_is_different_in_the_problem(whole):
    problem = scene()
    for changed, words in (
        (replace(problem, material=replace(problem.material, nu=0.2)), r"problem\.material\.nu"),
        (replace(problem, order=1), r"problem\.order: stored 2, given 1"),
        (replace(problem, contact="off"), r"problem\.contact"),
        (replace(problem, numerics=replace(problem.numerics, points=5)), r"numerics\.points"),
        (replace(problem, loads=[body_force((1.0, 0.0))]), r"problem\.loads"),
        (replace(problem, cracks=problem.cracks[:1]), "problem.cracks: stored 2 entries, given 1"),
        (plate(problem.cracks, n=(60, 41)), r"problem\.mesh\.(cells|points)"),
    ):
        with pytest.raises(ProblemError, match=words):
            resume(whole.path, **run_of(changed))


# --- functions of the user -----------------------------------------------------------------------


def test_functions_are_known_by_what_they_do():
    one = describe("f", push(1.0))
    assert differences(one, describe("f", push(1.0))) == []
    assert differences(one, describe("f", push(2.0))) == ["f.size: stored 1.0, given 2.0"]
    twin = describe("f", (lambda size: lambda x: np.full_like(x, 2 * size))(1.0))
    assert len(differences(one, twin)) == 1


SCRIPT = """
import functools, math
import numpy as np
from dataclasses import dataclass
from scipy.interpolate import CubicSpline
FACTOR = 1.0
CONSTANTS = {"C": 1e-11, "limits": [1.0, 2.0]}
POINTS = [(0.0, 1.0), (1.0, 2.0)]
TAGS = {"steel", "air"}
TABLE = CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, 4.0])
def inner(x):
    return FACTOR * x
def helper(x):
    return sum(inner(v) for v in x)
@functools.lru_cache
def cached(x):
    return 3.0 * x
class Base:
    def rate(self, dK):
        return 2.0 * dK
class Law(Base):
    __slots__ = ("C",)
    def __init__(self, C):
        self.C = C
    def __call__(self, dK, R):
        return self.C * self.rate(dK)
@dataclass
class Own:
    C: float = 1.0
    def __call__(self, dK, R):
        return self.C * dK
def law(dK, R):
    small = [k for k in range(3) if k < CONSTANTS["limits"][1]]
    return helper(dK) + len(POINTS) + len(TAGS) + TABLE(0.5) + cached(1.0) + math.pi
"""


def described(*changes, name="law"):
    """Settings of a law of a script, after texts of it were replaced."""
    text = SCRIPT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    names = {"__name__": "__main__"}
    exec(compile(text, "script.py", "exec"), names)
    return describe("law", eval(name, names))


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("FACTOR = 1.0", "FACTOR = 2.0", "law.helper.inner.FACTOR: stored 1.0, given 2.0"),
        ("FACTOR * x", "FACTOR / x", "law.helper.inner: stored inner sha256"),
        ("sum(inner", "max(inner", "law.helper: stored helper sha256"),
        ('"C": 1e-11', '"C": 2e-11', "law.CONSTANTS['C']: stored 1e-11, given 2e-11"),
        ("[1.0, 2.0]}", "[1.0, 3.0]}", "law.CONSTANTS['limits'][1]: stored 2.0, given 3.0"),
        ("(1.0, 2.0)]", "(1.0, 2.5)]", "law.POINTS[1][1]: stored 2.0, given 2.5"),
        ('"air"}', '"sea"}', "law.TAGS[0]: stored 'air', given 'sea'"),
        ("[0.0, 1.0, 4.0]", "[0.0, 1.0, 5.0]", "law.TABLE"),
        ("3.0 * x", "4.0 * x", "law.cached: stored cached sha256"),
        ("range(3)", "range(4)", "law: stored law sha256"),
    ],
)
def test_what_a_law_reads_is_followed(old, new, key):
    """Helpers of helpers, constants, dicts, lists, sets, tables, caches."""
    lines = differences(described(), described((old, new)))
    assert lines
    assert any(line.startswith(key) for line in lines), lines


@pytest.mark.parametrize(
    ("name", "old", "new", "key"),
    [
        ("Law(1.0)", "self.C * self.rate", "self.C + self.rate", "law.Law.__call__"),
        ("Law(1.0)", "2.0 * dK", "3.0 * dK", "law.Base.rate"),
        ("Own()", "self.C * dK", "self.C + dK", "law.Own.__call__"),
        ("Own()", "C: float = 1.0", "C: float = 2.0", "law.C: stored 1.0, given 2.0"),
        ("functools.partial(Own(), R=0)", "self.C * dK", "self.C + dK", "law.Own.__call__"),
        ("Own().__call__", "self.C * dK", "self.C + dK", "law: stored Own.__call__"),
        ("np.vectorize(inner)", "FACTOR * x", "FACTOR / x", "law.pyfunc: stored inner"),
    ],
)
def test_objects_as_laws_are_followed(name, old, new, key):
    lines = differences(described(name=name), described((old, new), name=name))
    assert any(line.startswith(key) for line in lines), lines


def test_the_state_of_an_object_counts():
    one, other = (describe("law", eval(f"Law({C})", _names())) for C in (1.0, 2.0))
    assert differences(one, other) == ["law.C: stored 1.0, given 2.0"]


def _names():
    names = {"__name__": "__main__"}
    exec(compile(SCRIPT, "script.py", "exec"), names)
    return names


def test_what_is_the_same_has_the_same_text():
    """Twice in one process, with other comments and docstrings, and in a process of its own."""
    one = described()
    assert described() == one
    documented = 'def law(dK, R):\n    """A law."""'
    assert (
        described(
            ("def law(dK, R):", "# here\n" + documented),
        ).keys()
        == one.keys()
    )
    assert described(("def law(dK, R):", documented)) == described(
        ("def law(dK, R):", documented.replace("A law.", "Another text."))
    )
    imported = "from xcrack.base.description import describe"
    code = f"{SCRIPT}\n{imported}\nprint(describe('law', law))"
    for seed in ("1", "2"):
        child = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        )
        assert eval(child.stdout) == one


def test_libraries_are_named_not_followed():
    def law(dK, R):
        return np.linalg.norm(dK) + math.hypot(1.0, 2.0) + CubicSpline([0, 1], [0, 1])(R)

    lines = describe("law", law)
    assert lines["law.CubicSpline"] == "scipy.interpolate._cubic.CubicSpline"
    assert len(lines) == 2


def test_what_refers_to_itself_ends():
    def even(n):
        return n == 0 or odd(n - 1)

    def odd(n):
        return n != 0 and even(n - 1)

    box = {"even": even}
    box["box"] = box
    lines = describe("law", functools.partial(even, box))
    assert lines["law.args[0]['box']"] == "itself"
    assert lines["law.odd"].startswith("test_what_refers")


def test_long_lists_are_stored_by_a_hash():
    lines = describe("x", list(range(10_000)))
    assert list(lines) == ["x"]
    assert lines["x"] != describe("x", [*range(9_999), 0])["x"]


@dataclass
class Growing:
    """A law that counts its calls: what it reads changes while a run goes on."""

    calls: list

    def __call__(self, dK, R):
        self.calls.append(len(self.calls))
        return 1e-11 * dK**3


def test_settings_are_those_before_the_first_call(tmp_path):
    run = run_of(law=Growing([]), max_steps=2)
    collect(grow(**run), tmp_path)
    history = resume(tmp_path, **run_of(law=Growing([])), until=lambda step: step.index == 3)
    assert len(history.steps) == 4


def test_a_run_with_a_law_of_the_user_says_what_changed(tmp_path):
    constants = {"C": 1e-11}

    def law(dK, R):
        return constants["C"] * dK**3

    collect(grow(**run_of(law=law)), tmp_path)
    constants["C"] = 2e-11
    with pytest.raises(ProblemError, match=r"law\.constants\['C'\]: stored 1e-11, given 2e-11"):
        resume(tmp_path, **run_of(law=law))


# --- versions, threads, defaults -----------------------------------------------------------------


def test_other_versions_are_warned_of(whole):
    path = whole.path / "run.json"
    path.write_text(path.read_text().replace(np.__version__, "1.0.0"))
    with pytest.warns(XcrackWarning, match=r"other versions.*numpy: stored 1\.0\.0"):
        resume(whole.path, **run_of())


def test_the_number_of_threads_is_recorded_and_reported(whole, monkeypatch):
    path = whole.path / "run.json"
    assert f'"BLAS threads": "{versions()["BLAS threads"]}"' in path.read_text()
    monkeypatch.setattr(collecting, "versions", lambda: {**versions(), "BLAS threads": "7"})
    with pytest.warns(XcrackWarning, match=r"other threads.*BLAS threads: stored .*, given 7"):
        resume(whole.path, **run_of())


def test_threads_of_a_process_are_counted():
    """As OpenBLAS counts them, in a process that was given another number."""
    code = "from xcrack.base.machine import versions; print(versions()['BLAS threads'])"
    for count in ("1", "2"):
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        child = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, **dict.fromkeys(names, count)},
        )
        assert child.stdout.strip() == count


def test_another_python_compiles_other_code(tmp_path, monkeypatch):
    """Then code cannot be compared: a warning, where the same python refuses."""

    def law(dK, R):
        return 1e-11 * dK**3

    whole = collect(grow(**run_of(law=law)), tmp_path / "one")
    before = content(whole.path)
    monkeypatch.setattr(description, "code_of", lambda f: "sha256:0123456789abcdef")
    with pytest.raises(ProblemError, match="other settings"):
        resume(whole.path, **run_of(law=law))
    monkeypatch.setattr(collecting, "versions", lambda: {**versions(), "python": "3.99.0"})
    with pytest.warns(XcrackWarning, match=r"python: stored .*law: its code cannot be compared"):
        resume(whole.path, **run_of(law=law))
    assert content(whole.path) == before


def test_a_later_option_is_no_difference_at_its_default(whole):
    """A run from before there was an option goes on where that is left out, and says so else."""
    path = whole.path / "run.json"
    stored = json.loads(path.read_text())
    del stored["settings"]["threshold"]
    for file in whole.path.glob("step_*.npz"):
        with np.load(file, allow_pickle=False) as members:
            arrays = dict(members)
        header = json.loads(str(arrays["run"]))
        del header["settings"]["threshold"]
        np.savez(file, **{**arrays, "run": np.array(json.dumps(header))})
    path.write_text(json.dumps(stored))
    assert len(resume(whole.path, **run_of(max_steps=6)).steps) == 6
    with pytest.raises(ProblemError, match=r"threshold: stored nothing, given 1\.0"):
        resume(whole.path, **run_of(threshold=1.0))


def test_what_changes_no_result_is_not_in_the_settings():
    keys = set(GrowthRule(**run_of(max_steps=3, K_c=1e9, progress=False)).settings)
    assert not keys & {"max_steps", "max_cycles", "K_c", "progress"}
    assert {"problem.order", "threshold", "integrator"} <= keys  # defaults too


# Order in space.


def block(**options):
    crack = penny_crack((0.01, -0.02, 0.03), (0.3, -0.5, 1.0), 0.5, n=32)
    return Problem(box((-1,) * 3, (1,) * 3, 5), Isotropic(210e3, 0.3), [crack], **options)


def sneddon(problem, states, reuse, bars):
    """K_I = 2 stress √(a / π) along a penny."""
    a = np.linalg.norm(problem.stations.x, axis=1)
    K = np.zeros((len(states), len(a), 3))
    K[:, :, 0] = np.multiply.outer(states, 200 * np.sqrt(a / np.pi))
    return Response.of_K(problem, states, K)


def in_space(problem, **changes):
    given = {"da": 0.1, "criterion": max_hoop_stress, "response": sneddon, "progress": False}
    return run_of(problem, **given | {"cycle": Cycle(0.0, 1.0), "max_steps": 2} | changes)


def test_a_run_goes_on_with_the_order_it_began_with(tmp_path):
    collect(grow(**in_space(block(order=1))), tmp_path / "run")
    with pytest.raises(ProblemError, match=r"problem\.order: stored 1, given 2"):
        resume(tmp_path / "run", **in_space(block()))


def test_faces_that_rub_in_space_have_order_1():
    """Order 2 takes up to 3.5 times as long there, twenty times by iteration (docs/measured.md)."""
    assert block(friction=0.3).order == 1
    assert block(friction=[0.3]).order == 1
    assert block(friction=0.3, order=2).order == 2
    assert block(friction=0.3, contact="off").order == block(friction=0.0).order == 2
    assert scene().order == replace(scene(), friction=0.3).order == 2


def test_a_stored_solution_keeps_its_order(tmp_path):
    solution = solve(block(order=1))
    assert load(save(solution, tmp_path / "one")).problem.order == 1
