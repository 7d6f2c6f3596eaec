"""Make the meshes of the examples with gmsh.

The files lie beside this script, so that the examples run where gmsh does not.
Run `python examples/meshes/make.py` to make them anew.
"""

from pathlib import Path

import numpy as np

from xcrack.mesh.files import write_mesh
from xcrack.mesh.gmsh_session import graded_size, session
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.plates import mesh_model, plate, plate_with_hole

HERE = Path(__file__).parent

# Where the two cracks of two_holes.py are expected to run; the second is the first one turned.
TURN = np.array([20.0, 10.0])
PATH = np.array(
    [(0.0, 2.85), (2.0, 3.07), (3.8, 3.6), (5.4, 3.43), (7.3, 3.32), (9.2, 3.41), (10.4, 3.67),
     (11.3, 4.15), (12.9, 5.2)]
)  # fmt: skip
PATHS = (PATH, TURN - PATH)
HOLES = (((3.0, 7.0), 2.0), ((17.0, 3.0), 2.0))

BORES = ((-8.0, 0.0, 3.0), (10.0, 8.0, 4.0), (9.0, -11.0, 2.5))  # of small_crack.py: x, y, radius
THREE_HOLES = (((14.0, 22.0), 4.0), ((34.0, 14.0), 5.0), ((48.0, 27.0), 3.0))  # flaw_campaign.py

# The crack of turning_load.py, and the fan of directions in which its criteria let it grow.
TURNING = (
    [(-7.0, 2.8), (-4.0, 0.0), (4.0, 0.0), (7.0, -2.8)],
    [(-8.0, 0.0), (-4.0, 0.0)],
    [(4.0, 0.0), (8.0, 0.0)],
)


def short(mesh: Mesh) -> Mesh:
    """Round coordinates to 6 decimals, so that the files are short and still exact."""
    return Mesh(np.round(mesh.points, 6), mesh.cells, mesh.facet_sets, mesh.cell_sets)


def infinite_plate(parts: int) -> Mesh:
    """Hole of radius 1 in [-4, 4]^2, cells of 1/parts at the hole and on the crack's line.

    Band and transition are the same in all of them: every cell shrinks with h, as rates need.
    """
    h = 1.0 / parts
    return plate_with_hole(
        width=8.0, height=8.0, radius=1.0, size=3 * h, size_near=h,
        along=[(1.0, 0.0), (3.0, 0.0)], band=0.1, transition=1.25,
    )  # fmt: skip


def half_of_two_holes() -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Left half (x <= 10) of the plate; its cut nodes are symmetric about (10, 5)."""
    length = graded_size([(x, y, r) for (x, y), r in HOLES], PATHS, 0.6, 0.25, 0.5, 1.2)
    with session() as gmsh:
        geo = gmsh.model.geo
        corners = [(0, 0), (10, 0), (10, 5), (10, 10), (0, 10)]
        p = [geo.addPoint(x, y, 0) for x, y in corners]
        side = [geo.addLine(p[i], p[(i + 1) % 5]) for i in range(5)]
        (x, y), r = HOLES[0]
        middle = geo.addPoint(x, y, 0)
        rim = [geo.addPoint(x + r * c, y + r * s, 0) for c, s in [(1, 0), (0, 1), (-1, 0), (0, -1)]]
        arc = [geo.addCircleArc(rim[i], middle, rim[(i + 1) % 4]) for i in range(4)]
        geo.addPlaneSurface([geo.addCurveLoop(side), geo.addCurveLoop(arc)])
        geo.synchronize()
        half_turn = [-1, 0, 0, 20, 0, -1, 0, 10, 0, 0, 1, 0, 0, 0, 0, 1]
        gmsh.model.mesh.setPeriodic(1, [side[2]], [side[1]], half_turn)
        bottom, low, high, top, left = side
        curves = {"left": [left], "bottom": [bottom], "top": [top], "hole_0": arc}
        return mesh_model(gmsh, {**curves, "low": [low], "high": [high]}, length)


def two_holes() -> Mesh:
    """Mesh that a half turn about (10, 5) maps onto itself, to the last bit.

    Coordinates are multiples of 2^-13: such numbers, and 20 - x and 10 - y, have no round-off.
    """
    points, cells, facets = half_of_two_holes()
    points = np.round(points * 2.0**13) / 2.0**13
    low, high = np.unique(facets.pop("low")), np.unique(facets.pop("high"))
    points[low, 0] = points[high, 0] = 10.0
    points[high[np.argsort(points[high, 1])]] = TURN - points[low[np.argsort(-points[low, 1])]]
    cut = {points[i].tobytes(): i for i in np.union1d(low, high)}
    turned = TURN - points
    new = np.full(len(points), -1)
    for i in np.union1d(low, high):
        new[i] = cut[turned[i].tobytes()]
    free = new < 0
    new[free] = len(points) + np.arange(free.sum())
    sets = {
        "left": facets["left"],
        "right": new[facets["left"]],
        "bottom": np.concatenate([facets["bottom"], new[facets["top"]]]),
        "top": np.concatenate([facets["top"], new[facets["bottom"]]]),
        "hole_0": facets["hole_0"],
        "hole_1": new[facets["hole_0"]],
    }
    return Mesh(np.concatenate([points, turned[free]]), np.concatenate([cells, new[cells]]), sets)


def meshes() -> dict[str, Mesh]:
    """All meshes by the name of their file."""
    made = {f"plate_with_hole_{n:02d}": infinite_plate(n) for n in (5, 10, 20, 40)}
    made["finite_plate"] = plate_with_hole(
        width=100.0, height=100.0, radius=5.0, size=4.0, size_near=0.25,
        along=[(5.0, 0.0), (12.0, 0.0)], band=1.0, transition=12.5,
    )  # fmt: skip
    made["edge_crack"] = plate(
        50.0, 100.0, lower=(0.0, -50.0), size=5.0, size_near=1.0,
        along=[(0.0, 0.0), (50.0, 0.0)], band=2.0, transition=20.0,
    )  # fmt: skip
    made["two_holes_free"] = plate(
        20.0, 10.0, holes=HOLES, size=0.6, size_near=0.25, along=PATHS, band=0.5, transition=1.2
    )
    made["turning_load"] = plate(
        40.0, 40.0, lower=(-20.0, -20.0), size=4.0, size_near=0.3,
        along=TURNING, band=0.6, transition=14.0,
    )  # fmt: skip
    width = 50.0  # of compact_tension.py; the load line is at x = 0
    made["compact_tension"] = plate(
        1.25 * width, 1.2 * width, lower=(-0.25 * width, -0.6 * width),
        holes=[((0.0, 0.275 * width), 0.125 * width), ((0.0, -0.275 * width), 0.125 * width)],
        size=4.0, size_near=1.0, along=[(0.2 * width, 0.0), (0.85 * width, 0.0)], band=1.0,
        transition=15.0,
    )  # fmt: skip
    made["three_holes"] = plate(
        60.0, 40.0, holes=THREE_HOLES, size=5.0, size_near=0.5, band=2.5, transition=10.0
    )
    made["lug_spectrum"] = plate(
        40.0, 60.0, lower=(-20.0, -40.0), holes=[((0.0, 0.0), 10.0)], size=3.0, size_near=0.4,
        along=[(10.0, 0.0), (20.0, 0.0)], band=0.8, transition=15.0,
    )  # fmt: skip
    return {**{name: short(mesh) for name, mesh in made.items()}, "two_holes": two_holes()}


def lug(path: Path) -> None:
    """Lug of corner_crack_at_hole.py, of second order, in the form of Abaqus, written by gmsh."""
    with session() as gmsh:
        occ = gmsh.model.occ
        head = occ.addCylinder(0, 0, 0, 0, 0, 8, 20)
        shank = occ.addBox(-60, -20, 0, 60, 40, 8)
        body, _ = occ.fuse([(3, head)], [(3, shank)])
        occ.cut(body, [(3, occ.addCylinder(0, 0, -1, 0, 0, 10, 10))])
        occ.synchronize()
        faces = gmsh.model.getEntities(2)
        boxes = {tag: np.array(gmsh.model.getBoundingBox(2, tag)) for _, tag in faces}
        hole = [t for t, b in boxes.items() if np.abs(b[[0, 1, 3, 4]]).max() < 10.1]
        end = [t for t, b in boxes.items() if b[3] < -59]
        gmsh.model.addPhysicalGroup(2, hole, 1, "hole")
        gmsh.model.addPhysicalGroup(2, end, 2, "end")
        for z, name in ((0, "back"), (8, "front")):
            flat = [t for t, b in boxes.items() if np.abs(b[[2, 5]] - z).max() < 0.1]
            gmsh.model.addPhysicalGroup(2, flat, 3 + z, name)
        gmsh.model.addPhysicalGroup(3, [gmsh.model.getEntities(3)[0][1]], 20, "lug")
        gmsh.model.mesh.setSizeCallback(
            lambda _dim, _tag, x, y, _z, _size: 3.0 + max(0.0, np.hypot(x, y) - 10.0) / 10.0
        )
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
        gmsh.write(str(path))
    path.write_text(path.read_text().replace(str(path), "lug"))  # its heading


def small_crack(path: Path) -> None:
    """Plate of small_crack.py: 50 × 50 × 10 with three holes, coarse tetrahedra of gmsh."""
    with session() as gmsh:
        occ = gmsh.model.occ
        plate = occ.addBox(-25, -25, 0, 50, 50, 10)
        occ.cut([(3, plate)], [(3, occ.addCylinder(x, y, -1, 0, 0, 12, r)) for x, y, r in BORES])
        occ.synchronize()
        for k, (x, y, r) in enumerate(BORES):
            box = (x - r - 0.1, y - r - 0.1, -0.1, x + r + 0.1, y + r + 0.1, 10.1)
            faces = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, dim=2)]
            gmsh.model.addPhysicalGroup(2, faces, 1 + k, f"hole_{k}")
        for k, (name, y) in enumerate((("bottom", -25), ("top", 25))):
            box = (-25.1, y - 0.1, -0.1, 25.1, y + 0.1, 10.1)
            faces = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, dim=2)]
            gmsh.model.addPhysicalGroup(2, faces, 10 + k, name)
        gmsh.model.addPhysicalGroup(3, [gmsh.model.getEntities(3)[0][1]], 20, "plate")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 6.0)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 2.0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 10)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))


def inclusion(path: Path) -> None:
    """Plate of inclusion.py, with a disc of another material as a cell set."""
    with session() as gmsh:
        occ = gmsh.model.occ
        plate, disc = occ.addRectangle(0, -30, 0, 60, 60), occ.addDisk(30, 9, 0, 7, 7)
        _, parts = occ.fragment([(2, plate)], [(2, disc)])
        occ.synchronize()
        inside = [tag for _, tag in parts[1]]
        outside = [tag for _, tag in parts[0] if tag not in inside]
        gmsh.model.addPhysicalGroup(2, inside, 1, "inclusion")
        gmsh.model.addPhysicalGroup(2, outside, 2, "plate")
        sides = {"left": (0, 0), "right": (0, 60), "bottom": (1, -30), "top": (1, 30)}
        for k, (name, (axis, value)) in enumerate(sides.items()):
            centres = [(occ.getCenterOfMass(1, t)[axis], t) for _, t in gmsh.model.getEntities(1)]
            on_side = [tag for centre, tag in centres if abs(centre - value) < 1e-6]
            gmsh.model.addPhysicalGroup(1, on_side, 10 + k, name)
        size = gmsh.model.mesh.field.add("Box")
        box = {"VIn": 0.9, "VOut": 4, "XMin": 8, "XMax": 48, "YMin": -6, "YMax": 18,
               "Thickness": 14}  # fmt: skip
        for key, value in box.items():
            gmsh.model.mesh.field.setNumber(size, key, value)
        gmsh.model.mesh.field.setAsBackgroundMesh(size)
        for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(path))


if __name__ == "__main__":
    inclusion(HERE / "inclusion.msh")
    lug(HERE / "lug.inp")
    small_crack(HERE / "small_crack.msh")
    for name, mesh in meshes().items():
        path = HERE / f"{name}.msh"
        write_mesh(path, mesh)
        print(f"{path.name:24} {path.stat().st_size / 1e3:6.0f} kB  {mesh}")
