"""Lives and paths to a wanted error: the true error beside the bar, and the cost.

``python -m benchmarks.wanted_error`` prints the table of docs/measured.md, draws its figure and
stores it in ``benchmarks/results/wanted_error.json``. Truth is a run with a tolerance of 5e-4 in
steps of 0.03.
Beside each tolerance runs the cheapest fixed setting that reaches it, as found among uniform meshes
1 to 3 times as fine and steps of 0.3 to 0.035 by someone who knew the truth.
"""

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

import xcrack as xc
from xcrack.base.arrays import Floats

RESULT = Path(__file__).parent / "results" / "wanted_error.json"
FIGURE = Path(__file__).parents[1] / "docs" / "figures" / "wanted_error_cost.png"
LAW = xc.paris(C=1e-3, m=3.0)
STEEL = xc.Isotropic(210e3, 0.3, plane="strain")
UP = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))
TOLERANCES = (3e-2, 1e-2, 3e-3)
TRUTH = {"tolerance": 5e-4, "da": 0.03}
_FARTHER = 0.3  # that the truth runs past the end of a run


def square(n: int = 8) -> xc.Mesh:
    """The plate [-1, 1]²."""
    return xc.box((-1.0, -1.0), (1.0, 1.0), n)


def turned(degrees: float) -> list[Any]:
    """Tension that is turned from the y-axis, on all four sides."""
    angle = np.radians(degrees)
    along = np.array([-np.sin(angle), np.cos(angle)])
    stress = np.outer(along, along)
    sides = ("left", "right", "bottom", "top")
    return [xc.traction(side, lambda x, n: n @ stress) for side in sides]


def scene(name: str, finer: float = 1.0) -> tuple[xc.Problem, float]:
    """A scene on a coarse mesh, or one finer, and x of a tip of its first crack where runs stop."""
    line = xc.line_crack
    eight, ten = square(round(8 * finer)), square(round(10 * finer))
    match name:
        case "a crack that turns by 29°":
            return xc.Problem(eight, STEEL, [line([(-1.1, -0.04), (-0.5, 0.2)])], loads=UP), 0.25
        case "an inner crack that turns by 52°":
            h = 0.25 / np.sqrt(2)
            crack = line([(-h, -h + 0.007), (h, h + 0.007)])
            return xc.Problem(ten, STEEL, [crack], loads=UP), 0.6
        case "an edge crack in tension and shear":
            crack = line([(-1.1, 0.013), (-0.5, 0.013)])
            return xc.Problem(eight, STEEL, [crack], loads=turned(20.0)), 0.3
        case "into a hole":
            body = xc.plate_with_hole(width=2, height=2, radius=0.2, size=0.25 / finer)
            return xc.Problem(body, STEEL, [line([(-1.1, 0.25), (-0.6, 0.25)])], loads=UP), 0.1
        case "from a hole":
            body = xc.plate_with_hole(width=4, height=4, radius=0.5, size=0.6 / finer)
            crack = line([(0.3, 0.05), (0.65, 0.05)])
            return xc.Problem(body, STEEL, [crack], loads=turned(10.0)), 1.4
        case _:
            cracks = [line([(-1.1, 0.1), (-0.55, 0.1)]), line([(1.1, -0.15), (0.65, -0.15)])]
            return xc.Problem(ten, STEEL, cracks, loads=UP), -0.2


SCENES = (
    "a crack that turns by 29°", "an inner crack that turns by 52°",
    "an edge crack in tension and shear", "into a hole", "from a hole", "two cracks, one faster",
)  # fmt: skip

# Times finer, and da; None where none of the sweep reaches it.
CHEAPEST: dict[str, tuple[tuple[float, float] | None, ...]] = {
    SCENES[0]: ((1.5, 0.3), (1.5, 0.3), (2.0, 0.2)),
    SCENES[1]: ((1.5, 0.3), (2.0, 0.3), (2.0, 0.14)),
    SCENES[2]: ((1.0, 0.3), (1.0, 0.3), (1.5, 0.14)),
    SCENES[3]: ((1.0, 0.2), (1.0, 0.2), (1.0, 0.2)),
    SCENES[4]: ((1.0, 0.3), (1.5, 0.14), None),
    SCENES[5]: ((1.0, 0.2), (1.0, 0.3), (2.0, 0.05)),
}


def run(problem: xc.Problem, end: float, **options: Any) -> tuple[xc.History, float]:
    """A run, and its processor time."""
    start = process_time()

    def there(step: xc.Step) -> bool:
        return float(step.corrected[0].points[-1, 0]) > end

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        steps = xc.grow(
            problem, LAW, xc.max_hoop_stress, xc.Cycle(0.0, 1.0), progress=False, **options
        )
        return xc.collect(steps, until=there, keep_solutions=False), process_time() - start


def against(truth: xc.History, c: int = 0) -> Callable[[xc.History], tuple[float, float]]:
    """Errors of path, over the length grown, and of life of a run, where the last tip of c is."""
    solved = [step for step in truth.steps if step.n_tips]
    x = np.array([step.corrected[c].points[-1] for step in solved])
    moved = np.append(True, np.linalg.norm(np.diff(x, axis=0), axis=1) > 0)  # a tip may wait
    x, cycles = x[moved], np.array([step.cycles for step in solved])[moved]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    curve = CubicSpline(s, np.column_stack([x, cycles]))
    fine = np.linspace(0.0, s[-1], 20001)
    way: Floats = curve(fine)

    def errors(history: xc.History) -> tuple[float, float]:
        last = [step for step in history.steps if step.n_tips][-1]
        away = np.linalg.norm(way[:, :2] - last.corrected[c].points[-1], axis=1)
        near = int(np.argmin(away))
        return float(away[near] / fine[near]), abs(float(last.cycles / way[near, 2] - 1))

    return errors


def measured(name: str) -> list[dict[str, Any]]:
    """Rows of one scene."""
    problem, end = scene(name)
    truth, _ = run(problem, end + _FARTHER, **TRUTH)
    errors, rows = against(truth), []
    for tolerance, fixed in zip(TOLERANCES, CHEAPEST[name], strict=True):
        history, seconds = run(problem, end, tolerance=tolerance)
        finer, da = fixed or (1.0, 0.2)
        other, at_fixed = run(*scene(name, finer), da=da)
        path, life = errors(history)
        last = [step for step in history.steps if step.n_tips][-1]
        error = last.error
        assert error is not None
        rows.append({
            "scene": name, "tolerance": tolerance, "life": life,
            "bar": float(error.life / last.cycles), "path": path,
            "path bar": float(error.path / error.grown), "steps": len(history.steps),
            "meshes": last.run.meshes if last.run is not None else 0,
            "seconds": round(seconds, 2), "fixed": None if fixed is None else round(at_fixed, 3),
            "fixed error": None if fixed is None else max(errors(other)),
        })  # fmt: skip
    return rows


def draw(rows: list[dict[str, Any]]) -> None:
    """Cost of a tolerance over the tolerance: each scene, and the cheapest fixed settings."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 4.2))
    for name in dict.fromkeys(row["scene"] for row in rows):
        of_scene = [row for row in rows if row["scene"] == name]
        (line,) = axes.plot(
            [row["tolerance"] for row in of_scene], [row["seconds"] for row in of_scene], "o-",
            label=name,
        )  # fmt: skip
        fixed = [(row["tolerance"], row["fixed"]) for row in of_scene if row["fixed"] is not None]
        axes.plot(*zip(*fixed, strict=True), "x:", color=line.get_color())
    axes.set(xscale="log", yscale="log", xlabel="tolerance", ylabel="processor time (s)")
    axes.set_title("tolerance (dots), cheapest fixed setting (crosses)", fontsize="medium")
    axes.set_xticks(TOLERANCES, [f"{100 * t:g} %" for t in TOLERANCES])
    axes.set_xticks([], minor=True)
    axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(FIGURE, dpi=120, bbox_inches="tight")


def main() -> None:
    """Print and store the table, and draw the cost."""
    run(*scene(SCENES[0]), tolerance=0.1)  # kernels are compiled
    rows = []
    for name in SCENES:
        for row in measured(name):
            rows.append(row)
            print(
                f"| {row['scene']} | {row['tolerance']:g} | {row['life']:.1e} ({row['bar']:.1e}) | "
                f"{row['path']:.1e} ({row['path bar']:.1e}) | {row['steps']} | {row['meshes']} | "
                f"{row['seconds']} | {row['fixed']} |",
                flush=True,
            )
    RESULT.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    draw(rows)


if __name__ == "__main__":
    main()
