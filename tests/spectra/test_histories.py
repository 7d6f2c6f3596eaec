"""Files and TWIST."""

import numpy as np
import pytest

from xcrack import ProblemError, Spectrum, read_spectrum, twist


def test_one_column(tmp_path):
    file = tmp_path / "wing.txt"
    file.write_text("load factor\n# a comment\n0\n1.0\n\n  0.25\n.5\n")
    spectrum = read_spectrum(file, unit="flight")
    assert spectrum.factors.tolist() == [0, 1, 0.25, 0.5]
    assert spectrum.unit == "flight"
    with pytest.raises(ValueError, match="read-only"):
        spectrum.factors[0] = 2


def test_columns_and_rows(tmp_path):
    file = tmp_path / "many.csv"
    file.write_text("time; load; temperature\n0.0; 0; 20\n0.5; 1; 20\n1; -0.5; 20\n")
    assert read_spectrum(file, column=1).factors.tolist() == [0, 1, -0.5]
    file.write_text("! min max count\n0.1, 1.0, 90\n0.4, 0.8, 1e4\n")
    spectrum = read_spectrum(str(file), rows=True)
    assert spectrum.cycles[["min", "max", "count"]].tolist() == [(0.1, 1, 90), (0.4, 0.8, 1e4)]


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("", {}, "no numbers"),
        ("0\n1\nhigh\n", {}, "line 3: 'high' is no number"),
        ("0\nnan\n", {}, "line 2: 'nan': every number must be finite"),
        ("0 1\n2\n", {"column": 0}, "line 2: 1 numbers"),
        ("0 1\n2 3\n", {}, "give column="),
        ("0 1\n2 3\n", {"column": 2}, "no column 2"),
        ("0 1\n2 3\n", {"rows": True}, "2 numbers a line"),
        ("1\n1\n", {}, "do not vary"),
    ],
)
def test_bad_files(tmp_path, text, options, words):
    file = tmp_path / "bad.txt"
    file.write_text(text)
    with pytest.raises(ProblemError, match=words):
        read_spectrum(file, **options)


def test_no_file(tmp_path):
    with pytest.raises(ProblemError, match="cannot be read"):
        read_spectrum(tmp_path / "none.txt")


def test_twist_has_the_totals_of_its_report():
    """4000 flights, 398 665 gusts; per level as printed (de Jonge et al. 1973)."""
    spectrum = twist(mean=2.0, seed=20262)
    gusts = spectrum.factors[spectrum.factors > 2.0] / 2.0 - 1
    sizes, counts = np.unique(gusts.round(9), return_counts=True)
    assert sizes.tolist() == [0.222, 0.375, 0.53, 0.685, 0.84, 0.995, 1.15, 1.3, 1.5, 1.6]
    assert counts.tolist() == [358665, 34800, 4170, 800, 152, 52, 18, 5, 2, 1]
    down = 1 - spectrum.factors[(spectrum.factors < 2.0) & (spectrum.factors != -1.0)] / 2.0
    down = np.concatenate([down, np.full((spectrum.factors == -1.0).sum() - 4000, 1.5)])
    assert np.array_equal(np.sort(down.round(9)), np.sort(gusts.round(9)))
    # ground, then gusts: begin of each flight
    assert (spectrum.factors == -1.0).sum() == 4000 + 2  # two gusts of 1.5 end on the ground load


def test_twist_is_drawn_anew_and_the_same_for_a_seed():
    one, same, other = (twist(mean=1.0, seed=seed, flights=40) for seed in (5, 5, 6))
    assert np.array_equal(one.factors, same.factors)
    assert not np.array_equal(one.factors, other.factors)
    assert one.unit == "40 flights"
    assert isinstance(one, Spectrum)
    with pytest.raises(ProblemError, match="flights = 4001"):
        twist(mean=1.0, seed=5, flights=4001)
    with pytest.raises(ProblemError, match="mean = 0"):
        twist(mean=0, seed=5)
