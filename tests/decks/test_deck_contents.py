"""What a deck may hold: parts and instances, steps, amplitudes, couplings, and the table of it."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.decks import ARCHIVE, STEEL, box_cases, box_deck, deck_text, simplices

ASSEMBLY = Path(__file__).parents[1] / "data" / "assembly.inp"
pytestmark = pytest.mark.filterwarnings("ignore:.*are (divided|left out)")


def written(folder: Path, text: str) -> Path:
    path = folder / "deck.inp"
    path.write_text(text)
    return path


def plain(folder: Path, conditions: str, dim: int = 2, order: int = 1) -> Path:
    """A deck of a small box with a material, and conditions of its own."""
    mesh = xc.box((0,) * dim, (2.0, 1.0, 1.0)[:dim], 1)
    return written(folder, box_deck(mesh, order, conditions))


def test_parts_stand_where_their_instances_do():
    """Two blocks of one part, the second one shifted and turned by half a turn about z."""
    deck = xc.read_deck(ASSEMBLY)
    mesh = deck.mesh
    assert mesh.volume.sum() == pytest.approx(2.0)
    middle = {name: mesh.points[np.unique(f)].mean(axis=0) for name, f in mesh.facet_sets.items()}
    np.testing.assert_allclose(middle["Block-1.Face"], (0.0, 0.5, 0.5), atol=1e-12)
    np.testing.assert_allclose(middle["Block-2.Face"], (3.0, 0.5, 0.5), atol=1e-12)
    np.testing.assert_allclose(middle["End"], (2.0, 0.5, 0.5), atol=1e-12)
    np.testing.assert_allclose(middle["Top"], (0.5, 0.5, 1.0), atol=1e-12)
    assert len(mesh.facet_sets["Low"]) == 4  # of both blocks
    np.testing.assert_allclose(deck.points["Corner"], [(2.0, 0.0, 1.0)], atol=1e-12)


def test_steps_carry_over_what_earlier_ones_left():
    first, half = xc.read_deck(ASSEMBLY, 1), xc.read_deck(ASSEMBLY, "pull", time=0.25)
    last = xc.read_deck(ASSEMBLY)
    assert (first.step, last.step, last.steps) == ("Pull", "More", ("Pull", "More"))
    spread, pressed = first.loads
    np.testing.assert_allclose(spread.force, (100.0, 0.0, 0.0))
    np.testing.assert_allclose(spread.moment, (0.0, 0.0, 20.0))
    np.testing.assert_allclose(spread.about, (10.0, 0.5, 0.5))
    # the amplitude rises to 2 at half of the step and ends at 1.5
    assert pressed.p == pytest.approx(4.0 * 1.5)
    assert half.loads[1].p == pytest.approx(4.0 * 1.0)
    np.testing.assert_allclose(first.amplitudes["Twice"], [(0, 0), (0.5, 2), (1, 1.5)])
    # OP=NEW takes the forces of the first step away, and not its pressure
    forced, pressed = last.loads
    np.testing.assert_allclose(forced.x, [(1.0, 1.0, 1.0)])
    np.testing.assert_allclose(forced.f, [(-8.0, 0.0, 0.0)])
    assert pressed.p == pytest.approx(6.0)
    assert [support.name for support in first.supports] == ["fix('Low')"]
    assert last.supports[1].value == (None, None, 0.01)


def test_every_keyword_has_a_row():
    deck = xc.read_deck(ASSEMBLY, 1)
    keywords = {line.split(",")[0].strip().upper() for line in ASSEMBLY.read_text().splitlines()
                if line.startswith("*") and not line.startswith("**")}  # fmt: skip
    rows = {use.keyword.split(",")[0] for use in deck.keywords}
    assert keywords == rows
    used = {use.keyword.split(",")[0] for use in deck.keywords if use.is_used}
    assert {"*BOUNDARY", "*CLOAD", "*PLASTIC", "*AMPLITUDE", "*COUPLING"} <= used
    assert all(use.reason and "line" in use.place for use in deck.keywords)
    reasons = {use.keyword: use.reason for use in deck.ignored}
    assert reasons["*STEP, NLGEOM"] == "displacements are taken to be small"
    assert "another program" in reasons["*OUTPUT"]
    text = str(deck)
    assert all(use.keyword in text and use.reason in text for use in deck.keywords)
    assert deck.material.yield_stress == 355.0


def test_what_may_matter_is_warned_of(tmp_path):
    path = plain(
        tmp_path, "*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n*NEW THING\n*CREEP\n1., 2., 0.\n"
    )
    with pytest.warns(xc.XcrackWarning, match=r"ignored: \*NEW THING, \*CREEP; print\(deck\)"):
        deck = xc.read_deck(path)
    reasons = {use.keyword: use.reason for use in deck.ignored}
    assert reasons["*NEW THING"] == "it is not known here"


def test_from_a_deck_to_K(tmp_path):
    """The problem of the deck with a crack in it is that of a script."""
    mesh = xc.box((0.0, 0.0), (2.0, 4.0), (20, 40))
    path = written(
        tmp_path,
        box_deck(mesh, 1, "*BOUNDARY\nFRONT, 2\n1, 1\n*STEP\n*STATIC\n*DSLOAD\nSBACK, P, -100.\n"),
    )
    deck = xc.read_deck(path)
    problem = deck.problem(cracks=[xc.line_crack([(0.0, 2.04), (0.73, 2.06)])])
    K = xc.stress_intensity(xc.solve(problem)).K_I
    script = xc.Problem(
        mesh, xc.Isotropic(2.1e5, 0.3, "strain"), problem.cracks,
        supports=[xc.fix("bottom", 1), xc.fix((0.0, 0.0), 0)], loads=[xc.pressure("top", -100.0)],
    )  # fmt: skip
    np.testing.assert_allclose(K, xc.stress_intensity(xc.solve(script)).K_I, rtol=1e-8)


def test_loads_of_every_kind(tmp_path):
    """Their resultants on a block of 2 by 1 by 1, by hand."""
    path = plain(
        tmp_path,
        "*BOUNDARY\nLEFT, 1, 3\n*STEP\n*STATIC\n*DLOAD\n, BX, 3.\nEALL, GRAV, 2., 0., 0., -4.\n"
        "EALL, CENTRIF, 25., 0., 0., 0., 0., 0., 1.\n"
        "*DSLOAD\nSRIGHT, TRVEC, 5., 3., 4., 0.\nSUP, HP, 10., 1., 0.\nSBACK, HP, 10., 1., 0.\n",
        dim=3,
    )
    deck = xc.read_deck(path)
    pulled, block = deck.loads, deck.mesh
    moment = [load.volume(np.array([(1.0, 0.5, 0.5)])) for load in pulled[:3]]
    np.testing.assert_allclose(moment[0], [(3.0, 0.0, 0.0)])
    np.testing.assert_allclose(moment[1], [(0.0, 0.0, -2 * 7.8e-9)])
    np.testing.assert_allclose(moment[2], [(25 * 7.8e-9, 12.5 * 7.8e-9, 0.0)])
    np.testing.assert_allclose(pulled[3].value, (3.0, 4.0, 0.0))
    np.testing.assert_allclose(pulled[5].p(np.array([(0.0, 1.0, 0.25), (0.0, 1.0, 1.0)])), (7.5, 0))
    assert xc.solve(deck.problem()).u.shape[0] > 3 * block.n_points


def test_a_body_of_two_dimensions_has_a_thickness(tmp_path):
    mesh = xc.box((0.0, 0.0), (2.0, 1.0), 1)
    text = box_deck(mesh, 1, "*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n*CLOAD\nRIGHT, 2, 12.\n")
    deck = xc.read_deck(
        written(tmp_path, text.replace("MATERIAL=STEEL\n1.\n", "MATERIAL=STEEL\n4.\n"))
    )
    assert deck.thickness == 4.0
    np.testing.assert_allclose(deck.loads[0].f, [(0.0, 3.0)] * 2)


def test_temperatures_and_expansion(tmp_path):
    """Secant coefficients from ZERO: strain = a(T)(T - ZERO) - a(T0)(T0 - ZERO)."""
    conditions = (
        "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 50.\n*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n"
        "*TEMPERATURE\nNALL, 220.\n"
    )
    text = plain(tmp_path, conditions).read_text()
    deck = xc.read_deck(written(tmp_path, text.replace("\n1.2E-5\n", "\n1E-5, 0.\n2E-5, 400.\n")))
    (change,) = deck.loads
    strain = 1.55e-5 * 200 - 1.125e-5 * 30
    assert change.field * change.alpha == pytest.approx(strain)
    hot = text.replace("2.1E5, 0.3\n", "2.1E5, 0.3, 0.\n1.7E5, 0.3, 400.\n")
    assert xc.read_deck(written(tmp_path, hot)).material.E == pytest.approx(2.1e5 - 0.4e5 * 0.55)


def test_stress_of_the_undeformed_body(tmp_path):
    conditions = (
        "*INITIAL CONDITIONS, TYPE=STRESS\nEALL, 1., 2., 3., 0.5\n1, 9., 2., 3., 0.5\n"
        "*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n"
    )
    (stress,) = xc.read_deck(plain(tmp_path, conditions)).loads
    mesh = xc.box((0.0, 0.0), (2.0, 1.0), 1)
    x = mesh.points[mesh.cells].mean(axis=1)
    np.testing.assert_allclose(stress.f(x), [[(9, 0.5), (0.5, 2)], [(1, 0.5), (0.5, 2)]])


def test_a_reference_node_that_is_fixed_holds_its_surface(tmp_path):
    more = "*NODE\n999, 9., 9., 9.\n*COUPLING, REF NODE=999, SURFACE=SLEFT\n*KINEMATIC\n"
    fixed = more + "*BOUNDARY\n999, ENCASTRE\n*STEP\n*STATIC\n*DSLOAD\nSRIGHT, P, -1.\n"
    deck = xc.read_deck(plain(tmp_path, fixed, dim=3))
    assert [support.name for support in deck.supports] == ["fix('SLEFT')"]
    turned = fixed.replace("999, ENCASTRE", "999, 1, 3")
    with pytest.raises(xc.ProblemError, match=r"line \d+: \*COUPLING: .*all directions and turns"):
        xc.read_deck(plain(tmp_path, turned, dim=3))


SCENE = "*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n*DSLOAD\nSRIGHT, P, -1.\n"
REFUSED = {
    "*TIE, NAME=T\nSLEFT, SRIGHT\n": r"line \d+: \*TIE: bonded.*common nodes.*ignore=\[.TIE.\]",
    "*CONTACT PAIR\nSLEFT, SRIGHT\n": r"\*CONTACT PAIR: contact between parts",
    "*EQUATION\n2\n1, 1, 1., 2, 1, -1.\n": r"\*EQUATION: constraints between nodes",
    "*TRANSFORM, NSET=NALL\n1., 0., 0., 0., 1., 0.\n": r"\*TRANSFORM: .*global axes",
    "*MATERIAL, NAME=O\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1., 1.\n": r"only isotropic ones",
    "*NGEN\n1, 5\n": r"\*NGEN: it makes nodes.*flat input",
    "*BOUNDARY\nLEFT, 1, 1, 0.5\n1, 1, 1, 0.4\n": r"direction 1 of 1 is given 0.4 here and another",
    "*CLOAD\nLEFT, 6, 3.\n": r"take no moments.*DISTRIBUTING",
    "*CLOAD\nLEFT, 7, 3.\n": r"direction 7 is none: give one of 1 to 6",
    "*BOUNDARY\nLEFT, 11, 11, 3.\n": r"directions 11 to 11: 1 to 3 are displacements",
    "*DLOAD\nEALL, P1NU, 3.\n": r"there is no load P1NU: give GRAV",
    "*DLOAD\nEALL, P3, 3.\n": r"P acts on faces inside the body",
    "*DSLOAD\nSGONE, P, 3.\n": r"no surface 'SGONE' of element faces; it has SLEFT",
    "*STEP\n*FREQUENCY\n5\n*END STEP\n": r"step 'Step-1' is no static one",
    "*CLOAD, AMPLITUDE=GONE\n2, 1, 3.\n": r"AMPLITUDE=GONE: there is none",
    "*BOUNDARY, SUBMODEL\nLEFT, 1\n": r"SUBMODEL: values of another run",
    "*TEMPERATURE, FILE=a.odb\n": r"FILE: values of a results file",
    "*NODE\n77, 9., 9.\n*CLOAD\n77, 1, 3.\n": r"no node of the body: couple it",
    "*ELEMENT, TYPE=SPRINGA, ELSET=S\n99, 1, 2\n": r"TYPE=SPRINGA: springs and connectors",
}


@pytest.mark.parametrize("more", REFUSED)
def test_what_would_be_another_problem_is_refused(more, tmp_path):
    scene = SCENE.replace("*STEP\n*STATIC\n", f"*STEP\n*STATIC\n{more}")
    if more.startswith(("*STEP", "*MATERIAL", "*NODE")):
        head, forces, tail = more.partition("*CLOAD")
        scene = head + SCENE.replace("*STATIC\n", f"*STATIC\n{forces}{tail}")
    if more.startswith("*STEP"):
        scene = "*BOUNDARY\nLEFT, 1, 2\n" + more
    path = plain(tmp_path, scene)
    with pytest.raises(xc.XcrackError, match=REFUSED[more]) as caught:
        xc.read_deck(path)
    assert "deck.inp" in str(caught.value)


def test_what_is_left_out_knowingly_stands_in_the_table(tmp_path):
    path = plain(tmp_path, SCENE.replace("*STEP", "*TIE, NAME=T\nSLEFT, SRIGHT\n*STEP"))
    with pytest.warns(xc.XcrackWarning, match=r"ignored: \*TIE"):
        deck = xc.read_deck(path, ignore=["tie"])
    assert [use.reason for use in deck.ignored if use.keyword == "*TIE"] == [
        "it was left out by ignore="
    ]


def test_other_programs_give_mesh_and_table(tmp_path):
    (tmp_path / "part.bdf").write_text(
        "SOL 101\nCEND\nBEGIN BULK\n$ one tetrahedron with a plate on its side\n"
        + "".join(f"GRID    {n:8d}        {x:8.1f}{y:8.1f}{z:8.1f}\n"
                  for n, (x, y, z) in enumerate([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 1))
        + "CTETRA         1       7       1       2       3       4\n"
        "CTRIA3         2       9       1       2       3\n"
        "MAT1           1  210000             0.3\nPLOAD4         1       1    10.0\nENDDATA\n"
    )  # fmt: skip
    with pytest.warns(xc.XcrackWarning, match=r"ignored: MAT1, PLOAD4"):
        deck = xc.read_deck(tmp_path / "part.bdf")
    assert deck.mesh.volume.sum() == pytest.approx(1 / 6)
    assert set(deck.mesh.facet_sets) == {"facets_9", "boundary"}
    assert {use.keyword for use in deck.keywords if use.is_used} == {"GRID", "CTETRA", "CTRIA3"}
    with pytest.raises(xc.ProblemError, match=r"has no material.*problem\(material="):
        deck.problem()
    assert deck.problem(material=xc.Isotropic(1.0, 0.3)).mesh is deck.mesh


def test_an_archive_of_ansys(tmp_path):
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    corners += [(x, y, 2) for x, y, _ in corners]
    nodes = "".join(
        f"{n:9d}{0:9d}{0:9d}{x:21.13E}{y:21.13E}{z:21.13E}\n"
        for n, (x, y, z) in enumerate(corners, 1)
    )
    text = ARCHIVE.format(nodes=nodes)
    path = tmp_path / "part.cdb"
    path.write_text(text)
    with pytest.warns(xc.XcrackWarning, match=r"ignored: MPTEMP, F;"):
        deck = xc.read_deck(path)
    mesh = deck.mesh
    assert mesh.volume.sum() == pytest.approx(2.0)
    assert (mesh.points[mesh.facet_sets["TOP"]][..., 2] == 2).all()
    assert len(mesh.facet_sets["TOP"]) == 2
    assert len(mesh.cell_sets["WHOLE"]) == len(mesh.cells)
    for wrong, says in [
        (text.replace("       -1\nCMBLOCK,TOP", "CMBLOCK,TOP"), r"line \d+: .*no whole number"),
        (text.replace("EBLOCK,19,SOLID", "EBLOCK,19"), "CDWRITE"),
        (text.replace("        7        8\n", "        7       88\n"), "node 88, which the file"),
        (text[: text.index("N,R5")], "no end, the file is cut off"),
    ]:
        path.write_text(wrong)
        with pytest.raises(xc.MeshError, match=says):
            xc.read_deck(path)


def test_damaged_decks_end_in_words(tmp_path):
    """Lines lost, doubled, exchanged and cut: a deck or an error of ours, nothing else."""
    rng = np.random.default_rng(20731)
    texts = [ASSEMBLY.read_text(), box_cases(2, 2)["CPE6_thermal"], box_cases(2, 1)["CPE3_moved"]]
    words = ["", "nan", "1e400", "-1", "abc", "*", ",,,", "99999999999", "*STEP", "*PART, NAME=x",
             "*INCLUDE, INPUT=deck.inp", "*NSET, NSET=", "*ELEMENT, TYPE=C3D4"]  # fmt: skip
    refused = 0
    for _ in range(60):
        lines = texts[rng.integers(len(texts))].split("\n")
        starred = [k for k, line in enumerate(lines) if line.startswith("*")]
        for _ in range(rng.integers(1, 4)):
            k = min(starred[rng.integers(len(starred))] + rng.integers(2), len(lines) - 1)
            word = words[rng.integers(len(words))]
            entries = lines[k].split(",")
            entries[rng.integers(len(entries))] = word
            replacement = [[], [word, lines[k]], [",".join(entries)], [lines[k][: rng.integers(9)]]]
            lines[k : k + 1] = replacement[rng.integers(4)]
        path = written(tmp_path, "\n".join(lines))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)
            try:
                xc.read_deck(path).problem()
            except xc.XcrackError:
                refused += 1
    assert 10 < refused < 60


def test_a_crack_in_a_deck_of_second_order(tmp_path):
    """Points in the plane of symmetry, held across it, carry nothing where a crack opens beside."""
    mesh = xc.box((0.0, 0.0), (2.0, 4.0), (10, 21))
    x, cells = simplices(mesh, 2)
    conditions = "*BOUNDARY\nFRONT, 2\n1, 1\n*STEP\n*STATIC\n*DSLOAD\nSBACK, P, -1.\n"
    text = deck_text(x, cells, "CPE6", STEEL.format(thickness="1.\n") + conditions)
    deck = xc.read_deck(written(tmp_path, text))
    crack = xc.line_crack([(0.0, 2.0), (0.8, 2.0)])
    sif = xc.stress_intensity(xc.solve(deck.problem([crack])))
    assert sif.K_I[0] > 0


def test_two_materials_that_expand_and_soften(tmp_path):
    """Each with its own table; E(T) is graded where the temperature is not one."""
    conditions = (
        "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20.\n*BOUNDARY\nLEFT, 1, 2\n*STEP\n*STATIC\n"
        "*TEMPERATURE\nNALL, 120.\nLEFT, 20.\n"
    )
    text = plain(tmp_path, conditions).read_text()
    start = text.index("*SOLID SECTION")
    two = (
        "*ELSET, ELSET=HALF\n1,\n*ELSET, ELSET=REST\n2,\n"
        "*SOLID SECTION, ELSET=HALF, MATERIAL=STEEL\n1.\n"
        "*SOLID SECTION, ELSET=REST, MATERIAL=BRASS\n1.\n"
        "*MATERIAL, NAME=BRASS\n*ELASTIC\n1.1E5, 0.34, 20.\n1.0E5, 0.36, 120.\n"
        "*EXPANSION, ZERO=20.\n1.8E-5, 20.\n2.0E-5, 120.\n"
    )
    lines = text[start:].split("\n")
    with pytest.warns(xc.XcrackWarning, match="Poisson's ratio of .MATERIAL 'BRASS'"):
        deck = xc.read_deck(written(tmp_path, text[:start] + two + "\n".join(lines[2:])))
    materials = deck.problem().material
    assert materials["STEEL"].alpha == pytest.approx(1.2e-5)
    x = np.array([(1.0, 0.5), (2.0, 0.5)])
    T = deck.loads[0].field(x) + 20.0
    assert materials["BRASS"].moduli(x) == pytest.approx(1.1e5 - 100 * (T - 20.0))
    alpha = materials["BRASS"].expansion(x)
    assert alpha[T > 21] == pytest.approx(1.8e-5 + 2e-8 * (T[T > 21] - 20.0), rel=1e-6)
    assert np.isfinite(xc.solve(deck.problem()).energy)
