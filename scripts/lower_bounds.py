"""Print the oldest versions that `pyproject.toml` allows, as constraints for pip.

python scripts/lower_bounds.py > oldest.txt
python -m pip install -c oldest.txt -e ".[test]"
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_BOUND = re.compile(r"([A-Za-z0-9_.-]+)\s*>=\s*([0-9][0-9.]*)")


def bounds(requirements: list[str]) -> list[str]:
    """Constraints ``name==version`` of requirements that have a lower bound."""
    matches = [_BOUND.match(requirement) for requirement in requirements]
    return [f"{match[1]}=={match[2]}" for match in matches if match]


def main() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    print("\n".join(bounds(project["dependencies"])))


if __name__ == "__main__":
    main()
