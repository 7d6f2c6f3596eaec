"""Cracks: shapes, place in a body, tips and fronts, advance, junctions."""
