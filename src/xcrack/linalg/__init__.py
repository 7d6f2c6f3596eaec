"""Linear systems and complementarity: bases, factors, multigrid, active sets."""
