"""Bodies drawn with the curves that their mesh knows: facets in small parts, put onto these."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints
from xcrack.mesh.curves import Curve
from xcrack.mesh.mesh import Mesh, numbers_of

_OFF = 4e-4  # of the body: a chord this close to its arc is seen as the arc
_MOST_PARTS = 16  # of an edge
_ALIKE = 0.85  # cosine of the angle between triangles that are shaded as one surface


@dataclass(frozen=True, eq=False)
class CurvedSides:
    """Curves of the facets of a mesh.

    Attributes
    ----------
    curves : tuple of callable
    facet_to_curve : (f,) array of int
        Number of the curve of each facet of the mesh; -1 where it is flat.
    off : float, length
        Distance between chord and arc that is not seen.
    """

    curves: tuple[Curve, ...]
    facet_to_curve: Ints
    gap: float

    @classmethod
    def of(cls, mesh: Mesh) -> "CurvedSides | None":
        """Those of a mesh, if it has any."""
        if not mesh.curves:
            return None
        facet_to_curve = np.full(len(mesh.facets), -1)
        for k, name in enumerate(mesh.curves):
            facet_to_curve[numbers_of(mesh, mesh.facet_sets[name])] = k
        return cls(tuple(mesh.curves.values()), facet_to_curve, _OFF * mesh.extent)

    def project(self, x: Floats, facet: Ints) -> Floats:
        """Points of facets of the mesh `(k, d)`, put onto the curves of these."""
        result, number = x.copy(), self.facet_to_curve[facet]
        for k, curve in enumerate(self.curves):
            rows = np.nonzero(number == k)[0]
            if len(rows):
                result[rows] = curve(x[rows])
        return result

    def on_curves(self, x: Floats, facet: Ints) -> Floats:
        """As `bend`, of places alone."""
        return self.bend(x, facet, np.zeros((*x.shape[:2], 1)))[0]

    def bend(self, x: Floats, facet: Ints, data: Floats) -> tuple[Floats, Floats, Ints]:
        """Segments or triangles on facets, those on curved ones in parts that follow the curve.

        Parameters
        ----------
        x : (k, v, d) array, length
        facet : (k,) array of int
            Facet of the mesh on which each lies; -1 for none.
        data : (k, v, m) array
            What is given at their corners.

        Returns
        -------
        x : (k', v, d) array, length
        data : (k', v, m) array
        facet : (k',) array of int
        """
        on_curve = (facet >= 0) & (self.facet_to_curve[facet] >= 0)
        flat_rows = np.nonzero(~on_curve)[0]
        parts = [(x[flat_rows], data[flat_rows], facet[flat_rows])]
        curved_rows = np.nonzero(on_curve)[0]
        for n, rows in self._by_parts(x[curved_rows], facet[curved_rows]):
            rows = curved_rows[rows]
            nodes, simplices = lattice_parts(x.shape[1], n)
            places = np.einsum("nv,kvd->knd", nodes, x[rows])
            owner = np.repeat(facet[rows], len(nodes))
            places = self.project(places.reshape(-1, x.shape[2]), owner).reshape(places.shape)
            values = np.einsum("nv,kvm->knm", nodes, data[rows])
            parts.append((
                places[:, simplices].reshape(-1, *x.shape[1:]),
                values[:, simplices].reshape(-1, *data.shape[1:]),
                np.repeat(facet[rows], len(simplices)),
            ))  # fmt: skip
        points, values, owner = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return points, values, owner

    def bend_edges(self, x: Floats, facet: Ints, data: Floats) -> tuple[Floats, Floats]:
        """Triangles beside curved facets, in parts of which those at an edge follow the curve.

        Parameters
        ----------
        x : (k, 3, d) array, length
        facet : (k, 3) array of int
            Curved facet on which the edges 01, 12 and 20 lie; -1 for none.
        data : (k, 3, m) array
        """
        is_beside = (facet >= 0).any(axis=1)
        parts = [(x[~is_beside], data[~is_beside])]
        x, facet, data = x[is_beside], facet[is_beside], data[is_beside]
        edges = np.stack([x, np.roll(x, -1, axis=1)], axis=2)
        rows, edge = np.nonzero(facet >= 0)
        part_counts = np.ones(len(x), dtype=np.int64)
        for n, members in self._by_parts(edges[rows, edge], facet[rows, edge]):
            np.maximum.at(part_counts, rows[members], n)
        for n in np.unique(part_counts).tolist():
            rows_of_count = np.nonzero(part_counts == n)[0]
            nodes, simplices = lattice_parts(3, n)
            places = np.einsum("nv,kvd->knd", nodes, x[rows_of_count])
            for e in range(3):
                has_facet = np.nonzero(facet[rows_of_count, e] >= 0)[0]
                start_weight, end_weight, opposite_weight = (
                    nodes[:, e],
                    nodes[:, (e + 1) % 3],
                    nodes[:, (e + 2) % 3],
                )
                share = end_weight / np.maximum(start_weight + end_weight, 1e-300)
                a, b = (edges[rows_of_count[has_facet], e, side][:, None] for side in (0, 1))
                chord = a + share[:, None] * (b - a)
                owner = np.repeat(facet[rows_of_count[has_facet], e], len(nodes))
                arc = self.project(chord.reshape(-1, x.shape[2]), owner).reshape(chord.shape)
                places[has_facet] += ((1 - opposite_weight) ** 2)[:, None] * (arc - chord)
            values = np.einsum("nv,kvm->knm", nodes, data[rows_of_count])
            parts.append((
                places[:, simplices].reshape(-1, 3, x.shape[2]),
                values[:, simplices].reshape(-1, 3, data.shape[2]),
            ))  # fmt: skip
        points, values = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return points, values

    def facets_of_edges(self, triangles: Ints, segments: Ints, facet: Ints) -> Ints:
        """Curved facets on which the edges of triangles lie `(k, 3)`, -1 for none.

        Parameters
        ----------
        triangles : (k, 3) array of int
            Point numbers.
        segments : (s, 2) array of int
        facet : (s,) array of int
            Facet of the mesh on which each segment lies.
        """
        on_curve = np.nonzero(self.facet_to_curve[facet] >= 0)[0]
        result = np.full(triangles.shape, -1)
        if not len(on_curve):
            return result
        count = np.int64(max(int(triangles.max(initial=0)), int(segments.max(initial=0))) + 1)
        min_point, max_point = np.sort(segments[on_curve], axis=1).T
        key = min_point * count + max_point
        order = np.argsort(key)
        key = key[order]
        for e in range(3):
            min_point, max_point = np.sort(triangles[:, [e, (e + 1) % 3]], axis=1).T
            place = np.minimum(np.searchsorted(key, min_point * count + max_point), len(key) - 1)
            on_key = key[place] == min_point * count + max_point
            result[on_key, e] = facet[on_curve[order[place[on_key]]]]
        return result

    def _by_parts(self, x: Floats, facet: Ints) -> Iterator[tuple[int, Ints]]:
        """Numbers of parts of an edge, powers of two, and the simplices that need each."""
        v = x.shape[1]
        height = np.zeros(len(x))
        for i in range(v):
            for j in range(i):
                middle = (x[:, i] + x[:, j]) / 2
                offset = np.linalg.norm(self.project(middle, facet) - middle, axis=1)
                height = np.maximum(height, offset)
        halvings = np.clip(np.ceil(np.log2(np.maximum(height / self.gap, 1.0)) / 2), 0, None)
        parts = np.minimum(2 ** halvings.astype(np.int64), _MOST_PARTS)
        for n in np.unique(parts):
            yield int(n), np.nonzero(parts == n)[0]


def boundary_lines(mesh: Mesh) -> Floats:
    """Edges of the boundary of a 2D mesh `(k, 2, 2)`, in parts where they are curved."""
    outer_facets = np.nonzero(mesh.facet_to_cell[:, 1] < 0)[0]
    x = mesh.points[mesh.facets[outer_facets]]
    sides = CurvedSides.of(mesh)
    return x if sides is None else sides.on_curves(x, outer_facets)


def lattice_parts(corners: int, n: int) -> tuple[Floats, Ints]:
    """Equal parts of a segment or a triangle: nodes `(p, v)` in barycentric coordinates, parts."""
    if corners == 2:
        t = np.arange(n + 1) / n
        return np.stack([1 - t, t], axis=1), np.stack([np.arange(n), np.arange(n) + 1], axis=1)
    i, j = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)]).T
    number = np.full((n + 2, n + 2), -1)
    number[i, j] = np.arange(len(i))
    first = i + j < n
    has_inverted = i + j < n - 1
    parts = [
        np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)[first],
        np.stack([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]], axis=1)[has_inverted],
    ]
    return np.stack([n - i - j, i, j], axis=1) / n, np.concatenate(parts)


def shading_normals(corners: Floats) -> Floats:
    """Normals at the corners of triangles `(k, 3, 3)`, alike where these meet nearly flatly."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(size, 1e-300)[:, None]
    x = corners.reshape(-1, 3)
    step = 1e-7 * float(np.ptp(x, axis=0).max(initial=1e-300))
    place = np.unique(np.round(x / step).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(place, kind="stable")
    owner = np.repeat(np.arange(len(corners)), 3)
    total = np.repeat(normal, 3, axis=0)
    sorted_place = place[order]
    for step_on in range(1, int(np.bincount(place).max(initial=1))):
        is_same: Bools = sorted_place[step_on:] == sorted_place[:-step_on]
        p, q = order[step_on:][is_same], order[:-step_on][is_same]
        cosine = np.einsum("kd,kd->k", unit[owner[p]], unit[owner[q]])
        is_aligned = np.abs(cosine) > _ALIKE  # triangles run round in either sense
        p, q, sign = p[is_aligned], q[is_aligned], np.sign(cosine[is_aligned])[:, None]
        np.add.at(total, p, sign * normal[owner[q]])
        np.add.at(total, q, sign * normal[owner[p]])
    length = np.linalg.norm(total, axis=1)
    return np.asarray((total / np.maximum(length, 1e-300)[:, None]).reshape(-1, 3, 3))


__all__ = ["CurvedSides", "boundary_lines", "lattice_parts", "shading_normals"]
