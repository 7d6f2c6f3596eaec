"""Growth of cracks, step by step."""
