"""Values of growth: a step, what the next one needs, options of a run and their fingerprint."""
