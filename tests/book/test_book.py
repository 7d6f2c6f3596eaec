"""The verification book: every case is right, what it says is so, and it sees what is broken."""

import json
import re
from importlib import import_module

import pytest

import xcrack as xc
from xcrack.verification.book.case import REQUIREMENTS, Case, Value
from xcrack.verification.book.run import Book, chosen, find_cases, line_of, run_case, run_cases

CASES = find_cases()
PLANE = [case for case in CASES if case.dim != 3 and case.quick]
REST = [case for case in CASES if case not in PLANE]
FINE = [case for case in CASES if case.levels > 1]
# Requirements that wait for features: a case that covers one leaves this list.
WAITING = set()


def check(case, *, quick):
    result = run_case(case, quick=quick)
    if result.skipped:
        pytest.skip(result.skipped)
    print(line_of(result))
    assert result.passed, "\n".join([line_of(result), *map(str, result.rows)])


@pytest.mark.parametrize("case", PLANE, ids=lambda case: case.id)
def test_case_on_its_coarsest_mesh(case):
    check(case, quick=True)


@pytest.mark.slow
@pytest.mark.parametrize("case", REST, ids=lambda case: case.id)
def test_case_in_space_on_its_coarsest_mesh(case):
    check(case, quick=True)


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.parametrize("case", FINE, ids=lambda case: case.id)
def test_case_on_all_meshes(case):
    check(case, quick=False)


def test_every_requirement_has_a_case_or_is_listed():
    covered = {case.requirement for case in CASES}
    assert set(REQUIREMENTS) - covered == WAITING
    assert set(Book((), True).uncovered) == {REQUIREMENTS[key] for key in WAITING}


def test_references_name_their_kind():
    assert {case.kind for case in CASES} >= {"exact", "published"}
    for case in CASES:
        assert re.fullmatch(r"[\w.-]+", case.id)
        assert len(case.reference) > 5
        if case.kind == "published":
            assert re.search(r"\d{4}", case.reference), case.id


def broken(monkeypatch, *changes):
    """Names of the quick cases that fail where functions are replaced."""
    for target, make in changes:
        module, _, name = target.rpartition(".")
        place = import_module(module)  # a package may hold a function of its name
        monkeypatch.setattr(place, name, make(getattr(place, name)))
    results = run_cases(chosen(quick=True), quick=True).results
    return {r.case.id for r in results if r.status == "failed"}


@pytest.mark.slow
@pytest.mark.mission
def test_a_broken_K_integral_fails(monkeypatch):
    """Three per cent too much of the domain's part, in 2D and in 3D."""

    def wrong(right):
        return lambda *given, **named: 1.03 * right(*given, **named)

    failed = broken(monkeypatch, ("xcrack.sif.domain_2d.plain_terms", wrong))
    print(sorted(failed))
    kinds = {case.requirement for case in CASES if case.id in failed}
    assert len(failed) >= 3
    assert kinds >= {"K", "K_curved", "K_tables", "loads", "life"}


@pytest.mark.slow
@pytest.mark.mission
def test_a_broken_multiplier_space_fails(monkeypatch):
    """One multiplier a node: the space that oscillates."""

    def wrong(right):
        return lambda space, c, lips, kind, fixed=None, **_: right(space, c, lips, "naive", fixed)

    places = (
        "xcrack.analysis.contact.multipliers",
        "xcrack.verification.methods.inf_sup.multipliers",
    )
    failed = broken(monkeypatch, *((place, wrong) for place in places))
    print(sorted(failed))
    kinds = {case.requirement for case in CASES if case.id in failed}
    assert len(failed) >= 3
    assert kinds >= {"stability", "sliding"}
    assert not any(not case.contact and case.id in failed for case in CASES)


@pytest.mark.slow
@pytest.mark.mission
def test_a_broken_rule_for_cycles_fails(monkeypatch):
    """Euler's rule, the rate before a step for the whole of it, and five per cent too many."""

    def wrong(right):
        return lambda a0, a1, rate0, rate1: (a1 - a0) / rate0

    def too_many(right):  # what steps of second order take, by five per cent
        def cycles(*given):
            N, *errors = right(*given)
            return 1.05 * N, *errors

        return cycles

    failed = broken(
        monkeypatch,
        ("xcrack.growth.euler.cycles_between", wrong),
        ("xcrack.verification.book.cases.lives.cycles_between", wrong),
        ("xcrack.growth.tips._cycles", too_many),
    )
    print(sorted(failed))
    kinds = {case.requirement for case in CASES if case.id in failed}
    assert len(failed) >= 3
    assert kinds >= {"life", "ratio"}


def fake(run, **changes):
    options = {"id": "fake", "requirement": "K", "reference": "by hand", "kind": "exact",
               "dim": 2, "order": 1, "contact": False, "levels": 3}  # fmt: skip
    return Case(run=run, **{**options, **changes})


def test_rates_and_tolerances_decide():
    def halves(level):
        return [Value("x", 1 + 0.1 * 0.5**level, 1.0, 0.2, rate=1.0)]

    good = run_case(fake(halves), quick=False)
    assert good.passed
    assert good.rows[0].rate == pytest.approx(1.0)  # round-off
    assert not run_case(fake(lambda k: [Value("x", 1 + 0.1 * 0.7**k, 1.0, 0.2, rate=1.0)]),
                        quick=False).passed  # fmt: skip
    assert not run_case(fake(lambda k: [Value("x", 1.3, 1.0, 0.2)])).passed
    assert not run_case(fake(lambda k: [Value("x", float("nan"), 1.0, 0.2)])).passed
    assert not run_case(fake(lambda k: [])).passed


def test_a_case_that_breaks_has_failed_and_says_why():
    def breaks(level):
        raise ValueError("no such thing")

    result = run_case(fake(breaks))
    assert result.status == "failed"
    assert "no such thing" in result.error
    assert "no such thing" in str(Book((result,), True))
    assert not Book((result,), True).passed


def test_what_is_missing_is_skipped_and_reported():
    result = run_case(fake(lambda k: [], needs="no_such_package"))
    assert result.status == "skipped"
    assert "no_such_package" in result.skipped
    assert Book((result,), True).passed


def test_the_book_is_a_page_and_numbers(tmp_path, capsys):
    book = xc.verify("griffith-T", quick=True, file=tmp_path / "new" / "book.html")
    assert book.passed
    assert capsys.readouterr().err.count("griffith-T") == 2
    text = (tmp_path / "new" / "book.html").read_text(encoding="utf-8")
    assert "Every case passed." in text
    assert "http" not in text.replace("http-equiv", "")  # nothing is loaded from elsewhere
    for key in WAITING:
        assert REQUIREMENTS[key] in text
    numbers = json.loads((tmp_path / "new" / "book.json").read_text(encoding="utf-8"))
    assert {case["id"] for case in numbers["cases"]} == {"griffith-T-1", "griffith-T-2"}
    assert numbers["passed"] is True


def test_misuse_says_what_there_is(tmp_path):
    with pytest.raises(xc.ProblemError, match="no quick case has 'nothing'"):
        xc.verify("nothing", quick=True)
    with pytest.raises(xc.ProblemError, match="quick = 1"):
        xc.verify("cycle-rule", quick=1)
    with pytest.raises(xc.ProblemError, match="cannot be written"):
        xc.verify("cycle-rule", quick=True, progress=False, file=tmp_path)
    with pytest.raises(xc.ProblemError, match="no requirement is called 'beauty'"):
        fake(lambda k: [], requirement="beauty")
