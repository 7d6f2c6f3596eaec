"""Write the small mesh files of the tests with gmsh, meshio and pyvista themselves.

Run `python tests/data/make.py` to make them anew; the tests only read them.
"""

from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def write(gmsh: Any, name: str, **options: float) -> None:
    for option, value in {"MshFileVersion": 4.1, "Binary": 0, "SaveAll": 0, **options}.items():
        gmsh.option.setNumber(f"Mesh.{option}", value)
    gmsh.write(str(HERE / name))


def two_part_plate(gmsh: Any, groups: bool) -> None:
    """Plate 2 x 1, cut along its diagonal into two surfaces."""
    gmsh.model.add("plate")
    geo = gmsh.model.geo
    p = [geo.addPoint(x, y, 0.5) for x, y in [(0, 0), (2, 0), (2, 1), (0, 1)]]
    side = [geo.addLine(p[i], p[(i + 1) % 4]) for i in range(4)]
    diagonal = geo.addLine(p[0], p[2])
    lower = geo.addPlaneSurface([geo.addCurveLoop([side[0], side[1], -diagonal])])
    upper = geo.addPlaneSurface([geo.addCurveLoop([diagonal, side[2], side[3]])])
    geo.synchronize()
    if groups:
        group = gmsh.model.addPhysicalGroup
        group(1, [side[3]], 1, "left")
        group(1, [side[1]], 2, "right")
        group(1, [side[0], side[1]], 3, "two sides")
        group(1, [side[2]], 9)
        group(1, [diagonal], 4, "body")  # the same name in two dimensions
        group(2, [lower], 11, "lower")
        group(2, [lower, upper], 12, "body")
    gmsh.model.mesh.generate(2)


def cube(gmsh: Any) -> None:
    gmsh.model.add("box")
    occ = gmsh.model.occ
    box = occ.addBox(0, 0, 0, 1, 1, 1)
    occ.synchronize()
    boundary = [tag for _, tag in gmsh.model.getBoundary([(3, box)])]
    bottom = [t for t in boundary if gmsh.model.occ.getCenterOfMass(2, t)[2] < 1e-6]
    gmsh.model.addPhysicalGroup(2, bottom, 5, "bottom")
    gmsh.model.addPhysicalGroup(3, [box], 6, "body")
    gmsh.model.mesh.generate(3)


def main() -> None:
    # Here, since pytest looks for doctests in this file also where gmsh does not load.
    import gmsh
    import meshio
    import pyvista

    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    two_part_plate(gmsh, groups=True)
    write(gmsh, "plate_41.msh")
    write(gmsh, "plate_41_binary.msh", Binary=1)
    write(gmsh, "plate_22.msh", MshFileVersion=2.2)
    write(gmsh, "plate_22_binary.msh", MshFileVersion=2.2, Binary=1)
    write(gmsh, "plate.inp", SaveGroupsOfNodes=1)
    write(gmsh, "plate_save_all.msh", SaveAll=1)
    gmsh.model.mesh.setOrder(2)
    write(gmsh, "order_2.msh")
    gmsh.model.remove()
    two_part_plate(gmsh, groups=False)
    write(gmsh, "no_groups_41.msh")
    write(gmsh, "no_groups_22.msh", MshFileVersion=2.2)
    gmsh.model.mesh.recombine()
    write(gmsh, "quads.msh")
    gmsh.model.remove()
    cube(gmsh)
    write(gmsh, "cube_41.msh")
    write(gmsh, "cube_22.msh", MshFileVersion=2.2)
    write(gmsh, "cube.inp")
    gmsh.model.mesh.clear([(3, 1)])
    gmsh.model.removePhysicalGroups()
    write(gmsh, "surface_in_space.msh")
    gmsh.finalize()

    read = meshio.read(HERE / "no_groups_22.msh")
    grid = pyvista.UnstructuredGrid({5: read.cells_dict["triangle"]}, read.points)
    grid.cell_data["set:core"] = (grid.cell_centers().points[:, 0] < 1.0).astype("i4")
    grid.save(HERE / "pyvista.vtu")
    square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    triangles = [[0, 1, 2], [0, 2, 3]]
    meshio.Mesh(square, [("triangle", triangles)]).write(HERE / "meshio.vtu")


if __name__ == "__main__":
    main()
