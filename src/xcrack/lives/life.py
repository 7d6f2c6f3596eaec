"""A life with an error bar."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xcrack.arrays import Floats, lock
from xcrack.errors import ProblemError
from xcrack.history.driving import Driving, cycles_of, driving
from xcrack.history.history import History
from xcrack.inputs import number, shown, whole
from xcrack.laws.law import Law
from xcrack.lives.scatter import Scatter

_CHUNK = 2_000_000  # samples times steps at once
_SAME = 1e-6  # relative: rates of a law that are those of the run


@dataclass(frozen=True, eq=False)
class Life:
    """Lives of many samples, and what of their width comes from where.

    Attributes
    ----------
    N : (n,) array
        Cycles of the samples, rising; inf for those that do not grow.
    life : float
        Of the run itself.
    scatter : dict of str to (float, float)
        Lives between which 90 % of the samples lie if one source alone varies, by its name.
    bounds : dict of str to float
        Numerical errors as shares of the life: ``steps`` and ``K``; they are bounds, not samples.
    unit : str
    """

    N: Floats
    life: float
    scatter: dict[str, tuple[float, float]]
    bounds: dict[str, float]
    unit: str

    def percentile(self, p: float) -> float:
        """Cycles that p per cent of the samples do not reach.

        Parameters
        ----------
        p : float
            In [0, 100].
        """
        p = number(p, "Life.percentile: p", least=0, most=100)
        return float(np.quantile(self.N, p / 100, method="inverted_cdf"))

    def probability(self, N: float) -> float:
        """Share of the samples that end within N cycles.

        Parameters
        ----------
        N : float
            Not negative.
        """
        N = number(N, "Life.probability: N", least=0)
        return float(np.searchsorted(self.N, N, side="right") / len(self.N))

    def table(self) -> NDArray[Any]:
        """Percentiles: columns percent and N."""
        levels = (0.1, 1, 5, 10, 25, 50, 75, 90, 95, 99)
        rows = [(p, self.percentile(p)) for p in levels]
        return np.array(rows, dtype=[("percent", float), ("N", float)])

    def plot(self, kind: str = "cdf", file: str | Path | None = None) -> Any:
        """Draw the lives.

        Parameters
        ----------
        kind : {"cdf", "density"}
            Share that has ended over cycles, or how many end where.
        file : path, optional
            File to save the figure to; if omitted, the figure is shown.

        Returns
        -------
        matplotlib figure
        """
        from xcrack.plotting.lives import draw_life

        return draw_life(self, kind, file)

    def __str__(self) -> str:
        low, middle, high = (self.percentile(p) for p in (5, 50, 95))
        lines = [
            f"life {self.life:.4g} {self.unit}s; median {middle:.4g}, 90 % of {len(self.N)} "
            f"samples from {low:.4g} to {high:.4g}"
        ]
        for name, (least, most) in self.scatter.items():
            lines.append(f"  {name} alone: from {least:.4g} to {most:.4g}")
        for name, share in self.bounds.items():
            lines.append(f"  error of {name}: at most {share:.2%} of the life (a bound)")
        return "\n".join(lines)


def life(
    history: History,
    law: Law | None = None,
    *,
    scatter: Scatter,
    samples: int = 100_000,
    seed: int,
    unit: str = "cycle",
) -> Life:
    """Lives of many samples on the path of one run.

    The run is not repeated: its steps are integrated again with the rates of each sample. That is
    exact for a factor on the rate, and for the others as good as `History.rerate` where one tip
    grows, or all tips alike.

    Parameters
    ----------
    history : History
    law : callable, optional
        Law of the run: needed where K or load varies, and for the bound of K.
    scatter : Scatter
    samples : int
        At least 100.
    seed : int
        Of the draw.
    unit : str
        What a cycle is called.

    Returns
    -------
    Life

    Raises
    ------
    ProblemError
        A law that is not that of the run, or none where one is needed; K or load that varies
        under a spectrum; a sampled a0 below the first crack (more than a hundredth of the samples),
        or with several tips.

    Notes
    -----
    Source "steps": a third of the difference to the life from every second step (Richardson, second
    order). Source "K": the life with all K larger and smaller by their spread over two domains.
    Samples are drawn by ranks evenly spread over each distribution (Latin hypercube, McKay, Beckman
    and Conover 1979), so percentiles of one source alone are exact to the number of samples.
    """
    if not isinstance(history, History):
        raise ProblemError(f"life: history = {shown(history)}: give a History.")
    if not isinstance(scatter, Scatter):
        raise ProblemError(f"life: scatter = {shown(scatter)}: give Scatter(C=...).")
    if not (law is None or callable(law)):
        raise ProblemError(f"life: law = {shown(law)} cannot be called: give a law.")
    if not isinstance(unit, str) or not unit:
        raise ProblemError(f"life: unit = {shown(unit)}: give a word, such as 'flight'.")
    n = whole(samples, "life: samples", least=100, most=10_000_000)
    rows = driving(history.steps)
    lead = _lead(rows)
    _check_law(rows, law, scatter, bool(history.steps[0].levels))
    draw = np.random.default_rng(whole(seed, "life: seed", least=0))
    given = {
        name: part
        for name in ("C", "K", "load", "a0")
        if (part := getattr(scatter, name)) is not None
    }
    drawn = {name: part.quantile(_ranks(draw, n)) for name, part in given.items()}
    if "a0" in drawn:
        drawn["a0"] = _checked_sizes(lead, drawn["a0"])
    N = np.sort(_lives(lead, law, drawn, n))
    alone = {
        name: _ends(_lives(lead, law, {name: values}, n)) if len(drawn) > 1 else _ends(N)
        for name, values in drawn.items()
    }
    bounds = {"steps": _of_steps(lead)}
    if law is not None and not history.steps[0].levels:
        bounds["K"] = _of_K(lead, law)
    return Life(lock(N + history.steps[0].cycles), history.life, alone, bounds, unit)


def _lead(rows: Driving) -> Driving:
    """The driving place of each step only."""
    parts = {
        name: getattr(rows, name)[rows.drives]
        for name in ("step", "drives", "place", "da", "a", "dK", "R", "rate", "size", "spread")
    }
    return Driving(**parts, cycles=rows.cycles[rows.step[rows.drives]])


def _check_law(rows: Driving, law: Law | None, scatter: Scatter, spectrum: bool) -> None:
    needs = scatter.K is not None or scatter.load is not None
    if spectrum and needs:
        raise ProblemError(
            "life: the steps of a spectrum have the largest cycle only: of its samples C and a0 "
            "can vary. Run the spectrum with other loads, Spectrum.scaled, to see what they do."
        )
    if law is None:
        if needs:
            raise ProblemError("life: K or load varies: give the law of the run.")
        return
    if not spectrum and not np.allclose(rows.rates(law), rows.rate, rtol=_SAME, atol=0):
        raise ProblemError(
            "life: the law gives other rates than those of the run: give the law that it had, or "
            "take history.rerate(law)."
        )


def _ranks(draw: np.random.Generator, n: int) -> Floats:
    """Evenly spread shares in (0, 1), one in each of n parts, in random order."""
    return np.asarray((draw.permutation(n) + draw.random(n)) / n)


def _checked_sizes(lead: Driving, sizes: Floats) -> Floats:
    if len(np.unique(lead.place, axis=0)) > 1 or not lead.is_one_tip:
        raise ProblemError(
            "life: a0 varies, but several tips drive the run: its path belongs to the cracks "
            "that it began with. Run it for other cracks."
        )
    first = float(lead.a[0, 0])
    below = float((sizes < first).mean())
    if below > 0.01:
        raise ProblemError(
            f"life: {below:.1%} of the samples of a0 are below {first:.6g}, the first crack of the "
            "run: begin the run with a smaller crack."
        )
    return np.maximum(sizes, first)


def _lives(lead: Driving, law: Law | None, drawn: dict[str, Floats], n: int) -> Floats:
    """Cycles of each sample `(n,)`."""
    stretch = drawn.get("K", np.ones(1)) * drawn.get("load", np.ones(1))
    if law is None or not ({"K", "load"} & set(drawn)):
        stretch = np.ones(1)
    size = drawn.get("a0")
    count = n if size is not None or len(stretch) > 1 else 1
    N = np.empty(count)
    steps = len(lead.step)
    for begin in range(0, count, max(1, _CHUNK // steps)):
        part = slice(begin, begin + max(1, _CHUNK // steps))
        factor = stretch[part] if len(stretch) > 1 else stretch
        rate = _stretched(lead, law, factor)
        N[part] = _integrated(lead, rate, None if size is None else size[part])
    return np.broadcast_to(N / drawn.get("C", np.ones(1)), (n,)).copy()


def _stretched(lead: Driving, law: Law | None, factor: Floats) -> Floats:
    """Rates `(m, steps, 2)` with K times a factor `(m,)`."""
    if law is None or (len(factor) == 1 and factor[0] == 1):
        return lead.rate[None]
    m = len(factor)
    wide = Driving(
        **{
            name: np.broadcast_to(getattr(lead, name), (m, *lead.dK.shape))
            for name in ("a", "R", "rate", "size", "spread")
        },
        dK=lead.dK * factor[:, None, None],
        **{name: getattr(lead, name) for name in ("step", "drives", "place", "da", "cycles")},
    )
    return wide.rates(law)


def _integrated(lead: Driving, rate: Floats, size: Floats | None) -> Floats:
    """Cycles over all steps by some rates, in proportion to those that the run counted."""
    a = np.broadcast_to(lead.a, rate.shape)
    counted = lead.cycles / cycles_of(lead.a, lead.rate)
    if size is not None:
        a, rate = _from(a, rate, size)
    since = cycles_of(a, rate) * counted
    broken = np.isinf(rate[..., 0]) | np.isinf(rate[..., 1])
    later = np.cumsum(broken, axis=-1) - broken > 0  # steps after the toughness was reached
    return np.asarray(np.where(later, 0.0, since).sum(axis=-1))


def _from(a: Floats, rate: Floats, size: Floats) -> tuple[Floats, Floats]:
    """Steps cut where a crack of some size begins, at the rate that the power law has there."""
    first = np.clip(size[:, None], a[..., 0], a[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(rate[..., 1] / rate[..., 0]) / np.log(a[..., 1] / a[..., 0])
        begin = rate[..., 0] * (first / a[..., 0]) ** power
    begin = np.where(np.isfinite(begin), begin, rate[..., 0])
    begin, end, last = np.broadcast_arrays(begin, rate[..., 1], a[..., 1])
    return np.stack([first, last], axis=-1), np.stack([begin, end], axis=-1)


def _ends(N: Floats) -> tuple[float, float]:
    low, high = np.quantile(N, [0.05, 0.95], method="inverted_cdf")
    return float(low), float(high)


def _of_steps(lead: Driving) -> float:
    """A third of what every second step adds, as a share; nan where one place does not last."""
    if len(lead.step) < 4 or not lead.is_one_tip or not np.isfinite(lead.rate).all():
        return float("nan")
    n = len(lead.step) // 2 * 2
    a = np.stack([lead.a[0:n:2, 0], lead.a[1:n:2, 1]], axis=1)
    rate = np.stack([lead.rate[0:n:2, 0], lead.rate[1:n:2, 1]], axis=1)
    whole_run = float(cycles_of(lead.a[:n], lead.rate[:n]).sum())
    return abs(float(cycles_of(a, rate).sum()) - whole_run) / 3 / whole_run


def _of_K(lead: Driving, law: Law) -> float:
    """Largest change of the life with all K larger or smaller by their spread."""
    counted = lead.cycles / cycles_of(lead.a, lead.rate)
    N = []
    for sign in (-1.0, 1.0):
        rate = lead.rates(law, 1.0 + sign * lead.spread)
        N.append(float((cycles_of(lead.a, rate) * counted).sum()))
    nominal = float(lead.cycles.sum())
    return max(abs(each - nominal) for each in N) / nominal


__all__ = ["Life", "life"]
