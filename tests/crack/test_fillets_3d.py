"""Cracks at a fillet of a shaft, the root of a groove and of a thread, in bodies that gmsh meshes.

A penny that begins at the surface of a round section and advances evenly covers what it has in
common with that section: the lens of two circles, exactly. K is compared with a finer mesh.
"""

import numpy as np
import pytest

import xcrack as xc
from support.rows import slow
from xcrack.crack.advance_3d import advance_fronts
from xcrack.crack.measures import area_inside, front_ends
from xcrack.crack.placing_3d import place_surface
from xcrack.crack.stations import stations_of
from xcrack.mesh.gmsh_session import session
from xcrack.mesh.locate import Body, cell_sizes

HALF = 1.5  # of the length
DEPTH = 0.15  # of the crack
# Corners (r, z, radius of the fillet) of the half section; radius of the section that is cracked,
# and its height.
FILLET = [(0.5, -HALF, 0), (0.5, 0, 0.1), (0.8, 0, 0), (0.8, HALF, 0)]
GROOVE = [(0.5, -HALF, 0), (0.5, -0.1, 0), (0.4, 0, 0.08), (0.5, 0.1, 0), (0.5, HALF, 0)]
THREAD = [
    (0.5, -HALF, 0),
    *(
        corner
        for k in (-1, 0, 1)
        for corner in ((0.5, 0.22 * k - 0.08, 0), (0.4, 0.22 * k, 0.06), (0.5, 0.22 * k + 0.08, 0))
    ),
    (0.5, HALF, 0),
]
BODIES = {
    "fillet": (FILLET, 0.6 - np.sqrt(0.1**2 - 0.02**2), -0.08),
    "groove": (GROOVE, 0.4 + 0.08 * (np.sqrt(2) - 1), 0.0),
    "thread": (THREAD, 0.4 + 0.06 * (1 / np.sin(np.arctan2(0.08, 0.1)) - 1), 0.0),
}


def rounded(occ, corners):
    """Curves of a half section from the axis to the axis, with fillets."""
    x = np.array([(c[0], 0, c[1]) for c in corners], dtype=float)
    x = np.concatenate([[(0, 0, -HALF)], x, [(0, 0, HALF)]])
    radius = [0, *(c[2] for c in corners), 0]
    first = last = occ.addPoint(*x[0])
    curves = []
    for k in range(1, len(x)):
        if not radius[k]:
            begin = end = occ.addPoint(*x[k])
            arc = []
        else:
            to = [(x[j] - x[k]) / np.linalg.norm(x[j] - x[k]) for j in (k - 1, k + 1)]
            half = np.arccos(to[0] @ to[1]) / 2
            tangent = radius[k] / np.tan(half)
            middle = (to[0] + to[1]) / np.linalg.norm(to[0] + to[1]) * radius[k] / np.sin(half)
            begin, centre, end = (
                occ.addPoint(*(x[k] + d)) for d in (tangent * to[0], middle, tangent * to[1])
            )
            arc = [occ.addCircleArc(begin, centre, end)]
        curves += [occ.addLine(last, begin), *arc]
        last = end
    return [*curves, occ.addLine(last, first)]


def turned_body(path, corners, at, h):
    """A body of revolution about z, its cells small around a place."""
    off = {"Mesh__MeshSizeFromPoints": 0, "Mesh__MeshSizeExtendFromBoundary": 0}
    with session(**off) as gmsh:
        occ = gmsh.model.occ
        face = occ.addPlaneSurface([occ.addCurveLoop(rounded(occ, corners))])
        solid = occ.revolve([(2, face)], 0, 0, 0, 0, 0, 1, 2 * np.pi)
        place = occ.addPoint(*at)
        occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [tag for dim, tag in solid if dim == 3], name="body")
        for name, z in (("bottom", -HALF), ("top", HALF)):
            around = (-2, -2, z - 1e-3, 2, 2, z + 1e-3)
            faces = gmsh.model.getEntitiesInBoundingBox(*around, dim=2)
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in faces], name=name)
        field = gmsh.model.mesh.field
        distance, size = field.add("Distance"), field.add("MathEval")
        field.setNumbers(distance, "PointsList", [place])
        field.setString(size, "F", f"Min(0.35, {h} + 0.5 * Max(F{distance} - {2 * DEPTH}, 0))")
        field.setAsBackgroundMesh(size)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    return xc.read_mesh(path)


def scene(tmp_path, name, h):
    """Body, crack, radius of the section."""
    corners, radius, z = BODIES[name]
    at = (radius, 0.0, z)
    return turned_body(tmp_path / f"{h}.msh", corners, at, h), at, radius


def lens(radius, reach):
    """Area that a circle has in common with another whose middle is on it."""
    one, two = np.arccos(reach / (2 * radius)), np.arccos(1 - reach**2 / (2 * radius**2))
    segment = reach**2 * (one - np.sin(one) * np.cos(one))
    return segment + radius**2 * (two - np.sin(two) * np.cos(two))


@pytest.mark.parametrize("name", [*slow("groove", "thread"), "fillet"])
def test_an_even_front_covers_the_lens_of_two_circles(tmp_path, name):
    """No face that growth did not make, ends at the surface; the rest are facets of the wall."""
    h, da = 0.06, 0.06
    mesh, at, radius = scene(tmp_path, name, h)
    body = Body.of(mesh)
    crack = place_surface(xc.penny_crack(at, (0, 0, 1), DEPTH), mesh)
    for step in range(6):
        reach = DEPTH + step * da
        inside = crack.points[body.contains(crack.points)]
        # Where an end turns to the facets of the wall, points beside it lead: .072 of a step.
        assert np.linalg.norm(inside - at, axis=1).max() < reach + 0.1 * da
        assert len(crack.fronts) == 1
        assert area_inside(crack, mesh) == pytest.approx(lens(radius, reach), rel=0.03)
        ends = np.array([x for _, x in front_ends(crack, body)])
        assert len(ends) == 2
        assert np.linalg.norm(ends - at, axis=1) == pytest.approx(reach, abs=0.3 * h)
        st = stations_of([crack], mesh)
        size = 0.5 * float(cell_sizes(mesh, st.x).mean())
        even = np.ones(len(st.s))
        crack = advance_fronts(crack, st.s, st.front, 0 * even, da * even, size, body)
        crack = place_surface(crack, mesh)


def pulled(mesh, crack, order):
    pull, steel = xc.traction("top", (0, 0, 100.0)), xc.Isotropic(E=210e3, nu=0.3)
    return xc.Problem(mesh, steel, [crack], [xc.fix("bottom")], [pull], order=order)


def along(sif, at):
    """Angle about the middle of the crack and K_I of a front, from one end to the other."""
    angle = np.arctan2(sif.x[:, 1], at[0] - sif.x[:, 0])
    order = np.argsort(angle)
    return angle[order], sif.K_I[order], sif.at_surface[order]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fillet", "groove", "thread"])
def test_K_at_a_notch_is_that_of_a_finer_mesh(tmp_path, name):
    """Rms of K_I within 2 % of cells that are 1.7 times smaller, the ends within 6 %.

    Discretisation; most of it are facets of the notch, which files of gmsh do not tell to be round:
    those of the fillet make the crack 2 % larger.
    """
    crack = xc.penny_crack((BODIES[name][1], 0.0, BODIES[name][2]), (0, 0, 1), DEPTH)
    front = []
    for h in (0.04, 0.024):
        mesh, at, _ = scene(tmp_path, name, h)
        solution = xc.solve(pulled(mesh, crack, 2))
        front.append(along(xc.stress_intensity(solution), at))
    (angle, K, free), (finer, wanted, _) = front
    off = K / np.interp(angle, finer, wanted) - 1
    rms = float(np.sqrt((off[~free] ** 2).mean()))
    inner = np.abs(angle) < np.radians(60)
    print(f"\n{name}: {solution.n_dof} unknowns, rms {rms:.2%}, within 60 degrees "
          f"{np.abs(off[inner]).max():.2%}, ends {off[0]:.2%} {off[-1]:.2%}")  # fmt: skip
    assert rms < 0.02
    assert np.abs(off).max() < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fillet", "thread"])
def test_a_crack_grows_from_a_notch(tmp_path, name):
    """Four steps: one front with two ends, the faces of each step within its advance."""
    mesh, at, radius = scene(tmp_path, name, 0.06)
    crack = xc.penny_crack(at, (0, 0, 1), DEPTH)
    steps = list(
        xc.grow(
            pulled(mesh, crack, 1), xc.paris(C=1e-12, m=3.0), xc.max_hoop_stress,
            xc.Cycle(0.0, 1.0), da=0.06, max_steps=4, progress=False,
        )
    )  # fmt: skip
    body = Body.of(mesh)
    area = [area_inside(step.corrected[0], mesh) for step in steps]
    print(f"\n{name}: areas {np.round(area, 4)}, N {[round(step.cycles) for step in steps]}")
    for k, step in enumerate(steps):
        grown = step.corrected[0]
        assert len(grown.fronts) == 1
        assert len(front_ends(grown, body)) == 2
        sif = step.sif[-1][0]
        assert sif.K_I[~sif.at_surface].min() > 0
        inside = grown.points[body.contains(grown.points)]
        assert np.linalg.norm(inside - at, axis=1).max() < DEPTH + 0.066 * k + 1e-3
    assert (np.diff(area) > 0).all()
    assert area[-1] < lens(radius, DEPTH + 3 * 0.066)
