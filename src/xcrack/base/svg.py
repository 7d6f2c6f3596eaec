"""Small pictures of a body and its cracks as lines, for notebooks: SVG without any library."""

from collections.abc import Sequence

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.markup import Markup

_WIDTH, _HEIGHT, _MARGIN = 260.0, 200.0, 8.0
_TOWARD = {
    2: np.eye(2),
    3: np.array([[0.86, 0.51, 0.0], [-0.22, 0.37, 0.9]]),  # right and up of a view from above
}
_BODY, _CRACK = "#8a8f98", "#c2184b"


def sketch(points: Floats, boundary: Ints, cracks: Sequence[Floats]) -> Markup:
    """Outline of a body and lines of its cracks.

    Parameters
    ----------
    points : (n, d) array, length
    boundary : (f, d) array of int
        Facets of its boundary; in 3D the box around the points is drawn instead.
    cracks : sequence of (k, 2, d) arrays, length
        Segments of each crack.
    """
    view = _TOWARD[points.shape[1]]
    outline = points[boundary] if points.shape[1] < 3 else _box(points)
    flat = [segments @ view.T for segments in (outline, *cracks) if len(segments)]
    every = np.concatenate([part.reshape(-1, 2) for part in flat])
    low, high = every.min(axis=0), every.max(axis=0)
    size = np.maximum(high - low, 1e-300)
    scale = min((_WIDTH - 2 * _MARGIN) / size[0], (_HEIGHT - 2 * _MARGIN) / size[1])
    width, height = size * scale + 2 * _MARGIN
    paths = []
    for number, part in enumerate(flat):
        place = _MARGIN + (part - low) * scale
        place[..., 1] = height - place[..., 1]
        steps = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in place)
        colour, line = (_BODY, 1.0) if number == 0 else (_CRACK, 2.0)
        paths.append(f'<path d="{steps}" stroke="{colour}" stroke-width="{line}"/>')
    return Markup(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'fill="none" stroke-linecap="round">{"".join(paths)}</svg>'
    )


def rim(points: Floats, faces: Ints) -> Floats:
    """Segments that show a crack `(k, 2, d)`: its line, or the edges of one triangle only."""
    if faces.shape[1] == 2:
        return points[faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return points[unique[count == 1]]


def _box(points: Floats) -> Floats:
    low, high = points.min(axis=0), points.max(axis=0)
    corner = np.stack(np.meshgrid(*np.stack([low, high], 1), indexing="ij"), -1).reshape(-1, 3)
    pairs = [(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit]
    return np.asarray(corner[np.array(pairs)])


__all__ = ["rim", "sketch"]
