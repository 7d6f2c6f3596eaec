"""K of a crack: at its tips in 2D, along its fronts in 3D."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from xcrack.analysis.solution import Solution
from xcrack.base.arguments import Choice, Either, Flag, Whole, check_arguments
from xcrack.base.arrays import Floats
from xcrack.base.checks import copy_without_checks, value_text
from xcrack.base.errors import ProblemError
from xcrack.base.machine import threads
from xcrack.model.material import Material
from xcrack.sif.accuracy import warn_of, warn_of_order
from xcrack.sif.domain_2d import tip_intensities
from xcrack.sif.domain_3d import front_intensity
from xcrack.sif.error import doubts_at_kinks, with_bars
from xcrack.sif.sif import SIF, joined_sif

_CrackNumber = Annotated[int, Whole()]
_Bars = Annotated[bool | str | None, Either(Flag(), Choice((True, False, "front")))]


@check_arguments()
def stress_intensity(solution: Solution, crack: _CrackNumber = 0, error: _Bars = None) -> SIF:
    """K_I, K_II and T at the tips, or K_I to K_III along the fronts of a crack, from two domains.

    Parameters
    ----------
    solution : Solution
    crack : int
        Its number in the problem.
    error : bool or "front", optional
        Estimate the error: `eta`, `bar` and `best` of the result. By default where the solution
        comes from ``solve(..., error=True)``. Of any other solution, as one that was stored, the
        states are solved once more, since the factor is gone. "front", in 3D: solve them again at
        order 2 with cells along the fronts that are 1.5 times smaller; that K is best, and the
        bar is the difference.

    Returns
    -------
    SIF
        K_I of closed tips and places of fronts is exactly zero.

    Raises
    ------
    ProblemError
        Not a solution, no such crack, "front" in 2D, or K that is no number.

    Warns
    -----
    XcrackWarning
        In 2D with bars: an error of more than 3 % of the largest K of the crack by its estimate and
        bar. Without: a domain with too little room for small errors; two domains that differ by
        more than 1 % of K at a tip, or by 5 % of the largest K in the mean of a front; a contact
        zone at a tip or front that is shorter than two cells; faces that press at a kink which the
        cut rounds off; a front too short for K, or whose radius of curvature is below two cells; a
        crack in 3D that is less than seven cells of order 1 deep.
    """
    if not isinstance(solution, Solution):
        hint = ""
        if isinstance(solution, list | tuple):
            hint = "; stress_intensities takes the solutions of one solve"
        raise ProblemError(
            f"stress_intensity takes a Solution as solve returns it, not a "
            f"{type(solution).__name__}{hint}."
        )
    return stress_intensities([solution], crack, error)[0]


@check_arguments()
def stress_intensities(
    solutions: Sequence[Solution], crack: _CrackNumber = 0, error: _Bars = None
) -> list[SIF]:
    """K of several load states that one solve returned; what is geometry is made once.

    Parameters
    ----------
    solutions : sequence of Solution
        States of one problem, which share their space.
    crack : int
        Its number in the problem.
    error : bool or "front", optional
        As of `stress_intensity`.

    Returns
    -------
    list of SIF
        One for each solution, as of `stress_intensity`.

    Raises
    ------
    ProblemError
        Not a list of solutions, solutions of different solves, no such crack, a material that is
        not isotropic, or K that is no number.

    Warns
    -----
    XcrackWarning
        As of `stress_intensity`.
    """
    solutions = _checked_solutions(solutions)
    space = solutions[0].space
    if not 0 <= crack < len(space.cuts):
        raise ProblemError(
            f"crack {value_text(crack)}: the problem has {len(space.cuts)} crack(s), numbered from "
            f"0."
        )
    elasticity = solutions[0].problem.elasticity
    if elasticity.is_uniform:
        elasticity.materials[0].at_tip()  # refuses where K is not defined
    # Cycles from nothing are the most common ones: their lower state has no K to look for.
    solutions_under_load = [s for s in solutions if not s.at_rest] or solutions[:1]
    ends = space.tips_of(crack)
    doubts: list[str] = []
    if space.dim < 3:
        by_end, doubts = tip_intensities(solutions_under_load, ends)
    else:
        with threads(solutions[0].problem.numerics.threads):
            by_end = [front_intensity(solutions_under_load, t) for t in ends]
    by_state = [
        joined_sif([states[k] for states in by_end], space.dim)
        for k in range(len(solutions_under_load))
    ]
    place = np.cumsum([not s.at_rest for s in solutions]) - 1
    result = [
        _without_K(by_state[0]) if s.at_rest else by_state[k]
        for s, k in zip(solutions, place, strict=True)
    ]
    if error is None:
        error = any(s.factored is not None for s in solutions)
    if error:
        result = with_bars(solutions, result, crack, error if isinstance(error, str) else "")
    else:
        warn_of_order(solutions_under_load[0], crack)
    if space.dim < 3 and len(ends):
        doubts = [*doubts, *doubts_at_kinks(solutions_under_load, crack)]
        parts = [sif for sif, s in zip(result, solutions, strict=True) if not s.at_rest]
        warn_of(doubts, solutions_under_load, parts or result[:1], space.tips[ends[0]].radius)
    return result


def _without_K(sif: SIF) -> SIF:
    """K of a state in which nothing acts."""
    K, T = np.zeros_like(sif.K), np.where(np.isnan(sif.T), np.nan, 0.0)
    return copy_without_checks(
        sif, K=K, T=T, spread=K, smooth_K=None, closed=np.zeros(len(K), dtype=bool)
    )


def _checked_solutions(solutions: Any) -> list[Solution]:
    """The solutions as a list, if they are those of one solve."""
    if isinstance(solutions, Solution):
        raise ProblemError(
            "stress_intensities takes a list of solutions: give [solution], or ask "
            "stress_intensity."
        )
    try:
        result = list(solutions)
    except Exception:  # whatever an object's own __iter__ raises
        raise ProblemError(
            f"stress_intensities takes a list of solutions, not a {type(solutions).__name__}."
        ) from None
    if not result:
        raise ProblemError("stress_intensities: the list of solutions is empty: give at least one.")
    for k, solution in enumerate(result):
        if not isinstance(solution, Solution):
            raise ProblemError(
                f"stress_intensities: item {k} is a {type(solution).__name__}: give solutions as "
                "solve returns them."
            )
    if any(solution.space is not result[0].space for solution in result):
        raise ProblemError(
            "the solutions do not share one space: give the states of one solve, and those of "
            "another solve to another call."
        )
    return result


# Energy release rate from K.


def energy_release_rate(sif: SIF, material: Material | None = None) -> Floats:
    """Energy that is released per area of new crack straight ahead; J of an elastic body.

    Parameters
    ----------
    sif : SIF
    material : Material, optional
        That of all tips; where it is left out, that which each tip was in.

    Returns
    -------
    (f,) array, stress length

    Raises
    ------
    ProblemError
        Other kinds of value, a material whose tips are not isotropic, or none where the SIF does
        not say it, as K from elsewhere.

    Notes
    -----
    G = J = (K_I² + K_II²) / E' + K_III² / (2 µ) (Irwin 1957), E' = E / (1 - nu²) in plane strain
    and 3D, E in plane stress. At a tip that is closed K_I is zero.
    """
    if not isinstance(sif, SIF):
        raise ProblemError(
            f"energy_release_rate: sif = {value_text(sif)}: give what stress_intensity returns."
        )
    K, E_prime, nu = sif.K, sif.E_prime, sif.nu
    if material is not None:
        if not isinstance(material, Material):
            raise ProblemError(
                f"energy_release_rate: material = {value_text(material)}: give Isotropic(...)."
            )
        tip_material = material.at_tip()
        E_prime, nu = (np.full(len(K), v) for v in (tip_material.E_prime, tip_material.nu))
    if E_prime is None or nu is None:
        raise ProblemError(
            "energy_release_rate: the SIF does not say its material: give material=Isotropic(...)."
        )
    G = (K[:, 0] ** 2 + K[:, 1] ** 2) / E_prime
    if K.shape[1] == 3:  # 2 mu = E' (1 - nu)
        G = G + K[:, 2] ** 2 / (E_prime * (1 - nu))
    return np.asarray(G)


__all__ = ["energy_release_rate"]
