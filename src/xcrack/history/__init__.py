"""Runs collected, stored on disk and taken up again."""
