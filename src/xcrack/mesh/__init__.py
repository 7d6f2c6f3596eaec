"""Meshes of simplices: values, generators, files, refinement, location of points."""
