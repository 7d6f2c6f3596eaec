"""Scene economy: what a scene needs, decided before anything is solved."""

from dataclasses import dataclass

from xcrack.analysis.forecast import Forecast, forecast_of
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.base.markup import element
from xcrack.crack.placing import short_fronts
from xcrack.model.problem import Problem, check_problem

_ENDS = {2: "tip(s)", 3: "front(s)"}


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

    def __str__(self) -> str:
        force = ", ".join(f"{f:.6g}" for f in self.force)
        parts = (self.moment,) if isinstance(self.moment, float) else self.moment
        moment = ", ".join(f"{m:.6g}" for m in parts)
        return f"{self.name:<33} force ({force}), moment about the origin ({moment})"


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


def plan(problem: Problem) -> Report:
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
    check_problem(problem, "plan")
    return Report(ingredients_of(problem), {}, size_forecast=forecast_of(problem))


def ingredients_of(problem: Problem) -> tuple[Ingredient, ...]:
    """What a scene needs, line by line."""
    n_tips = [crack.n_tips for crack in problem.placed]
    rows = [_heaviside(n_tips), _tips(problem, n_tips)]
    rows.extend(_multipliers(problem))
    rows.extend(_friction(problem))
    rows.append(_third_mode(problem, n_tips))
    why = "the body is supported" if problem.supports else "none given; rigid motion is removed"
    rows.append(Ingredient("supports", bool(problem.supports), why))
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
    short = [
        f"crack {c}: {front}"
        for c, crack in enumerate(problem.cracks)
        for front in short_fronts(crack, problem.mesh)
    ]
    lost = "; ".join(short)
    if not sum(n_tips):
        return Ingredient(
            "tip functions", False, lost or "every crack cuts through: there is no tip"
        )
    what_each = f"{problem.numerics.functions} functions"
    if problem.numerics.tip_basis is not None:
        what_each = problem.numerics.tip_basis.label(problem.mesh.dim)
    reach = (
        "within a fixed radius" if problem.numerics.enrichment == "geometric" else "tip cells only"
    )
    reason = f"{sum(n_tips)} {_ENDS[problem.mesh.dim]}, {what_each}, {reach}"
    return Ingredient("tip functions", True, reason + (f"; left out: {lost}" if lost else ""))


def _friction(problem: Problem) -> list[Ingredient]:
    """Nothing where no crack has friction."""
    coefficients = sorted(set(problem.frictions) - {0.0})
    if not coefficients:
        return []
    if problem.contact == "off":
        why = "contact is switched off: crack faces that do not press do not rub"
        return [Ingredient("friction", False, why)]
    values = ", ".join(f"{mu:g}" for mu in coefficients)
    why = f"Coulomb, mu = {values}, where crack faces press; load states in their order"
    return [Ingredient("friction", True, why)]


def _multipliers(problem: Problem) -> list[Ingredient]:
    reasons = {
        "off": (False, "contact is switched off: the crack faces may overlap"),
        "on": (True, "contact is switched on"),
        "auto": (False, "none until the crack faces of the open solution overlap"),
    }
    used, reason = reasons[problem.contact]
    if used and problem.numerics.contact_method is not None:
        reason += f"; by {problem.numerics.contact_method.label}"
    return [
        Ingredient(f"multipliers of crack {c}", used, reason) for c in range(len(problem.cracks))
    ]
