"""Cases of campaigns: functions of a module, as processes need them."""

import os
import sys
import time
import warnings
from pathlib import Path

import numpy as np

import xcrack as xc
from xcrack import ProblemError


def formula(a, load=1.0):
    """A life by a formula; some cases fail in one way or the other."""
    if a == 3:
        raise ProblemError("no crack of 3.")
    if a == 4:
        raise ZeroDivisionError("nobody expected this")
    return {"life": 1e6 / (a * load**3), "text": "done"}


def counted(a, folder):
    """A case that leaves a mark each time it is run, and kills its process where asked to.

    Once where a file asks for it, each time where that is a folder.
    """
    marks = Path(folder)
    with open(marks / f"ran_{a}", "a") as file:
        file.write("x")
    if (marks / f"kill_{a}").exists():
        if (marks / f"kill_{a}").is_file():
            (marks / f"kill_{a}").unlink()
        time.sleep(0.2)
        os._exit(9)
    return {"twice": 2.0 * a}


def waiting(a, folder, wait):
    """A case that takes its time."""
    time.sleep(wait)
    return {"twice": 2.0 * a}


def process(a):
    """Which process a case is run by; long enough for all to have one."""
    time.sleep(0.1)
    return {"pid": os.getpid()}


def small_plate(a, marks):
    """An edge crack in a coarse plate, and a mark that it was run."""
    folder = Path(marks)
    folder.mkdir(exist_ok=True)
    with open(folder / f"{a:.15g}", "a") as file:
        file.write("x")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return plate(a, 100.0, cells=(8, 9), steps=2)


def marked(n, marks):
    """Parameters of `small_plate`."""
    return [{"a": each["a"], "marks": str(marks)} for each in drawn(n, 20269)]


def plate(a, stress, cells=(12, 13), steps=3):
    """A growing edge crack."""
    mesh = xc.box((0, -10), (20, 10), cells)
    problem = xc.Problem(
        mesh,
        xc.Isotropic(E=210e3, nu=0.3, plane="strain"),
        cracks=[xc.line_crack([(0, 0.4), (a, 0.4)])],
        supports=[xc.fix((20, -10)), xc.fix((20, 10), axis=0)],
        loads=[xc.traction("top", (0, stress)), xc.traction("bottom", (0, -stress))],
    )
    law = xc.paris(1e-13, 3.0)
    cycle = xc.Cycle(0.0, 1.0)
    return xc.collect(
        xc.grow(problem, law, xc.max_hoop_stress, cycle, da=1.0, max_steps=steps, progress=False)
    )


def drawn(n, seed):
    """Parameters of random cracks."""
    rng = np.random.default_rng(seed)
    return [{"a": float(a), "stress": 100.0} for a in rng.uniform(4.0, 8.0, n)]


if __name__ == "__main__":  # a script that a test kills
    from support import campaign_cases

    study, count, workers = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    xc.campaign(
        campaign_cases.small_plate,
        campaign_cases.marked(count, study.parent / "marks"),
        path=study,
        workers=workers,
    )
