"""Wrong input for every public name."""
