"""Do the warnings of K fire where K is wrong? Random scenes with known K, for one code or several.

    python benchmarks/warnings_of_K.py                         # the code that is imported
    PYTHONPATH=<old>/src:<old>/tests python benchmarks/warnings_of_K.py --label 0fd7707
    python benchmarks/warnings_of_K.py --seeds 0:0             # tables of what is stored

Scenes are those of tests/support/scenes_of_K.py. Results of each label add up in
benchmarks/results/warnings_of_K.json, seed by seed: a run that was stopped goes on. References are
stored with the first label that needed them.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "XCRACK_THREADS",
):
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))  # after those of another checkout
RESULTS = ROOT / "benchmarks" / "results" / "warnings_of_K.json"
LIMITS = (0.01, 0.05)
CLASSES = ("below 1 %", "1 % to 5 %", "above 5 %")

from support import outcomes_of_K, scenes_of_K  # noqa: E402

REFERENCED = {kind.__name__ for kind in scenes_of_K.REFERENCED}


def run(label: str, seeds: range, path: Path) -> None:
    """Add the outcome of seeds that the file does not have yet."""
    stored = read(path)
    known, rows = stored["known"], stored["labels"].setdefault(label, {})
    last = time.monotonic()
    for seed in seeds:
        key = str(seed)
        if key in rows:
            continue
        result = outcomes_of_K.outcome(seed, known.get(key))
        reference = result.pop("known", None)
        if reference is not None and result["kind"] in REFERENCED:
            known[key] = [[[short(v, 9) for v in row] for row in part] for part in reference]
        if "error" in result:
            result["error"] = short(result["error"])
        rows[key] = result
        if time.monotonic() - last > 60:
            write(path, stored)
            last = time.monotonic()
    write(path, stored)


def short(value: float, digits: int = 4) -> float:
    """A number of a few digits."""
    return float(f"{value:.{digits}g}")


def read(path: Path) -> dict:
    """Results so far: K of references by seed, and rows by label and seed."""
    if not path.exists():
        return {"known": {}, "labels": {}}
    return json.loads(path.read_text(encoding="utf-8"))


def write(path: Path, stored: dict) -> None:
    """Store results, a seed a line."""
    path.parent.mkdir(exist_ok=True)
    part = path.with_suffix(".part")
    lines = [
        f'"{label}": {{\n'
        + ",\n".join(f'"{seed}": {json.dumps(row)}' for seed, row in rows.items())
        + "\n}"
        for label, rows in stored["labels"].items()
    ]
    known = ",\n".join(f'"{seed}": {json.dumps(row)}' for seed, row in stored["known"].items())
    text = '{"known": {\n' + known + '\n},\n"labels": {\n' + ",\n".join(lines) + "\n}}\n"
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def class_of(error: float) -> int:
    """Number of the class of an error."""
    return sum(error >= limit for limit in LIMITS)


def table(stored: dict, label: str, errors_of: str, order: int | None = None) -> str:
    """Scenes in which each warning of one label fires, by the errors of another."""
    rows, judges = stored["labels"][label], stored["labels"][errors_of]
    both = [s for s in rows if "error" in rows[s] and "error" in judges.get(s, {})]
    both = [s for s in both if order in (None, rows[s].get("order"))]
    lines = [
        f"warnings of {label}, by the errors of {errors_of} ({len(both)} scenes"
        + (")" if order is None else f" of order {order})")
    ]
    lines.append(f"{'':22}" + "".join(f"{name:>20}" for name in CLASSES))
    for word in (*outcomes_of_K.WARNINGS, "any"):
        cells = ""
        for number in range(len(CLASSES)):
            inside = [s for s in both if class_of(judges[s]["error"]) == number]
            fired = sum(
                bool(rows[s]["warned"]) if word == "any" else word in rows[s]["warned"]
                for s in inside
            )
            share = f"{100 * fired / max(len(inside), 1):.0f} %"
            cells += f"{f'{fired} of {len(inside)} = {share}':>20}"
        lines.append(f"{word:22}{cells}")
    return "\n".join(lines)


def main() -> None:
    """Run what is missing, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--label", default="now")
    parser.add_argument("--seeds", default="20000:21500", help="first:last")
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    first, last = map(int, options.seeds.split(":"))
    run(options.label, range(first, last), options.results)
    stored = read(options.results)
    for label in stored["labels"]:
        print(table(stored, label, label), end="\n\n")
        for order in (1, 2):
            print(table(stored, label, label, order), end="\n\n")
        for other in stored["labels"]:
            if other != label:
                print(table(stored, label, other), end="\n\n")


if __name__ == "__main__":
    main()
