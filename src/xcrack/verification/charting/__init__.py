"""Error against time of a user's own scene."""
