"""Rows of parametrised tests that the quick run leaves out; a tuple is a row of several values."""

import pytest

MISSION = (pytest.mark.slow, pytest.mark.mission)


def slow(*rows):
    """Rows near to others, which the quick run has: with the slow tests."""
    return _marked(rows, MISSION[:1])


def mission(*rows):
    """Rows that take seconds and guard a number of their own: also with each landing."""
    return _marked(rows, MISSION)


def _marked(rows, marks):
    rows = (row if isinstance(row, tuple) else (row,) for row in rows)
    return [pytest.param(*row, marks=marks) for row in rows]
