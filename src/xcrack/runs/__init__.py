"""Runs kept on disk and resumed, lives, campaigns."""
