"""Load histories: turning points, rainflow cycles, files, and the spectrum TWIST."""
