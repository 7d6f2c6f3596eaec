"""What each cell of a body is made of: one material, several by cell set, graded ones.

A graded modulus is known at the corners of cells and the middles of their edges, between which it
is quadratic. In the stiffness it is linear in each cell: products of standard functions are then
integrated exactly by any rule of one degree more, and entries of standard and of enriched
functions, which come from other points, would else not make a positive matrix.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations
from typing import Any

import numpy as np

from xcrack.base.arrays import Bools, Floats, Ints, at, lock
from xcrack.base.checks import value_text
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.mesh.locate import barycentric, cells_at
from xcrack.mesh.mesh import Mesh, local_edges
from xcrack.mesh.simplex import node_points, simplex_rule
from xcrack.model.material import Isotropic, Material, ScaledMaterial, isotropic_part

Rows = Any  # an array of row numbers, or a slice that takes all


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Stiffness over a body, whose materials are bonded where they meet.

    Attributes
    ----------
    mesh : Mesh
    material : Material
        As the problem has it.
    materials : tuple of Material
        Those that differ in what they do to displacements and stresses.
    number : (m,) array of int
        Which of them each cell is made of; empty where there is but one.
    named : tuple of (str, Material)
        As they were given: by name of cell set, the one material by an empty name.
    set_number : (m,) array of int
        Which of these each cell has; empty where there is but one.
    """

    mesh: Mesh
    material: Material
    materials: tuple[Material, ...]
    number: Ints
    named: tuple[tuple[str, Material], ...]
    set_number: Ints

    @property
    def plane(self) -> str | None:
        """State of a 2D body, of all its materials."""
        return self.named[0][1].plane

    @cached_property
    def is_graded(self) -> bool:
        """Whether the modulus of one of the materials changes from point to point."""
        return any(material.is_graded for material in self.materials)

    @cached_property
    def is_uniform(self) -> bool:
        """Whether the stiffness is the same in all of the body."""
        return len(self.materials) == 1 and not self.is_graded

    @cached_property
    def largest_modulus(self) -> float:
        """Largest Young's modulus in the body, stress: a scale."""
        return float(self.moduli_of_cells.max())

    @cached_property
    def moduli_of_cells(self) -> Floats:
        """Largest Young's modulus in each cell `(m,)`, stress: a scale."""
        result = np.empty(len(self.mesh.cells))
        for material, cells in self.groups(np.arange(len(result))):
            result[cells] = material.unit.largest_modulus
        return lock(result if self.factor is None else result * self.factor.max(axis=1))

    @cached_property
    def poisson(self) -> float:
        """Poisson's ratio: the one that its materials have, or their mean by volume.

        Raises
        ------
        ProblemError
            A material that is not isotropic.
        """
        total = 0.0
        for material, cells in self.groups(np.arange(len(self.mesh.cells))):
            nu = material.unit.at_tip().nu
            if len(self.materials) == 1:
                return nu
            total += nu * float(self.mesh.volume[cells].sum())
        return total / float(self.mesh.volume.sum())

    def poisson_at(self, x: Floats) -> float | Floats:
        """Poisson's ratio at points `(n, d)`: one number where all materials have it, else `(n,)`.

        Raises
        ------
        ProblemError
            A material that is not isotropic.
        """
        if len(self.named) == 1:
            return self.poisson
        values = np.array([material.unit.at_tip().nu for _, material in self.named])
        return float(values[0]) if np.ptp(values) == 0 else np.asarray(values[self.sets_at(x)])

    @property
    def knows_yield(self) -> bool:
        """Whether one of its materials has a yield stress."""
        return any(material.yield_stress is not None for _, material in self.named)

    def yield_of_cells(self, cells: Ints) -> Floats:
        """Yield stress in cells `(k,)`, inf where it is not known."""
        limits = [np.inf if m.yield_stress is None else m.yield_stress for _, m in self.named]
        number = self.set_number[cells] if len(self.set_number) else np.zeros_like(cells)
        return np.asarray(np.array(limits)[number])

    @cached_property
    def interfaces(self) -> Ints:
        """Numbers of the facets between cells of different materials `(k,)`."""
        if not len(self.number):
            return np.zeros(0, dtype=np.int64)
        c0, c1 = self.mesh.facet_to_cell.T
        return lock(np.nonzero((c1 >= 0) & (self.number[c0] != self.number[c1]))[0])

    @cached_property
    def node_moduli(self) -> Floats | None:
        """Modulus of graded materials at the nodes of order 2 of cells `(m, n)`, one elsewhere.

        None where nothing is graded.
        """
        if not self.is_graded:
            return None
        nodes, points = self.mesh.corners_and_edges, node_points(self.mesh, 2)
        values = np.ones(nodes.shape)
        for material, cells in self.groups(np.arange(len(self.mesh.cells))):
            if material.is_graded:
                numbers, place = np.unique(nodes[cells], return_inverse=True)
                moduli = material.moduli(points[numbers], numbers)  # type: ignore[attr-defined]
                values[cells] = moduli[place.reshape(len(cells), -1)]
        return lock(values)

    @cached_property
    def factor(self) -> Floats | None:
        """Modulus as it counts in the stiffness: at the corners of cells `(m, d + 1)`.

        In each cell the linear function nearest in L2: what it differs by is orthogonal to linear
        functions there, so that smooth products of strains do not see it. Where the nearest one
        would not be positive it goes through the values at the corners.
        """
        if self.node_moduli is None:
            return None
        moduli = self.node_moduli @ _projection(self.mesh.dim).T
        at_corners = self.node_moduli[:, : self.mesh.dim + 1]
        return lock(np.where(moduli.min(axis=1, keepdims=True) > 0, moduli, at_corners))

    def moduli(self, cell: Ints, bary: Floats) -> Floats | None:
        """Modulus of graded materials at points `(q,)`, quadratic in each cell; None without."""
        if self.node_moduli is None:
            return None
        return np.asarray(np.einsum("qn,qn->q", _shapes(bary), self.node_moduli[cell]))

    def factors(self, cell: Ints, bary: Floats) -> Floats | None:
        """Modulus as it counts in the stiffness, at points `(q,)`; None where nothing is graded."""
        if self.factor is None:
            return None
        return np.asarray(np.einsum("qb,qb->q", bary, self.factor[cell]))

    def weights(self, cell: Ints, bary: Floats, weight: Floats) -> Floats:
        """Weights of points by which the stiffness of the `unit` of their material counts."""
        factor = self.factors(cell, bary)
        return weight if factor is None else weight * factor

    def groups(self, cells: Ints) -> list[tuple[Material, Ints]]:
        """The given cells by material, in their order."""
        if not len(self.number):
            return [(self.materials[0], cells)]
        number = self.number[cells]
        return [(self.materials[k], cells[number == k]) for k in np.unique(number).tolist()]

    def at_points(
        self, cell: Ints, bary: Floats, is_exact: bool = False
    ) -> Iterator[tuple[Rows, Material]]:
        """Points by material: their rows, and the material as it is there.

        Parameters
        ----------
        cell : (q,) array of int
        bary : (q, d + 1) array
        is_exact : bool
            A graded modulus is the quadratic one, not that of the stiffness.
        """
        factor = self.moduli(cell, bary) if is_exact else self.factors(cell, bary)
        numbers = [0] if not len(self.number) else np.unique(self.number[cell]).tolist()
        for k in numbers:
            rows = np.nonzero(self.number[cell] == k)[0] if len(self.number) else slice(None)
            material = self.materials[k]
            if material.is_graded and factor is not None:
                material = ScaledMaterial(material, factor[rows])
            yield rows, material

    def stress(self, gradient: Floats, cell: Ints, bary: Floats) -> Floats:
        """Stress `(q, d, d)` of displacement gradients at points given by cell."""
        return self._by_material(lambda material: material.stress, gradient, cell, bary)

    def strain(self, stress: Floats, cell: Ints, bary: Floats) -> Floats:
        """Strain `(q, d, d)` of stresses at points given by cell."""
        return self._by_material(lambda material: material.strain, stress, cell, bary)

    def stress_across(self, stress: Floats, cell: Ints, bary: Floats) -> Floats:
        """Stress across the plane `(q,)` of a plane body, from that in it `(q, 2, 2)`."""
        if self.is_uniform:
            return self.materials[0].stress_across(stress)
        result = np.empty(len(stress))
        for rows, material in self.at_points(cell, bary):
            result[rows] = material.stress_across(stress[rows])
        return result

    def initial_stress(
        self, load: Any, x: Floats, cell: Ints, bary: Floats, is_exact: bool = False
    ) -> Floats:
        """Stress `(q, d, d)` that a load makes in the undeformed body, at points given by cell.

        Parameters
        ----------
        load : Load
        x : (q, d) array, length
        cell, bary : (q,) array of int and (q, d + 1) array
        is_exact : bool
            As of `at_points`.
        """
        if self.is_uniform:
            return np.asarray(load.initial_stress(x, self.materials[0]))
        result = np.empty((len(x), x.shape[1], x.shape[1]))
        for rows, material in self.at_points(cell, bary, is_exact):
            result[rows] = load.initial_stress(x[rows], material)
        return result

    def at_tip(self, cells: Ints, x: Floats) -> Isotropic:
        """The isotropic material at a tip.

        Parameters
        ----------
        cells : (k,) array of int
            Around the tip.
        x : (d,) array, length

        Raises
        ------
        GeometryError
            The tip lies on an interface.
        ProblemError
            The material there is not isotropic.
        """
        if len(self.number) and len(np.unique(self.number[cells])) > 1:
            names = " and ".join(map(repr, self.names_of(cells)))
            raise GeometryError(
                f"the crack ends at {at(x)} on the interface of {names}: the stress there does not "
                "go like 1/√r, so there is no K. Let it end a cell before or behind; a crack along "
                "the interface has a complex K, see interface_intensity."
            )
        return self._isotropic_at(int(cells[0]), x)

    def isotropic_at(self, x: Floats) -> Isotropic:
        """The isotropic material at a point `(d,)`.

        Raises
        ------
        ProblemError
            It is not isotropic.
        """
        return self._isotropic_at(int(cells_at(self.mesh, x[None])[0]), x)

    def _isotropic_at(self, cell: int, x: Floats) -> Isotropic:
        """The isotropic material at a point in a cell."""
        material = self.materials[int(self.number[cell]) if len(self.number) else 0]
        if not material.is_graded:
            return material.at_tip()
        cells = np.array([cell])
        moduli: Any = self.moduli(cells, barycentric(self.mesh, cells, x[None]))
        unit = material.unit.at_tip()
        return Isotropic(float(moduli[0]) * unit.E, unit.nu, unit.plane)

    def sets_at(self, x: Floats) -> Ints:
        """Which of the named materials points have `(n,)`; outside of the mesh that of the nearest.

        Parameters
        ----------
        x : (n, d) array, length
        """
        if not len(self.set_number):
            return np.zeros(len(x), dtype=np.int64)
        return self.set_number[cells_at(self.mesh, x)]

    def names_at(self, x: Floats) -> Any:
        """Names of the materials at points `(n,)`: of their cell sets."""
        return np.array([name for name, _ in self.named])[self.sets_at(x)]

    def toughness_at(self, x: Floats) -> Floats:
        """Toughness of the material at points `(n,)`, inf where it is not known."""
        K_c = [np.inf if material.K_c is None else material.K_c for _, material in self.named]
        return np.asarray(np.array(K_c)[self.sets_at(x)])

    def names_of(self, cells: Ints) -> list[str]:
        """Names of the cell sets that hold the materials of some cells."""
        if not len(self.set_number):
            return [self.named[0][0]]
        return [self.named[k][0] for k in np.unique(self.set_number[cells]).tolist()]

    def cells_unlike(self, material: Isotropic, cells: Ints) -> Ints:
        """Those of the cells whose stiffness is not everywhere that of a material."""
        tensor = material.tensor(self.mesh.dim)
        numbers = [
            k
            for k, m in enumerate(self.materials)
            if m.is_graded or not np.array_equal(m.tensor(self.mesh.dim), tensor)
        ]
        if not len(self.number):
            return cells if numbers else cells[:0]
        return cells[np.isin(self.number[cells], numbers)]

    def change(self, material: Isotropic, cell: Ints, bary: Floats, frame: Floats) -> Floats:
        """Stiffness at points less that of a material `(q, v, v)`, stress.

        Of strains and shear angles along the rows of a frame `(d, d)`: v = 3 (xx, yy, xy) in 2D,
        6 in 3D (xx, yy, zz, yz, xz, xy).
        """
        d = self.mesh.dim
        stiffness = np.stack([_voigt(m.unit.tensor(d), frame) for m in self.materials])
        result = stiffness[self.number[cell] if len(self.number) else np.zeros_like(cell)]
        moduli = self.moduli(cell, bary)
        if moduli is not None:
            result = result * moduli[:, None, None]
        return np.asarray(result - _voigt(material.tensor(d), frame))

    def stress_change(
        self, material: Isotropic, gradient: Floats, cell: Ints, bary: Floats
    ) -> Floats:
        """Stress of displacement gradients less that which another material would bear.

        Parameters
        ----------
        material : Isotropic
        gradient : (q, d, d, n) array
            Of n states.
        cell, bary : (q,) array of int and (q, d + 1) array

        Returns
        -------
        (q, d, d, n) array, stress
        """
        result = np.zeros_like(gradient)
        is_different = np.zeros(len(self.mesh.cells), dtype=bool)
        is_different[self.cells_unlike(material, np.arange(len(is_different)))] = True
        rows = np.nonzero(is_different[cell])[0]
        for n in range(gradient.shape[3] if len(rows) else 0):
            grad_u = np.ascontiguousarray(gradient[rows, :, :, n])
            for part, m in self.at_points(cell[rows], bary[rows], is_exact=True):
                change = m.stress(grad_u[part]) - material.stress(grad_u[part])
                result[rows[part], :, :, n] = change
        return result

    def _by_material(
        self,
        response_of: Callable[[Material], Callable[[Floats], Floats]],
        tensor: Floats,
        cell: Ints,
        bary: Floats,
    ) -> Floats:
        if self.is_uniform:
            return np.asarray(response_of(self.materials[0])(tensor))
        result = np.empty_like(tensor)
        for rows, material in self.at_points(cell, bary):
            result[rows] = response_of(material)(tensor[rows])
        return result


def _shapes(bary: Floats) -> Floats:
    """Shape functions of order 2 at barycentric coordinates `(q, n)`."""
    i, j = local_edges(bary.shape[1] - 1).T
    return np.concatenate([bary * (2 * bary - 1), 4 * bary[:, i] * bary[:, j]], axis=1)


@cache
def _projection(dim: int) -> Floats:
    """Matrix from values at the nodes of order 2 to those of the nearest linear function (L2)."""
    bary, weight = simplex_rule(dim, 3)
    moments = np.einsum("q,qb,qn->bn", weight, bary, _shapes(bary))
    return lock((dim + 1) * ((dim + 2) * moments - moments.sum(axis=0)))


def _voigt(tensor: Floats, frame: Floats) -> Floats:
    """Stiffness `(v, v)` along the rows of a frame, of a tensor `(d, d, d, d)`."""
    rotated = tensor
    if isotropic_part(tensor)[2] is not None:
        rotated = np.einsum("ai,bj,ck,dl,ijkl->abcd", frame, frame, frame, frame, tensor)
    d = len(tensor)
    shear = sorted(combinations(range(d), 2), reverse=True)
    i, j = np.array([*((k, k) for k in range(d)), *shear]).T
    return rotated[i[:, None], j[:, None], i, j]


def elasticity(mesh: Mesh, material: Material) -> Elasticity:
    """What the cells of a mesh are made of.

    Raises
    ------
    ProblemError
        Sets that the mesh does not have, that are empty, overlap or leave cells out; a graded
        modulus that is not above 0 somewhere.
    """
    nothing, material_by_set = lock(np.zeros(0, dtype=np.int64)), material.named
    set_number = (
        _set_numbers(mesh, [name for name, _ in material_by_set])
        if material_by_set[0][0]
        else nothing
    )
    keys = [_key(m) for _, m in material_by_set]
    distinct_keys = list(dict.fromkeys(keys))
    materials = tuple(material_by_set[keys.index(key)][1] for key in distinct_keys)
    number = nothing
    if len(distinct_keys) > 1:
        number = lock(np.array([distinct_keys.index(key) for key in keys])[set_number])
    result = Elasticity(mesh, material, materials, number, material_by_set, set_number)
    _ = result.factor  # refuses values that are no modulus
    return result


def _key(material: Material) -> tuple[Any, ...]:
    """What a material does to displacements and stresses."""
    stiffness = np.asarray(material.unit.stiffness(), dtype=float).tobytes()
    return stiffness, material.unit.plane, material.alpha, material.modulus_field


def _set_numbers(mesh: Mesh, names: list[str]) -> Ints:
    """Number of the set of each cell."""
    number = np.full(len(mesh.cells), -1)
    for k, name in enumerate(names):
        if name not in mesh.cell_sets:
            other_names = ", ".join(map(repr, mesh.cell_sets)) or "none"
            raise ProblemError(
                f"material: the mesh has no cell set {value_text(name)}: it has {other_names}."
            )
        members = mesh.cell_sets[name]
        if not len(members):
            raise ProblemError(
                f"material: the cell set {name!r} is empty: leave it out, or give it cells."
            )
        double_cells = members[number[members] >= 0]
        if len(double_cells):
            first_set = names[int(number[double_cells[0]])]
            raise ProblemError(
                f"material: {len(double_cells)} cells, one at "
                f"{_cell_middle(mesh, double_cells[0])}, are in {first_set!r} and in {name!r}: "
                "give each cell one material."
            )
        number[members] = k
    has_no_material: Bools = number < 0
    if has_no_material.any():
        raise ProblemError(
            f"material: {int(has_no_material.sum())} cells, one at "
            f"{_cell_middle(mesh, int(np.argmax(has_no_material)))}, are in none of the sets "
            f"{', '.join(map(repr, names))}: give every cell a material."
        )
    return lock(number)


def _cell_middle(mesh: Mesh, cell: int) -> list[float]:
    return at(mesh.points[mesh.cells[cell]].mean(axis=0))


__all__ = ["Elasticity", "elasticity"]
