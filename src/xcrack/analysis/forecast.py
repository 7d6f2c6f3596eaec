"""Unknowns and memory of a solution, foretold from mesh and cracks before anything is built."""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.errors import ProblemError, SizeError
from xcrack.base.memory import free_memory
from xcrack.crack.crack import Crack, crack_length
from xcrack.crack.measures import area_inside, front_length_inside
from xcrack.fem.enrichment import reach_of_tips
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import leg_sizes
from xcrack.model.problem import Problem

# Unknowns of a 3D body above which a factorisation costs more, by order (measured).
_DIRECT = {1: 4_000, 2: 8_000}
# Nodes that carry a jump lie within so many cells across a crack, by order.
_LAYER = {1: 2.0, 2: 1.5}

# Peak of a solution in bytes, measured from 5 k to 450 k unknowns (docs/measured.md).
# Conjugate gradients: of a standard unknown, and of an enriched one, whose rows are long; by order.
_OF_ROWS = {1: (1.4e3, 9.5e3), 2: (2.4e3, 40e3)}
_OF_STATE = 56.0  # of an unknown in each further load state
_RUBBING = 2.0  # times, for the solutions of the rows of pressure and shear
# A factor: by dimension, of an unknown, and its power; in 3D a factor fills like n^(4/3).
_OF_FACTOR = {2: (3.1e3, 1.0), 3: (750.0, 4 / 3)}


@dataclass(frozen=True)
class Forecast:
    """What a solution will take, within a factor of two.

    Attributes
    ----------
    standard : int
        Unknowns of the standard functions; exact but for the holes of the body.
    enriched : int
        Unknowns of functions that jump or belong to tips, by area and front of the cracks.
    order : int
    by_iteration : bool
        Whether conjugate gradients solve it, or a factorisation.
    memory : float, bytes
    free : float, bytes, or None
        What the system has to give; None where it does not say so.
    """

    standard: int
    enriched: int
    order: int
    by_iteration: bool
    memory: float
    free: float | None

    @property
    def unknowns(self) -> int:
        """Standard and enriched ones."""
        return self.standard + self.enriched

    @property
    def fits(self) -> bool:
        """Whether there is enough memory, as far as the system says."""
        return self.free is None or self.memory <= self.free

    def __str__(self) -> str:
        free = "free memory is not known on this system"
        if self.free is not None:
            free = f"{_size(self.free)} are free" + ("" if self.fits else ": too little")
        way = "conjugate gradients" if self.by_iteration else "a factorisation"
        number = f"about {_two_digits(self.unknowns)} unknowns at order {self.order}"
        return f"{number}, and {_size(self.memory)} for {way}; {free}"


def forecast_of(problem: Problem, n_states: int = 1) -> Forecast:
    """Unknowns and memory of a solution, from counts, areas and lengths alone.

    Parameters
    ----------
    problem : Problem
    n_states : int
        Load states that are solved together.
    """
    mesh, order, dim = problem.mesh, problem.order or 1, problem.mesh.dim
    nodes = _count_nodes(mesh, order)
    per_point = nodes / mesh.n_points
    functions = sum(_enriched_functions(problem, crack, per_point) for crack in problem.placed)
    standard, enriched = dim * nodes, round(dim * functions)
    n = standard + enriched
    by_iteration = takes_iterations(problem, n)
    if by_iteration:
        memory = float(np.dot(_OF_ROWS[order], (standard, enriched)))
        memory += _OF_STATE * (n_states - 1) * n
        memory *= _RUBBING if problem.contact != "off" and any(problem.frictions) else 1.0
    else:
        each, power = _OF_FACTOR[dim]
        memory = each * float(n) ** power
    return Forecast(standard, enriched, order, by_iteration, memory, free_memory())


def check_memory(problem: Problem, n_states: int = 1) -> None:
    """Raise where a solution would take more memory than is free.

    Raises
    ------
    SizeError
    """
    ahead = forecast_of(problem, n_states)
    if ahead.fits:
        return
    remedy_list = ["larger cells away from the cracks", "or let xc.adapt choose the mesh"]
    if not ahead.by_iteration and problem.mesh.dim == 3:
        remedy_list.insert(0, 'Numerics(linear="iterative")')
    if ahead.order == 2:
        less = forecast_of(replace(problem, order=1), n_states)
        remedy_list.insert(0, f"order=1 ({_size(less.memory)}, with K less exact)")
    raise SizeError(f"solve: {ahead}. Give {', '.join(remedy_list)}.")


def takes_iterations(problem: Problem, n: int) -> bool:
    """Whether a system of n unknowns is solved by conjugate gradients."""
    linear = problem.numerics.linear
    if linear != "auto":
        return linear == "iterative"
    large = problem.mesh.dim == 3 and n > _DIRECT[problem.order or 1]
    return large and problem.numerics.contact_method is None  # others change the matrix


def _count_nodes(mesh: Mesh, order: int) -> int:
    """Points and, at order 2, edges, by Euler's formula for a body without holes."""
    if order == 1:
        return mesh.n_points
    flat = len(mesh.boundary) // 2 if mesh.dim == 3 else 0
    return 2 * mesh.n_points + len(mesh.cells) + flat - 1


def _enriched_functions(problem: Problem, crack: Crack, per_point: float) -> float:
    """Nodes that carry a jump, and functions of the points at tips: of these one a leg^d."""
    mesh, order, numerics = problem.mesh, problem.order or 1, problem.numerics
    pieces = crack.points[crack.faces]
    cells = mesh.cell_tree.query(pieces.mean(axis=1))[1]
    leg_length = float(np.median(leg_sizes(mesh, cells)))
    if mesh.dim == 2:
        size, ends = crack_length(crack), float(crack.n_tips)
    else:
        try:
            size, ends = area_inside(crack, mesh), front_length_inside(crack, mesh)
        except ProblemError:  # it only touches the body
            return 0.0
    at_tips = 0.0
    if crack.n_tips:
        a = (1 if mesh.dim == 2 else 2) * size / max(ends, 1e-9)  # of a penny its radius
        radius = reach_of_tips(mesh.dim, order, a, leg_length, numerics.radius)
        at_tips = np.pi * radius**2 * ends / leg_length**mesh.dim
    n_jumping = _LAYER[order] * per_point * size / leg_length ** (mesh.dim - 1)
    return n_jumping + numerics.functions * at_tips


def _size(memory: float) -> str:
    return f"{memory / 1e9:.2g} GB" if memory >= 0.95e8 else f"{memory / 1e6:.2g} MB"


def _two_digits(number: int) -> str:
    """Two digits: more are not known."""
    return f"{float(f'{number:.2g}'):,.0f}".replace(",", " ")


__all__ = ["Forecast", "check_memory", "forecast_of", "takes_iterations"]
