"""Residual strength, assessment line, factors of geometry, opening loads, energy release rate."""

from dataclasses import replace

import numpy as np
import pytest

from support.growth_fakes import STRESS, formula, mode_I, plate
from xcrack import (
    Cycle,
    History,
    Isotropic,
    Problem,
    ProblemError,
    Spectrum,
    assessment_line,
    box,
    elliptic_crack,
    energy_release_rate,
    fix,
    geometry_factors,
    grow,
    line_crack,
    max_hoop_stress,
    opening_load,
    paris,
    plot_strength,
    residual_strength,
    respond,
    traction,
    write_factors,
)

LAW = paris(1e-11, 3.0)
STEEL = assessment_line(E=210e3, sigma_y=355.0, sigma_u=510.0)


@pytest.fixture
def history():
    response = formula(mode_I())
    steps = grow(
        plate(),
        LAW,
        max_hoop_stress,
        Cycle(0.0, 1.0),
        da=3.0,
        max_steps=5,
        progress=False,
        response=response,
    )
    return History(tuple(steps), "")


def test_line_has_the_values_of_its_formula():
    """(1 + L²/2)^(-1/2) [0.3 + 0.7 exp(-0.5915 L⁶)] worked by hand, and its ends."""
    assert STEEL(0.0) == 1
    assert float(STEEL(0.5)) == pytest.approx((0.3 + 0.7 * 0.990800) / np.sqrt(1.125), abs=1e-6)
    at_1 = (0.3 + 0.7 * np.exp(-210 / 355)) / np.sqrt(1.5)
    assert float(STEEL(1.0)) == pytest.approx(at_1, rel=1e-14)
    assert float(STEEL(1 + 1e-9)) == pytest.approx(at_1, rel=1e-6)
    N = 0.3 * (1 - 355 / 510)
    assert float(STEEL(1.1)) == pytest.approx(at_1 * 1.1 ** ((N - 1) / (2 * N)), rel=1e-14)
    assert STEEL.L_max == pytest.approx((355 + 510) / 710)
    assert np.array_equal(STEEL([STEEL.L_max, 2.0]), [0.0, 0.0])
    L = np.linspace(0, STEEL.L_max, 200)
    assert (np.diff(STEEL(L)) <= 0).all()
    soft = assessment_line(210e3, 200.0, 200.0)  # no hardening: collapse at yield
    assert soft.L_max == 1


@pytest.mark.parametrize(("K_r", "L_r"), [(0.3, 0.2), (0.9, 0.01), (0.01, 0.9), (2.0, 1.5)])
def test_reserve_leads_to_the_line(K_r, L_r):
    factor = STEEL.reserve(K_r, L_r)
    if factor * L_r < STEEL.L_max * (1 - 1e-12):
        assert factor * K_r == pytest.approx(float(STEEL(factor * L_r)), rel=1e-9)
    else:
        assert float(STEEL(STEEL.L_max * (1 - 1e-12))) > factor * K_r
    assert STEEL.reserve(0.5, 0.0) == 2
    assert STEEL.reserve(0.0, 0.5) == pytest.approx(STEEL.L_max / 0.5)


def test_residual_strength(history):
    """K = stress √(π a): factors by hand, of every step; the joint one is below both."""
    table = residual_strength(
        history, nu=0.3, K_c=2000.0, collapse=lambda a: 300.0 / STRESS * (1 - a / 60), line=STEEL
    )
    assert table["a"].tolist() == pytest.approx([5.0, 8.0, 11.0, 14.0, 17.0])
    assert table["N"].tolist() == [step.cycles for step in history.steps]
    assert np.allclose(table["by_toughness"], 2000 / (STRESS * np.sqrt(np.pi * table["a"])))
    assert np.allclose(table["by_collapse"], 3.0 * (1 - table["a"] / 60))
    assert (
        table["by_line"] < np.minimum(table["by_toughness"], STEEL.L_max * table["by_collapse"])
    ).all()
    assert (np.diff(table["by_line"]) < 0).all()
    alone = residual_strength(history, nu=0.3, K_c=2000.0)
    assert np.isnan(alone["by_line"]).all()


def test_factors_of_geometry(history):
    """beta = 1 where K = stress √(π a), for one tip and for two."""
    table = geometry_factors(history, stress=STRESS)
    assert np.allclose(table["beta"], 1, rtol=1e-12)
    assert table["a"].tolist() == pytest.approx([5, 8, 11, 14, 17])
    two = plate([line_crack([(25.0, 0.37), (35.0, 0.37)])])
    options = {"da": 1.0, "progress": False, "response": formula(mode_I())}
    step = next(grow(two, LAW, max_hoop_stress, Cycle(0.0, 1.0), **options))
    assert np.allclose(geometry_factors(History((step,), ""), stress=STRESS)["beta"], 1, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda h: assessment_line(1.0, 2.0, 1.0), "is below sigma_y"),
        (lambda h: assessment_line(0.0, 2.0, 3.0), "E = 0"),
        (lambda h: STEEL(-1.0), "at least 0"),
        (lambda h: STEEL.reserve(0, 0), "give a load"),
        (lambda h: STEEL.reserve(-1, 0), "K_r = -1"),
        (lambda h: residual_strength(3, nu=0.3, K_c=1), "history = 3"),
        (lambda h: residual_strength(h, nu=0.5, K_c=1), "nu"),
        (lambda h: residual_strength(h, nu=0.3, K_c=0), "K_c = 0"),
        (lambda h: residual_strength(h, nu=0.3, K_c=1, line=STEEL), "collapse with it"),
        (lambda h: residual_strength(h, nu=0.3, K_c=1, collapse=3), "collapse = 3"),
        (lambda h: residual_strength(h, nu=0.3, K_c=1, collapse=lambda a: -a), "not possible"),
        (lambda h: geometry_factors(3, stress=1), "history = 3"),
        (lambda h: geometry_factors(h, stress=0), "stress = 0"),
        (lambda h: opening_load(3), "step = 3"),
        (lambda h: opening_load(h.steps[0]), "no levels"),
        (lambda h: energy_release_rate(3, Isotropic(1.0, 0.3)), "sif = 3"),
        (lambda h: energy_release_rate(h.steps[0].sif[0][0], 3), "material = 3"),
    ],
)
def test_bad_input(history, make, words):
    with pytest.raises(ProblemError, match=words):
        make(history)


def test_energy_release_rate(history):
    """Irwin's relation with K of 100, 50 and 30; plane stress has E, others E / (1 - nu²)."""
    sif = history.steps[0].sif[1][0]
    flat = replace(sif, K=np.array([[100.0, 50.0]]))
    for plane, E in (("stress", 2e5), ("strain", 2e5 / 0.91)):
        G = energy_release_rate(flat, Isotropic(2e5, 0.3, plane))
        assert G == pytest.approx(12500.0 / E, rel=1e-14)


# --- opening, with contact -----------------------------------------------------------------------


def bent(levels="auto"):
    """An edge crack in tension that steady bending presses shut."""
    mesh = box((0.0, -10.0), (20.0, 10.0), (14, 15))

    def bending(x):
        return np.stack([0 * x[:, 0], 6.0 * (x[:, 0] - 10.0)], axis=1)

    problem = Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(0.0, 0.4), (6.0, 0.4)])],
        supports=[fix((20.0, -10.0)), fix((20.0, 10.0), axis=0)],
        loads=[traction("top", (0.0, 100.0)), traction("bottom", (0.0, -100.0))],
    )
    steady = [traction("top", bending), traction("bottom", lambda x: -bending(x))]
    factors = np.random.default_rng(20265).uniform(0.0, 1.0, 60)
    factors[[2, 5]] = 0.0, 1.0
    return problem, Spectrum(factors, steady=steady, levels=levels)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_opening_load_is_where_the_tip_opens():
    """Against 65 levels; the refined ones are close to the knee. U as the share of the range."""
    step = {}
    for levels in ("auto", 65):
        problem, spectrum = bent(levels)
        step[levels] = next(grow(problem, LAW, max_hoop_stress, spectrum, da=1.0, progress=False))
    coarse, fine = opening_load(step["auto"]), opening_load(step[65])
    level = float(fine.level[0][0])
    assert 0.05 < level < 0.6
    assert float(coarse.level[0][0]) == pytest.approx(level, abs=0.02)
    assert float(coarse.U[0][0]) == pytest.approx(1 - level, abs=0.02)
    assert 0 < coarse.between[0][0] <= 0.25
    K = {}
    problem, spectrum = bent()
    for factor in (level - 0.03, level + 0.03):
        pull = [traction("top", (0.0, 100 * factor)), traction("bottom", (0.0, -100 * factor))]
        state = [*spectrum.steady, *pull]
        K[factor] = respond(problem, [state]).sif[0][0].K[0, 0]
    below, above = K.values()
    assert below < 2e-2 * step[65].sif[-1][0].K[0, 0]
    assert above > below


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_scaled_histories_open_at_zero():
    problem, _ = bent()
    plain = Spectrum([-0.5, 1.0, 0.2, 0.4])
    step = next(grow(problem, LAW, max_hoop_stress, plain, da=1.0, progress=False))
    assert opening_load(step).level[0][0] == 0
    assert opening_load(step).U[0][0] == pytest.approx(2 / 3)
    pulled = Spectrum([0.2, 1.0, 0.4, 0.6])
    step = next(grow(problem, LAW, max_hoop_stress, pulled, da=1.0, progress=False))
    assert opening_load(step).U[0][0] == 1


def test_table_of_factors_for_life_codes(history, tmp_path):
    """Columns a, c, K, beta; beta is 1 in the formula of these steps."""
    file = write_factors(history, tmp_path / "new" / "beta.txt", stress=STRESS)
    head = file.read_text().splitlines()[:3]
    assert head[2].split() == ["#", "a", "c", "K", "beta"]
    a, c, K, beta = np.loadtxt(file).T
    assert np.allclose(a, 5.0 + 3.0 * np.arange(5), rtol=1e-8)
    assert np.isnan(c).all()
    assert np.allclose(beta, 1, rtol=1e-7)
    assert np.allclose(K, STRESS * np.sqrt(np.pi * a), rtol=1e-7)
    with pytest.raises(ProblemError, match="has no crack 3 with a tip 0"):
        write_factors(history, tmp_path / "beta.txt", stress=STRESS, crack=3)
    with pytest.raises(ProblemError, match="stress = 0"):
        write_factors(history, tmp_path / "beta.txt", stress=0)
    with pytest.raises(ProblemError, match="history = 3"):
        write_factors(3, tmp_path / "beta.txt", stress=1)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_table_of_factors_of_a_surface_crack(tmp_path):
    """Depth and half of the surface length of a half-disc, which are both its radius."""
    mesh = box((-1.0, -1.0, -1.0), (1.0, 1.0, 0.0), (13, 13, 7))
    crack = elliptic_crack((0.013, 0.017, 0.0), (0, 1.0, 0), (1.0, 0, 0), 0.4, 0.4)
    problem = Problem(
        mesh,
        Isotropic(E=2e5, nu=0.3),
        cracks=[crack],
        loads=[traction("back", (0, 100.0, 0)), traction("front", (0, -100.0, 0))],
        order=1,
    )
    steps = grow(
        problem, LAW, max_hoop_stress, Cycle(0.0, 1.0), da=0.05, max_steps=1, progress=False
    )
    history = History(tuple(steps), "", mesh=mesh)
    a, c, K, beta = np.loadtxt(write_factors(history, tmp_path / "b.txt", stress=100.0))
    assert a == pytest.approx(0.4, rel=0.02)
    assert c == pytest.approx(0.4, rel=0.02)
    assert beta == pytest.approx(K / (100 * np.sqrt(np.pi * a)), rel=1e-6)


def test_an_r_curve_is_touched_by_K_of_the_extending_crack():
    """K = S √(π a), K_R = C √da: the largest K_R/K is at the largest extension that the run has;
    a curve that saturates has its tangent inside, found by hand on a fine grid."""
    response = formula(mode_I())
    given = {"da": 0.5, "max_steps": 30, "progress": False, "response": response}
    run = History(tuple(grow(plate(), LAW, max_hoop_stress, Cycle(0.0, 1.0), **given)), "")

    def resistance(da):
        return 2500.0 * (1 - 0.6 * np.exp(-da / 1.5))

    rows = residual_strength(run, nu=0.3, K_c=1000.0, resistance=resistance)
    a = 5.0 + np.linspace(0, 14, 200_001)
    by_hand = (resistance(a - 5.0) / (STRESS * np.sqrt(np.pi * a))).max()
    assert rows["by_resistance"][0] == pytest.approx(by_hand, rel=1e-3)
    assert by_hand > 1000.0 / (STRESS * np.sqrt(5 * np.pi))  # beyond the onset
    assert np.array_equal(rows["factor"], rows["by_resistance"])  # K_c is the onset only
    assert rows["by_resistance"][-1] == pytest.approx(
        resistance(0.0) / rows["K"][-1]
    )  # a run that ends there


def test_link_up_is_that_of_two_zones_in_the_ligament():
    """Swift: K²/(2π σ²) of both tips fill the ligament; tips that do not face each other do not."""
    pair = [line_crack([(10.0, 0.37), (20.0, 0.37)]), line_crack([(26.0, 0.37), (34.0, 0.37)])]
    options = {"da": 0.5, "max_steps": 1, "progress": False, "response": formula(mode_I())}
    (step,) = grow(plate(pair), LAW, max_hoop_stress, Cycle(0.0, 1.0), **options)
    rows = residual_strength(History((step,), ""), nu=0.3, K_c=1e5, yield_stress=300.0)
    zones = [(STRESS / 300.0) ** 2 * a / 2 for a in (5.0, 4.0)]  # of K = S √(π a)
    assert rows["by_link_up"][0] == pytest.approx(np.sqrt(6.0 / sum(zones)))
    assert rows["crack"][0] == 0
    assert np.isnan(rows["by_section"][0])  # no solutions
    alone = [line_crack([(10.0, 0.37), (20.0, 0.37)])]
    (step,) = grow(plate(alone), LAW, max_hoop_stress, Cycle(0.0, 1.0), **options)
    assert residual_strength(History((step,), ""), nu=0.3, K_c=1.0, yield_stress=1.0)[
        "by_link_up"
    ] == [np.inf]


def test_net_section_and_one_curve_through_a_join(tmp_path):
    """Two collinear cracks: the lead crack goes on through the join, strength falls with it, and
    the net section carries the load of the ligaments (exact: a strip under tension alone)."""
    pull = [traction("top", (0.0, 100.0)), traction("bottom", (0.0, -100.0))]
    cracks = [line_crack([(12.0, 0.3), (20.0, 0.3)]), line_crack([(23.0, 0.3), (28.0, 0.3)])]
    mesh = box((0.0, -20.0), (40.0, 20.0), (40, 40))
    scene = Problem(mesh, Isotropic(73e3, 0.33, "stress"), cracks, loads=pull)
    steps = grow(scene, LAW, max_hoop_stress, Cycle(0.0, 1.0), da=0.8, max_steps=5, progress=False)
    run = History(tuple(steps), "")
    assert run.joins
    rows = residual_strength(run, nu=0.33, K_c=4000.0, yield_stress=350.0)
    assert np.isinf(rows["by_link_up"][-1])
    assert np.isfinite(rows["by_link_up"][0])
    assert (np.diff(rows["factor"]) < 0).all()
    assert set(rows["crack"]) == {0}
    assert rows["by_section"][0] < 350 / 100 * (40 - 13) / 40 * 1.02
    figure = plot_strength(rows, unit="flight", file=tmp_path / "strength.png")
    assert figure.axes[0].get_xlabel() == "flights N"
    assert (tmp_path / "strength.png").stat().st_size > 1e4


def test_bad_input_of_strength(history):
    with pytest.raises(ProblemError, match="give a function of da"):
        residual_strength(history, nu=0.3, K_c=1.0, resistance=3.0)
    with pytest.raises(ProblemError, match="0 over the whole run"):
        residual_strength(history, nu=0.3, K_c=1.0, resistance=lambda da: 0.0)
    with pytest.raises(ProblemError, match="residual_strength returns"):
        plot_strength(np.zeros(3))
