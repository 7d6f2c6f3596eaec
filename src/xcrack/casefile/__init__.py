"""Scenes as toml files: read into the same dataclasses that a script makes, errors by line."""
