"""Ten thousand drawn cracks: run them as a campaign, and draw the page about them.

    python -m benchmarks.drawn                              # all of them, in this process
    python -m benchmarks.drawn --workers 16                 # or in sixteen
    python -m benchmarks.drawn --plane 0:1000 --space 0:100 # the first ones
    python -m benchmarks.drawn --plane 0:0 --space 0:0      # the page of what is stored

Scenes are those of tests/support/drawn_cracks.py and, of cracks that meet in space,
drawn_pairs.py. Finished scenes are files in --folder: a run that
was stopped goes on. Short rows add up in benchmarks/results/drawn.json, and docs/drawn.md with its
picture is written from them.
"""

import argparse
import json
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))
RESULTS = ROOT / "benchmarks" / "results" / "drawn.json"
PAGE = ROOT / "docs" / "drawn.md"
PICTURE = "drawn_worst.png"
WANTED = {"plane": 8500, "space": 1500, "pairs": 100, "growing": 30}
SECONDS = 120.0  # a scene that takes longer is a fault
OFF = 0.05  # share of the largest K from which on a scene is a bad one
BLOCK = 50  # scenes between two writes of the results


import xcrack as xc  # noqa: E402
from support import drawn_cracks, drawn_pairs  # noqa: E402

Row = dict[str, Any]
Stored = dict[str, dict[str, Row]]

_OURS = ("MeshError", "CoarseMeshError", "GeometryError", "ProblemError", "ConvergenceError")
MEETING = ("pairs", "growing")  # without bars and without a truth
OUTCOME = {
    "plane": drawn_cracks.outcome,
    "space": drawn_cracks.outcome,
    "pairs": drawn_pairs.outcome,
    "growing": drawn_pairs.outcome,
}
_NUMBERS = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")
_KEPT = (
    "kind", "places", "K is nan", "bars", "bars that are nan", "nan without a reason",
    "closed places", "truth", "bars judged", "bars held", "too wide", "worst over bar",
    "error of K", "added", "added at most", "added on finer cells", "unbalanced",
    "unlike on finer cells",
)  # fmt: skip


def run(where: str, seeds: range, folder: Path, workers: int, path: Path) -> None:
    """Run the scenes of some seeds that are not stored yet, block by block."""
    for begin in range(seeds.start, seeds.stop, BLOCK * workers):
        block = range(begin, min(begin + BLOCK * workers, seeds.stop))
        stored = read(path)
        if all(str(seed) in stored[where] for seed in block):
            continue
        cases = [{"seed": seed, "where": where} for seed in block]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", xc.XcrackWarning)  # counts of failures: in the table
            study = xc.campaign(OUTCOME[where], cases, path=folder / where, workers=workers)
        for row in study.rows:
            stored[where][str(row["parameters"]["seed"])] = short(row)
        write(path, stored)
        print(f"{where}: {len(stored[where])} of {WANTED[where]}", file=sys.stderr, flush=True)


def short(row: Row) -> Row:
    """What the page needs of a row of the campaign; what is zero or empty is left out."""
    result = row["result"]
    fields = {name: result[name] for name in _KEPT if result.get(name) not in (None, 0, 0.0)}
    for name, value in fields.items():
        if isinstance(value, float):
            fields[name] = float(f"{value:.4g}")
    for name in ("messages", "reasons"):
        words = sorted({general(text) for text in json.loads(result.get(name, "[]"))})
        fields |= {name: words} if words else {}
    if row["kind"]:
        fields |= {"raised": row["kind"], "words": general(row["error"])}
    return fields | {"seconds": float(f"{row['seconds']:.2g}")}


def general(words: str) -> str:
    """The first sentence of a message without its numbers, so that like ones can be counted."""
    text = _NUMBERS.sub("#", " ".join(words.split()))
    text = re.sub(r"\[#(, #)*\]", "#", text)
    return re.split(r"(?<=[a-z#)])[.:;] ", text.strip())[0][:110]


def read(path: Path) -> Stored:
    """Stored rows by where, and by seed."""
    stored = json.loads(path.read_text()) if path.exists() else {}
    return {where: stored.get(where, {}) for where in WANTED}


def write(path: Path, stored: Stored) -> None:
    """One line a scene."""
    parts = []
    for where, rows in stored.items():
        ordered = sorted(rows.items(), key=lambda item: int(item[0]))
        lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in ordered)
        parts.append(f"{json.dumps(where)}: {{\n{lines}\n}}")
    path.write_text("{\n" + ",\n".join(parts) + "\n}\n")


# The page ---------------------------------------------------------------------------------------


def is_refused(row: Row) -> bool:
    """Whether xcrack said why there is no K."""
    return row.get("raised") in _OURS


def is_fault(row: Row) -> bool:
    """What no scene may give."""
    foreign = "raised" in row and not is_refused(row)
    missing = row.get("K is nan", 0) or row.get("nan without a reason", 0)
    return bool(foreign or missing or row["seconds"] > SECONDS)


def total(rows: Iterable[Row], name: str) -> int:
    """Sum of a count over rows."""
    return int(sum(row.get(name, 0) for row in rows))


def percent(part: float, whole: float) -> str:
    """A share as text, with its counts."""
    return f"{100 * part / whole:.1f} % ({part:,} of {whole:,})".replace(",", " ") if whole else "–"


def lines_of(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table of the page."""
    first = [" | ".join(head), "|".join("---" for _ in head)]
    return "\n".join(f"| {line} |" for line in [*first, *(" | ".join(map(str, r)) for r in rows)])


def groups_of(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows by the shape that was drawn; those that rub or of two materials once more."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        first, *others = row.get("kind", "").split(", ")
        for name in (first.replace("_", " "), *others):
            groups.setdefault(name, []).append(row)
    return dict(sorted(groups.items()))


def overview(stored: Stored) -> str:
    """A row for the plane and one for space."""
    table = []
    for where, rows_of in stored.items():
        rows = list(rows_of.values())
        if not rows:
            continue
        solved = [row for row in rows if "raised" not in row]
        refused = [row for row in rows if is_refused(row)]
        table.append((
            where, f"{len(rows)} of {WANTED[where]}", len(solved), len(refused),
            len(rows) - len(solved) - len(refused), total(rows, "K is nan"),
            total(rows, "nan without a reason"),
            sum("messages" in row for row in solved),
            f"{max(row['seconds'] for row in rows):.0f} s",
        ))  # fmt: skip
    head = ("where", "drawn", "solved", "refused in words", "foreign errors", "K that is nan",
            "bars that are nan without a reason", "scenes that warn", "slowest")  # fmt: skip
    return lines_of(head, table)


def counted(stored: Stored, name: str, head: str) -> str:
    """How many scenes say what, most frequent first."""
    counts: Counter[str] = Counter()
    for rows in stored.values():
        for row in rows.values():
            words = row.get(name, [])
            counts.update([words] if isinstance(words, str) else words)
    return lines_of((head, "scenes"), [(k.replace("|", "/"), v) for k, v in counts.most_common(14)])


def warned(stored: Stored) -> str:
    """How often warnings fire where K is off, and where it is not."""
    table = []
    for where, rows_of in stored.items():
        if where in MEETING:
            continue
        known = [row for row in rows_of.values() if row.get("truth") == "found"]
        known = [row for row in known if "error of K" in row]
        bad = [row for row in known if row["error of K"] > OFF]
        good = [row for row in known if row["error of K"] <= OFF]
        shares = [
            percent(sum("messages" in row for row in part), len(part)) for part in (bad, good)
        ]
        table.append((where, len(known), *shares))
    head = ("where", "scenes with known K", "off by more than 5 %: warn", "within 5 %: warn")
    return lines_of(head, table)


def bars(stored: Stored) -> str:
    """Bars by what was drawn."""
    table = []
    for where, rows_of in stored.items():
        solved = [row for row in rows_of.values() if "raised" not in row]
        if where in MEETING:
            continue
        for name, rows in {**groups_of(solved), "all": solved}.items():
            judged = total(rows, "bars judged")
            table.append((
                where, name, len(rows), percent(total(rows, "bars held"), judged),
                percent(total(rows, "too wide"), judged),
                percent(total(rows, "bars that are nan"), total(rows, "bars")),
            ))  # fmt: skip
    head = ("where", "drawn", "solved", "bar holds", "more than ten times too wide", "no bar")
    return lines_of(head, table)


def meetings(stored: Stored) -> str:
    """What became of pairs that may meet, and of those that grow."""
    table = []
    for where in ("pairs", "growing"):
        rows = stored.get(where, {}).values()
        words = [
            general(row["kind"]) if "raised" not in row else f"refused: {row['words']}"
            for row in rows
        ]
        for kind, count in Counter(words).most_common():
            off = [
                r["unbalanced"]
                for r in rows
                if general(r.get("kind", "")) == kind and "unbalanced" in r
            ]
            unlike = [
                abs(r["unlike on finer cells"])
                for r in rows
                if general(r.get("kind", "")) == kind and "unlike on finer cells" in r
            ]
            table.append((
                where, kind.replace("|", "/"), count,
                *(f"{100 * max(each):.1f} %" if each else "–" for each in (off, unlike)),
            ))  # fmt: skip
    head = "drawn", "came to", "scenes", "energy not explained, largest", "unlike on finer cells"
    return "\n\n".join([lines_of(head, table), judged(list(stored.get("pairs", {}).values()))])


def judged(rows: Sequence[Row]) -> str:
    """How near to their bounds pairs are, in words."""
    shares = [row["added"] / row["added at most"] for row in rows if "added at most" in row]
    apart = [
        abs(row["added"] / row["added on finer cells"] - 1)
        for row in rows
        if "added on finer cells" in row
    ]
    words = []
    if shares:
        words.append(
            f"{len(shares)} pairs release {100 * min(shares):.0f} to {100 * max(shares):.0f} % of "
            "what the ball around them does."
        )
    if apart:
        words.append(
            f"Of {len(apart)} no ball fits around: on finer cells they release up to "
            f"{100 * max(apart):.0f} % more or less."
        )
    return " ".join(words)


def range_of_seeds(rows: dict[str, Row]) -> str:
    """Which seeds there are, in words; nothing where there are none."""
    seeds = sorted(int(seed) for seed in rows)
    drawn = set(seeds)
    begins = [seed for seed in seeds if seed - 1 not in drawn]
    ends = [seed for seed in seeds if seed + 1 not in drawn]
    runs = ", ".join(f"{begin} to {end}" for begin, end in zip(begins, ends, strict=True))
    return f" (seeds {runs})" if seeds else ""


def fault_of(row: Row) -> str:
    """What is wrong with a scene that gave what none may give, in words."""
    if row["seconds"] > SECONDS:
        return f"{row['seconds']:.0f} s"
    return str(row.get("words", "nan"))


def worst(stored: Stored, n: int = 10) -> list[tuple[str, int, Row]]:
    """Scenes whose errors are the most bars."""
    every = [(w, int(seed), row) for w, rows in stored.items() for seed, row in rows.items()]
    every = [each for each in every if each[2].get("worst over bar", 0) > 0]
    return sorted(every, key=lambda each: -each[2]["worst over bar"])[:n]


def page(stored: Stored) -> str:
    """The page as text."""
    drawn = {where: len(rows) for where, rows in stored.items()}
    complete = all(drawn[where] >= WANTED[where] for where in ("plane", "space"))
    seeds = {where: range_of_seeds(stored.get(where, {})) for where in ("plane", "space")}
    faults = [
        (w, seed, fault_of(row)) for w, rows in stored.items()
        for seed, row in rows.items() if is_fault(row)
    ]  # fmt: skip
    fault_lines = "\n".join(f"* {w}, seed {s}: {t}" for w, s, t in faults) or "None."
    ten = [
        (f"{w}, {seed}", row["kind"].replace("_", " "), f"{row['worst over bar']:.2g}",
         f"{row['error of K']:.1e}" if "error of K" in row else "–")
        for w, seed, row in worst(stored)
    ]  # fmt: skip
    return _TEXT.format(
        plane=drawn["plane"], space=drawn["space"], overview=overview(stored),
        plane_seeds=seeds["plane"], space_seeds=seeds["space"],
        rest="" if complete else "; the others are not run",
        faults=fault_lines, refused=counted(stored, "words", "refused because"),
        messages=counted(stored, "messages", "warning"), warned=warned(stored), bars=bars(stored),
        reasons=counted(stored, "reasons", "why there is no bar"), picture=PICTURE,
        meetings=meetings(stored),
        worst=lines_of(("scene", "drawn", "error over bar", "error of K over the largest"), ten),
    )  # fmt: skip


_TEXT = """# Ten thousand drawn cracks

{plane} of 8 500 scenes in the plane{plane_seeds} and {space} of 1 500 in space{space_seeds}, at the
defaults{rest}. Bodies, places and loads are drawn where methods are known to break: cuts through
mesh points and along edges, tips on them, kinks, junctions, holes, other tips and sides that are
near, faces that press, rub or open in part, two materials. A seed is a scene and makes it again
(`tests/support/drawn_cracks.py`). `python -m benchmarks.drawn --workers n` goes on where it was
stopped, and writes this page.

{overview}

Foreign errors, K or bars that are nan without a reason, and scenes beyond 120 s of the processor:

{faults}

## Refused

{refused}

## Warnings

Every fifth scene is solved twice more, on meshes that are much finer at tips, kinks and
junctions, at order 2. K is known where the two agree within half a percent. A scene is bad if K
of any tip, or place of a front, is off by more than 5 % of the largest.

{warned}

{messages}

## Bars

A bar is judged where the two references agree within a fifth of it, or of the error, and holds
if the error of the best K is at most one bar. In space each place of a front counts. The factors
of bars in the plane were fitted to other seeds (from 20000 on). Of errors
that are distributed normally, with bars that hold in 95 %, 16 % are within a tenth of a bar:
fewer that are ten times too wide are not to be expected.

{bars}

{reasons}

## Cracks that meet in space

Pairs of pennies and ellipses at any offset and angle in a pulled cube, at order 1, ten cells
across (`tests/support/drawn_pairs.py`). Of two that cross one runs through and the other is two
arms; where one is cut by the front of the other the two are interlocked, which is refused: one is
then let reach beyond the other, as the message says. Where
a message asks for a finer mesh at a place, or to leave an arm out, that is done, down to cells of
.06. What the cracks release is between that of a penny in one of them and that of a hollow ball
around both, which are bounds; where no ball fits into the cube it is within 15 % of that on cells
two thirds as large. Growing pairs begin apart and go on for a step after they have met; what of the
energy of a step the mean release over the new area does not explain is a share of all of it. Beyond
2 % the two shapes of the step are solved on cells two thirds as large, and the energy that it
releases may differ by 2 % of all.

{meetings}

## The worst ten

![the worst ten](figures/{picture})

{worst}
"""


def draw_worst(stored: Stored, path: Path) -> None:
    """Body and cracks of the worst ten."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection

    figure = plt.figure(figsize=(13, 5.6))
    for place, (where, seed, row) in enumerate(worst(stored)):
        problem = drawn_cracks.WHERE[where](seed).problem
        mesh = problem.mesh
        options: dict[str, str] = {"projection": "3d"} if where == "space" else {}
        axis: Any = figure.add_subplot(2, 5, place + 1, **options)  # type: ignore[arg-type]
        if where == "plane":
            axis.add_collection(
                LineCollection(list(mesh.points[mesh.edges]), lw=0.3, color="#c9c9c9")
            )
            for crack in problem.cracks:
                axis.plot(*crack.points.T, "-", color="#c8442c", lw=1.6)
            axis.set_aspect("equal")
            axis.set_xlim(-1.05, 1.05)
            axis.set_ylim(-1.05, 1.05)
        else:
            for crack in problem.cracks:
                axis.plot_trisurf(
                    *crack.points.T, triangles=crack.faces, color="#c8442c", alpha=0.6
                )
            axis.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
        axis.set_xticks([])
        axis.set_yticks([])
        axis.set_title(f"{seed}: {row['worst over bar']:.2g} bars\n{row['kind']}", fontsize=8)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run seeds, and write the page.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line where they are left out.

    Returns
    -------
    int
        1 where a scene gave what none may give.
    """
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    for where, n in WANTED.items():
        parser.add_argument(f"--{where}", default=f"0:{n}", help=f"seeds, as 0:{n}")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path("out/drawn"))
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--page", type=Path, default=PAGE)
    options = parser.parse_args(arguments)
    for where in WANTED:
        begin, end = (int(part) for part in getattr(options, where).split(":"))
        run(where, range(begin, end), options.folder, options.workers, options.results)
    stored = read(options.results)
    options.page.write_text(page(stored))
    draw_worst(stored, options.page.parent / "figures" / PICTURE)
    print(overview(stored), warned(stored), bars(stored), sep="\n\n")
    return int(any(is_fault(row) for rows in stored.values() for row in rows.values()))


if __name__ == "__main__":
    sys.exit(main())
