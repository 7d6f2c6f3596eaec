"""Growth of second order with K from formulas: orders, shares of tips, events, what is stored."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from support.growth_fakes import STRESS, formula, plate
from support.growth_runs import *  # noqa: F403 - fixtures come by name
from xcrack import Cycle, ProblemError, collect, grow, line_crack, load, max_hoop_stress, paris

LAW = paris(C=1e-11, m=3.0)
CYCLE = Cycle(0.0, 1.0)


def end_of(problem, **options):
    """The last step of a run."""
    options = {"progress": False, **options}
    return collect(grow(problem, LAW, max_hoop_stress, CYCLE, **options)).steps[-1]


def length_of(crack):
    """Of a straight edge crack, in the body."""
    return float(crack.points[-1, 0])


# --- order -------------------------------------------------------------------------------------


def wanted(x):
    """A field of directions; straight on where the crack begins."""
    return 0.5 * np.sin(0.12 * (x[0] - 5.0)) + 0.02 * (x[1] - 0.37)


def pulling(x):
    return 10.0 + 0.2 * x[0] + 0.1 * x[1]


def along_a_field(problem, c):
    """K whose hoop stress is largest in the direction that the field has at the tip."""
    before, x = problem.placed[c].points[-2:]
    angle = wanted(x) - np.arctan2(*(x - before)[::-1])
    K_I = pulling(x)
    return [[K_I, -K_I * np.sin(angle) / (3 * np.cos(angle) - 1)]]


def test_path_and_life_are_of_second_order():
    """Against the path and life of the field to round-off: no mesh is in it."""
    response = formula(along_a_field)
    G = 30.0

    def slope(s, z):
        K = pulling(z[:2])  # of the equal dK_eq on the path itself, where K_II = 0
        return [np.cos(wanted(z)), np.sin(wanted(z)), 1 / LAW(K, 0.0)]

    exact = solve_ivp(slope, (0, G), [5.0, 0.37, 0.0], rtol=1e-11, atol=1e-11).y[:, -1]
    steps = np.array([6, 8, 11, 15])
    orders = {}
    for name in ("euler", "pec"):
        error, life = [], []
        for n in steps:
            options = {"da": G / n, "max_steps": int(n) + 1, "integrator": name}
            step = end_of(plate(), **options, response=response)
            tip = step.corrected[0].points[-1]
            error.append(np.linalg.norm(tip - exact[:2]) / G)
            life.append(abs(step.cycles / exact[2] - 1))
            if name == "pec":
                assert error[-1] <= 4 * step.error.place[0][0] / G
        orders[name] = -np.polyfit(np.log(steps), np.log(error), 1)[0]
        print(name, [f"{e:.1e}" for e in error], [f"{e:.1e}" for e in life], orders[name])
    assert orders["pec"] >= 1.8
    assert orders["euler"] == pytest.approx(1, abs=0.15)
    assert error[-1] < 2e-3


def of_length(*factors):
    """K_I = factor √(π a) of each crack."""

    def K_of(problem, c):
        return [[factors[c] * np.sqrt(np.pi * length_of(problem.placed[c])), 0.0]]

    return K_of


@pytest.mark.parametrize(("da", "aim"), [(0.16, 0.03), (0.08, 0.01)])
def test_a_slow_tip_beside_a_fast_one(da, aim):
    """Two cracks whose rates are known: da_2/da_1 = 0.9^3 (a_2/a_1)^(3/2), a_1 from 5 to 15."""
    response = formula(of_length(STRESS, 0.9 * STRESS))
    begin, end = 5.0, 5.0 + 10.0
    problem = plate([line_crack([(0, y), (begin, y)]) for y in (8.3, -8.3)])
    # separable: a_2^(-1/2) = b^(-1/2) - 0.9³ (b^(-1/2) - a_1^(-1/2))
    slow = (begin**-0.5 - 0.9**3 * (begin**-0.5 - end**-0.5)) ** -2
    n = round(10.0 / (5.0 * da))
    error = {}
    for name in ("euler", "pec"):
        step = end_of(problem, da=10.0 / n, max_steps=n + 1, integrator=name, response=response)
        grown = [length_of(crack) - begin for crack in step.corrected]
        assert grown[0] == pytest.approx(10.0, rel=1e-12)
        error[name] = grown[1] / (slow - begin) - 1
    print({name: f"{100 * e:+.3f} %" for name, e in error.items()})
    assert abs(error["pec"]) <= 0.1 * aim
    assert abs(error["euler"]) > aim


def test_a_tip_that_is_overtaken_is_no_event():
    """The driver changes within a step; lengths and life against the exact ones."""

    def K_of(problem, c):
        a = length_of(problem.placed[c])
        return [[(10.0, 6.0)[c] * (a / 5.0) ** (0.0, 1.0)[c], 0.0]]

    response = formula(K_of)
    problem = plate([line_crack([(0, y), (5.0, y)]) for y in (8.3, -8.3)])
    error = []
    for da in (1.5, 0.75):
        step = end_of(problem, da=da, max_steps=round(15 / da) + 1, response=response)
        first, second = (length_of(crack) for crack in step.corrected)
        N, _ = quad(lambda a: 1 / LAW(6.0 * a / 5.0, 0.0), 5.0, second)
        error.append(abs(step.cycles / N - 1))
        assert first == pytest.approx(5.0 + LAW(10.0, 0.0) * step.cycles, rel=1e-3)
        assert second > first
    print(error)
    assert error[0] <= 1.5e-2
    assert error[1] <= 0.35 * error[0]


# --- events ------------------------------------------------------------------------------------


def leaving(problem, c):
    """K of one crack jumps by 1.3 when the other has gone through."""
    gone = problem.placed[1].n_tips == 0
    if not problem.placed[c].n_tips:
        return np.zeros((0, 2))
    x = problem.placed[c].points[-1, 0]
    return [[(10.0 + 0.2 * x) * (1.3 if gone else 1.0) if c == 0 else 12.0, 0.0]]


def test_a_tip_that_leaves_ends_what_its_solves_can_say():
    """Cycles until it leaves by the rates before, from there by those of the other."""
    response = formula(leaving)
    problem = plate([line_crack([(0, 8.3), (5.0, 8.3)]), line_crack([(0, -8.3), (52.0, -8.3)])])
    step = end_of(problem, da=3.0, max_steps=6, response=response)
    assert [crack.n_tips for crack in step.cracks] == [1, 0]
    x = step.corrected[0].points[-1, 0]
    exit_ = 8.0 / LAW(12.0, 0.0)

    def cycles(a, b, factor):
        return quad(lambda x: 1 / LAW(factor * (10.0 + 0.2 * x), 0.0), a, b)[0]

    low, high = 5.0, 20.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if cycles(5.0, middle, 1.0) < exit_ else (low, middle)
    N = exit_ + cycles(low, x, 1.3)
    assert step.cycles == pytest.approx(N, rel=0.02)
    assert step.solves.n_solves == 3


def test_an_infinite_rate_at_the_end_of_a_step():
    """The inverse of the rate falls to zero: half of what the first rate says."""
    response = formula(of_length(STRESS))

    def law(dK, R):
        return np.where(dK > 500.0, np.inf, LAW(dK, R))

    run = grow(plate(), law, max_hoop_stress, CYCLE, da=4.0, progress=False, response=response)
    history = collect(run)
    assert history.ended.startswith("K_c reached")
    assert len(history.steps) == 2
    length = length_of(history.cracks[0]) - 5.0
    assert history.life == pytest.approx(0.5 * length / history.steps[0].rate[0][0], rel=1e-6)
    assert 500.0 < history.steps[-1].dK_eq[0][0] <= 500.0 * (1 + 3e-4)


def test_a_short_last_face_is_moved_on():
    """Advances of a third of a cell, 1.41: no face but the last is shorter than half a cell."""
    response = formula(along_a_field)
    step = end_of(plate(), da=0.47, max_steps=14, response=response)
    face = np.linalg.norm(np.diff(step.corrected[0].points, axis=0), axis=1)
    assert (face[1:-1] >= 0.705).all()
    assert len(face) == 8
    assert face[1:].sum() == pytest.approx(13 * 0.47, rel=3e-3)


@pytest.mark.filterwarnings("ignore:the advance .* below one cell")
def test_a_first_kink_begins_in_its_limit():
    def K_of(problem, c):
        return [[0.0, 100.0]] if len(problem.placed[c].points) == 2 else [[100.0, 0.0]]

    response = formula(K_of)
    step = end_of(plate(), da=2.0, max_steps=1, response=response)
    direction = np.arctan2(*step.solves.direction[0, 0, ::-1])
    assert np.degrees(direction) == pytest.approx(-77.33, abs=5e-3)
    assert np.degrees(step.angle[0][0]) == pytest.approx(-70.53, abs=5e-3)  # what K says


# --- what is stored ------------------------------------------------------------------------------


def test_steps_say_how_they_were_solved_and_corrected(whole):
    """To the last bit after reading too; the next crack goes on from the corrected one."""
    stored = load(whole.path)
    for one, two in zip(whole.steps, stored.steps, strict=True):
        for c in range(2):
            assert one.corrected[c].points.tobytes() == two.corrected[c].points.tobytes()
            assert one.error.place[c].tobytes() == two.error.place[c].tobytes()
        assert one.error.cycles == two.error.cycles
        assert one.solves.direction.tobytes() == two.solves.direction.tobytes()
        assert one.solves.n_solves == min(one.index + 1, 3)
    moved = [
        np.linalg.norm(s.corrected[0].points[-1] - s.cracks[0].points[-1]) for s in whole.steps
    ]
    assert moved[0] == 0 < min(moved[1:])


def test_the_linear_ratio_is_of_first_order_only():
    with pytest.raises(ProblemError, match='only integrator="euler"'):
        next(grow(plate(), LAW, max_hoop_stress, CYCLE, da=1.0, scaling="linear"))
    with pytest.raises(ProblemError, match=r"integrator = .rk4."):
        next(grow(plate(), LAW, max_hoop_stress, CYCLE, da=1.0, integrator="rk4"))
