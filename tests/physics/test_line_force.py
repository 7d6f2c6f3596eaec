"""Forces along edges against reciprocity, statics, a beam, and in every place that reads a load."""

import numpy as np
import pytest

import xcrack as xc

ROD = xc.Isotropic(210e3, 0.3)
PLATE = xc.Isotropic(210e3, 0.3, plane="stress")


def resultant(problem, name):
    rows = xc.solve(problem).report.resultants
    return next(row for row in rows if row.name == name)


@pytest.mark.parametrize("order", [1, 2])
def test_force_and_moment_of_a_force_that_varies_along_an_edge(order):
    """f = (x, x², 3 - x) along x in (0, 2) at y = 1, z = 4: integrals by hand, to round-off."""
    body = xc.box((0, 0, 0), (2, 1, 4), (5, 3, 6))
    load = xc.line_force("top", "back", lambda x: np.c_[x[:, 0], x[:, 0] ** 2, 3 - x[:, 0]])
    row = resultant(
        xc.Problem(body, ROD, supports=[xc.fix("bottom")], loads=[load], order=order), load.name
    )
    assert row.force == pytest.approx((2.0, 8 / 3, 4.0), rel=1e-12)
    # y fz - z fy, z fx - x fz, x fy - y fx
    turning = (4 - 4 * 8 / 3, 4 * 2 - (6 - 8 / 3), 4 - 2)
    assert row.moment == pytest.approx(turning, rel=1e-12)


def test_reciprocity_with_a_traction():
    """Betti: a line force works on the displacements of a traction as the traction on its own."""
    body = xc.box((0, 0, 0), (1, 1, 2), (3, 4, 5))
    bottom = [xc.fix("bottom")]
    line = xc.line_force("top", "right", (0.3, -0.2, 1.0))
    pull = xc.traction("right", (1.0, 0.4, 0.7))
    by_line, by_pull = (
        xc.solve(xc.Problem(body, ROD, supports=bottom, loads=[load], order=1))
        for load in (line, pull)
    )
    y = np.linspace(0, 1, 5)
    u = by_pull.displacement(np.c_[np.full(5, 1 - 1e-12), y, np.full(5, 2 - 1e-12)])
    work = np.trapezoid(u @ [0.3, -0.2, 1.0], y)  # exact: displacements are linear between points
    facets = body.facet_sets["right"]
    corner = body.points[facets]
    area = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    ) / 2  # fmt: skip
    u = by_line.displacement(corner.mean(axis=1) - (1e-12, 0, 0))
    assert area @ (u @ [1.0, 0.4, 0.7]) == pytest.approx(work, rel=1e-7)  # of the evaluation


def test_deflection_of_a_cantilever():
    """Timoshenko: P L³ / 3 E I + P L / k G A, k = 5 / 6."""
    L, h, P = 10.0, 1.0, 2.0
    deflection = P * L**3 / (3 * 210e3 * h**3 / 12) + P * L / (5 / 6 * 210e3 / 2.6 * h)
    solid = xc.box((0, 0, 0), (L, 1, h), (20, 2, 2))
    load = xc.line_force("right", "top", (0, 0, -P))
    scene = xc.Problem(solid, ROD, supports=[xc.fix("left")], loads=[load], order=2)
    u = xc.solve(scene).displacement([[L - 0.5, 0.5, h / 2], [L - 1.5, 0.5, h / 2]])
    tip = u[0, 2] + 0.5 * (u[0, 2] - u[1, 2])  # straight where no moment acts
    assert -tip == pytest.approx(deflection, rel=0.02)  # of the clamped end and the mesh
    plane = xc.box((0, 0), (L, h), (40, 4))
    load = xc.line_force("right", "top", (0, -P))
    scene = xc.Problem(plane, PLATE, supports=[xc.fix("left")], loads=[load], order=2)
    u = xc.solve(scene).displacement([[L - 0.5, h / 2], [L - 1.5, h / 2]])
    assert -u[0, 1] - 0.5 * (u[0, 1] - u[1, 1]) == pytest.approx(deflection, rel=0.01)


def cracked(load):
    body = xc.box((0, -20), (20, 20), (20, 40))
    steel = xc.Isotropic(210e3, 0.3, plane="strain")
    crack = xc.line_crack([(0, 0.3), (6, 0.3)])
    return xc.Problem(body, steel, [crack], [xc.fix("bottom")], [load])


def test_K_and_bars_are_those_of_the_force_at_that_point():
    lines = [xc.line_force("top", "left", (-10.0, 300.0)), xc.point_force((0, 20), (-10.0, 300.0))]
    answers = [xc.stress_intensity(xc.solve(cracked(load), error=True)) for load in lines]
    assert np.allclose(answers[0].K, answers[1].K, rtol=1e-12)
    assert np.allclose(answers[0].bar, answers[1].bar, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.mission
def test_folders_reports_pictures_and_case_files(tmp_path):
    load = xc.line_force("top", "left", (-10.0, 300.0))
    problem = cracked(load)
    steps = xc.grow(problem, xc.paris(1e-13, 3.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), da=1.0,
                    max_steps=2, progress=False)  # fmt: skip
    xc.collect(steps, path=tmp_path / "run")
    page = xc.report(tmp_path / "run", tmp_path / "report.html").read_text(encoding="utf-8")
    assert "line_force" in page
    saved = xc.load(xc.save(xc.solve(problem), tmp_path / "solution"))
    assert saved.problem.loads[0].beside == "left"
    assert np.array_equal(saved.problem.loads[0].f, load.f)
    xc.plot(saved, "von_mises", file=tmp_path / "picture.png", show=False)
    (tmp_path / "case.toml").write_text(
        '[units]\nlength = "mm"\nforce = "N"\n'
        '[mesh]\nkind = "box"\nlower = [0.0, -20.0]\nupper = [20.0, 20.0]\nn = [20, 40]\n'
        '[material]\nE = "210 GPa"\nnu = 0.3\nplane = "strain"\n'
        '[[supports]]\nkind = "fix"\nwhere = "bottom"\n'
        '[[loads]]\nkind = "line_force"\nwhere = "top"\nbeside = "left"\n'
        'f = ["-1 kN/m", "3 N/mm"]\n'
    )
    load = xc.read_case(tmp_path / "case.toml").problem.loads[0]
    assert np.asarray(load.f) == pytest.approx([-1.0, 3.0])


def test_sets_without_a_common_edge_are_refused():
    text = r"line_force\('top', 'bottom'\): the sets .* have no edge in common: name two"
    with pytest.raises(xc.ProblemError, match=text):
        cracked(xc.line_force("top", "bottom", (0.0, 1.0)))
    with pytest.raises(xc.ProblemError, match="no facet set 'roof'"):
        cracked(xc.line_force("top", "roof", (0.0, 1.0)))
    with pytest.raises(xc.ProblemError, match="2 dimensions"):
        cracked(xc.line_force("top", "left", (0.0, 1.0, 0.0)))
    with pytest.raises(xc.ProblemError, match="line_force: where = 3"):
        xc.line_force(3, "left", (0.0, 1.0))
