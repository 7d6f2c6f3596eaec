"""What scenes with known K give: errors and warnings, for tests and benchmarks/warnings_of_K.py."""

import warnings

import numpy as np

import xcrack as xc
from support import scenes_of_K

FINE = (64, 96)  # cells a side of the references: multiples of 8, as corners of holes are
AGREE = 3e-3  # largest difference of the two references, as a share of the largest K
CLIPPED, DIFFER, SHORT = "domain is clipped", "differ by", "contact zone"
WARNINGS = {"clipped": CLIPPED, "differ": DIFFER, "short": SHORT}


def K_of(problem):
    """K of all cracks, and the warnings on the way."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solution = xc.solve(problem)
        sif = [xc.stress_intensity(solution, c) for c in range(len(problem.cracks))]
    return sif, [str(w.message) for w in caught]


def known_K(scene):
    """Tips `(m, 2)` and K `(m, 2)` of a scene; None where two references do not agree."""
    if scene.finer is None:
        return scene.tips, scene.K
    first, second = (K_of(scene.finer(n))[0] for n in FINE)
    K = [np.concatenate([s.K for s in sif]) for sif in (first, second)]
    if K[0].shape != K[1].shape or np.abs(K[0] - K[1]).max() > AGREE * np.abs(K[1]).max():
        return None
    return np.concatenate([s.x for s in second]), K[1]


def outcome(seed, known=None, kinds=scenes_of_K.KINDS):
    """What a scene gives: error, warnings and closed tips; or why there is nothing to compare.

    Returns
    -------
    dict
        ``kind``, and ``refused`` (a word) or ``known`` (tips and K), ``error`` (the largest, as a
        share of the largest K), ``order`` of the functions and ``warned`` (which of the three
        warnings).
    """
    name = kinds[seed % len(kinds)].__name__
    try:
        _, scene = scenes_of_K.drawn_scene(seed, kinds)
        known = known_K(scene) if known is None else known
        if known is None:
            return {"kind": name, "refused": "no reference"}
        sif, messages = K_of(scene.problem)
    except xc.XcrackError as error:
        return {"kind": name, "refused": type(error).__name__}
    tips, wanted = (np.asarray(values, dtype=float) for values in known)
    x, K = np.concatenate([s.x for s in sif]), np.concatenate([s.K for s in sif])
    row = np.linalg.norm(tips - x[:, None], axis=2).argmin(axis=1) if len(x) else []
    # On a coarse mesh an end may count as a mouth: that is another scene.
    if not len(x) or (scene.finer is not None and len(x) != len(tips)):
        return {"kind": name, "refused": "other tips"}
    return {
        "kind": name,
        "known": [tips.tolist(), wanted.tolist()],
        "order": scene.problem.order,
        "error": float(np.abs(K - wanted[row]).max() / np.abs(wanted).max()),
        "warned": [k for k, word in WARNINGS.items() if any(word in text for text in messages)],
    }
