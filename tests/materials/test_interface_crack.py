"""Cracks along bonded interfaces, against exact fields, energies and each other."""

import numpy as np
import pytest

import xcrack as xc
from support import materials as scenes
from xcrack.verification.exact import interface_crack as exact


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize(
    ("upper", "lower", "limit"),
    [((1.0, 0.3), (1.0001, 0.3), 3e-4), ((3.0, 0.2), (1.0, 0.35), 2e-3),
     ((1.0, 0.3), (10.0, 0.3), 3.5e-3)],
)  # fmt: skip
def test_a_pressed_crack_in_two_half_planes(upper, lower, limit, plane):
    """Five cells a half length; the error is of first order in them."""
    solution = xc.solve(scenes.crack_in_planes(24, upper, lower, plane))
    sif = xc.interface_intensity(solution, 2.0)
    K = exact.intensity(1.0, 1.0, upper, lower, plane)
    assert np.abs(sif.K_1 + 1j * sif.K_2 - K).max() <= limit * abs(K)
    assert sif.epsilon == pytest.approx(exact.oscillation(upper, lower, plane), abs=1e-12)
    assert sif.phase == pytest.approx(np.degrees(np.angle(K)), abs=0.1)
    one, two = solution.problem.material["above"], solution.problem.material["below"]
    modulus = 2 / (1 / one.E_prime + 1 / two.E_prime) * np.cosh(np.pi * sif.epsilon) ** 2
    assert sif.G == pytest.approx(abs(K) ** 2 / modulus, rel=2.5 * limit)
    assert sif.contact_zone.tolist() == [0.0, 0.0]


def test_the_error_is_of_first_order():
    upper, lower = (1.0, 0.3), (3.0, 0.3)
    K = exact.intensity(1.0, 1.0, upper, lower)
    errors = []
    for n in (12, 24, 48):
        sif = xc.interface_intensity(xc.solve(scenes.crack_in_planes(n, upper, lower)), 2.0)
        errors.append(np.abs(sif.K_1 + 1j * sif.K_2 - K).max() / abs(K))
    assert errors[-1] <= 5e-4
    assert np.log2(errors[0] / errors[-1]) / 2 >= 0.8


def test_another_length_turns_K_and_leaves_G():
    solution = xc.solve(scenes.crack_in_planes(12, (1.0, 0.3), (5.0, 0.3)))
    one, two = (xc.interface_intensity(solution, length) for length in (2.0, 0.01))
    turn = (0.01 / 2.0) ** (1j * one.epsilon)
    turned = (one.K_1 + 1j * one.K_2) * turn
    assert two.K_1 + 1j * two.K_2 == pytest.approx(turned, rel=1e-10)
    assert two.G == pytest.approx(one.G, rel=1e-10)


def pulled(a, ratio, load, contact="off", n=20, alphas=(None, None)):
    """Edge crack of length a along the interface of a bar of width 1."""
    mesh = xc.box((0.0, -1.0), (1.0, 1.0), (n, 2 * n))
    mesh = mesh.with_cell_sets({"one": lambda x: x[:, 1] < 0, "two": lambda x: x[:, 1] > 0})
    crack = xc.line_crack([(0.0, 0.0), (a, 0.0)])
    materials = scenes.pair(ratio, alphas=alphas)
    return xc.Problem(mesh, materials, [crack], loads=load, contact=contact)


def released(load, contact, steps):
    """Strain energy that a longer crack stores more of, under tractions: what G is besides."""
    a, b = (
        (xc.solve(pulled(0.4 + h, 4.0, load, contact)).energy
         - xc.solve(pulled(0.4 - h, 4.0, load, contact)).energy) / (2 * h)
        for h in steps
    )  # fmt: skip
    return a + (a - b) * steps[0] ** 2 / (steps[1] ** 2 - steps[0] ** 2)


def test_G_is_what_the_energy_releases():
    sif = xc.interface_intensity(xc.solve(pulled(0.4, 4.0, scenes.PULL)), 1.0)
    assert sif.G[0] == pytest.approx(released(scenes.PULL, "off", (0.02, 0.05)), rel=7e-3)
    assert sif.spread[0] <= 4e-3 * np.hypot(sif.K_1[0], sif.K_2[0])


def test_thermal_mismatch_on_an_interface():
    """Two domains agree, and what both materials expand alike counts for nothing."""
    both = [
        xc.interface_intensity(xc.solve(pulled(0.4, 4.0, [xc.temperature(t)], alphas=a)), 1.0)
        for t, a in ((1.0, (1e-2, 3e-2)), (2.0, (0.0, 1e-2)))
    ]
    for sif in both:
        assert sif.spread[0] <= 1e-2 * np.hypot(sif.K_1[0], sif.K_2[0])
    # In plane strain alpha (1 + nu) counts, which is alike here.
    assert both[0].G == pytest.approx(both[1].G, rel=1e-2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_shear_closes_a_tip(sign):
    """Where the faces press over more than a hundredth of the domain there is G alone."""
    pairs = {"top": (-1, 0), "bottom": (1, 0), "right": (0, -1), "left": (0, 1)}
    load = [xc.traction(side, sign * np.array(t, dtype=float)) for side, t in pairs.items()]
    sif = xc.interface_intensity(xc.solve(pulled(0.4, 4.0, load, "on")), 1.0)
    assert sif.G[0] == pytest.approx(released(load, "on", (0.02, 0.05)), rel=1e-2)
    if sign > 0:  # it presses at the mouth
        assert (sif.contact_zone[0], sif.reasons[0]) == (0.0, "")
        assert sif.K_2[0] < -1.0
    else:
        assert np.isnan([sif.K_1[0], sif.K_2[0]]).all()
        assert "the faces press over" in sif.reasons[0]


def sheared_crack(beta, n):
    """An interface crack of half length 1 in a shear field 1, whose faces press without friction.

    The singular integral equations of Comninou (1978, J. Appl. Mech. 45, 287) for densities B of
    dislocations, of unit compliance: σ₁₂ = ∫B₁/(x - ξ)/π + β B₂ = -1 on the crack, and where it is
    open σ₂₂ = ∫B₂/(x - ξ)/π - β B₁ = 0, by pieces of constant jumps. Where it opens by less than
    nothing it is closed, where it is pulled it is not. Returns where it begins to press, and G of
    either tip: both are the same, since no place along the interface is special.
    """
    ends = -np.cos(np.pi * np.arange(n + 1) / n)
    x = 0.5 * (ends[1:] + ends[:-1])
    pole = (1 / (x[:, None] - ends[1:]) - 1 / (x[:, None] - ends[:-1])) / np.pi
    grid, density = np.r_[-1.0, x, 1.0], np.zeros((n, n + 2))
    for i in range(n):  # by the parabola through three jumps, which are zero at the tips
        a, b, c = grid[i : i + 3]
        density[i, i : i + 3] = -np.array(
            [(b - c) / ((a - b) * (a - c)), (2 * b - a - c) / ((b - a) * (b - c)),
             (b - a) / ((c - a) * (c - b))]
        )  # fmt: skip
    density = density[:, 1:-1]
    closed = np.zeros(n, dtype=bool)
    for _ in range(50):
        free = ~closed
        matrix = np.block([[pole, beta * density[:, free]],
                           [-beta * density[free], pole[np.ix_(free, free)]]])  # fmt: skip
        jumps = np.linalg.solve(matrix, np.r_[-np.ones(n), np.zeros(free.sum())])
        slip, opening = jumps[:n], np.zeros(n)
        opening[free] = jumps[n:]
        stress = pole @ opening - beta * density @ slip
        now = (closed & (stress < 0)) | (free & (opening < 0))
        if (now == closed).all():
            break
        closed = now
    return ends[int(np.argmax(closed))], 0.5 * float(np.diff(ends) @ slip)


@pytest.mark.slow
def test_contact_in_shear_against_the_equations_of_comninou():
    """A third of the crack presses; there G holds, and K is nan with its reason."""
    mesh = xc.box((-20.0, -20.0), (20.0, 20.0), (40, 40))
    mesh = xc.refine(mesh, size=lambda x: np.maximum(0.05, 0.35 * (
        np.hypot(np.maximum(np.abs(x[:, 0]) - 1.1, 0), x[:, 1]) - 0.25)))  # fmt: skip
    mesh = mesh.with_cell_sets({"one": lambda x: x[:, 1] > 0, "two": lambda x: x[:, 1] < 0})
    one, two = xc.Isotropic(2e4, 0.0, "strain"), xc.Isotropic(1e3, 0.0, "strain")
    pairs = {"top": (1, 0), "bottom": (-1, 0), "right": (0, 1), "left": (0, -1)}
    load = [xc.traction(side, np.array(t, dtype=float)) for side, t in pairs.items()]
    problem = xc.Problem(mesh, {"one": one, "two": two}, [xc.line_crack([(-1, 0), (1, 0)])],
                         loads=load)  # fmt: skip
    solution = xc.solve(problem)
    sif = xc.interface_intensity(solution, 2.0)
    beta = (one.mu * (two.kolosov - 1) - two.mu * (one.kolosov - 1)) / (
        one.mu * (two.kolosov + 1) + two.mu * (one.kolosov + 1)
    )
    alpha = (one.E_prime - two.E_prime) / (one.E_prime + two.E_prime)
    unit = 2 * one.mu * (1 - alpha) / ((one.kolosov + 1) * (1 - beta**2))
    (begin, coarse), (fine_begin, fine) = (sheared_crack(beta, n) for n in (200, 400))
    assert begin == pytest.approx(fine_begin, abs=0.02)
    G = (2 * fine - coarse) / unit  # the pieces are of first order
    print(sif.G / G, fine_begin, sif.contact_zone)
    assert sif.G == pytest.approx(G, rel=5e-3)  # of it 2e-3 of the width of the plate
    assert sif.contact_zone[1] == pytest.approx(1 - fine_begin, abs=0.05)  # a cell
    assert sif.contact_zone[0] < 0.05  # Comninou: of 1e-7 of the crack
    assert np.isnan([sif.K_1[1], sif.K_2[1]]).all()
    assert "the faces press over" in sif.reasons[1]


def test_tips_that_are_not_on_an_interface_are_refused():
    solution = xc.solve(scenes.edge_crack(10, 0.37, 3.0))
    with pytest.raises(xc.GeometryError, match="does not run along an interface there"):
        xc.interface_intensity(solution, 1.0)
    across = xc.solve(scenes.edge_crack(10, 0.5, 3.0))
    with pytest.raises(xc.GeometryError, match="does not run along an interface there"):
        xc.interface_intensity(across, 1.0)
    with pytest.raises(xc.ProblemError, match="interface_intensity: length"):
        xc.interface_intensity(solution, -1.0)
    along = xc.solve(pulled(0.4, 3.0, scenes.PULL))
    with pytest.raises(xc.GeometryError, match="interface_intensity"):
        xc.stress_intensity(along)
