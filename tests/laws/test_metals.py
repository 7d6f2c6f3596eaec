"""Metals by name: values as in their documents, units, and lives beside measured ones."""

import tomllib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc

UNITS = "mm, MPa√mm"
MEASURED = Path(xc.__file__).parent / "verification" / "experiments" / "data"
KSI, KSI_IN = 6.894757293168361, 6.894757293168361 * np.sqrt(25.4)


def test_values_of_the_documents_in_other_units():
    metal = xc.material("7075-T651 plate, L-T", units=UNITS)
    assert metal.E == pytest.approx(10300 * KSI)
    assert metal.yield_stress == pytest.approx(70 * KSI)
    assert metal.K_Ic == pytest.approx(28 * KSI_IN)
    assert metal.K_c(0.45 * 25.4) == pytest.approx(49.9 * KSI_IN)
    assert metal.K_c(3.0) == metal.K_c(0.45 * 25.4)  # of the next thicker plate tested
    assert metal.K_c(12.0) == metal.K_Ic
    walker = metal.law("walker")
    rate = walker(10 * KSI_IN, 0.5)
    by_hand = 1.3e-8 * (10 / 0.5**0.35) ** 2.791 * 25.4
    assert rate == pytest.approx(by_hand, rel=1e-12)
    in_inches = xc.material("7075-T651 plate, L-T", units="in, ksi√in")
    assert in_inches.law("nasgro").C == 3e-8
    assert in_inches.E == 10300
    in_newtons = xc.material("7075-T651 plate, L-T", units="mm, N/mm^1.5")
    assert in_newtons.E == pytest.approx(metal.E, rel=1e-14)


@pytest.mark.parametrize("name", xc.materials())
def test_every_value_has_a_document(name):
    metal = xc.material(name, units=UNITS)
    text = str(metal)
    for quantity in ("E", "nu", "yield_stress", "ultimate_stress", "K_Ic"):
        assert (getattr(metal, quantity) is None) == (quantity not in metal.sources)
    assert set(metal.laws) <= set(metal.sources)
    assert all(len(source) > 20 and source in text for source in metal.sources.values())
    for law in metal.laws.values():
        R = 0.1 if not law.R_range else max(0.1, law.R_range[0])
        needs = {"a": 10.0} if getattr(law, "needs", ()) else {}
        assert 1e-6 < law(400.0, R, **needs) < 1e-2
    if metal.E is not None:
        assert metal.isotropic("stress").yield_stress == metal.yield_stress


def mean_life(law, R, thickness):
    """Cycles of Virkler's panels by Feddersen's K, from the first length to the last."""
    experiment = tomllib.loads((MEASURED / "virkler_1979.toml").read_text(encoding="utf-8"))
    a = np.array(experiment["measured"]["a"], dtype=float)
    N = np.array(experiment["measured"]["N"], dtype=float).mean(axis=1)
    W, load = experiment["geometry"]["width"], experiment["load"]
    fine = np.linspace(a[0], a[-1], 4001)
    dK = load["stress_range"] * np.sqrt(np.pi * fine / np.cos(np.pi * fine / W))
    needs = {"a": fine} if getattr(law, "needs", ()) else {}
    rate = law(dK, np.full_like(dK, R), **needs)
    return np.trapezoid(1 / rate, fine), N[-1]


@pytest.mark.parametrize("name", ["nasgro", "walker", "forman"])
def test_lives_of_2024_T3_are_those_of_measured_panels_within_the_scatter_of_documents(name):
    law = xc.material("2024-T3 sheet, L-T", units=UNITS).law(name)
    computed, measured = mean_life(law, 0.2, 2.54)
    assert 0.4 < computed / measured < 2.0, computed / measured


def test_laws_of_two_documents_agree_within_a_factor():
    for name in ("2024-T3 sheet, L-T", "7475-T7351 plate, L-T"):
        metal = xc.material(name, units="m, MPa√m")
        for dK in (10.0, 15.0, 20.0):
            ratio = metal.laws["nasgro"](dK, 0.1, a=0.1) / metal.laws["forman"](dK, 0.1)
            assert 1 / 3 < ratio < 3, (name, dK, ratio)


def test_what_is_missing_is_refused_with_the_mend():
    with pytest.raises(xc.ProblemError, match="give one of '7075-T651 plate, L-T'"):
        xc.material("7075-T6 plate, L-T", units=UNITS)
    with pytest.raises(xc.ProblemError, match="root of another length"):
        xc.material("6061-T6 sheet", units="mm, MPa√m")
    metal = xc.material("7475-T7351 plate, L-T", units=UNITS)
    with pytest.raises(xc.ProblemError, match=r"E and nu was read: give isotropic\(E="):
        metal.isotropic("stress")
    assert metal.isotropic("stress", E=71e3, nu=0.33).yield_stress == metal.yield_stress
    with pytest.raises(xc.ProblemError, match="give one of 'nasgro', 'forman'"):
        metal.law("paris")
    stainless = xc.material("316 stainless steel, annealed", units=UNITS)
    with pytest.raises(xc.ProblemError, match="no source with a growth law"):
        stainless.law()
    with pytest.raises(xc.ProblemError, match="leave out the thickness"):
        stainless.K_c(5.0)


def test_a_law_takes_the_toughness_of_the_thickness():
    metal = xc.material("7075-T651 plate, L-T", units=UNITS)
    assert metal.law(thickness=20.0).K_c == metal.K_Ic
    assert metal.law("walker", thickness=5.0).K_c == metal.K_c(5.0)
    sheet = xc.material("2024-T3 sheet, L-T", units=UNITS)
    assert sheet.law("forman", thickness=20.0) == sheet.laws["forman"]


def test_the_data_are_in_the_package():
    assert files("xcrack.fatigue").joinpath("metals.toml").is_file()


def test_rates_of_all_in_one_picture(tmp_path):
    metals = [xc.material(name, units=UNITS) for name in xc.materials()]
    figure = xc.plot_rates(metals, units=UNITS, file=tmp_path / "rates.png")
    axes = figure.axes[0]
    assert len(axes.lines) == sum(bool(metal.laws) for metal in metals)
    assert axes.get_xlabel() == "ΔK in MPa√mm"
    with pytest.raises(xc.ProblemError, match=r"no law grows at R = 0\.99"):
        xc.plot_rates({"a": xc.paris(1e-12, 3, R_range=(0, 0.5))}, units=UNITS, R=0.99)
    with pytest.raises(xc.ProblemError, match="in the units drawn"):
        xc.plot_rates(metals, units="m, MPa√m")
