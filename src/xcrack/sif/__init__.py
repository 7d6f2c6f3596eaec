"""Stress intensity factors at tips and along fronts."""
