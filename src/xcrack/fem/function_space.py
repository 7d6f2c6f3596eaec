"""The approximation space: standard, Heaviside and tip functions, numbered and tabulated.

Every scalar function has a number; unknown `d * function + component` is its coefficient in one
direction. All enriched functions are shifted, N_i (H - H_i) and N_i (F - F(x_i)), so that the
standard unknown of a mesh point is the displacement there. Tip functions ride on linear hats at
both orders: quadratic ones would nearly repeat the other functions.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.errors import GeometryError
from xcrack.crack.crack import Crack
from xcrack.crack.stations import GEOMETRY
from xcrack.fem.cut import CellGeometry, Cut
from xcrack.fem.enrichment import (
    divided_points,
    heaviside_nodes,
    node_level,
    tip_points,
)
from xcrack.fem.joints_2d import Joint
from xcrack.fem.williams import polar_coordinates, tip_values
from xcrack.mesh.mesh import Mesh, local_edges
from xcrack.mesh.simplex import cell_nodes, node_points
from xcrack.model.numerics import Numerics

_BESIDE = 1.5  # of the reach of a junction: nodes of cells within it lie within that


@dataclass(frozen=True, eq=False)
class Tip:
    """One tip, or in 3D one front, and the functions around it.

    Attributes
    ----------
    crack, number : int
        Which tip of which crack.
    x, frame : (d,) and (d, d) arrays
        Position and rows (ahead, normal); in 3D the vertices of a front `(m, 3)` and their
        frames `(m, 3, 3)`.
    radius : float, length
    functions : int
        Tip functions a point.
    point_to_function : (n,) array of int
        First of its functions at each mesh point, or -1.
    """

    crack: int
    number: int
    x: Floats
    frame: Floats
    radius: float
    functions: int
    point_to_function: Ints


@dataclass(frozen=True, eq=False)
class Batch:
    """Cells on which the same kinds of functions act.

    Attributes
    ----------
    cells : (m,) array of int
    cracks, tips : tuple of int
        Cracks whose Heaviside functions, and tips whose functions act here.
    functions : (m, n) array of int
        Scalar function numbers, -1 where a place is empty.
    """

    cells: Ints
    cracks: tuple[int, ...]
    tips: tuple[int, ...]
    functions: Ints


@dataclass(frozen=True, eq=False)
class FunctionSpace:
    """Functions on a mesh with cracks.

    Attributes
    ----------
    mesh : Mesh
    order : int
        Degree of the standard and Heaviside functions.
    cracks : tuple of Crack
        Placed cracks.
    cuts : tuple of Cut
    heaviside : tuple of (n_nodes,) arrays of int
        Heaviside function of each node for each crack, or -1.
    tips : tuple of Tip
    n_nodes, n_functions : int
    geometry : CellGeometry
        What differs between 2D and 3D.
    joints : tuple of Joint
        Where cracks end on others.
    """

    mesh: Mesh
    order: int
    cracks: tuple[Crack, ...]
    cuts: tuple[Cut, ...]
    heaviside: tuple[Ints, ...]
    tips: tuple[Tip, ...]
    n_nodes: int
    n_functions: int
    geometry: CellGeometry
    joints: tuple[Joint, ...] = ()

    @cached_property
    def dim(self) -> int:
        """Number of dimensions, 2 or 3."""
        return self.mesh.dim

    @cached_property
    def n_dof(self) -> int:
        """Number of unknowns."""
        return self.n_functions * self.dim

    @property
    def radius(self) -> Floats:
        """Radius of the enriched disc of each tip, length."""
        return np.array([tip.radius for tip in self.tips])

    def tips_of(self, crack: int) -> list[int]:
        """Numbers of the tips, or fronts, of a crack in `tips`."""
        return [t for t, tip in enumerate(self.tips) if tip.crack == crack]

    @cached_property
    def cell_nodes(self) -> Ints:
        """Nodes of each cell `(m, n_shapes)`."""
        return lock(np.ascontiguousarray(cell_nodes(self.mesh, self.order)))

    @cached_property
    def node_points(self) -> Floats:
        """Coordinates of the nodes."""
        return lock(np.array(node_points(self.mesh, self.order)))

    @cached_property
    def node_side(self) -> tuple[Ints, ...]:
        """Side +1 or -1 of each node for each crack; a node on a lip counts as +.

        0 beyond a crack on which the crack ends.
        """
        levels = [node_level(self.mesh, self.order, cut.level_set.phi) for cut in self.cuts]
        sides = [np.where(phi >= 0, 1, -1).astype(np.int64) for phi in levels]
        for joint in self.joints:
            distance = np.linalg.norm(self.node_points - joint.centre, axis=1)
            is_beyond = (distance < _BESIDE * joint.reach) & (sides[joint.on] != joint.side)
            sides[joint.crack][is_beyond] = 0
        return tuple(lock(side) for side in sides)

    @cached_property
    def signature(self) -> Ints:
        """Bit mask of what acts on each cell: cracks first, then tips; 0 for a plain cell."""
        mask = np.zeros(len(self.mesh.cells), dtype=np.int64)
        for c, cut in enumerate(self.cuts):
            cells = _with_any(self.heaviside[c] >= 0, self.cell_nodes)
            nodes = self.cell_nodes[cells]
            has_jump = self.heaviside[c][nodes] >= 0
            is_on_other_side = self.node_side[c][nodes] == -cut.side[cells, None]
            is_active = (has_jump & (is_on_other_side | cut.is_cut[cells, None])).any(axis=1)
            for joint in self.joints:
                if joint.crack == c:
                    is_active |= joint.is_near[cells]
            mask[cells] |= is_active.astype(np.int64) << c
        for t, tip in enumerate(self.tips):
            cells = _with_any(tip.point_to_function >= 0, self.mesh.cells)
            mask[cells] |= 1 << (len(self.cuts) + t)
        return lock(mask)

    @cached_property
    def enriched_cells(self) -> Ints:
        """Cells that are not plain."""
        return lock(np.nonzero(self.signature)[0])

    @cached_property
    def has_tip(self) -> Bools:
        """Cells on which a tip function acts."""
        return lock((self.signature >> len(self.cuts)) > 0)

    def batches(self, cells: Ints) -> list[tuple[Batch, Ints]]:
        """Group cells by what acts on them; with each batch the positions in `cells`."""
        signature = self.signature[cells]
        groups = []
        for value, cracks, tips in self._combinations:
            rows = (signature == value).nonzero()[0]
            if len(rows):
                groups.append((self._batch(cells[rows], cracks, tips), rows))
        return groups

    @cached_property
    def _combinations(self) -> tuple[tuple[int, tuple[int, ...], tuple[int, ...]], ...]:
        """What acts together on cells: the bit mask, and the cracks and tips in it."""
        n = len(self.cuts)
        rows = []
        for value in np.unique(self.signature).tolist():
            bits = [b for b in range(n + len(self.tips)) if value >> b & 1]
            rows.append((value, [b for b in bits if b < n], [b - n for b in bits if b >= n]))
        return tuple((value, tuple(cracks), tuple(tips)) for value, cracks, tips in rows)

    def batches_of_points(self, cell: Ints) -> list[tuple[Batch, Ints, Ints]]:
        """Batches that serve points in the given cells `(q,)`, in any order and repeated.

        Returns
        -------
        list of (batch, numbers of its points, row in the batch of the cell of each)
        """
        if len(cell) and (cell[1:] >= cell[:-1]).all():  # as integration points are
            is_begin = np.concatenate([[True], cell[1:] != cell[:-1]])
            cells, inverse = cell[is_begin], np.cumsum(is_begin) - 1
        else:
            cells, inverse = np.unique(cell, return_inverse=True)
        groups = self.batches(cells)
        if len(groups) == 1:
            return [(groups[0][0], np.arange(len(cell)), inverse)]
        parts = []
        for batch, rows in groups:
            place = np.full(len(cells), -1, dtype=np.int64)
            place[rows] = np.arange(len(rows))
            positions = place[inverse]
            number = (positions >= 0).nonzero()[0]
            parts.append((batch, number, positions[number]))
        return parts

    def _batch(self, cells: Ints, cracks: tuple[int, ...], tips: tuple[int, ...]) -> Batch:
        nodes = self.cell_nodes[cells]
        corners, n = self.mesh.cells.shape[1], nodes.shape[1]
        width = n * (1 + len(cracks)) + corners * sum([self.tips[t].functions for t in tips])
        functions = np.empty((len(cells), width), dtype=np.int64)
        functions[:, :n] = nodes
        at = n
        for c in cracks:
            functions[:, at : at + n] = self.heaviside[c][nodes]
            at += n
        points = self.mesh.cells[cells]
        for t in tips:
            tip = self.tips[t]
            first = tip.point_to_function[points][:, :, None]
            tip_functions = first + (first >= 0) * np.arange(tip.functions)
            width = corners * tip.functions
            functions[:, at : at + width] = tip_functions.reshape(-1, width)
            at += width
        return Batch(cells, cracks, tips, functions)

    def tabulate(
        self,
        batch: Batch,
        row: Ints,
        bary: Floats,
        side: Ints,
        slopes: bool = True,
        values: bool = True,
    ) -> tuple[Floats, Floats]:
        """Values `(q, n)` and gradients `(q, n, d)` of a batch's functions at points.

        Of those that are not wanted `q` is 0.

        Parameters
        ----------
        batch : Batch
        row : (q,) array of int
            Position in the batch of the cell of each point.
        bary : (q, d + 1) array
        side : (q, cracks) array
            Side of each crack on which the point lies: +1, -1, or 0 where that means nothing.
        """
        from xcrack.fem.kernels.functions import set_jumps, set_standard

        mesh, n = self.mesh, self.cell_nodes.shape[1]
        width = batch.functions.shape[1]
        N = np.empty((len(row) if values else 0, width))
        G = np.empty((len(row) if slopes else 0, width, self.dim))
        bary = np.ascontiguousarray(bary)
        gradient, edges = mesh.gradient[batch.cells], local_edges(self.dim)
        set_standard(N, G, row, bary, gradient, edges[: len(edges) if self.order == 2 else 0])
        first = n
        for c in batch.cracks:
            side_of_crack = np.ascontiguousarray(side[:, c])
            nodes = self.cell_nodes[batch.cells]
            set_jumps(N, G, first, row, side_of_crack, nodes, self.node_side[c], self.heaviside[c])
            first += n
        for t in batch.tips:
            self._tabulate_tip(t, batch, (N, G), first, row, bary, side)
            first += (self.dim + 1) * self.tips[t].functions
        return N, G

    def tip_values(self, batch: Batch, row: Ints, bary: Floats, side: Ints) -> Floats:
        """Values `(q, k)` of the functions of all tips of a batch."""
        count = [(self.dim + 1) * self.tips[t].functions for t in batch.tips]
        tables = np.empty((len(row), sum(count))), np.empty((0, sum(count), self.dim))
        for t, first in zip(batch.tips, np.cumsum([0, *count]), strict=False):
            self._tabulate_tip(t, batch, tables, int(first), row, bary, side)
        return tables[0]

    def _tabulate_tip(
        self,
        t: int,
        batch: Batch,
        tables: tuple[Floats, Floats],
        first: int,
        row: Ints,
        bary: Floats,
        side: Ints,
    ) -> None:
        """Set values and gradients of the functions of tip t, those that there is room for."""
        from xcrack.fem.kernels.functions import set_tips

        tip = self.tips[t]
        levels = self.cuts[tip.crack].level_set
        set_tips(
            *tables,
            first,
            row,
            np.ascontiguousarray(bary),
            np.ascontiguousarray(side[:, tip.crack]),
            self.mesh.cells[batch.cells],
            self.mesh.gradient[batch.cells],
            levels.phi,
            levels.psi[tip.number],
            tip.point_to_function >= 0,
            self.tip_shift[t],
        )
        for joint in self.joints:
            if joint.crack == tip.crack and self.dim == 3:
                is_beyond = side[:, joint.on] == -joint.side
                stop = first + (self.dim + 1) * tip.functions
                for table in tables:
                    if len(table):
                        table[is_beyond, first:stop] = 0.0

    @cached_property
    def tip_shift(self) -> tuple[Floats, ...]:
        """Tip functions at the mesh points, from the + lip where a point lies on it `(n, k)`."""
        shifts = []
        for tip in self.tips:
            levels = self.cuts[tip.crack].level_set
            phi = levels.phi
            r, theta = polar_coordinates(levels.psi[tip.number], phi, np.where(phi == 0, 1, 0))
            shifts.append(lock(tip_values(r, theta, tip.functions)))
        return tuple(shifts)


def _with_any(flag: Bools, nodes: Ints) -> Ints:
    """Rows `(k,)` of the nodes of cells `(m, n)` with a flagged one."""
    result = flag[nodes[:, 0]]
    for column in nodes.T[1:]:
        result |= flag[column]
    return np.asarray(result.nonzero()[0])


def _bears_tip(mesh: Mesh, through_cut: Cut, side: int) -> Bools:
    """Points that may carry tip functions of a crack that ends on another one in 3D `(n,)`.

    Those of cells with parts on its side; but where the other crack has ended nothing may jump
    across its level set.
    """
    flag = np.zeros(mesh.n_points, dtype=bool)
    flag[mesh.cells[(through_cut.side == side) | through_cut.is_cut]] = True
    flag[mesh.cells[(through_cut.side == 0) & ~through_cut.is_cut]] = False
    return flag


def function_space(
    mesh: Mesh,
    order: int,
    cracks: tuple[Crack, ...],
    cuts: tuple[Cut, ...],
    numerics: Numerics,
    geometry: CellGeometry,
    joints: tuple[Joint, ...] = (),
    jumps: tuple[Bools, ...] | None = None,
) -> FunctionSpace:
    """Number the functions: standard ones first, then Heaviside by crack, then tips.

    `jumps` says which nodes carry Heaviside functions, by default those of cells that are cut.
    """
    for c, (crack, cut) in enumerate(zip(cracks, cuts, strict=True)):
        if not len(cut.lip_cell):
            start, end = np.round(crack.points[[0, -1]], 6).tolist()
            raise GeometryError(
                f"crack {c} from {start} to {end} cuts no cell: it runs along the boundary; move "
                "it inside, or leave it out. If that is the symmetry plane of a half model, model "
                "both halves."
            )
    n_nodes = mesh.n_points + (len(mesh.edges) if order == 2 else 0)
    count = n_nodes
    heaviside = []
    for c, cut in enumerate(cuts):
        flag = heaviside_nodes(mesh, order, cut) if jumps is None else jumps[c]
        number = np.full(n_nodes, -1, dtype=np.int64)
        number[flag] = count + np.arange(int(flag.sum()))
        heaviside.append(lock(number))
        count += int(flag.sum())
    meeting = np.array([joint.centre for joint in joints]).reshape(-1, mesh.dim)
    radii = geometry.tip_radii(mesh, cracks, cuts, order, numerics.radius, meeting)
    tips = []
    for c, cut in enumerate(cuts):
        x, frame = GEOMETRY[mesh.dim].end_frames(cracks[c])
        flags = [
            tip_points(mesh, order, cut, k, radii[c][k], numerics.enrichment)
            for k in range(cut.n_tips)
        ]
        if mesh.dim == 3 and len(flags) > 1:
            flags = divided_points(mesh, cracks[c], cut, flags)
        for k, flag in enumerate(flags):
            for joint in joints:
                if joint.crack == c and mesh.dim == 3:
                    flag &= _bears_tip(mesh, cuts[joint.on], joint.side)
            number = np.full(mesh.n_points, -1, dtype=np.int64)
            number[flag] = count + numerics.functions * np.arange(int(flag.sum()))
            count += numerics.functions * int(flag.sum())
            tips.append(Tip(c, k, x[k], frame[k], radii[c][k], numerics.functions, lock(number)))
    functions = tuple(heaviside), tuple(tips), n_nodes, count
    return FunctionSpace(mesh, order, cracks, cuts, *functions, geometry, joints)
