"""Closest points on triangles and segments in 3D, found in a tree of boxes."""

import numpy as np

from xcrack.base.kernels.arrays import empty, zeros
from xcrack.base.kernels.jit import kernel

LEAF = 4  # boxes a leaf of the tree


@kernel
def _is_before(item, second_item, low_corners, high_corners, axis):  # type: ignore[no-untyped-def]
    """Whether the middle of a box comes before that of another one; equal ones by number."""
    a, b = (
        low_corners[item, axis] + high_corners[item, axis],
        low_corners[second_item, axis] + high_corners[second_item, axis],
    )
    return a < b or (a == b and item < second_item)


@kernel
def _halve(order, first, end, low_corners, high_corners, axis):  # type: ignore[no-untyped-def]
    """Exchange a stretch of items until none before its middle is behind one from there on.

    Hoare's selection: no half is sorted, so that all of the tree takes the time of one sort.
    """
    half, end = (first + end) // 2, end - 1
    while first < end:
        a, b, pivot = order[first], order[end], order[(first + end) // 2]
        lead, tail = (a, b) if _is_before(a, b, low_corners, high_corners, axis) else (b, a)
        if _is_before(pivot, lead, low_corners, high_corners, axis):
            pivot = lead
        elif _is_before(tail, pivot, low_corners, high_corners, axis):
            pivot = tail
        i, j = first, end
        while i <= j:
            while _is_before(order[i], pivot, low_corners, high_corners, axis):
                i += 1
            while _is_before(pivot, order[j], low_corners, high_corners, axis):
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if half <= j:
            end = j
        elif half >= i:
            first = i
        else:
            break


@kernel
def box_tree(low_corners, high_corners):  # type: ignore[no-untyped-def]
    """Tree of boxes by halving at the median of the longest side.

    Parameters
    ----------
    lower, upper : (k, 3) arrays
        Corners of the boxes of the items.

    Returns
    -------
    order : (k,) array of int
        Items in the order of the leaves.
    node : (q, 3) array of int
        First child (the second one follows it; -1: a leaf), first and last place in `order`.
    box_min, box_max : (q, 3) arrays
        Box of each node.
    """
    k = len(low_corners)
    order = np.arange(k)
    node = empty((2 * k + 1, 3), np.int64)
    box_min = empty((2 * k + 1, 3))
    box_max = empty((2 * k + 1, 3))
    node[0, 1], node[0, 2] = 0, k
    n_nodes = 1
    at = 0
    while at < n_nodes:
        first, end = node[at, 1], node[at, 2]
        width, axis = -1.0, 0
        for d in range(3):
            bottom, top = np.inf, -np.inf
            middle_low, middle_high = np.inf, -np.inf
            for place in range(first, end):
                i = order[place]
                bottom = min(bottom, low_corners[i, d])
                top = max(top, high_corners[i, d])
                middle = low_corners[i, d] + high_corners[i, d]
                middle_low = min(middle_low, middle)
                middle_high = max(middle_high, middle)
            box_min[at, d], box_max[at, d] = bottom, top
            if middle_high - middle_low > width:
                width, axis = middle_high - middle_low, d
        node[at, 0] = -1
        if end - first > LEAF:
            _halve(order, first, end, low_corners, high_corners, axis)
            half = (first + end) // 2
            node[at, 0] = n_nodes
            node[n_nodes, 1], node[n_nodes, 2] = first, half
            node[n_nodes + 1, 1], node[n_nodes + 1, 2] = half, end
            n_nodes += 2
        at += 1
    return order, node[:n_nodes].copy(), box_min[:n_nodes].copy(), box_max[:n_nodes].copy()


@kernel
def _to_box(p, box_min, box_max):  # type: ignore[no-untyped-def]
    """Squared distance of a point to a box."""
    square = 0.0
    for d in range(3):
        gap = max(box_min[d] - p[d], p[d] - box_max[d])
        if gap > 0.0:
            square += gap * gap
    return square


@kernel
def _on_edge(p, a, b, foot):  # type: ignore[no-untyped-def]
    """Position in [0, 1] of the point of an edge closest to p, put into foot."""
    dot = 0.0
    square = 0.0
    for d in range(3):
        dot += (p[d] - a[d]) * (b[d] - a[d])
        square += (b[d] - a[d]) * (b[d] - a[d])
    position = dot / square
    if not position > 0.0:
        position = 0.0
    elif position > 1.0:
        position = 1.0
    for d in range(3):
        if position == 1.0:
            foot[d] = b[d]
        else:
            foot[d] = a[d] + position * (b[d] - a[d])
    return position


@kernel
def _to_triangle(p, corner, normal, foot, trial):  # type: ignore[no-untyped-def]
    """Squared distance to a triangle and the part of it that is closest; foot is filled."""
    height = 0.0
    for d in range(3):
        height += (p[d] - corner[0, d]) * normal[d]
    is_inside = True
    for i in range(3):
        j = (i + 1) % 3
        # Sign of the area spanned by edge i j and the point, seen along the normal.
        ex = corner[j, 0] - corner[i, 0]
        ey = corner[j, 1] - corner[i, 1]
        ez = corner[j, 2] - corner[i, 2]
        gx, gy, gz = p[0] - corner[i, 0], p[1] - corner[i, 1], p[2] - corner[i, 2]
        area = (
            (ey * gz - ez * gy) * normal[0]
            + (ez * gx - ex * gz) * normal[1]
            + (ex * gy - ey * gx) * normal[2]
        )
        if not area > 0.0:
            is_inside = False
    if is_inside:
        for d in range(3):
            foot[d] = p[d] - height * normal[d]
        return height * height, 0
    least_square = np.inf
    part = 0
    for i in range(3):
        j = (i + 1) % 3
        position = _on_edge(p, corner[i], corner[j], trial)
        square = 0.0
        for d in range(3):
            square += (p[d] - trial[d]) * (p[d] - trial[d])
        if square < least_square:
            least_square = square
            for d in range(3):
                foot[d] = trial[d]
            if position == 0.0:
                part = 1 + i
            elif position == 1.0:
                part = 1 + j
            else:
                part = 4 + i
    return least_square, part


@kernel
def _push_children(p, child, box_min, box_max, stack, stack_square, top):  # type: ignore[no-untyped-def]
    """Put two children on the stack, the nearer one on top, and return the new top."""
    square = _to_box(p, box_min[child], box_max[child])
    other_square = _to_box(p, box_min[child + 1], box_max[child + 1])
    nearer_child, farther_child = child, child + 1
    if other_square < square:
        nearer_child, farther_child = farther_child, nearer_child
        square, other_square = other_square, square
    stack[top + 1], stack_square[top + 1] = farther_child, other_square
    stack[top + 2], stack_square[top + 2] = nearer_child, square
    return top + 2


@kernel
def closest_triangle(x, corners, normal, order, node, box_min, box_max, band, tolerance):  # type: ignore[no-untyped-def]
    """Closest triangle of each point, and the part of it that is closest.

    Of triangles equally far (coplanar ones that overlap, say) the one with the lowest number
    counts.

    Parameters
    ----------
    x : (n, 3) array
    corners : (k, 3, 3) array
    normal : (k, 3) array
        Unit normals.
    order, node, box_min, box_max : arrays
        Tree of the boxes of the triangles, from `box_tree`.
    band : float
        Points farther away than this find nothing.
    tolerance : float
        Distances that differ by less than this are equal.

    Returns
    -------
    distance : (n,) array
        `band` where nothing is found.
    triangle : (n,) array of int
        -1 where nothing is found.
    part : (n,) array of int
        0 the face, 1 ... 3 a corner, 4 ... 6 the edge from corner 0, 1, 2 to the next.
    foot : (n, 3) array
        Closest points.
    """
    n = len(x)
    distance = empty(n)
    triangle = empty(n, np.int64)
    part = zeros(n, np.int64)
    foot = empty((n, 3))
    stack = empty(128, np.int64)
    stack_square = empty(128)
    foot_point = empty(3)
    trial = empty(3)
    for i in range(n):
        p = x[i]
        least_gap = band
        reach = (least_gap + tolerance) * (least_gap + tolerance)
        number = -1
        top = 0
        stack[0] = 0
        stack_square[0] = _to_box(p, box_min[0], box_max[0])
        while top >= 0:
            at = stack[top]
            far_square = stack_square[top]
            top -= 1
            if far_square > reach:
                continue
            child = node[at, 0]
            if child >= 0:
                top = _push_children(p, child, box_min, box_max, stack, stack_square, top)
                continue
            for place in range(node[at, 1], node[at, 2]):
                k = order[place]
                square, feature = _to_triangle(p, corners[k], normal[k], foot_point, trial)
                gap = np.sqrt(square)
                if gap < least_gap - tolerance or (gap <= least_gap + tolerance and k < number):
                    is_better = True
                else:
                    is_better = number < 0 and gap <= least_gap
                if is_better:
                    least_gap = min(least_gap, gap)
                    reach = (least_gap + tolerance) * (least_gap + tolerance)
                    number = k
                    distance[i] = gap
                    part[i] = feature
                    for d in range(3):
                        foot[i, d] = foot_point[d]
        triangle[i] = number
        if number < 0:
            distance[i] = band
            for d in range(3):
                foot[i, d] = p[d]
    return distance, triangle, part, foot


@kernel
def closest_segment(x, start, stop, order, node, box_min, box_max, band):  # type: ignore[no-untyped-def]
    """Closest segment of each point; of two equally far the one with the lower number.

    Parameters
    ----------
    x : (n, 3) array
    start, stop : (k, 3) arrays
        Ends of the segments.
    order, node, box_min, box_max : arrays
        Tree of the boxes of the segments, from `box_tree`.
    band : float
        Points farther away than this find nothing.

    Returns
    -------
    distance : (n,) array
        `band` where nothing is found.
    segment : (n,) array of int
        -1 where nothing is found.
    position : (n,) array
        Place of the closest point along the segment, in [0, 1].
    """
    n = len(x)
    distance = empty(n)
    segment = empty(n, np.int64)
    position = zeros(n)
    stack = empty(128, np.int64)
    stack_square = empty(128)
    foot = empty(3)
    for i in range(n):
        p = x[i]
        least_square = band * band
        number = -1
        top = 0
        stack[0] = 0
        stack_square[0] = _to_box(p, box_min[0], box_max[0])
        while top >= 0:
            at = stack[top]
            far_square = stack_square[top]
            top -= 1
            if far_square > least_square:
                continue
            child = node[at, 0]
            if child >= 0:
                top = _push_children(p, child, box_min, box_max, stack, stack_square, top)
                continue
            for place in range(node[at, 1], node[at, 2]):
                k = order[place]
                fraction = _on_edge(p, start[k], stop[k], foot)
                square = 0.0
                for d in range(3):
                    square += (p[d] - foot[d]) * (p[d] - foot[d])
                if square < least_square or (square == least_square and (number < 0 or k < number)):
                    least_square = square
                    number = k
                    position[i] = fraction
        segment[i] = number
        distance[i] = np.sqrt(least_square) if number >= 0 else band
    return distance, segment, position


@kernel
def crossed_triangle(start, stop, corners, normal, order, node, box_min, box_max):  # type: ignore[no-untyped-def]
    """First triangle that each segment crosses; a triangle's sides belong to it.

    A segment in the plane of a triangle crosses nothing.

    Parameters
    ----------
    start, stop : (n, 3) arrays
        Ends of the segments.
    corners : (k, 3, 3) array
    normal : (k, 3) array
        Unit normals.
    order, node, box_min, box_max : arrays
        Tree of the boxes of the triangles, from `box_tree`.

    Returns
    -------
    triangle : (n,) array of int
        -1 where none is crossed.
    position : (n,) array
        Place of the crossing along the segment, in [0, 1].
    """
    n = len(start)
    triangle = np.full(n, -1)
    position = zeros(n)
    stack = empty(128, np.int64)
    point = empty(3)
    for i in range(n):
        least_share = np.inf
        top = 0
        stack[0] = 0
        while top >= 0:
            at = stack[top]
            top -= 1
            is_apart = False
            for d in range(3):
                if (
                    min(start[i, d], stop[i, d]) > box_max[at, d]
                    or max(start[i, d], stop[i, d]) < box_min[at, d]
                ):
                    is_apart = True
            if is_apart:
                continue
            child = node[at, 0]
            if child >= 0:
                stack[top + 1] = child
                stack[top + 2] = child + 1
                top += 2
                continue
            for place in range(node[at, 1], node[at, 2]):
                k = order[place]
                start_height, stop_height = 0.0, 0.0
                for d in range(3):
                    start_height += (start[i, d] - corners[k, 0, d]) * normal[k, d]
                    stop_height += (stop[i, d] - corners[k, 0, d]) * normal[k, d]
                if start_height * stop_height > 0.0 or start_height == stop_height:
                    continue
                share = start_height / (start_height - stop_height)
                if share >= least_share:
                    continue
                for d in range(3):
                    point[d] = start[i, d] + share * (stop[i, d] - start[i, d])
                is_inside = True
                for a in range(3):
                    b = (a + 1) % 3
                    ex = corners[k, b, 0] - corners[k, a, 0]
                    ey = corners[k, b, 1] - corners[k, a, 1]
                    ez = corners[k, b, 2] - corners[k, a, 2]
                    gx = point[0] - corners[k, a, 0]
                    gy = point[1] - corners[k, a, 1]
                    gz = point[2] - corners[k, a, 2]
                    area = (
                        (ey * gz - ez * gy) * normal[k, 0]
                        + (ez * gx - ex * gz) * normal[k, 1]
                        + (ex * gy - ey * gx) * normal[k, 2]
                    )
                    if area < -1e-12 * (ex * ex + ey * ey + ez * ez):
                        is_inside = False
                if is_inside:
                    least_share = share
                    triangle[i] = k
                    position[i] = share
    return triangle, position
