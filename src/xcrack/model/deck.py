"""Decks of Abaqus and CalculiX as problems: materials, supports and loads of a step.

Every keyword gets a row in a table: what it was used for, or why it is ignored. What would make
another body or another loading of it (ties, contact between parts, constraints) is refused, unless
a user leaves it out knowingly.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import FileName, Number, Parts, check_arguments
from xcrack.base.arrays import Floats, Ints, frozen_copy, lock
from xcrack.base.errors import ProblemError, warn
from xcrack.base.paths import system_errors
from xcrack.crack.crack import Crack
from xcrack.mesh.abaqus import MESH_KEYWORDS, OUTPUT_KEYWORDS, read_model, use_of
from xcrack.mesh.files import (
    existing_file,
    raw_mesh_of,
    sets_without_facets,
    with_stored_curves,
)
from xcrack.mesh.fitted_curves import Fit, with_fitted_curves
from xcrack.mesh.keywords import KeywordUse, missed_words, table_of
from xcrack.mesh.linear import linear_mesh
from xcrack.mesh.mesh import Mesh
from xcrack.mesh.raw import mesh_parts, with_curved_edges
from xcrack.model.deck_body import DeckBody
from xcrack.model.deck_state import Coupling, DeckState, SpreadLoad, chosen_step, steps_of
from xcrack.model.loads import (
    Load,
    Support,
    body_force,
    displacement,
    fix,
    initial_stress,
    point_force,
    pressure,
    resultant,
    temperature,
    traction,
)
from xcrack.model.material import Material
from xcrack.model.problem import Problem

_MATERIAL = {
    "MATERIAL": "materials",
    "ELASTIC": "E and nu",
    "EXPANSION": "thermal expansion",
    "DENSITY": "mass, for gravity and rotation",
    "PLASTIC": "its first stress is the yield stress, to judge plastic zones by; nothing yields",
    "SOLID SECTION": "which elements are of which material",
}
_SCENE = {
    "BOUNDARY": "supports",
    "CLOAD": "forces at points",
    "DLOAD": "pressures, gravity and rotation",
    "DSLOAD": "pressures and tractions on surfaces",
    "TEMPERATURE": "temperatures of the step",
    "AMPLITUDE": "its value at the end of the step, or at the time asked for",
    "STEP": "the load steps",
    "END STEP": "the load steps",
    "STATIC": "the step is in static equilibrium",
}
_COUPLING = {
    "COUPLING": "forces on its reference node are spread over its surface",
    "DISTRIBUTING": "forces on its reference node are spread over its surface",
    "KINEMATIC": "its reference node holds the surface",
}
# What is ignored, and why the solution stays that of the deck.
_HARMLESS = {
    **OUTPUT_KEYWORDS,
    **dict.fromkeys(
        ("CONDUCTIVITY", "SPECIFIC HEAT", "LATENT HEAT", "DAMPING", "PHYSICAL CONSTANTS",
         "HEAT GENERATION", "DEPVAR"),
        "statics of an elastic body does not ask for it",
    ),
    **dict.fromkeys(
        ("CONTROLS", "SOLVER CONTROLS", "TIME POINTS", "SOLUTION TECHNIQUE"),
        "it says how another program solves",
    ),
    **dict.fromkeys(
        ("SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION", "SECTION CONTROLS",
         "HOURGLASS STIFFNESS", "ORIENTATION", "DISTRIBUTION", "DISTRIBUTION TABLE"),
        "nothing that is used here refers to it",
    ),
}  # fmt: skip
# What is ignored, and what is missing without it.
_MISSED = {
    **dict.fromkeys(("CREEP", "VISCOELASTIC", "DAMAGE INITIATION", "DAMAGE EVOLUTION",
                     "CYCLIC HARDENING", "RATE DEPENDENT"),
                    "the body is linear elastic"),
}  # fmt: skip
# What makes another problem of it: refused unless it is left out knowingly.
_REFUSED = {
    "TIE": "bonded parts are not modelled: mesh them as one body, with common nodes",
    "EQUATION": "constraints between nodes are not modelled",
    "MPC": "constraints between nodes are not modelled",
    "KINEMATIC COUPLING": "write it as *COUPLING with *KINEMATIC",
    "DISTRIBUTING COUPLING": "write it as *COUPLING with *DISTRIBUTING",
    "RIGID BODY": "rigid parts are not modelled: support or load the surface that they touch",
    "EMBEDDED ELEMENT": "embedded elements are not modelled",
    "SHELL TO SOLID COUPLING": "shells are not modelled",
    "TRANSFORM": "directions of nodes are those of the global axes: give supports and forces there",
    "SUBMODEL": "boundary values of another run are not read: give them as *BOUNDARY",
    "MODEL CHANGE": "elements cannot come and go",
    "CYCLIC SYMMETRY MODEL": "cyclic symmetry is not modelled",
    "PRE-TENSION SECTION": "pre-tension is not modelled: give the force of the bolt on its seat",
    "INERTIA RELIEF": "leave the supports out instead: loads that balance need none",
    "HYPERELASTIC": "the body is linear elastic: give *ELASTIC",
    "FOUNDATION": "elastic foundations are not modelled",
    **dict.fromkeys(("SHELL SECTION", "SHELL GENERAL SECTION", "BEAM SECTION",
                     "BEAM GENERAL SECTION", "MEMBRANE SECTION", "CONNECTOR SECTION", "SPRING",
                     "DASHPOT", "GAP", "COHESIVE SECTION"),
                    "the body is of solid or plane elements only"),
    **dict.fromkeys(("CONTACT", "CONTACT PAIR", "CONTACT INCLUSIONS", "CONTACT PROPERTY ASSIGNMENT",
                     "CLEARANCE"),
                    "contact between parts is not modelled (of crack faces it is): load the "
                    "surface by the pressure or by `bearing`"),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Deck:
    """What a deck says, as values to make a problem of; printed, it lists every keyword.

    Attributes
    ----------
    path : Path
    mesh : Mesh
    material : Material or None
        None where the deck has none. Several are a dict by name, which is also the name of a cell
        set.
    supports : tuple of fix(...) and displacement(...)
    loads : tuple of loads
        At the end of the step, or at the time asked for.
    step : str
        Name of the step, empty where there is none.
    steps : tuple of str
    amplitudes : mapping of name to (n, 2) array
        Times and values.
    points : mapping of name to (k, d) array, length
        Node sets that hold no facet of the boundary: `fix` takes the points.
    thickness : float, length
        Of a 2D body: its forces are divided by it.
    keywords : tuple of KeywordUse
        What became of each keyword.
    """

    path: Path
    mesh: Mesh
    material: Material | Mapping[str, Material] | None = None
    supports: tuple[Support, ...] = ()
    loads: tuple[Load, ...] = ()
    step: str = ""
    steps: tuple[str, ...] = ()
    amplitudes: Mapping[str, Floats] = field(default_factory=dict)
    points: Mapping[str, Floats] = field(default_factory=dict)
    thickness: float = 1.0
    keywords: tuple[KeywordUse, ...] = ()

    @property
    def ignored(self) -> tuple[KeywordUse, ...]:
        """Keywords that are not used, each with the reason."""
        return tuple(use for use in self.keywords if not use.is_used)

    def problem(self, cracks: Sequence[Crack] = (), **choices: Any) -> Problem:
        """The problem of the deck with cracks in it.

        Parameters
        ----------
        cracks : sequence of Crack
        **choices
            Other arguments of `Problem`; `material`, `supports` and `loads` take the place of those
            of the deck.

        Raises
        ------
        ProblemError, GeometryError
            The deck has no material and none is given; as of `Problem`.
        """
        arguments: dict[str, Any] = {"supports": self.supports, "loads": self.loads, **choices}
        if "material" not in arguments:
            if self.material is None:
                raise ProblemError(
                    f"{self.path.name} has no material: give problem(material=Isotropic(...))."
                )
            arguments["material"] = self.material
        return Problem(self.mesh, cracks=cracks, **arguments)

    def __str__(self) -> str:
        names = ", ".join(support.name for support in self.supports) or "none"
        loads = ", ".join(load.name for load in self.loads) or "none"
        step = f"{self.step!r} of {len(self.steps)}" if self.steps else "none"
        rows = [
            ("deck", str(self.path)),
            ("body", repr(self.mesh)),
            ("material", "none" if self.material is None else repr(self.material)),
            ("step", step),
            ("supports", names),
            ("loads", loads),
        ]
        head = "\n".join(f"{name:<10}{text}" for name, text in rows)
        return f"{head}\n\n{table_of(self.keywords)}"

    def __repr__(self) -> str:
        return (
            f"Deck({self.path.name}: {self.mesh!r}, {len(self.supports)} supports, "
            f"{len(self.loads)} loads, {len(self.ignored)} keywords ignored)"
        )


@check_arguments()
def read_deck(
    path: FileName,
    step: int | str | None = None,
    *,
    time: Annotated[float, Number(least=0)] | None = None,
    ignore: Annotated[Sequence[str], Parts(str, 'keywords such as "TIE"')] = (),
    fit_curves: Fit = False,
) -> Deck:
    """Read a deck of another program: body, materials, supports and the loads of a step.

    Of Abaqus and CalculiX (``.inp``) all that linear statics of a solid body has is taken; of Ansys
    (``.cdb``) and Nastran (``.bdf``) the mesh and its sets. `print(deck)` lists every keyword with
    what it was used for, or why it is ignored.

    Parameters
    ----------
    path : path
        The deck; files that it includes are looked for beside it.
    step : int or str, optional
        Number, from 1, or name of the step whose loads are taken, with what earlier steps have left
        behind; the last one if left out.
    time : float, optional
        Time within the step at which amplitudes are taken; the end of the step if left out.
    ignore : sequence of str
        Keywords such as ``"TIE"`` that are refused otherwise, since without them the body or its
        loading is another one.
    fit_curves : bool, str or sequence of str
        Give straight cells the curves through their points, as `fit_curves` does.

    Returns
    -------
    Deck

    Raises
    ------
    MeshError
        As of `read_mesh`; with file and line.
    ProblemError
        A step that the deck does not have or that is no static one, a material that is not
        isotropic, a load or constraint that cannot be taken; with file, line and what to do.

    Examples
    --------
    From a deck to K::

        deck = xc.read_deck("lug.inp")
        problem = deck.problem(cracks=[xc.penny_crack((0, 12, 0), (1, 0, 0), 2.0)])
        print(xc.stress_intensity(xc.solve(problem)))
    """
    path = existing_file(path, "deck")
    left_out = {" ".join(name.upper().lstrip("*").split()) for name in ignore}
    with system_errors("cannot read the deck", path):
        if path.suffix.lower() != ".inp":
            return _mesh_deck(path, fit_curves)
        model = read_model(path)
    steps = steps_of(model)
    step_of_loads = chosen_step(steps, step, path.name)
    state = DeckState(model, steps, step_of_loads, time, left_out)
    _refuse_others(state, left_out)
    loads = list(state.spread.values())
    parts = {f"stress {n}": elements for n, (elements, _) in enumerate(state.stresses)}
    for n, load in enumerate(loads):
        if load.faces[0].min(initial=0) < 0:
            parts[f"load {n}"] = np.concatenate(load.elements)
    body = DeckBody(model, [s for n, s in enumerate(loads) if f"load {n}" not in parts], parts)
    scene = _Scene(body, state)
    material = body.material(state.temperature, state.initial_temperature)
    supports, deck_loads = scene.supports(), scene.loads()
    uses = _uses(state, left_out)
    _tell_missed(path, uses)
    return Deck(
        path=path,
        mesh=with_fitted_curves(body.finished_mesh(scene.more_facets), fit_curves, path.name),
        material=material,
        supports=tuple(supports),
        loads=tuple(deck_loads),
        step="" if step_of_loads is None else step_of_loads.name,
        steps=tuple(deck_step.name for deck_step in steps),
        amplitudes=MappingProxyType({
            amplitude.keyword.option("NAME"): frozen_copy(amplitude.table)
            for amplitude in state.amplitudes.values() if len(amplitude.table)
        }),
        points=MappingProxyType({
            name: lock(body.places[body.nodes(rows[body.is_inside(rows)])])
            for name, rows in body.raw_mesh.point_sets
            if name not in body.mesh.facet_sets and not name.startswith("_")
            and body.is_inside(rows).any()
        }),
        thickness=body.thickness,
        keywords=tuple(uses),
    )  # fmt: skip


def _mesh_deck(path: Path, fit_curves: bool | str | Sequence[str]) -> Deck:
    """A deck of which mesh and sets alone are taken."""
    raw_mesh, uses = raw_mesh_of(path)
    raw_mesh = linear_mesh(raw_mesh, path.name, strict=False)
    points, cells, facet_sets, cell_sets, number = mesh_parts(raw_mesh, path.name)
    mesh = with_curved_edges(Mesh(points, cells, facet_sets, cell_sets), raw_mesh, number)
    mesh = with_fitted_curves(with_stored_curves(mesh, path), fit_curves, path.name)
    _tell_missed(path, uses, sets_without_facets(raw_mesh, mesh))
    return Deck(path, mesh, keywords=tuple(uses))


def _tell_missed(path: Path, uses: Iterable[KeywordUse], message: str = "") -> None:
    names = missed_words(uses)
    parts = [f"ignored: {', '.join(names)}; print(deck) says why"] if names else []
    if message:
        parts.append(message)
    if parts:
        warn(f"{path.name}: {'; '.join(parts)}.")


def _refuse_others(state: DeckState, left_out: set[str]) -> None:
    """Raise for what makes another problem of it and is not left out knowingly."""
    for line in filter(state.counts, state.model.lines):
        name = line.keyword.name
        is_contact = name.startswith("CONTACT ") and name not in OUTPUT_KEYWORDS
        if name not in left_out and (name in _REFUSED or is_contact):
            reason = _REFUSED.get(name, _REFUSED["CONTACT"])
            line.keyword.refuse(
                f'{reason}. To leave it out knowingly: read_deck(..., ignore=["{name}"]).',
                error=ProblemError,
            )
    for group in state.model.groups:
        is_link = group.type.startswith(("SPRING", "DASHPOT", "CONN", "GAP", "COH"))
        if is_link and "ELEMENT" not in left_out:
            raise ProblemError(
                f"{group.place}: *ELEMENT, TYPE={group.type}: springs and connectors are not "
                'modelled. To leave them out knowingly: read_deck(..., ignore=["ELEMENT"]).'
            )


class _Scene:
    """Supports and loads of a deck."""

    def __init__(self, body: DeckBody, state: DeckState) -> None:
        self.body, self.state = body, state
        self.more_facets: dict[str, Ints] = {}  # of supports

    # --- supports

    def supports(self) -> list[Support]:
        """On facet sets where nodes are whole facets, on points where they are not."""
        result: list[Support] = []
        for n, restraint in enumerate(self.state.restraints):
            all_rows = np.unique(np.concatenate(restraint.rows))
            equal_supports: dict[tuple[bytes, bytes], tuple[Ints, Floats, list[int]]] = {}
            for axis in restraint.axes:
                rows = all_rows[self.state.owner[axis, all_rows] == n]
                self._check_reference(rows[~self.body.is_inside(rows)], restraint.place)
                rows = rows[self.body.is_inside(rows)]
                values = self.state.value[axis, rows]
                if len(rows) and axis < self.body.dim:
                    key = rows.tobytes(), values.tobytes()
                    equal_supports.setdefault(key, (rows, values, []))[2].append(axis)
            for rows, values, axes in equal_supports.values():
                result += self._supports_of(rows, values, axes, restraint.name)
        return result + self._coupled_supports()

    def _supports_of(self, rows: Ints, values: Floats, axes: list[int], name: str) -> list[Support]:
        body = self.body
        numbers = body.nodes(rows)
        result: list[Support] = []
        for place in self._set_and_points(numbers, name):
            if not values.any():
                result += (
                    [fix(place, axis) for axis in axes] if len(axes) < body.dim else [fix(place)]
                )
                continue
            value: Any = float(values[0])
            if (values != values[0]).any():
                value = body.node_field(numbers, values, "displacement")
            vector: Any = tuple(value if axis in axes else None for axis in range(body.dim))
            result.append(displacement(place, vector))
        return result

    def _set_and_points(self, numbers: Ints, name: str) -> list[Any]:
        """Facet set and points that nodes are."""
        body, mesh = self.body, self.body.mesh
        facets = body.facets_within(numbers)
        is_remaining = np.zeros(len(body.places), dtype=bool)
        is_remaining[numbers] = True
        # Between two held nodes of linear elements the edge is held.
        is_remaining[mesh.n_points :] |= (
            is_remaining[mesh.edges].all(axis=1) & body.is_bare[mesh.n_points :]
        )
        result: list[Any] = []
        if len(facets):
            is_remaining[facets] = False
            is_remaining[body.edges_of(facets)] = False
            all_sets = {**mesh.facet_sets, **self.more_facets}
            first = sorted(all_sets.items(), key=lambda item: item[0].casefold() != name.casefold())
            set_name = body.name_of_facets(facets, first)
            if not set_name:
                set_name = (
                    name if name and name not in all_sets else f"support {name or len(all_sets)}"
                )
                self.more_facets[set_name] = facets
            result.append(set_name)
        if is_remaining.any():
            result.append(body.places[is_remaining])
        return result

    def _check_reference(self, rows: Ints, place: str) -> None:
        for node in rows.tolist():
            coupling = self.state.couplings.get(node)
            if coupling is not None and not coupling.is_rigid:
                raise ProblemError(
                    f"{place}: *BOUNDARY: the reference node of a distributing coupling "
                    f"({coupling.line.keyword.place}) is held, which leaves its surface free to "
                    "deform: couple it by *KINEMATIC, or support the surface."
                )

    def _coupled_supports(self) -> list[Support]:
        result: list[Support] = []
        for node, coupling in self.state.couplings.items():
            is_fixed = self.state.owner[:, node] >= 0
            if not coupling.is_rigid or not is_fixed.any():
                continue
            if not is_fixed.all() or self.state.value[is_fixed, node].any():
                coupling.line.keyword.refuse(
                    "a surface that follows its reference node is known only where that node is "
                    "held in all directions and turns (ENCASTRE): support the surface itself.",
                    error=ProblemError,
                )
            result.append(fix(self._surface(coupling)))
        return result

    def _surface(self, coupling: Coupling) -> str:
        """Name of the facet set of a coupling."""
        for name in self.body.mesh.facet_sets:
            if name.casefold() == coupling.surface.casefold():
                return name
        coupling.line.keyword.refuse(
            f"the surface {coupling.surface!r} holds no face of the body: give one of element "
            "faces.", error=ProblemError
        )  # fmt: skip

    # --- loads

    def loads(self) -> list[Load]:
        """Forces, pressures, forces per volume, temperature and initial stress."""
        result = self._forces()
        for n, load in enumerate(self.state.spread.values()):
            result += self._spread_load(load, n)
        if (change := self._temperature()) is not None:
            result.append(change)
        if self.state.stresses:
            dim = self.body.dim
            total = np.zeros((len(self.body.mesh.cells), dim, dim))
            for n, (_, stress) in enumerate(self.state.stresses):
                total[self.body.cells(f"stress {n}")] = stress[:dim, :dim]
            if total.any():
                result.append(initial_stress(self.body.cell_field(total, "initial stress")))
        return result

    def _forces(self) -> list[Load]:
        body, force = self.body, self.state.force
        rows = np.nonzero(force.any(axis=1))[0]
        is_inside = body.is_inside(rows)
        result = [self._coupled_force(node) for node in rows[~is_inside].tolist()]
        rows = rows[is_inside]
        rows_with_moment = rows[force[rows, 3:].any(axis=1)]
        if len(rows_with_moment):
            keyword, line = self.state.force_line[int(rows_with_moment[0])]
            keyword.refuse(
                "nodes of solid elements take no moments: couple the surface by *COUPLING and "
                "*DISTRIBUTING.", line, ProblemError
            )  # fmt: skip
        rows = rows[force[rows, : body.dim].any(axis=1)]
        if len(rows):
            places = body.places[body.nodes(rows)]
            result.append(point_force(places, force[rows, : body.dim] / body.thickness))
        return result

    def _coupled_force(self, node: int) -> Load:
        body, coupling = self.body, self.state.couplings.get(node)
        keyword, line = self.state.force_line[node]
        if coupling is None or coupling.is_rigid:
            words = "it is no node of the body" if coupling is None else (
                "a surface that moves as a rigid one cannot be loaded"
            )  # fmt: skip
            keyword.refuse(
                f"{words}: couple it to a surface by *COUPLING and *DISTRIBUTING.", line,
                ProblemError,
            )  # fmt: skip
        force_and_moment = self.state.force[node] / body.thickness
        moment: Any = force_and_moment[3:] if body.dim == 3 else float(force_and_moment[5])
        return resultant(
            self._surface(coupling), force_and_moment[: body.dim],
            moment if np.any(moment) else None, about=body.model.points[node, : body.dim],
        )  # fmt: skip

    def _spread_load(self, load: SpreadLoad, n: int) -> list[Load]:
        body, value, numbers = self.body, load.values[0], load.numbers
        if not any(load.values):
            return []
        if load.faces[0].min(initial=0) < 0:
            force = self._volume_force(load, body.cells(f"load {n}"))
            return [] if force is None else [body_force(force)]
        name = body.facet_name(load)
        facets = body.mesh.facet_sets.get(name, np.zeros((0, body.dim), np.int64))
        owners = body.mesh.facet_to_cell[body.mesh.facet_numbers(facets)]
        if not len(facets) or (owners[:, 1] >= 0).any():
            load.refuse(
                f"{load.label} acts on {'faces inside the body' if len(facets) else 'no face'}: "
                "give faces of its boundary."
            )
        if load.label == "P" and len(set(load.values)) > 1:  # face by face
            pressures = np.zeros(len(body.mesh.cells))
            for elements, faces, p in zip(load.elements, load.faces, load.values, strict=True):
                for kind, rows in body.model.facets_of(elements, faces):
                    pressures[body.cells_beside(kind, rows)] = p
            return [pressure(name, body.cell_field(pressures, "pressure"))]
        if load.label == "P":
            return [pressure(name, value)]
        if load.label == "HP" and len(numbers) > 1 and numbers[0] != numbers[1]:
            return [pressure(name, _Hydrostatic(value, *numbers[:2]))]
        direction = np.array(numbers[: body.dim])
        if load.label == "TRVEC" and len(direction) == body.dim and direction.any():
            return [traction(name, value * direction / np.linalg.norm(direction))]
        load.refuse(f"there is no load {load.label}: give P, HP or TRVEC on faces.")
        return []

    def _volume_force(self, load: SpreadLoad, members: Ints) -> Any:
        """Force per volume as a vector, or a function of the place."""
        body, numbers, value = self.body, (*load.numbers, 0.0, 0.0, 0.0), load.values[0]
        factor = np.ones(len(members))
        if load.label in ("BX", "BY", "BZ"):
            vector = value * np.eye(3)["XYZ".index(load.label[1])]
        elif load.label in ("GRAV", "CENTRIF", "CENT") and len(load.numbers) >= body.dim:
            factor = body.density[members]
            vector = np.array(numbers[:3])
            vector = value * vector / (np.linalg.norm(vector) or 1.0)
        else:
            load.refuse(
                f"there is no load {load.label}: give GRAV, CENTRIF, BX, BY or BZ on elements, P, "
                "HP or TRVEC on faces."
            )
        if np.isnan(factor).any():
            load.refuse(f"{load.label} needs the *DENSITY of each material.")
        if load.label.startswith("CENT"):
            density = np.zeros(len(body.mesh.cells))
            density[members] = factor
            axis = np.array(load.numbers[3:6])
            if len(axis) < 3 or not axis.any():
                load.refuse("give omega², a point of the axis and its direction.")
            axis = axis / np.linalg.norm(axis)
            return _Rotation(
                body.cell_field(density, "density"), value, load.numbers[:3], tuple(axis.tolist())
            )
        values = np.zeros((len(body.mesh.cells), body.dim))
        values[members] = factor[:, None] * vector[: body.dim]
        return body.cell_field(values, load.label)

    def _temperature(self) -> Load | None:
        """The thermal strain as that of one coefficient of expansion."""
        state, body = self.state, self.body
        if np.array_equal(state.temperature, state.initial_temperature):
            return None
        strain = np.full(len(body.model.points), np.nan)
        alpha = 0.0
        expanding_sections = [key for key in body.sections if len(body.materials[key].expansion)]
        if expanding_sections and len(body.sections) > 1:  # each material has its own
            change = state.temperature - state.initial_temperature
            return temperature(body.point_field(change, "temperature"))
        for key in expanding_sections:
            material = body.materials[key]
            alpha = float(material.expansion[0, 0])
            rows = body.nodes_of_material(key)
            strain[rows] = material.strain(state.temperature[rows], state.initial_temperature[rows])
        if not alpha:
            warn(
                f"{body.model.path.name}: the temperature changes, but no material has an "
                "*EXPANSION: it has no effect."
            )
            return None
        return temperature(body.point_field(strain / alpha, "temperature"), alpha)


@dataclass(frozen=True)
class _Hydrostatic:
    """Pressure that falls from p at the height `deepest` to zero at the height `surface`."""

    p: float
    surface: float
    floor: float

    def __call__(self, x: Floats) -> Floats:
        share = (self.surface - x[:, -1]) / (self.surface - self.floor)
        return self.p * np.maximum(share, 0.0)


@dataclass(frozen=True)
class _Rotation:
    """Centrifugal force per volume: density times omega² times the distance from an axis."""

    density: Any
    square: float
    point: tuple[float, ...]
    axis: tuple[float, ...]

    def __call__(self, x: Floats) -> Floats:
        r = np.zeros((len(x), 3))
        r[:, : x.shape[1]] = x
        r -= self.point
        r -= (r @ self.axis)[:, None] * np.array(self.axis)
        density = self.density(x) if callable(self.density) else self.density
        return np.asarray((self.square * np.reshape(density, (-1, 1)) * r)[:, : x.shape[1]])


def _uses(state: DeckState, left_out: set[str]) -> list[KeywordUse]:
    """A row for each keyword: what it was used for, or why it is ignored."""
    model = state.model
    uses = model.mesh_uses()
    known_keywords = {**_MATERIAL, **_SCENE, **_COUPLING}
    for name in dict.fromkeys(line.keyword.name for line in model.lines):
        lines = model.lines_of(name)
        current_lines = [line for line in lines if state.counts(line)]
        is_frame = name in ("STEP", "END STEP", "STATIC")
        other_lines = [] if is_frame else [line for line in lines if not state.counts(line)]
        if name in MESH_KEYWORDS:
            continue
        if name in left_out:
            uses.append(use_of(lines, False, "it was left out by ignore="))
        elif name == "INITIAL CONDITIONS":
            for line in lines:
                kind = line.keyword.options.get("TYPE", "").upper()
                is_used = kind in ("TEMPERATURE", "STRESS")
                reason = "the state without load" if is_used else "statics does not ask for it"
                place = line.keyword.place
                uses.append(KeywordUse(f"*{name}, TYPE={kind}", 1, place, is_used, reason))
        elif name in known_keywords or name in _REFUSED or name.startswith("CONTACT "):
            if current_lines or is_frame:
                uses.append(
                    use_of(lines if is_frame else current_lines, True, known_keywords.get(name, ""))
                )
            if other_lines:
                place = other_lines[0].keyword.place
                reason = "it is of another step"
                uses.append(KeywordUse(f"*{name}", len(other_lines), place, False, reason, True))
        elif name in _HARMLESS or name.endswith(" OUTPUT"):
            reason = _HARMLESS.get(name, "what another program writes")
            place = lines[0].keyword.place
            uses.append(KeywordUse(f"*{name}", len(lines), place, False, reason, True))
        else:
            steps = [step.procedure for step in state.steps if not step.is_static]
            is_step = lines[0].keyword in steps
            reason = (
                "it is of another step" if is_step else _MISSED.get(name, "it is not known here")
            )
            uses.append(use_of(lines, False, reason))
    nonlinear_keywords = [
        line.keyword.place
        for line in model.lines_of("STEP")
        if line.keyword.options.get("NLGEOM", "NO").upper() != "NO"
    ]
    if nonlinear_keywords:
        reason = "displacements are taken to be small"
        uses.append(
            KeywordUse(
                "*STEP, NLGEOM", len(nonlinear_keywords), nonlinear_keywords[0], False, reason, True
            )
        )
    return uses


__all__ = ["Deck", "read_deck"]
