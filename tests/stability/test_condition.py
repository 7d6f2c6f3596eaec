"""Condition numbers of every enrichment over cut positions, beside bases that fail.

`tests/physics/test_conditioning.py` has growth with mesh size and the geometric enrichment.
"""

import numpy as np
import pytest

from support import scenes_stability as scenes

EPS = (0.1, 1e-3, 1e-6, 1e-10, 0.0)


@pytest.mark.parametrize("name", scenes.ENRICHMENTS)
def test_star_is_flat_over_cuts_whatever_the_enrichment(name):
    """Down to the row of nodes and on it; what changes is the mesh under the tip functions."""
    result = [
        scenes.cut_condition(eps, scenes.ENRICHMENTS[name], scenes.BASES["star"], 12) for eps in EPS
    ]
    print(f"\n{name}, star: {np.array(result)}")
    assert max(result) <= 2 * min(result)


@pytest.mark.parametrize("name", scenes.ENRICHMENTS)
def test_node_blocks_alone_fail_on_slivers(name):
    """The condition number grows like the square of the cut's inverse."""
    result = [
        scenes.cut_condition(eps, scenes.ENRICHMENTS[name], scenes.BASES["node"], 12)
        for eps in (1e-2, 1e-4)
    ]
    assert result[1] > 1e3 * result[0]
