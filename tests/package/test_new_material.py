"""A user's own materials, each one class, in every place."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import xcrack as xc


@dataclass(frozen=True)
class BulkAndShear(xc.Material):
    """Isotropic, by bulk and shear modulus."""

    bulk: float
    shear: float
    plane: str | None = None

    def stiffness(self):
        """Of the body in space."""
        C = np.diag(np.repeat([2 * self.shear, self.shear], 3))
        C[:3, :3] += self.bulk - 2 * self.shear / 3
        return C


@dataclass(frozen=True)
class Orthotropic(xc.Material):
    """Nine constants along the axes of the material, turned about z."""

    E: tuple[float, float, float]
    G: tuple[float, float, float]  # yz, xz, xy
    nu: tuple[float, float, float]  # yz, xz, xy
    angle: float = 0.0
    plane: str | None = None

    def stiffness(self):
        """Of the body in space."""
        S = np.diag([*(1 / np.array(self.E)), *(1 / np.array(self.G))])
        S[1, 2], S[0, 2], S[0, 1] = -self.nu[0] / self.E[1], *(-np.array(self.nu[1:]) / self.E[0])
        S[2, 1], S[2, 0], S[1, 0] = S[1, 2], S[0, 2], S[0, 1]
        c, s = np.cos(self.angle), np.sin(self.angle)
        turn = np.eye(6)  # of stresses, from the axes of the material
        turn[np.ix_([0, 1, 5], [0, 1, 5])] = [
            [c * c, s * s, -2 * c * s], [s * s, c * c, 2 * c * s], [c * s, -c * s, c * c - s * s],
        ]  # fmt: skip
        turn[np.ix_([3, 4], [3, 4])] = [[c, s], [-s, c]]
        return turn @ np.linalg.inv(S) @ turn.T


K, G = 175e3, 80.8e3
STEEL = BulkAndShear(K, G, "strain")
SAME = xc.Isotropic(9 * K * G / (3 * K + G), (3 * K - 2 * G) / (6 * K + 2 * G), "strain")
PLY = Orthotropic((140e3, 10e3, 8e3), (3e3, 5e3, 5e3), (0.4, 0.3, 0.3), angle=0.7)


def edge_crack(material):
    mesh = xc.box((0, -20), (20, 20), (20, 40))
    loads = [xc.traction("top", (0, 100.0)), xc.traction("bottom", (0, -100.0))]
    return xc.Problem(mesh, material, [xc.line_crack([(0, 0.3), (6, 0.3)])], loads=loads)


def clamped_strip(material, tip=12.0):
    """Half height 1, its sides moved apart by 2e-3; what its ends do fades out before the tip."""
    mesh = xc.box((0, -1), (24, 1), (120, 11))
    supports = [xc.displacement("top", (0, 1e-3)), xc.displacement("bottom", (0, -1e-3))]
    return xc.Problem(mesh, material, [xc.line_crack([(0, 0), (tip, 0)])], supports)


def pulled(material, stress, cracks=(), n=7, **choices):
    """A box under a uniform stress."""
    dim = len(stress)
    mesh, loads = xc.box((0.0,) * dim, (1.0,) * dim, n), []
    sides = {2: ("left right", "bottom top"), 3: ("left right", "front back", "bottom top")}
    for axis, pair in enumerate(sides[dim]):
        first, second = pair.split()
        loads += [xc.traction(first, -stress[axis]), xc.traction(second, stress[axis])]
    return xc.Problem(mesh, material, cracks, loads=loads, **choices)


def uniform_strain(material, stress):
    """From the compliance in space: stress is zero across plane stress, strain across strain."""
    S, d = np.linalg.inv(material.stiffness()), len(stress)
    rows = [0, 1, 5] if d == 2 else range(6)
    six = np.array([stress[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
                    if max(i, j) < d])  # fmt: skip
    if material.plane == "strain":
        S = S - np.outer(S[:, 2], S[2]) / S[2, 2]
    strain = S[np.ix_(rows, rows)] @ six
    if d == 2:
        return np.array([[strain[0], strain[2] / 2], [strain[2] / 2, strain[1]]])
    x, y, z, yz, xz, xy = strain
    return np.array([[x, xy / 2, xz / 2], [xy / 2, y, yz / 2], [xz / 2, yz / 2, z]])


def check_uniform(solution, stress, tolerance=1e-9):
    """Stress and stretch everywhere, to round-off or to the tolerance of iterations."""
    problem, d = solution.problem, len(stress)
    rng = np.random.default_rng(4409)
    x = rng.uniform(0.02, 0.98, (40, d))
    assert np.allclose(solution.stress(x), stress, rtol=0, atol=tolerance * np.abs(stress).max())
    strain = uniform_strain(problem.material, stress)
    u = solution.displacement(x)
    way, moved = x[1:] - x[:-1], u[1:] - u[:-1]
    stretch = np.einsum("qi,qi->q", way, moved)  # a rotation adds nothing to it
    expected = np.einsum("qi,ij,qj->q", way, strain, way)
    assert np.allclose(stretch, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("order", [1, 2])
def test_a_turned_ply_under_uniform_stress_in_2d(plane, order):
    material = replace(PLY, plane=plane)
    stress = np.array([[100.0, 20.0], [20.0, -30.0]])
    check_uniform(xc.solve(pulled(material, stress, order=order)), stress)


@pytest.mark.parametrize("order", [1, 2])
def test_a_turned_ply_under_uniform_stress_beside_an_unloaded_crack(order):
    """Cut cells and those with tip functions: the crack lies along the pull."""
    stress = np.array([[100.0, 0.0], [0.0, 0.0]])
    crack = xc.line_crack([(-0.1, 0.53), (0.47, 0.53)])
    problem = pulled(replace(PLY, plane="stress"), stress, [crack], n=11, order=order)
    check_uniform(xc.solve(problem), stress)


@pytest.mark.parametrize(("order", "n", "tolerance"), [(1, 5, 1e-9), (2, 5, 1e-9), (1, 12, 1e-7)])
def test_a_turned_ply_under_uniform_stress_in_3d(order, n, tolerance):
    """By factors, and on the finer mesh by iterations."""
    stress = np.array([[100.0, 20.0, 0], [20.0, -30.0, 0], [0, 0, 0]])
    crack = xc.penny_crack(center=(0.5, 0.5, 0.53), normal=(0, 0, 1), radius=0.3)
    problem = pulled(PLY, stress, [crack], n=n, order=order, contact="off")
    check_uniform(xc.solve(problem), stress, tolerance)


def test_a_closed_crack_hands_a_uniform_pressure_on():
    stress = np.array([[0.0, 0.0], [0.0, -100.0]])
    crack = xc.line_crack([(-0.1, 0.53), (0.47, 0.53)])
    solution = xc.solve(pulled(replace(PLY, plane="strain"), stress, [crack], n=11))
    check_uniform(solution, stress)
    assert np.allclose(solution.contact[0].pressure, 100.0, rtol=1e-7)  # round-off


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_heat_is_free_of_stress_where_nothing_holds(plane):
    material = replace(PLY, plane=plane)
    mesh = xc.box((0, 0), (1, 1), 5)
    heated = xc.Problem(mesh, material, loads=[xc.temperature(50.0, alpha=1e-5)])
    solution = xc.solve(heated)
    x = np.random.default_rng(811).uniform(0.02, 0.98, (30, 2))
    stiff = np.abs(material.stiffness()).max()
    assert np.abs(solution.stress(x)).max() < 1e-9 * stiff * 5e-4
    if plane == "stress":  # what is held across the plane changes the strain in it
        way = x[1:] - x[:-1]
        u = solution.displacement(x)
        assert np.allclose(np.einsum("qi,qi->q", way, u[1:] - u[:-1]),
                           5e-4 * (way**2).sum(axis=1), rtol=1e-9)  # fmt: skip


def test_stress_across_a_plane_strain_body():
    material = replace(PLY, plane="strain")
    S = np.linalg.inv(material.stiffness())
    stress = np.array([[100.0, 20.0], [20.0, -30.0]])
    expected = -(S[2, 0] * 100 + S[2, 1] * -30 + S[2, 5] * 20) / S[2, 2]
    assert material.stress_across(stress) == pytest.approx(expected, rel=1e-12)
    assert replace(PLY, plane="stress").stress_across(stress) == pytest.approx(0, abs=1e-12)
    stress = np.random.default_rng(6).normal(size=(4, 2, 2))
    stress += stress.transpose(0, 2, 1)
    for plane in ("strain", "stress"):
        given, same = replace(STEEL, plane=plane), replace(SAME, plane=plane)
        assert np.allclose(given.stress_across(stress), same.stress_across(stress), atol=1e-12)


def test_energy_that_a_crack_in_a_ply_releases():
    """A clamped strip gives back C_yyyy eps^2 2h for each length that its crack grows."""
    material = Orthotropic((140e3, 10e3, 8e3), (3e3, 5e3, 5e3), (0.4, 0.3, 0.3), plane="stress")
    short, long = (xc.solve(clamped_strip(material, tip)) for tip in (11.5, 12.5))
    nu = 0.3 * 10 / 140  # yx
    expected = 10e3 / (1 - 0.3 * nu) * 1e-6 * (12.5 - 11.5)
    # Of the discretisation: the two tips lie alike in their cells.
    assert short.energy - long.energy == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_K_of_a_clamped_strip(plane):
    """K² / E' is the energy ahead of the tip, (lam + 2 mu) eps² h (Rice, 1967)."""
    material = replace(STEEL, plane=plane)
    lam = K - 2 * G / 3
    lam = 2 * lam * G / (lam + 2 * G) if plane == "stress" else lam
    E_prime = 4 * G * (lam + G) / (lam + 2 * G)
    expected = np.sqrt(E_prime * (lam + 2 * G) * 1e-6)
    sif = xc.stress_intensity(xc.solve(clamped_strip(material), error=True))
    assert sif.K_I[0] == pytest.approx(expected, rel=1e-3)  # of the discretisation
    assert abs(sif.best[0, 0] - expected) <= sif.bar[0, 0] + 1e-5 * expected  # of the ends
    released = xc.energy_release_rate(sif, material)[0]
    assert released == pytest.approx((lam + 2 * G) * 1e-6, rel=2e-3)


def test_K_where_only_the_plane_is_isotropic():
    """Stiffer across the plane than in it, as a laminate is along its normal."""
    E, nu, plane = 50e3, 0.2, "strain"
    material = Orthotropic(
        (E, E, 9e4), (2e4, 2e4, E / (2 * (1 + nu))), (0.15, 0.15, nu), 0.4, plane
    )
    S = np.linalg.inv(material.stiffness())
    in_plane = S[0, 0] - S[0, 2] ** 2 / S[2, 2]  # 1 / E'
    C = material.stiffness()[1, 1]
    sif = xc.stress_intensity(xc.solve(clamped_strip(material)))
    assert sif.K_I[0] == pytest.approx(np.sqrt(C * 1e-6 / in_plane), rel=2e-3)


@pytest.mark.parametrize(("nu", "plane"), [(0.7, "stress"), (-0.7, "strain"), (0.2, "stress")])
def test_tips_of_a_plane_that_no_isotropic_body_has(nu, plane):
    """Honeycombs and the like: the plane is isotropic, its contraction beyond 1/2."""
    E = 50e3
    material = Orthotropic((E, E, 9e4), (2e4, 2e4, E / (2 * (1 + nu))), (0.1, 0.1, nu), 0.4, plane)
    tip_material = material.at_tip()
    scale = np.abs(material.tensor(2)).max()
    assert np.allclose(tip_material.tensor(2), material.tensor(2), rtol=0, atol=1e-12 * scale)


@pytest.mark.filterwarnings("ignore:K along the front:xcrack.XcrackWarning")  # of a coarse mesh
def test_two_ways_to_give_one_material_agree():
    """Displacements, K, bars and T in 2D."""
    solutions = [xc.solve(edge_crack(m), error=True) for m in (STEEL, SAME)]
    sif, same = (xc.stress_intensity(each) for each in solutions)
    scale = np.abs(solutions[1].u).max()
    assert np.allclose(solutions[0].u, solutions[1].u, rtol=0, atol=1e-10 * scale)
    assert np.allclose(sif.K, same.K, rtol=0, atol=1e-9 * np.abs(same.K).max())
    assert np.allclose(sif.T, same.T, rtol=1e-8)
    assert np.allclose(sif.bar, same.bar, rtol=1e-6)


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")  # a coarse mesh
def test_two_ways_to_give_one_material_agree_along_a_front():
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 4)
    crack = xc.penny_crack(center=(0, 0, 0.04), normal=(0, 0, 1), radius=0.5)
    loads = [xc.traction("top", (0.2, 0, 1.0)), xc.traction("bottom", (-0.2, 0, -1.0))]
    scenes = [xc.Problem(mesh, replace(m, plane=None), [crack], [xc.fix("bottom")], loads)
              for m in (STEEL, SAME)]  # fmt: skip
    both = [xc.stress_intensity(xc.solve(scene)).K for scene in scenes]
    assert np.allclose(*both, rtol=0, atol=1e-9 * np.abs(both[1]).max())


LAW, CYCLE = xc.paris(1e-13, 3.0), xc.Cycle(0.0, 1.0)


def grown(material, steps, path=None):
    run = xc.grow(edge_crack(material), LAW, xc.max_hoop_stress, CYCLE, da=1.0, max_steps=steps,
                  progress=False)  # fmt: skip
    return xc.collect(run, path=path)


def test_growth_stops_and_goes_on_to_the_same_bits(tmp_path):
    whole, same = grown(STEEL, 3, tmp_path / "whole"), grown(SAME, 3)
    cycles = [step.cycles for step in whole.steps]
    assert cycles == pytest.approx([step.cycles for step in same.steps], rel=1e-8)
    for line in sorted((tmp_path / "whole").glob("step_*"))[-1:]:
        line.unlink()
    again = xc.resume(tmp_path / "whole", edge_crack(STEEL), LAW, xc.max_hoop_stress, CYCLE,
                      da=1.0, max_steps=3, progress=False)  # fmt: skip
    assert [step.cycles for step in again.steps] == cycles
    with pytest.raises(xc.ProblemError, match="bulk"):
        xc.resume(tmp_path / "whole", edge_crack(replace(STEEL, bulk=2e5)), LAW,
                  xc.max_hoop_stress, CYCLE, da=1.0, max_steps=4, progress=False)  # fmt: skip


@pytest.mark.slow
@pytest.mark.mission
def test_a_material_is_in_files_reports_and_pictures(tmp_path):
    solution = xc.solve(edge_crack(STEEL))
    saved = xc.load(xc.save(solution, tmp_path / "solution"))
    assert saved.problem.material == STEEL
    assert isinstance(saved.problem.material, BulkAndShear)
    x = np.array([[3.3, 1.7], [15.1, -4.0]])
    assert np.array_equal(saved.stress(x), solution.stress(x))
    grown(STEEL, 2, tmp_path / "run")
    reports = [xc.report(source, tmp_path / "report.html").read_text(encoding="utf-8")
               for source in (solution, tmp_path / "run")]  # fmt: skip
    assert "bulk = 175000, shear = 80800" in reports[0]
    assert "problem.material.bulk" in reports[1]
    xc.plot(saved, "von_mises", file=tmp_path / "picture.png", show=False)
    assert (tmp_path / "picture.png").stat().st_size > 1000
    assert xc.write(saved, tmp_path / "fields.vtu")


CASE = """
[mesh]
kind = "box"
lower = [0.0, -20.0]
upper = [20.0, 20.0]
n = [20, 40]
[material]
{material}
plane = "strain"
[[cracks]]
kind = "line"
points = [[0.0, 0.3], [6.0, 0.3]]
"""


def test_a_material_is_read_from_a_case_file(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE.format(material='kind = "BulkAndShear"\nbulk = 175e3\nshear = 80.8e3'))
    assert xc.read_case(case).problem.material == STEEL
    case.write_text(CASE.format(material='kind = "Isotropic"\nE = 210e3\nnu = 0.3'))
    assert xc.read_case(case).problem.material == xc.Isotropic(210e3, 0.3, "strain")
    case.write_text(CASE.format(material='kind = "butter"'))
    with pytest.raises(xc.ProblemError, match="'butter' is not known: known are Isotropic"):
        xc.read_case(case)


def test_K_is_refused_where_tips_are_not_isotropic_and_the_rest_is_not(tmp_path):
    problem = edge_crack(replace(PLY, plane="stress"))
    solution = xc.solve(problem, error=True)
    assert solution.opening().max() > 0
    xc.plot(solution, "von_mises", file=tmp_path / "picture.png", show=False)
    answers = [
        lambda: xc.stress_intensity(solution),
        lambda: next(xc.grow(problem, LAW, xc.max_hoop_stress, CYCLE, da=1.0, progress=False)),
        lambda: xc.adapt(problem, 0.01),
        lambda: xc.energy_release_rate(sif, problem.material),
    ]
    sif = xc.stress_intensity(xc.solve(edge_crack(STEEL)))
    for answer in answers:
        with pytest.raises(xc.ProblemError, match="Orthotropic is not isotropic: K, its error"):
            answer()


def test_materials_that_are_none_are_refused():
    @dataclass(frozen=True)
    class Given(xc.Material):
        C: tuple
        plane: str | None = None

        def stiffness(self):
            return self.C

    @dataclass(frozen=True)
    class Nothing(xc.Material):
        plane: str | None = None

    def given(C, plane=None):
        return Given(tuple(map(tuple, np.asarray(C).tolist())), plane)

    good = STEEL.stiffness()
    skew, loose, twisted = good.copy(), good.copy(), good.copy()
    skew[0, 1] *= 1.1
    loose[5, 5] = 0.0
    twisted[0, 4] = twisted[4, 0] = 1e4
    for material, text in (
        (given(good[:3], "strain"), r"Given: stiffness\(\) has the shape \(3, 6\)"),
        (given(skew, "strain"), "not symmetric"),
        (given(loose, "strain"), "the eigenvalue 0: all must be above 0"),
        (given(twisted, "strain"), "shears a plane body out of its plane"),
        (given(np.where(good, good, np.nan), "strain"), "finite"),
        (Nothing("strain"), r"Nothing has no stiffness: give it a method stiffness\(\)"),
        (given(good), r'a 2D body needs Given\(..., plane="strain"\)'),
        (given(good, "stain"), 'Given: plane = \'stain\': give "strain" or "stress"'),
        (Given(good, "strain"), "its fields cannot be compared"),
    ):
        with pytest.raises(xc.ProblemError, match=text):
            xc.Problem(xc.box((0, 0), (1, 1), 2), material)
    with pytest.raises(xc.ProblemError, match=r'Given\(plane="stress"\) is for 2D bodies'):
        xc.Problem(xc.box((0, 0, 0), (1, 1, 1), 2), given(good, "stress"))
    in_space = given(twisted)
    assert xc.Problem(xc.box((0, 0, 0), (1, 1, 1), 2), in_space).material is in_space
