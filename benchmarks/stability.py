"""Where crack methods fail, run on xcrack: tables, pictures and a campaign of random cracks.

    python -m benchmarks.stability                          # everything
    python -m benchmarks.stability --only infsup shapes     # some parts
    python -m benchmarks.stability --only drawn --seeds 510000:510250
    python -m benchmarks.stability --only drawn --seeds-3d 610000:610050
    python -m benchmarks.stability --only drawn --seeds 510137:510138   # one scene again

Each part adds its numbers to benchmarks/results/stability.json; seeds may be run in pieces and add
up. The scenes are those of tests/, their exact solutions those of xcrack.verification.exact.
"""

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import time
import warnings
from pathlib import Path

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "XCRACK_THREADS",
):
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
RESULTS = ROOT / "benchmarks" / "results" / "stability.json"
SEEDS, SEEDS_3D = "510000:511000", "610000:610100"

import xcrack as xc  # noqa: E402
from benchmarks import stability_cycles, stability_figures, stability_parts  # noqa: E402
from support import scenes_drawn  # noqa: E402

PARTS = {part.__name__: part for part in (*stability_parts.PARTS, stability_cycles.cycles)}


def machine() -> dict[str, object]:
    """What the numbers were made on and with."""
    import numba
    import numpy
    import scipy

    git = ["git", "-C", str(ROOT)]
    commit = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    changed = subprocess.run([*git, "status", "--short", "src"], capture_output=True, text=True)
    return {
        "commit": commit.strip(),
        "source changed since": bool(changed.stdout.strip()),
        "xcrack": xc.__version__,
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, 1 thread",
    }


def merged(part: str, numbers: dict[str, object], path: Path) -> dict[str, dict]:
    """Results with one part added, written to the file."""
    results = json.loads(path.read_text()) if path.exists() else {}
    old = results.get(part, {}) if part == "drawn" else {}
    results[part] = old | numbers
    results["made with"] = machine()
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(results, indent=1)
    # Innermost lists on one line each.
    text = re.sub(r"\[[^\[\]{}]*\]", lambda m: re.sub(r"\s*\n\s*", " ", m[0]), text)
    path.write_text(text + "\n")
    return results


def pieces(seeds: str, size: int = 50) -> list[str]:
    """A range of seeds in pieces, so that what is done is written."""
    first, last = map(int, seeds.split(":"))
    return [f"{a}:{min(a + size, last)}" for a in range(first, last, size)]


def draw(seeds: str, where: str, n: int, path: Path) -> dict[str, object]:
    """Scenes of a range of seeds, added to those that were run before, and judged together."""
    first, last = map(int, seeds.split(":"))
    before = json.loads(path.read_text()).get("drawn", {}) if path.exists() else {}
    key = f"{where}, {n} cells a side"
    errors = before.get(key, {}).get("errors", {})
    for seed in range(first, last):
        name, error, message = scenes_drawn.drawn(seed, where, n)
        errors[str(seed)] = [name, None if error is None else float(f"{error:.3e}"), message]
        if last - first < 20 or error is None:
            print(f"  seed {seed}: {name}, {message or f'{error:.2e}'}", flush=True)
    judged = scenes_drawn.judged({int(seed): entry for seed, entry in errors.items()})
    for name, row in judged["classes"].items():
        print(f"  {key}, {name}: {row['solved']} of {row['scenes']} solved, median "
              f"{row['median']:.1e}, worst {row['ratio']:.2f} times that "
              f"(seed {row['seed of the worst']})")  # fmt: skip
    print(f"  {key}: pass rate {100 * judged['pass rate']:.2f} %, failed {judged['failed']}")
    return {key: judged | {"errors": errors}}


def main() -> None:
    """Run the parts that `--only` names."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stability", description=(__doc__ or "").split("\n")[0]
    )
    names = [*PARTS, "drawn", "figures"]
    parser.add_argument("--only", nargs="*", choices=names, default=names)
    parser.add_argument("--seeds", help=f"a:b, in 2D (all: {SEEDS})")
    parser.add_argument("--seeds-3d", help=f"a:b, in 3D (all: {SEEDS_3D})")
    parser.add_argument("--cells", type=int, help="cells a side of the drawn meshes")
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    warnings.simplefilter("ignore", xc.XcrackWarning)
    for name in options.only:
        start = time.perf_counter()
        print(f"== {name}", flush=True)
        if name == "drawn":
            some = options.seeds or options.seeds_3d
            for where, seeds, all_of_them in (
                ("plane", options.seeds, SEEDS), ("space", options.seeds_3d, SEEDS_3D)
            ):  # fmt: skip
                if seeds or not some:
                    n = options.cells or scenes_drawn.CELLS[where]
                    for piece in pieces(seeds or all_of_them):
                        merged(name, draw(piece, where, n, options.results), options.results)
        elif name == "figures":
            stability_figures.draw_all(
                json.loads(options.results.read_text()), ROOT / "docs/figures"
            )
        else:
            numbers = PARTS[name]()
            merged(name, numbers, options.results)
            print(json.dumps(numbers, indent=1))
        print(f"   {time.perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
