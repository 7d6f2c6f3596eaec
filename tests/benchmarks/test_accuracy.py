"""What accuracy costs: the page is that of the stored results."""

import math

import pytest

from benchmarks import accuracy


def test_page_is_what_is_stored():
    page = accuracy.PAGE.read_text(encoding="utf-8")
    assert f"{accuracy.BEGIN}{accuracy.table()}\n{accuracy.END}" in page


def test_time_at_an_error_by_hand():
    """On a line in logarithms; a method that never gets there takes infinitely long."""
    rows = [
        {"series": name, "errors": {"K": error}, "processor": time}
        for name, error, time in (("a", 1e-2, 1.0), ("a", 1e-4, 100.0), ("b", 1e-2, 9.0))
    ]
    assert accuracy.seconds(rows, ("a", "b"), "K", 1e-3) == pytest.approx(10.0)  # round-off
    assert accuracy.seconds(rows, ("b", "c"), "K", 1e-3) == math.inf
