"""K along drawn fronts in space: shares within 1 % at 20, 60 and 200 thousand unknowns.

    python -m benchmarks.fronts                # what is missing of ten seeds, and the table
    python -m benchmarks.fronts --seeds 10:30  # others
    python -m benchmarks.fronts --seeds 0:0    # the table of what is stored

A seed draws a crack, a body and its load: pennies and ellipses in any direction under their exact
displacements; surface and corner cracks of a block that gmsh meshes; corner cracks at a hole and
cracks of a round bar from STEP files. `refine` makes cells small at the front, growing away from
it, as an engineer would; their size gives that many unknowns at order 2. Where there is no exact
field, K of a mesh with 1.75 times as many unknowns as the largest is the truth: equations
of handbooks are good to 5 %. The two coarse meshes are solved at order 1, too.

No constant of xcrack was chosen on these scenes. Finished ones are rows of
benchmarks/results/fronts.json: a run that was stopped goes on.
"""

import argparse
import json
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XCRACK_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from scipy.spatial import cKDTree  # noqa: E402

import xcrack as xc  # noqa: E402
from xcrack.analysis.plan import forecast_of  # noqa: E402
from xcrack.base.arrays import Floats  # noqa: E402
from xcrack.mesh.gmsh_session import session  # noqa: E402
from xcrack.mesh.simplex import leg_sizes  # noqa: E402
from xcrack.verification.exact import fields_3d  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "fronts.json"
SIZES = (20_000, 60_000, 200_000)
TRUTH = 350_000
GROWTH, BAND = 0.5, 2.0  # of cells with the distance, from so many cells on
EDGE = 1.6  # longest edge over the size of a cell
WITHIN = 0.01
CLOSE = 0.25  # of the logarithm of the unknowns
E, NU = 210e3, 0.3
STEEL = xc.Isotropic(E, NU)

Row = dict[str, Any]
Exact = Callable[[xc.SIF], Floats]


@dataclass(frozen=True)
class Scene:
    """What a seed draws.

    Attributes
    ----------
    kind : str
    front : (n, 3) array, length
        Points along the front, from which sizes of cells are taken.
    mesh_of : callable
        The body for a size of cells at the front; they grow away from it.
    problem_of : callable
        The problem on a mesh of it.
    exact : callable, optional
        K at the places of a SIF.
    """

    kind: str
    front: Floats
    mesh_of: Callable[[float], xc.Mesh]
    problem_of: Callable[[xc.Mesh], xc.Problem]
    exact: Exact | None = None


# Bodies -----------------------------------------------------------------------------------------


Draw = Callable[[Any], None]


def grade(gmsh: Any, front: Floats, h: float, far: float) -> None:
    """Cells of a gmsh model that grow away from a front."""
    points = [gmsh.model.occ.addPoint(*x) for x in front]
    gmsh.model.occ.synchronize()
    field = gmsh.model.mesh.field
    distance, size = field.add("Distance"), field.add("MathEval")
    field.setNumbers(distance, "PointsList", points)
    grown = f"{h} + {GROWTH} * Max(F{distance} - {BAND * h}, 0)"
    field.setString(size, "F", f"Min({far}, {grown})")
    field.setAsBackgroundMesh(size)


def meshed(draw: Draw, front: Floats, far: float) -> Callable[[float], xc.Mesh]:
    """Maker of a body that gmsh meshes for a size of cells at the front."""

    def mesh_of(h: float) -> xc.Mesh:
        off = {"Mesh__MeshSizeFromPoints": 0, "Mesh__MeshSizeExtendFromBoundary": 0}
        with tempfile.TemporaryDirectory() as folder, session(**off) as gmsh:
            draw(gmsh.model.occ)
            gmsh.model.occ.synchronize()
            solids = [tag for _, tag in gmsh.model.getEntities(3)]
            gmsh.model.addPhysicalGroup(3, solids, name="body")
            grade(gmsh, front, h, far)
            gmsh.model.mesh.generate(3)
            path = Path(folder) / "body.msh"
            gmsh.write(str(path))
            return xc.read_mesh(path)

    return mesh_of


def from_step(draw: Draw, front: Floats, far: float) -> Callable[[float], xc.Mesh]:
    """Maker of a body from a STEP file in coarse cells, refined to a size at the front."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body.step"
        with session() as gmsh:
            draw(gmsh.model.occ)
            gmsh.model.occ.synchronize()
            gmsh.write(str(path))
        coarse = xc.mesh_step(path, size=far)
    tree = cKDTree(front)

    def mesh_of(h: float) -> xc.Mesh:
        def size(x: Floats) -> Floats:
            return np.asarray(EDGE * (h + GROWTH * np.maximum(tree.query(x)[0] - BAND * h, 0.0)))

        return xc.refine(coarse, size=size)

    return mesh_of


def ends_of(mesh: xc.Mesh, axis: int, half: float) -> xc.Mesh:
    """The mesh with its two end faces across an axis as sets bottom and top."""
    height = mesh.points[mesh.boundary][:, :, axis]
    sets = {name: facets for name, facets in mesh.facet_sets.items() if name != "boundary"} | {
        name: mesh.boundary[np.abs(height - end).max(axis=1) < 1e-6 * half]
        for name, end in (("bottom", -half), ("top", half))
    }
    return xc.Mesh(mesh.points, mesh.cells, sets, curves=mesh.curves)


def block(low: Floats, high: Floats) -> Draw:
    """A box, for gmsh."""
    return lambda occ: occ.addBox(*low, *(high - low))


def plate_with_hole(half: float, thickness: float, radius: float) -> Draw:
    """A square plate in z = 0 … thickness with a hole in its middle, for gmsh."""

    def draw(occ: Any) -> None:
        plate = occ.addBox(-half, -half, 0, 2 * half, 2 * half, thickness)
        hole = occ.addCylinder(0, 0, -thickness, 0, 0, 3 * thickness, radius)
        occ.cut([(3, plate)], [(3, hole)])

    return draw


# Scenes -----------------------------------------------------------------------------------------


def drawn(seed: int) -> Scene:
    """The scene of a seed: kinds take turns."""
    rng = np.random.default_rng([2207, seed])
    return KINDS[seed % len(KINDS)](rng)


def turned(rng: np.random.Generator) -> Floats:
    """A drawn rotation; rows are axes."""
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray(q * np.sign(np.linalg.det(q)))


def arc(a: float, c: float, span: float, n: int = 300) -> Floats:
    """Points (c cos, a sin) of an ellipse."""
    angle = np.linspace(0, span, n)
    return np.column_stack([c * np.cos(angle), a * np.sin(angle)])


def inner(rng: np.random.Generator, a: float, b: float, kind: str) -> Scene:
    """A penny or ellipse in a cube of 2 under its exact displacements."""
    axes, middle = turned(rng), rng.uniform(-0.1, 0.1, 3)
    szz, sxz, syz = 100.0, *rng.uniform(-60.0, 60.0, 2)
    S = np.array([[rng.uniform(-50, 50), 0, sxz], [0, rng.uniform(-50, 50), syz], [sxz, syz, szz]])
    is_penny = a == b

    def u(x: Floats) -> Floats:
        local = (x - middle) @ axes.T
        if is_penny:
            return np.asarray(fields_3d.penny(local, a, E, NU, S) @ axes)
        return np.asarray(fields_3d.ellipse_displacement(local, a, b, E, NU, S) @ axes)

    def exact(sif: xc.SIF) -> Floats:
        x = (sif.x - middle) @ axes.T
        if is_penny:
            angle = np.arctan2(x[:, 1], x[:, 0]) - np.arctan2(syz, sxz)
            K = fields_3d.penny_K(angle, a, NU, szz, float(np.hypot(sxz, syz)))
        else:
            K = fields_3d.ellipse_K(np.arctan2(x[:, 1] / b, x[:, 0] / a), a, b, NU, szz, sxz, syz)
        return np.stack([*np.broadcast_arrays(K[0], K[1], -K[2])], axis=1)

    crack = xc.elliptic_crack(middle, axes[2], axes[0], a, b)
    front = arc(b, a, 2 * np.pi) @ axes[:2] + middle
    one = np.ones(3)
    return Scene(
        kind, front, meshed(block(-one, one), front, 0.5),
        lambda mesh: xc.Problem(
            mesh, STEEL, [crack], supports=[xc.displacement("boundary", u)], contact="off"
        ),
        exact,
    )  # fmt: skip


def penny(rng: np.random.Generator) -> Scene:
    """A penny of .2 to .5 in a cube of 2."""
    a = rng.uniform(0.2, 0.5)
    return inner(rng, a, a, "penny")


def ellipse(rng: np.random.Generator) -> Scene:
    """An ellipse of half axes .3 to .5 and .4 to .8 of that."""
    a = rng.uniform(0.3, 0.5)
    return inner(rng, a, a * rng.uniform(0.4, 0.8), "ellipse")


def pulled(mesh: xc.Mesh, crack: xc.Crack, axis: int, half: float) -> xc.Problem:
    """A body that is pulled along an axis."""
    mesh = ends_of(mesh, axis, half)
    along = np.eye(3)[axis] * 100.0
    loads = [xc.traction("top", tuple(along)), xc.traction("bottom", tuple(-along))]
    return xc.Problem(mesh, STEEL, [crack], loads=loads)


def tilted(rng: np.random.Generator) -> Floats:
    """Rows: along x, the other half axis, the normal, up to 25° from z about x."""
    t = np.radians(rng.uniform(-25, 25))
    return np.array([[1, 0, 0], [0, np.cos(t), np.sin(t)], [0, -np.sin(t), np.cos(t)]])


def surface(rng: np.random.Generator) -> Scene:
    """Half an ellipse on a side of a block, its plane inclined about the surface."""
    a = rng.uniform(0.2, 0.45)
    c, axes, at = a / rng.uniform(0.5, 1.0), tilted(rng), np.array([0.0, 0.0, 0.011])
    half = 4 * c
    crack = xc.elliptic_crack(at, axes[2], axes[0], c, a)
    front = arc(a, c, np.pi) @ axes[:2] + at
    solid = block(np.array([-half, 0, -half]), np.array([half, 1, half]))
    return Scene(
        "surface crack", front, meshed(solid, front, 0.4 * half),
        lambda mesh: pulled(mesh, crack, 2, half),
    )  # fmt: skip


def corner(rng: np.random.Generator) -> Scene:
    """A quarter of an ellipse at an edge of a block."""
    a = rng.uniform(0.2, 0.4)
    c, axes, at = a / rng.uniform(0.6, 1.0), tilted(rng), np.array([0.0, 0.0, 0.009])
    half = 4 * c
    crack = xc.elliptic_crack(at, axes[2], axes[0], c, a)
    front = arc(a, c, np.pi / 2) @ axes[:2] + at
    solid = block(np.array([0, 0, -half]), np.array([half, 1, half]))
    return Scene(
        "corner crack", front, meshed(solid, front, 0.4 * half),
        lambda mesh: pulled(mesh, crack, 2, half),
    )  # fmt: skip


def corner_at_hole(rng: np.random.Generator) -> Scene:
    """A corner crack at a hole of radius 1 in a plate from STEP, pulled along y."""
    a, thickness, half = rng.uniform(0.25, 0.5), rng.uniform(0.8, 1.5), 6.0
    c = a / rng.uniform(0.7, 1.3)
    at = np.array([1.0, 0.009, 0.0])
    crack = xc.elliptic_crack(at, (0, 1, 0), (1, 0, 0), c, a)
    x = arc(a, c, np.pi / 2)
    front = np.column_stack([x[:, 0], 0 * x[:, 0], x[:, 1]]) + at
    return Scene(
        "corner crack at a hole, STEP", front,
        from_step(plate_with_hole(half, thickness, 1.0), front, 1.0),
        lambda mesh: pulled(mesh, crack, 1, half),
    )  # fmt: skip


def in_a_bar(rng: np.random.Generator) -> Scene:
    """A round bar of radius 1 from STEP with half an ellipse on its side, pulled along z."""
    a, half = rng.uniform(0.3, 0.7), 4.0
    c, axes, at = a / rng.uniform(0.6, 0.9), tilted(rng), np.array([0.0, -1.0, 0.013])
    crack = xc.elliptic_crack(at, axes[2], axes[0], c, a)
    front = arc(a, c, np.pi) @ axes[:2] + at
    front = front[np.hypot(front[:, 0], front[:, 1]) < 1]

    def bar(occ: Any) -> None:
        occ.addCylinder(0, 0, -half, 0, 0, 2 * half, 1.0)

    return Scene(
        "crack in a round bar, STEP", front, from_step(bar, front, 0.6),
        lambda mesh: pulled(mesh, crack, 2, half),
    )  # fmt: skip


KINDS = (
    penny, ellipse, surface, corner, corner_at_hole, penny, ellipse, surface, in_a_bar, penny,
)  # fmt: skip


# Runs -------------------------------------------------------------------------------------------


def sized(scene: Scene, target: int, h: float | None = None) -> tuple[xc.Problem, float]:
    """The problem with about so many unknowns at order 2, and the size of cells at its front."""
    legs = np.linalg.norm(np.diff(scene.front, axis=0), axis=1)
    h, tried = h or 0.8 * float(legs.sum()) / (target / 1500) ** 0.7, []
    for _ in range(6):
        problem = scene.problem_of(scene.mesh_of(h))
        n = forecast_of(problem).unknowns
        tried.append((np.log(n), np.log(h)))
        if abs(np.log(n / target)) < CLOSE:
            break
        slope = 0.5
        if len(tried) > 1 and abs(tried[-1][0] - tried[-2][0]) > 0.05:
            slope = -(tried[-1][1] - tried[-2][1]) / (tried[-1][0] - tried[-2][0])
        h *= float(n / target) ** float(np.clip(slope, 0.3, 0.9))
    return problem, h


def solved(problem: xc.Problem) -> tuple[xc.SIF, Row]:
    """K of a problem, and what it took and said."""
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        begin = time.process_time()
        solution = xc.solve(problem)
        sif = xc.stress_intensity(solution)
        seconds = time.process_time() - begin
    texts = [str(w.message) for w in issued if issubclass(w.category, xc.XcrackWarning)]
    mesh, crack = problem.mesh, problem.placed[0]
    x = crack.points[np.concatenate(crack.fronts)]
    size = float(np.median(leg_sizes(mesh, mesh.cell_tree.query(x)[1])))
    return sif, {
        "unknowns": solution.n_dof, "seconds": round(seconds, 2), "leg": size, "warnings": texts,
    }  # fmt: skip


def share_along(sif: xc.SIF) -> Floats:
    """Where the rows of an open front lie, as shares of its length in a sense that x gives."""
    s = (sif.s - sif.s[0]) / (sif.s[-1] - sif.s[0])
    first, last = sif.x[0], sif.x[-1]
    return np.asarray(s if tuple(first) < tuple(last) else 1 - s)


def errors(sif: xc.SIF, wanted: Floats) -> Row:
    """Rms by mode and largest error away from free surfaces, over the largest K."""
    rows = ~sif.at_surface
    off = (sif.K - wanted)[rows] / np.abs(wanted[rows]).max()
    rms = np.sqrt((off**2).mean(axis=0))
    return {"rms": rms.round(5).tolist(), "largest": float(np.abs(off).max().round(5))}


def at_places(truth: Row, sif: xc.SIF) -> Floats:
    """K of the truth at the places of a SIF; senses of shear are those of the frames."""
    s, K = np.array(truth["s"]), np.array(truth["K"])
    return np.stack([np.interp(share_along(sif), s, K[:, m]) for m in range(3)], axis=1)


def outcome(seed: int, target: int, path: Path) -> None:
    """Add what is missing of a seed and a size to the file."""
    stored = read(path)
    if str(target) in stored.get(str(seed), {}):
        return
    scene = drawn(seed)
    row = stored.setdefault(str(seed), {"kind": scene.kind})
    if scene.exact is None and "truth" not in row:
        sif, took = solved(sized(scene, TRUTH)[0])
        along = np.argsort(share_along(sif))
        row["truth"] = {
            "s": share_along(sif)[along].round(5).tolist(), "K": sif.K[along].round(4).tolist(),
            **took,
        }  # fmt: skip
        write(path, stored)
    earlier = [(int(n), row[n]["h"]) for n in row if n.isdigit()]
    guess = earlier[-1][1] * (earlier[-1][0] / target) ** 0.45 if earlier else None
    problem, h = sized(scene, target, guess)
    both: Row = {"h": h}
    for order in (2, 1) if target < SIZES[-1] else (2,):
        sif, took = solved(replace(problem, order=order))
        wanted = scene.exact(sif) if scene.exact is not None else at_places(row["truth"], sif)
        both[f"order {order}"] = {**errors(sif, wanted), **took}
    row[str(target)] = both
    write(path, stored)
    one, two = both.get("order 1", {}).get("rms"), both["order 2"]
    words = f"seed {seed}, {scene.kind}: {two['unknowns']}, {two['seconds']} s, {two['rms']}"
    print(f"{words}, order 1 {one}", file=sys.stderr, flush=True)


def read(path: Path) -> dict[str, Row]:
    """Stored rows by seed."""
    return json.loads(path.read_text()) if path.exists() else {}


def write(path: Path, stored: dict[str, Row]) -> None:
    """One line a seed."""
    lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in stored.items())
    path.write_text("{\n" + lines + "\n}\n")


# Tables -----------------------------------------------------------------------------------------


def share(rows: list[Row], part: str) -> str:
    """How many of rows have an error within the bound."""
    value = [np.max(row[part]) for row in rows]
    return f"{sum(v <= WITHIN for v in value)} of {len(rows)}"


def table(stored: dict[str, Row]) -> str:
    """Shares and medians by size and order, then every scene at order 2."""
    lines = [
        "| unknowns | order | rms of every mode within 1 % | every place within 1 % | "
        "median, worst rms | off by more, and warned | seconds |",
        "|---|---|---|---|---|---|---|",
    ]
    for target in SIZES:
        for order in (2, 1):
            name, order_name = str(target), f"order {order}"
            rows = [
                row[name][order_name] for row in stored.values() if order_name in row.get(name, {})
            ]
            if not rows:
                continue
            rms = np.array([max(row["rms"]) for row in rows])
            off = [row for row in rows if max(row["rms"]) > WITHIN]
            unknowns = np.median([row["unknowns"] for row in rows])
            lines.append(
                f"| {unknowns / 1e3:.0f} k | {order} | {share(rows, 'rms')} | "
                f"{share(rows, 'largest')} | {100 * np.median(rms):.2f}, {100 * rms.max():.2f} % | "
                f"{sum(bool(row['warnings']) for row in off)} of {len(off)} | "
                f"{np.median([row['seconds'] for row in rows]):.1f} |"
            )
    lines += ["", "| seed | scene | " + " | ".join(f"{t // 1000} k" for t in SIZES) + " |",
              "|---|---|" + "---|" * len(SIZES)]  # fmt: skip
    for seed, row in sorted(stored.items(), key=lambda item: int(item[0])):
        cells = []
        for target in SIZES:
            one = row.get(str(target), {}).get("order 2")
            cells.append("–" if one is None else " / ".join(f"{100 * v:.2f}" for v in one["rms"]))
        lines.append(f"| {seed} | {row['kind']} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Run seeds and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", default="0:10")
    parser.add_argument("--file", type=Path, default=RESULTS)
    options = parser.parse_args()
    first, last = (int(part) for part in options.seeds.split(":"))
    for target in SIZES:
        for seed in range(first, last):
            outcome(seed, target, options.file)
    print(table(read(options.file)))


if __name__ == "__main__":
    main()
