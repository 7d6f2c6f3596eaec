"""Numbers of CalculiX for the verification book: a plate with a hole and a slanted edge crack.

CalculiX 2.20 (Dhondt and Wittig; Debian package calculix-ccx) computes the strain energy U and the
displacements on a mesh of quadratic triangles that follows the crack, with quarter-point nodes at
the tip. G is the derivative of U by the length of the crack under dead loads, from two meshes that
differ only in the place of the nodes near the tip. Where the crack faces press, they are tied by
its penalty contact without friction.

    python -m benchmarks.baselines.calculix            # prints what the book quotes
"""

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.mesh.gmsh_session import session
from xcrack.verification.book.cases.programs import (
    ANGLE,
    CRACK,
    HALF,
    HOLE,
    LENGTH,
    MATERIAL,
    RADIUS,
    STRESS,
)

_SHIFT = 2e-3  # of the tip, as a share of the crack
_REACH = (0.1, 0.3)  # where the shift falls to zero, as shares of the crack
_SLOPE = 1e8  # pressure over overlap of the faces, N/mm³


@dataclass(frozen=True)
class Body:
    """Quadratic triangles with the crack's faces apart."""

    points: Floats
    cells: Ints
    tip: int
    upper: tuple[tuple[int, int], ...]  # facets of the crack's faces: cell and side, from 1
    lower: tuple[tuple[int, int], ...]
    mouth: tuple[int, int]  # nodes on the upper and the lower face
    ends: dict[str, tuple[tuple[int, int], ...]]


def body(size: float) -> Body:
    """Mesh whose cells at the tip have a given size; elsewhere up to 8 times as much."""
    mouth, tip = CRACK
    w, h = HALF
    corners = [(-w, -h), (w, -h), (w, h), (-w, h)]
    with session() as gmsh:
        occ = gmsh.model.occ
        start = occ.addPoint(*mouth, 0)
        end = occ.addPoint(*tip, 0)
        line = occ.addLine(start, end)
        ring = [occ.addPoint(*c, 0) for c in corners]
        order = [*ring, start]
        sides = [occ.addLine(a, b) for a, b in zip(order, [*order[1:], ring[0]])]
        hole = occ.addCircle(*HOLE, 0, RADIUS)
        plate = occ.addPlaneSurface([occ.addCurveLoop(sides), occ.addCurveLoop([hole])])
        occ.synchronize()
        gmsh.model.mesh.embed(1, [line], 2, plate)
        field = gmsh.model.mesh.field
        near = field.add("MathEval")
        r = f"Sqrt((x-({tip[0]!r}))^2+(y-({tip[1]!r}))^2)"
        field.setString(near, "F", f"Min({8 * size!r}, {size!r} + 0.15*{r})")
        field.setAsBackgroundMesh(near)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        _, _, nodes = gmsh.model.mesh.getElements(2)
        on_line = gmsh.model.mesh.getNodes(1, line, True, False)[0]
    index = np.full(int(tags.max()) + 1, -1)
    index[tags] = np.arange(len(tags))
    points = flat.reshape(-1, 3)[:, :2]
    cells = index[nodes[0].astype(np.int64)].reshape(-1, 6)
    at_tip = int(np.argmin(np.hypot(*(points - np.array(tip)).T)))
    twice = np.setdiff1d(index[on_line.astype(np.int64)], [at_tip])
    return _opened(points, cells, twice, at_tip)


def _opened(points: Floats, cells: Ints, twice: Ints, tip: int) -> Body:
    normal = np.array([-np.sin(ANGLE), np.cos(ANGLE)])
    copy = np.full(len(points), -1)
    copy[twice] = len(points) + np.arange(len(twice))
    below = (points[cells[:, :3]].mean(axis=1) - np.array(CRACK[0])) @ normal < 0
    cells = np.where(below[:, None] & (copy[cells] >= 0), copy[cells], cells)
    points = np.concatenate([points, points[twice]])
    for a, b, middle in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):  # quarter points
        for start, end in ((a, b), (b, a)):
            rows = cells[:, start] == tip
            points[cells[rows, middle]] = 0.75 * points[tip] + 0.25 * points[cells[rows, end]]
    upper, lower = set(twice.tolist()) | {tip}, set(copy[twice].tolist()) | {tip}
    first = int(twice[np.argmin(np.hypot(*(points[twice] - np.array(CRACK[0])).T))])
    high = set(np.nonzero(points[:, 1] > HALF[1] - 1e-9)[0].tolist())
    low = set(np.nonzero(points[:, 1] < -HALF[1] + 1e-9)[0].tolist())
    facets = {"top": _facets(cells, high), "bottom": _facets(cells, low)}
    return Body(points, cells, tip, _facets(cells, upper), _facets(cells, lower),
                (first, int(copy[first])), facets)  # fmt: skip


def _facets(cells: Ints, nodes: set[int]) -> tuple[tuple[int, int], ...]:
    sides = ((0, 1, 3), (1, 2, 4), (2, 0, 5))
    return tuple(
        (c + 1, s + 1)
        for s, side in enumerate(sides)
        for c in np.nonzero(np.isin(cells[:, side], list(nodes)).all(axis=1))[0].tolist()
    )


def shifted(of: Body, share: float) -> Floats:
    """Points with the tip moved along the crack by a share of its length."""
    tip = of.points[of.tip]
    r = np.hypot(*(of.points - tip).T) / LENGTH
    weight = np.clip((_REACH[1] - r) / (_REACH[1] - _REACH[0]), 0.0, 1.0)
    way = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    moved = of.points + (share * LENGTH * weight)[:, None] * way
    for a, b, middle in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):  # sides stay straight
        far = (of.cells[:, a] != of.tip) & (of.cells[:, b] != of.tip)
        inside = (weight[of.cells[:, a]] > 0) | (weight[of.cells[:, b]] > 0)
        rows = far & inside
        moved[of.cells[rows, middle]] = moved[of.cells[rows][:, [a, b]]].mean(axis=1)
    return moved


def solved(of: Body, points: Floats, factor: float) -> tuple[float, Floats]:
    """Strain energy of unit thickness, and the jump at the mouth, across and along the crack."""
    E, nu = MATERIAL
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i + 1}, {x:.12g}, {y:.12g}, 0" for i, (x, y) in enumerate(points)]
    lines.append("*ELEMENT, TYPE=CPE6, ELSET=BODY")
    lines += [f"{c + 1}, " + ", ".join(str(n + 1) for n in row) for c, row in enumerate(of.cells)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {nu}",
              "*SOLID SECTION, ELSET=BODY, MATERIAL=M", "1."]  # fmt: skip
    if factor < 0:
        for name, facets in (("UP", of.upper), ("DOWN", of.lower)):
            lines += [f"*SURFACE, NAME={name}", *(f"{c}, S{s}" for c, s in facets)]
        lines += ["*SURFACE INTERACTION, NAME=TOUCH",
                  "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{_SLOPE}, 1e-6",
                  "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE",
                  "DOWN, UP"]  # fmt: skip
    right = of.points[:, 0] > HALF[0] - 1e-9
    corner = int(np.nonzero(right)[0][np.argmin(of.points[right, 1])])
    other = int(np.nonzero(right)[0][np.argmax(of.points[right, 1])])
    lines += ["*NSET, NSET=MOUTH", f"{of.mouth[0] + 1}, {of.mouth[1] + 1}", "*STEP, INC=200",
              "*STATIC", "1., 1." if factor < 0 else "", "*BOUNDARY", f"{corner + 1}, 1, 2",
              f"{other + 1}, 1, 1", "*DLOAD"]  # fmt: skip
    for facets in of.ends.values():  # a pressure: traction with the other sign
        lines += [f"{c}, P{s}, {-STRESS * factor!r}" for c, s in facets]
    lines += ["*NODE PRINT, NSET=MOUTH", "U", "*EL PRINT, ELSET=BODY", "ELSE",
              "*END STEP"]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "job.inp").write_text("\n".join(line for line in lines if line) + "\n")
        run = subprocess.run(["ccx", "job"], cwd=folder, capture_output=True, text=True)
        text = (Path(folder) / "job.dat").read_text()
        if "Job finished" not in run.stdout:
            raise RuntimeError(run.stdout[-2000:])
    last, energies = text[text.rindex("displacements") :].split("internal energy", 1)
    # of each cell, because a total has seven digits only
    U = sum(float(e) for e in re.findall(r"^\s+\d+\s+(\S+)\s*$", energies, re.MULTILINE))
    rows = re.findall(r"^\s+(\d+)\s+(\S+)\s+(\S+)\s+(\S+)\s*$", last, re.MULTILINE)
    u = {int(row[0]) - 1: np.array([float(row[1]), float(row[2])]) for row in rows}
    jump = u[of.mouth[0]] - u[of.mouth[1]]
    frame = np.array([[-np.sin(ANGLE), np.cos(ANGLE)], [np.cos(ANGLE), np.sin(ANGLE)]])
    return U, frame @ jump


def numbers(size: float, factor: float) -> tuple[float, Floats]:
    """G, and the jump at the mouth across and along the crack."""
    made = body(size)
    longer, _ = solved(made, shifted(made, _SHIFT), factor)
    shorter, _ = solved(made, shifted(made, -_SHIFT), factor)
    _, jump = solved(made, made.points, factor)
    return (longer - shorter) / (2 * _SHIFT * LENGTH), jump


if __name__ == "__main__":
    for factor, sizes in ((1.0, (0.2, 0.1, 0.05)), (-1.0, (0.2, 0.1))):  # contact takes minutes
        for size in sizes:
            G, jump = numbers(size, factor)
            print(f"factor {factor:+.0f}, cells at the tip {size}: G {G:.7g}, jump {jump}")
