"""The value that says where and when two cracks became one."""

import pytest

import xcrack as xc
from xcrack import ProblemError


def test_a_join_says_where_and_when():
    join = xc.Join(4, 1234.5, [0.0, 0.1, 0.2], [1, 3])
    assert (join.step, join.N, join.point, join.cracks) == (4, 1234.5, (0.0, 0.1, 0.2), (1, 3))
    assert str(join) == "cracks 1 and 3 join at (0, 0.1, 0.2), N = 1234.5"
    assert join == xc.Join(4, 1234.5, (0.0, 0.1, 0.2), (1, 3))


@pytest.mark.parametrize(
    "wrong",
    [{"step": -1}, {"N": float("nan")}, {"point": (1.0,)}, {"cracks": (0, 1, 2)}, {"cracks": 3}],
)
def test_bad_parts_of_a_join_are_refused(wrong):
    good = {"step": 4, "N": 1.0, "point": (0.0, 1.0), "cracks": (0, 1)}
    with pytest.raises(ProblemError, match=f"Join: {next(iter(wrong))}"):
        xc.Join(**good | wrong)
