"""What must fail loudly: each error is ours and names the object, the value and the remedy."""

import math
import re
import warnings

import numpy as np
import pytest
from scipy.sparse.linalg import splu

import xcrack as xc
from support import scenes_2d as scenes

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
SIDES = ("left", "right", "bottom", "top")
PULL = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
NAN = math.nan


def box(n=8):
    return xc.box((-1, -1), (1, 1), n)


def problem(mesh=None, cracks=(), **options):
    options = {"loads": PULL, **options}
    lines = [c if isinstance(c, xc.Crack) else xc.line_crack(c) for c in cracks]
    return xc.Problem(mesh or box(), STEEL, lines, **options)


def solve(*args, **options):
    return xc.solve(problem(*args, **options))


def grow(crack=((-1.1, 0.03), (0.0, 0.03)), law=None, criterion=None, cycle=None, **options):
    options = {"da": 0.3, "progress": False, "max_steps": 2, **options}
    steps = xc.grow(
        problem(box(12), [crack]), law or xc.paris(1e-9, 3.0), criterion or xc.max_hoop_stress,
        cycle or xc.Cycle(0.0, 1.0), **options,
    )  # fmt: skip
    return list(steps)


def overlapping():
    """Three triangles on one edge."""
    return xc.Mesh([*SQUARE, (0.5, 2.0)], [(0, 1, 2), (0, 2, 3), (0, 2, 4)])


MESHES = {
    "no cells": (lambda: xc.Mesh(SQUARE, np.zeros((0, 3), int)), "no cells.*give triangles"),
    "flat cell": (
        lambda: xc.Mesh([(0, 0), (1, 0), (2, 0)], [(0, 1, 2)]),
        r"cell 0 at \[1.0, 0.0\] has no volume.*merge its points",
    ),
    "doubled cells": (
        lambda: xc.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3), (2, 1, 0)]),
        "cells 0 and 2 have the same points.*remove one",
    ),
    "overlapping cells": (overlapping, r"facet \[0, 2\] belongs to 3 cells.*remove"),
    "nan": (
        lambda: xc.Mesh([(0, 0), (1, NAN), (0, 1)], [(0, 1, 2)]),
        r"point 1 has coordinates \[1.0, nan\].*must be finite",
    ),
    "unused point": (
        lambda: xc.Mesh([*SQUARE, (5, 5)], [(0, 1, 2), (0, 2, 3)]),
        "point 4 belongs to no cell.*remove",
    ),
    "point number": (
        lambda: xc.Mesh(SQUARE, [(0, 1, 7)]),
        r"cell 0 names a point outside 0 \.\.\. 3",
    ),
    "quadrangles": (lambda: xc.Mesh(SQUARE, [(0, 1, 2, 3)]), r"must be \(m, 3\).*only triangles"),
    "facet set": (
        lambda: xc.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)], {"a": [(1, 3)]}),
        r"facet set 'a': facet \[1, 3\] is no facet of any cell",
    ),
    "cell set": (
        lambda: xc.Mesh(SQUARE, [(0, 1, 2), (0, 2, 3)], {}, {"a": [2]}),
        "cell set 'a' names cells beyond the 2 of the mesh",
    ),
    "box corners": (lambda: xc.box((0, 0), (1, -1), 4), r"box: upper \[1.0, -1.0\] must exceed"),
    "box cells": (lambda: xc.box((0, 0), (1, 1), (4, 0)), r"n must be at least 1.*\[4, 0\]"),
}

GEOMETRY = {
    "outside": (
        lambda: problem(cracks=[[(3, 3), (4, 4)]]),
        r"crack from \[3.0, 3.0\] to \[4.0, 4.0\] lies outside the body.*fills \[\[-1.0, -1.0\]",
    ),
    "zero length": (
        lambda: xc.line_crack([(0, 0), (0, 0)]),
        r"zero length: points 0 and 1 both lie at \[0.0, 0.0\]; leave one out",
    ),
    "one point": (
        lambda: xc.line_crack([(0, 0)]),
        r"at least two points \(p, 2\), not 1",
    ),
    "points of three dimensions": (lambda: xc.line_crack(np.zeros((2, 3))), r"shape \(2, 3\)"),
    "nan": (lambda: xc.line_crack([(0, 0), (NAN, 1)]), r"points\[1, 0\] = nan"),
    "crosses itself": (
        lambda: xc.line_crack([(0, 0), (1, 1), (1, 0), (0, 1)]),
        r"crosses itself near \[0.5, 0.5\]: end it there, or describe it by two cracks",
    ),
    "folds back": (
        lambda: xc.line_crack([(0, 0), (1, 0), (0.5, 0)]),
        r"turns back on itself at \[1.0, 0.0\]",
    ),
    "two tips in one cell": (
        lambda: problem(box(4), [[(0.1, 0.1), (0.2, 0.15)]]),
        "has length .* less than the cell there.*refine the mesh",
    ),
    "tips of two cracks in one cell": (
        lambda: problem(cracks=[[(-1.1, 0.1), (0.05, 0.1)], [(0.1, 0.1), (1.1, 0.1)]]),
        r"tip of crack 0 at \[0.05, 0.1\] and one of crack 1 at \[0.1, 0.1\] are 0.05 apart",
    ),
    "two cracks cross": (
        lambda: problem(cracks=[[(-0.5, 0.01), (0.5, 0.02)], [(0.01, -0.5), (0.02, 0.5)]]),
        "cracks 0 and 1 cross near .*give crack 1 as two cracks that both end there",
    ),
    "two cracks in a cell": (
        lambda: solve(box(12), [[(-1.1, 0.02), (0.3, 0.02)], [(-0.3, 0.06), (1.1, 0.06)]]),
        "two cracks run through the cell at .*refine the mesh between them",
    ),
    "the same crack twice": (
        lambda: solve(cracks=[[(-1.1, 0.1), (0.1, 0.1)], [(-1.1, 0.1), (0.1, 0.1)]]),
        "crack",
    ),
    "along the boundary": (
        lambda: solve(cracks=[[(-0.5, -1.0), (0.5, -1.0)]]),
        "cuts no cell: it runs along the boundary",
    ),
    "a nick": (
        lambda: problem(cracks=[[(0.0, -1.5), (0.0, -0.95)]]),
        r"ends at \[0.0, -0.95\], 0.05 inside the boundary .*refine",
    ),
    "asked outside": (
        lambda: solve().displacement([(0.0, 0.0), (7.0, 0.0)]),
        r"\[7.0, 0.0\] lies outside the body",
    ),
}

EDGE = [(-1.1, 0.03), (0.0, 0.03)]
HELD = [xc.fix("bottom")]
PROBLEMS = {
    "E": (lambda: xc.Isotropic(0.0, 0.3), r"Isotropic: E = 0.0 is not possible: give .* above 0"),
    "E nan": (
        lambda: xc.Isotropic(NAN, 0.3),
        r"Isotropic: E = nan is not possible: give .* above 0",
    ),
    "nu": (lambda: xc.Isotropic(1.0, 0.5), r"nu = 0.5 is not possible.*0.4999"),
    "nu below": (
        lambda: xc.Isotropic(1.0, -1.0),
        r"nu = -1.0 is not possible: give .* above -1 and below 0.5",
    ),
    "plane": (lambda: xc.Isotropic(1.0, 0.3, plane="stain"), "plane = 'stain': give \"strain\""),
    "no plane": (
        lambda: xc.Problem(box(), xc.Isotropic(1.0, 0.3)),
        r'plane="strain"\) or plane="stress"',
    ),
    "set of a load": (
        lambda: problem(loads=[xc.traction("lid", (0, 1))]),
        "traction: the mesh has no facet set 'lid'; it has 'left', 'right', 'bottom', 'top'",
    ),
    "set of a support": (lambda: problem(supports=[xc.fix("lid")]), "fix: .*no facet set 'lid'"),
    "set in a load state": (
        lambda: xc.solve(problem(), states=[[xc.pressure("lid", 1.0)]]),
        "pressure: .*no facet set 'lid'",
    ),
    "out of balance": (
        lambda: solve(loads=[xc.traction("top", (0, 1))]),
        r"by 100 % of the sum of all forces \(2; resultant force \[.*, 2.0\], moment .*support",
    ),
    "moment out of balance": (
        lambda: solve(loads=[xc.traction("top", (1, 0)), xc.traction("bottom", (-1, 0))]),
        r"the supports leave a rigid motion free.*moment about the centre \[-4.0\]",
    ),
    "held in one direction": (
        lambda: solve(supports=[xc.fix("bottom", 1)], loads=[xc.traction("right", (1, 0))]),
        "the supports leave a rigid motion free.*add a support",
    ),
    "a piece cut free": (
        lambda: solve(cracks=[[(-1.1, 0.1), (1.1, 0.1)]], supports=HELD),
        r"cut the body into 2 pieces, and the one around .*\(45 % of the body\) has 3 free rigid",
    ),
    "load nan": (
        lambda: xc.traction("top", (0, NAN)),
        r"traction: value\[1\] = nan: every number must be finite",
    ),
    "load of a function nan": (
        lambda: solve(loads=[xc.traction("top", lambda x: x * NAN)], supports=HELD),
        r"traction\('top'\): the value at .* is \[nan, nan\]: every value must be finite",
    ),
    "load shape": (
        lambda: xc.traction("top", (1, 2, 3, 4)),
        "traction: value = .*: give a vector of 2 or 3 numbers",
    ),
    "load of space": (
        lambda: solve(loads=[xc.traction("top", (1, 2, 3))], supports=HELD),
        r"traction: value = \[1.*\] does not suit a body in 2 dimensions: give 2 numbers",
    ),
    "load of a function shape": (
        lambda: solve(loads=[xc.traction("top", lambda x: x[:, 0])], supports=HELD),
        r"traction\('top'\): the value has shape \(\d+,\), wanted \(\d+, 2\)",
    ),
    "pressure shape": (
        lambda: solve(loads=[xc.pressure("top", lambda x: x)], supports=HELD),
        r"pressure\('top'\): the value has shape \(\d+, 2\)",
    ),
    "pressure vector": (
        lambda: xc.pressure("top", (1, 2)),
        r"pressure: p = \(1, 2\) is not a number: give a finite number",
    ),
    "load of words": (
        lambda: xc.traction("top", "up"),
        r"traction: value = 'up' holds str entries: give an array",
    ),
    "initial stress shape": (
        lambda: xc.initial_stress((1, 2)),
        r"initial_stress: f has the shape \(2,\): give an array .* \(n, n\)",
    ),
    "initial stress lopsided": (lambda: xc.initial_stress([[1, 2], [0, 1]]), "not symmetric"),
    "displacement nan": (
        lambda: xc.displacement("top", (None, NAN)),
        r"displacement: value\[1\] = nan is not possible: give a finite number",
    ),
    "displacement entries": (
        lambda: solve(supports=[xc.displacement("top", (None, 0.0, 0.0))]),
        r"displacement: value = \(None, 0.0, 0.0\) does not suit a body in 2 dimensions",
    ),
    "supports that contradict": (
        lambda: solve(supports=[xc.fix("left"), xc.displacement("top", (1.0, 0.0))], loads=()),
        r"two supports contradict each other at \[-1.0, 1.0\], axis 0: 0 and 1",
    ),
    "axis": (
        lambda: xc.fix("top", axis=3),
        "fix: axis = 3: give 0 or 1 or 2",
    ),
    "axis of space": (
        lambda: solve(supports=[xc.fix("top", axis=2)]),
        "in 2 dimensions axis is 0 or 1",
    ),
    "point of a support": (
        lambda: solve(supports=[xc.fix((9.0, 0.0))]),
        r"fix: \[9.0, 0.0\] is .* away from the nearest",
    ),
    "point of a force": (
        lambda: solve(loads=[xc.point_force((9.0, 0.0), (1, 0))], supports=HELD),
        r"point_force: \[9.0, 0.0\] is .* away from the nearest mesh point",
    ),
    "new displacement of nothing": (
        lambda: problem(loads=[xc.displacement("top", (0, 1))]),
        r"displacement\('top'\) among the loads.*put it into supports first",
    ),
    "crack of a pressure": (
        lambda: problem(loads=[xc.crack_pressure(1.0, crack=1)]),
        r"crack_pressure\(crack=1\): the problem has 0 crack",
    ),
    "no load": (
        lambda: problem(loads=["top"]),
        "loads: 'top' is not one of them: give loads, such",
    ),
    "no support": (
        lambda: problem(supports=PULL),
        r"supports: traction\(.*is not one of them: give fix.*put forces into loads",
    ),
    "no crack": (
        lambda: xc.Problem(box(), STEEL, [[(0, 0), (1, 1)]]),
        "is not one of them: give cracks, such as line_crack",
    ),
    "a load for loads": (
        lambda: xc.Problem(box(), STEEL, loads=PULL[0]),
        r"Problem: loads = traction\(.*: give a list",
    ),
    "no mesh": (
        lambda: xc.Problem("plate.msh", STEEL),
        "Problem: mesh = 'plate.msh': give a mesh, such as box",
    ),
    "no material": (
        lambda: xc.Problem(box(), 210e3),
        r"Problem: material = 210000.0: give a material, such as Isotropic",
    ),
    "contact": (lambda: problem(contact="maybe"), "contact = 'maybe' .*give \"auto\""),
    "order": (lambda: problem(order=3), "order = 3: give 1 or 2"),
    "load state": (
        lambda: xc.solve(problem(), states=[NAN]),
        "load state = nan is not possible: give a finite number; a list of loads will do too",
    ),
    "no load state": (lambda: xc.solve(problem(), states=[]), "states is empty: give at least one"),
    "load state of words": (
        lambda: xc.solve(problem(), states=["half"]),
        "load state = 'half' is not a number: give a finite number; a list",
    ),
    "a nan place": (
        lambda: xc.point_force((NAN, 1.0), (0.0, 1.0)),
        r"point_force: x\[0\] = nan: every number must be finite",
    ),
    "a lopsided stress": (
        lambda: solve(
            loads=[xc.initial_stress(lambda x: np.tile([[0, 1], [0, 0]], (len(x), 1, 1)))]
        ),
        "initial_stress: the value at .* a stress must be symmetric",
    ),
    "a problem": (
        lambda: xc.solve("scene"),
        r"solve: problem = 'scene': give a Problem\(mesh",
    ),
    "a solver": (lambda: xc.solve(problem(), solver="mumps"), "solver = 'mumps' cannot be called"),
    "a solver of nothing": (
        lambda: xc.solve(problem(supports=HELD), solver=lambda A: None),
        "solver returned None: it must return a function",
    ),
    "a solver of another shape": (
        lambda: xc.solve(problem(supports=HELD), solver=lambda A: lambda b: b[:3]),
        r"what the solver returned has the shape \(3, 1\)",
    ),
    "points of the other kind": (
        lambda: solve(supports=HELD).displacement((0.0, 0.0, 0.0)),
        r"x has the shape \(3,\): give points \(n, 2\)",
    ),
    "a side": (
        lambda: solve(supports=HELD).stress((0.0, 0.0), side="up"),
        r"side = 'up': give 1 \(lip \+\), -1 \(lip -\) or 0",
    ),
    "an opening": (
        lambda: solve(cracks=[EDGE], supports=HELD).opening(-1),
        "opening: crack = -1 is not possible: give a whole number of at least 0",
    ),
    "crack number": (lambda: xc.stress_intensity(solve(), 0), "crack 0: the problem has 0 crack"),
    "enrichment": (
        lambda: xc.Numerics(enrichment="some"),
        'enrichment = .some. is not known: give "geometric" or "topological"',
    ),
    "functions": (lambda: xc.Numerics(functions=3), "functions = 3: give 4 or 2"),
    "multipliers": (lambda: xc.Numerics(multipliers="all"), 'give "reduced", "sparse" or "naive"'),
    "orthonormal": (lambda: xc.Numerics(orthonormal="yes"), 'give "star", "node" or "none"'),
    "initial set": (lambda: xc.Numerics(initial_set="?"), 'give "closed" or "open"'),
    "radius": (lambda: xc.Numerics(radius=-1.0), r"radius = -1.0 is not possible"),
    "domain": (lambda: xc.Numerics(domain=0.0), r"domain = 0.0 is not possible"),
    "points": (lambda: xc.Numerics(points=1), r"points = 1 is not possible"),
    # Growth
    "da": (lambda: grow(da=0.01), "advance 0.01 .*below a tenth of the cell.*cell size"),
    "da nan": (lambda: grow(da=NAN), "da = nan .* a finite number above 0"),
    "no da": (lambda: grow(da=None), "grow needs da .* or cycles"),
    "law negative": (
        lambda: grow(law=lambda dK, R: -dK),
        r"law returned da/dN = -.*crack 0, tip 0.*does not shrink",
    ),
    "law nan": (lambda: grow(law=lambda dK, R: dK * NAN), "law returned da/dN = nan"),
    "law shape": (
        lambda: grow(law=lambda dK, R: np.zeros(5)),
        r"law returned shape \(5,\) for 1 tips",
    ),
    "criterion": (
        lambda: grow(criterion=lambda K, nu: 1.0),
        r"must return three arrays \(angle, dK_eq, R\)",
    ),
    "scaling": (
        lambda: grow(scaling="log"),
        'scaling = \'log\' is not known: give "law" or "linear"',
    ),
    "cycle order": (lambda: xc.Cycle(1.0, 0.0), r"Cycle\(1.0, 0.0\): give finite min <= max"),
    "cycle twice": (lambda: xc.Cycle(0.0, 1.0, states=[1.0]), "not both"),
    "cycle of nothing": (lambda: xc.Cycle(states=[]), "at least one load state"),
    "paris": (lambda: xc.paris(-1.0, 3.0), "paris: C = -1.0 .* above 0"),
    "walker": (lambda: xc.walker(1.0, 3.0, 2.0), r"gamma = 2.0 .* at least 0 .* at most 1"),
    "elber": (lambda: xc.elber(1.0, 3.0, -1.0, 0.5), "is not positive for any R"),
}


def placed_if_scene(call):
    """A scene whose mesh is too coarse for its cracks can be made: adapt refines it."""
    result = call()
    if isinstance(result, xc.Problem):
        _ = result.placed


def message_of(call, kind):
    """The message of an error of the given class; nothing else may come out."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(kind) as caught:
            placed_if_scene(call)
    message = str(caught.value)
    print(f"\n{kind.__name__}: {message}")
    return message


@pytest.mark.parametrize("name", MESHES)
def test_meshes(name):
    call, words = MESHES[name]
    assert re.search(words, message_of(call, xc.MeshError), re.DOTALL)


@pytest.mark.parametrize("name", GEOMETRY)
def test_geometry(name):
    call, words = GEOMETRY[name]
    assert re.search(words, message_of(call, xc.GeometryError), re.DOTALL)


@pytest.mark.parametrize("name", PROBLEMS)
def test_problems(name):
    call, words = PROBLEMS[name]
    assert re.search(words, message_of(call, xc.ProblemError), re.DOTALL)


@pytest.mark.parametrize("name", [*MESHES, *GEOMETRY, *PROBLEMS])
def test_messages_are_sentences(name):
    """No raw arrays, no dictionary, no empty phrase; short enough to be read aloud."""
    call, _ = {**MESHES, **GEOMETRY, **PROBLEMS}[name]
    message = message_of(call, xc.XcrackError)
    assert 20 <= len(message) <= 400
    for ugly in ("array(", "dtype", "np.float64", "np.int64", "<function", "object at 0x", "\n"):
        assert ugly not in message


def test_inverted_cells_are_turned_not_refused():
    """The sense of a cell carries no meaning: gmsh and others differ in it."""
    mesh = xc.Mesh(SQUARE, [(0, 2, 1), (0, 2, 3)])
    assert (mesh.volume > 0).all()


@pytest.mark.parametrize("label", ["numerics", "problem", "solve", "line_crack", "fix"])
def test_unknown_options_are_refused_by_name(label):
    """A misspelt keyword must not pass: Python's own TypeError names it."""
    calls = {
        "numerics": lambda: xc.Numerics(radios=1.0),
        "problem": lambda: problem(ordr=1),
        "solve": lambda: xc.solve(problem(), sates=[1.0]),
        "line_crack": lambda: xc.line_crack([(0, 0), (1, 1)], tips=1),
        "fix": lambda: xc.fix("top", axes=1),
    }
    with pytest.raises(TypeError, match="unexpected keyword argument"):
        calls[label]()


def test_unknown_names_of_the_package():
    with pytest.raises(AttributeError, match="has no attribute 'sovle'"):
        _ = xc.sovle


def test_every_error_is_an_xcrack_error():
    for kind in (xc.MeshError, xc.GeometryError, xc.ProblemError, xc.ConvergenceError):
        assert issubclass(kind, xc.XcrackError)
    assert issubclass(xc.XcrackWarning, UserWarning)


def test_a_solver_that_returns_nan_is_caught():
    with pytest.raises(xc.ConvergenceError, match=r"returned nan.*singular"):
        xc.solve(problem(supports=HELD), solver=lambda A: lambda b: b * NAN)


# Growth stops with words, not with an error -----------------------------------------------------


def history(crack, **options):
    options = {"da": 0.3, "progress": False, **options}
    law = options.pop("law", xc.paris(1e-9, 3.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        steps = xc.grow(
            problem(box(12), [crack]), law, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), **options
        )
        return xc.collect(steps)


def test_a_tip_that_leaves_the_body():
    run = history([(-1.1, 0.03), (0.2, 0.03)])
    assert re.search(r"tip left the body: .*|cannot go on|cannot be solved", run.ended)
    assert len(run.steps) >= 2


def test_a_rate_that_is_zero():
    run = history([(-1.1, 0.03), (0.0, 0.03)], law=lambda dK, R: 0 * dK)
    assert run.ended == "rate is zero at every tip"
    assert len(run.steps) == 1
    run = history([(-1.1, 0.03), (0.0, 0.03)], threshold=1e9)
    assert "below the threshold 1e+09 at every tip" in run.ended


def test_an_advance_below_a_cell_warns():
    with pytest.warns(xc.XcrackWarning, match=r"below one cell along the path"):
        grow(crack=((-0.41, -0.43), (0.11, 0.13)), da=0.08)


def test_forces_that_nearly_balance_are_balanced_and_reported():
    """Below a thousandth of all forces the rest is removed, and the report names it."""
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0 + 5e-4))]
    solution = solve(loads=loads)
    assert re.search(r"loads balance to [1-9]\.\de-04", str(solution.report))
    assert scenes.rows(0.0) == pytest.approx(np.eye(2))


@pytest.mark.parametrize(("factor", "words"), [(2.0, "1 of"), (1.01, "0.01 of")])
def test_a_solver_that_is_wrong_is_not_believed(factor, words):
    """One product tells; a coarse one is used with a warning."""
    with pytest.raises(xc.ConvergenceError, match=f"solver leaves a residual of {words}"):
        xc.solve(
            problem(supports=HELD), solver=lambda A: lambda b: factor * splu(A.tocsc()).solve(b)
        )


def test_a_coarse_solver_is_used_with_a_warning():
    with pytest.warns(xc.XcrackWarning, match=r"leaves a residual of .*e-06"):
        coarse = xc.solve(
            problem(supports=HELD), solver=lambda A: lambda b: splu(A.tocsc()).solve(b) * 1.000002
        )
    assert coarse.energy == pytest.approx(solve(supports=HELD).energy, rel=1e-5)


def test_an_exception_in_a_users_function_says_where():
    def broken(x):
        raise KeyError("mine")

    for call in (
        lambda: solve(loads=[xc.traction("top", broken)]),
        lambda: xc.solve(problem(supports=HELD), solver=broken),
    ):
        with pytest.raises(KeyError, match="mine") as caught:
            call()
        assert "broken, which xcrack called for" in caught.value.__notes__[0]
