"""Pictures of rates, lives, load histories, residual strength and sweeps."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.arguments import FileName, Number, Part, Text, check_arguments
from xcrack.base.checks import numbers, value_text
from xcrack.base.errors import ProblemError
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.metals import Metal
from xcrack.fatigue.spectrum import Spectrum
from xcrack.fatigue.units import Units
from xcrack.runs.assessment import CRITERIA
from xcrack.runs.life import Life
from xcrack.view.figures import finish_figure, new_figure, picture_path


def draw_life(life: Life, kind: str, file: FileName | None) -> Any:
    """Figure of the share that has ended over cycles, or of how many end where."""
    N = life.N[np.isfinite(life.N) & (life.N > 0)]
    if not len(N):
        raise ProblemError("there is nothing to draw: no sample ends; give a larger load.")
    target = picture_path(file, "Life.plot")
    figure = new_figure((6.4, 4.8), target is None, "Life.plot")
    axes = figure.add_subplot()
    if kind == "cdf":
        share = np.arange(1, len(N) + 1) / len(life.N)
        rows = np.unique(np.linspace(0, len(N) - 1, 2000).astype(int))
        axes.plot(N[rows], share[rows], label="samples")
        axes.set(ylabel="share that has ended", ylim=(0, 1))
    else:
        edges = np.geomspace(N[0], N[-1] * (1 + 1e-12), 60) if N[0] < N[-1] else 10
        axes.hist(N, bins=edges, weights=np.full(len(N), 1 / len(life.N)), label="samples")
        axes.set(ylabel="share of the samples")
    axes.axvline(life.life, color="k", lw=0.8, label="the run")
    for p in (5, 95):
        axes.axvline(life.percentile(p), color="0.6", lw=0.8, ls="--")
    axes.set(xlabel=f"life in {life.unit}s", xscale="log")
    axes.legend(fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


_LABELS = {
    "by_toughness": "K = K_c",
    "by_resistance": "R-curve",
    "by_section": "net section yields",
    "by_link_up": "cracks link up",
    "by_collapse": "collapse",
    "by_line": "assessment line",
}


@check_arguments()
def plot_strength(
    strength: NDArray[Any],
    *,
    unit: Annotated[str, Text('what N counts, such as "cycle"')] = "cycle",
    file: FileName | None = None,
) -> Any:
    """Draw what `residual_strength` returned: factors on the load over the life, as one curve.

    Parameters
    ----------
    strength : structured array
    unit : str
        What N counts, as `History.unit` has it.
    file : path, optional
        Picture to write; without it a window opens, or the notebook shows it.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    ProblemError
        Another array, one without rows or without a finite factor, no word as unit, or a file that
        cannot be written.
    """
    names = getattr(getattr(strength, "dtype", None), "names", None) or ()
    if not {"N", "factor", *CRITERIA} <= set(names) or np.ndim(strength) != 1:
        raise ProblemError(
            f"plot_strength: strength = {value_text(strength)}: give what xc.residual_strength "
            "returns."
        )
    if not np.isfinite(strength["factor"]).any():
        raise ProblemError("plot_strength: there is nothing to draw: no factor is finite.")
    target = picture_path(file, "plot_strength")
    figure = new_figure((6.4, 4.8), target is None, "plot_strength")
    axes = figure.add_subplot()
    N = strength["N"]
    axes.plot(N, strength["factor"], color="0.75", lw=6, zorder=1, label="residual strength")
    for number, name in enumerate(CRITERIA):
        finite_strength = np.where(np.isfinite(strength[name]), strength[name], np.nan)
        if np.isfinite(finite_strength).any():
            axes.plot(
                N, finite_strength, "o-", ms=3, lw=1.2, color=f"C{number}", label=_LABELS[name]
            )
    axes.axhline(1.0, color="k", lw=1, ls="--", label="largest load of the run")
    for n in np.nonzero(np.diff(strength["crack"]))[0]:
        words = f"crack {strength['crack'][n + 1]} leads"
        axes.axvline(N[n + 1], color="0.5", lw=0.8, ls=":", label=words)
    finite_factors = strength["factor"][np.isfinite(strength["factor"])]
    axes.set(xlabel=f"{unit}s N", ylabel="factor on the largest load",
             ylim=(0, max(1.2, 1.35 * float(finite_factors.max()))))  # fmt: skip
    axes.legend(fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


_FEW = 30  # cycles up to which their axis is linear
_MOST = 400  # points of a history up to which they are joined one by one


@check_arguments()
def plot_spectrum(
    spectrum: Annotated[Spectrum, Part(Spectrum, "xc.Spectrum(...)")],
    *,
    file: FileName | None = None,
) -> Any:
    """Draw a load history: its factors in time, and how often each range is exceeded.

    Parameters
    ----------
    spectrum : Spectrum
        Of factors or of counted rows: with named states the cycles depend on K.
    file : path, optional
        Picture to write; without it a window opens, or the notebook shows it.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    ProblemError
        Something else, a spectrum of named states, or a file that cannot be written.
    """
    target = picture_path(file, "plot_spectrum")
    cycles = spectrum.cycles
    figure = new_figure((9.0, 3.8), target is None, "plot_spectrum")
    history, counts = figure.subplots(1, 2, width_ratios=(1.6, 1))
    if spectrum.factors is not None:
        line = "o-" if len(spectrum.factors) <= _MOST else "-"
        history.plot(np.arange(len(spectrum.factors)), spectrum.factors, line, ms=2.5, lw=0.9)
        history.set(xlabel=f"points of a {spectrum.unit}", ylabel="factor on the loads")
    else:
        x_of_cycles = np.repeat(np.arange(len(cycles)), 2).reshape(-1, 2)
        for x, trough, peak in zip(x_of_cycles, cycles["min"], cycles["max"], strict=True):
            history.plot(x, (trough, peak), color="C0", lw=2)
        history.set(xlabel="kinds of cycle", ylabel="factor on the loads")
    history.axhline(0, color="0.7", lw=0.8, zorder=0)
    size = cycles["max"] - cycles["min"]
    order = np.argsort(size)[::-1]
    total = np.cumsum(cycles["count"][order])
    counts.step(
        np.append(0.5 if total[-1] > _FEW else 0.0, total), np.append(size[order][:1], size[order])
    )
    scale = "log" if total[-1] > _FEW else "linear"
    counts.set(xscale=scale, xlabel=f"cycles a {spectrum.unit} of at least",
               ylabel="this range of the factor", ylim=(0, 1.05 * float(size.max())))  # fmt: skip
    counts.set_title(f"{total[-1]:g} cycles, {len(spectrum.left_out)} left out", fontsize="small")
    finish_figure(figure, target, target is None)
    return figure


# --- picture of growth laws: da/dN over ΔK ---


_RANGE = (3.0, 60.0)  # MPa√m: from thresholds of metals to where plates break
_LONG = 0.1  # m, the size of a crack whose threshold is that of long ones
_STYLES = ("-", "--", "-.", ":")


@check_arguments()
def plot_rates(
    laws: Mapping[str, Any] | Sequence[Metal],
    *,
    units: Annotated[str, Text('the units of length and K, such as "mm, MPa√mm"')],
    R: Annotated[float, Number(most=1)] = 0.1,
    dK: tuple[float, float] | None = None,
    file: FileName | None = None,
) -> Any:
    """Draw da/dN of laws over ΔK, in one picture.

    Parameters
    ----------
    laws : mapping of name to law, or sequence of Metal
        Of a metal the first of its laws is drawn; one without laws is left out.
    units : str
        Length and K of the laws, such as ``"mm, MPa√mm"``, for the axes. Metals are given in these.
    R : float
        Ratio of the loads; a law that does not hold there is left out.
    dK : (lowest, highest), stress √length, optional
        Range drawn; by default 3 to 60 MPa√m.
    file : path, optional
        Picture to write; without it a window opens, or the notebook shows it.

    Returns
    -------
    matplotlib figure

    Raises
    ------
    ProblemError
        No laws, or none that holds at this ratio; a range that does not rise.

    Examples
    --------
    ::

        metals = [xc.material(name, units="mm, MPa√mm") for name in xc.materials()]
        xc.plot_rates(metals, units="mm, MPa√mm", file="rates.png")
    """
    system = Units.read(units)
    target = picture_path(file, "plot_rates")
    dK_min, dK_max = (k * 1e6 / system.K for k in _RANGE) if dK is None else _limits(dK)
    ranges = np.geomspace(dK_min, dK_max, 200)
    curves = _curves(_named_laws(laws, units), ranges, R, _LONG / system.length)
    figure = new_figure((8.0, 5.4), target is None, "plot_rates")
    axes = figure.add_subplot()
    for n, (name, rate) in enumerate(curves.items()):
        axes.loglog(ranges, rate, color=f"C{n % 10}", ls=_STYLES[n // 10 % 4], lw=1.4, label=name)
    length, K = (part.strip() for part in units.split(","))
    axes.set(xlabel=f"ΔK in {K}", ylabel=f"da/dN in {length} a cycle", title=f"R = {R:g}")
    for axis_format in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
        axis_format(lambda x, _: f"{x:g}" if f"{x:e}"[0] in "1235" else "")  # others would overlap
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(fontsize="x-small", loc="upper left", bbox_to_anchor=(1.01, 1.0))
    finish_figure(figure, target, target is None)
    return figure


def _limits(dK: Any) -> tuple[float, float]:
    dK_min, dK_max = numbers(dK, "plot_rates: dK", (2,)).tolist()
    if not 0 < dK_min < dK_max:
        raise ProblemError(
            f"plot_rates: dK = ({dK_min:g}, {dK_max:g}): give (lowest, highest) above 0."
        )
    return dK_min, dK_max


def _named_laws(laws: Any, units: str) -> dict[str, Any]:
    if isinstance(laws, Mapping):
        return {str(name): law for name, law in laws.items()}
    if not isinstance(laws, Sequence) or not all(isinstance(metal, Metal) for metal in laws):
        raise ProblemError(
            "plot_rates: laws: give a mapping of names to laws, or a list of metals of xc.material."
        )
    other_names = [metal.name for metal in laws if metal.units != units]
    if other_names:
        raise ProblemError(
            f"plot_rates: {other_names[0]!r} is not in {units!r}: give all metals in the units "
            "drawn."
        )
    return {metal.name: metal.law() for metal in laws if metal.laws}


def _curves(laws: Mapping[str, Any], ranges: Any, R: float, a: float) -> dict[str, Any]:
    curves, reasons = {}, []
    for name, law in laws.items():
        try:
            rate = evaluate_law(law, ranges, np.full_like(ranges, R), 0, a=np.full_like(ranges, a))
        except ProblemError as error:
            reasons.append(str(error))
            continue
        is_good = np.isfinite(rate) & (rate > 0)
        if is_good.any():
            curves[name] = np.where(is_good, rate, np.nan)
    if not curves:
        hint = f" ({reasons[0]})" if reasons else ""
        raise ProblemError(
            f"plot_rates: no law grows at R = {R:g} in this range{hint}: give others, or another R."
        )
    return curves


# --- picture of a sweep: a result over one key, a line for each combination of the others ---


_NAMED = 12  # lines that a legend can name


def draw_sweep(
    rows: NDArray[Any], keys: Sequence[str], result: str, file: Path, title: str
) -> None:
    """Draw a column of a study over its first key; cases that failed are left out."""
    key, other_keys = keys[0], keys[1:]
    is_good = np.isfinite(rows[result])
    figure = new_figure((6.4, 4.8), False, "sweep")
    axes = figure.add_subplot()
    lines: dict[tuple[Any, ...], list[int]] = {}
    for n in np.nonzero(is_good)[0].tolist():
        lines.setdefault(tuple(rows[name][n] for name in other_keys), []).append(n)
    for values, line in lines.items():
        label = ", ".join(
            f"{name} = {_text(v)}" for name, v in zip(other_keys, values, strict=True)
        )
        axes.plot(_places(rows[key][line]), rows[result][line], "o-", ms=4, label=label or None)
    if other_keys and len(lines) <= _NAMED:
        axes.legend(fontsize="small")
    n_failed = int((~is_good).sum())
    words = f"{result} of {title}" + (
        f"; {n_failed} of {len(rows)} cases failed" if n_failed else ""
    )
    axes.set(xlabel=key, ylabel=result)
    axes.set_title(words, fontsize="medium")
    axes.grid(True, alpha=0.3)
    finish_figure(figure, file, window=False)


def _places(values: NDArray[Any]) -> Any:
    """Numbers as they are; texts one beside the other."""
    return values if values.dtype.kind == "f" else [str(value) for value in values]


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


__all__ = ["draw_life", "draw_sweep", "plot_rates", "plot_spectrum", "plot_strength"]
