"""Contact of the lips: multipliers, active sets, and the methods they are compared with."""
