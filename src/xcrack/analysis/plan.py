"""What a scene needs, decided and foretold before anything is solved."""

from dataclasses import dataclass, replace

import numpy as np

from xcrack.base.arguments import check_arguments
from xcrack.base.arrays import coordinates
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError, SizeError
from xcrack.base.machine import free_memory
from xcrack.base.markup import element
from xcrack.crack.crack import Crack, crack_length
from xcrack.crack.measures import DEEP, area_inside, cells_deep, front_length_inside
from xcrack.crack.stations import GEOMETRY
from xcrack.fem.enrichment import reach_of_tips
from xcrack.linalg.engine import may_rub, takes_iterations
from xcrack.mesh.locate import Body
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.simplex import leg_sizes
from xcrack.model.problem import Problem, ProblemArgument

# Unknowns and memory, foretold from mesh and cracks.

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
        memory_text = "free memory is not known on this system"
        if self.free is not None:
            memory_text = f"{_size(self.free)} are free" + ("" if self.fits else ": too little")
        way = "conjugate gradients" if self.by_iteration else "a factorisation"
        number = f"about {_two_digits(self.unknowns)} unknowns at order {self.order}"
        return f"{number}, and {_size(self.memory)} for {way}; {memory_text}"


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
    standard, enriched_unknowns = dim * nodes, round(dim * functions)
    n = standard + enriched_unknowns
    by_iteration = takes_iterations(problem, n)
    memory = _memory(problem, standard, enriched_unknowns, by_iteration, n_states)
    return Forecast(standard, enriched_unknowns, order, by_iteration, memory, free_memory())


def _memory(
    problem: Problem, standard: int, enriched: int, by_iteration: bool, n_states: int
) -> float:
    """Bytes that a solution of so many unknowns takes."""
    if not by_iteration:
        factor, power = _OF_FACTOR[problem.mesh.dim]
        return factor * float(standard + enriched) ** power
    memory = float(np.dot(_OF_ROWS[problem.order or 1], (standard, enriched)))
    memory += _OF_STATE * (n_states - 1) * (standard + enriched)
    return memory * (_RUBBING if may_rub(problem) else 1.0)


def check_memory(problem: Problem, n_states: int = 1) -> None:
    """Raise where a solution would take more memory than is free.

    Raises
    ------
    SizeError
    """
    if _fits_surely(problem, n_states):
        return
    forecast = forecast_of(problem, n_states)
    if forecast.fits:
        return
    remedy_list = [
        "larger cells away from the cracks",
        "or a mesh of larger cells to xc.adapt, which makes them smaller only where K asks for it",
    ]
    if not forecast.by_iteration and problem.mesh.dim == 3:
        remedy_list.insert(0, 'Numerics(linear="iterative")')
    if forecast.order == 2:
        forecast_of_order_1 = forecast_of(replace(problem, order=1), n_states)
        remedy_list.insert(0, f"order=1 ({_size(forecast_of_order_1.memory)}, with K less exact)")
    raise SizeError(f"solve: {forecast}. Give {', '.join(remedy_list)}.")


def _fits_surely(problem: Problem, n_states: int) -> bool:
    """Whether a solution fits if all nodes carry all functions: no look at cracks."""
    mesh, free_bytes = problem.mesh, free_memory()
    if free_bytes is None:
        return True
    functions = [1 + problem.numerics.functions * crack.n_tips for crack in problem.placed]
    standard = mesh.dim * _count_nodes(mesh, problem.order or 1)
    n_enriched = standard * sum(functions)
    ways = {takes_iterations(problem, standard), takes_iterations(problem, standard + n_enriched)}
    memory = [_memory(problem, standard, n_enriched, way, n_states) for way in ways]
    return max(memory) <= free_bytes


def _count_nodes(mesh: Mesh, order: int) -> int:
    """Points and, at order 2, edges, by Euler's formula for a body without holes."""
    if order == 1:
        return mesh.n_points
    boundary_edges = len(mesh.boundary) // 2 if mesh.dim == 3 else 0
    return 2 * mesh.n_points + len(mesh.cells) + boundary_edges - 1


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


# Functions that a scene needs, and the report of them.


@dataclass(frozen=True)
class Ingredient:
    """One thing that may be modelled.

    Attributes
    ----------
    name : str
    used : bool
    reason : str
    unknowns : int
        Cost in unknowns.
    """

    name: str
    used: bool
    reason: str
    unknowns: int = 0

    def __str__(self) -> str:
        mark = "used" if self.used else "left out"
        cost = f"  [{self.unknowns} unknowns]" if self.unknowns else ""
        return f"{self.name:<24}{mark:<10}{self.reason}{cost}"


@dataclass(frozen=True)
class Resultant:
    """Force and moment of a load, or of the reaction of a support.

    Attributes
    ----------
    name : str
    force : (d,) tuple, force (per thickness in 2D)
    moment : float in 2D, (3,) tuple in 3D, force times length (per thickness in 2D)
        About the origin.
    """

    name: str
    force: tuple[float, ...]
    moment: float | tuple[float, ...]

    @property
    def sums_as_text(self) -> tuple[str, str]:
        """Force and moment as text; what is zero to round-off reads 0."""
        moment = (self.moment,) if isinstance(self.moment, float) else self.moment
        tolerance = 1e-12 * max(map(abs, (*self.force, *moment)))
        return coordinates(_cut(self.force, tolerance)), coordinates(_cut(moment, tolerance))

    def __str__(self) -> str:
        force, moment = self.sums_as_text
        return f"{self.name:<33} force {force}, moment about the origin {moment}"


def _cut(values: tuple[float, ...], tolerance: float) -> list[float]:
    return [v if abs(v) > tolerance else 0.0 for v in values]


@dataclass(frozen=True)
class Report:
    """Ingredients of a scene, one line each, and the operations that a solve took.

    Attributes
    ----------
    ingredients : tuple of Ingredient
    operations : dict
        Unknowns solved for, factorisations, solves, assembled cells, integration points,
        multipliers.
    resultants : tuple of Resultant
        Of each load of the state, and of the reaction of each support.
    size_forecast : Forecast, optional
        Unknowns and memory, where nothing is solved yet.
    """

    ingredients: tuple[Ingredient, ...]
    operations: dict[str, int]
    resultants: tuple[Resultant, ...] = ()
    size_forecast: Forecast | None = None

    def __str__(self) -> str:
        lines = [str(i) for i in (*self.ingredients, *self.resultants)]
        if self.operations:
            counts = ", ".join(f"{v} {k.replace('_', ' ')}" for k, v in self.operations.items())
            lines.append(f"{'operations':<24}{counts}")
        if self.size_forecast is not None:
            lines.append(f"{'forecast':<24}{self.size_forecast}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return element("pre", str(self))

    def __getitem__(self, name: str) -> Ingredient:
        for ingredient in self.ingredients:
            if isinstance(name, str) and ingredient.name == name:
                return ingredient
        listed_names = ", ".join(f'"{ingredient.name}"' for ingredient in self.ingredients)
        raise ProblemError(
            f"the report has no ingredient {value_text(name)}: give one of {listed_names}."
        )


@check_arguments()
def plan(problem: ProblemArgument) -> Report:
    """What a scene needs, decided before anything is built.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    Report
        Printed, it gives one line an ingredient: used or left out, and the reason; and one of the
        unknowns and the memory of a solution for one load state, and the memory that is free.

    Raises
    ------
    ProblemError
        Not a problem.

    Examples
    --------
    >>> import xcrack as xc
    >>> mesh = xc.box((0, 0), (1, 1), 8)
    >>> steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
    >>> print(xc.plan(xc.Problem(mesh, steel))["tip functions"])
    tip functions           left out  no cracks
    """
    rows = (*ingredients_of(problem), *_order(problem))
    return Report(rows, {}, size_forecast=forecast_of(problem))


def ingredients_of(problem: Problem) -> tuple[Ingredient, ...]:
    """What a scene needs, line by line."""
    n_tips = [crack.n_tips for crack in problem.placed]
    rows = [*_materials(problem), _heaviside(n_tips), _tips(problem, n_tips)]
    rows.extend(_multipliers(problem))
    rows.extend(_friction(problem))
    rows.append(_third_mode(problem, n_tips))
    reason = "the body is supported" if problem.supports else "none given; rigid motion is removed"
    rows.append(Ingredient("supports", bool(problem.supports), reason))
    rows.append(
        Ingredient(
            "enriched quadrature",
            bool(sum(n_tips)) or bool(n_tips),
            "points only in cells with enriched functions; plain cells are tabulated"
            if n_tips
            else "no cracks: plain finite elements",
        )
    )
    rows.append(Ingredient("refinement", False, "the mesh is taken as it is"))
    return tuple(rows)


def _materials(problem: Problem) -> list[Ingredient]:
    """What the body is made of, where it is not one material, and where the tips are."""
    elasticity = problem.elasticity
    if elasticity.is_uniform and len(elasticity.named) == 1:
        return []
    cells = np.bincount(elasticity.set_number, minlength=len(elasticity.named))
    if len(elasticity.named) == 1:
        return [Ingredient("materials", True, f"{elasticity.named[0][1]!r}, linear in each cell")]
    parts = [
        f"{name!r} ({count} cells): {material!r}"
        for (name, material), count in zip(elasticity.named, cells, strict=True)
    ]
    bond = f"bonded along {len(elasticity.interfaces)} facets"
    rows = [Ingredient("materials", True, f"{'; '.join(parts)}; {bond}")]
    stations = problem.stations
    sets = elasticity.sets_at(stations.x)
    ends = "tips" if problem.mesh.dim == 2 else "fronts"
    for c in np.unique(stations.crack).tolist():
        names = [elasticity.named[k][0] for k in np.unique(sets[stations.crack == c]).tolist()]
        if problem.mesh.dim == 2:
            names = [elasticity.named[k][0] for k in sets[stations.crack == c].tolist()]
        rows.append(Ingredient(f"{ends} of crack {c}", True, f"in {', '.join(map(repr, names))}"))
    return rows


def _third_mode(problem: Problem, n_tips: list[int]) -> Ingredient:
    if problem.mesh.dim == 2:
        return Ingredient("third mode", False, "a 2D problem has modes I and II only")
    if not sum(n_tips):
        return Ingredient("third mode", False, "no front to tear along")
    return Ingredient("third mode", True, "K_III along every front")


def _heaviside(n_tips: list[int]) -> Ingredient:
    if not n_tips:
        return Ingredient("Heaviside functions", False, "no cracks")
    return Ingredient("Heaviside functions", True, f"{len(n_tips)} crack(s) cut through cells")


def _tips(problem: Problem, n_tips: list[int]) -> Ingredient:
    if not n_tips:
        return Ingredient("tip functions", False, "no cracks")
    texts = [
        f"crack {c}: {front}"
        for c, (_, short_fronts) in enumerate(problem.placements)
        for front in short_fronts
    ]
    absence = "; ".join(texts)
    if not sum(n_tips):
        return Ingredient(
            "tip functions", False, absence or "every crack cuts through: there is no tip"
        )
    what_each = f"{problem.numerics.functions} functions"
    if problem.numerics.tip_basis is not None:
        what_each = problem.numerics.tip_basis.label(problem.mesh.dim)
    reach = (
        "within a fixed radius" if problem.numerics.enrichment == "geometric" else "tip cells only"
    )
    reason = f"{sum(n_tips)} {GEOMETRY[problem.mesh.dim].end}(s), {what_each}, {reach}"
    return Ingredient("tip functions", True, reason + (f"; left out: {absence}" if absence else ""))


# Barycentric coordinates of points that are even on a triangle.
_ON_FACE = np.array([(i, j, 8 - i - j) for i in range(9) for j in range(9 - i)]) / 8


def _order(problem: Problem) -> list[Ingredient]:
    """What order 1 does to K in 3D; nothing elsewhere."""
    depth_in_cells = {}
    if problem.mesh.dim == 3 and problem.order == 1:
        body = Body.of(problem.mesh)
        for c, crack in enumerate(problem.placed):
            x = (_ON_FACE @ crack.points[crack.faces]).reshape(-1, 3)
            x = x[body.contains(x)]
            if crack.fronts and len(x):
                front = crack.points[np.concatenate(crack.fronts)]
                depth_in_cells[c] = cells_deep(x, front, problem.mesh)
    if not depth_in_cells:
        return []
    depths = ", ".join(f"crack {c}: {value:.2g} cells deep" for c, value in depth_in_cells.items())
    reasons = [depths]
    for is_arm in sorted({bool(problem.placed[c].ends_on) for c in depth_in_cells}):
        error, rest = errors_by_order(is_arm)
        of_arms = " of arms" * is_arm
        reasons.append(f"K{of_arms} is {error} below {DEEP:g} cells, order=2 within {rest}")
    return [Ingredient("order 1", True, "; ".join(reasons))]


def errors_by_order(is_arm: bool) -> tuple[str, str]:
    """What K of a front in 3D is off by: at order 1, where the crack is not deep; at order 2."""
    return ("up to 5 % off", "3 %") if is_arm else ("1 to 7 % too low", "0.5 %")


def _friction(problem: Problem) -> list[Ingredient]:
    """Nothing where no crack has friction."""
    coefficients = sorted(set(problem.frictions) - {0.0})
    if not coefficients:
        return []
    if problem.contact == "off":
        reason = "contact is switched off: crack faces that do not press do not rub"
        return [Ingredient("friction", False, reason)]
    values = ", ".join(f"{mu:g}" for mu in coefficients)
    reason = f"Coulomb, mu = {values}, where crack faces press; load states in their order"
    return [Ingredient("friction", True, reason)]


def _multipliers(problem: Problem) -> list[Ingredient]:
    reasons = {
        "off": (False, "contact is switched off: the crack faces may overlap"),
        "on": (True, "contact is switched on"),
        "auto": (False, "none until the crack faces of the open solution overlap"),
    }
    is_used, reason = reasons[problem.contact]
    if is_used and problem.numerics.contact_method is not None:
        reason += f"; by {problem.numerics.contact_method.label}"
    return [
        Ingredient(f"multipliers of crack {c}", is_used, reason) for c in range(len(problem.cracks))
    ]


__all__ = ["Forecast", "check_memory", "errors_by_order", "forecast_of"]
