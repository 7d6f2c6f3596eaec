"""The package as others get it: what wheel and sdist hold, oldest versions, entry points."""

import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))


def test_lower_bounds_are_those_of_the_project():
    import lower_bounds

    out = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "lower_bounds.py")],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert "numpy==1.26" in out
    assert "scipy==1.12" in out  # cg(rtol=) came with it
    assert lower_bounds.bounds(["a>=1.2; python_version > '3'", "b"]) == ["a==1.2"]


def test_links_of_a_release_are_absolute():
    import absolute_links

    address = "https://example.org/owner/xcrack"
    text = absolute_links.absolute((ROOT / "README.md").read_text("utf-8"), address, "v1.0")
    links = re.findall(r"(!?)\[[^\]]*\]\(([^)\s]+)\)", text)
    assert len(links) > 8
    for mark, link in links:
        assert link.startswith(f"{address}/{'raw' if mark else 'blob'}/v1.0/")
        assert (ROOT / link.split("/v1.0/")[1].partition("#")[0]).exists()
    project = absolute_links.with_addresses(
        (ROOT / "pyproject.toml").read_text("utf-8"), address, "v1.0"
    )
    assert tomllib.loads(project)["project"]["urls"]["Repository"] == address


def test_workflows_ask_for_what_there_is():
    text = (ROOT / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")
    for name in ("scripts/lower_bounds.py", ".ci/run", "tests/kernels"):
        assert name in text
        assert (ROOT / name).exists()


def new_setuptools():
    try:
        return int(version("setuptools").partition(".")[0]) >= 77
    except PackageNotFoundError:
        return False


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder with an sdist and a wheel, made by setuptools from a copy of the files in git."""
    if not (ROOT / ".git").exists() or not new_setuptools():
        pytest.skip("distribution not available: no clone, or no setuptools of 77 or later")
    folder = tmp_path_factory.mktemp("dist")
    source = folder / "source"
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True)
    for name in filter(None, files.stdout.decode().split("\0")):
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((ROOT / name).read_bytes())
    code = (
        "import setuptools.build_meta as b, sys; to = sys.argv[1]; b.build_sdist(to); "
        "b.build_wheel(to)"
    )
    run = subprocess.run([sys.executable, "-c", code, str(folder)], cwd=source,
                         capture_output=True, text=True, check=False)  # fmt: skip
    assert run.returncode == 0, run.stderr[-2000:]
    return folder


@pytest.mark.slow
@pytest.mark.mission
def test_wheel_holds_the_package_and_nothing_else(built):
    (wheel,) = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"xcrack"}
    assert "xcrack/data/plate_with_hole.msh" in names
    assert "xcrack/py.typed" in names
    entry = next(name for name in names if name.endswith("entry_points.txt"))
    assert "xcrack = xcrack.app.main:main" in zipfile.ZipFile(wheel).read(entry).decode()


@pytest.mark.slow
@pytest.mark.mission
def test_sdist_tests_itself(built, tmp_path):
    """Unpacked elsewhere, its own tests are collected, and a part of them passes."""
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as content:
        content.extractall(tmp_path, filter="data")
    (folder,) = tmp_path.iterdir()
    for name in ("tests/conftest.py", "tests/data/plate_41.msh", "tests/support/exact.py",
                 "examples/meshes/edge_crack.msh", "docs/guide.md", "benchmarks/__main__.py",
                 "Makefile", "CHANGELOG.md", "CITATION.cff", ".ci/run"):  # fmt: skip
        assert (folder / name).is_file(), name
    environment = {**os.environ, "PYTHONPATH": str(folder / "src")}

    def run(*options):
        return subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider",
                               *options], cwd=folder, env=environment, capture_output=True,
                              text=True, check=False)  # fmt: skip

    collected = run("--collect-only", "-m", "slow or not slow")
    assert collected.returncode == 0, collected.stdout[-2000:]
    tested = run("tests/package/test_namespace.py", "tests/mesh/test_files.py",
                 "tests/pages/test_pages.py", "tests/verification")  # fmt: skip
    assert tested.returncode == 0, tested.stdout[-3000:]
