"""Small scenes, solved once, that inputs are made of."""

import tempfile
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

import xcrack as xc

STEEL = xc.Isotropic(1.0, 0.3, plane="strain")
BODY = xc.Isotropic(1.0, 0.3)
PULL = (xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0)))
PULL_3D = (xc.traction("top", (0.0, 0.0, 1.0)), xc.traction("bottom", (0.0, 0.0, -1.0)))
LINE = ((-1.1, 0.03), (0.1, 0.03))


@cache
def mesh(dim=2):
    return xc.box([-1.0] * dim, [1.0] * dim, {2: 6, 3: 4}[dim])


@cache
def fine_mesh():
    return xc.box((-1, -1), (1, 1), 12)


@cache
def crack(dim=2):
    if dim == 2:
        return xc.line_crack(LINE)
    return xc.penny_crack((0.02, 0.01, 0.03), (0, 0, 1), 0.5, n=16)


@cache
def problem(dim=2, cracked=True):
    cracks = [crack(dim)] if cracked else []
    loads, material = {2: (PULL, STEEL), 3: (PULL_3D, BODY)}[dim]
    return xc.Problem(mesh(dim), material, cracks, loads=loads)


@cache
def solution(dim=2, cracked=True):
    return xc.solve(problem(dim, cracked))


@cache
def split():
    """A crack along the interface of two materials."""
    mesh = xc.box((-1, -1), (1, 1), 6)
    mesh = mesh.with_cell_sets({"one": lambda x: x[:, 1] < 0, "two": lambda x: x[:, 1] > 0})
    materials = {"one": xc.Isotropic(1.0, 0.3, "strain"), "two": xc.Isotropic(2.0, 0.3, "strain")}
    pull = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    return xc.solve(xc.Problem(mesh, materials, [xc.line_crack([(-1, 0), (0.1, 0)])], loads=pull))


@cache
def states():
    return xc.solve(problem(), [0.0, 1.0])


@cache
def sif(dim=2):
    return xc.stress_intensity(solution(dim))


@cache
def growing():
    """A problem in which growth takes little time."""
    return xc.Problem(mesh(), STEEL, [crack()], loads=PULL)


def steps(**options):
    wanted = {"da": 0.2, "progress": False, "max_steps": 2, **options}
    return xc.grow(growing(), xc.paris(1e-3, 2.0), xc.max_hoop_stress, xc.Cycle(0.0, 1.0), **wanted)


@cache
def history(dim=2):
    if dim == 2:
        return xc.collect(steps())
    law, cycle = xc.paris(1e-3, 2.0), xc.Cycle(0.0, 1.0)
    return xc.collect(
        xc.grow(problem(3), law, xc.max_hoop_stress, cycle, 0.3, progress=False, max_steps=1)
    )


@cache
def stored():
    """A folder with a run that was ended, for copies."""
    folder = Path(tempfile.mkdtemp(prefix="xcrack_fuzz_")) / "run"
    xc.collect(steps(), folder)
    return folder


@cache
def chart():
    from xcrack.verification.charting.result import Chart, ChartRow

    rows = tuple(
        ChartRow("as given", {}, k, 0.5**k, 100 * 4**k, 0.01 * 4**k, 0.1 * 0.25**k, np.ones(1))
        for k in range(3)
    )
    return Chart(rows, rows[-1], 1e-3, "K", None, 1)


def inside(dim=2):
    """Points of the body, none of them on the crack."""
    return np.random.default_rng(87129).uniform(-0.9, 0.9, (5, dim)) + 0.011


@cache
def step_file():
    """A STEP file of a box."""
    from xcrack.mesh.gmsh_session import session

    path = Path(tempfile.mkdtemp(prefix="xcrack_fuzz_")) / "box.step"
    with session() as gmsh:
        gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    return path


@contextmanager
def folder():
    """A folder that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="xcrack_fuzz_") as path:
        yield Path(path)
