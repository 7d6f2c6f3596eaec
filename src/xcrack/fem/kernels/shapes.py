"""Standard and Heaviside functions, tabulated at points."""

from xcrack.base.kernels.jit import kernel


@kernel
def set_standard(value, slope, row, bary, gradient, edges):  # type: ignore[no-untyped-def]
    """Set the shape functions of the first columns, and their gradients where these are wanted.

    Parameters
    ----------
    value : (q, k) array
        Changed in place.
    slope : (q or 0, k, d) array
        Changed in place; of length 0 where it is not wanted.
    row : (q,) array of int
        Cell of each point.
    bary : (q, d + 1) array
    gradient : (m, d + 1, d) array
        Gradients of the barycentric coordinates.
    edges : (e, 2) array of int
        Ends of the edges that carry a node; none at order 1.
    """
    corners = bary.shape[1]
    d = corners - 1
    quadratic = len(edges) > 0
    for q in range(len(row)):
        G = gradient[row[q]]
        for b in range(corners):
            x = bary[q, b]
            value[q, b] = x * (2.0 * x - 1.0) if quadratic else x
            if len(slope):
                rise = 4.0 * x - 1.0 if quadratic else 1.0
                for j in range(d):
                    slope[q, b, j] = rise * G[b, j]
        for k in range(len(edges)):
            a, b = edges[k, 0], edges[k, 1]
            x, y = 4.0 * bary[q, a], 4.0 * bary[q, b]
            value[q, corners + k] = x * bary[q, b]
            if len(slope):
                for j in range(d):
                    slope[q, corners + k, j] = y * G[a, j] + x * G[b, j]


@kernel
def set_jumps(value, slope, first, row, side, nodes, node_side, number):  # type: ignore[no-untyped-def]
    """Set shifted Heaviside functions from column `first` on: shape times side less that of node.

    Parameters
    ----------
    value : (q, k) array
        Changed in place; the standard functions are in its first columns.
    slope : (q or 0, k, d) array
        Changed in place.
    first : int
    row : (q,) array of int
    side : (q,) array of int
        Side of the crack.
    nodes : (m, n) array of int
    node_side : (nodes,) array of int
    number : (nodes,) array of int
        Negative for nodes that carry no Heaviside function.
    """
    n = nodes.shape[1]
    for q in range(len(row)):
        for a in range(n):
            node = nodes[row[q], a]
            jump = float(side[q] - node_side[node]) if number[node] >= 0 else 0.0
            value[q, first + a] = value[q, a] * jump
            if len(slope):
                for j in range(slope.shape[2]):
                    slope[q, first + a, j] = slope[q, a, j] * jump
