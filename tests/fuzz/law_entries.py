"""Growth laws and their parts: closures, thresholds, tables, published constants."""

import tempfile

import numpy as np

import xcrack as xc
from fuzz.entry import Entry, arg
from fuzz.kinds import Called, Number, Numbers, Of, Seen, Word, array, real

POSITIVE = arg(Number(above=0), 1.0, 2)
AT_LEAST_0 = arg(Number(least=0), 0.0, 0.5)
REAL = arg(Number(), 0.3, -1)
RATIO = arg(Word(optional=True, words=("contact", "nominal")), None, "nominal")
K_c = arg(Number(optional=True, above=0), None, 60.0)
NEWMAN = xc.newman_closure(2.0, 0.3)
NASGRO4 = xc.nasgro4_threshold(dK1=0.8, C_th_plus=2.2, C_th_minus=0.1, a0=38.1e-6, R_clip=0.7)
NASGRO3 = xc.nasgro3_threshold(dK0=2.0, C_th=0.1, a0=0.0)
PAIRS = {
    0.1: ([10.0, 20.0], [1e-8, 1e-7]),
    0.5: ([7.5, 15.0], [1e-8, 1e-7]),
}
CURVES = {
    "falling": lambda: {0.1: ([20, 10], [1e-8, 1e-7])},
    "one point": lambda: {0.1: ([10], [1e-8])},
    "crossing": lambda: {0.1: ([10, 20], [1e-8, 1e-7]), 0.5: ([75, 150], [1e-8, 1e-7])},
    "no pair": lambda: {0.1: [1, 2, 3]},
    "texts": lambda: {"a": ([10, 20], [1e-8, 1e-7])},
    "R above 1": lambda: {1.5: ([10, 20], [1e-8, 1e-7])},
    "nan": lambda: {0.1: ([10, np.nan], [1e-8, 1e-7])},
    "negative": lambda: {0.1: ([-10, 20], [1e-8, 1e-7])},
}


def bounds(value):
    """Whether a value is a pair in order, or left out."""
    x = array(value)
    if value is None:
        return True
    return x is not None and x.shape == (2,) and bool(np.isfinite(x).all() and x[0] < x[1])


def ratios(highest=1.0, lowest=-1e3):
    """Kind of R: far below 0 no table goes."""
    return Numbers(
        rule=lambda R: bool((R <= highest).all()) and (bool((R >= lowest).all()) or None)
    )


def _drawn(**arguments):
    with tempfile.TemporaryDirectory() as folder:
        return xc.plot_rates(**arguments, file=f"{folder}/rates.png")


def _of_metal(metal, plane, thickness, E, nu):
    """What the methods of a metal return, and its text."""
    material = metal.isotropic(plane, thickness=thickness, E=E, nu=nu)
    law = metal.law(thickness=thickness)
    needs = {"a": 10.0} if getattr(law, "needs", ()) else {}
    return [material.E, len(str(metal)), float(law(1.0, 0.1, **needs))]


R_RANGE = arg(Seen(rule=bounds), None, (-1.0, 0.8))
THRESHOLD = arg(
    Of(optional=True, type=xc.klesnil_lukas | xc.stepped_threshold | xc.el_haddad),
    None,
    xc.klesnil_lukas(6.0, 0.5),
)
COMMON = {"ratio": RATIO, "R_range": R_RANGE}
WAY = arg(
    Seen(
        rule=lambda v: True if isinstance(v, str) and v == "cut" else None if approach(v) else False
    ),
    "cut",
)
SHAPE = {"threshold": THRESHOLD, "approach": WAY, "K_c": K_c, **COMMON}
RANGES = arg(Numbers(least=0.0, rule=lambda x: x.ndim == 0 or None), 10.0, [20.0])
RATES = {
    "dK_eq": RANGES,
    "R": arg(
        Numbers(most=1.0, rule=lambda R: True if R.ndim == 0 and -1 <= R <= 0.7 else None), 0.1
    ),
}
SIZE = arg(
    Numbers(rule=lambda a: bool((a > 0).all()) and (a.ndim == 0 or None)),
    1e-3,
    words=["crack size"],
)


def _unstable(rate):
    """Rates with 0 for inf, by which laws say that the toughness is reached."""
    rate = np.asarray(rate)
    return np.where(np.isinf(rate), 0.0, rate)


def _called(made):
    return lambda **named: _unstable(made(**named))


def approach(value):
    """Whether a value is a way to a threshold."""
    if isinstance(value, str):
        return value in ("cut", "difference")
    x = real(value)
    return x is not None and 0 < x <= 1e300


def curves(value):
    """Whether a value is curves: of none of the general ones is more known."""
    return False


UNITS = Word(words=("m, MPa√m", "mm, N/mm^1.5", "mm, MPa√mm"))
KNOWN = tuple(xc.presets())
METALS = ("2024-T3 sheet, L-T", "7075-T651 plate, L-T")

ENTRIES = [
    Entry(
        "linear_closure",
        xc.linear_closure,
        {
            "a": REAL,
            "b": REAL,
            "R_range": arg(Seen(rule=lambda v: None if v is None else bounds(v)), (-0.1, 0.7)),
        },
    ),
    Entry(
        "linear_closure",
        lambda R: xc.linear_closure(0.5, 0.4, (-0.1, 0.7))(R),
        {"R": arg(Numbers(least=-0.1, most=0.7), 0.1)},
    ),
    Entry("schijve_closure", xc.schijve_closure, {"a": REAL, "b": REAL, "c": REAL}),
    Entry(
        "schijve_closure",
        lambda R: xc.schijve_closure(0.55, 0.33, 0.12)(R),
        {"R": arg(Numbers(least=-1, most=1), 0.1)},
    ),
    Entry(
        "newman_closure",
        xc.newman_closure,
        {"alpha": arg(Number(least=1, most=6), 2.0), "S": arg(Number(above=0, most=1), 0.3)},
    ),
    Entry("newman_closure", lambda R: NEWMAN(R), {"R": arg(ratios(), 0.1, [0.0, 1.0])}),
    Entry("newman_closure", lambda R: NEWMAN.f(R), {"R": arg(ratios(), 0.1)}),
    Entry(
        "klesnil_lukas",
        xc.klesnil_lukas,
        {"dK0": POSITIVE, "gamma": arg(Number(least=0, most=1), 0.5)},
    ),
    Entry("klesnil_lukas", lambda R: xc.klesnil_lukas(6.0, 0.5)(R), {"R": arg(ratios(), 0.1)}),
    Entry(
        "stepped_threshold",
        xc.stepped_threshold,
        {
            "R": arg(Numbers((2,), rule=lambda x: bool(x[0] < x[1])), (0, 0.5)),
            "dK": arg(Numbers((3,), rule=lambda x: bool((x > 0).all())), (170, 170, 63)),
            "slope": arg(Number(least=0), 214),
        },
    ),
    Entry(
        "stepped_threshold",
        lambda R: xc.stepped_threshold((0, 0.5), (170, 170, 63), 214)(R),
        {"R": arg(ratios(), 0.1)},
    ),
    Entry(
        "el_haddad",
        xc.el_haddad,
        {
            "long": arg(
                Of(type=xc.klesnil_lukas | xc.stepped_threshold), xc.klesnil_lukas(6.0, 0.0)
            ),
            "a0": POSITIVE,
        },
    ),
    Entry(
        "el_haddad",
        lambda R, a: xc.el_haddad(xc.klesnil_lukas(6.0, 0.0), 1e-4)(R, a),
        {"R": arg(ratios(), 0.1), "a": SIZE},
    ),
    Entry(
        "nasgro3_threshold", xc.nasgro3_threshold, {"dK0": POSITIVE, "C_th": REAL, "a0": AT_LEAST_0}
    ),
    Entry(
        "nasgro4_threshold",
        xc.nasgro4_threshold,
        {
            "dK1": POSITIVE,
            "C_th_plus": REAL,
            "C_th_minus": REAL,
            "a0": AT_LEAST_0,
            "R_clip": arg(Number(optional=True, least=0, below=1), None, 0.7),
        },
    ),
    *(
        Entry(
            type(part).__name__,
            lambda part=part, **named: part.of(**named),
            {
                "closure": arg(Of(type=xc.newman_closure), NEWMAN),
                "R": arg(
                    Numbers(
                        most=1.0, rule=lambda R: True if R.ndim == 0 and -2 <= R <= 0.9 else None
                    ),
                    0.1,
                ),
                "a": SIZE,
            },
        )
        for part in (xc.nasgro3_threshold(dK0=2.0, C_th=0.1, a0=1e-4), NASGRO4)
    ),
    Entry(
        "forman",
        xc.forman,
        {
            "C": POSITIVE,
            "m": POSITIVE,
            "K_c": arg(Number(above=0), 80.0),
            "approach": WAY,
            "threshold": THRESHOLD,
            **COMMON,
        },
    ),
    Entry("forman", _called(xc.forman(1e-8, 3, K_c=80.0)), RATES),
    Entry(
        "hartman_schijve",
        xc.hartman_schijve,
        {"D": POSITIVE, "alpha": POSITIVE, "A": POSITIVE, "dK_thr": AT_LEAST_0, **COMMON},
    ),
    Entry("hartman_schijve", _called(xc.hartman_schijve(7e-10, 2, A=47.0, dK_thr=0.1)), RATES),
    Entry(
        "time_rate",
        xc.time_rate,
        {
            "C": POSITIVE,
            "n": arg(Number(least=0), 3.0),
            "K_th": AT_LEAST_0,
            "plateau": arg(Number(optional=True, above=0), None, 1.0),
        },
    ),
    Entry("time_rate", lambda K: xc.time_rate(1e-9, 3.0, 10.0)(K), {"K": arg(Numbers(), 20.0)}),
    Entry(
        "with_time",
        lambda law, rate, period, wave: xc.with_time(law, rate, period, wave),
        {
            "law": arg(Called(), xc.paris(1e-8, 3.0)),
            "rate": arg(Of(type=xc.time_rate), xc.time_rate(1e-9, 3.0)),
            "period": POSITIVE,
            "wave": arg(Word(words=("hold", "triangle", "sine")), "hold"),
        },
    ),
    Entry(
        "with_time",
        _called(xc.with_time(xc.paris(1e-8, 3.0), xc.time_rate(1e-9, 3.0), 2.0, "sine")),
        RATES,
    ),
    Entry(
        "nasgro",
        xc.nasgro,
        {
            "C": POSITIVE,
            "n": POSITIVE,
            "p": AT_LEAST_0,
            "q": AT_LEAST_0,
            "K_c": POSITIVE,
            "closure": arg(Of(type=xc.newman_closure), NEWMAN),
            "threshold": arg(
                Of(type=xc.nasgro3_threshold | xc.nasgro4_threshold), NASGRO3, NASGRO4
            ),
            **COMMON,
        },
    ),
    Entry(
        "nasgro",
        _called(xc.nasgro(6.35e-10, 2.5, 1, 1, 35.16, NEWMAN, NASGRO4)),
        {**RATES, "a": SIZE},
    ),
    Entry(
        "nasgro_K_c",
        xc.nasgro_K_c,
        {
            "K_Ic": POSITIVE,
            "sigma_y": POSITIVE,
            "t": POSITIVE,
            "A_k": AT_LEAST_0,
            "B_k": AT_LEAST_0,
        },
    ),
    Entry(
        "paris",
        xc.paris,
        {
            "C": POSITIVE,
            "m": POSITIVE,
            "closure": arg(
                Of(optional=True, type=xc.newman_closure | xc.linear_closure | xc.schijve_closure),
                None,
                NEWMAN,
            ),
            "threshold": arg(
                Of(type=xc.klesnil_lukas | xc.stepped_threshold | xc.el_haddad),
                xc.klesnil_lukas(6.0, 0.5),
            ),
            "approach": arg(Seen(rule=approach), "cut", "difference", 0.5),
            "K_c": K_c,
            **COMMON,
        },
    ),
    Entry(
        "paris",
        _called(
            xc.paris(
                1e-8,
                3.0,
                closure=NEWMAN,
                threshold=xc.klesnil_lukas(1.0, 0.5),
                approach=0.5,
                K_c=90.0,
            )
        ),
        RATES,
    ),
    Entry(
        "walker",
        xc.walker,
        {
            "C": POSITIVE,
            "m": POSITIVE,
            "gamma": arg(Number(least=0, most=1), 0.5),
            "gamma_minus": arg(Number(optional=True, least=0, most=1), None, 0.0),
            **SHAPE,
        },
    ),
    Entry(
        "elber",
        xc.elber,
        {
            "C": POSITIVE,
            "m": POSITIVE,
            "a": arg(Number(rule=lambda v: v > 0 or None), 0.5),
            "b": arg(Number(rule=lambda v: v >= 0 or None), 0.4),
        },
    ),
    Entry(
        "elber",
        lambda R: xc.elber(1e-3, 3.0, 0.5, 0.4).U(R),
        {"R": arg(Numbers(), 0.1, [0.1, 0.2])},
    ),
    Entry(
        "piecewise",
        xc.piecewise,
        {
            "pieces": arg(
                Numbers((None, 2), rule=lambda x: None if len(x) and (x > 0).all() else False),
                [(1e-10, 4.0), (1e-8, 2.0)],
                near={
                    "no rows": lambda: np.zeros((0, 2)),
                    "same": lambda: [(1e-8, 2.0), (2e-8, 2.0)],
                    "text": lambda: [("a", 1)],
                },
            ),
            "knees": arg(
                Numbers((1,), optional=True, rule=lambda x: bool((x > 0).all())), None, [10.0]
            ),
            **SHAPE,
        },
    ),
    Entry("piecewise", _called(xc.piecewise([(1e-10, 4.0), (1e-8, 2.0)])), RATES),
    Entry(
        "rate_table",
        xc.rate_table,
        {
            "curves": arg(
                Seen(rule=curves), PAIRS, {0.0: PAIRS[0.1]}, near=CURVES, words=["curve", "R", "dK"]
            ),
            "outside": arg(Word(words=("refuse", "nearest")), "refuse"),
            "ratio": RATIO,
        },
    ),
    Entry(
        "rate_table",
        _called(xc.rate_table(PAIRS)),
        {
            "dK_eq": RANGES,
            "R": arg(
                Numbers(rule=lambda R: True if R.ndim == 0 and 0.1 <= R <= 0.5 else None), 0.1, 0.3
            ),
        },
    ),
    *(
        Entry(
            type(law).__name__,
            lambda law=law, **named: law.to(**named),
            {"units": arg(UNITS, "m, MPa√m"), "new": arg(UNITS, "mm, MPa√mm", words=["units"])},
        )
        for law in (
            xc.paris(1e-8, 3.0),
            xc.piecewise([(1e-10, 4.0), (1e-8, 2.0)]),
            xc.rate_table(PAIRS),
            xc.stepped_threshold((0, 0.5), (170, 170, 63), 214),
            xc.nasgro(6.35e-10, 2.5, 1, 1, 35.16, NEWMAN, NASGRO4),
        )
    ),
    Entry(
        "law",
        xc.law,
        {
            "name": arg(Word(words=KNOWN), *KNOWN[:3], words=["preset"]),
            "units": arg(UNITS, "mm, N/mm^1.5"),
            "ratio": RATIO,
        },
    ),
    Entry("presets", lambda: [len(xc.presets())], {}, arity=False),
    Entry("materials", lambda: [len(xc.materials())], {}, arity=False),
    Entry(
        "material",
        lambda name, units, **use: _of_metal(xc.material(name, units=units), **use),
        {
            "name": arg(Word(words=tuple(xc.materials())), *METALS[:2], words=["metal"]),
            "units": arg(UNITS, "mm, MPa√mm"),
            "plane": arg(Word(words=("strain", "stress")), "stress"),
            "thickness": arg(Number(optional=True, above=0), None, 2.0),
            "E": arg(Number(optional=True, above=0), None, 71e3),
            "nu": arg(Number(optional=True, above=-1, below=0.5), 0.33),
        },
        arity=False,
    ),
    Entry(
        "plot_rates",
        lambda **k: [len(_drawn(**k).axes)],
        {
            "laws": arg(Seen(rule=lambda v: None), {"paris": xc.paris(1e-12, 3.0)}),
            "units": arg(UNITS, "mm, MPa√mm"),
            "R": arg(Number(most=1), 0.1),
            "dK": arg(
                Seen(rule=lambda v: None if v is None else bounds(v) or None), None, (100.0, 900.0)
            ),
        },
        arity=False,
    ),
]
HOOKS = []
