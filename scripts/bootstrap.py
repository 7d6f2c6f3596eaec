"""Make `.venv`, install xcrack into it, and see to the system libraries of gmsh and VTK.

Needs python 3.11 or newer and pip, nothing else: `python3 scripts/bootstrap.py` from any folder.
A second run with an unchanged `pyproject.toml` only looks for the libraries.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIBRARY_TO_PACKAGE = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1",
    "libXfixes.so.3": "libxfixes3",
    "libXext.so.6": "libxext6",
    "libXft.so.2": "libxft2",
    "libfontconfig.so.1": "libfontconfig1",
    "libXinerama.so.1": "libxinerama1",
    "libgomp.so.1": "libgomp1",
}
APT_INSTALL = (
    "apt-get install -y --no-install-recommends libglu1-mesa libgl1 libegl1 libgl1-mesa-dri "
    "libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1 libxinerama1 libgomp1"
)
PROBE = """
import ctypes, json, sys
missing = []
for name in sys.argv[1:]:
    try:
        ctypes.CDLL(name)
    except OSError:
        missing.append(name)
print(json.dumps(missing))
"""


def say(text: str) -> None:
    """Print one line of progress at once, also into a pipe."""
    print(f"[xcrack] {text}", flush=True)


def has_ensurepip() -> bool:
    """Whether this python can put pip into a new environment (Debian splits that part off)."""
    return importlib.util.find_spec("ensurepip") is not None


def python_of(environment: Path) -> Path:
    """Path of the interpreter of an environment."""
    windows = environment / "Scripts" / "python.exe"
    return windows if os.name == "nt" else environment / "bin" / "python"


def runs(command: Sequence[str | Path]) -> bool:
    """Whether a command ends well; its output is dropped."""
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def make_environment(environment: Path) -> Path:
    """Make the virtual environment unless a working one is there; return its interpreter."""
    python = python_of(environment)
    if runs([python, "-c", "import sys"]):
        return python
    if environment.exists():
        say(f"{environment} does not work (moved or half made): made anew")
        shutil.rmtree(environment)
    venv = [sys.executable, "-m", "venv"]
    if has_ensurepip():
        say(f"making {environment}")
        if subprocess.run([*venv, str(environment)], check=False).returncode == 0:
            return python
        shutil.rmtree(environment, ignore_errors=True)  # ensurepip is there, its wheels are not
    say(f"making {environment} without pip (this python lacks ensurepip); the system's pip serves")
    subprocess.run([*venv, "--without-pip", str(environment)], check=True)
    return python


def pip_of(python: Path) -> list[str]:
    """Command that is pip for an environment: its own, else the one of this python."""
    if runs([python, "-m", "pip", "--version"]):
        return [str(python), "-m", "pip"]
    return [sys.executable, "-m", "pip", "--python", str(python)]


def install(environment: Path, python: Path, extras: str) -> None:
    """Install the project (editable) with extras, unless that was done from the same pyproject."""
    stamp = environment / "xcrack-installed"
    key = hashlib.sha256((ROOT / "pyproject.toml").read_bytes() + extras.encode()).hexdigest()
    if stamp.exists() and stamp.read_text() == key:
        return
    say(f"installing xcrack[{extras}] into {environment}")
    target = f"{ROOT}[{extras}]"
    options = ["install", "--quiet", "--disable-pip-version-check", "-e", target]
    subprocess.run([*pip_of(python), *options], check=True)
    stamp.write_text(key)


def missing_libraries(
    python: Path, libraries: Sequence[str] = tuple(LIBRARY_TO_PACKAGE)
) -> list[str]:
    """Shared libraries of the system that the environment's python cannot load."""
    if not sys.platform.startswith("linux"):
        return []  # the wheels of the other systems bring their own
    command = [str(python), "-c", PROBE, *libraries]
    answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    missing: list[str] = json.loads(answer)
    return missing


def may_install() -> bool:
    """Whether system packages can be installed here: root, on a system with apt-get."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return root and shutil.which("apt-get") is not None and os.environ.get("XCRACK_APT") != "0"


def install_libraries() -> bool:
    """Install the system libraries by apt-get; whether that went well."""
    environ = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in ("apt-get update", APT_INSTALL):
        say(command)
        words = [*command.split(), "-qq"]
        if subprocess.run(words, env=environ, stdout=subprocess.DEVNULL, check=False).returncode:
            return False
    return True


def check_libraries(python: Path) -> list[str]:
    """Install missing system libraries or say how; return those that are missing in the end.

    Nothing stops here: without them there are stored meshes and matplotlib's pictures.
    """
    missing = missing_libraries(python)
    if missing and may_install():
        say(f"missing for gmsh and VTK: {', '.join(missing)}; installing them")
        install_libraries()
        missing = missing_libraries(python)
    if missing:
        say(f"missing for gmsh and VTK: {', '.join(missing)}")
        say("going on with stored meshes and plain pictures; this line, as root, brings the rest:")
        print(f"  {APT_INSTALL}", flush=True)
    return missing


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the three steps; the exit code is that of the first that failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--environment", type=Path, default=ROOT / ".venv")
    parser.add_argument("--extras", default="test")
    options = parser.parse_args(arguments)
    if sys.version_info < (3, 11):  # noqa: UP036 - whatever python3 the machine has runs this
        say(f"python 3.11 or newer is needed, this is {sys.version.split()[0]} ({sys.executable});")
        say("name another one: make PYTHON=python3.12 test")
        return 1
    environment = options.environment.absolute()
    try:
        python = make_environment(environment)
        install(environment, python, options.extras)
    except subprocess.CalledProcessError as error:
        say(f"failed ({error.returncode}): {' '.join(map(str, error.cmd))}")
        return 1
    check_libraries(python)
    return 0


if __name__ == "__main__":
    sys.exit(main())
