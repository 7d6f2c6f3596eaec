"""Error of a linear goal of a solution."""
