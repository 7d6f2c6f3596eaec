"""Estimated errors of functionals of a solution, by dual solutions and a surplus space."""
