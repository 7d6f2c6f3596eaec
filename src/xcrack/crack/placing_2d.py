"""Cracks in 2D put into a mesh: which ends are tips, and mouths led outside."""

import numpy as np
from scipy.spatial import cKDTree

from xcrack.arrays import Floats
from xcrack.crack.crack import Crack
from xcrack.crack.lines import crossing_point
from xcrack.crack.tips_2d import tip_frames
from xcrack.errors import GeometryError
from xcrack.mesh.locate import contains, locate, nearest_boundary
from xcrack.mesh.mesh import Mesh

_MOUTH = 0.5  # an end within this share of a cell from the boundary is a mouth


def place_line(crack: Crack, mesh: Mesh) -> Crack:
    """Decide which ends of a crack are tips in this mesh, and prolong its mouths outwards.

    Parameters
    ----------
    crack : Crack
        If its tips are known already, only these are looked at again.
    mesh : Mesh

    Returns
    -------
    Crack
        With `tips` set; a mouth lies at least one cell outside the body.

    Raises
    ------
    GeometryError
        No part of the crack lies inside the body; or the crack is shorter than a cell, or ends
        less than half a cell inside the boundary that it comes from.
    """
    last = len(crack.points) - 1
    candidates = (0, last) if crack.tips is None else crack.tips
    points = np.array(crack.points)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    within = contains(mesh, points[[0, last]])
    if not within.any() and not contains(mesh, _samples(points)).any():
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        raise GeometryError(
            f"the crack from {points[0].tolist()} to {points[-1].tolist()} lies outside the body, "
            f"which fills [{low.tolist()}, {high.tolist()}]: move it inside."
        )
    tips = []
    for end, inside in zip((0, last), within.tolist()):
        inward = 1 if end == 0 else last - 1
        out = (points[end] - points[inward]) / np.linalg.norm(points[end] - points[inward])
        gap, size = nearest_boundary(mesh, points[end])
        if end in candidates and inside and gap > _MOUTH * size:
            tips.append(end)
            continue
        if end not in candidates:
            continue
        if inside:
            _check_nick(mesh, points[end], out, gap, size)
        outside = -gap if inside else gap
        if outside < size:
            points[end] = _prolonged(mesh, points[end], out, size)
    placed = Crack(points, crack.faces, tuple(tips))
    if tips:
        h = _cell_sizes(mesh, points[tips])
        if length.sum() < h.min():
            raise GeometryError(
                f"the crack at {points[tips[0]].tolist()} has length {length.sum():.4g}, less than "
                f"the cell there ({h.min():.4g}): refine the mesh around it or leave it out."
            )
    return placed


def _samples(points: Floats) -> Floats:
    """Nine points on each piece of a polyline."""
    share = np.linspace(0, 1, 9)[:, None]
    return np.concatenate([a + share * (b - a) for a, b in zip(points, points[1:], strict=False)])


def _check_nick(mesh: Mesh, end: Floats, out: Floats, gap: float, size: float) -> None:
    """Raise where a crack has just come in through the boundary that its end is close to."""
    ahead = end + 0.25 * size * out
    if contains(mesh, ahead[None])[0] and nearest_boundary(mesh, ahead)[0] > gap + 0.01 * size:
        raise GeometryError(
            f"the crack ends at {np.round(end, 6).tolist()}, {gap:.4g} inside the boundary that it "
            f"comes from, which is less than half a cell ({size:.4g}): refine the mesh there, or "
            "leave this part of the crack out."
        )


def _prolonged(mesh: Mesh, end: Floats, out: Floats, size: float) -> Floats:
    """The end moved one cell outside the body, or half way across a narrower gap in it."""
    step = size / 8
    steps = step * np.arange(97)
    inside = contains(mesh, end + steps[:, None] * out)
    first_out = int(np.argmin(inside)) if not inside.all() else len(steps) - 1
    again = np.nonzero(inside[first_out:])[0]
    gap = float(again[0]) * step if len(again) else np.inf
    return np.asarray(end + out * (steps[first_out] + min(size, gap / 2)))


def _cell_sizes(mesh: Mesh, x: Floats) -> Floats:
    cell, _ = locate(mesh, x)
    return mesh.cell_size[np.maximum(cell, 0)]


def check_lines(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise GeometryError where cracks cross, or two tips lie in one cell or closer than one."""
    tips: list[Floats] = []
    owner: list[int] = []
    for i, crack in enumerate(cracks):
        x, _ = tip_frames(crack)
        tips.extend(x)
        owner.extend([i] * len(x))
        for j in range(i):
            crossing = crossing_point(cracks[j].points, crack.points, same=False)
            if crossing is not None:
                raise GeometryError(
                    f"cracks {j} and {i} cross near {np.round(crossing, 6).tolist()}: crossing and "
                    "branching cracks are not supported; end one of them a few cells before."
                )
    if len(tips) < 2:
        return
    x = np.array(tips)
    cell, _ = locate(mesh, x)
    size = mesh.cell_size[np.maximum(cell, 0)]
    for i, j in sorted(cKDTree(x).query_pairs(float(size.max()))):
        apart = float(np.linalg.norm(x[i] - x[j]))
        if apart < min(size[i], size[j]) or cell[i] == cell[j]:
            raise GeometryError(
                f"a tip of crack {owner[i]} at {np.round(x[i], 6).tolist()} and one of crack "
                f"{owner[j]} at {np.round(x[j], 6).tolist()} are {apart:.4g} apart, closer than a "
                f"cell ({size[i]:.4g}): refine the mesh between them, or join the cracks."
            )
