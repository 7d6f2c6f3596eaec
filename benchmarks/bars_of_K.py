"""Do the error bars of K hold, and are they short? Random scenes with known K.

    python benchmarks/bars_of_K.py                   # fresh seeds, and the table
    python benchmarks/bars_of_K.py --seeds 0:0       # the table of what is stored

Scenes are those of tests/support/scenes_of_bars.py. The coefficients were fitted to other seeds:
40000 to 40254 of these scenes, and 20000 to 20360 of those of `benchmarks.drawn` in the plane.
Results add up in benchmarks/results/bars_of_K.json, seed by seed: a run that was stopped goes on.
"""

import argparse
import json
import os
import sys
import time
import warnings
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))
RESULTS = ROOT / "benchmarks" / "results" / "bars_of_K.json"

import numpy as np  # noqa: E402

from support import scenes_of_bars  # noqa: E402
from xcrack import XcrackWarning  # noqa: E402

LONG = 10.0  # a bar as many times the error is too long


def run(seeds: range, path: Path) -> None:
    """Add the outcome of seeds that the file does not have yet."""
    stored = read(path)
    last = time.monotonic()
    for seed in seeds:
        if str(seed) in stored:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", XcrackWarning)
            stored[str(seed)] = short(scenes_of_bars.outcome(seed))
        if time.monotonic() - last > 20:
            write(path, stored)
            last = time.monotonic()
    write(path, stored)


def short(value: Any) -> Any:
    """Numbers of a few digits, nan as null."""
    if isinstance(value, dict):
        return {k: v if k == "known" else short(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [short(v) for v in value]
    if isinstance(value, float):
        return None if np.isnan(value) else float(f"{value:.4g}")
    return value


def read(path: Path) -> dict:
    """Stored outcomes by seed."""
    return json.loads(path.read_text()) if path.exists() else {}


def write(path: Path, stored: dict) -> None:
    """One line a seed."""
    ordered = sorted(stored.items(), key=lambda item: int(item[0]))
    lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in ordered)
    path.write_text("{\n" + lines + "\n}\n")


def ratios(row: dict) -> tuple[list[float], int]:
    """Error over bar of each component that has one, and the number of tips without."""
    error, bar = (np.array(row[k], dtype=float) for k in ("error", "bar"))
    without = np.isnan(bar).any(axis=1)
    ratio = (error / bar)[~without]
    return list(ratio[np.isfinite(ratio)]), int(without.sum())


def summary(rows: list[dict]) -> dict:
    """How often bars hold and are short, and how many tips have none."""
    every = [ratios(row) for row in rows]
    flat = np.array([r for part, _ in every for r in part])
    worst = np.array([max(part) for part, _ in every if part])
    tips = sum(len(row["bar"]) for row in rows)
    gain = [
        np.nanmax(np.array(row["error"], dtype=float)) / np.max(row["K"])
        for row, (part, _) in zip(rows, every, strict=True)
        if part
    ]
    return {
        "scenes": len(rows),
        "components": float(np.mean(flat <= 1)),
        "scenes that hold": float(np.mean(worst <= 1)),
        "within ten": float(np.mean(worst >= 1 / LONG)),
        "without": sum(w for _, w in every) / tips,
        "gain": float(np.median(gain)),
    }


def table(stored: dict) -> str:
    """A row a kind, and all."""
    rows = [row for row in stored.values() if "error" in row]
    kinds = sorted({row["kind"] for row in rows})
    lines = [
        "| kind | scenes | bar holds, components | whole scenes | within 10 times | tips without | "
        "error of best over that of K |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind in [*kinds, "all"]:
        of_kind = [row for row in rows if kind in ("all", row["kind"])]
        if not any(ratios(row)[0] for row in of_kind):
            lines.append(f"| {kind.replace('_', ' ')} | {len(of_kind)} | – | – | – | 100 % | – |")
            continue
        s = summary(of_kind)
        lines.append(
            f"| {kind.replace('_', ' ')} | {s['scenes']} | {100 * s['components']:.0f} % | "
            f"{100 * s['scenes that hold']:.0f} % | {100 * s['within ten']:.0f} % | "
            f"{100 * s['without']:.0f} % | {s['gain']:.2f} |"
        )
    refused = len(stored) - len(rows)
    return "\n".join([*lines, "", f"{refused} seeds gave no scene or no reference."])


def main() -> None:
    """Run seeds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="50000:50255")
    parser.add_argument("--file", type=Path, default=RESULTS)
    options = parser.parse_args()
    first, last = (int(part) for part in options.seeds.split(":"))
    run(range(first, last), options.file)
    print(table(read(options.file)))


if __name__ == "__main__":
    main()
