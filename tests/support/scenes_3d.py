"""Scenes in 3D: boxes of tetrahedra, flat cracks in them, exact data on their sides."""

import numpy as np

import xcrack as xc
from support import exact
from support.scenes_2d import numerics_of

STEEL = xc.Isotropic(1.0, 0.3)
SIX = ("left", "right", "front", "back", "bottom", "top")


def perturbed(n, seed, amplitude=0.15, half=1.0):
    """Cube [-half, half]³ of n³ · 6 tetrahedra whose inner points move by a share of a cell."""
    mesh = xc.box((-half,) * 3, (half,) * 3, n)
    rng = np.random.default_rng(seed)
    x = np.array(mesh.points)
    inner = (np.abs(x) < half * (1 - 1e-9)).all(axis=1)
    x[inner] += amplitude * 2 * half / n * rng.uniform(-1, 1, (int(inner.sum()), 3))
    return xc.Mesh(x, mesh.cells, mesh.facet_sets)


def unit(v):
    """A vector of length 1."""
    return np.asarray(v, dtype=float) / np.linalg.norm(v)


def axes(normal):
    """Two unit vectors in the plane with this normal, right-handed with it."""
    n = unit(normal)
    first = unit(np.cross(n, np.eye(3)[np.argmin(np.abs(n))]))
    return first, np.cross(n, first)


def sheet(normal, offset, reach=4.0):
    """Plane crack that is far larger than the cube: it cuts it in two."""
    first, second = axes(normal)
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return xc.plane_crack(
        [offset * unit(normal) + reach * (a * first + b * second) for a, b in corners]
    )


def half_sheet(x, z, slope=0.0):
    """Crack z = const from the left side up to a straight front at x (moving by slope y)."""
    ends = ((-2.0, -2.0), (x - 2 * slope, -2.0), (x + 2 * slope, 2.0), (-2.0, 2.0))
    return xc.plane_crack([(*end, z) for end in ends])


def square_crack(half, z):
    """Square [-half, half]² at height z."""
    ends = ((-half, -half), (half, -half), (half, half), (-half, half))
    return xc.plane_crack([(*end, z) for end in ends])


def section_area(normal, offset, half=1.0):
    """Area of the section of a plane with the cube [-half, half]³, by its convex polygon."""
    n = unit(normal)
    corner = half * np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    level = corner @ n - offset
    cut = []
    for a in range(8):
        for b in range(a):
            edge = np.abs(corner[a] - corner[b]).sum() == 2 * half
            if edge and level[a] * level[b] < 0:
                t = level[a] / (level[a] - level[b])
                cut.append((1 - t) * corner[a] + t * corner[b])
    x = np.array([c for c in cut] + [c for c, v in zip(corner, level, strict=True) if v == 0])
    if len(x) < 3:
        return 0.0
    first, second = axes(n)
    p = np.stack([x @ first, x @ second], axis=1)
    around = p - p.mean(axis=0)
    p = p[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    q = np.roll(p, -1, axis=0)
    return float(abs((p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]).sum()) / 2)


def flat_penny(n, z, a, stress, *, seed=None, contact="off", **options):
    """Penny crack of radius a at height z under its exact displacements on all sides.

    Parameters
    ----------
    stress : (szz, sxz)
    seed : of the perturbed mesh; None for the structured one
    """
    S = np.zeros((3, 3))
    S[2, 2], S[0, 2], S[2, 0] = stress[0], stress[1], stress[1]
    mesh = xc.box((-1, -1, -1), (1, 1, 1), n) if seed is None else perturbed(n, seed)
    centre = np.array([0.0, 0.0, z])
    return xc.Problem(
        mesh,
        STEEL,
        [xc.penny_crack(centre, (0, 0, 1), a)],
        supports=[xc.displacement("boundary", lambda x: exact.penny(x - centre, a, 1.0, 0.3, S))],
        contact=contact,
        numerics=numerics_of(**options),
        order=1,
    )


def opening(solution, crack=0):
    """Volume between the crack faces, and the integral of the squared normal jump."""
    from xcrack.fem.facets import jump_matrix

    lips = solution.lips[crack]
    jump = jump_matrix(solution.space, crack, lips) @ solution.u
    return float(lips.weight @ jump), float(lips.weight @ jump**2)


def cap(rings, radius=2.0, angle=np.pi / 4, middle=(0.011, -0.007, 0.019)):
    """Points, triangles and centre of a spherical cap; the middle of its rim is given."""
    points, triangles = [(0.0, 0.0, radius)], []
    for i in range(1, rings + 1):
        t, s = angle * i / rings, np.pi * np.arange(6 * i) / (3 * i)
        ring = [np.sin(t) * np.cos(s), np.sin(t) * np.sin(s), np.cos(t) + 0 * s]
        points += (radius * np.transpose(ring)).tolist()
        outer, inner = 1 + 3 * i * (i - 1), 1 + 3 * (i - 1) * (i - 2) if i > 1 else 0
        for sector in range(6):
            for j in range(i):
                a, b = (outer + (sector * i + j + k) % (6 * i) for k in (0, 1))
                c, d = (inner + (sector * (i - 1) + j + k) % max(1, 6 * (i - 1)) for k in (0, 1))
                triangles += [(a, b, c), (b, d, c)][: 2 if j < i - 1 else 1]
    centre = np.array(middle) - (0, 0, radius * np.cos(angle))
    return np.array(points) + centre, np.array(triangles), centre
