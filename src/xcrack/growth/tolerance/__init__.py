"""Mesh and steps from a tolerance: scout, corridor, sizes."""
