"""Where tips and fronts go: advance, cycles, what they meet."""
