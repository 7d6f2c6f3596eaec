"""Growth through several materials: laws, toughness and ends by the material that a tip is in."""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad

import xcrack as xc
from support import materials as scenes

pytestmark = pytest.mark.filterwarnings("ignore:.*passes from 'one' into 'two'")

FAST, SLOW = xc.paris(1e-3, 3.0), xc.paris(1e-4, 3.0)
CYCLE = xc.Cycle(0.0, 1.0)


def run(law, a=0.33, materials=None, **options):
    """From before the interface at x = .5 into what is behind it, which is as stiff."""
    problem = scenes.edge_crack(20, a, 1.0)
    if materials is not None:
        problem = xc.Problem(problem.mesh, materials, problem.cracks, loads=problem.loads)
    choices = {"da": 0.05, "progress": False, "max_steps": 6, **options}
    return xc.collect(xc.grow(problem, law, xc.max_hoop_stress, CYCLE, **choices))


def test_each_material_has_its_law():
    both = run({"one": FAST, "two": SLOW})
    x = [step.sif[0][0].x[0, 0] for step in both.steps]
    assert x[0] < 0.5 < x[-1]
    for step, place in zip(both.steps, x, strict=True):
        law = FAST if place < 0.5 else SLOW
        assert step.rate[0] == pytest.approx(law(step.dK_eq[0], step.R[0]), rel=1e-12)
    fast, same = run(FAST), run({"one": FAST, "two": FAST})
    assert same.life == pytest.approx(fast.life, rel=1e-12)


def K_of(a):
    """Of an edge crack in a strip of width one that is pulled, as handbooks have it."""
    return np.sqrt(np.pi * a) * np.polynomial.Polynomial([1.12, -0.231, 10.55, -21.72, 30.39])(a)


def handbook(problem, states, reuse, bars):
    a = problem.stations.x[:, 0]
    K = [np.stack([factor * K_of(a), 0 * a], axis=1) for factor in states]
    return xc.Response.of_K(problem, states, K)


def cycles_by_hand(begin, end, laws):
    """∫ da / rate, in pieces that end at the interface at .5."""
    ends = [begin, 0.5, end] if begin < 0.5 < end else [begin, end]
    total = 0.0
    for a, b in zip(ends, ends[1:]):
        law = laws["one" if b <= 0.5 else "two"]
        total += quad(lambda a, law=law: 1 / law(np.array([K_of(a)]), np.zeros(1))[0], a, b)[0]
    return total


@pytest.mark.parametrize("integrator", ["pec", "euler"])
@pytest.mark.parametrize("ratio", [0.1, 10.0])
def test_a_life_through_an_interface_is_the_sum_of_both_parts(integrator, ratio):
    """Laws that differ by ten, and K that does not feel the interface, as both are as stiff."""
    laws, error = {"one": FAST, "two": xc.paris(1e-3 * ratio, 3.0)}, []
    for da in (0.1, 0.05, 0.025):
        with pytest.warns(xc.XcrackWarning, match=r"passes from 'one' into 'two' at \(0.5, 0\)"):
            steps = run(laws, da=da, max_steps=int(0.4 / da), response=handbook,
                        integrator=integrator).steps  # fmt: skip
        x = [step.corrected[0].points[-1, 0] for step in steps]
        before, after = (f(v for v in x if side(v)) for f, side in (
            (max, lambda v: v < 0.5), (min, lambda v: v > 0.5)))  # fmt: skip
        assert 0.5 - before == pytest.approx(after - 0.5, rel=1e-9)  # .3 cells on both sides
        error.append(steps[-1].cycles / cycles_by_hand(0.33, x[-1], laws) - 1)
    print(integrator, ratio, np.array(error))
    assert abs(error[2]) <= {"pec": 1.5e-3, "euler": 5e-3}[integrator]
    assert abs(error[2]) <= abs(error[0])


@pytest.mark.parametrize("ratio", [0.2, 10.0])
def test_steps_end_a_cell_beside_another_stiffness(ratio):
    """K close to the interface is off, and is not read: no warning of it, but of the passage."""
    problem = scenes.edge_crack(20, 0.42, ratio)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        steps = list(xc.grow(problem, FAST, xc.max_hoop_stress, CYCLE, da=0.05, progress=False,
                             max_steps=3))  # fmt: skip
    assert [str(each.message).split(" at ")[0] for each in caught] == [
        "tip of crack 0 passes from 'one' into 'two'"
    ]
    cell = np.sqrt(np.median(problem.mesh.volume) * 2)
    x = np.array([step.sif[0][0].x[0, 0] for step in steps])
    assert (np.abs(x - 0.5) > cell).all()
    assert x[0] < 0.5 < x[-1]


def test_the_criterion_has_the_ratio_of_Poisson_where_the_tip_is():
    asked = []

    def criterion(K, nu):
        asked.append((K.shape[1], nu))
        return xc.max_hoop_stress(K, nu)

    materials = {"one": xc.Isotropic(1.0, 0.2, "strain"), "two": xc.Isotropic(1.0, 0.4, "strain")}
    problem = xc.Problem(scenes.square(12), materials, [xc.line_crack([(0.3, 0.02), (0.7, 0.02)])],
                         loads=scenes.PULL)  # fmt: skip

    def response(problem, states, reuse, bars):
        return xc.Response.of_K(problem, states, [[[k, 0.0], [k, 0.0]] for k in states])

    next(xc.grow(problem, FAST, criterion, CYCLE, da=0.05, response=response, progress=False))
    assert set(asked) == {(1, 0.2), (1, 0.4)}


def test_each_material_has_its_toughness():
    def materials(K_c):
        return {"one": xc.Isotropic(1.0, 0.3, "strain", K_c=1e3),
                "two": xc.Isotropic(1.0, 0.3, "strain", K_c=K_c)}  # fmt: skip

    tough, brittle = run(FAST, materials=materials(1e3)), run(FAST, materials=materials(1.0))
    assert "max_steps" in tough.ended
    assert "K_c reached" in brittle.ended
    assert brittle.steps[-1].sif[0][0].x[0, 0] > 0.5
    assert brittle.steps[-2].sif[0][0].x[0, 0] < 0.5


def test_a_run_stops_behind_an_interface():
    history = run(FAST, stop_at_interface=True)
    assert "interface passed: " in history.ended
    assert "has come from 'one' into 'two'" in history.ended
    assert 0.5 < history.steps[-1].sif[0][0].x[0, 0] < 0.55
    assert "max_steps" in run(FAST, a=0.55, max_steps=2, stop_at_interface=True).ended


@pytest.mark.parametrize(
    ("law", "text"),
    [
        ({"one": FAST}, "there are laws for 'one', and the materials .* are 'one', 'two': give"),
        ({"one": FAST, "two": FAST, "three": FAST}, "laws for 'one', 'two', 'three', and"),
        ({"one": FAST, "two": 3.0}, "'two': 3.0: give the name of a cell set, and a law"),
        ({}, "give a mapping of cell sets to laws"),
        ({"one": xc.walker(1e-3, 3.0, 0.5, ratio="nominal"), "two": FAST}, "in several ways"),
        ({"one": FAST, "two": lambda dK, R: dK[:0]}, "the law returned shape"),
    ],
)
def test_laws_that_fit_no_materials_are_refused(law, text):
    with pytest.raises(xc.ProblemError, match=text):
        run(law, a=0.46)


def test_one_material_takes_no_mapping():
    mesh = xc.box((0.0, -1.0), (1.0, 1.0), (8, 17))
    crack, steel = xc.line_crack([(0, 0), (0.3, 0)]), xc.Isotropic(1.0, 0.3, "strain")
    problem = xc.Problem(mesh, steel, [crack], loads=scenes.PULL)
    with pytest.raises(xc.ProblemError, match="are one, without a name"):
        next(xc.grow(problem, {"one": FAST}, xc.max_hoop_stress, CYCLE, da=0.1))


def test_runs_with_laws_by_material_are_resumed(tmp_path):
    law = {"one": FAST, "two": SLOW}
    whole = run(law)
    problem = scenes.edge_crack(20, 0.33, 1.0)
    scene = law, xc.max_hoop_stress, CYCLE
    choices = {"da": 0.05, "progress": False}
    xc.collect(xc.grow(problem, *scene, max_steps=2, **choices), path=tmp_path / "run")
    resumed = xc.resume(tmp_path / "run", problem, *scene, max_steps=6, **choices)
    assert np.array_equal(resumed.cracks[0].points, whole.cracks[0].points)
    other = {"one": FAST, "two": xc.paris(2e-4, 3.0)}
    with pytest.raises(xc.ProblemError, match="law"):
        xc.resume(tmp_path / "run", problem, other, *scene[1:], max_steps=7, **choices)


FACTORS = np.r_[np.tile([0.0, 1.0], 20), 0.0, 1.6]  # an overload in each block


def zone(sigma_y):
    return xc.plastic_zone(sigma_y, beta=2)


MODELS = {
    "wheeler": {"one": xc.wheeler(1.5, zone(40.0)), "two": xc.wheeler(0.8, zone(25.0))},
    "willenborg": {
        "one": xc.willenborg(2.5, 0.05, zone(40.0)),
        "two": xc.willenborg(3.0, 0.02, zone(25.0)),
    },
}


def summed_by_hand(begin, end, laws, models):
    """Blocks from one length to another, one cycle after the other."""
    a, since, size, over, cycles = begin, 0.0, 0.0, 0.0, 0.0
    peaks = FACTORS[1::2]
    while True:
        name = "one" if a < 0.5 else "two"
        law, model = laws[name], models[name]
        K = peaks[int(cycles) % len(peaks)] * K_of(a)
        own = float(model.zone(K))
        if since + own >= size:
            since, size, over = 0.0, own, K
        low, high = 0.0, K
        if isinstance(model, xc.willenborg) and since < size:
            phi = max(0.0, 1 - model.dK_th / K) / (model.shutoff - 1)
            reduction = max(phi * (over * np.sqrt(1 - since / size) - K), 0.0)
            low, high = 0.0, max(K - reduction, 0.0)
        rate = float(law(np.array([high - low]), np.array([0.0]))[0])
        if isinstance(model, xc.wheeler) and since + own < size:
            rate *= (own / (size - since)) ** model.w
        if a + rate >= end:
            return (cycles + (end - a) / rate) / len(peaks)
        a, since, cycles = a + rate, since + rate, cycles + 1


@pytest.mark.parametrize("kind", ["wheeler", "willenborg"])
def test_overloads_in_two_materials_against_a_sum_over_cycles(kind):
    """Each tip has the yield stress and the law of the material that it is in."""
    laws, models = {"one": xc.paris(2e-6, 3.0), "two": xc.paris(5e-7, 3.0)}, MODELS[kind]
    problem = scenes.edge_crack(40, 0.44, 1.0)
    options = {"da": 0.02, "max_steps": 8, "response": handbook, "progress": False}
    steps = list(xc.grow(problem, laws, xc.max_hoop_stress, xc.Spectrum(FACTORS),
                         retardation=models, **options))  # fmt: skip
    x = [step.corrected[0].points[-1, 0] for step in steps]
    assert x[0] < 0.5 < x[-1]
    by_hand = summed_by_hand(0.44, x[-1], laws, models)
    print(kind, steps[-1].cycles, by_hand)
    assert steps[-1].cycles == pytest.approx(by_hand, rel=5e-3)  # discretisation
    alike = {"one": models["one"], "two": models["one"]}
    assert summed_by_hand(0.44, x[-1], laws, alike) > 1.05 * by_hand


def test_one_model_of_retardation_may_serve_several_laws():
    """Laws by material that are one law, and a model for all: the same as without sets."""
    law, model = xc.paris(2e-6, 3.0), MODELS["wheeler"]["one"]
    options = {"da": 0.03, "max_steps": 4, "response": handbook, "progress": False}
    lives = []
    for given, retardation in (
        (law, model), ({"one": law, "two": law}, model), (law, {"one": model, "two": model})
    ):  # fmt: skip
        problem = scenes.edge_crack(20, 0.42, 1.0)
        steps = list(xc.grow(problem, given, xc.max_hoop_stress, xc.Spectrum(FACTORS),
                             retardation=retardation, **options))  # fmt: skip
        lives.append(steps[-1].cycles)
    assert lives[0] == lives[1] == lives[2]


@pytest.mark.parametrize(
    ("models", "text"),
    [
        ({}, "give a mapping of cell sets to models"),
        ({"one": MODELS["wheeler"]["one"]}, "there are models for 'one', and the materials of"),
        ({"one": 3.0, "two": 3.0}, "'one': 3.0: give the name of a cell set, and wheeler or will"),
        (
            {"one": MODELS["wheeler"]["one"], "two": MODELS["willenborg"]["two"]},
            "one material has wheeler, and one willenborg",
        ),
    ],
)
def test_models_of_retardation_that_fit_no_materials_are_refused(models, text):
    with pytest.raises(xc.ProblemError, match=text):
        next(xc.grow(scenes.edge_crack(20, 0.42, 1.0), FAST, xc.max_hoop_stress,
                     xc.Spectrum(FACTORS), da=0.03, retardation=models))  # fmt: skip
