"""Cases of campaigns: functions of a module, as processes need them."""

import os
import time
from pathlib import Path

import numpy as np

import xcrack as xc
from xcrack.errors import ProblemError


def formula(a, load=1.0):
    """A life by a formula; some cases fail in one way or the other."""
    if a == 3:
        raise ProblemError("no crack of 3.")
    if a == 4:
        raise ZeroDivisionError("nobody expected this")
    return {"life": 1e6 / (a * load**3), "text": "done"}


def counted(a, folder):
    """A case that leaves a mark each time it is run, and kills its process where asked to."""
    marks = Path(folder)
    with open(marks / f"ran_{a}", "a") as file:
        file.write("x")
    if (marks / f"kill_{a}").exists():
        (marks / f"kill_{a}").unlink()
        time.sleep(0.2)
        os._exit(9)
    return {"twice": 2.0 * a}


def plate(a, stress):
    """A growing edge crack."""
    mesh = xc.box((0, -10), (20, 10), (12, 13))
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
        xc.grow(problem, law, xc.max_hoop_stress, cycle, da=1.0, max_steps=3, progress=False)
    )


def drawn(n, seed):
    """Parameters of random cracks."""
    rng = np.random.default_rng(seed)
    return [{"a": float(a), "stress": 100.0} for a in rng.uniform(4.0, 8.0, n)]
