"""The bundled growth examples with a tolerance of 1 %, against stored runs that are much finer.

`python -m benchmarks.wanted_examples` made these: tolerance 2e-3, steps a third of the example's.
"""

import json

import numpy as np
import pytest

from benchmarks.wanted_examples import RESULT, errors, growth_of, run

TRUTH = json.loads(RESULT.read_text(encoding="utf-8"))

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")]


@pytest.mark.parametrize(
    "example", [pytest.param(name, marks=pytest.mark.mission) for name in TRUTH]
)
def test_example_is_within_its_tolerance(example):
    """Life and path; where the bar is above the tolerance, the mesh knows no curves of its rims."""
    history = run(growth_of(example), 1e-2)
    path, life = errors(history, np.array(TRUTH[example]))
    print(f"{example}: life {life:.1e}, path {path:.1e}; {history.life_bar}")
    assert life <= 1e-2
    assert path <= 1e-2
    assert life <= history.life_bar.relative + 2e-3  # that of the finer run
