"""Other codes on the same scenes, measured once on two cores of an AMD EPYC (Zen 4), one thread.

They are drawn hollow, unless the same code ran in the chart. Seconds are the least of up to three
runs, without imports; K is the worse of the modes (edge crack) or the mean of K_I (penny).
"""

from collections.abc import Iterable

Point = tuple[int, float, float]  # unknowns, error, seconds

# scene -> code -> points
QUOTED: dict[str, dict[str, tuple[Point, ...]]] = {
    "edge": {
        "GetFEM 5.4 XFEM, Q1, radius": (
            (1424, 1.26e-3, 0.343), (5272, 2.33e-4, 0.519), (20168, 3.82e-5, 1.382),
        ),
        "GetFEM 5.4 XFEM, Q2, radius": (
            (1246, 3.27e-3, 0.228), (4234, 2.10e-4, 0.343), (15682, 1.79e-5, 0.999),
        ),
        "XFEM_Fracture2D, Q4 (Octave)": (
            (1236, 3.14e-3, 0.675), (3776, 1.35e-3, 0.952), (13656, 5.45e-4, 1.693),
        ),
        "NGSolve conforming, P4": ((17490, 1.77e-5, 0.242), (34506, 1.92e-6, 0.414)),
    },
    "closed": {
        "scikit-fem conforming, matching nodes": (
            (3406, 9.0e-5, 0.078), (11594, 1.0e-5, 0.295), (55022, 1.05e-6, 2.66),
        ),
        "GetFEM 5.4 XFEM, Q2, augmented": (
            (1246, 2.9e-3, 0.242), (4234, 2.1e-4, 0.359), (15682, 1.8e-5, 1.03),
        ),
    },
    "penny": {
        "NGSolve conforming, P2": ((33513, 1.73e-2, 7.30), (75333, 8.7e-3, 38.5)),
        "scikit-fem conforming, direct solver": (
            (9252, 9.5e-3, 3.45), (33513, 3.3e-3, 9.98), (75333, 1.8e-3, 30.9),
        ),
    },
}  # fmt: skip


def to_draw(scene: str, ran: Iterable[str]) -> dict[str, tuple[Point, ...]]:
    """Curves of a scene that are quoted: those of codes that did not run.

    Parameters
    ----------
    scene : str
    ran : iterable of str
        Names of the series that ran; a code is the first word of such a name.

    Returns
    -------
    dict
    """
    codes = {name.split()[0] for name in ran}
    quoted = QUOTED.get(scene, {})
    return {name: points for name, points in quoted.items() if name.split()[0] not in codes}
