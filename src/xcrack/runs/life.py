"""A life with an error bar."""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from xcrack.base.arguments import Choice, FileName, check_arguments
from xcrack.base.arrays import Floats, lock
from xcrack.base.checks import number, value_text, whole_number
from xcrack.base.errors import ProblemError, warn
from xcrack.fatigue.criteria import Criterion
from xcrack.fatigue.law import Law
from xcrack.fatigue.retardation import Retardation
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.validity import validity
from xcrack.runs.history import History
from xcrack.runs.rerating import (
    DrivingForce,
    SpectrumBlock,
    block_of_run,
    bound_of_shares,
    check_block,
    cycles_of,
    driving_forces,
)
from xcrack.runs.retarded import RetardedLives
from xcrack.runs.scatter import Scatter, lives, varied_law

_SAMPLES, _FEW = 100_000, 200
_ENDS = (0.05, 0.95)
_MOST = 0.05  # change of shares of the advance, beyond which the path would differ
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
        Numerical errors as shares of the life: ``steps``, ``K``, under a spectrum ``levels`` (of K
        between solved factors), of several tips ``tips`` (other shares of the advance); they are
        bounds, not samples.
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

    @check_arguments()
    def plot(
        self,
        kind: Annotated[str, Choice(("cdf", "density"))] = "cdf",
        file: FileName | None = None,
    ) -> Any:
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
        from xcrack.view.lives import draw_life

        return draw_life(self, kind, file)

    def __str__(self) -> str:
        N_5, N_50, N_95 = (self.percentile(p) for p in (5, 50, 95))
        lines = [
            f"life {self.life:.4g} {self.unit}s; median {N_50:.4g}, 90 % of {len(self.N)} "
            f"samples from {N_5:.4g} to {N_95:.4g}"
        ]
        for name, (least_life, largest_life) in self.scatter.items():
            lines.append(f"  {name} alone: from {least_life:.4g} to {largest_life:.4g}")
        for name, share in self.bounds.items():
            bound = f"at most {share:.2%} of the life (a bound)" if share == share else "not known"
            lines.append(f"  error of {name}: {bound}")
        return "\n".join(lines)


def life(
    history: History,
    law: Law | None = None,
    *,
    scatter: Scatter,
    samples: int | None = None,
    seed: int,
    unit: str | None = None,
    spectrum: Spectrum | None = None,
    criterion: Criterion | None = None,
    nu: float | None = None,
    threshold: float = 0.0,
    retardation: Retardation | None = None,
    max_blocks: float = 1e6,
) -> Life:
    """Lives of many samples on the path of one run.

    The run is not repeated: its steps are integrated again with the rates of each sample. That is
    exact for a factor on the rate, and for the others as good as `History.rerate` where one tip
    grows, or all tips alike.

    Parameters
    ----------
    history : History
    law : callable, optional
        Law of the run: needed where K, load or a constant varies, and for the bound of K.
    scatter : Scatter
    samples : int, optional
        At least 100; 100 000 if omitted, with retardation 200.
    seed : int
        Of the draw.
    unit : str, optional
        What a cycle is called; if omitted, that of the spectrum, or "cycle".
    spectrum, criterion, nu, threshold : optional
        Of a run under a spectrum, as it had them: needed where the law is.
    retardation : wheeler or willenborg, optional
        Each sample goes cycle by cycle along the path then, as `retarded` does: an overload makes
        another life of twice the rate than half of it.
    max_blocks : float
        With retardation: samples that are longer are taken not to end.

    Returns
    -------
    Life

    Raises
    ------
    ProblemError
        A law or a spectrum that is not that of the run, or none where one is needed; load that
        varies where K is not in proportion to it; a constant that the law does not have; a sampled
        a0 below the first crack (more than a hundredth of the samples), or with several tips;
        several tips that would have shared the advance another way by more than 5 %.

    Warns
    -----
    XcrackWarning
        Linear elasticity does not hold from some cycle on: a step with its solutions says so, where
        the material has a yield stress.

    Notes
    -----
    Sources "steps" and "K": those of `History.life_bar` where the run estimated them, contact and
    rates without a bar in that of K. Else "steps" is a third of the difference to the life from
    every second step (Richardson, second order), and "K" the life with all K larger and smaller by
    their spread over two domains.
    Source "levels": a third of the difference to the life with every second level of a spectrum;
    0 where its factors were solved, or K is in proportion to them. Source "tips": how the shares of
    the advance of several tips change for the 5 and 95 % samples of each source alone. Samples are
    those of `Scatter.draw`. With K or load under a spectrum the law is asked at 257 factors, with a
    power of the factor between them; for constants of the law it is asked for each sample.
    """
    if not isinstance(history, History):
        raise ProblemError(f"life: history = {value_text(history)}: give a History.")
    if not isinstance(scatter, Scatter):
        raise ProblemError(f"life: scatter = {value_text(scatter)}: give Scatter(C=...).")
    if not (law is None or callable(law)):
        raise ProblemError(f"life: law = {value_text(law)} cannot be called: give a law.")
    if not (unit is None or (isinstance(unit, str) and unit)):
        raise ProblemError(f"life: unit = {value_text(unit)}: give a word, such as 'flight'.")
    sample_count = (_SAMPLES if retardation is None else _FEW) if samples is None else samples
    n = whole_number(sample_count, "life: samples", least=100, most=10_000_000)
    block = block_of_run("life", spectrum, criterion, nu, threshold)
    limit = number(max_blocks, "life: max_blocks", above=0)
    _warn_of_validity(history)
    if retardation is not None:
        retarded_lives = RetardedLives(history, law, block, retardation, limit)
        return _retarded_lives(retarded_lives, history, law, scatter, block, n, seed, unit)
    rows = _rows(history, law, scatter, block)
    lead = rows.lead
    drawn_samples = scatter.draw(n, seed)
    if "a0" in drawn_samples:
        drawn_samples["a0"] = _checked_sizes(lead, drawn_samples["a0"])
    bounds = _bounds(history, rows, law, scatter, block)
    N = np.sort(lives(lead, law, drawn_samples, n))
    bounds_by_part = {
        name: _ends(lives(lead, law, {name: values}, n)) if len(drawn_samples) > 1 else _ends(N)
        for name, values in drawn_samples.items()
    }
    word = unit or ("cycle" if block is None else block.spectrum.unit)
    return Life(lock(N + history.steps[0].cycles), history.life, bounds_by_part, bounds, word)


def _warn_of_validity(history: History) -> None:
    """Say from which cycle on linear elasticity does not hold, where the yield stress is known."""
    for step in history.solved:
        if not step.solutions:
            continue
        problem = step.solutions[0].problem
        if problem.elasticity.material.yield_stress is None:
            continue
        mesh = problem.mesh
        check = validity(problem.elasticity.material, mesh, step.cracks, step.sif, step.solutions)
        alarms = [] if check is None else check.alarms()
        if alarms:
            share = 1 - step.cycles / history.life if history.life > 0 else 1.0
            warn(
                f"life: from N = {step.cycles:.6g} on, {share:.2%} of the life, linear elasticity "
                f"does not hold: {alarms[0]}"
            )
            return


def _bounds(
    history: History,
    rows: DrivingForce,
    law: Law | None,
    scatter: Scatter,
    block: SpectrumBlock | None,
) -> dict[str, float]:
    """Numerical errors as shares of the life, by source."""
    lead, bar = rows.lead, history.life_bar
    has_bar = np.isfinite(bar.steps) and bar.life > 0
    bounds = {"steps": bar.steps / bar.life if has_bar else _of_steps(lead)}
    if np.isfinite(bar.K) and bar.life > 0:
        bounds["K"] = (bar.K + bar.contact + bar.unknown) / bar.life
    if law is None or (block is None and history.steps[0].levels):
        return bounds
    bounds.setdefault("K", _of_K(lead, law))
    if not rows.is_one_tip or len(rows.step) > len(lead.step):
        bounds["tips"] = _of_tips(rows, law, scatter)
    if block is not None:
        bounds["levels"] = _of_levels(history, lead, law, block)
    return bounds


def _retarded_lives(
    retarded_lives: RetardedLives,
    history: History,
    law: Law | None,
    scatter: Scatter,
    block: SpectrumBlock | None,
    n: int,
    seed: int,
    unit: str | None,
) -> Life:
    """Life of samples that go cycle by cycle."""
    if scatter.a0 is not None:
        raise ProblemError(
            "life: a0 varies: with retardation each first crack is a run of its own."
        )
    _rows(history, law, scatter, block)
    samples = scatter.draw(n, seed)
    N = np.sort(retarded_lives.lives(samples, n))
    bounds_by_part = {
        name: _ends(retarded_lives.lives({name: values}, n)) if len(samples) > 1 else _ends(N)
        for name, values in samples.items()
    }
    bounds = {"steps": float("nan"), "K": retarded_lives.of_K()}
    word = unit or retarded_lives.unit
    return Life(lock(N), retarded_lives.life, bounds_by_part, bounds, word)


def _rows(
    history: History, law: Law | None, scatter: Scatter, block: SpectrumBlock | None
) -> DrivingForce:
    """Places of the run, where the law and the spectrum are those that it had."""
    missing_names = set(scatter.parts) - {"C", "a0"}
    if law is None:
        if missing_names:
            raise ProblemError(
                f"life: {', '.join(sorted(missing_names))} varies: give the law of the run."
            )
        return driving_forces(history.steps)
    if missing_names or block is not None:
        check_block(history.steps, block, law, "life")
    rows = driving_forces(history.steps, block)
    if (block is not None or not history.steps[0].levels) and not np.allclose(
        rows.rates(law), rows.rate, rtol=_SAME, atol=0
    ):
        raise ProblemError(
            "life: the law gives other rates than those of the run: give the law that it had, and "
            "its spectrum, or take history.rerate(law)."
        )
    if block is not None and "load" in missing_names and not _is_proportional(history, block):
        raise ProblemError(
            "life: load varies, but K of this run is not in proportion to it: it has steady loads "
            "or initial stress. Run it with other loads, Spectrum.scaled, to see what they do."
        )
    for name in scatter.constants:
        varied_law(law, {name: 1.0})
    return rows


def _is_proportional(history: History, block: SpectrumBlock) -> bool:
    has_own_levels = block.spectrum.states is not None or block.spectrum.levels != "auto"
    return not block.spectrum.steady and (has_own_levels or len(history.steps[0].levels) <= 2)


def _checked_sizes(lead: DrivingForce, sizes: Floats) -> Floats:
    if len(np.unique(lead.place, axis=0)) > 1 or not lead.is_one_tip:
        raise ProblemError(
            "life: a0 varies, but several tips drive the run: its path belongs to the cracks "
            "that it began with. Run it for other cracks."
        )
    first = float(lead.a[0, 0])
    share_below = float((sizes < first).mean())
    if share_below > 0.01:
        raise ProblemError(
            f"life: {share_below:.1%} of the samples of a0 are below {first:.6g}, the first crack "
            "of the run: begin the run with a smaller crack."
        )
    return np.maximum(sizes, first)


def _ends(N: Floats) -> tuple[float, float]:
    lower_quantile, upper_quantile = np.quantile(N, _ENDS, method="inverted_cdf")
    return float(lower_quantile), float(upper_quantile)


def _of_steps(lead: DrivingForce) -> float:
    """A third of what every second step adds, as a share; nan where one place does not last."""
    if len(lead.step) < 4 or not lead.is_one_tip or not np.isfinite(lead.rate).all():
        return float("nan")
    n = len(lead.step) // 2 * 2
    a = np.stack([lead.a[0:n:2, 0], lead.a[1:n:2, 1]], axis=1)
    rate = np.stack([lead.rate[0:n:2, 0], lead.rate[1:n:2, 1]], axis=1)
    whole_run = float(cycles_of(lead.a[:n], lead.rate[:n]).sum())
    return abs(float(cycles_of(a, rate).sum()) - whole_run) / 3 / whole_run


def _change_of_life(lead: DrivingForce, rate: Floats) -> float:
    """Share by which the life is another one with other rates."""
    blocks = lead.cycles / cycles_of(lead.a, lead.rate)
    nominal_life = float(lead.cycles.sum())
    return abs(float((cycles_of(lead.a, rate) * blocks).sum()) - nominal_life) / nominal_life


def _of_K(lead: DrivingForce, law: Law) -> float:
    """Largest change of the life with all K larger or smaller by their spread."""
    return max(_change_of_life(lead, lead.rates(law, 1.0 + s * lead.spread)) for s in (-1.0, 1.0))


def _of_levels(history: History, lead: DrivingForce, law: Law, block: SpectrumBlock) -> float:
    """A third of the change of the life with every second level left out."""
    if all(block.is_solved(step) for step in history.steps):
        return 0.0
    coarse_lead = driving_forces(history.steps, replace(block, is_thinned=True)).lead
    return _change_of_life(lead, coarse_lead.rates(law)) / 3


def _of_tips(rows: DrivingForce, law: Law, scatter: Scatter) -> float:
    """Largest change of shares of the advance, of the 5 and 95 % samples of each source alone."""
    cycles, largest_bound = rows.cycles[rows.step[rows.is_driving]], 0.0
    for name, part in scatter.parts.items():
        if name in ("C", "a0"):
            continue
        for value in (float(part.quantile(p)) for p in _ENDS):
            is_own_constant = name in scatter.constants
            rate = (
                rows.rates(varied_law(law, {name: value}))
                if is_own_constant
                else rows.rates(law, value)
            )
            largest_bound = max(largest_bound, bound_of_shares(rows, rate[:, 0], cycles))
    if largest_bound > _MOST:
        raise ProblemError(
            f"life: some samples would have shared the advance of the tips another way, by "
            f"{largest_bound:.1%} in the mean (more than {_MOST:.0%}): the path would differ. "
            "Run them as cases of a campaign."
        )
    return largest_bound


__all__ = ["Life", "life"]
