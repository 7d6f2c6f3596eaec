"""`python -m benchmarks [--quick] [scene ...]`: measure, save, draw and print who is ahead."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

# Scene -> names of errors -> errors at which times are compared.
_WANTED: dict[str, dict[str, tuple[float, ...]]] = {
    "edge": {"K": (1e-3, 2e-4, 1e-4, 1e-5), "energy": (2e-2, 5e-3, 2e-3)},
    "half_closed": {"K_I": (1e-3, 2e-4)},
    "closed": {"K_II": (1e-4,)},
    "hole": {"pressure": (2e-2, 1e-2, 5e-3)},
    "growth": {"tip": (1e-2, 5e-3), "path": (2e-2, 1.3e-2)},
    "life": {"life": (1e-2, 3e-3, 1e-3)},
    "penny": {"K_I": (3e-2, 1e-2, 3e-3)},
    "penny_closed": {"K_II, K_III": (3e-2,)},
    "cylinder": {"K_I": (1e-2, 6e-3)},
    "rubbing": {"K_II": (1e-2, 1e-3, 1e-4)},
    "unloading": {"K_II": (1e-2, 1e-3, 1e-4)},
}
_OLD_KINDS = {"opponent": "baseline"}  # words of records that were measured before


def main(arguments: list[str] | None = None) -> int:
    """Run scenes of the charts.

    Parameters
    ----------
    arguments : list of str, optional
        Those of the command line where they are left out.

    Returns
    -------
    int
        0; argparse ends the process on options that do not exist.
    """
    # One thread a solve, as in a growth run beside others; set before numpy is loaded.
    for name in (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "XCRACK_THREADS",
    ):
        os.environ.setdefault(name, "1")
    from benchmarks import charts, runs
    from benchmarks.baselines import conforming_2d, getfem_runs
    from benchmarks.suites import cases

    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("scenes", nargs="*", help=f"of {', '.join(cases.ALL)}")
    parser.add_argument("--quick", action="store_true", help="few points, under a minute")
    parser.add_argument("--repeats", type=int, default=3, help="rounds that count (3)")
    parser.add_argument("--draw", action="store_true", help="only draw what --out holds")
    parser.add_argument("--out", type=Path, default=Path("out/bench/results"))
    parser.add_argument("--figures", type=Path, default=Path("out/bench/figures"))
    options = parser.parse_args(arguments)
    unknown = set(options.scenes) - set(cases.ALL)
    if unknown:
        parser.error(f"no scene {', '.join(sorted(unknown))}: of {', '.join(cases.ALL)}")
    for reason in (conforming_2d.missing(), getfem_runs.missing()):
        if reason:
            print(reason, file=sys.stderr)
    for scene in options.scenes or cases.names(options.quick):
        if options.draw:
            record = _read(options.out / f"{scene}.json")
        else:
            before = runs.machine()
            rows = runs.measure(
                cases.cases(scene, options.quick), options.repeats,
                lambda message: print(message, file=sys.stderr),
            )  # fmt: skip
            after = runs.machine()
            busiest = max(before, after, key=lambda m: m["load"][:1])
            getfem = getfem_runs.installed()
            busiest["versions"]["GetFEM"] = getfem and getfem.version
            record = {
                "scene": scene, "quick": options.quick, "clock": runs.clock(busiest),
                "repeats": options.repeats, "machine": busiest, "rows": rows,
            }  # fmt: skip
            runs.save(options.out, scene, record)
        _print_ratios(record)
        for path in charts.draw(record, options.figures):
            print(f"  {path}")
    return 0


def _read(path: Path) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    for row in record["rows"]:
        row["kind"] = _OLD_KINDS.get(row["kind"], row["kind"])
    return record


def _print_ratios(record: dict[str, Any]) -> None:
    """A table of ratios: the default settings against the rest."""
    from benchmarks.pareto import behind

    rows, clock = record["rows"], record["clock"]
    print(f"{record['scene']}: time of the default settings ({clock}) over that of others")
    pairs = [(name, e) for name, some in _WANTED[record["scene"]].items() for e in some]
    for name, error in pairs:
        ratios = []
        for some, kind in _groups(rows):
            ratio, ahead = behind(some, name, clock, (kind,), error)
            if ahead:
                ratios.append(f"{ratio:.2f} of {ahead}")
        print(f"  {name} to {error:g}: {'; '.join(ratios) or 'no other reaches it'}")
    off = {r["size"]: r for r in rows if r["kind"] == "off"}
    both = [(r, off[r["size"]]) for r in rows if r["kind"] == "default" and r["size"] in off]
    if both:
        costs = [f"{a[clock] / b[clock]:.2f} at {a['unknowns']}" for a, b in both]
        print(f"  contact over none: {', '.join(costs)} unknowns")


def _groups(rows: list[dict[str, Any]]) -> list[tuple[list[dict[str, Any]], str]]:
    """Rows to compare the default settings with, by their kind; each baseline by itself."""
    groups = [(rows, kind) for kind in ("setting", "mesh", "steps")]
    codes = dict.fromkeys(r["series"].split()[0] for r in rows if r["kind"] == "baseline")
    for code in codes:
        some = [r for r in rows if r["kind"] == "default" or r["series"].split()[0] == code]
        groups.append((some, "baseline"))
    return groups


if __name__ == "__main__":
    sys.exit(main())
