"""Alarms of magnitude and validity: slips of units are told, scenes as they should be are not."""

import warnings

import numpy as np
import pytest

import xcrack as xc
from scripts import growth_scenes

BODY = xc.box((0, -20), (20, 20), (20, 40))
EDGE = xc.line_crack([(0, 0.3), (4, 0.3)])
LAW, CYCLE = xc.paris(1e-13, 3.0), xc.Cycle(0.1, 1.0)


def steel(E=210e3, **options):
    return xc.Isotropic(E, 0.3, plane="strain", **options)


def scene(material=None, stress=80.0, **options):
    loads = [xc.traction("top", (0, stress)), xc.traction("bottom", (0, -stress))]
    return xc.Problem(BODY, material or steel(), [EDGE], loads=loads, **options)


def warned(call):
    """Messages of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught]


def test_a_scene_as_it_should_be_has_no_alarm():
    material = steel(yield_stress=900.0, K_c=1500.0)
    assert xc.check(scene(material), LAW, CYCLE) == ()
    steps = xc.grow(scene(material), LAW, xc.max_hoop_stress, CYCLE, da=0.5, max_steps=2)
    assert warned(lambda: list(steps)) == []


def test_a_step_over_most_of_the_ligament_has_no_alarm():
    """G grows by some fifty times: that it releases less than their mean is as it should be."""
    deep = xc.line_crack([(0, 0.3), (14, 0.3)])
    problem = xc.Problem(BODY, steel(), [deep], loads=scene().loads)
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=4.0, max_steps=2)
    assert not any("energy" in message for message in warned(lambda: list(steps)))


def test_a_tip_that_meets_a_face_has_no_alarm_of_energy():
    """The mean of G leaves out the tip that is gone: half of it is released."""
    problem, cycle, options = growth_scenes.SCENES["tip_meets_flank"]()
    options |= {"max_steps": 2, "progress": False}
    steps = []
    grown = xc.grow(problem, growth_scenes.LAW, xc.max_hoop_stress, cycle, **options)
    assert not any("energy" in message for message in warned(lambda: steps.extend(grown)))
    assert steps[1].joins


def unit_loads(factors):
    return scene(stress=1.0), LAW, xc.Spectrum(factors)


SLIPS = {
    "E in GPa": (lambda: (scene(steel(210.0)), LAW, CYCLE), "displacement over the size"),
    "C too large": (lambda: (scene(), xc.paris(1e-8, 3.0), CYCLE), "da/dN over the size"),
    "C too large for a long crack": (lambda: (scene(), xc.paris(3e-9, 3.0), CYCLE), "da/dN"),
    "C too small": (lambda: (scene(), xc.paris(1e-22, 3.0), CYCLE), "the crack over da/dN"),
    "spectrum in MPa": (
        lambda: (scene(), LAW, xc.Spectrum([10, 80, 20, 60.0, 5, 80])),
        "factor of the spectrum",
    ),
    "K_c in MPa√m": (lambda: (scene(steel(K_c=33.0)), LAW, CYCLE), "K over the toughness"),
    "law in m": (
        lambda: (scene(), xc.law("AA7050-T7451 NASGRO", units="m, MPa√m"), CYCLE),
        "da/dN of the first step",
    ),
    "threshold in Pa": (
        lambda: (scene(), xc.paris(1e-13, 3.0, threshold=xc.klesnil_lukas(6.3e6, 0.5)), CYCLE),
        "up to which there is no growth",
    ),
    "no load": (lambda: (xc.Problem(BODY, steel(), [EDGE]), LAW, CYCLE), "largest displacement"),
    "beyond yield": (
        lambda: (scene(steel(yield_stress=60.0), 80.0), LAW, CYCLE),
        "that 5 % of the body exceeds",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_has_a_line_with_number_limit_place_and_remedy(name):
    make, words = SLIPS[name]
    alarms = xc.check(*make())
    (alarm,) = [each for each in alarms if words in each.quantity][:1]
    assert alarm.value > alarm.limit or name == "no load"
    text = str(alarm)
    assert f"{alarm.value:.4g}" in text
    assert f"{alarm.limit:.4g}" in text
    assert alarm.remedy in text


def test_unit_loads_beside_a_spectrum_in_MPa_are_as_meant():
    assert xc.check(*unit_loads([10, 80, 20, 60.0, 5, 80])) == ()


def test_a_flaw_below_the_threshold_is_as_meant():
    assert (
        xc.check(scene(), xc.paris(1e-13, 3.0, threshold=xc.klesnil_lukas(700.0, 0.5)), CYCLE) == ()
    )


def test_a_scene_without_units_is_judged_by_its_rates_alone():
    """E = 1 and a strain of 80: displacements are what they are."""
    assert xc.check(scene(steel(1.0)), LAW, CYCLE) == ()


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_sides_along_the_way_ahead_of_a_front_are_not_met():
    """The way from a straight front runs along facets of a box: no number is made of these."""
    sheet = xc.plane_crack(
        [(-1.5, -1.5, 0.04), (0.1, -1.5, 0.04), (0.1, 1.5, 0.04), (-1.5, 1.5, 0.04)]
    )
    pull = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]
    metal = xc.Isotropic(E=210e3, nu=0.3, yield_stress=400.0)
    body = xc.box((-1, -1, -1), (1, 1, 1), 4)
    problem = xc.Problem(body, metal, [sheet], loads=pull, order=1)
    alarms = xc.check(problem, xc.paris(1e-13, 3.0), CYCLE)
    assert any("ligament ahead" in alarm.quantity for alarm in alarms)


def test_growth_warns_of_the_same_once():
    problem = scene(steel(K_c=3000.0, yield_stress=100.0))
    alarms = xc.check(problem, LAW, CYCLE, K_c=300.0)
    assert [a.quantity for a in alarms if "toughness" in a.quantity]
    history = []
    options = {"da": 2.0, "max_steps": 4, "progress": False}
    messages = warned(lambda: history.append(
        xc.collect(xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, **options))
    ))  # fmt: skip
    zones = [text for text in messages if "plastic zone" in text and "it came again" not in text]
    assert len([text for text in messages if "ligament ahead" in text]) <= 2  # and its summary
    assert zones
    assert any("plastic zone" in text for text in history[0].warnings)


def test_growth_ends_at_the_toughness_of_the_material():
    problem = scene(steel(K_c=500.0))
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=1.0, progress=False)
    assert xc.collect(steps).ended.startswith("K_c reached: K_eq = ")
    free = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=1.0, K_c=1e6, max_steps=3)
    assert xc.collect(free).ended.startswith("max_steps")


def validity_of(problem):
    """Of the first step of growth, with its K."""
    options = {"da": 0.1, "progress": False}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        step = next(xc.grow(problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), **options))
    return step.validity, step.sif[-1][0]


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_plastic_zones_are_those_of_Irwin(plane):
    """(K / yield)²/2π, a third of it in plane strain, against crack and ligament."""
    loads = [xc.traction("top", (0, 80.0)), xc.traction("bottom", (0, -80.0))]
    material = xc.Isotropic(210e3, 0.3, plane, yield_stress=300.0, K_c=400.0)
    known, sif = validity_of(xc.Problem(BODY, material, [EDGE], loads=loads))
    zone = (known.K / 300.0) ** 2 / (2 * np.pi) / (3 if plane == "strain" else 1)
    assert known.K == pytest.approx(sif.K_I[0], rel=1e-2)  # K_II is next to nothing
    assert known.zone == pytest.approx(zone, rel=1e-12)
    assert known.of_crack == pytest.approx(zone / 4, rel=1e-9)
    assert known.of_ligament == pytest.approx(zone / 16, rel=1e-2)  # it runs almost straight
    assert known.of_toughness == pytest.approx(known.K / 400, rel=1e-12)


def test_the_net_section_yields_where_statics_says():
    """Force and moment on the ligament of an edge crack follow from the loads alone."""
    loads = [xc.traction("top", (0, 80.0)), xc.traction("bottom", (0, -80.0))]
    body = xc.box((0, -20), (20, 20), (40, 80))
    material = xc.Isotropic(210e3, 0.3, "stress", yield_stress=300.0)
    known, _ = validity_of(xc.Problem(body, material, [EDGE], loads=loads))
    b, force = 16.0, 80.0 * 20
    moment = force * 2.0  # the load acts in the middle of 20, the ligament's middle is at 12
    n, m = force / b / 300.0, 4 * moment / b**2 / 300.0
    load = 0.5 * (m + np.sqrt(m**2 + 4 * n**2))
    assert known.of_section == pytest.approx(load, rel=0.03)  # discretisation: 0.5 mm cells


def test_a_place_of_a_front_has_the_ligament_up_to_the_other_side():
    """A penny in the middle of a block: 0.5 to its sides; thick enough for plane strain."""
    body = xc.box((-1, -1, -1), (1, 1, 1), (6, 6, 6))
    crack = xc.penny_crack((0.01, 0.02, 0.03), (0, 0, 1), 0.5)
    loads = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]
    material = xc.Isotropic(210e3, 0.3, yield_stress=300.0)
    known, _ = validity_of(xc.Problem(body, material, [crack], loads=loads))
    assert known.state == "strain"
    assert known.zone == pytest.approx((known.K / 300) ** 2 / (6 * np.pi), rel=1e-12)
    assert 0.45 < known.zone / known.of_ligament < 0.75
    assert np.isnan(known.of_section)


def test_a_table_says_how_far_elasticity_holds(tmp_path):
    """Irwin's zone (K / yield)² / 6π over the crack; a run that is read from disk knows it."""
    material = steel(yield_stress=400.0, K_c=1500.0)
    steps = xc.grow(scene(material), LAW, xc.max_hoop_stress, CYCLE, da=1.5, max_steps=3)
    history = xc.collect(steps, tmp_path / "run")
    table = history.table()
    K = np.hypot(table["K_I_max"], table["K_II_max"])
    zone = (K / 400.0) ** 2 / (6 * np.pi)
    assert table["zone_of_crack"] == pytest.approx(zone / table["a"], rel=1e-3)  # of K_eq
    assert table["zone_of_ligament"] == pytest.approx(zone / (20 - table["x"]), rel=2e-3)
    assert table["K_of_K_c"] == pytest.approx(K / 1500.0, rel=1e-3)
    assert (np.diff(table["section"]) > 0).all()
    stored = xc.load(tmp_path / "run")
    for name in ("zone_of_crack", "zone_of_ligament", "section", "K_of_K_c"):
        np.testing.assert_array_equal(stored.table()[name], table[name])
    assert stored.steps[1].validity.places == history.steps[1].validity.places
    plain = xc.grow(scene(), LAW, xc.max_hoop_stress, CYCLE, da=1.5, max_steps=1)
    assert "K_of_K_c" not in xc.collect(plain).table().dtype.names


def test_life_says_from_when_elasticity_does_not_hold():
    problem = scene(steel(yield_stress=300.0))
    steps = xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=3.0, max_steps=4, progress=False)
    history = []
    warned(lambda: history.append(xc.collect(steps)))
    messages = warned(lambda: xc.life(history[0], scatter=xc.Scatter(C=xc.lognormal(0.1)), seed=7))
    assert any("life: from N = " in text and "does not hold" in text for text in messages)


def test_nothing_else_than_a_run_is_taken():
    with pytest.raises(xc.ProblemError, match="cannot be called"):
        xc.check(scene(), 3.0, CYCLE)
    with pytest.raises(TypeError, match="unexpected keyword argument"):
        xc.check(scene(), LAW, CYCLE, foo=1)
    for name in ("yield_stress", "K_c"):
        with pytest.raises(xc.ProblemError, match=name):
            steel(**{name: 0.0})
