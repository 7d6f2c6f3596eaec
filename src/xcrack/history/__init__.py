"""Runs collected, kept on disk and taken up again."""
