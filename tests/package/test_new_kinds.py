"""A user's own load, growth law, closure and threshold, each one class, in every place.

Materials are in test_new_material; here is their reading with units.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

import xcrack as xc
from support.growth_fakes import formula, mode_I, plate
from xcrack.base.arguments import Number, Text
from xcrack.base.units import LENGTH, NUMBER, STRESS, TOUGHNESS

STEEL = xc.Isotropic(210e3, 0.3, plane="strain")


@dataclass(frozen=True, eq=False)
class ramped_suction(xc.Load):  # noqa: N801 - it is used as a function
    """Pull along the outer normal on a facet set, in proportion to y."""

    where: Annotated[str, Text("the name of a facet set")]
    per_length: Annotated[float, Number(unit=(STRESS[0] - LENGTH[0], STRESS[1]))]

    acts = frozenset({"traction"})

    def traction(self, points):
        """Traction at points of the facets."""
        return self.per_length * points.x[:, 1:2] * points.normal


@dataclass(frozen=True)
class exponential_law(xc.GrowthLaw):  # noqa: N801
    """da/dN = C (exp(ΔK / D) - 1)."""

    C: Annotated[float, Number(above=0, unit=LENGTH)]
    D: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    closure: xc.Closure | None = None
    threshold: xc.Threshold | None = None

    def rate(self, dK, R):
        """Between threshold and toughness."""
        return self.C * np.expm1(dK / self.D)


@dataclass(frozen=True)
class half_open(xc.Closure):  # noqa: N801
    """U = 1/2 at any R."""

    def __call__(self, R):
        return 0.5 + 0.0 * np.asarray(R)


@dataclass(frozen=True)
class falling_threshold(xc.Threshold):  # noqa: N801
    """dK0 exp(-b R)."""

    dK0: Annotated[float, Number(above=0, unit=TOUGHNESS)]
    b: Annotated[float, Number(unit=NUMBER)]

    def value(self, R, a, closure):
        """Threshold for R."""
        return self.dK0 * np.exp(-self.b * R)


@dataclass(frozen=True)
class bonded_rubber(xc.Material):  # noqa: N801
    """Isotropic, by bulk and shear modulus."""

    bulk: Annotated[float, Number(above=0, unit=STRESS)]
    shear: Annotated[float, Number(above=0, unit=STRESS)]
    plane: str | None = None

    def stiffness(self):
        """Of the body in space."""
        C = np.diag(np.repeat([2 * self.shear, self.shear], 3))
        C[:3, :3] += self.bulk - 2 * self.shear / 3
        return C


def scene(load):
    mesh = xc.box((0, -20), (20, 20), (20, 40))
    return xc.Problem(mesh, STEEL, [xc.line_crack([(0, 0.3), (6, 0.3)])], [xc.fix("bottom")],
                      [load])  # fmt: skip


OWN = ramped_suction("top", 4.0)
SAME = xc.traction("top", lambda x: np.stack([0 * x[:, 0], 4.0 * x[:, 1]], axis=1))


def test_a_load_solves_gives_K_and_bars_as_the_same_traction():
    solutions = [xc.solve(scene(load), error=True) for load in (OWN, SAME)]
    K, same = (xc.stress_intensity(each) for each in solutions)
    assert np.allclose(solutions[0].u, solutions[1].u, rtol=0, atol=1e-12 * abs(same.K).max())
    assert np.allclose(K.K, same.K, rtol=1e-10)
    assert np.allclose(K.bar, same.bar, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.mission
def test_a_load_grows_and_is_in_folders_files_pictures_and_reports(tmp_path):
    problem = scene(OWN)
    run = tmp_path / "run"
    law = xc.paris(1e-13, 3.0)
    steps = xc.grow(problem, law, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=1.0, max_steps=2,
                    progress=False)  # fmt: skip
    history = xc.collect(steps, path=run)
    assert len(history.steps) == 2
    report = xc.report(run, tmp_path / "report.html")
    assert "ramped_suction" in report.read_text(encoding="utf-8")
    saved = xc.load(xc.save(xc.solve(problem), tmp_path / "solution"))
    assert isinstance(saved.problem.loads[0], ramped_suction)
    assert saved.problem.loads[0].per_length == 4.0
    xc.plot(saved, "von_mises", file=tmp_path / "picture.png", show=False)
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_a_load_is_read_from_a_case_file_with_units(tmp_path):
    (tmp_path / "case.toml").write_text(
        '[units]\nlength = "mm"\nforce = "N"\n'
        '[mesh]\nkind = "box"\nlower = [0.0, -20.0]\nupper = [20.0, 20.0]\nn = [20, 40]\n'
        '[material]\nE = "210 GPa"\nnu = 0.3\nplane = "strain"\n'
        '[[cracks]]\nkind = "line"\npoints = [[0.0, 0.3], [6.0, 0.3]]\n'
        '[[supports]]\nkind = "fix"\nwhere = "bottom"\n'
        '[[loads]]\nkind = "ramped_suction"\nwhere = "top"\nper_length = "4 MPa/mm"\n'
    )
    problem = xc.read_case(tmp_path / "case.toml").problem
    assert isinstance(problem.loads[0], ramped_suction)
    assert problem.loads[0].per_length == pytest.approx(4.0)


def test_a_material_is_read_from_a_case_file_with_units(tmp_path):
    case = tmp_path / "case.toml"
    text = (
        '[units]\nlength = "mm"\nforce = "N"\n'
        '[mesh]\nkind = "box"\nlower = [0.0, -20.0]\nupper = [20.0, 20.0]\nn = [20, 40]\n'
        '[material]\nkind = "bonded_rubber"\nbulk = "2 GPa"\nshear = "{}"\nplane = "strain"\n'
    )
    case.write_text(text.format("600 kPa"))
    material = xc.read_case(case).problem.material
    assert (material.bulk, material.shear) == pytest.approx((2000.0, 0.6))
    case.write_text(text.format("-1 MPa"))
    with pytest.raises(xc.ProblemError, match="bonded_rubber: shear = -1"):
        xc.read_case(case)


def test_bad_arguments_of_a_load_are_refused_by_its_rules():
    with pytest.raises(xc.ProblemError, match="ramped_suction: per_length"):
        ramped_suction("top", float("nan"))
    with pytest.raises(xc.ProblemError, match="roof"):
        scene(ramped_suction("roof", 1.0))


LAW = exponential_law(1e-6, 500.0, half_open(), falling_threshold(100.0, 0.3))


def test_a_law_with_its_own_parts():
    """Closure inside the rate, threshold on the range itself; units of fields; refused values."""
    assert LAW(600.0, 0.5) == pytest.approx(1e-6 * np.expm1(0.6), rel=1e-14)
    assert LAW(99.0, 0.0) == 0
    assert LAW(101.0, 0.0) > 0
    assert LAW(99.0, 0.5) > 0  # the threshold is 86 there
    metres = LAW.to("mm, N/mm^1.5", "m, MPa√m")
    assert metres(600.0 / 1000**0.5, 0.5) * 1000 == pytest.approx(LAW(600.0, 0.5), rel=1e-13)
    with pytest.raises(xc.ProblemError, match="exponential_law: D = 0"):
        exponential_law(1.0, 0.0)
    with pytest.raises(xc.ProblemError, match="a range is not negative"):
        LAW(-1.0, 0.0)


def test_a_law_grows_a_crack_as_its_integral():
    law = exponential_law(1e-6, 500.0)
    cycle = xc.Cycle(0.0, 1.0)
    steps = list(xc.grow(plate(), law, xc.max_hoop_stress, cycle, da=0.25, max_steps=9,
                         progress=False, response=formula(mode_I())))  # fmt: skip
    a = np.linspace(*(steps[n].cracks[0].points[-1, 0] for n in (0, -1)), 20001)
    K = steps[0].sif[-1][0].K[-1, 0] * np.sqrt(a / a[0])
    N = np.trapezoid(1 / law(K, 0.0), a)
    assert steps[-1].cycles == pytest.approx(N, rel=1e-4)  # discretisation of K over steps


def test_a_law_is_read_from_a_case_file(tmp_path):
    (tmp_path / "case.toml").write_text(
        '[units]\nlength = "mm"\nforce = "N"\n'
        '[mesh]\nkind = "box"\nlower = [0.0, -20.0]\nupper = [20.0, 20.0]\nn = [20, 40]\n'
        '[material]\nE = "210 GPa"\nnu = 0.3\nplane = "strain"\n'
        '[[cracks]]\nkind = "line"\npoints = [[0.0, 0.3], [6.0, 0.3]]\n'
        "[growth]\nda = 1.0\ncycle = { min = 0.0, max = 1.0 }\n"
        '[growth.law]\nkind = "exponential_law"\nC = "1 um"\nD = "20 MPa*sqrt(m)"\n'
    )
    law = xc.read_case(tmp_path / "case.toml").growth["law"]
    assert isinstance(law, exponential_law)
    assert (law.C, law.D) == pytest.approx((1e-3, 20 * 1000**0.5))


def test_a_power_that_overflows_is_refused():
    with pytest.raises(xc.ProblemError, match="too large for a number"):
        xc.paris(C=1.0, m=2.0)(np.array([1e200]), 0.0)
