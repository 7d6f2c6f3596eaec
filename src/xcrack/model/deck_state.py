"""State of a deck at the end of one of its steps: what is held, loaded and heated, node by node."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from xcrack.base.arrays import Floats, Ints
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.mesh.abaqus import AbaqusModel, DeckLine
from xcrack.mesh.keywords import Keyword

_OTHER_PROCEDURES = (
    "FREQUENCY", "BUCKLE", "DYNAMIC", "MODAL DYNAMIC", "HEAT TRANSFER", "VISCO", "GREEN",
    "STEADY STATE DYNAMICS", "COUPLED TEMPERATURE-DISPLACEMENT", "GEOSTATIC", "SOILS", "CFD",
    "UNCOUPLED TEMPERATURE-DISPLACEMENT", "RANDOM RESPONSE", "SENSITIVITY", "COMPLEX FREQUENCY",
    "ELECTROMAGNETICS", "COUPLED THERMAL-ELECTRICAL", "RESPONSE SPECTRUM",
)  # fmt: skip
_HELD = {"ENCASTRE": range(6), "PINNED": range(3), "XSYMM": (0, 4, 5), "YSYMM": (1, 3, 5),
         "ZSYMM": (2, 3, 4), "XASYMM": (1, 2, 3), "YASYMM": (0, 2, 4),
         "ZASYMM": (0, 1, 5)}  # fmt: skip
_UNREAD = {  # options of a load or support whose values stand elsewhere
    "SUBMODEL": "values of another run are not read",
    "USER": "values of a user's subroutine are not read",
    "FILE": "values of a results file are not read",
    "FIXED": "the values that an earlier step has led to are not known",
    "LOAD CASE": "load cases are not read",
    "CYCLIC MODE": "cyclic symmetry is not modelled",
    "SECTOR": "cyclic symmetry is not modelled",
    "GEOSTATIC": "stresses that vary with the depth are not read",
    "SECTION POINTS": "stresses of section points are not read",
    "BSTEP": "values of a results file are not read",
}


@dataclass(frozen=True, eq=False)
class DeckStep:
    """A step of a deck.

    Attributes
    ----------
    number : int
        From 1.
    name : str
    is_static, is_perturbation : bool
    procedure : Keyword or None
    begin, period : float, time
    """

    number: int
    name: str
    is_static: bool
    is_perturbation: bool
    procedure: Keyword | None
    begin: float
    period: float


def steps_of(model: AbaqusModel) -> tuple[DeckStep, ...]:
    """The steps of a deck."""
    steps: list[DeckStep] = []
    total = 0.0
    for line in model.lines_of("STEP"):
        n = len(steps) + 1
        names = ("STATIC", *_OTHER_PROCEDURES)
        keywords = (deck_line.keyword for deck_line in model.lines if deck_line.step == n)
        procedure = next((keyword for keyword in keywords if keyword.name in names), None)
        is_static = procedure is None or procedure.name == "STATIC"
        period = 1.0
        for number, row in procedure.rows if procedure is not None and is_static else ():
            if procedure is not None and len(row) > 1 and row[1]:
                period = procedure.number(row[1], number, "the period of the step")
            break
        options = line.keyword.options
        name = options.get("NAME", "") or f"Step-{n}"
        is_perturbation = "PERTURBATION" in options
        steps.append(DeckStep(n, name, is_static, is_perturbation, procedure, total, period))
        total += period
    return tuple(steps)


def chosen_step(steps: Sequence[DeckStep], step: object, source: str) -> DeckStep | None:
    """A step by number or name, the last one where None is given.

    Raises
    ------
    ProblemError
        There is no such step, or it is no static one.
    """
    choice = steps[-1] if steps and step is None else None
    for s in steps:
        is_number = isinstance(step, int) and not isinstance(step, bool) and step == s.number
        if is_number or (isinstance(step, str) and step.casefold() == s.name.casefold()):
            choice = s
    if choice is None and step is not None:
        names = ", ".join(f"{s.number} ({s.name})" for s in steps)
        remedy = f"give the number or name of one of {names}" if steps else "leave it out"
        raise ProblemError(
            f"read_deck: step = {value_text(step)}: {source} has no such step: {remedy}."
        )
    if choice is not None and choice.procedure is not None and not choice.is_static:
        choice.procedure.refuse(
            f"step {choice.name!r} is no static one: choose another by step=.", error=ProblemError
        )
    return choice


@dataclass(frozen=True, eq=False)
class Amplitude:
    """Values over time.

    Attributes
    ----------
    table : (n, 2) array
        Times and values; empty where the definition is not known here.
    is_total : bool
        The time is that of all steps.
    is_smooth : bool
    keyword : Keyword
    """

    table: Floats
    is_total: bool
    is_smooth: bool
    keyword: Keyword

    def value(self, time: float) -> float:
        """Its value at a time."""
        times, values = self.table.T
        if not self.is_smooth or not times[0] < time < times[-1]:
            return float(np.interp(time, times, values))
        k = int(np.searchsorted(times, time))
        s = (time - times[k - 1]) / (times[k] - times[k - 1])
        share = s**3 * (10 - 15 * s + 6 * s * s)  # whose slopes at the ends are zero
        return float(values[k - 1] + (values[k] - values[k - 1]) * share)


@dataclass(frozen=True, eq=False)
class Coupling:
    """A surface that follows, or bears, a reference node.

    Attributes
    ----------
    is_rigid : bool
        KINEMATIC; else DISTRIBUTING.
    surface : str
    line : DeckLine
    """

    is_rigid: bool
    surface: str
    line: DeckLine


@dataclass(frozen=True, eq=False)
class HeldNodes:
    """Nodes that one keyword holds or moves.

    Attributes
    ----------
    name : str
        Of the set; empty where nodes are given by number.
    rows : list of (k,) arrays of int
    axes : tuple of int
        Directions, from 0; 3 to 5 are turns.
    step : int
        0 before all steps.
    place : str
    """

    name: str
    rows: list[Ints]
    axes: tuple[int, ...]
    step: int
    place: str


@dataclass(frozen=True, eq=False)
class SpreadLoad:
    """A load on faces or volumes of elements.

    Attributes
    ----------
    label : str
        P, HP, TRVEC on faces; GRAV, CENTRIF, BX, BY, BZ on volumes.
    target : str
        Set or surface; empty where elements are given by number.
    elements, faces : lists of (k,) arrays of int
        Faces are -1 of a load on volumes.
    values : list of float
        Of each of these arrays.
    numbers : tuple of float
        What follows the value.
    step : int
    line : DeckLine
    row : int
        Line of the file.
    """

    label: str
    target: str
    elements: list[Ints]
    faces: list[Ints]
    values: list[float]
    numbers: tuple[float, ...]
    step: int
    line: DeckLine
    row: int

    def refuse(self, words: str) -> None:
        """Raise an error that names file and line."""
        self.line.keyword.refuse(words, self.row, ProblemError)


class DeckState:
    """What a deck says of a step, with what earlier ones have left behind.

    Attributes
    ----------
    restraints : list of HeldNodes
    owner : (6, n) array of int
        Which of them decides a direction of a node; -1 where none does.
    value : (6, n) array
        Displacements and turns.
    force : (n, 6) array
        Forces and moments at nodes.
    spread : dict of SpreadLoad
    couplings : dict of Coupling by node
    temperature, initial_temperature : (n,) arrays
    stresses : list of (elements, stress)
    amplitudes : dict of Amplitude by name
    """

    def __init__(
        self,
        model: AbaqusModel,
        steps: Sequence[DeckStep],
        step: DeckStep | None,
        time: float | None,
        left_out: set[str],
    ) -> None:
        n = len(model.points)
        self.model, self.steps, self.step, self.time = model, steps, step, time
        self.restraints: list[HeldNodes] = []
        self.owner = np.full((6, n), -1, dtype=np.int64)
        self.value = np.zeros((6, n))
        self.force = np.zeros((n, 6))
        self._force_step = np.zeros((n, 6), dtype=np.int64)
        self.force_line: dict[int, tuple[Keyword, int]] = {}
        self.spread: dict[tuple[str, ...], SpreadLoad] = {}
        self.couplings: dict[int, Coupling] = {}
        self.initial_temperature, self.temperature = np.zeros(n), np.zeros(n)
        self.stresses: list[tuple[Ints, Floats]] = []
        self.amplitudes: dict[str, Amplitude] = {}
        first: dict[str, Callable[[DeckLine], None]] = {
            "AMPLITUDE": self._take_amplitude,
            "COUPLING": self._take_coupling,
            "INITIAL CONDITIONS": self._take_initial,
        }
        later_readers: dict[str, Callable[[DeckLine], None]] = {
            "BOUNDARY": self._take_boundary,
            "CLOAD": self._take_forces,
            "DLOAD": self._take_spread,
            "DSLOAD": self._take_spread,
            "TEMPERATURE": self._take_temperature,
        }
        for readers in (first, later_readers):
            for line in model.lines:
                name = line.keyword.name
                if name in readers and name not in left_out and self.counts(line):
                    self._refuse_unread(line.keyword)
                    readers[name](line)
            if readers is first:
                self.temperature = self.initial_temperature.copy()

    def counts(self, line: DeckLine) -> bool:
        """Whether what stands in a step acts in the one that was chosen."""
        if line.step is None:
            return True
        if self.step is None or line.step > self.step.number:
            return False
        if line.step == self.step.number:
            return True
        earlier_step = self.steps[line.step - 1]
        if not earlier_step.is_static or earlier_step.is_perturbation:
            return False
        return line.keyword.name == "BOUNDARY" or not self.step.is_perturbation

    def _refuse_unread(self, keyword: Keyword) -> None:
        for option, reason in _UNREAD.items():
            if option in keyword.options:
                keyword.refuse(f"{option}: {reason}: give the values.", error=ProblemError)

    # --- amplitudes and couplings

    def _take_amplitude(self, line: DeckLine) -> None:
        keyword = line.keyword
        definition = keyword.options.get("DEFINITION", "TABULAR").upper()
        entries = [
            keyword.number(entry, number, "a time or value")
            for number, row in keyword.rows
            for entry in row
            if entry and definition in ("TABULAR", "SMOOTH STEP")
        ]
        table = np.array(entries[: len(entries) // 2 * 2]).reshape(-1, 2)
        if len(entries) % 2 or (np.diff(table[:, 0]) < 0).any():
            keyword.refuse("give pairs of time and value, times that grow.", error=ProblemError)
        is_total = keyword.options.get("TIME", "").upper().startswith("TOTAL")
        self.amplitudes[keyword.option("NAME").casefold()] = Amplitude(
            table, is_total, definition == "SMOOTH STEP", keyword
        )

    def _factor(self, line: DeckLine) -> float:
        """Value of the amplitude that a load names, at the time of the state."""
        keyword, name = line.keyword, line.keyword.options.get("AMPLITUDE", "")
        if not name or line.step is None or self.step is None:
            return 1.0
        amplitude = self.amplitudes.get(name.casefold())
        if amplitude is None or not len(amplitude.table):
            words = "there is none of that name" if amplitude is None else (
                f"it ({amplitude.keyword.place}) is no table of times and values"
            )  # fmt: skip
            keyword.refuse(
                f"AMPLITUDE={name}: {words}: write it as DEFINITION=TABULAR.", error=ProblemError
            )
        step = self.steps[line.step - 1]
        is_now = step.number == self.step.number or amplitude.is_total
        step = self.step if amplitude.is_total else step
        time = self.time if is_now and self.time is not None else step.period
        return amplitude.value(time + (step.begin if amplitude.is_total else 0.0))

    def _take_coupling(self, line: DeckLine) -> None:
        keyword = line.keyword
        next_lines = self.model.lines[self.model.lines.index(line) + 1 :][:1]
        kind = next_lines[0].keyword if next_lines else keyword
        if kind.name not in ("DISTRIBUTING", "KINEMATIC"):
            keyword.refuse("*DISTRIBUTING or *KINEMATIC must follow it.", error=ProblemError)
        axes = {axis for number, row in kind.rows for axis in _axes(kind, ["", *row], number)}
        if kind.name == "KINEMATIC" and kind.data and not axes >= {0, 1, 2}:
            kind.refuse("couple all directions: leave its data lines out.", error=ProblemError)
        for node in self.model.nodes_of(keyword.option("REF NODE"), line).tolist():
            self.couplings[node] = Coupling(
                kind.name == "KINEMATIC", keyword.option("SURFACE"), line
            )

    # --- what is held

    def _take_boundary(self, line: DeckLine) -> None:
        keyword = line.keyword
        if keyword.options.get("TYPE", "DISPLACEMENT").upper() != "DISPLACEMENT":
            keyword.refuse("velocities and accelerations are no statics.", error=ProblemError)
        step = line.step or 0
        if keyword.options.get("OP", "").upper() == "NEW":
            current_numbers = [n for n, r in enumerate(self.restraints) if r.step == step]
            self.owner[~np.isin(self.owner, current_numbers)] = -1
        is_base = self.step is not None and self.step.is_perturbation and step != self.step.number
        factor = 0.0 if is_base else self._factor(line)
        by_number: dict[tuple[int, ...], int] = {}
        for number, row in keyword.rows:
            rows = self.model.nodes_of(row[0], line, number)
            axes = _axes(keyword, row, number)
            value = 0.0
            if len(row) > 3 and row[1].upper() not in _HELD:
                value = factor * keyword.number(row[3], number, "a displacement", 0.0)
            is_number = row[0].rpartition(".")[2].isdigit()
            index = (
                by_number.setdefault(axes, len(self.restraints))
                if is_number
                else len(self.restraints)
            )
            if index == len(self.restraints):
                place = f"{keyword.path.name}, line {number}"
                self.restraints.append(
                    HeldNodes("" if is_number else row[0], [], axes, step, place)
                )
            for axis in axes:
                self._check_clash(keyword, number, row[0], axis, rows, value, step)
            self.restraints[index].rows.append(rows)
            for axis in axes:
                self.owner[axis, rows], self.value[axis, rows] = index, value

    def _check_clash(
        self, keyword: Keyword, number: int, name: str, axis: int, rows: Ints, value: float,
        step: int,
    ) -> None:  # fmt: skip
        """Raise where a direction of a node is given two values in one step."""
        owner = self.owner[axis, rows]
        has_owner = owner >= 0
        has_owner[has_owner] = [self.restraints[n].step == step for n in owner[has_owner].tolist()]
        v = self.value[axis, rows[has_owner]]
        if (np.abs(v - value) > 1e-9 * max(abs(value), float(np.abs(v).max(initial=0)))).any():
            first = self.restraints[int(owner[has_owner][0])].place
            keyword.refuse(
                f"direction {axis + 1} of {name} is given {value:g} here and another value in "
                f"{first}: leave one of them out.", number, ProblemError
            )  # fmt: skip

    # --- what is loaded

    def _take_forces(self, line: DeckLine) -> None:
        keyword, step = line.keyword, line.step or 0
        if keyword.options.get("OP", "").upper() == "NEW":
            self.force[self._force_step < step] = 0.0
        factor = self._factor(line)
        for number, row in keyword.rows:
            axis = keyword.whole_number(row[1] if len(row) > 1 else "", number, "a direction") - 1
            if axis not in range(6):
                keyword.refuse(
                    f"direction {axis + 1} is none: give one of 1 to 6.", number, ProblemError
                )
            entry = row[2] if len(row) > 2 else ""
            value = factor * keyword.number(entry, number, "a force", 0.0)
            rows = self.model.nodes_of(row[0], line, number)
            # Forces of one step at one node add up; those of a later step take their place.
            is_same = self._force_step[rows, axis] == step
            self.force[rows, axis] = np.where(is_same, self.force[rows, axis], 0.0) + value
            self._force_step[rows, axis] = step
            self.force_line.update(dict.fromkeys(rows.tolist(), (keyword, number)))

    def _take_spread(self, line: DeckLine) -> None:
        keyword, step = line.keyword, line.step or 0
        if keyword.options.get("OP", "").upper() == "NEW":
            self.spread = {
                key: load
                for key, load in self.spread.items()
                if load.step == step or load.line.keyword.name != keyword.name
            }
        factor = self._factor(line)
        for number, row in keyword.rows:
            if len(row) < 2:
                keyword.refuse("give a set, a kind of load and a value.", number, ProblemError)
            label = row[1].upper()
            numbers_of_row = [keyword.number(entry, number, "a number", 0.0) for entry in row[2:]]
            value, numbers = (
                factor * (numbers_of_row[0] if numbers_of_row else 0.0),
                tuple(numbers_of_row[1:]),
            )
            elements, faces, label = self._loaded_faces(line, number, row[0], label)
            by_number = keyword.name == "DLOAD" and row[0].rpartition(".")[2].isdigit()
            target = "" if by_number else row[0]
            place = keyword.place if by_number else target.casefold()
            key = (keyword.name, place, row[1].upper(), str(numbers) if by_number else "")
            load = self.spread.get(key)
            if load is None or load.step != step:
                load = SpreadLoad(label, target, [], [], [], numbers, step, line, number)
                self.spread[key] = load
            elif not by_number:
                load.refuse(f"{row[0]} has the load {label} twice in one step: give one value.")
            load.elements.append(elements)
            load.faces.append(faces)
            load.values.append(value)

    def _loaded_faces(
        self, line: DeckLine, number: int, name: str, label: str
    ) -> tuple[Ints, Ints, str]:
        """Elements and faces that are loaded, and the kind of the load."""
        keyword = line.keyword
        if keyword.name == "DSLOAD":
            surface = self.model.set_of("surfaces", name, "")
            if surface is None or surface.faces is None:
                names = ", ".join(
                    s.name for s in self.model.surfaces.values() if s.faces is not None
                )
                keyword.refuse(
                    f"the deck has no surface {value_text(name)} of element faces; it has "
                    f"{names or 'none'}.", number, ProblemError
                )  # fmt: skip
            return surface.members, surface.faces, label
        groups = self.model.body_groups
        elements = (
            self.model.elements_of(name, line, number)
            if name
            else np.concatenate([group.first + np.arange(len(group.nodes)) for group in groups])
        )
        kind = label.rstrip("123456")
        is_face = kind in ("P", "HP", "TRVEC") and label != kind
        face = int(label[len(kind) :]) - 1 if is_face else -1
        return elements, np.full(len(elements), face), kind if is_face else label

    # --- temperatures, and the state without load

    def _take_initial(self, line: DeckLine) -> None:
        keyword = line.keyword
        kind = keyword.option("TYPE").upper()
        if kind == "TEMPERATURE":
            self._set_temperature(line, self.initial_temperature, 1.0)
        elif kind == "STRESS":
            for number, row in keyword.rows:
                components = [keyword.number(entry, number, "a stress", 0.0) for entry in row[1:]]
                if len(components) > 6:
                    keyword.refuse(
                        "stresses of integration points are not read: give those of sets of "
                        "elements.", number, ProblemError
                    )  # fmt: skip
                xx, yy, zz, xy, xz, yz = (*components, *[0.0] * (6 - len(components)))
                stress = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
                self.stresses.append((self.model.elements_of(row[0], line, number), stress))

    def _take_temperature(self, line: DeckLine) -> None:
        if line.keyword.options.get("OP", "").upper() == "NEW":
            self.temperature = self.initial_temperature.copy()
        self._set_temperature(line, self.temperature, self._factor(line))

    def _set_temperature(self, line: DeckLine, target: Floats, factor: float) -> None:
        for number, row in line.keyword.rows:
            entry = row[1] if len(row) > 1 else ""
            value = line.keyword.number(entry, number, "a temperature", 0.0)
            target[self.model.nodes_of(row[0], line, number)] = factor * value


def _axes(keyword: Keyword, row: list[str], number: int) -> tuple[int, ...]:
    """Directions that a data line holds, from 0."""
    word = row[1].upper() if len(row) > 1 else ""
    if word in _HELD:
        return tuple(_HELD[word])
    start = keyword.whole_number(word, number, "a direction, or a word such as ENCASTRE")
    end = keyword.whole_number(row[2], number, "a direction") if len(row) > 2 and row[2] else start
    if not 1 <= start <= end <= 6:
        keyword.refuse(
            f"directions {start} to {end}: 1 to 3 are displacements, 4 to 6 turns; others are no "
            "statics.", number, ProblemError
        )  # fmt: skip
    return tuple(range(start - 1, end))


__all__ = [
    "Coupling",
    "DeckState",
    "DeckStep",
    "HeldNodes",
    "SpreadLoad",
    "chosen_step",
    "steps_of",
]
