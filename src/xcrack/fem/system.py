"""From a problem to matrices: cut, numbered, integrated and assembled, but not solved."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from xcrack.crack.crack import Crack
from xcrack.crack.junctions import prolonged_cracks
from xcrack.crack.stations import GEOMETRY
from xcrack.fem import cut as cut_cells
from xcrack.fem import enrichment, facets, joint_nodes, joints_2d, joints_3d
from xcrack.fem.assembly import Bulk, Enriched, Stiffness, bulk, enriched_stiffness
from xcrack.fem.cut import CellGeometry, cut
from xcrack.fem.enrichment import front_reach
from xcrack.fem.facets import LipPoints, jump_matrix, lip_points
from xcrack.fem.function_space import FunctionSpace, function_space
from xcrack.fem.joint_nodes import jump_nodes
from xcrack.fem.joints_2d import Joint
from xcrack.fem.level_set import LevelSet, level_set, with_far_sides
from xcrack.fem.loads import ImposedValues, known_unknowns
from xcrack.mesh.mesh import Mesh
from xcrack.model.numerics import Numerics
from xcrack.model.problem import Problem


@dataclass(frozen=True, eq=False)
class System:
    """Everything that load states share.

    Attributes
    ----------
    space : FunctionSpace
    lips : tuple of LipPoints
    bulk : Bulk
    enriched : Enriched
        Entries of enriched functions.
    known : ImposedValues
    n_points : int
        Integration points of the enriched cells.
    """

    space: FunctionSpace
    lips: tuple[LipPoints, ...]
    bulk: Bulk
    enriched_blocks: Enriched
    imposed_values: ImposedValues
    n_points: int

    @cached_property
    def parts(self) -> Stiffness:
        """Stiffness of all unknowns, of body and enriched functions apart."""
        return Stiffness(self.bulk.matrix, self.enriched_blocks)

    @cached_property
    def stiffness(self) -> Any:
        """Stiffness of all unknowns, a sparse matrix made when first asked for."""
        return self.parts.sum_of_rows()

    @cached_property
    def jumps(self) -> tuple[Any, ...]:
        """Normal jumps at the lip points of each crack, made when first asked for."""
        return tuple(jump_matrix(self.space, c, lips) for c, lips in enumerate(self.lips))


def build(problem: Problem, bulk_: Bulk | None = None) -> System:
    """Cut, number, integrate and assemble a problem, without solving it."""
    space, lips = discretise(problem)
    mesh, order = space.mesh, space.order
    if (
        bulk_ is None
        or bulk_.mesh is not mesh
        or bulk_.order != order
        or bulk_.elasticity.material != problem.material
    ):
        bulk_ = bulk(problem.elasticity, order)
    blocks, n_points, reused = enriched_stiffness(
        space, problem.elasticity, problem.numerics, lips, bulk_.cells
    )
    return System(
        space,
        lips,
        replace(bulk_, cells=reused),
        blocks,
        known_unknowns(space, tuple(problem.supports)),
        n_points,
    )


def discretise(problem: Problem) -> tuple[FunctionSpace, tuple[LipPoints, ...]]:
    """Function space of a problem, and the points on the faces of its cracks: nothing assembled."""
    mesh, numerics = problem.mesh, problem.numerics
    cracks = tuple(GEOMETRY[mesh.dim].on_mesh(crack, mesh) for crack in problem.placed)
    junctions = problem.junctions
    level_set_cracks = (
        prolonged_cracks(cracks, junctions) if junctions and mesh.dim == 2 else cracks
    )
    level_sets = [levels(mesh, crack, numerics) for crack in level_set_cracks]
    if junctions and mesh.dim == 3:
        for on in {junction.on for junction in junctions}:
            reach = front_reach(mesh, level_set_cracks[on], numerics.radius)
            level_sets[on] = with_far_sides(mesh, level_set_cracks[on], level_sets[on], reach)
    geometry = CELLS[mesh.dim]
    cuts = tuple(cut(mesh, levels_of_crack, geometry) for levels_of_crack in level_sets)
    joints: tuple[Joint, ...] = ()
    if junctions:
        cuts, joints = geometry.joined_cuts(mesh, cuts, junctions)
    space = function_space(mesh, problem.order or 1, cracks, cuts, numerics, geometry, joints)
    if joints:
        jumps = jump_nodes(space)
        space = function_space(mesh, space.order, cracks, cuts, numerics, geometry, joints, jumps)
    return space, tuple(lip_points(space, c) for c in range(len(cracks)))


CELLS = {
    2: CellGeometry(
        cut_cells.tip_parts, cut_cells.lips_up_to_tips, cut_cells.across_segments,
        enrichment.disc_radii,
        facets.split_edges, facets.points_on_segments, facets.positions_along_line,
        joints_2d.joined_cuts, joint_nodes.nodes_around_point, least_trace=1e-11,
    ),
    3: CellGeometry(
        cut_cells.front_parts, cut_cells.lips_up_to_fronts, cut_cells.across_triangles,
        enrichment.front_radii,
        facets.split_triangles, facets.points_on_triangles, facets.positions_on_surface,
        joints_3d.joined_cuts, joint_nodes.nodes_along_line, least_trace=1e-3,
    ),
}  # fmt: skip


def levels(mesh: Mesh, crack: Crack, numerics: Numerics) -> LevelSet:
    """Level sets of a placed crack; in 3D up to where its functions may reach."""
    if numerics.level_sets is not None:
        result: LevelSet = numerics.level_sets.of(mesh, crack)
        return result
    return level_set(mesh, crack, front_reach(mesh, crack, numerics.radius))
