"""Growth with retardation: along a stored path, in closed form, several tips, fronts, resumed."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    History,
    Isotropic,
    Problem,
    ProblemError,
    Scatter,
    Spectrum,
    box,
    collect,
    grow,
    life,
    line_crack,
    lognormal,
    max_hoop_stress,
    newman_closure,
    paris,
    penny_crack,
    plastic_zone,
    resume,
    retarded,
    traction,
    walker,
    wheeler,
    willenborg,
)

LAW = paris(5e-12, 3.0)
ZONES = plastic_zone(300.0, beta=2)  # MPa, mm
OVERLOAD = Spectrum([*([0.05, 0.5] * 200), 0.05, 1.0])


def steps_of(model, spectrum=OVERLOAD, problem=None, law=LAW, **options):
    options = {"da": 1.0, "max_steps": 6, "progress": False, "retardation": model, **options}
    return list(grow(problem or plate(), law, max_hoop_stress, spectrum, **options))


@pytest.mark.parametrize(
    "model",
    [
        wheeler(0.5, ZONES),
        wheeler(1.5, ZONES),
        willenborg(2.5, 10.0, ZONES),
        willenborg(2.5, 100.0, ZONES),
    ],
)
def test_one_tip_against_its_stored_path(model):
    """Cycle by cycle along a run without retardation; its K is a line from step to step."""
    response = formula(mode_I())
    plain = History(tuple(steps_of(None, response=response)), "")
    steps = steps_of(model, response=response)
    along = retarded(plain, LAW, OVERLOAD, model, nu=0.3)
    assert steps[-1].cycles == pytest.approx(along.life, rel=2e-3)
    assert steps[-1].cycles > 1.5 * plain.life
    assert np.allclose(steps[-1].cracks[0].points, plain.steps[-1].cracks[0].points)


def test_an_exponent_of_nothing_is_no_retardation():
    """Cycle by cycle against block rates: what a block grows is small against the crack."""
    response = formula(mode_I())
    plain, other = (
        steps_of(None, response=response),
        steps_of(wheeler(1e-9, ZONES), response=response),
    )
    for a, b in zip(plain, other, strict=True):
        assert b.cycles == pytest.approx(a.cycles, rel=5e-4)  # 0.05 blocks: where it ends


CONSTANT = formula(mode_I(factor=lambda a: 4.0))


def test_delay_of_wheeler_in_closed_form():
    """K constant: the zone is left after an integral; the rest of the way is at the law's rate."""
    factors = np.tile([0.0, 1.0], 60_000)
    factors[1] = 2.0
    model, K = wheeler(1.5, ZONES), 4.0 * STRESS
    rate, w, own, zone = LAW.C * K**3, 1.5, float(ZONES(K)), float(ZONES(2 * K))
    left = zone - 8 * rate  # after the overload has grown too
    delay = (left ** (w + 1) - own ** (w + 1)) / ((w + 1) * own**w * rate)
    da = zone - own + 2.0
    step = steps_of(model, Spectrum(factors), da=da, max_steps=2, response=CONSTANT)[1]
    cycles = 1 + delay + 2.0 / rate
    assert cycles < 60_000
    assert step.cycles * 60_000 == pytest.approx(cycles, rel=2e-4)  # a cycle is no differential


def test_willenborg_at_shut_off():
    """An overload of the ratio that stops the crack: nothing but the overloads grows."""
    model = willenborg(2.0, 0.0, ZONES)
    rate = LAW.C * (8.0 * STRESS) ** 3
    spectrum = Spectrum([0.0, 2.0, *[0.0, 1.0] * 50])
    step = steps_of(model, spectrum, max_steps=2, response=CONSTANT)[1]
    whole, part = divmod(1.0 / rate, 1.0)  # the step ends within an overload, the first of 51
    assert step.cycles == pytest.approx(whole + part / 51, rel=1e-4)


def test_each_tip_has_its_own_zone():
    """Two cracks whose K does not know of the other: each like alone, at the same blocks."""
    response = formula(mode_I())
    lines = [line_crack([(0.0, y), (x, y)]) for x, y in ((5.0, 8.37), (3.0, -8.37))]
    model = wheeler(1.0, ZONES)
    both = steps_of(model, problem=plate(lines), response=response)
    for c, line in enumerate(lines):
        alone = steps_of(
            model, problem=plate([line]), max_steps=9, da=0.5 if c else 1.0, response=response
        )
        blocks = [step.cycles for step in alone]
        lengths = [float(step.corrected[0].points[:, 0].max()) for step in alone]
        length = float(both[-1].corrected[c].points[:, 0].max())
        assert np.interp(both[-1].cycles, blocks, lengths) == pytest.approx(length, abs=0.01)


def test_blocks_of_a_step_as_asked():
    response = formula(mode_I())
    steps = steps_of(wheeler(1.0, ZONES), da=None, cycles=250.0, max_steps=5, response=response)
    blocks = np.diff([step.cycles for step in steps])
    assert np.allclose(blocks[1:], 250.0, rtol=2e-3)
    assert blocks[0] == pytest.approx(250.0, rel=0.1)  # of one solve only
    by_length = steps_of(wheeler(1.0, ZONES), da=0.4, max_steps=9, response=response)
    at = np.interp(
        [step.cycles for step in steps],
        [step.cycles for step in by_length],
        [step.cracks[0].points[-1, 0] for step in by_length],
    )
    assert np.allclose([step.corrected[0].points[-1, 0] for step in steps], at, atol=0.02)


def test_a_tip_leaves_the_body_and_the_other_goes_on():
    response = formula(mode_I())
    lines = [line_crack([(0.0, 8.37), (58.0, 8.37)]), line_crack([(0.0, -8.37), (3.0, -8.37)])]
    steps = steps_of(
        wheeler(1.0, ZONES), problem=plate(lines), da=1.5, max_steps=6, response=response
    )
    assert len(steps) == 6
    assert steps[-1].cracks[0].n_tips == 0
    assert steps[-1].cycles > steps[3].cycles > 0


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_steps_of_a_tolerance():
    """Steps that choose their own length, against short ones."""
    response = formula(mode_I())
    model = wheeler(1.0, ZONES)
    chosen = steps_of(model, da=None, tolerance=1e-2, max_steps=3, response=response)
    short = steps_of(model, da=0.4, max_steps=13, response=response)
    at = PchipInterpolator(
        [step.corrected[0].points[-1, 0] for step in short], [step.cycles for step in short]
    )
    length = float(chosen[-1].corrected[0].points[-1, 0])
    assert 9.0 < length < 9.8
    assert chosen[-1].cycles == pytest.approx(float(at(length)), rel=2e-3)


def test_other_lives_want_a_history_without():
    response = formula(mode_I())
    history = History(tuple(steps_of(wheeler(1.0, ZONES), max_steps=3, response=response)), "")
    given = {"spectrum": OVERLOAD, "criterion": max_hoop_stress, "nu": 0.3}
    for ask in (
        lambda: retarded(history, LAW, OVERLOAD, None, nu=0.3),
        lambda: history.rerate(LAW, **given),
        lambda: life(history, LAW, scatter=Scatter(C=lognormal(0.1)), seed=3, **given),
    ):
        with pytest.raises(ProblemError, match="grown with retardation"):
            ask()


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_threshold_of_the_run():
    """Small cycles below it do not grow, with or without retardation."""
    response = formula(mode_I())
    model = wheeler(1.0, ZONES)
    steps = steps_of(model, threshold=250.0, max_steps=3, response=response)
    alone = steps_of(None, OVERLOAD.omit(0.9), max_steps=3, response=response)
    assert steps[-1].cycles == pytest.approx(alone[-1].cycles, rel=1e-3)


def same(one, other):
    assert len(one.steps) == len(other.steps)
    for a, b in zip(one.steps, other.steps):
        assert a.cycles == b.cycles
        for part in ("angle", "rate", "da"):
            assert all(np.array_equal(*pair) for pair in zip(getattr(a, part), getattr(b, part)))
        for x, y in zip(a.corrected, b.corrected):
            assert np.array_equal(x.points, y.points)


def test_resumed_to_the_bit(tmp_path):
    response = formula(mode_I())
    arguments = (plate(), LAW, max_hoop_stress, OVERLOAD)
    options = {"da": 1.0, "progress": False, "retardation": willenborg(2.5, 10.0, ZONES)}
    whole = collect(grow(*arguments, **options, max_steps=5, response=response))
    folder = tmp_path / "part"
    collect(grow(*arguments, **options, max_steps=2, response=response), path=folder)
    same(whole, resume(folder, *arguments, **options, max_steps=5, response=response))
    changed = {**options, "retardation": willenborg(2.4, 10.0, ZONES)}
    with pytest.raises(ProblemError, match=r"retardation\.shutoff: stored 2\.5, given 2\.4"):
        resume(folder, *arguments, **changed, max_steps=6, response=response)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": 1.5}, r"retardation = 1\.5"),
        ({"spectrum": Cycle(0.0, 1.0)}, "no overload"),
        ({"spectrum": Spectrum(rows=[(0, 1, 1)])}, "rows no order"),
        ({"spectrum": Spectrum(states=[0.0, 1.0], sequence=[0, 1])}, "states"),
        ({"integrator": "euler"}, "pec"),
        ({"law": walker(1e-11, 3, 0.5, 0.2, ratio="nominal")}, "nominal"),
        (
            {
                "law": paris(1e-11, 3, closure=newman_closure(2.0, 0.3)),
                "model": willenborg(2.5, 0.0, ZONES),
            },
            "count twice",
        ),
    ],
)
def test_what_means_nothing_is_refused(change, words):
    given = {"model": wheeler(1.0, ZONES), **change}
    with pytest.raises(ProblemError, match=words):
        steps_of(**given)


def disc():
    mesh = box((-4.0, -4.0, -4.0), (4.0, 4.0, 4.0), (7, 7, 7))
    return Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3),
        cracks=[penny_crack((0.1, 0.0, 0.05), (0, 0, 1), 2.0)],
        loads=[traction("top", (0, 0, STRESS)), traction("bottom", (0, 0, -STRESS))],
        order=1,
    )


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_a_front(tmp_path):
    """A disc: as slow as a point whose K is that of a disc; without an exponent as without."""
    zones = plastic_zone(300.0, beta=6)
    steps = {}
    for w in (None, 1e-9, 1.0):
        model = None if w is None else wheeler(w, zones)
        steps[w] = steps_of(model, problem=disc(), da=0.3, max_steps=3)
    assert steps[1e-9][-1].cycles == pytest.approx(steps[None][-1].cycles, rel=0.02)
    ratio = steps[1.0][-1].cycles / steps[None][-1].cycles

    def blocks(w):
        a, end, count = 2.0, 0.0, 0
        order = [0.5] * 200 + [1.0]
        while a < 2.6:
            top = order[count % 201]
            K = top * STRESS * 2 * np.sqrt(a / np.pi)
            own = zones.factor * K**2
            grows = LAW.C * ((top - 0.05) / top * K) ** 3
            if a + own >= end:
                end = a + own
            else:
                grows *= (own / (end - a)) ** w
            a, count = a + grows, count + 1
        return count / 201

    assert ratio == pytest.approx(blocks(1.0) / blocks(0.0), rel=0.02)
    arguments = (disc(), LAW, max_hoop_stress, OVERLOAD)
    options = {"da": 0.3, "progress": False, "retardation": wheeler(1.0, zones)}
    collect(grow(*arguments, **options, max_steps=2), path=tmp_path)
    rest = resume(tmp_path, *arguments, **options, max_steps=3)
    same(History(tuple(steps[1.0]), ""), rest)


def test_what_a_step_carries():
    """Its rate is that of the law; what overloads left goes with it."""
    response = formula(mode_I())
    plain, slow = (
        steps_of(None, response=response)[2],
        steps_of(wheeler(1.0, ZONES), response=response)[2],
    )
    assert slow.rate[0] == pytest.approx(plain.rate[0], rel=1e-9)
    zones = slow.zones
    assert [f.name for f in fields(zones)] == ["since", "size", "K", "position", "part"]
    K = STRESS * np.sqrt(np.pi * 7.0)
    assert zones.K[0] == pytest.approx(K, rel=2e-3)
    assert zones.size[0] == pytest.approx(float(ZONES(K)), rel=4e-3)
    assert 0 <= zones.since[0] < 0.02
