"""Cracks: their shapes, their place in a body, their fronts and how these advance."""
