"""What became of the cracks in a growth run."""

import csv
import io
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base import markup
from xcrack.base.arguments import FileName, Number, check_arguments
from xcrack.base.checks import entries, flag, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.markup import element, join_parts, rim, sketch
from xcrack.base.optional import require_package
from xcrack.base.paths import path_of, system_errors, write_texts
from xcrack.base.units import TOUGHNESS
from xcrack.crack.crack import Crack
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import Law
from xcrack.fatigue.load_program import Curve, LoadProgram
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.step import Arrival, Join, Step
from xcrack.mesh.mesh import Mesh
from xcrack.runs.life_bar import LifeBar, life_bar
from xcrack.runs.rerating import (
    RecomputedRates,
    block_of_run,
    load_program_of,
    recompute_rates,
)
from xcrack.runs.table import (
    fracture_loads,
    measures_of_steps,
    measures_tables,
    state_names,
    table,
    with_measures,
)


@dataclass(frozen=True, eq=False)
class History:
    """Steps of a growth run, and why it ended.

    Attributes
    ----------
    steps : tuple of Step
    ended : str
        Why the run ended; begins with "interrupted" where Ctrl-C stopped it.
    path : Path, optional
        Folder that holds the steps.
    mesh : Mesh, optional
        For the outline of the body in pictures.

    Raises
    ------
    ProblemError
        A part that is not of its type.
    """

    steps: tuple[Step, ...]
    ended: str
    path: Path | None = None
    mesh: Mesh | None = None

    def __post_init__(self) -> None:
        steps = entries(self.steps, "History: steps")
        for step in steps:
            if not isinstance(step, Step):
                raise ProblemError(
                    f"History: {value_text(step)} among the steps is not a Step: give those of "
                    f"grow."
                )
        object.__setattr__(self, "steps", steps)
        if not isinstance(self.ended, str):
            raise ProblemError(f"History: ended = {value_text(self.ended)}: give a text.")
        if self.path is not None:
            path = path_of(self.path, "History: path", error=ProblemError)
            object.__setattr__(self, "path", path)
        if not isinstance(self.mesh, Mesh | None):
            raise ProblemError(f"History: mesh = {value_text(self.mesh)}: give a Mesh.")

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """Where the cracks have come to at the last step (`Step.corrected`)."""
        return self.steps[-1].corrected if self.steps else ()

    @property
    def arrivals(self) -> tuple[Arrival, ...]:
        """Where and when tips and fronts came to the boundary, in all steps."""
        return tuple(arrival for step in self.steps for arrival in step.arrivals)

    @property
    def solved(self) -> tuple[Step, ...]:
        """Steps with K: all but a last one at which no tip is left in the body."""
        return tuple(step for step in self.steps if not step.has_left)

    @property
    def life(self) -> float:
        """Cycles at the last step."""
        return self.steps[-1].cycles if self.steps else 0.0

    @property
    def unit(self) -> str:
        """What N counts: cycles, or repetitions of a spectrum by their name."""
        settings = self.settings
        if settings.get("cycle") != "Spectrum":
            return "cycle"
        return settings.get("cycle.unit", "'block'").strip("'")

    @property
    def settings(self) -> Mapping[str, str]:
        """What the run was asked to do, as text by name; empty where it is not known."""
        run = self.steps[0].run if self.steps else None
        return {} if run is None else run.settings

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all tips, in 3D fronts, by their identity: the column ``id`` of `table`."""
        identities = [step.identities for step in self.steps if step.identities is not None]
        return identities[-1].names if identities else ()

    @property
    def warnings(self) -> dict[str, int]:
        """Warnings that the steps gave, and how often; the most frequent ones first."""
        texts = (text for step in self.steps for text in step.warnings or ())
        return dict(Counter(texts).most_common())

    @property
    def joins(self) -> tuple[Join, ...]:
        """Cracks that became one: where, and after how many cycles."""
        return tuple(join for step in self.steps for join in step.joins)

    @property
    def life_bar(self) -> LifeBar:
        """Numerical error of the life, by source: steps, K, contact; in full with a tolerance."""
        return life_bar(self.steps)

    def __repr__(self) -> str:
        bar = self.life_bar.total
        life = f"{self.life:.6g}" + ("" if np.isnan(bar) else f" ± {bar:.2g}")
        return f"History({len(self.steps)} steps, {life} cycles, ended: {self.ended})"

    def __str__(self) -> str:
        """With the main columns of the table, and what happened on the way."""
        if not self.steps:
            return repr(self)
        table = self.table()
        names = table.dtype.names or ()
        place = ["tip", "x", "y"] if "tip" in names else ["front"]
        last_state = state_names(self.steps)[-1:]
        stems = [f"K_{mode}_{state}" for state in last_state for mode in ("I", "II")]
        K = {stem + end for stem in stems for end in ("", "_min", "_mean", "_max")}
        shown_columns = ["step", "N", "crack", *place, "a", *(n for n in names if n in K)]
        return "\n".join([repr(self), str(table[shown_columns]), *map(str, self.joins)])

    def _repr_html_(self) -> str:
        rows = [("steps", len(self.steps)), ("cycles N", self.life), ("ended", self.ended)]
        rows[2:2] = [("join", str(join)) for join in self.joins]
        rows.insert(2, ("error bar", str(self.life_bar)))
        parts: list[Any] = [element("b", "History")]
        if self.mesh is not None and self.cracks:
            cracks = [rim(crack.points, crack.faces) for crack in self.cracks]
            parts.append(sketch(self.mesh.points, self.mesh.boundary, cracks))
        parts.append(markup.table((), rows))
        if self.steps:
            values = self.table()
            parts.append(markup.table(values.dtype.names or (), values.tolist(), scroll=True))
        return join_parts(*parts)

    def to_pandas(self) -> Any:
        """The numbers of `table` as a table of pandas.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        XcrackError
            pandas is not installed.
        """
        return require_package("pandas", "History.to_pandas").DataFrame(self.table())

    def table(self, measures: bool = False) -> NDArray[Any]:
        """All numbers, one row for each tip, in 3D for each front, of each step.

        Parameters
        ----------
        measures : bool
            With the `measures` of the crack of each row behind the others: area, depth,
            ``length_<set>`` and ``depth_<set>`` for each facet set, and both ends of the front (in
            2D the mouths of the crack), ``end_0_x``, ``end_0_y`` (, ``end_0_z``), ``end_0_set``,
            ``end_1_x`` and so on.

        Returns
        -------
        structured array
            Columns step, N, crack, tip (numbers in the step); id (the same tip through the run,
            called ``names[id]``); x, y of the tip; a (length of its crack inside the body); K_I,
            K_II of each load state by its name in `Step.states`: ``K_I_min``, ``K_II_min``,
            ``K_I_max``, ``K_II_max`` of a ``Cycle(min, max)``, ``K_I_0`` and so on of states in a
            list, and under a spectrum the levels between the lowest and the highest by number;
            spread (largest difference of K between two domains, of all states and modes);
            domain_cells (smallest radius of these domains, in cells, where K has it); bar (longest
            error bar of K), best (1 where growth followed the best K of all states, 0 where it
            followed K) and N_bar (error bar of N), where K has bars; angle, dK_eq, R as in `Step`,
            R_low and R_high (smallest and largest ratio of all cycles, under a spectrum);
            zone_of_crack, zone_of_ligament, section, K_of_K_c (plastic zone over crack and
            ligament, load on the ligament over that at which it yields, K over the toughness, each
            at its worst place: the material has a yield stress, or K_c), load_factor (where loads
            change as the crack grows), rate, da.
            A step at which no tip is left has a row for each `Arrival`, x and y where it is, and
            nan for K and what follows from it. In 3D ``front`` stands for ``tip``, x, y, z is the
            middle of the front and a the area of the crack over the length of its fronts; each K,
            K_III among them, and each of the others has three columns, its smallest value along the
            front, its mean over the length and its largest: ``K_I_max_min``, ``K_I_max_mean``,
            ``K_I_max_max``. Another column than these is a `ProblemError` that lists them.
        """
        rows = table(self.steps)
        if not flag(measures, "History.table: measures"):
            return rows
        body = self._body(None, "History.table(measures=True)")
        return with_measures(rows, measures_of_steps(self.steps, body), body)

    def rerate(
        self,
        law: Law,
        old: Law | None = None,
        *,
        spectrum: Spectrum | None = None,
        criterion: Criterion | None = None,
        nu: float | None = None,
        threshold: float = 0.0,
        load: Curve | None = None,
        K_max: Curve | LoadProgram | None = None,
    ) -> RecomputedRates:
        """Cycles of the same steps by another growth law, or under loads that change on the way.

        The path of a run whose K is in proportion to its loads is that of any factor on them: the
        loads may follow the crack afterwards, as in tests with a K-gradient, under load shedding
        or at constant K (ASTM E647).

        Parameters
        ----------
        law : callable (dK_eq, R) -> da/dN
        old : callable, optional
            Law of the run, to be sure that ranges and ratios of the steps are what it was given.
        spectrum, criterion, nu, threshold : optional
            Of a run under a spectrum, as it had them: each cycle of a block is rated again.
        load : callable a -> factor, optional
            On all loads of the run, called with arrays of crack sizes as a law is given them: in 2D
            the length in the body over the number of tips (length).
        K_max : callable a -> K, optional
            Largest equivalent K of a cycle or block (stress √length): the loads are scaled by it
            over K of the same solve.

        Returns
        -------
        RecomputedRates
            With `cycles` at each step, `life`, the `factor` on the loads at each step, and the
            `bound` of what other shares of the tips would change; 0 for one tip, where the error
            is that of the steps.

        Raises
        ------
        ProblemError
            Several tips would have shared the advance another way, by more than 5 % in the mean; a
            spectrum that is not given, or is another one; a law by which the driving tip stops;
            loads that are to change where K is not in proportion to them: friction, steady loads,
            initial stress, contact that begins on the way.

        Examples
        --------
        >>> import xcrack as xc
        >>> strip = xc.box((0, -1), (1, 1), (6, 12))
        >>> pull = [xc.traction("top", (0, 1)), xc.traction("bottom", (0, -1))]
        >>> crack = xc.line_crack([(-0.1, 0.02), (0.2, 0.02)])
        >>> scene = xc.Problem(strip, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=pull)
        >>> law, cycle = xc.paris(C=1e-3, m=3.0), xc.Cycle(0.0, 1.0)
        >>> steps = xc.grow(scene, law, xc.max_hoop_stress, cycle, da=0.1, max_steps=3)
        >>> shed = xc.collect(steps).rerate(law, K_max=lambda a: 0.0 * a + 1.0)   # constant K
        >>> print(bool((shed.factor[1:] < shed.factor[:-1]).all()))
        True
        """
        block = block_of_run("rerate", spectrum, criterion, nu, threshold)
        program = load_program_of(load, K_max)
        return recompute_rates(self.steps, law, old, block, program)

    @check_arguments()
    def load_at(self, K_c: Annotated[float, Number(above=0, unit=TOUGHNESS)]) -> NDArray[Any]:
        """Force and displacement at which the crack goes on at K = K_c, at each step.

        Of a crack that grows without cycles, slowly, as soon as K reaches the toughness: the curve
        of force over displacement, which may snap back. The path is that of the run, which any law
        gives with steps of one length `da`.

        Parameters
        ----------
        K_c : float, stress √length

        Returns
        -------
        structured array
            Columns step, a (length of all cracks in the body, in 3D their area), factor (on the
            loads of the largest state), force (largest resultant of a load or of the reaction of a
            support, per thickness in 2D), displacement (over which that force does all the work).

        Raises
        ------
        ProblemError
            A K_c that is not positive, a run read from its folder, which has no solutions, or K
            that is not in proportion to the loads.

        Notes
        -----
        K_c over the largest K_eq of a cycle scales all: K is in proportion to the loads, and so the
        displacement is 2 U / force with the strain energy U.
        """
        return fracture_loads(self.steps, K_c)

    def measures(self, mesh: Mesh | None = None) -> tuple[NDArray[Any], NDArray[Any]]:
        """What an engineer reads off the cracks: depth, surface lengths, area, ends by set.

        Parameters
        ----------
        mesh : Mesh, optional
            The body, for a run that was read without it; that of the run if omitted.

        Returns
        -------
        measures : structured array
            One row for each crack of each step: step, N, crack, area (in 2D the length),
            front_length, depth, and for each facet set that a crack ever meets ``length_<set>``
            and ``depth_<set>``; nan where it does not meet it.
        ends : structured array
            One row for each place where a front, in 2D a crack, meets the boundary: step, N, crack,
            front, x, y (, z), set.

        Raises
        ------
        ProblemError
            No mesh is known.
        """
        body = self._body(mesh, "History.measures")
        return measures_tables(measures_of_steps(self.steps, body), body)

    def _body(self, mesh: Mesh | None, label: str) -> Mesh:
        body = self.mesh if mesh is None else mesh
        if not isinstance(body, Mesh):
            raise ProblemError(
                f"{label}: this run was read without its mesh: give measures(mesh=...), or make a "
                "History with mesh=."
                if body is None
                else f"{label}: mesh = {value_text(body)}: give a Mesh."
            )
        return body

    @check_arguments()
    def plot(self, kind: str, file: FileName | None = None) -> Any:
        """Draw the run.

        Parameters
        ----------
        kind : {"K", "a", "path", "fronts", "measures"}
            K of the most severe state over the crack length, length over cycles, the cracks
            in the body, or depth and surface lengths over cycles; in 3D the largest K along each
            front over cycles, and the fronts over the section of the body.
        file : path, optional
            File to save the figure to; if omitted, the figure is shown.

        Returns
        -------
        matplotlib figure

        Raises
        ------
        ProblemError
            No such kind, no steps, or a file that cannot be written.
        """
        from xcrack.view.history import draw

        return draw(self, kind, file)

    def write(self, path: str | Path) -> None:
        """Write a table and a series for ParaView into a folder.

        ``history.csv`` is `table`, with its measures where the mesh is known, and so are
        ``measures.csv`` and ``ends.csv``, which are `measures`; ``history.pvd`` lists for each step
        the solutions of all load states with their faces, or the lines of the cracks where a step
        has no solutions any more (it was read from disk).

        Parameters
        ----------
        path : path
            Folder; made if it is not there.

        Raises
        ------
        ProblemError
            The folder, or a file in it, cannot be written.
        """
        from xcrack.runs.table import write_series

        folder = path_of(path, "History.write: path", error=ProblemError)
        rows, mesh = self.table(), self.mesh
        tables = {"history": rows}
        if mesh is not None:
            step_measures = measures_of_steps(self.steps, mesh)
            tables["history"] = with_measures(rows, step_measures, mesh)
            tables["measures"], tables["ends"] = measures_tables(step_measures, mesh)
        texts = {folder / f"{name}.csv": _csv_text(part) for name, part in tables.items()}
        label = "the history cannot be written as a whole to"
        with system_errors(label, folder, error=ProblemError):
            folder.mkdir(parents=True, exist_ok=True)
            write_texts(texts, label, error=ProblemError)
            write_series(self.steps, folder)


def _csv_text(rows: NDArray[Any]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(rows.dtype.names or ())
    writer.writerows(rows.tolist())
    return text.getvalue()


__all__ = ["History"]
