"""Look at a scene, its law and its cycle before a run: what is beyond its limit."""

from dataclasses import replace
from typing import Unpack

from xcrack.analysis.report import Alarm
from xcrack.base.errors import collected_warnings
from xcrack.fatigue.criteria import Criterion, max_hoop_stress
from xcrack.fatigue.cycle import Cycle
from xcrack.fatigue.law import Law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.alarms import judged_step
from xcrack.growth.options import GrowthOptions, lists_options, run_of
from xcrack.growth.run import first_step
from xcrack.model.problem import Problem

_ANY = 1.0  # length of a step that is not taken


@lists_options
def check(
    problem: Problem,
    law: Law,
    cycle: Cycle | Spectrum,
    criterion: Criterion = max_hoop_stress,
    da: float | None = None,
    **options: Unpack[GrowthOptions],
) -> tuple[Alarm, ...]:
    """Numbers of a scene that no part has, and limits of linear elasticity that it exceeds.

    All load states are solved once, on the mesh as it is. `grow` warns of the same at its first
    step, and of plastic zones at each.

    Parameters
    ----------
    problem : Problem
        Its material may have a yield stress and a toughness `K_c`: without them plastic zones, net
        sections and K against toughness are not judged.
    law, cycle, criterion, da
        As of `grow`; of the steps nothing is needed.
    tolerance, max_unknowns, cycles, scaling, integrator, threshold, retardation, K_c, link_up, \
    stop_at_interface, \
    max_steps, max_cycles, max_size, load_program, solver, response, progress
        As of `grow`.

    Returns
    -------
    tuple of Alarm
        Each is a line that can be printed: number, limit, place and remedy. Empty where all is as
        in a part.

    Raises
    ------
    ProblemError
        As of `grow`.

    Notes
    -----
    Limits: displacement 2 % of the body; stress in 5 % of the body the yield stress, or without one
    1 % of Young's modulus; growth a cycle 2 % of the crack or 0.1 mm (where Young's modulus is that
    of a solid in MPa or Pa); 10¹² cycles until the crack has grown by its size; a threshold above K
    of a crack as long as the body; K_max the toughness; factors of a spectrum 20 beside stresses of
    5 (loads); plastic zone 15 % of crack or ligament; the load on a ligament that at which it
    yields. Displacement and stress, by loads, and fast growth are judged where a yield stress is
    given or Young's modulus is above 10: scenes with numbers near 1 have no units.

    Examples
    --------
    >>> import xcrack as xc
    >>> body, crack = xc.box((0, -20), (20, 20), (10, 20)), xc.line_crack([(0, 0.3), (4, 0.3)])
    >>> pull = [xc.traction("top", (0, 80.0)), xc.traction("bottom", (0, -80.0))]
    >>> steel = xc.Isotropic(210e3, 0.3, plane="strain", K_c=33.0)  # MPa√m, in a model in mm
    >>> alarms = xc.check(
    ...     xc.Problem(body, steel, [crack], loads=pull), xc.paris(1e-13, 3.0), xc.Cycle(0.1, 1.0)
    ... )
    >>> [(alarm.quantity, alarm.limit) for alarm in alarms]
    [('K over the toughness K_c', 1.0)]
    """
    has_length = da is not None or "cycles" in options or "tolerance" in options
    run = run_of("check", problem, law, criterion, cycle, da if has_length else _ANY, options)
    with collected_warnings([]):  # those of K are not what is asked for
        step = first_step(replace(run, tolerance=None, max_unknowns=None, da=_ANY))
    return tuple(judged_step(run, step)[1])


__all__ = ["check"]
