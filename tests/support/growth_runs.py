"""Growth runs with K from a formula, their folders, and ways to disturb them."""

import os
from functools import cache

import pytest

from support.growth_fakes import formula, mode_I, plate
from xcrack import Cycle, collect, grow, line_crack, paris, weighted_angle
from xcrack.runs import store
from xcrack.runs.run_folder import MESH

LAW = paris(C=1e-11, m=3.0)
CYCLE = Cycle(0.0, 1.0)
N_STEPS = 5


def both_modes(problem, c):
    """K of two cracks that turn: all digits of every array are in use."""
    K_I = mode_I()(problem, c)[0][0]
    return [[K_I * (1.0 + 0.31 * c), K_I * 0.217 * (-1) ** len(problem.placed[c].points)]]


RESPONSE = formula(both_modes)


@cache
def scene():
    return plate([line_crack([(0, 8.3), (5, 8.3)]), line_crack([(0, -8.3), (4.1, -8.5)])])


def run_of(problem=None, **changes):
    """Arguments of a run, the same for grow and resume."""
    options = {"da": 1.7, "max_steps": N_STEPS, "law": LAW, "criterion": weighted_angle}
    options |= {"cycle": CYCLE, "problem": problem or scene(), "response": RESPONSE, **changes}
    return options


@pytest.fixture
def whole(tmp_path):
    """A run that nothing disturbed."""
    return collect(grow(**run_of()), tmp_path / "whole")


def content(folder):
    """Files of a run, but for what was moved aside, and the body that pictures are made with."""
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name != MESH)
    return {path.name: path.read_bytes() for path in files}


def assert_same(history, expected):
    """Equal to the last bit: the numbers, and the files."""
    assert history.ended == expected.ended
    assert history.table().tobytes() == expected.table().tobytes()
    for a, b in zip(history.cracks, expected.cracks, strict=True):
        assert a.points.tobytes() == b.points.tobytes()
        assert a.tips == b.tips
    assert content(history.path) == content(expected.path)


class Killed(BaseException):
    """Stands for SIGKILL: nothing may catch it and tidy up."""


class Saboteur:
    """Raises at the n-th call that touches the disk, in a write at half of its bytes."""

    def __init__(self, monkeypatch, n, make=Killed):
        self.n, self.count, self.make = n, 0, make
        real_open = open

        def opened(path, mode="r", **rest):
            self.tick()
            file = real_open(path, mode, **rest)
            return Half(file, self.tick) if "w" in mode else file

        def wrapped(call):
            return lambda *arguments: (self.tick(), call(*arguments))[1]

        monkeypatch.setattr(store, "open", opened, raising=False)
        # no power is cut here: to wait for the disk would only take time
        monkeypatch.setattr(store.os, "fsync", wrapped(lambda number: None))
        monkeypatch.setattr(store.os, "replace", wrapped(os.replace))

    def tick(self, last_deed=lambda: None):
        self.count += 1
        if self.count == self.n:
            last_deed()
            raise self.make()


class Half:
    """A file that is written in two halves; a BufferedWriter has no write that can be replaced."""

    def __init__(self, file, tick):
        self.file, self.tick = file, tick

    def write(self, data):
        self.tick(lambda: self.file.write(data[: len(data) // 2]))
        return self.file.write(data)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.file.close()  # what the system does with a dead process' files

    def __getattr__(self, name):
        return getattr(self.file, name)


__all__ = [
    *("CYCLE", "LAW", "N_STEPS", "Killed", "Saboteur", "assert_same", "both_modes", "content"),
    *("run_of", "scene", "whole"),
]
