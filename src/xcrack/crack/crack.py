"""Cracks as values: their faces and their tips; the mesh knows nothing of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from xcrack.arrays import Bools, Floats, Ints, frozen
from xcrack.errors import GeometryError
from xcrack.mesh.locate import cell_sizes, contains, locate, nearest_boundary
from xcrack.mesh.mesh import Mesh

_MOUTH = 0.5  # an end within this share of a cell from the boundary is a mouth


@dataclass(frozen=True, eq=False)
class Crack:
    """A crack: simplicial faces and the points of its front.

    Parameters
    ----------
    points : (p, d) array, length
        Vertices of the faces; in the plane in the order in which the polyline runs.
    faces : (f, d) array of int
        Point numbers of each face. In the plane lip + is on the left of the order of the points;
        in space the normal by the right-hand rule points to it.
    tips : tuple of int, optional
        In the plane: point numbers of the tips, in the order of the points; None where no mesh
        has decided yet which ends are tips and which are mouths.
    fronts : tuple of (k,) arrays of int, optional
        In space: point numbers along each front, in the direction of the third row of its frames
        (ahead, normal, ahead x normal); a closed front repeats its first point at the end. None
        where no mesh has decided yet.
    """

    points: Floats
    faces: Ints
    tips: tuple[int, ...] | None = None
    fronts: tuple[Ints, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.float64))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64))
        if self.fronts is not None:
            object.__setattr__(self, "fronts", tuple(frozen(f, np.int64) for f in self.fronts))

    @property
    def placed(self) -> bool:
        """Whether a mesh has decided what is front and what is mouth."""
        return (self.tips if self.dim == 2 else self.fronts) is not None

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def n_tips(self) -> int:
        """Number of tips, in space of fronts; 0 where they are not decided yet."""
        return len(self.tips or self.fronts or ())

    def __repr__(self) -> str:
        ends = "not placed" if self.tips is None else f"tips {list(self.tips)}"
        if self.dim == 3 and self.fronts is not None:
            ends = f"{len(self.fronts)} front(s)"
        return f"Crack({len(self.points)} points, {len(self.faces)} faces, {ends})"


def line_crack(points: ArrayLike) -> Crack:
    """Crack in the plane along a polyline.

    An end outside the body, or within half a cell of its boundary, becomes a mouth as soon as
    the crack is put into a mesh; an end inside is a tip. Lip + lies to the left of the order of
    the points.

    Parameters
    ----------
    points : (p, 2) array, length
        At least two points.

    Returns
    -------
    Crack

    Raises
    ------
    GeometryError
        Fewer than two points, nan, points that coincide, a line that crosses itself or turns
        back.

    Examples
    --------
    >>> line_crack([(0, 0), (1, 0), (2, 1)])
    Crack(3 points, 2 faces, not placed)
    """
    x = np.asarray(points, dtype=float)
    if x.ndim != 2 or x.shape[1] != 2 or len(x) < 2:
        raise GeometryError(f"a line crack needs at least two points (p, 2), not shape {x.shape}.")
    if not np.isfinite(x).all():
        raise GeometryError(
            f"crack point {x[~np.isfinite(x).all(axis=1)][0].tolist()} is not finite."
        )
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if (length <= 1e-12 * length.max(initial=0.0)).any() or length.max() == 0:
        i = int(np.argmin(length))
        raise GeometryError(
            f"the crack has a piece of zero length: points {i} and {i + 1} both lie at "
            f"{x[i].tolist()}; leave one out."
        )
    along = np.diff(x, axis=0) / length[:, None]
    turns = (along[1:] * along[:-1]).sum(axis=1)
    if (turns < -1 + 1e-12).any():
        back = x[1 + int(np.argmin(turns))]
        raise GeometryError(
            f"the crack turns back on itself at {np.round(back, 6).tolist()}: leave out what runs "
            "over it twice."
        )
    crossing = _crossing(x, x, same=True)
    if crossing is not None:
        raise GeometryError(
            f"the crack crosses itself near {np.round(crossing, 6).tolist()}: end it there, or "
            "describe it by two cracks that do not meet."
        )
    number = np.arange(len(x))
    return Crack(x, np.stack([number[:-1], number[1:]], axis=1))


def place(crack: Crack, mesh: Mesh) -> Crack:
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
    if crack.dim != mesh.dim:
        raise GeometryError(f"a {crack.dim}D crack cannot be put into a {mesh.dim}D mesh.")
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
        h = cell_sizes(mesh, points[tips])
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


def front(crack: Crack) -> tuple[Floats, Floats]:
    """Tip points and frames of a placed crack.

    Returns
    -------
    points : (f, d) array, length
    frame : (f, d, d) array
        Rows (ahead, normal); the normal points from lip - to lip + at every tip.
    """
    tips = crack.tips or ()
    x = np.zeros((len(tips), 2))
    frame = np.zeros((len(tips), 2, 2))
    for k, tip in enumerate(tips):
        first, second = (1, 0) if tip == 0 else (tip - 1, tip)
        along = crack.points[second] - crack.points[first]
        ahead = along / np.linalg.norm(along)
        left = np.array([-ahead[1], ahead[0]])
        x[k] = crack.points[tip]
        frame[k] = ahead, (-left if tip == 0 else left)
    return x, frame


def crack_length(crack: Crack) -> float:
    """Arc length of all faces of a crack in the plane, length."""
    return float(np.linalg.norm(np.diff(crack.points, axis=0), axis=1).sum())


def advance(crack: Crack, angle: ArrayLike, da: ArrayLike) -> Crack:
    """Let the tips of a placed crack advance; a tip with da = 0 stays to the last bit.

    Parameters
    ----------
    crack : Crack
    angle : (f,) array, rad
        Kink angle of each tip, positive towards the normal of lip +.
    da : (f,) array, length

    Returns
    -------
    Crack
        With one more point at each tip that moved; old points are unchanged.
    """
    x, frame = front(crack)
    beta, step = np.asarray(angle, dtype=float), np.asarray(da, dtype=float)
    moved = x + step[:, None] * (
        np.cos(beta)[:, None] * frame[:, 0] + np.sin(beta)[:, None] * frame[:, 1]
    )
    points = np.array(crack.points)
    for k, tip in enumerate(crack.tips or ()):
        if step[k] != 0:
            new = moved[k : k + 1]
            points = np.concatenate([new, points] if tip == 0 else [points, new])
    tips = [0 if tip == 0 else len(points) - 1 for tip in crack.tips or ()]
    number = np.arange(len(points))
    return Crack(points, np.stack([number[:-1], number[1:]], axis=1), tuple(tips))


def check_cracks(cracks: tuple[Crack, ...], mesh: Mesh) -> None:
    """Raise GeometryError where cracks cross, or two tips lie in one cell or closer than one."""
    tips: list[Floats] = []
    owner: list[int] = []
    for i, crack in enumerate(cracks):
        x, _ = front(crack)
        tips.extend(x)
        owner.extend([i] * len(x))
        for j in range(i):
            crossing = _crossing(cracks[j].points, crack.points, same=False)
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


def _crossing(a: Floats, b: Floats, same: bool) -> Floats | None:
    """A point where polylines a and b cross, or None; neighbours of one line do not count."""
    p, r = a[:-1, None], np.diff(a, axis=0)[:, None]
    q, s = b[None, :-1], np.diff(b, axis=0)[None]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    gap = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * s[..., 1] - gap[..., 1] * s[..., 0]) / cross
        u = (gap[..., 0] * r[..., 1] - gap[..., 1] * r[..., 0]) / cross
    hit: Bools = (cross != 0) & (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
    if same:
        i, j = np.indices(hit.shape)
        hit &= np.abs(i - j) > 1
    if not hit.any():
        return None
    i, j = np.argwhere(hit)[0]
    return np.asarray(a[i] + t[i, j] * (a[i + 1] - a[i]))
