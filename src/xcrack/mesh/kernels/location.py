"""Where points lie: among cells, found by a grid, and next to segments and polylines."""

import math

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel

_MARGIN = 1e-8  # share of a cell's extent: its box holds what lies in it but for round-off


@kernel
def _box_meets_bin(points, cells, e, x, box_min, box_max):  # type: ignore[no-untyped-def]
    """Whether a cell's box, put in `box_min`, `box_max`, meets that of points; a margin wider."""
    for j in range(points.shape[1]):
        box_min[j] = box_max[j] = points[cells[e, 0], j]
        for b in range(1, cells.shape[1]):
            value = points[cells[e, b], j]
            if value < box_min[j]:
                box_min[j] = value
            elif value > box_max[j]:
                box_max[j] = value
        margin = _MARGIN * (box_max[j] - box_min[j])
        box_min[j] -= margin
        box_max[j] += margin
        if box_min[j] > x[1, j] or box_max[j] < x[0, j]:
            return False
    return True


@kernel
def _span(box_min, box_max, origin, width, shape, begin, end):  # type: ignore[no-untyped-def]
    """Set the range of bins that a box meets; their number."""
    count = 1
    for j in range(len(shape)):
        for bound, place in ((box_min, begin), (box_max, end)):
            at = (bound[j] - origin[j]) / width[j]
            place[j] = 0
            if at >= shape[j] - 1:
                place[j] = shape[j] - 1
            elif at > 0:
                place[j] = int(at)
        count *= end[j] - begin[j] + 1
    return count


@kernel
def _bin(k, begin, end, shape):  # type: ignore[no-untyped-def]
    """Number of the k-th bin of a range."""
    number = 0
    for j in range(len(shape)):
        side = end[j] - begin[j] + 1
        number = number * shape[j] + begin[j] + k % side
        k //= side
    return number


@kernel
def cells_in_bins(points, cells, body_box, shape):  # type: ignore[no-untyped-def]
    """Cells in the bins of a regular grid over the box of a mesh.

    Parameters
    ----------
    points : (n, d) array
    cells : (m, d + 1) array of int
    body_box : (2, d) array
        Corners of the box around all points.
    shape : (d,) array of int
        Bins in each direction.

    Returns
    -------
    origin, width : (d,) arrays
    start : array of int
        Where the cells of each bin begin.
    member : array of int32
        Cells whose boxes meet a bin, growing.
    """
    d = points.shape[1]
    origin, width = body_box[0], empty(d)
    for j in range(d):
        width[j] = (body_box[1, j] - body_box[0, j]) / shape[j]
    box_min, box_max = empty(d), empty(d)
    begin, end = empty(d, np.int64), empty(d, np.int64)
    bins = 1
    for j in range(d):
        bins *= shape[j]
    start = zeros(bins + 1, np.int64)
    member = empty(0, np.int32)
    for filling in range(2):
        if filling == 1:
            for k in range(bins, 0, -1):
                start[k] = start[k - 1]
            start[0] = 0
            for k in range(bins):
                start[k + 1] += start[k]
            member = empty(start[bins], np.int32)
            for k in range(bins, 0, -1):
                start[k] = start[k - 1]
        for e in range(len(cells)):
            _box_meets_bin(points, cells, e, body_box, box_min, box_max)
            for k in range(_span(box_min, box_max, origin, width, shape, begin, end)):
                number = _bin(k, begin, end, shape)
                if filling == 0:
                    start[number] += 1
                else:
                    member[start[number + 1]] = e
                    start[number + 1] += 1
    return origin.copy(), width, start, member


@kernel
def locate_points(  # type: ignore[no-untyped-def]
    points, cells, gradient, grid, shape, x, tolerance
):
    """Cell of each point, the one with the nearest centroid where several have it.

    Parameters
    ----------
    points : (n, d) array
    cells : (m, d + 1) array of int
    gradient : (m, d + 1, d) array
        Of the barycentric coordinates of the cells.
    grid, shape
        Of `cells_in_bins`.
    x : (k, d) array
    tolerance : float
        Barycentric coordinate below zero up to which a point belongs to a cell.

    Returns
    -------
    cell : (k,) array of int
        -1 outside.
    bary : (k, d + 1) array
    """
    d = points.shape[1]
    cell, bary = empty(len(x), np.int64), zeros((len(x), d + 1))
    coordinates = empty(d + 1)
    begin, end = empty(d, np.int64), empty(d, np.int64)
    for q in range(len(x)):
        least_square, cell[q] = np.inf, -1
        _span(x[q], x[q], grid[0], grid[1], shape, begin, end)
        number = _bin(0, begin, end, shape)
        for k in range(grid[2][number], grid[2][number + 1]):
            e = grid[3][k]
            if not _is_inside(points, cells, gradient, e, x[q], tolerance, coordinates):
                continue
            square = 0.0
            for j in range(d):
                mean = 0.0
                for b in range(d + 1):
                    mean += points[cells[e, b], j]
                square += (mean / (d + 1) - x[q, j]) ** 2
            if square < least_square:
                least_square, cell[q] = square, e
                for i in range(d + 1):
                    bary[q, i] = coordinates[i]
    return cell, bary


@kernel
def _is_inside(  # type: ignore[no-untyped-def]
    points, cells, gradient, e, x, tolerance, coordinates
):
    """Whether a cell has a point, whose barycentric coordinates are set."""
    d, total, least_coordinate = points.shape[1], 0.0, 1.0
    for i in range(1, d + 1):
        coordinates[i] = 0.0
        for j in range(d):
            coordinates[i] += gradient[e, i, j] * (x[j] - points[cells[e, 0], j])
        total += coordinates[i]
        if coordinates[i] < least_coordinate:
            least_coordinate = coordinates[i]
    coordinates[0] = 1 - total
    return least_coordinate >= -tolerance and coordinates[0] >= -tolerance


@kernel
def _from_segment(points, a, b, x):  # type: ignore[no-untyped-def]
    """Distance of a point in 2D to the segment between two points."""
    along0, along1 = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    gap0, gap1 = x[0] - points[a, 0], x[1] - points[a, 1]
    square = along0 * along0 + along1 * along1
    t = (gap0 * along0 + gap1 * along1) / square if square > 1e-300 else 0.0
    if t < 0.0:
        t = 0.0
    elif t > 1.0:
        t = 1.0
    away0, away1 = points[a, 0] + t * along0 - x[0], points[a, 1] + t * along1 - x[1]
    return math.sqrt(away0 * away0 + away1 * away1)


@kernel
def cells_within(points, cells, x, radius):  # type: ignore[no-untyped-def]
    """Triangles one of whose sides comes nearer to a point than a radius `(k,)`, growing."""
    box_min, box_max, box = empty(2), empty(2), empty((2, 2))
    for j in range(2):
        box[0, j], box[1, j] = x[j] - radius, x[j] + radius
    members, count = empty(len(cells), np.int64), 0
    for e in range(len(cells)):
        if _box_meets_bin(points, cells, e, box, box_min, box_max):
            for i in range(3):
                if _from_segment(points, cells[e, i], cells[e, (i + 1) % 3], x) <= radius:
                    members[count] = e
                    count += 1
                    break
    return members[:count].copy()


@kernel
def nearest_segment(points, segments, x):  # type: ignore[no-untyped-def]
    """Distance of a point in 2D to the nearest of segments `(k, 2)`, and the length of that one."""
    least_distance, number = np.inf, 0
    for k in range(len(segments)):
        distance = _from_segment(points, segments[k, 0], segments[k, 1], x)
        if distance < least_distance:
            least_distance, number = distance, k
    a, b = segments[number, 0], segments[number, 1]
    return least_distance, math.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1])


@kernel
def polyline_distance(x, vertices):  # type: ignore[no-untyped-def]
    """Signed distance to a polyline, positive on its left, and the closest segment.

    At a vertex the sign comes from the mean of the normals of its two segments.

    Parameters
    ----------
    x : (n, 2) array
    vertices : (p, 2) array

    Returns
    -------
    phi : (n,) array
    segment : (n,) array of int
    """
    n, last_segment = len(x), len(vertices) - 2
    phi = empty(n)
    segment = empty(n, np.int64)
    length = empty(last_segment + 1)
    ex = empty(last_segment + 1)
    ey = empty(last_segment + 1)
    for s in range(last_segment + 1):
        dx = vertices[s + 1, 0] - vertices[s, 0]
        dy = vertices[s + 1, 1] - vertices[s, 1]
        length[s] = np.sqrt(dx * dx + dy * dy)
        ex[s] = dx / length[s]
        ey[s] = dy / length[s]
    for i in range(n):
        least_square = np.inf
        foot_segment = 0
        at = 0.0
        for s in range(last_segment + 1):
            gx = x[i, 0] - vertices[s, 0]
            gy = x[i, 1] - vertices[s, 1]
            foot = gx * ex[s] + gy * ey[s]
            if foot < 0.0:
                foot = 0.0
            elif foot > length[s]:
                foot = length[s]
            rx = gx - foot * ex[s]
            ry = gy - foot * ey[s]
            square = rx * rx + ry * ry
            if square < least_square:
                least_square = square
                foot_segment = s
                at = foot
        s = foot_segment
        gx = x[i, 0] - vertices[s, 0]
        gy = x[i, 1] - vertices[s, 1]
        normal_part = ey[s] * -gx + ex[s] * gy
        segment[i] = s
        if 0.0 < at < length[s]:
            phi[i] = normal_part
            continue
        neighbour = s
        if at == 0.0 and s > 0:
            neighbour = s - 1
        elif at >= length[s] and s < last_segment:
            neighbour = s + 1
        rx = gx - at * ex[s]
        ry = gy - at * ey[s]
        sign = (-ey[s] - ey[neighbour]) * rx + (ex[s] + ex[neighbour]) * ry
        phi[i] = np.copysign(np.sqrt(least_square), sign)
    return phi, segment


@kernel
def _square_distance(p, q, r, points, i):  # type: ignore[no-untyped-def]
    """Square of the distance of (p, q, r) to one of the points in 3D."""
    a, b, c = p - points[i, 0], q - points[i, 1], r - points[i, 2]
    return a * a + b * b + c * c


@kernel
def nearest_vertices(x, vertices, bound):  # type: ignore[no-untyped-def]
    """Nearest vertex of a polyline to each point.

    The polyline is divided into stretches, each within a radius of its middle vertex. The stretch
    of the point before is looked at first: points in the order of their cells leave few others
    that may come nearer.

    Parameters
    ----------
    x : (n, 3) array
    vertices : (p, 3) array
    bound : float
        Points farther than this from all vertices have none.

    Returns
    -------
    vertex : (n,) array of int
        -1 where there is none.
    distance : (n,) array
        inf where there is none.
    """
    n, count = len(x), len(vertices)
    stretch_size = max(1, int(0.8 * math.sqrt(count)))
    stretches = (count + stretch_size - 1) // stretch_size
    middle, reach = empty((stretches, 3)), zeros(stretches)
    for b in range(stretches):
        first, end = b * stretch_size, min(count, (b + 1) * stretch_size)
        for j in range(3):
            middle[b, j] = vertices[(first + end) // 2, j]
        for v in range(first, end):
            square = _square_distance(middle[b, 0], middle[b, 1], middle[b, 2], vertices, v)
            reach[b] = max(reach[b], math.sqrt(square) * (1.0 + 1e-12))
    vertex, distance = np.full(n, -1, np.int64), np.full(n, np.inf)
    start = 0
    for i in range(n):
        p, q, r = x[i, 0], x[i, 1], x[i, 2]
        least_distance, least_square, nearest_number = bound, bound * bound, -1
        for k in range(-1, stretches):
            b = start if k < 0 else k
            if k == start:
                continue
            square = _square_distance(p, q, r, middle, b)
            if square >= (least_distance + reach[b]) ** 2:
                continue
            is_closer = False
            for v in range(b * stretch_size, min(count, (b + 1) * stretch_size)):
                square = _square_distance(p, q, r, vertices, v)
                if square < least_square:
                    least_square, nearest_number, is_closer = square, v, True
            if is_closer:
                least_distance = math.sqrt(least_square)
        if nearest_number >= 0:
            vertex[i], distance[i] = nearest_number, least_distance
            start = nearest_number // stretch_size
    return vertex, distance
