"""Solutions and histories through files: the same to the last bit, and no pickle."""

import numpy as np
import pytest

import xcrack as xc

pytestmark = pytest.mark.filterwarnings("ignore::xcrack.XcrackWarning")


def plate(pull=(0.0, 80.0)):
    loads = [xc.traction("top", pull), xc.traction("bottom", (0.0, -80.0))]
    crack = xc.line_crack([(-0.31, -0.11), (0.29, 0.12)])
    steel = xc.Isotropic(E=210e3, nu=0.3, plane="strain")
    return xc.Problem(xc.box((-1, -1), (1, 1), 12), steel, [crack], loads=loads)


def block():
    loads = [xc.traction("top", (0, 0, 100.0)), xc.traction("bottom", (0, 0, -100.0))]
    crack = xc.penny_crack((0.0, 0.0, 0.04), (0.3, 0, 1), 0.5, n=32)
    mesh = xc.box((-1, -1, -1), (1, 1, 1), 5)
    return xc.Problem(mesh, xc.Isotropic(E=210e3, nu=0.3), [crack], loads=loads, order=1)


@pytest.mark.parametrize("make", [plate, block])
def test_solutions_come_back_to_the_last_bit(make, tmp_path):
    solutions = xc.solve(make(), [1.0, -1.0])
    again = xc.load(xc.save(solutions, tmp_path / "new" / "states"))
    assert len(again) == 2
    for old, new in zip(solutions, again, strict=True):
        assert new.state == old.state
        assert new.energy == old.energy
        assert str(new.report) == str(old.report)
        assert new.opening().tobytes() == old.opening().tobytes()
        K, wanted = (xc.stress_intensity(s) for s in (new, old))
        assert K.K.tobytes() == wanted.K.tobytes()
        assert K.closed.tobytes() == wanted.closed.tobytes()
        if old.contact[0] is not None:
            assert new.contact[0].pressure.tobytes() == old.contact[0].pressure.tobytes()
        x = np.full((1, old.space.dim), 0.37)
        assert new.stress(x).tobytes() == old.stress(x).tobytes()
    assert xc.solve(again[0].problem).u.tobytes() == xc.solve(make()).u.tobytes()


def test_a_single_solution_comes_back_as_one(tmp_path):
    solution = xc.solve(plate())
    assert xc.load(xc.save(solution, tmp_path / "one.npz")).u.tobytes() == solution.u.tobytes()


def test_a_function_is_named_and_not_stored(tmp_path):
    def pull(x):
        return np.tile((0.0, 80.0), (len(x), 1))

    again = xc.load(xc.save(xc.solve(plate(pull)), tmp_path / "one"))
    assert xc.stress_intensity(again).K_I.min() > 0
    with pytest.raises(xc.ProblemError, match="the function pull was not stored"):
        xc.solve(again.problem)
    page = xc.report(again, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "function pull" in page


def test_history_in_one_file(tmp_path):
    steps = xc.grow(plate(), xc.paris(1e-11, 3), xc.max_hoop_stress, xc.Cycle(0, 1), da=0.2,
                    max_steps=2, progress=False)  # fmt: skip
    history = xc.collect(steps, tmp_path / "run")
    for again in (xc.load(xc.save(history, tmp_path / "run.npz")), xc.load(tmp_path / "run")):
        assert again.table().tobytes() == history.table().tobytes()
        assert again.ended == history.ended
        assert again.mesh.points.tobytes() == history.mesh.points.tobytes()
    (tmp_path / "run" / "mesh.npz").write_bytes(b"half")
    assert xc.load(tmp_path / "run").mesh is None  # the steps are what counts


def test_misuse_says_what_to_give(tmp_path):
    solution = xc.solve(plate())
    for call, words in (
        (lambda: xc.save(3, tmp_path / "a"), "save takes a Solution"),
        (lambda: xc.save([], tmp_path / "a"), "save takes a Solution"),
        (lambda: xc.save([solution, xc.solve(plate())], tmp_path / "a"), "different solves"),
        (lambda: xc.save(solution, 3), "is not a path"),
    ):
        with pytest.raises(xc.ProblemError, match=words):
            call()
    (tmp_path / "text.npz").write_text("nothing")
    with pytest.raises(xc.ProblemError, match="not a file that save wrote"):
        xc.load(tmp_path / "text.npz")
    with pytest.raises(xc.ProblemError, match="cannot be written"):
        xc.save(solution, tmp_path / "text.npz" / "below")
