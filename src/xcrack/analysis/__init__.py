"""From a problem to its solutions, contact included."""
