"""Contact of the crack faces: multipliers, active sets, and the methods they are compared with."""
