"""The shape of the code: one-way imports, late heavy imports, documented names."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import xcrack

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "xcrack"
FILES = sorted(SOURCE.rglob("*.py"))
BELOW = ("jit", "arrays", "blas", "vectors")  # what kernels are made with
KERNELS = sorted(p for p in SOURCE.glob("*/kernels/*.py") if p.stem not in (*BELOW, "__init__"))
HEAVY = ("numba", "gmsh", "meshio", "pyvista", "vtk", "vtkmodules", "matplotlib", "pyamg")


def label(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


@pytest.mark.parametrize(
    ("code", "heavy"),
    [("xcrack", HEAVY), ("xcrack.Problem", (*HEAVY, "scipy.interpolate", "scipy.optimize"))],
)
def test_import_loads_nothing_heavy(code: str, heavy: tuple[str, ...]) -> None:
    code = f"import sys, xcrack; {code}; print([name for name in {heavy} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == "[]"


@pytest.mark.parametrize("package", ["gmsh", "meshio"])
def test_a_package_for_files_has_one_home(package: str) -> None:
    loads = re.compile(rf"(import {package}\b|require_package\(\s*[\"']{package}\b)")
    homes = {path.relative_to(SOURCE).parts[0] for path in FILES if loads.search(path.read_text())}
    assert homes == {"mesh"}


def test_layers_are_one_way() -> None:
    program = "from importlinter.cli import lint_imports_command as run; run()"
    run = subprocess.run(
        [sys.executable, "-c", program, "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    contracts = (ROOT / "pyproject.toml").read_text().count("[[tool.importlinter.contracts]]")
    assert f"{contracts} kept, 0 broken" in run.stdout


IMPORTED_IN = {
    "gmsh": {"mesh"},
    "meshio": {"mesh"},
    "pyvista": {"view"},
    "matplotlib": {"view"},
    "vtk": {"output", "view"},
    "vtkmodules": {"output", "view"},
    "pyamg": {"linalg"},
    "numba": {"kernels"},
    "llvmlite": {"kernels"},
}


def test_heavy_packages_are_not_imported_by_name_elsewhere() -> None:
    """The contracts of import-linter, for calls such as `import_module("gmsh")`."""
    calls = re.compile(r"import_module|required")
    for path in (path for path in FILES if calls.search(path.read_text(encoding="utf-8"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not node.args:
                continue
            function, name = ast.unparse(node.func).rpartition(".")[2], node.args[0]
            if function in {"import_module", "required"} and isinstance(name, ast.Constant):
                package = str(name.value).partition(".")[0]
                parts = label(path).split("/")
                folder = "kernels" if "kernels" in parts else parts[0]
                assert folder in IMPORTED_IN.get(package, {folder}), f"{package} in {label(path)}"


def imported(tree: ast.AST) -> set[str]:
    """Top names of all that a file imports; "." for a relative import."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add("." if node.level else (node.module or "").partition(".")[0])
    return names


@pytest.mark.parametrize("path", KERNELS, ids=label)
def test_kernels_know_arrays_only(path: Path) -> None:
    # not even each other: numba does not notice that a helper in another file has changed
    text = re.sub(
        r"from xcrack\.base\.kernels\.(arrays|jit|blas|vectors) import .*\n", "", path.read_text()
    )
    allowed = {"__future__", "collections", "math", "numba", "numpy", "typing"}
    assert imported(ast.parse(text)) <= allowed


@pytest.mark.parametrize("path", KERNELS, ids=label)
def test_kernels_are_compiled_in_one_way(path: Path) -> None:
    """By `kernel`, whose cache copes with folders that cannot be written to."""
    functions = [n for n in ast.parse(path.read_text()).body if isinstance(n, ast.FunctionDef)]
    for function in functions:
        assert [ast.unparse(d) for d in function.decorator_list] == ["kernel"], function.name


def documented(text: str) -> set[str]:
    """Names that a numpydoc string describes in Parameters or Attributes."""
    result: set[str] = set()
    sections = re.split(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", inspect.cleandoc(text), flags=re.MULTILINE)
    for title, body in zip(sections[1::2], sections[2::2], strict=True):
        if title in {"Parameters", "Other Parameters", "Attributes"}:
            for line in body.splitlines():
                entry = re.match(r"([*\w, ]+?)\s*(:.*)?$", line)
                if entry and not line.startswith(" "):
                    result |= {name.strip(" *") for name in entry[1].split(",")}
    return result


def test_documented_reads_numpydoc() -> None:
    text = """One sentence.

    Parameters
    ----------
    points : (n, d), length
        Where.
    a, b : float
        Half axes.
    *rest
        More.

    Returns
    -------
    value : float
    """
    assert documented(text) == {"points", "a", "b", "rest"}


@pytest.mark.parametrize("name", sorted(xcrack.__all__))
def test_public_name_is_documented(name: str) -> None:
    value = getattr(xcrack, name)
    if not callable(value):
        return
    assert inspect.getdoc(value), f"{name} has no docstring"
    if inspect.isclass(value):
        fields = getattr(value, "__dataclass_fields__", {})
        wanted = {key for key, field in fields.items() if field.init and not key.startswith("_")}
    else:
        wanted = set(inspect.signature(value).parameters)
    assert wanted <= documented(value.__doc__ or ""), f"{name}: parameters without a description"


def name_of(node: ast.AST) -> str:
    """Last word of a name or an attribute."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def questions_for_material(tree: ast.AST) -> list[str]:
    """What a file asks of a material that only some kinds know, or of its kind."""
    constants = {"E", "nu", "mu", "lam", "kolosov", "E_prime", "plane"}
    forbidden = dict.fromkeys(("isinstance", "issubclass"), "Isotropic")
    forbidden |= dict.fromkeys(("type", "hasattr", "getattr"), "material")
    result = []
    for node in ast.walk(tree):
        word = "Isotropic" if isinstance(node, ast.MatchClass) else None
        if isinstance(node, ast.Call):
            word = forbidden.get(getattr(node.func, "id", ""))
        if isinstance(node, ast.Attribute) and node.attr in constants:
            bad = name_of(node.value) == "material"
        else:
            bad = word is not None and word in map(name_of, ast.walk(node))
        if bad:
            result.append(f"{getattr(node, 'lineno', 0)}: {ast.unparse(node)}")
    return result


def test_questions_for_material_are_recognised() -> None:
    asked = (
        "problem.material.nu", "material.plane", "isinstance(m, Isotropic)", "type(material)",
        "getattr(problem.material, 'E', 1.0)", "isinstance(material, (Isotropic, Other))",
    )  # fmt: skip
    for text in asked:
        assert questions_for_material(ast.parse(text)), text
    for text in ("problem.material.at_tip().nu", "tip_material.E", "isinstance(material, Material)",
                 "solution.E", "material.tensor(2)"):  # fmt: skip
        assert not questions_for_material(ast.parse(text)), text


def test_materials_answer_for_themselves() -> None:
    """Constants are those of the material at a tip; nobody asks for a kind of material."""
    texts = {path: path.read_text(encoding="utf-8") for path in FILES}
    bad = [
        f"{label(path)}:{question}"
        for path, text in texts.items()
        if label(path) != "model/material.py" and re.search(r"Isotropic|\bmaterial\b", text)
        for question in questions_for_material(ast.parse(text))
    ]
    assert not bad, "\n".join(bad)


def test_options_of_growth_stand_once() -> None:
    """Both signatures list the same ones with the same defaults, and neither function's code."""

    def listed(function: Callable[..., object]) -> tuple[dict[str, object], set[str]]:
        tree = ast.parse(inspect.getsource(function))
        own = tree.body[0].args  # type: ignore[attr-defined]
        names = {a.arg for a in [*own.args, *own.kwonlyargs]}
        shown = inspect.signature(function).parameters
        more = {name: p for name, p in shown.items() if name not in names}
        assert all(p.kind is inspect.Parameter.KEYWORD_ONLY for p in more.values())
        return {name: p.default for name, p in more.items()}, names

    (options, of_grow), (same, of_resume) = map(listed, (xcrack.grow, xcrack.resume))
    assert options == same
    assert {"tolerance", "response", "integrator", "max_steps", "solver"} <= set(options)
    assert not (of_grow | of_resume) & set(options)


def test_help_shows_names_and_defaults_and_leaves_types_to_the_docstring() -> None:
    assert str(inspect.signature(xcrack.penny_crack)) == "(center, normal, radius, *, n=128)"
    assert str(inspect.signature(xcrack.grow)).startswith(
        "(problem, law, criterion, cycle, da=None, *, tolerance=None, max_unknowns=None,"
    )


@pytest.mark.parametrize("name", ["grow", "resume", "run"])
def test_an_unknown_option_is_refused_by_the_name_of_the_function(name: str) -> None:
    positional = {"grow": [None] * 4, "resume": [None] * 5, "run": ["case.toml"]}[name]
    with pytest.raises(TypeError, match=rf"^{name}\(\) got an unexpected keyword argument 'dA'$"):
        getattr(xcrack, name)(*positional, dA=1.0)


def test_variables_are_not_named_by_an_adjective_alone() -> None:
    """In the product: a mask is `is_of_crack`, a length aimed at `target`, the names `names`."""
    bare = {"own", "wanted", "asked", "seen", "settled"}
    public = SOURCE / "verification" / "charting"  # `wanted` is an argument of `xc.chart`
    bad = [
        f"{path.relative_to(SOURCE)}:{node.lineno}: {name}"
        for path in sorted(SOURCE.rglob("*.py"))
        if public not in path.parents
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Name | ast.arg)
        for name in [node.id if isinstance(node, ast.Name) else node.arg]
        if name.strip("_") in bare
    ]
    assert not bad, "\n".join(bad)


def test_no_variable_has_a_name_that_says_nothing() -> None:
    """What a name holds is in it: a message, a result, a support; not that it was found or kept."""
    vague = {"said", "told", "found", "kept", "held"}
    # A name that is bound is followed by one of these; files without one are not worth a tree.
    bound = re.compile(rf"\b(\w*_)?({'|'.join(vague)})(_\w*)?\s*([-+*/|&^%@]?=[^=]|[:,()\]]|in\b)")
    bad = []
    for folder in ("src", "tests", "benchmarks", "examples", "scripts"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            for node in ast.walk(ast.parse(text)) if bound.search(text) else ():
                name = ""
                if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                    name = node.id if isinstance(node, ast.Name) else node.attr
                elif isinstance(node, ast.arg):
                    name = node.arg
                elif isinstance(node, ast.FunctionDef | ast.ClassDef):
                    name = node.name
                elif isinstance(node, ast.ExceptHandler):
                    name = node.name or ""
                if vague & set(name.strip("_").split("_")):
                    bad.append(f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}: {name}")
    assert not bad, "\n".join(bad)
