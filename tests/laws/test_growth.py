"""Laws in a run: what they are passed, which R they get, and when a run is refused."""

import numpy as np
import pytest

from support.growth_fakes import formula, mode_I, plate
from xcrack import (
    Cycle,
    Isotropic,
    Problem,
    ProblemError,
    Response,
    box,
    el_haddad,
    elber,
    fix,
    forman,
    grow,
    klesnil_lukas,
    line_crack,
    max_hoop_stress,
    nasgro,
    nasgro4_threshold,
    newman_closure,
    paris,
    penny_crack,
    traction,
    walker,
)
from xcrack.testing import check_law

CYCLE = Cycle(0.1, 1.0)
NEWMAN = newman_closure(2.0, 0.3)
V4 = nasgro4_threshold(dK1=20.0, C_th_plus=2.0, C_th_minus=0.1, a0=0.04, R_clip=0.7)


def nasgro_law(ratio=None):
    return nasgro(1e-13, 2.5, 0.5, 0.5, 3000.0, NEWMAN, V4, ratio=ratio)


def first_step(law, cycle=CYCLE, problem=None):
    """By a formula, but for a problem with loads."""
    response = None if problem is not None and problem.loads else formula(mode_I())
    options = {"da": 2.0, "max_steps": 2, "progress": False, "response": response}
    return next(grow(problem or plate(), law, max_hoop_stress, cycle, **options))


def test_crack_size_is_passed():
    """Length 5 of an edge crack; 5 is half of the length of a crack with two tips."""
    law = paris(1e-11, 3, threshold=el_haddad(klesnil_lukas(200.0, 0.0), a0=5.0), approach=1.0)
    edge = first_step(law)
    dK = float(edge.dK_eq[0][0])
    assert edge.rate[0] == pytest.approx(law(dK, 0.1, a=5.0), rel=1e-12)
    centre = first_step(law, problem=plate([line_crack([(25.0, 0.37), (35.0, 0.37)])]))
    assert centre.rate[0] == pytest.approx(law(dK, 0.1, a=5.0), rel=1e-12)


def test_a_law_of_a_user_may_ask_for_both():
    def law(dK, R, *, a, K_max):
        return 1e-11 * K_max**3 * a

    law.needs = ("a", "K_max")
    check_law(law)
    step = first_step(law)
    K_max = float(step.dK_eq[0][0]) / 0.9
    assert step.rate[0] == pytest.approx(1e-11 * K_max**3 * 5.0, rel=1e-12)
    law.needs = ("temperature",)
    with pytest.raises(ProblemError, match=r"needs .*temperature"):
        first_step(law)


@pytest.mark.parametrize(
    "law",
    [
        nasgro_law(),
        forman(1e-8, 3, 3000.0),
        paris(1e-11, 3, closure=NEWMAN),
        walker(1e-11, 3, 0.5, gamma_minus=0.0),
    ],
    ids=lambda law: type(law).__name__,
)
def test_negative_ratios_need_a_choice(law):
    with pytest.raises(ProblemError, match=r'ratio="contact".*ratio="nominal"'):
        first_step(law, Cycle(-1.0, 1.0))
    first_step(law, Cycle(0.0, 1.0))


@pytest.mark.filterwarnings("ignore:K_I < 0")
def test_older_laws_go_on_as_they_did():
    with pytest.warns(match="the cycle has R = -1"):
        first_step(elber(1e-11, 3, 0.5, 0.4), Cycle(-1.0, 1.0))
    with pytest.warns(match="the cycle has R = -1"):
        first_step(walker(1e-11, 3, 0.5), Cycle(-1.0, 1.0))


def closing(**options):
    """A plate with an edge crack in tension, or pressed shut."""
    mesh = box((0.0, -10.0), (20.0, 10.0), (14, 15))
    return Problem(
        mesh,
        Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[line_crack([(0.0, 0.4), (6.0, 0.4)])],
        supports=[fix((20.0, -10.0)), fix((20.0, 10.0), axis=0)],
        loads=[traction("top", (0.0, 100.0)), traction("bottom", (0.0, -100.0))],
        **options,
    )


@pytest.mark.filterwarnings("ignore:K at")
def test_nominal_range_of_a_closing_crack():
    """Without contact K is linear in the load: R is that of the factors to round-off."""
    nominal = first_step(nasgro_law("nominal"), Cycle(-0.5, 1.0), closing())
    contact = first_step(nasgro_law("contact"), Cycle(-0.5, 1.0), closing())
    K = nominal.sif[1][0].K[0, 0]
    assert nominal.R[0] == pytest.approx(-0.5, abs=1e-9)
    assert nominal.dK_eq[0] == pytest.approx(1.5 * contact.dK_eq[0], rel=1e-3)
    assert contact.R[0] == pytest.approx(0.0, abs=1e-3)
    assert contact.dK_eq[0] == pytest.approx(K, rel=1e-3)
    assert nominal.angle[0] == contact.angle[0]
    assert nominal.rate[0] > contact.rate[0]  # the unsafe one is the contact value


@pytest.mark.filterwarnings("ignore:K at")
def test_a_closed_tip_in_a_list_of_loads_needs_a_choice():
    problem = closing()
    pressed = [traction("top", (0.0, -50.0)), traction("bottom", (0.0, 50.0))]
    cycle = Cycle(states=[pressed, list(problem.loads)])
    with pytest.raises(ProblemError, match="a load state closes a tip"):
        first_step(nasgro_law(), cycle, problem)
    assert first_step(nasgro_law("nominal"), cycle, problem).R[0] == pytest.approx(-0.5, abs=1e-9)


def test_signed_range():
    """Mode I by hand: K 10 and -4; modes I and III with nu = 0, 3D."""

    def first(problem, *K):
        def response(problem, states, reuse, bars):
            rows = [[row] * len(problem.stations) for row in K]
            return Response.of_K(problem, states, rows)

        options = {"da": 0.1, "progress": False, "response": response}
        law = paris(1e-11, 3, ratio="nominal")
        return next(grow(problem, law, max_hoop_stress, Cycle(-0.4, 1.0), **options))

    step = first(plate(), [-4.0, 0.0], [10.0, 0.0])
    assert step.dK_eq[0].tolist() == [14.0]
    assert step.R[0].tolist() == [-0.4]
    body = box((-1, -1, -1), (1, 1, 1), 4)
    crack = penny_crack((0.01, 0.02, 0.03), (0, 0, 1), 0.6)
    step = first(Problem(body, Isotropic(1.0, 0.0), [crack]), [-0.5, 0.0, 0.4], [0.6, 0.0, 0.8])
    assert step.dK_eq[0] == pytest.approx(1.5)
    assert step.R[0] == pytest.approx(-0.5)


@pytest.mark.parametrize("ratio", [None, "contact", "nominal"])
def test_laws_pass_the_public_check(ratio):
    check_law(nasgro_law(ratio), dK_max=4000.0)
    check_law(forman(1e-8, 3, 80.0, ratio=ratio))
    check_law(walker(1e-11, 3, 0.5, 0.1, klesnil_lukas(6, 0.5), approach=1.0, ratio=ratio))
    check_law(paris(1e-11, 3, R_range=(0.5, 1.0), ratio=ratio))
    with pytest.raises(ProblemError, match="nothing can be tried"):
        check_law(paris(1e-11, 3, R_range=(0.2, 0.3), ratio=ratio))


def test_a_wrong_range_without_ratios_is_an_error_in_words():
    with pytest.raises(ProblemError, match="a range is not negative"):
        paris(1e-11, 3)(np.array([[-1.0], [2.0]]), np.zeros((2, 0)))
