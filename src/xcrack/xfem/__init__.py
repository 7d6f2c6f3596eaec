"""Enriched functions, their integration and their matrices."""
