"""What a case file can say: every public maker of a scene, with the value that Python makes of it.

`samples.toml` has each of them as a file says it, and below stands the same in Python; the makers
are found by the classes and tables themselves, so that a new one without a sample fails here.
"""

import inspect
import tomllib
import warnings
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import xcrack as xc
from support.case_texts import STRIP, STRIP_GROWTH, STRIP_PULL
from xcrack import Closure, GrowthLaw, Load, Material, Threshold
from xcrack.app import case, case_histories, case_values
from xcrack.app.case_tables import Source, Table
from xcrack.base.arguments import arguments_of
from xcrack.base.description import describe
from xcrack.base.units import Units
from xcrack.fatigue.law import Constants
from xcrack.growth.options import GrowthOptions
from xcrack.model.loads import Support

DATA = Path(__file__).resolve().parents[1] / "data"
MM = Units("mm", "N")
K = np.sqrt(1000.0)  # of MPa√m in MPa√mm
NEWMAN = xc.newman_closure(1.5, 0.3)
LOADS = {
    "displacement": lambda: xc.displacement("top", (None, 1e-3)),
    "traction": lambda: xc.traction("top", (0, 80.0)),
    "pressure": lambda: xc.pressure("top", 80.0),
    "bearing": lambda: xc.bearing("h", (1e3, 0), 3),
    "resultant": lambda: xc.resultant("top", (0, 1e3), 5, about=(0, 10)),
    "point_force": lambda: xc.point_force([(10, 0)], [(2e3, 0)]),
    "line_force": lambda: xc.line_force("a", "b", (3, 0, 0)),
    "body_force": lambda: xc.body_force((0, -7e-5)),
    "crack_pressure": lambda: xc.crack_pressure(2.0, 0),
    "initial_stress": lambda: xc.initial_stress([[1, 0], [0, 2]]),
    "temperature": lambda: xc.temperature(20.0, 1.2e-5),
}
SUPPORTS = {
    "fix": lambda: xc.fix((10.0, 0.0), 1),
    "displacement": LOADS["displacement"],
}
LAWS = {
    "paris": lambda: xc.paris(1e-11, 3, K_c=50 * K, R_range=(-1, 0.8), ratio="contact"),
    "elber": lambda: xc.elber(1e-11, 3, 0.5, 0.4),
    "walker": lambda: xc.walker(1e-11, 3, 0.5),
    "piecewise": lambda: xc.piecewise([(1e-14, 5), (1e-11, 3)], [K]),
    "forman": lambda: xc.forman(1e-9, 3, 2000, threshold=xc.klesnil_lukas(80, 1)),
    "hartman_schijve": lambda: xc.hartman_schijve(1e-10, 2, 3000, 50),
    "nasgro": lambda: xc.nasgro(
        1e-11,
        3,
        0.5,
        1,
        xc.nasgro_K_c(900, 350, 5, 1, 1),
        NEWMAN,
        xc.nasgro3_threshold(dK0=80, C_th=1.5, a0=0.0381),
    ),
    "rate_table": lambda: xc.rate_table({0.1: ([10 * K, 500], [1e-5, 1e-4])}, "nearest"),
    "with_time": lambda: xc.with_time(
        xc.paris(1e-11, 3), xc.time_rate(1e-9, 2, plateau=1.0), 60, "sine"
    ),
    "preset": lambda: xc.law("AA7050-T7451 NASGRO", units="mm, MPa√mm"),
    "metal": lambda: xc.material("2024-T3 sheet, L-T", units="mm, MPa√mm").law(
        "walker", thickness=2.5
    ),
}
PARTS = {
    "linear_closure": lambda: xc.linear_closure(0.5, 0.4, (0, 0.9)),
    "schijve_closure": lambda: xc.schijve_closure(0.55, 0.33, 0.12),
    "newman_closure": lambda: NEWMAN,
    "klesnil_lukas": lambda: xc.klesnil_lukas(3 * K, 1),
    "stepped_threshold": lambda: xc.stepped_threshold([0, 0.5], [80, 60, 50], 0),
    "el_haddad": lambda: xc.el_haddad(xc.klesnil_lukas(80, 1), 0.05),
    "nasgro3_threshold": lambda: xc.nasgro3_threshold(dK0=80, C_th=1.5, a0=0.04),
    "nasgro4_threshold": lambda: xc.nasgro4_threshold(
        dK1=60, C_th_plus=1, C_th_minus=0.1, a0=0.04, R_clip=0.7
    ),
}
CRACKS = {
    "line": lambda: xc.line_crack([(0, 0), (10, 0)]),
    "penny": lambda: xc.penny_crack((0, 0, 0), (0, 0, 1), 10.0, n=16),
    "ellipse": lambda: xc.elliptic_crack((0, 0, 0), (0, 0, 1), (1, 0, 0), 10, 5),
    "polygon": lambda: xc.plane_crack([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
    "file": lambda: xc.read_surface("crack.stl"),
    "surface": lambda: xc.surface_crack([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
    "arm": lambda: xc.arm(xc.penny_crack((0, 0, 0), (0, 1, 0), 2.0), 0, 1),
}
MATERIALS = {
    "Isotropic": lambda: xc.Isotropic(210e3, 0.3, "stress", 350.0, 50 * K, 1e-5),
    "Graded": lambda: xc.Graded(xc.read_field("field.vtu", "E"), 0.3, "strain"),
    "metal": lambda: xc.material("2024-T3 sheet, L-T", units="mm, MPa√mm").isotropic(
        "stress", thickness=2.5
    ),
}
MESHES = {
    "file": lambda: xc.read_mesh("body.msh"),
    "box": lambda: xc.box((0, 0), (20, 10), (4, 2)),
}
GMSH = {
    "plate": lambda: xc.plate(
        10,
        10,
        size=3,
        holes=[((5, 5), 1)],
        sets={"seat": ((0, 0), (4, None))},
        along=[(0, 4), (3, 4)],
    ),
    "plate_with_hole": lambda: xc.plate_with_hole(width=10, height=10, radius=2, size=2),
    "notched_cylinder": lambda: xc.notched_cylinder(
        diameter=20, length=80, notch_depth=2, notch_angle=1, outer_span=60, inner_span=30, size=6
    ),
}
SPECIMENS = {
    "compact_tension": lambda: xc.compact_tension(50, 20, force=100, size=10, size_near=4),
    "disc_compact": lambda: xc.disc_compact(50, 20, size=10, size_near=4),
    "lug": lambda: xc.lug(40, 16, 4, size=8, size_near=3),
    "middle_tension": lambda: xc.middle_tension(40, 8, stress=90, size=8, size_near=3),
    "single_edge_bend": lambda: xc.single_edge_bend(40, 16, size=8, size_near=3),
    "single_edge_tension": lambda: xc.single_edge_tension(40, 16, size=8, size_near=3),
}
GROUPS = {
    "loads": (LOADS, lambda: case_values.makers_of(Load)),
    "supports": (SUPPORTS, lambda: case_values.makers_of(Support)),
    "laws": (LAWS, lambda: case_values.makers_of(GrowthLaw)),
    "parts": (PARTS, lambda: case_values.makers_of(Closure) | case_values.makers_of(Threshold)),
    "cracks": (CRACKS, lambda: case_values.CRACKS),
    "materials": (MATERIALS, lambda: case_values.makers_of(Material)),
    "meshes": (MESHES | GMSH, lambda: case_values.MESHES),
    "specimens": (SPECIMENS, lambda: case_values.SPECIMENS),
}
BY_OTHER_TESTS = {"step"}  # a mesh of a STEP file: below


SAMPLES = tomllib.loads((Path(__file__).parent / "samples.toml").read_text(encoding="utf-8"))


def own(makers):
    """Makers of the package: those of users, in other tests, are found beside them."""
    return {n: m for n, m in makers.items() if inspect.unwrap(m).__module__.startswith("xcrack.")}


def same(value, wanted):
    """Fields by field; numbers but for round-off of their units."""
    assert type(value) is type(wanted)
    if is_dataclass(value):
        return all(same(getattr(value, f.name), getattr(wanted, f.name)) for f in fields(value))
    if isinstance(value, tuple | list):
        return len(value) == len(wanted) and all(map(same, value, wanted))
    if isinstance(value, float | np.ndarray) and np.asarray(value).dtype.kind == "f":
        np.testing.assert_allclose(value, wanted, rtol=1e-13)
        return True
    return describe("", value) == describe("", wanted)


@pytest.fixture
def _in_folder(tmp_path, monkeypatch):
    """Files that samples name."""
    import meshio

    monkeypatch.chdir(tmp_path)
    (tmp_path / "body.msh").write_bytes((DATA / "plate_41.msh").read_bytes())
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    faces = [("triangle", np.array([(0, 1, 2), (0, 2, 3)]))]
    meshio.Mesh(corners, faces, {"E": np.array([1.0, 2.0, 3.0, 4.0])}).write("field.vtu")
    meshio.Mesh(corners, faces).write("crack.stl")


@pytest.mark.parametrize("group", GROUPS)
def test_every_maker_has_a_sample(group):
    values, makers = GROUPS[group]
    assert set(values) == set(SAMPLES[group]) == set(own(makers())) - BY_OTHER_TESTS


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
@pytest.mark.parametrize(
    ("group", "name"),
    [
        pytest.param(group, name, marks=[pytest.mark.gmsh] * (name in {**GMSH, **SPECIMENS}))
        for group, (values, _) in GROUPS.items()
        for name in values
    ],
)
@pytest.mark.usefixtures("_in_folder")
def test_a_file_makes_what_python_makes(group, name):
    values, makers = GROUPS[group]
    content = {"kind": name, **SAMPLES[group][name]}
    table = Table(Source(Path("case.toml"), {}, MM), (group,), content)
    assert same(case_values.value_of_table(table, makers()), values[name]())


# Public names that a case file has no words for, and why. All others are said by some key.
RESULTS = """
Crack Deck History Inspection Join Mesh Metal Problem Response SIF Scatter Solution Specimen Step
Closure GrowthLaw Load LoadProgram Material MaterialSets Threshold
ConvergenceError GeometryError MeshError ProblemError XcrackError XcrackWarning
""".split()
QUESTIONS = """
check chart cycles_between compliance convert_mesh crack_opening demo draw_K draw_fronts
energy_error energy_release_rate equivalent_K geometry_factors growth_curve info inf_sup
interface_intensity
materials measures opening_load plan plot plot_rates plot_spectrum plot_strength presets rainflow
respond solve stress_intensities stress_intensity validate verify
campaign collect grid load read_case report resume run save sweep write write_case write_factors
write_mesh
""".split()
KEYS = """
grow Cycle Spectrum read_spectrum twist wheeler willenborg plastic_zone pardiso max_hoop_stress
mean_reference weighted_angle life lognormal normal inspection logistic_pod residual_strength
assessment_line handbook Numerics adapt read_deck fit_curves refine part read_field law material
time_rate nasgro_K_c mesh_step read_mesh read_surface
K_gradient K_over_size load_over_cycles load_over_size retarded
""".split()  # functions that a section or key stands for
MAKERS = {"line_crack", "penny_crack", "elliptic_crack", "plane_crack", "surface_crack"}


def test_no_public_name_is_forgotten():
    """A new public function is a key of case files, or stands in a list with the reason."""
    words = {name for samples, _ in GROUPS.values() for name in samples} | MAKERS | set(KEYS)
    assert set(xc.__all__) - words == set(RESULTS + QUESTIONS) & set(xc.__all__)
    assert not words & set(RESULTS + QUESTIONS)


def test_no_option_is_forgotten():
    """Keys of sections are the arguments of their functions; what is left out is said."""
    assert set(GrowthOptions.__annotations__) >= set(case._FUNCTIONS) == {"response"}
    own_names = set(arguments_of(xc.solve)) | set(arguments_of(xc.adapt))
    assert own_names == {*case._SOLVING, "problem", "states", "progress"}
    left = set(arguments_of(xc.Problem)) - {*case._CHOICES, *case._SECTIONS}
    assert not left
    for maker, given in (
        (xc.life, {"scatter", "nu"}),
        (xc.inspection, {"pod"}),
        (xc.residual_strength, set()),
    ):
        names = set(arguments_of(maker)) - set(case_histories._OF_RUN)
        assert given <= names
    assert set(case_histories._CHOICES) | set(case_histories._FORMS) == set(
        arguments_of(xc.Spectrum)
    )
    assert Constants in GrowthLaw.__mro__


def written(folder, text):
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


LAW = STRIP_GROWTH.partition("cycle")[0]
PULL = '{ kind = "traction", where = "top", value = [0, 80] }'


def read(folder, text):
    return xc.read_case(written(folder, text))


def test_histories_of_load_states(tmp_path):
    """States are factors, loads or lists of loads; of a cycle, a spectrum and a solve."""
    loads = lambda *values: [xc.traction("top", (0, value)) for value in values]  # noqa: E731
    growth = read(
        tmp_path, f"{STRIP}{STRIP_PULL}{LAW}cycle = {{ states = [0.1, [{PULL}], 1.0] }}\nda = 1"
    ).growth
    assert same(growth["cycle"].load_states[1][0], loads(80)[0])
    assert growth["cycle"].load_states[::2] == (0.1, 1.0)
    states = f'states = [0.0, {PULL}], sequence = [0, 1, 0, 1], unit = "day"'
    text = f"{STRIP}{STRIP_PULL}{LAW}da = 1\nspectrum = {{ {states} }}"
    spectrum = read(tmp_path, text).growth["cycle"]
    assert (spectrum.unit, spectrum.sequence.tolist(), spectrum.states[0]) == (
        "day",
        [0, 1, 0, 1],
        0.0,
    )
    text = f"{STRIP}[solve]\nstates = [[{PULL}], []]\nerror = true\n"
    case_file = read(tmp_path, text)
    assert len(case_file.states) == 2
    assert case_file.solving == {"error": True}
    counted = "rows = [[0, 1, 10], [0.2, 1, 100]], levels = 5"
    rows = f"{STRIP}{STRIP_PULL}{LAW}da = 1\nspectrum = {{ {counted} }}"
    assert read(tmp_path, rows).growth["cycle"].levels == 5
    twist = 'kind = "twist", mean = 0.4, seed = 3, flights = 2'
    drawn = f"{STRIP}{STRIP_PULL}{LAW}da = 1\nspectrum = {{ {twist} }}"
    assert same(read(tmp_path, drawn).growth["cycle"], xc.twist(mean=0.4, seed=3, flights=2))


def test_options_of_growth_have_the_units_that_they_declare(tmp_path):
    text = f"""{STRIP}{STRIP_PULL}{LAW}cycle = {{ min = 0, max = 1 }}
da = "0.1 cm"
threshold = "2 MPa*sqrt(m)"
K_c = "50 MPa*sqrt(m)"
max_size = "1 cm"
solver = "pardiso"
criterion = {{ kind = "mean_reference", reference = "max" }}
"""
    growth = read(tmp_path, text).growth
    assert (growth["da"], growth["max_size"]) == (1.0, 10.0)
    assert growth["threshold"] == pytest.approx(2 * K)
    assert growth["K_c"] == pytest.approx(50 * K)
    assert growth["solver"] is xc.pardiso
    assert same(growth["criterion"], partial(xc.mean_reference, reference="max"))


BODY = STRIP.partition("[material]")


def test_bodies_are_refined_and_have_parts_and_cell_sets(tmp_path):
    text = f"""{BODY[0]}refine = {{ size = "0.08 cm" }}
[[mesh.parts]]
of = "top"
name = "seat"
where = [[0, "free"], ["1 cm", "free"]]
[mesh.cell_sets]
steel = [["free", "free"], [10, "free"]]
soft = [[10, "free"], ["free", "free"]]
[material.steel]
E = "210 GPa"
nu = 0.3
plane = "strain"
[material.soft]
E = "70 GPa"
nu = 0.33
plane = "strain"
{BODY[2].partition('plane = "strain"')[2]}"""
    problem = read(tmp_path, text).problem
    mesh = xc.part(
        xc.refine(xc.box((0, -10), (20, 10), (20, 20)), size=0.8),
        "top",
        ((0, None), (10, None)),
        "seat",
    )
    assert same(problem.mesh.points, mesh.points)
    assert same(problem.mesh.facet_sets["seat"], mesh.facet_sets["seat"])
    middle = mesh.points[mesh.cells].mean(axis=1)[:, 0]
    assert len(problem.mesh.cell_sets["steel"]) == (middle < 10).sum()
    assert problem.material["soft"].E == 70e3


def test_bodies_from_files_get_their_curves(tmp_path):
    """The square's corners of 90 degrees stay, an octagon's of 45 become round."""
    angle = np.pi / 4 * np.arange(8)
    points = np.concatenate([10 * np.stack([np.cos(angle), np.sin(angle)], axis=1), [[0, 0]]])
    k = np.arange(8)
    cells = np.stack([k, (k + 1) % 8, np.full(8, 8)], axis=1)
    rim = {"rim": cells[:, :2]}
    xc.write_mesh(tmp_path / "disc.msh", xc.Mesh(points, cells, rim))
    text = """[mesh]
kind = "file"
path = "disc.msh"
fit_curves = ["rim"]
refine = { size = 1 }
[material]
E = 1000
nu = 0.3
plane = "strain"
[[cracks]]
kind = "line"
points = [[-2, 0], [2, 0]]
[[loads]]
kind = "pressure"
where = "rim"
p = -1
"""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = read(tmp_path, text).problem.mesh
    x = mesh.points[np.unique(mesh.facet_sets["rim"])]
    assert np.linalg.norm(x, axis=1) == pytest.approx(10, rel=2e-6)


def test_handbook_and_specimen(tmp_path):
    text = f'{STRIP}{STRIP_PULL}[[handbook]]\nkind = "edge"\na = "6 mm"\nW = 20\nS = 80\n'
    assert read(tmp_path, text).problem.handbook == (xc.handbook("edge", a=6.0, W=20.0, S=80.0),)
    deck = """[specimen]
kind = "single_edge_tension"
W = 20
a = 8
size = 4
[material]
E = 1
nu = 0.3
plane = "strain"
"""
    pytest.importorskip("gmsh")
    problem = read(tmp_path, deck).problem
    wanted = xc.single_edge_tension(20, 8, size=4).problem(xc.Isotropic(1.0, 0.3, "strain"))
    assert same(problem.mesh.points, wanted.mesh.points)
    assert problem.handbook == wanted.handbook


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_a_deck_with_a_crack(tmp_path):
    from support.decks import box_cases

    (tmp_path / "part.inp").write_text(box_cases(2, 2)["CPE6_cload"])
    text = """[deck]
path = "part.inp"
ignore = ["TIE"]
[[cracks]]
kind = "line"
points = [[1.5, 1.0], [1.5, 0.7]]
"""
    problem = read(tmp_path, text).problem
    deck = xc.read_deck(tmp_path / "part.inp")
    assert problem.material == deck.material
    assert len(problem.loads) == len(deck.loads)
    assert same(problem.mesh.points, deck.mesh.points)


ASSESSED = f"""{STRIP}{STRIP_PULL}{STRIP_GROWTH}[life]
samples = 500
seed = 3
unit = "flight"
[life.scatter]
C = {{ kind = "lognormal", sigma = 0.3 }}
constants = {{ m = {{ kind = "normal", sigma = 0.02 }} }}
correlation = [["C", "m", -0.9]]
[inspection]
a_detect = "6.2 mm"
factor = 3
pod = {{ a50 = "6 mm", s = 0.2 }}
measure = "length"
[strength]
K_c = "100 MPa*sqrt(m)"
yield_stress = "350 MPa"
resistance = {{ da = [0, "5 mm"], K = [500, "60 MPa*sqrt(m)"] }}
collapse = {{ a = [0, 20], factor = [5, 0.1] }}
line = {{ E = "210 GPa", sigma_y = 350, sigma_u = 450 }}
"""


@pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")
def test_scatter_inspections_and_strength_are_those_of_python(tmp_path, monkeypatch):
    """The report of a case has them, and its units and the picture of its spectrum."""
    seen = {}

    def report(result, file, **named):
        seen.update(named)
        return file

    monkeypatch.setattr("xcrack.app.case_run.report", report)
    run = xc.run(written(tmp_path, ASSESSED))
    scatter = xc.Scatter(
        C=xc.lognormal(0.3), constants={"m": xc.normal(0.02)}, correlation={("C", "m"): -0.9}
    )
    lives = xc.life(run, xc.paris(1e-11, 3), scatter=scatter, samples=500, seed=3, unit="flight")
    assert seen["life"].N.tobytes() == lives.N.tobytes()
    looks = xc.inspection(
        run, a_detect=6.2, factor=3, pod=xc.logistic_pod(6.0, 0.2), measure="length"
    )
    assert (seen["inspection"].interval, seen["inspection"].missed) == (
        looks.interval,
        looks.missed,
    )
    rows = xc.residual_strength(
        run, nu=0.3, K_c=100 * K, yield_stress=350.0, line=xc.assessment_line(210e3, 350, 450),
        resistance=lambda da: np.interp(da, [0, 5], [500, 60 * K]),
        collapse=lambda a: np.interp(a, [0, 20], [5, 0.1]),
    )  # fmt: skip
    np.testing.assert_allclose(
        [seen["strength"][name] for name in rows.dtype.names],
        [rows[n] for n in rows.dtype.names],
        rtol=1e-13,
    )
    assert seen["units"] == "N, mm, MPa"
    assert seen["spectrum"] is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[life]", "[life]\nlaw = 3", r"line \d+, life.law: there is no such key"),
        ("seed = 3\n", "", r"line \d+, life: the key 'seed' is missing"),
        (
            'a_detect = "6.2 mm"',
            'a_detect = "6.2 MPa"',
            "inspection.a_detect: .* is a stress, but a length",
        ),
        ('a_detect = "6.2 mm"', "", r"line \d+, inspection: give a_detect or interval"),
        ("sigma = 0.3", "sigma = -0.3", r"line \d+, life.scatter.C.*sigma = -0.3"),
        ('"C", "m", -0.9', '"C", "x", -0.9', "life.scatter.correlation: .*give pairs"),
        ('[0, "5 mm"], K', "[5, 0], K", r"line \d+, strength.resistance.*rising"),
        ('K_c = "100 MPa*sqrt(m)"\n', "", r"line \d+, strength: the key 'K_c' is missing"),
        ("[growth]", "[growth]\nresponse = 3", "growth.response: it is a function: a script"),
        ("[growth]", '[growth]\nsolver = "mumps"', "growth.solver: 'mumps': known is pardiso"),
        ('value = [0.0, "80 MPa"]', 'value = "lambda x: x"', "loads 1.value.*read_field"),
        ('value = [0.0, "80 MPa"]', 'value = { path = "no.vtu" }', "value.path: there is no file"),
    ],
)
def test_what_is_wrong_is_refused_with_its_line(old, new, words, tmp_path):
    assert old in ASSESSED
    with pytest.raises(xc.XcrackError, match=words):
        xc.read_case(written(tmp_path, ASSESSED.replace(old, new, 1)))


def test_assessments_belong_to_a_run(tmp_path):
    text = ASSESSED.replace(STRIP_GROWTH, "")
    with pytest.raises(xc.ProblemError, match=r"line \d+, life: it is of a growth run"):
        xc.read_case(written(tmp_path, text))
    with pytest.raises(xc.ProblemError, match="give one of"):
        xc.read_case(written(tmp_path, STRIP + '[deck]\npath = "x.inp"\n'))


@pytest.mark.gmsh
def test_a_body_from_step_with_sets_by_boxes(tmp_path):
    """Faces of a bracket are chosen by the box that holds them, from the folder of the file."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(-30.0, -20.0, 0.0, 60.0, 40.0, 6.0)
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "bracket.step"))
    finally:
        gmsh.finalize()
    text = """[mesh]
kind = "step"
path = "bracket.step"
size = 8.0
sets.end = [["free", "free", "free"], [-29.9, "free", "free"]]
sets.top = [["free", "free", 6.0], ["free", "free", 6.0]]
[material]
E = 1
nu = 0.3
"""
    mesh = read(tmp_path, text).problem.mesh
    assert (mesh.points[mesh.facet_sets["end"]][..., 0] == -30.0).all()
    assert (mesh.points[mesh.facet_sets["top"]][..., 2] == 6.0).all()
    with pytest.raises(xc.XcrackError, match="selects none of the 6 faces"):
        read(tmp_path, text.replace("-29.9", "-31.0"))
