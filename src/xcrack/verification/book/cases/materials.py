"""Several materials: patches, K beside and on interfaces, graded strips, thermal mismatch."""

from functools import partial
from typing import Any

import numpy as np

from xcrack.analysis.solve import solve
from xcrack.base.arrays import Floats
from xcrack.crack.lines import line_crack
from xcrack.model.loads import displacement, fix
from xcrack.model.material import Graded, Isotropic
from xcrack.model.problem import Problem
from xcrack.sif.interface_crack import interface_intensity
from xcrack.sif.stress_intensity import energy_release_rate, stress_intensity
from xcrack.verification.book import scenes_materials as scenes
from xcrack.verification.book.case import Case, Value
from xcrack.verification.exact import interface_crack

_STRAIN = 1e-2
_ROUND_OFF = 1e-11
_PROGRAM = "scikit-fem 12: quadratic triangles with a seam, graded to 2e-5 at tips and corners"
_UPPER, _LOWER = (1.0, 0.3), (3.0, 0.3)


def _patch_run(level: int, order: int) -> list[Value]:
    """Two materials side by side, pressed across a crack that passes from one into the other."""
    del level
    materials = {"one": Isotropic(1.0, 0.3, "strain"), "two": Isotropic(7.0, 0.2, "strain")}
    ends: Any = {"bottom": (None, 0.0), "top": (None, -_STRAIN)}
    supports = [*(displacement(side, u) for side, u in ends.items()), fix((0.5, 0.0), 0)]
    crack = line_crack([(0.23, 0.47), (0.77, 0.47)])
    problem = Problem(scenes.perturbed((10, 11), 0), materials, [crack], supports, order=order)
    contact = solve(problem).contact[0]
    assert contact is not None
    values = []
    for name, material in materials.items():
        side = (contact.points[:, 0] < 0.5) == (name == "one")
        pressure = _STRAIN * material.at_tip().E_prime
        worst = float(np.abs(contact.pressure[side] / pressure - 1).max())
        values.append(Value(f"pressure in {name!r}", worst, 0.0, _ROUND_OFF, 1.0))
    return values


def _beside_run(level: int, is_behind: bool) -> list[Value]:
    n = 20 * 2**level
    return [
        Value(
            f"K_I, tip at {a}, E ratio {ratio}",
            float(stress_intensity(solve(scenes.edge_crack(n, a, ratio))).K_I[0]), K, 4e-4,
        )
        for a, ratio, K in scenes.EDGE_CRACKS
        if (a > 0.5) is is_behind
    ]  # fmt: skip


def _mixed_run(level: int) -> list[Value]:
    values = []
    for ratio, nu, K in scenes.MIXED_MODES:
        sif = stress_intensity(solve(scenes.slanted_crack(20 * 2**level, ratio, nu)))
        values += [
            Value(f"K_{mode}, E ratio {ratio}, nu {nu}", float(sif.K[1, m]), K[m], 6.5e-4, K[0])
            for m, mode in enumerate(("I", "II"))
        ]
    return values


def _layers_run(level: int) -> list[Value]:
    values = []
    for ratio in (0.1, 10.0):
        sif, K = scenes.layered_strip(10 * 2**level, ratio)
        values.append(Value(f"K_I, skin {ratio} as stiff", float(sif.K_I[0]), K, 3e-4))
    return values


def _graded_strip_run(level: int) -> list[Value]:
    values = []
    for base in (0.1, 10.0):

        def modulus(x: Floats, base: float = base) -> Floats:
            return np.asarray(base ** x[:, 1])

        # 1 / stretch(E) is 1 / E of a unit, and the mean of base^-y over (-1, 1) is known.
        mean = (base - 1 / base) / (2 * float(np.log(base)))
        flexibility = 2 * mean / scenes.stretch(1.0, 0.3)
        problem = scenes.strip(10 * 2**level, Graded(modulus, 0.3, "strain"))
        G = float(energy_release_rate(stress_intensity(solve(problem)))[0])
        values.append(Value(f"G, E changes by {base}²", G, 0.5 / flexibility, 1.2e-3))
    return values


def _graded_plate_run(level: int) -> list[Value]:
    return [
        Value(
            f"K_I, tip at {a}, E changes by {ratio}",
            float(stress_intensity(solve(scenes.graded_plate(20 * 2**level, ratio, a))).K_I[0]),
            K, 5e-4,
        )
        for ratio, a, K in scenes.GRADED[::3]
    ]  # fmt: skip


def _thermal_run(level: int) -> list[Value]:
    values = []
    for ratio, K in scenes.THERMAL:
        sif = stress_intensity(solve(scenes.heated(20 * 2**level, ratio, 0.0, 1e-2)))
        values.append(Value(f"K_I, E ratio {ratio}", float(sif.K_integral[0, 0]), K, 4e-4))
    return values


def _interface_run(level: int) -> list[Value]:
    problem = scenes.crack_in_planes(24 * 2**level, _UPPER, _LOWER)
    sif = interface_intensity(solve(problem), 2.0)
    K = interface_crack.intensity(1.0, 1.0, _UPPER, _LOWER)
    return [
        Value("K_1", float(sif.K_1[0]), K.real, 1.5e-3, abs(K), rate=0.6),
        Value("K_2", float(sif.K_2[0]), K.imag, 1.5e-3, abs(K)),
    ]


CASES = (
    Case("materials-patch-1", "materials", "uniform strain of two materials side by side", "exact",
         2, 1, True, partial(_patch_run, order=1)),
    Case("materials-patch-2", "materials", "uniform strain of two materials side by side", "exact",
         2, 2, True, partial(_patch_run, order=2)),
    Case("materials-before", "materials", _PROGRAM, "program", 2, 2, False,
         partial(_beside_run, is_behind=False), 2),
    Case("materials-behind", "materials", _PROGRAM, "program", 2, 2, False,
         partial(_beside_run, is_behind=True), 2),
    Case("materials-mixed", "materials", _PROGRAM, "program", 2, 2, False, _mixed_run, 2),
    Case("materials-layers", "materials", "energy ahead of a crack in a clamped strip of layers",
         "exact", 2, 2, False, _layers_run, 2),
    Case("materials-graded-strip", "materials", "energy ahead of a crack in a clamped strip",
         "exact", 2, 2, False, _graded_strip_run),
    Case("materials-graded-plate", "materials", _PROGRAM, "program", 2, 2, False,
         _graded_plate_run, 2),
    Case("materials-thermal", "materials", _PROGRAM, "program", 2, 2, False, _thermal_run, 2),
    Case("materials-interface", "materials",
         "crack between two half-planes (England, 1965; Rice and Sih, 1965)", "exact", 2, 2, False,
         _interface_run, 2),
)  # fmt: skip


__all__ = ["CASES"]
