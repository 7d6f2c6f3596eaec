"""The bootstrap finds missing libraries, says how to get them, and does without ensurepip."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
APT_LINE = (
    "apt-get install -y --no-install-recommends libglu1-mesa libgl1 libegl1 libgl1-mesa-dri "
    "libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1 libxinerama1 libgomp1"
)


@pytest.fixture
def bootstrap() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bootstrap", ROOT / "scripts" / "bootstrap.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the probe is for linux")
def test_probe_names_the_missing_library_and_only_that(bootstrap: ModuleType) -> None:
    missing = bootstrap.missing_libraries(Path(sys.executable), ["libc.so.6", "libno-such.so.7"])
    assert missing == ["libno-such.so.7"]


def test_without_rights_the_line_is_printed_and_the_work_goes_on(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap, "missing_libraries", lambda _: ["libGLU.so.1", "libXft.so.2"])
    monkeypatch.setattr(bootstrap, "may_install", lambda: False)
    assert bootstrap.check_libraries(Path(sys.executable)) == ["libGLU.so.1", "libXft.so.2"]
    lines = capsys.readouterr().out.splitlines()
    assert "libGLU.so.1, libXft.so.2" in lines[0]
    assert lines[-1].strip() == APT_LINE


def test_with_rights_the_lists_are_read_once_and_the_packages_installed(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = iter([["libGL.so.1"], []])
    commands: list[list[str]] = []

    def record(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(bootstrap, "missing_libraries", lambda _: next(answers))
    monkeypatch.setattr(bootstrap, "may_install", lambda: True)
    monkeypatch.setattr(bootstrap.subprocess, "run", record)
    assert bootstrap.check_libraries(Path(sys.executable)) == []
    assert [command[:2] for command in commands] == [["apt-get", "update"], ["apt-get", "install"]]
    assert set(APT_LINE.split()) <= set(commands[1])


def test_nothing_is_installed_where_nothing_is_missing(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap, "missing_libraries", lambda _: [])
    monkeypatch.setattr(bootstrap, "install_libraries", lambda: pytest.fail("installs"))
    assert bootstrap.check_libraries(Path(sys.executable)) == []
    assert capsys.readouterr().out == ""


def test_each_library_has_its_package_in_the_line(bootstrap: ModuleType) -> None:
    assert bootstrap.APT_INSTALL == APT_LINE
    assert set(bootstrap.LIBRARY_TO_PACKAGE.values()) <= set(APT_LINE.split())


def test_environment_is_made_without_ensurepip(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(bootstrap, "has_ensurepip", lambda: False)
    python = bootstrap.make_environment(tmp_path / "env")
    assert bootstrap.runs([python, "-c", "import sys; assert sys.prefix != sys.base_prefix"])
    assert not bootstrap.runs([python, "-m", "pip", "--version"])
    pip = bootstrap.pip_of(python)
    assert pip == [sys.executable, "-m", "pip", "--python", str(python)]
    # that pip works on the new environment: it sees nothing installed there
    listed = subprocess.run([*pip, "list"], capture_output=True, text=True, check=False)
    if "No module named pip" in listed.stderr:
        pytest.skip("the tests' own environment has no pip to lend")
    assert listed.returncode == 0
    assert "numpy" not in listed.stdout


def test_broken_environment_is_made_anew(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(bootstrap, "has_ensurepip", lambda: False)
    (tmp_path / "env" / "bin").mkdir(parents=True)
    (tmp_path / "env" / "bin" / "python").write_text("not an interpreter")
    python = bootstrap.make_environment(tmp_path / "env")
    assert bootstrap.runs([python, "-c", "import sys"])
    before = python.stat().st_ino
    assert bootstrap.make_environment(tmp_path / "env").stat().st_ino == before
