"""Linear systems: bases, factors, multigrid."""
