"""Proof that xcrack is right: exact fields, the verification book, error against time."""
