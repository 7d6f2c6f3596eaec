"""Reports of solutions and runs: one HTML file that needs no network, and its numbers as json."""
