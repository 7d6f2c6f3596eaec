"""What accuracy costs: processor time and energy to an error, from what is stored.

    python -m benchmarks.accuracy

Writes the table of docs/economy.md from ``benchmarks/results``: time of the defaults, and that of a
tolerance and of other methods over it, at the same error, interpolated along their fronts; where an
error changes its sign the largest error on any finer mesh counts. The tuned conforming method has
the best of all its meshes for each error, over the defaults of its own run.
"""

import json
from collections.abc import Sequence
from math import exp, inf, log
from pathlib import Path
from typing import Any

from benchmarks.pareto import points_of, settled, time_at
from benchmarks.tuned import reached

RESULTS = Path(__file__).parent / "results"
PAGE = Path(__file__).parents[1] / "docs" / "economy.md"
BEGIN, END = "<!-- accuracy -->\n", "<!-- /accuracy -->"
# Watt of a busy core: 360 W, the design power of a processor of this family, over its 96 cores.
WATT = 3.75

# File of the chart, its scene, name of the error, errors, and file of the tuned opponent.
CHARTS: tuple[tuple[str, str, str, tuple[float, ...], str], ...] = (
    ("edge", "edge crack, K", "K", (1e-3, 1e-4, 1e-5), "tuned"),
    ("edge", "edge crack, energy norm", "energy", (2e-2, 5e-3), ""),
    ("half_closed", "a third closed, K_I", "K_I", (1e-3, 1e-4), ""),
    ("closed", "closed edge crack, K_II", "K_II", (1e-4,), ""),
    ("growth", "15 steps, tip", "tip", (1e-2, 5e-3), ""),
    ("life", "life of a plate", "life", (1e-2, 1e-3), ""),
    ("penny", "penny, K_I by rms", "rms", (1e-2, 5e-3, 3e-3), "tuned_penny"),
)
SERIES = {
    "tolerance": ("adapt",),
    "remeshed": ("conforming, remeshed", "conforming, remeshed, finer"),
    "GetFEM": ("GetFEM XFEM, Q1", "GetFEM XFEM, Q2"),
}


def _stored(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def seconds(
    rows: Sequence[dict[str, Any]], names: Sequence[str], error: str, level: float
) -> float:
    """Least processor time of some series at an error; infinite where none reaches it."""
    times = []
    for name in names:
        points = points_of([row for row in rows if row["series"] == name], error, "processor")
        times.append(time_at(settled(points), level) if points else inf)
    return min(times)


def _tuned(stored: dict[str, list[dict[str, Any]]], level: float) -> float:
    """Time of the best of all meshes over that of the defaults in the same run."""
    ours, best_mesh = (
        reached(stored["xcrack"], level, True),
        reached(stored["conforming"], level, False),
    )
    return best_mesh["time"] / ours["time"] if ours and best_mesh else inf


def _times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < inf else "–"


def table() -> str:
    """Lines of the table."""
    lines = [
        "| scene, error of | to | defaults | energy | tolerance | conforming, remeshed "
        "| the same, tuned | GetFEM |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for file, scene, error, levels, tuned in CHARTS:
        rows = _stored(file)["rows"]
        for level in levels:
            own = seconds(rows, ("default",), error, level)
            one, two, three = (
                _times(seconds(rows, names, error, level) / own) for names in SERIES.values()
            )
            four = _times(_tuned(_stored(tuned), level) if tuned else inf)
            lines.append(
                f"| {scene} | {100 * level:g} % | {own:.2g} s | {WATT * own:.2g} J "
                f"| {one} | {two} | {four} | {three} |"
            )
    for tolerance in (3e-2, 1e-2, 3e-3):
        rows = [r for r in _stored("wanted_error") if r["tolerance"] == tolerance and r["fixed"]]
        ratios = [row["seconds"] / row["fixed"] for row in rows]
        fixed, own = (
            exp(sum(log(row[name]) for row in rows) / len(rows)) for name in ("fixed", "seconds")
        )
        lines.append(
            f"| growth, {len(rows)} scenes, life and path | {100 * tolerance:g} % | {fixed:.2g} s "
            f"(cheapest setting) | {WATT * fixed:.2g} J | {own / fixed:.2g}, worst "
            f"{max(ratios):.2g} | – | – | – |"
        )
    return "\n".join(lines)


def main() -> None:
    """Write the table into the page."""
    before, start, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    PAGE.write_text(f"{before}{start}{table()}\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
