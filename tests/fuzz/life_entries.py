"""Lives and inspections of a run."""

import dataclasses
from functools import cache

import numpy as np

import xcrack as xc
from fuzz.entry import Entry, Hook, arg
from fuzz.kinds import Called, Filename, Number, Numbers, Of, Seen, Whole, Word, real
from support.growth_fakes import mode_I, plate
from xcrack.runs.rerating import block_of_run, driving_forces

LAW = xc.paris(1e-11, 3.0)


def _step(n):
    """Step n of an edge crack that grows by 3 a step, by the formula of an infinite plate."""
    problem = plate([xc.line_crack([(0.0, 0.37), (5.0 + 3.0 * n, 0.37)])])
    K = np.array(mode_I()(problem, 0))
    dK = K[:, 0]
    rate = np.asarray(LAW(dK, 0.0))
    factors = (0.0, 1.0)
    states = xc.Response.of_K(problem, factors, [factor * K for factor in factors]).sif
    values = {
        "angle": np.zeros(1),
        "dK_eq": dK,
        "R": np.zeros(1),
        "rate": rate,
        "da": np.full(1, 3.0),
    }
    parts = {name: (value,) for name, value in values.items()}
    return xc.Step(n, 1e4 * n, problem.placed, states, **parts, sizes=(5.0 + 3.0 * n,))


HISTORY = xc.History(tuple(_step(n) for n in range(5)), "max_steps")


@cache
def _pulled():
    """A run with its solutions."""
    loads = [xc.traction("top", (0.0, 1.0)), xc.traction("bottom", (0.0, -1.0))]
    strip = xc.box((0.0, -1.0), (1.0, 1.0), (6, 12))
    crack = xc.line_crack([(-0.1, 0.02), (0.2, 0.02)])
    scene = xc.Problem(strip, xc.Isotropic(1.0, 0.3, "strain"), [crack], loads=loads)
    law, cycle = xc.paris(1e-3, 3.0), xc.Cycle(0.0, 1.0)
    steps = xc.grow(scene, law, xc.max_hoop_stress, cycle, da=0.1, max_steps=2, progress=False)
    return xc.collect(steps)


SCATTER = xc.Scatter(C=xc.lognormal(0.3))
LIFE = xc.life(HISTORY, scatter=SCATTER, samples=200, seed=1)
CURVE = xc.growth_curve(HISTORY)
DISTRIBUTION = arg(
    Of(optional=True, type=xc.lognormal | xc.normal), None, xc.lognormal(0.1), xc.normal(0.1)
)
RUN = arg(
    Seen(rule=lambda v: None if isinstance(v, xc.History) and v is not HISTORY else v is HISTORY),
    HISTORY,
)

ANY = Numbers(rule=lambda x: True if x.ndim == 0 and abs(x) < 15 else None)
ZONE = xc.plastic_zone(400.0, 2)
POSITIVE = arg(Number(above=0, far=1e4), 1.0, 2)
FOLLOWS = arg(Seen(rule=lambda v: True if callable(v) else None), lambda a: 1.0 + 0.0 * a)
SPECTRUM = xc.Spectrum([0.0, 1.0, 0.4, 0.6])
FLIGHTS = xc.History(
    tuple(dataclasses.replace(step, levels=(0.0, 1.0)) for step in HISTORY.steps), "max_steps"
)
CONSTANTS = {"m": xc.normal(0.1)}
JOINT = {("C", "m"): -0.5}
MODEL = xc.wheeler(1.0, ZONE)
RATED = {"spectrum": SPECTRUM, "criterion": xc.max_hoop_stress, "nu": 0.3}


def _flights_of_the_law():
    """FLIGHTS with the rates that the law gives for its values of K."""
    block = block_of_run("life", RATED["spectrum"], RATED["criterion"], RATED["nu"], 0.0)
    ends = driving_forces(FLIGHTS.steps, block).rates(LAW)  # at both ends of each step
    steps = []
    for step, value in zip(FLIGHTS.steps, (*ends[:, 0], ends[-1, 1]), strict=True):
        rate = (np.full(1, value),)
        steps.append(dataclasses.replace(step, rate=rate, law_rate=rate))
    return xc.History(tuple(steps), "max_steps")


LAW_FLIGHTS = _flights_of_the_law()


def _empty(value):
    """None for a dict, which may be empty and then says nothing."""
    return None if isinstance(value, dict) else False


STRENGTH = xc.residual_strength(HISTORY, nu=0.3, K_c=2000.0)
LINE = xc.assessment_line(210e3, 355.0, 510.0)
FLAT = HISTORY.steps[0].sif[1][0]

ENTRIES = [
    Entry(
        "assessment_line",
        lambda E, sigma_y, sigma_u: xc.assessment_line(E, sigma_y, sigma_u),
        {
            "E": POSITIVE,
            "sigma_y": arg(Number(above=0, most=300), 200),
            "sigma_u": arg(Number(least=300), 400),
        },
    ),
    Entry("assessment_line", lambda L_r: LINE(L_r), {"L_r": arg(Numbers(least=0), 0.5)}),
    Entry(
        "assessment_line",
        lambda K_r, L_r: LINE.reserve(K_r, L_r),
        {"K_r": arg(Number(least=0), 0.5), "L_r": arg(Number(least=0), 0.5)},
    ),
    Entry(
        "residual_strength",
        lambda nu, K_c: xc.residual_strength(HISTORY, nu=nu, K_c=K_c)["by_toughness"],
        {"nu": arg(Number(above=-1, below=0.5), 0.3), "K_c": arg(Number(above=0), 2000.0)},
    ),
    Entry(
        "residual_strength",
        lambda history, line, collapse: xc.residual_strength(
            history, nu=0.3, K_c=2000.0, line=line, collapse=collapse
        )["by_toughness"],
        {
            "history": RUN,
            "line": arg(Of(optional=True, type=xc.assessment_line, rule=lambda v: None), None),
            "collapse": arg(Called(optional=True), None),
        },
        arity=False,
    ),
    Entry(
        "residual_strength",
        lambda yield_stress, resistance: xc.residual_strength(
            HISTORY, nu=0.3, K_c=2000.0, yield_stress=yield_stress, resistance=resistance
        )["factor"],
        {
            "yield_stress": arg(Number(optional=True, above=0), None, 300.0),
            "resistance": arg(Called(optional=True), None),
        },
        arity=False,
    ),
    Entry(
        "plot_strength",
        lambda strength, unit, file: xc.plot_strength(strength, unit=unit, file=file),
        {
            "strength": arg(Seen(rule=lambda v: v is STRENGTH), STRENGTH),
            "unit": arg(Word(rule=bool), "cycle"),
            "file": arg(Filename(rule=lambda v: None), "strength.png"),
        },
        in_folder=True,
        cost=0.5,
    ),
    Entry(
        "plot_spectrum",
        lambda spectrum, file: xc.plot_spectrum(spectrum, file=file),
        {
            "spectrum": arg(Of(type=xc.Spectrum), SPECTRUM),
            "file": arg(Filename(rule=lambda v: None), "spectrum.png"),
        },
        in_folder=True,
        cost=0.5,
    ),
    Entry(
        "geometry_factors",
        lambda history, stress: xc.geometry_factors(history, stress=stress)["beta"],
        {"history": RUN, "stress": arg(Number(above=0), 100.0)},
    ),
    Entry(
        "write_factors",
        lambda history, file, stress, crack, tip: xc.write_factors(
            history, file, stress=stress, crack=crack, tip=tip
        ),
        {
            "history": RUN,
            "file": arg(Filename(rule=lambda v: None), "beta.txt"),
            "stress": arg(Number(above=0), 100.0),
            "crack": arg(Whole(least=0, most=0), 0),
            "tip": arg(Whole(least=0, most=0), 0),
        },
        in_folder=True,
    ),
    Entry(
        "opening_load",
        lambda step: xc.opening_load(step).level[0],
        {"step": arg(Seen(rule=lambda v: v is FLIGHTS.steps[0]), FLIGHTS.steps[0])},
    ),
    Entry(
        "energy_release_rate",
        lambda sif, material: xc.energy_release_rate(sif, material),
        {
            "sif": arg(Seen(rule=lambda v: None if isinstance(v, xc.SIF) else False), FLAT),
            "material": arg(Of(type=xc.Isotropic), xc.Isotropic(2e5, 0.3, "strain")),
        },
    ),
    Entry("plastic_zone", xc.plastic_zone, {"sigma_y": POSITIVE, "beta": POSITIVE}),
    *(
        Entry(name, getattr(xc, name), {"function": FOLLOWS})
        for name in ("load_over_size", "load_over_cycles", "K_over_size")
    ),
    Entry(
        "K_gradient",
        xc.K_gradient,
        {"K": POSITIVE, "gradient": arg(Number(), -0.08, 0.0), "a0": arg(Number(), 0.0, 5.0)},
    ),
    Entry("plastic_zone", lambda K: ZONE(K), {"K": arg(Numbers(), 30.0)}),
    Entry("wheeler", xc.wheeler, {"w": POSITIVE, "zone": arg(Of(type=xc.plastic_zone), ZONE)}),
    Entry(
        "wheeler",
        lambda K, da: xc.wheeler(1.0, ZONE).factor(K, 30.0, da),
        {"K": arg(ANY, 15.0), "da": arg(ANY, 1e-4)},
    ),
    Entry(
        "willenborg",
        lambda shutoff, dK_th, zone: xc.willenborg(shutoff, dK_th, zone),
        {
            "shutoff": arg(Number(above=1), 2.5),
            "dK_th": arg(Number(least=0), 2.0),
            "zone": arg(Of(type=xc.plastic_zone), ZONE),
        },
    ),
    Entry(
        "willenborg",
        lambda K_min: xc.willenborg(2.5, 2.0, ZONE).reduction(K_min, 15.0, 30.0, 1e-4),
        {"K_min": arg(ANY, 1.5)},
    ),
    Entry(
        "retarded",
        lambda model, nu, max_blocks: (
            xc.retarded(FLIGHTS, LAW, SPECTRUM, model, nu=nu, max_blocks=max_blocks).life
        ),
        {
            "model": arg(
                Of(optional=True, type=xc.wheeler | xc.willenborg), None, xc.wheeler(1.0, ZONE)
            ),
            "nu": arg(Number(above=-1, below=0.5), 0.3),
            "max_blocks": arg(Number(above=0, far=1e4), 5, 20.0),
        },
    ),
    Entry(
        "retarded",
        lambda history, law, spectrum: (
            xc.retarded(history, law, spectrum, None, nu=0.3, max_blocks=5).life
        ),
        {
            "history": arg(
                Seen(
                    rule=lambda v: (
                        None if isinstance(v, xc.History) and v is not FLIGHTS else v is FLIGHTS
                    )
                ),
                FLIGHTS,
            ),
            "law": arg(Called(), LAW),
            "spectrum": arg(Of(type=xc.Spectrum), SPECTRUM),
        },
    ),
    Entry(
        "lognormal",
        xc.lognormal,
        {"sigma": arg(Number(least=0, most=100), 0.3), "median": arg(Number(above=0), 1.0, 5)},
    ),
    Entry(
        "normal",
        xc.normal,
        {
            "sigma": arg(Number(least=0, most=0.2), 0.1),
            "mean": arg(Number(rule=lambda v: v == 1 or None), 1.0),
        },
    ),
    Entry(
        "lognormal",
        lambda p: xc.lognormal(0.3).quantile(p) * xc.normal(0.1).quantile(p),
        {"p": arg(Numbers(rule=lambda p: bool(((p > 0) & (p < 1)).all())), 0.5)},
    ),
    Entry(
        "Scatter",
        lambda C, K, load, a0: xc.Scatter(C=C, K=K, load=load, a0=a0),
        {
            "C": arg(Of(type=xc.lognormal), xc.lognormal(0.1)),
            "K": DISTRIBUTION,
            "load": DISTRIBUTION,
            "a0": DISTRIBUTION,
        },
    ),
    Entry(
        "Scatter",
        lambda constants, correlation, n, seed: len(
            xc.Scatter(C=xc.normal(0.1), constants=constants, correlation=correlation).draw(
                n, seed
            )["C"]
        ),
        {
            "constants": arg(Seen(rule=lambda v: v is CONSTANTS or _empty(v)), CONSTANTS),
            "correlation": arg(Seen(rule=lambda v: v is JOINT or _empty(v)), JOINT),
            "n": arg(Whole(least=1, far=1e4), 5),
            "seed": arg(Whole(least=0), 3),
        },
    ),
    Entry(
        "life",
        lambda spectrum, criterion, nu, threshold: (
            xc.life(
                FLIGHTS,
                scatter=SCATTER,
                samples=200,
                seed=1,
                spectrum=spectrum,
                criterion=criterion,
                nu=nu,
                threshold=threshold,
            ).life
        ),
        {
            "spectrum": arg(Of(type=xc.Spectrum), SPECTRUM),
            "criterion": arg(Called(), xc.max_hoop_stress),
            "nu": arg(Number(above=-1, below=0.5), 0.3),
            "threshold": arg(Number(least=0), 0.0),
        },
        arity=False,
    ),
    Entry(
        "life",
        lambda retardation, max_blocks: (
            1
            / xc.life(
                LAW_FLIGHTS,
                LAW,
                scatter=SCATTER,
                samples=100,
                seed=1,
                retardation=retardation,
                max_blocks=max_blocks,
                **(RATED if retardation is not None else {}),
            ).life  # 1/inf: samples longer than max_blocks do not end
        ),
        {
            "retardation": arg(
                # Models of other zones may ask for more than is given.
                Seen(rule=lambda v: v is None or (None if isinstance(v, type(MODEL)) else False)),
                MODEL,
                None,
            ),
            "max_blocks": arg(Number(above=0, far=1e4), 2.0),
        },
        cost=0.5,
    ),
    Entry(
        "life",
        lambda history, **named: xc.life(history, **named),
        {
            "history": RUN,
            "law": arg(Called(optional=True), None, LAW),
            "unit": arg(Word(optional=True, rule=bool), "cycle", "flight"),
            "scatter": arg(Seen(rule=lambda v: v is SCATTER), SCATTER),
            "samples": arg(Whole(optional=True, least=100, far=1e4), 200),
            "seed": arg(Whole(least=0), 3),
        },
    ),
    Entry(
        "life",
        lambda p, N: (LIFE.percentile(p), LIFE.probability(N), LIFE.table())[0],
        {"p": arg(Number(least=0, most=100), 5), "N": arg(Number(least=0), 1e4)},
    ),
    Entry(
        "life",
        lambda kind: LIFE.plot(kind, "life.png"),
        {"kind": arg(Word(words=("cdf", "density")), "cdf")},
        cost=0.5,
        in_folder=True,
    ),
    Entry(
        "growth_curve",
        xc.growth_curve,
        {
            "history": RUN,
            "measure": arg(Word(optional=True, words=("advance", "length")), None, "length"),
        },
    ),
    Entry(
        "growth_curve",
        lambda crack: xc.growth_curve(HISTORY, measure="length", crack=crack),
        {"crack": arg(Whole(optional=True, least=0, most=0), None, 0)},
    ),
    Entry(
        "growth_curve",
        lambda a, N: CURVE.cycles_at(a) + CURVE.length_at(N),
        {"a": arg(Number(least=0), 7.0), "N": arg(Number(least=0), 1e4)},
    ),
    Entry(
        "inspection",
        lambda curve, interval: xc.inspection(curve, interval=interval),
        {
            "curve": RUN,
            "interval": arg(Number(above=0, rule=lambda v: True if v >= 1e3 else None), 1e4),
        },
    ),
    Entry(
        "inspection",
        lambda **named: xc.inspection(HISTORY, **named),
        {
            "a_critical": arg(
                Seen(
                    rule=lambda v: (
                        True
                        if v is None
                        else None
                        if real(v) is not None and 0 < real(v) < 1e300
                        else False
                    )
                ),
                None,
            ),
            "pod": arg(Called(optional=True), None),
            "a_detect": arg(Number(least=5, below=17), 8.0),
            "factor": arg(Number(least=1), 3),
            "measure": arg(Word(optional=True, words=("advance", "length")), None, "length"),
        },
    ),
    Entry(
        "logistic_pod",
        xc.logistic_pod,
        {"a50": arg(Number(above=0), 2.0), "s": arg(Number(above=0), 0.4)},
    ),
    Entry("logistic_pod", lambda a: xc.logistic_pod(2.0, 0.4)(a), {"a": arg(Numbers(least=0), 3)}),
    Entry(
        "History",
        lambda law: HISTORY.rerate(law).life,
        {"law": arg(Called(), LAW)},
    ),
    Entry(
        "History",
        lambda load: HISTORY.rerate(LAW, load=load).life,
        {"load": arg(Called(optional=True), None)},
    ),
    Entry(
        "History",
        lambda K_c: _pulled().load_at(K_c)["force"],
        {"K_c": arg(Number(above=0), 500.0)},
    ),
]
HOOKS = [
    Hook(
        "inspection",
        lambda f: xc.inspection(HISTORY, a_detect=8.0, pod=f).interval,
        xc.logistic_pod(8.0, 0.4),
        Number(least=0, most=1),
        "probability of detection",
    ),
]
