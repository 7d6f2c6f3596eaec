"""One file a benchmark; each has its cases in `CASES`, one for each modelling it is solved with."""
