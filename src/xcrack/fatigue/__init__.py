"""From K to growth a cycle: criteria, laws, closure, thresholds, spectra."""
