"""Integrators: Euler's rule, and growth of second order at one solve a step."""
