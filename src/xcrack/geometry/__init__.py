"""Triangles, polygons and distances as arrays; no mesh, no crack."""
