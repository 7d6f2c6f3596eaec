"""Picture of growth laws: da/dN over ΔK."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np

from xcrack.base.arguments import FileName, Number, Text, check_arguments
from xcrack.base.checks import numbers
from xcrack.base.errors import ProblemError
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.metals import Metal
from xcrack.fatigue.units import Units
from xcrack.view.figures import finish_figure, new_figure, picture_path

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
    low, high = (k * 1e6 / system.K for k in _RANGE) if dK is None else _limits(dK)
    ranges = np.geomspace(low, high, 200)
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
    low, high = numbers(dK, "plot_rates: dK", (2,)).tolist()
    if not 0 < low < high:
        raise ProblemError(f"plot_rates: dK = ({low:g}, {high:g}): give (lowest, highest) above 0.")
    return low, high


def _named_laws(laws: Any, units: str) -> dict[str, Any]:
    if isinstance(laws, Mapping):
        return {str(name): law for name, law in laws.items()}
    if not isinstance(laws, Sequence) or not all(isinstance(metal, Metal) for metal in laws):
        raise ProblemError(
            "plot_rates: laws: give a mapping of names to laws, or a list of metals of xc.material."
        )
    others = [metal.name for metal in laws if metal.units != units]
    if others:
        raise ProblemError(
            f"plot_rates: {others[0]!r} is not in {units!r}: give all metals in the units drawn."
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
        good = np.isfinite(rate) & (rate > 0)
        if good.any():
            curves[name] = np.where(good, rate, np.nan)
    if not curves:
        hint = f" ({reasons[0]})" if reasons else ""
        raise ProblemError(
            f"plot_rates: no law grows at R = {R:g} in this range{hint}: give others, or another R."
        )
    return curves


__all__ = ["plot_rates"]
