"""Campaigns: rows, failures, resuming, workers that die, clients, and what is refused."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from support import campaign_cases
from xcrack import ProblemError, XcrackWarning, campaign, grid

TESTS = Path(__file__).parents[1]


def test_rows_and_failures(tmp_path):
    cases = grid(a=[1, 2, 3, 4], load=[1.0, 2.0])
    study = campaign(campaign_cases.formula, cases, path=tmp_path / "study")
    table = study.table()
    assert table["a"].tolist() == [1, 1, 2, 2, 3, 3, 4, 4]
    assert table["life"][:4].tolist() == [1e6, 1.25e5, 5e5, 6.25e4]
    assert np.isnan(table["life"][4:]).all()
    assert [row["kind"] for row in study.failed] == [
        *["ProblemError"] * 2,
        *["ZeroDivisionError"] * 2,
    ]
    assert "nobody expected this" in study.failed[-1]["trace"]
    assert study.failed[0]["trace"] == ""
    assert table["error"][4] == "no crack of 3."


def row_of(folder, case):
    """The file of a finished case."""
    rows = {file: json.loads(file.read_text()) for file in folder.glob("row_*.json")}
    (file,) = (file for file, row in rows.items() if row["parameters"] == case)
    return file


def test_finished_cases_are_not_run_again(tmp_path):
    cases = [{"a": a, "folder": str(tmp_path)} for a in range(3)]
    for _ in range(3):
        study = campaign(campaign_cases.counted, cases, path=tmp_path / "study")
    more = [*cases, {"a": 7, "folder": str(tmp_path)}]
    study = campaign(campaign_cases.counted, more, path=tmp_path / "study")
    assert study.table()["twice"].tolist() == [0, 2, 4, 14]
    assert all((tmp_path / f"ran_{a}").read_text() == "x" for a in (0, 1, 2, 7))
    row_of(tmp_path / "study", cases[1]).write_text("{")  # a damaged row is run again
    campaign(campaign_cases.counted, cases, path=tmp_path / "study")
    assert (tmp_path / "ran_1").read_text() == "xx"


def test_failures_are_repeated_on_demand(tmp_path):
    cases = grid(a=[1, 3])
    campaign(campaign_cases.formula, cases, path=tmp_path)
    file = row_of(tmp_path, cases[1])
    before = file.stat().st_mtime_ns
    campaign(campaign_cases.formula, cases, path=tmp_path)
    assert file.stat().st_mtime_ns == before
    campaign(campaign_cases.formula, cases, path=tmp_path, retry=True)
    assert file.stat().st_mtime_ns > before


def test_any_client_with_submit(tmp_path):
    with ThreadPoolExecutor(2) as pool:
        study = campaign(campaign_cases.formula, grid(a=[1, 2]), path=tmp_path, client=pool)
    assert study.table()["life"].tolist() == [1e6, 5e5]


class Dying:
    """A client that answers some times, and then no more."""

    def __init__(self, answers):
        self.left = answers

    def submit(self, function, *arguments):
        self.left -= 1
        lives = self.left >= 0

        class Future:
            def result(self):
                if not lives:
                    raise ConnectionError("the scheduler is gone")
                return function(*arguments)

        return Future()


def test_a_client_that_dies_loses_nothing(tmp_path):
    cases = grid(a=[1, 2, 5, 6])
    with pytest.raises(ProblemError, match=r"no answer for the case .*the scheduler is gone"):
        campaign(campaign_cases.formula, cases, path=tmp_path, client=Dying(2))
    assert len(list(tmp_path.glob("row_*.json"))) == 2
    study = campaign(campaign_cases.formula, cases, path=tmp_path)
    assert not study.failed
    assert study.table()["life"].tolist() == [1e6, 5e5, 2e5, 1e6 / 6]


def test_names_of_cases_do_not_change(tmp_path):
    """By the parameters alone: of these two since the first version."""
    for case in ({"a": 5, "load": 0.8}, {"load": 0.8, "a": 5}):
        campaign(campaign_cases.formula, [case], path=tmp_path)
        assert row_of(tmp_path, case).name == "row_2238ff9b7d50a08d.json"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"case": 3}, "case = 3"),
        ({"cases": 3}, "cases = 3"),
        ({"cases": []}, "empty"),
        ({"cases": [3]}, r"cases\[0\] = 3"),
        ({"cases": [{"a": np.nan}]}, "finite"),
        ({"cases": [{"a": [1, 2]}]}, r"cases\[0\]\['a'\]"),
        ({"workers": 0}, "workers = 0"),
        ({"client": 3}, "client = 3"),
        ({"path": ""}, "path"),
    ],
)
def test_bad_input(tmp_path, change, words):
    given = {"case": campaign_cases.formula, "cases": [{"a": 1}], "path": tmp_path, **change}
    case, cases = given.pop("case"), given.pop("cases")
    with pytest.raises(ProblemError, match=words):
        campaign(case, cases, **given)


def test_a_folder_of_another_case_is_refused(tmp_path):
    campaign(campaign_cases.formula, grid(a=[1]), path=tmp_path)
    with pytest.raises(ProblemError, match="another case"):
        campaign(campaign_cases.plate, grid(a=[5.0], stress=[1.0]), path=tmp_path)
    (tmp_path / "study.json").write_text("[]")
    with pytest.raises(ProblemError, match="no header"):
        campaign(campaign_cases.formula, grid(a=[1]), path=tmp_path)
    with pytest.raises(ProblemError, match="a = 'low'"):
        grid(a="low")


def test_a_case_must_return_numbers(tmp_path):
    study = campaign(dict, [{"a": "text"}], path=tmp_path / "one")
    assert study.table()["a"][0] == "text"
    study = campaign(lambda a: a, [{"a": 1}], path=tmp_path / "two")
    assert "give a History" in study.failed[0]["error"]


def test_a_result_cannot_take_the_column_of_a_parameter(tmp_path):
    study = campaign(lambda a: {"a": 7.0}, [{"a": 1.0}, {"a": 7.0}], path=tmp_path / "one")
    assert study.table()["a"].tolist() == [1.0, 7.0]
    assert "'a', which is a parameter" in study.rows[0]["error"]
    assert not study.rows[1]["error"]
    study = campaign(lambda a: {"seconds": 7.0}, [{"a": 1.0}], path=tmp_path / "two")
    assert "'seconds', which is" in study.rows[0]["error"]
    with pytest.raises(ProblemError, match="parameter 'error', which is a column"):
        campaign(lambda error: {}, [{"error": 1.0}], path=tmp_path / "three")


@pytest.mark.slow
@pytest.mark.mission
def test_two_workers_killed_twice_lose_and_repeat_nothing(tmp_path):
    """The call goes on with new workers; a case that kills its worker each time is a row.

    In an interpreter of its own: what a pool does whose worker died is no business of other tests.
    """
    code = """
import sys
from pathlib import Path
from support import campaign_cases
from xcrack import campaign
folder = Path(sys.argv[1])
cases = [{"a": a, "folder": str(folder)} for a in range(40)]
for victim in (9, 24):
    (folder / f"kill_{victim}").touch()
(folder / "kill_31").mkdir()
study = campaign(campaign_cases.counted, cases, path=folder / "study", workers=2)
assert [row["parameters"]["a"] for row in study.failed] == [31]
assert study.failed[0]["kind"] == "WorkerDeathError"
print(study.failed[0]["error"])
assert [v for v in study.table()["twice"].tolist() if v == v] == [
    2.0 * a for a in range(40) if a != 31
]
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *sys.path])}
    command = [sys.executable, "-c", code, str(tmp_path)]
    run = subprocess.run(
        command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert "died twice, the second time with this case alone" in run.stdout
    rows = [json.loads(f.read_text()) for f in (tmp_path / "study").glob("row_*.json")]
    assert len(rows) == 40
    # only what was under way when a worker died is run again
    again = [len((tmp_path / f"ran_{a}").read_text()) - 1 for a in range(40)]
    assert 3 <= sum(again) <= 9
    assert max(again) <= 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_workers_have_the_numbers_of_one_process(tmp_path):
    cases = campaign_cases.drawn(6, 20266)
    one = campaign(campaign_cases.plate, cases, path=tmp_path / "one").table()
    two = campaign(campaign_cases.plate, cases, path=tmp_path / "two", workers=2).table()
    assert not any(one["error"])
    assert np.array_equal(one["life"], two["life"])
    assert one["ended"].tolist() == two["ended"].tolist()


def test_a_study_whose_cases_fail_says_so_and_takes_the_mended_function(tmp_path):
    """Good rows alone tie a folder to a function."""

    def slip(a):
        return {"x": a + "1"}

    def mended(a):
        return {"x": a + 1.0}

    cases = grid(a=[float(k) for k in range(30)])
    with pytest.warns(
        XcrackWarning, match=r"30 of 30 cases failed, the first .* TypeError"
    ) as record:
        study = campaign(slip, cases, path=tmp_path)
    assert len(record) == 1
    assert str(study).splitlines()[0].endswith("0 without error")
    assert "30 failed with TypeError" in str(study)
    assert len(str(study)) < 1000
    study = campaign(mended, cases, path=tmp_path)
    assert study.failed == ()
    assert study.table()["x"].tolist() == [k + 1.0 for k in range(30)]
    with pytest.raises(ProblemError, match="holds a study of another case"):
        campaign(slip, cases, path=tmp_path, retry=True)


def test_a_row_of_other_kinds_of_values_is_damaged(tmp_path):
    """It is run again, and the table has no errors of Python."""
    cases = grid(a=[1, 2])
    campaign(campaign_cases.formula, cases, path=tmp_path)
    row = {"parameters": 1, "result": 5, "kind": "", "seconds": 0, "error": "", "warnings": []}
    row_of(tmp_path, cases[0]).write_text(json.dumps(row))
    study = campaign(campaign_cases.formula, cases, path=tmp_path)
    assert study.table()["life"].tolist() == [1e6, 5e5]
