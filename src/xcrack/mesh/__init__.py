"""Meshes of simplices: their values, generators, files, and where points lie in them."""
