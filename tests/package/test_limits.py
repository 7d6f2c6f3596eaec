"""Sizes of the house as ratchets: `limits.json` has what may not grow; `--ratchet` lowers it.

A limit is raised by hand only, with a reason beside it in the file.
"""

import ast
import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import xcrack as xc

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "xcrack"
LIMITS = Path(__file__).with_name("limits.json")
FILES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted({p.relative_to(SOURCE).parts[0] for p in FILES if p.parent != SOURCE})
FILES_OF_LAST_WAY = []  # of the interpreter that follows ways
# Classes that answer for themselves: outside their package nobody asks which one it is.
KINDS = {
    "model": "displacement traction pressure bearing resultant point_force line_force body_force "
    "crack_pressure initial_stress temperature fix Isotropic",
    "fatigue": "paris elber walker piecewise forman hartman_schijve nasgro rate_table "
    "linear_closure schijve_closure newman_closure klesnil_lukas stepped_threshold el_haddad "
    "nasgro3_threshold nasgro4_threshold",
}


def product():
    """Files without the package of proofs, with the nodes of their trees."""
    return {
        p: list(ast.walk(ast.parse(p.read_text(encoding="utf-8"))))
        for p in FILES
        if p.relative_to(SOURCE).parts[0] != "verification"
    }


def stored_names(nodes):
    names = set()
    for of_file in nodes.values():
        for node in of_file:
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                names.add(node.id if isinstance(node, ast.Name) else node.attr)
            elif isinstance(node, ast.arg):
                names.add(node.arg)
            elif isinstance(node, ast.FunctionDef | ast.ClassDef):
                names.add(node.name)
    return names


def bare_words():
    """Words of `bare_words.txt`: all of them, and `{word: files}` of those with a reason."""
    text = Path(__file__).with_name("bare_words.txt").read_text(encoding="utf-8")
    words, exceptions = (part.split("\n", 1)[1] for part in text.split("\n# ")[1:])
    rows = [line.split(" | ") for line in exceptions.splitlines()]
    assert all(len(row) == 3 and row[2].strip() for row in rows), "word | files | why"
    return set(words.split()), {word: files.split() for word, files, _ in rows}


def bare_names(nodes):
    """`{word: files}` of the names of a bare word: nouns of the field (`mesh`, `phi`) do not count.

    Without the files in which a word is the name by which users or the field know a thing.
    """
    words, exceptions = bare_words()
    files_by_word = {}
    for path, of_file in nodes.items():
        file = path.relative_to(SOURCE).as_posix()
        for word in {name.strip("_") for name in stored_names({path: of_file})} & words:
            if not {"*", file} & set(exceptions.get(word, ())):
                files_by_word.setdefault(word, []).append(file)
    return files_by_word


def questions_for_kinds(nodes):
    """isinstance, match and comparisons of type on loads, laws and their parts."""
    count = 0
    for path, of_file in nodes.items():
        package = path.relative_to(SOURCE).parts[0]
        kinds = {k for home, names in KINDS.items() if home != package for k in names.split()}
        for node in of_file:
            asks = isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance"
            if asks or isinstance(node, ast.MatchClass):
                names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
                count += bool(names & kinds)
    return count


def rules_outside_of_declarations(nodes):
    """Calls that check a value where a field or an argument could declare its rule.

    A function of a value, `label` to call it and the `error` to raise belongs to a rule itself.
    """
    checks = {"number", "whole_number", "one_of", "flag", "entries", "path_of"}

    def calls(node, is_rule):
        if isinstance(node, ast.FunctionDef):
            arguments = [*node.args.args, *node.args.kwonlyargs]
            is_rule = {"label", "error"} <= {argument.arg for argument in arguments}
        name = getattr(node.func, "id", "") if isinstance(node, ast.Call) else ""
        own = int(name in checks and not is_rule)
        return own + sum(calls(child, is_rule) for child in ast.iter_child_nodes(node))

    return sum(
        calls(of_file[0], False)
        for path, of_file in nodes.items()
        if path.relative_to(SOURCE).parts[0] not in ("base", "growth", "runs")
    )


def tables_of_dimension(nodes):
    return sum(
        isinstance(node, ast.Dict)
        and {getattr(key, "value", None) for key in node.keys} == {2, 3}
        for of_file in nodes.values() for node in of_file
    )  # fmt: skip


def test_files_with_private_imports():
    """Test files that import more than what a user is told of.

    That is `xcrack` and its command, `testing`, exact fields and methods to compare with, and the
    modules that the pages import: rules of arguments and units of a load, a case of the book.
    """
    imported = re.compile(r"^\s*(?:from|import) xcrack\.([\w.]+)(?: import (\w+))?", re.MULTILINE)
    pages = "".join(p.read_text(encoding="utf-8") for p in (ROOT / "docs").glob("*.md"))
    modules = {"__main__", "testing", "verification.exact", "verification.methods"}
    modules |= {module for module, _ in imported.findall(pages)}

    def is_public(module, name):
        home = module.startswith(("verification.exact.", "verification.methods."))
        return home or bool(modules & {module, f"{module}.{name}"})

    files = (imported.findall(p.read_text()) for p in (ROOT / "tests").rglob("test_*.py"))
    return sum(not all(is_public(*each) for each in names) for names in files)


test_files_with_private_imports.__test__ = False


def measured():
    """All static numbers of the limits."""
    nodes = product()
    lines = {p: p.read_text(encoding="utf-8").count("\n") for p in nodes}
    growth = sum(n for p, n in lines.items() if p.relative_to(SOURCE).parts[0] == "growth")
    return {
        "packages": len(PACKAGES),
        "files": len(FILES),
        "lines without verification": sum(lines.values()),
        "lines of growth": growth,
        "questions for kinds": questions_for_kinds(nodes),
        "rules outside of declarations": rules_outside_of_declarations(nodes),
        "tables of dimension": tables_of_dimension(nodes),
        "test files with private imports": test_files_with_private_imports(),
    }


def test_nothing_has_grown(request):
    check(measured(), "static", request)


def check(numbers, part, request):
    """Numbers against their limits; with --ratchet the limits come down to them."""
    content = json.loads(LIMITS.read_text())
    limits = content[part]
    assert set(numbers) == set(limits)
    if request.config.getoption("--ratchet"):
        content[part] = {name: min(limit, numbers[name]) for name, limit in limits.items()}
        LIMITS.write_text(json.dumps(content, indent=2) + "\n")
    above = {name: (n, limits[name]) for name, n in numbers.items() if n > limits[name]}
    assert not above, f"number and limit: {above}"


def test_no_name_is_a_bare_word():
    assert not bare_names(product())


def test_exceptions_of_words_are_in_use():
    """A file in which a word may be a name has that name: exceptions go when names go."""
    words, exceptions = bare_words()
    assert set(exceptions) <= words
    names = {p.relative_to(SOURCE).as_posix(): {name.strip("_") for name in stored_names({p: of})}
             for p, of in product().items()}  # fmt: skip
    for word, files in exceptions.items():
        for file in files:
            assert file == "*" or word in names[file], (word, file)


def test_reasons_have_one_form():
    """Each limit that was raised says which, from what to what and why."""
    content = json.loads(LIMITS.read_text())
    names = {*content["static"], *content["ways"]}
    for entry in content["raised"]:
        assert isinstance(entry, dict), f"give name, from, to and reason: {entry}"
        assert list(entry) == ["name", "from", "to", "reason"], entry
        assert entry["name"] in names, entry
        assert entry["to"] > entry["from"], entry
        assert entry["reason"].strip(), entry


def test_no_package_hides_a_function():
    assert not set(PACKAGES) & set(xc.__all__)


# --- the way of a reader: files and functions that an operation enters ---------------------------


def way(operation):
    """Files and functions of xcrack that a call enters, compiled ones left out."""
    root, entered = str(SOURCE) + os.sep, set()

    def note(frame, event, _):
        if event == "call" and frame.f_code.co_filename.startswith(root):
            entered.add((frame.f_code.co_filename, frame.f_code.co_qualname))

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        result = operation()
    finally:
        sys.setprofile(before)
    files = {file for file, _ in entered}
    FILES_OF_LAST_WAY[:] = sorted(Path(file).relative_to(SOURCE).as_posix() for file in files)
    return result, {"files": len(files), "functions": len(entered)}


def plate():
    loads = [xc.traction("top", (0.1, 1.0)), xc.traction("bottom", (-0.1, -1.0))]
    crack = xc.line_crack([(-0.1, 0.013), (0.3, 0.013)])
    body = xc.box((0, -1), (1, 1), (10, 20))
    steel = xc.Isotropic(1.0, 0.3, "strain")
    return xc.Problem(body, steel, [crack], [xc.fix("bottom")], loads)


def block():
    loads = [xc.traction("top", (0.2, 0, 1.0)), xc.traction("bottom", (-0.2, 0, -1.0))]
    crack = xc.penny_crack(center=(0, 0, 0.04), normal=(0, 0, 1), radius=0.5)
    body = xc.box((-1, -1, -1), (1, 1, 1), 6)
    return xc.Problem(body, xc.Isotropic(1.0, 0.3), [crack], [xc.fix("bottom")], loads)


def ways():
    """Of Problem, solve, K and a growth step in 2D and 3D, when all is imported and compiled."""
    numbers = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for dim, scene, da in (("2D", plate, 0.1), ("3D", block, 0.2)):

            def steps(problem, da=da):
                law, cycle = xc.paris(1e-3, 3.0), xc.Cycle(0.0, 1.0)
                return xc.grow(problem, law, xc.max_hoop_stress, cycle, da=da, progress=False)

            run = steps(scene())
            next(run), next(run)
            problem, numbers[f"{dim} Problem"] = way(scene)
            solution, numbers[f"{dim} solve"] = way(lambda p=problem: xc.solve(p))
            _, numbers[f"{dim} K"] = way(lambda s=solution: xc.stress_intensity(s))
            run = steps(problem)
            next(run)
            _, numbers[f"{dim} growth step"] = way(lambda r=run: next(r))
    return {f"{name}: {label}": n for name, both in numbers.items() for label, n in both.items()}


@pytest.mark.slow
@pytest.mark.mission
def test_no_way_has_grown(request):
    """In an interpreter of its own: what other tests have left behind changes the ways.

    Twice where the first is above: a kernel that is compiled anew meanwhile enters its compiler.
    """
    names = ("PATH", "HOME", "PYTHONPATH", "NUMBA_CACHE_DIR", "LD_LIBRARY_PATH")
    clean = {name: os.environ[name] for name in names if name in os.environ}
    one_thread = {**clean, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    numbers, limits = {}, json.loads(LIMITS.read_text())["ways"]
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, __file__], env=one_thread, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        again = json.loads(run.stdout.splitlines()[-1])
        numbers = {name: min(n, numbers.get(name, n)) for name, n in again.items()}
        if all(n <= limits[name] for name, n in numbers.items()):
            break
    check(numbers, "ways", request)


@pytest.mark.slow
@pytest.mark.mission
def test_files_of_the_walks_are_entered():
    """Those that docs/developing.md lists; what it has in brackets is of 3D."""
    page = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (a solve|K|a growth step) \| ([^|]*) \|$", page, re.MULTILINE)
    assert [name for name, _ in rows] == ["a solve", "K", "a growth step"]
    run = subprocess.run(
        [sys.executable, __file__, "files"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    entered = json.loads(run.stdout.splitlines()[-1])
    for name, row in rows:
        files = re.findall(r"`([\w/]+\.py)`", re.sub(r"\([^)]*\)", "", row))
        assert len(files) >= 5
        assert set(files) <= set(entered[name]), name


def files_in_2d():
    """Files that a solve, K and the second step of growth enter in the plane."""
    law, cycle = xc.paris(1e-3, 3.0), xc.Cycle(0.0, 1.0)
    solution, _ = way(lambda: xc.solve(plate()))
    files = {"a solve": list(FILES_OF_LAST_WAY)}
    way(lambda: xc.stress_intensity(solution))
    files["K"] = list(FILES_OF_LAST_WAY)
    run = xc.grow(plate(), law, xc.max_hoop_stress, cycle, da=0.1, progress=False)
    next(run)
    way(lambda: next(run))
    files["a growth step"] = list(FILES_OF_LAST_WAY)
    return files


if __name__ == "__main__":
    print(json.dumps(files_in_2d() if "files" in sys.argv else ways()))
