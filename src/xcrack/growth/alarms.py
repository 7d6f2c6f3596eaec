"""Magnitudes of a run that are more likely slips of units, and limits of elasticity."""

import numpy as np

from xcrack.analysis.report import Alarm, alarms_of_solutions, has_units, millimetre
from xcrack.analysis.solution import Solution
from xcrack.base.arguments import arguments_of
from xcrack.base.arrays import Floats
from xcrack.base.errors import XcrackError
from xcrack.base.units import STRESS
from xcrack.crack.measures import crack_areas
from xcrack.crack.stations import GEOMETRY
from xcrack.fatigue.checks import evaluate_law
from xcrack.fatigue.spectrum import Spectrum
from xcrack.growth.options import GrowthRule
from xcrack.growth.step import Step, place_name
from xcrack.growth.validity import Validity, validity
from xcrack.model.loads import Load
from xcrack.sif.stress_intensity import energy_release_rate

_FAST = 0.02  # of the crack in a cycle
_FAR = 0.1  # mm in a cycle
_ENDLESS = 1e12  # cycles until a crack has grown by its size
_FEW = 10.0  # cycles of a life
_LEAST_GROWTH = 0.1  # of the area: less is within what energy differs by between two meshes
_BALANCED = 0.6  # of G times area; .9 to 1.05 where all is well
_DEAD = frozenset({"traction", "volume", "point_force", "face_pressure"})
_SCALED = 20.0  # factor of a spectrum
_STRESS = 5.0  # load that is a stress already, and not a unit load
_BELOW = 3.0  # times the range: a law that gives no growth there either
_REACH = np.logspace(
    np.log10(_BELOW), 2.0, 32
)  # times the range, where its threshold is looked for


def judged_step(rule: GrowthRule, step: Step) -> tuple[Validity | None, list[Alarm]]:
    """How far elasticity holds at a step, by its material, and what is beyond its limit.

    Magnitudes are judged at the first step. A K_c of the run only says where it ends.
    """
    if step.has_left or not step.sif:
        return None, []
    alarms: list[Alarm] = []
    if step.index == 0:
        if solutions := _solutions(rule, step):
            alarms += alarms_of_solutions(solutions)
        if not any("in all load states" in alarm.place for alarm in alarms):
            alarms += _factors(rule) + _rate(rule, step)
    by_material = _validity_of(rule, step, rule.problem.elasticity.material.K_c)
    check = by_material if rule.K_c is None else _validity_of(rule, step, rule.K_c)
    if check is not None:
        # Later in a run it is why growth ends.
        alarms += [
            alarm
            for alarm in check.alarms()
            if step.index == 0 or not alarm.quantity.startswith("K over")
        ]
    return by_material, alarms


def _validity_of(rule: GrowthRule, step: Step, K_c: float | None) -> Validity | None:
    """Plastic zones, toughness and net sections of a step; None where nothing is known of these."""
    material = rule.problem.elasticity.material
    if material.yield_stress is None and K_c is None:
        return None
    mesh, solutions = rule.problem.mesh, _solutions(rule, step)
    return validity(material, mesh, step.cracks, step.sif, solutions, K_c)


def _solutions(rule: GrowthRule, step: Step) -> tuple[Solution, ...]:
    """Solutions that K of a step comes from: where it comes from elsewhere they may be anything."""
    return step.solutions if rule.response is None else ()


def alarm_of_life(rule: GrowthRule, step: Step, end: str) -> Alarm | None:
    """A life that is too short for fatigue, in a scene with units.

    A run that ends at its first step has said why.
    """
    cycles, has_stopped_by_itself = (
        step.cycles,
        end.startswith(("max_", "rate is zero", "the advance")),
    )
    if has_stopped_by_itself or step.index == 0 or not has_units(rule.problem) or cycles >= _FEW:
        return None
    remedy = "is the law in the units of the model, and are the loads as meant?"
    return Alarm("the number of cycles until the run ended", cycles, _FEW, "", remedy)


def alarm_of_energy(rule: GrowthRule, last_step: Step, step: Step) -> Alarm | None:
    """A step whose solution does not release the energy that K says: two ways to one number.

    Asked where loads are dead, so that the strain energy grows by G times the new area, where there
    is no friction, and where the cracks have grown by a tenth. Not where some join or leave: their
    ends are no longer there to say what they released.
    """
    if not (_has_dead_loads(rule) and last_step.solutions and step.solutions and step.sif):
        return None
    if step.joins or step.arrivals or len(step.cracks) != len(last_step.cracks):
        return None
    mesh = rule.problem.mesh
    old_area, area = (crack_areas(s.cracks, mesh) for s in (last_step, step))
    if area.sum() < (1 + _LEAST_GROWTH) * old_area.sum():
        return None
    old_G, G = _release(last_step), _release(step)
    if old_G is None or G is None:
        return None
    # The geometric mean: less than the true one where G grows like a power or an exponential, as
    # over most of a ligament in one step, of which the arithmetic mean makes 2.5 times as much.
    by_K = float(np.sqrt(old_G * G) @ (area - old_area))
    ratio = (step.solutions[-1].energy - last_step.solutions[-1].energy) / by_K if by_K > 0 else 1.0
    if ratio >= _BALANCED:
        return None
    return Alarm(
        "the energy that the step releases over G times the new area", ratio, _BALANCED,
        f"from step {last_step.index} to {step.index}", "faces of the crack lie over each other, "
        "or the cells are too coarse where fronts turn or meet: look at the faces with plot, and "
        "take shorter steps in smaller cells.",
    )  # fmt: skip


def _has_dead_loads(rule: GrowthRule) -> bool:
    """Whether loads are forces that do not change, and nothing else takes or gives energy."""
    problem = rule.problem
    states = [state for state in rule.cycle.load_states if isinstance(state, list | tuple)]
    loads = [*problem.loads, *(load for state in states for load in state)]
    is_changing = rule.load_program is not None or rule.response is not None
    return (
        not is_changing
        and all(load.acts <= _DEAD for load in loads)
        and all(support.holds for support in problem.supports)
        and not any(problem.frictions)
    )


def _release(step: Step) -> Floats | None:
    """Mean of G over the growth of each crack `(c,)`; None where a material does not say it."""
    result = np.zeros(len(step.cracks))
    for c, (sif, rate) in enumerate(zip(step.sif[-1], step.rate, strict=True)):
        if sif.E_prime is None or sif.nu is None or not np.isfinite(rate).all():
            return None
        if rate.any():
            result[c] = np.average(energy_release_rate(sif), weights=rate)
    return result


def _factors(rule: GrowthRule) -> list[Alarm]:
    """Factors of a spectrum that are stresses, beside loads that are stresses too."""
    spectrum = rule.cycle
    if not isinstance(spectrum, Spectrum) or spectrum.states is not None:
        return []
    largest_factor = max(map(abs, spectrum.extremes))
    loads = [(_stress_of(load), load) for load in rule.problem.loads]
    stress, load = max(loads, key=lambda pair: pair[0], default=(0.0, None))
    if largest_factor <= _SCALED or stress < _STRESS or load is None:
        return []
    return [
        Alarm(
            "the largest factor of the spectrum",
            largest_factor,
            _SCALED,
            f"beside {load.name} of {stress:.4g}",
            "factors multiply the loads: are they stresses already? Then give unit loads, or "
            "Spectrum.scaled.",
        )
    ]


def _cycles_of_block(spectrum: Spectrum) -> float:
    """Number of cycles of a block; of one of states, which K counts, at most."""
    if spectrum.states is not None:
        return max(0.5 * len(spectrum.sequence), 1.0)
    return max(float(spectrum.cycles["count"].sum()), 1.0)


def _stress_of(load: Load) -> float:
    """Largest number of a load that is a stress; 0 where it has none, or a function."""
    stress = 0.0
    for name, argument in arguments_of(type(load)).items():
        value = getattr(load, name)
        unit = None if argument.rule is None else argument.rule.unit
        if (unit(load) if callable(unit) else unit) == STRESS and not callable(value):
            components = np.asarray(value, dtype=object).ravel()
            stress = max([stress, *(abs(float(v)) for v in components if v is not None)])
    return stress


def _rate(rule: GrowthRule, step: Step) -> list[Alarm]:
    """Growth a cycle against the crack, a millimetre and a life."""
    count = _cycles_of_block(rule.cycle) if isinstance(rule.cycle, Spectrum) else 1.0
    rates = [rate / count for rate in step.rate]
    sizes = step.sizes
    shares = [rate / size for rate, size in zip(rates, sizes, strict=True)]
    if not any(len(share) for share in shares):
        return []
    c = int(np.argmax([share.max(initial=-1.0) for share in shares]))
    j = int(np.argmax(shares[c]))
    place, rate, share = f"at {place_name(step, c, j)}", rates[c][j], shares[c][j]
    units = "is the law in the units of the model (`law(..., units=...)`, `law.to`)?"
    if np.isinf(rate):
        words = f"the toughness of the law is reached in the first cycle: {units}"
        K = float(step.dK_eq[c][j])
        return [Alarm("da/dN of the first step", float(rate), _FAST * sizes[c], place,
                      f"dK_eq = {K:.4g}: {words}")]  # fmt: skip
    if share == 0:
        return _no_growth(rule, step, units)
    alarms = []
    unit = millimetre(rule.problem)
    if share > _FAST and has_units(rule.problem):
        alarms.append(Alarm("da/dN over the size of the crack", float(share), _FAST, place, units))
    elif unit is not None and rate > _FAR * unit:
        alarms.append(Alarm("da/dN", float(rate), _FAR * unit, place, units))
    elif share * _ENDLESS < 1:
        words = f"nothing grows in a lifetime: {units}"
        alarms.append(Alarm("the size of the crack over da/dN", float(1 / share), _ENDLESS, place,
                           words))  # fmt: skip
    return alarms


def _no_growth(rule: GrowthRule, step: Step, units: str) -> list[Alarm]:
    """A law that has no growth for a crack as long as the body either, under its mean stress.

    Small flaws below the threshold are as meant.
    """
    solutions = _solutions(rule, step)
    if not solutions or isinstance(rule.cycle, Spectrum):
        return []
    mesh, E_prime = rule.problem.mesh, rule.problem.elasticity.largest_modulus
    energy = max(solution.energy for solution in solutions)
    stress = np.sqrt(2 * max(energy, 0.0) * E_prime / mesh.volume.sum())
    length = float(np.ptp(mesh.points, axis=0).max())
    K_scale = float(stress * np.sqrt(np.pi * length))
    R = next(R[[0]] for R in step.R if len(R))
    for factor in _REACH:
        dK = np.array([factor * K_scale])
        try:
            rate = evaluate_law(rule.law, dK, R, 0, GEOMETRY[mesh.dim].station, np.array([length]))
        except XcrackError:  # beyond what its constants were fitted for
            return []
        if rate[0] > 0 and dK[0] >= rule.threshold:
            break
    if factor == _REACH[0]:
        return []
    words = f"K of a crack as long as the body is no larger, and nothing can grow: {units}"
    quantity = "dK_eq up to which there is no growth"
    return [Alarm(quantity, float(factor * K_scale), K_scale, "", words)]


__all__ = ["alarm_of_energy", "alarm_of_life", "judged_step"]
