"""Criteria, laws, and the growth of cracks step by step."""
