"""Opening of crack mouths and compliance against published formulas; G from compliance.

Formulas of Tada, Paris and Irwin (The Stress Analysis of Cracks Handbook) and of Saxena and Hudak
(1978, as in ASTM E647 and E1820), from memory. A wrong constant would show: they are held against
elements here, and against G, which knows none of them.
"""

from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from xcrack import ProblemError

EXAMPLES = Path(__file__).parents[2] / "examples" / "meshes"
STEEL = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
E = STEEL.E_prime


def strip(a, n=(12, 49), centre=False):
    """Strip of width 1 and height 4 under tension 1, with an edge or centre crack."""
    mesh = xc.box((0.0, -2.0), (1.0, 2.0), n)
    supports = [xc.fix((1.0, -2.0)), xc.fix((1.0, 2.0), axis=0)]
    if centre:  # symmetry at x = 0: half of a crack of length 2 a in a strip of width 2
        supports = [xc.fix("left", axis=0), xc.fix((0.0, -2.0), axis=1)]
    return xc.Problem(
        mesh,
        STEEL,
        cracks=[xc.line_crack([(0.0, 0.003), (a, 0.003)])],
        supports=supports,
        loads=[xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))],
    )


@pytest.mark.parametrize("a", [0.3, 0.5])
def test_mouth_of_an_edge_crack(a):
    """Tada: 4 s a / E' V(a/b), V = (1.46 + 3.42 (1 - cos)) / cos²: a fit, to 1.6 % of elements.

    Those are converged: 1.589, 1.590 and 1.591 % above it with 12, 24 and 40 cells, a = 0.3.
    """
    solution = xc.solve(strip(a))
    arm = np.pi * a / 2
    expected = 4 * a / E * (1.46 + 3.42 * (1 - np.cos(arm))) / np.cos(arm) ** 2
    assert xc.crack_opening(solution) == pytest.approx([expected], rel=0.02)
    inside = xc.crack_opening(solution, [(0.5 * a, 0.003), (0.999 * a, 0.003)])
    assert expected > inside[0] > inside[1] > 0


@pytest.mark.parametrize("a", [0.3, 0.5])
def test_middle_of_a_centre_crack(a):
    """Tada: 4 s a / E' V(a/b), within 0.7 % of elements."""
    solution = xc.solve(strip(a, centre=True))
    V = -0.071 - 0.535 * a + 0.169 * a**2 + 0.020 * a**3 - 1.071 / a * np.log(1 - a)
    middle = xc.crack_opening(solution, (0.0, 0.003))
    assert middle == pytest.approx(4 * a / E * V, rel=0.01)


def saxena_hudak(x, first, *others):
    series = sum(c * x**k for k, c in enumerate((first, *others)))
    return ((1 + x) / (1 - x)) ** 2 * series


@pytest.mark.parametrize("share", [0.45, 0.6])
def test_compact_tension(share):
    """On the load line and at the front face, as clip gauges measure; pins as in the example."""
    W, P = 50.0, 100.0
    mesh = xc.read_mesh(EXAMPLES / "compact_tension.msh")
    pins = [
        xc.bearing(f"hole_{k}", (0.0, s * P), contact_angle=np.pi / 3) for k, s in ((0, 1), (1, -1))
    ]
    solution = xc.solve(
        xc.Problem(
            mesh, STEEL, cracks=[xc.line_crack([(-0.26 * W, 0), (share * W, 0)])], loads=pins
        )
    )
    line = saxena_hudak(share, 2.1630, 12.219, -20.065, -0.9925, 20.609, -9.9314)
    face = (1 + 0.25 / share) * saxena_hudak(
        share, 1.6137, 12.678, -14.231, -16.610, 35.050, -14.494
    )
    assert xc.crack_opening(solution, (0.0, 0.0)) * E / P == pytest.approx(line, rel=0.01)
    assert xc.crack_opening(solution) * E / P == pytest.approx([face], rel=0.01)


def test_G_is_what_compliance_says():
    """P²/2 dC/da by central difference against G of K: two ways that share no formula."""
    a, step = 0.4, 0.02
    C = [xc.compliance(xc.solve(strip(a + s * step)), force=1.0) for s in (-1, 1)]
    solution = xc.solve(strip(a))
    G = xc.energy_release_rate(xc.stress_intensity(solution), STEEL)[0]
    assert 0.5 * (C[1] - C[0]) / (2 * step) == pytest.approx(G, rel=0.01)  # step and elements
    twice = xc.solve(strip(a), [2.0])[0]
    assert xc.compliance(twice, force=2.0) == pytest.approx(xc.compliance(solution, 1.0), rel=1e-9)


def test_closed_cracks_do_not_open():
    solution = xc.solve(strip(0.4), [-1.0])[0]
    assert abs(xc.crack_opening(solution)[0]) < 1e-6 * 4 * 0.4 / E * 10


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda s: xc.crack_opening(3), "solution = 3"),
        (lambda s: xc.crack_opening(s, crack=1), "crack"),
        (lambda s: xc.crack_opening(s, (0.1, 0.5)), "does not lie on crack 0"),
        (lambda s: xc.crack_opening(s, [[1.0, 2.0, 3.0]]), r"points \(n, 2\)"),
        (lambda s: xc.compliance(3, 1.0), "solution = 3"),
        (lambda s: xc.compliance(s, 0.0), "force = 0"),
    ],
)
def test_bad_input(make, words):
    with pytest.raises(ProblemError, match=words):
        make(xc.solve(strip(0.4, n=(4, 17))))
