"""Accuracy against time: `python -m benchmarks` measures, draws and prints who is ahead.

Run from a clone; the wheel has none of this. `economy`, `parts`, `solid`, `stability` and `start`
are programs of their own: `python -m benchmarks.economy`.
"""
