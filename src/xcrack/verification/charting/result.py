"""A chart of error against time: its rows, its table, and what it recommends."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from textwrap import shorten
from typing import Annotated, Any

from xcrack.base.arguments import FileName, Number, Switch, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import value_text
from xcrack.base.errors import ProblemError
from xcrack.model.problem import Problem

WantedError = Annotated[float | None, Number(above=0)]

_DECADES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@dataclass(frozen=True, eq=False)
class ChartRow:
    """One setting on one mesh.

    Attributes
    ----------
    setting : str
        Name of the variation.
    fields : mapping
        What it changes in Problem and Numerics, with the numbers that were used.
    mesh : int
        Number of the mesh, from 0 for the coarsest; -1 for one that `adapt` has made.
    size : float, length
        Edge of the square or cube, cut into simplices, of which the smallest cell is one.
    unknowns : int
        Without multipliers.
    seconds : float
        Median time of solving and of the quantity; the mesh is ready and kernels are compiled.
    error : float
        Distance from the reference over its size, Euclidean norms; nan where the run failed.
    values : (n,) array
        The quantity at the places of the reference.
    warnings : tuple of str
        Warnings of the run.
    failed : str
        Why there is no result; empty where there is one.
    problem : Problem or None
        The scene as it was run; None where it could not be made.
    """

    setting: str
    fields: Mapping[str, Any]
    mesh: int
    size: float
    unknowns: int
    seconds: float
    error: float
    values: Floats = field(repr=False)
    warnings: tuple[str, ...] = field(repr=False, default=())
    failed: str = ""
    problem: Problem | None = field(repr=False, default=None)

    def __str__(self) -> str:
        where = f"{_what(self)} (h = {self.size:.3g})"
        if self.failed:
            return f"{where}: failed: {self.failed}"
        return f"{where}: {self.unknowns} unknowns, {_time(self.seconds)}, error {self.error:.2g}"


@dataclass(frozen=True, eq=False)
class Best:
    """The cheapest run for a wanted error; false where none reaches it.

    Attributes
    ----------
    wanted : float
    row : ChartRow or None
    words : str
        The same as a sentence.
    """

    wanted: float
    row: ChartRow | None
    words: str

    def __bool__(self) -> bool:
        return self.row is not None

    def __str__(self) -> str:
        return self.words

    @property
    def problem(self) -> Problem:
        """The scene with these settings, ready to be solved.

        Raises
        ------
        ProblemError
            None reaches the wanted error.
        """
        if self.row is None or self.row.problem is None:
            raise ProblemError(self.words)
        return self.row.problem


@dataclass(frozen=True, eq=False)
class Chart:
    """Error against time of one scene over some settings and meshes.

    Attributes
    ----------
    rows : tuple of ChartRow
        From the coarsest mesh to the finest, failed runs included.
    reference : ChartRow
        The run that the others are compared with.
    reference_error : float
        Estimate of its own error, relative as that of the rows. Below it errors mean nothing.
    quantity : str
        What was compared.
    wanted : float or None
        Error that was asked for.
    repeat : int
        Times are medians of so many runs.
    """

    rows: tuple[ChartRow, ...]
    reference: ChartRow
    reference_error: float
    quantity: str
    wanted: float | None = None
    repeat: int = 1

    @property
    def failed(self) -> tuple[ChartRow, ...]:
        """Runs without a result."""
        return tuple(row for row in self.rows if row.failed)

    @property
    def good(self) -> tuple[ChartRow, ...]:
        """Runs with a result."""
        return tuple(row for row in self.rows if not row.failed)

    @property
    def pareto(self) -> tuple[ChartRow, ...]:
        """Runs that no other run beats in time and error, the fastest first.

        Errors below that of the reference count as equal to it.
        """
        front: list[ChartRow] = []
        for row in sorted(self.good, key=lambda row: (row.seconds, row.error)):
            if not front or self.shown(row) < self.shown(front[-1]):
                front.append(row)
        return tuple(front)

    def shown(self, row: ChartRow) -> float:
        """Error of a row as far as the reference can tell it.

        Parameters
        ----------
        row : ChartRow

        Raises
        ------
        ProblemError
            Not a row of a chart.
        """
        if not isinstance(row, ChartRow):
            raise ProblemError(
                f"Chart.shown: row = {value_text(row)}: give one of the rows of a chart."
            )
        return max(row.error, self.reference_error)

    @check_arguments()
    def best(self, wanted: WantedError = None) -> Best:
        """The cheapest run whose error, plus that of the reference, is at most the wanted one.

        Parameters
        ----------
        wanted : float, optional
            Relative error; left out: that which the chart was made for.

        Returns
        -------
        Best
            ``print`` gives a sentence, ``.problem`` the scene; false where no run reaches it.

        Raises
        ------
        ProblemError
            No number, here nor for the chart.
        """
        wanted = self.wanted if wanted is None else wanted
        if wanted is None:
            raise ProblemError("Chart.best: wanted = None: give a relative error, such as 1e-3.")
        able = [row for row in self.good if row.error + self.reference_error <= wanted]
        if not able:
            closest_row = min(self.good, key=lambda row: row.error + self.reference_error)
            limit = (
                f"The reference itself is known to {self.reference_error:.2g} only: give"
                if wanted < self.reference_error
                else "Give"
            )
            words = (
                f"None of the {len(self.good)} runs reaches {wanted:.2g}: "
                f"{_what(closest_row)} comes closest, with an error of at "
                f"most {closest_row.error + self.reference_error:.2g}. {limit} finer meshes "
                "(meshes=...)."
            )
            return Best(wanted, None, words)
        row = min(able, key=lambda row: (row.seconds, row.error))
        caution = f" It warned: {shorten(row.warnings[0], 110)}" if row.warnings else ""
        return Best(
            wanted,
            row,
            f"{self.quantity} to {wanted:.2g}: {_what(row)} "
            f"(h = {row.size:.3g}, {row.unknowns} unknowns), {_time(row.seconds)}, error at most "
            f"{row.error + self.reference_error:.2g}. {_recipe(row)}{caution}",
        )

    def table(self) -> str:
        """All runs as text, a line each, the fastest of a mesh first."""
        width = max([len(_name(row)) for row in self.rows] + [7])
        front = self.pareto
        lines = [f"{'mesh':>4} {'h':>9} {'unknowns':>9}  {'setting':<{width}}  seconds     error"]
        for row in sorted(self.rows, key=_place):
            if row.failed:
                count, numbers = "–", f"failed: {row.failed}"
            else:
                is_below = row.error < self.reference_error
                error = f"<{self.reference_error:.1e}" if is_below else f"{row.error:.1e}"
                count, numbers = str(row.unknowns), f"{row.seconds:7.3g} {error:>9}"
                marks = [
                    word
                    for word, is_true in (
                        ("cheapest for its error", row in front),
                        ("reference", row is self.reference),
                        ("warned", bool(row.warnings)),
                    )
                    if is_true
                ]
                numbers += "  " + ", ".join(marks)
            name, mesh = _name(row), "–" if row.mesh < 0 else row.mesh
            line = f"{mesh:>4} {row.size:>9.3g} {count:>9}  {name:<{width}}  {numbers}"
            lines.append(line.rstrip())
        return "\n".join(lines)

    @check_arguments()
    def plot(self, file: FileName | None = None, *, show: Switch | None = None) -> Any:
        """Draw error against time.

        Parameters
        ----------
        file : path, optional
            Where to save the picture; ``.png`` is added to a path without suffix.
        show : bool, optional
            Open a window; left out: only without a file.

        Returns
        -------
        matplotlib figure, or the path of the file
        """
        from xcrack.verification.charting.picture import draw

        return draw(self, file, show)

    def __str__(self) -> str:
        head = (
            f"{self.quantity}, compared with {self.reference.setting!r} on mesh "
            f"{self.reference.mesh}, whose own error is about {self.reference_error:.1e}; "
            f"seconds are medians of {self.repeat}."
        )
        asked = [self.wanted] if self.wanted is not None else list(_DECADES)
        advice = [self.best(wanted) for wanted in asked]
        words = [str(best) for best in advice if best or self.wanted is not None]
        # A looser wish that the same run fulfils adds nothing.
        best_rows = [best.row for best in advice if best]
        if self.wanted is None:
            words = [
                w
                for w, row, then in zip(words, best_rows, [*best_rows[1:], None])
                if row is not then
            ]
        return "\n".join([head, "", self.table(), "", *words])


def _place(row: ChartRow) -> tuple[bool, int, bool, float]:
    """Order in the table: by mesh, those of `adapt` last."""
    return row.mesh < 0, row.mesh, bool(row.failed), row.seconds


def _name(row: ChartRow) -> str:
    """Setting, with the tolerance where that is what made the mesh."""
    return f"{row.setting} {row.fields['tolerance']:g}" if row.mesh < 0 else row.setting


def _what(row: ChartRow) -> str:
    """Setting and mesh in words."""
    return repr(_name(row)) if row.mesh < 0 else f"{row.setting!r} on mesh {row.mesh}"


def _time(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def _recipe(row: ChartRow) -> str:
    if row.mesh < 0:
        return f"Take xc.adapt(problem, tolerance={row.fields['tolerance']:g}), whose best K it is."
    choices = [f"{k}={v!r}" for k, v in row.fields.items() if k in ("order", "contact")]
    method = [
        f"{k}={float(f'{v:.4g}') if isinstance(v, float) else v!r}"
        for k, v in row.fields.items()
        if k not in ("order", "contact")
    ]
    if method:
        choices.append(f"Numerics({', '.join(method)})")
    return f"Change {', '.join(choices)}." if choices else "The settings stay as they are."


__all__ = ["Best", "Chart", "ChartRow"]
