"""Which way a crack turns and what drives it: criteria, kinks, checks of a user's functions."""
