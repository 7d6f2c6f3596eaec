"""Scenes whose K is known along a front in 3D: graded boxes, flat cracks, their exact fields."""

import warnings

import numpy as np

import xcrack as xc
from support import exact, front_fields
from support.scenes_2d import numerics_of

NU = 0.3


def turn(axis, angle):
    """Rotation about an axis (Rodrigues); its rows are the turned axes' components."""
    k = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def lines(low, high, fine, h, ratio=1.5):
    """Coordinates from low to high: spacing about h between both of fine, growing beyond."""
    start, stop = fine
    inner = np.linspace(start, stop, max(1, round((stop - start) / h)) + 1)

    def away(length):
        if length <= 1e-9 * h:
            return np.zeros(0)
        steps = [h * ratio]
        while sum(steps) < length:
            steps.append(steps[-1] * ratio)
        return length * np.cumsum(steps) / sum(steps)

    return np.concatenate([start - away(start - low)[::-1], inner, stop + away(high - stop)])


def graded(lines_of_axis, *, seed=None, amplitude=0.15, rotation=None):
    """Box along given lines; its inner points move by a share of their cell, then all is turned."""
    n = [len(line) - 1 for line in lines_of_axis]
    mesh = xc.box((0.0, 0.0, 0.0), tuple(map(float, n)), tuple(n))
    place = np.round(mesh.points).astype(int)
    x = np.stack([line[place[:, k]] for k, line in enumerate(lines_of_axis)], axis=1)
    if seed is not None:
        rng = np.random.default_rng(seed)
        for k, line in enumerate(lines_of_axis):
            gap = np.minimum(np.diff(line, prepend=np.nan), np.diff(line, append=np.nan))
            drawn = amplitude * gap[place[:, k]] * rng.uniform(-1, 1, len(x))
            x[:, k] += np.where(np.isnan(drawn), 0.0, drawn)
    return xc.Mesh(x if rotation is None else x @ rotation, mesh.cells, mesh.facet_sets)


def flat_scene(
    h, *, a=0.5, b=None, stress, tilt=0.07, rotation=None, seed=None, contact="off",
    half=1.1, margin=0.2, depth=0.3, center=(0.013, -0.021, 0.0117), E=1.0, nu=NU, scale=1.0,
    points=128, **options,
):  # fmt: skip
    """Penny, or ellipse where b is given, under its exact displacements on all sides of a box.

    Parameters
    ----------
    h : float
        Cell legs around the crack.
    stress : (szz, sxz, syz)
        Remote stress in the axes of the crack.
    tilt : float
        Angle of the crack to the lines of the mesh.
    rotation : (3, 3) array, optional
        Of mesh and crack together.
    margin, depth : float
        How far the fine cells reach beyond the front, and to both sides of the crack.

    Returns
    -------
    problem, axes : Problem, (3, 3) array
        Rows of axes: half-axis a, half-axis b, normal.
    """
    turned = np.eye(3) if rotation is None else rotation
    Q = turn((1.0, 2.0, 0.5), tilt) @ turned
    c = scale * np.asarray(center) @ turned
    second = a if b is None else b
    reach = (a + margin, second + margin, depth)
    axes = [lines(-half, half, (-w, w), h) for w in reach]
    mesh = graded([scale * x for x in axes], seed=seed, rotation=turned)
    S = np.zeros((3, 3))
    S[2, 2] = stress[0]
    S[0, 2] = S[2, 0] = stress[1]
    S[1, 2] = S[2, 1] = stress[2]
    if b is None:
        crack = xc.penny_crack(c, Q[2], scale * a, n=points)
    else:
        crack = xc.elliptic_crack(c, Q[2], Q[0], scale * a, scale * b, n=points)

    def u(x):
        local = (x - c) @ Q.T
        if b is None:
            return exact.penny(local, scale * a, E, nu, S) @ Q
        return front_fields.ellipse(local, scale * a, scale * b, E, nu, S) @ Q

    problem = xc.Problem(
        mesh, xc.Isotropic(E=E, nu=nu), [crack], supports=[xc.displacement("boundary", u)],
        contact=contact, numerics=numerics_of(**options), order=1,
    )  # fmt: skip
    return problem, (c, Q)


def exact_K(x, place, a, b, stress, nu=NU):
    """K (f, 3) at points on the front of a flat crack, in its frames (ahead, normal, along).

    Their third row runs clockwise seen from the normal: K_III is minus that of `exact`.
    """
    c, Q = place
    local = (x - c) @ Q.T
    szz, sxz, syz = stress
    if b is None:
        angle = np.arctan2(local[:, 1], local[:, 0]) - np.arctan2(syz, sxz)
        K = exact.penny_K(angle, a, nu, szz, np.hypot(sxz, syz))
    else:
        angle = np.arctan2(local[:, 1] / b, local[:, 0] / a)
        K = exact.ellipse_K(angle, a, b, nu, szz, sxz, syz)
    return np.stack([K[0], K[1], -K[2]], axis=1)


def K_along(problem, crack=0):
    """K along the fronts of a crack, without a word about domains that differ."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", xc.XcrackWarning)
        return xc.stress_intensity(xc.solve(problem), crack)
