"""Stress intensity factors at tips and along fronts, with their error bars."""
