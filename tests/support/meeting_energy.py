"""Energy of steps of growth in space against the release of their fronts over the new area."""

import numpy as np

from xcrack.crack.junctions_3d import body_before
from xcrack.growth.gaps import annulus_factors
from xcrack.mesh.locate import Body

SAMPLES = 12  # along each side of a face


def areas(step):
    """Of the faces of each crack that count."""
    result = []
    body = Body.of(step.solutions[-1].problem.mesh)
    t = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v = (a.ravel() for a in np.meshgrid(t, t))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    for c, crack in enumerate(step.cracks):
        side = body_before(step.cracks, c, body) if crack.ends_on else body
        corner = crack.points[crack.faces]
        one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        x = corner[:, None, 0] + u[:, None] * one[:, None] + v[:, None] * other[:, None]
        share = side.contains(x.reshape(-1, 3)).reshape(len(corner), -1).mean(axis=1)
        result.append(float(share @ np.linalg.norm(np.cross(one, other), axis=1)) / 2)
    return np.array(result)


def release(step, E, nu):
    """Mean energy release rate of each crack."""
    K = [sif.K for sif in step.sif[-1]]
    return np.array(
        [
            ((k[:, :2] ** 2).sum(axis=1) * (1 - nu**2) + k[:, 2] ** 2 * (1 + nu)).mean() / E
            for k in K
        ]
    )


def released(steps, E, nu):
    """Energy of each step after the first, what it has more than the one before, and that by K."""
    result = []
    for one, other in zip(steps, steps[1:]):
        rates, sizes = [release(step, E, nu) for step in (one, other)], [areas(one), areas(other)]
        if len(rates[0]) != len(rates[1]):  # some have become one
            rates = [np.array([g @ a / a.sum()]) for g, a in zip(rates, sizes, strict=True)]
            sizes = [a.sum(keepdims=True) for a in sizes]
        by_K = 0.5 * (rates[0] + rates[1]) @ (sizes[1] - sizes[0])
        energy = other.solutions[-1].energy
        result.append((energy, energy - one.solutions[-1].energy, by_K))
    return np.array(result).T


def unbalanced(steps, E, nu):
    """What of the energy of each step after the first no release over the new area explains."""
    energy, more, by_K = released(steps, E, nu)
    return (more - by_K) / energy


def released_by_annulus(before, after, E, nu, m, n=400):
    """Integral of G dA over the step that breaks the ligament of an annulus about the z-axis.

    K of both fronts goes on from what was solved before it as that of an annulus does, and comes to
    what was solved behind it.
    """
    sif = before.sif[-1][0]
    radii = np.linalg.norm(sif.x[:, :2], axis=1)
    rows = [sif.front == f for f in np.unique(sif.front)]
    inner, outer = sorted(rows, key=lambda of: radii[of].mean())
    c, b = (radii[of].mean() for of in (inner, outer))
    first = np.array([(sif.K_I[of] ** 2).mean() * (1 - nu**2) / E for of in (inner, outer)])
    speed = before.rate[0][outer].mean() / before.rate[0][inner].mean()
    disc = after.sif[-1][0]
    last = (disc.K_I**2).mean() * (1 - nu**2) / E

    def ratios(c, b):  # of K, that of the inner front times the root of its radius
        return np.array(annulus_factors(c / b)) * [b, np.sqrt(b)]

    start, energy, radius = ratios(c, b), 0.0, c
    final = ratios(0.0, np.linalg.norm(disc.x[:, :2], axis=1).mean())
    beside = last / first[1] / (final[1] / start[1]) ** 2
    for s in 1 - (np.arange(n) + 0.5) / n:
        radius, way = c * s**2, 2 * c * s / n
        K = ratios(radius, b) / start / [s, 1.0]
        G = first * K**2 * beside ** (1 - s**2)
        growth = way * speed * (K[1] / K[0]) ** m
        energy += 2 * np.pi * (G[0] * radius * way + G[1] * b * growth)
        b += growth
    return energy


def cut_shares(step):
    """Area over which the cells are cut by each crack, over that of its faces in the body."""
    lips = np.array([lips.weight.sum() for lips in step.solutions[-1].lips])
    return lips / areas(step)
