"""From a problem to its solutions."""
