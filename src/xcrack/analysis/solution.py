"""What a solve returns: displacements, stresses, openings and contact, anywhere in the body."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real
from operator import itemgetter
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from xcrack.analysis.contact import Contact, ContactSolution
from xcrack.analysis.plan import Ingredient, Report, Resultant
from xcrack.base.arguments import Part, check_arguments
from xcrack.base.arrays import Bools, Floats, Ints, lock
from xcrack.base.checks import numbers, value_text, whole_numbers
from xcrack.base.errors import GeometryError, ProblemError
from xcrack.base.markup import element, join_parts, table
from xcrack.fem.facets import LipPoints, jump_values
from xcrack.fem.function_space import FunctionSpace
from xcrack.fem.loads import position
from xcrack.fem.quadrature import at_joints, cell_side
from xcrack.fem.system import System
from xcrack.linalg.engine import Engine, SolverState
from xcrack.linalg.rigid_motion import Motion
from xcrack.mesh.locate import barycentric, cells_at, locate
from xcrack.model.loads import Load
from xcrack.model.problem import CrackNumber, LoadState, Problem, crack_number

# What a solve keeps where errors are asked for: its factor, and the contact of all states.


@dataclass(frozen=True, eq=False)
class FactoredSolution:
    """A system that is still factored; all states of a solve share one.

    Attributes
    ----------
    model : System
    engine : Engine
    motion : Motion
        Rigid motions that were removed.
    contact : ContactSolution
        Of all states.
    around_tips : dict
        Points around tips with the functions there, once K has asked for them.
    """

    model: System
    engine: Engine
    motion: Motion
    contact: ContactSolution
    around_tips: dict[Any, Any] = field(default_factory=dict)

    def __reduce__(self) -> tuple[Any, ...]:
        # A factor holds addresses: a solution in another process has none.
        return type(None), ()


@dataclass(frozen=True, eq=False)
class Solution:
    """Solution of one load state.

    Attributes
    ----------
    problem : Problem
    state : object
        The load state as it was given.
    acting : LoadState
        Loads of this state, and the factor of each.
    space : FunctionSpace
    u : (n_dof,) array, length
        Unknowns: standard, Heaviside, tip functions.
    lips : tuple of LipPoints
        Integration points on the faces of each crack.
    contact : tuple
        One entry a crack: Contact, or None where it has no multipliers.
    energy : float
        Strain energy, u K u / 2.
    make_summary : callable
        Makes `summary`, when it is asked for: steps of a run never do.
    reuse : SolverState
        What serves the next solve in the same mesh.
    number : int
        Which of the states of its solve.
    factored : FactoredSolution, optional
        The factor, of a solve with ``error=True``; lost where a solution is pickled.
    dissipated : float, energy (per thickness in 2D)
        What friction took since the state before; 0 without.
    """

    problem: Problem
    state: object
    acting: LoadState
    space: FunctionSpace
    u: Floats
    lips: tuple[LipPoints, ...]
    contact: tuple[Contact | None, ...]
    energy: float
    make_summary: Callable[[], Report]
    reuse: SolverState
    number: int = 0
    factored: FactoredSolution | None = None
    dissipated: float = 0.0

    @cached_property
    def summary(self) -> Report:
        """What was modelled, what was left out, and why."""
        return self.make_summary()

    @cached_property
    def report(self) -> Report:
        """What was modelled, what was left out, and why; K beside that of a handbook, if given."""
        rows = tuple(
            Ingredient(
                f"handbook K of crack {handbook_case.crack}", True, handbook_case.comparison(self)
            )
            for handbook_case in self.problem.handbook
        )
        return replace(self.summary, ingredients=self.summary.ingredients + rows)

    @property
    def loads(self) -> tuple[Load, ...]:
        """Loads of this state, before they were scaled."""
        return self.acting.loads

    @property
    def factor(self) -> float:
        """Scale of the loads, but for steady ones, and of the displacements of supports."""
        return self.acting.factor

    def scaled(self, factor: float) -> "Solution":
        """The solution under loads times a factor, where all is in proportion to them."""
        factor = float(numbers(factor, "scaled: factor", ()))
        state_now, level = self.acting, 1.0 if self.state is None else self.state
        if not isinstance(level, Real) or any(load.is_steady for load in self.loads):
            raise ProblemError("only a solution of a factor on loads that are not steady scales.")
        contact = []
        for crack_contact in self.contact:
            values = {} if crack_contact is None else {
                name: lock(factor * getattr(crack_contact, name))
                for name in ("pressure", "gap", "shear", "slip")
                if getattr(crack_contact, name) is not None
            }  # fmt: skip
            contact.append(None if crack_contact is None else replace(crack_contact, **values))
        return replace(
            self,
            state=factor * float(level),
            acting=LoadState(
                state_now.loads,
                tuple(factor * f for f in state_now.factors),
                factor * state_now.factor,
            ),
            u=lock(factor * self.u),
            contact=tuple(contact),
            energy=factor**2 * self.energy,
            dissipated=factor**2 * self.dissipated,
            factored=None,
        )

    def __repr__(self) -> str:
        return f"Solution(state={self.state!r}, n_dof={self.n_dof}, energy={self.energy:.6g})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, Any]] = [
            ("load state", "as given" if self.state is None else value_text(self.state)[:80]),
            ("unknowns", self.n_dof),
            ("strain energy", self.energy),
        ]
        for c, contact in enumerate(self.contact):
            if contact is not None and len(contact.measure):
                share = contact.measure[contact.closed].sum() / contact.measure.sum()
                rows.append((f"crack {c} closed", f"{100 * share:.3g} %"))
            else:
                rows.append((f"crack {c}", "no multipliers"))
        picture = self.problem.sketch()
        return join_parts(
            element("b", "Solution"), picture, table((), rows), self.report._repr_html_()
        )

    @property
    def at_rest(self) -> bool:
        """Whether nothing acts in this state: no load, no displacement, no stress, no friction.

        Faces that rub may hold slip without any load.
        """
        return not (self.factor or any(map(itemgetter(1), self.acting)) or self.has_friction)

    @property
    def has_friction(self) -> bool:
        """Whether crack faces rub where they press."""
        for contact in self.contact:
            if contact is not None and contact.shear is not None:
                return True
        return False

    @property
    def n_dof(self) -> int:
        """Number of unknowns, without multipliers."""
        return self.space.n_dof

    @cached_property
    def coefficients(self) -> Floats:
        """Unknowns by function, with a last row of zeros for empty places `(n + 1, d)`."""
        d = self.space.dim
        return lock(np.concatenate([self.u.reshape(-1, d), np.zeros((1, d))]))

    def at(self, cell: Ints, bary: Floats, side: Ints) -> tuple[Floats, Floats]:
        """Displacement `(q, d)` and gradient `(q, d, d)` at points given by cell.

        The gradient's rows are components, its columns directions.

        Parameters
        ----------
        cell : (q,) array of int
        bary : (q, d + 1) array
            Barycentric coordinates in the cell.
        side : (q, cracks) array of {1, -1}
            Side of each crack.

        Raises
        ------
        ProblemError
            Arrays of other shapes or values, or a cell that there is not.
        """
        cell, bary, side = self._by_cell(cell, bary, side)
        u, gradient = fields_at(self.space, self.coefficients[..., None], cell, bary, side)
        return u[..., 0], gradient[..., 0]

    def displacement(self, x: ArrayLike, side: int = 0) -> Floats:
        """Displacement at points.

        Parameters
        ----------
        x : (n, d) array, length
        side : {0, 1, -1}
            Crack face (lip) on which points that lie on a crack are taken; 0: lip +.

        Returns
        -------
        (n, d) array, length
        """
        cell, bary, sides, is_single = self._points_and_sides(x, side)
        u = self.at(cell, bary, sides)[0]
        return u[0] if is_single else u

    def stress(self, x: ArrayLike, side: int = 0) -> Floats:
        """Stress at points `(n, d, d)`, initial stress included.

        Parameters
        ----------
        x : (n, d) array, length
        side : {0, 1, -1}
            Crack face (lip) on which points that lie on a crack are taken; 0: lip +.

        Returns
        -------
        (n, d, d) array, stress
        """
        cell, bary, sides, is_single = self._points_and_sides(x, side)
        sigma = self.stress_at(cell, bary, sides)
        return sigma[0] if is_single else sigma

    def stress_at(self, cell: Ints, bary: Floats, side: Ints) -> Floats:
        """Stress at points given by cell `(q, d, d)`; arguments as of `at`."""
        cell, bary, side = self._by_cell(cell, bary, side)
        sigma = self.problem.elasticity.stress(self.at(cell, bary, side)[1], cell, bary)
        return sigma + initial_stress_at(self, cell, bary)

    def initial_stress(self, x: Floats) -> Floats:
        """Sum of the initial stresses at points `(q, d)`: `(q, d, d)`."""
        x = numbers(x, "initial_stress: x", (None, self.space.dim))
        if self.problem.elasticity.is_uniform:
            no_cells = np.zeros(len(x), dtype=np.int64)  # the stress does not depend on the cell
            return initial_stress_at(self, no_cells, np.zeros((len(x), 0)), x)
        cell = cells_at(self.space.mesh, x)
        return initial_stress_at(self, cell, barycentric(self.space.mesh, cell, x), x)

    @check_arguments()
    def opening(self, crack: CrackNumber = 0) -> Floats:
        """Normal opening n . [[u]] `(q,)` at the points `lips[crack].x`, length."""
        crack = crack_number(self.problem, crack, "opening")
        return np.einsum("qd,qd->q", self.jump(crack), self.lips[crack].normal)

    @check_arguments()
    def jump(self, crack: CrackNumber = 0) -> Floats:
        """Displacement of lip + minus that of lip - `(q, d)` at `lips[crack].x`, length."""
        crack = crack_number(self.problem, crack, "jump")
        lips = self.lips[crack]
        jump = np.zeros((len(lips), self.space.dim))
        for functions, number, N in jump_values(self.space, crack, lips):
            jump[number] += np.einsum("qn,qni->qi", N, self.coefficients[functions])
        return jump

    def inside(self, x: ArrayLike) -> Bools:
        """Whether points lie in the mesh of the body `(n,)`, for which a curved side is a polygon.

        Parameters
        ----------
        x : (n, d) array, length
        """
        return locate(self.space.mesh, self._points(x)[0])[0] >= 0

    def _points(self, x: ArrayLike) -> tuple[Floats, bool]:
        """Points `(n, d)`, and whether a single one was given."""
        points, d = numbers(x, "x"), self.space.dim
        if points.ndim not in (1, 2) or points.shape[-1] != d:
            raise ProblemError(
                f"x has the shape {points.shape}: give points (n, {d}), or one point ({d},)."
            )
        return np.atleast_2d(points), points.ndim == 1

    def _by_cell(self, cell: Ints, bary: Floats, side: Ints) -> tuple[Ints, Floats, Ints]:
        """Places given by cell, checked."""
        n, d = len(self.space.mesh.cells), self.space.dim
        cell = whole_numbers(cell, "cell", (None,))
        if cell.size and not 0 <= cell.min() <= cell.max() < n:
            raise ProblemError(f"cell names cells outside 0 ... {n - 1}: the mesh has no others.")
        bary = numbers(bary, "bary", (len(cell), d + 1))
        side = whole_numbers(side, "side", (len(cell), len(self.space.cuts)))
        if (np.abs(side) > 1).any():
            raise ProblemError("side must hold 1 or -1, for each crack the side of the point.")
        return cell, bary, side

    def _points_and_sides(self, x: ArrayLike, side: int) -> tuple[Ints, Floats, Ints, bool]:
        points, is_single = self._points(x)
        if type(side) is bool or not isinstance(side, Real) or side not in (0, 1, -1):
            raise ProblemError(f"side = {value_text(side)}: give 1 (lip +), -1 (lip -) or 0.")
        cell, bary = locate(self.space.mesh, points)
        if (cell < 0).any():
            first_outside = points[np.argmax(cell < 0)]
            raise GeometryError(
                f"{np.round(first_outside, 9).tolist()} lies outside the body "
                f"({int((cell < 0).sum())} such points), where a curved boundary is a polygon: "
                "choose points by solution.inside(x)."
            )
        return cell, bary, sides_of(self.space, cell, bary, side), is_single


def mean_stress(solutions: Sequence[Solution]) -> float:
    """Stress of the mean energy of a body, in the state in which that is largest."""
    if not solutions:
        return 0.0
    energy = max(0.0, *(solution.energy for solution in solutions))
    body = solutions[0].problem
    modulus = body.elasticity.largest_modulus
    return float(np.sqrt(2 * energy * modulus / float(body.mesh.volume.sum())))


def fields_at(
    space: FunctionSpace, coefficients: Floats, cell: Ints, bary: Floats, side: Ints
) -> tuple[Floats, Floats]:
    """Displacements `(q, d, s)` and gradients `(q, d, d, s)` of several states at once.

    Parameters
    ----------
    space : FunctionSpace
        Shared by all states.
    coefficients : (n + 1, d, s) array, length
        Unknowns by function, the last row zero.
    cell, bary, side : arrays
        Points, as in `Solution.at`.
    """
    from xcrack.fem.kernels.functions import set_gradients

    coefficients = np.array(coefficients, order="C")  # kernels are compiled for read-only ones anew
    d, states = coefficients.shape[1:]
    u, gradient = np.zeros((len(cell), d, states)), np.zeros((len(cell), d, d, states))
    for number, row, functions, N, G in _tables(space, cell, bary, side, values=True):
        a = coefficients[functions[row]].reshape(len(row), N.shape[1], -1)
        u[number] = (N[:, None] @ a).reshape(-1, d, states)
        set_gradients(gradient, number, G, functions, row, coefficients)
    return u, gradient


def gradients_at(
    space: FunctionSpace, coefficients: Floats, cell: Ints, bary: Floats, side: Ints
) -> Floats:
    """Gradients of displacements `(q, d, d, s)` of several states at once.

    Parameters
    ----------
    space, coefficients, cell, bary, side : as in `fields_at`
    """
    from xcrack.fem.kernels.functions import set_gradients

    coefficients = np.array(coefficients, order="C")  # kernels are compiled for read-only ones anew
    d, states = coefficients.shape[1:]
    gradient = np.zeros((len(cell), d, d, states))
    for number, row, functions, _, G in _tables(space, cell, bary, side, values=False):
        set_gradients(gradient, number, G, functions, row, coefficients)
    return gradient


def _tables(
    space: FunctionSpace, cell: Ints, bary: Floats, side: Ints, values: bool
) -> Iterator[tuple[Ints, Ints, Ints, Floats, Floats]]:
    """Of each batch: numbers of its points, their rows, its functions, values and gradients."""
    for batch, number, row in space.batches_of_points(cell):
        N, G = space.tabulate(batch, row, bary[number], side[number], values=values)
        yield number, row, batch.functions, N, G


def sides_of(space: FunctionSpace, cell: Ints, bary: Floats, lip: int) -> Ints:
    """Side of each crack of points in cells `(q, cracks)`; `lip` decides on a crack."""
    side = cell_side(space, cell)
    for c, cut in enumerate(space.cuts):
        phi = cut.level(space.mesh, cell, bary)
        split = (cut.is_cut | cut.is_tip)[cell]
        on_lip = np.abs(phi) <= 1e-9 * space.mesh.cell_size[cell]
        side_of_point = np.where(on_lip & (lip != 0), lip, np.where(phi >= 0, 1, -1))
        side[:, c] = np.where(split, side_of_point, side[:, c])
    return at_joints(space, cell, bary, side) if space.joints else side


def initial_stress_at(
    solution: Solution, cell: Ints, bary: Floats, x: Floats | None = None, is_exact: bool = False
) -> Floats:
    """Sum of the initial stresses at points given by cell, or besides by place `(q, d, d)`.

    Of a graded modulus it is that of the stiffness, or as K takes it the exact one.
    """
    total = np.zeros((len(cell), solution.space.dim, solution.space.dim))
    for load, factor in solution.acting:
        if "initial_stress" in load.acts:
            x = position(solution.space, cell, bary) if x is None else x
            elasticity = solution.problem.elasticity
            total = total + factor * elasticity.initial_stress(load, x, cell, bary, is_exact)
    return total


SolutionArgument = Annotated[Solution, Part(Solution, "a Solution, as solve returns it")]


# What a solve tells a report.


@dataclass(frozen=True)
class SolveOutcome:
    """What a report says of a solve that its solutions do not keep.

    Attributes
    ----------
    n_states : int
    shared_part, solver_reason : str
        What the load states share, and why the solver was taken; empty for the usual one.
    operations : dict
        As in `Report`.
    multipliers : sequence of int or None
        Unknowns on the faces of each crack; None without.
    shear : sequence of int
        Tangential unknowns of each crack that rubs.
    n_motions : int
        Rigid motions that were removed.
    imbalance : float
        Share of the loads that was out of balance.
    unbalanced_share : float or None
        Share of the energy of an initial stress that relaxes without any crack.
    """

    n_states: int
    shared_part: str
    solver_reason: str
    operations: dict[str, int]
    multipliers: Sequence[int | None]
    shear: Sequence[int]
    n_motions: int
    imbalance: float
    unbalanced_share: float | None


def outcome_of(
    problem: Problem,
    model: System,
    engine: Engine,
    contact: ContactSolution,
    n_motions: int,
    imbalance: float,
    n_states: int,
    unbalanced_share: float | None,
) -> SolveOutcome:
    """Numbers of a solve for its report, which is written when it is asked for."""
    method = problem.numerics.contact_method
    has_unknowns = method is None or method.has_unknowns
    multipliers = [None if m is None else has_unknowns * len(m.measure) for m in contact.spaces]
    operations = {
        "unknowns": engine.basis.shape[1],
        "factorisations": engine.count.factorisations,
        "solves": engine.count.solves,
        **({"iterations": engine.count.iterations} if engine.reason else {}),
        "assembled_cells": len(model.space.enriched_cells),
        "integration_points": model.n_points,
        "multipliers": sum(n or 0 for n in multipliers),
        "contact_iterations": contact.sets,
    }
    shear = [len(work.shear) for work in contact.friction_work]
    return SolveOutcome(
        n_states, engine.shared_part, engine.reason, operations, multipliers, shear, n_motions,
        imbalance, unbalanced_share,
    )  # fmt: skip


def resultants(
    problem: Problem,
    model: System,
    loads: Sequence[Load],
    vectors: Sequence[Floats],
    residual: Floats,
) -> tuple[Resultant, ...]:
    """Force and moment of each load of a state and of the reaction of each support.

    Parameters
    ----------
    problem : Problem
    model : System
    loads : sequence of loads
    vectors : sequence of (n_dof,) arrays, force
        Of each load, scaled as in the state.
    residual : (n_dof,) array, force
        Stiffness times displacements less all loads; contact acts on jumps only.
    """
    rows = [
        _resultant(model, load.name, vector)
        for load, vector in zip(loads, vectors, strict=True)
        if load.is_listed
    ]
    for number, support in enumerate(problem.supports):
        rows_of_support = model.imposed_values.owner == number
        rows.append(
            _resultant(
                model, f"reaction of {support.name}", np.where(rows_of_support, residual, 0.0)
            )
        )
    return tuple(rows)


def _resultant(model: System, name: str, f: Floats) -> Resultant:
    """Sums over the standard functions, which together are one everywhere."""
    x = model.space.node_points
    forces = f.reshape(-1, x.shape[1])[: len(x)]
    force = tuple(np.ascontiguousarray(forces.T).sum(axis=1).tolist())
    product = x.T @ forces
    spin = product - product.T
    if len(force) < 3:
        return Resultant(name, force, float(spin[0, 1]))
    return Resultant(name, force, (float(spin[1, 2]), float(spin[2, 0]), float(spin[0, 1])))


__all__ = ["SolveOutcome", "outcome_of", "resultants"]
