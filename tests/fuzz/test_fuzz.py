"""No input ends in somebody else's traceback: drawn inputs for every public name, with verdicts."""

import inspect

import pytest

import xcrack as xc
from fuzz import damage
from fuzz.kinds import NONSENSE, VALID
from fuzz.run import PARTS, TABLE, drawn, run, table
from xcrack import GrowthLaw, Load, Threshold

_EXEMPT = {
    **dict.fromkeys(
        ("XcrackError", "XcrackWarning", "MeshError", "GeometryError", "ProblemError",
         "ConvergenceError"),
        "raised by xcrack; its arguments are those of every exception",
    ),
    **dict.fromkeys(
        ("GrowthLaw", "Closure", "Threshold", "Load", "LoadProgram", "Material"),
        "base classes of what users define: test_new_kinds, test_new_material",
    ),
    "Deck": "made by read_deck; its problem(...) is called in that entry",
    "Metal": "made by material; its methods are called in that entry",
    "Specimen": "made by compact_tension and others; its problem(...) is called in those entries",
}  # fmt: skip

# By xcrack itself, with arrays of quadrature points.
_CALLED_BY_XCRACK = {
    "check",  # of materials, with the dimension of the mesh
    "with_yield_stress",  # as the options of a report, drawn there
    "stored",  # for a file
    "moduli",  # at nodes of the mesh: drawn as E of a problem
    "expansion",
    "tensor",
    "stress_across",
    "thermal_stress",
    "displacement_at",
    "factors",  # of loads that follow the crack
    "scaled",  # K and solutions, by these
    *(name for kind in (Load, Load.__base__, GrowthLaw, Threshold) for name in vars(kind)),
}
_MADE_BY_XCRACK = ("Solution",)  # by solve, from parts that users do not have

# Of younger functions: their own tests refuse bad input; to be drawn here too.
_TO_BE_DRAWN = {"campaign": {"client", "case"}, "grid": {"parameters"}, "report": {"life"},
                "plot_rates": {"file"}}  # fmt: skip


def report(counts, faults, capsys, seed):
    with capsys.disabled():
        print(f"\nfuzz, seed {seed}, {sum(counts.values())} inputs: {table(counts)}")
    assert not faults, "\n" + "\n".join(faults)


def test_two_hundred_inputs(capsys):
    counts, faults, _ = run(87013, range(200))
    report(counts, faults, capsys, 87013)


@pytest.mark.slow
@pytest.mark.mission
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("seed", [31907, 55721, 90173])
def test_many_inputs(seed, capsys):
    """1600 inputs with a verdict of valid or nonsense; those on the edge come on top."""
    count, decided = 0, 0
    while decided < 1600:
        decided += drawn(seed, count).verdict in (VALID, NONSENSE, "own")
        count += 1
    counts, faults, _ = run(seed, range(count))
    report(counts, faults, capsys, seed)


def test_every_public_name_is_in_the_table():
    named = {one.name for one in TABLE}
    public = set(xc.__all__)
    assert public - named - set(_EXEMPT) == set()
    assert not named & set(_EXEMPT)
    assert {name for name in named if "." not in name} <= public


def test_every_argument_is_in_the_table():
    arguments = {}
    for one in TABLE:
        arguments.setdefault(one.name, set()).update(getattr(one, "arguments", ()))
    for name in set(xc.__all__) - set(_EXEMPT) - set(_MADE_BY_XCRACK):
        missing = set(inspect.signature(getattr(xc, name)).parameters) - arguments[name]
        missing -= _TO_BE_DRAWN.get(name, set())
        assert not missing, f"{name}: {missing}"


def test_every_method_of_public_values_is_in_the_table():
    """By a look at the source of the table: methods are called in it by their names."""
    source = "".join(map(inspect.getsource, PARTS))
    for name in xc.__all__:
        value = getattr(xc, name)
        if not isinstance(value, type) or name in _EXEMPT:
            continue
        for method, function in vars(value).items():
            public = not method.startswith("_") and inspect.isfunction(function)
            public &= method not in _CALLED_BY_XCRACK
            if public and len(inspect.signature(function).parameters) > 1:
                assert f".{method}(" in source or f'"{method}"' in source, f"{name}.{method}"


def test_verdicts_know_what_they_judge():
    """The rules themselves, on values whose verdict is beyond doubt."""
    from fuzz.kinds import Filename, Number, Numbers, Whole, Word

    good = [
        (Number(above=0), (1, 0.5)),
        (Whole(least=1), (1, 3.0)),
        (Numbers((None, 2)), ([(0, 1)], [[0.5, 1], [2, 3]])),
        (Word(words=("on", "off")), ("on",)),
        (Filename(endings=(".png",)), ("a.png", "a")),
    ]
    bad = [
        (Number(above=0), (0, True, None, "1", float("nan"), 1j, [1.0], 10**400)),
        (Whole(least=1), (0, 2.5, True, "1", float("inf"))),
        (Numbers((None, 2)), ([0, 1], [(0, None)], [[0, 1], [2]], "ab", None, [[0, float("nan")]])),
        (Word(words=("on", "off")), ("On", 1, None, b"on")),
        (Filename(endings=(".png",)), ("", "a\0.png", "a.xyz", 1, b"a.png", "file/a.png")),
    ]
    for cases, verdict in ((good, VALID), (bad, NONSENSE)):
        for kind, values in cases:
            for value in values:
                assert kind.verdict(value) == verdict, (kind, value)


def test_some_damaged_files(capsys):
    """A file in a hundred of each class; gmsh of a process of its own is left to the long one."""
    names = [draw.__name__ for draw in damage.CLASSES if draw is not damage.step_files]
    table, faults = damage.run(40213, 0.01, names)
    with capsys.disabled():
        print(f"\n{damage.report(table)}")
    assert not faults, "\n" + "\n".join(faults)


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("seed", [51307])
def test_damaged_files(seed, capsys):
    """Case files, rows, saved files, decks, pipes, sizes, depth, names that lead out, threads."""
    table, faults = damage.run(seed)
    with capsys.disabled():
        print(f"\ndamaged files, seed {seed}\n{damage.report(table)}")
    assert sum(sum(counts.values()) for counts in table.values()) >= 1500
    assert not faults, "\n" + "\n".join(faults)
