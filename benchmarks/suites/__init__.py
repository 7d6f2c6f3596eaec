"""Which cases make up each chart: few for a first look, all for the record."""
