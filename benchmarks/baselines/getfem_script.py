"""GetFEM's XFEM on scenes of the charts: a program of its own, for a Python that has getfem.

It needs numpy and getfem and nothing of xcrack: where GetFEM comes with the system its Python may
be older, and its numpy another. Requests are lines of JSON on stdin, answers lines of JSON on
stdout; whatever GetFEM itself prints goes to stderr.

The method is that of Laborde, Pommier, Renard and Salaün (2005): four tip functions times a linear
partition of unity on all nodes within a fixed radius of a tip, a step across the rest of the crack,
on rectangles of order 1 or 2. Closed faces: an augmented Lagrangian (Alart and Curnier, 1991).
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np

try:
    import getfem as gf
except ImportError:  # this file can be read without
    gf = None

E, NU = 1.0, 0.3  # plane strain
MU = E / (2 * (1 + NU))
LAMBDA = E * NU / ((1 + NU) * (1 - 2 * NU))
KOLOSOV = 3 - 4 * NU
E_PRIME = E / (1 - NU**2)
RADIUS = 0.4  # nodes that carry tip functions
RING = (0.3, 0.7)  # of the domain integral
MOVE = 0.15  # of a cell, by which a seed moves the lines of the lattice
AUGMENTED = 10.0  # times E over the cell size
OPENING = 2.0 / 3.0  # half length of the open part of the crack in bending
SIDES, LEFT, LIPS, RING_CELLS = 1, 2, 3, 4  # regions of a mesh


@dataclass(frozen=True)
class Scene:
    """A crack on y = 0, and supports and loads of the square around it.

    Attributes
    ----------
    half : float
        Of the side of the square.
    behind : str
        A function that is negative on the crack and falls by one a length at its tips.
    tips : tuple of (float, float)
        x of each tip, and 1 or -1: the direction ahead.
    u : callable (x (2, n)) -> (2, n)
        Displacements on the sides.
    modes : (float, float), optional
        K_I and K_II of the traction on the left, which is then not supported.
    pressure : callable (x (n,)) -> (n,), optional
        Exact pressure between the crack faces; without it the scene has no contact.
    """

    half: float
    behind: str
    tips: tuple[tuple[float, float], ...]
    u: Callable[[Any], Any]
    modes: tuple[float, float] | None = None
    pressure: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class LevelSolution:
    """A solved scene; `alive` has what GetFEM needs but does not keep alive itself."""

    scene: Scene
    lines: tuple[Any, Any]
    mesh: Any
    cells: Any
    corners: Any
    volume: Any
    model: Any
    unknowns: int
    lips: Any
    alive: tuple[Any, ...]


def main() -> None:
    """Answer requests until the input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    gf.util_trace_level(0)
    gf.util_warning_level(0)
    for line in sys.stdin:
        try:
            answer = answered(json.loads(line))
        except Exception as error:
            answer = {"failed": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def answered(request: dict[str, Any]) -> dict[str, Any]:
    """Errors, unknowns and seconds of one run.

    Parameters
    ----------
    request : dict
        scene, n (cells a side, odd), order (1 or 2), seed (None: a regular lattice).
    """
    wall, processor = perf_counter(), process_time()
    solved, errors = run(request["scene"], request["n"], request["order"], request["seed"])
    wall, processor = perf_counter() - wall, process_time() - processor
    if request["scene"] == "edge":  # no part of the work
        errors["energy"] = energy_error(solved)
    took = {"wall": wall, "processor": processor}
    return {"errors": errors, "unknowns": solved.unknowns, **took}


def run(name: str, n: int, order: int, seed: int | None) -> tuple[LevelSolution, dict[str, float]]:
    """Solve a scene and compare K and pressures with the exact ones."""
    solved = solution(SCENES[name], n, order, seed)
    K = [intensity(solved, *tip) for tip in solved.scene.tips]
    if name == "edge":
        return solved, {"K": float(np.max(np.abs(K[0] / np.array(_OPEN) - 1)))}
    if name == "closed":
        errors = {"K_II": abs(K[0][1] / _SLIDING[1] - 1), "K_I": abs(K[0][0]) / _SLIDING[1]}
    else:
        exact = OPENING * np.sqrt(np.pi * OPENING)
        errors = {"K_I": abs(K[0][0] / exact - 1), "K_I, closed tip": abs(K[1][0]) / exact}
    errors["pressure"] = pressure_error(solved)
    return solved, {name: float(value) for name, value in errors.items()}


def solution(scene: Scene, n: int, order: int, seed: int | None) -> LevelSolution:
    """Displacements, and pressures where there is contact, of a lattice of n x n rectangles."""
    lines = lattice(scene.half, n, seed)
    mesh = gf.Mesh("cartesian", *lines)
    crack = gf.LevelSet(mesh, 1, "y", scene.behind)
    cut = gf.MeshLevelSet(mesh)
    cut.add(crack)
    cut.adapt()
    space, parts = displacements(scene, mesh, crack, cut, order)
    # The cheapest points that leave errors as they are: tip functions reach into whole cells.
    volume = gf.MeshIm("levelset", cut, "all", *rules(1, 3, 10))
    model = gf.Model("real")
    model.add_fem_variable("u", space)
    model.add_initialized_data("first", [LAMBDA])
    model.add_initialized_data("second", [MU])
    model.add_isotropic_linearized_elasticity_brick(volume, "u", "first", "second")
    support(scene, mesh, space, model)
    if scene.modes is not None:
        pressure = float(scene.pressure(np.zeros(1))[0]) if scene.pressure else 0.0
        model.add_source_term(volume, f"-({traction(scene.modes, pressure)}).Test_u", LEFT)
    cells, corners = mesh.cvid(), mesh.pts_from_cvid()[0].reshape(2, -1, 4)
    lips = None
    if scene.pressure is not None:
        lips = gf.MeshIm("levelset", cut, "boundary", *rules(3, 6, 1)[:2])
        x, y = corners
        along = (y.min(axis=1) < 0) & (y.max(axis=1) > 0) & on_crack(scene, x)
        mesh.set_region(LIPS, np.array([cells[along]]))
        parts += (contact(mesh, cells[along], order, n, scene, model, lips),)
    # One step for a linear scene; Newton's, and the active set with it, for one in contact.
    steps = 40 if scene.pressure is not None else 1
    count, converged = model.solve("max_res", 1e-8, "max_iter", steps, "lsolver", "mumps")
    if not converged:
        raise RuntimeError(f"no solution after {count} steps")
    return LevelSolution(
        scene, lines, mesh, cells, corners, volume, model, int(space.nbdof()), lips,
        (crack, cut, space, *parts),
    )  # fmt: skip


def lattice(half: float, n: int, seed: int | None) -> tuple[Any, Any]:
    """Lines of the lattice: those inside moved, so that cells stay rectangles."""
    lines = np.linspace(-half, half, n + 1), np.linspace(-half, half, n + 1)
    if seed is not None:
        generator = np.random.default_rng(seed)
        for x in lines:
            x[1:-1] += MOVE * 2 * half / n * generator.uniform(-1, 1, n - 1)
    return lines


def on_crack(scene: Scene, x: Any) -> Any:
    """Whether cells with these corners touch the range of the crack."""
    last = max(tip for tip, _ in scene.tips)
    first = min((tip for tip, ahead in scene.tips if ahead < 0), default=-np.inf)
    return (x.min(axis=1) < last) & (x.max(axis=1) > first)


def displacements(
    scene: Scene, mesh: Any, crack: Any, cut: Any, order: int
) -> tuple[Any, tuple[Any, ...]]:
    """The space of displacements and what it is made of."""
    plain = gf.MeshFem(mesh)
    plain.set_fem(gf.Fem(f"FEM_QK(2,{order})"))
    jumping = gf.MeshFem("levelset", cut, plain)
    functions = [gf.GlobalFunction("crack", i) for i in range(4)]
    singular = gf.MeshFem("global function", mesh, crack, functions, 1)
    unity = gf.MeshFem(mesh)
    unity.set_fem(gf.Fem("FEM_QK(2,1)"))
    x, y = unity.basic_dof_nodes()
    near = np.min([np.hypot(x - tip, y) for tip, _ in scene.tips], axis=0) < RADIUS
    tips = gf.MeshFem("product", unity, singular)
    tips.set_enriched_dofs(np.nonzero(near)[0])
    space = gf.MeshFem("sum", tips, jumping)
    space.set_qdim(2)
    return space, (plain, jumping, singular, unity, tips)


def rules(parts: int, polar: int, order: int) -> tuple[Any, Any, Any]:
    """Integration over triangles of cut cells, around a tip, and over whole cells."""
    return (
        gf.Integ(f"IM_STRUCTURED_COMPOSITE(IM_TRIANGLE(6),{parts})"),
        gf.Integ(f"IM_STRUCTURED_COMPOSITE(IM_GAUSS_PARALLELEPIPED(2,6),{polar})"),
        gf.Integ(f"IM_GAUSS_PARALLELEPIPED(2,{order})"),
    )


def support(scene: Scene, mesh: Any, space: Any, model: Any) -> None:
    """Impose the displacements on the sides, node by node; they are the start of Newton's method.

    A penalty would do, but its forces hide the residual by which an active set is judged.
    """
    faces = mesh.outer_faces()
    left = (mesh.normal_of_faces(faces)[0] < -0.5) & (scene.modes is not None)
    mesh.set_region(LEFT, faces[:, left])
    mesh.set_region(SIDES, faces[:, ~left])
    on = space.basic_dof_on_region(SIDES)
    u = np.zeros(space.nbdof())
    u[on] = scene.u(space.basic_dof_nodes()[:, on])[on % 2, np.arange(len(on))]
    model.add_initialized_fem_data("known", space, u)
    model.add_Dirichlet_condition_with_simplification("u", SIDES, "known")
    model.set_variable("u", u)


def contact(
    mesh: Any, cells: Any, order: int, n: int, scene: Scene, model: Any, lips: Any
) -> Any:  # fmt: skip
    """Pressures on the crack faces: a constant a cell at order 1, continuous and linear at order 2.

    Linear ones can be unstable beside displacements of order 1, constant ones were sound there.
    """
    space = gf.MeshFem(mesh)
    space.set_fem(gf.Fem(f"FEM_QK(2,{order - 1})"), cells)
    if order == 2:  # both ends of a line of the lattice share their value
        _, shared = np.unique(space.basic_dof_nodes()[0].round(9), return_inverse=True)
        spread = np.equal.outer(shared, np.arange(shared.max() + 1)).astype(float)
        space.set("reduction matrices", sparse((spread / spread.sum(axis=0)).T), sparse(spread))
    model.add_fem_variable("p", space)
    model.set_variable("p", np.ones(space.nbdof()))  # closed until they open
    model.add_initialized_data("r", [AUGMENTED * E * n / (2 * scene.half)])
    gap = "((Xfem_plus(u)-Xfem_minus(u)).[0;1])"
    test = "((Xfem_plus(Test_u)-Xfem_minus(Test_u)).[0;1])"
    pushed = f"pos_part(p-r*{gap})"
    model.add_nonlinear_term(
        lips, f"(1/r)*({pushed}-p)*Test_p-{pushed}*{test}", LIPS, True, False
    )  # fmt: skip
    return space


def sparse(values: Any) -> Any:
    """A matrix of GetFEM's with the values that are not zero."""
    matrix = gf.Spmat("empty", *values.shape)
    for i, j in zip(*np.nonzero(values)):
        matrix.assign(int(i), int(j), float(values[i, j]))
    return matrix


def points(solved: LevelSolution, rule: Any, cells: Any) -> tuple[Any, Any]:
    """Places (q, 2) and weights (q,) of the integration points of cells."""
    x, y, weight = rule.im_nodes(np.array([cells], dtype=np.int32))
    for at, lines in zip((x, y), solved.lines):  # weights of GetFEM are those of a unit cell
        weight = weight * np.diff(lines)[np.searchsorted(lines, at) - 1]
    return np.stack([x, y], axis=1), weight


def gradients(solved: LevelSolution, rule: Any, cells: Any) -> Any:
    """Displacement gradients (q, 2, 2) at those points."""
    solved.mesh.set_region(RING_CELLS, np.array([cells]))
    data = gf.MeshImData(rule, RING_CELLS, [2, 2])
    flat = solved.model.interpolation("Grad_u", data, RING_CELLS)
    return np.swapaxes(flat.reshape(-1, 2, 2), 1, 2)  # columns come first


def intensity(solved: LevelSolution, tip: float, ahead: float) -> Any:
    """K_I and K_II by the interaction integral over a ring around a tip.

    The pressure between the crack faces works on the opening of the auxiliary field of mode I.
    """
    inner, outer = RING
    r = np.hypot(solved.corners[0] - tip, solved.corners[1])
    cells = solved.cells[(r.max(axis=1) > inner) & (r.min(axis=1) < outer)]
    x, weight = points(solved, solved.volume, cells)
    turn = np.diag([ahead, 1.0])  # at a left end the frame is mirrored, and K_II with it
    y, gradient = (x - [tip, 0.0]) @ turn, turn @ gradients(solved, solved.volume, cells) @ turn
    r = np.hypot(*y.T)
    t = np.clip((r - inner) / (outer - inner), 0, 1)
    slope = -6 * t * (1 - t) / (outer - inner)  # of the cubic that falls from 1 to 0
    q = (slope / r)[:, None] * y
    other = np.stack([williams_gradient((1, 0), y), williams_gradient((0, 1), y)])
    sigma, auxiliary = stress_of(gradient), stress_of(other)
    flux = np.einsum("qij,mqi->mqj", sigma, other[..., 0])
    flux += np.einsum("mqij,qi->mqj", auxiliary, gradient[..., 0])
    flux[..., 0] -= np.einsum("qij,mqij->mq", sigma, other)
    K = E_PRIME / 2 * np.einsum("mqj,qj,q->m", flux, q, weight)
    if solved.lips is not None:
        s, w = np.polynomial.legendre.leggauss(40)
        s, w = (s + 1) / 2, w / 2
        r = outer * s**2  # the auxiliary opening is singular at the tip
        t = np.clip((r - inner) / (outer - inner), 0, 1)
        opening = (KOLOSOV + 1) / (2 * MU) / np.sqrt(2 * np.pi * r)
        p = pressures(solved, tip - ahead * r)
        K[0] += E_PRIME / 2 * (p * (1 - 3 * t**2 + 2 * t**3) * opening) @ (2 * outer * s * w)
    return K


def pressures(solved: LevelSolution, x: Any) -> Any:
    """Pressure between the crack faces at places along them."""
    at = np.stack([x, np.zeros_like(x)])
    return solved.model.interpolation("p", at, solved.mesh, LIPS)


def pressure_error(solved: LevelSolution) -> float:
    """Relative error of the pressure, root of the mean square along the crack."""
    x, weight = points(solved, solved.lips, solved.mesh.region(LIPS)[0])
    assert solved.scene.pressure is not None
    exact = solved.scene.pressure(x[:, 0])
    wrong = pressures(solved, x[:, 0]) - exact
    return float(np.sqrt(weight @ wrong**2 / (weight @ exact**2)))


def energy_error(solved: LevelSolution) -> float:
    """Relative error in the energy norm, by finer integration than that of the solution."""
    fine = gf.MeshIm("levelset", solved.alive[1], "all", *rules(4, 9, 14))
    x, weight = points(solved, fine, solved.cells)
    assert solved.scene.modes is not None
    exact = stress_of(williams_gradient(solved.scene.modes, x))
    computed = stress_of(gradients(solved, fine, solved.cells))
    wrong, total = (energy(s) @ weight for s in (computed - exact, exact))
    return float(np.sqrt(wrong / total))


def stress_of(gradient: Any) -> Any:
    """Stress of displacement gradients, by Hooke's law."""
    trace = np.trace(gradient, axis1=-2, axis2=-1)[..., None, None]
    return MU * (gradient + np.swapaxes(gradient, -1, -2)) + LAMBDA * trace * np.eye(2)


def energy(stress: Any) -> Any:
    """Twice the energy of a volume in plane strain."""
    trace = np.trace(stress, axis1=-2, axis2=-1)
    return (1 + NU) / E * (np.einsum("qij,qij->q", stress, stress) - NU * trace**2)


def williams(K: tuple[float, float], pressure: float, x: Any) -> Any:
    """Displacements (2, n) of Williams (1957) and a uniform pressure, tip at 0, crack on x < 0.

    Muskhelishvili's form: 2 mu (u + i v) = kappa f(z) - f(z*) - (z - z*) f'(z)*.
    """
    z, mixed = x[0] + 1j * x[1], K[0] - 1j * K[1]
    slope = mixed / (2 * np.sqrt(2 * np.pi * z))
    u = mixed * (KOLOSOV * np.sqrt(z) - np.sqrt(z.conj())) / np.sqrt(2 * np.pi)
    u = (u - 2j * x[1] * slope.conj()) / (2 * MU)
    return np.stack([u.real, u.imag]) - pressure * (1 + NU) * (1 - 2 * NU) / E * np.asarray(x)


def williams_gradient(K: tuple[float, float], x: Any) -> Any:
    """Gradients (n, 2, 2) of that field at points (n, 2), without the pressure."""
    z, mixed = x[:, 0] + 1j * x[:, 1], K[0] - 1j * K[1]
    slope, mirrored = (mixed / (2 * np.sqrt(2 * np.pi * w)) for w in (z, z.conj()))
    bend = 2j * x[:, 1] * (-slope / (2 * z)).conj()
    along = (KOLOSOV * slope - mirrored - bend) / (2 * MU)
    across = 1j * (KOLOSOV * slope + mirrored - 2 * slope.conj() + bend) / (2 * MU)
    return np.array([[along.real, across.real], [along.imag, across.imag]]).transpose(2, 0, 1)


def traction(K: tuple[float, float], pressure: float) -> str:
    """Stresses xx and xy of that field, written for GetFEM."""
    half = "(atan2(X(2),X(1))/2)"
    c, s, c3, s3 = f"cos{half}", f"sin{half}", f"cos(3*{half})", f"sin(3*{half})"
    xx = f"{K[0]}*{c}*(1-{s}*{s3})-{K[1]}*{s}*(2+{c}*{c3})"
    xy = f"{K[0]}*{s}*{c}*{c3}+{K[1]}*{c}*(1-{s}*{s3})"
    return f"[{xx};{xy}]/sqrt(2*pi*Norm(X))-[{pressure};0]"


def bent(x: Any) -> Any:
    """Displacements around the crack [-1, 1] whose remote stress is x: Westergaard (1939)."""
    c = OPENING
    middle = 1 - c
    z = x[0] - middle + 1j * x[1]
    root = np.sqrt(z - c) * np.sqrt(z + c)
    Z, whole = (middle * z + z * z - c * c / 2) / root, root * (middle + z / 2)
    u = (KOLOSOV - 1) / 2 * whole.real - x[1] * Z.imag
    v = (KOLOSOV + 1) / 2 * whole.imag - x[1] * Z.real
    return np.stack([u, v]) / (2 * MU)


def bent_pressure(x: Any) -> Any:
    """Pressure between the faces of that crack."""
    c = OPENING
    r = np.abs(x - (1 - c))
    p = (r + c / 2) * np.sqrt(np.maximum(r - c, 0) / (r + c))
    return np.where(x < 1 - 2 * c, p, 0.0)


_OPEN, _SLIDING = (1.0, 0.5), (0.0, 0.5)
SCENES = {
    "edge": Scene(1.0, "x", ((0.0, 1.0),), partial(williams, _OPEN, 0.0), _OPEN),
    "closed": Scene(
        1.0, "x", ((0.0, 1.0),), partial(williams, _SLIDING, 1.0), _SLIDING, np.ones_like
    ),
    "half_closed": Scene(
        2.0, "abs(x)-1", ((1.0, 1.0), (-1.0, -1.0)), bent, None, bent_pressure
    ),
}  # fmt: skip


if __name__ == "__main__":
    main()
