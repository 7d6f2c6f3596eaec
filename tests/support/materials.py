"""Scenes of several materials: those of the verification book, and what tests need besides."""

import numpy as np

import xcrack as xc
from xcrack.verification.book.scenes_materials import (
    EDGE_CRACKS,
    GRADED,
    MIXED_MODES,
    PULL,
    THERMAL,
    crack_in_planes,
    edge_crack,
    graded_plate,
    heated,
    layered_strip,
    pair,
    perturbed,
    slanted_crack,
    square,
    stretch,
    strip,
    with_halves,
)


def drawn_points(seed):
    """Points of a unit square away from both its middle lines."""
    x = np.random.default_rng(seed).uniform(0.01, 0.99, (1500, 2))
    return x[(np.abs(x - 0.5) > 1e-3).all(axis=1)]


def without_motion(x, u):
    """Displacements less the rigid motion that fits them best."""
    one, zero = np.ones(len(x)), np.zeros(len(x))
    modes = np.stack([np.r_[one, zero], np.r_[zero, one], np.r_[-x[:, 1], x[:, 0]]], axis=1)
    flat = u.T.ravel()
    return flat - modes @ np.linalg.lstsq(modes, flat, rcond=None)[0]


def drawn_inf_sup(rng, order):
    """Inf-sup constant of a crack through an interface."""
    n = 2 * int(rng.integers(4, 13)), int(rng.integers(8, 26))
    x = xc.box((0.0, 0.0), (1.0, 1.0), n)
    mesh = perturbed(n, 0, int(rng.integers(1 << 30)))
    assert len(mesh.cells) == len(x.cells)
    angle, y = rng.uniform(-1.2, 1.2), rng.uniform(0.3, 0.7)
    along, (back, ahead) = np.array([np.cos(angle), np.sin(angle)]), rng.uniform(0.12, 0.28, 2)
    centre = np.array([0.5, y])
    crack = xc.line_crack([centre - back * along, centre + ahead * along])
    one, two = xc.Isotropic(1.0, 0.3, "strain"), xc.Isotropic(1.000001, 0.3, "strain")
    return xc.inf_sup(xc.Problem(mesh, {"one": one, "two": two}, [crack], order=order))


__all__ = [
    "EDGE_CRACKS", "GRADED", "MIXED_MODES", "PULL", "THERMAL", "crack_in_planes", "drawn_inf_sup",
    "drawn_points", "edge_crack", "graded_plate", "heated", "layered_strip", "pair", "perturbed",
    "slanted_crack", "square", "stretch", "strip", "with_halves", "without_motion",
]  # fmt: skip
